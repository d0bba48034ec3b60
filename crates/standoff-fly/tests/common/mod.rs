//! Shared parts of the tests.

pub(crate) mod flight;
pub(crate) mod identified_aircraft;
pub(crate) mod live;
pub(crate) mod plane;
