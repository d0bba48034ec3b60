// Events: which of them are wanted, and the list of those. Only rows in sight are in the document.

/** Events that tell little: they are listed only when asked for, and have no mark. */
const ROUTINE = new Set(["cued", "acquired", "orbit-feasible", "orbit-clear", "uavs-apart", "group-founded", "joined"]);
/** Events that cost custody, or may. */
const GRAVE = new Set(["lost", "discarded", "uav-lost", "left-out", "handoff-withdrawn", "orbit-infeasible", "orbit-barred", "uavs-close"]);
/** Events by which a target comes into another group's keeping, or back. */
const HANDED = new Set(["handoff-requested", "handoff-completed", "taken-back", "reacquired"]);
/** Most names that the field for a vehicle proposes. */
const MOST_VEHICLES = 1000;

/** A whole number in words. */
function counted(count) {
  return count.toLocaleString("en");
}

/** Which events are wanted: the fields above the list say so. */
class Sieve {
  constructor(page, changed) {
    this.page = page;
    this.kind = element("kind");
    this.vehicle = element("of-vehicle");
    this.group = element("of-group");
    this.routine = element("routine");
    this.chosen = element("of-chosen");
    /** The events wanted, and those that would be if nothing were narrowed down. */
    this.events = [];
    this.telling = [];
    const sift = () => {
      this.sift();
      changed();
    };
    for (const field of [this.kind, this.group, this.routine, this.chosen]) field.addEventListener("change", sift);
    this.vehicle.addEventListener("input", sift);
    this.vehicle.addEventListener("focus", () => this.propose());
    for (const { choice } of page.runs) choice.on(() => this.offer() && sift());
    this.offer();
  }

  /** Offers the events of what is chosen on the map alone; says whether that changes what is wanted. */
  offer() {
    const { object } = this.page.choice;
    const before = this.object;
    this.object = object;
    this.chosen.closest("label").hidden = !object;
    const name = object?.kind === "target" ? targetName(this.page.film, object.id) : objectWord(object).replace("uav", "UAV");
    element("chosen").textContent = `only of ${name}`;
    const isOn = this.chosen.checked;
    if (!object) this.chosen.checked = false;
    return isOn && objectWord(before ?? null) !== objectWord(object);
  }

  /** Names for the field. */
  propose() {
    const { film } = this.page;
    const names = [...film.ids.uavs.map((id) => `UAV ${id}`), ...film.ids.intruders.map((id) => `intruder ${id}`), ...film.head.targets.slice(0, MOST_VEHICLES)];
    element("vehicles").replaceChildren(...names.map((name) => Object.assign(new Option(), { value: name })));
  }

  /** Takes in what has been loaded. */
  renew() {
    const { film, run } = this.page;
    if (this.run !== run) for (const select of [this.kind, this.group]) select.length = 1;
    this.run = run;
    this.offer();
    const offered = (select) => new Set([...select.options].map((option) => option.value));
    const add = (select, values) => {
      const known = offered(select);
      select.append(...values.filter((value) => !known.has(value)).map((value) => new Option(value, value)));
    };
    add(this.kind, [...new Set(film.events.map((event) => event.kind))].sort());
    add(this.group, film.ids.groups.map(String));
    this.sift();
  }

  sift() {
    const { film } = this.page;
    const kind = this.kind.value;
    const group = this.group.value === "" ? null : Number(this.group.value);
    const isVehicle = this.ofVehicle();
    const object = this.chosen.checked ? this.object : null;
    const isUsual = (event) => this.routine.checked || !ROUTINE.has(event.kind);
    const isWanted = (event) =>
      (kind ? event.kind === kind : isUsual(event)) &&
      (group === null || isOf(event, { kind: "group", id: group })) && isVehicle(event) && (!object || isOf(event, object));
    this.telling = film.events.filter(isUsual);
    this.events = film.events.filter(isWanted);
    /** Changes whenever other events are wanted, not when there are more of them. */
    this.key = JSON.stringify([this.page.run.letter, film.minds.chosen, kind, group, this.vehicle.value, this.routine.checked, object]);
  }

  /** Whether an event is of the vehicle in the field: `UAV 2`, `intruder 0`, a target, or part of the names of some. */
  ofVehicle() {
    const text = this.vehicle.value.trim().toLowerCase();
    if (!text) return () => true;
    const [, kind, id] = /^(uav|intruder) (\d+)$/.exec(text) ?? [];
    if (kind) return (event) => isOf(event, { kind, id: Number(id) });
    const names = this.page.film.head.targets.map((name) => name.toLowerCase());
    const isSame = names.includes(text);
    return (event) => event.target !== null && (isSame ? names[event.target] === text : names[event.target]?.includes(text));
  }

  /** How many there are, in words. */
  count() {
    const { film } = this.page;
    const isOther = film.minds.chosen !== null;
    const left = isOther ? film.head.other_events_left_out : film.head.events_left_out;
    const file = isOther ? "agent_events.parquet" : "events.parquet";
    const more = left ? `; the run has ${counted(left)} more, later ones: they are in ${file} only` : "";
    return `${counted(this.events.length)} of ${counted(film.events.length)} events${more}`;
  }
}

/** Whether an event is of an object. */
function isOf(event, { kind, id }) {
  if (kind === "uav") return event.uavs.includes(id);
  if (kind === "target") return event.target === id;
  if (kind === "intruder") return event.intruder === id;
  return event.group === id || event.to_group === id;
}

class EventList {
  /** `goTo` is called with an event to go to. */
  constructor(page, sieve, goTo) {
    this.page = page;
    this.sieve = sieve;
    this.goTo = goTo;
    this.list = element("events");
    this.room = this.list.firstElementChild;
    this.text = element("event-text");
    this.toNow = element("to-now");
    /** Rows in the document, by place in the list. */
    this.rows = new Map();
    /** Places: of the event that is on, and of the one that the keys are at. */
    this.current = -1;
    this.cursor = -1;
    /** The reader has scrolled away from the event that is on. */
    this.isAway = false;
    /** How far the list was scrolled by the page itself, px. */
    this.placed_px = 0;
    this.list.addEventListener("scroll", () => this.scrolled());
    this.list.addEventListener("keydown", (key) => this.keyed(key));
    this.list.addEventListener("focus", () => {
      // Nothing moves under a pointer that is about to click.
      const first = Math.ceil(this.list.scrollTop / this.row_px);
      this.cursor = Math.min(this.current >= 0 && this.isInSight(this.current) ? this.current : first, this.sieve.events.length - 1);
      this.show();
    });
    this.list.addEventListener("blur", () => {
      this.cursor = -1;
      this.show();
    });
    this.room.addEventListener("click", (click) => {
      const row = click.target.closest("[role=option]");
      if (row) this.goTo(this.sieve.events[Number(row.dataset.place)]);
    });
    this.room.addEventListener("mouseover", (move) => this.tell(Number(move.target.closest("[role=option]")?.dataset.place ?? -1)));
    this.room.addEventListener("mouseleave", () => this.tell());
    this.toNow.addEventListener("click", () => {
      this.isAway = false;
      this.bring(this.current);
      this.show();
    });
    new ResizeObserver(() => {
      if (this.row_px !== this.rowHeight()) {
        this.clear();
        this.renew();
      }
      if (!this.isAway) this.bring(this.current);
      this.show();
    }).observe(this.list);
  }

  /** Other events are wanted, or there are more. */
  renew() {
    const { events, key } = this.sieve;
    if (key !== this.key) {
      this.key = key;
      this.isAway = false;
      this.clear();
      this.current = this.cursor = -1;
    }
    this.row_px = this.rowHeight();
    this.room.style.height = `${events.length * this.row_px}px`;
    element("count").textContent = this.sieve.count();
    this.follow(this.page.clock.time_s);
    this.show();
  }

  /** Height of a row, px, which the style sheet says. */
  rowHeight() {
    return Number.parseFloat(getComputedStyle(this.list).getPropertyValue("--row"));
  }

  clear() {
    for (const { element } of this.rows.values()) element.remove();
    this.rows.clear();
  }

  /** Marks the event that is on, the one gone to or else the last, and keeps it in sight. */
  follow(time_s, gone) {
    const { events } = this.sieve;
    const last = lastNotAfter(this.times(), time_s);
    const place = gone ? events.lastIndexOf(gone, last) : -1;
    const current = place < 0 ? last : place;
    if (current === this.current) return;
    this.current = current;
    if (!this.isAway) this.bring(current);
    this.show();
  }

  times() {
    if (this.timed !== this.sieve.events) {
      this.timed = this.sieve.events;
      this.times_s = this.timed.map((event) => event.time_s);
    }
    return this.times_s;
  }

  isInSight(place) {
    const top = place * this.row_px - this.list.scrollTop;
    return place < 0 || (top > -1 && top + this.row_px < this.list.clientHeight + 1);
  }

  /** Scrolls to a row, if it is out of sight. */
  bring(place) {
    if (this.isInSight(place)) return;
    this.list.scrollTop = Math.max(0, (place + 0.5) * this.row_px - this.list.clientHeight / 2);
    this.placed_px = this.list.scrollTop;
  }

  scrolled() {
    const isIn = this.isInSight(this.current);
    if (isIn || Math.abs(this.list.scrollTop - this.placed_px) > 1) this.isAway = !isIn;
    this.show();
  }

  /** Puts the rows in sight into the document. */
  show() {
    const { events } = this.sieve;
    const { scrollTop, clientHeight } = this.list;
    const first = Math.max(0, Math.floor(scrollTop / this.row_px) - 2);
    const end = clientHeight ? Math.min(events.length, Math.ceil((scrollTop + clientHeight) / this.row_px) + 2) : first;
    for (const [place, row] of this.rows) {
      if (place >= first && place < end && row.event === events[place]) continue;
      row.element.remove();
      this.rows.delete(place);
    }
    let before = null;
    for (let place = first; place < end; place++) {
      if (!this.rows.has(place)) this.rows.set(place, { event: events[place], element: this.row(place) });
      const { element: row } = this.rows.get(place);
      if (row.previousSibling !== before || !row.parentNode) this.room.insertBefore(row, before?.nextSibling ?? this.room.firstChild);
      before = row;
      row.setAttribute("aria-setsize", events.length);
      row.setAttribute("aria-selected", String(place === this.cursor));
      if (place === this.current) row.setAttribute("aria-current", "time");
      else row.removeAttribute("aria-current");
    }
    const pointed = this.rows.get(this.cursor)?.element;
    if (pointed) this.list.setAttribute("aria-activedescendant", pointed.id);
    else this.list.removeAttribute("aria-activedescendant");
    this.toNow.hidden = !this.isAway;
    this.tell();
  }

  row(place) {
    const event = this.sieve.events[place];
    const row = document.createElement("div");
    row.id = `event-${place}`;
    row.setAttribute("role", "option");
    row.setAttribute("aria-posinset", place + 1);
    row.style.top = `${place * this.row_px}px`;
    row.className = GRAVE.has(event.kind) ? "grave" : "";
    Object.assign(row.dataset, { place, kind: event.kind, timeUs: event.time_us });
    const time = document.createElement("time");
    time.textContent = `${event.time_s.toFixed(1)} s`;
    row.append(time, ` ${eventText(this.page.film, event)}`);
    row.title = row.textContent;
    return row;
  }

  /** The whole text of an event: of the one pointed at, or else of the one that is on. */
  tell(place = -1) {
    const event = this.sieve.events[[place, this.cursor, this.current].find((one) => one >= 0) ?? -1];
    const text = event ? `${event.time_s.toFixed(1)} s ${eventText(this.page.film, event)}` : "";
    if (this.text.textContent !== text) this.text.textContent = text;
  }

  /** Moves what the keys are at. */
  point(place) {
    this.cursor = place;
    this.bring(place);
    this.isAway = !this.isInSight(this.current);
    this.show();
  }

  keyed(key) {
    const page = Math.max(1, Math.floor(this.list.clientHeight / this.row_px) - 1);
    const last = this.sieve.events.length - 1;
    const ways = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -Infinity, End: Infinity };
    if (key.ctrlKey || key.metaKey || key.altKey) return;
    if (key.key === "Enter" && this.cursor >= 0) this.goTo(this.sieve.events[this.cursor]);
    else if (key.key in ways) this.point(Math.min(Math.max(this.cursor + ways[key.key], 0), last));
    else return;
    // These keys work the list, not the clock.
    key.preventDefault();
    key.stopPropagation();
  }
}

/** An event in words. */
function eventText(film, event) {
  const groups =
    event.group !== null && event.to_group !== null
      ? `group ${event.group} to ${event.to_group}`
      : event.group !== null
        ? `group ${event.group}`
        : "";
  const target = event.target === null ? "" : targetName(film, event.target);
  const uavs = event.target === null && event.uavs.length ? `UAV ${event.uavs.join(", ")}` : "";
  const intruder = event.intruder === undefined ? "" : `intruder ${event.intruder}`;
  const who = [target || uavs, intruder, groups].filter(Boolean).join(", ");
  const when = event.happened_us === undefined ? "" : ` (at ${(event.happened_us / 1e6).toFixed(1)} s by its clock)`;
  const likely = event.provisional ? " (provisional: it may still turn out otherwise)" : "";
  return `${event.kind}${who ? ` \u2013 ${who}` : ""}: ${event.reason}${when}${likely}`;
}
