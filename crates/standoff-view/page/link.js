// Links to a time and a selection: `#t=100&uav=2`, `#t=40&target=car%203&follow=1`.

/** Maximum length of a target name in a link. */
const LONGEST_NAME = 100;

/** Parameters of a link. */
const KEYS = ["t", "run", "agent", "uav", "group", "target", "intruder", "follow"];

class Link {
  constructor(page) {
    this.page = page;
    window.addEventListener("hashchange", () => this.open());
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
    if (object && parameters.get("follow") === "1") page.selection.follow(object);
    page.timeline.showMessage(problems.length ? `The link ${problems.join("; it ")}.` : "");
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

  /** The link to the time and the selection that are shown. */
  get hash() {
    const { clock, selection, replayData } = this.page;
    const object = [selection.object, selection.followed].find((one) => one?.id !== undefined);
    const parameters = new URLSearchParams({ t: String(Number(clock.time_s.toFixed(3))) });
    if (this.page.pair) parameters.set("run", this.page.run.letter.toLowerCase());
    if (replayData.agents.chosen !== null) parameters.set("agent", replayData.agents.chosen);
    if (object) parameters.set(object.kind, object.kind === "target" ? targetKey(replayData, object.id) : object.id);
    if (object && objectKey(object) === objectKey(selection.followed)) parameters.set("follow", "1");
    return `#${parameters}`;
  }

  /** Puts the link into the address bar and the clipboard. */
  async copy() {
    const { timeline } = this.page;
    const href = location.href.replace(/#.*$/, "") + this.hash;
    try {
      history.replaceState(null, "", href);
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
