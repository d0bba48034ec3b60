//! What a pair of UAVs tells about one target, and the separation at which it tells most (36).
//!
//! ```text
//! eta = a (b_1 + b_2)(1 + cos^2 gamma) + (a^2 + b_1 b_2) sin^2 gamma                     Eq. (36)
//! a = 1 / sigma_r^2        b_i = 1 / (r_i sigma_theta)^2
//! d eta / d(cos^2 gamma) = -(a - b_1)(a - b_2)
//! ```
//!
//! gamma is the angle at the target between the two lines of sight; for a target at the centre of an orbit it is the
//! separation of the UAVs. A range and a bearing tell equally much at r* = sigma_r / sigma_theta: nearer, the bearing
//! tells more, further, the range. So 90 degrees is best while both UAVs are on the same side of r*, 0 or 180 degrees
//! with one on either side, and at r* itself separation does not matter.

use crate::angle::Angle;
use crate::frame::Position;
use crate::math;
use crate::sensor::{RANGE_MIN_M, SensorParams};

/// Determinant of what two UAVs at these ranges tell together about a target's position, 1/m4; `separation_rad` is the
/// angle between their lines of sight. Within [`RANGE_MIN_M`] a UAV tells nothing.
///
/// Implements Eq. (36).
#[doc(alias = "eta_D")]
pub fn pair_information_1_m4(ranges_m: [f64; 2], separation_rad: f64, sensor: &SensorParams) -> f64 {
    let [(a_1, b_1), (a_2, b_2)] = ranges_m.map(|range_m| along_and_across(range_m, sensor));
    let cos = math::cos(separation_rad);
    let cos2 = cos * cos;
    a_1 * b_1 + a_2 * b_2 + (a_1 * b_2 + a_2 * b_1) * cos2 + (a_1 * a_2 + b_1 * b_2) * (1.0 - cos2)
}

/// The same for a target seen from two places.
pub fn pair_information_at_1_m4(uavs: [Position; 2], target: Position, sensor: &SensorParams) -> f64 {
    let [first, second] = uavs.map(|uav| target - uav);
    let separation: Angle = second.direction() - first.direction();
    pair_information_1_m4([first.length_m(), second.length_m()], separation.rad(), sensor)
}

/// Range at which a range and a bearing tell equally much, r* = sigma_r / sigma_theta, m.
pub fn even_range_m(sensor: &SensorParams) -> f64 {
    sensor.range_sd_m / sensor.bearing_sd_rad
}

/// The separation in [0, pi/2] at which two UAVs at these ranges tell most, rad: pi/2 with both nearer or both further
/// than [`even_range_m`], 0 (or, alike, pi) with one on either side. `None` where separation does not matter: one of
/// them at that range, or overhead.
pub fn best_separation_rad(ranges_m: [f64; 2], sensor: &SensorParams) -> Option<f64> {
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

/// What one measurement tells along and across the line of sight: a and b_i, 1/m2.
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
        SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 70f64.to_radians(),
            sensing_range_m: 1200.0,
        }
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

    /// Checks Eq. (36): with Table I a range and a bearing tell equally much at 191 m; 90 degrees is best with both UAVs
    /// on one side of it, 0 degrees with one on either side, and by search as by sign.
    #[test]
    fn a_right_angle_is_best_only_on_one_side_of_the_even_range() {
        let sensor = sensor();
        assert!((even_range_m(&sensor) - 190.986).abs() < 1e-3);
        for (ranges_m, best_deg) in
            [([100.0, 150.0], 90.0), ([250.0, 700.0], 90.0), ([150.0, 400.0], 0.0), ([700.0, 100.0], 0.0)]
        {
            let best = best_separation_rad(ranges_m, &sensor).unwrap();
            assert!((best.to_degrees() - best_deg).abs() < 1e-9, "{ranges_m:?}");
            let eta = |deg: f64| pair_information_1_m4(ranges_m, deg.to_radians(), &sensor);
            assert!((0..=90).all(|deg| eta(f64::from(deg)) <= eta(best_deg)), "{ranges_m:?}");
            assert!((eta(180.0 - best_deg) - eta(best_deg)).abs() < 1e-12 * eta(best_deg));
        }
    }

    #[test]
    fn separation_does_not_matter_at_the_even_range_nor_overhead() {
        // Numbers at which the two are equal to the bit.
        let sensor = SensorParams { range_sd_m: 8.0, bearing_sd_rad: 0.0625, ..sensor() };
        for ranges_m in [[128.0, 700.0], [0.5, 400.0], [f64::NAN, 400.0]] {
            assert_eq!(best_separation_rad(ranges_m, &sensor), None, "{ranges_m:?}");
            let eta = |rad| pair_information_1_m4(ranges_m, rad, &sensor);
            assert!((eta(0.0) - eta(1.0)).abs() <= 1e-12 * eta(0.0), "{ranges_m:?}");
        }
    }
}
