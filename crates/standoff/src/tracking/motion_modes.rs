//! Motion models of one target: it follows the target model, manoeuvres, or has stopped.
//!
//! Braking and starting are no events of the target model of a gentle target, and a stopped target is in the blind zone
//! of the sensor. With the target model alone, a track would lose targets that do either.
//!
//! The probabilities of the models form a Markov chain. Between time steps, the estimates of the moving and of the
//! manoeuvring target are merged (generalised pseudo-Bayes of first order); that of the stopped one stays apart.

use nalgebra::Matrix2;

use crate::covariance::Covariance;
use crate::frame::{Position, Velocity};
use crate::math;
use crate::params::{TargetParams, TrackParams};
use crate::target::{TargetState, Transition};
use crate::time::Duration;
use crate::tracking::estimate::{Estimate, Mixture};

/// Number of models.
pub(crate) const MODES: usize = 3;

/// Indices of the models; 0 is the target model.
const MANOEUVRING: usize = 1;
const STOPPED: usize = 2;

/// Acceleration of a manoeuvre (braking, starting, turning), and the rate at which it changes, as multiples of those of
/// the target model.
const MANOEUVRE_FACTOR: f64 = 3.3;

/// Rate at which manoeuvres end, 1/s.
const MANOEUVRE_END_RATE_1_S: f64 = 0.5;

/// Time for which a manoeuvre may have been hidden when it is noticed, s: until then, the detections of a neighbour were
/// associated with the track.
const HIDDEN_S: f64 = 1.6;

/// Speed that a target can lose between two time steps, m/s: only slow targets stop.
const STOP_SPEED_M_S: f64 = 2.0;

/// Rate at which a stopped target starts to move, 1/s.
const START_RATE_1_S: f64 = 0.02;

/// Standard deviation of the velocity of a target that starts to move, per axis, m/s.
const START_SPEED_SD_M_S: f64 = 2.0;

/// Time for which a target that stops moves on with its velocity, s, on average and its standard deviation.
const BRAKING_S: [f64; 2] = [0.5, 0.5];

/// Standard deviation of the velocity of a stopped target, m/s, and of its acceleration, m/s2.
const STOPPED_SDS: [f64; 2] = [0.1, 0.02];

/// Growth of the position variance of a stopped target, m2/s.
const STOPPED_DRIFT_M2_S: f64 = 0.1;

/// Probability below which a model is dropped.
const NEGLIGIBLE: f64 = 1e-4;

/// Transitions of the moving models over a time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotionTransitions {
    moving: Transition,
    manoeuvring: Transition,
    /// Standard deviation of the acceleration of a manoeuvre, per axis, m/s2.
    acceleration_sd_m_s2: f64,
    /// Standard deviation of the displacement by a hidden manoeuvre, per axis, m.
    hidden_sd_m: f64,
    manoeuvre_rate_1_s: f64,
    stop_rate_1_s: f64,
}

impl MotionTransitions {
    /// Transitions over the time of `moving`, that of the target model.
    pub(crate) fn new(moving: &Transition, params: &TrackParams) -> Self {
        let model = &params.target;
        let manoeuvre = TargetParams {
            correlation_rate_1_s: MANOEUVRE_FACTOR * model.correlation_rate_1_s,
            acceleration_sd_m_s2: MANOEUVRE_FACTOR * model.acceleration_sd_m_s2,
        };
        let manoeuvring = manoeuvre.transition(moving.dt);
        Self {
            moving: *moving,
            manoeuvring,
            acceleration_sd_m_s2: manoeuvre.acceleration_sd_m_s2,
            hidden_sd_m: 0.5 * HIDDEN_S * HIDDEN_S * manoeuvre.acceleration_sd_m_s2,
            manoeuvre_rate_1_s: params.manoeuvre_rate_1_s,
            stop_rate_1_s: params.stop_rate_1_s,
        }
    }

    pub(crate) fn dt(&self) -> Duration {
        self.moving.dt
    }
}

/// Probability and estimate of a target under each model. A model with probability 0 is not possible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MotionModes([(f64, Estimate); MODES]);

/// What is kept between time steps, apart from the estimate over all models.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct StoredModes {
    /// Probability that a target that has not stopped manoeuvres.
    manoeuvring: f64,
    stopped: Option<StoredStop>,
}

/// Estimate of a target that may have stopped.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct StoredStop {
    probability: f64,
    /// Position, m, and its covariance, m2: xx, xy, yy.
    position: [f64; 2],
    covariance: [f64; 3],
    /// Estimate of the target if it has not stopped.
    moving: Estimate,
}

impl MotionModes {
    /// A target that follows the target model.
    pub(crate) fn moving(moving: Estimate) -> Self {
        Self([(1.0, moving), (0.0, moving), (0.0, moving)])
    }

    /// All models with their probabilities.
    pub(crate) fn all(&self) -> &[(f64, Estimate); MODES] {
        &self.0
    }

    /// Mean and covariance over all models.
    pub(crate) fn moments(&self) -> Estimate {
        merged(&self.0).1
    }

    /// Replaces each model by the moments of a mixture; the weights sum to any positive number.
    pub(crate) fn replace(&mut self, by: &[Mixture; MODES]) {
        for ((weight, estimate), mixture) in self.0.iter_mut().zip(by) {
            *weight = mixture.weight();
            *estimate = mixture.moments().unwrap_or(*estimate);
        }
        self.normalise();
    }

    /// Makes the probabilities sum to 1, without those of models that are hardly possible.
    fn normalise(&mut self) {
        for _ in 0..2 {
            let total: f64 = self.0.iter().map(|(weight, _)| weight).sum();
            for (weight, _) in &mut self.0 {
                *weight = if *weight > NEGLIGIBLE * total { *weight / total } else { 0.0 };
            }
        }
    }

    /// Predicts all models over a time step. A target that is not known well enough cannot stop.
    pub(crate) fn predict(&mut self, transitions: &MotionTransitions, can_stop: bool) {
        let dt_s = transitions.dt().s();
        let within = |rate_1_s: f64| 1.0 - math::exp(-rate_1_s * dt_s);
        let [(moves, _), (manoeuvres, _), (was_stopped, stopped)] = self.0;
        let (flowing, moving) = merged(&self.0[..STOPPED]);
        let stopping = if can_stop { within(transitions.stop_rate_1_s) * slowness(&moving) } else { 0.0 };
        let starting = within(START_RATE_1_S);
        let (begins, ends) = (within(transitions.manoeuvre_rate_1_s), within(MANOEUVRE_END_RATE_1_S));
        let to_moving = (moves * (1.0 - begins) + manoeuvres * ends) * (1.0 - stopping);

        let stops = stopped_from(&moving);
        let mut rests = Mixture::about(stops.state.0);
        rests.add(flowing * stopping, &stops);
        let mut starts = Mixture::about(moving.state.0);
        let manoeuvring = predicted(&moving, &transitions.manoeuvring);
        starts.add(moves * begins * (1.0 - stopping), &displaced(manoeuvring, transitions.hidden_sd_m));
        starts.add(manoeuvres * (1.0 - ends) * (1.0 - stopping), &manoeuvring);
        if was_stopped > 0.0 {
            starts.add(was_stopped * starting, &started_from(&stopped, transitions.acceleration_sd_m_s2));
            let mut stays = stopped;
            stays.covariance[(0, 0)] += STOPPED_DRIFT_M2_S * dt_s;
            stays.covariance[(3, 3)] += STOPPED_DRIFT_M2_S * dt_s;
            rests.add(was_stopped * (1.0 - starting), &stays);
        }
        self.0 = [
            (to_moving, predicted(&moving, &transitions.moving)),
            (starts.weight(), starts.moments().unwrap_or(moving)),
            (rests.weight(), rests.moments().unwrap_or(stops)),
        ];
        self.normalise();
    }

    /// What to keep of it; `None` if nothing.
    pub(crate) fn stored(&self) -> StoredModes {
        let (flowing, moving) = merged(&self.0[..STOPPED]);
        let (probability, stopped) = &self.0[STOPPED];
        let (at, covariance) = (stopped.state.position(), stopped.position_covariance());
        let stop = StoredStop {
            probability: *probability,
            position: [at.x_m(), at.y_m()],
            covariance: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
            moving,
        };
        StoredModes {
            manoeuvring: if flowing > 0.0 { self.0[MANOEUVRING].0 / flowing } else { 0.0 },
            stopped: (*probability > 0.0).then_some(stop),
        }
    }
}

impl StoredModes {
    /// Models of a track with an estimate over all of them.
    pub(crate) fn restored(&self, estimate: &Estimate) -> MotionModes {
        let Self { manoeuvring, stopped } = *self;
        let Some(StoredStop { probability, position, covariance: [xx, xy, yy], moving }) = stopped else {
            return MotionModes([(1.0 - manoeuvring, *estimate), (manoeuvring, *estimate), (0.0, *estimate)]);
        };
        let at = Position::from_m(position[0], position[1]);
        let flowing = 1.0 - probability;
        MotionModes([
            (flowing * (1.0 - manoeuvring), moving),
            (flowing * manoeuvring, moving),
            (probability, at_rest(at, &Matrix2::new(xx, xy, xy, yy))),
        ])
    }

    /// True if all numbers are possible.
    pub(crate) fn is_valid(&self) -> bool {
        let is_probability = |probability: f64| (0.0..=1.0).contains(&probability);
        let is_possible = |stop: StoredStop| {
            let [xx, xy, yy] = stop.covariance;
            let is_positive = xx > 0.0 && yy > 0.0 && xx * yy > xy * xy && (xx + yy).is_finite();
            let is_finite = stop.position.iter().all(|coordinate| coordinate.is_finite());
            is_probability(stop.probability) && is_positive && is_finite
        };
        is_probability(self.manoeuvring) && self.stopped.is_none_or(is_possible)
    }
}

/// Sum of the weights, mean and covariance over some models.
fn merged(modes: &[(f64, Estimate)]) -> (f64, Estimate) {
    let mut mixture = Mixture::about(modes[0].1.state.0);
    for (weight, estimate) in modes.iter().filter(|(weight, _)| *weight > 0.0) {
        mixture.add(*weight, estimate);
    }
    (mixture.weight(), mixture.moments().unwrap_or(modes[0].1))
}

/// 1 for a target that may be at rest, falling to 0 with the speed that it has for certain.
fn slowness(moving: &Estimate) -> f64 {
    let Estimate { state: TargetState(mean), covariance } = moving;
    let brakes = STOP_SPEED_M_S * STOP_SPEED_M_S;
    let [xx, yy] = [1, 4].map(|row| covariance[(row, row)] + brakes);
    let xy = covariance[(1, 4)];
    let [vx, vy] = [mean[1], mean[4]];
    let squared = (yy * vx * vx - 2.0 * xy * vx * vy + xx * vy * vy) / (xx * yy - xy * xy);
    math::exp(-0.5 * squared)
}

fn predicted(before: &Estimate, transition: &Transition) -> Estimate {
    let mut estimate = *before;
    estimate.predict(transition);
    estimate
}

/// Estimate of a target that may be displaced, with this standard deviation per axis, m.
fn displaced(mut estimate: Estimate, sd_m: f64) -> Estimate {
    estimate.covariance[(0, 0)] += sd_m * sd_m;
    estimate.covariance[(3, 3)] += sd_m * sd_m;
    estimate
}

/// Estimate of a stopped target at a position with this covariance, m2.
fn at_rest(position: Position, covariance: &Matrix2<f64>) -> Estimate {
    let [velocity, acceleration] = STOPPED_SDS.map(|sd| sd * sd);
    let variances = [0.0, velocity, acceleration, 0.0, velocity, acceleration];
    Estimate {
        state: TargetState::new(position, Velocity::ZERO, [0.0, 0.0]),
        covariance: Covariance::from_diagonal(variances).with_position(covariance),
    }
}

/// Where a target that moves now will have stopped.
fn stopped_from(moving: &Estimate) -> Estimate {
    let mut stopped = at_rest(moving.state.position(), &moving.position_covariance());
    let [after_s, sd_s] = BRAKING_S;
    let Estimate { state: TargetState(mean), covariance } = moving;
    for row in [0, 3] {
        stopped.state.0[row] += after_s * mean[row + 1];
    }
    for (row, column) in [(0, 0), (0, 3), (3, 3)] {
        let of_time = sd_s * sd_s * mean[row + 1] * mean[column + 1];
        let of_velocity = after_s * after_s * covariance[(row + 1, column + 1)];
        let of_both = after_s * (covariance[(row, column + 1)] + covariance[(row + 1, column)]);
        stopped.covariance[(row, column)] += of_time + of_velocity + of_both;
    }
    stopped
}

/// Estimate of a target that starts to move.
fn started_from(stopped: &Estimate, acceleration_sd_m_s2: f64) -> Estimate {
    let mut moving = *stopped;
    for axis in [0, 3] {
        moving.covariance[(axis + 1, axis + 1)] += START_SPEED_SD_M_S * START_SPEED_SD_M_S;
        moving.covariance[(axis + 2, axis + 2)] += acceleration_sd_m_s2 * acceleration_sd_m_s2;
    }
    moving
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::TeamParams;
    use nalgebra::{Matrix6, Vector6};

    fn transitions() -> MotionTransitions {
        let params = TeamParams::recommended().track;
        MotionTransitions::new(&params.transition(Duration::from_s(0.5)), &params)
    }

    fn at_speed(speed_m_s: f64) -> MotionModes {
        let mean = Vector6::new(5.0, speed_m_s, 0.0, -3.0, 0.0, 0.0);
        MotionModes::moving(Estimate { state: TargetState(mean), covariance: Covariance::from_diagonal([1.0; 6]) })
    }

    fn probabilities(modes: &MotionModes) -> [f64; MODES] {
        modes.all().each_ref().map(|(probability, _)| *probability)
    }

    #[test]
    fn slow_targets_stop_and_fast_ones_do_not() {
        for (speed_m_s, stops) in [(0.0, true), (2.0, true), (14.0, false)] {
            let mut modes = at_speed(speed_m_s);
            modes.predict(&transitions(), true);
            let [moving, manoeuvring, stopped] = probabilities(&modes);
            assert!((moving + manoeuvring + stopped - 1.0).abs() < 1e-12, "{speed_m_s}");
            assert_eq!(stopped > 0.001, stops, "{speed_m_s}: {stopped}");
            assert!((0.01..0.02).contains(&manoeuvring), "{manoeuvring}");
        }
        let mut modes = at_speed(0.0);
        modes.predict(&transitions(), false);
        assert_eq!(probabilities(&modes)[STOPPED], 0.0);
    }

    /// A stopped target stays where it is; if it starts, it starts slowly.
    #[test]
    fn a_stopped_target_stays_or_starts() {
        let mut modes = at_speed(1.0);
        modes.predict(&transitions(), true);
        modes.0[0].0 = 0.0;
        modes.0[1].0 = 0.0;
        modes.normalise();
        let before = modes.all()[STOPPED].1;
        modes.predict(&transitions(), true);
        let [moving, manoeuvring, stopped] = modes.all();
        assert_eq!((moving.0, before.state), (0.0, stopped.1.state));
        assert!((manoeuvring.0 - (1.0 - math::exp(-START_RATE_1_S * 0.5))).abs() < 1e-12);
        assert!(manoeuvring.1.covariance[(1, 1)] > 4.0 && stopped.1.covariance[(1, 1)] < 0.02);
    }

    /// A manoeuvre that begins may have displaced the target before; one that goes on was known.
    #[test]
    fn only_a_manoeuvre_that_begins_was_hidden() {
        let predicted = |manoeuvring: f64| {
            let mut modes = at_speed(14.0);
            (modes.0[0].0, modes.0[MANOEUVRING].0) = (1.0 - manoeuvring, manoeuvring);
            modes.predict(&transitions(), false);
            modes.0.map(|(_, estimate)| estimate)
        };
        let ([moving, begun, _], [still_moving, going_on, _]) = (predicted(0.0), predicted(1.0));
        assert_eq!(moving, still_moving);
        let hidden_m2 = transitions().hidden_sd_m * transitions().hidden_sd_m;
        let added = begun.covariance.matrix() - going_on.covariance.matrix();
        let expected = Covariance::from_diagonal([hidden_m2, 0.0, 0.0, hidden_m2, 0.0, 0.0]).matrix();
        assert!(
            hidden_m2 > 0.0 && (added - expected).norm() < 1e-9 && (begun.state.0 - going_on.state.0).norm() < 1e-9
        );
    }

    /// What is kept between time steps gives the same prediction, up to the merging of the moving models.
    #[test]
    fn stored_modes_are_restored() {
        let mut modes = at_speed(1.0);
        modes.predict(&transitions(), true);
        let stored = modes.stored();
        assert!(stored.is_valid());
        let restored = stored.restored(&modes.moments());
        let [before, after] = [&modes, &restored].map(probabilities);
        assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() < 1e-12));
        let [before, after] = [&modes, &restored].map(MotionModes::moments);
        let matrices = [before, after].map(|of| of.covariance.matrix());
        assert!((before.state.0 - after.state.0).norm() < 1e-9 && (matrices[0] - matrices[1]).norm() < 1e-9);
        assert_eq!(StoredModes::default().restored(&before), MotionModes::moving(before));
    }

    /// East and north have the same model: exchanging them exchanges the results. The position of a target that stops is
    /// uncertain along its way.
    #[test]
    fn a_target_stops_alike_in_each_direction() {
        let mut upper = Covariance::from_diagonal([9.0, 4.0, 1.0, 16.0, 1.0, 1.0]).upper_triangle();
        (upper[1], upper[3], upper[4], upper[8]) = (3.0, 2.0, 0.5, 0.25);
        let covariance = Covariance::from_upper_triangle(&upper);
        let exchanged =
            |matrix: Matrix6<f64>| Matrix6::from_fn(|row, column| matrix[((row + 3) % 6, (column + 3) % 6)]);
        let [east, north] = [covariance, Covariance::from(&exchanged(covariance.matrix()))];
        let state = TargetState(Vector6::new(1.0, 8.0, 0.0, 2.0, -3.0, 0.0));
        let turned = TargetState(Vector6::from_fn(|row, _| state.0[(row + 3) % 6]));
        let [of_east, of_north] =
            [(state, east), (turned, north)].map(|(state, covariance)| stopped_from(&Estimate { state, covariance }));
        assert_eq!(exchanged(of_east.covariance.matrix()), of_north.covariance.matrix());
        let [after_s, sd_s] = BRAKING_S;
        let expected = 9.0 + sd_s * sd_s * 64.0 + after_s * after_s * 4.0 + 2.0 * after_s * 3.0;
        assert!((of_north.covariance[(3, 3)] - expected).abs() < 1e-12, "{of_north:?}");
    }

    #[test]
    fn impossible_stored_modes_are_invalid() {
        let mut modes = at_speed(1.0);
        modes.predict(&transitions(), true);
        let stored = modes.stored();
        let stop = stored.stopped.unwrap();
        for broken in [
            StoredModes { manoeuvring: 1.5, ..stored },
            StoredModes { manoeuvring: f64::NAN, ..stored },
            StoredModes { stopped: Some(StoredStop { probability: -0.1, ..stop }), ..stored },
            StoredModes { stopped: Some(StoredStop { covariance: [1.0, 2.0, 1.0], ..stop }), ..stored },
            StoredModes { stopped: Some(StoredStop { position: [f64::INFINITY, 0.0], ..stop }), ..stored },
        ] {
            assert!(!broken.is_valid(), "{broken:?}");
        }
    }
}
