// A replay in memory: decodes its data and looks up values by time. `src/replay.rs` describes the format.

/** Numbers by column, object and time step; NaN for missing values. */
class Table {
  constructor(directory, stepCount, bytes) {
    this.ids = directory.ids;
    this.stepCount = stepCount;
    this.rows = new Map(directory.ids.map((id, row) => [id, row]));
    this.columns = new Map();
    const cells = directory.ids.length * stepCount;
    directory.columns.forEach((name, index) => {
      this.columns.set(name, Table.column(bytes, 4 * cells * index, cells, stepCount));
    });
    this.bytes = 4 * cells * directory.columns.length;
  }

  /** Decodes a column: four byte planes contain the differences between the bit patterns of consecutive numbers, object by object. */
  static column(bytes, from, cells, stepCount) {
    const bits = new Uint32Array(cells);
    for (let byte = 0; byte < 4; byte++) {
      const plane = from + byte * cells;
      for (let cell = 0; cell < cells; cell++) bits[cell] |= bytes[plane + cell] << (8 * byte);
    }
    for (let cell = 0; cell < cells; cell++) {
      if (cell % stepCount !== 0) bits[cell] = bits[cell] + bits[cell - 1];
    }
    return new Float32Array(bits.buffer);
  }

  value(column, id, stepIndex) {
    const row = this.rows.get(id);
    return row === undefined ? NaN : this.columns.get(column)[row * this.stepCount + stepIndex];
  }
}

/** The overview, the detail or the team states of one part of a replay. */
class Block {
  constructor(bytes) {
    const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
    const directory = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    this.times_s = directory.times_us.map((time) => time / 1e6);
    this.events = directory.events;
    /** Bounds (west, south, east, north) of everything that an overview shows, m; `null` if it shows nothing. */
    this.bounds_m = directory.bounds_m ?? null;
    this.tables = {};
    let rest = bytes.subarray(4 + length);
    for (const table of directory.tables) {
      const cells = table.ids.length * this.times_s.length;
      if (4 * cells * table.columns.length > rest.length) throw new Error(`the table ${table.name} is truncated`);
      this.tables[table.name] = new Table(table, this.times_s.length, rest);
      rest = rest.subarray(this.tables[table.name].bytes);
    }
  }
}

/** Index of the last time that is not later than `time_s`; -1 if there is none. */
function lastNotAfter(times_s, time_s) {
  let low = 0;
  let high = times_s.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times_s[middle] <= time_s + 1e-9) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Cache of blocks of one kind around the time shown. It loads the requested blocks and keeps the most recent ones. */
class BlockCache {
  /** Maximum number of blocks in the cache. */
  static KEPT = 12;

  constructor(replayData, kind) {
    this.replayData = replayData;
    this.kind = kind;
    /** By part: the block, and the number of time steps of the overview when the block was requested. */
    this.blocks = new Map();
    this.requested = [];
    this.loading = false;
  }

  /** Requests blocks; they replace earlier requests. */
  request(parts) {
    this.requested = parts;
    this.load();
  }

  /** Loads requested blocks that are missing or have grown, one at a time, so that blocks skipped while scrubbing are not loaded. */
  async load() {
    const { replayData } = this;
    const size = (part) => replayData.parts[part]?.times_s.length ?? 0;
    const part = this.requested.find((part) => (this.blocks.get(part)?.stepCount ?? 0) < size(part));
    if (part === undefined || this.loading) return;
    this.loading = true;
    const stepCount = size(part);
    let block;
    try {
      block = await replayData.source.block(this.kind, part);
    } catch {
      // The next drawn frame requests it again; while the time is paused, a frame is drawn after one second.
      setTimeout(() => replayData.loaded?.(), 1000);
    }
    this.loading = false;
    if (block) {
      this.keep(part, { block, stepCount });
      this.load();
    }
  }

  keep(part, held) {
    this.blocks.delete(part);
    this.blocks.set(part, held);
    const old = [...this.blocks.keys()].filter((other) => Math.abs(other - part) > 1);
    for (const other of old.slice(0, Math.max(0, this.blocks.size - BlockCache.KEPT))) this.blocks.delete(other);
    this.replayData.loaded?.();
  }
}

/** The loaded part of a replay: all overviews, and the details around the time shown. */
class ReplayData {
  constructor(source, head) {
    this.source = source;
    this.head = head;
    this.parts = [];
    this.starts = [];
    this.times_s = [];
    /** Events of all agents, and events of the shown team state. */
    this.allEvents = [];
    this.events = [];
    this.blockCache = new BlockCache(this, "detail");
    this.details = this.blockCache.blocks;
    this.agents = new Agents(this);
    /** Whether the newest time step is shown; its detail is then loaded first. */
    this.followed = false;
    this.ids = { uavs: [], groups: [], intruders: [] };
    /** The largest number of objects at one time step. */
    this.most = { uavs: 0, groups: 0, intruders: 0 };
    /** Index of the colour in the palette, by group. */
    this.colours = new Map();
    this.done = false;
  }

  /** Adds the overview of the next part, or replaces the overview of the last part by a longer one. */
  put(index, block) {
    // Events are only added: existing events stay the same objects.
    const known = this.allEvents.filter((event) => event.part === index);
    if (index < this.parts.length) {
      this.parts.length = index;
      this.times_s.length = this.starts[index];
      this.starts.length = index;
      this.allEvents = this.allEvents.filter((event) => event.part < index);
    }
    this.starts.push(this.times_s.length);
    this.parts.push(block);
    for (const time_s of block.times_s) this.times_s.push(time_s);
    block.events.forEach((event, number) => {
      this.allEvents.push(known[number] ?? { ...event, part: index, time_s: event.time_us / 1e6 });
    });
    for (const name of ["uavs", "groups", "intruders"]) {
      const known = new Set(this.ids[name]);
      // Runs without intruders have no table of them.
      const added = (block.tables[name]?.ids ?? []).filter((id) => !known.has(id));
      if (added.length) this.ids[name] = [...this.ids[name], ...added].sort((a, b) => a - b);
      if (block.tables[name]) this.most[name] = Math.max(this.most[name], mostAtOnce(block.tables[name]));
    }
    for (const [id, row] of block.tables.groups.rows) {
      const { columns, stepCount } = block.tables.groups;
      const colours = columns.get("colour").subarray(row * stepCount, (row + 1) * stepCount);
      this.colours.set(id, colours.find((colour) => !Number.isNaN(colour)));
    }
    this.agents.put(block);
    this.selectEvents();
    this.loaded?.();
  }

  /** Selects the events of the shown team state. */
  selectEvents() {
    this.events = this.agents.isSeveral ? this.allEvents.filter((event) => this.agents.hasEvent(event)) : this.allEvents;
  }

  get end_s() {
    return this.times_s.length ? this.times_s[this.times_s.length - 1] : 0;
  }

  /** Bounds (west, south, east, north) of everything in the loaded part of the run, m; `null` if there is nothing. */
  bounds_m() {
    return unionOf(this.parts.map((block) => block.bounds_m));
  }

  /** Index of the time step that is current at a time. */
  stepAt(time_s) {
    return Math.max(0, lastNotAfter(this.times_s, time_s));
  }

  /** Index of the part that contains a time step. */
  part(stepIndex) {
    return Math.max(0, lastNotAfter(this.starts, stepIndex));
  }

  /** A value of the overview; NaN if it is missing. */
  value(table, column, id, stepIndex) {
    if (stepIndex < 0 || stepIndex >= this.times_s.length) return NaN;
    const part = this.part(stepIndex);
    return this.parts[part].tables[table]?.value(column, id, stepIndex - this.starts[part]) ?? NaN;
  }

  /** All columns of one object at a time step of the overview, by name; empty if the table is missing. */
  row(table, id, stepIndex) {
    const columns = this.parts[this.part(stepIndex)]?.tables[table]?.columns ?? new Map();
    return Object.fromEntries([...columns.keys()].map((column) => [column, this.value(table, column, id, stepIndex)]));
  }

  /** A column of one object over all time steps. */
  series(table, column, id) {
    const values = new Float32Array(this.times_s.length).fill(NaN);
    this.parts.forEach((block, index) => {
      const { rows, columns, stepCount } = block.tables[table] ?? {};
      const row = rows?.get(id);
      if (row === undefined) return;
      values.set(columns.get(column).subarray(row * stepCount, (row + 1) * stepCount), this.starts[index]);
    });
    return values;
  }

  /**
   * The detail around a time; `undefined` if it is not loaded up to that time, in which case it is requested. In a growing part
   * the overview may be newer than the detail: targets and UAVs are always shown at the same time.
   */
  detail(time_s) {
    const part = this.part(this.stepAt(time_s));
    const last = this.parts.length - 1;
    this.blockCache.request(this.followed && last > part + 1 ? [last] : [part, part + 1]);
    return this.isWhole(time_s) ? this.details.get(part).block : undefined;
  }

  /** Whether overview and detail are loaded at a time: for the current time step and, between two time steps, for the next one. */
  isWhole(time_s) {
    const stepIndex = this.stepAt(time_s);
    const part = this.part(stepIndex);
    const block = this.details.get(part)?.block;
    const { stride } = this.head;
    const at = Math.floor((stepIndex - this.starts[part]) / stride);
    if (!block || at >= block.times_s.length) return false;
    if (at + 1 < block.times_s.length || time_s <= block.times_s[at] + 1e-9) return true;
    if ((at + 1) * stride < this.parts[part].times_s.length) return false;
    return part + 1 === this.parts.length || this.details.get(part + 1)?.block.times_s.length > 0;
  }

  /** Time of the newest time step for which overview and detail are loaded; -Infinity if there is none. */
  get shown_end_s() {
    for (let part = this.parts.length - 1; part >= 0; part--) {
      const loaded = (this.details.get(part)?.block.times_s.length ?? 0) * this.head.stride;
      if (loaded > 0) return this.times_s[this.starts[part] + Math.min(loaded, this.parts[part].times_s.length) - 1];
    }
    return -Infinity;
  }

  /** The times of a detail and the first time of the next one, so that targets can be interpolated between the two. */
  detailTimes(detail) {
    const following = this.after(detail);
    return following ? [...detail.times_s, following.times_s[0]] : detail.times_s;
  }

  /** The detail after another one; `undefined` if it is not loaded or empty. */
  after(detail) {
    for (const [part, held] of this.details) {
      if (held.block !== detail) continue;
      const next = this.details.get(part + 1)?.block;
      return next?.times_s.length ? next : undefined;
    }
    return undefined;
  }
}

/** Interpolates between two angles along the shorter way. */
function interpolateAngle(from_rad, to_rad, share) {
  const turn_rad = Math.atan2(Math.sin(to_rad - from_rad), Math.cos(to_rad - from_rad));
  return from_rad + share * turn_rad;
}

/** The angle between the boresight of a UAV and the direction from the UAV to a position, rad. */
function offBoresight_rad(uav, x_m, y_m) {
  return Math.abs(interpolateAngle(uav.boresight_rad, Math.atan2(y_m - uav.y_m, x_m - uav.x_m), 1) - uav.boresight_rad);
}

/** Interpolates between two values; returns `a` if `b` is NaN. */
function interpolate(a, b, share) {
  return Number.isNaN(b) ? a : a + share * (b - a);
}
