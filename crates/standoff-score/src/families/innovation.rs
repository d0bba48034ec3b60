//! Normalised innovation squared: measurements compared with the predictions of the tracks, without truth.
//!
//! All measurements of a target at one time step are predicted from one estimate, so their innovations are correlated.
//! They are stacked: nu' S^-1 nu with S = H P H' + R, where H and R contain the rows of all UAVs. This equals the
//! residual that remains when the target is moved to the best agreement between prediction and measurements. With L L'
//! the position block of the predicted P:
//!
//! ```text
//! nu' S^-1 nu = min over u of  u' u + (nu - H L u)' R^-1 (nu - H L u)
//! ```
//!
//! This is a least-squares problem with two unknowns, solved by Givens rotations without square roots (Gentleman, *Least
//! squares computations by Givens transformations without square roots*, 1973). Each measured value updates the two rows
//! of the triangle and leaves a residual that no u reduces. The result is a sum of squared residuals with positive
//! weights, so it is never negative, whatever the measurement errors and the sensor accuracy.

use nalgebra::Matrix2;
use standoff::sensor::jacobian;
use standoff::sensor::measure;
use standoff::target::Transition;
use standoff::{Angle, Covariance, Position, RangeBearingMeasurement, SensorParams, TargetState};
use standoff_record::TrackRow;

use crate::geometry::at;
use crate::matching;
use crate::mean::Mean;
use crate::metric::{Family, Metric, MetricSet, NEITHER, TRACKS, metric};
use crate::step::Step;

/// Normalised innovations squared of a run.
#[derive(Debug, Default)]
pub(crate) struct Innovations {
    /// Tracks of the previous frame.
    before: Vec<TrackRow>,
    /// Their predicted measurements, if they are measured at the current time step.
    predicted: Vec<Option<PredictedMeasurement>>,
    /// Squared innovations per measured value.
    squares: Mean,
}

impl Family for Innovations {
    const SECTION: &'static str = "Estimation";
    const SET: MetricSet = MetricSet::Limits;
    const METRICS: &'static [Metric<Self>] = &[metric("nis", "NIS", NEITHER, 0.02, TRACKS, |of, _| of.value())];

    fn add(&mut self, Step { config, frame, transition, .. }: &Step<'_>) {
        self.predicted.clear();
        self.predicted.resize(self.before.len(), None);
        for detection in &frame.detections {
            let Some(uav) = matching::uav(frame, detection.uav) else { continue };
            let Some(index) = matching::track_index(detection, &self.before) else { continue };
            let z =
                RangeBearingMeasurement { range_m: detection.range_m, bearing: Angle::from_rad(detection.bearing_rad) };
            self.predicted[index]
                .get_or_insert_with(|| PredictedMeasurement::of(&self.before[index], transition))
                .compare(&config.sensor, at(uav), &z);
        }
        for target in self.predicted.iter().flatten() {
            self.squares = self.squares.and(target.squares);
        }
        self.before.clone_from(&frame.tracks);
    }
}

impl Innovations {
    /// Returns the mean per measured value; `None` if nothing was measured or the sum is not finite.
    fn value(&self) -> Option<f64> {
        self.squares.value().filter(|nis| nis.is_finite())
    }
}

/// Predicted position of a target, and the measurements of this time step relative to it.
#[derive(Debug, Clone, Copy)]
struct PredictedMeasurement {
    position: Position,
    /// Lower root L of the position covariance, m.
    root: Matrix2<f64>,
    /// Weight of each row of the triangle, initially 1.
    weights: [f64; 2],
    /// Coefficient of the second unknown in the first row; the diagonal is 1.
    across: f64,
    /// Right-hand sides.
    right: [f64; 2],
    /// Sum nu' S^-1 nu, and the number of measured values.
    squares: Mean,
}

impl PredictedMeasurement {
    fn of(track: &TrackRow, transition: &Transition) -> Self {
        let covariance = transition.predicted_position_covariance(&Covariance::from_upper_triangle(&track.covariance));
        Self::at(transition.predict(&TargetState(track.state.into())).position(), &covariance)
    }

    fn at(position: Position, covariance: &Matrix2<f64>) -> Self {
        let root = lower_root(covariance);
        Self { position, root, weights: [1.0; 2], across: 0.0, right: [0.0; 2], squares: Mean::default() }
    }

    /// The filter ignores measurements without a Jacobian, so this function does, too.
    fn compare(&mut self, sensor: &SensorParams, uav: Position, z: &RangeBearingMeasurement) {
        let Some(h) = jacobian(uav, self.position) else { return };
        let expected = measure(uav, self.position);
        let nu = [z.range_m - expected.range_m, (z.bearing - expected.bearing).rad()];
        let by_u = h * self.root;
        for (row, (nu, sd)) in nu.into_iter().zip([sensor.range_sd_m, sensor.bearing_sd_rad]).enumerate() {
            let per_sd = 1.0 / sd;
            self.add_value([by_u[(row, 0)] * per_sd, by_u[(row, 1)] * per_sd], nu * per_sd);
        }
    }

    /// Adds one measured value: its coefficients of u and its innovation, both in standard deviations.
    fn add_value(&mut self, [first, mut second]: [f64; 2], mut nu: f64) {
        let (kept, new) = self.rotate(0, first, 1.0);
        (second, self.across) = (second - first * self.across, kept * self.across + new * second);
        (nu, self.right[0]) = (nu - first * self.right[0], kept * self.right[0] + new * nu);
        let weight = kept;
        let (kept, new) = self.rotate(1, second, weight);
        (nu, self.right[1]) = (nu - second * self.right[1], kept * self.right[1] + new * nu);
        self.squares.add(weight * kept * nu * nu);
    }

    /// Adds a value with this weight to a row of the triangle; returns the fractions of the old and of the new row in it.
    fn rotate(&mut self, row: usize, coefficient: f64, weight: f64) -> (f64, f64) {
        let old = self.weights[row];
        self.weights[row] = old + weight * coefficient * coefficient;
        let inverse = 1.0 / self.weights[row];
        (old * inverse, weight * coefficient * inverse)
    }
}

/// Returns the lower triangle L with L L' = `covariance`. Variances below zero, due to rounding, count as zero.
fn lower_root(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let x = covariance[(0, 0)].max(0.0).sqrt();
    let y_with_x = if x > 0.0 { covariance[(0, 1)] / x } else { 0.0 };
    Matrix2::new(x, 0.0, y_with_x, (covariance[(1, 1)] - y_with_x * y_with_x).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Matrix6x2, Vector6};
    use standoff::Displacement;

    fn sensor() -> SensorParams {
        SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 1.0,
            sensing_range_m: 1200.0,
            ..standoff::TeamParams::paper().track.sensor
        }
    }

    fn predicted() -> PredictedMeasurement {
        PredictedMeasurement::at(Position::from_m(400.0, 0.0), &Matrix2::new(300.0, 0.0, 0.0, 44.0))
    }

    /// 20 m of range error with S = 300 m2 + (10 m)2 is one standard deviation. So is a bearing error of the root of 44
    /// m2 / (400 m)2 plus (3 degrees)2.
    #[test]
    fn one_sigma_errors_in_range_and_bearing_sum_to_two() {
        let mut target = predicted();
        let sd_rad = (44.0 / 160_000.0 + sensor().bearing_sd_rad * sensor().bearing_sd_rad).sqrt();
        let z = RangeBearingMeasurement { range_m: 420.0, bearing: Angle::from_rad(-sd_rad) };
        target.compare(&sensor(), Position::ORIGIN, &z);
        assert!((target.squares.sum - 2.0).abs() < 1e-12);
        assert_eq!(target.squares.n, 2);
    }

    /// Three UAVs, one of them across the wrap of the bearing: the result equals stacking all innovations and inverting
    /// S.
    #[test]
    fn sequential_processing_equals_stacked_innovations() {
        let covariance = Matrix2::new(300.0, -70.0, -70.0, 44.0);
        let mut target = PredictedMeasurement::at(Position::from_m(400.0, 0.0), &covariance);
        let looks = [
            (Position::ORIGIN, RangeBearingMeasurement { range_m: 420.0, bearing: Angle::from_deg(2.0) }),
            (
                Position::from_m(100.0, -300.0),
                RangeBearingMeasurement { range_m: 430.0, bearing: Angle::from_deg(41.0) },
            ),
            (Position::from_m(800.0, 3.0), RangeBearingMeasurement { range_m: 391.0, bearing: Angle::from_deg(178.0) }),
        ];
        let (mut h, mut nu, mut r) = (Matrix6x2::zeros(), Vector6::zeros(), Matrix6::zeros());
        for (i, (uav, z)) in looks.iter().enumerate() {
            target.compare(&sensor(), *uav, z);
            let expected = measure(*uav, target.position);
            h.fixed_rows_mut::<2>(2 * i).copy_from(&jacobian(*uav, target.position).unwrap());
            nu[2 * i] = z.range_m - expected.range_m;
            nu[2 * i + 1] = (z.bearing - expected.bearing).rad();
            r[(2 * i, 2 * i)] = 100.0;
            r[(2 * i + 1, 2 * i + 1)] = sensor().bearing_sd_rad * sensor().bearing_sd_rad;
        }
        let s = h * covariance * h.transpose() + r;
        let expected = nu.dot(&s.cholesky().unwrap().solve(&nu));
        assert!((target.squares.sum / expected - 1.0).abs() < 1e-12);
        assert!(nu.amax() < 30.0 && nu[5].abs() < 0.1, "the bearing's innovation wraps");
        assert_eq!(target.squares.n, 6);
    }

    /// A range error of 500 m with an assumed sensor accuracy of 1 mm and a track accuracy of 100 km: of the 2.5e11
    /// squared sensor standard deviations, all but (500 m / 100 km)^2 = 2.5e-5 is explained by the track uncertainty.
    /// Two UAVs that agree give the same. The result is never negative, whatever the number of UAVs and their
    /// measurements.
    #[test]
    fn nearly_cancelled_sum_is_not_negative() {
        let sensor = SensorParams { range_sd_m: 1e-3, bearing_sd_rad: 1e-6, ..sensor() };
        let track = |uav: Position| {
            let wide = Matrix2::new(1e10, 0.0, 0.0, 1e10);
            PredictedMeasurement::at(uav + Displacement::from_polar(400.0, Angle::from_rad(0.7)), &wide)
        };
        let uav = Position::from_m(1000.0, -300.0);
        let mut target = track(uav);
        target.compare(&sensor, uav, &RangeBearingMeasurement { range_m: 900.0, bearing: Angle::from_rad(0.7) });
        assert!((target.squares.sum / 2.5e-5 - 1.0).abs() < 1e-6, "{}", target.squares.sum);
        for n in 1..200 {
            let mut target = track(uav);
            for other in 0..3 {
                let from = uav + Displacement::from_m(f64::from(n * other), f64::from(7 * other));
                let range_m = 900.0 + f64::from(n);
                target.compare(&sensor, from, &RangeBearingMeasurement { range_m, bearing: Angle::from_rad(0.7) });
            }
            assert!(target.squares.sum >= 0.0 && target.squares.sum.is_finite(), "{n}: {}", target.squares.sum);
        }
    }

    /// A sum that is not finite has no mean.
    #[test]
    fn infinite_sum_has_no_mean() {
        let mut innovations = Innovations::default();
        assert_eq!(innovations.value(), None);
        innovations.squares = Mean { sum: 7.0, n: 2 };
        assert_eq!(innovations.value(), Some(3.5));
        innovations.squares.sum = f64::INFINITY;
        assert_eq!(innovations.value(), None);
    }

    #[test]
    fn negative_variance_counts_as_zero() {
        assert_eq!(lower_root(&Matrix2::new(4.0, 2.0, 2.0, 1.0 - 1e-17)), Matrix2::new(2.0, 0.0, 1.0, 0.0));
        assert_eq!(lower_root(&Matrix2::new(0.0, 0.0, 0.0, -1e-20)), Matrix2::zeros());
    }
}
