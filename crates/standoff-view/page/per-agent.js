// Team states of several agents: which one is shown, what each agent believes about the other UAVs, and where the agents
// differ. `src/replay/per_agent.rs` describes the tables.

/** Names of the teammate statuses, by their number in the tables. */
const TEAMMATE_STATUS = ["live", "silent", "timed out", "left", "never received"];
/** Statuses of UAVs whose reports are not received although they have not left the team. */
const NOT_RECEIVED = new Set(["silent", "timed out", "never received"]);

class Agents {
  constructor(replayData) {
    this.replayData = replayData;
    this.blockCache = new BlockCache(replayData, "team-states");
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
  put(block) {
    this.ids = [...new Set([...this.ids, ...(block.tables.agents?.ids ?? [])])].sort((a, b) => a - b);
  }

  choose(uav) {
    this.chosen = uav;
    this.replayData.selectEvents();
  }

  /** Whether the computer of a UAV is on. */
  isOn(uav, stepIndex) {
    return !Number.isNaN(this.replayData.value("agents", "link_degraded", uav, stepIndex));
  }

  /** The UAVs whose computer is on. */
  on(stepIndex) {
    return this.ids.filter((uav) => this.isOn(uav, stepIndex));
  }

  /** The UAV whose team state is stored in the run's main tables. */
  first(stepIndex) {
    return this.ids.find((uav) => this.isOn(uav, stepIndex)) ?? null;
  }

  /** The UAV whose team state is shown at a time step; `null` if there is none. */
  owner(stepIndex) {
    if (this.chosen === null) return this.first(stepIndex);
    return this.isOn(this.chosen, stepIndex) ? this.chosen : null;
  }

  /** Whether the shown team state is not the one in the run's main tables: it is another one, or there is none. */
  isOther(stepIndex) {
    return this.isSeveral && this.owner(stepIndex) !== this.first(stepIndex);
  }

  /** Whether an event belongs to the shown team state. */
  hasEvent({ by, time_s }) {
    return !by || by.includes(this.chosen ?? this.first(this.replayData.stepAt(time_s)));
  }

  /** What an agent believes about a UAV: its status, the age of its last report, and the group that it is assigned to. */
  believed(agent, uav, stepIndex) {
    const { replayData } = this;
    const at = (column) => replayData.value(`team-${agent}`, column, uav, stepIndex);
    if (!Number.isNaN(at("status"))) {
      return { status: TEAMMATE_STATUS[at("status")], age_s: at("age_s"), group: idOf(at("group")), created_s: at("created_s") };
    }
    const own = (column) => replayData.value("agents", column, uav, stepIndex);
    return { status: "live", age_s: 0, group: idOf(own("group")), created_s: own("created_s") };
  }

  /** The UAVs whose reports an agent does not receive. */
  notReceived(agent, stepIndex) {
    const others = this.replayData.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...this.believed(agent, uav, stepIndex) }));
    return others.filter(({ status }) => NOT_RECEIVED.has(status));
  }

  /** Sets of agents with equal assignments; the set with the lowest id comes first. */
  agreeingSets(stepIndex) {
    return [...grouped(this.on(stepIndex), (uav) => this.replayData.value("agents", "assignments", uav, stepIndex)).values()];
  }

  /** Whether the assignments of the agents differ. */
  differ(stepIndex) {
    const [first, ...others] = this.on(stepIndex);
    return others.some((uav) => this.replayData.value("agents", "assignments", uav, stepIndex) !== first);
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
    replayData.times_s.forEach((time_s, stepIndex) => {
      const owner = this.owner(stepIndex);
      const notReceived = owner === null ? [] : this.notReceived(owner, stepIndex);
      const is = {
        differ: this.differ(stepIndex), off: owner === null, timedOut: notReceived.some(({ status }) => status !== "silent"),
        silent: notReceived.some(({ status }) => status === "silent"),
      };
      for (const kind of Object.keys(spans).filter((kind) => is[kind])) {
        const last = spans[kind].at(-1);
        const until_s = replayData.times_s[stepIndex + 1] ?? time_s + replayData.head.period_s;
        if (last?.until === stepIndex) Object.assign(last, { until_s, until: stepIndex + 1 });
        else spans[kind].push({ from_s: time_s, until_s, until: stepIndex + 1 });
      }
    });
    this.cache = { size, chosen, spans };
    return spans;
  }

  /** The team states at the current and the next time step; `undefined` while they are being loaded. */
  teamStates(time_s) {
    const { replayData } = this;
    const part = replayData.part(replayData.stepAt(time_s));
    this.blockCache.request([part, part + 1].filter((part) => replayData.parts[part]?.tables.agents));
    return this.blockCache.blocks.get(part)?.block;
  }
}

/** Text that names the shown team state. */
function teamStateText(replayData, stepIndex) {
  const { agents } = replayData;
  const owner = agents.owner(stepIndex);
  if (owner !== null) return `team state of UAV ${owner}`;
  return agents.chosen === null ? "no team state: all computers are off" : `no team state: the computer of UAV ${agents.chosen} is off`;
}

/** Text that lists the UAVs whose reports an agent does not receive; "none" if it receives the reports of all. */
function notReceivedText(replayData, agent, stepIndex) {
  const notReceived = replayData.agents.notReceived(agent, stepIndex);
  const text = ({ uav, status, age_s }) => `UAV ${uav} ${status}${Number.isNaN(age_s) ? "" : `, last report ${age_s.toFixed(1)} s ago`}`;
  return notReceived.length ? notReceived.map(text).join("; ") : "none";
}

/** Text with the age of the last report of each other UAV. */
function reportAgesText(replayData, agent, stepIndex) {
  const others = replayData.ids.uavs.filter((uav) => uav !== agent).map((uav) => ({ uav, ...replayData.agents.believed(agent, uav, stepIndex) }));
  return others.map(({ uav, age_s }) => `UAV ${uav} ${Number.isNaN(age_s) ? "\u2013" : `${age_s.toFixed(1)} s`}`).join(", ");
}

/** Text with the assignments in the team state of an agent. */
function assignmentsText(replayData, agent, stepIndex) {
  const assigned = replayData.ids.uavs.map((uav) => ({ uav, ...replayData.agents.believed(agent, uav, stepIndex) })).filter(({ group }) => group !== null);
  const byGroup = [...grouped(assigned, ({ group }) => group)].sort(([a], [b]) => a - b);
  if (!byGroup.length) return "no UAV is assigned";
  const text = ([group, uavs]) => `group ${group} (created at ${uavs[0].created_s.toFixed(1)} s): UAV ${uavs.map(({ uav }) => uav).join(", ")}`;
  return byGroup.map(text).join("; ");
}

/** Text that lists the sets of agents with different assignments; empty if all agree. */
function disagreementText(replayData, stepIndex) {
  const agreeingSets = replayData.agents.agreeingSets(stepIndex);
  const text = (set) => `UAV ${set.join(", ")}`;
  return agreeingSets.length > 1 ? `assignments differ: ${agreeingSets.map(text).join(" | ")}` : "";
}
