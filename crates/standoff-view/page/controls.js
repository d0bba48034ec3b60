// Buttons, lists and keys.

/** What can be followed: a target once it is, the list would be too long. */
function follows({ film, choice }) {
  const select = element("follow");
  const word = objectWord(choice.followed);
  const objects = ["group", "uav", "intruder"].flatMap((kind) => film.ids[`${kind}s`].map((id) => ({ kind, id })));
  if (choice.followed?.kind === "target") objects.push(choice.followed);
  const wanted = [["run", "whole run"], ["now", "all now"], ["", "nothing"],
    ...objects.map((object) => [objectWord(object), objectName(film, object)])];
  if (String(wanted) !== String([...select.options].map(({ value, text }) => [value, text]))) {
    select.replaceChildren(...wanted.map(([value, text]) => new Option(text, value)));
  }
  select.value = word;
}

/** Shows what the controls are set to. */
function controls({ clock, film }) {
  const play = element("play");
  play.textContent = clock.playing ? "Pause" : "Play";
  play.setAttribute("aria-pressed", String(clock.playing));
  element("speed").value = String(clock.speed);
  const live = element("live");
  live.hidden = film.done || !film.head.live;
  live.setAttribute("aria-pressed", String(clock.following));
}

/** Whose picture is shown, where minds are several. */
function pictureOf(page) {
  const { minds } = page.film;
  tellLayers(page);
  element("picture-of").hidden = !minds.isSeveral;
  for (const name of MINDS_LAYERS) document.querySelector(`label[data-layer="${name}"]`).hidden = !minds.isSeveral;
  const select = element("picture");
  const wanted = [["", "lowest on"], ...minds.ids.map((uav) => [`${uav}`, `UAV ${uav}`])];
  if (select.options.length !== wanted.length) select.replaceChildren(...wanted.map(([value, text]) => new Option(text, value)));
  select.value = minds.chosen ?? "";
}

/** Says of whom the first choice is now. */
function tellPicture({ film, clock }) {
  const { minds } = film;
  if (!minds.isSeveral) return;
  const instant = film.instant(clock.time_s);
  const first = minds.first(instant);
  const words = first === null ? "none is on" : `UAV ${first}, the lowest on`;
  const [option] = element("picture").options;
  if (option && option.text !== words) option.text = words;
  const charts = minds.chosen === null ? "" : `groups: ${first === null ? "no picture" : `picture of UAV ${first}`}`;
  if (element("charts-of").textContent !== charts) element("charts-of").textContent = charts;
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
  for (const { choice } of page.runs) choice.on(() => follows(page));
  const fit = () => {
    for (const { choice, map } of page.runs) {
      map.view.restart();
      choice.follow(WHOLE_RUN);
    }
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
    for (const { choice, map } of page.runs) {
      choice.hold();
      map.camera.zoom(factor);
    }
    page.renew();
  };
  pressed("zoom-in", () => zoom(1.4));
  pressed("zoom-out", () => zoom(1 / 1.4));
  pressed("map-png", () => savePicture(page));
  connectFind(page);
  connectFilter(page);
  const picture = element("picture");
  picture.addEventListener("change", () => page.choosePicture(picture.value === "" ? null : Number(picture.value)));
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
      const objects = [...follow.options].filter((option) => option.value.includes(" "));
      const next = objects[objects.indexOf(follow.selectedOptions[0]) + 1];
      page.choice.follow(next ? wordObject(next.value) : WHOLE_RUN);
    },
    r: () => rule(!page.map.ruler),
    t: () => element("theme").click(),
    c: () => page.link.copy(),
    l: () => element("live").hidden || clock.follow(),
    "/": () => element("find").focus(),
    Escape: () => page.choice.choose(null),
    "?": () => element("help").showModal(),
  };
  document.addEventListener("keydown", (key) => {
    if (key.ctrlKey || key.metaKey || key.altKey || document.querySelector("dialog[open]")) return;
    // Fields, lists and sliders keep the keys that work them; enter presses buttons, and space plays.
    const at = key.target;
    // A list that has been clicked lets go of it, too.
    if (at.matches("select[data-pointed]") && key.key === " ") at.blur();
    else if (at.closest(FIELDS)) return;
    if (at.closest("[type=range]") && /^(Arrow|Home|End|Page)/.test(key.key)) return;
    if (key.key === " " && at.closest("[type=checkbox], [type=radio]")) return;
    const wide = at.closest(".scrolled")?.scrollWidth > at.closest(".scrolled")?.clientWidth;
    if ((wide || at.closest("[role=tablist]")) && key.key.startsWith("Arrow")) return;
    const act = keys[key.key];
    if (!act) return;
    key.preventDefault();
    act(key);
  });
  // Some browsers press a button when space is let go of.
  document.addEventListener("keyup", (key) => {
    if (key.key === " " && key.target.closest("button, summary")) key.preventDefault();
  });
  element("keys").addEventListener("click", () => element("help").showModal());
  letGo();
}

/** What is written in, or chosen from. */
const FIELDS = "select, textarea, input:not([type=range], [type=checkbox], [type=radio])";
/** What lets go of the keys once it has been clicked. */
const CLICKED = "button, summary, [role=listbox], [type=range], [type=checkbox], [type=radio]";

/** After a click on a control the keys belong to the page again; who works it by keys stays there. */
function letGo() {
  let isPointed = false;
  document.addEventListener("pointerdown", () => (isPointed = true), true);
  document.addEventListener("keydown", () => (isPointed = false), true);
  document.addEventListener("pointerdown", ({ target }) => target.closest("select")?.setAttribute("data-pointed", ""));
  document.addEventListener("focusout", ({ target }) => target.removeAttribute("data-pointed"));
  const release = (wanted) => () => {
    if (isPointed && document.activeElement?.matches(wanted)) document.activeElement.blur();
  };
  document.addEventListener("click", release(CLICKED));
  document.addEventListener("change", release(`select, ${CLICKED}`));
}

/** Says on each map which layers it draws. */
function tellLayers(page) {
  for (const { map, film } of page.runs) {
    map.canvas.dataset.layers = [...map.shown].filter((name) => film.minds.isSeveral || !MINDS_LAYERS.has(name)).join(" ");
  }
}

/** A switch for each layer. */
function layers(page) {
  const maps = page.runs.map((run) => run.map);
  const told = () => {
    tellLayers(page);
    page.renew();
  };
  for (const [name, words, shown, about] of LAYERS.filter((layer) => maps.some((map) => map.layers.includes(layer)))) {
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
    label.title = about;
    label.dataset.layer = name;
    label.hidden = MINDS_LAYERS.has(name);
    element("layers").append(label);
  }
  // It lies over other things: a click elsewhere and escape close it.
  const list = element("layers").closest("details");
  const close = () => (list.open = false);
  document.addEventListener("pointerdown", (pointer) => list.contains(pointer.target) || close());
  list.addEventListener("keydown", (key) => {
    if (key.key !== "Escape" || !list.open) return;
    key.stopPropagation();
    close();
    list.querySelector("summary").focus();
  });
  told();
}
