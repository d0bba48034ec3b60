// Links: a link opens the page with its time and selection, and invalid parameters are reported.

import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { after, test } from "node:test";

import { emptyPage, camera, clock, folder, closeBrowser, painted, TIMEOUT_MS } from "./browser.mjs";
import { recordOf } from "./record.mjs";

after(closeBrowser);

const record = recordOf("figure-9");
const message = (page) => page.locator("#event-summary").textContent();

/** Opens a report with a fragment in its address. */
async function at(page, hash, flight = "figure-9") {
  await page.goto("about:blank");
  await page.goto(`${pathToFileURL(join(folder(flight), "report.html")).href}${hash}`);
  await page.waitForSelector('body[data-ready="charts"]');
  await painted(page);
}

/** Changes the fragment of the address of the open page. */
async function to(page, hash) {
  await page.evaluate((hash) => new Promise((resolve) => {
    if (location.hash === hash) return resolve();
    window.addEventListener("hashchange", () => resolve(), { once: true });
    location.hash = hash;
  }), hash);
  await painted(page);
}

/** Clicks "Copy link" and returns the fragment that the page puts into the address. */
async function copied(page) {
  await page.getByRole("button", { name: "Copy link" }).click();
  await page.waitForFunction(() => document.getElementById("event-summary").textContent !== "");
  return new URL(page.url()).hash;
}

function inLink(name, check) {
  test(name, { timeout: 2 * TIMEOUT_MS }, async () => {
    const { context, page, complaints } = await emptyPage();
    try {
      await check(page);
      assert.deepEqual(complaints, []);
    } finally {
      await context.close();
    }
  });
}

inLink("a link opens at its time with its UAV selected and followed, and copying returns the same link", async (page) => {
  await at(page, "#t=60.5&uav=2&follow=1");
  assert.equal(await clock(page), 60.5);
  const { x_m, y_m } = record.rows("uavs", 60.5).get(2);
  const view = await camera(page);
  assert.ok(Math.abs(view.x_m - x_m) < 1e-3 && Math.abs(view.y_m - y_m) < 1e-3, "UAV 2 is in the centre");
  assert.equal(await page.getByLabel("Follow").inputValue(), "uav 2");
  await page.getByRole("tab", { name: "Events" }).click();
  assert.ok(await page.getByLabel("only UAV 2").isVisible());
  assert.equal(await message(page), "");
  const { px_per_m } = view;
  const withView = await copied(page);
  assert.equal(withView, `#t=60.5&uav=2&follow=1&view=${Number(x_m.toFixed(1))},${Number(y_m.toFixed(1))},${Number(px_per_m.toPrecision(4))}&tab=events`);
  await to(page, withView);
  assert.equal(await copied(page), withView);
  // Another link in the address of the same page.
  await to(page, "#t=20&group=1");
  assert.equal(await clock(page), 20);
  assert.ok(await page.getByLabel("only group 1").isVisible());
  await page.locator("#map").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("c");
  await page.waitForFunction(() => /^#t=20\.5&group=1&view=[^&]+&tab=events$/.test(location.hash));
});

inLink("a link contains layers, highlighted group, map view and side panel", async (page) => {
  const hash = "#t=40&highlight=1&layers=operator&view=120.5,-40,0.5&tab=state";
  await at(page, hash);
  assert.deepEqual(await camera(page), { x_m: 120.5, y_m: -40, px_per_m: 0.5 });
  assert.equal(await page.locator("#highlighted-group").inputValue(), "1");
  assert.ok(await page.getByRole("tabpanel", { name: "State" }).isVisible());
  const layers = async () => {
    await painted(page);
    return (await page.locator("#map").getAttribute("data-layers")).split(" ");
  };
  assert.ok(!(await layers()).includes("truth") && (await layers()).includes("tracks"));
  assert.equal(await copied(page), hash);
  await to(page, "#t=40&layers=tracks.uavs&follow=run&highlight=none&tab=charts");
  assert.deepEqual(await layers(), ["tracks", "uavs"]);
  assert.equal(await page.getByLabel("Follow").inputValue(), "run");
  assert.equal(await copied(page), "#t=40&follow=run&highlight=none&layers=tracks.uavs");
});

inLink("\"Last view\", its keys, and Back and Forward of the browser return to earlier views of the map", async (page) => {
  await at(page, "#t=40");
  const entries = () => page.evaluate(() => history.length);
  const moved = async (act) => {
    const before = await entries();
    await act();
    await page.waitForFunction((before) => history.length > before, before);
    return camera(page);
  };
  const shows = (view) => page.waitForFunction(({ x_m, px_per_m }) => {
    const { eastM, pxPerM } = document.getElementById("map").dataset;
    return Number(eastM) === x_m && Number(pxPerM) === px_per_m;
  }, view);
  const first = await camera(page);
  const second = await moved(() => page.getByRole("button", { name: "Zoom in" }).click());
  const third = await moved(() => page.getByLabel("Follow").selectOption("uav 2"));
  assert.notEqual(second.px_per_m, first.px_per_m);
  assert.notEqual(third.x_m, second.x_m);
  await page.getByRole("button", { name: "Last view" }).click();
  await shows(second);
  assert.equal(await page.getByLabel("Follow").inputValue(), "");
  await page.goForward();
  await shows(third);
  assert.equal(await page.getByLabel("Follow").inputValue(), "uav 2");
  await page.locator("#map").focus();
  await page.keyboard.press("z");
  await shows(second);
  await page.keyboard.press("Backspace");
  await shows(first);
  assert.equal(await page.getByLabel("Follow").inputValue(), "now");
  assert.equal(await clock(page), 40, "the time stays");
  await page.keyboard.press("z");
  assert.equal(await message(page), "This is the first view");
  // A movement that has just ended counts as well.
  await page.getByRole("button", { name: "Zoom out" }).click();
  await painted(page);
  await page.keyboard.press("z");
  await shows(first);
});

inLink("links contain the name of a target with any characters, or its id", async (page) => {
  const { names } = recordOf("hostile");
  await at(page, "#t=5&target=0", "hostile");
  for (const [id, name] of names.entries()) {
    await to(page, `#target=${encodeURIComponent(name)}`);
    assert.equal(await message(page), "", name);
    const word = new URLSearchParams((await copied(page)).slice(1)).get("target");
    assert.equal(word, name.length > 100 ? String(id) : name);
    // Messages of the page disappear when the time changes.
    await page.keyboard.press("ArrowRight");
  }
  assert.equal(new URLSearchParams((await copied(page)).slice(1)).get("t"), String(5 + names.length / 2));
});

inLink("invalid parameters of a link are reported and otherwise ignored", async (page) => {
  const cases = [
    ["#t=100.5", 100, /requests 100\.5 s, but the run covers 0\.0 to 100\.0 s \(nearest time shown\)/],
    ["#t=-3", 0, /requests -3 s/],
    ["#t=1e9", 0, /t=1e9, which is not a number of seconds/],
    ["#t=%3Cb%3E&uav=99&follow=1", 0, /t=<b>.*; it names UAV 99, which is not in this run/],
    ["#t=40&target=unknown", 40, /names target unknown, which is not in this run/],
    ["#t=40&group=", 40, /names group \(empty\)/],
    ["#t=40&layers=most", 40, /layers=most, which must be automatic, operator, analyst or everything, or names of layers joined by "\."/],
    ["#t=40&layers=custom", 40, /layers=custom, which must be/],
    ["#t=40&view=1,2", 40, /view=1,2, which must be metres east, metres north and pixels per metre/],
    ["#t=40&view=1,2,0", 40, /view=1,2,0, which must be/],
    ["#t=40&view=1e9,2,1", 40, /view=1e9,2,1, which must be/],
    ["#t=40&highlight=77", 40, /highlights group 77, which is not in this run/],
    ["#t=40&tab=map", 40, /tab=map, which must be charts, state, events, problems or outcome/],
    ["#t=40&follow=2", 40, /follow=2, which must be 1, now or run/],
    ["#%E0%A4%A&&==&uav", 0, /names UAV \(empty\)/],
    ["#elsewhere", 0, /^$/],
  ];
  await at(page, cases[0][0]);
  for (const [hash, time_s, expected] of cases) {
    await to(page, "#t=0");
    await to(page, hash);
    assert.equal(await clock(page), time_s, hash);
    assert.match(await message(page), expected, hash);
    assert.equal(await page.getByLabel("Follow").inputValue(), "now", hash);
  }
});
