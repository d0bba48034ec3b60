// The page of a sweep, opened from disk in Chromium without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { PHONE, downloaded, emptyPage, closeBrowser } from "./browser.mjs";

let folder;
/** Output of `--json` of each sweep. */
const swept = {};

/** The JSON output of a command. */
const output = (...args) => JSON.parse(execFileSync(process.env.STANDOFF, args, { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] }));

before(() => {
  folder = mkdtempSync(join(tmpdir(), "standoff-sweep-"));
  const sweep = (out, ...args) => {
    const short = ["--runs", "3", "--set", "duration_s=20", "--set", "transient_s=5", "--json", "--out", out];
    swept[out] = output("sweep", "paper/table-2-pair", ...args, ...short);
  };
  sweep("line", "--vary", "sensor.range_sd_m=20,5,10");
  sweep("map", "--vary", "sensor.range_sd_m=5,20", "--vary", "guidance.law=oh-2015,standoff");
  sweep("hypercube", "--vary", "sensor.range_sd_m=5..20", "--vary", "uavs.count=2..4", "--points", "5");
});

after(async () => {
  await closeBrowser();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens the page of a sweep, calls `check`, and asserts that the page had no errors and made no requests. */
async function opened(name, check, options = {}) {
  const { context, page, complaints } = await emptyPage(options);
  await page.goto(pathToFileURL(join(folder, name, "report.html")).href);
  await page.waitForSelector('body[data-ready="charts"]');
  await check(page);
  assert.deepEqual(complaints, []);
  await context.close();
}

/** The trace of the plot. */
const trace = (page) => page.evaluate(() => {
  const { type, mode, x, y, z, error_y, marker } = document.querySelector("#sweep-plot").data[0];
  return { type, mode, x, y, z, error_y, colours: marker?.color };
});

const means = (name, metric) => swept[name].points.map(({ metrics }) => metrics[metric].mean);
const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-9 * Math.abs(b), `${a} ${b}`);

test("one key is a line plot with intervals, in the order of the values", () => opened("line", async (page) => {
  const { type, mode, x, y, error_y } = await trace(page);
  assert.deepEqual([type, mode, x], ["scatter", "lines+markers", [5, 10, 20]]);
  const points = [1, 2, 0].map((point) => swept.line.points[point].metrics.position_error_m);
  points.forEach(({ mean, ci95 }, index) => {
    near(y[index], mean);
    near(y[index] + error_y.array[index], ci95[1]);
    near(y[index] - error_y.arrayminus[index], ci95[0]);
  });
  const rows = await page.locator("#sweep-points tbody tr").allTextContents();
  assert.equal(rows.length, 3);
  assert.ok(rows[0].startsWith("203"), rows[0]);
  // Fractions are shown in percent.
  await page.selectOption("#sweep-metric", { label: "target time in custody (%)" });
  await page.waitForFunction(() => document.querySelector("#sweep-plot").data[0].y.every((value) => value > 1));
  near((await trace(page)).y[0], 100 * means("line", "custody_fraction")[1]);
}));

test("two keys of a grid are a heat map", () => opened("map", async (page) => {
  const { type, x, y, z } = await trace(page);
  assert.deepEqual([type, x, y], ["heatmap", [5, 20], ["oh-2015", "standoff"]]);
  const [a, b, c, d] = means("map", "position_error_m");
  [z[0][0], z[1][0], z[0][1], z[1][1]].forEach((value, index) => near(value, [a, b, c, d][index]));
  await page.selectOption("#sweep-y", "mean");
  await page.waitForFunction(() => document.querySelector("#sweep-plot").data[0].type === "scatter");
  const lines = await page.evaluate(() => document.querySelector("#sweep-plot").data.map(({ name, x }) => ({ name, x })));
  assert.deepEqual(lines, ["oh-2015", "standoff"].map((law) => ({ name: `guidance.law = ${law}`, x: [5, 20] })));
}));

test("a Latin hypercube is a plot of coloured points, saved as CSV", () => opened("hypercube", async (page) => {
  const { type, mode, x, colours } = await trace(page);
  assert.deepEqual([type, mode], ["scatter", "markers"]);
  assert.deepEqual(x, swept.hypercube.points.map(({ values }) => values["sensor.range_sd_m"]));
  means("hypercube", "position_error_m").forEach((mean, index) => near(colours[index], mean));
  const download = await downloaded(page, () => page.click("#csv"));
  const [head, ...rows] = readFileSync(download.path, "utf8").trim().split("\n").map((line) => line.split(","));
  assert.equal(rows.length, 5);
  const column = head.indexOf("position_error_m_ci95_low");
  rows.forEach((row, index) => near(Number(row[column]), swept.hypercube.points[index].metrics.position_error_m.ci95[0]));
}));

/** Cells of the table of points. */
const cells = (page) => page.locator("#sweep-points tbody tr").evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));

test("differences from the selected reference are paired, as those of standoff compare", () => opened("line", async (page) => {
  await page.selectOption("#sweep-show", "differences");
  // In the order of the values 5, 10 and 20, which are the points 1, 2 and 0.
  for (const reference of [0, 1]) {
    await page.selectOption("#sweep-reference", String(reference));
    const at = [1, 2, 0].indexOf(reference);
    await page.waitForFunction((at) => document.querySelector("#sweep-plot").data[0].y[at] === 0, at);
    const { y, error_y } = await trace(page);
    const rows = await cells(page);
    for (const [index, point] of [1, 2, 0].entries()) {
      if (point === reference) continue;
      const { difference, ci95, better, differs } = output("compare", `line/points/${reference}`, `line/points/${point}`, "--json").metrics.position_error_m;
      near(y[index], difference);
      near(y[index] + error_y.array[index], ci95[1]);
      const verdict = rows[point].at(-1);
      assert.equal(verdict === "better" || verdict === "worse", differs, verdict);
      if (better) assert.equal(verdict, { a: "worse", b: "better" }[better]);
    }
    assert.deepEqual(rows[reference].slice(-3), ["", "", "reference"]);
  }
  const download = await downloaded(page, () => page.click("#csv"));
  const [head, ...rows] = readFileSync(download.path, "utf8").trim().split("\n").map((line) => line.split(","));
  assert.equal(Number(rows[1][head.indexOf("position_error_m_difference")]), 0);
}));

test("the main metrics have small plots over the same axis, which select the metric of the large plot", () => opened("line", async (page) => {
  const plots = page.locator("#sweep-plots button");
  const ranges = await plots.evaluateAll((all) => all.map((button) => JSON.stringify(button.lastChild.layout.xaxis.range)));
  assert.ok(ranges.length >= 8 && new Set(ranges).size === 1, `${ranges}`);
  const names = await plots.evaluateAll((all) => all.map((button) => button.getAttribute("aria-label")));
  assert.ok(!names.some((name) => name.startsWith("geofence")), "metrics without values have no plot");
  const button = page.getByRole("button", { name: "target time in custody (%)" });
  await button.focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("#sweep-plot").layout.yaxis.title.text === "target time in custody (%)");
  assert.equal(await button.getAttribute("aria-pressed"), "true");
  assert.equal(await page.locator("#sweep-plots [aria-pressed=true]").count(), 1);
  assert.deepEqual(await button.evaluate(({ lastChild }) => lastChild.data[0].y), (await trace(page)).y);
}));

for (const [screen, options] of [["1440x900", { viewport: { width: 1440, height: 900 } }], ["a phone", PHONE]]) {
  for (const name of ["line", "map", "hypercube"]) {
    test(`nothing is cut off on ${screen} and on paper: ${name}`, () => opened(name, async (page) => {
      const isWide = () => page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
      assert.equal(await isWide(), false);
      const small = await page.locator("#sweep-plots button").evaluateAll((all) => all.map((button) => [button.clientWidth, button.querySelector("svg").clientWidth]));
      assert.ok(small.length >= 8 && small.every(([button, plot]) => plot <= button && plot > 100), `${small}`);
      await page.evaluate(() => window.dispatchEvent(new Event("beforeprint")));
      await page.emulateMedia({ media: "print" });
      await page.setViewportSize({ width: 718, height: 1000 });
      const grounds = () => page.evaluate(() => [...document.querySelectorAll("#sweep-plot, #sweep-plots span")].map(({ layout }) => layout.paper_bgcolor));
      assert.deepEqual(new Set(await grounds()), new Set(["#ffffff"]));
      assert.equal(await isWide(), false);
    }, { ...options, colorScheme: "dark" }));
  }
}
