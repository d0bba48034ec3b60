//! Messages of a team: the measurements and states of the UAVs, and the cues for targets.
//!
//! UAVs exchange raw measurements, not estimates. Each receiver linearises them about its own prediction, so that
//! information is counted once, and all agents that received the same messages have bitwise equal team states.
//!
//! Reports and cues are *entries* of a message log that every agent keeps. An entry counts for the time step that it
//! names, whenever it arrives, and counts once, however often it arrives. Any agent may retransmit it to agents that
//! lack it.

use crate::angle::Angle;
use crate::frame::{FARTHEST_M, FASTEST_M_S, FASTEST_RAD_S, Position, Velocity};
use crate::group_id::GroupId;
use crate::priority::PRIORITY;
use crate::sensor::RangeBearingMeasurement;
use crate::time::Time;
use crate::uav::{Aircraft, Command, UavId, UavState};

/// Maximum distance of a new UAV from the team, and of a cue from its UAVs, m: beyond radio range, and further than a
/// UAV flies within a mission.
pub(crate) const TEAM_AREA_M: f64 = 100_000.0;

/// Time after which what contradicts the team counts, s: longer than a sensor, a navigation filter or a sender is usually
/// wrong.
pub(crate) const WRONG_MAX_S: f64 = 6.0;

/// Maximum number of UAVs; reports of more UAVs are rejected. A run with this number and
/// [`TARGETS_MAX`] targets takes 0.4 GB. A message log keeps the reports of many time steps, and accepts fewer UAVs.
pub(crate) const TEAM_MAX: usize = 4_096;

/// Maximum number of targets: as many as fit into a snapshot (`PARTS_MAX`). The same limit holds for the detections of
/// one report and for the cues of one time step.
pub(crate) const TARGETS_MAX: usize = 16_384;

/// Identity of a target as reported by sensors and cue sources that identify targets. It is the same for all of
/// them (assumption of the paper: data association is solved). Inside the team, a target is identified by its
/// [`TrackId`](crate::TrackId).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct TargetLabel(pub u32);

/// Measurements of a UAV's own sensor at one time step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scan<'a> {
    /// Boresight of the sensor; `None` if the sensor did not scan.
    pub boresight: Option<Angle>,
    /// Detected targets.
    pub detections: &'a [Detection],
}

/// Every kind of message.
#[derive(Debug, PartialEq)]
pub enum Message {
    /// State and measurements of a UAV.
    Report(Report),
    /// Target report of a cue source.
    Cue(Cue),
    /// Part of a UAV's team state, for an agent that missed its history.
    Snapshot(SnapshotPart),
    /// Position report of an aircraft outside the team.
    Traffic(TrafficReport),
}

/// Source of log entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MessageSource {
    /// A UAV; it has one report for each time step.
    Uav(UavId),
    /// A cue source, by its own number; its entries are cues.
    CueSource(u32),
}

/// Contiguous range of entries that an agent has received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReceivedRange {
    /// Source of the entries.
    pub source: MessageSource,
    /// First entry. For a UAV, the time step of its report, in periods since [`Time::EPOCH`]; for a cue source, that
    /// number times 65,536 plus the cue's [`sequence`](Cue::sequence).
    pub from: i64,
    /// Last entry, included.
    pub to: i64,
}

/// Status of the sender's message log; teammates compute from it which entries the sender lacks.
#[derive(Debug, Default, PartialEq)]
pub struct LogStatus {
    /// Start time of the sender's team state, or of the state that it adopted. The state that started first wins.
    pub start: Time,
    /// Last committed time step: up to it, the team state cannot change any more, because nothing is missing or the
    /// retention time has passed.
    pub committed_until: Time,
    /// Digest of a team state that is committed.
    pub commit_digest: CommitDigest,
    /// Time step after which `received` lists all entries that the sender has.
    pub listed_after: Time,
    /// Ranges of received entries, sorted by source, then number.
    pub received: Vec<ReceivedRange>,
    /// Last time step with missing messages, at the sender or at a teammate, according to the reports that it has
    /// received.
    pub degraded_at: Time,
    /// Snapshot request of the sender.
    pub snapshot_request: Option<SnapshotRequest>,
}

/// Digest of a committed team state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CommitDigest {
    /// Time step of the team state.
    pub time: Time,
    /// Digest of the team state at that time.
    pub digest: u64,
}

/// Request for a snapshot, from an agent that missed the history of the team.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SnapshotRequest {
    /// Receiver of the request.
    pub receiver: UavId,
    /// Snapshot that has arrived in part; `None` before the first part.
    pub commit_digest: Option<CommitDigest>,
    /// Index of the first missing part.
    pub first_missing_part: u16,
    /// Bit mask of the 64 parts after `first_missing_part` that have arrived; the lowest bit is the part directly after
    /// it.
    pub received_mask: u64,
}

/// Part of a serialised team state. The receiver checks all parts together against the digest before it uses any.
#[derive(Debug, PartialEq)]
pub struct SnapshotPart {
    /// UAV whose team state this is.
    pub uav: UavId,
    /// Start time of that team state.
    pub start: Time,
    /// Digest that identifies the snapshot.
    pub commit_digest: CommitDigest,
    /// Zero-based index of the part.
    pub index: u16,
    /// Number of parts.
    pub count: u16,
    /// Bytes of this part, at most [`SnapshotPart::BYTES_MAX`]; all parts except the last have exactly that number.
    pub bytes: Vec<u8>,
}

impl Default for SnapshotPart {
    fn default() -> Self {
        let (uav, since, commit_digest) = (UavId(0), Time::EPOCH, CommitDigest::default());
        Self { uav, start: since, commit_digest, index: 0, count: 0, bytes: Vec::new() }
    }
}

impl SnapshotPart {
    /// Maximum number of bytes of one part: with its header, it fits into a datagram that no network fragments.
    pub const BYTES_MAX: usize = 512;
}

/// Position report of an aircraft outside the team, an *intruder*. It is not an entry of the message log: no agent
/// retransmits it, and the team state does not contain it. Each UAV avoids the intruders from which it has received
/// reports itself ([`TeamParams::separation`](crate::TeamParams)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrafficReport {
    /// Number of the aircraft; independent of UAV ids.
    pub aircraft: u32,
    /// Time of the state.
    pub time: Time,
    /// State of the aircraft at that time.
    pub state: UavState,
}

/// Measurement of one target in one scan, or a false alarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Sensor-reported identity of the target; `None` if the sensor does not identify targets.
    pub label: Option<TargetLabel>,
    /// Range and bearing from the UAV.
    pub measurement: RangeBearingMeasurement,
    /// Rate of change of the range, due to the motion of both target and UAV, m/s, positive while the range grows;
    /// `None` if it is not measured.
    pub range_rate_m_s: Option<f64>,
}

/// Scan of a UAV's sensor, with the UAV's state at that time step. Of several reports of one UAV and time step, the one
/// that was sent first counts: the lowest restart count, then the lowest sequence number.
#[derive(Debug, PartialEq)]
pub struct Report {
    /// Id of the sender.
    pub uav: UavId,
    /// Restart count of the sender.
    pub restart_count: u32,
    /// Sequence number: increases with every time step of the sender until it restarts.
    pub sequence: u32,
    /// Time of the scan.
    pub time: Time,
    /// State of the sender.
    pub state: UavState,
    /// Boresight of the sensor; `None` if the sensor did not scan.
    pub boresight: Option<Angle>,
    /// Detections, by ascending label without duplicates, then those without label in the order of their bits.
    pub detections: Vec<Detection>,
    /// Assigned group of the sender when it sent the report. Teammates use it even if they have computed
    /// another one.
    pub assigned_group: Option<GroupId>,
    /// True if the sender leaves the team from the next time step.
    pub is_leaving: bool,
    /// Manoeuvre that the sender flies; `None` if it flies its desired command, unless it banks.
    pub manoeuvre: Option<Manoeuvre>,
    /// Status of the sender's message log; `None` in a retransmission.
    pub log_status: Option<Box<LogStatus>>,
}

/// Manoeuvre of a UAV, its intent in reports: what it has flown since its last decision. A UAV that avoids an aircraft
/// keeps to its side until it is clear of it. UAVs that bank always report their command, because their bank angle is
/// on its way to that of the commanded turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manoeuvre {
    /// Aircraft that the UAV avoids; `None` if it flies its desired command.
    pub avoids: Option<Aircraft>,
    /// Command that it flies; in wind relative to the air, or with a geofence over ground.
    pub command: Command,
    /// True if it would turn to the left if the conflict remained, false if to the right.
    pub is_left: bool,
}

/// A number as a receiver reads it that is sent in single precision.
fn single(value: f64) -> f64 {
    f64::from(value as f32)
}

impl Manoeuvre {
    /// The manoeuvre as a receiver reads it: [`wire`](crate::wire) sends the command in single precision.
    pub(crate) fn rounded(self) -> Self {
        let Command { speed_m_s, turn_rate_rad_s } = self.command;
        Self { command: Command { speed_m_s: single(speed_m_s), turn_rate_rad_s: single(turn_rate_rad_s) }, ..self }
    }

    /// True if the command is finite and physically plausible.
    pub(crate) fn is_valid(&self) -> bool {
        self.command.speed_m_s.abs() <= FASTEST_M_S && self.command.turn_rate_rad_s.abs() <= FASTEST_RAD_S
    }

    /// Bits that order manoeuvres.
    pub(crate) fn order(&self) -> (Option<Aircraft>, u64, u64, bool) {
        let Command { speed_m_s, turn_rate_rad_s } = self.command;
        (self.avoids, speed_m_s.to_bits(), turn_rate_rad_s.to_bits(), self.is_left)
    }
}

/// Report of a cue source about a target (the paper assumes that initial target information is given). Of several cues
/// for one target at one time step, the newest counts, and of those the most accurate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cue {
    /// Number of the cue source.
    pub source: u32,
    /// First time step of the team's grid that uses the cue. It should be recent, because agents that received the
    /// cue in time and agents that did not must reach the same result ([`Agent::receive`](crate::Agent::receive)).
    pub issued_at: Time,
    /// Zero-based index among the cues of this source and time step.
    pub sequence: u16,
    /// Identity of the target; `None` if the source does not know it.
    pub label: Option<TargetLabel>,
    /// Time of the position and velocity.
    pub time: Time,
    /// Position of the target.
    pub position: Position,
    /// Velocity of the target.
    pub velocity: Velocity,
    /// Standard deviation of the position per axis, m; above 0.
    pub position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s; above 0.
    pub velocity_sd_m_s: f64,
    /// New priority of the target, in the range [`PRIORITY`]; `None`: it keeps its priority, which is 1 at first.
    pub priority: Option<f64>,
}

#[cfg(test)]
impl Cue {
    /// Cue of a target at rest, at the epoch.
    pub(crate) fn at(label: u32, position: Position) -> Self {
        Self {
            source: 0,
            issued_at: Time::EPOCH,
            sequence: 0,
            label: Some(TargetLabel(label)),
            time: Time::EPOCH,
            position,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
            priority: None,
        }
    }
}

impl Report {
    /// Creates a report that contains only the state of a UAV.
    pub fn position_only(uav: UavId, time: Time, state: UavState) -> Self {
        let (detections, log_status) = (Vec::new(), None);
        let (boresight, assignment, is_leaving) = (None, None, false);
        Self {
            uav,
            restart_count: 0,
            sequence: 0,
            time,
            state,
            boresight,
            detections,
            assigned_group: assignment,
            is_leaving,
            manoeuvre: None,
            log_status,
        }
    }
}

impl Clone for Message {
    fn clone(&self) -> Self {
        match self {
            Self::Report(report) => Self::Report(report.clone()),
            Self::Cue(cue) => Self::Cue(*cue),
            Self::Snapshot(part) => Self::Snapshot(part.clone()),
            Self::Traffic(traffic) => Self::Traffic(*traffic),
        }
    }

    /// Reuses the buffers of the old report.
    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Report(report), Self::Report(source)) => report.clone_from(source),
            (Self::Snapshot(part), Self::Snapshot(source)) => part.clone_from(source),
            (message, source) => *message = source.clone(),
        }
    }
}

impl Clone for Report {
    fn clone(&self) -> Self {
        Self { detections: self.detections.clone(), log_status: self.log_status.clone(), ..*self }
    }

    /// Reuses the buffers of the old lists.
    fn clone_from(&mut self, source: &Self) {
        let (mut detections, mut log_status) = (core::mem::take(&mut self.detections), self.log_status.take());
        detections.clone_from(&source.detections);
        log_status.clone_from(&source.log_status);
        *self = Self { detections, log_status, ..*source };
    }
}

impl Clone for LogStatus {
    fn clone(&self) -> Self {
        Self { received: self.received.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        let mut held = core::mem::take(&mut self.received);
        held.clone_from(&source.received);
        *self = Self { received: held, ..*source };
    }
}

impl Clone for SnapshotPart {
    fn clone(&self) -> Self {
        Self { bytes: self.bytes.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        let mut bytes = core::mem::take(&mut self.bytes);
        bytes.clone_from(&source.bytes);
        *self = Self { bytes, ..*source };
    }
}

impl Message {
    /// Size in the encoding [`wire`](crate::wire), bytes: the load that the message puts on a radio.
    ///
    /// | | bytes |
    /// |---|---|
    /// | report | 84 |
    /// | with altitude and rate of climb | + 16 |
    /// | while the UAV avoids another aircraft, or always if it banks and keeps a minimum separation | + 13 |
    /// | for each detection with label | + 20 |
    /// | for each of them, if one has a range rate | + 4 |
    /// | with detections without label | + 2 |
    /// | for each detection without label | + 12 |
    /// | with the log status | + 50 |
    /// | for each range of received entries | + 13 |
    /// | with a snapshot request | + 29 |
    /// | cue; without label | 79; 75 |
    /// | with a priority | + 9 |
    /// | part of a snapshot with n bytes of the team state | 39 + n |
    /// | traffic; with altitude and rate of climb | 60; 76 |
    pub fn size_bytes(&self) -> usize {
        match self {
            Self::Report(report) => Self::report_size_bytes(report, report.log_status.as_deref()),
            Self::Cue(cue) => Self::cue_size_bytes(cue) - if cue.label.is_none() { 4 } else { 0 },
            Self::Snapshot(part) => 39 + part.bytes.len(),
            Self::Traffic(traffic) => 60 + vertical_size_bytes(&traffic.state),
        }
    }

    /// Size of a cue with a label, bytes.
    pub(crate) fn cue_size_bytes(cue: &Cue) -> usize {
        79 + cue.priority.map_or(0, |_| 9)
    }

    /// Size of a report with or without a log status, bytes.
    pub(crate) fn report_size_bytes(report: &Report, status: Option<&LogStatus>) -> usize {
        let status =
            status.map_or(0, |status| 50 + 13 * status.received.len() + status.snapshot_request.map_or(0, |_| 29));
        let manoeuvre = report.manoeuvre.map_or(0, |_| 13);
        84 + vertical_size_bytes(&report.state) + manoeuvre + detections_size_bytes(&report.detections) + status
    }
}

/// Size of a list of detections without its length, bytes.
fn detections_size_bytes(detections: &[Detection]) -> usize {
    let (labelled, unlabelled) = Detection::split(detections);
    let rates = labelled.iter().any(|detection| detection.range_rate_m_s.is_some());
    let list_bytes = if unlabelled.is_empty() { 0 } else { 2 + 12 * unlabelled.len() };
    (if rates { 24 } else { 20 }) * labelled.len() + list_bytes
}

/// Size of altitude and rate of climb, if included, bytes.
fn vertical_size_bytes(state: &UavState) -> usize {
    state.vertical.map_or(0, |_| 16)
}

impl Cue {
    /// True if every number is finite and possible on Earth, and both standard deviations are positive.
    pub fn is_valid(&self) -> bool {
        let up_to = |most: f64, sd: f64| sd > 0.0 && sd <= most;
        self.position.is_within(FARTHEST_M)
            && self.velocity.is_within(FASTEST_M_S)
            && up_to(FARTHEST_M, self.position_sd_m)
            && up_to(FASTEST_M_S, self.velocity_sd_m_s)
            && self.priority.is_none_or(|priority| PRIORITY.contains(priority))
    }
}

impl Detection {
    /// True if the measurement is possible: finite, with a positive range that exists on Earth, and a plausible range
    /// rate.
    pub fn is_valid(&self) -> bool {
        let RangeBearingMeasurement { range_m, bearing } = self.measurement;
        let is_plausible = |rate_m_s: f64| rate_m_s.abs() <= FASTEST_M_S;
        let has_valid_rate = self.range_rate_m_s.is_none_or(is_plausible);
        range_m > 0.0 && range_m <= FARTHEST_M && bearing.rad().is_finite() && has_valid_rate
    }

    /// True if the range is above a maximum, m.
    pub(crate) fn is_beyond(&self, range_max_m: f64) -> bool {
        self.measurement.range_m > range_max_m
    }

    /// Splits detections in their canonical order into those with and those without label.
    pub(crate) fn split(detections: &[Self]) -> (&[Self], &[Self]) {
        detections.split_at(detections.partition_point(|detection| detection.label.is_some()))
    }

    /// This detection as a receiver reads it: [`wire`](crate::wire) sends range rates, and measurements without label,
    /// in single precision. The sender uses the rounded numbers too, so that all agents compute with the same bits.
    pub(crate) fn rounded(self) -> Self {
        /// Largest number of single precision below pi: the next one would wrap to another bearing.
        const BELOW_PI: f64 = 3.141_592_502_593_994;
        let RangeBearingMeasurement { range_m, bearing } = self.measurement;
        let measurement = match self.label {
            Some(_) => self.measurement,
            None => RangeBearingMeasurement {
                range_m: single(range_m),
                bearing: Angle::from_rad(single(bearing.rad()).clamp(-BELOW_PI, BELOW_PI)),
            },
        };
        Self { measurement, range_rate_m_s: self.range_rate_m_s.map(single), ..self }
    }

    /// Bits that order detections: labels first, then those of the numbers.
    pub(crate) fn order(&self) -> (bool, Option<TargetLabel>, u64, u64, Option<u64>) {
        let RangeBearingMeasurement { range_m, bearing } = self.measurement;
        let rate = self.range_rate_m_s.map(f64::to_bits);
        (self.label.is_none(), self.label, range_m.to_bits(), bearing.rad().to_bits(), rate)
    }
}
