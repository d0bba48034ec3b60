// Commands that serve pages, and pages that are served.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after } from "node:test";

import { PATIENCE_MS, browser } from "./browser.mjs";

export const STANDOFF = process.env.STANDOFF;
assert.ok(STANDOFF, "STANDOFF names the command: start the tests with scripts/check_in_browser");
/** Where the commands write. */
export const results = mkdtempSync(join(tmpdir(), "standoff-served-"));
/** Commands that serve now: a test that fails leaves its own behind. */
const children = new Set();
after(() => {
  for (const child of children) child.kill("SIGKILL");
  rmSync(results, { recursive: true });
});

/** Starts a command that serves; gives its address and what ends it. */
export async function serving(...args) {
  const child = spawn(STANDOFF, [...args, "--no-open"], { cwd: results, stdio: ["ignore", "pipe", "pipe"] });
  children.add(child);
  const gone = new Promise((resolve) => child.on("exit", resolve));
  gone.then(() => children.delete(child));
  let said = "";
  const address = await new Promise((resolve, reject) => {
    const hear = (bytes) => {
      said += bytes;
      const found = /http:\/\/[^\s/]+/.exec(said);
      if (found) resolve(found[0]);
    };
    child.stdout.on("data", hear);
    child.stderr.on("data", hear);
    gone.then(() => reject(new Error(`it ended: ${said}`)));
  });
  const end = async () => {
    child.kill("SIGINT");
    return gone;
  };
  return { address, end };
}

/** A page that collects what it complains about; `prepare` has it before anything is fetched. */
export async function watching(address, prepare, options = {}) {
  const context = await (await browser()).newContext({ viewport: { width: 1280, height: 720 }, ...options });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("request", (request) => {
    if (!/^(blob|data):/.test(request.url()) && !request.url().startsWith(new URL(address).origin)) complaints.push(request.url());
  });
  await prepare?.(page);
  await page.goto(address);
  await page.waitForSelector("body[data-ready]");
  return { page, complaints, close: () => context.close() };
}
