//! Scenarios, missions and rows for the tests of this crate and of the crates that build on it.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    reason = "a module shared by test binaries"
)]

use std::path::Path;

use standoff_sim::record::{
    Frame, GroupRow, Manifest, MembershipState, TrackRow, TrackStatus, TruthRow, UavRow, Writer,
};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Overrides, Scenario, Settings};
use standoff_sim::score::{MetricSelection, Metrics, ScoreConfig, Scorer};
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

/// Scoring configuration of the paper's pair.
pub fn score_config() -> ScoreConfig {
    ScoreConfig::of(&load("paper/table-2-pair", &[], 1).settings)
}

/// All metrics of these frames.
pub fn score<'a>(config: &ScoreConfig, frames: impl IntoIterator<Item = &'a Frame>) -> Metrics {
    let mut scorer = Scorer::new(config.clone(), MetricSelection::ALL);
    frames.into_iter().for_each(|frame| scorer.frame(frame));
    scorer.metrics()
}

/// A UAV at the origin that looks east, in group 0.
pub fn uav_row(uav: u32) -> UavRow {
    let (speed_m_s, speed_command_m_s) = (40.0, 40.0);
    UavRow { uav, group: Some(0), boresight_rad: Some(0.0), speed_m_s, speed_command_m_s, ..UavRow::default() }
}

/// A stationary target.
pub fn truth_row(target: u32, x_m: f64, y_m: f64) -> TruthRow {
    TruthRow { target, x_m, y_m, ..TruthRow::default() }
}

/// A track at the origin, measured in this time step.
pub fn track_row(target: u32, group: Option<u32>) -> TrackRow {
    let membership = if group.is_some() { MembershipState::Member } else { MembershipState::Ungrouped };
    TrackRow { target, track: target, status: TrackStatus::Updated, membership, group, ..TrackRow::default() }
}

/// A group centred on the origin, with a feasible orbit of 300 m.
pub fn group_row(group: u32) -> GroupRow {
    let (standoff_unclamped_m, standoff_distance_m) = (300.0, 300.0);
    GroupRow { group, members: 1, standoff_unclamped_m, standoff_distance_m, feasible: true, ..GroupRow::default() }
}
