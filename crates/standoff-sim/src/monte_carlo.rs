//! Monte Carlo simulation: runs of one scenario on all cores, with a journal and statistics. `docs/user/monte-carlo.md`
//! describes the user's view.
//!
//! ```text
//! batch -> missing runs -> pool (a mission per thread) -> journal -> runs.parquet -> summary.json
//!            ^                                              |            ^
//!            +----------------- resume ---------------------+            +-- merge: other folders' runs.parquet
//! ```
//!
//! Run k of a batch has the batch's seed plus k. Statistics are computed from the rows in the order of runs, not in
//! that of their completion. Hence any number of threads and shards, and any interruption, give the same bytes.

mod batch;
mod compare;
mod diff;
mod error;
#[cfg(test)]
mod fuzz;
mod journal;
mod merge;
mod pool;
mod results;
mod shard;
mod statistics;

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

pub use batch::Batch;
pub use compare::{Better, Comparison, Paired, compare, compare_results};
pub use diff::{Settings, differing_settings};
pub use error::MonteCarloError;
pub use merge::merge;
pub use results::{Results, Runs, Summary};
pub use shard::Shard;
use standoff_io::display_text;
use standoff_score::{MetricSelection, Metrics};
pub use statistics::{Pooled, Statistics, pooled_root_ratio, quantile, student_t_975};

use crate::run::fly_while;
use crate::scenario::{Scenario, ScenarioTemplate};
use journal::Journal;
use pool::{JobControl, run_jobs};

/// Progress of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of runs that were complete at the start.
    pub before: u64,
    /// Number of runs that are complete now.
    pub done: u64,
    /// Number of runs of the batch, or of its shard.
    pub of: u64,
}

/// Flies a run for each of these seeds on `threads` threads (`None`: one per core) and returns the scores, ordered by
/// seed. The result does not depend on the number of threads.
pub fn fly_all(
    template: &ScenarioTemplate,
    seeds: Range<u64>,
    choice: MetricSelection,
    threads: Option<NonZeroUsize>,
) -> Result<Vec<Metrics>, MonteCarloError> {
    in_order(seeds, threads, &AtomicBool::new(false), |seed, halt| {
        fly_seed(template, seed, choice, || !halt.is_stopped())
    })
}

/// Applies `look` to the scenario of each of these seeds on `threads` threads (`None`: one per core) and returns the
/// results, ordered by seed. The result does not depend on the number of threads.
pub fn each_seed<T: Send>(
    template: &ScenarioTemplate,
    seeds: Range<u64>,
    threads: Option<NonZeroUsize>,
    look: impl Fn(&Scenario) -> T + Sync,
) -> Result<Vec<T>, MonteCarloError> {
    in_order(seeds, threads, &AtomicBool::new(false), |seed, _| {
        template.draw(seed).map(|scenario| look(&scenario)).map_err(|problem| MonteCarloError::seed(seed, problem))
    })
}

/// Runs `work` for every seed on many threads and returns the results, ordered by seed. Returns
/// [`MonteCarloError::Interrupted`] if `stop` is set.
fn in_order<T: Send>(
    seeds: Range<u64>,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    work: impl Fn(u64, &JobControl<'_>) -> Result<T, MonteCarloError> + Sync,
) -> Result<Vec<T>, MonteCarloError> {
    // Grows with the results, so that no memory is allocated for runs that may never be flown.
    let mut rows: Vec<Option<T>> = Vec::new();
    let first = seeds.start;
    let work = |seed, halt: &JobControl<'_>| Ok((seed, work(seed, halt)?));
    run_jobs(seeds.map(Ok), threads, stop, work, |done| {
        if let Some((seed, row)) = done {
            let place = (seed - first) as usize;
            rows.resize_with(rows.len().max(place + 1), || None);
            rows[place] = Some(row);
        }
        Ok(())
    })?;
    check_not_stopped(stop)?;
    Ok(rows.into_iter().flatten().collect())
}

/// Flies the run of one seed while `go_on` returns true, and scores it.
fn fly_seed(
    template: &ScenarioTemplate,
    seed: u64,
    choice: MetricSelection,
    go_on: impl Fn() -> bool,
) -> Result<Metrics, MonteCarloError> {
    let scenario = template.draw(seed).map_err(|problem| MonteCarloError::seed(seed, problem))?;
    fly_while(&scenario, choice, go_on).map_err(|problems| {
        let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
        MonteCarloError::seed(seed, problems.join("\n"))
    })
}

/// Flies the missing runs of a batch and completes its folder. A complete batch is not flown again.
///
/// Every run is saved in the folder's journal when it ends. If anything stops the batch (`stop`, an invalid seed, a
/// full disk, the end of the process), another call with the same batch continues from there and gives the same bytes.
/// `stop` takes effect within one time step of each active run, or while the results are completed.
///
/// If several seeds cannot be flown, the lowest one is reported, on any number of threads; the runs before it are
/// complete.
///
/// `report` is called with the progress: at the start, after every run, and at intervals.
pub fn fly_into(
    dir: &Path,
    template: &ScenarioTemplate,
    batch: &Batch,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    mut report: impl FnMut(Progress),
) -> Result<Results, MonteCarloError> {
    if let Some(complete) = find_complete(dir, batch, stop)? {
        return Ok(complete);
    }
    let choice = batch.choice()?;
    let mut journal = Journal::open(dir, batch)?;
    // Another process may have completed the batch while this one waited for the lock.
    if let Some(complete) = find_complete(dir, batch, stop)? {
        return Ok(complete);
    }
    let before = journal.count(stop)?;
    let mut progress = Progress { before, done: before, of: batch.flown().end - batch.flown().start };
    report(progress);
    check_build(template, batch, &journal, stop)?;
    let work =
        |run, halt: &JobControl<'_>| Ok((run, fly_seed(template, batch.seed_of(run), choice, || !halt.is_stopped())?));
    let flown = run_jobs(journal.missing(stop)?, threads, stop, work, |done| {
        if let Some((run, metrics)) = done {
            journal.put(batch.seed_of(run), run, &batch.values(&metrics))?;
            progress.done += 1;
        }
        report(progress);
        journal.sync_now_and_then()
    });
    // After a disk error, the disk is not used again. In all other cases, the complete runs are synced to disk.
    if !matches!(flown, Err(MonteCarloError::File(_))) {
        journal.sync()?;
    }
    flown?;
    check_not_stopped(stop)?;
    let results = results::write(dir, batch, journal.complete_rows(stop)?, stop)?;
    journal.remove()?;
    Ok(results)
}

fn check_not_stopped(stop: &AtomicBool) -> Result<(), MonteCarloError> {
    if stop.load(Ordering::Relaxed) { Err(MonteCarloError::Interrupted) } else { Ok(()) }
}

/// Returns the results of a batch that is complete in `dir`. Repairs its other files, and removes the leftovers of a
/// process that ended in its last steps.
fn find_complete(dir: &Path, batch: &Batch, stop: &AtomicBool) -> Result<Option<Results>, MonteCarloError> {
    let complete = Results::find(dir, batch)?;
    if let Some(results) = &complete {
        match results.mend_summary(stop) {
            // The rows are complete anyway; the rest can be repaired next time.
            Err(MonteCarloError::Interrupted) => {}
            mended => mended?,
        }
        journal::remove_left_over(dir);
    }
    Ok(complete)
}

/// Refuses to continue runs of a build that computes different results: repeats the first existing run and compares.
fn check_build(
    template: &ScenarioTemplate,
    batch: &Batch,
    journal: &Journal,
    stop: &AtomicBool,
) -> Result<(), MonteCarloError> {
    let Some((run, kept)) = journal.first_complete(stop)? else { return Ok(()) };
    let seed = batch.seed_of(run);
    let again = batch.values(&fly_seed(template, seed, batch.choice()?, || !stop.load(Ordering::Relaxed))?);
    let bits = |values: &[Option<f64>]| values.iter().map(|value| value.map(f64::to_bits)).collect::<Vec<_>>();
    check_not_stopped(stop)?;
    if bits(&again) == bits(&kept) {
        return Ok(());
    }
    let what = "gives different results: the existing runs are from another build";
    let advice = "complete them with that build, or choose another folder";
    let dir = display_text::path(journal.dir());
    Err(MonteCarloError::Folder(format!("{dir}: a repeat of seed {seed} {what}; {advice}")))
}
