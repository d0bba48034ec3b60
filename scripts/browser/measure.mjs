// Measures the speed of reports in this browser on this machine: scripts/check_in_browser --measure.

import { statSync } from "node:fs";
import { cpus, loadavg } from "node:os";
import { join } from "node:path";

import { emptyPage, browser, folder, closeBrowser, open } from "./browser.mjs";

const LAPTOP = { width: 1280, height: 720 };
const DESK = { width: 1920, height: 1080 };

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const report = (quantity, value) => console.log(`${quantity.padEnd(62)} ${value}`);

/** Records when the page reaches each stage, ms since navigation, and the script time of each frame. */
function watch() {
  const request = window.requestAnimationFrame;
  window.drawing = [];
  window.requestAnimationFrame = (act) => request((now) => {
    const from = performance.now();
    act(now);
    if (act.name === "drawFrame") window.drawing.push(performance.now() - from);
  });
  window.reached = {};
  new MutationObserver(() => {
    const { ready, frames } = document.body?.dataset ?? {};
    for (const what of [ready, frames && "frame"]) if (what) window.reached[what] ??= performance.now();
  }).observe(document, { subtree: true, attributeFilter: ["data-ready", "data-frames"] });
}

/** Opens a report `times` times, in a new browser context each time; returns the median times of the stages, ms. */
async function opening(flight, times) {
  const all = [];
  for (let k = 0; k < times; k++) {
    const { context, page } = await emptyPage();
    await page.addInitScript(watch);
    await open(page, flight);
    all.push(await page.evaluate(() => window.reached));
    await context.close();
  }
  return Object.fromEntries(Object.keys(all[0]).map((what) => [what, median(all.map((one) => one[what]))]));
}

/** Measures and prints the opening times of a report. */
async function reportOpening(flight, times) {
  const size = statSync(join(folder(flight), "report.html")).size;
  report(`${flight}: size of the report`, `${(size / 1e6).toFixed(2)} MB`);
  const { map, frame, charts } = await opening(flight, times);
  report(`${flight}: navigation to data, median of ${times}`, `${map.toFixed(0)} ms`);
  report(`${flight}: navigation to the first frame, median of ${times}`, `${frame.toFixed(0)} ms`);
  report(`${flight}: navigation to the charts, median of ${times}`, `${charts.toFixed(0)} ms`);
}

/** Frame rate during playback at 4x with all layers, compared with the frame rate of the browser. */
async function playing(flight, seconds, viewport) {
  const { context, page } = await emptyPage({ viewport });
  await page.addInitScript(watch);
  await open(page, flight);
  await page.locator("#layer-menu").click();
  await page.getByLabel("Preset").selectOption("everything");
  await page.locator("#layer-menu").click();
  await page.getByLabel("Speed").selectOption("4");
  await page.getByRole("button", { name: "Play", exact: true }).click();
  const { pageFrames, frames, drawing } = await page.evaluate(async (ms) => {
    const drawn = () => Number(document.body.dataset.frames);
    const [from, before] = [performance.now(), drawn()];
    window.drawing = [];
    let frames = 0;
    while (performance.now() - from < ms) {
      await new Promise(requestAnimationFrame);
      frames += 1;
    }
    const passed_s = (performance.now() - from) / 1000;
    return { pageFrames: (drawn() - before) / passed_s, frames: frames / passed_s, drawing: window.drawing };
  }, 1000 * seconds);
  const size = `${viewport.width} x ${viewport.height}`;
  report(`${flight}: frames per second over ${seconds} s at 4x, ${size}`, `${pageFrames.toFixed(1)} (browser: ${frames.toFixed(1)})`);
  report(`${flight}: script time per frame, ${size}`, `${median(drawing).toFixed(1)} ms (longest of ${drawing.length}: ${Math.max(...drawing).toFixed(0)})`);
  await context.close();
}

/** Scrubs over the whole mission, with one slider position per frame. */
async function scrubbing(flight, places) {
  const { context, page } = await emptyPage();
  await open(page, flight);
  const { gaps, waited } = await page.evaluate(async (places) => {
    const slider = document.getElementById("time");
    const frame = () => new Promise(requestAnimationFrame);
    const gaps = [];
    let last = await frame();
    for (let k = 0; k <= places; k++) {
      slider.value = (Number(slider.max) * k) / places;
      slider.dispatchEvent(new Event("input"));
      const now = await frame();
      gaps.push(now - last);
      last = now;
    }
    const stopped = performance.now();
    for (let k = 0; k < 2; k++) await frame();
    while (document.getElementById("warning").textContent.includes("loading")) await frame();
    return { gaps, waited: performance.now() - stopped };
  }, places);
  report(`${flight}: longest of ${places} frames while scrubbing`, `${Math.max(...gaps).toFixed(0)} ms (median ${median(gaps).toFixed(0)})`);
  report(`${flight}: from the last position to its targets`, `${waited.toFixed(0)} ms`);
  await context.close();
}

report("Chromium", (await browser()).version());
report("processor", `${cpus().length} x ${cpus()[0].model}; load ${loadavg()[0].toFixed(1)}`);
await reportOpening("figure-9", 5);
await reportOpening("crowd-50", 3);
await playing("crowd-50", 5, LAPTOP);
await reportOpening("crowd-650", 3);
await playing("crowd-650", 5, LAPTOP);
await playing("crowd-650", 5, DESK);
await scrubbing("crowd-650", 120);
report("load at the end", loadavg()[0].toFixed(1));
await closeBrowser();
