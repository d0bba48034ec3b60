//! Tracker: advances all tracks by one time step.

use nalgebra::Matrix2;

use crate::sensor::NOISE_SDS_MAX;
use crate::time::Duration;
use crate::tracking::association::joint::JointUpdate;
use crate::tracking::association::label::{Association, associate};
use crate::tracking::existence::UnlabelledTracks;
use crate::tracking::information_filter::Contribution;
use crate::tracking::initiation::{start_unassociated, take_cues};
use crate::tracking::input::{DetectionIndex, Scans, TrackerInput};
use crate::tracking::near_update::NearMeasurement;
use crate::tracking::track::{StepLog, Track, TrackChangeKind, TrackStatus};
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Squared distance of a measurement with label from the prediction of its track, in standard deviations, beyond which it
/// is wrong. Normal errors reach it in one of 10^21 measurements.
const GATE: f64 = NOISE_SDS_MAX * NOISE_SDS_MAX;

/// Standard deviation of the motion of targets that their model omits, m, and its rate, m/s: a vehicle changes lanes, or
/// its speed, within a time step.
const UNMODELLED_SD_M: f64 = 5.0;
const UNMODELLED_SD_M_S: f64 = 5.0;

/// Advances the tracks. It keeps no state between time steps, only buffers and the results of the last one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tracker {
    association: Association,
    /// Sum of the measurements of each track, by index.
    measured: Vec<Option<Contribution>>,
    /// Measurements from nearby, which are not in these sums, each with the index of the track.
    near: Vec<(usize, DetectionIndex, NearMeasurement)>,
    /// Detections beyond the gate, each with the index of its track; those of one track are in the order of the UAVs.
    gated: Vec<(usize, DetectionIndex)>,
    joint: JointUpdate,
    /// Changes in the last time step.
    pub(crate) log: StepLog,
}

impl Tracker {
    /// Advances the tracks to the time step of `input`. Before the call, `tracks` equals `previous`. Returns true if
    /// tracks were started or removed.
    ///
    /// Each stage processes all tracks, so that no track waits for the results of another.
    pub(crate) fn step<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        unlabelled: &mut UnlabelledTracks,
        previous: &TrackTable<R>,
        input: &TrackerInput,
    ) -> bool {
        self.log.clear();
        for row in tracks.rows_mut() {
            let track = row.track_mut();
            if track.is_lost() || !unlabelled.contains(track.id) {
                track.predict(input.transition);
            }
        }
        // If the maximum number of tracks is reached, lost ones are removed immediately.
        let is_full = tracks.rows().len() >= input.tracks_max;
        let after_s = if is_full { 0.0 } else { input.params.lost_track_retention_s };
        let has_removed = tracks.remove_lost(Duration::from_s(after_s));
        take_cues(tracks, unlabelled, input, &mut self.log);
        associate(tracks, &input.scans, &mut self.association);
        self.take_near_measurements(tracks, &input.scans);
        self.sum_measurements(tracks, input);
        self.update(tracks, unlabelled, previous, input);
        self.apply_near_measurements(tracks);
        self.apply_range_rates(tracks, &input.scans);
        start_unassociated(tracks, &self.association, input, &mut self.log);
        unlabelled.step(tracks, input, &mut self.joint, &mut self.log);
        let is_start = |kind: &TrackChangeKind| matches!(kind, TrackChangeKind::Cued | TrackChangeKind::Started);
        has_removed || self.log.changes.iter().any(|change| is_start(&change.kind))
    }

    /// Linearises the measurements about the predicted position of their track and sums them, in the order of the UAVs.
    /// Those beyond the gate are no longer associated.
    ///
    /// Implements the sums of Eq. (10), (11).
    fn sum_measurements<R: TrackRow>(&mut self, tracks: &TrackTable<R>, input: &TrackerInput) {
        let scans = &input.scans;
        let unmodelled_sd_m = UNMODELLED_SD_M + UNMODELLED_SD_M_S * input.transition.dt.s();
        let unmodelled = Matrix2::from_diagonal_element(unmodelled_sd_m * unmodelled_sd_m);
        let Self { association, measured, near, gated, .. } = self;
        gated.clear();
        measured.clear();
        measured.resize(tracks.rows().len(), None);
        // In batches of four (SIMD). An incomplete batch is filled with copies of its last element.
        for batch in association.weighted.chunks(4) {
            let four: [_; 4] = core::array::from_fn(|i| batch[i.min(batch.len() - 1)]);
            let estimate = |track_index: usize| tracks.rows()[track_index].track().estimate();
            let measurements = four.map(|(track_index, _, detection)| {
                let (uav_position, measurement) = scans.measurement(detection);
                (uav_position, measurement, estimate(track_index).state.position())
            });
            let weights = match &scans.pose_error {
                None => [scans.sensor.noise_weights(); 4],
                Some(pose_error) => core::array::from_fn(|i| {
                    let (uav, _, predicted) = measurements[i];
                    let prior = estimate(four[i].0).position_covariance();
                    pose_error.weights(scans.sensor, uav, predicted, &prior)
                }),
            };
            let contributions = Contribution::from_measurements(measurements, weights);
            for ((track_index, weight, detection), contribution) in batch.iter().zip(contributions) {
                let predicted = estimate(*track_index);
                let covariance = predicted.position_covariance() + unmodelled;
                if contribution.squared_distance(predicted.state.position(), &covariance) > GATE {
                    gated.push((*track_index, *detection));
                } else {
                    *measured[*track_index].get_or_insert_default() += contribution.weighted(*weight);
                }
            }
        }
        if !gated.is_empty() {
            let is_gated = |detection: &DetectionIndex| gated.iter().any(|(_, of)| of == detection);
            association.weighted.retain(|(_, _, detection)| !is_gated(detection));
            near.retain(|(_, detection, _)| !is_gated(detection));
        }
    }

    /// Takes the measurements from nearby out of the association: their weight becomes zero.
    fn take_near_measurements<R: TrackRow>(&mut self, tracks: &TrackTable<R>, scans: &Scans) {
        let Self { association, near, .. } = self;
        near.clear();
        if scans.sensor.near_range_m <= 0.0 {
            return;
        }
        for (track_index, weight, detection) in &mut association.weighted {
            let estimate = tracks.rows()[*track_index].track().estimate();
            let ((uav, measurement), predicted) = (scans.measurement(*detection), estimate.state.position());
            let prior = || estimate.position_covariance();
            if scans.sensor.is_nonlinear(uav, predicted, || prior().trace()) {
                let of_pose = scans.sensor.pose_covariance(scans.pose_error.as_ref(), uav, predicted, prior);
                near.push((*track_index, *detection, NearMeasurement::new(scans.sensor, uav, measurement, of_pose)));
                *weight = 0.0;
            }
        }
    }

    /// Updates the predicted tracks and reacquires lost ones.
    fn update<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        unlabelled: &UnlabelledTracks,
        previous: &TrackTable<R>,
        input: &TrackerInput,
    ) {
        let Self { association, measured, gated, log, .. } = self;
        // Tracks stay in the same order until they are removed.
        let mut olds = previous.rows().iter().map(TrackRow::track).peekable();
        for (index, (row, measured)) in tracks.rows_mut().iter_mut().zip(measured).enumerate() {
            let track = row.track_mut();
            let (id, status) = (track.id, track.status);
            if unlabelled.contains(id) {
                continue;
            }
            while olds.next_if(|old| old.id < id).is_some() {}
            let old = olds.next_if(|old| old.id == id);
            if track.is_lost() {
                let detections = association.unassociated_of(id, &input.scans);
                let reacquired = Track::from_measurements(id, detections, input.params);
                *track = reacquired.unwrap_or(*track);
            } else if measured.is_none() && gated.iter().any(|(of, _)| *of == index) {
                let detections = gated.iter().filter(|(of, _)| *of == index);
                let detections = detections.map(|(_, detection)| input.scans.measurement(*detection));
                track.doubt(input.transition.dt, detections, input.params);
            } else {
                // A track that a cue has just started is already at this time step.
                let cued;
                let (before, dt) = match old.filter(|old| !old.is_lost()) {
                    Some(old) => (old, input.transition.dt),
                    None => {
                        cued = *track;
                        (&cued, Duration::ZERO)
                    }
                };
                let should_be_in_view = |position, clearance_m| input.scans.have_in_view(position, clearance_m);
                track.update(before, measured.as_ref(), dt, should_be_in_view, input.params);
            }
            let kind = match (status, track.status) {
                (TrackStatus::Lost(_), TrackStatus::Lost(_)) => continue,
                (TrackStatus::Lost(_), _) => TrackChangeKind::Reacquired,
                (_, TrackStatus::Lost(reason)) => TrackChangeKind::Lost(reason),
                (TrackStatus::Cued, TrackStatus::Updated) => TrackChangeKind::Confirmed,
                _ => continue,
            };
            log.add(id, kind);
        }
    }

    /// Updates tracks with the measurements from nearby, in the order of the UAVs.
    fn apply_near_measurements<R: TrackRow>(&self, tracks: &mut TrackTable<R>) {
        for (track_index, _, near) in &self.near {
            let track = tracks.rows_mut()[*track_index].track_mut();
            let mut estimate = *track.estimate();
            near.apply(&mut estimate);
            track.refine(&estimate);
        }
    }

    /// Updates tracks with the range rates of their detections with label, if they are measured.
    fn apply_range_rates<R: TrackRow>(&self, tracks: &mut TrackTable<R>, scans: &Scans) {
        for (track_index, _, detection) in &self.association.weighted {
            if let Some((model, detection)) = scans.with_range_rate(*detection) {
                let track = tracks.rows_mut()[*track_index].track_mut();
                let mut estimate = *track.estimate();
                if let Some(rate) = model.range_rate(&estimate, detection) {
                    estimate.condition(&rate);
                    track.refine(&estimate);
                }
            }
        }
    }

    /// Number of detections beyond the gate in the last time step.
    pub(crate) fn gated(&self) -> u32 {
        self.gated.len() as u32
    }
}
