//! Figure `line_of_sight`: whether every member of the group lies within each UAV's field of view.

use super::chart::{Drawn, Panel, of_uavs, over_time};
use super::figure::Setup;
use super::gather::Run;

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
