//! Data association: which detection belongs to which track.

use crate::frame::Position;
use crate::message::{Report, TargetLabel};
use crate::params::SensorParams;
use crate::sensor::RangeBearingMeasurement;
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

    /// Label of a detection.
    pub(crate) fn label(&self, index: DetectionIndex) -> TargetLabel {
        self.reports[index.report].detections[index.detection].label
    }

    /// Measurement of a detection, and the position of the UAV that made it.
    pub(crate) fn measurement(&self, index: DetectionIndex) -> (Position, RangeBearingMeasurement) {
        let report = &self.reports[index.report];
        (report.state.position, report.detections[index.detection].measurement)
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
        label: TargetLabel,
        scans: &Scans,
    ) -> impl Iterator<Item = (Position, RangeBearingMeasurement)> {
        let start = self.unassociated.partition_point(|index| scans.label(*index) < label);
        let of_one_target = self.unassociated[start..].iter().take_while(move |index| scans.label(**index) == label);
        of_one_target.map(|index| scans.measurement(*index))
    }
}

/// Associates the detections of all scans with the predicted tracks.
///
/// Each detection carries the label of its target (assumption of the paper: data association is solved), so that every
/// weight is 1.
pub(crate) fn associate<R: TrackRow>(tracks: &TrackTable<R>, scans: &Scans, result: &mut Association) {
    let Association { weighted, unassociated } = result;
    weighted.clear();
    unassociated.clear();
    for (report_index, report) in scans.plausible() {
        let mut next = 0;
        for (detection_index, detection) in report.detections.iter().enumerate() {
            let id = TrackId::from_label(detection.label);
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
    unassociated.sort_by_key(|index| scans.label(*index));
}
