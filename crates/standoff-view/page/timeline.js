// Events: marks over the time slider, and a list; either jumps there.

/** Events that tell little: they are listed only when asked for, and have no mark. */
const ROUTINE = new Set(["cued", "acquired", "orbit-feasible", "uavs-apart", "group-founded", "joined"]);
/** Events that cost custody, or may. */
const GRAVE = new Set(["lost", "discarded", "uav-lost", "left-out", "handoff-withdrawn", "orbit-infeasible", "uavs-close"]);
/** Most events that the list shows. */
const MOST_LISTED = 400;

class Timeline {
  constructor(page) {
    this.page = page;
    const { clock } = page;
    this.clock = clock;
    this.slider = element("time");
    this.marks = element("marks");
    this.events = element("events");
    this.kind = element("kind");
    this.routine = element("routine");
    this.count = element("count");
    this.kinds = new Set();
    /** Which events are in the list. */
    this.listed = null;
    this.slider.addEventListener("input", () => clock.seek(Number(this.slider.value)));
    this.marks.addEventListener("click", (click) => {
      const event = this.nearest(click.offsetX);
      clock.seek(event ? event.time_s : this.time(click.offsetX));
    });
    this.marks.addEventListener("mousemove", (move) => {
      const event = this.nearest(move.offsetX);
      this.marks.title = event ? `${event.time_s.toFixed(1)} s: ${eventText(this.film, event)}` : "";
    });
    this.routine.addEventListener("change", () => this.list());
    this.kind.addEventListener("change", () => this.list());
  }

  get film() {
    return this.page.film;
  }

  telling() {
    return this.film.events.filter((event) => !ROUTINE.has(event.kind));
  }

  /** The whole of time: of the mission, or what has been flown. */
  get range_s() {
    const { film } = this.clock;
    return [film.times_s[0] ?? 0, Math.max(film.end_s, film.done ? 0 : film.head.duration_s, 1e-6)];
  }

  x(time_s) {
    const [first, last] = this.range_s;
    return ((time_s - first) / (last - first)) * this.marks.clientWidth;
  }

  time(x) {
    const [first, last] = this.range_s;
    return first + (x / Math.max(this.marks.clientWidth, 1)) * (last - first);
  }

  nearest(x) {
    let best = null;
    for (const event of this.telling()) {
      const off = Math.abs(this.x(event.time_s) - x);
      if (off < 6 && (!best || off < Math.abs(this.x(best.time_s) - x))) best = event;
    }
    return best;
  }

  /** The next telling event after the time shown, or the one before it. */
  jump(forward) {
    const now = this.clock.time_s;
    const events = this.telling();
    const found = forward
      ? events.find((event) => event.time_s > now + 1e-6)
      : events.filter((event) => event.time_s < now - 1e-6).at(-1);
    if (found) this.clock.seek(found.time_s);
  }

  /** Draws the marks anew and adds to the list: more has been loaded, or the page has another size or theme. */
  renew() {
    const [first, last] = this.range_s;
    this.slider.min = first;
    this.slider.max = last;
    this.slider.step = "any";
    const ratio = window.devicePixelRatio || 1;
    this.marks.width = this.marks.clientWidth * ratio;
    this.marks.height = this.marks.clientHeight * ratio;
    const pen = this.marks.getContext("2d");
    pen.scale(ratio, ratio);
    for (const event of this.telling()) {
      const x = this.x(event.time_s);
      const grave = GRAVE.has(event.kind);
      pen.fillStyle = grave ? palette().alarm : groupColour(this.film, event.group);
      pen.fillRect(x - 1, grave ? 1 : 5, 2, this.marks.clientHeight - (grave ? 2 : 7));
    }
    this.list();
  }

  /** Lists the events chosen, and adds those that have come in. */
  list() {
    const kinds = [...new Set(this.film.events.map((event) => event.kind))].sort();
    for (const kind of kinds.filter((kind) => !this.kinds.has(kind))) {
      this.kinds.add(kind);
      this.kind.append(new Option(kind, kind));
    }
    const wanted = this.kind.value;
    const matching = this.film.events.filter((event) =>
      wanted ? event.kind === wanted : this.routine.checked || !ROUTINE.has(event.kind),
    );
    const chosen = `${wanted} ${this.routine.checked}`;
    if (chosen !== this.listed) this.events.replaceChildren();
    this.listed = chosen;
    // Events only ever come in: what is in the list stays, and whoever reads or holds it is not disturbed.
    const added = matching.slice(this.events.children.length, MOST_LISTED);
    this.events.append(...added.map((event) => this.item(event)));
    const count = this.events.children.length;
    const more = matching.length > count ? `, the first ${count} listed` : "";
    this.count.textContent = `${matching.length} of ${this.film.events.length} events${more}`;
  }

  item(event) {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.timeUs = event.time_us;
    button.dataset.kind = event.kind;
    button.className = GRAVE.has(event.kind) ? "grave" : "";
    const time = document.createElement("time");
    time.textContent = `${event.time_s.toFixed(1)} s`;
    button.append(time, ` ${eventText(this.film, event)}`);
    button.addEventListener("click", () => this.clock.seek(event.time_s));
    const item = document.createElement("li");
    item.append(button);
    return item;
  }

  /** Moves the slider with the clock. */
  follow() {
    const { time_s } = this.clock;
    this.slider.value = time_s;
    this.slider.setAttribute("aria-valuetext", `${time_s.toFixed(1)} seconds`);
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
  const target = event.target === null ? "" : short(film.head.targets[event.target] ?? event.target);
  const uavs = event.target === null && event.uavs.length ? `UAV ${event.uavs.join(", ")}` : "";
  const who = [target || uavs, groups].filter(Boolean).join(", ");
  return `${event.kind}${who ? ` \u2013 ${who}` : ""}: ${event.reason}`;
}
