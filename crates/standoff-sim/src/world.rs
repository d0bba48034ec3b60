//! Ground truth: the true state of every target. Only sensors, cues and the truth table of the record read it.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector6};
use standoff::target::Transition;
use standoff::{Position, TargetState, Time, Velocity};

use crate::random::{Draw, Draws, Stream};
use crate::scenario::{Manoeuvre, Scenario, Targets};
use crate::target_id::TargetId;
use crate::traffic::{Traffic, Vehicle};

/// True state of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Target id.
    pub target: TargetId,
    /// Position, velocity, and acceleration (zero where unknown).
    pub state: TargetState,
    /// True if the acceleration is known.
    pub has_known_acceleration: bool,
}

/// All targets of a mission and their motion.
pub struct World {
    kind: Kind,
    draws: Draws,
    tick: u64,
}

enum Kind {
    Random(Box<Random>),
    Traffic(Arc<Traffic>),
}

struct Random {
    states: Vec<TargetState>,
    transition: Transition,
    /// Factor that turns three standard normals into the process noise of one axis.
    noise_factor: Matrix3<f64>,
    manoeuvres: Vec<Manoeuvre>,
}

impl World {
    /// Creates the world at the start of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        let kind = match &scenario.targets {
            Targets::Random { model, start, manoeuvres } => {
                let transition = model.transition(scenario.settings.period);
                let noise_factor = transition.noise_factor();
                let (states, manoeuvres) = (start.clone(), manoeuvres.clone());
                Kind::Random(Box::new(Random { states, transition, noise_factor, manoeuvres }))
            }
            Targets::Traffic(traffic) => Kind::Traffic(Arc::clone(traffic)),
        };
        Self { kind, draws: Draws::new(scenario.seed), tick: 0 }
    }

    /// Replaces `truth` by the targets that exist at time `now`, by ascending id.
    pub fn truth(&self, now: Time, truth: &mut Vec<Truth>) {
        truth.clear();
        match &self.kind {
            Kind::Random(random) => {
                truth.extend(random.states.iter().zip(0..).map(|(state, id)| {
                    let target = TargetId(id);
                    let own = random.manoeuvres.iter().filter(|manoeuvre| TargetId(manoeuvre.target as u32) == target);
                    let state = own.fold(*state, |state, manoeuvre| manoeuvred(&state, manoeuvre, now.s()));
                    Truth { target, state, has_known_acceleration: true }
                }));
            }
            Kind::Traffic(traffic) => {
                let file_us = traffic.begin_us.saturating_add(now.us());
                let present = traffic.vehicles.iter().enumerate().filter_map(|(index, vehicle)| {
                    let at = vehicle.at(file_us)?;
                    let position = Position::from_m(at.x_m, at.y_m);
                    let velocity = Velocity::from_m_s(at.vx_m_s, at.vy_m_s);
                    let state = TargetState::new(position, velocity, [0.0, 0.0]);
                    Some(Truth { target: TargetId(index as u32), state, has_known_acceleration: false })
                });
                truth.extend(present);
            }
        }
    }

    /// Advances all targets by one period.
    pub fn step(&mut self) {
        self.tick += 1;
        let Kind::Random(random) = &mut self.kind else { return };
        let Random { states, transition, noise_factor, .. } = &mut **random;
        for (index, state) in states.iter_mut().enumerate() {
            *state =
                moved(state, transition, noise_factor, self.draws.at(Stream::TargetMotion, index as u64, self.tick));
        }
    }

    /// Returns the names of the targets by id: those of the traffic file, or `target-0`, `target-1`, ...
    pub fn names(scenario: &Scenario) -> Vec<String> {
        match &scenario.targets {
            Targets::Random { start, .. } => (0..start.len()).map(|number| format!("target-{number}")).collect(),
            Targets::Traffic(traffic) => traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect(),
        }
    }

    /// Maximum number of truth rows in the record of a whole mission.
    pub fn rows(scenario: &Scenario) -> u64 {
        let period_us = scenario.settings.period.us().max(1);
        let ticks = |span_us: i64| span_us.max(0).unsigned_abs() / period_us.unsigned_abs() + 1;
        let all = ticks(scenario.settings.duration.us());
        match &scenario.targets {
            Targets::Random { start, .. } => all.saturating_mul(start.len() as u64),
            Targets::Traffic(traffic) => {
                let rows_of = |vehicle: &Vehicle| all.min(ticks(vehicle.last_us() - vehicle.first_us()) + 1);
                traffic.vehicles.iter().map(rows_of).sum()
            }
        }
    }
}

/// Returns the state of a randomly moving target one period later (5). `noise_factor` turns three standard normals into
/// the process noise of one axis.
pub fn moved(state: &TargetState, transition: &Transition, noise_factor: &Matrix3<f64>, mut draw: Draw) -> TargetState {
    let [a, b, c, d, e, f] = draw.normals();
    let ([x, vx, ax], [y, vy, ay]) = (shaped(noise_factor, [a, b, c]), shaped(noise_factor, [d, e, f]));
    TargetState(transition.predict(state).0 + Vector6::new(x, vx, ax, y, vy, ay))
}

/// Multiplies a lower triangular matrix by three standard normals.
fn shaped(factor: &Matrix3<f64>, [a, b, c]: [f64; 3]) -> [f64; 3] {
    let l = |row, column| factor[(row, column)];
    [l(0, 0) * a, l(1, 0) * a + l(1, 1) * b, l(2, 0) * a + l(2, 1) * b + l(2, 2) * c]
}

/// Adds a manoeuvre to a state of the random motion: the integral of its acceleration up to `now_s`.
fn manoeuvred(state: &TargetState, manoeuvre: &Manoeuvre, now_s: f64) -> TargetState {
    let Manoeuvre { from_s, until_s, ax_m_s2: ax, ay_m_s2: ay, .. } = *manoeuvre;
    let lasted_s = (now_s.min(until_s) - from_s).max(0.0);
    let coasted_s = (now_s - until_s).max(0.0);
    let moved_s2 = lasted_s * (0.5 * lasted_s + coasted_s);
    let acts = f64::from(from_s <= now_s && now_s < until_s);
    let [x, vx, now_ax, y, vy, now_ay]: [f64; 6] = state.0.into();
    TargetState(
        [
            x + ax * moved_s2,
            vx + ax * lasted_s,
            now_ax + ax * acts,
            y + ay * moved_s2,
            vy + ay * lasted_s,
            now_ay + ay * acts,
        ]
        .into(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 m/s2 for 3 s give 9 m and 6 m/s at the end, and 33 m four seconds later.
    #[test]
    fn a_manoeuvre_adds_its_acceleration_while_it_lasts() {
        let manoeuvre = Manoeuvre { target: 0.0, from_s: 10.0, until_s: 13.0, ax_m_s2: 2.0, ay_m_s2: -2.0 };
        let at = |now_s| -> [f64; 6] { manoeuvred(&TargetState::default(), &manoeuvre, now_s).0.into() };
        assert_eq!(at(10.0), [0.0, 0.0, 2.0, 0.0, 0.0, -2.0]);
        assert_eq!(at(13.0), [9.0, 6.0, 0.0, -9.0, -6.0, 0.0]);
        assert_eq!(at(17.0), [33.0, 6.0, 0.0, -33.0, -6.0, 0.0]);
        assert_eq!(at(9.0), [0.0; 6]);
    }
}
