// The legend on the map: the symbols of the layers that are shown, drawn by the functions that draw the map.

/** Size of a sample, px; the symbols in it are smaller than on the map by the factor `SAMPLE_SCALE`. */
const SAMPLE_WIDTH = 44;
const SAMPLE_HEIGHT = 22;
const SAMPLE_SCALE = 0.72;

/** A target, a UAV and an intruder in the middle of a sample. */
const SAMPLE_TARGET = { id: 0, exists: true, tracked: true, x_m: 0, y_m: 0, true_x_m: 0, true_y_m: 0, vx_m_s: NaN, vy_m_s: NaN,
  covariance: [0, 0, 0], status: "updated", membership: "member", group: 0, receiving_group: null, out_of_view: false };
const SAMPLE_UAV = { id: 0, group: 0, x_m: 0, y_m: 0, heading_rad: 0, nose_rad: 0, boresight_rad: 0, turn_rate_rad_s: 0, speed_m_s: 2, out: null,
  avoided_uav: null, avoided_intruder: null, agentState: { isOn: true, isNotReceived: false } };
const SAMPLE_GROUP = { id: 0, x_m: 0, y_m: 0, standoff_distance_m: 13, spread_m: 0, feasible: true };
const SAMPLE_INTRUDER = { id: 0, x_m: 0, y_m: 0, heading_rad: 0, transponder_on: true };
const SAMPLE_DETECTION = { id: 0, uav: 0, target: 0, x_m: 0, y_m: 0 };
const SAMPLE_SQUARE = [[-22, -10], [22, -10], [22, 10], [-22, 10]];

const sampleTarget = (values = {}) => ({ targets: [{ ...SAMPLE_TARGET, ...values }] });
const sampleUav = (values = {}) => ({ uavs: [{ ...SAMPLE_UAV, ...values }] });

/** Entries of the legend: layer, text, draw functions, and the scene that they draw. */
const LEGEND_ENTRIES = [
  ["uavs", "UAV, nose along its heading", [drawUavs], sampleUav()],
  ["uavs", "UAV in an outage: last position known to the team", [drawUavs], sampleUav({ x_m: 1e4, out: { x_m: 0, y_m: 0, since_s: 0 } })],
  ["views", "Field of view, in the colour of the group", [drawViews], { ...sampleUav({ x_m: -18 }), groups: [{ ...SAMPLE_GROUP, standoff_distance_m: 18 }], ...sampleTarget() }],
  ["views", "Field of view of a UAV on its way, which is not yet at its group", [drawViews],
    { ...sampleUav({ x_m: -18 }), groups: [{ ...SAMPLE_GROUP, x_m: -50 }], ...sampleTarget({ x_m: -50 }) }],
  ["desired", "Desired orbit and estimated centre of a group", [drawDesired], { groups: [SAMPLE_GROUP] }],
  ["desired", "No orbit satisfies the constraints", [drawDesired], { groups: [{ ...SAMPLE_GROUP, feasible: false }] }],
  ["flown", "Flown orbit: last turn of the selected UAV", [drawFlown], { ...sampleUav({ x_m: 20 }), groups: [SAMPLE_GROUP] }],
  ["tracks", "Track, measured in this time step", [drawTracks], sampleTarget()],
  ["tracks", "Track, coasting or only cued", [drawTracks], sampleTarget({ status: "coasting" })],
  ["tracks", "Track in no group", [drawTracks], sampleTarget({ membership: "ungrouped", group: null })],
  ["tracks", "In handoff, ring in the colour of the receiving group", [drawTracks], sampleTarget({ membership: "in-handoff", receiving_group: 1 })],
  ["tracks", "Removed from its group, still predicted", [drawTracks], sampleTarget({ membership: "removed" })],
  ["tracks", "Out of view: target in no UAV's view, in a group or not", [drawTracks], sampleTarget({ out_of_view: true })],
  ["truth", "True position of a target", [drawTruth], sampleTarget()],
  ["ellipses", "95 % confidence ellipse; dashed: not measured now", [drawEllipses, drawTracks], sampleTarget({ covariance: [70, 0, 13] })],
  ["vectors", `Predicted motion over ${AHEAD_S} s`, [drawVectors, drawTracks], sampleTarget({ x_m: -12, vx_m_s: 2.6, vy_m_s: 0 })],
  ["target-trails", `Track of the last ${TRAIL_S} s`, [drawTargetTrails, drawTracks], sampleTarget({ x_m: 20 })],
  ["trails", `Path of a UAV in the last ${TRAIL_S} s`, [drawTrails], sampleUav({ x_m: 20 })],
  ["intruders", "Intruder", [drawIntruders], { intruders: [SAMPLE_INTRUDER] }],
  ["intruders", "Intruder with its transponder off", [drawIntruders], { intruders: [{ ...SAMPLE_INTRUDER, transponder_on: false }] }],
  ["tentative", "Tentative track: may be of no target", [drawTentative], { tentatives: [{ id: 0, existence: 1, x_m: 0, y_m: 0 }] }],
  ["detections", "Detection, in the colour of the UAV that measured it", [drawDetections], { detections: [SAMPLE_DETECTION] }],
  ["detections", "False alarm", [drawDetections], { detections: [{ ...SAMPLE_DETECTION, target: null }] }],
  ["tentative", "Gate of the selected track: region of a UAV's detections that are associated with it",
    [drawTracks, (map, { ctx }) => strokeGate(ctx, uavColour(map.replayData, 0), ...map.camera.at(0, 0), [24, 11, 0])], sampleTarget()],
  ["blind", "Target in view and in the blind zone: radial speed below the MDV", [drawTracks, drawBlind],
    sampleTarget({ radialSpeeds: () => [{ uav: 0, speed_m_s: 0 }] })],
  ["avoidance", "The UAV at the dot avoids the other aircraft", [drawAvoidance],
    { uavs: [{ ...SAMPLE_UAV, x_m: -22, avoided_uav: 1 }, { ...SAMPLE_UAV, id: 1, x_m: 24 }] }],
  ["buildings", "Building that hides targets, darker if it is higher", [drawBuildings], { buildings: [{ height_m: 20, rings_m: [SAMPLE_SQUARE] }] }],
  ["zones", "Keep-out zone", [drawZones], { zones: [{ kind: "keep-out", corners_m: SAMPLE_SQUARE }] }],
  ["zones", "Keep-in zone", [drawZones], { zones: [{ kind: "keep-in", corners_m: SAMPLE_SQUARE }] }],
  ["zones", "Area of interest", [drawZones], { zones: [{ kind: "area-of-interest", corners_m: SAMPLE_SQUARE }] }],
  ["radio", "Both UAVs receive each other's reports", [drawRadio], sampleLink("alive", "alive")],
  ["radio", "Only the UAV at the tip receives reports", [drawRadio], sampleLink("silent", "alive")],
  ["radio", "Neither UAV receives reports", [drawRadio], sampleLink("silent", "silent")],
  ["silence", "UAV that is silent in the shown team state; red: timed out", [drawSilence],
    sampleUav({ agentState: { isOn: true, isNotReceived: true, owner: 1, shown: { status: "silent", age_s: NaN } } })],
];

/** Two UAVs outside a sample with the statuses of their links. */
function sampleLink(first, second) {
  return { uavs: [{ ...SAMPLE_UAV, x_m: -42 }, { ...SAMPLE_UAV, id: 1, x_m: 42 }], statuses: [first, second] };
}

/** The part of `MissionMap` that the draw functions use, with a sample as its scene. */
class SampleMap {
  constructor(values, head) {
    this.scene = { time_s: 5, uavs: [], groups: [], intruders: [], targets: [], detections: [], tentatives: [], ...values };
    const [width, height] = [SAMPLE_WIDTH / SAMPLE_SCALE, SAMPLE_HEIGHT / SAMPLE_SCALE];
    this.camera = { width, height, px_per_m: 1, at: (x_m, y_m) => [width / 2 + x_m, height / 2 - y_m], shows: (x_m) => Math.abs(x_m) < width };
    this.selection = new Selection();
    this.shown = { has: () => true };
    this.drawn = this.scene.targets.map((target) => ({ target, x: this.camera.at(target.x_m, 0)[0], y: height / 2 }));
    this.replayData = sampleReplay(this.scene, head);
  }

  ink(group, opacity = 1) {
    return faded(groupColour(this.replayData, group), opacity);
  }

  targetsOf() {
    return this.drawn;
  }

  uavsOf() {
    return this.scene.uavs;
  }
}

/** The part of `ReplayData` that the draw functions use: straight paths from the left edge of the sample to its right. */
function sampleReplay({ buildings = [], zones = [], statuses = [] }, { limits }) {
  const times_s = [0, 1, 2, 3, 4, 5];
  const value = (table, column, id, k) => (table === "uavs" && column === "x_m" ? -20 + 8 * k : 0);
  const block = { times_s, tables: { targets: { value: (column, id, k) => (column === "x_m" ? -20 + 8 * k : 0) } } };
  const agents = { isSeveral: true, isOther: () => false, believed: (one) => ({ status: statuses[one] }) };
  return { times_s, value, agents, ids: { uavs: [0, 1] }, colours: new Map([[0, 0], [1, 1]]), head: { limits, buildings, zones },
    details: new Map([[0, { block }]]), stepAt: (time_s) => Math.min(Math.max(Math.floor(time_s), 0), 5) };
}

/** Entries of the legend for the layers that a map shows for all objects. */
function legendOf({ shown, replayData }) {
  const kinds = new Set((replayData.head.zones ?? []).map(({ kind }) => kind));
  return LEGEND_ENTRIES.filter(([layer, , , { zones }]) => shown.has(layer) && (!zones || kinds.has(zones[0].kind)) &&
    (replayData.agents.isSeveral || !AGENT_LAYERS.has(layer)));
}

/** Draws the sample of an entry into a box of `SAMPLE_WIDTH` and `SAMPLE_HEIGHT` at a position. */
function drawSample(ctx, x, y, [, , paints, values], head) {
  const map = new SampleMap(values, head);
  ctx.save();
  ctx.beginPath();
  ctx.rect(x, y, SAMPLE_WIDTH, SAMPLE_HEIGHT);
  ctx.clip();
  ctx.translate(x, y);
  ctx.scale(SAMPLE_SCALE, SAMPLE_SCALE);
  for (const paint of paints) {
    ctx.save();
    paint(map, { ctx, scene: map.scene, labels: { nextTo() {} }, size: 1, uavSize: 1 });
    ctx.restore();
  }
  ctx.restore();
}

/** The legend over the map, which can be folded; whether it is open is kept for the session. */
class MapLegend {
  static STORED = "standoff-legend";

  constructor(page) {
    this.page = page;
    this.button = element("map-legend-button");
    this.list = element("map-legend");
    /** Identifies what the legend shows. */
    this.key = "";
    let isOpen = false;
    try {
      isOpen = sessionStorage.getItem(MapLegend.STORED) === "open";
    } catch {
      // Pages opened from a file may have no storage.
    }
    this.button.addEventListener("click", () => this.open(this.list.hidden));
    new ResizeObserver(() => this.fit()).observe(document.querySelector(".stage"));
    this.open(isOpen);
  }

  open(isOpen) {
    this.list.hidden = !isOpen;
    this.button.setAttribute("aria-expanded", String(isOpen));
    try {
      sessionStorage.setItem(MapLegend.STORED, isOpen ? "open" : "folded");
    } catch {
      // See above.
    }
    this.fit();
    this.page.renew();
  }

  /** Limits the height to the space between the toolbar and the scale bar. */
  fit() {
    const stage = document.querySelector(".stage");
    const tools = document.querySelector(".tools");
    const room = stage.clientHeight - tools.offsetTop - tools.offsetHeight - parseFloat(getComputedStyle(this.list.parentElement).bottom);
    this.list.style.maxHeight = `${Math.max(room - this.button.offsetHeight - 16, 60)}px`;
  }

  /** Updates the entries to the layers that are shown. */
  show() {
    if (this.list.hidden) return;
    const { map, replayData: { head } } = this.page;
    const entries = legendOf(map);
    const ratio = screenRatio();
    const key = `${entries.map((entry) => LEGEND_ENTRIES.indexOf(entry))} ${document.documentElement.dataset.theme} ${ratio}`;
    if (key === this.key) return;
    this.key = key;
    this.list.replaceChildren(...entries.map((entry) => {
      const canvas = document.createElement("canvas");
      canvas.width = Math.round(SAMPLE_WIDTH * ratio);
      canvas.height = Math.round(SAMPLE_HEIGHT * ratio);
      canvas.setAttribute("aria-hidden", "true");
      const ctx = canvas.getContext("2d");
      ctx.scale(ratio, ratio);
      drawSample(ctx, 0, 0, entry, head);
      const item = document.createElement("li");
      item.dataset.layer = entry[0];
      item.append(canvas, entry[1]);
      return item;
    }));
  }
}
