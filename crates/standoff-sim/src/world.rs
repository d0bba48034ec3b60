//! The truth: where every target really is. Only sensors, cues and the record's truth table see it.

use standoff::{Position, TargetId, TargetState, Time, Transition, Velocity};

use crate::draws::{Draws, Stream};
use crate::scenario::{Scenario, Targets};
use crate::traffic::Traffic;

/// A target as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Which target.
    pub target: TargetId,
    /// Position, velocity, and acceleration (zero where unknown).
    pub state: TargetState,
    /// The acceleration is known.
    pub knows_acceleration: bool,
}

/// All targets, over time.
pub struct World<'a> {
    kind: Kind<'a>,
    draws: Draws,
    tick: u64,
}

enum Kind<'a> {
    Random { states: Vec<TargetState>, transition: Transition },
    Traffic(&'a Traffic),
}

impl<'a> World<'a> {
    /// The world of a scenario at its start.
    pub fn new(scenario: &'a Scenario) -> Self {
        let kind = match &scenario.targets {
            Targets::Random { model, start } => {
                Kind::Random { states: start.clone(), transition: model.transition(scenario.settings.period) }
            }
            Targets::Traffic(traffic) => Kind::Traffic(traffic),
        };
        Self { kind, draws: Draws::new(scenario.seed), tick: 0 }
    }

    /// The targets that exist now, by ascending id.
    pub fn look(&self, now: Time, truth: &mut Vec<Truth>) {
        truth.clear();
        match &self.kind {
            Kind::Random { states, .. } => truth.extend(states.iter().enumerate().map(|(index, state)| Truth {
                target: TargetId(index as u32),
                state: *state,
                knows_acceleration: true,
            })),
            Kind::Traffic(traffic) => {
                let file_us = traffic.begin_us.saturating_add(now.us());
                let present = traffic.vehicles.iter().enumerate().filter_map(|(index, vehicle)| {
                    let at = vehicle.at(file_us)?;
                    let position = Position::from_m(at.x_m, at.y_m);
                    let velocity = Velocity::from_m_s(at.vx_m_s, at.vy_m_s);
                    let state = TargetState::new(position, velocity, [0.0, 0.0]);
                    Some(Truth { target: TargetId(index as u32), state, knows_acceleration: false })
                });
                truth.extend(present);
            }
        }
    }

    /// Moves on by one period.
    pub fn step(&mut self) {
        self.tick += 1;
        let Kind::Random { states, transition } = &mut self.kind else { return };
        let factor = transition.noise_factor();
        for (index, state) in states.iter_mut().enumerate() {
            let mut draw = self.draws.at(Stream::TargetMotion, index as u64, self.tick);
            let [a, b] = draw.normals();
            let [c, d] = draw.normals();
            let [e, f] = draw.normals();
            let moved = transition.predict(state);
            let noise = [[a, b, c], [d, e, f]];
            *state = TargetState(moved.0.map_with_location(|row, _, value| {
                let (axis, row) = (row / 3, row % 3);
                value + (0..=row).map(|column| factor[(row, column)] * noise[axis][column]).sum::<f64>()
            }));
        }
    }

    /// Targets' names by id: those of the file, or `target-1`, `target-2`, ...
    pub fn names(scenario: &Scenario) -> Vec<String> {
        match &scenario.targets {
            Targets::Random { start, .. } => (1..=start.len()).map(|number| format!("target-{number}")).collect(),
            Targets::Traffic(traffic) => traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect(),
        }
    }
}
