// Lines on the map: trails, orbits, fields of view and velocity vectors.

/** Duration of trails, s. */
const TRAIL_S = 60;
/** Maximum number of points of all target trails together; with more targets each trail has fewer points. */
const MOST_TRAIL_PLACES = 6000;
/** Prediction time of velocity vectors, s. */
const AHEAD_S = 10;

/** Adds a line through positions to the path, with gaps at missing positions. */
function addPath(camera, pen, places) {
  let down = false;
  for (const [x_m, y_m] of places) {
    if (Number.isNaN(x_m)) {
      down = false;
      continue;
    }
    const [x, y] = camera.at(x_m, y_m);
    if (down) pen.lineTo(x, y);
    else pen.moveTo(x, y);
    down = true;
  }
}

function strokePath(camera, pen, places) {
  pen.beginPath();
  addPath(camera, pen, places);
  pen.stroke();
}

/** Indices of the time steps from `from_s` to `time_s`. */
function* recent(replayData, time_s, from_s) {
  const last = replayData.instant(time_s);
  for (let k = Math.max(0, replayData.instant(Math.max(from_s, replayData.times_s[0] ?? 0))); k <= last; k++) yield k;
}

/** Draws the trails of UAVs. */
function drawTrails(map, { pen, scene }) {
  const { replayData, selection, camera } = map;
  pen.lineWidth = 1.5;
  for (const uav of scene.uavs) {
    const places = [];
    for (const k of recent(replayData, scene.time_s, scene.time_s - TRAIL_S)) {
      places.push([replayData.value("uavs", "x_m", uav.id, k), replayData.value("uavs", "y_m", uav.id, k)]);
    }
    places.push([uav.x_m, uav.y_m]);
    pen.strokeStyle = faded(uavColour(replayData, uav.id), selection.passes(uav.group) ? 0.55 : 0.1);
    strokePath(camera, pen, places);
  }
}

/** Draws the trails of visible target tracks, as far as they are loaded. */
function drawTargetTrails(map, { pen, scene }) {
  const { replayData, camera } = map;
  // The page has no past positions in the team states of other agents.
  if (replayData.agents.isOther(replayData.instant(scene.time_s))) return;
  const seen = map.drawn.filter(({ target }) => target.tracked);
  if (!seen.length) return;
  const times = [];
  for (const half of [...replayData.details].sort((a, b) => a[0] - b[0]).map(([, held]) => held.half)) {
    half.times_s.forEach((time_s, instant) => {
      if (time_s > scene.time_s - TRAIL_S && time_s < scene.time_s) times.push({ half, instant, time_s });
    });
  }
  // Only multiples of the step are used, so that the points of a trail stay the same while the time advances.
  const period_s = times.length > 1 ? times[1].time_s - times[0].time_s : 1;
  const step = Math.max(1, Math.ceil((times.length * seen.length) / MOST_TRAIL_PLACES));
  const chosen = times.filter(({ time_s }) => Math.round(time_s / period_s) % step === 0);
  pen.lineWidth = 1;
  inkedTogether(pen, seen, ({ target }) => map.ink(target.group, 0.5), ({ target, x, y }) => {
    let down = false;
    for (const { half, instant } of chosen) {
      const { targets } = half.tables;
      const x_m = targets.value("x_m", target.id, instant);
      if (Number.isNaN(x_m)) {
        down = false;
        continue;
      }
      const [px, py] = camera.at(x_m, targets.value("y_m", target.id, instant));
      if (down) pen.lineTo(px, py);
      else pen.moveTo(px, py);
      down = true;
    }
    if (down) pen.lineTo(x, y);
  });
}

/** Draws the desired orbits and the estimated centres of groups. */
function drawDesired(map, { pen, scene }) {
  const { camera } = map;
  for (const group of scene.groups) {
    const [x, y] = camera.at(group.x_m, group.y_m);
    pen.strokeStyle = map.ink(group.id);
    pen.lineWidth = 2;
    pen.setLineDash(group.feasible ? [] : [4, 6]);
    pen.beginPath();
    pen.arc(x, y, Math.max(0, group.standoff_distance_m * camera.px_per_m), 0, 2 * Math.PI);
    pen.stroke();
    pen.setLineDash([]);
    pen.lineWidth = 1.5;
    pen.beginPath();
    addPlus(pen, x, y, 6);
    pen.stroke();
  }
}

/** Draws the last revolution of each UAV relative to its group centre, about the current centre. */
function drawFlown(map, { pen, scene }) {
  const { replayData, selection, camera } = map;
  if (replayData.agents.isOther(replayData.instant(scene.time_s))) return;
  pen.lineWidth = 1.25;
  pen.setLineDash([2, 4]);
  for (const uav of scene.uavs) {
    const group = scene.groups.find((one) => one.id === uav.group);
    if (!group) continue;
    const turn_s = Math.min((2 * Math.PI * group.standoff_distance_m) / Math.max(uav.speed_m_s, 1), 4 * TRAIL_S);
    const places = [];
    for (const k of recent(replayData, scene.time_s, scene.time_s - turn_s)) {
      const same = replayData.value("uavs", "group", uav.id, k) === group.id;
      const dx = replayData.value("uavs", "x_m", uav.id, k) - replayData.value("groups", "x_m", group.id, k);
      const dy = replayData.value("uavs", "y_m", uav.id, k) - replayData.value("groups", "y_m", group.id, k);
      places.push(same ? [group.x_m + dx, group.y_m + dy] : [NaN, NaN]);
    }
    places.push([uav.x_m, uav.y_m]);
    const colour = uavColour(replayData, uav.id);
    pen.strokeStyle = selection.passes(group.id) ? colour : faded(colour, 0.15);
    strokePath(camera, pen, places);
  }
}

/** Length of the wedge of a UAV: to the far side of its group. It is not the range of the sensor. */
function wedgeReach_m(uav, scene) {
  const group = scene.groups.find((one) => one.id === uav.group);
  return group ? Math.hypot(uav.x_m - group.x_m, uav.y_m - group.y_m) + group.spread_m + 40 : 400;
}

/** Draws the fields of view of UAVs. */
function drawViews(map, { pen, scene }) {
  const half_rad = map.replayData.head.limits.field_of_view_rad / 2;
  for (const uav of scene.uavs) {
    if (Number.isNaN(uav.boresight_rad)) continue;
    const [x, y] = map.camera.at(uav.x_m, uav.y_m);
    pen.beginPath();
    pen.moveTo(x, y);
    // Canvas angles are clockwise.
    pen.arc(x, y, wedgeReach_m(uav, scene) * map.camera.px_per_m, -uav.boresight_rad - half_rad, -uav.boresight_rad + half_rad);
    pen.closePath();
    pen.fillStyle = map.ink(uav.group, 0.1);
    pen.fill();
    pen.strokeStyle = map.ink(uav.group, 0.45);
    pen.stroke();
  }
}

/** Draws the predicted motion of targets with constant velocity, and of UAVs with constant speed and turn rate. */
function drawVectors(map, { pen, scene }) {
  const { camera } = map;
  const moving = map.drawn.filter(({ target }) => target.tracked && !Number.isNaN(target.vx_m_s));
  pen.lineWidth = 1.25;
  inkedTogether(pen, moving, ({ target }) => map.ink(target.group, 0.8), ({ target, x, y }) => {
    pen.moveTo(x, y);
    pen.lineTo(...camera.at(target.x_m + target.vx_m_s * AHEAD_S, target.y_m + target.vy_m_s * AHEAD_S));
  });
  pen.lineWidth = 1.5;
  inkedTogether(pen, scene.uavs, ({ id, group }) => faded(uavColour(map.replayData, id), map.selection.passes(group) ? 0.8 : 0.15), (uav) =>
    addPath(camera, pen, ahead(uav)));
}

/** Predicted positions of a UAV with constant speed and turn rate. */
function ahead(uav) {
  const places = [[uav.x_m, uav.y_m]];
  const step_s = AHEAD_S / 10;
  let [x_m, y_m] = places[0];
  for (let k = 0; k < 10; k++) {
    const heading_rad = uav.heading_rad + uav.turn_rate_rad_s * step_s * (k + 0.5);
    x_m += uav.speed_m_s * step_s * Math.cos(heading_rad);
    y_m += uav.speed_m_s * step_s * Math.sin(heading_rad);
    places.push([x_m, y_m]);
  }
  return places;
}
