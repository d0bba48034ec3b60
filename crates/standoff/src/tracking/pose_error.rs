//! Errors of a UAV's own position and heading, as parts of its measurement errors.
//!
//! A pose error is nearly the same in successive scans, so that a filter that averages scans does not reduce it. Its
//! variance s^2 is therefore inflated. Let a be the correlation of the error over a time step, P the predicted variance
//! of the measured quantity, R the variance of the noise and R' the variance that replaces R. The filter weights each
//! new measurement with the gain P / (P + R'), and keeps b = R' / (P + R') of the older ones. A first-order filter with
//! this gain reduces a correlated error less than white noise, by the factor (1 + b a) / (1 - b a) of the variances:
//!
//! ```text
//! R' = R + s^2 (1 + kappa 2 b a / (1 - b a)),   b = R' / (P + R')
//! ```
//!
//! `kappa` is 1 for a first-order filter, and less for the target model of the tracks, which overshoots. The equations
//! have one positive solution: `d R'^2 + B R' = P (R + s^2)` with `d = 1 - a` and `B = P - d (R + s^2) - 2 kappa a s^2`.
//! An error that never changes has a = 1: a measurement then counts only as far as the prediction is less certain than
//! the pose.

use nalgebra::{Matrix2, Vector2};

use crate::frame::Position;
use crate::math;
use crate::params::SensorParams;
use crate::sensor;
use crate::time::Duration;

/// Share of the correlation factor that applies to the filter of a track, see the description of the module. Calibrated
/// with missions of `improved/figure-9` and `tour/10-unlabelled-detections` (seeds from 5001).
const KAPPA: f64 = 0.7;

/// Pose error of a UAV: variances, and how much the error changes from one time step to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseError {
    /// Variance of the position, per axis, m2.
    position: f64,
    /// Variance of the heading, rad2.
    heading: f64,
    /// One minus the correlation of the position error over a time step.
    change: f64,
}

/// Variance of a measured value due to the pose error, in the unit of the value squared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseVariance {
    position: f64,
    heading: f64,
    change: f64,
}

impl PoseError {
    /// Pose error that a sensor model assumes over a time step of `dt`; `None` without errors.
    pub(crate) fn new(sensor: &SensorParams, dt: Duration) -> Option<Self> {
        let SensorParams { own_position_sd_m, own_position_correlation_s, own_heading_sd_rad, .. } = *sensor;
        if own_position_sd_m <= 0.0 && own_heading_sd_rad <= 0.0 {
            return None;
        }
        let correlation =
            if own_position_correlation_s > 0.0 { math::exp(-dt.s() / own_position_correlation_s) } else { 0.0 };
        Some(Self {
            position: own_position_sd_m * own_position_sd_m,
            heading: own_heading_sd_rad * own_heading_sd_rad,
            change: 1.0 - correlation,
        })
    }

    /// Variance of a value, with the squared length of its gradient in the position and its derivative in the heading.
    pub(crate) fn of_value(&self, position_gradient_squared: f64, heading_derivative: f64) -> PoseVariance {
        PoseVariance {
            position: self.position * position_gradient_squared,
            heading: self.heading * heading_derivative * heading_derivative,
            change: self.change,
        }
    }

    /// Variances of range (m2) and bearing (rad2) at a range.
    pub(crate) fn of_measurement(&self, range_m: f64) -> [PoseVariance; 2] {
        [self.of_value(1.0, 0.0), self.of_value(1.0 / (range_m * range_m), 1.0)]
    }

    /// Weights 1 / R' of a range and a bearing measured from `uav`. The target is predicted at `predicted` with the
    /// covariance `prior`, m2.
    pub(crate) fn weights(
        &self,
        sensor: &SensorParams,
        uav: Position,
        predicted: Position,
        prior: &Matrix2<f64>,
    ) -> [f64; 2] {
        let target_rel_uav = predicted - uav;
        let range_m = target_rel_uav.length_m();
        let [range, bearing] = self.of_measurement(range_m);
        let [along, across] = sensor::jacobian_rows(range_m, target_rel_uav).map(|row| row.dot(&(prior * row)));
        let noise = [sensor.range_sd_m, sensor.bearing_sd_rad].map(|sd| sd * sd);
        [range.weight(noise[0], along), bearing.weight(noise[1], across)]
    }
}

impl SensorParams {
    /// Covariance of the position of a UAV, m2, and variance of its heading, rad2. Along the line of sight to a predicted
    /// position they are inflated as the error of a range, across it as that of a bearing.
    pub(crate) fn pose_covariance(
        &self,
        pose_error: Option<&PoseError>,
        uav: Position,
        predicted: Position,
        prior: impl Fn() -> Matrix2<f64>,
    ) -> (Matrix2<f64>, f64) {
        let Some(error) = pose_error else { return (Matrix2::zeros(), 0.0) };
        let inflated = error.weights(self, uav, predicted, &prior()).map(f64::recip);
        let noise = self.noise_weights().map(f64::recip);
        let totals = error.of_measurement(uav.distance_m(predicted)).map(|of_pose| of_pose.total());
        let factor = |value: usize| {
            if totals[value] > 0.0 { ((inflated[value] - noise[value]) / totals[value]).max(0.0) } else { 0.0 }
        };
        let along = (predicted - uav).vector().normalize();
        let across = Vector2::new(-along.y, along.x);
        let position = (along * along.transpose()) * factor(0) + (across * across.transpose()) * factor(1);
        (position * error.position, error.heading * factor(1))
    }
}

impl PoseVariance {
    /// Variance of one value.
    pub(crate) fn total(&self) -> f64 {
        self.position + self.heading
    }

    /// Weight 1 / R' of a measured value: with noise of the variance `noise`, predicted with the variance `prior`.
    pub(crate) fn weight(&self, noise: f64, prior: f64) -> f64 {
        self.weight_with(KAPPA, noise, prior)
    }

    fn weight_with(&self, kappa: f64, noise: f64, prior: f64) -> f64 {
        let total = self.total();
        if total <= 0.0 {
            return 1.0 / noise;
        }
        // Mean over both errors; a heading error does not change.
        let change = self.change * self.position / total;
        let b = prior - change * (noise + total) - 2.0 * kappa * (1.0 - change) * total;
        let c = prior * (noise + total);
        let root = (b * b + 4.0 * change * c).sqrt();
        // Two forms of the same value, without cancellation.
        let weight = if b > 0.0 { (root + b) / (2.0 * c) } else { 2.0 * change / (root - b) };
        if weight.is_finite() { weight } else { 0.0 }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::Displacement;
    use crate::params::TeamParams;
    use crate::sensor::RangeBearingMeasurement;

    fn sensor() -> SensorParams {
        SensorParams {
            own_position_sd_m: 6.0,
            own_position_correlation_s: 30.0,
            own_heading_sd_rad: 0.04,
            ..TeamParams::paper().track.sensor
        }
    }

    fn pose_error() -> PoseError {
        PoseError::new(&sensor(), Duration::from_s(0.5)).unwrap()
    }

    /// Standard normals, by Box and Muller from a linear congruential generator.
    pub(crate) fn normals(seed: usize) -> impl FnMut() -> [f64; 2] {
        let mut state = seed as u64;
        let mut uniform = move || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        move || {
            let (radius, angle) = ((-2.0 * math::ln(uniform())).sqrt(), math::TAU * uniform());
            [radius * math::cos(angle), radius * math::sin(angle)]
        }
    }

    /// Ranges and bearings measured from poses with errors, and the positions computed from them, against the assumed
    /// variances.
    #[test]
    fn variances_of_a_measurement_equal_those_of_measurements_from_wrong_poses() {
        let (sensor, n) = (sensor(), 40_000);
        let mut normals = normals(n);
        let assumed = Position::from_m(100.0, -50.0);
        let target = assumed + Displacement::from_polar(300.0, Angle::from_deg(35.0));
        let expected = sensor::measure(assumed, target);
        let mut squares = [0.0; 2];
        let mut spread = Matrix2::zeros();
        for _ in 0..n {
            let [[x, y], [heading, _], [range_noise, bearing_noise]] = [normals(), normals(), normals()];
            // The pose is right, and the UAV assumes a wrong one.
            let truth = assumed + Displacement::from_m(sensor.own_position_sd_m * x, sensor.own_position_sd_m * y);
            let exact = sensor::measure(truth, target);
            let error_rad = sensor.own_heading_sd_rad * heading + sensor.bearing_sd_rad * bearing_noise;
            let z = RangeBearingMeasurement {
                range_m: exact.range_m + sensor.range_sd_m * range_noise,
                bearing: exact.bearing + Angle::from_rad(error_rad),
            };
            let off = [z.range_m - expected.range_m, (z.bearing - expected.bearing).rad()];
            squares.iter_mut().zip(off).for_each(|(sum, off)| *sum += off * off / n as f64);
            let off = (sensor.to_cartesian(assumed, &z).0 - target).vector();
            spread += off * off.transpose() / n as f64;
        }
        let variances = sensor.measurement_variances(expected.range_m);
        let of_pose = pose_error().of_measurement(expected.range_m);
        let noise = [sensor.range_sd_m, sensor.bearing_sd_rad].map(|sd| sd * sd);
        for value in 0..2 {
            let variance = noise[value] + of_pose[value].total();
            assert!((variance / variances[value] - 1.0).abs() < 1e-12);
            // Five standard errors, and the curvature of range and bearing.
            assert!((squares[value] / variance - 1.0).abs() < 5.0 * (2.0 / n as f64).sqrt() + 0.005, "{squares:?}");
        }
        let covariance = sensor.to_cartesian(assumed, &expected).1;
        assert!((spread - covariance).norm() < 0.05 * covariance.norm(), "{spread} {covariance}");
    }

    /// The weight solves the equations of the module, for each share of the two errors.
    #[test]
    fn inflated_variance_solves_its_equations() {
        for (position, heading) in [(9.0, 0.0), (9.0, 150.0), (0.5, 20.0)] {
            for (noise, prior) in [(100.0, 20.0), (100.0, 400.0), (400.0, 5000.0), (2.0, 30.0)] {
                let of_pose = PoseVariance { position, heading, change: 0.02 };
                let inflated = 1.0 / of_pose.weight(noise, prior);
                let a = 1.0 - 0.02 * position / (position + heading);
                let b = inflated / (prior + inflated);
                let factor = 1.0 + KAPPA * 2.0 * a * b / (1.0 - a * b);
                let expected = noise + (position + heading) * factor;
                assert!((inflated / expected - 1.0).abs() < 1e-9, "{inflated}, {expected}");
            }
        }
    }

    #[test]
    fn weight_has_its_limits() {
        let constant = PoseVariance { position: 0.0, heading: 25.0, change: 0.02 };
        let changing = PoseVariance { position: 25.0, heading: 0.0, change: 0.02 };
        for of_pose in [constant, changing] {
            // An uncertain prediction: the errors of a single measurement count.
            assert!((of_pose.weight(100.0, 1e9) * 125.0 - 1.0).abs() < 1e-3);
        }
        // A prediction that is more certain than a constant error gains nothing from it.
        assert_eq!(constant.weight(100.0, 1.9 * KAPPA * 25.0), 0.0);
        // A changing error is white noise for a filter with a very long memory.
        let white = 100.0 + 25.0 * (1.0 + KAPPA * 2.0 * 0.98 / 0.02);
        assert!((changing.weight(100.0, 1e-9) * white - 1.0).abs() < 1e-6);
        assert_eq!(PoseVariance { position: 0.0, heading: 0.0, change: 0.02 }.weight(4.0, 9.0), 0.25);
        for prior in [0.0, 1e-300, 1e300, f64::INFINITY] {
            for of_pose in [constant, changing] {
                assert!(of_pose.weight(1e-6, prior) >= 0.0, "{prior}");
            }
        }
    }

    #[test]
    fn exact_poses_need_no_work() {
        let exact = SensorParams { own_position_sd_m: 0.0, own_heading_sd_rad: 0.0, ..sensor() };
        assert_eq!(PoseError::new(&exact, Duration::from_s(0.5)), None);
        assert_eq!(exact.measurement_variances(400.0).map(f64::recip), exact.noise_weights());
    }

    /// A scalar random walk, measured with white noise and a correlated error: the first-order filter with `kappa` 1
    /// computes the variance of its error, whether it is slow or fast. Without inflation it computes too little.
    #[test]
    fn first_order_filter_of_correlated_errors_is_consistent() {
        let (noise, error, change) = (100.0, 25.0, 1.0 - math::exp(-0.5 / 30.0));
        let of_pose = PoseVariance { position: error, heading: 0.0, change };
        for process in [0.5_f64, 5.0, 50.0] {
            let ratio = |inflated: bool| {
                let mut normals = normals(7);
                let (mut truth, mut estimate, mut variance, mut off) = (0.0, 0.0, 100.0, 0.0);
                let (mut squares, mut steps) = (0.0, 0);
                for step in 0..100_000 {
                    let [[walk, white], [correlated, _]] = [normals(), normals()];
                    truth += process.sqrt() * walk;
                    let kept = 1.0 - change;
                    off = kept * off + (error * (1.0 - kept * kept)).sqrt() * correlated;
                    let z = truth + off + 10.0 * white;
                    variance += process;
                    let weight = if inflated { of_pose.weight_with(1.0, noise, variance) } else { 1.0 / noise };
                    let gain = variance * weight / (1.0 + variance * weight);
                    estimate += gain * (z - estimate);
                    variance *= 1.0 - gain;
                    if step > 1000 {
                        squares += (estimate - truth) * (estimate - truth) / variance;
                        steps += 1;
                    }
                }
                squares / f64::from(steps)
            };
            let (with, without) = (ratio(true), ratio(false));
            assert!((0.9..1.1).contains(&with) && without > 1.2, "{process}: {with}, without {without}");
        }
    }

    /// A single measurement has the errors of one pose; a settled track gains little from further ones.
    #[test]
    fn the_pose_covariance_grows_as_the_prediction_becomes_certain() {
        let predicted = Position::from_m(0.0, 20.0);
        let covariance = |error: Option<&PoseError>, prior_m2: f64| {
            sensor().pose_covariance(error, Position::ORIGIN, predicted, || Matrix2::from_diagonal_element(prior_m2))
        };
        assert_eq!(covariance(None, 1.0), (Matrix2::zeros(), 0.0));
        let error = pose_error();
        let (position, heading) = covariance(Some(&error), 1e8);
        assert!((position / 36.0 - Matrix2::identity()).norm() < 1e-3 && (heading / 0.0016 - 1.0).abs() < 1e-3);
        let (settled, _) = covariance(Some(&error), 4.0);
        assert!(settled[(0, 0)] > 72.0 && settled[(1, 1)] > 72.0, "{settled}");
        assert!(settled[(0, 1)].abs() < 1e-9);
    }

    /// The weights of a measurement use the predicted variances along and across the line of sight.
    #[test]
    fn weights_follow_the_prediction_along_and_across_the_line_of_sight() {
        let (sensor, error) = (sensor(), pose_error());
        let predicted = Position::from_m(0.0, 400.0);
        let prior = Matrix2::from_diagonal(&Vector2::new(900.0, 16.0));
        let weights = error.weights(&sensor, Position::ORIGIN, predicted, &prior);
        let [range, bearing] = error.of_measurement(400.0);
        let bearing_variance = sensor.bearing_sd_rad * sensor.bearing_sd_rad;
        let expected = [range.weight(100.0, 16.0), bearing.weight(bearing_variance, 900.0 / 160_000.0)];
        for (weight, expected) in weights.into_iter().zip(expected) {
            assert!((weight / expected - 1.0).abs() < 1e-9);
        }
    }
}
