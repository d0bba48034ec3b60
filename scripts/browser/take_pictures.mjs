// Takes the screenshots of the pages for the documentation. Usage: take_pictures.mjs RESULTS PICTURES

import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { chromium } from "playwright-core";

import { selectedCard, goTo, recordTexts } from "./browser.mjs";

const [results, pictures] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  chromiumSandbox: process.getuid() !== 0,
  // WebGL without a graphics card.
  args: ["--disable-gpu", "--enable-unsafe-swiftshader", "--disable-background-networking"],
});

/** Opens a page, prepares it and saves a screenshot of the page or of one of its parts. */
async function picture(file, name, theme, arrange, part) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, colorScheme: theme });
  await page.goto(pathToFileURL(resolve(results, file)).href);
  await arrange(page);
  await page.waitForTimeout(500);
  await (part ? page.locator(part) : page).screenshot({ path: join(pictures, `${name}.png`) });
  await page.close();
}

/** Goes to a time when the page is complete. */
async function show(page, time_s) {
  await page.waitForSelector("body[data-ready=charts]");
  await goTo(page, time_s);
}

/** Goes to the handoff. */
async function handoff(page) {
  await show(page, 33);
}

/** Goes to the handoff in three dimensions. */
async function handoffIn3d(page) {
  await handoff(page);
  await page.click("#view-3d");
  await page.waitForSelector(".view-3d[data-time-s='33.000']");
}

/** Selects a target, so that its gates are shown. */
async function gates(page) {
  await show(page, 30);
  await find(page, "target-5");
}

/** Goes to a time at which a building hides a car. */
async function behindBuildings(page) {
  await show(page, 85);
  await find(page, "target-0");
}

/** Selects an object and zooms to it. */
async function find(page, name) {
  await page.fill("#find", name);
  await page.press("#find", "Enter");
}

/** Selects the metric with the largest difference. */
async function selectMetric(page) {
  await page.click("text=standoff error (own estimate)");
  await page.waitForSelector(".main-svg");
}

/** Labels the parts of the page with the numbers of docs/user/page.md. */
async function numbered(page) {
  await handoff(page);
  await recordTexts(page);
  await find(page, "UAV 0");
  await page.click("#fit");
  await page.locator("#layer-menu").click();
  await page.waitForTimeout(500);
  const map = await page.locator("#map").boundingBox();
  const labels = await page.evaluate(() => window.texts.map);
  const label = (text) => {
    const { x, y } = labels.find((label) => label.text === text);
    return [map.x + x - 14, map.y + y - 4];
  };
  const corner = async (part) => {
    const { x, y } = await part.boundingBox();
    return [x + 2, y + 2];
  };
  const at = [
    [map.x + 24, map.y + map.height - 90], label("group 0"), label("UAV 1"), await corner(page.locator(".track")),
    await corner(page.locator("#tab-events")), await corner(page.locator("#panels")), await corner(selectedCard(page)),
    await corner(page.locator("#layers")), await corner(page.locator("#find")),
  ];
  await page.evaluate((at) => {
    at.forEach(([x, y], index) => {
      const mark = document.createElement("div");
      mark.textContent = index + 1;
      mark.style.cssText = `position: fixed; left: ${x - 11}px; top: ${y - 11}px; width: 22px; height: 22px; z-index: 99;
        border-radius: 11px; background: #cc3311; color: white; font: bold 14px/22px sans-serif; text-align: center;`;
      document.body.append(mark);
    });
  }, at);
}

for (const theme of ["light", "dark"]) {
  await picture("run/report.html", `page-${theme}`, theme, handoff);
  await picture("compared.html", `runs-${theme}`, theme, selectMetric);
}
await picture("run/report.html", "page-3d", "light", handoffIn3d);
await picture("radar/report.html", "map-detections", "light", gates, ".stage");
await picture("street/report.html", "map-buildings", "light", behindBuildings, ".stage");
await picture("run/report.html", "page-annotated", "light", numbered);
await browser.close();
