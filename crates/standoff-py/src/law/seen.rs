//! What a law is shown, and what it answers. SI units; metres east (x) and north (y); angles anticlockwise from east, rad.

use numpy::ndarray::Dimension;
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use standoff::{
    Allowed, AvailableUav, Cue, Known, Membership, Picture as Kept, Report, Site, Step, Time, TrackStatus, Traffic,
    UavState,
};
use standoff_sim::scenario::Scenario;

use crate::asked_for::{Whole, small};
use crate::failure::InputError;

/// What a team may know of a scenario before it flies.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct Briefing {
    /// Which UAV the law decides for; None: for all.
    uav: Option<u32>,
    /// Number of UAVs, which are numbered from 0.
    uavs: usize,
    /// Time between two instants, s.
    period_s: f64,
    /// Duration of the mission, s.
    duration_s: f64,
    /// Nominal speed, m/s.
    speed_m_s: f64,
    /// Most that a commanded speed may differ from it, m/s.
    speed_change_max_m_s: f64,
    /// Most that a UAV turns, rad/s.
    turn_rate_max_rad_s: f64,
    /// How far sensors see, m.
    sensing_range_m: f64,
    /// Sensors' field of view, whole angle, rad.
    field_of_view_rad: f64,
    /// Standard deviation of ranges, m.
    range_sd_m: f64,
    /// Standard deviation of bearings, rad.
    bearing_sd_rad: f64,
    /// Smallest orbit, m.
    radius_min_m: f64,
    /// Largest orbit, m.
    radius_max_m: f64,
    /// The zones that UAVs keep out of, and in, as the scenario has them.
    zones: Vec<Py<Zone>>,
}

/// A polygon that UAVs keep out of, or in.
#[pyclass(frozen, get_all, name = "Zone", module = "standoff")]
pub(crate) struct Zone {
    /// What people call it; may be empty.
    name: String,
    /// ``"keep-out"`` or ``"keep-in"``.
    kind: &'static str,
    /// ``(n, 2)``: its corners in order, x_m, y_m; the last is joined to the first.
    points: Py<PyArray2<f64>>,
}

impl Zone {
    fn of(py: Python<'_>, zone: &standoff::Zone) -> Self {
        let points = zone.outline.iter().flat_map(|at| [at.x_m(), at.y_m()]).collect();
        Self { name: zone.name.clone(), kind: zone.kind.name(), points: two(py, points, 2) }
    }
}

impl Briefing {
    pub(crate) fn of(py: Python<'_>, scenario: &Scenario, uav: Option<u32>) -> PyResult<Self> {
        let settings = &scenario.settings;
        let (limits, sensor) = (&settings.team.uav, &settings.team.track.sensor);
        let standoff = &settings.team.group.standoff;
        let zones = settings.airspace.zones().map(|zone| Py::new(py, Zone::of(py, zone)));
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
        })
    }
}

/// What a law wants of a UAV until the next instant. What is beyond the limits is flown at the limit.
///
/// :param speed_m_s: speed, m/s.
/// :param turn_rate_rad_s: turn rate, rad/s, anticlockwise positive.
/// :param look_at: where to point the sensor: (x_m, y_m), or (x_m, y_m, vx_m_s, vy_m_s) for a point that moves. None: where
///     the product would, if it flies beside the law; else nowhere.
/// :param altitude_m: altitude above the plane, m.
/// :param group: the group that the UAV serves, for the scores: one of the picture's, where the law sees it.
/// :raises InputError: a number that is not finite, or an altitude beyond 100 km.
#[pyclass(frozen, get_all, module = "standoff")]
#[derive(Clone)]
pub(crate) struct Command {
    pub(super) speed_m_s: f64,
    pub(super) turn_rate_rad_s: f64,
    pub(super) look_at: Option<[f64; 4]>,
    pub(super) altitude_m: Option<f64>,
    pub(super) group: Option<u32>,
}

const FINITE: Allowed = Allowed::FINITE;
/// No aircraft flies higher.
const ALTITUDE_M: Allowed = Allowed::at_least(-1e5).at_most(1e5);

/// A point, or one that moves.
#[derive(FromPyObject)]
enum Place {
    Moving([f64; 4]),
    Still([f64; 2]),
}

#[pymethods]
impl Command {
    #[new]
    #[pyo3(signature = (speed_m_s, turn_rate_rad_s, *, look_at=None, altitude_m=None, group=None))]
    fn new(
        speed_m_s: f64,
        turn_rate_rad_s: f64,
        look_at: Option<Place>,
        altitude_m: Option<f64>,
        group: Option<Whole>,
    ) -> PyResult<Self> {
        let look_at = look_at.map(|place| match place {
            Place::Moving(place) => place,
            Place::Still([x, y]) => [x, y, 0.0, 0.0],
        });
        let place = look_at.into_iter().flatten().map(|number| ("look_at", number, FINITE));
        let altitude = altitude_m.map(|altitude_m| ("altitude_m", altitude_m, ALTITUDE_M));
        let wanted = [("speed_m_s", speed_m_s, FINITE), ("turn_rate_rad_s", turn_rate_rad_s, FINITE)];
        for (name, number, allowed) in wanted.into_iter().chain(place).chain(altitude) {
            if !allowed.contains(number) {
                return Err(InputError::new_err(format!("{name} = {number}: must be {allowed}")));
            }
        }
        Ok(Self { speed_m_s, turn_rate_rad_s, look_at, altitude_m, group: small("group", group)? })
    }

    fn __repr__(&self) -> String {
        format!("Command(speed_m_s={}, turn_rate_rad_s={})", self.speed_m_s, self.turn_rate_rad_s)
    }
}

/// What a teammate says of an instant: where it was, and what its sensor measured.
#[pyclass(frozen, get_all, name = "Report", module = "standoff")]
pub(crate) struct Heard {
    /// Who says it.
    uav: u32,
    /// ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    state: Py<PyArray1<f64>>,
    /// Its altitude above the plane, m; None: altitudes are not flown.
    altitude_m: Option<f64>,
    /// Its rate of climb, m/s, positive upward; None as ``altitude_m``.
    climb_rate_m_s: Option<f64>,
    /// Where its sensor pointed, rad; None: nowhere.
    boresight_rad: Option<f64>,
    /// ``(n,)``: which targets it measured, ascending.
    target: Py<PyArray1<i64>>,
    /// ``(n,)``: how far they were from it, m.
    range_m: Py<PyArray1<f64>>,
    /// ``(n,)``: in which direction from it, rad.
    bearing_rad: Py<PyArray1<f64>>,
}

impl Heard {
    fn of(py: Python<'_>, report: &Report) -> Self {
        let numbers = |of: fn(&standoff::Detection) -> f64| one(py, report.detections.iter().map(of).collect());
        let targets: Vec<i64> = report.detections.iter().map(|detection| detection.label.0.into()).collect();
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

/// A state but for its height, which has fields of its own.
fn level(state: &UavState) -> [f64; 5] {
    let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical: _ } = *state;
    [position.x_m(), position.y_m(), heading.rad(), speed_m_s, turn_rate_rad_s]
}

/// A target that a search aircraft hands over when it appears.
#[pyclass(frozen, get_all, name = "Cue", module = "standoff")]
pub(crate) struct Cued {
    /// Which target.
    target: u32,
    /// Where it is east, m.
    x_m: f64,
    /// Where it is north, m.
    y_m: f64,
    /// Its velocity east, m/s.
    vx_m_s: f64,
    /// Its velocity north, m/s.
    vy_m_s: f64,
    /// Standard deviation of the position per axis, m.
    position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    velocity_sd_m_s: f64,
}

impl Cued {
    fn of(cue: &Cue) -> Self {
        Self {
            target: cue.label.0,
            x_m: cue.position.x_m(),
            y_m: cue.position.y_m(),
            vx_m_s: cue.velocity.x_m_s(),
            vy_m_s: cue.velocity.y_m_s(),
            position_sd_m: cue.position_sd_m,
            velocity_sd_m_s: cue.velocity_sd_m_s,
        }
    }
}

/// What an aircraft that is not of the team tells: where it is, and how it flies.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct Intruder {
    /// Which aircraft: the scenario's intruders are numbered from 0.
    intruder: u32,
    /// When it was so, s since the start of the mission; where words are late, before now.
    time_s: f64,
    /// ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    state: Py<PyArray1<f64>>,
    /// Its altitude above the plane, m; None: it does not tell.
    altitude_m: Option<f64>,
    /// Its rate of climb, m/s, positive upward; None as ``altitude_m``.
    climb_rate_m_s: Option<f64>,
}

impl Intruder {
    fn of(py: Python<'_>, traffic: &Traffic) -> Self {
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

/// What the agent of a UAV has at an instant: its own state, its own scan, what was said to it; and, where a law asks for
/// it, the team's picture.
#[pyclass(frozen, get_all, name = "Observation", module = "standoff")]
pub(crate) struct Observed {
    /// Time since the start of the mission, s.
    time_s: f64,
    /// Which UAV.
    uav: u32,
    /// East, m.
    x_m: f64,
    /// North, m.
    y_m: f64,
    /// Heading, rad.
    heading_rad: f64,
    /// Speed, m/s.
    speed_m_s: f64,
    /// Turn rate, rad/s.
    turn_rate_rad_s: f64,
    /// Altitude above the plane, m; None: altitudes are not flown.
    altitude_m: Option<f64>,
    /// Rate of climb, m/s, positive upward; None as ``altitude_m``.
    climb_rate_m_s: Option<f64>,
    /// Its own scan; None: it is out, and its sensor is, too.
    scan: Option<Py<Heard>>,
    /// What teammates say of this instant, by ascending UAV.
    reports: Vec<Py<Heard>>,
    /// Targets that have just appeared.
    cues: Vec<Py<Cued>>,
    /// What aircraft tell that are not of the team, by ascending number; one that is silent is not among them.
    intruders: Vec<Py<Intruder>>,
    /// The team's picture, for laws with ``sees = "picture"``.
    picture: Option<Py<Picture>>,
    /// What the product would have the UAV do, where it flies beside the law.
    product: Option<Py<Command>>,
}

impl Observed {
    pub(super) fn new(
        py: Python<'_>,
        now: Time,
        (uav, own): (u32, &UavState),
        scan: Option<&Report>,
        (heard, cues, traffic): (&[Report], &[Cue], &[Traffic]),
        (picture, ours): (Option<Py<Picture>>, Option<&Step>),
    ) -> PyResult<Self> {
        let product = ours.map(|step| Command {
            speed_m_s: step.command.speed_m_s,
            turn_rate_rad_s: step.command.turn_rate_rad_s,
            look_at: step
                .look_at
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
            scan: scan.map(|report| Py::new(py, Heard::of(py, report))).transpose()?,
            reports: heard.iter().map(|report| Py::new(py, Heard::of(py, report))).collect::<PyResult<_>>()?,
            cues: cues.iter().map(|cue| Py::new(py, Cued::of(cue))).collect::<PyResult<_>>()?,
            intruders: traffic.iter().map(|told| Py::new(py, Intruder::of(py, told))).collect::<PyResult<_>>()?,
            picture,
            product: product.map(|command| Py::new(py, command)).transpose()?,
        })
    }
}

/// The team's picture: targets that are known and not lost, and the groups they are in. T targets, G groups, U UAVs, each
/// by ascending number.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct Picture {
    /// ``(T,)``: what sensors call the targets.
    target: Py<PyArray1<i64>>,
    /// ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
    state: Py<PyArray2<f64>>,
    /// ``(T, 6, 6)``: covariance of ``state``.
    covariance: Py<PyArray3<f64>>,
    /// ``(T,)``: it was measured at this instant.
    held: Py<PyArray1<bool>>,
    /// ``(T,)``: the group whose duty it is; -1: none.
    target_group: Py<PyArray1<i64>>,
    /// ``(G,)``: the groups.
    group: Py<PyArray1<i64>>,
    /// ``(G, 4)``: centre of the orbit and how it moves: x_m, y_m, vx_m_s, vy_m_s.
    centre: Py<PyArray2<f64>>,
    /// ``(G,)``: from the centre to the furthest member, m.
    spread_m: Py<PyArray1<f64>>,
    /// ``(G,)``: standoff distance r_d (15), m.
    standoff_distance_m: Py<PyArray1<f64>>,
    /// ``(U,)``: UAVs heard of late.
    uav: Py<PyArray1<i64>>,
    /// ``(U,)``: the group that each serves; -1: none.
    uav_group: Py<PyArray1<i64>>,
    /// ``(U, 5)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
    uav_state: Py<PyArray2<f64>>,
    /// ``(U, 2)``: altitude_m, climb_rate_m_s; None: altitudes are not flown. NaN: a UAV does not tell its own.
    uav_vertical: Option<Py<PyArray2<f64>>>,
}

/// The name of a group in a choice, or -1: no larger than a signed number may be.
fn name(group: Option<standoff::GroupId>) -> i64 {
    group.map_or(-1, |group| group.0.cast_signed())
}

impl Picture {
    pub(super) fn of(py: Python<'_>, kept: &Kept) -> Self {
        let live: Vec<&Known> = kept.known().iter().filter(|known| !known.track.is_lost()).collect();
        let whole = |of: &dyn Fn(&Known) -> i64| one(py, live.iter().map(|known| of(known)).collect());
        let states = live.iter().flat_map(|known| <[f64; 6]>::from(known.track.estimate().state.0)).collect();
        let covariances =
            live.iter().flat_map(|known| known.track.estimate().covariance.matrix().as_slice().to_vec()).collect();
        let centres = kept.groups.iter().flat_map(|group| {
            let centre = group.centre.estimate().state;
            let (at, velocity) = (centre.position(), centre.velocity());
            [at.x_m(), at.y_m(), velocity.x_m_s(), velocity.y_m_s()]
        });
        let of_groups = |of: &dyn Fn(&standoff::Group) -> f64| one(py, kept.groups.iter().map(of).collect());
        let number =
            |group: Option<standoff::GroupId>| group.and_then(|group| kept.number(group)).map_or(-1, i64::from);
        let is_discarded = |known: &Known| matches!(known.membership, Membership::Discarded);
        let flying = kept.team.iter().flat_map(|mate| level(&mate.state));
        let is_flown = kept.team.iter().any(|mate| mate.state.vertical.is_some());
        let vertical = kept.team.iter().flat_map(|mate| {
            mate.state.vertical.map_or([f64::NAN; 2], |vertical| [vertical.altitude_m, vertical.climb_rate_m_s])
        });
        Self {
            target: whole(&|known| known.track.label.0.into()),
            state: two(py, states, 6),
            covariance: three(py, covariances),
            held: one(py, live.iter().map(|known| known.track.status == TrackStatus::Held).collect()),
            target_group: whole(&|known| number(known.group().filter(|_| !is_discarded(known)))),
            group: one(py, kept.groups.iter().map(|group| number(Some(group.id))).collect()),
            centre: two(py, centres.collect(), 4),
            spread_m: of_groups(&|group| group.spread.distance_m),
            standoff_distance_m: of_groups(&|group| group.standoff.distance_m),
            uav: one(py, kept.team.iter().map(|mate| i64::from(mate.uav.0)).collect()),
            uav_group: one(py, kept.team.iter().map(|mate| number(mate.group)).collect()),
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
    // Whatever its length is, it was made of whole rows.
    let shaped = numbers.into_pyarray(py).reshape([rows, columns]);
    fixed(shaped.unwrap_or_else(|_| PyArray2::zeros(py, [0, columns], false)))
}

fn three(py: Python<'_>, numbers: Vec<f64>) -> Py<PyArray3<f64>> {
    let matrices = numbers.len() / 36;
    let shaped = numbers.into_pyarray(py).reshape([matrices, 6, 6]);
    fixed(shaped.unwrap_or_else(|_| PyArray3::zeros(py, [0, 6, 6], false)))
}

/// What several laws are shown none of them changes.
fn fixed<T: numpy::Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Py<PyArray<T, D>> {
    // An array that could not be fixed is right all the same.
    let _ = array.getattr("flags").and_then(|flags| flags.setattr("writeable", false));
    array.unbind()
}

/// What a law that assigns chooses from: U UAVs and G groups, each by ascending number.
#[pyclass(frozen, get_all, module = "standoff")]
pub(crate) struct Choice {
    /// Time since the start of the mission, s.
    time_s: f64,
    /// ``(U,)``: the UAVs that can be assigned.
    uav: Py<PyArray1<i64>>,
    /// ``(U, 2)``: where they are: x_m, y_m.
    position: Py<PyArray2<f64>>,
    /// ``(U,)``: the group that each serves until now, by its id; -1: none.
    serves: Py<PyArray1<i64>>,
    /// ``(G,)``: the groups' ids, which tell them apart and nothing else.
    group: Py<PyArray1<i64>>,
    /// For each group where its targets are, ``(n, 2)``: x_m, y_m.
    members: Vec<Py<PyArray2<f64>>>,
}

impl Choice {
    pub(super) fn of(py: Python<'_>, now: Time, uavs: &[AvailableUav], sites: &[Site<'_>]) -> PyResult<Self> {
        let places = |places: &[standoff::Position]| {
            two(py, places.iter().flat_map(|place| [place.x_m(), place.y_m()]).collect(), 2)
        };
        let positions: Vec<_> = uavs.iter().map(|uav| uav.position).collect();
        Ok(Self {
            time_s: now.s(),
            uav: one(py, uavs.iter().map(|uav| i64::from(uav.uav.0)).collect()),
            position: places(&positions),
            serves: one(py, uavs.iter().map(|uav| name(uav.serves)).collect()),
            group: one(py, sites.iter().map(|site| name(Some(site.group))).collect()),
            members: sites.iter().map(|site| places(site.members)).collect(),
        })
    }
}
