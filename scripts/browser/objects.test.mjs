// Pointing at objects on the map, selecting and following them.

import assert from "node:assert/strict";

import { PHONE, camera, selectedCard, goTo, recordTexts, painted, mapImage, texts } from "./browser.mjs";
import { inReport } from "./in_report.mjs";
import { agrees, recordOf } from "./record.mjs";

const DEGREES = 180 / Math.PI;

/** Converts world coordinates to a position on the page, px. */
async function at(page, x_m, y_m) {
  const view = await camera(page);
  const box = await page.locator("#map").boundingBox();
  return [box.x + box.width / 2 + (x_m - view.x_m) * view.px_per_m, box.y + box.height / 2 - (y_m - view.y_m) * view.px_per_m];
}

const hovered = (page) => page.getByRole("tooltip");

/** The values of a card, by field. */
async function facts(card) {
  return card.locator("dd").evaluateAll((all) => Object.fromEntries(all.map((one) => [one.dataset.field, one.textContent])));
}

/** Follows a group and zooms in until its objects do not overlap. */
async function zoomToGroup(page, group, presses) {
  await page.getByLabel("Follow").selectOption(`group ${group}`);
  for (let press = 0; press < presses; press++) await page.getByRole("button", { name: "Zoom in" }).click();
}

inReport("the card of the object under the pointer shows its name and its current values", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 60);
  await zoomToGroup(page, 0, 1);
  const uav = record.rows("uavs", 60).get(0);
  await page.mouse.move(...(await at(page, uav.x_m, uav.y_m)));
  await assert.doesNotReject(hovered(page).getByRole("heading", { name: "UAV 0", exact: true }).waitFor());
  const shown = await facts(hovered(page));
  assert.equal(shown.group, `${uav.group}`);
  agrees(shown.speed_m_s.replace(" limit", ""), uav.speed_m_s, 2, "speed");
  agrees(shown.standoff_error_m, uav.standoff_error_m, 1, "standoff error");
  assert.match(await hovered(page).textContent(), /Speed \(m\/s\).*Turn rate \(\u00b0\/s\)/, "headings contain units");

  const group = record.rows("groups", 60).get(0);
  const [orbit_x_m, orbit_y_m] = [group.x_m - group.standoff_distance_m * Math.cos(2.4), group.y_m + group.standoff_distance_m * Math.sin(2.4)];
  await page.mouse.move(...(await at(page, orbit_x_m, orbit_y_m)));
  await hovered(page).getByRole("heading", { name: "Orbit of group 0" }).waitFor();
  agrees((await facts(hovered(page))).standoff_distance_m.replace(" not feasible", ""), group.standoff_distance_m, 1, "orbit");

  // Between the UAV and its group, near the UAV: only the field of view is at this position.
  const wedge = await at(page, uav.x_m + 0.3 * (group.x_m - uav.x_m), uav.y_m + 0.3 * (group.y_m - uav.y_m));
  await page.mouse.move(...wedge);
  await hovered(page).getByRole("heading", { name: "Field of view of UAV 0" }).waitFor();
  assert.match(await hovered(page).textContent(), /70\u00b0 wide, centred on the boresight\. A target is in view if its true position is inside/);

  for (let press = 0; press < 5; press++) await page.getByRole("button", { name: "Zoom in" }).click();
  await page.mouse.move(...(await at(page, group.x_m, group.y_m)));
  await hovered(page).getByRole("heading", { name: "Group 0" }).waitFor();
  assert.equal((await facts(hovered(page))).members, `${group.members}`);
  for (const [id, target] of record.rows("targets", 60)) {
    if (target.group !== 0) continue;
    await page.mouse.move(...(await at(page, target.x_m, target.y_m)));
    await hovered(page).getByRole("heading", { name: record.names[id], exact: true }).waitFor();
    const { error_m, detections, seen_by, state } = await facts(hovered(page));
    agrees(error_m, target.error_m, 2, `error of target ${id}`);
    assert.equal(detections, `${target.detections} ${target.detections === 1 ? "UAV" : "UAVs"}`);
    assert.equal(seen_by, target.seen_by.map((id) => `UAV ${id}`).join(", ") || "none");
    assert.equal(state, `${target.membership}, ${target.status}`);
    const box = await hovered(page).boundingBox();
    const map = await page.locator("#map").boundingBox();
    assert.ok(box.x >= map.x && box.x + box.width <= map.x + map.width && box.y + box.height <= map.y + map.height, "inside the map");
  }
  await page.mouse.move(5, 5);
  assert.equal(await hovered(page).count(), 0, "no card is shown after the pointer has left");
});

inReport("a click selects an object with a ring, a card that follows the time, and its row; Escape clears the selection", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await zoomToGroup(page, 0, 7);
  await page.getByRole("tab", { name: "State" }).click();
  const [id, target] = [...record.rows("targets", 40)].filter(([, one]) => one.group === 0).at(-1);
  const before = await mapImage(page);
  await page.mouse.click(...(await at(page, target.x_m, target.y_m)));
  await page.mouse.move(5, 5);
  await selectedCard(page).getByRole("heading", { name: record.names[id], exact: true }).waitFor();
  assert.ok((await mapImage(page)) !== before, "the object is marked on the map");
  const row = page.locator("#targets tbody tr.chosen");
  assert.equal(await row.locator("td").first().textContent(), record.names[id]);
  const [rowBox, pane] = [await row.boundingBox(), await page.getByRole("tabpanel", { name: "State" }).boundingBox()];
  assert.ok(rowBox.y >= pane.y && rowBox.y + rowBox.height <= pane.y + pane.height + 1, "its row is visible");
  assert.equal(await row.getByRole("button").getAttribute("aria-pressed"), "true");
  assert.equal(await page.locator("tr.chosen").count(), 1);
  for (const time_s of [40, 41, 60]) {
    await goTo(page, time_s);
    agrees((await facts(selectedCard(page))).error_m, record.rows("targets", time_s).get(id).error_m, 2, `error at ${time_s} s`);
  }
  await page.keyboard.press("Escape");
  await painted(page);
  assert.equal(await selectedCard(page).count(), 0);
  assert.equal(await page.locator("tr.chosen").count(), 0);
});

inReport("a click on an empty position clears the selection, and repeated clicks select overlapping objects in turn", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await zoomToGroup(page, 0, 2);
  const uav = record.rows("uavs", 40).get(0);
  const place = await at(page, uav.x_m, uav.y_m);
  const names = new Set();
  await page.mouse.click(...place);
  assert.equal(await selectedCard(page).getByRole("heading").textContent(), "UAV 0");
  const target = [...record.rows("targets", 40)].find(([, one]) => one.group === 0)[1];
  const crowd = await at(page, target.x_m, target.y_m);
  for (let click = 0; click < 3; click++) {
    await page.mouse.click(...crowd);
    names.add(await selectedCard(page).getByRole("heading").textContent());
  }
  assert.ok(names.size >= 2, `${[...names]}`);
  const map = await page.locator("#map").boundingBox();
  await page.mouse.click(map.x + 5, map.y + map.height - 5);
  assert.equal(await selectedCard(page).count(), 0);
});

inReport("a click selects the UAV on top of a target, and the card of the selected object is not shown twice", {}, async (page) => {
  const record = recordOf("figure-9");
  // A time at which a UAV flies over a track of a target.
  const over = record.times_s.flatMap((time_s) => [...record.rows("uavs", time_s)].flatMap(([id, uav]) => [...record.rows("targets", time_s)]
    .filter(([, { x_m }]) => x_m !== null)
    .map(([target, { x_m, y_m }]) => ({ time_s, id, target, x_m, y_m, far_m: Math.hypot(x_m - uav.x_m, y_m - uav.y_m) }))))
    .reduce((best, one) => (one.far_m < best.far_m ? one : best));
  await goTo(page, over.time_s);
  while (over.far_m * (await camera(page)).px_per_m > 4) await page.getByRole("button", { name: "Zoom out" }).click();
  const place = await at(page, over.x_m, over.y_m);
  await page.mouse.click(...place);
  await selectedCard(page).getByRole("heading", { name: `UAV ${over.id}`, exact: true }).waitFor();
  await painted(page);
  assert.equal(await hovered(page).count(), 0, "only one card of the UAV");
  const others = [];
  for (let click = 0; click < 8; click++) {
    await page.mouse.click(...place);
    others.push(await selectedCard(page).getByRole("heading").textContent());
  }
  assert.ok(others.includes(record.names[over.target]), `the target is among ${others}`);
});

inReport("the field of view of a UAV on its way has the colour of the UAV, and its cards explain it", {}, async (page) => {
  const record = recordOf("figure-9");
  // The share of the orbit radius by which each UAV is outside its orbit.
  const ways = record.times_s.flatMap((time_s) => [...record.rows("uavs", time_s)]
    .filter(([, { boresight_rad, group }]) => boresight_rad !== null && group !== null && record.rows("groups", time_s).has(group))
    .map(([id, uav]) => {
      const { x_m, y_m, standoff_distance_m } = record.rows("groups", time_s).get(uav.group);
      return { time_s, id, ...uav, outside: Math.hypot(uav.x_m - x_m, uav.y_m - y_m) / standoff_distance_m - 1, centre: [x_m, y_m] };
    }));
  const [way, arrived] = [ways.find(({ outside }) => outside > 0.3), ways.findLast(({ outside }) => Math.abs(outside) < 0.1)];
  assert.ok(way && arrived, "a UAV is on its way, and one has arrived");
  await page.evaluate(() => {
    const { fill } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fill = function (...rest) {
      if (this.canvas.id === "map") window.fills.push(this.fillStyle);
      return fill.apply(this, rest);
    };
    window.fills = [];
  });
  for (const [one, isOnWay] of [[way, true], [arrived, false]]) {
    await goTo(page, one.time_s);
    await page.getByRole("tab", { name: "State" }).click();
    await page.locator(`#uavs tr[data-id="${one.id}"] td`).nth(1).click();
    await page.evaluate(() => (window.fills = []));
    await page.keyboard.press("r");
    await page.keyboard.press("r");
    await painted(page);
    const colour = await page.evaluate((id) => {
      const { fillStyle } = Object.assign(document.createElement("canvas").getContext("2d"), { fillStyle: ["#be55ff", "#b90f8c", "#5a3cff", "#468cd7"][id] });
      const [r, g, b] = [1, 3, 5].map((at) => parseInt(fillStyle.slice(at, at + 2), 16));
      return `rgba(${r}, ${g}, ${b}, 0.1)`;
    }, one.id);
    const fills = await page.evaluate(() => window.fills);
    assert.equal(fills.includes(colour), isOnWay, `${colour} among ${fills}`);
    const text = /On its way: it is still \d+ m outside the orbit of group/;
    assert.equal(text.test(await selectedCard(page).textContent()), isOnWay, `UAV ${one.id} at ${one.time_s} s`);
    await selectedCard(page).getByRole("button", { name: "Close" }).click();
    await page.mouse.move(...(await at(page, one.x_m + 0.5 * (one.centre[0] - one.x_m), one.y_m + 0.5 * (one.centre[1] - one.y_m))));
    if (isOnWay) assert.match(await hovered(page).textContent(), text);
  }
});

inReport("rows of UAVs, groups and targets are selected with mouse and keyboard, and selected objects can be followed", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await page.getByRole("tab", { name: "State" }).click();
  const follow = page.getByLabel("Follow");
  for (const [table, kind, id] of [["uavs", "uav", 2], ["groups", "group", 1], ["targets", "target", 4]]) {
    const row = page.locator(`#${table} tr[data-id="${id}"]`);
    if (kind === "group") {
      await row.getByRole("button").focus();
      await page.keyboard.press("Enter");
    } else {
      await row.locator("td").nth(1).click();
    }
    await selectedCard(page).getByRole("button", { name: "Follow" }).click();
    assert.equal(await follow.inputValue(), `${kind} ${id}`);
    assert.equal(await selectedCard(page).getByRole("button", { name: "Follow" }).getAttribute("aria-pressed"), "true");
    for (const time_s of [40, 80]) {
      await goTo(page, time_s);
      const { x_m, y_m } = record.rows(table, time_s).get(id);
      const view = await camera(page);
      assert.ok(Math.hypot(view.x_m - x_m, view.y_m - y_m) < 0.01, `${kind} ${id} at ${time_s} s: ${view.x_m} ${view.y_m}, expected ${x_m} ${y_m}`);
    }
  }
  await selectedCard(page).getByRole("button", { name: "Close" }).click();
  assert.equal(await selectedCard(page).count(), 0);
  assert.equal(await follow.inputValue(), "target 4", "closing the card does not stop following");
  for (const [table, text] of [["uavs", "inside"], ["groups", "r_d"], ["targets", "out of view"]]) {
    const titles = await page.locator(`#${table} th`).evaluateAll((heads) => heads.map((head) => head.title));
    assert.ok(titles.every((title) => title.length > 10) && titles.some((title) => title.includes(text)), `${titles}`);
  }
});

inReport("a UAV in an outage is marked with its position and time until it returns", { flight: "outage" }, async (page) => {
  await recordTexts(page);
  const labelsAt = async (time_s) => {
    await goTo(page, time_s);
    return (await texts(page)).map(({ text }) => text);
  };
  await page.getByRole("tab", { name: "State" }).click();
  const row = page.locator('#uavs tr[data-id="1"]');
  for (const [time_s, out] of [[0, false], [39.5, false], [45, true], [100, true], [120, false]]) {
    assert.equal((await labelsAt(time_s)).includes("UAV 1: outage since 40.0 s"), out, `the map at ${time_s} s`);
    assert.equal((await row.textContent()).includes("out since 40.0 s"), out, `State at ${time_s} s`);
    assert.equal((await page.locator("#warning").textContent()).includes("UAV 1: outage since 40.0 s"), out, `the warning at ${time_s} s`);
  }
  await goTo(page, 45);
  await row.click();
  assert.match(await selectedCard(page).textContent(), /UAV 1: outage since 40\.0 s/);
});

inReport("a note reports that a followed object has ended, and following resumes at times when it exists", { flight: "outage" }, async (page) => {
  const ended = recordOf("outage");
  const [id, end] = Object.entries(ended.tables.groups)
    .map(([id, { members }]) => [Number(id), members.findLastIndex((count) => count !== null)])
    .find(([, last]) => last >= 0 && last < ended.times_s.length - 1);
  const end_s = ended.times_s[end + 1];
  const { x_m } = ended.tables.groups[id];
  const note = page.locator(".dock .note");
  await goTo(page, ended.times_s[end]);
  await page.getByLabel("Follow").selectOption(`group ${id}`);
  await painted(page);
  assert.equal(await note.textContent(), "");
  const held = await camera(page);
  assert.ok(Math.abs(held.x_m - x_m[end]) < 0.01);
  await goTo(page, end_s + 5);
  assert.equal(await note.textContent(), `Group ${id} ended at ${end_s.toFixed(1)} s; the map stays in place`);
  assert.deepEqual(await camera(page), held);
  await goTo(page, ended.times_s[end - 10]);
  assert.equal(await note.textContent(), "");
  assert.ok(Math.abs((await camera(page)).x_m - x_m[end - 10]) < 0.01, "the map follows it again");
});

inReport("on a phone a tap selects an object, the card fits on the map, and the ruler measures", PHONE, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  const uav = record.rows("uavs", 40).get(3);
  await page.touchscreen.tap(...(await at(page, uav.x_m, uav.y_m)));
  await selectedCard(page).getByRole("heading", { name: "UAV 3", exact: true }).waitFor();
  const map = await page.locator("#map").boundingBox();
  for (const box of await Promise.all([selectedCard(page), page.locator(".tools")].map((one) => one.boundingBox()))) {
    assert.ok(box.x >= 0 && box.x + box.width <= 390, `${JSON.stringify(box)} fits`);
    assert.ok(box.y + box.height <= map.y + map.height);
  }
  await selectedCard(page).getByRole("button", { name: "Close" }).tap();
  await page.getByRole("button", { name: "Tools" }).tap();
  await page.getByRole("button", { name: "Ruler" }).tap();
  const session = await page.context().newCDPSession(page);
  const touch = (type, ...points) => session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y]) => ({ x, y })) });
  // Away from objects, which the ends would follow.
  const [x, y] = [map.x + 150, map.y + map.height - 30];
  const before = await camera(page);
  await touch("touchStart", [x, y]);
  await touch("touchMove", [x + 60, y]);
  await touch("touchMove", [x + 120, y]);
  await touch("touchEnd");
  assert.deepEqual(await camera(page), before, "measuring does not move the map");

  const [, metres] = (await page.locator("#ruler-result").textContent()).match(/^(\d+) m, bearing 090\u00b0$/);
  assert.ok(Math.abs(Number(metres) - 120 / before.px_per_m) <= 1 / before.px_per_m);
});

inReport("the ends of the ruler follow the objects on which they were placed", {}, async (page) => {
  const record = recordOf("figure-9");
  await goTo(page, 40);
  await page.getByRole("button", { name: "Ruler" }).click();
  const [a, b] = [0, 3].map((id) => record.rows("uavs", 40).get(id));
  await page.mouse.move(...(await at(page, a.x_m, a.y_m)));
  await page.mouse.down();
  await page.mouse.move(...(await at(page, b.x_m, b.y_m)));
  await page.mouse.up();
  for (const time_s of [40, 60, 80]) {
    await goTo(page, time_s);
    await painted(page);
    const [a, b] = [0, 3].map((id) => record.rows("uavs", time_s).get(id));
    const text = await page.locator("#ruler-result").textContent();
    const [, metres] = text.match(/^UAV 0 to UAV 3: (\d+) m, bearing \d{3}\u00b0$/) ?? assert.fail(text);
    assert.ok(Math.abs(Number(metres) - Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)) <= 0.51, `${text} at ${time_s} s`);
  }
});

inReport("the text of the ruler is always inside the map", {}, async (page) => {
  await recordTexts(page);
  await page.getByRole("button", { name: "Ruler" }).click();
  const map = await page.locator("#map").boundingBox();
  for (const [dx, dy] of [[map.width - 3, 3], [map.width - 3, map.height - 3], [3, map.height - 3]]) {
    await page.mouse.move(map.x + 200, map.y + 200);
    await page.mouse.down();
    await page.mouse.move(map.x + dx, map.y + dy);
    await page.mouse.up();
    const { x, y, width } = (await texts(page)).find(({ text }) => text.includes("bearing"));
    assert.ok(x > 0 && x + width < map.width && y > 5 && y < map.height - 5, JSON.stringify({ x, y, width }));
  }
});
