//! Coordination of the team: the groups of targets, their members and orbits, and the UAVs that are assigned to them.

pub(crate) mod assignment;
pub(crate) mod clustering;
pub(crate) mod desired_centre;
pub(crate) mod dwell;
pub(crate) mod event;
pub(crate) mod group;
pub(crate) mod group_centre;
pub(crate) mod grouping;
pub(crate) mod lost_target_search;
pub(crate) mod memberships;
pub(crate) mod reported_places;
mod required_orbit;
mod spread;
pub(crate) mod teammate;
