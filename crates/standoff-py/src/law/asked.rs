//! A law being asked, on a thread of its own (python/standoff/_asking.py): what it raised, and whether it still answers.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::PyTypeInfo;
use pyo3::exceptions::{PyKeyboardInterrupt, PyTimeoutError};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyTuple};
use standoff_results::GLANCE;

use crate::failure::{InputError, StandoffError};

/// What a law has answered, or raised.
type Answer = Result<Py<PyAny>, PyErr>;

/// A thread on which laws are asked, and what came of it.
pub(crate) struct Asked {
    /// What takes a question.
    put: Py<PyAny>,
    /// The functions that read answers.
    reads: Py<PyAny>,
    answers: Mutex<Receiver<Answer>>,
    /// The thread, as Python counts threads.
    thread: u64,
    limit: Duration,
    /// Nobody waits for answers any more.
    stop: Arc<AtomicBool>,
    raised: Mutex<Option<PyErr>>,
    has_failed: AtomicBool,
}

impl Asked {
    /// A thread that may take so many seconds for an answer, and is no longer waited for once `stop` is set.
    pub(crate) fn within(py: Python<'_>, limit_s: f64, stop: &Arc<AtomicBool>) -> PyResult<Arc<Self>> {
        let limit = Duration::try_from_secs_f64(limit_s).ok().filter(|limit| !limit.is_zero());
        let limit = limit.ok_or_else(|| {
            InputError::new_err(format!("law_limit_s = {limit_s:?}: must be a time in seconds, above 0"))
        })?;
        let reads = py.import("standoff._asking")?;
        let (give, answers) = channel();
        let deliver = PyCFunction::new_closure(py, None, None, move |answered, _| {
            let (answer, raised) = answered.extract::<(Py<PyAny>, Option<Bound<'_, PyAny>>)>()?;
            // Whoever has gone needs no answer.
            let _ = give.send(raised.map_or(Ok(answer), |raised| Err(PyErr::from_value(raised))));
            PyResult::Ok(())
        })?;
        let (put, thread) = reads.call_method1("begin", (deliver,))?.extract()?;
        Ok(Arc::new(Self {
            put,
            reads: reads.into_any().unbind(),
            answers: Mutex::new(answers),
            thread,
            limit,
            stop: Arc::clone(stop),
            raised: Mutex::new(None),
            has_failed: AtomicBool::new(false),
        }))
    }

    /// Something was raised: the mission ends.
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// The first error counts.
    pub(crate) fn fail(&self, error: PyErr) {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.has_failed.store(true, Ordering::Relaxed);
    }

    /// What was raised, once.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Calls something of a law's, and has the answer read by the function called `read`, which takes `how`, too.
    pub(crate) fn ask<'py>(
        &self,
        call: &Bound<'py, PyAny>,
        arguments: Bound<'py, PyTuple>,
        read: &str,
        how: Bound<'py, PyTuple>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = call.py();
        let read = self.reads.bind(py).getattr(read)?;
        self.put.call1(py, ((call, arguments, read, how),))?;
        let answer = py.detach(|| self.wait());
        if answer.is_err() {
            // What comes later is an answer to nothing that is asked then.
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

    /// The answer; an error if it is overdue, or not needed any more.
    fn wait(&self) -> Result<Answer, PyErr> {
        let (answers, began) = (self.answers.lock().unwrap_or_else(PoisonError::into_inner), Instant::now());
        loop {
            match answers.recv_timeout(GLANCE.min(self.limit)) {
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
                    return Err(StandoffError::new_err("the thread of the law has ended"));
                }
            }
        }
    }

    /// Raises an exception in the thread, at its next step of Python: one that never answers need not go on.
    fn interrupt(&self, py: Python<'_>) -> PyResult<()> {
        let ctypes = py.import("ctypes")?;
        let ident = ctypes.getattr("c_ulong")?.call1((self.thread,))?;
        let exception = ctypes.getattr("py_object")?.call1((PyTimeoutError::type_object(py),))?;
        ctypes.getattr("pythonapi")?.call_method1("PyThreadState_SetAsyncExc", (ident, exception)).map(|_| ())
    }
}

impl Drop for Asked {
    /// Ends the thread, once it has answered.
    fn drop(&mut self) {
        Python::attach(|py| {
            let _ = self.put.call1(py, (py.None(),));
        });
    }
}
