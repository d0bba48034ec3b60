// Legend of the charts: buttons that select curves.

/** Maximum number of groups that all have a button; with more groups, only those at the time shown have one. */
const MAX_GROUPS = 8;

class Legend {
  constructor(charts) {
    this.charts = charts;
    this.container = element("legend");
    /** Identifies the contents that are shown. */
    this.key = "";
    this.container.addEventListener("click", (click) => this.pressed(click.target.closest("button")));
    this.container.addEventListener("keydown", (key) => this.moved(key));
  }

  /** UAVs and groups that have a button, and the number of groups without one. */
  entries() {
    const { replayData, clock } = this.charts;
    const stepIndex = replayData.stepAt(clock.time_s);
    const groups = this.charts.idsOf("groups");
    const exists = (id) => this.charts.only.groups.has(id) || !Number.isNaN(replayData.value("groups", "x_m", id, stepIndex));
    const shown = groups.length > MAX_GROUPS ? groups.filter(exists) : groups;
    return {
      names: [...this.charts.idsOf("uavs").map((id) => ({ of: "uavs", id })), ...shown.map((id) => ({ of: "groups", id }))],
      left: groups.length - shown.length,
    };
  }

  /** Updates the buttons. */
  show() {
    const { charts } = this;
    const { names, left } = this.entries();
    const key = JSON.stringify([charts.isPaired, names, left, [...charts.only.uavs], [...charts.only.groups], charts.front?.key, palette().ground]);
    if (key === this.key) return;
    this.key = key;
    const focused = document.activeElement?.closest("#legend") ? document.activeElement.id : null;
    const buttons = names.map(({ of, id }) => {
      const button = document.createElement("button");
      button.type = "button";
      button.id = `curve-${of}-${id}`;
      button.className = "chip";
      button.dataset.of = of;
      button.dataset.curve = id;
      button.setAttribute("aria-pressed", String(charts.only[of].has(id)));
      button.classList.toggle("back", !charts.isShown({ of, id }));
      button.classList.toggle("front", charts.front?.[of].has(id) ?? false);
      button.title = `show only ${curveName(of, id)} and other selected curves`;
      // The curves of a pair have the colours of the runs.
      if (!charts.isPaired) button.append(stroke(curveColour(charts.replayData, of, id), "solid"));
      button.append(curveName(of, id));
      return button;
    });
    if (charts.only.uavs.size || charts.only.groups.size) {
      const all = document.createElement("button");
      all.type = "button";
      all.id = "curve-all";
      all.className = "chip";
      all.append("all curves");
      buttons.push(all);
    }
    const rest = document.createElement("span");
    rest.className = "hint";
    rest.append(left ? `and ${left} groups at other times` : "");
    this.container.replaceChildren(...buttons, rest);
    // The toolbar is one tab stop; the arrow keys move between buttons.
    const stop = buttons.find((button) => button.id === focused) ?? buttons[0];
    for (const button of buttons) button.tabIndex = button === stop ? 0 : -1;
    if (focused) stop?.focus();
  }

  pressed(button) {
    if (!button) return;
    const { only } = this.charts;
    if (button.id === "curve-all") {
      only.uavs.clear();
      only.groups.clear();
    } else {
      const chosen = only[button.dataset.of];
      const id = Number(button.dataset.curve);
      if (!chosen.delete(id)) chosen.add(id);
    }
    this.charts.draw();
  }

  moved(key) {
    const buttons = [...this.container.querySelectorAll("button")];
    const at = buttons.indexOf(document.activeElement);
    const to = { ArrowLeft: at - 1, ArrowUp: at - 1, ArrowRight: at + 1, ArrowDown: at + 1, Home: 0, End: buttons.length - 1 }[key.key];
    if (to === undefined || at < 0) return;
    key.preventDefault();
    key.stopPropagation();
    const next = buttons[(to + buttons.length) % buttons.length];
    for (const button of buttons) button.tabIndex = button === next ? 0 : -1;
    next.focus();
  }
}

function curveName(of, id) {
  return { uavs: `UAV ${id}`, groups: `group ${id}`, intruders: `intruder ${id}` }[of] ?? "";
}

function curveColour(replayData, of, id) {
  if (of === "groups") return groupColour(replayData, id);
  return of === "uavs" ? uavColour(replayData, id) : palette().ink;
}
