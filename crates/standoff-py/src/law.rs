//! Custom laws written in Python, as controllers of the simulator.

mod call;
mod observation;
mod reported_tracks;

use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFrozenSet, PyList, PyTuple};
use standoff::coordination::assignment::Assignment;
use standoff::coordination::assignment::AssignmentLaw;
use standoff::coordination::assignment::AvailableUav;
use standoff::coordination::assignment::CandidateGroup;
use standoff::uav::LimitedCommand;
use standoff::{
    AgentOutput, Command as Flown, Cue, GroupId, Message, PointingTarget, Position, Report, Scan, TeamAgent, Time,
    TrafficReport, UavId, UavParams, UavState, Velocity,
};
use standoff_sim::controller::{Controller, ReportedState, ReportedTables, TrackRow};
use standoff_sim::rows_of_team_state;
use standoff_sim::run::Mission;
use standoff_sim::scenario::Scenario;

pub(crate) use call::LawCalls;
pub(crate) use observation::{
    AssignmentProblem, Command, Intruder, MissionInfo, Observation, ReceivedCue, ReceivedReport, TeamState, Zone,
};
pub(crate) use reported_tracks::Tracks;

use crate::exceptions::InputError;

/// Part of the built-in controller that a custom law replaces.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Replaces {
    All,
    Guidance,
    Assignment,
}

/// Properties of a custom law, from the class attributes of `standoff.Law`.
#[derive(Clone, Copy)]
struct Kind {
    replaces: Replaces,
    /// One law decides for all UAVs.
    decides_for_team: bool,
    /// The law receives the team state, which the built-in controller computes.
    sees_team_state: bool,
    /// The law reports its own tracks.
    has_tracks: bool,
}

impl Kind {
    fn of(law: &Bound<'_, PyAny>) -> PyResult<Self> {
        let option = |attribute: &str, allowed: &[&str], default: usize| -> PyResult<usize> {
            let Some(value) = law.getattr_opt(attribute)? else { return Ok(default) };
            let index = value.extract::<String>().ok().and_then(|value| allowed.iter().position(|one| *one == value));
            index.ok_or_else(|| {
                let allowed = allowed.join(", ");
                PyValueError::new_err(format!("{law}: {attribute} = {value}: must be one of {allowed}"))
            })
        };
        let replaces = match option("replaces", &["all", "guidance", "assignment"], 0)? {
            0 => Replaces::All,
            1 => Replaces::Guidance,
            _ => Replaces::Assignment,
        };
        let decides_for_team = option("decides_for", &["agent", "team"], 0)? == 1;
        let sees_team_state = option("sees", &["own", "team-state"], 0)? == 1;
        if !law.getattr_opt("decide")?.is_some_and(|decide| decide.is_callable()) {
            return Err(PyTypeError::new_err(format!("{law} has no method decide: see standoff.Law")));
        }
        let decides_for_team = decides_for_team || replaces == Replaces::Assignment;
        let has_tracks = law.getattr_opt("tracks")?.is_some_and(|tracks| tracks.is_callable());
        Ok(Self { replaces, decides_for_team, sees_team_state, has_tracks })
    }

    /// True if the built-in estimation and grouping run alongside the law.
    fn runs_builtin(self) -> bool {
        self.sees_team_state || self.replaces != Replaces::All
    }
}

/// Makes a mission controlled by a custom law. `law` is a class, or a callable that takes a [`MissionInfo`] and returns
/// an object with a method `decide`.
pub(crate) fn mission(
    py: Python<'_>,
    scenario: &Scenario,
    law: &Bound<'_, PyAny>,
    calls: &Arc<LawCalls>,
) -> PyResult<Mission<CustomLaw>> {
    if !law.is_callable() {
        let what = "law: must be a class, or a callable that takes a MissionInfo and returns a law; a law object would \
                    carry its state from one run into the next";
        return Err(PyTypeError::new_err(what));
    }
    let uavs = scenario.uavs.len();
    let nothing = PyTuple::empty(py);
    let make = |uav: Option<u32>| {
        let mission_info = (MissionInfo::of(py, scenario, uav)?,).into_pyobject(py)?;
        calls.call(law, mission_info, "new_law", nothing.clone()).map(Bound::unbind)
    };
    let kind = Kind::of(&class_of(law, || make(Some(0)))?)?;
    let laws = if kind.decides_for_team {
        vec![make(None)?]
    } else {
        (0..uavs as u32).map(|uav| make(Some(uav))).collect::<PyResult<_>>()?
    };
    let team = scenario.settings.team;
    let refused = |errors: Vec<standoff::ParamError>| {
        InputError::new_err(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    };
    let team_agent = || TeamAgent::new(team).and_then(|agent| agent.with_geofence(scenario.settings.geofence.clone()));
    let team_agent = kind.runs_builtin().then(team_agent).transpose().map_err(refused)?;
    let team_agent = match (team_agent, kind.replaces) {
        (Some(team_agent), Replaces::Assignment) => {
            Some(team_agent.with_assignment_law(Arc::new(CustomAssignment {
                law: laws[0].clone_ref(py),
                calls: Arc::clone(calls),
            })))
        }
        (team_agent, _) => team_agent,
    };
    let inboxes = scenario.uavs.iter().map(|state| Inbox { own: *state, ..Inbox::default() }).collect();
    let controller = CustomLaw {
        kind,
        limits: team.uav,
        laws,
        team_agent,
        inboxes,
        calls: Arc::clone(calls),
        answers: None,
        now: Time::EPOCH,
        team_state: None,
    };
    Mission::with_controller(scenario, controller).map_err(refused)
}

/// The object with the class attributes of a law: its class, also inside a `functools.partial`, or an instance made for
/// this purpose.
fn class_of<'py>(law: &Bound<'py, PyAny>, make: impl FnOnce() -> PyResult<Py<PyAny>>) -> PyResult<Bound<'py, PyAny>> {
    for class in [Some(law.clone()), law.getattr_opt("func")?].into_iter().flatten() {
        if class.hasattr("decide")? {
            return Ok(class);
        }
    }
    make().map(|made| made.into_bound(law.py()))
}

/// Inputs of a UAV at one time step.
struct Inbox {
    own: UavState,
    /// Its own report; `None` during an outage of the UAV.
    report: Option<Message>,
    reports: Vec<Report>,
    cues: Vec<Cue>,
    traffic: Vec<TrafficReport>,
    /// Observation token of the built-in controller.
    observation: Option<standoff::Observation>,
}

impl Default for Inbox {
    fn default() -> Self {
        let own = UavState::level_flight(Position::ORIGIN, standoff::Angle::ZERO, 0.0);
        Self { own, report: None, reports: Vec::new(), cues: Vec::new(), traffic: Vec::new(), observation: None }
    }
}

/// Relative tolerance within which a command counts as being at a bound.
const AT_BOUND: f64 = 1e-9;

/// A controller that calls a custom law written in Python.
pub(crate) struct CustomLaw {
    kind: Kind,
    limits: UavParams,
    /// One law per UAV, or one for all.
    laws: Vec<Py<PyAny>>,
    team_agent: Option<TeamAgent>,
    inboxes: Vec<Inbox>,
    calls: Arc<LawCalls>,
    /// Decisions of a team law at this time step, by UAV.
    answers: Option<Vec<Option<LawDecision>>>,
    now: Time,
    /// Team state at this time step as a Python object, made on first use.
    team_state: Option<Py<TeamState>>,
}

/// Decision of a law for one UAV.
#[derive(Clone, Copy)]
struct LawDecision {
    command: Flown,
    pointing_target: Option<PointingTarget>,
    altitude_m: Option<f64>,
    group: Option<u32>,
}

impl Controller for CustomLaw {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        (self.now, self.answers, self.team_state) = (now, None, None);
        let observation = self.team_agent.as_mut().map(|team_agent| team_agent.observe(now, uav, own, scan));
        let report = scan.map(|scan| {
            let Scan { boresight, detections } = scan;
            // Custom laws never restart during a mission, so the time can serve as the sequence number.
            let sequence = u32::try_from(now.us() / 1000).unwrap_or(u32::MAX);
            let detections = detections.to_vec();
            Message::Report(Report { sequence, boresight, detections, ..Report::position_only(uav, now, *own) })
        });
        if let Some(inbox) = self.inboxes.get_mut(uav.0 as usize) {
            *inbox = Inbox { own: *own, report, observation, ..Inbox::default() };
        }
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        // A law that only assigns UAVs does not use reports.
        let inbox = self.inboxes.get(uav.0 as usize).filter(|_| self.kind.replaces != Replaces::Assignment);
        inbox.map_or(&[], |inbox| inbox.report.as_slice())
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        let Some(inbox) = self.inboxes.get_mut(uav.0 as usize) else { return };
        match message {
            Message::Report(report) => inbox.reports.push(report.clone()),
            Message::Cue(cue) => inbox.cues.push(*cue),
            Message::Traffic(traffic) => inbox.traffic.push(*traffic),
            // Custom laws do not exchange snapshots.
            Message::Snapshot(_) => {}
        }
        // Messages from outside the team reach all UAVs, so only those to UAV 0 are passed on.
        if let (Message::Cue(_) | Message::Traffic(_), Some(team_agent), Some(observation), 0) =
            (message, &mut self.team_agent, &inbox.observation, uav.0)
        {
            team_agent.receive(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        let own = self.inboxes.get(uav.0 as usize).map(|inbox| inbox.own);
        let straight = Flown { speed_m_s: own.map_or(0.0, |own| own.speed_m_s), turn_rate_rad_s: 0.0 };
        let observation = self.inboxes.get(uav.0 as usize).and_then(|inbox| inbox.observation);
        let builtin = match (&mut self.team_agent, observation) {
            (Some(team_agent), Some(observation)) => Some(team_agent.decide(&observation)),
            _ => None,
        };
        let step = builtin.unwrap_or(AgentOutput::command_only(straight));
        if self.kind.replaces == Replaces::Assignment || self.calls.has_failed() {
            return step;
        }
        let answer = Python::attach(|py| self.answer(py, uav, builtin.as_ref())).unwrap_or_else(|error| {
            self.calls.fail(error);
            None
        });
        let Some(LawDecision { command, pointing_target, altitude_m, group }) = answer else { return step };
        let group_number = group.or(step.diagnostics.group_number);
        // A command exactly at a bound counts as limited, like one beyond it: a law may clip its commands itself.
        let beyond = |command: Flown| Flown {
            speed_m_s: command.speed_m_s + AT_BOUND * (command.speed_m_s - self.limits.speed_m_s),
            turn_rate_rad_s: command.turn_rate_rad_s * (1.0 + AT_BOUND),
        };
        let LimitedCommand { speed_limited, turn_rate_limited, .. } = self.limits.limit(beyond(command));
        let mut diagnostics = step.diagnostics;
        diagnostics.group_number = group_number;
        (diagnostics.speed_limited, diagnostics.turn_rate_limited) = (speed_limited, turn_rate_limited);
        AgentOutput {
            command,
            path: None,
            pointing_target: pointing_target.or(step.pointing_target),
            altitude_m: altitude_m.or(step.altitude_m),
            diagnostics,
        }
    }

    fn reported(&self) -> ReportedTables {
        if self.team_agent.is_some() {
            ReportedTables::default()
        } else {
            ReportedTables { tracks: self.kind.has_tracks, ..ReportedTables::NOTHING }
        }
    }

    fn report(&self, state: &mut ReportedState) {
        if let Some(team_agent) = &self.team_agent {
            rows_of_team_state(team_agent.team_state(), state);
        } else if self.kind.has_tracks && !self.calls.has_failed() {
            match Python::attach(|py| self.tracks(py)) {
                Ok(tracks) => state.tracks.extend(tracks),
                Err(error) => self.calls.fail(error),
            }
        }
    }
}

impl CustomLaw {
    /// Calls the law for a UAV; `None`: use the command of the built-in controller or, without it, fly straight.
    fn answer(&mut self, py: Python<'_>, uav: UavId, builtin: Option<&AgentOutput>) -> PyResult<Option<LawDecision>> {
        let place = uav.0 as usize;
        if !self.kind.decides_for_team {
            let observation = (self.observation(py, place, builtin)?,).into_pyobject(py)?;
            let law = self.laws[place].bind(py);
            let answer = self.calls.call(&law.getattr("decide")?, observation, "command", name_argument(law)?)?;
            return self.answer_of(&answer);
        }
        if self.answers.is_none() {
            let mut all = Vec::new();
            for place in 0..self.inboxes.len() {
                // The built-in controller decides for all UAVs first, because a team law sees its commands.
                let builtin = match (&mut self.team_agent, self.inboxes[place].observation) {
                    (Some(team_agent), Some(observation)) => Some(team_agent.decide(&observation)),
                    _ => None,
                };
                all.push(self.observation(py, place, builtin.as_ref())?);
            }
            let law = self.laws[0].bind(py);
            let (observations, uavs) = ((PyList::new(py, all)?,).into_pyobject(py)?, self.inboxes.len());
            let how = (name(law)?, uavs).into_pyobject(py)?;
            let answers = self.calls.call(&law.getattr("decide")?, observations, "commands", how)?;
            let answers = answers.try_iter()?.map(|answer| self.answer_of(&answer?)).collect::<PyResult<_>>()?;
            self.answers = Some(answers);
        }
        Ok(self.answers.as_ref().and_then(|answers| *answers.get(place)?))
    }

    /// Tracks reported by the team law, or by the law of UAV 0.
    fn tracks(&self, py: Python<'_>) -> PyResult<Vec<TrackRow>> {
        let law = self.laws[0].bind(py);
        let tracks = self.calls.call(&law.getattr("tracks")?, PyTuple::empty(py), "tracks", name_argument(law)?)?;
        let tracks = tracks.cast::<Tracks>()?;
        Ok(tracks.get().rows.clone())
    }

    /// Converts a command that a law has returned for a UAV.
    fn answer_of(&self, answer: &Bound<'_, PyAny>) -> PyResult<Option<LawDecision>> {
        if answer.is_none() {
            return Ok(None);
        }
        let Command { speed_m_s, turn_rate_rad_s, pointing_target, altitude_m, group } =
            answer.cast::<Command>()?.get().clone();
        if let (Some(group), Some(team_state)) = (group, self.team_agent.as_ref().map(TeamAgent::team_state))
            && let existing =
                team_state.groups.iter().filter_map(|group| team_state.group_number(group.id)).collect::<Vec<u32>>()
            && !existing.contains(&group)
        {
            return Err(PyValueError::new_err(format!("decide: group {group} is not one of {existing:?}")));
        }
        let pointing_target = pointing_target.map(|[x, y, vx, vy]| PointingTarget {
            position: Position::from_m(x, y),
            velocity: Velocity::from_m_s(vx, vy),
        });
        Ok(Some(LawDecision { command: Flown { speed_m_s, turn_rate_rad_s }, pointing_target, altitude_m, group }))
    }

    fn observation(
        &mut self,
        py: Python<'_>,
        place: usize,
        builtin: Option<&AgentOutput>,
    ) -> PyResult<Py<Observation>> {
        if self.kind.sees_team_state && self.team_state.is_none() {
            let team_state = self.team_agent.as_ref().map(|team_agent| TeamState::of(py, team_agent.team_state()));
            self.team_state = team_state.map(|team_state| Py::new(py, team_state)).transpose()?;
        }
        let Inbox { own, report, reports, cues, traffic, .. } = &self.inboxes[place];
        let scan = match report {
            Some(Message::Report(report)) => Some(report),
            _ => None,
        };
        let team_state = self.team_state.as_ref().map(|team_state| team_state.clone_ref(py));
        Py::new(
            py,
            Observation::new(py, self.now, (place as u32, own), scan, (reports, cues, traffic), (team_state, builtin))?,
        )
    }
}

/// Class name of a law, for messages.
fn name(law: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(law.get_type().name()?.to_string())
}

/// Class name of a law, as the argument of the functions that convert return values.
fn name_argument<'py>(law: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
    (name(law)?,).into_pyobject(law.py())
}

/// Assignment law written in Python: assigns UAVs to groups.
struct CustomAssignment {
    law: Py<PyAny>,
    calls: Arc<LawCalls>,
}

impl std::fmt::Debug for CustomAssignment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("CustomAssignment")
    }
}

impl AssignmentLaw for CustomAssignment {
    fn assign(&self, now: Time, uavs: &[AvailableUav], groups: &[CandidateGroup<'_>]) -> Option<Vec<Assignment>> {
        if self.calls.has_failed() {
            return None;
        }
        Python::attach(|py| {
            let law = self.law.bind(py);
            let problem = (AssignmentProblem::of(py, now, uavs, groups)?,).into_pyobject(py)?;
            let uavs = PyFrozenSet::new(py, uavs.iter().map(|uav| uav.uav.0))?;
            let groups = PyFrozenSet::new(py, groups.iter().map(|group| group.group.0))?;
            let how = (name(law)?, uavs, groups).into_pyobject(py)?;
            let answer = self.calls.call(&law.getattr("decide")?, problem, "assignments", how)?;
            let assigned: Option<Vec<(u32, u64)>> = answer.extract()?;
            let assignment = |(uav, group)| Assignment { uav: UavId(uav), group: GroupId(group) };
            PyResult::Ok(assigned.map(|assigned| assigned.into_iter().map(assignment).collect()))
        })
        .unwrap_or_else(|error| {
            self.calls.fail(error);
            None
        })
    }
}
