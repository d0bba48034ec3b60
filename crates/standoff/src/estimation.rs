//! Where the targets are: one information filter per target, fed by every UAV's measurements.

pub mod group_centre;
pub mod information_filter;
pub mod track;
