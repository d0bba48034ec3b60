//! Matching of the true targets and the tracks of one time step.
//!
//! The key of a track, and the target of a detection, are the id of the true target. If sensors report identities, the
//! key is the identity; otherwise [`Identities`] finds the target of each track when the record is written. Scores,
//! figures and pages rely on this only through this module.

mod assignment;
mod identities;

use standoff::Position;
use standoff::by_group::ByGroup;

use standoff_record::{DetectionRow, Frame, TrackRow, TruthRow, UavRow};

pub(crate) use assignment::Assigner;
pub use identities::{CUTOFF_M, Identities};

/// An existing target and the track that estimates it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matched<'a> {
    /// True state of the target.
    pub target: &'a TruthRow,
    /// Its track.
    pub track: &'a TrackRow,
}

impl Matched<'_> {
    /// Returns the distance between the estimated and the true position, m.
    #[must_use]
    pub fn position_error_m(&self) -> f64 {
        estimate(self.track).distance_m(position(self.target))
    }
}

/// True targets and tracks of one time step. Each target has at most one track, and each track at most one target.
#[derive(Debug, Clone, Default)]
pub struct Matching<'a> {
    pairs: Vec<Matched<'a>>,
    unmatched_targets: Vec<&'a TruthRow>,
    unmatched_tracks: Vec<&'a TrackRow>,
    /// Pairs on the orbit of each group, those in dwell from and to it included.
    on_orbits: ByGroup<u32>,
}

impl<'a> Matching<'a> {
    /// Matches the targets and the tracks of a frame.
    #[must_use]
    pub fn of(frame: &'a Frame) -> Self {
        let mut matching = Self { pairs: Vec::with_capacity(frame.truth.len()), ..Self::default() };
        matching.fill(&frame.truth, &frame.tracks);
        matching
    }

    /// Matches targets and tracks, both sorted as in a frame, instead of the current ones.
    pub(crate) fn fill(&mut self, mut truth: &'a [TruthRow], tracks: impl IntoIterator<Item = &'a TrackRow>) {
        self.pairs.clear();
        self.unmatched_targets.clear();
        self.unmatched_tracks.clear();
        for track in tracks {
            while let [target, rest @ ..] = truth
                && target.target < key(track)
            {
                self.unmatched_targets.push(target);
                truth = rest;
            }
            match truth {
                [target, rest @ ..] if target.target == key(track) => {
                    self.pairs.push(Matched { target, track });
                    truth = rest;
                }
                _ => self.unmatched_tracks.push(track),
            }
        }
        self.unmatched_targets.extend(truth);
        self.on_orbits.fill(on_orbits(self.pairs.iter().map(|pair| pair.track)));
    }

    /// Removes all rows, and keeps the memory of the pairs for those of another frame.
    #[expect(clippy::unnecessary_filter_map, reason = "the items get another lifetime")]
    pub(crate) fn emptied(self) -> Matching<'static> {
        // The standard library collects into the memory of the iterator, because the items have the same size.
        let pairs = self.pairs.into_iter().filter_map(|_| None).collect();
        let mut on_orbits = self.on_orbits;
        on_orbits.fill([]);
        Matching { pairs, on_orbits, ..Matching::default() }
    }

    /// Returns the existing targets that have a track, by ascending id.
    #[must_use]
    pub fn pairs(&self) -> &[Matched<'a>] {
        &self.pairs
    }

    /// Returns the pairs on the orbit of a group, those in dwell from and to it included, by ascending id.
    pub(crate) fn on_orbit(&self, group: u32) -> impl Iterator<Item = &Matched<'a>> + Clone {
        self.on_orbits.of(group).map(|index| &self.pairs[index])
    }

    /// Returns all existing targets with their tracks; those without a track come last.
    pub fn targets(&self) -> impl Iterator<Item = (&'a TruthRow, Option<&'a TrackRow>)> {
        let matched = self.pairs.iter().map(|pair| (pair.target, Some(pair.track)));
        matched.chain(self.unmatched_targets.iter().map(|target| (*target, None)))
    }

    /// Returns the tracks of no target, and those whose target does not exist.
    #[must_use]
    pub fn unmatched_tracks(&self) -> &[&'a TrackRow] {
        &self.unmatched_tracks
    }

    /// Returns the true state of the target with this id; `None` if it does not exist.
    pub(crate) fn target(&self, id: u32) -> Option<&'a TruthRow> {
        if let Ok(index) = self.pairs.binary_search_by_key(&id, |pair| pair.target.target) {
            return Some(self.pairs[index].target);
        }
        let index = self.unmatched_targets.binary_search_by_key(&id, |target| target.target).ok()?;
        Some(self.unmatched_targets[index])
    }

    /// Returns the true state of the target that a track estimates; `None` if the target does not exist.
    pub(crate) fn target_of(&self, track: &TrackRow) -> Option<&'a TruthRow> {
        self.target(key(track))
    }
}

/// True position of a target.
pub(crate) fn position(truth: &TruthRow) -> Position {
    Position::from_m(truth.x_m, truth.y_m)
}

/// Estimated position of a track.
pub(crate) fn estimate(track: &TrackRow) -> Position {
    Position::from_m(track.state[0], track.state[3])
}

/// Key of a track in the record: the same at all time steps, and independent of the ids that a controller gives its
/// tracks.
pub(crate) fn key(track: &TrackRow) -> u32 {
    track.target
}

/// Returns group and index of each track on the orbit of a group; a target in dwell is on two orbits.
pub(crate) fn on_orbits<'a>(tracks: impl Iterator<Item = &'a TrackRow>) -> impl Iterator<Item = (u32, usize)> {
    let groups = |track: &TrackRow| [track.group, track.receiving_group].into_iter().flatten();
    tracks.enumerate().flat_map(move |(index, track)| groups(track).map(move |group| (group, index)))
}

/// Returns group and index of each UAV that is assigned to a group.
pub(crate) fn assigned(frame: &Frame) -> impl Iterator<Item = (u32, usize)> {
    frame.uavs.iter().enumerate().filter_map(|(index, uav)| Some((uav.group?, index)))
}

/// Returns the row of the UAV with an id. Ids are usually the indices of the rows.
pub(crate) fn uav(frame: &Frame, id: u32) -> Option<&UavRow> {
    let is_it = |row: &&UavRow| row.uav == id;
    frame.uavs.get(id as usize).filter(is_it).or_else(|| frame.uavs.iter().find(is_it))
}

/// Returns the index of the track that a detection belongs to, among the tracks of one time step.
pub(crate) fn track_index(detection: &DetectionRow, tracks: &[TrackRow]) -> Option<usize> {
    tracks.binary_search_by_key(&detection.target?, key).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::{track_row, truth_row};

    /// Targets 1, 2 and 4; tracks with other ids of targets 0, 2, 3, 4 and 7, each 5 m north of its target.
    #[test]
    fn each_target_has_its_track_and_the_other_tracks_are_unmatched() {
        let track = |target| TrackRow {
            track: 9 - target,
            state: [f64::from(target), 0.0, 0.0, 5.0, 0.0, 0.0],
            ..track_row(target, None)
        };
        let frame = Frame {
            truth: [1, 2, 4].map(|target| truth_row(target, f64::from(target), 0.0)).into(),
            tracks: [0, 2, 3, 4, 7].map(track).into(),
            ..Frame::default()
        };
        let matching = Matching::of(&frame);
        let ids = matching.targets().map(|(target, track)| (target.target, track.map(|track| track.track)));
        assert_eq!(ids.collect::<Vec<_>>(), [(2, Some(7)), (4, Some(5)), (1, None)]);
        assert_eq!(matching.pairs().iter().map(Matched::position_error_m).collect::<Vec<_>>(), [5.0, 5.0]);
        assert_eq!(matching.unmatched_tracks().iter().map(|track| track.track).collect::<Vec<_>>(), [9, 6, 2]);
        let targets = frame.tracks.iter().map(|track| matching.target_of(track).map(|target| target.target));
        assert_eq!(targets.collect::<Vec<_>>(), [None, Some(2), None, Some(4), None]);
        assert_eq!((0..5).filter(|id| matching.target(*id).is_some()).collect::<Vec<_>>(), [1, 2, 4]);
        let of_detection = |target| track_index(&DetectionRow { target, ..DetectionRow::default() }, &frame.tracks);
        assert_eq!([Some(1), Some(3), None].map(of_detection), [None, Some(2), None]);
    }

    /// A scorer keeps its memory between frames.
    #[test]
    fn refilled_matching_equals_a_new_one() {
        let frame = |ids: &[u32]| Frame {
            truth: ids.iter().map(|id| truth_row(*id, 0.0, 0.0)).collect(),
            tracks: [1, 3].map(|target| track_row(target, None)).into(),
            ..Frame::default()
        };
        let (first, second) = (frame(&[1, 2]), frame(&[0, 3]));
        let mut matching = Matching::of(&first).emptied();
        assert_eq!((matching.pairs(), matching.targets().count()), (&[][..], 0));
        matching.fill(&second.truth, &second.tracks);
        let new = Matching::of(&second);
        assert_eq!(matching.pairs(), new.pairs());
        assert!(matching.targets().eq(new.targets()) && matching.unmatched_tracks() == new.unmatched_tracks());
    }
}
