//! A time step of the tracks of detections without label: prediction, joint association, initiation, confirmation and
//! deletion.

use crate::time::Duration;
use crate::tracking::association::joint::JointUpdate;
use crate::tracking::association::scan_model::new_target_fraction;
use crate::tracking::candidate::Candidate;
use crate::tracking::confirmation::CONFIRMED;
use crate::tracking::existence::{Tentative, UnlabelledTracks};
use crate::tracking::input::TrackerInput;
use crate::tracking::track::StepLog;
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Probability of existence at which a tentative track is dropped, as a fraction of that of a new one.
const DROPPED: f64 = 0.2;

/// Time after which a tentative track that is not confirmed is dropped, s.
const TENTATIVE_MAX_S: f64 = 20.0;

/// Maximum number of detections of a scan that are used: the nearest ones.
const DETECTIONS_MAX: usize = 2000;

impl UnlabelledTracks {
    /// Advances all tracks without labels to a time step, and updates them with its scans.
    pub(crate) fn step<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        update: &mut JointUpdate,
        log: &mut StepLog,
    ) {
        if self.is_empty() && !input.scans.have_unlabelled() {
            return;
        }
        self.confirmed.retain(|of| tracks.index(of.id).is_ok());
        update.gather(self, tracks, input, log);
        for (uav, model, detections) in input.scans.unlabelled() {
            let used = &detections[..detections.len().min(DETECTIONS_MAX)];
            log.rejected += (detections.len() - used.len()) as u32;
            update.associate(&model, used, &mut log.rejected);
            if input.scans.starts_tracks(uav) {
                update.start(&model, used, uav, input, log);
            }
        }
        self.finish(tracks, input, update, log);
    }

    /// Writes the results of a time step back: tracks updated, lost, confirmed, reacquired and dropped.
    fn finish<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        update: &mut JointUpdate,
        log: &mut StepLog,
    ) {
        self.tentative.clear();
        // Targets in a blind zone are missed for another reason: their detections are not those of a neighbour's track.
        if !input.has_blind_zone() {
            update.end_duplicates();
        }
        for candidate in &update.candidates {
            let Some(row) = candidate.row else { continue };
            let track = tracks.rows_mut()[row].track_mut();
            let estimate = candidate.modes.moments();
            let missed = if candidate.is_in_view { input.transition.dt } else { Duration::ZERO };
            let change = track.conclude(&estimate, candidate.detected, missed, candidate.existence, input.params);
            if let Some(kind) = change {
                log.add(track.id, kind);
            }
            self.enter(candidate.entry(candidate.id));
        }
        let least_existence = DROPPED * new_target_fraction(&input.params.sensor);
        for candidate in update.candidates.iter().filter(|candidate| candidate.row.is_none()) {
            let estimate = candidate.modes.moments();
            let is_old = (input.now - candidate.started).s() > TENTATIVE_MAX_S;
            if candidate.existence >= CONFIRMED {
                self.confirm(candidate, estimate, tracks, input, log);
            } else if candidate.existence >= least_existence && !is_old && estimate.checked().is_some() {
                let Candidate { id, existence, started, .. } = *candidate;
                self.tentative.push(Tentative { id, estimate, existence, started });
            }
        }
        self.tentative.sort_unstable_by_key(|of| of.id);
        self.tentative.dedup_by_key(|of| of.id);
        self.include_exchanges(tracks);
    }
}
