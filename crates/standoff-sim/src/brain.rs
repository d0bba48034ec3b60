//! The seam between the simulator and whoever flies the UAVs: the product, or a brain of your own.
//!
//! At every instant each UAV observes, then each hears what the others said, then each decides. `docs/brains.md` walks
//! through a brain of one's own, which `examples/follower.rs` flies.

use standoff::{
    Agent, Command, Fleet, Message, Observation, ParamError, Scan, Step, TeamParams, Time, UavId, UavState,
};

pub use crate::frame::{Beliefs, EventRow, GroupRow, Place, Reported, TrackRow, TrackStatus};
use crate::rows;
use crate::scenario::Minds;

/// A team's brain, or the brains of its UAVs: what a mission asks at every instant, of every UAV, in this order.
///
/// Nothing in it lives as long as a scenario or a mission: what comes in is borrowed for the call, what goes out is owned, or
/// the brain's to lend.
pub trait Brain {
    /// A UAV at an instant: where it believes itself to be, and what its sensor measured; `None`: it is out, and neither
    /// looks nor speaks, but hears.
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>);

    /// What a UAV has to say of what it observed last, lent to the radio, which carries it to the others as it is, except of
    /// a UAV that is out. Brains that need no radio say nothing.
    fn outbox(&self, _uav: UavId) -> &[Message] {
        &[]
    }

    /// A UAV hears a message of the instant that it observed last: teammates' reports by ascending UAV, then the cues of
    /// targets that have just appeared.
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
}

impl<B: Brain + ?Sized> Brain for Box<B> {
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
}

/// The product as a brain; all parameters that are out of range are reported at once.
pub fn of_team(minds: Minds, team: TeamParams, uavs: usize) -> Result<Box<dyn Brain + Send>, Vec<ParamError>> {
    Ok(match minds {
        Minds::One => Box::new(One { fleet: Fleet::new(team)?, observed: Vec::new() }),
        Minds::Each => {
            let agents = (0..).map(UavId).take(uavs).map(|uav| Agent::new(uav, team));
            Box::new(Each { agents: agents.collect::<Result<_, _>>()?, observed: Vec::new() })
        }
    })
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

/// A mind for each UAV, by id. With a perfect radio all have the same picture, so the first one's is recorded.
struct Each {
    agents: Vec<Agent>,
    observed: Observed,
}

impl Brain for Each {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        if let Some(agent) = self.agents.get_mut(uav.0 as usize) {
            keep(&mut self.observed, agent.observe(now, own, scan));
        }
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        last(&self.observed, uav).map_or(&[], |observation| self.agents[uav.0 as usize].outbox(observation))
    }

    fn hear(&mut self, uav: UavId, message: &Message) {
        if let Some(observation) = last(&self.observed, uav) {
            self.agents[uav.0 as usize].hear(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> Step {
        last(&self.observed, uav).map_or(IDLE, |observation| self.agents[uav.0 as usize].decide(observation))
    }

    fn reported(&self) -> Reported {
        Reported::default()
    }

    fn report(&self, beliefs: &mut Beliefs) {
        if let Some(first) = self.agents.first() {
            rows::picture(first.picture(), beliefs);
        }
    }
}
