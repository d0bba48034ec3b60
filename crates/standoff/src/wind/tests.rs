use proptest::prelude::*;

use super::*;
use crate::frame::Position;
use crate::math::PI;
use crate::params::BankParams;
use crate::safety::motion::Airframe;
use crate::time::Duration;

/// 23 m/s with airspeeds from 16 to 30 m/s.
fn team() -> TeamParams {
    let mut team = TeamParams::paper();
    (team.uav.speed_m_s, team.uav.speed_change_max_m_s) = (23.0, 7.0);
    team.wind = Some(WindParams::default());
    team
}

fn flying(course: Angle, ground_speed_m_s: f64) -> UavState {
    UavState::level_flight(Position::ORIGIN, course, ground_speed_m_s)
}

/// The wind of weather reports: from east to west, and from south-west to north-east.
#[test]
fn a_wind_blows_from_its_direction_clockwise_from_north() {
    let from_east = Wind::blowing_from(5.0, 0.5 * PI).velocity;
    assert!((from_east.x_m_s() + 5.0).abs() < 1e-12 && from_east.y_m_s().abs() < 1e-12);
    let from_south_west = Wind::blowing_from(5.0, 1.25 * PI).velocity;
    assert!((from_south_west.direction().deg() - 45.0).abs() < 1e-9);
}

/// A 3-4-5 triangle: 30 m/s across the course leave 40 of 50 m/s along it.
#[test]
fn the_ground_speeds_on_a_course_are_those_of_the_airspeeds() {
    let across = Wind { velocity: Velocity::from_m_s(0.0, 30.0) };
    let along = Vector2::new(1.0, 0.0);
    let got = across.ground_speeds_m_s(along, [34.0, 50.0]).unwrap();
    assert!((got[0] - 16.0).abs() < 1e-9 && (got[1] - 40.0).abs() < 1e-9, "{got:?}");
    assert_eq!(across.ground_speeds_m_s(along, [20.0, 29.9]), None);
    // The lowest airspeed is below the crosswind: the UAV may be slow, but does not fly backwards.
    assert_eq!(across.ground_speeds_m_s(along, [20.0, 50.0]).unwrap()[0], 0.0);
    // A headwind stronger than the airspeed.
    assert_eq!(Wind { velocity: Velocity::from_m_s(-31.0, 0.0) }.ground_speeds_m_s(along, [16.0, 30.0]), None);
}

proptest! {
    /// At every ground speed between the bounds, and at no other one, the airspeed is within the limits.
    #[test]
    fn feasible_ground_speeds_need_airspeeds_within_the_limits(
        wind in 0.0..40.0f64, wind_deg in -180.0..180.0f64, course_deg in -180.0..180.0f64, share in -0.5..1.5f64,
    ) {
        let wind = Wind { velocity: Velocity::from_polar(wind, Angle::from_deg(wind_deg)) };
        let course = Angle::from_deg(course_deg);
        let along = Velocity::from_polar(1.0, course).vector();
        let Some([lowest, highest]) = wind.ground_speeds_m_s(along, [16.0, 30.0]) else {
            // Neither the highest nor a lower airspeed leads along the course.
            prop_assert!(wind.velocity.speed_m_s() > 29.0);
            return Ok(());
        };
        let ground_speed = lowest + share * (highest - lowest);
        let airspeed = wind.air_velocity(Velocity::from_polar(ground_speed, course)).airspeed_m_s;
        let is_between = (0.0..=1.0).contains(&share);
        // Below the lowest ground speed, a UAV would fly backwards through the air, or over ground.
        if is_between {
            prop_assert!((16.0 - 1e-9..=30.0 + 1e-9).contains(&airspeed), "{ground_speed} {airspeed}");
        } else if share > 1.0 {
            prop_assert!(airspeed > 30.0 - 1e-9);
        }
    }

    /// The heading rate of a UAV that turns at constant ground speed, or at constant airspeed, is the derivative of the
    /// heading of the wind triangle.
    #[test]
    fn the_heading_rate_is_the_derivative_of_the_heading(
        wind in 0.0..14.0f64, wind_deg in -180.0..180.0f64, course_deg in -180.0..180.0f64, airspeed in 16.0..30.0f64,
    ) {
        let wind = Wind { velocity: Velocity::from_polar(wind, Angle::from_deg(wind_deg)) };
        let (course, h) = (Angle::from_deg(course_deg), 1e-6);
        let ground_speed = wind.ground_speed_m_s(Velocity::from_polar(1.0, course).vector(), airspeed);
        let at = |by: f64| {
            let course = course + Angle::from_rad(by);
            let held = wind.air_velocity(Velocity::from_polar(ground_speed, course)).heading;
            [course + wind.drift(course, airspeed, false).0, held]
        };
        let (before, after) = (at(-h), at(h));
        for (index, is_held) in [(0, false), (1, true)] {
            let slope = (after[index] - before[index]).rad() / (2.0 * h);
            let got = wind.drift(course, airspeed, is_held).1;
            prop_assert!((slope - got).abs() < 1e-4, "{is_held}: {slope} {got}");
        }
    }

    /// From heading, airspeed and their rates to course, ground speed and course rate: the derivative of the course.
    #[test]
    fn the_course_rate_is_the_derivative_of_the_course(
        wind in 0.0..14.0f64, wind_deg in -180.0..180.0f64, heading_deg in -180.0..180.0f64,
        heading_rate in -0.3..0.3f64, acceleration in -3.0..3.0f64,
    ) {
        let wind = Wind { velocity: Velocity::from_polar(wind, Angle::from_deg(wind_deg)) };
        let at = |t: f64| {
            let heading = Angle::from_deg(heading_deg) + Angle::from_rad(heading_rate * t);
            let air = UavState { turn_rate_rad_s: heading_rate, ..flying(heading, 23.0 + acceleration * t) };
            wind.over_ground(&air, acceleration)
        };
        let h = 1e-5;
        let slope = (at(h).heading - at(-h).heading).rad() / (2.0 * h);
        prop_assert!((slope - at(0.0).turn_rate_rad_s).abs() < 1e-6);
        // Air and ground velocity determine the wind.
        let ground = at(0.0).velocity();
        let measured = Wind::measured(ground, &wind.air_velocity(ground)).velocity - wind.velocity;
        prop_assert!(measured.speed_m_s() < 1e-9);
    }

    /// Commands are within the limits for every wind, state and command, also if they are not numbers.
    #[test]
    fn commands_in_wind_are_within_the_limits(
        wind in prop_oneof![0.0..200.0f64, Just(f64::NAN), Just(f64::INFINITY)], wind_deg in -180.0..180.0f64,
        course_deg in -180.0..180.0f64, course_rate in -3.0..3.0f64,
        speed in prop_oneof![-1e3..1e3f64, Just(f64::NAN), Just(f64::INFINITY)],
        rate in prop_oneof![-1e3..1e3f64, Just(f64::NAN), Just(f64::NEG_INFINITY)],
    ) {
        let (team, wind) = (team(), Wind { velocity: Velocity::from_polar(wind, Angle::from_deg(wind_deg)) });
        let own = UavState { turn_rate_rad_s: course_rate, ..flying(Angle::from_deg(course_deg), 23.0) };
        let desired = Command { speed_m_s: speed, turn_rate_rad_s: rate };
        for followed in [Followed::turn(&own, desired), Followed::straight(&own, Angle::from_rad(rate), speed, 1.0)] {
            let got = wind.air_command(&team, &own, &followed).command;
            prop_assert!((16.0..=30.0).contains(&got.speed_m_s) && got.turn_rate_rad_s.abs() <= 0.3, "{got:?}");
        }
    }
}

proptest! {
    /// Every command within the limits over ground can be flown on every course, in every wind up to the stated one.
    #[test]
    fn limits_over_ground_can_be_flown_on_every_course(
        stated in 0.0..7.0f64, share in 0.0..1.0f64, wind_deg in -180.0..180.0f64, course_deg in -180.0..180.0f64,
        speed_share in -1.0..1.0f64, sense in prop::sample::select(vec![-1.0, 1.0]),
    ) {
        let mut team = team();
        team.wind = Some(WindParams { orbit_wind_m_s: stated, ..WindParams::default() });
        let (limits, fastest_m_s) = (team.airframe().over_ground(), team.airframe().fastest_over_ground_m_s());
        let wind = Wind { velocity: Velocity::from_polar(share * stated, Angle::from_deg(wind_deg)) };
        let command = Command {
            speed_m_s: limits.speed_m_s + 0.999 * speed_share * limits.speed_change_max_m_s,
            turn_rate_rad_s: 0.999 * sense * limits.turn_rate_max_rad_s,
        };
        let own = flying(Angle::from_deg(course_deg), command.speed_m_s);
        prop_assert!(own.speed_m_s <= fastest_m_s);
        let limited = wind.air_command(&team, &own, &Followed::turn(&own, command));
        prop_assert!(!limited.turn_rate_limited && !limited.speed_limited, "{limited:?}");
    }
}

#[test]
fn limits_over_ground_are_those_of_the_airframe_in_calm_air_and_stay_valid_in_strong_wind() {
    let mut team = team();
    assert_eq!((team.airframe().over_ground(), team.airframe().fastest_over_ground_m_s()), (team.uav, 30.0));
    team.wind = Some(WindParams { orbit_wind_m_s: 48.0, ..WindParams::default() });
    let (limits, fastest_m_s) = (team.airframe().over_ground(), team.airframe().fastest_over_ground_m_s());
    assert_eq!((limits.speeds_m_s(), limits.turn_rate_max_rad_s), ([23.0; 2], 0.25 * team.uav.turn_rate_max_rad_s));
    assert_eq!(fastest_m_s, 78.0);
}

/// In calm air, command and limits are those without wind.
#[test]
fn calm_air_changes_no_command() {
    let (team, calm) = (team(), Wind::default());
    let own = UavState { turn_rate_rad_s: 0.1, ..flying(Angle::from_deg(20.0), 25.0) };
    for (speed_m_s, turn_rate_rad_s) in [(23.0, 0.1), (50.0, -1.0), (3.0, 0.25)] {
        let desired = Command { speed_m_s, turn_rate_rad_s };
        let (expected, got) = (team.uav.limit(desired), calm.air_command(&team, &own, &Followed::turn(&own, desired)));
        assert_eq!((got.speed_limited, got.turn_rate_limited), (expected.speed_limited, expected.turn_rate_limited));
        assert!((got.command.speed_m_s - expected.command.speed_m_s).abs() < 1e-9);
        assert!((got.command.turn_rate_rad_s - expected.command.turn_rate_rad_s).abs() < 1e-9);
    }
}

/// In a wind of 35 m/s, no airspeed of at most 30 m/s leads along a course of 60 degrees against it.
#[test]
fn a_uav_without_a_feasible_ground_speed_turns_into_the_wind() {
    let (team, wind) = (team(), Wind { velocity: Velocity::from_m_s(-35.0, 0.0) });
    let own = flying(Angle::from_deg(60.0), 30.0);
    let straight_on = Followed::turn(&own, Command { speed_m_s: 23.0, turn_rate_rad_s: 0.0 });
    let got = wind.air_command(&team, &own, &straight_on);
    assert_eq!(got.command, Command { speed_m_s: 30.0, turn_rate_rad_s: -0.3 });
    assert!(got.speed_limited);
}

/// In a wind of 20 m/s, the courses at 16 m/s end 53 degrees from that of the wind. A UAV at this edge, whose course does
/// not follow its heading, accelerates above the wind across the desired course, and turns its heading to it.
#[test]
fn a_uav_leaves_the_edge_of_the_courses_of_its_airspeed() {
    let (team, wind) = (team(), Wind { velocity: Velocity::from_m_s(20.0, 0.0) });
    for desired_deg in [90.0, 120.0, 150.0] {
        let course = Angle::from_rad(math::atan2(16.0, 12.0));
        let air = UavState::level_flight(Position::ORIGIN, course + Angle::from_deg(90.0), 16.0);
        let mut state = air;
        let response = team.uav.response(Duration::from_s(0.5));
        for _ in 0..60 {
            let own = wind.over_ground(&state, 0.0);
            let followed = Followed::straight(&own, Angle::from_deg(desired_deg), 23.0, 1.0);
            let command = wind.air_command(&team, &own, &followed).command;
            let across_m_s = 20.0 * math::sin(desired_deg.to_radians());
            assert!(command.speed_m_s >= 1.1 * across_m_s - 1e-9, "{desired_deg}: {}", command.speed_m_s);
            state = response.step(&state, command);
        }
        let flown = wind.over_ground(&state, 0.0).heading;
        assert!((flown.deg() - desired_deg).abs() < 0.5, "{desired_deg}: {}", flown.deg());
    }
}

/// The estimate takes the first measurement, and 1 - 1/e of a step after one time constant.
#[test]
fn the_estimate_follows_a_step_with_its_time_constant() {
    let params = WindParams { estimate_time_constant_s: 10.0, ..WindParams::default() };
    let wind = |x_m_s| Wind { velocity: Velocity::from_m_s(x_m_s, -2.0) };
    let mut estimate = WindEstimate::updated(None, &params, Time::EPOCH, wind(0.0));
    assert_eq!(params.believed(estimate.as_ref()), Some(wind(0.0)));
    let after = |half_seconds: i64| Time::from_us(half_seconds * 500_000);
    for step in 1..=20 {
        estimate = WindEstimate::updated(estimate, &params, after(step), wind(8.0));
    }
    let believed = params.believed(estimate.as_ref()).unwrap().velocity;
    assert!((believed.x_m_s() - 8.0 * (1.0 - math::exp(-1.0))).abs() < 1e-9, "{believed:?}");
    assert!((believed.y_m_s() + 2.0).abs() < 1e-12);
    // A repeated time and a measurement that is not a number change nothing.
    assert_eq!(WindEstimate::updated(estimate, &params, after(20), wind(99.0)), estimate);
    assert_eq!(WindEstimate::updated(estimate, &params, after(21), wind(f64::NAN)), estimate);
    assert_eq!(WindEstimate::updated(None, &params, after(21), wind(f64::NAN)), None);
}

#[test]
fn a_given_wind_is_believed_without_air_data() {
    let mut params = WindParams { believed_speed_m_s: 6.0, believed_from_rad: 0.0, ..WindParams::default() };
    assert_eq!(params.believed(None), None);
    params.belief = WindBelief::Given;
    assert_eq!(params.believed(None).unwrap().velocity, Velocity::from_m_s(0.0, -6.0));
}

/// The allowed wind is that of the parameters as long as the assumed one is at most 2 m/s stronger.
#[test]
fn the_geofence_allows_for_a_wind_that_is_stronger_than_expected() {
    let mut team = team();
    let allowed_m_s = |team: &TeamParams, speed_m_s: f64| {
        team.geofence_wind_m_s(Some(Wind { velocity: Velocity::from_polar(speed_m_s, Angle::from_rad(1.0)) }))
    };
    team.wind.get_or_insert_default().orbit_wind_m_s = 5.0;
    assert_eq!((team.geofence_wind_m_s(None), allowed_m_s(&team, 3.0), allowed_m_s(&team, 6.9)), (5.0, 5.0, 5.0));
    assert_eq!((allowed_m_s(&team, 7.1), allowed_m_s(&team, 9.9), allowed_m_s(&team, 10.1)), (8.0, 10.0, 12.0));
    assert_eq!((allowed_m_s(&team, 1e9), allowed_m_s(&team, f64::NAN)), (100.0, 5.0));
    team.wind = None;
    assert_eq!(team.geofence_wind_m_s(None), 0.0);
}

/// On every course, the circle needs no higher heading rate than the aircraft has, and no smaller circle would do in a
/// tailwind.
#[test]
fn banking_aircraft_can_fly_circles_over_ground_at_constant_airspeed() {
    let bank = Some(BankParams { bank_max_rad: 0.7, ..BankParams::default() });
    for (airspeed_m_s, wind_m_s) in [(23.0, 5.0), (23.0, 15.0), (40.0, 10.0), (16.0, 12.0)] {
        let team = TeamParams { uav: UavParams { bank, ..team().uav }, ..team() };
        let airframe = Airframe::new(team.uav, wind_m_s);
        let radius_m = airframe.circle_m(airspeed_m_s, wind_m_s);
        let wind = Wind { velocity: Velocity::from_m_s(wind_m_s, 0.0) };
        let heading_rates = (0..72).map(|step| {
            let along = Velocity::from_polar(1.0, Angle::from_deg(5.0 * f64::from(step))).vector();
            let [_, ground_speed_m_s] = wind.ground_speeds_m_s(along, [0.0, airspeed_m_s]).unwrap();
            let air_m_s = along * ground_speed_m_s - wind.velocity.vector();
            // At constant airspeed: psi' = chi' V_g / (V_a cos(psi - chi)), with chi' = V_g / r.
            ground_speed_m_s * ground_speed_m_s / (radius_m * air_m_s.dot(&along))
        });
        let highest_rad_s = heading_rates.fold(0.0, f64::max);
        let most_rad_s = team.uav.turn_rate_max_at_rad_s(airspeed_m_s);
        assert!((highest_rad_s - most_rad_s).abs() < 1e-9, "{airspeed_m_s} {wind_m_s}: {highest_rad_s} {most_rad_s}");
        assert!(airframe.circle_m(0.0, wind_m_s).is_finite());
    }
}
