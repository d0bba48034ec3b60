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
    /// Reports that count.
    fn plausible(&self) -> impl Iterator<Item = &'a Report> + use<'a> {
        let implausible = self.implausible;
        self.reports.iter().filter(move |report| implausible.is_empty() || !implausible.contains(&report.uav))
    }

    /// True if a sensor had the position in view, with a clearance to the edge of its field of view, m.
    pub(crate) fn have_in_view(&self, position: Position, clearance_m: f64) -> bool {
        self.plausible().any(|report| {
            report.boresight.is_some_and(|boresight| {
                self.sensor.in_view_with_clearance(report.state.position, boresight, position, clearance_m)
            })
        })
    }
}

/// A detection and the position of the UAV that made it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocatedDetection {
    pub(crate) label: TargetLabel,
    pub(crate) uav_position: Position,
    pub(crate) measurement: RangeBearingMeasurement,
}

/// A detection that belongs to a track.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WeightedDetection {
    pub(crate) track_index: usize,
    /// Probability that the detection is of the track's target, 0 to 1.
    pub(crate) weight: f64,
    pub(crate) detection: LocatedDetection,
}

/// Result of an association; the buffers are reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Association {
    /// Detections of tracks that are not lost. Those of one track are in the order of the UAVs.
    pub(crate) weighted: Vec<WeightedDetection>,
    /// Detections of no such track, by label, then UAV.
    pub(crate) unassociated: Vec<LocatedDetection>,
}

impl Association {
    /// Detections of a target that has no track, or a lost one, in the order of the UAVs.
    pub(crate) fn unassociated_of(
        &self,
        label: TargetLabel,
    ) -> impl Iterator<Item = (Position, RangeBearingMeasurement)> {
        let start = self.unassociated.partition_point(|other| other.label < label);
        let of_one_target = self.unassociated[start..].iter().take_while(move |other| other.label == label);
        of_one_target.map(|detection| (detection.uav_position, detection.measurement))
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
    for report in scans.plausible() {
        let mut next = 0;
        for detection in &report.detections {
            let id = TrackId::from_label(detection.label);
            // Most UAVs detect one target after the other.
            let is_next = tracks.rows().get(next).is_some_and(|row| row.track().id == id);
            let track_index = if is_next { Ok(next) } else { tracks.index(id) };
            next = track_index.map_or(next, |track_index| track_index + 1);
            let detection = LocatedDetection {
                label: detection.label,
                uav_position: report.state.position,
                measurement: detection.measurement,
            };
            match track_index {
                Ok(track_index) if !tracks.rows()[track_index].track().is_lost() => {
                    weighted.push(WeightedDetection { track_index, weight: 1.0, detection });
                }
                _ => unassociated.push(detection),
            }
        }
    }
    // Stable: the detections of one target stay in the order of the UAVs.
    unassociated.sort_by_key(|detection| detection.label);
}
