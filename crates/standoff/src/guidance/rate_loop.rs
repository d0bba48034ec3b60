//! Turn rate to roll: a coordinated turn with feedback of the measured turn rate.
//!
//! ```text
//! phi = atan(V (w + I) / g)        I' = k_I (w - w_measured),  |I| <= I_max
//! ```
//!
//! The formula without I is not accurate: an ArduPlane airframe with stock parameters turned at 0.72 of that rate at any
//! bank (measured in its simulator), because its turns are not coordinated.

use crate::math;

/// Standard gravity, m/s2.
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Gain k_I of the integral, 1/s. With 0.6/s and a bound of 0.3 rad/s the turn rate error in ArduPlane's simulator fell
/// from 28 % to 0.1 %.
const INTEGRAL_GAIN_1_S: f64 = 0.6;

/// Bound I_max of the integral, rad/s.
const INTEGRAL_MAX_RAD_S: f64 = 0.3;

/// Maximum rate of the commanded roll, rad/s: 60 deg/s, which small aircraft follow.
const ROLL_RATE_MAX_RAD_S: f64 = 60.0 * math::PI / 180.0;

/// Longest time between two steps that is integrated, s.
const STEP_MAX_S: f64 = 0.5;

/// Controller of the turn rate. Signs are those of the library: turn rates positive to the left; the returned roll is
/// positive to the right, as in MAVLink.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RateLoop {
    integral_rad_s: f64,
    /// Last commanded roll, rad, positive to the right.
    roll_rad: f64,
}

/// Inputs of one step of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateInputs {
    /// Desired turn rate w, rad/s, positive to the left.
    pub desired_rad_s: f64,
    /// Measured turn rate, rad/s, positive to the left; `None` if unknown, which pauses the integral.
    pub measured_rad_s: Option<f64>,
    /// Speed V, m/s.
    pub speed_m_s: f64,
    /// Maximum roll, rad; in [0, pi/2).
    pub roll_max_rad: f64,
}

impl RateLoop {
    /// Starts the loop at the current roll of the aircraft (rad, positive to the right), so that the first command does
    /// not step.
    pub fn start_at(roll_rad: f64) -> Self {
        Self { integral_rad_s: 0.0, roll_rad: if roll_rad.is_finite() { roll_rad } else { 0.0 } }
    }

    /// Returns the roll to command after a step of `dt_s` seconds, rad, positive to the right. It is finite and at most
    /// `roll_max_rad` for all inputs. A desired turn rate that is not finite counts as straight flight.
    pub fn step(&mut self, inputs: &RateInputs, dt_s: f64) -> f64 {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        let desired_rad_s = finite(inputs.desired_rad_s);
        let speed_m_s = finite(inputs.speed_m_s).max(1.0);
        let dt_s = finite(dt_s).clamp(0.0, STEP_MAX_S);
        let roll_max_rad = finite(inputs.roll_max_rad).clamp(0.0, 0.5 * math::PI);
        let desired_roll_rad =
            |integral_rad_s: f64| -math::atan2(speed_m_s * (desired_rad_s + integral_rad_s), GRAVITY_M_S2);

        if let Some(measured_rad_s) = inputs.measured_rad_s.filter(|rad_s| rad_s.is_finite()) {
            let change_rad_s = INTEGRAL_GAIN_1_S * (desired_rad_s - measured_rad_s) * dt_s;
            let integral_rad_s = (self.integral_rad_s + change_rad_s).clamp(-INTEGRAL_MAX_RAD_S, INTEGRAL_MAX_RAD_S);
            // Anti-windup: at a limit of the roll or of its rate, the integral may only move away from the limit.
            let excess_rad = desired_roll_rad(self.integral_rad_s) - self.roll_rad;
            let is_limited = excess_rad.abs() > ROLL_RATE_MAX_RAD_S * dt_s
                || desired_roll_rad(self.integral_rad_s).abs() > roll_max_rad;
            // More turn to the left is less roll to the right.
            let winds_up = change_rad_s * desired_roll_rad(self.integral_rad_s) < 0.0;
            if !(is_limited && winds_up) {
                self.integral_rad_s = integral_rad_s;
            }
        }
        let step_max_rad = ROLL_RATE_MAX_RAD_S * dt_s;
        let roll_rad = desired_roll_rad(self.integral_rad_s).clamp(-roll_max_rad, roll_max_rad);
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

    /// Airframe with a first-order lag of the roll that turns at a share of the coordinated rate.
    struct Airframe {
        roll_rad: f64,
        response: f64,
    }

    impl Airframe {
        const SPEED_M_S: f64 = 25.0;

        fn turn_rate_rad_s(&self) -> f64 {
            let (sin, cos) = math::sin_cos(self.roll_rad);
            -self.response * GRAVITY_M_S2 * sin / cos / Self::SPEED_M_S
        }

        /// Flies for a time with a desired turn rate; returns the turn rate at its end.
        fn fly(&mut self, rate_loop: &mut RateLoop, desired_rad_s: f64, time_s: f64) -> f64 {
            for _ in 0..(time_s / DT_S) as u32 {
                let measured_rad_s = Some(self.turn_rate_rad_s());
                let inputs = RateInputs {
                    desired_rad_s,
                    measured_rad_s,
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
            let mut airframe = Airframe { roll_rad: 0.0, response: 0.72 };
            let without = airframe.fly(&mut RateLoop::default(), desired_rad_s, 1.5);
            assert!((without / desired_rad_s) < 0.95, "{desired_deg_s}: {without}");
            let flown_rad_s = airframe.fly(&mut RateLoop::default(), desired_rad_s, 20.0);
            assert!((flown_rad_s / desired_rad_s - 1.0).abs() < 0.005, "{desired_deg_s}: {flown_rad_s}");
        }
    }

    /// After a minute at a limit, the loop leaves the limit as fast as after ten seconds.
    #[test]
    fn the_integral_does_not_wind_up_at_the_limit_of_the_roll() {
        let after = |time_s| {
            let (mut rate_loop, mut airframe) = (RateLoop::default(), Airframe { roll_rad: 0.0, response: 0.72 });
            airframe.fly(&mut rate_loop, 0.6, time_s);
            assert!((airframe.roll_rad + ROLL_MAX_RAD).abs() < 1e-3, "{}", airframe.roll_rad);
            airframe.fly(&mut rate_loop, 0.1, 4.0)
        };
        let (soon, late) = (after(10.0), after(60.0));
        assert!((soon - late).abs() < 1e-6 && (late - 0.1).abs() < 0.03, "{soon} {late}");
    }

    #[test]
    fn the_roll_moves_at_most_60_degrees_per_second_and_starts_at_the_current_one() {
        let mut rate_loop = RateLoop::start_at(0.3);
        let inputs =
            RateInputs { desired_rad_s: 0.5, measured_rad_s: None, speed_m_s: 25.0, roll_max_rad: ROLL_MAX_RAD };
        let rolls_rad = [0; 4].map(|_| rate_loop.step(&inputs, DT_S));
        let expected = [1.0, 2.0, 3.0, 4.0].map(|steps| (0.3 - steps * ROLL_RATE_MAX_RAD_S * DT_S).max(-ROLL_MAX_RAD));
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
            steps in prop::collection::vec([any_number(), any_number(), any_number(), any_number()], 1..20),
            roll_max_rad in 0.0..1.5f64,
        ) {
            let mut rate_loop = RateLoop::start_at(steps[0][0]);
            for [desired_rad_s, measured_rad_s, speed_m_s, dt_s] in steps {
                let inputs = RateInputs { desired_rad_s, measured_rad_s: Some(measured_rad_s), speed_m_s, roll_max_rad };
                let roll_rad = rate_loop.step(&inputs, dt_s);
                prop_assert!(roll_rad.abs() <= roll_max_rad, "{roll_rad}");
                prop_assert!(rate_loop.integral_rad_s.abs() <= INTEGRAL_MAX_RAD_S);
            }
        }
    }
}
