// The page of a sweep: a line plot over one key, or a heat map over two, and the table of the points; `src/sweep.rs` writes its data.

class SweepView {
  constructor(data) {
    this.data = data;
    // Keys with text values are shown as categories.
    this.isNumber = data.keys.map((_, key) => data.points.every(({ values }) => values[key] !== "" && Number.isFinite(Number(values[key]))));
  }

  /** Value of a key at a point, as a number if all values of the key are numbers. */
  value(point, key) {
    const text = point.values[key];
    return this.isNumber[key] ? Number(text) : text.replace(/^"(.*)"$/, "$1");
  }

  get metric() {
    return this.data.metrics[Number(element("sweep-metric").value)];
  }

  /** Number of runs, mean and interval of the selected metric at a point, in its unit. */
  statistics(point) {
    const { factor } = this.metric;
    const [n, mean, ci95] = point.statistics[Number(element("sweep-metric").value)];
    return { n, mean: mean === null ? null : mean * factor, ci95: ci95 && ci95.map((end) => end * factor) };
  }

  title(metric) {
    return `${metric.label}${metric.unit ? ` (${metric.unit})` : ""}`;
  }

  show() {
    const { scenario, points, runs, keys, metrics, seed, is_grid } = this.data;
    document.title = `${scenario}, sweep \u2013 standoff`;
    const of = is_grid ? "grid" : "Latin hypercube";
    element("title").textContent = `${scenario}, ${of} of ${points.length} points with ${runs} runs each from seed ${seed}`;
    element("sweep-metric").replaceChildren(...metrics.map((metric, index) => new Option(this.title(metric), index)));
    const options = () => keys.map((key, index) => new Option(key, index));
    element("sweep-x").replaceChildren(...options());
    element("sweep-y").replaceChildren(new Option("mean", "mean"), ...options());
    element("sweep-y").value = keys.length > 1 ? "1" : "mean";
    element("sweep-y").parentElement.hidden = keys.length < 2;
    const preferred = metrics.findIndex(({ name }) => name === "position_error_m");
    element("sweep-metric").value = String(Math.max(0, preferred));
    for (const id of ["sweep-metric", "sweep-x", "sweep-y"]) element(id).addEventListener("change", () => this.draw());
    element("csv").addEventListener("click", () => this.saveCsv());
    element("png").addEventListener("click", () => {
      const filename = fileName(`${scenario}-${this.metric.name}`);
      window.Plotly?.downloadImage(element("sweep-plot"), { format: "png", filename, scale: 2, width: 800, height: 500 });
    });
  }

  /** Updates the table and the plot. */
  async draw() {
    this.showTable();
    if (!window.Plotly) return;
    const [x, y] = [Number(element("sweep-x").value), element("sweep-y").value];
    const plot = element("sweep-plot");
    const isMap = y !== "mean" && Number(y) !== x;
    const { traces, layout, note } = isMap ? this.map(x, Number(y)) : this.line(x);
    element("sweep-note").textContent = note;
    plot.setAttribute("aria-label", `${this.title(this.metric)}. ${note}`);
    await window.Plotly.react(plot, traces, layout, PLOT_CONFIG);
  }

  layout(across, up, extra = {}) {
    const { grid } = palette();
    const axis = (text, type) => ({ title: { text: escapeMarkup(text) }, type, gridcolor: grid, zeroline: false, automargin: true });
    const type = (key) => (key === null || this.isNumber[key] ? undefined : "category");
    return {
      margin: { l: 56, r: 12, t: 10, b: 46 }, ...plotLook(), showlegend: false, height: 440,
      xaxis: axis(this.data.keys[across], type(across)),
      yaxis: axis(up === null ? this.title(this.metric) : this.data.keys[up], type(up)), ...extra,
    };
  }

  hover(point) {
    const { n, mean, ci95 } = this.statistics(point);
    const values = this.data.keys.map((key, index) => `${key} = ${point.values[index]}`).join("<br>");
    return `${values}<br>mean ${formatNumber(mean)} (${interval(ci95)}), n = ${n}`;
  }

  /** One marker with its interval per point; a line connects the points if no other key varies. */
  line(x) {
    const { points, keys } = this.data;
    const measured = points.filter((point) => this.statistics(point).mean !== null);
    if (this.isNumber[x]) measured.sort((a, b) => this.value(a, x) - this.value(b, x));
    const all = measured.map((point) => this.statistics(point));
    const reach = (end, sign) => all.map(({ mean, ci95 }) => (ci95 ? sign * (ci95[end] - mean) : 0));
    const colour = palette().runs[0];
    const trace = {
      type: "scatter", mode: keys.length === 1 ? "lines+markers" : "markers", x: measured.map((point) => this.value(point, x)),
      y: all.map(({ mean }) => mean), line: { color: colour }, marker: { color: colour, size: 7 },
      error_y: { type: "data", symmetric: false, array: reach(1, 1), arrayminus: reach(0, -1), color: colour, thickness: 1.4 },
      text: measured.map((point) => escapeMarkup(this.hover(point)).replaceAll("&lt;br&gt;", "<br>")), hovertemplate: "%{text}<extra></extra>",
    };
    return { traces: [trace], layout: this.layout(x, null), note: "Bars: 95 % confidence interval of the mean." };
  }

  /** Heat map over two keys of a grid, as means over the other keys; coloured markers for a Latin hypercube. */
  map(x, y) {
    const { points, is_grid, keys } = this.data;
    const bar = { title: { text: escapeMarkup(this.title(this.metric)), side: "right" }, thickness: 14 };
    const text = (point) => escapeMarkup(this.hover(point)).replaceAll("&lt;br&gt;", "<br>");
    if (!is_grid) {
      const measured = points.filter((point) => this.statistics(point).mean !== null);
      const marker = { color: measured.map((point) => this.statistics(point).mean), colorscale: "Viridis", showscale: true, colorbar: bar, size: 12 };
      const [across, up] = [x, y].map((key) => measured.map((point) => this.value(point, key)));
      const trace = { type: "scatter", mode: "markers", x: across, y: up, marker, text: measured.map(text), hovertemplate: "%{text}<extra></extra>" };
      return { traces: [trace], layout: this.layout(x, y), note: "Colour: mean over the runs of the point." };
    }
    const [across, up] = [x, y].map((key) => {
      const values = [...new Set(points.map((point) => this.value(point, key)))];
      return this.isNumber[key] ? values.sort((a, b) => a - b) : values;
    });
    const cells = up.map((v) => across.map((u) => points.filter((point) => this.value(point, x) === u && this.value(point, y) === v)));
    const mean = (cell) => {
      const means = cell.map((point) => this.statistics(point).mean).filter((value) => value !== null);
      return means.length ? means.reduce((sum, value) => sum + value, 0) / means.length : null;
    };
    const several = keys.length > 2;
    const label = (cell) => (several ? `mean ${formatNumber(mean(cell))} of ${cell.length} points` : text(cell[0]));
    const trace = {
      type: "heatmap", x: across, y: up, z: cells.map((row) => row.map(mean)), colorscale: "Viridis", colorbar: bar, xgap: 1, ygap: 1,
      text: cells.map((row) => row.map(label)), hovertemplate: "%{text}<extra></extra>",
    };
    const note = several ? "Colour: mean over the other keys." : "Colour: mean over the runs of the point.";
    // Cells of equal size, also if the values are not evenly spaced.
    const layout = this.layout(x, y);
    layout.xaxis.type = layout.yaxis.type = "category";
    return { traces: [trace], layout, note };
  }

  showTable() {
    const table = element("sweep-points");
    const head = document.createElement("tr");
    const { metric } = this;
    const heads = [...this.data.keys, "n", `Mean${metric.unit ? ` (${metric.unit})` : ""}`, "95 % interval"];
    head.append(...heads.map((text) => {
      const cell = textElement("th", "", { scope: "col" });
      writeName(cell, text);
      return cell;
    }));
    table.tHead.replaceChildren(head);
    table.tBodies[0].replaceChildren(...this.data.points.map((point) => {
      const row = document.createElement("tr");
      const { n, mean, ci95 } = this.statistics(point);
      const texts = [...point.values, String(n), formatNumber(mean), interval(ci95)];
      row.append(...texts.map((text) => textElement("td", text)));
      return row;
    }));
  }

  /** Saves the statistics of all metrics, in the units of sweep.parquet. */
  saveCsv() {
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const { keys, metrics, points, scenario } = this.data;
    const heads = [...keys, ...metrics.flatMap(({ name }) => [name, `${name}_ci95_low`, `${name}_ci95_high`, `${name}_n`])];
    const row = ({ values, statistics }) => [
      ...values, ...statistics.flatMap(([n, mean, ci95]) => [mean ?? "", ci95?.[0] ?? "", ci95?.[1] ?? "", n]),
    ];
    const lines = [heads, ...points.map(row)].map((cells) => cells.map((cell) => quoted(String(cell))).join(","));
    save(`${fileName(scenario)}-sweep.csv`, `${lines.join("\n")}\n`, "text/csv");
  }
}

async function showSweep(source) {
  try {
    const view = new SweepView(await source.json("sweep"));
    view.show();
    themed(() => view.draw());
    document.body.dataset.ready = "tables";
    await source.charts();
    await view.draw();
    document.body.dataset.ready = "charts";
  } catch (error) {
    element("warning").hidden = false;
    element("warning").textContent = `Cannot read the data: ${error.message}`;
  }
}

showSweep(new FileSource());
