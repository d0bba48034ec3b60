//! Read errors, and catching of panics.

use std::cell::Cell;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};

use parquet::errors::{ParquetError, Result as ParquetResult};

/// Begin of the message for a compression that is not supported.
pub const COMPRESSION: &str = "its compression is ";

/// Error while reading a file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Error of the operating system.
    #[error(transparent)]
    System(io::Error),
    /// The content of the file is invalid. A message of the Parquet library may contain text from the file.
    #[error("{0}")]
    Damaged(String),
    /// The file may be valid, but uses a feature of the format that is not supported.
    #[error("{0}")]
    Foreign(String),
}

impl From<io::Error> for Error {
    /// A truncated file or an impossible offset is damage of the file, not an error of the operating system.
    fn from(reason: io::Error) -> Self {
        if reason.raw_os_error().is_some() && reason.kind() != io::ErrorKind::InvalidInput {
            return Self::System(reason);
        }
        Self::Damaged(reason.to_string())
    }
}

impl From<ParquetError> for Error {
    fn from(error: ParquetError) -> Self {
        match error {
            ParquetError::External(inner) => match inner.downcast::<io::Error>() {
                Ok(reason) => (*reason).into(),
                Err(other) => Self::Damaged(other.to_string()),
            },
            ParquetError::NYI(what) => Self::Foreign(what),
            ParquetError::General(what) => match what.strip_prefix("Disabled feature at compile time: ") {
                // The library names gzip after the crate that unpacks it.
                Some("flate2") => Self::Foreign(format!("{COMPRESSION}gzip")),
                Some(codec) => Self::Foreign(format!("{COMPRESSION}{codec}")),
                None => Self::Damaged(what),
            },
            ParquetError::EOF(what) => Self::Damaged(what),
            other => Self::Damaged(other.to_string()),
        }
    }
}

thread_local! {
    static EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// Returns true if a panic of this thread would be caught by [`guarded`] and reported as damage of a file. A program's
/// panic hook can use it to print nothing for such a panic. This crate does not change the hook.
pub fn panic_is_expected() -> bool {
    EXPECTED.get()
}

/// Runs the Parquet library and converts panics to errors. The library panics on some damaged files
/// where it should return an error (version 60.1: for example on a missing dictionary page).
pub fn guarded<T>(read: impl FnOnce() -> ParquetResult<T>) -> Result<T, Error> {
    EXPECTED.set(true);
    // State that a panic leaves inconsistent is not used again: the error ends the reading.
    let done = catch_unwind(AssertUnwindSafe(read));
    EXPECTED.set(false);
    Ok(done.map_err(|_| Error::Damaged("its bytes cannot be decoded".to_owned()))??)
}
