use standoff::math;
use standoff::safety::motion::Motion;
use standoff::{Angle, ClimbParams, Position, TeamParams};

use super::*;

const AIRCRAFT: BankParams = BankParams {
    bank_max_rad: 1.0,
    roll_rate_max_rad_s: 0.8,
    roll_lag_s: 0.4,
    turn_factor: 0.72,
    climb_full_power_m_s: 5.0,
    sink_idle_m_s: 2.0,
};

/// An aircraft in flight, 16 to 30 m/s.
struct Flight {
    model: BankParams,
    uav: UavParams,
    motion: BankMotion,
    state: UavState,
    flies_equivalent_airspeed: bool,
}

impl Flight {
    fn new(model: BankParams) -> Self {
        let climb = Some(ClimbParams { rate_max_m_s: 10.0, lag_s: 0.5, ..ClimbParams::default() });
        let uav = UavParams { speed_m_s: 23.0, speed_change_max_m_s: 7.0, climb, ..TeamParams::recommended().uav };
        let level = UavState::level_flight(Position::ORIGIN, Angle::from_deg(0.0), 23.0);
        let vertical = Some(Vertical { altitude_m: 300.0, climb_rate_m_s: 0.0 });
        Self {
            model,
            uav,
            motion: BankMotion::level(&model),
            state: UavState { vertical, ..level },
            flies_equivalent_airspeed: false,
        }
    }

    /// Flies for a time in steps of `period_s`, and calls `check` with the state before and after each step.
    fn hold(
        &mut self,
        speed_m_s: f64,
        turn_rate_rad_s: f64,
        altitude_m: f64,
        (time_s, period_s): (f64, f64),
        mut check: impl FnMut((&BankMotion, &UavState), (&BankMotion, &UavState)),
    ) {
        let command = Command { speed_m_s, turn_rate_rad_s };
        let period = Duration::from_s(period_s);
        let flies_equivalent_airspeed = self.flies_equivalent_airspeed;
        let held = HeldCommand {
            command,
            path: None,
            assumed_wind: Wind::default(),
            navigation_error: None,
            air: Velocity::ZERO,
            altitude_m: Some(altitude_m),
            height_m: 300.0,
            period,
            flies_equivalent_airspeed,
        };
        for _ in 0..(time_s / period_s).round() as u32 {
            let (motion, state) = (self.motion, self.state);
            self.state = self.motion.fly(&self.model, &self.uav, &state, &held);
            check((&motion, &state), (&self.motion, &self.state));
        }
    }

    fn altitude_m(&self) -> f64 {
        self.state.vertical.unwrap().altitude_m
    }
}

/// In equilibrium the turn rate is the commanded one, at the bank angle of a turn with that factor; to the left, the bank
/// is negative.
#[test]
fn the_equilibrium_turn_rate_is_the_commanded_one() {
    for (turn_factor, rate_rad_s) in [(1.0, 0.3), (1.0, -0.2), (0.72, 0.2), (0.72, -0.3)] {
        let mut flight = Flight::new(BankParams { turn_factor, ..AIRCRAFT });
        flight.hold(23.0, rate_rad_s, 300.0, (40.0, 0.5), |_, _| {});
        assert!((flight.state.turn_rate_rad_s - rate_rad_s).abs() < 1e-4, "{:?}", flight.state);
        let bank_rad = -math::atan2(rate_rad_s * 23.0, turn_factor * GRAVITY_M_S2);
        assert!((flight.motion.bank_rad - bank_rad).abs() < 1e-3, "{} {bank_rad}", flight.motion.bank_rad);
    }
    // A coordinated turn at 45 degrees.
    let coordinated = BankParams { turn_factor: 1.0, ..AIRCRAFT };
    assert!((coordinated.turn_rate_rad_s(-0.25 * math::PI, 20.0) - GRAVITY_M_S2 / 20.0).abs() < 1e-12);
}

/// Reversals of the turn reach the maximum roll rate and the maximum bank angle, and never exceed them.
#[test]
fn the_roll_rate_and_the_bank_angle_stay_within_their_limits() {
    let mut flight = Flight::new(AIRCRAFT);
    let (mut fastest_rad_s, mut steepest_rad) = (0.0f64, 0.0f64);
    for rate_rad_s in [2.0, -2.0, 0.1, 2.0, -0.3] {
        flight.hold(23.0, rate_rad_s, 300.0, (4.0, 0.02), |(before, _), (after, _)| {
            fastest_rad_s = fastest_rad_s.max((after.bank_rad - before.bank_rad).abs() / 0.02);
            steepest_rad = steepest_rad.max(after.bank_rad.abs());
        });
    }
    assert!((0.799..=0.8 + 1e-9).contains(&fastest_rad_s), "{fastest_rad_s}");
    assert!((0.99..=1.0).contains(&steepest_rad), "{steepest_rad}");
}

/// After a minute at the maximum bank angle, the aircraft leaves it as fast as after ten seconds. Two seconds later, it
/// still turns faster than commanded: the estimate of the missing turn rate is that of the large bank angle.
#[test]
fn the_command_does_not_wind_up_at_the_maximum_bank() {
    let after = |time_s| {
        let mut flight = Flight::new(AIRCRAFT);
        flight.hold(23.0, 1.0, 300.0, (time_s, 0.5), |_, _| {});
        assert!((flight.motion.bank_rad + 1.0).abs() < 1e-3, "{}", flight.motion.bank_rad);
        flight.hold(23.0, 0.1, 300.0, (2.0, 0.5), |_, _| {});
        flight.state.turn_rate_rad_s
    };
    let (soon, late) = (after(10.0), after(60.0));
    assert!((soon - late).abs() < 1e-3 && (0.1..0.2).contains(&late), "{soon} {late}");
}

/// The energy per mass never changes faster than the power allows. A climb at 10 m/s with power for 5 m/s costs speed
/// down to the lowest one, then continues at 5 m/s.
#[test]
fn a_climb_costs_speed_and_a_descent_gives_it_back() {
    let energy =
        |state: &UavState| 0.5 * state.speed_m_s * state.speed_m_s + GRAVITY_M_S2 * state.vertical.unwrap().altitude_m;
    let mut flight = Flight::new(AIRCRAFT);
    let (full, idle) = (5.0 * GRAVITY_M_S2 * 0.02, -2.0 * GRAVITY_M_S2 * 0.02);
    let check = |(_, before): (&BankMotion, &UavState), (_, after): (&BankMotion, &UavState)| {
        let change = energy(after) - energy(before);
        assert!((idle - 1e-6..=full + 1e-6).contains(&change), "{change}: {before:?} {after:?}");
        assert!((15.5..=30.5).contains(&after.speed_m_s), "{after:?}");
    };
    flight.hold(23.0, 0.0, 900.0, (30.0, 0.02), check);
    assert!((flight.state.speed_m_s - 16.0).abs() < 0.1, "{:?}", flight.state);
    assert!((flight.state.vertical.unwrap().climb_rate_m_s - 5.0).abs() < 1e-9, "{:?}", flight.state);
    flight.hold(23.0, 0.0, 300.0, (15.0, 0.02), check);
    assert!((flight.state.speed_m_s - 30.0).abs() < 0.1, "{:?}", flight.state);
    flight.hold(23.0, 0.0, 300.0, (300.0, 0.02), check);
    assert!((flight.state.speed_m_s - 23.0).abs() < 1e-3 && (flight.altitude_m() - 300.0).abs() < 1e-2);
    // In level flight, full power accelerates by g c / V.
    let before_m_s = flight.state.speed_m_s;
    flight.hold(30.0, 0.0, 300.0, (0.5, 0.5), |_, _| {});
    let expected_m_s = 0.5 * GRAVITY_M_S2 * 5.0 / 23.0;
    assert!((flight.state.speed_m_s - before_m_s - expected_m_s).abs() < 0.03, "{:?}", flight.state);
}

/// The density at 3,000 m is 0.742 of that at sea level: an equivalent airspeed of 23 m/s is 26.7 m/s.
#[test]
fn a_command_taken_as_equivalent_airspeed_is_faster_at_altitude() {
    for (flies_equivalent_airspeed, expected_m_s) in [(false, 23.0), (true, 26.70)] {
        let mut flight = Flight { flies_equivalent_airspeed, ..Flight::new(AIRCRAFT) };
        flight.state.vertical = Some(Vertical { altitude_m: 3000.0, climb_rate_m_s: 0.0 });
        flight.hold(23.0, 0.0, 3000.0, (60.0, 0.5), |_, _| {});
        assert!((flight.state.speed_m_s - expected_m_s).abs() < 0.02, "{:?}", flight.state);
    }
    assert!((true_airspeed_m_s(1.0, -100.0) - 1.0).abs() < 1e-12);
}

/// Agents predict the flown path: of reversed turns and of changes of speed, from steady turns.
#[test]
fn the_prediction_of_an_agent_is_flown() {
    for roll_rate_max_rad_s in [0.4, 3.0] {
        let aircraft = BankParams { turn_factor: 1.0, roll_rate_max_rad_s, ..AIRCRAFT };
        for (from_rad_s, to_rad_s, speed_m_s) in [(0.3, -0.3, 23.0), (-0.2, 0.3, 16.0), (0.0, 0.4, 30.0)] {
            let mut flight = Flight::new(aircraft);
            flight.hold(23.0, from_rad_s, 300.0, (60.0, 0.5), |_, _| {});
            let uav = UavParams { bank: Some(aircraft), ..flight.uav };
            let command = Command { speed_m_s, turn_rate_rad_s: to_rad_s };
            let start = Motion::steady(&uav, &flight.state);
            let predicted = uav.response(Duration::from_s(8.0)).advance(&start, command).state;
            flight.hold(speed_m_s, to_rad_s, 300.0, (8.0, 0.5), |_, _| {});
            let off_m = flight.state.position.distance_m(predicted.position);
            assert!(off_m < 2.0, "{from_rad_s} to {to_rad_s} rad/s: {off_m} m");
            assert!((flight.state.speed_m_s - predicted.speed_m_s).abs() < 0.1, "{predicted:?} {:?}", flight.state);
        }
    }
}

/// On a circle, the aircraft flies the path of the kinematic model.
#[test]
fn a_settled_turn_is_that_of_the_kinematic_model() {
    for (turn_factor, rate_rad_s) in [(1.0, 0.2), (0.72, 0.3), (1.0, -0.25)] {
        let mut flight = Flight::new(BankParams { turn_factor, ..AIRCRAFT });
        flight.hold(25.0, rate_rad_s, 300.0, (60.0, 0.5), |_, _| {});
        let mut kinematic = flight.state;
        let response = flight.uav.response(Duration::from_s(0.5));
        for _ in 0..120 {
            kinematic = response.step(&kinematic, Command { speed_m_s: 25.0, turn_rate_rad_s: rate_rad_s });
            flight.hold(25.0, rate_rad_s, 300.0, (0.5, 0.5), |_, _| {});
            let off_m = flight.state.position.distance_m(kinematic.position);
            assert!(off_m < 0.1, "{off_m} m: {:?} {kinematic:?}", flight.state);
        }
    }
}
