//! Calls of custom laws on a separate Python thread (python/standoff/_law_thread.py), with time limit and error
//! handling.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::PyTypeInfo;
use pyo3::exceptions::{PyKeyboardInterrupt, PyTimeoutError};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyTuple};
use standoff_app::POLL;

use crate::exceptions::{InputError, StandoffError};

/// Return value of a law, or the exception that it raised.
type CallResult = Result<Py<PyAny>, PyErr>;

/// A Python thread that calls laws, with the first error.
pub(crate) struct LawCalls {
    /// Python function that queues a call.
    put: Py<PyAny>,
    /// Python module with the functions that convert answers.
    converters: Py<PyAny>,
    answers: Mutex<Receiver<CallResult>>,
    /// Python's identifier of the thread.
    thread: u64,
    limit: Duration,
    /// Set when the run is interrupted: answers are then no longer awaited.
    stop: Arc<AtomicBool>,
    raised: Mutex<Option<PyErr>>,
    has_failed: AtomicBool,
}

impl LawCalls {
    /// Starts a thread. Each answer may take `limit_s` seconds; once `stop` is set, answers are no longer awaited.
    pub(crate) fn within(py: Python<'_>, limit_s: f64, stop: &Arc<AtomicBool>) -> PyResult<Arc<Self>> {
        let limit = Duration::try_from_secs_f64(limit_s).ok().filter(|limit| !limit.is_zero());
        let limit = limit.ok_or_else(|| {
            InputError::new_err(format!("law_limit_s = {limit_s:?}: must be a time in seconds, above 0"))
        })?;
        let converters = py.import("standoff._law_thread")?;
        let (give, answers) = channel();
        let deliver = PyCFunction::new_closure(py, None, None, move |answered, _| {
            let (answer, raised) = answered.extract::<(Py<PyAny>, Option<Bound<'_, PyAny>>)>()?;
            // If the receiver is gone, the answer is not needed.
            let _ = give.send(raised.map_or(Ok(answer), |raised| Err(PyErr::from_value(raised))));
            PyResult::Ok(())
        })?;
        let (put, thread) = converters.call_method1("begin", (deliver,))?.extract()?;
        Ok(Arc::new(Self {
            put,
            converters: converters.into_any().unbind(),
            answers: Mutex::new(answers),
            thread,
            limit,
            stop: Arc::clone(stop),
            raised: Mutex::new(None),
            has_failed: AtomicBool::new(false),
        }))
    }

    /// True after an error; the mission then ends.
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// Records an error; only the first one is kept.
    pub(crate) fn fail(&self, error: PyErr) {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.has_failed.store(true, Ordering::Relaxed);
    }

    /// Removes and returns the recorded error.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Calls a method of a law and converts its answer with the Python function `convert`, which also gets the
    /// arguments `convert_arguments`.
    pub(crate) fn call<'py>(
        &self,
        law: &Bound<'py, PyAny>,
        arguments: Bound<'py, PyTuple>,
        convert: &str,
        convert_arguments: Bound<'py, PyTuple>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = law.py();
        let convert = self.converters.bind(py).getattr(convert)?;
        self.put.call1(py, ((law, arguments, convert, convert_arguments),))?;
        let answer = py.detach(|| self.wait());
        if answer.is_err() {
            // A late answer must not be taken for the answer to a later call.
            self.has_failed.store(true, Ordering::Relaxed);
        }
        match answer {
            Ok(answer) => answer.map(|answer| answer.into_bound(py)),
            Err(error) => {
                self.interrupt(py)?;
                Err(error)
            }
        }
    }

    /// Waits for the answer. Returns an error if it is overdue or no longer needed.
    fn wait(&self) -> Result<CallResult, PyErr> {
        let (answers, began) = (self.answers.lock().unwrap_or_else(PoisonError::into_inner), Instant::now());
        loop {
            match answers.recv_timeout(POLL.min(self.limit)) {
                Ok(answer) => return Ok(answer),
                Err(RecvTimeoutError::Timeout) if self.stop.load(Ordering::Relaxed) => {
                    return Err(PyKeyboardInterrupt::new_err(()));
                }
                Err(RecvTimeoutError::Timeout) if began.elapsed() < self.limit => {}
                Err(RecvTimeoutError::Timeout) => {
                    let limit_s = self.limit.as_secs_f64();
                    let what = "the run ends; give the law more time with law_limit_s";
                    return Err(StandoffError::new_err(format!("the law has not answered within {limit_s} s: {what}")));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(StandoffError::new_err("the thread that calls the law has ended"));
                }
            }
        }
    }

    /// Raises an exception in the thread at its next Python instruction, to end a law that does not return.
    fn interrupt(&self, py: Python<'_>) -> PyResult<()> {
        let ctypes = py.import("ctypes")?;
        let ident = ctypes.getattr("c_ulong")?.call1((self.thread,))?;
        let exception = ctypes.getattr("py_object")?.call1((PyTimeoutError::type_object(py),))?;
        ctypes.getattr("pythonapi")?.call_method1("PyThreadState_SetAsyncExc", (ident, exception)).map(|_| ())
    }
}

impl Drop for LawCalls {
    /// Ends the thread after its current call.
    fn drop(&mut self) {
        Python::attach(|py| {
            let _ = self.put.call1(py, (py.None(),));
        });
    }
}
