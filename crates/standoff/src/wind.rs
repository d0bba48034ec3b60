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
use crate::guidance::heading::Guidance;
use crate::math;
use crate::params::{Integrator, TeamParams, UavParams, WIND_MAX_M_S, WindBelief, WindParams};
use crate::time::Time;
use crate::uav::{Command, LimitedCommand, UavState, clamp_flagged};

/// Smallest cosine of the drift angle, and smallest ground speed (m/s), by which rates are divided.
const DIVISOR_MIN: f64 = 0.1;

/// Largest heading rate per course rate: a UAV that hovers over ground turns its heading, and its course follows later.
const HEADING_PER_COURSE_MAX: f64 = 5.0;

/// Error of predicted escape manoeuvres for each m/s of wind, s. Turns in a wind of 10 m/s end up to 0.07 rad from the
/// predicted course.
const WIND_ERROR_S: f64 = 0.8;

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
    ground_speed_m_s: f64,
    /// Cosine of the drift angle psi - chi.
    cos_drift: f64,
    /// True if an airspeed limit determines the ground speed.
    is_at_limit: bool,
}

impl Triangle {
    /// Heading rate per course rate, at constant airspeed if it is at its limit, otherwise at constant ground speed.
    fn heading_per_course(&self) -> f64 {
        let (cos, ratio) = (self.cos_drift.max(DIVISOR_MIN), self.ground_speed_m_s / self.airspeed_m_s);
        if self.is_at_limit { ratio / cos } else { ratio * cos }
    }
}

impl Wind {
    /// Creates a wind from its speed, m/s, and the direction it blows from, radians clockwise from north, as in weather
    /// reports: a wind from 90 degrees blows from east to west.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn blowing_from(speed_m_s: f64, from_rad: f64) -> Self {
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
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn air_velocity(self, ground: Velocity) -> AirVelocity {
        let air = ground - self.velocity;
        AirVelocity { heading: air.direction(), airspeed_m_s: air.speed_m_s() }
    }

    /// Drift angle psi - chi on a course at an airspeed, m/s, and heading rate per course rate at constant airspeed. On a
    /// course that is not feasible at this airspeed, the UAV flies at right angles to it.
    fn drift(self, course: Angle, airspeed_m_s: f64) -> (Angle, f64) {
        let along = Velocity::from_polar(1.0, course).vector();
        let wind = self.velocity.vector();
        let airspeed_m_s = airspeed_m_s.max(DIVISOR_MIN);
        let sin = (-along.perp(&wind) / airspeed_m_s).clamp(-1.0, 1.0);
        let cos = (1.0 - sin * sin).sqrt();
        let forward_m_s = airspeed_m_s * cos.max(DIVISOR_MIN);
        let per_course = ((wind.dot(&along) + airspeed_m_s * cos) / forward_m_s).clamp(0.0, HEADING_PER_COURSE_MAX);
        (Angle::from_rad(math::atan2(sin, cos)), per_course)
    }

    /// Heading rate, rad/s, with which a UAV in the state `own` over ground follows a path at its airspeed: that of the
    /// course rate of the path, and `gain_1_s` times the error of the heading. `added_rad_s` is added to the course rate.
    ///
    /// The error is that of the heading, not of the course: where the airspeed is below the wind, the course does not
    /// follow the heading, but the heading of every course is defined.
    pub(crate) fn heading_rate_rad_s(self, own: &UavState, path: &Guidance, gain_1_s: f64, added_rad_s: f64) -> f64 {
        let air = self.air_velocity(own.velocity());
        let (drift, per_course) = self.drift(path.course, air.airspeed_m_s);
        let error = air.heading - (path.course + drift);
        (path.turn_rate_rad_s + added_rad_s) * per_course - gain_1_s * error.rad()
    }

    /// Heading rate of a UAV in the state `own` over ground, from its course rate, at constant airspeed, rad/s.
    pub(crate) fn measured_heading_rate_rad_s(self, own: &UavState) -> f64 {
        let airspeed_m_s = self.air_velocity(own.velocity()).airspeed_m_s;
        own.turn_rate_rad_s * self.drift(own.heading, airspeed_m_s).1
    }

    /// State over ground of a UAV whose heading, airspeed and heading rate are those of `air`, and whose airspeed
    /// changes by `acceleration_m_s2`. Position and altitude are the same. A UAV that hovers over ground has a course
    /// rate of zero.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn over_ground(self, air: &UavState, acceleration_m_s2: f64) -> UavState {
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
    /// airspeed and heading rate. Without a commanded airspeed, m/s, its airspeed is constant.
    pub(crate) fn relative_to_air(self, uav: &UavParams, ground: &UavState, commanded_m_s: Option<f64>) -> UavState {
        let AirVelocity { heading, airspeed_m_s } = self.air_velocity(ground.velocity());
        let (sin_drift, cos_drift) = (heading - ground.heading).sin_cos();
        let [slowest_m_s2, fastest_m_s2] = uav.accelerations_m_s2(airspeed_m_s);
        let acceleration_m_s2 = commanded_m_s.map_or(0.0, |commanded_m_s| {
            ((commanded_m_s - airspeed_m_s) / uav.speed_lag_s).clamp(slowest_m_s2, fastest_m_s2)
        });
        let sideways_m_s2 = ground.speed_m_s * ground.turn_rate_rad_s - acceleration_m_s2 * sin_drift;
        let turn_rate_rad_s = sideways_m_s2 / (airspeed_m_s.max(DIVISOR_MIN) * cos_drift.max(DIVISOR_MIN));
        UavState {
            heading,
            speed_m_s: airspeed_m_s,
            turn_rate_rad_s: turn_rate_rad_s.clamp(-FASTEST_RAD_S, FASTEST_RAD_S),
            ..*ground
        }
    }

    /// Command at constant airspeed on a circle over ground, for a course rate now: psi' = V_g chi' / (V_a cos(psi - chi)),
    /// with chi' in proportion to V_g. `lead_s` is the time until the command has its effect.
    pub(crate) fn circle_command(self, own: &UavState, course_rate_rad_s: f64, lead_s: f64) -> Command {
        let airspeed_m_s = self.air_velocity(own.velocity()).airspeed_m_s;
        let course = own.heading + Angle::from_rad(own.turn_rate_rad_s * lead_s);
        let [ground_speed_m_s, forward_m_s] = self.on_course_m_s(course, airspeed_m_s);
        let share = ground_speed_m_s / own.speed_m_s.max(DIVISOR_MIN);
        let turn_rate_rad_s = ground_speed_m_s * course_rate_rad_s * share / forward_m_s;
        Command { speed_m_s: airspeed_m_s, turn_rate_rad_s }
    }

    /// Ground speed on a course at an airspeed, and the part of the airspeed along the course, V_a cos(psi - chi), m/s.
    fn on_course_m_s(self, course: Angle, airspeed_m_s: f64) -> [f64; 2] {
        let along = Velocity::from_polar(1.0, course).vector();
        let wind = self.velocity.vector();
        let cross_m_s = along.perp(&wind);
        let squared = airspeed_m_s * airspeed_m_s - cross_m_s * cross_m_s;
        let forward_m_s = squared.max(0.0).sqrt().max(DIVISOR_MIN * airspeed_m_s.max(DIVISOR_MIN));
        [wind.dot(&along) + forward_m_s, forward_m_s]
    }

    /// Lowest and highest ground speed, m/s, on the course `along`, a unit vector, at airspeeds between the two of
    /// `airspeeds_m_s`; `None` if no ground speed above 0 is possible. The UAV faces along its course: it does not fly
    /// backwards.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn ground_speeds_m_s(self, along: Vector2<f64>, airspeeds_m_s: [f64; 2]) -> Option<[f64; 2]> {
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

    /// Wind triangle at the ground speed nearest to `desired_m_s` that is feasible on the course `after_s` from now;
    /// `None` if there is none.
    fn triangle(self, uav: &UavParams, own: &UavState, desired_m_s: f64, after_s: f64) -> Option<Triangle> {
        let course = own.heading + Angle::from_rad(own.turn_rate_rad_s * after_s);
        let along = Velocity::from_polar(1.0, course).vector();
        let [lowest_m_s, highest_m_s] = self.ground_speeds_m_s(along, uav.speeds_m_s())?;
        let (ground_speed_m_s, is_at_limit) = clamp_flagged(desired_m_s, lowest_m_s, highest_m_s, highest_m_s);
        let air_m_s = along * ground_speed_m_s - self.velocity.vector();
        let airspeed_m_s = air_m_s.norm();
        let cos_drift = air_m_s.dot(&along) / airspeed_m_s;
        (airspeed_m_s > 0.0).then_some(Triangle { airspeed_m_s, ground_speed_m_s, cos_drift, is_at_limit })
    }

    /// Limits a command over ground, ground speed and course rate, to what the UAV can fly in this wind: the airframe
    /// limits airspeed and heading rate. On an infeasible course, the limits are those of calm air.
    pub(crate) fn limit(self, uav: &UavParams, own: &UavState, desired: Command) -> LimitedCommand {
        let Some(triangle) = self.triangle(uav, own, desired.speed_m_s, 0.0) else {
            return LimitedCommand { speed_limited: true, ..uav.limit(desired) };
        };
        let course_rate_max_rad_s = (uav.turn_rate_max_rad_s / triangle.heading_per_course()).min(FASTEST_RAD_S);
        let (turn_rate_rad_s, turn_rate_limited) =
            clamp_flagged(desired.turn_rate_rad_s, -course_rate_max_rad_s, course_rate_max_rad_s, 0.0);
        LimitedCommand {
            command: Command { speed_m_s: triangle.ground_speed_m_s, turn_rate_rad_s },
            speed_limited: triangle.is_at_limit,
            turn_rate_limited,
        }
    }

    /// Converts a command over ground, ground speed and course rate, to airspeed and heading rate, within the limits of
    /// the UAV. `own` is its state over ground.
    ///
    /// Both are those of the course at the time when the command has its effect: after the lag, and for the airspeed in
    /// the middle of the period. If no ground speed is feasible on the course, the UAV turns into the wind at its
    /// highest airspeed, which keeps the drift smallest.
    ///
    /// An evasive turn, for a zone or another aircraft, must be flown as predicted: see [`Self::evasive_command`]. Those of
    /// banking aircraft are predicted at constant airspeed.
    pub(crate) fn air_command(self, team: &TeamParams, own: &UavState, ground: Command, is_evasive: bool) -> Command {
        let uav = &team.uav;
        let speed_after_s = uav.speed_lag_s + 0.5 * team.log.period_s;
        let speed_triangle = self.triangle(uav, own, ground.speed_m_s, speed_after_s);
        let turn_triangle = self.triangle(uav, own, ground.speed_m_s, uav.turn_rate_lag_s);
        match speed_triangle.zip(turn_triangle) {
            None => self.turn_into_wind(team, own),
            Some(_) if is_evasive && uav.bank.is_some() => {
                let lead_s = uav.turn_rate_lag_s + 0.5 * team.log.period_s;
                uav.limit(self.circle_command(own, ground.turn_rate_rad_s, lead_s)).command
            }
            Some((speed, _)) if is_evasive => self.evasive_command(team, own, ground, speed.airspeed_m_s),
            Some((speed, turn)) => {
                let turn_rate_rad_s = ground.turn_rate_rad_s * turn.heading_per_course();
                uav.limit(Command { speed_m_s: speed.airspeed_m_s, turn_rate_rad_s }).command
            }
        }
    }

    /// Airspeed and heading rate for a course rate while the airspeed V_a changes towards `airspeed_m_s`, which in a
    /// crosswind turns the course: psi' = (V_g chi' - V_a' sin(psi - chi)) / (V_a cos(psi - chi)).
    ///
    /// On an orbit this is left out, because aircraft that lack the power for the change, and therefore change their
    /// airspeed more slowly than with the lag of the parameters, would turn wrongly.
    fn evasive_command(self, team: &TeamParams, own: &UavState, ground: Command, airspeed_m_s: f64) -> Command {
        let (uav, period_s) = (&team.uav, team.log.period_s);
        let now_m_s = self.air_velocity(own.velocity()).airspeed_m_s;
        // Change of the airspeed after a time, as a share of the commanded change.
        let share = |t_s: f64| 1.0 - math::exp(-t_s / uav.speed_lag_s);
        let change_m_s = airspeed_m_s - now_m_s;
        let mean_m_s = now_m_s + change_m_s * share(0.5 * period_s);
        let course = own.heading + Angle::from_rad(own.turn_rate_rad_s * uav.turn_rate_lag_s);
        let along = Velocity::from_polar(1.0, course).vector();
        let wind = self.velocity.vector();
        let sin_drift = -along.perp(&wind) / mean_m_s;
        let cos_drift = (1.0 - sin_drift * sin_drift).max(DIVISOR_MIN * DIVISOR_MIN).sqrt();
        let ground_speed_m_s = wind.dot(&along) + mean_m_s * cos_drift;
        // Heading rate at constant airspeed, and what the change of the airspeed adds to it.
        let constant_rad_s = ground_speed_m_s * ground.turn_rate_rad_s / (mean_m_s * cos_drift);
        let added_rad_s = -change_m_s * share(period_s) / period_s * sin_drift / (mean_m_s * cos_drift);
        // The turn has priority: the airspeed grows no faster than the limit of the heading rate leaves room for.
        let room_rad_s = uav.turn_rate_max_rad_s - constant_rad_s.abs();
        let is_short = change_m_s > 0.0 && added_rad_s * constant_rad_s > 0.0 && added_rad_s.abs() > room_rad_s;
        let flown = if is_short { room_rad_s.max(0.0) / added_rad_s.abs() } else { 1.0 };
        let turn_rate_rad_s = constant_rad_s + flown * added_rad_s;
        uav.limit(Command { speed_m_s: now_m_s + flown * change_m_s, turn_rate_rad_s }).command
    }

    /// Turn into the wind at the highest airspeed.
    fn turn_into_wind(self, team: &TeamParams, own: &UavState) -> Command {
        let error = (Velocity::ZERO - self.velocity).direction() - self.air_velocity(own.velocity()).heading;
        let turn_rate_rad_s = team.guidance.heading_gain_1_s * error.rad();
        team.uav.limit(Command { speed_m_s: team.uav.speed_max_m_s(), turn_rate_rad_s }).command
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
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn geofence_wind_m_s(&self, assumed: Option<Wind>) -> f64 {
        let (allowed_m_s, assumed_m_s) = (self.orbit_wind_m_s(), assumed.map_or(0.0, |wind| wind.velocity.speed_m_s()));
        let steps = (assumed_m_s.min(WIND_MAX_M_S) / STRONGER_M_S).ceil();
        if assumed_m_s > allowed_m_s + STRONGER_M_S { steps * STRONGER_M_S } else { allowed_m_s }
    }

    /// Limits over ground in the wind that guidance allows for.
    pub(crate) fn ground_limits(&self) -> PredictionLimits {
        PredictionLimits::in_wind(self.uav, self.orbit_wind_m_s())
    }
}

/// Limits of a UAV over ground, or relative to the air, for predictions that must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PredictionLimits {
    /// What the UAV can fly; over ground on every course: ground speeds from V_min + w to V_max - w, or the nominal one
    /// if this interval is empty, and the course rate in a tailwind at the lowest airspeed, omega_max V_min / (V_min + w).
    pub(crate) uav: UavParams,
    /// Highest speed, m/s; over ground on any course: V_max + w.
    pub(crate) fastest_m_s: f64,
    /// Speed w of the wind, m/s.
    pub(crate) wind_m_s: f64,
    /// Maximum heading rate of the airframe, rad/s.
    heading_rate_max_rad_s: f64,
}

impl PredictionLimits {
    /// Limits in winds of up to `wind_m_s`; in calm air, those of the airframe.
    pub(crate) fn in_wind(uav: UavParams, wind_m_s: f64) -> Self {
        let fastest_m_s = uav.speed_max_m_s() + wind_m_s;
        // The model of a banking aircraft has no steps.
        let integrator = if uav.bank.is_some() { Integrator::Exact } else { uav.integrator };
        let uav = UavParams { integrator, ..uav };
        let limits = if wind_m_s == 0.0 {
            uav
        } else {
            let lowest_m_s = uav.speeds_m_s()[0];
            UavParams {
                speed_change_max_m_s: (uav.speed_change_max_m_s - wind_m_s).max(0.0),
                turn_rate_max_rad_s: uav.turn_rate_max_rad_s * lowest_m_s / (lowest_m_s + wind_m_s),
                ..uav
            }
        };
        Self { uav: limits, fastest_m_s, wind_m_s, heading_rate_max_rad_s: uav.turn_rate_max_rad_s }
    }

    /// Limits relative to the air: those of the airframe.
    pub(crate) fn relative_to_air(team: TeamParams) -> Self {
        Self { wind_m_s: team.orbit_wind_m_s(), ..Self::in_wind(team.uav, 0.0) }
    }

    /// Radius of the tightest circle over ground that a banking UAV can fly at a constant airspeed, m/s, in that wind: with
    /// the highest ground speed on it, r = (V_a + w)^2 / a for a lateral acceleration a.
    pub(crate) fn circle_at_airspeed_m(&self, airspeed_m_s: f64) -> f64 {
        let airframe = UavParams { turn_rate_max_rad_s: self.heading_rate_max_rad_s, ..self.uav };
        let airspeed_m_s = airspeed_m_s.max(DIVISOR_MIN);
        let lateral_m_s2 = airspeed_m_s * airframe.turn_rate_max_at_rad_s(airspeed_m_s);
        let ground_speed_m_s = airspeed_m_s + self.wind_m_s;
        ground_speed_m_s * ground_speed_m_s / lateral_m_s2
    }

    /// Distance by which flown and predicted escape manoeuvres may differ in that wind, m.
    pub(crate) fn wind_error_m(&self) -> f64 {
        WIND_ERROR_S * self.wind_m_s
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
