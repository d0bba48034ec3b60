//! Figures over time: of UAVs, of groups, or one panel per group.

use super::chart::{Drawn, Line, NAMED_MAX, PANELS_MAX, Panel, of_groups, of_uavs, per_group, share, stacked};
use super::collect::{AgentCurves, Group, Run, Uav};
use super::curve::{Curve, MAX_POINTS, range};
use super::figure::Setup;
use super::style::ink;
use standoff_score::geometry::{PhasePair, desired_pair_phase_rad};
use std::collections::BTreeSet;

/// Draws the distance of each UAV from the centre of its group, and from its orbit.
pub(super) fn standoff_distance(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    // The margin as published (16) reaches kilometres when members change: the flown distances would be a flat line.
    let cut_m = 1.3 * setup.radius_max_m;
    let panel = |id: u32, group: &Group| {
        let (thin, thick) = (ink(run.group_colour(id), 1.0), ink(run.group_colour(id), 2.5));
        let (mut unbounded, desired) = (group.unclamped.runs(MAX_POINTS), group.standoff.runs(MAX_POINTS));
        unbounded.iter_mut().flatten().for_each(|at| at.1 = at.1.min(cut_m));
        let label = |text: &str| Some(format!("{text}, group {id}"));
        let mut lines = vec![
            Line { dashed: true, label: label("unbounded"), ..Line::new(unbounded, thin) },
            Line { label: label("desired"), ..Line::new(desired, thick) },
        ];
        lines.extend(of_uavs(run, 1.25, group.distances.iter().map(|(&uav, curve)| (uav, curve))));
        // Bounds far from all flown values are left out, because they would flatten the curves.
        let flown = range(lines.iter().flat_map(|line| line.runs.iter().flatten()).map(|at| at.1), 1.0, 0.1);
        let bounds = [(setup.radius_min_m, "smallest allowed"), (setup.radius_max_m, "largest allowed")];
        let near = bounds.into_iter().filter(|(value, _)| flown.contains(value));
        Panel {
            axis: run.axis("Distance to centre", id, "m"),
            lines,
            levels: near.map(|(value, label)| (value, Some(label.to_owned()))).collect(),
            marks: group.marks(),
            ..Panel::default()
        }
    };
    let errors = Panel {
        axis: "Distance − desired (m)".to_owned(),
        lines: of_uavs(run, 1.25, run.each(|uav| &uav.error)),
        levels: vec![(0.0, None)],
        ..Panel::default()
    };
    let note = format!("; the unbounded distance is cut off at {cut_m:.0} m");
    per_group(run, "Distance of each UAV to the centre of its group", &setup.title, &note, panel, Some(errors))
}

/// Draws the phase difference of the UAVs on each orbit.
pub(super) fn phase(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |id: u32, group: &Group| {
        let line = |(rank, (&(_, uav, other), curve)): (usize, (&PhasePair, &Curve))| {
            let label = other.map_or(format!("UAV {uav} to the next"), |other| format!("UAV {uav} to UAV {other}"));
            let (runs, ink) = (curve.runs(share(group.phases.len())), ink(run.uav_colour(uav), 1.75));
            // The curve of a pair has both colours, because a UAV may successively be in several pairs.
            let dashes = other.map(|other| run.uav_colour(other));
            Line { dashes, label: (rank < NAMED_MAX).then_some(label), ..Line::new(runs, ink) }
        };
        let counts: BTreeSet<usize> = group.phases.keys().map(|between| between.0).collect();
        let level = |count| {
            (
                desired_pair_phase_rad(count, setup.desired_phase_rad).to_degrees(),
                Some(format!("desired for {count} UAVs")),
            )
        };
        Panel {
            axis: run.axis("Phase difference", id, "°"),
            shown: Some(0.0),
            lines: group.phases.iter().enumerate().map(line).collect(),
            levels: counts.into_iter().map(level).collect(),
            ..Panel::default()
        }
    };
    per_group(run, "Phase difference of the UAVs on one orbit", &setup.title, "", panel, None)
}

/// Draws the smallest distance between two UAVs of each group.
pub(super) fn separation(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let lines = of_groups(run, 1.75, |group| &group.separation);
    let panel = Panel { axis: "Smallest distance (m)".to_owned(), shown: Some(0.0), lines, ..Panel::default() };
    stacked(run, "Smallest distance between two UAVs of a group", &setup.title, "", vec![panel])
}

/// Draws the margin that a group adds to its spread, and below it the error of the estimated centre, which the margin
/// should cover. The scales differ because the margin as published (16) is a squared, dimensionless distance used as
/// metres.
pub(super) fn margin(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |axis: &str, curve: fn(&Group) -> &Curve| {
        // With many groups, the event marks would hide the curves.
        let marked = run.groups.values().filter(|_| run.groups.len() <= PANELS_MAX);
        let marks = marked.flat_map(Group::marks).collect();
        let lines = of_groups(run, 1.5, curve);
        Panel { axis: axis.to_owned(), shown: Some(0.0), lines, marks, ..Panel::default() }
    };
    let panels = vec![
        panel("Margin added to the spread (m)", |group| &group.margin),
        panel("Error of the estimated centre (m)", |group| &group.centre_error),
    ];
    stacked(run, "Margin of the standoff distance and error of the group's centre", &setup.title, "", panels)
}

/// Draws the largest off-boresight angle of a group member for each UAV, compared with half the field of view.
pub(super) fn off_boresight(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let edge = (setup.field_of_view_rad / 2.0).to_degrees();
    let panel = Panel {
        axis: "Largest off-boresight angle (°)".to_owned(),
        shown: Some(0.0),
        lines: of_uavs(run, 1.25, run.each(|uav| &uav.off_boresight)),
        levels: vec![(edge, Some("edge of field of view".to_owned()))],
        ..Panel::default()
    };
    stacked(run, "Off-boresight angle of the outermost member of the group", &setup.title, "", vec![panel])
}

/// Draws commanded and flown speed and turn rate of each UAV with their limits. Each UAV has its own panel for the turn
/// rate: turn rates often swing from limit to limit, so that several curves in one panel would hide one another.
pub(super) fn speed_and_turn_rate(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let lines = |flown: fn(&Uav) -> &Curve, commanded: fn(&Uav) -> &Curve| {
        let mut lines = of_uavs(run, 1.75, run.each(flown));
        let thin = of_uavs(run, 0.5, run.each(commanded));
        lines.extend(thin.into_iter().map(|line| Line { label: Some("commanded (thin)".to_owned()), ..line }));
        lines
    };
    let most = setup.turn_rate_max_rad_s.to_degrees();
    let limits = |values: [f64; 2]| values.map(|value| (value, Some("limits".to_owned()))).to_vec();
    let speed = Panel {
        axis: "Speed (m/s)".to_owned(),
        lines: lines(|uav| &uav.speed, |uav| &uav.speed_command),
        levels: limits([setup.speed_min_m_s, setup.speed_max_m_s]),
        ..Panel::default()
    };
    let mut flown = of_uavs(run, 1.25, run.each(|uav| &uav.turn_rate)).into_iter();
    let mut commanded = of_uavs(run, 0.5, run.each(|uav| &uav.turn_rate_command)).into_iter();
    let turn_rate = |&id: &u32| Panel {
        axis: format!("UAV {id} (°/s)"),
        lines: flown.next().into_iter().chain(commanded.next().map(|line| Line { label: None, ..line })).collect(),
        levels: limits([-most, most]),
        is_row: true,
        ..Panel::default()
    };
    let rows = run.uavs.keys().take(NAMED_MAX).map(turn_rate);
    let panels = std::iter::once(speed).chain(rows).collect();
    let (count, shown) = (run.uavs.len(), NAMED_MAX);
    let note =
        if count > shown { format!(" (turn rates of the first {shown} of {count} UAVs)") } else { String::new() };
    stacked(run, "Speed of the UAVs, and turn rate of each", &setup.title, &note, panels)
}

/// Draws how many teammates each agent receives, how many agents disagree, and how much of the team state is
/// uncommitted.
pub(super) fn agreement(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |axis: &str, curve: fn(&AgentCurves) -> &Curve| Panel {
        axis: axis.to_owned(),
        shown: Some(0.0),
        lines: of_uavs(run, 1.75, run.agents.iter().map(|(&id, agent)| (id, curve(agent)))),
        ..Panel::default()
    };
    let panels = vec![
        panel("Teammates silent, timed out or left", |agent| &agent.not_received),
        panel("Agents that disagree", |agent| &agent.disagreeing),
        panel("Uncommitted time (s)", |agent| &agent.uncommitted),
    ];
    stacked(run, "Communication and agreement of the agents", &setup.title, "", panels)
}
