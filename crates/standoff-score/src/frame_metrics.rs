//! Scores of a single frame relative to the truth. The metrics average these values.

use standoff::grid::Grid;
use standoff_record::{DerivedColumns, Frame, GroupRow, UavRow, ViewRow};

use crate::config::ScoreConfig;
use crate::geometry::{Geometry, PointedSensors, at, off_orbit_m, position};
use crate::matching::Matched;
use crate::true_orbits::TrueOrbits;

/// Scores the frames of a run in sequence: true orbits have a state, and no target counts as in view before the first
/// cue.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Overrides, Scenario};
/// use standoff_score::FrameScorer;
///
/// let scenario = Scenario::load("paper/table-2-pair", &Overrides::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut scorer = FrameScorer::new(scenario.settings.score_config());
/// while let Some(frame) = mission.frame() {
///     let scores = scorer.frame(frame);
///     assert!(frame.uavs.iter().all(|uav| scores.standoff_error_m(uav).is_none_or(f64::is_finite)));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct FrameScorer {
    config: ScoreConfig,
    orbits: TrueOrbits,
    /// True if an earlier frame contained a target.
    is_after_cue: bool,
}

impl FrameScorer {
    /// Makes a scorer that has not processed any frame.
    #[must_use]
    pub fn new(score_config: ScoreConfig) -> Self {
        Self { config: score_config, orbits: TrueOrbits::default(), is_after_cue: false }
    }

    /// Processes the next frame and returns the columns that records derive from it.
    pub fn derived_columns(&mut self, frame: &Frame) -> DerivedColumns {
        let scores = self.frame(frame);
        DerivedColumns {
            standoff_errors_m: frame.uavs.iter().map(|uav| scores.standoff_error_m(uav)).collect(),
            position_errors_m: frame.tracks.iter().map(|track| scores.geometry.position_error_m(track)).collect(),
            views: scores.views().collect(),
        }
    }

    /// Processes the next frame.
    pub fn frame<'a>(&'a mut self, frame: &'a Frame) -> FrameScores<'a> {
        let geometry = Geometry::of(frame);
        self.orbits.next(&self.config, &frame.groups, geometry.matching());
        let is_after_cue = self.is_after_cue;
        self.is_after_cue |= !frame.truth.is_empty();
        FrameScores {
            geometry,
            score_config: &self.config,
            frame,
            is_after_cue,
            looking: PointedSensors::of(frame, &self.config.sensor),
            orbits: &self.orbits,
        }
    }
}

/// Frame with its scores relative to the truth.
#[derive(Debug)]
pub struct FrameScores<'a> {
    /// Geometric quantities, which do not depend on the scoring configuration.
    pub geometry: Geometry<'a>,
    score_config: &'a ScoreConfig,
    frame: &'a Frame,
    /// True if a target existed before this time step, so that sensors could have been pointed.
    is_after_cue: bool,
    looking: PointedSensors,
    orbits: &'a TrueOrbits,
}

/// Custody of all existing targets, and accuracy of their estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CustodyCounts {
    /// Number of existing targets, tracked or not.
    pub targets: usize,
    /// Number of existing targets that have a track.
    pub tracked: usize,
    /// Number of tracked targets that are in a group and in view of any UAV. `None` as for [`FrameScores::in_view`].
    pub in_custody: Option<usize>,
    /// Number of existing targets in view of any UAV, tracked or not.
    pub in_view: Option<usize>,
    /// Root-mean-square position error of the tracked targets, m; `None` if no target is tracked.
    pub position_error_m: Option<f64>,
}

impl FrameScores<'_> {
    /// Standoff error r - r_d of a UAV relative to the true orbit, m, as in `standoff_error_m`; positive outside.
    #[must_use]
    pub fn standoff_error_m(&self, uav: &UavRow) -> Option<f64> {
        let orbit = self.orbits.of(uav.group?)?.flown;
        Some(off_orbit_m(at(uav), orbit.centre, orbit.radius_m))
    }

    /// Distance from the estimated centre of a group to the centre of its true orbit, m. `None` if a target on the
    /// orbit does not exist, because the estimate includes all of them.
    #[must_use]
    pub fn centre_error_m(&self, group: &GroupRow) -> Option<f64> {
        self.geometry.centre_error_m(group, self.orbits.of(group.group).map(|orbit| orbit.flown.centre))
    }

    /// True if any UAV has the target in view, as in `member_out_of_view_fraction`. `None` at the first cue, before
    /// which no sensor can be pointed, and for unknown targets.
    #[must_use]
    pub fn in_view(&self, target: u32) -> Option<bool> {
        let target = position(self.geometry.matching().target(target)?);
        self.is_after_cue.then(|| self.looking.have_in_view(self.score_config.in_view(), target))
    }

    /// Returns the custody of all targets.
    #[must_use]
    pub fn custody(&self) -> CustodyCounts {
        let (mut targets, mut in_view, mut in_custody, mut errors_m2) = (0, 0, 0, 0.0);
        for (target, track) in self.geometry.matching().targets() {
            let is_in_view = self.looking.have_in_view(self.score_config.in_view(), position(target));
            targets += 1;
            in_view += usize::from(is_in_view);
            let Some(track) = track else { continue };
            in_custody += usize::from(is_in_view && track.group.is_some());
            let error_m = Matched { target, track }.position_error_m();
            errors_m2 += error_m * error_m;
        }
        let tracked = self.geometry.matching().pairs().len();
        CustodyCounts {
            targets,
            tracked,
            in_custody: self.is_after_cue.then_some(in_custody),
            in_view: self.is_after_cue.then_some(in_view),
            position_error_m: (tracked > 0).then(|| (errors_m2 / tracked as f64).sqrt()),
        }
    }

    /// Returns what each UAV has in view, sorted by UAV and target.
    pub fn views(&self) -> impl Iterator<Item = ViewRow> {
        let range_m = self.score_config.sensor.sensing_range_m;
        let places = Grid::of(self.frame.truth.iter().map(position), 0.5 * range_m);
        let pairs = self.looking.all.iter().flat_map(move |one| {
            let mut near = Vec::new();
            let near: Vec<usize> = places.near_ascending(one.position, range_m, &mut near).collect();
            near.into_iter().map(move |index| (one, index))
        });
        pairs.filter_map(|(pointed, index)| {
            let truth = &self.frame.truth[index];
            let seen = pointed.measure(self.score_config.in_view(), position(truth))?;
            let off_boresight_rad = (seen.bearing - pointed.boresight).rad();
            Some(ViewRow { uav: pointed.uav, target: truth.target, range_m: seen.range_m, off_boresight_rad })
        })
    }

    /// Fourth root of the inverse determinant of the information that one scan by each UAV of a group provides about a
    /// target at the group's true centre, m. This is the geometric mean of the semi-axes of the one-sigma ellipse. For
    /// a pair, the determinant is (36).
    #[must_use]
    pub fn scan_sd_m(&self, group: u32) -> Option<f64> {
        let centre = self.orbits.of(group)?.flown.centre;
        let assigned_uavs = self.frame.uavs.iter().filter(|uav| uav.group == Some(group));
        let information =
            assigned_uavs.map(|uav| self.score_config.sensor.information(at(uav), centre)).reduce(|a, b| a + b)?;
        Some(information.determinant().sqrt().sqrt().recip()).filter(|sd_m| sd_m.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::common::config_of;
    use crate::missions::{frames, load};

    /// A mission in which targets go out of view.
    #[test]
    fn custody_counts_equal_those_of_single_targets() {
        let scenario = load("paper/figure-9-basic", &[], 1);
        let mut scorer = FrameScorer::new(config_of(&scenario.settings));
        let (mut time_steps, mut unseen) = (0, 0);
        for frame in &frames(&scenario) {
            let scores = scorer.frame(frame);
            let custody = scores.custody();
            assert_eq!(custody.targets, frame.truth.len());
            let ids: BTreeSet<u32> = frame.truth.iter().map(|row| row.target).collect();
            let tracks: Vec<_> = frame.tracks.iter().filter(|row| ids.contains(&row.target)).collect();
            assert_eq!(custody.tracked, tracks.len());
            let errors = tracks.iter().filter_map(|track| scores.geometry.position_error_m(track));
            let mean_m2 = errors.map(|error_m| error_m * error_m).sum::<f64>() / tracks.len() as f64;
            assert_eq!(custody.position_error_m, Some(mean_m2.sqrt()).filter(|_| !tracks.is_empty()));
            let views: Option<Vec<bool>> = frame.truth.iter().map(|truth| scores.in_view(truth.target)).collect();
            let Some(views) = views.filter(|_| scores.is_after_cue) else {
                assert_eq!((custody.in_view, custody.in_custody), (None, None));
                continue;
            };
            assert_eq!(custody.in_view, Some(views.iter().filter(|&&view| view).count()));
            let members = tracks.iter().filter(|row| row.group.is_some() && scores.in_view(row.target) == Some(true));
            assert_eq!(custody.in_custody, Some(members.count()));
            time_steps += 1;
            unseen += usize::from(custody.in_view < Some(custody.targets));
        }
        assert!(time_steps > 150 && unseen > 0, "{time_steps} time steps, {unseen} with a target out of view");
    }
}
