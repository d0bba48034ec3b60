//! Charts in a common style: the page, axes, lines with a legend, and panels over time.

use super::collect::{Group, Run};
use super::curve::{Curve, MAX_POINTS, Point, range, usable};
use super::style::{PX, font, ink, width_px};
use super::symbol::{Mark, Symbol};
use crate::colours::UAVS;
use plotters::coord::{Shift, types::RangedCoordf64};
use plotters::prelude::*;
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::error::Error;
use std::iter::empty;
use std::ops::Range;

/// Width of the page, px.
const WIDTH: u32 = 900;
/// Width of the area for the vertical axis, px.
const Y_AXIS_WIDTH: u32 = 68;
/// Height of the area for the horizontal axis, px.
const X_AXIS_HEIGHT: u32 = 44;
/// Width of the legend, px.
const LEGEND: u32 = 184;
/// Part of the legend's width that is left and right of the text, px.
const LEGEND_MARGIN_PX: f64 = 34.0;
/// Font size of the legend, px.
const LEGEND_FONT_PX: f64 = 11.5;
/// Height of heading, caption and bottom margin, px.
const HEADER_HEIGHT: u32 = 54;
/// Height of a low panel, px.
const ROW_HEIGHT: u32 = 128;
/// Maximum number of points of all curves in a chart.
const POINTS_MAX: usize = 40_000;
/// Maximum number of UAVs or groups named in a legend.
pub(super) const NAMED_MAX: usize = UAVS.len();
/// Maximum number of groups with their own panel.
pub(super) const PANELS_MAX: usize = 4;
/// Opacity that marks dashed lines, because the SVG writer does not support dashes.
const DASHED: f64 = 0.999;
/// SVG attribute that replaces the opacity [`DASHED`].
const DASHES: &str = "stroke-dasharray=\"24 16\"";

/// Colour of limits and desired values.
pub(super) const REFERENCE: RGBColor = RGBColor(70, 70, 70);
/// Colour of vertical lines at events.
const MARKED: RGBColor = RGBColor(150, 150, 150);

/// Result of drawing.
pub(super) type Drawn<T = ()> = Result<T, Box<dyn Error>>;
/// An area of the page.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plot<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A line of a chart: one or more unbroken segments in one style. With a label, it has an entry in the legend.
pub(super) struct Line {
    pub(super) runs: Vec<Vec<Point>>,
    pub(super) ink: ShapeStyle,
    pub(super) dashed: bool,
    /// Colour of dashes drawn over the line, for a quantity between two UAVs or groups.
    pub(super) dashes: Option<RGBColor>,
    pub(super) label: Option<String>,
}

impl Line {
    /// Makes a line in one colour without an entry in the legend.
    pub(super) fn new(runs: Vec<Vec<Point>>, ink: ShapeStyle) -> Self {
        Self { runs, ink, dashed: false, dashes: None, label: None }
    }
}

/// Maximum number of points of each of `curves` curves.
pub(super) fn share(curves: usize) -> usize {
    (POINTS_MAX / curves.max(1)).clamp(16, MAX_POINTS)
}

/// Makes lines of UAVs in the colours of the UAVs; the first few are named in the legend.
pub(super) fn of_uavs<'a>(run: &Run, width: f64, curves: impl Iterator<Item = (u32, &'a Curve)>) -> Vec<Line> {
    let line = |(rank, (id, curve)): (usize, (u32, &Curve))| Line {
        label: (rank < NAMED_MAX).then(|| format!("UAV {id}")),
        ..Line::new(curve.runs(share(2 * run.uavs.len())), ink(run.uav_colour(id), width))
    };
    and_more(curves.enumerate().map(line).collect(), "UAVs")
}

/// Limits the named lines to [`NAMED_MAX`] and adds a legend entry with the number of the others.
fn and_more(mut lines: Vec<Line>, what: &str) -> Vec<Line> {
    let left = lines.len().saturating_sub(NAMED_MAX);
    if left > 0 {
        let label = Some(format!("and {left} more {what}"));
        lines.push(Line { label, ..Line::new(Vec::new(), ink(WHITE, 1.0)) });
    }
    lines
}

/// Makes a line of each group in the colours of the groups; the first few are named in the legend.
pub(super) fn of_groups(run: &Run, width: f64, curve: fn(&Group) -> &Curve) -> Vec<Line> {
    let line = |(rank, (&id, group)): (usize, (&u32, &Group))| Line {
        label: (rank < NAMED_MAX).then(|| format!("group {id}")),
        ..Line::new(curve(group).runs(share(run.groups.len())), ink(run.group_colour(id), width))
    };
    and_more(run.groups.iter().enumerate().map(line).collect(), "groups")
}

/// Makes a page 900 px wide with a heading and a caption (`title` followed by `note`); `draw` draws its contents.
pub(super) fn page(
    heading: &str,
    title: &str,
    note: &str,
    height: u32,
    draw: impl FnOnce(&Area) -> Drawn,
) -> Drawn<String> {
    let mut svg = String::new();
    let size = (WIDTH * PX, height * PX);
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let odd = |c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}');
        let most = 120_usize.saturating_sub(note.chars().count());
        let title: String = title.chars().take(most).map(|c| if odd(c) { ' ' } else { c }).collect();
        let inner = root.margin(6 * PX, 4 * PX, 8 * PX, 4 * PX).titled(heading, font(15.0))?;
        draw(&inner.titled(&(title + note), font(11.0).color(&REFERENCE))?)?;
        root.present()?;
    }
    let drawn = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    let shown = format!("width=\"{WIDTH}\" height=\"{height}\" stroke-linejoin=\"round\"");
    let svg = svg.replacen(&drawn, &shown, 1).replace(" opacity=\"1\"", "");
    Ok(svg.replace(&format!("opacity=\"{DASHED}\""), DASHES))
}

/// A plot with grid and axes, and a legend to its right.
pub(super) struct Chart<'a> {
    pub(super) plot: Plot<'a>,
    pub(super) legend: Plot<'a>,
}

impl<'a> Chart<'a> {
    /// Width and height of the plot in an area of the page, drawing units.
    pub(super) fn plot_size(area: &Area) -> (f64, f64) {
        let (width, height) = area.dim_in_pixel();
        (
            f64::from(width) - f64::from((Y_AXIS_WIDTH + LEGEND) * PX),
            f64::from(height) - f64::from((8 + X_AXIS_HEIGHT) * PX),
        )
    }

    /// Makes an empty chart.
    pub(super) fn new(area: &Area<'a>, x: Range<f64>, y: Range<f64>, titles: [&str; 2]) -> Drawn<Self> {
        let (left, right) = area.split_horizontally(area.dim_in_pixel().0 - LEGEND * PX);
        let legend = ChartBuilder::on(&right).margin_top(8 * PX).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
        let mut plot = ChartBuilder::on(&left)
            .margin_top(8 * PX)
            .set_label_area_size(LabelAreaPosition::Left, Y_AXIS_WIDTH * PX)
            .set_label_area_size(LabelAreaPosition::Bottom, X_AXIS_HEIGHT * PX)
            .build_cartesian_2d(x, y)?;
        let (width, height) = Self::plot_size(area);
        // Ticks are sums of steps: without rounding, a label could be 0.30000000000000004.
        let tick = |value: &f64| ((value * 1e3).round() / 1e3 + 0.0).to_string();
        plot.configure_mesh()
            .x_desc(titles[0])
            .y_desc(titles[1])
            .x_labels((width / f64::from(56 * PX)) as usize)
            .y_labels((height / f64::from(40 * PX)) as usize)
            .max_light_lines(0)
            .bold_line_style(ink(RGBColor(226, 226, 226), 0.75))
            .axis_style(ink(REFERENCE, 1.0))
            .set_all_tick_mark_size(4 * PX)
            .label_style(font(11.5))
            .axis_desc_style(font(12.5))
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .draw()?;
        Ok(Self { plot, legend })
    }

    /// Makes an empty map that shows these ranges, m, with the same scale on both axes.
    pub(super) fn map(area: &Area<'a>, east: &Range<f64>, north: &Range<f64>) -> Drawn<Self> {
        let (across, up) = Self::plot_size(area);
        let scale = ((east.end - east.start) / across).max((north.end - north.start) / up);
        let east = range([east.start, east.end], scale * across, 0.0);
        let north = range([north.start, north.end], scale * up, 0.0);
        Self::new(area, east, north, ["East (m)", "North (m)"])
    }

    /// Draws a line; a single point is drawn as a dot.
    pub(super) fn line(&mut self, Line { runs, ink, dashed, dashes, label }: Line) -> Drawn {
        let ink = ShapeStyle { color: if dashed { ink.color.mix(DASHED) } else { ink.color }, ..ink };
        let over = dashes.map(|colour| ShapeStyle { color: colour.mix(DASHED), ..ink });
        for run in runs {
            let dot = if run.len() == 1 { ink.stroke_width } else { 0 };
            if let Some(over) = over {
                self.plot.draw_series(LineSeries::new(run.iter().copied(), ink).point_size(dot))?;
                self.plot.draw_series(LineSeries::new(run, over))?;
            } else {
                self.plot.draw_series(LineSeries::new(run, ink).point_size(dot))?;
            }
        }
        let Some(label) = label else { return Ok(()) };
        let sample = |(x, y), ink| PathElement::new([(x, y), (x + 20 * PX as i32, y)], ink);
        let entry = self.legend.draw_series(empty::<PathElement<_>>())?.label(fitted(label));
        match over {
            None => entry.legend(move |place| sample(place, ink)),
            Some(over) => {
                entry.legend(move |place| EmptyElement::at(place) + sample((0, 0), ink) + sample((0, 0), over))
            }
        };
        Ok(())
    }

    /// Draws a symbol at several positions.
    pub(super) fn symbols(&mut self, symbol: Symbol, places: &[Point], label: Option<String>) -> Drawn {
        self.plot.draw_series(places.iter().map(|&place| symbol.at(place)))?;
        self.plot.draw_series(places.iter().filter_map(|&place| symbol.word_at(place)))?;
        let Some(label) = label else { return Ok(()) };
        let sample = move |(x, y)| symbol.at((x + 10 * PX as i32, y));
        self.legend.draw_series(empty::<PathElement<_>>())?.label(fitted(label)).legend(sample);
        Ok(())
    }

    /// Draws the legend.
    pub(super) fn finish(mut self) -> Drawn {
        let mut labels = self.legend.configure_series_labels();
        labels.position(SeriesLabelPosition::Coordinate(4 * PX as i32, 0)).margin(4 * PX);
        Ok(labels.legend_area_size(26 * PX).label_font(font(LEGEND_FONT_PX)).draw()?)
    }
}

/// Shortens a legend entry to the available width; an ellipsis replaces the rest.
pub(super) fn fitted(mut label: String) -> String {
    let room_px = f64::from(LEGEND) - LEGEND_MARGIN_PX;
    if width_px(&label, LEGEND_FONT_PX) > room_px {
        while width_px(&label, LEGEND_FONT_PX) + width_px("…", LEGEND_FONT_PX) > room_px && label.pop().is_some() {}
        label.push('…');
    }
    label
}

/// Contents of a panel over time.
#[derive(Default)]
pub(super) struct Panel {
    /// Title of the vertical axis.
    pub(super) axis: String,
    /// A value that the vertical axis must include.
    pub(super) shown: Option<f64>,
    pub(super) lines: Vec<Line>,
    /// Limits and desired values, drawn as dashed horizontal lines.
    pub(super) levels: Vec<(f64, Option<String>)>,
    /// Times of events, s.
    pub(super) marks: Vec<(Mark, Vec<f64>)>,
    /// True for a low panel, one of many.
    pub(super) is_row: bool,
}

impl Panel {
    fn is_empty(&self) -> bool {
        self.lines.iter().all(|line| line.runs.is_empty())
    }

    fn draw(self, run: &Run, area: &Area, named: &mut BTreeSet<String>) -> Drawn {
        let mut new = |label: Option<String>| label.filter(|label| named.insert(label.clone()));
        let time = run.time();
        let levels: Vec<_> = self.levels.into_iter().filter(|level| usable(level.0).is_some()).collect();
        let values = self.lines.iter().flat_map(|line| line.runs.iter().flatten()).map(|at| at.1);
        let values = values.chain(levels.iter().map(|level| level.0)).chain(self.shown);
        let values = range(values, 1.0, 0.04);
        let (bottom, top) = (values.start, values.end);
        let mut chart = Chart::new(area, time.clone(), values, ["Time (s)", &self.axis])?;
        let upright = |&at: &f64| vec![(at, bottom), (at, top)];
        for (_, times) in &self.marks {
            let runs = times.iter().map(upright).collect();
            chart.line(Line::new(runs, ink(MARKED, 0.75)))?;
        }
        for line in self.lines {
            chart.line(Line { label: new(line.label), ..line })?;
        }
        for (value, label) in levels {
            let runs = vec![vec![(time.start, value), (time.end, value)]];
            chart.line(Line { dashed: true, label: new(label), ..Line::new(runs, ink(REFERENCE, 1.0)) })?;
        }
        for (mark, times) in self.marks {
            let places: Vec<Point> = times.into_iter().map(|at| (at, top)).collect();
            chart.symbols(mark.symbol(), &places, new(Some(mark.label())))?;
        }
        chart.finish()
    }
}

/// Makes a page with one panel over time per group with data, followed by the panel `last`.
pub(super) fn per_group(
    run: &Run,
    heading: &str,
    title: &str,
    note: &str,
    panel: impl Fn(u32, &Group) -> Panel,
    last: Option<Panel>,
) -> Drawn<Option<String>> {
    let panels = run.groups.iter().map(|(&id, group)| (id, group.steps, panel(id, group)));
    let mut panels: Vec<_> = panels.filter(|panel| !panel.2.is_empty()).collect();
    let few = format!(" (the {PANELS_MAX} longest-lived of {} groups)", run.created);
    let note = format!("{note}{}", if panels.len() > PANELS_MAX { &few } else { "" });
    panels.sort_by_key(|panel| Reverse(panel.1));
    panels.truncate(PANELS_MAX);
    panels.sort_by_key(|panel| panel.0);
    stacked(run, heading, title, &note, panels.into_iter().map(|panel| panel.2).chain(last).collect())
}

/// Makes a page of panels below one another, without empty panels; `None` if all are empty. Each label has one legend
/// entry.
pub(super) fn stacked(
    run: &Run,
    heading: &str,
    title: &str,
    note: &str,
    mut panels: Vec<Panel>,
) -> Drawn<Option<String>> {
    panels.retain(|panel| !panel.is_empty());
    if panels.is_empty() {
        return Ok(None);
    }
    let full = if panels.iter().filter(|panel| !panel.is_row).count() > 2 { 240 } else { 290 };
    let heights: Vec<u32> = panels.iter().map(|panel| if panel.is_row { ROW_HEIGHT } else { full }).collect();
    let (height, mut named) = (heights.iter().sum::<u32>(), BTreeSet::new());
    let draw = |area: &Area| {
        let mut rest = area.clone();
        for (panel, height) in panels.into_iter().zip(heights) {
            let (this, below) = rest.split_vertically(height * PX);
            panel.draw(run, &this, &mut named)?;
            rest = below;
        }
        Ok(())
    };
    page(heading, title, note, HEADER_HEIGHT + height, draw).map(Some)
}
