//! Actions as they come from Python.

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::failure::InputError;

/// The numbers of an array of this shape, float32 or float64, contiguous or not; all finite.
pub(super) fn read(actions: &Bound<'_, PyAny>, shape: [usize; 3]) -> PyResult<Vec<f64>> {
    let wanted = || format!("float32 or float64 of shape {}", told(&shape));
    let Ok(array) = actions.cast::<PyUntypedArray>() else {
        let there = actions.get_type().name()?;
        return Err(InputError::new_err(format!("actions: a NumPy array of {}, not {there}", wanted())));
    };
    if array.shape() != shape {
        let what = format!("actions: {}, not of shape {}", wanted(), told(array.shape()));
        return Err(InputError::new_err(what));
    }
    let numbers: Vec<f64> = if let Ok(array) = actions.cast::<PyArrayDyn<f32>>() {
        array.try_readonly()?.as_array().iter().map(|number| f64::from(*number)).collect()
    } else if let Ok(array) = actions.cast::<PyArrayDyn<f64>>() {
        array.try_readonly()?.as_array().iter().copied().collect()
    } else {
        return Err(InputError::new_err(format!("actions: {}, not {}", wanted(), array.dtype())));
    };
    if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
        let [_, uavs, parts] = shape;
        let (world, uav) = (index / (uavs * parts), index / parts % uavs);
        let what = format!("actions: {} of world {world}, UAV {uav} is not finite", numbers[index]);
        return Err(InputError::new_err(what));
    }
    Ok(numbers)
}

fn told(shape: &[usize]) -> String {
    let parts: Vec<String> = shape.iter().map(ToString::to_string).collect();
    format!("({})", parts.join(", "))
}
