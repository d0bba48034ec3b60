//! A team whose radio is perfect, in one process: every agent would keep the same picture, so one is kept.

use std::sync::Arc;

use crate::coordination::assignment::AssignmentLaw;
use crate::message::{Message, Scan};
use crate::mind::Mind;
use crate::param::ParamError;
use crate::picture::Picture;
use crate::step::{Observation, Step};
use crate::team::TeamParams;
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// The agents of a team in which all hear everything at once: each answers as an [`Agent`](crate::Agent) of its own
/// would, to the bit, for the work of one picture instead of one each.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut fleet = Fleet::new(TeamParams::table_1())?;
/// let state = |x_m| UavState {
///     position: Position::from_m(x_m, 0.0),
///     heading: Angle::from_deg(90.0),
///     speed_m_s: 40.0,
///     turn_rate_rad_s: 0.0,
/// };
/// let states = [(UavId(0), state(400.0)), (UavId(1), state(-400.0))];
/// let observed = states.map(|(uav, own)| fleet.observe(Time::START, uav, &own, Some(Scan::default())));
/// for observation in &observed {
///     let step = fleet.decide(observation);
///     assert_eq!(step.command.speed_m_s, 40.0);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Fleet {
    mind: Mind,
}

impl Fleet {
    /// A team; all that is out of range is reported at once.
    pub fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self { mind: Mind::new(params)? })
    }

    /// The same, with an assignment law of your own in the place of (33).
    #[must_use]
    pub fn assigned_by(self, law: Arc<dyn AssignmentLaw>) -> Self {
        Self { mind: self.mind.assigned_by(law) }
    }

    /// First half of an instant: where a UAV is and what its sensor measured, heard by all; as
    /// [`Agent::observe`](crate::Agent::observe).
    pub fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) -> Observation {
        self.mind.observe(now, uav, own, scan.map(|scan| (0, scan)))
    }

    /// Takes in a message from outside the fleet, heard by all; as [`Agent::hear`](crate::Agent::hear).
    pub fn hear(&mut self, observation: &Observation, message: &Message) {
        self.mind.hear(observation, message);
    }

    /// Second half, once all were observed: the command of a UAV; as [`Agent::decide`](crate::Agent::decide).
    pub fn decide(&mut self, observation: &Observation) -> Step {
        self.mind.decide(observation)
    }

    /// Forgets all that is known and was heard, as [`Agent::reset`](crate::Agent::reset).
    pub fn reset(&mut self) {
        self.mind.reset();
    }

    /// What the team knows and intends.
    pub fn picture(&self) -> &Picture {
        self.mind.picture()
    }
}
