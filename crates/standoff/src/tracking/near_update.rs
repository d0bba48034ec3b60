//! Update of a target's position with a measurement from nearby, where a linearised bearing is overconfident.
//!
//! The update of (10), (11) linearises a measurement at the predicted position. That is wrong if the position is not
//! known much better than its distance from the UAV: an error of the predicted range turns into one across the line of
//! sight. Here, the posterior is integrated instead. In polar coordinates about the UAV, with the prior density
//! N(x; m, A), it is
//!
//! ```text
//! p(r, theta | z) ~ r N(x(r, theta); m, A) N(z_r; r, R_r) N(z_theta; theta, R_theta),   r >= 0
//! ```
//!
//! Along a line of sight it is r times a Gaussian, whose moments are exact; over the bearing, the trapezoidal rule sums
//! them. Mean and covariance of the position are those of this density (assumed-density filtering: Ito & Xiong,
//! *Gaussian Filters for Nonlinear Filtering Problems*, 2000). They are conditional moments, so that their normalised
//! squared error is 2 on average if the prior is Gaussian.

use nalgebra::{Matrix2, Matrix6x2, Vector2};

use crate::covariance::Covariance;
use crate::frame::{Displacement, Position};
use crate::math::{self, PI, TAU};
use crate::params::SensorParams;
use crate::sensor::RangeBearingMeasurement;
use crate::tracking::information_filter::{Contribution, Estimate, InformationFilter, inverse_2};

/// Variance of the predicted position, as a fraction of its squared distance from the UAV, up to which the error of the
/// linearisation is negligible: less than 0.1 % of any variance.
const LINEAR_MAX: f64 = 1e-3;

/// Number of bearings on each side of the middle one.
const HALF: i32 = 20;

/// Number of standard deviations that the bearings cover.
const WIDTH_SDS: f64 = 5.0;

/// Maximum number of passes: each narrows the bearings to those that the last one has found possible.
const PASSES_MAX: usize = 4;

/// Number of standard deviations at which a line of sight points away from the target.
const BEHIND_SDS: f64 = 8.0;

/// A measurement from nearby: position of the UAV, range and bearing, and the variances of both, m2 and rad2.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NearMeasurement {
    pub(crate) uav: Position,
    pub(crate) measurement: RangeBearingMeasurement,
    pub(crate) variances: [f64; 2],
}

/// Sums over the bearings: weight, and first and second moment of the position relative to the UAV.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    weight: f64,
    first: Vector2<f64>,
    second: Matrix2<f64>,
    /// First and second moment of the bearing relative to the measured one.
    bearing: [f64; 2],
}

impl SensorParams {
    /// Returns true if a measurement from `uav` must not be linearised at a predicted position, whose covariance has
    /// this trace, m2.
    #[inline]
    pub(crate) fn is_near(&self, uav: Position, predicted: Position, trace_m2: impl Fn() -> f64) -> bool {
        let squared_m2 = uav.squared_distance_m2(predicted);
        squared_m2 < self.near_range_m * self.near_range_m && trace_m2() > LINEAR_MAX * squared_m2
    }
}

impl NearMeasurement {
    /// Measurement with the weights of range and bearing: the inverse variances, 1/m2 and 1/rad2.
    pub(crate) fn new(uav: Position, measurement: RangeBearingMeasurement, weights: [f64; 2]) -> Self {
        Self { uav, measurement, variances: weights.map(f64::recip) }
    }

    /// Updates an estimate; with the linearised measurement if it contradicts the estimate.
    pub(crate) fn apply(&self, estimate: &mut Estimate) {
        if self.update(estimate).is_none()
            && let Some(mut filter) = InformationFilter::new(*estimate)
        {
            let at = (self.uav, self.measurement, estimate.state.position());
            let [contribution] = Contribution::from_measurements([at], [self.variances.map(f64::recip)]);
            filter.update(&contribution);
            *estimate = *filter.estimate();
        }
    }

    /// Updates an estimate. Returns the density of the measurement, 1/(m rad); `None` if it contradicts the estimate,
    /// which does not change then.
    pub(crate) fn update(&self, estimate: &mut Estimate) -> Option<f64> {
        let prior = estimate.position_covariance();
        let information = inverse_2(&prior)?;
        let uav_rel_target = (self.uav - estimate.state.position()).vector();
        let (moments, integral) = self.moments(&uav_rel_target, &information)?;
        let mean = moments.first / moments.weight;
        let covariance = moments.second / moments.weight - mean * mean.transpose();
        inverse_2(&covariance)?;
        let full = estimate.covariance.matrix();
        // The rest of the state is correlated with the position.
        let gain = Matrix6x2::from_columns(&[full.column(0), full.column(3)]) * information;
        estimate.state.0 += gain * (uav_rel_target + mean);
        estimate.covariance = Covariance::from(&(full + gain * (covariance - prior) * gain.transpose()));
        let normalisation = (information.determinant() / (self.variances[0] * self.variances[1])).sqrt();
        Some(integral * normalisation / (TAU * TAU))
    }

    /// Moments of the posterior, and the integral over its density without the constants of the three normal densities.
    fn moments(&self, uav_rel_target: &Vector2<f64>, information: &Matrix2<f64>) -> Option<(Moments, f64)> {
        let limit_rad = (WIDTH_SDS * self.variances[1].sqrt()).min(PI);
        let (mut middle_rad, mut half_width_rad) = (0.0, limit_rad);
        for pass in 1.. {
            let step_rad = half_width_rad / f64::from(HALF);
            let offsets = (-HALF..=HALF).map(|index| middle_rad + f64::from(index) * step_rad);
            let offsets = offsets.filter(|offset_rad| offset_rad.abs() <= limit_rad * (1.0 + 1e-12));
            let lines = offsets.filter_map(|offset_rad| self.line(offset_rad, uav_rel_target, information));
            let lines: Vec<Line> = lines.collect();
            let peak = lines.iter().map(|line| line.exponent).fold(f64::NEG_INFINITY, f64::max);
            let mut sum = Moments::default();
            for Line { offset_rad, exponent, direction, radial } in &lines {
                let [one, r, r2] = radial.map(|moment| moment * math::exp(exponent - peak));
                sum.weight += one;
                sum.first += direction * r;
                sum.second += direction * direction.transpose() * r2;
                sum.bearing[0] += offset_rad * one;
                sum.bearing[1] += offset_rad * offset_rad * one;
            }
            if sum.weight.is_nan() || sum.weight <= 0.0 {
                return None;
            }
            let mean_rad = sum.bearing[0] / sum.weight;
            let sd_rad = (sum.bearing[1] / sum.weight - mean_rad * mean_rad).max(0.0).sqrt();
            let wider_rad = WIDTH_SDS * sd_rad.max(step_rad);
            if pass == PASSES_MAX || wider_rad > 0.5 * half_width_rad {
                return Some((sum, sum.weight * step_rad * math::exp(peak)));
            }
            (middle_rad, half_width_rad) = (mean_rad, wider_rad);
        }
        None
    }

    /// Density along the line of sight with an offset from the measured bearing; `None` if it points away from the
    /// target.
    fn line(&self, offset_rad: f64, uav_rel_target: &Vector2<f64>, information: &Matrix2<f64>) -> Option<Line> {
        let [range_variance, bearing_variance] = self.variances;
        let bearing = self.measurement.bearing + crate::Angle::from_rad(offset_rad);
        let direction = Displacement::from_polar(1.0, bearing).vector();
        let across = information * uav_rel_target;
        let precision = direction.dot(&(information * direction)) + 1.0 / range_variance;
        let sd_m = 1.0 / precision.sqrt();
        let mean_m = (self.measurement.range_m / range_variance - direction.dot(&across)) / precision;
        if mean_m.is_nan() || mean_m < -BEHIND_SDS * sd_m {
            return None;
        }
        // At the maximum over r, without cancellation.
        let at = uav_rel_target + direction * mean_m;
        let off_m = self.measurement.range_m - mean_m;
        let squared = at.dot(&(information * at)) + off_m * off_m / range_variance;
        let exponent = -0.5 * (squared + offset_rad * offset_rad / bearing_variance);
        let sds = mean_m / sd_m;
        let all_m = sd_m * (0.5 * PI).sqrt() * math::erfc(-sds * core::f64::consts::FRAC_1_SQRT_2);
        let r = mean_m * all_m + sd_m * sd_m * math::exp(-0.5 * sds * sds);
        let r2 = mean_m * r + sd_m * sd_m * all_m;
        let r3 = mean_m * r2 + 2.0 * sd_m * sd_m * r;
        Some(Line { offset_rad, exponent, direction, radial: [r, r2, r3] })
    }
}

/// Posterior density along a line of sight.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Bearing relative to the measured one, rad.
    offset_rad: f64,
    /// Logarithm of the largest density.
    exponent: f64,
    direction: Vector2<f64>,
    /// Integrals of r, r2 and r3 over the density as a fraction of the largest one.
    radial: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Angle;
    use crate::params::TeamParams;
    use crate::sensor;
    use crate::target::TargetState;
    use crate::tracking::pose_error::tests::normals;
    use nalgebra::Vector6;

    /// Target predicted at `(x_m, y_m)`, with standard deviations of 12 m east and `sd_m` north, correlated.
    fn prior(x_m: f64, y_m: f64, sd_m: f64) -> Estimate {
        let mut upper = Covariance::from_diagonal([144.0, 4.0, 0.04, sd_m * sd_m, 5.0, 0.04]).upper_triangle();
        (upper[1], upper[3], upper[4]) = (9.0, 6.0 * sd_m, 1.0);
        let state = TargetState(Vector6::new(x_m, 3.0, 0.1, y_m, -2.0, 0.0));
        Estimate { state, covariance: Covariance::from_upper_triangle(&upper) }
    }

    fn near(range_m: f64, bearing_deg: f64, [range_sd_m, bearing_sd_deg]: [f64; 2]) -> NearMeasurement {
        let measurement = RangeBearingMeasurement { range_m, bearing: Angle::from_deg(bearing_deg) };
        let bearing_sd_rad = bearing_sd_deg.to_radians();
        let variances = [range_sd_m * range_sd_m, bearing_sd_rad * bearing_sd_rad];
        NearMeasurement { uav: Position::from_m(5.0, -3.0), measurement, variances }
    }

    /// Density, mean and covariance of the position, by summation over a fine grid of positions.
    fn summed(prior: &Estimate, near: &NearMeasurement) -> (f64, Vector2<f64>, Matrix2<f64>) {
        const STEP_M: f64 = 0.1;
        let (at, covariance) = (prior.state.position().vector(), prior.position_covariance());
        let information = inverse_2(&covariance).unwrap();
        let (mut weight, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        for column in -800..800 {
            for row in -800..800 {
                let x = at + Vector2::new(f64::from(column), f64::from(row)) * STEP_M;
                let expected = sensor::measure(near.uav, Position::from(x));
                let off =
                    [near.measurement.range_m - expected.range_m, (near.measurement.bearing - expected.bearing).rad()];
                let squared = off[0] * off[0] / near.variances[0] + off[1] * off[1] / near.variances[1];
                let density = math::exp(-0.5 * (squared + (x - at).dot(&(information * (x - at)))));
                weight += density;
                first += x * density;
                second += x * x.transpose() * density;
            }
        }
        let mean = first / weight;
        let normalisation = (information.determinant() / (near.variances[0] * near.variances[1])).sqrt() / (TAU * TAU);
        (weight * STEP_M * STEP_M * normalisation, mean, second / weight - mean * mean.transpose())
    }

    /// UAVs within and outside the standard deviations of the prediction, precise and coarse sensors.
    #[test]
    fn moments_and_density_equal_those_of_a_fine_grid() {
        for (x_m, y_m, sd_m, range_m, bearing_deg, sds) in [
            (20.0, 4.0, 6.0, 22.0, 30.0, [10.0, 3.0]),
            (8.0, -1.0, 10.0, 14.0, -170.0, [10.0, 3.0]),
            (8.0, -1.0, 4.0, 6.0, 100.0, [30.0, 10.0]),
            (40.0, 10.0, 1.5, 30.0, 14.0, [3.0, 10.0]),
            (25.0, 5.0, 8.0, 28.0, 20.0, [30.0, 60.0]),
        ] {
            let (estimate, near) = (prior(x_m, y_m, sd_m), near(range_m, bearing_deg, sds));
            let mut updated = estimate;
            let density = near.update(&mut updated).unwrap();
            let (expected_density, mean, covariance) = summed(&estimate, &near);
            assert!((density / expected_density - 1.0).abs() < 1e-3, "{density} {expected_density}");
            assert!((updated.state.position().vector() - mean).norm() < 0.01, "{mean} {updated:?}");
            assert!((updated.position_covariance() - covariance).norm() < 2e-3 * covariance.norm(), "{covariance}");
            // The velocity changes with the position, by their correlation.
            let change = updated.state.position().vector() - estimate.state.position().vector();
            let gain = estimate.covariance.matrix().fixed_view::<1, 1>(1, 0)[0];
            assert!(change.norm() > 0.1 && gain > 0.0 && updated.state.0[1] != estimate.state.0[1]);
            assert!(InformationFilter::new(updated).is_some());
        }
    }

    /// Mean normalised error squared (2 is consistent) and mean distance from the truth, m, of both updates, over 4,000
    /// targets that are distributed as predicted.
    fn errors(estimate: &Estimate, sds: [f64; 2]) -> [[f64; 2]; 2] {
        let mut normals = normals(7);
        let root = estimate.position_covariance().cholesky().unwrap().l();
        let mut sums = [[0.0; 2]; 2];
        let mut n = 0.0;
        while n < 4000.0 {
            let truth = estimate.state.position().vector() + root * Vector2::from(normals());
            let at = near(0.0, 0.0, sds);
            let exact = sensor::measure(at.uav, Position::from(truth));
            let [of_range, of_bearing] = normals();
            let bearing = exact.bearing + Angle::from_rad(at.variances[1].sqrt() * of_bearing);
            let measurement = RangeBearingMeasurement { range_m: exact.range_m + sds[0] * of_range, bearing };
            if measurement.range_m <= 0.0 {
                continue;
            }
            n += 1.0;
            let at = NearMeasurement { measurement, ..at };
            let mut filter = InformationFilter::new(*estimate).unwrap();
            let contribution = (at.uav, measurement, estimate.state.position());
            let [contribution] = Contribution::from_measurements([contribution], [at.variances.map(f64::recip)]);
            filter.update(&contribution);
            let mut updated = *estimate;
            at.apply(&mut updated);
            for (sum, estimate) in sums.iter_mut().zip([updated, *filter.estimate()]) {
                let off = estimate.state.position().vector() - truth;
                sum[0] += off.dot(&(inverse_2(&estimate.position_covariance()).unwrap() * off));
                sum[1] += off.norm();
            }
        }
        sums.map(|sum| sum.map(|sum| sum / n))
    }

    #[test]
    fn updates_from_nearby_are_consistent_and_linearised_ones_are_not() {
        for (x_m, sd_m, sds) in [(20.0, 8.0, [10.0, 3.0]), (25.0, 12.0, [1.0, 1.0]), (45.0, 12.0, [10.0, 1.0])] {
            let [[nees, error_m], [linearised_nees, linearised_error_m]] = errors(&prior(x_m, 2.0, sd_m), sds);
            assert!((1.85..2.15).contains(&nees) && linearised_nees > 4.0, "{nees} {linearised_nees}");
            assert!(error_m < 0.85 * linearised_error_m, "{error_m} {linearised_error_m}");
        }
    }

    /// At the limit of `is_near`, both updates have nearly the same variances and errors.
    #[test]
    fn both_updates_agree_where_they_meet() {
        let sensor = TeamParams::recommended().track.sensor;
        let mut estimate = prior(290.0, -3.0, 8.0);
        let trace_m2 = |factor: f64| move || factor * LINEAR_MAX * 285.0 * 285.0;
        let uav = near(285.0, 0.0, [10.0, 3.0]).uav;
        assert!(sensor.is_near(uav, estimate.state.position(), trace_m2(1.001)));
        assert!(!sensor.is_near(uav, estimate.state.position(), trace_m2(0.999)));
        assert!(!TeamParams::paper().track.sensor.is_near(uav, estimate.state.position(), trace_m2(1e6)));
        let farther = estimate.state.position() + Displacement::from_m(20.0, 0.0);
        assert!(!sensor.is_near(uav, farther, trace_m2(1e6)));
        estimate.covariance =
            estimate.covariance * (LINEAR_MAX * 285.0 * 285.0 / estimate.position_covariance().trace());
        let [near, linearised] = errors(&estimate, [10.0, 3.0]);
        assert!(
            (near[0] - linearised[0]).abs() < 0.02 && (near[1] / linearised[1] - 1.0).abs() < 0.002,
            "{near:?} {linearised:?}"
        );
    }

    /// A prediction that excludes the measurement is updated as before; nothing becomes invalid.
    #[test]
    fn a_measurement_that_contradicts_the_prediction_is_linearised() {
        let estimate = prior(200.0, 0.0, 50.0);
        let near = near(60.0, 180.0, [30.0, 1.0]);
        let mut updated = estimate;
        assert_eq!(near.update(&mut updated), None);
        assert_eq!(updated, estimate);
        near.apply(&mut updated);
        assert!(updated != estimate && InformationFilter::new(updated).is_some());
    }
}
