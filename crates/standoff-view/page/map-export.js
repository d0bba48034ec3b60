// Export of the map: an image at twice the resolution of the screen, or an SVG file, with the legend of the layers.

/** Height of the line with the name of the run and the time below the map, and of a row of the legend, px. */
const CAPTION_HEIGHT = 26;
const LEGEND_ROW = 26;
/** Smallest width of a column of the legend, px. */
const LEGEND_COLUMN = 300;

/** Size of an exported map, px: that of the map, with space for caption and legend. */
function exportSize({ camera }, entries) {
  const columns = Math.max(Math.floor(camera.width / LEGEND_COLUMN), 1);
  const rows = Math.ceil(entries.length / columns);
  return { columns, width: camera.width, height: camera.height + CAPTION_HEIGHT + rows * LEGEND_ROW + 8 };
}

/** Draws the map with the scale, the name of the run, the time, and the legend, with `ratio` pixels per CSS pixel. */
function drawExport({ map, replayData, clock }, ctx, ratio) {
  const entries = legendOf(map);
  const { columns, width, height } = exportSize(map, entries);
  const { ground, ink } = palette();
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.fillStyle = ground;
  ctx.fillRect(0, 0, width, height);
  // Fields of view and orbits may reach beyond the map.
  ctx.save();
  ctx.beginPath();
  ctx.rect(0, 0, width, map.camera.height);
  ctx.clip();
  map.paint(ctx, ratio, true);
  if (!map.shown.has("grid")) map.painted(ctx, () => drawScale(map, ctx));
  ctx.restore();
  const state = replayData.agents.isSeveral ? `, ${teamStateText(replayData, replayData.stepAt(clock.time_s))}` : "";
  drawCaption(ctx, width, map.camera.height, `${runName(replayData.head)}${state}`, clock.time_s);
  entries.forEach((entry, k) => {
    const x = 10 + (k % columns) * (width / columns);
    const y = map.camera.height + CAPTION_HEIGHT + Math.floor(k / columns) * LEGEND_ROW;
    drawSample(ctx, x, y + (LEGEND_ROW - SAMPLE_HEIGHT) / 2, entry, replayData.head);
    ctx.font = "11px system-ui, sans-serif";
    ctx.fillStyle = ink;
    ctx.textAlign = "left";
    ctx.textBaseline = "middle";
    ctx.fillText(entry[1], x + SAMPLE_WIDTH + 8, y + LEGEND_ROW / 2, width / columns - SAMPLE_WIDTH - 28);
  });
}

/** Draws the line below a map: a name and the time. */
function drawCaption(ctx, width, top, name, time_s) {
  const { ink, grid } = palette();
  ctx.fillStyle = grid;
  ctx.fillRect(0, top, width, 1);
  ctx.font = "12px system-ui, sans-serif";
  ctx.fillStyle = ink;
  ctx.textBaseline = "middle";
  ctx.textAlign = "left";
  ctx.fillText(name, 10, top + CAPTION_HEIGHT / 2, width - 100);
  ctx.textAlign = "right";
  ctx.fillText(`${time_s.toFixed(1)} s`, width - 10, top + CAPTION_HEIGHT / 2);
}

/** File name of an exported map, without its extension. */
function exportName({ replayData, clock }) {
  return fileName(`${runName(replayData.head)}-map-${clock.time_s.toFixed(1)} s`);
}

/** A canvas with the map and its legend, with `ratio` pixels per CSS pixel. */
function exportedMap(page, ratio) {
  const { width, height } = exportSize(page.map, legendOf(page.map));
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height].map((side) => Math.round(side * ratio));
  drawExport(page, canvas.getContext("2d", { alpha: false }), ratio);
  return canvas;
}

/** Saves the map, or the scene in three dimensions, as PNG at twice the resolution of the screen. */
async function saveMapImage(page) {
  if (page.is3d) {
    const { plot } = page.views3d[page.runs.indexOf(page.run)];
    const { clientWidth: width, clientHeight: height } = plot;
    await window.Plotly.downloadImage(plot, { format: "png", filename: exportName(page), scale: 2, width, height });
    return;
  }
  const canvas = exportedMap(page, 2 * screenRatio());
  const image = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  if (!image) return element("search-result").replaceChildren("The map is too large for an image");
  return save(`${exportName(page)}.png`, image, "image/png");
}

/** Saves the map as SVG. */
function saveMapSvg(page) {
  const { width, height } = exportSize(page.map, legendOf(page.map));
  const ctx = new SvgContext(width, height);
  drawExport(page, ctx, 1);
  save(`${exportName(page)}.svg`, ctx.text(), "image/svg+xml");
}

/** Properties of a context that `save` and `restore` keep. */
const SVG_STATE = ["strokeStyle", "fillStyle", "lineWidth", "lineJoin", "lineCap", "font", "textAlign", "textBaseline", "dash", "clipId", "k", "dx", "dy", "turn_rad"];

/** The part of `CanvasRenderingContext2D` that the draw functions of the map use; it writes SVG elements. */
class SvgContext {
  constructor(width, height) {
    Object.assign(this, { width, height, strokeStyle: "#000000", fillStyle: "#000000", lineWidth: 1, lineJoin: "miter", lineCap: "butt",
      font: "12px sans-serif", textAlign: "left", textBaseline: "alphabetic", dash: [], clipId: 0, k: 1, dx: 0, dy: 0, turn_rad: 0 });
    this.elements = [];
    this.clips = 0;
    this.states = [];
    this.path = [];
    this.measuring = document.createElement("canvas").getContext("2d");
  }

  save() {
    this.states.push(SVG_STATE.map((name) => this[name]));
  }

  restore() {
    const state = this.states.pop();
    SVG_STATE.forEach((name, index) => (this[name] = state[index]));
  }

  /** Only uniform scaling and translation are supported. */
  setTransform(k, b, c, d, dx, dy) {
    Object.assign(this, { k, dx, dy });
  }

  translate(x, y) {
    this.dx += this.k * x;
    this.dy += this.k * y;
  }

  scale(k) {
    this.k *= k;
  }

  /** Only texts are rotated. */
  rotate(angle_rad) {
    this.turn_rad += angle_rad;
  }

  setLineDash(dash) {
    this.dash = dash;
  }

  beginPath() {
    this.path = [];
  }

  closePath() {
    if (this.path.length) this.path.push("Z");
  }

  at(x, y) {
    return `${svgNumber(this.k * x + this.dx)} ${svgNumber(this.k * y + this.dy)}`;
  }

  moveTo(x, y) {
    this.path.push(`M${this.at(x, y)}`);
  }

  lineTo(x, y) {
    this.path.push(`${this.path.length ? "L" : "M"}${this.at(x, y)}`);
  }

  rect(x, y, width, height) {
    this.path.push(`M${this.at(x, y)}L${this.at(x + width, y)}L${this.at(x + width, y + height)}L${this.at(x, y + height)}Z`);
  }

  arc(x, y, r, from_rad, to_rad) {
    this.ellipse(x, y, r, r, 0, from_rad, to_rad);
  }

  ellipse(x, y, rx, ry, turn_rad, from_rad, to_rad) {
    const on = (angle_rad) => {
      const [u, v] = [rx * Math.cos(angle_rad), ry * Math.sin(angle_rad)];
      return [x + u * Math.cos(turn_rad) - v * Math.sin(turn_rad), y + u * Math.sin(turn_rad) + v * Math.cos(turn_rad)];
    };
    this.lineTo(...on(from_rad));
    // An arc of SVG must be shorter than a full turn.
    const half_rad = (to_rad - from_rad) / 2;
    for (const end_rad of [from_rad + half_rad, to_rad]) {
      const shape = `${svgNumber(this.k * rx)} ${svgNumber(this.k * ry)} ${svgNumber((turn_rad * 180) / Math.PI)}`;
      this.path.push(`A${shape} ${half_rad > Math.PI ? 1 : 0} 1 ${this.at(...on(end_rad))}`);
    }
  }

  add(name, attributes, text) {
    const clip = this.clipId ? { "clip-path": `url(#clip-${this.clipId})` } : {};
    const words = Object.entries({ ...attributes, ...clip }).map(([key, value]) => ` ${key}="${value}"`).join("");
    this.elements.push(text === undefined ? `<${name}${words}/>` : `<${name}${words}>${escapeXml(text)}</${name}>`);
  }

  fill(rule) {
    if (this.path.length) this.add("path", { d: this.path.join(""), ...svgPaint("fill", this.fillStyle), ...(rule === "evenodd" ? { "fill-rule": rule } : {}) });
  }

  stroke() {
    if (this.path.length) this.add("path", { d: this.path.join(""), fill: "none", ...this.strokeAttributes() });
  }

  strokeAttributes() {
    const dash = this.dash.length ? { "stroke-dasharray": this.dash.map((value) => svgNumber(this.k * value)).join(" ") } : {};
    return { ...svgPaint("stroke", this.strokeStyle), "stroke-width": svgNumber(this.k * this.lineWidth), "stroke-linejoin": this.lineJoin,
      "stroke-linecap": this.lineCap, ...dash };
  }

  clip() {
    const inner = this.clipId ? ` clip-path="url(#clip-${this.clipId})"` : "";
    this.clips += 1;
    this.clipId = this.clips;
    this.elements.push(`<clipPath id="clip-${this.clipId}"${inner}><path d="${this.path.join("")}"/></clipPath>`);
  }

  fillRect(x, y, width, height) {
    const [left, top] = this.at(x, y).split(" ");
    this.add("rect", { x: left, y: top, width: svgNumber(this.k * width), height: svgNumber(this.k * height), ...svgPaint("fill", this.fillStyle) });
  }

  measureText(text) {
    this.measuring.font = this.font;
    return this.measuring.measureText(text);
  }

  fillText(text, x, y, limit) {
    this.addText(text, x, y, limit, svgPaint("fill", this.fillStyle));
  }

  strokeText(text, x, y, limit) {
    this.addText(text, x, y, limit, { fill: "none", ...this.strokeAttributes() });
  }

  addText(text, x, y, limit, look) {
    const [left, top] = this.at(x, y).split(" ");
    const [, weight = "", size] = this.font.match(/^(\d+ )?([\d.]+)px/);
    const fit = limit < this.measureText(text).width ? { textLength: svgNumber(this.k * limit), lengthAdjust: "spacingAndGlyphs" } : {};
    const turn = this.turn_rad ? { transform: `rotate(${svgNumber((this.turn_rad * 180) / Math.PI)} ${left} ${top})` } : {};
    const baseline = { middle: "central", bottom: "text-after-edge" }[this.textBaseline];
    this.add("text", {
      x: left, y: top, "font-family": "system-ui, sans-serif", "font-size": svgNumber(this.k * size), ...(weight ? { "font-weight": weight.trim() } : {}),
      "text-anchor": { left: "start", center: "middle", right: "end" }[this.textAlign] ?? "start",
      ...(baseline ? { "dominant-baseline": baseline } : {}), ...fit, ...turn, ...look,
    }, text);
  }

  /** The contents of the file. */
  text() {
    const [width, height] = [this.width, this.height].map(svgNumber);
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}">\n${this.elements.join("\n")}\n</svg>\n`;
  }
}

/** A number of an SVG file, with two decimals. */
function svgNumber(value) {
  return Number.isFinite(value) ? Number(value.toFixed(2)) : 0;
}

/** Attributes of a colour, whose opacity is a separate attribute in SVG. */
function svgPaint(what, colour) {
  const [, r, g, b, opacity] = colour.match(/^rgba\((\d+), ?(\d+), ?(\d+), ?([\d.]+)\)$/) ?? [];
  return r === undefined ? { [what]: colour } : { [what]: `rgb(${r},${g},${b})`, [`${what}-opacity`]: opacity };
}

/** Text of an XML file, without characters that XML does not allow. */
function escapeXml(text) {
  const plain = String(text).replace(/[\p{Cc}\p{Cs}\ufffe\uffff]/gu, "\ufffd");
  return plain.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}
