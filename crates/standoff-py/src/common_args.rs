//! Argument types that several functions share, with their range checks and warnings.

use std::convert::Infallible;
use std::ffi::CString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyUserWarning};
#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::PyDict;
#[cfg(feature = "stubs")]
use pyo3::{type_hint_identifier, type_hint_subscript, type_hint_union};
use standoff_app::Maps;
use standoff_score::MetricSelection;
use standoff_sim::scenario::Scenario;

use crate::exceptions::InputError;

/// Requested metrics.
pub(crate) enum MetricsArg {
    /// Names, separated by commas.
    Text(String),
    Names(Vec<String>),
}

impl FromPyObject<'_, '_> for MetricsArg {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr = type_hint_union!(STR, type_hint_subscript!(SEQUENCE, STR));

    fn extract(given: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        let text = given.extract().map(Self::Text);
        let several = |_| given.extract().map(Self::Names);
        text.or_else(several).map_err(|_: PyErr| wrong_type("names, as a str or a list of str", &given))
    }
}

impl Default for MetricsArg {
    fn default() -> Self {
        Self::Text("standard".to_owned())
    }
}

impl MetricsArg {
    pub(crate) fn selection(&self) -> PyResult<MetricSelection> {
        let selection = match self {
            Self::Text(text) => MetricSelection::parse(text),
            Self::Names(names) => MetricSelection::parse(&names.join(",")),
        };
        selection.map_err(|what| InputError::new_err(format!("metrics: {what}")))
    }
}

/// Background maps: one file, or several.
pub(crate) struct MapArg(Vec<PathBuf>);

impl FromPyObject<'_, '_> for MapArg {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr =
        type_hint_union!(STR, PATH, type_hint_subscript!(SEQUENCE, type_hint_union!(STR, PATH)));

    fn extract(given: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        let one = given.extract::<PathBuf>().map(|path| Self(vec![path]));
        let several = |_| given.extract().map(Self);
        one.or_else(several).map_err(|_: PyErr| wrong_type("a path, or a list of paths", &given))
    }
}

impl MapArg {
    /// Returns the maps that replace those of the scenario or of the record.
    pub(crate) fn maps(map: Option<Self>) -> Maps {
        Maps(map.map_or_else(Vec::new, |Self(paths)| paths))
    }
}

/// Traffic: a file, or a data frame as CSV.
pub(crate) enum TrafficArg {
    File(PathBuf),
    Csv(Arc<[u8]>),
}

impl FromPyObject<'_, '_> for TrafficArg {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr =
        type_hint_union!(STR, PATH, type_hint_identifier!("standoff._frames", "DataFrame"));

    fn extract(given: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        if let Ok(path) = given.extract() {
            return Ok(Self::File(path));
        }
        let csv = given.py().import("standoff._frames")?.call_method1("csv", (&*given,))?;
        let csv: Option<String> = csv.extract()?;
        let csv = csv.map(|csv| Self::Csv(csv.into_bytes().into()));
        csv.ok_or_else(|| wrong_type("a path, or a data frame of pandas, polars or pyarrow", &given))
    }
}

/// A Python integer of any size; values outside the range of `i128` are clamped.
#[derive(Clone, Copy)]
pub(crate) struct Whole(pub(crate) i128);

impl FromPyObject<'_, '_> for Whole {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("typing", "SupportsIndex");

    fn extract(given: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        given.extract().map(Self).or_else(|error: PyErr| {
            // Such values are out of every allowed range, so the exact value does not matter.
            let is_large = error.is_instance_of::<PyOverflowError>(given.py());
            if is_large { Ok(Self(if given.lt(0)? { i128::MIN } else { i128::MAX })) } else { Err(error) }
        })
    }
}

/// Highest number that a record or a batch can store.
const NUMBER_MAX: u64 = i64::MAX as u64;

/// Checks that a number is at least `least` and fits into a record.
pub(crate) fn count(name: &str, number: Whole, least: u64) -> PyResult<u64> {
    within(name, number, least, NUMBER_MAX)
}

/// Checks that a number is between `least` and `most`.
pub(crate) fn within(name: &str, Whole(number): Whole, least: u64, most: u64) -> PyResult<u64> {
    let counted = u64::try_from(number).ok().filter(|number| (least..=most).contains(number));
    counted.ok_or_else(|| {
        let what = if number > i128::from(least) { format!("at most {most}") } else { format!("at least {least}") };
        InputError::new_err(format!("{name} = {number}: must be {what}"))
    })
}

/// Checks a count or an id of UAVs or groups, if there is one.
pub(crate) fn small(name: &str, number: Option<Whole>) -> PyResult<Option<u32>> {
    let small = number.map(|number| within(name, number, 0, i32::MAX as u64)).transpose()?;
    Ok(small.and_then(|number| u32::try_from(number).ok()))
}

/// Checks a number of threads; `None` means one per core.
pub(crate) fn number_of_threads(threads: Option<Whole>) -> PyResult<Option<NonZeroUsize>> {
    let counted = threads.map(|threads| count("threads", threads, 1)).transpose()?;
    Ok(counted.and_then(|threads| NonZeroUsize::new(usize::try_from(threads).unwrap_or(usize::MAX))))
}

/// Issues the non-fatal warnings about a scenario as Python warnings.
pub(crate) fn warn(py: Python<'_>, scenario: &Scenario) -> PyResult<()> {
    scenario.warnings.iter().try_for_each(|what| warning(py, what))
}

/// Issues a `UserWarning`.
pub(crate) fn warning(py: Python<'_>, what: &str) -> PyResult<()> {
    let what = CString::new(what.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &what, 1)
}

/// Name of an object's type, for messages.
pub(crate) fn type_name(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "this type".to_owned(), |name| name.to_string())
}

/// The exception for an argument of a wrong type; PyO3 adds the name of the argument.
fn wrong_type(expected: &str, given: &Bound<'_, PyAny>) -> PyErr {
    PyTypeError::new_err(format!("must be {expected}, not {}", type_name(given)))
}

/// A dict with str keys.
pub(crate) struct Dict<'py>(pub(crate) Bound<'py, PyDict>);

impl<'py> Dict<'py> {
    /// Returns the value of a key.
    pub(crate) fn get(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.0.as_any().get_item(name)
    }

    /// Returns the value of a key, which must be a dict.
    pub(crate) fn dict(&self, name: &str) -> PyResult<Self> {
        Ok(Self(self.get(name)?.cast_into()?))
    }
}

impl<'py> FromPyObject<'_, 'py> for Dict<'py> {
    type Error = PyErr;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr = DICT;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let dict = given.cast::<PyDict>().map_err(|_| wrong_type("a dict with str keys", &given))?;
        Ok(Self(dict.to_owned()))
    }
}

impl<'py> IntoPyObject<'py> for Dict<'py> {
    type Target = PyDict;
    type Output = Bound<'py, PyDict>;
    type Error = Infallible;

    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: PyStaticExpr = DICT;

    fn into_pyobject(self, _: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(self.0)
    }
}

#[cfg(feature = "stubs")]
const STR: PyStaticExpr = type_hint_identifier!("builtins", "str");

#[cfg(feature = "stubs")]
const SEQUENCE: PyStaticExpr = type_hint_identifier!("collections.abc", "Sequence");

#[cfg(feature = "stubs")]
const PATH: PyStaticExpr = type_hint_subscript!(type_hint_identifier!("os", "PathLike"), STR);

#[cfg(feature = "stubs")]
const DICT: PyStaticExpr = type_hint_subscript!(
    type_hint_identifier!("builtins", "dict"),
    type_hint_identifier!("builtins", "str"),
    type_hint_identifier!("typing", "Any")
);

/// Parses a JSON object into a Python dict.
pub(crate) fn json<'py>(py: Python<'py>, text: &str) -> PyResult<Dict<'py>> {
    Ok(Dict(py.import("json")?.call_method1("loads", (text,))?.cast_into()?))
}
