//! How each target fares: how long it is watched, seen, in no view.
//!
//! The truth alone says when a target counts: from the instant after it first exists, when it is cued, to its end. Whatever
//! fails, no later instant is left out; the one of the cue is, because no sensor can have been pointed at the target yet.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use standoff::SensorParams;

use super::mean::Mean;
use super::rules::Rules;
use crate::frame::Frame;
use crate::geometry::{is_seen, looking, position, track_of};

/// All targets that have existed, by id.
#[derive(Debug, Clone, Default)]
pub(super) struct Tallies {
    of: BTreeMap<u32, Tally>,
    /// Frames since the first of them was cued.
    frames: u64,
}

/// One target.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    /// The last instant in which it existed.
    until_us: i64,
    /// Instants in which it existed, after that of its cue.
    instants: u64,
    watched: u64,
    seen: u64,
    /// Instants in a row in no view. In those in which it does not exist it neither is nor is not.
    gap: u64,
    longest_gap: u64,
    /// Instants as a member of a group, and those of them in no view.
    member: u64,
    unseen: u64,
    /// The same in a row: how many, and up to which frame.
    streak: u64,
    streak_until: u64,
    longest_streak: u64,
    keeping: Keeping,
    /// Times that it was lost, and of them those after which it was found: how many instants later, summed.
    losses: u64,
    found: Mean,
    /// Of the estimates while it was a member.
    position_m: Mean,
    nees: Mean,
}

/// Whether the team has a target, which begins and ends with its being watched: a member of a group, and in view.
#[derive(Debug, Clone, Copy, Default)]
enum Keeping {
    /// Not watched yet: nobody can lose it.
    #[default]
    Never,
    /// Watched, and since then in view or in a group at least.
    Kept,
    /// In no group and in no view, and not watched since, for so many instants.
    Lost(u64),
}

/// What all targets come to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) watched: Mean,
    pub(super) seen: Mean,
    pub(super) unseen: Mean,
    /// Instants in a row.
    pub(super) longest_gap: u64,
    pub(super) longest_streak: u64,
    /// Losses after which a target was found, of all.
    pub(super) refound: Mean,
    /// Instants from a loss until it was.
    pub(super) refind: Mean,
}

/// How one target fared, as the metrics of the same names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TargetScore {
    /// Target id.
    #[serde(skip)]
    pub target: u32,
    /// The last instant in which it existed, s.
    pub until_s: f64,
    /// The scenario has it manoeuvre, beside what its model does at random.
    pub manoeuvres: bool,
    /// Share of its time in a group and in some UAV's view, 0 to 1.
    pub watched_fraction: Option<f64>,
    /// Share of its time in some UAV's view, 0 to 1.
    pub seen_fraction: Option<f64>,
    /// Longest time in no UAV's view, s.
    pub longest_gap_s: Option<f64>,
    /// Mean distance of the estimated from the true position while it was in a group, m.
    pub position_error_m: Option<f64>,
    /// Its normalised estimation error squared over the random states; 1 is consistent.
    pub anees: Option<f64>,
}

impl Tallies {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, sensor: &SensorParams, frame: &Frame) {
        let looking = looking(frame);
        let is_first_cue = self.of.is_empty();
        self.frames += u64::from(!is_first_cue);
        for truth in &frame.truth {
            let is_seen = is_seen(sensor, &looking, position(truth));
            let is_member = track_of(frame, truth.target).is_some_and(|track| track.group.is_some());
            let mut is_cue = false;
            let tally = self.of.entry(truth.target).or_insert_with(|| {
                is_cue = true;
                Tally::default()
            });
            tally.until_us = frame.time_us;
            if !is_cue {
                tally.coverage(is_seen, is_member);
            }
            // A target that is taken into a group at its cue is that group's duty at once.
            if is_member && !is_first_cue {
                tally.duty(is_seen, self.frames);
            }
        }
    }

    /// Takes in how far the estimate of a group member is off at the instant of the last frame.
    pub(super) fn estimate(&mut self, target: u32, position_error_m: f64, nees: Option<f64>) {
        if let Some(tally) = self.of.get_mut(&target) {
            tally.position_m.add(position_error_m);
            nees.into_iter().for_each(|nees| tally.nees.add(nees));
        }
    }

    pub(super) fn sums(&self) -> Sums {
        let mut sums = Sums::default();
        for tally in self.of.values() {
            let share = |part: u64, n: u64| Mean { sum: part as f64, n };
            sums.watched = sums.watched.and(share(tally.watched, tally.instants));
            sums.seen = sums.seen.and(share(tally.seen, tally.instants));
            sums.unseen = sums.unseen.and(share(tally.unseen, tally.member));
            sums.refound = sums.refound.and(share(tally.found.n, tally.losses));
            sums.refind = sums.refind.and(tally.found);
            sums.longest_gap = sums.longest_gap.max(tally.longest_gap);
            sums.longest_streak = sums.longest_streak.max(tally.longest_streak);
        }
        sums
    }

    /// `anees` of the targets that never manoeuvre and of those that do, where there are some that do.
    pub(super) fn consistency(&self, manoeuvring: &BTreeSet<u32>) -> [Option<f64>; 2] {
        let mut means = [Mean::default(); 2];
        for (target, tally) in &self.of {
            let mean = &mut means[usize::from(manoeuvring.contains(target))];
            *mean = mean.and(tally.nees);
        }
        if manoeuvring.is_empty() { [None; 2] } else { means.map(|mean| mean.value()) }
    }

    pub(super) fn targets_mean(&self) -> Option<f64> {
        let instants: u64 = self.of.values().map(|tally| tally.instants).sum();
        (self.frames > 0).then(|| instants as f64 / self.frames as f64)
    }

    pub(super) fn scores(&self, rules: &Rules) -> impl Iterator<Item = TargetScore> {
        let share = |part: u64, of: u64| (of > 0).then(|| part as f64 / of as f64);
        let of_members = rules.reported.tracks && rules.reported.groups;
        self.of.iter().map(move |(target, tally)| TargetScore {
            target: *target,
            until_s: tally.until_us as f64 / 1e6,
            manoeuvres: rules.manoeuvring.contains(target),
            watched_fraction: share(tally.watched, tally.instants).filter(|_| of_members),
            seen_fraction: share(tally.seen, tally.instants),
            longest_gap_s: (tally.instants > 0).then_some(tally.longest_gap as f64 * rules.period_s),
            position_error_m: tally.position_m.value().filter(|_| of_members),
            anees: tally.nees.value().filter(|_| of_members),
        })
    }
}

impl Tally {
    fn coverage(&mut self, is_seen: bool, is_member: bool) {
        self.instants += 1;
        self.seen += u64::from(is_seen);
        self.watched += u64::from(is_seen && is_member);
        self.gap = if is_seen { 0 } else { self.gap + 1 };
        self.longest_gap = self.longest_gap.max(self.gap);
        self.keep(is_seen, is_member);
    }

    /// Track life has no say in this: neither a track that is kept for ever nor one that is forgotten changes a number.
    fn keep(&mut self, is_seen: bool, is_member: bool) {
        if let Keeping::Lost(instants) = &mut self.keeping {
            *instants += 1;
        }
        match (self.keeping, is_seen, is_member) {
            (Keeping::Lost(instants), true, true) => {
                self.found.add(instants as f64);
                self.keeping = Keeping::Kept;
            }
            (Keeping::Never, true, true) => self.keeping = Keeping::Kept,
            (Keeping::Kept, false, false) => {
                self.losses += 1;
                self.keeping = Keeping::Lost(0);
            }
            _ => {}
        }
    }

    fn duty(&mut self, is_seen: bool, frame: u64) {
        self.member += 1;
        if !is_seen {
            self.unseen += 1;
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
    use crate::scenario::{Edits, Scenario};
    use crate::score::fixtures::{track_row, truth_row, uav_row};

    /// What becomes of a target at an instant.
    #[derive(Clone, Copy)]
    enum At {
        /// In a group or not, in view or not.
        There(bool, bool),
        /// It has no track.
        Trackless(bool),
        Gone,
    }
    use At::{Gone, There, Trackless};

    const WATCHED: At = There(true, true);
    const UNSEEN_MEMBER: At = There(true, false);
    const SEEN_OUTSIDE: At = There(false, true);
    const LOST: At = There(false, false);

    /// The UAV looks east: what is to the west is not in its view.
    fn sums(courses: &[&[At]]) -> Sums {
        let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1).unwrap();
        let sensor = scenario.settings.team.track.sensor;
        let mut tallies = Tallies::default();
        for instant in 0..courses[0].len() {
            let mut frame = Frame { uavs: vec![uav_row(0)], ..Frame::default() };
            for (target, course) in (0..).zip(courses) {
                let place = |is_seen: bool| truth_row(target, if is_seen { 100.0 } else { -100.0 }, 0.0);
                match course[instant] {
                    There(is_member, is_seen) => {
                        frame.truth.push(place(is_seen));
                        frame.tracks.push(track_row(target, is_member.then_some(0)));
                    }
                    Trackless(is_seen) => frame.truth.push(place(is_seen)),
                    Gone => {}
                }
            }
            tallies.frame(&sensor, &frame);
        }
        tallies.sums()
    }

    fn found(courses: &[&[At]]) -> (Option<f64>, Option<f64>) {
        let sums = sums(courses);
        (sums.refound.value(), sums.refind.value())
    }

    /// Watched, lost at the fourth instant, found at the seventh, lost again at the ninth to the end; the first instant is
    /// that of the cue. One of two losses is found, after three instants.
    #[test]
    fn a_watched_target_in_no_group_and_no_view_is_lost_until_it_is_watched() {
        let course = [WATCHED, WATCHED, UNSEEN_MEMBER, LOST, LOST, SEEN_OUTSIDE, WATCHED, SEEN_OUTSIDE, LOST, LOST];
        assert_eq!(found(&[&course]), (Some(0.5), Some(3.0)));
        // Another that is found after one instant: two of three, (3 + 1) / 2 instants.
        let other = [WATCHED, WATCHED, LOST, WATCHED, WATCHED, WATCHED, WATCHED, WATCHED, WATCHED, WATCHED];
        assert_eq!(found(&[&course, &other]), (Some(2.0 / 3.0), Some(2.0)));
    }

    /// Who was never watched cannot be lost; who was, and is in a group or in view, is not.
    #[test]
    fn what_was_never_watched_or_is_kept_is_not_lost() {
        assert_eq!(found(&[&[LOST, LOST, UNSEEN_MEMBER, LOST, SEEN_OUTSIDE, LOST]]), (None, None));
        assert_eq!(found(&[&[WATCHED, WATCHED, UNSEEN_MEMBER, SEEN_OUTSIDE, UNSEEN_MEMBER]]), (None, None));
        assert_eq!(found(&[&[WATCHED, WATCHED, LOST, LOST]]), (Some(0.0), None));
    }

    /// A track that is forgotten changes nothing, and neither does time in which the target does not exist; a target that
    /// leaves while it is watched is not lost, and one that leaves while it is lost is not found.
    #[test]
    fn neither_forgetting_nor_leaving_flatters() {
        let gone = Trackless(false);
        assert_eq!(found(&[&[WATCHED, WATCHED, gone, gone, Trackless(true), WATCHED]]), (Some(1.0), Some(3.0)));
        assert_eq!(found(&[&[WATCHED, WATCHED, LOST, Gone, Gone, LOST, WATCHED]]), (Some(1.0), Some(2.0)));
        assert_eq!(found(&[&[WATCHED, WATCHED, Gone, Gone]]), (None, None));
        assert_eq!(found(&[&[WATCHED, WATCHED, LOST, Gone]]), (Some(0.0), None));
    }
}
