//! Faults of links, sensors, clocks and parameters in flights of the double: the program stops with a circle and a word.

use crate::common::flight::{Flight, config};
use crate::common::plane::{GUIDED, LOITER, RTL};
use mavlink::dialects::ardupilotmega::{GpsFixType, MavState};
use standoff::math;
use standoff::{Angle, LinkModel, Position, UavId};
use standoff_fly::authority::{Condition, State, StopReason};
use standoff_fly::config::Config;

/// ArduPlane's mode CIRCLE, which the short failsafe selects.
const CIRCLE: u32 = 1;

fn engaged() -> Flight {
    let mut flight = Flight::new(config(), None);
    flight.fly(60.0);
    assert_eq!(flight.companion.authority(), State::Engaged);
    flight
}

fn is_stopped(flight: &Flight, condition: Condition) -> bool {
    matches!(flight.companion.authority(), State::Stopped { reason, .. } if reason == StopReason::Failed(condition))
}

/// Flies until the authority stops for a condition; returns the time, s.
fn time_to_stop_s(flight: &mut Flight, condition: Condition) -> f64 {
    let begun_s = flight.vehicle.time_s();
    while !is_stopped(flight, condition) {
        flight.step();
        let time_s = flight.vehicle.time_s() - begun_s;
        assert!(time_s < 20.0, "{condition}: {:?}; {}", flight.companion.authority(), flight.line());
    }
    flight.vehicle.time_s() - begun_s
}

/// Asserts that nothing is commanded for 40 s, and that GUIDED, selected again, engages within 5 s.
fn assert_waits_for_guided(flight: &mut Flight) {
    let (rolls, circles) = (flight.vehicle.roll_target_at_s, flight.circle_requests_s.len());
    flight.fly(40.0);
    assert_eq!((flight.vehicle.roll_target_at_s, flight.circle_requests_s.len()), (rolls, circles));
    assert!(flight.line().contains("; select another mode, then GUIDED, to resume"), "{}", flight.line());
    flight.select_guided_again();
    flight.fly(5.0);
    assert_eq!(
        (flight.companion.authority(), flight.vehicle.violations.len()),
        (State::Engaged, 0),
        "{}",
        flight.line()
    );
}

#[test]
fn a_pilot_who_flies_in_guided_after_a_stop_is_not_overridden() {
    for is_deaf in [false, true] {
        let mut flight = engaged();
        flight.has_feed = false;
        flight.vehicle.is_deaf = is_deaf;
        let stop_s = flight.vehicle.time_s() + time_to_stop_s(&mut flight, Condition::Feed);
        flight.fly(6.0);
        let requests = flight.circle_requests_s.clone();
        assert_eq!(requests.len(), if is_deaf { 3 } else { 1 });
        assert!(requests.iter().all(|at_s| (0.0..5.0).contains(&(at_s - stop_s))), "{stop_s}: {requests:?}");
        // The pilot sends the aircraft elsewhere.
        flight.vehicle.is_deaf = false;
        let elsewhere = Position::from_m(2000.0, 2000.0);
        flight.vehicle.guided_point = elsewhere;
        flight.fly(180.0);
        assert_eq!((flight.vehicle.guided_point, &flight.circle_requests_s), (elsewhere, &requests));
        assert!(flight.vehicle.aircraft.position.distance_m(elsewhere) < 150.0);
        assert!(matches!(flight.companion.authority(), State::Stopped { .. }));
    }
}

#[test]
fn commands_that_do_not_arrive_are_noticed_within_2_s() {
    let mut flight = engaged();
    flight.vehicle.is_deaf = true;
    assert!(time_to_stop_s(&mut flight, Condition::Uplink) <= 2.0);
    assert!(flight.line().contains("; the autopilot does not answer commands"), "{}", flight.line());
    flight.fly(6.0);
    assert_eq!((flight.circle_requests_s.len(), flight.vehicle.circles.len()), (3, 0));
    flight.vehicle.is_deaf = false;
    assert_waits_for_guided(&mut flight);
}

/// The double, as ArduPlane, keeps the last roll target for 3 s.
#[test]
fn a_roll_that_does_not_follow_is_noticed_soon_after_the_aircraft_leaves_its_turn() {
    let mut flight = engaged();
    flight.vehicle.ignores_rolls = true;
    // Without roll targets, it flies to the right, and the orbit is anticlockwise.
    let (sin, cos) = math::sin_cos((flight.vehicle.aircraft.heading() - Angle::from_deg(90.0)).rad());
    let (x_m, y_m) = (flight.vehicle.aircraft.position.x_m(), flight.vehicle.aircraft.position.y_m());
    flight.vehicle.guided_point = Position::from_m(x_m + 1000.0 * cos, y_m + 1000.0 * sin);
    let time_s = time_to_stop_s(&mut flight, Condition::Uplink);
    assert!(time_s <= 3.1 + 2.0, "{time_s}");
    assert!(flight.line().contains("; the roll does not follow the commands"), "{}", flight.line());
    flight.vehicle.ignores_rolls = false;
    assert_waits_for_guided(&mut flight);
    assert_eq!(flight.vehicle.circles.len(), 1);
}

/// Noise makes the aircraft roll; 1 of 20 messages is lost in each direction, and those of the autopilot are 0.2 s late.
#[test]
fn noise_wind_lost_and_late_messages_are_no_lost_uplink() {
    for noise in [[3.0, 0.02], [10.0, 0.06]] {
        let mut flight = Flight::new(config(), None);
        (flight.noise, flight.vehicle.aircraft.wind_m_s) = (noise, [6.4, -4.8]);
        (flight.loss, flight.delay_s) = (0.05, 0.2);
        flight.fly(300.0);
        assert_eq!(flight.companion.authority(), State::Engaged, "{}", flight.line());
        assert_eq!(flight.circle_requests_s, Vec::<f64>::new());
    }
}

#[test]
fn failsafes_and_a_failed_pitot_without_change_of_mode_request_a_circle_and_do_not_engage_again() {
    type Change = fn(&mut Flight, bool);
    let changes: [(Change, Condition, &str); 2] = [
        (
            |flight, fails| {
                let [good, bad] = [MavState::MAV_STATE_ACTIVE, MavState::MAV_STATE_CRITICAL];
                flight.vehicle.system_status = if fails { bad } else { good };
            },
            Condition::NoFailsafe,
            "stopped (missing: system status without failsafe or battery warning)",
        ),
        (
            |flight, fails| flight.vehicle.shown_airspeed_m_s = fails.then_some(1.0),
            Condition::Airborne,
            "stopped (missing: flight at 20 m or higher with plausible airspeed)",
        ),
    ];
    for (change, condition, line) in changes {
        let mut flight = engaged();
        change(&mut flight, true);
        assert!(time_to_stop_s(&mut flight, condition) <= 1.1);
        flight.fly(1.0);
        assert_eq!(flight.vehicle.circles.len(), 1, "{condition}");
        assert!(flight.line().starts_with(line), "{}", flight.line());
        change(&mut flight, false);
        assert_waits_for_guided(&mut flight);
    }
}

/// The short failsafe of ArduPlane changes the mode, and when it ends it selects GUIDED again, without the pilot.
#[test]
fn guided_selected_by_the_end_of_a_failsafe_does_not_engage() {
    for mode in [CIRCLE, RTL] {
        let mut flight = engaged();
        (flight.vehicle.mode, flight.vehicle.system_status) = (mode, MavState::MAV_STATE_CRITICAL);
        flight.fly(1.0);
        flight.vehicle.violations.clear();
        flight.fly(10.0);
        (flight.vehicle.mode, flight.vehicle.system_status) = (GUIDED, MavState::MAV_STATE_ACTIVE);
        assert_waits_for_guided(&mut flight);
        assert_eq!(flight.circle_requests_s, Vec::<f64>::new());
    }
}

#[test]
fn a_lost_gps_fix_and_a_degraded_ekf_stop_with_a_circle_and_are_stated() {
    type Change = fn(&mut Flight);
    let changes: [(Change, &str); 4] = [
        (|flight| flight.vehicle.gps_fix = GpsFixType::GPS_FIX_TYPE_NO_GPS, "; GPS_RAW_INT: fix type 0 instead of 3"),
        (|flight| flight.vehicle.gps_fix = GpsFixType::GPS_FIX_TYPE_2D_FIX, "; GPS_RAW_INT: fix type 2 instead of 3"),
        // ArduPlane's simulator, after the GPS was switched off.
        (|flight| flight.vehicle.ekf_flags = 303, "; EKF_STATUS_REPORT: flags 303 without a good position"),
        (|flight| flight.vehicle.ekf_flags = 831 + 32_768, "; EKF_STATUS_REPORT: flags 33599 without a good position"),
    ];
    for (change, line) in changes {
        let mut flight = engaged();
        let good = (flight.vehicle.gps_fix, flight.vehicle.ekf_flags);
        change(&mut flight);
        assert!(time_to_stop_s(&mut flight, Condition::Navigation) <= 0.7, "{line}");
        flight.fly(1.0);
        assert_eq!(flight.vehicle.circles.len(), 1, "{line}");
        assert!(flight.line().contains(line), "{}", flight.line());
        (flight.vehicle.gps_fix, flight.vehicle.ekf_flags) = good;
        assert_waits_for_guided(&mut flight);
        // Nor does it engage without a position.
        change(&mut flight);
        flight.select_guided_again();
        flight.fly(10.0);
        assert_eq!(flight.companion.authority(), State::Waiting);
    }
}

#[test]
fn a_clock_that_is_set_stops_with_a_circle_and_guided_selected_again_engages_within_5_s() {
    for step_s in [0.2, 2.5, -2.5, 3600.0, -36_000.0] {
        let mut flight = engaged();
        flight.clock_step_s = step_s;
        assert!(time_to_stop_s(&mut flight, Condition::Clock) <= 0.2);
        flight.fly(1.0);
        assert_eq!(flight.vehicle.circles.len(), 1, "{step_s}");
        assert!(
            flight.line().contains(&format!("; the clock of this computer was set by {step_s:+.1} s")),
            "{}",
            flight.line()
        );
        assert_waits_for_guided(&mut flight);
        // The record has the time of the team.
        let frame_us = flight.frames.last().unwrap().time_us;
        assert!(((frame_us - flight.now().us()) as f64 * 1e-6 - step_s).abs() < 1.0, "{step_s}");
    }
}

/// A simulator that is held, and a link whose delay grows: telemetry is late from then on.
#[test]
fn late_telemetry_stops_with_a_circle_is_stated_and_guided_selected_again_engages_within_5_s() {
    type Change = fn(&mut Flight);
    let changes: [Change; 2] = [|flight| flight.hold(1.6), |flight| flight.delay_s = 1.6];
    for change in changes {
        let mut flight = engaged();
        change(&mut flight);
        let time_s = time_to_stop_s(&mut flight, Condition::Telemetry);
        assert!(time_s <= 4.0, "{time_s}");
        flight.fly(3.0);
        // The answer to the first request may be late, too.
        assert!((1..=2).contains(&flight.vehicle.circles.len()));
        assert!(flight.line().contains("; telemetry arrives 1.6 s late: the link or the clock"), "{}", flight.line());
        assert_waits_for_guided(&mut flight);
        assert!(!flight.line().contains("late"), "{}", flight.line());
    }
}

#[test]
fn a_gap_of_the_link_up_to_3_s_holds_the_turn_and_a_longer_one_stops() {
    for (gap_s, is_engaged) in [(1.0, true), (2.0, true), (2.7, true), (3.3, false)] {
        let mut flight = engaged();
        (flight.has_downlink, flight.vehicle.is_deaf) = (false, true);
        flight.fly(gap_s);
        (flight.has_downlink, flight.vehicle.is_deaf) = (true, false);
        flight.fly(3.0);
        let state = flight.companion.authority();
        assert_eq!(state == State::Engaged, is_engaged, "{gap_s}: {state:?}");
        assert!(is_engaged || is_stopped(&flight, Condition::Telemetry));
        // The aircraft has stayed on its orbit.
        assert!(!is_engaged || (flight.range_m() - 250.0).abs() < 15.0, "{gap_s}: {}", flight.range_m());
    }
    // Without telemetry, the last roll target is repeated.
    let mut flight = engaged();
    flight.has_downlink = false;
    flight.fly(1.2);
    let roll_rad = flight.vehicle.aircraft.roll_rad;
    flight.fly(1.6);
    assert!(
        (flight.vehicle.aircraft.roll_rad - roll_rad).abs() < 0.02 && flight.companion.authority() == State::Engaged
    );
    let age_s = flight.vehicle.time_s() - flight.vehicle.roll_target_at_s.unwrap();
    assert!(age_s < 0.15, "{age_s}");
}

#[test]
fn a_program_that_starts_while_guided_is_selected_waits_for_the_pilot() {
    let mut flight = Flight::new(Config { engages_after_restart: false, ..config() }, None);
    flight.fly(30.0);
    let line = "stopped (GUIDED was selected before this program heard the autopilot); select another mode";
    assert!(flight.line().starts_with(line), "{}", flight.line());
    assert_eq!((flight.vehicle.roll_target_at_s, flight.circle_requests_s.len()), (None, 0));
    assert_waits_for_guided(&mut flight);
    let mut flight = Flight::new(Config { engages_after_restart: false, ..config() }, None);
    flight.vehicle.mode = LOITER;
    flight.fly(10.0);
    flight.vehicle.mode = GUIDED;
    flight.fly(10.0);
    assert_eq!(flight.companion.authority(), State::Engaged);
}

#[test]
fn a_parameter_that_the_autopilot_does_not_have_is_requested_three_times() {
    let mut flight = Flight::new(config(), None);
    flight.vehicle.parameters.retain(|(name, _)| *name != "GUIDED_P");
    let count = |flight: &Flight| flight.vehicle.requested.iter().filter(|name| *name == "GUIDED_P").count();
    flight.fly(150.0);
    assert_eq!((count(&flight), flight.companion.authority()), (3, State::Engaged));
    // One that was read is not requested again, and lost answers are not the end: each mode starts again.
    assert!(flight.vehicle.requested.iter().filter(|name| *name == "ROLL_LIMIT_DEG").count() <= 2);
    flight.vehicle.mode = LOITER;
    flight.fly(20.0);
    assert_eq!(count(&flight), 6);
}

#[test]
fn altitudes_that_the_limits_bring_together_are_known() {
    // The team flies at 300 and 350 m, the double's fence ends at 200 m.
    for (fence_m, altitude_m, shared) in [
        (500.0, [60.0, 400.0], None),
        (500.0, [60.0, 300.0], Some(300.0)),
        (200.0, [60.0, 400.0], Some(190.0)),
        (345.0, [60.0, 400.0], None),
    ] {
        let mut config = Config { teammates: vec![UavId(1)], altitude_m, ..config() };
        config.params.link = LinkModel::Lossy;
        let mut flight = Flight::new(config, None);
        flight.vehicle.set("FENCE_ALT_MAX", fence_m);
        flight.fly(5.0);
        let expected = shared.map(|m| [(UavId(0), m), (UavId(1), m)]);
        assert_eq!(flight.companion.shared_altitudes(), expected, "{fence_m} {altitude_m:?}");
    }
}
