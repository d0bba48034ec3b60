//! `compare`: paired comparison of two scenarios, or of two batches, with the same seeds.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;
use standoff_app::{comparison_text, format_errors, of_batch};
use standoff_score::{MetricSelection, Metrics, Scorer};
use standoff_sim::monte_carlo::{Comparison as Flown, compare as compare_scenarios, compare_results};
use standoff_sim::run::fly_while;
use standoff_sim::scenario::{ScenarioTemplate, built_in};

use crate::batch::Batch;
use crate::common_args::{Dict, MetricsArg, Whole, count, json, number_of_threads, warn};
use crate::exceptions::{InputError, StandoffError, of_scenario};
use crate::interruptible::{LatestProgress, batch_until_done, until_done};
use crate::law::{self, LawCalls};
use crate::metrics_table;
use crate::scenario::{Scenario, scenario_of};
use crate::table::Table;

/// Paired comparison of B with A, run by run with the same seeds. The numbers are bit for bit those of ``standoff
/// compare``.
///
/// docs/user/monte-carlo.md explains each number.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Comparison {
    compared: Flown,
    json: String,
}

#[pymethods]
impl Comparison {
    /// Description of A.
    #[getter]
    fn a(&self) -> &str {
        &self.compared.a
    }

    /// Description of B.
    #[getter]
    fn b(&self) -> &str {
        &self.compared.b
    }

    /// First seed.
    #[getter]
    fn seed(&self) -> u64 {
        self.compared.seed
    }

    /// Number of runs of A and of B each.
    #[getter]
    fn runs(&self) -> u64 {
        self.compared.runs
    }

    /// Results of each metric: ``mean_a``, ``mean_b``, ``difference`` (B - A), ``ci95``, ``differs``, ...
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.to_dict(py)?.dict("metrics")
    }

    /// The differences as a table, one row per metric, with ``metric``, ``label``, ``unit``, ``n``, ``mean_a``, ``mean_b``,
    /// ``difference`` (B - A), its interval ``ci95_low`` to ``ci95_high``, ``b_smaller``, ``interest`` and the ``verdict``:
    /// "A better", "B better", "differs", "same" or "unclear". Fractions are 0 to 1, and have, like all numbers without a
    /// unit, the unit 1.
    #[getter]
    fn metrics_table(&self) -> PyResult<Table> {
        metrics_table::of_comparison(&self.compared)
    }

    /// Returns the output of ``standoff compare --json`` as a dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        json(py, &self.json)
    }

    /// Output of ``standoff compare --json``.
    #[getter]
    fn json(&self) -> &str {
        &self.json
    }

    /// The text that ``standoff compare`` prints.
    fn __str__(&self) -> String {
        comparison_text(&self.compared)
    }

    fn __repr__(&self) -> String {
        format!("Comparison(a={:?}, b={:?}, runs={})", self.a(), self.b(), self.runs())
    }

    /// HTML for notebooks: the verdict, and a table with means, differences, intervals and verdicts of all metrics that
    /// have a value.
    fn _repr_html_(this: &Bound<'_, Self>) -> PyResult<String> {
        this.py().import("standoff._frames")?.call_method1("comparison_html", (this,))?.extract()
    }
}

/// One side of a comparison.
enum Compared {
    Folder(PathBuf),
    Scenario(Box<Scenario>),
}

impl Compared {
    fn of(what: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(batch) = what.cast::<Batch>() {
            return Ok(Self::Folder(batch.get().folder().to_owned()));
        }
        match what.extract::<PathBuf>() {
            Ok(path) if path.is_dir() && !is_built_in(&path) => Ok(Self::Folder(path)),
            _ => scenario_of(what).map(Box::new).map(Self::Scenario),
        }
    }
}

fn is_built_in(path: &Path) -> bool {
    path.to_str().is_some_and(|name| built_in(name).is_some())
}

/// Compares two scenarios run with the same seeds, or two complete batches over their common seeds and metrics.
///
/// :param a: a scenario (built-in name, path, or :class:`Scenario`) or a batch (:class:`Batch` or its folder).
/// :param b: the scenario or batch to compare with ``a``. None: the scenario of ``a``.
/// :param runs: number of runs of each scenario, 200 by default; ignored for batches.
/// :param seed: seed of the first run, 1 by default; the following runs use the following seeds. Ignored for batches.
/// :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
///     comma-separated str, or a list.
/// :param threads: number of threads; None: one per core. The results do not depend on it.
/// :param law_a: custom law that controls the UAVs in ``a``, as for :func:`run`. With custom laws, runs are sequential.
/// :param law_b: custom law that controls the UAVs in ``b``.
/// :param law_limit_s: time limit for each call of a custom law, s, above 0.
/// :returns: the comparison, bit for bit equal to the one of ``standoff compare``.
/// :raises InputError: if there is nothing to compare, or a seed cannot be run. Exceptions of a custom law are passed
///     on.
#[pyfunction]
#[pyo3(signature = (
    a, b=None, *, runs=Whole(200), seed=Whole(1), metrics=MetricsArg::default(), threads=None, law_a=None, law_b=None, law_limit_s=10.0
))]
#[expect(clippy::too_many_arguments, reason = "Python callers pass them by keyword")]
pub(crate) fn compare(
    py: Python<'_>,
    a: &Bound<'_, PyAny>,
    b: Option<&Bound<'_, PyAny>>,
    runs: Whole,
    seed: Whole,
    metrics: MetricsArg,
    threads: Option<Whole>,
    law_a: Option<Bound<'_, PyAny>>,
    law_b: Option<Bound<'_, PyAny>>,
    law_limit_s: f64,
) -> PyResult<Comparison> {
    let (selection, threads) = (metrics.selection()?, number_of_threads(threads)?);
    let (runs, seed) = (count("runs", runs, 1)?, count("seed", seed, 0)?);
    let has_law = law_a.is_some() || law_b.is_some();
    if b.is_none() && !has_law {
        return Err(InputError::new_err("nothing to compare: give a second scenario, or a custom law"));
    }
    let compared = match (Compared::of(a)?, Compared::of(b.unwrap_or(a))?) {
        (Compared::Folder(a), Compared::Folder(b)) if !has_law => {
            batch_until_done(py, None, move |stop, _| compare_results(&a, &b, stop).map_err(of_batch))?
        }
        (Compared::Scenario(a), Compared::Scenario(b)) => {
            for scenario in [&a, &b] {
                warn(py, &scenario.drawn(seed)?)?;
            }
            let changes = b.changes_of(&a).to_vec();
            let templates = [a.template().clone(), b.template().clone()];
            let mut compared = if has_law {
                // The limits are those of a batch.
                Batch::check(&templates[0], seed, runs, selection)?;
                let sides = templates.into_iter().zip([law_a, law_b]);
                let sides = sides.map(|(template, law)| Side { template, law: law.map(Bound::unbind) }).collect();
                laws(py, sides, seed..seed + runs, selection, law_limit_s)?
            } else {
                let [one, other] = templates;
                let compare = move |stop: &AtomicBool, _: &LatestProgress| {
                    compare_scenarios(&one, &other, seed, runs, selection, threads, stop).map_err(of_batch)
                };
                batch_until_done(py, None, compare)?
            };
            // The command line describes the changes of --set-b in the same way.
            for change in changes {
                compared.b += &format!(" {change}");
            }
            compared
        }
        (Compared::Folder(_), Compared::Folder(_)) => {
            return Err(InputError::new_err("law_a, law_b: not allowed with batches, whose runs are complete"));
        }
        _ => {
            let what = "compare: a scenario cannot be compared with a batch; give two scenarios, or two batches";
            return Err(InputError::new_err(what));
        }
    };
    let json = compared.json().map_err(|error| StandoffError::new_err(error.to_string()))?;
    Ok(Comparison { compared, json })
}

/// A scenario and the custom law that controls its UAVs; `None`: the built-in controller.
struct Side {
    template: ScenarioTemplate,
    law: Option<Py<PyAny>>,
}

impl Side {
    /// Name of the scenario, and of the custom law if there is one.
    fn name(&self, py: Python<'_>) -> String {
        let called =
            |law: &Py<PyAny>| law.getattr(py, "__name__").map_or_else(|_| "a law".to_owned(), |name| name.to_string());
        let by = self.law.as_ref().map_or_else(String::new, |law| format!(" by {}", called(law)));
        format!("{}{by}", self.template.name())
    }

    /// Runs the scenario with a seed and computes its metrics.
    fn fly(
        &self,
        seed: u64,
        selection: MetricSelection,
        calls: &Arc<LawCalls>,
        go_on: impl Fn() -> bool,
    ) -> PyResult<Metrics> {
        let scenario = self.template.draw(seed).map_err(of_scenario)?;
        let Some(law) = &self.law else {
            return fly_while(&scenario, selection, go_on)
                .map_err(|errors| InputError::new_err(format!("seed {seed}: {}", format_errors(&errors))));
        };
        let mut mission = Python::attach(|py| law::mission(py, &scenario, law.bind(py), calls))?;
        let mut scorer = Scorer::new(mission.score_config(), selection);
        while go_on() && !calls.has_failed() {
            let Some(frame) = mission.frame() else { break };
            scorer.frame(frame);
        }
        // The law's Python objects are released before the result is returned.
        Python::attach(|_| drop(mission));
        calls.take().map_or(Ok(scorer.metrics()), Err)
    }
}

/// Runs both sides with every seed, sequentially.
fn laws(
    py: Python<'_>,
    sides: Vec<Side>,
    seeds: Range<u64>,
    selection: MetricSelection,
    law_limit_s: f64,
) -> PyResult<Flown> {
    let names: Vec<String> = sides.iter().map(|side| side.name(py)).collect();
    let (stop, first) = (Arc::new(AtomicBool::new(false)), seeds.start);
    let calls = LawCalls::within(py, law_limit_s, &stop)?;
    let stopped = Arc::clone(&stop);
    let work = move || {
        let mut metrics = Vec::new();
        for seed in seeds {
            let fly = |side: &Side, which: &str| {
                let metrics = side.fly(seed, selection, &calls, || !stopped.load(Ordering::Relaxed));
                metrics.inspect_err(|error| {
                    // If the note cannot be added, the error is still complete.
                    let _ = Python::attach(|py| error.add_note(py, format!("seed {seed}, {which}")));
                })
            };
            let both = [fly(&sides[0], "law_a")?, fly(&sides[1], "law_b")?];
            if stopped.load(Ordering::Relaxed) {
                break;
            }
            metrics.push(both);
        }
        PyResult::Ok(metrics)
    };
    let ended = until_done(py, &stop, || Ok(()), work)?;
    ended.raised.map_or(Ok(()), Err)?;
    Ok(Flown::of([&names[0], &names[1]], first, selection, &ended.done?))
}
