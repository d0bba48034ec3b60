//! Agent of one UAV: computes a command from the UAV's own state, its own scan and the messages of its teammates.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the [`TeamState`], the team state, which every agent computes identically from its
//! message log. The rest is individual to this UAV.
//!
//! ```text
//! committed      |  may still change        |  now
//! ...  k-4  k-3  |  k-2      k-1            |  k        time steps, each with its reports and cues
//!                   ^ a late report arrives: the team states from here on are recomputed
//! ```
//!
//! A time step is *committed* as soon as every expected UAV has reported it and a later time step, and this agent has
//! all messages that these later reports list as received. It is also committed when the retention time has passed. A
//! committed time step accepts no further messages. While messages are missing, the groups and assignments in use are
//! those from one decision lag earlier, because teammates have the same messages of that time.
//!
//! If the team states of two agents differ and the message log cannot reconcile them, the state of the *reference
//! agent* wins: among the live UAVs, the agent whose state started first; ties go to the lowest id. The other agents
//! see the difference in the digest of its reports and request a snapshot of its state. A reference agent that does not
//! send its state on request is skipped for a while.

use crate::command_law::CommandLaw;
use crate::guidance::geofence::Geofence;
use crate::intruders::Intruders;
use crate::message::{CommitDigest, Message, MessageSource, Report, Scan, SnapshotPart, SnapshotRequest};
use crate::message_log::retransmission::{Resend, Retransmission};
use crate::message_log::{LISTED_BEFORE, MessageLog, TeammateLog, TeammateStatus};
use crate::output::{AgentOutput, Observation, Rejected, count};
use crate::params::TeamParams;
use crate::rollback::TeamStateHistory;
use crate::snapshot::{PartOutcome, SnapshotReceiver, SnapshotSender};
use crate::state_update::TeamStateUpdater;
use crate::step_messages::{Insert, ReportView};
use crate::team_state::TeamState;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};
use crate::validation::ParamError;

/// Maximum age, in time steps, of a committed team state that is offered as a snapshot: with an older one, the receiver
/// would need too many messages to catch up.
const ADOPTION_AGE_MAX: i64 = 20;

/// Number of time steps for which the reference agent's digest may be newer than this agent's last commit while no
/// message is missing; afterwards the states count as different.
const DIGEST_MISMATCH_MAX: i64 = 10;

/// The agent of one UAV.
///
/// Each time step has two halves. [`Self::observe`] takes the UAV's own state and scan. Then [`Self::outbox`] returns
/// the messages to send, and [`Self::receive`] processes the messages of the teammates. When no more messages are
/// expected, [`Self::decide`] returns the command.
///
/// Time steps lie on the team's grid: whole periods ([`LogParams::period_s`](crate::LogParams)) after
/// [`Time::EPOCH`]. A late message still counts for its own time step: all later time steps are recomputed. Agents that
/// have received the same messages, in any order, therefore have bitwise equal team states. Missing messages are
/// retransmitted: the outbox contains these retransmissions, too.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut agent = Agent::new(UavId(0), TeamParams::table_1())?;
/// let own = UavState::level_flight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
/// // A cue source reports a target; the agent turns onto an orbit around it.
/// let cue = Message::Cue(Cue {
///     source: 0,
///     issued_at: Time::EPOCH,
///     sequence: 0,
///     label: TargetLabel(0),
///     time: Time::EPOCH,
///     position: Position::from_m(0.0, 0.0),
///     velocity: Velocity::from_m_s(5.0, 0.0),
///     position_sd_m: 20.0,
///     velocity_sd_m_s: 2.0,
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
    log: MessageLog,
    history: TeamStateHistory,
    retransmission: Retransmission,
    snapshot_sender: SnapshotSender,
    snapshot_receiver: SnapshotReceiver,
    /// Aircraft outside the team, from the messages that this UAV has received itself.
    intruders: Intruders,
    /// Messages to send. The first `ready_count` entries are ready; the others are reusable buffers.
    outgoing: Vec<Message>,
    ready_count: usize,
    /// First time step of this agent.
    started_at: i64,
    /// Last observed time step.
    now: Option<i64>,
    /// Whether this UAV has reported at this time step: its state is valid and its sensor has scanned.
    has_reported: bool,
    is_leaving: bool,
    /// Time step since which the reference agent has been ahead of this agent's commits, although no message is
    /// missing.
    mismatch_since: Option<i64>,
    /// Time step since which this agent has requested a snapshot.
    requesting_since: Option<i64>,
    is_stale: bool,
}

impl Agent {
    /// Longest accepted time between two observations. A longer gap counts as a clock jump: if the agent accepted
    /// one wrong time in the future, it would reject all correct times before it, and would lose its tracks. The value
    /// is also the longest period that the simulator supports.
    pub const TIME_JUMP_MAX: Duration = Duration::from_us(10_000_000);

    /// Creates the agent of one UAV. Returns all parameters that are out of range or contradict one another: the field
    /// of view of the orbits must equal that of the sensor ([`TeamParams::errors`]).
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self {
            id,
            restart_count: 0,
            sequence: 0,
            log: MessageLog::new(id, &params),
            history: TeamStateHistory::new(TeamStateUpdater::new(params)?),
            retransmission: Retransmission::default(),
            snapshot_sender: SnapshotSender::default(),
            snapshot_receiver: SnapshotReceiver::default(),
            intruders: Intruders::default(),
            outgoing: Vec::new(),
            ready_count: 0,
            started_at: 0,
            now: None,
            has_reported: false,
            is_leaving: false,
            mismatch_since: None,
            requesting_since: None,
            is_stale: false,
        })
    }

    /// Sets the restart count, which increases by one with each restart. If the agent reports again for the time step
    /// at which it went down, all teammates keep its report from before the restart.
    #[must_use]
    pub fn with_restart_count(self, restart_count: u32) -> Self {
        Self { restart_count, ..self }
    }

    /// Adds keep-out and keep-in zones. Call it before the first time step. All agents of a team need the same zones,
    /// because the team state records which orbits the zones cut.
    #[must_use]
    pub fn with_geofence(self, geofence: Geofence) -> Self {
        Self { history: self.history.with_geofence_zones(geofence), ..self }
    }

    /// Clears the team state and all received messages, and accepts any time as the next one. Use it after the clock
    /// was set or after a pause longer than [`Self::TIME_JUMP_MAX`]. The counters in the diagnostics keep their values.
    /// As after a restart, teammates that know more send their state; without such teammates, targets have to be cued
    /// again.
    pub fn reset(&mut self) {
        self.now = None;
        self.ready_count = 0;
        self.restart_at(0);
    }

    /// Announces that this UAV leaves the team from the next time step.
    pub fn leave(&mut self) {
        self.is_leaving = true;
    }

    /// Id of this agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// Team state of the last decision. It may still change if its time step is later than [`Self::committed_at`].
    pub fn team_state(&self) -> &TeamState {
        self.history.head()
    }

    /// Team states whose events were published with the last decision; `true` marks a provisional state, which may
    /// still change. While no messages are missing, this is the current state; otherwise, events are published once
    /// they are certain or likely.
    pub fn published_states(&self) -> impl Iterator<Item = (&TeamState, bool)> {
        let link_is_degraded = self.link_is_degraded();
        self.history
            .published()
            .map(move |(step, team_state)| (team_state, link_is_degraded && step > self.history.committed))
    }

    /// Last committed time step: nothing up to it can change any more. `None` before the first commit.
    pub fn committed_at(&self) -> Option<Time> {
        (self.history.committed >= self.history.start).then(|| self.log.time(self.history.committed))
    }

    /// Newest stored team state that is committed. It is the state of [`Self::committed_at`], unless a UAV has been
    /// silent for long.
    pub fn committed(&self) -> Option<&TeamState> {
        self.committed_at().map(|_| self.history.base())
    }

    /// Status of each UAV whose report this agent or a teammate received within the retention time, by ascending UAV.
    pub fn teammate_status(&self) -> impl Iterator<Item = (UavId, TeammateStatus)> {
        let now = self.now.unwrap_or_default();
        self.log.teammates().iter().map(move |peer| (peer.uav, peer.status(now, self.log.teammate_timeout())))
    }

    /// Time of the newest report of a UAV that this agent or a teammate received within the retention time.
    pub fn last_report_at(&self, uav: UavId) -> Option<Time> {
        self.log.teammate(uav).map(|peer| self.log.time(peer.newest))
    }

    /// True if messages went missing recently, here or at a teammate: the groups and assignments in use are then those
    /// of the decision lag ago.
    pub fn link_is_degraded(&self) -> bool {
        self.now.is_some_and(|now| self.log.link_is_degraded(now))
    }

    /// First half of a time step: takes the UAV's state and the scan of its sensor, both at `now`. Without a scan, the
    /// sensor does not measure and the agent sends no report.
    ///
    /// The first observation of a time step that has a scan counts. The agent rejects and counts a time that is more
    /// than a tenth of a period off the team's grid, runs backward, or jumps ahead by more than
    /// [`Self::TIME_JUMP_MAX`]. It then sends and receives nothing, computes the command from its previous state, and
    /// accepts the next time if that is valid. To make the agent follow a time that has permanently shifted, call
    /// [`Self::reset`].
    pub fn observe(&mut self, now: Time, own: &UavState, scan: Option<Scan>) -> Observation {
        let Some(step) = self.log.step(now).filter(|step| self.is_next(*step)) else {
            count(&mut self.log.rejected.bad_time);
            return Observation { uav: self.id, time: now, own: *own };
        };
        if self.now != Some(step) {
            self.start_time_step(step);
        }
        // A UAV that does not know its own state sends no report.
        if let Some(scan) = scan.filter(|_| own.is_finite() && !self.has_reported) {
            self.append_report(step, own, scan);
        }
        let known = self.log.messages(step).and_then(|row| row.report_of(self.id)).filter(|_| self.has_reported);
        Observation { uav: self.id, time: self.log.time(step), own: known.map_or(*own, |report| report.state) }
    }

    /// Messages to send to the teammates: the report of this UAV, then the messages that teammates lack. Empty for a
    /// time step that was rejected or is over, without a scan, and while the UAV's state is not finite.
    pub fn outbox(&self, observation: &Observation) -> &[Message] {
        if self.is_of_now(observation) { &self.outgoing[..self.ready_count] } else { &[] }
    }

    /// Processes a message from any sender and of any time step. Malformed and late messages are rejected and counted
    /// ([`Diagnostics::rejected`](crate::Diagnostics::rejected)). Order and repetition do not matter. With an
    /// observation of a past time step, or of another agent, the call has no effect.
    pub fn receive(&mut self, observation: &Observation, message: &Message) {
        let Some(now) = self.now.filter(|_| self.is_of_now(observation)) else { return };
        let committed = self.history.committed;
        if let Some((speaker, number)) = self.log.retransmitted_entry(message, now) {
            self.retransmission.record_sent(speaker, number, now);
        }
        match message {
            // The agent knows its own reports since it started.
            Message::Report(report) if report.uav == self.id && self.is_own(report) => {}
            Message::Report(report) => self.log.receive_report(report, now, committed),
            Message::Cue(cue) => self.log.receive_cue(cue, now, committed),
            Message::Snapshot(part) => self.take_snapshot_part(part, now),
            // Traffic is not part of the team state.
            Message::Traffic(traffic) => {
                return self.intruders.receive(traffic, observation.time, &mut self.log.rejected);
            }
        }
        self.is_stale = true;
    }

    /// Second half of a time step: returns the command to fly from the observed time on, based on all messages received
    /// so far. A second call after further messages returns the same as if all messages had arrived before the first
    /// call.
    ///
    /// The command is within the limits for every input, including NaN.
    pub fn decide(&mut self, observation: &Observation) -> AgentOutput {
        if let Some(now) = self.now.filter(|_| self.is_stale) {
            self.history.replay(&mut self.log, now);
            self.history.select_published(&self.log, now, self.log.link_is_degraded(now));
            self.is_stale = false;
        }
        let implausible = self.history.newest().implausible;
        let refused =
            Rejected { implausible: self.log.rejected.implausible.saturating_add(implausible), ..self.log.rejected };
        let TeamStateUpdater { params, geofence_safety, .. } = &self.history.updater;
        let (team_state, geofence_safety) = (self.history.head(), geofence_safety.as_deref());
        CommandLaw { params, team_state, geofence_safety, intruders: &self.intruders }.decide(observation, refused)
    }

    fn is_of_now(&self, observation: &Observation) -> bool {
        observation.uav == self.id && self.now.is_some_and(|now| self.log.time(now) == observation.time)
    }

    /// True for the current time step and for those that may follow it.
    fn is_next(&self, step: i64) -> bool {
        self.now.is_none_or(|now| {
            let ahead = step.saturating_sub(now);
            ahead >= 0 && ahead.saturating_mul(self.log.period.us()) <= Self::TIME_JUMP_MAX.us()
        })
    }

    /// True if the report is of a time step since the last start or restart of this agent.
    fn is_own(&self, report: &Report) -> bool {
        self.log.step(report.time).is_none_or(|step| step >= self.started_at)
    }

    fn restart_at(&mut self, first: i64) {
        self.log.begin(first);
        self.history.begin(first);
        self.retransmission.reset();
        self.intruders.clear();
        (self.snapshot_sender, self.snapshot_receiver) = (SnapshotSender::default(), SnapshotReceiver::default());
        (self.started_at, self.has_reported, self.is_stale) = (first, false, false);
        (self.mismatch_since, self.requesting_since) = (None, None);
    }

    /// Starts a new time step.
    fn start_time_step(&mut self, now: i64) {
        match self.now {
            None => self.restart_at(now),
            Some(last) => {
                let changed_from = self.log.changed_from;
                // A time step without a decision is still part of the past.
                if self.is_stale {
                    self.history.replay(&mut self.log, last);
                }
                if changed_from < last {
                    self.log.degraded_at = last;
                }
                self.log.rejected.implausible =
                    self.log.rejected.implausible.saturating_add(self.history.newest().implausible);
            }
        }
        let needed_from = self.history.kept_from() + 1;
        self.log.turn_to(now, needed_from);
        self.commit(now);
        self.history.start_decision();
        (self.now, self.has_reported, self.is_stale, self.ready_count) = (Some(now), false, true, 0);
        self.sequence = self.sequence.wrapping_add(1);
        let params = &self.history.updater.params.log;
        self.retransmission.add_budget(params.retransmit_bytes_per_s, self.log.period.s());
    }

    /// Commits all time steps that cannot change any more.
    fn commit(&mut self, now: i64) {
        // At first the agent does not know its teammates. It waits for the teammate timeout or, if it has received no
        // report yet, for the retention time, because reports may be late.
        let patience = if self.log.has_received() { self.log.teammate_timeout() } else { self.log.horizon() };
        let is_team_known = now - self.started_at > patience;
        let mut committed = self.history.committed;
        while is_team_known && committed + 1 < now && self.log.is_complete(committed + 1) {
            committed += 1;
        }
        committed = committed.max(now - 1 - self.log.horizon());
        if committed > self.history.committed {
            self.history.commit(committed);
        }
        self.commit_with_teammates(now);
    }

    /// Commits the newest time step that a teammate has committed with a bitwise equal state, because a teammate that
    /// is far ahead no longer lists its messages of such old time steps.
    fn commit_with_teammates(&mut self, now: i64) {
        let Self { log, history, .. } = self;
        let since = log.time(history.start);
        let commit_digests = log
            .teammates_with_status(now)
            .map(|peer| &peer.log_status)
            .filter(|status| status.start == since)
            .map(|status| status.commit_digest);
        let (committed, present) = (log.time(history.committed), log.time(now));
        let ahead =
            commit_digests.filter(|commit_digest| committed < commit_digest.time && commit_digest.time < present);
        let ahead = ahead.map(|commit_digest| (log.step_at(commit_digest.time), commit_digest.digest));
        let same = |(step, digest): &(i64, u64)| history.at(*step).is_some_and(|own| own.digest() == *digest);
        if let Some((step, digest)) = ahead.filter(same).max() {
            history.commit_with_digest(step, digest);
        }
    }

    /// Takes the scan of this UAV and composes the messages to send.
    fn append_report(&mut self, now: i64, own: &UavState, scan: Scan) {
        let (uav, order, is_leaving) = (self.id, (self.restart_count, self.sequence), self.is_leaving);
        let assignment = self.history.head().assignment_of(uav);
        let put = self
            .log
            .append_own(now, ReportView { uav, order, state: own, scan, assigned_group: assignment, is_leaving });
        self.has_reported = put != Insert::Rejected;
        self.is_stale = true;
        if !self.has_reported {
            return count(&mut self.log.rejected.malformed);
        }
        let request = self.check_reference(now);
        let Self { id, restart_count, sequence, log, history, outgoing: outbox, .. } = self;
        if !matches!(outbox.first(), Some(Message::Report(_))) {
            outbox.insert(0, Message::Report(Report::position_only(*id, Time::EPOCH, *own)));
        }
        if let (Some(Message::Report(report)), Some(own_report)) =
            (outbox.first_mut(), log.messages(now).and_then(|row| row.report_of(uav)))
        {
            (report.uav, report.restart_count, report.sequence) = (uav, *restart_count, *sequence);
            (report.time, report.state, report.boresight) = (own_report.time, *own, scan.boresight);
            (report.assigned_group, report.is_leaving) = (assignment, is_leaving);
            report.detections.clone_from(&own_report.detections);
            let log_status = report.log_status.get_or_insert_default();
            log_status.start = log.time(history.start);
            log_status.committed_until = log.time(history.committed);
            log_status.commit_digest = history.commit_digest(log);
            log_status.degraded_at = log.time(log.degraded_at);
            log_status.snapshot_request = request;
            log.list(history.committed, log_status);
        }
        self.ready_count = 1;
        self.offer_snapshot(now);
        let (outbox, ready_count) = (&mut self.outgoing, &mut self.ready_count);
        let is_missing = self.retransmission.next_messages(&self.log, now, |again| {
            let message = outbox_slot(outbox, *ready_count);
            match (again, &mut *message) {
                (Resend::Report(report), Message::Report(old)) => old.clone_from(report),
                (Resend::Report(report), _) => *message = Message::Report(report.clone()),
                (Resend::Cue(cue), _) => *message = Message::Cue(*cue),
            }
            *ready_count += 1;
        });
        if is_missing {
            self.log.degraded_at = now;
        }
    }

    /// Adds the snapshot parts that teammates have requested from this agent.
    fn offer_snapshot(&mut self, now: i64) {
        let requests = self
            .log
            .teammates_with_status(now)
            .filter_map(|peer| Some((peer.log_status_at, peer.snapshot_request(self.id)?)));
        let requests: Vec<(i64, SnapshotRequest)> = requests.collect();
        if requests.is_empty() {
            return;
        }
        let is_in_use =
            requests.iter().any(|(_, request)| request.commit_digest == Some(self.snapshot_sender.commit_digest));
        // A snapshot that no request names was for another receiver, which has it by now.
        let max_age = if is_in_use { self.log.horizon() / 3 } else { self.log.teammate_timeout() };
        if !self.snapshot_sender.is_fresh(now, max_age) {
            let step = self.history.kept_up_to(self.offered_step(now));
            let Some(offer) = self.history.at(step).and_then(|team_state| SnapshotSender::of(team_state, now)) else {
                return;
            };
            self.snapshot_sender = offer;
            self.history.commit_with_digest(step, self.snapshot_sender.commit_digest.digest);
        }
        let Self { id, log, history, snapshot_sender: offer, outgoing: outbox, ready_count, retransmission, .. } = self;
        let since = log.time(history.start);
        for (requested_at, request) in requests {
            let mut from = 0;
            while let Some(index) = offer.lacking(&request, requested_at, from) {
                if retransmission.is_spent() {
                    return;
                }
                let slot = outbox_slot(outbox, *ready_count);
                let mut part = match slot {
                    Message::Snapshot(part) => core::mem::take(part),
                    _ => SnapshotPart::default(),
                };
                offer.part(*id, since, index, now, &mut part);
                *slot = Message::Snapshot(part);
                retransmission.spend(slot.size_bytes());
                *ready_count += 1;
                from = index + 1;
            }
        }
    }

    /// Time step whose state is sent on request: the last committed one or, while a silent teammate delays commits, the
    /// last one that is complete among the live teammates; that one is then committed.
    fn offered_step(&self, now: i64) -> i64 {
        let committed = self.history.committed;
        // An adopted state may not be older than the retention time.
        let old = ADOPTION_AGE_MAX.min(self.log.horizon() / 6);
        if now - committed <= old || self.reference_agent(now).is_some() {
            return committed;
        }
        let follows_ours = |peer: &TeammateLog| {
            let commit_digest = peer.log_status.commit_digest;
            let ours = self.history.digest_at(self.log.step_at(commit_digest.time));
            peer.log_status.start == self.log.time(self.history.start)
                && ours.is_none_or(|digest| digest == commit_digest.digest)
        };
        let peers = || self.log.teammates_with_status(now).filter(|peer| follows_ours(peer));
        let known =
            (committed + 1..now).take_while(|step| peers().all(|peer| self.log.is_acknowledged_by(peer, *step)));
        known.last().unwrap_or(committed).max(now - 2 * old).min(now - 1)
    }

    /// Returns the reference agent if its state takes precedence over that of this agent.
    fn reference_agent(&self, now: i64) -> Option<&TeammateLog> {
        let ours = (self.log.time(self.history.start), self.id);
        let first = |peer: &&TeammateLog| (peer.log_status.start, peer.uav);
        let peers = self.log.teammates_with_status(now).filter(|peer| peer.skipped_until <= now);
        peers.min_by_key(first).filter(|peer| first(peer) < ours)
    }

    /// Compares the state of this agent with that of the reference agent; returns the snapshot request if they differ.
    fn check_reference(&mut self, now: i64) -> Option<SnapshotRequest> {
        let Some(counting) = self.reference_agent(now) else { return self.accept_own_state() };
        let (counting, since, commit_digest) =
            (counting.uav, counting.log_status.start, counting.log_status.commit_digest);
        let is_alike =
            if since == self.log.time(self.history.start) { self.agrees(commit_digest, now) } else { Some(false) };
        // An unknown result does not end a request that has started.
        let is_ours = is_alike.unwrap_or(self.requesting_since.is_none());
        if is_ours {
            self.requesting_since = None;
            self.snapshot_receiver.reset();
            return None;
        }
        // An agent that does not answer may not have received the requests. Other agents that follow the same state
        // have it, too.
        let asks_since = *self.requesting_since.get_or_insert(now);
        let follows = |peer: &&TeammateLog| {
            peer.uav == counting || (peer.log_status.start, peer.log_status.commit_digest) == (since, commit_digest)
        };
        let others = || self.log.teammates_with_status(now).filter(follows);
        let turn = (now - asks_since) / (2 * self.log.teammate_timeout());
        if turn >= others().count().max(1) as i64 {
            return self.skip_reference(counting, asks_since, now);
        }
        let place = others().position(|peer| peer.uav == counting).unwrap_or_default() + turn as usize;
        let receiver = others().cycle().nth(place).map_or(counting, |peer| peer.uav);
        Some(self.snapshot_receiver.request(receiver))
    }

    /// Skips a reference agent because no agent sent its state on request: for the retention time if the reference
    /// agent received the request, otherwise for twice the teammate timeout.
    fn skip_reference(&mut self, counting: UavId, asks_since: i64, now: i64) -> Option<SnapshotRequest> {
        let received = self.log.teammate(counting).and_then(|peer| peer.received(MessageSource::Uav(self.id)).last());
        let is_received = received.is_some_and(|run| run.to >= asks_since);
        let pause = if is_received { self.log.horizon() } else { 2 * self.log.teammate_timeout() };
        self.log.skip_reference(counting, now + pause);
        (self.mismatch_since, self.requesting_since) = (None, None);
        self.snapshot_receiver.reset();
        self.check_reference(now)
    }

    /// Ends all requests, because no other agent's state takes precedence.
    fn accept_own_state(&mut self) -> Option<SnapshotRequest> {
        (self.mismatch_since, self.requesting_since) = (None, None);
        self.snapshot_receiver.reset();
        None
    }

    /// Returns whether the committed state of another agent equals that of this agent; `None` if this is not known yet.
    fn agrees(&mut self, commit_digest: CommitDigest, now: i64) -> Option<bool> {
        let (step, committed) = (self.log.step_at(commit_digest.time), self.history.committed);
        if commit_digest == CommitDigest::default() {
            return Some(true);
        }
        if step <= committed {
            self.mismatch_since = None;
            return self.history.digest_at(step).map(|own| own == commit_digest.digest);
        }
        // This far behind, a snapshot arrives sooner than all the messages that lead to it.
        if step - committed > LISTED_BEFORE {
            return Some(false);
        }
        // If no message is missing, a state equal to this agent's would be committed here, too.
        if self.log.lacks(committed, step, now) {
            self.mismatch_since = None;
            return None;
        }
        (now - *self.mismatch_since.get_or_insert(now) > DIGEST_MISMATCH_MAX).then_some(false)
    }

    /// Stores a part of another agent's snapshot; once all parts are there, that state replaces this agent's.
    fn take_snapshot_part(&mut self, part: &SnapshotPart, now: i64) {
        if !self.snapshot_receiver.is_requested_from(part.uav) {
            return;
        }
        // A snapshot of an impossible time would block all older snapshots.
        let is_of_use = |(since, step): &(i64, i64)| (now - self.log.horizon()..now).contains(step) && since <= step;
        let times = self.log.step(part.start).zip(self.log.step(part.commit_digest.time));
        let Some((since, step)) = times.filter(is_of_use) else {
            return count(&mut self.log.rejected.malformed);
        };
        match self.snapshot_receiver.add_part(part, &self.history.updater.params) {
            // A sender that keeps restarting its transfer makes no progress.
            PartOutcome::Nothing | PartOutcome::First => {}
            // Each received part restarts the turn of the current sender, so that no other sender gets a request.
            PartOutcome::Part => {
                let turn = 2 * self.log.teammate_timeout();
                self.requesting_since =
                    Some(self.requesting_since.map_or(now, |since| now - (now - since) / turn * turn));
            }
            PartOutcome::Malformed => {
                count(&mut self.log.rejected.malformed);
                self.snapshot_receiver.reset();
            }
            PartOutcome::Whole(team_state) => {
                let digest = team_state.digest();
                self.history.adopt(since, step, *team_state);
                self.history.commit_with_digest(step, digest);
                self.log.reach_back(step + 1);
                self.log.changed_from = step + 1;
                (self.mismatch_since, self.requesting_since, self.snapshot_sender) =
                    (None, None, SnapshotSender::default());
                self.snapshot_receiver.reset();
            }
        }
    }
}

/// Returns the outbox slot for the next message to send.
fn outbox_slot(outbox: &mut Vec<Message>, ready_count: usize) -> &mut Message {
    if outbox.len() <= ready_count {
        outbox.push(Message::Snapshot(SnapshotPart::default()));
    }
    &mut outbox[ready_count]
}
