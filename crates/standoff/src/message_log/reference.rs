//! Reference agent: the agent whose team state wins where states differ.

use super::log::LISTED_BEFORE;
use super::replica::Replica;
use super::teammates::TeammateLog;
use crate::message::{CommitDigest, MessageSource, SnapshotRequest};
use crate::uav::UavId;

/// Number of time steps for which the reference agent's digest may be newer than this agent's last commit while no
/// message is missing; afterwards the states count as different.
const DIGEST_MISMATCH_MAX: i64 = 10;

impl Replica {
    /// Returns the reference agent if its state takes precedence over that of this agent.
    pub(super) fn reference_agent(&self, now: i64) -> Option<&TeammateLog> {
        let ours = (self.log.time(self.history.start), self.id);
        let first = |peer: &&TeammateLog| (peer.log_status.start, peer.uav);
        let peers = self.log.teammates_with_status(now).filter(|peer| peer.skipped_until <= now);
        peers.min_by_key(first).filter(|peer| first(peer) < ours)
    }

    /// Compares the state of this agent with that of the reference agent; returns the snapshot request if they differ.
    pub(super) fn check_reference(&mut self, now: i64) -> Option<SnapshotRequest> {
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
        let (step, committed) = (self.log.grid.step_at(commit_digest.time), self.history.committed);
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
}
