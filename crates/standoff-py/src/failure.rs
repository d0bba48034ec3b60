//! What goes wrong, as exceptions: python/standoff/errors.py has them, since what is made here has no types in the stubs.

use pyo3::import_exception;
use pyo3::prelude::*;
use standoff_results::Failure;
use standoff_sim::monte_carlo::MonteCarloError;

import_exception!(standoff.errors, StandoffError);
import_exception!(standoff.errors, InputError);
import_exception!(standoff.errors, ScenarioError);

/// As an exception; where something was typed, what is wrong is drawn under it.
pub(crate) fn raised(failure: &Failure) -> PyErr {
    let told = failure.told(false).join("\n");
    match failure {
        Failure::Scenario(error) if !error.is_machine_s => ScenarioError::new_err(told),
        Failure::Input(message) => InputError::new_err(message.clone()),
        Failure::Running(message) => StandoffError::new_err(message.clone()),
        _ => StandoffError::new_err(told),
    }
}

pub(crate) fn of_scenario(error: standoff_sim::scenario::ScenarioError) -> PyErr {
    raised(&Failure::Scenario(error))
}

/// Of a batch of runs. Whoever interrupts it raises what has interrupted it.
pub(crate) fn of_batch(error: MonteCarloError) -> PyErr {
    raised(&standoff_results::of_batch(error))
}
