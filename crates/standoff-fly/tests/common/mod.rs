//! Shared parts of the tests.

pub(crate) mod flight;
pub(crate) mod live;
pub(crate) mod plane;
