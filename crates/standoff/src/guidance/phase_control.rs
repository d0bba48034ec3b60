//! Control of the phase differences of the UAVs on an orbit, by speed (35).
//!
//! ```text
//! u_v = +-k_v (gamma - theta_d) r_d + v_d        gamma = theta_2 - theta_1                Eq. (35)
//! ```
//!
//! gamma wraps. The UAV behind speeds up. A pair keeps the nearer of the phase differences +theta_d and -theta_d. Three
//! UAVs on an orbit are spaced evenly: each stays half-way between its neighbours. The information of a bearing, and a
//! street's view of the sky, are the same from the opposite side: only doubled phases matter (Zhao, Chen and Lee 2013).
//! Four and more UAVs therefore space their doubled phases evenly, and none is opposite another one.

use crate::angle::Angle;
use crate::math::{self, PI, TAU};
use crate::params::OrbitDirection;
use crate::uav::UavId;

/// Distance between two UAVs on an orbit beyond the minimum separation, m: collision avoidance does not interfere.
const NEIGHBOUR_MARGIN_M: f64 = 20.0;

/// Smallest phase difference between two neighbours on an orbit, rad. On a small orbit with many UAVs, it takes
/// precedence over the even spacing of doubled phases.
pub(crate) fn phase_gap_min_rad(separation_min_m: f64, orbit_radius_m: f64) -> f64 {
    let sin = ((separation_min_m + NEIGHBOUR_MARGIN_M) / (2.0 * orbit_radius_m)).min(1.0);
    2.0 * math::atan2(sin, (1.0 - sin * sin).sqrt())
}

/// Phase error of a UAV on its orbit, rad. Positive if the UAV lags behind its desired phase and must speed up. Zero if
/// it is the only UAV on the orbit.
///
/// Each UAV is given by its id and its phase, the direction from the centre to the UAV. `gap_min_rad` is called if there
/// are four or more. The two UAVs of a pair have the
/// same error with opposite signs. If two UAVs have the same phase, the one with the lower id counts as behind.
pub(crate) fn phase_error_rad(
    own: (UavId, Angle),
    others: impl Iterator<Item = (UavId, Angle)>,
    desired_phase_rad: f64,
    gap_min_rad: impl FnOnce() -> f64,
    sense: OrbitDirection,
) -> f64 {
    let doubled = |(id, phase): (UavId, Angle)| (id, phase + phase);
    let (mut gaps, mut doubled_gaps, mut n_others) = (Gaps::default(), Gaps::default(), 0);
    for other in others {
        gaps.add(gap_ahead_rad(own, other, sense));
        doubled_gaps.add(gap_ahead_rad(doubled(own), doubled(other), sense));
        n_others += 1;
    }
    match n_others {
        0 => 0.0,
        1 if gaps.ahead_rad <= gaps.behind_rad => gaps.ahead_rad - desired_phase_rad,
        1 => desired_phase_rad - gaps.behind_rad,
        2 => gaps.to_middle_rad(),
        _ => gaps.limit_rad(0.5 * doubled_gaps.to_middle_rad(), gap_min_rad()),
    }
}

/// Phase differences to the nearest UAVs ahead and behind, rad.
struct Gaps {
    ahead_rad: f64,
    behind_rad: f64,
}

impl Default for Gaps {
    fn default() -> Self {
        Self { ahead_rad: TAU, behind_rad: TAU }
    }
}

impl Gaps {
    fn add(&mut self, ahead_rad: f64) {
        self.ahead_rad = self.ahead_rad.min(ahead_rad);
        self.behind_rad = self.behind_rad.min(TAU - ahead_rad);
    }

    /// Phase error of a UAV that has to stay half-way between its neighbours.
    fn to_middle_rad(&self) -> f64 {
        0.5 * (self.ahead_rad - self.behind_rad)
    }

    /// Limits a phase error so that both neighbours stay apart; between close neighbours, the UAV stays half-way.
    fn limit_rad(&self, error_rad: f64, gap_min_rad: f64) -> f64 {
        let [low, high] = [gap_min_rad - self.behind_rad, self.ahead_rad - gap_min_rad];
        if low <= high { error_rad.clamp(low, high) } else { self.to_middle_rad() }
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
    const GAP_MIN_RAD: f64 = 15.0 * PI / 180.0;

    fn errors_deg(phases_deg: &[f64], sense: OrbitDirection) -> Vec<f64> {
        let all: Vec<_> =
            phases_deg.iter().enumerate().map(|(i, deg)| (UavId(i as u32), Angle::from_deg(*deg))).collect();
        all.iter()
            .map(|own| {
                let others = all.iter().copied().filter(|other| other.0 != own.0);
                phase_error_rad(*own, others, RIGHT_ANGLE, || GAP_MIN_RAD, sense).to_degrees()
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

    /// Doubled phases of four UAVs are 90 degrees apart, whichever of them are on the opposite side.
    #[test]
    fn four_uavs_space_their_doubled_phases_evenly() {
        let sense = OrbitDirection::Anticlockwise;
        check(&[0.0, 45.0, 90.0, 135.0], sense, &[0.0; 4]);
        check(&[0.0, -135.0, 90.0, -45.0], sense, &[0.0; 4]);
        // The opposite of the second is 50 degrees ahead of the first and 40 behind the third.
        check(&[0.0, -130.0, 90.0, -45.0], sense, &[2.5, -5.0, 2.5, 0.0]);
        // Doubled phases of opposite UAVs are equal, so that the ids decide.
        check(&[0.0, 90.0, 180.0, -90.0], sense, &[-45.0, -45.0, 45.0, 45.0]);
    }

    /// Sixteen UAVs whose doubled phases are even would be 11.25 degrees apart on one half of the orbit.
    #[test]
    fn neighbours_keep_their_minimum_phase_difference() {
        let sense = OrbitDirection::Anticlockwise;
        let crowded: Vec<f64> = (0..16).map(|index| 11.25 * f64::from(index)).collect();
        let errors_deg = errors_deg(&crowded, sense);
        assert!((errors_deg[0] + 3.75).abs() < 1e-9 && (errors_deg[15] - 3.75).abs() < 1e-9, "{errors_deg:?}");
        // Between two that are too close, the UAV stays half-way.
        check(&[0.0, 8.0, 20.0, 100.0], sense, &[-36.0, 2.0, 34.0]);
        assert!(
            (phase_gap_min_rad(50.0, 250.0) - 2.0 * math::atan2(0.14, (1.0 - 0.14 * 0.14f64).sqrt())).abs() < 1e-12
        );
        assert!((phase_gap_min_rad(50.0, 30.0) - PI).abs() < 1e-12);
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
