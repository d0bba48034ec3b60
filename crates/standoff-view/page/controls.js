// Buttons, lists and keyboard shortcuts.

/** Updates the list of objects to follow. A target is listed only while it is followed, because there may be many. */
function follows({ replayData, selection }) {
  const select = element("follow");
  const word = objectKey(selection.followed);
  const objects = ["group", "uav", "intruder"].flatMap((kind) => replayData.ids[`${kind}s`].map((id) => ({ kind, id })));
  if (selection.followed?.kind === "target") objects.push(selection.followed);
  const options = [["now", "all objects"], ["run", "whole run"], ["", "nothing"],
    ...objects.map((object) => [objectKey(object), objectName(replayData, object)])];
  if (String(options) !== String([...select.options].map(({ value, text }) => [value, text]))) {
    select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
  }
  select.value = word;
}

/** Updates the controls of the time. */
function controls({ clock, replayData }) {
  const play = element("play");
  play.textContent = clock.playing ? "Pause" : "Play";
  play.setAttribute("aria-pressed", String(clock.playing));
  element("speed").value = String(clock.speed);
  const live = element("live");
  live.hidden = replayData.done || !replayData.head.live;
  live.setAttribute("aria-pressed", String(clock.following));
}

/** Updates the selection of the team state, which is shown only if every UAV runs its own agent. */
function updateAgentSelection(page) {
  const { agents } = page.replayData;
  element("agent-label").hidden = !agents.isSeveral;
  const select = element("agent");
  const options = [["", "auto"], ...agents.ids.map((uav) => [`${uav}`, `UAV ${uav}`])];
  if (select.options.length !== options.length) select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
  select.value = agents.chosen ?? "";
}

/** Shows which UAV the option "auto" selects now, and to which team state the group charts belong. */
function updateAutoOption({ replayData, clock }) {
  const { agents } = replayData;
  if (!agents.isSeveral) return;
  const stepIndex = replayData.stepAt(clock.time_s);
  const first = agents.first(stepIndex);
  const text = first === null ? "auto: none on" : `auto: UAV ${first}`;
  const [option] = element("agent").options;
  if (option && option.text !== text) option.text = text;
  const charts = agents.chosen === null ? "" : `groups: ${first === null ? "no team state" : `team state of UAV ${first}`}`;
  if (element("charts-of").textContent !== charts) element("charts-of").textContent = charts;
}

/** Updates the text of the ruler, whose ends may move with objects. */
function showRuler({ map }) {
  const text = map.measured();
  if (text && element("ruler-result").textContent !== text) element("ruler-result").textContent = text;
}

/** Connects the controls, the pointer and the keyboard. */
function connect(page) {
  const { clock, timeline, charts } = page;
  const pressed = (id, act) => element(id).addEventListener("click", act);
  pressed("play", () => clock.toggle());
  pressed("live", () => clock.follow());
  pressed("step-back", () => clock.step(-1));
  pressed("step-forward", () => clock.step(1));
  element("speed").append(...Clock.SPEEDS.map((speed) => new Option(`${speed}\u00d7`, String(speed))));
  element("speed").addEventListener("change", (change) => clock.setSpeed(Number(change.target.value)));
  const follow = element("follow");
  follow.addEventListener("change", () => page.selection.follow(parseObjectKey(follow.value)));
  for (const { selection } of page.runs) selection.on(() => follows(page));
  const fit = () => {
    for (const { selection, map } of page.runs) {
      map.view.restart();
      selection.follow(ALL_NOW);
    }
  };
  pressed("fit", fit);
  const rule = (on) => {
    for (const { map } of page.runs) {
      map.ruler = on ? {} : null;
      map.canvas.classList.toggle("ruling", on);
    }
    element("ruler").setAttribute("aria-pressed", String(on));
    element("ruler-result").textContent = on ? "drag on the map to measure" : "";
    page.renew();
  };
  // On phones, these buttons show others, and one of them hides the map.
  const toggles = (id, state) => pressed(id, ({ currentTarget: button }) => button.setAttribute(state, String(button.getAttribute(state) !== "true")));
  toggles("tools-button", "aria-expanded");
  toggles("event-filters", "aria-expanded");
  toggles("full-height", "aria-pressed");
  pressed("view-3d", () => page.show3d(!page.is3d));
  pressed("last-view", () => page.viewHistory.back());
  pressed("ruler", () => rule(!page.map.ruler));
  const zoom = (factor) => {
    for (const { selection, map } of page.runs) {
      selection.stopFitting();
      map.camera.zoom(factor);
    }
    page.renew();
  };
  pressed("zoom-in", () => zoom(1.4));
  pressed("zoom-out", () => zoom(1 / 1.4));
  pressed("map-png", () => saveMapImage(page));
  pressed("map-svg", () => saveMapSvg(page));
  page.video = new MapVideo(page);
  connectMenus();
  connectFind(page);
  connectFilter(page);
  const agent = element("agent");
  agent.addEventListener("change", () => page.chooseAgent(agent.value === "" ? null : Number(agent.value)));
  tabs(document.querySelector("[role=tablist]"), (tab) => {
    if (tab.id === "tab-charts") charts.draw();
    page.renew();
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
    z: () => page.viewHistory.back(),
    Backspace: () => page.viewHistory.back(),
    f: () => {
      const objects = [...follow.options].filter((option) => option.value.includes(" "));
      const next = objects[objects.indexOf(follow.selectedOptions[0]) + 1];
      page.selection.follow(next ? parseObjectKey(next.value) : ALL_NOW);
    },
    d: () => page.show3d(!page.is3d),
    r: () => rule(!page.map.ruler),
    k: () => element("map-legend-button").click(),
    t: () => element("theme").click(),
    c: () => page.link.copy(),
    l: () => element("live").hidden || clock.follow(),
    "/": () => element("find").focus(),
    Escape: () => page.selection.choose(null),
    "?": () => showHelp(),
  };
  document.addEventListener("keydown", (key) => {
    if (key.ctrlKey || key.metaKey || key.altKey || isSwitchedOff(key) || document.querySelector("dialog[open]")) return;
    // Fields, lists and sliders keep their own keys; Space and Enter press buttons.
    const at = key.target;
    // A list that was opened with the pointer gives up Space as well.
    if (at.matches("select[data-pointed]") && key.key === " ") at.blur();
    else if (at.closest(FIELDS)) return;
    if (at.closest("[type=range]") && /^(Arrow|Home|End|Page)/.test(key.key)) return;
    if (key.key === " " && at.closest("button, summary, [type=checkbox], [type=radio]")) return;
    const wide = at.closest(".scrolled")?.scrollWidth > at.closest(".scrolled")?.clientWidth;
    if ((wide || at.closest("[role=tablist]")) && key.key.startsWith("Arrow")) return;
    const act = keys[key.key];
    if (!act) return;
    key.preventDefault();
    act(key);
  });
  connectCharacterKeys();
  element("help-button").addEventListener("click", ({ detail }) => {
    // After a click with the pointer, closing the help must not return the focus to the button.
    if (detail > 0) element("help-button").blur();
    showHelp();
  });
  releaseFocus();
}

/** Connects the menus of the toolbar. They cover other controls: a click elsewhere and Escape close them. */
function connectMenus() {
  for (const menu of document.querySelectorAll(".tools details")) {
    const close = () => (menu.open = false);
    document.addEventListener("pointerdown", (pointer) => menu.contains(pointer.target) || close());
    menu.addEventListener("keydown", (key) => {
      if (key.key !== "Escape" || !menu.open) return;
      key.stopPropagation();
      close();
      menu.querySelector("summary").focus();
    });
    menu.addEventListener("toggle", () => keepAboveTime(menu.querySelector(".menu")));
  }
}

/** Limits the height of a list over the map so that it does not cover the time slider. */
function keepAboveTime(list) {
  const stage = document.querySelector(".stage").getBoundingClientRect();
  list.style.maxHeight = `${Math.max((stage.bottom - list.getBoundingClientRect().top) / pageZoom() - 8, 60)}px`;
}

/** Opens the help at its top. */
function showHelp() {
  element("help").showModal();
  element("help").scrollTop = 0;
}

/** Text fields and lists. */
const FIELDS = "select, textarea, input:not([type=range], [type=checkbox], [type=radio])";
/** Controls that lose the focus after a click. */
const CLICKED = "button, summary, [role=listbox], [type=range], [type=checkbox], [type=radio]";

/** Removes the focus from a control after a click, so that keys act on the page again. Keyboard users keep the focus. */
function releaseFocus() {
  let isPointed = false;
  document.addEventListener("pointerdown", () => (isPointed = true), true);
  document.addEventListener("keydown", () => (isPointed = false), true);
  document.addEventListener("pointerdown", ({ target }) => target.closest("select")?.setAttribute("data-pointed", ""));
  document.addEventListener("focusout", ({ target }) => target.removeAttribute("data-pointed"));
  const release = (selector) => () => {
    if (isPointed && document.activeElement?.matches(selector)) document.activeElement.blur();
  };
  document.addEventListener("click", release(CLICKED));
  document.addEventListener("change", release(`select, ${CLICKED}`));
}
