// Two runs side by side at the same time.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { after, test } from "node:test";

import { TIMEOUT_MS, PHONE, TABLET, goTo, closeBrowser, painted } from "./browser.mjs";
import { axe, checkLayout } from "./fit.mjs";
import { STANDOFF, results, serving, openServed } from "./serving.mjs";

after(closeBrowser);

const limits = { timeout: 2 * TIMEOUT_MS };

/** The description of a map. */
const description = (page, id) => page.locator(id).getAttribute("aria-label");

test("two runs are shown at the same time, the side panel shows one of them, and their results are compared", limits, async () => {
  const view = await serving("view", "tour/02-two-uavs", "tour/04-two-groups", "--set", "duration_s=40");
  const { page, complaints, close } = await openServed(view.address);
  await page.waitForSelector('[data-ready="charts"]');
  await page.waitForFunction(() => document.querySelectorAll("#outcome tbody tr").length > 5);
  assert.equal(await page.title(), "tour/02-two-uavs, seed 1 | tour/04-two-groups, seed 1 \u2013 standoff");
  assert.deepEqual(await page.locator("#title span").allTextContents(), ["A: tour/02-two-uavs, seed 1", "B: tour/04-two-groups, seed 1"]);
  assert.equal(await page.locator("#about").textContent(),
    "Two UAVs orbit three vehicles 90 degrees apart, with sensor noise | Four UAVs track two groups of vehicles, two UAVs per group");

  // Both maps show the same time.
  for (const time_s of [12, 33.5]) {
    await goTo(page, time_s);
    const at = `Map at ${time_s.toFixed(1)} seconds`;
    for (const [id, counts] of [["#map", "2 UAVs, 1 group"], ["#map-b", "4 UAVs, 2 groups"]]) {
      await page.waitForFunction(([id, text]) => document.querySelector(id).getAttribute("aria-label").startsWith(text), [id, `${at}: ${counts}`]);
    }
  }
  const boxes = await page.locator(".view canvas").evaluateAll((maps) => maps.map((map) => map.getBoundingClientRect().toJSON()));
  assert.ok(boxes.length === 2 && boxes[0].right <= boxes[1].left && Math.abs(boxes[0].width - boxes[1].width) < 2, JSON.stringify(boxes));

  // The buttons with the names of the runs show and select the run of the side panel; a click on its map selects it, too.
  await page.getByRole("tab", { name: "State" }).click();
  const rows = () => page.locator("#uavs tbody tr").count();
  const [first, second] = [page.getByRole("button", { name: /^A: tour\/02-two-uavs/ }), page.getByRole("button", { name: /^B: tour\/04-two-groups/ })];
  assert.deepEqual([await first.getAttribute("aria-pressed"), await rows()], ["true", 2]);
  await second.click();
  await page.waitForFunction(() => document.querySelectorAll("#uavs tbody tr").length === 4);
  assert.deepEqual(await Promise.all([first, second].map((name) => name.getAttribute("aria-pressed"))), ["false", "true"]);
  await page.locator("#map").click({ position: { x: 30, y: 200 } });
  await page.waitForFunction(() => document.querySelectorAll("#uavs tbody tr").length === 2);

  // Linked maps show the same area whichever of them is moved; unlinked maps move separately.
  const views = () => page.locator(".view canvas").evaluateAll((maps) => maps.map(({ dataset }) => `${dataset.eastM} ${dataset.northM} ${dataset.pxPerM}`));
  const link = page.getByRole("checkbox", { name: "Link maps" });
  assert.ok(await link.isChecked(), "both runs are in the same area");
  const drag = async (id) => {
    const box = await page.locator(id).boundingBox();
    const before = await views();
    await page.mouse.move(box.x + 150, box.y + 300);
    await page.mouse.down();
    await page.mouse.move(box.x + 190, box.y + 330);
    await page.mouse.move(box.x + 200, box.y + 340);
    await page.mouse.up();
    await painted(page);
    return before;
  };
  for (const id of ["#map-b", "#map"]) {
    const [before] = await drag(id);
    const [a, b] = await views();
    assert.ok(a === b && a !== before, `${before}, then ${a} and ${b}`);
  }
  await link.uncheck();
  const [, before] = await drag("#map");
  assert.deepEqual([(await views())[0] === before, (await views())[1] === before], [false, true], "only the map that is dragged moves");
  await page.keyboard.press("0");
  await link.check();
  await painted(page);
  assert.equal(new Set(await views()).size, 1);

  // The metrics of the runs and their difference.
  await page.getByRole("tab", { name: "Outcome" }).click();
  await page.getByLabel("all metrics").check();
  assert.deepEqual(await page.locator("#outcome thead th").allTextContents(), ["Metric", "A", "B", "B \u2212 A", "Unit", "Goal or limit"]);
  const numbers = await page.locator('#outcome td[data-metric="standoff_error_m"]').allTextContents();
  const [a, b, difference] = numbers.map((text) => Number(text.replace("\u2212", "-")));
  assert.ok(a !== b && Math.abs(b - a - difference) < 0.011, `${numbers}`);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});

test("charts show the curves of both runs and their differences, or those of one run", limits, async () => {
  for (const [out, duration_s, seed] of [["pair-a", 40, 1], ["pair-b", 25, 2]]) {
    execFileSync(STANDOFF, ["run", "tour/02-two-uavs", "--seed", seed, "--set", `duration_s=${duration_s}`, "--set", "about=", "--out", out], { cwd: results, stdio: "ignore" });
  }
  const view = await serving("view", "pair-a", "pair-b");
  const { page, complaints, close } = await openServed(view.address);
  await page.waitForSelector('[data-ready="charts"]');
  assert.equal(await page.locator("#about").isVisible(), false, "the scenario has no description");
  const traces = () => page.evaluate(() => [...document.querySelectorAll('[data-panel="standoff_error"] .plot')].flatMap(({ data }) =>
    data.map(({ name, yaxis, x, y, line }) => ({ name, yaxis, x: [...x], y: [...y], colour: line.color }))));
  const both = await traces();
  assert.deepEqual(both.map(({ name }) => name), ["A UAV 0", "A UAV 1", "B UAV 0", "B UAV 1", "B \u2212 A UAV 0", "B \u2212 A UAV 1"]);
  const named = Object.fromEntries(both.map((trace) => [trace.name, trace]));
  for (const id of [0, 1]) {
    const [a, b, difference] = [`A UAV ${id}`, `B UAV ${id}`, `B \u2212 A UAV ${id}`].map((name) => named[name]);
    assert.equal(difference.yaxis, "y2");
    assert.ok(a.x.at(-1) === 40 && b.x.at(-1) === 25 && difference.x.at(-1) === 25, "the difference ends with the shorter run");
    let count = 0;
    difference.x.forEach((time_s, k) => {
      const [y, z] = [a.y[a.x.indexOf(time_s)], b.y[b.x.indexOf(time_s)]];
      if (difference.y[k] === null) return;
      count += 1;
      assert.ok(Math.abs(z - y - difference.y[k]) < 1e-4, `${time_s} s: ${z} - ${y} is not ${difference.y[k]}`);
    });
    assert.ok(count > 40, `${count} differences`);
  }
  assert.equal(new Set(both.map(({ colour }) => colour)).size, 3, "the runs and the differences have a colour each");
  await page.getByLabel("A and B").uncheck();
  await page.waitForFunction(() => document.querySelector('[data-panel="standoff_error"] .plot').data.length === 2);
  assert.deepEqual((await traces()).map(({ name, yaxis }) => [name, yaxis]), [["UAV 0", "y"], ["UAV 1", "y"]]);
  await page.getByRole("button", { name: /^B:/ }).click();
  await page.waitForFunction(() => document.querySelector('[data-panel="standoff_error"] .plot').data[0].x.at(-1) === 25);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});

test("the header shows the settings in which two runs of a scenario differ", limits, async () => {
  for (const [out, ...args] of [["usual", "--seed", "2"], ["changed", "--set", "orbit.margin_sds=2", "--set", "uavs.speed_m_s=30"]]) {
    execFileSync(STANDOFF, ["run", "tour/02-two-uavs", "--set", "duration_s=5", ...args, "--out", out], { cwd: results, stdio: "ignore" });
  }
  const view = await serving("view", "usual", "changed");
  for (const options of [{}, PHONE]) {
    const { page, complaints, close } = await openServed(view.address, undefined, options);
    const names = page.locator("#title span");
    const [a, b] = await names.allTextContents();
    assert.match(a, /^A: tour\/02-two-uavs, seed 2, orbit\.margin_sds=[\d.]+, uavs\.speed_m_s=40$/);
    assert.equal(b, "B: tour/02-two-uavs, seed 1, orbit.margin_sds=2, uavs.speed_m_s=30");
    const [above, below] = await names.evaluateAll((all) => all.map((name) => name.getBoundingClientRect().toJSON()));
    assert.ok(above.bottom <= below.top && above.width > 300, "each run has a line");
    assert.deepEqual(complaints, []);
    await close();
  }
  assert.equal(await view.end(), 0);
});

test("the name of the shorter run shows when it ended, while the other run continues", limits, async () => {
  for (const [out, duration_s] of [["short", 10], ["long", 30]]) {
    execFileSync(STANDOFF, ["run", "tour/01-one-uav", "--set", `duration_s=${duration_s}`, "--out", out], { cwd: results, stdio: "ignore" });
  }
  const view = await serving("view", "short", "long");
  const { page, complaints, close } = await openServed(view.address);
  await page.waitForSelector('[data-ready="charts"]');
  assert.equal(await page.getByRole("slider", { name: "Time" }).evaluate((slider) => Number(slider.max)), 30);
  await page.keyboard.press("End");
  await page.getByRole("button", { name: /^A: .*, ended at 10\.0 s$/ }).waitFor();
  assert.match(await description(page, "#map-b"), /^Map at 30\.0 seconds/);
  // The header has a line for each run; a click on one shows its run in the side panel.
  const custody = page.getByRole("group", { name: "Targets at the time shown" });
  assert.deepEqual(await custody.locator("[data-part=in-custody]").allTextContents(), ["Run A: In custody 1 of 1", "Run B: In custody 1 of 1"]);
  await custody.getByRole("button", { name: "Run B" }).click();
  assert.equal(await page.getByRole("button", { name: /^B: / }).getAttribute("aria-pressed"), "true");
  await page.getByRole("button", { name: /^A: / }).click();
  assert.doesNotMatch(await page.locator(".name").nth(1).textContent(), /ended/);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});

test("the page of two runs is accessible in both themes, and its layout fits on a tablet and a phone", limits, async () => {
  const view = await serving("view", "tour/02-two-uavs", "tour/04-two-groups", "--set", "duration_s=40");
  for (const [screen, options] of [["light", { colorScheme: "light" }], ["dark", { colorScheme: "dark" }], ["a tablet", TABLET], ["a phone", PHONE]]) {
    const { page, complaints, close } = await openServed(view.address, undefined, options);
    await page.waitForSelector('[data-ready="charts"]');
    await goTo(page, 30);
    for (const name of ["Charts", "State", "Events", "Outcome"]) {
      await page.getByRole("tab", { name }).click();
      await checkLayout(page, `${name}, ${screen}`);
      if (options.colorScheme) await axe(page, `${name}, ${screen}`);
    }
    for (const map of await page.locator(".view canvas").all()) {
      const { width, height } = await map.boundingBox();
      assert.ok(width >= 150 && height >= 150, `a map of ${width} x ${height} on ${screen}`);
    }
    assert.deepEqual(complaints, []);
    await close();
  }
  assert.equal(await view.end(), 0);
});

test("a link to one of two runs selects that run and its time, even if the data of the other run arrives late", limits, async () => {
  const view = await serving("view", "tour/02-two-uavs", "tour/04-two-groups", "--set", "duration_s=40");
  const late = async (page) => page.route("**/replay-2/overview/*", async (route) => {
    const response = await route.fetch();
    await new Promise((resolve) => setTimeout(resolve, 800));
    await route.fulfill({ response });
  });
  const { page, complaints, close } = await openServed(`${view.address}/#t=20&run=b&uav=3`, late);
  await page.waitForFunction(() => document.getElementById("clock").dateTime === "PT20.000S");
  assert.equal(await page.getByRole("button", { name: /^B:/ }).getAttribute("aria-pressed"), "true");
  await page.getByRole("region", { name: "Selected object" }).getByText("UAV 3").waitFor();
  // The wheel on the other map selects that run and zooms with the first turn.
  const scale = () => page.locator("#map").evaluate((map) => Number(map.dataset.pxPerM));
  const before = await scale();
  const { x, y } = await page.locator("#map").boundingBox();
  await page.mouse.move(x + 120, y + 200);
  await page.mouse.wheel(0, -300);
  await page.waitForFunction((before) => Number(document.getElementById("map").dataset.pxPerM) > 1.2 * before, before);
  await painted(page);
  assert.ok((await scale()) > 1.2 * before, "the zoom stays");
  assert.equal(await page.getByRole("button", { name: /^A:/ }).getAttribute("aria-pressed"), "true");
  await page.keyboard.press("c");
  await page.waitForFunction(() => /^#t=20&run=a&view=[^&]+$/.test(location.hash));
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});
