//! Figure `phase`: how the UAVs of one orbit are spread around it.

use super::Setup;
use super::chart::{Drawn, Line, MOST_NAMED, Panel, ink, per_group, share};
use super::curve::{Curve, usable};
use super::gather::{Group, Run};
use standoff::{Angle, math::TAU};
use standoff_sim::record::Frame;
use std::collections::BTreeSet;

/// What a phase separation lies between: how many UAVs are on the orbit, the UAV, and the other of a
/// pair; of more UAVs it is the next one anticlockwise.
pub(crate) type Between = (usize, u32, Option<u32>);

/// The phase separations of each group in a frame, rad; none where a phase is unknown, for neither the
/// neighbours nor their number would be right.
pub(crate) fn separations(frame: &Frame) -> Vec<(u32, Between, f64)> {
    let mut found = Vec::new();
    let groups: BTreeSet<u32> = frame.uavs.iter().filter_map(|row| row.group).collect();
    for group in groups {
        let uavs = frame.uavs.iter().filter(|row| row.group == Some(group));
        let phases = uavs.map(|row| Some((row.uav, Angle::from_rad(usable(row.phase_rad?)?))));
        let Some(mut phases) = phases.collect::<Option<Vec<_>>>() else { continue };
        if let [(a, first), (b, second)] = phases[..] {
            found.push((group, (2, a, Some(b)), (first - second).abs_rad()));
        } else if phases.len() > 2 {
            phases.sort_by(|a, b| a.1.rad().total_cmp(&b.1.rad()).then(a.0.cmp(&b.0)));
            let next = phases.iter().skip(1).map(|next| next.1.rad());
            let gaps = phases.iter().zip(next.chain([phases[0].1.rad() + TAU]));
            found.extend(gaps.map(|(&(uav, phase), next)| (group, (phases.len(), uav, None), next - phase.rad())));
        }
    }
    found
}

/// What the phase separations of so many UAVs should be, rad: a pair's is given, more are evenly spaced.
pub(crate) fn wanted_rad(count: usize, pair_rad: f64) -> f64 {
    if count == 2 { pair_rad } else { TAU / count as f64 }
}

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
        let level =
            |count| (wanted_rad(count, setup.separation_rad).to_degrees(), Some(format!("wanted for {count} UAVs")));
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
