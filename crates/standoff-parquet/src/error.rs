//! Why a file is not read; and panics that are caught.

use std::cell::Cell;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};

use parquet::errors::{ParquetError, Result as ParquetResult};

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error(transparent)]
    System(io::Error),
    /// The file does not hold what it should. The library's words may repeat what it found.
    #[error("{0}")]
    Damaged(String),
    /// The file may be as good as any, but is written in a way that is not read here.
    #[error("{0}")]
    Foreign(String),
}

impl From<io::Error> for Error {
    /// Where a file breaks off, or says that it has more than any file, the disk is not to blame.
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
                Err(other) => Self::Damaged(ParquetError::External(other).to_string()),
            },
            other => Self::Damaged(other.to_string()),
        }
    }
}

thread_local! {
    static EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// A panic of this thread would be caught here, and told as damage of a file. For a program's own panic hook: nobody need
/// hear of such a panic. This crate does not touch the hook.
pub fn panic_is_expected() -> bool {
    EXPECTED.get()
}

/// Runs the library of Parquet on bytes of which nobody knows where they have been: it panics on some
/// damaged files (60.1: a dictionary page that is missing, for one) where an error is due.
pub fn guarded<T>(read: impl FnOnce() -> ParquetResult<T>) -> Result<T, Error> {
    EXPECTED.set(true);
    // What a panic leaves half done is not used again: the error ends the reading.
    let done = catch_unwind(AssertUnwindSafe(read));
    EXPECTED.set(false);
    Ok(done.map_err(|_| Error::Damaged("its bytes cannot be decoded".to_owned()))??)
}
