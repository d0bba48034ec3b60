//! Figure `speed_and_turn_rate`: what each UAV was told to fly and what it flew, within its limits.

use super::Setup;
use super::chart::{Drawn, level, of_uavs, over_time};
use super::gather::Run;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<String> {
    let mut speed = of_uavs(run, 1.75, true, |uav| &uav.speed);
    let mut commanded = of_uavs(run, 0.5, false, |uav| &uav.speed_command);
    commanded.iter_mut().take(1).for_each(|line| line.label = Some("commanded (thin)".to_owned()));
    speed.extend(commanded);
    speed.extend([level(run, setup.speed_min_m_s, Some("limits")), level(run, setup.speed_max_m_s, None)]);

    let most = setup.turn_rate_max_rad_s.to_degrees();
    let mut turn_rate = of_uavs(run, 1.75, false, |uav| &uav.turn_rate);
    turn_rate.extend(of_uavs(run, 0.5, false, |uav| &uav.turn_rate_command));
    turn_rate.extend([-most, most].map(|value| level(run, value, None)));
    let panels = [("Speed (m/s)", None, speed), ("Turn rate (°/s)", None, turn_rate)];
    over_time(run, "Speed and turn rate of each UAV", &setup.title, panels)
}
