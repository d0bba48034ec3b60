// The state in words and numbers: what the map shows, for those who read or test it.

/** Most targets that the table lists: those to be worried about come first. */
const MOST_ROWS = 100;

/** What a file of the state has of each object, as far as it has it. */
const CSV_COLUMNS = ["kind", "id", "name", "group", "to_group", "x_m", "y_m", "true_x_m", "true_y_m", "heading_rad", "boresight_rad",
  "speed_m_s", "turn_rate_rad_s", "out_since_s", "centre_distance_m", "standoff_error_m", "line_of_sight_rad", "avoids", "avoids_intruder",
  "foretold_m", "border", "told", "members", "standoff_distance_m", "feasible", "spread_m", "separation_m", "phase_rad", "position_error_m", "place", "status",
  "out_of_view", "error_m", "detections"];

/** A value as CSV has it. A text that a spreadsheet would take for a formula begins with an apostrophe. */
function csvText(value) {
  if (typeof value !== "string") return `${value}`;
  const plain = /^[=+\-@\t\r]/.test(value) ? `'${value}` : value;
  return /[",\n\r]/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

/** What targets may be, the gravest first. */
const CONCERNS = ["out of view", "coasting", "in dwell", "untracked", "unassigned", "discarded"];

class State {
  constructor(page) {
    this.page = page;
    this.clock = element("clock");
    this.warning = element("warning");
    // Where it is cut off, a tap shows all of it.
    this.warning.addEventListener("click", () => this.warning.classList.toggle("whole"));
    this.more = element("more");
    for (const [id, columns] of [["uavs", UAV_COLUMNS], ["groups", GROUP_COLUMNS], ["intruders", INTRUDER_COLUMNS], ["targets", TARGET_COLUMNS], ["minds", MIND_COLUMNS]]) {
      headings(element(id), columns);
      this[id] = element(id).tBodies[0];
      this[id].addEventListener("click", (click) => this.clicked(id, click.target.closest("tr")));
    }
    /** What was chosen when it was shown last. */
    this.brought = null;
    element("state-csv").addEventListener("click", () => this.saveCsv());
    this.said = null;
    /** By run, or of the page itself: what is wrong. */
    this.troubles = new Map();
    this.lacking = [];
    this.told = [];
    this.grave = false;
  }

  /** Tells the time, with every picture. */
  tell(time_s) {
    this.clock.textContent = time_s.toFixed(1);
    this.clock.dateTime = `PT${time_s.toFixed(3)}S`;
  }

  show(scene) {
    const { film, choice } = this.page;
    this.scene = scene;
    const targets = (scene.targets ?? []).map((target) => ({ ...target, name: targetName(film, target.id) }));
    const worst = targets.filter((target) => concern(target));
    const shown = targets.filter((target) => choice.passes(target.group));
    // What is chosen comes first, then what is to note.
    const rank = (target) => (choice.isChosen("target", target.id) ? 0 : concern(target) ? 1 : 2);
    const listed = [0, 1, 2].flatMap((wanted) => shown.filter((target) => rank(target) === wanted)).slice(0, MOST_ROWS);
    const isChosen = (kind) => (one) => choice.isChosen(kind, one.id);
    // Its last column is for what UAVs keep off.
    element("uavs").classList.toggle("free", !film.head.keeps_apart && !film.head.zones);
    rows(this.uavs, UAV_COLUMNS, scene.uavs, isChosen("uav"));
    rows(this.groups, GROUP_COLUMNS, scene.groups, isChosen("group"));
    element("intruders").hidden = !film.ids.intruders.length;
    rows(this.intruders, INTRUDER_COLUMNS, scene.intruders, isChosen("intruder"));
    rows(this.targets, TARGET_COLUMNS, listed, isChosen("target"));
    element("minds").hidden = !film.minds.isSeveral;
    rows(this.minds, MIND_COLUMNS, mindRows(film, scene), isChosen("uav"));
    this.more.textContent = shown.length > listed.length ? `and ${shown.length - listed.length} more` : "";
    this.bring(choice.object);
    this.warn(scene, worst);
  }

  /** A row chooses its object, or lets it go. */
  clicked(table, row) {
    const { choice } = this.page;
    const kind = table === "minds" ? "uav" : table.slice(0, -1);
    const object = row && { kind, id: Number(row.dataset.id) };
    if (object) choice.choose(choice.isChosen(object.kind, object.id) ? null : object);
  }

  /** Scrolls to the row of what has just been chosen, once that can be seen. */
  bring(object) {
    if (objectWord(object) === objectWord(this.brought)) return;
    const row = object && this[`${object.kind}s`].querySelector("tr.chosen");
    if (object && !row?.offsetParent) return;
    this.brought = object;
    row?.scrollIntoView({ block: "nearest" });
  }

  /** What nobody should miss, over the map. */
  warn(scene, worst) {
    const kinds = new Map();
    for (const target of worst) kinds.set(concern(target), [...(kinds.get(concern(target)) ?? []), target.name]);
    // What is worst comes first: there may be no room for all.
    const told = scene.uavs.filter((uav) => uav.out).map(outWords);
    told.push(...mindsWords(this.page.film, scene));
    for (const group of scene.groups) if (!group.feasible) told.push(`group ${group.id}: no feasible orbit`);
    for (const [what, names] of [...kinds].sort(([a], [b]) => CONCERNS.indexOf(a) - CONCERNS.indexOf(b))) {
      const some = names.slice(0, 3).join(", ");
      told.push(`${names.length} ${what}: ${some}${names.length > 3 ? ", ..." : ""}`);
    }
    this.told = told;
    this.grave = kinds.has("out of view");
    this.say();
  }

  /** The instant shown as a table: UAVs, groups, intruders and targets below one another, in SI units. */
  saveCsv() {
    const { film, choice } = this.page;
    if (!this.scene) return;
    // Of the instant that is on, not between two.
    const { time_s, uavs, groups, intruders, targets } = this.page.run.scene(film.times_s[film.instant(this.scene.time_s)]);
    const shown = (targets ?? []).filter((target) => choice.passes(target.group));
    const of = (kind, some) => some.map((one) => ({ ...one, kind, name: wholeName(film, { kind, id: one.id }) }));
    const all = [...of("uav", uavs.map((uav) => ({ ...uav, out_since_s: uav.out?.since_s }))), ...of("group", groups),
      ...of("intruder", intruders), ...of("target", shown)];
    const cell = (value) => (value === null || value === undefined || Number.isNaN(value) ? "" : csvText(value));
    const lines = all.map((one) => [time_s, ...CSV_COLUMNS.map((column) => one[column])].map(cell).join(","));
    save(`${fileName(`${runName(film.head)}-state-${time_s.toFixed(1)}s`)}.csv`,
      `${["time_s", ...CSV_COLUMNS].join(",")}\n${lines.join("\n")}\n`, "text/csv");
  }

  /** That something is wrong with the page itself, or with a run of it; nothing, once it is well again. */
  trouble(words, run = null) {
    this.troubles.set(run, words && this.page.pair && run ? `${run.letter}: ${words}` : words);
    this.say();
  }

  get troubled() {
    return [...this.troubles.values()].filter(Boolean).join(" \u00b7 ");
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
    this.warning.textContent = this.warning.title = text;
  }
}

/** Every mind at the time shown. */
function mindRows(film, scene) {
  const { minds } = film;
  const instant = film.instant(scene.time_s);
  const parties = minds.parties(instant);
  return minds.ids.map((id) => {
    const is_on = minds.isOn(id, instant);
    const party = parties.find((some) => some.includes(id)) ?? [];
    const others = party.filter((uav) => uav !== id);
    const agrees = !is_on ? "" : others.length ? `UAV ${others.join(", ")}` : "nobody";
    const unheard = is_on && hearsWords(film, id, instant);
    return {
      id, is_on, unheard: unheard === "all" ? "none: it hears all" : unheard, crews: is_on ? crewsWords(film, id, instant) : "", agrees,
      lag_s: film.value("minds", "lag_s", id, instant),
    };
  });
}

/** What nobody should miss of minds: whose picture is shown if another was chosen, who is silent for it, and that they differ. */
function mindsWords(film, scene) {
  const { minds } = film;
  if (!minds.isSeveral) return [];
  const instant = film.instant(scene.time_s);
  const owner = minds.owner(instant);
  const silent = scene.uavs.filter((uav) => uav.mind.is_unheard && !uav.out);
  const whose = owner === null || minds.chosen !== null ? [pictureWords(film, instant)] : [];
  const unheard = silent.length ? [`for UAV ${owner}: ${silent.map(({ id, mind }) => `UAV ${id} ${mind.shown.presence}`).join(", ")}`] : [];
  return [...whose, ...unheard, differWords(film, instant)].filter(Boolean);
}

/** Fills a table's body, in place where it can, so that what is selected or focused stays. */
function rows(body, columns, items, isChosen) {
  while (body.rows.length > items.length) body.deleteRow(-1);
  items.forEach((item, index) => {
    const row = body.rows[index] ?? body.insertRow();
    row.dataset.id = item.id;
    columns.forEach(([key, , words], place) => {
      const cell = row.cells[place] ?? row.insertCell();
      // The first cell is a button: a row can be chosen with the keyboard, too.
      if (place === 0 && !cell.firstChild) {
        const button = make("button");
        button.type = "button";
        cell.append(button);
      }
      const text = words(item);
      const written = place === 0 ? cell.firstChild : cell;
      if (written.textContent !== text) written.textContent = text;
      if (cell.dataset.field !== key) cell.dataset.field = key;
    });
    const chosen = isChosen(item);
    row.cells[0].firstChild.setAttribute("aria-pressed", String(chosen));
    row.classList.toggle("chosen", chosen);
    row.classList.toggle("concern", item.out_of_view === true || Boolean(item.out));
  });
}

/** Writes the headings of a table. */
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
