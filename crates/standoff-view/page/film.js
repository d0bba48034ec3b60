// A replay in memory: its halves are decoded here, and values looked up by time. `src/replay.rs` describes the format.

/** Inflates gzip. */
async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Numbers by column, object and instant; NaN for what there is not. */
class Table {
  constructor(directory, instants, bytes) {
    this.ids = directory.ids;
    this.instants = instants;
    this.places = new Map(directory.ids.map((id, place) => [id, place]));
    this.columns = new Map();
    const cells = directory.ids.length * instants;
    directory.columns.forEach((name, index) => {
      this.columns.set(name, Table.column(bytes, 4 * cells * index, cells, instants));
    });
    this.bytes = 4 * cells * directory.columns.length;
  }

  /** Four planes of bytes hold the differences of the numbers' bits, object by object. */
  static column(bytes, from, cells, instants) {
    const bits = new Uint32Array(cells);
    for (let place = 0; place < 4; place++) {
      const plane = from + place * cells;
      for (let cell = 0; cell < cells; cell++) bits[cell] |= bytes[plane + cell] << (8 * place);
    }
    for (let cell = 0; cell < cells; cell++) {
      if (cell % instants !== 0) bits[cell] = bits[cell] + bits[cell - 1];
    }
    return new Float32Array(bits.buffer);
  }

  value(column, id, instant) {
    const place = this.places.get(id);
    return place === undefined ? NaN : this.columns.get(column)[place * this.instants + instant];
  }
}

/** One half of a part. */
class Half {
  constructor(bytes) {
    const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
    const directory = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    this.times_s = directory.times_us.map((time) => time / 1e6);
    this.events = directory.events;
    /** West, south, east and north of all that an overview's instants show, m; `null` if that is nothing. */
    this.bounds_m = directory.bounds_m ?? null;
    this.tables = {};
    let rest = bytes.subarray(4 + length);
    for (const table of directory.tables) {
      const cells = table.ids.length * this.times_s.length;
      if (4 * cells * table.columns.length > rest.length) throw new Error(`the table ${table.name} is cut off`);
      this.tables[table.name] = new Table(table, this.times_s.length, rest);
      rest = rest.subarray(this.tables[table.name].bytes);
    }
  }
}

/** Index of the last time that is not later than `time_s`; -1 before the first. */
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

/** Halves of one kind around what is shown: those that are wanted are loaded, and the newest kept. */
class Shelf {
  /** How many are kept. */
  static KEPT = 12;

  constructor(film, kind) {
    this.film = film;
    this.kind = kind;
    /** By part: the half, and how many instants the overview had when it was asked for. */
    this.halves = new Map();
    this.wanted = [];
    this.loading = false;
  }

  want(parts) {
    this.wanted = parts;
    this.load();
  }

  /** Loads what is wanted and is not there, or has become more; one at a time: what was only passed by is not loaded. */
  async load() {
    const { film } = this;
    const size = (part) => film.parts[part]?.times_s.length ?? 0;
    const part = this.wanted.find((part) => (this.halves.get(part)?.instants ?? 0) < size(part));
    if (part === undefined || this.loading) return;
    this.loading = true;
    const instants = size(part);
    let half;
    try {
      half = await film.source.half(this.kind, part);
    } catch {
      // The next picture asks for it again; where time stands still, there is one in a second.
      setTimeout(() => film.loaded?.(), 1000);
    }
    this.loading = false;
    if (half) {
      this.keep(part, { half, instants });
      this.load();
    }
  }

  keep(part, held) {
    this.halves.delete(part);
    this.halves.set(part, held);
    const old = [...this.halves.keys()].filter((other) => Math.abs(other - part) > 1);
    for (const other of old.slice(0, Math.max(0, this.halves.size - Shelf.KEPT))) this.halves.delete(other);
    this.film.loaded?.();
  }
}

/** A replay as far as it has been loaded: every overview, and the details around what is shown. */
class Film {
  constructor(source, head) {
    this.source = source;
    this.head = head;
    this.parts = [];
    this.starts = [];
    this.times_s = [];
    /** Of all minds, and of the one whose picture is shown. */
    this.allEvents = [];
    this.events = [];
    this.shelf = new Shelf(this, "detail");
    this.details = this.shelf.halves;
    this.minds = new Minds(this);
    /** The newest instant is being looked at: its detail is loaded first. */
    this.followed = false;
    this.ids = { uavs: [], groups: [], intruders: [] };
    /** By group: which of the palette's colours it has. */
    this.colours = new Map();
    this.done = false;
  }

  /** Takes in the overview of a part: of the next one, or more of the last one. */
  put(index, half) {
    // Events only ever come in: those that are known stay the same objects.
    const known = this.allEvents.filter((event) => event.part === index);
    if (index < this.parts.length) {
      this.parts.length = index;
      this.times_s.length = this.starts[index];
      this.starts.length = index;
      this.allEvents = this.allEvents.filter((event) => event.part < index);
    }
    this.starts.push(this.times_s.length);
    this.parts.push(half);
    for (const time_s of half.times_s) this.times_s.push(time_s);
    half.events.forEach((event, place) => {
      this.allEvents.push(known[place] ?? { ...event, part: index, time_s: event.time_us / 1e6 });
    });
    for (const name of ["uavs", "groups", "intruders"]) {
      const known = new Set(this.ids[name]);
      // There are not always intruders.
      const added = (half.tables[name]?.ids ?? []).filter((id) => !known.has(id));
      if (added.length) this.ids[name] = [...this.ids[name], ...added].sort((a, b) => a - b);
    }
    for (const [id, place] of half.tables.groups.places) {
      const { columns, instants } = half.tables.groups;
      const told = columns.get("colour").subarray(place * instants, (place + 1) * instants);
      this.colours.set(id, told.find((colour) => !Number.isNaN(colour)));
    }
    this.minds.put(half);
    this.tellEvents();
    this.loaded?.();
  }

  /** Another mind's picture is shown. */
  tellEvents() {
    this.events = this.minds.isSeveral ? this.allEvents.filter((event) => this.minds.tells(event)) : this.allEvents;
  }

  get end_s() {
    return this.times_s.length ? this.times_s[this.times_s.length - 1] : 0;
  }

  /** West, south, east and north of all that the run shows, as far as it has been loaded, m; `null` if that is nothing. */
  bounds_m() {
    return unionOf(this.parts.map((half) => half.bounds_m));
  }

  /** The instant that is on at a time. */
  instant(time_s) {
    return Math.max(0, lastNotAfter(this.times_s, time_s));
  }

  /** The part that holds an instant. */
  part(instant) {
    return Math.max(0, lastNotAfter(this.starts, instant));
  }

  /** A value of the overview. */
  value(table, column, id, instant) {
    if (instant < 0 || instant >= this.times_s.length) return NaN;
    const part = this.part(instant);
    return this.parts[part].tables[table]?.value(column, id, instant - this.starts[part]) ?? NaN;
  }

  /** A column of one object over all instants. */
  series(table, column, id) {
    const values = new Float32Array(this.times_s.length).fill(NaN);
    this.parts.forEach((half, index) => {
      const { places, columns, instants } = half.tables[table] ?? {};
      const place = places?.get(id);
      if (place === undefined) return;
      values.set(columns.get(column).subarray(place * instants, (place + 1) * instants), this.starts[index]);
    });
    return values;
  }

  /**
   * The detail around a time, if it has been loaded as far as that; else `undefined`, and it is loaded. Of a part that
   * grows, one half may be older than the other: targets are never shown of another time than the UAVs beside them.
   */
  detail(time_s) {
    const part = this.part(this.instant(time_s));
    const last = this.parts.length - 1;
    this.shelf.want(this.followed && last > part + 1 ? [last] : [part, part + 1]);
    return this.isWhole(time_s) ? this.details.get(part).half : undefined;
  }

  /** Whether both halves are there at a time: of the instant that is on, and of the next one if it is between them. */
  isWhole(time_s) {
    const instant = this.instant(time_s);
    const part = this.part(instant);
    const half = this.details.get(part)?.half;
    const { stride } = this.head;
    const at = Math.floor((instant - this.starts[part]) / stride);
    if (!half || at >= half.times_s.length) return false;
    if (at + 1 < half.times_s.length || time_s <= half.times_s[at] + 1e-9) return true;
    if ((at + 1) * stride < this.parts[part].times_s.length) return false;
    return part + 1 === this.parts.length || this.details.get(part + 1)?.half.times_s.length > 0;
  }

  /** The newest instant of which both halves are there; -Infinity if of none. */
  get shown_end_s() {
    for (let part = this.parts.length - 1; part >= 0; part--) {
      const told = (this.details.get(part)?.half.times_s.length ?? 0) * this.head.stride;
      if (told > 0) return this.times_s[this.starts[part] + Math.min(told, this.parts[part].times_s.length) - 1];
    }
    return -Infinity;
  }

  /** The times of a detail, and the first of the one that follows it: between those two targets are shown, too. */
  detailTimes(detail) {
    const following = this.after(detail);
    return following ? [...detail.times_s, following.times_s[0]] : detail.times_s;
  }

  /** The detail that follows another one, if it has been loaded and holds anything. */
  after(detail) {
    for (const [part, held] of this.details) {
      if (held.half !== detail) continue;
      const next = this.details.get(part + 1)?.half;
      return next?.times_s.length ? next : undefined;
    }
    return undefined;
  }
}

/** Between two angles, the shorter way round. */
function turned(from_rad, to_rad, share) {
  const way = Math.atan2(Math.sin(to_rad - from_rad), Math.cos(to_rad - from_rad));
  return from_rad + share * way;
}

/** Between two values: `b` may be missing. */
function between(a, b, share) {
  return Number.isNaN(b) ? a : a + share * (b - a);
}
