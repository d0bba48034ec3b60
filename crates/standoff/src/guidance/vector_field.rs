//! Lyapunov vector field that guides a UAV onto a circle around a stationary centre (12-14, 20, Lemma 3.1).
//!
//! ```text
//! V = (r^2 - r_d^2)^2                                                            Eq. (12)
//! | x' |      -v      | dx (r^2 - r_d^2) + dy 2 r r_d |
//! | y' | = ---------- | dy (r^2 - r_d^2) - dx 2 r r_d |   r = |uav - centre|     Eq. (13)
//!          r(r^2+r_d^2)
//! r' = -(v / k_l) (r^2 - r_d^2) / (r^2 + r_d^2)     r theta' = v 2 r r_d / (r^2 + r_d^2)    Eq. (14), (20)
//! ```
//!
//! The published field is anticlockwise; for clockwise orbits the tangential part is mirrored. Active measure 1 (20)
//! divides the radial speed by k_l, which makes the velocity longer than v; only its direction is used, at speed v. At
//! r = 0 the published field is undefined. This implementation points outward near the centre, and due east at the
//! centre itself. Erratum: the denominator of (18) is published as (r^2 + r_d^2)^2; the correct power is 1, as in (21).

use nalgebra::Vector2;

use crate::frame::{Displacement, Velocity};
use crate::math;
use crate::params::OrbitDirection;

impl OrbitDirection {
    /// +1 anticlockwise, -1 clockwise.
    pub fn sign(self) -> f64 {
        match self {
            Self::Anticlockwise => 1.0,
            Self::Clockwise => -1.0,
        }
    }
}

/// A vector field that converges to the circle of radius `radius_m`.
///
/// ```
/// use standoff::{Displacement, OrbitDirection, guidance::vector_field::VectorField};
///
/// let field = VectorField { radius_m: 400.0, radial_gain: 1.0, orbit_direction: OrbitDirection::Anticlockwise };
/// // On the orbit the field is tangential: east of the centre it points north.
/// let on_orbit = field.velocity(Displacement::from_m(400.0, 0.0), 40.0);
/// assert!(on_orbit.x_m_s().abs() < 1e-9 && (on_orbit.y_m_s() - 40.0).abs() < 1e-9);
/// // Outside the orbit it also points inwards, at the same speed.
/// let outside = field.velocity(Displacement::from_m(800.0, 0.0), 40.0);
/// assert!(outside.x_m_s() < 0.0 && (outside.speed_m_s() - 40.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VectorField {
    /// Radius r_d of the circle, m; above 0.
    #[doc(alias = "r_d")]
    pub radius_m: f64,
    /// Radial gain k_l of active measure 1; above 0, at most 1; 1 gives the plain field (13).
    #[doc(alias = "k_l")]
    pub radial_gain: f64,
    /// Orbit direction.
    pub orbit_direction: OrbitDirection,
}

impl VectorField {
    /// Evaluates the field at a distance from the centre.
    #[inline]
    pub(crate) fn at(&self, r_m: f64) -> FieldAt {
        let r_d = self.radius_m;
        let (radial, tangential) =
            ((r_d * r_d - r_m * r_m) / self.radial_gain, self.orbit_direction.sign() * 2.0 * r_m * r_d);
        FieldAt { field: *self, r_m, radial, tangential, size: math::hypot(radial, tangential) }
    }

    /// Direction of the field at the UAV's position relative to the centre, a unit vector; defined everywhere.
    pub fn direction(&self, uav_rel_centre: Displacement) -> Vector2<f64> {
        self.at(uav_rel_centre.length_m()).direction(uav_rel_centre)
    }

    /// Desired velocity relative to a stationary centre, of magnitude `speed_m_s`.
    ///
    /// Implements Eq. (13), and with `radial_gain` below 1 the direction of (20).
    pub fn velocity(&self, uav_rel_centre: Displacement, speed_m_s: f64) -> Velocity {
        (self.direction(uav_rel_centre) * speed_m_s).into()
    }

    /// Radial speed of the field before it is rescaled to `speed_m_s`, m/s, positive outward.
    ///
    /// Implements Eq. (14), radial part, and Eq. (20).
    pub fn radial_speed_m_s(&self, r_m: f64, speed_m_s: f64) -> f64 {
        let (r2, r_d2) = (r_m * r_m, self.radius_m * self.radius_m);
        -(speed_m_s / self.radial_gain) * (r2 - r_d2) / (r2 + r_d2)
    }

    /// Motion relative to the centre of a UAV that flies along the field at relative speed `speed_m_s`; finite at r =
    /// 0.
    ///
    /// Implements Eq. (14), both parts, rescaled to the speed if k_l is below 1.
    pub fn motion_along(&self, r_m: f64, speed_m_s: f64) -> PolarMotion {
        self.at(r_m).motion_along(speed_m_s)
    }

    /// Rate at which the direction of the field at the UAV turns, rad/s, for a given motion of the UAV and a radius
    /// that changes at `radius_rate_m_s`.
    ///
    /// Implements Eq. (25), corrected: for a UAV that flies along the field, with k_l = 1, the rate is
    /// `4 v r_d^3 / (r^2 + r_d^2)^2 - 2 r r_d' / (r^2 + r_d^2)`.
    pub fn turn_rate_rad_s(&self, r_m: f64, motion: PolarMotion, radius_rate_m_s: f64) -> f64 {
        self.at(r_m).turn_rate_rad_s(motion, radius_rate_m_s)
    }
}

/// The field at one distance from the centre: radial and tangential component, up to a common positive factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldAt {
    field: VectorField,
    pub(crate) r_m: f64,
    radial: f64,
    tangential: f64,
    /// Magnitude of both components together.
    size: f64,
}

impl FieldAt {
    /// See [`VectorField::direction`]; the UAV must be at distance `r_m`.
    #[inline]
    pub(crate) fn direction(&self, uav_rel_centre: Displacement) -> Vector2<f64> {
        let outward = if self.r_m > 0.0 { uav_rel_centre.vector() / self.r_m } else { Vector2::x() };
        let (radial, tangential) = (self.radial / self.size, self.tangential / self.size);
        Vector2::new(outward.x * radial - outward.y * tangential, outward.y * radial + outward.x * tangential)
    }

    /// See [`VectorField::motion_along`].
    #[inline]
    pub(crate) fn motion_along(&self, speed_m_s: f64) -> PolarMotion {
        PolarMotion {
            r_rate_m_s: speed_m_s * self.radial / self.size,
            // The tangential component divided by r.
            phase_rate_rad_s: speed_m_s * self.field.orbit_direction.sign() * 2.0 * self.field.radius_m / self.size,
        }
    }

    /// See [`VectorField::turn_rate_rad_s`].
    #[inline]
    pub(crate) fn turn_rate_rad_s(&self, motion: PolarMotion, radius_rate_m_s: f64) -> f64 {
        let Self { field, r_m: r, radial, tangential, size } = *self;
        let (r_d, k, sign) = (field.radius_m, field.radial_gain, field.orbit_direction.sign());
        let radial_rate = 2.0 * (r_d * radius_rate_m_s - r * motion.r_rate_m_s) / k;
        let tangential_rate = sign * 2.0 * (motion.r_rate_m_s * r_d + r * radius_rate_m_s);
        let inclination_rate = (radial / size) * (tangential_rate / size) - (tangential / size) * (radial_rate / size);
        motion.phase_rate_rad_s + inclination_rate
    }
}

/// Motion of a UAV relative to a centre, in polar coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarMotion {
    /// Rate of the distance r, m/s, positive outward.
    pub r_rate_m_s: f64,
    /// Rate of the phase theta, rad/s, positive anticlockwise.
    pub phase_rate_rad_s: f64,
}

impl PolarMotion {
    /// Converts a relative position and velocity. At the centre, where the phase is undefined, the phase rate is zero.
    pub fn of(uav_rel_centre: Displacement, velocity_rel_centre: Velocity) -> Self {
        let r_m = uav_rel_centre.length_m();
        if r_m < SAME_PLACE_M {
            return Self { r_rate_m_s: velocity_rel_centre.speed_m_s(), phase_rate_rad_s: 0.0 };
        }
        let outward = uav_rel_centre.vector() / r_m;
        let velocity = velocity_rel_centre.vector();
        Self {
            r_rate_m_s: outward.dot(&velocity),
            phase_rate_rad_s: (outward.x * velocity.y - outward.y * velocity.x) / r_m,
        }
    }
}

/// Distance below which a UAV counts as being at the centre, m.
const SAME_PLACE_M: f64 = 1e-3;

/// Lyapunov function of the field, m4: zero on the circle.
///
/// Implements Eq. (12).
pub fn lyapunov_m4(r_m: f64, radius_m: f64) -> f64 {
    let difference = r_m * r_m - radius_m * radius_m;
    difference * difference
}

/// Rate of the Lyapunov function, m4/s: `4 (r^2 - r_d^2)(r r' - r_d r_d')`.
///
/// Implements Eq. (18), first line. With `(14)` or `(20)` substituted for r', it gives the second line as in (21).
pub fn lyapunov_rate_m4_s(r_m: f64, r_rate_m_s: f64, radius_m: f64, radius_rate_m_s: f64) -> f64 {
    4.0 * (r_m * r_m - radius_m * radius_m) * (r_m * r_rate_m_s - radius_m * radius_rate_m_s)
}

/// Threshold of Lemma 3.1, m2/s. While it is not negative, the UAV converges to an orbit with a changing radius.
///
/// Implements Lemma 3.1 with Eq. (17), (19): xi_th = (r r' - r_d r_d') sgn(r_d - r).
#[doc(alias = "xi_th")]
pub(crate) fn convergence_threshold_m2_s(r_m: f64, r_rate_m_s: f64, radius_m: f64, radius_rate_m_s: f64) -> f64 {
    let sgn = if radius_m > r_m {
        1.0
    } else if radius_m < r_m {
        -1.0
    } else {
        0.0
    };
    (r_m * r_rate_m_s - radius_m * radius_rate_m_s) * sgn
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::Position;

    fn field(radius_m: f64, radial_gain: f64, sense: OrbitDirection) -> VectorField {
        VectorField { radius_m, radial_gain, orbit_direction: sense }
    }

    fn heading(field: VectorField, uav_rel_centre: Displacement) -> Angle {
        field.velocity(uav_rel_centre, 1.0).direction()
    }

    fn at(r_m: f64, deg: f64) -> Displacement {
        Displacement::from_polar(r_m, Angle::from_deg(deg))
    }

    /// Checks Eq. (13): the published components, term by term, inside and outside the orbit.
    #[test]
    fn the_plain_field_is_the_published_one() {
        let (v, r_d) = (40.0, 300.0);
        for (r, deg) in [(100.0, 20.0), (300.0, 170.0), (900.0, -75.0)] {
            let d = at(r, deg);
            let (dx, dy) = (d.x_m(), d.y_m());
            let factor = -v / (r * (r * r + r_d * r_d));
            let x = factor * (dx * (r * r - r_d * r_d) + dy * 2.0 * r * r_d);
            let y = factor * (dy * (r * r - r_d * r_d) - dx * 2.0 * r * r_d);
            let got = field(r_d, 1.0, OrbitDirection::Anticlockwise).velocity(d, v);
            assert!((got - Velocity::from_m_s(x, y)).speed_m_s() < 1e-9, "r = {r}");
        }
    }

    #[test]
    fn the_field_is_tangential_on_the_circle_in_both_directions() {
        for (sense, expected_deg) in [(OrbitDirection::Anticlockwise, 120.0), (OrbitDirection::Clockwise, -60.0)] {
            let heading = heading(field(300.0, 0.2, sense), at(300.0, 30.0));
            assert!((heading.deg() - expected_deg).abs() < 1e-9);
        }
    }

    #[test]
    fn the_heading_at_the_centre_is_finite_and_outward() {
        let f = field(300.0, 1.0, OrbitDirection::Anticlockwise);
        assert_eq!(heading(f, Position::ORIGIN - Position::ORIGIN), Angle::ZERO);
        assert!((heading(f, at(1e-6, 77.0)).deg() - 77.0).abs() < 1e-3);
        assert!(f.turn_rate_rad_s(0.0, f.motion_along(0.0, 40.0), 0.0).is_finite());
        let overhead = PolarMotion::of(at(0.0, 0.0), Velocity::from_m_s(3.0, 4.0));
        assert_eq!(overhead, PolarMotion { r_rate_m_s: 5.0, phase_rate_rad_s: 0.0 });
    }

    /// Checks Eq. (14): radial and tangential speeds of (13), and (20): the radial one divided by k_l.
    #[test]
    fn active_measure_1_steepens_the_approach() {
        let (v, r, r_d) = (40.0, 500.0, 300.0);
        let plain = field(r_d, 1.0, OrbitDirection::Anticlockwise);
        let published = -v * (r * r - r_d * r_d) / (r * r + r_d * r_d);
        assert!((plain.radial_speed_m_s(r, v) - published).abs() < 1e-12);
        assert!((plain.motion_along(r, v).r_rate_m_s - published).abs() < 1e-9);
        let steep = field(r_d, 0.2, OrbitDirection::Anticlockwise);
        assert!((steep.radial_speed_m_s(r, v) - published / 0.2).abs() < 1e-9);
        // The vector is longer than v; the flown velocity has its direction and the speed v.
        assert!(steep.radial_speed_m_s(r, v).abs() > v);
        let tangential = v * 2.0 * r * r_d / (r * r + r_d * r_d);
        let expected = math::atan2(tangential, published / 0.2);
        assert!((heading(steep, at(r, 0.0)).rad() - expected).abs() < 1e-12);
        assert!((steep.velocity(at(r, 0.0), v).speed_m_s() - v).abs() < 1e-12);
    }

    /// Checks the exact form of Eq. (25): the turn rate is the derivative of the heading along the field, by central
    /// differences, with k_l and both orbit directions.
    #[test]
    fn the_turn_rate_is_the_derivative_along_the_field() {
        let (v, radius_rate) = (40.0, 4.0);
        for sense in [OrbitDirection::Anticlockwise, OrbitDirection::Clockwise] {
            for k_l in [1.0, 0.2] {
                for r in [5.0, 100.0, 290.0, 300.0, 450.0, 2000.0] {
                    let f = field(300.0, k_l, sense);
                    let here = Position::ORIGIN + at(r, 40.0);
                    let h = 1e-4;
                    let heading_at = |t: f64| {
                        let moved = here + f.velocity(here - Position::ORIGIN, v) * t - Position::ORIGIN;
                        heading(field(300.0 + radius_rate * t, k_l, sense), moved)
                    };
                    let difference = (heading_at(h) - heading_at(-h)).rad() / (2.0 * h);
                    let motion = f.motion_along(r, v);
                    let cartesian = PolarMotion::of(at(r, 40.0), f.velocity(at(r, 40.0), v));
                    assert!((motion.r_rate_m_s - cartesian.r_rate_m_s).abs() < 1e-9);
                    assert!((motion.phase_rate_rad_s - cartesian.phase_rate_rad_s).abs() < 1e-9);
                    let got = f.turn_rate_rad_s(r, motion, radius_rate);
                    assert!((got - difference).abs() < 1e-5 * (1.0 + got.abs()), "r {r} k {k_l}: {got} {difference}");
                }
            }
        }
    }

    /// Checks Eq. (12), (18), (21): along the field the Lyapunov function decreases at 4 v r (r^2-r_d^2)^2 /
    /// (r^2+r_d^2), with the denominator to the power 1, and k_l makes it decrease faster.
    #[test]
    fn the_lyapunov_function_decreases_along_the_field() {
        let (v, r_d) = (40.0, 300.0);
        for r in [50.0, 200.0, 299.0, 301.0, 800.0] {
            let plain = field(r_d, 1.0, OrbitDirection::Anticlockwise).radial_speed_m_s(r, v);
            let rate = lyapunov_rate_m4_s(r, plain, r_d, 0.0);
            let closed = -4.0 * v * r * lyapunov_m4(r, r_d) / (r * r + r_d * r_d);
            assert!((rate - closed).abs() < 1e-9 * closed.abs());
            let steep = field(r_d, 0.2, OrbitDirection::Anticlockwise).radial_speed_m_s(r, v);
            assert!((lyapunov_rate_m4_s(r, steep, r_d, 0.0) - closed / 0.2).abs() < 1e-9 * closed.abs() / 0.2);
        }
    }

    /// Checks Lemma 3.1 with Eq. (17), (19): the Lyapunov function does not grow while the threshold is not negative.
    #[test]
    fn the_threshold_has_the_opposite_sign_of_the_lyapunov_rate() {
        let f = field(300.0, 1.0, OrbitDirection::Anticlockwise);
        for r in [100.0, 280.0, 320.0, 600.0] {
            for radius_rate in [-20.0, -3.0, 0.0, 3.0, 20.0] {
                let r_rate = f.radial_speed_m_s(r, 40.0);
                let xi = convergence_threshold_m2_s(r, r_rate, 300.0, radius_rate);
                let falls = lyapunov_rate_m4_s(r, r_rate, 300.0, radius_rate) <= 0.0;
                assert_eq!(xi >= 0.0, falls, "r {r}, rate {radius_rate}");
            }
        }
        assert_eq!(convergence_threshold_m2_s(300.0, 5.0, 300.0, 1.0), 0.0);
    }
}
