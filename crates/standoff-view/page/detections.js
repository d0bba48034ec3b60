// Detections of sensors that are not ideal: measured positions, false alarms, gates of tracks, and targets in the blind zone.

/** Size of the symbol of a detection, px. */
const DETECTION_PX = 3.5;

/** The detections of the current time step, at the measured range and bearing from the UAV's position; empty for ideal sensors. */
function detectionsAt(replayData, time_s) {
  return listAt(replayData, time_s, "detections").map(({ row, detail_s }) => {
    const { range_m, bearing_rad } = row;
    const stepIndex = replayData.stepAt(detail_s);
    const [x_m, y_m] = ["x_m", "y_m"].map((column) => replayData.value("uavs", column, row.uav, stepIndex));
    return { ...row, target: idOf(row.target), x_m: x_m + range_m * Math.cos(bearing_rad), y_m: y_m + range_m * Math.sin(bearing_rad) };
  });
}

/** The tentative tracks of the current time step; empty if there are none, and for another agent's team state, for which they are not recorded. */
function tentativeAt(replayData, time_s) {
  if (replayData.agents.isOther(replayData.stepAt(time_s))) return [];
  return listAt(replayData, time_s, "tentative").map(({ row }) => row);
}

/** The rows of a table without ids at the current time step of the detail, with its time; empty if the run has no such table. */
function listAt(replayData, time_s, name) {
  const detail = replayData.detail(time_s);
  const table = detail?.tables[name];
  if (!table) return [];
  const { stepIndex } = stepPosition(replayData.detailTimes(detail), time_s);
  // The last time of `detailTimes` belongs to the next detail: at it, the rows before stay.
  const step = Math.min(stepIndex, table.stepCount - 1);
  const [first] = table.columns.keys();
  // A time step has no gaps: the first missing row ends the list.
  const end = table.ids.findIndex((id) => Number.isNaN(table.value(first, id, step)));
  const ids = end < 0 ? table.ids : table.ids.slice(0, end);
  const row = (id) => ({ id, ...Object.fromEntries([...table.columns.keys()].map((column) => [column, table.value(column, id, step)])) });
  return ids.map((id) => ({ row: row(id), detail_s: detail.times_s[step] }));
}

/** The detections that a map draws: all, or those of the selected UAV or target if the layer is hidden. */
function detectionsOf({ scene, shown, selection }) {
  if (shown.has("detections")) return scene.detections;
  return scene.detections.filter(({ uav, target }) =>
    selection.isChosen("uav", uav) || (target !== null && selection.isChosen("target", target)));
}

/** Draws detections in the colours of the UAVs that measured them. Of a target: plus. False alarm: diamond. */
function drawDetections(map, { ctx, size }) {
  const visible = detectionsOf(map).filter(({ x_m, y_m }) => map.camera.shows(x_m, y_m));
  const r = DETECTION_PX * Math.max(size, 0.7);
  ctx.lineWidth = 1.25;
  const colour = ({ uav, target }) => (target === null ? faded(uavColour(map.replayData, uav), 0.6) : uavColour(map.replayData, uav));
  drawByColour(ctx, visible, colour, ({ x_m, y_m, target }) => {
    const [x, y] = map.camera.at(x_m, y_m);
    if (target === null) addDiamond(ctx, x, y, r);
    else addPlus(ctx, x, y, r);
  });
}

/** Draws tentative tracks as faint triangles, fainter for a low probability of existence, and the gates of the selected track. */
function drawTentative(map, { ctx, scene, size }) {
  const visible = map.shown.has("tentative") ? scene.tentatives.filter(({ x_m, y_m }) => map.camera.shows(x_m, y_m)) : [];
  const r = 6 * Math.max(size, 0.7);
  ctx.lineWidth = 1.25;
  // Few steps of opacity, because the symbols of a colour are drawn as one path.
  const colour = ({ existence }) => faded(palette().none, 0.3 + 0.1 * Math.round(6 * existence));
  drawByColour(ctx, visible, colour, ({ x_m, y_m }) => {
    const [x, y] = map.camera.at(x_m, y_m);
    ctx.moveTo(x, y - r);
    ctx.lineTo(x + 0.87 * r, y + 0.5 * r);
    ctx.lineTo(x - 0.87 * r, y + 0.5 * r);
    ctx.closePath();
  });
  const chosen = map.selection.object?.kind === "target" && objectIn(scene, map.selection.object);
  if (chosen?.tracked) drawGates(map, ctx, scene, chosen);
}

/** Title, description and facts of the card of a tentative track. */
function tentativeCard({ existence, x_m, y_m, vx_m_s, vy_m_s }) {
  const facts = [
    ["Existence (%)", fixed(100 * existence, 1), "Probability that the target exists; at 99 % the track is confirmed", "existence"],
    ["East (m)", fixed(x_m, 1), "Estimated position, metres east of the origin; negative: west", "x_m"],
    ["North (m)", fixed(y_m, 1), "Estimated position, metres north of the origin; negative: south", "y_m"],
    ["Speed (m/s)", fixed(Math.hypot(vx_m_s, vy_m_s), 1), "Estimated speed over ground", "speed_m_s"],
  ];
  return { title: "Tentative track", what: "Track that may be of no target; in no group", facts };
}

function addDiamond(ctx, x, y, r) {
  ctx.moveTo(x + r, y);
  ctx.lineTo(x, y + r);
  ctx.lineTo(x - r, y);
  ctx.lineTo(x, y - r);
  ctx.closePath();
}

/** Draws the gate of a track for each UAV that has the target in view: positions at which a detection is associated with it. */
function drawGates(map, ctx, scene, target) {
  const seenBy = new Set(target.seenBy());
  const [x, y] = map.camera.at(target.x_m, target.y_m);
  for (const uav of scene.uavs.filter(({ id }) => seenBy.has(id))) {
    const [long_m, wide_m, turn_rad] = gateOf(target, uav, map.replayData.head.limits.detections);
    const { px_per_m } = map.camera;
    strokeGate(ctx, uavColour(map.replayData, uav.id), x, y, [long_m * px_per_m, wide_m * px_per_m, turn_rad]);
  }
}

function strokeGate(ctx, colour, x, y, [long, wide, turn_rad]) {
  ctx.setLineDash([2, 3]);
  ctx.lineWidth = 1.5;
  ctx.strokeStyle = colour;
  ctx.beginPath();
  ctx.ellipse(x, y, long, wide, -turn_rad, 0, 2 * Math.PI);
  ctx.stroke();
}

/** Semi-axes of the gate of a track for a UAV, m, and the direction of the major axis, rad: covariance of the track plus noise of the sensor. */
function gateOf({ x_m, y_m, covariance: [xx, xy, yy] }, uav, { range_sd_m, bearing_sd_rad, gate }) {
  const [dx_m, dy_m] = [x_m - uav.x_m, y_m - uav.y_m];
  const range_m = Math.max(Math.hypot(dx_m, dy_m), 1);
  const [cos, sin] = [dx_m / range_m, dy_m / range_m];
  const [along, across] = [range_sd_m ** 2, (range_m * bearing_sd_rad) ** 2];
  const noise = [along * cos * cos + across * sin * sin, (along - across) * cos * sin, along * sin * sin + across * cos * cos];
  const [long, wide, turn_rad] = ellipseOf([xx + noise[0], xy + noise[1], yy + noise[2]]);
  const scale = Math.sqrt(gate) / SIGMAS;
  return [scale * long, scale * wide, turn_rad];
}

/** UAVs that have a target in view and in their blind zone: its true radial speed over ground is below the MDV, at which half of the detections are left. */
function blindTo(target, { mdv_m_s }) {
  return target.radialSpeeds().filter(({ speed_m_s }) => speed_m_s < mdv_m_s);
}

/** Whether a target is in view, and in the blind zone of all UAVs that have it in view; or of the selected UAV. */
function isBlind(map, target) {
  const speeds = target.radialSpeeds();
  const { mdv_m_s } = map.replayData.head.limits.detections;
  const { object } = map.selection;
  if (object?.kind === "uav") return speeds.some(({ uav, speed_m_s }) => uav === object.id && speed_m_s < mdv_m_s);
  return speeds.length > 0 && speeds.every(({ speed_m_s }) => speed_m_s < mdv_m_s);
}

/** Marks targets in the blind zone with a slash. */
function drawBlind(map, { ctx, size }) {
  const blind = map.targetsOf("blind").filter(({ target }) => isBlind(map, target));
  ctx.lineWidth = 2;
  const r = Math.max(9 * size, 6);
  drawByColour(ctx, blind, () => palette().ink, ({ x, y }) => {
    ctx.moveTo(x - r, y + r);
    ctx.lineTo(x + r, y - r);
  });
}

/** Text about the blind zone on the card of a target; empty without MDV, and for a target in no UAV's blind zone. */
function blindTargetText(replayData, target) {
  const { detections } = replayData.head.limits;
  if (!(detections?.mdv_m_s > 0)) return "";
  const texts = blindTo(target, detections).map(({ uav, speed_m_s }) => `UAV ${uav} at ${speed_m_s.toFixed(1)} m/s`);
  return texts.length ? `${texts.join(", ")}; MDV ${detections.mdv_m_s} m/s` : "";
}

/** Text about the blind zone on the card of a UAV: the targets in it; empty if there are none. */
function blindUavText(replayData, scene, { id }) {
  const { detections } = replayData.head.limits;
  if (!(detections?.mdv_m_s > 0)) return "";
  const texts = (scene.targets ?? []).flatMap((target) => {
    const own = blindTo(target, detections).find(({ uav }) => uav === id);
    return own ? [`${targetName(replayData, target.id)} (${own.speed_m_s.toFixed(1)} m/s)`] : [];
  });
  const more = texts.length > MAX_BLIND ? ` and ${texts.length - MAX_BLIND} more` : "";
  return texts.slice(0, MAX_BLIND).join(", ") + more;
}

/** Maximum number of targets that the card of a UAV lists. */
const MAX_BLIND = 6;

/** Title, description and facts of the card of a detection. */
function detectionCard(replayData, { uav, target, range_m, bearing_rad, range_rate_m_s }) {
  const facts = [
    ["UAV", `${uav}`, "UAV that measured", "uav"],
    ["Target", target === null ? "none: false alarm" : targetName(replayData, target), "Target that was measured (truth)", "target"],
    ["Range (m)", fixed(range_m, 1), "Measured distance from the UAV", "range_m"],
    ["Bearing (\u00b0)", compass(bearing_rad), "Measured direction from the UAV: 0 is north, 90 east", "bearing_deg"],
    ["Range rate (m/s)", Number.isNaN(range_rate_m_s) ? "" : fixed(range_rate_m_s, 1),
      "Measured rate of change of the range, due to the motion of UAV and target", "range_rate_m_s"],
  ];
  return { title: target === null ? "False alarm" : "Detection", what: "Measurement of this time step", facts };
}
