//! What ARCHITECTURE.md says of the source, held against the source.

mod circles;
mod code;
mod names;

use std::fs;
use std::path::{Path, PathBuf};

use code::Code;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every crate of the project, and this one.
fn source() -> Code {
    let crates = fs::read_dir(root().join("crates")).expect("there are crates");
    let crates = crates.map(|entry| Path::new("crates").join(entry.expect("a folder can be read").file_name()));
    let mut folders: Vec<PathBuf> = crates.chain([PathBuf::from("xtask")]).collect();
    folders.sort();
    Code::read(&root(), &folders)
}
