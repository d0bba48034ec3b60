// The page of Monte Carlo results; `src/batch.rs` writes its data.

/** Columns of the table of metrics. */
const STATISTICS = [
  ["n", "n"], ["mean", "Mean"], ["ci95", "95 % interval"], ["sd", "sd"], ["p5", "5 %"], ["p50", "Median"], ["p95", "95 %"],
  ["max", "Max"],
];

/** Columns of the table of differences. */
const DIFFERENCES = [
  ["n", "n"], ["difference", "Difference"], ["ci95", "95 % interval"], ["b_smaller", "Smaller than A in"],
];

/** Formats a number with four significant digits; a dash for a missing value. */
function formatNumber(value) {
  if (value === null || value === undefined) return "\u2013";
  const size = Math.abs(value);
  const digits = [[1000, 0], [100, 1], [10, 2], [1, 3], [1e-4, 4]].find(([least]) => size >= least);
  const text = size === 0 ? "0" : digits ? value.toFixed(digits[1]) : value.toExponential(1);
  return text.replaceAll("-", "\u2212");
}

/** Formats an interval as `a to b`; a dash for a missing interval. */
function interval(ends) {
  return ends ? `${formatNumber(ends[0])} to ${formatNumber(ends[1])}` : formatNumber(null);
}

/** Quotes a word for a shell. */
function shellQuoted(word) {
  return /^[\w./=:@%+,-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** Creates an element with a text and attributes. */
function textElement(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** The first two metrics that vary between runs; if there are fewer, the first metrics. */
function varyingMetrics({ metrics, variants }) {
  const scatters = (metric) => variants.some((variant) => variant.statistics[metric.name]?.sd > 0);
  return [...metrics.filter(scatters), ...metrics].slice(0, 2);
}

class BatchPage {
  constructor(data, source) {
    this.data = data;
    this.source = source;
    [this.metric, this.against] = varyingMetrics(data);
    this.chosen = null;
    this.plots = new BatchPlots(this);
  }

  get several() {
    return this.data.variants.length > 1;
  }

  /** Label of a batch in tables and legends. */
  letter(variant) {
    const number = this.data.variants.indexOf(variant);
    return number < 26 ? String.fromCharCode(65 + number) : String(number);
  }

  seed(variant, run) {
    return String(BigInt(variant.seed) + BigInt(run));
  }

  /** Path at which the server replays a run. */
  path(variant, run) {
    return `run/${this.data.variants.indexOf(variant)}/${this.seed(variant, run)}/`;
  }

  /** The shell command that repeats a run. */
  command(variant, run) {
    const words = ["standoff", "run", ...this.scenario(variant)];
    return [...words, "--seed", this.seed(variant, run)].map(shellQuoted).join(" ");
  }

  /** Arguments that select the scenario of a batch: its name with `--set` options, or a file. */
  scenario(variant) {
    if (this.needsFile(variant)) return [this.tomlName(variant)];
    return [variant.scenario, ...variant.changes.flatMap((change) => ["--set", change])];
  }

  needsFile(variant) {
    // Control characters must not be copied into a terminal.
    return variant.changes === null || variant.changes.some((change) => /[\x00-\x1f\x7f]/.test(change));
  }

  tomlName(variant) {
    return `${fileName(variant.scenario).replace(/^[-.]+/, "") || "scenario"}.toml`;
  }

  show() {
    const { variants, metrics } = this.data;
    const name = variants.map((variant) => variant.name).join(" versus ");
    document.title = `${name} \u2013 standoff`;
    const runs = (variant) => `${variant.runs} run${variant.runs === 1 ? "" : "s"}`;
    element("title").textContent = this.several ? name : `${name}, ${runs(variants[0])}, ${this.seeds(variants[0])}`;
    element("batch-names").textContent = this.several ? variants.map((variant) => `${this.letter(variant)}: ${variant.name}`).join("\n") : "";
    element("batch-names").hidden = !this.several;
    this.showMetrics();
    this.showDifferences();
    this.showBatches();
    const names = metrics.map((metric) => [metric.name, metric.what || metric.name]);
    for (const id of ["x-metric", "y-metric"]) {
      element(id).replaceChildren(...names.map(([value, text]) => new Option(text, value)));
    }
    element("variant").replaceChildren(...variants.map((variant, index) => new Option(this.letter(variant), index)));
    element("run-batch").hidden = !this.several;
    element("x-metric").value = this.metric.name;
    element("y-metric").value = this.against.name;
    element("csv").disabled = !this.hasValues;
    element("csv").title = this.hasValues ? "" : "too many runs for the page; the values are in runs.parquet";
    this.connect();
  }

  get hasValues() {
    return this.data.variants.some((variant) => Object.keys(variant.values).length > 0);
  }

  seeds(variant) {
    const [first, last] = [variant.first_run, variant.first_run + variant.runs - 1].map((run) => this.seed(variant, run));
    return `seeds ${first} to ${last}${variant.shard === null ? "" : `, shard ${variant.shard}`}`;
  }

  /** Writes the table of statistics, with one row per metric and batch. */
  showMetrics() {
    const { metrics, variants } = this.data;
    const table = element("metrics");
    const heads = ["Metric", ...(this.several ? ["Batch"] : []), ...STATISTICS.map(([, head]) => head),
      ...(this.several ? ["vs. A"] : [])];
    this.head(table, heads);
    for (const metric of metrics) {
      const having = variants.filter((variant) => variant.statistics[metric.name]);
      this.rows(table, metric, having).forEach((row, index) => {
        const variant = having[index];
        const statistics = variant.statistics[metric.name];
        for (const [key] of STATISTICS) this.cell(row, metric, key, statistics[key]);
        if (this.several) row.append(this.verdict(metric, variant, ["worse", "better"], () => formatNumber(null)));
      });
    }
  }

  /** Writes the table of differences from the first batch. */
  showDifferences() {
    const { metrics, variants, comparisons } = this.data;
    element("tab-differences").hidden = !this.several;
    if (!this.several) return;
    const table = element("differences");
    this.head(table, ["Metric", "Batch", ...DIFFERENCES.map(([, head]) => head), "Verdict"]);
    for (const metric of metrics) {
      const having = variants.filter((variant, index) => index > 0 && comparisons[index - 1]?.metrics[metric.name]);
      if (!having.length) continue;
      this.rows(table, metric, having).forEach((row, index) => {
        const variant = having[index];
        const paired = this.paired(metric, variant);
        for (const [key] of DIFFERENCES) this.cell(row, metric, key, paired[key]);
        row.append(this.verdict(metric, variant, ["A is better", `${this.letter(variant)} is better`], undecided));
      });
    }
  }

  paired(metric, variant) {
    return this.data.comparisons[this.data.variants.indexOf(variant) - 1]?.metrics[metric.name];
  }

  /**
   * Creates the cell that compares a batch with the first one: `first` if the first batch is better, `other` if this batch is
   * better, and the result of `neither` if the interval is not entirely beyond the size of interest.
   */
  verdict(metric, variant, [first, other], neither) {
    const paired = this.paired(metric, variant);
    const text = () => {
      if (!paired) return "";
      if (!paired.ci95) return "too few runs";
      if (!paired.differs) return neither(paired);
      return { a: first, b: other }[paired.better] ?? "differs";
    };
    const cell = textElement("td", text(), { "data-statistic": "verdict" });
    if (paired?.better) cell.classList.add(paired.better === "b" ? "better" : "worse");
    return cell;
  }

  head(table, heads) {
    const row = document.createElement("tr");
    row.append(...heads.map((text) => textElement("th", text, { scope: "col", "data-head": text })));
    row.lastChild.classList.toggle("verdict", ["Verdict", "vs. A"].includes(heads.at(-1)));
    table.tHead.replaceChildren(row);
  }

  /**
   * Inserts the rows of a metric, one per batch. The name of the metric is a button: in the row if there is one batch, above the
   * rows otherwise.
   */
  rows(table, metric, variants) {
    const head = textElement("th", "", { scope: "row" });
    const button = textElement("button", metric.what || metric.name, { type: "button", "aria-pressed": "false", title: metric.name });
    if (metric.unit) button.append("\u00a0", textElement("small", metric.unit));
    head.append(button);
    const row = () => {
      const made = table.tBodies[0].insertRow();
      made.dataset.metric = metric.name;
      made.addEventListener("click", () => this.choose(metric));
      return made;
    };
    const first = row();
    first.className = "first";
    first.append(head);
    if (variants.length > 1) {
      head.colSpan = table.tHead.rows[0].cells.length;
      head.scope = "rowgroup";
    }
    return variants.map((variant) => {
      const made = variants.length > 1 ? row() : first;
      if (variants.length > 1) made.append(textElement("td", ""));
      if (this.several) {
        const number = this.data.variants.indexOf(variant);
        made.append(textElement("td", this.letter(variant), { "data-batch": number, title: variant.name }));
      }
      return made;
    });
  }

  /** Appends a cell with a number in the unit of the metric; the title is the exact number as stored in the files. */
  cell(row, metric, key, value) {
    const scaled = (number) => (number === null ? null : number * metric.factor);
    const text = () => {
      if (key === "n") return String(value);
      if (key === "b_smaller") return value === null ? formatNumber(null) : `${Math.round(100 * value)} %`;
      return key === "ci95" ? interval(value?.map(scaled)) : formatNumber(scaled(value));
    };
    const exact = value === null ? "" : Array.isArray(value) ? value.join(" to ") : String(value);
    row.append(textElement("td", text(), { "data-statistic": key, title: exact }));
  }

  /** Writes the table of batches and the table of the settings in which they differ. */
  showBatches() {
    const { variants } = this.data;
    const table = element("batches");
    this.head(table, [...(this.several ? ["Batch"] : []), "Scenario", "Runs", "Seeds", "Version", ""]);
    for (const variant of variants) {
      const row = table.tBodies[0].insertRow();
      if (this.several) row.append(textElement("td", this.letter(variant)));
      for (const text of [variant.scenario, String(variant.runs), this.seeds(variant).replace("seeds ", ""), variant.version]) {
        row.append(textElement("td", text));
      }
      const button = textElement("button", "Save scenario", { type: "button", title: "Save the scenario with all changes as TOML" });
      button.addEventListener("click", () => save(this.tomlName(variant), variant.toml, "application/toml"));
      row.insertCell().append(button);
    }
    const settingNames = [...new Set(variants.flatMap((variant) => Object.keys(variant.settings)))].sort();
    const settings = element("settings");
    settings.hidden = !this.several;
    this.head(settings, ["Setting", ...variants.map((variant) => this.letter(variant))]);
    for (const key of settingNames) {
      const row = settings.tBodies[0].insertRow();
      row.append(textElement("td", key), ...variants.map((variant) => textElement("td", variant.settings[key] ?? "not set")));
    }
    if (!settingNames.length) settings.tBodies[0].insertRow().append(textElement("td", "none"));
  }

  /** Selects a metric and shows its distribution and its runs. */
  choose(metric) {
    this.metric = metric;
    for (const row of document.querySelectorAll("tr[data-metric]")) {
      const on = row.dataset.metric === metric.name;
      row.classList.toggle("chosen", on);
      row.querySelector("button")?.setAttribute("aria-pressed", String(on));
    }
    try {
      history.replaceState(null, "", `#${encodeURIComponent(metric.name)}`);
    } catch {
      // Some browsers do not allow a page opened from a file to change its address.
    }
    element("metric").textContent = metric.what || metric.name;
    element("summary").textContent = this.sentence();
    element("value").textContent = metric.unit ? `Value (${metric.unit})` : "Value";
    const ends = { large: ["largest", "smallest"], small: ["smallest", "largest"] }[metric.bad] ?? ["largest", "smallest"];
    const label = (end, index) => (metric.bad ? `${index === 0 ? "worst" : "best"}: ${end} first` : `${end} first`);
    element("run-order").replaceChildren(...ends.map((end, index) => new Option(label(end, index), end)));
    element("x-metric").value = metric.name;
    this.showRuns();
    this.plots.draw();
  }

  /** Describes the mean and the interval of each batch in a sentence. */
  sentence() {
    const { metric } = this;
    const unit = metric.unit ? ` ${metric.unit}` : "";
    const scaled = (value) => (value === null ? null : value * metric.factor);
    const of = (variant) => {
      const statistics = variant.statistics[metric.name];
      if (!statistics?.n) return null;
      const between = statistics.ci95 ? ` (${interval(statistics.ci95.map(scaled))})` : "";
      const label = this.several ? `${this.letter(variant)}: ` : "";
      return `${label}mean ${formatNumber(scaled(statistics.mean))}${unit}${between}, n = ${statistics.n}`;
    };
    const all = this.data.variants.map(of).filter(Boolean);
    if (!all.length) return "No run has a value.";
    return `${metric.name}. ${all.join("; ")}.${metric.pooled ? " The mean is pooled: it is computed from sums over all runs." : ""}`;
  }

  /** Lists the runs with the smallest or the largest values of the metric. */
  showRuns() {
    const { metric } = this;
    const variant = this.data.variants[Number(element("variant").value)];
    const runs = variant.ends[metric.name]?.[element("run-order").value] ?? [];
    const rows = runs.map(([run, value], index) => {
      const row = document.createElement("tr");
      row.dataset.run = run;
      const seed = this.seed(variant, run);
      for (const text of [index + 1, formatNumber(value * metric.factor), seed]) row.append(textElement("td", text));
      row.cells[1].title = String(value);
      const open = this.source.live
        ? textElement("a", "Replay", { href: this.path(variant, run), "aria-label": `Replay the run of seed ${seed}` })
        : textElement("button", "Command", { type: "button", "aria-label": `Command for the run of seed ${seed}` });
      row.append(document.createElement("td"));
      row.lastChild.append(open);
      row.addEventListener("click", () => this.chooseRun(variant, run));
      return row;
    });
    element("runs").tBodies[0].replaceChildren(...rows);
    if (runs.length) this.chooseRun(variant, runs[0][0]);
    else this.chooseRun(null);
  }

  /** Selects a run and shows it in the footer; without arguments, clears the selection. */
  chooseRun(variant, run) {
    this.chosen = variant && { variant, run };
    for (const id of ["command", "copy"]) element(id).hidden = !variant;
    element("replay").hidden = !variant || !this.source.live;
    element("toml").hidden = !variant || !this.needsFile(variant);
    element("run").textContent = variant
      ? `${this.several ? `${this.letter(variant)}, seed` : "Seed"} ${this.seed(variant, run)}` : "No run";
    if (!variant) return;
    element("replay").href = this.path(variant, run);
    element("command").textContent = this.command(variant, run);
    element("toml").textContent = `Save ${this.tomlName(variant)}`;
    element("toml").title = variant.has_traffic ? "Save the traffic file in the same folder" : "";
    for (const row of element("runs").tBodies[0].rows) row.classList.toggle("chosen", Number(row.dataset.run) === run);
  }

  /** Selects a run that was clicked in the scatter plot, and replays it if the page is served. */
  open(variant, run) {
    this.chooseRun(variant, run);
    if (this.source.live) location.assign(this.path(variant, run));
  }

  async copy() {
    const command = element("command");
    try {
      await navigator.clipboard.writeText(command.textContent);
      element("copy").textContent = "Copied";
      setTimeout(() => (element("copy").textContent = "Copy"), 1500);
    } catch {
      getSelection().selectAllChildren(command);
    }
  }

  /** Saves all values of all runs as CSV, in the units of `runs.parquet`. */
  saveCsv() {
    const { metrics, variants } = this.data;
    const lines = [["batch", "seed", ...metrics.map((metric) => metric.name)]];
    for (const variant of variants) {
      for (let index = 0; index < variant.runs; index++) {
        const seed = this.seed(variant, variant.first_run + index);
        const values = metrics.map((metric) => variant.values[metric.name]?.[index] ?? "");
        lines.push([this.letter(variant), seed, ...values]);
      }
    }
    save(`${fileName(variants[0].scenario)}-runs.csv`, `${lines.map((line) => line.join(",")).join("\n")}\n`, "text/csv");
  }

  /** Applies the colours of the current theme. */
  renew() {
    for (const cell of document.querySelectorAll("td[data-batch]")) {
      cell.style.setProperty("--batch", this.plots.colour(this.data.variants[Number(cell.dataset.batch)]));
    }
    this.plots.draw();
  }

  connect() {
    element("run-order").addEventListener("change", () => this.showRuns());
    element("variant").addEventListener("change", () => this.showRuns());
    for (const id of ["x-metric", "y-metric"]) element(id).addEventListener("change", () => this.plots.draw());
    element("copy").addEventListener("click", () => this.copy());
    element("toml").addEventListener("click", () => {
      const { variant } = this.chosen;
      save(this.tomlName(variant), variant.toml, "application/toml");
    });
    element("csv").addEventListener("click", () => this.saveCsv());
    element("png").addEventListener("click", () => this.plots.savePng());
    element("help-button").addEventListener("click", () => element("help").showModal());
    for (const list of document.querySelectorAll("[role=tablist]")) tabs(list, () => this.plots.draw());
    const next = (way) => {
      const { metrics } = this.data;
      const at = metrics.indexOf(this.metric) + way;
      if (!metrics[at]) return;
      this.choose(metrics[at]);
      const button = document.querySelector("[role=tabpanel]:not([hidden]) tr.chosen button");
      button?.focus({ preventScroll: true });
      button?.scrollIntoView({ block: "nearest" });
    };
    const keys = {
      ArrowUp: () => next(-1),
      ArrowDown: () => next(1),
      c: () => this.chosen && this.copy(),
      t: () => element("theme").click(),
      "?": () => element("help").showModal(),
    };
    connectCharacterKeys();
    document.addEventListener("keydown", (key) => {
      if (key.ctrlKey || key.metaKey || key.altKey || isSwitchedOff(key) || element("help").open) return;
      if (key.target.closest("select, input") || (key.target.closest("#panel-distribution") && key.key.startsWith("Arrow"))) return;
      const act = keys[key.key];
      if (!act) return;
      key.preventDefault();
      act();
    });
  }
}

/** The verdict if the interval is not entirely beyond the size of interest, as `standoff compare` gives it. */
function undecided({ ci95: [low, high], interest }) {
  return low >= -interest && high <= interest ? "same: below the size of interest" : "unclear";
}

/** Loads the results and shows them on the page. */
async function showBatch(source) {
  try {
    const page = new BatchPage(await source.batch(), source);
    const hash = location.hash;
    page.show();
    themed(() => page.renew());
    page.choose(page.data.metrics.find((metric) => `#${encodeURIComponent(metric.name)}` === hash) ?? page.metric);
    document.body.dataset.ready = "tables";
    await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
    await source.charts();
    await page.plots.draw();
    document.body.dataset.ready = "charts";
  } catch (error) {
    element("warning").hidden = false;
    element("warning").textContent = `Cannot read the data: ${error.message}`;
  }
}
