//! Missions flown by a policy: what the environments of `standoff.gym` and `standoff.pettingzoo` are made of.

mod actions;
mod many;
mod observation;
mod reward;
mod world;

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use standoff_sim::text;

use crate::failure::{InputError, ScenarioError, StandoffError, of_scenario};
use crate::scenario::asked_for;
use many::{Autoreset, Place};
use observation::{FEATURES, LENGTH};
use world::{Kind, NoMission, Seeds, World};

/// Most worlds of one object: more would be more than a machine's memory.
const COUNT_MAX: usize = 100_000;

/// Most threads.
const THREADS_MAX: usize = 1_024;

/// Highest seed: a record's.
const SEED_MAX: u64 = i64::MAX as u64;

/// Missions of one scenario side by side, flown by a policy.
///
/// The mission is the simulator's own: tracking, groups, assignment and where sensors point are the product's; only turn
/// rate and speed of the UAVs are the policy's. World i flies one mission after the other: the first with the seed that
/// it was reset with, the n-th after that with a seed that depends on that and on n alone. What a world does is a function
/// of scenario, seed and actions, whatever there is beside it, on however many threads.
///
/// :param scenario: a built-in name, a path, or a :class:`Scenario`. All seeds must have the same number of UAVs.
/// :param count: number of worlds, 1 to 100,000.
/// :param autoreset: ``"NextStep"``, ``"SameStep"`` or ``"Disabled"``: what happens to a world whose mission is over.
/// :param threads: fly the worlds on so many threads; more than 1 pays from some hundred UAVs on.
/// :raises ScenarioError: the scenario cannot be used.
/// :raises InputError: another argument is out of range.
#[pyclass(frozen, module = "standoff._standoff")]
pub(crate) struct Worlds {
    kind: Kind,
    count: usize,
    autoreset: Autoreset,
    threads: usize,
    /// `None`: closed.
    places: Mutex<Option<Vec<Place>>>,
}

/// An instant of every world: what is to be decided now, and what the last step has come to.
#[pyclass(frozen, get_all, module = "standoff._standoff")]
pub(crate) struct Instant {
    /// What each UAV's team believes; (worlds, UAVs, features), as :func:`observation_features` tells.
    observations: Py<PyArray3<f32>>,
    /// The team's reward of the last step, 0 to 1, (worlds,); 0 where a mission has just begun.
    rewards: Py<PyArray1<f64>>,
    /// Each UAV's reward of the last step, 0 to 1, (worlds, UAVs).
    uav_rewards: Py<PyArray2<f64>>,
    /// No target that exists is known any more, (worlds,).
    terminated: Py<PyArray1<bool>>,
    /// The scenario's duration is over, (worlds,).
    truncated: Py<PyArray1<bool>>,
    /// Share of the existing targets that are in a group and in some UAV's view, by the truth, (worlds,).
    watched: Py<PyArray1<f64>>,
    /// How near each UAV is to its group's true orbit, 0 to 1, (worlds, UAVs).
    on_orbit: Py<PyArray2<f64>>,
    /// Mean of `on_orbit` over the UAVs, (worlds,).
    mean_on_orbit: Py<PyArray1<f64>>,
    /// Mean distance of the UAVs from their groups' true orbits, m, (worlds,); 0 where `has_orbit` is false.
    standoff_error_m: Py<PyArray1<f64>>,
    /// Some UAV's group has a true orbit, (worlds,).
    has_orbit: Py<PyArray1<bool>>,
    /// Targets that exist, (worlds,).
    targets: Py<PyArray1<i64>>,
    /// The seed of the mission: ``standoff.run(scenario, seed=...)`` flies the same world, (worlds,).
    seeds: Py<PyArray1<i64>>,
    /// Time since the start of the mission, s, (worlds,).
    time_s: Py<PyArray1<f64>>,
    /// When the mission is over, s, (worlds,).
    duration_s: Py<PyArray1<f64>>,
    /// With ``"SameStep"``, where a mission ended in the last step: how; elsewhere as this instant. ``None``: none ended.
    ended: Option<Py<Instant>>,
    /// Where that was, (worlds,).
    has_ended: Py<PyArray1<bool>>,
}

#[pymethods]
impl Worlds {
    #[new]
    #[pyo3(signature = (scenario, *, count=1, autoreset="NextStep", threads=1))]
    fn new(scenario: &Bound<'_, PyAny>, count: i64, autoreset: &str, threads: i64) -> PyResult<Self> {
        let scenario = asked_for(scenario)?;
        let autoreset = match autoreset {
            "NextStep" => Autoreset::NextStep,
            "SameStep" => Autoreset::SameStep,
            "Disabled" => Autoreset::Disabled,
            _ => {
                let what = format!("autoreset: {} is none of NextStep, SameStep, Disabled", text::quoted(autoreset));
                return Err(InputError::new_err(what));
            }
        };
        let within = |what: &str, number: i64, most: usize| {
            let wrong = || InputError::new_err(format!("{what}: {number} is not from 1 to {most}"));
            usize::try_from(number).ok().filter(|number| (1..=most).contains(number)).ok_or_else(wrong)
        };
        let (count, threads) = (within("count", count, COUNT_MAX)?, within("threads", threads, THREADS_MAX)?);
        let uavs = scenario.drawn(0)?.uavs.len();
        let kind = Kind { template: scenario.template().clone(), uavs };
        let places = (0..count).map(|_| Place::default()).collect();
        Ok(Self { kind, count, autoreset, threads, places: Mutex::new(Some(places)) })
    }

    /// Number of worlds.
    #[getter]
    fn count(&self) -> usize {
        self.count
    }

    /// Number of UAVs of each.
    #[getter]
    fn uavs(&self) -> usize {
        self.kind.uavs
    }

    /// Begins missions.
    ///
    /// :param seeds: for each world the seed of its first mission, 0 to 2**63 - 1; or ``None``: its next mission.
    /// :param mask: for each world whether it is reset at all; without it, all are.
    /// :returns: the first instant of the missions that begin, and the present one of the others.
    /// :raises InputError: not a seed for each world; ``None`` for one that has had none; a world is left without mission.
    /// :raises ScenarioError: what is drawn for a seed cannot be flown. Then no world has changed.
    #[pyo3(signature = (seeds, *, mask=None))]
    fn reset(&self, py: Python<'_>, seeds: Vec<Option<i128>>, mask: Option<Vec<bool>>) -> PyResult<Instant> {
        let mut guard = self.lock()?;
        let places = open(&mut guard)?;
        let mask = mask.unwrap_or_else(|| vec![true; self.count]);
        for (what, there) in [("seeds", seeds.len()), ("mask", mask.len())] {
            if there != self.count {
                let worlds = self.count;
                return Err(InputError::new_err(format!("{what}: one for each of {worlds} worlds, not {there}")));
            }
        }
        let wanted = places.iter().zip(seeds).zip(mask).enumerate().map(|(index, ((place, seed), is_reset))| {
            if !is_reset {
                let what = || format!("mask: world {index} has no mission yet: reset it, too");
                return place.world.as_ref().map(|_| None).ok_or_else(|| InputError::new_err(what()));
            }
            let first = seed.map(|seed| {
                let within = u64::try_from(seed).ok().filter(|seed| *seed <= SEED_MAX);
                let what = || format!("seeds: {seed} of world {index} is not from 0 to {SEED_MAX}");
                within.map(Seeds::from).ok_or_else(|| InputError::new_err(what()))
            });
            let next = || place.seeds.map(Seeds::next);
            let what = || format!("seeds: world {index} has never had one: reset it with a seed first");
            first.transpose()?.or_else(next).map(Some).ok_or_else(|| InputError::new_err(what()))
        });
        let wanted = wanted.collect::<PyResult<Vec<_>>>()?;
        py.detach(|| many::reset(places, &wanted, &self.kind)).map_err(failure)?;
        instant(py, places, self.kind.uavs)
    }

    /// Flies all worlds until the next instant.
    ///
    /// :param actions: for each world and UAV a turn rate, positive anticlockwise, in ``turn_rate_max_rad_s``, and a
    ///     speed less the nominal one, in ``speed_change_max_m_s``; (worlds, UAVs, 2), float32 or float64. What is beyond
    ///     -1 to 1 is flown at the limit.
    /// :returns: the instant after that.
    /// :raises InputError: actions of another shape or type, or a number that is not finite; a world that was not reset
    ///     or, without autoreset, whose mission is over. Then no world has changed.
    /// :raises ScenarioError: the next mission of a world cannot be flown: it has to be reset. The others have gone on.
    fn step(&self, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<Instant> {
        let mut guard = self.lock()?;
        let places = open(&mut guard)?;
        self.check_ready(places)?;
        let actions = actions::read(actions, [self.count, self.kind.uavs, 2])?;
        py.detach(|| many::step(places, &actions, &self.kind, self.autoreset, self.threads)).map_err(failure)?;
        instant(py, places, self.kind.uavs)
    }

    /// The action that the product's own law would choose at this instant: to compare with, in the same worlds and by the
    /// same rewards.
    ///
    /// :returns: (worlds, UAVs, 2), float64, as :meth:`step` takes it.
    /// :raises InputError: a world was not reset.
    fn law_actions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let mut guard = self.lock()?;
        let worlds = worlds(open(&mut guard)?)?;
        let law = worlds.iter().flat_map(|world| &world.law).copied().collect();
        PyArray1::from_vec(py, law).reshape([self.count, self.kind.uavs, 2])
    }

    /// Frees all worlds. To close again does nothing; anything else is an error from then on.
    fn close(&self) -> PyResult<()> {
        *self.lock()? = None;
        Ok(())
    }
}

impl Worlds {
    fn lock(&self) -> PyResult<MutexGuard<'_, Option<Vec<Place>>>> {
        self.places.try_lock().map_err(|error| {
            StandoffError::new_err(match error {
                TryLockError::WouldBlock => "another thread is using these worlds: one at a time",
                TryLockError::Poisoned(_) => "a step of these worlds has failed: make new ones",
            })
        })
    }

    /// Every world has a mission that can go on.
    fn check_ready(&self, places: &[Place]) -> PyResult<()> {
        for (index, world) in worlds(places)?.iter().enumerate() {
            if world.is_over() && self.autoreset == Autoreset::Disabled {
                return Err(InputError::new_err(format!("the mission of world {index} is over: reset it")));
            }
        }
        Ok(())
    }
}

fn open<'a>(guard: &'a mut MutexGuard<'_, Option<Vec<Place>>>) -> PyResult<&'a mut Vec<Place>> {
    guard.as_mut().ok_or_else(|| InputError::new_err("the worlds are closed: make new ones"))
}

/// The world in every place.
fn worlds(places: &[Place]) -> PyResult<Vec<&World>> {
    let world = |(index, place): (usize, &'_ Place)| -> PyResult<()> {
        let what = || format!("world {index} has no mission yet: reset it first");
        place.world.as_ref().map(|_| ()).ok_or_else(|| InputError::new_err(what()))
    };
    places.iter().enumerate().try_for_each(world)?;
    Ok(places.iter().filter_map(|place| place.world.as_ref()).collect())
}

/// The present instant of all worlds.
fn instant(py: Python<'_>, places: &[Place], uavs: usize) -> PyResult<Instant> {
    let present = worlds(places)?;
    let has_ended: Vec<bool> = places.iter().map(|place| place.ended.is_some()).collect();
    let ended = if has_ended.contains(&true) {
        let last = places.iter().zip(&present).map(|(place, world)| place.ended.as_deref().unwrap_or(world));
        let last = told(py, &last.collect::<Vec<_>>(), &has_ended, uavs)?;
        Some(Py::new(py, last)?)
    } else {
        None
    };
    Ok(Instant { ended, ..told(py, &present, &has_ended, uavs)? })
}

/// What worlds have come to.
fn told(py: Python<'_>, worlds: &[&World], has_ended: &[bool], uavs: usize) -> PyResult<Instant> {
    let count = worlds.len();
    let flat = |of: fn(&World) -> f64| worlds.iter().map(|world| of(world)).collect::<Vec<f64>>();
    let flags = |of: fn(&World) -> bool| worlds.iter().map(|world| of(world)).collect::<Vec<bool>>();
    let observations = worlds.iter().flat_map(|world| &world.observations).copied().collect();
    let on_orbit = worlds.iter().flat_map(|world| &world.worth.on_orbit).copied().collect();
    let rewards = flat(World::reward);
    let uav_rewards = worlds.iter().flat_map(|world| world.uav_rewards()).collect();
    Ok(Instant {
        observations: PyArray1::from_vec(py, observations).reshape([count, uavs, LENGTH])?.unbind(),
        rewards: PyArray1::from_vec(py, rewards).unbind(),
        uav_rewards: PyArray1::from_vec(py, uav_rewards).reshape([count, uavs])?.unbind(),
        terminated: PyArray1::from_vec(py, flags(|world| world.is_terminated)).unbind(),
        truncated: PyArray1::from_vec(py, flags(|world| world.is_truncated)).unbind(),
        watched: PyArray1::from_vec(py, flat(|world| world.worth.watched)).unbind(),
        on_orbit: PyArray1::from_vec(py, on_orbit).reshape([count, uavs])?.unbind(),
        mean_on_orbit: PyArray1::from_vec(py, flat(|world| world.worth.mean_on_orbit())).unbind(),
        standoff_error_m: PyArray1::from_vec(py, flat(|world| world.worth.standoff_error_m.unwrap_or(0.0))).unbind(),
        has_orbit: PyArray1::from_vec(py, flags(|world| world.worth.standoff_error_m.is_some())).unbind(),
        targets: PyArray1::from_iter(py, worlds.iter().map(|world| world.worth.targets as i64)).unbind(),
        seeds: PyArray1::from_iter(py, worlds.iter().map(|world| world.seed as i64)).unbind(),
        time_s: PyArray1::from_vec(py, flat(World::time_s)).unbind(),
        duration_s: PyArray1::from_vec(py, flat(World::duration_s)).unbind(),
        ended: None,
        has_ended: PyArray1::from_slice(py, has_ended).unbind(),
    })
}

fn failure(reason: NoMission) -> PyErr {
    match reason {
        NoMission::Scenario(error) => of_scenario(error),
        NoMission::Parameters { name, seed, errors } => {
            let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
            ScenarioError::new_err(format!("{name}, seed {seed}: {}", errors.join("; ")))
        }
        NoMission::Uavs { name, seed, there, wanted } => ScenarioError::new_err(format!(
            "{name}, seed {seed}: {there} UAVs where other seeds have {wanted}: actions need one number of UAVs, so set \
             uavs.count to a number"
        )),
    }
}

/// The numbers of a UAV's observation, in their order: name, lowest and highest value, and what it is.
///
/// Distances, speeds and angles are in units of the scenario's own limits, as each says; what is beyond a bound is at it.
#[pyfunction]
pub(crate) fn observation_features() -> Vec<(&'static str, f32, f32, &'static str)> {
    FEATURES.iter().map(|feature| (feature.name, feature.low, feature.high, feature.meaning)).collect()
}
