//! Shapes of the scene. Sizes are in metres; line widths and font sizes are in screen pixels.

use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, LinePrimitive, Point3, Pose, SpherePrimitive, TextPrimitive, Vector3,
    line_primitive::Type,
};
use plotters::style::RGBColor;
use standoff::research::math::{TAU, cos, sin};

use super::pose::{pose, vector};

/// Number of points of an orbit, one per 5 degrees.
const ORBIT_POINTS: u32 = 72;
/// Number of points of a covariance ellipse.
const ELLIPSE_POINTS: u32 = 24;
/// Number of segments of the far edge of a field of view.
const VIEW_STEPS: u32 = 16;
/// Size of the ellipse with 95 % of a two-dimensional normal distribution, in standard deviations.
pub(super) const ELLIPSE_SDS: f64 = 2.447_746_830_680_816;

pub(super) fn colour(RGBColor(red, green, blue): RGBColor) -> Color {
    let share = |part| f64::from(part) / 255.0;
    Color { r: share(red), g: share(green), b: share(blue), a: 1.0 }
}

pub(super) fn arrow(pose: Pose, colour: Color) -> ArrowPrimitive {
    ArrowPrimitive {
        pose: Some(pose),
        shaft_length: 30.0,
        shaft_diameter: 8.0,
        head_length: 25.0,
        head_diameter: 20.0,
        color: Some(colour),
    }
}

pub(super) fn cube(pose: Pose, colour: Color) -> CubePrimitive {
    CubePrimitive { pose: Some(pose), size: Some(vector(10.0, 6.0, 4.0)), color: Some(colour) }
}

pub(super) fn sphere(position: Vector3, colour: Color) -> SpherePrimitive {
    SpherePrimitive { pose: Some(pose(position, 0.0)), size: Some(vector(14.0, 14.0, 14.0)), color: Some(colour) }
}

pub(super) fn text(position: Vector3, text: String, colour: Color) -> TextPrimitive {
    TextPrimitive {
        pose: Some(pose(position, 0.0)),
        billboard: true,
        font_size: 14.0,
        scale_invariant: true,
        color: Some(colour),
        text,
    }
}

/// A closed polygon.
pub(super) fn outline(corners: &[Vector3], colour: Color) -> LinePrimitive {
    closed_line(corners.iter().map(|at| Point3 { x: at.x, y: at.y, z: at.z }).collect(), colour)
}

/// A circle in a horizontal plane.
pub(super) fn circle(centre: Vector3, radius_m: f64, colour: Color) -> LinePrimitive {
    let at = |(sin, cos)| Point3 { x: centre.x + radius_m * cos, y: centre.y + radius_m * sin, z: centre.z };
    closed_line(around(ORBIT_POINTS).map(at).collect(), colour)
}

/// The ellipse on the ground with 95 % of a normal distribution with this mean (east, north) and covariance (east-east,
/// east-north, north-north).
pub(super) fn ellipse([x, y]: [f64; 2], [xx, xy, yy]: [f64; 3], colour: Color) -> LinePrimitive {
    // The covariance is L L' with L lower triangular; L maps the unit circle to the ellipse of one standard deviation.
    let sd = xx.max(0.0).sqrt();
    let across = if sd > 0.0 { xy / sd } else { 0.0 };
    let along = (yy - across * across).max(0.0).sqrt();
    let at = |(sin, cos)| Point3 {
        x: x + ELLIPSE_SDS * sd * cos,
        y: y + ELLIPSE_SDS * (across * cos + along * sin),
        z: 0.0,
    };
    closed_line(around(ELLIPSE_POINTS).map(at).collect(), colour)
}

/// Field of view of a sensor: a pyramid outline from the UAV to an arc on the ground, at `reach_m` from the point below
/// the UAV.
pub(super) fn view(uav: Vector3, boresight_rad: f64, angle_rad: f64, reach_m: f64, colour: Color) -> LinePrimitive {
    let edge = |step| boresight_rad + angle_rad * (f64::from(step) / f64::from(VIEW_STEPS) - 0.5);
    let at = |angle| Point3 { x: uav.x + reach_m * cos(angle), y: uav.y + reach_m * sin(angle), z: 0.0 };
    let apex = Point3 { x: uav.x, y: uav.y, z: uav.z };
    closed_line(std::iter::once(apex).chain((0..=VIEW_STEPS).map(edge).map(at)).collect(), colour)
}

/// Sine and cosine of `points` evenly spaced directions.
fn around(points: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..points).map(move |point| TAU * f64::from(point) / f64::from(points)).map(|angle| (sin(angle), cos(angle)))
}

fn closed_line(points: Vec<Point3>, colour: Color) -> LinePrimitive {
    LinePrimitive {
        r#type: Type::LineLoop.into(),
        pose: Some(pose(vector(0.0, 0.0, 0.0), 0.0)),
        thickness: 2.0,
        scale_invariant: true,
        points,
        color: Some(colour),
        ..LinePrimitive::default()
    }
}
