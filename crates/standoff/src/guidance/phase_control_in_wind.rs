//! Phase control in wind: UAVs on one orbit keep their phases if they fly at the same speed relative to its centre.
//!
//! Relative to the centre, an orbit is a stationary circle in the wind minus the velocity of the centre. On each course,
//! the airspeed limits then give an interval of speeds relative to the centre. The nominal speed of all UAVs of a group
//! is the one nearest to v_d in the intersection of their intervals, and (35) adds the correction of the phase error. If
//! the intersection is empty, no speed keeps the phases for the moment.

use crate::guidance::heading::OrbitRelativeState;
use crate::params::TeamParams;
use crate::wind::Wind;

/// Returns the desired ground speed of a UAV with phase error `error_rad`, and the nearest feasible one, m/s; `None` if
/// no speed is feasible at its place on the orbit. `groupmates` are the other UAVs on the orbit.
///
/// This is (35) for speeds relative to the centre.
pub(crate) fn phase_control_in_wind<'a>(
    wind: Wind,
    team: &TeamParams,
    own: &OrbitRelativeState,
    groupmates: impl Iterator<Item = &'a OrbitRelativeState>,
    error_rad: f64,
) -> Option<(f64, f64)> {
    let wind_rel_centre = wind.relative_to(own.orbit.centre_velocity);
    let feasible = |uav: &OrbitRelativeState| wind_rel_centre.ground_speeds_m_s(uav.along(), team.uav.speeds_m_s());
    let [own_min_m_s, own_max_m_s] = feasible(own)?;
    let common = groupmates
        .filter_map(feasible)
        .fold([own_min_m_s, own_max_m_s], |[low, high], [min, max]| [low.max(min), high.min(max)]);
    let nominal_m_s = team.guidance.law().speed_rel_centre_m_s(own, team.uav.speed_m_s);
    let nominal_m_s = match common {
        [low, high] if low <= high => nominal_m_s.clamp(low, high),
        // Each UAV flies as near to the others as it can.
        [low, high] => 0.5 * (low + high),
    };
    let desired_m_s = team.guidance.phase_gain_1_s * error_rad * own.orbit.distance_m + nominal_m_s;
    let over_ground_m_s = |relative_m_s: f64| (own.orbit.centre_velocity.vector() + own.along() * relative_m_s).norm();
    // A negative speed relative to the centre would be flown in the opposite direction.
    let desired_m_s = desired_m_s.max(0.0);
    Some((over_ground_m_s(desired_m_s), over_ground_m_s(desired_m_s.clamp(own_min_m_s, own_max_m_s))))
}
