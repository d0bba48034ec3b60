//! Who watches what: groups, their members and orbits, and the UAVs that serve them.

pub mod assignment;
pub mod clustering;
pub mod event;
pub mod group;
pub mod handoff;
pub mod memberships;
mod required_orbit;
pub mod search;
pub(crate) mod settling;
mod spread;
pub mod teammate;
pub(crate) mod wanted_centre;
