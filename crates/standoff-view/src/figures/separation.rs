//! Figure `separation`: how near the UAVs of one group come to each other.

use super::chart::{Drawn, Panel, of_groups, over_time};
use super::figure::Setup;
use super::gather::Run;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let lines = of_groups(run, 1.75, |group| &group.separation);
    let panel = Panel { axis: "Smallest distance (m)".to_owned(), shown: Some(0.0), lines, ..Panel::default() };
    over_time(run, "Smallest distance between two UAVs of a group", &setup.title, vec![panel])
}
