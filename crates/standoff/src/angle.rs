//! Angles, wrapped to (-pi, pi]. No other module wraps angles.

use core::ops::{Add, Neg, Sub};

use crate::math::{self, PI, TAU};

/// An angle in radians, anticlockwise from east, always in (-pi, pi].
///
/// Sums and differences wrap, so the difference of two angles is the shorter rotation.
///
/// ```
/// use standoff::Angle;
/// let turn = Angle::from_deg(-170.0) - Angle::from_deg(170.0);
/// assert!((turn.deg() - 20.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, serde::Serialize, serde::Deserialize)]
pub struct Angle(f64);

impl Angle {
    /// East, the zero angle.
    pub const ZERO: Self = Self(0.0);

    /// Wraps any finite number of radians.
    #[inline]
    pub fn from_rad(rad: f64) -> Self {
        Self(wrap_rad(rad))
    }

    /// Creates an angle from the radians in [-pi, pi] that an arc tangent returns: only -pi is wrapped.
    #[inline]
    pub(crate) fn from_arc_rad(rad: f64) -> Self {
        Self(if rad == -PI { PI } else { rad })
    }

    /// Wraps any finite number of degrees.
    #[inline]
    pub fn from_deg(deg: f64) -> Self {
        Self::from_rad(deg.to_radians())
    }

    /// Radians in (-pi, pi].
    #[inline]
    pub fn rad(self) -> f64 {
        self.0
    }

    /// Degrees in (-180, 180].
    #[inline]
    pub fn deg(self) -> f64 {
        self.0.to_degrees()
    }

    /// Size of the angle, radians in [0, pi].
    #[inline]
    pub fn abs_rad(self) -> f64 {
        self.0.abs()
    }

    /// Cosine.
    #[inline]
    pub fn cos(self) -> f64 {
        math::cos(self.0)
    }

    /// Sine.
    #[inline]
    pub fn sin(self) -> f64 {
        math::sin(self.0)
    }

    /// Sine and cosine.
    #[inline]
    pub fn sin_cos(self) -> (f64, f64) {
        math::sin_cos(self.0)
    }
}

impl Add for Angle {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::from_rad(self.0 + other.0)
    }
}

impl Sub for Angle {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::from_rad(self.0 - other.0)
    }
}

impl Neg for Angle {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::from_rad(-self.0)
    }
}

#[inline]
fn wrap_rad(rad: f64) -> f64 {
    if rad > -PI && rad <= PI { rad } else { wrap_out_of_range_rad(rad) }
}

/// Wraps radians that are out of range.
fn wrap_out_of_range_rad(rad: f64) -> f64 {
    // The sum of two angles is out of range by less than one turn; a remainder is slow.
    let turned = if rad.abs() < 3.0 * PI { rad } else { rad % TAU };
    if turned <= -PI {
        turned + TAU
    } else if turned > PI {
        turned - TAU
    } else {
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn half_a_turn_is_plus_pi_never_minus_pi() {
        for turns in [-3.0, -1.0, 1.0, 3.0] {
            assert_eq!(Angle::from_rad(turns * PI).rad(), PI);
        }
    }

    #[test]
    fn a_difference_is_the_shorter_rotation() {
        let across_west = Angle::from_deg(-179.0) - Angle::from_deg(179.0);
        assert!((across_west.deg() - 2.0).abs() < 1e-9);
    }

    #[test]
    fn due_west_is_plus_pi_for_both_signs_of_zero() {
        for y_m in [0.0, -0.0] {
            let west = crate::Displacement::from_m(-3.0, y_m);
            assert_eq!(west.direction().rad(), PI);
        }
        assert!(Angle::from_arc_rad(f64::NAN).rad().is_nan());
    }

    proptest! {
        /// Wrapping without a division gives the same bits as the remainder.
        #[test]
        fn angles_less_than_a_turn_and_a_half_are_wrapped_exactly(rad in -3.0 * PI..3.0 * PI) {
            let remainder = rad % TAU;
            let back = if remainder > PI { TAU } else if remainder <= -PI { -TAU } else { 0.0 };
            prop_assert_eq!(Angle::from_rad(rad).rad(), remainder - back);
        }

        #[test]
        fn wrapped_angles_are_in_range_and_keep_their_direction(rad in -1e6..1e6f64) {
            let angle = Angle::from_rad(rad);
            prop_assert!(angle.rad() > -PI && angle.rad() <= PI);
            prop_assert!((angle.cos() - math::cos(rad)).abs() < 1e-9);
            prop_assert!((angle.sin() - math::sin(rad)).abs() < 1e-9);
            prop_assert_eq!(Angle::from_rad(angle.rad()), angle);
        }
    }
}
