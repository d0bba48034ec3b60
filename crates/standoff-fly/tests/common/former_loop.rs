//! Copy of the former loop, which oscillated behind ArduPlane: a turn rate every 0.5 s, from a state that is extrapolated
//! over the lag of the turn rate, and a share of the coordinated turn rate that is estimated from heading and roll.
//!
//! ```text
//! u = f(t + L) - k (chi(t + L) - chi_d(t + L))                  held for 0.5 s
//! phi = atan(V (w + d) / (s g))        e = w_measured - (s c - d),   c = g tan(phi_measured) / V
//! s' = k_s e c / (c^2 + c_0^2)         d' = -k_d e
//! ```

use std::collections::VecDeque;

use standoff::Angle;
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;

use super::offline_flight::{InnerLoop, Known, Orbit, PERIOD_S};

/// Periods of 0.1 s for which a turn rate is held, and over which rates of directions are measured.
const HELD: usize = 5;
const WINDOW: usize = 3;

/// Gain k, 1/s, and lag L, s, of the documented flight.
const COURSE_GAIN_1_S: f64 = 0.4;
const LAG_S: f64 = 0.8;

/// Largest change of the roll command, rad/s, and largest roll, rad.
const ROLL_COMMAND_RATE_MAX_RAD_S: f64 = 60.0 * math::PI / 180.0;
const ROLL_MAX_RAD: f64 = 65.0 * math::PI / 180.0;

/// The former loop.
#[derive(Debug)]
pub(crate) struct FormerLoop {
    orbit: Orbit,
    /// Courses and headings of the last periods, the newest last.
    courses: VecDeque<Angle>,
    headings: VecDeque<Angle>,
    steps: usize,
    /// Desired turn rate over ground, rad/s, positive to the left.
    desired_rad_s: f64,
    share: f64,
    deficit_rad_s: f64,
    roll_rad: f64,
}

/// Adds a direction and returns its rate over the window, rad/s.
fn rate_rad_s(directions: &mut VecDeque<Angle>, direction: Angle) -> f64 {
    directions.push_back(direction);
    if directions.len() <= WINDOW {
        return 0.0;
    }
    let rate_rad_s = (direction - directions[0]).rad() / (WINDOW as f64 * PERIOD_S);
    directions.pop_front();
    rate_rad_s
}

impl FormerLoop {
    pub(crate) fn new(orbit: Orbit) -> Self {
        let (courses, headings) = (VecDeque::new(), VecDeque::new());
        Self { orbit, courses, headings, steps: 0, desired_rad_s: 0.0, share: 1.0, deficit_rad_s: 0.0, roll_rad: 0.0 }
    }

    /// The desired turn rate of the state one lag later, rad/s.
    fn extrapolated_rad_s(&self, known: &Known, turn_rate_rad_s: f64) -> f64 {
        let (speed_m_s, course) = (known.velocity.speed_m_s(), known.velocity.direction());
        let turned = Angle::from_rad(turn_rate_rad_s * LAG_S);
        let mean = standoff::Velocity::from_polar(speed_m_s, course + Angle::from_rad(0.5 * turned.rad()));
        let later = Known {
            position: known.position + mean * LAG_S,
            velocity: standoff::Velocity::from_polar(speed_m_s, course + turned),
            centre: known.centre + known.centre_velocity * LAG_S,
            ..*known
        };
        let error = later.velocity.direction() - self.orbit.course(&later);
        self.orbit.turn_rate_rad_s(&later) - COURSE_GAIN_1_S * error.rad()
    }

    /// Estimates the share of the coordinated turn rate, and what is missing in addition.
    fn estimate(&mut self, known: &Known, heading_rate_rad_s: f64) {
        let (sin, cos) = math::sin_cos(known.roll_rad);
        let coordinated_rad_s = -GRAVITY_M_S2 * sin / cos / known.true_airspeed_m_s;
        let error_rad_s = heading_rate_rad_s - (self.share * coordinated_rad_s - self.deficit_rad_s);
        let turn = coordinated_rad_s / (coordinated_rad_s * coordinated_rad_s + 0.05 * 0.05);
        self.share = (self.share + 0.5 * PERIOD_S * error_rad_s * turn).clamp(0.4, 1.5);
        self.deficit_rad_s = (self.deficit_rad_s - 0.1 * PERIOD_S * error_rad_s).clamp(-0.3, 0.3);
    }
}

impl InnerLoop for FormerLoop {
    fn roll_rad(&mut self, known: &Known) -> f64 {
        let course = known.velocity.direction();
        let turn_rate_rad_s = rate_rad_s(&mut self.courses, course);
        let heading_rate_rad_s = rate_rad_s(&mut self.headings, known.heading);
        if self.steps.is_multiple_of(HELD) {
            self.desired_rad_s = self.extrapolated_rad_s(known, turn_rate_rad_s);
        }
        self.steps += 1;
        self.estimate(known, heading_rate_rad_s);
        let drift_cos = math::sin_cos((known.heading - course).rad()).1;
        let desired_m_s2 =
            known.velocity.speed_m_s() * self.desired_rad_s / drift_cos + known.true_airspeed_m_s * self.deficit_rad_s;
        let roll_rad = -math::atan2(desired_m_s2, self.share * GRAVITY_M_S2).clamp(-ROLL_MAX_RAD, ROLL_MAX_RAD);
        let step_rad = ROLL_COMMAND_RATE_MAX_RAD_S * PERIOD_S;
        self.roll_rad = roll_rad.clamp(self.roll_rad - step_rad, self.roll_rad + step_rad);
        self.roll_rad
    }
}
