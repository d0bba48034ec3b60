//! `standoff compare`: compares two scenarios on the same random draws.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Parser;
use standoff_results::{Failure, of_batch, save, warn};
use standoff_sim::display_text;
use standoff_sim::monte_carlo::{Better, Comparison, Paired, compare, compare_results};
use standoff_sim::scenario::{ScenarioTemplate, built_in};
use standoff_sim::score::Metrics;
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::metric_args::MetricArgs;
use crate::monte_carlo::{maybe, name_width, number};
use crate::overrides::{OverrideArgs, key_and_value};
use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff compare paper/table-2-pair-basic paper/table-2-pair
  standoff compare paper/table-2-pair --set-b guidance.lead_s=0
  standoff compare mine.toml --set uavs.count=3 --set-b guidance.radial_gain=1
  standoff compare improved/figure-9 --set-b guidance.lead_s=0 --json
  standoff compare batch-1 batch-2                    two monte-carlo folders
  standoff compare batch-1 batch-2 --report ab.html   write an HTML page, too";

/// Options of `standoff compare`.
#[derive(Parser)]
pub(crate) struct Args {
    /// Scenario A: a built-in name, a scenario file, or the folder of a complete Monte Carlo batch.
    a: String,
    /// Scenario B, given in the same way [default: A, changed by --set-b].
    b: Option<String>,
    /// Number of runs of each scenario.
    #[arg(long, value_name = "N", default_value_t = 200)]
    runs: u64,
    /// Seed of the first run; each further run uses the next seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    changes: OverrideArgs,
    /// Change a value of B only; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set_b: Vec<String>,
    #[command(flatten)]
    wanted: MetricArgs,
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
        display_text::lines(&table(&comparison))
    })
}

/// True if the argument is a folder and not also the name of a built-in scenario.
fn is_batch(name: &str) -> bool {
    built_in(name).is_none() && Path::new(name).is_dir()
}

fn of_batches(args: &Args, b: &str) -> Result<Comparison, Failure> {
    if !args.changes.is_empty() || !args.set_b.is_empty() {
        let what =
            "--traffic, --uavs, --set and --set-b apply to scenarios: the runs in these folders are flown already";
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
    let load = |name: &str, more: &[String]| {
        let template = ScenarioTemplate::load(name, &args.changes.edits_and(more)?).map_err(Failure::Scenario)?;
        warn(&template.draw(args.seed).map_err(Failure::Scenario)?, &format!("{name}: "), &note);
        Ok(template)
    };
    let (first, second) = (load(&args.a, &[])?, load(b, &args.set_b)?);
    let choice = args.wanted.choice;
    let never = AtomicBool::new(false);
    let flown = compare(&first, &second, args.seed, args.runs, choice, args.threads, &never);
    let mut comparison = flown.map_err(of_batch)?;
    for change in &args.set_b {
        comparison.b += &format!(" {change}");
    }
    Ok(comparison)
}

fn table(comparison: &Comparison) -> String {
    let Comparison { a, b, seed, runs, metrics } = comparison;
    let mut text = format!("A: {a}\nB: {b}\n{runs} runs of each with the same random draws, from seed {seed}\n\n");
    let width = name_width(metrics);
    text += format!("{:width$} {:>9} {:>9} {:>10}  {:^20}", "metric", "A", "B", "B - A", "95 % interval").trim_end();
    text += "\n";
    let is_measured = |paired: &Paired| paired.mean_a.or(paired.mean_b).is_some();
    // If all UAVs share one team state, the agreement metrics have no values.
    let is_shown = |name: &str, paired: &Paired| is_measured(paired) || !Metrics::AGREEMENT.contains(&name);
    for (name, paired) in metrics.iter().filter(|(name, paired)| is_shown(name, paired)) {
        let interval =
            paired.ci95.map_or_else(|| "-".to_owned(), |[lo, hi]| format!("{} to {}", number(lo), number(hi)));
        let line = format!(
            "{name:width$} {:>9} {:>9} {:>10}  {interval:^20}  {}",
            maybe(paired.mean_a),
            maybe(paired.mean_b),
            maybe(paired.difference),
            verdict(paired, *runs)
        );
        text += line.trim_end();
        text += "\n";
    }
    text + "\nmetrics named *_fraction range from 0 to 1\n\
            * the whole interval of B - A, over pairs of runs, exceeds the metric's size of interest (docs/metrics.md)\n"
}

/// Returns the verdict on a metric as text.
fn verdict(paired: &Paired, runs: u64) -> String {
    let differs = match (paired.differs, paired.better) {
        (false, _) => None,
        (true, None) => Some("* differs".to_owned()),
        (true, Some(Better::A)) => Some("* A is better".to_owned()),
        (true, Some(Better::B)) => Some("* B is better".to_owned()),
    };
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let smaller = match (paired.b_smaller, paired.equal) {
        (_, Some(1.0)) => Some("equal in all runs".to_owned()),
        (Some(share), _) => Some(format!("B smaller in {} of runs", percent(share))),
        _ => None,
    };
    let measured = (paired.n > 0 && paired.n < runs).then(|| format!("measured in {} runs", paired.n));
    [differs, smaller, measured].into_iter().flatten().collect::<Vec<_>>().join("; ")
}
