//! What can go wrong with a batch of runs, told to the person who runs standoff.

use std::fmt::Display;
use std::io;

use crate::record::RecordError;
use crate::scenario::ScenarioError;

/// The format of the journals and results that this version writes and reads.
pub(super) const FORMAT: u64 = 1;

/// Why a batch was not flown, completed, merged or compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MonteCarloError {
    /// What was asked for, or what a file says was flown, is no batch.
    #[error("{0}")]
    Batch(String),
    /// A folder holds something else than is needed, or nothing.
    #[error("{0}")]
    Folder(String),
    /// The scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// One seed cannot be flown.
    #[error("seed {seed}: {problem}")]
    Seed {
        /// The seed.
        seed: u64,
        /// What is wrong with it.
        problem: String,
    },
    /// So many threads cannot be started.
    #[error("cannot start {threads} threads: {reason}; ask for fewer with --threads, or allow more (ulimit -u)")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The system's reason.
        reason: io::Error,
    },
    /// The batch was stopped from outside.
    #[error("interrupted")]
    Interrupted,
    /// A file cannot be written or read, or is not what it should be.
    #[error(transparent)]
    File(#[from] RecordError),
    /// A score is NaN or infinite.
    #[error("seed {seed}: {metric} is not finite; this is a fault of the program, please report it")]
    NotFinite {
        /// The seed.
        seed: u64,
        /// The metric.
        metric: String,
    },
    /// Folders that do not make a batch together.
    #[error("cannot merge: {0}")]
    NotMergeable(String),
    /// Batches that cannot be compared.
    #[error("cannot compare: {0}")]
    NotComparable(String),
}

impl MonteCarloError {
    pub(super) fn seed(seed: u64, problem: impl Display) -> Self {
        Self::Seed { seed, problem: problem.to_string() }
    }

    /// What was asked for is wrong; otherwise something failed on the way.
    pub fn is_wrong_input(&self) -> bool {
        match self {
            Self::Interrupted | Self::NotFinite { .. } | Self::Threads { .. } => false,
            Self::File(error) => error.is_wrong_input(),
            _ => true,
        }
    }
}
