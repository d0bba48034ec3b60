// Several minds: whose picture is shown, what each believes of the others, and where they differ. `src/replay/minds.rs`
// describes the tables.

const PRESENCE = ["live", "silent", "gone", "left", "never heard"];
/** Who is not heard though it is not said to have left. */
const UNHEARD = new Set(["silent", "gone", "never heard"]);

class Minds {
  constructor(film) {
    this.film = film;
    this.shelf = new Shelf(film, "pictures");
    /** UAVs that have a mind of their own; none, where one thinks for all. */
    this.ids = [];
    /** The UAV whose picture is shown; `null`: the one of lowest id whose computer is on. */
    this.chosen = null;
    this.worked = { size: -1, chosen: null, spans: null };
  }

  get isSeveral() {
    return this.ids.length > 0;
  }

  /** Takes in an overview. */
  put(half) {
    this.ids = [...new Set([...this.ids, ...(half.tables.minds?.ids ?? [])])].sort((a, b) => a - b);
  }

  choose(uav) {
    this.chosen = uav;
    this.film.tellEvents();
  }

  /** Whether a UAV's computer is on. */
  isOn(uav, instant) {
    return !Number.isNaN(this.film.value("minds", "disturbed", uav, instant));
  }

  /** Those whose computer is on. */
  on(instant) {
    return this.ids.filter((uav) => this.isOn(uav, instant));
  }

  /** The UAV whose picture the run's own tables hold. */
  first(instant) {
    return this.ids.find((uav) => this.isOn(uav, instant)) ?? null;
  }

  /** The UAV whose picture is shown at an instant; `null` if there is none. */
  owner(instant) {
    if (this.chosen === null) return this.first(instant);
    return this.isOn(this.chosen, instant) ? this.chosen : null;
  }

  /** The picture that is shown is not that of the run's own tables: another one, or none. */
  isOther(instant) {
    return this.isSeveral && this.owner(instant) !== this.first(instant);
  }

  /** Whether the picture that is shown tells an event. */
  tells({ by, time_s }) {
    return !by || by.includes(this.chosen ?? this.first(this.film.instant(time_s)));
  }

  /** What a mind believes of a UAV: who it takes it for, how old its newest report is, and which group it serves. */
  believed(mind, uav, instant) {
    const { film } = this;
    const at = (column) => film.value(`team-${mind}`, column, uav, instant);
    if (!Number.isNaN(at("presence"))) {
      return { presence: PRESENCE[at("presence")], age_s: at("age_s"), group: idOf(at("group")), founded_s: at("founded_s") };
    }
    const own = (column) => film.value("minds", column, uav, instant);
    return { presence: "live", age_s: 0, group: idOf(own("group")), founded_s: own("founded_s") };
  }

  /** Whom a mind does not hear. */
  unheard(mind, instant) {
    const others = this.film.ids.uavs.filter((uav) => uav !== mind).map((uav) => ({ uav, ...this.believed(mind, uav, instant) }));
    return others.filter(({ presence }) => UNHEARD.has(presence));
  }

  /** Minds that agree on who serves what, those of the lowest id first. */
  parties(instant) {
    return [...grouped(this.on(instant), (uav) => this.film.value("minds", "crew", uav, instant)).values()];
  }

  differ(instant) {
    const [first, ...others] = this.on(instant);
    return others.some((uav) => this.film.value("minds", "crew", uav, instant) !== first);
  }

  /** Stretches of time at which crews differ, somebody is silent for the picture that is shown, or it is not there. */
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

  /** The pictures around a time, of the instant that is on and the next one; `undefined` while they are being loaded. */
  pictures(time_s) {
    const { film } = this;
    const part = film.part(film.instant(time_s));
    this.shelf.want([part, part + 1].filter((part) => film.parts[part]?.tables.minds));
    return this.shelf.halves.get(part)?.half;
  }
}

/** That a picture is whose, in words. */
function pictureWords(film, instant) {
  const { minds } = film;
  const owner = minds.owner(instant);
  if (owner !== null) return `picture of UAV ${owner}`;
  return minds.chosen === null ? "no picture: every computer is off" : `no picture: the computer of UAV ${minds.chosen} is off`;
}

/** Whom a mind does not hear, in words. */
function hearsWords(film, mind, instant) {
  const unheard = film.minds.unheard(mind, instant);
  const words = ({ uav, presence, age_s }) => `UAV ${uav} ${presence}${Number.isNaN(age_s) ? "" : `, ${age_s.toFixed(1)} s ago`}`;
  return unheard.length ? unheard.map(words).join("; ") : "all";
}

/** How old the newest report of each other UAV is, in words. */
function agesWords(film, mind, instant) {
  const others = film.ids.uavs.filter((uav) => uav !== mind).map((uav) => ({ uav, ...film.minds.believed(mind, uav, instant) }));
  return others.map(({ uav, age_s }) => `UAV ${uav} ${Number.isNaN(age_s) ? "\u2013" : `${age_s.toFixed(1)} s`}`).join(", ");
}

/** Who serves which group by a mind, in words. */
function crewsWords(film, mind, instant) {
  const served = film.ids.uavs.map((uav) => ({ uav, ...film.minds.believed(mind, uav, instant) })).filter(({ group }) => group !== null);
  const crews = [...grouped(served, ({ group }) => group)].sort(([a], [b]) => a - b);
  if (!crews.length) return "nobody serves a group";
  const words = ([group, crew]) => `group ${group} (of ${crew[0].founded_s.toFixed(1)} s): UAV ${crew.map(({ uav }) => uav).join(", ")}`;
  return crews.map(words).join("; ");
}

/** Who agrees with whom, in words; nothing where all do. */
function differWords(film, instant) {
  const parties = film.minds.parties(instant);
  const words = (party) => `UAV ${party.join(", ")}`;
  return parties.length > 1 ? `crews differ: ${parties.map(words).join(" | ")}` : "";
}
