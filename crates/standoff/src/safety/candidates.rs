//! Candidate commands near a desired command, for the case that the desired command is not admissible.

use crate::params::UavParams;
use crate::safety::fallback::{FallbackModel, Sense};
use crate::safety::motion::Motion;
use crate::uav::Command;

/// Number of turn rates to each side of straight flight.
const TURNS: i32 = 8;
/// Number of speeds to each side of the nominal speed.
const SPEEDS: i32 = 3;

/// Cost of a speed that differs from the desired one by the maximum speed change; it grows with the square. A turn rate
/// that differs from the desired one by the maximum turn rate costs 1.
const SPEED_COST: f64 = 0.1;
/// Cost of a turn rate that differs from the current one by the maximum turn rate; it grows with the square.
const TURN_COST: f64 = 0.2;

/// Returns the commands on a grid of turn rates and speeds, which includes the desired turn rate and the desired speed,
/// and the fallbacks, with their costs. The cheapest command comes first.
pub(crate) fn candidates(model: &FallbackModel, own: &Motion, desired: Command) -> Vec<(f64, Command)> {
    let UavParams { turn_rate_max_rad_s: turn_max, speed_m_s: nominal_m_s, speed_change_max_m_s: change_max, .. } =
        model.airframe.uav;
    let share = |step: i32, steps: i32| f64::from(step) / f64::from(steps);
    let turns = (-TURNS..=TURNS).map(|step| turn_max * share(step, TURNS)).chain([desired.turn_rate_rad_s]);
    let with_cost = |command: Command| {
        let off = (command.turn_rate_rad_s - desired.turn_rate_rad_s) / turn_max;
        let faster = (command.speed_m_s - desired.speed_m_s) / change_max.max(1e-9);
        let turned = (command.turn_rate_rad_s - own.state.turn_rate_rad_s) / turn_max;
        (off * off + SPEED_COST * faster * faster + TURN_COST * turned * turned, command)
    };
    let grid = turns.flat_map(|turn_rate_rad_s| {
        let speeds = (-SPEEDS..=SPEEDS).map(|step| nominal_m_s + change_max * share(step, SPEEDS));
        speeds.chain([desired.speed_m_s]).map(move |speed_m_s| Command { speed_m_s, turn_rate_rad_s })
    });
    let limited = |command| model.airframe.uav.limit(command).command;
    let fallbacks = Sense::BOTH.map(|sense| limited(model.command(own, sense, None)));
    let mut all: Vec<(f64, Command)> = grid.chain(fallbacks).map(with_cost).collect();
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    all
}
