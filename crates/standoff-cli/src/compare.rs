//! `standoff compare`: does a change help? Two scenarios on the same draws.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Parser;
use standoff_results::{Failure, of_batch, save, warn};
use standoff_sim::monte_carlo::{Better, Comparison, Paired, compare, compare_results};
use standoff_sim::scenario::{Template, built_in};
use standoff_sim::score::Metrics;
use standoff_sim::text;
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::changes::{Changes, key_and_value};
use crate::monte_carlo::{maybe, name_width, number};
use crate::speech::{note, print};
use crate::wanted::Wanted;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff compare paper/table-2-pair-basic paper/table-2-pair
  standoff compare paper/table-2-pair --set-b guidance.lead_s=0
  standoff compare mine.toml --set uavs.count=3 --set-b guidance.radial_gain=1
  standoff compare best/figure-9 --set-b guidance.lead_s=0 --runs 1000 --json
  standoff compare batch-1 batch-2                    folders of monte-carlo
  standoff compare batch-1 batch-2 --report ab.html   and a page to look at";

/// What to compare with what.
#[derive(Parser)]
pub(crate) struct Args {
    /// A built-in scenario's name, a scenario file, or the folder of a complete Monte Carlo batch.
    a: String,
    /// The same, for what is compared with it [default: A, changed by --set-b].
    b: Option<String>,
    /// Number of runs of each.
    #[arg(long, value_name = "N", default_value_t = 200)]
    runs: u64,
    /// Seed of the first run; the next has the next.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    changes: Changes,
    /// Change a value of B alone; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set_b: Vec<String>,
    #[command(flatten)]
    wanted: Wanted,
    /// Number of threads [default: one per core]. The results are the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write the comparison of two folders as a page to look at, in one file.
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
            let what = "nothing to compare: name a second scenario, or change something with --set-b";
            return Err(Failure::Input(what.to_owned()));
        }
        _ if args.report.is_some() => {
            let what = "--report is for two folders: fly both with standoff monte-carlo, then compare these";
            return Err(Failure::Input(what.to_owned()));
        }
        b => of_scenarios(args, b.unwrap_or(&args.a))?,
    };
    print(&if args.json { comparison.json().map_err(Failure::running)? } else { text::lines(&table(&comparison)) })
}

/// A folder, and not by chance the name of a scenario.
fn is_batch(name: &str) -> bool {
    built_in(name).is_none() && Path::new(name).is_dir()
}

fn of_batches(args: &Args, b: &str) -> Result<Comparison, Failure> {
    if !args.changes.is_empty() || !args.set_b.is_empty() {
        let what = "the runs of a folder are flown already: nothing can be changed about them";
        return Err(Failure::Input(what.to_owned()));
    }
    let (a, b) = (Path::new(&args.a), Path::new(b));
    let comparison = compare_results(a, b, &AtomicBool::new(false)).map_err(of_batch)?;
    if let Some(file) = &args.report {
        if file.extension().is_none_or(|extension| extension != "html") {
            let what = "--report: must be called *.html, so that nothing else is replaced";
            return Err(Failure::Input(format!("{}: {what}", text::path(file))));
        }
        let page = page::batch_report(&Batch::open(&[a, b]).map_err(of_batch)?).map_err(Failure::running)?;
        save(file, &page)?;
    }
    Ok(comparison)
}

fn of_scenarios(args: &Args, b: &str) -> Result<Comparison, Failure> {
    let load = |name: &str, more: &[String]| {
        let template = Template::load(name, &args.changes.edits_and(more)?).map_err(Failure::Scenario)?;
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
    let mut text = format!("A: {a}\nB: {b}\n{runs} runs of each, the same draws for both, from seed {seed} on\n\n");
    let width = name_width(metrics);
    text += format!("{:width$} {:>9} {:>9} {:>10}  {:^20}", "metric", "A", "B", "B - A", "95 % interval").trim_end();
    text += "\n";
    let is_measured = |paired: &Paired| paired.mean_a.or(paired.mean_b).is_some();
    // Of one mind for all there is no agreement to tell of.
    let told = metrics.iter().filter(|(name, of)| is_measured(of) || !Metrics::AGREEMENT.contains(&name.as_str()));
    for (name, paired) in told {
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
    text + "\nshares (_fraction) from 0 to 1\n* B - A lies beyond the metric's size of interest (docs/metrics.md) with its whole interval over pairs of runs\n"
}

/// What a row comes to, in words.
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
    let of = (paired.n > 0 && paired.n < runs).then(|| format!("{} runs have it", paired.n));
    [differs, smaller, of].into_iter().flatten().collect::<Vec<_>>().join("; ")
}
