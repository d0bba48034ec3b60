//! `standoff monte-carlo`: flies a scenario many times, and tells the statistics.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser;
use indicatif::ProgressBar;
use standoff_results::{Failure, REPORT, count, of_batch, report, warn};
use standoff_sim::monte_carlo::{Batch, MonteCarloError, Progress, Results, Shard, Summary, fly_into};
use standoff_sim::scenario::Template;
use standoff_sim::score::Metrics;
use standoff_sim::text;

use crate::changes::Changes;
use crate::interruption::Interruption;
use crate::run::progress as bar;
use crate::speech::{note, print};
use crate::wanted::Wanted;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff monte-carlo paper/table-2-pair --runs 200
  standoff monte-carlo mine.toml --runs 99 --json | jq .metrics.anees.ci95
  standoff monte-carlo mine.toml --runs 10000 --set guidance.lead_s=1 --out lead
  standoff monte-carlo paper/figure-9 --runs 1000 --shard 0/4 --out part-0
                              one of four parts, see standoff merge

Stopped by Ctrl-C or anything else, the same command goes on where it was.";

/// What to fly how often, and where the results go.
#[derive(Parser)]
pub(crate) struct Args {
    /// A built-in scenario's name, or a scenario file [default: paper/table-2-pair; with --traffic, the settings of
    /// traffic/convoy].
    scenario: Option<String>,
    /// Number of runs.
    #[arg(long, value_name = "N")]
    runs: u64,
    /// Seed of the first run; the next has the next.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    wanted: Wanted,
    /// Number of threads [default: one per core]. The results are the same with any number.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Fly only part I of N, from 0 to N - 1, of the runs; standoff merge puts them together.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Folder for the results [default: standoff-out/NAME-seeds-FIRST-to-LAST, and behind it what is changed:
    /// +KEY=VALUE].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

/// What is flown if nothing is named.
const DEFAULT_SCENARIO: &str = "paper/table-2-pair";

/// How often progress is told where there is no terminal.
const TELL_EVERY: Duration = Duration::from_secs(60);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let choice = args.wanted.choice;
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let template = Template::load(name, &args.changes.edits()?).map_err(Failure::Scenario)?;
    let batch = Batch::new(&template, args.seed, args.runs, args.shard, choice).map_err(of_batch)?;
    let first = batch.seed_of(batch.flown().start);
    warn(&template.draw(first).map_err(Failure::Scenario)?, "", &note);
    let out = args.out.clone().unwrap_or_else(|| default_out(args, &template, &batch));
    // The second time it ends at once: what is complete is safe in any case.
    let interruption = Interruption::expected()?;
    let results = fly(&out, &template, &batch, args.threads, &interruption)?;
    let (flown, json) = (results.clone(), args.json);
    let told = interruption.unless_come(move || Told::of(&flown, json)).ok_or_else(|| {
        let (runs, out) = (batch.flown(), text::path(&out));
        let runs = count_runs(runs.end - runs.start);
        Failure::running(format!("interrupted; {runs} are complete in {out}: the same command tells what they came to"))
    })?;
    told?.put(&results)
}

/// What there is to tell of a complete batch.
pub(crate) struct Told {
    /// Its page, if it is not there yet.
    page: Option<String>,
    /// Its statistics, for programs or for people.
    statistics: String,
}

impl Told {
    pub(crate) fn of(results: &Results, json: bool) -> Result<Self, Failure> {
        let page = report(results)?;
        let summary = results.summary().map_err(of_batch)?;
        let statistics =
            if json { summary.json().map_err(Failure::running)? } else { text::lines(&table(&summary, results)) };
        Ok(Self { page, statistics })
    }

    /// Puts the page beside the results, and prints the statistics.
    pub(crate) fn put(&self, results: &Results) -> Result<(), Failure> {
        self.page.iter().try_for_each(|page| results.add(REPORT, page)).map_err(of_batch)?;
        print(&self.statistics)
    }
}

/// The same batch gets the same folder, so that the same command goes on.
fn default_out(args: &Args, template: &Template, batch: &Batch) -> PathBuf {
    let runs = batch.flown();
    let (first, last) = (batch.seed_of(runs.start), batch.seed_of(runs.end - 1));
    args.changes.folder(args.scenario.as_deref(), template, &format!("seeds-{first}-to-{last}"))
}

fn fly(
    out: &Path,
    template: &Template,
    batch: &Batch,
    threads: Option<NonZeroUsize>,
    interruption: &Interruption,
) -> Result<Results, Failure> {
    let now = Instant::now();
    let mut teller = Teller { bar: ProgressBar::hidden(), last: None, began: now, told: now };
    let flown = fly_into(out, template, batch, threads, interruption.flag(), |progress| teller.tell(progress));
    teller.bar.finish_and_clear();
    if flown.is_ok() && teller.last.is_none() {
        note(&format!("note: {} was complete already; nothing is flown again", text::path(out)));
    }
    flown.map_err(|error| {
        let kept = match teller.last {
            Some(Progress { done, of, .. }) => format!("{done} of {} are kept in {}", count_runs(of), text::path(out)),
            // It has not come to count them.
            None if matches!(error, MonteCarloError::Interrupted) => {
                format!("what is complete is kept in {}", text::path(out))
            }
            None => return of_batch(error),
        };
        match of_batch(error) {
            Failure::Running(message) => {
                Failure::Running(format!("{message}; {kept}: the same command goes on from there"))
            }
            Failure::Input(message) => Failure::Input(format!("{message}\n{kept}")),
            other => other,
        }
    })
}

/// Tells how far the batch is: a bar on a terminal, else a line now and then.
struct Teller {
    bar: ProgressBar,
    last: Option<Progress>,
    began: Instant,
    told: Instant,
}

impl Teller {
    fn tell(&mut self, progress: Progress) {
        let Progress { before, done, of } = progress;
        if self.last.replace(progress).is_none() {
            self.began = Instant::now();
            if before > 0 {
                note(&format!("note: going on after {before} of {}", count_runs(of)));
            }
            self.bar = bar(of, "runs").with_position(done);
            self.bar.reset_eta();
        }
        self.bar.set_position(done);
        if self.bar.is_hidden() && self.told.elapsed() >= TELL_EVERY {
            self.told = Instant::now();
            let per_run_s = self.began.elapsed().as_secs_f64() / (done - before).max(1) as f64;
            let left_min = per_run_s * (of - done) as f64 / 60.0;
            note(&format!("note: {done} of {}, about {left_min:.0} min left", count_runs(of)));
        }
    }
}

fn table(summary: &Summary, results: &Results) -> String {
    let Summary { scenario, runs, shard, metrics, .. } = summary;
    let batch = results.batch();
    let flown = batch.flown();
    let (first, last) = (batch.seed_of(flown.start), batch.seed_of(flown.end - 1));
    let part = shard.map_or_else(String::new, |shard| format!(", shard {shard} of {}", count_runs(*runs)));
    let scenario = text::words(scenario);
    let mut text = format!("{scenario}, {}, seeds {first} to {last}{part}\n\n", count_runs(flown.end - flown.start));
    let width = name_width(metrics);
    text += &format!(
        "{:width$} {:>6} {:>9}  {:^21} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
        "metric", "n", "mean", "95 % interval", "sd", "5 %", "median", "95 %", "max"
    );
    // Of one mind for all there is no agreement to tell of.
    let told = metrics.iter().filter(|(name, s)| s.n > 0 || !Metrics::AGREEMENT.contains(&name.as_str()));
    for (name, s) in told {
        let interval = s.ci95.map_or_else(|| "-".to_owned(), |[lo, hi]| format!("{} to {}", number(lo), number(hi)));
        text += &format!("{name:width$} {:>6} {:>9}  {interval:^21}", s.n, maybe(s.mean));
        for value in [s.sd, s.p5, s.p50, s.p95, s.max] {
            text += &format!(" {:>9}", maybe(value));
        }
        text += "\n";
    }
    text + &format!("\nresults in {}\n", text::path(results.dir()))
}

/// How wide the column of the metrics' names is: most are short, and tables of the usual ones look alike.
pub(crate) fn name_width<T>(metrics: &[(String, T)]) -> usize {
    metrics.iter().map(|(name, _)| name.len()).fold(33, usize::max)
}

/// `200 runs`.
fn count_runs(runs: u64) -> String {
    count(usize::try_from(runs).unwrap_or(usize::MAX), "run")
}

/// Four digits that count.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".to_owned(),
        _ if size >= 1000.0 => format!("{value:.0}"),
        _ if size >= 100.0 => format!("{value:.1}"),
        _ if size >= 10.0 => format!("{value:.2}"),
        _ if size >= 1.0 => format!("{value:.3}"),
        _ if size >= 1e-4 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

pub(crate) fn maybe(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}
