// Charts of many objects: the smallest, the median and the largest value at each time step instead of all curves.

/** Number of objects of one kind at one time step above which their curves are summarised. */
const MANY_OBJECTS = 60;

/** The largest number of objects of a table at one time step. */
function mostAtOnce({ ids, columns, stepCount }) {
  const counts = new Uint32Array(stepCount);
  const values = columns.get("x_m");
  for (let cell = 0; cell < ids.length * stepCount; cell++) if (!Number.isNaN(values[cell])) counts[cell % stepCount] += 1;
  return counts.reduce((a, b) => Math.max(a, b), 0);
}

/** Curves of the smallest, the median and the largest value of the curves of one column; the lower median of an even number. */
function summaryOf(curves) {
  if (!curves.length) return [];
  const { ink, faint } = palette();
  const { values: { length }, ...kind } = curves[0];
  const summary = [["smallest", faint, () => 0], ["median", ink, (count) => (count - 1) >> 1], ["largest", faint, (count) => count - 1]]
    .map(([rank, colour, indexIn]) => ({ ...kind, id: rank, name: `${rank} of ${formatCount(curves.length)}`, colour, indexIn, values: new Float32Array(length).fill(NaN) }));
  const present = new Float32Array(curves.length);
  for (let k = 0; k < length; k++) {
    let count = 0;
    for (const { values } of curves) if (!Number.isNaN(values[k])) present[count++] = values[k];
    const ascending = present.subarray(0, count).sort();
    if (count) for (const { indexIn, values } of summary) values[k] = ascending[indexIn(count)];
  }
  return summary;
}
