//! Initiation: tracks start from cues and from detections of targets that have none. A detection without label starts a
//! *tentative* track only.

use crate::message::Detection;
use crate::tracking::association::joint::JointUpdate;
use crate::tracking::association::label::Association;
use crate::tracking::association::scan_model::ScanModel;
use crate::tracking::candidate::Candidate;
use crate::tracking::estimate::Estimate;
use crate::tracking::exchange::squared_distance;
use crate::tracking::existence::{POSITION_GATE, TENTATIVE_MAX, UnlabelledTracks};
use crate::tracking::input::TrackerInput;
use crate::tracking::motion_modes::MotionModes;
use crate::tracking::track::{StepLog, Track, TrackChangeKind, TrackId};
use crate::tracking::track_table::{TrackRow, TrackTable};
use crate::uav::UavId;

/// Maximum probability of existence of a new tentative track: a single detection confirms no track.
const STARTED_MAX: f64 = 0.9;

/// Starts a track from each cue, unless the target has a track that is not lost, or is out of reach of all UAVs. A cue
/// without label is of the target of a track near it. The priority of a cue counts in any case.
pub(super) fn take_cues<R: TrackRow>(
    tracks: &mut TrackTable<R>,
    unlabelled: &mut UnlabelledTracks,
    input: &TrackerInput,
    log: &mut StepLog,
) {
    for cue in input.cues {
        let id = TrackId::of_cue(cue);
        if !tracks.get(id).is_none_or(Track::is_lost) {
            tracks.set_priority(id, cue.priority);
            continue;
        }
        if !input.scans.reach(cue.position) {
            log.rejected += 1;
            continue;
        }
        let Some(track) = Track::from_cue(cue, input.params, input.now) else { continue };
        let known = match cue.label {
            Some(_) => None,
            None => unlabelled.track_near(tracks, log, track.estimate()),
        };
        if known.is_none() && start(tracks, track, TrackChangeKind::Cued, input, log) && cue.label.is_none() {
            unlabelled.enter_cued(track.id);
        }
        tracks.set_priority(known.unwrap_or(id), cue.priority);
    }
}

/// Starts tracks from detections of targets that have none.
pub(super) fn start_unassociated<R: TrackRow>(
    tracks: &mut TrackTable<R>,
    association: &Association,
    input: &TrackerInput,
    log: &mut StepLog,
) {
    let scans = &input.scans;
    for of_one_target in association.unassociated.chunk_by(|a, b| scans.track_id(*a) == scans.track_id(*b)) {
        let Some(id) = scans.track_id(of_one_target[0]) else { continue };
        let detections = of_one_target.iter().filter(|index| scans.starts_tracks(scans.uav(**index)));
        let detections = detections.map(|index| scans.measurement(*index));
        if tracks.get(id).is_none()
            && let Some(track) = Track::from_measurements(id, detections, input.params)
        {
            start(tracks, track, TrackChangeKind::Started, input, log);
        }
    }
}

fn start<R: TrackRow>(
    tracks: &mut TrackTable<R>,
    track: Track,
    kind: TrackChangeKind,
    input: &TrackerInput,
    log: &mut StepLog,
) -> bool {
    let is_started = tracks.start(track, input.tracks_max);
    if is_started {
        log.add(track.id, kind);
    } else {
        log.rejected += 1;
    }
    is_started
}

impl UnlabelledTracks {
    /// Existing track that a cue without label is probably of: the nearest one within the gate. Tracks that other cues
    /// of the time step have started do not count: these cues are of other targets.
    fn track_near<R: TrackRow>(&self, tracks: &TrackTable<R>, log: &StepLog, cued: &Estimate) -> Option<TrackId> {
        let live =
            tracks.rows().iter().map(TrackRow::track).filter(|track| !track.is_lost() && !log.has_started(track.id));
        let distances = live.map(|track| {
            let own = self.confirmed(track.id).map_or(track.estimate(), |of| of.own_estimate(track));
            (squared_distance(own, cued), track.id)
        });
        let near = distances.filter(|(squared, _)| *squared < POSITION_GATE);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
    }
}

impl JointUpdate {
    /// Starts tentative tracks from the detections of a scan that are probably of no track.
    pub(super) fn start(
        &mut self,
        model: &ScanModel,
        detections: &[Detection],
        uav: UavId,
        input: &TrackerInput,
        log: &mut StepLog,
    ) {
        let mut tentative_count = self.candidates.iter().filter(|candidate| candidate.row.is_none()).count();
        let mut repeats = 0;
        for (index, detection) in detections.iter().enumerate() {
            let is_repeat = index > 0 && detections[index - 1].order() == detection.order();
            repeats = if is_repeat { repeats + 1 } else { 0 };
            let [false_alarms, new_targets] = self.backgrounds[index];
            let unexplained = (1.0 - self.explained[index]).max(0.0);
            let existence = (unexplained * new_targets / (new_targets + false_alarms)).min(STARTED_MAX);
            if unexplained < 0.1 {
                continue;
            }
            if tentative_count >= TENTATIVE_MAX {
                log.rejected += 1;
                continue;
            }
            let (_, _, range, bearing, rate) = detection.order();
            let time = input.now.us().cast_unsigned();
            let id = TrackId::minted([time, uav.0.into(), range, bearing, rate.unwrap_or(0), repeats]);
            let measured = (model.uav_position(), detection.measurement);
            let Some(track) = Track::from_measurements(id, [measured], input.params) else { continue };
            let mut estimate = *track.estimate();
            if let Some(rate) = model.range_rate(&estimate, detection) {
                estimate.condition(&rate);
            }
            tentative_count += 1;
            self.candidates.push(Candidate {
                detected: 1.0,
                is_in_view: true,
                ..Candidate::new(id, MotionModes::moving(estimate), existence, input.now)
            });
        }
    }
}
