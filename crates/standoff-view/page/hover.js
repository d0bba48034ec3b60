// The box beside the pointer: what the curves of a panel are at the time under it.

class Hover {
  /** Most curves that are told. */
  static MOST = 10;

  constructor(charts) {
    this.charts = charts;
    this.box = element("hover");
    this.hair = element("hair");
  }

  hide() {
    this.box.hidden = this.hair.hidden = true;
  }

  /** Tells of a panel at a place on the screen. */
  show(panel, clientX, clientY) {
    const { charts } = this;
    const time_s = charts.timeAt(clientX);
    const told = panel && time_s !== null ? this.values(panel, time_s) : null;
    if (!told) {
      this.hide();
      return;
    }
    const { instant_s, values } = told;
    const box = panel.plot.getBoundingClientRect();
    const [low, high] = panel.plot.layout.yaxis.range;
    const y = (clientY - box.top) / pageZoom();
    const under = high - ((y - PLOT_TOP) / (PLOT_HEIGHT - PLOT_TOP - PLOT_BOTTOM)) * (high - low);
    const near = [...values].sort((a, b) => Math.abs(a.value - under) - Math.abs(b.value - under));
    const shown = near.slice(0, Hover.MOST).sort((a, b) => b.value - a.value);
    const line = (value) => {
      const row = document.createElement("div");
      row.className = value === near[0] && values.length > 1 ? "nearest" : "";
      const number = document.createElement("span");
      number.append(`${figure(value.value)}${panel.spec.unit.startsWith("\u00b0") ? "" : "\u00a0"}${panel.spec.unit}`);
      row.append(stroke(value.curve.colour, value.curve.dash), value.words, number);
      return row;
    };
    const title = document.createElement("strong");
    title.append(`${instant_s.toFixed(1)} s`);
    const rest = values.length > shown.length ? [`and ${values.length - shown.length} more`] : [];
    this.box.replaceChildren(title, ` ${panel.name}`, ...shown.map(line), ...rest);
    this.box.hidden = this.hair.hidden = false;
    this.hair.style.left = `${charts.pxOf(instant_s)}px`;
    this.put(clientX, clientY);
  }

  /** The values there are at the instant nearest to a time. */
  values(panel, time_s) {
    const { film } = this.charts;
    const before = film.instant(time_s);
    const [a, b] = [film.times_s[before], film.times_s[before + 1]];
    const instant_s = b !== undefined && b - time_s < time_s - a ? b : a;
    const values = [];
    for (const curve of panel.curves) {
      const k = lastNotAfter(curve.times_s, instant_s);
      const value = k < 0 ? NaN : curve.values[k] * curve.factor;
      if (!Number.isNaN(value)) values.push({ curve, value, words: `${curve.name} ${curve.note}`.trim() });
    }
    return values.length ? { instant_s, values } : null;
  }

  /** Beside the pointer, on the side with room, and wholly inside the charts' panel. */
  put(clientX, clientY) {
    const pane = element("panel-charts").getBoundingClientRect();
    const { width, height } = this.box.getBoundingClientRect();
    const gap = 14;
    const left = clientX + gap + width <= pane.right ? clientX + gap : clientX - gap - width;
    const top = clientY + gap + height <= pane.bottom ? clientY + gap : clientY - gap - height;
    this.box.style.left = `${Math.max(pane.left, Math.min(left, pane.right - width)) / pageZoom()}px`;
    this.box.style.top = `${Math.max(pane.top, Math.min(top, pane.bottom - height)) / pageZoom()}px`;
  }
}

/** A number with four digits that count, and no more than needed. */
function figure(value) {
  const digits = Math.max(0, Math.min(3, 3 - Math.floor(Math.log10(Math.max(Math.abs(value), 1e-9)))));
  return Number.isInteger(value) ? String(value).replace("-", "\u2212") : value.toFixed(digits).replace("-", "\u2212");
}
