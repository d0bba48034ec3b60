//! Coverage baseline of a scenario, as it is reported.

use serde::Serialize;
use standoff_sim::baseline::{CoverageBaseline, baseline};
use standoff_sim::scenario::Scenario;
use standoff_sim::world::World;

/// Coverage baseline of a scenario: the coverage of discs with perfect knowledge of its targets.
#[derive(Debug, Serialize)]
pub struct BaselineReport<'a> {
    /// Name of the scenario.
    pub scenario: &'a str,
    /// Seed of the scenario's random values.
    pub seed: u64,
    /// Duration, s.
    pub duration_s: f64,
    /// Number of UAVs.
    pub uavs: usize,
    /// Total number of targets.
    pub targets: usize,
    /// The coverage baseline.
    pub baseline: CoverageBaseline,
}

impl<'a> BaselineReport<'a> {
    /// Computes the baseline of a scenario.
    pub fn of(scenario: &'a Scenario) -> Self {
        Self {
            scenario: &scenario.name,
            seed: scenario.seed,
            duration_s: scenario.settings.duration.s(),
            uavs: scenario.uavs.len(),
            targets: World::names(scenario).len(),
            baseline: baseline(scenario),
        }
    }

    /// Formats the baseline as one JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
