//! How a UAV flies: the standoff distance, the vector field onto the orbit, heading and turn rate, spacing on the orbit.

pub(crate) mod aim;
pub mod airspace;
pub(crate) mod alternatives;
pub(crate) mod borders;
pub(crate) mod course;
pub mod heading;
pub mod moving_centre;
pub mod orbit_motion;
pub mod pair_information;
pub(crate) mod pursuit;
pub mod separation;
pub mod spacing;
pub mod standoff_distance;
pub mod vector_field;
pub(crate) mod ways;
