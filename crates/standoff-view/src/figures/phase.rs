//! Figure `phase`: how the UAVs of one orbit are spread around it.

use super::chart::{Drawn, Line, MOST_NAMED, Panel, per_group, share};
use super::curve::Curve;
use super::figure::Setup;
use super::gather::{Group, Run};
use super::ink::ink;
use standoff_sim::geometry::{Between, wanted_separation_rad};
use std::collections::BTreeSet;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |id: u32, group: &Group| {
        let line = |(rank, (&(_, uav, other), curve)): (usize, (&Between, &Curve))| {
            let label = other.map_or(format!("UAV {uav} to the next"), |other| format!("UAV {uav} to UAV {other}"));
            let (runs, ink) = (curve.runs(share(group.phases.len())), ink(run.uav_colour(uav), 1.75));
            // A pair's curve has both colours: the same UAV may be in several pairs, one after the other.
            let dashes = other.map(|other| run.uav_colour(other));
            Line { dashes, label: (rank < MOST_NAMED).then_some(label), ..Line::new(runs, ink) }
        };
        let counts: BTreeSet<usize> = group.phases.keys().map(|between| between.0).collect();
        let level = |count| {
            (wanted_separation_rad(count, setup.separation_rad).to_degrees(), Some(format!("wanted for {count} UAVs")))
        };
        Panel {
            axis: run.axis("Phase separation", id, "°"),
            shown: Some(0.0),
            lines: group.phases.iter().enumerate().map(line).collect(),
            levels: counts.into_iter().map(level).collect(),
            ..Panel::default()
        }
    };
    per_group(run, "Phase separation of the UAVs on one orbit", &setup.title, panel, None)
}
