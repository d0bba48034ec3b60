//! Fuzz tests of the parsers: `bolero` targets, each of which is also an ordinary test. `scripts/fuzz` runs them for
//! longer; `docs/developer/hardening.md` lists the results.
//!
//! Each input is a corpus file with a few changes (see [`mutation`]), so that many inputs pass the first checks. An
//! accepted input must be in its documented range; a rejected input must produce an error message that is safe to print
//! in a terminal.

#![allow(dead_code, clippy::allow_attributes, reason = "shared by the fuzz targets of several crates")]

#[path = "mutation.rs"]
mod mutation;

use std::fmt::Display;
use std::panic::RefUnwindSafe;
use std::sync::atomic::{AtomicU64, Ordering};

pub(crate) use mutation::Choices;

/// Number of inputs in an ordinary test run; the environment variable `BOLERO_RANDOM_ITERATIONS` overrides it.
const ITERATIONS: usize = 1_000;

/// Runs a fuzz target. `try_one` builds an input from random choices, tries it and returns whether it was accepted. At
/// least the share `least_accepted` of the inputs must be accepted; otherwise the target would exercise only the first
/// checks.
pub(crate) fn run(target: &str, least_accepted: f64, try_one: impl Fn(&mut Choices<'_>) -> bool + RefUnwindSafe) {
    let (tried, accepted) = (AtomicU64::new(0), AtomicU64::new(0));
    bolero::check!().with_type::<[u8; 40]>().with_iterations(ITERATIONS).for_each(|bytes| {
        tried.fetch_add(1, Ordering::Relaxed);
        accepted.fetch_add(try_one(&mut Choices::new(bytes)).into(), Ordering::Relaxed);
    });
    let (tried, accepted) = (tried.into_inner(), accepted.into_inner());
    let share = accepted as f64 / tried as f64;
    println!("{target}: {tried} inputs, {:.1} % accepted", 100.0 * share);
    assert!(share >= least_accepted, "{target}: only {share} of the inputs were accepted");
}

/// Checks that an error message is printable: one line, at most 2,000 characters, no character that a terminal obeys.
#[track_caller]
pub(crate) fn check_message(message: &str) {
    assert!(!message.is_empty() && message.chars().count() <= 2000, "{} bytes: {message:?}", message.len());
    assert!(!message.contains(is_unsafe_to_print), "{message:?}");
}

/// Returns whether a terminal could obey the character or take it for a line end.
pub(crate) fn is_unsafe_to_print(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// Checks the error message of a rejected input; returns `false`.
#[track_caller]
pub(crate) fn refused(error: &impl Display) -> bool {
    check_message(&error.to_string());
    false
}

/// Tokens of the JSON of records and batches.
pub(crate) const JSON: [&str; 30] = [
    "{",
    "}",
    "[",
    "]",
    ":",
    ",",
    "null",
    "true",
    "\"format\": 1,",
    "\"format\": 2,",
    "\"format\": 3",
    "\"format\": 99,",
    "\"seed\"",
    "\"version\"",
    "\"runs\"",
    "\"duration_s\"",
    "\"period_s\"",
    "\"origin\": {\"latitude_deg\": 91, \"longitude_deg\": 0},",
    "\"shard\": {\"index\": 0, \"of\": 0},",
    "\"shard\": {\"index\": 1, \"of\": 2},",
    "\"metrics\": [],",
    "\"metrics\": [\"anees\", \"anees\"],",
    "\"nonsense\"",
    "\"extra\": 1,",
    "\"x\"",
    "1e400",
    "\\u0000",
    "\\u001b",
    "\\ud800",
    "[[[[[[[[",
];

/// Returns the contents of the files of a corpus, ordered by file name.
pub(crate) fn corpus(kind: &str) -> Vec<Vec<u8>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(kind);
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Replaces a file. The old file is removed first, because some file systems flush a file to disk if it is truncated
/// and written again, which would take longer than the rest of the test.
pub(crate) fn put(path: &std::path::Path, bytes: impl AsRef<[u8]>) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).unwrap();
}
