//! Charts of studies: curves with quantile bands over any quantity, in the style of the figures of a run.

use super::chart::{Area, Chart, Drawn, REFERENCE, fitted, page};
use super::curve::{Point, range, usable};
use super::figure::{Figure, FigureError};
use super::style::{PX, ink};
use plotters::prelude::*;
use std::convert::Infallible;
use std::iter::empty;

/// Colours of Okabe and Ito, followed by darker ones; distinguishable for colour-blind readers.
const COLOURS: [RGBColor; 12] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(73, 0, 146),
    RGBColor(146, 73, 0),
    RGBColor(0, 109, 109),
    RGBColor(182, 109, 255),
    RGBColor(136, 17, 51),
    RGBColor(153, 136, 102),
    RGBColor(51, 68, 102),
    RGBColor(68, 119, 68),
];
/// Opacity of a band, so that curves remain visible.
const BAND: f64 = 0.22;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Legend entry, at most about 24 characters.
    pub label: String,
    /// Index of its colour, the same in every plot.
    pub colour: usize,
    /// Dashed instead of solid.
    pub dashed: bool,
    /// Points `(x, y)`; a point that is not finite breaks the curve.
    pub points: Vec<(f64, f64)>,
}

/// The area between two curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Legend entry.
    pub label: String,
    /// Index of its colour.
    pub colour: usize,
    /// Points `(x, lowest, highest)`; a point that is not finite breaks the band.
    pub points: Vec<(f64, f64, f64)>,
}

/// A plot of a page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plot {
    /// Titles of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Bands, drawn below the curves.
    pub bands: Vec<Band>,
    /// Curves.
    pub lines: Vec<Line>,
    /// Limits and desired values, drawn as dashed grey lines.
    pub levels: Vec<(f64, String)>,
    /// Values that the vertical axis must include.
    pub shown: Vec<f64>,
    /// Larger values are drawn at this value.
    pub cut: Option<f64>,
}

/// Draws a figure of plots below one another.
pub fn study(
    name: &'static str,
    heading: &str,
    caption: &str,
    plots: &[Plot],
) -> Result<Figure, FigureError<Infallible>> {
    let each = if plots.len() > 2 { 240 } else { 290 };
    let draw = |area: &Area| {
        let areas = area.split_evenly((plots.len().max(1), 1));
        areas.iter().zip(plots).try_for_each(|(area, plot)| plot.draw(area))
    };
    match page(heading, caption, "", 80 + each * plots.len() as u32, draw) {
        Ok(svg) => Ok(Figure { name, svg }),
        Err(reason) => Err(FigureError::Draw { figure: name, reason: reason.to_string() }),
    }
}

impl Plot {
    fn draw(&self, area: &Area) -> Drawn {
        // Not `min`, which would turn NaN into the limit.
        let cut = |value: f64| self.cut.filter(|cut| value > *cut).unwrap_or(value);
        let points = self.lines.iter().flat_map(|line| &line.points).copied();
        let edges = || self.bands.iter().flat_map(|band| &band.points);
        let across = points.clone().map(|at| at.0).chain(edges().map(|at| at.0));
        let upward = points.map(|at| at.1).chain(edges().flat_map(|at| [at.1, at.2])).map(cut);
        let upward = upward.chain(self.levels.iter().map(|level| level.0)).chain(self.shown.iter().copied());
        let (across, upward) = (range(across, 1e-6, 0.0), range(upward, 1e-6, 0.04));
        let mut chart = Chart::new(area, across.clone(), upward, [&self.axes[0], &self.axes[1]])?;
        for band in &self.bands {
            let points: Vec<_> = band.points.iter().map(|&(x, low, high)| (x, cut(low), cut(high))).collect();
            let colour = colour(band.colour).mix(BAND).filled();
            for run in points.split(|at| usable(at.1).is_none() || usable(at.2).is_none()) {
                let (low, high) = (run.iter().map(|at| (at.0, at.1)), run.iter().rev().map(|at| (at.0, at.2)));
                let outline: Vec<Point> = low.chain(high).collect();
                chart.plot.draw_series((!outline.is_empty()).then(|| Polygon::new(outline, colour)))?;
            }
            let sample =
                move |(x, y)| Rectangle::new([(x, y - 5 * PX as i32), (x + 20 * PX as i32, y + 5 * PX as i32)], colour);
            let entry = chart.legend.draw_series(empty::<Rectangle<_>>())?;
            entry.label(fitted(band.label.clone())).legend(sample);
        }
        for &(value, ref label) in &self.levels {
            let runs = vec![vec![(across.start, value), (across.end, value)]];
            let level = super::chart::Line::new(runs, ink(REFERENCE, 1.0));
            chart.line(super::chart::Line { dashed: true, label: Some(label.clone()), ..level })?;
        }
        for line in &self.lines {
            let points: Vec<Point> = line.points.iter().map(|&(x, y)| (x, cut(y))).collect();
            let runs = points.split(|at| usable(at.0).is_none() || usable(at.1).is_none());
            let runs = runs.filter(|run| !run.is_empty()).map(<[Point]>::to_vec).collect();
            let (ink, label) = (ink(colour(line.colour), 1.75), Some(line.label.clone()));
            chart.line(super::chart::Line { dashed: line.dashed, label, ..super::chart::Line::new(runs, ink) })?;
        }
        chart.finish()
    }
}

fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(at: f64) -> Plot {
        let y = [1.0, 2.0, at, 2.0, 1.0];
        let points = (0..).zip(y).map(|(x, y)| (f64::from(x), y)).collect();
        let line = Line { label: "a & b".to_owned(), colour: 9, dashed: true, points };
        let points = (0..).zip(y).map(|(x, y)| (f64::from(x), 0.5 * y, y)).collect();
        let band = Band { label: "5 to 95 %".to_owned(), colour: 1, points };
        Plot {
            axes: ["x".to_owned(), "y".to_owned()],
            bands: vec![band],
            lines: vec![line],
            levels: vec![(1.5, "limit".to_owned())],
            shown: vec![0.0],
            cut: Some(100.0),
        }
    }

    #[test]
    fn studies_with_extreme_or_no_values_are_drawn_reproducibly() {
        for at in [1.0, f64::NAN, f64::INFINITY, 1e300, -1e12] {
            let draw = || study("made-up", "heading", "caption <1>", &[plot(at), Plot::default()]).unwrap().svg;
            let svg = draw();
            assert!(svg.starts_with("<svg width=\"900\"") && svg.trim_end().ends_with("</svg>"), "{at}");
            assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.contains("caption &lt;1&gt;"), "{at}");
            assert_eq!(svg, draw());
        }
        assert!(study("empty", "", "", &[]).is_ok());
    }

    #[test]
    fn missing_values_break_curve_and_band() {
        let count = |at: f64, what: &str| study("made-up", "", "", &[plot(at)]).unwrap().svg.matches(what).count();
        assert_eq!(count(f64::NAN, "<polygon"), count(1.0, "<polygon") + 1);
    }
}
