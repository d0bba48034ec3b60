//! Moving centre: adds the centre's velocity to the field so that the UAV keeps its own speed (28, 29).
//!
//! ```text
//! v_dn = v_c + alpha_s v_field                                                     Eq. (28)
//! |v_field|^2 alpha_s^2 + 2 (v_field . v_c) alpha_s + |v_c|^2 - v^2 = 0            Eq. (29)
//! ```
//!
//! If the centre is slower than the UAV, (29) has one positive root. If it is faster, (29) may have two roots, and the
//! larger one is used, or none. Without a root the UAV flies at its own speed towards the point of the ray
//! {v_c + alpha_s v_field, alpha_s >= 0} that is nearest to its reachable velocities. This makes both cases continuous.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::Velocity;

/// Direction to fly over ground, and the resulting motion relative to the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroundTrack {
    /// Desired direction of flight.
    pub heading: Angle,
    /// Speed relative to the centre along the field, alpha_s |v_field|, m/s; 0 if (29) has no positive root.
    #[doc(alias = "alpha_s")]
    pub relative_speed_m_s: f64,
    /// Derivative of the heading with respect to the heading of the field, at constant velocity of the centre and
    /// constant speed relative to it.
    pub heading_per_field_heading: f64,
    /// True if the centre is so fast that the field cannot be flown; the heading is then the best approximation.
    pub centre_too_fast: bool,
}

/// Computes the heading of a UAV with ground speed `speed_m_s` (above 0) that follows a field around a centre that
/// moves at `centre_velocity`. `along` is the direction of the field, a unit vector.
///
/// Implements Eq. (28), (29).
pub(crate) fn ground_track(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> GroundTrack {
    let Quadratic { drift, half_gap, root } = Quadratic::of(along, centre_velocity, speed_m_s);
    let reach = root.unwrap_or((-drift).max(0.0));
    let flown = Velocity::from(centre_velocity.vector() + along * reach);
    GroundTrack {
        heading: flown.direction(),
        relative_speed_m_s: root.unwrap_or(0.0),
        heading_per_field_heading: match root {
            // From differentiating the direction of v_c + s u at constant s: s phi' (v . u) / |v|^2, with v . u the
            // half gap.
            Some(root) => root * half_gap / (speed_m_s * speed_m_s),
            // At right angles to the field, the heading turns with the field; in a pursuit, with the centre only.
            None => f64::from(reach > 0.0),
        },
        centre_too_fast: root.is_none(),
    }
}

/// Solution of Eq. (29) for a field that is a unit vector.
struct Quadratic {
    /// Component of the centre's velocity along the field, m/s.
    drift: f64,
    /// Half the distance between the roots, m/s; also the component of the flown velocity along the field.
    half_gap: f64,
    /// The larger root, if it is positive, m/s.
    root: Option<f64>,
}

impl Quadratic {
    fn of(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> Self {
        let centre = centre_velocity.vector();
        let drift = along.dot(&centre);
        let discriminant = drift * drift + speed_m_s * speed_m_s - centre.dot(&centre);
        let half_gap = discriminant.max(0.0).sqrt();
        let root = half_gap - drift;
        let has_no_root = discriminant < 0.0 || root <= 0.0;
        Self { drift, half_gap, root: (!has_no_root).then_some(root) }
    }
}

/// Computes only the relative speed of [`ground_track`], m/s; `None` if the centre is too fast.
///
/// Implements Eq. (29).
pub(crate) fn relative_speed_m_s(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> Option<f64> {
    Quadratic::of(along, centre_velocity, speed_m_s).root
}

/// Computes the ground speed, m/s, of a UAV that follows the field at the speed `relative_speed_m_s` (at least 0)
/// relative to the centre. `along` is the direction of the field, a unit vector. A solution exists for every speed of the
/// centre, but the ground speed may exceed the UAV's limits.
///
/// Implements Eq. (28) with a given alpha_s. Unlike in (29), the ground speed is variable.
pub(crate) fn ground_speed_m_s(along: Vector2<f64>, centre_velocity: Velocity, relative_speed_m_s: f64) -> f64 {
    (centre_velocity.vector() + along * relative_speed_m_s).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ground_track(field: Angle, centre_velocity: Velocity, speed_m_s: f64) -> GroundTrack {
        super::ground_track(Velocity::from_polar(1.0, field).vector(), centre_velocity, speed_m_s)
    }

    /// Checks Eq. (28), (29) with a 3-4-5 triangle: a drift of 30 m/s across the field leaves 40 of 50 m/s along it.
    #[test]
    fn the_heading_compensates_drift_across_the_field() {
        let got = ground_track(Angle::from_deg(90.0), Velocity::from_m_s(30.0, 0.0), 50.0);
        assert!((got.relative_speed_m_s - 40.0).abs() < 1e-9);
        assert!((got.heading - Velocity::from_m_s(30.0, 40.0).direction()).abs_rad() < 1e-12);
        assert!(!got.centre_too_fast);
    }

    proptest! {
        /// Checks Eq. (28) at a given speed relative to the centre: (29) at the resulting ground speed gives this speed,
        /// and the derivative of the heading is correct.
        #[test]
        fn the_relative_speed_is_constant(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..35.0f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let field = Angle::from_deg(field_deg);
            let at = |field: Angle| {
                let along = Velocity::from_polar(1.0, field).vector();
                ground_track(field, centre_velocity, ground_speed_m_s(along, centre_velocity, 40.0))
            };
            prop_assert!((at(field).relative_speed_m_s - 40.0).abs() < 1e-9);
            let h = 1e-6;
            let turned = |by: f64| at(field + Angle::from_rad(by)).heading;
            let slope = (turned(h) - turned(-h)).rad() / (2.0 * h);
            prop_assert!((slope - at(field).heading_per_field_heading).abs() < 1e-3 * (1.0 + slope.abs()));
        }

        /// Checks Eq. (28), (29): for a slower centre the flown velocity is v_c plus a vector along the field, and its
        /// magnitude is the UAV's speed.
        #[test]
        fn the_ground_speed_is_the_speed_of_the_uav(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..39.9f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let field = Angle::from_deg(field_deg);
            let got = ground_track(field, centre_velocity, 40.0);
            prop_assert!(!got.centre_too_fast && got.relative_speed_m_s > 0.0);
            let flown = centre_velocity + Velocity::from_polar(got.relative_speed_m_s, field);
            prop_assert!((flown.speed_m_s() - 40.0).abs() < 1e-9);
            prop_assert!((flown.direction() - got.heading).abs_rad() < 1e-9);
        }

        #[test]
        fn results_are_finite_for_any_centre_speed(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..500.0f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let got = ground_track(Angle::from_deg(field_deg), centre_velocity, 40.0);
            prop_assert!(got.heading.rad().is_finite() && got.relative_speed_m_s >= 0.0);
            prop_assert!(!got.centre_too_fast || centre >= 40.0);
        }
    }

    /// Checks Eq. (29) with two positive roots: for a field against the motion of a fast centre, the larger root is
    /// flown.
    #[test]
    fn the_larger_of_two_roots_is_flown() {
        let got = ground_track(Angle::from_deg(180.0), Velocity::from_m_s(50.0, 0.0), 40.0);
        assert!((got.relative_speed_m_s - 90.0).abs() < 1e-9);
        assert!((got.heading.abs_rad() - crate::math::PI).abs() < 1e-9);
    }

    #[test]
    fn a_centre_that_escapes_is_pursued() {
        let got = ground_track(Angle::from_deg(10.0), Velocity::from_m_s(60.0, 0.0), 40.0);
        assert!(got.centre_too_fast);
        assert_eq!((got.heading, got.heading_per_field_heading), (Angle::ZERO, 0.0));
    }

    #[test]
    fn the_heading_turns_with_the_field_against_a_centre_that_is_too_fast() {
        let heading = |deg: f64| ground_track(Angle::from_deg(deg), Velocity::from_m_s(60.0, 0.0), 40.0);
        let (before, after) = (heading(119.0), heading(121.0));
        assert!(before.centre_too_fast && after.centre_too_fast);
        assert!(((after.heading - before.heading).deg() - 2.0).abs() < 1e-9);
        assert!((before.heading_per_field_heading - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_heading_is_continuous_where_the_roots_vanish() {
        // The field is at 120 degrees to the velocity v_c: the discriminant vanishes at v_c sin(120 deg) = v.
        let critical = 40.0 / crate::math::sin(120f64.to_radians());
        let below = ground_track(Angle::from_deg(120.0), Velocity::from_m_s(critical - 1e-9, 0.0), 40.0);
        let above = ground_track(Angle::from_deg(120.0), Velocity::from_m_s(critical + 1e-9, 0.0), 40.0);
        assert!(!below.centre_too_fast && above.centre_too_fast);
        assert!((below.heading - above.heading).abs_rad() < 1e-4);
    }
}
