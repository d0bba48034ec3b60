// Team states of several agents: which one is shown, what each agent believes about the other UAVs, and where the agents
// differ. `src/replay/minds.rs` describes the tables.

/** Names of the teammate statuses, by their number in the tables. */
const PRESENCE = ["live", "silent", "timed out", "left", "never received"];
/** Statuses of UAVs whose reports are not received although they have not left the team. */
const UNHEARD = new Set(["silent", "timed out", "never received"]);

class Minds {
  constructor(film) {
    this.film = film;
    this.shelf = new Shelf(film, "pictures");
    /** UAVs that run their own agent; empty if the team shares one. */
    this.ids = [];
    /** The UAV whose team state is shown; `null`: the UAV of lowest id whose computer is on. */
    this.chosen = null;
    this.worked = { size: -1, chosen: null, spans: null };
  }

  get isSeveral() {
    return this.ids.length > 0;
  }

  /** Adds the agents of an overview. */
  put(half) {
    this.ids = [...new Set([...this.ids, ...(half.tables.minds?.ids ?? [])])].sort((a, b) => a - b);
  }

  choose(uav) {
    this.chosen = uav;
    this.film.selectEvents();
  }

  /** Whether the computer of a UAV is on. */
  isOn(uav, instant) {
    return !Number.isNaN(this.film.value("minds", "disturbed", uav, instant));
  }

  /** The UAVs whose computer is on. */
  on(instant) {
    return this.ids.filter((uav) => this.isOn(uav, instant));
  }

  /** The UAV whose team state is stored in the run's main tables. */
  first(instant) {
    return this.ids.find((uav) => this.isOn(uav, instant)) ?? null;
  }

  /** The UAV whose team state is shown at a time step; `null` if there is none. */
  owner(instant) {
    if (this.chosen === null) return this.first(instant);
    return this.isOn(this.chosen, instant) ? this.chosen : null;
  }

  /** Whether the shown team state is not the one in the run's main tables: it is another one, or there is none. */
  isOther(instant) {
    return this.isSeveral && this.owner(instant) !== this.first(instant);
  }

  /** Whether an event belongs to the shown team state. */
  hasEvent({ by, time_s }) {
    return !by || by.includes(this.chosen ?? this.first(this.film.instant(time_s)));
  }

  /** What an agent believes about a UAV: its status, the age of its last report, and the group that it is assigned to. */
  believed(agent, uav, instant) {
    const { film } = this;
    const at = (column) => film.value(`team-${agent}`, column, uav, instant);
    if (!Number.isNaN(at("presence"))) {
      return { presence: PRESENCE[at("presence")], age_s: at("age_s"), group: idOf(at("group")), founded_s: at("founded_s") };
    }
    const own = (column) => film.value("minds", column, uav, instant);
    return { presence: "live", age_s: 0, group: idOf(own("group")), founded_s: own("founded_s") };
  }

  /** The UAVs whose reports an agent does not receive. */
  unheard(agent, instant) {
    const others = this.film.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...this.believed(agent, uav, instant) }));
    return others.filter(({ presence }) => UNHEARD.has(presence));
  }

  /** Sets of agents with equal assignments; the set with the lowest id comes first. */
  parties(instant) {
    return [...grouped(this.on(instant), (uav) => this.film.value("minds", "crew", uav, instant)).values()];
  }

  /** Whether the assignments of the agents differ. */
  differ(instant) {
    const [first, ...others] = this.on(instant);
    return others.some((uav) => this.film.value("minds", "crew", uav, instant) !== first);
  }

  /**
   * Time ranges in which assignments differ (`differ`), in which a UAV is silent (`silent`) or timed out (`gone`) in the shown
   * team state, and in which there is no team state (`off`).
   */
  spans() {
    const { film, chosen, worked } = this;
    const size = film.times_s.length;
    if (worked.size === size && worked.chosen === chosen) return worked.spans;
    const spans = { differ: [], silent: [], gone: [], off: [] };
    film.times_s.forEach((time_s, instant) => {
      const owner = this.owner(instant);
      const unheard = owner === null ? [] : this.unheard(owner, instant);
      const is = {
        differ: this.differ(instant), off: owner === null, gone: unheard.some(({ presence }) => presence !== "silent"),
        silent: unheard.some(({ presence }) => presence === "silent"),
      };
      for (const kind of Object.keys(spans).filter((kind) => is[kind])) {
        const last = spans[kind].at(-1);
        const until_s = film.times_s[instant + 1] ?? time_s + film.head.period_s;
        if (last?.until === instant) Object.assign(last, { until_s, until: instant + 1 });
        else spans[kind].push({ from_s: time_s, until_s, until: instant + 1 });
      }
    });
    this.worked = { size, chosen, spans };
    return spans;
  }

  /** The team states at the current and the next time step; `undefined` while they are being loaded. */
  pictures(time_s) {
    const { film } = this;
    const part = film.part(film.instant(time_s));
    this.shelf.want([part, part + 1].filter((part) => film.parts[part]?.tables.minds));
    return this.shelf.halves.get(part)?.half;
  }
}

/** Text that names the shown team state. */
function pictureWords(film, instant) {
  const { minds } = film;
  const owner = minds.owner(instant);
  if (owner !== null) return `team state of UAV ${owner}`;
  return minds.chosen === null ? "no team state: all computers are off" : `no team state: the computer of UAV ${minds.chosen} is off`;
}

/** Text that lists the UAVs whose reports an agent does not receive; "none" if it receives the reports of all. */
function hearsWords(film, agent, instant) {
  const unheard = film.minds.unheard(agent, instant);
  const text = ({ uav, presence, age_s }) => `UAV ${uav} ${presence}${Number.isNaN(age_s) ? "" : `, last report ${age_s.toFixed(1)} s ago`}`;
  return unheard.length ? unheard.map(text).join("; ") : "none";
}

/** Text with the age of the last report of each other UAV. */
function agesWords(film, agent, instant) {
  const others = film.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...film.minds.believed(agent, uav, instant) }));
  return others.map(({ uav, age_s }) => `UAV ${uav} ${Number.isNaN(age_s) ? "\u2013" : `${age_s.toFixed(1)} s`}`).join(", ");
}

/** Text with the assignments in the team state of an agent. */
function crewsWords(film, agent, instant) {
  const assigned = film.ids.uavs.map((uav) => ({ uav, ...film.minds.believed(agent, uav, instant) })).filter(({ group }) => group !== null);
  const byGroup = [...grouped(assigned, ({ group }) => group)].sort(([a], [b]) => a - b);
  if (!byGroup.length) return "no UAV is assigned";
  const text = ([group, uavs]) => `group ${group} (created at ${uavs[0].founded_s.toFixed(1)} s): UAV ${uavs.map(({ uav }) => uav).join(", ")}`;
  return byGroup.map(text).join("; ");
}

/** Text that lists the sets of agents with different assignments; empty if all agree. */
function differWords(film, instant) {
  const parties = film.minds.parties(instant);
  const text = (party) => `UAV ${party.join(", ")}`;
  return parties.length > 1 ? `assignments differ: ${parties.map(text).join(" | ")}` : "";
}
