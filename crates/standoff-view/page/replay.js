// The page of a run.

/** Brings a run to the page. */
async function showReplay(source) {
  const head = await source.head();
  const film = new Film(source, head);
  const clock = new Clock(film);
  title(head);
  const map = new MissionMap(element("map"), film);
  const timeline = new Timeline(film, clock, {
    slider: element("time"), marks: element("marks"), events: element("events"), kind: element("kind"),
    routine: element("routine"), count: element("count"),
  });
  for (const [id, columns] of [["uavs", UAV_COLUMNS], ["groups", GROUP_COLUMNS], ["targets", TARGET_COLUMNS]]) {
    headings(element(id), columns);
  }
  const state = new State(film, {
    clock: element("clock"), uavs: element("uavs").tBodies[0], groups: element("groups").tBodies[0],
    targets: element("targets").tBodies[0], more: element("more"), warning: element("warning"),
  });
  const charts = new Charts(film, clock, {
    place: element("charts"), cursor: element("cursor"), png: element("png"), csv: element("csv"),
  });
  showOutcome(element("outcome").tBodies[0], head.outcome);

  const page = { film, clock, map, timeline, state, charts };
  const scene = () => ({
    time_s: clock.time_s,
    uavs: uavsAt(film, clock.time_s),
    groups: groupsAt(film, clock.time_s),
    targets: targetsAt(film, clock.time_s),
  });
  let stale = true;
  const renew = () => (stale = true);
  let told_ms = -Infinity;
  const picture = (now_ms) => {
    clock.tick(now_ms);
    if (map.resize()) renew();
    if (stale && film.times_s.length) {
      stale = false;
      const now = scene();
      map.draw(now);
      charts.follow();
      timeline.follow();
      // Tables are for reading: a few times a second, and always when time stands still.
      if (!clock.playing || now_ms - told_ms > 200) {
        told_ms = now_ms;
        state.show(now);
        map.canvas.setAttribute("aria-label", summary(film, now));
      }
      document.body.dataset.pictures = Number(document.body.dataset.pictures ?? 0) + 1;
    }
    requestAnimationFrame(picture);
  };
  page.renew = renew;
  film.loaded = renew;
  clock.on(() => {
    renew();
    controls(page);
  });
  connect(page, scene);
  themed(() => {
    renew();
    timeline.renew();
    if (charts.drawn) charts.draw();
  });
  window.addEventListener("resize", () => timeline.renew());
  requestAnimationFrame(picture);

  await load(page, source);
}

/** Loads the parts that there are, and those that come. */
async function load(page, source) {
  const { film, clock, timeline, charts } = page;
  let state = { sealed: 0, open: 0, done: false };
  // Parts loaded for good, and how much of the one after them.
  let [sealed, open] = [0, 0];
  let loading = false;
  let drawn_ms = 0;
  let again;
  const isBehind = () => sealed < state.sealed || open !== state.open;
  const pause_ms = 2000;
  const more = async () => {
    if (loading) return;
    loading = true;
    try {
      while (isBehind()) {
        const isSealed = sealed < state.sealed;
        if (isSealed || state.open > 0) {
          const isFirst = film.parts.length === 0;
          const half = await source.half("overview", sealed);
          film.put(sealed, half);
          if (isFirst) begin(page);
        }
        [sealed, open] = isSealed ? [sealed + 1, 0] : [sealed, state.open];
        page.renew();
      }
      if (state.done && !film.done) {
        film.done = true;
        const head = await source.head();
        film.head = head;
        showOutcome(element("outcome").tBodies[0], head.outcome);
      }
      timeline.renew();
      follows(page);
      controls(page);
      if (!window.Plotly && film.parts.length) {
        // The charts' script is large: first the map.
        await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
        await source.charts();
      }
      if (window.Plotly && (film.done || performance.now() - drawn_ms > 1000)) {
        drawn_ms = performance.now();
        await charts.draw();
        document.body.dataset.ready = "charts";
      }
      page.state.trouble("");
    } catch (error) {
      page.state.trouble(`The data could not be read: ${error.message}`);
      loading = false;
      // What is inside a file will not become better.
      clearTimeout(again);
      if (source.live) again = setTimeout(more, pause_ms);
      return;
    }
    loading = false;
    if (isBehind() || (state.done && !film.done)) more();
  };
  const told = (now) => {
    // Another run is served at the same address by now.
    if (state.run !== undefined && state.run !== now.run) {
      location.reload();
      return;
    }
    state = now;
    page.state.trouble("");
    more();
  };
  source.follow(told, () => page.state.trouble("No connection to standoff; trying again"));
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

/** What can be followed. */
function follows(page) {
  const select = element("follow");
  const { film } = page;
  const wanted = [["", "nothing"], ...film.ids.groups.map((id) => [`group ${id}`, `group ${id}`]),
    ...film.ids.uavs.map((id) => [`uav ${id}`, `UAV ${id}`])];
  if (select.options.length === wanted.length) return;
  const before = select.value;
  select.replaceChildren(...wanted.map(([value, text]) => new Option(text, value)));
  select.value = before;
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
function connect(page, scene) {
  const { clock, map, timeline, charts, renew } = page;
  element("play").addEventListener("click", () => clock.toggle());
  element("live").addEventListener("click", () => clock.follow());
  element("back").addEventListener("click", () => clock.step(-1));
  element("on").addEventListener("click", () => clock.step(1));
  element("speed").append(...Clock.SPEEDS.map((speed) => new Option(`${speed}\u00d7`, String(speed))));
  element("speed").addEventListener("change", (change) => clock.setSpeed(Number(change.target.value)));
  const follow = (value) => {
    element("follow").value = value;
    const [kind, id] = value.split(" ");
    map.followed = value ? { kind, id: Number(id) } : null;
    renew();
  };
  element("follow").addEventListener("change", (change) => follow(change.target.value));
  const fit = () => {
    follow("");
    map.fit(scene());
    renew();
  };
  element("fit").addEventListener("click", fit);
  const rule = (on) => {
    map.ruler = on ? {} : null;
    element("ruler").setAttribute("aria-pressed", String(on));
    element("measured").textContent = on ? "drag on the map to measure" : "";
    map.canvas.classList.toggle("ruling", on);
    renew();
  };
  element("ruler").addEventListener("click", () => rule(!map.ruler));
  element("zoom-in").addEventListener("click", () => (map.camera.zoom(1.4), renew()));
  element("zoom-out").addEventListener("click", () => (map.camera.zoom(1 / 1.4), renew()));
  layers(page);
  tabs(document.querySelector("[role=tablist]"), (tab) => {
    if (tab.id === "tab-charts") charts.draw();
  });
  pointer(page);

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
    "+": () => (map.camera.zoom(1.25), renew()),
    "=": () => (map.camera.zoom(1.25), renew()),
    "-": () => (map.camera.zoom(0.8), renew()),
    0: fit,
    f: () => {
      const select = element("follow");
      follow(select.options[(select.selectedIndex + 1) % select.options.length].value);
    },
    r: () => rule(!map.ruler),
    t: () => element("theme").click(),
    l: () => clock.film.done || clock.follow(),
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
function layers({ map, renew }) {
  for (const [name, words, shown] of LAYERS) {
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = shown;
    box.name = `layer-${name}`;
    box.addEventListener("change", () => {
      if (box.checked) map.shown.add(name);
      else map.shown.delete(name);
      map.canvas.dataset.layers = [...map.shown].join(" ");
      renew();
    });
    const label = document.createElement("label");
    label.append(box, ` ${words}`);
    element("layers").append(label);
  }
  map.canvas.dataset.layers = [...map.shown].join(" ");
}

/** Panning, zooming, measuring; with a mouse or fingers. */
function pointer({ map, film, renew }) {
  const { canvas, camera } = map;
  const down = new Map();
  let pressed = [0, 0];
  const place = (event) => [event.offsetX, event.offsetY];
  const say = (x, y) => {
    const [east_m, north_m] = camera.world(x, y);
    const { origin } = film.head;
    const [lat, lon] = origin ? geographic(origin, east_m, north_m) : [];
    const also = origin ? `, ${degrees(lat, "N", "S")} ${degrees(lon, "E", "W")}` : "";
    element("where").textContent = `${fixed(east_m, 0)} m east, ${fixed(north_m, 0)} m north${also}`;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    pressed = place(event);
    if (map.ruler) map.ruler = { from: camera.world(...place(event)), to: null };
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    const before = down.get(event.pointerId);
    if (!before) return say(x, y);
    if (map.ruler) {
      map.ruler.to = camera.world(x, y);
      element("measured").textContent = map.measured();
    } else if (down.size === 2) {
      const [other] = [...down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const apart = (a, b) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
      // What is between the fingers stays there.
      camera.pan((x - before[0]) / 2, (y - before[1]) / 2);
      camera.zoom(apart([x, y], other) / apart(before, other), (x + other[0]) / 2, (y + other[1]) / 2);
    } else {
      if (map.followed && Math.hypot(x - pressed[0], y - pressed[1]) > 3) {
        map.followed = null;
        element("follow").value = "";
      }
      camera.pan(x - before[0], y - before[1]);
    }
    down.set(event.pointerId, [x, y]);
    say(x, y);
    renew();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => down.delete(event.pointerId));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...place(event));
      renew();
    },
    { passive: false },
  );
}
