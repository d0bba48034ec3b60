// One target over the whole run. Details are loaded one after the other, and only the charted values are kept.

class TargetSeries {
  constructor(replayData, id) {
    this.replayData = replayData;
    this.id = id;
    this.times_s = [];
    this.error_m = [];
    /** By time step: "", "out of view" or "coasting". */
    this.warnings = [];
    /** Groups of which the target has been a member. */
    this.groups = new Set();
    /** By part: its number of time steps when it was read, and the index of its first value. */
    this.read = [];
    this.loading = false;
    this.dropped = false;
  }

  /** Stops loading. */
  drop() {
    this.dropped = true;
  }

  /** Fraction of the parts that have been read. */
  get share() {
    return this.replayData.parts.length ? this.read.length / this.replayData.parts.length : 1;
  }

  /** Index of the part to read next: the first part that has not been read completely; `undefined` if there is none. */
  get next() {
    const part = this.replayData.parts.findIndex((block, k) => (this.read[k]?.stepCount ?? 0) < block.times_s.length);
    return part < 0 ? undefined : part;
  }

  /** Reads the parts that have not been read; calls `progress` every 0.5 s and at the end. */
  async load(progress) {
    const { replayData } = this;
    // After an error, reading continues when the run has grown.
    if (this.loading || this.next === undefined || this.failed_s === replayData.end_s) return;
    this.loading = true;
    let reported_ms = performance.now();
    try {
      for (let part = this.next; part !== undefined && !this.dropped; part = this.next) {
        const stepCount = replayData.parts[part].times_s.length;
        const held = replayData.details.get(part);
        this.take(part, stepCount, held?.stepCount >= stepCount ? held.block : await replayData.source.block("detail", part));
        if (performance.now() - reported_ms > 500) {
          progress();
          reported_ms = performance.now();
        }
        // Drawing the map has priority.
        await new Promise((resolve) => setTimeout(resolve));
      }
    } catch {
      this.failed_s = replayData.end_s;
    }
    this.loading = false;
    if (!this.dropped) progress();
  }

  /** Adds or replaces the values of a part. */
  take(part, stepCount, block) {
    const from = this.read[part]?.from ?? this.times_s.length;
    for (const values of [this.times_s, this.error_m, this.warnings]) values.length = from;
    this.read.length = part;
    this.read.push({ stepCount, from });
    const table = block.tables.targets;
    block.times_s.forEach((time_s, stepIndex) => {
      const at = (column) => table.value(column, this.id, stepIndex);
      const group = at("group");
      if (!Number.isNaN(group)) this.groups.add(group);
      this.times_s.push(time_s);
      this.error_m.push(Math.hypot(at("x_m") - at("true_x_m"), at("y_m") - at("true_y_m")));
      this.warnings.push(isOutOfView(at("in_view")) ? "out of view" : STATUS[at("status")] === "coasting" ? "coasting" : "");
    });
  }

  /** Time ranges with a warning, s; ranges closer together than `gap_s` are merged. */
  stretches(warning, gap_s) {
    const found = [];
    this.warnings.forEach((current, k) => {
      if (current !== warning) return;
      const [from, to] = [this.times_s[k], this.times_s[k + 1] ?? this.times_s[k]];
      const last = found.at(-1);
      if (last && from - last[1] <= gap_s) last[1] = to;
      else found.push([from, to]);
    });
    return found;
  }
}
