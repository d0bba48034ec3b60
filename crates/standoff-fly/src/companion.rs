//! The program on the companion computer without its devices: time, received bytes and messages are arguments.

use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use standoff::{
    Agent, AgentOutput, Angle, BankParams, Command, Cue, Duration, Geofence, Message, Observation, ParamError, Scan,
    TeamParams, Time, UavId, UavState, Wind, wire,
};
use standoff_record::Frame;

use crate::authority::{Authority, Condition, Inputs, Permission, STALE, State, StopReason, TELEMETRY_STALE};
use crate::command;
use crate::config::{Config, Steer};
use crate::feed::{FeedCue, FeedError, FeedLine, FeedScan};
use crate::flight_commands::FlightCommands;
use crate::flight_rows::{FlightRows, Observed};
use crate::parameters::Parameters;
use crate::requests::Requests;
use crate::scan_alignment::aligned;
use crate::team_clock::TeamClock;
use crate::uplink::Uplink;
use crate::vehicle::Vehicle;

/// Usual period of the commands to the autopilot, which is that of its positions.
pub const STEP: Duration = Duration::from_us(100_000);

/// Maximum delay of the program after which a time step of the agent is skipped.
const LATE: Duration = Duration::from_us(250_000);

/// Share of the turn rate of a coordinated turn at which ArduPlane airframes with stock parameters turn, measured in its
/// simulator.
const STOCK_TURN_FACTOR: f64 = 0.72;

/// Longest time for which the last turn is held. It begins when telemetry is older than [`STALE`].
const TELEMETRY_HELD_MAX: Duration = Duration::from_us(TELEMETRY_STALE.us() - STALE.us());

/// Maximum number of cues kept until the next time step.
const CUES_MAX: usize = 1000;

/// Messages to send after a step.
#[derive(Debug, Default)]
pub struct Outgoing {
    /// To the autopilot.
    pub mavlink: Vec<MavMessage>,
    /// To all teammates, one datagram each.
    pub teammates: Vec<Vec<u8>>,
    /// Rows for the record, if the agent has decided. Their time is that of the team.
    pub frame: Option<Frame>,
}

/// Agent, vehicle and authority of one aircraft.
pub struct Companion {
    config: Config,
    agent: Agent,
    /// The vehicle as its messages describe it.
    pub vehicle: Vehicle,
    authority: Authority,
    commands: FlightCommands,
    uplink: Uplink,
    /// Since when the last turn is held, because telemetry is missing.
    held_since: Option<Time>,
    pub(crate) requests: Requests,
    clock: TeamClock,
    scan: Option<(Time, FeedScan)>,
    /// Last boresight of the sensor.
    boresight: Option<Angle>,
    cues: Vec<(Time, FeedCue)>,
    feed_at: Option<Time>,
    target_at: Option<Time>,
    step_at: Option<Time>,
    /// Time of the last roll that was compared with the roll targets.
    roll_at: Option<Time>,
    /// Newest observation, and whether the agent has decided since.
    observation: Option<(Observation, bool)>,
    /// What was observed, for the record.
    seen: Option<Observed>,
    rows: FlightRows,
    /// Last decision.
    pub output: AgentOutput,
    /// Time of the observation of the last decision.
    decided_for: Time,
    /// Number of received datagrams of teammates that are not valid messages.
    pub damaged: u32,
    inputs: Inputs,
    /// Fence of the vehicle, or what is missing or wrong.
    fence: Result<Geofence, String>,
    /// Parameters and number of changes from which the fence was made.
    fence_of: Option<(Parameters, u64)>,
    is_leaving: bool,
}

impl Companion {
    /// Creates the program of one UAV. Returns all parameters that are out of range.
    pub fn new(mut config: Config) -> Result<Self, Vec<ParamError>> {
        // The air outside is not calm, and the aircraft banks: the wind is always estimated.
        config.params.wind.get_or_insert_default();
        config.params.uav.bank.get_or_insert(BankParams { turn_factor: STOCK_TURN_FACTOR, ..BankParams::default() });
        let agent = Agent::new(config.uav, config.params)?.with_restart_count(config.restart_count);
        let agent = agent.with_geofence(config.geofence.clone())?.with_areas_of_interest(config.areas.clone())?;
        let straight = straight(&config.params);
        let mut companion = Self {
            agent,
            vehicle: Vehicle::new(config.system_id, config.plane),
            authority: Authority::new(config.engages_after_restart),
            commands: FlightCommands::new(&config),
            uplink: Uplink::default(),
            held_since: None,
            requests: Requests::default(),
            clock: TeamClock::default(),
            scan: None,
            boresight: None,
            cues: Vec::new(),
            feed_at: None,
            target_at: None,
            step_at: None,
            roll_at: None,
            observation: None,
            seen: None,
            rows: FlightRows::default(),
            output: AgentOutput::command_only(straight),
            decided_for: Time::default(),
            damaged: 0,
            inputs: Inputs::NOTHING,
            fence: Err("not received from the autopilot".to_owned()),
            fence_of: None,
            is_leaving: false,
            config,
        };
        companion.inputs = companion.inputs(Time::default());
        Ok(companion)
    }

    /// The agent.
    pub fn agent(&self) -> &Agent {
        &self.agent
    }

    /// State of the authority.
    pub fn authority(&self) -> State {
        self.authority.state()
    }

    /// What the authority decided on in the last step.
    pub fn last_inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// Fence of the vehicle as zones, or what is missing or wrong.
    pub fn fence(&self) -> Result<&Geofence, &str> {
        self.fence.as_ref().map_err(String::as_str)
    }

    /// Angle between the last boresight and the direction to the centre of the group, rad; `None` if one is unknown.
    pub fn off_boresight_rad(&self) -> Option<f64> {
        let group = self.agent.team_state().group_of(self.agent.id())?;
        let to_centre = group.centre().state.position() - self.vehicle.position?.position;
        Some((self.boresight? - to_centre.direction()).abs_rad())
    }

    /// Processes a MAVLink message that arrived at `now`. Returns true if it is one of the vehicle's autopilot.
    pub fn receive(&mut self, now: Time, header: &MavHeader, message: &MavMessage) -> bool {
        self.vehicle.receive(now, header, message)
    }

    /// Processes a line of the feed that arrived at `now`.
    pub fn hear_feed(&mut self, now: Time, line: &str) -> Result<(), FeedError> {
        self.hear_feed_line(now, FeedLine::parse(line)?);
        Ok(())
    }

    /// Processes a parsed line of the feed that arrived at `now`.
    pub(crate) fn hear_feed_line(&mut self, now: Time, line: FeedLine) {
        match line {
            FeedLine::Scan(scan) => {
                self.boresight = scan.boresight;
                self.scan = Some((Time::from_us(now.us().saturating_sub(scan.age.us())), scan));
            }
            FeedLine::Cue(cue) if self.cues.len() < CUES_MAX => {
                self.cues.push((Time::from_us(now.us().saturating_sub(cue.age.us())), cue));
            }
            FeedLine::Cue(_) => {}
        }
        self.feed_at = Some(now);
    }

    /// Processes a datagram of a teammate.
    pub fn hear_teammate(&mut self, bytes: &[u8]) {
        match wire::decode(bytes) {
            Ok(message) => {
                if let Some((observation, _)) = &self.observation {
                    self.agent.receive(observation, &message);
                }
            }
            Err(_) => self.damaged = self.damaged.saturating_add(1),
        }
    }

    /// Takes over the time of the computer's clock at `now`, from which the team's time follows. Without a call, the team's
    /// time is that of this program.
    pub fn hear_clock(&mut self, now: Time, clock: Time) {
        self.clock.hear(now, clock, self.authority.state() == State::Waiting);
    }

    /// Time by which the computer's clock was set since commands began, positive if forward; `None` if it was not set.
    pub fn clock_step(&self) -> Option<Duration> {
        self.clock.is_set().then(|| self.clock.error())
    }

    /// What has shown that commands do not arrive or are not followed, if the commands have stopped for this reason.
    pub fn uplink_failure(&self) -> Option<&'static str> {
        let reason = StopReason::Failed(Condition::Uplink);
        let is_reason = matches!(self.authority.state(), State::Stopped { reason: stated, .. } if stated == reason);
        self.uplink.failure().filter(|_| is_reason)
    }

    /// Ends the commands with a request to circle, and announces to the teammates that this UAV leaves the team.
    pub fn leave(&mut self) {
        self.agent.leave();
        self.is_leaving = true;
    }

    /// True while the request to circle has no answer and is still repeated.
    pub fn awaits_answer(&self) -> bool {
        matches!(self.authority.state(), State::Stopped { repeats: 1.., .. }) && self.inputs.is_accepted.is_none()
    }

    /// True while commands are sent, or the request to circle that ends them is still repeated.
    pub fn is_commanding(&self) -> bool {
        matches!(self.authority.state(), State::Confirming { .. } | State::Engaged) || self.awaits_answer()
    }

    /// One step of the program; call it about every [`STEP`].
    pub fn step(&mut self, now: Time) -> Outgoing {
        let mut outgoing = Outgoing::default();
        self.update_fence();
        self.run_agent(now, &mut outgoing);
        let since_last = self.step_at.map_or(STEP, |step_at| now - step_at);
        self.watch(now, since_last);
        self.inputs = self.inputs(now);
        // The first step counts as on time.
        self.inputs.step_at = Some(self.step_at.unwrap_or(now));
        let was_engaged = self.authority.state() == State::Engaged;
        let permission = self.authority.step(now, &self.inputs);
        self.requests.append(now, &mut self.vehicle, &mut outgoing.mavlink);
        let limits = self.vehicle.parameters.limits().ok();
        match (permission, limits) {
            (Permission::Confirm, Some(limits)) => {
                self.vehicle.forget_answers();
                outgoing.mavlink.push(FlightCommands::first(&self.vehicle, &limits, self.output.command));
            }
            (Permission::Command, Some(limits)) => {
                if !was_engaged {
                    self.commands.start(now, &self.vehicle);
                    self.uplink = Uplink::default();
                }
                let mut commands = if self.held_since.is_some() {
                    self.held_turn()
                } else {
                    let steps = [since_last, now - self.decided_for].map(|time| time.s());
                    self.commands.step(now, steps, &self.vehicle, &limits, &self.output)
                };
                self.uplink.send(now, &mut commands);
                outgoing.mavlink.extend(commands);
            }
            (Permission::SafeOrbit, _) => {
                self.vehicle.forget_answers();
                let nominal = straight(&self.config.params);
                outgoing.mavlink.extend(self.commands.safe_orbit(&self.vehicle, nominal));
            }
            _ => {}
        }
        self.step_at = Some(now);
        outgoing
    }

    /// Takes in what has arrived since the last step about the uplink, and whether telemetry is missing.
    fn watch(&mut self, now: Time, since_last: Duration) {
        let is_engaged = self.authority.state() == State::Engaged;
        let is_answered = self.vehicle.take_answered();
        let roll = self.vehicle.roll.filter(|(at, _)| self.roll_at.replace(*at) != Some(*at));
        if is_engaged {
            self.uplink.hear(since_last, is_answered, roll.map(|(_, roll_rad)| roll_rad));
        }
        let is_late = self.vehicle.telemetry_at().is_none_or(|at| now - at > STALE);
        self.held_since = (is_engaged && is_late).then(|| self.held_since.unwrap_or(now));
    }

    /// The last roll target again. A course needs no repetition, because the autopilot keeps it.
    fn held_turn(&self) -> Vec<MavMessage> {
        let roll_rad = self.uplink.last_roll_rad();
        roll_rad.map(|roll_rad| command::roll(self.vehicle.system_id(), roll_rad)).into_iter().collect()
    }

    /// Passes the zones of the vehicle's fence to the agent if they have changed.
    fn update_fence(&mut self) {
        let Vehicle { parameters, fence, .. } = &self.vehicle;
        if self.fence_of.as_ref().is_some_and(|(known, changes)| known == parameters && *changes == fence.changes()) {
            return;
        }
        self.fence_of = Some((parameters.clone(), fence.changes()));
        let zones = fence.zones(parameters, &self.config.plane);
        self.fence = zones.and_then(|own| {
            let of_vehicle = Geofence::new(own.clone()).map_err(|error| format!("fence of the vehicle: {error}"))?;
            let all = self.config.geofence.zones().cloned().chain(own).collect();
            let all = Geofence::new(all).map_err(|error| format!("zones with the fence of the vehicle: {error}"))?;
            let first = |errors: Vec<ParamError>| errors.first().map(ToString::to_string).unwrap_or_default();
            self.agent.set_own_geofence(all).map_err(|errors| format!("fence of the vehicle: {}", first(errors)))?;
            Ok(of_vehicle)
        });
    }

    /// Decides for the last observation, and observes if a time step of the team's grid has begun.
    fn run_agent(&mut self, now: Time, outgoing: &mut Outgoing) {
        if let Some((observation, false)) = self.observation {
            self.decide(now, &observation, outgoing);
        }
        let period = Duration::from_s(self.config.params.log.period_s);
        let team_us = self.clock.team(now).us();
        let begun_at = self.clock.own(Time::from_us(team_us.div_euclid(period.us()) * period.us()));
        let is_new = self.step_at.is_none_or(|step_at| step_at < begun_at);
        let Some(own) = self.vehicle.state(begun_at).filter(|_| is_new && now - begun_at < LATE) else { return };
        let observation = self.observe(now, begun_at, &own, outgoing);
        self.observation = Some((observation, false));
        // Without teammates, there is nothing to wait for.
        if self.config.teammates.is_empty() {
            self.decide(now, &observation, outgoing);
        }
    }

    fn observe(&mut self, now: Time, begun_at: Time, own: &UavState, outgoing: &mut Outgoing) -> Observation {
        let scan = self.scan.take().map(|(at, scan)| {
            // Where the UAV was when the sensor looked.
            let earlier = self.vehicle.state(at).map_or(own.position, |then| then.position);
            let velocity_of =
                |label| self.agent.team_state().track_by_label(label).map(|of| of.track.estimate().state.velocity());
            let age_s = (begun_at - at).s();
            (scan.boresight, aligned(&scan.detections, earlier, own.position, age_s, velocity_of))
        });
        let (boresight, detections) = scan.unwrap_or_default();
        // On the ground, the UAV only listens: a teammate that reports counts as one that flies.
        let scan = Scan { boresight, detections: &detections };
        let is_airborne = self.vehicle.is_airborne();
        let observation = self.agent.observe(self.clock.team(begun_at), own, is_airborne.then_some(scan));
        if let Some(air) = self.vehicle.air_velocity(begun_at).filter(|_| is_airborne) {
            self.agent.observe_air(&observation, &air);
        }
        for mut traffic in self.vehicle.take_traffic() {
            traffic.time = self.clock.team(traffic.time);
            self.agent.receive(&observation, &Message::Traffic(traffic));
        }
        outgoing.teammates.extend(self.agent.outbox(&observation).iter().flat_map(wire::encode));
        for (sequence, (at, cue)) in (0..).zip(core::mem::take(&mut self.cues)) {
            let [latitude_deg, longitude_deg] = cue.point_deg;
            let Ok(position) = self.config.plane.position(latitude_deg, longitude_deg) else { continue };
            let cue = Message::Cue(Cue {
                source: self.config.uav.0,
                issued_at: observation.time(),
                sequence,
                label: cue.label,
                time: self.clock.team(at.min(now)),
                position,
                velocity: cue.velocity,
                position_sd_m: cue.position_sd_m,
                velocity_sd_m_s: cue.velocity_sd_m_s,
                priority: cue.priority,
            });
            self.agent.receive(&observation, &cue);
            outgoing.teammates.extend(wire::encode(&cue));
        }
        self.seen = Some(Observed { at: observation.time(), own: *own, boresight, detections });
        observation
    }

    fn decide(&mut self, now: Time, observation: &Observation, outgoing: &mut Outgoing) {
        self.output = self.agent.decide(observation);
        self.decided_for = self.clock.own(observation.time());
        self.observation = Some((*observation, true));
        outgoing.frame =
            self.seen.take().map(|seen| self.rows.frame(&seen, &self.agent, &self.output, self.authority.state()));
        if self.output.diagnostics.group.is_some() {
            self.target_at = Some(now);
        }
        // The clock was set, or the program was paused for long.
        if self.agent.is_time_jump() {
            self.agent.reset();
        }
    }

    /// Ids of UAVs, of this one and its teammates, that would fly at less than the minimum difference of altitude because
    /// of `--altitude` and the fence, and their altitudes, m.
    pub fn shared_altitudes(&self) -> Option<[(UavId, f64); 2]> {
        let params = &self.config.params;
        let ids = self.config.teammates.iter().chain([&self.config.uav]);
        let mut altitudes: Vec<(UavId, f64, f64)> = ids
            .map(|uav| (*uav, params.initial_altitude_m(*uav)))
            .map(|(uav, altitude_m)| (uav, altitude_m, self.commands.limited_altitude_m(&self.vehicle, altitude_m)))
            .collect();
        altitudes.sort_by(|(a_uav, a_m, _), (b_uav, b_m, _)| a_m.total_cmp(b_m).then(a_uav.cmp(b_uav)));
        let is_shared = |a: &(UavId, f64, f64), b: &(UavId, f64, f64)| {
            let vertical_min_m = params.separation.map_or(f64::INFINITY, |separation| separation.vertical_min_m);
            b.2 - a.2 < vertical_min_m.min(b.1 - a.1)
        };
        let shared = altitudes.windows(2).find(|pair| is_shared(&pair[0], &pair[1]))?;
        Some([(shared[0].0, shared[0].2), (shared[1].0, shared[1].2)])
    }

    /// The first parameter of the autopilot that is missing or implausible.
    pub fn parameter_error(&self) -> Option<String> {
        let parameters = &self.vehicle.parameters;
        let of_course = (self.config.steer == Steer::Course).then(|| parameters.course_gain().err());
        parameters.limits().err().or(of_course.flatten())
    }

    /// The assumed wind, if the geofence allows for it because it is stronger than the one that the orbits have room for.
    pub fn wind_error(&self) -> Option<String> {
        let params = &self.config.params;
        let (velocity, orbit_wind_m_s) = (self.output.diagnostics.wind?, params.wind?.orbit_wind_m_s);
        (params.geofence_wind_m_s(Some(Wind { velocity })) > orbit_wind_m_s).then(|| {
            let wind_m_s = velocity.speed_m_s();
            format!(
                "wind of {wind_m_s:.0} m/s: orbits have room for wind.orbit_wind_m_s = {orbit_wind_m_s}; set it in all \
                 scenarios"
            )
        })
    }

    /// True if the aircraft is inside the fence of the vehicle, or commanded already: then the autopilot judges.
    fn is_inside(&self, fence: &Geofence) -> bool {
        let is_engaged = self.authority.state() == State::Engaged;
        is_engaged || self.vehicle.position.is_some_and(|position| fence.contains(position.position))
    }

    fn inputs(&self, now: Time) -> Inputs {
        let is_engaged = self.authority.state() == State::Engaged;
        let may_hold = self.held_since.is_none_or(|at| now - at < TELEMETRY_HELD_MAX);
        let heartbeat = self.vehicle.heartbeat;
        let reports = self.config.teammates.iter().map(|teammate| self.agent.last_report_at(*teammate));
        let answered = match self.authority.state() {
            State::Confirming { .. } => Some(MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED),
            State::Stopped { .. } => Some(MavCmd::MAV_CMD_DO_REPOSITION),
            State::Waiting | State::Engaged => None,
        };
        Inputs {
            heartbeat_at: heartbeat.map(|heartbeat| heartbeat.at),
            telemetry_at: self.vehicle.telemetry_at(),
            telemetry_age_max: if is_engaged && may_hold { TELEMETRY_STALE } else { STALE },
            navigation_at: self.vehicle.navigation_at(),
            feed_at: self.feed_at,
            target_at: self.target_at,
            teammates_at: reports.min().flatten().map(|at| self.clock.own(at)),
            teammate_timeout: Duration::from_s(self.config.params.teammate_timeout_s),
            has_teammates: !self.config.teammates.is_empty(),
            step_at: self.step_at,
            is_armed: heartbeat.is_some_and(|heartbeat| heartbeat.is_armed),
            is_guided: self.vehicle.is_guided(),
            is_failsafe: heartbeat.is_some_and(|heartbeat| heartbeat.is_failsafe),
            is_airborne: self.vehicle.is_airborne(),
            has_parameters: self.parameter_error().is_none(),
            has_fence: self.fence.as_ref().is_ok_and(|fence| self.is_inside(fence)),
            has_uplink: !is_engaged || self.uplink.failure().is_none(),
            has_clock: !self.clock.is_set(),
            is_leaving: self.is_leaving,
            is_accepted: answered.and_then(|command| self.vehicle.answer(command)),
        }
    }
}

/// Straight flight at the nominal speed.
fn straight(params: &TeamParams) -> Command {
    Command { speed_m_s: params.uav.speed_m_s, turn_rate_rad_s: 0.0 }
}
