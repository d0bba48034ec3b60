//! What a file is read for.

/// What a file is read for: the words of messages.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// In a word.
    pub what: &'static str,
    /// With its article, if it has one.
    pub whole: &'static str,
    /// What it must be.
    pub formats: &'static str,
}
