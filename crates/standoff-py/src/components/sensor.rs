//! Measurement model and Fisher information: (7), (31), (36).

use pyo3::prelude::*;
use standoff::Angle;
use standoff::guidance::pair_information;
use standoff::sensor;

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, Rows, common, each};
use super::parameters::Parameters;
use standoff::Allowed;

/// Wraps angles to (-pi, pi].
///
/// :param angle_rad: shape (...), rad.
/// :returns: the same angles in (-pi, pi], shape (...), rad.
/// :raises InputError: if an argument has the wrong shape or type, or a value is not finite.
#[pyfunction]
pub(crate) fn wrapped_angle_rad(py: Python<'_>, angle_rad: Given<'_>) -> PyResult<Made<f64>> {
    let angle_rad = Rows::<f64, 1>::read(&angle_rad, "angle_rad", "...")?.within(Allowed::FINITE, None)?;
    let lead = common(&[angle_rad.axes()])?;
    let wrapped = each(py, lead.iter().product(), PATIENCE, |row| Angle::from_rad(angle_rad.one(row)).rad())?;
    Made::of(py, &lead, &[], wrapped)
}

/// Computes range and bearing from UAVs to targets, without noise (7).
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param target_position_m: shape (..., 2), east and north, m.
/// :returns: range, shape (...), m, and bearing, shape (...), rad anticlockwise from east, in (-pi, pi].
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
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

/// Computes the Fisher information of one measurement about a target's position, H' R^-1 H (31). It is zero if UAV and
/// target are less than 1 m apart.
///
/// :param uav_position_m: shape (..., 2), east and north, m.
/// :param target_position_m: shape (..., 2), east and north, m.
/// :param parameters: uses range_sd_m, bearing_sd_rad; ``Parameters()`` by default.
/// :returns: shape (..., 2, 2), 1/m2. The information of several UAVs about one target adds up.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, target_position_m, *, parameters=None))]
pub(crate) fn information_1_m2(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    target_position_m: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_recommended(parameters).track.sensor;
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

/// Computes the determinant of the joint Fisher information of two UAVs about a target's position (36).
///
/// :param range_m: shape (..., 2), ranges from both UAVs to the target, m; a UAV within 1 m contributes no information.
/// :param phase_difference_rad: shape (...), angle gamma at the target between the directions to the two UAVs, rad.
/// :param parameters: uses range_sd_m, bearing_sd_rad; ``Parameters()`` by default.
/// :returns: shape (...), 1/m4.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (range_m, phase_difference_rad, *, parameters=None))]
pub(crate) fn pair_information_1_m4(
    py: Python<'_>,
    range_m: Given<'_>,
    phase_difference_rad: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_recommended(parameters).track.sensor;
    let ranges = Rows::<f64, 2>::read(&range_m, "range_m", "..., 2")?.within(DISTANCE_M, None)?;
    let phase =
        Rows::<f64, 1>::read(&phase_difference_rad, "phase_difference_rad", "...")?.within(Allowed::FINITE, None)?;
    let lead = common(&[ranges.axes(), phase.axes()])?;
    let (ranges, phase) = (ranges.over(&lead)?, phase.over(&lead)?);
    let information = each(py, lead.iter().product(), PATIENCE, |row| {
        pair_information::pair_information_1_m4(ranges.at(row), phase.one(row), &sensor)
    })?;
    Made::of(py, &lead, &[], information)
}

/// Computes the angle gamma that maximises the information of two UAVs at the given ranges (36).
///
/// It is pi/2 if both ranges are below or both above sigma_r / sigma_theta, and 0 (equivalent to pi) if one is below
/// and one above. If the angle has no influence, the result is pi/2.
///
/// :param range_m: shape (..., 2), ranges from both UAVs to the target, m.
/// :param parameters: uses range_sd_m, bearing_sd_rad; ``Parameters()`` by default.
/// :returns: shape (...), angle at the target between the directions to the two UAVs, rad.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (range_m, *, parameters=None))]
pub(crate) fn optimal_phase_difference_rad(
    py: Python<'_>,
    range_m: Given<'_>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<f64>> {
    let sensor = Parameters::or_recommended(parameters).track.sensor;
    let ranges = Rows::<f64, 2>::read(&range_m, "range_m", "..., 2")?.within(DISTANCE_M, None)?;
    let lead = common(&[ranges.axes()])?;
    let best = each(py, lead.iter().product(), PATIENCE, |row| {
        pair_information::optimal_phase_difference_rad(ranges.at(row), &sensor).unwrap_or(0.5 * standoff::math::PI)
    })?;
    Made::of(py, &lead, &[], best)
}

/// Reads the positions of UAVs and targets.
fn positions(uav: &Given<'_>, target: &Given<'_>) -> PyResult<[Rows<f64, 2>; 2]> {
    Ok([
        Rows::read(uav, "uav_position_m", "..., 2")?.within(COORDINATE_M, None)?,
        Rows::read(target, "target_position_m", "..., 2")?.within(COORDINATE_M, None)?,
    ])
}
