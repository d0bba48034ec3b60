//! `standoff monte-carlo`: flies a scenario many times and prints statistics of its metrics.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser;
use indicatif::ProgressBar;
use standoff_app::{Failure, REPORT, batch_page, batch_text, of_batch, warn};
use standoff_io::display_text::{self, count};
use standoff_sim::monte_carlo::{Batch, MonteCarloError, Progress, Results, Shard, fly_into};
use standoff_sim::scenario::ScenarioTemplate;

use crate::metric_args::MetricArgs;
use crate::overrides::OverrideArgs;
use crate::run::progress as bar;
use crate::signals::Interruption;
use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff monte-carlo paper/table-2-pair --runs 200
  standoff monte-carlo mine.toml --runs 99 --json | jq .metrics.anees.ci95
  standoff monte-carlo mine.toml --runs 10000 --set orbit.margin_sds=2 --out far
  standoff monte-carlo paper/figure-9 --runs 1000 --shard 0/4 --out part-0
                              one of four shards, see standoff merge

After an interruption by Ctrl-C or anything else, repeat the command to resume.";

/// Options of `standoff monte-carlo`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The name of a built-in scenario, or a scenario file [default: paper/table-2-pair; with --traffic, the settings
    /// of traffic/convoy].
    scenario: Option<String>,
    /// Number of runs.
    #[arg(long, value_name = "N")]
    runs: u64,
    /// Seed of the first run; each further run uses the next seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    changes: OverrideArgs,
    #[command(flatten)]
    metrics: MetricArgs,
    /// Number of threads [default: one per core]. It does not affect the results.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Fly only shard I of N of the runs, I from 0 to N - 1; standoff merge merges the shards.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Folder for the results [default: standoff-out/NAME-seeds-FIRST-to-LAST, followed by +KEY=VALUE for each change].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

/// Scenario that is flown if the user names none.
pub(crate) const DEFAULT_SCENARIO: &str = "paper/table-2-pair";

/// Time between progress messages if the output is not a terminal.
const PROGRESS_EVERY: Duration = Duration::from_secs(60);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let choice = args.metrics.selection();
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let template = ScenarioTemplate::load(name, &args.changes.overrides()?).map_err(Failure::Scenario)?;
    let batch = Batch::new(&template, args.seed, args.runs, args.shard, choice).map_err(of_batch)?;
    let first = batch.seed_of(batch.flown().start);
    warn(&template.draw(first).map_err(Failure::Scenario)?, "", &note);
    let out = args.out.clone().unwrap_or_else(|| default_out(args, &template, &batch));
    // A second Ctrl-C ends the program immediately: completed runs are safe in any case.
    let interruption = Interruption::install()?;
    let results = fly(&out, &template, &batch, args.threads, &interruption)?;
    let (flown, json) = (results.clone(), args.json);
    let report = interruption.run_interruptible(move || BatchReport::of(&flown, json)).ok_or_else(|| {
        let (runs, out) = (batch.flown(), display_text::path(&out));
        let runs = count_runs(runs.end - runs.start);
        Failure::running(format!(
            "interrupted; {runs} are complete in {out}: repeat the command to print their results"
        ))
    })?;
    report?.publish(&results)
}

/// Report of a complete batch.
pub(crate) struct BatchReport {
    /// HTML page; `None` if the folder has it already.
    page: Option<String>,
    /// Statistics, as JSON or as a table.
    statistics: String,
}

impl BatchReport {
    pub(crate) fn of(results: &Results, json: bool) -> Result<Self, Failure> {
        let page = batch_page(results)?;
        let summary = results.summary().map_err(of_batch)?;
        let statistics = if json {
            summary.json().map_err(Failure::running)?
        } else {
            display_text::lines(&batch_text(&summary, results))
        };
        Ok(Self { page, statistics })
    }

    /// Writes the page to the results folder and prints the statistics.
    pub(crate) fn publish(&self, results: &Results) -> Result<(), Failure> {
        self.page.iter().try_for_each(|page| results.add(REPORT, page)).map_err(of_batch)?;
        print(&self.statistics)
    }
}

/// Returns the default output folder. The same batch gets the same folder, so that repeating the command resumes it.
fn default_out(args: &Args, template: &ScenarioTemplate, batch: &Batch) -> PathBuf {
    let runs = batch.flown();
    let (first, last) = (batch.seed_of(runs.start), batch.seed_of(runs.end - 1));
    args.changes.folder(args.scenario.as_deref(), template, &format!("seeds-{first}-to-{last}"))
}

fn fly(
    out: &Path,
    template: &ScenarioTemplate,
    batch: &Batch,
    threads: Option<NonZeroUsize>,
    interruption: &Interruption,
) -> Result<Results, Failure> {
    let mut reporter = ProgressReporter::new();
    let results = fly_into(out, template, batch, threads, interruption.flag(), |progress| reporter.print(progress));
    let last = reporter.finish();
    if results.is_ok() && last.is_none() {
        note(&format!("note: {} is already complete; no runs are flown", display_text::path(out)));
    }
    results.map_err(|error| {
        let saved = match last {
            Some(Progress { done, of, .. }) => {
                format!("{done} of {} are saved in {}", count_runs(of), display_text::path(out))
            }
            // The batch was interrupted before its completed runs were counted.
            None if matches!(error, MonteCarloError::Interrupted) => {
                format!("completed runs are saved in {}", display_text::path(out))
            }
            None => return of_batch(error),
        };
        match of_batch(error) {
            Failure::Running(message) => Failure::Running(format!("{message}; {saved}: repeat the command to resume")),
            Failure::Input(message) => Failure::Input(format!("{message}\n{saved}")),
            other => other,
        }
    })
}

/// Progress display of a batch: a bar on a terminal, otherwise a line from time to time.
pub(crate) struct ProgressReporter {
    bar: ProgressBar,
    last: Option<Progress>,
    began: Instant,
    printed: Instant,
}

impl ProgressReporter {
    pub(crate) fn new() -> Self {
        let now = Instant::now();
        Self { bar: ProgressBar::hidden(), last: None, began: now, printed: now }
    }

    /// Removes the bar. Returns the last progress; `None` if there was none.
    pub(crate) fn finish(self) -> Option<Progress> {
        self.bar.finish_and_clear();
        self.last
    }

    pub(crate) fn print(&mut self, progress: Progress) {
        let Progress { before, done, of } = progress;
        if self.last.replace(progress).is_none() {
            self.began = Instant::now();
            if before > 0 {
                note(&format!("note: resuming after {before} of {}", count_runs(of)));
            }
            self.bar = bar(of, "runs").with_position(done);
            self.bar.reset_eta();
        }
        self.bar.set_position(done);
        if self.bar.is_hidden() && self.printed.elapsed() >= PROGRESS_EVERY {
            self.printed = Instant::now();
            let per_run_s = self.began.elapsed().as_secs_f64() / (done - before).max(1) as f64;
            let left_min = per_run_s * (of - done) as f64 / 60.0;
            note(&format!("note: {done} of {}, about {left_min:.0} min left", count_runs(of)));
        }
    }
}

/// Formats a number of runs: `200 runs`.
fn count_runs(runs: u64) -> String {
    count(usize::try_from(runs).unwrap_or(usize::MAX), "run")
}
