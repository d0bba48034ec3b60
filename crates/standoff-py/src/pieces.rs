//! The library's pieces by name, on NumPy arrays: each function names its arguments' shapes, works out row by row what
//! the library says, and nothing else.

pub(crate) mod array;
mod filter;
mod groups;
mod guidance;
mod parameters;
mod sensor;

pub(crate) use filter::Filter;
pub(crate) use groups::{assignment, clustering, group_count, smallest_circle};
pub(crate) use guidance::{StandoffDistance, Steering, led_distance, standoff_distance, steer, vector_field};
pub(crate) use parameters::Parameters;
pub(crate) use sensor::{best_separation_rad, information_1_m2, measure, pair_information_1_m4, wrapped_angle_rad};
