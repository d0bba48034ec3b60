// Charts: plotly draws what the record holds; they are linked to time, and can be saved.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { clock, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf, same } from "./record.mjs";

const DEGREES = 180 / Math.PI;

/** Panels from the top: table, columns as they are drawn (solid, dashed), factor. */
const PANELS = [
  ["uavs", ["line_of_sight_rad"], DEGREES],
  ["groups", ["standoff_distance_m"], 1],
  ["uavs", ["standoff_error_m"], 1],
  ["groups", ["phase_rad", "phase_wanted_rad"], DEGREES],
  ["uavs", ["speed_m_s"], 1],
  ["uavs", ["turn_rate_rad_s"], DEGREES],
  ["groups", ["position_error_m", "position_bound_m"], 1],
  ["groups", ["scan_sd_m"], 1],
];

/** The curves that a record makes, in the order of the page. */
function curvesOf(record) {
  const found = [];
  const put = (index, table, id, column, factor, dash) => {
    const values = record.tables[table][id][column].map((value) => (value === null ? null : value * factor));
    const name = table === "uavs" ? `UAV ${id}` : `group ${id}`;
    if (values.some((value) => value !== null)) found.push({ name, index, dash, column, table, id, factor, values });
  };
  for (const [index, [table, columns, factor]] of PANELS.entries()) {
    for (const id of record.ids(table)) columns.forEach((column, k) => put(index, table, id, column, factor, k ? "dash" : "solid"));
    if (columns[0] === "standoff_distance_m") for (const id of record.ids("uavs")) put(index, "uavs", id, "centre_distance_m", 1, "dot");
  }
  return found;
}

/** What plotly shows. */
async function drawn(page) {
  return page.evaluate(() => {
    const place = document.getElementById("charts");
    return {
      traces: place.data.map(({ name, yaxis, line, x, y }) => ({ name, index: Number(yaxis.slice(1) || 1) - 1, dash: line.dash, x: [...x], y: [...y] })),
      visible: [...new Set(place._fullData.filter((trace) => trace.visible === true).map((trace) => trace.name))],
      range_s: place.layout.xaxis.range.map(Number),
    };
  });
}

/** The box of a plot on the page, from the top. */
async function plot(page, index) {
  const place = page.locator(`#charts .draglayer .nsewdrag[data-subplot="x${index ? `y${index + 1}` : "y"}"]`);
  await place.scrollIntoViewIfNeeded();
  return place.boundingBox();
}

for (const flight of ["figure-9", "slips"]) {
  inReport(`every curve equals the record: ${flight}`, { flight }, async (page) => {
    const record = recordOf(flight);
    const wanted = curvesOf(record);
    const { traces } = await drawn(page);
    assert.deepEqual(traces.map(({ name, index, dash }) => [name, index, dash]), wanted.map(({ name, index, dash }) => [name, index, dash]));
    for (const [k, { x, y }] of traces.entries()) {
      assert.deepEqual(x, record.times_s);
      same(y, wanted[k].values, `${wanted[k].name}, ${wanted[k].column}`);
    }
  });
}

inReport("of a long mission the extremes are drawn, and every instant once zoomed", { flight: "long" }, async (page) => {
  const record = recordOf("long");
  const wanted = curvesOf(record);
  assert.ok(wanted.some((curve) => curve.column === "position_bound_m"), "a mission with a bound");
  const extremes = (values) => [Math.min, Math.max].map((most) => values.filter((value) => value !== null).reduce((a, b) => most(a, b)));
  const whole = await drawn(page);
  for (const [k, { x, y }] of whole.traces.entries()) {
    assert.ok(x.length < record.times_s.length && x.length <= 1500, `${x.length} points`);
    same(extremes(y), extremes(wanted[k].values), wanted[k].column);
    same(y, x.map((time_s) => wanted[k].values[record.times_s.indexOf(time_s)]), wanted[k].column);
  }
  const box = await plot(page, 0);
  await page.mouse.move(box.x + 0.25 * box.width, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.3 * box.width, box.y + box.height / 2);
  await page.mouse.move(box.x + 0.5 * box.width, box.y + box.height / 2);
  await page.mouse.up();
  await page.waitForFunction(() => document.getElementById("charts").data[0].x[0] > 100);
  const zoomed = await drawn(page);
  const [from, to] = zoomed.range_s;
  assert.ok(Math.abs(from - 250) < 5 && Math.abs(to - 500) < 5, `${from} to ${to} s`);
  for (const [k, { x, y }] of zoomed.traces.entries()) {
    const within = record.times_s.map((time_s, at) => [time_s, wanted[k].values[at]]).filter(([time_s]) => time_s >= x[0] && time_s <= x.at(-1));
    assert.ok(x[0] <= from && x.at(-1) >= to, "to both edges");
    assert.deepEqual(x, within.map(([time_s]) => time_s));
    same(y, within.map(([, value]) => value), wanted[k].column);
  }
  assert.equal(await clock(page), 0, "zooming does not change the time shown");
  const again = await plot(page, 0);
  await page.mouse.dblclick(again.x + again.width / 2, again.y + again.height / 2);
  await page.waitForFunction(() => document.getElementById("charts").data[0].x[0] < 10);
  assert.deepEqual(await drawn(page), whole, "a double click shows the whole again");
});

inReport("a click on a name isolates it, another theme keeps that, a second click brings all back", {}, async (page) => {
  const all = (await drawn(page)).visible;
  assert.deepEqual([...all].sort(), ["UAV 0", "UAV 1", "UAV 2", "UAV 3", "group 0", "group 1"]);
  const entry = page.locator("#charts .legend .traces", { hasText: "UAV 2" }).locator(".legendtoggle");
  const shows = (names) => page.waitForFunction((names) => {
    const shown = document.getElementById("charts")._fullData.filter((trace) => trace.visible === true).map((trace) => trace.name);
    return JSON.stringify([...new Set(shown)]) === JSON.stringify(names);
  }, names);
  await entry.click();
  await shows(["UAV 2"]);
  await page.getByRole("button", { name: "Theme" }).click();
  await painted(page);
  await shows(["UAV 2"]);
  await entry.click();
  await shows(all);
});

inReport("the names stand clear of the plots", {}, async (page) => {
  const bottom = await page.locator("#charts .legend").evaluate((legend) => legend.getBoundingClientRect().bottom);
  const top = await page.locator("#charts .annotation").first().evaluate((title) => title.getBoundingClientRect().top);
  assert.ok(bottom <= top, `the legend ends at ${bottom} px, the first title begins at ${top} px`);
});

inReport("a click on a plot goes to that time, and the cursor shows it", {}, async (page) => {
  for (const [index, share] of [[0, 0.25], [5, 0.8]]) {
    const box = await plot(page, index);
    await page.mouse.click(box.x + share * box.width, box.y + box.height / 2);
    await painted(page);
    assert.ok(Math.abs((await clock(page)) - 100 * share) <= 100 / box.width, `${await clock(page)} s at ${share} of plot ${index}`);
    const cursor = await page.locator("#cursor").boundingBox();
    assert.ok(Math.abs(cursor.x + cursor.width / 2 - (box.x + share * box.width)) <= 2, "the cursor is under the pointer");
  }
});

inReport("over a plot the values at that time are told", {}, async (page) => {
  const record = recordOf("figure-9");
  const box = await plot(page, 4);
  await page.mouse.move(box.x + 0.4 * box.width, box.y + box.height / 2);
  await page.mouse.move(box.x + 0.4 * box.width + 1, box.y + box.height / 2);
  await page.waitForSelector("#charts .hoverlayer .hovertext");
  const told = await page.locator("#charts .hoverlayer .hovertext").allTextContents();
  const near = record.times_s.map((time_s, k) => k).filter((k) => Math.abs(record.times_s[k] - 40) <= 1);
  for (const id of record.ids("uavs")) {
    const words = told.find((text) => text.includes(`UAV ${id}: `));
    const value = Number(words?.match(/: ([\d.]+)/)[1]);
    const { speed_m_s } = record.tables.uavs[id];
    assert.ok(near.some((k) => Math.abs(speed_m_s[k] - value) <= 0.0051), `${words} of UAV ${id}`);
  }
});

inReport("the table saved equals the record, every instant", { flight: "long" }, async (page) => {
  const record = recordOf("long");
  await goTo(page, 50);
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save CSV" }).click()]);
  assert.equal(download.suggestedFilename(), "paper-table-2-pair-1.csv");
  const [heads, ...rows] = readFileSync(await download.path(), "utf8").trimEnd().split("\n").map((line) => line.split(","));
  const column = (name) => rows.map((row) => (row[heads.indexOf(name)] === "" ? null : Number(row[heads.indexOf(name)])));
  assert.deepEqual(column("time_s"), record.times_s);
  const wanted = curvesOf(record);
  assert.equal(heads.length, 1 + wanted.length);
  for (const { table, id, column: name } of wanted) {
    const head = `${table === "uavs" ? "uav" : "group"}_${id}_${name}`;
    assert.ok(heads.includes(head), head);
    same(column(head), record.tables[table][id][name], head, 1e-6);
  }
});

inReport("the charts can be saved as a PNG", {}, async (page) => {
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save PNG" }).click()]);
  assert.equal(download.suggestedFilename(), "paper-figure-9-1.png");
  const bytes = readFileSync(await download.path());
  assert.equal(bytes.subarray(0, 8).toString("latin1"), "\x89PNG\r\n\x1a\n");
  assert.equal(bytes.readUInt32BE(16), 2000, "px wide");
  assert.ok(bytes.readUInt32BE(20) > 2000, "px high");
  assert.ok(bytes.length > 50_000, `${bytes.length} bytes`);
});
