//! Figure `trajectories`: map of the run with UAVs, targets, groups and their orbits.

use super::chart::{Area, Chart, Drawn, Line, NAMED_MAX, of_uavs, page, share};
use super::collect::{Group, Run};
use super::curve::{Curve, MAX_POINTS, Point, range, usable};
use super::figure::Setup;
use super::style::{font, ink};
use super::symbol::{Mark, Symbol};
use crate::colours::GROUPS;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use standoff::math::{TAU, cos, hypot, sin};
use standoff::{Zone, ZoneKind};
use std::collections::BTreeSet;
use std::iter::once;

/// Number of targets above which paths of targets are drawn thin.
const MAX_THICK_PATHS: usize = 40;
/// Maximum number of marks of one kind; further ones are thinned out.
const MOST_MARKS: usize = 200;
/// Maximum total length of the UAVs' paths, in widths of the map; older parts are drawn pale.
const MAX_PATH_LENGTH: f64 = 50.0;
/// Maximum number of legend entries; few, because this is the first figure that a new user sees.
const MOST_ENTRIES: usize = 8;
/// Legend entries, the most important first.
const ENTRIES: [&str; 14] = [
    UAV,
    TARGETS,
    KEEP_OUT,
    KEEP_IN,
    BAND,
    "handoff completed",
    "target removed",
    "target lost",
    DWELL,
    ORBIT,
    UNGROUPED,
    TRUTH,
    EARLIER,
    START,
];
const UAV: &str = "UAV, view at the end";
const TARGETS: &str = "targets, group colour";
const KEEP_OUT: &str = "keep-out zone";
const KEEP_IN: &str = "keep-in zone";
const BAND: &str = "band: assigned group";
const DWELL: &str = "handoff to that group";
const ORBIT: &str = "last orbit of a group";
const UNGROUPED: &str = "targets in no group";
const TRUTH: &str = "true paths of targets";
const EARLIER: &str = "earlier paths of UAVs";
const START: &str = "UAV at the start";
/// Colour of zone outlines.
const ZONE: RGBColor = RGBColor(196, 38, 29);
/// Colour of objects in no group.
const NO_GROUP: RGBColor = RGBColor(130, 130, 130);

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let field_of_view = usable(setup.field_of_view_rad).unwrap_or(0.0).clamp(0.0, TAU);
    let view = |(apex, boresight, reach)| once(apex).chain(arc(apex, reach, boresight, field_of_view)).collect();
    let views = run.uavs.iter().filter_map(|(&id, uav)| Some((run.uav_colour(id), view(uav.view?))));
    let views: Vec<(RGBColor, Vec<Point>)> = views.collect();
    let recent = recent(run);
    let mut lines = ground(run, recent);
    let mut uavs = of_uavs(run, 1.25, run.each(|uav| &uav.path));
    uavs.truncate(run.uavs.len());
    for (line, uav) in uavs.iter_mut().zip(run.uavs.values()) {
        // The symbol at the end of the path shows the number of the UAV.
        line.label = None;
        line.runs = uav.path.runs_since(recent, share(2 * run.uavs.len()));
    }
    lines.extend(uavs);
    if lines.iter().all(|line| line.runs.is_empty()) {
        return Ok(None);
    }
    lines.splice(..0, zones(setup));
    let mut symbols: Vec<(Symbol, Vec<Point>, Option<String>)> = Vec::new();
    let marks = run.marks.iter().filter(|mark| matches!(mark.0, Mark::HandoffCompleted | Mark::Removed | Mark::Lost));
    let places = |curve: &Curve| curve.runs(MOST_MARKS).concat();
    symbols.extend(marks.map(|(mark, curve)| (mark.symbol(), places(curve), Some(mark.label()))));
    for (rank, (&id, uav)) in run.uavs.iter().enumerate() {
        let (colour, path) = (run.uav_colour(id), places(&uav.path));
        let [start, end] = [path.first(), path.last()].map(|at| at.copied().into_iter().collect());
        let label = |text: &str| (rank == 0).then(|| text.to_owned());
        symbols.push((Symbol::start(colour), start, label(START)));
        symbols.push((Symbol::end(colour, id.to_string()), end, label(UAV)));
    }
    {
        let labels = lines.iter_mut().map(|line| &mut line.label).chain(symbols.iter_mut().map(|symbol| &mut symbol.2));
        keep_most_needed(labels.collect());
    }
    let names = names(run);

    let shown = lines.iter().flat_map(|line| line.runs.iter().flatten()).chain(views.iter().flat_map(|view| &view.1));
    let (east, north): (Vec<f64>, Vec<f64>) = shown.copied().unzip();
    let (east, north) = (range(east, 10.0, 0.03), range(north, 10.0, 0.03));
    let (wide, high) = (east.end - east.start, north.end - north.start);
    let labels = lines.iter().map(|line| &line.label).chain(symbols.iter().map(|symbol| &symbol.2));
    let named = labels.flatten().count();
    let height = (110.0 + 636.0 * (high / wide).clamp(0.5, 1.1)).max(80.0 + 20.0 * named as f64);
    let draw = |area: &Area| {
        let mut chart = Chart::map(area, &east, &north)?;
        let faint = |(colour, corners): &(RGBColor, Vec<Point>)| Polygon::new(corners.clone(), colour.mix(0.15));
        chart.plot.draw_series(views.iter().map(faint))?;
        lines.into_iter().try_for_each(|line| chart.line(line))?;
        symbols.into_iter().try_for_each(|(symbol, places, label)| chart.symbols(symbol, &places, label))?;
        for (at, pos, name, colour) in names {
            chart.plot.draw_series([Text::new(name, at, font(11.5).pos(pos).color(&colour))])?;
        }
        chart.finish()
    };
    page("Trajectories of UAVs and targets", &setup.title, "", height as u32, draw).map(Some)
}

/// Removes the least important labels if the legend would have too many entries.
fn keep_most_needed(mut labels: Vec<&mut Option<String>>) {
    let rank = |label: &Option<String>| ENTRIES.iter().position(|entry| Some(*entry) == label.as_deref());
    labels.retain(|label| label.is_some());
    labels.sort_by_key(|label| rank(label).unwrap_or(ENTRIES.len()));
    labels.into_iter().skip(MOST_ENTRIES).for_each(|label| *label = None);
}

/// Names and colours of the groups, placed at their last orbits as far as possible from the UAVs.
fn names(run: &Run) -> Vec<(Point, Pos, String, RGBColor)> {
    let last = |curve: &Curve| curve.runs(MAX_POINTS).last().and_then(|run| run.last()).copied();
    let ends: Vec<Point> = run.uavs.values().filter_map(|uav| last(&uav.path)).collect();
    let clear = |at: Point| ends.iter().map(|end| hypot(end.0 - at.0, end.1 - at.1)).fold(f64::INFINITY, f64::min);
    let name = |(&id, group): (&u32, &Group)| {
        let ((x, y), (_, radius)) = last(&group.centre).zip(last(&group.standoff))?;
        let place = |step| {
            let angle = TAU * (0.25 + f64::from(step) / 8.0);
            let (east, north) = (cos(angle), sin(angle));
            let across = if east > 0.5 {
                HPos::Left
            } else if east < -0.5 {
                HPos::Right
            } else {
                HPos::Center
            };
            let up = if north > 0.5 {
                VPos::Bottom
            } else if north < -0.5 {
                VPos::Top
            } else {
                VPos::Center
            };
            ((x + 1.02 * radius * east, y + 1.02 * radius * north), Pos::new(across, up))
        };
        let (at, pos) = (0..8).map(place).max_by(|a, b| clear(a.0).total_cmp(&clear(b.0)))?;
        Some((at, pos, format!("group {id}"), run.group_colour(id)))
    };
    run.groups.iter().take(NAMED_MAX).filter_map(name).collect()
}

/// First time step from which the UAVs' paths are drawn in full colour. In a long run, complete paths would hide the
/// map.
fn recent(run: &Run) -> usize {
    let paths: Vec<Vec<Point>> = run.uavs.values().map(|uav| uav.path.runs(MAX_POINTS).concat()).collect();
    let (east, north): (Vec<f64>, Vec<f64>) = paths.iter().flatten().copied().unzip();
    let [east, north] = [east, north].map(|values| range(values, 10.0, 0.0));
    let length = |path: &Vec<Point>| {
        path.windows(2).map(|ends| hypot(ends[1].0 - ends[0].0, ends[1].1 - ends[0].1)).sum::<f64>()
    };
    let across = (east.end - east.start).max(north.end - north.start);
    let most = MAX_PATH_LENGTH * across / paths.iter().map(length).sum::<f64>();
    (run.frames as f64 * (1.0 - most.min(1.0))) as usize
}

/// Outlines of zones: keep-out zones solid, keep-in zones dashed.
fn zones(setup: &Setup) -> Vec<Line> {
    let line = |zone: &Zone| {
        let corners = zone.vertices.iter().chain(zone.vertices.first());
        let corners: Vec<Point> = corners.map(|at| (at.x_m(), at.y_m())).collect();
        let dashed = zone.kind == ZoneKind::KeepIn;
        let label = if dashed { KEEP_IN } else { KEEP_OUT };
        Line { dashed, label: Some(label.to_owned()), ..Line::new(vec![corners], ink(ZONE, 1.25)) }
    };
    let mut lines: Vec<Line> = setup.rules.geofence.zones().map(line).collect();
    let mut named = BTreeSet::new();
    for line in &mut lines {
        line.label = line.label.take().filter(|label| named.insert(label.clone()));
    }
    lines
}

/// Lines below the UAVs' paths, from bottom to top; the first line of each kind has a legend entry.
fn ground(run: &Run, recent: usize) -> Vec<Line> {
    let many = run.truth.len().max(run.tracks.len()) > MAX_THICK_PATHS;
    let (thick, thin) = if many { (0.5, 0.5) } else { (3.0, 1.25) };
    let pieces: usize = run.tracks.values().map(|path| path.pieces.len()).sum();
    let points = share(run.truth.len() + pieces + run.dwells.len());
    let mut named = BTreeSet::new();
    let mut line = |runs: Vec<Vec<Point>>, ink, dashed, label: &str| {
        let new = !label.is_empty() && !runs.is_empty() && named.insert(label.to_owned());
        Line { dashed, label: new.then(|| label.to_owned()), ..Line::new(runs, ink) }
    };
    let mut lines: Vec<Line> = Vec::new();
    // The legend sample shows the colours of two groups.
    let mut colours = run.groups.keys().map(|&id| run.group_colour(id));
    if let Some(first) = colours.next() {
        let sample = Line::new(Vec::new(), ink(first, 1.5));
        lines.push(Line { dashes: colours.find(|colour| *colour != first), label: Some(TARGETS.to_owned()), ..sample });
    }
    let of_uav = share(2 * run.uavs.len());
    let pale = |colour: RGBColor, share, width| ShapeStyle { color: colour.mix(share), ..ink(colour, width) };
    for (&id, uav) in run.uavs.iter().filter(|_| recent > 0) {
        lines.push(line(uav.path.runs(of_uav), pale(run.uav_colour(id), 0.3, 0.75), false, EARLIER));
    }
    for (group, curve) in run.uavs.values().filter(|_| run.created > 1).flat_map(|uav| &uav.assigned.pieces) {
        let colour = group.map_or(NO_GROUP, |colour| GROUPS[colour]);
        lines.push(line(curve.runs_since(recent, of_uav), pale(colour, 0.4, 6.0), false, BAND));
    }
    // With many targets, true and estimated paths are indistinguishable.
    for (_, curve) in run.truth.iter().filter(|path| !many || !run.tracks.contains_key(path.0)) {
        lines.push(line(curve.runs(points), ink(RGBColor(200, 200, 200), thick), false, TRUTH));
    }
    for curve in run.tracks.values().filter_map(|path| path.pieces.get(&None)) {
        lines.push(line(curve.runs(points), ink(NO_GROUP, thin), false, UNGROUPED));
    }
    for (group, curve) in run.tracks.values().flat_map(|path| &path.pieces) {
        lines.extend(group.map(|colour| line(curve.runs(points), ink(GROUPS[colour], thin), false, "")));
    }
    for (&(_, colour), curve) in &run.dwells {
        lines.push(line(curve.runs(points), ink(GROUPS[colour], thin + 0.75), true, DWELL));
    }
    for (&id, group) in &run.groups {
        let colour = run.group_colour(id);
        let [centre, radius] = [&group.centre, &group.standoff].map(|curve| curve.runs(share(4 * run.groups.len())));
        let last = |runs: &[Vec<Point>]| runs.last().and_then(|run| run.last()).copied();
        let orbit = last(&centre).zip(last(&radius)).map(|(at, radius)| arc(at, radius.1, 0.0, TAU).collect());
        lines.push(line(orbit.into_iter().collect(), ink(colour, 1.25), true, ORBIT));
        lines.push(line(centre, ink(darker(colour), 1.0), false, ""));
    }
    lines
}

fn darker(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    RGBColor(red / 2, green / 2, blue / 2)
}

/// Points of an arc about a centre, symmetric to the direction `middle`; `angle`: full angle of the arc, rad.
pub(crate) fn arc((x, y): Point, radius: f64, middle: f64, angle: f64) -> impl Iterator<Item = Point> {
    let direction = move |step| middle + angle * (f64::from(step) / 120.0 - 0.5);
    (0..=120).map(direction).map(move |angle| (x + radius * cos(angle), y + radius * sin(angle)))
}
