//! The inner loop behind the identified aircraft: margins of stability, and flights without MAVLink and team.

use crate::common::former_loop::FormerLoop;
use crate::common::identified_aircraft::{Airframe, IdentifiedAircraft, TRUE_PER_CALIBRATED};
use crate::common::margins::{AGE_S, Condition, Gains, aircraft, dead_time, margins, margins_of, mean_over, real};
use crate::common::offline_flight::{
    Flight, Flown, InnerLoop, Known, Orbit, PERIOD_S, TargetMotion, manoeuvring, straight,
};
use standoff::research::{GRAVITY_M_S2, math};
use standoff::{Angle, Position};

/// Gains of the loop of `LawR`.
const GAINS: Gains =
    Gains { course_1_s: 0.3, radial: 0.3, integral_rad_m_s2: 5e-4, filter_s: 0.3, period_s: PERIOD_S, share: 0.72 };

const RADIUS_M: f64 = 250.0;

/// Largest part of the integral, rad/s, and largest roll, rad.
const INTEGRAL_MAX_RAD_S: f64 = 0.08;
const ROLL_MAX_RAD: f64 = 65.0 * math::PI / 180.0;

/// Law R: u = f - k (chi - chi_d) + i, with f along the velocity now, and the lateral acceleration directly to roll.
struct LawR {
    gains: Gains,
    orbit: Orbit,
    integral_rad_s: f64,
    acceleration_m_s2: f64,
    is_at_limit: bool,
}

impl LawR {
    fn new(gains: Gains, orbit: Orbit) -> Self {
        Self { gains, orbit, integral_rad_s: 0.0, acceleration_m_s2: 0.0, is_at_limit: false }
    }
}

impl InnerLoop for LawR {
    fn roll_rad(&mut self, known: &Known) -> f64 {
        let Gains { course_1_s, integral_rad_m_s2, filter_s, share, .. } = self.gains;
        let course = known.velocity.direction();
        if !self.is_at_limit {
            let error_m = known.position.distance_m(known.centre) - self.orbit.radius_m;
            let integral_rad_s = self.integral_rad_s + integral_rad_m_s2 * error_m * PERIOD_S;
            self.integral_rad_s = integral_rad_s.clamp(-INTEGRAL_MAX_RAD_S, INTEGRAL_MAX_RAD_S);
        }
        let feedback_rad_s = course_1_s * (course - self.orbit.course(known)).rad();
        let turn_rate_rad_s = self.orbit.turn_rate_rad_s(known) - feedback_rad_s + self.integral_rad_s;
        let drift_cos = math::sin_cos((known.heading - course).rad()).1;
        let desired_m_s2 = known.velocity.speed_m_s() * turn_rate_rad_s / drift_cos;
        self.acceleration_m_s2 =
            desired_m_s2 + math::exp(-PERIOD_S / filter_s) * (self.acceleration_m_s2 - desired_m_s2);
        let roll_rad = -math::atan2(self.acceleration_m_s2, share * GRAVITY_M_S2);
        self.is_at_limit = roll_rad.abs() > ROLL_MAX_RAD;
        roll_rad.clamp(-ROLL_MAX_RAD, ROLL_MAX_RAD)
    }
}

/// Flight at a true airspeed, m/s, in a wind, m/s, which blows with turbulence.
fn flight(airframe: Airframe, true_airspeed_m_s: f64, wind_m_s: f64, target: TargetMotion) -> Flight {
    let (position, course) = (Position::from_m(RADIUS_M, 0.0), Angle::from_deg(90.0));
    let aircraft = IdentifiedAircraft::new(airframe, position, course, true_airspeed_m_s / TRUE_PER_CALIBRATED)
        .in_wind([0.8 * wind_m_s, 0.6 * wind_m_s], (wind_m_s > 0.0).then_some(1));
    let orbit = Orbit { radius_m: RADIUS_M, radial_gain: GAINS.radial };
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
    let (gain_db, phase_deg) = margins(&GAINS, &Airframe::STOCK, &at);
    assert!((gain_db - 12.3).abs() < 0.5 && (phase_deg - 60.0).abs() < 1.5, "{gain_db} dB, {phase_deg} deg");
}

#[test]
fn the_gain_margin_is_at_least_6_db_and_the_phase_margin_at_least_45_degrees() {
    let mut smallest = (f64::INFINITY, f64::INFINITY);
    for airframe in [Airframe::STOCK, Airframe::COORDINATED] {
        for airspeed_m_s in [18.0, 21.0, 24.0, 27.0, 30.0] {
            for bank_deg in [0.0f64, 17.0, 25.0, 35.0] {
                let at = Condition { airspeed_m_s, bank_rad: bank_deg.to_radians(), radius_m: RADIUS_M };
                let (gain_db, phase_deg) = margins(&GAINS, &airframe, &at);
                assert!(gain_db >= 6.0 && phase_deg >= 45.0, "{at:?}: {gain_db} dB, {phase_deg} deg");
                smallest = (smallest.0.min(gain_db), smallest.1.min(phase_deg));
            }
        }
    }
    println!("smallest margins: {:.1} dB, {:.0} deg", smallest.0, smallest.1);
}

/// Flies law R; asserts limits of the size of the mean and the rms of the orbit error, m, and of the roll rate, deg/s.
fn assert_quiet(flight: Flight, [mean_m, rms_m, roll_rate_deg_s]: [f64; 3], what: &str) {
    let orbit = flight.orbit;
    let flown = flight.fly(&mut LawR::new(GAINS, orbit));
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
        let [mean_m, rms_m, max_m] = flight.fly(&mut LawR::new(GAINS, orbit)).error_m;
        println!("manoeuvring target, wind {wind_m_s} m/s: mean {mean_m:+.1}, rms {rms_m:.1}, max {max_m:.1} m");
        assert!(rms_m <= 5.0 && max_m <= 18.0, "wind {wind_m_s}: {mean_m} {rms_m} {max_m}");
    }
}
