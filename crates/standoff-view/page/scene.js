// The scene at a time: plain objects from the replay data, which the map and the tables show.

const STATUS = ["cued", "updated", "coasting"];
const MEMBERSHIP = ["ungrouped", "member", "in-handoff", "removed"];

/** Converts a stored id: `null` for NaN. */
function idOf(value) {
  return Number.isNaN(value) ? null : value;
}

/** UAVs at a time. Positions and directions are interpolated; other values are those of the current time step. */
function uavsAt(replayData, time_s) {
  const { stepIndex, share } = stepPosition(replayData.times_s, time_s);
  const found = [];
  const { agents } = replayData;
  const owner = agents.isSeveral ? agents.owner(stepIndex) : undefined;
  for (const id of replayData.ids.uavs) {
    const now = replayData.row("uavs", id, stepIndex);
    const then = (column) => replayData.value("uavs", column, id, stepIndex + 1);
    if (Number.isNaN(now.x_m)) continue;
    const turnedTo = (column) => (Number.isNaN(then(column)) ? now[column] : interpolateAngle(now[column], then(column), share));
    found.push({
      ...now,
      id,
      x_m: interpolate(now.x_m, then("x_m"), share),
      y_m: interpolate(now.y_m, then("y_m"), share),
      heading_rad: turnedTo("heading_rad"),
      nose_rad: turnedTo(Number.isNaN(now.air_heading_rad) ? "heading_rad" : "air_heading_rad"),
      boresight_rad: Number.isNaN(now.boresight_rad) ? NaN : turnedTo("boresight_rad"),
      group: owner === undefined ? idOf(now.group) : owner === null ? null : agents.believed(owner, id, stepIndex).group,
      agentState: agents.isSeveral ? agentAt(replayData, id, owner, stepIndex) : null,
      turn_rate_limited: now.turn_rate_limited === 1,
      speed_limited: now.speed_limited === 1,
      avoided_uav: idOf(now.avoided_uav),
      avoided_intruder: idOf(now.avoided_intruder),
      limiting_zone: idOf(now.limiting_zone),
      zone: zoneName(replayData, now.limiting_zone),
      now_x_m: now.x_m,
      now_y_m: now.y_m,
      shown_altitude_m: interpolate(altitudeOf((column) => now[column]), altitudeOf(then), share),
      out: outages(replayData).find((out) => out.uav === id && out.since_s <= time_s && time_s <= out.until_s) ?? null,
    });
  }
  return found;
}

/** Mean true wind at the UAVs: speed, m/s, and the direction in which it moves the air, rad; NaN without wind. */
function windAt({ uavs }) {
  const mean = (column) => uavs.reduce((sum, uav) => sum + uav[column], 0) / uavs.length;
  const [x_m_s, y_m_s] = [mean("wind_x_m_s"), mean("wind_y_m_s")];
  return [Math.hypot(x_m_s, y_m_s), Math.atan2(y_m_s, x_m_s)];
}

/** Altitude of a UAV, m: flown, or commanded if altitudes are not simulated; 0 before a group sets it. `value` returns a column. */
function altitudeOf(value) {
  const known = [value("altitude_m"), value("commanded_altitude_m")].find((altitude_m) => !Number.isNaN(altitude_m));
  return known ?? 0;
}

/** Intruders further than this from every UAV need not be in view on the map, m. Same value as in `src/replay/chunk.rs`. */
const RELEVANT_M = 1200;

/** Time without reports after which UAVs stop avoiding an intruder, s. */
const AVOIDANCE_TIMEOUT_S = 30;

/** Intruders at a time, with the nearest of the given UAVs and the state of the transponder. */
function intrudersAt(replayData, time_s, uavs) {
  const { stepIndex, share } = stepPosition(replayData.times_s, time_s);
  const found = replayData.ids.intruders.map((id) => {
    const now = replayData.row("intruders", id, stepIndex);
    const then = (column) => replayData.value("intruders", column, id, stepIndex + 1);
    const { x_m: now_x_m = NaN, y_m: now_y_m = NaN } = now;
    const distances = uavs.map((uav) => ({ uav: uav.id, distance_m: Math.hypot(uav.now_x_m - now_x_m, uav.now_y_m - now_y_m) }));
    return {
      ...now,
      id,
      x_m: interpolate(now_x_m, then("x_m"), share),
      y_m: interpolate(now_y_m, then("y_m"), share),
      heading_rad: Number.isNaN(then("heading_rad")) ? now.heading_rad : interpolateAngle(now.heading_rad, then("heading_rad"), share),
      transponder_on: now.transponder_on === 1,
      silent: transponderText(replayData, id, stepIndex),
      nearest: distances.reduce((best, one) => (best && best.distance_m <= one.distance_m ? best : one), null),
      now_x_m,
      now_y_m,
    };
  });
  return found.filter(({ x_m }) => !Number.isNaN(x_m));
}

/** Text with the time since the last report of an intruder; empty while its transponder is on. */
function transponderText(replayData, id, stepIndex) {
  const isOn = (k) => replayData.value("intruders", "transponder_on", id, k) === 1;
  const ago_s = (k) => replayData.times_s[stepIndex] - replayData.times_s[k];
  let last = stepIndex;
  while (last >= 0 && !isOn(last) && ago_s(last) <= AVOIDANCE_TIMEOUT_S) last -= 1;
  if (last === stepIndex) return "";
  if (last < 0) return "no report yet";
  return ago_s(last) > AVOIDANCE_TIMEOUT_S ? `off for more than ${AVOIDANCE_TIMEOUT_S} s: no longer avoided` : `off for ${ago_s(last).toFixed(1)} s`;
}

/** Name of a zone by its index; empty for NaN. */
function zoneName(replayData, index) {
  if (Number.isNaN(index)) return "";
  const { name, kind } = replayData.head.zones?.[index] ?? {};
  return `${kind ?? "zone"} ${name ? name.slice(0, 40) : index}`;
}

/** State of the agent of a UAV, and the UAV's status in the shown team state. */
function agentAt(replayData, id, owner, stepIndex) {
  const { agents } = replayData;
  const shown = owner === null || owner === id ? null : agents.believed(owner, id, stepIndex);
  const own = (column) => replayData.value("agents", column, id, stepIndex);
  const isOn = agents.isOn(id, stepIndex);
  return {
    stepIndex, owner, isOn, shown, lag_s: own("lag_s"), link_degraded: own("link_degraded") === 1, isLimited: own("limited") === 1, group: idOf(own("group")),
    isNotReceived: shown !== null && NOT_RECEIVED.has(shown.status),
  };
}

/** A group. `now` returns a column at the current time step, `moved` interpolates it to the next one. */
function groupOf(id, now, moved) {
  return {
    id,
    x_m: moved("x_m"),
    y_m: moved("y_m"),
    standoff_distance_m: moved("standoff_distance_m"),
    shown_distance_m: now("standoff_distance_m"),
    altitude_m: now("altitude_m"),
    members: now("members"),
    spread_m: now("spread_m"),
    feasible: now("feasible") === 1,
    nearest_groupmate_m: now("nearest_groupmate_m"),
  };
}

/** Group columns that exist only in the run's main tables. */
const MAIN_GROUP_COLUMNS = ["phase_rad", "desired_phase_rad", "position_error_m", "position_crlb_m"];

/** Groups at a time; empty while another agent's team state is being loaded. */
function groupsAt(replayData, time_s) {
  const { stepIndex, share } = stepPosition(replayData.times_s, time_s);
  const found = [];
  if (replayData.agents.isOther(stepIndex)) return otherGroupsAt(replayData, time_s);
  for (const id of replayData.ids.groups) {
    const now = (column) => replayData.value("groups", column, id, stepIndex);
    const moved = (column) => interpolate(now(column), replayData.value("groups", column, id, stepIndex + 1), share);
    if (Number.isNaN(now("x_m"))) continue;
    found.push({ ...groupOf(id, now, moved), ...Object.fromEntries(MAIN_GROUP_COLUMNS.map((column) => [column, now(column)])) });
  }
  return found;
}

/** Position of a time in another agent's team states: the current and the next time step, and the fraction between them. */
function otherAt(replayData, time_s) {
  const block = replayData.agents.teamStates(time_s);
  if (!block) return null;
  const part = replayData.part(replayData.stepAt(time_s));
  const start = replayData.starts[part];
  const until_s = replayData.times_s[start + replayData.parts[part].times_s.length];
  const { stepIndex, share } = stepPosition(until_s === undefined ? block.times_s : [...block.times_s, until_s], time_s);
  const owner = replayData.agents.owner(replayData.stepAt(time_s));
  // The first time step of the next part is not looked up, so objects do not move during the last step.
  const isLast = stepIndex + 1 >= block.times_s.length;
  return { block, owner, stepIndex, next: isLast ? stepIndex : stepIndex + 1, share: isLast ? 0 : share };
}

/** A value in another agent's team state. If it equals the value in the run's main tables, it is not stored, and `shown` returns it. */
function otherValue(table, column, id, stepIndex, shown) {
  const present = table?.value("present", id, stepIndex) ?? NaN;
  if (Number.isNaN(present)) return shown();
  return present === 1 ? table.value(column, id, stepIndex) : NaN;
}

/** Groups in another agent's team state. */
function otherGroupsAt(replayData, time_s) {
  const other = otherAt(replayData, time_s);
  if (!other || other.owner === null) return [];
  const table = other.block.tables[`groups-${other.owner}`];
  const found = [];
  for (const id of new Set([...replayData.ids.groups, ...(table?.ids ?? [])])) {
    const at = (column, k) =>
      otherValue(table, column, id, k, () => replayData.value("groups", column, id, replayData.stepAt(other.block.times_s[k])));
    const now = (column) => at(column, other.stepIndex);
    const moved = (column) => interpolate(now(column), at(column, other.next), other.share);
    if (Number.isNaN(now("x_m"))) continue;
    found.push({ ...groupOf(id, now, moved), ...Object.fromEntries(MAIN_GROUP_COLUMNS.map((column) => [column, NaN])) });
  }
  return found.sort((a, b) => a.id - b.id);
}

/** Whether a target is in no UAV's view, by the column `in_view`: NaN, if it does not exist or in the first time step, is not out of view. */
const isOutOfView = (in_view) => in_view === 0;

/**
 * A target. `truth` returns a true value at the current time step and `movedTruth` interpolates it; `at` and `moved` do the same
 * for values in the team state. `velocity_m_s` is the true velocity, `null` if it is not on the page. `uavsWithView` returns the UAVs
 * that have a position in view.
 *
 * Its state has the terms of docs/user/metrics.md. `out_of_view` is true geometry and does not depend on the membership; a group member
 * (`group` is not null) that is in view is in custody.
 */
function makeTarget(id, { truth, movedTruth, at, moved, velocity_m_s, uavsWithView, radialSpeed_m_s, period_s }) {
  const tracked = !Number.isNaN(at("x_m"));
  const group = idOf(at("group"));
  const detections = truth("detections");
  const in_view = truth("in_view");
  const position = () => [truth("true_x_m"), truth("true_y_m")];
  const seenBy = () => (in_view === 1 ? uavsWithView(...position()) : []);
  return {
    id,
    exists: !Number.isNaN(truth("true_x_m")),
    tracked,
    is_view_known: !Number.isNaN(in_view),
    in_custody: in_view === 1 && group !== null,
    out_of_view: isOutOfView(in_view),
    out_of_view_s: truth("out_of_view_steps") * period_s,
    seenBy,
    /** UAVs that have it in view, with its true radial speed over ground; empty if its velocity is not on the page. */
    radialSpeeds: () => (velocity_m_s ? seenBy().map((uav) => ({ uav, speed_m_s: radialSpeed_m_s(uav, position(), velocity_m_s) })) : []),
    true_x_m: movedTruth("true_x_m"),
    true_y_m: movedTruth("true_y_m"),
    x_m: moved("x_m"),
    y_m: moved("y_m"),
    vx_m_s: at("vx_m_s"),
    vy_m_s: at("vy_m_s"),
    covariance: [at("cov_x_x"), at("cov_x_y"), at("cov_y_y")],
    status: tracked ? STATUS[at("status")] : null,
    membership: tracked ? MEMBERSHIP[at("membership")] : null,
    group,
    receiving_group: idOf(at("receiving_group")),
    detections: Number.isNaN(detections) ? 0 : detections,
    error_m: Math.hypot(at("x_m") - truth("true_x_m"), at("y_m") - truth("true_y_m")),
  };
}

/** Targets with their true positions and their tracks in another agent's team state; `null` while that is being loaded. */
function otherTargetsAt(replayData, time_s, detail) {
  const other = otherAt(replayData, time_s);
  if (!other) return null;
  const { targets } = detail.tables;
  const table = other.block.tables[`tracks-${other.owner}`];
  const detailIndex = (k) => Math.max(0, lastNotAfter(detail.times_s, other.block.times_s[k]));
  const views = viewsAt(replayData, detail.times_s[detailIndex(other.stepIndex)]);
  const found = [];
  for (const id of new Set([...targets.ids, ...(table?.ids ?? [])])) {
    const main = (column, k) => targets.value(column, id, detailIndex(k));
    const believed = (column, k) =>
      other.owner === null ? NaN : otherValue(table, column, id, k, () => main(column, k));
    const at = (column) => believed(column, other.stepIndex);
    const movedTruth = (column) => interpolate(main(column, other.stepIndex), main(column, other.next), other.share);
    const moved = (column) => interpolate(at(column), believed(column, other.next), other.share);
    const truth = (column) => main(column, other.stepIndex);
    const velocity_m_s = trueVelocity(detail, id, detailIndex(other.stepIndex));
    const target = makeTarget(id, { truth, movedTruth, at, moved, velocity_m_s, ...views });
    if (target.exists || target.tracked) found.push({ ...target, hasTeamState: other.owner !== null });
  }
  return found.sort((a, b) => a.id - b.id);
}

/** Targets at a time; `null` while they are being loaded. */
function targetsAt(replayData, time_s) {
  const detail = replayData.detail(time_s);
  if (!detail) return null;
  if (replayData.agents.isOther(replayData.stepAt(time_s))) return otherTargetsAt(replayData, time_s, detail);
  const table = detail.tables.targets;
  const following = replayData.after(detail);
  const { stepIndex, share } = stepPosition(replayData.detailTimes(detail), time_s);
  const columns = Object.fromEntries(table.columns);
  const views = viewsAt(replayData, detail.times_s[stepIndex]);
  const found = [];
  table.ids.forEach((id, row) => {
    const cell = row * table.stepCount + stepIndex;
    if (Number.isNaN(columns.detections[cell])) return;
    const next = (name) => {
      if (stepIndex + 1 < table.stepCount) return columns[name][cell + 1];
      return following ? following.tables.targets.value(name, id, 0) : NaN;
    };
    const moved = (name) => interpolate(columns[name][cell], next(name), share);
    const at = (name) => columns[name][cell];
    found.push(makeTarget(id, { truth: at, movedTruth: moved, at, moved, velocity_m_s: trueVelocity(detail, id, stepIndex), ...views }));
  });
  return found;
}

/** True velocity of a target at a time step of a detail, m/s; `null` if it is not on the page. */
function trueVelocity({ tables: { velocities } }, id, stepIndex) {
  return velocities ? ["true_vx_m_s", "true_vy_m_s"].map((column) => velocities.value(column, id, stepIndex)) : null;
}

/** The times of the UAVs and the targets that are shown; the time of the targets is undefined while they are being loaded. */
function shownTimes(replayData, time_s) {
  const shown_s = (times_s) => {
    const { stepIndex, share } = stepPosition(times_s, time_s);
    return share > 0 ? times_s[stepIndex] + share * (times_s[stepIndex + 1] - times_s[stepIndex]) : times_s[stepIndex];
  };
  const detail = replayData.detail(time_s);
  return { uavs_s: shown_s(replayData.times_s), targets_s: detail && shown_s(replayData.detailTimes(detail)) };
}

/** The last time step that is not after a time, and the fraction of the way to the next time step. */
function stepPosition(times_s, time_s) {
  const stepIndex = Math.max(0, lastNotAfter(times_s, time_s));
  const gap_s = times_s[stepIndex + 1] - times_s[stepIndex];
  const share = gap_s > 0 ? Math.min(Math.max((time_s - times_s[stepIndex]) / gap_s, 0), 1) : 0;
  return { stepIndex, share };
}

/**
 * States by which targets are counted and filtered: key, text, condition, explanation. A target can be in several of them. They are in the
 * order of the header, which leaves out those without targets.
 */
const TARGET_STATES = [
  ["in-custody", "in custody", (target) => target.in_custody, "Targets that are in a group and in some UAV's view (true geometry)"],
  ["out-of-view", "out of view", (target) => target.out_of_view, "Existing targets that are in no UAV's view (true geometry), in a group or not"],
  ["untracked", "untracked", isUntracked, "Existing targets without a track: lost, or not found yet"],
  ["ungrouped", "ungrouped", (target) => target.membership === "ungrouped", "Tracks in no group: new, or no UAV can cover them"],
  ["removed", "removed", (target) => target.membership === "removed", "Tracks removed from their group, because no feasible orbit could include them"],
  ["in-handoff", "in handoff", (target) => target.membership === "in-handoff", "Tracks in handoff from one group to another, or joining their first group"],
  ["coasting", "coasting", (target) => target.status === "coasting", "Tracks that are predicted and not measured in this time step"],
];

/** Whether an existing target has no track. Without a team state, a missing track is no warning. */
function isUntracked(target) {
  return target.exists && !target.tracked && target.hasTeamState !== false;
}

/** The warning about a target; empty if there is none. A target out of view in no group is not the same as a group member out of view. */
function warningOf(target) {
  const membership = ["removed", "in-handoff", "ungrouped"].includes(target.membership) ? target.membership.replace("-", " ") : "";
  const place = isUntracked(target) ? "untracked" : membership;
  if (target.out_of_view) return target.group !== null || !place ? "out of view" : `out of view, ${place}`;
  return place || (target.status === "coasting" ? "coasting" : "");
}

/** The group of a target or, in handoff, the group that it joins. */
function groupOfTarget({ group, receiving_group }) {
  return receiving_group === null ? `${group ?? "none"}` : `in handoff, joins ${receiving_group}`;
}

/** Warnings about targets, most severe first. */
const WARNINGS = ["out of view", "out of view, removed", "out of view, ungrouped", "out of view, in handoff", "out of view, untracked", "coasting",
  "in handoff", "untracked", "ungrouped", "removed", ""];

/** Returns functions that compute which UAVs have a position in view at a time step, and a radial speed; and the period of the mission. */
function viewsAt(replayData, time_s) {
  const { field_of_view_rad, sensing_range_m } = replayData.head.limits;
  const stepIndex = replayData.stepAt(time_s);
  let pointed = null;
  const uavsWithView = (x_m, y_m) => {
    pointed ??= replayData.ids.uavs.map((id) => {
      const at = (column) => replayData.value("uavs", column, id, stepIndex);
      return { id, x_m: at("x_m"), y_m: at("y_m"), boresight_rad: at("boresight_rad") };
    }).filter((uav) => !Number.isNaN(uav.boresight_rad));
    // At most 1 if the position is in view. Infinite ranges are null in JSON.
    const share = (uav) => {
      const range_m = Math.hypot(x_m - uav.x_m, y_m - uav.y_m);
      return Math.max(range_m / (sensing_range_m ?? Infinity), offBoresight_rad(uav, x_m, y_m) / (field_of_view_rad / 2));
    };
    const shares = pointed.map((uav) => [uav.id, share(uav)]);
    // `in_view` is computed in double precision. At the edge of a view, single precision may give another result.
    const most = Math.max(1, Math.min(...shares.map(([, value]) => value)));
    return shares.filter(([, value]) => value <= most).map(([id]) => id);
  };
  const radialSpeed_m_s = (uav, [x_m, y_m], [vx_m_s, vy_m_s]) => {
    const [dx_m, dy_m] = [x_m - replayData.value("uavs", "x_m", uav, stepIndex), y_m - replayData.value("uavs", "y_m", uav, stepIndex)];
    return Math.abs(dx_m * vx_m_s + dy_m * vy_m_s) / Math.hypot(dx_m, dy_m);
  };
  return { uavsWithView, radialSpeed_m_s, period_s: replayData.head.period_s };
}

/** Outages by replay, with the number of time steps and events from which they were computed. */
const OUTAGES = new WeakMap();

/**
 * Outages of UAVs in the loaded data: start, end, and the position at the start. The sensor of a UAV in an outage points
 * nowhere. A UAV without targets also points nowhere, so the team must have reported the loss of the UAV as well.
 */
function outages(replayData) {
  const size = replayData.times_s.length + replayData.allEvents.length;
  if (OUTAGES.get(replayData)?.size === size) return OUTAGES.get(replayData).found;
  const found = [];
  for (const { time_s, uavs } of replayData.allEvents.filter((event) => event.kind === "uav-timeout")) {
    for (const uav of uavs) {
      const points = (stepIndex) => !Number.isNaN(replayData.value("uavs", "boresight_rad", uav, stepIndex));
      let [first, last] = [replayData.stepAt(time_s), replayData.stepAt(time_s)];
      if (points(first)) continue;
      while (first > 0 && !points(first - 1)) first -= 1;
      while (last + 1 < replayData.times_s.length && !points(last + 1)) last += 1;
      const [x_m, y_m] = ["x_m", "y_m"].map((column) => replayData.value("uavs", column, uav, first));
      if (found.some((out) => out.uav === uav && out.since_s === replayData.times_s[first])) continue;
      const until_s = last + 1 < replayData.times_s.length ? replayData.times_s[last] : Infinity;
      found.push({ uav, since_s: replayData.times_s[first], until_s, x_m, y_m });
    }
  }
  OUTAGES.set(replayData, { size, found });
  return found;
}
