//! A team with an ideal link, in one process: all agents would compute the same team state, so that one is enough.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::agent::Agent;
use crate::coordination::assignment::AssignmentLaw;
use crate::intruders::Intruders;
use crate::message::{Message, Scan};
use crate::output::{AgentOutput, Observation, Rejected, count};
use crate::params::TeamParams;
use crate::pilot::Pilot;
use crate::priority::AreaOfInterest;
use crate::safety::geofence::Geofence;
use crate::state_update::TeamStateUpdater;
use crate::step_messages::{Insert, ReportView, StepMessages};
use crate::team_state::TeamState;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};
use crate::validation::ParamError;
use crate::wind::AirVelocity;

/// The agents of a team whose messages reach all UAVs immediately. Each answers bitwise like a separate
/// [`Agent`], but the team state is computed once instead of once for each agent.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut fleet = TeamAgent::new(TeamParams::paper())?;
/// let state = |x_m| UavState::level_flight(Position::from_m(x_m, 0.0), Angle::from_deg(90.0), 40.0);
/// let states = [(UavId(0), state(400.0)), (UavId(1), state(-400.0))];
/// let observed = states.map(|(uav, own)| fleet.observe(Time::EPOCH, uav, &own, Some(Scan::default())));
/// for observation in &observed {
///     let step = fleet.decide(observation);
///     assert_eq!(step.command.speed_m_s, 40.0);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct TeamAgent {
    updater: TeamStateUpdater,
    /// Team state of the previous time step.
    previous: Box<TeamState>,
    /// Team state of the current time step once it has been computed; until then an older one, which is overwritten.
    team_state: Box<TeamState>,
    /// Messages of the current time step.
    messages: StepMessages,
    /// Aircraft outside the team.
    intruders: Intruders,
    /// Time since the previous time step.
    dt: Duration,
    started: bool,
    /// True if messages have arrived since the team state was computed.
    is_stale: bool,
    /// Number of time steps started.
    sequence: u32,
    refused: Rejected,
    pilots: BTreeMap<UavId, Pilot>,
}

impl TeamAgent {
    /// Creates a team. Returns all parameters that are out of range.
    pub fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self {
            updater: TeamStateUpdater::new(params)?,
            previous: Box::default(),
            team_state: Box::default(),
            messages: StepMessages::default(),
            intruders: Intruders::default(),
            dt: Duration::ZERO,
            started: false,
            is_stale: false,
            sequence: 0,
            refused: Rejected::default(),
            pilots: BTreeMap::new(),
        })
    }

    /// Replaces the assignment law (33) with a custom one.
    #[must_use]
    pub fn with_assignment_law(mut self, law: Arc<dyn AssignmentLaw>) -> Self {
        self.updater.assignment = Some(law);
        self
    }

    /// Adds keep-out and keep-in zones. Fails if the intersection of the keep-in zones is empty, or so small that a UAV
    /// cannot circle in it.
    pub fn with_geofence(self, geofence: Geofence) -> Result<Self, Vec<ParamError>> {
        Ok(Self { updater: self.updater.with_geofence_zones(geofence)?, ..self })
    }

    /// Adds areas of interest. Fails if a priority is out of range.
    pub fn with_areas_of_interest(mut self, areas: Vec<AreaOfInterest>) -> Result<Self, Vec<ParamError>> {
        self.updater.set_areas_of_interest(areas)?;
        Ok(self)
    }

    /// First half of a time step: takes a UAV's state and the scan of its sensor, which all agents receive. It works
    /// like [`Agent::observe`](crate::Agent::observe), but accepts any time, because this team has no grid of time
    /// steps.
    ///
    /// For each UAV, the first observation of a time step with a scan counts. A time that is neither new nor the
    /// current one is rejected and counted, and no message is accepted for it.
    pub fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) -> Observation {
        let gap = now - self.messages.time;
        if !self.started || gap > Duration::ZERO && gap <= Agent::TIME_JUMP_MAX {
            self.open(now);
        } else if now != self.messages.time {
            count(&mut self.refused.bad_time);
            return Observation { uav, time: now, own: *own };
        }
        // A UAV that does not know its own state sends no report.
        if let Some(scan) = scan.filter(|_| own.is_finite() && self.messages.report_of(uav).is_none()) {
            let (order, assignment) = ((0, self.sequence), self.previous.assignment_of(uav));
            let report = ReportView {
                uav,
                order,
                state: own,
                scan,
                assigned_group: assignment,
                is_leaving: false,
                manoeuvre: self.pilots.get(&uav).and_then(Pilot::manoeuvre),
            };
            if self.put(report) == Insert::Rejected {
                count(&mut self.refused.malformed);
            }
            self.is_stale = true;
        }
        let own = self.messages.report_of(uav).map_or(*own, |report| report.state);
        Observation { uav, time: now, own }
    }

    /// Takes a UAV's velocity relative to the air at the observed time step, like
    /// [`Agent::observe_air`](crate::Agent::observe_air).
    pub fn observe_air(&mut self, observation: &Observation, air: &AirVelocity) {
        let Some(params) = self.updater.params.wind.filter(|_| self.is_of_now(observation)) else { return };
        self.pilots.entry(observation.uav).or_default().observe_air(&params, observation, air);
    }

    /// Processes a message from outside the team, of the observed time step, which all agents receive. A message of
    /// another time step is rejected and counted. Only traffic messages may be older.
    pub fn receive(&mut self, observation: &Observation, message: &Message) {
        if !self.is_of_now(observation) {
            return;
        }
        let put = match message {
            Message::Report(report) if report.time == self.messages.time => self.put(ReportView::of(report)),
            Message::Cue(cue) => self.messages.put_cue(cue),
            Message::Report(_) => Insert::Rejected,
            // All agents have the same state.
            Message::Snapshot(_) => Insert::Duplicate,
            // Traffic is not part of the team state.
            Message::Traffic(traffic) => {
                let uavs = self.messages.reports().iter().map(|report| &report.state);
                return self.intruders.receive(traffic, observation.time, uavs, &mut self.refused);
            }
        };
        if matches!(put, Insert::Rejected | Insert::Replaced) {
            count(&mut self.refused.malformed);
        }
        self.is_stale = true;
    }

    /// Second half of a time step, after all UAVs were observed: returns the command of one UAV, like
    /// [`Agent::decide`](crate::Agent::decide).
    pub fn decide(&mut self, observation: &Observation) -> AgentOutput {
        self.catch_up();
        let team_state = if self.has_team_state() { &self.team_state } else { &self.previous };
        let pilot = self.pilots.entry(observation.uav).or_default();
        let rejected = self.refused.with(&self.team_state);
        pilot.decide((&mut self.updater, team_state), None, &self.intruders, observation, rejected)
    }

    /// Clears the team state and all received messages; the counters of rejected messages keep their values.
    pub fn reset(&mut self) {
        (self.previous, self.team_state) = (Box::default(), Box::default());
        self.messages.open(Time::EPOCH);
        self.intruders.clear();
        self.pilots.clear();
        (self.dt, self.started, self.is_stale) = (Duration::ZERO, false, false);
    }

    /// Team state of the last decision or, if the current time step has none yet, of the previous time step.
    pub fn team_state(&self) -> &TeamState {
        if self.has_team_state() { &self.team_state } else { &self.previous }
    }

    /// True if the team state of the current time step has been computed.
    fn has_team_state(&self) -> bool {
        self.team_state.time == self.messages.time
    }

    fn put(&mut self, report: ReportView) -> Insert {
        let range_max_m = self.updater.params.track.sensor.reported_range_max_m();
        let put = self.messages.put(report, range_max_m);
        if matches!(put, Insert::Added | Insert::Replaced) {
            self.refused.count_beyond(report.scan.detections, range_max_m);
        }
        put
    }

    fn is_of_now(&self, observation: &Observation) -> bool {
        self.started && observation.time == self.messages.time
    }

    fn open(&mut self, now: Time) {
        // A time step without a decision is still part of the past.
        self.catch_up();
        self.refused = self.refused.with(&self.team_state);
        core::mem::swap(&mut self.previous, &mut self.team_state);
        self.dt = if self.started { now - self.messages.time } else { Duration::ZERO };
        (self.started, self.is_stale) = (true, true);
        self.sequence = self.sequence.wrapping_add(1);
        self.messages.open(now);
    }

    fn catch_up(&mut self) {
        if self.is_stale {
            self.updater.advance(&self.previous, self.dt, &self.messages, &mut self.team_state);
            self.is_stale = false;
        }
    }
}
