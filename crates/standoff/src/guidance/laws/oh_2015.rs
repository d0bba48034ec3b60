//! The law of H. Oh, S. Kim, H.-S. Shin and A. Tsourdos (2015): constant lead, ground speed, feedforward (25).
//!
//! ```text
//! psi_d' = 4 v r_d r^2 / (r^2 + r_d^2)^2 - 2 r r_d' / (r^2 + r_d^2)                     Eq. (25), published
//! psi_d' = 4 v r_d^3   / (r^2 + r_d^2)^2 - 2 r r_d' / (r^2 + r_d^2)                     exact
//! ```
//!
//! Erratum: the published form is the derivative of the field's heading only on the orbit (r = r_d). The exact form is
//! correct everywhere for the field (13) around a stationary centre; both ignore k_l, the lead and a moving centre.

use crate::guidance::followed::Guidance;
use crate::guidance::heading::{Orbit, OrbitRelativeState};
use crate::guidance::law::{GroupOrbit, GuidanceLaw};
use crate::guidance::moving_centre;
use crate::guidance::standoff_distance::Ramp;
use crate::params::{Feedforward, GuidanceParams};
use crate::uav::UavState;

pub(crate) struct Oh2015;

impl GuidanceLaw for Oh2015 {
    fn lead_s(&self, params: &GuidanceParams, _: f64, _: f64) -> f64 {
        params.lead_s
    }

    fn steered(&self, orbit: &GroupOrbit<'_>) -> Ramp {
        Ramp::from(&orbit.standoff).with_lead(orbit.team.guidance.lead_s, &orbit.bounds)
    }

    fn ground_speed_m_s(&self, _: &OrbitRelativeState, speed_m_s: f64) -> f64 {
        speed_m_s
    }

    fn speed_rel_centre_m_s(&self, on_orbit: &OrbitRelativeState, speed_m_s: f64) -> f64 {
        let relative = moving_centre::relative_speed_m_s(on_orbit.along(), on_orbit.orbit.centre_velocity, speed_m_s);
        relative.unwrap_or(0.0)
    }

    /// Implements Eq. (23), (25).
    fn guide(&self, params: &GuidanceParams, on_orbit: &OrbitRelativeState, _: &UavState, speed_m_s: f64) -> Guidance {
        let (r_m, orbit) = (on_orbit.centre_distance_m(), &on_orbit.orbit);
        let twice_m = match params.feedforward {
            Feedforward::StaticCentre => orbit.distance_m,
            Feedforward::Paper => r_m,
        };
        let anticlockwise_rad_s = stationary_centre_rad_s(r_m, orbit, speed_m_s, twice_m);
        let turn_rate_rad_s = params.orbit_direction.sign() * anticlockwise_rad_s;
        on_orbit.guidance(params, &on_orbit.ground_track(speed_m_s), speed_m_s, turn_rate_rad_s)
    }

    fn ahead_s(&self, _: f64) -> f64 {
        0.0
    }

    fn linear_feedforward_1_s(&self, params: &GuidanceParams, a_1_s: f64) -> [f64; 2] {
        let slope_1_s = a_1_s * params.radial_gain * params.radial_gain;
        match params.feedforward {
            Feedforward::StaticCentre => [-slope_1_s, 0.0],
            Feedforward::Paper => [slope_1_s, 0.0],
        }
    }
}

/// Turn rate of the anticlockwise field (13) around a stationary centre, rad/s. The numerator of the exact form
/// contains r_d^3; the published form has r^2 r_d instead.
///
/// Implements Eq. (25), as published with `twice_m` = r, exact with `twice_m` = r_d.
fn stationary_centre_rad_s(r_m: f64, orbit: &Orbit, speed_m_s: f64, twice_m: f64) -> f64 {
    let (r, r_d, v) = (r_m, orbit.distance_m, speed_m_s);
    let square_sum = r * r + r_d * r_d;
    4.0 * v * r_d * twice_m * twice_m / (square_sum * square_sum) - 2.0 * r * orbit.rate_m_s / square_sum
}
