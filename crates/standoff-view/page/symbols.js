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
function drawByColour(ctx, items, colourOf, add, end = "stroke") {
  for (const [colour, some] of grouped(items, colourOf)) {
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.beginPath();
    for (const item of some) add(item);
    ctx[end]();
  }
}

function addDisc(ctx, x, y, r) {
  ctx.moveTo(x + r, y);
  ctx.arc(x, y, r, 0, 2 * Math.PI);
}

function addCross(ctx, x, y, r) {
  ctx.moveTo(x - r, y - r);
  ctx.lineTo(x + r, y + r);
  ctx.moveTo(x - r, y + r);
  ctx.lineTo(x + r, y - r);
}

function addPlus(ctx, x, y, r) {
  ctx.moveTo(x - r, y);
  ctx.lineTo(x + r, y);
  ctx.moveTo(x, y - r);
  ctx.lineTo(x, y + r);
}

/** Draws grid lines at round distances. */
function drawGrid(map, { ctx }) {
  const { camera } = map;
  const step_m = map.step_m();
  const [west, north] = camera.world(0, 0);
  const [east, south] = camera.world(camera.width, camera.height);
  ctx.strokeStyle = palette().grid;
  ctx.beginPath();
  for (let x_m = Math.ceil(west / step_m) * step_m; x_m < east; x_m += step_m) {
    const [x] = camera.at(x_m, 0);
    ctx.moveTo(x, 0);
    ctx.lineTo(x, camera.height);
  }
  for (let y_m = Math.ceil(south / step_m) * step_m; y_m < north; y_m += step_m) {
    const [, y] = camera.at(0, y_m);
    ctx.moveTo(0, y);
    ctx.lineTo(camera.width, y);
  }
  ctx.stroke();
  drawScale(map, ctx);
}

/** Draws the scale bar, which is one grid step long, and the north arrow. */
function drawScale(map, ctx) {
  const { camera } = map;
  const step_m = map.step_m();
  ctx.strokeStyle = ctx.fillStyle = palette().faint;
  const length = step_m * camera.px_per_m;
  const [left, low] = [16, camera.height - 16];
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.moveTo(left, low - 5);
  ctx.lineTo(left, low);
  ctx.lineTo(left + length, low);
  ctx.lineTo(left + length, low - 5);
  ctx.stroke();
  ctx.fillText(`${formatDistance(step_m)}`, left + 6, low - 6);
  ctx.textAlign = "center";
  ctx.fillText("N", left + 8, low - 58);
  ctx.beginPath();
  ctx.moveTo(left + 8, low - 54);
  ctx.lineTo(left + 13, low - 36);
  ctx.lineTo(left + 8, low - 40);
  ctx.lineTo(left + 3, low - 36);
  ctx.fill();
}

/** Draws the mean wind at the UAVs: an arrow in its direction, with speed and the compass direction it blows from. */
function drawWind(map, { ctx, scene }) {
  const [speed_m_s, toward_rad] = windAt(scene);
  if (Number.isNaN(speed_m_s)) return;
  const { camera } = map;
  const [x, y, half] = [66, camera.height - 61, 17];
  const [cos, sin] = [Math.cos(toward_rad), Math.sin(toward_rad)];
  // Positions along and across the arrow; the y axis of the canvas points down.
  const to = (along, across) => ctx.lineTo(x + along * cos + across * sin, y - along * sin + across * cos);
  ctx.strokeStyle = ctx.fillStyle = palette().ink;
  ctx.lineWidth = 2;
  ctx.beginPath();
  to(-half, 0);
  to(half - 8, 0);
  ctx.stroke();
  ctx.beginPath();
  to(half, 0);
  to(half - 10, 5);
  to(half - 10, -5);
  ctx.fill();
  ctx.fillText(`wind ${fixed(speed_m_s, 1)} m/s from ${windFrom(toward_rad)}\u00b0`, x + half + 8, y + 4);
}

/** Draws the true positions of targets. */
function drawTruth(map, { ctx, scene, size }) {
  const isDrawn = ({ id }) => map.shown.has("truth") || map.selection.isChosen("target", id);
  const visible = (scene.targets ?? []).filter((target) => target.exists && isDrawn(target) && map.camera.shows(target.true_x_m, target.true_y_m));
  const { faint } = palette();
  ctx.lineWidth = 1.25;
  drawByColour(ctx, visible, ({ group }) => (map.selection.passes(group) ? faint : faded(faint, 0.2)), (target) => {
    const [x, y] = map.camera.at(target.true_x_m, target.true_y_m);
    addCross(ctx, x, y, 3 * size);
  });
}

/** Draws the 95 % confidence ellipses of targets; ellipses smaller than the symbol are left out. */
function drawEllipses(map, { ctx, size }) {
  const visible = [];
  for (const { target, x, y } of map.targetsOf("ellipses")) {
    if (!target.tracked) continue;
    const [long, wide, turn_rad] = ellipseOf(target.covariance).map((value, k) => (k < 2 ? value * map.camera.px_per_m : value));
    if (long > 4.5 * size) visible.push({ target, x, y, long, wide, turn_rad });
  }
  ctx.lineWidth = 1.25;
  for (const [isHeld, some] of grouped(visible, ({ target }) => target.status === "updated")) {
    ctx.setLineDash(isHeld ? [] : [3, 3]);
    const faint = map.drawn.length > MAX_NAMED ? 0.25 : 0.45;
    const ink = ({ target: { group } }) => map.ink(group, group === null ? faint : 1);
    drawByColour(ctx, some, ink, ({ x, y, long, wide, turn_rad }) => {
      ctx.moveTo(x + long * Math.cos(turn_rad), y - long * Math.sin(turn_rad));
      ctx.ellipse(x, y, long, wide, -turn_rad, 0, 2 * Math.PI);
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
function drawTracks(map, { ctx, labels, size }) {
  const looks = grouped(map.drawn.filter(({ target }) => target.tracked), ({ target }) =>
    target.membership === "removed" || target.membership === "ungrouped" ? target.membership : target.status === "updated" ? "updated" : "ring");
  // Among many targets, those in no group are fainter, so that the groups stand out.
  const isCrowd = map.drawn.length > MAX_NAMED;
  const ink = ({ target }) => map.ink(target.group, isCrowd && target.group === null && !map.selection.isChosen("target", target.id) ? 0.6 : 1);
  const draw = (some, of, add, end) => drawByColour(ctx, some ?? [], of, add, end);
  ctx.lineWidth = size < 0.8 ? 1.25 : 2;
  const half = 4 * size;
  draw(looks.get("ungrouped"), ink, ({ x, y }) => ctx.rect(x - half, y - half, 2 * half, 2 * half));
  draw(looks.get("removed"), ink, ({ x, y }) => addCross(ctx, x, y, 5 * size));
  draw(looks.get("ring"), ink, ({ x, y }) => addDisc(ctx, x, y, 4.5 * size));
  draw(looks.get("updated"), ink, ({ x, y }) => addDisc(ctx, x, y, 4.5 * size), "fill");
  const passing = map.drawn.filter(({ target }) => target.tracked && target.membership === "in-handoff");
  draw(passing, ({ target }) => map.ink(target.receiving_group), ({ x, y }) => addDisc(ctx, x, y, Math.max(8 * size, 6.5)));
  const { alarm } = palette();
  ctx.lineWidth = 2.5;
  const hidden = map.drawn.filter(({ target }) => target.out_of_view && map.selection.passes(target.group));
  const members = hidden.filter(({ target }) => target.group !== null);
  draw(members, () => alarm, ({ x, y }) => addDisc(ctx, x, y, 12));
  // There may be many targets in no group: their ring is thinner and has no label.
  ctx.lineWidth = 1.5;
  draw(hidden.filter(({ target }) => target.group === null), () => alarm, ({ x, y }) => addDisc(ctx, x, y, 12 * size));
  ctx.fillStyle = alarm;
  for (const { x, y } of members) labels.nextTo("out of view", x, y, 15, 8);
}

/** Outline of a UAV, nose along x, px. */
const AIRCRAFT = [[13, 0], [2, 2.2], [0, 12], [-4, 12], [-2.5, 2], [-9, 1.5], [-11, 5], [-13, 5], [-12, 0], [-13, -5], [-11, -5],
  [-9, -1.5], [-2.5, -2], [-4, -12], [0, -12], [2, -2.2]];

/** Draws UAVs. For a UAV in an outage it also draws the last position known to the team. */
function drawUavs(map, { ctx, labels, scene, uavSize }) {
  const { camera, replayData, selection } = map;
  for (const uav of scene.uavs) {
    const isFaint = uav.out || !selection.passes(uav.group);
    const colour = uavColour(replayData, uav.id);
    if (camera.shows(uav.x_m, uav.y_m)) {
      const [x, y] = camera.at(uav.x_m, uav.y_m);
      const [cos, sin] = [uavSize * Math.cos(uav.nose_rad), uavSize * Math.sin(uav.nose_rad)];
      ctx.fillStyle = isFaint ? faded(colour, 0.35) : colour;
      ctx.strokeStyle = palette().ground;
      ctx.lineWidth = 1.5;
      ctx.beginPath();
      // The y axis of the canvas points down.
      for (const [dx, dy] of AIRCRAFT) ctx.lineTo(x + dx * cos + dy * sin, y - dx * sin + dy * cos);
      ctx.closePath();
      ctx.stroke();
      ctx.fill();
    }
    if (uav.out && camera.shows(uav.out.x_m, uav.out.y_m)) {
      const [x, y] = camera.at(uav.out.x_m, uav.out.y_m);
      const { alarm } = palette();
      ctx.strokeStyle = ctx.fillStyle = alarm;
      ctx.lineWidth = 3;
      ctx.beginPath();
      addCross(ctx, x, y, 9);
      ctx.stroke();
      labels.nextTo(outageText(uav), x, y, 13, 8);
    }
  }
}

/** Outline of an intruder: an arrowhead, nose along x, px. */
const INTRUDER = [[14, 0], [-10, 9], [-5, 0], [-10, -9]];

/** Draws intruders; hollow while the transponder is off. */
function drawIntruders(map, { ctx, labels, scene }) {
  const { alarm, ground } = palette();
  for (const { id, x_m, y_m, heading_rad, transponder_on } of scene.intruders) {
    if (!map.camera.shows(x_m, y_m)) continue;
    const [x, y] = map.camera.at(x_m, y_m);
    const [cos, sin] = [Math.cos(heading_rad), Math.sin(heading_rad)];
    ctx.beginPath();
    for (const [dx, dy] of INTRUDER) ctx.lineTo(x + dx * cos + dy * sin, y - dx * sin + dy * cos);
    ctx.closePath();
    ctx.fillStyle = transponder_on ? alarm : ground;
    ctx.strokeStyle = alarm;
    ctx.lineWidth = 1.5;
    ctx.fill();
    ctx.stroke();
    ctx.fillStyle = alarm;
    // The offset keeps the label clear of the selection ring.
    labels.nextTo(`intruder ${id}${transponder_on ? "" : ", transponder off"}`, x, y, 22, 8);
  }
}

/** Text stating since when a UAV has been in an outage. */
function outageText({ id, out }) {
  return `UAV ${id}: outage since ${out.since_s.toFixed(1)} s`;
}

/** The smallest round number (1, 2 or 5 times a power of ten) that is not less than a value. */
function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value * (1 - 1e-9));
}

/** Formats a distance. */
function formatDistance(value_m) {
  if (value_m >= 10000) return `${(value_m / 1000).toFixed(1)} km`;
  return `${value_m >= 10 ? value_m.toFixed(0) : value_m.toPrecision(2)} m`;
}
