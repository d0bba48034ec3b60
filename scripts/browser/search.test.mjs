// Finding objects by name, highlighting one group, and exporting the map and the state.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { camera, downloaded, emptyPage, goTo, open, painted, recordTexts, selectedCard, texts, TIMEOUT_MS } from "./browser.mjs";
import { NAMES } from "./hostile.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

inReport("searching for a target, UAV or group selects it and shows it with 300 m around it", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await page.locator("#map").focus();
  const find = page.getByLabel("Find");
  for (const [query, table, id] of [["target-4", "targets", record.names.indexOf("target-4")], ["UAV 2", "uavs", 2], ["GROUP 1", "groups", 1],
    ["get-2", "targets", record.names.indexOf("target-2")]]) {
    await page.keyboard.press("/");
    assert.equal(await page.evaluate(() => document.activeElement.id), "find");
    await find.fill("");
    await page.keyboard.type(query);
    await page.keyboard.press("Enter");
    const { x_m, y_m } = record.rows(table, 40).get(id);
    const view = await camera(page);
    // The middle of the map below the toolbar.
    const { width, height, top } = await page.locator("#map").evaluate((map) => {
      const tools = document.querySelector(".tools");
      return { width: map.clientWidth, height: map.clientHeight, top: tools.offsetTop + tools.offsetHeight };
    });
    const north_m = view.y_m - top / 2 / view.px_per_m;
    assert.ok(Math.hypot(view.x_m - x_m, north_m - y_m) < 0.01, query);
    const around_m = Math.min(width, height - top) / 2 / view.px_per_m;
    const expected_m = Math.max(300, record.rows(table, 40).get(id).standoff_distance_m ?? 0);
    assert.ok(Math.abs(around_m - expected_m) < 1, `${query}: ${around_m} m around it`);
    assert.equal((await selectedCard(page).getByRole("heading").textContent()).toLowerCase(), query.replace("get-2", "target-2").toLowerCase());
    await page.keyboard.press("Escape");
    assert.equal(await page.evaluate(() => document.activeElement.id), "map");
  }
  await page.keyboard.press("/");
  await page.keyboard.type("zeppelin");
  assert.equal(await page.locator("#search-result").textContent(), "no match");
  await page.keyboard.press("Enter");
  assert.equal(await page.locator("#search-result").textContent(), "no match");
  // Letter keys in the field are text, not shortcuts.
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "light");
  await find.fill("target");
  assert.equal(await page.locator("#search-names option").count(), record.names.length);
});

inReport("hostile names can be found, are shown as text, and at most 20 are proposed", { flight: "hostile" }, async (page) => {
  const find = page.getByLabel("Find");
  for (const name of NAMES) {
    await find.fill(name.slice(0, 12).replace(/[\u0000-\u001f\u202e]/g, "\ufffd"));
    const proposed = await page.locator("#search-names option").evaluateAll((all) => all.map((one) => one.value));
    assert.ok(proposed.length >= 1 && proposed.length <= 20, `${name}: ${proposed}`);
    await find.press("Enter");
    assert.equal(await selectedCard(page).count(), 1, name);
    assert.equal(await page.locator("img").count(), 0);
  }
});

inReport("a highlighted group: other objects are faint on the map and not in the table of targets", { flight: "out-of-view" }, async (page) => {
  const record = recordOf("out-of-view");
  await recordTexts(page);
  await page.getByRole("tab", { name: "State" }).click();
  await goTo(page, 27);
  const rows = record.rows("targets", 27);
  const only = page.getByRole("combobox", { name: "Group" });
  const listed = () => page.locator("#targets tbody tr").evaluateAll((all) => all.map((row) => Number(row.dataset.id)).sort((a, b) => a - b));
  assert.deepEqual(await only.locator("option").allTextContents(), ["all", ...record.ids("groups").map((id) => `group ${id}`), "ungrouped"]);
  for (const [option, group] of [["group 0", 0], ["group 1", 1], ["ungrouped", null]]) {
    await only.selectOption(option);
    await painted(page);
    assert.deepEqual(await listed(), [...rows].filter(([, target]) => target.group === group).map(([id]) => id), option);
    const labels = (await texts(page)).map(({ text }) => text).filter((text) => text.startsWith("group "));
    assert.deepEqual(labels, group === null ? [] : [option]);
  }
  await only.selectOption("all");
  await painted(page);
  assert.equal((await listed()).length, rows.size);
});

/** Clicks a button and returns the file that it downloads. */
async function download(page, name) {
  const file = await downloaded(page, () => page.getByRole("button", { name }).click());
  return { name: file.name, contents: readFileSync(file.path) };
}

inReport("the state at a time step can be saved as CSV", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await page.getByRole("tab", { name: "State" }).click();
  const { name, contents } = await download(page, "Save CSV");
  assert.match(name, /^paper-figure-9-seed-1-state-40\.0s\.csv$/);
  const [head, ...lines] = contents.toString().trim().split("\n").map((line) => line.split(","));
  const rows = lines.map((line) => Object.fromEntries(head.map((column, k) => [column, line[k]])));
  for (const [table, kind] of [["uavs", "uav"], ["groups", "group"], ["targets", "target"]]) {
    const recorded = record.rows(table, 40);
    const saved = rows.filter((row) => row.kind === kind);
    assert.deepEqual(saved.map((row) => Number(row.id)), [...recorded.keys()]);
    for (const row of saved) {
      const one = recorded.get(Number(row.id));
      assert.equal(row.time_s, "40");
      for (const column of ["x_m", "speed_m_s", "standoff_error_m", "members", "spread_m", "true_y_m", "error_m"]) {
        if (one[column] === undefined) assert.equal(row[column], "");
        else assert.ok(Math.abs(Number(row[column]) - one[column]) <= 1e-4 * Math.max(1, Math.abs(one[column])), `${kind} ${row.id}, ${column}`);
      }
    }
  }
});

inReport("names in a CSV file are not formulas", { flight: "hostile" }, async (page) => {
  await page.getByRole("tab", { name: "State" }).click();
  const { contents } = await download(page, "Save CSV");
  assert.match(contents.toString(), /,'=HYPERLINK\(1\),/);
  assert.match(contents.toString(), /,"""onmouseover=""alert\(1\)",/);
});

inReport("the map can be saved as PNG with scale, time and the name of the run", { deviceScaleFactor: 2 }, async (page) => {
  await goTo(page, 40);
  await page.locator("#layer-menu").click();
  await page.getByLabel("Grid and scale").uncheck();
  await recordTexts(page);
  await page.locator("#save-menu").click();
  const { name, contents } = await download(page, "Image (PNG)");
  assert.equal(name, "paper-figure-9-seed-1-map-40.0-s.png");
  assert.equal(contents.toString("latin1", 1, 4), "PNG");
  const canvas = await page.locator("#map").evaluate(({ width, height }) => [width, height]);
  assert.equal(contents.readUInt32BE(16), 2 * canvas[0], "twice the resolution of the screen");
  assert.ok(contents.readUInt32BE(20) > 2 * canvas[1], "the text is below the map");
  const labels = (await texts(page, "elsewhere")).map(({ text }) => text);
  for (const pattern of [/^paper\/figure-9, seed 1$/, /^40\.0 s$/, /^\d+ m$/, /^N$/, /^UAV, nose along its heading$/]) {
    assert.ok(labels.some((text) => pattern.test(text)), `${pattern}: ${labels}`);
  }
});

for (const flight of ["figure-9", "city", "hostile", "intruders", "agents"]) {
  inReport(`the map can be saved as SVG with its legend: ${flight}`, { flight }, async (page) => {
    await goTo(page, 15);
    await page.locator("#save-menu").click();
    const { name, contents } = await download(page, "Vector graphic (SVG)");
    assert.match(name, /-map-15\.0-s\.svg$/);
    const text = contents.toString();
    assert.doesNotMatch(text, /NaN|undefined|Infinity/);
    const { error, texts, kinds, links } = await page.evaluate((text) => {
      const file = new DOMParser().parseFromString(text, "image/svg+xml");
      const all = [...file.documentElement.querySelectorAll("*")];
      return {
        error: file.querySelector("parsererror")?.textContent ?? "",
        texts: all.filter(({ tagName }) => tagName === "text").map((one) => one.textContent),
        kinds: [...new Set(all.map(({ tagName }) => tagName))].sort(),
        links: all.flatMap((one) => [...one.attributes]).filter(({ name }) => /href|^on/.test(name)).length,
      };
    }, text);
    assert.equal(error, "");
    assert.deepEqual(kinds, ["clipPath", "path", "rect", "text"]);
    assert.equal(links, 0, "the file refers to nothing");
    for (const expected of ["15.0 s", "N", "UAV 0", "UAV, nose along its heading"]) assert.ok(texts.includes(expected), `${expected} is among ${texts}`);
  });
}

/** Firefox records no MP4, and Safari before 18.4 no WebM. */
test("a video has the type and the name of what the browser records", { timeout: 2 * TIMEOUT_MS }, async () => {
  for (const [types, label, ending] of [[["video/mp4", "video/webm"], "Video (MP4)", "mp4"], [["video/webm"], "Video (WebM)", "webm"], [[], null]]) {
    const { context, page, complaints } = await emptyPage();
    await page.addInitScript((types) => {
      MediaRecorder.isTypeSupported = (type) => types.includes(type);
      window.recorded = [];
      const Recorder = MediaRecorder;
      window.MediaRecorder = class extends EventTarget {
        static isTypeSupported = Recorder.isTypeSupported;
        constructor(stream, { mimeType }) {
          super();
          window.recorded.push(mimeType);
        }
        start() {}
        stop() {
          this.dispatchEvent(Object.assign(new Event("dataavailable"), { data: new Blob(["recorded"]) }));
          this.dispatchEvent(new Event("stop"));
        }
      };
    }, types);
    await open(page, "figure-9");
    await page.locator("#save-menu").click();
    const button = page.locator("#map-video");
    assert.equal(await button.isVisible(), label !== null);
    if (label) {
      assert.equal(await button.textContent(), label);
      await button.click();
      const file = await downloaded(page, () => button.click());
      assert.equal(file.name.split(".").at(-1), ending);
      assert.equal(readFileSync(file.path, "utf8"), "recorded");
      assert.deepEqual(await page.evaluate(() => window.recorded), types.slice(0, 1));
    }
    assert.deepEqual(complaints, []);
    await context.close();
  }
});

inReport("a video of the map covers the time range of the charts", {}, async (page) => {
  await goTo(page, 40);
  await page.getByLabel("Speed").selectOption("32");
  await page.locator("#save-menu").click();
  const button = page.locator("#map-video");
  const file = await downloaded(page, async () => {
    await button.click();
    assert.equal(await button.textContent(), "Stop video");
  });
  assert.equal(file.name, "paper-figure-9-seed-1-map-40.0-s.mp4");
  assert.equal(await button.textContent(), "Video (MP4)");
  assert.equal(await page.getByRole("button", { name: "Play", exact: true }).count(), 1, "the run is paused at its end");
  const bytes = readFileSync(file.path);
  assert.equal(bytes.toString("latin1", 4, 8), "ftyp", "the file begins as MP4 files do");
  // The browser plays it: its size is that of the map with the caption, and its pictures differ.
  // A report may not play it.
  const player = await page.context().newPage();
  const { width, height, pictures } = await player.evaluate(async (base64) => {
    const video = document.createElement("video");
    video.muted = true;
    video.src = URL.createObjectURL(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))], { type: "video/mp4" }));
    const canvas = document.createElement("canvas");
    const pictures = new Set();
    const ended = new Promise((resolve, reject) => {
      video.addEventListener("ended", resolve);
      video.addEventListener("error", () => reject(new Error(video.error.message)));
    });
    const look = () => {
      [canvas.width, canvas.height] = [video.videoWidth, video.videoHeight];
      canvas.getContext("2d").drawImage(video, 0, 0);
      pictures.add(canvas.toDataURL());
      video.requestVideoFrameCallback(look);
    };
    video.requestVideoFrameCallback(look);
    await video.play();
    await ended;
    return { width: video.videoWidth, height: video.videoHeight, pictures: pictures.size };
  }, bytes.toString("base64"));
  const map = await page.locator("#map").evaluate(({ clientWidth, clientHeight }) => [clientWidth, clientHeight]);
  assert.ok(Math.abs(width - map[0]) <= 2 && height > map[1] + 20, `${width} x ${height}, the map has ${map}`);
  assert.ok(pictures > 1, `${pictures} pictures`);
});
