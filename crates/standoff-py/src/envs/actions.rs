//! Reads the action array that Python passes.

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::exceptions::InputError;

/// Reads the finite values of a float32 or float64 array of this shape, contiguous or not.
pub(super) fn read(actions: &Bound<'_, PyAny>, shape: [usize; 3]) -> PyResult<Vec<f64>> {
    let Ok(array) = actions.cast::<PyUntypedArray>() else {
        let there = actions.get_type().name()?;
        return Err(InputError::new_err(format!("actions: must be a NumPy array of float32 or float64, not {there}")));
    };
    if array.shape() != shape {
        let [expected, there] = [&shape, array.shape()].map(shape_text);
        let what = format!("actions: must be float32 or float64 of shape {expected}, not of shape {there}");
        return Err(InputError::new_err(what));
    }
    let numbers: Vec<f64> = if let Ok(array) = actions.cast::<PyArrayDyn<f32>>() {
        array.try_readonly()?.as_array().iter().map(|number| f64::from(*number)).collect()
    } else if let Ok(array) = actions.cast::<PyArrayDyn<f64>>() {
        array.try_readonly()?.as_array().iter().copied().collect()
    } else {
        return Err(InputError::new_err(format!("actions: must be float32 or float64, not {}", array.dtype())));
    };
    if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
        let [_, uavs, parts] = shape;
        let (world, uav) = (index / (uavs * parts), index / parts % uavs);
        let what = format!("actions: {} of world {world}, UAV {uav} is not finite", numbers[index]);
        return Err(InputError::new_err(what));
    }
    Ok(numbers)
}

/// Formats a shape as Python does.
fn shape_text(shape: &[usize]) -> String {
    match shape {
        [length] => format!("({length},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}
