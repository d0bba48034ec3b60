//! Scores of a run, computed from its record frame by frame in bounded memory. `docs/user/metrics.md` defines each metric.

// The fixtures that tests of several crates share use the same paths here as there.
#[cfg(test)]
extern crate self as standoff_score;

mod agreement;
mod association;
mod buildings;
mod by_id;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
mod config;
mod control_effort;
mod cramer_rao;
mod flown_path;
mod frame_metrics;
mod geofence;
pub mod geometry;
mod innovation;
pub mod matching;
mod mean;
mod metrics;
#[cfg(test)]
#[path = "../../standoff-sim/tests/common/mod.rs"]
mod missions;
mod nees;
mod per_agent;
mod per_target;
mod prediction_error;
#[cfg(test)]
#[path = "../../standoff-record/tests/common/mod.rs"]
mod row_fixtures;
mod separation;
mod transit;
mod true_orbits;

use standoff::by_group::ByGroup;
use standoff::guidance::orbit_motion::OrbitMotion;
use standoff::math;
use standoff::{Displacement, Position};
use standoff_record::{Frame, GroupRow};

use crate::geometry::{Coverage, at, centre, group_of, off_boresight_angles_rad, off_orbit_m};
use crate::matching::{Matched, Matching};
use agreement::Agreement;
use association::AssociationScores;
use control_effort::ControlEffort;
use cramer_rao::Bound;
use flown_path::PathModel;
use geofence::Zones;
use innovation::Innovations;
use mean::Mean;
use nees::nees_per_state;
use per_agent::{Grouped, PerAgentScores, Scores};
use per_target::{Sums, Tallies};
use prediction_error::PredictionErrors;
use separation::{SeparationRules, Separations};
use transit::Transit;
use true_orbits::TrueOrbits;

pub use buildings::{BUILDING_HEIGHT_MAX_M, BUILDING_VERTICES_MAX, BUILDINGS_MAX, Building, Buildings};
pub use config::{CueError, Noise, ScoreConfig};
pub use cramer_rao::Bound as PositionBound;
pub use frame_metrics::{CustodyCounts, FrameScorer, FrameScores};
pub use metrics::{MetricInfo, MetricSelection, Metrics, SelectedMetrics, WorseDirection};
pub use per_target::TargetScore;

/// Computations that the selected metrics need.
#[derive(Debug, Clone, Copy)]
struct Needed {
    estimates: bool,
    consistency: bool,
    orbits: bool,
    separation: bool,
    separation_in_groups: bool,
    off_boresight: bool,
    tallies: bool,
    limits: bool,
    control_effort: bool,
    coverage: bool,
    events: bool,
    zones: bool,
    agreement: bool,
    association: bool,
}

impl Needed {
    fn of(choice: MetricSelection) -> Self {
        Self {
            estimates: choice.includes(&[
                "position_error_m",
                "position_error_single_uav_m",
                "position_error_multi_uav_m",
                "velocity_error_m_s",
                "position_error_all_m",
            ]),
            consistency: choice.includes(&["anees", "anees_nonmanoeuvring", "anees_manoeuvring"]),
            orbits: choice.includes(&[
                "standoff_distance_m",
                "standoff_error_m",
                "standoff_error_own_estimate_m",
                "standoff_error_on_orbit_m",
                "transit_fraction",
                "standoff_error_m_settled",
                "standoff_error_own_estimate_m_settled",
                "standoff_error_unfiltered_m_settled",
                "phase_error_deg",
            ]),
            separation: choice.includes(&[
                "separation_min_m",
                "separation_min_same_altitude_m",
                "separation_violations",
                "avoidance_time_s",
            ]),
            separation_in_groups: choice.includes(&["separation_min_same_group_m"]),
            off_boresight: choice.includes(&["off_boresight_mean_deg", "off_boresight_max_deg"]),
            tallies: choice.includes(&[
                "custody_fraction",
                "in_view_fraction",
                "longest_out_of_view_s",
                "reacquired_fraction",
                "reacquisition_time_s",
                "member_out_of_view_fraction",
                "member_longest_out_of_view_s",
                "anees_nonmanoeuvring",
                "anees_manoeuvring",
            ]),
            limits: choice.includes(&[
                "infeasible_fraction",
                "turn_rate_saturated_fraction",
                "turn_rate_saturated_fraction_settled",
            ]),
            control_effort: choice.includes(&[
                "speed_saturated_fraction",
                "turn_reversals_per_min",
                "reassignments_per_uav_min",
            ]),
            coverage: choice.includes(&["ungrouped_fraction"]),
            events: choice.includes(&["handoffs", "removals"]),
            zones: choice.includes(&["zone_violations", "geofence_detour_fraction"]),
            agreement: choice.includes(Metrics::AGREEMENT),
            association: choice.includes(&metrics::association()),
        }
    }
}

/// Scores a run frame by frame.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Overrides, Scenario};
/// use standoff_score::{MetricSelection, Scorer};
///
/// let scenario = Scenario::load("paper/table-2-pair", &Overrides::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut scorer = Scorer::new(scenario.settings.score_config(), MetricSelection::standard());
/// while let Some(frame) = mission.frame() {
///     scorer.frame(frame);
/// }
/// let metrics = scorer.metrics();
/// assert_eq!(metrics.member_out_of_view_fraction, Some(0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scorer {
    config: ScoreConfig,
    needed: Needed,
    so_far: SoFar,
    tallies: Tallies,
    control_effort: ControlEffort,
    separation_rules: SeparationRules,
    separations: Separations,
    zones: Zones,
    bound: Option<Bound>,
    innovations: Option<Innovations>,
    prediction_errors: Option<PredictionErrors>,
    /// UAVs of each group, and those of them whose sensor is pointed.
    uavs: ByGroup<u32>,
    assigned: ByGroup<u32>,
    true_orbits: TrueOrbits,
    coverage: Coverage,
    /// Empty; its memory is reused.
    matching: Matching<'static>,
    agreement: Agreement,
    association: AssociationScores,
    per_agent: PerAgentScores<Self>,
    /// Selected metrics that are computed for each agent separately.
    of_team_states: MetricSelection,
    /// Positions of the UAVs on one orbit; reused buffer.
    assignments: Vec<Position>,
    from_centre: Vec<Displacement>,
}

/// Accumulated values of the metrics with these names.
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
    transit: Transit,
    standoff_settled: Mean,
    unfiltered_settled: Mean,
    tracking_settled: Mean,
    phase_deg: Mean,
    off_boresight_mean_deg: Mean,
    off_boresight_max_deg: Option<f64>,
    uncovered: Mean,
    infeasible: Mean,
    saturated: Mean,
    saturated_settled: Mean,
    handoffs: u64,
    removals: u64,
    nees: Mean,
}

impl Scorer {
    /// Makes a scorer without data for the selected metrics; the other metrics may be `None`.
    pub fn new(score_config: ScoreConfig, choice: MetricSelection) -> Self {
        let needed = Needed::of(choice);
        Self {
            needed,
            so_far: SoFar::default(),
            tallies: Tallies::default(),
            control_effort: ControlEffort::default(),
            separation_rules: SeparationRules {
                minima: score_config.separation,
                model: PathModel::new(&score_config.team, score_config.period_s),
                is_of_groups: !needed.separation,
            },
            separations: Separations::default(),
            zones: Zones::default(),
            bound: choice.needs_bound().then(|| Bound::of(&score_config)).flatten(),
            innovations: choice.includes(&["nis"]).then(|| Innovations::new(&score_config)),
            prediction_errors: choice
                .includes(&["orbit_prediction_error_m_settled", "own_orbit_prediction_error_m_settled"])
                .then(|| PredictionErrors::new(score_config.clone())),
            uavs: ByGroup::default(),
            assigned: ByGroup::default(),
            true_orbits: TrueOrbits::default(),
            coverage: Coverage::new(needed.association),
            matching: Matching::default(),
            agreement: Agreement::default(),
            association: AssociationScores::default(),
            per_agent: PerAgentScores::default(),
            of_team_states: choice.of_team_states(),
            assignments: Vec::new(),
            from_centre: Vec::new(),
            config: score_config,
        }
    }

    /// Adds the next frame.
    pub fn frame(&mut self, frame: &Frame) {
        let needed = self.needed;
        let mut matching = std::mem::take(&mut self.matching);
        matching.fill(&frame.truth, &frame.tracks);
        let grouped = Grouped::of(frame);
        if needed.tallies || needed.association {
            self.coverage.fill(frame, &self.config.sensor);
        }
        if needed.tallies {
            self.tallies.frame(&self.config, frame, &matching, (&grouped, &self.coverage));
        }
        self.uavs.fill(matching::assigned(frame));
        let is_pointed = |index: usize| frame.uavs[index].boresight_rad.is_some();
        self.assigned.fill(matching::assigned(frame).filter(|(_, index)| is_pointed(*index)));
        if needed.estimates || needed.consistency {
            matching.pairs().iter().for_each(|pair| self.estimate(*pair));
        }
        if needed.orbits || self.prediction_errors.is_some() {
            self.true_orbits.next(&self.config, &frame.groups, &matching);
        }
        if needed.orbits {
            frame.groups.iter().for_each(|group| self.orbit(frame, group));
        }
        if needed.separation || needed.separation_in_groups {
            self.separations.frame(&self.separation_rules, frame);
        }
        if needed.off_boresight {
            self.lines_of_sight(frame, &matching);
        }
        if needed.limits {
            for uav in frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some()) {
                let group = group_of(frame, uav);
                self.so_far.infeasible.add(f64::from(group.is_some_and(|group| !group.feasible)));
                let saturated = f64::from(uav.turn_rate_limited);
                self.so_far.saturated.add(saturated);
                if self.config.is_settled(frame) {
                    self.so_far.saturated_settled.add(saturated);
                }
            }
        }
        if needed.control_effort {
            self.control_effort.frame(frame);
        }
        if needed.zones && !self.config.geofence.is_empty() {
            self.zones.frame(&self.config, &self.separation_rules.model, frame);
        }
        if needed.coverage {
            for (target, track) in matching.targets() {
                self.so_far.uncovered.add(1.0 - grouped.fraction(target, track));
            }
        }
        if needed.events {
            let count = |kind: &str| frame.events.iter().filter(|event| event.kind == kind).count() as u64;
            self.so_far.handoffs += count("handoff-completed");
            self.so_far.removals += count("removed");
        }
        if needed.agreement {
            self.agreement.frame(frame);
        }
        if needed.association {
            self.association.frame(&self.config, frame, &matching, &self.coverage);
        }
        if !self.of_team_states.is_empty() {
            self.per_agent.frame(frame, || Self::new(self.config.clone(), self.of_team_states));
        }
        if let Some(bound) = &mut self.bound {
            bound.frame(frame, &matching);
        }
        if let Some(innovations) = &mut self.innovations {
            innovations.frame(frame);
        }
        if let Some(prediction_errors) = &mut self.prediction_errors {
            prediction_errors.frame(frame, &self.true_orbits);
        }
        self.matching = matching.emptied();
    }

    /// Returns the scores so far.
    pub fn metrics(&self) -> Metrics {
        let [position, velocity] = self.bound.as_ref().map(Bound::efficiencies).unwrap_or_default();
        let period_s = self.config.period_s;
        let Sums {
            in_custody,
            in_view: seen,
            out_of_view: unseen,
            longest_gap,
            longest_streak,
            reacquired: refound,
            reacquisition: refind,
        } = self.tallies.sums();
        let Agreement { differ, lag_s, lag_max_s, retransmission_limited, duplicate_coverage: double_served, .. } =
            &self.agreement;
        let [sent_bytes_per_s, sent_bytes_per_s_max] = self.agreement.bytes_per_s(period_s);
        let [quiet, manoeuvring] = self.tallies.consistency(&self.config.manoeuvring);
        let metrics = Metrics {
            custody_fraction: in_custody.value(),
            in_view_fraction: seen.value(),
            longest_out_of_view_s: seen.value().map(|_| longest_gap as f64 * period_s),
            reacquired_fraction: refound.value(),
            reacquisition_time_s: refind.value().map(|steps| steps * period_s),
            position_error_m: self.so_far.position.value(),
            position_error_single_uav_m: self.so_far.position_one.value(),
            position_error_multi_uav_m: self.so_far.position_more.value(),
            velocity_error_m_s: self.so_far.velocity.value(),
            position_error_all_m: self.so_far.position_all.value(),
            standoff_distance_m: self.so_far.distance.value(),
            standoff_error_m: self.so_far.standoff.value(),
            standoff_error_own_estimate_m: self.so_far.tracking.value(),
            standoff_error_on_orbit_m: self.so_far.transit.on_orbit_m.value(),
            transit_fraction: self.so_far.transit.fraction.value(),
            standoff_error_m_settled: self.so_far.standoff_settled.value(),
            standoff_error_unfiltered_m_settled: self.so_far.unfiltered_settled.value(),
            standoff_error_own_estimate_m_settled: self.so_far.tracking_settled.value(),
            phase_error_deg: self.so_far.phase_deg.value(),
            off_boresight_mean_deg: self.so_far.off_boresight_mean_deg.value(),
            off_boresight_max_deg: self.so_far.off_boresight_max_deg,
            member_out_of_view_fraction: unseen.value(),
            member_longest_out_of_view_s: unseen.value().map(|_| longest_streak as f64 * period_s),
            ungrouped_fraction: self.so_far.uncovered.value(),
            infeasible_fraction: self.so_far.infeasible.value(),
            turn_rate_saturated_fraction: self.so_far.saturated.value(),
            turn_rate_saturated_fraction_settled: self.so_far.saturated_settled.value(),
            speed_saturated_fraction: self.control_effort.speed_saturated.value(),
            turn_reversals_per_min: self.control_effort.reversals_per_min(period_s),
            reassignments_per_uav_min: self.control_effort.reassignments_per_min(period_s),
            separation_min_m: self.separations.min_m,
            separation_min_same_altitude_m: self.separations.min_same_altitude_m,
            separation_min_same_group_m: self.separations.min_same_group_m,
            separation_violations: self.separations.has_pairs.then_some(self.separations.violations),
            avoidance_time_s: self.separations.has_pairs.then_some(self.separations.avoiding as f64 * period_s),
            zone_violations: self.zones.violations(),
            geofence_detour_fraction: self.zones.detour.value(),
            handoffs: self.needed.events.then_some(self.so_far.handoffs),
            removals: self.needed.events.then_some(self.so_far.removals),
            gospa_m: self.association.squared_m2.value().map(f64::sqrt),
            gospa_localisation_m: self.association.localisation_m2.value().map(f64::sqrt),
            gospa_missed: self.association.missed.value(),
            gospa_false: self.association.false_tracks_in_view.value(),
            track_swaps: self.needed.association.then_some(self.association.swaps),
            false_tracks: self.needed.association.then(|| self.association.false_tracks()),
            track_purity: self.association.purity(),
            detected_fraction: self.association.detected.value(),
            assignment_disagreement_fraction: differ.value(),
            reconvergence_time_s: self.agreement.delay_s(self.config.faults_end_s),
            duplicate_coverage_fraction: double_served.value(),
            commit_lag_s: lag_s.value(),
            commit_lag_max_s: *lag_max_s,
            sent_bytes_per_s,
            sent_bytes_per_s_max,
            retransmission_limited_fraction: retransmission_limited.value(),
            anees: self.so_far.nees.value(),
            anees_nonmanoeuvring: quiet,
            anees_manoeuvring: manoeuvring,
            orbit_prediction_error_m_settled: self
                .prediction_errors
                .as_ref()
                .and_then(|prediction_errors| prediction_errors.truth.value()),
            own_orbit_prediction_error_m_settled: self
                .prediction_errors
                .as_ref()
                .and_then(|prediction_errors| prediction_errors.own.value()),
            nis: self.innovations.as_ref().and_then(Innovations::value),
            position_crlb_ratio: position.ratio(),
            velocity_crlb_ratio: velocity.ratio(),
            position_squared_error_m2: position.squared_error.value(),
            position_crlb_m2: position.bound.value(),
            velocity_squared_error_m2_s2: velocity.squared_error.value(),
            velocity_crlb_m2_s2: velocity.bound.value(),
        };
        self.per_agent.average(metrics, self.config.gospa_cutoff_m).only_by(self.config.reported)
    }

    /// Returns the scores of every target that has existed, by id. Empty if no selected metric needs them.
    pub fn targets(&self) -> impl Iterator<Item = TargetScore> {
        self.tallies.scores(&self.config)
    }

    /// Mean number of existing targets per time step after the first cue; `None` without a cue.
    pub fn targets_mean(&self) -> Option<f64> {
        self.tallies.targets_mean()
    }

    /// Adds the error of an estimate.
    fn estimate(&mut self, pair: Matched<'_>) {
        let (Matched { target, track }, position_error_m) = (pair, pair.position_error_m());
        let [_, vx_m_s, _, _, vy_m_s, _] = track.state;
        self.so_far.position_all.add(position_error_m);
        if let Some(group) = track.group {
            self.so_far.position.add(position_error_m);
            match self.assigned.of(group).len() {
                0 => {}
                1 => self.so_far.position_one.add(position_error_m),
                _ => self.so_far.position_more.add(position_error_m),
            }
            self.so_far.velocity.add(Displacement::from_m(vx_m_s - target.vx_m_s, vy_m_s - target.vy_m_s).length_m());
            let nees = self.needed.consistency.then(|| nees_per_state(&self.config, pair)).flatten();
            if let Some(nees) = nees {
                self.so_far.nees.add(nees);
            }
            if self.needed.tallies {
                self.tallies.estimate(target.target, position_error_m, nees);
            }
        }
    }

    /// Adds radii, phases and distances of the UAVs on one orbit.
    fn orbit(&mut self, frame: &Frame, group: &GroupRow) {
        let settled = self.config.is_settled(frame);
        self.assignments.clear();
        self.assignments.extend(self.uavs.of(group.group).map(|index| at(&frame.uavs[index])));
        let centre = centre(group);
        for uav in &self.assignments {
            let error_m = off_orbit_m(*uav, centre, group.standoff_distance_m).abs();
            self.so_far.distance.add(group.standoff_distance_m);
            self.so_far.tracking.add(error_m);
            if settled {
                self.so_far.tracking_settled.add(error_m);
            }
        }

        let Some(orbit) = self.true_orbits.of(group.group) else { return };
        for (index, uav) in self.uavs.of(group.group).zip(&self.assignments) {
            let off_m = |orbit: &OrbitMotion| off_orbit_m(*uav, orbit.centre, orbit.radius_m).abs();
            let error_m = off_m(&orbit.flown);
            self.so_far.standoff.add(error_m);
            self.so_far.transit.add(frame.uavs[index].uav, group.group, error_m, orbit.flown.radius_m);
            if settled {
                self.so_far.standoff_settled.add(error_m);
                self.so_far.unfiltered_settled.add(off_m(&orbit.unfiltered));
            }
        }
        self.from_centre.clear();
        self.from_centre.extend(self.assignments.iter().map(|uav| *uav - orbit.flown.centre));
        if let Some(error_deg) = phase_error_deg(&self.from_centre, self.config.desired_phase_rad) {
            self.so_far.phase_deg.add(error_deg);
        }
    }

    /// Adds the off-boresight angles of the members. Frames before the sensors are first pointed are skipped.
    fn lines_of_sight(&mut self, frame: &Frame, matching: &Matching<'_>) {
        // UAVs are processed in pairs (SIMD). A single last UAV is paired with itself.
        for pair in frame.uavs.chunks(2) {
            let angles_rad = off_boresight_angles_rad([&pair[0], &pair[pair.len() - 1]], matching);
            for angle_rad in angles_rad.into_iter().take(pair.len()).flatten() {
                let largest_deg = angle_rad.to_degrees();
                self.so_far.off_boresight_mean_deg.add(largest_deg);
                self.so_far.off_boresight_max_deg =
                    Some(self.so_far.off_boresight_max_deg.map_or(largest_deg, |most| most.max(largest_deg)));
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

/// Deviation of the UAVs' phases about a centre from the desired phases, degrees: for a pair, relative to the desired
/// phase in either direction; for more UAVs, mean over the gaps, as in [`geometry::phase_differences`]. `None` for fewer
/// than two UAVs.
fn phase_error_deg(uavs_rel_centre: &[Displacement], desired_phase_rad: f64) -> Option<f64> {
    match uavs_rel_centre {
        [] | [_] => None,
        [a, b] => {
            let (a, b) = (a.vector(), b.vector());
            let apart_rad = math::atan2(a.perp(&b).abs(), a.dot(&b));
            Some((apart_rad - desired_phase_rad).abs().to_degrees())
        }
        _ => {
            let phases = (0..).zip(uavs_rel_centre).map(|(uav, from_centre)| (uav, from_centre.direction()));
            let gaps = geometry::phase_gaps_rad(phases.collect());
            let desired_rad = geometry::desired_pair_phase_rad(gaps.len(), desired_phase_rad);
            let errors_rad = gaps.iter().map(|(_, gap_rad)| (gap_rad - desired_rad).abs());
            Some((errors_rad.sum::<f64>() / gaps.len() as f64).to_degrees())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{config_of, score, score_config};
    use crate::missions::{frames, load};
    use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};
    use standoff::params::CentreEstimate;
    use standoff_record::{ReportedTables, UavRow};

    /// The minimum enclosing circle of these four targets passes through the second and third: its centre is (160, 120)
    /// m, its radius 200 m. The centroid is (90, 70) m, and the second target is 100 sqrt(5.78) m from it. Two UAVs are
    /// 500 m east and north of the circle's centre, at the desired phase of a right angle.
    #[test]
    fn standoff_errors_use_the_configured_centre_rule() {
        let score_config = ScoreConfig {
            centre: CentreEstimate::EnclosingCircle,
            desired_phase_rad: math::PI / 2.0,
            ..score_config()
        };
        let places_m = [(0.0, 0.0), (320.0, 0.0), (0.0, 240.0), (40.0, 40.0)];
        let mut frame = Frame { time_us: 100_000_000, ..Frame::default() };
        frame.truth.extend((0..).zip(places_m).map(|(target, (x_m, y_m))| truth_row(target, x_m, y_m)));
        frame.tracks.extend((0..4).map(|target| track_row(target, Some(0))));
        frame.groups.push(GroupRow { x_m: 160.0, y_m: 123.0, ..group_row(0) });
        let uav = |uav: u32, x_m: f64, y_m: f64| UavRow { x_m, y_m, ..uav_row(uav) };
        frame.uavs.extend([uav(0, 660.0, 120.0), uav(1, 160.0, 620.0)]);
        let half_rad =
            0.5 * (score_config.sensor.field_of_view_rad - score_config.team.group.standoff.field_of_view_margin_rad);
        let r_d_m = |d_max_m: f64| d_max_m / math::sin(half_rad);
        let near = |value: Option<f64>, expected: f64| (value.unwrap() - expected).abs() < 1e-9;

        let metrics = score(&score_config, [&frame]);
        assert!(near(metrics.standoff_error_m, 500.0 - r_d_m(200.0)), "{metrics:?}");
        assert!(near(metrics.standoff_error_m_settled, 500.0 - r_d_m(200.0)) && near(metrics.phase_error_deg, 0.0));
        assert!(near(metrics.standoff_error_unfiltered_m_settled, 500.0 - r_d_m(200.0)));
        let mut scorer = FrameScorer::new(score_config.clone());
        let scores = scorer.frame(&frame);
        assert!(near(scores.standoff_error_m(&frame.uavs[1]), 500.0 - r_d_m(200.0)));
        assert!(near(scores.centre_error_m(&frame.groups[0]), 3.0));

        let centroid = ScoreConfig { centre: CentreEstimate::Filtered, ..score_config.clone() };
        let off_m = Displacement::from_m(570.0, 50.0).length_m() - r_d_m(100.0 * 5.78f64.sqrt());
        let mut scorer = FrameScorer::new(centroid.clone());
        let scores = scorer.frame(&frame);
        assert!(near(scores.standoff_error_m(&frame.uavs[0]), off_m));
        assert_eq!(
            score(&centroid, [&frame]),
            score(&ScoreConfig { centre: CentreEstimate::Filtered, ..score_config }, [&frame])
        );
    }

    /// Tracks at the origin of targets at 3, 4 and 12 m. One UAV is assigned to the group of the first, two to that of
    /// the second, and to that of the third one with an outage.
    #[test]
    fn position_errors_are_split_by_number_of_assigned_uavs() {
        let mut frame = Frame::default();
        for (target, x_m) in (0..).zip([3.0, 4.0, 12.0]) {
            frame.truth.push(truth_row(target, x_m, 0.0));
            frame.tracks.push(track_row(target, Some(target)));
        }
        let uav = |uav: u32, group: u32| UavRow { group: Some(group), ..uav_row(uav) };
        frame.uavs = vec![uav(0, 0), uav(1, 1), uav(2, 1), UavRow { boresight_rad: None, ..uav(3, 2) }];
        let errors_m = |frame: &Frame| {
            let metrics = score(&score_config(), [frame]);
            [metrics.position_error_m, metrics.position_error_single_uav_m, metrics.position_error_multi_uav_m]
        };
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(3.0), Some(4.0)]);
        frame.uavs[2].group = Some(2);
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(19.0 / 3.0), None]);
    }

    fn flown() -> (ScoreConfig, Vec<Frame>) {
        let scenario = load("tour/05-a-handoff", &[], 1);
        (config_of(&scenario.settings), frames(&scenario))
    }

    #[test]
    fn settled_saturation_counts_from_the_end_of_the_transient() {
        let (score_config, mut frames) = flown();
        for frame in &mut frames {
            let limited = frame.time_us < 20_000_000;
            frame.uavs.iter_mut().for_each(|uav| uav.turn_rate_limited = limited);
        }
        let settled = |transient_s: f64| {
            let metrics = score(&ScoreConfig { transient_s, ..score_config.clone() }, &frames);
            assert!(metrics.turn_rate_saturated_fraction > Some(0.0));
            metrics.turn_rate_saturated_fraction_settled
        };
        assert_eq!(settled(20.0), Some(0.0));
        assert!(settled(19.0) > Some(0.0) && settled(1e6).is_none());
    }

    /// The team's track ids do not matter: the truth of a track is that of its target.
    #[test]
    fn track_ids_do_not_change_scores() {
        let (score_config, mut frames) = flown();
        let before = score(&score_config, &frames);
        for frame in &mut frames {
            frame.tracks.iter_mut().for_each(|track| track.track = 1_000 - track.target);
            frame.events.iter_mut().for_each(|event| event.track = event.target.map(|target| 1_000 - target));
        }
        assert_eq!(score(&score_config, &frames), before);
        assert!(before.position_error_m.is_some() && before.nis.is_some() && before.handoffs > Some(0));
    }

    /// A third-party controller that flies like ours but reports nothing, or tracks only, is scored by what is in view,
    /// by the motion of its UAVs, and by its tracks.
    #[test]
    fn unreported_tables_are_not_scored() {
        let (score_config, mut frames) = flown();
        let whole = score(&score_config, &frames);
        for frame in &mut frames {
            frame.groups.clear();
            frame.events.clear();
            frame.uavs.iter_mut().for_each(|uav| uav.group = None);
            frame.tracks.iter_mut().for_each(|track| (track.group, track.receiving_group) = (None, None));
        }
        let scored = |tracks: bool, frames: &[Frame]| {
            let metrics = score(
                &ScoreConfig { reported: ReportedTables { tracks, ..ReportedTables::NOTHING }, ..score_config.clone() },
                frames,
            );
            let both = Metrics::NAMES.iter().zip(metrics.values().into_iter().zip(whole.values()));
            both.filter(|(_, (value, _))| value.is_some())
                .inspect(|(name, (value, whole))| {
                    assert_eq!(value, whole, "{name}");
                })
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
        };
        let from_tracks = scored(true, &frames);
        frames.iter_mut().for_each(|frame| frame.tracks.clear());
        let always = [
            "in_view_fraction",
            "longest_out_of_view_s",
            "detected_fraction",
            "turn_rate_saturated_fraction",
            "turn_rate_saturated_fraction_settled",
            "speed_saturated_fraction",
            "turn_reversals_per_min",
            "separation_min_m",
            "separation_min_same_altitude_m",
            "separation_violations",
            "avoidance_time_s",
        ];
        assert_eq!(scored(false, &frames), always);
        let additional = from_tracks.iter().filter(|name| !always.contains(name)).copied().collect::<Vec<_>>();
        let of_tracks = metrics::association().into_iter().filter(|name| !always.contains(name));
        assert_eq!(additional, ["position_error_all_m", "nis"].into_iter().chain(of_tracks).collect::<Vec<_>>());
        // A controller that reports tracks and groups, but has none, has no target in custody.
        assert_eq!(score(&score_config, &frames).custody_fraction, Some(0.0));
        let events_only =
            ScoreConfig { reported: ReportedTables { tracks: false, ..ReportedTables::default() }, ..score_config };
        let mut scorer = Scorer::new(events_only, MetricSelection::ALL);
        frames.iter().for_each(|frame| scorer.frame(frame));
        assert!(scorer.targets().all(|one| one.custody_fraction.is_none() && one.in_view_fraction.is_some()));
        assert_eq!((scorer.metrics().handoffs, scorer.metrics().ungrouped_fraction), (Some(0), None));
    }
}
