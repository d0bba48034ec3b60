//! What a traffic file may cost, so that none, however made, takes the machine.
//!
//! A city's hour (650 vehicles, 3,600 time steps of 1 s, 130 bytes each) is 300 MB of FCD text and 2.3 million samples:
//! all of it fits, and a file that does not is refused with what it takes to cut it.

/// Largest text, unpacked where it is gzip, bytes.
pub const MAX_TEXT: u64 = 512 << 20;

/// Most samples (one vehicle at one time) in a file: of 32 bytes each, they take 160 MB.
pub const MAX_SAMPLES: usize = 5_000_000;

/// Most vehicles in a file: with names of any length they take 100 MB.
pub const MAX_VEHICLES: usize = 100_000;

/// Most vehicles at one time, as many as a scenario may have targets: at the start each is weighed against all others.
pub(crate) const MAX_AT_ONCE: usize = 5_000;

/// Longest XML element or CSV row, and most blanks at one place, bytes: an element of SUMO has some 150.
pub(super) const MAX_PIECE: usize = 1 << 20;

/// Deepest nesting of elements: SUMO's own files are three deep, and the XML reader remembers the name of every element
/// that is open.
pub(super) const MAX_DEPTH: usize = 50;

/// Gzip that unpacks to more than [`DENSE_TEXT`] bytes may not do so to more than this many times its own size: traffic
/// comes to 3 to 12 times, nothing at all (zeros, blanks) to 1,000 times. Who means it can unpack the file first.
pub(super) const MAX_RATIO: u64 = 100;

/// What gzip may unpack to at any ratio, bytes: a few vehicles that stand for an hour are very dense.
pub(super) const DENSE_TEXT: u64 = 16 << 20;

/// How much gzip may be read for nothing, bytes: members that are empty.
pub(super) const MAX_IDLE: u64 = 1 << 20;

/// The most that gzip can unpack to, in times of its size: what claims more is no size but damage.
pub(super) const DEFLATE_RATIO: u64 = 1032;

/// Fastest that a vehicle may be, by its speed or its positions, m/s: beyond, a position is wrong, or degrees and metres
/// are mixed.
pub(super) const MAX_SPEED_M_S: f64 = 1e4;
