//! Scenarios as Python objects, before random values are drawn.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{env, fs};

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyInt, PyList, PyString, PyTuple};
use standoff_io::bounded_input;
use standoff_sim::scenario::{BUILT_IN, Overrides, ScenarioError as SimScenarioError, ScenarioTemplate};
use toml::{Table, Value};

use crate::common_args::{Dict, TrafficArg, Whole, count, small, type_name};
use crate::exceptions::{ScenarioError, of_scenario};

/// A scenario: a built-in one, a scenario file, or TOML text, with changes.
///
/// Random values are not drawn yet, so one object serves all seeds. Values out of range are reported when the scenario
/// is run or :meth:`resolved` with a seed. docs/user/scenarios.md lists the keys.
///
/// :param scenario: name of a built-in scenario, or path of a scenario file (str or os.PathLike).
/// :param traffic: traffic with the targets: a file (SUMO floating-car data, CSV tracks or GPX, plain or .gz), or a data
///     frame of pandas, polars or pyarrow with the columns of CSV tracks (docs/user/your-own-traffic.md).
/// :param uavs: number of UAVs, started on an orbit about the first targets.
/// :param set: values to change, by dotted key: ``{"guidance.lead_s": 1.5}``; nested dicts are tables.
/// :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
#[pyclass(frozen, module = "standoff")]
#[derive(Clone)]
pub(crate) struct Scenario {
    source: Source,
    overrides: Overrides,
    /// Traffic of a data frame, as the file [`FRAME`].
    csv: Option<Arc<[u8]>>,
    template: ScenarioTemplate,
}

/// Name of the traffic of a data frame, which the run has, too.
const FRAME: &str = "traffic.csv";

/// Origin of a scenario: a name or path, or TOML text with the folder for its relative paths.
#[derive(Clone, PartialEq, Eq)]
enum Source {
    Named(String),
    Toml { name: String, toml: String, folder: PathBuf },
}

impl Source {
    fn load(&self, overrides: &Overrides) -> Result<ScenarioTemplate, SimScenarioError> {
        match self {
            Self::Named(name) => ScenarioTemplate::load(name, overrides),
            Self::Toml { name, toml, folder } => ScenarioTemplate::of_toml(name, toml, overrides, folder),
        }
    }
}

impl Scenario {
    fn load(source: Source, overrides: Overrides, csv: Option<Arc<[u8]>>) -> PyResult<Self> {
        let template = with_frame(csv.as_ref(), || source.load(&overrides))?;
        Ok(Self { source, overrides, csv, template })
    }

    /// Returns the scenario with further changes, each `KEY=VALUE`.
    pub(crate) fn with(&self, set: &[String]) -> PyResult<Self> {
        let template = with_frame(self.csv.as_ref(), || self.template.changed(set))?;
        let mut overrides = self.overrides.clone();
        overrides.set.extend_from_slice(set);
        Ok(Self { source: self.source.clone(), overrides, csv: self.csv.clone(), template })
    }

    pub(crate) fn template(&self) -> &ScenarioTemplate {
        &self.template
    }

    /// Changes made to `other`, if this scenario is `other` with further changes; otherwise none.
    pub(crate) fn changes_of(&self, other: &Self) -> &[String] {
        let is_of_it = self.source == other.source;
        is_of_it.then(|| self.overrides.set.strip_prefix(other.overrides.set.as_slice())).flatten().unwrap_or_default()
    }

    /// Draws the scenario with a seed.
    pub(crate) fn drawn(&self, seed: u64) -> PyResult<standoff_sim::scenario::Scenario> {
        self.template.draw(seed).map_err(of_scenario)
    }
}

/// Loads a scenario whose traffic may be that of a data frame. Errors in it name the row instead of the line.
fn with_frame<T>(csv: Option<&Arc<[u8]>>, load: impl FnOnce() -> Result<T, SimScenarioError>) -> PyResult<T> {
    let Some(csv) = csv else { return load().map_err(of_scenario) };
    bounded_input::with_given(Path::new(FRAME), Arc::clone(csv), load).map_err(|mut error| {
        for problem in error.problems.iter_mut().filter(|problem| problem.file == FRAME) {
            // The header is line 1, and rows count from 0.
            let row = problem.place.take().and_then(|place| place.line.checked_sub(2));
            problem.file = row.map_or_else(|| "traffic".to_owned(), |row| format!("traffic, row {row}"));
        }
        of_scenario(error)
    })
}

/// Default scenarios, without and with a traffic file.
const DEFAULT_SCENARIO: &str = "improved/figure-9";
const DEFAULT_FOR_TRAFFIC: &str = "traffic/convoy";

/// Converts a scenario argument: a `Scenario`, a built-in name or a path.
pub(crate) fn scenario_of(scenario: &Bound<'_, PyAny>) -> PyResult<Scenario> {
    scenario_with(Some(scenario), None, None, None)
}

/// Converts a scenario argument and applies changes. Without a scenario, uses the default of the command line.
pub(crate) fn scenario_with(
    scenario: Option<&Bound<'_, PyAny>>,
    traffic: Option<TrafficArg>,
    uavs: Option<u32>,
    set: Option<&Dict<'_>>,
) -> PyResult<Scenario> {
    let default = if traffic.is_some() { DEFAULT_FOR_TRAFFIC } else { DEFAULT_SCENARIO };
    let (source, overrides, csv) = match scenario {
        None => (Source::Named(default.to_owned()), Overrides::default(), None),
        Some(scenario) => match scenario.cast::<Scenario>() {
            Ok(scenario) if traffic.is_none() && uavs.is_none() && set.is_none() => return Ok(scenario.get().clone()),
            Ok(scenario) => {
                let Scenario { source, overrides, csv, .. } = scenario.get().clone();
                (source, overrides, csv)
            }
            Err(_) => (Source::Named(path(scenario)?), Overrides::default(), None),
        },
    };
    let (overrides, csv) = changed(overrides, csv, traffic, uavs, set)?;
    Scenario::load(source, overrides, csv)
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (scenario, *, traffic=None, uavs=None, set=None))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        traffic: Option<TrafficArg>,
        uavs: Option<Whole>,
        set: Option<Dict<'_>>,
    ) -> PyResult<Self> {
        scenario_with(Some(scenario), traffic, small("uavs", uavs)?, set.as_ref())
    }

    /// Makes a scenario from TOML text.
    ///
    /// :param toml: text in the format of a scenario file.
    /// :param name: name of the scenario.
    /// :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
    #[staticmethod]
    #[pyo3(signature = (toml, *, name="scenario"))]
    fn from_toml(toml: &str, name: &str) -> PyResult<Self> {
        let folder = env::current_dir().unwrap_or_default();
        let source = Source::Toml { name: name.to_owned(), toml: toml.to_owned(), folder };
        Self::load(source, Overrides::default(), None)
    }

    /// Makes a scenario from nested dicts, as returned by :meth:`to_dict` or by ``tomllib`` for a scenario file.
    ///
    /// :param scenario: tables as dicts, arrays as lists.
    /// :param name: name of the scenario.
    /// :raises ScenarioError: if the scenario is invalid; the message shows the line as TOML and marks the position.
    #[staticmethod]
    #[pyo3(signature = (scenario, *, name="scenario"))]
    fn from_dict(scenario: Dict<'_>, name: &str) -> PyResult<Self> {
        Self::from_toml(&table(&scenario.0)?.to_string(), name)
    }

    /// Returns a copy with further changes; parameters as for the class.
    #[pyo3(signature = (*, traffic=None, uavs=None, set=None))]
    fn changed(&self, traffic: Option<TrafficArg>, uavs: Option<Whole>, set: Option<Dict<'_>>) -> PyResult<Self> {
        let Self { source, overrides, csv, .. } = self.clone();
        let (overrides, csv) = changed(overrides, csv, traffic, small("uavs", uavs)?, set.as_ref())?;
        Self::load(source, overrides, csv)
    }

    /// Name of the scenario.
    #[getter]
    fn name(&self) -> &str {
        self.template.name()
    }

    /// Traffic files of the scenario; empty if it uses none, a built-in one or a data frame.
    #[getter]
    fn traffic_files(&self) -> Vec<PathBuf> {
        if self.csv.is_some() { Vec::new() } else { self.template.traffic_files() }
    }

    /// Returns the traffic files; writes that of a data frame to a folder first.
    fn _saved_traffic(&self, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        let Some(csv) = &self.csv else { return Ok(self.traffic_files()) };
        let file = folder.join(FRAME);
        fs::write(&file, csv)?;
        Ok(vec![file])
    }

    /// The scenario as TOML with its changes and all defaults, before random values are drawn.
    #[getter]
    fn toml(&self) -> PyResult<String> {
        self.template.text().map_err(of_scenario)
    }

    /// Returns :attr:`toml` as nested dicts.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        Ok(Dict(py.import("tomllib")?.call_method1("loads", (self.toml()?,))?.cast_into()?))
    }

    /// Returns the scenario as TOML with all random values drawn and all defaults. Running it gives the same results.
    ///
    /// :param seed: seed of all random values, 0 to 2**63 - 1.
    /// :raises ScenarioError: if a value is out of range.
    fn resolved(&self, seed: Whole) -> PyResult<String> {
        self.drawn(count("seed", seed, 0)?)?.resolved().map_err(of_scenario)
    }

    fn __repr__(&self) -> String {
        let changes = self.overrides.set.iter().map(|edit| format!(", {edit}")).collect::<String>();
        format!("Scenario({:?}{changes})", self.template.name())
    }

    #[pyo3(signature = () -> "tuple[object, tuple[object, ...]]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let Overrides { set, traffic, uavs, .. } = self.overrides.clone();
        let (name, toml, folder) = match self.source.clone() {
            Source::Named(name) => (name, None, None),
            Source::Toml { name, toml, folder } => (name, Some(toml), Some(folder)),
        };
        let restored = py.import("standoff._standoff")?.getattr("Scenario")?.getattr("_restored")?;
        let csv = self.csv.as_deref();
        Ok((restored, (name, toml, folder, set, traffic, uavs, csv).into_pyobject(py)?))
    }

    /// Restores a pickled scenario.
    #[staticmethod]
    fn _restored(
        name: String,
        toml: Option<String>,
        folder: Option<PathBuf>,
        set: Vec<String>,
        traffic: Vec<PathBuf>,
        uavs: Option<u32>,
        csv: Option<&[u8]>,
    ) -> PyResult<Self> {
        let source = match toml {
            Some(toml) => Source::Toml { name, toml, folder: folder.unwrap_or_default() },
            None => Source::Named(name),
        };
        Self::load(source, Overrides { set, traffic, uavs, ..Overrides::default() }, csv.map(Arc::from))
    }
}

/// Returns the names of the built-in scenarios, in a suggested reading order.
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|one| one.name).collect()
}

fn path(scenario: &Bound<'_, PyAny>) -> PyResult<String> {
    let path: PathBuf = scenario.extract().map_err(|_| {
        let must = "scenario: must be a built-in name, a path or a Scenario";
        let advice =
            if scenario.is_instance_of::<PyDict>() { ": Scenario.from_dict makes a Scenario of a dict" } else { "" };
        ScenarioError::new_err(format!("{must}, not {}{advice}", type_name(scenario)))
    })?;
    path.into_os_string().into_string().map_err(|path| {
        ScenarioError::new_err(format!("{}: not UTF-8: rename it, or change to its folder", path.to_string_lossy()))
    })
}

fn changed(
    mut overrides: Overrides,
    mut csv: Option<Arc<[u8]>>,
    traffic: Option<TrafficArg>,
    uavs: Option<u32>,
    set: Option<&Dict<'_>>,
) -> PyResult<(Overrides, Option<Arc<[u8]>>)> {
    if let Some(traffic) = traffic {
        let (file, of_frame) = match traffic {
            TrafficArg::File(file) => (file, None),
            TrafficArg::Csv(csv) => (FRAME.into(), Some(csv)),
        };
        (overrides.traffic, csv) = (vec![file], of_frame);
    }
    overrides.uavs = uavs.or(overrides.uavs);
    for (key, value) in set.into_iter().flat_map(|set| set.0.iter()) {
        let key: String = key.extract().map_err(|_| ScenarioError::new_err("set: keys must be str"))?;
        let value = self::value(&value).map_err(|what| ScenarioError::new_err(format!("set: {key}: {what}")))?;
        overrides.set.push(format!("{key}={value}"));
    }
    Ok((overrides, csv))
}

/// Converts a dict to a TOML table.
fn table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    match value(dict.as_any()) {
        Ok(Value::Table(table)) => Ok(table),
        Ok(_) => Err(ScenarioError::new_err("a scenario must be a dict")),
        Err(what) => Err(ScenarioError::new_err(what)),
    }
}

/// Maximum nesting depth of dicts and lists; scenarios need three levels.
const DEPTH_MAX: usize = 8;

pub(crate) fn value(of: &Bound<'_, PyAny>) -> Result<Value, String> {
    value_within(of, DEPTH_MAX)
}

/// Converts a Python or NumPy value to TOML.
fn value_within(of: &Bound<'_, PyAny>, depth: usize) -> Result<Value, String> {
    let depth = depth.checked_sub(1).ok_or("nested too deeply for a scenario")?;
    if let Ok(dict) = of.cast::<PyDict>() {
        let entries = dict.iter().map(|(key, value)| {
            let key: String = key.extract().map_err(|_| "keys must be str".to_owned())?;
            let value = value_within(&value, depth).map_err(|what| format!("{key}: {what}"))?;
            Ok((key, value))
        });
        return entries.collect::<Result<Table, String>>().map(Value::Table);
    }
    if of.is_instance_of::<PyList>() || of.is_instance_of::<PyTuple>() {
        let items = of.try_iter().map_err(|error| error.to_string())?;
        let items = items.map(|item| value_within(&item.map_err(|error| error.to_string())?, depth));
        return items.collect::<Result<Vec<_>, _>>().map(Value::Array);
    }
    if of.is_instance_of::<PyBool>() {
        return of.extract().map(Value::Boolean).map_err(|error| error.to_string());
    }
    if of.is_instance_of::<PyString>() {
        return of.extract().map(Value::String).map_err(|error| error.to_string());
    }
    // NumPy scalars are converted to Python scalars first.
    if let Ok(true) = of.getattr("ndim").and_then(|ndim| ndim.eq(0)) {
        let own = of.call_method0("item").map_err(|error| error.to_string())?;
        return value_within(&own, depth);
    }
    if of.is_instance_of::<PyInt>() {
        return of.extract().map(Value::Integer).map_err(|_| "an integer must fit into 64 bits".to_owned());
    }
    if of.hasattr("tolist").unwrap_or(false) {
        let own = of.call_method0("tolist").map_err(|error| error.to_string())?;
        return value_within(&own, depth);
    }
    of.extract()
        .map(Value::Float)
        .map_err(|_| format!("a value must be a number, str, list or dict, not {}", type_name(of)))
}
