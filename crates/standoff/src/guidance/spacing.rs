//! Angular separation on an orbit, held by speed (35).
//!
//! ```text
//! u_v = +-k_v (gamma - theta_d) r_d + v_d        gamma = theta_2 - theta_1                Eq. (35)
//! ```
//!
//! gamma wraps, the one behind speeds up, and a pair holds whichever of +theta_d and -theta_d is nearer. More than two
//! on an orbit are spaced evenly: each stays half-way between its neighbours.

use crate::angle::Angle;
use crate::guidance::vector_field::Sense;
use crate::math::{PI, TAU};
use crate::uav::UavId;

/// How far the UAV lags behind where it should be on the orbit, rad, positive: it must speed up. Zero when alone.
///
/// `phase` is the direction from the centre to a UAV. Both of a pair see the same error with opposite signs; UAVs at
/// the same phase are told apart by their ids, the lower behind.
pub fn spacing_error_rad(
    own: (UavId, Angle),
    others: impl Iterator<Item = (UavId, Angle)>,
    separation_rad: f64,
    sense: Sense,
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
        1 if ahead <= behind => ahead - separation_rad,
        1 => separation_rad - behind,
        _ => 0.5 * (ahead - behind),
    }
}

/// A UAV this far out is on its way to the orbit, not on it: it neither spaces itself nor counts for the others.
///
/// Beyond Eq. (35): on a long way to a group there is nothing to wait for.
pub fn is_in_transit(centre_distance_m: f64, orbit_radius_m: f64) -> bool {
    centre_distance_m > 2.0 * orbit_radius_m
}

/// Speed asked of a UAV with that spacing error, m/s, before limits.
///
/// Implements Eq. (35); but no spacing is worth falling behind the centre, so the speed stays at or above
/// [`speed_floor_m_s`].
pub fn spacing_speed_m_s(
    error_rad: f64,
    gain_1_s: f64,
    orbit_radius_m: f64,
    speed_m_s: f64,
    centre_speed_m_s: f64,
) -> f64 {
    (gain_1_s * error_rad * orbit_radius_m + speed_m_s).max(speed_floor_m_s(centre_speed_m_s))
}

/// Slowest speed at which a UAV still gets round a centre that moves at `centre_speed_m_s`, m/s: a tenth above it.
pub fn speed_floor_m_s(centre_speed_m_s: f64) -> f64 {
    1.1 * centre_speed_m_s
}

/// How far ahead of `own` along the orbit `other` is, rad in [0, 2 pi].
fn gap_ahead_rad(own: (UavId, Angle), other: (UavId, Angle), sense: Sense) -> f64 {
    let ahead = sense.sign() * (other.1 - own.1).rad();
    // Exactly together or opposite, both would see the same gap: the ids decide who leads.
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

    fn errors_deg(phases_deg: &[f64], sense: Sense) -> Vec<f64> {
        let all: Vec<_> =
            phases_deg.iter().enumerate().map(|(i, deg)| (UavId(i as u32), Angle::from_deg(*deg))).collect();
        all.iter()
            .map(|own| {
                let others = all.iter().copied().filter(|other| other.0 != own.0);
                spacing_error_rad(*own, others, RIGHT_ANGLE, sense).to_degrees()
            })
            .collect()
    }

    fn check(phases_deg: &[f64], sense: Sense, expected_deg: &[f64]) {
        for (got, expected) in errors_deg(phases_deg, sense).iter().zip(expected_deg) {
            assert!((got - expected).abs() < 1e-9, "{phases_deg:?}: {got} instead of {expected}");
        }
    }

    /// Checks Eq. (35): too wide, the one behind speeds up; too close, the one ahead does.
    #[test]
    fn a_pair_is_drawn_to_its_separation() {
        check(&[0.0, 120.0], Sense::Anticlockwise, &[30.0, -30.0]);
        check(&[0.0, 60.0], Sense::Anticlockwise, &[-30.0, 30.0]);
        check(&[0.0, 60.0], Sense::Clockwise, &[30.0, -30.0]);
        check(&[0.0, 90.0], Sense::Anticlockwise, &[0.0, 0.0]);
    }

    /// Checks the wrap of Eq. (35): the nearer of +90 and -90 degrees, across west too.
    #[test]
    fn the_nearer_separation_is_held() {
        check(&[0.0, -100.0], Sense::Anticlockwise, &[-10.0, 10.0]);
        check(&[170.0, -70.0], Sense::Anticlockwise, &[30.0, -30.0]);
    }

    #[test]
    fn together_or_opposite_the_ids_decide() {
        check(&[50.0, 50.0], Sense::Anticlockwise, &[-90.0, 90.0]);
        check(&[0.0, 180.0], Sense::Anticlockwise, &[90.0, -90.0]);
        check(&[0.0, 180.0], Sense::Clockwise, &[90.0, -90.0]);
    }

    #[test]
    fn three_are_spaced_evenly() {
        check(&[0.0, 120.0, -120.0], Sense::Anticlockwise, &[0.0, 0.0, 0.0]);
        check(&[0.0, 90.0, 180.0], Sense::Anticlockwise, &[-45.0, 0.0, 45.0]);
        check(&[10.0, 10.0, 10.0], Sense::Anticlockwise, &[-180.0, 0.0, 180.0]);
    }

    #[test]
    fn alone_there_is_no_error() {
        check(&[33.0], Sense::Anticlockwise, &[0.0]);
    }

    /// Checks Eq. (35) in numbers: 6 degrees behind at 400 m with k_v = 0.5 1/s asks for 20.9 m/s more.
    #[test]
    fn the_speed_follows_the_arc() {
        assert!((spacing_speed_m_s(6f64.to_radians(), 0.5, 400.0, 40.0, 5.0) - 60.943_951).abs() < 1e-6);
    }

    /// Beyond Eq. (35): neither a UAV ahead of its place nor one alone falls behind a fast centre.
    #[test]
    fn no_uav_is_slower_than_the_centre() {
        assert!((spacing_speed_m_s(-1.0, 0.5, 400.0, 40.0, 35.0) - 38.5).abs() < 1e-9);
        assert!((spacing_speed_m_s(0.0, 0.5, 400.0, 40.0, 42.0) - 46.2).abs() < 1e-9);
    }
}
