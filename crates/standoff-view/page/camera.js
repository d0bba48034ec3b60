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

/** Point of the ellipsoid at a latitude and longitude, Earth-centred coordinates in m, and its unit vectors to the east, north and up. */
function onEllipsoid(lat_deg, lon_deg) {
  const [lat, lon] = [lat_deg, lon_deg].map((angle_deg) => (angle_deg * Math.PI) / 180);
  const up = [Math.cos(lat) * Math.cos(lon), Math.cos(lat) * Math.sin(lon), Math.sin(lat)];
  const normal_m = EQUATOR_M / Math.sqrt(1 - ECCENTRICITY2 * up[2] ** 2);
  const at = [normal_m * up[0], normal_m * up[1], normal_m * (1 - ECCENTRICITY2) * up[2]];
  return { at, east: [-Math.sin(lon), Math.cos(lon), 0], north: [-Math.sin(lat) * Math.cos(lon), -Math.sin(lat) * Math.sin(lon), Math.cos(lat)], up };
}

/** Latitude and longitude, degrees, of the point of the ellipsoid below a position in the plane that touches it at the origin. */
function geographic(origin, east_m, north_m) {
  const { at, east, north, up } = onEllipsoid(origin.latitude_deg, origin.longitude_deg);
  const inPlane = at.map((value, k) => value + east_m * east[k] + north_m * north[k]);
  // On the ellipsoid, the product of a point with itself is 1; the upper of both solutions for the height.
  const product = (a, b) => (a[0] * b[0] + a[1] * b[1] + (a[2] * b[2]) / (1 - ECCENTRICITY2)) / EQUATOR_M ** 2;
  const [halfSlope, curvature] = [product(inPlane, up), product(up, up)];
  const height_m = (Math.sqrt(halfSlope ** 2 - curvature * (product(inPlane, inPlane) - 1)) - halfSlope) / curvature;
  const [x, y, z] = inPlane.map((value, k) => value + height_m * up[k]);
  return [Math.atan2(z, (1 - ECCENTRICITY2) * Math.hypot(x, y)), Math.atan2(y, x)].map((angle) => (angle * 180) / Math.PI);
}

/** Metres east and north of a latitude and longitude at the height of the ellipsoid, in the plane at `origin`. */
function local(origin, lat_deg, lon_deg) {
  const { at, east, north } = onEllipsoid(origin.latitude_deg, origin.longitude_deg);
  const from = onEllipsoid(lat_deg, lon_deg).at.map((value, k) => value - at[k]);
  return [east, north].map((axis) => axis[0] * from[0] + axis[1] * from[1] + axis[2] * from[2]);
}

/** Formats a latitude or longitude. */
function degrees(value, positive, negative) {
  return `${Math.abs(value).toFixed(6)}\u00b0 ${value < 0 ? negative : positive}`;
}
