//! Guidance laws: where a UAV flies, from its orbit and from its own position and velocity.
//!
//! Nothing in a law depends on wind, lags or the autopilot; what follows a law is in [`heading`](super::heading) and
//! [`inner_loop`](super::inner_loop). Each law is a file in [`laws`](super::laws), which has a line for it.

use crate::guidance::followed::Guidance;
use crate::guidance::heading::OrbitRelativeState;
use crate::guidance::orbit_motion::OrbitMotion;
use crate::guidance::standoff_distance::{Ramp, Spread, StandoffDistance};
use crate::params::{GuidanceParams, StandoffParams, TeamParams};
use crate::uav::UavState;

/// Guidance of a named law.
pub(crate) trait GuidanceLaw {
    /// Lead k_rd (22), s, on an orbit of `radius_m` that is flown at `speed_m_s` relative to its centre.
    fn lead_s(&self, params: &GuidanceParams, radius_m: f64, speed_m_s: f64) -> f64;

    /// Radius that the UAVs of a group steer for.
    fn steered(&self, orbit: &GroupOrbit<'_>) -> Ramp;

    /// Ground speed of a UAV whose speed before limits is `speed_m_s` in the law's frame, m/s.
    fn ground_speed_m_s(&self, on_orbit: &OrbitRelativeState, speed_m_s: f64) -> f64;

    /// Speed relative to the centre of a UAV whose speed is `speed_m_s` in the law's frame, m/s; 0 if the centre is too
    /// fast for the field (29).
    fn speed_rel_centre_m_s(&self, on_orbit: &OrbitRelativeState, speed_m_s: f64) -> f64;

    /// Guidance at ground speed `speed_m_s` of a UAV in the state `own`, whose position is that of `on_orbit`.
    fn guide(&self, params: &GuidanceParams, on_orbit: &OrbitRelativeState, own: &UavState, speed_m_s: f64)
    -> Guidance;

    /// Time by which the state of a kinematic UAV with turn rate lag `lag_s` is extrapolated before it follows the law
    /// by (24), s.
    fn ahead_s(&self, lag_s: f64) -> f64;

    /// Coefficients `[b, c]` of the feedforward f = b q + c gamma near a circle, 1/s, with the closing rate `a_1_s`:
    /// see [`orbit_loop`](super::orbit_loop).
    fn linear_feedforward_1_s(&self, params: &GuidanceParams, a_1_s: f64) -> [f64; 2];
}

/// Orbit of a group at a time step, before its steered radius is known.
pub(crate) struct GroupOrbit<'a> {
    pub(crate) team: &'a TeamParams,
    /// Bounds of the radius.
    pub(crate) bounds: StandoffParams,
    /// Distance of the furthest member from the centre.
    pub(crate) spread: Spread,
    /// Margin d_m that is added to the spread, m.
    pub(crate) margin_m: f64,
    /// Standoff distance r_d and its rate.
    pub(crate) standoff: StandoffDistance,
    /// Motion of the orbit; `None` if it follows its members immediately.
    pub(crate) flown: Option<OrbitMotion>,
}
