//! What is measured of a target, and what that tells: (7), (31), (36).

use pyo3::prelude::*;
use standoff::Angle;
use standoff::guidance::pair_information;
use standoff::sensor;

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, Rows, common, each};
use super::parameters::Parameters;
use standoff::Allowed;

/// Angles brought into (-pi, pi].
///
/// :param angle_rad: shape (...), rad.
/// :returns: the same angles in (-pi, pi], shape (...), rad.
/// :raises InputError: an argument of another shape or type, or a number that is none.
#[pyfunction]
pub(crate) fn wrapped_angle_rad(py: Python<'_>, angle_rad: Given<'_>) -> PyResult<Made<f64>> {
    let angle_rad = Rows::<f64, 1>::read(&angle_rad, "angle_rad", "...")?.within(Allowed::FINITE, None)?;
    let lead = common(&[angle_rad.axes()])?;
    let wrapped = each(py, lead.iter().product(), PATIENCE, |row| Angle::from_rad(angle_rad.one(row)).rad())?;
    Made::of(py, &lead, &[], wrapped)
}

/// Range and bearing from UAVs to targets, without noise (7).
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param target_position_m: shape (..., 2), east and north, m.
/// :returns: range, shape (...), m, and bearing, shape (...), rad anticlockwise from east, in (-pi, pi].
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
pub(crate) fn measure(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    target_position_m: Given<'_>,
) -> PyResult<(Made<f64>, Made<f64>)> {
    let [uav, target] = positions(&uav_position_m, &target_position_m)?;
    let lead = common(&[uav.axes(), target.axes()])?;
    let (uav, target) = (uav.over(&lead)?, target.over(&lead)?);
    let measured =
        each(py, lead.iter().product(), PATIENCE, |row| sensor::measure(uav.position(row), target.position(row)))?;
    let range_m = measured.iter().map(|z| z.range_m).collect();
    let bearing_rad = measured.iter().map(|z| z.bearing.rad()).collect();
    Ok((Made::of(py, &lead, &[], range_m)?, Made::of(py, &lead, &[], bearing_rad)?))
}

/// What one measurement tells about a target's position: Fisher information H' R^-1 H (31). Zero within 1 m.
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param target_position_m: shape (..., 2), east and north, m.
/// :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
/// :returns: shape (..., 2, 2), 1/m2. What several UAVs tell of a target adds up.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, target_position_m, *, parameters=None))]
pub(crate) fn information_1_m2(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    target_position_m: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_table_1(parameters).track.sensor;
    let [uav, target] = positions(&uav_position_m, &target_position_m)?;
    let lead = common(&[uav.axes(), target.axes()])?;
    let (uav, target) = (uav.over(&lead)?, target.over(&lead)?);
    let information = each(py, lead.iter().product(), PATIENCE, |row| {
        // Symmetric: columns are rows.
        let information: [[f64; 2]; 2] = sensor.information(uav.position(row), target.position(row)).into();
        information
    })?;
    Made::of(py, &lead, &[2, 2], information.into_flattened().into_flattened())
}

/// Determinant of what two UAVs tell together about a target's position (36).
///
/// :param range_m: shape (..., 2), of both to the target, m; one within 1 m tells nothing.
/// :param separation_rad: shape (...), angle gamma at the target between their lines of sight, rad.
/// :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
/// :returns: shape (...), 1/m4.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (range_m, separation_rad, *, parameters=None))]
pub(crate) fn pair_information_1_m4(
    py: Python<'_>,
    range_m: Given<'_>,
    separation_rad: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_table_1(parameters).track.sensor;
    let ranges = Rows::<f64, 2>::read(&range_m, "range_m", "..., 2")?.within(DISTANCE_M, None)?;
    let separation = Rows::<f64, 1>::read(&separation_rad, "separation_rad", "...")?.within(Allowed::FINITE, None)?;
    let lead = common(&[ranges.axes(), separation.axes()])?;
    let (ranges, separation) = (ranges.over(&lead)?, separation.over(&lead)?);
    let information = each(py, lead.iter().product(), PATIENCE, |row| {
        pair_information::pair_information_1_m4(ranges.at(row), separation.one(row), &sensor)
    })?;
    Made::of(py, &lead, &[], information)
}

/// A separation at which two UAVs at these ranges tell most about a target: pi/2 with both nearer or both further than
/// sigma_r / sigma_theta, 0 (or, alike, pi) with one on either side; pi/2 also where separation does not matter.
///
/// :param range_m: shape (..., 2), of both to the target, m.
/// :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
/// :returns: shape (...), angle at the target between their lines of sight, rad.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (range_m, *, parameters=None))]
pub(crate) fn best_separation_rad(
    py: Python<'_>,
    range_m: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_table_1(parameters).track.sensor;
    let ranges = Rows::<f64, 2>::read(&range_m, "range_m", "..., 2")?.within(DISTANCE_M, None)?;
    let lead = common(&[ranges.axes()])?;
    let best = each(py, lead.iter().product(), PATIENCE, |row| {
        pair_information::best_separation_rad(ranges.at(row), &sensor).unwrap_or(0.5 * standoff::math::PI)
    })?;
    Made::of(py, &lead, &[], best)
}

/// Where UAVs and targets are.
fn positions(uav: &Given<'_>, target: &Given<'_>) -> PyResult<[Rows<f64, 2>; 2]> {
    Ok([
        Rows::read(uav, "uav_position_m", "..., 2")?.within(COORDINATE_M, None)?,
        Rows::read(target, "target_position_m", "..., 2")?.within(COORDINATE_M, None)?,
    ])
}
