//! Many runs of one scenario: `monte_carlo`, `merge`, and the batch that comes of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use standoff_results::{Failure, REPORT, of_batch, report};
use standoff_sim::monte_carlo::{Batch as Flown, Progress, Results, Shard, fly_into, merge as merge_shards};
use standoff_sim::scenario::Template;
use standoff_sim::score::Choice;

use crate::asked_for::{Dict, Wanted, Whole, count, json, number_of_threads, warn};
use crate::failure::{InputError, StandoffError, of_batch as refused};
use crate::folder::in_folder;
use crate::html::{framed, html_table};
use crate::scenario::asked_for;
use crate::table::Table;
use crate::waiting::{Told, while_listening};

/// A complete batch of runs, in its folder.
///
/// :param dir: the folder of a complete batch, of ``standoff monte-carlo``, :func:`monte_carlo` or :func:`merge`.
/// :raises InputError: there is none, or it was changed since it was written.
#[pyclass(frozen, weakref, module = "standoff")]
pub(crate) struct Batch {
    results: Results,
}

impl Batch {
    /// Refuses numbers of runs and seeds that no batch can have.
    pub(crate) fn check(template: &Template, seed: u64, runs: u64, choice: Choice) -> PyResult<()> {
        Flown::new(template, seed, runs, None, choice).map(drop).map_err(refused)
    }

    pub(crate) fn folder(&self) -> &Path {
        self.results.dir()
    }

    /// The text of one of its files, if it is there.
    fn file(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.folder().join(name)).ok()
    }
}

#[pymethods]
impl Batch {
    #[new]
    fn new(py: Python<'_>, dir: PathBuf) -> PyResult<Self> {
        Ok(Self { results: py.detach(|| Results::open(&dir)).map_err(refused)? })
    }

    /// The folder: ``runs.parquet``, ``summary.json``, ``monte-carlo.json``, ``report.html``.
    #[getter]
    fn dir(&self) -> PathBuf {
        self.folder().to_owned()
    }

    /// ``summary.json`` as a dict: what was flown, and the statistics of every metric.
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

    /// For every metric its statistics over the runs: ``n``, ``mean``, ``ci95``, ``sd``, ``p5``, ``p50``, ``p95``, ``max``.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.summary(py)?.dict("metrics")
    }

    /// ``runs.parquet``: a row per run, in order, with ``run``, ``seed`` and a column per metric.
    #[getter]
    fn runs(this: &Bound<'_, Self>) -> PyResult<Table> {
        Table::open(&this.get().folder().join("runs.parquet"), Some(this.clone().into_any().unbind()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (summary, batch) = (self.summary(py)?, self.results.batch());
        let (runs, scenario) = (batch.flown(), summary.get("scenario")?);
        Ok(format!("Batch({scenario}, {} runs, {:?})", runs.end - runs.start, self.folder()))
    }

    /// As a notebook shows it: its page, or else its statistics.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        if let Some(page) = self.file("report.html") {
            return framed(py, &page);
        }
        html_table(py, &self.metrics(py)?, &["n", "mean", "sd", "p5", "p50", "p95", "max"], |_| Ok(""))
    }
}

/// Flies a scenario many times; the same files, to the byte, as ``standoff monte-carlo``.
///
/// Run k, from 0, has ``seed + k``. Whatever stops it (Ctrl-C, a full disk, the end of the process), the same call with
/// the same ``out`` goes on where it was. docs/monte-carlo.md tells of files and statistics.
///
/// :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`Scenario`.
/// :param runs: number of runs, 1 to 100,000,000.
/// :param seed: seed of the first run, from 0; 1 if left out.
/// :param metrics: names of metrics and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
///     between, or a list.
/// :param threads: number of threads, one per core if None. The results are the same with any number.
/// :param shard: fly only part I of N, from 0: ``"0/4"``; :func:`merge` puts the parts together.
/// :param out: folder for the results. None: a temporary one, which goes with the batch.
/// :param progress: called as ``progress(done, of)``, runs, some times a second and at the end. What it raises stops the batch.
/// :returns: the complete batch.
/// :raises InputError: the scenario or an argument is wrong, a seed cannot be flown, or ``out`` holds something else.
/// :raises StandoffError: something failed while running; runs that are complete are kept in ``out``.
#[pyfunction]
#[pyo3(signature = (
    scenario, *, runs, seed=Whole(1), metrics=Wanted::default(), threads=None, shard=None, out=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "Python's are named")]
pub(crate) fn monte_carlo(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    runs: Whole,
    seed: Whole,
    metrics: Wanted,
    threads: Option<Whole>,
    shard: Option<&str>,
    out: Option<PathBuf>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<Batch>> {
    let (scenario, threads) = (asked_for(scenario)?, number_of_threads(threads)?);
    let shard = shard.map(str::parse).transpose().map_err(|what| InputError::new_err(format!("shard: {what}")))?;
    let flown = batch(scenario.template(), runs, seed, shard, &metrics)?;
    warn(py, &scenario.drawn(flown.seed_of(flown.flown().start))?)?;
    in_folder(py, out, |out| {
        let (out, template) = (out.to_owned(), scenario.template().clone());
        let fly = move |stop: &AtomicBool, told: &Told| {
            let results = fly_into(&out, &template, &flown, threads, stop, |progress| tell(told, progress));
            results.map_err(of_batch).and_then(with_page)
        };
        while_listening(py, progress, fly).map(|results| Batch { results })
    })
}

/// Puts the shards of a batch together: the same files, to the byte, as of the batch in one piece.
///
/// :param dirs: the folders of all shards, in any order.
/// :param out: folder for the whole batch. None: a temporary one, which goes with the batch.
/// :returns: the complete batch.
/// :raises InputError: a shard is missing, incomplete, damaged, there twice or of another batch.
#[pyfunction]
#[pyo3(signature = (dirs, *, out=None))]
pub(crate) fn merge(py: Python<'_>, dirs: Vec<PathBuf>, out: Option<PathBuf>) -> PyResult<Py<Batch>> {
    in_folder(py, out, |out| {
        let out = out.to_owned();
        let merge =
            move |stop: &AtomicBool, _: &Told| merge_shards(&dirs, &out, stop).map_err(of_batch).and_then(with_page);
        while_listening(py, None, merge).map(|results| Batch { results })
    })
}

/// What is flown, as text for other processes and machines: every part of a batch is a function of it.
#[pyfunction]
pub(crate) fn _described(scenario: &Bound<'_, PyAny>, runs: Whole, seed: Whole, metrics: Wanted) -> PyResult<String> {
    let flown = batch(asked_for(scenario)?.template(), runs, seed, None, &metrics)?;
    flown.json().map_err(|error| StandoffError::new_err(error.to_string()))
}

/// In what the batch ``theirs`` differs from ``ours``, in words; None if it does not. Both as :func:`_described` tells
/// them, ``ours`` whole or one of its parts.
///
/// :raises InputError: one is no batch, or one of another version of standoff.
#[pyfunction]
pub(crate) fn _difference(ours: &str, theirs: &str, shard: Option<&str>) -> PyResult<Option<String>> {
    Ok(part(ours, shard)?.difference(&Flown::of_json(theirs).map_err(refused)?))
}

/// Flies what :func:`_described` tells, or one part of it, into a folder; without a page.
///
/// :param traffic: stands in for the scenario's traffic file; it must hold the same.
#[pyfunction]
pub(crate) fn _fly_described(
    py: Python<'_>,
    described: &str,
    traffic: Option<PathBuf>,
    shard: Option<&str>,
    threads: Option<Whole>,
    out: PathBuf,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let (flown, threads) = (part(described, shard)?, number_of_threads(threads)?);
    let template = flown.template(traffic.as_deref()).map_err(refused)?;
    while_listening(py, progress, move |stop, told| {
        let flown = fly_into(&out, &template, &flown, threads, stop, |progress| tell(told, progress));
        flown.map(drop).map_err(of_batch)
    })
}

fn part(described: &str, shard: Option<&str>) -> PyResult<Flown> {
    let whole = Flown::of_json(described).map_err(refused)?;
    let shard = shard.map(str::parse).transpose().map_err(|what: String| InputError::new_err(what))?;
    shard.map_or(Ok(whole.clone()), |shard| whole.part(shard)).map_err(refused)
}

/// What is asked for, as the simulator flies it.
fn batch(template: &Template, runs: Whole, seed: Whole, shard: Option<Shard>, metrics: &Wanted) -> PyResult<Flown> {
    let (runs, seed) = (count("runs", runs, 1)?, count("seed", seed, 0)?);
    Flown::new(template, seed, runs, shard, metrics.choice()?).map_err(refused)
}

fn tell(told: &Told, progress: Progress) {
    *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
}

/// Puts the page beside complete results, as the command does.
fn with_page(results: Results) -> Result<Results, Failure> {
    if let Some(page) = report(&results)? {
        results.add(REPORT, &page).map_err(of_batch)?;
    }
    Ok(results)
}
