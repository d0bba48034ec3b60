// One target over the whole run. Details are loaded one after the other, and only what is charted of them is kept.

class TargetSeries {
  constructor(film, id) {
    this.film = film;
    this.id = id;
    this.times_s = [];
    this.error_m = [];
    /** By instant: "", "out of view" or "coasting". */
    this.concerns = [];
    /** Groups that it was a member of. */
    this.groups = new Set();
    /** By part: how many instants it had, and where its values begin. */
    this.read = [];
    this.loading = false;
    this.dropped = false;
  }

  /** Nobody waits for it any more. */
  drop() {
    this.dropped = true;
  }

  /** Of all parts, those that have been read. */
  get share() {
    return this.film.parts.length ? this.read.length / this.film.parts.length : 1;
  }

  /** The part to read next: the first that has not been read, or not as far as it goes now; none, if all have. */
  get next() {
    const part = this.film.parts.findIndex((half, k) => (this.read[k]?.instants ?? 0) < half.times_s.length);
    return part < 0 ? undefined : part;
  }

  /** Loads what there is and has not been read; tells now and then. */
  async load(told) {
    const { film } = this;
    // What could not be read is asked for again when there is more.
    if (this.loading || this.next === undefined || this.failed_s === film.end_s) return;
    this.loading = true;
    let told_ms = performance.now();
    try {
      for (let part = this.next; part !== undefined && !this.dropped; part = this.next) {
        const instants = film.parts[part].times_s.length;
        const held = film.details.get(part);
        this.take(part, instants, held?.instants >= instants ? held.half : await film.source.half("detail", part));
        if (performance.now() - told_ms > 500) {
          told();
          told_ms = performance.now();
        }
        // The map goes first.
        await new Promise((resolve) => setTimeout(resolve));
      }
    } catch {
      this.failed_s = film.end_s;
    }
    this.loading = false;
    if (!this.dropped) told();
  }

  take(part, instants, half) {
    const from = this.read[part]?.from ?? this.times_s.length;
    for (const values of [this.times_s, this.error_m, this.concerns]) values.length = from;
    this.read.length = part;
    this.read.push({ instants, from });
    const table = half.tables.targets;
    half.times_s.forEach((time_s, instant) => {
      const at = (column) => table.value(column, this.id, instant);
      const group = at("group");
      if (!Number.isNaN(group)) this.groups.add(group);
      this.times_s.push(time_s);
      this.error_m.push(Math.hypot(at("x_m") - at("true_x_m"), at("y_m") - at("true_y_m")));
      const isHidden = at("in_view") === 0 && !Number.isNaN(group);
      this.concerns.push(isHidden ? "out of view" : STATUS[at("status")] === "coasting" ? "coasting" : "");
    });
  }

  /** Stretches of time with a concern, s; those closer than `gap_s` as one. */
  stretches(concern, gap_s) {
    const found = [];
    this.concerns.forEach((told, k) => {
      if (told !== concern) return;
      const [from, to] = [this.times_s[k], this.times_s[k + 1] ?? this.times_s[k]];
      const last = found.at(-1);
      if (last && from - last[1] <= gap_s) last[1] = to;
      else found.push([from, to]);
    });
    return found;
  }
}
