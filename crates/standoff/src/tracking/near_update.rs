//! Update of a target's position with a measurement from nearby, or of a very uncertain target, where a linearised
//! bearing is overconfident.
//!
//! The update of (10), (11) linearises a measurement at the predicted position. That is wrong if the position is not
//! known much better than its distance from the UAV: an error of the predicted range turns into one across the line of
//! sight. Here, the posterior is integrated instead. In polar coordinates about the UAV, with the prior density
//! N(x; m, A), it is
//!
//! ```text
//! p(r, theta | z) ~ r N(x(r, theta); m, A) N(z_r; r, R_r) / P(r) N(z_theta; theta, R_theta),   r >= 0
//! ```
//!
//! Only positive ranges are reported, with the probability `P(r) = Phi(r / sigma_r)`: without P, each report would make
//! a target nearer than sigma_r seem farther away. The factor r counts the positions at a range. If the prior is wide
//! compared with the distance, both factors are omitted, so that all ranges are equally likely: the sensor has found the
//! target because it pointed at the prediction, which is the case more often if that is too far away.
//!
//! Along a line of sight, the density is a sum of Gaussians of r, or of r times Gaussians, with exact moments. Over the
//! bearing, the trapezoidal rule sums them. Mean and covariance of the position are those of this density
//! (assumed-density filtering: Ito & Xiong, *Gaussian Filters for Nonlinear Filtering Problems*, 2000). They are
//! conditional moments, so that their normalised squared error is 2 on average if the prior is Gaussian and not wide.

use nalgebra::{Matrix2, Matrix6x2, Vector2};

use crate::covariance::Covariance;
use crate::frame::{Displacement, Position};
use crate::math::{self, PI, TAU};
use crate::params::SensorParams;
use crate::sensor::{self, RangeBearingMeasurement};
use crate::tracking::estimate::{Estimate, inverse_2};
use crate::tracking::information_filter::Contribution;

/// Variance of the predicted position, as a fraction of its squared distance from the UAV, up to which the error of the
/// linearisation is negligible: less than 0.1 % of any variance.
const LINEAR_MAX: f64 = 1e-3;

/// Variance of the predicted position, as a fraction of its squared distance from the UAV, above which all ranges are
/// equally likely instead of all positions. Calibrated with sensors of 1 to 50 m and 0.5 to 10 degrees.
const WIDE_MIN: f64 = 0.25;

/// Coefficients of `1 / Phi(x) = 1 + exp(-(a x + b x^2 / 2))`, which is off by less than 0.3 % for positive x.
const POSITIVE: [f64; 2] = [1.54, 0.29];

/// Largest measured range, in standard deviations, of a target at which a range may be negative.
const POSITIVE_SDS: f64 = 6.0;

/// Number of bearings on each side of the middle one.
const HALF: i32 = 20;

/// Number of standard deviations of the posterior that the bearings cover.
const WIDTH_SDS: f64 = 5.0;

/// Largest error of a measured bearing, in its standard deviations. The prediction may contradict the measurement.
const ERROR_SDS: f64 = 8.0;

/// Maximum number of passes: each narrows the bearings to those that the last one has found possible.
const PASSES_MAX: usize = 4;

/// Number of standard deviations at which a line of sight points away from the target.
const BEHIND_SDS: f64 = 8.0;

/// A measurement from nearby: position of the UAV, range and bearing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NearMeasurement {
    uav: Position,
    measurement: RangeBearingMeasurement,
    /// Variances of range and bearing, m2 and rad2, with the heading error of the UAV.
    variances: [f64; 2],
    /// Covariance of the position error of the UAV, m2.
    uav_covariance: Matrix2<f64>,
}

/// Sums over the bearings.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    /// Integral of the density over the plane.
    integral: f64,
    /// Integral of the density, for a wide prior without the factor r; up to a constant.
    weight: f64,
    /// First and second moment of the position relative to the UAV, in the same units.
    first: Vector2<f64>,
    second: Matrix2<f64>,
    /// First and second moment of the bearing relative to the measured one.
    bearing: [f64; 2],
}

impl SensorParams {
    /// Returns true if a measurement from `uav` must not be linearised at a predicted position, whose covariance has
    /// this trace, m2.
    #[inline]
    pub(crate) fn is_nonlinear(&self, uav: Position, predicted: Position, trace_m2: impl Fn() -> f64) -> bool {
        let squared_m2 = uav.squared_distance_m2(predicted);
        if squared_m2 < self.near_range_m * self.near_range_m {
            return trace_m2() > LINEAR_MAX * squared_m2;
        }
        let fraction = self.linear_sd_fraction_max;
        self.near_range_m > 0.0 && fraction > 0.0 && trace_m2() > 2.0 * fraction * fraction * squared_m2
    }
}

impl NearMeasurement {
    /// Measurement by a UAV with this covariance of its position, m2, and variance of its heading, rad2.
    pub(crate) fn new(
        sensor: &SensorParams,
        uav: Position,
        measurement: RangeBearingMeasurement,
        (uav_covariance, heading_variance): (Matrix2<f64>, f64),
    ) -> Self {
        let [range, bearing] = sensor.noise_weights().map(f64::recip);
        Self { uav, measurement, variances: [range, bearing + heading_variance], uav_covariance }
    }

    /// Updates an estimate; with the linearised measurement if it contradicts the estimate.
    pub(crate) fn apply(&self, estimate: &mut Estimate) {
        if self.update(estimate).is_none() {
            self.linearised(estimate);
        }
    }

    /// Updates an estimate with the measurement linearised at the predicted position.
    fn linearised(&self, estimate: &mut Estimate) {
        let predicted = estimate.state.position();
        let [range, bearing] = self.variances;
        let rows = sensor::jacobian_rows(self.uav.distance_m(predicted), predicted - self.uav);
        let [of_range, of_bearing] = rows.map(|row| row.dot(&(self.uav_covariance * row)));
        let weights = [range + of_range, bearing + of_bearing].map(f64::recip);
        let [contribution] = Contribution::from_measurements([(self.uav, self.measurement, predicted)], [weights]);
        estimate.update(&contribution);
    }

    /// Updates an estimate. Returns the density of the measurement, 1/(m rad); `None` if it contradicts the estimate,
    /// which does not change then.
    pub(crate) fn update(&self, estimate: &mut Estimate) -> Option<f64> {
        // The target is measured relative to the assumed position of the UAV, which is off by its error.
        let prior = estimate.position_covariance() + self.uav_covariance;
        let information = inverse_2(&prior)?;
        let uav_rel_target = (self.uav - estimate.state.position()).vector();
        let is_wide = prior.trace() > WIDE_MIN * uav_rel_target.norm_squared();
        let moments = self.moments(&uav_rel_target, &information, is_wide)?;
        let mean = moments.first / moments.weight;
        let covariance = moments.second / moments.weight - mean * mean.transpose();
        inverse_2(&covariance)?;
        let full = estimate.covariance.matrix();
        // The rest of the state is correlated with the position.
        let gain = Matrix6x2::from_columns(&[full.column(0), full.column(3)]) * information;
        estimate.state.0 += gain * (uav_rel_target + mean);
        estimate.covariance = Covariance::from(&(full + gain * (covariance - prior) * gain.transpose()));
        let normalisation = (information.determinant() / (self.variances[0] * self.variances[1])).sqrt();
        Some(moments.integral * normalisation / (TAU * TAU))
    }

    /// Terms of the density of the measured range as a function of the range.
    fn range_terms(&self, is_wide: bool) -> [Option<RangeTerm>; 2] {
        let reported = RangeTerm { mean_m: self.measurement.range_m, variance: self.variances[0], exponent: 0.0 };
        let (sd_m, [a, b]) = (reported.variance.sqrt(), POSITIVE);
        let is_near_zero = !is_wide && reported.mean_m < POSITIVE_SDS * sd_m;
        let near_zero = is_near_zero.then(|| {
            let (mean_m, variance) = ((reported.mean_m - a * sd_m) / (1.0 + b), reported.variance / (1.0 + b));
            let squared = |mean_m: f64, variance: f64| mean_m * mean_m / variance;
            let exponent = 0.5 * (squared(mean_m, variance) - squared(reported.mean_m, reported.variance));
            RangeTerm { mean_m, variance, exponent }
        });
        [Some(reported), near_zero]
    }

    /// Moments of the posterior, without the constants of the three normal densities.
    fn moments(&self, uav_rel_target: &Vector2<f64>, information: &Matrix2<f64>, is_wide: bool) -> Option<Moments> {
        let (power, terms) = (usize::from(!is_wide), self.range_terms(is_wide));
        let limit_rad = (ERROR_SDS * self.variances[1].sqrt()).min(PI);
        let (mut middle_rad, mut half_width_rad) = (0.0, limit_rad);
        for pass in 1.. {
            let step_rad = half_width_rad / f64::from(HALF);
            let offsets = (-HALF..=HALF).map(|index| middle_rad + f64::from(index) * step_rad);
            let offsets = offsets.filter(|offset_rad| offset_rad.abs() <= limit_rad * (1.0 + 1e-12));
            let line = |offset_rad, term| self.line(offset_rad, term, uav_rel_target, information);
            let lines =
                offsets.flat_map(|offset_rad| terms.iter().flatten().filter_map(move |term| line(offset_rad, term)));
            let lines: Vec<Line> = lines.collect();
            let peak = lines.iter().map(|line| line.exponent).fold(f64::NEG_INFINITY, f64::max);
            let mut sum = Moments::default();
            for Line { offset_rad, exponent, direction, radial } in &lines {
                let radial = radial.map(|moment| moment * math::exp(exponent - peak));
                let [one, r, r2] = core::array::from_fn(|i| radial[power + i]);
                sum.integral += radial[1];
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
                sum.integral = sum.integral * step_rad * math::exp(peak);
                return Some(sum);
            }
            (middle_rad, half_width_rad) = (mean_rad, wider_rad);
        }
        None
    }

    /// Density along the line of sight with an offset from the measured bearing, for one term of the range; `None` if it
    /// points away from the target.
    fn line(
        &self,
        offset_rad: f64,
        term: &RangeTerm,
        uav_rel_target: &Vector2<f64>,
        information: &Matrix2<f64>,
    ) -> Option<Line> {
        let bearing = self.measurement.bearing + crate::Angle::from_rad(offset_rad);
        let direction = Displacement::from_polar(1.0, bearing).vector();
        let across = information * uav_rel_target;
        let precision = direction.dot(&(information * direction)) + 1.0 / term.variance;
        let sd_m = 1.0 / precision.sqrt();
        let mean_m = (term.mean_m / term.variance - direction.dot(&across)) / precision;
        if mean_m.is_nan() || mean_m < -BEHIND_SDS * sd_m {
            return None;
        }
        // At the maximum over r, without cancellation.
        let at = uav_rel_target + direction * mean_m;
        let off_m = term.mean_m - mean_m;
        let squared = at.dot(&(information * at)) + off_m * off_m / term.variance;
        let exponent = term.exponent - 0.5 * (squared + offset_rad * offset_rad / self.variances[1]);
        let sds = mean_m / sd_m;
        let all_m = sd_m * (0.5 * PI).sqrt() * math::erfc(-sds * core::f64::consts::FRAC_1_SQRT_2);
        let r = mean_m * all_m + sd_m * sd_m * math::exp(-0.5 * sds * sds);
        let r2 = mean_m * r + sd_m * sd_m * all_m;
        let r3 = mean_m * r2 + 2.0 * sd_m * sd_m * r;
        Some(Line { offset_rad, exponent, direction, radial: [all_m, r, r2, r3] })
    }
}

/// A Gaussian of the range, and the logarithm of its maximum.
#[derive(Debug, Clone, Copy)]
struct RangeTerm {
    mean_m: f64,
    variance: f64,
    exponent: f64,
}

/// Posterior density along a line of sight.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Bearing relative to the measured one, rad.
    offset_rad: f64,
    /// Logarithm of the largest density.
    exponent: f64,
    direction: Vector2<f64>,
    /// Integrals of 1, r, r2 and r3 over the density as a fraction of the largest one.
    radial: [f64; 4],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Angle;
    use crate::params::TeamParams;
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
        NearMeasurement { uav: Position::from_m(5.0, -3.0), measurement, variances, uav_covariance: Matrix2::zeros() }
    }

    /// Density, mean and covariance of the position, by summation over a fine grid of ranges and bearings. Of a wide
    /// prior, all ranges are equally likely.
    fn summed(prior: &Estimate, near: &NearMeasurement, is_wide: bool) -> (f64, Vector2<f64>, Matrix2<f64>) {
        const STEP_M: f64 = 0.1;
        let [range_sd_m, bearing_sd_rad] = near.variances.map(f64::sqrt);
        let step_rad = (6.0 * bearing_sd_rad).min(PI) / 100.0;
        let (at, covariance) = (prior.state.position().vector(), prior.position_covariance());
        let information = inverse_2(&covariance).unwrap();
        let (mut integral, mut weight, mut first, mut second) = (0.0, 0.0, Vector2::zeros(), Matrix2::zeros());
        for row in 0..1500 {
            let r = (f64::from(row) + 0.5) * STEP_M;
            let off = (near.measurement.range_m - r) / range_sd_m;
            let range = math::exp(-0.5 * off * off);
            let positive = 0.5 * math::erfc(-r / range_sd_m * core::f64::consts::FRAC_1_SQRT_2);
            for column in -100..100 {
                let offset_rad = (f64::from(column) + 0.5) * step_rad;
                let bearing = near.measurement.bearing + Angle::from_rad(offset_rad);
                let x = (near.uav + Displacement::from_polar(r, bearing)).vector();
                let squared = offset_rad * offset_rad / near.variances[1] + (x - at).dot(&(information * (x - at)));
                let density = range * math::exp(-0.5 * squared);
                let (area, factor) = if is_wide { (r, 1.0) } else { (r / positive, r / positive) };
                integral += density * area;
                weight += density * factor;
                first += x * (density * factor);
                second += x * x.transpose() * (density * factor);
            }
        }
        let mean = first / weight;
        let normalisation = (information.determinant() / (near.variances[0] * near.variances[1])).sqrt() / (TAU * TAU);
        (integral * STEP_M * step_rad * normalisation, mean, second / weight - mean * mean.transpose())
    }

    /// UAVs within and outside the standard deviations of the prediction, precise and coarse sensors.
    #[test]
    fn moments_and_density_equal_those_of_a_fine_grid() {
        for (x_m, y_m, sd_m, range_m, bearing_deg, sds, is_wide) in [
            (20.0, 4.0, 6.0, 22.0, 30.0, [10.0, 3.0], true),
            (8.0, -1.0, 10.0, 14.0, -170.0, [10.0, 3.0], true),
            (8.0, -1.0, 4.0, 6.0, 100.0, [30.0, 10.0], true),
            (40.0, 10.0, 1.5, 30.0, 14.0, [3.0, 10.0], false),
            (25.0, 5.0, 8.0, 28.0, 20.0, [30.0, 60.0], true),
            (32.0, 5.0, 3.0, 20.0, 30.0, [40.0, 10.0], false),
            (50.0, 10.0, 10.0, 95.0, 10.0, [30.0, 3.0], false),
        ] {
            let (estimate, near) = (prior(x_m, y_m, sd_m), near(range_m, bearing_deg, sds));
            let mut updated = estimate;
            let density = near.update(&mut updated).unwrap();
            let (expected_density, mean, covariance) = summed(&estimate, &near, is_wide);
            assert!((density / expected_density - 1.0).abs() < 2e-3, "{density} {expected_density}");
            assert!((updated.state.position().vector() - mean).norm() < 0.02, "{mean} {updated:?}");
            assert!((updated.position_covariance() - covariance).norm() < 1e-3 * covariance.norm(), "{covariance}");
            // The velocity changes with the position, by their correlation.
            let change = updated.state.position().vector() - estimate.state.position().vector();
            let gain = estimate.covariance.matrix().fixed_view::<1, 1>(1, 0)[0];
            assert!(change.norm() > 0.1 && gain > 0.0 && updated.state.0[1] != estimate.state.0[1]);
            assert!(updated.checked().is_some());
        }
    }

    /// Mean normalised error squared (2 is consistent) and mean distance from the truth, m, of both updates, over 4,000
    /// measurements with a positive range, by a UAV whose position has an error of `uav_sd_m` per axis. Targets are
    /// distributed as predicted; or `target` is given, predictions are distributed about it, and the sensor with a field
    /// of view of 70 degrees points at them.
    fn errors(estimate: &Estimate, target: Option<Vector2<f64>>, sds: [f64; 2], uav_sd_m: f64) -> [[f64; 2]; 2] {
        let mut normals = normals(7);
        let root = estimate.position_covariance().cholesky().unwrap().l();
        let mut sums = [[0.0; 2]; 2];
        let mut n = 0.0;
        while n < 4000.0 {
            let mut estimate = *estimate;
            let mut truth = estimate.state.position().vector() + root * Vector2::from(normals());
            if let Some(target) = target {
                let off = truth - estimate.state.position().vector();
                (estimate.state.0[0], estimate.state.0[3]) = (target.x + off.x, target.y + off.y);
                truth = target;
            }
            let at = NearMeasurement {
                uav_covariance: Matrix2::from_diagonal_element(uav_sd_m * uav_sd_m),
                ..near(0.0, 0.0, sds)
            };
            let [x, y] = normals();
            let true_uav = at.uav + Displacement::from_m(uav_sd_m * x, uav_sd_m * y);
            let exact = sensor::measure(true_uav, Position::from(truth));
            let boresight = sensor::measure(at.uav, estimate.state.position()).bearing;
            let [of_range, of_bearing] = normals();
            let bearing = exact.bearing + Angle::from_rad(at.variances[1].sqrt() * of_bearing);
            let measurement = RangeBearingMeasurement { range_m: exact.range_m + sds[0] * of_range, bearing };
            let is_in_view = target.is_none() || (exact.bearing - boresight).abs_rad() < 35f64.to_radians();
            if measurement.range_m <= 0.0 || !is_in_view {
                continue;
            }
            n += 1.0;
            let at = NearMeasurement { measurement, ..at };
            let mut linearised = estimate;
            at.linearised(&mut linearised);
            at.apply(&mut estimate);
            for (sum, estimate) in sums.iter_mut().zip([estimate, linearised]) {
                let off = estimate.state.position().vector() - truth;
                sum[0] += off.dot(&(inverse_2(&estimate.position_covariance()).unwrap() * off));
                sum[1] += off.norm();
            }
        }
        sums.map(|sum| sum.map(|sum| sum / n))
    }

    #[test]
    fn updates_from_nearby_are_consistent_and_linearised_ones_are_not() {
        // With a wide prior and coarse ranges, near targets are favoured; those distributed as predicted are farther.
        for (x_m, sd_m, sds, uav_sd_m, max) in [
            (20.0, 8.0, [10.0, 3.0], 0.0, 3.0),
            (25.0, 12.0, [1.0, 1.0], 0.0, 2.15),
            (45.0, 12.0, [10.0, 1.0], 0.0, 2.15),
            (45.0, 12.0, [3.0, 1.0], 4.0, 2.15),
        ] {
            let [[nees, error_m], [linearised_nees, linearised_error_m]] =
                errors(&prior(x_m, 2.0, sd_m), None, sds, uav_sd_m);
            assert!((1.85..max).contains(&nees) && linearised_nees > 3.0, "{nees} {linearised_nees}");
            assert!(error_m < 0.85 * linearised_error_m, "{error_m} {linearised_error_m}");
        }
    }

    /// A target 10 or 20 m from the UAV, known to 20 m: a range may be mostly noise, and positive ranges and a sensor that
    /// points at the prediction make the target seem farther away.
    #[test]
    fn the_first_measurement_of_a_target_below_the_uav_is_better_than_linearised_for_any_range_noise() {
        let mut estimate = prior(0.0, 0.0, 20.0);
        estimate.covariance = Covariance::from_diagonal([400.0, 4.0, 0.04, 400.0, 4.0, 0.04]);
        for range_m in [10.0, 20.0] {
            let target = Vector2::new(5.0 + 0.8 * range_m, -3.0 + 0.6 * range_m);
            for sds in [[1.0, 3.0], [10.0, 0.5], [30.0, 3.0], [50.0, 10.0]] {
                let [[nees, error_m], [_, linearised_error_m]] = errors(&estimate, Some(target), sds, 0.0);
                assert!((1.5..3.0).contains(&nees), "{range_m} {sds:?} {nees}");
                assert!(error_m < linearised_error_m, "{range_m} {sds:?} {error_m} {linearised_error_m}");
            }
        }
    }

    /// At the limit of `is_nonlinear`, both updates have nearly the same variances and errors.
    #[test]
    fn both_updates_agree_where_they_meet() {
        let sensor = TeamParams::recommended().track.sensor;
        let mut estimate = prior(290.0, -3.0, 8.0);
        let trace_m2 = |factor: f64| move || factor * LINEAR_MAX * 285.0 * 285.0;
        let uav = near(285.0, 0.0, [10.0, 3.0]).uav;
        assert!(sensor.is_nonlinear(uav, estimate.state.position(), trace_m2(1.001)));
        assert!(!sensor.is_nonlinear(uav, estimate.state.position(), trace_m2(0.999)));
        assert!(!TeamParams::paper().track.sensor.is_nonlinear(uav, estimate.state.position(), trace_m2(1e6)));
        let farther = estimate.state.position() + Displacement::from_m(20.0, 0.0);
        assert!(!sensor.is_nonlinear(uav, farther, trace_m2(1.001)));
        estimate.covariance =
            estimate.covariance * (LINEAR_MAX * 285.0 * 285.0 / estimate.position_covariance().trace());
        let [near, linearised] = errors(&estimate, None, [10.0, 3.0], 0.0);
        assert!(
            (near[0] - linearised[0]).abs() < 0.02 && (near[1] / linearised[1] - 1.0).abs() < 0.002,
            "{near:?} {linearised:?}"
        );
    }

    /// Standard deviations per axis of 8 % to 30 % of a range of 800 m. From 10 % on, the measurement is not linearised.
    #[test]
    fn uncertain_targets_are_updated_without_linearisation_at_any_range() {
        let sensor = TeamParams::recommended().track.sensor;
        let always_linearised = SensorParams { linear_sd_fraction_max: 0.0, ..sensor };
        let paper = TeamParams::paper().track.sensor;
        for sd_m in [64.0, 79.0, 81.0, 160.0, 240.0] {
            let mut estimate = prior(805.0, -3.0, sd_m);
            estimate.covariance = Covariance::from_diagonal([sd_m * sd_m, 25.0, 0.01, sd_m * sd_m, 25.0, 0.01]);
            let uav = near(0.0, 0.0, [10.0, 3.0]).uav;
            let is_nonlinear = |sensor: &SensorParams| {
                sensor.is_nonlinear(uav, estimate.state.position(), || estimate.position_covariance().trace())
            };
            assert_eq!(is_nonlinear(&sensor), sd_m > 80.0, "{sd_m}");
            assert!(!is_nonlinear(&always_linearised) && !is_nonlinear(&paper));
            let [integrated, linearised] = errors(&estimate, None, [10.0, 3.0], 0.0);
            assert!((1.85..2.15).contains(&integrated[0]), "{sd_m}: {integrated:?}");
            assert!(integrated[1] < linearised[1], "{sd_m}: {integrated:?} {linearised:?}");
            assert!(sd_m < 80.0 || linearised[0] > 2.5, "{sd_m}: {linearised:?}");
        }
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
        assert!(updated != estimate && updated.checked().is_some());
    }
}
