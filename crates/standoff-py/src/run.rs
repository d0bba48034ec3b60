//! `run`: runs a scenario, writes its record and computes its results.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use standoff_app::{
    BaselineReport, Failure, Maps, Outcome, OutcomeOptions, PerTarget, Report, fly, format_errors, has_older_run,
    report_run, run_interruptible,
};
use standoff_io::display_text;
use standoff_score::{MetricSelection, SelectedMetrics};
use standoff_sim::run::Mission;

use crate::common_args::{Dict, MapArg, MetricsArg, TrafficArg, Whole, count, json, small, warn, warning};
use crate::exceptions::{InputError, StandoffError, raised};
use crate::folder::in_folder;
use crate::interruptible::{unless_interrupted, until_done};
use crate::law::{self, LawCalls};
use crate::metrics_table;
use crate::notebook_repr::framed;
use crate::scenario::scenario_with;
use crate::table::Table;

/// Names of the tables in a record.
const TABLES: [&str; 14] = [
    "uavs",
    "truth",
    "tracks",
    "groups",
    "detections",
    "in_view",
    "events",
    "intruders",
    "tentative",
    "agents",
    "agent_tracks",
    "agent_groups",
    "agent_events",
    "agent_teammates",
];

/// A recorded run, read from its folder: its tables and its results.
///
/// ``run.uavs``, ``run.truth``, ``run.tracks``, ``run.groups``, ``run.detections``, ``run.in_view`` and ``run.events``
/// are its tables (docs/user/record.md describes their columns); ``run.targets`` has the scores of each target. A notebook
/// shows the report page of the run; ``print`` shows the same table as the command line.
///
/// :param dir: folder written by ``standoff run`` or :func:`run`; the summary and the figures in it are recomputed.
/// :param metrics: names of metrics and of sets, as for :func:`run`.
/// :param map: background map that replaces the one in the record: a SUMO net (.net.xml) or GeoJSON, plain or .gz, or a
///     list of them.
/// :raises InputError: if the folder holds no record, or the record is damaged.
#[pyclass(frozen, weakref, module = "standoff")]
pub(crate) struct Run {
    dir: PathBuf,
    results: Results,
}

/// Results of a run.
struct Results {
    /// `summary.json`.
    summary: String,
    /// Text for `print`.
    text: String,
    metrics: SelectedMetrics,
    targets: Vec<PerTarget>,
}

impl Results {
    fn of(outcome: &Outcome, dir: &Path) -> Result<Self, Failure> {
        Ok(Self {
            summary: outcome.json().map_err(Failure::running)?,
            text: outcome.text(dir, OutcomeOptions { per_target: true, ..OutcomeOptions::default() }),
            metrics: outcome.metrics.clone(),
            targets: outcome.per_target.clone(),
        })
    }
}

/// Inputs of a run that move to the worker thread.
struct Flight {
    scenario: standoff_sim::scenario::Scenario,
    out: PathBuf,
    maps: Maps,
    selection: MetricSelection,
    baseline: bool,
    notes: Notes,
}

/// Notes and warnings collected during a run.
#[derive(Clone, Default)]
pub(crate) struct Notes(Arc<Mutex<Vec<String>>>);

impl Notes {
    pub(crate) fn add(&self, line: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned());
    }

    /// Issues the collected notes as Python warnings.
    pub(crate) fn warn(&self, py: Python<'_>) -> PyResult<()> {
        let notes = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        let text = |note: &String| note.trim_start_matches("note: ").trim_start_matches("warning: ").to_owned();
        notes.iter().map(text).try_for_each(|note| warning(py, &note))
    }
}

impl Flight {
    /// Runs the mission, publishes the record and writes its results.
    fn fly<B: standoff_sim::controller::Controller>(
        &self,
        mission: &mut Mission<B>,
        stop: &AtomicBool,
        go_on: impl Fn() -> bool,
    ) -> Result<Results, Failure> {
        let note = |line: &str| self.notes.add(line);
        let map = self.maps.of_scenario(&self.scenario, &note)?;
        let record = fly(&self.scenario, mission, &self.out, map.as_ref(), &note, go_on, |_| {})?;
        let (dir, out, selection, notes) =
            (record.dir().to_owned(), self.out.clone(), self.selection, self.notes.clone());
        let (scenario, with_baseline) = (self.scenario.clone(), self.baseline);
        let text = run_interruptible(
            || stop.load(Ordering::Relaxed),
            move || {
                let text = report_run(&dir, &out, selection, &|line| notes.add(line))?;
                Ok((text, with_baseline.then(|| BaselineReport::of(&scenario).baseline)))
            },
        );
        record.publish().map_err(Failure::running)?;
        let (Report { mut outcome, written }, baseline) =
            text.ok_or_else(|| Failure::running(format!("the run is complete in {}", display_text::path(&self.out))))??;
        written?;
        outcome.baseline = baseline;
        Results::of(&outcome, &self.out)
    }
}

/// Runs a scenario and records it. Writes byte for byte the same files as ``standoff run``, with the same results.
///
/// :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`. None:
///     ``improved/figure-9`` or, with ``traffic``, ``traffic/convoy``, as on the command line.
/// :param seed: seed of all random values, 0 to 2**63 - 1; 1 by default.
/// :param traffic: traffic file or data frame with the targets, as for :class:`Scenario`.
/// :param uavs: number of UAVs, started on an orbit about the first targets.
/// :param set: values of the scenario to change, by dotted key.
/// :param metrics: names of metrics (docs/user/metrics.md) and of the sets ``standard``, ``limits``, ``association``,
///     ``table-2``, ``all``: a comma-separated str, or a list.
/// :param out: folder for the results. None: a temporary folder, deleted together with the run object.
/// :param map: background map: a SUMO net (.net.xml) or GeoJSON, plain or .gz, or a list of them. None: the map of the
///     scenario.
/// :param law: custom law that replaces the built-in controller: a subclass of :class:`Law`, or a callable that takes a
///     :class:`MissionInfo` and returns an object with a method ``decide``.
/// :param law_limit_s: time limit for each call of a custom law, s, above 0.
/// :param baseline: also compute the coverage baseline: the coverage of greedily placed sensor footprints with perfect
///     knowledge of the target positions.
/// :returns: the run.
/// :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
/// :raises InputError: if another argument is invalid, or ``out`` holds other files.
/// :raises StandoffError: if the run fails, for example because the disk is full or a custom law does not answer.
///     Exceptions of a custom law are passed on. A note in the exception states which part of the run was saved.
#[pyfunction]
#[pyo3(signature = (
    scenario=None, *, seed=Whole(1), traffic=None, uavs=None, set=None, metrics=MetricsArg::default(), out=None, map=None,
    law=None, law_limit_s=10.0, baseline=false
))]
#[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
pub(crate) fn run(
    py: Python<'_>,
    scenario: Option<&Bound<'_, PyAny>>,
    seed: Whole,
    traffic: Option<TrafficArg>,
    uavs: Option<Whole>,
    set: Option<Dict<'_>>,
    metrics: MetricsArg,
    out: Option<PathBuf>,
    map: Option<MapArg>,
    law: Option<&Bound<'_, PyAny>>,
    law_limit_s: f64,
    baseline: bool,
) -> PyResult<Py<Run>> {
    let scenario =
        scenario_with(scenario, traffic, small("uavs", uavs)?, set.as_ref())?.drawn(count("seed", seed, 0)?)?;
    let selection = metrics.selection()?;
    warn(py, &scenario)?;
    let stop = Arc::new(AtomicBool::new(false));
    let calls = law.map(|_| LawCalls::within(py, law_limit_s, &stop)).transpose()?;
    let law = law.map(|law| law.clone().unbind());
    let is_named = out.is_some();
    in_folder(py, out, |out| {
        // Removes a trailing slash, with which a symbolic link to the folder would be followed in some calls only.
        let out: PathBuf = out.components().collect();
        let notes = Notes::default();
        if has_older_run(&scenario, &out).map_err(|failure| raised(&failure))? {
            notes.add(&format!("note: replacing the older run in {}", out.display()));
        }
        let (law_calls, stopped) = (calls.clone(), Arc::clone(&stop));
        let flight =
            Flight { scenario, out: out.clone(), maps: MapArg::maps(map), selection, baseline, notes: notes.clone() };
        let work = move || {
            let go_on = || !stopped.load(Ordering::Relaxed);
            let Some((law, calls)) = law.zip(law_calls) else {
                let mission = Mission::new(&flight.scenario);
                let mut mission = mission.map_err(|errors| Failure::Input(format_errors(&errors)))?;
                return flight.fly(&mut mission, &stopped, go_on);
            };
            match Python::attach(|py| law::mission(py, &flight.scenario, law.bind(py), &calls)) {
                Ok(mut mission) => flight.fly(&mut mission, &stopped, || go_on() && !calls.has_failed()),
                Err(error) => {
                    calls.fail(error);
                    Err(Failure::running("the mission did not start"))
                }
            }
        };
        let ended = until_done(py, &stop, || Ok(()), work)?;
        notes.warn(py)?;
        let raised_error = ended.raised.or_else(|| calls.and_then(|calls| calls.take()));
        let results = results_or_error(py, ended.done, raised_error, is_named)?;
        Ok(Run { dir: out, results })
    })
}

/// Returns the results of a run. A raised exception takes precedence over a failure: it is the reason why the run ended.
fn results_or_error<T>(
    py: Python<'_>,
    done: Result<T, Failure>,
    raised_error: Option<PyErr>,
    adds_failure: bool,
) -> PyResult<T> {
    let Some(error) = raised_error else { return done.map_err(|failure| raised(&failure)) };
    if let (Err(failure), true) = (&done, adds_failure) {
        error.add_note(py, failure.message(false).join("\n"))?;
    }
    Err(error)
}

/// Computes the coverage baseline of a scenario: the coverage of greedily placed sensor footprints with perfect
/// knowledge of the target positions. The numbers are those of ``standoff baseline``.
///
/// :param scenario: as for :func:`run`, like the other parameters.
/// :returns: ``{"scenario", "seed", "duration_s", "uavs", "targets", "baseline": {"disc_radius_m", "half_of_uavs",
///     "all_uavs"}}``.
/// :raises ScenarioError: if the scenario is invalid.
#[pyfunction]
#[pyo3(signature = (scenario=None, *, seed=Whole(1), traffic=None, uavs=None, set=None))]
pub(crate) fn baseline<'py>(
    py: Python<'py>,
    scenario: Option<&Bound<'py, PyAny>>,
    seed: Whole,
    traffic: Option<TrafficArg>,
    uavs: Option<Whole>,
    set: Option<Dict<'py>>,
) -> PyResult<Dict<'py>> {
    let scenario =
        scenario_with(scenario, traffic, small("uavs", uavs)?, set.as_ref())?.drawn(count("seed", seed, 0)?)?;
    warn(py, &scenario)?;
    let done = unless_interrupted(py, move || BaselineReport::of(&scenario).json())?;
    json(py, &done.map_err(|error| StandoffError::new_err(error.to_string()))?)
}

#[pymethods]
impl Run {
    #[new]
    #[pyo3(signature = (dir, *, metrics=MetricsArg::default(), map=None))]
    fn new(py: Python<'_>, dir: PathBuf, metrics: MetricsArg, map: Option<MapArg>) -> PyResult<Self> {
        let (selection, notes) = (metrics.selection()?, Notes::default());
        let (folder, collected) = (dir.clone(), notes.clone());
        let maps = MapArg::maps(map);
        let work = move || -> Result<_, Failure> {
            let note = |line: &str| collected.add(line);
            maps.replace_in_record(&folder, &note)?;
            let Report { outcome, written } = report_run(&folder, &folder, selection, &note)?;
            written?;
            Results::of(&outcome, &folder)
        };
        let done = unless_interrupted(py, work)?;
        notes.warn(py)?;
        Ok(Self { dir, results: done.map_err(|failure| raised(&failure))? })
    }

    /// Folder of the run.
    #[getter]
    fn dir(&self) -> &Path {
        &self.dir
    }

    /// ``summary.json`` as a dict: scenario, metrics, events, and results of each target.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        json(py, &self.results.summary)
    }

    /// Metrics of the run: a float for each name, or None if the metric is not defined for this run.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.summary(py)?.dict("metrics")
    }

    /// Metrics as a table, one row per metric, with ``metric``, ``label``, ``unit`` and ``value``. Fractions are 0 to 1,
    /// and have, like all numbers without a unit, the unit 1.
    #[getter]
    fn metrics_table(&self) -> PyResult<Table> {
        metrics_table::of_run(&self.results.metrics)
    }

    /// Scores of each target, one row per target: custody, longest time out of view, position error, ANEES.
    #[getter]
    fn targets(&self) -> PyResult<Table> {
        metrics_table::of_targets(&self.results.targets)
    }

    /// Scenario of the run as TOML, with all random values drawn and all defaults.
    #[getter]
    fn scenario_toml(&self) -> PyResult<String> {
        let path = self.dir.join("scenario.toml");
        fs::read_to_string(&path).map_err(|reason| InputError::new_err(format!("{}: {reason}", path.display())))
    }

    /// Opens a table of the record.
    ///
    /// :param name: ``uavs``, ``truth``, ``tracks``, ``groups``, ``detections``, ``in_view`` or ``events``; in runs
    ///     with intruders also ``intruders``; in runs with tentative tracks also ``tentative``; in runs with one
    ///     agent per UAV also ``agents``, ``agent_tracks``, ``agent_groups``, ``agent_events`` or ``agent_teammates``.
    /// :raises KeyError: if no table has this name.
    fn table(this: &Bound<'_, Self>, name: &str) -> PyResult<Table> {
        if !TABLES.contains(&name) {
            return Err(PyKeyError::new_err(format!("no table {name:?}; tables: {}", TABLES.join(", "))));
        }
        Table::open(&this.get().dir.join(format!("{name}.parquet")), Some(this.clone().into_any().unbind()))
    }

    /// Makes a ``geopandas.GeoDataFrame`` of a table: its rows with their places as points (EPSG:4326); needs GeoPandas.
    ///
    /// :param table: name of the table, as for :meth:`table`.
    /// :raises InputError: if the rows have no latitude and longitude: only runs over traffic in degrees, and flights,
    ///     are at a place on the Earth.
    #[pyo3(signature = (table="tracks"))]
    fn to_geodataframe<'py>(this: &Bound<'py, Self>, table: &str) -> PyResult<Bound<'py, PyAny>> {
        let table = Self::table(this, table)?;
        this.py().import("standoff._frames")?.call_method1("to_geodataframe", (table,))
    }

    /// State of each UAV at each time step.
    #[getter]
    fn uavs(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "uavs")
    }

    /// True state of each target at each time step.
    #[getter]
    fn truth(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "truth")
    }

    /// Tracks: the team's estimate of each target at each time step.
    #[getter]
    fn tracks(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "tracks")
    }

    /// Groups and their orbits at each time step.
    #[getter]
    fn groups(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "groups")
    }

    /// Detections of the sensors.
    #[getter]
    fn detections(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "detections")
    }

    /// Targets in the view of each UAV.
    #[getter]
    fn in_view(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "in_view")
    }

    /// Events of the run.
    #[getter]
    fn events(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "events")
    }

    fn __str__(&self) -> &str {
        &self.results.text
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let summary = self.summary(py)?;
        let (scenario, seed) = (summary.get("scenario")?, summary.get("seed")?);
        Ok(format!("Run({scenario}, seed {seed}, {:?})", self.dir))
    }

    /// HTML for notebooks: the report page that replays the run.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Ok(page) = fs::read_to_string(self.dir.join("report.html")) else { return Ok(None) };
        framed(py, &page).map(Some)
    }
}
