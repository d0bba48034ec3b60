//! A track of detections without label while a time step is computed, and its update with the detections of a scan.

use crate::time::Time;
use crate::tracking::association::joint_events::Edge;
use crate::tracking::association::scan_model::{Hit, ScanModel, View, Views};
use crate::tracking::estimate::{Estimate, Mixture};
use crate::tracking::existence::Confirmed;
use crate::tracking::motion_modes::MotionModes;
use crate::tracking::track::TrackId;

/// Number of time steps with detection after which a track is known well enough to stay while its target has stopped.
pub(super) const DETECTED_MAX: u8 = 10;

/// A track while a time step is computed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) id: TrackId,
    pub(super) modes: MotionModes,
    pub(super) existence: f64,
    pub(super) detected_count: u8,
    /// Index in the table; `None` if it is tentative.
    pub(super) row: Option<usize>,
    /// Start of a tentative track.
    pub(super) started: Time,
    /// Probability that a detection of this time step is of it.
    pub(super) detected: f64,
    /// True if it is probably in the view of a sensor.
    pub(super) is_in_view: bool,
}

impl Candidate {
    /// A tentative track that is not detected yet.
    pub(super) fn new(id: TrackId, modes: MotionModes, existence: f64, started: Time) -> Self {
        Self { id, modes, existence, detected_count: 0, row: None, started, detected: 0.0, is_in_view: false }
    }

    /// Replaces the estimate by the moments over all associations with the detections of one scan. The hits of the
    /// first edge start at `first`, those of each edge end at its element of `ends`.
    pub(super) fn update(
        &mut self,
        model: &ScanModel,
        views: &Views,
        edges: &[Edge],
        hits: &[Hit],
        first: usize,
        ends: &[usize],
    ) {
        let pd = detection_probability(&self.modes, views);
        let hit_probability: f64 = edges.iter().map(|edge| edge.probability).sum();
        let missed = (1.0 - hit_probability).max(0.0);
        let exists_missed = missed * self.existence * (1.0 - pd) / (1.0 - self.existence * pd).max(1e-12);
        let mut mixtures = self.modes.all().each_ref().map(|(_, estimate)| Mixture::about(estimate.state.0));
        let mut start = first;
        for (edge, end) in edges.iter().zip(ends) {
            let of_edge = &hits[start..*end];
            let density: f64 = of_edge.iter().map(|hit| hit.weight).sum();
            for hit in of_edge {
                mixtures[hit.mode].add(edge.probability * hit.weight / density, &hit.posterior);
            }
            start = *end;
        }
        for ((mixture, view), (prior, estimate)) in mixtures.iter_mut().zip(views).zip(self.modes.all()) {
            let weight = exists_missed * prior / (1.0 - pd).max(1e-9);
            model.add_miss(estimate, view.as_ref(), weight, mixture);
        }
        self.modes.replace(&mixtures);
        self.existence = (hit_probability + exists_missed).min(1.0);
        self.detected = self.detected.max(hit_probability);
    }

    /// State to keep of it as a track in the table with an id.
    pub(super) fn entry(&self, id: TrackId) -> Confirmed {
        let detected_count = self.detected_count.saturating_add(u8::from(self.detected > 0.5)).min(DETECTED_MAX);
        Confirmed::new(id, self.existence, detected_count, self.modes.stored())
    }
}

/// Probability that a target is detected in a scan, over all motion models.
pub(super) fn detection_probability(modes: &MotionModes, views: &Views) -> f64 {
    let of_mode = |((probability, _), view): (&(f64, Estimate), &Option<View>)| {
        view.as_ref().map_or(0.0, |view| probability * view.detection_probability())
    };
    modes.all().iter().zip(views).map(of_mode).sum()
}
