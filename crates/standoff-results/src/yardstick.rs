//! What is told of a scenario's yardstick.

use serde::Serialize;
use standoff_sim::scenario::Scenario;
use standoff_sim::world::World;
use standoff_sim::yardstick::{Yardstick, yardstick};

/// A scenario, and what discs that know where its targets are would watch.
#[derive(Debug, Serialize)]
pub struct Yardsticked<'a> {
    /// Its name.
    pub scenario: &'a str,
    /// The seed that it was drawn with.
    pub seed: u64,
    /// How long it lasts, s.
    pub duration_s: f64,
    /// How many UAVs it has.
    pub uavs: usize,
    /// How many targets there are in all.
    pub targets: usize,
    /// What would be watched.
    pub yardstick: Yardstick,
}

impl<'a> Yardsticked<'a> {
    /// Measures it.
    pub fn of(scenario: &'a Scenario) -> Self {
        Self {
            scenario: &scenario.name,
            seed: scenario.seed,
            duration_s: scenario.settings.duration.s(),
            uavs: scenario.uavs.len(),
            targets: World::names(scenario).len(),
            yardstick: yardstick(scenario),
        }
    }

    /// One JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
