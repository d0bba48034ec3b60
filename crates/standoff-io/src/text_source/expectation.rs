//! Expected contents of a file.

/// Expected contents of a file, as used in messages.
#[derive(Debug, Clone, Copy)]
pub struct Expectation {
    /// Name of the contents.
    pub description: &'static str,
    /// Accepted formats.
    pub formats: &'static str,
    /// True for maps, zones and buildings, false for tracks.
    pub is_map: bool,
}
