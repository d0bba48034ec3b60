// Two runs side by side at the same time. Each run has a map; the side panel shows one of the runs.

/** Creates the canvases of `count` maps, side by side. */
function canvases(count) {
  const views = document.querySelector(".views");
  const [first] = views.children;
  for (let k = 1; k < count; k++) {
    const view = first.cloneNode(true);
    const canvas = view.querySelector("canvas");
    canvas.id = `map-${"ab"[k]}`;
    canvas.setAttribute("aria-label", `Map ${"AB"[k]}`);
    views.append(view);
  }
  return [...views.querySelectorAll("canvas")];
}

/** The maps of two runs. The name of a run selects it for the side panel; linked maps show the same area. */
class CompareView {
  constructor(page) {
    this.page = page;
    this.names = page.runs.map((run) => this.name(run));
    this.box = document.createElement("input");
    this.box.type = "checkbox";
    this.box.addEventListener("change", () => this.link());
    const label = document.createElement("label");
    label.title = "Both maps show the same area and move together";
    label.append(this.box, " Link maps");
    document.querySelector(".tools").append(label);
    document.querySelector(".stage").classList.add("compare");
  }

  /** Creates the button with the name of a run. */
  name(run) {
    const { page } = this;
    const name = document.createElement("button");
    name.type = "button";
    name.className = "name";
    name.title = "Show charts, state, events and outcome of this run";
    name.addEventListener("click", () => page.show(run));
    // These listeners run before those of the map.
    for (const kind of ["pointerdown", "wheel"]) {
      run.map.canvas.addEventListener(kind, () => page.show(run), { capture: true, passive: true });
    }
    run.map.canvas.parentElement.prepend(name);
    return name;
  }

  /** Links the maps if the runs are in the same area; called when both runs have data. */
  begin() {
    const [a, b] = this.page.runs.map(({ replayData }) => replayData.bounds_m());
    this.box.checked = Boolean(a && b) && a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3];
    this.link();
  }

  /** Links or unlinks the maps, as the checkbox is set. */
  link() {
    const { page, box } = this;
    for (const run of page.runs) {
      run.map.leader = box.checked && run !== page.run ? page.map : null;
      run.map.view.maps = box.checked ? page.runs.map(({ map }) => map) : [run.map];
      run.map.view.restart();
    }
    page.renew();
  }

  /** Keeps the view of linked maps when the side panel changes to another run. */
  shown(before) {
    if (!this.box.checked) return;
    const { followed } = before.selection;
    const { replayData, selection } = this.page;
    // Targets and groups with equal numbers are different objects in different runs.
    const isHere = followed?.id === undefined || (followed.kind === "uav" && replayData.ids.uavs.includes(followed.id));
    selection.followed = isHere ? followed : null;
    this.link();
  }

  /** Updates the names of the runs, and shows which run has ended. */
  update() {
    const { page } = this;
    page.runs.forEach((run, k) => {
      const { replayData } = run;
      const over = replayData.done && page.clock.time_s > replayData.end_s ? `, ended at ${replayData.end_s.toFixed(1)} s` : "";
      this.names[k].textContent = `${run.letter}: ${runName(replayData.head)}${over}`;
      this.names[k].setAttribute("aria-pressed", String(run === page.run));
    });
  }
}
