//! Scores of each target: time in custody, time in view and longest time out of view.
//!
//! Only the truth determines when a target counts: from the time step after its first one, in which it is cued, to its
//! end. The time step of the cue does not count, because no sensor can have been pointed at the target yet. All later
//! ones count, whatever fails.

use std::collections::BTreeSet;

use serde::Serialize;
use standoff_record::Frame;

use crate::by_id::ById;
use crate::config::ScoreConfig;
use crate::geometry::Coverage;
use crate::matching::Matching;
use crate::mean::Mean;
use crate::per_agent::Grouped;

/// All targets that have existed, by id.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tallies {
    of: ById<Tally>,
    /// Frames since the first target was cued.
    frames: u64,
}

/// Counters of one target.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    /// Last time step at which the target existed.
    until_us: i64,
    /// Time steps at which the target existed, without that of its cue.
    steps: u64,
    /// Sum over these time steps: 1 if it is in custody; with several agents, the fraction of them that have it in a
    /// group.
    in_custody: f64,
    in_view: u64,
    /// Consecutive time steps out of view. Time steps at which the target does not exist are skipped.
    gap: u64,
    longest_gap: u64,
    /// Time steps as a member of a group, and those of them out of view.
    member: u64,
    out_of_view: u64,
    /// Consecutive time steps out of view as a member: their number, and the last frame of them.
    streak: u64,
    streak_until: u64,
    longest_streak: u64,
    custody: CustodyState,
    /// Number of losses, and number and total duration (in time steps) of those that ended with a reacquisition.
    losses: u64,
    found: Mean,
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

/// Sums over all targets.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    pub(crate) in_custody: Mean,
    pub(crate) in_view: Mean,
    pub(crate) out_of_view: Mean,
    /// Consecutive time steps.
    pub(crate) longest_gap: u64,
    pub(crate) longest_streak: u64,
    /// Fraction of losses that ended with a reacquisition.
    pub(crate) reacquired: Mean,
    /// Time steps from a loss to the reacquisition.
    pub(crate) reacquisition: Mean,
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

impl Tallies {
    /// Adds the next frame.
    pub(crate) fn frame(
        &mut self,
        config: &ScoreConfig,
        frame: &Frame,
        matching: &Matching<'_>,
        (grouped, coverage): (&Grouped, &Coverage),
    ) {
        let is_first_cue = self.of.is_empty();
        self.frames += u64::from(!is_first_cue);
        for (truth, track) in matching.targets() {
            let is_seen = coverage.is_in_view(config.in_view(), truth);
            let is_member = track.is_some_and(|track| track.group.is_some());
            let mut is_cue = false;
            let tally = self.of.entry(truth.target, || {
                is_cue = true;
                Tally::default()
            });
            tally.until_us = frame.time_us;
            if !is_cue {
                tally.coverage(is_seen, is_member, grouped.fraction(truth, track));
            }
            // A target that is in a group when it is cued is that group's responsibility immediately.
            if is_member && !is_first_cue {
                tally.membership(is_seen, self.frames);
            }
        }
    }

    /// Adds the estimation error of a group member at the time step of the last frame.
    pub(crate) fn estimate(&mut self, target: u32, position_error_m: f64, nees: Option<f64>) {
        if let Some(tally) = self.of.get_mut(target) {
            tally.position_m.add(position_error_m);
            nees.into_iter().for_each(|nees| tally.nees.add(nees));
        }
    }

    pub(crate) fn sums(&self) -> Sums {
        let mut sums = Sums::default();
        for tally in self.of.values() {
            let share = |part: u64, n: u64| Mean { sum: part as f64, n };
            sums.in_custody = sums.in_custody.and(Mean { sum: tally.in_custody, n: tally.steps });
            sums.in_view = sums.in_view.and(share(tally.in_view, tally.steps));
            sums.out_of_view = sums.out_of_view.and(share(tally.out_of_view, tally.member));
            sums.reacquired = sums.reacquired.and(share(tally.found.n, tally.losses));
            sums.reacquisition = sums.reacquisition.and(tally.found);
            sums.longest_gap = sums.longest_gap.max(tally.longest_gap);
            sums.longest_streak = sums.longest_streak.max(tally.longest_streak);
        }
        sums
    }

    /// Returns `anees` of the targets that never manoeuvre and of those that do, if there are any of the latter.
    pub(crate) fn consistency(&self, manoeuvring: &BTreeSet<u32>) -> [Option<f64>; 2] {
        let mut means = [Mean::default(); 2];
        for (target, tally) in self.of.iter() {
            let mean = &mut means[usize::from(manoeuvring.contains(&target))];
            *mean = mean.and(tally.nees);
        }
        if manoeuvring.is_empty() { [None; 2] } else { means.map(|mean| mean.value()) }
    }

    pub(crate) fn targets_mean(&self) -> Option<f64> {
        let steps: u64 = self.of.values().map(|tally| tally.steps).sum();
        (self.frames > 0).then(|| steps as f64 / self.frames as f64)
    }

    pub(crate) fn scores(&self, config: &ScoreConfig) -> impl Iterator<Item = TargetScore> {
        let share = |part: u64, of: u64| (of > 0).then(|| part as f64 / of as f64);
        let of_members = config.reported.tracks && config.reported.groups;
        self.of.iter().map(move |(target, tally)| TargetScore {
            target,
            until_s: tally.until_us as f64 / 1e6,
            manoeuvres: config.manoeuvring.contains(&target),
            custody_fraction: Mean { sum: tally.in_custody, n: tally.steps }.value().filter(|_| of_members),
            in_view_fraction: share(tally.in_view, tally.steps),
            longest_out_of_view_s: (tally.steps > 0).then_some(tally.longest_gap as f64 * config.period_s),
            position_error_m: tally.position_m.value().filter(|_| of_members),
            anees: tally.nees.value().filter(|_| of_members),
        })
    }
}

impl Tally {
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
    fn sums(courses: &[&[At]]) -> Sums {
        let [sums, of_each_sensor] = [false, true].map(|is_of_each_sensor| sums_by(courses, is_of_each_sensor));
        assert_eq!(format!("{sums:?}"), format!("{of_each_sensor:?}"));
        sums
    }

    fn sums_by(courses: &[&[At]], is_of_each_sensor: bool) -> Sums {
        let config = score_config();
        let mut tallies = Tallies::default();
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
            let mut coverage = Coverage::new(is_of_each_sensor);
            coverage.fill(&frame, &config.sensor);
            tallies.frame(&config, &frame, &Matching::of(&frame), (&Grouped::of(&frame), &coverage));
        }
        tallies.sums()
    }

    fn found(courses: &[&[At]]) -> (Option<f64>, Option<f64>) {
        let sums = sums(courses);
        (sums.reacquired.value(), sums.reacquisition.value())
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
