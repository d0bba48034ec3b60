//! This project's law.
//!
//! The lead is the lag of the field, and the steered radius is that of the spread predicted for then. Speeds are
//! relative to the centre: UAVs on an orbit keep their phases, within their speed limits. The feedforward is the
//! derivative of the field along the motion of the UAV, with the modifications (20), (22) and (28) of the field.

use crate::guidance::followed::Guidance;
use crate::guidance::heading::OrbitRelativeState;
use crate::guidance::law::{GroupOrbit, GuidanceLaw};
use crate::guidance::moving_centre;
use crate::guidance::standoff_distance::Ramp;
use crate::params::GuidanceParams;
use crate::uav::UavState;

pub(crate) struct Standoff;

impl GuidanceLaw for Standoff {
    /// Near the orbit the field closes in at r' = -(v / (k_l r_d)) (r - r_d), by Eq. (14) with (20). Therefore a ramp
    /// of r_d is followed with a lag of k_l r_d / v.
    fn lead_s(&self, params: &GuidanceParams, radius_m: f64, speed_m_s: f64) -> f64 {
        params.radial_gain * radius_m / speed_m_s
    }

    /// An orbit that moves is then still on its way to the radius for the predicted spread.
    fn steered(&self, orbit: &GroupOrbit<'_>) -> Ramp {
        let GroupOrbit { team, bounds, spread, margin_m, standoff, flown } = orbit;
        let lead_s = self.lead_s(&team.guidance, standoff.distance_m, team.uav.speed_m_s);
        let expected = bounds.distance(spread.after(lead_s), *margin_m, &team.track.sensor);
        flown.map_or(Ramp::from(&expected), |now| {
            let then = now.with_radius(expected.distance_m, bounds, &team.group.motion, lead_s);
            Ramp { radius_m: then.radius_m, rate_m_s: then.rate_m_s }
        })
    }

    fn ground_speed_m_s(&self, on_orbit: &OrbitRelativeState, speed_m_s: f64) -> f64 {
        moving_centre::ground_speed_m_s(on_orbit.along(), on_orbit.orbit.centre_velocity, speed_m_s)
    }

    fn speed_rel_centre_m_s(&self, _: &OrbitRelativeState, speed_m_s: f64) -> f64 {
        speed_m_s
    }

    /// Implements Eq. (23), (25): the derivative at constant velocity of the centre and constant speed relative to it.
    fn guide(
        &self,
        params: &GuidanceParams,
        on_orbit: &OrbitRelativeState,
        own: &UavState,
        speed_m_s: f64,
    ) -> Guidance {
        let flown = on_orbit.ground_track(speed_m_s);
        let field_rad_s = on_orbit.field_turn_rate_rad_s(own.velocity());
        on_orbit.guidance(params, &flown, speed_m_s, field_rad_s * flown.heading_per_field_heading)
    }

    fn ahead_s(&self, lag_s: f64) -> f64 {
        lag_s
    }

    fn linear_feedforward_1_s(&self, _: &GuidanceParams, a_1_s: f64) -> [f64; 2] {
        [0.0, -a_1_s]
    }
}
