//! Tracks that a custom law reports, so that its estimates are scored.

use pyo3::prelude::*;
use standoff_sim::controller::{TrackRow, TrackStatus};

use standoff::validation::Allowed;

use crate::components::array::{Given, Rows, common};
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
        let target = Rows::<i64, 1>::read(&target, "target", "T")?;
        let state = Rows::<f64, 6>::read(&state, "state", "T, 6")?.within(Allowed::FINITE, None)?;
        let covariance = Rows::<f64, 36>::read(&covariance, "covariance", "T, 6, 6")?.within(Allowed::FINITE, None)?;
        let lead = common(&[target.axes(), state.axes(), covariance.axes()])?;
        let (target, state, covariance) = (target.over(&lead)?, state.over(&lead)?, covariance.over(&lead)?);
        let row = |index: usize| {
            let number = target.one(index);
            let wrong = || InputError::new_err(format!("target = {number}: must be between 0 and {}", u32::MAX));
            let target = u32::try_from(number).map_err(|_| wrong())?;
            let whole = covariance.at(index);
            let mut upper = [0.0; 21];
            let places = (0..6).flat_map(|row| (row..6).map(move |column| 6 * row + column));
            upper.iter_mut().zip(places).for_each(|(to, from)| *to = whole[from]);
            Ok(TrackRow {
                target,
                track: target,
                status: TrackStatus::Updated,
                state: state.at(index),
                covariance: upper,
                ..TrackRow::default()
            })
        };
        Ok(Self { rows: (0..lead.iter().product()).map(row).collect::<PyResult<_>>()? })
    }
}
