// Events: the list and the marks over the slider tell what the record tells, and go there.

import assert from "node:assert/strict";

import { clock, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const record = recordOf("figure-9");
const TELLING = ["handoff-requested", "orbit-infeasible", "handoff-completed", "discarded"];

/** The events listed: time, and words. */
async function listed(page) {
  return page.locator("#events button").evaluateAll((buttons) =>
    buttons.map((button) => [Number(button.dataset.timeUs), button.dataset.kind, button.textContent]));
}

async function isAt(page, time_s) {
  await painted(page);
  assert.equal(await clock(page), time_s);
  assert.equal(Number(await page.getByRole("slider", { name: "Time" }).inputValue()), time_s);
  assert.equal(await page.locator("#clock").textContent(), `${time_s.toFixed(1)} s`);
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
    await page.locator(`#events button[data-kind="${kind}"]`).click();
    await isAt(page, time_s);
  }
  await page.locator('#events button[data-kind="handoff-requested"]').focus();
  await page.keyboard.press("Enter");
  await isAt(page, 32);
});

inReport("a click on a mark over the slider lands on its event, beside it on that time", {}, async (page) => {
  const marks = page.locator("#marks");
  const box = await marks.boundingBox();
  const x = (time_s) => (time_s / 100) * box.width;
  const telling = record.events.filter((event) => TELLING.includes(event.kind));
  const row = await marks.evaluate((canvas) => [...canvas.getContext("2d").getImageData(0, canvas.height / 2, canvas.width, 1).data]);
  for (const time_s of new Set(telling.map((event) => event.time_s))) {
    const opacity = row[4 * Math.round((x(time_s) / box.width) * (row.length / 4)) + 3];
    assert.ok(opacity > 0, `there is a mark at ${time_s} s`);
    await marks.click({ position: { x: x(time_s) + 1, y: 8 } });
    await isAt(page, time_s);
  }
  await marks.click({ position: { x: x(10), y: 8 } });
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - 10) < 100 / box.width, "where there is no mark");
});
