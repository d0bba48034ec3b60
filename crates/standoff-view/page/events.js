// Events: the filter and the list. Only the visible rows of the list are in the document.

/** Routine events: they are listed only if the user selects them, and are not drawn in the event strip. */
const ROUTINE = new Set(["cued", "acquired", "orbit-feasible", "orbit-unblocked", "proximity-cleared", "group-created", "admitted"]);
/** Critical events: they cost custody, or may cost it. */
const CRITICAL = new Set(["lost", "removed", "uav-timeout", "not-admitted", "handoff-cancelled", "orbit-infeasible", "orbit-blocked", "proximity-alert"]);
/** Handoffs, and events that return a target to a group. */
const HANDOFFS = new Set(["handoff-started", "handoff-completed", "readmitted", "reacquired"]);
/** Maximum number of events or targets on paper. */
const MAX_PRINTED = 1000;
/** Maximum number of target names that the object field proposes. */
const MAX_NAMES = 1000;

/** Formats an integer with thousands separators. */
function formatCount(count) {
  return count.toLocaleString("en");
}

/** The event filter, set by the fields above the list. */
class EventFilter {
  constructor(page, changed) {
    this.page = page;
    this.kind = element("event-kind");
    this.objectField = element("event-object");
    this.group = element("event-group");
    this.routine = element("routine-events");
    this.chosen = element("event-selected-only");
    /** Events that pass the filter, and events that would pass if only the routine option were applied. */
    this.events = [];
    this.unfiltered = [];
    const apply = () => {
      this.apply();
      changed();
    };
    for (const field of [this.kind, this.group, this.routine, this.chosen]) field.addEventListener("change", apply);
    this.objectField.addEventListener("input", apply);
    this.objectField.addEventListener("focus", () => this.propose());
    for (const { selection } of page.runs) selection.on(() => this.offer() && apply());
    this.offer();
  }

  /** Offers to list only the events of the selected object; returns whether this changes the filter. */
  offer() {
    const { object } = this.page.selection;
    const before = this.object;
    this.object = object;
    this.chosen.closest("label").hidden = !object;
    const name = object?.kind === "target" ? targetName(this.page.replayData, object.id) : objectKey(object).replace("uav", "UAV");
    element("event-selected-name").textContent = `only ${name}`;
    const isOn = this.chosen.checked;
    if (!object) this.chosen.checked = false;
    return isOn && objectKey(before ?? null) !== objectKey(object);
  }

  /** Fills the proposals of the object field. */
  propose() {
    const { replayData } = this.page;
    const names = [...replayData.ids.uavs.map((id) => `UAV ${id}`), ...replayData.ids.intruders.map((id) => `intruder ${id}`), ...replayData.head.targets.slice(0, MAX_NAMES)];
    element("object-names").replaceChildren(...names.map((name) => Object.assign(new Option(), { value: name })));
  }

  /** Updates the options and the filter after new data has been loaded. */
  renew() {
    const { replayData, run } = this.page;
    if (this.run !== run) for (const select of [this.kind, this.group]) select.length = 1;
    this.run = run;
    this.offer();
    const offered = (select) => new Set([...select.options].map((option) => option.value));
    const add = (select, values) => {
      const existing = offered(select);
      select.append(...values.filter((value) => !existing.has(value)).map((value) => new Option(value, value)));
    };
    add(this.kind, [...new Set(replayData.events.map((event) => event.kind))].sort());
    add(this.group, replayData.ids.groups.map(String));
    this.apply();
  }

  /** Applies the filter. */
  apply() {
    const { replayData } = this.page;
    const kind = this.kind.value;
    const group = this.group.value === "" ? null : Number(this.group.value);
    const isObject = this.objectFilter();
    const object = this.chosen.checked ? this.object : null;
    const isListedByDefault = (event) => this.routine.checked || !ROUTINE.has(event.kind);
    const passes = (event) =>
      (kind ? event.kind === kind : isListedByDefault(event)) &&
      (group === null || isOf(event, { kind: "group", id: group })) && isObject(event) && (!object || isOf(event, object));
    this.unfiltered = replayData.events.filter(isListedByDefault);
    const active = [kind, this.group.value, this.objectField.value.trim()].filter(Boolean).length;
    element("event-filters").textContent = active ? `Filter (${active})` : "Filter";
    this.events = replayData.events.filter(passes);
    /** Identifies the filter; it does not change when more events are loaded. */
    this.key = JSON.stringify([this.page.run.letter, replayData.agents.chosen, kind, group, this.objectField.value, this.routine.checked, object]);
  }

  /** Returns a function that tests an event against the object field: `UAV 2`, `intruder 0`, a target name, or a part of names. */
  objectFilter() {
    const text = this.objectField.value.trim().toLowerCase();
    if (!text) return () => true;
    const [, kind, id] = /^(uav|intruder) (\d+)$/.exec(text) ?? [];
    if (kind) return (event) => isOf(event, { kind, id: Number(id) });
    const names = this.page.replayData.head.targets.map((name) => name.toLowerCase());
    const isSame = names.includes(text);
    return (event) => event.target !== null && (isSame ? names[event.target] === text : names[event.target]?.includes(text));
  }

  /** Text with the numbers of events. */
  count() {
    const { replayData } = this.page;
    const isOther = replayData.agents.chosen !== null;
    const omitted = isOther ? replayData.head.other_events_left_out : replayData.head.events_left_out;
    const file = isOther ? "agent_events.parquet" : "events.parquet";
    const more = omitted ? `; ${formatCount(omitted)} later events are only in ${file}` : "";
    return `${formatCount(this.events.length)} of ${formatCount(replayData.events.length)} events${more}`;
  }
}

/** Whether an event concerns an object. */
function isOf(event, { kind, id }) {
  if (kind === "uav") return event.uavs.includes(id);
  if (kind === "target") return event.target === id;
  if (kind === "intruder") return event.intruder === id;
  return event.group === id || event.to_group === id;
}

class EventList {
  /** `goTo` is called with an event to go to. */
  constructor(page, eventFilter, goTo) {
    this.page = page;
    this.eventFilter = eventFilter;
    this.goTo = goTo;
    this.list = element("events");
    this.room = this.list.firstElementChild;
    this.toNow = element("to-current");
    /** Rows in the document, by index in the list. */
    this.rows = new Map();
    /** Heights of the rows that have been shown, px, by event; other rows have the estimated height `row_px`. */
    this.heights_px = new Map();
    /** Upper edges of all rows and lower edge of the last one, px. */
    this.tops_px = [0];
    /** Indices of the current event and of the keyboard cursor. */
    this.current = -1;
    this.cursor = -1;
    /** Whether the user has scrolled away from the current event. */
    this.isAway = false;
    /** Scroll position that the page set itself, px. */
    this.placed_px = 0;
    this.list.addEventListener("scroll", () => this.onScroll());
    this.list.addEventListener("keydown", (key) => this.onKey(key));
    this.list.addEventListener("focus", () => {
      // The list does not scroll on focus, because the pointer may be about to click a row.
      const first = this.rowAt(this.list.scrollTop - 1) + 1;
      this.cursor = Math.min(this.current >= 0 && this.isRowVisible(this.current) ? this.current : first, this.eventFilter.events.length - 1);
      this.show();
    });
    this.list.addEventListener("blur", () => {
      this.cursor = -1;
      this.show();
    });
    this.room.addEventListener("click", (click) => {
      const row = click.target.closest("[role=option]");
      if (row) this.goTo(this.eventFilter.events[Number(row.dataset.index)]);
    });
    this.toNow.addEventListener("click", () => {
      this.isAway = false;
      this.scrollToRow(this.current);
      this.show();
    });
    new ResizeObserver(() => {
      if (this.width !== this.list.clientWidth) {
        this.width = this.list.clientWidth;
        // The rows stay: the pointer may be about to click one.
        this.heights_px.clear();
        this.renew();
      }
      if (!this.isAway) this.scrollToRow(this.current);
      this.show();
    }).observe(this.list);
  }

  /** Updates the list after the filter or the events have changed. */
  renew() {
    const { events, key } = this.eventFilter;
    if (key !== this.key) {
      this.key = key;
      this.isAway = false;
      this.clear();
      this.current = this.cursor = -1;
    }
    this.row_px = Number.parseFloat(getComputedStyle(this.list).getPropertyValue("--row"));
    this.layOut();
    element("event-count").textContent = this.eventFilter.count();
    this.follow(this.page.clock.time_s);
    this.show();
  }

  /** Computes the positions of all rows. */
  layOut() {
    const { events } = this.eventFilter;
    this.tops_px = [0];
    events.forEach((event, k) => this.tops_px.push(this.tops_px[k] + (this.heights_px.get(event) ?? this.row_px)));
    this.room.style.height = `${this.tops_px[events.length]}px`;
    for (const [index, { element }] of this.rows) element.style.top = `${this.tops_px[index]}px`;
  }

  /** The row at a position in the list, px. */
  rowAt(y_px) {
    return Math.min(Math.max(lastNotAfter(this.tops_px, y_px), 0), this.eventFilter.events.length - 1);
  }

  clear() {
    for (const { element } of this.rows.values()) element.remove();
    this.rows.clear();
  }

  /** Marks the current event and keeps it visible: the event that the user went to, or otherwise the last one before the time shown. */
  follow(time_s, visitedEvent) {
    const { events } = this.eventFilter;
    const last = lastNotAfter(this.times(), time_s);
    const index = visitedEvent ? events.lastIndexOf(visitedEvent, last) : -1;
    const current = index < 0 ? last : index;
    if (current === this.current) return;
    this.current = current;
    if (!this.isAway) this.scrollToRow(current);
    this.show();
  }

  times() {
    if (this.timed !== this.eventFilter.events) {
      this.timed = this.eventFilter.events;
      this.times_s = this.timed.map((event) => event.time_s);
    }
    return this.times_s;
  }

  isRowVisible(index) {
    const [top, bottom] = [index, index + 1].map((edge) => this.tops_px[edge] - this.list.scrollTop);
    return index < 0 || (top > -1 && bottom < this.list.clientHeight + 1);
  }

  /** Scrolls to a row if it is not visible. */
  scrollToRow(index) {
    if (this.isRowVisible(index)) return;
    this.list.scrollTop = Math.max(0, (this.tops_px[index] + this.tops_px[index + 1] - this.list.clientHeight) / 2);
    this.placed_px = this.list.scrollTop;
    this.show(index);
  }

  onScroll() {
    const isIn = this.isRowVisible(this.current);
    if (isIn || Math.abs(this.list.scrollTop - this.placed_px) > 1) this.isAway = !isIn;
    this.show();
  }

  /** Puts the visible rows into the document, for the printer all rows. The row `fixed` keeps its place on the screen. */
  show(fixed = this.rowAt(this.list.scrollTop)) {
    const { events } = this.eventFilter;
    const { scrollTop, clientHeight } = this.list;
    const first = isPrinting ? 0 : Math.max(0, this.rowAt(scrollTop) - 2);
    const visible = clientHeight ? Math.min(events.length, this.rowAt(scrollTop + clientHeight) + 3) : first;
    const end = isPrinting ? Math.min(events.length, MAX_PRINTED) : visible;
    for (const [index, row] of this.rows) {
      if (index >= first && index < end && row.event === events[index]) continue;
      row.element.remove();
      this.rows.delete(index);
    }
    let before = null;
    for (let index = first; index < end; index++) {
      if (!this.rows.has(index)) this.rows.set(index, { event: events[index], element: this.row(index) });
      const { element: row } = this.rows.get(index);
      if (row.previousSibling !== before || !row.parentNode) this.room.insertBefore(row, before ? before.nextSibling : this.room.firstChild);
      before = row;
      row.setAttribute("aria-setsize", events.length);
      row.setAttribute("aria-selected", String(index === this.cursor));
      if (index === this.current) row.setAttribute("aria-current", "time");
      else row.removeAttribute("aria-current");
    }
    const pointed = this.rows.get(this.cursor)?.element;
    if (pointed) this.list.setAttribute("aria-activedescendant", pointed.id);
    else this.list.removeAttribute("aria-activedescendant");
    this.toNow.hidden = !this.isAway;
    if (!isPrinting && clientHeight) this.measure(fixed);
  }

  /** Measures the rows that are shown for the first time, and shows the list again if their heights differ from the estimate. */
  measure(fixed) {
    const fresh = [...this.rows.values()].filter(({ event }) => !this.heights_px.has(event));
    for (const { event, element } of fresh) this.heights_px.set(event, element.offsetHeight);
    if (fresh.every(({ event }) => this.heights_px.get(event) === this.row_px)) return;
    const before_px = this.tops_px[fixed];
    this.layOut();
    // If the user has scrolled, the list stays away from the place where it was put.
    const moved_px = this.tops_px[fixed] - before_px;
    this.list.scrollTop += moved_px;
    this.placed_px += moved_px;
    this.show(fixed);
  }

  row(index) {
    const event = this.eventFilter.events[index];
    const row = document.createElement("div");
    row.id = `event-${index}`;
    row.setAttribute("role", "option");
    row.setAttribute("aria-posinset", index + 1);
    row.style.top = `${this.tops_px[index]}px`;
    row.className = CRITICAL.has(event.kind) ? "critical" : "";
    Object.assign(row.dataset, { index, kind: event.kind, timeUs: event.time_us });
    const time = document.createElement("time");
    time.textContent = `${event.time_s.toFixed(1)} s`;
    row.append(time, ` ${eventText(this.page.replayData, event)}`);
    return row;
  }

  /** Moves the keyboard cursor. */
  point(index) {
    this.cursor = index;
    this.scrollToRow(index);
    this.isAway = !this.isRowVisible(this.current);
    this.show();
  }

  onKey(key) {
    const last = this.eventFilter.events.length - 1;
    const page = (direction) => this.rowAt((this.tops_px[this.cursor] ?? 0) + direction * this.list.clientHeight) - this.cursor || direction;
    const moves = { ArrowUp: -1, ArrowDown: 1, PageUp: page(-1), PageDown: page(1), Home: -Infinity, End: Infinity };
    if (key.ctrlKey || key.metaKey || key.altKey) return;
    if (key.key === "Enter" && this.cursor >= 0) this.goTo(this.eventFilter.events[this.cursor]);
    else if (key.key in moves) this.point(Math.min(Math.max(this.cursor + moves[key.key], 0), last));
    else return;
    // These keys move the cursor, not the time.
    key.preventDefault();
    key.stopPropagation();
  }
}

/** Text of an event. */
function eventText(replayData, event) {
  const groups =
    event.group !== null && event.to_group !== null
      ? `group ${event.group} to ${event.to_group}`
      : event.group !== null
        ? `group ${event.group}`
        : event.to_group !== null
          ? `to group ${event.to_group}`
          : "";
  const target = event.target === null ? "" : targetName(replayData, event.target);
  const uavs = event.target === null && event.uavs.length ? `UAV ${event.uavs.join(", ")}` : "";
  const intruder = event.intruder === undefined ? "" : `intruder ${event.intruder}`;
  const objects = [target || uavs, intruder, groups].filter(Boolean).join(", ");
  const when = event.event_time_us === undefined ? "" : ` (at ${(event.event_time_us / 1e6).toFixed(1)} s of the UAV's clock)`;
  const note = event.provisional ? " (provisional: may change until the commit)" : "";
  return `${event.kind}${objects ? ` \u2013 ${objects}` : ""}: ${event.reason}${when}${note}`;
}
