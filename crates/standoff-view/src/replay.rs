//! A run as the page replays it: what the record holds and what is worked out from it, small and in parts.
//!
//! A replay is a head ([`Head`], JSON) and numbered parts, each of consecutive instants and each of two halves that are
//! asked for separately: the *overview* (the run as a whole, UAVs, groups, events), of which the page keeps all, and the
//! *detail* (targets), of which it keeps what it shows. A [`Replay`] is one that grows while pages watch it. A half is gzip of:
//!
//! ```text
//! u32, little endian: length of the directory | the directory, JSON | the tables, one after the other
//! directory: {"times_us": [...], "events": [...], "tables": [{"name", "columns": [...], "ids": [...]}]}
//! ```
//!
//! Where minds are several, `tracks`, `groups` and `uavs` are of the UAV of lowest id whose computer is on; overviews have
//! tables `minds` and `team-UAV`, too, events have `by`, and a part has a third half, its *pictures*: tables `tracks-UAV` and
//! `groups-UAV` of the other minds, which `minds.rs` tells.
//!
//! An overview's directory has `"bounds_m": [west, south, east, north]`, too, of all that its instants show: UAVs, orbits,
//! and where targets are and are thought to be; it is absent where there is nothing.
//! A table holds single-precision numbers, NaN for what there is not; `table.rs` tells how they lie. SI units, world
//! frame (x east, y north), angles in radians anticlockwise from east, as in the record.

mod encoder;
mod growing;
mod head;
mod minds;
mod part;
mod table;
#[cfg(test)]
mod tests;

pub use encoder::{Encoder, Part};
pub use growing::Replay;
pub use head::{FORMAT, Head, Line};
pub(crate) use part::gzip;
