//! Candidate commands near a desired command, for the case that the desired command is not admissible.

use crate::params::UavParams;
use crate::uav::Command;

/// Number of turn rates to each side of straight flight.
const TURNS: i32 = 8;
/// Number of speeds to each side of the nominal speed.
const SPEEDS: i32 = 3;

/// Weights of the cost of a command that differs from the desired one. A difference in turn rate by the maximum turn
/// rate costs 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Costs {
    /// Cost of a speed that differs from the desired one by the maximum speed change; it grows with the square.
    pub(crate) speed: f64,
    /// Cost of a turn rate that differs from the current one by the maximum turn rate; it grows with the square.
    pub(crate) turn: f64,
}

impl Costs {
    /// Returns the commands on a grid of turn rates and speeds, which includes the desired turn rate and the desired
    /// speed, with their costs. The cheapest command comes first.
    pub(crate) fn candidates(self, uav: &UavParams, flown_rad_s: f64, desired: Command) -> Vec<(f64, Command)> {
        let UavParams {
            turn_rate_max_rad_s: turn_max, speed_m_s: nominal_m_s, speed_change_max_m_s: change_max, ..
        } = *uav;
        let share = |step: i32, steps: i32| f64::from(step) / f64::from(steps);
        let turns = (-TURNS..=TURNS).map(|step| turn_max * share(step, TURNS)).chain([desired.turn_rate_rad_s]);
        let all = turns.flat_map(|turn_rate_rad_s| {
            let speeds = (-SPEEDS..=SPEEDS).map(|step| nominal_m_s + change_max * share(step, SPEEDS));
            speeds.chain([desired.speed_m_s]).map(move |speed_m_s| {
                let off = (turn_rate_rad_s - desired.turn_rate_rad_s) / turn_max;
                let faster = (speed_m_s - desired.speed_m_s) / change_max.max(1e-9);
                let turned = (turn_rate_rad_s - flown_rad_s) / turn_max;
                let cost = off * off + self.speed * faster * faster + self.turn * turned * turned;
                (cost, Command { speed_m_s, turn_rate_rad_s })
            })
        });
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}
