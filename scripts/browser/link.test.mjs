// Links: an address with a time and a selection opens there, and nonsense in it does no harm.

import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { after, test } from "node:test";

import { blank, camera, clock, folder, leave, painted, PATIENCE_MS } from "./browser.mjs";
import { recordOf } from "./record.mjs";

after(leave);

const record = recordOf("figure-9");
const said = (page) => page.locator("#told-event").textContent();

/** Opens a report at an address that says where. */
async function at(page, hash, flight = "figure-9") {
  await page.goto("about:blank");
  await page.goto(`${pathToFileURL(join(folder(flight), "report.html")).href}${hash}`);
  await page.waitForSelector('body[data-ready="charts"]');
  await painted(page);
}

/** Puts other words behind the address of the page that is open. */
async function to(page, hash) {
  await page.evaluate((hash) => new Promise((resolve) => {
    if (location.hash === hash) return resolve();
    window.addEventListener("hashchange", () => resolve(), { once: true });
    location.hash = hash;
  }), hash);
  await painted(page);
}

/** The address once the page has put a link into it. */
async function copied(page) {
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => document.getElementById("told-event").textContent !== "");
  return new URL(page.url()).hash;
}

function inLink(name, check) {
  test(name, { timeout: 2 * PATIENCE_MS }, async () => {
    const { context, page, complaints } = await blank();
    try {
      await check(page);
      assert.deepEqual(complaints, []);
    } finally {
      await context.close();
    }
  });
}

inLink("a link opens at its time with its UAV chosen and followed, and is copied as it was", async (page) => {
  await at(page, "#t=60.5&uav=2&follow=1");
  assert.equal(await clock(page), 60.5);
  const { x_m, y_m } = record.rows("uavs", 60.5).get(2);
  const seen = await camera(page);
  assert.ok(Math.abs(seen.x_m - x_m) < 1e-3 && Math.abs(seen.y_m - y_m) < 1e-3, "UAV 2 is in the middle");
  assert.equal(await page.getByLabel("Follow").inputValue(), "uav 2");
  await page.getByRole("tab", { name: "Events" }).click();
  assert.ok(await page.getByLabel("only of UAV 2").isVisible());
  assert.equal(await said(page), "");
  assert.equal(await copied(page), "#t=60.5&uav=2&follow=1");
  // Another one in the address of the same page.
  await to(page, "#t=20&group=1");
  assert.equal(await clock(page), 20);
  assert.ok(await page.getByLabel("only of group 1").isVisible());
  await page.locator("#map").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("c");
  await page.waitForFunction(() => location.hash === "#t=20.5&group=1");
});

inLink("a target is linked by its name, whatever is in it, or by its id", async (page) => {
  const { names } = recordOf("hostile");
  await at(page, "#t=5&target=0", "hostile");
  for (const [id, name] of names.entries()) {
    await to(page, `#target=${encodeURIComponent(name)}`);
    assert.equal(await said(page), "", name);
    const word = new URLSearchParams((await copied(page)).slice(1)).get("target");
    assert.equal(word, name.length > 100 ? String(id) : name);
    // Words of the page's own go when time moves on.
    await page.keyboard.press("ArrowRight");
  }
  assert.equal(new URLSearchParams((await copied(page)).slice(1)).get("t"), String(5 + names.length / 2));
});

inLink("nonsense in a link does no harm and is told", async (page) => {
  const cases = [
    ["#t=100.5", 100, /asks for 100\.5 s, and the run is from 0\.0 to 100\.0 s: this is the nearest/],
    ["#t=-3", 0, /asks for -3 s/],
    ["#t=1e9", 0, /t=1e9: that is no number of seconds/],
    ["#t=%3Cb%3E&uav=99&follow=1", 0, /t=<b>.*; it names UAV 99, which this run does not have/],
    ["#t=40&target=nobody", 40, /names target nobody, which this run does not have/],
    ["#t=40&group=", 40, /names group \(nothing\)/],
    ["#%E0%A4%A&&==&uav", 0, /names UAV \(nothing\)/],
    ["#elsewhere", 0, /^$/],
  ];
  await at(page, cases[0][0]);
  for (const [hash, time_s, words] of cases) {
    await to(page, "#t=0");
    await to(page, hash);
    assert.equal(await clock(page), time_s, hash);
    assert.match(await said(page), words, hash);
    assert.equal(await page.getByLabel("Follow").inputValue(), "run", hash);
  }
});
