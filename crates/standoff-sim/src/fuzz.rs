//! Fuzz targets (`bolero`) of the parsers; see [`crate::fuzz_harness`].

mod scenario;
mod traffic;
