//! Flights of the agent with the double of the vehicle.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::flight::{Flight, config};
use common::plane::{GUIDED, LOITER, RTL};
use standoff_fly::authority::{Condition, State, StopReason};

/// Mean, root mean square and maximum of the orbit error at 250 m over a time, m.
fn orbit_error_m(flight: &mut Flight, seconds: f64) -> [f64; 3] {
    let errors_m: Vec<f64> = (0..(seconds * 10.0) as u32)
        .map(|_| {
            flight.step();
            flight.range_m() - 250.0
        })
        .collect();
    let count = errors_m.len() as f64;
    let mean = errors_m.iter().sum::<f64>() / count;
    let rms = (errors_m.iter().map(|m| m * m).sum::<f64>() / count).sqrt();
    [mean, rms, errors_m.iter().fold(0.0, |max: f64, m| max.max(m.abs()))]
}

#[test]
fn the_orbit_error_is_at_most_10_m_rms_around_a_moving_target() {
    for (noise, rms_max_m) in [([0.0; 2], 10.0), ([3.0, 1f64.to_radians()], 10.0), ([10.0, 3f64.to_radians()], 10.0)] {
        let mut flight = Flight::new(config(), None);
        flight.noise = noise;
        flight.fly(120.0);
        assert_eq!(flight.companion.authority(), State::Engaged);
        let [mean_m, rms_m, max_m] = orbit_error_m(&mut flight, 120.0);
        println!("noise {noise:?}: orbit error mean {mean_m:+.1}, rms {rms_m:.2}, max {max_m:.1} m");
        assert!(rms_m <= rms_max_m, "noise {noise:?}: {mean_m} {rms_m} {max_m}");
        assert_eq!(flight.vehicle.violations, Vec::<String>::new());
        // The altitude is that of the group's orbit, within the limits.
        let altitude_m = flight.companion.output.altitude_m.unwrap().clamp(60.0, 190.0);
        assert!((flight.vehicle.altitude_m - altitude_m).abs() < 1.0, "{altitude_m}");
    }
}

#[test]
fn a_change_of_mode_stops_the_stream_from_the_next_heartbeat_and_guided_resumes_it() {
    for mode in [LOITER, RTL] {
        let mut flight = Flight::new(config(), None);
        flight.fly(20.0);
        assert_eq!(flight.companion.authority(), State::Engaged);
        // The heartbeat after the change arrives within a second; a command before it is unavoidable.
        flight.vehicle.mode = mode;
        flight.fly(1.0);
        flight.vehicle.violations.clear();
        flight.fly(10.0);
        assert_eq!((flight.companion.authority(), flight.vehicle.violations.len()), (State::Waiting, 0));
        flight.vehicle.mode = GUIDED;
        flight.fly(2.0);
        assert_eq!(flight.companion.authority(), State::Engaged);
    }
}

#[test]
fn a_silent_feed_requests_a_circle_and_stops_and_the_roll_is_released_after_3_1_s() {
    let mut flight = Flight::new(config(), None);
    flight.fly(30.0);
    flight.has_feed = false;
    let silent_at_s = flight.vehicle.time_s();
    flight.fly(10.0);
    let reason = StopReason::Failed(Condition::Feed);
    assert!(matches!(flight.companion.authority(), State::Stopped { reason: stated, .. } if stated == reason));
    let [(circle_at_s, radius_m)] = flight.vehicle.circles[..] else { panic!("{:?}", flight.vehicle.circles) };
    assert!((0.5..=1.6).contains(&(circle_at_s - silent_at_s)), "{circle_at_s} {silent_at_s}");
    assert_eq!(radius_m, 80.0);
    let last_roll_at_s = flight.vehicle.roll_target_at_s.unwrap();
    assert!(last_roll_at_s <= circle_at_s + 0.01, "{last_roll_at_s} {circle_at_s}");
    // The aircraft circles where it was.
    flight.fly(120.0);
    assert!(flight.vehicle.position.distance_m(flight.vehicle.guided_point) < 120.0);
    // The feed is back: the pilot has to select GUIDED again.
    flight.has_feed = true;
    flight.fly(5.0);
    assert!(matches!(flight.companion.authority(), State::Stopped { .. }));
    flight.vehicle.mode = LOITER;
    flight.fly(2.0);
    flight.vehicle.mode = GUIDED;
    flight.fly(3.0);
    assert_eq!(flight.companion.authority(), State::Engaged);
}
