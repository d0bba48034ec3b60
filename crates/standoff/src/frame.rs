//! Points and vectors of the one world frame: a local tangent plane, x east, y north.
//!
//! Two plain numbers each, which travel in registers; a vector of a library would go through memory.

use core::ops::{Add, Mul, Sub};

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::math;

/// Nothing is farther from the origin, or from a sensor, than this: more than twice around the Earth. Squares of what is farther
/// are no numbers.
pub(crate) const FARTHEST_M: f64 = 1e8;

/// Nothing on or above the ground is faster than this: a multiple of what leaves the Earth.
pub(crate) const FASTEST_M_S: f64 = 1e5;

/// Nothing that flies turns faster than this: sixteen times a second.
pub(crate) const FASTEST_RAD_S: f64 = 100.0;

/// A point, metres east and north of the origin.
///
/// ```
/// use standoff::{Displacement, Position};
///
/// let uav = Position::from_m(400.0, 0.0);
/// let centre = Position::from_m(0.0, 300.0);
/// let to_centre: Displacement = centre - uav;
/// assert_eq!((to_centre.x_m(), to_centre.y_m()), (-400.0, 300.0));
/// assert_eq!(uav.distance_m(centre), 500.0);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Position {
    x_m: f64,
    y_m: f64,
}

/// From one point to another, metres east and north.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Displacement {
    x_m: f64,
    y_m: f64,
}

/// A velocity, metres per second east and north.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Velocity {
    x_m_s: f64,
    y_m_s: f64,
}

impl Position {
    /// The origin of the frame.
    pub const ORIGIN: Self = Self { x_m: 0.0, y_m: 0.0 };

    /// From metres east and north.
    #[inline]
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// East, m.
    #[inline]
    pub fn x_m(self) -> f64 {
        self.x_m
    }

    /// North, m.
    #[inline]
    pub fn y_m(self) -> f64 {
        self.y_m
    }

    /// As a vector `[x, y]`, m.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// Squared distance to another position, m2: for comparisons.
    #[inline]
    pub fn squared_distance_m2(self, other: Self) -> f64 {
        let (x_m, y_m) = (self.x_m() - other.x_m(), self.y_m() - other.y_m());
        x_m * x_m + y_m * y_m
    }

    /// Distance to another position, m.
    #[inline]
    pub fn distance_m(self, other: Self) -> f64 {
        (self - other).length_m()
    }

    /// Both coordinates are finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite()
    }

    /// Both components are finite and no more than so much, either way.
    pub(crate) fn is_within(self, most_m: f64) -> bool {
        self.x_m.abs() <= most_m && self.y_m.abs() <= most_m
    }
}

impl Displacement {
    /// From metres east and north.
    #[inline]
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// From a length in metres and a direction.
    #[inline]
    pub fn from_polar(length_m: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self { x_m: length_m * cos, y_m: length_m * sin }
    }

    /// East, m.
    #[inline]
    pub fn x_m(self) -> f64 {
        self.x_m
    }

    /// North, m.
    #[inline]
    pub fn y_m(self) -> f64 {
        self.y_m
    }

    /// As a vector `[x, y]`, m.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// Length, m.
    #[inline]
    pub fn length_m(self) -> f64 {
        math::hypot(self.x_m, self.y_m)
    }

    /// Direction, anticlockwise from east; east for no displacement at all.
    #[inline]
    pub fn direction(self) -> Angle {
        Angle::from_arc_rad(math::atan2(self.y_m, self.x_m))
    }

    /// [Directions](Self::direction) of several: the same as one by one, in less time.
    #[inline]
    pub(crate) fn direction_each<const N: usize>(several: [Self; N]) -> [Angle; N] {
        let directions_rad = math::atan2_each(several.map(|one| (one.y_m, one.x_m)));
        core::array::from_fn(|i| Angle::from_arc_rad(directions_rad[i]))
    }
}

impl Velocity {
    /// At rest.
    pub const ZERO: Self = Self { x_m_s: 0.0, y_m_s: 0.0 };

    /// From metres per second east and north.
    #[inline]
    pub fn from_m_s(x_m_s: f64, y_m_s: f64) -> Self {
        Self { x_m_s, y_m_s }
    }

    /// From a speed in m/s and a direction.
    #[inline]
    pub fn from_polar(speed_m_s: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self { x_m_s: speed_m_s * cos, y_m_s: speed_m_s * sin }
    }

    /// East, m/s.
    #[inline]
    pub fn x_m_s(self) -> f64 {
        self.x_m_s
    }

    /// North, m/s.
    #[inline]
    pub fn y_m_s(self) -> f64 {
        self.y_m_s
    }

    /// As a vector `[x, y]`, m/s.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m_s, self.y_m_s)
    }

    /// Speed, m/s.
    #[inline]
    pub fn speed_m_s(self) -> f64 {
        math::hypot(self.x_m_s, self.y_m_s)
    }

    /// Direction of motion, anticlockwise from east; east when at rest.
    #[inline]
    pub fn direction(self) -> Angle {
        Angle::from_arc_rad(math::atan2(self.y_m_s, self.x_m_s))
    }

    /// Both components are finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.x_m_s.is_finite() && self.y_m_s.is_finite()
    }

    /// Both components are finite and no more than so much, either way.
    pub(crate) fn is_within(self, most_m_s: f64) -> bool {
        self.x_m_s.abs() <= most_m_s && self.y_m_s.abs() <= most_m_s
    }
}

impl From<Vector2<f64>> for Position {
    #[inline]
    fn from(xy_m: Vector2<f64>) -> Self {
        Self { x_m: xy_m.x, y_m: xy_m.y }
    }
}

impl From<Vector2<f64>> for Velocity {
    #[inline]
    fn from(xy_m_s: Vector2<f64>) -> Self {
        Self { x_m_s: xy_m_s.x, y_m_s: xy_m_s.y }
    }
}

/// `uav_rel_centre = uav - centre`.
impl Sub for Position {
    type Output = Displacement;
    #[inline]
    fn sub(self, other: Self) -> Displacement {
        Displacement { x_m: self.x_m - other.x_m, y_m: self.y_m - other.y_m }
    }
}

impl Add<Displacement> for Position {
    type Output = Self;
    #[inline]
    fn add(self, displacement: Displacement) -> Self {
        Self { x_m: self.x_m + displacement.x_m, y_m: self.y_m + displacement.y_m }
    }
}

impl Sub for Velocity {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { x_m_s: self.x_m_s - other.x_m_s, y_m_s: self.y_m_s - other.y_m_s }
    }
}

impl Add for Velocity {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self { x_m_s: self.x_m_s + other.x_m_s, y_m_s: self.y_m_s + other.y_m_s }
    }
}

/// A velocity held for a number of seconds.
impl Mul<f64> for Velocity {
    type Output = Displacement;
    #[inline]
    fn mul(self, seconds: f64) -> Displacement {
        Displacement { x_m: self.x_m_s * seconds, y_m: self.y_m_s * seconds }
    }
}
