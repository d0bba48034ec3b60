//! True aircraft that bank ([`BankParams`]), and the exchange of speed and height.
//!
//! At the lowest commanded speed, the climb is limited to the rate at full power; at the highest one, the descent to that
//! with the engine idle: speed has priority over height.
//!
//! The bank angle is commanded by [`InnerLoop`], as in `standoff-fly`. `docs/user/dynamics.md` describes the model and its
//! sources.

use standoff::atmosphere::GRAVITY_M_S2;
use standoff::atmosphere::density_ratio;
use standoff::{
    BankParams, Command, Demand, DesiredPath, Duration, InnerLoop, InnerLoopInputs, UavParams, UavState, Velocity,
    Vertical, Wind,
};

use crate::navigation::NavigationError;

/// Period of the bank commands, s: that of `standoff-fly`.
const LOOP_PERIOD_S: f64 = 0.1;

/// Longest step of the integration, s.
const STEP_MAX_S: f64 = 0.02;

/// What a UAV holds for a time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldCommand {
    pub(crate) command: Command,
    /// Path that the command leads onto, if any.
    pub(crate) path: Option<DesiredPath>,
    /// Wind that the UAV assumes.
    pub(crate) assumed_wind: Wind,
    /// Error of the state that the UAV assumes.
    pub(crate) navigation_error: Option<NavigationError>,
    /// Velocity of the air, m/s.
    pub(crate) air: Velocity,
    /// Commanded altitude, m.
    pub(crate) altitude_m: Option<f64>,
    /// Height above sea level, m, if altitudes are not simulated.
    pub(crate) height_m: f64,
    pub(crate) period: Duration,
    /// True if the command is an equivalent instead of a true airspeed.
    pub(crate) flies_equivalent_airspeed: bool,
}

/// True airspeed of an equivalent one at a height above sea level, m/s; below sea level, that at sea level.
fn true_airspeed_m_s(equivalent_m_s: f64, height_m: f64) -> f64 {
    equivalent_m_s / density_ratio(height_m.max(0.0)).sqrt()
}

/// Highest rates of climb and of descent, m/s, that keep the speed between two, m/s, for `dt_s` seconds.
fn vertical_limits_m_s(model: &BankParams, speed_m_s: f64, [lowest_m_s, highest_m_s]: [f64; 2], dt_s: f64) -> [f64; 2] {
    let height_per_s = |from_m_s: f64, to_m_s: f64| {
        let height_m = (from_m_s * from_m_s - to_m_s * to_m_s).max(0.0) / (2.0 * GRAVITY_M_S2);
        height_m / dt_s
    };
    [
        model.climb_full_power_m_s + height_per_s(speed_m_s, lowest_m_s),
        model.sink_idle_m_s + height_per_s(highest_m_s, speed_m_s),
    ]
}

/// Bank of an aircraft, and the loop that commands it; at the start, the wings are level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BankMotion {
    bank_rad: f64,
    command_rad: f64,
    inner_loop: InnerLoop,
}

impl BankMotion {
    /// An aircraft in level flight.
    pub(crate) fn level(model: &BankParams) -> Self {
        Self { bank_rad: 0.0, command_rad: 0.0, inner_loop: InnerLoop::start_at(0.0, model.turn_factor) }
    }

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
        model: &BankParams,
        uav: &UavParams,
        before: &UavState,
        held: &HeldCommand,
    ) -> UavState {
        let mut state = *before;
        let period_s = held.period.s();
        let commands = (period_s / LOOP_PERIOD_S).ceil().max(1.0);
        let loop_s = period_s / commands;
        let steps = (loop_s / STEP_MAX_S).ceil().max(1.0);
        for nth in 0..commands as u32 {
            let inputs = self.inputs(model, &state, held, f64::from(nth) * loop_s);
            self.command_rad = self.inner_loop.step(&inputs, loop_s);
            for _ in 0..steps as u32 {
                state = self.integrated(model, uav, &state, held, loop_s / steps);
            }
        }
        state
    }

    /// Inputs of the inner loop `after_s` seconds after the beginning of the time step.
    fn inputs(&self, model: &BankParams, state: &UavState, held: &HeldCommand, after_s: f64) -> InnerLoopInputs {
        let turn_rate_rad_s = model.turn_rate_rad_s(self.bank_rad, state.speed_m_s);
        let moved = UavState { position: state.position + held.air * after_s, turn_rate_rad_s, ..*state };
        let truth = Wind { velocity: held.air }.over_ground(&moved, 0.0);
        let own = held.navigation_error.map_or(truth, |error| error.believed(&truth));
        let demand = Demand::of(held.path.as_ref(), held.command, after_s, &own);
        let (wind, roll_max_rad) = (held.assumed_wind, model.bank_max_rad);
        InnerLoopInputs { demand, own, wind, roll_rad: Some(self.bank_rad), roll_max_rad }
    }

    /// State after a short step, by the midpoint rule.
    fn integrated(
        &mut self,
        model: &BankParams,
        uav: &UavParams,
        from: &UavState,
        held: &HeldCommand,
        dt_s: f64,
    ) -> UavState {
        self.bank_rad = model.rolled_rad(self.bank_rad, self.command_rad, dt_s);
        let height_m = from.vertical.map_or(held.height_m, |vertical| vertical.altitude_m);
        let speed_of = |commanded_m_s: f64| match held.flies_equivalent_airspeed {
            true => true_airspeed_m_s(commanded_m_s, height_m),
            false => commanded_m_s,
        };
        let speeds_m_s = uav.speeds_m_s().map(speed_of);
        let vertical = from.vertical.zip(uav.climb).map(|(vertical, climb)| {
            let [climb_max_m_s, sink_max_m_s] = vertical_limits_m_s(model, from.speed_m_s, speeds_m_s, dt_s);
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
        let speed = (speed_of(held.command.speed_m_s), uav.speed_lag_s);
        let state = model.step(from, self.bank_rad, speed, climb_m_s, dt_s);
        UavState { vertical: vertical.map(|(vertical, _)| vertical).or(from.vertical), ..state }
    }
}

#[cfg(test)]
mod tests;
