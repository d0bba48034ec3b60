//! The identified aircraft responds as ArduPlane's simulator was measured.

use crate::common::identified_aircraft::{Airframe, IdentifiedAircraft, STEP_S};
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;
use standoff::{Angle, Position};

fn aircraft(airframe: Airframe) -> IdentifiedAircraft {
    IdentifiedAircraft::new(airframe, Position::ORIGIN, Angle::ZERO, 23.0)
}

fn fly(aircraft: &mut IdentifiedAircraft, seconds: f64) {
    (0..(seconds / STEP_S).round() as usize).for_each(|_| aircraft.advance());
}

/// Roll and change of the course to the right, deg, measured at times, s, after a step of the roll command. The command
/// arrived up to 0.04 s after the start of the times.
#[test]
fn roll_and_course_after_a_step_are_those_measured() {
    type Step = (f64, f64, [(f64, f64, f64); 5]);
    let steps: [Step; 3] = [
        (0.0, 45.0, [(0.5, 24.8, 1.9), (1.0, 49.6, 11.7), (1.5, 43.7, 24.2), (2.0, 44.7, 29.2), (4.0, 44.7, 61.2)]),
        (0.0, 20.0, [(0.5, 18.3, 1.6), (1.0, 21.1, 5.7), (1.5, 19.1, 8.4), (2.0, 19.8, 11.4), (4.0, 19.8, 23.3)]),
        (-30.0, 30.0, [(0.5, -5.1, -3.0), (1.0, 33.2, 1.1), (1.5, 29.1, 8.5), (2.0, 29.1, 12.3), (4.0, 29.6, 31.9)]),
    ];
    for (from_deg, to_deg, measured) in steps {
        let mut aircraft = aircraft(Airframe::STOCK);
        aircraft.roll_command_rad = from_deg.to_radians();
        fly(&mut aircraft, 5.0);
        let course = aircraft.air_course;
        fly(&mut aircraft, 0.03);
        aircraft.roll_command_rad = to_deg.to_radians();
        let mut flown_s = 0.03;
        for (time_s, roll_deg, course_deg) in measured {
            fly(&mut aircraft, time_s - flown_s);
            flown_s = time_s;
            let (roll_flown_deg, turned_deg) = (aircraft.roll_rad.to_degrees(), (course - aircraft.air_course).deg());
            assert!((roll_flown_deg - roll_deg).abs() < 2.0, "{to_deg} deg, {time_s} s: {roll_flown_deg} {roll_deg}");
            // The airspeed of the measured aircraft rises by 4 % in a turn of 45 degrees.
            let tolerance_deg = 1.0 + 0.07 * course_deg.abs();
            assert!(
                (turned_deg - course_deg).abs() < tolerance_deg,
                "{to_deg} deg, {time_s} s: {turned_deg} {course_deg}"
            );
        }
    }
}

#[test]
fn the_share_of_the_coordinated_turn_rate_is_the_one_measured() {
    let limits = [(Airframe::STOCK, 20.0f64, 0.74), (Airframe::STOCK, 45.0, 0.74), (Airframe::COORDINATED, 45.0, 0.9)];
    for (airframe, bank_deg, measured) in limits {
        let mut aircraft = aircraft(airframe);
        aircraft.roll_command_rad = bank_deg.to_radians();
        fly(&mut aircraft, 30.0);
        let (sin, cos) = math::sin_cos(aircraft.roll_rad);
        let share = aircraft.course_rate_rad_s * aircraft.true_airspeed_m_s() * cos / (GRAVITY_M_S2 * sin);
        assert!((share - measured).abs() < 0.02, "{bank_deg} deg: {share} {measured}");
    }
}

/// Times until 63 and 95 % of a change of the airspeed.
#[test]
fn the_airspeed_follows_its_command_as_measured() {
    let mut aircraft = aircraft(Airframe::STOCK);
    for (to_m_s, measured_s) in [(28.0, [5.1, 8.5]), (18.0, [7.9, 13.8]), (23.0, [4.1, 7.9])] {
        let from_m_s = aircraft.airspeed_m_s;
        aircraft.airspeed_command_m_s = to_m_s;
        let mut flown_s = [0.0; 2];
        let mut largest = 0.0f64;
        for step in 1..=1800 {
            aircraft.advance();
            let share = (aircraft.airspeed_m_s - from_m_s) / (to_m_s - from_m_s);
            for (reached_s, limit) in flown_s.iter_mut().zip([0.63, 0.95]) {
                if share >= limit && *reached_s == 0.0 {
                    *reached_s = f64::from(step) * STEP_S;
                }
            }
            largest = largest.max(share);
        }
        let overshoot_m_s = (largest - 1.0) * (to_m_s - from_m_s).abs();
        assert!((0.2..0.8).contains(&overshoot_m_s), "{to_m_s} m/s: overshoot {overshoot_m_s}");
        for (flown_s, measured_s) in flown_s.into_iter().zip(measured_s) {
            assert!((flown_s - measured_s).abs() < 2.0, "{to_m_s} m/s: {flown_s} {measured_s}");
        }
    }
}

#[test]
fn turbulence_disturbs_the_course_by_the_measured_0_38_degrees() {
    let mut aircraft = aircraft(Airframe::STOCK).in_wind([0.0; 2], Some(1));
    let squares = (0..6000).map(|_| {
        fly(&mut aircraft, 0.1);
        let course_deg = aircraft.velocity().direction().deg();
        course_deg * course_deg
    });
    let sd_deg = (squares.sum::<f64>() / 6000.0).sqrt();
    assert!((sd_deg - 0.38).abs() < 0.04, "{sd_deg}");
}
