//! Snapshot of a team state for an agent that missed its history: sent in parts and checked as a whole before use.
//!
//! An agent that lacks the team's past, or whose state differs, requests a snapshot. The sender sends parts as the
//! retransmission budget allows, and repeats a part if the receiver's next report shows that it is missing.

use crate::message::{CommitDigest, SnapshotPart, SnapshotRequest};
use crate::params::TeamParams;
use crate::team_state::TeamState;
use crate::time::Time;
use crate::tracking::track::TrackId;
use crate::uav::UavId;

/// Maximum number of parts of a snapshot: 5 MiB, about 20,000 targets.
const PARTS_MAX: usize = 10_240;

/// Number of time steps after which a newer team state is offered.
const OFFERED_FOR: i64 = 40;

/// Sender side: a team state that is sent on request.
#[derive(Debug, Clone, Default)]
pub(crate) struct SnapshotSender {
    pub(crate) commit_digest: CommitDigest,
    bytes: Vec<u8>,
    /// Time step at which each part was last sent.
    sent_at: Vec<i64>,
    made_at: i64,
}

impl SnapshotSender {
    /// Serialises a team state at time step `now`; `None` if it is too large.
    pub(crate) fn of(team_state: &TeamState, now: i64) -> Option<Self> {
        let bytes = serialised(team_state).ok()?;
        let parts = bytes.len().div_ceil(SnapshotPart::BYTES_MAX);
        let commit_digest = CommitDigest { time: team_state.time, digest: team_state.digest() };
        (parts <= PARTS_MAX).then(|| Self { commit_digest, bytes, sent_at: vec![i64::MIN; parts], made_at: now })
    }

    /// True if the snapshot is still useful: it is not older than `periods` or the limit of all snapshots.
    pub(crate) fn is_fresh(&self, now: i64, periods: i64) -> bool {
        !self.bytes.is_empty() && now - self.made_at <= periods.min(OFFERED_FOR)
    }

    /// Returns the first part, from index `from` on, that the receiver lacked when it sent its request at `asked_at`,
    /// and that has not been sent since.
    pub(crate) fn lacking(&self, request: &SnapshotRequest, asked_at: i64, from: u16) -> Option<u16> {
        let is_other = request.commit_digest.is_some_and(|commit_digest| commit_digest != self.commit_digest);
        let (next, after) = if is_other { (0, 0) } else { (request.first_missing_part, request.received_mask) };
        let has = move |index: u16| match index.checked_sub(next) {
            None => true,
            Some(0) => false,
            Some(ahead) => ahead <= 64 && after >> (ahead - 1) & 1 == 1,
        };
        let count = self.sent_at.len().min(usize::from(u16::MAX)) as u16;
        let mut parts = next.max(from)..count.min(next.saturating_add(65));
        parts.find(|index| !has(*index) && self.sent_at[usize::from(*index)] < asked_at)
    }

    /// Writes part `index`, sent at time step `now`, into `part`.
    pub(crate) fn part(&mut self, uav: UavId, since: Time, index: u16, now: i64, part: &mut SnapshotPart) {
        let place = usize::from(index);
        self.sent_at[place] = now;
        let from = place * SnapshotPart::BYTES_MAX;
        let to = self.bytes.len().min(from + SnapshotPart::BYTES_MAX);
        (part.uav, part.start, part.commit_digest) = (uav, since, self.commit_digest);
        (part.index, part.count) = (index, self.sent_at.len() as u16);
        part.bytes.clear();
        part.bytes.extend_from_slice(&self.bytes[from..to]);
    }
}

/// Receiver side: a team state that arrives in parts.
#[derive(Debug, Clone, Default)]
pub(crate) struct SnapshotReceiver {
    from: Option<UavId>,
    start: Time,
    commit_digest: CommitDigest,
    parts: Vec<Option<Vec<u8>>>,
}

/// Result of adding a part.
#[derive(Debug)]
pub(crate) enum PartOutcome {
    /// The part is known, or belongs to an older snapshot.
    Nothing,
    /// First part; more parts are missing.
    First,
    /// Further part; more parts are missing.
    Part,
    /// All parts have arrived.
    Whole(Box<TeamState>),
    /// The parts do not match their digest, or do not form a valid team state.
    Malformed,
}

impl SnapshotReceiver {
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Returns the request to send to a UAV.
    pub(crate) fn request(&mut self, of: UavId) -> SnapshotRequest {
        if self.from != Some(of) {
            *self = Self { from: Some(of), ..Self::default() };
        }
        let commit_digest = Some(self.commit_digest).filter(|_| !self.parts.is_empty());
        let next = self.parts.iter().position(Option::is_none).unwrap_or(self.parts.len());
        let ahead = self.parts.iter().skip(next + 1).take(64);
        let after = ahead.zip(0..).fold(0, |after, (part, bit)| after | u64::from(part.is_some()) << bit);
        SnapshotRequest { receiver: of, commit_digest, first_missing_part: next as u16, received_mask: after }
    }

    /// True if the snapshot is requested from this UAV.
    pub(crate) fn is_requested_from(&self, uav: UavId) -> bool {
        self.from == Some(uav)
    }

    /// Adds a part from the requested UAV.
    pub(crate) fn add_part(&mut self, part: &SnapshotPart, params: &TeamParams) -> PartOutcome {
        let SnapshotPart { start: since, commit_digest, index, count, ref bytes, .. } = *part;
        let (place, parts) = (usize::from(index), usize::from(count));
        let is_last = place + 1 == parts;
        let is_valid = place < parts
            && parts <= PARTS_MAX
            && !bytes.is_empty()
            && (bytes.len() == SnapshotPart::BYTES_MAX || is_last && bytes.len() < SnapshotPart::BYTES_MAX);
        if !is_valid {
            return PartOutcome::Malformed;
        }
        let is_first = (self.start, self.commit_digest, self.parts.len()) != (since, commit_digest, parts);
        if is_first {
            // A part of an older snapshot is ignored.
            if !self.parts.is_empty() && commit_digest.time < self.commit_digest.time {
                return PartOutcome::Nothing;
            }
            (self.start, self.commit_digest) = (since, commit_digest);
            self.parts.clear();
            self.parts.resize(parts, None);
        }
        if self.parts[place].is_some() {
            return PartOutcome::Nothing;
        }
        self.parts[place] = Some(bytes.clone());
        if self.parts.iter().any(Option::is_none) {
            return if is_first { PartOutcome::First } else { PartOutcome::Part };
        }
        let whole: Vec<u8> = self.parts.drain(..).flatten().flatten().collect();
        match read(&whole, self.commit_digest, params) {
            Some(team_state) => PartOutcome::Whole(Box::new(team_state)),
            None => PartOutcome::Malformed,
        }
    }
}

/// Serialises a team state; tracks of detections without label follow, if there are any or priorities follow them.
fn serialised(team_state: &TeamState) -> postcard::Result<Vec<u8>> {
    let mut bytes = postcard::to_allocvec(team_state)?;
    let priorities = team_state.memberships.own_priorities();
    if !team_state.unlabelled.is_empty() || !priorities.is_empty() {
        bytes = postcard::to_extend(&team_state.unlabelled, bytes)?;
    }
    if priorities.is_empty() { Ok(bytes) } else { postcard::to_extend(&priorities, bytes) }
}

/// Deserialises a team state and checks it against its digest.
fn read(bytes: &[u8], commit_digest: CommitDigest, params: &TeamParams) -> Option<TeamState> {
    let (mut team_state, mut rest) = postcard::take_from_bytes::<TeamState>(bytes).ok()?;
    if !rest.is_empty() {
        (team_state.unlabelled, rest) = postcard::take_from_bytes(rest).ok()?;
    }
    if !rest.is_empty() {
        let priorities: Vec<(TrackId, f64)>;
        (priorities, rest) = postcard::take_from_bytes(rest).ok()?;
        if !team_state.memberships.restore_priorities(&priorities) {
            return None;
        }
    }
    let matches =
        rest.is_empty() && team_state.time == commit_digest.time && team_state.digest() == commit_digest.digest;
    (matches && team_state.rebuild_index(params)).then_some(team_state)
}
