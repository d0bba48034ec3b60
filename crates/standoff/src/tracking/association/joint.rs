//! Association without labels: joint integrated probabilistic data association (JIPDA).
//!
//! For each scan, the detections are associated with the tracks jointly. A track becomes the mean and covariance of the
//! mixture of all its associations, and its existence more likely with each probable detection and less likely with each
//! miss. The blind zone of the sensor enters both: a miss makes a low radial speed more likely, a detection less likely.

use crate::math;
use crate::message::Detection;
use crate::tracking::association::joint_events::{Edge, JointEvents};
use crate::tracking::association::scan_model::{Hit, ScanModel, View, Views};
use crate::tracking::candidate::{Candidate, DETECTED_MAX, detection_probability};
use crate::tracking::existence::UnlabelledTracks;
use crate::tracking::input::TrackerInput;
use crate::tracking::motion_modes::{MotionModes, MotionTransitions};
use crate::tracking::track::StepLog;
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Number of scans whose new targets the first scan finds, unless there were cues: that of the mean time that a target
/// exists, 1 / [`END_RATE_1_S`], at three scans per second.
const UNDETECTED_SCANS: f64 = 1000.0;

/// Rate at which targets cease to exist, or tracks to follow them, 1/s.
const END_RATE_1_S: f64 = 0.003;

/// Ratio of an edge below which a detection is certainly not of a track.
const RATIO_MIN: f64 = 1e-4;

/// Maximum number of possible pairs of a track and a detection in a scan. Beyond it, tracks find no further detections.
const EDGES_MAX: usize = 20_000;

/// Computes time steps of tracks without label. It keeps no state between them, only buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct JointUpdate {
    /// Probability that a target in view still exists, and its track still follows it, after the time step.
    survival: f64,
    /// Number of targets that a scan may discover, as a multiple of those that have just appeared.
    undetected_factor: f64,
    pub(in crate::tracking) candidates: Vec<Candidate>,
    views: Vec<Views>,
    joint: JointEvents,
    edges: Vec<Edge>,
    /// Detections conditioned on being of a track, by edge.
    hits: Vec<Hit>,
    /// End of each edge's hits.
    hits_ends: Vec<usize>,
    /// Density of false alarms and of new targets at each detection.
    pub(in crate::tracking) backgrounds: Vec<[f64; 2]>,
    /// For each detection, the probability that it is of a track.
    pub(in crate::tracking) explained: Vec<f64>,
}

impl JointUpdate {
    /// Predicts all tracks without label to the time step.
    pub(in crate::tracking) fn gather<R: TrackRow>(
        &mut self,
        state: &UnlabelledTracks,
        tracks: &TrackTable<R>,
        input: &TrackerInput,
        log: &StepLog,
    ) {
        let transitions = MotionTransitions::new(input.transition, input.params);
        self.survival = math::exp(-END_RATE_1_S * input.transition.dt.s());
        // With a blind zone, misses would not end the false tracks that start then.
        let is_first_look = input.is_first_scan && tracks.rows().is_empty() && !input.has_blind_zone();
        self.undetected_factor = if is_first_look { UNDETECTED_SCANS } else { 1.0 };
        self.candidates.clear();
        for (row, of) in tracks.rows().iter().enumerate() {
            let track = of.track();
            let Some(known) = state.confirmed(track.id).filter(|_| !track.is_lost()) else { continue };
            let mut modes = known.modes.restored(known.own_estimate(track));
            // A track that a cue has just started is already at this time step.
            if !log.has_started(track.id) {
                let can_stop = known.detected_count >= DETECTED_MAX && input.has_blind_zone();
                modes.predict(&transitions, can_stop);
            }
            self.candidates.push(Candidate {
                row: Some(row),
                detected_count: known.detected_count,
                ..Candidate::new(track.id, modes, known.existence, input.now)
            });
        }
        for tentative in &state.tentative {
            let mut modes = MotionModes::moving(tentative.estimate);
            modes.predict(&transitions, false);
            self.candidates.push(Candidate::new(tentative.id, modes, tentative.existence, tentative.started));
        }
    }

    /// Associates the detections of one scan with all candidates, and updates these.
    pub(in crate::tracking) fn associate(&mut self, model: &ScanModel, detections: &[Detection], rejected: &mut u32) {
        self.views.clear();
        self.views.extend(self.candidates.iter().map(|candidate| model.views(&candidate.modes)));
        let factor = self.undetected_factor;
        let background = |[false_alarms, new_targets]: [f64; 2]| [false_alarms, new_targets * factor];
        self.backgrounds.clear();
        self.backgrounds.extend(detections.iter().map(|detection| background(model.background(detection))));
        self.find_edges(model, detections, rejected);
        self.joint.solve(&mut self.edges, detections.len());
        self.explained.clear();
        self.explained.resize(detections.len(), 0.0);
        self.edges.iter().for_each(|edge| self.explained[edge.detection] += edge.probability);
        self.update_candidates(model);
    }

    /// Lists the possible pairs of a candidate and a detection.
    fn find_edges(&mut self, model: &ScanModel, detections: &[Detection], rejected: &mut u32) {
        let Self { survival, candidates, views, edges, hits, hits_ends, backgrounds, .. } = self;
        edges.clear();
        hits.clear();
        hits_ends.clear();
        for (track, (candidate, views)) in candidates.iter_mut().zip(&*views).enumerate() {
            if views.iter().all(Option::is_none) {
                continue;
            }
            if !candidate.is_in_view && views.iter().flatten().any(View::is_in_view) {
                (candidate.existence, candidate.is_in_view) = (candidate.existence * *survival, true);
            }
            let missed = 1.0 - candidate.existence * detection_probability(&candidate.modes, views);
            for detection in model.possible(views, detections) {
                if edges.len() >= EDGES_MAX {
                    *rejected += 1;
                    break;
                }
                let density = model.add_hits(&candidate.modes, views, &detections[detection], hits);
                let background: f64 = backgrounds[detection].iter().sum();
                let ratio = candidate.existence * density / (missed.max(1e-9) * background);
                if ratio < RATIO_MIN {
                    hits.truncate(hits_ends.last().copied().unwrap_or(0));
                } else {
                    edges.push(Edge { track, detection, ratio, probability: 0.0 });
                    hits_ends.push(hits.len());
                }
            }
        }
    }

    /// Updates all candidates that may be in view, by the probabilities of their edges.
    fn update_candidates(&mut self, model: &ScanModel) {
        let Self { candidates, views, edges, hits, hits_ends, .. } = self;
        let mut start = 0;
        for (track, (candidate, views)) in candidates.iter_mut().zip(&*views).enumerate() {
            let end = start + edges[start..].iter().take_while(|edge| edge.track == track).count();
            if !views.iter().all(Option::is_none) {
                let first = start.checked_sub(1).map_or(0, |before| hits_ends[before]);
                candidate.update(model, views, &edges[start..end], hits, first, &hits_ends[start..end]);
            }
            start = end;
        }
    }
}
