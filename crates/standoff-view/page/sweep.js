// The page of a sweep: plots of the metrics over the swept keys, and the table of the points; `src/sweep.rs` writes its data.

class SweepView {
  constructor(data) {
    this.data = data;
    // Keys with text values are shown as categories.
    this.isNumber = data.keys.map((_, key) => data.points.every(({ values }) => values[key] !== "" && Number.isFinite(Number(values[key]))));
    this.plots = new SweepPlots(this);
  }

  /** Value of a key at a point, as a number if all values of the key are numbers. */
  value(point, key) {
    const text = point.values[key];
    return this.isNumber[key] ? Number(text) : text.replace(/^"(.*)"$/, "$1");
  }

  /** Different values of a key; numbers in ascending order. */
  values(key) {
    const values = [...new Set(this.data.points.map((point) => this.value(point, key)))];
    return this.isNumber[key] ? values.sort((a, b) => a - b) : values;
  }

  /** Index of the selected metric. */
  get metric() {
    return Number(element("sweep-metric").value);
  }

  /** Key on the horizontal axis. */
  get x() {
    return Number(element("sweep-x").value);
  }

  /** Key on the vertical axis; `null` if it shows the metric. */
  get y() {
    const y = element("sweep-y").value;
    return y === "mean" || Number(y) === this.x ? null : Number(y);
  }

  /** Index of the point from which differences are shown. */
  get reference() {
    return Number(element("sweep-reference").value);
  }

  /** Whether the plots show differences from the reference instead of means. */
  get isDifference() {
    return element("sweep-show").value === "differences";
  }

  /** Number of runs, mean and interval of a metric at a point, as the plots show them, in its unit; with the verdict on a difference. */
  statistics(point, metric) {
    return this.isDifference ? this.difference(point, metric) : this.scaled(point.statistics[metric], metric);
  }

  /** The paired difference of a point from the reference. */
  difference(point, metric) {
    const index = this.data.points.indexOf(point);
    const difference = this.scaled(this.data.differences[this.reference][index][metric], metric);
    return index === this.reference ? { ...difference, verdict: "reference" } : difference;
  }

  scaled([n, mean, ci95, verdict], metric) {
    const { factor } = this.data.metrics[metric];
    return { n, mean: mean === null ? null : mean * factor, ci95: ci95 && ci95.map((end) => end * factor), verdict };
  }

  title(metric) {
    return `${metric.label}${metric.unit ? ` (${metric.unit})` : ""}`;
  }

  /** What the plots show of a metric. */
  quantity(metric) {
    const title = this.title(this.data.metrics[metric]);
    return this.isDifference ? `Difference in ${title}` : title;
  }

  /** The values of the keys at a point. */
  pointText({ values }) {
    return values.map((value, key) => `${this.data.keys[key]} = ${value}`).join(", ");
  }

  get referenceText() {
    return this.pointText(this.data.points[this.reference]);
  }

  show() {
    const { scenario, points, runs, keys, metrics, seed, is_grid, differences } = this.data;
    document.title = `${scenario}, sweep \u2013 standoff`;
    const of = is_grid ? "grid" : "Latin hypercube";
    element("title").textContent = `${scenario}, ${of} of ${points.length} points with ${runs} runs each from seed ${seed}`;
    element("sweep-metric").replaceChildren(...metrics.map((metric, index) => new Option(this.title(metric), index)));
    const options = () => keys.map((key, index) => new Option(key, index));
    element("sweep-x").replaceChildren(...options());
    element("sweep-y").replaceChildren(new Option("the metric", "mean"), ...options());
    element("sweep-y").value = keys.length > 1 ? "1" : "mean";
    for (const id of ["sweep-x", "sweep-y"]) element(id).parentElement.hidden = keys.length < 2;
    element("sweep-reference").replaceChildren(...differences.map((_, index) => new Option(this.pointText(points[index]), index)));
    const preferred = metrics.findIndex(({ name }) => name === "position_error_m");
    element("sweep-metric").value = String(Math.max(0, preferred));
    element("sweep-metric").addEventListener("change", () => this.choose(this.metric));
    for (const id of ["sweep-x", "sweep-y", "sweep-show", "sweep-reference"]) element(id).addEventListener("change", () => this.draw());
    element("csv").addEventListener("click", () => this.saveCsv());
    element("png").addEventListener("click", () => {
      const filename = fileName(`${scenario}-${metrics[this.metric].name}`);
      window.Plotly?.downloadImage(element("sweep-plot"), { format: "png", filename, scale: 2, width: 800, height: 500 });
    });
  }

  /** Shows a metric in the table and in the large plot. */
  async choose(metric) {
    element("sweep-metric").value = String(metric);
    this.showTable();
    if (window.Plotly) await this.plots.draw();
  }

  /** Updates the table and all plots. */
  async draw() {
    await Promise.all([this.choose(this.metric), window.Plotly && this.plots.drawSmall()]);
  }

  showTable() {
    const table = element("sweep-points");
    const { data, metric } = this;
    const unit = data.metrics[metric].unit ? ` (${data.metrics[metric].unit})` : "";
    const head = document.createElement("tr");
    const heads = [...data.keys, "n", `Mean${unit}`, "95 % interval", `Difference${unit}`, "95 % interval", "Verdict"];
    head.append(...heads.map((text) => {
      const cell = textElement("th", "", { scope: "col" });
      writeName(cell, text);
      return cell;
    }));
    table.tHead.replaceChildren(head);
    table.tBodies[0].replaceChildren(...data.points.map((point) => {
      const row = document.createElement("tr");
      const { n, mean, ci95 } = this.scaled(point.statistics[metric], metric);
      const difference = this.difference(point, metric);
      const isReference = difference.verdict === "reference";
      const differs = isReference ? ["", ""] : [formatNumber(difference.mean), interval(difference.ci95)];
      row.append(...[...point.values, String(n), formatNumber(mean), interval(ci95), ...differs].map((text) => textElement("td", text)));
      const verdict = isReference || difference.n ? difference.verdict : formatNumber(null);
      row.append(textElement("td", verdict, { class: verdict, title: `${difference.n} pairs of runs` }));
      return row;
    }));
    element("sweep-caption").textContent = `${data.metrics[metric].label}: mean of each point, and difference from ${this.referenceText}`;
  }

  /** Saves the statistics of all metrics and their differences from the reference, in the units of sweep.parquet. */
  saveCsv() {
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const { keys, metrics, points, scenario, differences } = this.data;
    const names = ["", "_ci95_low", "_ci95_high", "_n", "_difference", "_difference_ci95_low", "_difference_ci95_high", "_verdict"];
    const heads = [...keys, ...metrics.flatMap(({ name }) => names.map((part) => `${name}${part}`))];
    const row = ({ values, statistics }, index) => [...values, ...statistics.flatMap(([n, mean, ci95], metric) => {
      const [pairs, difference, ends, verdict] = differences[this.reference][index][metric];
      return [mean ?? "", ci95?.[0] ?? "", ci95?.[1] ?? "", n, difference ?? "", ends?.[0] ?? "", ends?.[1] ?? "", pairs ? verdict : ""];
    })];
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
