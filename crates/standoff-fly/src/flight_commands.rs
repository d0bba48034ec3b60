//! Commands of the agent as messages to the autopilot: roll at every step, airspeed and altitude if they change.

use mavlink::dialects::ardupilotmega::MavMessage;
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;
use standoff::{AgentOutput, Angle, Command, Demand, Duration, InnerLoop, InnerLoopInputs, Time, Velocity, Wind};

use crate::command;
use crate::config::{Config, Steer};
use crate::parameters::Limits;
use crate::period::is_due;
use crate::vehicle::Vehicle;

/// Shortest time between two commands of altitude.
const ALTITUDE_PERIOD: Duration = Duration::from_us(1_000_000);

/// Shortest time between two commands of a course, and between two of airspeed: 5 Hz, less the jitter of the steps.
const COMMAND_PERIOD: Duration = Duration::from_us(180_000);

/// Time constant with which the commanded airspeed follows the desired one, s. Steps of the airspeed shake the aircraft:
/// with 0.9 m/s every second, it rolled at 5 deg/s in ArduPlane's simulator.
const AIRSPEED_LAG_S: f64 = 1.0;

/// Smallest change of the airspeed that is commanded, m/s.
const AIRSPEED_CHANGE_MIN_M_S: f64 = 0.03;

/// Smallest change of the altitude that is commanded, m.
const ALTITUDE_CHANGE_MIN_M: f64 = 0.5;

/// Rate at which the commanded altitude changes, m/s, if the parameters of the team have no climb model.
const CLIMB_RATE_M_S: f64 = 2.0;

/// Distance that commanded altitudes keep from the fence, m.
const FENCE_MARGIN_M: f64 = 10.0;

/// What was commanded last.
#[derive(Debug, Clone)]
pub(crate) struct FlightCommands {
    altitude_m: [f64; 2],
    climb_rate_m_s: f64,
    inner_loop: InnerLoop,
    /// Share of the coordinated turn rate at which the aircraft is expected to turn.
    turn_factor: f64,
    steer: Steer,
    /// Time of the last command of a course.
    course_at: Option<Time>,
    airspeed: Option<(Time, f64)>,
    altitude: Option<(Time, f64)>,
}

impl FlightCommands {
    pub(crate) fn new(config: &Config) -> Self {
        let turn_factor = config.params.uav.bank.map_or(1.0, |bank| bank.turn_factor);
        Self {
            altitude_m: config.altitude_m,
            climb_rate_m_s: config.params.uav.climb.map_or(CLIMB_RATE_M_S, |climb| climb.rate_max_m_s),
            inner_loop: InnerLoop::start_at(0.0, turn_factor),
            turn_factor,
            steer: config.steer,
            course_at: None,
            airspeed: None,
            altitude: None,
        }
    }

    /// The first command: an airspeed. If the autopilot accepts it, it also obeys further commands.
    pub(crate) fn first(vehicle: &Vehicle, limits: &Limits, command: Command) -> MavMessage {
        command::airspeed(vehicle.system_id(), airspeed_m_s(vehicle, limits, command))
    }

    /// Begins the stream at the current roll and altitude.
    pub(crate) fn start(&mut self, now: Time, vehicle: &Vehicle) {
        self.inner_loop = InnerLoop::start_at(vehicle.roll.map_or(0.0, |(_, roll_rad)| roll_rad), self.turn_factor);
        self.course_at = None;
        self.airspeed = None;
        self.altitude = vehicle.position.map(|position| (now, position.vertical.altitude_m));
    }

    /// Messages of one step, for the durations since the last one and since the time of the decision, s.
    pub(crate) fn step(
        &mut self,
        now: Time,
        since_s: [f64; 2],
        vehicle: &Vehicle,
        limits: &Limits,
        output: &AgentOutput,
    ) -> Vec<MavMessage> {
        let system_id = vehicle.system_id();
        let roll_rad = self.roll_rad(now, since_s, vehicle, limits, output);
        let mut messages: Vec<_> =
            roll_rad.and_then(|roll_rad| self.steering(now, vehicle, limits, roll_rad)).into_iter().collect();

        messages.extend(self.airspeed(now, vehicle, limits, output.command));
        if let Some((at, altitude_m)) = self.altitude.zip(output.altitude_m).and_then(|((at, from_m), to_m)| {
            let change_m = self.climb_rate_m_s * (now - at).s();
            let to_m = self.limited_altitude_m(vehicle, to_m);
            to_m.is_finite().then(|| (at, to_m.clamp(from_m - change_m, from_m + change_m)))
        }) && now - at >= ALTITUDE_PERIOD
        {
            let is_changed = self.altitude.is_some_and(|(_, last)| (altitude_m - last).abs() >= ALTITUDE_CHANGE_MIN_M);
            if is_changed {
                self.altitude = Some((now, altitude_m));
                messages.push(command::altitude(system_id, altitude_m));
            } else {
                // Time at the altitude does not accumulate climb.
                self.altitude = self.altitude.map(|(_, last)| (now, last));
            }
        }
        messages
    }

    /// Message that makes the aircraft fly an airspeed, if one is due.
    fn airspeed(&mut self, now: Time, vehicle: &Vehicle, limits: &Limits, command: Command) -> Option<MavMessage> {
        let desired_m_s = airspeed_m_s(vehicle, limits, command);
        let airspeed_m_s = match self.airspeed {
            Some((at, _)) if now - at < COMMAND_PERIOD => return None,
            Some((at, last_m_s)) => {
                let change_m_s = (desired_m_s - last_m_s) * (1.0 - math::exp(-(now - at).s() / AIRSPEED_LAG_S));
                (change_m_s.abs() >= AIRSPEED_CHANGE_MIN_M_S).then_some(last_m_s + change_m_s)?
            }
            None => desired_m_s,
        };
        self.airspeed = Some((now, airspeed_m_s));
        Some(command::airspeed(vehicle.system_id(), airspeed_m_s))
    }

    /// Roll that the inner loop commands, rad, positive to the right; `None` without a position.
    fn roll_rad(
        &mut self,
        now: Time,
        [since_last_s, since_decision_s]: [f64; 2],
        vehicle: &Vehicle,
        limits: &Limits,
        output: &AgentOutput,
    ) -> Option<f64> {
        let own = vehicle.state(now)?;
        let demand = Demand::of(output.path.as_ref(), output.command, since_decision_s, &own);
        let wind = Wind { velocity: output.diagnostics.wind.unwrap_or(Velocity::ZERO) };
        let (roll_rad, roll_max_rad) = (vehicle.roll.map(|(_, roll_rad)| roll_rad), limits.roll_max_rad);
        let inputs = InnerLoopInputs { demand, own, wind, roll_rad, roll_max_rad };
        Some(self.inner_loop.step(&inputs, since_last_s))
    }

    /// Message that makes the aircraft fly a roll, rad, if one is due.
    fn steering(&mut self, now: Time, vehicle: &Vehicle, limits: &Limits, roll_rad: f64) -> Option<MavMessage> {
        let system_id = vehicle.system_id();
        if self.steer == Steer::Roll {
            return Some(command::roll(system_id, roll_rad));
        }
        if !is_due(self.course_at, now, COMMAND_PERIOD) {
            return None;
        }
        // The autopilot rolls in proportion to the error of the course: a lead of roll / gain gives the roll.
        let (own, gain) = (vehicle.state(now)?, vehicle.parameters.course_gain().ok()?);
        let course_rad = (Angle::from_rad(0.5 * math::PI) - own.heading).rad() + roll_rad / gain;
        self.course_at = Some(now);
        let (sin, cos) = math::sin_cos(limits.roll_max_rad);
        Some(command::course(system_id, course_rad, GRAVITY_M_S2 * sin / cos))
    }

    /// The nominal airspeed, and a request to circle at the last known position, at its altitude, in the direction of the
    /// current turn. At a higher airspeed, the aircraft may not be able to fly the circle.
    pub(crate) fn safe_orbit(&self, vehicle: &Vehicle, nominal: Command) -> Vec<MavMessage> {
        let Some(position) = vehicle.position else { return Vec::new() };
        let altitude_m = self.limited_altitude_m(vehicle, position.vertical.altitude_m);
        // If the parameters have become implausible, the autopilot uses its own airspeed and radius.
        let limits = vehicle.parameters.limits().ok();
        let radius_m = limits.as_ref().map_or(0.0, |limits| limits.loiter_radius_m);
        let is_left = vehicle.turn_rate_rad_s().is_some_and(|rad_s| rad_s > 0.0);
        let airspeed = limits.map(|limits| Self::first(vehicle, &limits, nominal));
        let circle = command::circle(vehicle.system_id(), position.point_e7, altitude_m, radius_m, is_left);
        airspeed.into_iter().chain([circle]).collect()
    }

    /// The altitude that is commanded instead of a desired one, m: within `--altitude` and the fence.
    pub(crate) fn limited_altitude_m(&self, vehicle: &Vehicle, desired_m: f64) -> f64 {
        let [min_m, max_m] = self.altitude_m;
        let floor_m = vehicle.parameters.fence_altitude_min_m().map_or(min_m, |m| min_m.max(m + FENCE_MARGIN_M));
        let ceiling_m = vehicle.parameters.fence_altitude_max_m().map_or(max_m, |m| max_m.min(m - FENCE_MARGIN_M));
        desired_m.max(floor_m).min(ceiling_m.max(floor_m))
    }
}

/// Calibrated airspeed for a commanded true airspeed, within the limits of the vehicle, m/s.
fn airspeed_m_s(vehicle: &Vehicle, limits: &Limits, command: Command) -> f64 {
    let desired_m_s = command.speed_m_s / vehicle.true_per_calibrated_airspeed().unwrap_or(1.0);
    desired_m_s.max(limits.airspeed_min_m_s).min(limits.airspeed_max_m_s)
}
