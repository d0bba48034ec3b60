//! Detections of an earlier time, relative to the position of the UAV now.

use standoff::research::math;
use standoff::{Detection, Position, RangeBearingMeasurement};

/// Returns the detections as seen from `own`, if they were made at `earlier`. The targets' motion in between is
/// neglected. A detection that would be at the UAV itself is dropped.
pub(crate) fn aligned(detections: &[Detection], earlier: Position, own: Position) -> Vec<Detection> {
    let seen = |detection: &Detection| {
        let RangeBearingMeasurement { range_m, bearing } = detection.measurement;
        let (sin, cos) = math::sin_cos(bearing.rad());
        let target = Position::from_m(earlier.x_m() + range_m * cos, earlier.y_m() + range_m * sin);
        let to_target = target - own;
        let measurement = RangeBearingMeasurement { range_m: to_target.length_m(), bearing: to_target.direction() };
        (measurement.range_m >= 1.0).then_some(Detection { measurement, ..*detection })
    };
    detections.iter().filter_map(seen).collect()
}
