// Two runs side by side, at one time: each has its map; one of them stands beside the maps.

/** Several films as one, for the clock: the one that lasts longest. */
class Together {
  constructor(films) {
    this.films = films;
  }

  get longest() {
    return this.films.reduce((longest, film) => (film.end_s > longest.end_s ? film : longest));
  }

  get head() {
    return this.longest.head;
  }

  get times_s() {
    return this.longest.times_s;
  }

  get end_s() {
    return this.longest.end_s;
  }

  get shown_end_s() {
    return this.longest.shown_end_s;
  }

  isWhole(time_s) {
    return this.longest.isWhole(time_s);
  }

  get done() {
    return this.films.every((film) => film.done);
  }

  instant(time_s) {
    return this.longest.instant(time_s);
  }
}

/** The canvases of so many maps, side by side. */
function canvases(count) {
  const views = document.querySelector(".views");
  const [first] = views.children;
  for (let k = 1; k < count; k++) {
    const view = first.cloneNode(true);
    const canvas = view.querySelector("canvas");
    canvas.id = `map-${k + 1}`;
    canvas.setAttribute("aria-label", `Map ${k + 1}`);
    views.append(view);
  }
  return [...views.querySelectorAll("canvas")];
}

/** The maps of two runs: each has its run's name, which puts that run beside the maps, and they look at one place if asked to. */
class Pair {
  constructor(page) {
    this.page = page;
    this.names = page.runs.map((run) => this.name(run));
    this.box = document.createElement("input");
    this.box.type = "checkbox";
    this.box.addEventListener("change", () => this.link());
    const label = document.createElement("label");
    label.title = "Both maps look at one place, and move together";
    label.append(this.box, " Link maps");
    document.querySelector(".tools").append(label);
    document.querySelector(".stage").classList.add("pair");
  }

  name(run) {
    const { page } = this;
    const name = document.createElement("button");
    name.type = "button";
    name.className = "name";
    name.title = "Charts, state, events and outcome of this run";
    name.addEventListener("click", () => page.show(run));
    run.map.canvas.addEventListener("pointerdown", () => page.show(run));
    run.map.canvas.addEventListener("wheel", () => page.show(run), { passive: true });
    run.map.canvas.parentElement.prepend(name);
    return name;
  }

  /** Both runs have begun: if they are in one place, their maps are linked. */
  begin() {
    const [a, b] = this.page.runs.map(({ film }) => film.bounds_m());
    this.box.checked = Boolean(a && b) && a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3];
    this.link();
  }

  /** The maps follow that of the run beside them, or go their own way. */
  link() {
    const { page, box } = this;
    for (const run of page.runs) {
      run.map.leader = box.checked && run !== page.run ? page.map : null;
      run.map.view.films = box.checked ? page.runs.map(({ film }) => film) : [run.film];
      run.map.view.restart();
    }
    page.renew();
  }

  /** Another run has come beside the maps: linked ones go on looking where they look. */
  shown(before) {
    if (!this.box.checked) return;
    const { followed } = before.choice;
    const { film, choice } = this.page;
    const isHere = followed?.id === undefined || followed.kind === "target" || film.ids[`${followed.kind}s`].includes(followed.id);
    choice.followed = isHere ? followed : null;
    this.link();
  }

  /** Says which run is which, and which has ended. */
  tell() {
    const { page } = this;
    page.runs.forEach((run, k) => {
      const { film } = run;
      const over = film.done && page.clock.time_s > film.end_s ? `, ended at ${film.end_s.toFixed(1)} s` : "";
      this.names[k].textContent = `${run.letter}: ${runName(film.head)}${over}`;
      this.names[k].setAttribute("aria-pressed", String(run === page.run));
    });
  }
}
