// How fast reports are in this browser, on this machine: scripts/check_in_browser --measure.

import { statSync } from "node:fs";
import { cpus, loadavg } from "node:os";
import { join } from "node:path";

import { blank, browser, folder, leave, open } from "./browser.mjs";

const LAPTOP = { width: 1280, height: 720 };
const DESK = { width: 1920, height: 1080 };

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const say = (what, value) => console.log(`${what.padEnd(62)} ${value}`);

/** Notes when the page has got where, ms since navigation; and how long its script takes for each picture. */
function watch() {
  const request = window.requestAnimationFrame;
  window.drawing = [];
  window.requestAnimationFrame = (act) => request((now) => {
    const from = performance.now();
    act(now);
    if (act.name === "picture") window.drawing.push(performance.now() - from);
  });
  window.reached = {};
  new MutationObserver(() => {
    const { ready, pictures } = document.body?.dataset ?? {};
    for (const what of [ready, pictures && "picture"]) if (what) window.reached[what] ??= performance.now();
  }).observe(document, { subtree: true, attributeFilter: ["data-ready", "data-pictures"] });
}

/** Opens a report, `times` times, anew each time; gives the median of each time, ms. */
async function opening(flight, times) {
  const all = [];
  for (let k = 0; k < times; k++) {
    const { context, page } = await blank();
    await page.addInitScript(watch);
    await open(page, flight);
    all.push(await page.evaluate(() => window.reached));
    await context.close();
  }
  return Object.fromEntries(Object.keys(all[0]).map((what) => [what, median(all.map((one) => one[what]))]));
}

async function tellOpening(flight, times) {
  const size = statSync(join(folder(flight), "report.html")).size;
  say(`${flight}: size of the report`, `${(size / 1e6).toFixed(2)} MB`);
  const { map, picture, charts } = await opening(flight, times);
  say(`${flight}: navigation to data, median of ${times}`, `${map.toFixed(0)} ms`);
  say(`${flight}: navigation to the first picture, median of ${times}`, `${picture.toFixed(0)} ms`);
  say(`${flight}: navigation to the charts, median of ${times}`, `${charts.toFixed(0)} ms`);
}

/** Pictures per second while playing at 4x with every layer, beside the frames that the browser offers. */
async function playing(flight, seconds, viewport) {
  const { context, page } = await blank({ viewport });
  await page.addInitScript(watch);
  await open(page, flight);
  await page.locator("summary").click();
  for (const layer of await page.getByRole("group", { name: "Layers" }).getByRole("checkbox").all()) await layer.check();
  await page.locator("summary").click();
  await page.getByLabel("Speed").selectOption("4");
  await page.getByRole("button", { name: "Play", exact: true }).click();
  const { pictures, frames, drawing } = await page.evaluate(async (ms) => {
    const drawn = () => Number(document.body.dataset.pictures);
    const [from, before] = [performance.now(), drawn()];
    window.drawing = [];
    let frames = 0;
    while (performance.now() - from < ms) {
      await new Promise(requestAnimationFrame);
      frames += 1;
    }
    const passed_s = (performance.now() - from) / 1000;
    return { pictures: (drawn() - before) / passed_s, frames: frames / passed_s, drawing: window.drawing };
  }, 1000 * seconds);
  const size = `${viewport.width} x ${viewport.height}`;
  say(`${flight}: pictures per second over ${seconds} s at 4x, ${size}`, `${pictures.toFixed(1)} (the browser offers ${frames.toFixed(1)})`);
  say(`${flight}: script for a picture, ${size}`, `${median(drawing).toFixed(1)} ms (longest of ${drawing.length}: ${Math.max(...drawing).toFixed(0)})`);
  await context.close();
}

/** Scrubs over the whole mission, a place each frame. */
async function scrubbing(flight, places) {
  const { context, page } = await blank();
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
  say(`${flight}: longest frame of ${places} while scrubbing over all of it`, `${Math.max(...gaps).toFixed(0)} ms (median ${median(gaps).toFixed(0)})`);
  say(`${flight}: from the last place to its targets`, `${waited.toFixed(0)} ms`);
  await context.close();
}

say("Chromium", (await browser()).version());
say("processor", `${cpus().length} x ${cpus()[0].model}; load ${loadavg()[0].toFixed(1)}`);
await tellOpening("figure-9", 5);
await tellOpening("crowd-50", 3);
await playing("crowd-50", 5, LAPTOP);
await tellOpening("crowd-650", 3);
await playing("crowd-650", 5, LAPTOP);
await playing("crowd-650", 5, DESK);
await scrubbing("crowd-650", 120);
say("load at the end", loadavg()[0].toFixed(1));
await leave();
