//! Information of a pair of UAVs about one target, and the phase difference that maximises it (36).
//!
//! ```text
//! eta = a (b_1 + b_2)(1 + cos^2 gamma) + (a^2 + b_1 b_2) sin^2 gamma                     Eq. (36)
//! a = 1 / sigma_r^2        b_i = 1 / (r_i sigma_theta)^2
//! d eta / d(cos^2 gamma) = -(a - b_1)(a - b_2)
//! ```
//!
//! gamma is the angle at the target between the two lines of sight. For a target at the centre of an orbit it is the
//! phase difference of the UAVs. Range and bearing are equally accurate at r* = sigma_r / sigma_theta. At shorter
//! ranges the bearing is more accurate, at longer ranges the range. Therefore 90 degrees is optimal if both UAVs are on
//! the same side of r*, and 0 or 180 degrees if they are on different sides. At r* the angle does not matter.

use crate::angle::Angle;
use crate::frame::Position;
use crate::math;
use crate::params::{RANGE_MIN_M, SensorParams};

/// Determinant of the joint information of two UAVs at these ranges about a target's position, 1/m4.
/// `phase_difference_rad` is the angle gamma at the target. A UAV closer than `RANGE_MIN_M` gives no information.
///
/// Implements Eq. (36).
#[doc(alias = "eta_D")]
pub fn pair_information_1_m4(ranges_m: [f64; 2], phase_difference_rad: f64, sensor: &SensorParams) -> f64 {
    let [(a_1, b_1), (a_2, b_2)] = ranges_m.map(|range_m| along_and_across(range_m, sensor));
    let cos = math::cos(phase_difference_rad);
    let cos2 = cos * cos;
    a_1 * b_1 + a_2 * b_2 + (a_1 * b_2 + a_2 * b_1) * cos2 + (a_1 * a_2 + b_1 * b_2) * (1.0 - cos2)
}

/// Like [`pair_information_1_m4`], from the positions of the UAVs and the target.
pub fn pair_information_at_1_m4(uavs: [Position; 2], target: Position, sensor: &SensorParams) -> f64 {
    let [first, second] = uavs.map(|uav| target - uav);
    let difference: Angle = second.direction() - first.direction();
    pair_information_1_m4([first.length_m(), second.length_m()], difference.rad(), sensor)
}

/// Range at which range and bearing measurements are equally accurate, r* = sigma_r / sigma_theta, m.
pub fn equal_accuracy_range_m(sensor: &SensorParams) -> f64 {
    sensor.range_sd_m / sensor.bearing_sd_rad
}

/// Optimal angle gamma in [0, pi/2] for two UAVs at these ranges, rad. It is pi/2 if both are nearer or both further
/// than [`equal_accuracy_range_m`], and 0 (equivalent to pi) if they are on different sides. `None` if the angle does
/// not matter because one UAV is at that range or directly above the target.
pub fn optimal_phase_difference_rad(ranges_m: [f64; 2], sensor: &SensorParams) -> Option<f64> {
    let [first, second] = ranges_m.map(|range_m| {
        let (along, across) = along_and_across(range_m, sensor);
        along - across
    });
    match first * second {
        gain if gain > 0.0 => Some(0.5 * math::PI),
        gain if gain < 0.0 => Some(0.0),
        _ => None,
    }
}

/// Information of one measurement along and across the line of sight: a and b_i, 1/m2.
fn along_and_across(range_m: f64, sensor: &SensorParams) -> (f64, f64) {
    if range_m.is_nan() || range_m < RANGE_MIN_M {
        return (0.0, 0.0);
    }
    let across_sd_m = range_m * sensor.bearing_sd_rad;
    (1.0 / (sensor.range_sd_m * sensor.range_sd_m), 1.0 / (across_sd_m * across_sd_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Displacement;
    use proptest::prelude::*;

    /// Table I's sensor.
    fn sensor() -> SensorParams {
        crate::params::TeamParams::paper().track.sensor
    }

    proptest! {
        /// Checks Eq. (36): the closed form is the determinant of the sum of the two matrices (31), and its slope over
        /// cos^2 is -(a - b_1)(a - b_2).
        #[test]
        fn the_closed_form_is_the_determinant_of_the_sum(
            r_1 in 2.0..1500.0f64, r_2 in 2.0..1500.0f64, bearing_deg in -180.0..180.0f64, gamma_deg in -180.0..180.0f64,
        ) {
            let sensor = sensor();
            let uav = |range_m, deg| Position::from_m(7.0, -3.0) + Displacement::from_polar(range_m, Angle::from_deg(deg));
            let uavs = [uav(r_1, bearing_deg), uav(r_2, bearing_deg + gamma_deg)];
            let target = Position::from_m(7.0, -3.0);
            let sum = sensor.information(uavs[0], target) + sensor.information(uavs[1], target);
            let numeric = sum.determinant();
            let size = sum.trace() * sum.trace();
            let closed = pair_information_1_m4([r_1, r_2], gamma_deg.to_radians(), &sensor);
            prop_assert!((closed - numeric).abs() < 1e-12 * size, "{closed} {numeric}");
            prop_assert!((pair_information_at_1_m4(uavs, target, &sensor) - closed).abs() < 1e-12 * size);
            let (a, b) = (0.01, [r_1, r_2].map(|r| 1.0 / (r * sensor.bearing_sd_rad * (r * sensor.bearing_sd_rad))));
            let rise = pair_information_1_m4([r_1, r_2], 0.0, &sensor)
                - pair_information_1_m4([r_1, r_2], 0.5 * math::PI, &sensor);
            prop_assert!((rise + (a - b[0]) * (a - b[1])).abs() < 1e-12 * size);
        }
    }

    /// Checks Eq. (36): with Table I range and bearing are equally accurate at 191 m. 90 degrees is optimal if both
    /// UAVs are on the same side of it, 0 degrees otherwise; a search over the angles confirms it.
    #[test]
    fn a_right_angle_is_optimal_only_if_both_uavs_are_on_the_same_side_of_the_even_range() {
        let sensor = sensor();
        assert!((equal_accuracy_range_m(&sensor) - 190.986).abs() < 1e-3);
        for (ranges_m, best_deg) in
            [([100.0, 150.0], 90.0), ([250.0, 700.0], 90.0), ([150.0, 400.0], 0.0), ([700.0, 100.0], 0.0)]
        {
            let best = optimal_phase_difference_rad(ranges_m, &sensor).unwrap();
            assert!((best.to_degrees() - best_deg).abs() < 1e-9, "{ranges_m:?}");
            let eta = |deg: f64| pair_information_1_m4(ranges_m, deg.to_radians(), &sensor);
            assert!((0..=90).all(|deg| eta(f64::from(deg)) <= eta(best_deg)), "{ranges_m:?}");
            assert!((eta(180.0 - best_deg) - eta(best_deg)).abs() < 1e-12 * eta(best_deg));
        }
    }

    #[test]
    fn the_angle_does_not_matter_at_the_even_range_or_directly_above() {
        // With these numbers both accuracies are exactly equal.
        let sensor = SensorParams { range_sd_m: 8.0, bearing_sd_rad: 0.0625, ..sensor() };
        for ranges_m in [[128.0, 700.0], [0.5, 400.0], [f64::NAN, 400.0]] {
            assert_eq!(optimal_phase_difference_rad(ranges_m, &sensor), None, "{ranges_m:?}");
            let eta = |rad| pair_information_1_m4(ranges_m, rad, &sensor);
            assert!((eta(0.0) - eta(1.0)).abs() <= 1e-12 * eta(0.0), "{ranges_m:?}");
        }
    }
}
