// The replay page of one run or two runs: connects its parts and redraws them.

/** The state that the parts of the page share. */
class Page {
  constructor(runs) {
    this.runs = runs;
    /** The run shown in the side panel. */
    this.run = runs[0];
    this.clock = new Clock(runs.map((run) => run.replayData));
    this.stale = true;
    this.views3d = runs.map((run) => new View3d(run, this));
    /** Whether the scenes are shown in three dimensions. */
    this.is3d = false;
  }

  /** Shows the scenes in three dimensions, or the maps. */
  async show3d(is3d) {
    if (is3d && !hasWebGl()) {
      element("search-result").replaceChildren("This browser has no WebGL, which the view in three dimensions needs");
      return;
    }
    this.is3d = is3d;
    for (const view of this.views3d) view.show(is3d);
    element("view-3d").setAttribute("aria-pressed", String(is3d));
    for (const id of ["map-svg", "map-video"]) element(id).disabled = is3d;
    this.renew();
    // The chart script may not be loaded yet.
    if (is3d && !window.Plotly) await this.runs[0].source.charts();
    this.renew();
  }

  /** Shows a run in the side panel. */
  show(run) {
    if (run === this.run) return;
    const before = this.run;
    this.run = run;
    this.pair.shown(before);
    follows(this);
    updateAgentSelection(this);
    this.selection.notify();
    this.timeline.renew();
    this.problems.show();
    this.charts.draw();
  }

  /** Shows the team state of a UAV; `null` selects the UAV of lowest id whose computer is on. */
  chooseAgent(uav) {
    this.replayData.agents.choose(uav);
    updateAgentSelection(this);
    this.timeline.renew();
    this.renew();
  }

  get replayData() {
    return this.run.replayData;
  }

  get selection() {
    return this.run.selection;
  }

  get map() {
    return this.run.map;
  }

  /** Redraws everything in the next frame. */
  renew() {
    this.stale = true;
  }
}

/** Shows the results of the runs that have ended. */
function showResults(page) {
  showOutcome(page);
  page.problems.show();
}

/** Loads runs and shows them on the page. */
async function showReplay(sources) {
  const heads = await Promise.all(sources.map((source) => source.head()));
  const maps = canvases(sources.length);
  const page = new Page(sources.map((source, index) => new Run(source, heads[index], maps[index], index)));
  title(page.runs);
  page.timeline = new Timeline(page);
  page.state = new State(page);
  page.charts = new Charts(page);
  page.link = new Link(page);
  page.viewHistory = new ViewHistory(page);
  page.layerMenu = new LayerMenu(page);
  page.legend = new MapLegend(page);
  page.problems = new Problems(page);
  showResults(page);
  connect(page);
  for (const { replayData, selection, map } of page.runs) {
    map.renew = () => page.renew();
    replayData.loaded = () => page.renew();
    selection.on(() => page.renew());
  }
  page.clock.on(() => {
    page.renew();
    controls(page);
  });
  themed(() => {
    page.renew();
    page.timeline.renew();
    page.charts.renew();
  });
  connectPrint(page);
  new ResizeObserver(() => {
    for (const { map } of page.runs) map.cover();
    page.renew();
  }).observe(document.querySelector(".tools"));
  page.pair = page.runs.length > 1 ? new CompareView(page) : null;
  drawFrames(page);
  const drawCharts = drawsCharts(page);
  for (const run of page.runs) {
    load(page, run, drawCharts);
    run.map.basemap?.load(run.source, () => page.renew());
  }
}

/** Draws a frame whenever something has changed, at most at the frame rate of the browser. */
function drawFrames(page) {
  const { clock, timeline, charts, state } = page;
  let tables_ms = -Infinity;
  const drawFrame = (now_ms) => {
    clock.tick(now_ms);
    for (const run of page.runs) {
      run.note(now_ms, clock.following);
      if (run.map.resize()) page.renew();
    }
    if (page.stale && page.runs.every(({ replayData }) => replayData.times_s.length)) {
      page.stale = false;
      const scenes = page.runs.map((run) => (run.map.scene = run.scene(clock.time_s)));
      // The map whose view the others copy is drawn first.
      for (const run of [page.run, ...page.runs.filter((run) => run !== page.run)]) run.draw(scenes[page.runs.indexOf(run)]);
      page.video.frame();
      if (page.is3d) page.views3d.forEach((view, k) => view.draw(scenes[k]));
      page.runs.forEach(({ map }, k) => map.showLoading(scenes[k].targets ? "" : `Loading targets at ${page.clock.time_s.toFixed(1)} s`));
      page.layerMenu.show();
      page.legend.show();
      showRuler(page);
      if (page.runs.some(({ map }) => !map.leader && !map.view.isSettled)) page.renew();
      state.setMissing([...new Set(page.runs.map((run, index) => run.missingText(scenes[index], now_ms)))]);
      charts.follow();
      timeline.follow();
      state.showTime(clock.time_s);
      updateAutoOption(page);
      // Tables are updated five times per second during playback, and in every frame while the time is paused.
      if (!clock.playing || now_ms - tables_ms > 200) {
        tables_ms = now_ms;
        page.runs.forEach(({ map, replayData, cards }, index) => {
          map.canvas.setAttribute("aria-label", summary(replayData, scenes[index]));
          cards.show();
        });
        state.show(scenes);
        page.pair?.update();
      }
      document.body.dataset.frames = Number(document.body.dataset.frames ?? 0) + 1;
    }
    page.viewHistory.note(now_ms);
    requestAnimationFrame(drawFrame);
  };
  requestAnimationFrame(drawFrame);
}

/** Returns a function that draws the charts, at most once per second while data is loading. The first call loads the chart script. */
function drawsCharts(page) {
  let drawn_ms = -Infinity;
  let drawing = null;
  let isDrawn = false;
  const draw = async () => {
    if (!window.Plotly) {
      // The chart script is large, so the map is drawn first.
      await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
      await page.runs[0].source.charts();
    }
    while (!isDrawn && (page.clock.done || performance.now() - drawn_ms > 1000)) {
      isDrawn = true;
      drawn_ms = performance.now();
      await page.charts.draw();
      document.body.dataset.ready = "charts";
    }
  };
  return () => {
    isDrawn = false;
    drawing ??= draw()
      .then(() => page.state.setError(""))
      .catch((error) => page.state.setError(`Cannot draw the charts: ${error.message}`))
      .finally(() => (drawing = null));
  };
}

/** Loads a run, and updates the page when data arrives. */
function load(page, run, drawCharts) {
  run.load({
    onFirstBlock: () => begin(page),
    onComplete: () => showResults(page),
    onData: () => {
      page.renew();
      page.timeline.renew();
      follows(page);
      filters(page);
      updateAgentSelection(page);
      controls(page);
      if (!page.replayData.parts.length) return;
      run.isBegun = true;
      if (!page.isOpened && page.runs.every(({ isBegun }) => isBegun)) {
        page.isOpened = true;
        page.link.open();
      }
      // Charts are slow to draw; the rest of the page does not wait for them.
      drawCharts();
    },
    onError: (text) => page.state.setError(text, run),
  });
}

/** Sets the initial time: the start, or the newest time step of a running mission. */
function begin({ clock, replayData, runs, pair }) {
  if (!runs.every((run) => run.replayData.times_s.length)) return;
  pair?.begin();
  clock.seek(replayData.times_s[0]);
  if (replayData.head.live) clock.follow();
  document.body.dataset.ready = "map";
}

/** The name of a run. */
function runName(head) {
  return `${head.scenario}, seed ${head.seed}${head.unfinished ? ", unfinished" : ""}`;
}

/** Maximum number of settings in the name of a run. */
const MAX_CHANGES = 3;

/** The name of one of two runs, with the settings that differ from those of the other run. */
function longRunName({ letter, replayData: { head } }) {
  const { changes = [] } = head;
  const more = changes.length > MAX_CHANGES ? [`and ${changes.length - MAX_CHANGES} more`] : [];
  return [`${letter}: ${runName(head)}`, ...changes.slice(0, MAX_CHANGES), ...more].join(", ");
}

/** Sets the title of the page, with a line for each of two runs, and below it the descriptions of the scenarios. */
function title(runs) {
  const heads = runs.map(({ replayData }) => replayData.head);
  document.title = `${heads.map(runName).join(" | ")} \u2013 standoff`;
  const names = runs.length > 1 ? runs.map(longRunName) : heads.map(runName);
  element("title").replaceChildren(...names.map((name, k) => {
    const line = make("span");
    line.textContent = name;
    line.title = [name, ...(heads[k].changes ?? []).slice(MAX_CHANGES)].join("\n");
    return line;
  }));
  const about = element("about");
  about.textContent = about.title = [...new Set(heads.map(({ about }) => about))].filter(Boolean).join(" | ");
  about.hidden = !about.textContent;
}

/** Description of the map for screen readers. */
function summary(replayData, scene) {
  const count = (n, noun) => `${n} ${noun}${n === 1 ? "" : "s"}`;
  const targets = scene.targets ?? [];
  const outOfView = targets.filter((target) => target.out_of_view).length;
  return (
    `Map at ${scene.time_s.toFixed(1)} seconds: ${count(scene.uavs.length, "UAV")}, ${count(scene.groups.length, "group")}, ` +
    `${count(targets.length, "target")}, ${outOfView ? `${outOfView} out of view` : "none out of view"}` +
    (scene.intruders.length ? `, ${count(scene.intruders.length, "intruder")}` : "") +
    (replayData.agents.isSeveral ? `; ${teamStateText(replayData, replayData.stepAt(scene.time_s))}` : "")
  );
}
