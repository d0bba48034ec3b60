//! What a team says to one another: what each UAV measured and from where, and the targets handed over to them.
//!
//! UAVs exchange raw measurements, not estimates: a receiver linearises them about its own prediction, so that
//! information is counted once and all who heard the same hold the same picture, to the bit.
//!
//! Reports and cues are *entries* of a log that every agent keeps. An entry counts for the instant that it names, whenever
//! it is heard, once, however often; anybody may say it again for who has not heard it.

use crate::angle::Angle;
use crate::frame::{FARTHEST_M, FASTEST_M_S, Position, Velocity};
use crate::group_id::GroupId;
use crate::sensor::RangeBearing;
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// What a sensor, or who hands a target over, calls that target; the same for all (the paper's assumption: data association
/// is solved). The team's own name for it is its [`TrackId`](crate::TrackId).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct TargetLabel(pub u32);

/// What a UAV's own sensor measured at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scan<'a> {
    /// Where the sensor pointed; `None`: it did not look.
    pub boresight: Option<Angle>,
    /// What it saw.
    pub detections: &'a [Detection],
}

/// Anything that can be said.
#[derive(Debug, PartialEq)]
pub enum Message {
    /// What a UAV measured.
    Report(Report),
    /// A target handed over.
    Cue(Cue),
    /// A piece of what a UAV knows, for who was not there.
    Snapshot(SnapshotPart),
    /// An aircraft that is not of the team tells where it is.
    Traffic(Traffic),
}

/// Whose entries are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Speaker {
    /// A UAV: it has one report of an instant.
    Uav(UavId),
    /// Somebody who hands targets over, by a number of their own: cues.
    Searcher(u32),
}

/// A run of entries that somebody holds without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Held {
    /// Whose.
    pub speaker: Speaker,
    /// The first of them: of a UAV the instant of its report, as a number of periods since [`Time::START`]; of a cue that
    /// number times 65,536, plus its own [`number`](Cue::number).
    pub from: i64,
    /// The last of them.
    pub to: i64,
}

/// What a speaker knows of the team's log, so that teammates can tell what it lacks.
#[derive(Debug, Default, PartialEq)]
pub struct Knowledge {
    /// The instant at which its picture begins, or that of the one it took over: the older picture counts.
    pub since: Time,
    /// The instant up to which its picture cannot change any more: nothing is missing up to there, or it is too late.
    pub committed: Time,
    /// An instant up to there, and what the picture of it was, in one number.
    pub stamp: Stamp,
    /// The instant after which `held` lists all that it holds.
    pub listed_after: Time,
    /// The entries that it holds, by speaker, then number.
    pub held: Vec<Held>,
    /// The last instant of which it knows that words went missing, for it or for others.
    pub disturbed: Time,
    /// The snapshot that it asks for.
    pub asks: Option<Ask>,
}

/// What a committed picture was, in one number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The picture's instant.
    pub time: Time,
    /// Its digest.
    pub digest: u64,
}

/// Who was not there asks for what another knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ask {
    /// Whom.
    pub of: UavId,
    /// The picture, as far as parts of one have come.
    pub stamp: Option<Stamp>,
    /// The first part that is missing.
    pub next: u16,
    /// Which of the 64 after it have come: the lowest bit is the one right after it.
    pub after: u64,
}

/// A piece of a picture as bytes; together they are checked against the digest before anything is believed.
#[derive(Debug, PartialEq)]
pub struct SnapshotPart {
    /// Whose picture.
    pub uav: UavId,
    /// The instant at which that picture began.
    pub since: Time,
    /// Which picture.
    pub stamp: Stamp,
    /// The how many'th piece, from 0.
    pub index: u16,
    /// How many there are.
    pub count: u16,
    /// At most [`SnapshotPart::BYTES_MAX`] of them; all but the last have so many.
    pub bytes: Vec<u8>,
}

impl Default for SnapshotPart {
    fn default() -> Self {
        let (uav, since, stamp) = (UavId(0), Time::START, Stamp::default());
        Self { uav, since, stamp, index: 0, count: 0, bytes: Vec::new() }
    }
}

impl SnapshotPart {
    /// Most bytes of one piece: with its head it fits into a datagram that no network cuts.
    pub const BYTES_MAX: usize = 512;
}

/// An aircraft that is not of the team, an *intruder*, and where it says that it is. No entry of the log: nobody says it again,
/// and no picture knows of it. Each UAV keeps away from those that it has heard of itself
/// ([`TeamParams::separation`](crate::TeamParams)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traffic {
    /// Which, by a number of its own: not a UAV's id.
    pub aircraft: u32,
    /// When it was there.
    pub time: Time,
    /// Where it was, and how it flew.
    pub state: UavState,
}

/// One target in one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Which target.
    pub label: TargetLabel,
    /// Where it was seen from the UAV.
    pub measurement: RangeBearing,
}

/// One scan of a UAV's sensor, and the UAV's state at that instant. Of several of one UAV and instant the one said first
/// counts: that of the lowest epoch, and in it the lowest sequence.
#[derive(Debug, PartialEq)]
pub struct Report {
    /// Who speaks.
    pub uav: UavId,
    /// Counts the speaker's restarts.
    pub epoch: u32,
    /// Grows with every instant of the speaker within an epoch.
    pub sequence: u32,
    /// When the scan was made.
    pub time: Time,
    /// Where the speaker was.
    pub state: UavState,
    /// Where its sensor pointed.
    pub boresight: Option<Angle>,
    /// What it saw, by ascending label, no label twice.
    pub detections: Vec<Detection>,
    /// The group that it served when it spoke: what it does, whatever others believe that it does.
    pub duty: Option<GroupId>,
    /// From the next instant on it is not to be counted on.
    pub leaves: bool,
    /// What it has heard and knows; `None` where its report is said again.
    pub knowledge: Option<Box<Knowledge>>,
}

/// A target handed over by somebody who searches (the paper assumes that initial target information is given). Of several
/// of one target at one instant the newest counts, and of those the surest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cue {
    /// Who hands it over, by a number of their own.
    pub searcher: u32,
    /// The instant of the team's grid from which it counts; not long ago, for who was told in time and who was not must
    /// come to the same ([`Agent::hear`](crate::Agent::hear)).
    pub said: Time,
    /// The how many'th of this searcher and instant.
    pub number: u16,
    /// Which target.
    pub label: TargetLabel,
    /// When it was there.
    pub time: Time,
    /// Where it was.
    pub position: Position,
    /// How it moved.
    pub velocity: Velocity,
    /// Standard deviation of the position per axis, m; above 0.
    pub position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s; above 0.
    pub velocity_sd_m_s: f64,
}

impl Report {
    /// A report that says where a UAV is, and nothing else.
    pub fn of(uav: UavId, time: Time, state: UavState) -> Self {
        let (detections, knowledge) = (Vec::new(), None);
        let (boresight, duty, leaves) = (None, None, false);
        Self { uav, epoch: 0, sequence: 0, time, state, boresight, detections, duty, leaves, knowledge }
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

    /// A report takes the room of an older one.
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
        Self { detections: self.detections.clone(), knowledge: self.knowledge.clone(), ..*self }
    }

    /// Lists take the room of older ones.
    fn clone_from(&mut self, source: &Self) {
        let (mut detections, mut knowledge) = (core::mem::take(&mut self.detections), self.knowledge.take());
        detections.clone_from(&source.detections);
        knowledge.clone_from(&source.knowledge);
        *self = Self { detections, knowledge, ..*source };
    }
}

impl Clone for Knowledge {
    fn clone(&self) -> Self {
        Self { held: self.held.clone(), ..*self }
    }

    fn clone_from(&mut self, source: &Self) {
        let mut held = core::mem::take(&mut self.held);
        held.clone_from(&source.held);
        *self = Self { held, ..*source };
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
    /// Its size in the encoding of the example `companion`, bytes: what a radio that carries it has to carry.
    ///
    /// | | bytes |
    /// |---|---|
    /// | every message: what it is, 3; checksum, 4 | 7 |
    /// | report: who and when, 18; state and boresight, 48; duty, 8; flags, 1; number of detections, 2 | 77 |
    /// | altitude and rate of climb, where they are told | 16 |
    /// | each detection: label, range, bearing | 20 |
    /// | knowledge, where it is told: times, 32; stamp, 16; number of runs, 2 | 50 |
    /// | each run of entries held | 13 |
    /// | a request for a snapshot: whom, 2; stamp, 17; parts, 10 | 29 |
    /// | cue | 72 |
    /// | part of a snapshot: head, 32; and its bytes | 32 + n |
    /// | traffic: which and when, 12; state, 40; flags, 1; altitude and rate of climb as above | 53 |
    pub fn size_bytes(&self) -> usize {
        match self {
            Self::Report(report) => Self::report_size_bytes(report, report.knowledge.as_deref()),
            Self::Cue(_) => Self::CUE_SIZE_BYTES,
            Self::Snapshot(part) => 39 + part.bytes.len(),
            Self::Traffic(traffic) => 60 + vertical_size_bytes(&traffic.state),
        }
    }

    pub(crate) const CUE_SIZE_BYTES: usize = 79;

    /// That of a report, told with what its speaker knows or without.
    pub(crate) fn report_size_bytes(report: &Report, told: Option<&Knowledge>) -> usize {
        let told = told.map_or(0, |told| 50 + 13 * told.held.len() + told.asks.map_or(0, |_| 29));
        84 + vertical_size_bytes(&report.state) + 20 * report.detections.len() + told
    }
}

/// Of altitude and rate of climb, where they are told.
fn vertical_size_bytes(state: &UavState) -> usize {
    state.vertical.map_or(0, |_| 16)
}

impl Cue {
    /// Every number is finite, none is beyond what there is on Earth, and both standard deviations are positive.
    pub fn is_sound(&self) -> bool {
        let up_to = |most: f64, sd: f64| sd > 0.0 && sd <= most;
        self.position.is_within(FARTHEST_M)
            && self.velocity.is_within(FASTEST_M_S)
            && up_to(FARTHEST_M, self.position_sd_m)
            && up_to(FASTEST_M_S, self.velocity_sd_m_s)
    }
}

impl Detection {
    /// A measurement that a sensor can make: finite, with a positive range that there is on Earth.
    pub fn is_sound(&self) -> bool {
        let RangeBearing { range_m, bearing } = self.measurement;
        range_m > 0.0 && range_m <= FARTHEST_M && bearing.rad().is_finite()
    }
}
