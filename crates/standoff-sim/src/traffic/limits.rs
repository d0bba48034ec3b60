//! Limits on a traffic file, so that no file can exhaust the machine.
//!
//! An hour of a city (650 vehicles, 3,600 time steps of 1 s, 130 bytes each) has 300 MB of FCD text and 2.3 million
//! samples, which is within the limits. A file beyond them is rejected with advice on how to split it.

/// Maximum number of samples (one vehicle at one time) in a file: at 32 bytes each, they take 160 MB.
pub const MAX_SAMPLES: usize = 5_000_000;

/// Maximum number of vehicles in a file: with names of the maximum length they take 100 MB.
pub const MAX_VEHICLES: usize = 100_000;

/// Maximum number of vehicles at one time, which is also the maximum number of targets of a scenario: as many as a team
/// tracks.
pub(crate) const MAX_AT_ONCE: usize = 16_384;

/// Maximum speed of a vehicle, by its speed value or its positions, m/s: above it, a position is wrong or degrees and
/// metres are mixed.
pub(super) const MAX_SPEED_M_S: f64 = 1e4;
