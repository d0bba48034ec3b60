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
/// :param group: ``(T,)``: the group whose duty each is; -1: none. With it ``watched_fraction`` is scored.
/// :raises InputError: arrays of other shapes or types, a number that is not finite, a target that is none.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Tracks {
    pub(super) rows: Vec<TrackRow>,
}

/// What targets and groups can be called.
const NUMBER_MAX: i64 = u32::MAX as i64;

#[pymethods]
impl Tracks {
    #[new]
    #[pyo3(signature = (target, state, covariance, *, group=None))]
    fn new(target: Given<'_>, state: Given<'_>, covariance: Given<'_>, group: Option<Given<'_>>) -> PyResult<Self> {
        let target = Rows::<i64, 1>::read(&target, "target", "T")?;
        let state = Rows::<f64, 6>::read(&state, "state", "T, 6")?.within(Allowed::FINITE, None)?;
        let covariance = Rows::<f64, 36>::read(&covariance, "covariance", "T, 6, 6")?.within(Allowed::FINITE, None)?;
        let group = Rows::or(Rows::<i64, 1>::read_if(group.as_ref(), "group", "T")?, "group", [-1]);
        let lead = common(&[target.axes(), state.axes(), covariance.axes(), group.axes()])?;
        let count = lead.iter().product();
        let (target, state) = (target.over(&lead)?, state.over(&lead)?);
        let (covariance, group) = (covariance.over(&lead)?, group.over(&lead)?);
        let number = |name: &str, number: i64| {
            let wrong = || InputError::new_err(format!("{name} has {number}: must be from 0 to {NUMBER_MAX}"));
            u32::try_from(number).map_err(|_| wrong())
        };
        let row = |index: usize| {
            let group = Some(group.one(index)).filter(|group| *group >= 0).map(|group| number("group", group));
            let mut upper = [0.0; 21];
            let whole = covariance.at(index);
            let places = (0..6).flat_map(|row| (row..6).map(move |column| 6 * row + column));
            upper.iter_mut().zip(places).for_each(|(to, from)| *to = whole[from]);
            let target = number("target", target.one(index))?;
            let group = group.transpose()?;
            Ok(TrackRow {
                target,
                track: target,
                status: TrackStatus::Held,
                place: if group.is_some() { Place::Member } else { Place::Unassigned },
                group,
                to_group: None,
                state: state.at(index),
                covariance: upper,
            })
        };
        Ok(Self { rows: (0..count).map(row).collect::<PyResult<_>>()? })
    }
}
