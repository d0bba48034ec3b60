//! Arguments and results as NumPy arrays.
//!
//! An argument is anything that NumPy converts to an array of real numbers. It has a row for each of n items, or a single
//! row for all of them.

use std::convert::Infallible;

use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
#[cfg(feature = "stubs")]
use pyo3::type_hint_identifier;
use standoff::validation::Allowed;

use crate::exceptions::{InputError, StandoffError};

/// Allowed coordinates, m, and components of states. A coordinate beyond a million kilometres is a mistake, and its
/// square could not resolve metres.
pub(crate) const COORDINATE_M: Allowed = Allowed::at_least(-1e9).at_most(1e9);
/// Allowed distances, m.
pub(crate) const DISTANCE_M: Allowed = Allowed::at_least(0.0).at_most(1e9);
/// Allowed rates of distances, m/s.
pub(crate) const RATE_M_S: Allowed = Allowed::at_least(-1e6).at_most(1e6);

/// An array argument before any check.
pub(crate) struct Given<'py>(Bound<'py, PyAny>);

impl<'py> FromPyObject<'_, 'py> for Given<'py> {
    type Error = Infallible;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("numpy.typing", "ArrayLike");

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> Result<Self, Self::Error> {
        Ok(Self(given.to_owned()))
    }
}

/// An argument of any shape.
pub(crate) struct Numbers {
    name: &'static str,
    shape: Vec<usize>,
    /// Values in row-major order. They are a copy, which other threads cannot change.
    pub(crate) values: Vec<f64>,
}

impl Numbers {
    pub(crate) fn read(given: &Given<'_>, name: &'static str) -> PyResult<Self> {
        let (given, py) = (&given.0, given.0.py());
        let numpy = py.import("numpy")?;
        if numpy.getattr("ma")?.call_method1("isMaskedArray", (given,))?.is_truthy()? {
            return Err(InputError::new_err(format!("{name} is a masked array: must be an ordinary array")));
        }
        let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
            let is_about_values = error.is_instance_of::<PyValueError>(py);
            let what = || format!("{name} is not an array of real numbers: {}", error.value(py));
            if is_about_values { InputError::new_err(what()) } else { error }
        })?;
        let dtype = array.getattr("dtype")?;
        if !["f", "i", "u"].contains(&dtype.getattr("kind")?.extract()?) {
            return Err(InputError::new_err(format!("{name} is of type {dtype}: must be real numbers")));
        }
        let array = array.call_method1("astype", ("float64",))?.cast_into::<PyArrayDyn<f64>>()?.to_owned_array();
        Ok(Self { name, shape: array.shape().to_vec(), values: array.into_iter().collect() })
    }

    /// Checks that the shape is `expected`, which `what` explains.
    pub(crate) fn of_shape(self, expected: &[usize], what: &str) -> PyResult<Self> {
        if self.shape == expected { Ok(self) } else { Err(self.wrong_shape(&format!("{}, {what}", shape(expected)))) }
    }

    fn wrong_shape(&self, expected: &str) -> PyErr {
        InputError::new_err(format!("{} has the shape {}: must be {expected}", self.name, shape(&self.shape)))
    }

    /// Checks the range of all values.
    fn within(self, allowed: Allowed) -> PyResult<Self> {
        self.each(|value| allowed.contains(value), &allowed.to_string())
    }

    /// Checks the range of all values. NaN marks a missing value.
    pub(crate) fn within_or_nan(self, allowed: Allowed) -> PyResult<Self> {
        let expected = format!("{allowed}, or NaN if there is no measurement");
        self.each(|value| value.is_nan() || allowed.contains(value), &expected)
    }

    fn each(self, is_allowed: impl Fn(f64) -> bool, expected: &str) -> PyResult<Self> {
        let Some(mut flat) = self.values.iter().position(|value| !is_allowed(*value)) else { return Ok(self) };
        let value = self.values[flat];
        let mut index: Vec<usize> = self.shape.iter().rev().map(|length| (flat % length, flat /= length).0).collect();
        index.reverse();
        let place = if index.is_empty() { String::new() } else { format!("{index:?}") };
        Err(InputError::new_err(format!("{}{place} = {value}: must be {expected}", self.name)))
    }
}

/// K numbers for each item, or one row of them for all items.
pub(crate) struct Rows<const K: usize>(Vec<[f64; K]>);

impl<const K: usize> Rows<K> {
    /// Returns the row of an item.
    pub(crate) fn at(&self, item: usize) -> [f64; K] {
        self.0[if self.0.len() == 1 { 0 } else { item }]
    }
}

impl Rows<1> {
    /// Returns the number of an item.
    pub(crate) fn one(&self, item: usize) -> f64 {
        self.at(item)[0]
    }
}

/// Reads the arguments of a call, which all describe the same items.
#[derive(Default)]
pub(crate) struct Arguments {
    /// First argument with a row for each item, and the number of its rows.
    first: Option<(&'static str, usize)>,
}

impl Arguments {
    /// Reads an argument. `row` is the shape of a row.
    pub(crate) fn read<const K: usize>(
        &mut self,
        given: &Given<'_>,
        name: &'static str,
        row: &[usize],
        allowed: Allowed,
    ) -> PyResult<Rows<K>> {
        let numbers = Numbers::read(given, name)?;
        match numbers.shape.strip_suffix(row) {
            Some([]) => {}
            Some([count]) => {
                let (first, expected) = *self.first.get_or_insert((name, *count));
                if *count != expected {
                    let what = format!("{name} has {count} rows, but {first} has {expected}: must be equal");
                    return Err(InputError::new_err(what));
                }
            }
            _ => {
                let several: String = row.iter().map(|length| format!(" {length},")).collect();
                let several = several.strip_suffix(',').unwrap_or_default();
                return Err(numbers.wrong_shape(&format!("(n,{several}), or {} for all n", shape(row))));
            }
        }
        Ok(Rows(numbers.within(allowed)?.values.as_chunks().0.to_vec()))
    }

    /// Reads an optional number, which is `or` for all items if it is missing.
    pub(crate) fn read_or(
        &mut self,
        given: Option<&Given<'_>>,
        name: &'static str,
        allowed: Allowed,
        or: f64,
    ) -> PyResult<Rows<1>> {
        given.map_or(Ok(Rows(vec![[or]])), |given| self.read(given, name, &[], allowed))
    }

    /// Number of items; `None` if every argument has a single row.
    pub(crate) fn count(&self) -> Option<usize> {
        self.first.map(|(_, count)| count)
    }
}

/// Makes a result array with a row of shape `row` for each of `count` items, or a single row.
pub(crate) fn made<T: Element>(
    py: Python<'_>,
    count: Option<usize>,
    row: &[usize],
    values: impl Iterator<Item = T>,
) -> PyResult<Py<PyArrayDyn<T>>> {
    let shape: Vec<usize> = count.into_iter().chain(row.iter().copied()).collect();
    let array = ArrayD::from_shape_vec(IxDyn(&shape), values.collect());
    Ok(array.map_err(|error| StandoffError::new_err(error.to_string()))?.into_pyarray(py).unbind())
}

/// Returns the upper triangle of a symmetric 6x6 matrix, row by row.
pub(crate) fn upper_triangle(matrix: &[f64; 36]) -> [f64; 21] {
    let mut places = (0..6).flat_map(|row| (row..6).map(move |column| 6 * row + column));
    std::array::from_fn(|_| places.next().map_or(0.0, |place| matrix[place]))
}

/// Formats a shape like Python does.
fn shape(of: &[usize]) -> String {
    match of {
        [one] => format!("({one},)"),
        axes => format!("({})", axes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}
