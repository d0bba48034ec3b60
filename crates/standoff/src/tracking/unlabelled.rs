//! Tracks of detections without label: joint integrated probabilistic data association (JIPDA).
//!
//! Each track has a probability of existence. For each scan, the detections are associated with the tracks jointly; a
//! track becomes the mean and covariance of the mixture of all its associations, and its existence more likely with each
//! probable detection and less likely with each miss. The blind zone of the sensor enters both: a miss makes a low radial
//! speed more likely, a detection less likely.
//!
//! A detection of no track starts a *tentative* track. It is in no group and causes no event until its existence is
//! almost certain; then it enters the table of tracks.

use crate::message::Detection;
use crate::time::Time;
use crate::tracking::gaussian::{Gaussian, Mixture};
use crate::tracking::information_filter::Estimate;
use crate::tracking::joint_association::{Edge, JointAssociation};
use crate::tracking::scan_model::{Hit, ScanModel, Visibility};
use crate::tracking::track::{Track, TrackId};
use crate::tracking::track_table::{TrackRow, TrackTable};
use crate::tracking::tracker::{TrackChange, TrackChangeKind, TrackerInput};
use crate::uav::UavId;

/// Probability of existence at which a tentative track is confirmed.
const CONFIRMED: f64 = 0.99;

/// Probability of existence at which a tentative track is dropped, and a confirmed one lost.
const DROPPED: f64 = 0.01;
const LOST: f64 = 0.02;

/// Time after which a tentative track that is not confirmed is dropped, s.
const TENTATIVE_MAX_S: f64 = 20.0;

/// Maximum number of tentative tracks.
const TENTATIVE_MAX: usize = 400;

/// Rate at which targets cease to exist, 1/s.
const END_RATE_1_S: f64 = 4e-4;

/// Probability of existence of a target with a cue.
const CUED_EXISTENCE: f64 = 0.95;

/// Squared distance between the estimates of one target, in standard deviations, that 99 % do not exceed, for positions.
const POSITION_GATE: f64 = 9.2;

/// State of the tracks without labels, apart from what the table of tracks contains.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct UnlabelledTracks {
    /// Probability of existence of each track in the table that has no label, by ascending id.
    existences: Vec<(TrackId, f64)>,
    /// Tentative tracks, by ascending id.
    tentative: Vec<Tentative>,
}

/// A track that may be of no target.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Tentative {
    pub(crate) id: TrackId,
    pub(crate) estimate: Estimate,
    pub(crate) existence: f64,
    started: Time,
}

/// A track while a time step is computed.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    id: TrackId,
    gaussian: Gaussian,
    existence: f64,
    /// Index in the table; `None` if it is tentative.
    row: Option<usize>,
    started: Time,
    /// Probability that a detection of this time step is of it.
    detected: f64,
}

/// Buffers of a time step.
#[derive(Debug, Clone, Default)]
pub(crate) struct UnlabelledUpdate {
    candidates: Vec<Candidate>,
    joint: JointAssociation,
    edges: Vec<Edge>,
    hits: Vec<Hit>,
    /// For each detection, the probability that it is of a track.
    explained: Vec<f64>,
    /// Number of tentative tracks that did not start because there were too many.
    pub(crate) rejected: u32,
}

impl UnlabelledTracks {
    pub(crate) fn is_empty(&self) -> bool {
        self.existences.is_empty() && self.tentative.is_empty()
    }

    fn existence(&self, id: TrackId) -> Option<f64> {
        self.existences.binary_search_by_key(&id, |(id, _)| *id).ok().map(|index| self.existences[index].1)
    }

    /// True if a track belongs here and not to the labelled ones.
    pub(crate) fn contains(&self, id: TrackId) -> bool {
        self.existence(id).is_some()
    }

    /// True if the state is one that a time step can leave.
    pub(crate) fn is_valid(&self, now: Time) -> bool {
        let is_probability = |probability: f64| (0.0..=1.0).contains(&probability);
        self.existences.is_sorted_by(|a, b| a.0 < b.0)
            && self.existences.iter().all(|(_, existence)| is_probability(*existence))
            && self.tentative.is_sorted_by(|a, b| a.id < b.id)
            && self.tentative.len() <= TENTATIVE_MAX
            && self
                .tentative
                .iter()
                .all(|of| is_probability(of.existence) && of.started <= now && is_usable(&of.estimate))
    }

    /// True if a cue without label is probably of a track that exists already.
    pub(crate) fn has_track_near<R: TrackRow>(&self, tracks: &TrackTable<R>, cued: &Estimate) -> bool {
        let live = tracks.rows().iter().map(TrackRow::track).filter(|track| !track.is_lost());
        live.map(Track::estimate).any(|estimate| squared_distance(estimate, cued) < POSITION_GATE)
    }

    /// Enters a track that a cue has started.
    pub(crate) fn enter_cued(&mut self, id: TrackId) {
        self.set_existence(id, CUED_EXISTENCE);
    }

    fn set_existence(&mut self, id: TrackId, existence: f64) {
        match self.existences.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(index) => self.existences[index].1 = existence,
            Err(index) => self.existences.insert(index, (id, existence)),
        }
    }

    /// Advances all tracks without labels by the scans of a time step. Those in the table are already predicted.
    pub(crate) fn step<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        buffers: &mut UnlabelledUpdate,
        changes: &mut Vec<TrackChange>,
    ) {
        buffers.rejected = 0;
        if self.is_empty() && !input.scans.have_unlabelled() {
            return;
        }
        self.existences.retain(|(id, _)| tracks.index(*id).is_ok());
        buffers.gather(self, tracks, input);
        for (uav, model, detections) in input.scans.unlabelled() {
            buffers.update(&model, detections);
            buffers.start(&model, detections, uav, input);
        }
        self.finish(tracks, input, buffers, changes);
    }

    /// Writes the results of a time step back: tracks updated, lost, confirmed, reacquired and dropped.
    fn finish<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        buffers: &mut UnlabelledUpdate,
        changes: &mut Vec<TrackChange>,
    ) {
        self.tentative.clear();
        for candidate in &buffers.candidates {
            let Some(row) = candidate.row else { continue };
            let track = tracks.rows_mut()[row].track_mut();
            let change = track.conclude(
                &Estimate::from(&candidate.gaussian),
                candidate.detected,
                candidate.existence < LOST,
                input.params,
            );
            if let Some(kind) = change {
                changes.push(TrackChange { track: track.id, kind });
            }
            self.set_existence(candidate.id, candidate.existence);
        }
        for candidate in buffers.candidates.iter().filter(|candidate| candidate.row.is_none()) {
            let age = input.now - candidate.started;
            let estimate = Estimate::from(&candidate.gaussian);
            if candidate.existence < DROPPED || age.s() > TENTATIVE_MAX_S || !is_usable(&estimate) {
                continue;
            }
            if candidate.existence < CONFIRMED {
                let Candidate { id, existence, started, .. } = *candidate;
                self.tentative.push(Tentative { id, estimate, existence, started });
                continue;
            }
            let predecessor = self.predecessor(tracks, &estimate, input);
            let id = predecessor.unwrap_or(candidate.id);
            let kind = if predecessor.is_some() { TrackChangeKind::Reacquired } else { TrackChangeKind::Started };
            let Some(track) = Track::from_estimate(id, estimate) else { continue };
            let is_stored = match tracks.index(id) {
                Ok(row) => {
                    *tracks.rows_mut()[row].track_mut() = track;
                    true
                }
                Err(_) => tracks.start(track, input.tracks_max),
            };
            if is_stored {
                self.set_existence(id, candidate.existence);
                changes.push(TrackChange { track: id, kind });
            } else {
                buffers.rejected += 1;
            }
        }
        self.tentative.sort_unstable_by_key(|of| of.id);
        self.tentative.dedup_by_key(|of| of.id);
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
            estimate.state = transition.predict(&estimate.state);
            transition.predict_covariance(&mut estimate.covariance);
            let is_known = estimate.position_sd_max_m() < 2.0 * input.params.deletion_position_sd_m;
            let distance = squared_distance(&estimate, new);
            (is_known && distance < POSITION_GATE).then_some((distance, track.id))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, id)| id)
    }
}

impl UnlabelledUpdate {
    fn gather<R: TrackRow>(&mut self, state: &UnlabelledTracks, tracks: &TrackTable<R>, input: &TrackerInput) {
        let survival = crate::math::exp(-END_RATE_1_S * input.transition.dt.s());
        self.candidates.clear();
        for (row, of) in tracks.rows().iter().enumerate() {
            let track = of.track();
            if let Some(existence) = state.existence(track.id).filter(|_| !track.is_lost()) {
                self.candidates.push(Candidate {
                    id: track.id,
                    gaussian: track.estimate().into(),
                    existence: existence * survival,
                    row: Some(row),
                    started: input.now,
                    detected: 0.0,
                });
            }
        }
        for tentative in &state.tentative {
            let mut estimate = tentative.estimate;
            estimate.state = input.transition.predict(&estimate.state);
            input.transition.predict_covariance(&mut estimate.covariance);
            self.candidates.push(Candidate {
                id: tentative.id,
                gaussian: (&estimate).into(),
                existence: tentative.existence * survival,
                row: None,
                started: tentative.started,
                detected: 0.0,
            });
        }
    }

    /// Updates all candidates with one scan.
    fn update(&mut self, model: &ScanModel, detections: &[Detection]) {
        let Self { candidates, joint, edges, hits, explained, .. } = self;
        edges.clear();
        hits.clear();
        explained.clear();
        explained.resize(detections.len(), 0.0);
        let visibilities: Vec<Option<Visibility>> =
            candidates.iter().map(|candidate| model.visibility(&candidate.gaussian)).collect();
        let backgrounds: Vec<f64> =
            detections.iter().map(|detection| model.background(detection).iter().sum()).collect();
        for (track, (candidate, visibility)) in candidates.iter().zip(&visibilities).enumerate() {
            let Some(visibility) = visibility else { continue };
            let missed = 1.0 - candidate.existence * visibility.detection_probability();
            for (detection, z) in detections.iter().enumerate() {
                if let Some(hit) = model.hit(&candidate.gaussian, visibility, z) {
                    let ratio = candidate.existence * hit.density / (missed.max(1e-9) * backgrounds[detection]);
                    edges.push(Edge { track, detection, ratio, probability: 0.0 });
                    hits.push(hit);
                }
            }
        }
        joint.solve(edges, detections.len());
        let mut next = 0;
        for (track, (candidate, visibility)) in candidates.iter_mut().zip(&visibilities).enumerate() {
            let Some(visibility) = visibility else { continue };
            let start = next;
            while edges.get(next).is_some_and(|edge| edge.track == track) {
                next += 1;
            }
            let mut mixture = Mixture::about(candidate.gaussian.mean);
            let mut hit_probability = 0.0;
            for (edge, hit) in edges[start..next].iter().zip(&hits[start..next]) {
                hit_probability += edge.probability;
                explained[edge.detection] += edge.probability;
                mixture.add(edge.probability, &hit.posterior);
            }
            let missed = (1.0 - hit_probability).max(0.0);
            let pd = visibility.detection_probability();
            let exists_missed = missed * candidate.existence * (1.0 - pd) / (1.0 - candidate.existence * pd).max(1e-12);
            model.add_miss(&candidate.gaussian, visibility, exists_missed, &mut mixture);
            candidate.existence = (hit_probability + exists_missed).min(1.0);
            candidate.detected = candidate.detected.max(hit_probability);
            if let Some(gaussian) = mixture.moments() {
                candidate.gaussian = gaussian;
            }
        }
    }

    /// Starts tentative tracks from the detections that are probably of no track.
    fn start(&mut self, model: &ScanModel, detections: &[Detection], uav: UavId, input: &TrackerInput) {
        let mut repeats = 0;
        for (index, detection) in detections.iter().enumerate() {
            let is_repeat = index > 0 && detections[index - 1].order() == detection.order();
            repeats = if is_repeat { repeats + 1 } else { 0 };
            let [false_alarms, new_targets] = model.background(detection);
            let existence = (1.0 - self.explained[index]).max(0.0) * new_targets / (new_targets + false_alarms);
            if existence < DROPPED * 0.1 || self.explained[index] > 0.9 {
                continue;
            }
            let tentative = self.candidates.iter().filter(|candidate| candidate.row.is_none()).count();
            if tentative >= TENTATIVE_MAX {
                self.rejected += 1;
                continue;
            }
            let (_, _, range, bearing, rate) = detection.order();
            let id = TrackId::minted([input.now.us() as u64, uav.0.into(), range, bearing, rate.unwrap_or(0), repeats]);
            let measured = (model.uav_position(), detection.measurement);
            let Some(track) = Track::from_measurements(id, [measured], input.params) else { continue };
            let mut gaussian = Gaussian::from(track.estimate());
            if let Some([_, _, Some(rate)]) = model.linearised(&gaussian, detection) {
                gaussian.condition(&rate);
            }
            self.candidates.push(Candidate { id, gaussian, existence, row: None, started: input.now, detected: 1.0 });
        }
    }
}

/// True if an estimate can be predicted and updated.
fn is_usable(estimate: &Estimate) -> bool {
    crate::tracking::information_filter::InformationFilter::new(*estimate).is_some()
}

/// Squared distance between two independent estimates of a position, in standard deviations.
fn squared_distance(a: &Estimate, b: &Estimate) -> f64 {
    let between = a.state.position() - b.state.position();
    let covariance = a.position_covariance() + b.position_covariance();
    covariance.try_inverse().map_or(f64::INFINITY, |inverse| between.vector().dot(&(inverse * between.vector())))
}
