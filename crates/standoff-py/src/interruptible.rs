//! Runs work on a separate thread while the Python thread checks for Ctrl-C.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use pyo3::prelude::*;
use standoff_app::{Failure, POLL, run_interruptible};
use standoff_sim::monte_carlo::Progress;

use crate::exceptions::{StandoffError, raised};

/// Result of the work, and the exception raised while it ran.
pub(crate) struct Ended<T> {
    pub(crate) done: T,
    pub(crate) raised: Option<PyErr>,
}

/// Runs `work` on another thread with the GIL released. Ctrl-C, or an exception from `on_poll`, which is called at
/// every poll, sets `stop`; the work must then end.
pub(crate) fn until_done<T: Send + 'static>(
    py: Python<'_>,
    stop: &AtomicBool,
    mut on_poll: impl FnMut() -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<Ended<T>> {
    let (give, result) = channel();
    let worker = thread::Builder::new().name("standoff".to_owned()).spawn(move || give.send(work()));
    let worker = worker.map_err(|reason| StandoffError::new_err(format!("a thread cannot be started: {reason}")))?;
    // `Python::detach` needs a `Send` closure, and a reference to a `Receiver` is not `Send`.
    let result = Mutex::new(result);
    let wait = |result: &Mutex<Receiver<T>>| result.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(POLL);
    let mut raised: Option<PyErr> = None;
    loop {
        match py.detach(|| wait(&result)) {
            Ok(done) => {
                let raised = raised.or_else(|| py.check_signals().err());
                return Ok(Ended { done, raised });
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(_) => return Err(StandoffError::new_err("the work has ended without a result")),
            },
        }
        if raised.is_none() {
            raised = py.check_signals().and_then(|()| on_poll()).err();
            stop.store(raised.is_some(), Ordering::Relaxed);
        }
    }
}

/// Latest progress of a batch.
pub(crate) type LatestProgress = Mutex<Option<Progress>>;

/// Like [`until_done`], for a batch. `progress` is called with the numbers of completed and of all runs, at every poll
/// and at the end.
pub(crate) fn batch_until_done<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&AtomicBool, &LatestProgress) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let (stop, latest) = (Arc::new(AtomicBool::new(false)), Arc::new(LatestProgress::default()));
    let call_progress = || {
        // The lock is released before the call: the batch must not wait for the callback.
        let now = *latest.lock().unwrap_or_else(PoisonError::into_inner);
        match (progress, now) {
            (Some(progress), Some(Progress { done, of, .. })) => progress.call1((done, of)).map(|_| ()),
            _ => Ok(()),
        }
    };
    let (work_stop, work_latest) = (Arc::clone(&stop), Arc::clone(&latest));
    let ended = until_done(py, &stop, call_progress, move || work(&work_stop, &work_latest))?;
    // A raised exception takes precedence: it is the reason why the work was stopped.
    ended.raised.map_or(Ok(()), Err)?;
    let done = ended.done.map_err(|failure| raised(&failure))?;
    call_progress().map(|()| done)
}

/// Runs `work` unless Ctrl-C interrupts it. Interrupted work is abandoned, not awaited.
pub(crate) fn unless_interrupted<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let ended = until_done(py, &stop, || Ok(()), move || run_interruptible(|| stopped.load(Ordering::Relaxed), work))?;
    ended.raised.map_or(Ok(()), Err)?;
    ended.done.ok_or_else(|| StandoffError::new_err("the work was interrupted"))
}
