//! An orbit whose centre and radius move as a UAV can follow: continuous, with bounded speed and acceleration.
//!
//! What an orbit should be like jumps: another member becomes the furthest, members come and go. What is flown follows it
//! as a critically damped system of the second order with time constant T, whose acceleration never exceeds a_max, and
//! which brakes in time:
//!
//! ```text
//! e = x* - x      c(e) = e / 2T  for |e| <= 4 a_max T^2,  else  sqrt(2 a_max (|e| - 2 a_max T^2)) along e,  at most c_max
//! x'' = 2 / T (x*' + c(e) - x')        |x''| <= a_max
//! ```

use nalgebra::SVector;

use crate::frame::Position;
use crate::target::TargetState;

/// How quick an orbit's centre and radius may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionParams {
    /// Time constant T with which centre and radius follow what they should be, s; at least 0; 0: at once.
    pub response_s: f64,
    /// Largest acceleration a_max of centre and radius, m/s2; above 0.
    pub acceleration_max_m_s2: f64,
    /// Fastest that centre and radius approach what they should be, c_max, m/s; above 0.
    pub approach_max_m_s: f64,
}

/// Where something is and how it moves, in `D` dimensions: m, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion<const D: usize> {
    pub(crate) at_m: SVector<f64, D>,
    pub(crate) rate_m_s: SVector<f64, D>,
}

impl<const D: usize> Motion<D> {
    /// This motion `dt_s` later, when it should be as `wanted`.
    #[must_use]
    pub(crate) fn follow(self, wanted: &Self, params: &MotionParams, dt_s: f64) -> Self {
        let (t_s, a_m_s2) = (params.response_s, params.acceleration_max_m_s2);
        let carried_m = self.at_m + self.rate_m_s * dt_s;
        let error_m = wanted.at_m - carried_m;
        let distance_m = error_m.norm();
        let knee_m = a_m_s2 * t_s * t_s;
        let approach_m_s = if distance_m <= 4.0 * knee_m {
            distance_m / (2.0 * t_s)
        } else {
            (2.0 * a_m_s2 * (distance_m - 2.0 * knee_m)).sqrt()
        };
        let approach_m_s = approach_m_s.min(params.approach_max_m_s);
        let along = if distance_m > 0.0 { error_m / distance_m } else { error_m };
        let wanted_m_s = wanted.rate_m_s + along * approach_m_s;
        // The exact step of a lag of T / 2.
        let gain = dt_s / (0.5 * t_s + dt_s);
        let change_m_s = (wanted_m_s - self.rate_m_s) * gain;
        let most_m_s = a_m_s2 * dt_s;
        let change_m_s =
            if change_m_s.norm() > most_m_s { change_m_s * (most_m_s / change_m_s.norm()) } else { change_m_s };
        Self { at_m: carried_m + change_m_s * (0.5 * dt_s), rate_m_s: self.rate_m_s + change_m_s }
    }
}

impl Motion<2> {
    pub(crate) fn of(state: &TargetState) -> Self {
        Self { at_m: (state.position() - Position::ORIGIN).vector(), rate_m_s: state.velocity().vector() }
    }
}
