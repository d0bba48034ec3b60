// Several minds: whose picture is shown, who hears whom, who is silent, and where they differ, against the record.

import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { chosen, clock, folder, goTo, noteTexts, painted, picture, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

const flight = "minds";
const record = recordOf(flight);
const UAVS = [0, 1, 2, 3];

/** What the record says of minds at an instant, by mind. */
const mindsAt = (time_s) => record.tables.minds[record.times_s.indexOf(time_s)];
/** The first instant at which something is so. */
const when = (is) => record.times_s.find((time_s) => is(mindsAt(time_s)));
const list = (page) => page.getByRole("combobox", { name: "Picture" });
const warning = (page) => page.locator("#warning").textContent();

/** The cells of a column of a table, by id. */
async function cells(page, table, field) {
  const rows = await page.locator(`#${table} tbody tr`).evaluateAll((rows, field) =>
    rows.map((row) => [row.dataset.id, row.querySelector(`[data-field="${field}"]`).textContent]), field);
  return Object.fromEntries(rows);
}

/** Chooses a picture, and waits until that is shown. */
async function show(page, uav) {
  await list(page).selectOption(String(uav));
  await painted(page);
  await page.waitForFunction(() => !document.getElementById("warning").textContent.includes("loading"));
  await painted(page);
}

/** Crews as text that tells who serves one group together. */
const crewsOf = (mind) => {
  const crews = new Map();
  for (const [uav, { group }] of Object.entries(mind.team)) if (group !== null) crews.set(group, [...(crews.get(group) ?? []), uav]);
  return [...crews].sort(([a], [b]) => a - b).map(([group, uavs]) => [`group ${group}`, `UAV ${uavs.join(", ")}`]);
};

inReport("every mind's picture is that of the record: tracks, groups, who serves what", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  const apart_s = when((minds) => minds[0]?.team[2]?.presence === "gone");
  for (const time_s of [10, apart_s + 2, 38, 45]) {
    await goTo(page, time_s);
    const minds = mindsAt(time_s);
    for (const uav of UAVS.filter((uav) => minds[uav])) {
      await show(page, uav);
      const what = `UAV ${uav} at ${time_s} s`;
      const groups = Object.fromEntries(UAVS.map((other) => [other, minds[uav].team[other]?.group ?? null]));
      const told = await cells(page, "uavs", "group");
      for (const other of UAVS) assert.equal(told[other], groups[other] === null ? "none" : `${groups[other]}`, `${what}: UAV ${other}`);
      const members = await cells(page, "groups", "members");
      assert.deepEqual(Object.keys(members).map(Number), Object.keys(minds[uav].groups).map(Number), `${what}: its groups`);
      for (const [group, row] of Object.entries(minds[uav].groups)) agrees(members[group], row.members, 0, `${what}: members of ${group}`);
      const errors = await cells(page, "targets", "error_m");
      for (const [target, row] of Object.entries(minds[uav].tracks)) agrees(errors[target], row.position_error_m, 2, `${what}: target ${target}`);
    }
  }
});

inReport("the page always says whose picture is shown, and the address keeps the choice", { flight }, async (page) => {
  const shown = () => list(page).evaluate((select) => select.selectedOptions[0].text);
  await goTo(page, 20);
  assert.equal(await shown(), "UAV 0, the lowest on");
  await goTo(page, 44);
  assert.equal(await shown(), "UAV 1, the lowest on", "the first computer is off");
  await show(page, 3);
  assert.equal(await shown(), "UAV 3");
  assert.match(await warning(page), /^.*picture of UAV 3/);
  assert.match(await page.locator("#map").getAttribute("aria-label"), /picture of UAV 3$/);
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => location.hash === "#t=44&picture=3");
  await page.goto("about:blank");
  const report = pathToFileURL(join(folder(flight), "report.html")).href;
  await page.goto(`${report}#t=20&picture=2`);
  await page.waitForSelector('body[data-ready="charts"]');
  assert.equal(await list(page).inputValue(), "2");
  assert.equal(await clock(page), 20);
  await page.evaluate(() => (location.hash = "#t=20&picture=9"));
  await page.waitForFunction(() => /picture of UAV 9, which this run does not have/.test(document.getElementById("told-event").textContent));
  assert.equal(await list(page).inputValue(), "");
});

inReport("of a mind whose computer is off there is no picture, and the page says so", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  await goTo(page, 44);
  await show(page, 0);
  assert.match(await warning(page), /no picture: the computer of UAV 0 is off/);
  assert.doesNotMatch(await warning(page), /untracked/);
  assert.equal(await page.locator("#groups tbody tr").count(), 0);
  assert.deepEqual(Object.values(await cells(page, "targets", "state")), record.names.map(() => "no track"));
  await goTo(page, 50);
  assert.equal(await page.locator("#groups tbody tr").count(), Object.keys(mindsAt(50)[0].groups).length);
});

inReport("the table of minds says who hears whom, who serves what, and who agrees", { flight }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  for (const time_s of [5, 17, 28, 44, 59]) {
    await goTo(page, time_s);
    await painted(page);
    const minds = mindsAt(time_s);
    const [hears, crews, agree] = [await cells(page, "minds", "hears"), await cells(page, "minds", "crews"), await cells(page, "minds", "agrees")];
    const ids = (mind) => JSON.stringify(UAVS.map((uav) => mind.team[uav]?.group_id ?? null));
    for (const uav of UAVS) {
      const what = `UAV ${uav} at ${time_s} s`;
      if (!minds[uav]) {
        assert.equal(hears[uav], "off", what);
        continue;
      }
      const silent = UAVS.filter((other) => other !== uav && !["live", "left"].includes(minds[uav].team[other]?.presence));
      assert.deepEqual([...hears[uav].matchAll(/UAV (\d+)/g)].map((found) => Number(found[1])), silent, what);
      for (const other of silent) {
        const { presence, age_s } = minds[uav].team[other] ?? {};
        const words = presence ? `UAV ${other} ${presence}, ${age_s.toFixed(1)} s ago` : `UAV ${other} never heard`;
        assert.ok(hears[uav].includes(words), `${what}: ${hears[uav]} has ${words}`);
      }
      const told = [...crews[uav].matchAll(/(group \d+) \(of [\d.]+ s\): (UAV [\d, ]+)/g)].map((found) => [found[1], found[2]]);
      assert.deepEqual(told, crewsOf(minds[uav]), what);
      const others = UAVS.filter((other) => other !== uav && minds[other] && ids(minds[other]) === ids(minds[uav]));
      assert.equal(agree[uav], others.length ? `UAV ${others.join(", ")}` : "nobody", what);
    }
  }
});

inReport("the card of a UAV says whom it hears and how old what it heard is", { flight }, async (page) => {
  const time_s = 22;
  await goTo(page, time_s);
  await page.evaluate(() => (location.hash = "#t=22&uav=2"));
  await chosen(page).waitFor();
  const fact = (field) => chosen(page).locator(`[data-field="${field}"]`).textContent();
  const { team } = mindsAt(time_s)[2];
  assert.equal(await fact("presence"), `gone, newest report ${mindsAt(time_s)[0].team[2].age_s.toFixed(1)} s old`);
  assert.equal(await fact("ages"), [0, 1, 3].map((uav) => `UAV ${uav} ${team[uav].age_s.toFixed(1)} s`).join(", "));
  assert.match(await fact("hears"), /^UAV 0 \(gone\), UAV 1 \(gone\)/);
});

inReport("bands below the strip tell when minds differ and when somebody is silent or gone", { flight }, async (page) => {
  const within = (spans, time_s) => spans.some(([from_s, until_s]) => from_s <= time_s && time_s < until_s);
  const spans = (kind) => page.locator("#spans").evaluate(({ dataset }, kind) =>
    dataset[kind].split(" ").filter(Boolean).map((span) => span.split("-").map(Number)), kind);
  for (const shown of ["", 2, 0]) {
    await show(page, shown);
    const [differ, silent, gone, off] = [await spans("differ"), await spans("silent"), await spans("gone"), await spans("off")];
    for (const time_s of record.times_s) {
      const minds = mindsAt(time_s);
      const on = UAVS.filter((uav) => minds[uav]);
      const owner = shown === "" ? on[0] : shown;
      const ids = on.map((uav) => JSON.stringify(UAVS.map((other) => minds[uav].team[other]?.group_id ?? null)));
      assert.equal(within(differ, time_s), new Set(ids).size > 1, `minds differ at ${time_s} s`);
      const words = UAVS.filter((uav) => uav !== owner).map((uav) => minds[owner] && (minds[owner].team[uav]?.presence ?? "never heard"));
      assert.equal(within(silent, time_s), words.includes("silent"), `somebody is silent for ${owner} at ${time_s} s`);
      assert.equal(within(gone, time_s), words.includes("gone") || words.includes("never heard"), `somebody is gone for ${owner} at ${time_s} s`);
      assert.equal(within(off, time_s), !minds[owner], `${owner} is off at ${time_s} s`);
    }
  }
  assert.ok((await spans("off")).length > 0 && (await spans("differ")).length > 0);
  // Pointing at a band says what it is, and a click goes there.
  const [[from_s]] = await spans("off");
  const box = await page.locator("#spans").boundingBox();
  const x = ((from_s + 2) / record.times_s.at(-1)) * box.width;
  await page.locator("#spans").hover({ position: { x, y: 7 } });
  assert.match(await page.locator("#tip").textContent(), /the computer of UAV 0 is off/);
  await page.locator("#spans").click({ position: { x, y: 7 } });
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - from_s - 2) < 0.5);
});

inReport("the map draws who hears whom and who is silent, and both can be taken away", { flight }, async (page) => {
  await noteTexts(page);
  await goTo(page, 25);
  const words = (await texts(page)).map(({ text }) => text);
  for (const uav of [2, 3]) {
    const { presence, age_s } = mindsAt(25)[0].team[uav];
    assert.ok(words.includes(`${presence} for UAV 0 (${age_s.toFixed(1)} s)`), `UAV ${uav}: ${words}`);
  }
  await page.getByText("Layers", { exact: true }).first().click();
  for (const layer of ["Who hears whom", "Silent UAVs"]) {
    const before = await picture(page);
    await page.getByLabel(layer).uncheck();
    assert.notEqual(await picture(page), before, layer);
  }
  assert.ok(!(await texts(page)).some(({ text }) => /for UAV 0/.test(text)));
});

inReport("events are those of the mind whose picture is shown", { flight }, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("routine, too").check();
  for (const uav of ["", 2, 0]) {
    await show(page, uav);
    const told = uav === "" ? record.events.length : record.tables.mind_events[uav];
    assert.match(await page.locator("#count").textContent(), new RegExp(`^${told} of ${told} events`), `of ${uav}`);
  }
});

inReport("a run of one mind says nothing of pictures", {}, async (page) => {
  assert.ok(await page.locator("#picture-of").isHidden());
  assert.ok(await page.locator("#spans").isHidden());
  await page.getByRole("tab", { name: "State" }).click();
  assert.ok(await page.locator("#minds").isHidden());
  await page.getByText("Layers", { exact: true }).first().click();
  assert.ok(await page.getByLabel("Who hears whom").isHidden());
});

inReport("on a phone all of it can be reached, and nothing is wider than the screen",
  { flight, viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true }, async (page) => {
    await goTo(page, 25);
    await show(page, 2);
    for (const tab of ["Charts", "State", "Events"]) {
      await page.getByRole("tab", { name: tab }).click();
      assert.ok(await page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth), tab);
    }
    const box = await list(page).boundingBox();
    assert.ok(box.x >= 0 && box.x + box.width <= 360);
  });
