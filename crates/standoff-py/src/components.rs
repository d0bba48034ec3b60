//! Components of the library on NumPy arrays. Each function documents the shapes of its arguments and only calls the
//! library row by row.

pub(crate) mod array;
mod filter;
mod groups;
mod guidance;
mod parameters;
mod sensor;

pub(crate) use filter::Filter;
pub(crate) use groups::{assignment, clustering, enclosing_circle, group_count};
pub(crate) use guidance::{StandoffDistance, Steering, standoff_distance, steer, steered_radius, vector_field};
pub(crate) use parameters::Parameters;
pub(crate) use sensor::{
    information_1_m2, measure, optimal_phase_difference_rad, pair_information_1_m4, wrapped_angle_rad,
};
