// What lies under the vehicles: roads, buildings, water. It is drawn once, in tiles, which are then only copied: a map of a
// whole city under a camera that follows a UAV costs no more than a picture of it. `crates/standoff-map` describes the data.

/** Kinds, and how a line of each is drawn: its least width, px; from which scale on, px per m; broken or not. */
const UNDERLAY = {
  green: [0, 0, []], water: [1, 0, []], other: [0.5, 0.02, []], building: [0, 0.03, []], path: [0.6, 0.15, []],
  rail: [0.7, 0.03, []], minor: [1, 0.02, []], major: [1.6, 0, []],
};

class Underlay {
  /** Side of a tile, px of the screen. It is drawn in quarters, so that none takes long. */
  static TILE = 512;
  /** So many times the tiles in sight are kept, for who goes back. */
  static KEPT = 3;
  /** How long a picture may draw tiles, ms; a quarter of one is drawn in any case. */
  static BUDGET_MS = 8;
  /** After so long without another zoom the tiles of the new scale are drawn, ms; until then the old ones are stretched. */
  static REST_MS = 120;
  /** Side of a cell in which shapes are looked up, m. */
  static CELL_M = 250;

  constructor(canvas) {
    this.canvas = canvas;
    this.shapes = [];
    this.cells = new Map();
    /** Shapes too large for cells. */
    this.large = [];
    this.level = null;
    this.before = null;
    this.zoomed_ms = -Infinity;
  }

  /** Loads the map; `renew` asks for another picture. */
  async load(source, renew) {
    this.renew = renew;
    try {
      // First the map's own picture.
      await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
      this.put(await source.map());
    } catch (error) {
      // Everything else can be looked at without.
      console.warn(`The map of roads and buildings could not be read: ${error.message}`);
    }
    renew();
  }

  put({ layers, credit }) {
    this.credit = credit;
    for (const { kind, width_m, lines, areas } of layers) {
      if (!Object.hasOwn(UNDERLAY, kind)) continue;
      for (const line of lines) this.add(kind, width_m, [line], false);
      for (const rings of areas) this.add(kind, 0, rings, true);
    }
    this.canvas.dataset.underlay = String(this.shapes.length);
  }

  add(kind, width_m, told, area) {
    let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
    const rings = told.map((deltas) => {
      const points = new Float64Array(deltas.length);
      let [x, y] = [0, 0];
      for (let k = 0; k + 1 < deltas.length; k += 2) {
        points[k] = (x += deltas[k]) / 10;
        points[k + 1] = (y += deltas[k + 1]) / 10;
        west = Math.min(west, points[k]);
        east = Math.max(east, points[k]);
        south = Math.min(south, points[k + 1]);
        north = Math.max(north, points[k + 1]);
      }
      return points;
    });
    const shape = { kind, width_m, rings, area, west, south, east, north, size_m: Math.max(east - west, north - south) };
    const index = this.shapes.push(shape) - 1;
    const cell = (value) => Math.floor(value / Underlay.CELL_M);
    const [left, right, low, high] = [cell(west), cell(east), cell(south), cell(north)];
    if ((right - left + 1) * (high - low + 1) > 64) {
      this.large.push(index);
      return;
    }
    for (let i = left; i <= right; i++) {
      for (let j = low; j <= high; j++) {
        const key = `${i} ${j}`;
        const held = this.cells.get(key);
        if (held) held.push(index);
        else this.cells.set(key, [index]);
      }
    }
  }

  /** Draws what lies under the camera. */
  draw(pen, camera) {
    if (!this.shapes.length) return;
    const ratio = screenRatio();
    const scale = camera.px_per_m * ratio;
    const [width, height] = [pen.canvas.width, pen.canvas.height];
    const now = performance.now();
    const theme = document.documentElement.dataset.theme;
    if (this.level?.theme !== theme) this.level = this.before = null;
    if (this.level?.scale !== scale) {
      if (this.scale !== scale) this.zoomed_ms = now;
      const rests = now - this.zoomed_ms >= Underlay.REST_MS;
      if (!this.level || rests) {
        this.before = this.level ?? this.before;
        this.level = { scale, theme, tiles: new Map() };
      } else {
        clearTimeout(this.waiting);
        this.waiting = setTimeout(this.renew, Underlay.REST_MS);
      }
    }
    this.scale = scale;
    // Where the picture begins on the plane that the tiles cover, px; whole, so that tiles are copied as they are.
    const left = Math.round(camera.x_m * scale - width / 2);
    const top = Math.round(-camera.y_m * scale - height / 2);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    if (this.level.scale !== scale) {
      this.stretch(pen, this.before, scale, left, top);
      this.stretch(pen, this.level, scale, left, top);
      this.canvas.dataset.underlayTiles = "some";
    } else {
      this.show(pen, left, top, width, height, now);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.sign(pen, camera);
  }

  /** Copies the tiles of the level that is on, and draws those that are missing, as far as there is time. */
  show(pen, left, top, width, height, from_ms) {
    const { TILE, KEPT, BUDGET_MS } = Underlay;
    const { tiles, scale } = this.level;
    const [i0, i1] = [Math.floor(left / TILE), Math.floor((left + width - 1) / TILE)];
    const [j0, j1] = [Math.floor(top / TILE), Math.floor((top + height - 1) / TILE)];
    let drawn = 0;
    const hasTime = () => drawn === 0 || performance.now() - from_ms < BUDGET_MS;
    /** The picture of a tile, if it is whole by now. */
    const tile = (i, j) => {
      const key = `${i} ${j}`;
      const held = tiles.get(key) ?? { canvas: null, quarters: 0 };
      for (; held.quarters < 4 && hasTime(); held.quarters++, drawn++) this.quarter(held, i, j, scale);
      // The one used last comes last.
      tiles.delete(key);
      tiles.set(key, held);
      return held.quarters === 4 ? held.canvas : null;
    };
    const shown = [];
    let missing = false;
    for (let i = i0; i <= i1; i++) {
      for (let j = j0; j <= j1; j++) {
        const canvas = tile(i, j);
        if (canvas) shown.push([canvas, i * TILE - left, j * TILE - top]);
        else missing = true;
      }
    }
    if (missing) this.stretch(pen, this.before, scale, left, top);
    else this.before = null;
    for (const [canvas, x, y] of shown) pen.drawImage(canvas, x, y);
    if (missing) this.renew();
    // Whoever follows comes there next.
    for (let i = i0 - 1; i <= i1 + 1; i++) {
      for (let j = j0 - 1; j <= j1 + 1; j++) {
        if (!missing && drawn === 0 && tiles.get(`${i} ${j}`)?.quarters !== 4) tile(i, j);
      }
    }
    const most = KEPT * (i1 - i0 + 1) * (j1 - j0 + 1) + 16;
    for (const key of tiles.keys()) {
      if (tiles.size <= most) break;
      tiles.delete(key);
    }
    this.canvas.dataset.underlayTiles = missing ? "some" : "all";
  }

  /** The tiles of another scale, stretched. */
  stretch(pen, level, scale, left, top) {
    if (!level) return;
    const by = scale / level.scale;
    const side = Underlay.TILE * by;
    for (const [key, { canvas, quarters }] of level.tiles) {
      if (quarters < 4) continue;
      const [i, j] = key.split(" ").map(Number);
      const [x, y] = [i * side - left, j * side - top];
      if (x + side < 0 || y + side < 0 || x > pen.canvas.width || y > pen.canvas.height) continue;
      pen.drawImage(canvas, x, y, side + 1, side + 1);
    }
  }

  /** The shapes that may be in a rectangle, in the order in which they lie on one another. */
  near(west, east, south, north) {
    const cell = (value) => Math.floor(value / Underlay.CELL_M);
    const [left, right, low, high] = [cell(west), cell(east), cell(south), cell(north)];
    if ((right - left + 1) * (high - low + 1) > this.cells.size / 2) return this.shapes;
    const found = new Set(this.large);
    for (let i = left; i <= right; i++) {
      for (let j = low; j <= high; j++) for (const index of this.cells.get(`${i} ${j}`) ?? []) found.add(index);
    }
    return Array.from(Uint32Array.from(found).sort(), (index) => this.shapes[index]);
  }

  /** Draws the next quarter of a tile. */
  quarter(tile, tileI, tileJ, scale) {
    const side = Underlay.TILE / 2;
    if (!tile.canvas) {
      tile.canvas = document.createElement("canvas");
      tile.canvas.width = tile.canvas.height = Underlay.TILE;
      tile.pen = tile.canvas.getContext("2d", { alpha: false });
    }
    const [across, down] = [tile.quarters % 2, tile.quarters >> 1];
    const [i, j] = [2 * tileI + across, 2 * tileJ + down];
    const { pen } = tile;
    const colours = palette().underlay;
    pen.save();
    pen.translate(across * side, down * side);
    pen.beginPath();
    pen.rect(0, 0, side, side);
    pen.clip();
    pen.fillStyle = palette().ground;
    pen.fillRect(0, 0, side, side);
    // As far as the widest line reaches.
    const reach_m = 60 + 4 / scale;
    const [west, east] = [(i * side) / scale - reach_m, ((i + 1) * side) / scale + reach_m];
    const [south, north] = [(-(j + 1) * side) / scale - reach_m, (-j * side) / scale + reach_m];
    const groups = new Map();
    for (const shape of this.near(west, east, south, north)) {
      const { kind, width_m, area, rings } = shape;
      if (shape.east < west || shape.west > east || shape.north < south || shape.south > north) continue;
      // What is smaller than a pixel is not seen.
      if (scale < UNDERLAY[kind][1] || shape.size_m * scale < (area ? 1.2 : 0.5)) continue;
      const key = `${kind} ${area ? "area" : width_m}`;
      if (!groups.has(key)) groups.set(key, { kind, width_m, area, path: new Path2D() });
      const { path } = groups.get(key);
      for (const points of rings) {
        path.moveTo(points[0] * scale - i * side, -points[1] * scale - j * side);
        for (let k = 2; k < points.length; k += 2) path.lineTo(points[k] * scale - i * side, -points[k + 1] * scale - j * side);
        if (area) path.closePath();
      }
    }
    for (const { kind, width_m, area, path } of groups.values()) {
      pen.fillStyle = pen.strokeStyle = colours[kind];
      if (area) {
        pen.fill(path, "evenodd");
      } else {
        pen.lineWidth = Math.max(width_m * scale, UNDERLAY[kind][0]);
        // Round ends of thin lines cost much and are not seen.
        [pen.lineJoin, pen.lineCap] = pen.lineWidth > 2 ? ["round", "round"] : ["bevel", "butt"];
        pen.stroke(path);
      }
    }
    pen.restore();
  }

  /** Who made the map, if that has to be said. */
  sign(pen, camera) {
    if (!this.credit) return;
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = palette().faint;
    pen.textAlign = "right";
    pen.textBaseline = "bottom";
    // With a rim in the ground's colour, so that it can be read over roads.
    pen.strokeStyle = palette().ground;
    pen.lineWidth = 3;
    const words = String(this.credit).slice(0, 60);
    pen.strokeText(words, camera.width - 8, camera.height - 28);
    pen.fillText(words, camera.width - 8, camera.height - 28);
  }
}
