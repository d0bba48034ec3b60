// Events: the list and the marks over the slider tell what the record tells, and go there.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { clock, folder, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const record = recordOf("figure-9");
const TELLING = ["handoff-requested", "orbit-infeasible", "handoff-completed", "discarded"];

/** The events listed, the whole list scrolled through: time, kind and words. */
async function listed(page) {
  return page.locator("#events").evaluate(async (list) => {
    const found = new Map();
    const { scrollTop } = list;
    for (list.scrollTop = 0; ; list.scrollTop += list.clientHeight - 40) {
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      for (const row of list.querySelectorAll("[role=option]")) {
        found.set(Number(row.ariaPosInSet), [Number(row.dataset.timeUs), row.dataset.kind, row.textContent]);
      }
      if (list.scrollTop + list.clientHeight >= list.scrollHeight - 1) break;
    }
    list.scrollTop = scrollTop;
    return [...found].sort(([a], [b]) => a - b).map(([, row]) => row);
  });
}

async function isAt(page, time_s) {
  await painted(page);
  assert.equal(await clock(page), time_s);
  assert.equal(Number(await page.getByRole("slider", { name: "Time" }).inputValue()), time_s);
  assert.equal(await page.locator("#clock").textContent(), time_s.toFixed(1));
}

inReport("the list holds the record's events, telling ones at first, one kind or all when asked", {}, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  const check = async (wanted) => {
    const rows = await listed(page);
    assert.deepEqual(rows.map(([time_us, kind]) => [time_us, kind]), wanted.map((event) => [event.time_us, event.kind]));
    for (const [k, [, , words]] of rows.entries()) {
      const { time_s, kind, reason, target, group } = wanted[k];
      const parts = [`${time_s.toFixed(1)} s`, kind, reason];
      if (target !== null) parts.push(record.names[target]);
      if (group !== null) parts.push(`group ${group}`);
      for (const part of parts) assert.ok(words.includes(part), `${part} is in ${words}`);
    }
  };
  await check(record.events.filter((event) => TELLING.includes(event.kind)));
  await page.getByLabel("routine, too").check();
  await check(record.events);
  assert.equal(await page.locator("#count").textContent(), `${record.events.length} of ${record.events.length} events`);
  await page.getByLabel("Kind").selectOption("acquired");
  await check(record.events.filter((event) => event.kind === "acquired"));
});

inReport("a click on an event, or the enter key, lands on its time", {}, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  for (const [kind, time_s] of [["discarded", 76], ["handoff-completed", 35]]) {
    assert.equal(record.events.find((event) => event.kind === kind).time_s, time_s);
    await page.locator(`#events [data-kind="${kind}"]`).click();
    await isAt(page, time_s);
  }
  await page.getByRole("listbox", { name: "Events" }).focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("Enter");
  await isAt(page, 32);
});

inReport("a click on a mark over the slider lands on its event, beside it on that time", {}, async (page) => {
  const marks = page.locator("#marks");
  const box = await marks.boundingBox();
  const x = (time_s) => (time_s / 100) * box.width;
  const telling = record.events.filter((event) => TELLING.includes(event.kind));
  const ink = await marks.evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return Array.from({ length: canvas.width }, (_, x) =>
      Array.from({ length: canvas.height }, (_, y) => data[4 * (y * canvas.width + x) + 3]).some((opacity) => opacity > 0));
  });
  for (const time_s of new Set(telling.map((event) => event.time_s))) {
    assert.ok(ink[Math.floor((x(time_s) / box.width) * ink.length)], `there is a mark at ${time_s} s`);
    await marks.click({ position: { x: x(time_s) + 1, y: 8 } });
    await isAt(page, time_s);
  }
  await marks.click({ position: { x: x(10), y: 8 } });
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - 10) < 100 / box.width, "where there is no mark");
});

/** What happens in a flight with thousands of events. */
const bustle = JSON.parse(readFileSync(join(folder("bustle"), "summary.json"), "utf8")).events;
const ROUTINE = ["cued", "acquired", "orbit-feasible", "uavs-apart", "group-founded", "joined"];
const told = bustle.filter((event) => !ROUTINE.includes(event.kind));
const words = (count) => count.toLocaleString("en");
const rows = (page) => page.locator("#events [role=option]");
const current = (page) => page.locator("#events [aria-current=time]");

inReport("every one of thousands of events is reached, by scrolling and by keys", { flight: "bustle" }, async (page) => {
  assert.ok(told.length > 1400 && bustle.length > 3000, `${told.length}, ${bustle.length}`);
  await page.getByRole("tab", { name: "Events" }).click();
  assert.equal(await page.locator("#count").textContent(), `${words(told.length)} of ${words(bustle.length)} events`);
  assert.ok((await rows(page).count()) < 60, "only rows in sight are in the page");
  const all = await listed(page);
  assert.deepEqual(all.map(([time_us, kind]) => [time_us / 1e6, kind]), told.map(({ time_s, kind }) => [time_s, kind]));
  const list = page.getByRole("listbox", { name: "Events" });
  await list.focus();
  await page.keyboard.press("End");
  const pointed = page.locator("#events [aria-selected=true]");
  assert.equal(await pointed.getAttribute("aria-posinset"), String(told.length));
  assert.equal(await pointed.getAttribute("aria-setsize"), String(told.length));
  assert.equal(await list.getAttribute("aria-activedescendant"), await pointed.getAttribute("id"));
  await page.keyboard.press("PageUp");
  await page.keyboard.press("ArrowDown");
  const place = Number(await pointed.getAttribute("aria-posinset"));
  assert.ok(place < told.length - 5, "a page up");
  assert.ok(await pointed.isVisible());
  await page.keyboard.press("Enter");
  await isAt(page, told[place - 1].time_s);
  assert.equal(await current(page).getAttribute("aria-posinset"), String(place), "it is the one that is on");
  assert.ok((await page.locator("#event-text").textContent()).includes(told[place - 1].reason));
});

inReport("the list goes along with time, unless the reader has scrolled away", { flight: "bustle" }, async (page) => {
  await page.clock.install();
  await page.getByRole("tab", { name: "Events" }).click();
  const inSight = async (row) => {
    const [outer, inner] = [await page.locator("#events").boundingBox(), await row.boundingBox()];
    return inner !== null && inner.y >= outer.y - 1 && inner.y + inner.height <= outer.y + outer.height + 1;
  };
  for (const time_s of [150, 30, 100.2]) {
    await goTo(page, time_s);
    await painted(page);
    const last = told.findLastIndex((event) => event.time_s <= time_s);
    assert.equal(await current(page).getAttribute("aria-posinset"), String(last + 1), `at ${time_s} s`);
    assert.ok(await inSight(current(page)), `at ${time_s} s`);
  }
  const back = page.getByRole("button", { name: "Back to now" });
  assert.equal(await back.count(), 0);
  await page.locator("#events").hover();
  await page.mouse.wheel(0, 6000);
  await back.waitFor();
  const scrolled = await page.locator("#events").evaluate((list) => list.scrollTop);
  await page.getByLabel("Speed").selectOption("4");
  await page.keyboard.press(" ");
  await page.clock.runFor(3000);
  assert.ok((await clock(page)) > 110);
  assert.equal(await page.locator("#events").evaluate((list) => list.scrollTop), scrolled, "who reads elsewhere is not disturbed");
  await page.keyboard.press(" ");
  await back.click();
  await painted(page);
  assert.ok(await inSight(current(page)));
  const shown = await current(page).getAttribute("aria-posinset");
  await page.keyboard.press(" ");
  await page.clock.runFor(3000);
  await painted(page);
  assert.ok(Number(await current(page).getAttribute("aria-posinset")) > Number(shown) + 40);
  assert.equal(await back.count(), 0);
  await page.keyboard.press(" ");
  await painted(page);
  assert.ok(await inSight(current(page)), "it is followed again");
});

inReport("events are sifted by kind, vehicle and group, and by what is chosen", { flight: "bustle" }, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  const count = page.locator("#count");
  const shows = async (wanted, what) => {
    await painted(page);
    assert.equal(await count.textContent(), `${words(wanted.length)} of ${words(bustle.length)} events`, what);
    assert.ok(wanted.length > 0 && wanted.length < bustle.length, what);
  };
  const vehicle = page.getByPlaceholder("UAV or target");
  const names = [...new Set(told.map((event) => event.target))].filter(Boolean);
  const part = names.find((name) => names.some((other) => other !== name && other.startsWith(name)));
  const last = names.at(-1);
  await vehicle.fill(last);
  await shows(told.filter((event) => event.target === last), "a target");
  await vehicle.fill(part.toUpperCase());
  await shows(told.filter((event) => event.target === part), "the whole name of one is not part of others'");
  await vehicle.fill("r 14");
  await shows(told.filter((event) => event.target?.includes("r 14")), "part of a name");
  await vehicle.fill("UAV 2");
  await shows(told.filter((event) => event.uavs?.includes(2)), "a UAV");
  await vehicle.fill("");
  const { group } = told.find((event) => event.kind === "lost" && event.group !== undefined);
  await page.locator("#of-group").selectOption(String(group));
  await page.getByLabel("routine, too").check();
  const ofGroup = bustle.filter((event) => event.group === group || event.to_group === group);
  await shows(ofGroup, "a group");
  await page.getByLabel("Kind").selectOption("lost");
  await shows(ofGroup.filter((event) => event.kind === "lost"), "a group and a kind");
  await page.getByLabel("Kind").selectOption("");
  await page.locator("#of-group").selectOption("");
  await page.getByLabel("routine, too").uncheck();
  assert.equal(await page.locator("#of-chosen").isVisible(), false, "nothing is chosen");
  await page.evaluate(() => (location.hash = "#uav=1"));
  await page.getByLabel("only of UAV 1").check();
  await shows(told.filter((event) => event.uavs?.includes(1)), "what is chosen");
  await page.evaluate((name) => (location.hash = `#target=${encodeURIComponent(name)}`), last);
  await page.getByLabel(`only of ${last}`).waitFor();
  await shows(told.filter((event) => event.target === last), "what is chosen now");
  // The keys go through what is wanted.
  const first = told.find((event) => event.target === last);
  await page.keyboard.press("Home");
  await page.keyboard.press("n");
  await isAt(page, first.time_s);
});

inReport("the strip tells thousands of events apart, and of what is under the pointer", { flight: "bustle" }, async (page) => {
  const marks = page.locator("#marks");
  /** By column of pixels: how much of it is in the alarm's colour, in others, empty. */
  const columns = () => marks.evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const isAlarm = (at) => data[at] > 150 && data[at + 1] < 90 && data[at + 2] < 90;
    return Array.from({ length: canvas.width }, (_, x) => {
      const column = { alarm: 0, other: 0, empty: 0 };
      for (let y = 0; y < canvas.height; y++) {
        const at = 4 * (y * canvas.width + x);
        column[data[at + 3] === 0 ? "empty" : isAlarm(at) ? "alarm" : "other"] += 1;
      }
      return column;
    });
  });
  assert.ok(await marks.evaluate((canvas) => canvas.width === canvas.clientWidth * devicePixelRatio), "it is as wide as its place");
  const usual = await columns();
  const heights = new Set(usual.map((column) => column.alarm));
  assert.ok(heights.size >= 4, `grave ones are of heights ${[...heights]}`);
  assert.ok(usual.every((column) => column.empty > 0), "it is no solid block");
  const grave = ["lost", "discarded", "left-out", "orbit-infeasible"];
  const box = await marks.boundingBox();
  const end_s = Number(await page.locator("#time").getAttribute("max"));
  const x = (time_s) => (time_s / end_s) * usual.length;
  for (const event of told.filter((event) => grave.includes(event.kind))) {
    assert.ok(usual[Math.min(Math.floor(x(event.time_s)), usual.length - 1)].alarm > 0, `${event.kind} at ${event.time_s} s is seen`);
  }
  const around = (event, px = 1) => told.filter((other) => Math.abs(x(other.time_s) - x(event.time_s)) <= px);
  const isGrave = (event) => grave.includes(event.kind);
  // The pointer is at whole pixels only: what is within three is within one.
  const mixed = told.find((event) => !isGrave(event) && around(event).some(isGrave) && around(event, 4).length === around(event).length);
  await marks.hover({ position: { x: x(mixed.time_s), y: 8 } });
  const [many, one] = (await page.locator("#tip").textContent()).split("\n");
  const near = around(mixed);
  const [, count, kinds] = many.match(/^(\d+) events, [\d.]+(?: to [\d.]+)? s: (.*)$/);
  assert.equal(Number(count), near.length);
  assert.match(kinds, /^\d+ (lost|discarded)/, "grave ones first");
  for (const { kind } of near) assert.ok(kinds.includes(`${near.filter((event) => event.kind === kind).length} ${kind}`), kind);
  assert.match(one, /^[\d.]+ s (lost|discarded)/);
  await marks.click({ position: { x: x(mixed.time_s), y: 8 } });
  await painted(page);
  assert.match(await page.locator("#told-event").textContent(), /^[\d.]+ s (lost|discarded)/, "a grave one first");
  assert.ok(Math.abs(x(await clock(page)) - x(mixed.time_s)) <= 2);
  // Also where another one comes first in the record.
  const first = told.find((event, k) => !isGrave(event) && told[k - 1]?.time_s !== event.time_s && told.some((other) => isGrave(other) && other.time_s === event.time_s));
  await marks.hover({ position: { x: x(first.time_s), y: 8 } });
  const hinted = await page.locator("#tip").textContent();
  assert.ok(grave.some((kind) => new RegExp(`\n[\\d.]+ s ${kind}`).test(hinted)), hinted);
  const now = await page.locator("#now").boundingBox();
  assert.ok(Math.abs(now.x + now.width / 2 - box.x - x(await clock(page))) <= 1.5, "the time shown is marked");
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("Kind").selectOption("reassigned");
  const sifted = await columns();
  assert.equal(sifted.reduce((sum, column) => sum + column.alarm, 0), 0, "what is not wanted is faint");
  assert.deepEqual(sifted.map((column) => column.empty > 0), usual.map((column) => column.empty > 0));
});
