//! Figure `margin`: what a group adds to its spread, and how wrong the centre is that it allows for.

use super::chart::{Drawn, Line, MOST_NAMED, MOST_PANELS, Panel, over_time, share};
use super::curve::Curve;
use super::figure::Setup;
use super::gather::{Group, Run};
use super::ink::ink;

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
