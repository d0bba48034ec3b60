// The selection: the selected object, the object that the map follows, and the highlighted group.

/** Values of `followed` that are not objects: the whole run, and all objects at the time shown. */
const WHOLE_RUN = { kind: "run" };
const ALL_NOW = { kind: "now" };

class Selection {
  constructor() {
    /** The selected object: `null`, or `{kind: "uav" | "group" | "target" | "intruder", id}`. A group includes its orbit. */
    this.object = null;
    /** What the map keeps in view: `WHOLE_RUN`, `ALL_NOW`, an object as above, or `null` if the user moves the map. */
    this.followed = ALL_NOW;
    /** The highlighted group: `"all"`, the id of a group, or `null` for objects in no group. */
    this.group = "all";
    this.listeners = [];
  }

  on(listener) {
    this.listeners.push(listener);
  }

  /** Notifies the listeners of a change. */
  notify() {
    for (const listener of this.listeners) listener(this);
  }

  /** Selects an object; `null` clears the selection. */
  choose(object) {
    this.object = object;
    this.notify();
  }

  /** Sets what the map keeps in view. */
  follow(object) {
    this.followed = object;
    this.notify();
  }

  /** Stops fitting the map to the run or to all objects, because the user has moved it. */
  stopFitting() {
    if (this.followed === WHOLE_RUN || this.followed === ALL_NOW) this.follow(null);
  }

  /** Highlights a group; other objects are faint. */
  filter(group) {
    this.group = group;
    this.notify();
  }

  /** Whether objects of a group are drawn at full strength. */
  passes(group) {
    return this.group === "all" || this.group === group;
  }

  isChosen(kind, id) {
    return this.object?.kind === kind && this.object.id === id;
  }
}

/** Text for an object or another value of `followed`, such as `uav 3` or `run`, as used in lists; empty for `null`. */
function objectKey(object) {
  return object ? [object.kind, object.id].filter((part) => part !== undefined).join(" ") : "";
}

/** The inverse of `objectKey`. */
function parseObjectKey(word) {
  const [kind, id] = word.split(" ");
  const fixed = [WHOLE_RUN, ALL_NOW].find((one) => one.kind === word);
  return fixed ?? (word ? { kind, id: Number(id) } : null);
}

/** The full name of an object, as stored in files. */
function wholeName(replayData, object) {
  return object.kind === "target" ? fullTargetName(replayData, object.id) : objectName(replayData, object);
}

/** The name of an object as shown on the page. */
function objectName(replayData, { kind, id }) {
  if (kind !== "target") return kind === "uav" ? `UAV ${id}` : `${kind} ${id}`;
  // Many traffic files use plain numbers as names.
  const name = targetName(replayData, id);
  return /^\d+$/.test(name) ? `target ${name}` : name;
}
