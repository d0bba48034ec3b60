//! Who watches what: groups, their members and orbits, and the UAVs that serve them.

pub mod assignment;
pub mod clustering;
pub mod event;
pub mod group;
pub mod handoff;
pub mod membership;
mod need;
mod roster;

pub(crate) use roster::Roster;
