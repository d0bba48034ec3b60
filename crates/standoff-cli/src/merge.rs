//! `standoff merge`: merges the shards of a batch.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use standoff_app::{Failure, of_batch};
use standoff_sim::monte_carlo::merge;

use crate::monte_carlo::BatchReport;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff monte-carlo paper/figure-9 --runs 1000 --shard 0/2 --out part-0
  standoff monte-carlo paper/figure-9 --runs 1000 --shard 1/2 --out part-1
  standoff merge part-0 part-1 --out all

The result is byte for byte the same as that of the batch flown in one piece.";

/// Options of `standoff merge`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folders of all shards, in any order.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Folder for the merged batch.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let merged = merge(&args.dirs, &args.out, &AtomicBool::new(false)).map_err(of_batch)?;
    BatchReport::of(&merged, args.json)?.publish(&merged)
}
