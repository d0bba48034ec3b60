// The map: north up. `LAYERS` defines the drawing order.

/** The scene of a map before its first drawn frame. */
const NO_SCENE = { time_s: 0, uavs: [], groups: [], intruders: [], targets: null, detections: [], tentatives: [] };

class MissionMap {
  constructor(canvas, replayData, selection) {
    this.canvas = canvas;
    this.replayData = replayData;
    this.selection = selection;
    this.camera = new Camera();
    this.view = new View(this);
    this.basemap = replayData.head.map ? new Basemap(canvas) : null;
    /** Available layers: background map, buildings, zones, intruders, collision avoidance and detections are optional. */
    const { buildings, zones, has_separation, has_wind, limits } = replayData.head;
    const { tiles: template } = document.body.dataset;
    this.tiles = template && replayData.head.origin ? new Tiles(template, replayData.head.origin) : null;
    const needs = { tiles: this.tiles, basemap: this.basemap, "road-names": this.basemap, buildings, zones, intruders: limits.intruders, avoidance: has_separation, wind: has_wind,
      detections: limits.detections, tentative: limits.detections && !limits.detections.has_labels, blind: limits.detections?.mdv_m_s > 0 };
    this.layers = new LayerChoice(LAYERS.map(([name]) => name).filter((name) => !(name in needs) || needs[name]));
    /** The ruler: `null` if it is switched off, otherwise its ends `from` and `to`, if they have been placed. */
    this.ruler = null;
    /** The map whose view this map copies; `null` if it has its own view. */
    this.leader = null;
    /** Whether another view covers the map. */
    this.isCovered = false;
    /** The scene that is drawn. */
    this.scene = NO_SCENE;
    /** Its visible targets with their positions on the canvas, px. */
    this.drawn = [];
    /** A note on the map while data of the time shown is being loaded. Screen readers read the status line of the page instead. */
    this.note = document.createElement("p");
    this.note.className = "note loading";
    this.note.setAttribute("aria-hidden", "true");
    canvas.after(this.note);
    this.showLoading("Loading the run");
    /** Colours of groups, by group and opacity. */
    this.inks = new Map();
  }

  /** Names of the layers that are drawn for all objects. */
  get shown() {
    return this.layers.shown;
  }

  /** Adapts the canvas to its size on the page; returns whether the size has changed. */
  resize() {
    const ratio = screenRatio();
    const { clientWidth, clientHeight } = this.canvas;
    // The canvas is not on paper.
    if (isPrinting) return false;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width === width && this.canvas.height === height) return false;
    this.canvas.width = width;
    this.canvas.height = height;
    this.camera.width = clientWidth;
    this.camera.height = clientHeight;
    this.cover();
    return true;
  }

  /** Updates the height that the toolbar covers. */
  cover() {
    const tools = document.querySelector(".tools");
    const isOver = getComputedStyle(tools).position === "absolute";
    this.camera.top = isOver ? Math.min(tools.offsetTop + tools.offsetHeight, this.camera.height / 2) : 0;
    this.view.restart();
  }

  /** Shows which data is being loaded; an empty text hides the note. */
  showLoading(text) {
    if (this.note.textContent !== text) this.note.textContent = text;
  }

  /** Draws a scene. */
  draw(scene) {
    this.resize();
    this.scene = scene;
    if (this.leader) this.camera.copyView(this.leader.camera);
    else this.view.keep(scene);
    // The view as data attributes, for tests.
    const { x_m, y_m, px_per_m } = this.camera;
    Object.assign(this.canvas.dataset, { eastM: x_m, northM: y_m, pxPerM: px_per_m });
    this.inks.clear();
    this.drawn = [];
    for (const target of scene.targets ?? []) {
      const [x_m, y_m] = target.tracked ? [target.x_m, target.y_m] : [target.true_x_m, target.true_y_m];
      const [x, y] = this.camera.at(x_m, y_m);
      if (this.camera.shows(x_m, y_m)) this.drawn.push({ target, x, y });
    }
    this.layers.adapt(this.drawn.length, this.camera.width * this.camera.height);
    this.canvas.dataset.symbolScale = this.symbolSize();
    if (!this.isCovered) this.paint(this.canvas.getContext("2d", { alpha: false }), screenRatio());
  }

  /** Draws the scene with `ratio` pixels per CSS pixel, on the screen or for a file (`isExport`). */
  paint(ctx, ratio, isExport = false) {
    const { scene, camera, layers } = this;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = palette().ground;
    ctx.fillRect(0, 0, camera.width, camera.height);
    ctx.lineJoin = "round";
    ctx.font = "12px system-ui, sans-serif";
    const frame = { ctx, scene, labels: new Labels(ctx, camera), size: this.symbolSize(), uavSize: this.uavSize(), isExport };
    for (const [name, , , paint] of LAYERS) {
      if (layers.shown.has(name) || (layers.reduced.has(name) && this.selection.object)) this.painted(ctx, () => paint(this, frame));
    }
    this.painted(ctx, () => drawChosen(this, frame));
    if (this.ruler) this.painted(ctx, () => drawRuler(this, frame));
  }

  /** The visible targets that a layer draws. */
  targetsOf(layer) {
    return this.shown.has(layer) ? this.drawn : this.drawn.filter(({ target }) => this.selection.isChosen("target", target.id));
  }

  /** The UAVs that a layer draws. The flown orbits of many UAVs would be a tangle. */
  uavsOf(layer) {
    return this.shown.has(layer) && layer !== "flown" ? this.scene.uavs : this.scene.uavs.filter(({ id }) => this.selection.isChosen("uav", id));
  }

  /** Calls a draw function and restores the state of the context afterwards. */
  painted(ctx, paint) {
    ctx.save();
    paint();
    ctx.restore();
  }

  /** Scale of the target symbols, at most 1; many visible targets have smaller symbols. */
  symbolSize() {
    const spacing_px = Math.sqrt((this.camera.width * this.camera.height) / Math.max(this.drawn.length, 1));
    return Math.min(Math.max(spacing_px / 110, 0.5), 1);
  }

  /** Scale of the UAV symbols, at most 1; more than 140 visible UAVs on a map of 500,000 px\u00b2 have smaller symbols. */
  uavSize() {
    const visible = this.scene.uavs.filter(({ x_m, y_m }) => this.camera.shows(x_m, y_m)).length;
    return Math.min(Math.max(Math.sqrt((this.camera.width * this.camera.height) / Math.max(visible, 1)) / 60, 0.35), 1);
  }

  /** The colour of a group with an opacity; fainter if another group is highlighted. */
  ink(group, opacity = 1) {
    const key = `${group} ${opacity}`;
    if (!this.inks.has(key)) {
      const colour = groupColour(this.replayData, group);
      const alpha = opacity * (this.selection.passes(group) ? 1 : 0.15);
      this.inks.set(key, alpha < 1 ? faded(colour, alpha) : colour);
    }
    return this.inks.get(key);
  }

  /** The step of the grid, m. */
  step_m() {
    return roundStep(90 / this.camera.px_per_m);
  }

  /** An end of the ruler at a position of the canvas: on the UAV, target or intruder there, or at a fixed position of the plane. */
  rulerEnd(x, y) {
    const object = objectsAt(this, x, y).find(({ kind, part }) => kind !== "group" && !HOVER_ONLY.has(kind) && !part);
    const end = { at: this.camera.world(x, y), object: object && { kind: object.kind, id: object.id } };
    return { ...end, at: this.rulerPosition(end) };
  }

  /** Position of an end of the ruler, m. An object that does not exist leaves the end where it was. */
  rulerPosition(end) {
    const position = end.object && positionOf(this.scene, end.object);
    if (position) end.at = position;
    return end.at;
  }

  /** Text of the ruler: the objects at its ends, distance, and compass bearing from its start. */
  measured() {
    const { from, to } = this.ruler ?? {};
    if (!from || !to) return "";
    const [a, b] = [from, to].map((end) => this.rulerPosition(end));
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const compass_deg = ((Math.atan2(dx, dy) * 180) / Math.PI + 360) % 360;
    const names = [from, to].map(({ object }) => (object ? objectName(this.replayData, object) : "point"));
    const ends = from.object || to.object ? `${names.join(" to ")}: ` : "";
    return `${ends}${formatDistance(Math.hypot(dx, dy))}, bearing ${compass_deg.toFixed(0).padStart(3, "0")}\u00b0`;
  }
}

/** Draws a ring about the selected object; for a group it also highlights the orbit. */
function drawChosen(map, { ctx, scene }) {
  const { object } = map.selection;
  const position = object && positionOf(scene, object);
  if (!position) return;
  const [x, y] = map.camera.at(...position);
  const { ground, ink } = palette();
  const r = object.kind === "uav" || object.kind === "intruder" ? 19 : 14;
  const rings = [[ground, 5, r], [ink, 2, r]];
  // The highlight is translucent, so that the orbit stays visible.
  if (object.kind === "group") rings.push([faded(ink, 0.25), 9, objectIn(scene, object).standoff_distance_m * map.camera.px_per_m]);
  for (const [colour, width, r] of rings) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = width;
    ctx.beginPath();
    addDisc(ctx, x, y, r);
    ctx.stroke();
  }
}

function drawRuler(map, { ctx, labels }) {
  const { from, to } = map.ruler;
  if (!from || !to) return;
  const [[x, y], [x2, y2]] = [from, to].map((end) => map.camera.at(...map.rulerPosition(end)));
  ctx.strokeStyle = ctx.fillStyle = palette().alarm;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.lineTo(x2, y2);
  addPlus(ctx, x, y, 5);
  addPlus(ctx, x2, y2, 5);
  ctx.stroke();
  ctx.font = "600 13px system-ui, sans-serif";
  labels.writeInside(map.measured(), x2 + 10, y2 - 12);
}
