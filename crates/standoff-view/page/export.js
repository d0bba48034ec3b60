// Export of the charts: an image of the visible panels, and a CSV file of all curves of the selected run.

/** Dash styles as text. */
const DASHES = { solid: "\u2014", dash: "--", dot: "\u00b7\u00b7\u00b7" };

/** The plotly figure of the visible panels, one below the other, with a legend. */
function chartsFigure(charts, width) {
  const { ink, faint, grid } = palette();
  const { shown, runs } = charts;
  const count = shown.length;
  const named = new Set();
  const data = shown.flatMap((panel, index) => panel.traces.map((trace) => {
    const ids = trace.meta.filter(({ of }) => of === "groups").map(({ id }) => id);
    const name = ids.length > 1 ? `groups ${ids.slice(0, 3).join(", ")}${ids.length > 3 ? ", \u2026" : ""}` : trace.name;
    const showlegend = !named.has(name);
    named.add(name);
    return { ...trace, name, legendgroup: name, showlegend, opacity: trace.opacity, xaxis: "x", yaxis: axis(index, trace.yaxis) };
  }));
  const top = 68 + 19 * Math.ceil((named.size * 110) / (width - 80));
  const layout = {
    width, height: 128 * count + top + 40, margin: { l: 64, r: 16, t: top, b: 40 }, ...plotLook(),
    title: { text: escapeMarkup(runs.map((run) => `${runs.length > 1 ? `${run.letter}: ` : ""}${runName(run.replayData.head)}`).join("; ")), x: 0.01, y: 1, yref: "container", yanchor: "top", pad: { t: 10 }, font: { size: 14, color: ink } },
    legend: { orientation: "h", x: 0, y: 1 + 18 / (128 * count), yanchor: "bottom", entrywidth: 82 },
    xaxis: { title: { text: "Time (s)" }, gridcolor: grid, anchor: lowest(shown), zeroline: false, range: charts.shown_s },
    shapes: [], annotations: [],
  };
  shown.forEach((panel, index) => {
    const above = 1 - index / count;
    const [low, high] = [above - 0.8 / count, above - 0.02 / count];
    for (const name of ["yaxis", "yaxis2"]) {
      const own = panel.plot.layout[name];
      if (!own) continue;
      const domain = (own.domain ?? [0, 1]).map((share) => low + share * (high - low));
      layout[axis(index, name.replace("axis", "")).replace("y", "yaxis")] = { ...own, domain };
    }
    const kinds = panel.kinds.map(([colour, dash, text]) => `\u2003<span style="color:${colour}">${DASHES[dash]}</span> ${escapeMarkup(text)}`);
    layout.annotations.push({
      text: escapeMarkup(panel.heading.firstChild.textContent) + kinds.join(""), xref: "paper", yref: "paper", x: 0, y: above - 0.01 / count, xanchor: "left",
      yanchor: "bottom", showarrow: false, font: { size: 11, color: faint },
    });
    for (const { text, ...note } of panel.plot.layout.annotations ?? []) {
      layout.annotations.push({ ...note, text, yref: `${axis(index, "y2")} domain` });
    }
    for (const shape of charts.shapes(panel.spec)) {
      layout.shapes.push({ ...shape, yref: shape.yref === "paper" ? `${axis(index, "y")} domain` : axis(index, "y") });
    }
  });
  return { data, layout };
}

/** The axis of the figure for an axis of a panel: "y" for the curves, "y2" for the differences. */
function axis(index, own) {
  const number = 2 * index + (own === "y2" ? 2 : 1);
  return number > 1 ? `y${number}` : "y";
}

/** The lowest axis of the figure. */
function lowest(shown) {
  return axis(shown.length - 1, shown.at(-1).plot.layout.yaxis2 ? "y2" : "y");
}

function filesName({ head }) {
  return fileName(`${head.scenario}-${head.seed}`);
}

/** Saves the visible charts as "png" or "svg". */
async function saveChartImage(charts, format) {
  if (!window.Plotly || !charts.shown.length || !charts.shown.every(({ plot }) => plot.layout)) return;
  const width = 1000;
  const { data, layout } = chartsFigure(charts, width);
  await window.Plotly.downloadImage({ data, layout }, { format, filename: filesName(charts.replayData), scale: format === "png" ? 2 : 1, width, height: layout.height });
}

/** Saves all curves at all time steps as CSV in SI units, including hidden curves. */
function saveCsv(charts) {
  const { replayData } = charts;
  const one = { uavs: "uav_", groups: "group_", intruders: "intruder_", targets: "target_" };
  const added = charts.panels.map(({ spec }) => spec).filter(({ isAdded }) => isAdded);
  const all = [...PANELS, ...added].flatMap(({ curves, factor }) => curves.flatMap((kind) => charts.curvesOfKind(kind, factor, replayData)));
  const headOf = ({ of, id, column }) => (of === "run" ? `run_${column}` : `${one[of]}${id}_${column}`);
  // An added panel may show a column of another panel.
  const curves = [...new Map(all.map((curve) => [headOf(curve), curve])).values(), ...(charts.target ? charts.curvesOf(TARGET_PANEL) : [])];
  const heads = curves.map(headOf);
  const number = (value) => (value === undefined || Number.isNaN(value) ? "" : String(Number(value.toPrecision(7))));
  // The page may not have the values of a target at every time step.
  const at = (curve) => {
    if (curve.of !== "targets") return (k) => curve.values[k];
    const values = new Map(curve.times_s.map((time_s, k) => [time_s, curve.values[k]]));
    return (k) => values.get(replayData.times_s[k]);
  };
  const columns = curves.map(at);
  const lines = replayData.times_s.map((time_s, k) => [time_s, ...columns.map((value) => number(value(k)))].join(","));
  save(`${filesName(replayData)}.csv`, `${[["time_s", ...heads].join(","), ...lines].join("\n")}\n`, "text/csv");
}
