//! Errors of a reproduction.

use std::fmt::Display;

use standoff_sim::scenario::ScenarioError;

/// Error of a reproduction.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A scenario or a traffic file cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A run failed, or the results could not be written.
    #[error("{0}")]
    Running(String),
}

impl Failure {
    pub(crate) fn running(error: impl Display) -> Self {
        Self::Running(error.to_string())
    }
}
