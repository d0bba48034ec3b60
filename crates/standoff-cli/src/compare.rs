//! `standoff compare`: compares two scenarios on the same random draws.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Parser;
use standoff_app::{Failure, comparison_text, of_batch, save, warn};
use standoff_io::display_text::{self, shell_path};
use standoff_sim::monte_carlo::{Comparison, compare, compare_results};
use standoff_sim::scenario::{ScenarioTemplate, built_in};
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::metric_args::MetricArgs;
use crate::overrides::{OverrideArgs, key_and_value};
use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff compare paper/table-2-pair-basic paper/table-2-pair
  standoff compare paper/table-2-pair --set-b guidance.lead_s=0
  standoff compare mine.toml --set uavs.count=3 --set-b guidance.radial_gain=1
  standoff compare improved/figure-9 --set-b guidance.law=oh-2015 --json
  standoff compare batch-1 batch-2                    two monte-carlo folders
  standoff compare batch-1 batch-2 --report ab.html   write an HTML page, too";

/// Options of `standoff compare`.
#[derive(Parser)]
pub(crate) struct Args {
    /// Scenario A: a built-in name, a scenario file, or the folder of a complete Monte Carlo batch.
    a: String,
    /// Scenario B, given in the same way [default: A, changed by --set-b].
    b: Option<String>,
    /// Number of runs of each scenario [default: 200].
    #[arg(long, value_name = "N")]
    runs: Option<u64>,
    /// Seed of the first run; each further run uses the next seed [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    changes: OverrideArgs,
    /// Change a value of B only; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set_b: Vec<String>,
    #[command(flatten)]
    metrics: MetricArgs,
    /// Number of threads [default: one per core]. It does not affect the results.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write the comparison of two folders as one HTML file.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let comparison = match args.b.as_deref() {
        Some(b) if is_batch(&args.a) && is_batch(b) => of_batches(args, b)?,
        None if args.set_b.is_empty() => {
            let what = "nothing to compare: name a second scenario, or change a value with --set-b";
            return Err(Failure::Input(what.to_owned()));
        }
        _ if args.report.is_some() => {
            let what = "--report needs two batch folders: run standoff monte-carlo for both, then compare the folders";
            return Err(Failure::Input(what.to_owned()));
        }
        b => of_scenarios(args, b.unwrap_or(&args.a))?,
    };
    print(&if args.json {
        comparison.json().map_err(Failure::running)?
    } else {
        display_text::lines(&(comparison_text(&comparison) + &next(args)))
    })
}

/// Names the next commands.
fn next(args: &Args) -> String {
    let [a, b] = [Some(&args.a), args.b.as_ref()].map(|name| name.map(|name| shell_path(Path::new(name))));
    match (a, b) {
        (Some(a), Some(b)) if is_batch(&args.a) => {
            format!("\nnext:\n  standoff compare {a} {b} --report ab.html  (the comparison as a page)\n")
        }
        (Some(a), _) => {
            let page = "(every run, on a page; standoff compare also takes the folders of two batches)";
            format!("\nnext:\n  standoff monte-carlo {a} --runs 200\n      {page}\n")
        }
        (None, _) => String::new(),
    }
}

/// True if the argument is a folder and not also the name of a built-in scenario.
fn is_batch(name: &str) -> bool {
    built_in(name).is_none() && Path::new(name).is_dir()
}

fn of_batches(args: &Args, b: &str) -> Result<Comparison, Failure> {
    let is_for_scenarios = args.runs.or(args.seed).is_some() || args.threads.is_some() || args.metrics.is_given();
    if is_for_scenarios || !args.changes.is_empty() || !args.set_b.is_empty() {
        let what = "only --report and --json apply to two batch folders: their runs have already been flown, and all \
                    their metrics are compared";
        return Err(Failure::Input(what.to_owned()));
    }
    let (a, b) = (Path::new(&args.a), Path::new(b));
    let comparison = compare_results(a, b, &AtomicBool::new(false)).map_err(of_batch)?;
    if let Some(file) = &args.report {
        if file.extension().is_none_or(|extension| extension != "html") {
            let what = "--report: the file name must end with .html, so that no other file is overwritten by mistake";
            return Err(Failure::Input(format!("{}: {what}", display_text::path(file))));
        }
        let page = page::batch_report(&Batch::open(&[a, b]).map_err(of_batch)?).map_err(Failure::running)?;
        save(file, &page)?;
    }
    Ok(comparison)
}

fn of_scenarios(args: &Args, b: &str) -> Result<Comparison, Failure> {
    let (seed, runs) = (args.seed.unwrap_or(1), args.runs.unwrap_or(200));
    let load = |name: &str, more: &[String]| {
        let template = ScenarioTemplate::load(name, &args.changes.overrides_and(more)?).map_err(Failure::Scenario)?;
        warn(&template.draw(seed).map_err(Failure::Scenario)?, &format!("{name}: "), &note);
        Ok(template)
    };
    let (first, second) = (load(&args.a, &[])?, load(b, &args.set_b)?);
    let choice = args.metrics.selection();
    let never = AtomicBool::new(false);
    let flown = compare(&first, &second, seed, runs, choice, args.threads, &never);
    let mut comparison = flown.map_err(of_batch)?;
    for change in &args.set_b {
        comparison.b += &format!(" {change}");
    }
    Ok(comparison)
}
