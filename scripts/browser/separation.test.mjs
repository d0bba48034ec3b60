// Collision avoidance between UAVs, intruders and geofence zones: lines on the map and texts in the tables.

import assert from "node:assert/strict";

import { camera, selectedCard, goTo, recordTexts, painted, settled, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

/** The text in the column "Avoiding" of a UAV. */
const avoiding = (page, id) => page.locator(`#uavs tr[data-id="${id}"] td[data-field="avoiding"]`).textContent();

/** Fraction of the middle half of the line between two positions, m, that is drawn in the alarm colour. */
async function alarmFraction(page, from, to) {
  const { x_m, y_m, px_per_m } = await camera(page);
  return page.locator("#map").evaluate((canvas, { x_m, y_m, px_per_m, from, to }) => {
    const ratio = canvas.width / canvas.clientWidth;
    const ctx = canvas.getContext("2d");
    const shares = Array.from({ length: 101 }, (_, k) => 0.25 + 0.5 * (k / 100));
    const isRed = (share) => {
      const [east_m, north_m] = [0, 1].map((axis) => from[axis] + share * (to[axis] - from[axis]));
      const x = (canvas.clientWidth / 2 + (east_m - x_m) * px_per_m) * ratio;
      const y = (canvas.clientHeight / 2 - (north_m - y_m) * px_per_m) * ratio;
      // A line may be between two pixels.
      const { data } = ctx.getImageData(Math.floor(x) - 1, Math.floor(y) - 1, 3, 3);
      return Array.from({ length: 9 }, (_, k) => data.slice(4 * k, 4 * k + 3)).some(([red, green, blue]) => red > 150 && green < 110 && blue < 110);
    };
    return shares.filter(isRed).length / shares.length;
  }, { x_m, y_m, px_per_m, from, to });
}

inReport("a UAV that avoids another UAV has a dashed line to it and an entry in the table", { flight: "separation" }, async (page) => {
  const record = recordOf("separation");
  await page.getByRole("tab", { name: "State" }).click();
  const avoidingAt = (time_s) => [...record.rows("uavs", time_s)].filter(([, uav]) => uav.avoided_uav !== null);
  const distance_m = ([one, other]) => Math.hypot(one.x_m - other.x_m, one.y_m - other.y_m);
  const pair = (time_s, [, uav]) => [uav, record.rows("uavs", time_s).get(uav.avoided_uav)];
  // The pair with the largest distance has the longest line.
  const furthest = (time_s) => Math.max(0, ...avoidingAt(time_s).map((one) => distance_m(pair(time_s, one))));
  const time_s = record.times_s.reduce((best, time_s) => (furthest(time_s) > furthest(best) ? time_s : best));
  await goTo(page, time_s);
  for (const [id, uav] of record.rows("uavs", time_s)) {
    const text = await avoiding(page, id);
    if (uav.avoided_uav === null) assert.ok(!text.includes("UAV"), text);
    else assert.ok(text.includes(`UAV ${uav.avoided_uav} (${uav.predicted_distance_m.toFixed(0)} m)`), text);
  }
  const [one, other] = avoidingAt(time_s).map((one) => pair(time_s, one)).sort((a, b) => distance_m(b) - distance_m(a))[0];
  const positions = [one, other].map(({ x_m, y_m }) => [x_m, y_m]);
  await settled(page);
  const drawn = await alarmFraction(page, ...positions);
  assert.ok(drawn > 0.4 && drawn < 0.95, `a dashed line: ${drawn} of it is drawn`);
  await page.locator("#layer-menu").click();
  await page.getByRole("checkbox", { name: "Collision avoidance" }).uncheck();
  await painted(page);
  assert.ok((await alarmFraction(page, ...positions)) < drawn / 3);
});

inReport("the table shows the geofence zone that makes a UAV deviate", { flight: "separation" }, async (page) => {
  const record = recordOf("separation");
  await page.getByRole("tab", { name: "State" }).click();
  const limited = (time_s) => [...record.rows("uavs", time_s)].filter(([, uav]) => uav.limiting_zone !== null);
  const time_s = record.times_s.find((time_s) => limited(time_s).length > 0);
  assert.ok(time_s !== undefined, "at least one UAV flies around the field");
  await goTo(page, time_s);
  const ids = new Set(limited(time_s).map(([id]) => id));
  for (const id of record.ids("uavs")) {
    assert.equal((await avoiding(page, id)).includes("keep-out field"), ids.has(id), `UAV ${id}`);
  }
});

inReport("labels of zones on the map show floors and ceilings", { flight: "zones" }, async (page) => {
  await recordTexts(page);
  await page.getByRole("button", { name: "Show all" }).click();
  const labels = (await texts(page)).map(({ text }) => text);
  for (const label of ["field, 100 to 350 m", "up to 120 m", "roof, from 400 m", "wood"]) assert.ok(labels.includes(label), `${label}: ${labels.join("; ")}`);
});

inReport("a UAV that avoids an intruder has a dashed line to it and an entry in the table", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  await page.getByRole("tab", { name: "State" }).click();
  const positions = (time_s, id, intruder) =>
    [record.rows("uavs", time_s).get(id), record.rows("intruders", time_s).get(intruder)].map(({ x_m, y_m }) => [x_m, y_m]);
  // The largest distance to the intruder, while no UAV avoids another UAV: the line is long, and it is the only one.
  const candidates = record.times_s.flatMap((time_s) => {
    const uavs = [...record.rows("uavs", time_s)];
    return uavs.some(([, { avoided_uav }]) => avoided_uav !== null) ? []
      : uavs.filter(([, uav]) => uav.avoided_intruder !== null).map(([id, uav]) => ({ time_s, id, uav, at: positions(time_s, id, uav.avoided_intruder) }));
  });
  const distance_m = ({ at: [[x_m, y_m], [x2_m, y2_m]] }) => Math.hypot(x2_m - x_m, y2_m - y_m);
  const { time_s, id, uav, at } = candidates.reduce((best, one) => (distance_m(one) > distance_m(best) ? one : best));
  await goTo(page, time_s);
  const text = await avoiding(page, id);
  assert.ok(text.includes(`intruder ${uav.avoided_intruder} (${uav.predicted_distance_m.toFixed(0)} m)`), text);
  await settled(page);
  const drawn = await alarmFraction(page, ...at);
  assert.ok(drawn > 0.4 && drawn < 0.95, `a dashed line: ${drawn} of it is drawn`);
});

/** The expected state of an intruder's transponder. */
function transponder(record, id, time_s) {
  const reports_s = record.times_s.filter((at_s) => at_s <= time_s && record.rows("intruders", at_s).get(id).transponder_on);
  const ago_s = time_s - reports_s.at(-1);
  return ago_s === 0 ? "on" : ago_s > 30 ? "off for more than 30 s: no longer avoided" : `off for ${ago_s.toFixed(1)} s`;
}

inReport("intruders have names on the map, and a table shows their motion and their transponder", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  await recordTexts(page);
  await page.getByRole("tab", { name: "State" }).click();
  const states = new Set();
  for (const time_s of [0, 19.5, 20, 45, 50, 60]) {
    await goTo(page, time_s);
    const rows = await page.getByRole("table", { name: "Intruders" }).locator("tbody tr").evaluateAll((rows) =>
      rows.map((row) => Object.fromEntries([...row.cells].map((cell) => [cell.dataset.field, cell.textContent]))));
    const recorded = [...record.rows("intruders", time_s)];
    assert.deepEqual(rows.map((row) => row.id), recorded.map(([id]) => `${id}`));
    for (const [id, { x_m, y_m, speed_m_s }] of recorded) {
      const distances = [...record.rows("uavs", time_s)].map(([uav, row]) => [Math.hypot(row.x_m - x_m, row.y_m - y_m), uav]);
      const [distance_m, uav] = distances.sort(([a], [b]) => a - b)[0];
      agrees(rows[id].x_m, x_m, 1, `intruder ${id} east`);
      agrees(rows[id].y_m, y_m, 1, `intruder ${id} north`);
      agrees(rows[id].speed_m_s, speed_m_s, 2, `intruder ${id} speed`);
      agrees(rows[id].nearest_m.split(" ")[0], distance_m, 0, `intruder ${id} nearest`);
      assert.match(rows[id].nearest_m, new RegExp(`\\(UAV ${uav}\\)$`));
      assert.equal(rows[id].transponder, transponder(record, id, time_s), `intruder ${id} at ${time_s} s`);
      states.add(rows[id].transponder.split(" ").slice(0, 3).join(" "));
    }
    assert.match(await page.getByRole("img").first().getAttribute("aria-label"), /, 2 intruders$/);
  }
  assert.deepEqual([...states].sort(), ["off for 0.5", "off for 25.5", "off for more", "on"]);
  await goTo(page, 45);
  const labels = (await texts(page)).map(({ text }) => text);
  assert.ok(labels.includes("intruder 0") && labels.includes("intruder 1, transponder off"), `${labels}`);
  await page.locator("#layer-menu").click();
  await page.getByRole("checkbox", { name: "Intruders" }).uncheck();
  assert.ok(!(await texts(page)).some(({ text }) => text.startsWith("intruder")));
});

inReport("an intruder can be found and selected, and its events can be listed alone; a distant intruder does not enlarge the view", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  const isInView = async (id) => {
    const { x_m, y_m, px_per_m } = await camera(page);
    const { width, height } = await page.locator("#map").boundingBox();
    const at = record.rows("intruders", 0).get(id);
    return Math.abs(at.x_m - x_m) * px_per_m < width / 2 && Math.abs(at.y_m - y_m) * px_per_m < height / 2;
  };
  for (const value of ["run", "now"]) {
    await page.getByLabel("Follow").selectOption(value);
    assert.deepEqual([await isInView(0), await isInView(1)], [true, false], value);
  }
  await page.getByLabel("Find").fill("intruder 1");
  await page.keyboard.press("Enter");
  await selectedCard(page).getByRole("heading", { name: "Intruder 1" }).waitFor();
  assert.ok(await isInView(1), "searching brings the intruder into view");
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("only intruder 1").check();
  const expected = record.events.filter((event) => event.intruder === 1).length;
  assert.ok(expected > 0 && expected < record.events.length);
  assert.match(await page.locator("#event-count").textContent(), new RegExp(`^${expected} of `));
  await page.getByLabel("only intruder 1").uncheck();
  await page.getByLabel("Object", { exact: true }).fill("intruder 1");
  assert.match(await page.locator("#event-count").textContent(), new RegExp(`^${expected} of `));
  assert.match(await page.locator("#events [role=option]").first().textContent(), /UAV \d, intruder 1: UAV \d would have come within \d+ m of intruder 1/);
});
