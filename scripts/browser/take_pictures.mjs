// Takes the screenshots of the pages for the documentation. Usage: take_pictures.mjs RESULTS PICTURES

import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { chromium } from "playwright-core";

const [results, pictures] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  chromiumSandbox: process.getuid() !== 0,
  args: ["--disable-gpu", "--disable-background-networking"],
});

/** Opens a page, prepares it and saves a screenshot. */
async function picture(file, name, theme, arrange) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, colorScheme: theme });
  await page.goto(pathToFileURL(resolve(results, file)).href);
  await arrange(page);
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, `${name}-${theme}.png`) });
  await page.close();
}

/** Moves to a time at which the two groups are far from each other. */
async function later(page) {
  await page.waitForSelector("body[data-ready=charts]");
  for (let press = 0; press < 15; press++) await page.keyboard.press("Shift+ArrowRight");
}

/** Selects the metric with the largest difference. */
async function selectMetric(page) {
  await page.click("text=standoff error (own estimate)");
  await page.waitForSelector(".main-svg");
}

for (const theme of ["light", "dark"]) {
  await picture("run/report.html", "page", theme, later);
  await picture("compared.html", "runs", theme, selectMetric);
}
await browser.close();
