//! Replay data of a run for the page: contents of the record and derived values, compact and in parts.
//!
//! A replay consists of a head ([`Head`], JSON) and numbered parts. A part contains consecutive time steps and has two
//! blocks that the page requests separately: the *overview* (the run as a whole, UAVs, groups, events), which the page
//! keeps completely, and the *detail* (targets), which it keeps only while it is shown. A [`Replay`] can grow while
//! pages follow it. A block is the gzip of:
//!
//! ```text
//! u32, little endian: length of the directory | the directory, JSON | the tables, one after the other
//! directory: {"times_us": [...], "events": [...], "tables": [{"name", "columns": [...], "ids": [...]}]}
//! ```
//!
//! With one agent per UAV, `tracks`, `groups` and `uavs` are those of the UAV of lowest id whose computer is on.
//! Overviews then also have the tables `agents` and `team-UAV`, events have `by`, and a part has a third block, its
//! *team states*: the tables `tracks-UAV` and `groups-UAV` of the other agents, described in `per_agent.rs`.
//!
//! If the sensors are not ideal, details also have the tables `detections`, `tentative` and `velocities`, described in
//! `detections.rs`.
//!
//! The directory of an overview also has `"bounds_m": [west, south, east, north]` of everything that its time steps
//! show: UAVs, orbits, and true and estimated positions of targets. It is absent if there is nothing to show.
//!
//! A table contains single-precision numbers, with NaN for missing values; `table.rs` describes their layout. SI units,
//! world frame (x east, y north), angles in radians anticlockwise from east, as in the record.

mod chunk;
mod detections;
mod encoder;
mod header;
#[cfg(feature = "server")]
mod live;
mod per_agent;
mod recorded;
mod table;
#[cfg(test)]
mod tests;

pub(crate) use chunk::gzip;
pub use encoder::{Encoder, Part};
pub use header::{FORMAT, Head, Line};
#[cfg(feature = "server")]
pub use live::Replay;
