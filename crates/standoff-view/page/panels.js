// Panels of the charts.

/**
 * A panel has a title, a unit, a description (`about`), the factor from SI units to the unit, and curves. A curve belongs to
 * the run, to each UAV or to each group; it has the column it shows, a dash style, and a note that distinguishes it from other
 * curves of the same object. `levels` are horizontal lines, described by `level`.
 */
const PANELS = [
  { key: "in_custody", title: "Targets in custody", unit: "", factor: 1,
    about: "Number of targets that exist, that have a track, that are in the field of view of at least one UAV (in view), and that are " +
      "in view and belong to a group (in custody). True geometry.",
    curves: [
      { of: "run", column: "targets", note: "exist", dash: "solid", ink: "none" },
      { of: "run", column: "tracked", note: "tracked", dash: "dash", ink: "none" },
      { of: "run", column: "in_view", note: "in view", dash: "dot", ink: "ink" },
      { of: "run", column: "in_custody", note: "in custody", dash: "solid", ink: "ink" },
    ], fromZero: true },
  { key: "position_error", title: "Position error", unit: "m", factor: 1,
    about: "Root mean square distance between tracks and true target positions, over the members of a group and over all tracks " +
      "of the run. The bound is the Cramer-Rao lower bound for unbiased filters; it is drawn where it is defined.",
    curves: [
      { of: "groups", column: "position_error_m", note: "", dash: "solid" },
      { of: "groups", column: "position_crlb_m", note: "bound", dash: "dash" },
      { of: "run", column: "position_error_m", note: "all tracks", dash: "dot", ink: "ink" },
    ], fromZero: true },
  { key: "off_boresight", title: "Off-boresight angle", unit: "\u00b0", factor: DEGREES,
    about: "The largest angle between a UAV's boresight and the true direction to a member of its group. Beyond half the field of view " +
      "the member is out of view of that UAV.",
    curves: [{ of: "uavs", column: "off_boresight_rad", note: "", dash: "solid" }],
    levels: (limits) => [limits.field_of_view_rad / 2], level: "half the field of view", fromZero: true },
  { key: "standoff_distance", title: "Standoff distance", unit: "m", factor: 1,
    about: "The desired orbit radius r_d about the estimated centre of each group, and the distance of each UAV from the estimated centre of " +
      "its group.",
    curves: [
      { of: "groups", column: "standoff_distance_m", note: "r_d", dash: "solid" },
      { of: "uavs", column: "centre_distance_m", note: "to centre", dash: "dot" },
    ],
    levels: (limits) => [limits.radius_min_m, limits.radius_max_m], level: "limits" },
  { key: "standoff_error", title: "True standoff error", unit: "m", hint: "outside (+), inside (\u2212)", factor: 1,
    about: "The distance of a UAV from the required orbit of its group: r \u2212 r_d about the true centre of the members. Positive values are " +
      "outside the orbit, negative values inside.",
    curves: [{ of: "uavs", column: "standoff_error_m", note: "", dash: "solid" }],
    levels: () => [0], level: "on the orbit" },
  { key: "phase", title: "Phase difference", unit: "\u00b0", factor: DEGREES,
    about: "The angle between neighbouring UAVs on the same orbit, seen from its centre. With more than two UAVs, the pair that is " +
      "furthest from the desired phase is shown.",
    curves: [
      { of: "groups", column: "phase_rad", note: "", dash: "solid" },
      { of: "groups", column: "desired_phase_rad", note: "desired", dash: "dash" },
    ] },
  { key: "speed", title: "Speed", unit: "m/s", factor: 1,
    about: "The ground speed of each UAV and its limits.",
    curves: [{ of: "uavs", column: "speed_m_s", note: "", dash: "solid" }],
    levels: (limits) => [limits.speed_min_m_s, limits.speed_max_m_s], level: "limits" },
  { key: "turn_rate", title: "Turn rate", unit: "\u00b0/s", factor: DEGREES,
    about: "The turn rate of each UAV and its limits; positive is anticlockwise.",
    curves: [{ of: "uavs", column: "turn_rate_rad_s", note: "", dash: "solid" }],
    levels: (limits) => [-limits.turn_rate_max_rad_s, limits.turn_rate_max_rad_s], level: "limits" },
  { key: "scan_sd", title: "Single-scan accuracy", unit: "m", factor: 1,
    about: "Standard deviation of the position of a target at the true centre of the group after one scan by each UAV of the group: " +
      "the fourth root of the inverse determinant of the information matrix.",
    curves: [{ of: "groups", column: "scan_sd_m", note: "", dash: "solid" }], fromZero: true },
];

/** The panel of the selected target. */
const TARGET_PANEL = {
  key: "target", title: "Target", unit: "m", hint: "position error", factor: 1, fromZero: true, curves: [],
  about: "Distance between the track of the selected target and its true position. Shaded: times at which the target is in no UAV's view, " +
    "in a group or not, and times at which its track is coasting (not measured).",
};

/** The panel of a quantity that the user has added: a column of a table of the replay, for all objects. */
function columnPanel(of, column) {
  const { name, unit, factor } = quantity(column);
  return { key: `${of}.${column}`, title: `${QUANTITY_TABLES[of]}: ${name}`, unit, factor, isAdded: true,
    about: `The column ${column} of the table ${of}.`, curves: [{ of, column, note: "", dash: "solid" }] };
}

/** Tables whose columns can be charts, with their headings. */
const QUANTITY_TABLES = { uavs: "UAVs", groups: "Groups", intruders: "Intruders", run: "Run" };
/** Suffixes of column names, longest first: unit on the page, and the factor from SI units to it. */
const UNITS = [["_m2_s", "m\u00b2/s", 1], ["_rad_s", "\u00b0/s", DEGREES], ["_m_s", "m/s", 1], ["_rad", "\u00b0", DEGREES], ["_m", "m", 1], ["_s", "s", 1]];

/** Name, unit and factor of a quantity, by the name of its column. */
function quantity(column) {
  const [suffix, unit, factor] = UNITS.find(([suffix]) => column.endsWith(suffix)) ?? ["", "", 1];
  return { name: column.slice(0, column.length - suffix.length).replaceAll("_", " "), unit, factor };
}

/** CSS border styles of the dash styles. */
const BORDERS = { solid: "solid", dash: "dashed", dot: "dotted" };

/** A short line sample of a curve, for legends. */
function stroke(colour, dash) {
  const mark = document.createElement("span");
  mark.className = "stroke";
  mark.style.borderTop = `2px ${BORDERS[dash]} ${colour}`;
  return mark;
}

/** A panel on the page: a heading above a plot. */
class Panel {
  constructor(spec) {
    this.spec = spec;
    this.section = document.createElement("section");
    this.section.className = "panel";
    this.section.dataset.panel = spec.key;
    this.heading = document.createElement("h2");
    this.plot = document.createElement("div");
    this.plot.className = "plot";
    this.section.append(this.heading, this.plot);
    /** The curves that are drawn, and the legend of their types: colour, dash style and text. */
    this.curves = [];
    this.kinds = [];
  }

  /** Writes the heading: the title and the legend of the curve types. */
  head(name, kinds) {
    const { spec } = this;
    const unit = spec.unit ? ` (${spec.unit})` : "";
    this.kinds = kinds;
    this.heading.title = spec.about;
    this.heading.replaceChildren(`${name}${spec.hint ? `, ${spec.hint}` : ""}${unit}`);
    for (const [colour, dash, text] of kinds) {
      const kind = document.createElement("small");
      kind.append(stroke(colour, dash), text);
      this.heading.append(kind);
    }
  }
}
