//! Gaussian over the state of a target: conditioning on scalar measurements, and moments of mixtures.

use nalgebra::{Matrix6, Vector6};

use crate::covariance::Covariance;
use crate::target::TargetState;
use crate::tracking::information_filter::Estimate;
use crate::tracking::pose_error::PoseVariance;

/// A scalar measurement, linear in the state: `h' x` with additive noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinearMeasurement {
    /// Row h of the measurement matrix.
    pub(crate) h: Vector6<f64>,
    /// Measured value of `h' x`.
    pub(crate) value: f64,
    /// Variance of the noise.
    pub(crate) variance: f64,
    /// Derivative of the measured value in the heading that the UAV assumes.
    pub(crate) heading_derivative: f64,
}

/// Mean and covariance of a Gaussian over the state, component order as in [`TargetState`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gaussian {
    pub(crate) mean: Vector6<f64>,
    pub(crate) covariance: Matrix6<f64>,
}

impl From<&Estimate> for Gaussian {
    fn from(estimate: &Estimate) -> Self {
        Self { mean: estimate.state.0, covariance: estimate.covariance.matrix() }
    }
}

impl From<&Gaussian> for Estimate {
    fn from(gaussian: &Gaussian) -> Self {
        Self { state: TargetState(gaussian.mean), covariance: Covariance::from(&gaussian.covariance) }
    }
}

impl LinearMeasurement {
    /// This measurement with the variance that a pose error requires, for a target that is predicted at `prior`; `None`
    /// if it contains no information then.
    pub(crate) fn with_pose_error(self, of_pose: &PoseVariance, prior: &Gaussian) -> Option<Self> {
        let weight = of_pose.weight(self.variance, prior.project(&self.h).1);
        (weight > 0.0).then(|| Self { variance: 1.0 / weight, ..self })
    }
}

impl Gaussian {
    /// Mean and variance of `h' x`.
    pub(crate) fn project(&self, h: &Vector6<f64>) -> (f64, f64) {
        (h.dot(&self.mean), h.dot(&(self.covariance * h)))
    }

    /// Conditions on a measurement. Returns how its value differs from the prediction: the squared distance in standard
    /// deviations, and the variance.
    pub(crate) fn condition(&mut self, measurement: &LinearMeasurement) -> (f64, f64) {
        let LinearMeasurement { h, value, variance, .. } = measurement;
        let with_h = self.covariance * h;
        let total_variance = h.dot(&with_h) + variance;
        let gain = with_h / total_variance;
        let innovation = value - h.dot(&self.mean);
        self.mean += gain * innovation;
        self.covariance -= gain * with_h.transpose();
        (innovation * innovation / total_variance, total_variance)
    }

    /// Like [`Self::condition`], for a measurement with a pose error.
    pub(crate) fn condition_with_pose_error(
        &mut self,
        measurement: &LinearMeasurement,
        of_pose: &PoseVariance,
    ) -> (f64, f64) {
        let (mean, variance) = self.project(&measurement.h);
        let total_variance = variance + measurement.variance + of_pose.total();
        let innovation = measurement.value - mean;
        if let Some(measurement) = measurement.with_pose_error(of_pose, self) {
            self.condition(&measurement);
        }
        (innovation * innovation / total_variance, total_variance)
    }
}

/// Weighted sum of Gaussians. Weights can be negative, as long as the sum is a density.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mixture {
    weight: f64,
    first_moment: Vector6<f64>,
    /// About `origin`, to which the first moment is relative, too.
    second_moment: Matrix6<f64>,
    origin: Vector6<f64>,
}

impl Mixture {
    /// Empty mixture. `origin` should be near the means: it keeps the moments small and so their rounding.
    pub(crate) fn about(origin: Vector6<f64>) -> Self {
        Self { origin, ..Self::default() }
    }

    /// Sum of the weights.
    pub(crate) fn weight(&self) -> f64 {
        self.weight
    }

    pub(crate) fn add(&mut self, weight: f64, gaussian: &Gaussian) {
        let mean = gaussian.mean - self.origin;
        self.weight += weight;
        self.first_moment += mean * weight;
        self.second_moment += (gaussian.covariance + mean * mean.transpose()) * weight;
    }

    /// Gaussian with the mean and the covariance of the mixture; `None` if its weight is not positive.
    pub(crate) fn moments(&self) -> Option<Gaussian> {
        if self.weight <= 0.0 {
            return None;
        }
        let mean = self.first_moment / self.weight;
        let covariance = self.second_moment / self.weight - mean * mean.transpose();
        Some(Gaussian { mean: mean + self.origin, covariance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussian(x_m: f64, sd_m: f64) -> Gaussian {
        let mut mean = Vector6::zeros();
        mean[0] = x_m;
        Gaussian { mean, covariance: Matrix6::identity() * (sd_m * sd_m) }
    }

    #[test]
    fn conditioning_weighs_prior_and_measurement_by_their_variances() {
        let mut estimate = gaussian(10.0, 2.0);
        let h = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (squared, variance) =
            estimate.condition(&LinearMeasurement { h, value: 15.0, variance: 1.0, heading_derivative: 0.0 });
        assert!((estimate.mean[0] - 14.0).abs() < 1e-12 && (estimate.covariance[(0, 0)] - 0.8).abs() < 1e-12);
        assert_eq!((squared, variance), (5.0, 5.0));
        assert_eq!(estimate.covariance[(1, 1)], 4.0);
    }

    #[test]
    fn moments_of_a_mixture_include_the_distance_of_the_means() {
        let mut mixture = Mixture::about(gaussian(1e6, 1.0).mean);
        mixture.add(0.5, &gaussian(1e6 - 3.0, 1.0));
        mixture.add(0.5, &gaussian(1e6 + 3.0, 1.0));
        let moments = mixture.moments().unwrap();
        assert!((moments.mean[0] - 1e6).abs() < 1e-9 && (moments.covariance[(0, 0)] - 10.0).abs() < 1e-9);
        assert!(Mixture::about(Vector6::zeros()).moments().is_none());
    }
}
