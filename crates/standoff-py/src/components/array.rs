//! Arguments and results as NumPy arrays.
//!
//! An argument is anything that NumPy converts to an array of real numbers: lists, integers, any strides and byte
//! order. It is copied, so that other threads cannot change it while the GIL is released, and broadcast over the
//! leading axes of all arguments by NumPy's rules.

use std::convert::Infallible;

use numpy::ndarray::{ArrayD, ArrayViewD, IxDyn};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyUntypedArray};
use pyo3::exceptions::{PyTypeError, PyValueError};
#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
#[cfg(feature = "stubs")]
use pyo3::{type_hint_identifier, type_hint_subscript};
use standoff::validation::Allowed;
use standoff::{Position, Velocity};

use crate::exceptions::{InputError, StandoffError};

/// Allowed coordinates, m. A coordinate beyond a million kilometres is a mistake, and its square could not resolve
/// metres.
pub(crate) const COORDINATE_M: Allowed = Allowed::at_least(-1e9).at_most(1e9);
/// Allowed distances, m.
pub(crate) const DISTANCE_M: Allowed = Allowed::at_least(0.0).at_most(1e9);
/// Allowed velocities and other rates, per second.
pub(crate) const RATE: Allowed = Allowed::at_least(-1e6).at_most(1e6);

/// Maximum number of rows per call; their results fit into a few gigabytes.
const ROWS_MAX: usize = 10_000_000;

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

/// Element type of an array.
pub(crate) trait Kind: Element + Copy + Send + Sync {
    /// NumPy kind codes of the types that can be converted to this one.
    const LETTERS: &'static str;
    /// NumPy name of the type.
    const NAME: &'static str;
    /// Description for error messages.
    const EXPECTED: &'static str;
    /// Type hint of a result array in the stubs.
    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: PyStaticExpr;
}

macro_rules! kind {
    ($rust:ty, $letters:literal, $name:literal, $scalar:literal, $expected:literal) => {
        impl Kind for $rust {
            const LETTERS: &'static str = $letters;
            const NAME: &'static str = $name;
            const EXPECTED: &'static str = $expected;
            #[cfg(feature = "stubs")]
            const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
                type_hint_identifier!("numpy.typing", "NDArray"),
                type_hint_identifier!("numpy", $scalar)
            );
        }
    };
}

kind!(f64, "fiu", "float64", "float64", "real numbers");
kind!(i64, "iu", "int64", "int64", "integers");
kind!(bool, "b", "bool", "bool_", "True and False");

/// An argument as rows of K values each, over leading axes.
#[derive(Clone)]
pub(crate) struct Rows<T, const K: usize> {
    name: &'static str,
    /// Shape of the argument.
    own: Vec<usize>,
    /// Number of trailing axes that form a row.
    row_axes: usize,
    /// Leading axes, after broadcasting if [`Rows::over`] was called.
    lead: Vec<usize>,
    /// Values, row by row; a single row applies to all rows.
    values: Vec<T>,
}

impl<T: Kind, const K: usize> Rows<T, K> {
    /// Reads an argument of a shape such as `..., k, 2`: any axes, one axis of any length, one of length 2. The
    /// trailing axes that are given as numbers form a row.
    pub(crate) fn read(given: &Given<'_>, name: &'static str, axes: &'static str) -> PyResult<Self> {
        let (own, values) = elements(given, name)?;
        let expected: Vec<&str> = axes.split(", ").collect();
        let (any, fixed) = match expected.as_slice() {
            ["...", fixed @ ..] => (true, fixed),
            fixed => (false, fixed),
        };
        let fits = |(length, axis): (&usize, &&str)| axis.parse().map_or(true, |expected: usize| *length == expected);
        let is_as_expected = (own.len() == fixed.len() || any && own.len() > fixed.len())
            && own[own.len() - fixed.len()..].iter().zip(fixed).all(fits);
        if !is_as_expected {
            return Err(InputError::new_err(format!("{name} has the shape {}: expected ({axes})", shape(&own))));
        }
        let row_axes = fixed.iter().rev().take_while(|axis| axis.parse::<usize>().is_ok()).count();
        let lead = own[..own.len() - row_axes].to_vec();
        Ok(Self { name, own, row_axes, lead, values })
    }

    /// Reads an optional argument.
    pub(crate) fn read_if(given: Option<&Given<'_>>, name: &'static str, axes: &'static str) -> PyResult<Option<Self>> {
        given.map(|given| Self::read(given, name, axes)).transpose()
    }

    /// Returns the argument, or `row` for all rows if it is missing.
    pub(crate) fn or(given: Option<Self>, name: &'static str, row: [T; K]) -> Self {
        let values = row.to_vec();
        given.unwrap_or_else(|| Self { name, own: vec![K], row_axes: 1, lead: Vec::new(), values })
    }

    /// Name and leading axes, for [`common`].
    pub(crate) fn axes(&self) -> (&'static str, &[usize]) {
        (self.name, &self.lead)
    }

    /// Broadcasts the argument over the leading axes that [`common`] returned.
    pub(crate) fn over(mut self, lead: &[usize]) -> PyResult<Self> {
        if self.lead != lead && self.values.len() != K {
            let view = ArrayViewD::from_shape(IxDyn(&self.lead), self.rows()).map_err(bug)?;
            let spread = view.broadcast(IxDyn(lead)).ok_or_else(|| {
                let (name, own, lead) = (self.name, shape(&self.lead), shape(lead));
                InputError::new_err(format!("{name} has the leading axes {own}: expected {lead}"))
            })?;
            self.values = spread.iter().flatten().copied().collect();
        }
        self.lead = lead.to_vec();
        Ok(self)
    }

    fn rows(&self) -> &[[T; K]] {
        self.values.as_chunks().0
    }

    /// Returns the row with this index.
    #[inline]
    pub(crate) fn at(&self, index: usize) -> [T; K] {
        let rows = self.rows();
        if rows.len() == 1 { rows[0] } else { rows[index] }
    }

    /// Index of an element in the caller's array, for messages: `name[1, 0]`.
    fn place(&self, row: usize, column: usize) -> String {
        let sizes = |axes: &[usize], mut flat: usize| {
            let mut index: Vec<usize> = axes.iter().rev().map(|n| (flat % n, flat /= n).0).collect();
            index.reverse();
            index
        };
        let (own_lead, own_row) = self.own.split_at(self.own.len() - self.row_axes);
        let rows = sizes(&self.lead, row);
        let skipped = rows.len().saturating_sub(own_lead.len());
        let own_rows = own_lead.iter().zip(&rows[skipped..]).map(|(n, at)| if *n == 1 { 0 } else { *at });
        let index: Vec<usize> = own_rows.chain(sizes(own_row, column)).collect();
        match index.as_slice() {
            [] => self.name.to_owned(),
            index => format!("{}{index:?}", self.name),
        }
    }
}

impl<const K: usize> Rows<f64, K> {
    /// Checks the range of all values, only in the rows marked in `used` if it is given.
    pub(crate) fn within(self, allowed: Allowed, used: Option<&Rows<bool, 1>>) -> PyResult<Self> {
        let is_used = |row: usize| used.is_none_or(|used| used.at(row)[0]);
        let rows = self.rows().len();
        let is_wrong = |row: &[f64; K]| !row.iter().all(|value| allowed.contains(*value));
        // A single row that applies to all rows is used if any row is used.
        let (count, one) = (self.lead.iter().product::<usize>(), rows == 1);
        let wrong = if one && self.rows().first().is_some_and(is_wrong) {
            (0..count).find(|row| is_used(*row))
        } else {
            self.rows().iter().enumerate().position(|(index, row)| is_wrong(row) && is_used(index))
        };
        let Some(row) = wrong else { return Ok(self) };
        let values = self.at(row);
        let column = values.iter().position(|value| !allowed.contains(*value)).unwrap_or(0);
        let (place, value) = (self.place(row, column), values[column]);
        Err(InputError::new_err(format!("{place} = {value}: must be {allowed}")))
    }
}

impl Rows<f64, 2> {
    #[inline]
    pub(crate) fn position(&self, index: usize) -> Position {
        let [x_m, y_m] = self.at(index);
        Position::from_m(x_m, y_m)
    }

    #[inline]
    pub(crate) fn velocity(&self, index: usize) -> Velocity {
        let [x_m_s, y_m_s] = self.at(index);
        Velocity::from_m_s(x_m_s, y_m_s)
    }
}

impl<T: Kind> Rows<T, 1> {
    #[inline]
    pub(crate) fn one(&self, index: usize) -> T {
        let [value] = self.at(index);
        value
    }
}

/// Broadcasts the leading axes of all arguments by NumPy's rules: starting from the last axis, lengths must be equal or
/// 1.
pub(crate) fn common(all: &[(&'static str, &[usize])]) -> PyResult<Vec<usize>> {
    let mut lead: Vec<usize> = Vec::new();
    let mut first = "";
    for (name, axes) in all {
        let added = axes.len().saturating_sub(lead.len());
        let mut together = lead.clone();
        together.splice(0..0, axes[..added].iter().copied());
        let skipped = together.len() - axes.len();
        for (length, own) in together[skipped..].iter_mut().zip(*axes) {
            match (*length, *own) {
                (length, own) if length == own || own == 1 => {}
                (1, own) => *length = own,
                _ => {
                    return Err(InputError::new_err(format!(
                        "{name} has the leading axes {}, but the arguments before it (from {first} on) have {}: from the \
                         last axis on, lengths must be equal, or 1",
                        shape(axes),
                        shape(&lead)
                    )));
                }
            }
        }
        lead = together;
        first = if first.is_empty() { name } else { first };
    }
    let rows = lead.iter().try_fold(1usize, |product, length| product.checked_mul(*length));
    if rows.is_none_or(|rows| rows > ROWS_MAX) {
        let lead = shape(&lead);
        let what = format!("{lead} has too many rows: at most {ROWS_MAX} per call; split the arrays");
        return Err(InputError::new_err(what));
    }
    Ok(lead)
}

/// Computes the results row by row without the GIL and checks for Ctrl-C every `rows_per_check` rows.
pub(crate) fn each<T: Send>(
    py: Python<'_>,
    rows: usize,
    rows_per_check: usize,
    mut row: impl FnMut(usize) -> T + Send,
) -> PyResult<Vec<T>> {
    let mut results = Vec::with_capacity(rows);
    while results.len() < rows {
        py.check_signals()?;
        let next = results.len()..rows.min(results.len() + rows_per_check.max(1));
        py.detach(|| results.extend(next.map(&mut row)));
    }
    Ok(results)
}

/// Number of rows between two checks for Ctrl-C, if a row takes little time.
pub(crate) const PATIENCE: usize = 100_000;

/// A result array.
#[derive(Debug)]
pub(crate) struct Made<T>(Py<PyArrayDyn<T>>);

impl<T: Kind> Made<T> {
    /// Makes an array of shape `lead` followed by `row`.
    pub(crate) fn of(py: Python<'_>, lead: &[usize], row: &[usize], values: Vec<T>) -> PyResult<Self> {
        let array = ArrayD::from_shape_vec(IxDyn(&[lead, row].concat()), values).map_err(bug)?;
        Ok(Self(array.into_pyarray(py).unbind()))
    }
}

impl<'py, T: Kind> IntoPyObject<'py> for Made<T> {
    type Target = PyArrayDyn<T>;
    type Output = Bound<'py, PyArrayDyn<T>>;
    type Error = Infallible;

    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: PyStaticExpr = <T as Kind>::OUTPUT_TYPE;

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(self.0.into_bound(py))
    }
}

impl<'py, T: Kind> IntoPyObject<'py> for &Made<T> {
    type Target = PyArrayDyn<T>;
    type Output = Bound<'py, PyArrayDyn<T>>;
    type Error = Infallible;

    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: PyStaticExpr = <T as Kind>::OUTPUT_TYPE;

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(self.0.bind(py).clone())
    }
}

/// Converts an argument to its shape and its elements in row-major order.
fn elements<T: Kind>(given: &Given<'_>, name: &str) -> PyResult<(Vec<usize>, Vec<T>)> {
    let given = &given.0;
    let py = given.py();
    let is_plain = given.cast_exact::<PyUntypedArray>().is_ok();
    if !is_plain && given.cast::<PyUntypedArray>().is_ok() && given.hasattr("mask")? {
        let what = format!("{name} is a masked array: pass its data, and its mask as mask= if there is one");
        return Err(InputError::new_err(what));
    }
    if is_plain && let Ok(array) = given.cast::<PyArrayDyn<T>>() {
        return copied(array);
    }
    let as_array = py.import("numpy")?.getattr("asarray")?.call1((given,)).map_err(|error| {
        let is_about_values = error.is_instance_of::<PyValueError>(py) || error.is_instance_of::<PyTypeError>(py);
        let what = || format!("{name} is not an array of {}: {}", T::EXPECTED, error.value(py));
        if is_about_values { InputError::new_err(what()) } else { error }
    })?;
    let dtype = as_array.getattr("dtype")?;
    let letter: String = dtype.getattr("kind")?.extract()?;
    let is_empty = as_array.getattr("size")?.extract::<usize>()? == 0;
    // The type of an empty list is not known.
    let is_of_kind = T::LETTERS.contains(&letter) || is_empty && "fiub".contains(&letter);
    if !is_of_kind {
        return Err(InputError::new_err(format!("{name} is of type {dtype}: expected {}", T::EXPECTED)));
    }
    let array = as_array.call_method1("astype", (T::NAME,))?;
    copied(array.cast::<PyArrayDyn<T>>()?)
}

fn copied<T: Kind>(array: &Bound<'_, PyArrayDyn<T>>) -> PyResult<(Vec<usize>, Vec<T>)> {
    let array = array.try_readonly().map_err(|error| StandoffError::new_err(error.to_string()))?;
    let view = array.as_array();
    let values = view.as_slice().map_or_else(|| view.iter().copied().collect(), <[T]>::to_vec);
    Ok((view.shape().to_vec(), values))
}

/// Formats a shape like Python does.
pub(crate) fn shape(of: &[usize]) -> String {
    match of {
        [one] => format!("({one},)"),
        axes => format!("({})", axes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// An error that only a bug can cause.
fn bug(error: impl ToString) -> PyErr {
    StandoffError::new_err(error.to_string())
}
