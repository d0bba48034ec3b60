//! Sensor model: noisy detections of the targets in view, and cues of targets that appear.

use standoff::{Angle, Cue, Detection, Position, SensorParams, Time, UavId, Velocity};
use standoff_score::{CueError, Noise};

use crate::random::{Draws, Stream};
use crate::world::Truth;

/// Adds the detections of one scan: every target in view of the sensor of UAV `uav`, which points along `boresight`.
pub fn scan(
    uav: (UavId, Position),
    boresight: Angle,
    truth: &[Truth],
    sensor: &SensorParams,
    noise: Noise,
    (draws, tick): (Draws, u64),
    detections: &mut Vec<Detection>,
) {
    let (id, from) = uav;
    // In batches of four (SIMD); the last target fills up an incomplete batch.
    for four in truth.chunks(4) {
        let targets: [_; 4] = core::array::from_fn(|i| four[i.min(four.len() - 1)].state.position());
        for (truth, seen) in four.iter().zip(sensor.measure_batch(from, boresight, targets)) {
            let Some(mut measurement) = seen else { continue };
            // The random key consists of UAV and target, so that further UAVs and targets do not change this noise.
            let object = (u64::from(id.0) << 32) | u64::from(truth.target.0);
            let [range, bearing] = draws.at(Stream::Measurement, object, tick).normals();
            measurement.range_m += noise.range_sd_m * range;
            measurement.bearing = measurement.bearing + Angle::from_rad(noise.bearing_sd_rad * bearing);
            if measurement.range_m > 0.0 {
                detections.push(Detection { label: Some(truth.target.label()), measurement, range_rate_m_s: None });
            }
        }
    }
}

/// Creates the cue of a target that has just appeared.
pub fn cue(target: &Truth, now: Time, error: CueError, draws: Draws) -> Cue {
    let mut draw = draws.at(Stream::Cue, u64::from(target.target.0), 0);
    let [x, y] = draw.normals().map(|normal| normal * error.position_sd_m);
    let [vx, vy] = draw.normals().map(|normal| normal * error.velocity_sd_m_s);
    let (position, velocity) = (target.state.position(), target.state.velocity());
    Cue {
        source: 0,
        issued_at: now,
        // Truncation is safe: the target ids of one time step differ by less than 2^16.
        sequence: target.target.0 as u16,
        label: Some(target.target.label()),
        time: now,
        position: Position::from_m(position.x_m() + x, position.y_m() + y),
        velocity: Velocity::from_m_s(velocity.x_m_s() + vx, velocity.y_m_s() + vy),
        position_sd_m: error.position_sd_m,
        velocity_sd_m_s: error.velocity_sd_m_s,
    }
}
