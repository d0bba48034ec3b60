//! Components of the library on NumPy arrays. Each function documents the shapes of its arguments and only calls the
//! library row by row.

pub(crate) mod array;
mod filter;
mod guidance;

pub(crate) use filter::Filter;
pub(crate) use guidance::{StandoffDistance, Steering, standoff_distance, steer};
