//! Why something could not be reproduced.

use std::fmt::Display;

use standoff_sim::scenario::ScenarioError;

/// Why something could not be reproduced.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A scenario that cannot be used, or traffic.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// It failed while running, or the results could not be written.
    #[error("{0}")]
    Running(String),
}

impl Failure {
    pub(crate) fn running(error: impl Display) -> Self {
        Self::Running(error.to_string())
    }
}
