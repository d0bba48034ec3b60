//! What can go wrong with an MCAP file, told to the person who runs standoff.

use std::io;
use std::path::PathBuf;

/// Why an MCAP file cannot be written. The message is complete: it has no source to append.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum McapError {
    /// The name cannot be that of a file.
    #[error("{} does not name a file that could be made; give a name", path.display())]
    NoName {
        /// The name as given.
        path: PathBuf,
    },
    /// Something else lies where the file should go.
    #[error("{} is {what} and is left as it is; name another file", path.display())]
    Occupied {
        /// What is in the way.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// Another run is writing the same file.
    #[error("another run is writing {}; wait until it ends, or name another file", path.display())]
    InUse {
        /// The file as far as it is written.
        path: PathBuf,
    },
    /// The operating system, or MCAP itself, refused to write.
    #[error("cannot write {}: {reason}; check its folder, its permissions and the free space", path.display())]
    Write {
        /// What was to be written.
        path: PathBuf,
        /// The reason.
        reason: io::Error,
    },
    /// The file is complete but could not be moved to its place; it is kept where it is.
    #[error("the MCAP file is complete but stays in {}, move it yourself before the next run: {reason}", kept.display())]
    NotMoved {
        /// Where it lies.
        kept: PathBuf,
        /// Why it could not be moved.
        reason: io::Error,
    },
}
