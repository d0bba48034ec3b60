//! Laws written in Python, as brains: the simulator asks them what it asks the product.

mod asked;
mod believed;
mod seen;

use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFrozenSet, PyList, PyTuple};
use standoff::{
    AssignmentLaw, AvailableUav, Command as Flown, Cue, Diagnostics, Duty, Fleet, GroupId, LimitedCommand, LookAt,
    Message, Observation, Position, Report, Scan, Site, Step, Time, Traffic, UavId, UavParams, UavState, Velocity,
};
use standoff_sim::brain::{Beliefs, Brain, Reported, TrackRow};
use standoff_sim::rows_of_picture;
use standoff_sim::run::Mission;
use standoff_sim::scenario::Scenario;

pub(crate) use asked::Asked;
pub(crate) use believed::Tracks;
pub(crate) use seen::{Briefing, Choice, Command, Cued, Heard, Intruder, Observed, Picture, Zone};

use crate::failure::InputError;

/// What a law takes the place of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Replaces {
    All,
    Guidance,
    Assignment,
}

/// What a law says of itself: class attributes of `standoff.Law`.
#[derive(Clone, Copy)]
struct Kind {
    replaces: Replaces,
    /// It decides for all UAVs at once.
    is_team_s: bool,
    /// It sees the team's picture, which the product keeps.
    sees_picture: bool,
    /// It tells what it believes of targets.
    has_tracks: bool,
}

impl Kind {
    fn of(law: &Bound<'_, PyAny>) -> PyResult<Self> {
        let says = |attribute: &str, allowed: &[&str], default: usize| -> PyResult<usize> {
            let Some(said) = law.getattr_opt(attribute)? else { return Ok(default) };
            let place = said.extract::<String>().ok().and_then(|said| allowed.iter().position(|one| *one == said));
            place.ok_or_else(|| {
                let allowed = allowed.join(", ");
                PyValueError::new_err(format!("{law}: {attribute} is {said}; it is one of {allowed}"))
            })
        };
        let replaces = match says("replaces", &["all", "guidance", "assignment"], 0)? {
            0 => Replaces::All,
            1 => Replaces::Guidance,
            _ => Replaces::Assignment,
        };
        let is_team_s = says("decides_for", &["agent", "team"], 0)? == 1;
        let sees_picture = says("sees", &["own", "picture"], 0)? == 1;
        if !law.getattr_opt("decide")?.is_some_and(|decide| decide.is_callable()) {
            return Err(PyTypeError::new_err(format!("{law} has no method decide: see standoff.Law")));
        }
        let is_team_s = is_team_s || replaces == Replaces::Assignment;
        let has_tracks = law.getattr_opt("tracks")?.is_some_and(|tracks| tracks.is_callable());
        Ok(Self { replaces, is_team_s, sees_picture, has_tracks })
    }

    /// The product estimates and forms groups beside it.
    fn has_fleet(self) -> bool {
        self.sees_picture || self.replaces != Replaces::All
    }
}

/// A mission flown by what `law` makes: a class, or whatever is called with a [`Briefing`] and gives an object that decides.
pub(crate) fn mission(
    py: Python<'_>,
    scenario: &Scenario,
    law: &Bound<'_, PyAny>,
    asked: &Arc<Asked>,
) -> PyResult<Mission<OwnLaw>> {
    if !law.is_callable() {
        let what = "law: is a class, or whatever is called with a Briefing and gives a law; not a law itself, which would \
                    carry what it knows from one run into the next";
        return Err(PyTypeError::new_err(what));
    }
    let uavs = scenario.uavs.len();
    let nothing = PyTuple::empty(py);
    let make = |uav: Option<u32>| {
        let briefing = (Briefing::of(py, scenario, uav)?,).into_pyobject(py)?;
        asked.ask(law, briefing, "made", nothing.clone()).map(Bound::unbind)
    };
    let kind = Kind::of(&whose(law, || make(Some(0)))?)?;
    let laws = if kind.is_team_s {
        vec![make(None)?]
    } else {
        (0..uavs as u32).map(|uav| make(Some(uav))).collect::<PyResult<_>>()?
    };
    let team = scenario.settings.team;
    let refused = |errors: Vec<standoff::ParamError>| {
        InputError::new_err(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    };
    let fleet = kind.has_fleet().then(|| Fleet::new(team)).transpose().map_err(refused)?;
    let fleet = fleet.map(|fleet| fleet.with_airspace(scenario.settings.airspace.clone()));
    let fleet = match (fleet, kind.replaces) {
        (Some(fleet), Replaces::Assignment) => {
            Some(fleet.assigned_by(Arc::new(OwnAssignment { law: laws[0].clone_ref(py), asked: Arc::clone(asked) })))
        }
        (fleet, _) => fleet,
    };
    let seen = scenario.uavs.iter().map(|state| Seen { own: *state, ..Seen::default() }).collect();
    let brain = OwnLaw {
        kind,
        limits: team.uav,
        laws,
        fleet,
        seen,
        asked: Arc::clone(asked),
        answered: None,
        now: Time::START,
        picture: None,
    };
    Mission::with_brain(scenario, brain).map_err(refused)
}

/// What tells of a law: its class, also in `functools.partial`; else one that is made.
fn whose<'py>(law: &Bound<'py, PyAny>, make: impl FnOnce() -> PyResult<Py<PyAny>>) -> PyResult<Bound<'py, PyAny>> {
    for class in [Some(law.clone()), law.getattr_opt("func")?].into_iter().flatten() {
        if class.hasattr("decide")? {
            return Ok(class);
        }
    }
    make().map(|made| made.into_bound(law.py()))
}

/// What a UAV has seen and heard at an instant.
struct Seen {
    own: UavState,
    /// `None`: it is out.
    report: Option<Message>,
    heard: Vec<Report>,
    cues: Vec<Cue>,
    traffic: Vec<Traffic>,
    /// As the product took it in.
    observation: Option<Observation>,
}

impl Default for Seen {
    fn default() -> Self {
        let own = UavState::straight(Position::ORIGIN, standoff::Angle::ZERO, 0.0);
        Self { own, report: None, heard: Vec::new(), cues: Vec::new(), traffic: Vec::new(), observation: None }
    }
}

/// As near to a bound as rounding leaves what is at it.
const AT_BOUND: f64 = 1e-9;

/// A law written in Python, as a brain.
pub(crate) struct OwnLaw {
    kind: Kind,
    limits: UavParams,
    /// One for each UAV, or one for all.
    laws: Vec<Py<PyAny>>,
    fleet: Option<Fleet>,
    seen: Vec<Seen>,
    asked: Arc<Asked>,
    /// What a team's law answered at this instant, by UAV.
    answered: Option<Vec<Option<Answer>>>,
    now: Time,
    /// The picture of this instant, once somebody has asked.
    picture: Option<Py<Picture>>,
}

/// What a law wants of a UAV.
#[derive(Clone, Copy)]
struct Answer {
    command: Flown,
    look_at: Option<LookAt>,
    altitude_m: Option<f64>,
    group: Option<u32>,
}

impl Brain for OwnLaw {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        (self.now, self.answered, self.picture) = (now, None, None);
        let observation = self.fleet.as_mut().map(|fleet| fleet.observe(now, uav, own, scan));
        let report = scan.map(|scan| {
            let Scan { boresight, detections } = scan;
            // Nobody starts anew in a mission: its clock counts the instants.
            let sequence = u32::try_from(now.us() / 1000).unwrap_or(u32::MAX);
            let detections = detections.to_vec();
            Message::Report(Report { sequence, boresight, detections, ..Report::of(uav, now, *own) })
        });
        if let Some(seen) = self.seen.get_mut(uav.0 as usize) {
            *seen = Seen { own: *own, report, observation, ..Seen::default() };
        }
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        // Who only assigns has no use for it.
        let said = self.seen.get(uav.0 as usize).filter(|_| self.kind.replaces != Replaces::Assignment);
        said.map_or(&[], |seen| seen.report.as_slice())
    }

    fn hear(&mut self, uav: UavId, message: &Message) {
        let Some(seen) = self.seen.get_mut(uav.0 as usize) else { return };
        match message {
            Message::Report(report) => seen.heard.push(report.clone()),
            Message::Cue(cue) => seen.cues.push(*cue),
            Message::Traffic(traffic) => seen.traffic.push(*traffic),
            // A law's own minds tell one another nothing of the kind.
            Message::Snapshot(_) => {}
        }
        // Whatever one hears from outside the team, all have heard.
        if let (Message::Cue(_) | Message::Traffic(_), Some(fleet), Some(observation), 0) =
            (message, &mut self.fleet, &seen.observation, uav.0)
        {
            fleet.hear(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> Step {
        let own = self.seen.get(uav.0 as usize).map(|seen| seen.own);
        let straight = Flown { speed_m_s: own.map_or(0.0, |own| own.speed_m_s), turn_rate_rad_s: 0.0 };
        let observation = self.seen.get(uav.0 as usize).and_then(|seen| seen.observation);
        let ours = match (&mut self.fleet, observation) {
            (Some(fleet), Some(observation)) => Some(fleet.decide(&observation)),
            _ => None,
        };
        let step = ours.unwrap_or(Step::of(straight));
        if self.kind.replaces == Replaces::Assignment || self.asked.has_failed() {
            return step;
        }
        let answer = Python::attach(|py| self.answer(py, uav, ours.as_ref())).unwrap_or_else(|error| {
            self.asked.fail(error);
            None
        });
        let Some(Answer { command, look_at, altitude_m, group }) = answer else { return step };
        let group_number = group.or(step.diagnostics.group_number);
        // What a law that knows the limits asks for at a bound, one that does not would ask for beyond: both are limited.
        let beyond = |wanted: Flown| Flown {
            speed_m_s: wanted.speed_m_s + AT_BOUND * (wanted.speed_m_s - self.limits.speed_m_s),
            turn_rate_rad_s: wanted.turn_rate_rad_s * (1.0 + AT_BOUND),
        };
        let LimitedCommand { speed_limited, turn_rate_limited, .. } = self.limits.limit(beyond(command));
        Step {
            command,
            look_at: look_at.or(step.look_at),
            altitude_m: altitude_m.or(step.altitude_m),
            diagnostics: Diagnostics { group_number, speed_limited, turn_rate_limited, ..step.diagnostics },
        }
    }

    fn reported(&self) -> Reported {
        if self.fleet.is_some() {
            Reported::default()
        } else {
            Reported { tracks: self.kind.has_tracks, ..Reported::NOTHING }
        }
    }

    fn report(&self, beliefs: &mut Beliefs) {
        if let Some(fleet) = &self.fleet {
            rows_of_picture(fleet.picture(), beliefs);
        } else if self.kind.has_tracks && !self.asked.has_failed() {
            match Python::attach(|py| self.tracks(py)) {
                Ok(tracks) => beliefs.tracks.extend(tracks),
                Err(error) => self.asked.fail(error),
            }
        }
    }
}

impl OwnLaw {
    /// What the law wants of a UAV; `None`: what the product would do, or straight on.
    fn answer(&mut self, py: Python<'_>, uav: UavId, ours: Option<&Step>) -> PyResult<Option<Answer>> {
        let place = uav.0 as usize;
        if !self.kind.is_team_s {
            let observed = (self.observed(py, place, ours)?,).into_pyobject(py)?;
            let law = self.laws[place].bind(py);
            let answer = self.asked.ask(&law.getattr("decide")?, observed, "command", whose_is(law)?)?;
            return self.answer_of(&answer);
        }
        if self.answered.is_none() {
            let mut all = Vec::new();
            for place in 0..self.seen.len() {
                // The product answers for the others first: whoever decides for all sees what it would do.
                let ours = match (&mut self.fleet, self.seen[place].observation) {
                    (Some(fleet), Some(observation)) => Some(fleet.decide(&observation)),
                    _ => None,
                };
                all.push(self.observed(py, place, ours.as_ref())?);
            }
            let law = self.laws[0].bind(py);
            let (observed, uavs) = ((PyList::new(py, all)?,).into_pyobject(py)?, self.seen.len());
            let how = (name(law)?, uavs).into_pyobject(py)?;
            let answers = self.asked.ask(&law.getattr("decide")?, observed, "commands", how)?;
            let answers = answers.try_iter()?.map(|answer| self.answer_of(&answer?)).collect::<PyResult<_>>()?;
            self.answered = Some(answers);
        }
        Ok(self.answered.as_ref().and_then(|answers| *answers.get(place)?))
    }

    /// What the law believes of targets: a team's law, or the first UAV's.
    fn tracks(&self, py: Python<'_>) -> PyResult<Vec<TrackRow>> {
        let law = self.laws[0].bind(py);
        let tracks = self.asked.ask(&law.getattr("tracks")?, PyTuple::empty(py), "tracks", whose_is(law)?)?;
        let tracks = tracks.cast::<Tracks>()?;
        Ok(tracks.get().rows.clone())
    }

    /// What a law has answered for a UAV, once it was read.
    fn answer_of(&self, answer: &Bound<'_, PyAny>) -> PyResult<Option<Answer>> {
        if answer.is_none() {
            return Ok(None);
        }
        let Command { speed_m_s, turn_rate_rad_s, look_at, altitude_m, group } =
            answer.cast::<Command>()?.get().clone();
        if let (Some(group), Some(picture)) = (group, self.fleet.as_ref().map(Fleet::picture))
            && let there = picture.groups.iter().filter_map(|there| picture.number(there.id)).collect::<Vec<u32>>()
            && !there.contains(&group)
        {
            return Err(PyValueError::new_err(format!("decide: group {group} is none of {there:?}")));
        }
        let look_at = look_at
            .map(|[x, y, vx, vy]| LookAt { position: Position::from_m(x, y), velocity: Velocity::from_m_s(vx, vy) });
        Ok(Some(Answer { command: Flown { speed_m_s, turn_rate_rad_s }, look_at, altitude_m, group }))
    }

    fn observed(&mut self, py: Python<'_>, place: usize, ours: Option<&Step>) -> PyResult<Py<Observed>> {
        if self.kind.sees_picture && self.picture.is_none() {
            let picture = self.fleet.as_ref().map(|fleet| Picture::of(py, fleet.picture()));
            self.picture = picture.map(|picture| Py::new(py, picture)).transpose()?;
        }
        let Seen { own, report, heard, cues, traffic, .. } = &self.seen[place];
        let report = match report {
            Some(Message::Report(report)) => Some(report),
            _ => None,
        };
        let picture = self.picture.as_ref().map(|picture| picture.clone_ref(py));
        Py::new(py, Observed::new(py, self.now, (place as u32, own), report, (heard, cues, traffic), (picture, ours))?)
    }
}

/// A law's class, for messages.
fn name(law: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(law.get_type().name()?.to_string())
}

/// The same as what reads an answer takes it.
fn whose_is<'py>(law: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
    (name(law)?,).into_pyobject(law.py())
}

/// A law that assigns UAVs to groups, written in Python.
struct OwnAssignment {
    law: Py<PyAny>,
    asked: Arc<Asked>,
}

impl std::fmt::Debug for OwnAssignment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("OwnAssignment")
    }
}

impl AssignmentLaw for OwnAssignment {
    fn assign(&self, now: Time, uavs: &[AvailableUav], sites: &[Site<'_>]) -> Option<Vec<Duty>> {
        if self.asked.has_failed() {
            return None;
        }
        Python::attach(|py| {
            let law = self.law.bind(py);
            let choice = (Choice::of(py, now, uavs, sites)?,).into_pyobject(py)?;
            let uavs = PyFrozenSet::new(py, uavs.iter().map(|uav| uav.uav.0))?;
            let groups = PyFrozenSet::new(py, sites.iter().map(|site| site.group.0))?;
            let how = (name(law)?, uavs, groups).into_pyobject(py)?;
            let answer = self.asked.ask(&law.getattr("decide")?, choice, "duties", how)?;
            let duties: Option<Vec<(u32, u64)>> = answer.extract()?;
            let duty = |(uav, group)| Duty { uav: UavId(uav), group: GroupId(group) };
            PyResult::Ok(duties.map(|duties| duties.into_iter().map(duty).collect()))
        })
        .unwrap_or_else(|error| {
            self.asked.fail(error);
            None
        })
    }
}
