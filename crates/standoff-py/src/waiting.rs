//! Work on a thread of its own, while Python's own thread listens: to Ctrl-C, and whether a law still answers.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::PyTimeoutError;
use pyo3::prelude::*;
use standoff_results::GLANCE;

use crate::failure::StandoffError;
use crate::law::Asked;

/// How long work may take to end once it is told to.
const PATIENCE: Duration = Duration::from_secs(2);

/// A law that is asked, and how long it may take to answer.
pub(crate) struct Answering {
    pub(crate) asked: Arc<Asked>,
    pub(crate) limit: Duration,
}

/// What work came to, and what was raised meanwhile.
pub(crate) struct Ended<T> {
    pub(crate) done: T,
    pub(crate) raised: Option<PyErr>,
}

/// Does `work` with the GIL released. Ctrl-C, and a law that answers too late, set `stop`, at which the work has to end.
///
/// Work that does not, since a law never answers, is left behind with its thread, and an error says so.
pub(crate) fn listening<T: Send + 'static>(
    py: Python<'_>,
    stop: &Arc<AtomicBool>,
    law: Option<&Answering>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<Ended<T>> {
    let (give, result) = channel();
    let worker = thread::Builder::new().name("standoff".to_owned()).spawn(move || give.send(work()));
    let worker = worker.map_err(|reason| StandoffError::new_err(format!("a thread cannot be started: {reason}")))?;
    let mut raised: Option<(PyErr, Instant)> = None;
    // The receiver is for one thread alone, which this stays.
    let result = std::sync::Mutex::new(result);
    loop {
        let received = py.detach(|| {
            let result = result.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            result.recv_timeout(GLANCE)
        });
        match received {
            Ok(done) => return Ok(Ended { done, raised: raised.map(|(error, _)| error) }),
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(_) => return Err(StandoffError::new_err("the work ended without a result")),
            },
            Err(RecvTimeoutError::Timeout) => {}
        }
        match raised {
            Some((error, since)) if since.elapsed() > PATIENCE => return Err(error),
            Some(_) => {}
            None => {
                raised = py.check_signals().and_then(|()| is_answered(py, law)).err().map(|error| (error, Instant::now()));
                stop.store(raised.is_some(), Ordering::Relaxed);
                if let (Some(_), Some(Answering { asked, .. })) = (&raised, law) {
                    asked.interrupt(py, PyTimeoutError::type_object(py).as_any())?;
                }
            }
        }
    }
}

use pyo3::PyTypeInfo;

/// Fails if the answer of a law is overdue.
fn is_answered(py: Python<'_>, law: Option<&Answering>) -> PyResult<()> {
    let Some(Answering { asked, limit }) = law else { return Ok(()) };
    match asked.awaited() {
        Some(awaited) if awaited > *limit => {
            let _ = py;
            let limit_s = limit.as_secs_f64();
            let what = "its thread is left behind if it goes on; give it more time with law_limit_s";
            Err(StandoffError::new_err(format!("the law has not answered within {limit_s} s; {what}")))
        }
        _ => Ok(()),
    }
}
