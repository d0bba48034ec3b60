//! What is wrong with a map, for people.

use standoff_sim::source::{Fault, Position};
use standoff_sim::text;

/// Why a map cannot be used; prints as one line, `FILE:LINE:COLUMN: what is wrong; what is allowed; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {message}", text::escaped(file), position.map(|at| format!(":{at}")).unwrap_or_default())]
pub struct MapError {
    /// The file, as the caller named it.
    pub file: String,
    /// Where in the (unpacked) text; `None` if the fault is of the file as a whole.
    pub position: Option<Position>,
    /// What is wrong, without the place.
    pub message: String,
    /// What was named is all right, as far as is known: the machine failed to read it.
    pub is_machine_s: bool,
}

/// A fault of the file of that name.
pub(crate) fn named(file: &str) -> impl FnOnce(Fault) -> MapError {
    move |fault| {
        let Fault { position, message, is_machine_s } = fault;
        MapError { file: file.to_owned(), position, message, is_machine_s }
    }
}
