//! Predicted motion of a UAV: an airframe that flies commands relative to the air, in air that moves with the wind.
//!
//! The airframe is kinematic, with the exact solution of (1) or Euler steps (4), or it [banks](crate::bank). In a steady
//! wind, the predicted motion is the flown one.

use crate::bank::{ROLL_COMMAND_RATE_MAX_RAD_S, next_bank_command_rad};
use crate::params::{BankParams, Integrator, TeamParams, UavParams};
use crate::uav::{AutopilotModel, Command, UavState};
use crate::wind::Wind;

/// Longest step of the prediction of a banking UAV, s.
const STEP_MAX_S: f64 = 0.1;

/// Smallest airspeed by which rates are divided, m/s.
const AIRSPEED_MIN_M_S: f64 = 0.1;

/// Error of predicted motion for each m/s of wind, s: gusts, and the heading rates of teammates, which their reports do
/// not contain.
const WIND_ERROR_S: f64 = 0.8;

/// Error of the predicted flight of a banking UAV past an outline, as a time: a UAV on a path changes its commanded bank
/// angle until its next decision, but the prediction contains its first command only.
const PATH_ERROR_S: f64 = 0.2;

/// What a UAV can fly, relative to the air, and the wind that predictions allow for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Airframe {
    pub(crate) uav: UavParams,
    /// Speed of the wind, m/s.
    pub(crate) wind_m_s: f64,
}

impl Airframe {
    pub(crate) fn new(uav: UavParams, wind_m_s: f64) -> Self {
        // The model of a banking aircraft has no steps.
        let integrator = if uav.bank.is_some() { Integrator::Exact } else { uav.integrator };
        Self { uav: UavParams { integrator, ..uav }, wind_m_s }
    }

    /// Highest ground speed, m/s.
    pub(crate) fn fastest_over_ground_m_s(&self) -> f64 {
        self.uav.speed_max_m_s() + self.wind_m_s
    }

    /// Limits over ground on every course: ground speeds from V_min + w to V_max - w, or the nominal one if there are
    /// none, and course rates up to omega_max V_min / (V_min + w), which the UAV can fly at its lowest airspeed in a
    /// tailwind.
    pub(crate) fn over_ground(&self) -> UavParams {
        let (uav, lowest_m_s) = (self.uav, self.uav.speeds_m_s()[0]);
        if self.wind_m_s == 0.0 {
            return uav;
        }
        UavParams {
            speed_change_max_m_s: (uav.speed_change_max_m_s - self.wind_m_s).max(0.0),
            turn_rate_max_rad_s: uav.turn_rate_max_rad_s * lowest_m_s / (lowest_m_s + self.wind_m_s),
            ..uav
        }
    }

    /// Airspeed of fallback circles, m/s, from the current one.
    pub(crate) fn circle_airspeed_m_s(&self, current_m_s: f64) -> f64 {
        let [lowest_m_s, highest_m_s] = self.uav.speeds_m_s();
        self.uav.escape_speed_m_s(current_m_s).max(lowest_m_s).min(highest_m_s)
    }

    /// Radius of the tightest circle at a constant airspeed V_a, m, over ground in a wind of speed w, or with w = 0 in the
    /// air: the heading rate in a tailwind is the highest one, r = (V_a + w)^2 / (V_a omega_max).
    pub(crate) fn circle_m(&self, airspeed_m_s: f64, wind_m_s: f64) -> f64 {
        let airspeed_m_s = airspeed_m_s.max(AIRSPEED_MIN_M_S);
        let ground_speed_m_s = airspeed_m_s + wind_m_s;
        ground_speed_m_s * ground_speed_m_s / (airspeed_m_s * self.uav.turn_rate_max_at_rad_s(airspeed_m_s))
    }

    /// Distance by which flown and predicted motion may differ in wind, m.
    pub(crate) fn wind_error_m(&self) -> f64 {
        WIND_ERROR_S * self.wind_m_s
    }

    /// Distance by which they may differ on a path, m.
    pub(crate) fn path_error_m(&self) -> f64 {
        if self.uav.bank.is_some() { PATH_ERROR_S * self.fastest_over_ground_m_s() } else { 0.0 }
    }
}

impl TeamParams {
    /// Airframe of the UAVs, in the wind that guidance allows for.
    pub(crate) fn airframe(&self) -> Airframe {
        Airframe::new(self.uav, self.orbit_wind_m_s())
    }
}

/// Bank angle and its command, rad, positive to the right.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Bank {
    angle_rad: f64,
    command_rad: f64,
}

/// Predicted motion of a UAV.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Position over ground; heading, speed and turn rate relative to the air.
    pub state: UavState,
    /// Level if the UAV does not bank.
    bank: Bank,
    /// Wind that moves the air.
    pub(crate) wind: Wind,
}

impl Motion {
    /// The motion with the commanded bank angle of another one.
    pub(crate) fn with_bank_command_of(self, other: &Self) -> Self {
        Self { bank: Bank { command_rad: other.bank.command_rad, ..self.bank }, ..self }
    }

    /// The motion of a UAV in a steady turn in calm air: the bank angle is that of the turn rate.
    pub fn steady(uav: &UavParams, state: &UavState) -> Self {
        let bank = uav.bank.map_or(Bank::default(), |bank| {
            let angle_rad = bank.bank_rad(state.turn_rate_rad_s, state.speed_m_s);
            Bank { angle_rad, command_rad: angle_rad }
        });
        Self { state: *state, bank, wind: Wind::default() }
    }

    /// The motion of an aircraft whose bank is unknown, in calm air.
    pub(crate) fn steady_course(state: &UavState) -> Self {
        Self { state: *state, bank: Bank::default(), wind: Wind::default() }
    }

    /// The motion with the same bank angle and another state.
    pub(crate) fn with_state(self, state: UavState) -> Self {
        Self { state, ..self }
    }

    /// The motion in this wind.
    pub(crate) fn in_wind(self, wind: Option<Wind>) -> Self {
        Self { wind: wind.unwrap_or_default(), ..self }
    }

    /// The motion of a UAV that follows a command: the commanded bank angle is as far ahead as in a long roll.
    pub(crate) fn turning(uav: &UavParams, state: &UavState, command: Option<Command>) -> Self {
        let mut motion = Self::steady(uav, state);
        if let Some((bank, command)) = uav.bank.zip(command) {
            let (angle_rad, lead_rad) = (motion.bank.angle_rad, ROLL_COMMAND_RATE_MAX_RAD_S * bank.roll_lag_s);
            let desired_rad = bank.bank_rad(command.turn_rate_rad_s, state.speed_m_s);
            motion.bank.command_rad = desired_rad.clamp(angle_rad - lead_rad, angle_rad + lead_rad);
        }
        motion
    }
}

impl BankParams {
    /// Predicts the motion in still air while a command is held for a time. The rate of climb is constant.
    pub(crate) fn predicted(&self, uav: &UavParams, from: &Motion, command: Command, time_s: f64) -> Motion {
        let steps = (time_s / STEP_MAX_S).ceil().max(1.0);
        let dt_s = time_s / steps;
        let climb_m_s = from.state.vertical.map_or(0.0, |vertical| vertical.climb_rate_m_s);
        let Motion { mut state, mut bank, wind } = *from;
        let within = (self.turn_factor, self.bank_max_rad);
        for _ in 0..steps as u32 {
            let demanded_m_s2 = command.turn_rate_rad_s * state.speed_m_s;
            bank.command_rad = next_bank_command_rad(bank.command_rad, demanded_m_s2, within, dt_s);
            bank.angle_rad = self.rolled_rad(bank.angle_rad, bank.command_rad, dt_s);
            state = self.step(&state, bank.angle_rad, (command.speed_m_s, uav.speed_lag_s), climb_m_s, dt_s);
        }
        Motion { state, bank, wind }
    }
}

impl AutopilotModel {
    /// Returns the motion after holding `command`, relative to the air, for the time step: for a UAV that banks within its
    /// limits, otherwise by Eq. (1) or (4).
    #[inline]
    pub fn advance(&self, from: &Motion, command: Command) -> Motion {
        let (uav, time_s) = (&self.params, self.duration_s());
        let mut motion = match uav.bank {
            None => Motion { state: self.step(&from.state, command), ..*from },
            Some(bank) => bank.predicted(uav, from, command, time_s),
        };
        motion.state.position = motion.state.position + from.wind.velocity * time_s;
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::{Position, Velocity};
    use crate::guidance::inner_loop::{Demand, InnerLoop, InnerLoopInputs};
    use crate::math;
    use crate::params::TeamParams;
    use crate::safety::fallback::{FallbackModel, Sense};
    use crate::safety::flown::Flown;
    use crate::safety::predicted_trajectory::{Intent, PredictedTrajectory};
    use crate::time::{Duration, Time};

    fn banking() -> UavParams {
        UavParams { bank: Some(BankParams::default()), ..TeamParams::paper().uav }
    }

    fn east(speed_m_s: f64, turn_rate_rad_s: f64) -> UavState {
        UavState { turn_rate_rad_s, ..UavState::level_flight(Position::ORIGIN, Angle::ZERO, speed_m_s) }
    }

    /// Between two decisions, a UAV knows how far its commanded bank angle has changed; much later it does not.
    #[test]
    fn the_commanded_bank_angle_is_remembered() {
        let (uav, command) = (banking(), Command { speed_m_s: 40.0, turn_rate_rad_s: -0.3 });
        let start = Motion::steady(&uav, &east(40.0, 0.3));
        let response = uav.response(Duration::from_s(0.5));
        let flown = response.advance(&start, command);
        let decided = Flown { from: Time::EPOCH, motion: start, command, plan: None };
        let known =
            |after_s| Flown::motion(Some(&decided), &uav, &flown.state, Time::EPOCH + Duration::from_s(after_s));
        assert!((known(0.5).bank.angle_rad - flown.bank.angle_rad).abs() < 1e-9);
        assert!((known(0.5).bank.command_rad - flown.bank.command_rad).abs() < 1e-9);
        let forgotten = Motion::steady(&uav, &flown.state);
        assert!(known(20.0) == forgotten && Flown::motion(None, &uav, &flown.state, Time::EPOCH) == forgotten);
        // The command leads: a UAV that has forgotten it expects to turn later.
        let turned_rad = |motion| response.advance(&motion, command).state.turn_rate_rad_s;
        assert!(turned_rad(known(0.5)) < turned_rad(forgotten) - 0.02);
    }

    /// The inner loop flies commanded turns as predicted, also from one side to the other.
    #[test]
    fn the_predicted_turn_is_that_of_the_inner_loop() {
        const LOOP_S: f64 = 0.1;
        let (uav, model) = (banking(), BankParams::default());
        let mut predicted = Motion::steady(&uav, &east(40.0, 0.0));
        let (mut flown, mut bank_rad) = (predicted.state, 0.0);
        let mut inner_loop = InnerLoop::start_at(0.0, model.turn_factor);
        for turn_rate_rad_s in [0.3, -0.3, -0.05, 0.1, 0.3, -0.3] {
            let command = Command { speed_m_s: 40.0, turn_rate_rad_s };
            predicted = uav.response(Duration::from_s(0.5)).advance(&predicted, command);
            for _ in 0..5 {
                let (demand, wind) = (Demand::Turn(turn_rate_rad_s), Wind::default());
                let roll_max_rad = model.bank_max_rad;
                let inputs = InnerLoopInputs { demand, own: flown, wind, roll_rad: Some(bank_rad), roll_max_rad };
                bank_rad = model.rolled_rad(bank_rad, inner_loop.step(&inputs, LOOP_S), LOOP_S);
                flown = model.step(&flown, bank_rad, (40.0, uav.speed_lag_s), 0.0, LOOP_S);
            }
            let off_m = flown.position.distance_m(predicted.state.position);
            let off_rad = (flown.heading - predicted.state.heading).rad();
            assert!(off_m < 0.2 && off_rad.abs() < 0.005, "{turn_rate_rad_s} rad/s: {off_m} m, {off_rad} rad");
        }
    }

    /// In a steady wind, a UAV that flies its plan again and again stays on the planned circle for several laps, also after
    /// gusts have moved it; heading rates are within the limit, and the airspeed is constant.
    #[test]
    fn a_plan_is_a_circle_over_ground_forever() {
        let kinematic = TeamParams::paper().uav;
        let period_s = 0.5;
        for (uav, wind_m_s, sense) in [
            (kinematic, 10.0, Sense::Left),
            (UavParams { speed_change_max_m_s: 4.0, ..kinematic }, 12.0, Sense::Right),
            (banking(), 10.0, Sense::Left),
            (banking(), 12.0, Sense::Right),
        ] {
            let wind = Wind { velocity: Velocity::from_m_s(0.0, wind_m_s) };
            let model = FallbackModel::over_ground(Airframe::new(uav, wind_m_s), period_s);
            let mut motion = Motion::steady(&uav, &east(38.0, 0.0)).in_wind(Some(wind));
            let straight = Command { speed_m_s: 38.0, turn_rate_rad_s: 0.0 };
            let path = model.path(&motion, straight, sense);
            let mut plan = model.plan(&path);
            let response = uav.response(Duration::from_s(period_s));
            motion = response.advance(&motion, straight);
            let (centre, [inner_m, outer_m]) = path.ring_m();
            let (mut largest_m, mut laps) = (0.0f64, 0.0);
            for step in 0..600 {
                let command = model.command(&motion, sense, Some(&plan));
                assert_eq!(uav.limit(command).command, command);
                if step as f64 * period_s < model.settled_s() {
                    let nearest_m = path
                        .points()
                        .iter()
                        .map(|point| point.distance_m(motion.state.position))
                        .fold(f64::INFINITY, f64::min);
                    assert!(nearest_m < 0.01, "{nearest_m} m from the predicted path");
                } else {
                    let distance_m = motion.state.position.distance_m(centre);
                    largest_m = largest_m.max(inner_m - distance_m).max(distance_m - outer_m);
                    laps += command.turn_rate_rad_s.abs() * period_s / math::TAU;
                }
                motion = response.advance(&motion, command);
                plan = plan.after_s(period_s);
            }
            assert!(largest_m < 2.5 && laps > 3.0, "{wind_m_s} m/s: {largest_m} m, {laps} laps");
        }
    }

    /// Collision avoidance predicts changes of speed within the power.
    #[test]
    fn predicted_trajectories_change_speed_within_the_power() {
        let uav = banking();
        for (from_m_s, to_m_s, turn_rate_rad_s) in [(40.0, 25.0, 0.0), (40.0, 55.0, 0.15), (40.0, 39.0, -0.15)] {
            let (state, command) = (east(from_m_s, turn_rate_rad_s), Command { speed_m_s: to_m_s, turn_rate_rad_s });
            let course = PredictedTrajectory::of(&state, Intent::held(command), &uav, 0.0).sampled();
            let mut motion = Motion::steady(&uav, &state);
            for step in 1..=16 {
                motion = uav.response(Duration::from_s(0.5)).advance(&motion, command);
                let off_m = course.at(0.5 * f64::from(step)).distance_m(motion.state.position);
                assert!(off_m < 4.0, "{from_m_s} to {to_m_s} m/s, after {step} steps: {off_m} m");
            }
        }
    }
}
