// Export of the charts: an image of the visible panels, and a CSV file of all curves.

/** The plotly figure of the visible panels, one below the other, with a legend. */
function chartsFigure(charts, width) {
  const { ink, faint, grid } = palette();
  const { head } = charts.replayData;
  const { shown } = charts;
  const count = shown.length;
  const named = new Set();
  const data = shown.flatMap((panel, index) => panel.traces.map((trace) => {
    const ids = trace.meta.filter(({ of }) => of === "groups").map(({ id }) => id);
    const name = ids.length > 1 ? `groups ${ids.slice(0, 3).join(", ")}${ids.length > 3 ? ", \u2026" : ""}` : trace.name;
    const showlegend = !named.has(name);
    named.add(name);
    return { ...trace, name, legendgroup: name, showlegend, opacity: trace.opacity, xaxis: "x", yaxis: axis(index) };
  }));
  const top = 68 + 19 * Math.ceil((named.size * 110) / (width - 80));
  const layout = {
    width, height: 128 * count + top + 40, margin: { l: 64, r: 16, t: top, b: 40 }, ...plotLook(),
    title: { text: escapeMarkup(`${head.scenario}, seed ${head.seed}`), x: 0.01, y: 1, yref: "container", yanchor: "top", pad: { t: 10 }, font: { size: 14, color: ink } },
    legend: { orientation: "h", x: 0, y: 1 + 18 / (128 * count), yanchor: "bottom", entrywidth: 82 },
    xaxis: { title: { text: "Time (s)" }, gridcolor: grid, anchor: axis(count - 1), zeroline: false, range: charts.shown_s },
    shapes: [], annotations: [],
  };
  shown.forEach((panel, index) => {
    const above = 1 - index / count;
    const { yaxis } = panel.plot.layout;
    layout[`yaxis${index ? index + 1 : ""}`] = { ...yaxis, domain: [above - 0.8 / count, above - 0.02 / count] };
    layout.annotations.push({
      text: escapeMarkup(panel.heading.firstChild.textContent), xref: "paper", yref: "paper", x: 0, y: above - 0.01 / count, xanchor: "left",
      yanchor: "bottom", showarrow: false, font: { size: 11, color: faint },
    });
    for (const shape of charts.shapes(panel.spec)) {
      layout.shapes.push({ ...shape, yref: shape.yref === "paper" ? `${axis(index)} domain` : axis(index) });
    }
  });
  return { data, layout };
}

function axis(index) {
  return `y${index ? index + 1 : ""}`;
}

function filesName({ head }) {
  return fileName(`${head.scenario}-${head.seed}`);
}

/** Saves the visible charts as PNG. */
async function savePng(charts) {
  if (!window.Plotly || !charts.shown.length || !charts.shown.every(({ plot }) => plot.layout)) return;
  const width = 1000;
  const { data, layout } = chartsFigure(charts, width);
  await window.Plotly.downloadImage({ data, layout }, { format: "png", filename: filesName(charts.replayData), scale: 2, width, height: layout.height });
}

/** Saves all curves at all time steps as CSV in SI units, including hidden curves. */
function saveCsv(charts) {
  const { replayData } = charts;
  const one = { uavs: "uav_", groups: "group_", targets: "target_" };
  const specs = charts.target ? [...PANELS, TARGET_PANEL] : PANELS;
  const curves = specs.flatMap((spec) => [...charts.curvesOf(spec)]);
  const heads = curves.map(({ of, id, column }) => (of === "run" ? `run_${column}` : `${one[of]}${id}_${column}`));
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
