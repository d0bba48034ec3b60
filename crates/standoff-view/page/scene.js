// What there is at a time, from a replay: plain objects that the map and the tables show.

const STATUS = ["cued", "held", "coasting"];
const PLACE = ["unassigned", "member", "dwell", "discarded"];

/** An id, or `null` for a NaN. */
function idOf(value) {
  return Number.isNaN(value) ? null : value;
}

/** UAVs at a time: where they are is between instants, all else is of the instant that is on. */
function uavsAt(film, time_s) {
  const { instant, share } = placeOf(film.times_s, time_s);
  const found = [];
  for (const id of film.ids.uavs) {
    const now = (column) => film.value("uavs", column, id, instant);
    const then = (column) => film.value("uavs", column, id, instant + 1);
    if (Number.isNaN(now("x_m"))) continue;
    const swung = (column) => (Number.isNaN(then(column)) ? now(column) : turned(now(column), then(column), share));
    found.push({
      id,
      x_m: between(now("x_m"), then("x_m"), share),
      y_m: between(now("y_m"), then("y_m"), share),
      heading_rad: swung("heading_rad"),
      boresight_rad: Number.isNaN(now("boresight_rad")) ? NaN : swung("boresight_rad"),
      group: idOf(now("group")),
      speed_m_s: now("speed_m_s"),
      turn_rate_rad_s: now("turn_rate_rad_s"),
      turn_rate_limited: now("turn_rate_limited") === 1,
      speed_limited: now("speed_limited") === 1,
      centre_distance_m: now("centre_distance_m"),
      standoff_error_m: now("standoff_error_m"),
      line_of_sight_rad: now("line_of_sight_rad"),
      now_x_m: now("x_m"),
      now_y_m: now("y_m"),
      out: outages(film).find((out) => out.uav === id && out.since_s <= time_s && time_s <= out.until_s) ?? null,
    });
  }
  return found;
}

/** Groups at a time. */
function groupsAt(film, time_s) {
  const { instant, share } = placeOf(film.times_s, time_s);
  const found = [];
  for (const id of film.ids.groups) {
    const now = (column) => film.value("groups", column, id, instant);
    const moved = (column) => between(now(column), film.value("groups", column, id, instant + 1), share);
    if (Number.isNaN(now("x_m"))) continue;
    found.push({
      id,
      x_m: moved("x_m"),
      y_m: moved("y_m"),
      standoff_distance_m: moved("standoff_distance_m"),
      shown_distance_m: now("standoff_distance_m"),
      members: now("members"),
      spread_m: now("spread_m"),
      feasible: now("feasible") === 1,
      separation_m: now("separation_m"),
      phase_rad: now("phase_rad"),
      phase_wanted_rad: now("phase_wanted_rad"),
      position_error_m: now("position_error_m"),
      position_bound_m: now("position_bound_m"),
    });
  }
  return found;
}

/** Targets at a time; `null` while they are being loaded. */
function targetsAt(film, time_s) {
  const detail = film.detail(time_s);
  if (!detail) return null;
  const table = detail.tables.targets;
  const following = film.after(detail);
  const { instant, share } = placeOf(film.detailTimes(detail), time_s);
  const columns = Object.fromEntries(table.columns);
  const found = [];
  table.ids.forEach((id, place) => {
    const cell = place * table.instants + instant;
    if (Number.isNaN(columns.detections[cell])) return;
    const next = (name) => {
      if (instant + 1 < table.instants) return columns[name][cell + 1];
      return following ? following.tables.targets.value(name, id, 0) : NaN;
    };
    const moved = (name) => between(columns[name][cell], next(name), share);
    const there = !Number.isNaN(columns.true_x_m[cell]);
    const tracked = !Number.isNaN(columns.x_m[cell]);
    const at = (name) => columns[name][cell];
    const group = idOf(at("group"));
    found.push({
      id,
      there,
      tracked,
      true_x_m: moved("true_x_m"),
      true_y_m: moved("true_y_m"),
      x_m: moved("x_m"),
      y_m: moved("y_m"),
      vx_m_s: at("vx_m_s"),
      vy_m_s: at("vy_m_s"),
      covariance: [at("cov_x_x"), at("cov_x_y"), at("cov_y_y")],
      status: tracked ? STATUS[at("status")] : null,
      place: tracked ? PLACE[at("place")] : null,
      group,
      to_group: idOf(at("to_group")),
      detections: at("detections"),
      out_of_view: at("in_view") === 0 && group !== null,
      error_m: Math.hypot(at("x_m") - at("true_x_m"), at("y_m") - at("true_y_m")),
    });
  });
  return found;
}

/** The times of which UAVs and targets are shown at a time: those of targets are absent while they are being loaded. */
function shownTimes(film, time_s) {
  const shown_s = (times_s) => {
    const { instant, share } = placeOf(times_s, time_s);
    return share > 0 ? times_s[instant] + share * (times_s[instant + 1] - times_s[instant]) : times_s[instant];
  };
  const detail = film.detail(time_s);
  return { uavs_s: shown_s(film.times_s), targets_s: detail && shown_s(film.detailTimes(detail)) };
}

/** The last instant not after a time, and how far towards the next one it is. */
function placeOf(times_s, time_s) {
  const instant = Math.max(0, lastNotAfter(times_s, time_s));
  const gap_s = times_s[instant + 1] - times_s[instant];
  const share = gap_s > 0 ? Math.min(Math.max((time_s - times_s[instant]) / gap_s, 0), 1) : 0;
  return { instant, share };
}

/** What should not be missed about a target, in words; empty if all is well. */
function concern(target) {
  if (target.out_of_view) return "out of view";
  if (target.place === "discarded") return "discarded";
  if (target.place === "dwell") return "in dwell";
  if (target.tracked && target.place === "unassigned") return "unassigned";
  if (target.status === "coasting") return "coasting";
  if (target.there && !target.tracked) return "untracked";
  return "";
}

/** By film: when UAVs were out, and how many instants and events that was worked out of. */
const OUTAGES = new WeakMap();

/**
 * When UAVs were out, as far as has been loaded: since when, until when, and where they were then. A UAV that is out points
 * no sensor; but neither does one with nothing to look at: the team must have noticed.
 */
function outages(film) {
  const size = film.times_s.length + film.events.length;
  if (OUTAGES.get(film)?.size === size) return OUTAGES.get(film).found;
  const found = [];
  for (const { time_s, uavs } of film.events.filter((event) => event.kind === "uav-lost")) {
    for (const uav of uavs) {
      const points = (instant) => !Number.isNaN(film.value("uavs", "boresight_rad", uav, instant));
      let [first, last] = [film.instant(time_s), film.instant(time_s)];
      if (points(first)) continue;
      while (first > 0 && !points(first - 1)) first -= 1;
      while (last + 1 < film.times_s.length && !points(last + 1)) last += 1;
      const [x_m, y_m] = ["x_m", "y_m"].map((column) => film.value("uavs", column, uav, first));
      const until_s = last + 1 < film.times_s.length ? film.times_s[last] : Infinity;
      found.push({ uav, since_s: film.times_s[first], until_s, x_m, y_m });
    }
  }
  OUTAGES.set(film, { size, found });
  return found;
}
