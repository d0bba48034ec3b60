//! Inputs and outputs of custom laws. SI units; x is east and y is north, m; angles are anticlockwise from east, rad.

use numpy::ndarray::Dimension;
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use standoff::coordination::assignment::AvailableUav;
use standoff::coordination::assignment::CandidateGroup;
use standoff::validation::Allowed;
use standoff::{
    AgentOutput, Cue, GroupedTrack, Membership, Report, TeamParams, TeamState as AgentTeamState, Time, TrackStatus,
    TrafficReport, UavState,
};
use standoff_sim::scenario::Scenario;

use crate::common_args::{Whole, small};
use crate::exceptions::InputError;

/// Information about a scenario that the team may use: UAV limits, sensor, orbits and zones.
#[pyclass(frozen, module = "standoff")]
pub(crate) struct MissionInfo {
    /// UAV for which the law decides; None: all UAVs.
    #[pyo3(get)]
    uav: Option<u32>,
    /// Number of UAVs; their ids start at 0.
    #[pyo3(get)]
    uavs: usize,
    /// Length of a time step, s.
    #[pyo3(get)]
    period_s: f64,
    /// Duration of the mission, s.
    #[pyo3(get)]
    duration_s: f64,
    /// Nominal speed, m/s.
    #[pyo3(get)]
    speed_m_s: f64,
    /// Maximum difference of a commanded speed from the nominal speed, m/s.
    #[pyo3(get)]
    speed_change_max_m_s: f64,
    /// Maximum turn rate, rad/s.
    #[pyo3(get)]
    turn_rate_max_rad_s: f64,
    /// Sensing range, m.
    #[pyo3(get)]
    sensing_range_m: f64,
    /// Field of view of the sensors, full angle, rad.
    #[pyo3(get)]
    field_of_view_rad: f64,
    /// Standard deviation of measured ranges, m.
    #[pyo3(get)]
    range_sd_m: f64,
    /// Standard deviation of measured bearings, rad.
    #[pyo3(get)]
    bearing_sd_rad: f64,
    /// Smallest orbit radius, m.
    #[pyo3(get)]
    radius_min_m: f64,
    /// Largest orbit radius, m.
    #[pyo3(get)]
    radius_max_m: f64,
    /// Keep-out and keep-in zones of the scenario.
    #[pyo3(get)]
    zones: Vec<Py<Zone>>,
    /// Parameters of the team, for `standoff.components`.
    team: TeamParams,
}

/// A keep-out or keep-in zone: a polygon that UAVs must not enter, or must not leave, between two altitudes.
#[pyclass(frozen, get_all, name = "Zone", module = "standoff")]
pub(crate) struct Zone {
    /// Name of the zone; may be empty.
    name: String,
    /// ``"keep-out"`` or ``"keep-in"``.
    kind: &'static str,
    /// Vertices in order, shape ``(n, 2)``: x_m, y_m. An edge joins the last one to the first.
    vertices: Py<PyArray2<f64>>,
    /// Floor, m above the plane; None: no lower limit.
    altitude_min_m: Option<f64>,
    /// Ceiling, m above the plane; None: no upper limit.
    altitude_max_m: Option<f64>,
    /// Index in ``MissionInfo.zones`` of the zone that this polygon extends; None: a separate zone.
    part_of: Option<usize>,
}

impl Zone {
    fn of(py: Python<'_>, zone: &standoff::Zone) -> Self {
        let vertices = zone.vertices.iter().flat_map(|at| [at.x_m(), at.y_m()]).collect();
        Self {
            name: zone.name.clone(),
            kind: zone.kind.name(),
            vertices: two(py, vertices, 2),
            altitude_min_m: zone.altitude_min_m,
            altitude_max_m: zone.altitude_max_m,
            part_of: zone.part_of,
        }
    }
}

impl MissionInfo {
    pub(crate) fn of(py: Python<'_>, scenario: &Scenario, uav: Option<u32>) -> PyResult<Self> {
        let settings = &scenario.settings;
        let (limits, sensor) = (&settings.team.uav, &settings.team.track.sensor);
        let standoff = &settings.team.group.standoff;
        let zones = settings.geofence.zones().map(|zone| Py::new(py, Zone::of(py, zone)));
        Ok(Self {
            uav,
            uavs: scenario.uavs.len(),
            period_s: settings.period.s(),
            duration_s: settings.duration.s(),
            speed_m_s: limits.speed_m_s,
            speed_change_max_m_s: limits.speed_change_max_m_s,
            turn_rate_max_rad_s: limits.turn_rate_max_rad_s,
            sensing_range_m: sensor.sensing_range_m,
            field_of_view_rad: sensor.field_of_view_rad,
            range_sd_m: sensor.range_sd_m,
            bearing_sd_rad: sensor.bearing_sd_rad,
            radius_min_m: standoff.radius_min_m,
            radius_max_m: standoff.radius_max_m,
            zones: zones.collect::<PyResult<_>>()?,
            team: settings.team,
        })
    }

    /// Returns the parameters of a mission, or the recommended ones.
    pub(crate) fn params(mission: Option<&Bound<'_, Self>>) -> TeamParams {
        mission.map_or_else(TeamParams::recommended, |mission| mission.get().team)
    }
}

/// Command of a law to a UAV for one time step. Values beyond the UAV's limits are clipped.
///
/// :param speed_m_s: speed, m/s.
/// :param turn_rate_rad_s: turn rate, rad/s, positive anticlockwise.
/// :param pointing_target: point at which the sensor is pointed: (x_m, y_m), or (x_m, y_m, vx_m_s, vy_m_s) for a moving
///     point. None: the pointing of the built-in controller, if it runs alongside the law; otherwise the sensor is not
///     pointed.
/// :param altitude_m: altitude above the x-y plane, m. None: the altitude of the built-in controller, if it runs
///     alongside the law.
/// :param group: group to which the UAV is assigned, for the metrics; if the law sees the team state, one of its
///     groups.
/// :raises InputError: if a value is not finite, or the altitude is beyond 100 km.
#[pyclass(frozen, get_all, module = "standoff")]
#[derive(Clone)]
pub(crate) struct Command {
    pub(super) speed_m_s: f64,
    pub(super) turn_rate_rad_s: f64,
    pub(super) pointing_target: Option<[f64; 4]>,
    pub(super) altitude_m: Option<f64>,
    pub(super) group: Option<u32>,
}

const FINITE: Allowed = Allowed::FINITE;
/// Allowed altitudes, m; no aircraft flies higher.
const ALTITUDE_M: Allowed = Allowed::at_least(-1e5).at_most(1e5);

/// A fixed or a moving point.
#[derive(FromPyObject)]
enum Point {
    Moving([f64; 4]),
    Still([f64; 2]),
}

#[pymethods]
impl Command {
    #[new]
    #[pyo3(signature = (speed_m_s, turn_rate_rad_s, *, pointing_target=None, altitude_m=None, group=None))]
    fn new(
        speed_m_s: f64,
        turn_rate_rad_s: f64,
        pointing_target: Option<Point>,
        altitude_m: Option<f64>,
        group: Option<Whole>,
    ) -> PyResult<Self> {
        let pointing_target = pointing_target.map(|point| match point {
            Point::Moving(point) => point,
            Point::Still([x, y]) => [x, y, 0.0, 0.0],
        });
        let point = pointing_target.into_iter().flatten().map(|number| ("pointing_target", number, FINITE));
        let altitude = altitude_m.map(|altitude_m| ("altitude_m", altitude_m, ALTITUDE_M));
        let motion = [("speed_m_s", speed_m_s, FINITE), ("turn_rate_rad_s", turn_rate_rad_s, FINITE)];
        for (name, number, allowed) in motion.into_iter().chain(point).chain(altitude) {
            if !allowed.contains(number) {
                return Err(InputError::new_err(format!("{name} = {number}: must be {allowed}")));
            }
        }
        Ok(Self { speed_m_s, turn_rate_rad_s, pointing_target, altitude_m, group: small("group", group)? })
    }

    fn __repr__(&self) -> String {
        format!("Command(speed_m_s={}, turn_rate_rad_s={})", self.speed_m_s, self.turn_rate_rad_s)
    }
}

/// Report of a UAV about one time step: its state and the measurements of its sensor.
#[pyclass(frozen, get_all, name = "Report", module = "standoff")]
pub(crate) struct ReceivedReport {
    /// UAV that sent the report.
    uav: u32,
    /// State of the UAV, shape ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    state: Py<PyArray1<f64>>,
    /// Altitude above the x-y plane, m; None if the scenario has no altitudes.
    altitude_m: Option<f64>,
    /// Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
    climb_rate_m_s: Option<f64>,
    /// Direction in which the sensor pointed, rad; None if it was not pointed.
    boresight_rad: Option<f64>,
    /// Measured targets in ascending order, shape ``(n,)``.
    target: Py<PyArray1<i64>>,
    /// Measured ranges from the UAV to the targets, shape ``(n,)``, m.
    range_m: Py<PyArray1<f64>>,
    /// Measured bearings from the UAV to the targets, shape ``(n,)``, rad.
    bearing_rad: Py<PyArray1<f64>>,
}

impl ReceivedReport {
    fn of(py: Python<'_>, report: &Report) -> Self {
        let numbers = |of: fn(&standoff::Detection) -> f64| one(py, report.detections.iter().map(of).collect());
        let label = |detection: &standoff::Detection| detection.label.map_or(-1, |label| label.0.into());
        let targets: Vec<i64> = report.detections.iter().map(label).collect();
        Self {
            uav: report.uav.0,
            state: state(py, &report.state),
            altitude_m: report.state.vertical.map(|vertical| vertical.altitude_m),
            climb_rate_m_s: report.state.vertical.map(|vertical| vertical.climb_rate_m_s),
            boresight_rad: report.boresight.map(standoff::Angle::rad),
            target: one(py, targets),
            range_m: numbers(|detection| detection.measurement.range_m),
            bearing_rad: numbers(|detection| detection.measurement.bearing.rad()),
        }
    }
}

fn state(py: Python<'_>, state: &UavState) -> Py<PyArray1<f64>> {
    one(py, level(state).into())
}

/// The horizontal part of a state. Altitude and climb rate have their own fields.
fn level(state: &UavState) -> [f64; 5] {
    let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical: _ } = *state;
    [position.x_m(), position.y_m(), heading.rad(), speed_m_s, turn_rate_rad_s]
}

/// Cue: the position and velocity of a new target, sent by a cue source such as a search aircraft.
#[pyclass(frozen, get_all, name = "Cue", module = "standoff")]
pub(crate) struct ReceivedCue {
    /// Identity of the target; ``None`` if the source does not know it.
    target: Option<u32>,
    /// Position east, m.
    x_m: f64,
    /// Position north, m.
    y_m: f64,
    /// Velocity east, m/s.
    vx_m_s: f64,
    /// Velocity north, m/s.
    vy_m_s: f64,
    /// Standard deviation of the position per axis, m.
    position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    velocity_sd_m_s: f64,
    /// New priority of the target; ``None``: unchanged.
    priority: Option<f64>,
}

impl ReceivedCue {
    fn of(cue: &Cue) -> Self {
        Self {
            target: cue.label.map(|label| label.0),
            x_m: cue.position.x_m(),
            y_m: cue.position.y_m(),
            vx_m_s: cue.velocity.x_m_s(),
            vy_m_s: cue.velocity.y_m_s(),
            position_sd_m: cue.position_sd_m,
            velocity_sd_m_s: cue.velocity_sd_m_s,
            priority: cue.priority,
        }
    }
}

/// Traffic report of an aircraft outside the team: its position and motion.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct Intruder {
    /// Index of the intruder in the scenario, from 0.
    intruder: u32,
    /// Time of validity, s since the start of the mission; with communication delay, earlier than the current time.
    time_s: f64,
    /// State of the aircraft, shape ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    state: Py<PyArray1<f64>>,
    /// Altitude above the x-y plane, m; None if the aircraft does not report it.
    altitude_m: Option<f64>,
    /// Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
    climb_rate_m_s: Option<f64>,
}

impl Intruder {
    fn of(py: Python<'_>, traffic: &TrafficReport) -> Self {
        let vertical = traffic.state.vertical;
        Self {
            intruder: traffic.aircraft,
            time_s: traffic.time.s(),
            state: state(py, &traffic.state),
            altitude_m: vertical.map(|vertical| vertical.altitude_m),
            climb_rate_m_s: vertical.map(|vertical| vertical.climb_rate_m_s),
        }
    }
}

/// Inputs of a UAV's agent at one time step: its own state and sensor scan, the received messages and, for laws with
/// ``sees = "team-state"``, the team state.
#[pyclass(frozen, get_all, name = "Observation", module = "standoff")]
pub(crate) struct Observation {
    /// Time since the start of the mission, s.
    time_s: f64,
    /// Id of the UAV.
    uav: u32,
    /// Own position east, m.
    x_m: f64,
    /// Own position north, m.
    y_m: f64,
    /// Heading, rad.
    heading_rad: f64,
    /// Speed, m/s.
    speed_m_s: f64,
    /// Turn rate, rad/s.
    turn_rate_rad_s: f64,
    /// Altitude above the x-y plane, m; None if the scenario has no altitudes.
    altitude_m: Option<f64>,
    /// Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
    climb_rate_m_s: Option<f64>,
    /// Own report with the measurements of the own sensor; None during an outage of the UAV.
    scan: Option<Py<ReceivedReport>>,
    /// Reports of the teammates about this time step, in ascending order of UAV.
    reports: Vec<Py<ReceivedReport>>,
    /// Cues for targets that have just appeared.
    cues: Vec<Py<ReceivedCue>>,
    /// Traffic reports of aircraft outside the team, in ascending order of ``intruder``; aircraft whose transponder is
    /// off are missing.
    intruders: Vec<Py<Intruder>>,
    /// Team state, for laws with ``sees = "team-state"``; otherwise None.
    team_state: Option<Py<TeamState>>,
    /// Command of the built-in controller for the UAV; None if it does not run alongside the law.
    builtin_command: Option<Py<Command>>,
}

impl Observation {
    pub(super) fn new(
        py: Python<'_>,
        now: Time,
        (uav, own): (u32, &UavState),
        scan: Option<&Report>,
        (reports, cues, traffic): (&[Report], &[Cue], &[TrafficReport]),
        (team_state, builtin): (Option<Py<TeamState>>, Option<&AgentOutput>),
    ) -> PyResult<Self> {
        let builtin_command = builtin.map(|step| Command {
            speed_m_s: step.command.speed_m_s,
            turn_rate_rad_s: step.command.turn_rate_rad_s,
            pointing_target: step
                .pointing_target
                .map(|look| [look.position.x_m(), look.position.y_m(), look.velocity.x_m_s(), look.velocity.y_m_s()]),
            altitude_m: step.altitude_m,
            group: step.diagnostics.group_number,
        });
        Ok(Self {
            time_s: now.s(),
            uav,
            x_m: own.position.x_m(),
            y_m: own.position.y_m(),
            heading_rad: own.heading.rad(),
            speed_m_s: own.speed_m_s,
            turn_rate_rad_s: own.turn_rate_rad_s,
            altitude_m: own.vertical.map(|vertical| vertical.altitude_m),
            climb_rate_m_s: own.vertical.map(|vertical| vertical.climb_rate_m_s),
            scan: scan.map(|report| Py::new(py, ReceivedReport::of(py, report))).transpose()?,
            reports: reports
                .iter()
                .map(|report| Py::new(py, ReceivedReport::of(py, report)))
                .collect::<PyResult<_>>()?,
            cues: cues.iter().map(|cue| Py::new(py, ReceivedCue::of(cue))).collect::<PyResult<_>>()?,
            intruders: traffic.iter().map(|report| Py::new(py, Intruder::of(py, report))).collect::<PyResult<_>>()?,
            team_state,
            builtin_command: builtin_command.map(|command| Py::new(py, command)).transpose()?,
        })
    }
}

/// Team state: T tracked targets that are not lost, G groups and U UAVs, each in ascending order of their ids.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct TeamState {
    /// Sensor-reported identities of the targets, shape ``(T,)``.
    target: Py<PyArray1<i64>>,
    /// Estimated states, shape ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
    state: Py<PyArray2<f64>>,
    /// Covariances of ``state``, shape ``(T, 6, 6)``.
    covariance: Py<PyArray3<f64>>,
    /// True if the track was updated with a measurement at this time step, shape ``(T,)``.
    updated: Py<PyArray1<bool>>,
    /// Group responsible for each target, shape ``(T,)``; -1: none.
    target_group: Py<PyArray1<i64>>,
    /// Ids of the groups, shape ``(G,)``.
    group: Py<PyArray1<i64>>,
    /// Centres of the orbits and their velocities, shape ``(G, 4)``: x_m, y_m, vx_m_s, vy_m_s.
    centre: Py<PyArray2<f64>>,
    /// Distances from the centre to the furthest member, shape ``(G,)``, m.
    spread_m: Py<PyArray1<f64>>,
    /// Standoff distances r_d (15), shape ``(G,)``, m.
    standoff_distance_m: Py<PyArray1<f64>>,
    /// UAVs that have reported within the teammate timeout, shape ``(U,)``.
    uav: Py<PyArray1<i64>>,
    /// Group to which each UAV is assigned, shape ``(U,)``; -1: none.
    uav_group: Py<PyArray1<i64>>,
    /// States of the UAVs, shape ``(U, 5)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    uav_state: Py<PyArray2<f64>>,
    /// Vertical states of the UAVs, shape ``(U, 2)``: altitude_m, climb_rate_m_s; NaN if a UAV does not report them.
    /// None if the scenario has no altitudes.
    uav_vertical: Option<Py<PyArray2<f64>>>,
}

/// Id of a group in an `AssignmentProblem`; -1: no group. The conversion to a signed number is lossless.
fn id_or_none(group: Option<standoff::GroupId>) -> i64 {
    group.map_or(-1, |group| group.0.cast_signed())
}

impl TeamState {
    pub(super) fn of(py: Python<'_>, team: &AgentTeamState) -> Self {
        let live: Vec<&GroupedTrack> = team.tracks().iter().filter(|known| !known.track.is_lost()).collect();
        let whole = |of: &dyn Fn(&GroupedTrack) -> i64| one(py, live.iter().map(|known| of(known)).collect());
        let states = live.iter().flat_map(|known| <[f64; 6]>::from(known.track.estimate().state.0)).collect();
        let covariances =
            live.iter().flat_map(|known| known.track.estimate().covariance.matrix().as_slice().to_vec()).collect();
        let centres = team.groups.iter().flat_map(|group| {
            let centre = group.centre().state;
            let (at, velocity) = (centre.position(), centre.velocity());
            [at.x_m(), at.y_m(), velocity.x_m_s(), velocity.y_m_s()]
        });
        let of_groups = |of: &dyn Fn(&standoff::Group) -> f64| one(py, team.groups.iter().map(of).collect());
        let number =
            |group: Option<standoff::GroupId>| group.and_then(|group| team.group_number(group)).map_or(-1, i64::from);
        let is_removed = |known: &GroupedTrack| matches!(known.membership, Membership::Removed);
        let flying = team.teammates.iter().flat_map(|mate| level(&mate.state));
        let is_flown = team.teammates.iter().any(|mate| mate.state.vertical.is_some());
        let vertical = team.teammates.iter().flat_map(|mate| {
            mate.state.vertical.map_or([f64::NAN; 2], |vertical| [vertical.altitude_m, vertical.climb_rate_m_s])
        });
        Self {
            target: whole(&|known| known.track.id.0.cast_signed()),
            state: two(py, states, 6),
            covariance: three(py, covariances),
            updated: one(py, live.iter().map(|known| known.track.status == TrackStatus::Updated).collect()),
            target_group: whole(&|known| number(known.membership.group().filter(|_| !is_removed(known)))),
            group: one(py, team.groups.iter().map(|group| number(Some(group.id))).collect()),
            centre: two(py, centres.collect(), 4),
            spread_m: of_groups(&|group| group.spread().distance_m),
            standoff_distance_m: of_groups(&|group| group.standoff.distance_m),
            uav: one(py, team.teammates.iter().map(|mate| i64::from(mate.uav.0)).collect()),
            uav_group: one(py, team.teammates.iter().map(|mate| number(mate.group)).collect()),
            uav_state: two(py, flying.collect(), 5),
            uav_vertical: is_flown.then(|| two(py, vertical.collect(), 2)),
        }
    }
}

fn one<T: numpy::Element>(py: Python<'_>, numbers: Vec<T>) -> Py<PyArray1<T>> {
    fixed(numbers.into_pyarray(py))
}

fn two(py: Python<'_>, numbers: Vec<f64>, columns: usize) -> Py<PyArray2<f64>> {
    let rows = numbers.len() / columns;
    // Cannot fail: the length is a multiple of the number of columns.
    let shaped = numbers.into_pyarray(py).reshape([rows, columns]);
    fixed(shaped.unwrap_or_else(|_| PyArray2::zeros(py, [0, columns], false)))
}

fn three(py: Python<'_>, numbers: Vec<f64>) -> Py<PyArray3<f64>> {
    let matrices = numbers.len() / 36;
    let shaped = numbers.into_pyarray(py).reshape([matrices, 6, 6]);
    fixed(shaped.unwrap_or_else(|_| PyArray3::zeros(py, [0, 6, 6], false)))
}

/// Makes an array read-only, because several laws share it.
fn fixed<T: numpy::Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Py<PyArray<T, D>> {
    // If the flag cannot be set, the contents are still correct.
    let _ = array.getattr("flags").and_then(|flags| flags.setattr("writeable", false));
    array.unbind()
}

/// Input of an assignment law: U UAVs and G groups, each in ascending order of their ids.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct AssignmentProblem {
    /// Time since the start of the mission, s.
    time_s: f64,
    /// Ids of the UAVs that can be assigned, shape ``(U,)``.
    uav: Py<PyArray1<i64>>,
    /// Positions of the UAVs, shape ``(U, 2)``: x_m, y_m.
    position: Py<PyArray2<f64>>,
    /// Id of the group to which each UAV is currently assigned, shape ``(U,)``; -1: none.
    current_group: Py<PyArray1<i64>>,
    /// Ids of the groups, shape ``(G,)``. The numbers only identify the groups.
    group: Py<PyArray1<i64>>,
    /// For each group the positions of its targets, shape ``(n, 2)``: x_m, y_m.
    members: Vec<Py<PyArray2<f64>>>,
}

impl AssignmentProblem {
    pub(super) fn of(
        py: Python<'_>,
        now: Time,
        uavs: &[AvailableUav],
        groups: &[CandidateGroup<'_>],
    ) -> PyResult<Self> {
        let points = |points: &[standoff::Position]| {
            two(py, points.iter().flat_map(|point| [point.x_m(), point.y_m()]).collect(), 2)
        };
        let positions: Vec<_> = uavs.iter().map(|uav| uav.position).collect();
        Ok(Self {
            time_s: now.s(),
            uav: one(py, uavs.iter().map(|uav| i64::from(uav.uav.0)).collect()),
            position: points(&positions),
            current_group: one(py, uavs.iter().map(|uav| id_or_none(uav.current_group)).collect()),
            group: one(py, groups.iter().map(|group| id_or_none(Some(group.group))).collect()),
            members: groups.iter().map(|group| points(group.members)).collect(),
        })
    }
}
