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

/// How wide a text is at most in a font of a size, px: letters of DejaVu Sans and Verdana, which are wide ones.
pub(super) fn width_px(text: &str, px: f64) -> f64 {
    let em = |letter: char| match letter {
        'i' | 'j' | 'l' | ' ' | '.' | ',' | ':' | ';' | '|' | '\'' => 0.36,
        'f' | 'r' | 't' | 'I' | '(' | ')' | '-' | '/' => 0.46,
        'a'..='z' | '0'..='9' if !matches!(letter, 'm' | 'w') => 0.645,
        'A'..='Z' if !matches!(letter, 'M' | 'W') => 0.79,
        _ => 1.0,
    };
    px * text.chars().map(em).sum::<f64>()
}
