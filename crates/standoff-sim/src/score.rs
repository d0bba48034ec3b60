//! Scores of a run, from its record alone: frame by frame, in bounded memory. `docs/metrics.md` defines each.

mod agreement;
mod bound;
mod calm;
#[cfg(test)]
mod fixtures;
mod innovation;
mod judged;
mod mean;
mod metrics;
mod minds;
mod rules;
mod separation;
mod surprise;
mod tally;
mod true_orbits;
mod zones;

use nalgebra::{SMatrix, SVector};
use standoff::{Covariance, Displacement, OrbitMotion, Position, math};

use crate::frame::{Frame, GroupRow, TrackRow, TruthRow};
use crate::geometry::{
    Known, at, centre, existing, group_of, lines_of_sight_rad, off_orbit_m, position_error_m, track_of,
};
use agreement::Agreement;
use bound::Bound;
use calm::Calm;
use innovation::Innovations;
use mean::Mean;
use minds::{Minds, Scores};
use separation::{Separations, take_least};
use surprise::Surprises;
use tally::{Sums, Tallies};
use true_orbits::TrueOrbits;
use zones::Zones;

pub use bound::Bound as PositionBound;
pub use judged::{Custody, Judge, Judged};
pub use metrics::{About, BadEnd, Choice, Chosen, Metrics};
pub use rules::Rules;
pub use tally::TargetScore;

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
    calm: bool,
    coverage: bool,
    events: bool,
    zones: bool,
    agreement: bool,
}

impl Wanted {
    fn of(choice: Choice) -> Self {
        Self {
            estimates: choice.wants(&[
                "position_error_m",
                "position_error_one_m",
                "position_error_more_m",
                "velocity_error_m_s",
                "position_error_all_m",
            ]),
            consistency: choice.wants(&["anees", "anees_quiet", "anees_manoeuvring"]),
            orbits: choice.wants(&[
                "standoff_distance_m",
                "standoff_error_m",
                "standoff_tracking_error_m",
                "standoff_error_m_settled",
                "standoff_tracking_error_m_settled",
                "standoff_error_instant_m_settled",
                "phase_error_deg",
                "separation_min_group_m",
            ]),
            separation: choice.wants(&[
                "separation_min_m",
                "separation_min_layer_m",
                "separation_violations",
                "separation_time_s",
            ]),
            line_of_sight: choice.wants(&["line_of_sight_deg", "line_of_sight_max_deg"]),
            tallies: choice.wants(&[
                "watched_fraction",
                "seen_fraction",
                "longest_gap_s",
                "refound_fraction",
                "refind_time_s",
                "out_of_view_fraction",
                "out_of_view_longest_s",
                "anees_quiet",
                "anees_manoeuvring",
            ]),
            limits: choice.wants(&["infeasible_fraction", "turn_rate_saturated_fraction"]),
            calm: choice.wants(&["speed_saturated_fraction", "turn_reversals_per_min", "reassignments_per_uav_min"]),
            coverage: choice.wants(&["uncovered_fraction"]),
            events: choice.wants(&["handoffs", "discards"]),
            zones: choice.wants(&["zone_violations", "zone_detour_fraction"]),
            agreement: choice.wants(Metrics::AGREEMENT),
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
    so_far: SoFar,
    tallies: Tallies,
    calm: Calm,
    separations: Separations,
    zones: Zones,
    bound: Option<Bound>,
    innovations: Option<Innovations>,
    surprises: Option<Surprises>,
    /// The groups that are served by UAVs whose sensor is pointed, one by each.
    served: Vec<u32>,
    /// The targets known at this instant that exist.
    known: Vec<Known>,
    true_orbits: TrueOrbits,
    agreement: Agreement,
    minds: Minds<Self>,
    /// What of the choice each of several minds has of its own.
    of_pictures: Choice,
    /// Where the UAVs on an orbit are: room that lives on.
    crew: Vec<Position>,
    from_centre: Vec<Displacement>,
}

/// What the frames have come to, for the metrics of these names.
#[derive(Debug, Clone, Default)]
struct SoFar {
    position: Mean,
    position_one: Mean,
    position_more: Mean,
    velocity: Mean,
    position_all: Mean,
    distance: Mean,
    standoff: Mean,
    tracking: Mean,
    standoff_settled: Mean,
    instant_settled: Mean,
    tracking_settled: Mean,
    phase_deg: Mean,
    line_of_sight_deg: Mean,
    line_of_sight_max_deg: Option<f64>,
    uncovered: Mean,
    infeasible: Mean,
    saturated: Mean,
    separation_min_group_m: Option<f64>,
    handoffs: u64,
    discards: u64,
    nees: Mean,
}

impl Scorer {
    /// A scorer that has seen nothing yet and looks for these metrics; those not chosen may be `None`.
    pub fn new(rules: Rules, choice: Choice) -> Self {
        Self {
            wanted: Wanted::of(choice),
            so_far: SoFar::default(),
            tallies: Tallies::default(),
            calm: Calm::default(),
            separations: Separations::default(),
            zones: Zones::default(),
            bound: choice.wants_bound().then(|| Bound::of(&rules)).flatten(),
            innovations: choice.wants(&["nis"]).then(|| Innovations::new(&rules)),
            surprises: choice
                .wants(&["standoff_surprise_m_settled", "standoff_tracking_surprise_m_settled"])
                .then(|| Surprises::new(rules.clone())),
            served: Vec::new(),
            known: Vec::new(),
            true_orbits: TrueOrbits::default(),
            agreement: Agreement::default(),
            minds: Minds::default(),
            of_pictures: choice.of_pictures(),
            crew: Vec::new(),
            from_centre: Vec::new(),
            rules,
        }
    }

    /// Takes in the next frame.
    pub fn frame(&mut self, frame: &Frame) {
        let wanted = self.wanted;
        if wanted.tallies {
            self.tallies.frame(&self.rules.sensor, frame);
        }
        self.served.clear();
        let pointed = frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some());
        self.served.extend(pointed.filter_map(|uav| uav.group));
        self.known.clear();
        for (track, truth) in existing(frame) {
            self.known.push(Known::of(track, truth));
            if wanted.estimates || wanted.consistency {
                self.estimate(track, truth);
            }
        }
        if wanted.orbits || self.surprises.is_some() {
            self.true_orbits.next(&self.rules, &frame.groups, &self.known);
        }
        if wanted.orbits {
            frame.groups.iter().for_each(|group| self.orbit(frame, group));
        }
        if wanted.separation {
            self.separations.frame(&self.rules.separation, frame);
        }
        if wanted.line_of_sight {
            self.lines_of_sight(frame);
        }
        if wanted.limits {
            for uav in &frame.uavs {
                let group = group_of(frame, uav);
                self.so_far.infeasible.add(f64::from(group.is_some_and(|group| !group.feasible)));
                self.so_far.saturated.add(f64::from(uav.turn_rate_limited));
            }
        }
        if wanted.calm {
            self.calm.frame(frame);
        }
        if wanted.zones && !self.rules.airspace.is_empty() {
            self.zones.frame(&self.rules.airspace, frame);
        }
        if wanted.coverage {
            for truth in &frame.truth {
                let covered = track_of(frame, truth.target).is_some_and(|track| track.group.is_some());
                self.so_far.uncovered.add(f64::from(!covered));
            }
        }
        if wanted.events {
            let count = |kind: &str| frame.events.iter().filter(|event| event.kind == kind).count() as u64;
            self.so_far.handoffs += count("handoff-completed");
            self.so_far.discards += count("discarded");
        }
        if wanted.agreement {
            self.agreement.frame(frame);
        }
        if !self.of_pictures.is_empty() {
            self.minds.frame(frame, || Self::new(self.rules.clone(), self.of_pictures));
        }
        if let Some(bound) = &mut self.bound {
            bound.frame(frame);
        }
        if let Some(innovations) = &mut self.innovations {
            innovations.frame(frame);
        }
        if let Some(surprises) = &mut self.surprises {
            surprises.frame(frame, &self.true_orbits);
        }
    }

    /// The scores so far.
    pub fn metrics(&self) -> Metrics {
        let [position, velocity] = self.bound.as_ref().map(Bound::efficiencies).unwrap_or_default();
        let period_s = self.rules.period_s;
        let Sums { watched, seen, unseen, longest_gap, longest_streak, refound, refind } = self.tallies.sums();
        let Agreement { differ, lag_s, lag_max_s, double_served, double_count, .. } = &self.agreement;
        let [bytes_per_s, bytes_max_per_s] = self.agreement.bytes_per_s(period_s);
        let [quiet, manoeuvring] = self.tallies.consistency(&self.rules.manoeuvring);
        let metrics = Metrics {
            watched_fraction: watched.value(),
            seen_fraction: seen.value(),
            longest_gap_s: seen.value().map(|_| longest_gap as f64 * period_s),
            refound_fraction: refound.value(),
            refind_time_s: refind.value().map(|instants| instants * period_s),
            position_error_m: self.so_far.position.value(),
            position_error_one_m: self.so_far.position_one.value(),
            position_error_more_m: self.so_far.position_more.value(),
            velocity_error_m_s: self.so_far.velocity.value(),
            position_error_all_m: self.so_far.position_all.value(),
            standoff_distance_m: self.so_far.distance.value(),
            standoff_error_m: self.so_far.standoff.value(),
            standoff_tracking_error_m: self.so_far.tracking.value(),
            standoff_error_m_settled: self.so_far.standoff_settled.value(),
            standoff_error_instant_m_settled: self.so_far.instant_settled.value(),
            standoff_tracking_error_m_settled: self.so_far.tracking_settled.value(),
            phase_error_deg: self.so_far.phase_deg.value(),
            line_of_sight_deg: self.so_far.line_of_sight_deg.value(),
            line_of_sight_max_deg: self.so_far.line_of_sight_max_deg,
            out_of_view_fraction: unseen.value(),
            out_of_view_longest_s: unseen.value().map(|_| longest_streak as f64 * period_s),
            uncovered_fraction: self.so_far.uncovered.value(),
            infeasible_fraction: self.so_far.infeasible.value(),
            turn_rate_saturated_fraction: self.so_far.saturated.value(),
            speed_saturated_fraction: self.calm.speed_saturated.value(),
            turn_reversals_per_min: self.calm.reversals_per_min(period_s),
            reassignments_per_uav_min: self.calm.reassignments_per_min(period_s),
            separation_min_m: self.separations.min_m,
            separation_min_layer_m: self.separations.min_layer_m,
            separation_min_group_m: self.so_far.separation_min_group_m,
            separation_violations: self.separations.has_pairs.then_some(self.separations.violations),
            separation_time_s: self.separations.has_pairs.then_some(self.separations.avoiding as f64 * period_s),
            zone_violations: self.zones.violations(),
            zone_detour_fraction: self.zones.detour.value(),
            handoffs: self.wanted.events.then_some(self.so_far.handoffs),
            discards: self.wanted.events.then_some(self.so_far.discards),
            crews_differ_fraction: differ.value(),
            agreement_delay_s: self.agreement.delay_s(self.rules.faults_end_s),
            double_served_fraction: double_served.value(),
            commit_lag_s: lag_s.value(),
            commit_lag_max_s: *lag_max_s,
            bytes_per_s,
            bytes_max_per_s,
            double_count: *double_count,
            anees: self.so_far.nees.value(),
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
        };
        self.minds.average(metrics).only_by(self.rules.reported)
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
        let [_, vx_m_s, _, _, vy_m_s, _] = track.state;
        let position_error_m = position_error_m(track, truth);
        self.so_far.position_all.add(position_error_m);
        if let Some(group) = track.group {
            self.so_far.position.add(position_error_m);
            match self.served.iter().filter(|served| **served == group).count() {
                0 => {}
                1 => self.so_far.position_one.add(position_error_m),
                _ => self.so_far.position_more.add(position_error_m),
            }
            self.so_far.velocity.add(Displacement::from_m(vx_m_s - truth.vx_m_s, vy_m_s - truth.vy_m_s).length_m());
            let nees = self.wanted.consistency.then(|| nees_per_state(&self.rules, track, truth)).flatten();
            if let Some(nees) = nees {
                self.so_far.nees.add(nees);
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
        let centre = centre(group);
        for (index, uav) in self.crew.iter().enumerate() {
            let error_m = off_orbit_m(*uav, centre, group.standoff_distance_m).abs();
            self.so_far.distance.add(group.standoff_distance_m);
            self.so_far.tracking.add(error_m);
            if settled {
                self.so_far.tracking_settled.add(error_m);
            }
            for other in &self.crew[index + 1..] {
                take_least(&mut self.so_far.separation_min_group_m, uav.distance_m(*other));
            }
        }

        let Some(orbit) = self.true_orbits.of(group.group) else { return };
        for uav in &self.crew {
            let off_m = |orbit: &OrbitMotion| off_orbit_m(*uav, orbit.centre, orbit.radius_m).abs();
            let error_m = off_m(&orbit.flown);
            self.so_far.standoff.add(error_m);
            if settled {
                self.so_far.standoff_settled.add(error_m);
                self.so_far.instant_settled.add(off_m(&orbit.at_once));
            }
        }
        self.from_centre.clear();
        self.from_centre.extend(self.crew.iter().map(|uav| *uav - orbit.flown.centre));
        if let Some(error_deg) = phase_error_deg(&self.from_centre, self.rules.separation_rad) {
            self.so_far.phase_deg.add(error_deg);
        }
    }

    /// How far off the boresights the members are. Before the sensors were first pointed there is nothing to judge.
    fn lines_of_sight(&mut self, frame: &Frame) {
        // By twos, which are worked on side by side (SIMD); a last one alone beside itself.
        for pair in frame.uavs.chunks(2) {
            let angles_rad = lines_of_sight_rad([&pair[0], &pair[pair.len() - 1]], &self.known);
            for angle_rad in angles_rad.into_iter().take(pair.len()).flatten() {
                let largest_deg = angle_rad.to_degrees();
                self.so_far.line_of_sight_deg.add(largest_deg);
                self.so_far.line_of_sight_max_deg =
                    Some(self.so_far.line_of_sight_max_deg.map_or(largest_deg, |most| most.max(largest_deg)));
            }
        }
    }
}

impl Scores for Scorer {
    fn frame(&mut self, frame: &Frame) {
        self.frame(frame);
    }

    fn metrics(&self) -> Metrics {
        self.metrics()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Reported, UavRow};
    use crate::run::Mission;
    use crate::scenario::{Edits, Scenario};
    use crate::score::fixtures::{group_row, track_row, truth_row, uav_row};
    use standoff::CentreEstimate;

    fn score(rules: &Rules, frames: &[Frame]) -> Metrics {
        let mut scorer = Scorer::new(rules.clone(), Choice::ALL);
        frames.iter().for_each(|frame| scorer.frame(frame));
        scorer.metrics()
    }

    /// The smallest circle about these four is held by the second and third: its centre is (160, 120) m, its radius 200 m.
    /// Their centroid is (90, 70) m, and the second is 100 sqrt(5.78) m from it. Two UAVs are 500 m east and north of the
    /// circle's centre, a right angle apart, as they should be.
    #[test]
    fn orbits_are_judged_about_the_centre_by_the_rule_flown() {
        let rules = Rules { centre: CentreEstimate::SmallestCircle, separation_rad: math::PI / 2.0, ..flown().0 };
        let places_m = [(0.0, 0.0), (320.0, 0.0), (0.0, 240.0), (40.0, 40.0)];
        let mut frame = Frame { time_us: 100_000_000, ..Frame::default() };
        frame.truth.extend((0..).zip(places_m).map(|(target, (x_m, y_m))| truth_row(target, x_m, y_m)));
        frame.tracks.extend((0..4).map(|target| track_row(target, Some(0))));
        frame.groups.push(GroupRow { x_m: 160.0, y_m: 123.0, ..group_row(0) });
        let uav = |uav: u32, x_m: f64, y_m: f64| UavRow { x_m, y_m, ..uav_row(uav) };
        frame.uavs.extend([uav(0, 660.0, 120.0), uav(1, 160.0, 620.0)]);
        let half_rad = 0.5 * (rules.standoff.field_of_view_rad - rules.standoff.field_of_view_margin_rad);
        let r_d_m = |d_max_m: f64| d_max_m / math::sin(half_rad);
        let near = |value: Option<f64>, wanted: f64| (value.unwrap() - wanted).abs() < 1e-9;

        let metrics = score(&rules, std::slice::from_ref(&frame));
        assert!(near(metrics.standoff_error_m, 500.0 - r_d_m(200.0)), "{metrics:?}");
        assert!(near(metrics.standoff_error_m_settled, 500.0 - r_d_m(200.0)) && near(metrics.phase_error_deg, 0.0));
        assert!(near(metrics.standoff_error_instant_m_settled, 500.0 - r_d_m(200.0)));
        let mut judge = Judge::new(rules.clone());
        let judged = judge.frame(&frame);
        assert!(near(judged.standoff_error_m(&frame.uavs[1]), 500.0 - r_d_m(200.0)));
        assert!(near(judged.centre_error_m(&frame.groups[0]), 3.0));

        let centroid = Rules { centre: CentreEstimate::Centroid, ..rules.clone() };
        let off_m = Displacement::from_m(570.0, 50.0).length_m() - r_d_m(100.0 * 5.78f64.sqrt());
        let mut judge = Judge::new(centroid.clone());
        let judged = judge.frame(&frame);
        assert!(near(judged.standoff_error_m(&frame.uavs[0]), off_m));
        assert_eq!(
            score(&centroid, &[frame.clone()]),
            score(&Rules { centre: CentreEstimate::Filtered, ..rules }, &[frame])
        );
    }

    /// Tracks at the origin of targets 3, 4 and 12 m off. One UAV serves the first's group, two the second's, and the
    /// third's another, which is out.
    #[test]
    fn position_errors_are_told_by_how_many_uavs_serve_the_group() {
        let mut frame = Frame::default();
        for (target, x_m) in (0..).zip([3.0, 4.0, 12.0]) {
            frame.truth.push(truth_row(target, x_m, 0.0));
            frame.tracks.push(track_row(target, Some(target)));
        }
        let uav = |uav: u32, group: u32| UavRow { group: Some(group), ..uav_row(uav) };
        frame.uavs = vec![uav(0, 0), uav(1, 1), uav(2, 1), UavRow { boresight_rad: None, ..uav(3, 2) }];
        let errors_m = |frame: &Frame| {
            let metrics = score(&flown().0, std::slice::from_ref(frame));
            [metrics.position_error_m, metrics.position_error_one_m, metrics.position_error_more_m]
        };
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(3.0), Some(4.0)]);
        frame.uavs[2].group = Some(2);
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(19.0 / 3.0), None]);
    }

    fn flown() -> (Rules, Vec<Frame>) {
        let scenario = Scenario::load("tour/05-a-handoff", &Edits::default(), 1).unwrap();
        let mut mission = Mission::new(&scenario).unwrap();
        (Rules::of(&scenario.settings), std::iter::from_fn(|| mission.frame().cloned()).collect())
    }

    /// What the team calls a track is its own affair: the truth of a track is that of its target.
    #[test]
    fn the_team_s_own_ids_of_tracks_change_no_score() {
        let (rules, mut frames) = flown();
        let before = score(&rules, &frames);
        for frame in &mut frames {
            frame.tracks.iter_mut().for_each(|track| track.track = 1_000 - track.target);
            frame.events.iter_mut().for_each(|event| event.track = event.target.map(|target| 1_000 - target));
        }
        assert_eq!(score(&rules, &frames), before);
        assert!(before.position_error_m.is_some() && before.nis.is_some() && before.handoffs > Some(0));
    }

    /// A brain of somebody else flies as ours does and tells nothing, or only what it believes: it is scored by what is
    /// seen and how its UAVs fly, and by its beliefs.
    #[test]
    fn what_a_brain_does_not_report_is_not_scored() {
        let (rules, mut frames) = flown();
        let whole = score(&rules, &frames);
        for frame in &mut frames {
            frame.groups.clear();
            frame.events.clear();
            frame.uavs.iter_mut().for_each(|uav| uav.group = None);
            frame.tracks.iter_mut().for_each(|track| (track.group, track.to_group) = (None, None));
        }
        let scored = |tracks: bool, frames: &[Frame]| {
            let metrics = score(&Rules { reported: Reported { tracks, ..Reported::NOTHING }, ..rules.clone() }, frames);
            let both = Metrics::NAMES.iter().zip(metrics.values().into_iter().zip(whole.values()));
            both.filter(|(_, (value, _))| value.is_some())
                .inspect(|(name, (value, whole))| {
                    assert_eq!(value, whole, "{name}");
                })
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
        };
        let beliefs = scored(true, &frames);
        frames.iter_mut().for_each(|frame| frame.tracks.clear());
        let always = [
            "seen_fraction",
            "longest_gap_s",
            "turn_rate_saturated_fraction",
            "speed_saturated_fraction",
            "turn_reversals_per_min",
            "separation_min_m",
            "separation_min_layer_m",
            "separation_violations",
            "separation_time_s",
        ];
        assert_eq!(scored(false, &frames), always);
        let more = beliefs.iter().filter(|name| !always.contains(name)).copied().collect::<Vec<_>>();
        assert_eq!(more, ["position_error_all_m", "nis"]);
        // Who does tell of tracks and groups, but has none, watches nothing.
        assert_eq!(score(&rules, &frames).watched_fraction, Some(0.0));
        let told = Rules { reported: Reported { tracks: false, ..Reported::default() }, ..rules };
        let mut scorer = Scorer::new(told, Choice::ALL);
        frames.iter().for_each(|frame| scorer.frame(frame));
        assert!(scorer.targets().all(|one| one.watched_fraction.is_none() && one.seen_fraction.is_some()));
        assert_eq!((scorer.metrics().handoffs, scorer.metrics().uncovered_fraction), (Some(0), None));
    }
}
