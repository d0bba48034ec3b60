//! Gain and phase margin of the inner loop, broken at the desired turn rate, behind the identified aircraft.
//!
//! ```text
//! C(s)  = (k + a) / s + k a / s^2 + k_i V / s^3,  a = V / (k_l r_d)                              course rate to command
//! F(s)  = hold / (1 + T s),  hold = (1 - e^(-P s)) / (P s)                                       filter, period P
//! phi/u = V cos^2 phi_0 / (share g)                                                              command to roll command
//! w/phi = s e^(-T_c s) (1 + l T_x s) / (1 + T_x s) (g / V) (n_0 cos phi_0 + sin phi_0 N(s)) + r s e^(-T_p s)
//! N(s)  = k sin phi_0 / cos^2 phi_0 e^(-T_n s) (1 + T s) a^2 / (s^2 + 2 b a s + a^2)             roll to load factor
//! ```
//!
//! C is that of u = f - k (chi - chi_d) + i above the frequency V / r_d of the circle, about a centre at rest. Letters of
//! the aircraft: [`super::identified_aircraft`].

use nalgebra::Complex;
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;

use super::identified_aircraft::Airframe;

/// Gains of the loop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gains {
    /// Gain k of the course error, 1/s.
    pub(crate) course_1_s: f64,
    /// Radial gain k_l of the field.
    pub(crate) radial: f64,
    /// Gain k_i of the integral, rad/(m s2).
    pub(crate) integral_rad_m_s2: f64,
    /// Time constant T of the low-pass filter of the acceleration, s.
    pub(crate) filter_s: f64,
    /// Period P of the commands, s.
    pub(crate) period_s: f64,
    /// Share of the coordinated turn rate that the law assumes.
    pub(crate) share: f64,
}

/// State in which the loop is linearised.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Condition {
    /// True airspeed V, m/s.
    pub(crate) airspeed_m_s: f64,
    /// Bank phi_0, rad.
    pub(crate) bank_rad: f64,
    /// Radius r_d, m.
    pub(crate) radius_m: f64,
}

/// Age of the measurements when a command is computed, s: half of the period of positions of 10 Hz.
pub(crate) const AGE_S: f64 = 0.05;

/// Frequencies at which the loop is evaluated, rad/s, and the factor between two.
const FREQUENCIES_RAD_S: [f64; 2] = [0.02, 30.0];
const FREQUENCY_FACTOR: f64 = 1.005;

pub(crate) fn real(value: f64) -> Complex<f64> {
    Complex::new(value, 0.0)
}

/// Dead time as a factor at s.
pub(crate) fn dead_time(s: Complex<f64>, time_s: f64) -> Complex<f64> {
    let (sin, cos) = math::sin_cos(s.im * time_s);
    Complex::new(cos, -sin)
}

/// Mean over a period of a signal that is held for it, or of the past period, as a factor at s.
pub(crate) fn mean_over(s: Complex<f64>, period_s: f64) -> Complex<f64> {
    (real(1.0) - dead_time(s, period_s)) / (s * period_s)
}

/// Response of the course rate to commands of the turn rate.
pub(crate) fn aircraft(s: Complex<f64>, share: f64, airframe: &Airframe, at: &Condition) -> Complex<f64> {
    let lag = |frequency: f64, damping: f64| {
        let squared = frequency * frequency;
        real(squared) / (s * s + s * (2.0 * damping * frequency) + squared)
    };
    let (sin, cos) = math::sin_cos(at.bank_rad);
    let roll_command = at.airspeed_m_s * cos * cos / (share * GRAVITY_M_S2);
    let roll = dead_time(s, airframe.roll_dead_time_s) * lag(airframe.roll_frequency_rad_s, airframe.roll_damping);
    let load = lag(airframe.load_frequency_rad_s, airframe.load_damping)
        * (s * airframe.load_lead_s + 1.0)
        * dead_time(s, airframe.load_dead_time_s)
        * (airframe.load_share * sin / (cos * cos));
    let steady_load = 1.0 + airframe.load_share * (1.0 / cos - 1.0);
    let turn = (load * sin + steady_load * cos) * (GRAVITY_M_S2 / at.airspeed_m_s);
    let lead_s = airframe.course_direct * airframe.course_lag_s;
    let course = (s * lead_s + 1.0) / (s * airframe.course_lag_s + 1.0) * dead_time(s, airframe.course_dead_time_s);
    let rolling = s * dead_time(s, airframe.roll_rate_dead_time_s) * airframe.roll_rate_gain;
    roll * roll_command * (course * turn * airframe.course_share + rolling)
}

/// Feedback C of the law, with filter, hold and age of the measurements.
fn feedback(s: Complex<f64>, gains: &Gains, at: &Condition) -> Complex<f64> {
    let a_1_s = at.airspeed_m_s / (gains.radial * at.radius_m);
    let proportional = s * (gains.course_1_s + a_1_s) + gains.course_1_s * a_1_s;
    let integral = real(gains.integral_rad_m_s2 * at.airspeed_m_s) / s;
    let law = (proportional + integral) / (s * s);
    law * mean_over(s, gains.period_s) * dead_time(s, AGE_S) / (s * gains.filter_s + 1.0)
}

/// Gain margin, dB, and phase margin, deg, of a loop: the smallest change of the gain, up or down, and of the phase at
/// which it oscillates. Negative gain margins are those of an unstable loop.
pub(crate) fn margins_of(open_loop: impl Fn(Complex<f64>) -> Complex<f64>) -> (f64, f64) {
    let (mut gain_db, mut phase_deg) = (f64::INFINITY, f64::INFINITY);
    let [mut frequency_rad_s, last_rad_s] = FREQUENCIES_RAD_S;
    let mut before = open_loop(Complex::new(0.0, frequency_rad_s));
    while frequency_rad_s < last_rad_s {
        frequency_rad_s *= FREQUENCY_FACTOR;
        let now = open_loop(Complex::new(0.0, frequency_rad_s));
        let size = math::hypot(now.re, now.im);
        if before.im * now.im <= 0.0 && now.re < 0.0 {
            // Where the phase falls through -180 deg, more gain is too much; where it rises, less is too little.
            let level_db = 20.0 * size.log10();
            let is_falling = now.im > before.im;
            if is_falling || level_db > 0.0 {
                gain_db = gain_db.min(if is_falling { -level_db } else { level_db });
            }
        }
        if (math::hypot(before.re, before.im) - 1.0) * (size - 1.0) <= 0.0 {
            phase_deg = phase_deg.min(180.0 - math::atan2(now.im, now.re).to_degrees().abs());
        }
        before = now;
    }
    (gain_db, phase_deg)
}

/// Gain margin, dB, and phase margin, deg, of the loop.
pub(crate) fn margins(gains: &Gains, airframe: &Airframe, at: &Condition) -> (f64, f64) {
    margins_of(|s| feedback(s, gains, at) * aircraft(s, gains.share, airframe, at))
}
