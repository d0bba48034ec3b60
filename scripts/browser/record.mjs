// The contents of records, which scripts/page_values.py writes into the folder of each run.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { folder } from "./browser.mjs";

/** The values of a run, by table, id, column and time step; its events; and lists of rows by time step, if it has tentative tracks. */
export function recordOf(flight) {
  const { times_s, names, events, detections, tentative, truth, ...tables } = JSON.parse(readFileSync(join(folder(flight), "values.json"), "utf8"));
  return {
    times_s,
    names,
    events,
    detections,
    tentative,
    truth,
    tables,
    ids: (table) => Object.keys(tables[table]).map(Number).sort((a, b) => a - b),
    /** The rows of a table at a time step, by id. */
    rows(table, time_s) {
      const stepIndex = times_s.indexOf(time_s);
      assert.ok(stepIndex >= 0, `${time_s} s is a time step of ${flight}`);
      const row = ([id, columns]) => [Number(id), Object.fromEntries(Object.entries(columns).map(([name, of]) => [name, of[stepIndex]]))];
      return new Map(Object.entries(tables[table]).map(row).filter(([, values]) => Object.values(values).some((value) => value !== null)));
    },
  };
}

/** Relative rounding error of single precision. */
const SINGLE = 2 ** -23;

/** Asserts that a number shown as text equals the record, with the given number of decimals. */
export function agrees(text, value, digits, what) {
  if (value === null) return assert.equal(text, "\u2013", what);
  const shown = Number(text.replace("\u2212", "-"));
  assert.ok(Math.abs(shown - value) <= 0.5001 * 10 ** -digits + SINGLE * Math.abs(value), `${what}: ${text} is shown, the record has ${value}`);
  assert.equal(text.split(".")[1]?.length ?? 0, digits, `${what}: ${text} has ${digits} decimals`);
}

/** Asserts that unrounded numbers equal the record; `null` equals only `null`. */
export function same(values, recorded, what, precision = 4 * SINGLE) {
  assert.equal(values.length, recorded.length, `${what}: number of values`);
  values.forEach((value, k) => {
    const expected = recorded[k];
    const error = value === null || expected === null ? (value === expected ? 0 : Infinity) : Math.abs(value - expected) / Math.max(Math.abs(expected), 1e-3);
    assert.ok(error <= precision, `${what}, value ${k}: the page has ${value}, the record ${expected}`);
  });
}
