//! Arguments of several functions, and what is told of them.

use std::ffi::CString;
use std::num::NonZeroUsize;

use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use standoff_sim::scenario::Scenario;
use standoff_sim::score::Choice;

use crate::failure::InputError;

/// Metrics that are asked for.
#[derive(FromPyObject)]
pub(crate) enum Wanted {
    /// With commas between.
    #[pyo3(transparent, annotation = "str")]
    Text(String),
    #[pyo3(transparent, annotation = "list[str]")]
    Names(Vec<String>),
}

impl Default for Wanted {
    fn default() -> Self {
        Self::Text("standard".to_owned())
    }
}

impl Wanted {
    pub(crate) fn choice(&self) -> PyResult<Choice> {
        let choice = match self {
            Self::Text(text) => Choice::parse(text),
            Self::Names(names) => Choice::parse(&names.join(",")),
        };
        choice.map_err(|what| InputError::new_err(format!("metrics: {what}")))
    }
}

/// A number of things, at least so many.
pub(crate) fn count(name: &str, number: i64, least: u64) -> PyResult<u64> {
    let counted = u64::try_from(number).ok().filter(|number| *number >= least);
    counted.ok_or_else(|| InputError::new_err(format!("{name} = {number}: must be at least {least}")))
}

/// A number of threads; `None`: one per core.
pub(crate) fn number_of_threads(threads: Option<i64>) -> PyResult<Option<NonZeroUsize>> {
    let counted = threads.map(|threads| count("threads", threads, 1)).transpose()?;
    Ok(counted.and_then(|threads| NonZeroUsize::new(usize::try_from(threads).unwrap_or(usize::MAX))))
}

/// Warns of what is odd about a scenario.
pub(crate) fn warn(py: Python<'_>, scenario: &Scenario) -> PyResult<()> {
    scenario.warnings.iter().try_for_each(|what| warning(py, what))
}

/// A warning of Python's.
pub(crate) fn warning(py: Python<'_>, what: &str) -> PyResult<()> {
    let what = CString::new(what.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &what, 1)
}

/// JSON as Python has it.
pub(crate) fn json<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
