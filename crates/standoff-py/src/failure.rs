//! What goes wrong, as exceptions.

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;

create_exception!(standoff, StandoffError, PyException, "Something failed while running: a disk, a run.");
create_exception!(standoff, InputError, PyValueError, "Wrong input: a scenario, a record, an argument.");
create_exception!(
    standoff,
    ScenarioError,
    InputError,
    "A scenario that cannot be used; what is wrong is drawn under what was typed."
);

pub(crate) fn of_scenario(error: standoff_sim::scenario::ScenarioError) -> PyErr {
    if error.is_machine_s {
        StandoffError::new_err(error.to_string())
    } else {
        ScenarioError::new_err(error.to_string())
    }
}
