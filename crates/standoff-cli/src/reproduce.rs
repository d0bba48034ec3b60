//! `standoff reproduce`: the paper's tables, figures and claims, measured again.

mod claim;
mod errata;
mod flights;
mod history;
mod improvements;
mod missions;
mod observe;
mod page;
mod separation;
mod statistics;
mod study;
mod table_2;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};

use crate::failure::{Failure, note, print};
use flights::Plan;
use standoff_sim::text;
use study::{Study, claims_file, save, save_figures, summary, write};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff reproduce                              everything, a minute or two
  standoff reproduce table-2 --runs 1000
  standoff reproduce --page docs/validation.md    the page of all claims";

/// What to reproduce, and where the results go.
#[derive(Parser)]
pub(crate) struct Args {
    /// A table or figure of the paper, or what is wrong in print [default: all].
    study: Option<Name>,
    /// Runs of each scenario; at least 2, for an interval needs two.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    runs: u32,
    /// Seed of the first run; the next has the next.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=SEED_MAX))]
    seed: u64,
    /// Fly the improvements over this traffic file, too; may be given several times.
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

/// What there is to reproduce.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Name {
    /// Mean errors of one and of two UAVs, with and without the active measures.
    #[value(name = "table-2")]
    Table2,
    /// Information of a pair by the target's bearing.
    #[value(name = "figure-6")]
    Figure6,
    /// Its mean, by sensor and separation.
    #[value(name = "figure-7")]
    Figure7,
    /// Four targets, two UAVs.
    #[value(name = "figure-8")]
    Figure8,
    /// Seven targets, four UAVs: a handoff, a discard.
    #[value(name = "figure-9")]
    Figure9,
    /// Histories of that mission.
    #[value(name = "figure-10")]
    Figure10,
    /// Its lines of sight, with and without measures and dwell.
    #[value(name = "figure-11")]
    Figure11,
    /// What is wrong in print.
    Errata,
    /// What this project's improvements gain, one at a time, and how close the best is to what is possible.
    Improvements,
}

impl Name {
    /// The file of its claims.
    fn claims(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| claims_file(value.get_name()))
    }

    /// Runs it.
    fn reproduce(self, plan: &Plan) -> Result<Vec<Study>, Failure> {
        Ok(match self {
            Self::Table2 => vec![table_2::table_2(plan)?],
            Self::Figure6 => vec![separation::figure_6()?],
            Self::Figure7 => vec![separation::figure_7()?],
            Self::Figure8 => vec![missions::figure_8(plan)?],
            Self::Figure9 => vec![missions::figure_9(plan)?],
            Self::Figure10 => vec![missions::figure_10(plan)?],
            Self::Figure11 => vec![missions::figure_11(plan)?],
            Self::Errata => errata::errata(plan)?,
            Self::Improvements => vec![improvements::improvements(plan)?],
        })
    }
}

pub(crate) fn reproduce(args: &Args) -> Result<(), Failure> {
    let plan = Plan { runs: args.runs, first_seed: args.seed, threads: args.threads, traffic: args.traffic.clone() };
    check_folder(&args.out)?;
    let names = args.study.as_ref().map_or(Name::value_variants(), std::slice::from_ref);
    if names.iter().any(|name| args.out.join(name.claims()).exists()) {
        note(&format!("note: replacing older results in {}", text::path(&args.out)));
    }
    let mut studies = Vec::new();
    for name in names {
        // Whatever fails later, what is done is written and told.
        let found = name.reproduce(&plan)?;
        save(&found, &args.out)?;
        found.iter().try_for_each(|study| print(&format!("{}\n", study.text())))?;
        studies.extend(found);
    }
    print(&summary(&studies))?;
    note(&format!("figures, data and claims in {}", text::path(&args.out)));
    let Some(path) = &args.page else { return Ok(()) };
    let pictures = path.parent().unwrap_or(Path::new("")).join(page::PICTURES);
    studies.iter().try_for_each(|study| save_figures(&study.figures, &pictures))?;
    write(path, &page::page(&studies, &plan))
}

/// What is no folder cannot hold the results.
fn check_folder(out: &Path) -> Result<(), Failure> {
    if out.exists() && !out.is_dir() {
        return Err(Failure::Input(format!("{}: not a folder; choose another with --out", text::path(out))));
    }
    Ok(())
}
