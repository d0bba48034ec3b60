// Names from untrusted files are shown as text.

import assert from "node:assert/strict";

import { downloaded, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { NAMES, SCENARIO } from "./hostile.mjs";

/** A name as the page shows it: shortened, and with invisible characters replaced. */
function short(name) {
  const text = name.replace(/[\u0000-\u001f\u007f-\u009f\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff]/g, "\ufffd");
  return text.length > 24 ? `${text.slice(0, 23)}\u2026` : text;
}

/** Elements and event attributes that only a name could have inserted. */
async function foreign(page) {
  return page.evaluate(() => [
    ...[...document.querySelectorAll("img, iframe, object, embed, link:not([rel=icon]), base, form:not([method=dialog])")].map((found) => found.outerHTML),
    ...[...document.querySelectorAll("*")].flatMap((found) => found.getAttributeNames().filter((name) => name.startsWith("on"))),
    ...[...document.scripts].filter((script) => !script.dataset.part && !script.src.startsWith("blob:")).slice(1).map((script) => script.outerHTML),
    ...[...document.querySelectorAll("a[href]")].map((link) => link.href).filter((href) => /^javascript:/i.test(href)),
  ]);
}

inReport("vehicle names are text in tables, events, the event strip and on the map", { flight: "hostile" }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  const named = () => page.locator('#targets td[data-field="name"]').allTextContents();
  for (const time_s of [0, 30, 60]) {
    await goTo(page, time_s);
    assert.deepEqual((await named()).sort(), NAMES.map(short).sort());
    assert.deepEqual(await foreign(page), []);
  }
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("routine events").check();
  await page.getByLabel("Kind").selectOption("cued");
  const events = await page.locator("#events [role=option]").allTextContents();
  assert.equal(events.length, NAMES.length);
  for (const name of NAMES) assert.ok(events.some((text) => text.includes(` ${short(name)}, `) || text.includes(` ${short(name)}:`)), short(name));
  await page.getByLabel("Kind").selectOption("removed");
  await page.locator("#events [role=option]").click();
  await painted(page);
  await page.getByRole("group", { name: "Targets at the time shown" }).getByRole("button", { name: "1 removed" }).click();
  await painted(page);
  const [removed, ...others] = await named();
  assert.ok(NAMES.some((name) => removed === short(name)) && !others.length, removed);
  await page.getByRole("tab", { name: "Events" }).click();
  await page.locator("#event-strip").hover({ position: await page.locator("#event-strip").evaluate((marks) => ({ x: (53.5 / 60) * marks.clientWidth, y: 8 })) });
  assert.match(await page.locator("#strip-tooltip").textContent(), /removed|orbit-infeasible/);
  // The object field accepts the exact names and finds the events of each vehicle.
  await page.getByLabel("Kind").selectOption("cued");
  const field = page.getByPlaceholder("UAV, target, intruder");
  for (const name of NAMES.filter((name) => name === name.trim() && !/[\r\n]/.test(name))) {
    await field.fill(name);
    await painted(page);
    const shown = await page.locator("#events [role=option]").allTextContents();
    assert.ok(shown.length >= 1 && shown.every((text) => text.includes(short(name))), `${name}: ${shown}`);
  }
  assert.deepEqual(await foreign(page), []);
});

inReport("a scenario name is text in the title, the heading and file names", { flight: "hostile-name" }, async (page) => {
  assert.equal(await page.title(), `${SCENARIO}, seed 1 \u2013 standoff`);
  assert.equal(await page.getByRole("heading", { level: 1 }).textContent(), `${SCENARIO}, seed 1`);
  assert.deepEqual(await foreign(page), []);
  const download = await downloaded(page, () => page.getByRole("button", { name: "Save CSV" }).click());
  assert.match(download.name, /^[A-Za-z0-9._-]+\.csv$/);
});
