// A run on the page: its data as far as it has been loaded, its map, and what is chosen of it.

class Run {
  constructor(source, head, canvas, index) {
    /** What tells it from the other one of two. */
    this.letter = "AB"[index];
    this.source = source;
    this.film = new Film(source, head);
    this.choice = new Choice();
    this.map = new MissionMap(canvas, this.film, this.choice);
  }

  /** What there is at a time. */
  scene(time_s) {
    const { film } = this;
    return { time_s, uavs: uavsAt(film, time_s), groups: groupsAt(film, time_s), targets: targetsAt(film, time_s) };
  }

  /**
   * Loads the parts that there are, and those that come. Told are: `begun` (the first part is there), `changed` (there is
   * more), `whole` (that was all) and `trouble` (in words; none, once it is over).
   */
  load({ begun, changed, whole, trouble }) {
    const { film, source } = this;
    let state = { sealed: 0, open: 0, done: false };
    // Parts loaded for good, and how much of the one after them.
    let [sealed, open] = [0, 0];
    let loading = false;
    let again;
    const isBehind = () => sealed < state.sealed || open !== state.open;
    const pause_ms = 2000;
    const more = async () => {
      if (loading) return;
      loading = true;
      try {
        while (isBehind()) {
          const isSealed = sealed < state.sealed;
          if (isSealed || state.open > 0) {
            const isFirst = film.parts.length === 0;
            film.put(sealed, await source.half("overview", sealed));
            if (isFirst) begun();
          }
          [sealed, open] = isSealed ? [sealed + 1, 0] : [sealed, state.open];
        }
        if (state.done && !film.done) {
          film.done = true;
          film.head = await source.head();
          whole();
        }
        await changed();
        trouble("");
      } catch (error) {
        trouble(`The data could not be read: ${error.message}`);
        loading = false;
        // What is inside a file will not become better.
        clearTimeout(again);
        if (source.live) again = setTimeout(more, pause_ms);
        return;
      }
      loading = false;
      if (isBehind() || (state.done && !film.done)) more();
    };
    const told = (now) => {
      // Another run is served at the same address by now.
      if (state.run !== undefined && state.run !== now.run) {
        location.reload();
        return;
      }
      state = now;
      trouble("");
      more();
    };
    source.follow(told, () => trouble("No connection to standoff; trying again"));
  }
}
