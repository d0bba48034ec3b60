//! The normalised innovation squared: what was measured against what the tracks foretold. It needs no truth.
//!
//! All measurements of a target at one instant are foretold from one estimate, so their innovations are correlated; they
//! are stacked: nu' S^-1 nu with S = H P H' + R, H and R those of all UAVs one below the other. With b = H' R^-1 nu,
//! I = H' R^-1 H and A the position block of the predicted P that is
//!
//! ```text
//! nu' S^-1 nu = nu' R^-1 nu - b' (1 + A I)^-1 A b
//! ```
//!
//! by the matrix inversion lemma: sums over the UAVs, and a 2x2 matrix however many they are.

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Vector2};
use standoff::{Angle, Covariance, Duration, Position, RangeBearing, SensorParams, TargetState, Transition, sensor};

use super::{Rules, at};
use crate::record::{Frame, TrackRow};

/// Normalised innovations squared of a run.
#[derive(Debug, Clone)]
pub(super) struct Innovations {
    transition: Transition,
    sensor: SensorParams,
    /// The tracks of the frame before.
    before: Vec<TrackRow>,
    sum: f64,
    /// How many numbers were measured.
    numbers: u64,
}

impl Innovations {
    pub(super) fn new(rules: &Rules) -> Self {
        Self {
            transition: rules.target.transition(Duration::from_s(rules.period_s)),
            sensor: rules.sensor,
            before: Vec::new(),
            sum: 0.0,
            numbers: 0,
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
            self.sum += target.normalised_square();
            self.numbers += target.numbers;
        }
        self.before.clone_from(&frame.tracks);
    }

    /// The mean per number measured.
    pub(super) fn value(&self) -> Option<f64> {
        (self.numbers > 0).then(|| self.sum / self.numbers as f64)
    }
}

/// Where a target was foretold, and what the measurements of this instant say of that.
struct Foretold {
    position: Position,
    /// A, m2.
    covariance: Matrix2<f64>,
    /// nu' R^-1 nu.
    square: f64,
    /// b, 1/m.
    vector: Vector2<f64>,
    /// I, 1/m2.
    information: Matrix2<f64>,
    numbers: u64,
}

impl Foretold {
    fn of(track: &TrackRow, transition: &Transition) -> Self {
        let mut p = Covariance::from_upper_triangle(&track.covariance);
        transition.predict_covariance(&mut p);
        Self {
            position: transition.predict(&TargetState(track.state.into())).position(),
            covariance: p.position(),
            square: 0.0,
            vector: Vector2::zeros(),
            information: Matrix2::zeros(),
            numbers: 0,
        }
    }

    /// The filter takes nothing from a measurement where the Jacobian does not exist, so neither does this.
    fn compare(&mut self, sensor: &SensorParams, uav: Position, z: &RangeBearing) {
        let Some(h) = sensor::jacobian(uav, self.position) else { return };
        let expected = sensor::measure(uav, self.position);
        let nu = Vector2::new(z.range_m - expected.range_m, (z.bearing - expected.bearing).rad());
        let weighted = sensor.noise_information() * nu;
        self.square += nu.dot(&weighted);
        self.vector += h.transpose() * weighted;
        self.information += h.transpose() * sensor.noise_information() * h;
        self.numbers += 2;
    }

    /// nu' S^-1 nu.
    fn normalised_square(&self) -> f64 {
        let damping = (Matrix2::identity() + self.covariance * self.information).try_inverse();
        let foreseen = damping.map_or(0.0, |damping| self.vector.dot(&(damping * self.covariance * self.vector)));
        self.square - foreseen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Matrix6x2, Vector6};

    fn sensor() -> SensorParams {
        SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 1.0,
            sensing_range_m: 1200.0,
        }
    }

    fn foretold() -> Foretold {
        Foretold {
            position: Position::from_m(400.0, 0.0),
            covariance: Matrix2::new(300.0, 0.0, 0.0, 44.0),
            square: 0.0,
            vector: Vector2::zeros(),
            information: Matrix2::zeros(),
            numbers: 0,
        }
    }

    /// 20 m too far at S = 300 m2 + (10 m)2 is one standard deviation; so is a bearing off by the root of 44 m2 over
    /// (400 m)2 plus (3 degrees)2.
    #[test]
    fn one_standard_deviation_in_range_and_in_bearing_is_two() {
        let mut target = foretold();
        let sd_rad = (44.0 / 160_000.0 + sensor().bearing_sd_rad * sensor().bearing_sd_rad).sqrt();
        let z = RangeBearing { range_m: 420.0, bearing: Angle::from_rad(-sd_rad) };
        target.compare(&sensor(), Position::ORIGIN, &z);
        assert!((target.normalised_square() - 2.0).abs() < 1e-12);
        assert_eq!(target.numbers, 2);
    }

    /// Three UAVs, one of them across the seam of the angles: the same as stacking all innovations and inverting S.
    #[test]
    fn it_equals_the_stacked_innovations() {
        let mut target = foretold();
        target.covariance = Matrix2::new(300.0, -70.0, -70.0, 44.0);
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
        let s = h * target.covariance * h.transpose() + r;
        let expected = nu.dot(&s.cholesky().unwrap().solve(&nu));
        assert!((target.normalised_square() / expected - 1.0).abs() < 1e-12);
        assert!(nu.amax() < 30.0 && nu[5].abs() < 0.1, "the bearing's innovation wraps");
        assert_eq!(target.numbers, 6);
    }
}
