// Legend of the charts: buttons that select curves.

/**
 * Maximum number of groups that all have a button; with more groups, only those at the time shown have one. Of many objects at one
 * time, only selected and emphasised ones have a button.
 */
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

  /** UAVs and groups that have a button, and a text about the others. */
  entries() {
    const { replayData, clock, only, front } = this.charts;
    const stepIndex = replayData.stepAt(clock.time_s);
    const isNow = (id) => !Number.isNaN(replayData.value("groups", "x_m", id, stepIndex));
    const [names, many, others] = [[], [], []];
    for (const [of, kind] of [["uavs", "UAVs"], ["groups", "groups"]]) {
      const ids = this.charts.idsOf(of);
      const isMany = this.charts.isMany(of);
      const isListed = isMany ? (id) => front?.[of].has(id) : of === "groups" && ids.length > MAX_GROUPS ? isNow : () => true;
      const listed = ids.filter((id) => only[of].has(id) || isListed(id));
      names.push(...listed.map((id) => ({ of, id })));
      if (isMany) many.push(`${formatCount(ids.length)} ${kind}`);
      else if (listed.length < ids.length) others.push(`and ${ids.length - listed.length} ${kind} at other times`);
    }
    if (many.length) others.unshift(`${many.join(", ")}: smallest, median and largest value; select an object to add its curves`);
    return { names, rest: others.join("; ") };
  }

  /** Updates the buttons. */
  show() {
    const { charts } = this;
    const { names, rest } = this.entries();
    const key = JSON.stringify([charts.isPaired, names, rest, [...charts.only.uavs], [...charts.only.groups], charts.front?.key, palette().ground]);
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
    const hint = document.createElement("span");
    hint.className = "hint";
    hint.append(rest);
    this.container.replaceChildren(...buttons, hint);
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
