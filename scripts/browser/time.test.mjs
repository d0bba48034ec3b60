// Time: playback, scrubbing, speed.

import assert from "node:assert/strict";

import { clock, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

/** Advances the clock of the page, in addition to the time that passes. */
async function pass(page, ms) {
  await page.clock.runFor(ms);
}

inReport("a report opens from disk with its title, map and charts", {}, async (page) => {
  assert.equal(await page.title(), "paper/figure-9, seed 1 \u2013 standoff");
  assert.equal(await page.getByRole("heading", { level: 1 }).textContent(), "paper/figure-9, seed 1");
  assert.equal(await clock(page), 0);
  const inks = await page.locator("#map").evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size;
  });
  assert.ok(inks > 50, `the map has ${inks} colours`);
  assert.ok((await page.locator("#charts .scatterlayer .trace").count()) > 10);
});

inReport("playback advances the time at the selected speed and pauses at the end", {}, async (page) => {
  await page.clock.install();
  for (const speed of ["0.25", "1", "4", "32"]) {
    await page.getByLabel("Speed").selectOption(speed);
    await goTo(page, 10);
    const begun_ms = await page.locator("#play").evaluate((play) => {
      play.click();
      return performance.now();
    });
    await pass(page, 1000);
    const { time_s, elapsed_s } = await page.locator("#clock").evaluate((clock, begun_ms) => {
      return { time_s: Number(clock.dateTime.slice(2, -1)), elapsed_s: (performance.now() - begun_ms) / 1000 };
    }, begun_ms);
    await page.getByRole("button", { name: "Pause" }).click();
    await pass(page, 1000);
    // The tolerance covers one frame and the update interval of the tables.
    const expected_s = Math.min(10 + Number(speed) * elapsed_s, 100);
    assert.ok(Math.abs(time_s - expected_s) <= 0.25 * Number(speed), `at ${speed}x ${elapsed_s} s advance 10 s to ${time_s} s`);
    const paused = await clock(page);
    await pass(page, 1000);
    assert.equal(await clock(page), paused, "the time does not change while paused");
  }
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await pass(page, 5000);
  assert.equal(await clock(page), 100);
  assert.equal(await page.locator("#play").textContent(), "Play");
  assert.equal(await page.locator("#play").getAttribute("aria-pressed"), "false");
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await pass(page, 300);
  assert.ok((await clock(page)) < 100, "playback restarts from the beginning");
});

inReport("slider, arrow keys and step buttons change the time", {}, async (page) => {
  const slider = page.getByRole("slider", { name: "Time" });
  const box = await slider.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - 50) < 0.5, "a click in the middle of the slider goes to half of the duration");
  const at = async (time_s, what) => {
    await painted(page);
    assert.equal(await clock(page), time_s, what);
    assert.equal(Number(await slider.inputValue()), time_s, `${what}: the slider follows`);
    assert.equal(await slider.getAttribute("aria-valuetext"), `${time_s.toFixed(1)} seconds`);
    assert.equal(await page.locator(".clock").textContent(), `${time_s.toFixed(1)} / 100.0 s`);
  };
  await page.locator("#map").focus();
  const steps = [["Home", 0], ["ArrowRight", 0.5], ["ArrowRight", 1], ["ArrowLeft", 0.5], ["Shift+ArrowRight", 10.5],
    ["Shift+ArrowLeft", 0.5], ["Shift+ArrowLeft", 0], ["End", 100], ["ArrowRight", 100]];
  for (const [key, time_s] of steps) {
    await page.keyboard.press(key);
    await at(time_s, key);
  }
  await page.getByRole("button", { name: "Step back" }).click();
  await at(99.5, "one time step back");
  await page.getByRole("button", { name: "Step forward" }).click();
  await at(100, "one time step forward");
  await goTo(page, 33.3);
  await page.keyboard.press("ArrowRight");
  await at(33.5, "from between two time steps to the next one");
});

inReport("keyboard shortcuts play, change the speed and go to events, also while the slider has the focus", {}, async (page) => {
  const slider = page.getByRole("slider", { name: "Time" });
  await slider.focus();
  await page.keyboard.press("n");
  await painted(page);
  assert.equal(await clock(page), 32);
  assert.equal(Number(await slider.inputValue()), 32);
  await page.keyboard.press("n");
  await page.keyboard.press("p");
  await painted(page);
  assert.equal(await clock(page), 32);
  for (const [key, speed] of [["]", "2"], ["]", "4"], ["[", "2"], ["[", "1"], ["[", "0.5"], ["[", "0.25"], ["[", "0.25"]]) {
    await page.keyboard.press(key);
    assert.equal(await page.getByLabel("Speed").inputValue(), speed);
  }
  await page.keyboard.press(" ");
  assert.equal(await page.locator("#play").getAttribute("aria-pressed"), "true");
  await page.keyboard.press(" ");
  assert.equal(await page.locator("#play").getAttribute("aria-pressed"), "false");
});

inReport("Space plays after a click on any control, and presses a button that has the keyboard focus", {}, async (page) => {
  const isPlaying = async () => (await page.locator("#play").getAttribute("aria-pressed")) === "true";
  const spacePlays = async (what) => {
    for (const expected of [!(await isPlaying()), await isPlaying()]) {
      await page.keyboard.press(" ");
      await painted(page);
      assert.equal(await isPlaying(), expected, `Space after ${what}`);
    }
  };
  const clicked = new Set();
  for (const tab of ["Charts", "State", "Events", "Outcome"]) {
    await page.getByRole("tab", { name: tab }).click();
    await spacePlays(`the tab ${tab}`);
    const controls = page.locator("button:visible, summary:visible, input[type=checkbox]:visible, input[type=range]:visible");
    for (let k = 0; k < (await controls.count()); k++) {
      const control = controls.nth(k);
      const id = await control.evaluate((one) => one.id || one.name || one.textContent);
      if (clicked.has(id) || id.startsWith("tab-")) continue;
      clicked.add(id);
      // Other tests cover the buttons that save the charts.
      if (id === "png" || id === "csv") continue;
      await control.click();
      if (await page.getByRole("dialog").count()) await page.keyboard.press("Escape");
      if (await isPlaying()) await page.locator("#play").click();
      await spacePlays(id);
      if (await page.locator("#panel-list").isVisible()) await page.keyboard.press("Escape");
    }
  }
  for (const id of ["play", "step-back", "step-forward", "fit", "ruler", "zoom-in", "theme", "help-button", "copy-link", "time", "routine-events"]) {
    assert.ok(clicked.has(id), `${id} is among ${[...clicked]}`);
  }
  // With the keyboard focus on a button, Space and Enter press it once and do nothing else; checkboxes, lists and fields keep the key.
  await page.getByRole("tab", { name: "Events" }).click();
  await goTo(page, 10);
  await page.locator("#step-forward").focus();
  for (const [key, time_s] of [[" ", 10.5], ["Enter", 11]]) {
    await page.keyboard.press(key);
    await painted(page);
    assert.deepEqual([await clock(page), await isPlaying()], [time_s, false], `after "${key}"`);
  }
  await page.locator("#play").focus();
  await spacePlays("the focus on the button itself");
  const layers = page.locator("details", { has: page.locator("#layer-menu") });
  await page.locator("#layer-menu").focus();
  await page.keyboard.press(" ");
  assert.deepEqual([await layers.evaluate((menu) => menu.open), await isPlaying()], [true, false]);
  await page.keyboard.press("Escape");
  await page.locator("#routine-events").focus();
  const was = await page.locator("#routine-events").isChecked();
  await page.keyboard.press(" ");
  assert.equal(await page.locator("#routine-events").isChecked(), !was);
  await page.getByPlaceholder("UAV, target, intruder").focus();
  await page.keyboard.type("UAV 1");
  assert.equal(await page.getByPlaceholder("UAV, target, intruder").inputValue(), "UAV 1");
  assert.equal(await isPlaying(), false);
});

inReport("keys with one character can be switched off, and stay off", {}, async (page) => {
  await page.keyboard.press("?");
  await page.getByRole("checkbox", { name: /^Keys with one character/ }).uncheck();
  await page.keyboard.press("Escape");
  const state = () => page.evaluate(() => [document.documentElement.dataset.theme, location.hash, document.activeElement.tagName,
    document.querySelectorAll("dialog[open], [aria-pressed=true], [aria-expanded=true]").length, document.getElementById("follow").value, document.getElementById("clock").textContent]);
  for (const visit of ["before", "after the page is opened again"]) {
    const before = await state();
    for (const key of "tdrkcfnpzl/?[]+-=0") await page.keyboard.press(key);
    await painted(page);
    assert.deepEqual(await state(), before, visit);
    await page.keyboard.press("ArrowRight");
    await painted(page);
    assert.equal(await clock(page), 0.5, "other keys work");
    if (visit === "before") await page.reload();
    await page.waitForSelector("body[data-frames]");
  }
  await page.getByRole("button", { name: "Help" }).click();
  await page.getByRole("checkbox", { name: /^Keys with one character/ }).check();
  await page.keyboard.press("Escape");
  const [theme] = await state();
  await page.keyboard.press("t");
  assert.notEqual((await state())[0], theme);
});

inReport("the text of the current event is shown above the strip until the time moves on, and the layout does not change", {}, async (page) => {
  await page.clock.install();
  const eventText = page.locator("#event-summary");
  const boxes = () => page.evaluate(() => [...document.querySelectorAll("footer, footer *, #map")].filter((one) => one.id !== "time-marker").map((one) => {
    const { left, top, width, height } = one.getBoundingClientRect();
    return one.closest("#strip-tooltip, .clock") ? [] : [left, top, width, height];
  }));
  assert.equal(await eventText.getAttribute("aria-live"), "polite");
  const patterns = [/^76\.0 s removed \u2013 target-0, group 1: /, /^35\.0 s handoff-completed \u2013 target-0, group 0 to 1: /];
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByPlaceholder("UAV, target, intruder").fill("target-0");
  await page.locator("#map").focus();
  await goTo(page, 78);
  const before = await boxes();
  for (const pattern of patterns) {
    await page.keyboard.press("p");
    await painted(page);
    assert.match(await eventText.textContent(), pattern);
  }
  assert.deepEqual(await boxes(), before);
  await page.keyboard.press("ArrowRight");
  await painted(page);
  assert.equal(await eventText.textContent(), "");
  const marks = await page.locator("#event-strip").boundingBox();
  await page.mouse.click(marks.x + 0.76 * marks.width, marks.y + 4);
  await painted(page);
  assert.match(await eventText.textContent(), patterns[0]);
  // During playback the text stays long enough to be read.
  await page.keyboard.press(" ");
  await pass(page, 1000);
  assert.ok((await clock(page)) > 76.5);
  assert.match(await eventText.textContent(), patterns[0]);
  await pass(page, 10_000);
  assert.equal(await eventText.textContent(), "");
});
