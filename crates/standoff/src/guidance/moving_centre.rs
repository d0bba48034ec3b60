//! Adding the centre's velocity to the field, so that the UAV still flies at its own speed (28, 29).
//!
//! ```text
//! v_dn = v_c + alpha_s v_field                                                     Eq. (28)
//! |v_field|^2 alpha_s^2 + 2 (v_field . v_c) alpha_s + |v_c|^2 - v^2 = 0            Eq. (29)
//! ```
//!
//! For a centre slower than the UAV there is one positive root. For a faster one there may be two (the larger is
//! taken) or none: then the UAV flies at its speed towards the point of the ray {v_c + alpha_s v_field, alpha_s >= 0}
//! nearest to what it can reach, which is where the two cases meet.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::Velocity;

/// What to fly relative to the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverGround {
    /// Desired direction of flight.
    pub heading: Angle,
    /// Speed relative to the centre along the field, alpha_s |v_field|, m/s; 0 where there is no root.
    #[doc(alias = "alpha_s")]
    pub relative_speed_m_s: f64,
    /// How much the heading turns with the field: the derivative of one with respect to the other, at constant speeds.
    pub heading_per_field_heading: f64,
    /// The centre is so fast that the field cannot be flown; the heading is the best there is.
    pub centre_too_fast: bool,
}

/// The direction in which a UAV at `speed_m_s` (above 0) follows a field `along` this unit vector about a centre that
/// moves at `centre_velocity`.
///
/// Implements Eq. (28), (29).
pub fn over_ground(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> OverGround {
    let Quadratic { drift, half_gap, root } = Quadratic::of(along, centre_velocity, speed_m_s);
    let reach = root.unwrap_or((-drift).max(0.0));
    let flown = Velocity::from(centre_velocity.vector() + along * reach);
    OverGround {
        heading: flown.direction(),
        relative_speed_m_s: root.unwrap_or(0.0),
        heading_per_field_heading: match root {
            // v psi_d' cos(psi_d - phi) = s phi', from differentiating v_c + s u = v d; the cosine is half_gap / v.
            Some(root) if half_gap > 0.0 => root / half_gap,
            // At right angles to the field, it turns with it; in a chase, it turns with the centre alone.
            _ => f64::from(reach > 0.0),
        },
        centre_too_fast: root.is_none(),
    }
}

/// Eq. (29) for a field that is a unit vector.
struct Quadratic {
    /// The component of the centre's velocity along the field.
    drift: f64,
    /// Half the distance between the roots; also the component of the flown velocity along the field.
    half_gap: f64,
    /// The larger root, if it is positive.
    root: Option<f64>,
}

impl Quadratic {
    fn of(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> Self {
        let centre = centre_velocity.vector();
        let drift = along.dot(&centre);
        let discriminant = drift * drift + speed_m_s * speed_m_s - centre.dot(&centre);
        let half_gap = discriminant.max(0.0).sqrt();
        let root = half_gap - drift;
        let there_is_none = discriminant < 0.0 || root <= 0.0;
        Self { drift, half_gap, root: (!there_is_none).then_some(root) }
    }
}

/// The speed relative to the centre of [`over_ground`] alone, m/s; `None`: the centre is too fast.
///
/// Implements Eq. (29).
pub(crate) fn relative_speed_m_s(along: Vector2<f64>, centre_velocity: Velocity, speed_m_s: f64) -> Option<f64> {
    Quadratic::of(along, centre_velocity, speed_m_s).root
}

/// The direction in which a UAV flies that keeps the speed `relative_speed_m_s` (at least 0) relative to the centre,
/// along a field of this unit vector; and its speed over ground, m/s. Whatever the centre's speed, this can be flown, if
/// that fast.
///
/// Implements Eq. (28) with alpha_s given; what (29) asks of the speed over ground, that varies here.
pub fn at_relative_speed(along: Vector2<f64>, centre_velocity: Velocity, relative_speed_m_s: f64) -> (OverGround, f64) {
    let flown = Velocity::from(centre_velocity.vector() + along * relative_speed_m_s);
    let squared = flown.vector().norm_squared();
    // From differentiating the direction of v_c + s u at constant s: s phi' (v . u) / |v|^2.
    let per_field = relative_speed_m_s * flown.vector().dot(&along) / squared;
    let over_ground = OverGround {
        heading: flown.direction(),
        relative_speed_m_s,
        heading_per_field_heading: if squared > 0.0 { per_field } else { 0.0 },
        centre_too_fast: false,
    };
    (over_ground, squared.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn over_ground(field: Angle, centre_velocity: Velocity, speed_m_s: f64) -> OverGround {
        super::over_ground(Velocity::from_polar(1.0, field).vector(), centre_velocity, speed_m_s)
    }

    /// Checks Eq. (28), (29): a 3-4-5 triangle; 30 m/s of drift across leaves 40 of 50 m/s along the field.
    #[test]
    fn drift_across_the_field_is_crabbed_against() {
        let got = over_ground(Angle::from_deg(90.0), Velocity::from_m_s(30.0, 0.0), 50.0);
        assert!((got.relative_speed_m_s - 40.0).abs() < 1e-9);
        assert!((got.heading - Velocity::from_m_s(30.0, 40.0).direction()).abs_rad() < 1e-12);
        assert!(!got.centre_too_fast);
    }

    proptest! {
        /// Checks Eq. (28) at a given speed relative to the centre: the same heading as (29) finds at the speed over
        /// ground that this makes, and its derivative at that relative speed.
        #[test]
        fn a_relative_speed_is_kept(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..35.0f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let field = Angle::from_deg(field_deg);
            let at_relative_speed = |field: Angle, centre_velocity: Velocity| {
                super::at_relative_speed(Velocity::from_polar(1.0, field).vector(), centre_velocity, 40.0)
            };
            let (got, over_ground_m_s) = at_relative_speed(field, centre_velocity);
            let by_29 = over_ground(field, centre_velocity, over_ground_m_s);
            prop_assert!((by_29.relative_speed_m_s - 40.0).abs() < 1e-9);
            prop_assert!((by_29.heading - got.heading).abs_rad() < 1e-9);
            let h = 1e-6;
            let turned = |by: f64| at_relative_speed(field + Angle::from_rad(by), centre_velocity).0.heading;
            let slope = (turned(h) - turned(-h)).rad() / (2.0 * h);
            prop_assert!((slope - got.heading_per_field_heading).abs() < 1e-3 * (1.0 + slope.abs()));
        }

        /// Checks Eq. (28), (29): for a slower centre the flown velocity is v_c plus something along the field, and
        /// its size is the UAV's speed.
        #[test]
        fn the_speed_is_kept(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..39.9f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let field = Angle::from_deg(field_deg);
            let got = over_ground(field, centre_velocity, 40.0);
            prop_assert!(!got.centre_too_fast && got.relative_speed_m_s > 0.0);
            let flown = centre_velocity + Velocity::from_polar(got.relative_speed_m_s, field);
            prop_assert!((flown.speed_m_s() - 40.0).abs() < 1e-9);
            prop_assert!((flown.direction() - got.heading).abs_rad() < 1e-9);
            let h = 1e-6;
            let turned = |by: f64| over_ground(field + Angle::from_rad(by), centre_velocity, 40.0).heading;
            let slope = (turned(h) - turned(-h)).rad() / (2.0 * h);
            prop_assert!((slope - got.heading_per_field_heading).abs() < 1e-3 * (1.0 + slope.abs()));
        }

        #[test]
        fn a_faster_centre_never_breaks_it(field_deg in -180.0..180.0f64, centre_deg in -180.0..180.0f64, centre in 0.0..500.0f64) {
            let centre_velocity = Velocity::from_polar(centre, Angle::from_deg(centre_deg));
            let got = over_ground(Angle::from_deg(field_deg), centre_velocity, 40.0);
            prop_assert!(got.heading.rad().is_finite() && got.relative_speed_m_s >= 0.0);
            prop_assert!(!got.centre_too_fast || centre >= 40.0);
        }
    }

    /// Checks Eq. (29) for two positive roots: field against a fast centre; the larger root is flown.
    #[test]
    fn of_two_roots_the_larger_is_flown() {
        let got = over_ground(Angle::from_deg(180.0), Velocity::from_m_s(50.0, 0.0), 40.0);
        assert!((got.relative_speed_m_s - 90.0).abs() < 1e-9);
        assert!((got.heading.abs_rad() - crate::math::PI).abs() < 1e-9);
    }

    #[test]
    fn a_centre_that_runs_away_is_chased() {
        let got = over_ground(Angle::from_deg(10.0), Velocity::from_m_s(60.0, 0.0), 40.0);
        assert!(got.centre_too_fast);
        assert_eq!((got.heading, got.heading_per_field_heading), (Angle::ZERO, 0.0));
    }

    #[test]
    fn against_a_centre_that_is_too_fast_the_heading_turns_with_the_field() {
        let heading = |deg: f64| over_ground(Angle::from_deg(deg), Velocity::from_m_s(60.0, 0.0), 40.0);
        let (before, after) = (heading(119.0), heading(121.0));
        assert!(before.centre_too_fast && after.centre_too_fast);
        assert!(((after.heading - before.heading).deg() - 2.0).abs() < 1e-9);
        assert!((before.heading_per_field_heading - 1.0).abs() < 1e-12);
    }

    #[test]
    fn where_the_roots_end_the_heading_does_not_jump() {
        // The field at 120 degrees to a centre at v_c: the discriminant vanishes where v_c sin(120 deg) = v.
        let critical = 40.0 / crate::math::sin(120f64.to_radians());
        let below = over_ground(Angle::from_deg(120.0), Velocity::from_m_s(critical - 1e-9, 0.0), 40.0);
        let above = over_ground(Angle::from_deg(120.0), Velocity::from_m_s(critical + 1e-9, 0.0), 40.0);
        assert!(!below.centre_too_fast && above.centre_too_fast);
        assert!((below.heading - above.heading).abs_rad() < 1e-4);
    }
}
