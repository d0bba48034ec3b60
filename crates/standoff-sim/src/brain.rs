//! The seam between the simulator and whoever flies the UAVs: the product, or a brain of your own.
//!
//! At every instant each UAV observes, then each hears what the others said, then each decides. `docs/brains.md` walks
//! through a brain of one's own, which `examples/follower.rs` flies.

use standoff::{
    Agent, Airspace, Command, Fleet, Message, Observation, ParamError, Scan, Step, TeamParams, Time, UavId, UavState,
};

use crate::audit::{Audit, Before};
pub use crate::frame::{
    AgentEventRow, AgentRow, Agents, Beliefs, EventRow, GroupRow, OfAgent, Place, Reported, TeamRow, TrackRow,
    TrackStatus,
};
use crate::rows;
use crate::scenario::Minds;

/// A team's brain, or the brains of its UAVs: what a mission asks at every instant, of every UAV, in this order.
///
/// Nothing in it lives as long as a scenario or a mission: what comes in is borrowed for the call, what goes out is owned, or
/// the brain's to lend.
pub trait Brain {
    /// A UAV's computer has been off and is on again: what it knew is gone, and an `epoch` begins, higher than those before.
    /// While it is off nothing is asked of the UAV, and nothing told to it.
    fn restart(&mut self, _uav: UavId, _epoch: u32) {}

    /// A UAV at an instant, which is what its clock reads: where it believes itself to be, and what its sensor measured; `None`: it is out, and neither
    /// looks nor speaks, but hears.
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>);

    /// What a UAV has to say of what it observed last, lent to the radio, which carries it to the others as it is, except of
    /// a UAV that is out. Brains that need no radio say nothing.
    fn outbox(&self, _uav: UavId) -> &[Message] {
        &[]
    }

    /// A UAV hears a message, of the instant that it observed last if the radio is perfect: teammates' reports by ascending
    /// UAV, then the cues of targets that have just appeared, then what intruders tell.
    fn hear(&mut self, uav: UavId, message: &Message);

    /// What a UAV is to do until the next instant. A command outside the limits is flown at the limit, one without a number
    /// straight on at nominal speed; a place to look at or an altitude without a number is none.
    fn decide(&mut self, uav: UavId) -> Step;

    /// Which rows [`Self::report`] writes: what is not reported is not scored.
    fn reported(&self) -> Reported {
        Reported::NOTHING
    }

    /// Writes down what the team believes and intends at this instant, after all have decided. The tables are empty.
    fn report(&self, _beliefs: &mut Beliefs) {}

    /// Writes down what each of several minds believes by itself, of those whose computer is on; where one believes for all,
    /// nothing. The tables are empty; how much was sent is filled in afterwards.
    fn report_each(&self, _agents: &mut Agents) {}
}

impl<B: Brain + ?Sized> Brain for Box<B> {
    fn restart(&mut self, uav: UavId, epoch: u32) {
        (**self).restart(uav, epoch);
    }

    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        (**self).observe(now, uav, own, scan);
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        (**self).outbox(uav)
    }

    fn hear(&mut self, uav: UavId, message: &Message) {
        (**self).hear(uav, message);
    }

    fn decide(&mut self, uav: UavId) -> Step {
        (**self).decide(uav)
    }

    fn reported(&self) -> Reported {
        (**self).reported()
    }

    fn report(&self, beliefs: &mut Beliefs) {
        (**self).report(beliefs);
    }

    fn report_each(&self, agents: &mut Agents) {
        (**self).report_each(agents);
    }
}

/// The product as a brain, within an airspace; all parameters that are out of range are reported at once.
pub fn of_team(
    minds: Minds,
    team: TeamParams,
    airspace: Airspace,
    uavs: usize,
) -> Result<Box<dyn Brain + Send>, Vec<ParamError>> {
    Ok(match minds {
        Minds::One => Box::new(One { fleet: Fleet::new(team)?.with_airspace(airspace), observed: Vec::new() }),
        Minds::Each => Box::new(Each::new(team, airspace, uavs)?),
    })
}

/// A mind for each UAV of the product, each checked by a fold of its own of what it has heard.
pub(crate) fn audited(team: TeamParams, airspace: Airspace, uavs: usize) -> Result<Each, Vec<ParamError>> {
    let audits = (0..uavs).map(|_| Audit::new(team, airspace.clone())).collect::<Result<_, _>>()?;
    Ok(Each { audits, ..Each::new(team, airspace, uavs)? })
}

/// The last observation of each UAV, by id.
type Observed = Vec<Option<Observation>>;

fn keep(observed: &mut Observed, observation: Observation) {
    let place = observation.uav().0 as usize;
    if place >= observed.len() {
        observed.resize(place + 1, None);
    }
    observed[place] = Some(observation);
}

fn last(observed: &Observed, uav: UavId) -> Option<&Observation> {
    observed.get(uav.0 as usize)?.as_ref()
}

/// What is answered for a UAV that never observed.
const IDLE: Step = Step::of(Command { speed_m_s: 0.0, turn_rate_rad_s: 0.0 });

/// One mind for the whole team: its radio is perfect, so one picture serves all.
struct One {
    fleet: Fleet,
    observed: Observed,
}

impl Brain for One {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let observation = self.fleet.observe(now, uav, own, scan);
        keep(&mut self.observed, observation);
    }

    /// Whatever one hears, all have heard.
    fn hear(&mut self, uav: UavId, message: &Message) {
        if let Some(observation) = last(&self.observed, uav).filter(|_| uav.0 == 0) {
            self.fleet.hear(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> Step {
        last(&self.observed, uav).map_or(IDLE, |observation| self.fleet.decide(observation))
    }

    fn reported(&self) -> Reported {
        Reported::default()
    }

    fn report(&self, beliefs: &mut Beliefs) {
        rows::picture(self.fleet.picture(), beliefs);
    }
}

/// A mind for each UAV, by id. With a perfect radio all have the same picture; that of the first whose computer is on is
/// recorded.
pub(crate) struct Each {
    team: TeamParams,
    airspace: Airspace,
    agents: Vec<Agent>,
    /// By UAV; empty where nobody asked for them.
    pub(crate) audits: Vec<Audit>,
    observed: Observed,
    /// Those that observed this instant, ascending.
    awake: Vec<UavId>,
    /// Whoever observes next observes another one.
    is_decided: bool,
}

impl Brain for Each {
    fn restart(&mut self, uav: UavId, epoch: u32) {
        // What these parameters are was taken when the first one was made.
        if let (Some(agent), Ok(new)) = (self.agents.get_mut(uav.0 as usize), Agent::new(uav, self.team)) {
            *agent = new.with_airspace(self.airspace.clone()).with_epoch(epoch);
        }
        self.audits.get_mut(uav.0 as usize).into_iter().for_each(Audit::restart);
    }

    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        if std::mem::take(&mut self.is_decided) {
            self.awake.clear();
        }
        self.awake.push(uav);
        if let Some(agent) = self.agents.get_mut(uav.0 as usize) {
            let observation = agent.observe(now, own, scan);
            if let Some(audit) = self.audits.get_mut(uav.0 as usize) {
                audit.observe(agent, &observation);
            }
            keep(&mut self.observed, observation);
        }
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        last(&self.observed, uav).map_or(&[], |observation| self.agents[uav.0 as usize].outbox(observation))
    }

    fn hear(&mut self, uav: UavId, message: &Message) {
        if let Some(observation) = last(&self.observed, uav) {
            let agent = &mut self.agents[uav.0 as usize];
            let Some(audit) = self.audits.get_mut(uav.0 as usize) else {
                return agent.hear(observation, message);
            };
            let before = Before::of(agent, message);
            agent.hear(observation, message);
            audit.hear(agent, &before, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> Step {
        self.is_decided = true;
        let Some(observation) = last(&self.observed, uav) else { return IDLE };
        let agent = &mut self.agents[uav.0 as usize];
        let step = agent.decide(observation);
        if !self.audits.is_empty() {
            // Those of the others are beside it.
            let mut audit = self.audits.swap_remove(uav.0 as usize);
            audit.check(agent, &self.audits);
            self.audits.push(audit);
            let last = self.audits.len() - 1;
            self.audits.swap(uav.0 as usize, last);
        }
        step
    }

    fn reported(&self) -> Reported {
        Reported::default()
    }

    fn report(&self, beliefs: &mut Beliefs) {
        if let Some(agent) = self.awake().next() {
            rows::agent(agent, beliefs);
        }
    }

    fn report_each(&self, agents: &mut Agents) {
        for agent in self.awake() {
            let audit = self.audits.get(agent.id().0 as usize);
            rows::own(agent, audit.and_then(|audit| audit.holds_more), agents);
        }
    }
}

impl Each {
    fn new(team: TeamParams, airspace: Airspace, uavs: usize) -> Result<Self, Vec<ParamError>> {
        let agent = |uav| Agent::new(uav, team).map(|agent| agent.with_airspace(airspace.clone()));
        let agents = (0..).map(UavId).take(uavs).map(agent).collect::<Result<_, _>>()?;
        Ok(Self {
            team,
            airspace,
            agents,
            audits: Vec::new(),
            observed: Vec::new(),
            awake: Vec::new(),
            is_decided: true,
        })
    }

    /// The minds of the UAVs whose computer is on, ascending.
    fn awake(&self) -> impl Iterator<Item = &Agent> {
        self.awake.iter().filter_map(|uav| self.agents.get(uav.0 as usize))
    }
}
