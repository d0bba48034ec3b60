//! Extended information filters (8-11) for several targets.

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use standoff::tracking::information_filter::Contribution;
use standoff::validation::Allowed;
use standoff::{
    Angle, Covariance, Duration, Estimate, Position, RangeBearingMeasurement, TargetState, TrackParams, Velocity,
};

use super::array::{Arguments, COORDINATE_M, Given, Numbers, made, upper_triangle};
use crate::exceptions::InputError;
use crate::law::MissionInfo;

/// Allowed measured ranges: above 0, and at most the largest coordinate.
const RANGE_M: Allowed = Allowed::above(0.0).at_most(1e9);

/// Extended information filters (8-11), one for each of n targets. One update fuses the measurements of all UAVs.
///
/// The state of a target is ``[x, vx, ax, y, vy, ay]``: position (m), velocity (m/s), acceleration (m/s2), first east
/// and then north. States and covariances can be copied to another filter without rounding: ``Filter(f.state[mask],
/// f.covariance[mask])`` keeps a subset of the targets.
///
/// :param state: means, shape (n, 6), or (6,) for all targets, between -1e9 and 1e9.
/// :param covariance: covariances P, shape (n, 6, 6), or (6, 6) for all targets; positive definite. Only the upper
///     triangle is used.
/// :param mission: mission whose accuracy of the sensor and motion of the targets apply; by default the recommended
///     parameters.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyclass(module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct Filter {
    params: TrackParams,
    estimates: Vec<Estimate>,
}

impl Filter {
    /// Makes an array of values of each target.
    fn array<V: IntoIterator<Item = f64>>(
        &self,
        py: Python<'_>,
        row: &[usize],
        of: impl Fn(&Estimate) -> V,
    ) -> PyResult<Py<PyArrayDyn<f64>>> {
        made(py, Some(self.estimates.len()), row, self.estimates.iter().flat_map(&of))
    }
}

#[pymethods]
impl Filter {
    #[new]
    #[pyo3(signature = (state, covariance, *, mission=None))]
    fn new(state: Given<'_>, covariance: Given<'_>, mission: Option<&Bound<'_, MissionInfo>>) -> PyResult<Self> {
        let mut arguments = Arguments::default();
        // The position limit, which is the widest, applies to velocities and accelerations too.
        let state = arguments.read::<6>(&state, "state", &[6], COORDINATE_M)?;
        let covariance = arguments.read::<36>(&covariance, "covariance", &[6, 6], Allowed::FINITE)?;
        let started = |target: usize| {
            let [x, vx, ax, y, vy, ay] = state.at(target);
            let covariance = Covariance::from_upper_triangle(&upper_triangle(&covariance.at(target)));
            let state = TargetState::new(Position::from_m(x, y), Velocity::from_m_s(vx, vy), [ax, ay]);
            let wrong = || InputError::new_err(format!("covariance of target {target}: must be positive definite"));
            Estimate { state, covariance }.checked().ok_or_else(wrong)
        };
        let estimates = (0..arguments.count().unwrap_or(1)).map(started).collect::<PyResult<_>>()?;
        Ok(Self { params: MissionInfo::params(mission).track, estimates })
    }

    /// Predicts all estimates over a time step (8, 9).
    ///
    /// :param dt_s: length of the time step, 0 to 3,600 s; rounded to the nearest microsecond.
    /// :raises InputError: if the time is out of range, or an estimate would overflow floating-point numbers; the
    ///     filter then stays unchanged.
    fn predict(&mut self, dt_s: f64) -> PyResult<()> {
        let allowed = Allowed::at_least(0.0).at_most(3600.0);
        if !allowed.contains(dt_s) {
            return Err(InputError::new_err(format!("dt_s = {dt_s}: must be {allowed}")));
        }
        let transition = self.params.transition(Duration::from_s(dt_s));
        let mut predicted = self.estimates.clone();
        predicted.iter_mut().for_each(|estimate| estimate.predict(&transition));
        if let Some(target) = predicted.iter().position(|estimate| !estimate.is_valid()) {
            let what = format!("target {target} has become too uncertain for 64-bit numbers: restart its filter");
            return Err(InputError::new_err(what));
        }
        self.estimates = predicted;
        Ok(())
    }

    /// Updates the estimates with the measurements of m UAVs at this time (10, 11), linearised about the predicted
    /// positions. Bearing innovations are wrapped.
    ///
    /// :param uav_position_m: shape (m, 2), or (2,) for one UAV, east and north, m, between -1e9 and 1e9.
    /// :param range_m: shape (n, m), or (n,) for one UAV, m, above 0 and at most 1e9; NaN: no measurement. A measurement
    ///     taken less than 1 m from the predicted position carries no information.
    /// :param bearing_rad: same shape, rad anticlockwise from east; NaN: no measurement.
    /// :returns: shape (n,): True if the estimate was updated. False if there was no measurement or the result would
    ///     overflow floating-point numbers; the estimate then stays unchanged.
    /// :raises InputError: if an argument has the wrong shape or type or a value is out of range; the filter then stays
    ///     unchanged.
    fn update(
        &mut self,
        py: Python<'_>,
        uav_position_m: Given<'_>,
        range_m: Given<'_>,
        bearing_rad: Given<'_>,
    ) -> PyResult<Py<PyArrayDyn<bool>>> {
        let mut arguments = Arguments::default();
        let uavs = arguments.read(&uav_position_m, "uav_position_m", &[2], COORDINATE_M)?;
        let (targets, of_each) = (self.estimates.len(), arguments.count().unwrap_or(1));
        let shape: Vec<usize> = [targets].into_iter().chain(arguments.count()).collect();
        let what = if arguments.count().is_some() { "for targets and UAVs" } else { "for the targets of one UAV" };
        let range_m = Numbers::read(&range_m, "range_m")?.of_shape(&shape, what)?.within_or_nan(RANGE_M)?;
        let bearing_rad = Numbers::read(&bearing_rad, "bearing_rad")?.of_shape(&shape, what)?;
        let bearing_rad = bearing_rad.within_or_nan(Allowed::FINITE)?;
        let sensor = &self.params.sensor;
        let mut update = |(target, estimate): (usize, &mut Estimate)| {
            let predicted = estimate.state.position();
            let mut sum = None::<Contribution>;
            for uav in 0..of_each {
                let at = target * of_each + uav;
                let (range_m, bearing_rad) = (range_m.values[at], bearing_rad.values[at]);
                if !range_m.is_nan() && !bearing_rad.is_nan() {
                    let measurement = RangeBearingMeasurement { range_m, bearing: Angle::from_rad(bearing_rad) };
                    let [x_m, y_m] = uavs.at(uav);
                    let uav = Position::from_m(x_m, y_m);
                    *sum.get_or_insert_default() +=
                        Contribution::from_measurement(sensor, uav, &measurement, predicted);
                }
            }
            let Some(sum) = sum else { return false };
            let mut updated = *estimate;
            updated.update(&sum);
            let is_valid = updated.is_valid();
            if is_valid {
                *estimate = updated;
            }
            is_valid
        };
        let is_updated: Vec<bool> = self.estimates.iter_mut().enumerate().map(&mut update).collect();
        made(py, Some(targets), &[], is_updated.into_iter())
    }

    /// Means, shape (n, 6): ``[x, vx, ax, y, vy, ay]`` in m, m/s, m/s2; a copy.
    #[getter]
    fn state(&self, py: Python<'_>) -> PyResult<Py<PyArrayDyn<f64>>> {
        self.array(py, &[6], |estimate| <[f64; 6]>::from(estimate.state.0))
    }

    /// Covariances P, shape (n, 6, 6), in the units of the states; a copy.
    #[getter]
    fn covariance(&self, py: Python<'_>) -> PyResult<Py<PyArrayDyn<f64>>> {
        let columns = |estimate: &Estimate| <[[f64; 6]; 6]>::from(estimate.covariance.matrix());
        self.array(py, &[6, 6], |estimate| columns(estimate).into_iter().flatten())
    }

    /// Positions, shape (n, 2), east and north, m; a copy.
    #[getter]
    fn position_m(&self, py: Python<'_>) -> PyResult<Py<PyArrayDyn<f64>>> {
        self.array(py, &[2], |estimate| <[f64; 2]>::from(estimate.state.position().vector()))
    }
}
