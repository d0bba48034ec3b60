//! Errors of maps, with messages for users.

use standoff_io::display_text;
use standoff_io::text_source::{Fault, Position};

/// Reason why a map cannot be used. Prints as one line: `FILE:LINE:COLUMN: what is wrong; what is allowed; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {message}", display_text::escaped(file), position.map(|at| format!(":{at}")).unwrap_or_default())]
pub struct MapError {
    /// File name as given by the caller.
    pub file: String,
    /// Position in the (unpacked) text; `None` if the whole file is wrong.
    pub position: Option<Position>,
    /// Description of the problem, without the position.
    pub message: String,
    /// True if the machine failed to read the file, which itself may be valid.
    pub is_io_error: bool,
}

/// Converts a fault to an error of the file with this name.
pub(crate) fn named(file: &str) -> impl FnOnce(Fault) -> MapError {
    move |fault| {
        let Fault { position, message, is_io_error } = fault;
        MapError { file: file.to_owned(), position, message, is_io_error }
    }
}
