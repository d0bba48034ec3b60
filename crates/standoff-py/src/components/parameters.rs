//! Named parameters of the components.

use pyo3::exceptions::{PyAttributeError, PyTypeError};
#[cfg(feature = "stubs")]
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::PyDict;
#[cfg(feature = "stubs")]
use pyo3::{PyTypeInfo, type_hint_union};
use standoff::params::ParamKind;
use standoff::{LinkModel, ParamInfo, ParamValue, TeamParams};

use crate::common_args::{Whole, count};
use crate::exceptions::InputError;
use crate::scenario;

/// Source of default values before any check.
pub(crate) struct Source<'py>(Bound<'py, PyAny>);

impl<'py> FromPyObject<'_, 'py> for Source<'py> {
    type Error = std::convert::Infallible;

    #[cfg(feature = "stubs")]
    const INPUT_TYPE: PyStaticExpr =
        type_hint_union!(Parameters::TYPE_HINT, scenario::Scenario::TYPE_HINT, std::path::PathBuf::INPUT_TYPE);

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> Result<Self, Self::Error> {
        Ok(Self(given.to_owned()))
    }
}

/// Parameters of filter, sensor, orbits, guidance and assignment. They are immutable and checked when they are created.
///
/// ``Parameters()`` gives the recommended values, which are also the defaults of scenario files.
/// ``Parameters("improved/figure-9")`` gives the parameters of a scenario, :meth:`paper` those of the paper, and
/// ``Parameters(other, radial_gain=1.0)`` a copy with one change. Each parameter is an attribute. The names are those of
/// the keys in scenario files, without their table; but angles are in radians, as in ``field_of_view_rad``. The page on
/// scenario files and :meth:`to_dict` list them. Functions name the parameters that they use.
///
/// :param of: source of the parameters that are not given: other parameters, a :class:`standoff.Scenario`, the name of
///     a built-in scenario or the path of a scenario file; by default the recommended values.
/// :param seed: seed for a scenario with random parameters; 1 by default.
/// :param changes: parameters by name: numbers, words or truth values. ``law`` changes only the guidance, not the other
///     parameters; :meth:`paper` gives all of the law ``"oh-2015"``.
/// :raises InputError: if a value is out of range; the message gives the range.
/// :raises ScenarioError: if the scenario is invalid.
#[pyclass(frozen, eq, module = "standoff.components")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameters(TeamParams);

/// The parameters with a name in Python. Two of them have the same name and value: the field of view of sensor and
/// orbits.
fn named() -> impl Iterator<Item = &'static ParamInfo> {
    let Parameters(team) = Parameters::of_team(TeamParams::recommended());
    TeamParams::table().iter().filter(move |param| param.value(&team).is_some())
}

impl Parameters {
    /// The library's parameters for `given`, or the recommended ones.
    pub(super) fn or_recommended(given: Option<&Bound<'_, Self>>) -> TeamParams {
        given.map_or_else(TeamParams::recommended, |given| given.get().0)
    }

    /// Parameters of a team, without those that have no name in Python.
    fn of_team(team: TeamParams) -> Self {
        let mut team = TeamParams { link: LinkModel::Ideal, separation: None, ..team };
        (team.uav.climb, team.uav.bank, team.wind) = (None, None, None);
        Self(team)
    }

    /// Changes a parameter.
    fn set(&mut self, name: &str, given: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut found = named().filter(|param| param.name() == name).peekable();
        if found.peek().is_none() {
            return Err(PyTypeError::new_err(format!("Parameters() got an unexpected keyword argument '{name}'")));
        }
        let of_type = |error: PyErr| PyTypeError::new_err(format!("{name}: {}", error.value(given.py())));
        for param in found {
            let value = match param.kind {
                ParamKind::Number { .. } => ParamValue::Number(given.extract().map_err(of_type)?),
                ParamKind::Flag => ParamValue::Flag(given.extract().map_err(of_type)?),
                ParamKind::Word(words) => {
                    let typed = given.extract::<&str>().ok();
                    let word = words.iter().find(|word| Some(word.word) == typed).ok_or_else(|| {
                        let words: Vec<String> = words.iter().map(|word| format!("{:?}", word.word)).collect();
                        let typed = given.repr().map_or_else(|_| "this value".to_owned(), |typed| typed.to_string());
                        InputError::new_err(format!("{name} = {typed}: must be one of {}", words.join(", ")))
                    })?;
                    ParamValue::Word(word.word)
                }
            };
            param.set(&mut self.0, value);
        }
        Ok(())
    }

    /// Checks the values with the library's ranges. Ignores limits that no component uses, unless they are given.
    fn check(&self, is_given: impl Fn(&str) -> bool) -> PyResult<()> {
        let mut own: Vec<String> = Vec::new();
        for error in self.0.errors() {
            let name = error.path.rsplit('.').next().unwrap_or_default();
            let is_used = !matches!(name, "speed_change_max_m_s" | "sensing_range_m") || is_given(name);
            let message = format!("{name} = {}: must be {}", error.value, error.allowed);
            if is_used && !own.contains(&message) {
                own.push(message);
            }
        }
        if own.is_empty() { Ok(()) } else { Err(InputError::new_err(own.join("; "))) }
    }

    /// Adds the parameters for which `is_listed` to a dict.
    fn listed<'py>(&self, py: Python<'py>, is_listed: impl Fn(&ParamInfo) -> bool) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for param in named().filter(|param| is_listed(param)) {
            dict.set_item(param.name(), self.value(py, param)?)?;
        }
        Ok(dict)
    }

    fn value<'py>(&self, py: Python<'py>, param: &ParamInfo) -> PyResult<Bound<'py, PyAny>> {
        Ok(match param.value(&self.0) {
            Some(ParamValue::Number(number)) => number.into_pyobject(py)?.into_any(),
            Some(ParamValue::Word(word)) => word.into_pyobject(py)?.into_any(),
            Some(ParamValue::Flag(flag)) => flag.into_pyobject(py)?.to_owned().into_any(),
            None => py.None().into_bound(py),
        })
    }
}

#[pymethods]
impl Parameters {
    #[new]
    #[pyo3(signature = (of=None, *, seed=Whole(1), **changes: "float | str | bool | None"))]
    fn new(of: Option<Source<'_>>, seed: Whole, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut parameters = match of {
            None => Self::of_team(TeamParams::recommended()),
            Some(Source(of)) => match of.cast::<Self>() {
                Ok(parameters) => parameters.get().clone(),
                Err(_) => {
                    let scenario = scenario::scenario_of(&of)?;
                    let seed = count("seed", seed, 0)?;
                    Self::of_team(of.py().detach(|| scenario.drawn(seed))?.settings.team)
                }
            },
        };
        let mut given = Vec::new();
        for (name, value) in changes.into_iter().flatten().filter(|(_, value)| !value.is_none()) {
            let name: String = name.extract()?;
            parameters.set(&name, &value)?;
            given.push(name);
        }
        let is_given = |name: &str| given.iter().any(|given| given == name);
        parameters.check(is_given)?;
        Ok(parameters)
    }

    /// Returns the parameters of the paper's Table I.
    #[staticmethod]
    fn paper() -> Self {
        Self::of_team(TeamParams::paper())
    }

    /// All parameters as a dict.
    #[pyo3(signature = () -> "dict[str, float | str | bool]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.listed(py, |_| true)
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let param = named().find(|param| param.name() == name);
        let param =
            param.ok_or_else(|| PyAttributeError::new_err(format!("'Parameters' object has no attribute '{name}'")))?;
        self.value(py, param)
    }

    #[pyo3(signature = () -> "list[str]")]
    fn __dir__(slf: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        let names = named().map(|param| param.name().to_owned());
        Ok(slf.get_type().dir()?.extract::<Vec<String>>()?.into_iter().chain(names).collect())
    }

    /// Shows the parameters that differ from the recommended ones.
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let recommended = TeamParams::recommended();
        let changed = self.listed(py, |param| param.value(&self.0) != param.value(&recommended))?;
        let named = changed.into_iter().map(|(name, value)| Ok(format!("{name}={}", value.repr()?)));
        Ok(format!("Parameters({})", named.collect::<PyResult<Vec<_>>>()?.join(", ")))
    }

    #[pyo3(signature = () -> "tuple[tuple[()], dict[str, float | str | bool]]")]
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        Ok(((), self.to_dict(py)?))
    }
}
