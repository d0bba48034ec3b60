// Charts: the curves equal the record, are linked to the time shown, and can be saved.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { PHONE, clock, downloaded, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf, same } from "./record.mjs";

const DEGREES = 180 / Math.PI;

/** Panels from top to bottom: key, factor, and the curves: table, column, dash style. */
const PANELS = [
  ["in_custody", 1, [["run", "targets", "solid"], ["run", "tracked", "dash"], ["run", "in_view", "dot"], ["run", "in_custody", "solid"]]],
  ["position_error", 1, [["groups", "position_error_m", "solid"], ["groups", "position_crlb_m", "dash"], ["run", "position_error_m", "dot"]]],
  ["off_boresight", DEGREES, [["uavs", "off_boresight_rad", "solid"]]],
  ["standoff_distance", 1, [["groups", "standoff_distance_m", "solid"], ["uavs", "centre_distance_m", "dot"]]],
  ["standoff_error", 1, [["uavs", "standoff_error_m", "solid"]]],
  ["phase", DEGREES, [["groups", "phase_rad", "solid"], ["groups", "desired_phase_rad", "dash"]]],
  ["speed", 1, [["uavs", "speed_m_s", "solid"]]],
  ["turn_rate", DEGREES, [["uavs", "turn_rate_rad_s", "solid"]]],
  ["scan_sd", 1, [["groups", "scan_sd_m", "solid"]]],
];

/** The expected curves of a record, in the order of the page. */
function curvesOf(record) {
  const found = [];
  for (const [panel, factor, columns] of PANELS) {
    for (const [of, column, dash] of columns) {
      for (const id of record.ids(of)) {
        const values = record.tables[of][id][column].map((value) => (value === null ? null : value * factor));
        if (values.some((value) => value !== null)) found.push({ panel, dash, column, of, id, factor, values });
      }
    }
  }
  return found;
}

/** The traces of all panels. Here every trace belongs to one object and extends from its first to its last value. */
async function drawn(page) {
  return page.evaluate(() => [...document.querySelectorAll(".panel:not([hidden])")].flatMap(({ dataset, lastChild }) =>
    lastChild.data.map(({ meta, line, opacity, x, y }) =>
      ({ panel: dataset.panel, ...meta[0], dash: line.dash, width: line.width, opacity, x: [...x], y: [...y] }))));
}

const named = ({ panel, of, id, column, dash }) => `${panel}: ${of} ${id} ${column} ${dash}`;

/** The objects that have curves. */
async function shownNames(page) {
  return [...new Set((await drawn(page)).filter(({ of }) => of !== "run").map(({ of, id }) => `${of} ${id}`))].sort();
}

/** The time range shown, s. */
async function range(page) {
  return page.evaluate(() => document.querySelector(".panel:not([hidden]) .plot").layout.xaxis.range.map(Number));
}

/** The inner box of a plot on the page. */
async function plot(page, panel) {
  const place = page.locator(`[data-panel=${panel}] .plot`);
  await place.scrollIntoViewIfNeeded();
  const box = await place.boundingBox();
  const { l, r, t, b } = await place.evaluate(({ layout }) => layout.margin);
  return { x: box.x + l, y: box.y + t, width: box.width - l - r, height: box.height - t - b };
}

/** Drags from one fraction of the width of a plot to another. */
async function drag(page, panel, from, to) {
  const box = await plot(page, panel);
  const y = box.y + box.height / 2;
  await page.mouse.move(box.x + from * box.width, y);
  await page.mouse.down();
  await page.mouse.move(box.x + (from + 0.4 * (to - from)) * box.width, y + 9);
  await page.mouse.move(box.x + to * box.width, y + 5);
  await page.mouse.up();
}

for (const flight of ["figure-9", "out-of-view"]) {
  inReport(`every curve equals the record: ${flight}`, { flight }, async (page) => {
    const record = recordOf(flight);
    const expected = curvesOf(record);
    const traces = await drawn(page);
    assert.deepEqual(traces.map(named), expected.map(named));
    for (const [k, { x, y }] of traces.entries()) {
      const { values } = expected[k];
      const from = record.times_s.indexOf(x[0]);
      assert.ok(values.every((value, at) => value === null || (at >= from && at < from + x.length)), "the trace contains all values");
      assert.deepEqual(x, record.times_s.slice(from, from + x.length));
      same(y, values.slice(from, from + x.length), named(expected[k]));
    }
  });
}

inReport("the charts of a long mission show the extremes, and every time step after zooming in", { flight: "long" }, async (page) => {
  const record = recordOf("long");
  const expected = curvesOf(record);
  assert.ok(expected.some((curve) => curve.column === "position_crlb_m"), "the mission has a bound");
  const extremes = (values) => [Math.min, Math.max].map((most) => values.filter((value) => value !== null).reduce((a, b) => most(a, b)));
  const whole = await drawn(page);
  assert.deepEqual(whole.map(named), expected.map(named));
  for (const [k, { x, y }] of whole.entries()) {
    assert.ok(x.length < record.times_s.length && x.length <= 1500, `${x.length} points`);
    same(extremes(y), extremes(expected[k].values), expected[k].column);
    same(y, x.map((time_s) => expected[k].values[record.times_s.indexOf(time_s)]), expected[k].column);
  }
  const button = page.getByRole("button", { name: "Whole run" });
  assert.equal(await button.count(), 0, "the whole run is shown");
  await goTo(page, 700);
  await drag(page, "off_boresight", 0.25, 0.5);
  await page.waitForFunction(() => [...document.querySelectorAll(".panel:not([hidden]) .plot")].every(({ data }) => data[0].x[0] > 100));
  const zoomed = await drawn(page);
  const [from, to] = await range(page);
  assert.ok(Math.abs(from - 250) < 5 && Math.abs(to - 500) < 5, `${from} to ${to} s`);
  for (const [k, { x, y }] of zoomed.entries()) {
    const within = record.times_s.map((time_s, at) => [time_s, expected[k].values[at]]).filter(([time_s]) => time_s >= x[0] && time_s <= x.at(-1));
    assert.ok(x[0] <= from && x.at(-1) >= to, "the trace reaches both edges");
    assert.deepEqual(x, within.map(([time_s]) => time_s));
    same(y, within.map(([, value]) => value), expected[k].column);
  }
  assert.equal(await clock(page), 700, "dragging does not change the time shown");
  const back = () => page.waitForFunction(() => [...document.querySelectorAll(".panel:not([hidden]) .plot")].every(({ data }) => data[0].x[0] < 10));
  const box = await plot(page, "speed");
  await page.mouse.dblclick(box.x + box.width / 2, box.y + box.height / 2);
  await back();
  assert.deepEqual(await drawn(page), whole, "a double click shows the whole run again");
  assert.equal(await clock(page), 700, "a double click does not change the time shown");
  await drag(page, "turn_rate", 0.9, 0.4);
  await page.waitForFunction(() => document.querySelector(".panel:not([hidden]) .plot").layout.xaxis.range[0] > 300);
  await button.click();
  await back();
  assert.equal(await button.count(), 0);
  assert.equal(await clock(page), 700);
});

inReport("of 100 UAVs the charts show the smallest, the median and the largest value, and the curve of the selected one", { flight: "many-uavs" }, async (page) => {
  const record = recordOf("many-uavs");
  const speeds = () => drawn(page).then((traces) => traces.filter(({ panel }) => panel === "speed"));
  const ascending = record.times_s.map((_, k) => record.ids("uavs").map((id) => record.tables.uavs[id].speed_m_s[k]).sort((a, b) => a - b));
  const summary = await speeds();
  assert.deepEqual(summary.map(({ id }) => id), ["smallest", "median", "largest"]);
  [0, 49, 99].forEach((rank, k) => same(summary[k].y, ascending.map((all) => all[rank]), summary[k].id));
  assert.equal(await page.locator("#legend button[data-of=uavs]").count(), 0, "UAVs have no buttons");
  assert.match(await page.locator("#legend .hint").textContent(), /^100 UAVs: smallest, median and largest value/);
  await page.getByLabel("Find").fill("UAV 7");
  await page.getByLabel("Find").press("Enter");
  await page.waitForFunction(() => document.querySelector("[data-panel=speed] .plot").data.length === 4);
  const [own] = (await speeds()).filter(({ id }) => id === 7);
  same(own.y, record.tables.uavs[7].speed_m_s, "speed of UAV 7");
  await page.locator("#curve-uavs-7").click();
  await page.waitForFunction(() => document.querySelector("[data-panel=speed] .plot").data.length === 1);
  assert.deepEqual((await speeds()).map(({ id }) => id), [7], "a click on its name shows it alone");
});

inReport("a press with a small movement is a click, and a drag does not change the time", {}, async (page) => {
  const whole = await range(page);
  const box = await plot(page, "speed");
  const at = { x: box.x + 0.6 * box.width, y: box.y + box.height / 2 };
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 3, at.y + 2);
  await page.mouse.up();
  await painted(page);
  assert.deepEqual(await range(page), whole);
  const there = await clock(page);
  assert.ok(Math.abs(there - 60) < 1.5, `${there} s`);
  for (const [from, to] of [[0.1, 0.3], [0.8, 0.2]]) {
    await drag(page, "speed", from, to);
    await painted(page);
    assert.equal(await clock(page), there);
  }
});

inReport("legend buttons select curves with pointer and keyboard, and the theme does not change the selection", {}, async (page) => {
  const all = await shownNames(page);
  assert.deepEqual(all, ["groups 0", "groups 1", "uavs 0", "uavs 1", "uavs 2", "uavs 3"]);
  const shows = async (names) => {
    await page.waitForFunction((names) => {
      const shown = [...document.querySelectorAll(".panel:not([hidden]) .plot")].flatMap(({ data }) => data.flatMap(({ meta }) => meta));
      return JSON.stringify([...new Set(shown.filter(({ of }) => of !== "run").map(({ of, id }) => `${of} ${id}`))].sort()) === JSON.stringify(names);
    }, names);
  };
  const legend = page.getByRole("toolbar", { name: "Curves" });
  const button = (name) => legend.getByRole("button", { name, exact: true });
  assert.deepEqual(await legend.getByRole("button").allTextContents(), ["UAV 0", "UAV 1", "UAV 2", "UAV 3", "group 0", "group 1"]);
  assert.equal(await button("UAV 2").getAttribute("aria-pressed"), "false");
  await button("UAV 2").click();
  await shows(["groups 0", "groups 1", "uavs 2"]);
  assert.equal(await button("UAV 2").getAttribute("aria-pressed"), "true");
  await page.getByRole("button", { name: "Theme" }).click();
  await painted(page);
  await shows(["groups 0", "groups 1", "uavs 2"]);
  await button("UAV 2").focus();
  for (const key of ["ArrowRight", "ArrowRight", "ArrowRight"]) await page.keyboard.press(key);
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "group 1");
  await page.keyboard.press("Enter");
  await shows(["groups 1", "uavs 2"]);
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "group 1", "the focus stays");
  assert.equal(await clock(page), 0, "the keys do not act on the page");
  await button("all curves").click();
  await shows(all);
  assert.equal(await button("UAV 2").getAttribute("aria-pressed"), "false");
});

for (const [screen, options] of [["1280x720", {}], ["a phone", PHONE]]) {
  inReport(`legend and time axis stay visible while the panels scroll, and no panel scrolls horizontally: ${screen}`, options, async (page) => {
    const pane = page.getByRole("region", { name: "Charts over time" });
    const hidden = () => page.evaluate(() => {
      const ofPage = ({ left, right, top, bottom }) => left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight;
      const isVisible = (one) => {
        const box = one.getBoundingClientRect();
        const on = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
        return ofPage(box) && (on === one || one.contains(on) || on?.contains(one));
      };
      // On a phone, the legend is one line, which scrolls.
      const legend = document.querySelectorAll(innerWidth > 600 ? "#legend button" : "#legend button:first-child");
      return [...legend, ...document.querySelectorAll("#time-axis span")].filter((one) => !isVisible(one)).map((one) => one.textContent);
    });
    const panes = () => pane.evaluate((pane) => [pane.scrollWidth - pane.clientWidth, pane.scrollHeight - pane.clientHeight]);
    if (options === PHONE) {
      const [charts, side] = [await pane.boundingBox(), await page.locator("aside").boundingBox()];
      assert.ok(charts.height > side.height - 90, `the charts have ${charts.height} of ${side.height} px`);
      // Instead of the map, the panel can use the full height.
      const full = page.getByRole("button", { name: "Full height" });
      await full.click();
      assert.ok((await pane.boundingBox()).height > charts.height + 250, "the charts use the height of the map");
      assert.equal(await page.locator("#map").isVisible(), false);
      await full.click();
      assert.equal((await pane.boundingBox()).height, charts.height);
    }
    const [horizontal, vertical] = await panes();
    assert.equal(horizontal, 0);
    assert.ok(vertical > 200, "the panels scroll vertically");
    const atTop = await hidden();
    assert.deepEqual(atTop, []);
    await pane.evaluate((pane) => pane.scrollTo(0, 1e6));
    await painted(page);
    assert.deepEqual(await hidden(), []);
    // The labels of the axis are at the grid lines of the plots.
    const offsets = await page.evaluate(() => {
      const { layout, ...place } = document.querySelector(".panel:not([hidden]) .plot");
      const plot = document.querySelector(".panel:not([hidden]) .plot").getBoundingClientRect();
      const [first, last] = layout.xaxis.range;
      const inside = plot.width - layout.margin.l - layout.margin.r;
      return [...document.querySelectorAll("#time-axis span:not(.unit)")].map((label) => {
        const box = label.getBoundingClientRect();
        const expected = plot.left + layout.margin.l + ((Number(label.textContent) - first) / (last - first)) * inside;
        return Math.abs((box.left + box.right) / 2 - expected);
      });
    });
    assert.ok(offsets.length >= 3 && offsets.every((px) => px < 1), `${offsets}`);
    const { left, right } = await page.locator("#panel-charts").evaluate((panel) => panel.getBoundingClientRect());
    assert.ok(left >= 0 && right <= (options.viewport?.width ?? 1280), `the panel extends from ${left} to ${right} px`);
  });
}

inReport("the time axis covers the time range shown", {}, async (page) => {
  await drag(page, "speed", 0.2, 0.3);
  await page.waitForFunction(() => document.querySelector(".panel:not([hidden]) .plot").layout.xaxis.range[0] > 10);
  const labels = await page.locator("#time-axis span:not(.unit)").allTextContents();
  const [first, last] = await range(page);
  assert.ok(labels.length >= 3 && labels.every((label) => Number(label) >= first && Number(label) <= last), `${labels} within ${first} to ${last} s`);
});

inReport("a click on a plot goes to that time, and the cursor marks it", {}, async (page) => {
  for (const [panel, share] of [["in_custody", 0.25], ["turn_rate", 0.8]]) {
    const box = await plot(page, panel);
    await page.mouse.click(box.x + share * box.width, box.y + box.height / 2);
    await painted(page);
    assert.ok(Math.abs((await clock(page)) - 100 * share) <= 100 / box.width, `${await clock(page)} s at ${share} of ${panel}`);
    const cursor = await page.locator("#cursor").boundingBox();
    assert.ok(Math.abs(cursor.x + cursor.width / 2 - (box.x + share * box.width)) <= 2, "the cursor is under the pointer");
  }
});

/** The contents of the tooltip: its heading, and names and values from top to bottom. */
async function tooltip(page, panel, share, height = 0.5) {
  const box = await plot(page, panel);
  await page.mouse.move(box.x + share * box.width - 5, box.y + height * box.height);
  await page.mouse.move(box.x + share * box.width, box.y + height * box.height);
  return page.locator("#chart-tooltip").evaluate((hover) => ({
    head: [...hover.childNodes].slice(0, 2).map((node) => node.textContent).join(""),
    rows: [...hover.querySelectorAll("div")].map((row) => [row.childNodes[1].textContent, row.lastChild.textContent]),
    nearest: [...hover.querySelectorAll(".nearest")].map((row) => row.childNodes[1].textContent),
    hidden: hover.hidden,
    box: (({ left, right, top, bottom }) => ({ left, right, top, bottom }))(hover.getBoundingClientRect()),
    pane: (({ left, right, top, bottom }) => ({ left, right, top, bottom }))(document.getElementById("panel-charts").getBoundingClientRect()),
  }));
}

const number = (text) => Number(text.replace("\u2212", "-").split("\u00a0")[0].split("\u00b0")[0]);

inReport("the tooltip of a plot lists the values of that panel at that time, largest first", {}, async (page) => {
  const record = recordOf("figure-9");
  const { head, rows, nearest } = await tooltip(page, "speed", 0.4, 0.02);
  const k = record.times_s.indexOf(Number(head.split(" s")[0]));
  assert.match(head, / s Speed$/);
  assert.ok(Math.abs(record.times_s[k] - 40) <= 0.5, `${head}`);
  assert.deepEqual(rows.map(([name]) => name).sort(), ["UAV 0", "UAV 1", "UAV 2", "UAV 3"]);
  for (const [name, text] of rows) {
    assert.match(text, /\u00a0m\/s$/);
    assert.ok(Math.abs(number(text) - record.tables.uavs[name.slice(4)].speed_m_s[k]) <= 0.0051, `${text} of ${name}`);
  }
  const values = rows.map(([, text]) => number(text));
  assert.deepEqual(values, [...values].sort((a, b) => b - a));
  assert.deepEqual(nearest, [rows[0][0]], "near the top the largest value is emphasised");
  assert.deepEqual((await tooltip(page, "speed", 0.4, 0.98)).nearest, [rows.at(-1)[0]]);
  const error = await tooltip(page, "position_error", 0.5);
  assert.deepEqual(error.rows.map(([name]) => name).sort(), ["all tracks", "group 0", "group 1"]);
});

inReport("the tooltip is never cut off, and disappears when the pointer leaves", {}, async (page) => {
  for (const [panel, share, height] of [["in_custody", 0.01, 0.05], ["in_custody", 0.99, 0.95], ["scan_sd", 0.99, 0.95], ["standoff_distance", 0.5, 0.5]]) {
    const { box, pane, rows, hidden } = await tooltip(page, panel, share, height);
    assert.ok(!hidden && rows.length > 0, panel);
    assert.ok(box.left >= pane.left && box.right <= pane.right && box.top >= pane.top && box.bottom <= pane.bottom, JSON.stringify([panel, box, pane]));
  }
  const cut = await page.locator("#chart-tooltip").evaluate((hover) => hover.scrollWidth > hover.clientWidth || hover.scrollHeight > hover.clientHeight);
  assert.ok(!cut);
  await page.mouse.move(300, 300);
  assert.ok(await page.locator("#chart-tooltip").isHidden());
  assert.equal(await page.locator(".modebar, .hoverlayer .hovertext").count(), 0, "no plotly controls cover the curves");
});

inReport("the tooltip leaves out curves without a value at that time", { flight: "out-of-view" }, async (page) => {
  const record = recordOf("out-of-view");
  const expected = curvesOf(record).filter(({ panel }) => panel === "position_error");
  for (const share of [0.1, 0.5, 0.9]) {
    const { head, rows } = await tooltip(page, "position_error", share);
    const k = record.times_s.indexOf(Number(head.split(" s")[0]));
    assert.equal(rows.length, expected.filter(({ values }) => values[k] !== null).length, head);
  }
});

inReport("panels have descriptions and can be hidden", {}, async (page) => {
  const heading = (name) => page.getByRole("heading", { level: 2, name });
  for (const [name, text] of [[/^Off-boresight angle/, "boresight"], [/^True standoff error, outside \(\+\), inside \(\u2212\) \(m\)/, "r_d"], [/^Targets in custody/, "field of view"]]) {
    assert.ok((await heading(name).getAttribute("title")).includes(text));
  }
  await page.getByRole("button", { name: "Panels" }).focus();
  await page.keyboard.press("Enter");
  const list = page.getByRole("group", { name: "Panels" });
  assert.equal(await list.getByRole("checkbox").count(), PANELS.length);
  assert.ok((await list.textContent()).includes("largest angle between a UAV's boresight"), "the list contains the descriptions");
  const box = await list.boundingBox();
  const footer = await page.locator("footer").boundingBox();
  assert.ok(box.x >= 0 && box.y >= 0 && box.x + box.width <= 1280 && box.y + box.height <= footer.y, JSON.stringify(box));
  await list.getByRole("checkbox", { name: "Off-boresight angle" }).uncheck();
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("#panel-list").isHidden());
  await page.waitForFunction(() => document.querySelector("[data-panel=off_boresight]").hidden);
  assert.equal(await heading(/^Off-boresight angle/).count(), 0);
  assert.equal(await heading(/^Speed/).count(), 1);
});

inReport("the saved CSV file equals the record at every time step", { flight: "long" }, async (page) => {
  const record = recordOf("long");
  await goTo(page, 50);
  await page.getByRole("toolbar", { name: "Curves" }).getByRole("button", { name: "UAV 0" }).click();
  const download = await downloaded(page, () => page.getByRole("button", { name: "Save CSV" }).click());
  assert.equal(download.name, "paper-table-2-pair-1.csv");
  const [heads, ...rows] = readFileSync(download.path, "utf8").trimEnd().split("\n").map((line) => line.split(","));
  const column = (name) => rows.map((row) => (row[heads.indexOf(name)] === "" ? null : Number(row[heads.indexOf(name)])));
  assert.deepEqual(column("time_s"), record.times_s);
  const expected = curvesOf(record);
  assert.equal(heads.length, 1 + expected.length);
  assert.equal(new Set(heads).size, heads.length, "column names are unique");
  for (const { of, id, column: name } of expected) {
    const head = { uavs: `uav_${id}_${name}`, groups: `group_${id}_${name}`, run: `run_${name}` }[of];
    assert.ok(heads.includes(head), head);
    same(column(head), record.tables[of][id][name], head, 1e-6);
  }
});

inReport("a quantity of the record can be added as a chart, is part of the link and of the CSV file, and can be removed", {}, async (page) => {
  const record = recordOf("figure-9");
  await page.getByRole("button", { name: "Panels" }).click();
  await page.getByLabel("Add a chart").selectOption("uavs.commanded_altitude_m");
  await page.getByLabel("Add a chart").selectOption("groups.spread_m");
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => document.querySelector('[data-panel="groups.spread_m"] .plot')?.data);
  const added = (await drawn(page)).filter(({ panel }) => panel.includes("."));
  assert.equal(added.length, record.ids("uavs").length + record.ids("groups").length);
  for (const { panel, of, id, column, x, y } of added) {
    assert.equal(panel, `${of}.${column}`);
    const from = record.times_s.indexOf(x[0]);
    same(y, record.tables[of][id][column].slice(from, from + x.length), `${of} ${id}`);
  }
  assert.equal(await page.getByRole("heading", { level: 2, name: "Groups: spread (m)" }).count(), 1);
  const csv = await downloaded(page, () => page.getByRole("button", { name: "Save CSV" }).click());
  const [heads] = readFileSync(csv.path, "utf8").split("\n");
  assert.ok(heads.split(",").includes("group_0_spread_m"), heads);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => location.hash.includes("charts="));
  assert.match(decodeURIComponent(await page.evaluate(() => location.hash)), /charts=in_custody,.*,scan_sd,uavs\.commanded_altitude_m,groups\.spread_m/);
  await page.evaluate(() => (location.hash = "#charts=speed,uavs.altitude_m"));
  await page.waitForFunction(() => document.querySelectorAll(".panel:not([hidden])").length === 2);
  await page.getByRole("button", { name: "Panels" }).click();
  await page.getByRole("checkbox", { name: "UAVs: altitude" }).uncheck();
  assert.equal(await page.locator('[data-panel="uavs.altitude_m"]').count(), 0);
  await page.keyboard.press("Escape");
  await page.evaluate(() => (location.hash = "#charts=speed,uavs.nothing_m"));
  await page.waitForFunction(() => /charts=uavs\.nothing_m, which is no chart/.test(document.getElementById("event-summary").textContent));
});

inReport("the charts can be saved as SVG with their legend", {}, async (page) => {
  const download = await downloaded(page, () => page.getByRole("button", { name: "Save SVG" }).click());
  assert.equal(download.name, "paper-figure-9-1.svg");
  const text = readFileSync(download.path, "utf8");
  const { error, texts, links } = await page.evaluate((text) => {
    const file = new DOMParser().parseFromString(text, "image/svg+xml");
    const all = [...file.documentElement.querySelectorAll("*")];
    return {
      error: file.querySelector("parsererror")?.textContent ?? "", texts: all.filter(({ tagName }) => tagName === "text").map((one) => one.textContent),
      links: all.flatMap((one) => [...one.attributes]).filter(({ name }) => /href|^on/.test(name)).length,
    };
  }, text);
  assert.equal(error, "");
  assert.equal(links, 0, "the file refers to nothing");
  for (const expected of ["paper/figure-9, seed 1", "UAV 0", "group 1", "Time (s)"]) assert.ok(texts.includes(expected), `${expected} is among ${texts}`);
  // The headings explain the same lines as those on the page, such as the limits.
  const headings = await page.locator(".panel:not([hidden]) h2").evaluateAll((all) => all.map((one) => [one.firstChild, ...one.querySelectorAll("small")].map((part) => part.textContent)));
  assert.ok(headings.flat().includes("limits") && headings.flat().includes("half the field of view"), `${headings}`);
  for (const [name, ...kinds] of headings) {
    const heading = texts.find((text) => text.startsWith(name));
    for (const kind of kinds) assert.ok(heading?.includes(kind), `${kind} is in ${heading}`);
  }
});

inReport("the charts can be saved as a PNG with a legend", {}, async (page) => {
  const saved = async () => {
    const download = await downloaded(page, () => page.getByRole("button", { name: "Save PNG" }).click());
    assert.equal(download.name, "paper-figure-9-1.png");
    const bytes = readFileSync(download.path);
    assert.equal(bytes.subarray(0, 8).toString("latin1"), "\x89PNG\r\n\x1a\n");
    return { wide: bytes.readUInt32BE(16), high: bytes.readUInt32BE(20), bytes };
  };
  const { wide, high, bytes } = await saved();
  assert.equal(wide, 2000, "px wide");
  assert.ok(high > 2000, "px high");
  assert.ok(bytes.length > 50_000, `${bytes.length} bytes`);
  // The legend is above the first panel: its colours are in that part of the image.
  const inks = await page.evaluate(async (base64) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, 160];
    const ctx = canvas.getContext("2d");
    ctx.drawImage(image, 0, 0);
    const { data } = ctx.getImageData(0, 0, canvas.width, canvas.height);
    const found = new Set();
    for (let k = 0; k < data.length; k += 4) found.add(`#${[0, 1, 2].map((i) => data[k + i].toString(16).padStart(2, "0")).join("")}`);
    const hex = (rgb) => `#${rgb.match(/\d+/g).map((value) => Number(value).toString(16).padStart(2, "0")).join("")}`;
    return [...document.querySelectorAll("#legend .stroke")].map((mark) => [hex(getComputedStyle(mark).borderTopColor), found.has(hex(getComputedStyle(mark).borderTopColor))]);
  }, bytes.toString("base64"));
  assert.equal(inks.length, 6);
  assert.deepEqual(inks.filter(([, isFound]) => !isFound), []);
  for (const name of ["Off-boresight angle", "Speed", "Turn rate"]) {
    await page.getByRole("button", { name: "Panels" }).click();
    await page.getByRole("checkbox", { name }).uncheck();
    await page.keyboard.press("Escape");
  }
  await page.waitForFunction(() => document.querySelectorAll(".panel[hidden]").length === 4);
  assert.ok((await saved()).high < high - 600, "hidden panels are not in the image");
});

/** Widths and opacities of the traces of a panel, by object. */
async function looks(page, panel) {
  const traces = (await drawn(page)).filter((trace) => trace.panel === panel);
  return new Map(traces.map(({ of, id, width, opacity }) => [`${of} ${id}`, { width, opacity }]));
}

/** Selects an object by its name. */
async function choose(page, name) {
  await page.getByLabel("Find").fill(name);
  await page.keyboard.press("Enter");
}

inReport("curves of the selected object are emphasised: a UAV and its groups, a group and its UAVs", {}, async (page) => {
  const record = recordOf("figure-9");
  const plain = [...(await looks(page, "speed")).values()];
  assert.ok(plain.every(({ width, opacity }) => width === plain[0].width && opacity === 1), "without a selection all curves have the same style");
  const front = async (panel) => {
    const all = [...await looks(page, panel)];
    const widest = Math.max(...all.map(([, { width }]) => width));
    const names = all.filter(([, { width }]) => width === widest).map(([name]) => name);
    assert.ok(all.every(([name, { width, opacity }]) => (names.includes(name) ? width > 2 && opacity === 1 : width < 2 && (opacity < 0.5 || name.startsWith("run")))), JSON.stringify(all));
    // Emphasised curves are drawn last, on top.
    assert.deepEqual(all.slice(-names.length).map(([name]) => name), names);
    return names.sort();
  };
  const groupsOf = (id) => [...new Set(record.tables.uavs[id].group.filter((group) => group !== null))].map((group) => `groups ${group}`).sort();
  await choose(page, "UAV 1");
  await page.waitForFunction(() => [...document.querySelector("[data-panel=scan_sd] .plot").data].some(({ opacity }) => opacity < 1));
  assert.deepEqual(await front("speed"), ["uavs 1"]);
  assert.deepEqual(await front("scan_sd"), groupsOf(1));
  assert.ok(await page.getByRole("toolbar", { name: "Curves" }).getByRole("button", { name: "UAV 1" }).evaluate((chip) => chip.classList.contains("front")));
  const [group] = groupsOf(2);
  await choose(page, group.replace("groups", "group"));
  await page.waitForFunction((id) => document.querySelector("[data-panel=scan_sd] .plot").data.at(-1).meta[0].id === id, Number(group.split(" ")[1]));
  await painted(page);
  assert.deepEqual(await front("scan_sd"), [group]);
  await page.waitForFunction(() => document.querySelector("[data-panel=turn_rate] .plot").data.filter(({ line }) => line.width > 2).length === 2);
  assert.deepEqual(await front("speed"), record.ids("uavs").filter((id) => groupsOf(id).includes(group)).map((id) => `uavs ${id}`));
});

inReport("the selected target has a panel on top, which covers the whole run and marks times out of view", { flight: "out-of-view" }, async (page) => {
  const record = recordOf("out-of-view");
  const hidden = ({ in_view }) => in_view.includes(false);
  const id = record.ids("targets").find((id) => hidden(record.tables.targets[id]));
  const { error_m, in_view, group } = record.tables.targets[id];
  await page.getByRole("region", { name: "Charts over time" }).evaluate((pane) => pane.scrollTo(0, 1e6));
  await choose(page, record.names[id]);
  const panel = page.locator("[data-panel=target]");
  await panel.waitFor();
  await page.waitForFunction((count) => document.querySelector("[data-panel=target] .plot").data?.[0]?.x.length >= count,
    error_m.filter((value) => value !== null).length);
  assert.match(await panel.getByRole("heading").textContent(), new RegExp(`^Target ${record.names[id]}, position error \\(m\\)`));
  assert.ok(!(await panel.getByRole("heading").textContent()).includes("loading"), "all data is loaded");
  const { x, y, bands } = await panel.locator(".plot").evaluate(({ data, layout }) => ({
    x: data[0].x, y: data[0].y, bands: layout.shapes.filter(({ type }) => type === "rect").map(({ x0, x1, fillcolor }) => [x0, x1, fillcolor]),
  }));
  const from = record.times_s.indexOf(x[0]);
  same(y, error_m.slice(from, from + x.length), "position error", 1e-3);
  // At every time step the shading is correct.
  const alarm = bands.map(([, , colour]) => colour).find((colour) => /rgba\(19|rgba\(2/.test(colour));
  for (const [k, time_s] of record.times_s.slice(0, -1).entries()) {
    const is = in_view[k] === false;
    const shaded = bands.some(([x0, x1, colour]) => colour === alarm && time_s >= x0 && time_s < x1);
    assert.equal(shaded, is, `at ${time_s} s`);
  }
  const box = await panel.boundingBox();
  const pane = await page.getByRole("region", { name: "Charts over time" }).boundingBox();
  assert.ok(Math.abs(box.y - pane.y) < 3, "the panel is visible");
  const groups = [...new Set(group.filter((one) => one !== null))];
  await page.waitForFunction((count) => document.querySelector("[data-panel=scan_sd] .plot").data.filter(({ line }) => line.width > 2).length === count, groups.length);
  await choose(page, "UAV 0");
  await page.waitForFunction(() => document.querySelector("[data-panel=target]").hidden);
});

inReport("with eight UAVs and many groups the legend fits, the tooltip lists ten values, and colours differ", { flight: "crowd" }, async (page) => {
  const names = await page.getByRole("toolbar", { name: "Curves" }).getByRole("button").allTextContents();
  assert.ok(names.includes("UAV 7") && names.length <= 16, `${names}`);
  const legend = await page.locator("#legend").boundingBox();
  assert.ok(legend.height <= 100, `${legend.height} px`);
  const traces = await drawn(page);
  const colours = await page.locator("[data-panel=speed] .plot").evaluate(({ data }) => data.map(({ line }) => line.color));
  assert.equal(new Set(colours).size, 8);
  assert.ok(traces.length < 100, `${traces.length} lines`);
  const { rows, head } = await tooltip(page, "standoff_distance", 0.5);
  assert.equal(rows.length, 10, head);
  assert.match(await page.locator("#chart-tooltip").textContent(), /and \d+ more$/);
});
