// One agent per UAV: the shown team state, received reports, silent UAVs and different assignments, compared with the record.

import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { selectedCard, clock, folder, goTo, recordTexts, painted, mapImage, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

const flight = "agents";
const record = recordOf(flight);
const UAVS = [0, 1, 2, 3];

/** Texts of the page for the teammate statuses of the record. */
const STATUS = { live: "live", silent: "silent", "timed-out": "timed out", left: "left" };
/** Text for the status of a teammate in a team state; a teammate without a row has never been received. */
const statusOf = (agent, uav) => STATUS[agent.team[uav]?.status] ?? "never received";

/** The team states in the record at a time step, by UAV. */
const agentsAt = (time_s) => record.tables.agents[record.times_s.indexOf(time_s)];
/** The first time step at which a condition holds. */
const when = (condition) => record.times_s.find((time_s) => condition(agentsAt(time_s)));
const list = (page) => page.getByRole("combobox", { name: "Team state" });
const warning = (page) => page.locator("#warning").textContent();

/** The texts of a column of a table, by id. */
async function cells(page, table, field) {
  const rows = await page.locator(`#${table} tbody tr`).evaluateAll((rows, field) =>
    rows.map((row) => [row.dataset.id, row.querySelector(`[data-field="${field}"]`).textContent]), field);
  return Object.fromEntries(rows);
}

/** Selects a team state and waits until it is shown. */
async function show(page, uav) {
  await list(page).selectOption(String(uav));
  await painted(page);
  await page.waitForFunction(() => !document.getElementById("warning").textContent.includes("loading"));
  await painted(page);
}

/** The assignments in a team state as text, by group. */
const assignmentsOf = (agent) => {
  const assigned = new Map();
  for (const [uav, { group }] of Object.entries(agent.team)) if (group !== null) assigned.set(group, [...(assigned.get(group) ?? []), uav]);
  return [...assigned].sort(([a], [b]) => a - b).map(([group, uavs]) => [`group ${group}`, `UAV ${uavs.join(", ")}`]);
};

inReport("the team state of every agent equals the record: tracks, groups, assignments", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  const timeout_s = when((agents) => agents[0]?.team[2]?.status === "timed-out");
  for (const time_s of [10, timeout_s + 2, 38, 45]) {
    await goTo(page, time_s);
    const agents = agentsAt(time_s);
    for (const uav of UAVS.filter((uav) => agents[uav])) {
      await show(page, uav);
      const what = `UAV ${uav} at ${time_s} s`;
      const groups = Object.fromEntries(UAVS.map((other) => [other, agents[uav].team[other]?.group ?? null]));
      const shown = await cells(page, "uavs", "group");
      for (const other of UAVS) assert.equal(shown[other], groups[other] === null ? "none" : `${groups[other]}`, `${what}: UAV ${other}`);
      const members = await cells(page, "groups", "members");
      assert.deepEqual(Object.keys(members).map(Number), Object.keys(agents[uav].groups).map(Number), `${what}: groups`);
      for (const [group, row] of Object.entries(agents[uav].groups)) agrees(members[group], row.members, 0, `${what}: members of ${group}`);
      const errors = await cells(page, "targets", "error_m");
      for (const [target, row] of Object.entries(agents[uav].tracks)) agrees(errors[target], row.position_error_m, 2, `${what}: target ${target}`);
    }
  }
});

inReport("the page names the shown team state, and links contain the selection", { flight }, async (page) => {
  const shown = () => list(page).evaluate((select) => select.selectedOptions[0].text);
  await goTo(page, 20);
  assert.equal(await shown(), "auto: UAV 0");
  await goTo(page, 44);
  assert.equal(await shown(), "auto: UAV 1", "the computer of UAV 0 is off");
  await show(page, 3);
  assert.equal(await shown(), "UAV 3");
  assert.match(await warning(page), /^.*team state of UAV 3/);
  assert.match(await page.locator("#map").getAttribute("aria-label"), /team state of UAV 3$/);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => location.hash === "#t=44&agent=3");
  await page.goto("about:blank");
  const report = pathToFileURL(join(folder(flight), "report.html")).href;
  await page.goto(`${report}#t=20&agent=2`);
  await page.waitForSelector('body[data-ready="charts"]');
  assert.equal(await list(page).inputValue(), "2");
  assert.equal(await clock(page), 20);
  await page.evaluate(() => (location.hash = "#t=20&agent=9"));
  await page.waitForFunction(() => /team state of UAV 9, which is not in this run/.test(document.getElementById("event-summary").textContent));
  assert.equal(await list(page).inputValue(), "");
});

inReport("the page reports that a UAV whose computer is off has no team state", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  await goTo(page, 44);
  await show(page, 0);
  assert.match(await warning(page), /no team state: the computer of UAV 0 is off/);
  assert.doesNotMatch(await warning(page), /untracked/);
  assert.equal(await page.locator("#groups tbody tr").count(), 0);
  assert.deepEqual(Object.values(await cells(page, "targets", "state")), record.names.map(() => "no track"));
  await goTo(page, 50);
  assert.equal(await page.locator("#groups tbody tr").count(), Object.keys(agentsAt(50)[0].groups).length);
});

inReport("the table of agents shows missing reports, assignments, and agents with equal assignments", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  for (const time_s of [5, 17, 28, 44, 59]) {
    await goTo(page, time_s);
    await painted(page);
    const agents = agentsAt(time_s);
    const [notReceived, assignments, agree] = [await cells(page, "agents", "missing_reports"), await cells(page, "agents", "assignments"), await cells(page, "agents", "agrees")];
    const ids = (agent) => JSON.stringify(UAVS.map((uav) => agent.team[uav]?.group_id ?? null));
    for (const uav of UAVS) {
      const what = `UAV ${uav} at ${time_s} s`;
      if (!agents[uav]) {
        assert.equal(notReceived[uav], "off", what);
        continue;
      }
      const silent = UAVS.filter((other) => other !== uav && !["live", "left"].includes(agents[uav].team[other]?.status));
      assert.deepEqual([...notReceived[uav].matchAll(/UAV (\d+)/g)].map((found) => Number(found[1])), silent, what);
      for (const other of silent) {
        const { status, age_s } = agents[uav].team[other] ?? {};
        const age = status ? `, last report ${age_s.toFixed(1)} s ago` : "";
        const expected = `UAV ${other} ${statusOf(agents[uav], other)}${age}`;
        assert.ok(notReceived[uav].includes(expected), `${what}: ${notReceived[uav]} contains ${expected}`);
      }
      const shown = [...assignments[uav].matchAll(/(group \d+) \(created at [\d.]+ s\): (UAV [\d, ]+)/g)].map((found) => [found[1], found[2]]);
      assert.deepEqual(shown, assignmentsOf(agents[uav]), what);
      const others = UAVS.filter((other) => other !== uav && agents[other] && ids(agents[other]) === ids(agents[uav]));
      assert.equal(agree[uav], others.length ? `UAV ${others.join(", ")}` : "none", what);
    }
  }
});

inReport("the card of a UAV shows its missing reports and the ages of its reports", { flight }, async (page) => {
  const time_s = 22;
  await goTo(page, time_s);
  await page.evaluate(() => (location.hash = "#t=22&uav=2"));
  await selectedCard(page).waitFor();
  const fact = (field) => selectedCard(page).locator(`[data-field="${field}"]`).textContent();
  const { team } = agentsAt(time_s)[2];
  assert.equal(await fact("status"), `timed out, last report ${agentsAt(time_s)[0].team[2].age_s.toFixed(1)} s ago`);
  assert.equal(await fact("ages"), [0, 1, 3].map((uav) => `UAV ${uav} ${team[uav].age_s.toFixed(1)} s`).join(", "));
  assert.match(await fact("missing_reports"), /^UAV 0 \(timed out\), UAV 1 \(timed out\)/);
});

inReport("bands below the event strip show different assignments, and silent and timed-out UAVs", { flight }, async (page) => {
  const within = (spans, time_s) => spans.some(([from_s, until_s]) => from_s <= time_s && time_s < until_s);
  const spans = (kind) => page.locator("#agent-bands").evaluate(({ dataset }, kind) =>
    dataset[kind].split(" ").filter(Boolean).map((span) => span.split("-").map(Number)), kind);
  for (const shown of ["", 2, 0]) {
    await show(page, shown);
    const [differ, silent, timedOut, off] = [await spans("differ"), await spans("silent"), await spans("timedOut"), await spans("off")];
    for (const time_s of record.times_s) {
      const agents = agentsAt(time_s);
      const on = UAVS.filter((uav) => agents[uav]);
      const owner = shown === "" ? on[0] : shown;
      const ids = on.map((uav) => JSON.stringify(UAVS.map((other) => agents[uav].team[other]?.group_id ?? null)));
      assert.equal(within(differ, time_s), new Set(ids).size > 1, `assignments differ at ${time_s} s`);
      const statuses = UAVS.filter((uav) => uav !== owner).map((uav) => agents[owner] && statusOf(agents[owner], uav));
      assert.equal(within(silent, time_s), statuses.includes("silent"), `a UAV is silent for ${owner} at ${time_s} s`);
      assert.equal(within(timedOut, time_s), statuses.includes("timed out") || statuses.includes("never received"), `a UAV has timed out for ${owner} at ${time_s} s`);
      assert.equal(within(off, time_s), !agents[owner], `${owner} is off at ${time_s} s`);
    }
  }
  assert.ok((await spans("off")).length > 0 && (await spans("differ")).length > 0);
  // A band has a tooltip, and a click on it goes to that time.
  const [[from_s]] = await spans("off");
  const box = await page.locator("#agent-bands").boundingBox();
  const x = ((from_s + 2) / record.times_s.at(-1)) * box.width;
  await page.locator("#agent-bands").hover({ position: { x, y: 7 } });
  assert.match(await page.locator("#strip-tooltip").textContent(), /the computer of UAV 0 is off/);
  await page.locator("#agent-bands").click({ position: { x, y: 7 } });
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - from_s - 2) < 0.5);
});

inReport("the map shows radio links and silent UAVs, and both layers can be hidden", { flight }, async (page) => {
  await recordTexts(page);
  await goTo(page, 25);
  const labels = (await texts(page)).map(({ text }) => text);
  for (const uav of [2, 3]) {
    const { age_s } = agentsAt(25)[0].team[uav];
    assert.ok(labels.includes(`no report at UAV 0 for ${age_s.toFixed(1)} s`), `UAV ${uav}: ${labels}`);
  }
  await page.getByText("Layers", { exact: true }).first().click();
  for (const layer of ["Radio links", "Silent UAVs"]) {
    const before = await mapImage(page);
    await page.getByLabel(layer).uncheck();
    assert.notEqual(await mapImage(page), before, layer);
  }
  assert.ok(!(await texts(page)).some(({ text }) => /at UAV 0/.test(text)));
});

inReport("the listed events belong to the shown team state", { flight }, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("routine events").check();
  for (const uav of ["", 2, 0]) {
    await show(page, uav);
    const count = uav === "" ? record.events.length : record.tables.agent_events[uav];
    assert.match(await page.locator("#event-count").textContent(), new RegExp(`^${count} of ${count} events`), `of ${uav}`);
  }
});

inReport("controls of team states are hidden if all UAVs share one agent", {}, async (page) => {
  assert.ok(await page.locator("#agent-label").isHidden());
  assert.ok(await page.locator("#agent-bands").isHidden());
  await page.getByRole("tab", { name: "State" }).click();
  assert.ok(await page.locator("#agents").isHidden());
  await page.getByText("Layers", { exact: true }).first().click();
  assert.ok(await page.getByLabel("Radio links").isHidden());
});

inReport("on a phone all controls of team states can be reached, and nothing is wider than the screen",
  { flight, viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true }, async (page) => {
    await goTo(page, 25);
    await page.getByRole("button", { name: "Tools" }).click();
    await show(page, 2);
    for (const tab of ["Charts", "State", "Events"]) {
      await page.getByRole("tab", { name: tab }).click();
      assert.ok(await page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth), tab);
    }
    const box = await list(page).boundingBox();
    assert.ok(box.x >= 0 && box.x + box.width <= 360);
  });
