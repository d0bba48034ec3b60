//! Scenarios as objects: what is flown, before anything is drawn.

use std::env;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyInt, PyList, PyString, PyTuple};
use standoff_sim::scenario::{BUILT_IN, Edits, Template};
use toml::{Table, Value};

use crate::asked_for::{Dict, Whole, count, small};
use crate::failure::{ScenarioError, of_scenario};

/// What is flown: a built-in scenario, a scenario file, or TOML; with changes.
///
/// Before anything is drawn: one scenario for every seed. What is out of range is told when a seed is drawn, flown or
/// :meth:`resolved`. docs/scenarios.md lists the keys.
///
/// :param scenario: a built-in scenario's name, or the path of a scenario file (str or os.PathLike).
/// :param traffic: fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
/// :param uavs: number of UAVs, started on an orbit about the first targets.
/// :param set: values to change, by dotted key: ``{"guidance.lead_s": 1.5}``; nested dicts are tables.
/// :raises ScenarioError: what is wrong, drawn under what was typed.
#[pyclass(frozen, module = "standoff")]
#[derive(Clone)]
pub(crate) struct Scenario {
    source: Source,
    edits: Edits,
    template: Template,
}

/// What was typed, and where.
#[derive(Clone, PartialEq, Eq)]
enum Source {
    Named(String),
    Toml { name: String, toml: String, folder: PathBuf },
}

impl Scenario {
    fn load(source: Source, edits: Edits) -> PyResult<Self> {
        let template = match &source {
            Source::Named(name) => Template::load(name, &edits),
            Source::Toml { name, toml, folder } => Template::of_toml(name, toml, &edits, folder),
        };
        Ok(Self { source, edits, template: template.map_err(of_scenario)? })
    }

    pub(crate) fn template(&self) -> &Template {
        &self.template
    }

    /// What is set beyond `other`, where this is `other` changed.
    pub(crate) fn changes_of(&self, other: &Self) -> &[String] {
        let is_of_it = self.source == other.source;
        is_of_it.then(|| self.edits.set.strip_prefix(other.edits.set.as_slice())).flatten().unwrap_or_default()
    }

    /// The scenario of a seed.
    pub(crate) fn drawn(&self, seed: u64) -> PyResult<standoff_sim::scenario::Scenario> {
        self.template.draw(seed).map_err(of_scenario)
    }
}

/// What is flown where nothing is named: by itself, or over traffic.
const DEFAULT_SCENARIO: &str = "best/figure-9";
const DEFAULT_FOR_TRAFFIC: &str = "traffic/convoy";

/// Wherever a scenario is asked for: an object, or what makes one.
pub(crate) fn asked_for(scenario: &Bound<'_, PyAny>) -> PyResult<Scenario> {
    changed_as_asked(Some(scenario), None, None, None)
}

/// The same with changes; where none is named, what the command flies.
pub(crate) fn changed_as_asked(
    scenario: Option<&Bound<'_, PyAny>>,
    traffic: Option<PathBuf>,
    uavs: Option<u32>,
    set: Option<&Dict<'_>>,
) -> PyResult<Scenario> {
    let default = if traffic.is_some() { DEFAULT_FOR_TRAFFIC } else { DEFAULT_SCENARIO };
    let (source, edits) = match scenario {
        None => (Source::Named(default.to_owned()), Edits::default()),
        Some(scenario) => match scenario.cast::<Scenario>() {
            Ok(scenario) if traffic.is_none() && uavs.is_none() && set.is_none() => return Ok(scenario.get().clone()),
            Ok(scenario) => (scenario.get().source.clone(), scenario.get().edits.clone()),
            Err(_) => (Source::Named(path(scenario)?), Edits::default()),
        },
    };
    Scenario::load(source, changed(edits, traffic, uavs, set)?)
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (scenario, *, traffic=None, uavs=None, set=None))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        traffic: Option<PathBuf>,
        uavs: Option<Whole>,
        set: Option<Dict<'_>>,
    ) -> PyResult<Self> {
        changed_as_asked(Some(scenario), traffic, small("uavs", uavs)?, set.as_ref())
    }

    /// A scenario typed as TOML.
    ///
    /// :param toml: the text, as of a scenario file.
    /// :param name: what it is called.
    /// :raises ScenarioError: what is wrong, drawn under what was typed.
    #[staticmethod]
    #[pyo3(signature = (toml, *, name="scenario"))]
    fn from_toml(toml: &str, name: &str) -> PyResult<Self> {
        let folder = env::current_dir().unwrap_or_default();
        let source = Source::Toml { name: name.to_owned(), toml: toml.to_owned(), folder };
        Self::load(source, Edits::default())
    }

    /// A scenario of nested dicts, as :meth:`to_dict` gives them and as ``tomllib`` reads scenario files.
    ///
    /// :param scenario: tables as dicts, arrays as lists.
    /// :param name: what it is called.
    /// :raises ScenarioError: what is wrong, drawn under it as TOML.
    #[staticmethod]
    #[pyo3(signature = (scenario, *, name="scenario"))]
    fn from_dict(scenario: Dict<'_>, name: &str) -> PyResult<Self> {
        Self::from_toml(&table(&scenario.0)?.to_string(), name)
    }

    /// The same with more changes; parameters as of the class.
    #[pyo3(signature = (*, traffic=None, uavs=None, set=None))]
    fn changed(&self, traffic: Option<PathBuf>, uavs: Option<Whole>, set: Option<Dict<'_>>) -> PyResult<Self> {
        Self::load(self.source.clone(), changed(self.edits.clone(), traffic, small("uavs", uavs)?, set.as_ref())?)
    }

    /// What it is called.
    #[getter]
    fn name(&self) -> &str {
        self.template.name()
    }

    /// The traffic file, if it is flown over one that is not built in.
    #[getter]
    fn traffic_file(&self) -> Option<PathBuf> {
        self.template.traffic_file()
    }

    /// The scenario as TOML with its changes and all defaults spelt out, before anything is drawn.
    #[getter]
    fn toml(&self) -> PyResult<String> {
        self.template.text().map_err(of_scenario)
    }

    /// :attr:`toml` as nested dicts.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        Ok(Dict(py.import("tomllib")?.call_method1("loads", (self.toml()?,))?.cast_into()?))
    }

    /// The scenario of a seed as TOML with every value drawn and spelt out; loading it gives the same run.
    ///
    /// :param seed: seed of everything random, 0 to 2**63 - 1.
    fn resolved(&self, seed: Whole) -> PyResult<String> {
        self.drawn(count("seed", seed, 0)?)?.resolved().map_err(of_scenario)
    }

    fn __repr__(&self) -> String {
        let changes = self.edits.set.iter().map(|edit| format!(", {edit}")).collect::<String>();
        format!("Scenario({:?}{changes})", self.template.name())
    }

    #[pyo3(signature = () -> "tuple[object, tuple[object, ...]]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let Edits { set, traffic, uavs } = self.edits.clone();
        let (name, toml, folder) = match self.source.clone() {
            Source::Named(name) => (name, None, None),
            Source::Toml { name, toml, folder } => (name, Some(toml), Some(folder)),
        };
        let restored = py.import("standoff._standoff")?.getattr("Scenario")?.getattr("_restored")?;
        Ok((restored, (name, toml, folder, set, traffic, uavs).into_pyobject(py)?))
    }

    /// What was pickled.
    #[staticmethod]
    fn _restored(
        name: String,
        toml: Option<String>,
        folder: Option<PathBuf>,
        set: Vec<String>,
        traffic: Option<PathBuf>,
        uavs: Option<u32>,
    ) -> PyResult<Self> {
        let source = match toml {
            Some(toml) => Source::Toml { name, toml, folder: folder.unwrap_or_default() },
            None => Source::Named(name),
        };
        Self::load(source, Edits { set, traffic, uavs })
    }
}

/// Names of the built-in scenarios, in the order in which a newcomer may read them.
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|one| one.name).collect()
}

fn path(scenario: &Bound<'_, PyAny>) -> PyResult<String> {
    let path: PathBuf = scenario.extract().map_err(|_| {
        ScenarioError::new_err(format!(
            "a scenario is a built-in name, a path or a Scenario, not {}",
            scenario.get_type().name().map_or_else(|_| "that".to_owned(), |name| name.to_string())
        ))
    })?;
    path.into_os_string().into_string().map_err(|path| {
        ScenarioError::new_err(format!("{}: not UTF-8 text: rename it, or go into its folder", path.to_string_lossy()))
    })
}

fn changed(mut edits: Edits, traffic: Option<PathBuf>, uavs: Option<u32>, set: Option<&Dict<'_>>) -> PyResult<Edits> {
    edits.traffic = traffic.or(edits.traffic);
    edits.uavs = uavs.or(edits.uavs);
    for (key, value) in set.into_iter().flat_map(|set| set.0.iter()) {
        let key: String = key.extract().map_err(|_| ScenarioError::new_err("set: keys are str"))?;
        let value = self::value(&value).map_err(|what| ScenarioError::new_err(format!("set: {key}: {what}")))?;
        edits.set.push(format!("{key}={value}"));
    }
    Ok(edits)
}

/// A dict as a table.
fn table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    match value(dict.as_any()) {
        Ok(Value::Table(table)) => Ok(table),
        Ok(_) => Err(ScenarioError::new_err("a scenario is a dict")),
        Err(what) => Err(ScenarioError::new_err(what)),
    }
}

/// Deepest dict: a scenario's are three deep.
const DEPTH_MAX: usize = 8;

fn value(of: &Bound<'_, PyAny>) -> Result<Value, String> {
    value_within(of, DEPTH_MAX)
}

/// A value as TOML has it; numbers of NumPy, too.
fn value_within(of: &Bound<'_, PyAny>, depth: usize) -> Result<Value, String> {
    let depth = depth.checked_sub(1).ok_or("nested too deep for a scenario")?;
    let kind = || of.get_type().name().map_or_else(|_| "this".to_owned(), |name| name.to_string());
    if let Ok(dict) = of.cast::<PyDict>() {
        let entries = dict.iter().map(|(key, value)| {
            let key: String = key.extract().map_err(|_| "keys are str".to_owned())?;
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
    // NumPy's scalars say what they are as Python's own.
    if let Ok(true) = of.getattr("ndim").and_then(|ndim| ndim.eq(0)) {
        let own = of.call_method0("item").map_err(|error| error.to_string())?;
        return value_within(&own, depth);
    }
    if of.is_instance_of::<PyInt>() {
        return of.extract().map(Value::Integer).map_err(|_| "an integer must fit 64 bits".to_owned());
    }
    if of.hasattr("tolist").unwrap_or(false) {
        let own = of.call_method0("tolist").map_err(|error| error.to_string())?;
        return value_within(&own, depth);
    }
    of.extract().map(Value::Float).map_err(|_| format!("a value is a number, text, list or dict, not {}", kind()))
}
