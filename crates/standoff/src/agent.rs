//! One UAV's brain: from its own state, its own scan and its teammates' messages to a command.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the team's [`Picture`], which every agent computes alike; the rest is this UAV's own.

use crate::angle::Angle;
use crate::coordination::event::Event;
use crate::coordination::group::GroupId;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::heading::Steering;
use crate::message::{Detection, Message, Report};
use crate::mind::Mind;
use crate::param::ParamError;
use crate::picture::Picture;
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{LimitedCommand, UavId, UavState};

/// What this UAV's own sensor said.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scan<'a> {
    /// Where the sensor pointed; `None`: it did not look.
    pub boresight: Option<Angle>,
    /// What it saw.
    pub detections: &'a [Detection],
}

/// Where the sensor is to point until the next step: a point that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookAt {
    /// The point now.
    pub position: Position,
    /// How it moves.
    pub velocity: Velocity,
}

impl LookAt {
    /// Direction from `uav` to the point, `later` from now.
    pub fn boresight(&self, uav: Position, later: Duration) -> Angle {
        let [boresight] = Self::boresight_each([(*self, uav)], later);
        boresight
    }

    /// [Boresights](Self::boresight) of several UAVs: the same as one by one, in less time.
    #[inline]
    pub fn boresight_each<const N: usize>(looks: [(Self, Position); N], later: Duration) -> [Angle; N] {
        Displacement::direction_each(looks.map(|(look, uav)| look.position + look.velocity * later.s() - uav))
    }
}

/// What a step results in.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// What to ask of the autopilot, inside the limits.
    pub command: LimitedCommand,
    /// Altitude to fly at above the plane, m: that of the group's orbit; `None`: it serves no group.
    pub altitude_m: Option<f64>,
    /// Where to point the sensor; `None`: nothing is known to look at.
    pub look_at: Option<LookAt>,
    /// What to say to the teammates.
    pub outbox: &'a [Message],
    /// What changed in the picture.
    pub events: &'a [Event],
    /// How good the answer is.
    pub diagnostics: Diagnostics,
}

/// How good a step's answer is, and how it came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diagnostics {
    /// The group this UAV serves; `None`: it holds a circle where it is.
    pub group: Option<GroupId>,
    /// How it steered onto the group's orbit.
    pub steering: Option<Steering>,
    /// Some orbit about the group satisfies every constraint; `true` without a group.
    pub orbit_is_feasible: bool,
    /// How far it lags behind its place on the orbit, rad.
    pub spacing_error_rad: f64,
    /// Distance to the nearest other UAV of its group, m.
    pub separation_m: Option<f64>,
    /// Targets that are known, not lost, and in no group.
    pub unassigned_targets: u32,
    /// Messages refused since the start.
    pub refused_messages: u32,
    /// Steps since the start whose time was refused: before the last one's, or more than [`Agent::GAP_MAX`] after it. If
    /// this goes on growing though your clock is right, [`Agent::reset`].
    pub refused_instants: u32,
    /// The UAV's own state was not finite: it holds its course.
    pub own_state_invalid: bool,
}

/// One UAV's brain.
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
///     target: TargetId(0),
///     time: Time::START,
///     position: Position::from_m(0.0, 0.0),
///     velocity: Velocity::from_m_s(5.0, 0.0),
///     position_sd_m: 20.0,
///     velocity_sd_m_s: 2.0,
/// });
/// let step = agent.step(Time::START, &own, Scan::default(), &[cue]);
/// assert!(step.command.command.turn_rate_rad_s.abs() <= 0.3);
/// assert_eq!(step.diagnostics.group, Some(GroupId(0)));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent {
    id: UavId,
    epoch: u32,
    sequence: u32,
    outbox: Vec<Message>,
    /// The outbox is of this instant.
    said: bool,
    mind: Mind,
}

impl Agent {
    /// An instant that comes later than this after the one before is taken for a clock that has jumped. Believed, one
    /// wrong time would be waited for until it comes, and everything known would be lost on the way there. This is three
    /// times as long as a teammate may be silent, and the longest period that the simulator flies.
    pub const GAP_MAX: Duration = Duration::from_us(10_000_000);

    /// An agent of a team; all that is out of range is reported at once, and so are parameters that contradict one
    /// another: the orbits' field of view must be the sensor's ([`TeamParams::errors`]).
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self { id, epoch: 0, sequence: 0, outbox: Vec::new(), said: false, mind: Mind::new(params)? })
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
        self.said = false;
    }

    /// This agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// What the team knows and intends, as of the last step.
    pub fn picture(&self) -> &Picture {
        self.mind.picture()
    }

    /// What this UAV has to say of a scan; [`Step::outbox`] says it too. For a harness in which all speak before any
    /// decides.
    pub fn report(&self, now: Time, own: &UavState, scan: Scan) -> Report {
        Report {
            uav: self.id,
            epoch: self.epoch,
            sequence: self.sequence.wrapping_add(u32::from(self.mind.may_follow(now))),
            time: now,
            state: *own,
            boresight: scan.boresight,
            detections: scan.detections.to_vec(),
        }
    }

    /// Decides: the command to fly from `now` on.
    ///
    /// `own` and `scan` are of this instant, and so are the reports in `inbox` (others are refused and counted); the
    /// order of `inbox` does not matter. Called again at the same instant with messages that came in since, the step
    /// answers as if all had come at once.
    ///
    /// Time that runs backward, or jumps ahead by more than [`Self::GAP_MAX`], is refused and counted: nothing is heard or
    /// said, the command is from what was known, and the next step may be right again. [`Self::reset`] makes the agent
    /// follow a time that stays elsewhere.
    ///
    /// Total: whatever comes in, the command is inside the limits.
    pub fn step(&mut self, now: Time, own: &UavState, scan: Scan, inbox: &[Message]) -> Step<'_> {
        if self.mind.turn_to(now) {
            self.sequence = self.sequence.wrapping_add(1);
            self.said = false;
        }
        if now != self.mind.picture().time {
            return self.mind.decide(self.id, own, &[]);
        }
        if own.is_finite() {
            self.say(now, own, scan);
        }
        for message in inbox {
            match message {
                Message::Report(report) if report.uav == self.id => {}
                _ => self.mind.inbox.hear(message),
            }
        }
        self.mind.follow();
        let outbox = if self.said { &self.outbox } else { &[] as &[Message] };
        self.mind.decide(self.id, own, outbox)
    }

    /// Puts the own report into the outbox and into the own inbox. The first report of an instant counts.
    fn say(&mut self, now: Time, own: &UavState, scan: Scan) {
        if !self.said {
            match self.outbox.first_mut() {
                Some(Message::Report(report)) => {
                    (report.sequence, report.time, report.state) = (self.sequence, now, *own);
                    report.boresight = scan.boresight;
                    report.detections.clear();
                    report.detections.extend_from_slice(scan.detections);
                }
                _ => self.outbox.push(Message::Report(self.report(now, own, scan))),
            }
            self.said = true;
        }
        for message in &self.outbox {
            self.mind.inbox.hear(message);
        }
    }
}
