// The page that flies missions, opened from disk in Chromium without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
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

/** The metrics of missions, and the SHA-256 of the files of their records by name; workers fly one after the other. */
function flownBy(page, requests) {
  return page.evaluate(async (requests) => {
    const [engine, script] = await Promise.all(["engine", "worker"].map(unpackedPart));
    const url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    const sha256 = async (bytes) => [...new Uint8Array(await crypto.subtle.digest("SHA-256", bytes))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    /** The files of a ZIP file without compression. */
    const files = async (zip) => {
      const view = new DataView(zip.buffer, zip.byteOffset);
      const hashes = {};
      for (let at = 0; view.getUint32(at, true) === 0x04034b50; ) {
        const [size, name, extra] = [view.getUint32(at + 18, true), view.getUint16(at + 26, true), view.getUint16(at + 28, true)];
        const begin = at + 30 + name + extra;
        hashes[new TextDecoder().decode(zip.subarray(at + 30, at + 30 + name))] = await sha256(zip.slice(begin, begin + size));
        at = begin + size;
      }
      return hashes;
    };
    const all = [];
    for (const request of requests) {
      const worker = new Worker(url);
      const call = (id, call, ...values) =>
        new Promise((resolve, reject) => {
          const take = ({ data }) => {
            if (data.id !== id && !(id === 0 && data.state?.done)) return;
            worker.removeEventListener("message", take);
            if (data.error) reject(new Error(`${request.scenario}: ${data.error}`));
            else resolve(data.value);
          };
          worker.addEventListener("message", take);
          if (call) worker.postMessage({ id, call, values });
        });
      const ended = call(0);
      const given = (request.files ?? []).map(([name, text]) => [name, new TextEncoder().encode(text)]);
      await call(1, "begin", engine, given, JSON.stringify({ ...request, files: undefined, is_recorded: true }));
      await ended;
      all.push({ metrics: JSON.parse(await call(2, "metrics")), files: await files(await call(3, "record")) });
      worker.terminate();
    }
    return all;
  }, requests);
}

/** The same of a run of the command. */
function flownByCommand(...args) {
  const run = join(home, "run");
  const text = execFileSync(STANDOFF, ["run", ...args, "--json", "--out", run], { cwd: home, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
  const names = readdirSync(run).filter((name) => /^run\.json$|^scenario\.toml$|\.parquet$/.test(name));
  const sha256 = (name) => createHash("sha256").update(readFileSync(join(run, name))).digest("hex");
  return { metrics: JSON.parse(text).metrics, files: Object.fromEntries(names.map((name) => [name, sha256(name)])) };
}

test("a mission flies as soon as the page is open", async () => {
  await opened({}, async (page) => {
    await flown(page);
    assert.equal(await page.title(), "improved/figure-9, seed 1 – standoff");
  });
});

test("every built-in scenario gives the metrics and the record of the command to the last bit", async () => {
  await opened({}, async (page) => {
    const names = await page.evaluate(async () => Object.keys(JSON.parse(new TextDecoder().decode(await unpackedPart("scenarios")))));
    assert.ok(names.length > 20);
    const requests = names.flatMap((scenario) => ["1", "7000000000000000001"].map((seed) => ({ scenario, seed })));
    const all = await flownBy(page, requests);
    for (const [k, { scenario, seed }] of requests.entries()) {
      assert.deepEqual(all[k], flownByCommand(scenario, "--seed", seed), `${scenario}, seed ${seed}`);
      assert.ok(Object.keys(all[k].files).length > 8);
    }
  });
});

test("traffic in degrees gives the record of the command to the last bit", async () => {
  const row = (t, k) => `${t},car ${k},${44.5 + 0.001 * k + 0.00007 * t},${11.3 - 0.0013 * k + 0.00003 * t * k}\n`;
  const rows = Array.from({ length: 61 }, (_, t) => [0, 1, 2, 3].map((k) => row(t, k)).join(""));
  const text = `t,id,lat,lon\n${rows.join("")}`;
  writeFileSync(join(home, "degrees.csv"), text);
  const request = { scenario: "traffic/convoy", traffic: ["degrees.csv"], files: [["degrees.csv", text]], seed: "1" };
  await opened({}, async (page) => {
    const [flight] = await flownBy(page, [request]);
    assert.deepEqual(flight, flownByCommand("traffic/convoy", "--traffic", "degrees.csv"));
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
    const [flight] = await flownBy(page, [request]);
    assert.deepEqual(flight, flownByCommand("tour/04-two-groups", "--set", "radio.packet_loss=0.3"));
  });
});

test("the record is saved and can be reported", async () => {
  await opened({ scenario: "tour/02-two-uavs" }, async (page) => {
    await flown(page);
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save record" }).click()]);
    assert.equal(download.suggestedFilename(), "tour-02-two-uavs-1.zip");
    const folder = join(home, "saved");
    execFileSync("python3", ["-m", "zipfile", "-e", await download.path(), folder]);
    assert.match(execFileSync(STANDOFF, ["report", folder], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }), /custody/);
  });
});

test("a batch shows the means of the command", async () => {
  const out = join(home, "batch");
  const text = execFileSync(STANDOFF, ["monte-carlo", "tour/02-two-uavs", "--runs", "20", "--seed", "5", "--json", "--out", out], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
  const { mean, ci95 } = JSON.parse(text).metrics.standoff_error_m;
  await opened({ scenario: "tour/02-two-uavs", seed: "5" }, async (page) => {
    await flown(page);
    await page.locator("#flight summary", { hasText: "Batch" }).click();
    await page.getByRole("button", { name: "Fly the batch" }).click();
    const row = page.locator("#flight-batch tr", { has: page.getByText("standoff error", { exact: true }) });
    await row.waitFor();
    const shown = (value) => String(Number(value.toPrecision(4)));
    assert.deepEqual(await row.locator("td").allTextContents(), ["standoff error", shown(mean), `${shown(ci95[0])} to ${shown(ci95[1])}`, "m", "20"]);
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
  await opened({}, async (page) => {
    await page.locator("#flight summary", { hasText: "Other keys" }).click();
    await page.getByRole("button", { name: "Copy the built-in scenario" }).click();
    const text = page.getByLabel("Scenario file (TOML)");
    await text.fill((await text.inputValue()).replace("[uavs]", "[uavs]\nspeed_m_s = -3"));
    await page.getByRole("button", { name: "Fly", exact: true }).click();
    await page.locator("#flight-error", { hasText: /uavs\.speed_m_s/ }).waitFor();
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
