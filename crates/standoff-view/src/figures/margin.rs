//! Figure `margin`: what a group adds to its spread, and how wrong the centre is that it allows for.

use super::Setup;
use super::chart::{Drawn, Line, Panel, REFERENCE, ink, per_group};
use super::curve::{MOST_POINTS, Point};
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

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |id: u32, group: &Group| {
        let line = |runs, ink, label| Line { runs, ink, dashed: false, label: Some(label) };
        let (thick, thin) = (ink(run.group_colour(id), 1.75), ink(REFERENCE, 1.0));
        Panel {
            axis: run.axis("Margin and error", id, "m"),
            shown: Some(0.0),
            lines: vec![
                line(group.margin.runs(MOST_POINTS), thick, format!("margin, group {id}")),
                line(group.centre_error.runs(MOST_POINTS), thin, "error of the centre".to_owned()),
            ],
            marks: group.marks(),
            ..Panel::default()
        }
    };
    per_group(run, "Margin of the standoff distance and error of the group's centre", &setup.title, panel, None)
}
