//! Integration tests, in one program, which is built faster than one for each file.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod behind_autopilot;
#[path = "../common/mod.rs"]
mod common;
mod faults;
mod flight;
mod hostile;
mod identified_aircraft;
mod inner_loop;
mod real_time;
