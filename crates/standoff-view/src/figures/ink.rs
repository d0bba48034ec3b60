//! Lines and letters of every figure.

use plotters::prelude::*;

/// Units of the drawing in a px: plotters places shapes on whole units, and curves on whole px look jagged.
pub(super) const PX: u32 = 4;

/// A line style of a width in px.
pub(super) fn ink(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * f64::from(PX)) as u32).filled()
}

/// A font of a size in px.
pub(super) fn font(px: f64) -> TextStyle<'static> {
    // The SVG writer divides sizes by 1.24.
    ("sans-serif", px * 1.24 * f64::from(PX)).into_font().color(&RGBColor(34, 34, 34))
}
