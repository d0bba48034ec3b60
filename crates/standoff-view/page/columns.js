// What is said of UAVs, groups and targets in tables, cards and files: key, heading, value in words, what it means. Values
// are those of the instant that is on, not between two.

const DEGREES = 180 / Math.PI;

const UAV_COLUMNS = [
  ["id", "UAV", (uav) => `${uav.id}`, "The UAV's number"],
  ["group", "Group", (uav) => (uav.group === null ? "none" : `${uav.group}`), "The group that it serves"],
  ["x_m", "East (m)", (uav) => fixed(uav.now_x_m, 1), "Metres east of the origin; negative: west"],
  ["y_m", "North (m)", (uav) => fixed(uav.now_y_m, 1), "Metres north of the origin; negative: south"],
  ["speed_m_s", "Speed (m/s)", (uav) => fixed(uav.speed_m_s, 2) + (uav.speed_limited ? " limit" : ""),
    "Speed; limit: the law asked for more change of speed than is allowed"],
  ["turn_rate_deg_s", "Turn rate (\u00b0/s)", (uav) =>
    fixed(uav.turn_rate_rad_s * DEGREES, 2) + (uav.turn_rate_limited ? " limit" : ""),
    "Positive: to the left (counter-clockwise); limit: the law asked for more than is allowed"],
  ["centre_distance_m", "To centre (m)", (uav) => fixed(uav.centre_distance_m, 1), "Distance from its group's estimated centre"],
  ["standoff_error_m", "Off the orbit (m)", (uav) => fixed(uav.standoff_error_m, 1),
    "Standoff error by the true geometry: distance from the true centre less the r_d that it asks for; positive: outside, negative: inside"],
  ["line_of_sight_deg", "Line of sight (\u00b0)", (uav) =>
    uav.out ? `out since ${uav.out.since_s.toFixed(1)} s` : fixed(uav.line_of_sight_rad * DEGREES, 1),
    "Largest angle, at the UAV, between its boresight and the true place of a member of its group; beyond half the field of view it is not seen"],
  ["keeps_off", "Keeps off", (uav) => [avoidsWords(uav), uav.zone].filter(Boolean).join(", "),
    "The UAV or intruder from which it keeps away, and how near they would have come as it foretold; the zone because of which it flies another way"],
];

/** Whom a UAV avoids; nothing for nobody. */
function avoidsWords({ avoids, avoids_intruder, foretold_m }) {
  if (avoids === null && avoids_intruder === null) return "";
  const whom = avoids === null ? `intruder ${avoids_intruder}` : `UAV ${avoids}`;
  return `${whom}${Number.isNaN(foretold_m) ? "" : ` (${foretold_m.toFixed(0)} m foretold)`}`;
}

const GROUP_COLUMNS = [
  ["id", "Group", (group) => `${group.id}`, "The group's number"],
  ["members", "Members", (group) => fixed(group.members, 0), "Tracks that belong to it, those in dwell to or from it included"],
  ["standoff_distance_m", "Orbit (m)", (group) => fixed(group.shown_distance_m, 1) + (group.feasible ? "" : " not feasible"),
    "Standoff distance r_d: radius of the desired orbit about the estimated centre; not feasible: no orbit satisfies every constraint"],
  ["spread_m", "Spread (m)", (group) => fixed(group.spread_m, 1), "d_max: from the estimated centre to the furthest member"],
  ["phase_deg", "Phase (\u00b0)", (group) => fixed(group.phase_rad * DEGREES, 1),
    "Angle between UAVs on the orbit, seen from its centre: of the two neighbours whose angle is furthest from what is wanted"],
  ["separation_m", "Separation (m)", (group) => fixed(group.separation_m, 0), "Smallest distance between two of its UAVs"],
  ["position_error_m", "Position error (m)", (group) => fixed(group.position_error_m, 2),
    "Root of the mean squared distance of its members' estimated from their true places"],
];

const INTRUDER_COLUMNS = [
  ["id", "Intruder", (intruder) => `${intruder.id}`, "The intruder's number: its place in the scenario, from 0"],
  ["x_m", "East (m)", (intruder) => fixed(intruder.now_x_m, 1), "Metres east of the origin, as it really is; negative: west"],
  ["y_m", "North (m)", (intruder) => fixed(intruder.now_y_m, 1), "Metres north of the origin, as it really is; negative: south"],
  ["speed_m_s", "Speed (m/s)", (intruder) => fixed(intruder.speed_m_s, 2), "Its true speed"],
  ["heading_deg", "Heading (\u00b0)", (intruder) => compass(intruder.heading_rad), "Compass heading: 0 is north, 90 east"],
  ["nearest_m", "Nearest UAV (m)", ({ nearest }) => (nearest ? `${fixed(nearest.distance_m, 0)} (UAV ${nearest.uav})` : "\u2013"),
    "How far the nearest UAV is, whatever their altitudes; and which it is"],
  ["tells", "Tells where it is", ({ silent }) => silent || "yes",
    `Whether it tells where it is; who has told nothing for more than ${FORGOTTEN_S} s is not kept away from`],
];

const TARGET_COLUMNS = [
  ["name", "Target", (target) => target.name, "The target's name in the scenario or the traffic file"],
  ["state", "State", (target) => [target.place, target.status].filter(Boolean).join(", ") || "no track",
    "Where its track belongs (member of a group; dwell: being handed over; unassigned; discarded: no orbit could hold it), and whether it " +
    "is held (measured now), coasting (predicted) or cued (told of, not yet measured)"],
  ["concern", "To note", (target) => concern(target), "What should not be missed; out of view: a group member in no UAV's view, by the true geometry"],
  ["group", "Group", (target) =>
    target.group === null ? "none" : target.to_group === null ? `${target.group}` : `${target.group} to ${target.to_group}`,
    "The group that its track belongs to; with two numbers it is being handed over"],
  ["error_m", "Position error (m)", (target) => fixed(target.error_m, 2), "Distance of its estimated from its true place"],
  ["detections", "Seen by", (target) => `${target.detections}`, "How many UAVs measured it at this instant"],
];

/** What is said of minds, where they are several. */
const MIND_COLUMNS = [
  ["id", "Mind", (mind) => `UAV ${mind.id}`, "The UAV whose mind it is"],
  ["hears", "Does not hear", (mind) => (mind.is_on ? mind.unheard : "off"),
    "UAVs that it does not hear, and how old its newest report of each is; off: its computer is off"],
  ["crews", "Who serves what, by it", (mind) => mind.crews,
    "Which group each UAV serves, by this mind; after a group's number when it was founded, which tells two of one number apart"],
  ["agrees", "Agrees with", (mind) => mind.agrees, "Minds by which the same UAVs serve the same groups"],
  ["lag_s", "Certain (s ago)", (mind) => fixed(mind.lag_s, 1), "What it believes up to so long ago cannot change any more"],
];

/** What only cards say, where there is more room. */
const UAV_DETAILS = [
  ["heading_deg", "Heading (\u00b0)", (uav) => compass(uav.heading_rad), "Compass heading: 0 is north, 90 east"],
  ["boresight_deg", "Boresight (\u00b0)", (uav) => compass(uav.boresight_rad), "Where the sensor points, as a compass bearing; none: it points nowhere"],
];
const TARGET_DETAILS = [
  ["speed_m_s", "Speed (m/s)", (target) => fixed(Math.hypot(target.vx_m_s, target.vy_m_s), 1), "Estimated speed over ground"],
  ["course_deg", "Course (\u00b0)", (target) => compass(Math.atan2(target.vy_m_s, target.vx_m_s)), "Estimated course: 0 is north, 90 east"],
  ["ellipse_m", "95 % ellipse (m)", (target) => ellipseOf(target.covariance).slice(0, 2).map((axis_m) => fixed(axis_m, 1)).join(" \u00d7 "),
    "Half axes of the ellipse that holds it with 95 % probability, if the filter is right"],
];

/** A number in words; a dash for none. */
function fixed(value, digits) {
  if (value === undefined || Number.isNaN(value)) return "\u2013";
  return value.toFixed(digits).replace("-", "\u2212");
}

/** A direction, counted from east to the left, as a compass bearing in degrees. */
function compass(angle_rad) {
  return Number.isNaN(angle_rad) ? "\u2013" : `${Math.round((450 - angle_rad * DEGREES) % 360 + 360) % 360}`.padStart(3, "0");
}
