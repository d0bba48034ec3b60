//! The GMTI sensor: range and bearing from a UAV to a target (7), field of view, and information of a measurement (31).
//!
//! The sensor is gimballed: its boresight points from the UAV to the point chosen by the agent. The model is planar:
//! altitude is ignored.

use nalgebra::{Matrix2, Vector2};

use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::math;
use crate::params::{RANGE_MIN_M, SensorParams};

/// Largest radial speed over ground of a false alarm, m/s. They are uniform between it and its negative, except in the
/// blind zone, where they are as rare as targets.
pub const FALSE_ALARM_SPEED_MAX_M_S: f64 = 20.0;

/// Largest error of a measurement that is taken for noise, in standard deviations.
pub(crate) const NOISE_SDS_MAX: f64 = 10.0;

/// A measurement: range and bearing from the UAV to the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeBearingMeasurement {
    /// Range r, m.
    pub range_m: f64,
    /// Bearing theta, anticlockwise from east.
    #[doc(alias = "theta")]
    pub bearing: Angle,
}

impl SensorParams {
    /// Maximum range that the sensor can report, m: the sensing range and ten standard deviations of noise.
    pub(crate) fn reported_range_max_m(&self) -> f64 {
        self.sensing_range_m + NOISE_SDS_MAX * (self.range_sd_m + self.own_position_sd_m)
    }

    /// Half the field of view, rad.
    pub fn half_field_of_view_rad(&self) -> f64 {
        0.5 * self.field_of_view_rad
    }

    /// Returns true if the target is within half the field of view of the boresight and within sensing range.
    pub fn in_view(&self, uav: Position, boresight: Angle, target: Position) -> bool {
        let [is_in_view] = self.in_view_batch([(uav, boresight, target)]);
        is_in_view
    }

    /// Like [`in_view`](Self::in_view) for several targets, each with its UAV and boresight. Same results, but faster.
    #[inline]
    pub fn in_view_batch<const N: usize>(&self, looks: [(Position, Angle, Position); N]) -> [bool; N] {
        let measured = measure_batch(looks.map(|(uav, _, target)| target - uav));
        core::array::from_fn(|i| self.is_within(&measured[i], looks[i].1))
    }

    /// Returns true if the noise-free measurement of a target is within the field of view and the sensing range.
    #[inline]
    fn is_within(&self, z: &RangeBearingMeasurement, boresight: Angle) -> bool {
        z.range_m <= self.sensing_range_m && (z.bearing - boresight).abs_rad() <= self.half_field_of_view_rad()
    }

    /// Returns the noise-free measurement of a target within half the field of view of the boresight and within sensing
    /// range; `None` for other targets.
    pub fn measure(&self, uav: Position, boresight: Angle, target: Position) -> Option<RangeBearingMeasurement> {
        let [z] = self.measure_batch(uav, boresight, [target]);
        z
    }

    /// Like [`measure`](Self::measure) for several targets. Same results, but faster.
    #[inline]
    pub fn measure_batch<const N: usize>(
        &self,
        uav: Position,
        boresight: Angle,
        targets: [Position; N],
    ) -> [Option<RangeBearingMeasurement>; N] {
        measure_batch(targets.map(|target| target - uav)).map(|z| self.is_within(&z, boresight).then_some(z))
    }

    /// Like [`in_view`](Self::in_view), but requires a clearance of `clearance_m` in every direction.
    pub(crate) fn in_view_with_clearance(
        &self,
        uav: Position,
        boresight: Angle,
        target: Position,
        clearance_m: f64,
    ) -> bool {
        // Most targets are out of range; this test is cheap.
        let furthest_m = self.sensing_range_m - clearance_m;
        if furthest_m < 0.0 || uav.squared_distance_m2(target) > furthest_m * furthest_m {
            return false;
        }
        let target_rel_uav = target - uav;
        let range_m = target_rel_uav.length_m();
        let off_boresight_rad = (target_rel_uav.direction() - boresight).abs_rad();
        range_m > clearance_m.max(RANGE_MIN_M)
            && off_boresight_rad + clearance_m / range_m <= self.half_field_of_view_rad()
    }

    /// Probability that a target in view is detected, which has a speed along the line of sight over ground of
    /// `radial_speed_m_s`: `p_d (1 - exp(-ln 2 (v / mdv)^2))`, half of p_d at the minimum detectable velocity.
    pub fn detection_probability_at(&self, radial_speed_m_s: f64) -> f64 {
        self.detection_probability * (1.0 - self.blind_probability(radial_speed_m_s * radial_speed_m_s))
    }

    /// Variance parameter u^2 of the blind zone, m2/s2: a target with the radial speed v is in it with the probability
    /// exp(-v^2 / 2 u^2); 0: no blind zone.
    pub(crate) fn blind_variance(&self) -> f64 {
        self.mdv_m_s * self.mdv_m_s / (2.0 * core::f64::consts::LN_2)
    }

    /// Probability that a target is in the blind zone, from the square of its radial speed, m2/s2.
    pub(crate) fn blind_probability(&self, squared_speed: f64) -> f64 {
        let variance = self.blind_variance();
        if variance > 0.0 { math::exp(-0.5 * squared_speed / variance) } else { 0.0 }
    }

    /// Area in view, m2.
    pub(crate) fn area_m2(&self) -> f64 {
        0.5 * self.field_of_view_rad * self.sensing_range_m * self.sensing_range_m
    }

    /// Returns the information H' R^-1 H that one measurement from `uav` gives about the position of a target at
    /// `target`, 1/m2. R is the noise covariance of this sensor.
    ///
    /// Implements Eq. (31), one UAV's term. Zero within `RANGE_MIN_M`.
    #[doc(alias = "fisher")]
    pub fn information(&self, uav: Position, target: Position) -> Matrix2<f64> {
        let Some(h) = jacobian(uav, target) else { return Matrix2::zeros() };
        h.transpose() * self.noise_information() * h
    }

    /// Returns R^-1, the inverse of the measurement noise covariance.
    pub fn noise_information(&self) -> Matrix2<f64> {
        Matrix2::from_diagonal(&self.noise_weights().into())
    }

    /// Diagonal of R^-1: range (1/m2) and bearing (1/rad2).
    pub(crate) fn noise_weights(&self) -> [f64; 2] {
        [1.0 / (self.range_sd_m * self.range_sd_m), 1.0 / (self.bearing_sd_rad * self.bearing_sd_rad)]
    }

    /// Variances of range (m2) and bearing (rad2) of one measurement, with the errors of the UAV's own position and
    /// heading.
    pub(crate) fn measurement_variances(&self, range_m: f64) -> [f64; 2] {
        let position_rad = self.own_position_sd_m / range_m;
        let range = self.range_sd_m * self.range_sd_m + self.own_position_sd_m * self.own_position_sd_m;
        let bearing = self.bearing_sd_rad * self.bearing_sd_rad
            + (position_rad * position_rad + self.own_heading_sd_rad * self.own_heading_sd_rad);
        [range, bearing]
    }

    /// Converts a measurement to a target position and its covariance, m2, with the errors of the UAV's own position and
    /// heading. Across the line of sight, an error of the bearing grows with the true range: below `near_range_m`, its
    /// mean square replaces the square of the measured range.
    pub fn to_cartesian(&self, uav: Position, z: &RangeBearingMeasurement) -> (Position, Matrix2<f64>) {
        let along = Displacement::from_polar(1.0, z.bearing).vector();
        let across = Vector2::new(-along.y, along.x);
        let mut range_m = z.range_m.max(RANGE_MIN_M);
        if range_m < self.near_range_m {
            range_m = math::hypot(range_m, self.range_sd_m);
        }
        let (across_sd_m, heading_sd_m) = (range_m * self.bearing_sd_rad, range_m * self.own_heading_sd_rad);
        let own_variance_m2 = self.own_position_sd_m * self.own_position_sd_m;
        let covariance = along * along.transpose() * (self.range_sd_m * self.range_sd_m + own_variance_m2)
            + across
                * across.transpose()
                * (across_sd_m * across_sd_m + (heading_sd_m * heading_sd_m + own_variance_m2));
        (uav + Displacement::from_polar(z.range_m, z.bearing), covariance)
    }
}

/// Returns the noise-free measurement of a target at `target` from `uav`.
///
/// Implements Eq. (7).
pub fn measure(uav: Position, target: Position) -> RangeBearingMeasurement {
    let [z] = measure_batch([target - uav]);
    z
}

/// Like [`measure`] for several targets, each given relative to its UAV.
#[inline]
pub(crate) fn measure_batch<const N: usize>(targets_rel_uav: [Displacement; N]) -> [RangeBearingMeasurement; N] {
    let bearings = Displacement::direction_batch(targets_rel_uav);
    core::array::from_fn(|i| RangeBearingMeasurement { range_m: targets_rel_uav[i].length_m(), bearing: bearings[i] })
}

/// Derivative H of (7) with respect to the target's position: rows range (m/m) and bearing (rad/m), columns x and y.
/// All other columns of the state are zero. `None` within `RANGE_MIN_M`.
///
/// Implements the H of Eq. (10), (11).
pub fn jacobian(uav: Position, target: Position) -> Option<Matrix2<f64>> {
    let target_rel_uav = target - uav;
    let range_m = target_rel_uav.length_m();
    let [along, across] = jacobian_rows(range_m, target_rel_uav);
    (range_m >= RANGE_MIN_M).then(|| Matrix2::new(along.x, along.y, across.x, across.y))
}

/// Rows of the [`jacobian`] for a known range: along the line of sight, and across it.
#[inline]
pub(crate) fn jacobian_rows(range_m: f64, target_rel_uav: Displacement) -> [Vector2<f64>; 2] {
    let along = target_rel_uav.vector() / range_m;
    [along, Vector2::new(-along.y, along.x) / range_m]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::TeamParams;
    use proptest::prelude::*;

    fn table_1() -> SensorParams {
        TeamParams::paper().track.sensor
    }

    /// Checks Eq. (7).
    #[test]
    fn range_and_bearing_of_a_3_4_5_triangle() {
        let z = measure(Position::from_m(100.0, 200.0), Position::from_m(97.0, 204.0));
        assert!((z.range_m - 5.0).abs() < 1e-12);
        assert!((z.bearing.deg() - 126.869_897_645_844).abs() < 1e-9);
    }

    #[test]
    fn the_view_is_limited_by_half_the_field_of_view_and_by_the_sensing_range() {
        let sensor = table_1();
        let at = |deg: f64, range_m| Position::ORIGIN + Displacement::from_polar(range_m, Angle::from_deg(deg));
        let west = Angle::from_deg(180.0);
        assert!(sensor.in_view(Position::ORIGIN, west, at(-145.1, 400.0)));
        assert!(!sensor.in_view(Position::ORIGIN, west, at(-144.9, 400.0)));
        assert!(sensor.in_view(Position::ORIGIN, west, at(170.0, 1199.0)));
        assert!(!sensor.in_view(Position::ORIGIN, west, at(170.0, 1201.0)));
        assert!(sensor.in_view_with_clearance(Position::ORIGIN, west, at(-148.0, 400.0), 10.0));
        assert!(!sensor.in_view_with_clearance(Position::ORIGIN, west, at(-146.0, 400.0), 10.0));
    }

    /// Checks Eq. (31): the published entries, for a bearing of 30 degrees at 300 m.
    #[test]
    fn information_has_the_published_entries() {
        let (theta, r) = (30f64.to_radians(), 300.0);
        let target = Position::ORIGIN + Displacement::from_polar(r, Angle::from_rad(theta));
        let got = table_1().information(Position::ORIGIN, target);
        let (c, s) = (math::cos(theta), math::sin(theta));
        let (a, b) = (1.0 / 100.0, 1.0 / (r * 3f64.to_radians() * (r * 3f64.to_radians())));
        let expected = Matrix2::new(c * c * a + s * s * b, c * s * (a - b), c * s * (a - b), s * s * a + c * c * b);
        assert!((got - expected).norm() < 1e-15);
    }

    #[test]
    fn the_covariance_of_a_converted_measurement_inverts_the_information() {
        let sensor = table_1();
        let (uav, target) = (Position::from_m(-50.0, 20.0), Position::from_m(250.0, 310.0));
        let (position, covariance) = sensor.to_cartesian(uav, &measure(uav, target));
        assert!(position.distance_m(target) < 1e-9);
        assert!((covariance * sensor.information(uav, target) - Matrix2::identity()).norm() < 1e-9);
    }

    proptest! {
        /// Checks the H of Eq. (10), (11) by central differences.
        #[test]
        fn the_jacobian_matches_differences(x in -1e3..1e3f64, y in -1e3..1e3f64) {
            let uav = Position::from_m(3.0, -7.0);
            prop_assume!(uav.distance_m(Position::from_m(x, y)) > 5.0);
            let h = jacobian(uav, Position::from_m(x, y)).unwrap();
            let step = 1e-4;
            for (column, (dx, dy)) in [(step, 0.0), (0.0, step)].into_iter().enumerate() {
                let plus = measure(uav, Position::from_m(x + dx, y + dy));
                let minus = measure(uav, Position::from_m(x - dx, y - dy));
                let range_slope = (plus.range_m - minus.range_m) / (2.0 * step);
                let bearing_slope = (plus.bearing - minus.bearing).rad() / (2.0 * step);
                prop_assert!((h[(0, column)] - range_slope).abs() < 1e-6);
                prop_assert!((h[(1, column)] - bearing_slope).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_target_directly_below_has_no_jacobian_and_no_information() {
        assert_eq!(jacobian(Position::ORIGIN, Position::from_m(0.5, 0.0)), None);
        assert_eq!(table_1().information(Position::ORIGIN, Position::ORIGIN), Matrix2::zeros());
    }
}
