//! What a traffic file may cost, so that none, however made, takes the machine.
//!
//! A city's hour (650 vehicles, 3,600 time steps of 1 s, 130 bytes each) is 300 MB of FCD text and 2.3 million samples:
//! all of it fits, and a file that does not is refused with what it takes to cut it.

/// Most samples (one vehicle at one time) in a file: of 32 bytes each, they take 160 MB.
pub const MAX_SAMPLES: usize = 5_000_000;

/// Most vehicles in a file: with names of any length they take 100 MB.
pub const MAX_VEHICLES: usize = 100_000;

/// Most vehicles at one time, as many as a scenario may have targets: at the start each is weighed against all others.
pub(crate) const MAX_AT_ONCE: usize = 5_000;

/// Fastest that a vehicle may be, by its speed or its positions, m/s: beyond, a position is wrong, or degrees and metres
/// are mixed.
pub(super) const MAX_SPEED_M_S: f64 = 1e4;
