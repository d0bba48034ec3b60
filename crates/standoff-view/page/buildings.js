// Buildings that hide targets from the sensors.

/** Height from which buildings have the darkest fill, m. */
const DARKEST_M = 40;

/** Paths of the buildings, in metres, with their bounds. They are made once. */
const BUILDING_PATHS = new WeakMap();

/** Path and bounds of a building: `path`, `west`, `east`, `south` and `north`, m. */
function buildingPath(building) {
  const known = BUILDING_PATHS.get(building);
  if (known) return known;
  const path = new Path2D();
  const made = { path, west: Infinity, east: -Infinity, south: Infinity, north: -Infinity };
  for (const corners_m of building.rings_m) {
    for (const [x_m, y_m] of corners_m) {
      path.lineTo(x_m, y_m);
      made.west = Math.min(made.west, x_m);
      made.east = Math.max(made.east, x_m);
      made.south = Math.min(made.south, y_m);
      made.north = Math.max(made.north, y_m);
    }
    path.closePath();
  }
  BUILDING_PATHS.set(building, made);
  return made;
}

/** Fills the buildings, darker if they are higher. */
function drawBuildings(map, { ctx }) {
  const { camera, replayData } = map;
  const { none } = palette();
  const [x, y] = camera.at(0, 0);
  ctx.save();
  ctx.transform(camera.px_per_m, 0, 0, -camera.px_per_m, x, y);
  ctx.lineWidth = 1 / camera.px_per_m;
  ctx.strokeStyle = faded(none, 0.7);
  for (const building of replayData.head.buildings ?? []) {
    const { path, west, east, south, north } = buildingPath(building);
    const [left, top] = camera.at(west, north);
    const [right, bottom] = camera.at(east, south);
    if (right < 0 || left > camera.width || bottom < 0 || top > camera.height) continue;
    ctx.fillStyle = faded(none, 0.15 + 0.35 * Math.min(building.height_m / DARKEST_M, 1));
    ctx.fill(path, "evenodd");
    ctx.stroke(path);
  }
  ctx.restore();
}
