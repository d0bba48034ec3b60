//! Sweeps: `sweep`, and the class of a complete sweep.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use standoff_app::{Axis, LatinHypercube, POINTS_MAX, SWEEP_TABLE, Sweep as Definition, SweepResults};
use standoff_sim::monte_carlo::Progress;
use toml::Value;

use crate::batch::{Batch, store_progress};
use crate::common_args::{Dict, MetricsArg, Whole, count, json, number_of_threads, type_name, warn, within};
use crate::exceptions::{InputError, raised};
use crate::folder::in_folder;
use crate::interruptible::{LatestProgress, batch_until_done};
use crate::notebook_repr::framed;
use crate::scenario::{Scenario, scenario_of, value};
use crate::table::Table;

/// A complete sweep, read from its folder: a Monte Carlo batch at each point of a grid or a Latin hypercube.
///
/// :attr:`table` has the results, ``print`` shows the means with their intervals, and a notebook shows the page.
///
/// :param dir: folder written by ``standoff sweep`` or :func:`sweep`.
/// :raises InputError: if the folder holds no complete sweep, or a file was changed after it was written.
#[pyclass(frozen, weakref, module = "standoff")]
pub(crate) struct Sweep {
    dir: PathBuf,
    results: SweepResults,
}

#[pymethods]
impl Sweep {
    #[new]
    fn new(py: Python<'_>, dir: PathBuf) -> PyResult<Self> {
        let results = py.detach(|| SweepResults::open(&dir)).map_err(|failure| raised(&failure))?;
        Ok(Self { dir, results })
    }

    /// Folder of the sweep: ``sweep.json``, ``sweep.parquet``, ``report.html``, and the batches in ``points``.
    #[getter]
    fn dir(&self) -> &Path {
        &self.dir
    }

    /// ``sweep.parquet``: one row per point, with ``point``, a column per key, and for every metric its mean, the ends of
    /// the mean's 95 % confidence interval (``..._ci95_low``, ``..._ci95_high``), standard deviation (``..._sd``) and
    /// number of runs with a value (``..._n``).
    #[getter]
    fn table(this: &Bound<'_, Self>) -> PyResult<Table> {
        Table::open(&this.get().dir.join(SWEEP_TABLE), Some(this.clone().into_any().unbind()))
    }

    /// Returns the output of ``standoff sweep --json`` as a dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        json(py, &self.results.json().map_err(|failure| raised(&failure))?)
    }

    /// Opens the batch of a point.
    ///
    /// :param point: index of the point, from 0.
    /// :raises IndexError: if there is no such point.
    fn batch(this: &Bound<'_, Self>, point: Whole) -> PyResult<Batch> {
        let sweep = this.get().results.sweep();
        let size = sweep.size();
        let index = usize::try_from(point.0).ok().filter(|index| *index < size);
        let index = index
            .ok_or_else(|| PyIndexError::new_err(format!("point = {}: must be from 0 to {}", point.0, size - 1)))?;
        Batch::open(this.py(), &this.get().dir.join(sweep.point_dir(index)), Some(this.clone().into_any().unbind()))
    }

    /// Number of points.
    fn __len__(&self) -> usize {
        self.results.sweep().size()
    }

    /// The text that ``standoff sweep`` prints, for all metrics.
    fn __str__(&self) -> String {
        self.results.text(true, &self.dir)
    }

    fn __repr__(&self) -> String {
        let keys = self.results.sweep().keys().join(", ");
        format!("Sweep({keys}: {} points, {:?})", self.__len__(), self.dir)
    }

    /// HTML for notebooks: the page with the plot and the table.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Ok(page) = fs::read_to_string(self.dir.join("report.html")) else { return Ok(None) };
        framed(py, &page).map(Some)
    }
}

/// Runs a scenario many times at each point of a grid, or at random points of a Latin hypercube. Writes byte for byte the
/// same table as ``standoff sweep``.
///
/// All points use the same seeds. If the sweep is interrupted, the same call with the same ``out`` resumes it.
/// docs/user/sweep.md describes the files.
///
/// :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`.
/// :param vary: the keys to vary and their values: a list (``{"guidance.lead_s": [0, 1, 2]}``, also a NumPy array) or, as
///     str, ``"FROM..TO:COUNT"`` for evenly spaced values or ``"FROM..TO"`` for a range, which needs ``points``.
/// :param runs: number of runs of each point, 1 to 100,000,000.
/// :param points: number of points of a Latin hypercube, 2 to 10,000. None: a grid of all combinations.
/// :param points_seed: seed of the Latin hypercube, at least 0; 1 by default.
/// :param seed: seed of the first run of every point, at least 0; 1 by default.
/// :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
///     comma-separated str, or a list.
/// :param threads: number of threads; None: one per core. The results do not depend on it.
/// :param out: folder for the results. None: a temporary folder, deleted together with the sweep object.
/// :param progress: called as ``progress(done, of)`` with numbers of runs, several times per second and at the end. An
///     exception that it raises stops the sweep.
/// :returns: the complete sweep.
/// :raises ScenarioError: if the scenario of a point is invalid.
/// :raises InputError: if another argument is invalid, a seed cannot be run, or ``out`` holds other files.
/// :raises StandoffError: if a run fails, for example because the disk is full; completed runs stay in ``out``.
#[pyfunction]
#[pyo3(signature = (
    scenario, *, vary, runs, points=None, points_seed=Whole(1), seed=Whole(1), metrics=MetricsArg::default(), threads=None,
    out=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
pub(crate) fn sweep(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    vary: Dict<'_>,
    runs: Whole,
    points: Option<Whole>,
    points_seed: Whole,
    seed: Whole,
    metrics: MetricsArg,
    threads: Option<Whole>,
    out: Option<PathBuf>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<Sweep>> {
    let (scenario, threads) = (scenario_of(scenario)?, number_of_threads(threads)?);
    let sweep = define(&scenario, &vary, points, points_seed, runs, seed, &metrics)?;
    warn(py, &scenario.with(&sweep.changes(0))?.drawn(count("seed", seed, 0)?)?)?;
    in_folder(py, out, |out| {
        let dir = out.to_owned();
        let fly = move |stop: &AtomicBool, latest: &LatestProgress| {
            let report = |progress: Progress| store_progress(latest, progress);
            sweep.fly_into(&dir, scenario.template(), threads, stop, report)
        };
        let results = batch_until_done(py, progress, fly)?;
        Ok(Sweep { dir: out.to_owned(), results })
    })
}

/// Definition of a sweep as JSON, the folder of each point's batch, and the scenario of each point.
#[pyfunction]
#[pyo3(signature = (scenario, vary, points, points_seed, runs, seed, metrics))]
pub(crate) fn _sweep_plan(
    scenario: &Bound<'_, PyAny>,
    vary: Dict<'_>,
    points: Option<Whole>,
    points_seed: Whole,
    runs: Whole,
    seed: Whole,
    metrics: MetricsArg,
) -> PyResult<(String, Vec<String>, Vec<Scenario>)> {
    let scenario = scenario_of(scenario)?;
    let sweep = define(&scenario, &vary, points, points_seed, runs, seed, &metrics)?;
    let definition = sweep.json().map_err(|failure| raised(&failure))?;
    let dirs = (0..sweep.size()).map(|point| sweep.point_dir(point)).collect();
    let scenarios = (0..sweep.size()).map(|point| scenario.with(&sweep.changes(point))).collect::<PyResult<_>>()?;
    Ok((definition, dirs, scenarios))
}

/// Compares two definitions of sweeps. Returns the first difference of ``theirs`` from ``ours`` as text, or None.
#[pyfunction]
pub(crate) fn _sweep_difference(ours: &str, theirs: &str) -> PyResult<Option<String>> {
    let parsed = |text: &str| Definition::from_json(text, "sweep.json").map_err(|failure| raised(&failure));
    Ok(parsed(ours)?.difference(&parsed(theirs)?))
}

/// Writes the table and the page of a sweep, all of whose batches are complete.
#[pyfunction]
pub(crate) fn _sweep_complete(py: Python<'_>, dir: PathBuf) -> PyResult<()> {
    let completed = py.detach(|| SweepResults::open(&dir).and_then(|results| results.save(&dir)));
    completed.map(drop).map_err(|failure| raised(&failure))
}

/// Checks the arguments and defines the sweep.
fn define(
    scenario: &Scenario,
    vary: &Dict<'_>,
    points: Option<Whole>,
    points_seed: Whole,
    runs: Whole,
    seed: Whole,
    metrics: &MetricsArg,
) -> PyResult<Definition> {
    let axes = vary.0.iter().map(|(key, values)| axis(&key, &values)).collect::<PyResult<Vec<_>>>()?;
    let points = points.map(|points| within("points", points, 2, POINTS_MAX as u64)).transpose()?;
    let points_seed = count("points_seed", points_seed, 0)?;
    let (runs, seed) = (count("runs", runs, 1)?, count("seed", seed, 0)?);
    let hypercube = points
        .and_then(|points| usize::try_from(points).ok())
        .map(|points| LatinHypercube { points, seed: points_seed });
    let sweep = Definition::new(&axes, hypercube, scenario.template(), seed, runs, metrics.selection()?);
    sweep.map_err(|failure| raised(&failure))
}

/// Converts a key and its values.
fn axis(key: &Bound<'_, PyAny>, values: &Bound<'_, PyAny>) -> PyResult<Axis> {
    let key: String = key.extract().map_err(|_| InputError::new_err("vary: keys must be str"))?;
    let refused = |what: String| InputError::new_err(format!("vary: {what}"));
    if values.is_instance_of::<PyString>() {
        return Axis::of(&key, &values.extract::<String>()?).map_err(refused);
    }
    let must = || {
        let given = type_name(values);
        refused(format!("{key}: must be a list of values, \"FROM..TO:COUNT\" or \"FROM..TO\", not {given}"))
    };
    if values.is_instance_of::<PyDict>() {
        return Err(must());
    }
    let items = values.try_iter().map_err(|_| must())?;
    let text = |item: PyResult<Bound<'_, PyAny>>| match value(&item?) {
        // Words need no quotes, as on the command line.
        Ok(Value::String(word)) if is_word(&word) => Ok(word),
        Ok(item) => Ok(item.to_string()),
        Err(what) => Err(refused(format!("{key}: {what}"))),
    };
    Axis::listed(&key, items.map(text).collect::<PyResult<_>>()?).map_err(refused)
}

/// True for text that TOML does not read as a number, a boolean or something else.
fn is_word(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-')
        && text.starts_with(|c: char| c.is_ascii_lowercase())
        && !["true", "false", "inf", "nan"].contains(&text)
}
