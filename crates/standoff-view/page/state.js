// The state at the time shown, as text and numbers: tables, warnings and the CSV file.

/** Columns of the CSV file of the state; a column is empty for objects that do not have it. */
const CSV_COLUMNS = ["kind", "id", "name", "group", "receiving_group", "x_m", "y_m", "true_x_m", "true_y_m", "heading_rad", "boresight_rad",
  "speed_m_s", "turn_rate_rad_s", "out_since_s", "centre_distance_m", "standoff_error_m", "off_boresight_rad", "avoided_uav", "avoided_intruder",
  "predicted_distance_m", "limiting_zone", "transponder_on", "members", "standoff_distance_m", "feasible", "spread_m", "nearest_groupmate_m", "phase_rad", "position_error_m", "membership", "status",
  "out_of_view", "error_m", "detections", "in_custody", "out_of_view_s", "seen_by"];

/** Formats a value for CSV. A text that a spreadsheet would interpret as a formula gets an apostrophe in front. */
function csvText(value) {
  if (typeof value !== "string") return `${value}`;
  const plain = /^[=+\-@\t\r]/.test(value) ? `'${value}` : value;
  return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

class State {
  constructor(page) {
    this.page = page;
    this.clock = element("clock");
    this.warning = element("warning");
    // If the text is cut off, a click shows all of it.
    this.warning.addEventListener("click", () => this.warning.classList.toggle("whole"));
    /** A line for each run. */
    this.custody = page.runs.map((run) => new CustodyStatus(page, run, (state, target) => this.showTargets(run, state, target)));
    for (const [id, columns] of [["uavs", UAV_COLUMNS], ["groups", GROUP_COLUMNS], ["intruders", INTRUDER_COLUMNS], ["agents", AGENT_COLUMNS]]) {
      headings(element(id), columns);
    }
    this.targetTable = new TargetTable(page);
    for (const id of ["uavs", "groups", "intruders", "targets", "agents"]) {
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
  }

  /** Shows the time; called for every drawn frame. */
  showTime(time_s) {
    this.clock.textContent = time_s.toFixed(1);
    this.clock.dateTime = `PT${time_s.toFixed(3)}S`;
  }

  /** Shows the scenes of all runs: the tables those of the run of the side panel, the header those of all. */
  show(scenes) {
    const { replayData, selection, runs, run } = this.page;
    const scene = scenes[runs.indexOf(run)];
    this.scene = scene;
    const isChosen = (kind) => (one) => selection.isChosen(kind, one.id);
    // The last column shows what UAVs avoid; it is hidden if there is nothing to avoid.
    element("uavs").classList.toggle("no-avoidance", !replayData.head.has_separation && !replayData.head.zones);
    rows(this.uavs, UAV_COLUMNS, scene.uavs, isChosen("uav"));
    rows(this.groups, GROUP_COLUMNS, scene.groups, isChosen("group"));
    element("intruders").hidden = !replayData.ids.intruders.length;
    rows(this.intruders, INTRUDER_COLUMNS, scene.intruders, isChosen("intruder"));
    this.targetTable.show((scene.targets ?? []).filter((target) => selection.passes(target.group)));
    element("agents").hidden = !replayData.agents.isSeveral;
    rows(this.agents, AGENT_COLUMNS, agentRows(replayData, scene), isChosen("uav"));
    this.scrollToRow(selection.object);
    this.custody.forEach((status, k) => status.show(scenes[k]));
    this.warn(scenes);
  }

  /** Shows the targets of a run in a state in the table; selects a target if one is given, and sorts by the time out of view. */
  showTargets(run, state, target) {
    this.page.show(run);
    element("tab-state").click();
    if (target !== undefined) this.targetTable.sort = { key: "out_of_view_s", sign: -1 };
    this.targetTable.filter(state);
    this.targetTable.scrollToTop();
    if (target !== undefined) this.page.selection.choose({ kind: "target", id: target });
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
    if (object?.kind === "target") {
      if (this.targetTable.scrollTo(object.id)) this.scrolledTo = object;
      return;
    }
    const row = object && this[`${object.kind}s`].querySelector("tr.chosen");
    if (object && !row?.offsetParent) return;
    this.scrolledTo = object;
    row?.scrollIntoView({ block: "nearest" });
  }

  /** Collects the warnings that are not about targets. */
  warn(scenes) {
    this.warnings = scenes.flatMap((scene, k) => {
      const run = this.page.runs[k];
      const orbits = scene.groups.filter((group) => !group.feasible).map((group) => `group ${group.id}: no feasible orbit`);
      const warnings = [...scene.uavs.filter((uav) => uav.out).map(outageText), ...agentsText(run.replayData, scene), ...orbits];
      return warnings.map((text) => this.ofRun(text, run));
    });
    this.update();
  }

  /** A text about a run, with its letter if two runs are shown. */
  ofRun(text, run) {
    return this.page.pair ? `${run.letter}: ${text}` : text;
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
      ...of("intruder", intruders), ...of("target", shown.map((target) => ({ ...target, seen_by: target.seenBy().join(" ") })))];
    const cell = (value) => (value === null || value === undefined || Number.isNaN(value) ? "" : csvText(value));
    const lines = all.map((one) => [time_s, ...CSV_COLUMNS.map((column) => one[column])].map(cell).join(","));
    save(`${fileName(`${runName(replayData.head)}-state-${time_s.toFixed(1)}s`)}.csv`,
      `${["time_s", ...CSV_COLUMNS].join(",")}\n${lines.join("\n")}\n`, "text/csv");
  }

  /** Sets the error text of a run, or of the page itself; an empty text clears it. */
  setError(text, run = null) {
    this.errors.set(run, text && run ? this.ofRun(text, run) : text);
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
    this.warning.classList.toggle("critical", this.errorText !== "");
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
      lag_s: replayData.value("agents", "lag_s", id, stepIndex), isLimited: replayData.value("agents", "limited", id, stepIndex) === 1,
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

/** Fills the body of a table, a long one only while it is visible. Existing cells are reused, so that the selection and the focus stay. */
function rows(body, columns, items, isChosen) {
  if (items.length > FEW_ROWS && body.closest("[role=tabpanel]").hidden) return;
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
    markRow(row, item, isChosen(item));
  });
}

/** Marks the row of a selected object, and that of a target out of view or a UAV in an outage. */
function markRow(row, item, chosen) {
  row.cells[0].firstChild.setAttribute("aria-pressed", String(chosen));
  row.classList.toggle("chosen", chosen);
  row.classList.toggle("warning", item.out_of_view === true || Boolean(item.out));
  // A target that is out of view in no group is no alarm.
  row.classList.toggle("mild", item.out_of_view === true && item.group === null);
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

/** A line in the header: targets of a run in custody, out of view, and in the other states. Every part is a button. */
class CustodyStatus {
  /** `choose` is called with the state of a part, and the target that is to be selected. */
  constructor(page, run, choose) {
    Object.assign(this, { page, run });
    this.line = make("div");
    element("custody").append(this.line);
    /** The target that has been out of view for the longest time. */
    this.longest = null;
    const parts = TARGET_STATES.map(([key, , , about]) => [key, about, () => choose(key)]);
    parts.splice(2, 0, ["longest", "Longest time that an existing target has now been in no UAV's view: selects this target", () => choose("out-of-view", this.longest.id)]);
    this.parts = new Map(parts.map(([key, about, act]) => {
      const button = make("button");
      button.type = "button";
      button.title = about;
      button.dataset.part = key;
      button.hidden = true;
      button.addEventListener("click", act);
      this.line.append(button);
      return [key, button];
    }));
  }

  /** Shows the targets of a scene; while they are being loaded, the line is empty. */
  show({ targets }) {
    const texts = targets ? this.texts(targets) : new Map();
    const prefix = this.page.pair ? `Run ${this.run.letter}: ` : "";
    for (const [key, button] of this.parts) {
      const text = texts.get(key) ?? "";
      const whole = key === "in-custody" && text ? `${prefix}${text}` : text;
      button.hidden = !text;
      if (button.textContent !== whole) button.textContent = whole;
    }
    this.line.classList.toggle("alarm", texts.has("out-of-view") && targets.some((target) => target.out_of_view));
  }

  /** The texts of the parts, by state; states without targets have no text. */
  texts(targets) {
    const existing = targets.filter((target) => target.exists);
    const isKnown = existing.some((target) => target.is_view_known);
    const out = existing.filter((target) => target.out_of_view);
    this.longest = out.reduce((longest, target) => (longest?.out_of_view_s >= target.out_of_view_s ? longest : target), null);
    const texts = new Map();
    for (const [key, text, condition] of TARGET_STATES) {
      const count = targets.filter(condition).length;
      if (count) texts.set(key, `${count} ${text}`);
    }
    // Without a team state, no target is in custody of a group that is shown.
    const hasTeamState = existing.every((target) => target.hasTeamState !== false);
    const inCustody = existing.filter((target) => target.in_custody).length;
    // In the record of a flight, true positions are unknown: there are only tracks.
    const [counted, noun] = existing.length || !targets.length ? [existing.length, "target"] : [targets.length, "track"];
    const count = counted === 1 ? `1 ${noun}` : `${counted || "no"} ${noun}s`;
    texts.set("in-custody", existing.length && isKnown && hasTeamState ? `In custody ${inCustody} of ${existing.length}` : count);
    if (isKnown && !out.length) texts.set("out-of-view", "none out of view");
    if (this.longest) texts.set("longest", `longest ${durationText(this.longest.out_of_view_s)}`);
    return texts;
  }
}

/** A duration with at most one decimal. */
function durationText(duration_s) {
  return `${duration_s.toFixed(duration_s < 9.95 ? 1 : 0)} s`;
}
