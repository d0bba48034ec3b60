//! Guidance of a UAV: standoff distance, vector field onto the orbit, heading and turn rate, phase control.

pub(crate) mod followed;
pub(crate) mod heading;
pub(crate) mod inner_loop;
pub(crate) mod law;
pub(crate) mod laws;
pub(crate) mod moving_centre;
pub(crate) mod orbit_loop;
pub(crate) mod orbit_motion;
pub(crate) mod pair_information;
pub(crate) mod phase_control;
pub(crate) mod phase_control_in_wind;
pub(crate) mod sensor_pointing;
pub(crate) mod standoff_distance;
pub(crate) mod vector_field;
