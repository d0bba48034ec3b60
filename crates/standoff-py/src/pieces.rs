//! The library's pieces by name, on NumPy arrays.

use numpy::{IntoPyArray, PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use standoff::Angle;

/// Angles brought into (-pi, pi].
///
/// :param angle_rad: angles, rad, any shape.
/// :returns: the same angles, rad, in (-pi, pi], of that shape.
#[pyfunction]
pub(crate) fn wrapped_angle_rad<'py>(
    py: Python<'py>,
    angle_rad: PyReadonlyArrayDyn<'py, f64>,
) -> Bound<'py, PyArrayDyn<f64>> {
    angle_rad.as_array().mapv(|angle_rad| Angle::from_rad(angle_rad).rad()).into_pyarray(py)
}
