//! Figure `margin`: what a group adds to its spread, and how wrong the centre is that it allows for.

use super::Setup;
use super::chart::{Drawn, Line, MOST_NAMED, MOST_PANELS, Panel, ink, over_time, share};
use super::curve::{Curve, Point};
use super::gather::{Group, Run, place, true_place};
use standoff::math::hypot;
use standoff_sim::record::{Frame, GroupRow};

/// Distance from a group's estimated centre to the mean of its members' true places, m; a target in
/// dwell is a member of both groups.
pub(super) fn centre_error(frame: &Frame, group: &GroupRow) -> Option<f64> {
    let (x, y) = place(group.x_m, group.y_m)?;
    let id = Some(group.group);
    let members = frame.tracks.iter().filter(|track| track.group == id || track.to_group == id);
    let places: Vec<Point> = members.filter_map(|track| true_place(frame, track.target)).collect();
    let sum = places.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
    let count = places.len() as f64;
    (count > 0.0).then(|| hypot(sum.0 / count - x, sum.1 / count - y))
}

/// Draws the figure: the margin above, the error below, each with a scale of its own, for the printed margin (16) is a
/// squared, dimensionless distance taken for metres.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |axis: &str, curve: fn(&Group) -> &Curve| {
        let line = |(rank, (&id, group)): (usize, (&u32, &Group))| Line {
            label: (rank < MOST_NAMED).then(|| format!("group {id}")),
            ..Line::new(curve(group).runs(share(run.groups.len())), ink(run.group_colour(id), 1.5))
        };
        // Of many groups, everybody's marks would hide the curves.
        let marked = run.groups.values().filter(|_| run.groups.len() <= MOST_PANELS);
        let marks = marked.flat_map(Group::marks).collect();
        let lines = run.groups.iter().enumerate().map(line).collect();
        Panel { axis: axis.to_owned(), shown: Some(0.0), lines, marks, ..Panel::default() }
    };
    let panels = vec![
        panel("Margin added to the spread (m)", |group| &group.margin),
        panel("Error of the estimated centre (m)", |group| &group.centre_error),
    ];
    over_time(run, "Margin of the standoff distance and error of the group's centre", &setup.title, panels)
}
