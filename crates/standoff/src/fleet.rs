//! A team whose radio is perfect, in one process: every agent would keep the same picture, so one is kept.

use crate::agent::{Scan, Step};
use crate::coordination::event::Event;
use crate::inbox::Said;
use crate::message::Cue;
use crate::mind::Mind;
use crate::param::ParamError;
use crate::picture::Picture;
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
/// let states = [state(400.0), state(-400.0)];
/// let said = (0..).map(UavId).zip(&states).map(|(id, state)| (id, state, Scan::default()));
/// fleet.hear(Time::START, said, &[]);
/// for (id, state) in (0..).zip(&states) {
///     let step = fleet.decide(UavId(id), state);
///     assert_eq!(step.command.command.speed_m_s, 40.0);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Fleet {
    mind: Mind,
    sequence: u32,
}

impl Fleet {
    /// A team; all that is out of range is reported at once.
    pub fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self { mind: Mind::new(params)?, sequence: 0 })
    }

    /// Takes in everything that is said at an instant: the state and scan of each UAV that speaks, and the cues. Instants
    /// come in order; one that has passed, or is further ahead than [`Agent::GAP_MAX`](crate::Agent::GAP_MAX), is not heard,
    /// and counted.
    pub fn hear<'a>(&mut self, now: Time, uavs: impl Iterator<Item = (UavId, &'a UavState, Scan<'a>)>, cues: &[Cue]) {
        if !self.mind.turn_to(now) {
            return;
        }
        self.sequence = self.sequence.wrapping_add(1);
        for (uav, state, scan) in uavs {
            // Who does not know where it is has nothing to say.
            if state.is_finite() {
                let (stamp, state) = ((0, self.sequence), *state);
                let Scan { boresight, detections } = scan;
                self.mind.inbox.hear_said(&Said { uav, stamp, time: now, state, boresight, detections });
            }
        }
        for cue in cues {
            self.mind.inbox.hear_cue(cue);
        }
        self.mind.follow();
    }

    /// Forgets all that is known and was heard, as [`Agent::reset`](crate::Agent::reset).
    pub fn reset(&mut self) {
        self.mind.reset();
    }

    /// What a UAV in that state is to do; its outbox is empty, for all have heard.
    pub fn decide(&self, uav: UavId, own: &UavState) -> Step<'_> {
        self.mind.decide(uav, own, &[])
    }

    /// What the team knows and intends.
    pub fn picture(&self) -> &Picture {
        self.mind.picture()
    }

    /// What changed at this instant.
    pub fn events(&self) -> &[Event] {
        self.mind.events()
    }
}
