//! Teammates: which are present, and which entries each has received.

use crate::message::{LogStatus, MessageSource, ReceivedRange, SnapshotRequest};
use crate::uav::UavId;

/// A time step before all others.
pub(crate) const NEVER: i64 = i64::MIN / 2;

/// Status of a teammate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TeammateStatus {
    /// A report of this or the last time step was received.
    Live,
    /// No recent report: the teammate keeps its assignment, and its state is extrapolated.
    Silent,
    /// No report for longer than the teammate timeout: the team continues without it.
    TimedOut,
    /// The UAV has announced that it leaves.
    Left,
}

/// A UAV whose report this agent or a teammate has received.
#[derive(Debug, Clone)]
pub(crate) struct TeammateLog {
    pub(crate) uav: UavId,
    /// First and last time step with a known report.
    pub(crate) first: i64,
    pub(crate) newest: i64,
    /// True if this agent has received a report itself.
    pub(crate) has_reported: bool,
    /// Time step at which the UAV announced that it leaves.
    pub(crate) left_at: Option<i64>,
    /// Time step of the report that contained `log_status`.
    pub(crate) log_status_at: i64,
    pub(crate) log_status: LogStatus,
    /// True if the entries listed by the teammate equal those received here, as far as it could know them.
    pub(crate) log_matches: bool,
    /// Until this time step, the teammate is not a reference agent, because it did not send a requested snapshot.
    pub(crate) skipped_until: i64,
}

impl TeammateLog {
    pub(crate) fn new(uav: UavId, step: i64) -> Self {
        let (first, newest, knows_at) = (step, step, NEVER);
        let (left_at, log_status, skipped_until) = (None, LogStatus::default(), NEVER);
        Self {
            uav,
            first,
            newest,
            has_reported: false,
            left_at,
            log_status_at: knows_at,
            log_status,
            log_matches: false,
            skipped_until,
        }
    }

    /// Records that the UAV has reported a time step. If it had left, it is back.
    pub(crate) fn reported(&mut self, step: i64) {
        self.first = self.first.min(step);
        self.newest = self.newest.max(step);
        self.left_at = self.left_at.filter(|left_at| step <= *left_at);
    }

    /// Records that a report of the UAV was received. An older announcement to leave is void.
    pub(crate) fn receive(&mut self, step: i64, is_leaving: bool) {
        self.has_reported = true;
        self.reported(step);
        if is_leaving && step == self.newest {
            self.left_at = Some(step);
        }
    }

    /// True if the UAV is expected to report a time step.
    pub(crate) fn is_due(&self, step: i64) -> bool {
        self.first <= step && self.left_at.is_none_or(|left_at| step <= left_at)
    }

    pub(crate) fn status(&self, now: i64, timeout: i64) -> TeammateStatus {
        match now - self.newest {
            _ if self.left_at.is_some() => TeammateStatus::Left,
            ..=1 => TeammateStatus::Live,
            ago if ago <= timeout => TeammateStatus::Silent,
            _ => TeammateStatus::TimedOut,
        }
    }

    /// True if the teammate has sent its log status within the teammate timeout and has not left.
    pub(crate) fn has_sent_status(&self, now: i64, timeout: i64) -> bool {
        self.left_at.is_none() && now - timeout <= self.log_status_at
    }

    /// Returns the snapshot request of the teammate, if it addresses `receiver`.
    pub(crate) fn snapshot_request(&self, receiver: UavId) -> Option<SnapshotRequest> {
        self.log_status.snapshot_request.filter(|request| request.receiver == receiver)
    }

    /// Returns the received entries of a source, as listed by the teammate.
    pub(crate) fn received(&self, source: MessageSource) -> &[ReceivedRange] {
        let held = &self.log_status.received[..];
        let start = held.partition_point(|run| run.source < source);
        let length = held[start..].partition_point(|run| run.source == source);
        &held[start..start + length]
    }
}
