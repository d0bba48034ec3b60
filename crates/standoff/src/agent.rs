//! One UAV's brain: from its own state, its own scan and its teammates' messages to a command.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the team's [`Picture`], which every agent computes alike; the rest is this UAV's own.

use crate::inbox::keep_sound;
use crate::message::{Message, Report, Scan};
use crate::mind::{GAP_MAX, Mind};
use crate::param::ParamError;
use crate::picture::Picture;
use crate::step::{Observation, Step};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// One UAV's brain.
///
/// Each instant has two halves. [`Self::observe`] takes the own state and scan in; then [`Self::outbox`] is what to say,
/// and [`Self::hear`] takes in what teammates say. When no more is waited for, [`Self::decide`] gives the command.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut agent = Agent::new(UavId(0), TeamParams::table_1())?;
/// let own = UavState {
///     position: Position::from_m(400.0, 0.0),
///     heading: Angle::from_deg(90.0),
///     speed_m_s: 40.0,
///     turn_rate_rad_s: 0.0,
/// };
/// // A search aircraft hands a target over; the agent turns onto an orbit about it.
/// let cue = Message::Cue(Cue {
///     label: TargetLabel(0),
///     time: Time::START,
///     position: Position::from_m(0.0, 0.0),
///     velocity: Velocity::from_m_s(5.0, 0.0),
///     position_sd_m: 20.0,
///     velocity_sd_m_s: 2.0,
/// });
/// let observation = agent.observe(Time::START, &own, Some(Scan::default()));
/// assert_eq!(agent.outbox(&observation).len(), 1);
/// agent.hear(&observation, &cue);
/// let step = agent.decide(&observation);
/// assert!(step.command.turn_rate_rad_s.abs() <= 0.3);
/// assert_eq!(step.diagnostics.group, Some(GroupId(0)));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent {
    id: UavId,
    epoch: u32,
    /// The own report of the instant at which it was last made.
    outbox: Vec<Message>,
    mind: Mind,
}

impl Agent {
    /// An instant that comes later than this after the one before is taken for a clock that has jumped. Believed, one
    /// wrong time would be waited for until it comes, and everything known would be lost on the way there. This is the
    /// longest period that the simulator flies.
    pub const GAP_MAX: Duration = GAP_MAX;

    /// An agent of a team; all that is out of range is reported at once, and so are parameters that contradict one
    /// another: the orbits' field of view must be the sensor's ([`TeamParams::errors`]).
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self { id, epoch: 0, outbox: Vec::new(), mind: Mind::new(params)? })
    }

    /// The same agent after a restart: should it speak again at the instant at which it went down, all teammates believe
    /// what it said before. Each restart counts one up.
    #[must_use]
    pub fn with_epoch(self, epoch: u32) -> Self {
        Self { epoch, ..self }
    }

    /// Forgets all that it knows and has heard, and takes whatever time comes next: for a clock that was set, or a pause
    /// of more than [`Self::GAP_MAX`]. The counts of the diagnostics stay. As after a restart, targets have to be cued
    /// again.
    pub fn reset(&mut self) {
        self.mind.reset();
        self.outbox.clear();
    }

    /// This agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// What the team knows and intends, as of the last decision; an instant of which none was asked for is in it once
    /// another is observed.
    pub fn picture(&self) -> &Picture {
        self.mind.picture()
    }

    /// First half of an instant: takes in where the UAV is and what its sensor measured, both of `now`. Without a scan
    /// the UAV neither looks nor speaks.
    ///
    /// Of an instant the first observation with a scan counts. Time that runs backward, or jumps ahead by more than
    /// [`Self::GAP_MAX`], is refused and counted: nothing is heard or said, the command is from what was known, and the next
    /// instant may be right again. [`Self::reset`] makes the agent follow a time that stays elsewhere.
    pub fn observe(&mut self, now: Time, own: &UavState, scan: Option<Scan>) -> Observation {
        let observation = self.mind.observe(now, self.id, own, scan.map(|scan| (self.epoch, scan)));
        // What the own inbox has refused is not to be said.
        if let Some(scan) = scan.filter(|_| self.mind.has_heard(&observation))
            && !matches!(self.outbox.last(), Some(Message::Report(report)) if report.time == now)
        {
            self.compose(&observation, scan);
        }
        observation
    }

    /// What to say to the teammates: the own report. Nothing of an instant that was refused or is over, without a scan, or
    /// while the own state is not finite.
    pub fn outbox(&self, observation: &Observation) -> &[Message] {
        let is_its = |message: &Message| matches!(message, Message::Report(report) if (report.uav, report.time) == (observation.uav, observation.time));
        let is_said = self.mind.is_of_now(observation) && self.outbox.iter().all(is_its);
        if is_said { &self.outbox } else { &[] }
    }

    /// Takes a message in. It counts if it is of the observed instant, and is refused and counted if not; order and
    /// repetition do not matter. The own report is known already. With an observation of an instant that is over, or of
    /// another agent's, nothing is heard.
    pub fn hear(&mut self, observation: &Observation, message: &Message) {
        let is_own = matches!(message, Message::Report(report) if report.uav == self.id);
        if !is_own && observation.uav == self.id {
            self.mind.hear(observation, message);
        }
    }

    /// Second half: the command to fly from the observed instant on, with all that was heard by now. Asked again after
    /// more was heard, it answers as if all had come at once.
    ///
    /// Total: whatever comes in, the command is inside the limits.
    pub fn decide(&mut self, observation: &Observation) -> Step {
        self.mind.decide(observation)
    }

    /// Writes the own report, in the place of one of an earlier instant.
    fn compose(&mut self, observation: &Observation, scan: Scan) {
        let Observation { uav, time, own: state } = *observation;
        let (epoch, sequence, boresight) = (self.epoch, self.mind.sequence(), scan.boresight);
        let mut detections = match self.outbox.pop() {
            Some(Message::Report(old)) => old.detections,
            _ => Vec::new(),
        };
        keep_sound(scan.detections, &mut detections);
        self.outbox.push(Message::Report(Report { uav, epoch, sequence, time, state, boresight, detections }));
    }
}
