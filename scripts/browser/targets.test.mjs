// The states of the targets: the line in the header, and the table of targets with its filters, its order and its many rows.

import assert from "node:assert/strict";

import { PHONE, goTo, painted, selectedCard } from "./browser.mjs";
import { axe, checkLayout } from "./fit.mjs";
import { inReport } from "./in_report.mjs";
import { recordOf } from "./record.mjs";

/** The states by their names on the page: conditions on rows of the record. */
const STATES = {
  "in custody": ({ in_view, group }) => in_view === true && group !== null,
  "out of view": ({ in_view }) => in_view === false,
  untracked: ({ exists, status }) => exists && status === null,
  ungrouped: ({ membership }) => membership === "ungrouped",
  removed: ({ membership }) => membership === "removed",
  "in handoff": ({ membership }) => membership === "in-handoff",
  coasting: ({ status }) => status === "coasting",
};

const line = (page) => page.getByRole("group", { name: "Targets at the time shown" });
const chips = (page) => page.getByRole("group", { name: "Targets by state" });

/** The texts of the table as {field: text}, by target. Only the visible rows of long tables are in the document. */
async function listed(page) {
  const found = new Map();
  for (let top = 0; ; top += 400) {
    const isEnd = await page.getByRole("tabpanel", { name: "State" }).evaluate((pane, top) => {
      pane.scrollTop = top;
      return pane.scrollTop + pane.clientHeight >= pane.scrollHeight - 1;
    }, top);
    await painted(page);
    const rows = await page.locator("#targets tbody tr").evaluateAll((all) =>
      all.map((row) => [Number(row.dataset.id), Object.fromEntries([...row.cells].map((cell) => [cell.dataset.field, cell.textContent]))]));
    for (const [id, row] of rows) found.set(id, row);
    if (isEnd) return new Map([...found].sort(([a], [b]) => a - b));
  }
}

/** The expected texts of the line in the header. */
function expectedLine(rows) {
  const targets = [...rows.values()];
  const existing = targets.filter(({ exists }) => exists);
  const count = (name) => targets.filter(STATES[name]).length;
  const longest_s = Math.max(...existing.filter(STATES["out of view"]).map(({ out_of_view_s }) => out_of_view_s));
  const others = ["untracked", "ungrouped", "removed", "in handoff", "coasting"].filter(count).map((name) => `${count(name)} ${name}`);
  return [`In custody ${count("in custody")} of ${existing.length}`, `${count("out of view") || "none"} out of view`,
    ...(longest_s >= 0 ? [`longest ${longest_s.toFixed(longest_s < 9.95 ? 1 : 0)} s`] : []), ...others];
}

for (const [flight, times_s] of [["crowd-120", [2.5, 10, 17.5]], ["out-of-view", [27, 28]], ["figure-9", [33, 60]]]) {
  inReport(`the header states how many targets are in custody, out of view and in other states: ${flight}`, { flight }, async (page) => {
    const record = recordOf(flight);
    for (const time_s of times_s) {
      await goTo(page, time_s);
      await painted(page);
      const rows = record.rows("targets", time_s);
      assert.deepEqual((await line(page).getByRole("button").allTextContents()), expectedLine(rows), `at ${time_s} s`);
      const run = record.rows("run", time_s).get(0);
      assert.ok(expectedLine(rows)[0] === `In custody ${run.in_custody} of ${run.targets}`, "the chart has the same values");
    }
  });
}

inReport("a part of the line lists its targets in the table, and the longest time out of view selects its target", { flight: "crowd-120" }, async (page) => {
  const record = recordOf("crowd-120");
  await goTo(page, 15);
  const rows = [...record.rows("targets", 15)];
  const shown = Object.entries(STATES).filter(([, is]) => rows.some(([, target]) => is(target)));
  assert.ok(shown.length >= 4, `${shown}`);
  for (const [name, is] of shown) {
    await page.getByRole("tab", { name: "Charts" }).click();
    await line(page).getByRole("button", { name: new RegExp(name, "i") }).click();
    await painted(page);
    assert.equal(await page.getByRole("tab", { name: "State" }).getAttribute("aria-selected"), "true");
    const expected = rows.filter(([, target]) => is(target)).map(([id]) => id);
    assert.ok(await page.locator("#targets thead").isVisible());
    const inTable = await listed(page);
    assert.deepEqual([...inTable.keys()], expected, name);
    for (const [id, target] of rows.filter(([, target]) => is(target))) {
      const { warning, out_of_view_s, seen_by } = inTable.get(id);
      const isOut = target.in_view === false;
      const membership = { "in-handoff": "in handoff", ungrouped: "ungrouped", removed: "removed" }[target.membership];
      if (isOut) assert.equal(warning, target.group === null ? `out of view, ${membership}` : "out of view");
      else assert.ok(!warning.includes("out of view"), warning);
      assert.equal(out_of_view_s, isOut ? target.out_of_view_s.toFixed(1) : "\u2013");
      assert.equal(seen_by, target.seen_by.map((uav) => `UAV ${uav}`).join(", ") || "none");
    }
    assert.equal(await chips(page).getByRole("button", { pressed: true }).textContent(), `${name} ${expected.length}`);
  }
  await chips(page).getByRole("button", { name: /^all/ }).click();
  assert.equal(await chips(page).getByRole("button", { pressed: true }).textContent(), `all ${rows.length}`);
  const out = rows.filter(([, target]) => STATES["out of view"](target));
  const longest_s = Math.max(...out.map(([, target]) => target.out_of_view_s));
  await line(page).getByRole("button", { name: /^longest/ }).click();
  await painted(page);
  const name = await selectedCard(page).getByRole("heading").textContent();
  const [, target] = rows.find(([id]) => record.names[id] === name);
  assert.equal(target.out_of_view_s, longest_s);
  const facts = Object.fromEntries(await selectedCard(page).locator("dd").evaluateAll((all) => all.map((one) => [one.dataset.field, one.textContent])));
  assert.equal(facts.out_of_view_s, longest_s.toFixed(1));
  assert.equal(facts.seen_by, "none");
  assert.match(facts.warning, /^out of view/);
  assert.equal(await page.locator("#targets tr.chosen.warning").count(), 1, "its row is marked");
  await page.getByLabel("Find").fill(name);
  assert.equal(await page.locator("#search-names option").first().textContent(), `${name} \u2013 ${facts.warning}`);
});

/** The values of a column, in the order of the table. */
const values = (page, key) => page.locator(`#targets td[data-field="${key}"]`).allTextContents();

inReport("a click on a heading sorts the table of targets by this column, and a second click reverses the order", {}, async (page) => {
  await goTo(page, 60);
  await page.getByRole("tab", { name: "State" }).click();
  const head = page.locator("#targets thead th");
  assert.deepEqual(await head.evaluateAll((all) => all.map((one) => one.getAttribute("aria-sort"))),
    [null, null, "ascending", null, null, null, null], "warnings come first");
  const keys = ["name", "state", "warning", "group", "out_of_view_s", "seen_by", "error_m"];
  for (const [column, key] of keys.entries()) {
    const number = (text) => (/^[\d.]+$/.test(text) ? Number(text) : null);
    for (const press of [1, 2]) {
      if (key === "error_m") await head.nth(column).getByRole("button").press("Enter");
      else await head.nth(column).getByRole("button").click();
      await painted(page);
      const order = await head.nth(column).getAttribute("aria-sort");
      assert.equal(await page.locator("#targets th[aria-sort]").count(), 1);
      const isDescending = (press === 2) !== ["out_of_view_s", "error_m"].includes(key);
      assert.equal(order, isDescending ? "descending" : "ascending", `${key}, click ${press}`);
      if (key === "warning") continue;
      const shown = await values(page, key);
      const isText = ["name", "state", "seen_by"].includes(key);
      const known = shown.map((text) => (isText ? text : number(text.split(" ")[0]))).filter((value) => value !== null);
      const expected = [...known].sort((a, b) => (a < b ? -1 : a > b ? 1 : 0));
      assert.deepEqual(known, isDescending ? expected.reverse() : expected, `${key}, click ${press}`);
      const missing = shown.map((text) => !isText && number(text.split(" ")[0]) === null);
      assert.deepEqual(missing, [...missing].sort((a, b) => a - b), "missing values come last");
    }
  }
});

inReport("all of 650 targets are in the table, few rows are in the document, and the keyboard reaches each", { flight: "crowd-650" }, async (page) => {
  await goTo(page, 16);
  await chips(page).getByRole("button").count();
  await page.getByRole("tab", { name: "State" }).click();
  await page.locator('#targets th[data-sort="name"] button').click();
  const table = page.getByRole("table", { name: "Targets", exact: true });
  assert.equal(await table.getAttribute("aria-rowcount"), "651");
  const panel = page.getByRole("tabpanel", { name: "State" });
  const seen = new Set();
  const heights = new Set();
  for (let top = 0; ; top += 400) {
    const { scrolled, end } = await panel.evaluate((pane, top) => {
      pane.scrollTop = top;
      return { scrolled: pane.scrollTop, end: pane.scrollHeight - pane.clientHeight };
    }, top);
    await painted(page);
    const rows = await page.locator("#targets tbody tr").evaluateAll((all) => all.map((row) => [row.cells[0].textContent, row.getBoundingClientRect().height, row.getAttribute("aria-rowindex")]));
    assert.ok(rows.length < 60, `${rows.length} rows`);
    for (const [name, height, index] of rows) {
      seen.add(name);
      heights.add(height);
      assert.equal(name, `car ${Number(index) - 2}`, "sorted by number");
    }
    if (scrolled >= end - 1) break;
  }
  assert.equal(seen.size, 650);
  assert.equal(heights.size, 1, `rows are equally high: ${[...heights]}`);
  const focused = () => page.evaluate(() => document.activeElement.textContent);
  await page.locator("#targets tbody button").last().focus();
  for (const [key, name] of [["Home", "car 0"], ["ArrowDown", "car 1"], ["End", "car 649"], ["ArrowUp", "car 648"]]) {
    await page.keyboard.press(key);
    assert.equal(await focused(), name, key);
    const [box, pane] = [await page.locator(":focus").boundingBox(), await panel.boundingBox()];
    assert.ok(box.y >= pane.y && box.y + box.height <= pane.y + pane.height + 1, `${name} is visible`);
  }
  assert.equal(await page.locator("#targets tbody [tabindex='0']").count(), 1, "the table is one tab stop");
  await page.keyboard.press("Enter");
  await painted(page);
  assert.equal(await selectedCard(page).getByRole("heading").textContent(), "car 648");
  // The focus stays at its target when the order changes.
  await page.locator('#targets th[data-sort="name"] button').evaluate((button) => button.click());
  await panel.evaluate((pane) => (pane.scrollTop = document.getElementById("target-filter").offsetTop));
  await painted(page);
  assert.equal(await page.locator("#targets tbody tr").first().locator("button").textContent(), "car 649");
});

for (const [screen, options] of [["1280x720", {}], ["a phone", PHONE], ["1280x720, dark", { colorScheme: "dark" }]]) {
  inReport(`the header and the table of targets fit and are accessible on ${screen}`, { flight: "crowd-120", ...options }, async (page) => {
    await goTo(page, 15);
    await page.getByRole("tab", { name: "State" }).click();
    await checkLayout(page, "State");
    await line(page).getByRole("button", { name: /out of view$/ }).click();
    await axe(page, "out of view");
    for (const part of ["In custody", "out of view", "longest"]) {
      const box = await line(page).getByRole("button", { name: part }).boundingBox();
      assert.ok(box.x >= 0 && box.x + box.width <= page.viewportSize().width, `${part} is visible`);
    }
    const cut = await page.locator("#targets th button, #targets td > *").evaluateAll((all) => all.filter((one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent));
    assert.deepEqual(cut, [], "no text is wider than its column");
  });
}

inReport("names break at punctuation and not inside words", {}, async (page) => {
  await goTo(page, 60);
  await page.getByRole("tab", { name: "State" }).click();
  assert.equal(await page.locator('#targets tr[data-id="4"] button').evaluate((button) => button.innerHTML), "target-<wbr>4");
  await page.locator('#targets tr[data-id="4"] button').click();
  assert.equal(await selectedCard(page).getByRole("heading").evaluate((heading) => heading.innerHTML), "target-<wbr>4");
});
