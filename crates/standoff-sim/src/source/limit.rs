//! What the text of a file may cost, so that none, however made, takes the machine.

/// Largest text, unpacked where it is gzip, bytes: an hour of a city's traffic has 300 MB, a large city's net 400 MB.
pub const MAX_TEXT: u64 = 512 << 20;

/// Longest XML element or CSV row, and most blanks at one place, bytes: an element of SUMO has some 150.
pub const MAX_PIECE: usize = 1 << 20;

/// Deepest nesting of elements: SUMO's own files are three deep, and the XML reader remembers the name of every element
/// that is open.
pub const MAX_DEPTH: usize = 50;

/// Gzip that unpacks to more than [`DENSE_TEXT`] bytes may not do so to more than this many times its own size: traffic
/// comes to 3 to 12 times, nothing at all (zeros, blanks) to 1,000 times. Who means it can unpack the file first.
pub(super) const MAX_RATIO: u64 = 100;

/// What gzip may unpack to at any ratio, bytes: a few vehicles that stand for an hour are very dense.
pub(super) const DENSE_TEXT: u64 = 16 << 20;

/// How much gzip may be read for nothing, bytes: members that are empty.
pub(super) const MAX_IDLE: u64 = 1 << 20;

/// The most that gzip can unpack to, in times of its size: what claims more is no size but damage.
pub(super) const DEFLATE_RATIO: u64 = 1032;
