//! Parsers against inputs that are nearly right: targets of `bolero`, each a test. `scripts/fuzz` runs them for longer,
//! `docs/hardening.md` says what they have shown.
//!
//! An input is made of a file of the corpus by a few changes (see [`mutation`]), so that many get past the first checks.
//! What is accepted must be in its documented range; what is refused must be so in a message fit for a terminal.

pub(crate) mod mutation;
mod scenario;
mod traffic;

use std::fmt::Display;
use std::panic::RefUnwindSafe;
use std::sync::atomic::{AtomicU64, Ordering};

use mutation::Choices;

/// Inputs of an ordinary test. `BOLERO_RANDOM_ITERATIONS` says otherwise.
const ITERATIONS: usize = 5_000;

/// Runs a target: `try_one` makes an input of choices, tries it, and tells whether it was accepted. At least this share
/// of the inputs must be, lest the target only tries the first checks again and again.
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

/// A message for people: on one line, not endless, nothing in it that a terminal obeys.
#[track_caller]
fn check_message(message: &str) {
    assert!(!message.is_empty() && message.chars().count() <= 2000, "{} bytes: {message:?}", message.len());
    assert!(!message.contains(upsets), "{message:?}");
}

/// A terminal may obey it, or take it for the end of a line.
fn upsets(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// An input was refused, in a message fit for people.
#[track_caller]
pub(crate) fn refused(error: &impl Display) -> bool {
    check_message(&error.to_string());
    false
}

/// Words of the JSON of records and batches.
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

/// The files of a corpus, by name.
pub(crate) fn corpus(kind: &str) -> Vec<Vec<u8>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(kind);
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Puts a file in place of another one. Some file systems see a file onto the disk that is emptied and written again:
/// that would take longer than all else.
pub(crate) fn put(path: &std::path::Path, bytes: impl AsRef<[u8]>) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).unwrap();
}
