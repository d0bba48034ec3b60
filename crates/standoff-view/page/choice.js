// What the reader has chosen: an object to look at, and what the map keeps in view.

/** What a map may keep in sight that is no object. */
const WHOLE_RUN = { kind: "run" };
const ALL_NOW = { kind: "now" };

class Choice {
  constructor() {
    /** What is looked at: `null`, or `{kind: "uav" | "group" | "target" | "intruder", id}`. A group stands for its orbit, too. */
    this.object = null;
    /** What the map keeps in sight: `WHOLE_RUN`, `ALL_NOW`, an object as above, or with `null` what the reader turned it to. */
    this.followed = WHOLE_RUN;
    /** Of which group things are shown: `"all"`, a group's id, or `null` for what is in none. */
    this.group = "all";
    this.listeners = [];
  }

  on(listener) {
    this.listeners.push(listener);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }

  /** Looks at an object, or with `null` at none. */
  choose(object) {
    this.object = object;
    this.tell();
  }

  follow(object) {
    this.followed = object;
    this.tell();
  }

  /** The map has been moved by hand: it does not fit itself any more. */
  hold() {
    if (this.followed === WHOLE_RUN || this.followed === ALL_NOW) this.follow(null);
  }

  /** Shows what is of a group, and all else faintly. */
  filter(group) {
    this.group = group;
    this.tell();
  }

  /** Whether what is of a group is shown plainly. */
  passes(group) {
    return this.group === "all" || this.group === group;
  }

  isChosen(kind, id) {
    return this.object?.kind === kind && this.object.id === id;
  }
}

/** What is looked at or kept in sight as a word, such as `uav 3` or `run`, as lists and links have it; nothing for none. */
function objectWord(object) {
  return object ? [object.kind, object.id].filter((part) => part !== undefined).join(" ") : "";
}

/** The object of a word. */
function wordObject(word) {
  const [kind, id] = word.split(" ");
  const fixed = [WHOLE_RUN, ALL_NOW].find((one) => one.kind === word);
  return fixed ?? (word ? { kind, id: Number(id) } : null);
}

/** An object with the whole of its name, as it is in files. */
function wholeName(film, object) {
  return object.kind === "target" ? (film.head.targets[object.id] ?? `${object.id}`) : objectName(film, object);
}

/** An object as readers call it. */
function objectName(film, { kind, id }) {
  if (kind !== "target") return kind === "uav" ? `UAV ${id}` : `${kind} ${id}`;
  // Many files number their vehicles.
  const name = targetName(film, id);
  return /^\d+$/.test(name) ? `target ${name}` : name;
}
