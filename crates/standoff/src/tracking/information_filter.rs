//! Extended information filter (8-11): estimates one target from the measurements of any number of UAVs.
//!
//! ```text
//! y_{k|k-1} = Y_{k|k-1} F Y_{k-1}^-1 y_{k-1}                                    Eq. (8)
//! Y_{k|k-1} = (F Y_{k-1}^-1 F' + Q)^-1                                          Eq. (9)
//! y_{k|k}   = y_{k|k-1} + sum_i H_i' R_i^-1 [z_i - h(x_{k|k-1}) + H_i x_{k|k-1}]    Eq. (10)
//! Y_{k|k}   = Y_{k|k-1} + sum_i H_i' R_i^-1 H_i                                 Eq. (11)
//! ```
//!
//! H has position columns only, so the measurements of all UAVs sum to one 2x2 block and one 2-vector: a
//! [`Contribution`]. The estimate is stored as mean and covariance; information vector y and matrix Y are computed on
//! request. UAVs that share the prior and add the same contributions in the same order have the same estimate.

use nalgebra::{Matrix2, Vector2};

use crate::covariance::Covariance;
use crate::frame::Position;
use crate::params::{RANGE_MIN_M, SensorParams};
use crate::sensor::{self, RangeBearingMeasurement};
use crate::tracking::estimate::{Estimate, inverse_2, is_well_posed};

/// Information update: the information about a target's position that the measurements of one time step add.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Contribution {
    /// H' R^-1 H, position block, 1/m2.
    pub information: Matrix2<f64>,
    /// H' R^-1 [z - h(x) + H x], position part, 1/m.
    pub vector: Vector2<f64>,
}

impl Contribution {
    /// Contribution of a range and bearing measured from `uav`, linearised at the predicted target position.
    ///
    /// Implements the summands of Eq. (10), (11); the bearing's innovation wraps. Zero if the Jacobian does not exist.
    pub fn from_measurement(
        sensor: &SensorParams,
        uav: Position,
        z: &RangeBearingMeasurement,
        predicted: Position,
    ) -> Contribution {
        let weights = sensor.measurement_variances((predicted - uav).length_m()).map(f64::recip);
        let [contribution] = Self::from_measurements([(uav, *z, predicted)], [weights]);
        contribution
    }

    /// Like [`Self::from_measurement`] for several measurements, each with its own UAV position, predicted target
    /// position, and weights (inverse variances) of range and bearing. Same results, but faster.
    #[inline]
    pub fn from_measurements<const N: usize>(
        measurements: [(Position, RangeBearingMeasurement, Position); N],
        weights: [[f64; 2]; N],
    ) -> [Contribution; N] {
        let targets_rel_uav = measurements.map(|(uav, _, predicted)| predicted - uav);
        let expected = sensor::measure_batch(targets_rel_uav);
        core::array::from_fn(|i| {
            let ((_, z, predicted), expected) = (measurements[i], expected[i]);
            // If the Jacobian does not exist, the measurement has zero weight.
            let weights = if expected.range_m >= RANGE_MIN_M { weights[i] } else { [0.0; 2] };
            let [range, bearing] = sensor::jacobian_rows(expected.range_m.max(RANGE_MIN_M), targets_rel_uav[i]);
            let scalar = |h: Vector2<f64>, nu: f64, weight: f64| {
                let weighted = h * weight;
                let information = Matrix2::new(weighted.x * h.x, weighted.x * h.y, weighted.x * h.y, weighted.y * h.y);
                Contribution { information, vector: weighted * (nu + h.dot(&predicted.vector())) }
            };
            // R is diagonal, so range and bearing are processed one after the other.
            let mut sum = scalar(range, z.range_m - expected.range_m, weights[0]);
            sum += scalar(bearing, (z.bearing - expected.bearing).rad(), weights[1]);
            sum
        })
    }

    /// Returns the squared distance of the measured position from a predicted one, in standard deviations of their
    /// difference. `covariance` is that of the prediction, m2. Zero for a contribution without information.
    ///
    /// Let I be the information and `y = i - I x` that of the innovation. The measured position then differs from x by
    /// `I^-1 y` and has the covariance `I^-1`, so that the squared distance is `y' (I P I + I)^-1 y`.
    pub(crate) fn squared_distance(&self, predicted: Position, covariance: &Matrix2<f64>) -> f64 {
        let innovation = self.vector - self.information * predicted.vector();
        let sum = self.information * covariance * self.information + self.information;
        let determinant = sum[(0, 0)] * sum[(1, 1)] - sum[(0, 1)] * sum[(1, 0)];
        let adjugate = Matrix2::new(sum[(1, 1)], -sum[(0, 1)], -sum[(1, 0)], sum[(0, 0)]);
        if determinant > 0.0 { innovation.dot(&(adjugate * innovation)) / determinant } else { 0.0 }
    }

    /// This contribution with a weight: the probability that it is of the target.
    pub(crate) fn weighted(self, weight: f64) -> Contribution {
        Contribution { information: self.information * weight, vector: self.vector * weight }
    }

    /// Contribution of a directly measured position with covariance `covariance` (m2). Zero if the covariance is
    /// singular.
    pub fn from_position(position: Position, covariance: &Matrix2<f64>) -> Contribution {
        let Some(information) = inverse_2(covariance) else { return Contribution::default() };
        Contribution { information, vector: information * position.vector() }
    }
}

impl core::ops::AddAssign for Contribution {
    fn add_assign(&mut self, other: Self) {
        self.information += other.information;
        self.vector += other.vector;
    }
}

/// Maximum product of the traces of a contribution's information and of the prior position covariance for which the
/// contribution is applied in one step. The rounding error of the
/// covariance difference grows with the cube of this product; at the maximum about four correct digits remain. A
/// position known to 700 m and measured to 10 m gives about 10,000.
const ONE_STEP_PRODUCT_MAX: f64 = 1e4;

/// Maximum number of parts per direction. 10,000 to this power is beyond the precision of a double.
const PARTS_MAX: u32 = 6;

impl Estimate {
    /// Updates the estimate with the sum of all UAVs' contributions.
    ///
    /// ```
    /// use standoff::tracking::information_filter::Contribution;
    /// use standoff::target::Transition;
    /// use standoff::*;
    ///
    /// let sensor = TeamParams::paper().track.sensor;
    /// let state = TargetState::new(Position::from_m(10.0, -5.0), Velocity::from_m_s(8.0, 0.0), [0.0, 0.0]);
    /// let covariance = Covariance::from_diagonal([400.0, 400.0, 4.0, 4.0, 0.1, 0.1]);
    /// let mut estimate = Estimate { state, covariance };
    /// estimate.predict(&TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.3 }.transition(Duration::from_s(0.5)));
    ///
    /// // The contributions of two UAVs are summed; their order does not matter.
    /// let predicted = estimate.state.position();
    /// let mut sum = Contribution::default();
    /// for uav in [Position::from_m(400.0, 0.0), Position::from_m(0.0, 400.0)] {
    ///     let z = RangeBearingMeasurement { range_m: 400.0, bearing: (Position::from_m(0.0, 0.0) - uav).direction() };
    ///     sum += Contribution::from_measurement(&sensor, uav, &z, predicted);
    /// }
    /// let before_m = estimate.position_sd_max_m();
    /// estimate.update(&sum);
    /// assert!(estimate.is_valid() && estimate.position_sd_max_m() < before_m / 2.0);
    /// ```
    ///
    /// Implements Eq. (10), (11). The mean x moves by `C (1 + I A)^-1 (i - I x)`, where C are the position columns of the
    /// covariance before, A is its position block, and I and i are the contribution's information and vector.
    pub fn update(&mut self, contribution: &Contribution) {
        // Use one triangle for both, so that rounding in the contribution cannot make it asymmetric.
        let of = |row, column| contribution.information[(row, column)];
        let information = Matrix2::new(of(0, 0), of(0, 1), of(0, 1), of(1, 1));
        if information.trace() * self.position_covariance().trace() > ONE_STEP_PRODUCT_MAX {
            self.update_direction_by_direction(&information, &contribution.vector);
        } else {
            self.update_in_one_step(&information, &contribution.vector);
        }
    }

    /// Update for a contribution that is much more informative than the prior, possibly in one direction only, for
    /// which the 2x2 inverse of [`Self::update_in_one_step`] would lose precision. Processes the two eigenvectors of
    /// the information one after the other, each in parts small enough to leave a well-conditioned covariance.
    /// Information is additive, so the result is the same.
    ///
    /// If the result cannot be represented numerically, the estimate becomes invalid (NaN).
    #[cold]
    fn update_direction_by_direction(&mut self, information: &Matrix2<f64>, vector: &Vector2<f64>) {
        let Estimate { state, covariance } = self;
        let innovation = vector - information * state.position().vector();
        let directions = information.symmetric_eigen();
        let predicted = state.position().vector();
        for (direction, weight) in directions.eigenvectors.column_iter().zip(&directions.eigenvalues) {
            // A direction without information has a tiny eigenvalue of either sign, due to rounding.
            if *weight <= f64::EPSILON * information.trace() {
                continue;
            }
            let measured_m = direction.dot(&predicted) + direction.dot(&innovation) / weight;
            let mut left = *weight;
            for _ in 0..PARTS_MAX {
                let p = covariance.matrix();
                let along = p.column(0) * direction.x + p.column(3) * direction.y;
                let variance_m2 = along[0] * direction.x + along[3] * direction.y;
                let share = left.min(ONE_STEP_PRODUCT_MAX / variance_m2);
                let gain = along * (share / (1.0 + share * variance_m2));
                state.0 += gain * (measured_m - direction.dot(&state.position().vector()));
                *covariance = Covariance::from(&(p - gain * along.transpose()));
                left -= share;
                if left <= 0.0 {
                    break;
                }
            }
        }
        if !is_well_posed(&covariance.matrix()) {
            state.0.fill(f64::NAN);
        }
    }

    #[inline]
    fn update_in_one_step(&mut self, information: &Matrix2<f64>, vector: &Vector2<f64>) {
        let Estimate { state, covariance } = self;
        let [with_x, with_y] = covariance.with_position_components();
        let damping = covariance.add_position_information(information);
        let innovation = damping * (vector - information * state.position().vector());
        for row in 0..3 {
            let moved = with_x[row] * innovation.x + with_y[row] * innovation.y;
            state.0[row] += moved.x;
            state.0[3 + row] += moved.y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance;
    use crate::frame::{Displacement, Velocity};
    use crate::params::TargetParams;
    use crate::target::{TargetState, Transition};
    use crate::time::Duration;
    use crate::{Angle, math};
    use nalgebra::{Matrix2x6, Matrix6};

    fn sensor() -> SensorParams {
        crate::TeamParams::paper().track.sensor
    }

    fn transition() -> Transition {
        let params = TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 };
        params.transition(Duration::from_s(0.5))
    }

    fn start() -> Estimate {
        let state = TargetState::new(Position::from_m(12.0, -30.0), Velocity::from_m_s(4.0, 1.0), [0.0, 0.1]);
        let variances = [100.0, 4.0, 0.04, 120.0, 5.0, 0.04];
        Estimate { state, covariance: Covariance::from_diagonal(variances) }
    }

    /// A textbook extended Kalman filter in Joseph form. The UAVs are processed one after the other at one
    /// linearisation.
    fn kalman_update(prior: &Estimate, measurements: &[(Position, RangeBearingMeasurement)]) -> Estimate {
        let linearised_at = prior.state.position();
        let (mut x, mut p) = (prior.state.0, prior.covariance.matrix());
        for (uav, z) in measurements {
            let h2 = sensor::jacobian(*uav, linearised_at).unwrap();
            let mut h = Matrix2x6::zeros();
            for i in 0..2 {
                h[(i, 0)] = h2[(i, 0)];
                h[(i, 3)] = h2[(i, 1)];
            }
            let expected = sensor::measure(*uav, linearised_at);
            let nu = Vector2::new(z.range_m - expected.range_m, (z.bearing - expected.bearing).rad());
            // As in (10), every measurement is linearised at the prior, so the innovation is z - h(x0) + H x0 - H x.
            let nu = nu + h * prior.state.0 - h * x;
            let r = Matrix2::from_diagonal(&Vector2::new(100.0, 3f64.to_radians() * 3f64.to_radians()));
            let s = h * p * h.transpose() + r;
            let k = p * h.transpose() * s.cholesky().unwrap().inverse();
            let a = Matrix6::identity() - k * h;
            x += k * nu;
            p = a * p * a.transpose() + k * r * k.transpose();
        }
        Estimate { state: TargetState(x), covariance: Covariance::from(&p) }
    }

    /// Checks Eq. (8), (9), (10), (11): same results as a Kalman filter in Joseph form over many fused steps.
    #[test]
    fn results_equal_a_kalman_filter_in_joseph_form() {
        let mut estimate = start();
        let mut kalman = start();
        for step in 0..200 {
            let t = f64::from(step) * 0.5;
            estimate.predict(&transition());
            kalman.state = transition().predict(&kalman.state);
            transition().predict_covariance(&mut kalman.covariance);
            let truth = Position::from_m(12.0 + 4.0 * t, -30.0 + t);
            let measurements: Vec<_> = [0.1 * t, 0.1 * t + 1.5]
                .into_iter()
                .map(|phase| {
                    let uav = truth + Displacement::from_polar(400.0, Angle::from_rad(phase));
                    let exact = sensor::measure(uav, truth);
                    let noise = math::sin(7.0 * t + phase);
                    let bearing = exact.bearing + Angle::from_rad(0.05 * noise);
                    (uav, RangeBearingMeasurement { range_m: exact.range_m + 9.0 * noise, bearing })
                })
                .collect();
            let predicted = estimate.state.position();
            let mut sum = Contribution::default();
            for (uav, z) in &measurements {
                sum += Contribution::from_measurement(&sensor(), *uav, z, predicted);
            }
            estimate.update(&sum);
            kalman = kalman_update(&kalman, &measurements);
            let got = estimate;
            assert!((got.state.0 - kalman.state.0).norm() < 1e-9 * kalman.state.0.norm(), "step {step}");
            let (got, kalman) = (got.covariance.matrix(), kalman.covariance.matrix());
            assert!((got - kalman).norm() < 1e-9 * kalman.norm(), "step {step}");
        }
    }

    /// Also checks a UAV that is too near for its measurement to carry information.
    #[test]
    fn batched_contributions_equal_single_ones() {
        let at = Position::from_m(110.0, 50.0);
        let uavs = [(-200.0, -100.0), (110.1, 50.2), (300.0, 20.0), (90.0, -60.0)];
        let measurements = uavs.map(|(x_m, y_m)| {
            let uav = Position::from_m(x_m, y_m);
            (uav, sensor::measure(uav, Position::from_m(115.0, 45.0)), at + Displacement::from_m(0.1 * x_m, 0.0))
        });
        let [first, second, third, fourth] = measurements;
        let measurements = [first, (second.0, second.1, at), third, fourth];
        let single =
            measurements.map(|(uav, z, predicted)| Contribution::from_measurement(&sensor(), uav, &z, predicted));
        assert_eq!(Contribution::from_measurements(measurements, [sensor().noise_weights(); 4]), single);
        assert_eq!(single[1], Contribution::default());
        assert!(single[0].information.trace() > 0.0);
    }

    /// Checks Eq. (11): the information gained by an update is the Fisher information (31).
    #[test]
    fn information_is_additive() {
        let prior = start();
        let (uav, at) = (Position::from_m(300.0, 10.0), prior.state.position());
        let contribution = Contribution::from_measurement(&sensor(), uav, &sensor::measure(uav, at), at);
        let mut posterior = prior;
        posterior.update(&contribution);
        let gained = posterior.information_matrix().unwrap() - prior.information_matrix().unwrap();
        assert!((Covariance::from(&gained).position() - sensor().information(uav, at)).norm() < 1e-12);
        assert!(gained[(1, 1)].abs() < 1e-12);
        let vector = posterior.information_vector().unwrap() - prior.information_vector().unwrap();
        assert!((vector[0] - contribution.vector[0]).abs() < 1e-9 && (vector[3] - contribution.vector[1]).abs() < 1e-9);
    }

    /// Checks the wrap of Eq. (10): a target due west, measured slightly beyond +-180 degrees.
    #[test]
    fn a_bearing_across_west_is_a_small_innovation() {
        let prior =
            Estimate { state: TargetState::new(Position::from_m(-400.0, 1.0), Velocity::ZERO, [0.0, 0.0]), ..start() };
        let z = RangeBearingMeasurement { range_m: 400.0, bearing: Angle::from_deg(-179.9) };
        let at = prior.state.position();
        let mut posterior = prior;
        posterior.update(&Contribution::from_measurement(&sensor(), Position::ORIGIN, &z, at));
        assert!(posterior.state.position().distance_m(at) < 2.0);
    }

    /// A filter that slowly loses precision looks correct for hundreds of steps and then diverges.
    #[test]
    fn the_covariance_stays_positive_over_a_long_run() {
        let mut estimate = start();
        let uav = Position::from_m(400.0, 0.0);
        for step in 0..20_000 {
            estimate.predict(&transition());
            if step % 3 == 0 {
                let at = estimate.state.position();
                let z = sensor::measure(uav, Position::from_m(3.0, 5.0));
                estimate.update(&Contribution::from_measurement(&sensor(), uav, &z, at));
            }
            assert!(estimate.information_matrix().is_some(), "not positive definite, step {step}");
        }
        assert!(estimate.state.position().distance_m(Position::from_m(3.0, 5.0)) < 1.0);
    }
}
