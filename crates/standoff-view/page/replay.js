// The page of a run: what is shown, and when it is shown anew.

/** What the parts of the page share. */
class Page {
  constructor(runs) {
    this.runs = runs;
    /** The run that stands beside the map. */
    this.run = runs[0];
    this.clock = new Clock(this.run.film);
    this.stale = true;
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

/** Brings a run to the page. */
async function showReplay(source) {
  const run = new Run(source, await source.head(), element("map"));
  title(run.film.head);
  const page = new Page([run]);
  page.timeline = new Timeline(page);
  page.state = new State(page);
  page.charts = new Charts(page);
  showOutcome(element("outcome").tBodies[0], run.film.head.outcome);
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
  window.addEventListener("resize", () => page.timeline.renew());
  pictures(page);
  load(page, run);
}

/** Draws pictures, as often as anything has changed and the browser allows. */
function pictures(page) {
  const { clock, timeline, charts, state } = page;
  let told_ms = -Infinity;
  const picture = (now_ms) => {
    clock.tick(now_ms);
    for (const { map } of page.runs) if (map.resize()) page.renew();
    if (page.stale && page.film.times_s.length) {
      page.stale = false;
      const scenes = page.runs.map((run) => run.scene(clock.time_s));
      page.runs.forEach(({ map }, index) => map.draw(scenes[index]));
      charts.follow();
      timeline.follow();
      // Tables are for reading: a few times a second, and always when time stands still.
      if (!clock.playing || now_ms - told_ms > 200) {
        told_ms = now_ms;
        page.runs.forEach(({ map, film }, index) => map.canvas.setAttribute("aria-label", summary(film, scenes[index])));
        state.show(scenes[page.runs.indexOf(page.run)]);
      }
      document.body.dataset.pictures = Number(document.body.dataset.pictures ?? 0) + 1;
    }
    requestAnimationFrame(picture);
  };
  requestAnimationFrame(picture);
}

/** Loads a run, and shows what has come. */
function load(page, run) {
  const { film, source } = run;
  let drawn_ms = 0;
  run.load({
    begun: () => begin(page),
    whole: () => showOutcome(element("outcome").tBodies[0], film.head.outcome),
    changed: async () => {
      page.renew();
      page.timeline.renew();
      follows(page);
      controls(page);
      if (!window.Plotly && film.parts.length) {
        // The charts' script is large: first the map.
        await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
        await source.charts();
      }
      if (window.Plotly && (film.done || performance.now() - drawn_ms > 1000)) {
        drawn_ms = performance.now();
        await page.charts.draw();
        document.body.dataset.ready = "charts";
      }
    },
    trouble: (words) => page.state.trouble(words),
  });
}

/** The first picture: of the start, or of the newest instant of a run that is being flown. */
function begin({ clock, film }) {
  clock.seek(film.times_s[0]);
  if (film.head.live) clock.follow();
  document.body.dataset.ready = "map";
}

function title(head) {
  const name = `${head.scenario}, seed ${head.seed}${head.unfinished ? ", unfinished" : ""}`;
  document.title = `${name} \u2013 standoff`;
  element("title").textContent = name;
}

/** What the map shows, in a sentence. */
function summary(film, scene) {
  const count = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  const targets = scene.targets ?? [];
  const lost = targets.filter((target) => target.out_of_view).length;
  return (
    `Map at ${scene.time_s.toFixed(1)} seconds: ${count(scene.uavs.length, "UAV")}, ${count(scene.groups.length, "group")}, ` +
    `${count(targets.length, "target")}, ${lost ? `${lost} out of view` : "none out of view"}`
  );
}
