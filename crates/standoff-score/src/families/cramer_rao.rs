//! Posterior Cramer-Rao bound: the smallest covariance that any unbiased estimate of a target can have, given the UAV
//! positions and the measurements so far.
//!
//! ```text
//! J_0 = P_0^-1       J_{k+1} = (F J_k^-1 F' + Q)^-1 + sum_i H_i' R^-1 H_i
//! ```
//!
//! (Tichavsky, Muravchik, Nehorai 1998.) F, Q and R are those of the simulated world, and P_0 is that of the cue. H is
//! evaluated at the true positions, and the sum runs over the detections of the time step. The bound covers the actual
//! geometry and measurements only: it does not use the information that an undetected target was out of view.

use nalgebra::Matrix2;
use standoff::target::Transition;
use standoff::{Covariance, Duration, Position, SensorParams};
use standoff_record::Frame;

use crate::by_id::ById;
use crate::config::ScoreConfig;
use crate::geometry::{at, position};
use crate::matching::Matching;
use crate::mean::Mean;
use crate::metric::{BOTH, Family, Metric, MetricSet, NEITHER, metric};
use crate::step::Step;

/// Compares the estimates of group members with the Cramer-Rao bound of `docs/user/metrics.md`, frame by frame.
#[derive(Debug, Clone)]
pub struct Bound {
    transition: Transition,
    sensor: SensorParams,
    /// Covariance P_0 of a cue.
    cue: Covariance,
    /// Inverse J^-1 of every target, by target id.
    covariances: ById<Covariance>,
    /// Information of the measurements of the current time step, by target id.
    measured: ById<Matrix2<f64>>,
    /// True if a covariance was not representable, because prior and measurement accuracy differ too much.
    is_lost: bool,
    position: Efficiency,
    velocity: Efficiency,
}

impl Bound {
    /// Returns `None` if no bound is defined: if the targets follow no model, or if the measurements have no noise or
    /// less than a filter may assume.
    #[must_use]
    pub fn of(config: &ScoreConfig) -> Option<Self> {
        let (motion, noise) = (config.motion?, config.noise);
        let sensor =
            SensorParams { range_sd_m: noise.range_sd_m, bearing_sd_rad: noise.bearing_sd_rad, ..config.sensor };
        if !sensor.out_of_range().is_empty() {
            return None;
        }
        let of_axis = [config.cue.position_sd_m, config.cue.velocity_sd_m_s, motion.acceleration_sd_m_s2];
        Some(Self {
            transition: motion.transition(Duration::from_s(config.period_s)),
            sensor,
            cue: Covariance::from_diagonal(std::array::from_fn(|i| of_axis[i % 3] * of_axis[i % 3])),
            covariances: ById::default(),
            measured: ById::default(),
            is_lost: false,
            position: Efficiency::default(),
            velocity: Efficiency::default(),
        })
    }

    /// Adds the next frame, with its targets and tracks.
    pub fn frame(&mut self, frame: &Frame, matching: &Matching<'_>) {
        self.measured.clear();
        for (uav, target, truth) in known_detections(frame, matching) {
            *self.measured.entry(target, Matrix2::zeros) += self.sensor.information(uav, truth);
        }
        for (truth, track) in matching.targets() {
            let mut is_first = false;
            let covariance = self.covariances.entry(truth.target, || {
                is_first = true;
                self.cue
            });
            if !is_first {
                self.transition.predict_covariance(covariance);
            }
            if let Some(information) = self.measured.get_mut(truth.target) {
                covariance.add_position_information(information);
            }
            let [x, vx, ax, y, vy, ay] = covariance.variances();
            self.is_lost |= ![x, vx, ax, y, vy, ay].iter().all(|variance| *variance >= 0.0 && variance.is_finite());
            if let Some(track) = track.filter(|track| track.group.is_some()) {
                let [x_m, vx_m_s, _, y_m, vy_m_s, _] = track.state;
                self.position.add([x_m - truth.x_m, y_m - truth.y_m], x + y);
                self.velocity.add([vx_m_s - truth.vx_m_s, vy_m_s - truth.vy_m_s], vx + vy);
            }
        }
    }

    /// Returns the smallest mean squared position error of an unbiased estimate of a target, m2: the trace of the
    /// position block.
    #[must_use]
    pub fn position_m2(&self, target: u32) -> Option<f64> {
        Some(self.covariances.get(target).filter(|_| !self.is_lost)?.position().trace())
    }

    /// Returns the efficiencies of position and velocity, empty if the bound was not representable.
    fn efficiencies(&self) -> [Efficiency; 2] {
        if self.is_lost { Default::default() } else { [self.position, self.velocity] }
    }
}

/// Estimates compared with their bound, if it is defined; outer `None` before the first time step.
#[derive(Debug, Default)]
pub(crate) struct CramerRao(Option<Option<Bound>>);

impl CramerRao {
    /// Returns the efficiencies of position and velocity.
    fn efficiencies(&self) -> [Efficiency; 2] {
        self.0.iter().flatten().next().map(Bound::efficiencies).unwrap_or_default()
    }
}

/// Ratios pooled over runs as the square root of the ratio of two means: ratio, numerator, denominator. Selecting the
/// ratio selects all three.
pub(crate) const POOLED: [(&str, &str, &str); 2] = [
    ("position_crlb_ratio", "position_squared_error_m2", "position_crlb_m2"),
    ("velocity_crlb_ratio", "velocity_squared_error_m2_s2", "velocity_crlb_m2_s2"),
];

impl Family for CramerRao {
    const SECTION: &'static str = "Estimation";
    const SET: MetricSet = MetricSet::Limits;
    const METRICS: &'static [Metric<Self>] = &[
        metric(POOLED[0].0, "position error / Cramer-Rao bound", NEITHER, 0.01, BOTH, |of, _| {
            of.efficiencies()[0].ratio()
        }),
        metric(POOLED[1].0, "velocity error / Cramer-Rao bound", NEITHER, 0.01, BOTH, |of, _| {
            of.efficiencies()[1].ratio()
        }),
        metric(POOLED[0].1, "mean squared position error", NEITHER, 1.0, BOTH, |of, _| {
            of.efficiencies()[0].squared_error.value()
        }),
        metric(POOLED[0].2, "Cramer-Rao bound of the position", NEITHER, 1.0, BOTH, |of, _| {
            of.efficiencies()[0].bound.value()
        }),
        metric(POOLED[1].1, "mean squared velocity error", NEITHER, 0.1, BOTH, |of, _| {
            of.efficiencies()[1].squared_error.value()
        }),
        metric(POOLED[1].2, "Cramer-Rao bound of the velocity", NEITHER, 0.1, BOTH, |of, _| {
            of.efficiencies()[1].bound.value()
        }),
    ];

    fn add(&mut self, step: &Step<'_>) {
        if let Some(bound) = self.0.get_or_insert_with(|| Bound::of(step.config)) {
            bound.frame(step.frame, step.matching);
        }
    }
}

/// Returns every detection whose UAV and target are in the frame: UAV position, target id, true target position.
fn known_detections(frame: &Frame, matching: &Matching<'_>) -> impl Iterator<Item = (Position, u32, Position)> {
    frame.detections.iter().filter_map(|detection| {
        let uav = crate::matching::uav(frame, detection.uav)?;
        let truth = matching.target(detection.target?)?;
        Some((at(uav), truth.target, position(truth)))
    })
}

/// Squared errors and their bound over the same samples.
#[derive(Debug, Clone, Copy, Default)]
struct Efficiency {
    squared_error: Mean,
    bound: Mean,
}

impl Efficiency {
    /// Adds the errors of both axes and the bound of the sum of their squares.
    fn add(&mut self, [x, y]: [f64; 2], bound: f64) {
        self.squared_error.add(x * x + y * y);
        self.bound.add(bound);
    }

    /// Root of the ratio of the summed squared errors to the summed bound.
    fn ratio(&self) -> Option<f64> {
        Some((self.squared_error.value()? / self.bound.value()?).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::score_config;
    use crate::row_fixtures::{track_row, truth_row, uav_row};
    use crate::{CueError, Noise};
    use standoff::{Angle, Displacement, TargetParams};
    use standoff_record::{DetectionRow, TrackRow, TruthRow, UavRow};

    /// Sensor of Table I, cues of 20 m and 2 m/s, and targets that follow the model.
    fn config(acceleration_sd_m_s2: f64) -> ScoreConfig {
        let motion = TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2 };
        let cue = CueError { position_sd_m: 20.0, velocity_sd_m_s: 2.0 };
        ScoreConfig { motion: Some(motion), cue, ..score_config() }
    }

    /// A cue of ten thousand kilometres with a range accuracy of a millimetre gives no bound instead of a negative one.
    #[test]
    fn unrepresentable_bound_is_none() {
        let of = |range_sd_m, position_sd_m| {
            let plain = config(0.0);
            let noise = Noise { range_sd_m, ..plain.noise };
            let cue = CueError { position_sd_m, velocity_sd_m_s: 2.0 };
            let mut bound = Bound::of(&ScoreConfig { noise, cue, period_s: 0.01, ..plain }).unwrap();
            (0..20).for_each(|tick| add(&mut bound, &frame(&[(150.0, f64::from(tick))])));
            (bound.position_m2(0).is_some(), bound.efficiencies().map(|one| one.ratio().is_some()))
        };
        assert_eq!(of(10.0, 16.0), (true, [true; 2]));
        assert_eq!(of(0.001, 1e7), (false, [false; 2]));
    }

    fn add(bound: &mut Bound, frame: &Frame) {
        bound.frame(frame, &Matching::of(frame));
    }

    /// Target at the origin, detected by UAVs at `ranges_and_phases`, with a track error of 3 m and 4 m, 1 m/s and 0.
    fn frame(ranges_and_phases: &[(f64, f64)]) -> Frame {
        let mut frame = Frame {
            truth: vec![TruthRow { ax_m_s2: Some(0.0), ay_m_s2: Some(0.0), ..truth_row(0, 0.0, 0.0) }],
            tracks: vec![TrackRow { state: [3.0, 1.0, 9.0, -4.0, 0.0, 9.0], ..track_row(0, Some(0)) }],
            ..Frame::default()
        };
        for (uav, (range_m, phase_rad)) in (0..).zip(ranges_and_phases) {
            let at = Displacement::from_polar(*range_m, Angle::from_rad(*phase_rad));
            frame.uavs.push(UavRow { x_m: at.x_m(), y_m: at.y_m(), ..uav_row(uav) });
            frame.detections.push(DetectionRow { uav, target: Some(0), range_m: *range_m, ..DetectionRow::default() });
        }
        frame
    }

    /// Root mean bound of position and velocity over 1,200 scans from an orbit at 40 m/s in steady state; UAVs a right
    /// angle apart.
    fn on_orbit(acceleration_sd_m_s2: f64, uavs: u32, radius_m: f64) -> [f64; 2] {
        let mut bound = Bound::of(&config(acceleration_sd_m_s2)).unwrap();
        for scan in 0..1300 {
            let phase_rad = f64::from(scan) * 0.5 * 40.0 / radius_m;
            let phases: Vec<_> =
                (0..uavs).map(|uav| (radius_m, phase_rad + f64::from(uav) * std::f64::consts::FRAC_PI_2)).collect();
            let mut frame = frame(&phases);
            if scan < 100 {
                frame.tracks.clear();
            }
            add(&mut bound, &frame);
        }
        bound.efficiencies().map(|efficiency| efficiency.bound.value().unwrap().sqrt())
    }

    /// Reference values of an independent program (NumPy, information form), to the printed precision.
    #[test]
    fn bound_on_an_orbit_equals_an_independent_computation() {
        let cases = [(1, 250.0), (1, 400.0), (2, 250.0), (2, 400.0)];
        let table = [
            (0.1, [[5.79, 1.02], [7.29, 1.12], [4.29, 0.88], [4.76, 0.92]]),
            (0.3, [[7.11, 1.93], [9.12, 2.15], [5.23, 1.64], [5.81, 1.73]]),
            (2.0, [[9.70, 5.39], [12.72, 6.14], [7.02, 4.51], [7.83, 4.79]]),
        ];
        for (acceleration_sd_m_s2, expected) in table {
            for ((uavs, radius_m), expected) in cases.into_iter().zip(expected) {
                let got = on_orbit(acceleration_sd_m_s2, uavs, radius_m);
                for (got, expected) in got.into_iter().zip(expected) {
                    let what = format!("{acceleration_sd_m_s2} m/s2, {uavs} UAVs, {radius_m} m");
                    assert!((got / expected - 1.0).abs() < 0.01, "{what}: {got}, not {expected}");
                }
            }
        }
    }

    /// 10 m along and 400 m times 3 degrees across the line of sight: 23.2 m for one UAV. With two UAVs a right angle
    /// apart, each axis has both: 12.8 m. The prior is a cue of 100 km.
    #[test]
    fn single_scan_measures_range_along_and_bearing_across() {
        let nowhere = ScoreConfig { cue: CueError { position_sd_m: 1e5, velocity_sd_m_s: 2.0 }, ..config(0.05) };
        let along_m2 = 100.0;
        let across_m2 = (400.0 * 3f64.to_radians()) * (400.0 * 3f64.to_radians());
        let both_m2 = 1.0 / (1.0 / along_m2 + 1.0 / across_m2);
        for (phases, expected_m2) in
            [(vec![0.7], along_m2 + across_m2), (vec![0.7, 0.7 + std::f64::consts::FRAC_PI_2], 2.0 * both_m2)]
        {
            let mut bound = Bound::of(&nowhere).unwrap();
            add(&mut bound, &frame(&phases.iter().map(|phase| (400.0, *phase)).collect::<Vec<_>>()));
            let [position, velocity] = bound.efficiencies();
            assert!((position.bound.value().unwrap() / expected_m2 - 1.0).abs() < 1e-6);
            assert!((velocity.bound.value().unwrap() - 8.0).abs() < 1e-9, "4 m2/s2 per axis, as cued");
        }
    }

    /// Position error of 3 m and 4 m for a cue of 20 m per axis, velocity error of 1 m/s for 2 m/s, no measurements:
    /// 5/sqrt(800) and 1/sqrt(8). Targets that never accelerate have a bound too.
    #[test]
    fn ratio_is_the_root_of_squared_error_over_bound() {
        let mut bound = Bound::of(&config(0.0)).unwrap();
        add(&mut bound, &frame(&[]));
        let [position, velocity] = bound.efficiencies().map(|efficiency| efficiency.ratio().unwrap());
        assert!((position - (25.0f64 / 800.0).sqrt()).abs() < 1e-15);
        assert!((velocity - (1.0f64 / 8.0).sqrt()).abs() < 1e-15);
        add(&mut bound, &frame(&[(400.0, 0.0)]));
        let [position, _] = bound.efficiencies();
        assert!(position.bound.value().unwrap() < 0.75 * 800.0, "the scan must reduce the bound");
    }

    #[test]
    fn no_bound_without_a_model_or_without_noise() {
        assert!(Bound::of(&ScoreConfig { motion: None, ..config(0.05) }).is_none());
        for noise in
            [Noise { range_sd_m: 0.0, ..config(0.05).noise }, Noise { bearing_sd_rad: 0.0, ..config(0.05).noise }]
        {
            assert!(Bound::of(&ScoreConfig { noise, ..config(0.05) }).is_none());
        }
    }
}
