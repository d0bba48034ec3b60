//! Sensor model: noisy detections of the targets in view, false alarms, and cues of targets that appear.

use standoff::grid::Grid;
use standoff::sensor::FALSE_ALARM_SPEED_MAX_M_S;
use standoff::{
    Angle, Cue, Detection, Displacement, Position, RangeBearingMeasurement, SensorParams, Time, UavId, UavState,
    Velocity,
};
use standoff_score::{Buildings, CueError};

use crate::random::{Draws, Stream};
use crate::scenario::SensorModel;
use crate::target_id::TargetId;
use crate::world::Truth;

/// Detections of one scan. No agent knows their targets.
#[derive(Debug, Default)]
pub struct Detections {
    /// Detections.
    pub all: Vec<Detection>,
    /// Target of each detection; `None` for a false alarm.
    pub targets: Vec<Option<TargetId>>,
    /// Targets near the sensor; reused buffer.
    near: Vec<usize>,
}

impl Detections {
    /// Removes all.
    pub fn clear(&mut self) {
        self.all.clear();
        self.targets.clear();
    }

    fn push(&mut self, detection: Detection, target: Option<TargetId>) {
        self.all.push(detection);
        self.targets.push(target);
    }
}

/// A scan of the sensor of a UAV.
pub struct SensorScan<'a> {
    /// UAV.
    pub uav: UavId,
    /// True state of the UAV.
    pub state: &'a UavState,
    /// Direction of the sensor.
    pub boresight: Angle,
    /// Buildings that hide targets from it.
    pub buildings: &'a Buildings,
    /// Draws of the mission, and the number of the time step.
    pub draws: (Draws, u64),
}

impl SensorScan<'_> {
    /// Replaces `detections` by those of this scan. With labels they are in the order of the targets, otherwise in
    /// random order. `places` is the index of the targets' positions.
    pub fn detect(&self, sensor: &SensorModel, truth: &[Truth], places: &Grid, detections: &mut Detections) {
        detections.clear();
        self.detect_targets(sensor, truth, places, detections);
        self.add_false_alarms(sensor, detections);
        if !sensor.has_labels {
            let (draws, tick) = self.draws;
            // The same draws give both the same order.
            let order = || draws.at(Stream::DetectionOrder, self.uav.0.into(), tick);
            order().shuffle(&mut detections.all);
            order().shuffle(&mut detections.targets);
        }
    }

    /// Detects the targets in view.
    fn detect_targets(&self, sensor: &SensorModel, truth: &[Truth], places: &Grid, detections: &mut Detections) {
        let SensorModel { has_labels, truth: params, range_rate_sd_m_s } = sensor;
        let (draws, tick) = self.draws;
        let always_detects = sensor.always_detects();
        let mut buffer = std::mem::take(&mut detections.near);
        let mut near = places.near_ascending(self.state.position, params.sensing_range_m, &mut buffer);
        // In batches of four (SIMD); the first target fills up an incomplete batch.
        while let Some(first) = near.next() {
            let four: [_; 4] =
                core::array::from_fn(|i| if i == 0 { Some(first) } else { near.next() }.map(|index| &truth[index]));
            let targets = four.map(|target| target.unwrap_or(&truth[first]).state.position());
            let measurements = params.measure_batch(self.state.position, self.boresight, targets);
            for (truth, seen) in four.into_iter().flatten().zip(measurements) {
                let Some(mut measurement) = seen else { continue };
                let altitude_m = self.state.vertical.map(|vertical| vertical.altitude_m);
                if self.buildings.hide(truth.state.position(), self.state.position, altitude_m) {
                    continue;
                }
                // The random key consists of UAV and target, so that further UAVs and targets do not change this noise.
                let object = (u64::from(self.uav.0) << 32) | u64::from(truth.target.0);
                let (velocity, bearing) = (truth.state.velocity(), measurement.bearing);
                if !always_detects
                    && draws.at(Stream::Detection, object, tick).uniform()
                        >= params.detection_probability_at(radial_speed_m_s(velocity, bearing))
                {
                    continue;
                }
                let range_rate_m_s = range_rate_sd_m_s.map(|sd_m_s| {
                    let noise_m_s = sd_m_s * draws.at(Stream::RangeRate, object, tick).normal();
                    radial_speed_m_s(velocity, bearing) - self.own_radial_speed_m_s(bearing) + noise_m_s
                });
                let [range_noise, bearing_noise] = draws.at(Stream::Measurement, object, tick).normals();
                measurement.range_m += params.range_sd_m * range_noise;
                measurement.bearing = bearing + Angle::from_rad(params.bearing_sd_rad * bearing_noise);
                if measurement.range_m > 0.0 {
                    let label = has_labels.then(|| truth.target.label());
                    detections.push(Detection { label, measurement, range_rate_m_s }, Some(truth.target));
                }
            }
        }
        drop(near);
        detections.near = buffer;
    }

    /// Adds false alarms: a Poisson number, uniform over the area in view. Their radial speeds over ground are uniform
    /// in a band, and thinned by the detection probability of targets.
    fn add_false_alarms(&self, sensor: &SensorModel, detections: &mut Detections) {
        let SensorModel { truth: params, range_rate_sd_m_s, .. } = sensor;
        if params.false_alarms_per_scan <= 0.0 {
            return;
        }
        let thinning = SensorParams { detection_probability: 1.0, ..*params };
        let ((draws, tick), uav) = (self.draws, u64::from(self.uav.0));
        let count = draws.at(Stream::FalseAlarmCount, uav, tick).poisson(params.false_alarms_per_scan);
        for index in 0..count {
            let mut draw = draws.at(Stream::FalseAlarm, (uav << 32) | u64::from(index), tick);
            let range_m = params.sensing_range_m * (1.0 - draw.uniform()).sqrt();
            let bearing = self.boresight + Angle::from_rad(params.field_of_view_rad * (draw.uniform() - 0.5));
            let range_rate_m_s = range_rate_sd_m_s.map(|sd_m_s| {
                let noise_m_s = sd_m_s * draw.normal();
                let radial_speed_m_s = loop {
                    let speed_m_s = FALSE_ALARM_SPEED_MAX_M_S * (2.0 * draw.uniform() - 1.0);
                    if draw.uniform() < thinning.detection_probability_at(speed_m_s) {
                        break speed_m_s;
                    }
                };
                radial_speed_m_s - self.own_radial_speed_m_s(bearing) + noise_m_s
            });
            let measurement = RangeBearingMeasurement { range_m, bearing };
            detections.push(Detection { label: None, measurement, range_rate_m_s }, None);
        }
    }

    /// Speed of the UAV in a direction, m/s.
    fn own_radial_speed_m_s(&self, bearing: Angle) -> f64 {
        radial_speed_m_s(self.state.velocity(), bearing)
    }
}

/// Component of a velocity in a direction, m/s.
fn radial_speed_m_s(velocity: Velocity, bearing: Angle) -> f64 {
    velocity.vector().dot(&Displacement::from_polar(1.0, bearing).vector())
}

/// Creates the cue of a target that has just appeared.
pub fn cue(target: &Truth, now: Time, error: CueError, has_labels: bool, draws: Draws) -> Cue {
    let mut draw = draws.at(Stream::Cue, u64::from(target.target.0), 0);
    let [x, y] = draw.normals().map(|normal| normal * error.position_sd_m);
    let [vx, vy] = draw.normals().map(|normal| normal * error.velocity_sd_m_s);
    let (position, velocity) = (target.state.position(), target.state.velocity());
    Cue {
        source: 0,
        issued_at: now,
        // Truncation is safe: the target ids of one time step differ by less than 2^16.
        sequence: target.target.0 as u16,
        label: has_labels.then(|| target.target.label()),
        time: now,
        position: Position::from_m(position.x_m() + x, position.y_m() + y),
        velocity: Velocity::from_m_s(velocity.x_m_s() + vx, velocity.y_m_s() + vy),
        position_sd_m: error.position_sd_m,
        velocity_sd_m_s: error.velocity_sd_m_s,
        priority: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::load;
    use standoff::TargetState;
    use standoff::math;

    /// A sensor at the origin that flies north-east and points along `deg`, and what it detects at tick `tick`.
    fn detect(sensor: &SensorModel, truth: &[Truth], deg: f64, tick: u64) -> Vec<(Detection, Option<TargetId>)> {
        let state = UavState::level_flight(Position::ORIGIN, Angle::from_deg(45.0), 40.0);
        let (boresight, draws) = (Angle::from_deg(deg), (Draws::new(3), tick));
        let mut detections = Detections::default();
        let buildings = &Buildings::default();
        let places = Grid::of(truth.iter().map(|target| target.state.position()), 600.0);
        let scan = SensorScan { uav: UavId(2), state: &state, boresight, buildings, draws };
        scan.detect(sensor, truth, &places, &mut detections);
        detections.all.into_iter().zip(detections.targets).collect()
    }

    fn sensor(changes: &[&str]) -> SensorModel {
        load("paper/table-2-single", changes, 1).settings.sensor
    }

    fn target(id: u32, at_m: [f64; 2], velocity_m_s: [f64; 2]) -> Truth {
        let position = Position::from_m(at_m[0], at_m[1]);
        let state = TargetState::new(position, Velocity::from_m_s(velocity_m_s[0], velocity_m_s[1]), [0.0; 2]);
        Truth { target: TargetId(id), state, has_known_acceleration: true }
    }

    /// Targets east of the UAV: at a radial speed of the MDV half of p_d, at several MDV p_d, and across the line of
    /// sight never.
    #[test]
    fn targets_are_detected_with_the_probability_of_their_radial_speed() {
        let sensor = sensor(&["sensor.detection_probability=0.8", "sensor.mdv_m_s=2"]);
        let truth = [
            target(0, [400.0, 0.0], [-2.0, 5.0]),
            target(1, [500.0, 0.0], [12.0, 0.0]),
            target(2, [600.0, 0.0], [0.0, 15.0]),
        ];
        let scans = 4_000;
        let mut counts = [0u32; 3];
        for tick in 0..scans {
            for (_, of) in detect(&sensor, &truth, 0.0, tick) {
                counts[of.unwrap().0 as usize] += 1;
            }
        }
        for (count, expected) in counts.into_iter().zip([0.4, 0.8, 0.0]) {
            let fraction = f64::from(count) / scans as f64;
            assert!((fraction - expected).abs() < 5.0 * (0.25 / scans as f64).sqrt(), "{fraction}, not {expected}");
        }
    }

    /// A target that flies away at 7 m/s, 30 degrees left of a UAV that flies at 40 m/s: 7 - 40 cos(30 deg).
    #[test]
    fn range_rate_is_the_radial_speed_minus_that_of_the_uav() {
        let at = Displacement::from_polar(400.0, Angle::from_deg(75.0));
        let away = Displacement::from_polar(7.0, Angle::from_deg(75.0));
        let truth = [target(0, [at.x_m(), at.y_m()], [away.x_m(), away.y_m()])];
        let exact = sensor(&["sensor.range_rate_sd_m_s=0"]);
        let [(detection, Some(TargetId(0)))] = detect(&exact, &truth, 75.0, 1)[..] else { panic!() };
        assert!((detection.range_rate_m_s.unwrap() - (7.0 - 40.0 * 0.75f64.sqrt())).abs() < 1e-9);
        // The range rate changes no other number, and its noise has the given standard deviation.
        let (noisy, plain) = (sensor(&["sensor.range_rate_sd_m_s=2"]), sensor(&[]));
        let n = 4_000;
        let mut squares = 0.0;
        for tick in 0..n {
            let [[with], [without]] =
                [&noisy, &plain].map(|sensor| <[_; 1]>::try_from(detect(sensor, &truth, 75.0, tick)).unwrap());
            assert_eq!((with.0.measurement, without.0.range_rate_m_s), (without.0.measurement, None));
            let noise_m_s = with.0.range_rate_m_s.unwrap() - detection.range_rate_m_s.unwrap();
            squares += noise_m_s * noise_m_s;
        }
        assert!((squares / n as f64 / 4.0 - 1.0).abs() < 5.0 * (2.0 / n as f64).sqrt());
    }

    /// Half of the area in view is beyond 0.71 of the range, and half on each side of the boresight. No false alarm is
    /// slower than targets can be.
    #[test]
    fn false_alarms_are_uniform_over_the_area_in_view_and_thinned_by_the_mdv() {
        let changes =
            ["sensor.labels=none", "sensor.false_alarms_per_scan=5", "sensor.mdv_m_s=3", "sensor.range_rate_sd_m_s=0"];
        let sensor = sensor(&changes);
        let (scans, boresight) = (2_000, Angle::from_deg(170.0));
        let (mut n, mut far, mut left, mut slow, mut positive) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for tick in 0..scans {
            for (Detection { label, measurement, range_rate_m_s }, of) in detect(&sensor, &[], 170.0, tick) {
                assert_eq!((label, of), (None, None));
                let position = Position::ORIGIN + Displacement::from_polar(measurement.range_m, measurement.bearing);
                assert!(sensor.truth.in_view(Position::ORIGIN, boresight, position));
                let own_m_s = 40.0 * math::cos((measurement.bearing - Angle::from_deg(45.0)).rad());
                let speed_m_s = range_rate_m_s.unwrap() + own_m_s;
                assert!(speed_m_s.abs() < FALSE_ALARM_SPEED_MAX_M_S);
                n += 1.0;
                far += f64::from(measurement.range_m > sensor.truth.sensing_range_m * 0.5f64.sqrt());
                left += f64::from((measurement.bearing - boresight).rad() > 0.0);
                slow += f64::from(speed_m_s.abs() < 3.0);
                positive += f64::from(speed_m_s > 0.0);
            }
        }
        let expected = 5.0 * scans as f64;
        assert!((n - expected).abs() < 5.0 * expected.sqrt(), "{n}");
        for half in [far, left, positive] {
            assert!((half / n - 0.5).abs() < 5.0 * (0.25 / n).sqrt(), "{half} of {n}");
        }
        // The integral of 1 - exp(-ln 2 (v / 3)^2) from 0 to 3 m/s is 0.57 m/s, from 0 to 20 m/s it is 16.81 m/s.
        assert!((slow / n - 0.57 / 16.81).abs() < 5.0 * (0.034 / n).sqrt(), "{slow} of {n}");
    }

    /// Without labels the order of the detections does not depend on the targets' ids.
    #[test]
    fn only_unlabelled_detections_are_shuffled() {
        let truth: Vec<Truth> = (0..6).map(|id| target(id, [300.0 + 50.0 * f64::from(id), 0.0], [0.0; 2])).collect();
        let first = |sensor: &SensorModel| -> Vec<u32> {
            (0..600).map(|tick| detect(sensor, &truth, 0.0, tick)[0].1.unwrap().0).collect()
        };
        assert!(first(&sensor(&[])).iter().all(|id| *id == 0));
        let shuffled = first(&sensor(&["sensor.labels=none"]));
        assert!((0..6).all(|id| (60..140).contains(&shuffled.iter().filter(|first| **first == id).count())));
    }
}
