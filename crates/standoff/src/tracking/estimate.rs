//! Estimate of a target: the mean and covariance of its state. All filters predict and update it: the information filter
//! ([`information_filter`](super::information_filter)), scalar Kalman updates ([`Estimate::condition`]), and the update
//! from nearby ([`near_update`](super::near_update)).

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

use crate::covariance::Covariance;
use crate::target::{TargetState, Transition};
use crate::tracking::pose_error::PoseVariance;

/// Mean and covariance of a state, component order `[x, vx, ax, y, vy, ay]`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// Mean.
    pub state: TargetState,
    /// Covariance P.
    pub covariance: Covariance,
}

impl Estimate {
    /// This estimate; `None` unless all numbers are finite and the covariance is positive definite.
    #[must_use]
    pub fn checked(self) -> Option<Self> {
        inverse(&self.covariance.matrix())?;
        self.is_valid().then_some(self)
    }

    /// Predicts the state over a time step.
    ///
    /// Implements Eq. (8), (9).
    pub fn predict(&mut self, transition: &Transition) {
        self.state = transition.predict(&self.state);
        transition.predict_covariance(&mut self.covariance);
    }

    /// Covariance of the position, m2.
    pub fn position_covariance(&self) -> Matrix2<f64> {
        self.covariance.position()
    }

    /// Standard deviation of the position in its most uncertain direction, m.
    pub fn position_sd_max_m(&self) -> f64 {
        self.covariance.position_sd_max_m()
    }

    /// Information vector y = Y x; `None` if Y cannot be computed numerically.
    pub fn information_vector(&self) -> Option<Vector6<f64>> {
        Some(self.information_matrix()? * self.state.0)
    }

    /// Information matrix Y = P^-1; `None` if it cannot be computed numerically.
    pub fn information_matrix(&self) -> Option<Matrix6<f64>> {
        inverse(&self.covariance.matrix())
    }

    /// Returns true if all numbers are finite and all variances are positive, so no update has exceeded the number
    /// range.
    pub fn is_valid(&self) -> bool {
        let Self { state, covariance } = self;
        let is_positive =
            [0, 3, 5].map(|i| covariance.same_axis[i]).iter().fold(true, |all, v| all & (v.x > 0.0) & (v.y > 0.0));
        // A sum with a term that is not finite is not finite.
        let own: Vector2<f64> = covariance.same_axis.iter().sum();
        let across: f64 = covariance.cross_axis.as_flattened().iter().sum();
        is_positive && (own.x + own.y + across + state.0.sum()).is_finite()
    }

    /// Shifts the mean by `by` and keeps the covariance.
    #[must_use]
    pub(crate) fn shifted(&self, by: &Vector6<f64>) -> Self {
        Self { state: TargetState(self.state.0 + by), ..*self }
    }

    /// Mean and variance of `h' x`.
    pub(crate) fn project(&self, h: &Vector6<f64>) -> (f64, f64) {
        (h.dot(&self.state.0), h.dot(&self.covariance.times(h)))
    }

    /// Conditions on a measurement. Returns how its value differs from the prediction: the squared distance in standard
    /// deviations, and the variance.
    pub(crate) fn condition(&mut self, measurement: &LinearMeasurement) -> (f64, f64) {
        let LinearMeasurement { h, value, variance, .. } = measurement;
        let with_h = self.covariance.times(h);
        let total_variance = h.dot(&with_h) + variance;
        let gain = with_h / total_variance;
        let innovation = value - h.dot(&self.state.0);
        self.state.0 += gain * innovation;
        self.covariance += Covariance::outer(&with_h) * (-1.0 / total_variance);
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

impl LinearMeasurement {
    /// This measurement with the variance that a pose error requires, for a target that is predicted at `prior`; `None`
    /// if it contains no information then.
    pub(crate) fn with_pose_error(self, of_pose: &PoseVariance, prior: &Estimate) -> Option<Self> {
        let weight = of_pose.weight(self.variance, prior.project(&self.h).1);
        (weight > 0.0).then(|| Self { variance: 1.0 / weight, ..self })
    }
}

/// Weighted sum of Gaussian densities. Weights can be negative, as long as the sum is a density.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mixture {
    weight: f64,
    first_moment: Vector6<f64>,
    /// About `origin`, to which the first moment is relative, too.
    second_moment: Covariance,
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

    pub(crate) fn add(&mut self, weight: f64, of: &Estimate) {
        let mean = of.state.0 - self.origin;
        self.weight += weight;
        self.first_moment += mean * weight;
        self.second_moment += of.covariance * weight;
        self.second_moment += Covariance::outer(&mean) * weight;
    }

    /// Mean and covariance of the mixture; `None` if its weight is not positive.
    pub(crate) fn moments(&self) -> Option<Estimate> {
        if self.weight <= 0.0 {
            return None;
        }
        let mean = self.first_moment / self.weight;
        let mut covariance = self.second_moment * (1.0 / self.weight);
        covariance += Covariance::outer(&mean) * -1.0;
        Some(Estimate { state: TargetState(mean + self.origin), covariance })
    }
}

/// Returns true if all values are finite, without branches: all exponent bits of infinities and NaN are set, so adding
/// one carries into the sign bit.
fn are_finite(values: &[f64]) -> bool {
    const ONE_IN_EXPONENT: u64 = 1 << (f64::MANTISSA_DIGITS - 1);
    let carried = values.iter().fold(0, |any, value| any | (value.abs().to_bits() + ONE_IN_EXPONENT));
    carried >> 63 == 0
}

/// Returns true if the covariance is positive definite by more than rounding, independent of the units.
pub(crate) fn is_well_posed(covariance: &Matrix6<f64>) -> bool {
    const MARGIN: f64 = 1e-13;
    let sds = covariance.diagonal().map(f64::sqrt);
    let correlations = Matrix6::from_fn(|row, column| {
        covariance[(row, column)] / (sds[row] * sds[column]) - if row == column { MARGIN } else { 0.0 }
    });
    correlations.cholesky().is_some()
}

/// Inverse of a 2x2 covariance; `None` if it is not positive definite. Only the upper triangle is used.
pub(crate) fn inverse_2(covariance: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let (a, b, d) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    let determinant = a * d - b * b;
    (a > 0.0 && determinant > 0.0).then(|| Matrix2::new(d, -b, -b, a) / determinant)
}

/// Inverse of a symmetric positive definite matrix, exactly symmetric; `None` if the matrix is not positive definite.
fn inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    if !are_finite(matrix.as_slice()) {
        return None;
    }
    let mut inverse = matrix.cholesky()?.inverse();
    inverse.fill_lower_triangle_with_upper_triangle();
    are_finite(inverse.as_slice()).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(x_m: f64, sd_m: f64) -> Estimate {
        let mut mean = Vector6::zeros();
        mean[0] = x_m;
        Estimate { state: TargetState(mean), covariance: Covariance::from_diagonal([sd_m * sd_m; 6]) }
    }

    #[test]
    fn conditioning_weighs_prior_and_measurement_by_their_variances() {
        let mut estimate = estimate(10.0, 2.0);
        let h = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (squared, variance) =
            estimate.condition(&LinearMeasurement { h, value: 15.0, variance: 1.0, heading_derivative: 0.0 });
        assert!((estimate.state.0[0] - 14.0).abs() < 1e-12 && (estimate.covariance[(0, 0)] - 0.8).abs() < 1e-12);
        assert_eq!((squared, variance), (5.0, 5.0));
        assert_eq!(estimate.covariance[(1, 1)], 4.0);
    }

    #[test]
    fn moments_of_a_mixture_include_the_distance_of_the_means() {
        let mut mixture = Mixture::about(estimate(1e6, 1.0).state.0);
        mixture.add(0.5, &estimate(1e6 - 3.0, 1.0));
        mixture.add(0.5, &estimate(1e6 + 3.0, 1.0));
        let moments = mixture.moments().unwrap();
        assert!((moments.state.0[0] - 1e6).abs() < 1e-9 && (moments.covariance[(0, 0)] - 10.0).abs() < 1e-9);
        assert!(Mixture::about(Vector6::zeros()).moments().is_none());
    }

    #[test]
    fn a_single_value_that_is_not_finite_is_detected() {
        let mut values = [0.0, -1e-310, f64::MAX, f64::MIN, -0.0, 1.0, f64::MIN_POSITIVE];
        assert!(are_finite(&values));
        for index in 0..values.len() {
            for broken in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -f64::NAN] {
                let whole = core::mem::replace(&mut values[index], broken);
                assert!(!are_finite(&values), "{broken}");
                values[index] = whole;
            }
        }
    }

    #[test]
    fn an_invalid_covariance_is_rejected() {
        let mut estimate = estimate(10.0, 2.0);
        estimate.covariance = estimate.covariance.with_position(&Matrix2::new(-1.0, 0.0, 0.0, 1.0));
        assert_eq!(estimate.checked(), None);
        estimate.covariance = estimate.covariance.with_position(&Matrix2::new(f64::NAN, 0.0, 0.0, 1.0));
        assert_eq!(estimate.checked(), None);
    }
}
