//! Confirmation: a tentative track whose existence is almost certain enters the table of tracks.

use crate::tracking::candidate::Candidate;
use crate::tracking::estimate::Estimate;
use crate::tracking::exchange::squared_distance;
use crate::tracking::existence::{POSITION_GATE, UnlabelledTracks};
use crate::tracking::input::TrackerInput;
use crate::tracking::track::{StepLog, Track, TrackChangeKind, TrackId};
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Probability of existence at which a tentative track is confirmed.
pub(super) const CONFIRMED: f64 = 0.99;

impl UnlabelledTracks {
    /// Enters a tentative track into the table; if it is near a lost one, in its place.
    pub(super) fn confirm<R: TrackRow>(
        &mut self,
        candidate: &Candidate,
        estimate: Estimate,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        log: &mut StepLog,
    ) {
        let predecessor = self.predecessor(tracks, &estimate, input);
        let (id, kind) = match predecessor {
            Some(id) => (id, TrackChangeKind::Reacquired),
            None => (candidate.id, TrackChangeKind::Started),
        };
        let Some(track) = Track::from_estimate(id, estimate) else { return };
        match tracks.index(id) {
            Ok(row) => *tracks.rows_mut()[row].track_mut() = track,
            Err(_) if tracks.start(track, input.tracks_max) => {}
            Err(_) => return log.rejected += 1,
        }
        self.enter(candidate.entry(id));
        log.add(id, kind);
    }

    /// Lost track whose target a new track probably has.
    fn predecessor<R: TrackRow>(
        &self,
        tracks: &TrackTable<R>,
        new: &Estimate,
        input: &TrackerInput,
    ) -> Option<TrackId> {
        let lost = tracks.rows().iter().map(TrackRow::track).filter(|track| track.is_lost() && self.contains(track.id));
        let near = lost.filter_map(|track| {
            let transition = input.params.transition(track.time_since_lost());
            let mut estimate = *track.estimate();
            estimate.predict(&transition);
            let is_known = estimate.position_sd_max_m() < 2.0 * input.params.deletion_position_sd_m;
            let distance = squared_distance(&estimate, new);
            (is_known && distance < POSITION_GATE).then_some((distance, track.id))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, id)| id)
    }
}
