//! Life cycle of a track: cued, updated, coasting, lost.
//!
//! A track starts from a cue or from a first measurement. While a UAV measures the target, the track is updated;
//! otherwise it coasts on the target model. It is lost when its position becomes too uncertain, or when the target
//! stays unseen although it should be well in view. A lost track is frozen until a measurement or a cue restarts it.

use nalgebra::Matrix2;

use crate::covariance::Covariance;
use crate::frame::{Position, Velocity};
use crate::message::{Cue, TargetLabel};
use crate::params::{SensorParams, TargetParams, TrackParams};
use crate::sensor::RangeBearingMeasurement;
use crate::target::{TargetState, Transition};
use crate::time::{Duration, Time};
use crate::tracking::estimate::{Estimate, is_well_posed};
use crate::tracking::information_filter::Contribution;
use crate::tracking::near_update::NearMeasurement;

impl TrackParams {
    /// Discretises the target model of the tracks for a time step of `dt`.
    ///
    /// The acceleration standard deviation is at least 1e-6 m/s2, even for a target that never accelerates. Otherwise
    /// the acceleration variance would decay until it underflows.
    pub fn transition(&self, dt: Duration) -> Transition {
        TargetParams { acceleration_sd_m_s2: self.start_acceleration_sd_m_s2(), ..self.target }.transition(dt)
    }

    /// Initial standard deviation of the acceleration, m/s2, from the target model.
    fn start_acceleration_sd_m_s2(&self) -> f64 {
        self.target.acceleration_sd_m_s2.max(1e-6)
    }
}

/// State of a track in its life cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TrackStatus {
    /// Started from a cue, not measured yet.
    Cued,
    /// Measured in this time step.
    Updated,
    /// Measured before, but not in this time step.
    Coasting,
    /// No longer predicted, for this reason.
    Lost(LossReason),
}

/// Reason why a track was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum LossReason {
    /// The position became too uncertain.
    TooUncertain,
    /// The target stayed unseen although it should have been well in view.
    UnseenInView,
    /// The filter diverged numerically (overflow).
    Diverged,
}

/// Id of a track in the team. All agents with the same messages assign the same ids: a track that starts from a
/// detection or cue with a label has the number of the label; the id of any other track is made from the bits of the
/// detection or cue that started it, and is at least 2^63.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct TrackId(pub u64);

impl From<TargetLabel> for TrackId {
    fn from(label: TargetLabel) -> Self {
        Self(label.0.into())
    }
}

impl TrackId {
    /// Id of a track that these values started, which have no label. It does not depend on other tracks: a late message
    /// must not rename them.
    pub(crate) fn minted(values: impl IntoIterator<Item = u64>) -> Self {
        let mix = |hash: u64, value: u64| {
            let mixed = (hash ^ value).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
            (mixed ^ mixed >> 32).rotate_left(17)
        };
        Self(values.into_iter().chain([0]).fold(0x9E37_79B9_7F4A_7C15, mix) | 1 << 63)
    }

    /// Id of a track that a cue starts.
    pub(crate) fn of_cue(cue: &Cue) -> Self {
        let Cue { position, velocity, .. } = cue;
        let numbers = [position.x_m(), position.y_m(), velocity.x_m_s(), velocity.y_m_s()].map(f64::to_bits);
        let of_cue = [cue.time.us().cast_unsigned(), cue.source.into(), cue.sequence.into()];
        cue.label.map_or_else(|| Self::minted(of_cue.into_iter().chain(numbers)), Self::from)
    }

    /// Label of the target, if the track was started by a detection or cue with a label.
    pub fn label(self) -> Option<TargetLabel> {
        u32::try_from(self.0).ok().map(TargetLabel)
    }
}

/// Change in the life cycle of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrackChange {
    pub(crate) track: TrackId,
    pub(crate) kind: TrackChangeKind,
}

/// Kind of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TrackChangeKind {
    /// Started from a cue.
    Cued,
    /// Started from measurements, without a cue.
    Started,
    /// Measured for the first time after a cue.
    Confirmed,
    /// Lost.
    Lost(LossReason),
    /// Measured again after it was lost.
    Reacquired,
}

/// What a time step has changed.
#[derive(Debug, Clone, Default)]
pub(crate) struct StepLog {
    /// Changes in the life cycles of tracks.
    pub(crate) changes: Vec<TrackChange>,
    /// Number of tracks that did not start because there were too many, and of detections and pairs beyond a maximum.
    pub(crate) rejected: u32,
}

impl StepLog {
    pub(crate) fn clear(&mut self) {
        self.changes.clear();
        self.rejected = 0;
    }

    pub(crate) fn add(&mut self, track: TrackId, kind: TrackChangeKind) {
        self.changes.push(TrackChange { track, kind });
    }

    /// True if a track has been started in this time step.
    pub(crate) fn has_started(&self, track: TrackId) -> bool {
        self.changes.iter().any(|change| change.track == track)
    }
}

/// The team's estimate of a target.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Track {
    /// Id of the track.
    pub id: TrackId,
    /// Label in the id, or 0.
    label: TargetLabel,
    /// State in the life cycle.
    pub status: TrackStatus,
    pub(super) estimate: Estimate,
    /// Accumulated time without measurements although the target should have been in view.
    pub(super) missed: Duration,
    /// Time since the track was lost.
    time_since_lost: Duration,
}

impl Track {
    /// Returns true if the filter is valid, the id matches the label and the durations are not negative.
    pub(crate) fn is_valid(&self) -> bool {
        let [missed, time_since_lost] = [self.missed, self.time_since_lost].map(|time| time >= Duration::ZERO);
        self.estimate.is_valid() && self.label == label_in(self.id) && missed && time_since_lost
    }

    /// Identity of the target as reported by the sensors; `None` if the detection or cue that started the track had none.
    pub fn label(&self) -> Option<TargetLabel> {
        self.id.label()
    }

    /// Starts a track from a cue, predicted to `now`; `None` if the cue is invalid or later than `now`.
    pub fn from_cue(cue: &Cue, params: &TrackParams, now: Time) -> Option<Self> {
        if !cue.is_valid() || cue.time > now {
            return None;
        }
        let position_variance = cue.position_sd_m * cue.position_sd_m;
        let velocity_variance = cue.velocity_sd_m_s * cue.velocity_sd_m_s;
        let mut estimate = start_estimate(cue.position, cue.velocity, position_variance, velocity_variance, params)?;
        if cue.time < now {
            estimate.predict(&params.transition(now - cue.time));
        }
        estimate.is_valid().then_some(Self::start(TrackId::of_cue(cue), TrackStatus::Cued, estimate))
    }

    /// Starts a track from the measurements of one time step, each with the position of its UAV. The first measurement
    /// initialises the track, the others update it. `None` if there is no measurement, or if the first is so much more
    /// precise in one direction than in the other that its covariance is numerically singular.
    pub fn from_measurements(
        id: TrackId,
        measurements: impl IntoIterator<Item = (Position, RangeBearingMeasurement)>,
        params: &TrackParams,
    ) -> Option<Self> {
        let mut measurements = measurements.into_iter();
        let (uav, first) = measurements.next()?;
        let (position, covariance) = params.sensor.to_cartesian(uav, &first);
        let velocity_variance = params.initial_velocity_sd_m_s * params.initial_velocity_sd_m_s;
        let mut estimate = start_estimate(position, Velocity::ZERO, 1.0, velocity_variance, params)?;
        estimate.covariance = estimate.covariance.with_position(&covariance);
        let mut estimate = estimate.checked().filter(|estimate| is_well_posed(&estimate.covariance.matrix()))?;
        let (mut sum, mut near) = (Contribution::default(), Vec::new());
        for (uav, measurement) in measurements {
            if params.sensor.is_nonlinear(uav, position, || covariance.trace()) {
                let SensorParams { own_position_sd_m, own_heading_sd_rad, .. } = params.sensor;
                let position = Matrix2::from_diagonal_element(own_position_sd_m * own_position_sd_m);
                let of_pose = (position, own_heading_sd_rad * own_heading_sd_rad);
                near.push(NearMeasurement::new(&params.sensor, uav, measurement, of_pose));
            } else {
                sum += Contribution::from_measurement(&params.sensor, uav, &measurement, position);
            }
        }
        estimate.update(&sum);
        if !near.is_empty() {
            near.iter().for_each(|near| near.apply(&mut estimate));
            estimate = estimate.checked()?;
        }
        estimate.is_valid().then_some(Self::start(id, TrackStatus::Updated, estimate))
    }

    fn start(id: TrackId, status: TrackStatus, estimate: Estimate) -> Self {
        Self { id, label: label_in(id), status, estimate, missed: Duration::ZERO, time_since_lost: Duration::ZERO }
    }

    /// Track with this estimate, updated in this time step; `None` if the covariance is not positive definite.
    pub(crate) fn from_estimate(id: TrackId, estimate: Estimate) -> Option<Self> {
        Some(Self::start(id, TrackStatus::Updated, estimate.checked()?))
    }

    /// Replaces the estimate, unless the track is lost or the covariance is not positive definite.
    pub(crate) fn refine(&mut self, estimate: &Estimate) {
        if let Some(estimate) = estimate.checked().filter(|_| !self.is_lost()) {
            self.estimate = estimate;
        }
    }

    /// Predicts the track over a time step. A lost track does not change.
    #[inline]
    pub fn predict(&mut self, transition: &Transition) {
        if self.is_lost() {
            self.time_since_lost = self.time_since_lost + transition.dt;
        } else {
            self.estimate.predict(transition);
        }
    }

    /// Updates the track with the summed contributions of all measurements of the time step, linearised at the
    /// predicted position. If `measured` is `None`, the track coasts. `before` is the track before [`Self::predict`],
    /// `dt` the time since then.
    ///
    /// `should_be_seen` decides from the predicted position and its uncertainty (m) whether a sensor had the target
    /// well in view. A lost track does not change; [`Self::from_measurements`] restarts it.
    #[inline]
    pub fn update(
        &mut self,
        before: &Self,
        measured: Option<&Contribution>,
        dt: Duration,
        should_be_seen: impl Fn(Position, f64) -> bool,
        params: &TrackParams,
    ) {
        if self.is_lost() {
            return;
        }
        if let Some(measured) = measured {
            self.estimate.update(measured);
            (self.status, self.missed) = (TrackStatus::Updated, Duration::ZERO);
        } else {
            self.coast(dt, should_be_seen, params);
        }
        if !self.estimate.is_valid() {
            (self.estimate, self.status) = (before.estimate, TrackStatus::Lost(LossReason::Diverged));
        }
    }

    #[cfg(test)]
    pub(crate) fn give_up(&mut self) {
        self.status = TrackStatus::Lost(LossReason::UnseenInView);
    }

    /// Returns true if the track is lost.
    pub fn is_lost(&self) -> bool {
        matches!(self.status, TrackStatus::Lost(_))
    }

    /// Time since the track was lost; zero while it is not lost.
    pub(crate) fn time_since_lost(&self) -> Duration {
        self.time_since_lost
    }

    /// Mean and covariance; the last ones if the track is lost.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }
}

/// Label in an id, or 0.
fn label_in(id: TrackId) -> TargetLabel {
    id.label().unwrap_or(TargetLabel(0))
}

fn start_estimate(
    position: Position,
    velocity: Velocity,
    position_variance: f64,
    velocity_variance: f64,
    params: &TrackParams,
) -> Option<Estimate> {
    let sd = params.start_acceleration_sd_m_s2();
    let axis = [position_variance, velocity_variance, sd * sd];
    let state = TargetState::new(position, velocity, [0.0, 0.0]);
    Estimate { state, covariance: Covariance::from_diagonal(core::array::from_fn(|i| axis[i % 3])) }.checked()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::TeamParams;
    use crate::sensor::measure;

    fn params() -> TrackParams {
        TrackParams {
            target: TargetParams { correlation_rate_1_s: 0.3, acceleration_sd_m_s2: 0.75 },
            deletion_position_sd_m: 150.0,
            ..TeamParams::paper().track
        }
    }

    fn cue() -> Cue {
        let (velocity, velocity_sd_m_s) = (Velocity::from_m_s(10.0, 0.0), 3.0);
        Cue { velocity, velocity_sd_m_s, ..Cue::at(7, Position::from_m(100.0, 50.0)) }
    }

    fn measurement(truth: Position) -> (Position, RangeBearingMeasurement) {
        let uav = Position::from_m(-200.0, -100.0);
        (uav, measure(uav, truth))
    }

    fn advanced(track: &Track, measurements: &[(Position, RangeBearingMeasurement)], should_be_seen: bool) -> Track {
        let (mut advanced, params) = (*track, params());
        advanced.predict(&transition());
        let predicted = advanced.estimate().state.position();
        let of = |(uav, z): &(Position, RangeBearingMeasurement)| {
            Contribution::from_measurement(&params.sensor, *uav, z, predicted)
        };
        let sum = measurements.iter().map(of).reduce(|mut sum, contribution| {
            sum += contribution;
            sum
        });
        advanced.update(track, sum.as_ref(), transition().dt, |_, _| should_be_seen, &params);
        advanced
    }

    fn transition() -> Transition {
        params().target.transition(Duration::from_s(0.5))
    }

    #[test]
    fn a_track_is_cued_then_updated_then_coasts() {
        let cued = Track::from_cue(&cue(), &params(), Time::EPOCH).unwrap();
        assert_eq!(cued.status, TrackStatus::Cued);
        let unseen = advanced(&cued, &[], false);
        assert_eq!(unseen.status, TrackStatus::Cued);
        let held = advanced(&unseen, &[measurement(Position::from_m(110.0, 50.0))], true);
        assert_eq!(held.status, TrackStatus::Updated);
        assert!(held.estimate().position_sd_max_m() < unseen.estimate().position_sd_max_m());
        let coasting = advanced(&held, &[], false);
        assert_eq!(coasting.status, TrackStatus::Coasting);
        assert!(coasting.estimate().position_sd_max_m() > held.estimate().position_sd_max_m());
    }

    #[test]
    fn a_cue_is_predicted_from_its_time_to_now() {
        let track = Track::from_cue(&cue(), &params(), Time::from_us(2_000_000)).unwrap();
        assert!(track.estimate().state.position().distance_m(Position::from_m(120.0, 50.0)) < 1e-9);
        assert!(Track::from_cue(&cue(), &params(), Time::from_us(-1)).is_none());
        let broken = Cue { position_sd_m: f64::NAN, ..cue() };
        assert!(Track::from_cue(&broken, &params(), Time::EPOCH).is_none());
    }

    #[test]
    fn an_unmeasured_track_is_lost_when_too_uncertain_and_restarted_by_a_measurement() {
        let mut track = Track::from_cue(&cue(), &params(), Time::EPOCH).unwrap();
        let mut coasted_s = 0.0;
        while !track.is_lost() {
            track = advanced(&track, &[], false);
            coasted_s += 0.5;
            assert!(coasted_s < 120.0, "not lost after {coasted_s} s");
        }
        assert_eq!(track.status, TrackStatus::Lost(LossReason::TooUncertain));
        assert!(coasted_s > 15.0, "lost after {coasted_s} s");
        assert_eq!(track.time_since_lost(), Duration::ZERO);
        let frozen = advanced(&track, &[], false);
        assert_eq!((frozen.estimate(), frozen.status), (track.estimate(), track.status));
        assert_eq!(frozen.time_since_lost(), transition().dt);
        let truth = Position::from_m(500.0, 500.0);
        let again = Track::from_measurements(track.id, [measurement(truth), measurement(truth)], &params()).unwrap();
        assert_eq!(again.status, TrackStatus::Updated);
        assert!(again.estimate().state.position().distance_m(truth) < 1.0);
    }

    #[test]
    fn a_track_unseen_while_well_in_view_is_soon_lost() {
        let held =
            Track::from_measurements(TrackId(7), [measurement(Position::from_m(110.0, 50.0))], &params()).unwrap();
        let mut track = held;
        for step in 1..=10 {
            assert!(!track.is_lost(), "step {step}");
            track = advanced(&track, &[], true);
        }
        assert_eq!(track.status, TrackStatus::Lost(LossReason::UnseenInView));
    }

    #[test]
    fn a_track_resists_measurements_beyond_the_gate_for_six_seconds() {
        let params = crate::TeamParams::paper().track;
        let measured = |range_m| [(Position::ORIGIN, RangeBearingMeasurement { range_m, bearing: crate::Angle::ZERO })];
        let mut track = Track::from_measurements(TrackId(1), measured(400.0), &params).unwrap();
        let mut doubt = |after: &str| {
            track.doubt(Duration::from_s(0.5), measured(900.0), &params);
            let place_m = track.estimate().state.position().x_m().round();
            assert!(!track.is_lost(), "{after}");
            (place_m, track.status)
        };
        for step in 1..=12 {
            assert_eq!(doubt("before"), (400.0, TrackStatus::Coasting), "step {step}");
        }
        assert_eq!(doubt("after"), (900.0, TrackStatus::Updated));
    }
}
