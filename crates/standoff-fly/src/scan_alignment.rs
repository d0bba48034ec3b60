//! Detections of an earlier time, relative to the position of the UAV now.

use standoff::{Detection, Displacement, Position, RangeBearingMeasurement};

/// Returns the detections as seen from `own`, if they were made at `earlier`. The targets' motion in between is
/// neglected. A detection that would be at the UAV itself is dropped.
pub(crate) fn aligned(detections: &[Detection], earlier: Position, own: Position) -> Vec<Detection> {
    let seen = |detection: &Detection| {
        let RangeBearingMeasurement { range_m, bearing } = detection.measurement;
        let to_target = earlier + Displacement::from_polar(range_m, bearing) - own;
        let measurement = RangeBearingMeasurement { range_m: to_target.length_m(), bearing: to_target.direction() };
        (measurement.range_m >= 1.0).then_some(Detection { measurement, ..*detection })
    };
    detections.iter().filter_map(seen).collect()
}
