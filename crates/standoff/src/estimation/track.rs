//! The life of a track: cued, held, coasting, lost.
//!
//! A track starts from a cue, or from a first measurement; it is held while some UAV measures it and coasts on the
//! target model when none does. It is lost when it has grown too wide to be found, or when it stays unseen where it
//! should be in plain view. A lost track is frozen until a measurement or a cue starts it again.

use crate::covariance::Covariance;
use crate::estimation::information_filter::{Contribution, Estimate, InformationFilter, is_well_posed};
use crate::frame::{Position, Velocity};
use crate::message::{Cue, TargetLabel};
use crate::param::{Allowed, ParamError, errors_of};
use crate::sensor::{RangeBearing, SensorParams};
use crate::target::{TargetParams, TargetState, Transition};
use crate::time::{Duration, Time};

/// Parameters of the tracks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackParams {
    /// The target model that the filter assumes.
    pub target: TargetParams,
    /// The sensor that the filter assumes.
    pub sensor: SensorParams,
    /// A track whose position is less certain than this (standard deviation in its worst direction, m) is lost; above 0,
    /// at most 10,000: beyond, covariances do not fit into numbers beside the errors of a good sensor.
    pub lost_position_sd_m: f64,
    /// A track unseen for this long where it should be in view is lost, s; above 0, at most 1,000,000.
    pub lost_in_view_s: f64,
    /// Standard deviation per axis of the velocity of a track that starts from a measurement, m/s; 0.001 to 1,000.
    pub start_velocity_sd_m_s: f64,
    /// A lost track is forgotten after this time, s; above 0, at most 1,000,000.
    pub forget_lost_s: f64,
}

impl TrackParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = errors_of([("target", self.target.errors()), ("sensor", self.sensor.errors())]);
        Allowed::above(0.0).at_most(1e4).check("lost_position_sd_m", self.lost_position_sd_m, &mut errors);
        Allowed::above(0.0).at_most(1e6).check("lost_in_view_s", self.lost_in_view_s, &mut errors);
        Allowed::at_least(1e-3).at_most(1e3).check("start_velocity_sd_m_s", self.start_velocity_sd_m_s, &mut errors);
        Allowed::above(0.0).at_most(1e6).check("forget_lost_s", self.forget_lost_s, &mut errors);
        errors
    }

    /// The target model over a time step, as the tracks take it.
    ///
    /// A target that the model says never accelerates may do so after all, by micrometres per second squared: else what
    /// is left of a track's acceleration would decay until numbers hold it no longer.
    pub fn transition(&self, dt: Duration) -> Transition {
        TargetParams { acceleration_sd_m_s2: self.start_acceleration_sd_m_s2(), ..self.target }.transition(dt)
    }

    /// Standard deviation of the acceleration, of which nothing is known at first but the model.
    fn start_acceleration_sd_m_s2(&self) -> f64 {
        self.target.acceleration_sd_m_s2.max(1e-6)
    }
}

/// Where a track is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum TrackStatus {
    /// Handed over, not measured yet.
    Cued,
    /// Measured at this instant.
    Held,
    /// Measured before, not at this instant.
    Coasting,
    /// Given up.
    Lost(LossReason),
}

/// Why a track was given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LossReason {
    /// Its position became too uncertain.
    Widened,
    /// It stayed unseen where it should have been in plain view.
    Vanished,
    /// Its numbers broke down (overflow).
    Diverged,
}

/// The team's own name for a track. What a sensor calls the target is the track's [`label`](Track::label); with labels, ids
/// follow them, so that all who hear the same give the same ids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct TrackId(pub u32);

impl TrackId {
    /// The track of a labelled target.
    pub fn of(label: TargetLabel) -> Self {
        Self(label.0)
    }
}

/// A target as the team knows it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Track {
    /// Which track.
    pub id: TrackId,
    /// What sensors call the target.
    pub label: TargetLabel,
    /// Where it is in its life.
    pub status: TrackStatus,
    filter: InformationFilter,
    /// How long it has been unseen where it should have been in view.
    missed: Duration,
    /// How long it has been lost.
    lost_for: Duration,
}

impl Track {
    /// Its numbers are such as a filter keeps, and it is the track of its label.
    pub(crate) fn is_sound(&self) -> bool {
        let [missed, lost_for] = [self.missed, self.lost_for].map(|time| time >= Duration::ZERO);
        self.filter.is_sound() && self.id == TrackId::of(self.label) && missed && lost_for
    }

    /// Starts a track from a cue, predicted to `now`; `None` if the cue makes no sense.
    pub fn from_cue(cue: &Cue, params: &TrackParams, now: Time) -> Option<Self> {
        if !cue.is_sound() || cue.time > now {
            return None;
        }
        let position_variance = cue.position_sd_m * cue.position_sd_m;
        let velocity_variance = cue.velocity_sd_m_s * cue.velocity_sd_m_s;
        let mut filter = start_filter(cue.position, cue.velocity, position_variance, velocity_variance, params)?;
        if cue.time < now {
            filter.predict(&params.transition(now - cue.time));
        }
        filter.is_sound().then_some(Self::start(cue.label, TrackStatus::Cued, filter))
    }

    /// Starts a track from measurements of one instant, each with the position of the UAV that made it: from the first,
    /// then updated with the others. `None` for none, or for one so much sharper along than across that numbers do not
    /// hold both.
    pub fn from_measurements(
        label: TargetLabel,
        measurements: impl IntoIterator<Item = (Position, RangeBearing)>,
        params: &TrackParams,
    ) -> Option<Self> {
        let mut measurements = measurements.into_iter();
        let (uav, first) = measurements.next()?;
        let (position, covariance) = params.sensor.converted(uav, &first);
        let velocity_variance = params.start_velocity_sd_m_s * params.start_velocity_sd_m_s;
        let start = start_filter(position, Velocity::ZERO, 1.0, velocity_variance, params)?;
        let mut estimate = *start.estimate();
        estimate.covariance = estimate.covariance.with_position(&covariance);
        let mut filter = InformationFilter::new(estimate).filter(|_| is_well_posed(&estimate.covariance.matrix()))?;
        let mut sum = Contribution::default();
        for (uav, z) in measurements {
            sum += Contribution::of_measurement(&params.sensor, uav, &z, position);
        }
        filter.update(&sum);
        filter.is_sound().then_some(Self::start(label, TrackStatus::Held, filter))
    }

    fn start(label: TargetLabel, status: TrackStatus, filter: InformationFilter) -> Self {
        Self { id: TrackId::of(label), label, status, filter, missed: Duration::ZERO, lost_for: Duration::ZERO }
    }

    /// Carries the track on over a time step, without a measurement. A lost track stays as it is.
    #[inline]
    pub fn predict(&mut self, transition: &Transition) {
        if self.is_lost() {
            self.lost_for = self.lost_for + transition.dt;
        } else {
            self.filter.predict(transition);
        }
    }

    /// Takes in what all measurements of the instant say together, linearised about the predicted position; `None`: there
    /// is none, so it coasts. `before` is the track before [`Self::predict`], `dt` the time since then.
    ///
    /// `should_be_seen` judges from the predicted position and its uncertainty (m) whether some sensor had it in plain
    /// view. A lost track stays as it is: [`Self::from_measurements`] starts it again.
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
            self.filter.update(measured);
            (self.status, self.missed) = (TrackStatus::Held, Duration::ZERO);
        } else {
            self.coast(dt, should_be_seen, params);
        }
        if !self.filter.is_sound() {
            (self.filter, self.status) = (before.filter, TrackStatus::Lost(LossReason::Diverged));
        }
    }

    fn coast(&mut self, dt: Duration, should_be_seen: impl Fn(Position, f64) -> bool, params: &TrackParams) {
        let sd_m = self.estimate().position_sd_max_m();
        // One standard deviation of clearance: the orbit leaves room for that much about its furthest member.
        if should_be_seen(self.estimate().state.position(), sd_m) {
            self.missed = self.missed + dt;
        }
        self.status = match self.status {
            _ if sd_m > params.lost_position_sd_m => TrackStatus::Lost(LossReason::Widened),
            _ if self.missed.s() >= params.lost_in_view_s => TrackStatus::Lost(LossReason::Vanished),
            TrackStatus::Cued => TrackStatus::Cued,
            _ => TrackStatus::Coasting,
        };
    }

    #[cfg(test)]
    pub(crate) fn give_up(&mut self) {
        self.status = TrackStatus::Lost(LossReason::Vanished);
    }

    /// The track has been given up.
    pub fn is_lost(&self) -> bool {
        matches!(self.status, TrackStatus::Lost(_))
    }

    /// For how long it has been lost; zero while it is not.
    pub fn lost_for(&self) -> Duration {
        self.lost_for
    }

    /// Mean and covariance (of a lost track: the last ones).
    pub fn estimate(&self) -> &Estimate {
        self.filter.estimate()
    }
}

fn start_filter(
    position: Position,
    velocity: Velocity,
    position_variance: f64,
    velocity_variance: f64,
    params: &TrackParams,
) -> Option<InformationFilter> {
    let sd = params.start_acceleration_sd_m_s2();
    let axis = [position_variance, velocity_variance, sd * sd];
    InformationFilter::new(Estimate {
        state: TargetState::new(position, velocity, [0.0, 0.0]),
        covariance: Covariance::from_diagonal(core::array::from_fn(|i| axis[i % 3])),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::measure;

    fn params() -> TrackParams {
        TrackParams {
            target: TargetParams { correlation_rate_1_s: 0.3, acceleration_sd_m_s2: 0.75 },
            sensor: SensorParams {
                range_sd_m: 10.0,
                bearing_sd_rad: 3f64.to_radians(),
                field_of_view_rad: 70f64.to_radians(),
                sensing_range_m: 1200.0,
            },
            lost_position_sd_m: 150.0,
            lost_in_view_s: 5.0,
            start_velocity_sd_m_s: 10.0,
            forget_lost_s: 600.0,
        }
    }

    fn cue() -> Cue {
        Cue {
            searcher: 0,
            said: Time::START,
            number: 0,
            label: TargetLabel(7),
            time: Time::START,
            position: Position::from_m(100.0, 50.0),
            velocity: Velocity::from_m_s(10.0, 0.0),
            position_sd_m: 20.0,
            velocity_sd_m_s: 3.0,
        }
    }

    fn look(truth: Position) -> (Position, RangeBearing) {
        let uav = Position::from_m(-200.0, -100.0);
        (uav, measure(uav, truth))
    }

    fn advanced(track: &Track, looks: &[(Position, RangeBearing)], should_be_seen: bool) -> Track {
        let (mut advanced, params) = (*track, params());
        advanced.predict(&transition());
        let predicted = advanced.estimate().state.position();
        let of = |(uav, z): &(Position, RangeBearing)| Contribution::of_measurement(&params.sensor, *uav, z, predicted);
        let sum = looks.iter().map(of).reduce(|mut sum, contribution| {
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
    fn a_track_is_cued_then_held_then_coasts() {
        let cued = Track::from_cue(&cue(), &params(), Time::START).unwrap();
        assert_eq!(cued.status, TrackStatus::Cued);
        let unseen = advanced(&cued, &[], false);
        assert_eq!(unseen.status, TrackStatus::Cued);
        let held = advanced(&unseen, &[look(Position::from_m(110.0, 50.0))], true);
        assert_eq!(held.status, TrackStatus::Held);
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
        assert!(Track::from_cue(&broken, &params(), Time::START).is_none());
    }

    #[test]
    fn out_of_view_a_track_widens_until_it_is_lost_and_a_look_starts_it_again() {
        let mut track = Track::from_cue(&cue(), &params(), Time::START).unwrap();
        let mut coasted_s = 0.0;
        while !track.is_lost() {
            track = advanced(&track, &[], false);
            coasted_s += 0.5;
            assert!(coasted_s < 120.0, "it must be lost one day");
        }
        assert_eq!(track.status, TrackStatus::Lost(LossReason::Widened));
        assert!(coasted_s > 15.0, "lost after {coasted_s} s");
        assert_eq!(track.lost_for(), Duration::ZERO);
        let frozen = advanced(&track, &[], false);
        assert_eq!((frozen.estimate(), frozen.status), (track.estimate(), track.status));
        assert_eq!(frozen.lost_for(), transition().dt);
        let truth = Position::from_m(500.0, 500.0);
        let again = Track::from_measurements(track.label, [look(truth), look(truth)], &params()).unwrap();
        assert_eq!(again.status, TrackStatus::Held);
        assert!(again.estimate().state.position().distance_m(truth) < 1.0);
    }

    #[test]
    fn unseen_in_plain_view_a_track_is_soon_lost() {
        let held = Track::from_measurements(TargetLabel(7), [look(Position::from_m(110.0, 50.0))], &params()).unwrap();
        let mut track = held;
        for step in 1..=10 {
            assert!(!track.is_lost(), "step {step}");
            track = advanced(&track, &[], true);
        }
        assert_eq!(track.status, TrackStatus::Lost(LossReason::Vanished));
    }
}
