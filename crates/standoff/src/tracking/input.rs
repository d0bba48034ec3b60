//! Input of the tracker for one time step: scans and cues.

use crate::frame::Position;
use crate::grid::Grid;
use crate::message::{Cue, Detection, Report, TEAM_AREA_M};
use crate::params::{SensorParams, TrackParams};
use crate::sensor::RangeBearingMeasurement;
use crate::target::Transition;
use crate::time::Time;
use crate::tracking::association::scan_model::ScanModel;
use crate::tracking::pose_error::PoseError;
use crate::tracking::track::TrackId;
use crate::uav::UavId;

/// Input of one time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrackerInput<'a> {
    /// Time of the time step.
    pub(crate) now: Time,
    /// Target model over the time since the last time step.
    pub(crate) transition: &'a Transition,
    pub(crate) scans: Scans<'a>,
    pub(crate) cues: &'a [Cue],
    /// True if the team has received no scan before.
    pub(crate) is_first_scan: bool,
    pub(crate) params: &'a TrackParams,
    /// Maximum number of tracks.
    pub(crate) tracks_max: usize,
}

impl TrackerInput<'_> {
    /// True if the sensors do not detect slow targets.
    pub(crate) fn has_blind_zone(&self) -> bool {
        self.params.sensor.mdv_m_s > 0.0
    }
}

/// Scans of all UAVs at one time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scans<'a> {
    pub(crate) sensor: &'a SensorParams,
    /// Errors of the UAVs' poses; `None` if they are exact.
    pub(crate) pose_error: Option<PoseError>,
    /// Reports by ascending UAV; each contains a scan.
    pub(crate) reports: &'a [Report],
    /// UAVs whose reports do not count; usually empty.
    pub(crate) implausible: &'a [UavId],
    /// UAVs whose detections start no tracks; usually empty.
    pub(crate) newcomers: &'a [UavId],
    /// Index of the reports' positions.
    pub(crate) places: &'a Grid,
}

impl<'a> Scans<'a> {
    /// Reports that count, with their indices.
    pub(super) fn plausible(&self) -> impl Iterator<Item = (usize, &'a Report)> + use<'a> {
        let scans = *self;
        self.reports.iter().enumerate().filter(move |(_, report)| scans.counts(report))
    }

    fn counts(&self, report: &Report) -> bool {
        self.implausible.is_empty() || !self.implausible.contains(&report.uav)
    }

    /// True if the detections of a UAV start tracks.
    pub(super) fn starts_tracks(&self, uav: UavId) -> bool {
        self.newcomers.is_empty() || !self.newcomers.contains(&uav)
    }

    /// UAV that made a detection.
    pub(super) fn uav(&self, index: DetectionIndex) -> UavId {
        self.reports[index.report].uav
    }

    /// Track that a detection with label belongs to; `None` without label.
    pub(crate) fn track_id(&self, index: DetectionIndex) -> Option<TrackId> {
        self.detection(index).label.map(TrackId::from)
    }

    fn detection(&self, index: DetectionIndex) -> &'a Detection {
        &self.reports[index.report].detections[index.detection]
    }

    /// True if a sensor reported detections without label.
    pub(crate) fn have_unlabelled(&self) -> bool {
        self.plausible().any(|(_, report)| report.detections.last().is_some_and(|last| last.label.is_none()))
    }

    /// Scans with their detections without label, in the order of the UAVs.
    pub(crate) fn unlabelled(&self) -> impl Iterator<Item = (UavId, ScanModel<'a>, &'a [Detection])> {
        let Self { sensor, pose_error, .. } = *self;
        self.plausible().filter_map(move |(_, report)| {
            let model = ScanModel::new(sensor, pose_error, report)?;
            Some((report.uav, model, Detection::split(&report.detections).1))
        })
    }

    /// Measurement of a detection, and the position of the UAV that made it.
    pub(crate) fn measurement(&self, index: DetectionIndex) -> (Position, RangeBearingMeasurement) {
        (self.reports[index.report].state.position, self.detection(index).measurement)
    }

    /// A detection with range rate, and the sensor model of its scan.
    pub(crate) fn with_range_rate(&self, index: DetectionIndex) -> Option<(ScanModel<'a>, &'a Detection)> {
        let detection = self.detection(index);
        detection.range_rate_m_s?;
        Some((ScanModel::new(self.sensor, self.pose_error, &self.reports[index.report])?, detection))
    }

    /// True if a UAV is within the team's area around the position, or if no UAV has reported.
    pub(crate) fn reach(&self, position: Position) -> bool {
        let mut distances_m = self.plausible().map(|(_, report)| report.state.position.distance_m(position)).peekable();
        distances_m.peek().is_none() || distances_m.any(|distance_m| distance_m <= TEAM_AREA_M)
    }

    /// True if a sensor had the position in view, with a clearance to the edge of its field of view, m.
    pub(crate) fn have_in_view(&self, position: Position, clearance_m: f64) -> bool {
        let near = self.places.near(position, self.sensor.sensing_range_m).map(|index| &self.reports[index]);
        near.filter(|report| self.counts(report)).any(|report| {
            report.boresight.is_some_and(|boresight| {
                self.sensor.in_view_with_clearance(report.state.position, boresight, position, clearance_m)
            })
        })
    }
}

/// Place of a detection: the index of its report in [`Scans::reports`], and its own index in the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DetectionIndex {
    pub(super) report: usize,
    pub(super) detection: usize,
}
