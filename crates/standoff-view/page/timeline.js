// Time: the slider, the event strip above it, and the line with the text of the current event.

/** Width of a bar of the event strip, px. */
const BAR = 2;
/** Maximum distance between the pointer and an event, px. */
const NEAR = 6;

const shownState = ({ agents }) => (agents.chosen === null ? "the shown team state" : `the team state of UAV ${agents.chosen}`);

/** Descriptions of the kinds of time ranges. */
const SPANS = {
  differ: () => "the agents' assignments differ",
  silent: (replayData) => `a UAV is silent in ${shownState(replayData)}`,
  timedOut: (replayData) => `a UAV has timed out in ${shownState(replayData)}`,
  off: ({ agents }) => (agents.chosen === null ? "all computers are off" : `the computer of UAV ${agents.chosen} is off`),
};

class Timeline {
  constructor(page) {
    this.page = page;
    const { clock } = page;
    this.clock = clock;
    this.slider = element("time");
    this.marks = element("event-strip");
    this.now = element("time-marker");
    this.total = element("total");
    this.message = element("event-summary");
    this.tip = element("strip-tooltip");
    /** The event that the user went to; `null` once the time has moved on. */
    this.visitedEvent = null;
    this.message_s = 0;
    this.eventFilter = new EventFilter(page, () => this.filterChanged());
    this.list = new EventList(page, this.eventFilter, (event) => this.goTo(event));
    this.slider.addEventListener("input", () => clock.seek(Number(this.slider.value)));
    this.marks.addEventListener("click", (click) => {
      const [event] = this.at(click.offsetX / pageZoom());
      if (event) this.goTo(event);
      else clock.seek(this.time(click.offsetX / pageZoom()));
    });
    this.marks.addEventListener("pointermove", (move) => this.hint(move.offsetX / pageZoom()));
    this.marks.addEventListener("pointerleave", () => (this.tip.hidden = true));
    this.spans = element("agent-bands");
    this.spans.addEventListener("click", (click) => clock.seek(this.time(click.offsetX / pageZoom())));
    this.spans.addEventListener("pointermove", (move) => this.hintSpans(move.offsetX / pageZoom()));
    this.spans.addEventListener("pointerleave", () => (this.tip.hidden = true));
    new ResizeObserver(() => {
      this.strip();
      page.renew();
    }).observe(this.marks);
  }

  get replayData() {
    return this.page.replayData;
  }

  /** Time range of the slider: the whole mission, or the part flown so far. */
  get range_s() {
    const { replayData } = this.clock;
    return [replayData.times_s[0] ?? 0, Math.max(replayData.end_s, replayData.done ? 0 : replayData.head.duration_s, 1e-6)];
  }

  x(time_s) {
    const [first, last] = this.range_s;
    return ((time_s - first) / (last - first)) * this.marks.clientWidth;
  }

  time(x) {
    const [first, last] = this.range_s;
    return first + (x / Math.max(this.marks.clientWidth, 1)) * (last - first);
  }

  /** The events of the bar at a position, critical ones first, then by distance; without a bar, the nearest event in reach. */
  at(x) {
    const { events } = this.eventFilter;
    const times_s = this.list.times();
    const off = (event) => Math.abs(this.x(event.time_s) - x);
    const from = lastNotAfter(times_s, this.time(x - NEAR)) + 1;
    const near = events.slice(from, lastNotAfter(times_s, this.time(x + NEAR)) + 1);
    const rank = (event) => (CRITICAL.has(event.kind) ? 0 : NEAR) + off(event);
    const bar = near.filter((event) => off(event) <= BAR).sort((a, b) => rank(a) - rank(b));
    return bar.length ? bar : near.sort((a, b) => off(a) - off(b)).slice(0, 1);
  }

  /** Shows a tooltip for the events under the pointer. */
  hint(x) {
    const events = this.at(x);
    this.tip.hidden = !events.length;
    if (!events.length) return;
    this.tip.textContent = `${manyText(events)}\n${events[0].time_s.toFixed(1)} s ${eventText(this.replayData, events[0])}`;
    this.placeTip(x);
  }

  /** Shows a tooltip for the time ranges under the pointer. */
  hintSpans(x) {
    const time_s = this.time(x);
    const spans = this.replayData.agents.spans();
    // The tolerance of one pixel makes very short ranges selectable.
    const near_s = this.time(x + 1) - time_s;
    const under = Object.keys(SPANS).flatMap((kind) =>
      spans[kind].filter(({ from_s, until_s }) => from_s - near_s <= time_s && time_s < until_s + near_s).slice(0, 1).map((span) => ({ kind, span })));
    this.tip.hidden = !under.length;
    if (!under.length) return;
    const text = ({ kind, span }) => `${span.from_s.toFixed(1)} to ${span.until_s.toFixed(1)} s: ${SPANS[kind](this.replayData)}`;
    this.tip.textContent = under.map(text).join("\n");
    this.placeTip(x);
  }

  placeTip(x) {
    const room = this.marks.clientWidth - this.tip.offsetWidth;
    this.tip.style.left = `${Math.max(0, Math.min(x - this.tip.offsetWidth / 2, room))}px`;
  }

  /** Goes to an event and shows its text. */
  goTo(event) {
    this.visitedEvent = event;
    // The list scrolls to the row of the event.
    this.list.isAway = false;
    this.clock.seek(event.time_s);
    const others = this.list.times().filter((time_s) => time_s === event.time_s).length - 1;
    const more = others > 0 ? ` (${others} more at this time)` : "";
    this.showMessage(`${event.time_s.toFixed(1)} s ${eventText(this.replayData, event)}${more}`);
  }

  /** Shows a text above the strip until the time moves on. */
  showMessage(text) {
    this.message_s = this.clock.time_s;
    this.message.textContent = this.message.title = text;
  }

  /** Goes to the next or the previous event that passes the filter; of simultaneous events, to a critical one. */
  jump(forward) {
    const { events } = this.eventFilter;
    const times_s = this.list.times();
    const on = lastNotAfter(times_s, this.clock.time_s);
    const found = forward ? on + 1 : lastNotAfter(times_s, this.clock.time_s - 1e-6);
    const time_s = times_s[found];
    if (time_s === undefined) return;
    const first = lastNotAfter(times_s, time_s - 1e-6) + 1;
    const together = events.slice(first, lastNotAfter(times_s, time_s) + 1);
    this.goTo(together.find((event) => CRITICAL.has(event.kind)) ?? together[0]);
  }

  /** Redraws after new data has been loaded, or the theme has changed. */
  renew() {
    const [first, last] = this.range_s;
    this.slider.min = first;
    this.slider.max = last;
    this.slider.step = "any";
    const { head, end_s, done } = this.clock.replayData;
    const planned = `${head.duration_s.toFixed(1)} s`;
    this.total.textContent = done ? `/ ${end_s.toFixed(1)} s` : head.live ? `/ ${end_s.toFixed(1)} of ${planned}` : `/ ${planned}`;
    this.eventFilter.renew();
    this.filterChanged();
  }

  /** Redraws after the event filter or the events have changed. */
  filterChanged() {
    this.strip();
    this.list.renew();
  }

  /**
   * Draws the strip: bars whose height is the number of events, on a logarithmic scale. Critical events extend from the top,
   * others from the bottom. Events that do not pass the filter are faint.
   */
  strip() {
    const ratio = screenRatio();
    const { clientWidth, clientHeight } = this.marks;
    this.marks.width = clientWidth * ratio;
    this.marks.height = clientHeight * ratio;
    const ctx = this.marks.getContext("2d");
    ctx.scale(ratio, ratio);
    const { alarm, faint, grid } = palette();
    const accent = getComputedStyle(document.documentElement).getPropertyValue("--accent");
    const [all, filtered] = [this.bars(this.eventFilter.unfiltered), this.bars(this.eventFilter.events)];
    const most = Math.max(1, ...[...all.values(), ...filtered.values()].map(([critical, ...rest]) => Math.max(critical, rest[0] + rest[1])));
    const height = (count) => (count ? (clientHeight / 2 - 1) * (most > 1 ? 0.4 + (0.6 * Math.log(count)) / Math.log(most) : 1) : 0);
    this.stretches();
    for (const [bars, ...inks] of [[all, grid, grid, grid], [filtered, alarm, accent, faint]]) {
      for (const [bar, [critical, handoffs, other]] of bars) {
        const box = (ink, top, tall) => {
          ctx.fillStyle = ink;
          ctx.fillRect(bar * BAR, top, BAR, tall);
        };
        box(inks[0], 0, height(critical));
        const tall = height(handoffs + other);
        const share = handoffs / Math.max(handoffs + other, 1);
        box(inks[1], clientHeight - tall, tall * share);
        box(inks[2], clientHeight - tall * (1 - share), tall * (1 - share));
      }
    }
  }

  /** Draws two bands below the strip: times with different assignments, and times with missing reports in the shown team state. */
  stretches() {
    const { agents } = this.replayData;
    this.spans.hidden = !agents.isSeveral;
    if (!agents.isSeveral) return;
    const ratio = screenRatio();
    const { clientWidth, clientHeight } = this.spans;
    this.spans.width = clientWidth * ratio;
    this.spans.height = clientHeight * ratio;
    const ctx = this.spans.getContext("2d");
    ctx.scale(ratio, ratio);
    const { alarm, faint, grid, groups } = palette();
    const tall = (clientHeight - 1) / 2;
    ctx.fillStyle = grid;
    for (const top of [0, tall + 1]) ctx.fillRect(0, top, clientWidth, tall);
    const spans = agents.spans();
    const draw = (kind, ink, top, high = tall) => {
      ctx.fillStyle = ink;
      for (const { from_s, until_s } of spans[kind]) {
        const left = this.x(from_s);
        ctx.fillRect(left, top, Math.max(this.x(until_s) - left, 1), high);
      }
    };
    draw("differ", groups[0], 0);
    draw("silent", faint, tall + 1);
    draw("timedOut", alarm, tall + 1);
    // No team state: a thin line instead of the band.
    draw("off", alarm, tall + 1 + tall / 2 - 0.5, 1);
    const ranges = Object.entries(spans).map(([kind, some]) => [kind, some.map(({ from_s, until_s }) => `${from_s}-${until_s}`).join(" ")]);
    Object.assign(this.spans.dataset, Object.fromEntries(ranges));
  }

  /** Numbers of critical events, handoffs and other events, by bar. */
  bars(events) {
    const bars = new Map();
    for (const event of events) {
      const bar = Math.floor(Math.min(this.x(event.time_s), this.marks.clientWidth - 1) / BAR);
      if (!bars.has(bar)) bars.set(bar, [0, 0, 0]);
      bars.get(bar)[CRITICAL.has(event.kind) ? 0 : HANDOFFS.has(event.kind) ? 1 : 2] += 1;
    }
    return bars;
  }

  /** Updates the slider and the list to the time shown. */
  follow() {
    const { time_s, playing, speed } = this.clock;
    this.slider.value = time_s;
    this.slider.setAttribute("aria-valuetext", `${time_s.toFixed(1)} seconds`);
    this.now.style.left = `${this.x(time_s)}px`;
    // During playback the text stays for 3 s of real time, so that it can be read.
    const away_s = time_s - this.message_s;
    if (Math.abs(away_s) > 1e-6 && !(playing && away_s > 0 && away_s < 3 * speed)) {
      this.visitedEvent = null;
      this.showMessage("");
    }
    this.list.follow(time_s, this.visitedEvent);
  }
}

/** Summary of several events: number, times and kinds. */
function manyText(events) {
  const times_s = events.map((event) => event.time_s);
  const [first, last] = [Math.min(...times_s), Math.max(...times_s)].map((time_s) => time_s.toFixed(1));
  const kinds = new Map();
  for (const { kind } of events) kinds.set(kind, (kinds.get(kind) ?? 0) + 1);
  const list = [...kinds].map(([kind, count]) => `${formatCount(count)} ${kind}`).join(", ");
  const when = first === last ? `${first} s` : `${first} to ${last} s`;
  return `${formatCount(events.length)} event${events.length === 1 ? "" : "s"}, ${when}: ${list}`;
}
