//! Guidance of a UAV: standoff distance, vector field onto the orbit, heading and turn rate, phase control.

pub mod followed;
pub mod heading;
pub mod inner_loop;
pub(crate) mod law;
pub(crate) mod laws;
pub(crate) mod moving_centre;
pub(crate) mod orbit_loop;
pub mod orbit_motion;
pub mod pair_information;
pub(crate) mod phase_control;
pub(crate) mod phase_control_in_wind;
pub(crate) mod sensor_pointing;
pub mod standoff_distance;
pub mod vector_field;
