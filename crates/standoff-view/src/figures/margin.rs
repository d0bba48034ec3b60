//! Figure `margin`: what a group adds to its spread, and how wrong the centre is that it allows for.

use super::chart::{Drawn, MOST_PANELS, Panel, of_groups, over_time};
use super::curve::Curve;
use super::figure::Setup;
use super::gather::{Group, Run};

/// Draws the figure: the margin above, the error below, each with a scale of its own, for the printed margin (16) is a
/// squared, dimensionless distance taken for metres.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |axis: &str, curve: fn(&Group) -> &Curve| {
        // Of many groups, everybody's marks would hide the curves.
        let marked = run.groups.values().filter(|_| run.groups.len() <= MOST_PANELS);
        let marks = marked.flat_map(Group::marks).collect();
        let lines = of_groups(run, 1.5, curve);
        Panel { axis: axis.to_owned(), shown: Some(0.0), lines, marks, ..Panel::default() }
    };
    let panels = vec![
        panel("Margin added to the spread (m)", |group| &group.margin),
        panel("Error of the estimated centre (m)", |group| &group.centre_error),
    ];
    over_time(run, "Margin of the standoff distance and error of the group's centre", &setup.title, panels)
}
