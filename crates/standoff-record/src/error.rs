//! Errors of records: messages for users with the location, the reason and a remedy.

use std::io;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;
use standoff_io::parquet_file::Error as Unreadable;
use standoff_io::{bounded_input, display_text};

/// Reason why a record cannot be written or read. The message is complete: there is no source to append.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The operating system refused to write.
    #[error(
        "cannot write {}: {reason}; {}",
        display_text::path(path),
        bounded_input::advice(reason, "check its folder, its permissions and the free space")
    )]
    Write {
        /// File that could not be written or moved.
        path: PathBuf,
        /// Reason given by the system.
        reason: io::Error,
    },
    /// The operating system refused to read.
    #[error(
        "cannot read {}: {reason}; {}",
        display_text::path(path),
        bounded_input::advice(reason, match bounded_input::is_input_error(reason) {
            true => "check that the record is complete, or run it again",
            false => "try again, and check the disk if the error recurs",
        })
    )]
    Read {
        /// File that could not be read.
        path: PathBuf,
        /// Reason given by the system.
        reason: io::Error,
    },
    /// A file of the record has invalid contents.
    #[error("{} is damaged: {what}; copy the record again, or run it again", display_text::path(path))]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// Description of the damage.
        what: String,
    },
    /// Another program saved a table again, in a form that is not supported.
    #[error(
        "{} cannot be read: {what}; save it again with the types that it had, plain or dictionary encoding, and \
         compressed by snappy or not at all (pandas: read_parquet(path, dtype_backend=\"pyarrow\") and \
         to_parquet(path, compression=\"snappy\"))",
        display_text::path(path)
    )]
    Foreign {
        /// Path of the table.
        path: PathBuf,
        /// Unsupported feature.
        what: String,
    },
    /// The record is unfinished and has no checkpoint.
    #[error(
        "{} is a run that ended before its first checkpoint; run the scenario.toml in it again",
        display_text::path(dir)
    )]
    NothingKept {
        /// Folder of the record.
        dir: PathBuf,
    },
    /// The folder contains no record.
    #[error(
        "{} is not a record: it contains no run.json; give a folder written by standoff run (standoff view also opens Monte Carlo results)",
        display_text::path(dir)
    )]
    NotARecord {
        /// Folder that was given.
        dir: PathBuf,
    },
    /// The record has a format that this program does not support.
    #[error(
        "{} has record format {format}, written by standoff {version}; this program reads format {known}: read it \
         with that version, or run the scenario.toml in the same folder again",
        display_text::path(path), version = display_text::printable(version)
    )]
    OtherFormat {
        /// Path of the manifest.
        path: PathBuf,
        /// Format of the record.
        format: u64,
        /// Format that this version writes and reads.
        known: u64,
        /// Version of standoff that wrote the record.
        version: String,
    },
    /// The destination contains something other than a standoff run.
    #[error(
        "{} contains something other than a run of standoff ({}) and is left unchanged; choose another folder",
        display_text::path(dir),
        display_text::printable(what)
    )]
    Occupied {
        /// Existing folder or file.
        dir: PathBuf,
        /// Name of the foreign contents.
        what: String,
    },
    /// The destination contains an older run that cannot be removed.
    #[error(
        "the run in {} could not be removed: {reason}; remove it if it is yours, or choose another folder",
        display_text::path(dir)
    )]
    NotRemovable {
        /// Folder of the older run.
        dir: PathBuf,
        /// Reason given by the system.
        reason: io::Error,
    },
    /// Another run is writing the same record.
    #[error("another run is writing {}; wait until it ends, or choose another folder", display_text::path(dir))]
    InUse {
        /// Temporary folder of the other run.
        dir: PathBuf,
    },
    /// The path has no valid folder name.
    #[error("{} is not the name of a new folder; give a name", display_text::path(dir))]
    NoName {
        /// Path as given.
        dir: PathBuf,
    },
    /// The name is too long for the suffix that standoff appends while it writes.
    #[error(
        "{} has a name of {bytes} bytes; at most {most}, because standoff appends a suffix while it writes: choose a shorter name",
        display_text::path(dir)
    )]
    LongName {
        /// Path as given.
        dir: PathBuf,
        /// Length of the name, bytes.
        bytes: usize,
        /// Maximum length, bytes.
        most: usize,
    },
    /// The name ends with a suffix that standoff reserves for unfinished or replaced runs.
    #[error(
        "{} ends with a suffix that standoff reserves for unfinished or replaced runs; choose another name",
        display_text::path(dir)
    )]
    Reserved {
        /// Path as given.
        dir: PathBuf,
    },
    /// The complete record could not be moved to its destination and stays in its temporary folder.
    #[error("the record is complete but stays in {}: {reason}", display_text::path(kept))]
    NotMoved {
        /// Folder of the complete record.
        kept: PathBuf,
        /// Reason why it could not be moved.
        reason: Box<RecordError>,
    },
    /// A number to be written is NaN or infinite.
    #[error("{table}.{column} is not finite at {time_s} s; this is a bug in standoff, please report it")]
    NotFinite {
        /// Name of the table.
        table: &'static str,
        /// Name of the column.
        column: String,
        /// Time since the start of the mission, s.
        time_s: f64,
    },
    /// An id or count to be written exceeds 31 bits.
    #[error("{table}.{column} is {value} at {time_s} s; a record stores at most {}", i32::MAX)]
    TooLarge {
        /// Name of the table.
        table: &'static str,
        /// Name of the column.
        column: String,
        /// Time since the start of the mission, s.
        time_s: f64,
        /// Value that is too large.
        value: u64,
    },
    /// The frames do not form a run.
    #[error("the frame at {time_s} s cannot be recorded: {what}")]
    BadFrame {
        /// Time since the start of the mission, s.
        time_s: f64,
        /// Description of the problem.
        what: String,
    },
}

impl RecordError {
    /// True if the user's input is wrong, false if an operation failed.
    #[must_use]
    pub fn is_wrong_input(&self) -> bool {
        match self {
            Self::Read { reason, .. } => bounded_input::is_input_error(reason),
            Self::Write { .. } | Self::InUse { .. } | Self::NotMoved { .. } | Self::NotFinite { .. } => false,
            _ => true,
        }
    }

    /// A file that could not be written.
    #[must_use]
    pub fn write(path: &Path, reason: io::Error) -> Self {
        Self::Write { path: path.to_owned(), reason }
    }

    /// A file that could not be read.
    #[must_use]
    pub fn read(path: &Path, reason: io::Error) -> Self {
        Self::Read { path: path.to_owned(), reason }
    }

    /// A file whose contents are wrong.
    #[must_use]
    pub fn damaged(path: &Path, what: impl Into<String>) -> Self {
        // Libraries quote input in their messages.
        let (path, what) = (path.to_owned(), display_text::printable(&what.into()));
        Self::Damaged { path, what }
    }

    /// Converts an error of the parquet crate while writing; returns the system's reason if there is one.
    pub(crate) fn parquet_write(path: &Path, error: ParquetError) -> Self {
        match Unreadable::from(error) {
            Unreadable::System(reason) => Self::write(path, reason),
            other => Self::write(path, io::Error::other(other.to_string())),
        }
    }

    /// Converts an error while reading a table.
    pub(crate) fn parquet_read(path: &Path, error: Unreadable) -> Self {
        match error {
            Unreadable::System(reason) => Self::read(path, reason),
            Unreadable::Damaged(what) => Self::damaged(path, what),
            Unreadable::Foreign(what) => Self::Foreign { path: path.to_owned(), what: display_text::printable(&what) },
        }
    }
}
