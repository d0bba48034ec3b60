//! A law being asked: what it raised, and whether it still answers.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::PyTypeInfo;
use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyTimeoutError;
use pyo3::prelude::*;

use crate::failure::{InputError, StandoffError};

/// What is known of a law that is asked on one thread, to whoever waits on another.
pub(crate) struct Asked {
    raised: Mutex<Option<PyErr>>,
    has_failed: AtomicBool,
    begun: Instant,
    /// When the answer that is awaited was asked for, microseconds since `begun`, and one; 0: none is.
    since_us: AtomicU64,
    /// The thread that asks, as Python counts threads.
    thread: AtomicU64,
}

impl Asked {
    pub(crate) fn new() -> Self {
        Self {
            raised: Mutex::new(None),
            has_failed: AtomicBool::new(false),
            begun: Instant::now(),
            since_us: AtomicU64::new(0),
            thread: AtomicU64::new(0),
        }
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

    /// Asks a law something, by the name of its method.
    pub(crate) fn ask<'py>(
        &self,
        law: &Bound<'py, PyAny>,
        method: &str,
        observed: impl PyCallArgs<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.thread.load(Ordering::Relaxed) == 0 {
            let ident: u64 = law.py().import("threading")?.call_method0("get_ident")?.extract()?;
            self.thread.store(ident, Ordering::Relaxed);
        }
        let now_us = self.begun.elapsed().as_micros() as u64;
        self.since_us.store(now_us + 1, Ordering::Relaxed);
        let answer = law.call_method1(method, observed);
        self.since_us.store(0, Ordering::Relaxed);
        answer
    }

    /// How long an answer has been awaited; `None`: none is.
    pub(crate) fn awaited(&self) -> Option<Duration> {
        let since = Duration::from_micros(self.since_us.load(Ordering::Relaxed).checked_sub(1)?);
        Some(self.begun.elapsed().saturating_sub(since))
    }

    /// Raises an exception in the thread that asks, at its next step of Python; nothing where none is asked.
    pub(crate) fn interrupt(&self, py: Python<'_>) -> PyResult<()> {
        if self.awaited().is_none() {
            return Ok(());
        }
        let ctypes = py.import("ctypes")?;
        let ident = ctypes.getattr("c_ulong")?.call1((self.thread.load(Ordering::Relaxed),))?;
        let exception = ctypes.getattr("py_object")?.call1((PyTimeoutError::type_object(py),))?;
        ctypes.getattr("pythonapi")?.call_method1("PyThreadState_SetAsyncExc", (ident, exception)).map(|_| ())
    }
}

/// A law that is asked, and how long it may take to answer.
pub(crate) struct Answering {
    pub(crate) asked: Arc<Asked>,
    limit: Duration,
}

impl Answering {
    /// With a limit in seconds.
    pub(crate) fn within(limit_s: f64) -> PyResult<Self> {
        match Duration::try_from_secs_f64(limit_s) {
            Ok(limit) if !limit.is_zero() => Ok(Self { asked: Arc::new(Asked::new()), limit }),
            _ => Err(InputError::new_err(format!("law_limit_s = {limit_s}: must be a time in seconds, above 0"))),
        }
    }

    /// Fails if an answer is overdue.
    pub(crate) fn check(&self) -> PyResult<()> {
        match self.asked.awaited() {
            Some(awaited) if awaited > self.limit => {
                let limit_s = self.limit.as_secs_f64();
                let what = "the run ends; give the law more time with law_limit_s";
                Err(StandoffError::new_err(format!("the law has not answered within {limit_s} s: {what}")))
            }
            _ => Ok(()),
        }
    }
}
