//! Scores of a run, from its record alone: frame by frame, in bounded memory. `docs/metrics.md` defines each.

mod bound;
mod innovation;
mod judged;
mod metrics;
mod surprise;
mod tally;

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use standoff::{Covariance, Displacement, Position, SensorParams, Spread, StandoffParams, TargetParams, math};

use crate::record::{Frame, GroupRow, TrackRow, TruthRow, UavRow};
use crate::scenario::{CueError, Noise, Settings};
use bound::Bound;
use innovation::Innovations;
use surprise::Surprises;
use tally::{Sums, Tallies};

pub use judged::{Judged, PositionBound};
pub use metrics::{About, BadEnd, Choice, Chosen, Metrics};
pub use tally::TargetScore;

/// What a score needs to know of the scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Rules {
    /// The orbit's bounds and the field of view with its margin.
    pub standoff: StandoffParams,
    /// Field of view and sensing range, and the noise that the filters assume.
    pub sensor: SensorParams,
    /// The target model that the filters assume.
    pub target: TargetParams,
    /// The model that the targets really follow, if they follow one.
    pub motion: Option<TargetParams>,
    /// The targets of that model which manoeuvre besides, by id.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// The sensors' real noise.
    pub noise: Noise,
    /// How well targets are handed over.
    pub cue: CueError,
    /// Separation of a pair, rad.
    pub separation_rad: f64,
    /// Time between two frames, s.
    pub period_s: f64,
    /// From when on the settled metrics count, s.
    pub settle_s: f64,
}

impl Rules {
    /// The rules of a mission.
    pub fn of(settings: &Settings) -> Self {
        Self {
            standoff: settings.team.group.standoff,
            sensor: settings.team.track.sensor,
            target: settings.team.track.target,
            motion: settings.motion(),
            manoeuvring: Arc::clone(&settings.manoeuvring),
            noise: settings.noise,
            cue: settings.cue,
            separation_rad: settings.team.guidance.separation_rad,
            period_s: settings.period.s(),
            settle_s: settings.settle.s(),
        }
    }
}

/// What has to be worked out for the chosen metrics.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    estimates: bool,
    consistency: bool,
    orbits: bool,
    separation: bool,
    line_of_sight: bool,
    tallies: bool,
    limits: bool,
    coverage: bool,
    events: bool,
}

impl Wanted {
    fn of(choice: Choice) -> Self {
        Self {
            estimates: choice.wants(&["position_error_m", "velocity_error_m_s", "position_error_all_m"]),
            consistency: choice.wants(&["anees", "anees_quiet", "anees_manoeuvring"]),
            orbits: choice.wants(&[
                "standoff_distance_m",
                "standoff_error_m",
                "standoff_tracking_error_m",
                "standoff_error_m_settled",
                "standoff_tracking_error_m_settled",
                "phase_error_deg",
                "separation_min_group_m",
            ]),
            separation: choice.wants(&["separation_min_m", "separation_min_layer_m"]),
            line_of_sight: choice.wants(&["line_of_sight_deg", "line_of_sight_max_deg"]),
            tallies: choice.wants(&[
                "watched_fraction",
                "seen_fraction",
                "longest_gap_s",
                "out_of_view_fraction",
                "out_of_view_longest_s",
                "anees_quiet",
                "anees_manoeuvring",
            ]),
            limits: choice.wants(&["infeasible_fraction", "turn_rate_saturated_fraction"]),
            coverage: choice.wants(&["uncovered_fraction"]),
            events: choice.wants(&["handoffs", "discards"]),
        }
    }
}

/// Scores a run as its frames come.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Edits, Scenario};
/// use standoff_sim::score::{Choice, Rules, Scorer};
///
/// let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::standard());
/// while let Some(frame) = mission.frame() {
///     scorer.frame(frame);
/// }
/// let metrics = scorer.metrics();
/// assert_eq!(metrics.out_of_view_fraction, Some(0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scorer {
    rules: Rules,
    wanted: Wanted,
    position: Mean,
    velocity: Mean,
    position_all: Mean,
    distance: Mean,
    standoff: Mean,
    tracking: Mean,
    standoff_settled: Mean,
    tracking_settled: Mean,
    phase_deg: Mean,
    line_of_sight_deg: Mean,
    line_of_sight_max_deg: Option<f64>,
    tallies: Tallies,
    uncovered: Mean,
    infeasible: Mean,
    saturated: Mean,
    separation_min_m: Option<f64>,
    separation_min_layer_m: Option<f64>,
    separation_min_group_m: Option<f64>,
    handoffs: u64,
    discards: u64,
    nees: Mean,
    bound: Option<Bound>,
    innovations: Option<Innovations>,
    surprises: Option<Surprises>,
    /// The targets known at this instant that exist.
    known: Vec<Known>,
    /// Where the UAVs on an orbit are, and the targets that it goes about: room that lives on.
    crew: Vec<Position>,
    members: Vec<Position>,
    from_centroid: Vec<Displacement>,
}

impl Scorer {
    /// A scorer that has seen nothing yet and looks for these metrics; those not chosen are `None` or 0.
    pub fn new(rules: Rules, choice: Choice) -> Self {
        Self {
            wanted: Wanted::of(choice),
            position: Mean::default(),
            velocity: Mean::default(),
            position_all: Mean::default(),
            distance: Mean::default(),
            standoff: Mean::default(),
            tracking: Mean::default(),
            standoff_settled: Mean::default(),
            tracking_settled: Mean::default(),
            phase_deg: Mean::default(),
            line_of_sight_deg: Mean::default(),
            line_of_sight_max_deg: None,
            tallies: Tallies::default(),
            uncovered: Mean::default(),
            infeasible: Mean::default(),
            saturated: Mean::default(),
            separation_min_m: None,
            separation_min_layer_m: None,
            separation_min_group_m: None,
            handoffs: 0,
            discards: 0,
            nees: Mean::default(),
            bound: choice.wants_bound().then(|| Bound::of(&rules)).flatten(),
            innovations: choice.wants(&["nis"]).then(|| Innovations::new(&rules)),
            surprises: choice
                .wants(&["standoff_surprise_m_settled", "standoff_tracking_surprise_m_settled"])
                .then(|| Surprises::new(rules.clone())),
            known: Vec::new(),
            crew: Vec::new(),
            members: Vec::new(),
            from_centroid: Vec::new(),
            rules,
        }
    }

    /// Takes in the next frame.
    pub fn frame(&mut self, frame: &Frame) {
        let wanted = self.wanted;
        if wanted.tallies {
            self.tallies.frame(&self.rules.sensor, frame);
        }
        self.known.clear();
        for (track, truth) in existing(frame) {
            self.known.push(Known::of(track, truth));
            if wanted.estimates || wanted.consistency {
                self.estimate(track, truth);
            }
        }
        if wanted.orbits {
            frame.groups.iter().for_each(|group| self.orbit(frame, group));
        }
        if wanted.separation {
            self.separations(&frame.uavs);
        }
        if wanted.line_of_sight {
            self.lines_of_sight(frame);
        }
        if wanted.limits {
            for uav in &frame.uavs {
                let group = frame.groups.iter().find(|group| Some(group.group) == uav.group);
                self.infeasible.add(f64::from(group.is_some_and(|group| !group.feasible)));
                self.saturated.add(f64::from(uav.turn_rate_limited));
            }
        }
        if wanted.coverage {
            for truth in &frame.truth {
                let covered = track_of(frame, truth.target).is_some_and(|track| track.group.is_some());
                self.uncovered.add(f64::from(!covered));
            }
        }
        if wanted.events {
            let count = |kind: &str| frame.events.iter().filter(|event| event.kind == kind).count() as u64;
            self.handoffs += count("handoff-completed");
            self.discards += count("discarded");
        }
        if let Some(bound) = &mut self.bound {
            bound.frame(frame);
        }
        if let Some(innovations) = &mut self.innovations {
            innovations.frame(frame);
        }
        if let Some(surprises) = &mut self.surprises {
            surprises.frame(frame, &self.known);
        }
    }

    /// The scores so far.
    pub fn metrics(&self) -> Metrics {
        let [position, velocity] = self.bound.as_ref().map(Bound::efficiencies).unwrap_or_default();
        let period_s = self.rules.period_s;
        let Sums { watched, seen, unseen, longest_gap, longest_streak } = self.tallies.sums();
        let [quiet, manoeuvring] = self.tallies.consistency(&self.rules.manoeuvring);
        Metrics {
            watched_fraction: watched.value(),
            seen_fraction: seen.value(),
            longest_gap_s: seen.value().map(|_| longest_gap as f64 * period_s),
            position_error_m: self.position.value(),
            velocity_error_m_s: self.velocity.value(),
            position_error_all_m: self.position_all.value(),
            standoff_distance_m: self.distance.value(),
            standoff_error_m: self.standoff.value(),
            standoff_tracking_error_m: self.tracking.value(),
            standoff_error_m_settled: self.standoff_settled.value(),
            standoff_tracking_error_m_settled: self.tracking_settled.value(),
            phase_error_deg: self.phase_deg.value(),
            line_of_sight_deg: self.line_of_sight_deg.value(),
            line_of_sight_max_deg: self.line_of_sight_max_deg,
            out_of_view_fraction: unseen.value(),
            out_of_view_longest_s: unseen.value().map(|_| longest_streak as f64 * period_s),
            uncovered_fraction: self.uncovered.value(),
            infeasible_fraction: self.infeasible.value(),
            turn_rate_saturated_fraction: self.saturated.value(),
            separation_min_m: self.separation_min_m,
            separation_min_layer_m: self.separation_min_layer_m,
            separation_min_group_m: self.separation_min_group_m,
            handoffs: self.handoffs,
            discards: self.discards,
            anees: self.nees.value(),
            anees_quiet: quiet,
            anees_manoeuvring: manoeuvring,
            standoff_surprise_m_settled: self.surprises.as_ref().and_then(|surprises| surprises.truth.value()),
            standoff_tracking_surprise_m_settled: self.surprises.as_ref().and_then(|surprises| surprises.own.value()),
            nis: self.innovations.as_ref().and_then(Innovations::value),
            position_bound_ratio: position.ratio(),
            velocity_bound_ratio: velocity.ratio(),
            position_squared_error_m2: position.squared_error.value(),
            position_bound_m2: position.bound.value(),
            velocity_squared_error_m2_s2: velocity.squared_error.value(),
            velocity_bound_m2_s2: velocity.bound.value(),
        }
    }

    /// How each target fared that has existed, by id. Nobody is in it unless a metric that needs it was chosen.
    pub fn targets(&self) -> impl Iterator<Item = TargetScore> {
        self.tallies.scores(&self.rules)
    }

    /// Mean number of targets that there were at an instant after the first cue; `None` if there was none.
    pub fn targets_mean(&self) -> Option<f64> {
        self.tallies.targets_mean()
    }

    /// How far an estimate is from the truth.
    fn estimate(&mut self, track: &TrackRow, truth: &TruthRow) {
        let [x_m, vx_m_s, _, y_m, vy_m_s, _] = track.state;
        let position_error_m = Position::from_m(x_m, y_m).distance_m(position(truth));
        self.position_all.add(position_error_m);
        if track.group.is_some() {
            self.position.add(position_error_m);
            self.velocity.add(Displacement::from_m(vx_m_s - truth.vx_m_s, vy_m_s - truth.vy_m_s).length_m());
            let nees = self.wanted.consistency.then(|| nees_per_state(&self.rules, track, truth)).flatten();
            if let Some(nees) = nees {
                self.nees.add(nees);
            }
            if self.wanted.tallies {
                self.tallies.estimate(track.target, position_error_m, nees);
            }
        }
    }

    /// Radii, phases and distances of the UAVs on one orbit.
    fn orbit(&mut self, frame: &Frame, group: &GroupRow) {
        let settled = frame.time_us as f64 / 1e6 >= self.rules.settle_s;
        self.crew.clear();
        self.crew.extend(frame.uavs.iter().filter(|uav| uav.group == Some(group.group)).map(at));
        let centre = Position::from_m(group.x_m, group.y_m);
        for (index, uav) in self.crew.iter().enumerate() {
            let error_m = (uav.distance_m(centre) - group.standoff_distance_m).abs();
            self.distance.add(group.standoff_distance_m);
            self.tracking.add(error_m);
            if settled {
                self.tracking_settled.add(error_m);
            }
            for other in &self.crew[index + 1..] {
                take_least(&mut self.separation_min_group_m, uav.distance_m(*other));
            }
        }

        self.members.clear();
        self.members.extend(on_orbit(&self.known, group.group));
        let Some(centroid) = centroid(&self.members) else { return };
        let standoff_m = standoff_m(&self.rules, &self.members, centroid, 0.0);
        for uav in &self.crew {
            let error_m = (uav.distance_m(centroid) - standoff_m).abs();
            self.standoff.add(error_m);
            if settled {
                self.standoff_settled.add(error_m);
            }
        }
        self.from_centroid.clear();
        self.from_centroid.extend(self.crew.iter().map(|uav| *uav - centroid));
        if let Some(error_deg) = phase_error_deg(&self.from_centroid, self.rules.separation_rad) {
            self.phase_deg.add(error_deg);
        }
    }

    /// Distances of any two UAVs. Those of which nobody knows that their altitudes differ share one.
    fn separations(&mut self, uavs: &[UavRow]) {
        for (index, uav) in uavs.iter().enumerate() {
            for other in &uavs[index + 1..] {
                let distance_m = at(uav).distance_m(at(other));
                take_least(&mut self.separation_min_m, distance_m);
                if uav.altitude_m.zip(other.altitude_m).is_none_or(|(one_m, other_m)| one_m == other_m) {
                    take_least(&mut self.separation_min_layer_m, distance_m);
                }
            }
        }
    }

    /// How far off the boresights the members are. Before the sensors were first pointed there is nothing to judge.
    fn lines_of_sight(&mut self, frame: &Frame) {
        // By twos, which are worked on side by side; a last one alone beside itself.
        for pair in frame.uavs.chunks(2) {
            let both = [&pair[0], &pair[pair.len() - 1]];
            let boresights = math::sin_cos_each(both.map(|uav| uav.boresight_rad.unwrap_or_default()));
            let largest: [_; 2] = std::array::from_fn(|i| self.furthest_off(both[i], boresights[i]));
            let angles_rad = math::atan2_each(largest.map(Option::unwrap_or_default));
            for (angle_rad, _) in angles_rad.iter().zip(largest).take(pair.len()).filter(|(_, off)| off.is_some()) {
                let largest_deg = angle_rad.to_degrees();
                self.line_of_sight_deg.add(largest_deg);
                self.line_of_sight_max_deg =
                    Some(self.line_of_sight_max_deg.map_or(largest_deg, |most| most.max(largest_deg)));
            }
        }
    }

    /// The member of the UAV's group furthest off its boresight, of which there are the sine and cosine: how far it is
    /// across it and along it, m. `None` where nothing is to be judged.
    fn furthest_off(&self, uav: &UavRow, (sin, cos): (f64, f64)) -> Option<(f64, f64)> {
        let group = uav.group.filter(|_| uav.boresight_rad.is_some())?;
        let off = |member: Position| {
            let member_rel_uav = member - at(uav);
            let (x, y) = (member_rel_uav.x_m(), member_rel_uav.y_m());
            ((cos * y - sin * x).abs(), cos * x + sin * y)
        };
        let is_larger = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 > b.0 * a.1;
        in_duty(&self.known, group).map(off).reduce(|a, b| if is_larger(b, a) { b } else { a })
    }
}

/// Distance of the UAVs' phases about a centre from where they should be, degrees: a pair at the wanted separation either way round,
/// more than two evenly spaced (averaged over the gaps). `None` for fewer than two.
fn phase_error_deg(uavs_rel_centre: &[Displacement], separation_rad: f64) -> Option<f64> {
    match uavs_rel_centre {
        [] | [_] => None,
        [a, b] => {
            let (a, b) = (a.vector(), b.vector());
            let apart_rad = math::atan2(a.perp(&b).abs(), a.dot(&b));
            Some((apart_rad - separation_rad).abs().to_degrees())
        }
        _ => {
            let mut around: Vec<f64> = uavs_rel_centre.iter().map(|uav| uav.direction().deg()).collect();
            around.sort_by(f64::total_cmp);
            let n = around.len();
            let even_deg = 360.0 / n as f64;
            let gap_deg = |index: usize| {
                let wrap_deg = if index + 1 == n { 360.0 } else { 0.0 };
                around[(index + 1) % n] + wrap_deg - around[index]
            };
            Some((0..n).map(|index| (gap_deg(index) - even_deg).abs()).sum::<f64>() / n as f64)
        }
    }
}

/// Normalised estimation error squared over the number of states that are random: all six where the truth knows the
/// acceleration and the filter allows for one, else position and velocity.
fn nees_per_state(rules: &Rules, track: &TrackRow, truth: &TruthRow) -> Option<f64> {
    let covariance = Covariance::from_upper_triangle(&track.covariance).matrix();
    let [x_m, vx_m_s, ax_m_s2, y_m, vy_m_s, ay_m_s2] = track.state;
    let error = [x_m - truth.x_m, vx_m_s - truth.vx_m_s, y_m - truth.y_m, vy_m_s - truth.vy_m_s];
    let is_random = rules.target.acceleration_sd_m_s2 >= LEAST_ACCELERATION_SD_M_S2;
    if let (true, Some(true_ax), Some(true_ay)) = (is_random, truth.ax_m_s2, truth.ay_m_s2) {
        let [x, vx, y, vy] = error;
        return normalised(&SVector::from([x, vx, ax_m_s2 - true_ax, y, vy, ay_m_s2 - true_ay]), &covariance);
    }
    const POSITION_AND_VELOCITY: [usize; 4] = [0, 1, 3, 4];
    let part = SMatrix::from_fn(|row, column| covariance[(POSITION_AND_VELOCITY[row], POSITION_AND_VELOCITY[column])]);
    normalised(&SVector::from(error), &part)
}

/// A filter that is told of less assumes this, so that its covariance has an inverse: its targets' acceleration, which it
/// takes for known, is no random number.
const LEAST_ACCELERATION_SD_M_S2: f64 = 1e-6;

fn normalised<const N: usize>(error: &SVector<f64, N>, covariance: &SMatrix<f64, N, N>) -> Option<f64> {
    let cholesky = nalgebra::Cholesky::new(*covariance)?;
    Some(error.dot(&cholesky.solve(error)) / N as f64)
}

/// Keeps the smaller one.
fn take_least(least: &mut Option<f64>, value: f64) {
    *least = Some(least.map_or(value, |least| least.min(value)));
}

fn at(uav: &UavRow) -> Position {
    Position::from_m(uav.x_m, uav.y_m)
}

fn position(truth: &TruthRow) -> Position {
    Position::from_m(truth.x_m, truth.y_m)
}

/// r_d (15) of members about a centre, m.
fn standoff_m(rules: &Rules, members: &[Position], centre: Position, margin_m: f64) -> f64 {
    let squared_m2 = members.iter().map(|member| member.squared_distance_m2(centre));
    let spread = Spread { distance_m: squared_m2.fold(0.0, f64::max).sqrt(), rate_m_s: 0.0 };
    rules.standoff.distance(spread, margin_m).distance_m
}

fn centroid(positions: &[Position]) -> Option<Position> {
    let n = positions.len() as f64;
    let sum = positions.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x_m(), y + p.y_m()));
    (!positions.is_empty()).then(|| Position::from_m(sum.0 / n, sum.1 / n))
}

/// A known target that exists: where it really is, and the groups of its track.
#[derive(Debug, Clone, Copy)]
struct Known {
    position: Position,
    group: Option<u32>,
    to_group: Option<u32>,
}

impl Known {
    fn of(track: &TrackRow, truth: &TruthRow) -> Self {
        Self { position: position(truth), group: track.group, to_group: track.to_group }
    }
}

/// The tracks of targets that exist, and the truth about them. Both come in the same order: walked side by side.
fn existing(frame: &Frame) -> impl Iterator<Item = (&TrackRow, &TruthRow)> {
    let mut next = 0;
    frame.tracks.iter().filter_map(move |track| {
        while frame.truth.get(next).is_some_and(|truth| truth.target < track.target) {
            next += 1;
        }
        frame.truth.get(next).filter(|truth| truth.target == track.target).map(|truth| (track, truth))
    })
}

/// The known targets that exist.
fn known(frame: &Frame) -> impl Iterator<Item = Known> {
    existing(frame).map(|(track, truth)| Known::of(track, truth))
}

/// Where the existing targets are that a group has to keep in view: those in dwell to it are not its duty yet.
fn in_duty(known: &[Known], group: u32) -> impl Iterator<Item = Position> {
    known.iter().filter(move |known| known.group == Some(group)).map(|known| known.position)
}

/// Where the existing targets are that a group's orbit goes about, those in dwell from and to it included.
fn on_orbit(known: &[Known], group: u32) -> impl Iterator<Item = Position> {
    known.iter().filter(move |known| [known.group, known.to_group].contains(&Some(group))).map(|known| known.position)
}

fn truth_of(frame: &Frame, target: u32) -> Option<&TruthRow> {
    let index = frame.truth.binary_search_by_key(&target, |truth| truth.target).ok()?;
    Some(&frame.truth[index])
}

fn track_of(frame: &Frame, target: u32) -> Option<&TrackRow> {
    let index = frame.tracks.binary_search_by_key(&target, |track| track.target).ok()?;
    Some(&frame.tracks[index])
}

/// A running mean.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    n: u64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.n += 1;
    }

    fn value(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }

    fn and(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, n: self.n + other.n }
    }
}
