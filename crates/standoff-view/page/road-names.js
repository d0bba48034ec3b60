// Names of roads on the background map, along the roads, where they cover no other label.

/** Length of a road below which it has no space for a name, px. */
const SHORTEST_ROAD = 40;
/** Distance below which a name is not repeated, px. */
const NAME_DISTANCE = 300;
/** Maximum number of lines whose names are tried in a frame, and maximum number of names. */
const MAX_NAME_TRIES = 400;
const MAX_ROAD_NAMES = 40;

function drawRoadNames(map, { ctx, labels }) {
  const { basemap, camera } = map;
  if (!basemap) return;
  ctx.font = "11px system-ui, sans-serif";
  ctx.textAlign = "center";
  ctx.fillStyle = palette().faint;
  const places = new Map();
  let count = 0;
  for (const { name, rings: [points] } of basemap.named(camera, SHORTEST_ROAD).slice(0, MAX_NAME_TRIES)) {
    const known = places.get(name) ?? [];
    const isFree = ([x, y, , box]) => labels.isFree(box) && known.every((other) => Math.hypot(other[0] - x, other[1] - y) >= NAME_DISTANCE);
    const place = placesOf(camera, points, ctx.measureText(name).width).find(isFree);
    if (!place) continue;
    const [x, y, angle_rad, box] = place;
    labels.take(box);
    places.set(name, [...known, [x, y]]);
    ctx.save();
    ctx.translate(x, y);
    ctx.rotate(angle_rad);
    labels.write(name, 0, 0);
    ctx.restore();
    count += 1;
    if (count === MAX_ROAD_NAMES) return;
  }
}

/** Positions along the line, as fractions of its visible part, at which a name is tried. */
const NAME_PLACES = [0.5, 0.25, 0.75];

/** Places for a text along the straight pieces of a line that are long enough: middle, angle, and bounding box inside the map. */
function placesOf(camera, points, width) {
  const places = [];
  for (let k = 0; k + 3 < points.length && places.length < 12; k += 2) {
    const from = camera.at(points[k], points[k + 1]);
    const to = camera.at(points[k + 2], points[k + 3]);
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < width + 8) continue;
    const [low, high] = visiblePart(camera, from, to);
    // The text reads from left to right.
    const isBackward = to[0] < from[0] || (to[0] === from[0] && to[1] > from[1]);
    const angle_rad = isBackward ? Math.atan2(from[1] - to[1], from[0] - to[0]) : Math.atan2(to[1] - from[1], to[0] - from[0]);
    const [cos, sin] = [Math.abs(Math.cos(angle_rad)), Math.abs(Math.sin(angle_rad))];
    const [half_x, half_y] = [(width * cos + LINE * sin) / 2, (width * sin + LINE * cos) / 2];
    const half = (width / 2 + 4) / length;
    for (const share of NAME_PLACES) {
      const at = low + share * (high - low);
      if (at - half < low || at + half > high) continue;
      const [x, y] = [0, 1].map((axis) => from[axis] + at * (to[axis] - from[axis]));
      const box = [x - half_x, y - half_y, x + half_x, y + half_y];
      if (box[0] >= 0 && box[1] >= camera.top && box[2] <= camera.width && box[3] <= camera.height) places.push([x, y, angle_rad, box]);
    }
  }
  return places;
}

/** The visible part of a line between two positions, px, as fractions of its length; the second is smaller if nothing is visible. */
function visiblePart(camera, from, to) {
  const edges = [[0, camera.width], [camera.top, camera.height]];
  return edges.reduce(([low, high], [least, most], axis) => {
    const step = to[axis] - from[axis];
    if (step === 0) return from[axis] >= least && from[axis] <= most ? [low, high] : [1, 0];
    const [a, b] = [(least - from[axis]) / step, (most - from[axis]) / step].sort((a, b) => a - b);
    return [Math.max(low, a), Math.min(high, b)];
  }, [0, 1]);
}
