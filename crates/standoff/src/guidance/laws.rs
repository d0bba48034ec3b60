//! The named guidance laws, each in a file.

pub(crate) mod oh_2015;
pub(crate) mod standoff;
