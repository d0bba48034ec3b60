//! Errors of the position and heading that each UAV assumes to have.

use standoff::math;
use standoff::{Angle, Displacement, Duration, UavId, UavState};

use crate::random::{Draws, Stream};

/// Errors of the navigation of all UAVs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigationModel {
    /// Standard deviation of the position, per axis, m.
    pub position_sd_m: f64,
    /// Correlation time of the position error, s: a first-order Gauss-Markov process per axis.
    pub correlation_s: f64,
    /// Standard deviation of the heading error, rad. It is constant for each UAV and mission.
    pub heading_sd_rad: f64,
}

impl NavigationModel {
    /// True if the UAVs know their states exactly.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.position_sd_m <= 0.0 && self.heading_sd_rad <= 0.0
    }

    /// Correlation of the position errors of two times that are `dt` apart, 0 to 1.
    fn correlation(&self, dt: Duration) -> f64 {
        if self.correlation_s > 0.0 { math::exp(-dt.s() / self.correlation_s) } else { 0.0 }
    }
}

/// Present error of the state that a UAV assumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NavigationError {
    position: Displacement,
    heading: Angle,
}

impl NavigationError {
    /// Draws the error at the first time step.
    pub(crate) fn new(model: &NavigationModel, uav: UavId, draws: Draws) -> Self {
        let [x, y] = draws.at(Stream::NavigationPosition, uav.0.into(), 0).normals();
        let heading = model.heading_sd_rad * draws.at(Stream::NavigationHeading, uav.0.into(), 0).normal();
        let position = Displacement::from_m(model.position_sd_m * x, model.position_sd_m * y);
        Self { position, heading: Angle::from_rad(heading) }
    }

    /// Advances the error by one time step of `period`, to time step `tick`.
    pub(crate) fn step(&mut self, model: &NavigationModel, period: Duration, uav: UavId, draws: (Draws, u64)) {
        let (draws, tick) = draws;
        let correlation = model.correlation(period);
        let sd_m = model.position_sd_m * (1.0 - correlation * correlation).sqrt();
        let [x, y] = draws.at(Stream::NavigationPosition, uav.0.into(), tick).normals();
        let kept = |of_m: f64, normal: f64| correlation * of_m + sd_m * normal;
        self.position = Displacement::from_m(kept(self.position.x_m(), x), kept(self.position.y_m(), y));
    }

    /// State that a UAV in the state `truth` assumes.
    pub(crate) fn believed(&self, truth: &UavState) -> UavState {
        UavState { position: truth.position + self.position, heading: truth.heading + self.heading, ..*truth }
    }

    /// Heading error: the UAV assumes a heading, a boresight or a bearing that is anticlockwise of the true one by this.
    pub(crate) fn heading(&self) -> Angle {
        self.heading
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::Position;

    /// Over many UAVs and time steps: standard deviation, correlation over 10 s, and a constant heading error.
    #[test]
    fn errors_have_the_given_standard_deviations_and_correlation_time() {
        let model = NavigationModel { position_sd_m: 3.0, correlation_s: 30.0, heading_sd_rad: 0.1 };
        let (draws, period, n) = (Draws::new(4), Duration::from_s(0.5), 2_000u32);
        let truth = UavState::level_flight(Position::from_m(100.0, 50.0), Angle::from_rad(0.3), 40.0);
        let (mut squares, mut products, mut headings) = ([0.0; 2], 0.0, 0.0);
        for uav in (0..n).map(UavId) {
            let mut error = NavigationError::new(&model, uav, draws);
            let first = error.believed(&truth);
            (1..=20).for_each(|tick| error.step(&model, period, uav, (draws, tick)));
            let last = error.believed(&truth);
            assert_eq!((first.heading, first.speed_m_s), (last.heading, truth.speed_m_s));
            let offs = [first, last].map(|believed| (believed.position - truth.position).x_m());
            squares.iter_mut().zip(offs).for_each(|(sum, off)| *sum += off * off);
            products += offs[0] * offs[1];
            let heading_rad = (first.heading - truth.heading).rad();
            headings += heading_rad * heading_rad;
        }
        let n = f64::from(n);
        // Five standard errors each.
        for square in squares {
            assert!((square / n / 9.0 - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{square}");
        }
        assert!((headings / n / 0.01 - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!((products / n / 9.0 - math::exp(-1.0 / 3.0)).abs() < 5.0 * (1.5 / n).sqrt(), "{}", products / n / 9.0);
    }
}
