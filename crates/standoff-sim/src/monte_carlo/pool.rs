//! Jobs on many threads, results on one.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
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

/// Does `work` on every job, on `threads` threads, one per core if `None`; hands each result to `take` on this thread as
/// it comes, and `None` now and then.
///
/// When `stop` is set or a job fails, the flag that `work` is given goes up. Work that sees it up may return anything: it
/// is dropped. What is complete is still taken, then the first error returned. An error of `take` ends all at once.
/// `threads` more than the system can start are an error; more than [`MAX_THREADS`] are not asked for.
pub(super) fn work_through<J, T: Send>(
    jobs: impl Iterator<Item = Result<J, MonteCarloError>> + Send,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
    work: impl Fn(J, &AtomicBool) -> Result<T, MonteCarloError> + Sync,
    mut take: impl FnMut(Option<T>) -> Result<(), MonteCarloError>,
) -> Result<(), MonteCarloError> {
    let threads =
        threads.or_else(|| thread::available_parallelism().ok()).map_or(1, |threads| threads.get().min(MAX_THREADS));
    let (jobs, work, halt) = (&Mutex::new(jobs), &work, &AtomicBool::new(stop.load(Ordering::Relaxed)));
    thread::scope(|scope| {
        // It goes when this closure ends: no worker waits for a taker that is gone.
        let (give, results) = sync_channel(WAITING);
        let mut failed = Ok(());
        for _ in 0..threads {
            let give = give.clone();
            let worker = move || {
                while !halt.load(Ordering::Relaxed) {
                    let Some(job) = jobs.lock().unwrap_or_else(PoisonError::into_inner).next() else { break };
                    let result = job.and_then(|job| work(job, halt));
                    let failed = result.is_err();
                    if halt.load(Ordering::Relaxed) || give.send(result).is_err() || failed {
                        break;
                    }
                }
            };
            if let Err(reason) = thread::Builder::new().spawn_scoped(scope, worker) {
                halt.store(true, Ordering::Relaxed);
                failed = Err(MonteCarloError::Threads { threads, reason });
                break;
            }
        }
        drop(give);
        loop {
            let result = match results.recv_timeout(LOOK_AROUND) {
                Ok(result) => result.map(Some),
                Err(RecvTimeoutError::Timeout) => Ok(None),
                Err(RecvTimeoutError::Disconnected) => return failed,
            };
            match result {
                Ok(result) => take(result).inspect_err(|_| halt.store(true, Ordering::Relaxed))?,
                Err(error) => {
                    halt.store(true, Ordering::Relaxed);
                    failed = failed.and(Err(error));
                }
            }
            if stop.load(Ordering::Relaxed) {
                halt.store(true, Ordering::Relaxed);
            }
        }
    })
}
