// Links to what the page shows: `#t=100&uav=2`, `#t=40&target=car%203&follow=1`, `#t=40&layers=operator&view=120,-40,0.5&tab=state`.

/** Maximum length of a target name in a link. */
const LONGEST_NAME = 100;

/** Parameters of a link. */
const KEYS = ["t", "run", "agent", "uav", "group", "target", "intruder", "follow", "highlight", "layers", "view", "tab", "charts", "3d"];

/** Side panels of a link; the first is the default. */
const TABS = ["charts", "state", "events", "problems", "outcome"];
/** Maximum distance from the origin in a link, m. */
const FURTHEST_M = 1e7;

class Link {
  constructor(page) {
    this.page = page;
    window.addEventListener("hashchange", () => {
      // The buttons of the browser may return to an entry with a view of its own.
      const { state } = history;
      this.open();
      page.viewHistory.restore(state);
    });
    element("copy-link").addEventListener("click", () => this.copy());
  }

  /** Shows what the address of the page selects, and reports its errors. */
  open() {
    const { page } = this;
    const parameters = new URLSearchParams(location.hash.slice(1));
    const problems = [...parameters]
      .filter(([key, value], k, all) => value && (!KEYS.includes(key) || all.findIndex(([other]) => other === key) < k))
      .map(([key]) => `contains ${shortName(key)}, which is unknown or repeated`);
    const run = page.runs.find(({ letter }) => page.pair && letter.toLowerCase() === parameters.get("run"));
    if (run) page.show(run);
    const agent = this.agent(parameters, problems);
    if (agent !== page.replayData.agents.chosen) page.chooseAgent(agent);
    if (parameters.has("t")) this.seek(parameters.get("t"), problems);
    const object = this.object(parameters, problems);
    if (object) page.selection.choose(object);
    this.openView(parameters, object, problems);
    const tab = parameters.get("tab");
    if (TABS.includes(tab)) element(`tab-${tab}`).click();
    else if (tab !== null) problems.push(`contains tab=${shortName(tab)}, which must be ${oneOf(TABS)}`);
    if (parameters.get("3d") === "1") page.show3d(true);
    else if (parameters.has("3d")) problems.push(`contains 3d=${shortName(parameters.get("3d"))}, which must be 1`);
    this.openCharts(parameters.get("charts"), problems);
    page.viewHistory.begin();
    page.timeline.showMessage(problems.length ? `The link ${problems.join("; it ")}.` : "");
  }

  /** Shows the layers, the highlighted group and the part of the map in a link; follows its object. */
  openView(parameters, object, problems) {
    const { page } = this;
    const get = (key) => parameters.get(key);
    const layers = get("layers") === null ? null : parseLayers(get("layers"));
    if (layers?.preset) page.layerMenu.apply((of) => of.choose(layers.preset));
    else if (layers) page.layerMenu.apply((of) => of.chooseLayers(layers.names));
    else if (get("layers") !== null) {
      const presets = PRESETS.map(([key]) => key).filter((key) => key !== "custom");
      problems.push(`contains layers=${shortName(get("layers"))}, which must be ${oneOf(presets)}, or names of layers joined by "."`);
    }
    const highlight = get("highlight");
    const group = page.replayData.ids.groups.find((id) => String(id) === highlight);
    if (highlight === "none" || highlight === "all") page.selection.filter(highlight === "none" ? null : "all");
    else if (group !== undefined) page.selection.filter(group);
    else if (highlight !== null) problems.push(`highlights group ${shortName(highlight) || "(empty)"}, which is not in this run`);
    const follow = get("follow");
    if (object && follow === "1") page.selection.follow(object);
    else if (follow === "now") page.selection.follow(ALL_NOW);
    else if (follow === "run") page.selection.follow(WHOLE_RUN);
    else if (follow !== null && follow !== "1") problems.push(`contains follow=${shortName(follow)}, which must be 1, now or run`);
    if (get("view") === null) return;
    const view = parseView(get("view"));
    if (!view) {
      problems.push(`contains view=${shortName(get("view"))}, which must be metres east, metres north and pixels per metre (0.0001 to 50), such as 120,-40,0.5`);
      return;
    }
    if (follow === null) page.selection.follow(null);
    Object.assign(page.map.camera, view);
    page.renew();
  }

  /** Shows the chart panels in a link, given by their keys. */
  openCharts(text, problems) {
    if (text === null) return;
    const { menu } = this.page.charts;
    const keys = text === "none" ? [] : text.split(",");
    const unknown = keys.find((key) => !menu.keys.includes(key));
    if (unknown === undefined) menu.choose(keys);
    else problems.push(`contains charts=${shortName(unknown) || "(empty)"}, which is no chart of this run; copy a link to see their names`);
  }

  /** Goes to the time in a link. */
  seek(text, problems) {
    const { clock } = this.page;
    const { replayData } = clock;
    const time_s = /^-?\d+(\.\d+)?$/.test(text) ? Number(text) : NaN;
    if (Number.isNaN(time_s)) {
      problems.push(`contains t=${shortName(text)}, which is not a number of seconds`);
      return;
    }
    const [first_s, last_s] = [replayData.times_s[0], replayData.end_s];
    clock.pause();
    clock.seek(time_s);
    if (time_s >= first_s && time_s <= last_s) return;
    const range = `${first_s.toFixed(1)} to ${last_s.toFixed(1)} s${clock.done ? "" : " so far"}`;
    problems.push(`requests ${shortName(text)} s, but the run covers ${range} (nearest time shown)`);
  }

  /** The UAV whose team state the address requests; `null` if it requests none, or one that does not exist. */
  agent(parameters, problems) {
    if (!parameters.has("agent")) return null;
    const text = parameters.get("agent");
    const { agents } = this.page.replayData;
    const uav = agents.ids.find((id) => String(id) === text);
    if (uav === undefined) {
      const reason = agents.isSeveral ? "which is not in this run" : "but in this run all UAVs share one agent";
      problems.push(`requests the team state of UAV ${shortName(text) || "(empty)"}, ${reason}`);
    }
    return uav ?? null;
  }

  /** The first object in the address that exists in this run. */
  object(parameters, problems) {
    const { replayData } = this.page;
    for (const kind of ["uav", "group", "target", "intruder"]) {
      if (!parameters.has(kind)) continue;
      const text = parameters.get(kind);
      const id = kind === "target" ? parseTarget(replayData, text) : replayData.ids[`${kind}s`].find((id) => String(id) === text);
      if (id !== undefined) return { kind, id };
      problems.push(`names ${kind === "uav" ? "UAV" : kind} ${shortName(text) || "(empty)"}, which is not in this run`);
    }
    return null;
  }

  /** The link to the time, the selection, the layers and the part of the map that are shown. */
  get hash() {
    const { clock, selection, replayData } = this.page;
    const object = [selection.object, selection.followed].find((one) => one?.id !== undefined);
    const parameters = new URLSearchParams({ t: String(Number(clock.time_s.toFixed(3))) });
    if (this.page.pair) parameters.set("run", this.page.run.letter.toLowerCase());
    if (replayData.agents.chosen !== null) parameters.set("agent", replayData.agents.chosen);
    if (object) parameters.set(object.kind, object.kind === "target" ? targetKey(replayData, object.id) : object.id);
    const { followed, group } = selection;
    if (object && objectKey(object) === objectKey(followed)) parameters.set("follow", "1");
    else if (followed === WHOLE_RUN) parameters.set("follow", "run");
    if (group !== "all") parameters.set("highlight", group ?? "none");
    const { map } = this.page;
    if (map.layers.word !== "automatic") parameters.set("layers", map.layers.word);
    const { x_m, y_m, px_per_m } = map.camera;
    if (followed !== WHOLE_RUN && followed !== ALL_NOW) {
      parameters.set("view", [x_m.toFixed(1), y_m.toFixed(1), px_per_m.toPrecision(4)].map(Number).join(","));
    }
    const { page } = this;
    const tab = TABS.find((one) => element(`tab-${one}`).getAttribute("aria-selected") === "true");
    if (tab !== TABS[0]) parameters.set("tab", tab);
    if (page.is3d) parameters.set("3d", "1");
    if (page.charts.menu.word) parameters.set("charts", page.charts.menu.word);
    // Commas need no escape in a fragment.
    return `#${parameters}`.replaceAll("%2C", ",");
  }

  /** Puts the link into the address bar and the clipboard. */
  async copy() {
    const { timeline } = this.page;
    const href = location.href.replace(/#.*$/, "") + this.hash;
    try {
      history.replaceState(history.state, "", href);
    } catch {
      // Some browsers do not allow a page opened from a file to change its address.
    }
    try {
      await navigator.clipboard.writeText(href);
      timeline.showMessage(`Copied: ${this.hash}`);
    } catch {
      timeline.showMessage(location.href === href ? "The link is in the address bar" : `Append this to the address of the page: ${this.hash}`);
    }
  }
}

/** A list of allowed values in a message. */
function oneOf(words) {
  return `${words.slice(0, -1).join(", ")} or ${words.at(-1)}`;
}

/** The view in a link; `null` if it is invalid. */
function parseView(text) {
  const numbers = text.split(",");
  if (numbers.length !== 3 || !numbers.every((word) => /^-?\d+(\.\d+)?$/.test(word))) return null;
  const [x_m, y_m, px_per_m] = numbers.map(Number);
  const isAllowed = Math.max(Math.abs(x_m), Math.abs(y_m)) <= FURTHEST_M && px_per_m >= Camera.MIN_PX_PER_M && px_per_m <= Camera.MAX_PX_PER_M;
  return isAllowed ? { x_m, y_m, px_per_m } : null;
}

/** Returns the id of the target with a name, or otherwise with an id given as text. */
function parseTarget({ head }, word) {
  const id = head.targets.indexOf(word);
  if (id >= 0) return id;
  return /^\d+$/.test(word) && Number(word) < head.targets.length ? Number(word) : undefined;
}

/** The text for a target in a link: its name, or its id if the name is ambiguous or too long. */
function targetKey(replayData, id) {
  const name = replayData.head.targets[id] ?? "";
  return name.length <= LONGEST_NAME && parseTarget(replayData, name) === id ? name : String(id);
}
