// A run on the page: its loaded data, its map, and its selection.

class Run {
  constructor(source, head, canvas, index) {
    /** Label that distinguishes the runs of a pair. */
    this.letter = "AB"[index];
    this.source = source;
    this.replayData = new ReplayData(source, head);
    this.selection = new Selection();
    this.map = new MissionMap(canvas, this.replayData, this.selection);
    this.cards = new InfoCards(this, canvas);
    /** Number of complete parts, and number of time steps of the growing part: as announced by the source, and as loaded. */
    this.announced = { sealed: 0, open: 0, done: false };
    this.taken = { sealed: 0, open: 0 };
    /** When the page last had all data, and the last text about its delay with the time of that text. */
    this.whole_ms = -Infinity;
    this.late = { words: "", at_ms: -Infinity };
  }

  /** The scene at a time. */
  scene(time_s) {
    const { replayData } = this;
    const [uavs, targets] = [uavsAt(replayData, time_s), targetsAt(replayData, time_s)];
    return { time_s, uavs, groups: groupsAt(replayData, time_s), intruders: intrudersAt(replayData, time_s, uavs), targets, ...shownTimes(replayData, time_s) };
  }

  /** Draws the map; data attributes contain the times of the UAVs and the targets. */
  draw(scene) {
    this.map.draw(scene);
    const text = (time_s) => time_s?.toFixed(3) ?? "";
    Object.assign(this.map.canvas.dataset, { uavsS: text(scene.uavs_s), targetsS: text(scene.targets_s) });
  }

  /** Whether announced data is not loaded yet. */
  get isBehind() {
    const { announced, taken } = this;
    return taken.sealed < announced.sealed || taken.open !== announced.open;
  }

  /** Called for every drawn frame: records whether the page has all data, and whether the newest time step is shown. */
  note(now_ms, isFollowed) {
    const { replayData } = this;
    replayData.followed = isFollowed;
    if (!this.isBehind && replayData.shown_end_s >= replayData.end_s) this.whole_ms = now_ms;
  }

  /** Text about missing data in a scene; empty if nothing is missing. Delays of up to one second are not reported. */
  missingText(scene, now_ms) {
    const { replayData, late } = this;
    const behind_s = replayData.end_s - scene.time_s;
    if (!replayData.followed || now_ms - this.whole_ms < 1000 || behind_s <= replayData.head.period_s) late.words = "";
    else if (!late.words || now_ms - late.at_ms > 1000) {
      const bound = this.taken.sealed < this.announced.sealed ? "more than " : "";
      this.late = { words: `catching up: ${bound}${Math.ceil(behind_s)} s behind`, at_ms: now_ms };
    }
    return [this.late.words, scene.targets === null ? "loading targets" : ""].filter(Boolean).join(", ");
  }

  /**
   * Loads the existing and all future parts. Callbacks: `begun` (the first part is loaded), `changed` (more data is loaded),
   * `whole` (all data is loaded) and `trouble` (an error text; empty when the error is over).
   */
  load({ begun, changed, whole, trouble }) {
    const { replayData, source } = this;
    let loading = false;
    let again;
    const pause_ms = 2000;
    const more = async () => {
      if (loading) return;
      loading = true;
      try {
        while (this.isBehind) {
          const { sealed } = this.taken;
          const isSealed = sealed < this.announced.sealed;
          const open = isSealed ? 0 : this.announced.open;
          if (isSealed || open > 0) {
            const isFirst = replayData.parts.length === 0;
            replayData.put(sealed, await source.half("overview", sealed));
            if (isFirst) begun();
          }
          this.taken = { sealed: isSealed ? sealed + 1 : sealed, open };
        }
        if (this.announced.done && !replayData.done) {
          replayData.head = await source.head();
          replayData.done = true;
          whole();
        }
        trouble("");
        changed();
      } catch (error) {
        trouble(`Cannot read the data: ${error.message}`);
        loading = false;
        // Only data from a server is requested again: data inside a file does not change.
        clearTimeout(again);
        if (source.live) again = setTimeout(more, pause_ms);
        return;
      }
      loading = false;
      if (this.isBehind || (this.announced.done && !replayData.done)) more();
    };
    const announce = (state) => {
      // The server at this address now serves another run.
      if (this.announced.run !== undefined && this.announced.run !== state.run) {
        location.reload();
        return;
      }
      this.announced = state;
      trouble("");
      more();
    };
    source.follow(announce, () => trouble("No connection to the standoff server; retrying"));
  }
}
