//! The centre of a group: a linear Kalman filter on the centroid of the members' estimated positions (section II.C).
//!
//! The model is the targets' own (5, 6). The paper prints no R: here it is the covariance of the centroid, the sum of
//! the members' position covariances over n^2. The filter filters what is already filtered, so its own covariance is
//! too small to take a margin from.

use nalgebra::{Matrix2, Vector6};

use crate::covariance::Covariance;
use crate::estimation::information_filter::{Contribution, Estimate, InformationFilter, inverse_2};
use crate::frame::Position;
use crate::target::{TargetState, Transition};

/// The plain average of the members' estimates at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centroid {
    /// Mean of the members' states, and its covariance (the sum of theirs over n^2).
    pub mean: Estimate,
    /// Number of members n.
    pub members: u32,
}

impl Centroid {
    /// Averages; `None` for no members.
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

    /// The same covariance about another state.
    pub(crate) fn at(mut self, state: &TargetState) -> Self {
        self.mean.state = *state;
        self
    }
}

/// Covariance of the position of a member relative to the centroid of so many, whose own is `centroid_m2`, m2: what a
/// margin for that member must cover.
pub(crate) fn relative_covariance(member: &Estimate, centroid_m2: &Matrix2<f64>, members: u32) -> Matrix2<f64> {
    let own_share = 1.0 - 2.0 / f64::from(members);
    member.position_covariance() * own_share + centroid_m2
}

/// The mean of the members' states alone, and their number; `None` for no members.
pub(crate) fn mean_state<'a>(members: impl Iterator<Item = &'a Estimate>) -> Option<(TargetState, u32)> {
    let (sum, n) = members.fold((Vector6::zeros(), 0u32), |(sum, n), member| (sum + member.state.0, n + 1));
    (n > 0).then(|| (TargetState(sum * (1.0 / f64::from(n))), n))
}

/// The covariance of the mean of the members' positions alone, m2.
pub(crate) fn mean_position_covariance<'a>(members: impl Iterator<Item = &'a Estimate>, n: u32) -> Matrix2<f64> {
    let weight = 1.0 / f64::from(n);
    members.map(Estimate::position_covariance).sum::<Matrix2<f64>>() * (weight * weight)
}

/// The filter of a group's centre.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GroupCentre {
    filter: InformationFilter,
    /// Squared Mahalanobis distance (16) of the last centroid from its prediction, dimensionless.
    pub innovation_distance: f64,
}

impl GroupCentre {
    /// Starts at the centroid; `None` if its numbers are no estimate. Where its components are so correlated that rounding
    /// leaves no covariance, it starts without their correlations: a group has a centre as long as it has members.
    pub fn start(centroid: &Centroid) -> Option<Self> {
        let mean = centroid.mean;
        let variances = mean.covariance.matrix().diagonal().into();
        let uncorrelated =
            || InformationFilter::new(Estimate { covariance: Covariance::from_diagonal(variances), ..mean });
        Some(Self { filter: InformationFilter::new(mean).or_else(uncorrelated)?, innovation_distance: 0.0 })
    }

    /// At the centroid itself.
    pub fn at(centroid: &Centroid, innovation_distance: f64) -> Option<Self> {
        Some(Self { innovation_distance, ..Self::start(centroid)? })
    }

    /// Predicts and takes in the centroid of one instant. `None` if the numbers do not allow it.
    ///
    /// Implements section II.C. The innovation's distance is Eq. (16) as printed: weighted with the predicted position covariance alone.
    #[must_use]
    #[inline]
    pub fn advance(mut self, transition: &Transition, centroid: &Centroid) -> Option<Self> {
        let mean = &centroid.mean;
        self.follow(transition, mean.state.position(), &mean.position_covariance()).then_some(self)
    }

    /// [Advances](Self::advance) in place, given the position of the centroid and its covariance (m2); whether the numbers
    /// allowed it.
    pub(crate) fn follow(&mut self, transition: &Transition, measured: Position, covariance: &Matrix2<f64>) -> bool {
        self.filter.predict(transition);
        let predicted = self.filter.estimate();
        self.innovation_distance =
            mahalanobis_squared(measured, predicted.state.position(), &predicted.position_covariance());
        self.filter.update(&Contribution::of_position(measured, covariance));
        self.filter.is_sound()
    }

    /// Its numbers are such as a filter keeps.
    pub(crate) fn is_sound(&self) -> bool {
        self.filter.is_sound()
    }

    /// Moves the centre by what a change of members moved the centroid, so that the change is no innovation.
    #[must_use]
    pub fn shifted(&self, by: &Vector6<f64>) -> Self {
        Self { filter: self.filter.shifted(by), ..*self }
    }

    /// Puts the centre elsewhere.
    #[must_use]
    pub(crate) fn moved_to(&self, there: &TargetState) -> Self {
        Self { filter: self.filter.moved_to(there), ..*self }
    }

    /// Mean and covariance of the centre; of one that is not filtered, the covariance is that of its founding.
    pub fn estimate(&self) -> &Estimate {
        self.filter.estimate()
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
    use crate::target::TargetParams;
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

    /// A position that follows from the velocity, to the last digit.
    #[test]
    fn a_centre_starts_also_where_rounding_has_left_no_covariance() {
        let mut centroid = Centroid::of([member(0.0, 0.0, 16.0)].iter()).unwrap();
        let mut upper = centroid.mean.covariance.upper_triangle();
        upper[1] = 4.0 * (1.0 + 1e-15);
        centroid.mean.covariance = Covariance::from_upper_triangle(&upper);
        assert!(InformationFilter::new(centroid.mean).is_none());
        let centre = GroupCentre::start(&centroid).unwrap();
        assert_eq!(centre.estimate().state, centroid.mean.state);
        assert_eq!(centre.estimate().position_covariance(), centroid.mean.position_covariance());
    }

    /// Relative to the centroid of two, each member is half the difference: (P1 + P2) / 4.
    #[test]
    fn the_relative_covariance_of_a_pair_is_a_quarter_of_the_sum() {
        let members = [member(0.0, 0.0, 16.0), member(8.0, 0.0, 4.0)];
        let centroid = Centroid::of(members.iter()).unwrap();
        for member in &members {
            let relative = relative_covariance(member, &centroid.mean.position_covariance(), 2);
            assert!((relative[(0, 0)] - 5.0).abs() < 1e-12);
        }
    }

    /// Checks Eq. (16): dimensionless and quadratic, whatever the unit of the margin it is added to.
    #[test]
    fn the_printed_margin_is_a_squared_mahalanobis_distance() {
        let p = Matrix2::new(4.0, 0.0, 0.0, 25.0);
        let d = mahalanobis_squared(Position::from_m(2.0, 5.0), Position::ORIGIN, &p);
        assert!((d - 2.0).abs() < 1e-12);
        let twice = mahalanobis_squared(Position::from_m(4.0, 10.0), Position::ORIGIN, &p);
        assert!((twice - 8.0).abs() < 1e-12);
    }

    /// Checks the erratum of Eq. (16): weighted with P_pos alone it runs above a chi-square of two degrees of freedom
    /// (mean 2), which the full innovation covariance P_pos + R would give.
    #[test]
    fn the_printed_weight_is_too_tight() {
        let transition =
            TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 }.transition(Duration::from_s(0.5));
        let mut centre = GroupCentre::start(&Centroid::of([member(0.0, 0.0, 16.0)].iter()).unwrap()).unwrap();
        for step in 0..50 {
            let centroid = Centroid::of([member(f64::from(step), 0.0, 16.0)].iter()).unwrap();
            centre = centre.advance(&transition, &centroid).unwrap();
        }
        centre.filter.predict(&transition);
        let predicted = centre.filter.estimate().position_covariance();
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
