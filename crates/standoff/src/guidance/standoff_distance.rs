//! Standoff distance: the orbit radius at which every member of a group is inside the field of view (15, 22, 26, 27).
//!
//! ```text
//! r_d = (d_max + d_m) / sin((alpha_f - eps_m) / 2)                     Eq. (15)
//! r_d,vir = r_d + k_rd r_d'                                            Eq. (22)
//! r_d >= (v - r_d') / omega_max                                        Eq. (27), from (26)
//! ```
//!
//! The flown radius is (15) clamped to [r_d,min, r_d,max]. The removal of members depends on the unclamped radius.
//! Erratum: (27) ignores the motion of the centre. A true circle around a centre that moves at v_t needs
//! r_d >= (v + v_t)^2 / (v omega_max): see [`moving_centre_limit_m`]. With `radius_above_turn_limit`, r_d,min is at
//! least this limit: see [`TeamParams::orbit_bounds`].

use crate::guidance::phase_control::speed_min_for_phase_m_s;
use crate::math;
use crate::params::{SensorParams, StandoffParams, TeamParams};
use crate::target::TargetState;

/// Spread of a group: distance of the furthest member from the centre, and its rate.
///
/// ```
/// use standoff::TeamParams;
/// use standoff::guidance::standoff_distance::Spread;
///
/// let params = TeamParams::paper();
/// let (orbit, sensor) = (params.group.standoff, params.track.sensor);
/// // The orbit grows with the distance of the furthest target from the centre, within its bounds.
/// let spread = |furthest_m: f64| Spread { distance_m: furthest_m, rate_m_s: 0.0 };
/// let of = |furthest_m: f64| orbit.distance(spread(furthest_m), 0.0, &sensor).distance_m;
/// assert_eq!((of(0.0), of(1000.0)), (250.0, 700.0));
/// assert!(of(150.0) > of(120.0));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Spread {
    /// Distance d_max, m.
    #[doc(alias = "d_max")]
    pub distance_m: f64,
    /// Rate d_max', m/s.
    pub rate_m_s: f64,
}

impl Spread {
    /// Computes the spread from the furthest member and the centre.
    pub fn of(furthest: &TargetState, centre: &TargetState) -> Self {
        let member_rel_centre = (furthest.position() - centre.position()).vector();
        let velocity_rel_centre = (furthest.velocity() - centre.velocity()).vector();
        let distance_m = (furthest.position() - centre.position()).length_m();
        let rate_m_s = if distance_m > 0.0 { member_rel_centre.dot(&velocity_rel_centre) / distance_m } else { 0.0 };
        Self { distance_m, rate_m_s }
    }

    /// Extrapolates the spread by `in_s` seconds at its rate; at least 0.
    #[must_use]
    pub(crate) fn after(self, in_s: f64) -> Self {
        Self { distance_m: (self.distance_m + self.rate_m_s * in_s).max(0.0), ..self }
    }
}

/// A standoff distance and its rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StandoffDistance {
    /// Standoff distance (15) before clamping, m.
    pub unclamped_m: f64,
    /// Standoff distance r_d (15), clamped, m.
    #[doc(alias = "r_d")]
    pub distance_m: f64,
    /// Rate of r_d, m/s; zero if clamped.
    pub rate_m_s: f64,
}

impl StandoffParams {
    /// Radius per metre of spread and margin for a sensor, 1 / sin((alpha_f - eps_m) / 2).
    pub fn radius_per_spread(&self, sensor: &SensorParams) -> f64 {
        // If half the remaining field of view exceeds a quarter turn, any radius keeps everything in view.
        1.0 / math::sin((0.5 * (sensor.field_of_view_rad - self.field_of_view_margin_rad)).min(0.5 * math::PI))
    }

    /// Computes the standoff distance for a spread, a margin d_m (m) and a sensor.
    ///
    /// Implements Eq. (15), and the clamp.
    pub fn distance(&self, spread: Spread, margin_m: f64, sensor: &SensorParams) -> StandoffDistance {
        let per_spread = self.radius_per_spread(sensor);
        let unclamped_m = (spread.distance_m + margin_m) * per_spread;
        let distance_m = unclamped_m.clamp(self.radius_min_m, self.radius_max_m);
        let clamped = unclamped_m < self.radius_min_m || unclamped_m > self.radius_max_m;
        let rate_m_s = if clamped { 0.0 } else { spread.rate_m_s * per_spread };
        StandoffDistance { unclamped_m, distance_m, rate_m_s }
    }
}

impl TeamParams {
    /// Smallest radius at which a UAV without phase error can turn about a centre at `centre_speed_m_s`, m; infinite if
    /// the centre is as fast as a UAV can fly. In wind, the speed of the centre is that relative to the air, at most.
    ///
    /// Implements Eq. (27), corrected: [`moving_centre_limit_m`].
    pub fn turn_limit_about_m(&self, centre_speed_m_s: f64) -> f64 {
        // In the air, the centre moves with its velocity minus that of the wind.
        let centre_speed_m_s = centre_speed_m_s + self.orbit_wind_m_s();
        let speed_m_s = self.orbit_speed_m_s(centre_speed_m_s);
        moving_centre_limit_m(speed_m_s, centre_speed_m_s, self.uav.turn_rate_max_rad_s)
    }

    /// Ground speed of a UAV without phase error that orbits a centre at `centre_speed_m_s`, m/s.
    pub(crate) fn orbit_speed_m_s(&self, centre_speed_m_s: f64) -> f64 {
        self.uav.speed_m_s.max(speed_min_for_phase_m_s(centre_speed_m_s)).min(self.uav.speed_max_m_s())
    }

    /// Bounds of an orbit with this turn limit. With `radius_above_turn_limit`, the minimum is at least the limit, but not
    /// above r_d,max.
    pub fn orbit_bounds(&self, turn_limit_m: f64) -> StandoffParams {
        let bounds = self.group.standoff;
        if !self.group.radius_above_turn_limit {
            return bounds;
        }
        StandoffParams { radius_min_m: bounds.radius_min_m.max(turn_limit_m).min(bounds.radius_max_m), ..bounds }
    }

    /// Bounds of an orbit about a stationary centre.
    pub fn stationary_orbit_bounds(&self) -> StandoffParams {
        self.orbit_bounds(self.turn_limit_about_m(0.0))
    }
}

/// A radius that changes.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ramp {
    /// Radius, m.
    pub radius_m: f64,
    /// Its rate, m/s.
    pub rate_m_s: f64,
}

impl Ramp {
    /// Returns the steered radius: this ramp extrapolated by `lead_s` (active measure 2) and clamped to the bounds. At
    /// a bound its rate is zero.
    ///
    /// Implements Eq. (22); `lead_s` is k_rd.
    #[doc(alias = "k_rd")]
    #[must_use]
    pub fn with_lead(self, lead_s: f64, bounds: &StandoffParams) -> Self {
        let led_m = self.radius_m + lead_s * self.rate_m_s;
        let radius_m = led_m.clamp(bounds.radius_min_m, bounds.radius_max_m);
        let is_bounded = led_m < bounds.radius_min_m || led_m > bounds.radius_max_m;
        Self { radius_m, rate_m_s: if is_bounded { 0.0 } else { self.rate_m_s } }
    }
}

impl From<&StandoffDistance> for Ramp {
    fn from(standoff: &StandoffDistance) -> Self {
        Self { radius_m: standoff.distance_m, rate_m_s: standoff.rate_m_s }
    }
}

/// Minimum radius that a UAV at `speed_m_s` can fly around a stationary centre while the radius changes at `rate_m_s`,
/// m.
///
/// Implements Eq. (27), the solution of (26).
pub fn turn_limit_m(speed_m_s: f64, rate_m_s: f64, turn_rate_max_rad_s: f64) -> f64 {
    (speed_m_s - rate_m_s) / turn_rate_max_rad_s
}

/// Minimum radius of a true circle around a moving centre, m; infinite if the centre is at least as fast as the UAV.
///
/// Implements Eq. (27), corrected: where UAV and centre move in opposite directions, the UAV must turn at
/// `(v + v_t)^2 / (v r_d)`.
pub fn moving_centre_limit_m(speed_m_s: f64, centre_speed_m_s: f64, turn_rate_max_rad_s: f64) -> f64 {
    if centre_speed_m_s >= speed_m_s {
        return f64::INFINITY;
    }
    let together = speed_m_s + centre_speed_m_s;
    together * together / (speed_m_s * turn_rate_max_rad_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::TeamParams;

    fn table_1() -> StandoffParams {
        TeamParams::paper().group.standoff
    }

    fn distance(spread: Spread, margin_m: f64) -> StandoffDistance {
        table_1().distance(spread, margin_m, &TeamParams::paper().track.sensor)
    }

    /// Checks Eq. (15): with Table I, r_d = 2 (d_max + d_m).
    #[test]
    fn with_table_1_the_distance_is_twice_the_spread() {
        let d = distance(Spread { distance_m: 150.0, rate_m_s: 2.0 }, 10.0);
        assert!((d.distance_m - 320.0).abs() < 1e-9);
        assert!((d.rate_m_s - 4.0).abs() < 1e-9);
        assert!((d.unclamped_m - d.distance_m).abs() < 1e-12);
    }

    #[test]
    fn the_flown_distance_is_clamped_with_a_rate_of_zero() {
        let near = distance(Spread { distance_m: 10.0, rate_m_s: 2.0 }, 0.0);
        assert_eq!((near.distance_m, near.rate_m_s), (250.0, 0.0));
        let far = distance(Spread { distance_m: 400.0, rate_m_s: 2.0 }, 0.0);
        assert_eq!((far.distance_m, far.rate_m_s), (700.0, 0.0));
        assert!((far.unclamped_m - 800.0).abs() < 1e-9);
    }

    /// Checks Eq. (22), and that a radius clamped to its bound has a rate of zero.
    #[test]
    fn the_virtual_radius_leads_by_the_rate() {
        let led = |radius_m, rate_m_s| Ramp { radius_m, rate_m_s }.with_lead(3.0, &table_1());
        assert_eq!(led(400.0, -5.0), Ramp { radius_m: 385.0, rate_m_s: -5.0 });
        assert_eq!(led(260.0, -5.0), Ramp { radius_m: 250.0, rate_m_s: 0.0 });
    }

    /// Checks Eq. (26), (27).
    #[test]
    fn the_turn_limit_of_table_1_is_133_m() {
        let limit_m = turn_limit_m(40.0, 0.0, 0.3);
        assert!((limit_m - 133.333).abs() < 1e-3);
        // At the limit, (26) is an equality.
        assert!((40.0 / limit_m - 0.3).abs() < 1e-12);
        assert!((turn_limit_m(40.0, 4.0, 0.3) - 120.0).abs() < 1e-9);
    }

    /// Checks the erratum of Eq. (27): the limit is 133, 208, 252, 300 m for a centre speed of 0, 10, 15, 20 m/s.
    #[test]
    fn a_moving_centre_needs_a_wider_orbit() {
        for (centre_m_s, expected_m) in [(0.0, 133.33), (10.0, 208.33), (15.0, 252.08), (20.0, 300.0)] {
            assert!((moving_centre_limit_m(40.0, centre_m_s, 0.3) - expected_m).abs() < 0.01);
        }
        assert_eq!(moving_centre_limit_m(40.0, 40.0, 0.3), f64::INFINITY);
    }

    #[test]
    fn bounds_in_the_wrong_order_are_rejected() {
        let bad = StandoffParams { radius_max_m: 200.0, ..table_1() };
        let names: Vec<_> = bad.out_of_range().into_iter().map(|error| error.path).collect();
        assert_eq!(names, ["radius_max_m"]);
    }
}
