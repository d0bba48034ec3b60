//! The inner loop behind the identified aircraft: margins of stability, and flights without MAVLink and team.

use crate::common::former_loop::FormerLoop;
use crate::common::identified_aircraft::{Airframe, IdentifiedAircraft, TRUE_PER_CALIBRATED};
use crate::common::margins::{AGE_S, Condition, Gains, aircraft, dead_time, margins, margins_of, mean_over, real};
use crate::common::offline_flight::{
    Flight, Flown, InnerLoop, Known, Orbit, PERIOD_S, TargetMotion, manoeuvring, straight,
};
use standoff::guidance::inner_loop::InnerLoopGains;
use standoff::guidance::standoff_distance::Ramp;
use standoff::{
    Angle, Demand, DesiredPath, Guidance, GuidanceParams, InnerLoopInputs, Position, TeamParams, UavState, Velocity,
    Wind,
};

const RADIUS_M: f64 = 250.0;

/// Radial gain k_l of the field.
const RADIAL_GAIN: f64 = 0.3;

/// Share of the coordinated turn rate that the loop assumes at the start.
const SHARE: f64 = 0.72;

/// Time constant of the wind estimate, s.
const WIND_S: f64 = 10.0;

/// Number of periods over which the course rate is measured.
const RATE_PERIODS: usize = 3;

/// Law and inner loop of the library, as `standoff fly` runs them.
struct LibraryLoop {
    orbit: Orbit,
    inner_loop: standoff::InnerLoop,
    wind: Option<Wind>,
    courses: Vec<Angle>,
}

impl LibraryLoop {
    fn new(orbit: Orbit) -> Self {
        Self { orbit, inner_loop: standoff::InnerLoop::start_at(0.0, SHARE), wind: None, courses: Vec::new() }
    }

    /// State over ground, with the course rate by difference.
    fn own(&mut self, known: &Known) -> UavState {
        let (course, speed_m_s) = (known.velocity.direction(), known.velocity.speed_m_s());
        self.courses.push(course);
        let before = self.courses.iter().rev().nth(RATE_PERIODS);
        let rate = |before: &Angle| (course - *before).rad() / (RATE_PERIODS as f64 * PERIOD_S);
        let turn_rate_rad_s = before.map_or(0.0, rate);
        UavState { turn_rate_rad_s, ..UavState::level_flight(known.position, course, speed_m_s) }
    }
}

/// Path of the law about a centre.
fn path(orbit: &Orbit, known: &Known) -> DesiredPath {
    let law = GuidanceParams { radial_gain: orbit.radial_gain, ..TeamParams::recommended().guidance };
    let steered = Ramp { radius_m: orbit.radius_m, rate_m_s: 0.0 };
    let (centre, centre_velocity) = (known.centre, known.centre_velocity);
    let orbit = standoff::guidance::heading::Orbit {
        centre,
        centre_velocity,
        distance_m: orbit.radius_m,
        rate_m_s: 0.0,
        steered,
    };
    DesiredPath { law, orbit, speed_m_s: known.velocity.speed_m_s() }
}

impl InnerLoop for LibraryLoop {
    fn roll_rad(&mut self, known: &Known) -> f64 {
        let own = self.own(known);
        let measured = known.velocity - Velocity::from_polar(known.true_airspeed_m_s, known.heading);
        let before = self.wind.map_or(measured, |wind| wind.velocity);
        let velocity = Velocity::from(before.vector().lerp(&measured.vector(), PERIOD_S / WIND_S));
        let wind = Wind { velocity };
        self.wind = Some(wind);
        let demand = Demand::Path(path(&self.orbit, known).guidance(0.0, &own));
        let (roll_rad, roll_max_rad) = (Some(known.roll_rad), 60f64.to_radians());
        self.inner_loop.step(&InnerLoopInputs { demand, own, wind, roll_rad, roll_max_rad }, PERIOD_S)
    }
}

/// Gains of the library at a speed, m/s, on an orbit about a centre at rest.
fn gains(speed_m_s: f64, orbit: &Orbit) -> Gains {
    let closing_rate_1_s = speed_m_s / (orbit.radial_gain * orbit.radius_m);
    let path =
        Guidance { course: Angle::ZERO, turn_rate_rad_s: 0.0, speed_m_s, right_of_path_m: 0.0, closing_rate_1_s };
    let InnerLoopGains { heading_1_s, integral_rad_s2_m, filter_s } = InnerLoopGains::of(&path);
    Gains {
        course_1_s: heading_1_s,
        radial: orbit.radial_gain,
        integral_rad_m_s2: integral_rad_s2_m,
        filter_s,
        period_s: PERIOD_S,
        share: SHARE,
    }
}

/// Flight at a true airspeed, m/s, in a wind, m/s, which blows with turbulence.
fn flight(airframe: Airframe, true_airspeed_m_s: f64, wind_m_s: f64, target: TargetMotion) -> Flight {
    let (position, course) = (Position::from_m(RADIUS_M, 0.0), Angle::from_deg(90.0));
    let aircraft = IdentifiedAircraft::new(airframe, position, course, true_airspeed_m_s / TRUE_PER_CALIBRATED)
        .in_wind([0.8 * wind_m_s, 0.6 * wind_m_s], (wind_m_s > 0.0).then_some(1));
    let orbit = Orbit { radius_m: RADIUS_M, radial_gain: RADIAL_GAIN };
    Flight { aircraft, orbit, target, centre_seed: None, ground_speed_m_s: None, seconds: [300.0, 60.0] }
}

const CRUISE_M_S: f64 = 23.0 * TRUE_PER_CALIBRATED;

#[test]
fn the_former_loop_oscillates_behind_the_identified_aircraft() {
    for (wind_m_s, ground_speed_m_s) in [(0.0, None), (5.0, None), (8.0, None), (5.0, Some(23.0))] {
        let orbit = Orbit { radius_m: RADIUS_M, radial_gain: 0.2 };
        let flight = Flight { orbit, ground_speed_m_s, ..flight(Airframe::STOCK, CRUISE_M_S, wind_m_s, straight) };
        let Flown { error_m, roll_rate_deg_s, wrong_bank, period_s } = flight.fly(&mut FormerLoop::new(orbit));
        println!("former loop, wind {wind_m_s} m/s: {error_m:.1?} m, {roll_rate_deg_s:.1} deg/s, {period_s:.2} s");
        assert!((40.0..60.0).contains(&roll_rate_deg_s), "wind {wind_m_s}: {roll_rate_deg_s} deg/s");
        assert!((1.9..2.3).contains(&period_s) && (0.25..0.4).contains(&wrong_bank), "{period_s} s, {wrong_bank}");
    }
}

/// The former loop, with a share of 0.72: a rate by difference over 0.3 s, extrapolated over L = 0.8 s, held for 0.5 s.
#[test]
fn the_computed_margins_are_those_of_the_design() {
    let at = Condition { airspeed_m_s: CRUISE_M_S, bank_rad: 17f64.to_radians(), radius_m: RADIUS_M };
    let (k, a, lag_s) = (0.4, 0.46, 0.8);
    let (former_db, _) = margins_of(|s| {
        let rate = mean_over(s, 0.3);
        let course = real(1.0) / s + rate * lag_s;
        let distance = (real(1.0) / s + lag_s) / s + rate * (0.5 * lag_s * lag_s);
        let feedback = course * (k + a) + distance * (k * a);
        feedback * mean_over(s, 0.5) * dead_time(s, AGE_S) * aircraft(s, 0.72, &Airframe::STOCK, &at)
    });
    assert!((former_db + 3.9).abs() < 0.2, "{former_db} dB");
    let orbit = Orbit { radius_m: RADIUS_M, radial_gain: RADIAL_GAIN };
    let (gain_db, phase_deg) = margins(&gains(CRUISE_M_S, &orbit), &Airframe::STOCK, &at);
    assert!((gain_db - 12.8).abs() < 0.5 && (phase_deg - 55.5).abs() < 1.5, "{gain_db} dB, {phase_deg} deg");
}

#[test]
fn the_gain_margin_is_at_least_6_db_and_the_phase_margin_at_least_45_degrees() {
    for (radius_m, radial_gain) in [(200.0, 0.3), (250.0, 0.2), (250.0, 0.3), (350.0, 0.3), (500.0, 0.3), (700.0, 0.3)]
    {
        let orbit = Orbit { radius_m, radial_gain };
        let mut smallest = (f64::INFINITY, f64::INFINITY);
        for airframe in [Airframe::STOCK, Airframe::COORDINATED] {
            for airspeed_m_s in [18.0, 21.0, 24.0, 27.0, 30.0] {
                for bank_deg in [0.0f64, 17.0, 25.0, 35.0] {
                    let at = Condition { airspeed_m_s, bank_rad: bank_deg.to_radians(), radius_m };
                    let (gain_db, phase_deg) = margins(&gains(airspeed_m_s, &orbit), &airframe, &at);
                    assert!(gain_db >= 6.0 && phase_deg >= 45.0, "{orbit:?}, {at:?}: {gain_db} dB, {phase_deg} deg");
                    smallest = (smallest.0.min(gain_db), smallest.1.min(phase_deg));
                }
            }
        }
        println!("{orbit:?}: smallest margins {:.1} dB, {:.0} deg", smallest.0, smallest.1);
    }
}

/// Flies the loop of the library; asserts limits of the size of the mean and the rms of the orbit error, m, and of the roll rate, deg/s.
fn assert_quiet(flight: Flight, [mean_m, rms_m, roll_rate_deg_s]: [f64; 3], what: &str) {
    let orbit = flight.orbit;
    let flown = flight.fly(&mut LibraryLoop::new(orbit));
    println!("{what}: {flown:.2?}");
    assert!(flown.error_m[0].abs() <= mean_m && flown.error_m[1] <= rms_m, "{what}: {flown:?}");
    assert!(flown.roll_rate_deg_s <= roll_rate_deg_s && flown.wrong_bank == 0.0, "{what}: {flown:?}");
}

#[test]
fn the_orbit_is_exact_and_quiet_in_calm_and_in_wind_with_turbulence() {
    for (wind_m_s, rms_m, roll_rate_deg_s) in [(0.0, 1.5, 1.5), (5.0, 2.5, 3.0), (8.0, 2.5, 3.0)] {
        let exact = flight(Airframe::STOCK, CRUISE_M_S, wind_m_s, straight);
        assert_quiet(exact.clone(), [0.5, rms_m, roll_rate_deg_s], &format!("wind {wind_m_s} m/s"));
        let noisy = Flight { centre_seed: Some(2), ..exact.clone() };
        assert_quiet(noisy, [1.0, 5.0, 5.0], &format!("wind {wind_m_s} m/s, noisy centre"));
        let at_ground_speed = Flight { ground_speed_m_s: Some(23.0), ..exact };
        assert_quiet(at_ground_speed, [0.5, 2.5, 7.0], &format!("wind {wind_m_s} m/s, constant ground speed"));
    }
}

#[test]
fn the_orbit_is_quiet_with_twice_the_response_and_with_more_dead_time() {
    let stock = Airframe::STOCK;
    let changed = [
        ("coordinated", Airframe::COORDINATED),
        ("6 dB more gain", stock.changed(2.0, 0.0)),
        ("0.15 s more dead time", stock.changed(1.0, 0.15)),
        ("both", stock.changed(2.0, 0.15)),
    ];
    for (what, airframe) in changed {
        for true_airspeed_m_s in [18.0, CRUISE_M_S, 30.0] {
            for (wind_m_s, roll_rate_deg_s) in [(0.0, 1.0), (5.0, 2.5)] {
                let what = format!("{what}, {true_airspeed_m_s:.0} m/s, wind {wind_m_s} m/s");
                let flight = flight(airframe, true_airspeed_m_s, wind_m_s, straight);
                assert_quiet(flight, [1.0, 5.0, roll_rate_deg_s], &what);
            }
        }
    }
}

#[test]
fn a_roll_of_30_degrees_is_no_start_of_an_oscillation() {
    let mut disturbed = flight(Airframe::STOCK, CRUISE_M_S, 0.0, straight);
    disturbed.aircraft.roll_rad = 30f64.to_radians();
    assert_quiet(Flight { seconds: [90.0, 30.0], ..disturbed }, [0.5, 1.5, 1.5], "after a roll of 30 degrees");
}

#[test]
fn a_target_that_turns_stops_and_starts_is_orbited_within_5_m_rms_and_18_m_at_most() {
    for wind_m_s in [0.0, 5.0, 8.0] {
        let flight = flight(Airframe::STOCK, CRUISE_M_S, wind_m_s, manoeuvring);
        let orbit = flight.orbit;
        let [mean_m, rms_m, max_m] = flight.fly(&mut LibraryLoop::new(orbit)).error_m;
        println!("manoeuvring target, wind {wind_m_s} m/s: mean {mean_m:+.1}, rms {rms_m:.1}, max {max_m:.1} m");
        assert!(rms_m <= 5.0 && max_m <= 18.0, "wind {wind_m_s}: {mean_m} {rms_m} {max_m}");
    }
}
