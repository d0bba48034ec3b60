// The page that flies missions, opened from disk in Chromium without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { pathToFileURL } from "node:url";

import { TIMEOUT_MS, closeBrowser, emptyPage } from "./browser.mjs";

const { STANDOFF, STANDOFF_WEB } = process.env;
assert.ok(STANDOFF && STANDOFF_WEB, "STANDOFF and STANDOFF_WEB must be set: start the tests with scripts/check_in_browser");
const home = mkdtempSync(join(tmpdir(), "standoff-flight-"));
after(async () => {
  await closeBrowser();
  rmSync(home, { recursive: true });
});

/** Opens the page with a mission. */
async function opened(parameters, check) {
  const { context, page, complaints } = await emptyPage();
  await page.goto(`${pathToFileURL(STANDOFF_WEB).href}?${new URLSearchParams(parameters)}`);
  await check(page);
  assert.deepEqual(complaints, []);
  await context.close();
}

/** Waits until the mission has ended and its charts are drawn. */
async function flown(page) {
  await page.waitForSelector('body[data-ready="charts"]');
  await page.getByRole("tab", { name: "Outcome" }).click();
  await page.waitForFunction(() => document.querySelector("#panel-outcome td"), null, { timeout: TIMEOUT_MS });
}

/** The metrics of missions that workers fly one after the other, by scenario and seed. */
function metricsOf(page, requests) {
  return page.evaluate(async (requests) => {
    const [engine, script] = await Promise.all(["engine", "worker"].map(unpackedPart));
    const url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    const all = [];
    for (const request of requests) {
      const worker = new Worker(url);
      all.push(
        await new Promise((resolve, reject) => {
          worker.onmessage = ({ data: { id, value, error, state } }) => {
            if (error) reject(new Error(`${request.scenario}: ${error}`));
            else if (id === 2) resolve(value);
            else if (state?.done) worker.postMessage({ id: 2, call: "metrics", values: [] });
          };
          worker.postMessage({ id: 1, call: "begin", values: [engine, [], JSON.stringify(request)] });
        }),
      );
      worker.terminate();
    }
    return all;
  }, requests);
}

/** The metrics of a run of the command. */
function nativeMetrics(...args) {
  const text = execFileSync(STANDOFF, ["run", ...args, "--json", "--out", join(home, "run")], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
  return JSON.parse(text).metrics;
}

test("a mission flies as soon as the page is open", async () => {
  await opened({}, async (page) => {
    await flown(page);
    assert.equal(await page.title(), "improved/figure-9, seed 1 – standoff");
  });
});

test("every built-in scenario gives the metrics of the command to the last digit", async () => {
  await opened({}, async (page) => {
    const names = await page.evaluate(async () => new TextDecoder().decode(await unpackedPart("scenarios")).split("\n"));
    assert.ok(names.length > 20);
    const requests = names.flatMap((scenario) => ["1", "7000000000000000001"].map((seed) => ({ scenario, seed })));
    const all = await metricsOf(page, requests);
    for (const [k, { scenario, seed }] of requests.entries()) {
      assert.deepEqual(JSON.parse(all[k]), nativeMetrics(scenario, "--seed", seed), `${scenario}, seed ${seed}`);
    }
  });
});

test("a changed control flies again and is in the link, with the results of the command", async () => {
  await opened({ scenario: "tour/04-two-groups" }, async (page) => {
    await flown(page);
    await page.locator("#flight summary", { hasText: "Settings" }).click();
    await page.getByLabel("Packet loss").fill("0.3");
    await page.getByLabel("Packet loss").press("Enter");
    await page.waitForURL(/set=radio\.packet_loss%3D0\.3/);
    await flown(page);
    const request = { scenario: "tour/04-two-groups", seed: "1", set: ["radio.packet_loss=0.3"] };
    const [metrics] = await metricsOf(page, [request]);
    assert.deepEqual(JSON.parse(metrics), nativeMetrics("tour/04-two-groups", "--set", "radio.packet_loss=0.3"));
  });
});

test("errors name the key and the line, as those of the command", async () => {
  await opened({ set: "uavs.sped_m_s=3" }, async (page) => {
    const error = page.locator("#flight-error");
    await error.filter({ hasText: "uavs.sped_m_s: there is no such key" }).waitFor();
    assert.match(await error.textContent(), /did you mean `speed_m_s`/);
  });
  await opened({ scenario: "mine", text: 'duration_s = 50\n[uavs]\nspeed_m_s = "fast"\n' }, async (page) => {
    await page.locator("#flight-error", { hasText: "mine:3:" }).waitFor();
  });
  await opened({ seed: "-1" }, async (page) => {
    await page.locator("#flight-error", { hasText: "must be a whole number from 0" }).waitFor();
  });
});

test("a changed mission is compared with the scenario as it is", async () => {
  await opened({ scenario: "tour/02-two-uavs", set: "wind.speed_m_s=8", compared: "1" }, async (page) => {
    await flown(page);
    assert.equal(await page.locator(".view canvas").count(), 2);
  });
});

test("own traffic is flown, also after the page was loaded again, and stays in the browser", async () => {
  const rows = Array.from({ length: 61 }, (_, t) => `${t},<b>car,${5 * t},${2 * t}\n${t},van,${5 * t},${40 + 2 * t}\n`);
  const file = join(home, "cars.csv");
  writeFileSync(file, `t,id,x,y\n${rows.join("")}`);
  await opened({}, async (page) => {
    await flown(page);
    await page.getByLabel("Own traffic").setInputFiles(file);
    await page.waitForURL(/traffic=cars\.csv/);
    await flown(page);
    assert.equal(await page.title(), "cars, seed 1 – standoff");
    await page.reload();
    await flown(page);
    assert.equal(await page.locator("#flight-files").textContent(), "cars.csv");
  });
  await opened({ scenario: "traffic/convoy", traffic: "cars.csv" }, async (page) => {
    await page.locator("#flight-error", { hasText: "cars.csv: this browser does not have the file" }).waitFor();
  });
});
