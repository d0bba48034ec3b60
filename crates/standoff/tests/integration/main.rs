//! Integration tests, in one program, which is built faster than one for each file.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod agent;
mod allocations;
mod attacks;
#[path = "../common/mod.rs"]
mod common;
mod companion;
mod faults;
mod filters;
mod groups;
mod hostile;
mod invariance;
mod log;
mod orbit;
mod presence;
#[cfg(unix)]
mod udp;
mod unlabelled;
