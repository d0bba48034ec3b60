//! Scores of each target: time in custody, time in view and longest time out of view.
//!
//! Only the truth determines when a target counts: from the time step after its first one, in which it is cued, to its
//! end. The time step of the cue does not count, because no sensor can have been pointed at the target yet. All later
//! ones count, whatever fails.

use serde::Serialize;
use standoff::Position;

use crate::by_id::ById;
use crate::config::ScoreConfig;
use crate::mean::Mean;
use crate::step::Step;

/// All targets that have existed, by id.
#[derive(Debug, Clone, Default)]
pub(crate) struct PerTarget {
    of: ById<Tally>,
    /// Frames since the first target was cued.
    frames: u64,
}

/// Counters of one target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tally {
    /// Last time step at which the target existed.
    until_us: i64,
    /// Time steps at which the target existed, without that of its cue.
    steps: u64,
    /// Sum over these time steps: 1 if it is in custody; with several agents, the fraction of them that have it in a
    /// group.
    in_custody: f64,
    /// The same for the time steps at which its priority is above 1: their number, and the sum.
    priority_custody: Mean,
    in_view: u64,
    /// Consecutive time steps out of view. Time steps at which the target does not exist are skipped.
    gap: u64,
    pub(crate) longest_gap: u64,
    /// Time steps as a member of a group, and those of them out of view.
    member: u64,
    out_of_view: u64,
    /// Consecutive time steps out of view as a member: their number, and the last frame of them.
    streak: u64,
    streak_until: u64,
    pub(crate) longest_streak: u64,
    custody: CustodyState,
    /// Number of losses, and number and total duration (in time steps) of those that ended with a reacquisition.
    losses: u64,
    pub(crate) found: Mean,
    /// Estimation errors while the target was a member.
    position_m: Mean,
    nees: Mean,
}

/// Custody state of a target. Custody begins when the target is in a group and in view.
#[derive(Debug, Clone, Copy, Default)]
enum CustodyState {
    /// The target has never been in custody, so it cannot be lost.
    #[default]
    Never,
    /// The target has been in custody, and since then has been in view or in a group.
    InCustody,
    /// Number of time steps since the target was in no group and not in view, without custody since.
    Lost(u64),
}

/// Scores of one target, defined like the metrics of the same names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TargetScore {
    /// Target id.
    #[serde(skip)]
    pub target: u32,
    /// Last time step at which the target existed, s.
    pub until_s: f64,
    /// True if the scenario gives the target manoeuvres in addition to the random motion of its model.
    pub manoeuvres: bool,
    /// Its priority without areas of interest, if it is not 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<f64>,
    /// Fraction of its time in custody (in a group and in view), 0 to 1.
    pub custody_fraction: Option<f64>,
    /// Fraction of its time in some UAV's view, 0 to 1.
    pub in_view_fraction: Option<f64>,
    /// Longest time out of view of all UAVs, s.
    pub longest_out_of_view_s: Option<f64>,
    /// Mean position error of the estimate while the target was in a group, m.
    pub position_error_m: Option<f64>,
    /// Average normalised estimation error squared, divided by the number of random states; 1 is consistent.
    pub anees: Option<f64>,
}

impl PerTarget {
    /// Adds the next time step.
    pub(crate) fn add(&mut self, step: &Step<'_>) {
        let Step { config, coverage, .. } = step;
        let is_first_cue = self.of.is_empty();
        self.frames += u64::from(!is_first_cue);
        for (truth, track) in step.matching.targets() {
            let is_seen = coverage.is_in_view(config.in_view(), truth);
            let is_member = track.is_some_and(|track| track.group.is_some());
            let mut is_cue = false;
            let tally = self.of.entry(truth.target, || {
                is_cue = true;
                Tally::default()
            });
            tally.until_us = step.frame.time_us;
            if !is_cue {
                let grouped = step.grouped.fraction(truth, track);
                tally.coverage(is_seen, is_member, grouped);
                if config.priorities.at(truth.target, Position::from_m(truth.x_m, truth.y_m)) > 1.0 {
                    tally.priority_custody.add(if is_seen { grouped } else { 0.0 });
                }
            }
            // A target that is in a group when it is cued is that group's responsibility immediately.
            if is_member && !is_first_cue {
                tally.membership(is_seen, self.frames);
            }
        }
    }

    /// Adds the estimation errors of the group members at the same time step.
    pub(crate) fn add_errors(&mut self, step: &Step<'_>) {
        for (index, pair) in step.matching.pairs().iter().enumerate().filter(|(_, pair)| pair.track.group.is_some()) {
            if let Some(tally) = self.of.get_mut(pair.target.target) {
                tally.position_m.add(pair.position_error_m());
                step.nees.get(index).copied().flatten().into_iter().for_each(|nees| tally.nees.add(nees));
            }
        }
    }

    /// Returns the sum over all targets.
    pub(crate) fn total(&self, part: impl Fn(&Tally) -> Mean) -> Mean {
        self.of.values().map(part).fold(Mean::default(), Mean::and)
    }

    /// Returns the maximum over all targets.
    pub(crate) fn longest(&self, time_steps: impl Fn(&Tally) -> u64) -> u64 {
        self.of.values().map(time_steps).max().unwrap_or(0)
    }

    /// Returns the mean normalised estimation error squared of the targets that manoeuvre, or of those that never do.
    /// `None` if no target manoeuvres.
    pub(crate) fn anees(&self, config: &ScoreConfig, manoeuvres: bool) -> Option<f64> {
        if config.manoeuvring.is_empty() {
            return None;
        }
        let of_kind = self.of.iter().filter(|(target, _)| config.manoeuvring.contains(target) == manoeuvres);
        of_kind.map(|(_, tally)| tally.nees).fold(Mean::default(), Mean::and).value()
    }

    /// Mean number of existing targets per time step after the first cue; `None` without a cue.
    pub(crate) fn targets_mean(&self) -> Option<f64> {
        let steps: u64 = self.of.values().map(|tally| tally.steps).sum();
        (self.frames > 0).then(|| steps as f64 / self.frames as f64)
    }

    pub(crate) fn scores(&self, config: &ScoreConfig) -> impl Iterator<Item = TargetScore> {
        let of_members = config.reported.tracks && config.reported.groups;
        self.of.iter().map(move |(target, tally)| TargetScore {
            target,
            until_s: tally.until_us as f64 / 1e6,
            manoeuvres: config.manoeuvring.contains(&target),
            priority: config.priorities.of_target.get(&target).copied().filter(|priority| *priority != 1.0),
            custody_fraction: tally.in_custody().value().filter(|_| of_members),
            in_view_fraction: tally.in_view().value(),
            longest_out_of_view_s: (tally.steps > 0).then_some(tally.longest_gap as f64 * config.period_s),
            position_error_m: tally.position_m.value().filter(|_| of_members),
            anees: tally.nees.value().filter(|_| of_members),
        })
    }
}

impl Tally {
    /// Time steps in custody, of those at which the target existed.
    pub(crate) fn in_custody(&self) -> Mean {
        Mean { sum: self.in_custody, n: self.steps }
    }

    /// Time steps in custody, of those at which its priority is above 1.
    pub(crate) fn in_custody_by_priority(&self) -> Mean {
        self.priority_custody
    }

    /// Time steps in view, of those at which the target existed.
    pub(crate) fn in_view(&self) -> Mean {
        Mean { sum: self.in_view as f64, n: self.steps }
    }

    /// Time steps out of view, of those as a member of a group.
    pub(crate) fn member_out_of_view(&self) -> Mean {
        Mean { sum: self.out_of_view as f64, n: self.member }
    }

    /// Reacquisitions, of the losses.
    pub(crate) fn reacquired(&self) -> Mean {
        Mean { sum: self.found.n as f64, n: self.losses }
    }

    fn coverage(&mut self, is_seen: bool, is_member: bool, grouped: f64) {
        self.steps += 1;
        self.in_view += u64::from(is_seen);
        self.in_custody += if is_seen { grouped } else { 0.0 };
        self.gap = if is_seen { 0 } else { self.gap + 1 };
        self.longest_gap = self.longest_gap.max(self.gap);
        self.update_custody(is_seen, is_member);
    }

    /// Independent of track management: keeping a track forever or deleting it early changes no number.
    fn update_custody(&mut self, is_seen: bool, is_member: bool) {
        if let CustodyState::Lost(steps) = &mut self.custody {
            *steps += 1;
        }
        match (self.custody, is_seen, is_member) {
            (CustodyState::Lost(steps), true, true) => {
                self.found.add(steps as f64);
                self.custody = CustodyState::InCustody;
            }
            (CustodyState::Never, true, true) => self.custody = CustodyState::InCustody,
            (CustodyState::InCustody, false, false) => {
                self.losses += 1;
                self.custody = CustodyState::Lost(0);
            }
            _ => {}
        }
    }

    fn membership(&mut self, is_seen: bool, frame: u64) {
        self.member += 1;
        if !is_seen {
            self.out_of_view += 1;
            let goes_on = self.streak_until + 1 == frame;
            self.streak = if goes_on { self.streak + 1 } else { 1 };
            self.streak_until = frame;
            self.longest_streak = self.longest_streak.max(self.streak);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::score_config;
    use crate::row_fixtures::{track_row, truth_row, uav_row};
    use crate::step::{Inputs, Steps};
    use standoff_record::Frame;

    /// State of a target at a time step.
    #[derive(Clone, Copy)]
    enum At {
        /// Member of a group or not, in view or not.
        There(bool, bool),
        /// Without a track; in view or not.
        Trackless(bool),
        Gone,
    }
    use At::{Gone, There, Trackless};

    const IN_CUSTODY: At = There(true, true);
    const MEMBER_OUT_OF_VIEW: At = There(true, false);
    const IN_VIEW_UNGROUPED: At = There(false, true);
    const LOST: At = There(false, false);

    /// The UAV looks east, so targets to the west are out of view.
    fn scored(courses: &[&[At]]) -> PerTarget {
        let [plain, covered] = [false, true].map(|covered| scored_by(courses, covered));
        assert_eq!(format!("{plain:?}"), format!("{covered:?}"));
        plain
    }

    fn scored_by(courses: &[&[At]], covered: bool) -> PerTarget {
        let mut targets = PerTarget::default();
        let mut steps = Steps::new(&score_config(), Inputs { targets: true, covered, ..Inputs::default() });
        for step in 0..courses[0].len() {
            let mut frame = Frame { uavs: vec![uav_row(0)], ..Frame::default() };
            for (target, course) in (0..).zip(courses) {
                let place = |is_seen: bool| truth_row(target, if is_seen { 100.0 } else { -100.0 }, 0.0);
                match course[step] {
                    There(is_member, is_seen) => {
                        frame.truth.push(place(is_seen));
                        frame.tracks.push(track_row(target, is_member.then_some(0)));
                    }
                    Trackless(is_seen) => frame.truth.push(place(is_seen)),
                    Gone => {}
                }
            }
            steps.next(&score_config(), &frame, |step| targets.add(step));
        }
        targets
    }

    fn found(courses: &[&[At]]) -> (Option<f64>, Option<f64>) {
        let targets = scored(courses);
        (targets.total(Tally::reacquired).value(), targets.total(|tally| tally.found).value())
    }

    /// In custody, lost at the fourth time step, reacquired at the seventh, lost again from the ninth to the end; the
    /// first time step is that of the cue. One of two losses ends with a reacquisition, after three time steps.
    #[test]
    fn target_without_group_and_view_is_lost_until_in_custody_again() {
        let course = [
            IN_CUSTODY,
            IN_CUSTODY,
            MEMBER_OUT_OF_VIEW,
            LOST,
            LOST,
            IN_VIEW_UNGROUPED,
            IN_CUSTODY,
            IN_VIEW_UNGROUPED,
            LOST,
            LOST,
        ];
        assert_eq!(found(&[&course]), (Some(0.5), Some(3.0)));
        // Another target is reacquired after one time step: two of three losses, (3 + 1) / 2 time steps.
        let other = [
            IN_CUSTODY, IN_CUSTODY, LOST, IN_CUSTODY, IN_CUSTODY, IN_CUSTODY, IN_CUSTODY, IN_CUSTODY, IN_CUSTODY,
            IN_CUSTODY,
        ];
        assert_eq!(found(&[&course, &other]), (Some(2.0 / 3.0), Some(2.0)));
    }

    /// A target that was never in custody, or is in a group or in view, is not lost.
    #[test]
    fn targets_never_in_custody_or_still_grouped_are_not_lost() {
        assert_eq!(found(&[&[LOST, LOST, MEMBER_OUT_OF_VIEW, LOST, IN_VIEW_UNGROUPED, LOST]]), (None, None));
        assert_eq!(
            found(&[&[IN_CUSTODY, IN_CUSTODY, MEMBER_OUT_OF_VIEW, IN_VIEW_UNGROUPED, MEMBER_OUT_OF_VIEW]]),
            (None, None)
        );
        assert_eq!(found(&[&[IN_CUSTODY, IN_CUSTODY, LOST, LOST]]), (Some(0.0), None));
    }

    /// Neither a deleted track nor time in which the target does not exist changes the result. A target that leaves
    /// while in custody is not lost, and one that leaves while lost is not reacquired.
    #[test]
    fn deleted_tracks_and_leaving_targets_do_not_improve_scores() {
        let gone = Trackless(false);
        assert_eq!(
            found(&[&[IN_CUSTODY, IN_CUSTODY, gone, gone, Trackless(true), IN_CUSTODY]]),
            (Some(1.0), Some(3.0))
        );
        assert_eq!(found(&[&[IN_CUSTODY, IN_CUSTODY, LOST, Gone, Gone, LOST, IN_CUSTODY]]), (Some(1.0), Some(2.0)));
        assert_eq!(found(&[&[IN_CUSTODY, IN_CUSTODY, Gone, Gone]]), (None, None));
        assert_eq!(found(&[&[IN_CUSTODY, IN_CUSTODY, LOST, Gone]]), (Some(0.0), None));
    }
}
