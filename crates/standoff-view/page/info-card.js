// Info cards on the map: for the object under the pointer and for the selected object; and a note if the followed object does not exist.

class InfoCards {
  constructor(run, canvas) {
    this.run = run;
    this.canvas = canvas;
    /** Position of the mouse, px; `null` if it is outside the map. */
    this.pointed = null;
    this.hover = make("div", "card hover");
    this.hover.setAttribute("role", "tooltip");
    this.hover.hidden = true;
    this.chosen = make("section", "card chosen");
    this.chosen.setAttribute("aria-label", "Selected object");
    this.chosen.hidden = true;
    const bar = make("div", "bar");
    this.title = make("h2");
    this.body = make("div");
    this.follow = make("button");
    this.follow.textContent = "Follow";
    this.close = make("button");
    this.close.textContent = "Close";
    this.close.title = "Close (Escape)";
    for (const button of [this.follow, this.close]) button.type = "button";
    bar.append(this.title, this.follow, this.close);
    this.chosen.append(bar, this.body);
    const title = make("h2");
    const body = make("div");
    this.hover.append(title, body);
    this.hovered = [title, body];
    this.note = make("p", "note");
    this.note.setAttribute("role", "status");
    const dock = make("div", "dock");
    dock.append(this.note, this.chosen);
    canvas.after(dock, this.hover);
    const { selection } = run;
    this.follow.addEventListener("click", () => selection.follow(this.follows() ? null : selection.object));
    selection.on(() => this.show());
    this.close.addEventListener("click", () => {
      selection.choose(null);
      canvas.focus();
    });
  }

  /** Whether the map follows the selected object. */
  follows() {
    const { object, followed } = this.run.selection;
    return Boolean(object && followed) && objectKey(object) === objectKey(followed);
  }

  /** Updates the cards. */
  show() {
    const { run, canvas } = this;
    // Before the first drawn frame there is nothing to show.
    if (!run.replayData.parts.length || run.map.scene === NO_SCENE) return;
    const { object } = run.selection;
    this.chosen.hidden = !object;
    if (object) {
      fill(this.title, this.body, cardContents(run, object));
      this.follow.setAttribute("aria-pressed", String(this.follows()));
    }
    const under = this.pointed && !run.map.ruler ? objectsAt(run.map, ...this.pointed)[0] : undefined;
    canvas.classList.toggle("pointing", Boolean(under));
    // The card of the selected object already shows its values.
    this.hover.hidden = !under || run.selection.isChosen(under.kind, under.id);
    if (!this.hover.hidden) {
      fill(...this.hovered, cardContents(run, under));
      this.moveTo(...this.pointed);
    }
    const note = this.noteText();
    if (this.note.textContent !== note) this.note.textContent = note;
  }

  /** Moves the card next to the pointer, inside the map. */
  moveTo(x, y) {
    const { hover, canvas } = this;
    const { offsetWidth, offsetHeight } = hover;
    const nextTo = (at, size, room) => (at + 16 + size <= room ? at + 16 : Math.max(at - 16 - size, 0));
    hover.style.left = `${canvas.offsetLeft + nextTo(x, offsetWidth, canvas.clientWidth)}px`;
    hover.style.top = `${canvas.offsetTop + nextTo(y, offsetHeight, canvas.clientHeight)}px`;
  }

  /** Text stating that the followed object does not exist or is in an outage; empty otherwise. */
  noteText() {
    const { replayData, selection, map } = this.run;
    const { followed } = selection;
    if (!followed || followed === WHOLE_RUN || followed === ALL_NOW) return "";
    const one = objectIn(map.scene, followed);
    if (one) return one.out ? outageText(one) : "";
    const text = absenceText(replayData, map.scene, followed);
    return text && `${text}; the map stays in place`;
  }
}

function make(tag, name = "") {
  const made = document.createElement(tag);
  made.className = name;
  return made;
}

/** Fills a card. Existing elements are reused, and facts without a value are left out. */
function fill(head, body, { title, what, facts: all }) {
  if (!body.firstChild) body.append(make("p"), make("dl"));
  const [description, list] = body.children;
  const facts = all.filter(([, value]) => value !== "");
  const put = (element, text) => {
    if (element.textContent !== text) element.textContent = text;
  };
  writeName(head, title);
  put(description, what);
  while (list.children.length > 2 * facts.length) list.lastChild.remove();
  facts.forEach(([heading, text, about, key], index) => {
    if (!list.children[2 * index]) list.append(make("dt"), make("dd"));
    const [term, value] = [list.children[2 * index], list.children[2 * index + 1]];
    put(term, heading);
    put(value, text);
    term.title = about;
    value.dataset.field = key;
    value.classList.toggle("alarm", key === "warning" && text.startsWith("out of view"));
  });
}
