//! Scores of a run, computed from its record frame by frame in bounded memory. `docs/user/metrics.md` defines each metric.

// The fixtures that tests of several crates share use the same paths here as there.
#[cfg(test)]
extern crate self as standoff_score;

mod alarms;
mod buildings;
mod by_id;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
mod config;
mod families;
mod flown_path;
mod frame_metrics;
mod gaps;
pub mod geometry;
mod grouped;
pub mod matching;
mod mean;
mod metric;
mod metrics;
#[cfg(test)]
#[path = "../../standoff-sim/tests/common/mod.rs"]
mod missions;
mod nees;
mod per_agent;
mod per_target;
#[cfg(test)]
#[path = "../../standoff-record/tests/common/mod.rs"]
mod row_fixtures;
mod step;
mod team_scorer;
mod transit;
mod true_orbits;

use standoff_record::Frame;

use per_agent::PerAgentScores;
use team_scorer::TeamScorer;

pub use alarms::{Alarm, Alarms, Problem, problems};
pub use buildings::{BUILDING_HEIGHT_MAX_M, BUILDING_VERTICES_MAX, BUILDINGS_MAX, Building, Buildings};
pub use config::{CueError, Noise, Priorities, ScoreConfig};
pub use families::cramer_rao::Bound as PositionBound;
pub use frame_metrics::{CustodyCounts, FrameScorer, FrameScores};
pub use gaps::{Gap, GapCause, Gaps, View};
pub use metric::{MetricInfo, MetricSet, WorseDirection};
pub use metrics::{MetricSelection, Metrics, SelectedMetrics};
pub use per_target::TargetScore;

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
/// assert_eq!(metrics["member_out_of_view_fraction"], Some(0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Scorer {
    team: TeamScorer,
    per_agent: PerAgentScores,
}

impl Scorer {
    /// Makes a scorer without data for the selected metrics; the other metrics may be `None`.
    #[must_use]
    pub fn new(score_config: ScoreConfig, choice: MetricSelection) -> Self {
        Self { team: TeamScorer::new(score_config, choice), per_agent: PerAgentScores::new(choice) }
    }

    /// Adds the next frame.
    pub fn frame(&mut self, frame: &Frame) {
        self.team.frame(frame);
        self.per_agent.frame(self.team.config(), frame);
    }

    /// Returns the scores so far.
    #[must_use]
    pub fn metrics(&self) -> Metrics {
        let config = self.team.config();
        self.per_agent.average(self.team.metrics(), config).only_by(config.reported)
    }

    /// Returns the scores of every target that has existed, by id. Empty if no selected metric needs them.
    pub fn targets(&self) -> impl Iterator<Item = TargetScore> {
        self.team.targets().scores(self.team.config())
    }

    /// Mean number of existing targets per time step after the first cue; `None` without a cue.
    #[must_use]
    pub fn targets_mean(&self) -> Option<f64> {
        self.team.targets().targets_mean()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{config_of, score};
    use crate::missions::{frames, load};
    use standoff_record::ReportedTables;

    fn flown() -> (ScoreConfig, Vec<Frame>) {
        let scenario = load("tour/05-a-handoff", &[], 1);
        (config_of(&scenario.settings), frames(&scenario))
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
        assert!(before["position_error_m"].is_some() && before["nis"].is_some() && before["handoffs"] > Some(0.0));
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
            let names = MetricInfo::all().iter().map(|info| info.name).filter(|name| metrics[name].is_some());
            names.inspect(|name| assert_eq!(metrics[name], whole[name], "{name}")).collect::<Vec<_>>()
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
        let of_tracks = MetricSelection::parse("position_error_all_m,nis,association").unwrap().names();
        assert_eq!(additional, of_tracks.filter(|name| !always.contains(name)).collect::<Vec<_>>());
        // A controller that reports tracks and groups, but has none, has no target in custody.
        assert_eq!(score(&score_config, &frames)["custody_fraction"], Some(0.0));
        let events_only =
            ScoreConfig { reported: ReportedTables { tracks: false, ..ReportedTables::default() }, ..score_config };
        let mut scorer = Scorer::new(events_only, MetricSelection::all());
        frames.iter().for_each(|frame| scorer.frame(frame));
        assert!(scorer.targets().all(|one| one.custody_fraction.is_none() && one.in_view_fraction.is_some()));
        assert_eq!((scorer.metrics()["handoffs"], scorer.metrics()["ungrouped_fraction"]), (Some(0.0), None));
    }
}
