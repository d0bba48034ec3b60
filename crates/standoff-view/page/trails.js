// Lines on the map: trails, orbits, fields of view and velocity vectors.

/** Duration of trails, s. */
const TRAIL_S = 60;
/** Maximum number of points of all target trails together; with more targets each trail has fewer points. */
const MAX_TRAIL_POINTS = 6000;
/** Prediction time of velocity vectors, s. */
const AHEAD_S = 10;

/** Adds a line through positions to the path, with gaps at missing positions. */
function addPath(camera, ctx, positions) {
  let down = false;
  for (const [x_m, y_m] of positions) {
    if (Number.isNaN(x_m)) {
      down = false;
      continue;
    }
    const [x, y] = camera.at(x_m, y_m);
    if (down) ctx.lineTo(x, y);
    else ctx.moveTo(x, y);
    down = true;
  }
}

function strokePath(camera, ctx, positions) {
  ctx.beginPath();
  addPath(camera, ctx, positions);
  ctx.stroke();
}

/** Indices of the time steps from `from_s` to `time_s`. */
function* recent(replayData, time_s, from_s) {
  const last = replayData.stepAt(time_s);
  for (let k = Math.max(0, replayData.stepAt(Math.max(from_s, replayData.times_s[0] ?? 0))); k <= last; k++) yield k;
}

/** Draws the trails of UAVs. */
function drawTrails(map, { ctx, scene }) {
  const { replayData, selection, camera } = map;
  ctx.lineWidth = 1.5;
  for (const uav of map.uavsOf("trails")) {
    const positions = [];
    for (const k of recent(replayData, scene.time_s, scene.time_s - TRAIL_S)) {
      positions.push([replayData.value("uavs", "x_m", uav.id, k), replayData.value("uavs", "y_m", uav.id, k)]);
    }
    positions.push([uav.x_m, uav.y_m]);
    ctx.strokeStyle = faded(uavColour(replayData, uav.id), selection.passes(uav.group) ? 0.55 : 0.1);
    strokePath(camera, ctx, positions);
  }
}

/** Draws the trails of visible target tracks, as far as they are loaded. */
function drawTargetTrails(map, { ctx, scene }) {
  const { replayData, camera } = map;
  // The page has no past positions in the team states of other agents.
  if (replayData.agents.isOther(replayData.stepAt(scene.time_s))) return;
  const visible = map.targetsOf("target-trails").filter(({ target }) => target.tracked);
  if (!visible.length) return;
  const times = [];
  for (const block of [...replayData.details].sort((a, b) => a[0] - b[0]).map(([, held]) => held.block)) {
    block.times_s.forEach((time_s, stepIndex) => {
      if (time_s > scene.time_s - TRAIL_S && time_s < scene.time_s) times.push({ block, stepIndex, time_s });
    });
  }
  // Only multiples of the step are used, so that the points of a trail stay the same while the time advances.
  const period_s = times.length > 1 ? times[1].time_s - times[0].time_s : 1;
  const step = Math.max(1, Math.ceil((times.length * visible.length) / MAX_TRAIL_POINTS));
  const chosen = times.filter(({ time_s }) => Math.round(time_s / period_s) % step === 0);
  ctx.lineWidth = 1;
  drawByColour(ctx, visible, ({ target }) => map.ink(target.group, 0.5), ({ target, x, y }) => {
    let down = false;
    for (const { block, stepIndex } of chosen) {
      const { targets } = block.tables;
      const x_m = targets.value("x_m", target.id, stepIndex);
      if (Number.isNaN(x_m)) {
        down = false;
        continue;
      }
      const [px, py] = camera.at(x_m, targets.value("y_m", target.id, stepIndex));
      if (down) ctx.lineTo(px, py);
      else ctx.moveTo(px, py);
      down = true;
    }
    if (down) ctx.lineTo(x, y);
  });
}

/** Draws the desired orbits and the estimated centres of groups. */
function drawDesired(map, { ctx, scene }) {
  const { camera } = map;
  for (const group of scene.groups) {
    const [x, y] = camera.at(group.x_m, group.y_m);
    ctx.strokeStyle = map.ink(group.id);
    ctx.lineWidth = 2;
    ctx.setLineDash(group.feasible ? [] : [4, 6]);
    ctx.beginPath();
    ctx.arc(x, y, Math.max(0, group.standoff_distance_m * camera.px_per_m), 0, 2 * Math.PI);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.lineWidth = 1.5;
    ctx.beginPath();
    addPlus(ctx, x, y, 6);
    ctx.stroke();
  }
}

/** Draws the last revolution of the selected UAV relative to its group centre, about the current centre. */
function drawFlown(map, { ctx, scene }) {
  const { replayData, selection, camera } = map;
  if (replayData.agents.isOther(replayData.stepAt(scene.time_s))) return;
  ctx.lineWidth = 1.25;
  ctx.setLineDash([2, 4]);
  for (const uav of map.uavsOf("flown")) {
    const group = scene.groups.find((one) => one.id === uav.group);
    if (!group) continue;
    const turn_s = Math.min((2 * Math.PI * group.standoff_distance_m) / Math.max(uav.speed_m_s, 1), 4 * TRAIL_S);
    const positions = [];
    for (const k of recent(replayData, scene.time_s, scene.time_s - turn_s)) {
      const same = replayData.value("uavs", "group", uav.id, k) === group.id;
      const dx = replayData.value("uavs", "x_m", uav.id, k) - replayData.value("groups", "x_m", group.id, k);
      const dy = replayData.value("uavs", "y_m", uav.id, k) - replayData.value("groups", "y_m", group.id, k);
      positions.push(same ? [group.x_m + dx, group.y_m + dy] : [NaN, NaN]);
    }
    positions.push([uav.x_m, uav.y_m]);
    const colour = uavColour(replayData, uav.id);
    ctx.strokeStyle = selection.passes(group.id) ? colour : faded(colour, 0.15);
    strokePath(camera, ctx, positions);
  }
}

/** Length of the wedge of a UAV: to the far side of its group. It is not the range of the sensor. */
function wedgeReach_m(uav, scene) {
  const group = scene.groups.find((one) => one.id === uav.group);
  return group ? Math.hypot(uav.x_m - group.x_m, uav.y_m - group.y_m) + group.spread_m + 40 : 400;
}

/** Members of groups by group, for each scene. */
const MEMBERS = new WeakMap();

/** The targets of a group in a scene. */
function membersOf(scene, group) {
  if (!MEMBERS.has(scene)) MEMBERS.set(scene, grouped((scene.targets ?? []).filter(({ tracked, group }) => tracked && group !== null), (target) => target.group));
  return MEMBERS.get(scene).get(group) ?? [];
}

/** A UAV is on its way while its distance from the group centre exceeds the orbit radius by more than this fraction. */
const OUTSIDE_ORBIT = 0.25;

/**
 * Why a UAV is still on its way to its group; empty if it is not. It is on its way while it is far outside the desired orbit, or
 * while the directions to the estimated positions of all members are outside its field of view. While targets are being
 * loaded, the group centre takes the place of the members.
 */
function wayText(scene, uav, field_of_view_rad) {
  const group = scene.groups.find((one) => one.id === uav.group);
  if (!group || Number.isNaN(uav.boresight_rad)) return "";
  const isOutside = ({ x_m, y_m }) => offBoresight_rad(uav, x_m, y_m) > field_of_view_rad / 2;
  const members = membersOf(scene, uav.group);
  if ((members.length ? members : [group]).every(isOutside)) return `On its way: it does not yet point at group ${group.id}, no member of which is in its field of view`;
  const outside_m = Math.hypot(uav.x_m - group.x_m, uav.y_m - group.y_m) - group.standoff_distance_m;
  return outside_m > OUTSIDE_ORBIT * group.standoff_distance_m ? `On its way: it is still ${outside_m.toFixed(0)} m outside the orbit of group ${group.id}` : "";
}

/** Draws the fields of view of UAVs: in the colour of the group, or in that of the UAV while it is on its way. */
function drawViews(map, { ctx, scene }) {
  const { field_of_view_rad } = map.replayData.head.limits;
  const half_rad = field_of_view_rad / 2;
  for (const uav of scene.uavs) {
    if (Number.isNaN(uav.boresight_rad)) continue;
    const [x, y] = map.camera.at(uav.x_m, uav.y_m);
    ctx.beginPath();
    ctx.moveTo(x, y);
    // Canvas angles are clockwise.
    ctx.arc(x, y, wedgeReach_m(uav, scene) * map.camera.px_per_m, -uav.boresight_rad - half_rad, -uav.boresight_rad + half_rad);
    ctx.closePath();
    const own = map.selection.passes(uav.group) ? 1 : 0.15;
    const isOnWay = wayText(scene, uav, field_of_view_rad) !== "";
    const ink = (opacity) => (isOnWay ? faded(uavColour(map.replayData, uav.id), own * opacity) : map.ink(uav.group, opacity));
    ctx.fillStyle = ink(0.1);
    ctx.fill();
    ctx.strokeStyle = ink(0.45);
    ctx.stroke();
  }
}

/** Draws the predicted motion of targets with constant velocity, and of UAVs with constant speed and turn rate. */
function drawVectors(map, { ctx, scene }) {
  const { camera } = map;
  const moving = map.targetsOf("vectors").filter(({ target }) => target.tracked && !Number.isNaN(target.vx_m_s));
  ctx.lineWidth = 1.25;
  drawByColour(ctx, moving, ({ target }) => map.ink(target.group, 0.8), ({ target, x, y }) => {
    ctx.moveTo(x, y);
    ctx.lineTo(...camera.at(target.x_m + target.vx_m_s * AHEAD_S, target.y_m + target.vy_m_s * AHEAD_S));
  });
  ctx.lineWidth = 1.5;
  drawByColour(ctx, scene.uavs, ({ id, group }) => faded(uavColour(map.replayData, id), map.selection.passes(group) ? 0.8 : 0.15), (uav) =>
    addPath(camera, ctx, ahead(uav)));
}

/** Predicted positions of a UAV with constant speed and turn rate. */
function ahead(uav) {
  const positions = [[uav.x_m, uav.y_m]];
  const step_s = AHEAD_S / 10;
  let [x_m, y_m] = positions[0];
  for (let k = 0; k < 10; k++) {
    const heading_rad = uav.heading_rad + uav.turn_rate_rad_s * step_s * (k + 0.5);
    x_m += uav.speed_m_s * step_s * Math.cos(heading_rad);
    y_m += uav.speed_m_s * step_s * Math.sin(heading_rad);
    positions.push([x_m, y_m]);
  }
  return positions;
}
