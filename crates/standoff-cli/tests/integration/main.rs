//! Integration tests, in one program, which is built faster than one for each file.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[cfg(unix)]
mod book;
mod command;
#[path = "../common/mod.rs"]
mod common;
#[cfg(unix)]
mod hostile;
#[cfg(unix)]
mod interruptions;
mod maps;
mod monte_carlo;
mod reproduce;
#[cfg(target_os = "linux")]
mod scarce;
mod sweep;
mod view;
