// The state at the time shown, as text and numbers: tables, warnings and the CSV file.

/** Maximum number of targets in the table; targets with warnings come first. */
const MAX_ROWS = 100;

/** Columns of the CSV file of the state; a column is empty for objects that do not have it. */
const CSV_COLUMNS = ["kind", "id", "name", "group", "receiving_group", "x_m", "y_m", "true_x_m", "true_y_m", "heading_rad", "boresight_rad",
  "speed_m_s", "turn_rate_rad_s", "out_since_s", "centre_distance_m", "standoff_error_m", "off_boresight_rad", "avoided_uav", "avoided_intruder",
  "predicted_distance_m", "limiting_zone", "transponder_on", "members", "standoff_distance_m", "feasible", "spread_m", "nearest_groupmate_m", "phase_rad", "position_error_m", "membership", "status",
  "out_of_view", "error_m", "detections"];

/** Formats a value for CSV. A text that a spreadsheet would interpret as a formula gets an apostrophe in front. */
function csvText(value) {
  if (typeof value !== "string") return `${value}`;
  const plain = /^[=+\-@\t\r]/.test(value) ? `'${value}` : value;
  return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

/** Warnings about targets, most severe first. */
const WARNINGS = ["out of view", "coasting", "in handoff", "untracked", "ungrouped", "removed"];

class State {
  constructor(page) {
    this.page = page;
    this.clock = element("clock");
    this.warning = element("warning");
    // If the text is cut off, a click shows all of it.
    this.warning.addEventListener("click", () => this.warning.classList.toggle("whole"));
    this.more = element("more-targets");
    for (const [id, columns] of [["uavs", UAV_COLUMNS], ["groups", GROUP_COLUMNS], ["intruders", INTRUDER_COLUMNS], ["targets", TARGET_COLUMNS], ["agents", AGENT_COLUMNS]]) {
      headings(element(id), columns);
      this[id] = element(id).tBodies[0];
      this[id].addEventListener("click", (click) => this.clicked(id, click.target.closest("tr")));
    }
    /** The selected object whose row was scrolled into view last. */
    this.scrolledTo = null;
    element("state-csv").addEventListener("click", () => this.saveCsv());
    this.shownText = null;
    /** Error texts by run; the key `null` is for the page itself. */
    this.errors = new Map();
    this.missing = [];
    this.warnings = [];
    this.critical = false;
  }

  /** Shows the time; called for every drawn frame. */
  showTime(time_s) {
    this.clock.textContent = time_s.toFixed(1);
    this.clock.dateTime = `PT${time_s.toFixed(3)}S`;
  }

  show(scene) {
    const { replayData, selection } = this.page;
    this.scene = scene;
    const targets = (scene.targets ?? []).map((target) => ({ ...target, name: targetName(replayData, target.id) }));
    const worst = targets.filter((target) => warningOf(target));
    const shown = targets.filter((target) => selection.passes(target.group));
    // The selected target comes first, then targets with warnings.
    const rank = (target) => (selection.isChosen("target", target.id) ? 0 : warningOf(target) ? 1 : 2);
    const listed = [0, 1, 2].flatMap((level) => shown.filter((target) => rank(target) === level)).slice(0, MAX_ROWS);
    const isChosen = (kind) => (one) => selection.isChosen(kind, one.id);
    // The last column shows what UAVs avoid; it is hidden if there is nothing to avoid.
    element("uavs").classList.toggle("no-avoidance", !replayData.head.has_separation && !replayData.head.zones);
    rows(this.uavs, UAV_COLUMNS, scene.uavs, isChosen("uav"));
    rows(this.groups, GROUP_COLUMNS, scene.groups, isChosen("group"));
    element("intruders").hidden = !replayData.ids.intruders.length;
    rows(this.intruders, INTRUDER_COLUMNS, scene.intruders, isChosen("intruder"));
    rows(this.targets, TARGET_COLUMNS, listed, isChosen("target"));
    element("agents").hidden = !replayData.agents.isSeveral;
    rows(this.agents, AGENT_COLUMNS, agentRows(replayData, scene), isChosen("uav"));
    this.more.textContent = shown.length > listed.length ? `and ${shown.length - listed.length} more` : "";
    this.scrollToRow(selection.object);
    this.warn(scene, worst);
  }

  /** Selects the object of a row, or clears the selection if the object is already selected. */
  clicked(table, row) {
    const { selection } = this.page;
    const kind = table === "agents" ? "uav" : table.slice(0, -1);
    const object = row && { kind, id: Number(row.dataset.id) };
    if (object) selection.choose(selection.isChosen(object.kind, object.id) ? null : object);
  }

  /** Scrolls to the row of a newly selected object, once the table is visible. */
  scrollToRow(object) {
    if (objectKey(object) === objectKey(this.scrolledTo)) return;
    const row = object && this[`${object.kind}s`].querySelector("tr.chosen");
    if (object && !row?.offsetParent) return;
    this.scrolledTo = object;
    row?.scrollIntoView({ block: "nearest" });
  }

  /** Collects the warnings shown above the map. */
  warn(scene, worst) {
    const kinds = new Map();
    for (const target of worst) kinds.set(warningOf(target), [...(kinds.get(warningOf(target)) ?? []), target.name]);
    // The most severe warnings come first, because the space may not suffice for all.
    const warnings = scene.uavs.filter((uav) => uav.out).map(outageText);
    warnings.push(...agentsText(this.page.replayData, scene));
    for (const group of scene.groups) if (!group.feasible) warnings.push(`group ${group.id}: no feasible orbit`);
    for (const [what, names] of [...kinds].sort(([a], [b]) => WARNINGS.indexOf(a) - WARNINGS.indexOf(b))) {
      const some = names.slice(0, 3).join(", ");
      warnings.push(`${names.length} ${what}: ${some}${names.length > 3 ? ", ..." : ""}`);
    }
    this.warnings = warnings;
    this.critical = kinds.has("out of view");
    this.update();
  }

  /** Saves the current time step as CSV: UAVs, groups, intruders and targets, in SI units. */
  saveCsv() {
    const { replayData, selection } = this.page;
    if (!this.scene) return;
    // The values of the time step, without interpolation.
    const { time_s, uavs, groups, intruders, targets } = this.page.run.scene(replayData.times_s[replayData.stepAt(this.scene.time_s)]);
    const shown = (targets ?? []).filter((target) => selection.passes(target.group));
    const of = (kind, some) => some.map((one) => ({ ...one, kind, name: wholeName(replayData, { kind, id: one.id }) }));
    const all = [...of("uav", uavs.map((uav) => ({ ...uav, out_since_s: uav.out?.since_s }))), ...of("group", groups),
      ...of("intruder", intruders), ...of("target", shown)];
    const cell = (value) => (value === null || value === undefined || Number.isNaN(value) ? "" : csvText(value));
    const lines = all.map((one) => [time_s, ...CSV_COLUMNS.map((column) => one[column])].map(cell).join(","));
    save(`${fileName(`${runName(replayData.head)}-state-${time_s.toFixed(1)}s`)}.csv`,
      `${["time_s", ...CSV_COLUMNS].join(",")}\n${lines.join("\n")}\n`, "text/csv");
  }

  /** Sets the error text of a run, or of the page itself; an empty text clears it. */
  setError(text, run = null) {
    this.errors.set(run, text && this.page.pair && run ? `${run.letter}: ${text}` : text);
    this.update();
  }

  get errorText() {
    return [...this.errors.values()].filter(Boolean).join(" \u00b7 ");
  }

  /** Sets the texts about data that is not loaded yet. */
  setMissing(texts) {
    this.missing = texts;
    this.update();
  }

  /** Shows errors, missing data and warnings in the header. */
  update() {
    const text = [this.errorText, ...this.missing, ...this.warnings].filter(Boolean).join(" \u00b7 ");
    this.warning.classList.toggle("critical", this.critical || this.errorText !== "");
    if (text === this.shownText) return;
    this.shownText = text;
    this.warning.textContent = this.warning.title = text;
  }
}

/** Rows of the table of agents at the time shown. */
function agentRows(replayData, scene) {
  const { agents } = replayData;
  const stepIndex = replayData.stepAt(scene.time_s);
  const agreeingSets = agents.agreeingSets(stepIndex);
  return agents.ids.map((id) => {
    const isOn = agents.isOn(id, stepIndex);
    const set = agreeingSets.find((some) => some.includes(id)) ?? [];
    const others = set.filter((uav) => uav !== id);
    const agrees = !isOn ? "" : others.length ? `UAV ${others.join(", ")}` : "none";
    return {
      id, isOn, notReceived: isOn && notReceivedText(replayData, id, stepIndex), assignments: isOn ? assignmentsText(replayData, id, stepIndex) : "", agrees,
      lag_s: replayData.value("agents", "lag_s", id, stepIndex),
    };
  });
}

/** Warnings about agents: the shown team state if it is not the default, silent UAVs, and different assignments. */
function agentsText(replayData, scene) {
  const { agents } = replayData;
  if (!agents.isSeveral) return [];
  const stepIndex = replayData.stepAt(scene.time_s);
  const owner = agents.owner(stepIndex);
  const silent = scene.uavs.filter((uav) => uav.agentState.isNotReceived && !uav.out);
  const shownState = owner === null || agents.chosen !== null ? [teamStateText(replayData, stepIndex)] : [];
  const names = silent.map(({ id, agentState }) => `UAV ${id} (${agentState.shown.status})`).join(", ");
  const notReceived = silent.length ? [`UAV ${owner} receives no reports from ${names}`] : [];
  return [...shownState, ...notReceived, disagreementText(replayData, stepIndex)].filter(Boolean);
}

/** Fills the body of a table. Existing cells are reused, so that the selection and the focus stay. */
function rows(body, columns, items, isChosen) {
  while (body.rows.length > items.length) body.deleteRow(-1);
  items.forEach((item, index) => {
    const row = body.rows[index] ?? body.insertRow();
    row.dataset.id = item.id;
    columns.forEach(([key, , textOf], column) => {
      const cell = row.cells[column] ?? row.insertCell();
      // The first cell is a button, so that rows can be selected with the keyboard.
      if (column === 0 && !cell.firstChild) {
        const button = make("button");
        button.type = "button";
        cell.append(button);
      }
      const text = textOf(item);
      const label = column === 0 ? cell.firstChild : cell;
      if (label.textContent !== text) label.textContent = text;
      if (cell.dataset.field !== key) cell.dataset.field = key;
    });
    const chosen = isChosen(item);
    row.cells[0].firstChild.setAttribute("aria-pressed", String(chosen));
    row.classList.toggle("chosen", chosen);
    row.classList.toggle("warning", item.out_of_view === true || Boolean(item.out));
  });
}

/** Writes the column headings of a table. */
function headings(table, columns) {
  const row = table.createTHead().insertRow();
  for (const [, heading, , about] of columns) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = heading;
    cell.title = about;
    row.append(cell);
  }
}
