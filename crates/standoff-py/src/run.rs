//! `run`: a scenario flown into a record, and told.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use standoff_results::{Failure, Maps, Telling, Told, Yardsticked, done_unless, fly, has_older_run, refused, tell};
use standoff_sim::run::Mission;
use standoff_sim::score::Choice;
use standoff_sim::text;

use crate::asked_for::{Dict, Wanted, Whole, count, json, small, warn, warning};
use crate::failure::{InputError, StandoffError, raised};
use crate::folder::in_folder;
use crate::html::framed;
use crate::law::{self, Asked};
use crate::scenario::changed_as_asked;
use crate::table::Table;
use crate::waiting::{listening, unless_interrupted};

/// The tables of a record.
const TABLES: [&str; 13] = [
    "uavs",
    "truth",
    "tracks",
    "groups",
    "detections",
    "views",
    "events",
    "intruders",
    "agents",
    "agent_tracks",
    "agent_groups",
    "agent_events",
    "agent_team",
];

/// A run in its folder: its record, and what it came to.
///
/// ``run.uavs``, ``run.truth``, ``run.tracks``, ``run.groups``, ``run.detections``, ``run.views`` and ``run.events`` are its
/// tables (docs/record.md tells their columns). In a notebook it shows itself as the page; ``print`` gives the command's
/// table.
///
/// :param dir: the folder of a run, of ``standoff run`` or :func:`run`; its summary and figures are made anew.
/// :param metrics: names of metrics and sets of them, as of :func:`run`.
/// :raises InputError: there is no record, or it is damaged.
#[pyclass(frozen, weakref, module = "standoff")]
pub(crate) struct Run {
    dir: PathBuf,
    summary: String,
    told: String,
}

/// Everything a flight is given that a thread of its own may take along.
struct Flight {
    scenario: standoff_sim::scenario::Scenario,
    out: PathBuf,
    maps: Maps,
    choice: Choice,
    yardstick: bool,
    notes: Notes,
}

/// What is noteworthy, for warnings.
#[derive(Clone, Default)]
pub(crate) struct Notes(Arc<Mutex<Vec<String>>>);

impl Notes {
    pub(crate) fn say(&self, line: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned());
    }

    /// As warnings of Python.
    pub(crate) fn warn(&self, py: Python<'_>) -> PyResult<()> {
        let notes = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        let told = |note: &String| note.trim_start_matches("note: ").trim_start_matches("warning: ").to_owned();
        notes.iter().map(told).try_for_each(|note| warning(py, &note))
    }
}

impl Flight {
    /// Flies the mission, publishes the record and tells it.
    fn fly<B: standoff_sim::brain::Brain>(
        &self,
        mission: &mut Mission<B>,
        stop: &AtomicBool,
        go_on: impl Fn() -> bool,
    ) -> Result<(String, String), Failure> {
        let say = |line: &str| self.notes.say(line);
        let map = self.maps.of_scenario(&self.scenario, &say)?;
        let closed = fly(&self.scenario, mission, &self.out, map.as_ref(), &say, go_on, |_| {})?;
        let (dir, out, choice, notes) = (closed.dir().to_owned(), self.out.clone(), self.choice, self.notes.clone());
        let (scenario, with_yardstick) = (self.scenario.clone(), self.yardstick);
        let told = done_unless(
            || stop.load(Ordering::Relaxed),
            move || {
                let told = tell(&dir, &out, choice, &|line| notes.say(line))?;
                Ok((told, with_yardstick.then(|| Yardsticked::of(&scenario).yardstick)))
            },
        );
        closed.publish().map_err(Failure::running)?;
        let (Told { mut outcome, written }, yardstick) =
            told.ok_or_else(|| Failure::running(format!("the run is complete in {}", text::path(&self.out))))??;
        written?;
        outcome.yardstick = yardstick;
        let summary = outcome.json().map_err(Failure::running)?;
        Ok((summary, outcome.told(&self.out, Telling { per_target: true, ..Telling::default() })))
    }
}

/// Flies a scenario into a record: the same files, to the byte, as ``standoff run``, and the same numbers.
///
/// :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`Scenario`. None: what the command
///     flies: ``best/figure-9``, or over traffic ``traffic/convoy``.
/// :param seed: seed of everything random, 0 to 2**63 - 1; 1 if left out.
/// :param traffic: fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
/// :param uavs: number of UAVs, started on an orbit about the first targets.
/// :param set: values of the scenario to change, by dotted key.
/// :param metrics: names of docs/metrics.md and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
///     between, or a list.
/// :param out: folder for the results. None: a temporary one, which goes with the run.
/// :param maps: SUMO nets or GeoJSON to show under the vehicles.
/// :param law: a law of your own that flies in the place of the product: a class like :class:`Law`, or whatever is called
///     with a :class:`Briefing` and gives an object that decides.
/// :param law_limit_s: how long a law may take to answer, s, above 0.
/// :param yardstick: tell beside it what greedy discs that know where every target is would watch.
/// :returns: the run.
/// :raises ScenarioError: the scenario cannot be used; what is wrong is drawn under what was typed.
/// :raises InputError: another argument is wrong, or ``out`` holds something else.
/// :raises StandoffError: something failed while running: the disk, a law that never answers. What a law raises comes as it
///     is. A note says what is kept of the run.
#[pyfunction]
#[pyo3(signature = (
    scenario=None, *, seed=Whole(1), traffic=None, uavs=None, set=None, metrics=Wanted::default(), out=None, maps=vec![],
    law=None, law_limit_s=10.0, yardstick=false
))]
#[expect(clippy::too_many_arguments, reason = "Python's are named")]
pub(crate) fn run(
    py: Python<'_>,
    scenario: Option<&Bound<'_, PyAny>>,
    seed: Whole,
    traffic: Option<PathBuf>,
    uavs: Option<Whole>,
    set: Option<Dict<'_>>,
    metrics: Wanted,
    out: Option<PathBuf>,
    maps: Vec<PathBuf>,
    law: Option<&Bound<'_, PyAny>>,
    law_limit_s: f64,
    yardstick: bool,
) -> PyResult<Py<Run>> {
    let scenario =
        changed_as_asked(scenario, traffic, small("uavs", uavs)?, set.as_ref())?.drawn(count("seed", seed, 0)?)?;
    let choice = metrics.choice()?;
    warn(py, &scenario)?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = law.map(|_| Asked::within(py, law_limit_s, &stop)).transpose()?;
    let law = law.map(|law| law.clone().unbind());
    let is_named = out.is_some();
    in_folder(py, out, |out| {
        // Without a slash at its end: a link to a folder would be followed half of the way.
        let out: PathBuf = out.components().collect();
        let notes = Notes::default();
        if has_older_run(&scenario, &out).map_err(|failure| raised(&failure))? {
            notes.say(&format!("note: replacing the older run in {}", out.display()));
        }
        let (asking, stopped) = (asked.clone(), Arc::clone(&stop));
        let flight = Flight { scenario, out: out.clone(), maps: Maps(maps), choice, yardstick, notes: notes.clone() };
        let work = move || {
            let goes_on = || !stopped.load(Ordering::Relaxed);
            let Some((law, asked)) = law.zip(asking) else {
                let mission = Mission::scored_by(&flight.scenario, flight.choice);
                let mut mission = mission.map_err(|errors| Failure::Input(refused(&errors)))?;
                return flight.fly(&mut mission, &stopped, goes_on);
            };
            match Python::attach(|py| law::mission(py, &flight.scenario, law.bind(py), &asked)) {
                Ok(mut mission) => flight.fly(&mut mission, &stopped, || goes_on() && !asked.has_failed()),
                Err(error) => {
                    asked.fail(error);
                    Err(Failure::running("nothing was flown"))
                }
            }
        };
        let ended = listening(py, &stop, || Ok(()), work)?;
        notes.warn(py)?;
        let came = ended.raised.or_else(|| asked.and_then(|asked| asked.take()));
        match (ended.done, came) {
            (Ok((summary, told)), None) => Ok(Run { dir: out, summary, told }),
            (Err(failure), None) => Err(raised(&failure)),
            // What was raised comes first: that the run ended follows from it.
            (done, Some(error)) => {
                if let (Err(failure), true) = (&done, is_named) {
                    error.add_note(py, failure.told(false).join("\n"))?;
                }
                Err(error)
            }
        }
    })
}

/// What greedy discs that know where every target is would watch: the numbers of ``standoff yardstick``.
///
/// :param scenario: as of :func:`run`, as are the other parameters.
/// :returns: ``{"scenario", "seed", "duration_s", "uavs", "targets", "yardstick": {"disc_radius_m", "half", "all"}}``.
/// :raises ScenarioError: the scenario cannot be used.
#[pyfunction]
#[pyo3(signature = (scenario=None, *, seed=Whole(1), traffic=None, uavs=None, set=None))]
pub(crate) fn yardstick<'py>(
    py: Python<'py>,
    scenario: Option<&Bound<'py, PyAny>>,
    seed: Whole,
    traffic: Option<PathBuf>,
    uavs: Option<Whole>,
    set: Option<Dict<'py>>,
) -> PyResult<Dict<'py>> {
    let scenario =
        changed_as_asked(scenario, traffic, small("uavs", uavs)?, set.as_ref())?.drawn(count("seed", seed, 0)?)?;
    warn(py, &scenario)?;
    let done = unless_interrupted(py, move || Yardsticked::of(&scenario).json())?;
    json(py, &done.map_err(|error| StandoffError::new_err(error.to_string()))?)
}

#[pymethods]
impl Run {
    #[new]
    #[pyo3(signature = (dir, *, metrics=Wanted::default()))]
    fn new(py: Python<'_>, dir: PathBuf, metrics: Wanted) -> PyResult<Self> {
        let (choice, notes) = (metrics.choice()?, Notes::default());
        let (place, say) = (dir.clone(), notes.clone());
        let work = move || -> Result<_, Failure> {
            let Told { outcome, written } = tell(&place, &place, choice, &|line| say.say(line))?;
            written?;
            let told = outcome.told(&place, Telling { per_target: true, ..Telling::default() });
            Ok((outcome.json().map_err(Failure::running)?, told))
        };
        let done = unless_interrupted(py, work)?;
        notes.warn(py)?;
        let (summary, told) = done.map_err(|failure| raised(&failure))?;
        Ok(Self { dir, summary, told })
    }

    /// The folder of the run.
    #[getter]
    fn dir(&self) -> &Path {
        &self.dir
    }

    /// ``summary.json`` as a dict: what was flown, metrics, events, how each target fared.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        json(py, &self.summary)
    }

    /// What the run came to: a float by the name of each metric, None where there was nothing to measure.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Dict<'py>> {
        self.summary(py)?.dict("metrics")
    }

    /// The scenario that was flown, every value drawn and spelt out, TOML.
    #[getter]
    fn scenario_toml(&self) -> PyResult<String> {
        let path = self.dir.join("scenario.toml");
        fs::read_to_string(&path).map_err(|reason| InputError::new_err(format!("{}: {reason}", path.display())))
    }

    /// A table of the record.
    ///
    /// :param name: ``uavs``, ``truth``, ``tracks``, ``groups``, ``detections``, ``views`` or ``events``; where there were any,
    ///     ``intruders``, too; where several minds flew, ``agents``, ``agent_tracks``, ``agent_groups``, ``agent_events`` or
    ///     ``agent_team``.
    /// :raises KeyError: there is no table of that name.
    fn table(this: &Bound<'_, Self>, name: &str) -> PyResult<Table> {
        if !TABLES.contains(&name) {
            return Err(PyKeyError::new_err(format!("no table {name:?}; there are {}", TABLES.join(", "))));
        }
        Table::open(&this.get().dir.join(format!("{name}.parquet")), Some(this.clone().into_any().unbind()))
    }

    /// Each UAV at each instant.
    #[getter]
    fn uavs(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "uavs")
    }

    /// Each target as it really was.
    #[getter]
    fn truth(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "truth")
    }

    /// Each track: what the team believed of a target.
    #[getter]
    fn tracks(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "tracks")
    }

    /// Each group and the orbit about it.
    #[getter]
    fn groups(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "groups")
    }

    /// What the sensors said.
    #[getter]
    fn detections(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "detections")
    }

    /// Which targets were in whose view.
    #[getter]
    fn views(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "views")
    }

    /// What happened.
    #[getter]
    fn events(this: &Bound<'_, Self>) -> PyResult<Table> {
        Self::table(this, "events")
    }

    fn __str__(&self) -> &str {
        &self.told
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let summary = self.summary(py)?;
        let (scenario, seed) = (summary.get("scenario")?, summary.get("seed")?);
        Ok(format!("Run({scenario}, seed {seed}, {:?})", self.dir))
    }

    /// As a notebook shows it: the page that replays it.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Ok(page) = fs::read_to_string(self.dir.join("report.html")) else { return Ok(None) };
        framed(py, &page).map(Some)
    }
}
