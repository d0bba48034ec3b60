//! Detections of an earlier time, moved to the time and position of the UAV now.

use standoff::{Detection, Displacement, Position, RangeBearingMeasurement, TargetLabel, Velocity};

/// Longest motion of a target that is added, s. Longer ones would feed errors of the velocity back into the estimate.
const MOTION_MAX_S: f64 = 0.3;

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
        let moved = detection.label.and_then(&velocity_of).unwrap_or(Velocity::ZERO) * age_s.clamp(0.0, MOTION_MAX_S);
        let to_target = earlier + Displacement::from_polar(range_m, bearing) + moved - own;
        let measurement = RangeBearingMeasurement { range_m: to_target.length_m(), bearing: to_target.direction() };
        (measurement.range_m >= 1.0).then_some(Detection { measurement, ..*detection })
    };
    detections.iter().filter_map(seen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::Angle;

    /// 0.2 s ago, 10 m further west, a target was seen 100 m to the north.
    #[test]
    fn a_detection_moves_with_the_uav_and_its_target() {
        let measurement = RangeBearingMeasurement { range_m: 100.0, bearing: Angle::from_deg(90.0) };
        let detection = Detection { label: Some(TargetLabel(1)), measurement, range_rate_m_s: None };
        let seen = |age_s, velocity: Option<Velocity>| {
            let own = Position::from_m(10.0, 0.0);
            let [seen] = aligned(&[detection], Position::ORIGIN, own, age_s, |_| velocity)[..] else { panic!() };
            let RangeBearingMeasurement { range_m, bearing } = seen.measurement;
            own + Displacement::from_polar(range_m, bearing)
        };
        let eastward = Some(Velocity::from_m_s(20.0, 0.0));
        for (age_s, velocity, x_m) in [(0.2, None, 0.0), (0.2, eastward, 4.0), (5.0, eastward, 6.0)] {
            assert!(seen(age_s, velocity).distance_m(Position::from_m(x_m, 100.0)) < 1e-9, "{age_s} s");
        }
    }
}
