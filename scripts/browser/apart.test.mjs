// Who keeps away from whom, intruders among them, and off which zone: as a line, and in words.

import assert from "node:assert/strict";

import { camera, chosen, goTo, noteTexts, painted, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

/** What a row says of a UAV. */
const said = (page, id) => page.locator(`#uavs tr[data-id="${id}"] td[data-field="keeps_off"]`).textContent();

/** Which share of the way from one place to another, m, is drawn in the colour of an alarm. */
async function reddened(page, from, to) {
  const { x_m, y_m, px_per_m } = await camera(page);
  return page.locator("#map").evaluate((canvas, { x_m, y_m, px_per_m, from, to }) => {
    const ratio = canvas.width / canvas.clientWidth;
    const pen = canvas.getContext("2d");
    const shares = Array.from({ length: 101 }, (_, k) => 0.25 + 0.5 * (k / 100));
    const isRed = (share) => {
      const [east_m, north_m] = [0, 1].map((axis) => from[axis] + share * (to[axis] - from[axis]));
      const x = (canvas.clientWidth / 2 + (east_m - x_m) * px_per_m) * ratio;
      const y = (canvas.clientHeight / 2 - (north_m - y_m) * px_per_m) * ratio;
      // A line may lie between two pixels.
      const { data } = pen.getImageData(Math.floor(x) - 1, Math.floor(y) - 1, 3, 3);
      return Array.from({ length: 9 }, (_, k) => data.slice(4 * k, 4 * k + 3)).some(([red, green, blue]) => red > 150 && green < 110 && blue < 110);
    };
    return shares.filter(isRed).length / shares.length;
  }, { x_m, y_m, px_per_m, from, to });
}

inReport("a UAV that keeps away from another has a broken line to it, and says so", { flight: "apart" }, async (page) => {
  const record = recordOf("apart");
  await page.getByRole("tab", { name: "State" }).click();
  const avoiding = (time_s) => [...record.rows("uavs", time_s)].filter(([, uav]) => uav.avoids !== null);
  const apart_m = ([one, other]) => Math.hypot(one.x_m - other.x_m, one.y_m - other.y_m);
  const pair = (time_s, [, uav]) => [uav, record.rows("uavs", time_s).get(uav.avoids)];
  // The one who is furthest from whom it avoids: there is most of a line to see.
  const furthest = (time_s) => Math.max(0, ...avoiding(time_s).map((one) => apart_m(pair(time_s, one))));
  const time_s = record.times_s.reduce((best, time_s) => (furthest(time_s) > furthest(best) ? time_s : best));
  await goTo(page, time_s);
  for (const [id, uav] of record.rows("uavs", time_s)) {
    const words = await said(page, id);
    if (uav.avoids === null) assert.ok(!words.includes("UAV"), words);
    else assert.ok(words.includes(`UAV ${uav.avoids} (${uav.foretold_m.toFixed(0)} m foretold)`), words);
  }
  const [one, other] = avoiding(time_s).map((one) => pair(time_s, one)).sort((a, b) => apart_m(b) - apart_m(a))[0];
  const places = [one, other].map(({ x_m, y_m }) => [x_m, y_m]);
  await painted(page);
  const drawn = await reddened(page, ...places);
  assert.ok(drawn > 0.4 && drawn < 0.95, `a broken line: ${drawn} of it`);
  await page.locator("summary").click();
  await page.getByRole("checkbox", { name: "Who avoids whom" }).uncheck();
  await painted(page);
  assert.ok((await reddened(page, ...places)) < drawn / 3);
});

inReport("a UAV that a zone keeps from flying as it would says which zone", { flight: "apart" }, async (page) => {
  const record = recordOf("apart");
  await page.getByRole("tab", { name: "State" }).click();
  const kept = (time_s) => [...record.rows("uavs", time_s)].filter(([, uav]) => uav.border !== null);
  const time_s = record.times_s.find((time_s) => kept(time_s).length > 0);
  assert.ok(time_s !== undefined, "somebody flies around the field");
  await goTo(page, time_s);
  const off = new Set(kept(time_s).map(([id]) => id));
  for (const id of record.ids("uavs")) {
    assert.equal((await said(page, id)).includes("keep-out field"), off.has(id), `UAV ${id}`);
  }
});

inReport("a UAV that keeps away from an intruder has a broken line to it, and says so", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  await page.getByRole("tab", { name: "State" }).click();
  const places = (time_s, id, intruder) =>
    [record.rows("uavs", time_s).get(id), record.rows("intruders", time_s).get(intruder)].map(({ x_m, y_m }) => [x_m, y_m]);
  // Far from whom it avoids, and while nobody avoids a UAV: there is most of a line to see, and it is this one.
  const seen = record.times_s.flatMap((time_s) => {
    const uavs = [...record.rows("uavs", time_s)];
    return uavs.some(([, { avoids }]) => avoids !== null) ? []
      : uavs.filter(([, uav]) => uav.avoids_intruder !== null).map(([id, uav]) => ({ time_s, id, uav, at: places(time_s, id, uav.avoids_intruder) }));
  });
  const apart_m = ({ at: [[x_m, y_m], [x2_m, y2_m]] }) => Math.hypot(x2_m - x_m, y2_m - y_m);
  const { time_s, id, uav, at } = seen.reduce((best, one) => (apart_m(one) > apart_m(best) ? one : best));
  await goTo(page, time_s);
  const words = await said(page, id);
  assert.ok(words.includes(`intruder ${uav.avoids_intruder} (${uav.foretold_m.toFixed(0)} m foretold)`), words);
  await painted(page);
  const drawn = await reddened(page, ...at);
  assert.ok(drawn > 0.4 && drawn < 0.95, `a broken line: ${drawn} of it`);
});

/** What has to be said of how an intruder tells where it is. */
function silence(record, id, time_s) {
  const told = record.times_s.filter((at_s) => at_s <= time_s && record.rows("intruders", at_s).get(id).told);
  const ago_s = time_s - told.at(-1);
  return ago_s === 0 ? "yes" : ago_s > 30 ? "silent for more than 30 s: forgotten" : `silent for ${ago_s.toFixed(1)} s`;
}

inReport("intruders are named on the map, and a table tells what they do and whether they tell it", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  await noteTexts(page);
  await page.getByRole("tab", { name: "State" }).click();
  const tellings = new Set();
  for (const time_s of [0, 19.5, 20, 45, 50, 60]) {
    await goTo(page, time_s);
    const rows = await page.getByRole("table", { name: "Intruders" }).locator("tbody tr").evaluateAll((rows) =>
      rows.map((row) => Object.fromEntries([...row.cells].map((cell) => [cell.dataset.field, cell.textContent]))));
    const recorded = [...record.rows("intruders", time_s)];
    assert.deepEqual(rows.map((row) => row.id), recorded.map(([id]) => `${id}`));
    for (const [id, { x_m, y_m, speed_m_s }] of recorded) {
      const apart = [...record.rows("uavs", time_s)].map(([uav, row]) => [Math.hypot(row.x_m - x_m, row.y_m - y_m), uav]);
      const [distance_m, uav] = apart.sort(([a], [b]) => a - b)[0];
      agrees(rows[id].x_m, x_m, 1, `intruder ${id} east`);
      agrees(rows[id].y_m, y_m, 1, `intruder ${id} north`);
      agrees(rows[id].speed_m_s, speed_m_s, 2, `intruder ${id} speed`);
      agrees(rows[id].nearest_m.split(" ")[0], distance_m, 0, `intruder ${id} nearest`);
      assert.match(rows[id].nearest_m, new RegExp(`\\(UAV ${uav}\\)$`));
      assert.equal(rows[id].tells, silence(record, id, time_s), `intruder ${id} at ${time_s} s`);
      tellings.add(rows[id].tells.split(" ").slice(0, 3).join(" "));
    }
    assert.match(await page.getByRole("img").first().getAttribute("aria-label"), /, 2 intruders$/);
  }
  assert.deepEqual([...tellings].sort(), ["silent for 0.5", "silent for 25.5", "silent for more", "yes"]);
  await goTo(page, 45);
  const named = (await texts(page)).map(({ text }) => text);
  assert.ok(named.includes("intruder 0") && named.includes("intruder 1, silent"), `${named}`);
  await page.locator("summary").click();
  await page.getByRole("checkbox", { name: "Intruders" }).uncheck();
  assert.ok(!(await texts(page)).some(({ text }) => text.startsWith("intruder")));
});

inReport("an intruder can be chosen and found, and its events shown alone; one far away does not make the map small", { flight: "intruders" }, async (page) => {
  const record = recordOf("intruders");
  const isInView = async (id) => {
    const { x_m, y_m, px_per_m } = await camera(page);
    const { width, height } = await page.locator("#map").boundingBox();
    const at = record.rows("intruders", 0).get(id);
    return Math.abs(at.x_m - x_m) * px_per_m < width / 2 && Math.abs(at.y_m - y_m) * px_per_m < height / 2;
  };
  for (const what of ["run", "now"]) {
    await page.getByLabel("Follow").selectOption(what);
    assert.deepEqual([await isInView(0), await isInView(1)], [true, false], what);
  }
  await page.getByLabel("Find").fill("intruder 1");
  await page.keyboard.press("Enter");
  await chosen(page).getByRole("heading", { name: "Intruder 1" }).waitFor();
  assert.ok(await isInView(1), "who is looked for is brought into view");
  await page.getByRole("tab", { name: "Events" }).click();
  await page.getByLabel("only of intruder 1").check();
  const wanted = record.events.filter((event) => event.intruder === 1).length;
  assert.ok(wanted > 0 && wanted < record.events.length);
  assert.match(await page.locator("#count").textContent(), new RegExp(`^${wanted} of `));
  await page.getByLabel("only of intruder 1").uncheck();
  await page.getByLabel("Of", { exact: true }).fill("intruder 1");
  assert.match(await page.locator("#count").textContent(), new RegExp(`^${wanted} of `));
  assert.match(await page.locator("#events [role=option]").first().textContent(), /UAV \d, intruder 1: UAV \d would have come within \d+ m of intruder 1/);
});
