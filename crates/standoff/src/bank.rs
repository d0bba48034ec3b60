//! Motion of a banking aircraft, in still air.
//!
//! ```text
//! phi' = (phi_c - phi) / tau_phi      |phi'| <= p_max      roll
//! psi' = -f g tan(phi) / V                                 turn; f = 1 is a coordinated turn
//! V'   = (V_c - V) / tau_v            g (-s - h') <= V V' <= g (c - h')
//! ```
//!
//! The bank angle phi is positive to the right. V is the true airspeed, h' the rate of climb. The engine gives the power
//! to climb at c, or to descend at s, at constant speed. A climb leaves less of it to accelerate, and one faster than c
//! costs speed.
//!
//! `docs/dynamics.md` gives the sources.

use crate::angle::Angle;
use crate::atmosphere::GRAVITY_M_S2;
use crate::frame::Velocity;
use crate::math;
use crate::params::{BankParams, UavParams};
use crate::time::Time;
use crate::uav::{AutopilotModel, Command, UavState};
use crate::wind::{PredictionLimits, Wind};

/// Maximum rate of the commanded bank angle, rad/s: 60 deg/s, which small aircraft follow.
pub(crate) const ROLL_COMMAND_RATE_MAX_RAD_S: f64 = 60.0 * math::PI / 180.0;

/// Minimum divisor of turn rates, m/s: no aircraft flies slower.
const SPEED_MIN_M_S: f64 = 1.0;

/// Longest duration of a command, s; after it, the bank command is unknown.
const FLOWN_MAX_S: f64 = 10.0;

/// Longest step of a prediction, s.
const STEP_MAX_S: f64 = 0.1;

impl BankParams {
    /// Turn rate, rad/s, positive anticlockwise, at a bank angle, rad, positive to the right.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn turn_rate_rad_s(&self, bank_rad: f64, speed_m_s: f64) -> f64 {
        let (sin, cos) = math::sin_cos(bank_rad);
        -self.turn_factor * GRAVITY_M_S2 * sin / (cos * speed_m_s.max(SPEED_MIN_M_S))
    }

    /// Maximum turn rate at a speed, rad/s.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn turn_rate_max_rad_s(&self, speed_m_s: f64) -> f64 {
        self.turn_rate_rad_s(-self.bank_max_rad, speed_m_s)
    }

    /// Bank angle of a turn rate, rad, within the limit.
    fn bank_rad(&self, turn_rate_rad_s: f64, speed_m_s: f64) -> f64 {
        let bank_rad = -math::atan2(turn_rate_rad_s * speed_m_s.max(SPEED_MIN_M_S), self.turn_factor * GRAVITY_M_S2);
        bank_rad.clamp(-self.bank_max_rad, self.bank_max_rad)
    }

    /// Duration of a roll from level flight to the maximum bank angle, s.
    fn roll_time_s(&self) -> f64 {
        self.bank_max_rad / self.roll_rate_max_rad_s.min(ROLL_COMMAND_RATE_MAX_RAD_S) + self.roll_lag_s
    }

    /// Lowest and highest acceleration in level flight, m/s2.
    fn accelerations_m_s2(&self, speed_m_s: f64) -> [f64; 2] {
        [-self.sink_idle_m_s, self.climb_full_power_m_s]
            .map(|power_m_s| GRAVITY_M_S2 * power_m_s / speed_m_s.max(SPEED_MIN_M_S))
    }

    /// Bank angle after `dt_s` seconds, rad.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn rolled_rad(&self, bank_rad: f64, command_rad: f64, dt_s: f64) -> f64 {
        let roll_max_rad = self.roll_rate_max_rad_s * dt_s;
        let roll_rad = (command_rad - bank_rad) * (1.0 - math::exp(-dt_s / self.roll_lag_s));
        bank_rad + roll_rad.clamp(-roll_max_rad, roll_max_rad)
    }

    /// Speed after `dt_s` seconds with the rate of climb `climb_m_s`, m/s. The energy per mass, V^2 / 2 + g h, changes by
    /// at most that of full power and at least that of the idle engine.
    fn accelerated_m_s(&self, speed_m_s: f64, desired_m_s: f64, climb_m_s: f64, dt_s: f64) -> f64 {
        let reached_m_s = |power_m_s: f64| {
            let squared = speed_m_s * speed_m_s + 2.0 * GRAVITY_M_S2 * (power_m_s - climb_m_s) * dt_s;
            squared.max(0.0).sqrt()
        };
        desired_m_s.clamp(reached_m_s(-self.sink_idle_m_s), reached_m_s(self.climb_full_power_m_s))
    }

    /// State after a short step to the bank angle `bank_rad`, by the midpoint rule. `speed_lag_s` is tau_v, `speed_m_s`
    /// the commanded true airspeed, `climb_m_s` the rate of climb. The altitude does not change.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn step(
        &self,
        from: &UavState,
        bank_rad: f64,
        (speed_m_s, speed_lag_s): (f64, f64),
        climb_m_s: f64,
        dt_s: f64,
    ) -> UavState {
        let desired_m_s = speed_m_s + (from.speed_m_s - speed_m_s) * math::exp(-dt_s / speed_lag_s);
        let speed_m_s = self.accelerated_m_s(from.speed_m_s, desired_m_s, climb_m_s, dt_s);
        let turn_rate_rad_s = self.turn_rate_rad_s(bank_rad, speed_m_s);
        let turned_rad = 0.5 * (from.turn_rate_rad_s + turn_rate_rad_s) * dt_s;
        let mean =
            Velocity::from_polar(0.5 * (from.speed_m_s + speed_m_s), from.heading + Angle::from_rad(0.5 * turned_rad));
        UavState {
            position: from.position + mean * dt_s,
            heading: from.heading + Angle::from_rad(turned_rad),
            speed_m_s,
            turn_rate_rad_s,
            vertical: from.vertical,
        }
    }

    /// Predicts the motion while a command is held for a time. The rate of climb is constant.
    pub(crate) fn predicted(&self, uav: &UavParams, from: &Motion, command: Command, time_s: f64) -> Motion {
        let steps = (time_s / STEP_MAX_S).ceil().max(1.0);
        let dt_s = time_s / steps;
        let climb_m_s = from.state.vertical.map_or(0.0, |vertical| vertical.climb_rate_m_s);
        let Motion { mut state, mut bank, circling_in } = *from;
        let change_max_rad = ROLL_COMMAND_RATE_MAX_RAD_S * dt_s;
        for _ in 0..steps as u32 {
            let desired_rad = self.bank_rad(command.turn_rate_rad_s, state.speed_m_s);
            // Unlike `clamp`, this accepts a state that is not finite.
            bank.command_rad =
                desired_rad.max(bank.command_rad - change_max_rad).min(bank.command_rad + change_max_rad);
            bank.angle_rad = self.rolled_rad(bank.angle_rad, bank.command_rad, dt_s);
            state = self.step(&state, bank.angle_rad, (command.speed_m_s, uav.speed_lag_s), climb_m_s, dt_s);
        }
        Motion { state, bank, circling_in }
    }
}

impl UavParams {
    /// Speed of escape manoeuvres, m/s: the lowest one, or, because aircraft with limited power slow down little in a
    /// turn, the current one.
    pub(crate) fn escape_speed_m_s(&self, current_m_s: f64) -> f64 {
        if self.bank.is_some() { current_m_s } else { self.speeds_m_s()[0] }
    }

    /// Maximum turn rate at a speed, rad/s.
    pub(crate) fn turn_rate_max_at_rad_s(&self, speed_m_s: f64) -> f64 {
        self.bank
            .map_or(self.turn_rate_max_rad_s, |bank| bank.turn_rate_max_rad_s(speed_m_s).min(self.turn_rate_max_rad_s))
    }

    /// Lowest and highest acceleration at a speed, m/s2; infinite if the speed only has a lag.
    pub(crate) fn accelerations_m_s2(&self, speed_m_s: f64) -> [f64; 2] {
        self.bank.map_or([f64::NEG_INFINITY, f64::INFINITY], |bank| bank.accelerations_m_s2(speed_m_s))
    }

    /// Time until the turn rate follows its command, s: its lag, or the time of a roll to the maximum bank angle.
    pub(crate) fn turn_delay_s(&self) -> f64 {
        self.bank.map_or(self.turn_rate_lag_s, |bank| bank.roll_time_s())
    }

    /// Time until a turn has settled, s: `lags` lags, or the time of a roll from one side to the other.
    pub(crate) fn settling_s(&self, lags: f64) -> f64 {
        match self.bank {
            None => lags * self.speed_lag_s.max(self.turn_rate_lag_s),
            Some(bank) => 2.0 * bank.roll_time_s() + lags * bank.roll_lag_s,
        }
    }
}

impl AutopilotModel {
    /// Returns the motion after holding `command` for the time step: for a UAV that banks within its limits, otherwise by
    /// Eq. (1) or (4). A UAV that circles over ground in wind flies the commanded course rate, and at constant airspeed if
    /// the command is to keep its speed.
    #[inline]
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn advance(&self, from: &Motion, command: Command) -> Motion {
        let (uav, time_s) = (&self.params, self.duration_s());
        match (uav.bank, from.circling_in) {
            (None, _) => Motion { state: self.step(&from.state, command), ..*from },
            (Some(bank), None) => bank.predicted(uav, from, command, time_s),
            (Some(bank), Some(wind)) => {
                let air = wind.relative_to_air(uav, &from.state, None);
                let mut on_circle = wind.circle_command(&from.state, command.turn_rate_rad_s, uav.turn_rate_lag_s);
                if !from.keeps_speed(command) {
                    let ground = Velocity::from_polar(command.speed_m_s, from.state.heading);
                    on_circle.speed_m_s = wind.air_velocity(ground).airspeed_m_s;
                }
                let flown = bank.predicted(uav, &from.with_state(air), on_circle, time_s);
                let mut state = wind.over_ground(&flown.state, 0.0);
                state.position = state.position + wind.velocity * time_s;
                flown.with_state(state)
            }
        }
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
    /// State over ground, or relative to the air.
    pub state: UavState,
    /// Level if the UAV does not bank.
    bank: Bank,
    /// Wind in which a UAV that banks circles over ground, at constant airspeed because it lacks the power for a constant
    /// ground speed; `None` in calm air, and if the state is relative to the air.
    pub(crate) circling_in: Option<Wind>,
}

impl Motion {
    /// The motion of a UAV in a steady turn: the bank angle is that of the turn rate.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn steady(uav: &UavParams, state: &UavState) -> Self {
        let bank = uav.bank.map_or(Bank::default(), |bank| {
            let angle_rad = bank.bank_rad(state.turn_rate_rad_s, state.speed_m_s);
            Bank { angle_rad, command_rad: angle_rad }
        });
        Self { state: *state, bank, circling_in: None }
    }

    /// True if a command is to keep the current speed. With [`Self::circling_in`], the UAV then keeps its airspeed.
    pub(crate) fn keeps_speed(&self, command: Command) -> bool {
        command.speed_m_s == self.state.speed_m_s
    }

    /// A command from this motion on, when the UAV has reached `now`: its ground speed changes on a circle in wind.
    pub(crate) fn held(&self, command: Command, now: &Self) -> Command {
        let keeps_airspeed = self.circling_in.is_some() && self.keeps_speed(command);
        if keeps_airspeed { Command { speed_m_s: now.state.speed_m_s, ..command } } else { command }
    }

    /// Radius of the circles over ground of escape manoeuvres, m; `None` without [`Self::circling_in`].
    pub(crate) fn circle_over_ground_m(&self, limits: &PredictionLimits) -> Option<f64> {
        let airspeed_m_s = self.circling_in?.air_velocity(self.state.velocity()).airspeed_m_s;
        Some(limits.circle_at_airspeed_m(airspeed_m_s))
    }

    /// Radius of the circles of escape manoeuvres, m.
    pub(crate) fn circle_m(&self, limits: &PredictionLimits) -> f64 {
        let speed_m_s = limits.uav.escape_speed_m_s(self.state.speed_m_s);
        let in_calm_air_m = || speed_m_s / limits.uav.turn_rate_max_at_rad_s(speed_m_s);
        self.circle_over_ground_m(limits).unwrap_or_else(in_calm_air_m)
    }

    /// The command of an escape manoeuvre: the hardest turn at the speed of escape manoeuvres, to the left if `sense` is 1
    /// and to the right if it is -1. A UAV with [`Self::circling_in`] turns on its circle over ground.
    pub(crate) fn escape_command(&self, limits: &PredictionLimits, sense: f64) -> Command {
        let speed_m_s = limits.uav.escape_speed_m_s(self.state.speed_m_s);
        let circle_m = self.circle_over_ground_m(limits);
        let turn_rate_rad_s = circle_m.map_or(limits.uav.turn_rate_max_rad_s, |circle_m| speed_m_s / circle_m);
        Command { speed_m_s, turn_rate_rad_s: sense * turn_rate_rad_s }
    }

    /// The command of an escape manoeuvre that has begun with `first`: with [`Self::circling_in`], the ground speed changes
    /// on the circle.
    pub(crate) fn continued(&self, first: Command, limits: &PredictionLimits) -> Command {
        match self.circling_in {
            Some(_) => self.escape_command(limits, first.turn_rate_rad_s.signum()),
            None => first,
        }
    }

    /// The motion with the same bank angle and another state.
    pub(crate) fn with_state(self, state: UavState) -> Self {
        Self { state, ..self }
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

/// Motion of a UAV at a decision, and the command of that decision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Flown {
    pub(crate) from: Time,
    pub(crate) motion: Motion,
    pub(crate) command: Command,
}

impl Flown {
    /// The motion at the next decision: the bank angle is that of the turn rate, its command the predicted one. Without
    /// a decision before it, or long after it, the UAV is in a steady turn.
    pub(crate) fn motion(flown: Option<&Self>, uav: &UavParams, state: &UavState, now: Time) -> Motion {
        let mut motion = Motion::steady(uav, state);
        if let Some((bank, flown)) = uav.bank.zip(flown) {
            let flown_s = (now - flown.from).s();
            if (0.0..=FLOWN_MAX_S).contains(&flown_s) {
                let predicted = bank.predicted(uav, &flown.motion, flown.command, flown_s);
                motion.bank.command_rad = predicted.bank.command_rad;
            }
        }
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::guidance::predicted_trajectory::{Intent, PredictedTrajectory};
    use crate::params::TeamParams;
    use crate::time::Duration;

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
        let decided = Flown { from: Time::EPOCH, motion: start, command };
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

    /// In wind, an escape manoeuvre over ground ends in the predicted circle at constant airspeed, while the ground speed
    /// changes by twice the wind. The bank angle lags behind the changing turn, so that the circle is not exact.
    #[test]
    fn escape_manoeuvres_in_wind_are_circles_over_ground() {
        let uav = UavParams { turn_rate_max_rad_s: 0.25, ..banking() };
        for (wind_m_s, airspeed_m_s, sense) in [(10.0, 40.0, 1.0), (10.0, 30.0, -1.0), (5.0, 25.0, 1.0)] {
            let wind = Wind { velocity: Velocity::from_m_s(0.0, wind_m_s) };
            let limits = PredictionLimits::in_wind(uav, wind_m_s);
            let start = wind.over_ground(&east(airspeed_m_s, 0.0), 0.0);
            let mut motion = Motion { circling_in: Some(wind), ..Motion::steady(&uav, &start) };
            let radius_m = motion.circle_over_ground_m(&limits).unwrap();
            let response = uav.response(Duration::from_s(0.1));
            let mut fly = |seconds: f64| {
                let steps = 0..(10.0 * seconds) as usize;
                let step = |_| {
                    motion = response.advance(&motion, motion.escape_command(&limits, sense));
                    motion.state
                };
                steps.map(step).collect::<Vec<UavState>>()
            };
            let settled = *fly(4.0).last().unwrap();
            let to_centre = settled.heading + Angle::from_rad(sense * 0.5 * math::PI);
            let centre = settled.position + (Velocity::from_polar(1.0, to_centre) * radius_m);
            let circle = fly(math::TAU * radius_m / airspeed_m_s);
            for state in &circle {
                let off_m = (state.position.distance_m(centre) - radius_m).abs();
                assert!(off_m < limits.wind_error_m(), "{wind_m_s} {airspeed_m_s}: {off_m} m of {radius_m} m");
                assert!((wind.air_velocity(state.velocity()).airspeed_m_s - airspeed_m_s).abs() < 1e-6);
            }
            let slowest_m_s = circle.iter().map(|state| state.speed_m_s).fold(f64::INFINITY, f64::min);
            let fastest_m_s = circle.iter().map(|state| state.speed_m_s).fold(0.0, f64::max);
            assert!((fastest_m_s - slowest_m_s - 2.0 * wind_m_s).abs() < 0.2, "{slowest_m_s} to {fastest_m_s} m/s");
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
