//! Inner loop of an aircraft that banks: from guidance to a roll command, about every 0.1 s.
//!
//! ```text
//! psi'  = (f + i) dpsi/dchi - k (psi - psi_d)      i' = k a / (V T_i) d,  |i| <= i_max      heading rate
//! a'    = (V_a psi' - a) / tau_a                   phi_c = -atan(a / (s g))       lateral acceleration, roll
//! ```
//!
//! A turn that avoids an aircraft or a zone is demanded as psi' itself. Its prediction has the same tau_a.
//!
//! f is the turn rate of the path, as the law returns it for the position and velocity of the UAV now, and psi_d the
//! heading of its course chi_d at the airspeed V_a, by the wind triangle; d is the distance to the right of the path, and a
//! its closing rate. Near the path the course has the gain k + a, so that k is smaller on paths that close fast. Nothing
//! is extrapolated over the lag of the aircraft: that would differentiate the course, and aircraft that answer faster
//! than their model then roll from side to side. The integral i replaces what is missing in a steady turn, and tau_a
//! makes the gain fall where the aircraft rolls late. The tests compute the margins of the loop for an identified
//! aircraft.
//!
//! Aircraft turn at a share s of the coordinated rate: an ArduPlane airframe with stock parameters at 0.72 (measured in
//! its simulator), because its turns are not coordinated. The estimate of s compares the measured turn with that of the
//! measured roll, both low-passed, so that the delay between them has no effect:
//!
//! ```text
//! s' = k_s c (w - s c) / (c^2 + c_0^2)    c = -g tan(phi) / V_a
//! ```

use std::ops::RangeInclusive;

use crate::atmosphere::GRAVITY_M_S2;
use crate::bank::{BANK_COMMAND_LAG_S, next_bank_command_rad};
use crate::guidance::followed::Guidance;
use crate::math;
use crate::uav::UavState;
use crate::wind::Wind;

/// Sum of the gain k on the error of the heading and the closing rate a of the path, 1/s: near its path, the loop has the
/// gain k + a on the course.
const COURSE_GAIN_1_S: f64 = 0.7;

/// Bounds of k, 1/s.
const HEADING_GAIN_1_S: RangeInclusive<f64> = 0.1..=0.3;

/// Time constant T_i of the integral, s: k_i = k a / (V T_i).
const INTEGRAL_TIME_S: f64 = 8.0;

/// Bound of the integral, rad/s.
const INTEGRAL_MAX_RAD_S: f64 = 0.08;

/// Distance from the path beyond which the integral stays as it is, m: the UAV then still approaches its orbit.
const INTEGRAL_REACH_M: f64 = 30.0;

/// Bounds of the share s.
const SHARE: RangeInclusive<f64> = 0.5..=1.2;

/// Rate k_s at which the share follows in turns, 1/s.
const SHARE_RATE_1_S: f64 = 0.1;

/// Turn rate c_0 at which the share follows at half of that rate, rad/s.
const SHARE_TURN_RAD_S: f64 = 0.05;

/// Time constant with which measured turns are low-passed for the share, s.
const SHARE_LAG_S: f64 = 3.0;

/// Largest roll for which a turn rate is computed, measured or commanded, rad.
const ROLL_MAX_RAD: f64 = 80.0 * math::PI / 180.0;

/// Lowest speed by which rates are computed, m/s.
const SPEED_MIN_M_S: f64 = 1.0;

/// Longest time between two steps that counts, s.
const STEP_MAX_S: f64 = 0.5;

/// Gains of the loop on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnerLoopGains {
    /// Gain k on the error of the heading, 1/s.
    pub heading_1_s: f64,
    /// Gain k_i = k a / (V T_i) on the distance from the path, rad/(s2 m).
    pub integral_rad_s2_m: f64,
    /// Time constant tau_a of the commanded acceleration, s.
    pub filter_s: f64,
}

impl InnerLoopGains {
    /// Returns the gains on a path.
    pub fn of(path: &Guidance) -> Self {
        // Unlike `clamp`, this accepts a rate that is not a number.
        let heading_1_s =
            (COURSE_GAIN_1_S - path.closing_rate_1_s).max(*HEADING_GAIN_1_S.start()).min(*HEADING_GAIN_1_S.end());
        let time_m = path.speed_m_s.max(SPEED_MIN_M_S) * INTEGRAL_TIME_S;
        let integral_rad_s2_m = heading_1_s * path.closing_rate_1_s / time_m;
        Self { heading_1_s, integral_rad_s2_m, filter_s: BANK_COMMAND_LAG_S }
    }
}

/// What the loop flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Demand {
    /// A path over ground.
    Path(Guidance),
    /// A turn rate of the heading, rad/s, positive to the left.
    Turn(f64),
}

/// Inputs of one step of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnerLoopInputs {
    /// What to fly.
    pub demand: Demand,
    /// State over ground now; its turn rate is the measured one.
    pub own: UavState,
    /// Wind that the UAV assumes; zero in calm air.
    pub wind: Wind,
    /// Measured roll, rad, positive to the right; `None` if unknown, which keeps the share.
    pub roll_rad: Option<f64>,
    /// Maximum roll, rad; in [0, pi/2).
    pub roll_max_rad: f64,
}

/// Controller of the roll of one aircraft. Turn rates are positive to the left; the roll is positive to the right, as in
/// MAVLink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnerLoop {
    /// Share s of the coordinated turn rate.
    share: f64,
    /// Integral i, rad/s.
    integral_rad_s: f64,
    /// Low-passed turn rate, and that of a coordinated turn at the measured roll, rad/s.
    turns_rad_s: [f64; 2],
    /// Last commanded roll, rad.
    roll_rad: f64,
}

impl InnerLoop {
    /// Starts the loop at the current roll of the aircraft, rad, positive to the right, so that the first command does
    /// not step. `share` is the share of the coordinated turn rate at which the aircraft is expected to turn.
    pub fn start_at(roll_rad: f64, share: f64) -> Self {
        let roll_rad = if roll_rad.is_finite() { limited_rad(roll_rad, ROLL_MAX_RAD) } else { 0.0 };
        let share = if share.is_finite() { share.clamp(*SHARE.start(), *SHARE.end()) } else { 1.0 };
        Self { share, integral_rad_s: 0.0, turns_rad_s: [0.0; 2], roll_rad }
    }

    /// Returns the roll to command after a step of `dt_s` seconds, rad, positive to the right. It is finite and at most
    /// `roll_max_rad` for all inputs. A demand that is not finite counts as straight flight.
    pub fn step(&mut self, inputs: &InnerLoopInputs, dt_s: f64) -> f64 {
        let dt_s = finite(dt_s).clamp(0.0, STEP_MAX_S);
        let roll_max_rad = finite(inputs.roll_max_rad).clamp(0.0, ROLL_MAX_RAD);
        let airspeed_m_s = finite(inputs.wind.air_velocity(inputs.own.velocity()).airspeed_m_s).max(SPEED_MIN_M_S);
        self.follow_share(inputs, airspeed_m_s, dt_s);
        let demanded_m_s2 = match inputs.demand {
            Demand::Path(path) => self.path_acceleration_m_s2(&path, inputs, (airspeed_m_s, roll_max_rad), dt_s),
            Demand::Turn(turn_rate_rad_s) => airspeed_m_s * turn_rate_rad_s,
        };
        self.roll_rad = next_bank_command_rad(self.roll_rad, finite(demanded_m_s2), (self.share, roll_max_rad), dt_s);
        self.roll_rad
    }

    /// Lateral acceleration that leads onto a path, m/s2.
    fn path_acceleration_m_s2(
        &mut self,
        path: &Guidance,
        InnerLoopInputs { own, wind, .. }: &InnerLoopInputs,
        (airspeed_m_s, roll_max_rad): (f64, f64),
        dt_s: f64,
    ) -> f64 {
        let gains = InnerLoopGains::of(path);
        let is_limited = self.roll_rad.abs() >= roll_max_rad;
        if !is_limited && path.right_of_path_m.abs() <= INTEGRAL_REACH_M {
            let added_rad_s = finite(gains.integral_rad_s2_m * path.right_of_path_m) * dt_s;
            self.integral_rad_s = (self.integral_rad_s + added_rad_s).clamp(-INTEGRAL_MAX_RAD_S, INTEGRAL_MAX_RAD_S);
        }
        airspeed_m_s * wind.heading_rate_rad_s(own, path, gains.heading_1_s, self.integral_rad_s, false)
    }

    /// Updates the share of the coordinated turn rate from the measured turn and roll.
    fn follow_share(&mut self, inputs: &InnerLoopInputs, airspeed_m_s: f64, dt_s: f64) {
        let Some(roll_rad) = inputs.roll_rad.filter(|roll_rad| roll_rad.is_finite()) else { return };
        let (sin, cos) = math::sin_cos(limited_rad(roll_rad, ROLL_MAX_RAD));
        let gain = 1.0 - math::exp(-dt_s / SHARE_LAG_S);
        let turn_rad_s = inputs.wind.measured_heading_rate_rad_s(&inputs.own);
        let measured = [finite(turn_rad_s), -GRAVITY_M_S2 * sin / cos / airspeed_m_s];
        for (slow, rad_s) in self.turns_rad_s.iter_mut().zip(measured) {
            *slow += gain * (rad_s - *slow);
        }
        let [turn_rad_s, coordinated_rad_s] = self.turns_rad_s;
        let squares = coordinated_rad_s * coordinated_rad_s + SHARE_TURN_RAD_S * SHARE_TURN_RAD_S;
        let error_rad_s = turn_rad_s - self.share * coordinated_rad_s;
        let share = self.share + SHARE_RATE_1_S * dt_s * error_rad_s * coordinated_rad_s / squares;
        self.share = share.clamp(*SHARE.start(), *SHARE.end());
    }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

/// Limits an angle to both sides, rad.
fn limited_rad(angle_rad: f64, max_rad: f64) -> f64 {
    angle_rad.clamp(-max_rad, max_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::bank::ROLL_COMMAND_RATE_MAX_RAD_S;
    use crate::frame::{Displacement, Position, Velocity};
    use proptest::prelude::*;

    const DT_S: f64 = 0.1;
    const LIMIT_RAD: f64 = 0.8;
    const AIRSPEED_M_S: f64 = 25.0;
    const RADIUS_M: f64 = 250.0;

    /// Aircraft with a first-order lag of the roll that turns at a share of the coordinated rate.
    struct Airframe {
        /// Position and velocity relative to the air.
        air: UavState,
        wind: Wind,
        share: f64,
        roll_rad: f64,
    }

    impl Airframe {
        fn new(share: f64, wind: Velocity) -> Self {
            let start = Position::ORIGIN + Displacement::from_m(RADIUS_M, 0.0);
            let air = UavState::level_flight(start, Angle::from_deg(90.0), AIRSPEED_M_S);
            Self { air, wind: Wind { velocity: wind }, share, roll_rad: 0.0 }
        }

        fn own(&self) -> UavState {
            self.wind.over_ground(&self.air, 0.0)
        }

        /// Flies for a time; returns the largest roll rate, rad/s.
        fn fly(&mut self, inner_loop: &mut InnerLoop, demand: impl Fn(&UavState) -> Demand, time_s: f64) -> f64 {
            let mut fastest_rad_s = 0.0f64;
            for _ in 0..(time_s / DT_S) as u32 {
                let own = self.own();
                let (wind, roll_rad) = (self.wind, Some(self.roll_rad));
                let inputs = InnerLoopInputs { demand: demand(&own), own, wind, roll_rad, roll_max_rad: LIMIT_RAD };
                let command_rad = inner_loop.step(&inputs, DT_S);
                let roll_rate_rad_s = (command_rad - self.roll_rad) / 0.4;
                fastest_rad_s = fastest_rad_s.max(roll_rate_rad_s.abs());
                self.roll_rad += roll_rate_rad_s * DT_S;
                let (sin, cos) = math::sin_cos(self.roll_rad);
                self.air.turn_rate_rad_s = -self.share * GRAVITY_M_S2 * sin / (cos * AIRSPEED_M_S);
                let flown = self.air.extrapolated(DT_S);
                self.air = UavState { position: flown.position + self.wind.velocity * DT_S, ..flown };
            }
            fastest_rad_s
        }
    }

    /// An anticlockwise circle about the origin with straight lines onto it.
    fn circle(own: &UavState) -> Demand {
        let from_centre = own.position - Position::ORIGIN;
        let right_of_path_m = from_centre.length_m() - RADIUS_M;
        let tangent = from_centre.direction() + Angle::from_deg(90.0);
        let inward = Angle::from_rad((right_of_path_m / (0.3 * RADIUS_M)).clamp(-1.0, 1.0));
        let inward_rate_rad_s = own.speed_m_s * math::sin((own.heading - tangent).rad()) / (0.3 * RADIUS_M);
        let turn_rate_rad_s = own.speed_m_s / RADIUS_M - inward_rate_rad_s;
        Demand::Path(Guidance {
            course: tangent + inward,
            turn_rate_rad_s,
            speed_m_s: own.speed_m_s,
            right_of_path_m,
            closing_rate_1_s: own.speed_m_s / (0.3 * RADIUS_M),
        })
    }

    /// Whatever share the aircraft turns at, and in wind, it settles on the circle.
    #[test]
    fn the_circle_is_flown_without_offset_at_any_share_of_the_coordinated_turn() {
        for (share, expected, wind_m_s) in [(0.72, 0.72, 0.0), (0.72, 1.0, 0.0), (1.0, 0.72, 5.0), (0.72, 0.72, 8.0)] {
            let mut airframe = Airframe::new(share, Velocity::from_m_s(wind_m_s, 0.0));
            let mut inner_loop = InnerLoop::start_at(0.0, expected);
            airframe.fly(&mut inner_loop, circle, 120.0);
            for _ in 0..60 {
                airframe.fly(&mut inner_loop, circle, 1.0);
                let off_m = (airframe.air.position - Position::ORIGIN).length_m() - RADIUS_M;
                assert!(off_m.abs() < 1.5, "{share}, expected {expected}, {wind_m_s} m/s: {off_m} m");
            }
        }
    }

    /// The share of the turn, not an integral of the missing rate: a reversed turn needs no new estimate.
    #[test]
    fn a_demanded_turn_is_flown_at_the_share_of_the_aircraft_to_both_sides() {
        let mut airframe = Airframe::new(0.72, Velocity::ZERO);
        let mut inner_loop = InnerLoop::start_at(0.0, 1.0);
        for turn_rate_rad_s in [0.2, -0.2, 0.1] {
            airframe.fly(&mut inner_loop, |_| Demand::Turn(turn_rate_rad_s), 60.0);
            let flown_rad_s = airframe.air.turn_rate_rad_s;
            assert!((flown_rad_s / turn_rate_rad_s - 1.0).abs() < 0.02, "{turn_rate_rad_s}: {flown_rad_s}");
        }
        airframe.fly(&mut inner_loop, |_| Demand::Turn(-0.1), 3.0);
        assert!((airframe.air.turn_rate_rad_s / -0.1 - 1.0).abs() < 0.02, "{}", airframe.air.turn_rate_rad_s);
    }

    /// Minutes at the maximum roll do not delay the next turn.
    #[test]
    fn nothing_winds_up_at_the_limit_of_the_roll() {
        let after = |time_s| {
            let (mut inner_loop, mut airframe) = (InnerLoop::start_at(0.0, 0.72), Airframe::new(0.72, Velocity::ZERO));
            airframe.fly(&mut inner_loop, |_| Demand::Turn(0.6), time_s);
            assert!((airframe.roll_rad + LIMIT_RAD).abs() < 1e-3, "{}", airframe.roll_rad);
            airframe.fly(&mut inner_loop, |_| Demand::Turn(0.1), 4.0);
            airframe.air.turn_rate_rad_s
        };
        let (soon, late) = (after(10.0), after(60.0));
        assert!((soon - late).abs() < 1e-3 && (late - 0.1).abs() < 0.01, "{soon} {late}");
    }

    #[test]
    fn the_roll_moves_at_most_60_degrees_per_second_and_starts_at_the_current_one() {
        let mut inner_loop = InnerLoop::start_at(0.3, 1.0);
        let own = UavState::level_flight(Position::ORIGIN, Angle::ZERO, AIRSPEED_M_S);
        let (wind, demand) = (Wind::default(), Demand::Turn(0.5));
        let inputs = InnerLoopInputs { demand, own, wind, roll_rad: None, roll_max_rad: LIMIT_RAD };
        for step in 1..=4 {
            let expected = (0.3 - f64::from(step) * ROLL_COMMAND_RATE_MAX_RAD_S * DT_S).max(-LIMIT_RAD);
            assert!((inner_loop.step(&inputs, DT_S) - expected).abs() < 1e-12);
        }
    }

    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![-2.0..2.0f64, any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
    }

    proptest! {
        #[test]
        fn every_command_is_finite_and_within_the_limit(
            steps in prop::collection::vec([(); 8].map(|()| any_number()), 1..20),
            roll_max_rad in 0.0..1.5f64,
        ) {
            let mut inner_loop = InnerLoop::start_at(steps[0][0], steps[0][1]);
            for [a, b, c, d, e, f, g, dt_s] in steps {
                let own = UavState {
                    position: Position::from_m(a, b),
                    heading: Angle::from_rad(c),
                    speed_m_s: d,
                    turn_rate_rad_s: e,
                    vertical: None,
                };
                let (course, closing_rate_1_s) = (Angle::from_rad(f), b);
                let path = Guidance { course, turn_rate_rad_s: g, speed_m_s: d, right_of_path_m: a, closing_rate_1_s };
                for demand in [Demand::Path(path), Demand::Turn(f)] {
                    let wind = Wind { velocity: Velocity::from_m_s(e, g) };
                    let inputs = InnerLoopInputs { demand, own, wind, roll_rad: Some(b), roll_max_rad };
                    let roll_rad = inner_loop.step(&inputs, dt_s);
                    prop_assert!(roll_rad.abs() <= roll_max_rad, "{roll_rad}");
                    prop_assert!(SHARE.contains(&inner_loop.share) && inner_loop.integral_rad_s.abs() <= INTEGRAL_MAX_RAD_S);
                }
            }
        }
    }
}
