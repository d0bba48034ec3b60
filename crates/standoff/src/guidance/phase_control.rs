//! Control of the phase differences of the UAVs on an orbit, by speed (35).
//!
//! ```text
//! u_v = +-k_v (gamma - theta_d) r_d + v_d        gamma = theta_2 - theta_1                Eq. (35)
//! ```
//!
//! gamma wraps. The UAV behind speeds up. A pair keeps the nearer of the phase differences +theta_d and -theta_d. More
//! than two UAVs on an orbit are spaced evenly: each stays half-way between its neighbours.

use crate::angle::Angle;
use crate::math::{PI, TAU};
use crate::params::OrbitDirection;
use crate::uav::UavId;

/// Phase error of a UAV on its orbit, rad. Positive if the UAV lags behind its desired phase and must speed up. Zero if
/// it is the only UAV on the orbit.
///
/// Each UAV is given by its id and its phase, the direction from the centre to the UAV. The two UAVs of a pair have the
/// same error with opposite signs. If two UAVs have the same phase, the one with the lower id counts as behind.
pub(crate) fn phase_error_rad(
    own: (UavId, Angle),
    others: impl Iterator<Item = (UavId, Angle)>,
    desired_phase_rad: f64,
    sense: OrbitDirection,
) -> f64 {
    let (mut ahead, mut behind, mut n_others) = (TAU, TAU, 0);
    for (id, phase) in others {
        let gap = gap_ahead_rad(own, (id, phase), sense);
        ahead = ahead.min(gap);
        behind = behind.min(TAU - gap);
        n_others += 1;
    }
    match n_others {
        0 => 0.0,
        1 if ahead <= behind => ahead - desired_phase_rad,
        1 => desired_phase_rad - behind,
        _ => 0.5 * (ahead - behind),
    }
}

/// Returns true if a UAV is so far out that it is still on its way to the orbit. Such a UAV does not control its phase,
/// and the other UAVs ignore it.
///
/// Not part of Eq. (35): a UAV must not slow down for its phase while it is far away from its group.
pub(crate) fn is_in_transit(centre_distance_m: f64, orbit_radius_m: f64) -> bool {
    centre_distance_m > 2.0 * orbit_radius_m
}

/// Desired speed of a UAV with phase error `error_rad`, m/s, before limits.
///
/// Implements Eq. (35). The speed is at least [`speed_min_for_phase_m_s`], so that the UAV does not fall behind the
/// centre.
pub(crate) fn phase_control_speed_m_s(
    error_rad: f64,
    gain_1_s: f64,
    orbit_radius_m: f64,
    speed_m_s: f64,
    centre_speed_m_s: f64,
) -> f64 {
    (gain_1_s * error_rad * orbit_radius_m + speed_m_s).max(speed_min_for_phase_m_s(centre_speed_m_s))
}

/// Minimum speed at which a UAV can still circle a centre that moves at `centre_speed_m_s`, m/s: 10 % above that speed.
pub(crate) fn speed_min_for_phase_m_s(centre_speed_m_s: f64) -> f64 {
    1.1 * centre_speed_m_s
}

/// Phase of `other` ahead of `own` along the orbit, rad in [0, 2 pi].
fn gap_ahead_rad(own: (UavId, Angle), other: (UavId, Angle), sense: OrbitDirection) -> f64 {
    let ahead = sense.sign() * (other.1 - own.1).rad();
    // At equal or opposite phases both UAVs would compute the same gap, so the ids decide which one leads.
    if ahead == 0.0 {
        return if own.0 < other.0 { 0.0 } else { TAU };
    }
    if ahead.abs() >= PI {
        return if own.0 < other.0 { PI } else { PI + f64::EPSILON * 4.0 };
    }
    if ahead < 0.0 { ahead + TAU } else { ahead }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT_ANGLE: f64 = 0.5 * PI;

    fn errors_deg(phases_deg: &[f64], sense: OrbitDirection) -> Vec<f64> {
        let all: Vec<_> =
            phases_deg.iter().enumerate().map(|(i, deg)| (UavId(i as u32), Angle::from_deg(*deg))).collect();
        all.iter()
            .map(|own| {
                let others = all.iter().copied().filter(|other| other.0 != own.0);
                phase_error_rad(*own, others, RIGHT_ANGLE, sense).to_degrees()
            })
            .collect()
    }

    fn check(phases_deg: &[f64], sense: OrbitDirection, expected_deg: &[f64]) {
        for (got, expected) in errors_deg(phases_deg, sense).iter().zip(expected_deg) {
            assert!((got - expected).abs() < 1e-9, "{phases_deg:?}: got {got}, expected {expected}");
        }
    }

    /// Checks Eq. (35): if the phase difference is too large, the UAV behind speeds up; if too small, the UAV ahead
    /// does.
    #[test]
    fn a_pair_is_controlled_to_its_desired_phase() {
        check(&[0.0, 120.0], OrbitDirection::Anticlockwise, &[30.0, -30.0]);
        check(&[0.0, 60.0], OrbitDirection::Anticlockwise, &[-30.0, 30.0]);
        check(&[0.0, 60.0], OrbitDirection::Clockwise, &[30.0, -30.0]);
        check(&[0.0, 90.0], OrbitDirection::Anticlockwise, &[0.0, 0.0]);
    }

    /// Checks the wrap of Eq. (35): the nearer of +90 and -90 degrees, also across west.
    #[test]
    fn the_nearer_of_both_desired_phases_is_used() {
        check(&[0.0, -100.0], OrbitDirection::Anticlockwise, &[-10.0, 10.0]);
        check(&[170.0, -70.0], OrbitDirection::Anticlockwise, &[30.0, -30.0]);
    }

    #[test]
    fn ids_decide_at_equal_or_opposite_phases() {
        check(&[50.0, 50.0], OrbitDirection::Anticlockwise, &[-90.0, 90.0]);
        check(&[0.0, 180.0], OrbitDirection::Anticlockwise, &[90.0, -90.0]);
        check(&[0.0, 180.0], OrbitDirection::Clockwise, &[90.0, -90.0]);
    }

    #[test]
    fn three_uavs_are_spaced_evenly() {
        check(&[0.0, 120.0, -120.0], OrbitDirection::Anticlockwise, &[0.0, 0.0, 0.0]);
        check(&[0.0, 90.0, 180.0], OrbitDirection::Anticlockwise, &[-45.0, 0.0, 45.0]);
        check(&[10.0, 10.0, 10.0], OrbitDirection::Anticlockwise, &[-180.0, 0.0, 180.0]);
    }

    #[test]
    fn a_single_uav_has_no_phase_error() {
        check(&[33.0], OrbitDirection::Anticlockwise, &[0.0]);
    }

    /// Checks Eq. (35) with numbers: 6 degrees behind at 400 m with k_v = 0.5 1/s needs 20.9 m/s more.
    #[test]
    fn the_speed_change_is_proportional_to_the_arc() {
        assert!((phase_control_speed_m_s(6f64.to_radians(), 0.5, 400.0, 40.0, 5.0) - 60.943_951).abs() < 1e-6);
    }

    /// Not part of Eq. (35): neither a UAV ahead of its desired phase nor a single UAV falls behind a fast centre.
    #[test]
    fn no_uav_is_slower_than_the_centre() {
        assert!((phase_control_speed_m_s(-1.0, 0.5, 400.0, 40.0, 35.0) - 38.5).abs() < 1e-9);
        assert!((phase_control_speed_m_s(0.0, 0.5, 400.0, 40.0, 42.0) - 46.2).abs() < 1e-9);
    }
}
