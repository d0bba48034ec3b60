//! Errors as Python exceptions. The classes are defined in python/standoff/errors.py, because exception types created
//! in Rust have no types in the stubs.

use pyo3::import_exception;
use pyo3::prelude::*;
use standoff_app::Failure;
use standoff_sim::monte_carlo::MonteCarloError;

import_exception!(standoff.errors, StandoffError);
import_exception!(standoff.errors, InputError);
import_exception!(standoff.errors, ScenarioError);

/// The exception for a failure. For errors in a scenario, its message shows the line and marks the position.
pub(crate) fn raised(failure: &Failure) -> PyErr {
    let text = failure.message(false).join("\n");
    match failure {
        Failure::Scenario(error) if !error.is_io_error => ScenarioError::new_err(text),
        Failure::Input(message) => InputError::new_err(message.clone()),
        Failure::Running(message) => StandoffError::new_err(message.clone()),
        _ => StandoffError::new_err(text),
    }
}

pub(crate) fn of_scenario(error: standoff_sim::scenario::ScenarioError) -> PyErr {
    raised(&Failure::Scenario(error))
}

/// The exception for a failed batch. An interruption is raised by the caller instead, as the exception that caused it.
pub(crate) fn of_batch(error: MonteCarloError) -> PyErr {
    raised(&standoff_app::of_batch(error))
}
