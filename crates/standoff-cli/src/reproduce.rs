//! `standoff reproduce`: reproduces the paper's tables, figures and claims.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser};
use standoff_app::Failure;
use standoff_io::display_text;
use standoff_reproduce::{self as paper, Plan, STUDY_GROUPS, StudyGroup};

use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff reproduce                              all studies, 1 to 2 minutes
  standoff reproduce table-2 --runs 1000
  standoff reproduce --page validation.md         the page of all claims";

/// Options of `standoff reproduce`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study to run: a table or figure of the paper, its errata, or another study [default: all].
    #[arg(value_parser = PossibleValuesParser::new(STUDY_GROUPS.map(|group| PossibleValue::new(group.name).help(group.about))))]
    study: Option<String>,
    /// Runs of each scenario; at least 2, because a confidence interval needs two.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    runs: u32,
    /// Seed of the first run; each further run uses the next seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=SEED_MAX))]
    seed: u64,
    /// Also run the studies improvements and coverage on this traffic file; may be given several times.
    #[arg(long, value_name = "FILE", conflicts_with = "page")]
    traffic: Vec<PathBuf>,
    /// Number of threads [default: one per core]. It does not affect the results.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Folder for figures (SVG), data (CSV) and claims (JSON).
    #[arg(long, value_name = "DIR", default_value = "standoff-out/reproduce")]
    out: PathBuf,
    /// Measure only the paper's claims, and write their page to this file and its figures next to it.
    #[arg(long, value_name = "FILE", conflicts_with = "study")]
    page: Option<PathBuf>,
}

/// Maximum seed: larger integers are not exact in the data files (`f64`).
const SEED_MAX: u64 = 1 << 52;

pub(crate) fn reproduce(args: &Args) -> Result<(), Failure> {
    let plan = Plan { runs: args.runs, first_seed: args.seed, threads: args.threads, traffic: args.traffic.clone() };
    if args.out.exists() && !args.out.is_dir() {
        return Err(Failure::Input(format!(
            "{}: not a folder; choose another with --out",
            display_text::path(&args.out)
        )));
    }
    let is_chosen = |group: &&StudyGroup| match &args.study {
        Some(name) => name == group.name,
        None => args.page.is_none() || group.has_claims(),
    };
    let groups = STUDY_GROUPS.iter().filter(is_chosen);
    if groups.clone().any(|group| args.out.join(paper::claims_file(group.name)).exists()) {
        note(&format!("note: replacing older results in {}", display_text::path(&args.out)));
    }
    let (mut studies, mut groups_flown) = (Vec::new(), 0);
    for group in groups {
        // Save and print each study immediately, so that it is kept if a later one fails.
        let found = if args.page.is_some() { group.measure_claims(&plan) } else { group.measure(&plan) };
        let found = found.map_err(failed)?;
        paper::save(&found, &args.out).map_err(failed)?;
        let summary = paper::summary(&found);
        print(&if summary.is_empty() { summary } else { summary + "\n" })?;
        found.iter().try_for_each(|study| print(&format!("{}\n", study.text())))?;
        groups_flown += 1;
        studies.extend(found);
    }
    if groups_flown > 1 {
        print(&(paper::summary(&studies) + "\n"))?;
    }
    print(&paper::rules(&studies))?;
    note(&format!("figures, data and claims are in {}", display_text::path(&args.out)));
    args.page.as_ref().map_or(Ok(()), |page| paper::write_page(page, &studies, &plan)).map_err(failed)
}

fn failed(failure: paper::Failure) -> Failure {
    match failure {
        paper::Failure::Scenario(error) => Failure::Scenario(error),
        paper::Failure::Running(message) => Failure::Running(message),
    }
}
