//! The double of the vehicle in real time, with a sensor and a target, over UDP.

use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, Instant};

use standoff::Position;
use standoff_io::geodesy::LocalPlane;

use super::plane::{GUIDED, LOITER, Plane, STEP_S, TARGET_SPEED_M_S, cue_line};

/// What was seen in a flight in real time.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// Times from sending a position to receiving the next roll target, s.
    pub(crate) latencies_s: Vec<f64>,
    /// Distances from the target after the transient, m.
    pub(crate) ranges_m: Vec<f64>,
}

/// Flies the double for a time, with the target at the origin of the plane at the start.
pub(crate) fn fly(vehicle: &mut Plane, plane: &LocalPlane, link: &str, feed: &str, seconds: f64) -> Seen {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_nonblocking(true).unwrap();
    let (begun_at, begun_s) = (Instant::now(), vehicle.time_s());
    let (mut seen, mut position_at, mut datagram) = (Seen::default(), None, vec![0; 2048]);
    // Bytes 7 to 9 of a frame are the id of its message.
    let is_roll = |frame: &[u8]| frame.len() > 9 && frame[7..10] == [82, 0, 0];
    while vehicle.time_s() - begun_s < seconds {
        for frame in vehicle.advance() {
            if frame.len() > 9 && frame[7..10] == [33, 0, 0] {
                position_at = Some(Instant::now());
            }
            let _ = socket.send_to(&frame, link);
        }
        // The pilot selects GUIDED after 2 s.
        vehicle.mode = if vehicle.time_s() - begun_s < 2.0 { LOITER } else { GUIDED };
        let steps = ((vehicle.time_s()) / STEP_S).round() as u64;
        let target = Position::from_m(TARGET_SPEED_M_S * vehicle.time_s(), 0.0);
        if steps.is_multiple_of(25) {
            let to_target = target - vehicle.aircraft.position;
            let (range_m, bearing_deg) = (to_target.length_m(), 90.0 - to_target.direction().deg());
            let scan = format!(
                r#"{{"scan": {{"boresight_deg": {bearing_deg}, "detections":
                [{{"label": 0, "range_m": {range_m}, "bearing_deg": {bearing_deg}}}]}}}}"#
            );
            let _ = socket.send_to(scan.replace('\n', " ").as_bytes(), feed);
        }
        if steps.is_multiple_of(250) || steps == 25 {
            let _ = socket.send_to(cue_line(plane, target).as_bytes(), feed);
        }
        seen.ranges_m.push(vehicle.aircraft.position.distance_m(target));
        let due_at = begun_at + Duration::from_secs_f64(vehicle.time_s() - begun_s);
        // Answers are read until the next step is due.
        loop {
            if let Ok((length, _)) = socket.recv_from(&mut datagram) {
                let frame = &datagram[..length];
                if is_roll(frame)
                    && let Some(position_at) = position_at.take()
                {
                    seen.latencies_s.push(Instant::now().duration_since(position_at).as_secs_f64());
                }
                for answer in vehicle.receive(frame) {
                    let _ = socket.send_to(&answer, link);
                }
                continue;
            }
            let left = due_at.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            thread::sleep(left.min(Duration::from_micros(300)));
        }
    }
    seen
}
