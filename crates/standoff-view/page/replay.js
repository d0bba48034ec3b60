// The page of a run, or of two: what is shown, and when it is shown anew.

/** What the parts of the page share. */
class Page {
  constructor(runs) {
    this.runs = runs;
    /** The run that stands beside the map. */
    this.run = runs[0];
    this.clock = new Clock(runs.map((run) => run.film));
    this.stale = true;
  }

  /** Puts a run beside the maps. */
  show(run) {
    if (run === this.run) return;
    const before = this.run;
    this.run = run;
    this.pair.shown(before);
    follows(this);
    pictureOf(this);
    this.choice.tell();
    this.timeline.renew();
    this.charts.draw();
  }

  /** Shows the picture of a UAV; with `null` that of the one of lowest id whose computer is on. */
  choosePicture(uav) {
    this.film.minds.choose(uav);
    pictureOf(this);
    this.timeline.renew();
    this.renew();
  }

  get film() {
    return this.run.film;
  }

  get choice() {
    return this.run.choice;
  }

  get map() {
    return this.run.map;
  }

  /** With the next picture, shows everything anew. */
  renew() {
    this.stale = true;
  }
}

/** Brings runs to the page. */
async function showReplay(sources) {
  const heads = await Promise.all(sources.map((source) => source.head()));
  const maps = canvases(sources.length);
  const page = new Page(sources.map((source, index) => new Run(source, heads[index], maps[index], index)));
  title(page.runs);
  page.timeline = new Timeline(page);
  page.state = new State(page);
  page.charts = new Charts(page);
  page.link = new Link(page);
  showOutcome(page);
  connect(page);
  for (const { film, choice } of page.runs) {
    film.loaded = () => page.renew();
    choice.on(() => page.renew());
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
  new ResizeObserver(() => {
    for (const { map } of page.runs) map.cover();
    page.renew();
  }).observe(document.querySelector(".tools"));
  page.pair = page.runs.length > 1 ? new Pair(page) : null;
  pictures(page);
  const drawCharts = drawsCharts(page);
  for (const run of page.runs) {
    load(page, run, drawCharts);
    run.map.underlay?.load(run.source, () => page.renew());
  }
}

/** Draws pictures, as often as anything has changed and the browser allows. */
function pictures(page) {
  const { clock, timeline, charts, state } = page;
  let told_ms = -Infinity;
  const picture = (now_ms) => {
    clock.tick(now_ms);
    for (const run of page.runs) {
      run.note(now_ms, clock.following);
      if (run.map.resize()) page.renew();
    }
    if (page.stale && page.runs.every(({ film }) => film.times_s.length)) {
      page.stale = false;
      const scenes = page.runs.map((run) => run.scene(clock.time_s));
      // The map that others follow comes first.
      for (const run of [page.run, ...page.runs.filter((run) => run !== page.run)]) run.draw(scenes[page.runs.indexOf(run)]);
      if (page.runs.some(({ map }) => !map.leader && !map.view.isSettled)) page.renew();
      state.lacks([...new Set(page.runs.map((run, index) => run.lacks(scenes[index], now_ms)))]);
      charts.follow();
      timeline.follow();
      state.tell(clock.time_s);
      tellPicture(page);
      // Tables are for reading: a few times a second, and always when time stands still.
      if (!clock.playing || now_ms - told_ms > 200) {
        told_ms = now_ms;
        page.runs.forEach(({ map, film, cards }, index) => {
          map.canvas.setAttribute("aria-label", summary(film, scenes[index]));
          cards.show();
        });
        state.show(scenes[page.runs.indexOf(page.run)]);
        page.pair?.tell();
      }
      document.body.dataset.pictures = Number(document.body.dataset.pictures ?? 0) + 1;
    }
    requestAnimationFrame(picture);
  };
  requestAnimationFrame(picture);
}

/** What draws the charts, at most once a second while there comes more; their script comes first, once. */
function drawsCharts(page) {
  let drawn_ms = -Infinity;
  let drawing = null;
  let isDrawn = false;
  const draw = async () => {
    if (!window.Plotly) {
      // The charts' script is large: first the map.
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
      .then(() => page.state.trouble(""))
      .catch((error) => page.state.trouble(`The charts could not be drawn: ${error.message}`))
      .finally(() => (drawing = null));
  };
}

/** Loads a run, and shows what has come. */
function load(page, run, drawCharts) {
  run.load({
    begun: () => begin(page),
    whole: () => showOutcome(page),
    changed: () => {
      page.renew();
      page.timeline.renew();
      follows(page);
      filters(page);
      pictureOf(page);
      controls(page);
      if (!page.film.parts.length) return;
      run.isBegun = true;
      if (!page.isOpened && page.runs.every(({ isBegun }) => isBegun)) {
        page.isOpened = true;
        page.link.open();
      }
      // Charts take long; what else there is does not wait for them.
      drawCharts();
    },
    trouble: (words) => page.state.trouble(words, run),
  });
}

/** The first picture: of the start, or of the newest instant of a run that is being flown. */
function begin({ clock, film, runs, pair }) {
  if (!runs.every((run) => run.film.times_s.length)) return;
  pair?.begin();
  clock.seek(film.times_s[0]);
  if (film.head.live) clock.follow();
  document.body.dataset.ready = "map";
}

/** A run in words. */
function runName(head) {
  return `${head.scenario}, seed ${head.seed}${head.unfinished ? ", unfinished" : ""}`;
}

function title(runs) {
  const names = runs.map((run) => runName(run.film.head)).join(" | ");
  document.title = `${names} \u2013 standoff`;
  element("title").textContent = names;
}

/** What the map shows, in a sentence. */
function summary(film, scene) {
  const count = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  const targets = scene.targets ?? [];
  const lost = targets.filter((target) => target.out_of_view).length;
  return (
    `Map at ${scene.time_s.toFixed(1)} seconds: ${count(scene.uavs.length, "UAV")}, ${count(scene.groups.length, "group")}, ` +
    `${count(targets.length, "target")}, ${lost ? `${lost} out of view` : "none out of view"}` +
    (scene.intruders.length ? `, ${count(scene.intruders.length, "intruder")}` : "") +
    (film.minds.isSeveral ? `; ${pictureWords(film, film.instant(scene.time_s))}` : "")
  );
}
