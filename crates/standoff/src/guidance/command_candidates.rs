//! Candidate commands near a desired command, for the case that the desired command is not admissible.

use crate::bank::Motion;
use crate::params::UavParams;
use crate::uav::Command;
use crate::wind::PredictionLimits;

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
    ///
    /// UAVs that circle over ground at constant airspeed ([`Motion::circling_in`]) keep their speed; their turn rates
    /// include those of the escape manoeuvres.
    pub(crate) fn candidates(self, limits: &PredictionLimits, own: &Motion, desired: Command) -> Vec<(f64, Command)> {
        let UavParams {
            turn_rate_max_rad_s: turn_max, speed_m_s: nominal_m_s, speed_change_max_m_s: change_max, ..
        } = limits.uav;
        let share = |step: i32, steps: i32| f64::from(step) / f64::from(steps);
        let turns = (-TURNS..=TURNS).map(|step| turn_max * share(step, TURNS)).chain([desired.turn_rate_rad_s]);
        let with_cost = |command: Command| {
            let off = (command.turn_rate_rad_s - desired.turn_rate_rad_s) / turn_max;
            let faster = (command.speed_m_s - desired.speed_m_s) / change_max.max(1e-9);
            let turned = (command.turn_rate_rad_s - own.state.turn_rate_rad_s) / turn_max;
            (off * off + self.speed * faster * faster + self.turn * turned * turned, command)
        };
        let mut all: Vec<(f64, Command)> = if own.circling_in.is_some() {
            let desired_m_s = desired.speed_m_s;
            let escapes = [1.0, -1.0].map(|sense| own.escape_command(limits, sense).turn_rate_rad_s);
            let commands =
                turns.chain(escapes).map(|turn_rate_rad_s| Command { speed_m_s: desired_m_s, turn_rate_rad_s });
            let kept = |(cost, command)| (cost, Command { speed_m_s: own.state.speed_m_s, ..command });
            commands.map(with_cost).map(kept).collect()
        } else {
            let commands = turns.flat_map(|turn_rate_rad_s| {
                let speeds = (-SPEEDS..=SPEEDS).map(|step| nominal_m_s + change_max * share(step, SPEEDS));
                speeds.chain([desired.speed_m_s]).map(move |speed_m_s| Command { speed_m_s, turn_rate_rad_s })
            });
            commands.map(with_cost).collect()
        };
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}
