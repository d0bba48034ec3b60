//! Aircraft with its autopilot, as identified from roll commands and telemetry of ArduPlane's simulator (model `plane`),
//! in simulated time. Roll phi, course rate w and roll command u are positive to the right.
//!
//! ```text
//! roll      p' = 2 z wn (d - p),  d = clamp(wn / (2 z) (u(t - T_u) - phi), -p_max, p_max),  phi' = p
//! load      n = 1 + e,  e'' = a^2 (m + T m' - e) - 2 b a e',  m = k (1 / cos phi(t - T_n) - 1)
//! course    c = (g / V) n sin phi,  x' = (c(t - T_c) - x) / T_x,  w = s (x + l (c(t - T_c) - x)) + r p(t - T_p)
//! heading   psi = course relative to the air + beta,  beta'' = 15^2 (-0.0854 phi + 0.0283 s p - beta) - 2 0.18 15 beta'
//! airspeed  V' = a,  a' = (clamp(0.31 (V_c - V) + i, -0.84, 0.70) - a) / 0.13,  i' = 0.034 (V_c - V) within the limits
//! ```
//!
//! V is the true airspeed in the course, and the calibrated one in the last line. Turbulence adds first-order noise to
//! the ground velocity. What the measured aircraft does and this one does not:
//!
//! - Its airspeed pauses for 2 s while it changes (0.5 m/s rms from this one), overshoots by 0.7 instead of 0.4 m/s, and
//!   rises by up to 0.9 m/s after a roll to 45 degrees.
//! - In turbulence its roll (0.1 degrees), heading rate (0.028 rad/s) and airspeed (0.17 m/s) are disturbed, too.
//! - Its parameters change with the airspeed: those identified at 18 and 28 m/s differ from these by 5 % in the roll,
//!   16 % in the share of the load, and 40 % in the course rate per roll rate.
//! - The coordinated airframe has the sideslip of the stock one.

use std::collections::VecDeque;

use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;
use standoff::{Angle, Position, Velocity};

/// Step of the simulation, s.
pub(crate) const STEP_S: f64 = 0.01;

/// True airspeed per calibrated airspeed, as measured; the standard atmosphere has 1.036 at that altitude.
pub(crate) const TRUE_PER_CALIBRATED: f64 = 1.073;

/// Standard deviation of the ground velocity per axis, m/s, and its correlation time, s, in "turbulence 0.5".
const TURBULENCE_SD_M_S: f64 = 0.163;
const TURBULENCE_S: f64 = 0.2;

/// Longest roll dead time, s.
const DEAD_TIME_MAX_S: f64 = 0.5;

/// Largest roll for which the load factor is computed, rad.
const ROLL_MAX_RAD: f64 = 80.0 * math::PI / 180.0;

/// Parameters of the response to roll commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Airframe {
    /// Dead time T_u, s, natural frequency wn, rad/s, damping z, and largest rate p_max, rad/s, of the roll.
    pub(crate) roll_dead_time_s: f64,
    pub(crate) roll_frequency_rad_s: f64,
    pub(crate) roll_damping: f64,
    pub(crate) roll_rate_max_rad_s: f64,
    /// Share k, natural frequency a, rad/s, damping b, dead time T_n, s, and lead T, s, of the load factor.
    pub(crate) load_share: f64,
    pub(crate) load_frequency_rad_s: f64,
    pub(crate) load_damping: f64,
    pub(crate) load_dead_time_s: f64,
    pub(crate) load_lead_s: f64,
    /// Share s, direct part l, lag T_x, s, and dead time T_c, s, of the course rate.
    pub(crate) course_share: f64,
    pub(crate) course_direct: f64,
    pub(crate) course_lag_s: f64,
    pub(crate) course_dead_time_s: f64,
    /// Course rate per roll rate r, and its dead time T_p, s.
    pub(crate) roll_rate_gain: f64,
    pub(crate) roll_rate_dead_time_s: f64,
}

impl Airframe {
    /// Airframe with the stock parameters of the simulator: 0.74 of the coordinated turn rate.
    pub(crate) const STOCK: Self = Self {
        roll_dead_time_s: 0.0882,
        roll_frequency_rad_s: 5.778,
        roll_damping: 0.4768,
        roll_rate_max_rad_s: 1.863,
        load_share: 0.9865,
        load_frequency_rad_s: 5.727,
        load_damping: 0.2114,
        load_dead_time_s: 0.1332,
        load_lead_s: 0.8084,
        course_share: 0.7382,
        course_direct: 0.1839 / 0.2795,
        course_lag_s: 0.2795,
        course_dead_time_s: 0.0196,
        roll_rate_gain: 0.08433,
        roll_rate_dead_time_s: 0.1148,
    };

    /// Airframe with a coordinated rudder: 0.84 to 0.9 of the coordinated turn rate at 30 to 45 degrees.
    pub(crate) const COORDINATED: Self = Self {
        load_share: 1.376,
        load_frequency_rad_s: 5.643,
        load_damping: 0.1781,
        load_dead_time_s: 0.1502,
        load_lead_s: 0.324,
        course_share: 0.7976,
        course_direct: 0.0208 / 0.02,
        course_lag_s: 0.02,
        course_dead_time_s: 0.0,
        roll_rate_gain: 0.03979,
        roll_rate_dead_time_s: 0.066,
        ..Self::STOCK
    };

    /// The same airframe with `gain` times the course response and `dead_time_s` more dead time.
    pub(crate) fn changed(self, gain: f64, dead_time_s: f64) -> Self {
        Self {
            course_share: gain * self.course_share,
            roll_rate_gain: gain * self.roll_rate_gain,
            roll_dead_time_s: self.roll_dead_time_s + dead_time_s,
            ..self
        }
    }
}

/// Past values of a signal, one for each step.
#[derive(Debug, Clone)]
struct History(VecDeque<f64>);

impl History {
    fn new(value: f64) -> Self {
        Self(VecDeque::from(vec![value; (DEAD_TIME_MAX_S / STEP_S) as usize + 2]))
    }

    /// Adds the value of this step and returns the one `dead_time_s` before.
    fn delayed(&mut self, value: f64, dead_time_s: f64) -> f64 {
        self.0.pop_back();
        self.0.push_front(value);
        let steps = dead_time_s / STEP_S;
        let (whole, part) = (steps.floor(), steps - steps.floor());
        self.0[whole as usize] * (1.0 - part) + self.0[whole as usize + 1] * part
    }
}

/// A source of random numbers of a normal distribution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number with standard deviation 1: the sum of twelve uniform ones.
    pub(crate) fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Aircraft that follows commands of roll and airspeed.
#[derive(Debug, Clone)]
pub(crate) struct IdentifiedAircraft {
    airframe: Airframe,
    pub(crate) position: Position,
    /// Course relative to the air.
    pub(crate) air_course: Angle,
    /// Velocity of the air over ground, m/s east and north.
    pub(crate) wind_m_s: [f64; 2],
    /// Roll, rad, and its rate, rad/s, positive to the right.
    pub(crate) roll_rad: f64,
    pub(crate) roll_rate_rad_s: f64,
    /// Rate of the course relative to the air, rad/s, positive to the right.
    pub(crate) course_rate_rad_s: f64,
    /// Calibrated airspeed, m/s.
    pub(crate) airspeed_m_s: f64,
    /// Commands: roll, rad, positive to the right, and calibrated airspeed, m/s.
    pub(crate) roll_command_rad: f64,
    pub(crate) airspeed_command_m_s: f64,
    /// Load factor less 1, and its rate, 1/s.
    load: [f64; 2],
    load_input: f64,
    course_lag_rad_s: f64,
    /// Angle from course to heading, rad, positive to the right, and its rate, rad/s.
    sideslip: [f64; 2],
    acceleration_m_s2: f64,
    acceleration_integral_m_s2: f64,
    /// Disturbance of the ground velocity, m/s, and its random numbers; `None` in smooth air.
    turbulence: Option<([f64; 2], Noise)>,
    commands: History,
    rolls: History,
    turns: History,
    roll_rates: History,
}

impl IdentifiedAircraft {
    /// Creates an aircraft in level flight at a calibrated airspeed.
    pub(crate) fn new(airframe: Airframe, position: Position, air_course: Angle, airspeed_m_s: f64) -> Self {
        Self {
            airframe,
            position,
            air_course,
            wind_m_s: [0.0; 2],
            roll_rad: 0.0,
            roll_rate_rad_s: 0.0,
            course_rate_rad_s: 0.0,
            airspeed_m_s,
            roll_command_rad: 0.0,
            airspeed_command_m_s: airspeed_m_s,
            load: [0.0; 2],
            load_input: 0.0,
            course_lag_rad_s: 0.0,
            sideslip: [0.0; 2],
            acceleration_m_s2: 0.0,
            acceleration_integral_m_s2: 0.0,
            turbulence: None,
            commands: History::new(0.0),
            rolls: History::new(0.0),
            turns: History::new(0.0),
            roll_rates: History::new(0.0),
        }
    }

    /// The same aircraft in a wind, m/s east and north, with turbulence from a seed.
    pub(crate) fn in_wind(mut self, wind_m_s: [f64; 2], turbulence_seed: Option<u64>) -> Self {
        self.wind_m_s = wind_m_s;
        self.turbulence = turbulence_seed.map(|seed| ([0.0; 2], Noise::new(seed)));
        self
    }

    /// True airspeed, m/s.
    pub(crate) fn true_airspeed_m_s(&self) -> f64 {
        TRUE_PER_CALIBRATED * self.airspeed_m_s
    }

    /// Direction of the nose.
    pub(crate) fn heading(&self) -> Angle {
        self.air_course - Angle::from_rad(self.sideslip[0])
    }

    /// Velocity over ground.
    pub(crate) fn velocity(&self) -> Velocity {
        let air = Velocity::from_polar(self.true_airspeed_m_s(), self.air_course);
        let [gust_east, gust_north] = self.turbulence.map_or([0.0; 2], |(gust_m_s, _)| gust_m_s);
        let [east, north] = self.wind_m_s;
        air + Velocity::from_m_s(east + gust_east, north + gust_north)
    }

    /// Simulates a step.
    pub(crate) fn advance(&mut self) {
        self.roll();
        self.turn();
        self.slip();
        self.accelerate();
        if let Some((gust_m_s, noise)) = &mut self.turbulence {
            let kept = math::exp(-STEP_S / TURBULENCE_S);
            let added_m_s = TURBULENCE_SD_M_S * (1.0 - kept * kept).sqrt();
            *gust_m_s = gust_m_s.map(|m_s| kept * m_s + added_m_s * noise.next());
        }
        self.air_course = self.air_course - Angle::from_rad(self.course_rate_rad_s * STEP_S);
        self.position = self.position + self.velocity() * STEP_S;
    }

    fn roll(&mut self) {
        let Airframe { roll_dead_time_s, roll_frequency_rad_s, roll_damping, roll_rate_max_rad_s, .. } = self.airframe;
        let command_rad = self.commands.delayed(self.roll_command_rad, roll_dead_time_s);
        let desired_rad_s = roll_frequency_rad_s / (2.0 * roll_damping) * (command_rad - self.roll_rad);
        let desired_rad_s = desired_rad_s.clamp(-roll_rate_max_rad_s, roll_rate_max_rad_s);
        self.roll_rate_rad_s +=
            2.0 * roll_damping * roll_frequency_rad_s * (desired_rad_s - self.roll_rate_rad_s) * STEP_S;
        self.roll_rad += self.roll_rate_rad_s * STEP_S;
    }

    fn turn(&mut self) {
        let airframe = self.airframe;
        let (frequency, damping) = (airframe.load_frequency_rad_s, airframe.load_damping);
        let roll_rad = self.rolls.delayed(self.roll_rad, airframe.load_dead_time_s).clamp(-ROLL_MAX_RAD, ROLL_MAX_RAD);
        let load_input = airframe.load_share * (1.0 / math::sin_cos(roll_rad).1 - 1.0);
        let change_1_s = (load_input - self.load_input) / STEP_S;
        self.load_input = load_input;
        let [load, rate_1_s] = &mut self.load;
        let error = load_input + airframe.load_lead_s * change_1_s - *load;
        *rate_1_s += (frequency * frequency * error - 2.0 * damping * frequency * *rate_1_s) * STEP_S;
        *load += *rate_1_s * STEP_S;

        let (sin, _) = math::sin_cos(self.roll_rad);
        let turn_rad_s = GRAVITY_M_S2 / self.true_airspeed_m_s() * (1.0 + self.load[0]) * sin;
        let turn_rad_s = self.turns.delayed(turn_rad_s, airframe.course_dead_time_s);
        let kept = math::exp(-STEP_S / airframe.course_lag_s);
        self.course_lag_rad_s = turn_rad_s + kept * (self.course_lag_rad_s - turn_rad_s);
        let direct_rad_s = airframe.course_direct * (turn_rad_s - self.course_lag_rad_s);
        let rolling_rad_s = self.roll_rates.delayed(self.roll_rate_rad_s, airframe.roll_rate_dead_time_s);
        self.course_rate_rad_s =
            airframe.course_share * (self.course_lag_rad_s + direct_rad_s) + airframe.roll_rate_gain * rolling_rad_s;
    }

    /// The rudder is mixed to the ailerons.
    fn slip(&mut self) {
        let desired_rad = -0.0854 * self.roll_rad + 0.0283 * self.roll_rate_rad_s;
        let [angle_rad, rate_rad_s] = &mut self.sideslip;
        *rate_rad_s += (225.0 * (desired_rad - *angle_rad) - 5.4 * *rate_rad_s) * STEP_S;
        *angle_rad += *rate_rad_s * STEP_S;
    }

    fn accelerate(&mut self) {
        let error_m_s = self.airspeed_command_m_s - self.airspeed_m_s;
        let desired_m_s2 = 0.31 * error_m_s + self.acceleration_integral_m_s2;
        let within_m_s2 = desired_m_s2.clamp(-0.84, 0.70);
        if desired_m_s2 == within_m_s2 {
            self.acceleration_integral_m_s2 += 0.034 * error_m_s * STEP_S;
        }
        self.acceleration_m_s2 += (within_m_s2 - self.acceleration_m_s2) * STEP_S / 0.13;
        self.airspeed_m_s += self.acceleration_m_s2 * STEP_S;
    }
}
