//! `compare`: does a change help? Two scenarios, or two batches, on the same draws.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;
use standoff_results::{of_batch, refused};
use standoff_sim::monte_carlo::{Comparison as Flown, compare as compare_scenarios, compare_results};
use standoff_sim::run::fly_while;
use standoff_sim::scenario::{Template, built_in};
use standoff_sim::score::{Choice, Metrics, Scorer};

use crate::asked_for::{Dict, Wanted, Whole, count, json, number_of_threads, warn};
use crate::batch::Batch;
use crate::failure::{InputError, StandoffError, of_scenario};
use crate::html::{escaped, html_table};
use crate::law::{self, Asked};
use crate::scenario::{Scenario, asked_for};
use crate::waiting::{Told, listening, while_listening};

/// B compared with A, run by run on the same draws: the numbers of ``standoff compare``, to the bit.
///
/// docs/monte-carlo.md says what each number is.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct Comparison {
    json: String,
}

#[pymethods]
impl Comparison {
    /// What A is.
    #[getter]
    fn a(&self, py: Python<'_>) -> PyResult<String> {
        self.to_dict(py)?.get("a")?.extract()
    }

    /// What B is.
    #[getter]
    fn b(&self, py: Python<'_>) -> PyResult<String> {
        self.to_dict(py)?.get("b")?.extract()
    }

    /// The first seed.
    #[getter]
    fn seed(&self, py: Python<'_>) -> PyResult<u64> {
        self.to_dict(py)?.get("seed")?.extract()
    }

    /// Number of runs of each.
    #[getter]
    fn runs(&self, py: Python<'_>) -> PyResult<u64> {
        self.to_dict(py)?.get("runs")?.extract()
    }

    /// For every metric its numbers: ``mean_a``, ``mean_b``, ``difference`` (B - A), ``ci95``, ``differs``, ...
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.to_dict(py)?.dict("metrics")
    }

    /// All of it as a dict: what ``standoff compare --json`` prints.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        json(py, &self.json)
    }

    /// What ``standoff compare --json`` prints.
    #[getter]
    fn json(&self) -> &str {
        &self.json
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Comparison(a={:?}, b={:?}, runs={})", self.a(py)?, self.b(py)?, self.runs(py)?))
    }

    /// As a notebook shows it: a row per metric; * where the difference is of interest.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let columns = ["n", "mean_a", "mean_b", "difference", "b_smaller"];
        let told = format!("A: {}, B: {}, {} runs of each", self.a(py)?, self.b(py)?, self.runs(py)?);
        let table = html_table(py, &self.metrics(py)?, &columns, |numbers| {
            Ok(if numbers.get_item("differs")?.is_truthy()? { " *" } else { "" })
        })?;
        Ok(format!("<p>{}</p>{table}", escaped(py, &told)?))
    }
}

/// What is compared.
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
            _ => asked_for(what).map(Box::new).map(Self::Scenario),
        }
    }
}

fn is_built_in(path: &Path) -> bool {
    path.to_str().is_some_and(|name| built_in(name).is_some())
}

/// Compares two scenarios, flown on the same draws, or two complete batches over the seeds and metrics both have.
///
/// :param a: a scenario (a built-in name, a path, a :class:`Scenario`), or a batch (a :class:`Batch`, its folder).
/// :param b: the same, for what is compared with it. None: the scenario of ``a``.
/// :param runs: number of runs of each scenario, 200 if left out; batches are flown already.
/// :param seed: seed of the first run, 1 if left out; the next has the next.
/// :param metrics: names of metrics and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
///     between, or a list.
/// :param threads: number of threads, one per core if None. The numbers are the same with any number.
/// :param law_a: a law of your own that flies ``a``, as of :func:`run`; runs are then flown one after the other.
/// :param law_b: the same for ``b``.
/// :param law_limit_s: how long a law may take to answer, s, above 0.
/// :returns: the numbers of ``standoff compare``, to the bit.
/// :raises InputError: there is nothing to compare, or a seed cannot be flown. What a law raises comes as it is.
#[pyfunction]
#[pyo3(signature = (
    a, b=None, *, runs=Whole(200), seed=Whole(1), metrics=Wanted::default(), threads=None, law_a=None, law_b=None, law_limit_s=10.0
))]
#[expect(clippy::too_many_arguments, reason = "Python's are named")]
pub(crate) fn compare(
    py: Python<'_>,
    a: &Bound<'_, PyAny>,
    b: Option<&Bound<'_, PyAny>>,
    runs: Whole,
    seed: Whole,
    metrics: Wanted,
    threads: Option<Whole>,
    law_a: Option<Bound<'_, PyAny>>,
    law_b: Option<Bound<'_, PyAny>>,
    law_limit_s: f64,
) -> PyResult<Comparison> {
    let (choice, threads) = (metrics.choice()?, number_of_threads(threads)?);
    let (runs, seed) = (count("runs", runs, 1)?, count("seed", seed, 0)?);
    let has_law = law_a.is_some() || law_b.is_some();
    if b.is_none() && !has_law {
        return Err(InputError::new_err("nothing to compare: name a second scenario, or a law"));
    }
    let compared = match (Compared::of(a)?, Compared::of(b.unwrap_or(a))?) {
        (Compared::Folder(a), Compared::Folder(b)) if !has_law => {
            while_listening(py, None, move |stop, _| compare_results(&a, &b, stop).map_err(of_batch))?
        }
        (Compared::Scenario(a), Compared::Scenario(b)) => {
            for scenario in [&a, &b] {
                warn(py, &scenario.drawn(seed)?)?;
            }
            let changes = b.changes_of(&a).to_vec();
            let templates = [a.template().clone(), b.template().clone()];
            let mut compared = if has_law {
                // The same limits as for a batch.
                Batch::check(&templates[0], seed, runs, choice)?;
                let sides = templates.into_iter().zip([law_a, law_b]);
                let sides = sides.map(|(template, law)| Side { template, law: law.map(Bound::unbind) }).collect();
                laws(py, sides, seed..seed + runs, choice, law_limit_s)?
            } else {
                let [one, other] = templates;
                let compare = move |stop: &AtomicBool, _: &Told| {
                    compare_scenarios(&one, &other, seed, runs, choice, threads, stop).map_err(of_batch)
                };
                while_listening(py, None, compare)?
            };
            // As the command tells what --set-b changes.
            for change in changes {
                compared.b += &format!(" {change}");
            }
            compared
        }
        (Compared::Folder(_), Compared::Folder(_)) => {
            return Err(InputError::new_err("law_a, law_b: the runs of a batch are flown already"));
        }
        _ => {
            let what = "compare: one is a scenario, the other a batch; name two scenarios, or two batches";
            return Err(InputError::new_err(what));
        }
    };
    let json = compared.json().map_err(|error| StandoffError::new_err(error.to_string()))?;
    Ok(Comparison { json })
}

/// What is flown, and by whom if not by the product.
struct Side {
    template: Template,
    law: Option<Py<PyAny>>,
}

impl Side {
    /// What it is called: a law by its name.
    fn name(&self, py: Python<'_>) -> String {
        let called =
            |law: &Py<PyAny>| law.getattr(py, "__name__").map_or_else(|_| "a law".to_owned(), |name| name.to_string());
        let by = self.law.as_ref().map_or_else(String::new, |law| format!(" by {}", called(law)));
        format!("{}{by}", self.template.name())
    }

    /// Flies a seed's run and scores it.
    fn fly(&self, seed: u64, choice: Choice, asked: &Arc<Asked>, go_on: impl Fn() -> bool) -> PyResult<Metrics> {
        let scenario = self.template.draw(seed).map_err(of_scenario)?;
        let Some(law) = &self.law else {
            return fly_while(&scenario, choice, go_on)
                .map_err(|errors| InputError::new_err(format!("seed {seed}: {}", refused(&errors))));
        };
        let mut mission = Python::attach(|py| law::mission(py, &scenario, law.bind(py), asked))?;
        let mut scorer = Scorer::new(mission.rules(), choice);
        while go_on() && !asked.has_failed() {
            let Some(frame) = mission.frame() else { break };
            scorer.frame(frame);
        }
        // The law has gone by then, with all that it holds.
        Python::attach(|_| drop(mission));
        asked.take().map_or(Ok(scorer.metrics()), Err)
    }
}

/// Flies both sides with every seed, one after the other.
fn laws(py: Python<'_>, sides: Vec<Side>, seeds: Range<u64>, choice: Choice, law_limit_s: f64) -> PyResult<Flown> {
    let names: Vec<String> = sides.iter().map(|side| side.name(py)).collect();
    let (stop, first) = (Arc::new(AtomicBool::new(false)), seeds.start);
    let asked = Asked::within(py, law_limit_s, &stop)?;
    let stopped = Arc::clone(&stop);
    let work = move || {
        let mut flown = Vec::new();
        for seed in seeds {
            let fly = |side: &Side, which: &str| {
                let flown = side.fly(seed, choice, &asked, || !stopped.load(Ordering::Relaxed));
                flown.inspect_err(|error| {
                    // Without it, it is the same error.
                    let _ = Python::attach(|py| error.add_note(py, format!("seed {seed}, {which}")));
                })
            };
            let both = [fly(&sides[0], "law_a")?, fly(&sides[1], "law_b")?];
            if stopped.load(Ordering::Relaxed) {
                break;
            }
            flown.push(both);
        }
        PyResult::Ok(flown)
    };
    let ended = listening(py, &stop, || Ok(()), work)?;
    ended.raised.map_or(Ok(()), Err)?;
    Ok(Flown::of([&names[0], &names[1]], first, choice, &ended.done?))
}
