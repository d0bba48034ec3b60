// The table of targets: sorted by any column and filtered by state. Of a long table only the visible rows are in the document.

/** Number of rows up to which all are in the document. */
const FEW_ROWS = 60;
/** Rows of longer tables in the document above and below the visible part. */
const SPARE_ROWS = 4;

/** Columns of which the largest values are most interesting: the first click on the heading sorts them in descending order. */
const DESCENDING = new Set(["out_of_view_s", "error_m"]);

/** Compares two values: numbers or texts. `null` and NaN come last in both directions. */
function compared(a, b, sign) {
  const isMissing = (value) => value === null || Number.isNaN(value);
  if (isMissing(a) || isMissing(b)) return isMissing(a) - isMissing(b);
  return a < b ? -sign : a > b ? sign : 0;
}

/** Ranks of the target names, with numbers in names in numerical order, by replay. */
const NAME_RANKS = new WeakMap();

function nameRank(replayData, id) {
  const { targets } = replayData.head;
  if (NAME_RANKS.get(targets) === undefined) {
    const { compare } = new Intl.Collator("en", { numeric: true });
    const ranks = [];
    [...targets.keys()].sort((a, b) => compare(targets[a], targets[b]) || a - b).forEach((target, rank) => (ranks[target] = rank));
    NAME_RANKS.set(targets, ranks);
  }
  return NAME_RANKS.get(targets)[id] ?? id;
}

class TargetTable {
  constructor(page) {
    this.page = page;
    this.table = element("targets");
    this.body = this.table.tBodies[0];
    this.panel = this.table.closest(".scrolled");
    this.none = element("no-targets");
    /** Targets of the shown time that the other filters leave, and those that are listed. */
    this.targets = [];
    this.items = [];
    /** Rows in the document, by index in the list. */
    this.rows = new Map();
    /** The state of the listed targets; `null` for all. */
    this.state = null;
    this.sort = { key: "warning", sign: 1 };
    /** The target whose row is the tab stop of the table; `null` for the first row. */
    this.stop = null;
    this.headings();
    this.chips = new Map([[null, "all"], ...TARGET_STATES.map(([key, text]) => [key, text])].map(([key, text]) => [key, this.chip(key, text)]));
    this.panel.addEventListener("scroll", () => this.fill());
    new ResizeObserver(() => this.update()).observe(this.panel);
    this.body.addEventListener("keydown", (key) => this.onKey(key));
    this.body.addEventListener("focusin", ({ target }) => (this.stop = Number(target.closest("tr").dataset.id)));
  }

  /** Writes the headings: buttons that sort the table. */
  headings() {
    headings(this.table, TARGET_COLUMNS);
    [...this.table.tHead.rows[0].cells].forEach((cell, column) => {
      const [key, heading] = TARGET_COLUMNS[column];
      const button = make("button");
      button.type = "button";
      button.textContent = heading;
      button.addEventListener("click", () => {
        const sign = this.sort.key === key ? -this.sort.sign : DESCENDING.has(key) ? -1 : 1;
        this.sort = { key, sign };
        this.update();
      });
      cell.dataset.sort = key;
      cell.replaceChildren(button);
    });
  }

  /** Creates the button of a filter. */
  chip(key, text) {
    const button = make("button", "chip");
    button.type = "button";
    button.dataset.state = key ?? "all";
    button.dataset.text = text;
    button.title = TARGET_STATES.find(([state]) => state === key)?.[3] ?? "Existing targets, and tracks without a known true target";
    button.addEventListener("click", () => this.filter(key));
    element("target-filter").append(button);
    return button;
  }

  /** Lists the targets in a state; `null` lists all. */
  filter(state) {
    this.state = state;
    this.update();
  }

  /** Shows targets. */
  show(targets) {
    this.targets = targets;
    this.update();
  }

  /** Filters and sorts the targets, if the table is on the page. */
  update() {
    if (this.panel.hidden) return;
    const { targets, state, sort, page } = this;
    const isIn = new Map(TARGET_STATES.map(([key, , condition]) => [key, condition]));
    for (const [key, chip] of this.chips) {
      const text = `${chip.dataset.text} ${key === null ? targets.length : targets.filter(isIn.get(key)).length}`;
      if (chip.textContent !== text) chip.textContent = text;
      chip.setAttribute("aria-pressed", String(key === state));
    }
    for (const cell of this.table.tHead.rows[0].cells) {
      if (cell.dataset.sort !== sort.key) cell.removeAttribute("aria-sort");
      else cell.setAttribute("aria-sort", sort.sign > 0 ? "ascending" : "descending");
    }
    const value = sort.key === "name" ? ({ id }) => nameRank(page.replayData, id) : TARGET_COLUMNS.find(([key]) => key === sort.key)[4];
    const listed = (state === null ? targets : targets.filter(isIn.get(state))).map((target) => ({ target, value: value(target) }));
    // Equal targets: those that are out of view for the longest time come first.
    const out_s = ({ target }) => (target.out_of_view ? target.out_of_view_s : 0);
    listed.sort((a, b) => compared(a.value, b.value, sort.sign) || out_s(b) - out_s(a) || a.target.id - b.target.id);
    this.items = listed.map(({ target }) => target);
    this.table.setAttribute("aria-rowcount", this.items.length + 1);
    this.none.textContent = this.items.length ? "" : state === null ? "no targets" : `no targets ${this.chips.get(state).dataset.text}`;
    this.fill();
  }

  /** Height of a row as set in the style sheet, px. */
  get row_px() {
    return Number.parseFloat(getComputedStyle(this.table).getPropertyValue("--row"));
  }

  /** Position of the first row in the scrolled panel, and height of the headings that stay visible above the rows, px. */
  place() {
    const { panel, body, table } = this;
    const [pane, box] = [panel.getBoundingClientRect(), body.getBoundingClientRect()];
    // On very large screens the page is zoomed.
    const scale = pane.height / panel.offsetHeight || 1;
    return { top_px: (box.top - pane.top) / scale + panel.scrollTop, head_px: table.tHead.offsetHeight };
  }

  /** Puts the visible rows into the document, for the printer all rows. */
  fill() {
    const { panel, items, body, rows } = this;
    if (!panel.clientHeight) return;
    const { row_px } = this;
    const from_px = panel.scrollTop - this.place().top_px;
    const at = (index) => Math.min(Math.max(index, 0), items.length);
    const isLong = !isPrinting && items.length > FEW_ROWS;
    const first = isLong ? at(Math.floor(from_px / row_px) - SPARE_ROWS) : 0;
    const end = isLong ? at(Math.ceil((from_px + panel.clientHeight) / row_px) + SPARE_ROWS) : Math.min(items.length, MAX_PRINTED);
    const focused = body.contains(document.activeElement) ? Number(document.activeElement.closest("tr").dataset.id) : null;
    const unused = [];
    for (const [index, row] of rows) {
      if (index >= first && index < end) continue;
      rows.delete(index);
      unused.push(row);
    }
    let before = null;
    for (let index = first; index < end; index++) {
      const row = rows.get(index) ?? unused.pop() ?? this.row();
      rows.set(index, row);
      if (row.previousSibling !== before || !row.parentNode) body.insertBefore(row, before ? before.nextSibling : body.firstChild);
      before = row;
      this.write(row, index);
    }
    for (const row of unused) row.remove();
    body.style.setProperty("--above", `${first * row_px}px`);
    body.style.setProperty("--below", `${(items.length - end) * row_px}px`);
    this.setTabStop(first, end);
    // The focus stays at its target when the order changes.
    if (focused !== null && Number(document.activeElement.closest("tr")?.dataset.id) !== focused) this.rowOf(focused)?.cells[0].firstChild.focus({ preventScroll: true });
  }

  /** Makes one row the tab stop of the table, because there may be hundreds of rows. */
  setTabStop(first, end) {
    const { items, rows } = this;
    const chosen = [this.page.selection.object?.kind === "target" ? this.page.selection.object.id : null, this.stop]
      .map((id) => items.findIndex((item) => item.id === id)).find((index) => index >= first && index < end);
    const stop = chosen ?? first;
    for (const [index, row] of rows) row.cells[0].firstChild.tabIndex = index === stop ? 0 : -1;
  }

  rowOf(id) {
    return [...this.rows.values()].find((row) => Number(row.dataset.id) === id);
  }

  /** Creates a row. */
  row() {
    const row = make("tr");
    TARGET_COLUMNS.forEach(([key], column) => {
      const cell = row.insertCell();
      cell.dataset.field = key;
      const label = make(column === 0 ? "button" : "div", "clipped");
      if (column === 0) label.type = "button";
      cell.append(label);
    });
    return row;
  }

  /** Writes a target into a row. */
  write(row, index) {
    const item = { ...this.items[index], name: targetName(this.page.replayData, this.items[index].id) };
    row.dataset.id = item.id;
    row.setAttribute("aria-rowindex", index + 2);
    TARGET_COLUMNS.forEach(([, , textOf], column) => {
      const label = row.cells[column].firstChild;
      const text = textOf(item);
      if (label.textContent === text) return;
      if (column === 0) writeName(label, text);
      else label.textContent = text;
      // Long texts are cut off after two lines.
      label.title = text.length > 14 ? text : "";
    });
    markRow(row, item, this.page.selection.isChosen("target", item.id));
  }

  /** Scrolls to the row of a target; returns whether the table is visible. */
  scrollTo(id) {
    if (!this.panel.clientHeight) return false;
    const index = this.items.findIndex((item) => item.id === id);
    if (index >= 0) this.scrollToIndex(index);
    return true;
  }

  scrollToIndex(index) {
    const { panel, row_px } = this;
    const { top_px, head_px } = this.place();
    const row_top_px = top_px + index * row_px;
    const most_px = row_top_px - head_px;
    const least_px = row_top_px + row_px - panel.clientHeight;
    panel.scrollTop = Math.min(Math.max(panel.scrollTop, least_px), most_px);
    this.fill();
  }

  /** Scrolls to the table. */
  scrollToTop() {
    element("target-filter").scrollIntoView({ block: "start" });
    this.fill();
  }

  /** Moves the focus between rows. */
  onKey(key) {
    const row = key.target.closest("tr");
    const page = Math.max(1, Math.floor(this.panel.clientHeight / this.row_px) - 2);
    const moves = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -Infinity, End: Infinity };
    if (!row || !(key.key in moves) || key.ctrlKey || key.metaKey || key.altKey) return;
    key.preventDefault();
    key.stopPropagation();
    const index = this.items.findIndex((item) => item.id === Number(row.dataset.id));
    const next = Math.min(Math.max(index + moves[key.key], 0), this.items.length - 1);
    this.scrollToIndex(next);
    this.rows.get(next)?.cells[0].firstChild.focus({ preventScroll: true });
  }
}
