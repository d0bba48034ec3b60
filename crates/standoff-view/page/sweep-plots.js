// Plots of the page of a sweep, drawn with plotly.js: a metric over one key, or over two; large, or small next to those of other metrics.

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

  /** Draws the small plots: without titles of axes, which are those of the large plot. */
  async drawSmall() {
    for (const [k, button] of this.buttons.entries()) {
      const { traces, layout } = this.figure(this.shown[k]);
      const axis = (of) => ({ ...of, title: undefined, nticks: 4, automargin: "left" });
      const small = {
        ...layout, height: 130, margin: { l: 34, r: 6, t: 6, b: 20 }, xaxis: axis(layout.xaxis), yaxis: axis(layout.yaxis),
        font: { ...layout.font, size: 10 }, ...this.paper("small"),
      };
      for (const trace of traces) {
        const bar = trace.colorbar ?? trace.marker?.colorbar;
        if (bar) Object.assign(bar, { title: undefined, thickness: 7, nticks: 4 });
        else trace.marker = { ...trace.marker, size: 4 };
      }
      await window.Plotly.react(button.lastChild, traces, small, { ...PLOT_CONFIG, staticPlot: true });
    }
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
      margin: { l: 56, r: 12, t: 10, b: 46 }, ...plotLook(), showlegend: false, height: 380, xaxis: ofKey(across),
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

  /** One marker with its interval per point; a line connects the points if no other key varies. */
  line(metric, x) {
    const { view } = this;
    const measured = this.measured(metric);
    if (view.isNumber[x]) measured.sort((a, b) => view.value(a, x) - view.value(b, x));
    const all = measured.map((point) => view.statistics(point, metric));
    const reach = (end, sign) => all.map(({ mean, ci95 }) => (ci95 ? sign * (ci95[end] - mean) : 0));
    const colour = palette().runs[0];
    const trace = {
      type: "scatter", mode: view.data.keys.length === 1 ? "lines+markers" : "markers", x: measured.map((point) => view.value(point, x)),
      y: all.map(({ mean }) => mean), line: { color: colour }, marker: { color: colour, size: 7 },
      error_y: { type: "data", symmetric: false, array: reach(1, 1), arrayminus: reach(0, -1), color: colour, thickness: 1.4 },
      text: measured.map((point) => this.hover(point, metric)), hovertemplate: "%{text}<extra></extra>",
    };
    const layout = this.layout(x, null);
    layout.yaxis.title.text = escapeMarkup(view.quantity(metric));
    layout.yaxis.zeroline = view.isDifference;
    layout.xaxis = { ...layout.xaxis, ...this.sameRange(x) };
    const note = view.isDifference ? `Differences from ${view.referenceText}, seed by seed. Bars: paired 95 % confidence interval.`
      : "Bars: 95 % confidence interval of the mean.";
    return { traces: [trace], layout, note };
  }

  /** Range of an axis of a key: the same in all plots, also in those of metrics that lack values at some points. */
  sameRange(key) {
    const { view } = this;
    const values = view.values(key);
    if (!view.isNumber[key]) return { categoryorder: "array", categoryarray: values, range: [-0.5, values.length - 0.5] };
    const [first, last] = [values[0], values.at(-1)];
    const margin = 0.05 * (last - first || 1);
    return { range: [first - margin, last + margin] };
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
    return isDifference ? `Colour: difference from ${referenceText}, seed by seed, ${what}.` : `Colour: ${what}.`;
  }
}
