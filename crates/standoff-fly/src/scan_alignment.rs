//! Detections of an earlier time, moved to the time and position of the UAV now.

use standoff::{Detection, Displacement, Position, RangeBearingMeasurement, TargetLabel, Velocity};

/// Returns the detections as seen from `own` now, if they were made at `earlier`, `age_s` seconds ago. `velocity_of` gives
/// the estimated velocity of a target; without one, the target's motion in between is neglected. A detection that would
/// be at the UAV itself is dropped.
pub(crate) fn aligned(
    detections: &[Detection],
    earlier: Position,
    own: Position,
    age_s: f64,
    velocity_of: impl Fn(TargetLabel) -> Option<Velocity>,
) -> Vec<Detection> {
    let seen = |detection: &Detection| {
        let RangeBearingMeasurement { range_m, bearing } = detection.measurement;
        let moved = detection.label.and_then(&velocity_of).unwrap_or(Velocity::ZERO) * age_s;
        let to_target = earlier + Displacement::from_polar(range_m, bearing) + moved - own;
        let measurement = RangeBearingMeasurement { range_m: to_target.length_m(), bearing: to_target.direction() };
        (measurement.range_m >= 1.0).then_some(Detection { measurement, ..*detection })
    };
    detections.iter().filter_map(seen).collect()
}
