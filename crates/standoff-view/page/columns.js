// Columns of UAVs, groups, intruders, targets and agents in tables, cards and files: key, heading, text of the value, tooltip.
// Values are those of the current time step; they are not interpolated.

const DEGREES = 180 / Math.PI;

// Soft hyphens (U+00AD) in long headings keep the table of UAVs as narrow as the side panel.

const UAV_COLUMNS = [
  ["id", "UAV", (uav) => `${uav.id}`, "UAV number, from 0"],
  ["group", "Group", (uav) => (uav.group === null ? "none" : `${uav.group}`), "Group that the UAV is assigned to"],
  ["x_m", "East (m)", (uav) => fixed(uav.now_x_m, 1), "Metres east of the origin; negative: west"],
  ["y_m", "North (m)", (uav) => fixed(uav.now_y_m, 1), "Metres north of the origin; negative: south"],
  ["speed_m_s", "Speed (m/s)", (uav) => fixed(uav.speed_m_s, 2) + (uav.speed_limited ? " limit" : ""),
    "Ground speed; limit: the commanded speed change exceeded the limit"],
  ["turn_rate_deg_s", "Turn rate (\u00b0/s)", (uav) =>
    fixed(uav.turn_rate_rad_s * DEGREES, 2) + (uav.turn_rate_limited ? " limit" : ""),
    "Positive: to the left (anticlockwise); limit: the commanded turn rate exceeded the limit"],
  ["centre_distance_m", "To centre (m)", (uav) => fixed(uav.centre_distance_m, 1), "Distance from the estimated centre of its group"],
  ["standoff_error_m", "Stand\u00adoff error (m)", (uav) => fixed(uav.standoff_error_m, 1),
    "True distance from the true centre of the group minus the r_d that this centre requires; positive: outside the orbit, negative: inside"],
  ["off_boresight_deg", "Off-bore\u00adsight angle (\u00b0)", (uav) =>
    uav.out ? `out since ${uav.out.since_s.toFixed(1)} s` : fixed(uav.off_boresight_rad * DEGREES, 1),
    "Largest angle between the boresight and the true direction to a member of the group; beyond half the field of view the member is out of view"],
  ["avoiding", "Avoid\u00ading", (uav) => [avoidedText(uav), uav.zone].filter(Boolean).join(", "),
    "UAV or intruder that collision avoidance reacts to (predicted minimum distance); and the geofence zone that makes the UAV deviate"],
];

/** The aircraft that a UAV avoids, with the predicted minimum distance; empty if there is none. */
function avoidedText({ avoided_uav, avoided_intruder, predicted_distance_m }) {
  if (avoided_uav === null && avoided_intruder === null) return "";
  const aircraft = avoided_uav === null ? `intruder ${avoided_intruder}` : `UAV ${avoided_uav}`;
  return `${aircraft}${Number.isNaN(predicted_distance_m) ? "" : ` (${predicted_distance_m.toFixed(0)} m)`}`;
}

const GROUP_COLUMNS = [
  ["id", "Group", (group) => `${group.id}`, "Group number, from 0"],
  ["members", "Members", (group) => fixed(group.members, 0), "Number of tracks in the group, including tracks in handoff to or from it"],
  ["standoff_distance_m", "Orbit (m)", (group) => fixed(group.shown_distance_m, 1) + (group.feasible ? "" : " not feasible"),
    "Standoff distance r_d: radius of the desired orbit about the estimated centre; not feasible: no orbit satisfies all constraints"],
  ["spread_m", "Spread (m)", (group) => fixed(group.spread_m, 1), "d_max: distance from the estimated centre to the furthest member"],
  ["phase_deg", "Phase differ\u00adence (\u00b0)", (group) => fixed(group.phase_rad * DEGREES, 1),
    "Angle between neighbouring UAVs on the orbit, seen from its centre; for the pair that is furthest from the desired phase"],
  ["nearest_groupmate_m", "Separation (m)", (group) => fixed(group.nearest_groupmate_m, 0), "Smallest distance between two UAVs of the group"],
  ["position_error_m", "Position error (m)", (group) => fixed(group.position_error_m, 2),
    "Root mean square distance between the estimated and the true positions of the members"],
];

const INTRUDER_COLUMNS = [
  ["id", "Intruder", (intruder) => `${intruder.id}`, "Intruder number: its index in the scenario, from 0"],
  ["x_m", "East (m)", (intruder) => fixed(intruder.now_x_m, 1), "True position, metres east of the origin; negative: west"],
  ["y_m", "North (m)", (intruder) => fixed(intruder.now_y_m, 1), "True position, metres north of the origin; negative: south"],
  ["speed_m_s", "Speed (m/s)", (intruder) => fixed(intruder.speed_m_s, 2), "True speed"],
  ["heading_deg", "Heading (\u00b0)", (intruder) => compass(intruder.heading_rad), "Compass heading: 0 is north, 90 east"],
  ["nearest_m", "Nearest UAV (m)", ({ nearest }) => (nearest ? `${fixed(nearest.distance_m, 0)} (UAV ${nearest.uav})` : "\u2013"),
    "Horizontal distance to the nearest UAV, and the number of that UAV"],
  ["transponder", "Transponder", ({ silent }) => silent || "on",
    `Whether the intruder reports its position; UAVs stop avoiding an intruder that has sent no report for more than ${AVOIDANCE_TIMEOUT_S} s`],
];

/** As above, with the value by which the table is sorted; names have a rank, which does not depend on the time. */
const TARGET_COLUMNS = [
  ["name", "Target", (target) => target.name, "Name of the target in the scenario or the traffic file"],
  ["state", "State", stateText,
    "Membership of the track (member: in a group; in-handoff: in handoff; ungrouped: in no group; removed: no feasible orbit could include it) " +
    "and its status (updated: measured in this time step; coasting: predicted only; cued: reported by a cue source, not measured yet)", stateText],
  ["warning", "Warning", warningOf, "State that needs attention; out of view: in no UAV's view (true geometry)", (target) => WARNINGS.indexOf(warningOf(target))],
  ["group", "Group", groupOfTarget, "Group of the track; in handoff: the group that it joins", (target) => target.group],
  ["out_of_view_s", "Out of view for (s)", (target) => fixed(target.out_of_view ? target.out_of_view_s : NaN, 1),
    "Time for which the target has been in no UAV's view (true geometry)", (target) => (target.out_of_view ? target.out_of_view_s : NaN)],
  ["seen_by", "Seen by", seenByText, "UAVs that have the target in view: within their field of view and sensing range (true geometry)",
    seenByText],
  ["error_m", "Position error (m)", (target) => fixed(target.error_m, 2), "Distance between the estimated and the true position", (target) => target.error_m],
];

/** Membership and status of a target's track. */
function stateText(target) {
  return [target.membership, target.status].filter(Boolean).join(", ") || "no track";
}

/** Names of the UAVs that have a target in view; a dash if the target does not exist, and in the first time step. */
function seenByText(target) {
  if (!target.is_view_known) return "\u2013";
  return target.seenBy().map((id) => `UAV ${id}`).join(", ") || "none";
}

/** Columns of agents; used only if every UAV runs its own agent. */
const AGENT_COLUMNS = [
  ["id", "Agent", (agent) => `UAV ${agent.id}`, "UAV that runs the agent"],
  ["missing_reports", "No reports from", (agent) => (agent.isOn ? agent.notReceived : "off"),
    "UAVs whose reports this agent does not receive, with the age of the last report; off: the computer is off"],
  ["assignments", "Assignments", (agent) => agent.assignments,
    "UAVs assigned to each group in this agent's team state; the creation time distinguishes groups with equal numbers"],
  ["agrees", "Same assignments", (agent) => agent.agrees, "Agents whose team states have the same assignments"],
  ["lag_s", "Commit lag (s)", (agent) => fixed(agent.lag_s, 1) + (agent.isLimited ? "*" : ""),
    "Time since the last committed time step; the team state up to that step is final. *: missing messages wait, because the bandwidth or the budget for retransmissions is spent"],
];

/** Additional rows of cards, which have more space than tables. */
const UAV_DETAILS = [
  ["heading_deg", "Heading (\u00b0)", (uav) => compass(uav.nose_rad), "Compass heading: 0 is north, 90 east"],
  ["boresight_deg", "Boresight (\u00b0)", (uav) => compass(uav.boresight_rad), "Compass bearing of the sensor; dash: the sensor points nowhere"],
];
/** Further rows of a UAV in wind. */
const WIND_DETAILS = [
  ["course_deg", "Course (\u00b0)", (uav) => compass(uav.heading_rad), "Direction of motion over ground: 0 is north, 90 east"],
  ["airspeed_m_s", "Airspeed (m/s)", (uav) => fixed(uav.airspeed_m_s, 2), "Speed relative to the air"],
  ["wind", "Wind", (uav) => `${fixed(Math.hypot(uav.wind_x_m_s, uav.wind_y_m_s), 1)} m/s from ${windFrom(Math.atan2(uav.wind_y_m_s, uav.wind_x_m_s))}\u00b0`,
    "True wind at the UAV, and the compass direction it blows from"],
];
const TARGET_DETAILS = [
  ["leaves", "Leaves group", ({ group, receiving_group }) => (group === null || receiving_group === null ? "" : `${group}`),
    "In handoff: the group that the target belongs to until the receiving group has it in view"],
  ["detections", "Measured by", (target) => `${target.detections} ${target.detections === 1 ? "UAV" : "UAVs"}`,
    "Number of UAVs that measured the target in this time step"],
  ["speed_m_s", "Speed (m/s)", (target) => fixed(Math.hypot(target.vx_m_s, target.vy_m_s), 1), "Estimated speed over ground"],
  ["course_deg", "Course (\u00b0)", (target) => compass(Math.atan2(target.vy_m_s, target.vx_m_s)), "Estimated course: 0 is north, 90 east"],
  ["ellipse_m", "95 % ellipse (m)", (target) => ellipseOf(target.covariance).slice(0, 2).map((axis_m) => fixed(axis_m, 1)).join(" \u00d7 "),
    "Semi-axes of the 95 % confidence ellipse of the position, if the filter is consistent"],
];

/** Formats a number with a fixed number of digits; a dash for NaN. */
function fixed(value, digits) {
  if (value === undefined || Number.isNaN(value)) return "\u2013";
  return value.toFixed(digits).replace("-", "\u2212");
}

/** Formats the compass direction, in degrees, from which a wind blows that moves the air towards `toward_rad`. */
function windFrom(toward_rad) {
  return compass(toward_rad + Math.PI);
}

/** Formats an angle, anticlockwise from east, as a compass bearing in degrees. */
function compass(angle_rad) {
  return Number.isNaN(angle_rad) ? "\u2013" : `${Math.round((450 - angle_rad * DEGREES) % 360 + 360) % 360}`.padStart(3, "0");
}
