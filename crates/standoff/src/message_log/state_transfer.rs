//! State transfer: snapshots of a team state, sent on request and adopted.

use super::replica::Replica;
use super::snapshot::{PartOutcome, SnapshotSender};
use super::teammates::TeammateLog;
use crate::message::{Message, SnapshotPart, SnapshotRequest};
use crate::output::count;

/// Maximum age, in time steps, of a committed team state that is offered as a snapshot: with an older one, the receiver
/// would need too many messages to catch up.
const ADOPTION_AGE_MAX: i64 = 20;

impl Replica {
    /// Adds the snapshot parts that teammates have requested from this agent.
    pub(super) fn offer_snapshot(&mut self, now: i64) {
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
        let Self { id, log, history, snapshot_sender: offer, outbox, retransmission, .. } = self;
        let since = log.time(history.start);
        for (requested_at, request) in requests {
            let mut from = 0;
            while let Some(index) = offer.lacking(&request, requested_at, from) {
                if retransmission.has_to_wait() {
                    return;
                }
                let slot = outbox.push();
                let mut part = match slot {
                    Message::Snapshot(part) => core::mem::take(part),
                    _ => SnapshotPart::default(),
                };
                offer.part(*id, since, index, now, &mut part);
                *slot = Message::Snapshot(part);
                retransmission.spend(slot.size_bytes());
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
            let ours = self.history.digest_at(self.log.grid.step_at(commit_digest.time));
            peer.log_status.start == self.log.time(self.history.start)
                && ours.is_none_or(|digest| digest == commit_digest.digest)
        };
        let peers = || self.log.teammates_with_status(now).filter(|peer| follows_ours(peer));
        let known =
            (committed + 1..now).take_while(|step| peers().all(|peer| self.log.is_acknowledged_by(peer, *step)));
        known.last().unwrap_or(committed).max(now - 2 * old).min(now - 1)
    }

    /// Stores a part of another agent's snapshot; once all parts are there, that state replaces this agent's.
    pub(super) fn take_snapshot_part(&mut self, part: &SnapshotPart, now: i64) {
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
