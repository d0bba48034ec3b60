// Time: playing, scrubbing, speeds.

import assert from "node:assert/strict";

import { clock, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

/** Lets time pass in the page alone, so that a busy machine changes nothing. */
async function pass(page, ms) {
  await page.clock.runFor(ms);
}

inReport("a report opens from disk with its title, a first picture and charts", {}, async (page) => {
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

inReport("playing moves time on at the chosen speed, and pauses at the end", {}, async (page) => {
  await page.clock.install();
  for (const speed of ["0.25", "1", "4", "32"]) {
    await page.getByLabel("Speed").selectOption(speed);
    await goTo(page, 10);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await pass(page, 1000);
    const playing = await clock(page);
    await page.getByRole("button", { name: "Pause" }).click();
    await pass(page, 1000);
    // A picture more or less, and the tables' fifth of a second.
    assert.ok(Math.abs(playing - 10 - Number(speed)) <= 0.25 * Number(speed), `at ${speed}x a second shows ${playing - 10} s`);
    const paused = await clock(page);
    await pass(page, 1000);
    assert.equal(await clock(page), paused, "paused time stands still");
  }
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await pass(page, 5000);
  assert.equal(await clock(page), 100);
  assert.equal(await page.locator("#play").textContent(), "Play");
  assert.equal(await page.locator("#play").getAttribute("aria-pressed"), "false");
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await pass(page, 300);
  assert.ok((await clock(page)) < 100, "played again, it starts anew");
});

inReport("the slider, the arrows and their buttons scrub", {}, async (page) => {
  const slider = page.getByRole("slider", { name: "Time" });
  const box = await slider.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await painted(page);
  assert.ok(Math.abs((await clock(page)) - 50) < 0.5, "a click in the middle is half-time");
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
  await page.getByRole("button", { name: "Instant back" }).click();
  await at(99.5, "an instant back");
  await page.getByRole("button", { name: "Instant on" }).click();
  await at(100, "an instant on");
  await goTo(page, 33.3);
  await page.keyboard.press("ArrowRight");
  await at(33.5, "from between two instants to the next");
});

inReport("keys play, change the speed and go from event to event, also while the slider has the focus", {}, async (page) => {
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

inReport("space plays wherever a click has left the focus, and enter presses a button reached by keys", {}, async (page) => {
  const isPlaying = async () => (await page.locator("#play").getAttribute("aria-pressed")) === "true";
  const spacePlays = async (what) => {
    for (const wanted of [!(await isPlaying()), await isPlaying()]) {
      await page.keyboard.press(" ");
      await painted(page);
      assert.equal(await isPlaying(), wanted, `space after ${what}`);
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
      // A chart's own buttons are plotly's; a picture of a chart is saved by others' tests.
      if (id === "png" || id === "csv") continue;
      await control.click();
      if (await page.getByRole("dialog").count()) await page.keyboard.press("Escape");
      if (await isPlaying()) await page.locator("#play").click();
      await spacePlays(id);
      if (await page.locator(":popover-open").count()) await page.keyboard.press("Escape");
    }
  }
  for (const id of ["play", "back", "on", "fit", "ruler", "zoom-in", "theme", "keys", "link", "time", "routine"]) {
    assert.ok(clicked.has(id), `${id} is among ${[...clicked]}`);
  }
  // By keys: space plays on a button, too; enter presses it; a checkbox, a list and a field keep the key.
  await page.getByRole("tab", { name: "Events" }).click();
  await goTo(page, 10);
  await page.locator("#on").focus();
  await spacePlays("a button that has the focus");
  const from_s = await clock(page);
  await page.keyboard.press("Enter");
  await painted(page);
  assert.ok((await clock(page)) > from_s, "enter presses it");
  await page.locator("#routine").focus();
  const was = await page.locator("#routine").isChecked();
  await page.keyboard.press(" ");
  assert.equal(await page.locator("#routine").isChecked(), !was);
  await page.getByPlaceholder("UAV or target").focus();
  await page.keyboard.type("UAV 1");
  assert.equal(await page.getByPlaceholder("UAV or target").inputValue(), "UAV 1");
  assert.equal(await isPlaying(), false);
});

inReport("the text of the event gone to stands beside the strip until time moves on, and shifts nothing", {}, async (page) => {
  await page.clock.install();
  const told = page.locator("#told-event");
  const boxes = () => page.evaluate(() => [...document.querySelectorAll("footer, footer *, #map")].filter((one) => one.id !== "now").map((one) => {
    const { left, top, width, height } = one.getBoundingClientRect();
    return one.closest("#tip, .clock") ? [] : [left, top, width, height];
  }));
  assert.equal(await told.getAttribute("aria-live"), "polite");
  const words = [/^76\.0 s discarded \u2013 target-1, group 1: /, /^35\.0 s handoff-completed \u2013 target-1, group 0 to 1: /];
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByPlaceholder("UAV or target").fill("target-1");
  await page.locator("#map").focus();
  await goTo(page, 78);
  const before = await boxes();
  for (const wanted of words) {
    await page.keyboard.press("p");
    await painted(page);
    assert.match(await told.textContent(), wanted);
  }
  assert.deepEqual(await boxes(), before);
  await page.keyboard.press("ArrowRight");
  await painted(page);
  assert.equal(await told.textContent(), "");
  const marks = await page.locator("#marks").boundingBox();
  await page.mouse.click(marks.x + 0.76 * marks.width, marks.y + 4);
  await painted(page);
  assert.match(await told.textContent(), words[0]);
  // While time runs on there is time to read.
  await page.keyboard.press(" ");
  await pass(page, 1000);
  assert.ok((await clock(page)) > 76.5);
  assert.match(await told.textContent(), words[0]);
  await pass(page, 10_000);
  assert.equal(await told.textContent(), "");
});
