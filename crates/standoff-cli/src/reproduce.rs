//! `standoff reproduce`: the paper's tables, figures and claims, measured again.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser};
use standoff_reproduce::{self as paper, PIECES, Plan};
use standoff_results::Failure;
use standoff_sim::text;

use crate::speech::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff reproduce                              everything, a minute or two
  standoff reproduce table-2 --runs 1000
  standoff reproduce --page docs/validation.md    the page of all claims";

/// What to reproduce, and where the results go.
#[derive(Parser)]
pub(crate) struct Args {
    /// A table or figure of the paper, or what is wrong in print [default: all].
    #[arg(value_parser = PossibleValuesParser::new(PIECES.map(|piece| PossibleValue::new(piece.name).help(piece.about))))]
    study: Option<String>,
    /// Runs of each scenario; at least 2, for an interval needs two.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    runs: u32,
    /// Seed of the first run; the next has the next.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=SEED_MAX))]
    seed: u64,
    /// Fly improvements and coverage over this traffic file, too; may be given several times.
    #[arg(long, value_name = "FILE")]
    traffic: Vec<PathBuf>,
    /// Number of threads [default: one per core]. The results are the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Folder for figures (SVG), data (CSV) and claims (JSON).
    #[arg(long, value_name = "DIR", default_value = "standoff-out/reproduce")]
    out: PathBuf,
    /// Write the page of all claims here, and its figures beside it.
    #[arg(long, value_name = "FILE", conflicts_with = "study")]
    page: Option<PathBuf>,
}

/// Beyond it seeds would not be exact in the data.
const SEED_MAX: u64 = 1 << 52;

pub(crate) fn reproduce(args: &Args) -> Result<(), Failure> {
    let plan = Plan { runs: args.runs, first_seed: args.seed, threads: args.threads, traffic: args.traffic.clone() };
    if args.out.exists() && !args.out.is_dir() {
        return Err(Failure::Input(format!("{}: not a folder; choose another with --out", text::path(&args.out))));
    }
    let pieces = PIECES.iter().filter(|piece| args.study.as_ref().is_none_or(|name| name == piece.name));
    if pieces.clone().any(|piece| args.out.join(paper::claims_file(piece.name)).exists()) {
        note(&format!("note: replacing older results in {}", text::path(&args.out)));
    }
    let mut studies = Vec::new();
    for piece in pieces {
        // Whatever fails later, what is done is written and told.
        let found = piece.measure(&plan).map_err(failed)?;
        paper::save(&found, &args.out).map_err(failed)?;
        found.iter().try_for_each(|study| print(&format!("{}\n", study.text())))?;
        studies.extend(found);
    }
    print(&paper::summary(&studies))?;
    note(&format!("figures, data and claims in {}", text::path(&args.out)));
    args.page.as_ref().map_or(Ok(()), |page| paper::write_page(page, &studies, &plan)).map_err(failed)
}

fn failed(failure: paper::Failure) -> Failure {
    match failure {
        paper::Failure::Scenario(error) => Failure::Scenario(error),
        paper::Failure::Running(message) => Failure::Running(message),
    }
}
