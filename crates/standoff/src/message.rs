//! What a team says to one another: what each UAV measured and from where, and the targets handed over to them.
//!
//! UAVs exchange raw measurements, not estimates: a receiver linearises them about its own prediction, so that
//! information is counted once and all who heard the same hold the same picture, to the bit.

use crate::angle::Angle;
use crate::frame::{Position, Velocity};
use crate::sensor::RangeBearing;
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// What a sensor, or who hands a target over, calls that target; the same for all (the paper's assumption: data association
/// is solved). The team's own name for it is its [`TrackId`](crate::TrackId).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
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
}

/// A target handed over by somebody who searches (the paper assumes that initial target information is given). Of several
/// of one target, heard at one instant, the newest counts, and of those the surest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cue {
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

impl Clone for Message {
    fn clone(&self) -> Self {
        match self {
            Self::Report(report) => Self::Report(report.clone()),
            Self::Cue(cue) => Self::Cue(*cue),
        }
    }

    /// A report takes the room of an older one.
    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Report(report), Self::Report(source)) => report.clone_from(source),
            (message, source) => *message = source.clone(),
        }
    }
}

impl Clone for Report {
    fn clone(&self) -> Self {
        Self { detections: self.detections.clone(), ..*self }
    }

    /// The detections take the room of older ones.
    fn clone_from(&mut self, source: &Self) {
        let mut detections = core::mem::take(&mut self.detections);
        detections.clone_from(&source.detections);
        *self = Self { detections, ..*source };
    }
}

impl Cue {
    /// Every number is finite and both standard deviations are positive.
    pub fn is_sound(&self) -> bool {
        let positive = |sd: f64| sd.is_finite() && sd > 0.0;
        self.position.is_finite()
            && self.velocity.is_finite()
            && positive(self.position_sd_m)
            && positive(self.velocity_sd_m_s)
    }
}

impl Detection {
    /// A measurement that a sensor can make: finite, with a positive range.
    pub fn is_sound(&self) -> bool {
        let RangeBearing { range_m, bearing } = self.measurement;
        // What is not finite in a sum stays so, and an angle is too small to make it so.
        range_m > 0.0 && (range_m + bearing.rad()).is_finite()
    }
}
