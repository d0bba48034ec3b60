// Events: the list and the event strip show the events of the record, and go to their times.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { PHONE, clock, folder, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const record = recordOf("figure-9");
const IMPORTANT = ["handoff-started", "orbit-infeasible", "handoff-completed", "removed"];

/** All listed events, found by scrolling through the list: time, kind and text. */
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
  await page.waitForFunction((text) => document.getElementById("clock").textContent === text, time_s.toFixed(1));
  assert.equal(await clock(page), time_s);
  assert.equal(Number(await page.getByRole("slider", { name: "Time" }).inputValue()), time_s);
  assert.equal(await page.locator("#clock").textContent(), time_s.toFixed(1));
}

inReport("the list contains the important events of the record, and on request all events or one kind", {}, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  const check = async (expected) => {
    const rows = await listed(page);
    assert.deepEqual(rows.map(([time_us, kind]) => [time_us, kind]), expected.map((event) => [event.time_us, event.kind]));
    for (const [k, [, , text]] of rows.entries()) {
      const { time_s, kind, reason, target, group } = expected[k];
      const parts = [`${time_s.toFixed(1)} s`, kind, reason];
      if (target !== null) parts.push(record.names[target]);
      if (group !== null) parts.push(`group ${group}`);
      for (const part of parts) assert.ok(text.includes(part), `${part} is in ${text}`);
    }
  };
  await check(record.events.filter((event) => IMPORTANT.includes(event.kind)));
  await page.getByLabel("routine events").check();
  await check(record.events);
  assert.equal(await page.locator("#event-count").textContent(), `${record.events.length} of ${record.events.length} events`);
  await page.getByLabel("Kind").selectOption("acquired");
  await check(record.events.filter((event) => event.kind === "acquired"));
});

for (const [screen, options] of [["1280x720", {}], ["a phone", PHONE]]) {
  inReport(`the text of events wraps, and rows neither overlap nor leave gaps: ${screen}`, { flight: "bustle", ...options }, async (page) => {
    await page.getByRole("tab", { name: "Events" }).click();
    // A short scroll keeps most rows in the document; they must stay in order, because a row that is moved loses a click.
    for (const [place, further_px] of [[0, 0], [0, 200], [0.5, 0], [0.5, -200], [1, 0]]) {
      await page.locator("#events").evaluate((list, [place, further_px]) => (list.scrollTop = place * list.scrollHeight + further_px), [place, further_px]);
      await painted(page);
      const rows = await page.locator("#events").evaluate((list) => [...list.querySelectorAll("[role=option]")].map((row) => {
        const { top, bottom } = row.getBoundingClientRect();
        return { top, bottom, isCut: row.scrollHeight > row.clientHeight + 1 || row.scrollWidth > row.clientWidth + 1, time: row.querySelector("time").offsetHeight };
      }));
      assert.ok(rows.some(({ top, bottom, time }) => bottom - top > 2 * time), "the text of an event has several lines");
      assert.deepEqual(rows.filter(({ isCut }) => isCut), []);
      for (const [k, { top }] of rows.slice(1).entries()) assert.ok(Math.abs(top - rows[k].bottom) < 1, `${top} follows ${rows[k].bottom}`);
    }
  });
}

inReport("a click on an event or the Enter key goes to its time", {}, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  for (const [kind, time_s] of [["removed", 76], ["handoff-completed", 35]]) {
    assert.equal(record.events.find((event) => event.kind === kind).time_s, time_s);
    await page.locator(`#events [data-kind="${kind}"]`).click();
    await isAt(page, time_s);
  }
  await page.getByRole("listbox", { name: "Events" }).focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("Enter");
  await isAt(page, 32);
});

inReport("a click on a bar of the event strip goes to its event, and a click elsewhere to that time", {}, async (page) => {
  const marks = page.locator("#event-strip");
  const box = await marks.boundingBox();
  const x = (time_s) => (time_s / 100) * box.width;
  const important = record.events.filter((event) => IMPORTANT.includes(event.kind));
  const ink = await marks.evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return Array.from({ length: canvas.width }, (_, x) =>
      Array.from({ length: canvas.height }, (_, y) => data[4 * (y * canvas.width + x) + 3]).some((opacity) => opacity > 0));
  });
  for (const time_s of new Set(important.map((event) => event.time_s))) {
    assert.ok(ink[Math.floor((x(time_s) / box.width) * ink.length)], `the strip has a bar at ${time_s} s`);
    await marks.click({ position: { x: x(time_s) + 1, y: 8 } });
    await isAt(page, time_s);
  }
  await marks.click({ position: { x: x(10), y: 8 } });
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - 10) < 100 / box.width, "a click where the strip has no bar");
});

/** Events of a run with thousands of events. */
const bustle = JSON.parse(readFileSync(join(folder("bustle"), "summary.json"), "utf8")).events;
const ROUTINE = ["cued", "acquired", "orbit-feasible", "proximity-cleared", "group-created", "admitted"];
const important = bustle.filter((event) => !ROUTINE.includes(event.kind));
const formatted = (count) => count.toLocaleString("en");
const rows = (page) => page.locator("#events [role=option]");
const current = (page) => page.locator("#events [aria-current=time]");

inReport("each of thousands of events can be reached by scrolling and with the keyboard", { flight: "bustle" }, async (page) => {
  assert.ok(important.length > 1400 && bustle.length > 3000, `${important.length}, ${bustle.length}`);
  await page.getByRole("tab", { name: "Events" }).click();
  assert.equal(await page.locator("#event-count").textContent(), `${formatted(important.length)} of ${formatted(bustle.length)} events`);
  assert.ok((await rows(page).count()) < 60, "only visible rows are in the document");
  const all = await listed(page);
  assert.deepEqual(all.map(([time_us, kind]) => [time_us / 1e6, kind]), important.map(({ time_s, kind }) => [time_s, kind]));
  const list = page.getByRole("listbox", { name: "Events" });
  await list.focus();
  await page.keyboard.press("End");
  const pointed = page.locator("#events [aria-selected=true]");
  assert.equal(await pointed.getAttribute("aria-posinset"), String(important.length));
  assert.equal(await pointed.getAttribute("aria-setsize"), String(important.length));
  assert.equal(await list.getAttribute("aria-activedescendant"), await pointed.getAttribute("id"));
  await page.keyboard.press("PageUp");
  await page.keyboard.press("ArrowDown");
  const place = Number(await pointed.getAttribute("aria-posinset"));
  assert.ok(place < important.length - 5, "Page Up moves by a page");
  assert.ok(await pointed.isVisible());
  await page.keyboard.press("Enter");
  await isAt(page, important[place - 1].time_s);
  assert.equal(await current(page).getAttribute("aria-posinset"), String(place), "it is the current event");
});

inReport("the list follows the time unless the user has scrolled away", { flight: "bustle" }, async (page) => {
  await page.clock.install();
  await page.getByRole("tab", { name: "Events" }).click();
  const isVisible = async (row) => {
    const [outer, inner] = [await page.locator("#events").boundingBox(), await row.boundingBox()];
    return inner !== null && inner.y >= outer.y - 1 && inner.y + inner.height <= outer.y + outer.height + 1;
  };
  for (const time_s of [150, 30, 100.2]) {
    await goTo(page, time_s);
    await painted(page);
    const last = important.findLastIndex((event) => event.time_s <= time_s);
    assert.equal(await current(page).getAttribute("aria-posinset"), String(last + 1), `at ${time_s} s`);
    assert.ok(await isVisible(current(page)), `at ${time_s} s`);
  }
  const back = page.getByRole("button", { name: "Back to current time" });
  assert.equal(await back.count(), 0);
  await page.locator("#events").hover();
  await page.mouse.wheel(0, 6000);
  await back.waitFor();
  const scrolled = await page.locator("#events").evaluate((list) => list.scrollTop);
  await page.getByLabel("Speed").selectOption("4");
  await page.keyboard.press(" ");
  await page.clock.runFor(3000);
  assert.ok((await clock(page)) > 110);
  assert.equal(await page.locator("#events").evaluate((list) => list.scrollTop), scrolled, "the list does not move while the user reads elsewhere");
  await page.keyboard.press(" ");
  await back.click();
  await painted(page);
  assert.ok(await isVisible(current(page)));
  const shown = await current(page).getAttribute("aria-posinset");
  await page.keyboard.press(" ");
  await page.clock.runFor(3000);
  await painted(page);
  assert.ok(Number(await current(page).getAttribute("aria-posinset")) > Number(shown) + 40);
  assert.equal(await back.count(), 0);
  await page.keyboard.press(" ");
  await painted(page);
  assert.ok(await isVisible(current(page)), "the list follows the time again");
});

inReport("events are filtered by kind, object and group, and by the selected object", { flight: "bustle" }, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  const count = page.locator("#event-count");
  const shows = async (expected, what) => {
    await painted(page);
    assert.equal(await count.textContent(), `${formatted(expected.length)} of ${formatted(bustle.length)} events`, what);
    assert.ok(expected.length > 0 && expected.length < bustle.length, what);
  };
  const vehicle = page.getByPlaceholder("UAV, target, intruder");
  const names = [...new Set(important.map((event) => event.target))].filter(Boolean);
  const part = names.find((name) => names.some((other) => other !== name && other.startsWith(name)));
  const last = names.at(-1);
  await vehicle.fill(last);
  await shows(important.filter((event) => event.target === last), "a target");
  await vehicle.fill(part.toUpperCase());
  await shows(important.filter((event) => event.target === part), "an exact name does not match longer names");
  await vehicle.fill("r 14");
  await shows(important.filter((event) => event.target?.includes("r 14")), "part of a name");
  await vehicle.fill("UAV 2");
  await shows(important.filter((event) => event.uavs?.includes(2)), "a UAV");
  await vehicle.fill("");
  const { group } = important.find((event) => event.kind === "lost" && event.group !== undefined);
  await page.locator("#event-group").selectOption(String(group));
  await page.getByLabel("routine events").check();
  const ofGroup = bustle.filter((event) => event.group === group || event.to_group === group);
  await shows(ofGroup, "a group");
  await page.getByLabel("Kind").selectOption("lost");
  await shows(ofGroup.filter((event) => event.kind === "lost"), "a group and a kind");
  await page.getByLabel("Kind").selectOption("");
  await page.locator("#event-group").selectOption("");
  await page.getByLabel("routine events").uncheck();
  assert.equal(await page.locator("#event-selected-only").isVisible(), false, "nothing is selected");
  await page.evaluate(() => (location.hash = "#uav=1"));
  await page.getByLabel("only UAV 1").check();
  await shows(important.filter((event) => event.uavs?.includes(1)), "the selected UAV");
  await page.evaluate((name) => (location.hash = `#target=${encodeURIComponent(name)}`), last);
  await page.getByLabel(`only ${last}`).waitFor();
  await shows(important.filter((event) => event.target === last), "the selected target");
  // The keys move through the filtered events.
  const first = important.find((event) => event.target === last);
  await page.keyboard.press("Home");
  await page.keyboard.press("n");
  await isAt(page, first.time_s);
});

inReport("on a phone, the event filters are behind one button, which shows how many are active", { flight: "bustle", ...PHONE }, async (page) => {
  await page.getByRole("tab", { name: "Events" }).click();
  const bar = page.locator("#panel-events .bar");
  assert.ok((await bar.boundingBox()).height < 52, "the bar has one line");
  const filter = page.getByRole("button", { name: /^Filter/ });
  await filter.click();
  await page.getByLabel("Kind").selectOption("lost");
  await page.getByPlaceholder("UAV, target, intruder").fill("r 14");
  await filter.click();
  assert.equal(await filter.textContent(), "Filter (2)");
  assert.equal(await page.getByLabel("Kind").isVisible(), false);
  assert.ok((await bar.boundingBox()).height < 52, "the bar has one line again");
});

inReport("the event strip shows the number of events, and its tooltip lists the events under the pointer", { flight: "bustle" }, async (page) => {
  const marks = page.locator("#event-strip");
  /** For each column of pixels: the number of pixels in the alarm colour, in other colours, and empty. */
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
  assert.ok(await marks.evaluate((canvas) => canvas.width === canvas.clientWidth * devicePixelRatio), "the canvas fills its element");
  const unfiltered = await columns();
  const heights = new Set(unfiltered.map((column) => column.alarm));
  assert.ok(heights.size >= 4, `bars of critical events have the heights ${[...heights]}`);
  assert.ok(unfiltered.every((column) => column.empty > 0), "no bar fills the whole height");
  const critical = ["lost", "removed", "not-admitted", "orbit-infeasible"];
  const box = await marks.boundingBox();
  const end_s = Number(await page.locator("#time").getAttribute("max"));
  const x = (time_s) => (time_s / end_s) * unfiltered.length;
  for (const event of important.filter((event) => critical.includes(event.kind))) {
    assert.ok(unfiltered[Math.min(Math.floor(x(event.time_s)), unfiltered.length - 1)].alarm > 0, `${event.kind} at ${event.time_s} s has a bar`);
  }
  const around = (event, px = 1) => important.filter((other) => Math.abs(x(other.time_s) - x(event.time_s)) <= px);
  const isCritical = (event) => critical.includes(event.kind);
  // The pointer is at integer pixels only, so the event has no neighbours between one and four pixels away.
  const mixed = important.find((event) => !isCritical(event) && around(event).some(isCritical) && around(event, 4).length === around(event).length);
  await marks.hover({ position: { x: x(mixed.time_s), y: 8 } });
  const [many, one] = (await page.locator("#strip-tooltip").textContent()).split("\n");
  const near = around(mixed);
  const [, count, kinds] = many.match(/^(\d+) events, [\d.]+(?: to [\d.]+)? s: (.*)$/);
  assert.equal(Number(count), near.length);
  assert.match(kinds, /^\d+ (lost|removed)/, "critical events come first");
  for (const { kind } of near) assert.ok(kinds.includes(`${near.filter((event) => event.kind === kind).length} ${kind}`), kind);
  assert.match(one, /^[\d.]+ s (lost|removed)/);
  await marks.click({ position: { x: x(mixed.time_s), y: 8 } });
  await painted(page);
  assert.match(await page.locator("#event-summary").textContent(), /^[\d.]+ s (lost|removed)/, "a critical event comes first");
  assert.ok(Math.abs(x(await clock(page)) - x(mixed.time_s)) <= 2);
  // The same holds if another event comes first in the record.
  const first = important.find((event, k) => !isCritical(event) && important[k - 1]?.time_s !== event.time_s && important.some((other) => isCritical(other) && other.time_s === event.time_s));
  await marks.hover({ position: { x: x(first.time_s), y: 8 } });
  const tip = await page.locator("#strip-tooltip").textContent();
  assert.ok(critical.some((kind) => new RegExp(`\n[\\d.]+ s ${kind}`).test(tip)), tip);
  const now = await page.locator("#time-marker").boundingBox();
  assert.ok(Math.abs(now.x + now.width / 2 - box.x - x(await clock(page))) <= 1.5, "the time shown is marked");
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("Kind").selectOption("reassigned");
  const filtered = await columns();
  assert.equal(filtered.reduce((sum, column) => sum + column.alarm, 0), 0, "events that do not pass the filter are faint");
  assert.deepEqual(filtered.map((column) => column.empty > 0), unfiltered.map((column) => column.empty > 0));
});
