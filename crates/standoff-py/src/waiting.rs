//! Work on a thread of its own, while Python's own thread listens: to Ctrl-C, and whether a law still answers.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use standoff_results::{Failure, GLANCE};
use standoff_sim::monte_carlo::Progress;

use crate::failure::{StandoffError, raised};
use crate::law::Answering;

/// How long work may take to end once it is told to, if it asks a law: without one it ends in any case.
const PATIENCE: Duration = Duration::from_secs(2);

/// What work came to, and what was raised meanwhile.
pub(crate) struct Ended<T> {
    pub(crate) done: T,
    pub(crate) raised: Option<PyErr>,
}

/// Does `work` with the GIL released. Ctrl-C, what `glance` raises, and a law that answers too late set `stop`, at which
/// the work has to end.
///
/// Work that does not, since a law never answers, is left behind with its thread: then what was raised is the error.
pub(crate) fn listening<T: Send + 'static>(
    py: Python<'_>,
    stop: &AtomicBool,
    law: Option<&Answering>,
    mut glance: impl FnMut() -> PyResult<()>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<Ended<T>> {
    let (give, result) = channel();
    let worker = thread::Builder::new().name("standoff".to_owned()).spawn(move || give.send(work()));
    let worker = worker.map_err(|reason| StandoffError::new_err(format!("a thread cannot be started: {reason}")))?;
    // Whoever waits without the GIL may share nothing that is for one thread alone.
    let result = Mutex::new(result);
    let wait = |result: &Mutex<Receiver<T>>| result.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(GLANCE);
    let mut raised: Option<(PyErr, Instant)> = None;
    loop {
        match py.detach(|| wait(&result)) {
            Ok(done) => {
                let raised = raised.map_or_else(|| py.check_signals().err(), |(error, _)| Some(error));
                return Ok(Ended { done, raised });
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(_) => return Err(StandoffError::new_err("the work has ended without a result")),
            },
        }
        match raised {
            Some((error, since)) if law.is_some() && since.elapsed() > PATIENCE => return Err(error),
            Some(_) => {}
            None => {
                let heard = py.check_signals().and_then(|()| law.map_or(Ok(()), Answering::check));
                raised = heard.and_then(|()| glance()).err().map(|error| (error, Instant::now()));
                stop.store(raised.is_some(), Ordering::Relaxed);
                if let (Some(_), Some(law)) = (&raised, law) {
                    law.asked.interrupt(py)?;
                }
            }
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
    let tell = || match (progress, *told.lock().unwrap_or_else(PoisonError::into_inner)) {
        (Some(progress), Some(Progress { done, of, .. })) => progress.call1((done, of)).map(|_| ()),
        _ => Ok(()),
    };
    let (of_work, tells) = (Arc::clone(&stop), Arc::clone(&told));
    let ended = listening(py, &stop, None, tell, move || work(&of_work, &tells))?;
    // What was raised comes first: that it was stopped follows from it.
    ended.raised.map_or(Ok(()), Err)?;
    let done = ended.done.map_err(|failure| raised(&failure))?;
    tell().map(|()| done)
}
