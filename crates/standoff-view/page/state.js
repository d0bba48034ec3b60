// The state in words and numbers: what the map shows, for those who read or test it. Values are those of the instant that
// is on, not between two.

/** Most targets that the table lists: those to be worried about come first. */
const MOST_ROWS = 100;

const DEGREES = 180 / Math.PI;

/** Columns: key, heading, value in words. */
const UAV_COLUMNS = [
  ["id", "UAV", (uav) => `${uav.id}`],
  ["group", "Group", (uav) => (uav.group === null ? "none" : `${uav.group}`)],
  ["x_m", "East (m)", (uav) => fixed(uav.now_x_m, 1)],
  ["y_m", "North (m)", (uav) => fixed(uav.now_y_m, 1)],
  ["speed_m_s", "Speed (m/s)", (uav) => fixed(uav.speed_m_s, 2) + (uav.speed_limited ? " limit" : "")],
  ["turn_rate_deg_s", "Turn rate (\u00b0/s)", (uav) =>
    fixed(uav.turn_rate_rad_s * DEGREES, 2) + (uav.turn_rate_limited ? " limit" : "")],
  ["centre_distance_m", "To centre (m)", (uav) => fixed(uav.centre_distance_m, 1)],
  ["standoff_error_m", "Off the orbit (m)", (uav) => fixed(uav.standoff_error_m, 1)],
  ["line_of_sight_deg", "Line of sight (\u00b0)", (uav) => fixed(uav.line_of_sight_rad * DEGREES, 1)],
];

const GROUP_COLUMNS = [
  ["id", "Group", (group) => `${group.id}`],
  ["members", "Members", (group) => fixed(group.members, 0)],
  ["standoff_distance_m", "Orbit (m)", (group) => fixed(group.shown_distance_m, 1) + (group.feasible ? "" : " not feasible")],
  ["spread_m", "Spread (m)", (group) => fixed(group.spread_m, 1)],
  ["phase_deg", "Phase (\u00b0)", (group) => fixed(group.phase_rad * DEGREES, 1)],
  ["separation_m", "Separation (m)", (group) => fixed(group.separation_m, 0)],
  ["position_error_m", "Position error (m)", (group) => fixed(group.position_error_m, 2)],
];

const TARGET_COLUMNS = [
  ["name", "Target", (target) => target.name],
  ["state", "State", (target) => [target.place, target.status].filter(Boolean).join(", ") || "no track"],
  ["concern", "To note", (target) => concern(target)],
  ["group", "Group", (target) =>
    target.group === null ? "none" : target.to_group === null ? `${target.group}` : `${target.group} to ${target.to_group}`],
  ["error_m", "Position error (m)", (target) => fixed(target.error_m, 2)],
  ["detections", "Seen by", (target) => `${target.detections}`],
];

/** A number in words; a dash for none. */
function fixed(value, digits) {
  if (value === undefined || Number.isNaN(value)) return "\u2013";
  return value.toFixed(digits).replace("-", "\u2212");
}

class State {
  constructor(page) {
    this.page = page;
    this.clock = element("clock");
    this.warning = element("warning");
    this.more = element("more");
    for (const [id, columns] of [["uavs", UAV_COLUMNS], ["groups", GROUP_COLUMNS], ["targets", TARGET_COLUMNS]]) {
      headings(element(id), columns);
      this[id] = element(id).tBodies[0];
    }
    this.said = null;
    this.troubled = "";
    this.lacking = [];
    this.told = [];
    this.grave = false;
  }

  show(scene) {
    const { film } = this.page;
    const instant = film.instant(scene.time_s);
    this.clock.textContent = `${scene.time_s.toFixed(1)} s`;
    this.clock.dateTime = `PT${scene.time_s.toFixed(3)}S`;
    const uavs = scene.uavs.map((uav) => ({
      ...uav,
      now_x_m: film.value("uavs", "x_m", uav.id, instant),
      now_y_m: film.value("uavs", "y_m", uav.id, instant),
    }));
    const targets = (scene.targets ?? []).map((target) => ({
      ...target,
      name: short(film.head.targets[target.id] ?? `${target.id}`),
    }));
    const worst = targets.filter((target) => concern(target));
    const listed = [...worst, ...targets.filter((target) => !concern(target))].slice(0, MOST_ROWS);
    rows(this.uavs, UAV_COLUMNS, uavs);
    rows(this.groups, GROUP_COLUMNS, scene.groups);
    rows(this.targets, TARGET_COLUMNS, listed);
    this.more.textContent = targets.length > listed.length ? `and ${targets.length - listed.length} more` : "";
    this.warn(scene, worst);
  }

  /** What nobody should miss, over the map. */
  warn(scene, worst) {
    const kinds = new Map();
    for (const target of worst) kinds.set(concern(target), [...(kinds.get(concern(target)) ?? []), target.name]);
    const told = [...kinds].map(([what, names]) => {
      const some = names.slice(0, 3).join(", ");
      return `${names.length} ${what}: ${some}${names.length > 3 ? ", ..." : ""}`;
    });
    for (const group of scene.groups) if (!group.feasible) told.push(`group ${group.id}: no feasible orbit`);
    this.told = told;
    this.grave = kinds.has("out of view");
    this.say();
  }

  /** That something is wrong with the page itself; nothing, once it is well again. */
  trouble(words) {
    this.troubled = words;
    this.say();
  }

  /** What is missing in the picture, in words. */
  lacks(words) {
    this.lacking = words;
    this.say();
  }

  say() {
    const text = [this.troubled, ...this.lacking, ...this.told].filter(Boolean).join(" \u00b7 ");
    this.warning.classList.toggle("grave", this.grave || this.troubled !== "");
    if (text === this.said) return;
    this.said = text;
    this.warning.textContent = text;
  }
}

/** Fills a table's body, in place where it can, so that what is selected or focused stays. */
function rows(body, columns, items) {
  while (body.rows.length > items.length) body.deleteRow(-1);
  items.forEach((item, index) => {
    const row = body.rows[index] ?? body.insertRow();
    row.dataset.id = item.id;
    columns.forEach(([key, , words], place) => {
      const cell = row.cells[place] ?? row.insertCell();
      const text = words(item);
      if (cell.textContent !== text) cell.textContent = text;
      if (cell.dataset.field !== key) cell.dataset.field = key;
    });
    row.classList.toggle("concern", item.out_of_view === true);
  });
}

/** Writes the headings of a table. */
function headings(table, columns) {
  const row = table.createTHead().insertRow();
  for (const [, heading] of columns) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = heading;
    row.append(cell);
  }
}
