// Layers of the map, from bottom to top, and the presets that select them.

/** Layers that the user can switch on and off: name, title, tooltip, draw function. */
const LAYERS = [
  ["tiles", "Map tiles", "Background images of the tile server given with --tiles", drawTiles],
  ["basemap", "Roads and buildings", "Background map of the scenario or of the option --map",
    (map, { ctx, isExport }) => (isExport ? map.basemap?.drawWhole(ctx, map.camera) : map.basemap?.draw(ctx, map.camera))],
  ["buildings", "Buildings", "Buildings that hide targets from the sensors; darker if they are higher", drawBuildings],
  ["grid", "Grid and scale", "Grid lines at round distances; the scale bar at the lower left is one grid step", drawGrid],
  ["wind", "Wind", "Arrow at the lower left: direction of the wind, as the mean at the UAVs", drawWind],
  ["zones", "Zones", "Keep-out zones (hatched) and keep-in zones (dashed outline) of the geofence, and areas of interest (dotted outline)", drawZones],
  ["truth", "True targets", "True positions of the targets, which the UAVs do not know", drawTruth],
  ["target-trails", "Target trails", `Positions of the target tracks during the last ${TRAIL_S} s, in the colour of the group`,
    drawTargetTrails],
  ["trails", "UAV trails", `Positions of the UAVs during the last ${TRAIL_S} s`, drawTrails],
  ["desired", "Desired orbits", "Circle of radius r_d about the estimated centre of each group; dashed if no orbit satisfies the constraints",
    drawDesired],
  ["flown", "Flown orbit", "Last revolution of the selected UAV relative to its group centre, drawn about the current centre", drawFlown],
  ["views", "Fields of view", "Field of view of each UAV, in the colour of the group that it is assigned to; in the colour of the UAV " +
    "while it is on its way", drawViews],
  ["radio", "Radio links", "Line: both UAVs receive each other's reports (with more than " +
    `${MAX_LINKED} UAVs, only for the selected UAV); arrow: only the UAV at the tip receives reports; red dots: neither does`, drawRadio],
  ["ellipses", "95 % ellipses", "95 % confidence ellipses of target positions; faint for targets in no group",
    drawEllipses],
  ["vectors", "Velocity vectors", `Predicted motion over ${AHEAD_S} s: targets with constant estimated velocity, ` +
    "UAVs with constant speed and turn rate", drawVectors],
  ["tracks", "Tracks", "Estimated target positions in the team state; the legend on the map explains the symbols", drawTracks],
  ["uavs", "UAVs", "The nose points along the heading; a cross marks the last known position of a UAV in an outage", drawUavs],
  ["tentative", "Tentative tracks and gates", "Faint triangles: tracks that may be of no target, and are in no group until they are confirmed; " +
    "dotted ellipses: gates of the selected track, in which the detections of a UAV are associated with it", drawTentative],
  ["detections", "Detections", "Measured positions of the current time step, in the colour of the UAV: plus, or diamond for a false alarm", drawDetections],
  ["blind", "Blind zone", "Slash: target whose true radial speed over ground is below the minimum detectable velocity (MDV), at which half of the detections " +
    "are left, for all UAVs that have it in view, or for the selected UAV", drawBlind],
  ["avoidance", "Collision avoidance", "Dashed red line: the UAV at the dot deviates from its orbit command to avoid the other UAV or the intruder",
    drawAvoidance],
  ["intruders", "Intruders", "Aircraft outside the team, drawn as arrowheads with their numbers; hollow while the transponder is off",
    drawIntruders],
  ["silence", "Silent UAVs", "UAVs whose reports the agent of the shown team state does not receive: current position, and position of the last report", drawSilence],
  ["names", "Names", "If there is no space, names of objects without a warning are left out first", drawNames],
  ["road-names", "Road names", "Names of roads on the background map, where no other label is", drawRoadNames],
];

/** Layers that exist only if every UAV runs its own agent. */
const AGENT_LAYERS = new Set(["radio", "silence"]);

/** Layers of the preset "Operator". */
const OPERATOR_LAYERS = ["tiles", "basemap", "road-names", "buildings", "grid", "wind", "zones", "desired", "views", "radio", "tracks", "uavs", "avoidance", "intruders", "silence", "names"];

/** Presets of the layers: key, title, description, layers (all if missing). */
const PRESETS = [
  ["automatic", "Automatic", "All layers; with many targets on the visible part of the map, layers are hidden step by step"],
  ["operator", "Operator", "What the team knows now: without trails, uncertainty and true positions", OPERATOR_LAYERS],
  ["analyst", "Analyst", "Adds true positions, 95 % ellipses, velocity vectors, the flown orbit, detections, tentative tracks and blind zones to those of \"Operator\"",
    [...OPERATOR_LAYERS, "truth", "ellipses", "vectors", "flown", "detections", "tentative", "blind"]],
  ["everything", "Everything", "All layers"],
  ["custom", "Custom", "The layers that you have selected"],
];

/** Layers that "Automatic" hides, step by step, above a number of visible targets on `STEP_AREA_PX2`. */
const AUTOMATIC_STEPS = [[40, ["target-trails"]], [80, ["truth", "vectors", "detections", "tentative"]], [120, ["ellipses"]], [250, ["trails"]]];
/** Area of the map for which the steps are defined, px\u00b2. */
const STEP_AREA_PX2 = 500_000;
/** A hidden layer is shown again below this fraction of its number of targets, so that it does not flicker. */
const SHOW_AGAIN = 0.8;

/** The layers of a map: a preset, or those that the user has selected. */
class LayerChoice {
  /** `names`: the layers that exist in the run. */
  constructor(names) {
    this.names = names;
    this.preset = "automatic";
    /** Number of steps of the preset "Automatic" that are hidden. */
    this.hiddenSteps = 0;
    this.choose("automatic");
  }

  /** Selects a preset. "custom" keeps the layers that are shown. */
  choose(preset) {
    this.preset = preset;
    /** Layers for the selected object only; the others are hidden. */
    this.reduced = new Set();
    if (preset === "custom") return;
    const [, , , layers = this.names] = PRESETS.find(([key]) => key === preset);
    this.shown = new Set(this.names.filter((name) => layers.includes(name)));
    if (preset === "automatic") this.reduce();
  }

  /** Shows exactly these layers. */
  chooseLayers(names) {
    this.choose("custom");
    this.shown = new Set(this.names.filter((name) => names.includes(name)));
  }

  /** Shows or hides a layer. */
  toggle(name, isShown) {
    this.choose("custom");
    if (isShown && this.names.includes(name)) this.shown.add(name);
    else this.shown.delete(name);
  }

  /** Adapts the preset "Automatic" to the number of visible targets on a map of `area_px2`. */
  adapt(visible, area_px2) {
    if (this.preset !== "automatic") return;
    const density = (visible * STEP_AREA_PX2) / Math.max(area_px2, 1);
    const stepsAbove = (value) => AUTOMATIC_STEPS.filter(([targets]) => value > targets).length;
    const steps = Math.max(stepsAbove(density), Math.min(this.hiddenSteps, stepsAbove(density / SHOW_AGAIN)));
    if (steps === this.hiddenSteps) return;
    this.hiddenSteps = steps;
    this.choose("automatic");
  }

  reduce() {
    for (const name of AUTOMATIC_STEPS.slice(0, this.hiddenSteps).flatMap(([, names]) => names)) {
      if (this.shown.delete(name)) this.reduced.add(name);
    }
  }

  /** Text for a link: the preset, or the names of the layers. */
  get word() {
    return this.preset === "custom" ? [...this.shown].join(".") || "none" : this.preset;
  }
}

/** The layers in a link: `{preset}` or `{names}`; `null` if the text is neither a preset nor a list of layers. */
function parseLayers(word) {
  if (word === "none") return { names: [] };
  if (word !== "custom" && PRESETS.some(([key]) => key === word)) return { preset: word };
  const names = word.split(".");
  return names.every((name) => LAYERS.some(([layer]) => layer === name)) ? { names } : null;
}

/** The list of layers in the toolbar, which acts on all maps. */
class LayerMenu {
  constructor(page) {
    this.page = page;
    /** Identifies what the list shows. */
    this.key = "";
    this.preset = element("layer-preset");
    this.preset.append(...PRESETS.map(([key, title, about]) => Object.assign(new Option(title, key), { title: about })));
    this.preset.addEventListener("change", () => this.apply((layers) => layers.choose(this.preset.value)));
    this.boxes = new Map();
    for (const [name, title, about] of LAYERS.filter(([name]) => page.runs.some(({ map }) => map.layers.names.includes(name)))) {
      const box = document.createElement("input");
      box.type = "checkbox";
      box.name = `layer-${name}`;
      box.addEventListener("change", () => this.apply((layers) => layers.toggle(name, box.checked)));
      const label = document.createElement("label");
      label.append(box, ` ${title}`);
      label.title = about;
      label.dataset.layer = name;
      element("layers").append(label);
      this.boxes.set(name, box);
    }
    this.show();
  }

  /** Changes the layers of all maps. */
  apply(change) {
    for (const { map } of this.page.runs) change(map.layers);
    this.show();
    this.page.renew();
  }

  /** Shows the preset and the layers that are drawn; writes the drawn layers into the `data-layers` attribute of each map. */
  show() {
    const { page } = this;
    const key = page.runs.map(({ map, replayData }) => `${map.layers.preset} ${[...map.shown]} ${replayData.agents.isSeveral}`).join() + page.runs.indexOf(page.run);
    if (key === this.key) return;
    this.key = key;
    const { shown, preset } = page.map.layers;
    this.preset.value = preset;
    for (const [name, box] of this.boxes) {
      box.checked = shown.has(name);
      box.parentElement.hidden = AGENT_LAYERS.has(name) && !page.replayData.agents.isSeveral;
    }
    for (const { map, replayData } of page.runs) {
      map.canvas.dataset.preset = map.layers.preset;
      map.canvas.dataset.layers = [...map.shown].filter((name) => replayData.agents.isSeveral || !AGENT_LAYERS.has(name)).join(" ");
    }
  }
}
