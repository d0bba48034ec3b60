// Served pages: following a running mission, replaying runs of a batch, and refusing foreign requests.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
import { after, test } from "node:test";

import { TIMEOUT_MS, browser, camera, closeBrowser } from "./browser.mjs";
import { STANDOFF, results, serving, openServed } from "./serving.mjs";

after(closeBrowser);

const limits = { timeout: 2 * TIMEOUT_MS };

const shown_s = async (page) => Number.parseFloat(await page.textContent("#clock"));

test("a page follows a running mission, survives a reload, and shows the outcome at the end", limits, async () => {
  // The mission takes 25 s, because most of the test must pass before its end.
  const run = await serving("run", "paper/table-2-pair", "--view", "--speed", "4", "--out", "live");
  const { page, complaints, close } = await openServed(run.address);
  assert.equal(await page.getAttribute("#live", "aria-pressed"), "true");
  const first = await shown_s(page);
  await page.waitForFunction((from) => Number.parseFloat(document.getElementById("clock").textContent) > from + 5, first);
  assert.equal(await page.locator("#outcome td").count(), 0, "the outcome is empty during the run");
  const [, flown_s] = (await page.textContent("#total")).match(/^\/ (\d+\.\d) of 100\.0 s$/);
  assert.ok(Number(flown_s) >= first, "the page shows the flown and the planned time");

  const before = await shown_s(page);
  await page.reload();
  await page.waitForSelector("body[data-ready]");
  await page.waitForFunction((from) => Number.parseFloat(document.getElementById("clock").textContent) > from, before);

  // Events in the list stay while more events are added.
  await page.click("#tab-events");
  await page.click("#routine-events");
  const listed = await page.evaluate(() => {
    const rows = document.querySelectorAll("#events [role=option]");
    rows[0].dataset.read = "yes";
    return rows.length;
  });

  // A page that shows an earlier time stays there while the run continues.
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

/** Records for every drawn frame the times of its UAVs and targets, and the status text. */
function recordFrames() {
  window.drawnFrames = [];
  let count;
  const look = () => {
    const map = document.getElementById("map");
    if (map && document.body.dataset.frames !== count) {
      count = document.body.dataset.frames;
      const text = document.getElementById("warning").textContent;
      window.drawnFrames.push({ uavs_s: map.dataset.uavsS, targets_s: map.dataset.targetsS, text });
    }
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

test("a page opened late always shows UAVs and targets at the same time, and reports its delay until it has caught up", limits, async () => {
  const run = await serving("run", "improved/figure-9", "--set", "duration_s=4000", "--view", "--speed", "20", "--out", "late");
  const LATE_MS = 700;
  // The run ends even if the test fails.
  after(run.end);
  const opened = async (delayed, turn) => {
    await new Promise((resolve) => setTimeout(resolve, 700 * turn));
    const prepare = async (page) => {
      await page.addInitScript(recordFrames);
      if (!delayed) return;
      await page.route("**/detail/*", async (route) => {
        try {
          const response = await route.fetch();
          await new Promise((resolve) => setTimeout(resolve, LATE_MS));
          await route.fulfill({ response });
        } catch {
          // The page has been closed in the meantime.
        }
      });
    };
    const { page, complaints, close } = await openServed(run.address, prepare);
    // A page that keeps up reports no delay; a page whose targets always arrive late always reports it.
    await page.waitForFunction((delayed) => {
      const last = window.drawnFrames.slice(-5);
      const isBehind = (frame) => /catching up: \d+ s behind/.test(frame.text);
      const isWhole = (frame) => frame.targets_s > 0 && !/catching up|loading/.test(frame.text);
      const times = new Set(window.drawnFrames.map((frame) => frame.targets_s));
      return times.size >= 5 && last.every(delayed ? (frame) => frame.targets_s > 0 && isBehind(frame) : isWhole);
    }, delayed);
    const frames = (await page.evaluate(() => window.drawnFrames)).filter((frame) => frame.uavs_s !== undefined);
    for (const { uavs_s, targets_s, text } of frames) {
      if (targets_s === "") assert.match(text, /loading targets/, `at ${uavs_s} s`);
      else assert.ok(Math.abs(uavs_s - targets_s) < 0.002, `UAVs at ${uavs_s} s, targets at ${targets_s} s`);
    }
    // At an earlier time both are shown at that time.
    await page.keyboard.press(" ");
    await page.keyboard.press("Home");
    await page.waitForFunction(() => document.getElementById("map").dataset.targetsS === "0.000");
    assert.equal(await page.getAttribute("#map", "data-uavs-s"), "0.000");
    // Playback that reaches the newest time step follows the run from there.
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

test("the map of a running mission zooms out rarely and smoothly until the user moves it", limits, async () => {
  const run = await serving("run", "paper/table-2-pair", "--view", "--speed", "4", "--out", "grows");
  const { page, complaints, close } = await openServed(run.address);
  await page.getByRole("tab", { name: "State" }).click();
  // Every drawn frame is checked; the number of frames depends on the machine.
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
  // A UAV may be ahead of the map, which follows smoothly, and further ahead if a frame is late.
  const outside = looks.filter(({ off_px }) => off_px >= 20).length;
  assert.ok(outside <= looks.length / 10, `a UAV is outside in ${outside} of ${looks.length} frames`);
  assert.ok(looks.at(-1).px_per_m < 0.9 * looks[0].px_per_m, `${looks[0].px_per_m} to ${looks.at(-1).px_per_m}`);
  const steps = looks.slice(1).map((now, k) => ({ by: Math.abs(Math.log(now.px_per_m / looks[k].px_per_m)), took_ms: now.now_ms - looks[k].now_ms }));
  const largest = Math.max(...steps.filter(({ took_ms }) => took_ms < 50).map(({ by }) => by));
  assert.ok(largest < Math.log(1.2), `no step between frames less than 50 ms apart is large: ${largest}`);
  const still = steps.filter(({ by }) => by === 0).length;
  assert.ok(still > looks.length / 20, `the map does not move in ${still} of ${looks.length} frames`);
  await page.getByRole("button", { name: "Zoom in" }).click();
  const held = await camera(page);
  await page.waitForTimeout(700);
  assert.deepEqual(await camera(page), held, "the map stays where the user has moved it");
  assert.deepEqual(complaints, []);
  await close();
  // The run has not ended yet.
  await run.end();
});

test("a page that reads no data does not delay the run", limits, async () => {
  const run = await serving("run", "tour/02-two-uavs", "--view", "--speed", "100", "--out", "slow");
  const { page } = await openServed(run.address);
  const session = await page.context().newCDPSession(page);
  await session.send("Page.setWebLifecycleState", { state: "frozen" });
  const until = Date.now() + TIMEOUT_MS;
  for (;;) {
    const head = await (await fetch(`${run.address}/replay/head.json`)).json();
    if (head.outcome.length) break;
    assert.ok(Date.now() < until, "the run waits for the page");
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.equal(await run.end(), 0);
});

test("one click replays the worst run of a batch with the same outcome", limits, async () => {
  const fly = ["monte-carlo", "tour/02-two-uavs", "--runs", "5", "--set", "guidance.radial_gain=0.6", "--out", "batch"];
  execFileSync(STANDOFF, fly, { cwd: results, stdio: "ignore" });
  const view = await serving("view", "batch");
  const { page, complaints, close } = await openServed(view.address);
  await page.locator('#metrics tr[data-metric="position_error_m"] button').click();
  await page.waitForFunction(() => document.querySelector("#summary").textContent.startsWith("position_error_m."));
  const values = (await page.locator("#runs tbody tr").first().locator("td").allTextContents()).map(Number);
  await page.locator("#runs tbody a").first().click();
  await page.waitForSelector("#outcome td[data-metric=position_error_m]", { state: "attached" });
  const shown = Number(await page.textContent("#outcome td[data-metric=position_error_m]"));
  assert.ok(values.some((value) => Math.abs(value - shown) <= 0.006), `${shown} is among ${values}`);
  assert.match(await page.textContent("#title"), /tour\/02-two-uavs, seed \d+/);
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});

test("a page of another origin gets no data by request, socket or frame", limits, async () => {
  const view = await serving("view", "tour/01-one-uav");
  const stranger = createServer((_, answer) => answer.end("<!DOCTYPE html><title>elsewhere</title>"));
  await new Promise((resolve) => stranger.listen(0, "127.0.0.1", resolve));
  const context = await (await browser()).newContext();
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${stranger.address().port}/`);
  const got = await page.evaluate(async (address) => {
    const cors = await fetch(`${address}/replay/head.json`).then((answer) => answer.text(), () => "refused");
    const opaque = await fetch(`${address}/replay/head.json`, { mode: "no-cors" }).then((answer) => answer.type, () => "refused");
    const socket = await new Promise((resolve) => {
      const socket = new WebSocket(`${address.replace("http", "ws")}/replay/feed`);
      socket.onmessage = () => resolve("received");
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
      // Access is refused, as expected.
    }
    return { cors, opaque, socket, framed };
  }, view.address);
  assert.deepEqual(got, { cors: "refused", opaque: "refused", socket: "refused", framed: "refused" });
  for (const headers of [{ Origin: "http://evil.example" }, { Origin: "null" }, { "Sec-Fetch-Site": "cross-site" }]) {
    assert.equal((await fetch(`${view.address}/replay/head.json`, { headers })).status, 403, JSON.stringify(headers));
  }
  await context.close();
  stranger.close();
  assert.equal(await view.end(), 0);
});

test("a page without the last events of a run shows how many there are, and their file", limits, async () => {
  const view = await serving("view", "tour/01-one-uav");
  const prepare = (page) => page.route("**/head.json", async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, json: { ...(await response.json()), events_left_out: 12345 } });
  });
  const { page, complaints, close } = await openServed(view.address, prepare);
  await page.click("#tab-events");
  await page.waitForFunction(() => /; 12,345 later events are only in events.parquet$/.test(document.getElementById("event-count").textContent));
  assert.deepEqual(complaints, []);
  await close();
  assert.equal(await view.end(), 0);
});
