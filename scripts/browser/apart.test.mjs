// Who keeps away from whom, and off which zone: as a line, and in words.

import assert from "node:assert/strict";

import { camera, goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

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
