//! Monte Carlo batches: `monte_carlo`, `merge`, and the class of a complete batch.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use standoff_app::{Failure, REPORT, batch_page, of_batch};
use standoff_score::MetricSelection;
use standoff_sim::monte_carlo::{Batch as Flown, Progress, Results, Shard, fly_into, merge as merge_shards};
use standoff_sim::scenario::ScenarioTemplate;

use crate::common_args::{Dict, MetricsArg, Whole, count, json, number_of_threads, warn};
use crate::exceptions::{InputError, StandoffError, of_batch as refused};
use crate::folder::in_folder;
use crate::interruptible::{LatestProgress, batch_until_done};
use crate::metrics_table;
use crate::notebook_repr::{frame_html, framed};
use crate::scenario::scenario_of;
use crate::table::Table;

/// A complete Monte Carlo batch, read from its folder.
///
/// :param dir: folder written by ``standoff monte-carlo``, :func:`monte_carlo` or :func:`merge`.
/// :raises InputError: if the folder holds no complete batch, or a file was changed after it was written.
#[pyclass(frozen, weakref, module = "standoff")]
pub(crate) struct Batch {
    results: Results,
    /// Object whose life keeps a temporary folder from being deleted.
    _owner: Option<Py<PyAny>>,
}

impl Batch {
    /// Raises an error if no batch can have this number of runs and first seed.
    pub(crate) fn check(template: &ScenarioTemplate, seed: u64, runs: u64, selection: MetricSelection) -> PyResult<()> {
        Flown::new(template, seed, runs, None, selection).map(drop).map_err(refused)
    }

    /// Opens a batch. It holds a reference to `owner`, whose temporary folder may contain it.
    pub(crate) fn open(py: Python<'_>, dir: &Path, owner: Option<Py<PyAny>>) -> PyResult<Self> {
        Ok(Self { results: py.detach(|| Results::open(dir)).map_err(refused)?, _owner: owner })
    }

    pub(crate) fn folder(&self) -> &Path {
        self.results.dir()
    }

    /// Contents of one file of the batch; `None` if it cannot be read.
    fn file(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.folder().join(name)).ok()
    }
}

#[pymethods]
impl Batch {
    #[new]
    fn new(py: Python<'_>, dir: PathBuf) -> PyResult<Self> {
        Self::open(py, &dir, None)
    }

    /// Folder of the batch: ``runs.parquet``, ``summary.json``, ``monte-carlo.json``, ``report.html``.
    #[getter]
    fn dir(&self) -> PathBuf {
        self.folder().to_owned()
    }

    /// ``summary.json`` as a dict: the scenario, seeds and number of runs, and the statistics of every metric.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        let text = match self.file("summary.json") {
            Some(text) => text,
            None => {
                let summary = py.detach(|| self.results.summary()).map_err(refused)?;
                summary.json().map_err(|error| StandoffError::new_err(error.to_string()))?
            }
        };
        json(py, &text)
    }

    /// Statistics of each metric over the runs: ``n``, ``mean``, ``ci95``, ``sd``, ``p5``, ``p50``, ``p95``, ``max``.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.summary(py)?.dict("metrics")
    }

    /// The statistics as a table, one row per metric, with ``metric``, ``label``, ``unit``, ``n``, ``mean``, ``ci95_low``,
    /// ``ci95_high`` and the others of :attr:`metrics`. Fractions are 0 to 1, and have, like all numbers without a unit,
    /// the unit 1.
    #[getter]
    fn metrics_table(&self, py: Python<'_>) -> PyResult<Table> {
        metrics_table::of_batch(&py.detach(|| self.results.summary()).map_err(refused)?)
    }

    /// ``runs.parquet``: one row per run, in seed order, with ``run``, ``seed`` and one column per metric.
    #[getter]
    fn runs(this: &Bound<'_, Self>) -> PyResult<Table> {
        Table::open(&this.get().folder().join("runs.parquet"), Some(this.clone().into_any().unbind()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (summary, batch) = (self.summary(py)?, self.results.batch());
        let (runs, scenario) = (batch.flown(), summary.get("scenario")?);
        Ok(format!("Batch({scenario}, {} runs, {:?})", runs.end - runs.start, self.folder()))
    }

    /// HTML for notebooks: the report page of the batch or, if it is missing, a table of the statistics.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        if let Some(page) = self.file("report.html") {
            return framed(py, &page);
        }
        frame_html(py, self.metrics_table(py)?)
    }
}

/// Runs a scenario many times with consecutive seeds. Writes byte for byte the same files as ``standoff monte-carlo``.
///
/// Run k, counted from 0, uses ``seed + k``. If the batch is interrupted (Ctrl-C, a full disk, a killed process), the
/// same call with the same ``out`` resumes it. docs/user/monte-carlo.md describes the files and the statistics.
///
/// :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`.
/// :param runs: number of runs, 1 to 100,000,000.
/// :param seed: seed of the first run, at least 0; 1 by default.
/// :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
///     comma-separated str, or a list.
/// :param threads: number of threads; None: one per core. The results do not depend on it.
/// :param shard: run only part I of N, counted from 0, for example ``"0/4"``; :func:`merge` combines the parts.
/// :param out: folder for the results. None: a temporary folder, deleted together with the batch object.
/// :param progress: called as ``progress(done, of)`` with numbers of runs, several times per second and at the end. An
///     exception that it raises stops the batch.
/// :returns: the complete batch.
/// :raises InputError: if the scenario or an argument is invalid, a seed cannot be run, or ``out`` holds other files.
/// :raises StandoffError: if a run fails, for example because the disk is full; completed runs stay in ``out``.
#[pyfunction]
#[pyo3(signature = (
    scenario, *, runs, seed=Whole(1), metrics=MetricsArg::default(), threads=None, shard=None, out=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
pub(crate) fn monte_carlo(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    runs: Whole,
    seed: Whole,
    metrics: MetricsArg,
    threads: Option<Whole>,
    shard: Option<&str>,
    out: Option<PathBuf>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<Batch>> {
    let (scenario, threads) = (scenario_of(scenario)?, number_of_threads(threads)?);
    let shard = shard.map(str::parse).transpose().map_err(|what| InputError::new_err(format!("shard: {what}")))?;
    let flown = batch(scenario.template(), runs, seed, shard, &metrics)?;
    warn(py, &scenario.drawn(flown.seed_of(flown.flown().start))?)?;
    in_folder(py, out, |out| {
        let (out, template) = (out.to_owned(), scenario.template().clone());
        let fly = move |stop: &AtomicBool, latest: &LatestProgress| {
            let results = fly_into(&out, &template, &flown, threads, stop, |progress| store_progress(latest, progress));
            results.map_err(of_batch).and_then(with_page)
        };
        batch_until_done(py, progress, fly).map(|results| Batch { results, _owner: None })
    })
}

/// Merges the shards of a batch. Writes byte for byte the same files as the batch run in one piece.
///
/// :param dirs: folders of all shards, in any order.
/// :param out: folder for the merged batch. None: a temporary folder, deleted together with the batch object.
/// :returns: the complete batch.
/// :raises InputError: if a shard is missing, incomplete, damaged, duplicated or part of another batch.
#[pyfunction]
#[pyo3(signature = (dirs, *, out=None))]
pub(crate) fn merge(py: Python<'_>, dirs: Vec<PathBuf>, out: Option<PathBuf>) -> PyResult<Py<Batch>> {
    in_folder(py, out, |out| {
        let out = out.to_owned();
        let merge = move |stop: &AtomicBool, _: &LatestProgress| {
            merge_shards(&dirs, &out, stop).map_err(of_batch).and_then(with_page)
        };
        batch_until_done(py, None, merge).map(|results| Batch { results, _owner: None })
    })
}

/// Description of a batch as JSON, for other processes and machines. It fully determines every part of the batch.
#[pyfunction]
pub(crate) fn _described(
    scenario: &Bound<'_, PyAny>,
    runs: Whole,
    seed: Whole,
    metrics: MetricsArg,
) -> PyResult<String> {
    let flown = batch(scenario_of(scenario)?.template(), runs, seed, None, &metrics)?;
    flown.json().map_err(|error| StandoffError::new_err(error.to_string()))
}

/// Compares two batch descriptions made by :func:`_described`. Returns the first difference of ``theirs`` from ``ours``
/// as text, or None if they are equal.
///
/// :param shard: compare with this part of ``ours`` instead of the whole batch, for example ``"0/4"``.
/// :raises InputError: if one text is not a batch description, or was made by another version of standoff.
#[pyfunction]
pub(crate) fn _difference(ours: &str, theirs: &str, shard: Option<&str>) -> PyResult<Option<String>> {
    Ok(part(ours, shard)?.difference(&Flown::from_json(theirs).map_err(refused)?))
}

/// Runs a batch described by :func:`_described`, or one part of it, and writes it to a folder without a report page.
///
/// :param traffic: traffic files to read instead of the scenario's; they must have the same names and contents.
///     Empty: those of the scenario.
#[pyfunction]
pub(crate) fn _fly_described(
    py: Python<'_>,
    described: &str,
    traffic: Vec<PathBuf>,
    shard: Option<&str>,
    threads: Option<Whole>,
    out: PathBuf,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let (flown, threads) = (part(described, shard)?, number_of_threads(threads)?);
    let template = flown.template(&traffic).map_err(refused)?;
    batch_until_done(py, progress, move |stop, latest| {
        let flown = fly_into(&out, &template, &flown, threads, stop, |progress| store_progress(latest, progress));
        flown.map(drop).map_err(of_batch)
    })
}

/// The described batch, or one shard of it.
fn part(described: &str, shard: Option<&str>) -> PyResult<Flown> {
    let whole = Flown::from_json(described).map_err(refused)?;
    let shard = shard.map(str::parse).transpose().map_err(|what: String| InputError::new_err(what))?;
    shard.map_or(Ok(whole.clone()), |shard| whole.part(shard)).map_err(refused)
}

/// Checks the arguments and makes the simulator's batch from them.
fn batch(
    template: &ScenarioTemplate,
    runs: Whole,
    seed: Whole,
    shard: Option<Shard>,
    metrics: &MetricsArg,
) -> PyResult<Flown> {
    let (runs, seed) = (count("runs", runs, 1)?, count("seed", seed, 0)?);
    Flown::new(template, seed, runs, shard, metrics.selection()?).map_err(refused)
}

pub(crate) fn store_progress(latest: &LatestProgress, progress: Progress) {
    *latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
}

/// Adds the report page to the folder of complete results, like the command line does.
fn with_page(results: Results) -> Result<Results, Failure> {
    if let Some(page) = batch_page(&results)? {
        results.add(REPORT, &page).map_err(of_batch)?;
    }
    Ok(results)
}
