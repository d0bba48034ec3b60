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

use nalgebra::Matrix2;

use crate::frame::Position;
use crate::math;
use crate::params::SensorParams;
use crate::sensor;
use crate::time::Duration;

/// Share of the correlation factor that applies to the filter of a track, see the description of the module. Calibrated
/// with missions of `improved/figure-9`.
const KAPPA: f64 = 0.6;

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

    /// Weights 1 / R' of a range and a bearing measured from `uav`. The target is predicted at `predicted`, at the range
    /// `range_m`, with the covariance `prior`, m2.
    pub(crate) fn weights(
        &self,
        sensor: &SensorParams,
        uav: Position,
        predicted: Position,
        range_m: f64,
        prior: &Matrix2<f64>,
    ) -> [f64; 2] {
        let [range, bearing] = self.of_measurement(range_m);
        let [along, across] = sensor::jacobian_rows(range_m, predicted - uav).map(|row| row.dot(&(prior * row)));
        let noise = [sensor.range_sd_m, sensor.bearing_sd_rad].map(|sd| sd * sd);
        [range.weight(noise[0], along), bearing.weight(noise[1], across)]
    }
}

impl PoseVariance {
    /// Variance of one value.
    pub(crate) fn total(&self) -> f64 {
        self.position + self.heading
    }

    /// Weight 1 / R' of a measured value: with noise of the variance `noise`, predicted with the variance `prior`.
    pub(crate) fn weight(&self, noise: f64, prior: f64) -> f64 {
        let total = self.total();
        if total <= 0.0 {
            return 1.0 / noise;
        }
        // Mean over both errors; a heading error does not change.
        let change = self.change * self.position / total;
        let b = prior - change * (noise + total) - 2.0 * kappa() * (1.0 - change) * total;
        let c = prior * (noise + total);
        let root = (b * b + 4.0 * change * c).sqrt();
        // Two forms of the same value, without cancellation.
        let weight = if b > 0.0 { (root + b) / (2.0 * c) } else { 2.0 * change / (root - b) };
        if weight.is_finite() { weight } else { 0.0 }
    }
}

fn kappa() -> f64 {
    static K: std::sync::OnceLock<f64> = std::sync::OnceLock::new();
    *K.get_or_init(|| std::env::var("KAPPA").ok().and_then(|k| k.parse().ok()).unwrap_or(KAPPA))
}
