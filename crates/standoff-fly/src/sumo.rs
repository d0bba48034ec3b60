//! Targets from a running SUMO simulation: cues for its vehicles, and the detections of a simulated sensor.
//!
//! Coordinates of the net are metres east and north of the origin of the team's plane. The simulation runs in real time:
//! every client requests the same times, so that several programs can use one simulation.

use std::collections::BTreeSet;
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration as Wait, Instant};

use standoff::{Angle, Detection, Duration, PointingTarget, Position, SensorParams, TargetLabel, Time, Velocity};
use standoff_io::geodesy::LocalPlane;

use crate::companion::Companion;
use crate::feed::{FeedCue, FeedLine, FeedScan};
use crate::period::is_due;
use crate::traci::{Client, SumoVehicle, TraciError};
use crate::transport::resolve;

/// Shortest time between two requests to SUMO, s.
const PERIOD_S: f64 = 0.2;

/// Period of the scans of the simulated sensor.
const SCAN_PERIOD: Duration = Duration::from_us(200_000);

/// Time to wait for SUMO, which answers once all its clients have requested the same time.
const ANSWER_TIMEOUT: Wait = Wait::from_secs(60);

/// Time to wait for the end of the connection.
const CLOSE_TIMEOUT: Wait = Wait::from_secs(1);

/// Maximum number of vehicles that are cued and detected.
const VEHICLES_MAX: usize = 1000;

/// Standard deviations of the cues, m and m/s.
const CUE_SD: [f64; 2] = [20.0, 2.0];

/// A vehicle of the simulation in the team's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Target {
    label: TargetLabel,
    position: Position,
    velocity: Velocity,
}

impl Target {
    /// The label is a hash of the name (FNV-1a), so that all programs use the same.
    fn of(vehicle: &SumoVehicle) -> Self {
        let hash = vehicle
            .name
            .bytes()
            .fold(0x811C_9DC5, |hash: u32, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
        let [x_m, y_m] = vehicle.position_m;
        Self {
            label: TargetLabel(hash),
            position: Position::from_m(x_m, y_m),
            velocity: Velocity::from_polar(vehicle.speed_m_s, Angle::from_deg(90.0 - vehicle.course_deg)),
        }
    }
}

/// Vehicles of a step and the time at which they arrived, or why the connection has ended.
type Step = Result<(Instant, Vec<Target>), String>;

/// Sensor over the vehicles of a simulation.
pub(crate) struct Sumo {
    /// `None` once the connection is to be closed.
    steps: Option<Receiver<Step>>,
    thread: JoinHandle<()>,
    plane: LocalPlane,
    sensor: SensorParams,
    targets: Option<(Instant, Vec<Target>)>,
    cued: BTreeSet<TargetLabel>,
    scanned_at: Option<Time>,
    /// Last pointing target and its time.
    pointing: Option<(Time, PointingTarget)>,
}

impl Sumo {
    /// Connects to SUMO. `order` is the rank of this client, another one for each UAV.
    pub(crate) fn connect(address: &str, order: u32, plane: LocalPlane, sensor: SensorParams) -> std::io::Result<Self> {
        let stream = TcpStream::connect_timeout(&resolve(address)?, Wait::from_secs(5))?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        let (sender, steps) = sync_channel(4);
        let thread = thread::Builder::new().name("Sumo".to_owned()).spawn(move || {
            if let Err(error) = follow(stream, order, &sender) {
                let _ = sender.send(Err(error.to_string()));
            }
        })?;
        let steps = Some(steps);
        Ok(Self {
            steps,
            thread,
            plane,
            sensor,
            targets: None,
            cued: BTreeSet::new(),
            scanned_at: None,
            pointing: None,
        })
    }

    /// Cues and scans that are due, and the error that has ended the connection.
    pub(crate) fn lines(&mut self, now: Time, companion: &Companion) -> Result<Vec<FeedLine>, String> {
        while let Some(Ok(step)) = self.steps.as_ref().map(Receiver::try_recv) {
            self.targets = Some(step?);
        }
        let pointing = companion.output.pointing_target;
        if self.pointing.map(|(_, known)| known) != pointing {
            self.pointing = pointing.map(|pointing| (now, pointing));
        }
        let Some((at, targets)) = self.targets.as_ref().filter(|_| is_due(self.scanned_at, now, SCAN_PERIOD)) else {
            return Ok(Vec::new());
        };
        let Some(own) = companion.vehicle.state(now) else { return Ok(Vec::new()) };
        self.scanned_at = Some(now);
        let age_s = at.elapsed().as_secs_f64().min(ANSWER_TIMEOUT.as_secs_f64());
        let then = |target: &Target| Target { position: target.position + target.velocity * age_s, ..*target };
        let targets: Vec<Target> = targets.iter().map(then).collect();
        let boresight = self.pointing.map(|(at, pointing)| pointing.boresight(own.position, now - at));
        let mut lines = vec![FeedLine::Scan(scan(&self.sensor, own.position, boresight, &targets))];
        let team_state = companion.agent().team_state();
        for target in targets {
            // A cue can be rejected, for example before the agent has observed its own state.
            if team_state.track_by_label(target.label).is_none()
                && (self.cued.len() < VEHICLES_MAX || self.cued.contains(&target.label))
                && let Ok(point_deg) = self.plane.degrees_at(target.position)
            {
                self.cued.insert(target.label);
                lines.push(FeedLine::Cue(FeedCue {
                    label: Some(target.label),
                    point_deg,
                    velocity: target.velocity,
                    position_sd_m: CUE_SD[0],
                    velocity_sd_m_s: CUE_SD[1],
                    priority: None,
                    age: Duration::from_us(0),
                }));
            }
        }
        Ok(lines)
    }
}

impl Drop for Sumo {
    /// Closes the connection: if it ended otherwise, SUMO would end, too, and with it the targets of other programs.
    fn drop(&mut self) {
        self.steps = None;
        let begun_at = Instant::now();
        while !self.thread.is_finished() && begun_at.elapsed() < CLOSE_TIMEOUT {
            thread::sleep(Wait::from_millis(10));
        }
    }
}

/// Scan of an ideal sensor.
fn scan(sensor: &SensorParams, own: Position, boresight: Option<Angle>, targets: &[Target]) -> FeedScan {
    let detection = |target: &Target| {
        let measurement = sensor.measure(own, boresight?, target.position)?;
        // The same lower limit as for lines of the feed.
        (measurement.range_m >= 1.0).then_some(Detection {
            label: Some(target.label),
            measurement,
            range_rate_m_s: None,
        })
    };
    let detections = targets.iter().filter_map(detection).take(VEHICLES_MAX).collect();
    FeedScan { boresight, detections, age: Duration::from_us(0) }
}

/// Requests the simulation in real time until the receiver is gone.
fn follow(stream: TcpStream, order: u32, sender: &SyncSender<Step>) -> Result<(), TraciError> {
    let mut client = Client::start(stream, order)?;
    let steps = (PERIOD_S / client.step_length_s.max(1e-3)).ceil().max(1.0);
    let period_s = steps * client.step_length_s.max(1e-3);
    let (begun_at, begun_s) = (Instant::now(), client.time_s);
    for count in 1u32.. {
        let time_s = begun_s + f64::from(count) * period_s;
        let due_at = begun_at + Wait::from_secs_f64(f64::from(count) * period_s);
        thread::sleep(due_at.saturating_duration_since(Instant::now()));
        let targets = client.step_to(time_s)?.iter().map(Target::of).collect();
        if sender.send(Ok((Instant::now(), targets))).is_err() {
            break;
        }
    }
    client.close();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_a_hash_of_the_name_and_courses_are_clockwise_from_north() {
        let vehicle =
            SumoVehicle { name: "car.0".to_owned(), position_m: [100.0, -50.0], speed_m_s: 6.0, course_deg: 180.0 };
        let target = Target::of(&vehicle);
        assert_eq!(target.position, Position::from_m(100.0, -50.0));
        assert!((target.velocity.y_m_s() + 6.0).abs() < 1e-9 && target.velocity.x_m_s().abs() < 1e-9);
        let other = Target::of(&SumoVehicle { name: "car.1".to_owned(), ..vehicle.clone() });
        assert_eq!(target.label, Target::of(&vehicle).label);
        assert_ne!(target.label, other.label);
    }

    #[test]
    fn targets_within_the_field_of_view_are_detected_and_others_are_not() {
        let sensor = standoff::TeamParams::recommended().track.sensor;
        let at = |x_m, y_m, label| Target {
            label: TargetLabel(label),
            position: Position::from_m(x_m, y_m),
            velocity: Velocity::ZERO,
        };
        let targets = [at(300.0, 10.0, 1), at(-300.0, 0.0, 2), at(5000.0, 0.0, 3), at(0.5, 0.0, 4)];
        let seen = scan(&sensor, Position::default(), Some(Angle::from_deg(0.0)), &targets);
        assert_eq!(seen.detections.iter().map(|detection| detection.label).collect::<Vec<_>>(), [Some(TargetLabel(1))]);
        assert_eq!(scan(&sensor, Position::default(), None, &targets).detections, []);
    }
}
