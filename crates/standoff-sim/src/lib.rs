//! Simulator of standoff tracking: a scenario goes in, a record comes out; scores are computed from the record alone.
//!
//! ```text
//! scenario -> mission (world, sensors, radio, agents) -> frames -> record -> score
//! ```

// The module that tests share uses the same paths here as in the tests of other crates.
#[cfg(test)]
extern crate self as standoff_sim;

pub mod bank;
pub mod baseline;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
pub mod controller;
#[cfg(test)]
mod fuzz;
#[cfg(test)]
#[path = "../../standoff-io/fuzz/harness.rs"]
mod fuzz_harness;
pub mod gusts;
mod intruders;
pub mod monte_carlo;
pub mod navigation;
mod onboard_computer;
pub mod radio;
pub mod random;
pub mod run;
pub mod scenario;
pub mod sensors;
pub mod target_id;
pub mod traffic;
mod truth_rows;
pub mod wind;
pub mod world;

pub use standoff_record::agent_rows::{agent as rows_of_agent, team_state as rows_of_team_state};
