//! One UAV's brain: from its own state, its own scan and its teammates' messages to a command.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the team's [`Picture`], which every agent computes alike; the rest is this UAV's own.

use crate::angle::Angle;
use crate::coordination::event::Event;
use crate::coordination::group::{Group, GroupId};
use crate::frame::{Position, Velocity};
use crate::guidance::heading::{Steering, steer};
use crate::guidance::spacing::{spacing_error_rad, spacing_speed_m_s};
use crate::inbox::{Inbox, Teammate};
use crate::message::{Detection, Message, Report};
use crate::param::ParamError;
use crate::picture::{News, Picture, Scratch};
use crate::target::Transition;
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{Command, LimitedCommand, UavId, UavState};

/// A teammate not heard for longer than this has left the orbit, as far as spacing goes.
const TEAMMATE_TIMEOUT: Duration = Duration::from_us(3_000_000);

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
        (self.position + self.velocity * later.s() - uav).direction()
    }
}

/// What a step results in.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// What to ask of the autopilot, inside the limits.
    pub command: LimitedCommand,
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
    /// How far it lags behind its place on the orbit, rad.
    pub spacing_error_rad: f64,
    /// Messages refused since the start.
    pub refused_messages: u32,
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
    params: TeamParams,
    /// The picture of the instant before this one.
    previous: Picture,
    picture: Picture,
    inbox: Inbox,
    outbox: Vec<Message>,
    /// The outbox is of this instant.
    said: bool,
    /// The target model over the time since the previous picture.
    transition: Transition,
    no_time: Transition,
    scratch: Scratch,
    started: bool,
}

impl Agent {
    /// An agent of a team; all that is out of range is reported at once.
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let errors = params.errors();
        if !errors.is_empty() {
            return Err(errors);
        }
        let no_time = params.track.target.transition(Duration::ZERO);
        Ok(Self {
            id,
            epoch: 0,
            sequence: 0,
            params,
            previous: Picture::default(),
            picture: Picture::default(),
            inbox: Inbox::default(),
            outbox: Vec::new(),
            said: false,
            transition: no_time,
            no_time,
            scratch: Scratch::default(),
            started: false,
        })
    }

    /// The same agent after a restart: teammates take its reports for new ones again. Each restart counts one up.
    #[must_use]
    pub fn with_epoch(self, epoch: u32) -> Self {
        Self { epoch, ..self }
    }

    /// This agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// What the team knows and intends, as of the last step.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// What this UAV has to say of a scan; [`Step::outbox`] says it too. For a harness in which all speak before any
    /// decides.
    pub fn report(&self, now: Time, own: &UavState, scan: Scan) -> Report {
        let is_new_instant = !self.started || now > self.picture.time;
        Report {
            uav: self.id,
            epoch: self.epoch,
            sequence: self.sequence.wrapping_add(u32::from(is_new_instant)),
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
    /// answers as if all had come at once. Time that runs backward changes nothing that is known.
    ///
    /// Total: whatever comes in, the command is inside the limits.
    pub fn step(&mut self, now: Time, own: &UavState, scan: Scan, inbox: &[Message]) -> Step<'_> {
        if !self.started || now > self.picture.time {
            self.open_instant(now);
        }
        let own_state_invalid = !own.is_finite();
        if now == self.picture.time && !own_state_invalid {
            self.say(now, own, scan);
        }
        for message in inbox {
            match message {
                Message::Report(report) if report.uav == self.id => {}
                _ => self.inbox.hear(message),
            }
        }
        let news =
            News { now: self.picture.time, inbox: &self.inbox, transition: &self.transition, no_time: &self.no_time };
        self.picture.follow(&self.previous, &news, &self.params, &mut self.scratch);
        self.decide(now, own, own_state_invalid)
    }

    fn open_instant(&mut self, now: Time) {
        core::mem::swap(&mut self.previous, &mut self.picture);
        let dt = if self.started { now - self.previous.time } else { Duration::ZERO };
        self.started = true;
        if dt != self.transition.dt {
            self.transition = self.params.track.target.transition(dt);
        }
        self.picture.time = now;
        self.sequence = self.sequence.wrapping_add(1);
        self.inbox.open(now);
        self.said = false;
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
            self.inbox.hear(message);
        }
    }

    fn decide(&self, now: Time, own: &UavState, own_state_invalid: bool) -> Step<'_> {
        let group = self.picture.groups.first().filter(|_| !own_state_invalid);
        let (wanted, spacing_error_rad, steering) = match group {
            _ if own_state_invalid => {
                (Command { speed_m_s: self.params.uav.speed_m_s, turn_rate_rad_s: 0.0 }, 0.0, None)
            }
            Some(group) => self.fly_orbit(now, own, group),
            None => (self.hold(), 0.0, None),
        };
        Step {
            command: self.params.uav.limit(wanted),
            look_at: self.look_at(own),
            outbox: if self.said { &self.outbox } else { &[] },
            events: &self.scratch.events,
            diagnostics: Diagnostics {
                group: group.map(|group| group.id),
                steering,
                spacing_error_rad,
                refused_messages: self.inbox.refused(),
                own_state_invalid,
            },
        }
    }

    fn fly_orbit(&self, now: Time, own: &UavState, group: &Group) -> (Command, f64, Option<Steering>) {
        let guidance = &self.params.guidance;
        let orbit = group.orbit(&self.params.group.standoff);
        let phase = |position: Position| (position - orbit.centre).direction();
        let others = self
            .inbox
            .teammates()
            .filter(|mate| mate.uav != self.id && now - mate.heard_at <= TEAMMATE_TIMEOUT)
            .map(|mate| (mate.uav, phase(extrapolated(&mate, now))));
        let error_rad =
            spacing_error_rad((self.id, phase(own.position)), others, guidance.separation_rad, guidance.sense);
        let nominal_m_s = self.params.uav.speed_m_s;
        let centre_m_s = orbit.centre_velocity.speed_m_s();
        let wanted_m_s =
            spacing_speed_m_s(error_rad, guidance.spacing_gain_1_s, orbit.distance_m, nominal_m_s, centre_m_s);
        // The field is flown at the speed that the limits leave, so that (25) and (29) hold for it.
        let flown = self.params.uav.limit(Command { speed_m_s: wanted_m_s, turn_rate_rad_s: 0.0 });
        let steering = steer(guidance, own, &orbit, flown.command.speed_m_s);
        let wanted = Command { speed_m_s: wanted_m_s, turn_rate_rad_s: steering.turn_rate_rad_s };
        (wanted, error_rad, Some(steering))
    }

    /// With nothing to watch: a circle of the smallest orbit, where the UAV is.
    fn hold(&self) -> Command {
        let speed_m_s = self.params.uav.speed_m_s;
        let turn_rate_rad_s = self.params.guidance.sense.sign() * speed_m_s / self.params.group.standoff.radius_min_m;
        Command { speed_m_s, turn_rate_rad_s }
    }

    /// The group's centre; without a group, the nearest track.
    fn look_at(&self, own: &UavState) -> Option<LookAt> {
        if let Some(group) = self.picture.groups.first() {
            let centre = group.centre.estimate().state;
            return Some(LookAt { position: centre.position(), velocity: centre.velocity() });
        }
        let states = self.picture.known.iter().filter(|known| !known.track.is_lost()).map(|k| k.track.estimate().state);
        let distance_m = |position: Position| position.distance_m(own.position);
        states
            .min_by(|a, b| distance_m(a.position()).total_cmp(&distance_m(b.position())))
            .map(|state| LookAt { position: state.position(), velocity: state.velocity() })
    }
}

fn extrapolated(mate: &Teammate, now: Time) -> Position {
    mate.state.position + mate.state.velocity() * (now - mate.heard_at).s()
}
