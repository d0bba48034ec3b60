//! What the figures show of a run, gathered from its frames one at a time.

use super::curve::{Curve, Point, usable};
use super::{chart, line_of_sight, phase};
use plotters::style::RGBColor;
use standoff_sim::record::Frame;
use std::collections::BTreeMap;
use std::ops::Range;

/// Curves of one UAV, in metres, degrees and seconds.
#[derive(Debug, Default)]
pub(super) struct Uav {
    pub(super) path: Curve,
    /// What it sees at last: where from, in which direction (rad) and how far (m).
    pub(super) view: Option<(Point, f64, f64)>,
    pub(super) distance: Curve,
    pub(super) error: Curve,
    pub(super) off_boresight: Curve,
    pub(super) speed: Curve,
    pub(super) speed_command: Curve,
    pub(super) turn_rate: Curve,
    pub(super) turn_rate_command: Curve,
}

/// Curves of one group.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) centre: Curve,
    pub(super) standoff: Curve,
    pub(super) unclamped: Curve,
}

/// A run as far as the figures show it.
#[derive(Debug, Default)]
pub(super) struct Run {
    pub(super) frames: usize,
    /// Earliest and latest instant, s.
    times: Option<[f64; 2]>,
    pub(super) uavs: BTreeMap<u32, Uav>,
    pub(super) groups: BTreeMap<u32, Group>,
    /// True paths by target.
    pub(super) truth: BTreeMap<u32, Curve>,
    /// Estimated paths by target and group.
    pub(super) tracks: BTreeMap<(u32, Option<u32>), Curve>,
    /// Phase separations in degrees.
    pub(super) separations: BTreeMap<phase::Between, Curve>,
}

impl Run {
    /// Takes in a frame.
    pub(super) fn add(&mut self, frame: &Frame) {
        let (index, time) = (self.frames, frame.time_us as f64 * 1e-6);
        self.frames += 1;
        if let Some(time) = usable(time) {
            let [first, last] = self.times.unwrap_or([time, time]);
            self.times = Some([first.min(time), last.max(time)]);
        }
        for row in &frame.groups {
            let group = self.groups.entry(row.group).or_default();
            group.centre.push(index, row.x_m, row.y_m);
            group.standoff.push(index, time, row.standoff_distance_m);
            group.unclamped.push(index, time, row.standoff_unclamped_m);
        }
        for row in &frame.truth {
            self.truth.entry(row.target).or_default().push(index, row.x_m, row.y_m);
        }
        for row in &frame.tracks {
            self.tracks.entry((row.target, row.group)).or_default().push(index, row.state[0], row.state[3]);
        }
        let members = line_of_sight::members(frame);
        for row in &frame.uavs {
            let group = frame.groups.iter().find(|group| Some(group.group) == row.group);
            let uav = self.uavs.entry(row.uav).or_default();
            uav.path.push(index, row.x_m, row.y_m);
            uav.view = group.and_then(|group| {
                let reach = usable(row.centre_distance_m?.abs() + group.spread_m.abs())?;
                Some((place(row.x_m, row.y_m)?, usable(row.boresight_rad?)?, reach))
            });
            uav.distance.push(index, time, row.centre_distance_m);
            let error = row.centre_distance_m.zip(group).map(|(r, group)| r - group.standoff_distance_m);
            uav.error.push(index, time, error);
            let widest = line_of_sight::widest(row, &members);
            uav.off_boresight.push(index, time, widest.map(f64::to_degrees));
            uav.speed.push(index, time, row.speed_m_s);
            uav.speed_command.push(index, time, row.speed_command_m_s);
            uav.turn_rate.push(index, time, row.turn_rate_rad_s.to_degrees());
            uav.turn_rate_command.push(index, time, row.turn_rate_command_rad_s.to_degrees());
        }
        for (between, angle) in phase::separations(frame) {
            self.separations.entry(between).or_default().push(index, time, angle.to_degrees());
        }
    }

    /// From the first to the last instant, s.
    pub(super) fn time(&self) -> Range<f64> {
        chart::range(self.times.into_iter().flatten(), 1.0, 0.0)
    }

    /// The UAV's colour, the same in every figure.
    pub(super) fn uav_colour(&self, id: u32) -> RGBColor {
        chart::UAVS[self.uavs.range(..id).count() % chart::UAVS.len()]
    }

    /// The group's colour.
    pub(super) fn group_colour(&self, id: u32) -> RGBColor {
        chart::GROUPS[self.groups.range(..id).count() % chart::GROUPS.len()]
    }
}

/// A position if it can be drawn.
pub(super) fn place(x_m: f64, y_m: f64) -> Option<Point> {
    usable(x_m).zip(usable(y_m))
}
