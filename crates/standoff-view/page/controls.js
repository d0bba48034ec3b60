// Buttons, lists and keys.

/** What can be followed. */
function follows({ film, choice }) {
  const select = element("follow");
  const wanted = [["", "nothing"], ...film.ids.groups.map((id) => [`group ${id}`, `group ${id}`]),
    ...film.ids.uavs.map((id) => [`uav ${id}`, `UAV ${id}`])];
  if (select.options.length === wanted.length) return;
  select.replaceChildren(...wanted.map(([value, text]) => new Option(text, value)));
  select.value = objectWord(choice.followed);
}

/** Shows what the controls are set to. */
function controls({ clock, film }) {
  const play = element("play");
  play.textContent = clock.playing ? "Pause" : "Play";
  play.setAttribute("aria-pressed", String(clock.playing));
  element("speed").value = String(clock.speed);
  const live = element("live");
  live.hidden = film.done;
  live.setAttribute("aria-pressed", String(clock.following));
}

/** Wires the controls, the pointer and the keyboard. */
function connect(page) {
  const { clock, timeline, charts } = page;
  const pressed = (id, act) => element(id).addEventListener("click", act);
  pressed("play", () => clock.toggle());
  pressed("live", () => clock.follow());
  pressed("back", () => clock.step(-1));
  pressed("on", () => clock.step(1));
  element("speed").append(...Clock.SPEEDS.map((speed) => new Option(`${speed}\u00d7`, String(speed))));
  element("speed").addEventListener("change", (change) => clock.setSpeed(Number(change.target.value)));
  const follow = element("follow");
  follow.addEventListener("change", () => page.choice.follow(wordObject(follow.value)));
  for (const { choice } of page.runs) choice.on(() => (follow.value = objectWord(page.choice.followed)));
  const fit = () => {
    for (const run of page.runs) {
      run.choice.follow(null);
      run.map.fit(run.scene(clock.time_s));
    }
    page.renew();
  };
  pressed("fit", fit);
  const rule = (on) => {
    for (const { map } of page.runs) {
      map.ruler = on ? {} : null;
      map.canvas.classList.toggle("ruling", on);
    }
    element("ruler").setAttribute("aria-pressed", String(on));
    element("measured").textContent = on ? "drag on the map to measure" : "";
    page.renew();
  };
  pressed("ruler", () => rule(!page.map.ruler));
  const zoom = (factor) => {
    for (const { map } of page.runs) map.camera.zoom(factor);
    page.renew();
  };
  pressed("zoom-in", () => zoom(1.4));
  pressed("zoom-out", () => zoom(1 / 1.4));
  layers(page);
  tabs(document.querySelector("[role=tablist]"), (tab) => {
    if (tab.id === "tab-charts") charts.draw();
  });
  for (const run of page.runs) pointer(page, run);

  const keys = {
    " ": () => clock.toggle(),
    ArrowLeft: (key) => (key.shiftKey ? clock.seek(clock.time_s - 10) : clock.step(-1)),
    ArrowRight: (key) => (key.shiftKey ? clock.seek(clock.time_s + 10) : clock.step(1)),
    Home: () => clock.seek(-Infinity),
    End: () => clock.seek(Infinity),
    "[": () => clock.faster(-1),
    "]": () => clock.faster(1),
    n: () => timeline.jump(true),
    p: () => timeline.jump(false),
    "+": () => zoom(1.25),
    "=": () => zoom(1.25),
    "-": () => zoom(0.8),
    0: fit,
    f: () => {
      const next = follow.options[(follow.selectedIndex + 1) % follow.options.length];
      page.choice.follow(wordObject(next.value));
    },
    r: () => rule(!page.map.ruler),
    t: () => element("theme").click(),
    l: () => page.film.done || clock.follow(),
    "?": () => element("help").showModal(),
  };
  document.addEventListener("keydown", (key) => {
    if (key.ctrlKey || key.metaKey || key.altKey || element("help").open) return;
    // Lists, sliders and buttons keep the keys that work them.
    const at = key.target;
    if (at.closest("select")) return;
    if (at.closest("[type=range]") && /^(Arrow|Home|End|Page)/.test(key.key)) return;
    if (at.closest("button, summary, [type=checkbox]") && [" ", "Enter"].includes(key.key)) return;
    const wide = at.closest(".scrolled")?.scrollWidth > at.closest(".scrolled")?.clientWidth;
    if ((wide || at.closest("[role=tablist]")) && key.key.startsWith("Arrow")) return;
    const act = keys[key.key];
    if (!act) return;
    key.preventDefault();
    act(key);
  });
  element("keys").addEventListener("click", () => element("help").showModal());
}

/** A switch for each layer. */
function layers(page) {
  const maps = page.runs.map((run) => run.map);
  const told = () => {
    for (const map of maps) map.canvas.dataset.layers = [...map.shown].join(" ");
    page.renew();
  };
  for (const [name, words, shown] of LAYERS) {
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = shown;
    box.name = `layer-${name}`;
    box.addEventListener("change", () => {
      for (const map of maps) {
        if (box.checked) map.shown.add(name);
        else map.shown.delete(name);
      }
      told();
    });
    const label = document.createElement("label");
    label.append(box, ` ${words}`);
    element("layers").append(label);
  }
  told();
}
