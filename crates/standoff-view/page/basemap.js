// The background map: roads, buildings, water. It is drawn once into tiles, which are then copied, so that even the map of a city
// is cheap to draw while the camera moves. `crates/standoff-map` describes the data.

/** Feature classes with the style of their lines: minimum width, px; minimum scale, px per m; dash pattern. */
const LINE_STYLES = {
  green: [0, 0, []], water: [1, 0, []], other: [0.5, 0.02, []], building: [0, 0.03, []], path: [0.6, 0.15, []],
  rail: [0.7, 0.03, []], minor: [1, 0.02, []], major: [1.6, 0, []],
};

class Basemap {
  /** Side of a tile, device px. Tiles are drawn in quarters to limit the time per frame. */
  static TILE = 512;
  /** Number of tiles in the cache, as a multiple of the visible tiles. */
  static CACHED = 3;
  /** Time per frame for drawing tiles, ms; at least one quarter of a tile is drawn. */
  static BUDGET_MS = 8;
  /** Time without zooming after which tiles of the new scale are drawn, ms; until then the old tiles are stretched. */
  static ZOOM_PAUSE_MS = 120;
  /** Side of a cell of the spatial index, m. */
  static CELL_M = 250;

  constructor(canvas) {
    this.canvas = canvas;
    this.shapes = [];
    this.cells = new Map();
    /** Indices of shapes that are too large for the spatial index. */
    this.large = [];
    this.level = null;
    this.before = null;
    this.zoomed_ms = -Infinity;
  }

  /** Loads the map; `renew` requests a new frame. */
  async load(source, renew) {
    this.renew = renew;
    try {
      // The first frame of the replay is drawn before.
      await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
      this.put(await source.map());
    } catch (error) {
      // The rest of the page works without the background map.
      console.warn(`Cannot read the background map: ${error.message}`);
    }
    renew();
  }

  /** Adds the shapes of a map. */
  put({ layers, credit }) {
    this.credit = credit;
    for (const { kind, width_m, lines, areas, names = {} } of layers) {
      if (!Object.hasOwn(LINE_STYLES, kind)) continue;
      const named = new Map(Object.entries(names).flatMap(([name, indices]) => indices.map((index) => [index, shortName(name)])));
      lines.forEach((line, index) => this.add(kind, width_m, [line], false, named.get(index)));
      for (const rings of areas) this.add(kind, 0, rings, true);
    }
    this.canvas.dataset.basemap = String(this.shapes.length);
  }

  /** Adds a shape; roads may have a name. Its lines are coordinate differences in decimetres. */
  add(kind, width_m, lines, area, name) {
    let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
    const rings = lines.map((deltas) => {
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
    const shape = { kind, width_m, rings, area, name, west, south, east, north, size_m: Math.max(east - west, north - south) };
    const index = this.shapes.push(shape) - 1;
    const cell = (value) => Math.floor(value / Basemap.CELL_M);
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

  /** Draws the visible part of the map. */
  draw(ctx, camera) {
    if (!this.shapes.length) return;
    const ratio = screenRatio();
    const scale = camera.px_per_m * ratio;
    const [width, height] = [ctx.canvas.width, ctx.canvas.height];
    const now = performance.now();
    const theme = document.documentElement.dataset.theme;
    if (this.level?.theme !== theme) this.level = this.before = null;
    if (this.level?.scale !== scale) {
      if (this.scale !== scale) this.zoomed_ms = now;
      const isZoomOver = now - this.zoomed_ms >= Basemap.ZOOM_PAUSE_MS;
      if (!this.level || isZoomOver) {
        this.before = this.level ?? this.before;
        this.level = { scale, theme, tiles: new Map() };
      } else {
        clearTimeout(this.waiting);
        this.waiting = setTimeout(this.renew, Basemap.ZOOM_PAUSE_MS);
      }
    }
    this.scale = scale;
    // Upper left corner of the canvas in tile coordinates, px; rounded, so that tiles are copied without resampling.
    const left = Math.round(camera.x_m * scale - width / 2);
    const top = Math.round(-camera.y_m * scale - height / 2);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    if (this.level.scale !== scale) {
      this.stretch(ctx, this.before, scale, left, top);
      this.stretch(ctx, this.level, scale, left, top);
      this.canvas.dataset.basemapTiles = "some";
    } else {
      this.show(ctx, left, top, width, height, now);
    }
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawCredit(ctx, camera);
  }

  /** Copies the tiles of the current scale, and draws missing tiles within the time budget. */
  show(ctx, left, top, width, height, from_ms) {
    const { TILE, CACHED, BUDGET_MS } = Basemap;
    const { tiles, scale } = this.level;
    const [i0, i1] = [Math.floor(left / TILE), Math.floor((left + width - 1) / TILE)];
    const [j0, j1] = [Math.floor(top / TILE), Math.floor((top + height - 1) / TILE)];
    let drawn = 0;
    const hasTime = () => drawn === 0 || performance.now() - from_ms < BUDGET_MS;
    /** The canvas of a tile; `null` if it is not complete yet. */
    const tile = (i, j) => {
      const key = `${i} ${j}`;
      const held = tiles.get(key) ?? { canvas: null, quarters: 0 };
      for (; held.quarters < 4 && hasTime(); held.quarters++, drawn++) this.quarter(held, i, j, scale);
      // The tile used last moves to the end, so that the oldest tiles are deleted first.
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
    if (missing) this.stretch(ctx, this.before, scale, left, top);
    else this.before = null;
    for (const [canvas, x, y] of shown) ctx.drawImage(canvas, x, y);
    if (missing) this.renew();
    // Tiles next to the visible ones are drawn in advance, because the camera may move there.
    for (let i = i0 - 1; i <= i1 + 1; i++) {
      for (let j = j0 - 1; j <= j1 + 1; j++) {
        if (!missing && drawn === 0 && tiles.get(`${i} ${j}`)?.quarters !== 4) tile(i, j);
      }
    }
    const most = CACHED * (i1 - i0 + 1) * (j1 - j0 + 1) + 16;
    for (const key of tiles.keys()) {
      if (tiles.size <= most) break;
      tiles.delete(key);
    }
    this.canvas.dataset.basemapTiles = missing ? "some" : "all";
  }

  /** Draws the tiles of another scale, stretched. */
  stretch(ctx, level, scale, left, top) {
    if (!level) return;
    const factor = scale / level.scale;
    const side = Basemap.TILE * factor;
    for (const [key, { canvas, quarters }] of level.tiles) {
      if (quarters < 4) continue;
      const [i, j] = key.split(" ").map(Number);
      const [x, y] = [i * side - left, j * side - top];
      if (x + side < 0 || y + side < 0 || x > ctx.canvas.width || y > ctx.canvas.height) continue;
      ctx.drawImage(canvas, x, y, side + 1, side + 1);
    }
  }

  /** The shapes that may be in a rectangle, in drawing order. */
  near(west, east, south, north) {
    const cell = (value) => Math.floor(value / Basemap.CELL_M);
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
    const side = Basemap.TILE / 2;
    if (!tile.canvas) {
      tile.canvas = document.createElement("canvas");
      tile.canvas.width = tile.canvas.height = Basemap.TILE;
      tile.ctx = tile.canvas.getContext("2d", { alpha: false });
    }
    const [across, down] = [tile.quarters % 2, tile.quarters >> 1];
    const [i, j] = [2 * tileI + across, 2 * tileJ + down];
    const { ctx } = tile;
    ctx.save();
    ctx.translate(across * side, down * side);
    ctx.beginPath();
    ctx.rect(0, 0, side, side);
    ctx.clip();
    ctx.fillStyle = palette().ground;
    ctx.fillRect(0, 0, side, side);
    // The margin covers the widest line.
    const reach_m = 60 + 4 / scale;
    const [west, east] = [(i * side) / scale - reach_m, ((i + 1) * side) / scale + reach_m];
    const [south, north] = [(-(j + 1) * side) / scale - reach_m, (-j * side) / scale + reach_m];
    this.drawShapes(ctx, [west, east, south, north], scale, -i * side, -j * side);
    ctx.restore();
  }

  /** Draws the shapes in a rectangle with `scale` px per m; the origin of the plane is at `x0`, `y0` px. */
  drawShapes(ctx, [west, east, south, north], scale, x0, y0) {
    const colours = palette().basemap;
    const groups = new Map();
    for (const shape of this.near(west, east, south, north)) {
      const { kind, width_m, area } = shape;
      if (shape.east < west || shape.west > east || shape.north < south || shape.south > north) continue;
      // Shapes smaller than about a pixel are not visible.
      if (scale < LINE_STYLES[kind][1] || shape.size_m * scale < (area ? 1.2 : 0.5)) continue;
      const key = `${kind} ${area ? "area" : width_m}`;
      if (!groups.has(key)) groups.set(key, { kind, width_m, area, shapes: [] });
      groups.get(key).shapes.push(shape);
    }
    for (const { kind, width_m, area, shapes } of groups.values()) {
      ctx.beginPath();
      for (const points of shapes.flatMap(({ rings }) => rings)) {
        ctx.moveTo(points[0] * scale + x0, -points[1] * scale + y0);
        for (let k = 2; k < points.length; k += 2) ctx.lineTo(points[k] * scale + x0, -points[k + 1] * scale + y0);
        if (area) ctx.closePath();
      }
      ctx.fillStyle = ctx.strokeStyle = colours[kind];
      if (area) {
        ctx.fill("evenodd");
      } else {
        ctx.lineWidth = Math.max(width_m * scale, LINE_STYLES[kind][0]);
        // Round ends of thin lines are slow to draw and not visible.
        [ctx.lineJoin, ctx.lineCap] = ctx.lineWidth > 2 ? ["round", "round"] : ["bevel", "butt"];
        ctx.stroke();
      }
    }
  }

  /** Draws the visible part of the map without tiles, for files. */
  drawWhole(ctx, camera) {
    const { x_m, y_m, px_per_m, width, height } = camera;
    const [west, north] = camera.world(0, 0);
    const [east, south] = camera.world(width, height);
    this.drawShapes(ctx, [west, east, south, north], px_per_m, width / 2 - x_m * px_per_m, height / 2 + y_m * px_per_m);
    this.drawCredit(ctx, camera);
  }

  /** The visible named lines that are at least `least_px` long, longest first. */
  named(camera, least_px) {
    const [west, north] = camera.world(0, 0);
    const [east, south] = camera.world(camera.width, camera.height);
    const isVisible = (shape) => shape.name && shape.size_m * camera.px_per_m >= least_px && shape.east > west && shape.west < east && shape.north > south && shape.south < north;
    return this.near(west, east, south, north).filter(isVisible).sort((a, b) => b.size_m - a.size_m);
  }

  /** Draws the copyright notice of the map. */
  drawCredit(ctx, camera) {
    if (!this.credit) return;
    ctx.font = "11px system-ui, sans-serif";
    ctx.fillStyle = palette().faint;
    ctx.textAlign = "right";
    ctx.textBaseline = "bottom";
    // The outline in the background colour makes the text legible on roads.
    ctx.strokeStyle = palette().ground;
    ctx.lineWidth = 3;
    const text = String(this.credit).slice(0, 60);
    ctx.strokeText(text, camera.width - 8, camera.height - 28);
    ctx.fillText(text, camera.width - 8, camera.height - 28);
  }
}
