//! The Python module `standoff._standoff`: what the package `standoff` in `python/` is made of.

mod failure;
mod law;
mod pieces;
mod scenario;

use pyo3::prelude::*;

/// Cooperative standoff tracking: runs, batches, laws of your own, and the library's pieces on arrays.
#[pymodule(gil_used = false)]
mod _standoff {
    #[pymodule_export]
    use super::failure::{InputError, ScenarioError, StandoffError};
    #[pymodule_export]
    use super::pieces::wrapped_angle_rad;
    #[pymodule_export]
    use super::scenario::{Scenario, scenarios};

    #[expect(non_upper_case_globals, reason = "it is called so in Python")]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
