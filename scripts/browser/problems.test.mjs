// Problems: the tables, bars and saved files show the alarms and gaps that the record has as CSV.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { clock, downloaded, folder } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

/** The rows of a CSV file whose values contain no line breaks. */
function rowsOf(text) {
  const cells = (line) => [...line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,"]*))/g)].map(([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain);
  const [heads, ...rows] = text.trimEnd().split("\n").map(cells);
  return rows.map((row) => Object.fromEntries(heads.map((head, k) => [head, row[k]])));
}

function recorded(flight, kind) {
  return readFileSync(join(folder(flight), `${kind}.csv`), "utf8");
}

for (const flight of ["figure-9", "out-of-view", "outage", "crowd-120", "dated"]) {
  inReport(`saved files of alarms and gaps are those of the record: ${flight}`, { flight }, async (page) => {
    await page.getByRole("tab", { name: "Problems" }).click();
    for (const [kind, button] of [["alarms", "Save alarms (CSV)"], ["gaps", "Save times out of view (CSV)"]]) {
      const { name, path } = await downloaded(page, () => page.getByRole("button", { name: button }).click());
      assert.match(name, new RegExp(`seed.1.*-${kind}\\.csv$`));
      const [saved, expected] = [readFileSync(path, "utf8"), recorded(flight, kind)];
      assert.equal(saved.split("\n")[0], expected.split("\n")[0]);
      const [rows, expectedRows] = [rowsOf(saved), rowsOf(expected)];
      assert.equal(rows.length, expectedRows.length);
      for (const [k, row] of rows.entries()) {
        // The page converts positions itself.
        for (const column of ["latitude_deg", "longitude_deg"].filter((column) => column in row)) {
          assert.ok(Math.abs(Number(row[column]) - Number(expectedRows[k][column])) < 1e-9, `${row[column]}, ${expectedRows[k][column]}`);
          row[column] = expectedRows[k][column];
        }
        assert.deepEqual(row, expectedRows[k]);
      }
    }
  });
}

inReport("alarms are grouped by kind and cause, and listed in their order", { flight: "out-of-view" }, async (page) => {
  await page.getByRole("tab", { name: "Problems" }).click();
  const alarms = rowsOf(recorded("out-of-view", "alarms"));
  const expected = new Map();
  for (const alarm of alarms) {
    const key = `${alarm.kind}, ${alarm.cause}`;
    expected.set(key, [...(expected.get(key) ?? []), alarm]);
  }
  const cells = (table) => page.locator(`${table} tbody tr`).evaluateAll((rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));
  const groups = [...expected.values()].map((alarms) => {
    const durations_s = alarms.map((alarm) => Number(alarm.duration_s));
    const total_s = durations_s.reduce((sum, duration_s) => sum + duration_s, 0);
    return [alarms[0].kind, `${alarms.length}`, total_s.toFixed(1), Math.max(...durations_s).toFixed(1)];
  });
  const longestFirst = groups.sort((a, b) => b[2] - a[2]);
  assert.ok(longestFirst.length > 1);
  assert.deepEqual((await cells("#problem-kinds")).map((row) => row.slice(0, 4)), longestFirst);
  const log = await cells("#alarm-log");
  assert.deepEqual(log.map(([kind, at, lasts]) => [kind, at, lasts]),
    alarms.map(({ kind, begin_s, duration_s }) => [kind, Number(begin_s).toFixed(1), Number(duration_s).toFixed(1)]));
  for (const [k, row] of log.entries()) assert.ok(row[3].endsWith(alarms[k].reason), row[3]);
});

inReport("each target has its times out of view as bars, and a bar goes to its begin", { flight: "out-of-view" }, async (page) => {
  await page.getByRole("tab", { name: "Problems" }).click();
  const gaps = rowsOf(recorded("out-of-view", "gaps"));
  const [gap] = gaps.toSorted((a, b) => b.duration_s - a.duration_s);
  const bars = page.locator("#gap-timeline .gap");
  assert.equal(await bars.count(), gaps.length);
  const begins = new RegExp(`^${Number(gap.begin_s).toFixed(1)} to ${Number(gap.end_s).toFixed(1)} s: ${gap.cause}, at `);
  const [title] = (await bars.evaluateAll((all) => all.map((bar) => bar.title))).filter((title) => begins.test(title));
  const bar = page.getByTitle(title);
  const duration_s = Number((await page.locator("#total").textContent()).match(/[\d.]+/)[0]);
  const [inside, track] = [await bar.boundingBox(), await bar.locator("..").boundingBox()];
  assert.ok(Math.abs((inside.x - track.x) / track.width - gap.begin_s / duration_s) < 0.01);
  await bar.click();
  assert.equal(await clock(page), Number(gap.begin_s));
  assert.match(await page.getByRole("region", { name: "Selected object" }).textContent(), new RegExp(gap.target));
});
