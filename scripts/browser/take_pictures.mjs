// Pictures of the pages for the documentation: `take_pictures.mjs RESULTS PICTURES`.

import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { chromium } from "playwright-core";

const [results, pictures] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  chromiumSandbox: process.getuid() !== 0,
  args: ["--disable-gpu", "--disable-background-networking"],
});

for (const theme of ["light", "dark"]) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, colorScheme: theme });
  await page.goto(pathToFileURL(resolve(results, "run/report.html")).href);
  await page.waitForSelector("body[data-ready=charts]");
  await page.evaluate(() => document.getElementById("map").focus());
  for (let press = 0; press < 4; press++) await page.keyboard.press("Shift+ArrowRight");
  await page.keyboard.press("0");
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(pictures, `page-${theme}.png`) });
  await page.close();
}
await browser.close();
