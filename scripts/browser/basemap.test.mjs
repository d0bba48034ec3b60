// The background map: roads and buildings, their layer, and hostile maps.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { after, test } from "node:test";
import { gunzipSync } from "node:zlib";

import { TIMEOUT_MS, camera, folder, goTo, recordTexts, painted, mapImage, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { STANDOFF, openServed, results, serving } from "./serving.mjs";

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

test("tiles of a tile server are requested only with --tiles, and drawn at their place", { timeout: 2 * TIMEOUT_MS }, async () => {
  // Two colours alternate like those of a chessboard.
  const colourOf = (x, y) => ((x + y) % 2 ? "#0000ff" : "#ff0000");
  const requested = [];
  const server = createServer((request, response) => {
    requested.push(request.url);
    const [, , x, y] = request.url.match(/^\/(\d+)\/(\d+)\/(\d+)\.svg$/) ?? assert.fail(request.url);
    const picture = `<svg xmlns="http://www.w3.org/2000/svg" width="256" height="256"><rect width="256" height="256" fill="${colourOf(Number(x), Number(y))}"/></svg>`;
    response.writeHead(200, { "content-type": "image/svg+xml", "access-control-allow-origin": "*" }).end(picture);
  });
  // A failed test does not reach its end.
  after(() => {
    server.close();
    server.closeAllConnections();
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const origin = `http://127.0.0.1:${server.address().port}`;
  const traffic = join(results, "degrees.csv");
  const [lat0, lon0] = [44.49, 11.34];
  writeFileSync(traffic, ["time_s,vehicle,lat,lon", ...Array.from({ length: 40 }, (_, t) => `${t},car,${lat0 + 1e-4 * t},${lon0}`)].join("\n"));
  execFileSync(STANDOFF, ["run", "--traffic", traffic, "--uavs", "1", "--out", "degrees"], { cwd: results, stdio: "ignore" });

  const without = await serving("view", "degrees");
  const plain = await openServed(without.address);
  await plain.page.waitForSelector('[data-ready="charts"]');
  assert.deepEqual([requested, plain.complaints], [[], []]);
  await plain.close();
  await without.end();

  const view = await serving("view", "degrees", "--tiles", `${origin}/{z}/{x}/{y}.svg`);
  const { page, complaints, close } = await openServed(view.address);
  await page.waitForFunction(() => /^(\d+) of \1$/.test(document.getElementById("map").dataset.tiles ?? ""));
  await hideOtherLayers(page);
  await page.getByLabel("Follow").selectOption("run");
  await page.getByLabel("Map tiles").check();
  await page.waitForFunction(() => /^(\d+) of \1$/.test(document.getElementById("map").dataset.tiles ?? ""));
  const zoom = Number(requested.at(-1).split("/")[1]);
  // Middles of tiles, which a local approximation places to within a metre; tiles are hundreds of metres wide.
  const tiles = [...new Set(requested)].map((path) => path.match(/\d+/g).map(Number)).filter(([z]) => z === zoom);
  const middle = ([, x, y]) => {
    const lat = Math.atan(Math.sinh(Math.PI * (1 - (2 * (y + 0.5)) / 2 ** zoom)));
    const lon = ((x + 0.5) / 2 ** zoom) * 360 - 180;
    return [(lon - lon0) * (Math.PI / 180) * 6378137 * Math.cos((lat0 * Math.PI) / 180), ((lat * 180) / Math.PI - lat0) * (Math.PI / 180) * 6367000];
  };
  const { x_m, y_m, px_per_m } = await camera(page);
  const [width, height] = await page.locator("#map").evaluate(({ clientWidth, clientHeight }) => [clientWidth, clientHeight]);
  const isFree = ([east, north]) => Math.abs(east - x_m) * px_per_m < width / 2 - 120 && Math.abs(north - y_m) * px_per_m < height / 2 - 120;
  const free = tiles.filter((tile) => isFree(middle(tile)));
  assert.ok(free.length >= 4, `${free.length} of ${tiles.length} tiles can be checked`);
  const found = await colours(page, free.map(middle));
  free.forEach(([, x, y], k) => {
    const [red, , blue] = found[k].split(",").map(Number);
    assert.equal(red > blue, colourOf(x, y) === "#ff0000", `tile ${x}, ${y}: ${found[k]}`);
  });
  // This test reads pixels.
  const foreign = complaints.filter((complaint) => !complaint.startsWith(`${origin}/`) && !complaint.includes("getImageData"));
  assert.deepEqual(foreign, [], "nothing else is requested");
  await close();
  assert.equal(await view.end(), 0);
});

test("names of roads are drawn along them and cover no other text", { timeout: 2 * TIMEOUT_MS }, async () => {
  const net = ['<net version="1.20"><location netOffset="0,0" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="!"/>'];
  ["Long Street", "Short Lane", "Third <Road>"].forEach((name, k) => {
    const text = name.replace("<", "&lt;").replace(">", "&gt;");
    net.push(`<edge id="${k}" name="${text}"><lane id="${k}_0" index="0" speed="14" length="9" shape="${-900},${150 * k - 150} ${k === 1 ? -897 : 900},${150 * k - 150}"/></edge>`);
  });
  writeFileSync(join(results, "names.net.xml"), `${net.join("\n")}</net>`);
  execFileSync(STANDOFF, ["run", "tour/02-two-uavs", "--set", "duration_s=20", "--map", "names.net.xml", "--out", "names"], { cwd: results, stdio: "ignore" });
  const view = await serving("view", "names");
  const { page, complaints, close } = await openServed(view.address);
  await page.waitForSelector('[data-ready="charts"]');
  await drawn(page);
  await recordTexts(page);
  await goTo(page, 10);
  const shown = (await texts(page)).map(({ text }) => text);
  assert.ok(shown.includes("Long Street") && shown.includes("Third <Road>"), `${shown}`);
  assert.ok(!shown.includes("Short Lane"), "a road shorter than its name has no name");
  await page.locator("#layer-menu").click();
  await page.getByLabel("Road names").uncheck();
  await recordTexts(page);
  await goTo(page, 12);
  assert.ok(!(await texts(page)).some(({ text }) => text === "Long Street"));
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});
