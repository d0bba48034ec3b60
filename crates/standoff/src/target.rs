//! Motion model of a ground target: correlated acceleration per axis (Singer model) (5, 6).
//!
//! ```text
//! x_{k+1} = F x_k + eta      F_1 = | 1  T  (e^{-aT} + aT - 1)/a^2 |
//!                                  | 0  1  (1 - e^{-aT})/a        |          Eq. (5, 6)
//!                                  | 0  0  e^{-aT}                |
//! ```
//!
//! The available copy of the paper shows five states. The state has six: position, velocity and acceleration per axis.
//! The paper does not give Q. This module uses the exact Q for white jerk of density 2 a sigma_a^2:
//! Q = 2 a sigma_a^2 int_0^T g(s) g(s)' ds, where g is the third column of F_1.

use core::ops::{Add, Mul};

use nalgebra::{Matrix2, Matrix3, Vector6};

use crate::covariance::Covariance;
use crate::frame::{Position, Velocity};
use crate::math;
use crate::params::TargetParams;
use crate::time::Duration;

/// Position, velocity and acceleration of a target, or of a group's centre.
///
/// Component order: `[x, vx, ax, y, vy, ay]`, one block of three per axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TargetState(pub Vector6<f64>);

impl TargetState {
    /// Creates a state from position, velocity and acceleration (east and north, m/s2).
    pub fn new(position: Position, velocity: Velocity, acceleration_m_s2: [f64; 2]) -> Self {
        Self(Vector6::new(
            position.x_m(),
            velocity.x_m_s(),
            acceleration_m_s2[0],
            position.y_m(),
            velocity.y_m_s(),
            acceleration_m_s2[1],
        ))
    }

    /// Position in the world frame.
    #[inline]
    pub fn position(&self) -> Position {
        Position::from_m(self.0[0], self.0[3])
    }

    /// Velocity in the world frame.
    #[inline]
    pub fn velocity(&self) -> Velocity {
        Velocity::from_m_s(self.0[1], self.0[4])
    }

    /// Acceleration east and north, m/s2.
    #[inline]
    pub fn acceleration_m_s2(&self) -> [f64; 2] {
        [self.0[2], self.0[5]]
    }
}

impl TargetParams {
    /// Discretises the model for a time step of `dt`.
    ///
    /// Implements Eq. (6) and the exact Q.
    pub fn transition(&self, dt: Duration) -> Transition {
        let (alpha, t) = (self.correlation_rate_1_s, dt.s());
        let third = third_column(alpha, t);
        let density = 2.0 * alpha * self.acceleration_sd_m_s2 * self.acceleration_sd_m_s2;
        Transition {
            dt,
            f: Matrix3::new(1.0, t, third[0], 0.0, 1.0, third[1], 0.0, 0.0, third[2]),
            q: noise_integral(alpha, t) * density,
        }
    }
}

/// The target model discretised for one time step; both axes share it.
///
/// ```
/// use standoff::{Duration, Position, TargetParams, TargetState, Velocity};
///
/// let params = TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.3 };
/// let car = TargetState::new(Position::from_m(0.0, 0.0), Velocity::from_m_s(10.0, 0.0), [0.0, 0.0]);
/// let later = params.transition(Duration::from_s(2.0)).predict(&car);
/// assert!((later.position().x_m() - 20.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// The time step.
    pub dt: Duration,
    /// F_1 of one axis (6).
    pub f: Matrix3<f64>,
    /// Q of one axis.
    pub q: Matrix3<f64>,
}

impl Transition {
    /// The transition over a time step of zero: identity, no noise.
    pub(crate) fn none() -> Self {
        Self { dt: Duration::ZERO, f: Matrix3::identity(), q: Matrix3::zeros() }
    }

    /// Multiplies F_1 by a position, velocity and acceleration.
    fn moved<T>(&self, [x, v, u]: [T; 3]) -> [T; 3]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        // F_1 is upper triangular with ones on the diagonal except in the last place, so few products remain.
        let (t, a, b, c) = (self.f[(0, 1)], self.f[(0, 2)], self.f[(1, 2)], self.f[(2, 2)]);
        [x + v * t + u * a, v + u * b, u * c]
    }

    /// Predicts the state after the step, without noise.
    ///
    /// Implements Eq. (5).
    #[inline]
    pub fn predict(&self, state: &TargetState) -> TargetState {
        let [x, vx, ax, y, vy, ay]: [f64; 6] = state.0.into();
        let ([x, vx, ax], [y, vy, ay]) = (self.moved([x, vx, ax]), self.moved([y, vy, ay]));
        TargetState(Vector6::new(x, vx, ax, y, vy, ay))
    }

    /// Replaces P by F P F' + Q.
    pub fn predict_covariance(&self, p: &mut Covariance) {
        // First the rows of P F', then the columns of F (P F').
        let [xx, xv, xa, vv, va, aa] = p.same_axis;
        let rows = [[xx, xv, xa], [xv, vv, va], [xa, va, aa]].map(|row| self.moved(row));
        let own = [0, 1, 2].map(|column| self.moved(rows.map(|row| row[column])));
        let rows = p.cross_axis.map(|row| self.moved(row));
        let across = [0, 1, 2].map(|column| self.moved(rows.map(|row| row[column])));
        let upper = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        p.same_axis = upper.map(|(row, column)| own[column][row].add_scalar(self.q[(row, column)]));
        p.cross_axis = [0, 1, 2].map(|row| across.map(|column| column[row]));
    }

    /// Returns the position block of F P F' + Q, m2.
    #[inline]
    pub fn predicted_position_covariance(&self, p: &Covariance) -> Matrix2<f64> {
        let [xx, xv, xa, vv, va, aa] = p.same_axis;
        let [own, ..] = self.moved([[xx, xv, xa], [xv, vv, va], [xa, va, aa]].map(|row| self.moved(row)[0]));
        let [across, ..] = self.moved(p.cross_axis.map(|row| self.moved(row)[0]));
        Matrix2::new(own.x + self.q[(0, 0)], across, across, own.y + self.q[(0, 0)])
    }

    /// Returns the lower triangular L with L L' = Q of one axis. L times three standard normal samples is a sample of
    /// eta.
    pub fn noise_factor(&self) -> Matrix3<f64> {
        // A library Cholesky fails for targets that never accelerate: Q is zero, and L must be zero too.
        let mut l = Matrix3::zeros();
        for column in 0..3 {
            let mut pivot = self.q[(column, column)];
            for k in 0..column {
                pivot -= l[(column, k)] * l[(column, k)];
            }
            if pivot <= 0.0 {
                continue;
            }
            l[(column, column)] = pivot.sqrt();
            for row in column + 1..3 {
                let mut rest = self.q[(row, column)];
                for k in 0..column {
                    rest -= l[(row, k)] * l[(column, k)];
                }
                l[(row, column)] = rest / l[(column, column)];
            }
        }
        l
    }
}

/// Value of alpha T below which the power series is used: the closed forms cancel there, the series is exact to
/// rounding.
const SERIES_BELOW: f64 = 1.0;
/// Number of terms of the series; 1/24! is far below rounding.
const TERMS: usize = 24;

/// Third column of F_1 (6): effect of a unit acceleration after time `t`.
fn third_column(alpha: f64, t: f64) -> [f64; 3] {
    let x = alpha * t;
    if x < SERIES_BELOW {
        return core::array::from_fn(|row| polynomial(&third_column_series(alpha, row), t));
    }
    let e = math::exp(-x);
    [(e + x - 1.0) / (alpha * alpha), (1.0 - e) / alpha, e]
}

/// Coefficients of the powers of t in row `row` of the third column: g_3 = e^{-alpha t}; g_2 and g_1 are its first and
/// second integrals.
fn third_column_series(alpha: f64, row: usize) -> [f64; TERMS] {
    let lowest = 2 - row;
    let mut series = [0.0; TERMS];
    let mut term = 1.0;
    for (power, coefficient) in series.iter_mut().enumerate() {
        term /= power.max(1) as f64;
        if power >= lowest {
            *coefficient = term;
            term *= -alpha;
        }
    }
    series
}

fn polynomial(series: &[f64], t: f64) -> f64 {
    series.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient)
}

/// Integral of g(s) g(s)' for s from 0 to t.
fn noise_integral(alpha: f64, t: f64) -> Matrix3<f64> {
    let x = alpha * t;
    if x < SERIES_BELOW {
        let series = [0, 1, 2].map(|row| third_column_series(alpha, row));
        let mut integral = Matrix3::zeros();
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            let (a, b) = (&series[row], &series[column]);
            // Powers of the product beyond `TERMS` are below rounding too.
            let coefficient = |power: usize| (0..=power).map(|i| a[i] * b[power - i]).sum::<f64>() / (power + 1) as f64;
            let coefficients: [f64; TERMS] = core::array::from_fn(coefficient);
            integral[(row, column)] = t * polynomial(&coefficients, t);
            integral[(column, row)] = integral[(row, column)];
        }
        return integral;
    }
    let (e, e2) = (math::exp(-x), math::exp(-2.0 * x));
    let a2 = alpha * alpha;
    let (a3, a4, a5) = (a2 * alpha, a2 * a2, a2 * a2 * alpha);
    let q11 = (1.0 - e2 + 2.0 * x + 2.0 * x * x * x / 3.0 - 2.0 * x * x - 4.0 * x * e) / (2.0 * a5);
    let q12 = (e2 + 1.0 - 2.0 * e + 2.0 * x * e - 2.0 * x + x * x) / (2.0 * a4);
    let q13 = (1.0 - e2 - 2.0 * x * e) / (2.0 * a3);
    let q22 = (4.0 * e - 3.0 - e2 + 2.0 * x) / (2.0 * a3);
    let q23 = (e2 + 1.0 - 2.0 * e) / (2.0 * a2);
    let q33 = (1.0 - e2) / (2.0 * alpha);
    Matrix3::new(q11, q12, q13, q12, q22, q23, q13, q23, q33)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    fn model(alpha: f64, sd: f64) -> TargetParams {
        TargetParams { correlation_rate_1_s: alpha, acceleration_sd_m_s2: sd }
    }

    fn close(a: f64, b: f64, relative: f64) -> bool {
        (a - b).abs() <= relative * a.abs().max(b.abs())
    }

    /// Checks Eq. (6): Table I's alpha and T_s give the published entries.
    #[test]
    fn the_transition_matrix_is_the_published_one() {
        let t = model(0.1, 1.0).transition(Duration::from_s(0.5));
        let e = math::exp(-0.05);
        assert!(close(t.f[(0, 2)], (e + 0.05 - 1.0) / 0.01, 1e-11));
        assert!(close(t.f[(1, 2)], (1.0 - e) / 0.1, 1e-13));
        assert!(close(t.f[(2, 2)], e, 1e-15));
        assert_eq!((t.f[(0, 0)], t.f[(0, 1)], t.f[(1, 1)], t.f[(1, 0)]), (1.0, 0.5, 1.0, 0.0));
    }

    /// Checks Eq. (5, 6): two half steps equal one whole step, for F and Q, both with the series and with the closed
    /// form.
    #[test]
    fn two_half_steps_equal_one_step() {
        for (alpha, dt_s) in [(0.0, 0.5), (1e-6, 1.0), (0.1, 0.5), (0.3, 6.0), (1.9, 0.6), (4.0, 2.0)] {
            let whole = model(alpha, 0.7).transition(Duration::from_s(dt_s));
            let half = model(alpha, 0.7).transition(Duration::from_s(dt_s / 2.0));
            let f = half.f * half.f;
            let q = half.f * half.q * half.f.transpose() + half.q;
            for i in 0..3 {
                for j in 0..3 {
                    assert!(close(whole.f[(i, j)], f[(i, j)], 1e-13), "F {alpha} {dt_s} {i} {j}");
                    assert!(close(whole.q[(i, j)], q[(i, j)], 1e-11), "Q {alpha} {dt_s} {i} {j}");
                }
            }
        }
    }

    /// Checks the exact Q of Eq. (5) against the limit of small alpha T: white jerk's [T^5/20 T^4/8 T^3/6; . T^3/3
    /// T^2/2; . . T].
    #[test]
    fn q_of_short_steps_approaches_white_jerk() {
        let (alpha, t) = (1e-9, 0.5f64);
        let q = noise_integral(alpha, t);
        let (t2, t3) = (t * t, t * t * t);
        let expected = [t3 * t2 / 20.0, t3 * t / 8.0, t3 / 6.0, t3 / 3.0, t2 / 2.0, t];
        let got = [q[(0, 0)], q[(0, 1)], q[(0, 2)], q[(1, 1)], q[(1, 2)], q[(2, 2)]];
        for (got, expected) in got.iter().zip(expected) {
            assert!(close(*got, expected, 1e-8), "{got} {expected}");
        }
    }

    /// Checks the exact Q of Eq. (5): the series and the closed form agree at the switch-over.
    #[test]
    fn series_and_closed_form_agree() {
        let below = noise_integral(0.999_999_999, 1.0);
        let above = noise_integral(1.000_000_001, 1.0);
        for i in 0..9 {
            assert!(close(below[i], above[i], 1e-8), "{} {}", below[i], above[i]);
        }
    }

    #[test]
    fn the_noise_factor_squares_to_q() {
        let t = model(0.1, 0.05).transition(Duration::from_s(0.5));
        let l = t.noise_factor();
        let q = l * l.transpose();
        for i in 0..9 {
            assert!(close(q[i], t.q[i], 1e-12));
        }
        assert_eq!(model(0.1, 0.0).transition(Duration::from_s(0.5)).noise_factor(), Matrix3::zeros());
    }

    #[test]
    fn the_block_prediction_equals_the_full_matrix_prediction() {
        let t = model(0.3, 0.7).transition(Duration::from_s(0.4));
        let root = Matrix6::from_fn(|i, j| 0.3 * (i as f64 + 1.0) - 0.2 * (j as f64) + f64::from(i == j));
        let p = root * root.transpose();
        let mut f6 = Matrix6::zeros();
        let mut q6 = Matrix6::zeros();
        for block in [0, 3] {
            f6.fixed_view_mut::<3, 3>(block, block).copy_from(&t.f);
            q6.fixed_view_mut::<3, 3>(block, block).copy_from(&t.q);
        }
        let expected = f6 * p * f6.transpose() + q6;
        let mut got = Covariance::from(&p);
        t.predict_covariance(&mut got);
        assert!((got.matrix() - expected).norm() < 1e-12 * expected.norm());
    }
}
