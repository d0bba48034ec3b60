//! From a spread to a standoff distance, a field onto it, and a turn rate: (12-15), (20), (22-25), (28, 29).

use pyo3::prelude::*;
use standoff::guidance::heading;
use standoff::guidance::standoff_distance::Ramp;
use standoff::{Allowed, Angle, Orbit, Spread, UavState, VectorField};

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, RATE, Rows, common, each};
use super::parameters::Parameters;

/// A radius that leaves no division by nothing.
const RADIUS_M: Allowed = Allowed::at_least(1e-3).at_most(1e9);
/// A speed of flight.
const SPEED_M_S: Allowed = Allowed::at_least(1e-3).at_most(1e6);

/// Standoff distances and their rates.
#[pyclass(frozen, module = "standoff.pieces")]
#[derive(Debug)]
pub(crate) struct StandoffDistance {
    /// (15) within its bounds, r_d, shape (...), m.
    #[pyo3(get)]
    distance_m: Made<f64>,
    /// Rate of r_d, shape (...), m/s; 0 on a bound.
    #[pyo3(get)]
    rate_m_s: Made<f64>,
    /// (15) before the bounds, shape (...), m.
    #[pyo3(get)]
    unclamped_m: Made<f64>,
}

/// The standoff distance at which a group's furthest member lies inside the field of view (15).
///
/// :param spread_m: shape (...), d_max, how far the furthest member is from the centre, m.
/// :param spread_rate_m_s: shape (...), how fast that grows, m/s.
/// :param margin_m: shape (...), d_m, m.
/// :param parameters: field_of_view_rad, field_of_view_margin_rad, radius_min_m, radius_max_m; the paper's Table I if
///     left out.
/// :returns: distances, within bounds and not, and their rates.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (spread_m, *, spread_rate_m_s=None, margin_m=None, parameters=None))]
pub(crate) fn standoff_distance(
    py: Python<'_>,
    spread_m: Given<'_>,
    spread_rate_m_s: Option<Given<'_>>,
    margin_m: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<StandoffDistance> {
    let standoff = Parameters::or_table_1(parameters).group.standoff;
    let spread = number(&spread_m, "spread_m", DISTANCE_M)?;
    let rate = number_or(spread_rate_m_s, "spread_rate_m_s", RATE, 0.0)?;
    let margin = number_or(margin_m, "margin_m", DISTANCE_M, 0.0)?;
    let lead = common(&[spread.axes(), rate.axes(), margin.axes()])?;
    let (spread, rate, margin) = (spread.over(&lead)?, rate.over(&lead)?, margin.over(&lead)?);
    let distances = each(py, lead.iter().product(), PATIENCE, |row| {
        standoff.distance(Spread { distance_m: spread.one(row), rate_m_s: rate.one(row) }, margin.one(row))
    })?;
    Ok(StandoffDistance {
        distance_m: Made::of(py, &lead, &[], distances.iter().map(|d| d.distance_m).collect())?,
        rate_m_s: Made::of(py, &lead, &[], distances.iter().map(|d| d.rate_m_s).collect())?,
        unclamped_m: Made::of(py, &lead, &[], distances.iter().map(|d| d.unclamped_m).collect())?,
    })
}

/// The radius steered for while the standoff distance changes: active measure 2 (22), within the bounds.
///
/// :param distance_m: shape (...), standoff distance r_d, m.
/// :param rate_m_s: shape (...), its rate, m/s.
/// :param speed_m_s: shape (...), speed relative to the centre, of which the lead may depend; the parameters' own if left
///     out, m/s.
/// :param parameters: lead, lead_s, radial_gain, radius_min_m, radius_max_m; the paper's Table I if left out.
/// :returns: radius, shape (...), m, and its rate, shape (...), m/s; 0 on a bound.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (distance_m, rate_m_s, *, speed_m_s=None, parameters=None))]
pub(crate) fn led_distance(
    py: Python<'_>,
    distance_m: Given<'_>,
    rate_m_s: Given<'_>,
    speed_m_s: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<(Made<f64>, Made<f64>)> {
    let team = Parameters::or_table_1(parameters);
    let distance = number(&distance_m, "distance_m", RADIUS_M)?;
    let rate = number(&rate_m_s, "rate_m_s", RATE)?;
    let speed = number_or(speed_m_s, "speed_m_s", SPEED_M_S, team.uav.speed_m_s)?;
    let lead = common(&[distance.axes(), rate.axes(), speed.axes()])?;
    let (distance, rate, speed) = (distance.over(&lead)?, rate.over(&lead)?, speed.over(&lead)?);
    let led = each(py, lead.iter().product(), PATIENCE, |row| {
        let ramp = Ramp { radius_m: distance.one(row), rate_m_s: rate.one(row) };
        ramp.led(team.guidance.lead_s(ramp.radius_m, speed.one(row)), &team.group.standoff)
    })?;
    let radius_m = Made::of(py, &lead, &[], led.iter().map(|led| led.radius_m).collect())?;
    Ok((radius_m, Made::of(py, &lead, &[], led.iter().map(|led| led.rate_m_s).collect())?))
}

/// The Lyapunov vector field onto a circle about a centre at rest (13), with the direction of (20) where k_l is below 1.
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param centre_m: shape (..., 2), east and north, m.
/// :param distance_m: shape (...), radius r_d of the circle, m.
/// :param speed_m_s: shape (...), length of the field, m/s; the parameters' own if left out.
/// :param parameters: sense, radial_gain, speed_m_s; the paper's Table I if left out.
/// :returns: desired velocity relative to the centre, shape (..., 2), east and north, m/s; at the very centre it points
///     east.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, centre_m, *, distance_m, speed_m_s=None, parameters=None))]
pub(crate) fn vector_field(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    centre_m: Given<'_>,
    distance_m: Given<'_>,
    speed_m_s: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let team = Parameters::or_table_1(parameters);
    let uav = vector(&uav_position_m, "uav_position_m", COORDINATE_M)?;
    let centre = vector(&centre_m, "centre_m", COORDINATE_M)?;
    let distance = number(&distance_m, "distance_m", RADIUS_M)?;
    let speed = number_or(speed_m_s, "speed_m_s", SPEED_M_S, team.uav.speed_m_s)?;
    let lead = common(&[uav.axes(), centre.axes(), distance.axes(), speed.axes()])?;
    let (uav, centre) = (uav.over(&lead)?, centre.over(&lead)?);
    let (distance, speed) = (distance.over(&lead)?, speed.over(&lead)?);
    let velocities = each(py, lead.iter().product(), PATIENCE, |row| {
        let field = VectorField {
            radius_m: distance.one(row),
            radial_gain: team.guidance.radial_gain,
            sense: team.guidance.sense,
        };
        let velocity = field.velocity(uav.position(row) - centre.position(row), speed.one(row));
        [velocity.x_m_s(), velocity.y_m_s()]
    })?;
    Made::of(py, &lead, &[2], velocities.into_flattened())
}

/// What the law wants of UAVs, and what it looked at.
#[pyclass(frozen, module = "standoff.pieces")]
#[derive(Debug)]
pub(crate) struct Steering {
    /// Wanted turn rate u_omega before limits (24), shape (...), rad/s, positive to the left.
    #[pyo3(get)]
    turn_rate_rad_s: Made<f64>,
    /// Desired heading psi_d over ground (23, 28), shape (...), rad anticlockwise from east.
    #[pyo3(get)]
    desired_heading_rad: Made<f64>,
    /// Its derivative, the feedforward part of the turn rate (25), shape (...), rad/s.
    #[pyo3(get)]
    feedforward_rad_s: Made<f64>,
    /// Distance r from the centre, shape (...), m.
    #[pyo3(get)]
    centre_distance_m: Made<f64>,
    /// Direction from the centre to the UAV, shape (...), rad anticlockwise from east.
    #[pyo3(get)]
    phase_rad: Made<f64>,
    /// Threshold xi_th of Lemma 3.1, shape (...), m2/s: while it is not negative, the UAV converges.
    #[pyo3(get)]
    convergence_threshold_m2_s: Made<f64>,
    /// Where the centre is too fast for the field (29), shape (...); the heading is then the best there is.
    #[pyo3(get)]
    centre_too_fast: Made<bool>,
}

/// Steers UAVs onto orbits: the vector field about a centre that moves, and the turn rate of the Lyapunov law (23-25,
/// 28, 29).
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param heading_rad: shape (...), where the nose points, rad anticlockwise from east.
/// :param centre_m: shape (..., 2), estimated centre of the orbit, east and north, m.
/// :param distance_m: shape (...), standoff distance r_d, m.
/// :param rate_m_s: shape (...), its rate, m/s.
/// :param steered_distance_m: shape (...), radius steered for (22), of :func:`led_distance`, m; distance_m if left out.
/// :param steered_rate_m_s: shape (...), its rate, m/s; rate_m_s if left out.
/// :param centre_velocity_m_s: shape (..., 2), velocity of the centre, east and north, m/s.
/// :param speed_m_s: shape (...), the speed over ground that is commanded, m/s; the parameters' own if left out.
/// :param uav_speed_m_s: shape (...), the speed flown now, m/s, which only the feedforward ``"actual"`` looks at;
///     speed_m_s if left out.
/// :param turn_rate_rad_s: shape (...), the turn rate flown now, rad/s, which only a turn_rate_gain above 0 looks at.
/// :param parameters: sense, radial_gain, speed_reference, heading_gain_1_s, turn_rate_gain, feedforward, speed_m_s; the
///     paper's Table I if left out.
/// :returns: the turn rate, and what it is made of.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, heading_rad, centre_m, *, distance_m, rate_m_s=None, steered_distance_m=None,
    steered_rate_m_s=None, centre_velocity_m_s=None, speed_m_s=None, uav_speed_m_s=None, turn_rate_rad_s=None,
    parameters=None))]
#[expect(clippy::too_many_arguments, reason = "they are given by name")]
pub(crate) fn steer(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    heading_rad: Given<'_>,
    centre_m: Given<'_>,
    distance_m: Given<'_>,
    rate_m_s: Option<Given<'_>>,
    steered_distance_m: Option<Given<'_>>,
    steered_rate_m_s: Option<Given<'_>>,
    centre_velocity_m_s: Option<Given<'_>>,
    speed_m_s: Option<Given<'_>>,
    uav_speed_m_s: Option<Given<'_>>,
    turn_rate_rad_s: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Steering> {
    let team = Parameters::or_table_1(parameters);
    let guidance = team.guidance;
    let uav = vector(&uav_position_m, "uav_position_m", COORDINATE_M)?;
    let heading = number(&heading_rad, "heading_rad", Allowed::FINITE)?;
    let centre = vector(&centre_m, "centre_m", COORDINATE_M)?;
    let distance = number(&distance_m, "distance_m", RADIUS_M)?;
    let rate = number_or(rate_m_s, "rate_m_s", RATE, 0.0)?;
    let or_else = |given: Option<Given<'_>>, name, allowed, or: &Rows<f64, 1>| {
        given.map_or_else(|| Ok(or.clone()), |given| number(&given, name, allowed))
    };
    let steered = or_else(steered_distance_m, "steered_distance_m", RADIUS_M, &distance)?;
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
        heading::steer(&guidance, &state, &orbit, speed.one(row))
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
