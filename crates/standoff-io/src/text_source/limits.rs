//! Limits on the text of a file, so that no file can exhaust the machine.

/// Maximum size of a text, unpacked if it is gzip, bytes: an hour of a city's traffic has 300 MB, the net of a large
/// city 400 MB.
pub const MAX_TEXT: u64 = 512 << 20;

/// Maximum length of an XML element, a CSV row, and a run of blanks, bytes: an element of SUMO has about 150.
pub const MAX_PIECE: usize = 1 << 20;

/// Maximum nesting depth of elements: SUMO's own files are three deep, and the XML reader stores the name of every open
/// element.
pub const MAX_DEPTH: usize = 50;
