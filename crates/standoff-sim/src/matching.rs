//! Matching of the true targets and the tracks of one time step.
//!
//! Data association is assumed to be solved: the key of a track, and the target of a detection, are the id of the true
//! target. Scores, figures and pages rely on this only through this module.

use standoff::Position;

use crate::frame::{DetectionRow, Frame, TrackRow, TruthRow};

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
        let Self { target, track } = self;
        Position::from_m(track.state[0], track.state[3]).distance_m(Position::from_m(target.x_m, target.y_m))
    }
}

/// True targets and tracks of one time step. Each target has at most one track, and each track at most one target.
#[derive(Debug, Clone, Default)]
pub struct Matching<'a> {
    /// Existing targets by ascending id, each with its track.
    targets: Vec<(&'a TruthRow, Option<&'a TrackRow>)>,
    unmatched_tracks: Vec<&'a TrackRow>,
}

impl<'a> Matching<'a> {
    /// Matches the targets and the tracks of a frame.
    #[must_use]
    pub fn of(frame: &'a Frame) -> Self {
        Self::of_rows(&frame.truth, &frame.tracks)
    }

    /// Matches targets and tracks, both sorted as in a frame.
    pub(crate) fn of_rows(truth: &'a [TruthRow], tracks: impl IntoIterator<Item = &'a TrackRow>) -> Self {
        let mut matching = Self { targets: Vec::with_capacity(truth.len()), unmatched_tracks: Vec::new() };
        let mut tracks = tracks.into_iter().peekable();
        for target in truth {
            while let Some(track) = tracks.next_if(|track| key(track) < target.target) {
                matching.unmatched_tracks.push(track);
            }
            matching.targets.push((target, tracks.next_if(|track| key(track) == target.target)));
        }
        matching.unmatched_tracks.extend(tracks);
        matching
    }

    /// Returns the existing targets by ascending id, each with its track.
    pub fn targets(&self) -> impl ExactSizeIterator<Item = (&'a TruthRow, Option<&'a TrackRow>)> {
        self.targets.iter().copied()
    }

    /// Returns the existing targets that have a track, by ascending id.
    pub fn pairs(&self) -> impl Iterator<Item = Matched<'a>> {
        self.targets().filter_map(|(target, track)| track.map(|track| Matched { target, track }))
    }

    /// Returns the tracks whose target does not exist.
    pub fn unmatched_tracks(&self) -> impl ExactSizeIterator<Item = &'a TrackRow> {
        self.unmatched_tracks.iter().copied()
    }

    /// Returns the true state of the target with this id; `None` if it does not exist.
    pub(crate) fn target(&self, id: u32) -> Option<&'a TruthRow> {
        let index = self.targets.binary_search_by_key(&id, |(target, _)| target.target).ok()?;
        Some(self.targets[index].0)
    }

    /// Returns the true state of the target that a track estimates; `None` if the target does not exist.
    pub(crate) fn target_of(&self, track: &TrackRow) -> Option<&'a TruthRow> {
        self.target(key(track))
    }
}

/// Key of a track in the record: the same at all time steps, and independent of the ids that a controller gives its
/// tracks.
pub(crate) fn key(track: &TrackRow) -> u32 {
    track.target
}

/// Returns the index of the track that a detection belongs to, among the tracks of one time step.
pub(crate) fn track_index(detection: &DetectionRow, tracks: &[TrackRow]) -> Option<usize> {
    tracks.binary_search_by_key(&detection.target, key).ok()
}
