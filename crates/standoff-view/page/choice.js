// What the reader has chosen: an object to look at, and what the map keeps in view.

class Choice {
  constructor() {
    /** What is looked at: `null`, or `{kind: "uav" | "group" | "target", id}`. A group stands for its orbit, too. */
    this.object = null;
    /** What stays in the middle of the map: `null`, or an object as above. */
    this.followed = null;
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

  isChosen(kind, id) {
    return this.object?.kind === kind && this.object.id === id;
  }
}

/** An object as a word, such as `uav 3`, as lists and links have it; nothing for none. */
function objectWord(object) {
  return object ? `${object.kind} ${object.id}` : "";
}

/** The object of a word. */
function wordObject(word) {
  const [kind, id] = word.split(" ");
  return word ? { kind, id: Number(id) } : null;
}
