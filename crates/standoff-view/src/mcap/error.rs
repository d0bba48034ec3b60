//! Errors of MCAP files, with messages for the user.

use std::io;
use std::path::PathBuf;

/// Reason why an MCAP file cannot be written. The message is complete; it has no source error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum McapError {
    /// The path has no file name.
    #[error("{} does not name a file; give a file name", path.display())]
    NoName {
        /// Path as given.
        path: PathBuf,
    },
    /// The path is occupied by something that must not be overwritten.
    #[error("{} is {what} and will not be overwritten; choose another file name", path.display())]
    Occupied {
        /// Occupied path.
        path: PathBuf,
        /// Description of what occupies it.
        what: &'static str,
    },
    /// Another run is writing the same file.
    #[error("another run is writing {}; wait until it ends, or choose another file name", path.display())]
    InUse {
        /// Partial file of the other run.
        path: PathBuf,
    },
    /// The operating system or the MCAP library failed to write.
    #[error("cannot write {}: {reason}; check its folder, its permissions and the free space", path.display())]
    Write {
        /// File that could not be written.
        path: PathBuf,
        /// Cause of the failure.
        reason: io::Error,
    },
    /// The file is complete but could not be renamed to its final name.
    #[error("the MCAP file is complete but stays in {}; move it before the next run: {reason}", kept.display())]
    NotMoved {
        /// Path of the complete file.
        kept: PathBuf,
        /// Cause of the failure.
        reason: io::Error,
    },
}
