//! Scenarios and missions for the tests of this crate and of the crates that build on it.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    reason = "a module shared by test binaries"
)]

use std::path::Path;

use standoff_record::{Frame, Manifest, Writer};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Overrides, Scenario, Settings};
use standoff_sim::world::World;

/// Overrides of these keys, each as `key=value`.
pub fn overrides(set: &[&str]) -> Overrides {
    Overrides { set: set.iter().map(|key| (*key).to_owned()).collect(), ..Overrides::default() }
}

/// A built-in scenario with these overrides.
pub fn load(name: &str, set: &[&str], seed: u64) -> Scenario {
    Scenario::load(name, &overrides(set), seed).unwrap()
}

/// All frames of a mission.
pub fn frames(scenario: &Scenario) -> Vec<Frame> {
    let mut mission = Mission::new(scenario).unwrap();
    std::iter::from_fn(|| mission.frame().cloned()).collect()
}

/// Writer of an empty record of a mission.
pub fn writer(dir: &Path, scenario: &Scenario) -> Writer {
    let Settings { duration, period, .. } = &scenario.settings;
    let manifest = Manifest::new(&scenario.name, scenario.seed, duration.s(), period.s());
    Writer::create(dir, &manifest, &scenario.resolved().unwrap(), &World::names(scenario)).unwrap()
}
