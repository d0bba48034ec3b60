//! Wind: the wind triangle, the ground speeds that are feasible on a course, and the estimate of the wind.
//!
//! ```text
//! v_g = v_a + w                                                ground velocity = air velocity + wind
//! V_g = w . d + sqrt(V_a^2 - (w x d)^2)                        on the course d, a unit vector
//! V_a psi' = V_g chi' cos(psi - chi) - V_g' sin(psi - chi)     constant wind
//! ```
//!
//! V_g and chi are ground speed and course, V_a and psi airspeed and heading. The third line follows from the first,
//! because in constant wind the acceleration is the same over ground and in the air. At constant ground speed it gives
//! psi' = chi' V_g cos(psi - chi) / V_a; at constant airspeed psi' = chi' V_g / (V_a cos(psi - chi)).
//!
//! Guidance computes ground speed and course rate. [`Wind::air_command`] converts them to airspeed and heading rate as a
//! separate step, within the airspeeds of the UAV.
//!
//! Sources: R. W. Beard and T. W. McLain, *Small Unmanned Aircraft: Theory and Practice*, Princeton University Press,
//! 2012, chapter 2 (wind triangle); T. Stastny and R. Siegwart, *On Flying Backwards: Preventing Run-away of Small,
//! Low-speed, Fixed-wing UAVs in Strong Winds*, IROS 2019 (feasibility; flight into the wind on infeasible courses).

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{FASTEST_RAD_S, Velocity};
use crate::guidance::followed::{Followed, Guidance};
use crate::math;
use crate::params::{TeamParams, UavParams, WIND_MAX_M_S, WindBelief, WindParams};
use crate::time::Time;
use crate::uav::{Command, LimitedCommand, UavState, clamp_flagged};

/// Smallest cosine of the drift angle, and smallest ground speed (m/s), by which rates are divided.
const DIVISOR_MIN: f64 = 0.1;

/// Airspeed per part of the wind across a desired course, at least: a drift of at most 65 degrees.
const ACROSS_RESERVE: f64 = 1.1;

/// Ground speed on a desired course, as a share of the nominal airspeed, which the airspeed allows for: against a strong
/// wind, a UAV that still flies with it needs a higher airspeed than on its course.
const GROUND_SPEED_MIN: f64 = 0.25;

/// Largest heading rate per course rate: a UAV that hovers over ground turns its heading, and its course follows later.
const HEADING_PER_COURSE_MAX: f64 = 5.0;

/// If the assumed wind is stronger than the one that guidance allows for by more than this, m/s, the geofence allows for
/// the assumed one.
const STRONGER_M_S: f64 = 2.0;

/// Velocity of a UAV relative to the air, as its air data and attitude sensors measure it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirVelocity {
    /// Heading psi, the direction of the nose without sideslip; in wind it differs from the course.
    #[doc(alias = "psi")]
    pub heading: Angle,
    /// True airspeed V_a, m/s.
    #[doc(alias = "V_a")]
    pub airspeed_m_s: f64,
}

/// Wind: the horizontal velocity of the air over ground, m/s, in the world frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wind {
    /// Velocity of the air over ground.
    pub velocity: Velocity,
}

/// Wind triangle of a UAV on a course.
struct Triangle {
    airspeed_m_s: f64,
    /// True if an airspeed limit determines the ground speed.
    is_at_limit: bool,
}

impl Wind {
    /// Creates a wind from its speed, m/s, and the direction it blows from, radians clockwise from north, as in weather
    /// reports: a wind from 90 degrees blows from east to west.
    pub fn blowing_from(speed_m_s: f64, from_rad: f64) -> Self {
        let (sin, cos) = math::sin_cos(from_rad);
        Self { velocity: Velocity::from_m_s(-speed_m_s * sin, -speed_m_s * cos) }
    }

    /// Wind relative to a point that moves at `velocity`.
    pub(crate) fn relative_to(self, velocity: Velocity) -> Self {
        Self { velocity: self.velocity - velocity }
    }

    /// Wind that makes a UAV with velocity `air` relative to the air move at `ground` over ground.
    pub(crate) fn measured(ground: Velocity, air: &AirVelocity) -> Self {
        Self { velocity: ground - Velocity::from_polar(air.airspeed_m_s, air.heading) }
    }

    /// Velocity relative to the air of a UAV with velocity `ground` over ground.
    pub fn air_velocity(self, ground: Velocity) -> AirVelocity {
        let air = ground - self.velocity;
        AirVelocity { heading: air.direction(), airspeed_m_s: air.speed_m_s() }
    }

    /// Drift angle psi - chi on a course at an airspeed, m/s, and heading rate per course rate: at constant ground speed if
    /// it `is_held`, otherwise at constant airspeed. On a course that is not feasible at this airspeed, the UAV flies at
    /// right angles to it.
    fn drift(self, course: Angle, airspeed_m_s: f64, is_held: bool) -> (Angle, f64) {
        let along = Velocity::from_polar(1.0, course).vector();
        let wind = self.velocity.vector();
        let airspeed_m_s = airspeed_m_s.max(DIVISOR_MIN);
        let sin = (-along.perp(&wind) / airspeed_m_s).clamp(-1.0, 1.0);
        let cos = (1.0 - sin * sin).sqrt();
        let ratio = (wind.dot(&along) / airspeed_m_s + cos).max(0.0);
        let per_course = if is_held { ratio * cos } else { ratio / cos.max(DIVISOR_MIN) };
        (Angle::from_rad(math::atan2(sin, cos)), per_course.min(HEADING_PER_COURSE_MAX))
    }

    /// Heading rate, rad/s, with which a UAV in the state `own` over ground follows a path at its airspeed: that of the
    /// course rate of the path, and `gain_1_s` times the error of the heading. `added_rad_s` is added to the course rate. The
    /// ground speed `is_held`, or the airspeed.
    ///
    /// The error is that of the heading, not of the course: where the airspeed is below the wind, the course does not
    /// follow the heading, but the heading of every course is defined.
    pub(crate) fn heading_rate_rad_s(
        self,
        own: &UavState,
        path: &Guidance,
        gain_1_s: f64,
        added_rad_s: f64,
        is_held: bool,
    ) -> f64 {
        let air = self.air_velocity(own.velocity());
        let (drift, per_course) = self.drift(path.course, air.airspeed_m_s, is_held);
        let error = air.heading - (path.course + drift);
        (path.turn_rate_rad_s + added_rad_s) * per_course - gain_1_s * error.rad()
    }

    /// Heading rate of a UAV in the state `own` over ground, from its course rate, at constant airspeed, rad/s.
    pub(crate) fn measured_heading_rate_rad_s(self, own: &UavState) -> f64 {
        let airspeed_m_s = self.air_velocity(own.velocity()).airspeed_m_s;
        own.turn_rate_rad_s * self.drift(own.heading, airspeed_m_s, false).1
    }

    /// State over ground of a UAV whose heading, airspeed and heading rate are those of `air`, and whose airspeed
    /// changes by `acceleration_m_s2`. Position and altitude are the same. A UAV that hovers over ground has a course
    /// rate of zero.
    pub fn over_ground(self, air: &UavState, acceleration_m_s2: f64) -> UavState {
        let ground = air.velocity() + self.velocity;
        let (course, ground_speed_m_s) = (ground.direction(), ground.speed_m_s());
        let (sin, cos) = (air.heading - course).sin_cos();
        let sideways_m_s2 = air.speed_m_s * air.turn_rate_rad_s * cos + acceleration_m_s2 * sin;
        let turn_rate_rad_s = if ground_speed_m_s < DIVISOR_MIN { 0.0 } else { sideways_m_s2 / ground_speed_m_s };
        UavState {
            heading: course,
            speed_m_s: ground_speed_m_s,
            turn_rate_rad_s: turn_rate_rad_s.clamp(-FASTEST_RAD_S, FASTEST_RAD_S),
            ..*air
        }
    }

    /// State relative to the air of an aircraft in a state over ground, the inverse of [`Self::over_ground`]: heading,
    /// airspeed and heading rate. `acceleration_m_s2` returns how its airspeed, m/s, changes, m/s2.
    pub(crate) fn relative_to_air(self, ground: &UavState, acceleration_m_s2: impl FnOnce(f64) -> f64) -> UavState {
        let AirVelocity { heading, airspeed_m_s } = self.air_velocity(ground.velocity());
        let (sin_drift, cos_drift) = (heading - ground.heading).sin_cos();
        let sideways_m_s2 = ground.speed_m_s * ground.turn_rate_rad_s - acceleration_m_s2(airspeed_m_s) * sin_drift;
        let turn_rate_rad_s = sideways_m_s2 / (airspeed_m_s.max(DIVISOR_MIN) * cos_drift.max(DIVISOR_MIN));
        UavState {
            heading,
            speed_m_s: airspeed_m_s,
            turn_rate_rad_s: turn_rate_rad_s.clamp(-FASTEST_RAD_S, FASTEST_RAD_S),
            ..*ground
        }
    }

    /// Ground speed at an airspeed on the course `along`, a unit vector, m/s.
    pub(crate) fn ground_speed_m_s(self, along: Vector2<f64>, airspeed_m_s: f64) -> f64 {
        let wind = self.velocity.vector();
        let cross_m_s = along.perp(&wind);
        wind.dot(&along) + (airspeed_m_s * airspeed_m_s - cross_m_s * cross_m_s).max(0.0).sqrt()
    }

    /// Lowest and highest ground speed, m/s, on the course `along`, a unit vector, at airspeeds between the two of
    /// `airspeeds_m_s`; `None` if no ground speed above 0 is possible. The UAV faces along its course: it does not fly
    /// backwards.
    pub fn ground_speeds_m_s(self, along: Vector2<f64>, airspeeds_m_s: [f64; 2]) -> Option<[f64; 2]> {
        let wind = self.velocity.vector();
        let (tail_m_s, cross_m_s) = (wind.dot(&along), along.perp(&wind));
        let forward_m_s = |airspeed_m_s: f64| {
            let squared = airspeed_m_s * airspeed_m_s - cross_m_s * cross_m_s;
            (squared >= 0.0).then(|| squared.sqrt())
        };
        let highest_m_s = tail_m_s + forward_m_s(airspeeds_m_s[1])?;
        let lowest_m_s = (tail_m_s + forward_m_s(airspeeds_m_s[0]).unwrap_or(0.0)).max(0.0);
        (highest_m_s > lowest_m_s.max(DIVISOR_MIN)).then_some([lowest_m_s, highest_m_s])
    }

    /// Wind triangle at the ground speed nearest to `desired_m_s` that is feasible on a course; `None` if there is none.
    fn triangle(self, uav: &UavParams, course: Angle, desired_m_s: f64) -> Option<Triangle> {
        let along = Velocity::from_polar(1.0, course).vector();
        let [lowest_m_s, highest_m_s] = self.ground_speeds_m_s(along, uav.speeds_m_s())?;
        let (ground_speed_m_s, is_at_limit) = clamp_flagged(desired_m_s, lowest_m_s, highest_m_s, highest_m_s);
        let airspeed_m_s = (along * ground_speed_m_s - self.velocity.vector()).norm();
        (airspeed_m_s > 0.0).then_some(Triangle { airspeed_m_s, is_at_limit })
    }

    /// Command relative to the air, within the limits of the UAV, that follows guidance over ground. `own` is the state over
    /// ground now. This is the last step of guidance, and the only one that knows the wind.
    ///
    /// The airspeed gives the desired ground speed on the course at the time when it has its effect: after the lag, in the
    /// middle of the period. It is high enough for the desired course, so that the UAV comes out of courses that the wind
    /// dictates. The heading follows that of the desired course. If no airspeed within the limits makes the
    /// course feasible, the UAV turns into the wind at its highest airspeed, which keeps the drift smallest.
    pub(crate) fn air_command(self, team: &TeamParams, own: &UavState, followed: &Followed) -> LimitedCommand {
        let (uav, path) = (&team.uav, &followed.guidance);
        let Some(least_m_s) = self.airspeed_min_on_m_s(path.course, uav) else {
            return LimitedCommand { speed_limited: true, ..self.turn_into_wind(team, own) };
        };
        let after_s = uav.speed_lag_s + 0.5 * team.log.period_s;
        let course = own.heading + Angle::from_rad(own.turn_rate_rad_s * after_s);
        let triangle = self.triangle(uav, course, path.speed_m_s);
        let airspeed_m_s = triangle.as_ref().map_or(uav.speed_max_m_s(), |triangle| triangle.airspeed_m_s);
        let is_held = triangle.as_ref().is_some_and(|triangle| !triangle.is_at_limit) && uav.bank.is_none();
        let turn_rate_rad_s = self.heading_rate_rad_s(&followed.own, path, followed.gain_1_s, 0.0, is_held);
        let limited = uav.limit(Command { speed_m_s: airspeed_m_s.max(least_m_s), turn_rate_rad_s });
        let speed_limited = limited.speed_limited || triangle.is_none_or(|triangle| triangle.is_at_limit);
        LimitedCommand { speed_limited, ..limited }
    }

    /// Lowest airspeed with which a course is flown at a ground speed well above 0 and with a drift well below a right
    /// angle, m/s, or the highest one; `None` if the highest one does not lead along the course.
    fn airspeed_min_on_m_s(self, course: Angle, uav: &UavParams) -> Option<f64> {
        let along = Velocity::from_polar(1.0, course).vector();
        let (wind, highest_m_s) = (self.velocity.vector(), uav.speed_max_m_s());
        let across_m_s = along.perp(&wind).abs();
        let is_feasible = across_m_s < highest_m_s && self.ground_speed_m_s(along, highest_m_s) > DIVISOR_MIN;
        let ahead_m_s = (along * (GROUND_SPEED_MIN * uav.speed_m_s) - wind).norm();
        is_feasible.then_some(ahead_m_s.max(ACROSS_RESERVE * across_m_s).min(highest_m_s))
    }

    /// Turn into the wind at the highest airspeed.
    fn turn_into_wind(self, team: &TeamParams, own: &UavState) -> LimitedCommand {
        let error = (Velocity::ZERO - self.velocity).direction() - self.air_velocity(own.velocity()).heading;
        let turn_rate_rad_s = team.guidance.heading_gain_1_s * error.rad();
        team.uav.limit(Command { speed_m_s: team.uav.speed_max_m_s(), turn_rate_rad_s })
    }
}

impl TeamParams {
    /// Speed of the wind that guidance allows for, m/s.
    pub(crate) fn orbit_wind_m_s(&self) -> f64 {
        self.wind.map_or(0.0, |wind| wind.orbit_wind_m_s)
    }

    /// Speed of the wind that the geofence of a UAV allows for, m/s: that of [`WindParams::orbit_wind_m_s`], unless the UAV
    /// assumes a wind that is stronger by more than 2 m/s. Then it is a multiple of 2 m/s, so that few safety functions are
    /// built.
    pub fn geofence_wind_m_s(&self, assumed: Option<Wind>) -> f64 {
        let (allowed_m_s, assumed_m_s) = (self.orbit_wind_m_s(), assumed.map_or(0.0, |wind| wind.velocity.speed_m_s()));
        let steps = (assumed_m_s.min(WIND_MAX_M_S) / STRONGER_M_S).ceil();
        if assumed_m_s > allowed_m_s + STRONGER_M_S { steps * STRONGER_M_S } else { allowed_m_s }
    }
}

/// Low-pass filtered wind of a UAV.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WindEstimate {
    wind: Wind,
    at: Time,
}

impl WindEstimate {
    /// Estimate after a measurement of the wind at `now`. The first measurement is taken as it is; after it, the
    /// estimate follows with the time constant of the parameters. A measurement that is not finite, or not later than
    /// the last one, is ignored.
    pub(crate) fn updated(before: Option<Self>, params: &WindParams, now: Time, measured: Wind) -> Option<Self> {
        if !measured.velocity.is_finite() {
            return before;
        }
        let Some(Self { wind, at }) = before else { return Some(Self { wind: measured, at: now }) };
        let dt_s = (now - at).s();
        if dt_s <= 0.0 {
            return before;
        }
        let gain = 1.0 - math::exp(-dt_s / params.estimate_time_constant_s);
        let velocity = Velocity::from(wind.velocity.vector().lerp(&measured.velocity.vector(), gain));
        Some(Self { wind: Wind { velocity }, at: now })
    }
}

impl WindParams {
    /// Wind that a UAV with this estimate assumes; `None`, calm air, before the first measurement.
    pub(crate) fn believed(&self, estimate: Option<&WindEstimate>) -> Option<Wind> {
        match self.belief {
            WindBelief::Given => Some(Wind::blowing_from(self.believed_speed_m_s, self.believed_from_rad)),
            WindBelief::Estimated => estimate.map(|estimate| estimate.wind),
        }
    }
}

#[cfg(test)]
mod tests;
