//! Jobs on many threads, results on one.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::MonteCarloError;

/// Results that may wait for the taker: what bounds the memory.
const WAITING: usize = 256;

/// More threads than any machine has cores would only wait for one another.
const MAX_THREADS: usize = 1024;

/// How often the taker is asked to look around where no result comes.
const LOOK_AROUND: Duration = Duration::from_millis(100);

/// Tells a job that nobody needs its result any more.
pub(super) struct Halt<'a> {
    /// Its place among the jobs.
    place: u64,
    /// The place from which on nothing is needed.
    end: &'a AtomicU64,
}

/// All is needed.
const NO_END: u64 = u64::MAX;

impl Halt<'_> {
    pub(super) fn is_up(&self) -> bool {
        self.place >= self.end.load(Ordering::Relaxed)
    }
}

/// Does `work` on every job, on `threads` threads, one per core if `None`; hands each result to `take` on this thread as
/// it comes, and `None` now and then.
///
/// When a job fails, those before it go on and those behind it are halted: so the error that is returned is that of the
/// first job that fails, whichever fails first in time, and all before it are taken. When `stop` is set, all are halted.
/// Work that sees its halt up may return anything: it is dropped. An error of `take` ends all at once. `threads` more
/// than the system can start are an error; more than [`MAX_THREADS`] are not asked for.
pub(super) fn work_through<J, T: Send>(
    jobs: impl Iterator<Item = Result<J, MonteCarloError>> + Send,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    work: impl Fn(J, &Halt<'_>) -> Result<T, MonteCarloError> + Sync,
    mut take: impl FnMut(Option<T>) -> Result<(), MonteCarloError>,
) -> Result<(), MonteCarloError> {
    let threads =
        threads.or_else(|| thread::available_parallelism().ok()).map_or(1, |threads| threads.get().min(MAX_THREADS));
    let (jobs, work) = (&Mutex::new((0..).zip(jobs)), &work);
    let end = &AtomicU64::new(if stop.load(Ordering::Relaxed) { 0 } else { NO_END });
    thread::scope(|scope| {
        // It goes when this closure ends: no worker waits for a taker that is gone.
        let (give, results) = sync_channel(WAITING);
        let mut failed: Option<(u64, MonteCarloError)> = None;
        for _ in 0..threads {
            let give = give.clone();
            let worker = move || {
                while end.load(Ordering::Relaxed) == NO_END {
                    let next = jobs.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some((place, job)) = next else { break };
                    let halt = Halt { place, end };
                    let result = job.and_then(|job| work(job, &halt));
                    let failed = result.is_err();
                    if halt.is_up() || give.send((place, result)).is_err() || failed {
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
            let result = match results.recv_timeout(LOOK_AROUND) {
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

    /// Job 2 fails first in time; when job 3 is halted for that, job 1 fails, too, and job 0 comes to its end.
    #[test]
    fn the_error_is_that_of_the_first_job_and_all_before_it_are_done() {
        let (has_begun, is_halted) = (AtomicBool::new(false), AtomicBool::new(false));
        let wait_for = |what: &dyn Fn() -> bool| {
            while !what() {
                thread::yield_now();
            }
        };
        let work = |job: u64, halt: &Halt<'_>| {
            match job {
                0 | 1 => wait_for(&|| is_halted.load(Ordering::Relaxed)),
                // Once it has failed, no other begins.
                2 => wait_for(&|| has_begun.load(Ordering::Relaxed)),
                3 => {
                    has_begun.store(true, Ordering::Relaxed);
                    wait_for(&|| halt.is_up());
                    is_halted.store(true, Ordering::Relaxed);
                }
                _ => {}
            }
            if [1, 2].contains(&job) { Err(MonteCarloError::seed(job, "it fails")) } else { Ok(job) }
        };
        let mut done = Vec::new();
        let worked = work_through((0..10).map(Ok), NonZeroUsize::new(4), &AtomicBool::new(false), work, |result| {
            done.extend(result);
            Ok(())
        });
        assert_eq!(worked.unwrap_err().to_string(), "seed 1: it fails");
        assert_eq!(done, [0]);
    }
}
