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
//! `docs/user/dynamics.md` gives the sources.

use crate::angle::Angle;
use crate::atmosphere::GRAVITY_M_S2;
use crate::frame::Velocity;
use crate::math;
use crate::params::{BankParams, UavParams};
use crate::uav::UavState;

/// Maximum rate of the commanded bank angle, rad/s: 60 deg/s, which small aircraft follow.
pub(crate) const ROLL_COMMAND_RATE_MAX_RAD_S: f64 = 60.0 * math::PI / 180.0;

/// Time constant of the lateral acceleration that the bank angle is commanded for, s.
pub(crate) const BANK_COMMAND_LAG_S: f64 = 0.4;

/// Minimum divisor of turn rates, m/s: no aircraft flies slower.
const SPEED_MIN_M_S: f64 = 1.0;

/// Commanded bank angle `dt_s` seconds after `last_rad`, rad: that of a demanded lateral acceleration, m/s2, positive to
/// the left, low-passed and with a limited rate. The aircraft turns at a share of the coordinated rate, and banks by at
/// most a maximum angle, rad. What a limit takes away is not made up for later.
pub(crate) fn next_bank_command_rad(
    last_rad: f64,
    demanded_m_s2: f64,
    (share, bank_max_rad): (f64, f64),
    dt_s: f64,
) -> f64 {
    let (sin, cos) = math::sin_cos(last_rad);
    let last_m_s2 = -share * GRAVITY_M_S2 * sin / cos;
    let next_m_s2 = last_m_s2 + (1.0 - math::exp(-dt_s / BANK_COMMAND_LAG_S)) * (demanded_m_s2 - last_m_s2);
    let next_rad = -math::atan2(next_m_s2, share * GRAVITY_M_S2);
    let change_max_rad = ROLL_COMMAND_RATE_MAX_RAD_S * dt_s;
    // Unlike `clamp`, this accepts what is not finite.
    next_rad.max(last_rad - change_max_rad).min(last_rad + change_max_rad).max(-bank_max_rad).min(bank_max_rad)
}

impl BankParams {
    /// Turn rate, rad/s, positive anticlockwise, at a bank angle, rad, positive to the right.
    pub fn turn_rate_rad_s(&self, bank_rad: f64, speed_m_s: f64) -> f64 {
        let (sin, cos) = math::sin_cos(bank_rad);
        -self.turn_factor * GRAVITY_M_S2 * sin / (cos * speed_m_s.max(SPEED_MIN_M_S))
    }

    /// Maximum turn rate at a speed, rad/s.
    pub fn turn_rate_max_rad_s(&self, speed_m_s: f64) -> f64 {
        self.turn_rate_rad_s(-self.bank_max_rad, speed_m_s)
    }

    /// Bank angle of a turn rate, rad, within the limit.
    pub(crate) fn bank_rad(&self, turn_rate_rad_s: f64, speed_m_s: f64) -> f64 {
        let bank_rad = -math::atan2(turn_rate_rad_s * speed_m_s.max(SPEED_MIN_M_S), self.turn_factor * GRAVITY_M_S2);
        bank_rad.clamp(-self.bank_max_rad, self.bank_max_rad)
    }

    /// Duration of a roll from level flight to the maximum bank angle without lags, s.
    fn roll_time_s(&self) -> f64 {
        self.bank_max_rad / self.roll_rate_max_rad_s.min(ROLL_COMMAND_RATE_MAX_RAD_S)
    }

    /// Sum of the lags from a demanded lateral acceleration to the bank angle, s.
    fn roll_lags_s(&self) -> f64 {
        BANK_COMMAND_LAG_S + self.roll_lag_s
    }

    /// Lowest and highest acceleration in level flight, m/s2.
    fn accelerations_m_s2(&self, speed_m_s: f64) -> [f64; 2] {
        [-self.sink_idle_m_s, self.climb_full_power_m_s]
            .map(|power_m_s| GRAVITY_M_S2 * power_m_s / speed_m_s.max(SPEED_MIN_M_S))
    }

    /// Bank angle after `dt_s` seconds, rad.
    pub fn rolled_rad(&self, bank_rad: f64, command_rad: f64, dt_s: f64) -> f64 {
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
    pub fn step(
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
        self.bank.map_or(self.turn_rate_lag_s, |bank| bank.roll_time_s() + bank.roll_lags_s())
    }

    /// Time until a turn has settled, s: `lags` lags, or the time of a roll from one side to the other.
    pub(crate) fn settling_s(&self, lags: f64) -> f64 {
        match self.bank {
            None => lags * self.speed_lag_s.max(self.turn_rate_lag_s),
            Some(bank) => 2.0 * bank.roll_time_s() + lags * bank.roll_lags_s(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After one lag, the commanded bank angle is that of 63 % of the demanded acceleration; large changes take longer.
    #[test]
    fn the_commanded_bank_angle_follows_with_its_lag_and_its_rate() {
        let (sin, cos) = math::sin_cos(next_bank_command_rad(0.0, 2.0, (0.72, 1.0), BANK_COMMAND_LAG_S));
        assert!((-0.72 * GRAVITY_M_S2 * sin / cos / 2.0 - (1.0 - math::exp(-1.0))).abs() < 1e-12);
        assert_eq!(next_bank_command_rad(0.0, 100.0, (0.72, 1.0), 0.1), -0.1 * ROLL_COMMAND_RATE_MAX_RAD_S);
        assert_eq!(next_bank_command_rad(0.95, -100.0, (0.72, 1.0), 0.1), 1.0);
    }
}
