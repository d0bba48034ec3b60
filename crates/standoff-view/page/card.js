// Cards over a map: what is under the pointer, and what has been chosen; and a note of what cannot be followed.

class Cards {
  constructor(run, canvas) {
    this.run = run;
    this.canvas = canvas;
    /** Where a mouse points, px; `null` for nowhere. */
    this.pointed = null;
    this.hover = make("div", "card hover");
    this.hover.setAttribute("role", "tooltip");
    this.hover.hidden = true;
    this.chosen = make("section", "card chosen");
    this.chosen.setAttribute("aria-label", "What is chosen");
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
    const { choice } = run;
    this.follow.addEventListener("click", () => choice.follow(this.follows() ? null : choice.object));
    choice.on(() => this.show());
    this.close.addEventListener("click", () => {
      choice.choose(null);
      canvas.focus();
    });
  }

  follows() {
    const { object, followed } = this.run.choice;
    return Boolean(object && followed) && objectWord(object) === objectWord(followed);
  }

  /** Shows what there is to say now. */
  show() {
    const { run, canvas } = this;
    // Before the first picture there is nothing to say.
    if (!run.film.parts.length || run.map.scene === NO_SCENE) return;
    const { object } = run.choice;
    this.chosen.hidden = !object;
    if (object) {
      fill(this.title, this.body, account(run, object));
      this.follow.setAttribute("aria-pressed", String(this.follows()));
    }
    const under = this.pointed && !run.map.ruler ? objectsAt(run.map, ...this.pointed)[0] : undefined;
    canvas.classList.toggle("pointing", Boolean(under));
    this.hover.hidden = !under;
    if (under) {
      fill(...this.hovered, account(run, under));
      this.place(...this.pointed);
    }
    const words = this.lost();
    if (this.note.textContent !== words) this.note.textContent = words;
  }

  /** Beside the pointer, inside the map. */
  place(x, y) {
    const { hover, canvas } = this;
    const { offsetWidth, offsetHeight } = hover;
    const beside = (at, size, room) => (at + 16 + size <= room ? at + 16 : Math.max(at - 16 - size, 0));
    hover.style.left = `${canvas.offsetLeft + beside(x, offsetWidth, canvas.clientWidth)}px`;
    hover.style.top = `${canvas.offsetTop + beside(y, offsetHeight, canvas.clientHeight)}px`;
  }

  /** That what is followed is not there, in words. */
  lost() {
    const { film, choice, map } = this.run;
    const { followed } = choice;
    if (!followed || followed === WHOLE_RUN || followed === ALL_NOW) return "";
    const one = found(map.scene, followed);
    if (one) return one.out ? outWords(one) : "";
    const words = absence(film, map.scene, followed);
    return words && `${words}; the map stays where it is`;
  }
}

function make(tag, name = "") {
  const made = document.createElement(tag);
  made.className = name;
  return made;
}

/** Writes a card, in place where it can; of what is empty it says nothing. */
function fill(head, body, { title, what, facts: all }) {
  if (!body.firstChild) body.append(make("p"), make("dl"));
  const [say, list] = body.children;
  const facts = all.filter(([, words]) => words !== "");
  const put = (place, text) => {
    if (place.textContent !== text) place.textContent = text;
  };
  put(head, title);
  put(say, what);
  while (list.children.length > 2 * facts.length) list.lastChild.remove();
  facts.forEach(([heading, words, about, key], index) => {
    if (!list.children[2 * index]) list.append(make("dt"), make("dd"));
    const [term, value] = [list.children[2 * index], list.children[2 * index + 1]];
    put(term, heading);
    put(value, words);
    term.title = about;
    value.dataset.field = key;
  });
}
