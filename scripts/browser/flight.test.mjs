// The page that flies missions, opened from disk in Chromium or Firefox without network access.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { pathToFileURL } from "node:url";
import { gzipSync } from "node:zlib";

import { TIMEOUT_MS, closeBrowser, downloaded, emptyPage, folder } from "./browser.mjs";
import { openServed, serving } from "./serving.mjs";

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
      const given = (request.files ?? []).map(([name, base64]) => [name, Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]);
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

/** Traffic and maps of the kinds that people have, each a list of files with their contents. */
function ownTraffic() {
  const times = Array.from({ length: 61 }, (_, t) => t);
  const each = (count, text) => Array.from({ length: count }, (_, k) => text(k)).join("");
  const place = (t, k) => [44.5 + 0.001 * k + 0.00007 * t, 11.3 - 0.0013 * k + 0.00003 * t * k];
  const degrees = times.map((t) => each(4, (k) => `${t},car ${k},${place(t, k).join()}\n`));
  const point = (t, k) => `<trkpt lat="${place(t, k)[0]}" lon="${place(t, k)[1]}"><time>2026-07-01T10:00:${String(t).padStart(2, "0")}Z</time></trkpt>`;
  const tracks = each(3, (k) => `<trk><name>van ${k}</name><trkseg>${times.slice(0, 60).map((t) => point(t, k)).join("")}</trkseg></trk>`);
  const vehicle = (t, k) => `<vehicle id="v${k}" x="${(100 * (k % 25) + 7 * t).toFixed(2)}" y="${100 * Math.floor(k / 25)}" angle="90" speed="7"/>`;
  const fcd = times.slice(0, 31).map((t) => `<timestep time="${t}">${each(500, (k) => vehicle(t, k))}</timestep>`);
  const lane = '<edge id="a" from="b" to="c"><lane id="a_0" index="0" speed="14" length="900" shape="0,0 900,0"/></edge>';
  const net = (location) => `<net version="1.20"><location ${location}/>${lane}</net>`;
  const utm = 'netOffset="-679000,-4928000" convBoundary="0,0,900,900" origBoundary="11,44,12,45" projParameter="+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"';
  const plain = 'netOffset="0,0" convBoundary="0,0,900,900" origBoundary="0,0,900,900" projParameter="!"';
  return [
    [["degrees.csv", `t,id,lat,lon\n${degrees.join("")}`]],
    [["degrees.csv", `t,id,lat,lon\n${degrees.join("")}`], ["utm.net.xml", net(utm)]],
    [["walk.gpx", `<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">${tracks}</gpx>`]],
    [["fcd.xml.gz", gzipSync(`<fcd-export>${fcd.join("")}</fcd-export>`)], ["town.net.xml.gz", gzipSync(net(plain))]],
    [["fcd.parquet", readFileSync(join(folder("."), "fcd.parquet"))]],
  ];
}

test("traffic of every format gives the record of the command to the last bit", async () => {
  const all = ownTraffic();
  const requests = all.map((files) => {
    files.forEach(([name, contents]) => writeFileSync(join(home, name), contents));
    const [traffic, ...maps] = files.map(([name]) => name);
    const given = files.map(([name, contents]) => [name, Buffer.from(contents).toString("base64")]);
    return { scenario: "traffic/convoy", traffic: [traffic], maps, files: given, seed: "1" };
  });
  await opened({}, async (page) => {
    for (const [k, flight] of (await flownBy(page, requests)).entries()) {
      const { traffic, maps } = requests[k];
      const map = maps.flatMap((name) => ["--map", name]);
      assert.deepEqual(flight, flownByCommand("traffic/convoy", "--traffic", ...traffic, ...map), traffic[0]);
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
    const [flight] = await flownBy(page, [request]);
    assert.deepEqual(flight, flownByCommand("tour/04-two-groups", "--set", "radio.packet_loss=0.3"));
  });
});

test("empty controls show the values of the scenario", async () => {
  await opened({ scenario: "traffic/town", set: "sensor.range_sd_m=3" }, async (page) => {
    await flown(page);
    await page.locator("#flight summary", { hasText: "Settings" }).click();
    assert.equal(await page.getByLabel("Range noise").inputValue(), "3");
    assert.equal(await page.getByLabel("Bearing noise").getAttribute("placeholder"), "3");
    assert.equal(await page.getByLabel("Packet loss").getAttribute("placeholder"), "none");
    assert.match(await page.getByTitle("world", { exact: true }).locator("option").first().textContent(), /^\d+ buildings \(scenario\)$/);
    await page.getByTitle("guidance.law", { exact: true }).selectOption("oh-2015 (the paper's)");
    await page.waitForURL(/guidance\.law%3D%22oh-2015%22/);
    await flown(page);
    await page.locator("#flight summary", { hasText: "Settings" }).click();
    await page.getByTitle("world", { exact: true }).selectOption("none");
    await page.waitForURL(/world%3D%7B%7D/);
    await flown(page);
  });
});

test("the page is served by standoff view", async () => {
  const view = await serving("view", STANDOFF_WEB);
  const { page, complaints, close } = await openServed(`${view.address}/?scenario=tour/02-two-uavs`);
  await flown(page);
  assert.equal(await page.title(), "tour/02-two-uavs, seed 1 – standoff");
  assert.deepEqual(complaints, []);
  await close();
  await view.end();
});

test("the missions of the book fly", async () => {
  const docs = new URL("../../docs/", import.meta.url);
  const pages = readdirSync(docs, { recursive: true }).filter((name) => name.endsWith(".md"));
  const missions = pages.flatMap((name) => [...readFileSync(new URL(name, docs), "utf8").matchAll(/data-mission="([^"]*)"/g)]);
  assert.ok(missions.length > 5);
  for (const [, mission] of missions) await opened(mission.replaceAll("&amp;", "&"), flown);
});

test("the record is saved and can be reported", async () => {
  await opened({ scenario: "tour/02-two-uavs" }, async (page) => {
    await flown(page);
    const { name, path } = await downloaded(page, () => page.getByRole("button", { name: "Save record" }).click());
    assert.equal(name, "tour-02-two-uavs-1.zip");
    const saved = join(home, "saved");
    execFileSync("python3", ["-m", "zipfile", "-e", path, saved]);
    assert.match(execFileSync(STANDOFF, ["report", saved], { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }), /custody/);
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
    const shown = (value) => value.toFixed(value < 10 ? 3 : 2);
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
    await page.getByLabel("Own files").setInputFiles(file);
    await page.waitForURL(/traffic=cars\.csv/);
    await flown(page);
    assert.equal(await page.title(), "cars, seed 1 – standoff");
    await page.reload();
    await flown(page);
    assert.equal(await page.locator("#flight-files").textContent(), "cars.csv");
  });
  // A scenario file with traffic, named like the command names them.
  const scenario = join(home, "mine.toml");
  writeFileSync(scenario, 'duration_s = 30\nuavs.count = 2\ntraffic.file = "cars.csv"\n');
  await opened({}, async (page) => {
    await flown(page);
    await page.getByLabel("Own files").setInputFiles(scenario);
    await page.locator("#flight-error", { hasText: "cars.csv: cannot be read: drop this file on the page, too" }).waitFor();
    await page.getByLabel("Own files").setInputFiles(file);
    await flown(page);
    assert.equal(await page.title(), "mine, seed 1 – standoff");
  });
  await opened({ scenario: "traffic/convoy", traffic: "cars.csv" }, async (page) => {
    await page.locator("#flight-error", { hasText: "cars.csv: this browser does not have the file" }).waitFor();
  });
});
