//! Figure `separation`: how near the UAVs of one group come to each other.

use super::chart::{Drawn, Line, MOST_NAMED, Panel, over_time, share};
use super::figure::Setup;
use super::gather::{Group, Run};
use super::ink::ink;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let line = |(rank, (&id, group)): (usize, (&u32, &Group))| Line {
        label: (rank < MOST_NAMED).then(|| format!("group {id}")),
        ..Line::new(group.separation.runs(share(run.groups.len())), ink(run.group_colour(id), 1.75))
    };
    let lines = run.groups.iter().enumerate().map(line).collect();
    let panel = Panel { axis: "Smallest distance (m)".to_owned(), shown: Some(0.0), lines, ..Panel::default() };
    over_time(run, "Smallest distance between two UAVs of a group", &setup.title, vec![panel])
}
