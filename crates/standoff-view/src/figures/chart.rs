//! Charts in one style: the page, its axes, lines with their legend, and panels over time.

use super::curve::{Curve, MOST_POINTS, Point, usable};
use super::gather::{Run, Uav};
use plotters::coord::{Shift, types::RangedCoordf64};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use std::error::Error;
use std::ops::Range;

/// Units of the drawing in a px: plotters places shapes on whole units, and curves on whole px look jagged.
pub(super) const PX: u32 = 4;
const WIDTH: u32 = 900;
/// Room for the upward axis, the time axis and the legend, px.
const LEFT: u32 = 68;
const BELOW: u32 = 44;
const LEGEND: u32 = 184;
/// Points of all curves of a chart together.
const POINTS: usize = 40_000;
/// Most UAVs or groups that a legend names.
pub(super) const MOST_NAMED: usize = 10;

/// For UAVs by rank: colours of Okabe and Ito, then darker ones, which colour-blind readers can tell apart.
pub(super) const UAVS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(73, 0, 146),
    RGBColor(146, 73, 0),
    RGBColor(0, 109, 109),
    RGBColor(182, 109, 255),
];
/// For groups by rank: none of the UAVs' colours.
pub(super) const GROUPS: [RGBColor; 3] = [RGBColor(0, 158, 115), RGBColor(230, 159, 0), RGBColor(86, 180, 233)];
/// Limits and values wanted.
pub(super) const REFERENCE: RGBColor = RGBColor(70, 70, 70);

/// Outcome of drawing.
pub(super) type Drawn<T = ()> = Result<T, Box<dyn Error>>;
/// A part of the page.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plot<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A line of a chart: unbroken stretches in one style, with an entry in the legend if it has a label.
pub(super) struct Line {
    pub(super) runs: Vec<Vec<Point>>,
    pub(super) ink: ShapeStyle,
    pub(super) dashed: bool,
    pub(super) label: Option<String>,
}

/// A line style of a width in px.
pub(super) fn ink(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * f64::from(PX)) as u32).filled()
}

fn font(px: f64) -> TextStyle<'static> {
    // The SVG writer divides sizes by 1.24.
    ("sans-serif", px * 1.24 * f64::from(PX)).into_font().color(&RGBColor(34, 34, 34))
}

/// A range that takes in all values with a share of room, and has some width whatever they are.
pub(super) fn range(values: impl IntoIterator<Item = f64>, least: f64, room: f64) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    values.into_iter().filter_map(usable).for_each(|value| (low, high) = (low.min(value), high.max(value)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    // At a billion metres a metre is not enough to tell ticks apart.
    let width = (high - low).max(least).max(1e-6 * low.abs().max(high.abs()));
    let (middle, half) = ((low + high) / 2.0, (0.5 + room) * width);
    middle - half..middle + half
}

/// Most points that each of so many curves may have.
pub(super) fn share(curves: usize) -> usize {
    (POINTS / curves.max(1)).clamp(40, MOST_POINTS)
}

/// A curve of each UAV in the UAV's colour; the first few are named, if any is.
pub(super) fn of_uavs(run: &Run, width: f64, named: bool, of: fn(&Uav) -> &Curve) -> Vec<Line> {
    let line = |(rank, (&id, uav))| Line {
        runs: of(uav).runs(share(2 * run.uavs.len())),
        ink: ink(run.uav_colour(id), width),
        dashed: false,
        label: (named && rank < MOST_NAMED).then(|| format!("UAV {id}")),
    };
    run.uavs.iter().enumerate().map(line).collect()
}

/// A dashed line at one value over the time of the run.
pub(super) fn level(run: &Run, value: f64, label: Option<&str>) -> Line {
    let time = run.time();
    let runs = usable(value).map(|value| vec![(time.start, value), (time.end, value)]).into_iter().collect();
    Line { runs, ink: ink(REFERENCE, 1.0), dashed: true, label: label.map(str::to_owned) }
}

/// A page 900 px wide with heading and caption, on which `draw` draws.
pub(super) fn page(heading: &str, title: &str, height: u32, draw: impl FnOnce(&Area) -> Drawn) -> Drawn<String> {
    let mut svg = String::new();
    let size = (WIDTH * PX, height * PX);
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let odd = |c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}');
        let title: String = title.chars().take(120).map(|c| if odd(c) { ' ' } else { c }).collect();
        let inner = root.margin(6 * PX, 4 * PX, 8 * PX, 4 * PX).titled(heading, font(15.0))?;
        draw(&inner.titled(&title, font(11.0).color(&REFERENCE))?)?;
        root.present()?;
    }
    let drawn = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    let shown = format!("width=\"{WIDTH}\" height=\"{height}\" stroke-linejoin=\"round\"");
    Ok(svg.replacen(&drawn, &shown, 1))
}

/// A plot with grid and axes, and its legend to the right, where it covers no data.
pub(super) struct Chart<'a> {
    pub(super) plot: Plot<'a>,
    pub(super) legend: Plot<'a>,
}

impl<'a> Chart<'a> {
    /// Width and height that the plot on a part of the page will have, units.
    pub(super) fn plot_size(area: &Area) -> (f64, f64) {
        let (width, height) = area.dim_in_pixel();
        (f64::from(width) - f64::from((LEFT + LEGEND) * PX), f64::from(height) - f64::from((8 + BELOW) * PX))
    }

    /// An empty chart.
    pub(super) fn new(area: &Area<'a>, x: Range<f64>, y: Range<f64>, titles: [&str; 2]) -> Drawn<Self> {
        let (left, right) = area.split_horizontally(area.dim_in_pixel().0 - LEGEND * PX);
        let legend = ChartBuilder::on(&right).margin_top(8 * PX).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
        let mut plot = ChartBuilder::on(&left)
            .margin_top(8 * PX)
            .set_label_area_size(LabelAreaPosition::Left, LEFT * PX)
            .set_label_area_size(LabelAreaPosition::Bottom, BELOW * PX)
            .build_cartesian_2d(x, y)?;
        let (width, height) = Self::plot_size(area);
        // Ticks are sums of steps: without rounding they would read 0.30000000000000004.
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

    /// Draws a line; a lone point becomes a dot.
    pub(super) fn line(&mut self, Line { runs, ink, dashed, label }: Line) -> Drawn {
        for run in runs {
            if dashed {
                self.plot.draw_series(DashedLineSeries::new(run, 6 * PX, 4 * PX, ink))?;
            } else {
                let dot = if run.len() == 1 { ink.stroke_width } else { 0 };
                self.plot.draw_series(LineSeries::new(run, ink).point_size(dot))?;
            }
        }
        let Some(label) = label else { return Ok(()) };
        let (on, off) = if dashed { (5, 3) } else { (20, 0) };
        let sample = move |(x, y)| DashedPathElement::new([(x, y), (x + 20 * PX as i32, y)], on * PX, off * PX, ink);
        self.legend.draw_series(std::iter::empty::<PathElement<_>>())?.label(label).legend(sample);
        Ok(())
    }

    /// Draws the legend.
    pub(super) fn finish(mut self) -> Drawn {
        let mut labels = self.legend.configure_series_labels();
        labels.position(SeriesLabelPosition::Coordinate(4 * PX as i32, 0)).margin(4 * PX);
        Ok(labels.legend_area_size(26 * PX).label_font(font(11.5)).draw()?)
    }
}

/// A page of panels over time: title of the upward axis, a value that the axis must show, and lines.
pub(super) fn over_time<const N: usize>(
    run: &Run,
    heading: &str,
    title: &str,
    panels: [(&str, Option<f64>, Vec<Line>); N],
) -> Drawn<String> {
    page(heading, title, 80 + 290 * N as u32, |area| {
        for (area, (axis, shown, lines)) in area.split_evenly((N, 1)).iter().zip(panels) {
            let values = lines.iter().flat_map(|line| line.runs.iter().flatten()).map(|at| at.1);
            let values = range(values.chain(shown), 1.0, 0.04);
            let mut chart = Chart::new(area, run.time(), values, ["Time (s)", axis])?;
            lines.into_iter().try_for_each(|line| chart.line(line))?;
            chart.finish()?;
        }
        Ok(())
    })
}
