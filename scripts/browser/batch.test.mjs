// The page of Monte Carlo results, opened from disk in Chromium without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { downloaded, emptyPage, closeBrowser } from "./browser.mjs";

const STANDOFF = process.env.STANDOFF;
const HOSTILE = "<img src=x onerror=alert(1)>$(id)";
const RUNS = 25;

let folder;

/** Runs the command and returns its output. */
function standoff(...args) {
  return execFileSync(STANDOFF, args, { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

before(() => {
  folder = mkdtempSync(join(tmpdir(), "standoff-batch-"));
  const fly = ["--runs", String(RUNS), "--seed", "5", "--set", "duration_s=40", "--out"];
  standoff("monte-carlo", "paper/table-2-pair", ...fly, "a");
  standoff("monte-carlo", "paper/table-2-pair", "--set", "sensor.range_sd_m=30", ...fly, "b");
  standoff("compare", "a", "b", "--report", "ab.html");
  writeFileSync(join(folder, `${HOSTILE}.toml`), standoff("scenarios", "show", "tour/02-two-uavs"));
  standoff("monte-carlo", `${HOSTILE}.toml`, "--runs", "3", "--out", "hostile");
});

after(async () => {
  await closeBrowser();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens a page, calls `check`, and asserts that the page had no errors and made no requests. */
async function opened(file, check, options = {}) {
  const { context, page, complaints } = await emptyPage(options);
  await page.goto(pathToFileURL(join(folder, file)).href);
  await page.waitForSelector('body[data-ready="charts"]');
  await check(page);
  assert.deepEqual(complaints, []);
  await context.close();
}

/** The cells of a metric in a table: the text and the exact number (the title), by statistic. */
function cells(page, table, metric, batch = "") {
  const rows = page.locator(`#${table} tr[data-metric="${metric}"]`);
  const row = batch ? rows.filter({ has: page.getByRole("cell", { name: batch, exact: true }) }) : rows;
  return row.locator("td[data-statistic]").evaluateAll((all) =>
    Object.fromEntries(all.map((cell) => [cell.dataset.statistic, { text: cell.textContent, exact: cell.title }])));
}

/** Selects a metric by a click. */
async function choose(page, metric) {
  await page.locator(`#metrics tr[data-metric="${metric}"] button`).click();
  await page.waitForFunction((name) => document.querySelector("#summary").textContent.startsWith(`${name}.`), metric);
}

/** Clicks a button and returns the file that it downloads. */
async function saved(page, button) {
  const download = await downloaded(page, () => page.click(button));
  return { name: download.name, text: readFileSync(download.path, "utf8") };
}

/** The values of all runs, from the CSV file of the page. */
async function values(page) {
  const [heads, ...lines] = (await saved(page, "#csv")).text.trim().split("\n").map((line) => line.split(","));
  return lines.map((line) => Object.fromEntries(line.map((cell, index) => [heads[index], cell])));
}

test("the table shows the numbers of summary.json", () =>
  opened("a/report.html", async (page) => {
    const { metrics } = JSON.parse(readFileSync(join(folder, "a/summary.json"), "utf8"));
    assert.equal(await page.locator("#metrics tbody tr").count(), Object.keys(metrics).length);
    for (const [metric, statistics] of Object.entries(metrics)) {
      const shown = await cells(page, "metrics", metric);
      const exact = (value) => (value === null ? "" : Array.isArray(value) ? value.join(" to ") : String(value));
      for (const [name, value] of Object.entries(statistics)) assert.equal(shown[name].exact, exact(value), `${metric} ${name}`);
    }
    const { mean, ci95, sd, n } = metrics.phase_error_deg;
    const shown = await cells(page, "metrics", "phase_error_deg");
    assert.equal(shown.n.text, String(n));
    assert.equal(shown.mean.text, mean.toFixed(3));
    assert.equal(shown.ci95.text, `${ci95[0].toFixed(3)} to ${ci95[1].toFixed(3)}`);
    assert.equal(shown.sd.text, sd.toFixed(4));
    const share = metrics.turn_rate_saturated_fraction.mean;
    assert.ok(share > 0.01 && share < 1);
    assert.equal(parseFloat((await cells(page, "metrics", "turn_rate_saturated_fraction")).mean.text), Number((100 * share).toPrecision(4)));
  }));

test("selecting a metric shows the distribution of its values", () =>
  opened("a/report.html", async (page) => {
    await choose(page, "velocity_error_m_s");
    assert.equal(await page.textContent("#metric"), "velocity error");
    assert.match(page.url(), /#velocity_error_m_s$/);
    const mean = (await cells(page, "metrics", "velocity_error_m_s")).mean.text;
    assert.ok((await page.textContent("#summary")).includes(`mean ${mean} m/s (`));
    await page.waitForFunction(() => document.querySelector("#distribution").layout.xaxis.title.text === "velocity error (m/s)");
    const [bars, line] = await page.evaluate(() => {
      const { data, layout } = document.querySelector("#distribution");
      return [data[0], layout.shapes.find((shape) => shape.type === "line").x0];
    });
    const measured = (await values(page)).map((run) => Number(run.velocity_error_m_s));
    const from = bars.x[0] - bars.width / 2;
    const counts = bars.x.map(() => 0);
    // The smallest value is the lower edge of the first bin, the largest value the upper edge of the last bin.
    for (const value of measured) counts[Math.min(counts.length - 1, Math.floor((value - from) / bars.width + 1e-9))]++;
    assert.deepEqual(bars.y, counts);
    assert.equal(counts.reduce((sum, count) => sum + count), RUNS);
    assert.ok(Math.abs(line - measured.reduce((sum, value) => sum + value) / RUNS) < 1e-12);
  }));

test("the command of the worst run repeats that run exactly", () =>
  opened("a/report.html", async (page) => {
    const runs = await values(page);
    for (const [metric, worst] of [["phase_error_deg", Math.max], ["separation_min_m", Math.min]]) {
      await choose(page, metric);
      assert.match(await page.locator("#run-order option:checked").textContent(), /^worst: /);
      const value = worst(...runs.map((run) => Number(run[metric])));
      const { seed } = runs.find((run) => Number(run[metric]) === value);
      const first = page.locator("#runs tbody tr").first();
      assert.equal(await first.locator("td").nth(1).getAttribute("title"), String(value));
      assert.equal(await first.locator("td").nth(2).textContent(), seed);
      const command = await page.textContent("#command");
      assert.equal(command, `standoff run paper/table-2-pair --set duration_s=40 --seed ${seed}`);
      const outcome = JSON.parse(standoff(...command.split(" ").slice(1), "--json", "--out", `again-${metric}`));
      assert.equal(outcome.metrics[metric], value);
    }
  }));

test("metric, order and run can be selected with the keyboard", () =>
  opened("a/report.html", async (page) => {
    const selectedMetric = () => page.locator('#metrics button[aria-pressed="true"]').textContent();
    for (let n = 0; n < 12 && (await selectedMetric()) !== "velocity error\u00a0m/s"; n += 1) await page.keyboard.press("ArrowDown");
    assert.equal(await selectedMetric(), "velocity error\u00a0m/s");
    await page.locator("#run-order").selectOption({ index: 1 });
    const best = await page.locator("#runs tbody tr td:nth-child(2)").first().getAttribute("title");
    const all = (await values(page)).map((run) => Number(run.velocity_error_m_s));
    assert.equal(Number(best), Math.min(...all));
    await page.locator("#runs button").nth(2).press("Enter");
    const seed = await page.locator("#runs tbody tr").nth(2).locator("td").nth(2).textContent();
    assert.ok((await page.textContent("#command")).endsWith(`--seed ${seed}`));
    const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
    const earlier = await theme();
    await page.keyboard.press("t");
    assert.notEqual(await theme(), earlier);
  }));

test("two batches are compared run by run", () =>
  opened("ab.html", async (page) => {
    const { metrics } = JSON.parse(standoff("compare", "a", "b", "--json"));
    await page.click("#tab-differences");
    const verdicts = new Set();
    for (const [metric, paired] of Object.entries(metrics)) {
      const shown = await cells(page, "differences", metric);
      assert.equal(shown.difference.exact, String(paired.difference ?? ""), metric);
      assert.equal(shown.ci95.exact, paired.ci95?.join(" to ") ?? "", metric);
      const undecided = ([low, high], interest) => (low >= -interest && high <= interest ? "same: below the size of interest" : "unclear");
      const verdict = !paired.ci95 ? "too few runs" : !paired.differs ? undecided(paired.ci95, paired.interest)
        : paired.better ? `${paired.better.toUpperCase()} is better` : "differs";
      assert.equal(shown.verdict.text, verdict, metric);
      verdicts.add(verdict);
    }
    assert.ok(verdicts.size >= 2, [...verdicts].join());
    await page.click("#tab-metrics");
    const summary = JSON.parse(readFileSync(join(folder, "b/summary.json"), "utf8"));
    assert.equal((await cells(page, "metrics", "anees", "B")).mean.exact, String(summary.metrics.anees.mean));
    await page.click("#tab-batches");
    assert.deepEqual(await page.locator("#settings tbody td").allTextContents(), ["sensor.range_sd_m", "10", "30"]);
    await page.locator("#variant").selectOption("B");
    assert.match(await page.textContent("#command"), /--set sensor.range_sd_m=30/);
  }));

test("a click on a point of the scatter plot selects that run", () =>
  opened("a/report.html", async (page) => {
    await page.click("#tab-scatter");
    await page.locator("#x-metric").selectOption("position_error_m");
    await page.locator("#y-metric").selectOption("anees");
    await page.waitForFunction(() => document.querySelector("#scatter").layout?.yaxis.title.text.startsWith("ANEES"));
    const runs = await values(page);
    const [data] = await page.evaluate(() => document.querySelector("#scatter").data.map(({ x, y, customdata }) => ({ x, y, customdata })));
    assert.deepEqual(data.y, runs.map((run) => Number(run.anees)));
    assert.deepEqual(data.x, runs.map((run) => Number(run.position_error_m)));
    const point = page.locator("#scatter .scatterlayer .point").nth(7);
    const box = await point.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.waitForSelector("#scatter .hoverlayer .hovertext");
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    // Points may overlap: the selected run is one of those drawn at this position.
    await page.waitForFunction(() => !document.querySelector("#command").hidden);
    const seed = (await page.textContent("#command")).split(" ").at(-1);
    const selectedRun = runs.findIndex((run) => run.seed === seed);
    assert.ok(Math.abs(data.x[selectedRun] - data.x[7]) < 0.02 && Math.abs(data.y[selectedRun] - data.y[7]) < 0.02, seed);
  }));

test("a hostile scenario name is shown as text, and its scenario can be saved and run", () =>
  opened("hostile/report.html", async (page) => {
    assert.ok((await page.textContent("#title")).startsWith(HOSTILE));
    assert.equal(await page.locator("img").count(), 0);
    await choose(page, "position_error_m");
    const command = await page.textContent("#command");
    assert.match(command, /^standoff run [\w.-]+\.toml --seed \d+$/);
    const { name, text } = await saved(page, "#toml");
    assert.equal(name, command.split(" ")[2]);
    writeFileSync(join(folder, name), text);
    const outcome = JSON.parse(standoff(...command.split(" ").slice(1), "--json", "--out", "again-hostile"));
    const value = await page.locator("#runs tbody tr td:nth-child(2)").first().getAttribute("title");
    assert.equal(String(outcome.metrics.position_error_m), value);
  }));

/** Very long settings must wrap. */
test("no element is wider than the screen of a desktop or a phone, even with long settings", async () => {
  const long = Array.from({ length: 24 }, (_, k) => `{ uav = 0, from_s = ${k}, until_s = ${k + 0.5} }`).join(", ");
  standoff("monte-carlo", "paper/table-2-pair", "--set", "duration_s=40", "--set", `uavs.outage=[${long}]`, "--runs", "3", "--seed", "5", "--out", "long");
  standoff("compare", "a", "long", "--report", "long.html");
  for (const [screen, options] of [["desktop", {}], ["phone", { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true }]]) {
    await opened("long.html", async (page) => {
      for (const name of ["Metrics", "Differences", "Batches"]) {
        await page.getByRole("tab", { name }).click();
        const wide = await page.evaluate(() => [document.scrollingElement, ...document.querySelectorAll(".scrolled, main > *")]
          .filter((one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.id || one.tagName));
        assert.deepEqual(wide, [], `${screen}, ${name}`);
      }
      assert.match(await page.locator("#settings").textContent(), /until_s = 23.5/);
    }, options);
  }
});
