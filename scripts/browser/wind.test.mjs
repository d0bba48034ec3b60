// Wind: the arrow on the map, the noses of the UAVs, and the rows of a UAV's card.

import assert from "node:assert/strict";

import { goTo, mapImage, painted, recordTexts, selectedCard, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

/** Compass direction of an angle, anticlockwise from east, as three digits. */
const compass = (angle_rad) => `${Math.round(450 - (angle_rad * 180) / Math.PI) % 360}`.padStart(3, "0");

inReport("the card of a UAV in wind distinguishes course from heading, and ground speed from airspeed", { flight: "wind" }, async (page) => {
  const record = recordOf("wind");
  const time_s = record.times_s[Math.floor(record.times_s.length / 2)];
  await goTo(page, time_s);
  for (const [id, uav] of record.rows("uavs", time_s)) {
    await page.getByLabel("Find").fill(`UAV ${id}`);
    await page.getByLabel("Find").press("Enter");
    await selectedCard(page).getByRole("heading", { name: `UAV ${id}`, exact: true }).waitFor();
    const facts = await selectedCard(page).locator("dd").evaluateAll((all) => Object.fromEntries(all.map((one) => [one.dataset.field, one.textContent])));
    assert.equal(facts.heading_deg, compass(uav.air_heading_rad));
    assert.equal(facts.course_deg, compass(uav.heading_rad));
    assert.equal(facts.airspeed_m_s, uav.airspeed_m_s.toFixed(2));
    const from = compass(Math.atan2(uav.wind_y_m_s, uav.wind_x_m_s) + Math.PI);
    assert.equal(facts.wind, `${Math.hypot(uav.wind_x_m_s, uav.wind_y_m_s).toFixed(1)} m/s from ${from}°`);
    assert.notEqual(facts.heading_deg, facts.course_deg);
  }
});

inReport("the map shows the mean wind at the UAVs, until its layer is hidden", { flight: "wind" }, async (page) => {
  await recordTexts(page);
  await goTo(page, 30);
  const uavs = [...recordOf("wind").rows("uavs", 30).values()];
  const mean = (column) => uavs.reduce((sum, uav) => sum + uav[column], 0) / uavs.length;
  const speed_m_s = Math.hypot(mean("wind_x_m_s"), mean("wind_y_m_s"));
  const wind = (await texts(page)).map(({ text }) => text).filter((text) => text.startsWith("wind "));
  assert.deepEqual(wind.map((text) => text.split(" from ")[0]), [`wind ${speed_m_s.toFixed(1)} m/s`]);
  const shown = await mapImage(page);
  await page.locator("#layer-menu").click();
  await page.getByRole("checkbox", { name: "Wind", exact: true }).uncheck();
  await painted(page);
  assert.notDeepEqual(await mapImage(page), shown);
});

inReport("a run in calm air has no wind to show", { flight: "figure-9" }, async (page) => {
  await page.locator("#layer-menu").click();
  assert.equal(await page.getByRole("checkbox", { name: "Wind", exact: true }).count(), 0);
});
