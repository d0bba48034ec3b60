// The mission time shown on the page: playing, paused, or following a running mission.

class Clock {
  static SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16, 32];

  /** Creates the clock of one replay, or of several replays that are shown at the same time. */
  constructor(replays) {
    this.replays = replays;
    this.time_s = 0;
    this.speed = 1;
    this.playing = false;
    /** Whether the clock stays at the newest time step. */
    this.following = false;
    this.last_ms = null;
    this.listeners = [];
  }

  /** The longest replay. */
  get replayData() {
    return this.replays.reduce((longest, replayData) => (replayData.end_s > longest.end_s ? replayData : longest));
  }

  /** Whether all runs have ended and are loaded. */
  get done() {
    return this.replays.every((replayData) => replayData.done);
  }

  on(listener) {
    this.listeners.push(listener);
  }

  /** Notifies the listeners of a change. */
  notify() {
    for (const listener of this.listeners) listener(this);
  }

  /** Goes to a time, limited to the loaded range. */
  seek(time_s) {
    this.following = false;
    this.time_s = Math.min(Math.max(time_s, this.replayData.times_s[0] ?? 0), this.replayData.end_s);
    this.notify();
  }

  /** Moves by a number of time steps, and pauses. */
  step(count) {
    const last = this.replayData.times_s.length - 1;
    if (last < 0) return;
    const stepIndex = Math.min(Math.max(this.replayData.stepAt(this.time_s) + count, 0), last);
    this.pause();
    this.seek(this.replayData.times_s[stepIndex]);
  }

  play() {
    if (this.done && this.time_s >= this.replayData.end_s) this.time_s = this.replayData.times_s[0] ?? 0;
    this.playing = true;
    this.last_ms = null;
    this.notify();
  }

  pause() {
    this.playing = false;
    this.following = false;
    this.notify();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Follows the newest time step of a running mission. */
  follow() {
    this.playing = true;
    this.following = true;
    this.last_ms = null;
    this.notify();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.notify();
  }

  faster(count) {
    const index = Clock.SPEEDS.indexOf(this.speed) + count;
    this.setSpeed(Clock.SPEEDS[Math.min(Math.max(index, 0), Clock.SPEEDS.length - 1)]);
  }

  /**
   * Moves towards the newest time step whose data is complete, faster if the clock is further behind. Jumps if the clock is far
   * behind, or if data on the way is missing.
   */
  glide(passed_s) {
    const { replayData } = this;
    const end_s = replayData.shown_end_s;
    const behind_s = end_s - this.time_s;
    if (!(behind_s > 0)) return;
    const { period_s } = replayData.head;
    const from_s = behind_s > 20 * period_s ? Math.max(end_s - period_s, this.time_s) : this.time_s;
    const next_s = Math.min(from_s + passed_s * Math.max(1, 4 * behind_s), end_s);
    this.time_s = replayData.isWhole(next_s) ? next_s : end_s;
  }

  /** Advances the clock to the time of a drawn frame; returns whether the mission time has changed. */
  tick(now_ms) {
    const passed_s = this.last_ms === null ? 0 : Math.min((now_ms - this.last_ms) / 1000, 0.25);
    this.last_ms = now_ms;
    if (!this.playing) return false;
    const before_s = this.time_s;
    if (this.following) this.glide(passed_s);
    else this.time_s = Math.min(this.time_s + passed_s * this.speed, this.replayData.end_s);
    // Playback that has reached the newest time step of a running mission follows it from there.
    if (!this.done && !this.following && this.time_s >= this.replayData.end_s) this.follow();
    if (this.done && this.time_s >= this.replayData.end_s) this.pause();
    if (this.time_s !== before_s) this.notify();
    return this.time_s !== before_s;
  }
}
