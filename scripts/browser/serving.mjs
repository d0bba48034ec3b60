// Helpers for tests of served pages: starting commands that serve, and opening their pages.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after } from "node:test";

import { TIMEOUT_MS, browser } from "./browser.mjs";

export const STANDOFF = process.env.STANDOFF;
assert.ok(STANDOFF, "STANDOFF must name the command: start the tests with scripts/check_in_browser");
/** Output folder of the commands. */
export const results = mkdtempSync(join(tmpdir(), "standoff-served-"));
/** Running commands. They are killed at the end, because failed tests do not stop theirs. */
const children = new Set();
after(() => {
  for (const child of children) child.kill("SIGKILL");
  rmSync(results, { recursive: true });
});

/** Starts a command that serves; returns its address and a function that ends it. */
export async function serving(...args) {
  const child = spawn(STANDOFF, [...args, "--no-open"], { cwd: results, stdio: ["ignore", "pipe", "pipe"] });
  children.add(child);
  const exited = new Promise((resolve) => child.on("exit", resolve));
  exited.then(() => children.delete(child));
  let output = "";
  const address = await new Promise((resolve, reject) => {
    const read = (bytes) => {
      output += bytes;
      const found = /http:\/\/[^\s/]+/.exec(output);
      if (found) resolve(found[0]);
    };
    child.stdout.on("data", read);
    child.stderr.on("data", read);
    exited.then(() => reject(new Error(`the command has ended: ${output}`)));
  });
  const end = async () => {
    child.kill("SIGINT");
    return exited;
  };
  return { address, end };
}

/** Opens a page; `complaints` collects its errors, warnings and foreign requests. `prepare` is called before navigation. */
export async function openServed(address, prepare, options = {}) {
  const context = await (await browser()).newContext({ viewport: { width: 1280, height: 720 }, ...options });
  context.setDefaultTimeout(TIMEOUT_MS);
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
