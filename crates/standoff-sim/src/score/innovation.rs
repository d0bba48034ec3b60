//! The normalised innovation squared: what was measured against what the tracks foretold. It needs no truth.
//!
//! All measurements of a target at one instant are foretold from one estimate, so their innovations are correlated; they
//! are stacked: nu' S^-1 nu with S = H P H' + R, H and R those of all UAVs one below the other. That is what is left when
//! the target is moved to where prediction and measurements agree best: with L L' the position block of the predicted P,
//!
//! ```text
//! nu' S^-1 nu = min over u of  u' u + (nu - H L u)' R^-1 (nu - H L u)
//! ```
//!
//! Least squares in two unknowns, solved by rotations: a number measured turns into what the two rows kept take in, and a
//! rest, which no u makes smaller. The sum is one of squares of rests, so it is never negative, however far off, and to
//! however many digits, the sensors are.

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Vector3};
use standoff::{Angle, Covariance, Duration, Position, RangeBearing, SensorParams, TargetState, Transition, sensor};

use super::mean::Mean;
use super::rules::Rules;
use crate::frame::{Frame, TrackRow};
use crate::geometry::at;

/// Normalised innovations squared of a run.
#[derive(Debug, Clone)]
pub(super) struct Innovations {
    transition: Transition,
    sensor: SensorParams,
    /// The tracks of the frame before.
    before: Vec<TrackRow>,
    /// Of the numbers measured.
    squares: Mean,
}

impl Innovations {
    pub(super) fn new(rules: &Rules) -> Self {
        Self {
            transition: rules.target.transition(Duration::from_s(rules.period_s)),
            sensor: rules.sensor,
            before: Vec::new(),
            squares: Mean::default(),
        }
    }

    /// Takes in the next frame.
    pub(super) fn frame(&mut self, frame: &Frame) {
        let mut foretold: BTreeMap<u32, Foretold> = BTreeMap::new();
        for detection in &frame.detections {
            let Some(uav) = frame.uavs.iter().find(|uav| uav.uav == detection.uav) else { continue };
            let Ok(index) = self.before.binary_search_by_key(&detection.target, |track| track.target) else { continue };
            let z = RangeBearing { range_m: detection.range_m, bearing: Angle::from_rad(detection.bearing_rad) };
            foretold
                .entry(detection.target)
                .or_insert_with(|| Foretold::of(&self.before[index], &self.transition))
                .compare(&self.sensor, at(uav), &z);
        }
        for target in foretold.values() {
            self.squares = self.squares.and(target.squares);
        }
        self.before.clone_from(&frame.tracks);
    }

    /// The mean per number measured; `None` where nothing was measured, or numbers do not hold the sum.
    pub(super) fn value(&self) -> Option<f64> {
        self.squares.value().filter(|nis| nis.is_finite())
    }
}

/// Where a target was foretold, and what the measurements of this instant say of that.
struct Foretold {
    position: Position,
    /// L, m.
    root: Matrix2<f64>,
    /// An upper triangle times u, and what it should come to: at first u itself, and zero.
    kept: [Vector3<f64>; 2],
    /// nu' S^-1 nu, over the numbers measured.
    squares: Mean,
}

impl Foretold {
    fn of(track: &TrackRow, transition: &Transition) -> Self {
        let mut p = Covariance::from_upper_triangle(&track.covariance);
        transition.predict_covariance(&mut p);
        Self::at(transition.predict(&TargetState(track.state.into())).position(), &p.position())
    }

    fn at(position: Position, covariance: &Matrix2<f64>) -> Self {
        let kept = [Vector3::x(), Vector3::y()];
        Self { position, root: lower_root(covariance), kept, squares: Mean::default() }
    }

    /// The filter takes nothing from a measurement where the Jacobian does not exist, so neither does this.
    fn compare(&mut self, sensor: &SensorParams, uav: Position, z: &RangeBearing) {
        let Some(h) = sensor::jacobian(uav, self.position) else { return };
        let expected = sensor::measure(uav, self.position);
        let nu = [z.range_m - expected.range_m, (z.bearing - expected.bearing).rad()];
        let by_u = h * self.root;
        for (row, (nu, sd)) in nu.into_iter().zip([sensor.range_sd_m, sensor.bearing_sd_rad]).enumerate() {
            self.take(Vector3::new(by_u[(row, 0)], by_u[(row, 1)], nu) / sd);
        }
    }

    /// Takes in one number: what u does to it, and what it is, in standard deviations.
    fn take(&mut self, mut row: Vector3<f64>) {
        for (column, kept) in self.kept.iter_mut().enumerate() {
            // At least 1, as at first.
            let length = (kept[column] * kept[column] + row[column] * row[column]).sqrt();
            let (cos, sin) = (kept[column] / length, row[column] / length);
            (*kept, row) = (*kept * cos + row * sin, row * cos - *kept * sin);
        }
        self.squares.add(row.z * row.z);
    }
}

/// The lower triangle L with L L' = `covariance`; where rounding has left a variance below zero, as if it were zero.
fn lower_root(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let x = covariance[(0, 0)].max(0.0).sqrt();
    let y_with_x = if x > 0.0 { covariance[(0, 1)] / x } else { 0.0 };
    Matrix2::new(x, 0.0, y_with_x, (covariance[(1, 1)] - y_with_x * y_with_x).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Template;
    use nalgebra::{Matrix6, Matrix6x2, Vector6};
    use standoff::Displacement;

    fn sensor() -> SensorParams {
        SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 1.0,
            sensing_range_m: 1200.0,
        }
    }

    fn foretold() -> Foretold {
        Foretold::at(Position::from_m(400.0, 0.0), &Matrix2::new(300.0, 0.0, 0.0, 44.0))
    }

    /// 20 m too far at S = 300 m2 + (10 m)2 is one standard deviation; so is a bearing off by the root of 44 m2 over
    /// (400 m)2 plus (3 degrees)2.
    #[test]
    fn one_standard_deviation_in_range_and_in_bearing_is_two() {
        let mut target = foretold();
        let sd_rad = (44.0 / 160_000.0 + sensor().bearing_sd_rad * sensor().bearing_sd_rad).sqrt();
        let z = RangeBearing { range_m: 420.0, bearing: Angle::from_rad(-sd_rad) };
        target.compare(&sensor(), Position::ORIGIN, &z);
        assert!((target.squares.sum - 2.0).abs() < 1e-12);
        assert_eq!(target.squares.n, 2);
    }

    /// Three UAVs, one of them across the seam of the angles: the same as stacking all innovations and inverting S.
    #[test]
    fn it_equals_the_stacked_innovations() {
        let covariance = Matrix2::new(300.0, -70.0, -70.0, 44.0);
        let mut target = Foretold::at(Position::from_m(400.0, 0.0), &covariance);
        let looks = [
            (Position::ORIGIN, RangeBearing { range_m: 420.0, bearing: Angle::from_deg(2.0) }),
            (Position::from_m(100.0, -300.0), RangeBearing { range_m: 430.0, bearing: Angle::from_deg(41.0) }),
            (Position::from_m(800.0, 3.0), RangeBearing { range_m: 391.0, bearing: Angle::from_deg(178.0) }),
        ];
        let (mut h, mut nu, mut r) = (Matrix6x2::zeros(), Vector6::zeros(), Matrix6::zeros());
        for (i, (uav, z)) in looks.iter().enumerate() {
            target.compare(&sensor(), *uav, z);
            let expected = sensor::measure(*uav, target.position);
            h.fixed_rows_mut::<2>(2 * i).copy_from(&sensor::jacobian(*uav, target.position).unwrap());
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

    /// 500 m too far, by a sensor that is held to be good to a millimetre, of a track that is good to 100 km: of the
    /// 2.5e11 that the millimetre makes of it all but (500 m / 100 km)^2 = 2.5e-5 is foreseen. From two UAVs that agree,
    /// the same; and from however many, whatever they say, never less than nothing.
    #[test]
    fn what_next_to_nothing_is_left_of_is_not_negative() {
        let sensor = SensorParams { range_sd_m: 1e-3, bearing_sd_rad: 1e-6, ..sensor() };
        let track = |uav: Position| {
            let wide = Matrix2::new(1e10, 0.0, 0.0, 1e10);
            Foretold::at(uav + Displacement::from_polar(400.0, Angle::from_rad(0.7)), &wide)
        };
        let uav = Position::from_m(1000.0, -300.0);
        let mut target = track(uav);
        target.compare(&sensor, uav, &RangeBearing { range_m: 900.0, bearing: Angle::from_rad(0.7) });
        assert!((target.squares.sum / 2.5e-5 - 1.0).abs() < 1e-6, "{}", target.squares.sum);
        for n in 1..200 {
            let mut target = track(uav);
            for other in 0..3 {
                let from = uav + Displacement::from_m(f64::from(n * other), f64::from(7 * other));
                let range_m = 900.0 + f64::from(n);
                target.compare(&sensor, from, &RangeBearing { range_m, bearing: Angle::from_rad(0.7) });
            }
            assert!(target.squares.sum >= 0.0 && target.squares.sum.is_finite(), "{n}: {}", target.squares.sum);
        }
    }

    /// A number too large for the sum is told as none.
    #[test]
    fn what_numbers_do_not_hold_has_no_mean() {
        let rules = Rules::of(&Template::of_text("drawn", "[[targets.at]]\n", None).unwrap().draw(1).unwrap().settings);
        let mut innovations = Innovations::new(&rules);
        assert_eq!(innovations.value(), None);
        innovations.squares = Mean { sum: 7.0, n: 2 };
        assert_eq!(innovations.value(), Some(3.5));
        innovations.squares.sum = f64::INFINITY;
        assert_eq!(innovations.value(), None);
    }

    #[test]
    fn a_variance_below_zero_is_rounding() {
        assert_eq!(lower_root(&Matrix2::new(4.0, 2.0, 2.0, 1.0 - 1e-17)), Matrix2::new(2.0, 0.0, 1.0, 0.0));
        assert_eq!(lower_root(&Matrix2::new(0.0, 0.0, 0.0, -1e-20)), Matrix2::zeros());
    }
}
