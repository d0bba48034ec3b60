//! Sensor model of one scan for detections without label: where and how fast a target must be to be detected, how likely
//! a detection is of a target with a given estimate, and how many false alarms to expect.

use nalgebra::Vector6;

use crate::angle::Angle;
use crate::frame::Position;
use crate::math::{self, PI};
use crate::message::{Detection, Report};
use crate::params::{RANGE_MIN_M, SensorParams};
use crate::sensor::{self, FALSE_ALARM_SPEED_MAX_M_S};
use crate::tracking::gaussian::{Gaussian, LinearMeasurement, Mixture};
use crate::uav::UavState;

/// Largest squared distance of a detection from its prediction, in standard deviations: 99.9 % of the detections of a
/// target with three measured values are nearer.
const GATE: f64 = 16.3;

/// A scan, as seen by the sensor model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScanModel<'a> {
    pub(crate) sensor: &'a SensorParams,
    uav: &'a UavState,
    boresight: Angle,
    /// Density of false alarms and of new targets with any radial speed, per m2.
    false_alarms_per_m2: f64,
    new_targets_per_m2: f64,
    /// Variance parameter of the blind zone, m2/s2: a target is blind with the probability exp(-v^2 / 2 u^2); 0: none.
    blind_variance: f64,
}

/// How a target with a given estimate meets a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Visibility {
    /// Probability that it would be detected if it moved fast.
    if_fast: f64,
    /// Probability that it is in the blind zone.
    blind: f64,
    /// Row of the radial speed over ground.
    radial: Vector6<f64>,
}

impl Visibility {
    /// Probability that it is detected.
    pub(crate) fn detection_probability(&self) -> f64 {
        self.if_fast * (1.0 - self.blind)
    }
}

/// A detection conditioned on being of a target.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Estimate of the target, if the detection is of it.
    pub(crate) posterior: Gaussian,
    /// Probability density of the detection, if the target exists.
    pub(crate) density: f64,
}

impl<'a> ScanModel<'a> {
    /// Model of the scan of a report; `None` if the sensor did not scan.
    pub(crate) fn new(sensor: &'a SensorParams, report: &'a Report) -> Option<Self> {
        let boresight = report.boresight?;
        let area_m2 = sensor.area_m2();
        Some(Self {
            sensor,
            uav: &report.state,
            boresight,
            false_alarms_per_m2: sensor.false_alarms_per_scan / area_m2,
            new_targets_per_m2: sensor.new_targets_per_scan / area_m2,
            blind_variance: sensor.mdv_m_s * sensor.mdv_m_s / (2.0 * core::f64::consts::LN_2),
        })
    }

    /// Returns how a target meets the scan; `None` if it is certainly out of view.
    pub(crate) fn visibility(&self, target: &Gaussian) -> Option<Visibility> {
        let SensorParams { sensing_range_m, detection_probability, .. } = *self.sensor;
        let expected = sensor::measure(self.uav.position, position(target));
        let range_m = expected.range_m;
        if range_m < RANGE_MIN_M {
            return None;
        }
        let [along, across] = directions(&expected.bearing);
        let along_sd_m = target.project(&along).1.max(0.0).sqrt().max(1e-3);
        let across_sd_m = target.project(&across).1.max(0.0).sqrt().max(1e-3);
        let beyond_sds = (range_m - sensing_range_m) / along_sd_m;
        let edge_m = ((expected.bearing - self.boresight).abs_rad() - self.sensor.half_field_of_view_rad()) * range_m;
        let aside_sds = edge_m / across_sd_m;
        let sds = beyond_sds.max(aside_sds);
        if sds > 6.0 {
            return None;
        }
        let is_in_view = |sds: f64| if sds < -6.0 { 1.0 } else { logistic(-sds) };
        let if_fast = detection_probability * is_in_view(beyond_sds) * is_in_view(aside_sds);
        let radial = velocity_row(&expected.bearing);
        Some(Visibility { if_fast, blind: self.blind_probability(target, &radial).0, radial })
    }

    /// Probability that a target is in the blind zone, and the pseudo-measurement of its radial speed if it is.
    fn blind_probability(&self, target: &Gaussian, radial: &Vector6<f64>) -> (f64, LinearMeasurement) {
        let variance = self.blind_variance;
        let blind = LinearMeasurement { h: *radial, value: 0.0, variance };
        if variance <= 0.0 {
            return (0.0, blind);
        }
        let (mean, spread) = target.project(radial);
        let total = spread.max(0.0) + variance;
        ((variance / total).sqrt() * math::exp(-0.5 * mean * mean / total), blind)
    }

    /// Conditions a target on a detection; `None` if the detection is outside of its gate.
    pub(crate) fn hit(&self, target: &Gaussian, visibility: &Visibility, detection: &Detection) -> Option<Hit> {
        let mut posterior = *target;
        let mut density = visibility.if_fast;
        let mut squared_distance = 0.0;
        for measurement in self.linearised(target, detection)?.into_iter().flatten() {
            let (mean, variance) = posterior.project(&measurement.h);
            let innovation = measurement.value - mean;
            squared_distance += innovation * innovation / (variance + measurement.variance);
            if squared_distance > GATE {
                return None;
            }
            density *= posterior.condition(&measurement);
        }
        let (blind, at_zero) = self.blind_probability(&posterior, &visibility.radial);
        // A detected target is not in the blind zone.
        if blind > 0.0 && blind < 0.999 {
            let mut stopped = posterior;
            stopped.condition(&at_zero);
            let mut moving = Mixture::about(posterior.mean);
            moving.add(1.0, &posterior);
            moving.add(-blind, &stopped);
            posterior = moving.moments().unwrap_or(posterior);
        }
        Some(Hit { posterior, density: density * (1.0 - blind) })
    }

    /// Adds to a mixture, with weight `weight`, the estimate of a target that was not detected.
    pub(crate) fn add_miss(&self, target: &Gaussian, visibility: &Visibility, weight: f64, mixture: &mut Mixture) {
        let Visibility { if_fast, blind, radial } = visibility;
        let scale = weight / (1.0 - visibility.detection_probability()).max(1e-9);
        mixture.add(scale * (1.0 - if_fast), target);
        if if_fast * blind > 0.0 {
            let mut stopped = *target;
            stopped.condition(&self.blind_probability(target, radial).1);
            mixture.add(scale * if_fast * blind, &stopped);
        }
    }

    pub(crate) fn uav_position(&self) -> Position {
        self.uav.position
    }

    /// Density of false alarms at a detection, and of detections of new targets, in the units of [`Hit::density`].
    pub(crate) fn background(&self, detection: &Detection) -> [f64; 2] {
        let speed = detection.range_rate_m_s.map(|rate| rate + self.own_radial_speed_m_s(detection));
        // Of an area element of r dr dtheta.
        let per_area = detection.measurement.range_m;
        let per_speed = speed.map_or(1.0, |speed_m_s| {
            let blur = self.sensor.range_rate_sd_m_s;
            let in_mdv = speed_m_s * speed_m_s + blur * blur;
            let visible =
                if self.blind_variance > 0.0 { 1.0 - math::exp(-0.5 * in_mdv / self.blind_variance) } else { 1.0 };
            let band_m_s = FALSE_ALARM_SPEED_MAX_M_S - self.blind_half_width_m_s();
            visible / (2.0 * band_m_s)
        });
        [self.false_alarms_per_m2, self.new_targets_per_m2].map(|density| density * per_area * per_speed)
    }

    /// Integral of the blind probability over positive radial speeds, m/s.
    fn blind_half_width_m_s(&self) -> f64 {
        (0.5 * PI * self.blind_variance).sqrt().min(0.9 * FALSE_ALARM_SPEED_MAX_M_S)
    }

    /// Speed of the UAV towards a detection, m/s.
    fn own_radial_speed_m_s(&self, detection: &Detection) -> f64 {
        self.uav.velocity().vector().dot(&direction(&detection.measurement.bearing))
    }

    /// Linearises a detection about the estimate of a target: range, bearing and, if measured, range rate.
    pub(crate) fn linearised(
        &self,
        target: &Gaussian,
        detection: &Detection,
    ) -> Option<[Option<LinearMeasurement>; 3]> {
        let SensorParams { range_sd_m, bearing_sd_rad, range_rate_sd_m_s, .. } = *self.sensor;
        let expected = sensor::measure(self.uav.position, position(target));
        if expected.range_m < RANGE_MIN_M {
            return None;
        }
        let z = &detection.measurement;
        let [along, across] = directions(&expected.bearing);
        let across = across / expected.range_m;
        let of = |h: Vector6<f64>, innovation: f64, sd: f64| LinearMeasurement {
            h,
            value: h.dot(&target.mean) + innovation,
            variance: sd * sd,
        };
        let range = of(along, z.range_m - expected.range_m, range_sd_m);
        let bearing = of(across, (z.bearing - expected.bearing).rad(), bearing_sd_rad);
        let rate = detection.range_rate_m_s.map(|rate_m_s| {
            let unit = direction(&expected.bearing);
            let closing = nalgebra::Vector2::new(target.mean[1], target.mean[4]) - self.uav.velocity().vector();
            let expected_m_s = closing.dot(&unit);
            // The rate also depends on the line of sight.
            let turning = (closing - unit * expected_m_s) / expected.range_m;
            let h = Vector6::new(turning.x, unit.x, 0.0, turning.y, unit.y, 0.0);
            of(h, rate_m_s - expected_m_s, range_rate_sd_m_s)
        });
        Some([Some(range), Some(bearing), rate])
    }
}

fn position(target: &Gaussian) -> Position {
    Position::from_m(target.mean[0], target.mean[3])
}

fn direction(bearing: &Angle) -> nalgebra::Vector2<f64> {
    crate::frame::Displacement::from_polar(1.0, *bearing).vector()
}

/// Rows of the position along a direction and to its left.
fn directions(bearing: &Angle) -> [Vector6<f64>; 2] {
    let unit = direction(bearing);
    [Vector6::new(unit.x, 0.0, 0.0, unit.y, 0.0, 0.0), Vector6::new(-unit.y, 0.0, 0.0, unit.x, 0.0, 0.0)]
}

/// Row of the velocity along a direction.
fn velocity_row(bearing: &Angle) -> Vector6<f64> {
    let unit = direction(bearing);
    Vector6::new(0.0, unit.x, 0.0, 0.0, unit.y, 0.0)
}

/// Distribution function of the standard normal distribution, approximated to 0.01.
fn logistic(sds: f64) -> f64 {
    1.0 / (1.0 + math::exp(-1.702 * sds))
}
