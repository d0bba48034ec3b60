//! Deletion of tracks: a target is lost when its position becomes too uncertain, when it stays unseen although it should
//! be well in view, or when its track is wrong.

use crate::frame::Position;
use crate::message::WRONG_MAX_S;
use crate::params::TrackParams;
use crate::sensor::RangeBearingMeasurement;
use crate::time::Duration;
use crate::tracking::estimate::Estimate;
use crate::tracking::track::{LossReason, Track, TrackChangeKind, TrackStatus};

/// Probability of existence at which a confirmed track is lost.
pub(super) const LOST: f64 = 0.3;

/// Time after which a track that is missed in view is lost, s. Only a stopped target can be missed for so long.
const MISSED_MAX_S: f64 = 90.0;

impl Track {
    /// Coasts through a time step without measurements.
    pub(super) fn coast(&mut self, dt: Duration, should_be_seen: impl Fn(Position, f64) -> bool, params: &TrackParams) {
        let sd_m = self.estimate().position_sd_max_m();
        // Clearance of one standard deviation: the margin of the orbit around its furthest member.
        if should_be_seen(self.estimate().state.position(), sd_m) {
            self.missed = self.missed + dt;
        }
        self.status = match self.status {
            _ if sd_m > params.deletion_position_sd_m => TrackStatus::Lost(LossReason::TooUncertain),
            _ if self.missed.s() >= params.deletion_unseen_in_view_s => TrackStatus::Lost(LossReason::UnseenInView),
            TrackStatus::Cued => TrackStatus::Cued,
            _ => TrackStatus::Coasting,
        };
    }

    /// Coasts through a time step in which all measurements of the target were beyond the gate. They do not show that the
    /// target has gone. If this continues for [`WRONG_MAX_S`], the track is wrong and restarts from them.
    #[cold]
    pub(crate) fn doubt(
        &mut self,
        dt: Duration,
        measurements: impl IntoIterator<Item = (Position, RangeBearingMeasurement)>,
        params: &TrackParams,
    ) {
        let missed = self.missed + dt;
        let restarted = Self::from_measurements(self.id, measurements, params).filter(|_| missed.s() > WRONG_MAX_S);
        match restarted {
            Some(restarted) => *self = restarted,
            None => (self.missed, self.status) = (missed, TrackStatus::Coasting),
        }
        if self.estimate().position_sd_max_m() > params.deletion_position_sd_m {
            self.status = TrackStatus::Lost(LossReason::TooUncertain);
        }
    }

    /// Takes over the estimate of a time step in which it was detected with the probability `detected`, or missed in
    /// view for `missed`. Returns the change of its life cycle.
    pub(crate) fn conclude(
        &mut self,
        estimate: &Estimate,
        detected: f64,
        missed: Duration,
        existence: f64,
        params: &TrackParams,
    ) -> Option<TrackChangeKind> {
        let before = self.status;
        self.missed = if detected > 0.5 { Duration::ZERO } else { self.missed + missed };
        match estimate.checked() {
            Some(estimate) => self.estimate = estimate,
            None => self.status = TrackStatus::Lost(LossReason::Diverged),
        }
        self.status = match self.status {
            TrackStatus::Lost(reason) => TrackStatus::Lost(reason),
            _ if existence < LOST || self.missed.s() > MISSED_MAX_S => TrackStatus::Lost(LossReason::UnseenInView),
            _ if detected > 0.5 => TrackStatus::Updated,
            _ if estimate.position_sd_max_m() > params.deletion_position_sd_m => {
                TrackStatus::Lost(LossReason::TooUncertain)
            }
            TrackStatus::Cued => TrackStatus::Cued,
            _ => TrackStatus::Coasting,
        };
        match (before, self.status) {
            (_, TrackStatus::Lost(reason)) => Some(TrackChangeKind::Lost(reason)),
            (TrackStatus::Cued, TrackStatus::Updated) => Some(TrackChangeKind::Confirmed),
            _ => None,
        }
    }
}
