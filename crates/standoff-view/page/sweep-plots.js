// Plots of the page of a sweep, drawn with plotly.js: a metric over one key, or over two; large, or small next to those of other metrics.

/** Maximum number of lines in a plot: that of the colours of UAVs. */
const MAX_LINES = 8;

/** Widths of the large plot and of a small one on paper, px. */
const PAPER_WIDTHS = { large: 680, small: 210 };

class SweepPlots {
  constructor(view) {
    this.view = view;
    const { metrics, points } = view.data;
    /** Indices of the metrics with a small plot: the main ones that have values. */
    this.shown = [...metrics.keys()]
      .filter((index) => metrics[index].is_main && points.some(({ statistics }) => statistics[index][1] !== null));
    this.buttons = this.shown.map((index) => this.button(index));
    element("sweep-plots").replaceChildren(...this.buttons);
  }

  /** Creates the button with the small plot of a metric; it selects the metric for the large plot. */
  button(index) {
    const { view } = this;
    const title = view.title(view.data.metrics[index]);
    const button = textElement("button", title, { type: "button", title: "Show this metric in the large plot", "aria-label": title });
    button.append(textElement("span", "", { "aria-hidden": "true" }));
    button.addEventListener("click", () => view.choose(index));
    return button;
  }

  /** Draws the large plot. */
  async draw() {
    const plot = element("sweep-plot");
    const { view } = this;
    const { traces, layout, note } = this.figure(view.metric);
    element("sweep-note").textContent = note;
    plot.setAttribute("aria-label", `${view.title(view.data.metrics[view.metric])}. ${note}`);
    this.buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(this.shown[k] === view.metric)));
    await window.Plotly.react(plot, traces, { ...layout, ...this.paper("large") }, PLOT_CONFIG);
  }

  /** Draws the small plots. */
  async drawSmall() {
    // The reference may have no value of a metric.
    this.buttons.forEach((button, k) => (button.hidden = !this.measured(this.shown[k]).length));
    // All plots are drawn at the same time, because a browser that prints does not wait.
    await Promise.all(this.buttons.map((button, k) => button.hidden || this.drawButton(button, this.shown[k])));
  }

  /** Draws a small plot, without titles of axes, which are those of the large plot. */
  drawButton(button, metric) {
    const { traces, layout } = this.figure(metric);
    // Without automatic margins, the axes of all plots are below each other.
    const axis = (of) => ({ ...of, title: undefined, nticks: 4, automargin: false });
    const small = {
      ...layout, height: 120, margin: { l: 44, r: 6, t: 6, b: 20 }, showlegend: false, xaxis: axis(layout.xaxis), yaxis: axis(layout.yaxis),
      font: { ...layout.font, size: 10 }, ...this.paper("small"),
    };
    for (const { colorbar, marker } of traces) {
      const bar = colorbar ?? marker?.colorbar;
      if (bar) Object.assign(bar, { title: undefined, thickness: 7, nticks: 4 });
      if (marker) marker.size /= 2;
    }
    return window.Plotly.react(button.lastChild, traces, small, { ...PLOT_CONFIG, staticPlot: true });
  }

  /** Paper is narrower than most screens. */
  paper(size) {
    return isPrinting ? { width: PAPER_WIDTHS[size], autosize: false } : { autosize: true };
  }

  /** Traces, layout and description of the plot of a metric. */
  figure(metric) {
    const { x, y } = this.view;
    return y === null ? this.line(metric, x) : this.map(metric, x, y);
  }

  layout(across, up) {
    const { view } = this;
    const { grid, faint } = palette();
    const axis = (text) => ({ title: { text: escapeMarkup(text) }, gridcolor: grid, zeroline: false, zerolinecolor: faint, automargin: true });
    const ofKey = (key) => ({ ...axis(view.data.keys[key]), type: view.isNumber[key] ? "linear" : "category" });
    return {
      margin: { l: 56, r: 12, t: 10, b: 46 }, ...plotLook(), showlegend: false, height: 340, xaxis: ofKey(across),
      yaxis: up === null ? axis("") : ofKey(up),
    };
  }

  /** Text of a point in the large plot. */
  hover(point, metric) {
    const { view } = this;
    const { n, mean, ci95, verdict } = view.statistics(point, metric);
    const values = view.data.keys.map((key, index) => `${key} = ${point.values[index]}`);
    const what = verdict ? `difference ${formatNumber(mean)} (${interval(ci95)}), ${verdict}` : `mean ${formatNumber(mean)} (${interval(ci95)})`;
    return [...values, `${what}, n = ${n}`].map(escapeMarkup).join("<br>");
  }

  /** Points at which the metric has a value. */
  measured(metric) {
    return this.view.data.points.filter((point) => this.view.statistics(point, metric).mean !== null);
  }

  /** One marker with its interval per point. Lines connect points that differ only by the key of the horizontal axis. */
  line(metric, x) {
    const { view } = this;
    const series = this.series(metric, x);
    const layout = this.layout(x, null);
    layout.yaxis.title.text = escapeMarkup(view.quantity(metric));
    layout.yaxis.zeroline = view.isDifference;
    layout.showlegend = series.length > 1;
    layout.xaxis = { ...layout.xaxis, ...this.sameRange(x) };
    const note = view.isDifference ? `Differences from ${view.referenceText}, paired by seed. Bars: 95 % confidence interval of the difference.`
      : "Bars: 95 % confidence interval of the mean.";
    return { traces: series.map((one) => this.trace(metric, x, one)), layout, note };
  }

  /** The points of each line: one line for each value of the second key of a grid. */
  series(metric, x) {
    const { view } = this;
    const { keys, is_grid } = view.data;
    const points = this.measured(metric);
    if (view.isNumber[x]) points.sort((a, b) => view.value(a, x) - view.value(b, x));
    const [colour, other] = [palette().runs[0], 1 - x];
    const values = is_grid && keys.length === 2 ? view.values(other) : [];
    if (values.length < 2 || values.length > MAX_LINES) return [{ points, name: "", colour, mode: keys.length === 1 ? "lines+markers" : "markers" }];
    return values.map((value, k) => ({
      points: points.filter((point) => view.value(point, other) === value), name: escapeMarkup(`${keys[other]} = ${value}`),
      colour: palette().uavs[k], mode: "lines+markers",
    }));
  }

  trace(metric, x, { points, name, colour, mode }) {
    const { view } = this;
    const all = points.map((point) => view.statistics(point, metric));
    const reach = (end, sign) => all.map(({ mean, ci95 }) => (ci95 ? sign * (ci95[end] - mean) : 0));
    return {
      type: "scatter", mode, name, x: points.map((point) => view.value(point, x)), y: all.map(({ mean }) => mean), line: { color: colour },
      marker: { color: colour, size: 7 },
      error_y: { type: "data", symmetric: false, array: reach(1, 1), arrayminus: reach(0, -1), color: colour, thickness: 1.4 },
      text: points.map((point) => this.hover(point, metric)), hovertemplate: "%{text}<extra></extra>",
    };
  }

  /** Range of an axis of a key: the same in all plots, also in those of metrics that lack values at some points. */
  sameRange(key) {
    const { view } = this;
    const values = view.values(key);
    if (!view.isNumber[key]) return { categoryorder: "array", categoryarray: values, range: [-0.5, values.length - 0.5] };
    const [first, last] = [values[0], values.at(-1)];
    const margin = 0.05 * (last - first || 1);
    // No ticks between whole numbers.
    const areFew = last - first <= 10 && values.every(Number.isInteger);
    return { range: [first - margin, last + margin], ...(areFew ? { dtick: 1 } : {}) };
  }

  /** Colours of a plot over two keys; differences have a neutral colour at 0. */
  scale(metric) {
    const colorbar = { title: { text: escapeMarkup(this.view.quantity(metric)), side: "right" }, thickness: 14 };
    return { colorbar, colorscale: this.view.isDifference ? "RdBu" : "Viridis" };
  }

  /** Heat map over two keys of a grid, as means over the other keys; coloured markers for a Latin hypercube. */
  map(metric, x, y) {
    const { view } = this;
    const { points, is_grid, keys } = view.data;
    if (!is_grid) return this.markers(metric, x, y);
    const [across, up] = [x, y].map((key) => view.values(key));
    const cells = up.map((v) => across.map((u) => points.filter((point) => view.value(point, x) === u && view.value(point, y) === v)));
    const mean = (cell) => {
      const means = cell.map((point) => view.statistics(point, metric).mean).filter((value) => value !== null);
      return means.length ? means.reduce((sum, value) => sum + value, 0) / means.length : null;
    };
    const several = keys.length > 2;
    const label = (cell) => (several ? `mean ${formatNumber(mean(cell))} of ${cell.length} points` : this.hover(cell[0], metric));
    const trace = {
      type: "heatmap", x: across, y: up, z: cells.map((row) => row.map(mean)), ...this.scale(metric), xgap: 1, ygap: 1,
      ...(view.isDifference ? { zmid: 0 } : {}), text: cells.map((row) => row.map(label)), hovertemplate: "%{text}<extra></extra>",
    };
    // Cells of equal size, also if the values are not evenly spaced.
    const layout = this.layout(x, y);
    layout.xaxis.type = layout.yaxis.type = "category";
    return { traces: [trace], layout, note: this.colourNote(several ? "mean over the other keys" : "mean over the runs of the point") };
  }

  markers(metric, x, y) {
    const { view } = this;
    const measured = this.measured(metric);
    const marker = {
      color: measured.map((point) => view.statistics(point, metric).mean), ...this.scale(metric), showscale: true, size: 12,
      ...(view.isDifference ? { cmid: 0 } : {}),
    };
    const [across, up] = [x, y].map((key) => measured.map((point) => view.value(point, key)));
    const text = measured.map((point) => this.hover(point, metric));
    const trace = { type: "scatter", mode: "markers", x: across, y: up, marker, text, hovertemplate: "%{text}<extra></extra>" };
    const layout = this.layout(x, y);
    layout.xaxis = { ...layout.xaxis, ...this.sameRange(x) };
    layout.yaxis = { ...layout.yaxis, ...this.sameRange(y) };
    return { traces: [trace], layout, note: this.colourNote("mean over the runs of the point") };
  }

  colourNote(what) {
    const { isDifference, referenceText } = this.view;
    return isDifference ? `Colour: difference from ${referenceText}, paired by seed; ${what}.` : `Colour: ${what}.`;
  }
}
