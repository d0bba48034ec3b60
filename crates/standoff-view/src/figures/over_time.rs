//! The figures over time: of the UAVs, of the groups, or of each group.

use super::chart::{Drawn, Line, MOST_NAMED, MOST_PANELS, Panel, of_groups, of_uavs, per_group, share, stacked};
use super::curve::{Curve, MOST_POINTS, range};
use super::figure::Setup;
use super::gather::{Group, Mind, Run, Uav};
use super::ink::ink;
use standoff_sim::geometry::{Between, wanted_separation_rad};
use std::collections::BTreeSet;

/// How far each UAV is from its group's centre, and from its orbit.
pub(super) fn standoff_distance(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    // The printed margin (16) runs to kilometres where members change: what is flown would be a flat line.
    let cut_m = 1.3 * setup.radius_max_m;
    let panel = |id: u32, group: &Group| {
        let (thin, thick) = (ink(run.group_colour(id), 1.0), ink(run.group_colour(id), 2.5));
        let (mut unbounded, desired) = (group.unclamped.runs(MOST_POINTS), group.standoff.runs(MOST_POINTS));
        unbounded.iter_mut().flatten().for_each(|at| at.1 = at.1.min(cut_m));
        let label = |text: &str| Some(format!("{text}, group {id}"));
        let mut lines = vec![
            Line { dashed: true, label: label("unbounded"), ..Line::new(unbounded, thin) },
            Line { label: label("desired"), ..Line::new(desired, thick) },
        ];
        lines.extend(of_uavs(run, 1.25, group.distances.iter().map(|(&uav, curve)| (uav, curve))));
        // A bound far from anything flown would only flatten the curves.
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
    let note = format!("; what is desired without bounds is drawn up to {cut_m:.0} m");
    per_group(run, "Distance of each UAV to the centre of its group", &setup.title, &note, panel, Some(errors))
}

/// How the UAVs of one orbit are spread around it.
pub(super) fn phase(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
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
    per_group(run, "Phase separation of the UAVs on one orbit", &setup.title, "", panel, None)
}

/// How near the UAVs of one group come to each other.
pub(super) fn separation(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let lines = of_groups(run, 1.75, |group| &group.separation);
    let panel = Panel { axis: "Smallest distance (m)".to_owned(), shown: Some(0.0), lines, ..Panel::default() };
    stacked(run, "Smallest distance between two UAVs of a group", &setup.title, "", vec![panel])
}

/// What a group adds to its spread, and how wrong the centre is that it allows for: the margin above, the error below,
/// each with a scale of its own, for the printed margin (16) is a squared, dimensionless distance taken for metres.
pub(super) fn margin(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
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
    stacked(run, "Margin of the standoff distance and error of the group's centre", &setup.title, "", panels)
}

/// Whether every member of the group lies within each UAV's field of view.
pub(super) fn line_of_sight(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let edge = (setup.field_of_view_rad / 2.0).to_degrees();
    let panel = Panel {
        axis: "Largest angle off boresight (°)".to_owned(),
        shown: Some(0.0),
        lines: of_uavs(run, 1.25, run.each(|uav| &uav.off_boresight)),
        levels: vec![(edge, Some("edge of field of view".to_owned()))],
        ..Panel::default()
    };
    stacked(run, "Line of sight to the outermost member of the group", &setup.title, "", vec![panel])
}

/// What each UAV was told to fly and what it flew, within its limits. Turn rates swing from limit to limit: on one
/// panel, those of a few UAVs would hide one another.
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
    let rows = run.uavs.keys().take(MOST_NAMED).map(turn_rate);
    let panels = std::iter::once(speed).chain(rows).collect();
    let (count, shown) = (run.uavs.len(), MOST_NAMED);
    let note =
        if count > shown { format!(" (turn rates of the first {shown} of {count} UAVs)") } else { String::new() };
    stacked(run, "Speed of the UAVs, and turn rate of each", &setup.title, &note, panels)
}

/// How well the minds of the UAVs agree, and how much of what they believe may still change.
pub(super) fn agreement(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |axis: &str, curve: fn(&Mind) -> &Curve| Panel {
        axis: axis.to_owned(),
        shown: Some(0.0),
        lines: of_uavs(run, 1.75, run.minds.iter().map(|(&id, mind)| (id, curve(mind)))),
        ..Panel::default()
    };
    let panels = vec![
        panel("UAVs not heard", |mind| &mind.unheard),
        panel("Minds that differ", |mind| &mind.contradicting),
        panel("May still change (s)", |mind| &mind.open),
    ];
    stacked(run, "What the mind of each UAV hears, and who disagrees with it", &setup.title, "", panels)
}
