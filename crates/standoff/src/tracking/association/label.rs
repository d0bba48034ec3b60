//! Association by label: which detection belongs to which track. [`joint`](super::joint) associates detections without
//! label.

use crate::frame::Position;
use crate::sensor::RangeBearingMeasurement;
use crate::tracking::input::{DetectionIndex, Scans};
use crate::tracking::track::TrackId;
use crate::tracking::track_table::{TrackRow, TrackTable};

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
