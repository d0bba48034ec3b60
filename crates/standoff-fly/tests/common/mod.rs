//! Shared parts of the tests.

pub(crate) mod flight;
pub(crate) mod former_loop;
pub(crate) mod identified_aircraft;
pub(crate) mod live;
pub(crate) mod margins;
pub(crate) mod offline_flight;
pub(crate) mod plane;
