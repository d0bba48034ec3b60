//! The Python extension module `standoff._standoff`, on which the package `standoff` in `python/` is built.

mod batch;
mod common_args;
mod comparison;
mod components;
mod envs;
mod exceptions;
mod folder;
mod interruptible;
mod law;
mod metrics_table;
mod notebook_repr;
mod run;
mod scenario;
mod sweep;
mod table;

use pyo3::prelude::*;

/// Cooperative standoff tracking: runs, batches, custom laws, and components of the library on NumPy arrays.
#[pymodule(gil_used = false)]
mod _standoff {
    #[pymodule_export]
    use super::batch::{_described, _difference, _fly_described, Batch, merge, monte_carlo};
    #[pymodule_export]
    use super::comparison::{Comparison, compare};
    #[pymodule_export]
    use super::components::{Filter, StandoffDistance, Steering, standoff_distance, steer};
    #[pymodule_export]
    use super::envs::{EnvStep, Worlds, observation_features};
    #[pymodule_export]
    use super::law::{
        AssignmentProblem, Command, Intruder, MissionInfo, Observation, ReceivedCue, ReceivedReport, TeamState, Tracks,
        Zone,
    };
    #[pymodule_export]
    use super::run::{Run, baseline, run};
    #[pymodule_export]
    use super::scenario::{Scenario, scenarios};
    #[pymodule_export]
    use super::sweep::{_sweep_complete, _sweep_difference, _sweep_plan, Sweep, sweep};
    #[pymodule_export]
    use super::table::Table;

    #[expect(non_upper_case_globals, reason = "this is the conventional Python name")]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
