//! Limits on the text of a file, so that no file can exhaust the machine.

/// Maximum size of a text, unpacked if it is gzip, bytes: an hour of a city's traffic has 300 MB, the net of a large
/// city 400 MB.
pub const MAX_TEXT: u64 = 512 << 20;

/// Maximum length of an XML element, a CSV row, and a run of blanks, bytes: an element of SUMO has about 150.
pub const MAX_PIECE: usize = 1 << 20;

/// Maximum nesting depth of elements: SUMO's own files are three deep, and the XML reader stores the name of every open
/// element.
pub const MAX_DEPTH: usize = 50;

/// Maximum ratio of unpacked to packed size, for gzip that unpacks to more than [`DENSE_TEXT`] bytes: traffic has
/// ratios of 3 to 12, empty content (zeros, blanks) up to 1,000. If a higher ratio is intended, the user can unpack the
/// file first.
pub(super) const MAX_RATIO: u64 = 100;

/// Unpacked size up to which any ratio is allowed, bytes: a few vehicles that stand still for an hour are very dense.
pub(super) const DENSE_TEXT: u64 = 16 << 20;

/// Maximum size of gzip data that yield no output, bytes: empty members.
pub(super) const MAX_IDLE: u64 = 1 << 20;

/// Maximum ratio that the gzip format allows: a stated size above it is damaged.
pub(super) const DEFLATE_RATIO: u64 = 1032;
