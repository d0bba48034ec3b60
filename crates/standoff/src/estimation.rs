//! State estimation: one information filter per target, which fuses the measurements of all UAVs.

pub mod group_centre;
pub mod information_filter;
pub mod track;
