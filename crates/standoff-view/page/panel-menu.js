// The list of chart panels: shows and hides them, explains them, and adds panels of further quantities.

class PanelMenu {
  constructor(charts) {
    this.charts = charts;
    /** Keys of the hidden panels. */
    this.hidden = new Set();
    this.list = element("panel-list");
    this.button = element("panel-selection");
    this.button.addEventListener("click", () => this.open(this.list.hidden));
    document.addEventListener("pointerdown", ({ target }) => this.list.contains(target) || this.button.contains(target) || this.open(false));
    // This listener runs before those of the page.
    document.addEventListener("keydown", (key) => {
      if (key.key !== "Escape" || this.list.hidden) return;
      key.stopPropagation();
      if (this.list.contains(document.activeElement)) this.button.focus();
      this.open(false);
    }, true);
  }

  /** Opens or closes the list. */
  open(isOpen) {
    this.list.hidden = !isOpen;
    this.button.setAttribute("aria-expanded", String(isOpen));
    this.fill(isOpen);
  }

  /** Columns that can be shown in a panel of their own, by table. */
  quantities() {
    const tables = this.charts.replayData.parts[0]?.tables ?? {};
    const columns = (of) => [...(tables[of]?.columns.keys() ?? [])].filter((column) => column !== "colour");
    return Object.keys(QUANTITY_TABLES).map((of) => [of, columns(of)]).filter(([, columns]) => columns.length);
  }

  /** Shows or hides a panel, by its key; adds the panel of a quantity, or removes it. */
  toggle(key, isShown) {
    const { charts } = this;
    const panel = charts.panels.find(({ spec }) => spec.key === key);
    if (!panel) {
      const [of, column] = key.split(".");
      charts.panels.push(new Panel(columnPanel(of, column)));
      element("panels").append(charts.panels.at(-1).section);
    } else if (panel.spec.isAdded && !isShown) {
      charts.panels = charts.panels.filter((other) => other !== panel);
      panel.section.remove();
    } else if (isShown) this.hidden.delete(key);
    else this.hidden.add(key);
    charts.draw();
  }

  /** Keys of the panels that can be shown. */
  get keys() {
    return [...PANELS.map(({ key }) => key), ...this.quantities().flatMap(([of, columns]) => columns.map((column) => `${of}.${column}`))];
  }

  /** Shows exactly the panels with these keys. */
  choose(keys) {
    for (const { spec } of this.charts.panels) if (spec !== TARGET_PANEL && !keys.includes(spec.key)) this.toggle(spec.key, false);
    for (const key of keys) this.toggle(key, true);
  }

  /** The shown panels for a link; empty for the default panels. */
  get word() {
    const keys = this.charts.panels.map(({ spec }) => spec.key).filter((key) => key !== TARGET_PANEL.key && !this.hidden.has(key));
    return keys.join() === PANELS.map(({ key }) => key).join() ? "" : keys.join() || "none";
  }

  /** Fills the list while it is open, and places it below its button. */
  fill(isOpen) {
    const { list, charts } = this;
    const hint = make("p");
    hint.append("Click in a chart to go to that time; drag to zoom in on a time range; double-click to show the whole run.");
    const specs = charts.panels.map(({ spec }) => spec).filter((spec) => spec !== TARGET_PANEL);
    list.replaceChildren(...(isOpen ? [hint, this.adder(), ...specs.flatMap((spec) => this.row(spec))] : []));
    // The list does not cover the time slider.
    const bottom = document.querySelector("footer").getBoundingClientRect().top / pageZoom();
    const top = Math.min(this.button.getBoundingClientRect().bottom / pageZoom() + 4, bottom / 2);
    list.style.top = `${top}px`;
    list.style.right = "8px";
    list.style.maxHeight = `${bottom - top - 8}px`;
  }

  /** The check box of a panel with its description. */
  row(spec) {
    const box = make("input");
    box.type = "checkbox";
    box.checked = !this.hidden.has(spec.key);
    box.name = `panel-${spec.key}`;
    box.addEventListener("change", () => this.toggle(spec.key, box.checked));
    const label = make("label");
    label.append(box, ` ${spec.title}`);
    const about = make("p");
    about.append(spec.about);
    return [label, about];
  }

  /** The list of quantities that can be added. */
  adder() {
    const select = make("select");
    select.id = "add-quantity";
    const first = make("option");
    first.value = "";
    first.append("choose a quantity");
    select.append(first);
    for (const [of, columns] of this.quantities()) {
      const some = make("optgroup");
      some.label = QUANTITY_TABLES[of];
      for (const column of columns) {
        const { name, unit } = quantity(column);
        const option = make("option");
        option.value = `${of}.${column}`;
        option.append(unit ? `${name} (${unit})` : name);
        some.append(option);
      }
      select.append(some);
    }
    select.addEventListener("change", () => {
      if (!select.value) return;
      this.toggle(select.value, true);
      this.fill(true);
    });
    const label = make("label");
    label.append("Add a chart ", select);
    return label;
  }
}
