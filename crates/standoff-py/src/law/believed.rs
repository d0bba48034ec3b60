//! What a law tells of what it believes, for the scores.

use pyo3::prelude::*;
use standoff_sim::brain::{Place, TrackRow, TrackStatus};

use standoff::Allowed;

use crate::failure::InputError;
use crate::pieces::array::{Given, Rows, common};

/// What a law of your own believes of targets: what its method ``tracks`` gives, where it has one, so that its estimates
/// are scored.
///
/// :param target: ``(T,)``: what sensors call the targets, each once.
/// :param state: ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
/// :param covariance: ``(T, 6, 6)``: covariance of ``state``, of which its upper triangle counts.
/// :raises InputError: arrays of other shapes or types, a number that is not finite, a target that is none.
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
            let wrong = || InputError::new_err(format!("target has {number}: must be from 0 to {}", u32::MAX));
            let target = u32::try_from(number).map_err(|_| wrong())?;
            let whole = covariance.at(index);
            let mut upper = [0.0; 21];
            let places = (0..6).flat_map(|row| (row..6).map(move |column| 6 * row + column));
            upper.iter_mut().zip(places).for_each(|(to, from)| *to = whole[from]);
            Ok(TrackRow {
                target,
                track: target,
                status: TrackStatus::Held,
                place: Place::Unassigned,
                group: None,
                to_group: None,
                state: state.at(index),
                covariance: upper,
            })
        };
        Ok(Self { rows: (0..lead.iter().product()).map(row).collect::<PyResult<_>>()? })
    }
}
