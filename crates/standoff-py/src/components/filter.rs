//! Extended information filters (8-11) for several targets.

use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use standoff::tracking::information_filter::Contribution;
use standoff::tracking::information_filter::InformationFilter;
use standoff::validation::Allowed;
use standoff::{
    Angle, Covariance, Cue, Duration, Estimate, Position, RangeBearingMeasurement, TargetLabel, TargetState,
    TeamParams, Time, Track, TrackParams, Velocity,
};

use super::array::{COORDINATE_M, Given, Made, RATE, Rows, common, shape};
use super::parameters::Parameters;
use crate::exceptions::InputError;

/// Allowed measured ranges: above 0, and at most the largest coordinate.
const RANGE_M: Allowed = Allowed::above(0.0).at_most(1e9);

/// Extended information filters (8-11), one for each of n targets. One update fuses the measurements of all UAVs.
///
/// The state of a target is ``[x, vx, ax, y, vy, ay]``: position (m), velocity (m/s), acceleration (m/s2), first east
/// and then north. :meth:`of_cues` and :meth:`from_measurements` start filters from cues or measurements instead of
/// full states. States and covariances can be copied to another filter without rounding: ``Filter(f.state[mask],
/// f.covariance[mask])`` keeps a subset of the targets.
///
/// :param state: means, shape (n, 6).
/// :param covariance: covariances P, shape (n, 6, 6), or (6, 6) for all targets; symmetric and positive definite.
/// :param parameters: uses correlation_rate_1_s, acceleration_sd_m_s2, range_sd_m, bearing_sd_rad,
///     initial_velocity_sd_m_s; ``Parameters()`` by default.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyclass(frozen, module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct Filter {
    params: TrackParams,
    parameters: Option<Py<Parameters>>,
    filters: Mutex<Vec<InformationFilter>>,
}

impl Filter {
    fn of(
        parameters: Option<&Bound<'_, Parameters>>,
        start: impl FnOnce(&TeamParams) -> PyResult<Vec<InformationFilter>>,
    ) -> PyResult<Self> {
        let team = Parameters::or_recommended(parameters);
        let filters = Mutex::new(start(&team)?);
        Ok(Self { params: team.track, parameters: parameters.map(|given| given.clone().unbind()), filters })
    }

    /// Calls `work` with all filters and without the GIL, so that a thread never waits for the GIL while it holds the
    /// lock.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Vec<InformationFilter>) -> T + Send) -> T {
        py.detach(|| work(&mut self.filters.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    /// Makes an array of values of each target.
    fn array<const K: usize>(
        &self,
        py: Python<'_>,
        row: &[usize],
        of: impl Fn(&InformationFilter) -> [f64; K] + Send,
    ) -> PyResult<Made<f64>> {
        let values = self.with(py, |filters| filters.iter().map(of).collect::<Vec<_>>());
        Made::of(py, &[values.len()], row, values.into_flattened())
    }

    /// Like `array`, for values that do not exist if a covariance is nearly singular.
    fn array_if_invertible<const K: usize>(
        &self,
        py: Python<'_>,
        row: &[usize],
        of: impl Fn(&InformationFilter) -> Option<[f64; K]> + Send + Sync,
    ) -> PyResult<Made<f64>> {
        let values = self.with(py, |filters| {
            let each = filters.iter().enumerate().map(|(target, filter)| of(filter).ok_or(target));
            each.collect::<Result<Vec<_>, _>>()
        });
        let values = values.map_err(|target| {
            InputError::new_err(format!("the covariance of target {target} is too close to singular to be inverted"))
        })?;
        Made::of(py, &[values.len()], row, values.into_flattened())
    }
}

/// Measurements of one time step: for each of n targets, one or m measurements.
struct Measurements {
    uav: Rows<f64, 2>,
    range_m: Rows<f64, 1>,
    bearing_rad: Rows<f64, 1>,
    mask: Rows<bool, 1>,
    targets: usize,
    of_each: usize,
}

impl Measurements {
    /// Reads the arguments of a method. `targets`: required number of targets, if it is known.
    fn read(
        uav_position_m: &Given<'_>,
        range_m: &Given<'_>,
        bearing_rad: &Given<'_>,
        mask: Option<&Given<'_>>,
        targets: Option<usize>,
    ) -> PyResult<Self> {
        let uav = Rows::read(uav_position_m, "uav_position_m", "..., 2")?;
        let range_m = Rows::read(range_m, "range_m", "...")?;
        let bearing_rad = Rows::read(bearing_rad, "bearing_rad", "...")?;
        let mask = Rows::or(Rows::read_if(mask, "mask", "...")?, "mask", [true]);
        let lead = common(&[range_m.axes(), bearing_rad.axes(), mask.axes(), uav.axes()])?;
        let (given, of_each) = match *lead.as_slice() {
            [given] => (given, 1),
            [given, of_each] => (given, of_each),
            _ => (usize::MAX, 0),
        };
        if targets.is_some_and(|targets| targets != given) || given == usize::MAX {
            let n = targets.map_or_else(String::new, |targets| format!(", n = {targets} targets"));
            return Err(InputError::new_err(format!(
                "range_m, bearing_rad, mask and uav_position_m (without its last axis) broadcast to the shape {}: \
                 expected (n,), or (n, m) for m measurements of each target{n}",
                shape(&lead)
            )));
        }
        let mask = mask.over(&lead)?;
        Ok(Self {
            uav: uav.over(&lead)?.within(COORDINATE_M, Some(&mask))?,
            range_m: range_m.over(&lead)?.within(RANGE_M, Some(&mask))?,
            bearing_rad: bearing_rad.over(&lead)?.within(Allowed::FINITE, Some(&mask))?,
            mask,
            targets: given,
            of_each,
        })
    }

    /// Measurements of one target, each with the position of the UAV that made it.
    fn of_target(&self, target: usize) -> impl Iterator<Item = (Position, RangeBearingMeasurement)> {
        let all = target * self.of_each..(target + 1) * self.of_each;
        all.filter(|index| self.mask.one(*index)).map(|index| {
            let bearing = Angle::from_rad(self.bearing_rad.one(index));
            (self.uav.position(index), RangeBearingMeasurement { range_m: self.range_m.one(index), bearing })
        })
    }
}

#[pymethods]
impl Filter {
    #[new]
    #[pyo3(signature = (state, covariance, *, parameters=None))]
    fn new(state: Given<'_>, covariance: Given<'_>, parameters: Option<&Bound<'_, Parameters>>) -> PyResult<Self> {
        // The position limit, which is the widest, applies to velocities and accelerations too.
        let state = Rows::<f64, 6>::read(&state, "state", "n, 6")?.within(COORDINATE_M, None)?;
        let covariance =
            Rows::<f64, 36>::read(&covariance, "covariance", "..., 6, 6")?.within(Allowed::FINITE, None)?;
        let lead = state.axes().1.to_vec();
        if ![&lead[..], &[1], &[]].contains(&covariance.axes().1) {
            return Err(InputError::new_err(format!(
                "covariance has the shape {}: expected ({}, 6, 6), one per state, or (6, 6)",
                shape(&[covariance.axes().1, &[6, 6]].concat()),
                lead[0]
            )));
        }
        let covariance = covariance.over(&lead)?;
        Self::of(parameters, |_| {
            (0..lead[0]).map(|target| started(target, state.at(target), covariance.at(target))).collect()
        })
    }

    /// Starts filters from cues: positions and velocities with standard deviations.
    ///
    /// :param position_m: shape (n, 2), east and north, m.
    /// :param velocity_m_s: shape (n, 2), east and north, m/s.
    /// :param position_sd_m: shape (n,) or (), standard deviation of the position per axis, m.
    /// :param velocity_sd_m_s: shape (n,) or (), standard deviation of the velocity per axis, m/s.
    /// :param parameters: as for the class.
    /// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
    #[staticmethod]
    #[pyo3(signature = (position_m, velocity_m_s, *, position_sd_m, velocity_sd_m_s, parameters=None))]
    fn of_cues(
        position_m: Given<'_>,
        velocity_m_s: Given<'_>,
        position_sd_m: Given<'_>,
        velocity_sd_m_s: Given<'_>,
        parameters: Option<&Bound<'_, Parameters>>,
    ) -> PyResult<Self> {
        let sd = Allowed::at_least(1e-6).at_most(1e6);
        let position = Rows::<f64, 2>::read(&position_m, "position_m", "n, 2")?.within(COORDINATE_M, None)?;
        let velocity = Rows::<f64, 2>::read(&velocity_m_s, "velocity_m_s", "..., 2")?.within(RATE, None)?;
        let position_sd = Rows::<f64, 1>::read(&position_sd_m, "position_sd_m", "...")?.within(sd, None)?;
        let velocity_sd = Rows::<f64, 1>::read(&velocity_sd_m_s, "velocity_sd_m_s", "...")?.within(sd, None)?;
        let lead = common(&[position.axes(), velocity.axes(), position_sd.axes(), velocity_sd.axes()])?;
        let [targets] = *lead.as_slice() else {
            let lead = shape(&lead);
            let what = format!("a filter has one leading axis, of n targets: the arguments broadcast to {lead}");
            return Err(InputError::new_err(what));
        };
        let (position, velocity) = (position.over(&lead)?, velocity.over(&lead)?);
        let (position_sd, velocity_sd) = (position_sd.over(&lead)?, velocity_sd.over(&lead)?);
        Self::of(parameters, |team| {
            let cued = |target: usize| {
                let cue = Cue {
                    source: 0,
                    issued_at: Time::EPOCH,
                    sequence: 0,
                    label: Some(TargetLabel(0)),
                    time: Time::EPOCH,
                    position: position.position(target),
                    velocity: velocity.velocity(target),
                    position_sd_m: position_sd.one(target),
                    velocity_sd_m_s: velocity_sd.one(target),
                };
                filter_of(target, Track::from_cue(&cue, &team.track, Time::EPOCH))
            };
            (0..targets).map(cued).collect()
        })
    }

    /// Starts filters from the first measurements at one time. The initial velocity is 0 with the standard deviation
    /// initial_velocity_sd_m_s.
    ///
    /// :param uav_position_m: shape (..., 2), position of the measuring UAV, east and north, m.
    /// :param range_m: shape (n,), or (n, m) for m measurements of each target, m.
    /// :param bearing_rad: same shape, rad anticlockwise from east.
    /// :param mask: same shape; False marks missing measurements. Each target needs at least one measurement.
    /// :param parameters: as for the class.
    /// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
    #[staticmethod]
    #[pyo3(signature = (uav_position_m, range_m, bearing_rad, *, mask=None, parameters=None))]
    fn from_measurements(
        uav_position_m: Given<'_>,
        range_m: Given<'_>,
        bearing_rad: Given<'_>,
        mask: Option<Given<'_>>,
        parameters: Option<&Bound<'_, Parameters>>,
    ) -> PyResult<Self> {
        let measured = Measurements::read(&uav_position_m, &range_m, &bearing_rad, mask.as_ref(), None)?;
        Self::of(parameters, |team| {
            let started = |target: usize| {
                if measured.of_target(target).next().is_none() {
                    let what = format!("mask: target {target} has no measurement to start from");
                    return Err(InputError::new_err(what));
                }
                let track = Track::from_measurements(TargetLabel(0).into(), measured.of_target(target), &team.track);
                filter_of(target, track)
            };
            (0..measured.targets).map(started).collect()
        })
    }

    /// Predicts all estimates over a time step (8, 9).
    ///
    /// :param dt_s: length of the time step, 0 to 3,600 s; rounded to the nearest microsecond.
    /// :raises InputError: if the time is out of range, or an estimate would overflow floating-point numbers; the
    ///     filter then stays unchanged.
    fn predict(&self, py: Python<'_>, dt_s: f64) -> PyResult<()> {
        let allowed = Allowed::at_least(0.0).at_most(3600.0);
        if !allowed.contains(dt_s) {
            return Err(InputError::new_err(format!("dt_s = {dt_s}: must be {allowed}")));
        }
        let transition = self.params.transition(Duration::from_s(dt_s));
        let beyond = self.with(py, |filters| {
            let mut predicted = filters.clone();
            predicted.iter_mut().for_each(|filter| filter.predict(&transition));
            let beyond = predicted.iter().position(|filter| !filter.is_valid());
            if beyond.is_none() {
                *filters = predicted;
            }
            beyond
        });
        beyond.map_or(Ok(()), |target| {
            let what = format!("target {target} has become too uncertain for 64-bit numbers: restart its filter");
            Err(InputError::new_err(what))
        })
    }

    /// Updates the estimates with the measurements at this time (10, 11), linearised about the predicted positions.
    /// Bearing innovations are wrapped.
    ///
    /// :param uav_position_m: shape (..., 2), position of the measuring UAV, east and north, m: (2,) for one UAV, (m,
    ///     2) for m UAVs that measure every target.
    /// :param range_m: shape (n,), or (n, m) for m measurements of each target, m. A measurement taken less than 1 m
    ///     from the predicted position carries no information.
    /// :param bearing_rad: same shape, rad anticlockwise from east.
    /// :param mask: same shape; False marks missing measurements, whose values are ignored.
    /// :returns: shape (n,): True if the estimate was updated. False if there was no measurement or the result would
    ///     overflow floating-point numbers; the estimate then stays unchanged.
    /// :raises InputError: if an argument has the wrong shape or type or a value is out of range; the filter then stays
    ///     unchanged.
    #[pyo3(signature = (uav_position_m, range_m, bearing_rad, *, mask=None))]
    fn update(
        &self,
        py: Python<'_>,
        uav_position_m: Given<'_>,
        range_m: Given<'_>,
        bearing_rad: Given<'_>,
        mask: Option<Given<'_>>,
    ) -> PyResult<Made<bool>> {
        let targets = self.__len__(py);
        let measured = Measurements::read(&uav_position_m, &range_m, &bearing_rad, mask.as_ref(), Some(targets))?;
        let sensor = &self.params.sensor;
        let taken = self.with(py, |filters| {
            let updated = |(target, filter): (usize, &mut InformationFilter)| {
                let predicted = filter.estimate().state.position();
                let each = measured.of_target(target);
                let sum = each.fold(None, |sum: Option<Contribution>, (uav, z)| {
                    let mut sum = sum.unwrap_or_default();
                    sum += Contribution::from_measurement(sensor, uav, &z, predicted);
                    Some(sum)
                });
                let Some(sum) = sum else { return false };
                let mut updated = *filter;
                updated.update(&sum);
                let is_valid = updated.is_valid();
                if is_valid {
                    *filter = updated;
                }
                is_valid
            };
            filters.iter_mut().enumerate().map(updated).collect::<Vec<_>>()
        });
        Made::of(py, &[taken.len()], &[], taken)
    }

    /// Means, shape (n, 6): ``[x, vx, ax, y, vy, ay]`` in m, m/s, m/s2; a copy.
    #[getter]
    fn state(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array(py, &[6], |filter| filter.estimate().state.0.into())
    }

    /// Covariances P, shape (n, 6, 6), in the units of the states; a copy.
    #[getter]
    fn covariance(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array(py, &[6, 6], |filter| square(filter.estimate().covariance.matrix().into()))
    }

    /// Positions, shape (n, 2), east and north, m; a copy.
    #[getter]
    fn position_m(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array(py, &[2], |filter| filter.estimate().state.position().vector().into())
    }

    /// Velocities, shape (n, 2), east and north, m/s; a copy.
    #[getter]
    fn velocity_m_s(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array(py, &[2], |filter| filter.estimate().state.velocity().vector().into())
    }

    /// Standard deviations of the positions in their most uncertain direction, shape (n,), m.
    #[getter]
    fn position_sd_max_m(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array(py, &[], |filter| [filter.estimate().position_sd_max_m()])
    }

    /// Information matrices Y = P^-1, shape (n, 6, 6).
    ///
    /// :raises InputError: if a covariance is too close to singular to be inverted.
    #[getter]
    fn information_matrix(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array_if_invertible(py, &[6, 6], |filter| Some(square(filter.information_matrix()?.into())))
    }

    /// Information vectors y = Y x, shape (n, 6).
    ///
    /// :raises InputError: if a covariance is too close to singular to be inverted.
    #[getter]
    fn information_vector(&self, py: Python<'_>) -> PyResult<Made<f64>> {
        self.array_if_invertible(py, &[6], |filter| Some(filter.information_vector()?.into()))
    }

    /// Returns a copy of the filter.
    fn copy(&self, py: Python<'_>) -> Self {
        let filters = Mutex::new(self.with(py, |filters| filters.clone()));
        Self { params: self.params, parameters: self.parameters.as_ref().map(|given| given.clone_ref(py)), filters }
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.with(py, |filters| filters.len())
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("Filter of {} targets", self.__len__(py))
    }

    #[pyo3(signature = () -> "tuple[tuple[object, object], dict[str, object]]")]
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let named = PyDict::new(py);
        named.set_item("parameters", self.parameters.as_ref().map(|given| given.clone_ref(py)))?;
        Ok(((self.state(py)?, self.covariance(py)?).into_pyobject(py)?, named))
    }
}

/// Makes a filter from a state and a covariance, which must be symmetric and positive definite.
fn started(target: usize, [x, vx, ax, y, vy, ay]: [f64; 6], covariance: [f64; 36]) -> PyResult<InformationFilter> {
    let at = |row: usize, column: usize| covariance[6 * row + column];
    let upper = || (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    let is_symmetric = |(row, column): (usize, usize)| {
        (at(row, column) - at(column, row)).abs() <= 1e-9 * (at(row, row) * at(column, column)).abs().sqrt()
    };
    if let Some((row, column)) = upper().find(|place| !is_symmetric(*place)) {
        return Err(InputError::new_err(format!(
            "covariance of target {target}: {} at [{row}, {column}], {} at [{column}, {row}]: must be symmetric",
            at(row, column),
            at(column, row)
        )));
    }
    let mut triangle = [0.0; 21];
    triangle.iter_mut().zip(upper()).for_each(|(value, (row, column))| *value = at(row, column));
    let state = TargetState::new(Position::from_m(x, y), Velocity::from_m_s(vx, vy), [ax, ay]);
    let estimate = Estimate { state, covariance: Covariance::from_upper_triangle(&triangle) };
    InformationFilter::new(estimate)
        .ok_or_else(|| InputError::new_err(format!("covariance of target {target}: must be positive definite")))
}

/// Makes a filter from the initial estimate of a track.
fn filter_of(target: usize, track: Option<Track>) -> PyResult<InformationFilter> {
    track.and_then(|track| InformationFilter::new(*track.estimate())).ok_or_else(|| {
        InputError::new_err(format!(
            "target {target} cannot be started: its standard deviations differ by more than 64-bit numbers allow"
        ))
    })
}

/// Elements of a symmetric matrix, row by row.
fn square(columns: [[f64; 6]; 6]) -> [f64; 36] {
    let mut square = [0.0; 36];
    square.iter_mut().zip(columns.as_flattened()).for_each(|(to, from)| *to = *from);
    square
}
