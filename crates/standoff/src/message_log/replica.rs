//! Replica: one agent's copy of the message log, and the team states computed from it.

use super::log::MessageLog;
use super::outbox::Outbox;
use super::retransmission::{RadioLoad, Resend, Retransmission};
use super::rollback::TeamStateHistory;
use super::snapshot::{SnapshotReceiver, SnapshotSender};
use crate::message::{Message, Report};
use crate::output::{Rejected, count};
use crate::safety::geofence::Geofence;
use crate::state_update::TeamStateUpdater;
use crate::step_messages::{Insert, ReportView};
use crate::time::Time;
use crate::uav::UavId;
use crate::validation::ParamError;

/// Message log and team states of an agent, and the exchange with its teammates that keeps them equal.
#[derive(Debug, Clone)]
pub(crate) struct Replica {
    pub(super) id: UavId,
    pub(crate) log: MessageLog,
    pub(crate) history: TeamStateHistory,
    pub(crate) outbox: Outbox,
    pub(crate) retransmission: Retransmission,
    pub(super) snapshot_sender: SnapshotSender,
    pub(super) snapshot_receiver: SnapshotReceiver,
    /// First time step of this agent.
    started_at: i64,
    /// Time step since which the reference agent has been ahead of this agent's commits, although no message is
    /// missing.
    pub(super) mismatch_since: Option<i64>,
    /// Time step since which this agent has requested a snapshot.
    pub(super) requesting_since: Option<i64>,
    /// True if messages have arrived since the team states were computed.
    is_stale: bool,
}

impl Replica {
    pub(crate) fn new(id: UavId, updater: TeamStateUpdater) -> Self {
        Self {
            id,
            log: MessageLog::new(id, &updater.params),
            history: TeamStateHistory::new(updater),
            outbox: Outbox::default(),
            retransmission: Retransmission::default(),
            snapshot_sender: SnapshotSender::default(),
            snapshot_receiver: SnapshotReceiver::default(),
            started_at: 0,
            mismatch_since: None,
            requesting_since: None,
            is_stale: false,
        }
    }

    pub(crate) fn with_geofence(self, geofence: Geofence) -> Result<Self, Vec<ParamError>> {
        Ok(Self { history: self.history.with_geofence_zones(geofence)?, ..self })
    }

    /// Clears everything except the counters of rejected messages, and restarts at time step `first`.
    pub(crate) fn restart_at(&mut self, first: i64) {
        self.log.begin(first);
        self.history.begin(first);
        self.outbox.clear();
        self.retransmission.reset();
        (self.snapshot_sender, self.snapshot_receiver) = (SnapshotSender::default(), SnapshotReceiver::default());
        (self.started_at, self.is_stale) = (first, false);
        (self.mismatch_since, self.requesting_since) = (None, None);
    }

    /// Starts time step `now` after time step `last`; `None` for the first one.
    pub(crate) fn start_time_step(&mut self, last: Option<i64>, now: i64) {
        match last {
            None => self.restart_at(now),
            Some(last) => {
                let changed_from = self.log.changed_from;
                // A time step without a decision is still part of the past.
                if self.is_stale {
                    self.history.replay(&mut self.log, last);
                }
                if changed_from < last {
                    self.log.link.degraded_at = last;
                }
                self.log.rejected = self.rejected();
            }
        }
        let needed_from = self.history.kept_from() + 1;
        self.log.turn_to(now, needed_from);
        self.commit(now);
        self.history.start_decision();
        self.outbox.clear();
        self.retransmission.is_limited = false;
        self.is_stale = true;
    }

    /// Number of messages that were rejected so far.
    pub(crate) fn rejected(&self) -> Rejected {
        self.log.rejected.with(self.history.newest())
    }

    /// Appends this UAV's report to the log and composes the messages to send. Returns false if the report is malformed.
    pub(crate) fn append_report(&mut self, now: i64, own: ReportView) -> bool {
        self.is_stale = true;
        if self.log.append_own(now, own) == Insert::Rejected {
            count(&mut self.log.rejected.malformed);
            return false;
        }
        let request = self.check_reference(now);
        self.outbox.clear();
        let Self { log, history, outbox, .. } = self;
        let message = outbox.push();
        if !matches!(message, Message::Report(_)) {
            *message = Message::Report(Report::position_only(own.uav, Time::EPOCH, *own.state));
        }
        if let (Message::Report(report), Some(logged)) =
            (&mut *message, log.messages(now).and_then(|messages| messages.report_of(own.uav)))
        {
            (report.uav, (report.restart_count, report.sequence)) = (own.uav, own.order);
            (report.time, report.state, report.boresight) = (logged.time, *own.state, logged.boresight);
            (report.assigned_group, report.is_leaving) = (own.assigned_group, own.is_leaving);
            report.manoeuvre = logged.manoeuvre;
            report.detections.clone_from(&logged.detections);
            let log_status = report.log_status.get_or_insert_default();
            log_status.start = log.time(history.start);
            log_status.committed_until = log.time(history.committed);
            log_status.commit_digest = history.commit_digest(log);
            log_status.degraded_at = log.time(log.link.degraded_at);
            log_status.snapshot_request = request;
            log.list(history.committed, log_status);
        }
        let load = RadioLoad {
            own_report_bytes: message.size_bytes(),
            mean_report_bytes: log.mean_report_bytes(now),
            teammates: log.teammates_with_status(now).count(),
            loss: log.link.loss(),
            period_s: log.grid.period.s(),
            bandwidth_bytes_per_s: history.updater.params.log.bandwidth_bytes_per_s,
        };
        self.retransmission.add_budget(&load);
        self.offer_snapshot(now);
        let outbox = &mut self.outbox;
        let is_missing = self.retransmission.next_messages(&self.log, now, |again| {
            let message = outbox.push();
            match (again, &mut *message) {
                (Resend::Report(report), Message::Report(old)) => old.clone_from(report),
                (Resend::Report(report), _) => *message = Message::Report(report.clone()),
                (Resend::Cue(cue), _) => *message = Message::Cue(*cue),
            }
        });
        if is_missing {
            self.log.link.degraded_at = now;
        }
        true
    }

    /// Processes a report, a cue or a part of a snapshot.
    pub(crate) fn receive(&mut self, message: &Message, now: i64) {
        let committed = self.history.committed;
        if let Some((source, number)) = self.log.retransmitted_entry(message, now) {
            self.retransmission.record_sent(source, number, now);
        }
        match message {
            // The agent knows its own reports since it started.
            Message::Report(report) if report.uav == self.id && self.is_own(report) => {}
            Message::Report(report) => self.log.receive_report(report, now, committed),
            Message::Cue(cue) => self.log.receive_cue(cue, now, committed),
            Message::Snapshot(part) => self.take_snapshot_part(part, now),
            Message::Traffic(_) => return,
        }
        self.is_stale = true;
    }

    /// Recomputes the team states that have changed, and selects the one that is used for decisions.
    pub(crate) fn update(&mut self, now: i64) {
        if self.is_stale {
            self.history.replay(&mut self.log, now);
            self.history.select_published(&self.log, now, self.log.link.is_degraded(now));
            self.is_stale = false;
        }
    }

    /// True if the report is of a time step since the last start or restart of this agent.
    fn is_own(&self, report: &Report) -> bool {
        self.log.step(report.time).is_none_or(|step| step >= self.started_at)
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
        let ahead = ahead.map(|commit_digest| (log.grid.step_at(commit_digest.time), commit_digest.digest));
        let same = |(step, digest): &(i64, u64)| history.at(*step).is_some_and(|own| own.digest() == *digest);
        if let Some((step, digest)) = ahead.filter(same).max() {
            history.commit_with_digest(step, digest);
        }
    }
}
