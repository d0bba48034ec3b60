//! Figure `trajectories`: the map of the run, with UAVs, targets, groups and their orbits.

use super::Setup;
use super::chart::{Chart, Drawn, Line, MOST_NAMED, PX, ink, of_uavs, page, range, share};
use super::curve::{Point, usable};
use super::gather::Run;
use plotters::prelude::*;
use standoff::math::{TAU, cos, sin};
use std::collections::BTreeSet;
use std::iter::{empty, once};

/// More targets than this are drawn thin.
const MANY: usize = 40;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<String> {
    let field_of_view = usable(setup.field_of_view_rad).unwrap_or(0.0).clamp(0.0, TAU);
    let view = |(apex, boresight, reach)| once(apex).chain(arc(apex, reach, boresight, field_of_view)).collect();
    let views = run.uavs.iter().filter_map(|(&id, uav)| Some((run.uav_colour(id), view(uav.view?))));
    let views: Vec<(RGBColor, Vec<Point>)> = views.collect();
    let uavs = of_uavs(run, 1.25, true, |uav| &uav.path);
    let end = |line: &Line| Some((line.ink, *line.runs.last()?.last()?));
    let ends: Vec<_> = uavs.iter().filter_map(end).collect();
    let mut lines = ground(run);
    lines.extend(uavs);

    let shown = lines.iter().flat_map(|line| line.runs.iter().flatten()).chain(views.iter().flat_map(|view| &view.1));
    let (east, north): (Vec<f64>, Vec<f64>) = shown.copied().unzip();
    let (east, north) = (range(east, 10.0, 0.03), range(north, 10.0, 0.03));
    let (wide, high) = (east.end - east.start, north.end - north.start);
    let height = 110.0 + 636.0 * (high / wide).clamp(0.5, 1.1);
    page("Trajectories of UAVs and targets", &setup.title, height as u32, |area| {
        let (across, up) = Chart::plot_size(area);
        // As many metres to the px northwards as eastwards.
        let scale = (wide / across).max(high / up);
        let east = range([east.start, east.end], scale * across, 0.0);
        let north = range([north.start, north.end], scale * up, 0.0);
        let mut chart = Chart::new(area, east, north, ["East (m)", "North (m)"])?;
        let faint = |(colour, corners): &(RGBColor, Vec<Point>)| Polygon::new(corners.clone(), colour.mix(0.15));
        chart.plot.draw_series(views.iter().map(faint))?;
        lines.into_iter().try_for_each(|line| chart.line(line))?;
        chart.plot.draw_series(ends.iter().map(|&(ink, end)| Circle::new(end, 4 * PX, ink)))?;
        if let Some(&(ink, _)) = ends.first() {
            let entry = chart.legend.draw_series(empty::<PathElement<_>>())?.label("end, with field of view");
            entry.legend(move |(x, y)| Circle::new((x + 10 * PX as i32, y), 4 * PX, ink));
        }
        chart.finish()
    })
}

/// What lies below the UAVs' paths, from bottom to top; the first of a kind is in the legend.
fn ground(run: &Run) -> Vec<Line> {
    let targets: BTreeSet<u32> = run.truth.keys().copied().chain(run.tracks.keys().map(|key| key.0)).collect();
    let (thick, thin) = if targets.len() > MANY { (0.5, 0.5) } else { (3.0, 1.25) };
    let points = share(run.truth.len() + run.tracks.len() + run.groups.len());
    let mut named = BTreeSet::new();
    let mut line = |runs, ink, label: String| {
        let label = (named.len() < MOST_NAMED && named.insert(label.clone())).then_some(label);
        Line { runs, ink, dashed: false, label }
    };
    let mut lines = Vec::new();
    for curve in run.truth.values() {
        lines.push(line(curve.runs(points), ink(RGBColor(200, 200, 200), thick), "true paths of targets".to_owned()));
    }
    for ((_, group), curve) in &run.tracks {
        let colour = group.map_or(RGBColor(130, 130, 130), |id| run.group_colour(id));
        let label = group.map_or("targets in no group".to_owned(), |id| format!("targets of group {id}"));
        lines.push(line(curve.runs(points), ink(colour, thin), label));
    }
    for (&id, group) in &run.groups {
        let centre = group.centre.runs(points);
        let (centres, radii) = (centre.concat(), group.standoff.runs(points).concat());
        let ends = [centres.first().zip(radii.first()), centres.last().zip(radii.last())];
        let circle = |(&at, radius): (_, &Point)| arc(at, radius.1, 0.0, TAU).collect();
        let orbits = ends.into_iter().flatten().map(circle).collect();
        lines.push(line(orbits, ink(run.group_colour(id), 0.75), "first and last orbit".to_owned()));
        lines.push(line(centre, ink(BLACK, 1.0), "centre of a group".to_owned()));
    }
    lines
}

/// Points about a centre, from either side of the middle direction.
fn arc((x, y): Point, radius: f64, middle: f64, angle: f64) -> impl Iterator<Item = Point> {
    let direction = move |step| middle + angle * (f64::from(step) / 120.0 - 0.5);
    (0..=120).map(direction).map(move |angle| (x + radius * cos(angle), y + radius * sin(angle)))
}
