//! Centre of a group: a linear Kalman filter on the centroid of the members' estimated positions (section II.C).
//!
//! The motion model is the target model (5, 6). The paper does not give R. This module uses the covariance of the
//! centroid: the sum of the members' position covariances over n^2. The filter's input is already filtered, so its
//! covariance is too small to derive a margin from it.

use nalgebra::{Matrix2, Vector6};

use crate::covariance::Covariance;
use crate::frame::Position;
use crate::target::{TargetState, Transition};
use crate::tracking::estimate::{Estimate, inverse_2};
use crate::tracking::information_filter::Contribution;

/// The unweighted mean of the members' estimates at one time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centroid {
    /// Mean of the members' states, and its covariance (the sum of theirs over n^2).
    pub mean: Estimate,
    /// Number of members n.
    pub members: u32,
}

impl Centroid {
    /// Computes the mean of the members; `None` if there are no members.
    pub fn of<'a>(members: impl Iterator<Item = &'a Estimate>) -> Option<Self> {
        let (mut sum, mut covariance, mut n) = (Vector6::zeros(), Covariance::default(), 0u32);
        for member in members {
            sum += member.state.0;
            covariance += member.covariance;
            n += 1;
        }
        let weight = 1.0 / f64::from(n.max(1));
        let mean = Estimate { state: TargetState(sum * weight), covariance: covariance * (weight * weight) };
        (n > 0).then_some(Self { mean, members: n })
    }

    /// Replaces the mean state and keeps the covariance.
    pub(crate) fn at(mut self, state: &TargetState) -> Self {
        self.mean.state = *state;
        self
    }
}

/// Covariance of a member's position relative to the centroid of `members` members, m2. `centroid_m2` is the position
/// covariance of the centroid. The margin of the member must cover this covariance.
pub(crate) fn relative_covariance(member: &Estimate, centroid_m2: &Matrix2<f64>, members: u32) -> Matrix2<f64> {
    let own_share = 1.0 - 2.0 / f64::from(members);
    member.position_covariance() * own_share + centroid_m2
}

/// Mean of the members' states and their number; `None` if there are no members.
pub(crate) fn mean_state<'a>(members: impl Iterator<Item = &'a Estimate>) -> Option<(TargetState, u32)> {
    let (sum, n) = members.fold((Vector6::zeros(), 0u32), |(sum, n), member| (sum + member.state.0, n + 1));
    (n > 0).then(|| (TargetState(sum * (1.0 / f64::from(n))), n))
}

/// Covariance of the mean of the positions of `n` members, m2.
pub(crate) fn mean_position_covariance<'a>(members: impl Iterator<Item = &'a Estimate>, n: u32) -> Matrix2<f64> {
    let weight = 1.0 / f64::from(n);
    members.map(Estimate::position_covariance).sum::<Matrix2<f64>>() * (weight * weight)
}

/// Kalman filter of a group's centre.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GroupCentre {
    estimate: Estimate,
    /// Squared Mahalanobis distance (16) of the last centroid from its prediction, dimensionless.
    pub innovation_distance: f64,
}

impl GroupCentre {
    /// Starts the filter at the centroid; `None` if the centroid is not a valid estimate. If the components are so
    /// correlated that rounding makes the covariance singular, the filter starts without the correlations, because a
    /// group with members must have a centre.
    pub fn start(centroid: &Centroid) -> Option<Self> {
        let mean = centroid.mean;
        let variances = mean.covariance.matrix().diagonal().into();
        let uncorrelated = || Estimate { covariance: Covariance::from_diagonal(variances), ..mean }.checked();
        Some(Self { estimate: mean.checked().or_else(uncorrelated)?, innovation_distance: 0.0 })
    }

    /// Starts the filter at the centroid with a given innovation distance.
    pub fn at(centroid: &Centroid, innovation_distance: f64) -> Option<Self> {
        Some(Self { innovation_distance, ..Self::start(centroid)? })
    }

    /// Predicts the centre and updates it with the centroid of one time step. `None` if the filter becomes invalid.
    ///
    /// Implements section II.C. The innovation's distance is Eq. (16) as published: weighted with the predicted
    /// position covariance alone.
    #[must_use]
    #[inline]
    pub fn advance(mut self, transition: &Transition, centroid: &Centroid) -> Option<Self> {
        let mean = &centroid.mean;
        self.follow(transition, mean.state.position(), &mean.position_covariance()).then_some(self)
    }

    /// [Advances](Self::advance) the centre in place, given the position of the centroid and its covariance (m2).
    /// Returns false if the filter became invalid.
    pub(crate) fn follow(&mut self, transition: &Transition, measured: Position, covariance: &Matrix2<f64>) -> bool {
        self.estimate.predict(transition);
        let predicted = &self.estimate;
        self.innovation_distance =
            mahalanobis_squared(measured, predicted.state.position(), &predicted.position_covariance());
        self.estimate.update(&Contribution::from_position(measured, covariance));
        self.estimate.is_valid()
    }

    /// Returns true if the filter is valid.
    pub(crate) fn is_valid(&self) -> bool {
        self.estimate.is_valid()
    }

    /// Shifts the centre by the jump of the centroid at a membership change, so that the jump is not treated as
    /// innovation.
    #[must_use]
    pub fn shifted(&self, by: &Vector6<f64>) -> Self {
        Self { estimate: self.estimate.shifted(by), ..*self }
    }

    /// Replaces the state of the centre and keeps the covariance.
    #[must_use]
    pub(crate) fn with_centre_at(&self, there: &TargetState) -> Self {
        Self { estimate: Estimate { state: *there, ..self.estimate }, ..*self }
    }

    /// Mean and covariance of the centre. If the centre is not filtered, the covariance is the one at the group's
    /// creation.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }
}

/// `[z - z_hat]' P^-1 [z - z_hat]`, dimensionless; zero for a degenerate P.
///
/// Implements Eq. (16).
pub fn mahalanobis_squared(measured: Position, predicted: Position, covariance: &Matrix2<f64>) -> f64 {
    let nu = (measured - predicted).vector();
    inverse_2(covariance).map_or(0.0, |information| nu.dot(&(information * nu)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;
    use crate::params::TargetParams;
    use crate::time::Duration;

    fn member(x_m: f64, y_m: f64, variance: f64) -> Estimate {
        Estimate {
            state: TargetState::new(Position::from_m(x_m, y_m), Velocity::from_m_s(2.0, 0.0), [0.0, 0.0]),
            covariance: Covariance::from_diagonal([variance, 1.0, 0.1, variance, 1.0, 0.1]),
        }
    }

    /// Checks section II.C, the measurement of the centre and its covariance.
    #[test]
    fn the_centroid_is_the_average_and_its_covariance_shrinks_with_n_squared() {
        let members = [member(0.0, 0.0, 16.0), member(8.0, 0.0, 16.0), member(4.0, 6.0, 4.0), member(0.0, 2.0, 4.0)];
        let centroid = Centroid::of(members.iter()).unwrap();
        assert_eq!(centroid.mean.state.position(), Position::from_m(3.0, 2.0));
        assert_eq!(centroid.mean.position_covariance()[(0, 0)], 40.0 / 16.0);
        assert!(Centroid::of([].iter()).is_none());
    }

    /// The position is fully correlated with the velocity, to the last digit.
    #[test]
    fn a_centre_starts_despite_a_covariance_made_singular_by_rounding() {
        let mut centroid = Centroid::of([member(0.0, 0.0, 16.0)].iter()).unwrap();
        let mut upper = centroid.mean.covariance.upper_triangle();
        upper[1] = 4.0 * (1.0 + 1e-15);
        centroid.mean.covariance = Covariance::from_upper_triangle(&upper);
        assert!(centroid.mean.checked().is_none());
        let centre = GroupCentre::start(&centroid).unwrap();
        assert_eq!(centre.estimate().state, centroid.mean.state);
        assert_eq!(centre.estimate().position_covariance(), centroid.mean.position_covariance());
    }

    /// Relative to the centroid of two, the position of each member is half the difference: (P1 + P2) / 4.
    #[test]
    fn the_relative_covariance_of_a_pair_is_a_quarter_of_the_sum() {
        let members = [member(0.0, 0.0, 16.0), member(8.0, 0.0, 4.0)];
        let centroid = Centroid::of(members.iter()).unwrap();
        for member in &members {
            let relative = relative_covariance(member, &centroid.mean.position_covariance(), 2);
            assert!((relative[(0, 0)] - 5.0).abs() < 1e-12);
        }
    }

    /// Checks Eq. (16): the distance is dimensionless and quadratic, although it is added to a margin in metres.
    #[test]
    fn the_published_margin_is_a_squared_mahalanobis_distance() {
        let p = Matrix2::new(4.0, 0.0, 0.0, 25.0);
        let d = mahalanobis_squared(Position::from_m(2.0, 5.0), Position::ORIGIN, &p);
        assert!((d - 2.0).abs() < 1e-12);
        let twice = mahalanobis_squared(Position::from_m(4.0, 10.0), Position::ORIGIN, &p);
        assert!((twice - 8.0).abs() < 1e-12);
    }

    /// Checks the erratum of Eq. (16): weighted with P_pos alone, the distance exceeds a chi-square of two degrees of
    /// freedom (mean 2), which the full innovation covariance P_pos + R would give.
    #[test]
    fn the_published_weight_is_too_large() {
        let transition =
            TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 }.transition(Duration::from_s(0.5));
        let mut centre = GroupCentre::start(&Centroid::of([member(0.0, 0.0, 16.0)].iter()).unwrap()).unwrap();
        for step in 0..50 {
            let centroid = Centroid::of([member(f64::from(step), 0.0, 16.0)].iter()).unwrap();
            centre = centre.advance(&transition, &centroid).unwrap();
        }
        centre.estimate.predict(&transition);
        let predicted = centre.estimate.position_covariance();
        let full = predicted + Matrix2::identity() * 16.0;
        let one_sd = Position::from_m(full[(0, 0)].sqrt(), full[(1, 1)].sqrt());
        assert!((mahalanobis_squared(one_sd, Position::ORIGIN, &full) - 2.0).abs() < 1e-9);
        assert!(mahalanobis_squared(one_sd, Position::ORIGIN, &predicted) > 4.0);
    }

    #[test]
    fn a_centre_at_the_centroid_has_no_inertia() {
        let centroid = Centroid::of([member(3.0, 4.0, 16.0), member(5.0, 4.0, 16.0)].iter()).unwrap();
        let centre = GroupCentre::at(&centroid, 0.5).unwrap();
        assert_eq!(centre.estimate(), &centroid.mean);
        assert_eq!(centre.innovation_distance, 0.5);
    }

    /// Checks section II.C, the filter.
    #[test]
    fn the_centre_follows_a_steady_centroid() {
        let transition =
            TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 }.transition(Duration::from_s(0.5));
        let mut centre = GroupCentre::start(&Centroid::of([member(0.0, 0.0, 16.0)].iter()).unwrap()).unwrap();
        for step in 1..200 {
            let centroid = Centroid::of([member(1.5 * f64::from(step), 0.0, 16.0)].iter()).unwrap();
            centre = centre.advance(&transition, &centroid).unwrap();
        }
        assert!(centre.estimate().state.position().distance_m(Position::from_m(298.5, 0.0)) < 0.1);
        assert!((centre.estimate().state.velocity() - Velocity::from_m_s(3.0, 0.0)).speed_m_s() < 0.05);
    }
}
