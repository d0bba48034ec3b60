// The view in three dimensions: its positions equal the record, it follows the time, and a link opens it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { downloaded, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf, same } from "./record.mjs";

/** Waits until the view shows a time. */
const shows = (page, time_s) => page.waitForFunction((text) => document.querySelector(".view-3d").dataset.timeS === text, time_s.toFixed(3));

/** The symbols of UAVs and targets in the view: id and position, m. */
async function symbols(page) {
  const found = await page.evaluate(() => document.querySelector(".view-3d").data.filter(({ customdata }) => customdata).flatMap(({ x, y, z, customdata, marker }) =>
    customdata.map(({ kind, id }, k) => ({ kind, id, at: [x[k], y[k], z[k]], symbol: marker.symbol }))));
  return { uavs: found.filter(({ kind }) => kind === "uav"), targets: found.filter(({ kind, symbol }) => kind === "target" && symbol === "circle") };
}

/** Checks positions and altitudes at a time step against the record. */
async function equalsRecord(page, record, time_s) {
  await goTo(page, time_s);
  await shows(page, time_s);
  const { uavs, targets } = await symbols(page);
  const rows = record.rows("uavs", time_s);
  assert.deepEqual(uavs.map(({ id }) => id), [...rows.keys()]);
  for (const { id, at } of uavs) {
    const { x_m, y_m, altitude_m, commanded_altitude_m } = rows.get(id);
    same(at, [x_m, y_m, altitude_m ?? commanded_altitude_m ?? 0], `UAV ${id}`);
  }
  assert.ok(targets.length > 0 && targets.every(({ at }) => at[2] === 0), "targets are on the ground");
  const altitudes = await page.evaluate(() => document.querySelector(".view-3d").data.flatMap(({ mode, z }) => (mode === "lines" ? [...z] : [])));
  for (const [id, { altitude_m }] of record.rows("groups", time_s)) {
    assert.ok(altitudes.filter((z) => z !== null && Math.abs(z - altitude_m) < 1e-3).length >= 72, `the orbit of group ${id} is at ${altitude_m} m`);
  }
  return { uavs, targets };
}

for (const flight of ["figure-9", "separation"]) {
  inReport(`UAVs, orbits and targets in three dimensions equal the record: ${flight}`, { flight }, async (page) => {
    const record = recordOf(flight);
    await page.getByRole("button", { name: "3D" }).click();
    const before = await equalsRecord(page, record, 20);
    assert.ok(before.uavs.some(({ at }) => at[2] > 0), "UAVs are above the ground");
    const after = await equalsRecord(page, record, 40);
    assert.notDeepEqual(after.uavs, before.uavs);
    // The view is drawn: pixels of the canvas differ.
    const { width, height } = await page.locator(".view-3d").boundingBox();
    assert.ok(width > 400 && height > 400, `${width} x ${height}`);
    await page.locator("#save-menu").click();
    assert.ok(await page.getByRole("button", { name: "Vector graphic" }).isDisabled(), "WebGL has no vector graphic");
    const file = await downloaded(page, () => page.getByRole("button", { name: "Image" }).click());
    const image = readFileSync(file.path);
    const colours = await page.evaluate(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [image.width, image.height];
      const ctx = canvas.getContext("2d");
      ctx.drawImage(image, 0, 0);
      const { data } = ctx.getImageData(0, 0, canvas.width, canvas.height);
      return new Set(Array.from({ length: data.length / 4 }, (_, k) => (data[4 * k] << 16) | (data[4 * k + 1] << 8) | data[4 * k + 2])).size;
    }, image.toString("base64"));
    assert.ok(colours > 200, `${colours} colours`);
    await page.keyboard.press("Escape");
    await page.locator("body").press("d");
    assert.ok(await page.locator(".view-3d").isHidden(), "the key shows the map again");
    assert.equal(await page.getByRole("button", { name: "3D" }).getAttribute("aria-pressed"), "false");
  });
}

inReport("zones in three dimensions are between their floors and ceilings, in the scene", { flight: "zones" }, async (page) => {
  await page.getByRole("button", { name: "3D" }).click();
  await goTo(page, 5);
  await shows(page, 5);
  const levels = (x_m, y_m) => page.evaluate(([x_m, y_m]) => {
    const found = document.querySelector(".view-3d").data.flatMap(({ x, y, z }) => [...z].filter((_, k) => x[k] === x_m && y[k] === y_m));
    return [...new Set(found)].sort((one, other) => one - other);
  }, [x_m, y_m]);
  const top_m = await page.evaluate(() => document.querySelector(".view-3d").layout.scene.zaxis.range[1]);
  assert.ok(top_m > 400 && top_m < 500, `the scene has room for the floor at 400 m: ${top_m}`);
  assert.deepEqual(await levels(900, -350), [100, 350]);
  assert.deepEqual(await levels(-900, 350), [0, 120]);
  assert.deepEqual(await levels(-900, -750), [400, top_m]);
  assert.deepEqual(await levels(900, 750), [0]);
});

inReport("a link opens the view in three dimensions, which shows the area of the map", {}, async (page) => {
  await page.evaluate(() => (location.hash = "#t=30&view=200,100,0.5&3d=1"));
  await shows(page, 30);
  const ranges = await page.evaluate(() => {
    const { xaxis, yaxis } = document.querySelector(".view-3d").layout.scene;
    return [xaxis.range, yaxis.range].map(([from, to]) => (from + to) / 2);
  });
  assert.deepEqual(ranges, [200, 100]);
  const width_m = () => page.evaluate(() => document.querySelector(".view-3d").layout.scene.xaxis.range.reduce((from, to) => to - from));
  const before = await width_m();
  await page.getByRole("button", { name: "Zoom in" }).click();
  await page.waitForFunction((before) => document.querySelector(".view-3d").layout.scene.xaxis.range.reduce((from, to) => to - from) < 0.9 * before, before);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => /^#t=30&view=200,100,0\.7&3d=1$/.test(location.hash));
  await page.evaluate(() => (location.hash = "#3d=2"));
  await painted(page);
  assert.match(await page.locator("#event-summary").textContent(), /3d=2, which must be 1/);
});
