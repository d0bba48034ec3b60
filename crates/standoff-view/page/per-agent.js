// Team states of several agents: which one is shown, what each agent believes about the other UAVs, and where the agents
// differ. `src/replay/agents.rs` describes the tables.

/** Names of the teammate statuses, by their number in the tables. */
const TEAMMATE_STATUS = ["live", "silent", "timed out", "left", "never received"];
/** Statuses of UAVs whose reports are not received although they have not left the team. */
const NOT_RECEIVED = new Set(["silent", "timed out", "never received"]);

class Agents {
  constructor(replayData) {
    this.replayData = replayData;
    this.shelf = new Shelf(replayData, "team-states");
    /** UAVs that run their own agent; empty if the team shares one. */
    this.ids = [];
    /** The UAV whose team state is shown; `null`: the UAV of lowest id whose computer is on. */
    this.chosen = null;
    this.cache = { size: -1, chosen: null, spans: null };
  }

  get isSeveral() {
    return this.ids.length > 0;
  }

  /** Adds the agents of an overview. */
  put(half) {
    this.ids = [...new Set([...this.ids, ...(half.tables.agents?.ids ?? [])])].sort((a, b) => a - b);
  }

  choose(uav) {
    this.chosen = uav;
    this.replayData.selectEvents();
  }

  /** Whether the computer of a UAV is on. */
  isOn(uav, instant) {
    return !Number.isNaN(this.replayData.value("agents", "link_degraded", uav, instant));
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
    return !by || by.includes(this.chosen ?? this.first(this.replayData.instant(time_s)));
  }

  /** What an agent believes about a UAV: its status, the age of its last report, and the group that it is assigned to. */
  believed(agent, uav, instant) {
    const { replayData } = this;
    const at = (column) => replayData.value(`team-${agent}`, column, uav, instant);
    if (!Number.isNaN(at("status"))) {
      return { status: TEAMMATE_STATUS[at("status")], age_s: at("age_s"), group: idOf(at("group")), created_s: at("created_s") };
    }
    const own = (column) => replayData.value("agents", column, uav, instant);
    return { status: "live", age_s: 0, group: idOf(own("group")), created_s: own("created_s") };
  }

  /** The UAVs whose reports an agent does not receive. */
  notReceived(agent, instant) {
    const others = this.replayData.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...this.believed(agent, uav, instant) }));
    return others.filter(({ status }) => NOT_RECEIVED.has(status));
  }

  /** Sets of agents with equal assignments; the set with the lowest id comes first. */
  agreeingSets(instant) {
    return [...grouped(this.on(instant), (uav) => this.replayData.value("agents", "assignments", uav, instant)).values()];
  }

  /** Whether the assignments of the agents differ. */
  differ(instant) {
    const [first, ...others] = this.on(instant);
    return others.some((uav) => this.replayData.value("agents", "assignments", uav, instant) !== first);
  }

  /**
   * Time ranges in which assignments differ (`differ`), in which a UAV is silent (`silent`) or timed out (`timedOut`) in the shown
   * team state, and in which there is no team state (`off`).
   */
  spans() {
    const { replayData, chosen, cache } = this;
    const size = replayData.times_s.length;
    if (cache.size === size && cache.chosen === chosen) return cache.spans;
    const spans = { differ: [], silent: [], timedOut: [], off: [] };
    replayData.times_s.forEach((time_s, instant) => {
      const owner = this.owner(instant);
      const notReceived = owner === null ? [] : this.notReceived(owner, instant);
      const is = {
        differ: this.differ(instant), off: owner === null, timedOut: notReceived.some(({ status }) => status !== "silent"),
        silent: notReceived.some(({ status }) => status === "silent"),
      };
      for (const kind of Object.keys(spans).filter((kind) => is[kind])) {
        const last = spans[kind].at(-1);
        const until_s = replayData.times_s[instant + 1] ?? time_s + replayData.head.period_s;
        if (last?.until === instant) Object.assign(last, { until_s, until: instant + 1 });
        else spans[kind].push({ from_s: time_s, until_s, until: instant + 1 });
      }
    });
    this.cache = { size, chosen, spans };
    return spans;
  }

  /** The team states at the current and the next time step; `undefined` while they are being loaded. */
  teamStates(time_s) {
    const { replayData } = this;
    const part = replayData.part(replayData.instant(time_s));
    this.shelf.want([part, part + 1].filter((part) => replayData.parts[part]?.tables.agents));
    return this.shelf.halves.get(part)?.half;
  }
}

/** Text that names the shown team state. */
function teamStateText(replayData, instant) {
  const { agents } = replayData;
  const owner = agents.owner(instant);
  if (owner !== null) return `team state of UAV ${owner}`;
  return agents.chosen === null ? "no team state: all computers are off" : `no team state: the computer of UAV ${agents.chosen} is off`;
}

/** Text that lists the UAVs whose reports an agent does not receive; "none" if it receives the reports of all. */
function notReceivedText(replayData, agent, instant) {
  const notReceived = replayData.agents.notReceived(agent, instant);
  const text = ({ uav, status, age_s }) => `UAV ${uav} ${status}${Number.isNaN(age_s) ? "" : `, last report ${age_s.toFixed(1)} s ago`}`;
  return notReceived.length ? notReceived.map(text).join("; ") : "none";
}

/** Text with the age of the last report of each other UAV. */
function reportAgesText(replayData, agent, instant) {
  const others = replayData.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...replayData.agents.believed(agent, uav, instant) }));
  return others.map(({ uav, age_s }) => `UAV ${uav} ${Number.isNaN(age_s) ? "\u2013" : `${age_s.toFixed(1)} s`}`).join(", ");
}

/** Text with the assignments in the team state of an agent. */
function assignmentsText(replayData, agent, instant) {
  const assigned = replayData.ids.uavs.map((uav) => ({ uav, ...replayData.agents.believed(agent, uav, instant) })).filter(({ group }) => group !== null);
  const byGroup = [...grouped(assigned, ({ group }) => group)].sort(([a], [b]) => a - b);
  if (!byGroup.length) return "no UAV is assigned";
  const text = ([group, uavs]) => `group ${group} (created at ${uavs[0].created_s.toFixed(1)} s): UAV ${uavs.map(({ uav }) => uav).join(", ")}`;
  return byGroup.map(text).join("; ");
}

/** Text that lists the sets of agents with different assignments; empty if all agree. */
function disagreementText(replayData, instant) {
  const agreeingSets = replayData.agents.agreeingSets(instant);
  const text = (set) => `UAV ${set.join(", ")}`;
  return agreeingSets.length > 1 ? `assignments differ: ${agreeingSets.map(text).join(" | ")}` : "";
}
