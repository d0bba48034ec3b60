//! Repository maintenance: `cargo xtask ledger` writes docs/developer/ledger.md, `cargo xtask ledger --check` checks it, and
//! `cargo xtask dependencies` checks licences and sources of dependencies.

mod dependencies;
mod ledger;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask ledger [--check], or cargo xtask dependencies";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // The current directory is not used, because the alias works in every folder of the workspace.
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let outcome = match arguments.as_slice() {
        ["ledger"] => ledger::write(&root),
        ["ledger", "--check"] => ledger::check(&root),
        ["dependencies"] => dependencies::check(&root),
        _ => Err(USAGE.to_string()),
    };
    match outcome {
        Ok(message) => {
            println!("{message}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
