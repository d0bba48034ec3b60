//! Points and vectors of the one world frame: a local tangent plane, x east, y north.

use core::ops::{Add, Mul, Sub};

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::math;

/// A point, metres east and north of the origin.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Position(Vector2<f64>);

/// From one point to another, metres east and north.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Displacement(Vector2<f64>);

/// A velocity, metres per second east and north.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Velocity(Vector2<f64>);

impl Position {
    /// The origin of the frame.
    pub const ORIGIN: Self = Self(Vector2::new(0.0, 0.0));

    /// From metres east and north.
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self(Vector2::new(x_m, y_m))
    }

    /// East, m.
    pub fn x_m(self) -> f64 {
        self.0.x
    }

    /// North, m.
    pub fn y_m(self) -> f64 {
        self.0.y
    }

    /// As a vector `[x, y]`, m.
    pub fn vector(self) -> Vector2<f64> {
        self.0
    }

    /// Squared distance to another position, m2: for comparisons.
    pub fn squared_distance_m2(self, other: Self) -> f64 {
        let (x_m, y_m) = (self.x_m() - other.x_m(), self.y_m() - other.y_m());
        x_m * x_m + y_m * y_m
    }

    /// Distance to another position, m.
    pub fn distance_m(self, other: Self) -> f64 {
        (self - other).length_m()
    }

    /// Both coordinates are finite.
    pub fn is_finite(self) -> bool {
        self.0.x.is_finite() && self.0.y.is_finite()
    }
}

impl Displacement {
    /// From metres east and north.
    pub fn from_m(x_m: f64, y_m: f64) -> Self {
        Self(Vector2::new(x_m, y_m))
    }

    /// From a length in metres and a direction.
    pub fn from_polar(length_m: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self(Vector2::new(length_m * cos, length_m * sin))
    }

    /// East, m.
    pub fn x_m(self) -> f64 {
        self.0.x
    }

    /// North, m.
    pub fn y_m(self) -> f64 {
        self.0.y
    }

    /// As a vector `[x, y]`, m.
    pub fn vector(self) -> Vector2<f64> {
        self.0
    }

    /// Length, m.
    pub fn length_m(self) -> f64 {
        math::hypot(self.0.x, self.0.y)
    }

    /// Direction, anticlockwise from east; east for no displacement at all.
    pub fn direction(self) -> Angle {
        Angle::from_rad(math::atan2(self.0.y, self.0.x))
    }
}

impl Velocity {
    /// At rest.
    pub const ZERO: Self = Self(Vector2::new(0.0, 0.0));

    /// From metres per second east and north.
    pub fn from_m_s(x_m_s: f64, y_m_s: f64) -> Self {
        Self(Vector2::new(x_m_s, y_m_s))
    }

    /// From a speed in m/s and a direction.
    pub fn from_polar(speed_m_s: f64, direction: Angle) -> Self {
        let (sin, cos) = direction.sin_cos();
        Self(Vector2::new(speed_m_s * cos, speed_m_s * sin))
    }

    /// East, m/s.
    pub fn x_m_s(self) -> f64 {
        self.0.x
    }

    /// North, m/s.
    pub fn y_m_s(self) -> f64 {
        self.0.y
    }

    /// As a vector `[x, y]`, m/s.
    pub fn vector(self) -> Vector2<f64> {
        self.0
    }

    /// Speed, m/s.
    pub fn speed_m_s(self) -> f64 {
        math::hypot(self.0.x, self.0.y)
    }

    /// Direction of motion, anticlockwise from east; east when at rest.
    pub fn direction(self) -> Angle {
        Angle::from_rad(math::atan2(self.0.y, self.0.x))
    }

    /// Both components are finite.
    pub fn is_finite(self) -> bool {
        self.0.x.is_finite() && self.0.y.is_finite()
    }
}

impl From<Vector2<f64>> for Position {
    fn from(xy_m: Vector2<f64>) -> Self {
        Self(xy_m)
    }
}

impl From<Vector2<f64>> for Velocity {
    fn from(xy_m_s: Vector2<f64>) -> Self {
        Self(xy_m_s)
    }
}

/// `uav_rel_centre = uav - centre`.
impl Sub for Position {
    type Output = Displacement;
    fn sub(self, other: Self) -> Displacement {
        Displacement(self.0 - other.0)
    }
}

impl Add<Displacement> for Position {
    type Output = Self;
    fn add(self, displacement: Displacement) -> Self {
        Self(self.0 + displacement.0)
    }
}

impl Sub for Velocity {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Add for Velocity {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

/// A velocity held for a number of seconds.
impl Mul<f64> for Velocity {
    type Output = Displacement;
    fn mul(self, seconds: f64) -> Displacement {
        Displacement(self.0 * seconds)
    }
}
