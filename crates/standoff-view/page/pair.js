// Two runs side by side, at one time: each has its map; one of them stands beside the maps.

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
    // Before the map itself takes them.
    for (const kind of ["pointerdown", "wheel"]) {
      run.map.canvas.addEventListener(kind, () => page.show(run), { capture: true, passive: true });
    }
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
    // Another run's targets and groups are others, whatever their numbers.
    const isHere = followed?.id === undefined || (followed.kind === "uav" && film.ids.uavs.includes(followed.id));
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
