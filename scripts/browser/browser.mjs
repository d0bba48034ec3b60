// Helpers for tests in Chromium, or in Firefox if $FIREFOX is its path: opening reports from disk without network access, and reading the page.

import assert from "node:assert/strict";
import { existsSync, mkdtempSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as pause } from "node:timers/promises";
import { pathToFileURL } from "node:url";

import { chromium, firefox } from "playwright-core";

const FLIGHTS = process.env.STANDOFF_FLIGHTS;
const { CHROMIUM, FIREFOX } = process.env;
assert.ok(FLIGHTS && CHROMIUM, "STANDOFF_FLIGHTS and CHROMIUM must be set: start the tests with scripts/check_in_browser");

/** Timeout of browser operations on a busy machine, ms. */
export const TIMEOUT_MS = 60_000;

export const TABLET = { viewport: { width: 820, height: 1180 }, hasTouch: true, isMobile: true };
export const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

/** The folder of a run. */
export function folder(flight) {
  const path = join(FLIGHTS, flight);
  assert.ok(existsSync(path), `${path}: no such run; scripts/check_in_browser creates it`);
  return path;
}

let launched;
/** Folder in which Firefox saves files. */
let downloads;

/** Returns the browser, which is launched once. */
export function browser() {
  launched ??= FIREFOX ? launchFirefox() : chromium.launch({
    executablePath: CHROMIUM,
    chromiumSandbox: process.getuid() !== 0,
    // WebGL without a graphics card.
    args: ["--disable-gpu", "--enable-unsafe-swiftshader", "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"],
  });
  return launched;
}

function launchFirefox() {
  downloads = mkdtempSync(join(tmpdir(), "standoff-downloads-"));
  return firefox.launch({ channel: "moz-firefox", executablePath: FIREFOX, downloadsPath: downloads });
}

/** Closes the browser. */
export async function closeBrowser() {
  await (await launched)?.close();
  if (downloads) rmSync(downloads, { recursive: true, force: true });
}

/** The name and the path of the file that the page saves when `begin` is called. */
export async function downloaded(page, begin) {
  if (!FIREFOX) {
    const [download] = await Promise.all([page.waitForEvent("download"), begin()]);
    return { name: download.suggestedFilename(), path: await download.path() };
  }
  // Playwright announces no downloads of Firefox.
  const files = () => readdirSync(downloads, { recursive: true, withFileTypes: true }).filter((file) => file.isFile());
  const before = files().length;
  await begin();
  for (const deadline = Date.now() + TIMEOUT_MS; files().length === before || files().some(({ name }) => name.endsWith(".part")); await pause(100)) {
    assert.ok(Date.now() < deadline, "Firefox saved no file");
  }
  const { name, parentPath } = files().at(-1);
  return { name, path: join(parentPath, name) };
}

/** Opens an empty page; `complaints` collects everything that a report must not do: errors, requests, dialogs, new windows. */
export async function emptyPage(options = {}) {
  const context = await (await browser()).newContext({ viewport: { width: 1280, height: 720 }, ...options });
  context.setDefaultTimeout(TIMEOUT_MS);
  await context.setOffline(true);
  const page = await context.newPage();
  const complaints = [];
  page.on("console", (message) => {
    if (message.type() === "error") complaints.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => complaints.push(`error: ${error.message}`));
  page.on("dialog", (dialog) => {
    complaints.push(`dialog: ${dialog.message()}`);
    dialog.dismiss();
  });
  page.on("websocket", (socket) => complaints.push(`socket: ${socket.url()}`));
  page.on("popup", (popup) => complaints.push(`window: ${popup.url()}`));
  page.on("request", (request) => {
    if (!/^(file|blob|data):/.test(request.url())) complaints.push(`request: ${request.url()}`);
  });
  return { context, page, complaints };
}

/** Opens the report of a run from disk. */
export async function open(page, flight, ready = "charts") {
  await page.goto(pathToFileURL(join(folder(flight), "report.html")).href);
  const selector = ready === "map" ? '[data-ready]' : `[data-ready="${ready}"]`;
  await page.waitForSelector(`body${selector}`);
  await page.waitForSelector("body[data-frames]");
}

/** Waits until all requested changes are drawn. */
export async function painted(page) {
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => resolve()))));
}

/** Waits until the map no longer moves: it follows the objects over several frames. */
export async function settled(page) {
  let before = "";
  for (let look = 0; look < 100; look++) {
    const now = JSON.stringify(await camera(page));
    if (now === before) return;
    before = now;
  }
  throw new Error("the map moves all the time");
}

/** The time shown by the clock, s. */
export async function clock(page) {
  return page.locator("#clock").evaluate((clock) => Number(clock.dateTime.slice(2, -1)));
}

/** Goes to a time by means of the slider. */
export async function goTo(page, time_s) {
  await page.locator("#time").evaluate((slider, time_s) => {
    slider.value = time_s;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  }, time_s);
  await page.waitForFunction((shown) => document.getElementById("clock").dateTime === shown, `PT${time_s.toFixed(3)}S`);
}

/** The view of the map: its centre, m, and its scale, px per m. */
export async function camera(page) {
  await painted(page);
  return page.locator("#map").evaluate(({ dataset }) => ({
    x_m: Number(dataset.eastM),
    y_m: Number(dataset.northM),
    px_per_m: Number(dataset.pxPerM),
  }));
}

/** The pixels of the map as a data URL. */
export async function mapImage(page) {
  await painted(page);
  return page.locator("#map").evaluate((canvas) => canvas.toDataURL());
}

/** The card of the selected object. */
export const selectedCard = (page) => page.getByRole("region", { name: "Selected object" });

/** Starts recording the texts drawn on canvases: for the map those of the last frame, for other canvases all. */
export async function recordTexts(page) {
  await page.evaluate(() => {
    const prototype = CanvasRenderingContext2D.prototype;
    const { fillText, fillRect } = prototype;
    window.texts = { map: [], elsewhere: [] };
    // Each frame of the map begins by filling the background.
    prototype.fillRect = function (...box) {
      if (this.canvas.id === "map") window.texts.map = [];
      return fillRect.apply(this, box);
    };
    prototype.fillText = function (text, x, y, ...rest) {
      const { width } = this.measureText(text);
      window.texts[this.canvas.id === "map" ? "map" : "elsewhere"].push({ text, x, y, width, ink: this.fillStyle });
      return fillText.call(this, text, x, y, ...rest);
    };
  });
}

/** The texts in the last frame of the map (`elsewhere`: on other canvases), with position, width and colour. */
export async function texts(page, where = "map") {
  await painted(page);
  return page.evaluate((where) => window.texts[where], where);
}
