//! `standoff compare`: compares two scenarios on the same random draws.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Parser;
use standoff_app::{Failure, of_batch, save, warn};
use standoff_io::display_text::{self, WIDTH, wrapped};
use standoff_score::MetricInfo;
use standoff_sim::monte_carlo::{Better, Comparison, Paired, compare, compare_results};
use standoff_sim::scenario::{ScenarioTemplate, built_in};
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
        display_text::lines(&table(&comparison))
    })
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

/// Formats a comparison for a terminal of 100 columns: the verdict, the metrics that differ, and a table of all.
fn table(comparison: &Comparison) -> String {
    let Comparison { a, b, seed, runs, metrics } = comparison;
    let is_measured = |paired: &Paired| paired.mean_a.or(paired.mean_b).is_some();
    let measured: Vec<_> = metrics.iter().filter(|(_, paired)| is_measured(paired)).collect();
    let mut text = format!("{}\n\nA: {a}\nB: {b}\n", overall(&measured));
    text += &format!("{runs} runs of each with the same random draws, from seed {seed}\n");
    text += &differences(&measured);
    let width = name_width(metrics);
    let head =
        format!("{:width$} {:>9} {:>9} {:>10}  {:^20}  {}", "metric", "A", "B", "B - A", "95 % interval", "result");
    text += &format!("\n{head}\n");
    for (name, paired) in &measured {
        let interval =
            paired.ci95.map_or_else(|| "-".to_owned(), |[lo, hi]| format!("{} to {}", number(lo), number(hi)));
        let (mean_a, mean_b, difference) = (maybe(paired.mean_a), maybe(paired.mean_b), maybe(paired.difference));
        let result = Verdict::of(paired).text();
        text += &format!("{name:width$} {mean_a:>9} {mean_b:>9} {difference:>10}  {interval:^20}  {result}\n");
    }
    let names = |is: &dyn Fn(&Paired) -> bool, with_runs: bool| {
        let names = metrics
            .iter()
            .filter(|(_, paired)| is(paired))
            .map(|(name, paired)| if with_runs { format!("{name} ({})", paired.n) } else { name.clone() });
        names.collect::<Vec<_>>().join(", ")
    };
    let partly = names(&|paired| is_measured(paired) && paired.n < *runs, true);
    let never = names(&|paired| !is_measured(paired), false);
    text += "\n";
    for (what, list) in [("measured in fewer runs: ", partly), ("without values: ", never)] {
        if !list.is_empty() {
            text += &wrapped("", &format!("{what}{list}"), WIDTH);
        }
    }
    text + "metrics named *_fraction range from 0 to 1\n\
            better, differs: the whole interval of B - A is beyond +- the size of interest (docs/metrics.md)\n\
            same: the whole interval is within +- the size of interest; unclear: neither; fly more runs\n"
}

/// Result of comparing one metric.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    ABetter,
    BBetter,
    Differs,
    Same,
    Unclear,
}

impl Verdict {
    fn of(paired: &Paired) -> Self {
        match (paired.differs, paired.better, paired.ci95) {
            (true, Some(Better::A), _) => Self::ABetter,
            (true, Some(Better::B), _) => Self::BBetter,
            (true, None, _) => Self::Differs,
            (false, _, Some([lo, hi])) if lo >= -paired.interest && hi <= paired.interest => Self::Same,
            (false, ..) if paired.equal == Some(1.0) => Self::Same,
            (false, ..) => Self::Unclear,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::ABetter => "A better",
            Self::BBetter => "B better",
            Self::Differs => "differs",
            Self::Same => "same",
            Self::Unclear => "unclear",
        }
    }
}

/// Returns the verdict on all measured metrics in one line.
fn overall(measured: &[&(String, Paired)]) -> String {
    let count = |verdict| measured.iter().filter(|(_, paired)| Verdict::of(paired) == verdict).count();
    let (a, b, differs) = (count(Verdict::ABetter), count(Verdict::BBetter), count(Verdict::Differs));
    let (same, unclear) = (count(Verdict::Same), count(Verdict::Unclear));
    let verdict = match (a, b) {
        (0, 0) => "neither A nor B is better in any metric".to_owned(),
        (0, b) => format!("B is better in {b} of {} metrics, A in none", measured.len()),
        (a, 0) => format!("A is better in {a} of {} metrics, B in none", measured.len()),
        (a, b) => format!("B is better in {b} of {} metrics, A in {a}", measured.len()),
    };
    let neutral = if differs > 0 { format!(", {differs} differ") } else { String::new() };
    format!("verdict: {verdict}{neutral}; {same} the same, {unclear} unclear")
}

/// Lists the metrics that differ, the largest difference relative to the size of interest first.
fn differences(measured: &[&(String, Paired)]) -> String {
    let mut text = String::new();
    for (verdict, heading) in [
        (Verdict::BBetter, "B is better"),
        (Verdict::ABetter, "A is better"),
        (Verdict::Differs, "A and B differ, neither is better"),
    ] {
        let mut found: Vec<_> = measured.iter().filter(|(_, paired)| Verdict::of(paired) == verdict).collect();
        let size = |paired: &Paired| paired.difference.unwrap_or(0.0).abs() / paired.interest;
        found.sort_by(|(_, one), (_, other)| size(other).total_cmp(&size(one)));
        if !found.is_empty() {
            text += &format!("\n{heading}\n");
        }
        for (name, paired) in found {
            let (unit, factor) = MetricInfo::unit(name);
            let value = |mean: Option<f64>| maybe(mean.map(|mean| factor * mean));
            let label = MetricInfo::of(name).map_or(name.as_str(), |info| info.label);
            let (mean_a, mean_b) = (value(paired.mean_a), value(paired.mean_b));
            text += format!("  {label:47} A {mean_a:>9}   B {mean_b:>9} {unit}").trim_end();
            text += "\n";
        }
    }
    text
}
