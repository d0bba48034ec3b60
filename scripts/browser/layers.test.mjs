// Layers of the map: presets, adaptation to the number of targets, and the legend.

import assert from "node:assert/strict";

import { PHONE, goTo, mapImage, painted, recordTexts, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

const drawn = async (page) => {
  await painted(page);
  return (await page.locator("#map").getAttribute("data-layers")).split(" ");
};
const preset = (page) => page.getByLabel("Preset");
const openList = (page) => page.locator("#layer-menu").click();

inReport("with 650 vehicles, \"Automatic\" hides layers and names until the map is zoomed in", { flight: "crowd-650" }, async (page) => {
  await recordTexts(page);
  await goTo(page, 15);
  const far = await drawn(page);
  for (const name of ["truth", "target-trails", "ellipses", "vectors", "trails"]) assert.ok(!far.includes(name), `${name} is hidden`);
  for (const name of ["tracks", "uavs", "desired", "views", "names"]) assert.ok(far.includes(name), `${name} is shown`);
  await openList(page);
  assert.equal(await preset(page).inputValue(), "automatic");
  assert.ok(!(await page.getByRole("checkbox", { name: "95 % ellipses" }).isChecked()), "the list shows what is drawn");
  await page.keyboard.press("Escape");
  // The selected target keeps its ellipse, its trail, its true position and its name.
  const before = await mapImage(page);
  await page.getByLabel("Find").fill("car 649");
  await page.getByLabel("Find").press("Enter");
  await painted(page);
  assert.ok((await texts(page)).some(({ text }) => text.startsWith("car 649")), "the selected target has a name");
  assert.ok((await mapImage(page)) !== before);
  await page.getByLabel("Follow").selectOption("group 0");
  for (let press = 0; press < 12; press++) await page.getByRole("button", { name: "Zoom in" }).click();
  const near = await drawn(page);
  for (const name of ["truth", "target-trails", "flown", "ellipses", "vectors", "trails"]) assert.ok(near.includes(name), `${name} is shown after zooming in`);
  await page.getByRole("button", { name: "Show all" }).click();
  assert.deepEqual((await drawn(page)).sort(), far.sort(), "the layers are hidden again");
});

inReport("presets select layers, a checkbox makes them \"Custom\", and few targets show all layers", {}, async (page) => {
  await goTo(page, 40);
  const all = await drawn(page);
  await openList(page);
  assert.deepEqual(await preset(page).locator("option").allTextContents(), ["Automatic", "Operator", "Analyst", "Everything", "Custom"]);
  await preset(page).selectOption("operator");
  const operator = await drawn(page);
  for (const name of ["truth", "ellipses", "vectors", "trails", "target-trails", "flown"]) assert.ok(!operator.includes(name), name);
  for (const name of ["tracks", "uavs", "views", "names"]) assert.ok(operator.includes(name), name);
  await preset(page).selectOption("analyst");
  const analyst = await drawn(page);
  for (const name of [...operator, "truth", "ellipses", "vectors", "flown"]) assert.ok(analyst.includes(name), name);
  await page.getByRole("checkbox", { name: "Fields of view" }).uncheck();
  assert.equal(await preset(page).inputValue(), "custom");
  assert.deepEqual(await drawn(page), analyst.filter((name) => name !== "views"), "the others stay as they were");
  await preset(page).selectOption("everything");
  assert.deepEqual(await drawn(page), all);
  assert.ok(await page.getByRole("checkbox", { name: "Fields of view" }).isChecked());
});

inReport("the legend shows the symbols of the drawn layers, can be folded, and stays as it is for the session", {}, async (page) => {
  const button = page.getByRole("button", { name: "Legend" });
  const entries = page.getByRole("list", { name: "Legend" }).getByRole("listitem");
  assert.equal(await entries.count(), 0);
  await button.click();
  await painted(page);
  assert.equal(await button.getAttribute("aria-expanded"), "true");
  const layersOf = () => entries.evaluateAll((all) => all.map((one) => one.dataset.layer));
  const before = await layersOf();
  for (const name of ["uavs", "views", "desired", "tracks", "truth", "ellipses", "vectors", "trails", "target-trails", "flown"]) assert.ok(before.includes(name), name);
  for (const name of ["zones", "intruders", "avoidance", "radio", "silence"]) assert.ok(!before.includes(name), `${name} is not in this run`);
  const blank = await entries.locator("canvas").evaluateAll((all) => all.filter((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return !data.some((value) => value > 0);
  }).length);
  assert.equal(blank, 0, "all samples are drawn");
  const samples = await entries.locator("canvas").evaluateAll((all) => all.map((canvas) => canvas.toDataURL()));
  assert.equal(new Set(samples).size, samples.length, "all samples differ");
  await openList(page);
  await preset(page).selectOption("operator");
  await painted(page);
  const operator = await layersOf();
  assert.ok(operator.includes("tracks") && !operator.includes("truth") && !operator.includes("ellipses"), `${operator}`);
  await page.reload();
  await page.waitForSelector('body[data-ready="charts"]');
  await painted(page);
  assert.ok((await entries.count()) > 5, "the legend is still open");
  await page.locator("#map").focus();
  await page.keyboard.press("k");
  assert.equal(await entries.count(), 0);
});

for (const [flight, layers] of [["agents", ["radio", "silence"]], ["intruders", ["intruders", "avoidance"]]]) {
  inReport(`the legend explains the layers of the run: ${flight}`, { flight }, async (page) => {
    await page.getByRole("button", { name: "Legend" }).click();
    await painted(page);
    const shown = await page.getByRole("list", { name: "Legend" }).getByRole("listitem").evaluateAll((all) => all.map((one) => one.dataset.layer));
    for (const name of layers) assert.ok(shown.includes(name), `${name} is among ${shown}`);
  });
}

for (const [screen, options] of [["a low window", { viewport: { width: 1280, height: 420 } }], ["a phone", PHONE]]) {
  inReport(`lists over the map do not cover the time slider on ${screen}`, options, async (page) => {
    const footer = await page.getByRole("contentinfo").boundingBox();
    await page.getByRole("button", { name: "Legend" }).click();
    await painted(page);
    const legend = await page.locator("#map-legend").boundingBox();
    if (options === PHONE) {
      assert.deepEqual(await page.locator(".tools > :visible").evaluateAll((all) => all.map(({ id }) => id)), ["tools-button"]);
      await page.getByRole("button", { name: "Tools" }).click();
    }
    await openList(page);
    await painted(page);
    const list = await page.locator("#layers").boundingBox();
    for (const [name, box] of [["legend", legend], ["list of layers", list]]) {
      assert.ok(box.y + box.height <= footer.y, `${name}: ${JSON.stringify(box)} is above ${footer.y}`);
      assert.ok(box.x >= 0 && box.x + box.width <= page.viewportSize().width, `${name}: ${JSON.stringify(box)} fits`);
    }
  });
}

inReport("only the flown orbit of the selected UAV is drawn", { flight: "crowd" }, async (page) => {
  await page.evaluate(() => {
    window.dotted = new Set();
    CanvasRenderingContext2D.prototype.stroke = new Proxy(CanvasRenderingContext2D.prototype.stroke, {
      apply(stroke, ctx, values) {
        if (String(ctx.getLineDash()) === "2,4") window.dotted.add(ctx.strokeStyle);
        return Reflect.apply(stroke, ctx, values);
      },
    });
  });
  const dotted = () => page.evaluate(() => window.dotted.size);
  await goTo(page, 60);
  await painted(page);
  assert.equal(await dotted(), 0);
  await page.evaluate(() => (location.hash = "#t=60&uav=3"));
  await page.waitForFunction(() => window.dotted.size > 0);
  assert.equal(await dotted(), 1);
});

inReport("the help opens at its top", { viewport: { width: 1280, height: 420 } }, async (page) => {
  await page.keyboard.press("?");
  const help = page.getByRole("dialog", { name: "Keyboard shortcuts" });
  await help.waitFor();
  assert.equal(await help.evaluate((dialog) => dialog.scrollTop), 0);
  assert.ok(await help.evaluate((dialog) => dialog.scrollHeight > dialog.clientHeight), "the help is longer than the window");
});

inReport("a note on the map shows that targets of the time shown are being loaded", { flight: "crowd" }, async (page) => {
  await page.evaluate(() => {
    window.notes = [];
    new MutationObserver(() => window.notes.push(document.querySelector(".loading").textContent))
      .observe(document.querySelector(".loading"), { childList: true });
  });
  const last_s = await page.getByRole("slider", { name: "Time" }).evaluate((slider) => Number(slider.max));
  await goTo(page, last_s);
  await page.waitForFunction(() => document.querySelector(".loading").textContent === "" && document.getElementById("map").dataset.targetsS !== "");
  const notes = await page.evaluate(() => window.notes);
  assert.deepEqual(notes, [`Loading targets at ${last_s.toFixed(1)} s`, ""]);
});
