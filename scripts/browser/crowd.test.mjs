// Hundreds of vehicles: all are in view with small symbols, drawing takes few canvas operations, and each can be found.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { camera, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

const VEHICLES = 650;
const traffic = () => readFileSync(`${process.env.STANDOFF_FLIGHTS}/650.csv`, "utf8").trim().split("\n").slice(1).map((line) => line.split(","));

inReport("a report with 650 vehicles opens with all of them in view, with small symbols", { flight: "crowd-650" }, async (page) => {
  const label = await page.locator("#map").getAttribute("aria-label");
  assert.match(label, new RegExp(`, ${VEHICLES} targets,`));
  const { x_m, y_m, px_per_m } = await camera(page);
  const [half_x, half_y] = await page.locator("#map").evaluate((map) => [map.clientWidth / 2, map.clientHeight / 2]);
  for (const [t_s, name, east_m, north_m] of traffic()) {
    const [x, y] = [Math.abs(east_m - x_m) * px_per_m, Math.abs(north_m - y_m) * px_per_m];
    assert.ok(x < half_x && y < half_y, `${name} at ${t_s} s, ${east_m} m east, ${north_m} m north`);
  }
  const scale = () => page.locator("#map").evaluate((map) => Number(map.dataset.symbolScale));
  assert.ok((await scale()) <= 0.6, `${await scale()}`);
  await page.getByLabel("Follow").selectOption("group 0");
  for (let press = 0; press < 8; press++) await page.getByRole("button", { name: "Zoom in" }).click();
  await painted(page);
  assert.equal(await scale(), 1, "symbols have their full size after zooming in");
});

inReport("drawing 650 vehicles with all layers takes few canvas operations", { flight: "crowd-650" }, async (page) => {
  await page.locator("#layer-menu").click();
  await page.getByLabel("Preset").selectOption("everything");
  await page.keyboard.press("Escape");
  await goTo(page, 15);
  await page.evaluate(() => {
    const prototype = CanvasRenderingContext2D.prototype;
    [window.strokes, window.drawn] = [0, Number(document.body.dataset.frames)];
    for (const name of ["stroke", "fill", "strokeText", "fillText", "save"]) {
      const act = prototype[name];
      prototype[name] = function (...rest) {
        if (this.canvas.id === "map") window.strokes += 1;
        return act.apply(this, rest);
      };
    }
  });
  await goTo(page, 16);
  await painted(page);
  const { strokes, layers } = await page.evaluate(() => ({
    strokes: window.strokes / (Number(document.body.dataset.frames) - window.drawn), layers: document.getElementById("map").dataset.layers,
  }));
  assert.ok(layers.split(" ").length >= 12, layers);
  assert.ok(strokes > 50 && strokes < 300, `${strokes} operations per frame`);
});

inReport("one of 650 vehicles is found by its name, and its row is visible", { flight: "crowd-650" }, async (page) => {
  await goTo(page, 16);
  await page.getByRole("tab", { name: "State" }).click();
  const find = page.getByLabel("Find");
  await find.fill("car");
  assert.equal(await page.locator("#search-names option").count(), 20, "at most 20 names are proposed");
  await find.fill("car 649");
  await find.press("Enter");
  await painted(page);
  const row = page.locator("#targets tbody tr.chosen");
  assert.equal(await row.locator("td").first().textContent(), "car 649");
  const [box, pane] = [await row.boundingBox(), await page.getByRole("tabpanel", { name: "State" }).boundingBox()];
  assert.ok(box.y >= pane.y && box.y + box.height <= pane.y + pane.height + 1, "the row is visible");
  const [, , x_m, y_m] = traffic().find(([t_s, name]) => t_s === "16" && name === "car 649");
  const view = await camera(page);
  const { width, height } = await page.locator("#map").boundingBox();
  assert.ok(Math.hypot(view.x_m - x_m, view.y_m - y_m) < 100, "the map shows the vehicle");
  assert.ok(Math.min(width, height) / view.px_per_m < 1000 && Math.min(width, height) / view.px_per_m >= 600, "with its surroundings");
});
