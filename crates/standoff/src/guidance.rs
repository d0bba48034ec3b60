//! Guidance of a UAV: standoff distance, vector field onto the orbit, heading and turn rate, phase control.

pub mod avoidance;
pub(crate) mod command_candidates;
pub(crate) mod detour;
pub mod geofence;
pub(crate) mod geofence_safety;
pub mod heading;
pub mod moving_centre;
pub mod orbit_motion;
pub mod pair_information;
pub mod phase_control;
pub(crate) mod predicted_trajectory;
pub(crate) mod pursuer_model;
pub(crate) mod sensor_pointing;
pub mod standoff_distance;
pub mod vector_field;
