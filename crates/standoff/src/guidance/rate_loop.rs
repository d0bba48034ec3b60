//! Turn rate to roll: a coordinated turn, and an estimate of how the aircraft turns instead.
//!
//! ```text
//! phi = atan(V (w + d) / (f g))        e = w_measured - (f c - d),   c = g tan(phi_measured) / V
//! f' = k_f e c / (c^2 + c_0^2)         d' = -k_d e
//! ```
//!
//! c is the rate of a coordinated turn. Aircraft turn at other rates: an ArduPlane airframe with stock parameters at
//! 0.72 of it at any bank (measured in its simulator), because its turns are not coordinated, and an airframe that is
//! not symmetric turns with level wings. Hence a factor f, which stays right when the turn is reversed, and a deficit
//! d, which follows more slowly. The estimates use the measured roll, so that the lag and the rate limit of the roll
//! do not change them. An integral of w - w_measured instead adds its own lag: with it, aircraft of JSBSim rolled
//! between -50 and 50 degrees all the time.

use std::ops::RangeInclusive;

use crate::atmosphere::GRAVITY_M_S2;
use crate::bank::ROLL_COMMAND_RATE_MAX_RAD_S;
use crate::math;

/// Rate k_f at which the factor f follows in turns, 1/s.
const FACTOR_RATE_1_S: f64 = 0.5;

/// Bounds of f: the default dynamics of a scenario have 1, uncoordinated airframes at least 0.7.
const FACTOR: RangeInclusive<f64> = 0.4..=1.5;

/// Turn rate c_0 at which f follows at half of k_f, rad/s. In slower turns, errors of the measurements dominate.
const FACTOR_TURN_RAD_S: f64 = 0.05;

/// Rate k_d at which the deficit d follows, 1/s.
const DEFICIT_RATE_1_S: f64 = 0.1;

/// Bound of the deficit, rad/s.
const DEFICIT_MAX_RAD_S: f64 = 0.3;

/// Largest measured roll for which a turn rate is computed, rad.
const MEASURED_ROLL_MAX_RAD: f64 = 80.0 * math::PI / 180.0;

/// Longest time between two steps that counts, s.
const STEP_MAX_S: f64 = 0.5;

/// Controller of the turn rate. Signs are those of the library: turn rates positive to the left; the returned roll is
/// positive to the right, as in MAVLink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateLoop {
    /// Estimated turn rate as a share of that of a coordinated turn.
    factor: f64,
    /// Estimated turn rate that is missing in addition, rad/s, positive to the left.
    deficit_rad_s: f64,
    /// Last commanded roll, rad, positive to the right.
    roll_rad: f64,
}

/// Inputs of one step of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateInputs {
    /// Desired turn rate w, rad/s, positive to the left.
    pub desired_rad_s: f64,
    /// Measured turn rate, rad/s, positive to the left; `None` if unknown, which keeps the estimates.
    pub measured_rad_s: Option<f64>,
    /// Measured roll, rad, positive to the right; `None` if unknown, which keeps the estimates.
    pub measured_roll_rad: Option<f64>,
    /// Speed V, m/s.
    pub speed_m_s: f64,
    /// Maximum roll, rad; in [0, pi/2).
    pub roll_max_rad: f64,
}

impl Default for RateLoop {
    fn default() -> Self {
        Self { factor: 1.0, deficit_rad_s: 0.0, roll_rad: 0.0 }
    }
}

impl RateLoop {
    /// Starts the loop at the current roll of the aircraft (rad, positive to the right), so that the first command does
    /// not step.
    pub fn start_at(roll_rad: f64) -> Self {
        Self { roll_rad: if roll_rad.is_finite() { roll_rad } else { 0.0 }, ..Self::default() }
    }

    /// Returns the roll to command after a step of `dt_s` seconds, rad, positive to the right. It is finite and at most
    /// `roll_max_rad` for all inputs. A desired turn rate that is not finite counts as straight flight.
    pub fn step(&mut self, inputs: &RateInputs, dt_s: f64) -> f64 {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        let desired_rad_s = finite(inputs.desired_rad_s);
        let speed_m_s = finite(inputs.speed_m_s).max(1.0);
        let dt_s = finite(dt_s).clamp(0.0, STEP_MAX_S);
        let roll_max_rad = finite(inputs.roll_max_rad).clamp(0.0, 0.5 * math::PI);

        let measured = inputs.measured_rad_s.zip(inputs.measured_roll_rad);
        if let Some((measured_rad_s, roll_rad)) = measured.filter(|(a, b)| a.is_finite() && b.is_finite()) {
            let (sin, cos) = math::sin_cos(roll_rad.clamp(-MEASURED_ROLL_MAX_RAD, MEASURED_ROLL_MAX_RAD));
            let coordinated_rad_s = -GRAVITY_M_S2 * sin / cos / speed_m_s;
            let error_rad_s = measured_rad_s - (self.factor * coordinated_rad_s - self.deficit_rad_s);
            let squares = coordinated_rad_s * coordinated_rad_s + FACTOR_TURN_RAD_S * FACTOR_TURN_RAD_S;
            let turn = coordinated_rad_s / squares;
            let factor = self.factor + FACTOR_RATE_1_S * dt_s * error_rad_s * turn;
            self.factor = factor.clamp(*FACTOR.start(), *FACTOR.end());
            let deficit_rad_s = self.deficit_rad_s - DEFICIT_RATE_1_S * dt_s * error_rad_s;
            self.deficit_rad_s = deficit_rad_s.clamp(-DEFICIT_MAX_RAD_S, DEFICIT_MAX_RAD_S);
        }
        let step_max_rad = ROLL_COMMAND_RATE_MAX_RAD_S * dt_s;
        let roll_rad = -math::atan2(speed_m_s * (desired_rad_s + self.deficit_rad_s), self.factor * GRAVITY_M_S2);
        let roll_rad = roll_rad.clamp(-roll_max_rad, roll_max_rad);
        self.roll_rad = roll_rad.clamp(self.roll_rad - step_max_rad, self.roll_rad + step_max_rad);
        self.roll_rad = self.roll_rad.clamp(-roll_max_rad, roll_max_rad);
        self.roll_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT_S: f64 = 0.1;
    const ROLL_MAX_RAD: f64 = 0.8;

    /// Airframe with a first-order lag of the roll that turns at a share of the coordinated rate, and with level wings.
    struct Airframe {
        roll_rad: f64,
        response: f64,
        level_rad_s: f64,
    }

    impl Airframe {
        const SPEED_M_S: f64 = 25.0;

        fn new(response: f64) -> Self {
            Self { roll_rad: 0.0, response, level_rad_s: 0.0 }
        }

        fn turn_rate_rad_s(&self) -> f64 {
            let (sin, cos) = math::sin_cos(self.roll_rad);
            self.level_rad_s - self.response * GRAVITY_M_S2 * sin / cos / Self::SPEED_M_S
        }

        /// Flies for a time with a desired turn rate; returns the turn rate at its end.
        fn fly(&mut self, rate_loop: &mut RateLoop, desired_rad_s: f64, time_s: f64) -> f64 {
            for _ in 0..(time_s / DT_S) as u32 {
                let measured_rad_s = Some(self.turn_rate_rad_s());
                let inputs = RateInputs {
                    desired_rad_s,
                    measured_rad_s,
                    measured_roll_rad: Some(self.roll_rad),
                    speed_m_s: Self::SPEED_M_S,
                    roll_max_rad: ROLL_MAX_RAD,
                };
                let roll_rad = rate_loop.step(&inputs, DT_S);
                self.roll_rad += (roll_rad - self.roll_rad) * DT_S / 0.4;
            }
            self.turn_rate_rad_s()
        }
    }

    #[test]
    fn the_measured_shortfall_of_28_percent_is_removed_for_turns_to_both_sides() {
        for desired_deg_s in [5.0f64, -8.0, 12.0] {
            let desired_rad_s = desired_deg_s.to_radians();
            let mut airframe = Airframe::new(0.72);
            let without = airframe.fly(&mut RateLoop::default(), desired_rad_s, 1.5);
            assert!((without / desired_rad_s) < 0.95, "{desired_deg_s}: {without}");
            let flown_rad_s = airframe.fly(&mut RateLoop::default(), desired_rad_s, 20.0);
            assert!((flown_rad_s / desired_rad_s - 1.0).abs() < 0.005, "{desired_deg_s}: {flown_rad_s}");
        }
    }

    #[test]
    fn the_lag_of_the_roll_is_not_a_deficit() {
        let (mut rate_loop, mut airframe) = (RateLoop::default(), Airframe::new(1.0));
        for desired_rad_s in [0.25, -0.25, 0.25] {
            airframe.fly(&mut rate_loop, desired_rad_s, 0.8);
            assert!(rate_loop.deficit_rad_s.abs() < 1e-9 && (rate_loop.factor - 1.0).abs() < 1e-9, "{rate_loop:?}");
        }
    }

    /// After a minute at a limit, the loop leaves the limit as fast as after ten seconds.
    #[test]
    fn the_deficit_does_not_wind_up_at_the_limit_of_the_roll() {
        let after = |time_s| {
            let (mut rate_loop, mut airframe) = (RateLoop::default(), Airframe::new(0.72));
            airframe.fly(&mut rate_loop, 0.6, time_s);
            assert!((airframe.roll_rad + ROLL_MAX_RAD).abs() < 1e-3, "{}", airframe.roll_rad);
            airframe.fly(&mut rate_loop, 0.1, 4.0)
        };
        let (soon, late) = (after(10.0), after(60.0));
        assert!((soon - late).abs() < 1e-3 && (late - 0.1).abs() < 0.03, "{soon} {late}");
    }

    /// An estimate of the missing turn rate alone would be wrong by twice 0.05 rad/s here.
    #[test]
    fn a_reversed_turn_needs_no_new_estimate() {
        let (mut rate_loop, mut airframe) = (RateLoop::default(), Airframe::new(0.72));
        airframe.fly(&mut rate_loop, 0.15, 20.0);
        for (desired_rad_s, time_s) in [(-0.15, 2.5), (0.05, 2.0), (0.2, 2.0)] {
            let flown_rad_s = airframe.fly(&mut rate_loop, desired_rad_s, time_s);
            assert!((flown_rad_s - desired_rad_s).abs() < 0.01, "{desired_rad_s}: {flown_rad_s}");
        }
    }

    #[test]
    fn an_aircraft_that_turns_with_level_wings_flies_straight() {
        let (mut rate_loop, mut airframe) = (RateLoop::default(), Airframe { level_rad_s: 0.03, ..Airframe::new(1.0) });
        let flown_rad_s = airframe.fly(&mut rate_loop, 0.0, 60.0);
        assert!(flown_rad_s.abs() < 2e-3, "{flown_rad_s}");
    }

    #[test]
    fn the_roll_moves_at_most_60_degrees_per_second_and_starts_at_the_current_one() {
        let mut rate_loop = RateLoop::start_at(0.3);
        let inputs = RateInputs {
            desired_rad_s: 0.5,
            measured_rad_s: None,
            measured_roll_rad: None,
            speed_m_s: 25.0,
            roll_max_rad: ROLL_MAX_RAD,
        };
        let rolls_rad = [0; 4].map(|_| rate_loop.step(&inputs, DT_S));
        let expected =
            [1.0, 2.0, 3.0, 4.0].map(|steps| (0.3 - steps * ROLL_COMMAND_RATE_MAX_RAD_S * DT_S).max(-ROLL_MAX_RAD));
        for (roll_rad, expected) in rolls_rad.into_iter().zip(expected) {
            assert!((roll_rad - expected).abs() < 1e-12);
        }
    }

    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![-2.0..2.0f64, any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
    }

    proptest! {
        #[test]
        fn every_command_is_finite_and_within_the_limit(
            steps in prop::collection::vec([(); 5].map(|()| any_number()), 1..20),
            roll_max_rad in 0.0..1.5f64,
        ) {
            let mut rate_loop = RateLoop::start_at(steps[0][0]);
            for [desired_rad_s, measured_rad_s, measured_roll_rad, speed_m_s, dt_s] in steps {
                let [measured_rad_s, measured_roll_rad] = [measured_rad_s, measured_roll_rad].map(Some);
                let inputs = RateInputs { desired_rad_s, measured_rad_s, measured_roll_rad, speed_m_s, roll_max_rad };
                let roll_rad = rate_loop.step(&inputs, dt_s);
                prop_assert!(roll_rad.abs() <= roll_max_rad, "{roll_rad}");
                prop_assert!(FACTOR.contains(&rate_loop.factor) && rate_loop.deficit_rad_s.abs() <= DEFICIT_MAX_RAD_S);
            }
        }
    }
}
