//! A team whose radio is perfect, in one process: every agent would keep the same picture, so one is kept.

use std::sync::Arc;

use crate::agent::Agent;
use crate::coordination::assignment::AssignmentLaw;
use crate::fold::Fold;
use crate::guidance::airspace::Airspace;
use crate::intruders::Intruders;
use crate::message::{Message, Scan};
use crate::param::ParamError;
use crate::picture::Picture;
use crate::pilot::Pilot;
use crate::row::{Put, Row, Said};
use crate::step::{Observation, Refused, Step, count};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// The agents of a team in which all hear everything at once: each answers as an [`Agent`] of its own
/// would, to the bit, for the work of one picture instead of one each.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut fleet = Fleet::new(TeamParams::table_1())?;
/// let state = |x_m| UavState::straight(Position::from_m(x_m, 0.0), Angle::from_deg(90.0), 40.0);
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
    fold: Fold,
    /// The picture of the instant before this one.
    previous: Box<Picture>,
    /// That of this instant, once one was asked for; until then an older one, to be written over.
    picture: Box<Picture>,
    /// What was said of this instant.
    row: Row,
    /// Who else flies there.
    intruders: Intruders,
    /// The time since the instant before this one.
    dt: Duration,
    started: bool,
    /// Something was heard that the picture does not know yet.
    is_stale: bool,
    /// Counts the instants.
    sequence: u32,
    refused: Refused,
}

impl Fleet {
    /// A team; all that is out of range is reported at once.
    pub fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self {
            fold: Fold::new(params)?,
            previous: Box::default(),
            picture: Box::default(),
            row: Row::default(),
            intruders: Intruders::default(),
            dt: Duration::ZERO,
            started: false,
            is_stale: false,
            sequence: 0,
            refused: Refused::default(),
        })
    }

    /// The same, with an assignment law of your own in the place of (33).
    #[must_use]
    pub fn assigned_by(mut self, law: Arc<dyn AssignmentLaw>) -> Self {
        self.fold.assignment = Some(law);
        self
    }

    /// The same with zones that the UAVs keep out of, and in.
    #[must_use]
    pub fn with_airspace(self, airspace: Airspace) -> Self {
        Self { fold: self.fold.within(airspace), ..self }
    }

    /// First half of an instant: where a UAV is and what its sensor measured, heard by all; as
    /// [`Agent::observe`](crate::Agent::observe), but at any time: a fleet has no grid of instants.
    ///
    /// The first observation of an instant that a UAV speaks of counts. An instant that is neither new nor the last one is
    /// refused and counted, and nothing can be heard of it.
    pub fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) -> Observation {
        let gap = now - self.row.time;
        if !self.started || gap > Duration::ZERO && gap <= Agent::GAP_MAX {
            self.open(now);
        } else if now != self.row.time {
            count(&mut self.refused.instants);
            return Observation { uav, time: now, own: *own };
        }
        // Who does not know where it is has nothing to say.
        if let Some(scan) = scan.filter(|_| own.is_finite() && self.row.report_of(uav).is_none()) {
            let (stamp, duty) = ((0, self.sequence), self.previous.duty_of(uav));
            let put = self.row.put(Said { uav, stamp, state: own, scan, duty, leaves: false });
            if put == Put::Refused {
                count(&mut self.refused.nonsense);
            }
            self.is_stale = true;
        }
        let own = self.row.report_of(uav).map_or(*own, |report| report.state);
        Observation { uav, time: now, own }
    }

    /// Takes in a message from outside the fleet, of the observed instant, heard by all; one of another instant is refused
    /// and counted. Where an aircraft says it was that is not of the team may be told later.
    pub fn hear(&mut self, observation: &Observation, message: &Message) {
        if !self.is_of_now(observation) {
            return;
        }
        let put = match message {
            Message::Report(report) if report.time == self.row.time => self.row.put(Said::of(report)),
            Message::Cue(cue) => self.row.put_cue(cue),
            Message::Report(_) => Put::Refused,
            // All know the same.
            Message::Snapshot(_) => Put::Known,
            // No matter of the picture.
            Message::Traffic(traffic) => {
                return self.intruders.hear(traffic, observation.time, &mut self.refused);
            }
        };
        if matches!(put, Put::Refused | Put::Instead) {
            count(&mut self.refused.nonsense);
        }
        self.is_stale = true;
    }

    /// Second half, once all were observed: the command of a UAV; as [`Agent::decide`](crate::Agent::decide).
    pub fn decide(&mut self, observation: &Observation) -> Step {
        self.catch_up();
        let Fold { params, borders, .. } = &self.fold;
        let (picture, borders) = (self.picture(), borders.as_deref());
        Pilot { params, picture, borders, intruders: &self.intruders }.decide(observation, self.refused)
    }

    /// Forgets all that is known and was heard; what was refused stays counted.
    pub fn reset(&mut self) {
        (self.previous, self.picture) = (Box::default(), Box::default());
        self.row.open(Time::START);
        self.intruders.clear();
        (self.dt, self.started, self.is_stale) = (Duration::ZERO, false, false);
    }

    /// What the team knows and intends: as of the last decision, or of the last instant that another one followed.
    pub fn picture(&self) -> &Picture {
        if self.picture.time == self.row.time { &self.picture } else { &self.previous }
    }

    fn is_of_now(&self, observation: &Observation) -> bool {
        self.started && observation.time == self.row.time
    }

    fn open(&mut self, now: Time) {
        // An instant of which nobody asked for a decision is part of the past all the same.
        self.catch_up();
        core::mem::swap(&mut self.previous, &mut self.picture);
        self.dt = if self.started { now - self.row.time } else { Duration::ZERO };
        (self.started, self.is_stale) = (true, true);
        self.sequence = self.sequence.wrapping_add(1);
        self.row.open(now);
    }

    fn catch_up(&mut self) {
        if self.is_stale {
            self.fold.follow(&self.previous, self.dt, &self.row, &mut self.picture);
            self.is_stale = false;
        }
    }
}
