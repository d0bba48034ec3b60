//! Dwell time of a handoff: how long a target that changes groups belongs to both (34).
//!
//! ```text
//! T_hd >= |r - r_d| / |r'_new - (r_d / r) r_d'|      at the request                       Eq. (34)
//! ```
//!
//! r is the distance of a UAV of the receiving group from the centre of that group, r_d its standoff distance and
//! r'_new the radial speed of the field (20), all with the target in the group; the slowest UAV counts. The dwell time
//! is fixed at the request. If the denominator is zero, the UAV never arrives by this measure, and the maximum dwell
//! applies.

use crate::frame::Position;
use crate::group_id::GroupId;
use crate::guidance::heading::Orbit;
use crate::guidance::vector_field::VectorField;
use crate::params::OrbitDirection;
use crate::time::{Duration, Time};

/// Handoff of a target to a group that makes room for it, although its UAVs may not have the target in view yet.
/// [`Membership`](crate::Membership) returns both groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Handoff {
    /// Passing group, which is still responsible for keeping the target in view; `None` if the target comes from no
    /// group.
    pub from: Option<GroupId>,
    /// Receiving group.
    pub to: GroupId,
    /// Time at which the receiving group began to make room.
    pub requested_at: Time,
    /// Minimum duration T_hd, fixed at the request; zero for a target from no group.
    #[doc(alias = "T_hd")]
    pub dwell: Duration,
}

/// Time that UAVs at these positions need to reach the orbit, s, within `bounds_s`; the upper bound without UAVs.
///
/// Implements Eq. (34), for the slowest of them.
#[doc(alias = "T_hd")]
pub(crate) fn dwell_s(
    uavs: impl Iterator<Item = Position>,
    orbit: &Orbit,
    radial_gain: f64,
    speed_m_s: f64,
    bounds_s: (f64, f64),
) -> f64 {
    let field = VectorField { radius_m: orbit.distance_m, radial_gain, orbit_direction: OrbitDirection::Anticlockwise };
    let times_s = uavs.map(|uav| {
        // At the exact centre, the ratio below would be infinite.
        let r_m = uav.distance_m(orbit.centre).max(1.0);
        let off_m = (r_m - orbit.distance_m).abs();
        let closing_m_s =
            (field.motion_along(r_m, speed_m_s).r_rate_m_s - orbit.distance_m / r_m * orbit.rate_m_s).abs();
        // On the orbit, the closing speed is zero but no time is needed.
        if off_m <= 0.0 { 0.0 } else { off_m / closing_m_s }
    });
    // A division by zero gives no usable time.
    let usable = |time_s: f64| if time_s.is_finite() { time_s } else { bounds_s.1 };
    times_s.map(usable).reduce(f64::max).unwrap_or(bounds_s.1).clamp(bounds_s.0, bounds_s.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;
    use crate::guidance::standoff_distance::Ramp;

    fn orbit(distance_m: f64, rate_m_s: f64) -> Orbit {
        let centre_velocity = Velocity::ZERO;
        let steered = Ramp { radius_m: distance_m, rate_m_s };
        Orbit { centre: Position::ORIGIN, centre_velocity, distance_m, rate_m_s, steered }
    }

    fn dwell(at_m: &[f64], orbit: &Orbit, radial_gain: f64) -> f64 {
        dwell_s(at_m.iter().map(|x| Position::from_m(*x, 0.0)), orbit, radial_gain, 40.0, (2.0, 30.0))
    }

    /// Checks Eq. (34) in numbers: at 300 m, to an orbit of 400 m that grows at 3 m/s, the plain field closes at
    /// 40 (400^2 - 300^2) / (400^2 + 300^2) = 11.2 m/s, less (400/300) 3 = 4 m/s: 100 m in 13.9 s.
    #[test]
    fn the_dwell_is_the_distance_over_the_closing_speed() {
        assert!((dwell(&[300.0], &orbit(400.0, 3.0), 1.0) - 100.0 / 7.2).abs() < 1e-9);
        // The slowest UAV counts; a UAV on the orbit needs no time.
        assert!((dwell(&[400.0, 300.0, 390.0], &orbit(400.0, 3.0), 1.0) - 100.0 / 7.2).abs() < 1e-9);
    }

    /// Checks Eq. (34) with active measure 1: the field (20), at the actual speed, closes faster.
    #[test]
    fn the_active_measure_shortens_the_dwell() {
        let (radial, tangential) = ((400.0f64 * 400.0 - 300.0 * 300.0) / 0.2, 2.0 * 300.0 * 400.0);
        let expected_s = 100.0 / (40.0 * radial / crate::math::hypot(radial, tangential));
        assert!((dwell(&[300.0], &orbit(400.0, 0.0), 0.2) - expected_s).abs() < 1e-9);
    }

    /// Checks Eq. (34) in its degenerate cases: on the orbit, at the centre, and with zero closing speed.
    #[test]
    fn the_dwell_stays_within_its_bounds() {
        assert_eq!(dwell(&[400.0], &orbit(400.0, 0.0), 1.0), 2.0);
        assert_eq!(dwell(&[], &orbit(400.0, 0.0), 1.0), 30.0);
        assert_eq!(dwell(&[0.0], &orbit(400.0, 5.0), 1.0), 2.0);
        let closing_m_s = 40.0 * 7.0 / 25.0;
        assert_eq!(dwell(&[300.0], &orbit(400.0, closing_m_s * 0.75), 1.0), 30.0);
    }
}
