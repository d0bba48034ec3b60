//! The Python module `standoff._standoff`: what the package `standoff` in `python/` is made of.

mod asked_for;
mod batch;
mod comparison;
mod envs;
mod failure;
mod folder;
mod html;
mod law;
mod pieces;
mod positional;
mod run;
mod scenario;
mod table;
mod waiting;

use pyo3::prelude::*;

/// Cooperative standoff tracking: runs, batches, laws of your own, and the library's pieces on arrays.
#[pymodule(gil_used = false)]
mod _standoff {
    #[pymodule_export]
    use super::batch::{_described, _difference, _fly_described, Batch, merge, monte_carlo};
    #[pymodule_export]
    use super::comparison::{Comparison, compare};
    #[pymodule_export]
    use super::envs::{Instant, Worlds, observation_features};
    #[pymodule_export]
    use super::law::{Briefing, Choice, Command, Cued, Heard, Intruder, Observed, Picture, Tracks, Zone};
    #[pymodule_export]
    use super::pieces::{
        Filter, Parameters, StandoffDistance, Steering, assignment, best_separation_rad, clustering, group_count,
        information_1_m2, led_distance, measure, pair_information_1_m4, smallest_circle, standoff_distance, steer,
        vector_field, wrapped_angle_rad,
    };
    #[pymodule_export]
    use super::run::{Run, run, yardstick};
    #[pymodule_export]
    use super::scenario::{Scenario, scenarios};
    #[pymodule_export]
    use super::table::Table;

    #[expect(non_upper_case_globals, reason = "it is called so in Python")]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
