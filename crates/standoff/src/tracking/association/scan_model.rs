//! Sensor model of one scan for detections without label: where and how fast a target must be to be detected, how likely
//! a detection is of a target with a given estimate, and how many false alarms to expect.

use nalgebra::{Vector2, Vector6};

use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::math::{self, PI, TAU};
use crate::message::{Detection, Report};
use crate::params::{RANGE_MIN_M, SensorParams};
use crate::sensor::{self, FALSE_ALARM_SPEED_MAX_M_S};
use crate::tracking::estimate::{Estimate, LinearMeasurement, Mixture};
use crate::tracking::motion_modes::{MODES, MotionModes};
use crate::tracking::near_update::NearMeasurement;
use crate::tracking::pose_error::{PoseError, PoseVariance};
use crate::uav::UavState;

/// Largest squared distance of a detection from its prediction, in standard deviations, at which they are associated:
/// 99.9 % of the detections of a target with three measured values are nearer.
pub const GATE: f64 = 16.3;

/// Probability of being in the blind zone above which a target is certainly not detected.
const SURELY_BLIND: f64 = 0.99;

/// Largest probability of detection, and least number of false alarms of a scan, that the tracker assumes: no sensor is
/// so perfect that a single scan decides whether a target exists.
const DETECTION_PROBABILITY_MAX: f64 = 0.98;
const FALSE_ALARMS_MIN: f64 = 0.1;

/// Number of standard deviations out of view beyond which a target is certainly out of view.
const OUT_OF_VIEW_SDS: f64 = 6.0;

/// A scan, as seen by the sensor model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScanModel<'a> {
    sensor: &'a SensorParams,
    /// Error of the UAV's pose; `None` if it is exact.
    pose_error: Option<PoseError>,
    uav: &'a UavState,
    boresight: Angle,
    /// Density of false alarms and of new targets with any radial speed, per m2.
    background_per_m2: [f64; 2],
    /// Variance parameter of the blind zone, m2/s2; 0: no blind zone.
    blind_variance: f64,
}

/// Visibility of a target in a scan under each motion model; `None` if it is certainly out of view.
pub(crate) type Views = [Option<View>; MODES];

/// How a target with a given estimate meets a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    /// Probability that it is in view.
    in_view: f64,
    /// Probability that it would be detected if it moved fast.
    if_fast: f64,
    /// Probability that it is in the blind zone.
    blind: f64,
    /// Expected measurement.
    range_m: f64,
    bearing: Angle,
    /// Unit vector of the line of sight.
    unit: Vector2<f64>,
    /// Variances of range (m2) and bearing (rad2), with those of the sensor.
    variances: [f64; 2],
}

impl View {
    /// True if it is more probably in view than not.
    pub(crate) fn is_in_view(&self) -> bool {
        self.in_view > 0.5
    }

    /// Probability that it is detected.
    pub(crate) fn detection_probability(&self) -> f64 {
        self.if_fast * (1.0 - self.blind)
    }
}

/// A detection conditioned on being of a target, under one motion model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Index of the motion model.
    pub(crate) mode: usize,
    /// Estimate of the target, if the detection is of it.
    pub(crate) posterior: Estimate,
    /// Probability of the model, times the density of the detection if the target exists.
    pub(crate) weight: f64,
}

impl<'a> ScanModel<'a> {
    /// Model of the scan of a report; `None` if the sensor did not scan.
    pub(crate) fn new(sensor: &'a SensorParams, pose_error: Option<PoseError>, report: &'a Report) -> Option<Self> {
        let area_m2 = sensor.area_m2();
        Some(Self {
            sensor,
            pose_error,
            uav: &report.state,
            boresight: report.boresight?,
            background_per_m2: [false_alarms_per_scan(sensor) / area_m2, sensor.new_targets_per_scan / area_m2],
            blind_variance: sensor.blind_variance(),
        })
    }

    /// Position of the UAV.
    pub(crate) fn uav_position(&self) -> Position {
        self.uav.position
    }

    /// Returns how a target meets the scan under each of its motion models.
    pub(crate) fn views(&self, modes: &MotionModes) -> Views {
        modes
            .all()
            .each_ref()
            .map(|(probability, estimate)| (*probability > 0.0).then(|| self.view(estimate)).flatten())
    }

    fn view(&self, target: &Estimate) -> Option<View> {
        let SensorParams { sensing_range_m, detection_probability, .. } = *self.sensor;
        let sd_max_m = (target.covariance[(0, 0)] + target.covariance[(3, 3)]).sqrt();
        let furthest_m = sensing_range_m + OUT_OF_VIEW_SDS * sd_max_m;
        if self.uav.position.squared_distance_m2(target.state.position()) > furthest_m * furthest_m {
            return None;
        }
        let expected = sensor::measure(self.uav.position, target.state.position());
        let range_m = expected.range_m;
        let unit = direction(expected.bearing);
        let variance_along = |unit: &Vector2<f64>| target.project(&position_row(unit)).1.max(1e-6);
        let [along, across] = [unit, Vector2::new(-unit.y, unit.x)].map(|unit| variance_along(&unit));
        let off_edge_rad = (expected.bearing - self.boresight).abs_rad() - self.sensor.half_field_of_view_rad();
        let beyond = [(range_m - sensing_range_m) / along.sqrt(), off_edge_rad * range_m / across.sqrt()];
        if range_m < RANGE_MIN_M || beyond.iter().any(|sds| *sds > OUT_OF_VIEW_SDS) {
            return None;
        }
        let in_view = beyond.map(|sds| if sds < -OUT_OF_VIEW_SDS { 1.0 } else { normal_below(-sds) }).iter().product();
        let [of_range, of_bearing] = self.sensor.measurement_variances(range_m);
        Some(View {
            in_view,
            if_fast: detection_probability.min(DETECTION_PROBABILITY_MAX) * in_view,
            blind: self.blind_probability(target, &unit).0,
            range_m,
            bearing: expected.bearing,
            unit,
            variances: [along + of_range, across / (range_m * range_m) + of_bearing],
        })
    }

    /// Probability that a target is in the blind zone, and the pseudo-measurement of its radial speed if it is.
    fn blind_probability(&self, target: &Estimate, unit: &Vector2<f64>) -> (f64, LinearMeasurement) {
        let variance = self.blind_variance;
        let blind = LinearMeasurement { h: velocity_row(unit), value: 0.0, variance, heading_derivative: 0.0 };
        if variance <= 0.0 {
            return (0.0, blind);
        }
        let (mean, spread) = target.project(&blind.h);
        let total = spread.max(0.0) + variance;
        ((variance / total).sqrt() * math::exp(-0.5 * mean * mean / total), blind)
    }

    /// Range of indices of the detections that can be of a target; `detections` are in their canonical order, and so by
    /// ascending range.
    pub(crate) fn possible(&self, views: &Views, detections: &[Detection]) -> core::ops::Range<usize> {
        let mut within = (f64::INFINITY, f64::NEG_INFINITY);
        for view in views.iter().flatten() {
            let off_m = (GATE * view.variances[0]).sqrt();
            within = (within.0.min(view.range_m - off_m), within.1.max(view.range_m + off_m));
        }
        let start = detections.partition_point(|detection| detection.measurement.range_m < within.0);
        let count = detections[start..].partition_point(|detection| detection.measurement.range_m <= within.1);
        start..start + count
    }

    /// Conditions a target under each motion model on a detection, and adds the possible results. Returns the density of
    /// the detection over all models, if the target exists.
    pub(crate) fn add_hits(
        &self,
        modes: &MotionModes,
        views: &Views,
        detection: &Detection,
        hits: &mut Vec<Hit>,
    ) -> f64 {
        let mut density = 0.0;
        for (mode, (view, (probability, estimate))) in views.iter().zip(modes.all()).enumerate() {
            if let Some((posterior, of_mode)) = view.as_ref().and_then(|view| self.hit(estimate, view, detection)) {
                density += probability * of_mode;
                hits.push(Hit { mode, posterior, weight: probability * of_mode });
            }
        }
        density
    }

    /// Estimate of a target conditioned on a detection, and the density of the detection if the target exists.
    fn hit(&self, target: &Estimate, view: &View, detection: &Detection) -> Option<(Estimate, f64)> {
        let off_m = detection.measurement.range_m - view.range_m;
        let off_rad = (detection.measurement.bearing - view.bearing).rad();
        // Most detections are far off, and a stopped target is rarely detected; these tests are cheap.
        if view.blind > SURELY_BLIND
            || off_m * off_m > GATE * view.variances[0]
            || off_rad * off_rad > GATE * view.variances[1]
        {
            return None;
        }
        let mut posterior = *target;
        let (mut squared_distance, mut variances) = (0.0, 1.0);
        let measurements = match self.update_near(&mut posterior, detection) {
            None => self.linearised_at(target, view, detection),
            Some(density) => {
                variances = 1.0 / (density * density);
                [None, None, self.linearised_at(&posterior, &self.view(&posterior)?, detection)[2]]
            }
        };
        for measurement in measurements.into_iter().flatten() {
            let (squared, variance) = match self.pose_variance(&measurement) {
                None => posterior.condition(&measurement),
                Some(of_pose) => posterior.condition_with_pose_error(&measurement, &of_pose),
            };
            squared_distance += squared;
            variances *= TAU * variance;
            if squared_distance > GATE {
                return None;
            }
        }
        let density = view.if_fast * math::exp(-0.5 * squared_distance) / variances.sqrt();
        let (blind, at_zero) = self.blind_probability(&posterior, &view.unit);
        // A detected target is not in the blind zone.
        if blind > 0.0 && blind < SURELY_BLIND {
            let mut stopped = posterior;
            stopped.condition(&at_zero);
            let mut moving = Mixture::about(posterior.state.0);
            moving.add(1.0, &posterior);
            moving.add(-blind, &stopped);
            posterior = moving.moments().unwrap_or(posterior);
        }
        Some((posterior, density * (1.0 - blind)))
    }

    fn is_nonlinear(&self, target: &Estimate) -> bool {
        let trace_m2 = || target.covariance[(0, 0)] + target.covariance[(3, 3)];
        self.sensor.is_nonlinear(self.uav.position, target.state.position(), trace_m2)
    }

    /// Updates a target with the range and bearing of a detection from nearby, and returns their density; `None` if they
    /// can be linearised.
    fn update_near(&self, target: &mut Estimate, detection: &Detection) -> Option<f64> {
        if !self.is_nonlinear(target) {
            return None;
        }
        let uav = self.uav.position;
        let prior = || target.position_covariance();
        let of_pose = self.sensor.pose_covariance(self.pose_error.as_ref(), uav, target.state.position(), prior);
        let near = NearMeasurement::new(self.sensor, uav, detection.measurement, of_pose);
        near.update(target)
    }

    /// Adds to a mixture the estimate of a target that was not detected, with `weight` times the probability of that.
    pub(crate) fn add_miss(&self, target: &Estimate, view: Option<&View>, weight: f64, mixture: &mut Mixture) {
        let Some(View { if_fast, blind, unit, .. }) = view else { return mixture.add(weight, target) };
        mixture.add(weight * (1.0 - if_fast), target);
        if if_fast * blind > 0.0 {
            let mut stopped = *target;
            stopped.condition(&self.blind_probability(target, unit).1);
            mixture.add(weight * if_fast * blind, &stopped);
        }
    }

    /// Density of false alarms at a detection, and of detections of new targets, in the units of [`Hit::weight`].
    pub(crate) fn background(&self, detection: &Detection) -> [f64; 2] {
        let unit = direction(detection.measurement.bearing);
        let per_speed = detection.range_rate_m_s.map_or(1.0, |rate_m_s| {
            let speed_m_s = rate_m_s + self.uav.velocity().vector().dot(&unit);
            let blur_m_s = self.sensor.range_rate_sd_m_s;
            let of_pose =
                self.pose_error.map_or(0.0, |error| error.of_value(0.0, self.speed_across_m_s(&unit)).total());
            let squared = speed_m_s * speed_m_s + (blur_m_s * blur_m_s + of_pose);
            // Integral of the blind probability over positive speeds.
            let blind_m_s = (0.5 * PI * self.blind_variance).sqrt().min(0.9 * FALSE_ALARM_SPEED_MAX_M_S);
            (1.0 - self.sensor.blind_probability(squared)) / (2.0 * (FALSE_ALARM_SPEED_MAX_M_S - blind_m_s))
        });
        // The area of an element dr dtheta is r dr dtheta.
        self.background_per_m2.map(|per_m2| per_m2 * detection.measurement.range_m * per_speed)
    }

    /// Range rate of a detection, linearised about the estimate of its target; `None` if it is not measured, or if the
    /// target is certainly not in view.
    pub(crate) fn range_rate(&self, target: &Estimate, detection: &Detection) -> Option<LinearMeasurement> {
        let view = self.view(target)?;
        let measurement = self.linearised_at(target, &view, detection)[2]?;
        let Some(of_pose) = self.pose_variance(&measurement) else { return Some(measurement) };
        measurement.with_pose_error(&of_pose, target)
    }

    /// Variance of a measured value due to the error of the UAV's pose; `None` if it is exact.
    fn pose_variance(&self, measurement: &LinearMeasurement) -> Option<PoseVariance> {
        let LinearMeasurement { h, heading_derivative, .. } = measurement;
        // All values depend on the position of the target relative to the UAV.
        Some(self.pose_error.as_ref()?.of_value(h[0] * h[0] + h[3] * h[3], *heading_derivative))
    }

    /// Speed of the UAV across a line of sight, m/s.
    fn speed_across_m_s(&self, unit: &Vector2<f64>) -> f64 {
        self.uav.velocity().vector().perp(unit)
    }

    /// Linearises a detection about the estimate of a target: range, bearing and, if measured, range rate.
    fn linearised_at(&self, target: &Estimate, view: &View, detection: &Detection) -> [Option<LinearMeasurement>; 3] {
        let SensorParams { range_sd_m, bearing_sd_rad, range_rate_sd_m_s, .. } = *self.sensor;
        let View { range_m, bearing, unit, .. } = *view;
        let z = &detection.measurement;
        let of = |h: Vector6<f64>, innovation: f64, sd: f64, heading_derivative: f64| {
            let value = h.dot(&target.state.0) + innovation;
            Some(LinearMeasurement { h, value, variance: sd * sd, heading_derivative })
        };
        let range = of(position_row(&unit), z.range_m - range_m, range_sd_m, 0.0);
        let across = Vector2::new(-unit.y, unit.x) / range_m;
        let bearing = of(position_row(&across), (z.bearing - bearing).rad(), bearing_sd_rad, 1.0);
        let rate = detection.range_rate_m_s.and_then(|rate_m_s| {
            let relative = target.state.velocity().vector() - self.uav.velocity().vector();
            let expected_m_s = relative.dot(&unit);
            // The rate also depends on the line of sight, and so on the position.
            let turning = (relative - unit * expected_m_s) / range_m;
            let h = velocity_row(&unit) + position_row(&turning);
            let mut rate = of(h, rate_m_s - expected_m_s, range_rate_sd_m_s, self.speed_across_m_s(&unit))?;
            if self.is_nonlinear(target) {
                // Variance of the second-order term: errors along and across the line of sight turn it together.
                let rows = [unit, Vector2::new(-unit.y, unit.x)].map(|direction| position_row(&direction));
                let [along, mixed, across] =
                    [(0, 0), (0, 1), (1, 1)].map(|(i, j)| rows[i].dot(&target.covariance.times(&rows[j])));
                rate.variance += turning.norm_squared() * (along * across + mixed * mixed) / (range_m * range_m);
            }
            Some(rate)
        });
        [range, bearing, rate]
    }
}

/// Number of false alarms of a scan that the tracker assumes.
fn false_alarms_per_scan(sensor: &SensorParams) -> f64 {
    sensor.false_alarms_per_scan.max(FALSE_ALARMS_MIN)
}

/// Probability that a detection of no known target is of a new one, and no false alarm.
pub(crate) fn new_target_fraction(sensor: &SensorParams) -> f64 {
    sensor.new_targets_per_scan / (sensor.new_targets_per_scan + false_alarms_per_scan(sensor))
}

/// Unit vector of a bearing.
fn direction(bearing: Angle) -> Vector2<f64> {
    Displacement::from_polar(1.0, bearing).vector()
}

/// Row that multiplies the position by a vector.
fn position_row(by: &Vector2<f64>) -> Vector6<f64> {
    Vector6::new(by.x, 0.0, 0.0, by.y, 0.0, 0.0)
}

/// Row that multiplies the velocity by a vector.
fn velocity_row(by: &Vector2<f64>) -> Vector6<f64> {
    Vector6::new(0.0, by.x, 0.0, 0.0, by.y, 0.0)
}

/// Distribution function of the standard normal distribution, to 0.01.
fn normal_below(sds: f64) -> f64 {
    1.0 / (1.0 + math::exp(-1.702 * sds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Time;
    use crate::covariance::Covariance;
    use crate::params::TeamParams;
    use crate::sensor::RangeBearingMeasurement;
    use crate::target::TargetState;
    use crate::uav::UavId;

    fn sensor() -> SensorParams {
        let sensor = TeamParams::paper().track.sensor;
        SensorParams { detection_probability: 0.9, mdv_m_s: 2.0, false_alarms_per_scan: 5.0, ..sensor }
    }

    /// A UAV at the origin that flies and looks east.
    fn report() -> Report {
        let state = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
        Report { boresight: Some(Angle::ZERO), ..Report::position_only(UavId(0), Time::EPOCH, state) }
    }

    /// A target 400 m east that drives east with `speed_m_s`, known to 2 m/s.
    fn target(speed_m_s: f64) -> Estimate {
        let mean = Vector6::new(400.0, speed_m_s, 0.0, 0.0, 1.0, 0.0);
        Estimate { state: TargetState(mean), covariance: Covariance::from_diagonal([9.0, 4.0, 0.1, 9.0, 1.0, 0.1]) }
    }

    /// Integrals over the radial speed: of the density times `probability`, and its mean and variance.
    fn integrated(target: &Estimate, probability: impl Fn(f64) -> f64) -> (f64, f64, f64) {
        let (mean, variance) = (target.state.0[1], target.covariance[(1, 1)]);
        let step = 0.002;
        let mut sums = [0.0; 3];
        for index in -10_000..10_000 {
            let speed = mean + step * f64::from(index);
            let off = speed - mean;
            let density = math::exp(-0.5 * off * off / variance) / (TAU * variance).sqrt() * step * probability(speed);
            sums.iter_mut().zip([1.0, speed, speed * speed]).for_each(|(sum, value)| *sum += density * value);
        }
        let mean = sums[1] / sums[0];
        (sums[0], mean, sums[2] / sums[0] - mean * mean)
    }

    /// The closed forms for detections and misses equal integrals of the detection probability.
    #[test]
    fn hits_and_misses_have_the_moments_of_the_exact_density() {
        let (sensor, report) = (sensor(), report());
        let model = ScanModel::new(&sensor, None, &report).unwrap();
        for speed_m_s in [0.0, 1.0, 3.0, 8.0] {
            let target = target(speed_m_s);
            let view = model.view(&target).unwrap();
            let (total, mean, variance) = integrated(&target, |speed| 1.0 - sensor.detection_probability_at(speed));
            assert!((view.detection_probability() - (1.0 - total)).abs() < 1e-6, "{speed_m_s}");
            let mut missed = Mixture::about(target.state.0);
            model.add_miss(&target, Some(&view), 1.0, &mut missed);
            let moments = missed.moments().unwrap();
            assert!((missed.weight() - total).abs() < 1e-6);
            assert!((moments.state.0[1] - mean).abs() < 1e-6 && (moments.covariance[(1, 1)] - variance).abs() < 1e-6);
            // A detection at the expected place.
            let measurement = RangeBearingMeasurement { range_m: 400.0, bearing: Angle::ZERO };
            let detection = Detection { label: None, measurement, range_rate_m_s: None };
            let (posterior, density) = model.hit(&target, &view, &detection).unwrap();
            let (total, mean, variance) = integrated(&target, |speed| sensor.detection_probability_at(speed));
            let [of_range, of_bearing] = view.variances;
            assert!((density - total / (TAU * (of_range * of_bearing).sqrt())).abs() < 1e-6 * density, "{speed_m_s}");
            assert!(
                (posterior.state.0[1] - mean).abs() < 1e-6 && (posterior.covariance[(1, 1)] - variance).abs() < 1e-6
            );
        }
    }

    /// The linearised range rate equals differences of the exact one.
    #[test]
    fn the_range_rate_is_linearised_in_position_and_velocity() {
        let (sensor, report) = (sensor(), report());
        let model = ScanModel::new(&sensor, None, &report).unwrap();
        let mut target = target(5.0);
        (target.state.0[0], target.state.0[3], target.state.0[4]) = (300.0, 150.0, -7.0);
        let rate = |of: &Vector6<f64>| {
            let to = Vector2::new(of[0], of[3]);
            (Vector2::new(of[1], of[4]) - Vector2::new(40.0, 0.0)).dot(&to) / to.norm()
        };
        let measurement = sensor::measure(Position::ORIGIN, target.state.position());
        let exact = rate(&target.state.0);
        let detection = Detection { label: None, measurement, range_rate_m_s: Some(exact) };
        let linear = model.range_rate(&target, &detection).unwrap();
        assert!((linear.value - linear.h.dot(&target.state.0)).abs() < 1e-9);
        for index in 0..6 {
            let mut moved = target.state.0;
            moved[index] += 1e-4;
            assert!(((rate(&moved) - exact) / 1e-4 - linear.h[index]).abs() < 1e-6, "{index}");
        }
    }

    /// The density of false alarms integrates to their number over the field of view and the radial speeds.
    #[test]
    fn the_background_integrates_to_the_number_of_false_alarms() {
        let (sensor, report) = (sensor(), report());
        let model = ScanModel::new(&sensor, None, &report).unwrap();
        let (ranges, speeds) = (100, 400);
        let mut sum = 0.0;
        for range in 0..ranges {
            let range_m = sensor.sensing_range_m * (f64::from(range) + 0.5) / f64::from(ranges);
            for speed in 0..speeds {
                let speed_m_s = FALSE_ALARM_SPEED_MAX_M_S * (2.0 * (f64::from(speed) + 0.5) / f64::from(speeds) - 1.0);
                let measurement = RangeBearingMeasurement { range_m, bearing: Angle::ZERO };
                let range_rate_m_s = Some(speed_m_s - 40.0);
                sum += model.background(&Detection { label: None, measurement, range_rate_m_s })[0];
            }
        }
        let cell = sensor.sensing_range_m / f64::from(ranges) * 2.0 * FALSE_ALARM_SPEED_MAX_M_S / f64::from(speeds);
        // The blur of the blind zone by the noise of the range rate is not normalised.
        assert!(
            (sum * cell * sensor.field_of_view_rad - 5.0).abs() < 0.05,
            "{}",
            sum * cell * sensor.field_of_view_rad
        );
    }

    /// A target leaves the view gradually, over its position uncertainty.
    #[test]
    fn the_probability_of_being_in_view_falls_across_the_edge() {
        let (sensor, report) = (sensor(), report());
        let model = ScanModel::new(&sensor, None, &report).unwrap();
        let at = |range_m: f64| {
            let mut target = target(10.0);
            target.state.0[0] = range_m;
            model.view(&target).map_or(0.0, |view| view.in_view)
        };
        let edge_m = sensor.sensing_range_m;
        assert!((at(edge_m) - 0.5).abs() < 1e-9 && at(edge_m - 20.0) == 1.0 && at(edge_m + 20.0) == 0.0);
        assert!((at(edge_m - 3.0) - 0.84).abs() < 0.01);
    }
}
