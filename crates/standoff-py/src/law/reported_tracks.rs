//! Tracks that a custom law reports, so that its estimates are scored.

use pyo3::prelude::*;
use standoff_sim::controller::{TrackRow, TrackStatus};

use standoff::validation::Allowed;

use crate::components::array::{Arguments, Given, upper_triangle};
use crate::exceptions::InputError;

/// Target estimates of a custom law. The optional method ``tracks`` of a law returns them, so that they are scored.
///
/// :param target: shape ``(T,)``, sensor-reported identities of the targets, without duplicates.
/// :param state: shape ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
/// :param covariance: shape ``(T, 6, 6)``, covariance of ``state``; only the upper triangle is used.
/// :raises InputError: if an array has the wrong shape or type, a value is not finite, or a target is out of range.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Tracks {
    pub(super) rows: Vec<TrackRow>,
}

#[pymethods]
impl Tracks {
    #[new]
    fn new(target: Given<'_>, state: Given<'_>, covariance: Given<'_>) -> PyResult<Self> {
        let mut arguments = Arguments::default();
        let target = arguments.read(&target, "target", &[], Allowed::at_least(0.0).at_most(u32::MAX.into()))?;
        let state = arguments.read(&state, "state", &[6], Allowed::FINITE)?;
        let covariance = arguments.read(&covariance, "covariance", &[6, 6], Allowed::FINITE)?;
        let row = |index: usize| {
            let number = target.one(index);
            if number.fract() != 0.0 {
                return Err(InputError::new_err(format!("target = {number}: must be a whole number")));
            }
            let target = number as u32;
            Ok(TrackRow {
                target,
                track: target,
                status: TrackStatus::Updated,
                state: state.at(index),
                covariance: upper_triangle(&covariance.at(index)),
                ..TrackRow::default()
            })
        };
        Ok(Self { rows: (0..arguments.count().unwrap_or(1)).map(row).collect::<PyResult<_>>()? })
    }
}
