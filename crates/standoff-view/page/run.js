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
    this.loaded = { sealed: 0, open: 0 };
    /** When the page last had all data, and the last text about its delay with the time of that text. */
    this.complete_ms = -Infinity;
    this.delay = { text: "", at_ms: -Infinity };
  }

  /** The scene at a time. */
  scene(time_s) {
    const { replayData } = this;
    const [uavs, targets] = [uavsAt(replayData, time_s), targetsAt(replayData, time_s)];
    return {
      time_s, uavs, groups: groupsAt(replayData, time_s), intruders: intrudersAt(replayData, time_s, uavs), targets,
      detections: detectionsAt(replayData, time_s), tentatives: tentativeAt(replayData, time_s), ...shownTimes(replayData, time_s),
    };
  }

  /** Draws the map; data attributes contain the times of the UAVs and the targets. */
  draw(scene) {
    this.map.draw(scene);
    const text = (time_s) => time_s?.toFixed(3) ?? "";
    Object.assign(this.map.canvas.dataset, { uavsS: text(scene.uavs_s), targetsS: text(scene.targets_s) });
  }

  /** Whether announced data is not loaded yet. */
  get isBehind() {
    const { announced, loaded } = this;
    return loaded.sealed < announced.sealed || loaded.open !== announced.open;
  }

  /** Called for every drawn frame: records whether the page has all data, and whether the newest time step is shown. */
  note(now_ms, isFollowed) {
    const { replayData } = this;
    replayData.followed = isFollowed;
    if (!this.isBehind && replayData.shown_end_s >= replayData.end_s) this.complete_ms = now_ms;
  }

  /** Text about missing data in a scene; empty if nothing is missing. Delays of up to one second are not reported. */
  missingText(scene, now_ms) {
    const { replayData, delay } = this;
    const behind_s = replayData.end_s - scene.time_s;
    if (!replayData.followed || now_ms - this.complete_ms < 1000 || behind_s <= replayData.head.period_s) delay.text = "";
    else if (!delay.text || now_ms - delay.at_ms > 1000) {
      const bound = this.loaded.sealed < this.announced.sealed ? "more than " : "";
      this.delay = { text: `catching up: ${bound}${Math.ceil(behind_s)} s behind`, at_ms: now_ms };
    }
    return [this.delay.text, scene.targets === null ? "loading targets" : ""].filter(Boolean).join(", ");
  }

  /**
   * Loads the existing and all future parts. Callbacks: `onFirstBlock` (the first part is loaded), `onData` (more data is loaded),
   * `onComplete` (all data is loaded) and `onError` (an error text; empty when the error is over).
   */
  load({ onFirstBlock, onData, onComplete, onError }) {
    const { replayData, source } = this;
    let loading = false;
    let again;
    const pause_ms = 2000;
    const more = async () => {
      if (loading) return;
      loading = true;
      try {
        while (this.isBehind) {
          const { sealed } = this.loaded;
          const isSealed = sealed < this.announced.sealed;
          const open = isSealed ? 0 : this.announced.open;
          if (isSealed || open > 0) {
            const isFirst = replayData.parts.length === 0;
            replayData.put(sealed, await source.block("overview", sealed));
            if (isFirst) onFirstBlock();
          }
          this.loaded = { sealed: isSealed ? sealed + 1 : sealed, open };
        }
        if (this.announced.done && !replayData.done) {
          replayData.head = await source.head();
          replayData.done = true;
          onComplete();
        }
        onError("");
        onData();
      } catch (error) {
        onError(`Cannot read the data: ${error.message}`);
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
      onError("");
      more();
    };
    source.follow(announce, () => onError("No connection to the standoff server; retrying"));
  }
}
