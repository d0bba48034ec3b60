//! Coordination of the team: the groups of targets, their members and orbits, and the UAVs that are assigned to them.

pub mod assignment;
pub mod clustering;
pub(crate) mod desired_centre;
pub mod dwell;
pub mod event;
pub mod group;
pub mod group_centre;
pub(crate) mod grouping;
pub mod lost_target_search;
pub mod memberships;
pub(crate) mod reported_places;
mod required_orbit;
mod spread;
pub mod teammate;
