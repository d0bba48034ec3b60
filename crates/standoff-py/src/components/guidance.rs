//! Standoff distance from the spread of a group, and turn-rate law: (15), (23-25), (28, 29).

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use standoff::guidance::heading::{self, Orbit};
use standoff::guidance::standoff_distance::{Ramp, Spread};
use standoff::validation::Allowed;
use standoff::{Angle, Position, UavState, Velocity};

use super::array::{Arguments, COORDINATE_M, DISTANCE_M, Given, RATE_M_S, made};
use crate::law::MissionInfo;

/// Allowed radii, m; positive, because they are divisors.
const RADIUS_M: Allowed = Allowed::at_least(1e-3).at_most(1e9);
/// Allowed flight speeds, m/s.
const SPEED_M_S: Allowed = Allowed::at_least(1e-3).at_most(1e6);

/// Standoff distances and their rates.
#[pyclass(frozen, module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct StandoffDistance {
    /// Standoff distance r_d of (15), limited to its bounds, shape (n,) or (), m.
    #[pyo3(get)]
    distance_m: Py<PyArrayDyn<f64>>,
    /// Rate of r_d, shape (n,) or (), m/s; 0 at a bound.
    #[pyo3(get)]
    rate_m_s: Py<PyArrayDyn<f64>>,
    /// Standoff distance of (15) before the bounds are applied, shape (n,) or (), m.
    #[pyo3(get)]
    unclamped_m: Py<PyArrayDyn<f64>>,
}

/// Computes the standoff distance at which the furthest member of a group lies inside the field of view (15).
///
/// :param spread_m: shape (n,) or (), distance d_max from the centre to the furthest member, m, between 0 and 1e9.
/// :param spread_rate_m_s: shape (n,) or (), rate of change of d_max, m/s, between -1e6 and 1e6; 0 by default.
/// :param margin_m: shape (n,) or (), margin d_m, m, between 0 and 1e9; 0 by default.
/// :param mission: mission whose field of view and bounds of the radius apply; by default the recommended parameters.
/// :returns: the distances with and without bounds, and their rates.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (spread_m, *, spread_rate_m_s=None, margin_m=None, mission=None))]
pub(crate) fn standoff_distance(
    py: Python<'_>,
    spread_m: Given<'_>,
    spread_rate_m_s: Option<Given<'_>>,
    margin_m: Option<Given<'_>>,
    mission: Option<&Bound<'_, MissionInfo>>,
) -> PyResult<StandoffDistance> {
    let params = MissionInfo::params(mission);
    let mut arguments = Arguments::default();
    let spread = arguments.read(&spread_m, "spread_m", &[], DISTANCE_M)?;
    let rate = arguments.read_or(spread_rate_m_s.as_ref(), "spread_rate_m_s", RATE_M_S, 0.0)?;
    let margin = arguments.read_or(margin_m.as_ref(), "margin_m", DISTANCE_M, 0.0)?;
    let count = arguments.count();
    let distance = |item: usize| {
        let spread = Spread { distance_m: spread.one(item), rate_m_s: rate.one(item) };
        params.group.standoff.distance(spread, margin.one(item), &params.track.sensor)
    };
    let distances: Vec<_> = py.detach(|| (0..count.unwrap_or(1)).map(distance).collect());
    Ok(StandoffDistance {
        distance_m: made(py, count, &[], distances.iter().map(|distance| distance.distance_m))?,
        rate_m_s: made(py, count, &[], distances.iter().map(|distance| distance.rate_m_s))?,
        unclamped_m: made(py, count, &[], distances.iter().map(|distance| distance.unclamped_m))?,
    })
}

/// Output of the turn-rate law.
#[pyclass(frozen, module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct Steering {
    /// Commanded turn rate u_omega before limits (24), shape (n,) or (), rad/s, positive to the left.
    #[pyo3(get)]
    turn_rate_rad_s: Py<PyArrayDyn<f64>>,
    /// Desired heading psi_d over ground (23, 28), shape (n,) or (), rad anticlockwise from east.
    #[pyo3(get)]
    desired_heading_rad: Py<PyArrayDyn<f64>>,
    /// Derivative of the desired heading, the feedforward part of the turn rate (25), shape (n,) or (), rad/s.
    #[pyo3(get)]
    feedforward_rad_s: Py<PyArrayDyn<f64>>,
    /// True if the centre is too fast for the field (29), shape (n,) or (); the heading is then the best possible one.
    #[pyo3(get)]
    centre_too_fast: Py<PyArrayDyn<bool>>,
}

/// Steers UAVs onto orbits: computes the vector field about a moving centre and the turn rate of the Lyapunov law
/// (23-25, 28, 29).
///
/// :param uav_state: shape (n, 5) or (5,): x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s, between -1e9 and 1e9.
/// :param centre: shape (n, 4) or (4,), estimated centre of the orbit: x_m, y_m, vx_m_s, vy_m_s, between -1e9 and 1e9.
/// :param distance_m: shape (n,) or (), radius of the orbit, m, between 1e-3 and 1e9.
/// :param rate_m_s: shape (n,) or (), rate of that radius, m/s, between -1e6 and 1e6; 0 by default.
/// :param speed_m_s: shape (n,) or (), commanded ground speed, m/s, between 1e-3 and 1e6; that of the mission by default.
/// :param mission: mission whose law, gains, direction of orbits and aircraft apply; by default the recommended
///     parameters.
/// :returns: the turn rate and its intermediate values.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (uav_state, centre, distance_m, *, rate_m_s=None, speed_m_s=None, mission=None))]
pub(crate) fn steer(
    py: Python<'_>,
    uav_state: Given<'_>,
    centre: Given<'_>,
    distance_m: Given<'_>,
    rate_m_s: Option<Given<'_>>,
    speed_m_s: Option<Given<'_>>,
    mission: Option<&Bound<'_, MissionInfo>>,
) -> PyResult<Steering> {
    let params = MissionInfo::params(mission);
    let mut arguments = Arguments::default();
    let uav = arguments.read(&uav_state, "uav_state", &[5], COORDINATE_M)?;
    let centre = arguments.read(&centre, "centre", &[4], COORDINATE_M)?;
    let distance = arguments.read(&distance_m, "distance_m", &[], RADIUS_M)?;
    let rate = arguments.read_or(rate_m_s.as_ref(), "rate_m_s", RATE_M_S, 0.0)?;
    let speed = arguments.read_or(speed_m_s.as_ref(), "speed_m_s", SPEED_M_S, params.uav.speed_m_s)?;
    let count = arguments.count();
    let steering = |item: usize| {
        let [x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s] = uav.at(item);
        let (position, heading) = (Position::from_m(x_m, y_m), Angle::from_rad(heading_rad));
        let uav = UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical: None };
        let [x_m, y_m, vx_m_s, vy_m_s] = centre.at(item);
        let steered = Ramp { radius_m: distance.one(item), rate_m_s: rate.one(item) };
        let orbit = Orbit {
            centre: Position::from_m(x_m, y_m),
            centre_velocity: Velocity::from_m_s(vx_m_s, vy_m_s),
            distance_m: steered.radius_m,
            rate_m_s: steered.rate_m_s,
            steered,
        };
        heading::steer(&params.guidance, &params.uav, &uav, &orbit, speed.one(item))
    };
    let steerings: Vec<_> = py.detach(|| (0..count.unwrap_or(1)).map(steering).collect());
    let number = |of: fn(&standoff::Steering) -> f64| made(py, count, &[], steerings.iter().map(of));
    Ok(Steering {
        turn_rate_rad_s: number(|steering| steering.turn_rate_rad_s)?,
        desired_heading_rad: number(|steering| steering.desired_heading.rad())?,
        feedforward_rad_s: number(|steering| steering.feedforward_rad_s)?,
        centre_too_fast: made(py, count, &[], steerings.iter().map(|steering| steering.centre_too_fast))?,
    })
}
