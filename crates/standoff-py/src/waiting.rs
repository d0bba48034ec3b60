//! Work on a thread of its own, while Python's own thread listens to Ctrl-C.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use pyo3::prelude::*;
use standoff_results::{Failure, GLANCE, done_unless};
use standoff_sim::monte_carlo::Progress;

use crate::failure::{StandoffError, raised};

/// What work came to, and what was raised meanwhile.
pub(crate) struct Ended<T> {
    pub(crate) done: T,
    pub(crate) raised: Option<PyErr>,
}

/// Does `work` with the GIL released. Ctrl-C, and what `glance` raises, set `stop`, at which the work has to end.
pub(crate) fn listening<T: Send + 'static>(
    py: Python<'_>,
    stop: &AtomicBool,
    mut glance: impl FnMut() -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<Ended<T>> {
    let (give, result) = channel();
    let worker = thread::Builder::new().name("standoff".to_owned()).spawn(move || give.send(work()));
    let worker = worker.map_err(|reason| StandoffError::new_err(format!("a thread cannot be started: {reason}")))?;
    // Whoever waits without the GIL may share nothing that is for one thread alone.
    let result = Mutex::new(result);
    let wait = |result: &Mutex<Receiver<T>>| result.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(GLANCE);
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
            raised = py.check_signals().and_then(|()| glance()).err();
            stop.store(raised.is_some(), Ordering::Relaxed);
        }
    }
}

/// Where a batch tells how far it is.
pub(crate) type Told = Mutex<Option<Progress>>;

/// The same for a batch. `progress` is called with what is done and of how many: at every glance, and at the end.
pub(crate) fn while_listening<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&AtomicBool, &Told) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let (stop, told) = (Arc::new(AtomicBool::new(false)), Arc::new(Told::default()));
    let tell = || {
        // What tells must not wait for who listens.
        let now = *told.lock().unwrap_or_else(PoisonError::into_inner);
        match (progress, now) {
            (Some(progress), Some(Progress { done, of, .. })) => progress.call1((done, of)).map(|_| ()),
            _ => Ok(()),
        }
    };
    let (of_work, tells) = (Arc::clone(&stop), Arc::clone(&told));
    let ended = listening(py, &stop, tell, move || work(&of_work, &tells))?;
    // What was raised comes first: that it was stopped follows from it.
    ended.raised.map_or(Ok(()), Err)?;
    let done = ended.done.map_err(|failure| raised(&failure))?;
    tell().map(|()| done)
}

/// Does what nobody needs once Ctrl-C has come: then it is left where it is.
pub(crate) fn unless_interrupted<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let ended = listening(py, &stop, || Ok(()), move || done_unless(|| stopped.load(Ordering::Relaxed), work))?;
    ended.raised.map_or(Ok(()), Err)?;
    ended.done.ok_or_else(|| StandoffError::new_err("the work was left where it was"))
}
