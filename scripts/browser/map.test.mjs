// The map: following, layers, zoom, pan and ruler, with mouse, keyboard and touch.

import assert from "node:assert/strict";

import { TABLET, camera, goTo, recordTexts, painted, mapImage, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const record = recordOf("figure-9");

/** Converts a position relative to the upper left corner of the map to a position on the page. */
async function on(page, x, y) {
  const box = await page.locator("#map").boundingBox();
  return [box.x + x, box.y + y];
}

async function drag(page, from, to) {
  await page.mouse.move(...(await on(page, ...from)));
  await page.mouse.down();
  await page.mouse.move(...(await on(page, (from[0] + to[0]) / 2, (from[1] + to[1]) / 2)));
  await page.mouse.move(...(await on(page, ...to)));
  await page.mouse.up();
}

/** Asserts that a value is within a tolerance of the expected value. */
function near(value, expected, tolerance, what) {
  assert.ok(Math.abs(value - expected) <= tolerance, `${what}: ${value}, expected ${expected} within ${tolerance}`);
}

/** The centre of the map, px. */
async function middle(page) {
  return page.locator("#map").evaluate((canvas) => [canvas.clientWidth / 2, canvas.clientHeight / 2]);
}

inReport("the map follows a UAV or a group until it is dragged", {}, async (page) => {
  const follow = page.getByLabel("Follow");
  for (const [value, table, id] of [["uav 3", "uavs", 3], ["group 1", "groups", 1]]) {
    await follow.selectOption(value);
    for (const time_s of [10, 60]) {
      await goTo(page, time_s);
      const { x_m, y_m } = record.rows(table, time_s).get(id);
      const view = await camera(page);
      near(view.x_m, x_m, 1e-3, `${value} east`);
      near(view.y_m, y_m, 1e-3, `${value} north`);
    }
  }
  await goTo(page, 20.25);
  const [before, after] = [20, 20.5].map((time_s) => record.rows("groups", time_s).get(1));
  near((await camera(page)).x_m, (before.x_m + after.x_m) / 2, 1e-3, "positions are interpolated between time steps");
  await drag(page, [300, 300], [330, 300]);
  assert.equal(await follow.inputValue(), "");
  const held = await camera(page);
  await goTo(page, 90);
  assert.deepEqual(await camera(page), held, "a map that follows nothing does not move");
  await page.locator("#map").focus();
  await page.keyboard.press("f");
  assert.equal(await follow.inputValue(), "group 0");
});

inReport("each layer can be hidden and shown again", {}, async (page) => {
  await page.evaluate(() => (location.hash = "#t=40&uav=0"));
  await page.getByLabel("Follow").selectOption("group 0");
  await page.locator("#layer-menu").click();
  const layers = page.getByRole("group", { name: "Layers" }).getByRole("checkbox");
  const count = await layers.count();
  assert.equal(count, 12);
  let whole = await mapImage(page);
  for (let k = 0; k < count; k++) {
    const layer = layers.nth(k);
    const name = (await layer.getAttribute("name")).replace("layer-", "");
    assert.ok((await layer.locator("xpath=..").getAttribute("title")).length > 20, `${name} has a description`);
    if (name === "ellipses") {
      // At a small scale the ellipses are smaller than the symbols and are not drawn.
      await layer.click();
      assert.ok((await mapImage(page)) === whole, "small ellipses are not drawn");
      await layer.click();
      for (let press = 0; press < 6; press++) await page.keyboard.press("+");
      whole = await mapImage(page);
    } else if (name === "vectors") {
      await page.keyboard.press("0");
      whole = await mapImage(page);
    }
    assert.ok(await layer.isChecked());
    await layer.click();
    assert.ok((await mapImage(page)) !== whole, `hiding ${name} changes the map`);
    const shown = (await page.locator("#map").getAttribute("data-layers")).split(" ");
    assert.ok(shown.length === count - 1 && !shown.includes(name), `${name} is not among ${shown}`);
    await layer.click();
    assert.ok((await mapImage(page)) === whole, `showing ${name} restores the map`);
  }
  // The list covers other controls: a click elsewhere closes it.
  assert.ok(await layers.first().isVisible());
  await page.getByRole("tab", { name: "State" }).click();
  assert.ok(!(await layers.first().isVisible()));
});

/** The labels of the last frame without those of the scale bar: text and box. */
async function labels(page) {
  const all = (await texts(page)).filter(({ text }) => !/^(N|[\d.]+ k?m)$/.test(text));
  return all.map(({ text, x, y, width }) => ({ text, left: x, right: x + width, top: y - 5, bottom: y + 5 }));
}

inReport("labels do not overlap, and the less important ones are left out if there is no space", {}, async (page) => {
  const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  await recordTexts(page);
  await goTo(page, 40);
  const near = await labels(page);
  for (let press = 0; press < 12; press++) await page.keyboard.press("-");
  const far = await labels(page);
  for (const shown of [near, far]) {
    for (const [k, one] of shown.entries()) {
      for (const other of shown.slice(0, k)) assert.ok(!overlap(one, other), `${one.text} overlaps ${other.text}`);
    }
  }
  const names = near.map((label) => label.text);
  for (const id of record.ids("uavs")) assert.ok(names.includes(`UAV ${id}`), `UAV ${id} is among ${names}`);
  for (const id of record.rows("groups", 40).keys()) assert.ok(names.includes(`group ${id}`), `group ${id} is among ${names}`);
  assert.ok(far.length > 0 && far.length < near.length && far[0].text.startsWith("UAV"), `${far.map((label) => label.text)}`);
});

inReport("zooming keeps the point under the pointer in place, and \"Show all\" restores the view", {}, async (page) => {
  const first = await camera(page);
  const [x, y] = [200, 150];
  const [cx, cy] = await middle(page);
  const under = ({ x_m, y_m, px_per_m }) => [x_m + (x - cx) / px_per_m, y_m - (y - cy) / px_per_m];
  await page.mouse.move(...(await on(page, x, y)));
  await page.mouse.wheel(0, -300);
  await page.waitForFunction((scale) => Number(document.getElementById("map").dataset.pxPerM) > scale * 1.2, first.px_per_m);
  const zoomed = await camera(page);
  near(under(zoomed)[0], under(first)[0], 0.01, "east coordinate under the pointer");
  near(under(zoomed)[1], under(first)[1], 0.01, "north coordinate under the pointer");
  await page.getByRole("button", { name: "Show all" }).click();
  assert.deepEqual(await camera(page), first);
  for (const [button, key, way] of [["Zoom in", "+", 1], ["Zoom out", "-", -1]]) {
    await page.getByRole("button", { name: button }).click();
    const once = await camera(page);
    assert.ok((once.px_per_m - first.px_per_m) * way > 0, button);
    near(once.x_m, first.x_m, 1e-6, "the centre stays in place");
    await page.keyboard.press(key);
    assert.ok(((await camera(page)).px_per_m - once.px_per_m) * way > 0, key);
    await page.keyboard.press("0");
    assert.deepEqual(await camera(page), first);
  }
});

inReport("the map can be dragged, and shows the coordinates under the pointer", {}, async (page) => {
  const first = await camera(page);
  await drag(page, [300, 300], [340, 270]);
  const now = await camera(page);
  near(now.x_m, first.x_m - 40 / first.px_per_m, 1e-6, "east");
  near(now.y_m, first.y_m - 30 / first.px_per_m, 1e-6, "north");
  const [cx, cy] = await middle(page);
  const text = await page.locator("#pointer-position").textContent();
  const [, east, north] = text.replaceAll("\u2212", "-").match(/^(-?\d+) m east, (-?\d+) m north$/);
  near(Number(east), now.x_m + (340 - cx) / now.px_per_m, 0.51, "east");
  near(Number(north), now.y_m - (270 - cy) / now.px_per_m, 0.51, "north");
});

inReport("the ruler measures to within a pixel, shows the compass bearing, and disappears when switched off", {}, async (page) => {
  const before = await mapImage(page);
  await page.getByRole("button", { name: "Ruler" }).click();
  const { px_per_m } = await camera(page);
  for (const [to, dx, dy, bearing] of [[[750, 520], 100, 0, "090"], [[650, 420], 0, -100, "000"], [[590, 600], -60, 80, "217"]]) {
    const view = await camera(page);
    // No object is near these places.
    await drag(page, [650, 520], to);
    const text = await page.locator("#ruler-result").textContent();
    const [, metres, degrees] = text.match(/^(\d+) m, bearing (\d+)\u00b0$/) ?? assert.fail(text);
    near(Number(metres), Math.hypot(dx, dy) / px_per_m, 1 / px_per_m, "distance");
    assert.equal(degrees, bearing);
    assert.deepEqual(await camera(page), view, "measuring does not move the map");
  }
  const ruled = await mapImage(page);
  await page.keyboard.press("r");
  assert.ok((await mapImage(page)) !== ruled, "the line of the ruler disappears");
  assert.ok((await mapImage(page)) === before, "the map is the same as before");
  assert.equal(await page.locator("#ruler-result").textContent(), "");
  assert.equal(await page.getByRole("button", { name: "Ruler" }).getAttribute("aria-pressed"), "false");
});

inReport("if the scenario has an origin, the map shows latitude and longitude", { flight: "hostile" }, async (page) => {
  // The first vehicle of the file starts at the origin.
  await page.getByLabel("Follow").selectOption("group 0");
  const view = await camera(page);
  const [cx, cy] = await middle(page);
  const origin = [cx - view.x_m * view.px_per_m, cy + view.y_m * view.px_per_m];
  await page.mouse.move(...(await on(page, ...origin)));
  const text = (await page.locator("#pointer-position").textContent()).replaceAll("\u2212", "-");
  const [, north, northOrSouth, east, eastOrWest] = text.match(/, ([\d.]+)\u00b0 ([NS]) ([\d.]+)\u00b0 ([EW])$/);
  const [lat, lon] = [northOrSouth === "N" ? Number(north) : -north, eastOrWest === "E" ? Number(east) : -east];
  const metres_per_degree = 111_200;
  near((lat - 44.5) * metres_per_degree, 0, 1 / view.px_per_m, "latitude of the origin");
  near((lon - 11.3) * metres_per_degree * Math.cos((44.5 * Math.PI) / 180), 0, 1 / view.px_per_m, "longitude of the origin");
});

inReport("on a tablet, one finger drags the map and two fingers zoom it", TABLET, async (page) => {
  const session = await page.context().newCDPSession(page);
  const touch = async (type, ...places) => {
    const touchPoints = [];
    for (const [id, place] of places.entries()) {
      const [x, y] = await on(page, ...place);
      touchPoints.push({ x, y, id });
    }
    await session.send("Input.dispatchTouchEvent", { type, touchPoints });
  };
  const first = await camera(page);
  await touch("touchStart", [300, 200]);
  await touch("touchMove", [320, 210]);
  await touch("touchMove", [350, 240]);
  await touch("touchEnd");
  const dragged = await camera(page);
  near(dragged.x_m, first.x_m - 50 / first.px_per_m, 1 / first.px_per_m, "east");
  near(dragged.y_m, first.y_m + 40 / first.px_per_m, 1 / first.px_per_m, "north");
  await touch("touchStart", [300, 250]);
  await touch("touchStart", [300, 250], [400, 250]);
  await touch("touchMove", [275, 250], [425, 250]);
  await touch("touchMove", [250, 250], [450, 250]);
  await touch("touchEnd");
  const pinched = await camera(page);
  near(pinched.px_per_m / first.px_per_m, 2, 0.02, "doubling the distance of the fingers doubles the scale");
  const [cx, cy] = await middle(page);
  const under = ({ x_m, y_m, px_per_m }) => [x_m + (350 - cx) / px_per_m, y_m - (250 - cy) / px_per_m];
  near(under(pinched)[0], under(dragged)[0], 1 / pinched.px_per_m, "the point between the fingers stays in place");
  near(under(pinched)[1], under(dragged)[1], 1 / pinched.px_per_m, "the point between the fingers stays in place");
  assert.equal(await page.evaluate(() => visualViewport.scale), 1, "the page itself is not zoomed");
  await painted(page);
});

/** Bounds (west, south, east, north) of everything in the record of a run, m. */
function boundsOf(record) {
  const [xs, ys] = [[], []];
  const put = (columns, of, r = []) => columns[of[0]].forEach((x_m, k) => {
    if (x_m === null) return;
    const y_m = columns[of[1]][k];
    const r_m = r[k] ?? 0;
    xs.push(x_m - r_m, x_m + r_m);
    ys.push(y_m - r_m, y_m + r_m);
  });
  for (const uav of Object.values(record.tables.uavs)) put(uav, ["x_m", "y_m"]);
  for (const group of Object.values(record.tables.groups)) put(group, ["x_m", "y_m"], group.standoff_distance_m);
  for (const target of Object.values(record.tables.targets)) {
    put(target, ["x_m", "y_m"]);
    put(target, ["true_x_m", "true_y_m"]);
  }
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** Bounds (west, south, east, north) of the map, m. */
async function shownBounds(page) {
  const { x_m, y_m, px_per_m } = await camera(page);
  const [cx, cy] = await middle(page);
  return [x_m - cx / px_per_m, y_m - cy / px_per_m, x_m + cx / px_per_m, y_m + cy / px_per_m];
}

/** Asserts that bounds contain other bounds. */
function contains(outer, inner, what) {
  for (const k of [0, 1]) {
    assert.ok(outer[k] <= inner[k] && outer[k + 2] >= inner[k + 2], `${what}: ${inner} is inside ${outer}`);
  }
}

for (const flight of ["figure-9", "long"]) {
  inReport(`the map keeps the whole run in view at any time and window size: ${flight}`, { flight }, async (page) => {
    const whole = boundsOf(recordOf(flight));
    const end_s = recordOf(flight).times_s.at(-1);
    await page.getByLabel("Follow").selectOption("run");
    const first = await camera(page);
    for (const time_s of [0, end_s / 2, end_s]) {
      await goTo(page, time_s);
      assert.deepEqual(await camera(page), first, "the map does not move");
      contains(await shownBounds(page), whole, `at ${time_s} s`);
    }
    const [west, south, east, north] = await shownBounds(page);
    const filled = Math.max((whole[2] - whole[0]) / (east - west), (whole[3] - whole[1]) / (north - south));
    assert.ok(filled > 0.7 || Math.max(whole[2] - whole[0], whole[3] - whole[1]) < 200, `the run fills ${filled} of the map`);
    await page.setViewportSize({ width: 1000, height: 900 });
    await page.waitForFunction((scale) => Number(document.getElementById("map").dataset.pxPerM) !== scale, first.px_per_m);
    contains(await shownBounds(page), whole, "in a window of another size");
    // After the user has moved the map, it no longer fits itself.
    await page.mouse.move(...(await on(page, 300, 300)));
    await page.mouse.wheel(0, -400);
    await page.waitForFunction(() => document.getElementById("follow").value === "");
    const held = await camera(page);
    await page.setViewportSize({ width: 1280, height: 720 });
    await goTo(page, 10);
    assert.equal((await camera(page)).px_per_m, held.px_per_m);
    await page.getByLabel("Follow").selectOption("run");
    assert.deepEqual(await camera(page), first);
  });
}

/** Waits until the map has stopped moving. */
async function settled(page) {
  for (let before = null, now = await camera(page); JSON.stringify(now) !== before; now = await camera(page)) before = JSON.stringify(now);
}

inReport("the map opens with all current objects in view and keeps them in view, and \"Show all\" shows them again", { flight: "long" }, async (page) => {
  const record = recordOf("long");
  await page.getByLabel("Follow").selectOption("run");
  const whole = await camera(page);
  await page.reload();
  await page.waitForFunction(() => document.getElementById("follow").value === "now");
  for (const time_s of [0, 700, 300]) {
    if (time_s === 300) {
      await page.getByRole("button", { name: "Zoom in" }).click();
      assert.equal(await page.getByLabel("Follow").inputValue(), "", "zooming stops following");
      await page.getByRole("button", { name: "Show all" }).click();
    }
    assert.equal(await page.getByLabel("Follow").inputValue(), "now");
    await goTo(page, time_s);
    await settled(page);
    const shown = await shownBounds(page);
    for (const table of ["uavs", "groups", "targets"]) {
      for (const [id, { x_m, y_m, standoff_distance_m: r_m = 0 }] of record.rows(table, time_s)) {
        if (x_m !== null) contains(shown, [x_m - r_m, y_m - r_m, x_m + r_m, y_m + r_m], `${table} ${id} at ${time_s} s`);
      }
    }
    if (time_s === 0) assert.ok((await camera(page)).px_per_m > 1.5 * whole.px_per_m, "the scale is larger than for the whole run");
  }
});
