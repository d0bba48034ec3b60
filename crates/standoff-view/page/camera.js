// The part of the plane that the map shows: north up, the same scale for both axes.

class Camera {
  /** Limits of the scale, px per m. */
  static MIN_PX_PER_M = 1e-4;
  static MAX_PX_PER_M = 50;

  constructor() {
    this.x_m = 0;
    this.y_m = 0;
    this.px_per_m = 0.2;
    this.width = 1;
    this.height = 1;
    /** Height at the top that is covered by the toolbar, px. */
    this.top = 0;
  }

  /** Shows the same area as another camera. */
  copyView({ x_m, y_m, px_per_m }) {
    Object.assign(this, { x_m, y_m, px_per_m });
  }

  /** Converts world coordinates to canvas coordinates, px. */
  at(x_m, y_m) {
    return [this.width / 2 + (x_m - this.x_m) * this.px_per_m, this.height / 2 - (y_m - this.y_m) * this.px_per_m];
  }

  /** Converts canvas coordinates to world coordinates, m. */
  world(x, y) {
    return [this.x_m + (x - this.width / 2) / this.px_per_m, this.y_m - (y - this.height / 2) / this.px_per_m];
  }

  pan(dx, dy) {
    this.x_m -= dx / this.px_per_m;
    this.y_m += dy / this.px_per_m;
  }

  /** Zooms about a position on the canvas, which stays in place. */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const [x_m, y_m] = this.world(x, y);
    this.px_per_m = Math.min(Math.max(this.px_per_m * factor, Camera.MIN_PX_PER_M), Camera.MAX_PX_PER_M);
    const [now_x_m, now_y_m] = this.world(x, y);
    this.x_m += x_m - now_x_m;
    this.y_m += y_m - now_y_m;
  }

  /** Returns the view that fits bounds (west, south, east, north), enlarged by the factor `room`. */
  fitted([west, south, east, north], room) {
    const [wide, high] = [room * (east - west), room * (north - south)].map((side_m) => Math.max(side_m, 200));
    const px_per_m = Math.min(this.width / wide, (this.height - this.top) / high);
    return { x_m: (west + east) / 2, y_m: (south + north) / 2 + this.top / 2 / px_per_m, px_per_m };
  }

  /** Whether a view contains bounds (west, south, east, north). */
  contains([west, south, east, north], { x_m, y_m, px_per_m }) {
    const [half_x_m, half_y_m] = [this.width / 2 / px_per_m, this.height / 2 / px_per_m];
    return west >= x_m - half_x_m && east <= x_m + half_x_m && south >= y_m - half_y_m && north <= y_m + half_y_m - this.top / px_per_m;
  }

  /** Moves a fraction of the way to another view; returns whether it has been reached. */
  glide(goal, share) {
    const off_px = Math.hypot(goal.x_m - this.x_m, goal.y_m - this.y_m) * this.px_per_m;
    const zoom = Math.log(goal.px_per_m / this.px_per_m);
    if (share >= 1 || (off_px < 0.5 && Math.abs(zoom) < 1e-3)) {
      Object.assign(this, goal);
      return true;
    }
    this.x_m += share * (goal.x_m - this.x_m);
    this.y_m += share * (goal.y_m - this.y_m);
    this.px_per_m *= Math.exp(share * zoom);
    return false;
  }

  /** Whether a position is on the canvas, or within `margin` px of it. */
  shows(x_m, y_m, margin = 20) {
    const [x, y] = this.at(x_m, y_m);
    return x > -margin && y > -margin && x < this.width + margin && y < this.height + margin;
  }
}

/** Ellipsoid of WGS84: equatorial radius, m, and square of the eccentricity. */
const EQUATOR_M = 6378137;
const ECCENTRICITY2 = (2 - 1 / 298.257223563) / 298.257223563;

/** Radius of curvature of the ellipsoid in the prime vertical at a latitude in rad, m. */
function curvatureRadius_m(lat) {
  return EQUATOR_M / Math.sqrt(1 - ECCENTRICITY2 * Math.sin(lat) ** 2);
}

/** Latitude and longitude, degrees, of a position in the plane that touches the WGS84 ellipsoid at the origin. */
function geographic(origin, east_m, north_m) {
  const e2 = ECCENTRICITY2;
  const lat0 = (origin.latitude_deg * Math.PI) / 180;
  const lon0 = (origin.longitude_deg * Math.PI) / 180;
  const n0 = curvatureRadius_m(lat0);
  const out_m = n0 * Math.cos(lat0) - Math.sin(lat0) * north_m;
  const x = out_m * Math.cos(lon0) - Math.sin(lon0) * east_m;
  const y = out_m * Math.sin(lon0) + Math.cos(lon0) * east_m;
  const z = n0 * (1 - e2) * Math.sin(lat0) + Math.cos(lat0) * north_m;
  const p = Math.hypot(x, y);
  // Fixed-point iteration of the latitude: near the surface each round gains more than two digits.
  let lat = Math.atan2(z, p * (1 - e2));
  for (let round = 0; round < 6; round++) {
    lat = Math.atan2(z + e2 * curvatureRadius_m(lat) * Math.sin(lat), p);
  }
  return [(lat * 180) / Math.PI, (Math.atan2(y, x) * 180) / Math.PI];
}

/** Metres east and north of a latitude and longitude at the height of the ellipsoid, in the plane at `origin`. */
function local(origin, lat_deg, lon_deg) {
  const radians = (angle_deg) => (angle_deg * Math.PI) / 180;
  const at = (lat, lon) => {
    const n = curvatureRadius_m(lat);
    return [n * Math.cos(lat) * Math.cos(lon), n * Math.cos(lat) * Math.sin(lon), n * (1 - ECCENTRICITY2) * Math.sin(lat)];
  };
  const [lat0, lon0] = [radians(origin.latitude_deg), radians(origin.longitude_deg)];
  const from = at(lat0, lon0);
  const [x, y, z] = at(radians(lat_deg), radians(lon_deg)).map((value, k) => value - from[k]);
  const east_m = -Math.sin(lon0) * x + Math.cos(lon0) * y;
  const north_m = -Math.sin(lat0) * (Math.cos(lon0) * x + Math.sin(lon0) * y) + Math.cos(lat0) * z;
  return [east_m, north_m];
}

/** Formats a latitude or longitude. */
function degrees(value, positive, negative) {
  return `${Math.abs(value).toFixed(6)}\u00b0 ${value < 0 ? negative : positive}`;
}
