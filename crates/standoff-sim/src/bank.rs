//! True aircraft with a bank angle, and the exchange of speed and height.
//!
//! ```text
//! phi' = (phi_c - phi) / tau_phi      |phi'| <= p_max      roll
//! psi' = -f g tan(phi) / V                                 turn; f = 1 is a coordinated turn
//! V'   = (V_c - V) / tau_v            g (-s - h') <= V V' <= g (c - h')
//! ```
//!
//! The bank angle phi is positive to the right. V is the true airspeed, h' the rate of climb. The engine gives the power
//! to climb at c, or to descend at s, at constant speed. A climb leaves less of it to accelerate, and one faster than c
//! costs speed. At the lowest commanded speed, the climb is limited to c, at the highest one, the descent to s: speed has
//! priority over height.
//!
//! The bank angle is commanded by [`RateLoop`], as in `standoff-fly`. `docs/dynamics.md` describes the model and its
//! sources.

use standoff::research::{GRAVITY_M_S2, RateInputs, RateLoop, density_ratio, math};
use standoff::{Angle, Command, Duration, UavParams, UavState, Velocity, Vertical};

/// Period of the bank commands, s: that of `standoff-fly`.
const LOOP_PERIOD_S: f64 = 0.1;

/// Longest step of the integration, s.
const STEP_MAX_S: f64 = 0.02;

/// Lowest speed by which turn rates are divided, m/s: no aircraft flies slower.
const SPEED_MIN_M_S: f64 = 1.0;

/// Properties of a banking aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BankModel {
    /// Maximum bank angle phi_max to either side, rad; below pi/2.
    pub bank_max_rad: f64,
    /// Maximum roll rate p_max, rad/s; above 0.
    pub roll_rate_max_rad_s: f64,
    /// Time constant tau_phi of the bank angle, s; above 0.
    pub roll_lag_s: f64,
    /// Factor f of the turn rate.
    pub turn_factor: f64,
    /// Rate of climb c at full power and constant speed, m/s; above 0.
    pub climb_full_power_m_s: f64,
    /// Rate of descent s with the engine idle at constant speed, m/s; above 0.
    pub sink_idle_m_s: f64,
    /// True if a commanded speed is flown as equivalent instead of true airspeed.
    pub flies_equivalent_airspeed: bool,
}

/// What a UAV holds for a time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldCommand {
    pub(crate) command: Command,
    /// Commanded altitude, m.
    pub(crate) altitude_m: Option<f64>,
    /// Height above sea level, m, if altitudes are not simulated.
    pub(crate) height_m: f64,
    pub(crate) period: Duration,
}

impl BankModel {
    /// Turn rate, rad/s, positive anticlockwise, at a bank angle, rad, positive to the right.
    pub(crate) fn turn_rate_rad_s(&self, bank_rad: f64, speed_m_s: f64) -> f64 {
        let (sin, cos) = math::sin_cos(bank_rad);
        -self.turn_factor * GRAVITY_M_S2 * sin / (cos * speed_m_s.max(SPEED_MIN_M_S))
    }

    /// True airspeed for a commanded speed at a height above sea level, m; below sea level, that at sea level.
    fn true_airspeed_m_s(&self, commanded_m_s: f64, height_m: f64) -> f64 {
        let ratio = if self.flies_equivalent_airspeed { density_ratio(height_m.max(0.0)) } else { 1.0 };
        commanded_m_s / ratio.sqrt()
    }

    /// Highest rates of climb and of descent, m/s, that keep the speed between `speeds_m_s` for `dt_s` seconds.
    fn vertical_limits_m_s(&self, speed_m_s: f64, [lowest_m_s, highest_m_s]: [f64; 2], dt_s: f64) -> [f64; 2] {
        let height_per_s = |from_m_s: f64, to_m_s: f64| {
            let height_m = (from_m_s * from_m_s - to_m_s * to_m_s).max(0.0) / (2.0 * GRAVITY_M_S2);
            height_m / dt_s
        };
        [
            self.climb_full_power_m_s + height_per_s(speed_m_s, lowest_m_s),
            self.sink_idle_m_s + height_per_s(highest_m_s, speed_m_s),
        ]
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
}

/// Bank of an aircraft, and the loop that commands it; at the start, the wings are level.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct BankMotion {
    bank_rad: f64,
    command_rad: f64,
    rate_loop: RateLoop,
}

impl BankMotion {
    /// Bank angle, rad, positive to the right.
    pub(crate) fn bank_rad(&self) -> f64 {
        self.bank_rad
    }

    /// Last commanded bank angle, rad, positive to the right.
    pub(crate) fn command_rad(&self) -> f64 {
        self.command_rad
    }

    /// Returns the state after a time step in air that does not move.
    pub(crate) fn fly(
        &mut self,
        model: &BankModel,
        uav: &UavParams,
        before: &UavState,
        held: &HeldCommand,
    ) -> UavState {
        let mut state = *before;
        let period_s = held.period.s();
        let commands = (period_s / LOOP_PERIOD_S).ceil().max(1.0);
        let loop_s = period_s / commands;
        let steps = (loop_s / STEP_MAX_S).ceil().max(1.0);
        for _ in 0..commands as u32 {
            let inputs = RateInputs {
                desired_rad_s: held.command.turn_rate_rad_s,
                measured_rad_s: Some(model.turn_rate_rad_s(self.bank_rad, state.speed_m_s)),
                measured_roll_rad: Some(self.bank_rad),
                speed_m_s: state.speed_m_s,
                roll_max_rad: model.bank_max_rad,
            };
            self.command_rad = self.rate_loop.step(&inputs, loop_s);
            for _ in 0..steps as u32 {
                state = self.integrated(model, uav, &state, held, loop_s / steps);
            }
        }
        state
    }

    /// State after a short step, by the midpoint rule.
    fn integrated(
        &mut self,
        model: &BankModel,
        uav: &UavParams,
        from: &UavState,
        held: &HeldCommand,
        dt_s: f64,
    ) -> UavState {
        let roll_max_rad = model.roll_rate_max_rad_s * dt_s;
        let roll_rad = (self.command_rad - self.bank_rad) * (1.0 - math::exp(-dt_s / model.roll_lag_s));
        self.bank_rad += roll_rad.clamp(-roll_max_rad, roll_max_rad);

        let height_m = from.vertical.map_or(held.height_m, |vertical| vertical.altitude_m);
        let speed_of = |commanded_m_s: f64| model.true_airspeed_m_s(commanded_m_s, height_m);
        let speeds_m_s = uav.speeds_m_s().map(speed_of);
        let vertical = from.vertical.zip(uav.climb).map(|(vertical, climb)| {
            let [climb_max_m_s, sink_max_m_s] = model.vertical_limits_m_s(from.speed_m_s, speeds_m_s, dt_s);
            let free = climb.step(&vertical, held.altitude_m, Duration::from_s(dt_s));
            let climb_m_s = (free.altitude_m - vertical.altitude_m) / dt_s;
            let limited_m_s = climb_m_s.clamp(-sink_max_m_s, climb_max_m_s);
            if (climb_m_s - limited_m_s).abs() > 0.0 {
                let altitude_m = vertical.altitude_m + limited_m_s * dt_s;
                (Vertical { altitude_m, climb_rate_m_s: limited_m_s }, limited_m_s)
            } else {
                (free, climb_m_s)
            }
        });
        let climb_m_s = vertical.map_or(0.0, |(_, climb_m_s)| climb_m_s);
        let decay = math::exp(-dt_s / uav.speed_lag_s);
        let target_m_s = speed_of(held.command.speed_m_s);
        let desired_m_s = target_m_s + (from.speed_m_s - target_m_s) * decay;
        let speed_m_s = model.accelerated_m_s(from.speed_m_s, desired_m_s, climb_m_s, dt_s);

        let turn_rate_rad_s = model.turn_rate_rad_s(self.bank_rad, speed_m_s);
        let turned_rad = 0.5 * (from.turn_rate_rad_s + turn_rate_rad_s) * dt_s;
        let mean =
            Velocity::from_polar(0.5 * (from.speed_m_s + speed_m_s), from.heading + Angle::from_rad(0.5 * turned_rad));
        UavState {
            position: from.position + mean * dt_s,
            heading: from.heading + Angle::from_rad(turned_rad),
            speed_m_s,
            turn_rate_rad_s,
            vertical: vertical.map(|(vertical, _)| vertical).or(from.vertical),
        }
    }
}

#[cfg(test)]
mod tests;
