// The tooltip of the charts: values of the curves of a panel at the time under the pointer.

class Hover {
  /** Maximum number of curves in the tooltip. */
  static MAX_CURVES = 10;

  constructor(charts) {
    this.charts = charts;
    this.box = element("chart-tooltip");
    this.hair = element("crosshair");
  }

  hide() {
    this.box.hidden = this.hair.hidden = true;
  }

  /** Shows the values of a panel at a position on the screen. */
  show(panel, clientX, clientY) {
    const { charts } = this;
    const time_s = charts.timeAt(clientX);
    const found = panel && time_s !== null ? this.values(panel, time_s) : null;
    if (!found) {
      this.hide();
      return;
    }
    const { step_s, values } = found;
    const box = panel.plot.getBoundingClientRect();
    const y = (clientY - box.top) / pageZoom();
    const off = ({ curve, value }) => Math.abs(heightOf(panel.plot.layout, curve, value) - y);
    const near = [...values].sort((a, b) => off(a) - off(b));
    const shown = near.slice(0, Hover.MAX_CURVES).sort((a, b) => b.value - a.value);
    const line = (value) => {
      const row = document.createElement("div");
      row.className = value === near[0] && values.length > 1 ? "nearest" : "";
      const number = document.createElement("span");
      number.append(`${formatValue(value.value)}${panel.spec.unit.startsWith("\u00b0") ? "" : "\u00a0"}${panel.spec.unit}`);
      row.append(stroke(value.curve.colour, value.curve.dash), value.label, number);
      return row;
    };
    const title = document.createElement("strong");
    title.append(`${step_s.toFixed(1)} s`);
    const rest = values.length > shown.length ? [`and ${values.length - shown.length} more`] : [];
    this.box.replaceChildren(title, ` ${panel.name}`, ...shown.map(line), ...rest);
    this.box.hidden = this.hair.hidden = false;
    this.hair.style.left = `${charts.pxOf(step_s)}px`;
    this.put(clientX, clientY);
  }

  /** The values of the curves at the time step nearest to a time; `null` if there are none. */
  values(panel, time_s) {
    const { replayData } = this.charts;
    const before = replayData.stepAt(time_s);
    const [a, b] = [replayData.times_s[before], replayData.times_s[before + 1]];
    const step_s = b !== undefined && b - time_s < time_s - a ? b : a;
    const values = [];
    for (const curve of panel.curves) {
      const k = lastNotAfter(curve.times_s, step_s);
      const isOver = step_s > curve.times_s.at(-1) + 1e-9;
      const value = k < 0 || isOver ? NaN : curve.values[k] * curve.factor;
      if (!Number.isNaN(value)) values.push({ curve, value, label: [curve.run, curve.name, curve.note].filter(Boolean).join(" ") });
    }
    return values.length ? { step_s, values } : null;
  }

  /** Places the tooltip next to the pointer, on the side with enough space, and inside the panel of the charts. */
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

/** Vertical position of a value of a curve in its plot, px from the top. */
function heightOf(layout, { isDifference }, value) {
  const { range, domain = [0, 1] } = isDifference ? layout.yaxis2 : layout.yaxis;
  const share = domain[0] + ((value - range[0]) / (range[1] - range[0])) * (domain[1] - domain[0]);
  return PLOT_TOP + (1 - share) * (layout.height - PLOT_TOP - PLOT_BOTTOM);
}

/** Formats a number with up to four significant digits. */
function formatValue(value) {
  const digits = Math.max(0, Math.min(3, 3 - Math.floor(Math.log10(Math.max(Math.abs(value), 1e-9)))));
  return Number.isInteger(value) ? String(value).replace("-", "\u2212") : value.toFixed(digits).replace("-", "\u2212");
}
