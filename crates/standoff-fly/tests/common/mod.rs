//! Shared parts of the tests.

pub(crate) mod flight;
pub(crate) mod plane;
