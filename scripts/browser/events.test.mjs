// Events: the list and the marks over the slider tell what the record tells, and go there.

import assert from "node:assert/strict";

import { clock, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const record = recordOf("figure-9");
const TELLING = ["handoff-requested", "orbit-infeasible", "handoff-completed", "discarded"];

/** The events listed, the whole list scrolled through: time, kind and words. */
async function listed(page) {
  return page.locator("#events").evaluate(async (list) => {
    const found = new Map();
    const { scrollTop } = list;
    for (list.scrollTop = 0; ; list.scrollTop += list.clientHeight / 2) {
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
