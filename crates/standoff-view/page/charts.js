// Charts over time, linked to the time shown. They are drawn by plotly.js.

/** Most points of a curve; of more, the least and the most of each stretch are shown. */
const POINTS = 1500;
/** Room at the left and the right of the plots, px. */
const LEFT = 58;
const RIGHT = 12;
const PANEL_HEIGHT = 128;

/** What one panel shows: title, unit, factor, curves. A curve is of UAVs or of groups, with the column it shows. */
const PANELS = [
  { title: "Line of sight (\u00b0)", factor: DEGREES, of: "uavs", column: "line_of_sight_rad",
    levels: (limits) => [limits.field_of_view_rad / 2] },
  { title: "Standoff distance (m)", factor: 1, of: "groups", column: "standoff_distance_m", also: "centre_distance_m",
    levels: (limits) => [limits.radius_min_m, limits.radius_max_m] },
  { title: "Standoff error (m)", factor: 1, of: "uavs", column: "standoff_error_m", levels: () => [0] },
  { title: "Phase separation (\u00b0)", factor: DEGREES, of: "groups", column: "phase_rad", wanted: "phase_wanted_rad" },
  { title: "Speed (m/s)", factor: 1, of: "uavs", column: "speed_m_s",
    levels: (limits) => [limits.speed_min_m_s, limits.speed_max_m_s] },
  { title: "Turn rate (\u00b0/s)", factor: DEGREES, of: "uavs", column: "turn_rate_rad_s",
    levels: (limits) => [-limits.turn_rate_max_rad_s, limits.turn_rate_max_rad_s] },
  { title: "Position error, bound (m)", factor: 1, of: "groups", column: "position_error_m", wanted: "position_bound_m" },
  { title: "One scan tells to (m)", factor: 1, of: "groups", column: "scan_sd_m" },
];

class Charts {
  constructor(page) {
    this.page = page;
    this.clock = page.clock;
    this.place = element("charts");
    this.cursor = element("cursor");
    this.drawn = false;
    this.range_s = null;
    element("png").addEventListener("click", () => this.savePng());
    element("csv").addEventListener("click", () => this.saveCsv());
    this.place.addEventListener("click", (click) => this.clicked(click));
  }

  get film() {
    return this.page.film;
  }

  /** The curves: name, what it belongs to, panel, dash, values. */
  *curves() {
    const { film } = this;
    for (const [index, panel] of PANELS.entries()) {
      for (const id of film.ids[panel.of]) {
        const name = panel.of === "uavs" ? `UAV ${id}` : `group ${id}`;
        const colour = panel.of === "uavs" ? uavColour(film, id) : groupColour(film, id);
        const curve = (column, dash) => ({
          name, colour, dash, index, column, table: panel.of, id, factor: panel.factor,
          values: film.series(panel.of, column, id),
        });
        yield curve(panel.column, "solid");
        if (panel.wanted) yield curve(panel.wanted, "dash");
      }
      if (panel.also) {
        for (const id of film.ids.uavs) {
          yield {
            name: `UAV ${id}`, colour: uavColour(film, id), dash: "dot", index, column: panel.also, table: "uavs", id,
            factor: panel.factor, values: film.series("uavs", panel.also, id),
          };
        }
      }
    }
  }

  traces() {
    const named = new Set();
    const traces = [];
    for (const curve of this.curves()) {
      if (curve.values.every(Number.isNaN)) continue;
      const { x, y } = thinned(this.film.times_s, curve.values, curve.factor, this.range_s);
      const panel = PANELS[curve.index];
      traces.push({
        x, y, name: curve.name, legendgroup: curve.name, showlegend: !named.has(curve.name), type: "scatter", mode: "lines",
        line: { color: curve.colour, width: 1.3, dash: curve.dash },
        xaxis: "x", yaxis: axis(curve.index), connectgaps: false,
        hovertemplate: `${curve.name}: %{y:.4~g}<extra>${panel.title}${curve.dash === "dash" ? ", wanted or bound" : ""}</extra>`,
      });
      named.add(curve.name);
    }
    return traces;
  }

  layout() {
    const colours = palette();
    const panels = PANELS.length;
    const names = this.film.ids.uavs.length + this.film.ids.groups.length;
    // The legend stands above the plots and the first title, in as many rows as it needs.
    const top = 40 + 19 * Math.ceil((names * 88) / Math.max(this.place.clientWidth - LEFT - RIGHT, 88));
    const layout = {
      height: PANEL_HEIGHT * panels + top + 34,
      margin: { l: LEFT, r: RIGHT, t: top, b: 34 },
      ...plotLook(),
      hovermode: "x",
      hoverlabel: { namelength: -1 },
      legend: { orientation: "h", y: 1 + 16 / (PANEL_HEIGHT * panels), yanchor: "bottom", entrywidth: 60, itemclick: "toggleothers", itemdoubleclick: "toggle" },
      xaxis: { title: { text: "Time (s)" }, gridcolor: colours.grid, anchor: axis(panels - 1), zeroline: false,
        range: this.range_s ?? [this.film.times_s[0] ?? 0, Math.max(this.film.end_s, 1)] },
      shapes: [],
      annotations: [],
      uirevision: "same",
    };
    PANELS.forEach((panel, index) => {
      const top = 1 - index / panels;
      layout[`yaxis${index ? index + 1 : ""}`] = {
        domain: [top - 0.8 / panels, top - 0.02 / panels], gridcolor: colours.grid, zeroline: false, nticks: 5,
        rangemode: index === 0 ? "tozero" : "normal",
      };
      layout.annotations.push({
        text: panel.title, xref: "paper", yref: "paper", x: 0, y: top - 0.01 / panels, xanchor: "left", yanchor: "bottom",
        showarrow: false, font: { size: 11, color: colours.faint },
      });
      for (const level of panel.levels?.(this.film.head.limits) ?? []) {
        layout.shapes.push({
          type: "line", xref: "paper", x0: 0, x1: 1, yref: axis(index), y0: level * panel.factor, y1: level * panel.factor,
          line: { color: colours.alarm, width: 1, dash: "dash" },
        });
      }
    });
    return layout;
  }

  /** Draws everything anew: for the first time, or because there is more, or another theme. */
  async draw() {
    if (!window.Plotly || !this.place.clientWidth) return;
    await window.Plotly.react(this.place, this.traces(), this.layout(), PLOT_CONFIG);
    if (!this.drawn) {
      this.drawn = true;
      this.place.on("plotly_relayout", (change) => this.zoomed(change));
    }
    this.follow();
  }

  /** In the theme that is on now, if there is anything. */
  renew() {
    if (this.drawn) this.draw();
  }

  /** Of another stretch of time, other points are shown. */
  zoomed(change) {
    // A drag changes the ends one by one, a double click both at once.
    const range_s = (change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]]).map(Number);
    const known = range_s.every(Number.isFinite);
    if (!known && !change["xaxis.autorange"]) return;
    const isPart = known && (range_s[0] > this.film.times_s[0] || range_s[1] < this.film.end_s);
    this.range_s = isPart ? range_s : null;
    this.draw();
  }

  get shown_s() {
    return this.place.layout?.xaxis?.range?.map(Number) ?? [0, 1];
  }

  /** Moves the line of the time shown. */
  follow() {
    if (!this.drawn) return;
    const [first, last] = this.shown_s;
    const share = (this.clock.time_s - first) / (last - first);
    this.cursor.hidden = !(share >= 0 && share <= 1);
    this.cursor.style.left = `${LEFT + share * (this.place.clientWidth - LEFT - RIGHT)}px`;
  }

  /** A click on a plot shows that time. */
  clicked(click) {
    if (!this.drawn || !click.target.closest(".nsewdrag, .plotly .draglayer")) return;
    const box = this.place.getBoundingClientRect();
    const share = (click.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    const [first, last] = this.shown_s;
    if (share >= 0 && share <= 1) this.clock.seek(first + share * (last - first));
  }

  savePng() {
    const { scenario, seed } = this.film.head;
    const filename = fileName(`${scenario}-${seed}`);
    window.Plotly?.downloadImage(this.place, { format: "png", filename, scale: 2, width: 1000, height: this.layout().height });
  }

  /** Every curve at every instant, SI units. */
  saveCsv() {
    const { film } = this;
    const curves = [...this.curves()];
    const heads = ["time_s", ...curves.map((curve) => `${curve.table === "uavs" ? "uav" : "group"}_${curve.id}_${curve.column}`)];
    const number = (value) => (Number.isNaN(value) ? "" : String(Number(value.toPrecision(7))));
    const lines = film.times_s.map((time_s, k) => [time_s, ...curves.map((curve) => number(curve.values[k]))].join(","));
    save(`${fileName(`${film.head.scenario}-${film.head.seed}`)}.csv`, `${[heads.join(","), ...lines].join("\n")}\n`, "text/csv");
  }
}

function axis(index) {
  return `y${index ? index + 1 : ""}`;
}

/** At most `POINTS` points of a curve within a range of time, the extremes of each stretch among them. */
function thinned(times_s, values, factor, range_s) {
  const from = range_s ? Math.max(0, lastNotAfter(times_s, range_s[0])) : 0;
  const to = range_s ? Math.min(times_s.length, lastNotAfter(times_s, range_s[1]) + 2) : times_s.length;
  const stretch = to - from <= POINTS ? 1 : Math.ceil((2 * (to - from)) / POINTS);
  const x = [];
  const y = [];
  const put = (k) => {
    x.push(times_s[k]);
    y.push(Number.isNaN(values[k]) ? null : values[k] * factor);
  };
  for (let k = from; k < to; k += stretch) {
    const end = Math.min(k + stretch, to);
    let [least, most] = [k, k];
    for (let j = k; j < end; j++) {
      if (!(values[j] >= values[least])) least = Number.isNaN(values[j]) ? least : j;
      if (!(values[j] <= values[most])) most = Number.isNaN(values[j]) ? most : j;
    }
    if (stretch === 1) put(k);
    else [Math.min(least, most), Math.max(least, most)].forEach(put);
  }
  return { x, y };
}
