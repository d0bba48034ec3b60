//! Missions flown by a policy: the native core of the environments in `standoff.gym` and `standoff.pettingzoo`.

mod actions;
mod observation;
mod reward;
mod vector;
mod world;

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use standoff_io::display_text;

use crate::exceptions::{InputError, ScenarioError, StandoffError, of_scenario};
use crate::scenario::scenario_of;
use observation::{FEATURES, LENGTH};
use vector::{Autoreset, Slot};
use world::{Kind, NoMission, Seeds, World};

/// Maximum number of worlds in one object; more would not fit into memory.
const COUNT_MAX: usize = 100_000;

/// Maximum number of threads.
const THREADS_MAX: usize = 1_024;

/// Width and height of an image, px.
const IMAGE_PX: u32 = 600;

/// Highest seed that a record can store.
const SEED_MAX: u64 = i64::MAX as u64;

/// Independent missions of one scenario (worlds), stepped together and flown by a policy.
///
/// The simulator does the tracking, grouping, assignment and sensor pointing with the built-in algorithms; the policy
/// commands only the turn rate and the speed of the UAVs. Each world runs one mission after another: the first with the
/// seed given to :meth:`reset`, the n-th after it with a seed that depends only on the first seed and on n. A world
/// depends only on scenario, seed and actions, not on the other worlds or the number of threads.
///
/// :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`. All seeds must give
///     the same number of UAVs.
/// :param count: number of worlds, 1 to 100,000.
/// :param autoreset: when the next mission of a world starts after its mission has ended: ``"NextStep"``,
///     ``"SameStep"`` or ``"Disabled"``.
/// :param threads: number of threads, 1 to 1,024; more than 1 pays off from a few hundred UAVs on.
/// :raises ScenarioError: if the scenario is invalid.
/// :raises InputError: if another argument is out of range.
#[pyclass(frozen, module = "standoff._standoff")]
pub(crate) struct Worlds {
    kind: Kind,
    count: usize,
    autoreset: Autoreset,
    threads: usize,
    /// `None` after `close`.
    slots: Mutex<Option<Vec<Slot>>>,
}

/// Current time step of all worlds: the observations for the next decision and the results of the last step.
#[pyclass(frozen, get_all, module = "standoff._standoff")]
pub(crate) struct EnvStep {
    /// Observation of each UAV, from the team state, shape (worlds, UAVs, features); :func:`observation_features`
    /// describes the features.
    observations: Py<PyArray3<f32>>,
    /// Team reward of the last step, 0 to 1, shape (worlds,); 0 if the mission has just started.
    rewards: Py<PyArray1<f64>>,
    /// Reward of each UAV for the last step, 0 to 1, shape (worlds, UAVs).
    uav_rewards: Py<PyArray2<f64>>,
    /// True if targets exist but none has a live track any more, shape (worlds,).
    terminated: Py<PyArray1<bool>>,
    /// True if the mission has reached the scenario's duration, shape (worlds,).
    truncated: Py<PyArray1<bool>>,
    /// Fraction of the existing targets in custody: in a group and truly in some UAV's view, shape (worlds,).
    in_custody: Py<PyArray1<f64>>,
    /// Closeness of each UAV to its group's true orbit, 0 to 1 (1: on the orbit), shape (worlds, UAVs).
    on_orbit: Py<PyArray2<f64>>,
    /// Mean of `on_orbit` over the UAVs, shape (worlds,).
    mean_on_orbit: Py<PyArray1<f64>>,
    /// Mean distance of the UAVs from their groups' true orbits, m, shape (worlds,); 0 if `has_orbit` is False.
    standoff_error_m: Py<PyArray1<f64>>,
    /// True if the group of at least one UAV has a true orbit, shape (worlds,).
    has_orbit: Py<PyArray1<bool>>,
    /// Number of existing targets, shape (worlds,).
    targets: Py<PyArray1<i64>>,
    /// Seed of the mission, shape (worlds,); ``standoff.run(scenario, seed=...)`` simulates the same world.
    seeds: Py<PyArray1<i64>>,
    /// Time since the start of the mission, s, shape (worlds,).
    time_s: Py<PyArray1<f64>>,
    /// Time of the last time step of the mission, s, shape (worlds,).
    duration_s: Py<PyArray1<f64>>,
    /// With ``"SameStep"``: the last time step of the missions that ended in the last step; entries of the other worlds
    /// equal those of this object. ``None`` if no mission ended.
    ended: Option<Py<EnvStep>>,
    /// With ``"SameStep"``: True for worlds whose mission ended in the last step, shape (worlds,).
    has_ended: Py<PyArray1<bool>>,
}

#[pymethods]
impl Worlds {
    #[new]
    #[pyo3(signature = (scenario, *, count=1, autoreset="NextStep", threads=1))]
    fn new(scenario: &Bound<'_, PyAny>, count: i64, autoreset: &str, threads: i64) -> PyResult<Self> {
        let scenario = scenario_of(scenario)?;
        let autoreset = match autoreset {
            "NextStep" => Autoreset::NextStep,
            "SameStep" => Autoreset::SameStep,
            "Disabled" => Autoreset::Disabled,
            _ => {
                let what =
                    format!("autoreset = {}: must be NextStep, SameStep or Disabled", display_text::quoted(autoreset));
                return Err(InputError::new_err(what));
            }
        };
        let within = |what: &str, number: i64, most: usize| {
            let wrong = || InputError::new_err(format!("{what} = {number}: must be between 1 and {most}"));
            usize::try_from(number).ok().filter(|number| (1..=most).contains(number)).ok_or_else(wrong)
        };
        let (count, threads) = (within("count", count, COUNT_MAX)?, within("threads", threads, THREADS_MAX)?);
        let uavs = scenario.drawn(0)?.uavs.len();
        let kind = Kind { template: scenario.template().clone(), uavs };
        let slots = (0..count).map(|_| Slot::default()).collect();
        Ok(Self { kind, count, autoreset, threads, slots: Mutex::new(Some(slots)) })
    }

    /// Number of worlds.
    #[getter]
    fn count(&self) -> usize {
        self.count
    }

    /// Number of UAVs in each world.
    #[getter]
    fn uavs(&self) -> usize {
        self.kind.uavs
    }

    /// Starts missions.
    ///
    /// :param seeds: for each world the seed of its first mission, 0 to 2**63 - 1, or ``None`` to start its next
    ///     mission.
    /// :param mask: for each world whether to reset it; None: reset all.
    /// :returns: the first time step of the missions that start, and the current one of the others.
    /// :raises InputError: if the number of seeds is wrong, a world without an earlier seed gets ``None``, or a world
    ///     would be left without a mission.
    /// :raises ScenarioError: if the scenario cannot be run with one of the seeds. All worlds then stay unchanged.
    #[pyo3(signature = (seeds, *, mask=None))]
    fn reset(&self, py: Python<'_>, seeds: Vec<Option<i128>>, mask: Option<Vec<bool>>) -> PyResult<EnvStep> {
        let mut guard = self.lock()?;
        let slots = open(&mut guard)?;
        let mask = mask.unwrap_or_else(|| vec![true; self.count]);
        for (what, there) in [("seeds", seeds.len()), ("mask", mask.len())] {
            if there != self.count {
                let worlds = self.count;
                let what = format!("{what}: expected one for each of {worlds} worlds, got {there}");
                return Err(InputError::new_err(what));
            }
        }
        let new_seeds = slots.iter().zip(seeds).zip(mask).enumerate().map(|(index, ((slot, seed), is_reset))| {
            if !is_reset {
                let what = || format!("mask: world {index} has no mission yet: reset it too");
                return slot.world.as_ref().map(|_| None).ok_or_else(|| InputError::new_err(what()));
            }
            let first = seed.map(|seed| {
                let within = u64::try_from(seed).ok().filter(|seed| *seed <= SEED_MAX);
                let what = || format!("seeds: {seed} of world {index} must be between 0 and {SEED_MAX}");
                within.map(Seeds::from).ok_or_else(|| InputError::new_err(what()))
            });
            let next = || slot.seeds.map(Seeds::next);
            let what = || format!("seeds: world {index} has no seed yet: reset it with a seed first");
            first.transpose()?.or_else(next).map(Some).ok_or_else(|| InputError::new_err(what()))
        });
        let new_seeds = new_seeds.collect::<PyResult<Vec<_>>>()?;
        py.detach(|| vector::reset(slots, &new_seeds, &self.kind)).map_err(failure)?;
        env_step(py, slots, self.kind.uavs)
    }

    /// Advances all worlds by one time step.
    ///
    /// :param actions: for each world and UAV the turn rate, positive anticlockwise, in units of
    ///     ``turn_rate_max_rad_s``, and the speed difference from the nominal speed, in units of
    ///     ``speed_change_max_m_s``; shape (worlds, UAVs, 2), float32 or float64. Values outside -1 to 1 are clipped.
    /// :returns: the new time step.
    /// :raises InputError: if the actions have the wrong shape or type or a value is not finite, or if a world was not
    ///     reset or, with ``"Disabled"``, its mission is over. All worlds then stay unchanged.
    /// :raises ScenarioError: if the next mission of a world cannot be run; that world must be reset. The other worlds
    ///     have advanced.
    fn step(&self, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<EnvStep> {
        let mut guard = self.lock()?;
        let slots = open(&mut guard)?;
        self.check_ready(slots)?;
        let actions = actions::read(actions, [self.count, self.kind.uavs, 2])?;
        py.detach(|| vector::step(slots, &actions, &self.kind, self.autoreset, self.threads)).map_err(failure)?;
        env_step(py, slots, self.kind.uavs)
    }

    /// Returns the actions that the built-in guidance law would choose at this time step, as a baseline for the policy
    /// in the same worlds and with the same rewards.
    ///
    /// :returns: actions for :meth:`step`, shape (worlds, UAVs, 2), float64.
    /// :raises InputError: if a world was not reset.
    fn law_actions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let mut guard = self.lock()?;
        let worlds = worlds(open(&mut guard)?)?;
        let law = worlds.iter().flat_map(|world| &world.law).copied().collect();
        PyArray1::from_vec(py, law).reshape([self.count, self.kind.uavs, 2])
    }

    /// Draws the map of a world at this time step.
    ///
    /// :param world: index of the world.
    /// :returns: red, green and blue, shape (600, 600, 3), uint8; north is up.
    /// :raises InputError: if the world does not exist or was not reset.
    #[pyo3(signature = (world=0))]
    fn image<'py>(&self, py: Python<'py>, world: usize) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let mut guard = self.lock()?;
        let slot = open(&mut guard)?.get_mut(world).and_then(|slot| slot.world.as_mut());
        let what = || InputError::new_err(format!("world {world} has no mission yet: reset it first"));
        let pixels = slot.ok_or_else(what)?.image(IMAGE_PX).map_err(StandoffError::new_err)?;
        PyArray1::from_vec(py, pixels).reshape([IMAGE_PX as usize, IMAGE_PX as usize, 3])
    }

    /// Frees all worlds. Closing again has no effect; all other methods then raise :class:`InputError`.
    fn close(&self) -> PyResult<()> {
        *self.lock()? = None;
        Ok(())
    }
}

impl Worlds {
    fn lock(&self) -> PyResult<MutexGuard<'_, Option<Vec<Slot>>>> {
        self.slots.try_lock().map_err(|error| {
            StandoffError::new_err(match error {
                TryLockError::WouldBlock => "another thread is using these worlds: use them from one thread at a time",
                TryLockError::Poisoned(_) => "an earlier step of these worlds failed: create new ones",
            })
        })
    }

    /// Raises an error unless every world has a mission that can continue or be restarted.
    fn check_ready(&self, slots: &[Slot]) -> PyResult<()> {
        for (index, world) in worlds(slots)?.iter().enumerate() {
            if world.is_over() && self.autoreset == Autoreset::Disabled {
                return Err(InputError::new_err(format!("the mission of world {index} is over: reset it")));
            }
        }
        Ok(())
    }
}

fn open<'a>(guard: &'a mut MutexGuard<'_, Option<Vec<Slot>>>) -> PyResult<&'a mut Vec<Slot>> {
    guard.as_mut().ok_or_else(|| InputError::new_err("the worlds are closed: create new ones"))
}

/// All worlds; an error if a slot is empty.
fn worlds(slots: &[Slot]) -> PyResult<Vec<&World>> {
    let world = |(index, slot): (usize, &'_ Slot)| -> PyResult<()> {
        let what = || format!("world {index} has no mission yet: reset it first");
        slot.world.as_ref().map(|_| ()).ok_or_else(|| InputError::new_err(what()))
    };
    slots.iter().enumerate().try_for_each(world)?;
    Ok(slots.iter().filter_map(|slot| slot.world.as_ref()).collect())
}

/// The current time step of all worlds, including the missions that ended in the last step.
fn env_step(py: Python<'_>, slots: &[Slot], uavs: usize) -> PyResult<EnvStep> {
    let present = worlds(slots)?;
    let has_ended: Vec<bool> = slots.iter().map(|slot| slot.ended.is_some()).collect();
    let ended = if has_ended.contains(&true) {
        let last = slots.iter().zip(&present).map(|(slot, world)| slot.ended.as_deref().unwrap_or(world));
        let last = arrays(py, &last.collect::<Vec<_>>(), &has_ended, uavs)?;
        Some(Py::new(py, last)?)
    } else {
        None
    };
    Ok(EnvStep { ended, ..arrays(py, &present, &has_ended, uavs)? })
}

/// Collects the state of worlds into arrays.
fn arrays(py: Python<'_>, worlds: &[&World], has_ended: &[bool], uavs: usize) -> PyResult<EnvStep> {
    let count = worlds.len();
    let flat = |of: fn(&World) -> f64| worlds.iter().map(|world| of(world)).collect::<Vec<f64>>();
    let flags = |of: fn(&World) -> bool| worlds.iter().map(|world| of(world)).collect::<Vec<bool>>();
    let observations = worlds.iter().flat_map(|world| &world.observations).copied().collect();
    let on_orbit = worlds.iter().flat_map(|world| &world.score.on_orbit).copied().collect();
    let rewards = flat(World::reward);
    let uav_rewards = worlds.iter().flat_map(|world| world.uav_rewards()).collect();
    Ok(EnvStep {
        observations: PyArray1::from_vec(py, observations).reshape([count, uavs, LENGTH])?.unbind(),
        rewards: PyArray1::from_vec(py, rewards).unbind(),
        uav_rewards: PyArray1::from_vec(py, uav_rewards).reshape([count, uavs])?.unbind(),
        terminated: PyArray1::from_vec(py, flags(|world| world.is_terminated)).unbind(),
        truncated: PyArray1::from_vec(py, flags(|world| world.is_truncated)).unbind(),
        in_custody: PyArray1::from_vec(py, flat(|world| world.score.in_custody)).unbind(),
        on_orbit: PyArray1::from_vec(py, on_orbit).reshape([count, uavs])?.unbind(),
        mean_on_orbit: PyArray1::from_vec(py, flat(|world| world.score.mean_on_orbit())).unbind(),
        standoff_error_m: PyArray1::from_vec(py, flat(|world| world.score.standoff_error_m.unwrap_or(0.0))).unbind(),
        has_orbit: PyArray1::from_vec(py, flags(|world| world.score.standoff_error_m.is_some())).unbind(),
        targets: PyArray1::from_iter(py, worlds.iter().map(|world| world.score.targets as i64)).unbind(),
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
        NoMission::Uavs { name, seed, there, expected } => ScenarioError::new_err(format!(
            "{name}, seed {seed}: {there} UAVs where other seeds have {expected}: actions need a fixed number of UAVs, so \
             set uavs.count to a number"
        )),
    }
}

/// Returns the features of a UAV's observation in order: name, lowest value, highest value and description.
///
/// Distances, speeds and angles are scaled by the scenario's limits, as the description states. Values are clipped to
/// the bounds.
#[pyfunction]
pub(crate) fn observation_features() -> Vec<(&'static str, f32, f32, &'static str)> {
    FEATURES.iter().map(|feature| (feature.name, feature.low, feature.high, feature.meaning)).collect()
}
