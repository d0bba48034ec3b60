// The page of a sweep, opened from disk in Chromium without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { emptyPage, closeBrowser } from "./browser.mjs";

let folder;
/** Output of `--json` of each sweep. */
const swept = {};

before(() => {
  folder = mkdtempSync(join(tmpdir(), "standoff-sweep-"));
  const sweep = (out, ...args) => {
    const short = ["--runs", "3", "--set", "duration_s=20", "--set", "transient_s=5", "--json", "--out", out];
    const options = { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] };
    swept[out] = JSON.parse(execFileSync(process.env.STANDOFF, ["sweep", "paper/table-2-pair", ...args, ...short], options));
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
async function opened(name, check) {
  const { context, page, complaints } = await emptyPage();
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
  assert.deepEqual((await trace(page)).x, [5, 5, 20, 20]);
}));

test("a Latin hypercube is a plot of coloured points, saved as CSV", () => opened("hypercube", async (page) => {
  const { type, mode, x, colours } = await trace(page);
  assert.deepEqual([type, mode], ["scatter", "markers"]);
  assert.deepEqual(x, swept.hypercube.points.map(({ values }) => values["sensor.range_sd_m"]));
  means("hypercube", "position_error_m").forEach((mean, index) => near(colours[index], mean));
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#csv")]);
  const [head, ...rows] = readFileSync(await download.path(), "utf8").trim().split("\n").map((line) => line.split(","));
  assert.equal(rows.length, 5);
  const column = head.indexOf("position_error_m_ci95_low");
  rows.forEach((row, index) => near(Number(row[column]), swept.hypercube.points[index].metrics.position_error_m.ci95[0]));
}));
