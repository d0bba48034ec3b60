//! Checks the statements of ARCHITECTURE.md against the source.

mod circles;
mod code;
mod names;

use std::fs;
use std::path::{Path, PathBuf};

use code::Code;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Parses all crates of the project, including this one.
fn source() -> Code {
    let crates = fs::read_dir(root().join("crates")).expect("the folder of crates can be read");
    let crates = crates.map(|entry| Path::new("crates").join(entry.expect("a folder can be read").file_name()));
    let mut folders: Vec<PathBuf> = crates.chain(["studies", "xtask"].map(PathBuf::from)).collect();
    folders.sort();
    Code::read(&root(), &folders)
}
