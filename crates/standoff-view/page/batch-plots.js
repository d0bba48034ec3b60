// Plots of the batch page, drawn with plotly.js: distribution of one metric over the runs, and scatter of two metrics.

/** Maximum number of points per batch in the scatter plot. */
const SCATTERED = 5000;

class BatchPlots {
  constructor(page) {
    this.page = page;
    this.listens = false;
  }

  colour(variant) {
    const { uavs } = palette();
    return uavs[this.page.data.variants.indexOf(variant) % uavs.length];
  }

  /** Draws the visible plot. */
  async draw() {
    if (!window.Plotly) return;
    if (!element("panel-distribution").hidden) await this.drawDistribution();
    else await this.drawScatter();
  }

  layout(across, up) {
    const colours = palette();
    const axis = (text) => ({ title: { text }, gridcolor: colours.grid, zeroline: false, automargin: true });
    return {
      margin: { l: 48, r: 12, t: 10, b: 42 },
      ...plotLook(),
      showlegend: this.page.several,
      legend: { orientation: "h", y: 1, yanchor: "bottom", itemclick: "toggleothers", itemdoubleclick: "toggle" },
      xaxis: axis(across),
      yaxis: axis(up),
    };
  }

  title(metric) {
    return `${metric.what || metric.name}${metric.unit ? ` (${metric.unit})` : ""}`;
  }

  /** Draws a histogram of the runs, in percent if batches are compared, with a line at the mean and a band for its interval. */
  async drawDistribution() {
    const { metric, several, data } = this.page;
    const chart = element("distribution");
    chart.setAttribute("aria-label", `Distribution of ${metric.what || metric.name}. ${this.page.sentence()}`);
    const histogram = metric.histogram;
    const traces = [];
    const layout = { ...this.layout(escapeMarkup(this.title(metric)), several ? "Runs (%)" : "Runs"), barmode: "overlay", bargap: 0, shapes: [] };
    for (const [index, variant] of data.variants.entries()) {
      const statistics = variant.statistics[metric.name];
      if (!histogram || !statistics?.n) continue;
      const colour = this.colour(variant);
      const edge = (k) => (histogram.from + k * histogram.width) * metric.factor;
      const counts = histogram.counts[index];
      traces.push({
        type: "bar", name: this.page.letter(variant), x: counts.map((_, k) => (edge(k) + edge(k + 1)) / 2),
        y: counts.map((count) => (several ? (100 * count) / statistics.n : count)), width: edge(1) - edge(0),
        customdata: counts.map((count, k) => [formatNumber(edge(k)), formatNumber(edge(k + 1)), count]),
        hovertemplate: "%{customdata[0]} to %{customdata[1]}: %{customdata[2]} runs<extra></extra>",
        marker: { color: faded(colour, several ? 0.3 : 0.55), line: { color: colour, width: several ? 1.2 : 0.6 } },
      });
      if (statistics.mean === null) continue;
      const upright = { yref: "paper", y0: 0, y1: 1 };
      const [mean, ...ends] = [statistics.mean, ...(statistics.ci95 ?? [])].map((value) => value * metric.factor);
      if (ends.length) {
        layout.shapes.push({ ...upright, type: "rect", x0: ends[0], x1: ends[1], fillcolor: faded(colour, 0.25), line: { width: 0 } });
      }
      layout.shapes.push({ ...upright, type: "line", x0: mean, x1: mean, line: { color: several ? colour : palette().ink, width: 1.6 } });
    }
    await window.Plotly.react(chart, traces, layout, PLOT_CONFIG);
  }

  /** Draws the scatter plot, with one point per run. */
  async drawScatter() {
    const { data, several } = this.page;
    const chart = element("scatter");
    const [across, up] = ["x-metric", "y-metric"].map((id) => data.metrics.find((metric) => metric.name === element(id).value));
    const traces = [];
    let step = 1;
    for (const variant of data.variants) {
      const [x, y] = [across, up].map((metric) => variant.values[metric.name]);
      if (!x || !y) continue;
      const both = x.map((_, index) => index).filter((index) => x[index] !== null && y[index] !== null);
      const every = Math.max(1, Math.ceil(both.length / SCATTERED));
      step = Math.max(step, every);
      const shown = both.filter((_, k) => k % every === 0);
      traces.push({
        type: "scatter", mode: "markers", name: this.page.letter(variant),
        x: shown.map((index) => x[index] * across.factor), y: shown.map((index) => y[index] * up.factor),
        customdata: shown.map((index) => [variant.first_run + index, this.page.seed(variant, variant.first_run + index)]),
        hovertemplate: `${several ? `${this.page.letter(variant)}, seed` : "seed"} %{customdata[1]}: %{x:.4~g}, %{y:.4~g}<extra></extra>`,
        marker: { color: this.colour(variant), size: 6, opacity: 0.65 },
      });
    }
    const hint = () => {
      if (!this.page.hasValues) return "too many runs for the page; the values are in runs.parquet";
      return step > 1 ? `only one of every ${step} runs is shown` : this.page.source.live ? "click a run to replay it" : "click a run to show its command";
    };
    element("scatter-note").textContent = hint();
    const names = [across, up].map((metric) => metric.what || metric.name);
    chart.setAttribute("aria-label", `${names[1]} versus ${names[0]}, one point per run`);
    await window.Plotly.react(chart, traces, this.layout(escapeMarkup(this.title(across)), escapeMarkup(this.title(up))), PLOT_CONFIG);
    if (this.listens) return;
    this.listens = true;
    chart.on("plotly_click", ({ points: [point] }) => {
      const variant = data.variants.find((other) => this.page.letter(other) === point.data.name);
      this.page.open(variant, point.customdata[0]);
    });
  }

  savePng() {
    const isDistribution = !element("panel-distribution").hidden;
    const chart = element(isDistribution ? "distribution" : "scatter");
    const filename = fileName(`${this.page.data.variants[0].scenario}-${isDistribution ? this.page.metric.name : "scatter"}`);
    window.Plotly?.downloadImage(chart, { format: "png", filename, scale: 2, width: 800, height: 450 });
  }
}

/** Escapes a text so that plotly does not interpret it as markup. */
function escapeMarkup(text) {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}
