// Charts over time, linked to the time shown. They are drawn with plotly.js, with one plot per panel.

/** Maximum number of points of a curve; longer curves are reduced to the minimum and the maximum of each interval. */
const POINTS = 1500;
/** Height and margins of a plot, px. */
const PLOT_HEIGHT = 112;
const PLOT_LEFT = 52;
const PLOT_RIGHT = 12;
const PLOT_TOP = 5;
const PLOT_BOTTOM = 7;
const CHART_CONFIG = { staticPlot: true };

class Charts {
  constructor(page) {
    this.page = page;
    this.clock = page.clock;
    this.container = element("charts");
    this.cursor = element("cursor");
    this.panels = [TARGET_PANEL, ...PANELS].map((spec) => new Panel(spec));
    element("panels").append(...this.panels.map((panel) => panel.section));
    this.menu = new PanelMenu(this);
    /** Ids of the selected curves; an empty set selects all. */
    this.only = { uavs: new Set(), groups: new Set() };
    /** The time range shown; `null` for the whole run. */
    this.range_s = null;
    /** Emphasised curves of the selected object: `null`, or ids by kind. */
    this.front = null;
    /** Data of the selected target. */
    this.target = null;
    this.width = 0;
    this.round = 0;
    this.legend = new Legend(this);
    this.hover = new Hover(this);
    connectPointer(this);
    /** Whether the charts show both runs of a pair. */
    this.isPaired = page.runs.length > 1;
    const both = element("both-runs");
    both.parentElement.hidden = !this.isPaired;
    both.addEventListener("change", () => {
      this.isPaired = both.checked;
      this.draw();
    });
    element("charts-png").addEventListener("click", () => saveChartImage(this, "png"));
    element("charts-svg").addEventListener("click", () => saveChartImage(this, "svg"));
    element("csv").addEventListener("click", () => saveCsv(this));
    element("whole-run").addEventListener("click", () => this.zoom(null));
    for (const run of page.runs) run.selection.on(() => objectKey(page.selection.object) !== this.object && this.renew());
    new ResizeObserver(() => !isPrinting && this.container.clientWidth !== this.width && this.draw()).observe(this.container);
  }

  get replayData() {
    return this.page.replayData;
  }

  /** The visible panels. */
  get shown() {
    return this.panels.filter(({ spec }) => (spec === TARGET_PANEL ? this.target : !this.menu.hidden.has(spec.key)));
  }

  /** The runs whose curves are shown. */
  get runs() {
    return this.isPaired ? this.page.runs : [this.page.run];
  }

  /** Ids of the objects of the shown runs that can have curves. */
  idsOf(table) {
    return [...new Set(this.runs.flatMap(({ replayData }) => replayData.ids[table]))].sort((a, b) => a - b);
  }

  /** Whether a kind has so many objects at one time that the charts summarise their curves. */
  isMany(of) {
    return this.runs.some(({ replayData }) => replayData.most[of] > MANY_OBJECTS);
  }

  get shown_s() {
    const firsts_s = this.runs.map(({ replayData }) => replayData.times_s[0] ?? 0);
    const first_s = Math.min(...firsts_s);
    return this.range_s ?? [first_s, Math.max(first_s + 1, ...this.runs.map(({ replayData }) => replayData.end_s))];
  }

  /** The curves of a panel: object, name, style, values. */
  curvesOf(spec) {
    if (spec === TARGET_PANEL) {
      const { times_s, error_m, id } = this.target;
      return [{ of: "targets", id, name: "", note: "error", column: "position_error_m", colour: palette().ink, dash: "solid", factor: 1, times_s, values: error_m }];
    }
    const curves = this.runs.map(({ replayData }) => spec.curves.flatMap((kind) => {
      const all = this.curvesOfKind(kind, spec.factor, replayData);
      if (!this.isMany(kind.of) || this.only[kind.of]?.size) return all.filter((curve) => this.isShown(curve));
      return [...summaryOf(all), ...all.filter((curve) => this.isFront(curve))];
    }));
    return curves.length > 1 ? pairedCurves(curves) : curves[0];
  }

  /** The curves of one kind from one run, with a factor from SI units. */
  curvesOfKind({ of, column, note, dash, ink }, factor, replayData) {
    const curves = (of === "run" ? [0] : replayData.ids[of]).map((id) => {
      const colour = ink ? palette()[ink] : curveColour(replayData, of, id);
      const values = replayData.series(of, column, id);
      return { of, id, name: curveName(of, id), note, column, colour, dash, factor, times_s: replayData.times_s, values };
    });
    return curves.filter(({ values }) => !values.every(Number.isNaN));
  }

  isShown({ of, id }) {
    return !this.only[of]?.size || this.only[of].has(id);
  }

  /** Whether a curve is emphasised. */
  isFront({ of, id }) {
    return this.front?.[of]?.has(id) ?? false;
  }

  /** The plotly traces of a panel; emphasised curves come last, on top. */
  traces(panel) {
    const some = panel.curves.some((curve) => this.isFront(curve));
    const many = panel.curves.length > 6;
    const traces = [];
    const last = new Map();
    for (const curve of panel.curves) {
      const points = thinned(curve.times_s, curve.values, curve.factor, this.range_s);
      if (!points.x.length) continue;
      const ahead = this.isFront(curve);
      const width = ahead ? 2.6 : some ? 1 : many ? 1.1 : 1.5;
      const opacity = curve.of === "run" || ahead ? 1 : some ? 0.3 : many ? 0.75 : 1;
      const style = [curve.of, curve.run, curve.colour, curve.dash, ahead].join();
      const before = last.get(style);
      if (before && before.x.at(-1) < points.x[0]) {
        // Consecutive groups of the same colour share one trace with gaps.
        before.x.push(points.x[0], ...points.x);
        before.y.push(null, ...points.y);
        before.meta.push({ of: curve.of, id: curve.id, column: curve.column });
        continue;
      }
      const trace = {
        ...points, name: [curve.run, curve.name || curve.note].filter(Boolean).join(" "), yaxis: curve.isDifference ? "y2" : "y", meta: [{ of: curve.of, id: curve.id, column: curve.column }],
        type: "scatter", mode: "lines", opacity, connectgaps: false, line: { color: curve.colour, width, dash: curve.dash }, ahead,
      };
      last.set(style, trace);
      traces.push(trace);
    }
    traces.sort((a, b) => a.ahead - b.ahead);
    for (const trace of traces) delete trace.ahead;
    return traces;
  }

  /** Horizontal lines and shaded time ranges of a panel. */
  shapes(spec) {
    const { alarm, none } = palette();
    const levels = spec.levels?.(this.replayData.head.limits) ?? [];
    const shapes = levels.map((level) => ({
      type: "line", xref: "paper", x0: 0, x1: 1, y0: level * spec.factor, y1: level * spec.factor, line: { color: alarm, width: 1, dash: "dash" },
    }));
    if (spec !== TARGET_PANEL) return shapes;
    // Ranges closer together than half a pixel are merged.
    const gap_s = (this.shown_s[1] - this.shown_s[0]) / (2 * this.width);
    const bands = (warning, fillcolor) => this.target.stretches(warning, gap_s).map(([x0, x1]) => (
      { type: "rect", x0, x1, yref: "paper", y0: 0, y1: 1, fillcolor, line: { width: 0 }, layer: "below" }));
    return [...bands("coasting", faded(none, 0.35)), ...bands("out of view", faded(alarm, 0.35)), ...shapes];
  }

  layout({ spec, traces, curves }) {
    const { grid } = palette();
    const levels = spec.levels?.(this.replayData.head.limits).map((level) => level * spec.factor) ?? [];
    const most = traces.flatMap(({ y, yaxis }) => (yaxis === "y" ? y : [])).reduce((a, b) => Math.max(a, b), Math.max(0, ...levels));
    const scale = spec.fromZero ? { range: [0, 1.06 * most || 1] } : {};
    const { height, axes, annotations } = axesOf(curves);
    const look = { gridcolor: grid, zeroline: false, nticks: 5, ticklabeloverflow: "allow" };
    const vertical = Object.fromEntries(Object.entries(axes).map(([name, own]) => [name, { ...look, ...(name === "yaxis" ? scale : {}), ...own }]));
    return {
      width: this.width, height, margin: { l: PLOT_LEFT, r: PLOT_RIGHT, t: PLOT_TOP, b: PLOT_BOTTOM }, ...plotLook(),
      showlegend: false, hovermode: false, dragmode: false, shapes: this.shapes(spec), annotations,
      xaxis: { range: this.shown_s, gridcolor: grid, zeroline: false, showticklabels: false, tickvals: this.ticks() },
      ...vertical,
    };
  }

  /** Round times of the grid lines and the axis labels. */
  ticks() {
    const [first, last] = this.shown_s;
    const rough = (last - first) / Math.max(2, Math.floor((this.width - PLOT_LEFT - PLOT_RIGHT) / 55));
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough);
    const ticks = [];
    for (let k = Math.ceil(first / step - 1e-9); k * step <= last + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)));
    return ticks;
  }

  /** Redraws all panels, because the data, the run, the selection or the theme has changed. */
  async draw() {
    if (!window.Plotly || !this.container.clientWidth) return;
    const round = ++this.round;
    this.width = this.container.clientWidth;
    this.chosen();
    this.legend.show();
    this.axis();
    element("whole-run").hidden = !this.range_s;
    const { shown } = this;
    for (const panel of this.panels) panel.section.hidden = !shown.includes(panel);
    const window_px = this.container.parentElement.getBoundingClientRect();
    const isVisible = (panel) => {
      const box = panel.section.getBoundingClientRect();
      return box.bottom > window_px.top && box.top < window_px.bottom;
    };
    const visible = shown.filter(isVisible);
    for (const panel of [...visible, ...shown.filter((panel) => !visible.includes(panel))]) {
      // Panels that are scrolled out of view do not delay the browser.
      if (!visible.includes(panel)) await new Promise((resolve) => setTimeout(resolve));
      if (round !== this.round) return;
      this.fill(panel);
      await window.Plotly.react(panel.plot, panel.traces, this.layout(panel), CHART_CONFIG);
    }
    this.follow();
  }

  /** Draws all panels for the printer, with a width on the paper; a browser does not wait until `draw` has drawn them. */
  print(width) {
    if (!this.round) return;
    this.round += 1;
    this.width = width;
    this.legend.show();
    this.axis();
    for (const panel of this.shown) {
      this.fill(panel);
      window.Plotly.react(panel.plot, panel.traces, this.layout(panel), CHART_CONFIG);
    }
    this.follow();
  }

  /** Collects the curves, the traces and the heading of a panel. */
  fill(panel) {
    const { spec } = panel;
    const { ink, alarm, none } = palette();
    panel.curves = this.curvesOf(spec);
    panel.traces = this.traces(panel);
    const isDrawn = ({ column, note }) => note && panel.curves.some((curve) => curve.column === column);
    const notes = spec.curves.filter(isDrawn).map(({ dash, note, ink: own }) => [own ? palette()[own] : ink, dash, note]);
    if (spec.level) notes.push([alarm, "dash", spec.level]);
    if (this.isPaired && spec !== TARGET_PANEL) notes.unshift(...palette().runs.map((colour, k) => [colour, "solid", "AB"[k]]));
    panel.name = spec.title;
    if (spec === TARGET_PANEL) {
      const { share, id } = this.target;
      panel.name = `Target ${targetName(this.replayData, id)}`;
      notes.push([alarm, "solid", "out of view"], [none, "solid", "coasting"]);
      if (share < 1) notes.push([none, "dot", `loading, ${Math.floor(100 * share)} %`]);
    }
    panel.head(panel.name, notes);
  }

  /** Updates the charts to the run and the selection of the page. */
  chosen() {
    const { replayData } = this;
    const { object } = this.page.selection;
    if (this.drawnData !== replayData) {
      this.drawnData = replayData;
      this.only.uavs.clear();
      this.only.groups.clear();
      // The time range may be beyond the end of the other run.
      this.range_s = null;
    }
    this.object = objectKey(object);
    const id = object?.kind === "target" ? object.id : null;
    if (this.target && (this.target.id !== id || this.target.replayData !== replayData)) {
      this.target.drop();
      this.target = null;
    }
    if (id !== null) {
      if (!this.target) {
        this.target = new TargetSeries(replayData, id);
        this.container.parentElement.scrollTop = 0;
      }
      this.target.load(() => this.draw());
    }
    this.front = this.frontOf(object);
  }

  /** Ids of the emphasised curves: those of an object, and of the groups or UAVs related to it at any time. */
  frontOf(object) {
    if (!object) return null;
    const { replayData } = this;
    const groupsOf = (uav) => new Set(replayData.series("uavs", "group", uav).filter((group) => !Number.isNaN(group)));
    const sets = {
      uav: () => ({ uavs: new Set([object.id]), groups: groupsOf(object.id) }),
      group: () => ({ uavs: new Set(replayData.ids.uavs.filter((uav) => groupsOf(uav).has(object.id))), groups: new Set([object.id]) }),
      intruder: () => ({ uavs: new Set(replayData.ids.uavs.filter((uav) => replayData.series("uavs", "avoided_intruder", uav).includes(object.id))), groups: new Set() }),
      target: () => ({ uavs: new Set(), groups: this.target.groups }),
    }[object.kind]();
    return { ...sets, key: `${objectKey(object)}: ${[...sets.uavs]}; ${[...sets.groups]}` };
  }

  /** Redraws the charts if they have been drawn before; for the printer, `print` does. */
  renew() {
    if (this.round && !isPrinting) this.draw();
  }

  /** Shows a time range; `null` shows the whole run. */
  zoom(range_s) {
    this.range_s = null;
    const [first, last] = this.shown_s;
    this.range_s = range_s && (range_s[0] > first || range_s[1] < last) ? this.atLeast(range_s) : null;
    this.hover.hide();
    this.draw();
  }

  /** A time range, widened to at least four time steps. */
  atLeast([from_s, to_s]) {
    const missing_s = Math.max(0, 4 * this.replayData.head.period_s - (to_s - from_s));
    return [from_s - missing_s / 2, to_s + missing_s / 2];
  }

  /** Horizontal position of a time, px. */
  pxOf(time_s) {
    const [first, last] = this.shown_s;
    return PLOT_LEFT + ((time_s - first) / (last - first)) * (this.width - PLOT_LEFT - PLOT_RIGHT);
  }

  /** The time under the pointer; `null` outside the plots. */
  timeAt(clientX, isClamped = false) {
    const [first, last] = this.shown_s;
    const x = (clientX - this.container.getBoundingClientRect().left) / pageZoom();
    const share = (x - PLOT_LEFT) / (this.width - PLOT_LEFT - PLOT_RIGHT);
    if (!isClamped && !(share >= 0 && share <= 1)) return null;
    return first + Math.min(Math.max(share, 0), 1) * (last - first);
  }

  /** Moves the line that marks the time shown. */
  follow() {
    if (!this.round) return;
    const { time_s } = this.clock;
    const [first, last] = this.shown_s;
    this.cursor.hidden = !(time_s >= first && time_s <= last);
    this.cursor.style.transform = `translateX(${this.pxOf(time_s)}px)`;
    const now_ms = performance.now();
    if (this.replayData.ids.groups.length > MAX_GROUPS && now_ms - (this.named_ms ?? 0) > 500) {
      this.named_ms = now_ms;
      this.legend.show();
    }
  }

  /** Draws the time axis, which stays visible while the panels scroll. */
  axis() {
    const labels = this.ticks().map((time_s) => {
      const label = document.createElement("span");
      label.append(String(time_s));
      label.style.left = `${this.pxOf(time_s)}px`;
      return label;
    });
    const unit = document.createElement("span");
    unit.className = "unit";
    unit.append("s");
    element("time-axis").replaceChildren(...labels, unit);
  }
}

/** At most `POINTS` points of a curve within a time range, including the extremes of each interval. */
function thinned(times_s, values, factor, range_s) {
  let from = range_s ? Math.max(0, lastNotAfter(times_s, range_s[0])) : 0;
  let to = range_s ? Math.min(times_s.length, lastNotAfter(times_s, range_s[1]) + 2) : times_s.length;
  while (from < to && Number.isNaN(values[from])) from++;
  while (to > from && Number.isNaN(values[to - 1])) to--;
  const interval = to - from <= POINTS ? 1 : Math.ceil((2 * (to - from)) / POINTS);
  const x = [];
  const y = [];
  const put = (k) => {
    x.push(times_s[k]);
    y.push(Number.isNaN(values[k]) ? null : values[k] * factor);
  };
  for (let k = from; k < to; k += interval) {
    const end = Math.min(k + interval, to);
    let [least, most] = [k, k];
    for (let j = k; j < end; j++) {
      if (!(values[j] >= values[least])) least = Number.isNaN(values[j]) ? least : j;
      if (!(values[j] <= values[most])) most = Number.isNaN(values[j]) ? most : j;
    }
    if (interval === 1) put(k);
    else [Math.min(least, most), Math.max(least, most)].forEach(put);
  }
  return { x, y };
}
