//! Flights of the agent with the double of the vehicle.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::flight::{Flight, config};
use common::plane::{GUIDED, LOITER, RTL};
use standoff::research::math;
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
fn the_wind_is_estimated_and_the_orbit_error_in_wind_of_8_m_s_is_at_most_10_m_rms() {
    let mut flight = Flight::new(config(), None);
    flight.vehicle.wind_m_s = [6.4, -4.8];
    flight.fly(120.0);
    let wind = flight.companion.output.diagnostics.wind.unwrap().velocity;
    // The double's airspeed is the true one, which counts as calibrated: 0.6 m/s too much at its altitude.
    let error_m_s = math::hypot(wind.x_m_s() - 6.4, wind.y_m_s() + 4.8);
    let [mean_m, rms_m, max_m] = orbit_error_m(&mut flight, 120.0);
    println!("wind error {error_m_s:.2} m/s; orbit error mean {mean_m:+.1}, rms {rms_m:.2}, max {max_m:.1} m");
    assert!(error_m_s < 1.0 && rms_m <= 10.0, "{error_m_s} {rms_m}");
    assert_eq!(flight.vehicle.violations, Vec::<String>::new());
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
fn a_silent_feed_requests_a_circle_after_which_no_roll_target_follows() {
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

/// Asserts that the authority has stopped for a reason, that a circle was requested, and that no roll target follows.
fn assert_stopped(flight: &mut Flight, condition: Condition) {
    let stopped = matches!(flight.companion.authority(), State::Stopped { reason, .. }
        if reason == StopReason::Failed(condition));
    assert!(stopped, "{:?}", flight.companion.authority());
    assert_eq!(flight.vehicle.circles.len(), 1);
    let last_roll_at_s = flight.vehicle.roll_target_at_s;
    flight.fly(5.0);
    assert_eq!(flight.vehicle.roll_target_at_s, last_roll_at_s);
}

#[test]
fn silent_telemetry_stops_the_commands_within_1_1_s() {
    let mut flight = Flight::new(config(), None);
    flight.fly(30.0);
    flight.vehicle.is_mute = true;
    flight.fly(0.9);
    assert_eq!(flight.companion.authority(), State::Engaged);
    flight.fly(0.3);
    assert_stopped(&mut flight, Condition::Telemetry);
}

#[test]
fn a_program_that_was_late_by_more_than_1_s_stops() {
    let mut flight = Flight::new(config(), None);
    flight.fly(30.0);
    for _ in 0..55 {
        let datagrams = flight.vehicle.advance();
        datagrams.iter().for_each(|datagram| flight.hear(datagram));
    }
    flight.cue();
    flight.decide();
    let State::Stopped { reason: StopReason::Failed(condition), .. } = flight.companion.authority() else {
        panic!("{:?}", flight.companion.authority())
    };
    assert!([Condition::OnTime, Condition::Target].contains(&condition), "{condition}");
    assert_stopped(&mut flight, condition);
}

#[test]
fn a_refused_first_command_stops_before_any_roll_target() {
    let mut flight = Flight::new(config(), None);
    flight.vehicle.refuses_speed = true;
    flight.fly(20.0);
    let refused = matches!(flight.companion.authority(), State::Stopped { reason: StopReason::Refused, .. });
    assert!(refused && flight.vehicle.roll_target_at_s.is_none() && flight.vehicle.circles.is_empty());
}

#[test]
fn nothing_is_commanded_while_disarmed_low_in_failsafe_or_without_plausible_parameters() {
    use mavlink::dialects::ardupilotmega::MavState;
    type Change = fn(&mut Flight);
    let changes: [(Change, Condition); 4] = [
        (|flight| flight.vehicle.is_armed = false, Condition::Armed),
        (|flight| (flight.vehicle.altitude_m, flight.vehicle.commanded_altitude_m) = (5.0, 5.0), Condition::Airborne),
        (|flight| flight.vehicle.system_status = MavState::MAV_STATE_CRITICAL, Condition::NoFailsafe),
        (|flight| flight.vehicle.parameters[0].1 = 0.0, Condition::Parameters),
    ];
    for (change, condition) in changes {
        let mut flight = Flight::new(config(), None);
        change(&mut flight);
        flight.fly(20.0);
        assert_eq!(flight.companion.authority(), State::Waiting);
        assert!(!flight.companion.last_inputs().holds(condition, flight.now()), "{condition}");
        assert_eq!((flight.vehicle.roll_target_at_s, flight.vehicle.violations.len()), (None, 0), "{condition}");
    }
}
