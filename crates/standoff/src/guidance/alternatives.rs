//! Commands in the place of a wanted one, for laws that may not fly that.

use crate::uav::{Command, UavParams};

/// Turn rates on either side of straight on, and speeds on either side of the nominal one, that are tried.
const TURNS: i32 = 8;
const SPEEDS: i32 = 3;

/// What it costs to fly something else than is wanted, beside a change of the turn rate, of which as much as is possible costs 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Costs {
    /// As much change of the wanted speed as is possible.
    pub(crate) speed: f64,
    /// As much change of the turn rate that is flown.
    pub(crate) turn: f64,
}

impl Costs {
    /// All of a grid of turn rates and speeds, the wanted turn rate and the wanted speed with them, and what each costs: the
    /// cheapest first.
    pub(crate) fn alternatives(self, uav: &UavParams, flown_rad_s: f64, wanted: Command) -> Vec<(f64, Command)> {
        let UavParams {
            turn_rate_max_rad_s: turn_max, speed_m_s: nominal_m_s, speed_change_max_m_s: change_max, ..
        } = *uav;
        let share = |step: i32, steps: i32| f64::from(step) / f64::from(steps);
        let turns = (-TURNS..=TURNS).map(|step| turn_max * share(step, TURNS)).chain([wanted.turn_rate_rad_s]);
        let all = turns.flat_map(|turn_rate_rad_s| {
            let speeds = (-SPEEDS..=SPEEDS).map(|step| nominal_m_s + change_max * share(step, SPEEDS));
            speeds.chain([wanted.speed_m_s]).map(move |speed_m_s| {
                let off = (turn_rate_rad_s - wanted.turn_rate_rad_s) / turn_max;
                let faster = (speed_m_s - wanted.speed_m_s) / change_max.max(1e-9);
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
