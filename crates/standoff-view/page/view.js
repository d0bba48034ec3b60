// What a map keeps in view: the whole run, all objects at the time shown, one object, or the view set by the user.

/** Factor by which fitted bounds are enlarged. */
const ROOM = 1.15;
/** The same for bounds that grow or move, so that the map need not move in every frame. */
const AMPLE_ROOM = 1.4;
/** Time constant of automatic map movements, s. */
const GLIDE_S = 0.3;

class View {
  constructor(map) {
    this.camera = map.camera;
    /** Maps whose objects are kept in view: its own, or all linked maps. */
    this.maps = [map];
    this.selection = map.selection;
    /** View that the camera moves to. */
    this.goal = null;
    /** Object, or other value of `followed`, that the goal belongs to. */
    this.kept = null;
    /** Bounds that were fitted last, m. */
    this.fitted_m = null;
    this.last_ms = 0;
    /** Whether the camera has reached the goal. */
    this.isSettled = true;
  }

  /** Makes the next frame show the final view immediately, without a smooth movement. */
  restart() {
    this.goal = null;
  }

  /** Moves the camera for the frame of a scene. */
  keep(scene, now_ms = performance.now()) {
    const { followed } = this.selection;
    const passed_s = Math.min((now_ms - this.last_ms) / 1000, 0.1);
    this.last_ms = now_ms;
    this.isSettled = true;
    if (followed !== this.kept) this.goal = null;
    this.kept = followed;
    if (!followed) return;
    if (followed.kind !== "run" && followed.kind !== "now") {
      const position = positionOf(scene, followed);
      if (position) [this.camera.x_m, this.camera.y_m] = position;
      return;
    }
    const isNow = followed.kind === "now";
    const isLoading = isNow && this.maps.some(({ scene }) => !scene.targets);
    // The targets at the time shown may be elsewhere.
    if (isLoading && this.goal) return;
    const bounds_m = (!isNow && unionOf(this.maps.map(({ replayData }) => replayData.bounds_m()))) || unionOf(this.maps.map((map) => boundsOf(map.scene)));
    if (bounds_m) this.fit(bounds_m, isNow || this.isGrowing, passed_s);
    if (isLoading) this.goal = null;
  }

  /** Whether a run is still being flown. */
  get isGrowing() {
    return this.maps.some(({ replayData }) => replayData.head.live && !replayData.done);
  }

  /** Fits bounds immediately. If the bounds move (`moves`), fits them with a larger margin, only when necessary, and smoothly. */
  fit(bounds_m, moves, passed_s) {
    const { camera } = this;
    if (!moves && String(bounds_m) !== String(this.fitted_m)) this.goal = null;
    if (!this.goal) {
      this.goal = camera.fitted(bounds_m, moves ? AMPLE_ROOM : ROOM);
      this.fitted_m = bounds_m;
      Object.assign(camera, this.goal);
      return;
    }
    const tight = camera.fitted(bounds_m, 1.02).px_per_m;
    const isOut = !camera.contains(bounds_m, this.goal) || this.goal.px_per_m < tight / (1.6 * AMPLE_ROOM);
    if (moves && isOut) this.goal = camera.fitted(bounds_m, AMPLE_ROOM);
    this.isSettled = camera.glide(this.goal, prefersReducedMotion() ? 1 : 1 - Math.exp(-passed_s / GLIDE_S));
  }
}

/** Whether the user has asked the system for reduced motion. */
function prefersReducedMotion() {
  return window.matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** The union of bounds (west, south, east, north); `null` if there are none. */
function unionOf(all) {
  const known = all.filter((bounds_m) => bounds_m);
  const of = (side, choose) => known.map((bounds_m) => bounds_m[side]).reduce((a, b) => choose(a, b));
  return known.length ? [of(0, Math.min), of(1, Math.min), of(2, Math.max), of(3, Math.max)] : null;
}

/** Bounds (west, south, east, north) of everything in a scene, m; `null` if it is empty. */
function boundsOf({ uavs, groups, intruders, targets }) {
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  const put = (x_m, y_m, r_m = 0) => {
    if (!Number.isFinite(x_m + y_m)) return;
    [west, south] = [Math.min(west, x_m - r_m), Math.min(south, y_m - r_m)];
    [east, north] = [Math.max(east, x_m + r_m), Math.max(north, y_m + r_m)];
  };
  for (const uav of uavs) put(uav.x_m, uav.y_m);
  for (const { x_m, y_m, nearest } of intruders) if (nearest?.distance_m <= RELEVANT_M) put(x_m, y_m);
  for (const group of groups) put(group.x_m, group.y_m, group.standoff_distance_m);
  for (const target of targets ?? []) {
    put(target.x_m, target.y_m);
    put(target.true_x_m, target.true_y_m);
  }
  return west <= east ? [west, south, east, north] : null;
}

/** An object of a scene; `undefined` if it does not exist. */
function objectIn(scene, { kind, id }) {
  return (scene[`${kind}s`] ?? []).find((one) => one.id === id);
}

/** Position of an object of a scene as known to the team, m; `null` if it does not exist. */
function positionOf(scene, object) {
  const one = objectIn(scene, object);
  if (!one) return null;
  return object.kind === "target" && !one.tracked ? [one.true_x_m, one.true_y_m] : [one.x_m, one.y_m];
}
