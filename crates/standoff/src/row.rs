//! What was said of one instant: at most one report of each UAV, and cues; each counted once.
//!
//! Of several reports of one UAV one counts, that which was said first, whichever is heard first; so whoever has heard the
//! same entries holds the same row.

use core::cmp::Ordering;

use crate::coordination::group_id::GroupId;
use crate::message::{Cue, Detection, Report, Scan};
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// More UAVs than this at a time are not listened to: a team is a few.
pub(crate) const TEAM_MAX: usize = 256;

/// More cues than this of one instant are not listened to.
const CUES_MAX: usize = 65_536;

/// What became of something heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Put {
    /// It counts; it was not known.
    New,
    /// It says nothing new.
    Known,
    /// It makes no sense, or another one of the same speaker counts.
    Refused,
    /// It counts in the place of another one, which does not any more.
    Instead,
}

/// What a UAV says of an instant, wherever its parts are kept.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Said<'a> {
    pub(crate) uav: UavId,
    /// Epoch and sequence.
    pub(crate) stamp: (u32, u32),
    pub(crate) state: &'a UavState,
    pub(crate) scan: Scan<'a>,
    pub(crate) duty: Option<GroupId>,
    pub(crate) leaves: bool,
}

impl<'a> Said<'a> {
    pub(crate) fn of(report: &'a Report) -> Self {
        let Report { uav, epoch, sequence, ref state, boresight, ref detections, duty, leaves, .. } = *report;
        Self { uav, stamp: (epoch, sequence), state, scan: Scan { boresight, detections }, duty, leaves }
    }
}

/// The entries of an instant.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    /// The instant.
    pub(crate) time: Time,
    /// By ascending UAV.
    reports: Vec<Report>,
    /// By ascending label; of one target the one that counts first.
    cues: Vec<Cue>,
    /// Room of older reports.
    spare: Vec<Report>,
}

impl Row {
    /// Turns to another instant, of which nothing is known yet.
    pub(crate) fn open(&mut self, time: Time) {
        self.time = time;
        self.cues.clear();
        self.spare.append(&mut self.reports);
    }

    /// The reports, by ascending UAV.
    pub(crate) fn reports(&self) -> &[Report] {
        &self.reports
    }

    /// The report of a UAV.
    pub(crate) fn report_of(&self, uav: UavId) -> Option<&Report> {
        self.reports.binary_search_by_key(&uav, |report| report.uav).ok().map(|index| &self.reports[index])
    }

    /// The cues, by ascending label; of several of one target the first counts.
    pub(crate) fn cues(&self) -> &[Cue] {
        &self.cues
    }

    /// Takes a report in.
    pub(crate) fn put(&mut self, said: Said) -> Put {
        let Said { uav, stamp, state, scan, duty, leaves } = said;
        if !state.is_finite() || scan.boresight.is_some_and(|angle| !angle.rad().is_finite()) {
            return Put::Refused;
        }
        let (index, put) = match self.reports.binary_search_by_key(&uav, |report| report.uav) {
            Ok(index) => {
                let known = &self.reports[index];
                match stamp.cmp(&(known.epoch, known.sequence)) {
                    Ordering::Equal => return Put::Known,
                    Ordering::Greater => return Put::Refused,
                    Ordering::Less => (index, Put::Instead),
                }
            }
            Err(_) if self.reports.len() >= TEAM_MAX => return Put::Refused,
            Err(index) => {
                let report = self.spare.pop().unwrap_or_else(|| Report::of(uav, self.time, *state));
                // So that to open the row again takes no more room.
                self.spare.reserve(self.reports.len() + 1);
                self.reports.insert(index, report);
                (index, Put::New)
            }
        };
        let report = &mut self.reports[index];
        let mut detections = core::mem::take(&mut report.detections);
        keep_sound(scan.detections, &mut detections);
        (report.uav, report.time, report.state, report.boresight) = (uav, self.time, *state, scan.boresight);
        (report.epoch, report.sequence) = stamp;
        (report.detections, report.duty, report.leaves) = (detections, duty, leaves);
        put
    }

    /// Takes a cue in.
    pub(crate) fn put_cue(&mut self, cue: &Cue) -> Put {
        let is_same = |known: &Cue| (known.searcher, known.number) == (cue.searcher, cue.number);
        if !cue.is_sound() || cue.time > self.time || self.cues.len() >= CUES_MAX {
            return Put::Refused;
        }
        let mut put = Put::New;
        let first = self.cues.partition_point(|known| known.label < cue.label);
        let of_target = self.cues[first..].iter().take_while(|known| known.label == cue.label);
        if let Some(index) = of_target.into_iter().position(is_same).map(|index| first + index) {
            match counting_order(cue, &self.cues[index]) {
                Ordering::Equal => return Put::Known,
                Ordering::Greater => return Put::Refused,
                Ordering::Less => put = Put::Instead,
            }
            self.cues.remove(index);
        }
        let place = self.cues.partition_point(|known| counting_order(known, cue).is_lt());
        self.cues.insert(place, *cue);
        put
    }
}

/// Makes `kept` what is sound of a scan, by ascending label, no label twice.
fn keep_sound(detections: &[Detection], kept: &mut Vec<Detection>) {
    kept.clear();
    kept.extend_from_slice(detections);
    if !kept.iter().all(Detection::is_sound) {
        kept.retain(Detection::is_sound);
    }
    if !kept.is_sorted_by(|a, b| a.label < b.label) {
        kept.sort_by_key(|detection| detection.label);
        kept.dedup_by_key(|detection| detection.label);
    }
}

/// By label; of one target the newest, of those the surest; then any order that all share.
fn counting_order(cue: &Cue, other: &Cue) -> Ordering {
    let numbers = |cue: &Cue| {
        let Cue { position, velocity, position_sd_m, velocity_sd_m_s, .. } = *cue;
        [position_sd_m, velocity_sd_m_s, position.x_m(), position.y_m(), velocity.x_m_s(), velocity.y_m_s()]
    };
    let mut pairs = numbers(cue).into_iter().zip(numbers(other));
    let by_numbers = pairs.find_map(|(a, b)| Some(a.total_cmp(&b)).filter(|order| order.is_ne()));
    let by_name = (cue.searcher, cue.number).cmp(&(other.searcher, other.number));
    (cue.label.cmp(&other.label))
        .then(other.time.cmp(&cue.time))
        .then(by_numbers.unwrap_or(Ordering::Equal))
        .then(by_name)
}
