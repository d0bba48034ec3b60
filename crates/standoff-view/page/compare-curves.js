// Charts of two runs: the curves of both in the colours of the runs, and below them the differences.

/** Height that the differences add to a plot, and the gap above them, px. */
const DIFFERENCE_HEIGHT = 64;
const DIFFERENCE_GAP = 10;

/** The curves of two runs, given as one list per run, and the difference B \u2212 A of each curve that both runs have. */
function pairedCurves(curvesByRun) {
  const { runs, ink } = palette();
  const [a, b] = curvesByRun.map((curves, k) => curves.map((curve) => ({ ...curve, colour: runs[k], run: "AB"[k] })));
  const key = ({ of, id, column }) => `${of} ${id} ${column}`;
  const inB = new Map(b.map((curve) => [key(curve), curve]));
  const differences = a.filter((curve) => inB.has(key(curve))).map((curve) => ({
    ...curve, colour: ink, run: "B \u2212 A", isDifference: true, values: differencesOf(curve, inB.get(key(curve))),
  }));
  return [...a, ...b, ...differences];
}

/** The differences of two curves at the time steps of the first; NaN before and after the second. Angles differ by at most half a turn. */
function differencesOf(a, b) {
  const isAngle = a.column.endsWith("_rad");
  return a.times_s.map((time_s, k) => {
    const at = lastNotAfter(b.times_s, time_s);
    if (at < 0 || time_s > b.times_s.at(-1) + 1e-9) return NaN;
    const difference = b.values[at] - a.values[k];
    return isAngle ? Math.atan2(Math.sin(difference), Math.cos(difference)) : difference;
  });
}

/** The vertical axes of a plot: one for the curves, and one below it for the differences if there are any. */
function axesOf(curves) {
  if (!curves.some(({ isDifference }) => isDifference)) return { height: PLOT_HEIGHT, axes: { yaxis: {} }, annotations: [] };
  const height = PLOT_HEIGHT + DIFFERENCE_HEIGHT;
  const inner = height - PLOT_TOP - PLOT_BOTTOM;
  const { faint, none } = palette();
  return {
    height,
    axes: {
      yaxis: { domain: [DIFFERENCE_HEIGHT / inner, 1] },
      yaxis2: { domain: [0, (DIFFERENCE_HEIGHT - DIFFERENCE_GAP) / inner], nticks: 3, zeroline: true, zerolinecolor: none },
    },
    annotations: [{
      text: "B \u2212 A", xref: "paper", yref: "y2 domain", x: 0, y: 1, xanchor: "left", yanchor: "top", showarrow: false, font: { size: 10, color: faint },
    }],
  };
}
