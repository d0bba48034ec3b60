//! Association by label: which detection belongs to which track. [`unlabelled`](super::unlabelled) associates detections
//! without label.

use crate::frame::Position;
use crate::message::{Detection, Report};
use crate::params::SensorParams;
use crate::sensor::RangeBearingMeasurement;
use crate::tracking::scan_model::ScanModel;
use crate::tracking::track::TrackId;
use crate::tracking::track_table::{TrackRow, TrackTable};
use crate::uav::UavId;

/// Scans of all UAVs at one time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scans<'a> {
    pub(crate) sensor: &'a SensorParams,
    /// Reports by ascending UAV; each contains a scan.
    pub(crate) reports: &'a [Report],
    /// UAVs whose reports do not count; usually empty.
    pub(crate) implausible: &'a [UavId],
}

impl<'a> Scans<'a> {
    /// Reports that count, with their indices.
    fn plausible(&self) -> impl Iterator<Item = (usize, &'a Report)> + use<'a> {
        let implausible = self.implausible;
        let counts = move |report: &Report| implausible.is_empty() || !implausible.contains(&report.uav);
        self.reports.iter().enumerate().filter(move |(_, report)| counts(report))
    }

    /// Track that a detection with label belongs to; `None` without label.
    pub(crate) fn track_id(&self, index: DetectionIndex) -> Option<TrackId> {
        self.detection(index).label.map(TrackId::from)
    }

    fn detection(&self, index: DetectionIndex) -> &'a Detection {
        &self.reports[index.report].detections[index.detection]
    }

    /// True if a sensor reported detections without label.
    pub(crate) fn have_unlabelled(&self) -> bool {
        self.plausible().any(|(_, report)| report.detections.last().is_some_and(|last| last.label.is_none()))
    }

    /// Scans with their detections without label, in the order of the UAVs.
    pub(crate) fn unlabelled(&self) -> impl Iterator<Item = (UavId, ScanModel<'a>, &'a [Detection])> {
        let sensor = self.sensor;
        self.plausible().filter_map(move |(_, report)| {
            let model = ScanModel::new(sensor, report)?;
            Some((report.uav, model, Detection::split(&report.detections).1))
        })
    }

    /// Measurement of a detection, and the position of the UAV that made it.
    pub(crate) fn measurement(&self, index: DetectionIndex) -> (Position, RangeBearingMeasurement) {
        (self.reports[index.report].state.position, self.detection(index).measurement)
    }

    /// A detection with range rate, and the sensor model of its scan.
    pub(crate) fn with_range_rate(&self, index: DetectionIndex) -> Option<(ScanModel<'a>, &'a Detection)> {
        let detection = self.detection(index);
        detection.range_rate_m_s?;
        Some((ScanModel::new(self.sensor, &self.reports[index.report])?, detection))
    }

    /// True if a sensor had the position in view, with a clearance to the edge of its field of view, m.
    pub(crate) fn have_in_view(&self, position: Position, clearance_m: f64) -> bool {
        self.plausible().any(|(_, report)| {
            report.boresight.is_some_and(|boresight| {
                self.sensor.in_view_with_clearance(report.state.position, boresight, position, clearance_m)
            })
        })
    }
}

/// Place of a detection: the index of its report in [`Scans::reports`], and its own index in the report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DetectionIndex {
    report: usize,
    detection: usize,
}

/// Result of an association; the buffers are reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Association {
    /// Detections of tracks that are not lost, each with the index of the track and the probability that it is of the
    /// track's target, 0 to 1. Those of one track are in the order of the UAVs.
    pub(crate) weighted: Vec<(usize, f64, DetectionIndex)>,
    /// Detections of no such track, by label, then UAV.
    pub(crate) unassociated: Vec<DetectionIndex>,
}

impl Association {
    /// Detections of a target that has no track, or a lost one, in the order of the UAVs.
    pub(crate) fn unassociated_of(
        &self,
        track: TrackId,
        scans: &Scans,
    ) -> impl Iterator<Item = (Position, RangeBearingMeasurement)> {
        let start = self.unassociated.partition_point(|index| scans.track_id(*index) < Some(track));
        let of_one_target =
            self.unassociated[start..].iter().take_while(move |index| scans.track_id(**index) == Some(track));
        of_one_target.map(|index| scans.measurement(*index))
    }
}

/// Associates the detections with label of all scans with the predicted tracks.
///
/// Each carries the label of its target (assumption of the paper: data association is solved), so that every
/// weight is 1.
pub(crate) fn associate<R: TrackRow>(tracks: &TrackTable<R>, scans: &Scans, result: &mut Association) {
    let Association { weighted, unassociated } = result;
    weighted.clear();
    unassociated.clear();
    for (report_index, report) in scans.plausible() {
        let mut next = 0;
        for (detection_index, detection) in report.detections.iter().enumerate() {
            let Some(id) = detection.label.map(TrackId::from) else { break };
            // Most UAVs detect one target after the other.
            let is_next = tracks.rows().get(next).is_some_and(|row| row.track().id == id);
            let track_index = if is_next { Ok(next) } else { tracks.index(id) };
            next = track_index.map_or(next, |track_index| track_index + 1);
            let index = DetectionIndex { report: report_index, detection: detection_index };
            match track_index {
                Ok(track_index) if !tracks.rows()[track_index].track().is_lost() => {
                    weighted.push((track_index, 1.0, index));
                }
                _ => unassociated.push(index),
            }
        }
    }
    // Stable: the detections of one target stay in the order of the UAVs.
    unassociated.sort_by_key(|index| scans.track_id(*index));
}
