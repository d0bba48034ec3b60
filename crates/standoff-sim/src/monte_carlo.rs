//! Many runs of one scenario: flown on all cores, kept as they end, told as statistics. `docs/monte-carlo.md` describes
//! what a user sees.
//!
//! ```text
//! batch -> missing runs -> pool (a mission per thread) -> journal -> runs.parquet -> summary.json
//!            ^                                              |            ^
//!            +----------------- resume ---------------------+            +-- merge: other folders' runs.parquet
//! ```
//!
//! Run k of a batch has the batch's seed plus k. Statistics come from the rows in the order of their runs, never in that
//! of their ends: so 1 thread, N threads, an interruption and any number of shards give the same bytes.

mod batch;
mod compare;
mod error;
#[cfg(test)]
mod fuzz;
mod journal;
mod merge;
mod pool;
mod results;
mod settings;
mod shard;
mod statistics;

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

pub use batch::Batch;
pub use compare::{Better, Comparison, Paired, compare, compare_results};
pub use error::MonteCarloError;
pub use merge::merge;
pub use results::{Results, Runs, Summary};
pub use settings::Settings;
pub use shard::Shard;
pub use statistics::{Pooled, Statistics, pooled_root_ratio, quantile, student_t_975};

use crate::run::fly_while;
use crate::scenario::{Scenario, Template};
use crate::score::{Choice, Metrics};
use crate::text;
use journal::Journal;
use pool::{Halt, work_through};

/// How far a batch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Runs that were complete before.
    pub before: u64,
    /// Runs that are complete now.
    pub done: u64,
    /// Runs of the batch, or of its shard.
    pub of: u64,
}

/// Flies a run for each of these seeds, on so many threads (`None`: one per core), and keeps the scores in memory: in the
/// order of the seeds, the same on any number of threads.
pub fn fly_all(
    template: &Template,
    seeds: Range<u64>,
    choice: Choice,
    threads: Option<NonZeroUsize>,
) -> Result<Vec<Metrics>, MonteCarloError> {
    in_order(seeds, threads, &AtomicBool::new(false), |seed, halt| fly_seed(template, seed, choice, || !halt.is_up()))
}

/// Looks at the scenario of each of these seeds, on so many threads (`None`: one per core); gives what was found in the
/// order of the seeds, the same on any number of threads.
pub fn each_seed<T: Send>(
    template: &Template,
    seeds: Range<u64>,
    threads: Option<NonZeroUsize>,
    look: impl Fn(&Scenario) -> T + Sync,
) -> Result<Vec<T>, MonteCarloError> {
    in_order(seeds, threads, &AtomicBool::new(false), |seed, _| {
        template.draw(seed).map(|scenario| look(&scenario)).map_err(|problem| MonteCarloError::seed(seed, problem))
    })
}

/// Does `work` for every seed on many threads; gives the results in the order of the seeds. When `stop` is set, an error
/// that says so.
fn in_order<T: Send>(
    seeds: Range<u64>,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    work: impl Fn(u64, &Halt<'_>) -> Result<T, MonteCarloError> + Sync,
) -> Result<Vec<T>, MonteCarloError> {
    // It grows as they come: no memory is taken for what may never be flown.
    let mut rows: Vec<Option<T>> = Vec::new();
    let first = seeds.start;
    let work = |seed, halt: &Halt<'_>| Ok((seed, work(seed, halt)?));
    work_through(seeds.map(Ok), threads, stop, work, |done| {
        if let Some((seed, row)) = done {
            let place = (seed - first) as usize;
            rows.resize_with(rows.len().max(place + 1), || None);
            rows[place] = Some(row);
        }
        Ok(())
    })?;
    unless_set(stop)?;
    Ok(rows.into_iter().flatten().collect())
}

/// Flies one seed's run for as long as `go_on` says yes, and scores it.
fn fly_seed(
    template: &Template,
    seed: u64,
    choice: Choice,
    go_on: impl Fn() -> bool,
) -> Result<Metrics, MonteCarloError> {
    let scenario = template.draw(seed).map_err(|problem| MonteCarloError::seed(seed, problem))?;
    fly_while(&scenario, choice, go_on).map_err(|problems| {
        let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
        MonteCarloError::seed(seed, problems.join("\n"))
    })
}

/// Flies what is missing of a batch and completes its folder. A batch that is complete is not flown again.
///
/// Every run is kept in the folder's journal as soon as it ends. So whatever stops the batch (`stop`, a seed that cannot
/// be flown, a full disk, the end of the process at any instant), calling this again with the same batch goes on from
/// there, to the same bytes. `stop` ends it within an instant of each run in hand, or while the results are completed.
///
/// Of seeds that cannot be flown the lowest is told, on any number of threads; the runs before it are complete.
///
/// `tell` hears how far it is: at the start, after every run, and now and then.
pub fn fly_into(
    dir: &Path,
    template: &Template,
    batch: &Batch,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    mut tell: impl FnMut(Progress),
) -> Result<Results, MonteCarloError> {
    if let Some(complete) = find_complete(dir, batch, stop)? {
        return Ok(complete);
    }
    let choice = batch.choice()?;
    let mut journal = Journal::open(dir, batch)?;
    // Another process may have completed the batch while this one waited for its turn.
    if let Some(complete) = find_complete(dir, batch, stop)? {
        return Ok(complete);
    }
    let before = journal.count(stop)?;
    let mut progress = Progress { before, done: before, of: batch.flown().end - batch.flown().start };
    tell(progress);
    check_build(template, batch, &journal, stop)?;
    let work = |run, halt: &Halt<'_>| Ok((run, fly_seed(template, batch.seed_of(run), choice, || !halt.is_up())?));
    let flown = work_through(journal.missing(stop)?, threads, stop, work, |done| {
        if let Some((run, metrics)) = done {
            journal.put(batch.seed_of(run), run, &batch.values(&metrics))?;
            progress.done += 1;
        }
        tell(progress);
        journal.sync_now_and_then()
    });
    // A disk that has failed is not asked again; after anything else, what is complete is seen onto the disk.
    if !matches!(flown, Err(MonteCarloError::File(_))) {
        journal.sync()?;
    }
    flown?;
    unless_set(stop)?;
    let results = results::write(dir, batch, journal.complete_rows(stop)?, stop)?;
    journal.remove()?;
    Ok(results)
}

fn unless_set(stop: &AtomicBool) -> Result<(), MonteCarloError> {
    if stop.load(Ordering::Relaxed) { Err(MonteCarloError::Interrupted) } else { Ok(()) }
}

/// The results of a batch that is complete in `dir`. What lies beside its rows is put right, and what a process that ended
/// in its last steps has left there is removed.
fn find_complete(dir: &Path, batch: &Batch, stop: &AtomicBool) -> Result<Option<Results>, MonteCarloError> {
    let complete = Results::find(dir, batch)?;
    if let Some(results) = &complete {
        match results.mend_summary(stop) {
            // The rows are complete all the same: the next time will do for the rest.
            Err(MonteCarloError::Interrupted) => {}
            mended => mended?,
        }
        journal::remove_left_over(dir);
    }
    Ok(complete)
}

/// Refuses to go on with runs that this program flies otherwise: the first one there is flown again.
fn check_build(
    template: &Template,
    batch: &Batch,
    journal: &Journal,
    stop: &AtomicBool,
) -> Result<(), MonteCarloError> {
    let Some((run, kept)) = journal.first_complete(stop)? else { return Ok(()) };
    let seed = batch.seed_of(run);
    let again = batch.values(&fly_seed(template, seed, batch.choice()?, || !stop.load(Ordering::Relaxed))?);
    let bits = |values: &[Option<f64>]| values.iter().map(|value| value.map(f64::to_bits)).collect::<Vec<_>>();
    unless_set(stop)?;
    if bits(&again) == bits(&kept) {
        return Ok(());
    }
    let what = "comes out otherwise: the runs there are another build's";
    let advice = "complete them with that build, or name another folder";
    let dir = text::path(journal.dir());
    Err(MonteCarloError::Folder(format!("{dir}: seed {seed}, flown again, {what}; {advice}")))
}
