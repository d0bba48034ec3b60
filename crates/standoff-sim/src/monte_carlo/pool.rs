//! Thread pool: jobs run on many threads, results are processed on one.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::MonteCarloError;

/// Maximum number of queued results: limits the memory.
const QUEUE_MAX: usize = 256;

/// Maximum number of threads. No machine has more cores.
const MAX_THREADS: usize = 1024;

/// Interval at which `take` is called without a result.
const POLL: Duration = Duration::from_millis(100);

/// Shows a job whether its result is still needed.
pub(super) struct JobControl<'a> {
    /// Index of the job.
    place: u64,
    /// First index whose result is not needed.
    end: &'a AtomicU64,
}

/// Value of `end` if all results are needed.
const NO_LIMIT: u64 = u64::MAX;

impl JobControl<'_> {
    pub(super) fn is_stopped(&self) -> bool {
        self.place >= self.end.load(Ordering::Relaxed)
    }
}

/// Runs `work` for every job on `threads` threads (one per core if `None`). Passes each result to `take` on this thread
/// as it arrives, and `None` at intervals.
///
/// If a job fails, earlier jobs continue and later ones are halted. Hence the returned error is that of the first
/// failing job in job order, not in time, and the results of all earlier jobs are taken. If `stop` is set, all jobs are
/// halted. Halted work may return anything: the result is dropped. An error of `take` halts all jobs immediately. Fails
/// if the system cannot start `threads` threads; at most [`MAX_THREADS`] are started.
pub(super) fn run_jobs<J, T: Send>(
    jobs: impl Iterator<Item = Result<J, MonteCarloError>> + Send,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    work: impl Fn(J, &JobControl<'_>) -> Result<T, MonteCarloError> + Sync,
    mut take: impl FnMut(Option<T>) -> Result<(), MonteCarloError>,
) -> Result<(), MonteCarloError> {
    let threads =
        threads.or_else(|| thread::available_parallelism().ok()).map_or(1, |threads| threads.get().min(MAX_THREADS));
    let (jobs, work) = (&Mutex::new((0..).zip(jobs)), &work);
    let end = &AtomicU64::new(if stop.load(Ordering::Relaxed) { 0 } else { NO_LIMIT });
    thread::scope(|scope| {
        // Dropped at the end of this closure, so that no worker waits for a receiver that is gone.
        let (give, results) = sync_channel(QUEUE_MAX);
        let mut failed: Option<(u64, MonteCarloError)> = None;
        for _ in 0..threads {
            let give = give.clone();
            let worker = move || {
                while end.load(Ordering::Relaxed) == NO_LIMIT {
                    let next = jobs.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some((place, job)) = next else { break };
                    let halt = JobControl { place, end };
                    let result = job.and_then(|job| work(job, &halt));
                    let failed = result.is_err();
                    if halt.is_stopped() || give.send((place, result)).is_err() || failed {
                        break;
                    }
                }
            };
            if let Err(reason) = thread::Builder::new().spawn_scoped(scope, worker) {
                end.store(0, Ordering::Relaxed);
                failed = Some((0, MonteCarloError::Threads { threads, reason }));
                break;
            }
        }
        drop(give);
        loop {
            let result = match results.recv_timeout(POLL) {
                Ok((place, Err(error))) => {
                    end.fetch_min(place, Ordering::Relaxed);
                    if failed.as_ref().is_none_or(|(first, _)| place < *first) {
                        failed = Some((place, error));
                    }
                    continue;
                }
                Ok((_, Ok(result))) => Some(result),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return failed.map_or(Ok(()), |(_, error)| Err(error)),
            };
            take(result).inspect_err(|_| end.store(0, Ordering::Relaxed))?;
            if stop.load(Ordering::Relaxed) {
                end.store(0, Ordering::Relaxed);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Job 2 fails first in time. After it has halted job 3, job 1 fails as well, and job 0 ends normally.
    #[test]
    fn error_is_that_of_the_first_job_and_earlier_jobs_are_done() {
        let (has_begun, is_halted) = (AtomicBool::new(false), AtomicBool::new(false));
        let wait_for = |what: &dyn Fn() -> bool| {
            while !what() {
                thread::yield_now();
            }
        };
        let work = |job: u64, halt: &JobControl<'_>| {
            match job {
                0 | 1 => wait_for(&|| is_halted.load(Ordering::Relaxed)),
                // No job starts after it has failed.
                2 => wait_for(&|| has_begun.load(Ordering::Relaxed)),
                3 => {
                    has_begun.store(true, Ordering::Relaxed);
                    wait_for(&|| halt.is_stopped());
                    is_halted.store(true, Ordering::Relaxed);
                }
                _ => {}
            }
            if [1, 2].contains(&job) { Err(MonteCarloError::seed(job, "it fails")) } else { Ok(job) }
        };
        let mut done = Vec::new();
        let worked = run_jobs((0..10).map(Ok), NonZeroUsize::new(4), &AtomicBool::new(false), work, |result| {
            done.extend(result);
            Ok(())
        });
        assert_eq!(worked.unwrap_err().to_string(), "seed 1: it fails");
        assert_eq!(done, [0]);
    }
}
