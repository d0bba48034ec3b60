// Sensors without identities, with misses, a blind zone and false alarms: detections, gates, tentative tracks and blind targets.

import assert from "node:assert/strict";

import { camera, goTo, mapImage, painted, selectedCard, settled } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const FLIGHT = { flight: "unlabelled" };
const TIME_S = 40;
const DEGREES = 180 / Math.PI;

const hovered = (page) => page.getByRole("tooltip");

/** Converts world coordinates to a position on the page, px. */
async function at(page, x_m, y_m) {
  const view = await camera(page);
  const box = await page.locator("#map").boundingBox();
  return [box.x + box.width / 2 + (x_m - view.x_m) * view.px_per_m, box.y + box.height / 2 - (y_m - view.y_m) * view.px_per_m];
}

/** The values of a card, by field. */
async function facts(card) {
  return card.locator("dd").evaluateAll((all) => Object.fromEntries(all.map((one) => [one.dataset.field, one.textContent])));
}

/** Shows only these layers. */
async function showOnly(page, names) {
  await page.locator("#layer-menu").click();
  for (const box of await page.getByRole("group", { name: "Layers" }).getByRole("checkbox").all()) {
    const name = (await box.getAttribute("name")).replace("layer-", "");
    if ((await box.isChecked()) !== names.includes(name)) await box.click();
  }
  await page.keyboard.press("Escape");
}

/** Positions with a free area around them, of which no other position is nearer than `apart_m`. */
function lonely(all, apart_m) {
  return all.filter((one) => all.every((other) => other === one || Math.hypot(other.x_m - one.x_m, other.y_m - one.y_m) > apart_m));
}

/** Detections of the time step with their measured positions. */
function detections(record, time_s) {
  const uavs = record.rows("uavs", time_s);
  return record.detections[record.times_s.indexOf(time_s)].map((row) => {
    const { x_m, y_m } = uavs.get(row.uav);
    return { ...row, x_m: x_m + row.range_m * Math.cos(row.bearing_rad), y_m: y_m + row.range_m * Math.sin(row.bearing_rad) };
  });
}

inReport("detections and false alarms are drawn at the measured positions, and their cards show the record", FLIGHT, async (page) => {
  const record = recordOf("unlabelled");
  await goTo(page, TIME_S);
  await showOnly(page, ["detections"]);
  const kinds = new Set();
  let last;
  /** Points at the detections that are visible, not under a control, and not near another one. */
  const check = async (time_s) => {
    const view = await camera(page);
    for (const one of lonely(detections(record, time_s), 26 / view.px_per_m)) {
      const { uav, target, range_m, bearing_rad, range_rate_m_s, x_m, y_m } = one;
      const isFalse = target === null;
      const place = await at(page, x_m, y_m);
      if (!(await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.id === "map", place))) continue;
      await page.mouse.move(...place);
      await hovered(page).getByRole("heading", { name: isFalse ? "False alarm" : "Detection" }).waitFor();
      const shown = await facts(hovered(page));
      assert.equal(shown.uav, `${uav}`);
      assert.equal(shown.target, isFalse ? "none: false alarm" : record.names[target]);
      const near = (text, value, tolerance, what) => assert.ok(Math.abs(Number(text.replace("\u2212", "-")) - value) <= tolerance, `${what}: ${text}, ${value}`);
      near(shown.range_m, range_m, 0.07, "range");
      near(shown.range_rate_m_s, range_rate_m_s, 0.051, "range rate");
      const off_deg = ((Number(shown.bearing_deg) - (90 - bearing_rad * DEGREES) + 540) % 360 + 360) % 360 - 180;
      assert.ok(Math.abs(off_deg) <= 0.51, `bearing: ${shown.bearing_deg}, ${bearing_rad}`);
      kinds.add(`${isFalse} ${uav}`);
      last = place;
    }
  };
  for (const time_s of [TIME_S, TIME_S + 20]) {
    await goTo(page, time_s);
    await page.getByLabel("Follow").selectOption("run");
    await check(time_s);
    for (const group of [0, 1]) {
      await page.getByLabel("Follow").selectOption(`group ${group}`);
      for (let press = 0; press < 4; press++) await page.keyboard.press("+");
      await check(time_s);
    }
  }
  const count = (isFalse) => [...kinds].filter((kind) => kind.startsWith(`${isFalse}`)).length;
  assert.ok(count(true) >= 2 && count(false) >= 2, `UAVs with detections and false alarms: ${[...kinds]}`);
  // A detection exists for one time step only: a click selects nothing.
  await page.mouse.click(...last);
  assert.equal(await selectedCard(page).count(), 0);
  const drawn = await mapImage(page);
  await showOnly(page, []);
  assert.ok((await mapImage(page)) !== drawn, "hiding the layer changes the map");
});

inReport("the selected track has a gate for each UAV that has it in view", FLIGHT, async (page) => {
  await goTo(page, TIME_S);
  await page.evaluate(() => {
    const { ellipse } = CanvasRenderingContext2D.prototype;
    window.ellipses = [];
    CanvasRenderingContext2D.prototype.ellipse = function (x, y, long, wide, ...rest) {
      window.ellipses.push([long, wide]);
      return ellipse.call(this, x, y, long, wide, ...rest);
    };
  });
  await showOnly(page, ["tentative"]);
  await page.getByLabel("Find").fill("target-6");
  await page.getByLabel("Find").press("Enter");
  await painted(page);
  const seenBy = (await facts(selectedCard(page))).seen_by.split(", ");
  const gates = await page.evaluate(() => new Promise((resolve) => {
    window.ellipses = [];
    document.getElementById("time").dispatchEvent(new Event("input", { bubbles: true }));
    requestAnimationFrame(() => requestAnimationFrame(() => resolve(window.ellipses)));
  }));
  assert.ok(gates.length > 0 && gates.length % seenBy.length === 0, `${gates.length} gates for ${seenBy}`);
  const { px_per_m } = await camera(page);
  // At least the noise of the sensor: 10 m in range, and 99.9 % of its distribution.
  for (const [long, wide] of gates) assert.ok(long >= wide && wide / px_per_m > 40 && long / px_per_m < 400, `${long / px_per_m} m, ${wide / px_per_m} m`);
});

inReport("tentative tracks have a card with their probability of existence, and cannot be selected", FLIGHT, async (page) => {
  const record = recordOf("unlabelled");
  await goTo(page, TIME_S);
  await showOnly(page, ["tentative"]);
  await page.getByLabel("Follow").selectOption("run");
  // A key zooms what is seen when it is pressed.
  await settled(page);
  for (let press = 0; press < 3; press++) await page.keyboard.press("-");
  await settled(page);
  const { px_per_m } = await camera(page);
  const all = lonely(record.tentative[record.times_s.indexOf(TIME_S)], 26 / px_per_m);
  assert.ok(all.length >= 4, `${all.length} tentative tracks`);
  for (const { x_m, y_m, existence } of all) {
    await page.mouse.move(...(await at(page, x_m, y_m)));
    await hovered(page).getByRole("heading", { name: "Tentative track" }).waitFor();
    const shown = Number((await facts(hovered(page))).existence);
    assert.ok(Math.abs(shown - 100 * existence) <= 0.08, `${shown} %, ${existence}`);
  }
  await page.mouse.click(...(await at(page, all[0].x_m, all[0].y_m)));
  assert.equal(await selectedCard(page).count(), 0);
});

inReport("the cards of a target and a UAV name the blind zone, with the true radial speed", FLIGHT, async (page) => {
  const record = recordOf("unlabelled");
  await goTo(page, TIME_S);
  const before = await mapImage(page);
  await showOnly(page, ["blind", "tracks", "truth"]);
  const uavs = record.rows("uavs", TIME_S);
  const blind = new Map([...uavs.keys()].map((uav) => [uav, 0]));
  for (const [id, { seen_by }] of record.rows("targets", TIME_S)) {
    if (id >= record.names.length) continue;
    const truth = record.truth[record.times_s.indexOf(TIME_S)].find(({ target }) => target === id);
    const expected = (seen_by ?? []).flatMap((uav) => {
      const [dx, dy] = [truth.x_m - uavs.get(uav).x_m, truth.y_m - uavs.get(uav).y_m];
      const speed_m_s = Math.abs(dx * truth.vx_m_s + dy * truth.vy_m_s) / Math.hypot(dx, dy);
      if (speed_m_s < 2) blind.set(uav, blind.get(uav) + 1);
      return speed_m_s < 2 ? [`UAV ${uav} at ${speed_m_s.toFixed(1)} m/s`] : [];
    });
    await page.getByLabel("Find").fill(record.names[id]);
    await page.getByLabel("Find").press("Enter");
    await selectedCard(page).getByRole("heading", { name: record.names[id], exact: true }).waitFor();
    const text = (await facts(selectedCard(page))).blind;
    assert.equal(text, expected.length ? `${expected.join(", ")}; MDV 2 m/s` : undefined, record.names[id]);
  }
  const [uav, count] = [...blind].sort((a, b) => b[1] - a[1])[0];
  assert.ok(count > 0, "some target is in a blind zone");
  await page.getByLabel("Find").fill(`UAV ${uav}`);
  await page.getByLabel("Find").press("Enter");
  await selectedCard(page).getByRole("heading", { name: `UAV ${uav}`, exact: true }).waitFor();
  assert.equal((await facts(selectedCard(page))).blind.split(", ").length, count);
  const marked = await mapImage(page);
  await showOnly(page, ["tracks", "truth"]);
  assert.ok(marked !== before && (await mapImage(page)) !== marked, "hiding the marks changes the map");
});

inReport("a run of ideal sensors has no layers of detections", {}, async (page) => {
  await page.locator("#layer-menu").click();
  for (const name of ["detections", "tentative", "blind"]) assert.equal(await page.locator(`input[name="layer-${name}"]`).count(), 0, name);
});
