//! The command, its output and its files, for end-to-end tests.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    reason = "a module shared by test binaries"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// The command with these arguments in a folder.
pub fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_standoff"));
    command.current_dir(folder).args(args);
    command
}

/// Runs the command with these arguments in a folder.
pub fn standoff(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().unwrap()
}

/// Sends a signal to a process.
pub fn send_signal(signal: &str, process: u32) {
    let kill = format!("kill -{signal} {process}");
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Sorted names of the files in a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Returns whether two folders have the same files with the same bytes.
pub fn is_same(a: &Path, b: &Path) -> bool {
    names(a) == names(b)
        && names(a).iter().all(|name| fs::read(a.join(name)).unwrap() == fs::read(b.join(name)).unwrap())
}
