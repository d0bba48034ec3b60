//! Figure `speed_and_turn_rate`: what each UAV was told to fly and what it flew, within its limits.

use super::Setup;
use super::chart::{Drawn, Line, Panel, of_uavs, over_time};
use super::curve::Curve;
use super::gather::{Run, Uav};

/// Draws the figure.
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
    let turn_rate = Panel {
        axis: "Turn rate (°/s)".to_owned(),
        lines: lines(|uav| &uav.turn_rate, |uav| &uav.turn_rate_command),
        levels: limits([-most, most]),
        ..Panel::default()
    };
    over_time(run, "Speed and turn rate of each UAV", &setup.title, vec![speed, turn_rate])
}
