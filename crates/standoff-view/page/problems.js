// Problems of a run that has ended: alarms by kind and cause, the times in which each target was out of view, and the log of all alarms.

/** Maximum numbers of rows; files contain the others. */
const MAX_GAP_ROWS = 200;
const MAX_ALARMS = 500;

/** Descriptions of the states of a target when it leaves all views. */
const GAP_CAUSES = { "no-track": "no track", removed: "removed from its group", "no-group": "in no group", member: "member of a group" };

class Problems {
  constructor(page) {
    this.page = page;
    element("alarms-csv").addEventListener("click", () => this.saveAlarms());
    element("gaps-csv").addEventListener("click", () => this.saveGaps());
  }

  get head() {
    return this.page.replayData.head;
  }

  name(target) {
    return targetName(this.page.replayData, target);
  }

  /** Shows the problems of the selected run, if it has ended. */
  show() {
    const { head } = this;
    const isOver = head.outcome.length > 0;
    const left = head.problems_left_out ? `; the ${formatCount(head.problems_left_out)} shortest are only in alarms.csv and gaps.csv` : "";
    const count = (all, one, several) => `${formatCount(all.length)} ${all.length === 1 ? one : several}`;
    const text = `${count(head.alarms, "alarm", "alarms")}, ${count(head.gaps, "time out of view", "times out of view")}${left}`;
    element("problem-count").textContent = isOver ? text : "Problems are listed when the run has ended.";
    this.showKinds();
    this.showGaps();
    this.showAlarms();
  }

  /** The target, UAV and group of an alarm. */
  subject({ target, uav, group }) {
    const parts = [target === undefined ? "" : this.name(target), uav === undefined ? "" : `UAV ${uav}`, group === undefined ? "" : `group ${group}`];
    return parts.filter((part) => part).join(", ");
  }

  /** Shows the time at which a problem begins, and selects its object. */
  goTo({ begin_us, target, uav, group }) {
    const { clock, selection } = this.page;
    const objects = [["target", target], ["uav", uav], ["group", group]];
    const [kind, id] = objects.find(([, id]) => id !== undefined && id !== null) ?? [];
    if (kind) selection.choose({ kind, id });
    clock.seek(begin_us / 1e6);
  }

  /** Creates a cell with a button that goes to a problem. */
  cell(row, text, problem) {
    const button = make("button", "clipped");
    button.type = "button";
    writeName(button, text);
    button.addEventListener("click", () => this.goTo(problem));
    row.insertCell().append(button);
  }

  /** Shows the alarms by kind and cause. */
  showKinds() {
    const { problems } = this.head;
    const table = element("problem-kinds");
    table.hidden = !problems.length;
    this.fill(table, problems, (row, { times, total_us, longest }) => {
      this.cell(row, longest.kind, longest);
      for (const text of [String(times), fixed(total_us / 1e6, 1), fixed(lasts_s(longest), 1)]) row.insertCell().textContent = text;
      writeName(row.insertCell(), `${this.subject(longest)}: ${longest.reason}`);
    });
  }

  /** Shows a bar for each time out of view, in a row per target: those that are out of view for the longest total time come first. */
  showGaps() {
    const { head } = this;
    const ofTargets = new Map();
    for (const gap of head.gaps) ofTargets.set(gap.target, [...(ofTargets.get(gap.target) ?? []), gap]);
    const out_s = (gaps) => gaps.reduce((sum, gap) => sum + gap.steps * head.period_s, 0);
    const rows = [...ofTargets].map(([target, gaps]) => ({ target, gaps, out_s: out_s(gaps) })).sort((a, b) => b.out_s - a.out_s);
    const table = element("gap-timeline");
    table.hidden = !rows.length;
    const more = rows.length > MAX_GAP_ROWS ? ` (${MAX_GAP_ROWS} of ${formatCount(rows.length)} targets)` : "";
    table.caption.textContent = `Times out of view of all UAVs${more}`;
    this.fill(table, rows.slice(0, MAX_GAP_ROWS), (row, { target, gaps, out_s }) => {
      const longest = gaps.reduce((longest, gap) => (gap.steps > longest.steps ? gap : longest));
      this.cell(row, this.name(target), longest);
      row.insertCell().textContent = fixed(out_s, 1);
      const track = make("div", "gaps");
      track.append(...gaps.map((gap) => this.bar(gap)));
      row.insertCell().append(track);
    });
  }

  /** Creates the bar of a time out of view. */
  bar(gap) {
    const { head } = this;
    const bar = make("button", "gap");
    const percent = (time_us) => (100 * time_us) / 1e6 / head.duration_s;
    bar.type = "button";
    bar.dataset.cause = gap.cause;
    bar.style.left = `${percent(gap.begin_us)}%`;
    bar.style.width = `${percent(gap.end_us - gap.begin_us)}%`;
    const place = `${fixed(gap.x_m, 0)} m east, ${fixed(gap.y_m, 0)} m north`;
    bar.title = `${fixed(gap.begin_us / 1e6, 1)} to ${fixed(gap.end_us / 1e6, 1)} s: ${GAP_CAUSES[gap.cause]}, at ${place}`;
    bar.setAttribute("aria-label", `${this.name(gap.target)} out of view, ${bar.title}`);
    bar.addEventListener("click", () => this.goTo(gap));
    return bar;
  }

  showAlarms() {
    const { alarms } = this.head;
    const table = element("alarm-log");
    table.hidden = !alarms.length;
    const more = alarms.length > MAX_ALARMS ? ` (the first ${MAX_ALARMS} of ${formatCount(alarms.length)})` : "";
    table.caption.textContent = `Alarms${more}`;
    this.fill(table, alarms.slice(0, MAX_ALARMS), (row, alarm) => {
      this.cell(row, alarm.kind, alarm);
      for (const text of [fixed(alarm.begin_us / 1e6, 1), fixed(lasts_s(alarm), 1)]) row.insertCell().textContent = text;
      writeName(row.insertCell(), `${this.subject(alarm)}: ${alarm.reason}`);
    });
  }

  fill(table, items, write) {
    const body = table.tBodies[0];
    body.replaceChildren();
    for (const item of items) write(body.insertRow(), item);
  }

  saveAlarms() {
    const row = (alarm) => [alarm.kind, alarm.cause ?? "", alarm.target === undefined ? "" : this.name(alarm.target), alarm.group ?? "", alarm.uav ?? "",
      alarm.begin_us / 1e6, alarm.end_us / 1e6, lasts_s(alarm), alarm.reason, ...this.utc(alarm)];
    const columns = ["kind", "cause", "target", "group", "uav", "begin_s", "end_s", "duration_s", "reason", ...this.utcColumns()];
    this.saveRows("alarms", columns, row);
  }

  saveGaps() {
    const { period_s, origin } = this.head;
    const row = (gap) => [this.name(gap.target), gap.begin_us / 1e6, gap.end_us / 1e6, gap.steps * period_s, gap.x_m, gap.y_m, GAP_CAUSES[gap.cause],
      ...this.utc(gap), ...(origin ? geographic(origin, gap.x_m, gap.y_m) : [])];
    const place = origin ? ["latitude_deg", "longitude_deg"] : [];
    this.saveRows("gaps", ["target", "begin_s", "end_s", "duration_s", "x_m", "y_m", "cause", ...this.utcColumns(), ...place], row);
  }

  utcColumns() {
    return this.head.begin_unix_us === undefined ? [] : ["begin_utc", "end_utc"];
  }

  /** Begin and end of a problem in UTC, if the start of the mission is known. */
  utc({ begin_us, end_us }) {
    const { begin_unix_us } = this.head;
    return begin_unix_us === undefined ? [] : [begin_us, end_us].map((time_us) => new Date((begin_unix_us + time_us) / 1000).toISOString());
  }

  /** Saves the alarms or gaps as a CSV file with the columns of those of a record. */
  saveRows(kind, columns, row) {
    const lines = [columns, ...this.head[kind].map(row)].map((values) => values.map(csvText).join(","));
    save(`${fileName(`${runName(this.head)}-${kind}`)}.csv`, `${lines.join("\n")}\n`, "text/csv");
  }
}

/** Duration of an alarm, s. */
function lasts_s({ begin_us, end_us }) {
  return (end_us - begin_us) / 1e6;
}
