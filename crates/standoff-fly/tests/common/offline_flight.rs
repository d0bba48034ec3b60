//! Flight of an inner loop behind the identified aircraft around an exact or a noisy target, without MAVLink and team.

use standoff::guidance::vector_field::VectorField;
use standoff::math;
use standoff::{Angle, Displacement, OrbitDirection, Position, Velocity};

use super::identified_aircraft::{self, IdentifiedAircraft, Noise, STEP_S};
use super::plane::TARGET_SPEED_M_S;

/// Period of roll commands, s.
pub(crate) const PERIOD_S: f64 = 0.1;

/// Steps of the aircraft in a period, and from the measurement to the command: the mean age of positions of 10 Hz.
const STEPS: usize = 10;
const AGE_STEPS: usize = 5;

/// Calibrated airspeeds that are commanded at constant ground speed, m/s.
const AIRSPEEDS_M_S: [f64; 2] = [16.0, 28.0];

/// Standard deviations of a noisy centre per axis, m and m/s, and their correlation time, s.
const CENTRE_SD: [f64; 2] = [2.0, 0.5];
const CENTRE_NOISE_S: f64 = 2.0;

/// What an inner loop knows at a command.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    pub(crate) position: Position,
    /// Velocity over ground.
    pub(crate) velocity: Velocity,
    pub(crate) heading: Angle,
    /// Roll, rad, positive to the right.
    pub(crate) roll_rad: f64,
    pub(crate) true_airspeed_m_s: f64,
    /// Centre of the orbit and its velocity.
    pub(crate) centre: Position,
    pub(crate) centre_velocity: Velocity,
}

/// Orbit to fly, anticlockwise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Orbit {
    pub(crate) radius_m: f64,
    /// Radial gain k_l of the field.
    pub(crate) radial_gain: f64,
}

impl Orbit {
    /// Desired course over ground at a position, at the ground speed (28, 29).
    pub(crate) fn course(&self, known: &Known) -> Angle {
        let Self { radius_m, radial_gain } = *self;
        let field = VectorField { radius_m, radial_gain, orbit_direction: OrbitDirection::Anticlockwise };
        let along = field.direction(known.position - known.centre);
        let centre = known.centre_velocity.vector();
        let (drift, speed_m_s) = (along.dot(&centre), known.velocity.speed_m_s());
        let gap = (drift * drift + speed_m_s * speed_m_s - centre.dot(&centre)).max(0.0).sqrt();
        Velocity::from(centre + along * (gap - drift)).direction()
    }

    /// Turn rate of the desired course along the motion of the aircraft and the centre, rad/s, positive to the left.
    pub(crate) fn turn_rate_rad_s(&self, known: &Known) -> f64 {
        const HALF_S: f64 = 1e-3;
        let [before, after] = [-HALF_S, HALF_S].map(|after_s| {
            let position = known.position + known.velocity * after_s;
            self.course(&Known { position, centre: known.centre + known.centre_velocity * after_s, ..*known })
        });
        (after - before).rad() / (2.0 * HALF_S)
    }
}

/// Loop that computes a roll command, rad, positive to the right, every [`PERIOD_S`].
pub(crate) trait InnerLoop {
    fn roll_rad(&mut self, known: &Known) -> f64;
}

/// Motion of the target: speed, m/s, and turn rate, rad/s, positive to the left, at a time, s.
pub(crate) type TargetMotion = fn(f64) -> [f64; 2];

/// Target that moves straight at the speed of most tests.
pub(crate) fn straight(_: f64) -> [f64; 2] {
    [TARGET_SPEED_M_S, 0.0]
}

/// Target that turns by 90 degrees at 9 deg/s and by 180 at 18 deg/s, stops within 3 s, starts, and turns again.
pub(crate) fn manoeuvring(time_s: f64) -> [f64; 2] {
    let turn_deg_s = match time_s {
        70.0..80.0 => 9.0,
        110.0..120.0 => -18.0,
        230.0..235.0 => 18.0,
        _ => 0.0,
    };
    let stopped = ((time_s - 160.0) / 3.0).clamp(0.0, 1.0) - ((time_s - 183.0) / 3.0).clamp(0.0, 1.0);
    [TARGET_SPEED_M_S * (1.0 - stopped), f64::to_radians(turn_deg_s)]
}

/// Target that starts at the origin to the east.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    pub(crate) motion: TargetMotion,
    pub(crate) position: Position,
    pub(crate) velocity: Velocity,
    time_s: f64,
    course: Angle,
}

impl Target {
    pub(crate) fn new(motion: TargetMotion) -> Self {
        let velocity = Velocity::from_polar(motion(0.0)[0], Angle::ZERO);
        Self { motion, position: Position::ORIGIN, velocity, time_s: 0.0, course: Angle::ZERO }
    }

    pub(crate) fn advance(&mut self, step_s: f64) {
        let [speed_m_s, turn_rate_rad_s] = (self.motion)(self.time_s);
        self.velocity = Velocity::from_polar(speed_m_s, self.course);
        self.position = self.position + self.velocity * step_s;
        self.course = self.course + Angle::from_rad(turn_rate_rad_s * step_s);
        self.time_s += step_s;
    }
}

/// A flight of [`Flight::fly`].
#[derive(Debug, Clone)]
pub(crate) struct Flight {
    pub(crate) aircraft: IdentifiedAircraft,
    pub(crate) orbit: Orbit,
    pub(crate) target: TargetMotion,
    /// Seed of the errors of the centre; `None` if the loop knows the target exactly.
    pub(crate) centre_seed: Option<u64>,
    /// Ground speed, m/s, that airspeed commands hold; `None` for a constant airspeed.
    pub(crate) ground_speed_m_s: Option<f64>,
    /// Duration, and time from which the flight is measured, s.
    pub(crate) seconds: [f64; 2],
}

/// Result of a flight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flown {
    /// Mean, root mean square and maximum of the orbit error, m.
    pub(crate) error_m: [f64; 3],
    /// Mean of the size of the roll rate, deg/s.
    pub(crate) roll_rate_deg_s: f64,
    /// Share of the time with a bank to the outside of the orbit.
    pub(crate) wrong_bank: f64,
    /// Mean period of the roll about its mean, s.
    pub(crate) period_s: f64,
}

impl Flight {
    /// Flies the aircraft with a loop.
    pub(crate) fn fly(mut self, inner_loop: &mut impl InnerLoop) -> Flown {
        let [seconds, from_s] = self.seconds;
        let mut target = Target::new(self.target);
        let mut noise = self.centre_seed.map(|seed| ([0.0; 4], Noise::new(seed)));
        let mut samples = Vec::new();
        for period in 0..(seconds / PERIOD_S) as usize {
            let time_s = period as f64 * PERIOD_S;
            let mut known = None;
            for step in 0..STEPS {
                if step == STEPS - AGE_STEPS {
                    let error = noise.as_mut().map_or([0.0; 4], next_error);
                    known = Some(self.known(&target, error));
                }
                self.aircraft.advance();
                target.advance(STEP_S);
            }
            self.command(inner_loop, &known.unwrap());
            if time_s >= from_s {
                let error_m = self.aircraft.position.distance_m(target.position) - self.orbit.radius_m;
                samples.push([error_m, self.aircraft.roll_rad, self.aircraft.roll_rate_rad_s]);
            }
        }
        Flown::of(&samples)
    }

    fn known(&self, target: &Target, error: [f64; 4]) -> Known {
        let aircraft = &self.aircraft;
        let [x_m, y_m, x_m_s, y_m_s] = error;
        Known {
            position: aircraft.position,
            velocity: aircraft.velocity(),
            heading: aircraft.heading(),
            roll_rad: aircraft.roll_rad,
            true_airspeed_m_s: aircraft.true_airspeed_m_s(),
            centre: target.position + Displacement::from_m(x_m, y_m),
            centre_velocity: target.velocity + Velocity::from_m_s(x_m_s, y_m_s),
        }
    }

    fn command(&mut self, inner_loop: &mut impl InnerLoop, known: &Known) {
        let aircraft = &mut self.aircraft;
        aircraft.roll_command_rad = inner_loop.roll_rad(known);
        if let Some(speed_m_s) = self.ground_speed_m_s {
            let [east, north] = aircraft.wind_m_s;
            let air = Velocity::from_polar(speed_m_s, known.velocity.direction()) - Velocity::from_m_s(east, north);
            let calibrated_m_s = air.speed_m_s() / identified_aircraft::TRUE_PER_CALIBRATED;
            aircraft.airspeed_command_m_s = calibrated_m_s.clamp(AIRSPEEDS_M_S[0], AIRSPEEDS_M_S[1]);
        }
    }
}

/// The errors of a noisy centre after a period: position, m, and velocity, m/s.
fn next_error((error, noise): &mut ([f64; 4], Noise)) -> [f64; 4] {
    let kept = math::exp(-PERIOD_S / CENTRE_NOISE_S);
    for (axis, value) in error.iter_mut().enumerate() {
        *value = kept * *value + CENTRE_SD[axis / 2] * (1.0 - kept * kept).sqrt() * noise.next();
    }
    *error
}

impl Flown {
    /// Computes the result of samples of the orbit error, m, the roll, rad, and its rate, rad/s.
    pub(crate) fn of(samples: &[[f64; 3]]) -> Self {
        let count = samples.len() as f64;
        let mean = |value: fn(&[f64; 3]) -> f64| samples.iter().map(value).sum::<f64>() / count;
        let mean_roll_rad = mean(|[_, roll_rad, _]| *roll_rad);
        let rises = samples.windows(2).filter(|pair| pair[0][1] < mean_roll_rad && pair[1][1] >= mean_roll_rad).count();
        Self {
            error_m: [
                mean(|[error_m, ..]| *error_m),
                mean(|[error_m, ..]| error_m * error_m).sqrt(),
                samples.iter().fold(0.0, |max: f64, [error_m, ..]| max.max(error_m.abs())),
            ],
            roll_rate_deg_s: mean(|[.., rate_rad_s]| rate_rad_s.abs()).to_degrees(),
            wrong_bank: mean(|[_, roll_rad, _]| f64::from(*roll_rad > 0.0)),
            period_s: count * PERIOD_S / (rises as f64).max(1.0),
        }
    }
}
