//! What can go wrong with a record, told to the person who runs standoff: where, what, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;
use standoff_parquet::Error as Unreadable;

use crate::{input, text};

/// Why a record cannot be written or read. The message is complete: it has no source to append.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The operating system refused to write.
    #[error(
        "cannot write {}: {reason}; {}",
        text::path(path),
        input::advice(reason, "check its folder, its permissions and the free space")
    )]
    Write {
        /// What was to be written or moved.
        path: PathBuf,
        /// The system's reason.
        reason: io::Error,
    },
    /// The operating system refused to read.
    #[error(
        "cannot read {}: {reason}; {}",
        text::path(path),
        input::advice(reason, match input::is_wrong(reason) {
            true => "check that the record is complete, or run it again",
            false => "try again, and check the disk if it comes back",
        })
    )]
    Read {
        /// What was to be read.
        path: PathBuf,
        /// The system's reason.
        reason: io::Error,
    },
    /// A file of the record does not hold what it should.
    #[error("{} is damaged: {what}; copy the record again, or run it again", text::path(path))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// Another program wrote a table again, in a way that is not read here.
    #[error(
        "{} cannot be read: {what}; save it again with the types that it had, plain or dictionary encoding, and \
         compressed by snappy or not at all (pandas: read_parquet(path, dtype_backend=\"pyarrow\") and \
         to_parquet(path, compression=\"snappy\"))",
        text::path(path)
    )]
    Foreign {
        /// The table.
        path: PathBuf,
        /// What is not read.
        what: String,
    },
    /// The record is unfinished, and nothing in it can be read yet.
    #[error("{} is a run that was ended before any of it was kept; fly the scenario.toml in it again", text::path(dir))]
    NothingKept {
        /// The folder.
        dir: PathBuf,
    },
    /// The folder holds no record.
    #[error(
        "{} is not a record: it holds no run.json; name a folder that standoff run wrote (standoff view opens those of many runs)",
        text::path(dir)
    )]
    NotARecord {
        /// The folder.
        dir: PathBuf,
    },
    /// The record is of another format than this program knows.
    #[error(
        "{} has record format {format}, written by standoff {version}; this program reads format {known}: read it \
         with that version, or fly the scenario.toml beside it again",
        text::path(path), version = text::words(version)
    )]
    OtherFormat {
        /// The manifest.
        path: PathBuf,
        /// The record's format.
        format: u64,
        /// The format that this version writes and reads.
        known: u64,
        /// The version of standoff that wrote it.
        version: String,
    },
    /// Something that is not a run of ours lies where the record should go.
    #[error(
        "{} holds something other than a run of standoff ({}) and is left as it is; name another folder",
        text::path(dir),
        text::words(what)
    )]
    Occupied {
        /// The folder or file in the way.
        dir: PathBuf,
        /// What in it is not a run's.
        what: String,
    },
    /// An older run lies where the record should go, and cannot be removed.
    #[error(
        "the run in {} could not be removed to make room: {reason}; remove it if it is yours, or name another folder",
        text::path(dir)
    )]
    NotRemovable {
        /// The older run.
        dir: PathBuf,
        /// The system's reason.
        reason: io::Error,
    },
    /// Another run is writing the same record.
    #[error("another run is writing {}; wait until it ends, or name another folder", text::path(dir))]
    InUse {
        /// The partial folder of the other run.
        dir: PathBuf,
    },
    /// The name cannot be that of a record's folder.
    #[error("{} does not name a folder that could be made; give a name", text::path(dir))]
    NoName {
        /// The name as given.
        dir: PathBuf,
    },
    /// The name leaves no room for what standoff adds to it.
    #[error(
        "{} has a name of {bytes} bytes; at most {most}, because standoff adds to it while it writes: name another folder",
        text::path(dir)
    )]
    LongName {
        /// The name as given.
        dir: PathBuf,
        /// Its length.
        bytes: usize,
        /// The greatest length.
        most: usize,
    },
    /// The name is one that standoff gives to runs that are not whole yet, or are being replaced.
    #[error(
        "{} has a name that standoff gives itself, to what is unfinished or being replaced; name another folder",
        text::path(dir)
    )]
    Reserved {
        /// The name as given.
        dir: PathBuf,
    },
    /// The record was completed but could not be moved to its place; it is kept where it is.
    #[error("the record is complete but stays in {}: {reason}", text::path(kept))]
    NotMoved {
        /// Where the complete record lies.
        kept: PathBuf,
        /// Why it could not be moved.
        reason: Box<RecordError>,
    },
    /// A number to be written is NaN or infinite.
    #[error("{table}.{column} is not finite at {time_s} s; this is a fault of the run, please report it")]
    NotFinite {
        /// The table.
        table: &'static str,
        /// The column.
        column: String,
        /// Time since the start of the mission, s.
        time_s: f64,
    },
    /// An id or count to be written exceeds the 31 bits that the record has for it.
    #[error("{table}.{column} is {value} at {time_s} s; a record holds at most {}", i32::MAX)]
    TooLarge {
        /// The table.
        table: &'static str,
        /// The column.
        column: String,
        /// Time since the start of the mission, s.
        time_s: f64,
        /// The number.
        value: u64,
    },
    /// The frames do not make a run.
    #[error("the frame at {time_s} s cannot be recorded: {what}")]
    BadFrame {
        /// Time since the start of the mission, s.
        time_s: f64,
        /// What is wrong with it.
        what: String,
    },
}

impl RecordError {
    /// What was named is not what it should be; otherwise something failed on the way.
    #[must_use]
    pub fn is_wrong_input(&self) -> bool {
        match self {
            Self::Read { reason, .. } => input::is_wrong(reason),
            Self::Write { .. } | Self::InUse { .. } | Self::NotMoved { .. } | Self::NotFinite { .. } => false,
            _ => true,
        }
    }

    pub(crate) fn write(path: &Path, reason: io::Error) -> Self {
        Self::Write { path: path.to_owned(), reason }
    }

    pub(crate) fn read(path: &Path, reason: io::Error) -> Self {
        Self::Read { path: path.to_owned(), reason }
    }

    pub(crate) fn damaged(path: &Path, what: impl Into<String>) -> Self {
        // Libraries repeat what they find.
        let (path, what) = (path.to_owned(), text::words(&what.into()));
        Self::Damaged { path, what }
    }

    /// Of the parquet crate while writing: the system's reason where there is one.
    pub(super) fn parquet_write(path: &Path, error: ParquetError) -> Self {
        match Unreadable::from(error) {
            Unreadable::System(reason) => Self::write(path, reason),
            other => Self::write(path, io::Error::other(other.to_string())),
        }
    }

    /// While reading a table.
    pub(super) fn parquet_read(path: &Path, error: Unreadable) -> Self {
        match error {
            Unreadable::System(reason) => Self::read(path, reason),
            Unreadable::Damaged(what) => Self::damaged(path, what),
            Unreadable::Foreign(what) => Self::Foreign { path: path.to_owned(), what: text::words(&what) },
        }
    }
}
