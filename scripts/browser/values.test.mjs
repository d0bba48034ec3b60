// The tables of the side panel equal the record.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { folder, goTo } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

const DEGREES = 180 / Math.PI;

inReport("the description of the scenario is below the title", {}, async (page) => {
  const [, about] = readFileSync(join(folder("figure-9"), "scenario.toml"), "utf8").match(/^about = "(.*)"$/m);
  assert.equal(await page.locator("#about").textContent(), about);
  const [title, description] = [await page.locator("#title").boundingBox(), await page.locator("#about").boundingBox()];
  assert.ok(description.y >= title.y + title.height - 1 && description.x === title.x);
});

/** The texts of a table as {field: text}, by id. */
async function shown(page, caption) {
  const rows = await page.getByRole("table", { name: caption }).locator("tbody tr").evaluateAll((rows) =>
    rows.map((row) => [Number(row.dataset.id), Object.fromEntries([...row.cells].map((cell) => [cell.dataset.field, cell.textContent]))]));
  return new Map(rows);
}

function checkUavs(rows, recorded) {
  assert.deepEqual([...rows.keys()], [...recorded.keys()]);
  for (const [id, row] of rows) {
    const uav = recorded.get(id);
    const limited = (text, isLimited) => text.replace(isLimited ? / limit$/ : /^$/, "");
    assert.equal(row.id, `${id}`);
    assert.equal(row.group, uav.group === null ? "none" : `${uav.group}`);
    agrees(row.x_m, uav.x_m, 1, `UAV ${id} east`);
    agrees(row.y_m, uav.y_m, 1, `UAV ${id} north`);
    agrees(limited(row.speed_m_s, uav.speed_limited), uav.speed_m_s, 2, `UAV ${id} speed`);
    agrees(limited(row.turn_rate_deg_s, uav.turn_rate_limited), uav.turn_rate_rad_s * DEGREES, 2, `UAV ${id} turn rate`);
    agrees(row.centre_distance_m, uav.centre_distance_m, 1, `UAV ${id} to centre`);
    agrees(row.standoff_error_m, uav.standoff_error_m, 1, `UAV ${id} standoff error`);
    agrees(row.off_boresight_deg, uav.off_boresight_rad === null ? null : uav.off_boresight_rad * DEGREES, 1, `UAV ${id} off-boresight angle`);
  }
}

function checkGroups(rows, recorded) {
  assert.deepEqual([...rows.keys()], [...recorded.keys()]);
  for (const [id, row] of rows) {
    const group = recorded.get(id);
    assert.equal(row.members, `${group.members}`);
    agrees(row.standoff_distance_m.replace(group.feasible ? /^$/ : / not feasible$/, ""), group.standoff_distance_m, 1, `group ${id} orbit`);
    agrees(row.spread_m, group.spread_m, 1, `group ${id} spread`);
    agrees(row.phase_deg, group.phase_rad === null ? null : group.phase_rad * DEGREES, 1, `group ${id} phase`);
    agrees(row.nearest_groupmate_m, group.nearest_groupmate_m, 0, `group ${id} separation`);
    agrees(row.position_error_m, group.position_error_m, 2, `group ${id} position error`);
  }
}

/** The expected warning about a target. */
function warningOf(target) {
  const isUntracked = target.exists && target.status === null;
  const place = isUntracked ? "untracked" : { removed: "removed", ungrouped: "ungrouped", "in-handoff": "in handoff" }[target.membership] ?? "";
  if (target.in_view === false) return target.group !== null || !place ? "out of view" : `out of view, ${place}`;
  return place || (target.status === "coasting" ? "coasting" : "");
}

/** The expected text of the UAVs that have a target in view. */
const seenByText = ({ seen_by }) => (seen_by === null ? "\u2013" : seen_by.map((id) => `UAV ${id}`).join(", ") || "none");

function checkTargets(rows, recorded, names) {
  assert.deepEqual([...rows.keys()].sort((a, b) => a - b), [...recorded.keys()]);
  const hasWarning = [...rows.values()].map((row) => row.warning !== "");
  assert.deepEqual(hasWarning, [...hasWarning].sort((a, b) => b - a), "targets with warnings come first");
  for (const [id, row] of rows) {
    const target = recorded.get(id);
    assert.equal(row.name, names[id]);
    assert.equal(row.state, [target.membership, target.status].filter(Boolean).join(", ") || "no track");
    assert.equal(row.warning, warningOf(target));
    const group = target.group === null ? "none" : `${target.group}`;
    assert.equal(row.group, target.receiving_group === null ? group : `in handoff, joins ${target.receiving_group}`);
    agrees(row.error_m, target.error_m, 2, `target ${id} error`);
    agrees(row.out_of_view_s, target.in_view === false ? target.out_of_view_s : null, 1, `target ${id}: time out of view`);
    assert.equal(row.seen_by, seenByText(target), `target ${id}`);
  }
}

/** Runs with times, and the warnings expected at these times. */
const CHOSEN = [
  ["figure-9", [0, 0.5, 33, 60, 100], ["in handoff", "out of view, removed"]],
  ["out-of-view", [27], ["out of view"]],
];
for (const [flight, times_s, warnings] of CHOSEN) {
  inReport(`the tables equal the record at selected times: ${flight}`, { flight }, async (page) => {
    const record = recordOf(flight);
    await page.getByRole("tab", { name: "State" }).click();
    const shownWarnings = new Set();
    for (const time_s of times_s) {
      // 0.3 s later the same time step is current.
      for (const later_s of [0, time_s < record.times_s.at(-1) ? 0.3 : 0]) {
        await goTo(page, time_s + later_s);
        checkUavs(await shown(page, "UAVs"), record.rows("uavs", time_s));
        checkGroups(await shown(page, "Groups"), record.rows("groups", time_s));
        const targets = await shown(page, "Targets");
        checkTargets(targets, record.rows("targets", time_s), record.names);
        for (const row of targets.values()) shownWarnings.add(row.warning);
      }
    }
    assert.deepEqual(warnings.filter((warning) => !shownWarnings.has(warning)), [], "each expected warning was shown");
  });
}

inReport("the outcome table equals summary.json", {}, async (page) => {
  const { metrics } = JSON.parse(readFileSync(join(folder("figure-9"), "summary.json"), "utf8"));
  await page.getByRole("tab", { name: "Outcome" }).click();
  const table = page.getByRole("table", { name: "Results of the run" });
  assert.ok((await table.locator("td[data-metric]").count()) <= 12, "by default, the main metrics");
  await page.getByLabel("all metrics").check();
  const cells = await table.locator("td[data-metric]").evaluateAll((cells) =>
    cells.map((cell) => [cell.dataset.metric, cell.textContent, cell.nextSibling.textContent]));
  assert.ok(cells.length > 15);
  for (const [metric, text, unit] of cells) {
    const percent = unit.startsWith("%") ? 100 : 1;
    agrees(text, metrics[metric] === null ? null : metrics[metric] * percent, 2, metric);
  }
});
