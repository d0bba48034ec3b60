// What the charts show, panel by panel.

/**
 * A panel: its title and unit, what it is in words, the factor from SI units to its own, and its curves. A curve is of
 * the run, of each UAV or of each group: the column that it shows, what tells it from other curves of the same object
 * (`note`), and its dash. Levels are lines from side to side, of which `level` says what they are.
 */
const PANELS = [
  { key: "watched", title: "Vehicles watched", unit: "", factor: 1,
    about: "How many vehicles exist, how many of them have a track, how many are in some UAV's field of view (seen), and how many are " +
      "in one and belong to a group (watched). By the true geometry.",
    curves: [
      { of: "run", column: "targets", note: "exist", dash: "solid", ink: "none" },
      { of: "run", column: "tracked", note: "tracked", dash: "dash", ink: "none" },
      { of: "run", column: "seen", note: "seen", dash: "dot", ink: "ink" },
      { of: "run", column: "watched", note: "watched", dash: "solid", ink: "ink" },
    ], fromZero: true },
  { key: "position_error", title: "Position error", unit: "m", factor: 1,
    about: "How far tracks are from where the vehicles really are: root of the mean square over a group's members, and over all tracks " +
      "of the run. The bound is that of Cramer and Rao, which no unbiased filter goes below; it is drawn where it is defined.",
    curves: [
      { of: "groups", column: "position_error_m", note: "", dash: "solid" },
      { of: "groups", column: "position_bound_m", note: "bound", dash: "dash" },
      { of: "run", column: "position_error_m", note: "all tracks", dash: "dot", ink: "ink" },
    ], fromZero: true },
  { key: "line_of_sight", title: "Line of sight", unit: "\u00b0", factor: DEGREES,
    about: "The largest angle between a UAV's boresight and the true direction to a member of its group. Beyond half the field of view " +
      "a member is out of that UAV's sight.",
    curves: [{ of: "uavs", column: "line_of_sight_rad", note: "", dash: "solid" }],
    levels: (limits) => [limits.field_of_view_rad / 2], level: "half the field of view", fromZero: true },
  { key: "standoff_distance", title: "Standoff distance", unit: "m", factor: 1,
    about: "The desired distance r_d of a group's orbit from its estimated centre, and how far each UAV is from the estimated centre of " +
      "the group that it serves.",
    curves: [
      { of: "groups", column: "standoff_distance_m", note: "r_d", dash: "solid" },
      { of: "uavs", column: "centre_distance_m", note: "to centre", dash: "dot" },
    ],
    levels: (limits) => [limits.radius_min_m, limits.radius_max_m], level: "least and most" },
  { key: "standoff_error", title: "True standoff error", unit: "m", hint: "outside (+), inside (\u2212)", factor: 1,
    about: "How far a UAV is off the orbit that its group should have: r \u2212 r_d about the true centre of the group's members. Above " +
      "zero it is outside the orbit, below zero inside.",
    curves: [{ of: "uavs", column: "standoff_error_m", note: "", dash: "solid" }],
    levels: () => [0], level: "on the orbit" },
  { key: "phase", title: "Phase separation", unit: "\u00b0", factor: DEGREES,
    about: "The angle between UAVs on the same orbit, seen from its centre: of a pair theirs, of more that of neighbours which is " +
      "furthest from what is wanted.",
    curves: [
      { of: "groups", column: "phase_rad", note: "", dash: "solid" },
      { of: "groups", column: "phase_wanted_rad", note: "wanted", dash: "dash" },
    ] },
  { key: "speed", title: "Speed", unit: "m/s", factor: 1,
    about: "Each UAV's airspeed and its limits.",
    curves: [{ of: "uavs", column: "speed_m_s", note: "", dash: "solid" }],
    levels: (limits) => [limits.speed_min_m_s, limits.speed_max_m_s], level: "limits" },
  { key: "turn_rate", title: "Turn rate", unit: "\u00b0/s", factor: DEGREES,
    about: "How fast each UAV's heading changes, anticlockwise above zero, and its limits.",
    curves: [{ of: "uavs", column: "turn_rate_rad_s", note: "", dash: "solid" }],
    levels: (limits) => [-limits.turn_rate_max_rad_s, limits.turn_rate_max_rad_s], level: "limits" },
  { key: "scan_sd", title: "One scan tells to", unit: "m", factor: 1,
    about: "How precisely one scan by each UAV of a group would place a vehicle at the group's true centre, as a standard deviation: " +
      "the fourth root of the inverse determinant of the information.",
    curves: [{ of: "groups", column: "scan_sd_m", note: "", dash: "solid" }], fromZero: true },
];

/** The panel of a target that is looked at. */
const TARGET_PANEL = {
  key: "target", title: "Target", unit: "m", hint: "position error", factor: 1, fromZero: true, curves: [],
  about: "How far the track of the chosen target is from where it really is. Shaded: where it is a member of a group and no UAV has it " +
    "in view, and where its track is coasting (not measured).",
};

/** A curve's dash in CSS. */
const BORDERS = { solid: "solid", dash: "dashed", dot: "dotted" };

/** A short stroke as a curve has it, to stand before its name. */
function stroke(colour, dash) {
  const mark = document.createElement("span");
  mark.className = "stroke";
  mark.style.borderTop = `2px ${BORDERS[dash]} ${colour}`;
  return mark;
}

/** A panel on the page: a heading over a plot. */
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
    /** The curves as they were drawn last. */
    this.curves = [];
  }

  /** The title, and what the kinds of curves are. */
  head(name, kinds) {
    const { spec } = this;
    const unit = spec.unit ? ` (${spec.unit})` : "";
    this.heading.title = spec.about;
    this.heading.replaceChildren(`${name}${spec.hint ? `, ${spec.hint}` : ""}${unit}`);
    for (const [colour, dash, words] of kinds) {
      const kind = document.createElement("small");
      kind.append(stroke(colour, dash), words);
      this.heading.append(kind);
    }
  }
}
