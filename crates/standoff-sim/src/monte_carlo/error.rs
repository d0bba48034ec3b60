//! Errors of Monte Carlo batches, with messages for users.

use standoff_record::RecordError;
use std::fmt::Display;
use std::io;

use crate::scenario::ScenarioError;

/// Format of the journals and results that this version writes and reads.
pub(super) const FORMAT: u64 = 2;

/// Reason why a batch was not flown, completed, merged or compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MonteCarloError {
    /// The requested batch, or the one described in a file, is invalid.
    #[error("{0}")]
    Batch(String),
    /// A folder is missing or contains something other than required.
    #[error("{0}")]
    Folder(String),
    /// The scenario is invalid.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// One seed cannot be flown.
    #[error("seed {seed}: {problem}")]
    Seed {
        /// Seed of the run.
        seed: u64,
        /// Description of the problem.
        problem: String,
    },
    /// The threads cannot be started.
    #[error("cannot start {threads} threads: {reason}; use fewer with --threads, or raise the limit (ulimit -u)")]
    Threads {
        /// Requested number of threads.
        threads: usize,
        /// Reason given by the system.
        reason: io::Error,
    },
    /// The batch was interrupted.
    #[error("interrupted")]
    Interrupted,
    /// A file cannot be written or read, or has invalid contents.
    #[error(transparent)]
    File(#[from] RecordError),
    /// A score is NaN or infinite.
    #[error("seed {seed}: {metric} is not finite; this is a bug in standoff, please report it")]
    NotFinite {
        /// Seed of the run.
        seed: u64,
        /// Name of the metric.
        metric: String,
    },
    /// The folders do not form a batch.
    #[error("cannot merge: {0}")]
    NotMergeable(String),
    /// The batches cannot be compared.
    #[error("cannot compare: {0}")]
    NotComparable(String),
}

impl MonteCarloError {
    pub(super) fn seed(seed: u64, problem: impl Display) -> Self {
        Self::Seed { seed, problem: problem.to_string() }
    }

    /// True if the user's input is wrong, false if an operation failed.
    pub fn is_wrong_input(&self) -> bool {
        match self {
            Self::Interrupted | Self::NotFinite { .. } | Self::Threads { .. } => false,
            Self::File(error) => error.is_wrong_input(),
            _ => true,
        }
    }
}
