//! Figure `speed_and_turn_rate`: what each UAV was told to fly and what it flew, within its limits.

use super::chart::{Drawn, Line, MOST_NAMED, Panel, of_uavs, stacked};
use super::curve::Curve;
use super::figure::Setup;
use super::gather::{Run, Uav};

/// Draws the figure. Turn rates swing from limit to limit: on one panel, those of a few UAVs would hide one another.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
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
