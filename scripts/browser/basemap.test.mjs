// The background map: roads and buildings, their layer, and hostile maps.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { gunzipSync } from "node:zlib";

import { camera, folder, goTo, recordTexts, painted, mapImage, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

/** Waits until the background map is drawn completely. */
async function drawn(page) {
  await painted(page);
  await page.waitForSelector('#map[data-basemap-tiles="all"]');
  await painted(page);
}

/** The checkbox of the layer of the background map. */
async function layer(page) {
  if (!(await page.locator("#layers").isVisible())) await page.locator("#layer-menu").click();
  return page.getByLabel("Roads and buildings");
}

/** Colours of the map at world positions, as "r,g,b": the darkest pixel within `radius_px` of each position. */
async function colours(page, positions, radius_px = 0) {
  await painted(page);
  return page.locator("#map").evaluate((canvas, { positions, radius_px }) => {
    const { eastM, northM, pxPerM } = canvas.dataset;
    const ctx = canvas.getContext("2d");
    const ratio = canvas.width / canvas.clientWidth;
    return positions.map(([x_m, y_m]) => {
      const x = (canvas.clientWidth / 2 + (x_m - eastM) * pxPerM) * ratio;
      const y = (canvas.clientHeight / 2 - (y_m - northM) * pxPerM) * ratio;
      const side = 2 * radius_px + 1;
      const { data } = ctx.getImageData(Math.floor(x) - radius_px, Math.floor(y) - radius_px, side, side);
      const found = Array.from({ length: side * side }, (_, k) => [...data.slice(4 * k, 4 * k + 3)]);
      return String(found.reduce((a, b) => (a[0] + a[1] + a[2] <= b[0] + b[1] + b[2] ? a : b)));
    });
  }, { positions, radius_px });
}

/** Hides all layers except the background map. */
async function hideOtherLayers(page) {
  await layer(page);
  for (const box of await page.getByRole("group", { name: "Layers" }).getByRole("checkbox").all()) {
    if ((await box.getAttribute("name")) !== "layer-basemap" && (await box.isChecked())) await box.click();
  }
}

/** Midpoints of the roads of a record's map, m. */
function roads(flight) {
  const { layers } = JSON.parse(gunzipSync(readFileSync(join(folder(flight), "map.json.gz"))));
  return layers.flatMap(({ lines }) => lines.map(([x, y, dx, dy]) => [(x + dx / 2) / 10, (y + dy / 2) / 10]));
}

/** Positions of the vehicles in the traffic file of the city, m. */
function vehicles(time_s) {
  const text = gunzipSync(readFileSync(new URL("../../scenarios/traffic/city.fcd.xml.gz", import.meta.url))).toString();
  const step = text.split(`<timestep time="${time_s.toFixed(2)}">`)[1].split("</timestep>")[0];
  return [...step.matchAll(/ x="([^"]+)" y="([^"]+)"/g)].map(([, x, y]) => [Number(x), Number(y)]);
}

const LIGHT = { ground: "255,255,255", minor: "211,218,226" };

inReport("the roads of a city are drawn at their positions, and their layer can be hidden", { flight: "city" }, async (page) => {
  await goTo(page, 40);
  await page.keyboard.press("0");
  await drawn(page);
  assert.ok(Number(await page.locator("#map").getAttribute("data-basemap")) > 500, "lines and areas were loaded");
  const whole = await mapImage(page);
  await hideOtherLayers(page);
  for (let press = 0; press < 6; press++) await page.keyboard.press("+");
  await drawn(page);
  const { x_m, y_m, px_per_m } = await camera(page);
  const near = roads("city").filter(([x, y]) => Math.abs(x - x_m) * px_per_m < 300 && Math.abs(y - y_m) * px_per_m < 200);
  assert.ok(near.length >= 2, `visible roads: ${near.length}`);
  for (const colour of await colours(page, near, 1)) assert.equal(colour, LIGHT.minor, "the midpoint of a road");
  // Streets are 230 m apart and houses are in the middle between them: positions 25 m from a street are empty.
  for (const colour of await colours(page, near.map(([x, y]) => [x + 25, y + 25]))) assert.equal(colour, LIGHT.ground);
  const box = await layer(page);
  await box.click();
  for (const colour of await colours(page, near, 1)) assert.equal(colour, LIGHT.ground, "without the layer");
  await box.click();
  await page.keyboard.press("0");
  for (const other of await page.getByRole("group", { name: "Layers" }).getByRole("checkbox").all()) {
    if (!(await other.isChecked())) await other.click();
  }
  await drawn(page);
  assert.ok((await mapImage(page)) === whole, "the map is the same as before");
});

inReport("the vehicles of the traffic file are on the roads", { flight: "city" }, async (page) => {
  await goTo(page, 100);
  await hideOtherLayers(page);
  await page.getByLabel("Follow").selectOption("group 1");
  for (let press = 0; press < 3; press++) await page.keyboard.press("+");
  await drawn(page);
  const view = await camera(page);
  const near = vehicles(100).filter(([x, y]) => Math.abs(x - view.x_m) * view.px_per_m < 300 && Math.abs(y - view.y_m) * view.px_per_m < 200);
  assert.ok(near.length >= 4, `visible vehicles: ${near.length}`);
  assert.ok(!(await colours(page, near)).includes(LIGHT.ground), "all vehicles are on roads");
});

inReport("the background map follows the camera and the zoom in both themes", { flight: "city" }, async (page) => {
  await hideOtherLayers(page);
  await page.getByLabel("Follow").selectOption("uav 0");
  await page.evaluate(() => document.activeElement.blur());
  for (const [time_s, press] of [[10, "+"], [30, "-"], [50, "-"], [90, "+"]]) {
    await goTo(page, time_s);
    for (let k = 0; k < 3; k++) await page.keyboard.press(press);
    await drawn(page);
    const { x_m, y_m, px_per_m } = await camera(page);
    const near = roads("city").filter(([x, y]) => Math.abs(x - x_m) * px_per_m < 300 && Math.abs(y - y_m) * px_per_m < 200);
    const hit = (await colours(page, near, 1)).filter((colour) => colour !== LIGHT.ground).length;
    assert.ok(near.length > 0 && hit === near.length, `${hit} of ${near.length} roads at ${time_s} s, ${px_per_m} px per m`);
  }
  await page.keyboard.press("t");
  await drawn(page);
  const { x_m, y_m } = await camera(page);
  for (const value of (await colours(page, [[x_m, y_m]]))[0].split(",")) assert.ok(Number(value) < 90, `dark: ${value}`);
});

inReport("a run without a background map has no layer for it", {}, async (page) => {
  await page.locator("#layer-menu").click();
  assert.equal(await page.getByLabel("Roads and buildings").count(), 0);
  assert.equal(await page.locator("#map").getAttribute("data-basemap"), null);
});

inReport("a hostile map does no harm, and its copyright notice is shown", { flight: "hostile-map" }, async (page) => {
  await recordTexts(page);
  await goTo(page, 10);
  await drawn(page);
  const labels = (await texts(page)).map(({ text }) => text);
  assert.ok(labels.includes("\u00a9 OpenStreetMap contributors"), `${labels}`);
  const box = await layer(page);
  const before = await mapImage(page);
  await box.click();
  assert.ok((await mapImage(page)) !== before, "hiding the layer changes the map");
});
