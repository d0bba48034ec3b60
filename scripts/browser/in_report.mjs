// Runs tests in a report.

import assert from "node:assert/strict";
import { after, test } from "node:test";

import { emptyPage, closeBrowser, open, painted, TIMEOUT_MS } from "./browser.mjs";

after(closeBrowser);

/** Defines a test in a report; the test also fails if the page has errors or makes requests. */
export function inReport(name, { flight = "figure-9", ...options }, check) {
  test(name, { timeout: 2 * TIMEOUT_MS }, async () => {
    const { context, page, complaints } = await emptyPage(options);
    try {
      await open(page, flight);
      await check(page);
      await painted(page);
      assert.deepEqual(complaints, []);
    } finally {
      await context.close();
    }
  });
}
