// Accessibility: roles and names, text alternatives, contrast, keyboard-only use, small screens.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { PHONE, TABLET, camera, emptyPage, folder, selectedCard, goTo, recordTexts, open, painted, texts } from "./browser.mjs";
import { axe, checkLayout } from "./fit.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

const THEMES = ["light", "dark"];
const DESKTOP = { viewport: { width: 1280, height: 720 } };
const FOUR_K = { viewport: { width: 3840, height: 2160 } };

async function lastTime(page) {
  return page.getByRole("slider", { name: "Time" }).evaluate((slider) => Number(slider.max));
}

test("a report in a browser that is too old names the oldest ones that work", async () => {
  const { context, page, complaints } = await emptyPage();
  await page.addInitScript(() => delete window.DecompressionStream);
  await page.goto(pathToFileURL(join(folder("figure-9"), "report.html")).href);
  await page.getByRole("heading", { name: /^This page needs a newer browser: Firefox 113/ }).waitFor();
  assert.deepEqual(complaints, []);
  await context.close();
});

for (const theme of THEMES) {
  inReport(`axe-core reports no violations in any panel: ${theme}`, { flight: "out-of-view", colorScheme: theme }, async (page) => {
    await goTo(page, 27);
    for (const name of ["Charts", "State", "Events", "Outcome"]) {
      await page.getByRole("tab", { name }).click();
      await axe(page, `${name}, ${theme}`);
    }
    await page.getByRole("tab", { name: "Charts" }).click();
    await page.getByRole("button", { name: "Panels" }).click();
    await axe(page, `panels, ${theme}`);
    await page.keyboard.press("Escape");
    await page.getByLabel("Find").fill("nowhere");
    await page.keyboard.press("Enter");
    await page.getByLabel("Find").fill("target-0");
    await page.keyboard.press("Enter");
    await selectedCard(page).waitFor();
    const map = await page.locator("#map").boundingBox();
    const view = await camera(page);
    const position = ({ x_m, y_m }) => [map.width / 2 + (x_m - view.x_m) * view.px_per_m, map.height / 2 - (y_m - view.y_m) * view.px_per_m];
    const [x, y] = [...recordOf("out-of-view").rows("uavs", 27).values()].map(position)
      .find(([x, y]) => x > 100 && x < map.width - 350 && y > 60 && y < map.height - 150);
    await page.mouse.move(map.x + x, map.y + y);
    await page.getByRole("tooltip").waitFor();
    await axe(page, `cards, ${theme}`);
    await page.getByRole("button", { name: "Legend" }).click();
    await axe(page, `legend, ${theme}`);
    await page.locator("#save-menu").click();
    await axe(page, `images, ${theme}`);
    await page.locator("#layer-menu").click();
    await page.getByRole("button", { name: "Help" }).click();
    await axe(page, `help and layers, ${theme}`);
  });
}

for (const theme of THEMES) {
  inReport(`axe-core reports no violations with one agent per UAV: ${theme}`, { flight: "agents", colorScheme: theme }, async (page) => {
    await goTo(page, 25);
    await page.getByRole("combobox", { name: "Team state" }).selectOption("2");
    for (const name of ["Charts", "State", "Events"]) {
      await page.getByRole("tab", { name }).click();
      await axe(page, `${name}, ${theme}`);
    }
  });
}

for (const theme of THEMES) {
  inReport(`axe-core reports no violations with intruders: ${theme}`, { flight: "intruders", colorScheme: theme }, async (page) => {
    await goTo(page, 45);
    for (const name of ["State", "Events"]) {
      await page.getByRole("tab", { name }).click();
      await axe(page, `${name}, ${theme}`);
    }
    await page.getByLabel("Find").fill("intruder 1");
    await page.keyboard.press("Enter");
    await selectedCard(page).waitFor();
    await axe(page, `card, ${theme}`);
  });
}

/** Contrast of two colours, as WCAG 2 defines it. */
function contrast(a, b) {
  const luminance = (colour) => {
    const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
    const [r, g, b] = [1, 3, 5].map((at) => linear(parseInt(colour.slice(at, at + 2), 16) / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

for (const theme of THEMES) {
  inReport(`text on the map and in the charts has a contrast of at least 4.5, curves of at least 3: ${theme}`, { flight: "out-of-view", colorScheme: theme }, async (page) => {
    await recordTexts(page);
    await goTo(page, 27);
    const { ground, inks, curves } = await page.evaluate(() => {
      const plots = [...document.querySelectorAll(".panel:not([hidden]) .plot")];
      const { layout } = plots[0];
      const curves = plots.flatMap(({ data }) => data.map((curve) => curve.line.color));
      return { ground: layout.plot_bgcolor, inks: [layout.font.color], curves };
    });
    const labels = await texts(page);
    for (const expected of ["N", "UAV 0", "group 1", "target-0", "out of view"]) {
      assert.ok(labels.some(({ text }) => text === expected), `${expected} is on the map`);
    }
    for (const { text, ink } of labels) assert.ok(contrast(ink, ground) >= 4.5, `${text}, ${ink}: ${contrast(ink, ground)}`);
    for (const ink of inks) assert.ok(contrast(ink, ground) >= 4.5, `${ink}: ${contrast(ink, ground)}`);
    for (const curve of curves) assert.ok(contrast(curve, ground) >= 3, `${curve}: ${contrast(curve, ground)}`);
  });
}

inReport("the theme follows the system until the user selects one, which is then stored", { colorScheme: "dark" }, async (page) => {
  const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
  const ground = async () => {
    await painted(page);
    return page.evaluate(() => {
      const map = document.getElementById("map");
      // The most frequent colour, because grid lines may be anywhere.
      const { data } = map.getContext("2d").getImageData(0, 0, map.width, map.height);
      const counts = new Map();
      for (let k = 0; k < data.length; k += 4 * 97) {
        const colour = `rgb(${data.slice(k, k + 3).join(", ")})`;
        counts.set(colour, (counts.get(colour) ?? 0) + 1);
      }
      const [[most]] = [...counts].sort(([, a], [, b]) => b - a);
      return { page: getComputedStyle(document.body).backgroundColor, map: most };
    });
  };
  const dark = await ground();
  assert.equal(await theme(), "dark");
  assert.equal(dark.map, dark.page);
  await page.emulateMedia({ colorScheme: "light" });
  await page.waitForFunction(() => document.documentElement.dataset.theme === "light");
  const light = await ground();
  assert.equal(light.map, light.page);
  assert.notEqual(light.page, dark.page);
  await page.getByRole("button", { name: "Theme" }).click();
  assert.deepEqual(await ground(), dark);
  await page.waitForFunction((colour) => document.querySelector(".panel:not([hidden]) .plot").layout.plot_bgcolor === colour, "#000000");
  await page.keyboard.press("t");
  assert.equal(await theme(), "light");
  await page.keyboard.press("t");
  await open(page, "figure-9");
  assert.equal(await theme(), "dark", "a reopened page uses the stored theme");
});

inReport("elements have roles and names, and the header and the description of the map state targets out of view", { flight: "out-of-view" }, async (page) => {
  for (const [role, name] of [["banner", ""], ["main", ""], ["contentinfo", "Time"], ["complementary", "Charts, state and events"],
    ["region", "Map"], ["tablist", "Side panel"], ["tabpanel", "Charts"], ["slider", "Time"],
    ["combobox", "Follow"], ["combobox", "Speed"], ["button", "Play"], ["button", "Ruler"]]) {
    assert.equal(await page.getByRole(role, name ? { name, exact: true } : {}).count(), 1, `${role} ${name}`);
  }
  const record = recordOf("out-of-view");
  const hidden = [...record.rows("targets", 27)].filter(([, target]) => target.in_view === false && target.group !== null);
  assert.equal(hidden.length, 1);
  const status = page.locator("#warning");
  assert.equal(await status.getAttribute("role"), "status");
  assert.equal(await status.getAttribute("aria-live"), "polite");
  const custody = page.getByRole("group", { name: "Targets at the time shown" });
  await goTo(page, 10);
  assert.equal(await status.textContent(), "");
  assert.equal(await custody.getByRole("button", { name: "none out of view" }).count(), 1);
  // Screen readers do not announce text in a region that was hidden before.
  assert.notEqual(await status.evaluate((region) => getComputedStyle(region).display), "none");
  assert.equal(await page.getByRole("img").first().getAttribute("aria-label"), "Map at 10.0 seconds: 4 UAVs, 2 groups, 7 targets, none out of view");
  await goTo(page, 27);
  assert.equal(await custody.getByRole("button", { name: "1 out of view" }).count(), 1);
  assert.equal(await status.textContent(), "", "targets are not repeated in the warnings");
  assert.equal(await page.getByRole("img").first().getAttribute("aria-label"), "Map at 27.0 seconds: 4 UAVs, 2 groups, 7 targets, 1 out of view");
  await page.getByRole("tab", { name: "State" }).click();
  for (const name of ["UAVs", "Groups", "Targets"]) assert.equal(await page.getByRole("table", { name, exact: true }).count(), 1, name);
  const rowheads = await page.getByRole("table", { name: "UAVs" }).getByRole("columnheader").allTextContents();
  assert.ok(rowheads.includes("Speed (m/s)"));
});

inReport("the keyboard reaches every control, the focus is visible, and the focus is never trapped", {}, async (page) => {
  const walk = async () => {
    const visited = [];
    for (;;) {
      await page.keyboard.press("Tab");
      const at = await page.evaluate(() => {
        const { activeElement } = document;
        if (!activeElement || activeElement === document.body) return null;
        const style = getComputedStyle(activeElement);
        const box = activeElement.getBoundingClientRect();
        return {
          id: activeElement.id || activeElement.tagName.toLowerCase(),
          ring: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
          isVisible: box.width > 0 && box.top >= 0 && box.left >= 0 && box.bottom <= innerHeight && box.right <= innerWidth,
        };
      });
      if (!at || visited.some((one) => one.id === at.id)) return visited;
      assert.ok(at.ring, `${at.id} shows the focus`);
      assert.ok(at.isVisible, `${at.id} is visible`);
      visited.push(at);
      assert.ok(visited.length < 60, "the walk ends");
    }
  };
  const names = (await walk()).map((at) => at.id);
  for (const id of ["help-button", "theme", "map", "zoom-in", "zoom-out", "last-view", "fit", "ruler", "map-legend-button", "follow", "highlighted-group", "find", "view-3d", "layer-menu", "save-menu", "tab-charts", "panel-selection", "charts-png", "charts-svg", "csv",
    "curve-uavs-0",
    "play", "step-back", "step-forward", "time", "speed"]) assert.ok(names.includes(id), `${id} is among ${names}`);
  assert.ok(!names.includes("tab-state"), "the tab list is one tab stop");
  await page.getByRole("tab", { name: "Charts" }).focus();
  for (const name of ["State", "Events", "Problems", "Outcome", "Charts", "State"]) {
    await page.keyboard.press("ArrowRight");
    assert.equal(await page.evaluate(() => document.activeElement.textContent), name);
    assert.equal(await page.getByRole("tab", { name }).getAttribute("aria-selected"), "true");
    assert.equal(await page.getByRole("tabpanel").count(), 1);
    assert.equal(await page.getByRole("tabpanel", { name }).count(), 1);
  }
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.id), "panel-state");
  await page.keyboard.press("?");
  assert.equal(await page.getByRole("dialog", { name: "Keyboard shortcuts" }).count(), 1);
  await page.keyboard.press("Escape");
  assert.equal(await page.getByRole("dialog").count(), 0);
  assert.equal(await page.evaluate(() => document.activeElement.id), "panel-state", "the focus returns to the previous element");
});

for (const [screen, flight, options] of [["1280x720", "figure-9", DESKTOP], ["a tablet", "figure-9", TABLET],
  ["1280x720, with a long name", "hostile-name", DESKTOP], ["a phone", "figure-9", PHONE], ["a phone, with a long name", "hostile-name", PHONE],
  ["a screen of 3840x2160", "figure-9", FOUR_K], ["1280x720, with one agent per UAV", "agents", DESKTOP], ["a phone, with one agent per UAV", "agents", PHONE]]) {
  inReport(`the layout fits on ${screen}: no overlap, nothing cut off, no horizontal scrolling`, { flight, ...options }, async (page) => {
    await goTo(page, await lastTime(page));
    if (options === PHONE) await page.getByRole("button", { name: "Tools" }).click();
    await page.getByRole("button", { name: "Ruler" }).click();
    for (const name of ["Charts", "State", "Events", "Outcome"]) {
      await page.getByRole("tab", { name }).click();
      await checkLayout(page, name);
    }
  });
}
