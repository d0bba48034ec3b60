// What a record holds: scripts/page_values.py wrote it down beside each run.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { folder } from "./browser.mjs";

/** The values of a run, by table, id, column and instant; and its events. */
export function recordOf(flight) {
  const { times_s, names, events, ...tables } = JSON.parse(readFileSync(join(folder(flight), "values.json"), "utf8"));
  return {
    times_s,
    names,
    events,
    tables,
    ids: (table) => Object.keys(tables[table]).map(Number).sort((a, b) => a - b),
    /** The rows of a table at an instant, by id. */
    rows(table, time_s) {
      const instant = times_s.indexOf(time_s);
      assert.ok(instant >= 0, `${time_s} s is an instant of ${flight}`);
      const row = ([id, columns]) => [Number(id), Object.fromEntries(Object.entries(columns).map(([name, of]) => [name, of[instant]]))];
      return new Map(Object.entries(tables[table]).map(row).filter(([, values]) => Object.values(values).some((value) => value !== null)));
    },
  };
}

/** How far single precision may be off. */
const SINGLE = 2 ** -23;

/** Holds a number in words against the record, at the precision that is shown. */
export function agrees(words, value, digits, what) {
  if (value === null) return assert.equal(words, "\u2013", what);
  const shown = Number(words.replace("\u2212", "-"));
  assert.ok(Math.abs(shown - value) <= 0.5001 * 10 ** -digits + SINGLE * Math.abs(value), `${what}: ${words} is shown, the record has ${value}`);
  assert.equal(words.split(".")[1]?.length ?? 0, digits, `${what}: ${words} has ${digits} digits`);
}

/** Holds numbers that are not rounded against the record; `null` equals only `null`. */
export function same(values, recorded, what, precision = 4 * SINGLE) {
  assert.equal(values.length, recorded.length, `${what}: as many values`);
  values.forEach((value, k) => {
    const wanted = recorded[k];
    const off = value === null || wanted === null ? (value === wanted ? 0 : Infinity) : Math.abs(value - wanted) / Math.max(Math.abs(wanted), 1e-3);
    assert.ok(off <= precision, `${what}, value ${k}: the page has ${value}, the record ${wanted}`);
  });
}
