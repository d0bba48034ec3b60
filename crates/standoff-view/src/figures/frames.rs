//! Frames of an animation: the map of a run at single time steps. All frames of a run have the same size and axes.

use std::collections::VecDeque;
use std::iter::once;
use std::ops::Range;

use plotters::prelude::*;
use standoff::research::math::{TAU, hypot};
use standoff_record::{Frame, GroupRow, UavRow};
use standoff_score::FrameScorer;

use super::chart::{Area, Chart, Line, page};
use super::curve::{Point, range, usable};
use super::figure::Setup;
use super::style::ink;
use super::symbol::Symbol;
use super::trajectories::{NO_GROUP, arc, zones};
use crate::colours::{GROUPS, GroupColours, UAVS};

/// Duration of the trails of UAVs, microseconds.
const TRAIL_US: i64 = 60_000_000;
/// Distance of the end of a field of view from the furthest member of its group, m, and its length without a group, m;
/// as on the page.
const BEHIND_M: f64 = 40.0;
const ALONE_M: f64 = 400.0;
/// Colour of targets out of view.
const OUT_OF_VIEW: RGBColor = RGBColor(196, 38, 29);
/// Height of a frame, px.
const HEIGHT: u32 = 720;

/// Area of a run: of all UAVs and true targets.
#[derive(Debug, Clone, Default)]
pub struct Extent {
    east_m: Option<Range<f64>>,
    north_m: Option<Range<f64>>,
}

impl Extent {
    /// Extends the area to the UAVs and true targets of a time step.
    pub fn add(&mut self, frame: &Frame) {
        let uavs = frame.uavs.iter().map(|row| [row.x_m, row.y_m]);
        for [x_m, y_m] in uavs.chain(frame.truth.iter().map(|row| [row.x_m, row.y_m])) {
            for (axis, value) in [(&mut self.east_m, x_m), (&mut self.north_m, y_m)] {
                let Some(value) = usable(value) else { continue };
                let known = axis.take().unwrap_or(value..value);
                *axis = Some(known.start.min(value)..known.end.max(value));
            }
        }
    }
}

/// Draws maps of a run at single time steps.
#[derive(Debug)]
pub struct MapFrames<'a> {
    setup: &'a Setup,
    extent: Extent,
    scorer: FrameScorer,
    colours: GroupColours,
    /// Recent positions of the UAVs, by time.
    trails: VecDeque<(i64, Vec<(u32, Point)>)>,
}

impl<'a> MapFrames<'a> {
    /// Starts with the first time step of a run in the area `extent`.
    #[must_use]
    pub fn new(setup: &'a Setup, extent: Extent) -> Self {
        let scorer = FrameScorer::new(setup.rules.clone());
        Self { setup, extent, scorer, colours: GroupColours::default(), trails: VecDeque::new() }
    }

    /// Processes the next time step; returns its map as an SVG document if it is `requested`. Every time step must be
    /// processed, because trails and colours depend on the earlier ones.
    pub fn next(&mut self, frame: &Frame, requested: bool) -> Result<Option<String>, String> {
        self.colours.next_step(&frame.groups);
        self.trails.push_back((frame.time_us, frame.uavs.iter().map(|row| (row.uav, (row.x_m, row.y_m))).collect()));
        while self.trails.front().is_some_and(|(time_us, _)| *time_us < frame.time_us - TRAIL_US) {
            self.trails.pop_front();
        }
        let scores = self.scorer.frame(frame);
        if !requested {
            return Ok(None);
        }
        let out = frame.truth.iter().map(|row| row.target).filter(|target| scores.in_view(*target) == Some(false));
        let out: Vec<u32> = out.collect();
        let (lines, views, symbols) = (self.lines(frame), self.views(frame), self.symbols(frame, &out));
        let heading = format!("{:.1} s", frame.time_us as f64 / 1e6);
        let [east, north] = [&self.extent.east_m, &self.extent.north_m].map(|axis| axis.clone().unwrap_or(0.0..0.0));
        let draw = |area: &Area| {
            let [east, north] = [&east, &north].map(|axis| range([axis.start, axis.end], 10.0, 0.06));
            let mut chart = Chart::map(area, &east, &north)?;
            let faint = |(colour, corners): &(RGBColor, Vec<Point>)| Polygon::new(corners.clone(), colour.mix(0.15));
            chart.plot.draw_series(views.iter().map(faint))?;
            lines.into_iter().try_for_each(|line| chart.line(line))?;
            symbols.into_iter().try_for_each(|(symbol, places, label)| chart.symbols(symbol, &places, label))?;
            chart.finish()
        };
        page(&heading, &self.setup.title, "", HEIGHT, draw).map(Some).map_err(|error| error.to_string())
    }

    fn group_colour(&self, group: Option<u32>) -> RGBColor {
        group.and_then(|group| self.colours.place(group)).map_or(NO_GROUP, |place| GROUPS[place])
    }

    /// Zones, orbits and trails.
    fn lines(&self, frame: &Frame) -> Vec<Line> {
        let mut lines: Vec<Line> = zones(self.setup).into_iter().map(|line| Line { label: None, ..line }).collect();
        for (rank, group) in frame.groups.iter().enumerate() {
            let circle = arc((group.x_m, group.y_m), group.standoff_distance_m, 0.0, TAU).collect();
            let label = (rank == 0).then(|| "desired orbit".to_owned());
            lines.push(Line { label, ..Line::new(vec![circle], ink(self.group_colour(Some(group.group)), 1.5)) });
        }
        for (rank, row) in frame.uavs.iter().enumerate() {
            let at = |(_, uavs): &(i64, Vec<(u32, Point)>)| uavs.iter().find(|(uav, _)| *uav == row.uav).map(|of| of.1);
            let path = self.trails.iter().filter_map(at).collect();
            let label = (rank == 0).then(|| "UAV, last minute".to_owned());
            lines.push(Line { label, ..Line::new(vec![path], ink(UAVS[rank % UAVS.len()], 1.0)) });
        }
        lines
    }

    /// Fields of view, in the colours of the assigned groups.
    fn views(&self, frame: &Frame) -> Vec<(RGBColor, Vec<Point>)> {
        let field_of_view = usable(self.setup.field_of_view_rad).unwrap_or(0.0).clamp(0.0, TAU);
        let view = |row: &UavRow| {
            let group = frame.groups.iter().find(|group| Some(group.group) == row.group);
            let far = |group: &GroupRow| hypot(group.x_m - row.x_m, group.y_m - row.y_m) + group.spread_m + BEHIND_M;
            let (apex, reach) = ((row.x_m, row.y_m), group.map_or(ALONE_M, far));
            let corners = once(apex).chain(arc(apex, reach, row.boresight_rad?, field_of_view)).collect();
            Some((self.group_colour(row.group), corners))
        };
        frame.uavs.iter().filter_map(view).collect()
    }

    /// Targets and UAVs, from bottom to top.
    fn symbols(&self, frame: &Frame, out_of_view: &[u32]) -> Vec<(Symbol, Vec<Point>, Option<String>)> {
        let mut symbols = Vec::new();
        let mut add = |symbol, places: Vec<Point>, label: &str| {
            let label = (!label.is_empty() && !places.is_empty()).then(|| label.to_owned());
            symbols.push((symbol, places, label));
        };
        let out = frame.truth.iter().filter(|row| out_of_view.contains(&row.target));
        let out = out.map(|row| (row.x_m, row.y_m)).collect();
        add(Symbol::disc(8.0, OUT_OF_VIEW), out, "target out of view");
        let truth = frame.truth.iter().map(|row| (row.x_m, row.y_m)).collect();
        add(Symbol::disc(2.5, RGBColor(150, 150, 150)), truth, "true position");
        let mut groups: Vec<Option<u32>> = frame.tracks.iter().map(|row| row.group).collect();
        groups.sort_unstable();
        groups.dedup();
        for (rank, group) in groups.into_iter().enumerate() {
            let tracks = frame.tracks.iter().filter(|row| row.group == group);
            let places = tracks.map(|row| (row.state[0], row.state[3])).collect();
            let label = if group.is_none() { "track in no group" } else { "track, group colour" };
            add(Symbol::disc(4.5, self.group_colour(group)), places, if rank < 2 { label } else { "" });
        }
        for (rank, row) in frame.uavs.iter().enumerate() {
            let symbol = Symbol::end(UAVS[rank % UAVS.len()], row.uav.to_string());
            add(symbol, vec![(row.x_m, row.y_m)], if rank == 0 { "UAV, field of view" } else { "" });
        }
        symbols
    }
}
