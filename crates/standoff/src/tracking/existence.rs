//! Existence of the targets of detections without label: each of their tracks has a probability that its target exists.
//! Until it is almost certain, a track is *tentative*: it is in no group and causes no event.

use crate::time::Time;
use crate::tracking::estimate::Estimate;
use crate::tracking::motion_modes::StoredModes;
use crate::tracking::track::{Track, TrackId};

/// Maximum number of tentative tracks.
pub(super) const TENTATIVE_MAX: usize = 400;

/// Probability of existence of a target with a cue.
const CUED_EXISTENCE: f64 = 0.95;

/// Squared distance between the estimates of one target, in standard deviations, that 99 % do not exceed, for positions.
pub(super) const POSITION_GATE: f64 = 9.2;

/// State of the tracks without labels, apart from what the table of tracks contains.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct UnlabelledTracks {
    /// State of each track in the table that has no label, by ascending id.
    pub(super) confirmed: Vec<Confirmed>,
    /// Tentative tracks, by ascending id.
    pub(super) tentative: Vec<Tentative>,
}

/// State of a track in the table, apart from its estimate.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Confirmed {
    pub(super) id: TrackId,
    /// Probability that its target exists.
    pub(super) existence: f64,
    /// Number of time steps in which it was detected, at most [`DETECTED_MAX`](super::candidate::DETECTED_MAX).
    pub(super) detected_count: u8,
    pub(super) modes: StoredModes,
    /// Estimate without exchanges; `None` if it is that in the table.
    pub(super) own: Option<Estimate>,
    /// Tracks that may now follow its target, by ascending id, each with the odds.
    pub(super) exchanges: Vec<(TrackId, f64)>,
}

impl Confirmed {
    pub(super) fn new(id: TrackId, existence: f64, detected_count: u8, modes: StoredModes) -> Self {
        Self { id, existence, detected_count, modes, own: None, exchanges: Vec::new() }
    }

    /// Estimate of its track without exchanges.
    pub(super) fn own_estimate<'a>(&'a self, track: &'a Track) -> &'a Estimate {
        self.own.as_ref().unwrap_or(track.estimate())
    }
}

/// A track that may be of no target.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Tentative {
    pub(super) id: TrackId,
    pub(super) estimate: Estimate,
    pub(super) existence: f64,
    pub(super) started: Time,
}

/// A tentative track: a target that may exist. It is in no group and causes no event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TentativeTrack {
    /// Id that the track has if it is confirmed.
    pub id: TrackId,
    /// State and covariance.
    pub estimate: Estimate,
    /// Probability that the target exists.
    pub existence: f64,
}

impl UnlabelledTracks {
    pub(crate) fn is_empty(&self) -> bool {
        self.confirmed.is_empty() && self.tentative.is_empty()
    }

    /// Tentative tracks, by ascending id.
    pub(crate) fn tentative(&self) -> impl Iterator<Item = TentativeTrack> {
        self.tentative.iter().map(|&Tentative { id, estimate, existence, .. }| TentativeTrack {
            id,
            estimate,
            existence,
        })
    }

    /// True if a track belongs here and not to the labelled ones.
    pub(crate) fn contains(&self, id: TrackId) -> bool {
        self.confirmed(id).is_some()
    }

    pub(super) fn confirmed(&self, id: TrackId) -> Option<&Confirmed> {
        self.confirmed.binary_search_by_key(&id, |of| of.id).ok().map(|index| &self.confirmed[index])
    }

    /// True if the state is one that a time step can leave.
    pub(crate) fn is_valid(&self, now: Time) -> bool {
        let is_probability = |probability: f64| (0.0..=1.0).contains(&probability);
        let is_possible = |of: &Confirmed| {
            let is_usable = of.own.is_none_or(|own| own.checked().is_some());
            let are_odds = of.exchanges.iter().all(|(_, odds)| (0.0..=1.0).contains(odds));
            let are_sorted = of.exchanges.is_sorted_by(|a, b| a.0 < b.0);
            is_probability(of.existence) && of.modes.is_valid() && is_usable && are_odds && are_sorted
        };
        let is_usable =
            |of: &Tentative| is_probability(of.existence) && of.started <= now && of.estimate.checked().is_some();
        self.confirmed.is_sorted_by(|a, b| a.id < b.id)
            && self.confirmed.iter().all(is_possible)
            && self.tentative.is_sorted_by(|a, b| a.id < b.id)
            && self.tentative.len() <= TENTATIVE_MAX
            && self.tentative.iter().all(is_usable)
    }

    /// Enters a track that a cue has started.
    pub(crate) fn enter_cued(&mut self, id: TrackId) {
        self.enter(Confirmed::new(id, CUED_EXISTENCE, 0, StoredModes::default()));
    }

    /// Enters the state of a track. Its exchanges stay.
    pub(super) fn enter(&mut self, entry: Confirmed) {
        match self.confirmed.binary_search_by_key(&entry.id, |of| of.id) {
            Ok(index) => {
                let exchanges = core::mem::take(&mut self.confirmed[index].exchanges);
                self.confirmed[index] = Confirmed { exchanges, ..entry };
            }
            Err(index) => self.confirmed.insert(index, entry),
        }
    }
}
