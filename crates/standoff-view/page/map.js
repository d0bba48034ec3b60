// The map: north up. What lies under what is the order of `LAYERS`.

/** Layers that can be switched: name, title, shown at first. */
const LAYERS = [
  ["grid", "Grid and scale", true],
  ["truth", "True targets", true],
  ["trails", "Trails", true],
  ["desired", "Desired orbits", true],
  ["flown", "Orbits as flown", true],
  ["views", "Fields of view", true],
  ["ellipses", "95 % ellipses", true],
  ["tracks", "Tracks", true],
  ["uavs", "UAVs", true],
  ["names", "Names", true],
];

/** How long trails are, s. */
const TRAIL_S = 60;
/** Square root of the 95 % quantile of a chi-square of two degrees of freedom. */
const SIGMAS = Math.sqrt(5.991);
/** More targets than this in sight have no names. */
const MOST_NAMED = 60;
/** Height of a line of text, px. */
const LINE = 14;

class MissionMap {
  constructor(canvas, film, choice) {
    this.canvas = canvas;
    this.film = film;
    this.choice = choice;
    this.camera = new Camera();
    this.shown = new Set(LAYERS.filter((layer) => layer[2]).map((layer) => layer[0]));
    this.ruler = null;
    this.fitted = false;
    /** What the labels of a picture cover: left, top, right, bottom, px. */
    this.taken = [];
  }

  /** Takes on the size of its place in the page; says whether that has changed. */
  resize() {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width === width && this.canvas.height === height) return false;
    this.canvas.width = width;
    this.canvas.height = height;
    this.camera.width = clientWidth;
    this.camera.height = clientHeight;
    return true;
  }

  /** All that there is in sight. */
  fit(scene) {
    const places = [];
    for (const uav of scene.uavs) places.push([uav.x_m, uav.y_m]);
    for (const group of scene.groups) {
      const r = group.standoff_distance_m;
      places.push([group.x_m - r, group.y_m - r], [group.x_m + r, group.y_m + r]);
    }
    for (const target of scene.targets ?? []) if (target.group !== null) places.push([target.x_m, target.y_m]);
    if (places.length) {
      this.camera.fit(places);
      this.fitted = true;
    }
  }

  centre(scene) {
    const { followed } = this.choice;
    if (!followed) return;
    const among = followed.kind === "uav" ? scene.uavs : scene.groups;
    const found = among.find((one) => one.id === followed.id);
    if (found) [this.camera.x_m, this.camera.y_m] = [found.x_m, found.y_m];
  }

  draw(scene) {
    this.resize();
    if (!this.fitted) this.fit(scene);
    this.centre(scene);
    // Where the map looks, as text.
    const { x_m, y_m, px_per_m } = this.camera;
    Object.assign(this.canvas.dataset, { eastM: x_m, northM: y_m, pxPerM: px_per_m });
    const ratio = window.devicePixelRatio || 1;
    const pen = this.canvas.getContext("2d", { alpha: false });
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = palette().ground;
    pen.fillRect(0, 0, this.camera.width, this.camera.height);
    pen.lineJoin = "round";
    this.taken = [];
    pen.font = "12px system-ui, sans-serif";
    const paint = {
      grid: () => this.grid(pen),
      truth: () => this.truth(pen, scene),
      trails: () => this.trails(pen, scene),
      desired: () => this.desired(pen, scene),
      flown: () => this.flown(pen, scene),
      views: () => this.views(pen, scene),
      ellipses: () => this.ellipses(pen, scene),
      tracks: () => this.tracks(pen, scene),
      uavs: () => this.uavs(pen, scene),
      names: () => this.names(pen, scene),
    };
    for (const [layer] of LAYERS) {
      if (!this.shown.has(layer)) continue;
      pen.save();
      paint[layer]();
      pen.restore();
    }
    if (this.ruler) this.rule(pen);
  }

  path(pen, places) {
    pen.beginPath();
    let down = false;
    for (const [x_m, y_m] of places) {
      if (Number.isNaN(x_m)) {
        down = false;
        continue;
      }
      const [x, y] = this.camera.at(x_m, y_m);
      if (down) pen.lineTo(x, y);
      else pen.moveTo(x, y);
      down = true;
    }
    pen.stroke();
  }

  /** Lines at round distances, and a scale. */
  grid(pen) {
    const { camera } = this;
    const step_m = roundStep(90 / camera.px_per_m);
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

  truth(pen, scene) {
    pen.strokeStyle = palette().faint;
    pen.lineWidth = 1.25;
    pen.beginPath();
    for (const target of scene.targets ?? []) {
      if (!target.there || !this.camera.sees(target.true_x_m, target.true_y_m)) continue;
      const [x, y] = this.camera.at(target.true_x_m, target.true_y_m);
      pen.moveTo(x - 3, y - 3);
      pen.lineTo(x + 3, y + 3);
      pen.moveTo(x - 3, y + 3);
      pen.lineTo(x + 3, y - 3);
    }
    pen.stroke();
  }

  /** Instants of the last minute, and now. */
  *recent(time_s, from_s) {
    const { film } = this;
    const last = film.instant(time_s);
    for (let k = Math.max(0, film.instant(Math.max(from_s, film.times_s[0] ?? 0))); k <= last; k++) yield k;
  }

  trails(pen, scene) {
    pen.lineWidth = 1.5;
    for (const uav of scene.uavs) {
      const places = [];
      for (const k of this.recent(scene.time_s, scene.time_s - TRAIL_S)) {
        places.push([this.film.value("uavs", "x_m", uav.id, k), this.film.value("uavs", "y_m", uav.id, k)]);
      }
      places.push([uav.x_m, uav.y_m]);
      pen.strokeStyle = faded(uavColour(this.film, uav.id), 0.55);
      this.path(pen, places);
    }
  }

  desired(pen, scene) {
    for (const group of scene.groups) {
      const [x, y] = this.camera.at(group.x_m, group.y_m);
      pen.strokeStyle = groupColour(this.film, group.id);
      pen.lineWidth = 2;
      pen.setLineDash(group.feasible ? [] : [4, 6]);
      pen.beginPath();
      pen.arc(x, y, Math.max(0, group.standoff_distance_m * this.camera.px_per_m), 0, 2 * Math.PI);
      pen.stroke();
      pen.setLineDash([]);
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.moveTo(x - 6, y);
      pen.lineTo(x + 6, y);
      pen.moveTo(x, y - 6);
      pen.lineTo(x, y + 6);
      pen.stroke();
    }
  }

  /** Where the UAVs of a group have been relative to its centre, drawn about its centre of now. */
  flown(pen, scene) {
    const { film } = this;
    pen.lineWidth = 1.25;
    pen.setLineDash([2, 4]);
    for (const uav of scene.uavs) {
      const group = scene.groups.find((one) => one.id === uav.group);
      if (!group) continue;
      const turn_s = Math.min((2 * Math.PI * group.standoff_distance_m) / Math.max(uav.speed_m_s, 1), 4 * TRAIL_S);
      const places = [];
      for (const k of this.recent(scene.time_s, scene.time_s - turn_s)) {
        const same = film.value("uavs", "group", uav.id, k) === group.id;
        const dx = film.value("uavs", "x_m", uav.id, k) - film.value("groups", "x_m", group.id, k);
        const dy = film.value("uavs", "y_m", uav.id, k) - film.value("groups", "y_m", group.id, k);
        places.push(same ? [group.x_m + dx, group.y_m + dy] : [NaN, NaN]);
      }
      places.push([uav.x_m, uav.y_m]);
      pen.strokeStyle = uavColour(film, uav.id);
      this.path(pen, places);
    }
  }

  views(pen, scene) {
    const half_rad = this.film.head.limits.field_of_view_rad / 2;
    for (const uav of scene.uavs) {
      if (Number.isNaN(uav.boresight_rad)) continue;
      const group = scene.groups.find((one) => one.id === uav.group);
      const reach_m = group ? Math.hypot(uav.x_m - group.x_m, uav.y_m - group.y_m) + group.spread_m + 40 : 400;
      const [x, y] = this.camera.at(uav.x_m, uav.y_m);
      const colour = groupColour(this.film, uav.group);
      pen.beginPath();
      pen.moveTo(x, y);
      // The canvas counts angles clockwise.
      pen.arc(x, y, reach_m * this.camera.px_per_m, -uav.boresight_rad - half_rad, -uav.boresight_rad + half_rad);
      pen.closePath();
      pen.fillStyle = faded(colour, 0.1);
      pen.fill();
      pen.strokeStyle = faded(colour, 0.45);
      pen.stroke();
    }
  }

  ellipses(pen, scene) {
    pen.lineWidth = 1.25;
    for (const target of scene.targets ?? []) {
      if (!target.tracked || !this.camera.sees(target.x_m, target.y_m)) continue;
      const [xx, xy, yy] = target.covariance;
      const middle = (xx + yy) / 2;
      const off = Math.hypot((xx - yy) / 2, xy);
      const [x, y] = this.camera.at(target.x_m, target.y_m);
      const axis = (variance) => SIGMAS * Math.sqrt(Math.max(variance, 0)) * this.camera.px_per_m;
      pen.strokeStyle = groupColour(this.film, target.group);
      pen.setLineDash(target.status === "held" ? [] : [3, 3]);
      pen.beginPath();
      pen.ellipse(x, y, axis(middle + off), axis(middle - off), -0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
      pen.stroke();
    }
  }

  /** Held: a disc. Coasting or cued: a ring. Unassigned: a square. In dwell: two colours. Discarded: a cross. */
  tracks(pen, scene) {
    const { alarm } = palette();
    for (const target of scene.targets ?? []) {
      const at = target.tracked ? [target.x_m, target.y_m] : [target.true_x_m, target.true_y_m];
      if (!this.camera.sees(...at)) continue;
      const [x, y] = this.camera.at(...at);
      if (target.tracked) {
        pen.fillStyle = pen.strokeStyle = groupColour(this.film, target.group);
        pen.lineWidth = 2;
        if (target.place === "discarded") {
          cross(pen, x, y, 5);
        } else if (target.place === "unassigned") {
          pen.strokeRect(x - 4, y - 4, 8, 8);
        } else {
          disc(pen, x, y, 4.5, target.status === "held");
        }
        if (target.place === "dwell") {
          pen.strokeStyle = groupColour(this.film, target.to_group);
          disc(pen, x, y, 8, false);
        }
      }
      if (target.out_of_view) {
        pen.strokeStyle = alarm;
        pen.lineWidth = 2.5;
        disc(pen, x, y, 12, false);
        pen.fillStyle = alarm;
        this.label(pen, "out of view", x, y, 15, 8);
      }
    }
  }

  uavs(pen, scene) {
    for (const uav of scene.uavs) {
      if (!this.camera.sees(uav.x_m, uav.y_m)) continue;
      const [x, y] = this.camera.at(uav.x_m, uav.y_m);
      pen.save();
      pen.translate(x, y);
      pen.rotate(-uav.heading_rad);
      pen.fillStyle = uavColour(this.film, uav.id);
      pen.strokeStyle = palette().ground;
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const [dx, dy] of [[13, 0], [2, 2.2], [0, 12], [-4, 12], [-2.5, 2], [-9, 1.5], [-11, 5], [-13, 5], [-12, 0]]) {
        pen.lineTo(dx, dy);
      }
      for (const [dx, dy] of [[-13, -5], [-11, -5], [-9, -1.5], [-2.5, -2], [-4, -12], [0, -12], [2, -2.2]]) pen.lineTo(dx, dy);
      pen.closePath();
      pen.stroke();
      pen.fill();
      pen.restore();
    }
  }

  /** What matters most comes first: where there is no room, names are left out. */
  names(pen, scene) {
    const { camera } = this;
    pen.fillStyle = palette().ink;
    for (const uav of scene.uavs) {
      if (camera.sees(uav.x_m, uav.y_m, 0)) this.label(pen, `UAV ${uav.id}`, ...camera.at(uav.x_m, uav.y_m), 15, 14);
    }
    for (const group of scene.groups) {
      if (camera.sees(group.x_m, group.y_m, 0)) this.label(pen, `group ${group.id}`, ...camera.at(group.x_m, group.y_m), 8, 10);
    }
    const inSight = (scene.targets ?? []).filter((target) => target.tracked && camera.sees(target.x_m, target.y_m, 0));
    if (inSight.length > MOST_NAMED) return;
    pen.font = "11px system-ui, sans-serif";
    const named = inSight.map((target) => {
      const words = concern(target);
      const also = words && words !== "out of view" ? ` (${words})` : "";
      return { target, words, name: `${short(this.film.head.targets[target.id] ?? target.id)}${also}` };
    });
    for (const { target, name } of [...named.filter((one) => one.words), ...named.filter((one) => !one.words)]) {
      this.label(pen, name, ...camera.at(target.x_m, target.y_m), 8, 10);
    }
  }

  /** Text beside a place, off by `dx` and `dy` to one side or another, where it covers no other; else none. */
  label(pen, text, x, y, dx, dy) {
    const width = pen.measureText(text).width;
    const corners = [[x + dx, y + dy], [x + dx, y - dy], [x - dx - width, y + dy], [x - dx - width, y - dy],
      [x - width / 2, y + dy + LINE], [x - width / 2, y - dy - LINE]];
    for (const [left, middle] of corners) {
      const box = [left - 1, middle - LINE / 2, left + width + 1, middle + LINE / 2];
      if (!this.isFree(box)) continue;
      this.taken.push(box);
      this.write(pen, text, left, middle);
      return;
    }
  }

  isFree([left, top, right, bottom]) {
    if (left < 0 || top < 0 || right > this.camera.width || bottom > this.camera.height) return false;
    return this.taken.every((box) => left >= box[2] || right <= box[0] || top >= box[3] || bottom <= box[1]);
  }

  /** Text with a rim in the ground's colour, so that it can be read over lines. */
  write(pen, text, x, y) {
    pen.textBaseline = "middle";
    pen.strokeStyle = palette().ground;
    pen.lineWidth = 3;
    pen.strokeText(text, x, y);
    pen.fillText(text, x, y);
  }

  rule(pen) {
    const { from, to } = this.ruler;
    if (!from || !to) return;
    const [x, y] = this.camera.at(...from);
    const [x2, y2] = this.camera.at(...to);
    pen.strokeStyle = pen.fillStyle = palette().alarm;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x2, y2);
    pen.stroke();
    this.write(pen, this.measured(), x2 + 10, y2 - 10);
  }

  /** What the ruler says: distance, and compass bearing from its first end. */
  measured() {
    const { from, to } = this.ruler ?? {};
    if (!from || !to) return "";
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const compass_deg = ((Math.atan2(dx, dy) * 180) / Math.PI + 360) % 360;
    return `${metres(Math.hypot(dx, dy))}, bearing ${compass_deg.toFixed(0).padStart(3, "0")}\u00b0`;
  }
}

function disc(pen, x, y, r, filled) {
  pen.beginPath();
  pen.arc(x, y, r, 0, 2 * Math.PI);
  if (filled) pen.fill();
  else pen.stroke();
}

function cross(pen, x, y, r) {
  pen.beginPath();
  pen.moveTo(x - r, y - r);
  pen.lineTo(x + r, y + r);
  pen.moveTo(x - r, y + r);
  pen.lineTo(x + r, y - r);
  pen.stroke();
}

/** The round number, 1, 2 or 5 times a power of ten, that is next above a value. */
function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value * (1 - 1e-9));
}

function metres(value_m) {
  if (value_m >= 10000) return `${(value_m / 1000).toFixed(1)} km`;
  return `${value_m >= 10 ? value_m.toFixed(0) : value_m.toPrecision(2)} m`;
}

/** A name from a file, cut to a length that fits on a map; what cannot be seen is shown as a mark. */
function short(name) {
  const seen = String(name).replace(/[\p{Cc}\p{Cf}\p{Cs}\p{Zl}\p{Zp}]/gu, "\ufffd");
  return seen.length > 24 ? `${seen.slice(0, 23)}\u2026` : seen;
}
