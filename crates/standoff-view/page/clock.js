// Time of the mission as it is shown: playing, paused, or following a run that is still being flown.

class Clock {
  static SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16, 32];

  /** Of one film, or of several that are shown at one time. */
  constructor(films) {
    this.films = films;
    this.time_s = 0;
    this.speed = 1;
    this.playing = false;
    /** Stays at the newest instant. */
    this.following = false;
    this.last_ms = null;
    this.listeners = [];
  }

  /** The film that lasts longest. */
  get film() {
    return this.films.reduce((longest, film) => (film.end_s > longest.end_s ? film : longest));
  }

  /** All there will be is there. */
  get done() {
    return this.films.every((film) => film.done);
  }

  on(listener) {
    this.listeners.push(listener);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }

  seek(time_s) {
    this.following = false;
    this.time_s = Math.min(Math.max(time_s, this.film.times_s[0] ?? 0), this.film.end_s);
    this.tell();
  }

  /** Moves by whole instants. */
  step(instants) {
    const last = this.film.times_s.length - 1;
    if (last < 0) return;
    const instant = Math.min(Math.max(this.film.instant(this.time_s) + instants, 0), last);
    this.pause();
    this.seek(this.film.times_s[instant]);
  }

  play() {
    if (this.done && this.time_s >= this.film.end_s) this.time_s = this.film.times_s[0] ?? 0;
    this.playing = true;
    this.last_ms = null;
    this.tell();
  }

  pause() {
    this.playing = false;
    this.following = false;
    this.tell();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  follow() {
    this.playing = true;
    this.following = true;
    this.last_ms = null;
    this.tell();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.tell();
  }

  faster(places) {
    const index = Clock.SPEEDS.indexOf(this.speed) + places;
    this.setSpeed(Clock.SPEEDS[Math.min(Math.max(index, 0), Clock.SPEEDS.length - 1)]);
  }

  /**
   * Follows the newest instant of which everything is there, the faster the further behind it is; jumps if it is far
   * behind, or if something on the way is not there.
   */
  glide(passed_s) {
    const { film } = this;
    const end_s = film.shown_end_s;
    const behind_s = end_s - this.time_s;
    if (!(behind_s > 0)) return;
    const { period_s } = film.head;
    const from_s = behind_s > 20 * period_s ? Math.max(end_s - period_s, this.time_s) : this.time_s;
    const next_s = Math.min(from_s + passed_s * Math.max(1, 4 * behind_s), end_s);
    this.time_s = film.isWhole(next_s) ? next_s : end_s;
  }

  /** Moves on to the time of a picture; says whether anything moved. */
  tick(now_ms) {
    const passed_s = this.last_ms === null ? 0 : Math.min((now_ms - this.last_ms) / 1000, 0.25);
    this.last_ms = now_ms;
    if (!this.playing) return false;
    const before_s = this.time_s;
    if (this.following) this.glide(passed_s);
    else this.time_s = Math.min(this.time_s + passed_s * this.speed, this.film.end_s);
    // Who has caught up with a run that is being flown stays at its newest instant.
    if (!this.done && !this.following && this.time_s >= this.film.end_s) this.follow();
    if (this.done && this.time_s >= this.film.end_s) this.pause();
    if (this.time_s !== before_s) this.tell();
    return this.time_s !== before_s;
  }
}
