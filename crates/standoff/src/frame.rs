//! Points and vectors in the world frame, a local tangent plane: x east, y north.
//!
//! Each type is a pair of plain numbers, which is passed in registers. A library vector would be passed through memory.

use core::ops::{Add, Mul, Sub};

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::math;

/// Maximum plausible distance from the origin or from a sensor, m: more than twice the circumference of the Earth. It
/// keeps squared distances finite.
pub(crate) const FARTHEST_M: f64 = 1e8;

/// Maximum plausible speed, m/s: a multiple of escape velocity.
pub(crate) const FASTEST_M_S: f64 = 1e5;

/// Maximum plausible turn rate, rad/s: 16 turns per second.
pub(crate) const FASTEST_RAD_S: f64 = 100.0;

/// A point, metres east and north of the origin.
///
/// ```
/// use standoff::{Displacement, Position};
///
/// let uav = Position::from_m(400.0, 0.0);
/// let centre = Position::from_m(0.0, 300.0);
/// let to_centre: Displacement = centre - uav;
/// assert_eq!((to_centre.length_m(), uav.distance_m(centre)), (500.0, 500.0));
/// assert!((to_centre.direction().deg() - 143.13).abs() < 0.01);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Position {
    x_m: f64,
    y_m: f64,
}

/// Vector from one point to another, metres east and north.
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

    /// Creates a position from metres east and north.
    #[inline]
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// East coordinate, m.
    #[inline]
    pub fn x_m(self) -> f64 {
        self.x_m
    }

    /// North coordinate, m.
    #[inline]
    pub fn y_m(self) -> f64 {
        self.y_m
    }

    /// Coordinates as a vector `[x, y]`, m.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// Squared distance to another position, m2; faster than the distance, for comparisons.
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

    /// Point halfway to another position.
    #[inline]
    pub fn midpoint(self, other: Self) -> Self {
        Self::from_m(0.5 * (self.x_m + other.x_m), 0.5 * (self.y_m + other.y_m))
    }

    /// Point of the straight line between two positions that is nearest to this one.
    #[inline]
    pub fn nearest_on_line(self, from: Self, to: Self) -> Self {
        let (along, to_self) = ((to - from).vector(), (self - from).vector());
        let squared_m2 = along.norm_squared();
        let share = if squared_m2 > 0.0 { (to_self.dot(&along) / squared_m2).clamp(0.0, 1.0) } else { 0.0 };
        Self::from(from.vector() + along * share)
    }

    /// Returns true if both coordinates are finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite()
    }

    /// Returns true if the absolute values of both coordinates are at most `max_m`; false for NaN.
    pub(crate) fn is_within(self, max_m: f64) -> bool {
        self.x_m.abs() <= max_m && self.y_m.abs() <= max_m
    }
}

impl Displacement {
    /// Creates a displacement from metres east and north.
    #[inline]
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// Creates a displacement from a length in metres and a direction.
    #[inline]
    pub fn from_polar(length_m: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self { x_m: length_m * cos, y_m: length_m * sin }
    }

    /// East component, m.
    #[inline]
    pub fn x_m(self) -> f64 {
        self.x_m
    }

    /// North component, m.
    #[inline]
    pub fn y_m(self) -> f64 {
        self.y_m
    }

    /// Components as a vector `[x, y]`, m.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// Length, m.
    #[inline]
    pub fn length_m(self) -> f64 {
        math::hypot(self.x_m, self.y_m)
    }

    /// Direction, anticlockwise from east; east for a zero displacement.
    #[inline]
    pub fn direction(self) -> Angle {
        Angle::from_arc_rad(math::atan2(self.y_m, self.x_m))
    }

    /// [Directions](Self::direction) of several displacements. Same results, but faster.
    #[inline]
    pub fn direction_batch<const N: usize>(displacements: [Self; N]) -> [Angle; N] {
        let directions_rad = math::atan2_batch(displacements.map(|displacement| (displacement.y_m, displacement.x_m)));
        core::array::from_fn(|i| Angle::from_arc_rad(directions_rad[i]))
    }
}

impl Velocity {
    /// Zero velocity: stationary.
    pub const ZERO: Self = Self { x_m_s: 0.0, y_m_s: 0.0 };

    /// Creates a velocity from metres per second east and north.
    #[inline]
    pub fn from_m_s(x_m_s: f64, y_m_s: f64) -> Self {
        Self { x_m_s, y_m_s }
    }

    /// Creates a velocity from a speed in m/s and a direction.
    #[inline]
    pub fn from_polar(speed_m_s: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self { x_m_s: speed_m_s * cos, y_m_s: speed_m_s * sin }
    }

    /// East component, m/s.
    #[inline]
    pub fn x_m_s(self) -> f64 {
        self.x_m_s
    }

    /// North component, m/s.
    #[inline]
    pub fn y_m_s(self) -> f64 {
        self.y_m_s
    }

    /// Components as a vector `[x, y]`, m/s.
    #[inline]
    pub fn vector(self) -> Vector2<f64> {
        Vector2::new(self.x_m_s, self.y_m_s)
    }

    /// Speed, m/s.
    #[inline]
    pub fn speed_m_s(self) -> f64 {
        math::hypot(self.x_m_s, self.y_m_s)
    }

    /// Direction of motion, anticlockwise from east; east if stationary.
    #[inline]
    pub fn direction(self) -> Angle {
        Angle::from_arc_rad(math::atan2(self.y_m_s, self.x_m_s))
    }

    /// Returns true if both components are finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.x_m_s.is_finite() && self.y_m_s.is_finite()
    }

    /// Returns true if the absolute values of both components are at most `max_m_s`; false for NaN.
    pub(crate) fn is_within(self, max_m_s: f64) -> bool {
        self.x_m_s.abs() <= max_m_s && self.y_m_s.abs() <= max_m_s
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

/// Displacement after a number of seconds at constant velocity.
impl Mul<f64> for Velocity {
    type Output = Displacement;
    #[inline]
    fn mul(self, seconds: f64) -> Displacement {
        Displacement { x_m: self.x_m_s * seconds, y_m: self.y_m_s * seconds }
    }
}
