//! What can go wrong with a batch of runs, told to the person who runs standoff.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

use super::shard::Shard;
use crate::record::RecordError;
use crate::scenario::ScenarioError;
use crate::text;

/// The format of the journals and results that this version writes and reads.
pub(super) const FORMAT: u64 = 1;

/// Why a batch was not flown, completed, merged or compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MonteCarloError {
    /// Nothing to fly.
    #[error("the number of runs is 0; must be at least 1")]
    NoRuns,
    /// A seed would leave its range.
    #[error(
        "seed {seed} and {runs} runs: the last seed must be at most {}; take a smaller seed or fewer runs",
        i64::MAX
    )]
    SeedTooLarge {
        /// The first seed.
        seed: u64,
        /// Number of runs.
        runs: u64,
    },
    /// More runs than a batch can have.
    #[error("{runs} runs are too many: at most {most} in a batch; fly fewer, or several batches with other seeds")]
    TooManyRuns {
        /// Number of runs.
        runs: u64,
        /// The largest number.
        most: u64,
    },
    /// The traffic is not what the runs were flown over.
    #[error(
        "the traffic of {} is another one than these runs were flown over; name the right file with --traffic",
        text::words(scenario)
    )]
    OtherTraffic {
        /// The scenario.
        scenario: String,
    },
    /// The shard is none of its batch's.
    #[error("shard {shard} of {runs} runs: must be I/N, I from 0 to N - 1, with at least one run for each of N shards")]
    NoSuchShard {
        /// The shard.
        shard: Shard,
        /// Number of runs.
        runs: u64,
    },
    /// A name is no name.
    #[error("{0}")]
    Name(String),
    /// The metrics do not exist.
    #[error("metrics: {0}")]
    Metrics(String),
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
    /// The journal of a batch does not hold what it should.
    #[error("{} is damaged: {what}; remove it to fly all its runs again", text::path(path))]
    DamagedJournal {
        /// The journal.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// A journal or a result of another format than this program knows.
    #[error(
        "{} has format {format} of standoff {}, this one knows {FORMAT}; use that version",
        text::path(path),
        text::words(version)
    )]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u64,
        /// The version of standoff that wrote it.
        version: String,
    },
    /// A folder holds another batch.
    #[error("{} holds another batch: {difference}; name another folder, or remove that one", text::path(dir))]
    OtherBatch {
        /// The folder.
        dir: PathBuf,
        /// The first difference, in words.
        difference: String,
    },
    /// The runs that are there were flown by a program that flies otherwise.
    #[error(
        "{}: seed {seed}, flown again, comes out otherwise: the runs there are another build's; complete them with that \
         build, or name another folder",
        text::path(dir)
    )]
    OtherBuild {
        /// The folder.
        dir: PathBuf,
        /// The seed that was flown twice.
        seed: u64,
    },
    /// A score is NaN or infinite.
    #[error("seed {seed}: {metric} is not finite; this is a fault of the program, please report it")]
    NotFinite {
        /// The seed.
        seed: u64,
        /// The metric.
        metric: String,
    },
    /// A folder holds no results.
    #[error("{}: holds no results of standoff monte-carlo; name the folder of a batch", text::path(dir))]
    NoResults {
        /// The folder.
        dir: PathBuf,
    },
    /// A batch is not complete.
    #[error("{}: its batch is not complete; run its command again, it goes on from there", text::path(dir))]
    Unfinished {
        /// The folder.
        dir: PathBuf,
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
