// Text on the map. Labels do not overlap.

/** Height of a line of text, px. */
const LINE = 14;
/** Side of a grid cell, px. */
const CELL = 64;

/** The labels of one drawn frame. */
class Labels {
  constructor(ctx, { width, height }) {
    this.ctx = ctx;
    this.width = width;
    this.height = height;
    /** Boxes of labels and symbols (left, top, right, bottom, px), by the cells of a grid that they touch. */
    this.taken = new Map();
  }

  /** Draws a label next to a position, offset by `dx` and `dy`, where it overlaps no other label; draws nothing if there is no space. */
  nextTo(text, x, y, dx, dy) {
    const width = this.ctx.measureText(text).width;
    const corners = [[x + dx, y + dy], [x + dx, y - dy], [x - dx - width, y + dy], [x - dx - width, y - dy],
      [x - width / 2, y + dy + LINE], [x - width / 2, y - dy - LINE]];
    for (const [left, middle] of corners) {
      const box = [left - 1, middle - LINE / 2, left + width + 1, middle + LINE / 2];
      if (!this.isFree(box)) continue;
      this.take(box);
      this.write(text, left, middle);
      return;
    }
  }

  /** Keeps labels away from a symbol. */
  reserve(x, y, r) {
    this.take([x - r, y - r, x + r, y + r]);
  }

  /** Keeps labels away from a box. */
  take(box) {
    for (const cell of Labels.cells(box)) {
      if (!this.taken.has(cell)) this.taken.set(cell, []);
      this.taken.get(cell).push(box);
    }
  }

  /** Keys of the cells that a box touches. */
  static *cells(box) {
    const [left, top, right, bottom] = box.map((px) => Math.floor(px / CELL));
    for (let column = left; column <= right; column++) for (let row = top; row <= bottom; row++) yield column * 4096 + row;
  }

  isFree([left, top, right, bottom]) {
    if (left < 0 || top < 0 || right > this.width || bottom > this.height) return false;
    const isApart = (box) => left >= box[2] || right <= box[0] || top >= box[3] || bottom <= box[1];
    for (const cell of Labels.cells([left, top, right, bottom])) if (!(this.taken.get(cell) ?? []).every(isApart)) return false;
    return true;
  }

  /** Draws a text with an outline in the background colour, so that it is legible on lines. */
  write(text, x, y) {
    const { ctx } = this;
    ctx.textBaseline = "middle";
    ctx.strokeStyle = palette().ground;
    ctx.lineWidth = 3;
    ctx.strokeText(text, x, y);
    ctx.fillText(text, x, y);
  }

  /** Draws a text in any case, moved inside the map if it would be cut off. */
  writeInside(text, x, y) {
    const width = this.ctx.measureText(text).width;
    const inside = (value, most) => Math.max(Math.min(value, most), 6);
    this.write(text, inside(x, this.width - width - 6), inside(y, this.height - LINE));
  }
}

/** A name from a file, shortened to 24 characters, with invisible characters replaced by U+FFFD. */
function shortName(name) {
  const text = String(name).replace(/[\p{Cc}\p{Cf}\p{Cs}\p{Zl}\p{Zp}]/gu, "\ufffd");
  return text.length > 24 ? `${text.slice(0, 23)}\u2026` : text;
}

/** Key of the first track of no target. */
const NO_TARGET = 2 ** 30;

/** The full name of a target, or of a track of no target. */
function fullTargetName(replayData, id) {
  return replayData.head.targets[id] ?? (id < NO_TARGET ? `${id}` : `track ${id - NO_TARGET}`);
}

/** The name of a target as shown on the page. */
function targetName(replayData, id) {
  return shortName(fullTargetName(replayData, id));
}

/** Draws the names of visible objects, the most important first; names without space are left out. */
function drawNames(map, { ctx, labels, scene, size }) {
  const { camera, selection, replayData } = map;
  const isVisible = (one) => camera.shows(one.x_m, one.y_m, 0) && selection.passes(one.group);
  ctx.fillStyle = palette().ink;
  for (const uav of scene.uavs) if (isVisible(uav)) labels.reserve(...camera.at(uav.x_m, uav.y_m), 9);
  for (const uav of scene.uavs) {
    if (!isVisible(uav)) continue;
    const out = uav.out ? " (outage)" : "";
    labels.nextTo(`UAV ${uav.id}${out}`, ...camera.at(uav.x_m, uav.y_m), 15, 14);
  }
  for (const group of scene.groups) {
    if (camera.shows(group.x_m, group.y_m, 0) && selection.passes(group.id)) {
      labels.nextTo(`group ${group.id}`, ...camera.at(group.x_m, group.y_m), 8, 10);
    }
  }
  ctx.font = "11px system-ui, sans-serif";
  const inSight = map.drawn.filter(({ target }) => target.tracked && isVisible(target));
  const few = inSight.length > MAX_NAMED ? mostUrgent(inSight, selection) : inSight;
  const named = few.map(({ target, x, y }) => {
    const warning = warningOf(target);
    // Among many targets, the symbol alone shows the warning.
    const text = warning && target.receiving_group !== null ? groupOfTarget(target) : warning;
    const suffix = warning && !target.out_of_view && inSight.length <= MAX_NAMED ? ` (${text})` : "";
    return { x, y, first: warning || selection.isChosen("target", target.id), name: `${targetName(replayData, target.id)}${suffix}` };
  });
  for (const { x, y, name } of [...named.filter((one) => one.first), ...named.filter((one) => !one.first)]) {
    labels.nextTo(name, x, y, 8 * size, 10);
  }
}

/** Maximum number of visible targets that have names. */
const MAX_NAMED = 60;

/** The selected target, those out of view, the longest first and members of groups before others, and those in handoff. */
function mostUrgent(drawn, selection) {
  const rank = ({ target }) => {
    if (selection.isChosen("target", target.id)) return 0;
    if (target.out_of_view) return target.group === null ? 2 : 1;
    return target.membership === "in-handoff" ? 3 : 4;
  };
  const out_s = ({ target }) => (target.out_of_view ? target.out_of_view_s : 0);
  const urgent = drawn.filter((one) => rank(one) < 4).sort((a, b) => rank(a) - rank(b) || out_s(b) - out_s(a) || a.target.id - b.target.id);
  return urgent.slice(0, MAX_NAMED);
}
