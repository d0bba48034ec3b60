//! Line styles and fonts of all figures.

use plotters::prelude::*;

/// Drawing units per px. plotters rounds positions to whole units; with one unit per px, curves would look jagged.
pub(super) const PX: u32 = 4;

/// Makes a line style; `width` in px.
pub(super) fn ink(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * f64::from(PX)) as u32).filled()
}

/// Makes a font; size in px.
pub(super) fn font(px: f64) -> TextStyle<'static> {
    // The SVG writer divides sizes by 1.24.
    ("sans-serif", px * 1.24 * f64::from(PX)).into_font().color(&RGBColor(34, 34, 34))
}

/// Upper bound of the width of a text at a font size, px. It uses the letter widths of DejaVu Sans and Verdana, which
/// are wide fonts.
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
