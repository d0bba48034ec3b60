//! Figure `line_of_sight`: whether every member of the group lies within each UAV's field of view.

use super::Setup;
use super::chart::{Drawn, Panel, of_uavs, over_time};
use super::curve::{Point, usable};
use super::gather::{Run, place, true_place};
use standoff::{Angle, math::atan2};
use standoff_sim::record::{Frame, TrackRow, UavRow};

/// The members of each group and where they are: truly, or as estimated in a run without any truth.
/// A target in dwell is to be kept in view by the passing group alone.
pub(crate) fn members(frame: &Frame) -> Vec<(u32, Point)> {
    let member = |track: &TrackRow| {
        let estimate = || place(track.state[0], track.state[3]);
        // A track without a true target is nothing to look at: the target has left.
        let at = if frame.truth.is_empty() { estimate() } else { true_place(frame, track.target) };
        track.group.zip(at)
    };
    frame.tracks.iter().filter_map(member).collect()
}

/// Largest angle between the UAV's boresight and a member of its group, rad.
pub(crate) fn widest(row: &UavRow, members: &[(u32, Point)]) -> Option<f64> {
    let (group, boresight) = (row.group?, Angle::from_rad(usable(row.boresight_rad?)?));
    let (east, north) = place(row.x_m, row.y_m)?;
    let own = members.iter().filter(|member| member.0 == group);
    own.map(|(_, (x, y))| (Angle::from_rad(atan2(y - north, x - east)) - boresight).abs_rad()).reduce(f64::max)
}

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let edge = (setup.field_of_view_rad / 2.0).to_degrees();
    let panel = Panel {
        axis: "Largest angle off boresight (°)".to_owned(),
        shown: Some(0.0),
        lines: of_uavs(run, 1.25, run.each(|uav| &uav.off_boresight)),
        levels: vec![(edge, Some("edge of field of view".to_owned()))],
        ..Panel::default()
    };
    over_time(run, "Line of sight to the outermost member of the group", &setup.title, vec![panel])
}
