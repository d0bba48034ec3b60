//! Simulator of standoff tracking: a scenario goes in, a record comes out; scores are computed from the record alone.
//!
//! ```text
//! scenario -> mission (world, sensors, radio, agents) -> frames -> record -> score
//! ```

mod audit;
pub mod brain;
mod computer;
pub mod disk;
pub mod draws;
mod frame;
#[cfg(test)]
mod fuzz;
pub mod geometry;
mod input;
mod intruders;
pub mod monte_carlo;
pub mod radio;
pub mod record;
mod rows;
pub mod run;
pub mod scenario;
pub mod score;
pub mod sensors;
pub mod source;
pub mod target_id;
pub mod text;
pub mod traffic;
mod why;
pub mod world;
pub mod yardstick;

pub use rows::{agent as rows_of_agent, picture as rows_of_picture};
