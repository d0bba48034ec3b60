// A run on the page: its data as far as it has been loaded, its map, and what is chosen of it.

class Run {
  constructor(source, head, canvas, index) {
    /** What tells it from the other one of two. */
    this.letter = "AB"[index];
    this.source = source;
    this.film = new Film(source, head);
    this.choice = new Choice();
    this.map = new MissionMap(canvas, this.film, this.choice);
    this.cards = new Cards(this, canvas);
    /** How many parts there are that will not change any more, of how many instants the one after them is: told, and taken in. */
    this.told = { sealed: 0, open: 0, done: false };
    this.taken = { sealed: 0, open: 0 };
    /** When the page last had all that there was, and what it said of being late, and when. */
    this.whole_ms = -Infinity;
    this.late = { words: "", at_ms: -Infinity };
  }

  /** What there is at a time. */
  scene(time_s) {
    const { film } = this;
    const [uavs, targets] = [uavsAt(film, time_s), targetsAt(film, time_s)];
    return { time_s, uavs, groups: groupsAt(film, time_s), intruders: intrudersAt(film, time_s, uavs), targets, ...shownTimes(film, time_s) };
  }

  /** Draws the map; of which times its UAVs and its targets are stands there as text, too. */
  draw(scene) {
    this.map.draw(scene);
    const text = (time_s) => time_s?.toFixed(3) ?? "";
    Object.assign(this.map.canvas.dataset, { uavsS: text(scene.uavs_s), targetsS: text(scene.targets_s) });
  }

  get isBehind() {
    const { told, taken } = this;
    return taken.sealed < told.sealed || taken.open !== told.open;
  }

  /** Notes at every picture whether the page keeps up, and whether the newest instant is looked at. */
  note(now_ms, isFollowed) {
    const { film } = this;
    film.followed = isFollowed;
    if (!this.isBehind && film.shown_end_s >= film.end_s) this.whole_ms = now_ms;
  }

  /** What is missing in a picture, in words; nothing if all is well. Who keeps up within a second is not behind. */
  lacks(scene, now_ms) {
    const { film, late } = this;
    const behind_s = film.end_s - scene.time_s;
    if (!film.followed || now_ms - this.whole_ms < 1000 || behind_s <= film.head.period_s) late.words = "";
    else if (!late.words || now_ms - late.at_ms > 1000) {
      const least = this.taken.sealed < this.told.sealed ? "more than " : "";
      this.late = { words: `catching up: ${least}${Math.ceil(behind_s)} s behind`, at_ms: now_ms };
    }
    return [this.late.words, scene.targets === null ? "loading targets" : ""].filter(Boolean).join(", ");
  }

  /**
   * Loads the parts that there are, and those that come. Told are: `begun` (the first part is there), `changed` (there is
   * more), `whole` (that was all) and `trouble` (in words; none, once it is over).
   */
  load({ begun, changed, whole, trouble }) {
    const { film, source } = this;
    let loading = false;
    let again;
    const pause_ms = 2000;
    const more = async () => {
      if (loading) return;
      loading = true;
      try {
        while (this.isBehind) {
          const { sealed } = this.taken;
          const isSealed = sealed < this.told.sealed;
          const open = isSealed ? 0 : this.told.open;
          if (isSealed || open > 0) {
            const isFirst = film.parts.length === 0;
            film.put(sealed, await source.half("overview", sealed));
            if (isFirst) begun();
          }
          this.taken = { sealed: isSealed ? sealed + 1 : sealed, open };
        }
        if (this.told.done && !film.done) {
          film.head = await source.head();
          film.done = true;
          whole();
        }
        trouble("");
        changed();
      } catch (error) {
        trouble(`The data could not be read: ${error.message}`);
        loading = false;
        // What is inside a file will not become better.
        clearTimeout(again);
        if (source.live) again = setTimeout(more, pause_ms);
        return;
      }
      loading = false;
      if (this.isBehind || (this.told.done && !film.done)) more();
    };
    const told = (now) => {
      // Another run is served at the same address by now.
      if (this.told.run !== undefined && this.told.run !== now.run) {
        location.reload();
        return;
      }
      this.told = now;
      trouble("");
      more();
    };
    source.follow(told, () => trouble("No connection to standoff; trying again"));
  }
}
