// Symbols on the map. Symbols of one colour are drawn as one path, because this keeps the frame rate high with hundreds of targets.

/** Square root of the 95 % quantile of a chi-square of two degrees of freedom. */
const SIGMAS = Math.sqrt(5.991);

/** Groups items by the value of a function, in the order of first occurrence. */
function grouped(items, of) {
  const found = new Map();
  for (const item of items) {
    const key = of(item);
    const some = found.get(key);
    if (some) some.push(item);
    else found.set(key, [item]);
  }
  return found;
}

/** Draws one path for all items of a colour: `add` adds an item to the path, `end` is "stroke" or "fill". */
function inkedTogether(pen, items, colourOf, add, end = "stroke") {
  for (const [colour, some] of grouped(items, colourOf)) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.beginPath();
    for (const item of some) add(item);
    pen[end]();
  }
}

function addDisc(pen, x, y, r) {
  pen.moveTo(x + r, y);
  pen.arc(x, y, r, 0, 2 * Math.PI);
}

function addCross(pen, x, y, r) {
  pen.moveTo(x - r, y - r);
  pen.lineTo(x + r, y + r);
  pen.moveTo(x - r, y + r);
  pen.lineTo(x + r, y - r);
}

function addPlus(pen, x, y, r) {
  pen.moveTo(x - r, y);
  pen.lineTo(x + r, y);
  pen.moveTo(x, y - r);
  pen.lineTo(x, y + r);
}

/** Draws grid lines at round distances. */
function drawGrid(map, { pen }) {
  const { camera } = map;
  const step_m = map.step_m();
  const [west, north] = camera.world(0, 0);
  const [east, south] = camera.world(camera.width, camera.height);
  pen.strokeStyle = palette().grid;
  pen.beginPath();
  for (let x_m = Math.ceil(west / step_m) * step_m; x_m < east; x_m += step_m) {
    const [x] = camera.at(x_m, 0);
    pen.moveTo(x, 0);
    pen.lineTo(x, camera.height);
  }
  for (let y_m = Math.ceil(south / step_m) * step_m; y_m < north; y_m += step_m) {
    const [, y] = camera.at(0, y_m);
    pen.moveTo(0, y);
    pen.lineTo(camera.width, y);
  }
  pen.stroke();
  drawScale(map, pen);
}

/** Draws the scale bar, which is one grid step long, and the north arrow. */
function drawScale(map, pen) {
  const { camera } = map;
  const step_m = map.step_m();
  pen.strokeStyle = pen.fillStyle = palette().faint;
  const length = step_m * camera.px_per_m;
  const [left, low] = [16, camera.height - 16];
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(left, low - 5);
  pen.lineTo(left, low);
  pen.lineTo(left + length, low);
  pen.lineTo(left + length, low - 5);
  pen.stroke();
  pen.fillText(`${metres(step_m)}`, left + 6, low - 6);
  pen.textAlign = "center";
  pen.fillText("N", left + 8, low - 58);
  pen.beginPath();
  pen.moveTo(left + 8, low - 54);
  pen.lineTo(left + 13, low - 36);
  pen.lineTo(left + 8, low - 40);
  pen.lineTo(left + 3, low - 36);
  pen.fill();
}

/** Draws the true positions of targets. */
function drawTruth(map, { pen, scene, size }) {
  const visible = (scene.targets ?? []).filter((target) => target.there && map.camera.sees(target.true_x_m, target.true_y_m));
  const { faint } = palette();
  pen.lineWidth = 1.25;
  inkedTogether(pen, visible, ({ group }) => (map.selection.passes(group) ? faint : faded(faint, 0.2)), (target) => {
    const [x, y] = map.camera.at(target.true_x_m, target.true_y_m);
    addCross(pen, x, y, 3 * size);
  });
}

/** Draws the 95 % confidence ellipses of targets; ellipses smaller than the symbol are left out. */
function drawEllipses(map, { pen, size }) {
  const seen = [];
  for (const { target, x, y } of map.drawn) {
    if (!target.tracked) continue;
    const [long, wide, turn_rad] = ellipseOf(target.covariance).map((value, k) => (k < 2 ? value * map.camera.px_per_m : value));
    if (long > 4.5 * size) seen.push({ target, x, y, long, wide, turn_rad });
  }
  pen.lineWidth = 1.25;
  for (const [isHeld, some] of grouped(seen, ({ target }) => target.status === "updated")) {
    pen.setLineDash(isHeld ? [] : [3, 3]);
    const faint = map.drawn.length > MOST_NAMED ? 0.25 : 0.45;
    const ink = ({ target: { group } }) => map.ink(group, group === null ? faint : 1);
    inkedTogether(pen, some, ink, ({ x, y, long, wide, turn_rad }) => {
      pen.moveTo(x + long * Math.cos(turn_rad), y - long * Math.sin(turn_rad));
      pen.ellipse(x, y, long, wide, -turn_rad, 0, 2 * Math.PI);
    });
  }
}

/** Semi-axes of the 95 % confidence ellipse, m, and the direction of the major axis, rad. */
function ellipseOf([xx, xy, yy]) {
  const middle = (xx + yy) / 2;
  const off = Math.hypot((xx - yy) / 2, xy);
  const axis_m = (variance) => SIGMAS * Math.sqrt(Math.max(variance, 0));
  return [axis_m(middle + off), axis_m(middle - off), 0.5 * Math.atan2(2 * xy, xx - yy)];
}

/** Draws tracks. Updated: disc. Coasting or cued: ring. Ungrouped: square. In handoff: two rings. Removed from its group: cross. */
function drawTracks(map, { pen, labels, size }) {
  const looks = grouped(map.drawn.filter(({ target }) => target.tracked), ({ target }) =>
    target.membership === "removed" || target.membership === "ungrouped" ? target.membership : target.status === "updated" ? "updated" : "ring");
  const ink = ({ target }) => map.ink(target.group);
  const draw = (some, of, add, end) => inkedTogether(pen, some ?? [], of, add, end);
  pen.lineWidth = size < 0.8 ? 1.25 : 2;
  const half = 4 * size;
  draw(looks.get("ungrouped"), ink, ({ x, y }) => pen.rect(x - half, y - half, 2 * half, 2 * half));
  draw(looks.get("removed"), ink, ({ x, y }) => addCross(pen, x, y, 5 * size));
  draw(looks.get("ring"), ink, ({ x, y }) => addDisc(pen, x, y, 4.5 * size));
  draw(looks.get("updated"), ink, ({ x, y }) => addDisc(pen, x, y, 4.5 * size), "fill");
  const passing = map.drawn.filter(({ target }) => target.tracked && target.membership === "in-handoff");
  draw(passing, ({ target }) => map.ink(target.receiving_group), ({ x, y }) => addDisc(pen, x, y, 8 * size));
  const { alarm } = palette();
  pen.lineWidth = 2.5;
  const hidden = map.drawn.filter(({ target }) => target.out_of_view && map.selection.passes(target.group));
  draw(hidden, () => alarm, ({ x, y }) => addDisc(pen, x, y, 12));
  pen.fillStyle = alarm;
  for (const { x, y } of hidden) labels.nextTo("out of view", x, y, 15, 8);
}

/** Outline of a UAV, nose along x, px. */
const AIRCRAFT = [[13, 0], [2, 2.2], [0, 12], [-4, 12], [-2.5, 2], [-9, 1.5], [-11, 5], [-13, 5], [-12, 0], [-13, -5], [-11, -5],
  [-9, -1.5], [-2.5, -2], [-4, -12], [0, -12], [2, -2.2]];

/** Draws UAVs. For a UAV that has dropped out it also draws the last position known to the team. */
function drawUavs(map, { pen, labels, scene }) {
  const { camera, replayData, selection } = map;
  for (const uav of scene.uavs) {
    const isFaint = uav.out || !selection.passes(uav.group);
    const colour = uavColour(replayData, uav.id);
    if (camera.sees(uav.x_m, uav.y_m)) {
      const [x, y] = camera.at(uav.x_m, uav.y_m);
      const [cos, sin] = [Math.cos(uav.heading_rad), Math.sin(uav.heading_rad)];
      pen.fillStyle = isFaint ? faded(colour, 0.35) : colour;
      pen.strokeStyle = palette().ground;
      pen.lineWidth = 1.5;
      pen.beginPath();
      // The y axis of the canvas points down.
      for (const [dx, dy] of AIRCRAFT) pen.lineTo(x + dx * cos + dy * sin, y - dx * sin + dy * cos);
      pen.closePath();
      pen.stroke();
      pen.fill();
    }
    if (uav.out && camera.sees(uav.out.x_m, uav.out.y_m)) {
      const [x, y] = camera.at(uav.out.x_m, uav.out.y_m);
      const { alarm } = palette();
      pen.strokeStyle = pen.fillStyle = alarm;
      pen.lineWidth = 3;
      pen.beginPath();
      addCross(pen, x, y, 9);
      pen.stroke();
      labels.nextTo(outageText(uav), x, y, 13, 8);
    }
  }
}

/** Outline of an intruder: an arrowhead, nose along x, px. */
const INTRUDER = [[14, 0], [-10, 9], [-5, 0], [-10, -9]];

/** Draws intruders; hollow while the transponder is off. */
function drawIntruders(map, { pen, labels, scene }) {
  const { alarm, ground } = palette();
  for (const { id, x_m, y_m, heading_rad, transponder_on } of scene.intruders) {
    if (!map.camera.sees(x_m, y_m)) continue;
    const [x, y] = map.camera.at(x_m, y_m);
    const [cos, sin] = [Math.cos(heading_rad), Math.sin(heading_rad)];
    pen.beginPath();
    for (const [dx, dy] of INTRUDER) pen.lineTo(x + dx * cos + dy * sin, y - dx * sin + dy * cos);
    pen.closePath();
    pen.fillStyle = transponder_on ? alarm : ground;
    pen.strokeStyle = alarm;
    pen.lineWidth = 1.5;
    pen.fill();
    pen.stroke();
    pen.fillStyle = alarm;
    // The offset keeps the label clear of the selection ring.
    labels.nextTo(`intruder ${id}${transponder_on ? "" : ", transponder off"}`, x, y, 22, 8);
  }
}

/** Text stating since when a UAV has dropped out. */
function outageText({ id, out }) {
  return `UAV ${id} dropped out at ${out.since_s.toFixed(1)} s`;
}

/** The smallest round number (1, 2 or 5 times a power of ten) that is not less than a value. */
function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value * (1 - 1e-9));
}

/** Formats a distance. */
function metres(value_m) {
  if (value_m >= 10000) return `${(value_m / 1000).toFixed(1)} km`;
  return `${value_m >= 10 ? value_m.toFixed(0) : value_m.toPrecision(2)} m`;
}
