//! Agent of one UAV: computes a command from the UAV's own state, its own scan and the messages of its teammates.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the [`TeamState`], which every agent computes identically from its message log. The
//! rest is individual to this UAV. With an ideal radio, [`TeamAgent`](crate::TeamAgent) does the same without a log.

use crate::intruders::Intruders;
use crate::message::{Message, Scan};
use crate::message_log::{Replica, TeammateStatus};
use crate::output::{AgentOutput, Observation, count};
use crate::params::TeamParams;
use crate::pilot::Pilot;
use crate::priority::AreaOfInterest;
use crate::safety::geofence::Geofence;
use crate::safety::team_geofence::TeamGeofence;
use crate::state_update::TeamStateUpdater;
use crate::step_clock::{StepClock, TIME_JUMP_MAX};
use crate::step_messages::ReportView;
use crate::team_state::TeamState;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};
use crate::validation::ParamError;
use crate::wind::AirVelocity;

/// The agent of one UAV.
///
/// Each time step has two halves. [`Self::observe`] takes the UAV's own state and scan. Then [`Self::outbox`] returns
/// the messages to send, and [`Self::receive`] processes the messages of the teammates. When no more messages are
/// expected, [`Self::decide`] returns the command.
///
/// Time steps lie on the team's grid: whole periods ([`LogParams::period_s`](crate::LogParams)) after
/// [`Time::EPOCH`], by a clock that may be off by less than half a period at the first time step. A late message still
/// counts for its own time step: all later time steps are recomputed. Agents that have received the same messages, in any
/// order, therefore have bitwise equal team states. Missing messages are retransmitted: the outbox contains these
/// retransmissions, too.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut agent = Agent::new(UavId(0), TeamParams::paper())?;
/// let own = UavState::level_flight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
/// // A cue source reports a target; the agent turns onto an orbit around it.
/// let cue = Message::Cue(Cue {
///     source: 0,
///     issued_at: Time::EPOCH,
///     sequence: 0,
///     label: Some(TargetLabel(0)),
///     time: Time::EPOCH,
///     position: Position::from_m(0.0, 0.0),
///     velocity: Velocity::from_m_s(5.0, 0.0),
///     position_sd_m: 20.0,
///     velocity_sd_m_s: 2.0,
///     priority: None,
/// });
/// let observation = agent.observe(Time::EPOCH, &own, Some(Scan::default()));
/// assert_eq!(agent.outbox(&observation).len(), 1);
/// agent.receive(&observation, &cue);
/// let step = agent.decide(&observation);
/// assert!(step.command.turn_rate_rad_s.abs() <= 0.3);
/// assert_eq!(step.diagnostics.group, agent.team_state().groups.first().map(|group| group.id));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent {
    id: UavId,
    restart_count: u32,
    /// Number of time steps started since the last restart.
    sequence: u32,
    replica: Replica,
    /// Aircraft outside the team, from the messages that this UAV has received itself.
    intruders: Intruders,
    clock: StepClock,
    /// Whether this UAV has reported at this time step: its state is valid and its sensor has scanned.
    has_reported: bool,
    is_leaving: bool,
    pilot: Pilot,
    /// Zones that bind the commands of this UAV, if they differ from those of the team.
    own_geofence: Option<TeamGeofence>,
}

impl Agent {
    /// Longest accepted time between two observations. A longer gap counts as a clock jump: if the agent accepted
    /// one wrong time in the future, it would reject all correct times before it, and would lose its tracks. The value
    /// is also the longest period that the simulator supports.
    pub const TIME_JUMP_MAX: Duration = TIME_JUMP_MAX;

    /// Creates the agent of one UAV. Returns all parameters that are out of range or contradict one another
    /// ([`TeamParams::errors`]).
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let replica = Replica::new(id, TeamStateUpdater::new(params)?);
        Ok(Self {
            id,
            restart_count: 0,
            sequence: 0,
            clock: StepClock::new(replica.log.grid),
            replica,
            intruders: Intruders::default(),
            has_reported: false,
            is_leaving: false,
            pilot: Pilot::default(),
            own_geofence: None,
        })
    }

    /// Sets the restart count, which increases by one with each restart. If the agent reports again for the time step
    /// at which it went down, all teammates keep its report from before the restart.
    #[must_use]
    pub fn with_restart_count(self, restart_count: u32) -> Self {
        Self { restart_count, ..self }
    }

    /// Adds keep-out and keep-in zones. Call it before the first time step. All agents of a team need the same zones,
    /// because the team state records which orbits the zones cut. Fails if the intersection of the keep-in zones is empty,
    /// or so small that the UAV cannot circle in it.
    pub fn with_geofence(self, geofence: Geofence) -> Result<Self, Vec<ParamError>> {
        Ok(Self { replica: self.replica.with_geofence(geofence)?, ..self })
    }

    /// Adds areas of interest. Call it before the first time step. All agents of a team need the same areas in the same
    /// order, because groups and assignments depend on them. Fails if a priority is out of range.
    pub fn with_areas_of_interest(mut self, areas: Vec<AreaOfInterest>) -> Result<Self, Vec<ParamError>> {
        self.replica.history.updater.set_areas_of_interest(areas)?;
        Ok(self)
    }

    /// Replaces the zones that bind the commands of this UAV: those of the team and its own, such as the fence of its
    /// autopilot. The team state does not depend on them, so they may differ between UAVs and change in flight. Fails, and
    /// changes nothing, in the same cases as [`Self::with_geofence`].
    pub fn set_own_geofence(&mut self, geofence: Geofence) -> Result<(), Vec<ParamError>> {
        self.own_geofence = TeamGeofence::new(geofence, &self.replica.history.updater.params)?;
        Ok(())
    }

    /// Clears the team state and all received messages, and accepts any time as the next one. Use it after the clock
    /// was set or after a pause longer than 10 s. The counters in the diagnostics keep their values.
    /// As after a restart, teammates that know more send their state; without such teammates, targets have to be cued
    /// again.
    pub fn reset(&mut self) {
        self.clock.reset();
        (self.has_reported, self.pilot) = (false, Pilot::default());
        self.intruders.clear();
        self.replica.restart_at(0);
    }

    /// Announces that this UAV leaves the team from the next time step.
    pub fn leave(&mut self) {
        self.is_leaving = true;
    }

    /// Id of this agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// Team state of the last decision. It may still change if it is later than [`Self::committed`].
    pub fn team_state(&self) -> &TeamState {
        self.replica.history.head()
    }

    /// Team states whose events were published with the last decision; `true` marks a provisional state, which may
    /// still change. While no messages are missing, this is the current state; otherwise, events are published once
    /// they are certain or likely.
    pub fn published_states(&self) -> impl Iterator<Item = (&TeamState, bool)> {
        let link_is_degraded = self.link_is_degraded();
        self.replica
            .history
            .published()
            .map(move |(step, team_state)| (team_state, link_is_degraded && step > self.replica.history.committed))
    }

    /// Last committed time step: nothing up to it can change any more. `None` before the first commit.
    pub fn committed_at(&self) -> Option<Time> {
        (self.replica.history.committed >= self.replica.history.start)
            .then(|| self.replica.log.time(self.replica.history.committed))
    }

    /// Newest stored team state that is committed: nothing up to its time can change any more. `None` before the first
    /// commit.
    pub fn committed(&self) -> Option<&TeamState> {
        self.committed_at().map(|_| self.replica.history.base())
    }

    /// Status of each UAV whose report this agent or a teammate received within the retention time, by ascending UAV.
    pub fn teammate_status(&self) -> impl Iterator<Item = (UavId, TeammateStatus)> {
        let now = self.clock.now().unwrap_or_default();
        self.replica
            .log
            .teammates()
            .iter()
            .map(move |peer| (peer.uav, peer.status(now, self.replica.log.teammate_timeout())))
    }

    /// Time of the newest report of a UAV that this agent or a teammate received within the retention time.
    pub fn last_report_at(&self, uav: UavId) -> Option<Time> {
        self.replica.log.teammate(uav).map(|peer| self.replica.log.time(peer.newest))
    }

    /// True if messages went missing recently, here or at a teammate: the groups and assignments in use are then those
    /// of the decision lag ago.
    pub fn link_is_degraded(&self) -> bool {
        self.clock.now().is_some_and(|now| self.replica.log.link.is_degraded(now))
    }

    /// True if the bandwidth or the load did not allow all retransmissions and requested snapshot parts in this time step,
    /// so that they wait: commits are then late, and a newcomer waits longer.
    pub fn is_retransmission_limited(&self) -> bool {
        self.replica.retransmission.is_limited
    }

    /// True if the clock was set, or the program was paused for longer than 10 s: the last observations had two or more
    /// rejected times that follow each other. A single wrong time is an error.
    pub fn is_time_jump(&self) -> bool {
        self.clock.is_time_jump()
    }

    /// First half of a time step: takes the UAV's state and the scan of its sensor, both at `now`. Without a scan, the
    /// sensor does not measure and the agent sends no report.
    ///
    /// The first time counts for the nearest time step. After it, the agent follows its clock, which may drift by up to
    /// 2,000 ppm: time steps go on if the times are whole periods apart, even if the clock leaves the team's grid. If the
    /// clock was set by less than half a period, the agent rejects one time and follows the next one.
    ///
    /// The first observation of a time step that has a scan counts. The agent rejects and counts a time that is more
    /// than a tenth of a period off the expected one, runs backward, or jumps ahead by more than 10 s. It then sends and
    /// receives nothing, computes the command from its previous state, and accepts the next time if that is valid. To
    /// make the agent follow a time that has permanently shifted, call [`Self::reset`] if [`Self::is_time_jump`].
    pub fn observe(&mut self, now: Time, own: &UavState, scan: Option<Scan>) -> Observation {
        let before = self.clock.now();
        let Some(step) = self.clock.observe(now) else {
            count(&mut self.replica.log.rejected.bad_time);
            return Observation { uav: self.id, time: now, own: *own };
        };
        if before != Some(step) {
            self.start_time_step(before, step);
        }
        // A UAV that does not know its own state sends no report.
        if let Some(scan) = scan.filter(|_| own.is_finite() && !self.has_reported) {
            let (uav, order, is_leaving) = (self.id, (self.restart_count, self.sequence), self.is_leaving);
            let assigned_group = self.team_state().assignment_of(uav);
            let manoeuvre = self.pilot.manoeuvre();
            let report = ReportView { uav, order, state: own, scan, assigned_group, is_leaving, manoeuvre };
            self.has_reported = self.replica.append_report(step, report);
        }
        let known =
            self.replica.log.messages(step).and_then(|row| row.report_of(self.id)).filter(|_| self.has_reported);
        Observation { uav: self.id, time: self.replica.log.time(step), own: known.map_or(*own, |report| report.state) }
    }

    /// Takes the UAV's velocity relative to the air at the observed time step, from its air data and attitude. With the
    /// ground velocity of the observation, the agent estimates the wind from it, if it does so
    /// ([`TeamParams::wind`]). Call it before [`Self::decide`]. With an observation of a past time step, or of another
    /// agent, the call has no effect.
    pub fn observe_air(&mut self, observation: &Observation, air: &AirVelocity) {
        if let Some(params) = self.replica.history.updater.params.wind.filter(|_| self.is_of_now(observation)) {
            self.pilot.observe_air(&params, observation, air);
        }
    }

    /// Messages to send to the teammates: the report of this UAV, then the messages that teammates lack. Empty for a
    /// time step that was rejected or is over, without a scan, and while the UAV's state is not finite.
    pub fn outbox(&self, observation: &Observation) -> &[Message] {
        if self.is_of_now(observation) { self.replica.outbox.messages() } else { &[] }
    }

    /// Processes a message from any sender and of any time step. Malformed and late messages are rejected and counted
    /// ([`Diagnostics::rejected`](crate::Diagnostics::rejected)). Order and repetition do not matter. With an
    /// observation of a past time step, or of another agent, the call has no effect.
    pub fn receive(&mut self, observation: &Observation, message: &Message) {
        let Some(now) = self.clock.now().filter(|_| self.is_of_now(observation)) else { return };
        match message {
            // Traffic is not part of the team state.
            Message::Traffic(traffic) => {
                let rejected = &mut self.replica.log.rejected;
                self.intruders.receive(traffic, observation.time, core::iter::once(&observation.own), rejected);
            }
            _ => self.replica.receive(message, now),
        }
    }

    /// Second half of a time step: returns the command to fly from the observed time on, based on all messages received
    /// so far. A second call after further messages returns the same as if all messages had arrived before the first
    /// call.
    ///
    /// The command is within the limits for every input, including NaN.
    pub fn decide(&mut self, observation: &Observation) -> AgentOutput {
        if let Some(now) = self.clock.now() {
            self.replica.update(now);
        }
        let (rejected, own_zones) = (self.replica.rejected(), self.own_geofence.as_mut());
        let team = self.replica.history.updater_and_head();
        self.pilot.decide(team, own_zones, &self.intruders, observation, rejected)
    }

    fn is_of_now(&self, observation: &Observation) -> bool {
        observation.uav == self.id && self.clock.now().is_some_and(|now| self.replica.log.time(now) == observation.time)
    }

    fn start_time_step(&mut self, before: Option<i64>, step: i64) {
        if before.is_none() {
            self.intruders.clear();
        }
        self.replica.start_time_step(before, step);
        self.has_reported = false;
        self.sequence = self.sequence.wrapping_add(1);
    }
}
