// The page as it is served: a run that flies while it is watched, and who is refused.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
import { after, test } from "node:test";

import { PATIENCE_MS, browser, camera, leave } from "./browser.mjs";
import { STANDOFF, results, serving, watching } from "./serving.mjs";

after(leave);

const limits = { timeout: 2 * PATIENCE_MS };

const shown_s = async (page) => Number.parseFloat(await page.textContent("#clock"));

test("a page follows a run while it flies, survives a reload, and tells the outcome at the end", limits, async () => {
  const run = await serving("run", "paper/table-2-pair", "--view", "--rate", "10", "--out", "live");
  const { page, complaints, close } = await watching(run.address);
  assert.equal(await page.getAttribute("#live", "aria-pressed"), "true");
  const first = await shown_s(page);
  await page.waitForFunction((from) => Number.parseFloat(document.getElementById("clock").textContent) > from + 5, first);
  assert.equal(await page.locator("#outcome td").count(), 0, "there is no outcome yet");
  const [, flown_s] = (await page.textContent("#total")).match(/^\/ (\d+\.\d) of 100\.0 s$/);
  assert.ok(Number(flown_s) >= first, "what is flown and planned is told");

  const before = await shown_s(page);
  await page.reload();
  await page.waitForSelector("body[data-ready]");
  await page.waitForFunction((from) => Number.parseFloat(document.getElementById("clock").textContent) > from, before);

  // What is in the list of events stays there, while more is added.
  await page.click("#tab-events");
  await page.click("#routine");
  const listed = await page.evaluate(() => {
    const rows = document.querySelectorAll("#events [role=option]");
    rows[0].dataset.read = "yes";
    return rows.length;
  });

  // Who looks back stays there while the run goes on.
  await page.keyboard.press(" ");
  await page.keyboard.press("Home");
  await page.waitForFunction(() => document.getElementById("clock").textContent === "0.0");
  await page.waitForTimeout(600);
  assert.equal(await shown_s(page), 0);
  await page.click("#live");
  await page.waitForFunction((from) => Number.parseFloat(document.getElementById("clock").textContent) > from, before);

  await page.waitForSelector("#outcome td[data-metric=position_error_m]", { state: "attached" });
  await page.waitForSelector("#live", { state: "hidden" });
  await page.waitForFunction(() => document.getElementById("clock").textContent === "100.0");
  assert.equal(await page.textContent("#total"), "/ 100.0 s");
  const events = await page.evaluate(() => {
    document.getElementById("events").scrollTop = 0;
    return [...document.querySelectorAll("#events [role=option]")].map((item) => item.dataset.read);
  });
  assert.ok(listed > 0 && events.length >= listed && events.includes("yes"), `${listed}, ${events.length}`);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await run.end(), 0);
});

/** Notes of every picture on the map of which times its UAVs and its targets are, and what the page says. */
function notePictures() {
  window.noted = [];
  let pictures;
  const look = () => {
    const map = document.getElementById("map");
    if (map && document.body.dataset.pictures !== pictures) {
      pictures = document.body.dataset.pictures;
      const words = document.getElementById("warning").textContent;
      window.noted.push({ uavs_s: map.dataset.uavsS, targets_s: map.dataset.targetsS, words });
    }
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

test("a page opened late never shows targets of another time than the UAVs, and says so until it has caught up", limits, async () => {
  const run = await serving("run", "best/figure-9", "--set", "duration_s=4000", "--view", "--rate", "20", "--out", "late");
  const LATE_MS = 700;
  // However the test ends, the run does not go on.
  after(run.end);
  const opened = async (delayed, turn) => {
    await new Promise((resolve) => setTimeout(resolve, 700 * turn));
    const prepare = async (page) => {
      await page.addInitScript(notePictures);
      if (!delayed) return;
      await page.route("**/detail/*", async (route) => {
        try {
          const response = await route.fetch();
          await new Promise((resolve) => setTimeout(resolve, LATE_MS));
          await route.fulfill({ response });
        } catch {
          // The page has been closed meanwhile.
        }
      });
    };
    const { page, complaints, close } = await watching(run.address, prepare);
    // A page that keeps up says nothing of it; one whose targets always come late always does.
    await page.waitForFunction((delayed) => {
      const last = window.noted.slice(-5);
      const isBehind = (picture) => /catching up: \d+ s behind/.test(picture.words);
      const isWhole = (picture) => picture.targets_s > 0 && !/catching up|loading/.test(picture.words);
      const times = new Set(window.noted.map((picture) => picture.targets_s));
      return times.size >= 5 && last.every(delayed ? (picture) => picture.targets_s > 0 && isBehind(picture) : isWhole);
    }, delayed);
    const noted = (await page.evaluate(() => window.noted)).filter((picture) => picture.uavs_s !== undefined);
    for (const { uavs_s, targets_s, words } of noted) {
      if (targets_s === "") assert.match(words, /loading targets/, `at ${uavs_s} s`);
      else assert.ok(Math.abs(uavs_s - targets_s) < 0.002, `UAVs of ${uavs_s} s beside targets of ${targets_s} s`);
    }
    // Who looks back sees both of that time.
    await page.keyboard.press(" ");
    await page.keyboard.press("Home");
    await page.waitForFunction(() => document.getElementById("map").dataset.targetsS === "0.000");
    assert.equal(await page.getAttribute("#map", "data-uavs-s"), "0.000");
    // Who plays up to the newest instant follows the run from there.
    for (let press = 0; press < 5; press++) await page.keyboard.press("]");
    await page.keyboard.press("End");
    await page.waitForFunction(() => Number(document.getElementById("clock").textContent) > 0);
    const newest_s = await shown_s(page);
    await page.keyboard.press(" ");
    await page.waitForSelector("#live[aria-pressed=true]");
    assert.ok((await shown_s(page)) >= newest_s);
    assert.deepEqual(complaints, []);
    await close();
  };
  await Promise.all([false, false, true].map(opened));
  assert.equal(await run.end(), 1);
});

test("the map of a run that is flown grows with it, rarely and smoothly, until it is moved by hand", limits, async () => {
  const run = await serving("run", "paper/table-2-pair", "--view", "--rate", "10", "--out", "grows");
  const { page, complaints, close } = await watching(run.address);
  await page.getByRole("tab", { name: "State" }).click();
  // Every picture is looked at, as the page draws it: how many a machine draws is its own affair.
  await page.evaluate(() => {
    const map = document.getElementById("map");
    const look = () => {
      const { eastM, northM, pxPerM } = map.dataset;
      const uavs = [...document.querySelectorAll("#uavs tbody tr")].map((row) =>
        ["x_m", "y_m"].map((field) => Number(row.querySelector(`[data-field=${field}]`).textContent.replace("\u2212", "-"))));
      const off = ([x_m, y_m]) => [Math.abs(x_m - eastM) * pxPerM - map.clientWidth / 2, Math.abs(y_m - northM) * pxPerM - map.clientHeight / 2];
      return { now_ms: performance.now(), px_per_m: Number(pxPerM), off_px: Math.max(...uavs.flatMap(off)) };
    };
    window.looks = [];
    const again = () => requestAnimationFrame(() => (window.looks.push(look()), again()));
    again();
  });
  await page.waitForFunction(() => Number(document.getElementById("clock").textContent) >= 60);
  const looks = await page.evaluate(() => window.looks);
  // A UAV may be ahead of the map that glides after it, further where a picture comes late.
  const outside = looks.filter(({ off_px }) => off_px >= 20).length;
  assert.ok(outside <= looks.length / 10, `a UAV is outside in ${outside} of ${looks.length} pictures`);
  assert.ok(looks.at(-1).px_per_m < 0.9 * looks[0].px_per_m, `${looks[0].px_per_m} to ${looks.at(-1).px_per_m}`);
  const steps = looks.slice(1).map((now, k) => ({ by: Math.abs(Math.log(now.px_per_m / looks[k].px_per_m)), took_ms: now.now_ms - looks[k].now_ms }));
  const largest = Math.max(...steps.filter(({ took_ms }) => took_ms < 50).map(({ by }) => by));
  assert.ok(largest < Math.log(1.2), `no step is large where pictures follow at once: ${largest}`);
  const still = steps.filter(({ by }) => by === 0).length;
  assert.ok(still > looks.length / 20, `it stands still in ${still} of ${looks.length} pictures`);
  await page.getByRole("button", { name: "Zoom in" }).click();
  const held = await camera(page);
  await page.waitForTimeout(700);
  assert.deepEqual(await camera(page), held, "it stays where a hand has moved it");
  assert.deepEqual(complaints, []);
  await close();
  // It is still in the air.
  await run.end();
});

test("a run ends as soon with a page that reads nothing as with none", limits, async () => {
  const run = await serving("run", "tour/02-two-uavs", "--view", "--rate", "100", "--out", "slow");
  const { page } = await watching(run.address);
  const session = await page.context().newCDPSession(page);
  await session.send("Page.setWebLifecycleState", { state: "frozen" });
  const until = Date.now() + PATIENCE_MS;
  for (;;) {
    const head = await (await fetch(`${run.address}/replay/head.json`)).json();
    if (head.outcome.length) break;
    assert.ok(Date.now() < until, "the run waits for the page");
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.equal(await run.end(), 0);
});

test("one click replays the worst run of a batch, flown again to the same outcome", limits, async () => {
  const fly = ["monte-carlo", "tour/02-two-uavs", "--runs", "5", "--set", "guidance.radial_gain=0.6", "--out", "batch"];
  execFileSync(STANDOFF, fly, { cwd: results, stdio: "ignore" });
  const view = await serving("view", "batch");
  const { page, complaints, close } = await watching(view.address);
  await page.locator('#metrics tr[data-metric="position_error_m"] button').click();
  await page.waitForFunction(() => document.querySelector("#told").textContent.startsWith("position_error_m."));
  const values = (await page.locator("#runs tbody tr").first().locator("td").allTextContents()).map(Number);
  await page.locator("#runs tbody a").first().click();
  await page.waitForSelector("#outcome td[data-metric=position_error_m]", { state: "attached" });
  const shown = Number(await page.textContent("#outcome td[data-metric=position_error_m]"));
  assert.ok(values.some((value) => Math.abs(value - shown) <= 0.006), `${shown} is not of ${values}`);
  assert.match(await page.textContent("#title"), /tour\/02-two-uavs, seed \d+/);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});

test("a page from elsewhere gets nothing, by request or by socket", limits, async () => {
  const view = await serving("view", "tour/01-one-uav");
  const stranger = createServer((_, answer) => answer.end("<!DOCTYPE html><title>elsewhere</title>"));
  await new Promise((resolve) => stranger.listen(0, "127.0.0.1", resolve));
  const context = await (await browser()).newContext();
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${stranger.address().port}/`);
  const got = await page.evaluate(async (address) => {
    const asked = await fetch(`${address}/replay/head.json`).then((answer) => answer.text(), () => "refused");
    const unseen = await fetch(`${address}/replay/head.json`, { mode: "no-cors" }).then((answer) => answer.type, () => "refused");
    const socket = await new Promise((resolve) => {
      const socket = new WebSocket(`${address.replace("http", "ws")}/replay/feed`);
      socket.onmessage = () => resolve("told");
      socket.onerror = () => resolve("refused");
    });
    const frame = document.createElement("iframe");
    frame.src = address;
    document.body.append(frame);
    await new Promise((resolve) => (frame.onload = resolve));
    let framed = "refused";
    try {
      framed = frame.contentDocument ? "shown" : "refused";
    } catch {
      // As wanted.
    }
    return { asked, unseen, socket, framed };
  }, view.address);
  assert.deepEqual(got, { asked: "refused", unseen: "refused", socket: "refused", framed: "refused" });
  for (const headers of [{ Origin: "http://evil.example" }, { Origin: "null" }, { "Sec-Fetch-Site": "cross-site" }]) {
    assert.equal((await fetch(`${view.address}/replay/head.json`, { headers })).status, 403, JSON.stringify(headers));
  }
  await context.close();
  stranger.close();
  assert.equal(await view.end(), 0);
});

test("a page that has not all of the run's events says how many there are, and where", limits, async () => {
  const view = await serving("view", "tour/01-one-uav");
  const prepare = (page) => page.route("**/head.json", async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, json: { ...(await response.json()), events_left_out: 12345 } });
  });
  const { page, complaints, close } = await watching(view.address, prepare);
  await page.click("#tab-events");
  await page.waitForFunction(() => /; the run has 12,345 more, later ones: they are in events.parquet only$/.test(document.getElementById("count").textContent));
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});
