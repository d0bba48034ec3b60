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

/** Names each map by its run; a click there, or on the map, puts that run beside the maps. */
function nameViews(page) {
  const names = page.runs.map((run) => {
    const name = document.createElement("button");
    name.type = "button";
    name.className = "name";
    name.title = "Charts, state, events and outcome of this run";
    name.addEventListener("click", () => page.show(run));
    run.map.canvas.addEventListener("pointerdown", () => page.show(run));
    run.map.canvas.parentElement.prepend(name);
    return name;
  });
  document.querySelector(".stage").classList.add("pair");
  return () => {
    page.runs.forEach((run, k) => {
      const { film } = run;
      const over = film.done && page.clock.time_s > film.end_s ? `, ended at ${film.end_s.toFixed(1)} s` : "";
      names[k].textContent = `${run.letter}: ${runName(film.head)}${over}`;
      names[k].setAttribute("aria-pressed", String(run === page.run));
    });
  };
}
