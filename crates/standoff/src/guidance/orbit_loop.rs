//! Stability of the guidance loop on an orbit, linearised about the circle around a stationary centre.
//!
//! The state is the field's course q = (r - r_d) / (k_l r_d) and the UAV's course gamma, both relative to the tangent of
//! the circle and positive inward, and the turn rate w relative to the rate of that tangent. With a = v / (k_l r_d):
//!
//! ```text
//! q' = -a gamma        gamma' = w        tau_omega w' = u - w
//! u  = -k_omega (gamma - q) + f                                           Eq. (24)
//! f  = -a gamma       law `standoff`; gamma and q of u are those one lag tau_omega ahead
//! f  = -a k_l^2 q     law `oh-2015`
//! f  =  a k_l^2 q     law `oh-2015`, Eq. (25) as published
//! ```
//!
//! With the law `standoff`, the characteristic polynomial is (tau_omega s + 1) (s + k_omega) (s + a): every orbit is
//! stable, with any lag. If commands are held for a period T, it is stable, without lag, for (k_omega + a) T < 2. With
//! the law `oh-2015`, without lag, it is s (s + k_omega) + a (k_omega - a k_l^2): the orbit is stable only if
//! v / r_d < k_omega / k_l. Otherwise the UAV settles on another circle.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::math;
use crate::params::{Integrator, TeamParams};
use crate::time::Duration;

impl TeamParams {
    /// Returns the spectral radius of the guidance loop on an orbit of `radius_m` around a stationary centre, if each
    /// command is held for `period`. The orbit is stable if it is below 1.
    pub fn orbit_loop_spectral_radius(&self, radius_m: f64, period: Duration) -> f64 {
        let (guidance, lag_s, dt_s) = (&self.guidance, self.uav.turn_rate_lag_s, period.s());
        let (law, k_omega) = (guidance.law(), guidance.heading_gain_1_s);
        let a = self.uav.speed_m_s / (guidance.radial_gain * radius_m);
        // Remaining share of w, its first and second integral over the period, and those of the share of the command.
        let (decay, once_s, twice_s2, command_once_s, command_twice_s2) = match self.uav.integrator {
            Integrator::Exact => {
                let decay = math::exp(-dt_s / lag_s);
                let once_s = lag_s * (1.0 - decay);
                let twice_s2 = lag_s * (dt_s - once_s);
                (decay, once_s, twice_s2, dt_s - once_s, 0.5 * dt_s * dt_s - twice_s2)
            }
            Integrator::Euler => (1.0 - dt_s / lag_s, dt_s, 0.0, 0.0, 0.0),
        };
        let free = Matrix3::new(1.0, -a * dt_s, -a * twice_s2, 0.0, 1.0, once_s, 0.0, 0.0, decay);
        let forced = Vector3::new(-a * command_twice_s2, command_once_s, 1.0 - decay);

        let ahead_s = law.ahead_s(lag_s);
        let q = RowVector3::new(1.0, -a * ahead_s, -0.5 * a * ahead_s * ahead_s);
        let gamma = RowVector3::new(0.0, 1.0, ahead_s);
        let [per_q, per_gamma] = law.linear_feedforward_1_s(guidance, a);
        let command = q * per_q + gamma * per_gamma - (gamma - q) * k_omega;
        let roots = (free + forced * command).complex_eigenvalues();
        roots.iter().map(|root| math::hypot(root.re, root.im)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Law;
    use proptest::prelude::*;

    fn is_stable(team: &TeamParams, radius_m: f64, period_s: f64) -> bool {
        team.orbit_loop_spectral_radius(radius_m, Duration::from_s(period_s)) < 1.0
    }

    fn team(law: Law, speed_m_s: f64, lag_s: f64) -> TeamParams {
        let mut team = TeamParams::of_law(law);
        (team.uav.speed_m_s, team.uav.turn_rate_lag_s) = (speed_m_s, lag_s);
        team
    }

    proptest! {
        /// With the paper's law, the limit of v / r_d is k_omega / k_l; a lag and the period of 0.01 s change it by
        /// little.
        #[test]
        fn with_the_papers_law_orbits_are_stable_up_to_a_turn_rate(speed_m_s in 10.0..60.0f64, k_l in 0.3..1.0f64, k_omega in 0.3..1.5f64) {
            let mut team = team(Law::Oh2015, speed_m_s, 0.01);
            (team.guidance.radial_gain, team.guidance.heading_gain_1_s) = (k_l, k_omega);
            let limit_m = speed_m_s * k_l / k_omega;
            prop_assert!(is_stable(&team, 1.15 * limit_m, 0.01) && !is_stable(&team, 0.85 * limit_m, 0.01));
        }

        /// With this project's law, every orbit that a UAV can turn is stable with any lag, if the period is short.
        #[test]
        fn with_this_projects_law_all_orbits_are_stable(speed_m_s in 10.0..60.0f64, times in 1.0..100.0f64, lag_s in 0.01..3.0f64, k_omega in 0.1..3.0f64) {
            let mut team = team(Law::Standoff, speed_m_s, lag_s);
            team.guidance.heading_gain_1_s = k_omega;
            prop_assert!(is_stable(&team, times * speed_m_s / 0.3, 0.01));
        }

        /// With a held command and a negligible lag, the condition is (k_omega + v / (k_l r_d)) T < 2.
        #[test]
        fn a_period_limits_the_stable_orbits(speed_m_s in 10.0..60.0f64, radius_m in 50.0..500.0f64, k_omega in 0.2..3.0f64) {
            let mut team = team(Law::Standoff, speed_m_s, 0.001);
            (team.guidance.radial_gain, team.guidance.heading_gain_1_s) = (0.05, k_omega);
            let limit_s = 2.0 / (k_omega + speed_m_s / (0.05 * radius_m));
            prop_assert!(is_stable(&team, radius_m, 0.95 * limit_s) && !is_stable(&team, radius_m, 1.05 * limit_s));
        }
    }
}
