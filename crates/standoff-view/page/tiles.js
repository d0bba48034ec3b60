// Map tiles: background images from a tile server of the user, in the Web Mercator projection (EPSG:3857).

/** Side of a tile, px. */
const TILE_PX = 256;
/** Highest zoom level of tile servers. */
const MAX_ZOOM = 19;
/** Maximum number of tiles on the map; with more, a lower zoom level is shown. */
const MAX_TILES = 60;
/** Maximum number of tiles in memory. */
const MAX_CACHED_TILES = 300;

class Tiles {
  /** `template` is an address with {z}, {x} and {y}. */
  constructor(template, origin) {
    this.template = template;
    this.origin = origin;
    /** Images by address, the one used last at the end. */
    this.images = new Map();
    this.credit = `map tiles: ${new URL(template.replace(/\{[zxy]\}/g, "0")).host}`;
    /** Whether the last image could not be loaded. */
    this.hasFailed = false;
  }

  /** Column and row of a position in the tiles of a zoom level; fractions are positions within a tile. */
  place(zoom, [x_m, y_m]) {
    const [lat_deg, lon_deg] = geographic(this.origin, x_m, y_m);
    const lat = (lat_deg * Math.PI) / 180;
    const count = 2 ** zoom;
    return [((lon_deg + 180) / 360) * count, ((1 - Math.asinh(Math.tan(lat)) / Math.PI) / 2) * count];
  }

  /** Position of a corner of a tile in the plane, m. */
  corner(zoom, i, j) {
    const count = 2 ** zoom;
    const lat = Math.atan(Math.sinh(Math.PI * (1 - (2 * j) / count)));
    return local(this.origin, (lat * 180) / Math.PI, (i / count) * 360 - 180);
  }

  /** Zoom level and range of the tiles that cover the map. */
  range(camera, ratio) {
    const equator_m = 2 * Math.PI * EQUATOR_M;
    const scale = camera.px_per_m * ratio * Math.cos((this.origin.latitude_deg * Math.PI) / 180);
    const sharpest = Math.round(Math.log2((equator_m * scale) / TILE_PX));
    for (let zoom = Math.min(Math.max(sharpest, 0), MAX_ZOOM); ; zoom--) {
      const corners = [[0, 0], [camera.width, 0], [0, camera.height], [camera.width, camera.height]].map(([x, y]) => this.place(zoom, camera.world(x, y)));
      const last = 2 ** zoom - 1;
      const edge = (axis, most) => Math.min(Math.max(Math.floor(most(...corners.map((at) => at[axis]))), 0), last);
      const [i0, i1, j0, j1] = [edge(0, Math.min), edge(0, Math.max), edge(1, Math.min), edge(1, Math.max)];
      if ((i1 - i0 + 1) * (j1 - j0 + 1) <= MAX_TILES || zoom === 0) return { zoom, i0, i1, j0, j1 };
    }
  }

  /** The image at an address; it is requested if it is not in memory. `renew` requests a new frame. */
  image(zoom, i, j, renew) {
    const address = this.template.replace("{z}", zoom).replace("{x}", i).replace("{y}", j);
    let image = this.images.get(address);
    if (!image) {
      image = new Image();
      // A canvas with images of servers that do not allow it cannot be saved.
      image.crossOrigin = "anonymous";
      image.onload = () => {
        this.hasFailed = false;
        renew();
      };
      image.onerror = () => {
        this.hasFailed = true;
        renew();
      };
      image.src = address;
    }
    this.images.delete(address);
    this.images.set(address, image);
    for (const key of this.images.keys()) {
      if (this.images.size <= MAX_CACHED_TILES) break;
      this.images.delete(key);
    }
    return image.complete && image.naturalWidth ? image : null;
  }
}

/** Draws the tiles that are in memory, and requests the others. SVG files contain no images. */
function drawTiles(map, { ctx }) {
  const { tiles, camera } = map;
  if (!tiles || !ctx.drawImage) return;
  const { zoom, i0, i1, j0, j1 } = tiles.range(camera, screenRatio());
  let loaded = 0;
  // Symbols stay legible on faint tiles.
  ctx.globalAlpha = 0.6;
  for (let j = j0; j <= j1; j++) {
    for (let i = i0; i <= i1; i++) {
      const image = tiles.image(zoom, i, j, () => map.renew());
      if (!image) continue;
      loaded += 1;
      const [x, y] = camera.at(...tiles.corner(zoom, i, j));
      const [across, down] = [tiles.corner(zoom, i + 1, j), tiles.corner(zoom, i, j + 1)].map((at) => camera.at(...at));
      ctx.save();
      ctx.transform((across[0] - x) / TILE_PX, (across[1] - y) / TILE_PX, (down[0] - x) / TILE_PX, (down[1] - y) / TILE_PX, x, y);
      ctx.drawImage(image, 0, 0, TILE_PX, TILE_PX);
      ctx.restore();
    }
  }
  ctx.globalAlpha = 1;
  map.canvas.dataset.tiles = `${loaded} of ${(i1 - i0 + 1) * (j1 - j0 + 1)}`;
  ctx.textAlign = "right";
  ctx.textBaseline = "bottom";
  ctx.fillStyle = palette().faint;
  ctx.fillText(`${tiles.credit}${tiles.hasFailed ? " (not available)" : ""}`, camera.width - 8, camera.height - 44);
}
