//! Standoff distance from the spread of a group, and turn-rate law: (15), (22-25), (28, 29).

use pyo3::prelude::*;
use standoff::guidance::heading::Orbit;
use standoff::guidance::standoff_distance::Ramp;
use standoff::guidance::standoff_distance::Spread;
use standoff::validation::Allowed;
use standoff::{Angle, UavState};

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, RATE, Rows, common, each};
use super::parameters::Parameters;

/// Allowed radii, m; positive, because they are divisors.
const RADIUS_M: Allowed = Allowed::at_least(1e-3).at_most(1e9);
/// Allowed flight speeds, m/s.
const SPEED_M_S: Allowed = Allowed::at_least(1e-3).at_most(1e6);

/// Standoff distances and their rates.
#[pyclass(frozen, module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct StandoffDistance {
    /// Standoff distance r_d of (15), limited to its bounds, shape (...), m.
    #[pyo3(get)]
    distance_m: Made<f64>,
    /// Rate of r_d, shape (...), m/s; 0 at a bound.
    #[pyo3(get)]
    rate_m_s: Made<f64>,
    /// Standoff distance of (15) before the bounds are applied, shape (...), m.
    #[pyo3(get)]
    unclamped_m: Made<f64>,
}

/// Computes the standoff distance at which the furthest member of a group lies inside the field of view (15).
///
/// :param spread_m: shape (...), distance d_max from the centre to the furthest member, m.
/// :param spread_rate_m_s: shape (...), rate of change of d_max, m/s; 0 by default.
/// :param margin_m: shape (...), margin d_m, m; 0 by default.
/// :param parameters: uses field_of_view_rad, field_of_view_margin_rad, radius_min_m, radius_max_m; ``Parameters()``
///     by default.
/// :returns: the distances with and without bounds, and their rates.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (spread_m, *, spread_rate_m_s=None, margin_m=None, parameters=None))]
pub(crate) fn standoff_distance(
    py: Python<'_>,
    spread_m: Given<'_>,
    spread_rate_m_s: Option<Given<'_>>,
    margin_m: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<StandoffDistance> {
    let team = Parameters::or_recommended(parameters);
    let spread = number(&spread_m, "spread_m", DISTANCE_M)?;
    let rate = number_or(spread_rate_m_s, "spread_rate_m_s", RATE, 0.0)?;
    let margin = number_or(margin_m, "margin_m", DISTANCE_M, 0.0)?;
    let lead = common(&[spread.axes(), rate.axes(), margin.axes()])?;
    let (spread, rate, margin) = (spread.over(&lead)?, rate.over(&lead)?, margin.over(&lead)?);
    let distances = each(py, lead.iter().product(), PATIENCE, |row| {
        let spread = Spread { distance_m: spread.one(row), rate_m_s: rate.one(row) };
        team.group.standoff.distance(spread, margin.one(row), &team.track.sensor)
    })?;
    Ok(StandoffDistance {
        distance_m: Made::of(py, &lead, &[], distances.iter().map(|d| d.distance_m).collect())?,
        rate_m_s: Made::of(py, &lead, &[], distances.iter().map(|d| d.rate_m_s).collect())?,
        unclamped_m: Made::of(py, &lead, &[], distances.iter().map(|d| d.unclamped_m).collect())?,
    })
}

/// Computes the radius that the guidance steers for while the standoff distance changes: active measure 2 (22), limited
/// to the bounds.
///
/// :param distance_m: shape (...), standoff distance r_d, m.
/// :param rate_m_s: shape (...), rate of r_d, m/s.
/// :param speed_m_s: shape (...), speed relative to the centre, on which the lead time may depend, m/s; speed_m_s of
///     the parameters by default.
/// :param parameters: uses law, lead_s, radial_gain, radius_min_m, radius_max_m; ``Parameters()`` by default.
/// :returns: radius, shape (...), m, and its rate, shape (...), m/s; the rate is 0 at a bound.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (distance_m, rate_m_s, *, speed_m_s=None, parameters=None))]
pub(crate) fn steered_radius(
    py: Python<'_>,
    distance_m: Given<'_>,
    rate_m_s: Given<'_>,
    speed_m_s: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<(Made<f64>, Made<f64>)> {
    let team = Parameters::or_recommended(parameters);
    let distance = number(&distance_m, "distance_m", RADIUS_M)?;
    let rate = number(&rate_m_s, "rate_m_s", RATE)?;
    let speed = number_or(speed_m_s, "speed_m_s", SPEED_M_S, team.uav.speed_m_s)?;
    let lead = common(&[distance.axes(), rate.axes(), speed.axes()])?;
    let (distance, rate, speed) = (distance.over(&lead)?, rate.over(&lead)?, speed.over(&lead)?);
    let led = each(py, lead.iter().product(), PATIENCE, |row| {
        let ramp = Ramp { radius_m: distance.one(row), rate_m_s: rate.one(row) };
        ramp.with_lead(team.guidance.lead_s(ramp.radius_m, speed.one(row)), &team.group.standoff)
    })?;
    let radius_m = Made::of(py, &lead, &[], led.iter().map(|led| led.radius_m).collect())?;
    Ok((radius_m, Made::of(py, &lead, &[], led.iter().map(|led| led.rate_m_s).collect())?))
}

/// Output of the turn-rate law, with intermediate values.
#[pyclass(frozen, module = "standoff.components")]
#[derive(Debug)]
pub(crate) struct Steering {
    /// Commanded turn rate u_omega before limits (24), shape (...), rad/s, positive to the left.
    #[pyo3(get)]
    turn_rate_rad_s: Made<f64>,
    /// Desired heading psi_d over ground (23, 28), shape (...), rad anticlockwise from east.
    #[pyo3(get)]
    desired_heading_rad: Made<f64>,
    /// Derivative of the desired heading, the feedforward part of the turn rate (25), shape (...), rad/s.
    #[pyo3(get)]
    feedforward_rad_s: Made<f64>,
    /// Distance r from the centre, shape (...), m.
    #[pyo3(get)]
    centre_distance_m: Made<f64>,
    /// Direction from the centre to the UAV, shape (...), rad anticlockwise from east.
    #[pyo3(get)]
    phase_rad: Made<f64>,
    /// Threshold xi_th of Lemma 3.1, shape (...), m2/s: the UAV converges while it is not negative.
    #[pyo3(get)]
    convergence_threshold_m2_s: Made<f64>,
    /// True if the centre is too fast for the field (29), shape (...); the heading is then the best possible one.
    #[pyo3(get)]
    centre_too_fast: Made<bool>,
}

/// Steers UAVs onto orbits: computes the vector field about a moving centre and the turn rate of the Lyapunov law
/// (23-25, 28, 29).
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param heading_rad: shape (...), heading of the UAV, rad anticlockwise from east.
/// :param centre_m: shape (..., 2), estimated centre of the orbit, east and north, m.
/// :param distance_m: shape (...), standoff distance r_d, m.
/// :param rate_m_s: shape (...), rate of r_d, m/s; 0 by default.
/// :param steered_radius_m: shape (...), radius to steer for (22), from :func:`steered_radius`, m; distance_m by
///     default.
/// :param steered_rate_m_s: shape (...), rate of that radius, m/s; rate_m_s by default.
/// :param centre_velocity_m_s: shape (..., 2), velocity of the centre, east and north, m/s; 0 by default.
/// :param speed_m_s: shape (...), commanded ground speed, m/s; speed_m_s of the parameters by default.
/// :param uav_speed_m_s: shape (...), current speed, m/s, used only by the law ``"standoff"``; speed_m_s by default.
/// :param turn_rate_rad_s: shape (...), current turn rate, rad/s, used only by the law ``"standoff"``; 0 by default.
/// :param parameters: uses law, orbit_direction, radial_gain, heading_gain_1_s, turn_rate_lag_s, feedforward, speed_m_s;
///     ``Parameters()`` by default.
/// :returns: the turn rate and its intermediate values.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, heading_rad, centre_m, *, distance_m, rate_m_s=None, steered_radius_m=None,
    steered_rate_m_s=None, centre_velocity_m_s=None, speed_m_s=None, uav_speed_m_s=None, turn_rate_rad_s=None,
    parameters=None))]
#[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
pub(crate) fn steer(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    heading_rad: Given<'_>,
    centre_m: Given<'_>,
    distance_m: Given<'_>,
    rate_m_s: Option<Given<'_>>,
    steered_radius_m: Option<Given<'_>>,
    steered_rate_m_s: Option<Given<'_>>,
    centre_velocity_m_s: Option<Given<'_>>,
    speed_m_s: Option<Given<'_>>,
    uav_speed_m_s: Option<Given<'_>>,
    turn_rate_rad_s: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Steering> {
    let team = Parameters::or_recommended(parameters);
    let guidance = team.guidance;
    let uav = vector(&uav_position_m, "uav_position_m", COORDINATE_M)?;
    let heading = number(&heading_rad, "heading_rad", Allowed::FINITE)?;
    let centre = vector(&centre_m, "centre_m", COORDINATE_M)?;
    let distance = number(&distance_m, "distance_m", RADIUS_M)?;
    let rate = number_or(rate_m_s, "rate_m_s", RATE, 0.0)?;
    let or_else = |given: Option<Given<'_>>, name, allowed, or: &Rows<f64, 1>| {
        given.map_or_else(|| Ok(or.clone()), |given| number(&given, name, allowed))
    };
    let steered = or_else(steered_radius_m, "steered_radius_m", RADIUS_M, &distance)?;
    let steered_rate = or_else(steered_rate_m_s, "steered_rate_m_s", RATE, &rate)?;
    let centre_velocity = Rows::read_if(centre_velocity_m_s.as_ref(), "centre_velocity_m_s", "..., 2")?;
    let centre_velocity = Rows::or(centre_velocity, "centre_velocity_m_s", [0.0; 2]).within(RATE, None)?;
    let speed = number_or(speed_m_s, "speed_m_s", SPEED_M_S, team.uav.speed_m_s)?;
    let uav_speed = or_else(uav_speed_m_s, "uav_speed_m_s", RATE, &speed)?;
    let turn_rate = number_or(turn_rate_rad_s, "turn_rate_rad_s", RATE, 0.0)?;
    let lead = common(&[
        uav.axes(),
        heading.axes(),
        centre.axes(),
        distance.axes(),
        rate.axes(),
        steered.axes(),
        steered_rate.axes(),
        centre_velocity.axes(),
        speed.axes(),
        uav_speed.axes(),
        turn_rate.axes(),
    ])?;
    let (uav, heading, centre) = (uav.over(&lead)?, heading.over(&lead)?, centre.over(&lead)?);
    let (distance, rate) = (distance.over(&lead)?, rate.over(&lead)?);
    let (steered, steered_rate) = (steered.over(&lead)?, steered_rate.over(&lead)?);
    let (centre_velocity, speed) = (centre_velocity.over(&lead)?, speed.over(&lead)?);
    let (uav_speed, turn_rate) = (uav_speed.over(&lead)?, turn_rate.over(&lead)?);
    let steerings = each(py, lead.iter().product(), PATIENCE, |row| {
        let orbit = Orbit {
            centre: centre.position(row),
            centre_velocity: centre_velocity.velocity(row),
            distance_m: distance.one(row),
            rate_m_s: rate.one(row),
            steered: Ramp { radius_m: steered.one(row), rate_m_s: steered_rate.one(row) },
        };
        let state = UavState {
            position: uav.position(row),
            heading: Angle::from_rad(heading.one(row)),
            speed_m_s: uav_speed.one(row),
            turn_rate_rad_s: turn_rate.one(row),
            vertical: None,
        };
        standoff::guidance::heading::steer(&guidance, &team.uav, &state, &orbit, speed.one(row))
    })?;
    let made = |of: fn(&standoff::Steering) -> f64| Made::of(py, &lead, &[], steerings.iter().map(of).collect());
    Ok(Steering {
        turn_rate_rad_s: made(|steering| steering.turn_rate_rad_s)?,
        desired_heading_rad: made(|steering| steering.desired_heading.rad())?,
        feedforward_rad_s: made(|steering| steering.feedforward_rad_s)?,
        centre_distance_m: made(|steering| steering.centre_distance_m)?,
        phase_rad: made(|steering| steering.phase.rad())?,
        convergence_threshold_m2_s: made(|steering| steering.convergence_threshold_m2_s)?,
        centre_too_fast: Made::of(py, &lead, &[], steerings.iter().map(|one| one.centre_too_fast).collect())?,
    })
}

fn vector(given: &Given<'_>, name: &'static str, allowed: Allowed) -> PyResult<Rows<f64, 2>> {
    Rows::read(given, name, "..., 2")?.within(allowed, None)
}

fn number(given: &Given<'_>, name: &'static str, allowed: Allowed) -> PyResult<Rows<f64, 1>> {
    Rows::read(given, name, "...")?.within(allowed, None)
}

fn number_or(given: Option<Given<'_>>, name: &'static str, allowed: Allowed, or: f64) -> PyResult<Rows<f64, 1>> {
    Rows::or(Rows::read_if(given.as_ref(), name, "...")?, name, [or]).within(allowed, None)
}
