//! Replacement for `fly.rs` in builds without the feature `fly`: fails with advice to build with it.

use clap::Parser;
use standoff_app::Failure;

pub(crate) const EXAMPLES: &str = "This build cannot fly; rebuild with: cargo build --release --features fly";

/// Any options.
#[derive(Parser)]
pub(crate) struct Args {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _any: Vec<String>,
}

pub(crate) fn run(_args: &Args) -> Result<(), Failure> {
    let what = "this build has no link to autopilots; rebuild with: cargo build --release --features fly";
    Err(Failure::Input(what.to_owned()))
}
