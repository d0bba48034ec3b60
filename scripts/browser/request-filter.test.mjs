// Checks a precondition of the other tests: forbidden actions of a page are detected.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { pathToFileURL } from "node:url";

import { emptyPage, closeBrowser, TIMEOUT_MS } from "./browser.mjs";

after(closeBrowser);

test("requests, errors and dialogs of a page are detected, and all requests are blocked", { timeout: TIMEOUT_MS }, async () => {
  const folder = mkdtempSync(join(tmpdir(), "standoff-"));
  const { context, page, complaints } = await emptyPage();
  try {
    const file = join(folder, "bad.html");
    writeFileSync(file, `<img src="http://127.0.0.1:9/x" onerror="alert(1); throw new Error('bad')"><script>
      new WebSocket("ws://127.0.0.1:9/");
      fetch("https://example.com/").catch(() => (document.title = "blocked"));</script>`);
    await page.goto(pathToFileURL(file).href);
    await page.waitForFunction(() => document.title === "blocked");
    for (const what of ["request: http://127.0.0.1:9/x", "request: https://example.com/", "dialog: 1", "error: bad", "socket: ", "console: "]) {
      assert.ok(complaints.some((complaint) => complaint.startsWith(what)), `${what} is among ${complaints}`);
    }
  } finally {
    await context.close();
    rmSync(folder, { recursive: true });
  }
});
