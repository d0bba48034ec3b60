//! State of the vehicle from its MAVLink messages.
//!
//! Only messages of the autopilot of one system id count. Numbers outside the physical range, repeated samples and
//! samples that are older than the last one change nothing.

use std::collections::VecDeque;

use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{
    ADSB_VEHICLE_DATA, ATTITUDE_DATA, AdsbAltitudeType, AdsbFlags, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavCmd,
    MavLandedState, MavMessage, MavModeFlag, MavResult, MavState, VFR_HUD_DATA,
};
use standoff::research::math;
use standoff::{Angle, Duration, Position, Time, TrafficReport, UavState, Velocity, Vertical};
use standoff_io::geodesy::LocalPlane;

use crate::boot_clock::BootClock;
use crate::command::{AUTOPILOT_COMPONENT_ID, GUIDED};
use crate::parameters::Parameters;

/// Component id of an ADS-B receiver (MAV_COMP_ID_ADSB).
const ADSB_COMPONENT_ID: u8 = 156;

/// Lowest altitude above home at which the aircraft counts as airborne, m.
const AIRBORNE_ALTITUDE_MIN_M: f64 = 20.0;

/// Share of the minimum airspeed above which the aircraft counts as airborne.
const AIRBORNE_AIRSPEED_SHARE: f64 = 0.75;

/// Ground speed below which the course is too inaccurate for a turn rate, m/s.
const COURSE_SPEED_MIN_M_S: f64 = 3.0;

/// Time over which the turn rate is measured.
const TURN_RATE_WINDOW: Duration = Duration::from_us(300_000);

/// Longest time over which a state is extrapolated.
const EXTRAPOLATION_MAX: Duration = Duration::from_us(1_000_000);

/// Longest time over which a state is extrapolated backward, to a time step that has begun before its sample.
const BACKWARD_MAX: Duration = Duration::from_us(300_000);

/// Number of traffic reports kept between two time steps; further ones are dropped.
const TRAFFIC_MAX: usize = 200;

/// Contents of a heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heartbeat {
    /// Time of arrival.
    pub at: Time,
    /// True if the motor can run.
    pub is_armed: bool,
    /// Mode, in ArduPlane's numbering.
    pub mode: u32,
    /// True if the autopilot reports a failsafe, or that it is going down.
    pub is_failsafe: bool,
}

/// Position and velocity at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSample {
    /// Time of the sample.
    pub at: Time,
    /// Latitude and longitude, 1e-7 degrees.
    pub point_e7: [i32; 2],
    /// Position in the team's plane.
    pub position: Position,
    /// Course over ground.
    pub course: Angle,
    /// Ground speed, m/s.
    pub speed_m_s: f64,
    /// Altitude above home and rate of climb.
    pub vertical: Vertical,
    /// Altitude of home above mean sea level, m.
    pub home_altitude_m: f64,
}

/// State of one vehicle.
#[derive(Debug, Clone)]
pub struct Vehicle {
    system_id: u8,
    plane: LocalPlane,
    clock: BootClock,
    /// Last heartbeat.
    pub heartbeat: Option<Heartbeat>,
    /// Last position.
    pub position: Option<PositionSample>,
    /// Last roll, rad, positive to the right, and its time.
    pub roll: Option<(Time, f64)>,
    /// Last airspeed and the ground speed of the same message, m/s.
    pub airspeed: Option<(f64, f64)>,
    landed_state: Option<MavLandedState>,
    courses: VecDeque<(Time, Angle)>,
    /// Parameters read.
    pub parameters: Parameters,
    answer: Option<(MavCmd, bool)>,
    traffic: Vec<TrafficReport>,
}

impl Vehicle {
    /// Creates a vehicle of which nothing is known. `plane` is the team's local plane.
    pub fn new(system_id: u8, plane: LocalPlane) -> Self {
        Self {
            system_id,
            plane,
            clock: BootClock::default(),
            heartbeat: None,
            position: None,
            roll: None,
            airspeed: None,
            landed_state: None,
            courses: VecDeque::new(),
            parameters: Parameters::default(),
            answer: None,
            traffic: Vec::new(),
        }
    }

    /// MAVLink system id.
    pub fn system_id(&self) -> u8 {
        self.system_id
    }

    /// Processes a message that arrived at `now`. Returns true if it is one of this vehicle's autopilot.
    pub fn receive(&mut self, now: Time, header: &MavHeader, message: &MavMessage) -> bool {
        let is_own = header.system_id == u32::from(self.system_id);
        if !is_own || ![AUTOPILOT_COMPONENT_ID, ADSB_COMPONENT_ID].contains(&header.component_id) {
            return false;
        }
        if let MavMessage::ADSB_VEHICLE(traffic) = message {
            self.hear_traffic(now, traffic);
            return true;
        }
        if header.component_id != AUTOPILOT_COMPONENT_ID {
            return false;
        }
        match message {
            MavMessage::HEARTBEAT(heartbeat) => self.hear_heartbeat(now, heartbeat),
            MavMessage::GLOBAL_POSITION_INT(position) => self.hear_position(now, position),
            MavMessage::ATTITUDE(attitude) => self.hear_attitude(now, attitude),
            MavMessage::VFR_HUD(VFR_HUD_DATA { airspeed, groundspeed, .. }) => {
                let speeds = [*airspeed, *groundspeed].map(f64::from);
                if speeds.iter().all(|speed_m_s| (0.0..=300.0).contains(speed_m_s)) {
                    self.airspeed = Some((speeds[0], speeds[1]));
                }
            }
            MavMessage::EXTENDED_SYS_STATE(state) => self.landed_state = Some(state.landed_state),
            MavMessage::PARAM_VALUE(value) => {
                self.parameters.store(value.param_id.to_str().unwrap_or_default(), value.param_value.into());
            }
            MavMessage::COMMAND_ACK(answer) if answer.result != MavResult::MAV_RESULT_IN_PROGRESS => {
                self.answer = Some((answer.command, answer.result == MavResult::MAV_RESULT_ACCEPTED));
            }
            _ => {}
        }
        true
    }

    fn hear_heartbeat(&mut self, now: Time, heartbeat: &HEARTBEAT_DATA) {
        let is_failsafe = matches!(
            heartbeat.system_status,
            MavState::MAV_STATE_CRITICAL
                | MavState::MAV_STATE_EMERGENCY
                | MavState::MAV_STATE_POWEROFF
                | MavState::MAV_STATE_FLIGHT_TERMINATION
        );
        let is_armed = heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
        self.heartbeat = Some(Heartbeat { at: now, is_armed, mode: heartbeat.custom_mode, is_failsafe });
    }

    fn hear_position(&mut self, now: Time, sample: &GLOBAL_POSITION_INT_DATA) {
        // The autopilot sends zeros until it knows its position.
        if sample.lat == 0 && sample.lon == 0 {
            return;
        }
        let [latitude_deg, longitude_deg] = [sample.lat, sample.lon].map(|e7| f64::from(e7) * 1e-7);
        let Ok(position) = self.plane.position(latitude_deg, longitude_deg) else { return };
        let Some(at) = self.clock.sample_at(sample.time_boot_ms, now, self.position.map(|last| last.at)) else {
            return;
        };
        let [north_m_s, east_m_s, down_m_s] = [sample.vx, sample.vy, sample.vz].map(|cm_s| 0.01 * f64::from(cm_s));
        let [altitude_m, sea_level_m] = [sample.relative_alt, sample.alt].map(|mm| 1e-3 * f64::from(mm));
        let velocity = Velocity::from_m_s(east_m_s, north_m_s);
        let (course, speed_m_s) = (velocity.direction(), velocity.speed_m_s());
        self.position = Some(PositionSample {
            at,
            point_e7: [sample.lat, sample.lon],
            position,
            course,
            speed_m_s,
            vertical: Vertical { altitude_m, climb_rate_m_s: -down_m_s },
            home_altitude_m: sea_level_m - altitude_m,
        });
        if speed_m_s < COURSE_SPEED_MIN_M_S {
            self.courses.clear();
        } else {
            self.courses.push_back((at, course));
        }
        // One sample older than the window remains.
        while self.courses.get(1).is_some_and(|(second_at, _)| at - *second_at >= TURN_RATE_WINDOW) {
            self.courses.pop_front();
        }
    }

    fn hear_attitude(&mut self, now: Time, attitude: &ATTITUDE_DATA) {
        let roll_rad = f64::from(attitude.roll);
        if roll_rad.abs() <= math::PI
            && let Some(at) = self.clock.sample_at(attitude.time_boot_ms, now, self.roll.map(|(at, _)| at))
        {
            self.roll = Some((at, roll_rad));
        }
    }

    fn hear_traffic(&mut self, now: Time, traffic: &ADSB_VEHICLE_DATA) {
        let needed = AdsbFlags::ADSB_FLAGS_VALID_COORDS
            | AdsbFlags::ADSB_FLAGS_VALID_HEADING
            | AdsbFlags::ADSB_FLAGS_VALID_VELOCITY;
        let [latitude_deg, longitude_deg] = [traffic.lat, traffic.lon].map(|e7| f64::from(e7) * 1e-7);
        let Ok(position) = self.plane.position(latitude_deg, longitude_deg) else { return };
        if !traffic.flags.contains(needed) || traffic.heading > 36_000 || self.traffic.len() >= TRAFFIC_MAX {
            return;
        }
        // Pressure altitudes refer to another datum than the altitude above home; without altitude, the aircraft counts
        // as being at every altitude.
        let is_geometric = traffic.altitude_type == AdsbAltitudeType::ADSB_ALTITUDE_TYPE_GEOMETRIC
            && traffic.flags.contains(AdsbFlags::ADSB_FLAGS_VALID_ALTITUDE);
        let vertical = self.position.filter(|_| is_geometric).map(|own| Vertical {
            altitude_m: 1e-3 * f64::from(traffic.altitude) - own.home_altitude_m,
            climb_rate_m_s: 0.01 * f64::from(traffic.ver_velocity),
        });
        let state = UavState {
            position,
            heading: Angle::from_deg(90.0 - 0.01 * f64::from(traffic.heading)),
            speed_m_s: 0.01 * f64::from(traffic.hor_velocity),
            turn_rate_rad_s: 0.0,
            vertical,
        };
        let time = Time::from_us(now.us().saturating_sub(i64::from(traffic.tslc) * 1_000_000));
        self.traffic.push(TrafficReport { aircraft: traffic.ICAO_address, time, state });
    }

    /// Traffic reports received since the last call.
    pub fn take_traffic(&mut self) -> Vec<TrafficReport> {
        core::mem::take(&mut self.traffic)
    }

    /// Answer to the last command of a kind, if it has arrived since [`Self::forget_answer`].
    pub fn answer(&self, command: MavCmd) -> Option<bool> {
        self.answer.filter(|(answered, _)| *answered == command).map(|(_, is_accepted)| is_accepted)
    }

    /// Forgets the last answer; call it before a command is sent whose answer counts.
    pub fn forget_answer(&mut self) {
        self.answer = None;
    }

    /// Turn rate of the course over ground, rad/s, positive to the left; `None` without samples over the window.
    pub fn turn_rate_rad_s(&self) -> Option<f64> {
        let ((first_at, first), (last_at, last)) = (*self.courses.front()?, *self.courses.back()?);
        let time = last_at - first_at;
        (time >= TURN_RATE_WINDOW && time <= EXTRAPOLATION_MAX).then(|| (last - first).rad() / time.s())
    }

    /// State at `now`, extrapolated by at most 1 s, backward by at most 0.3 s; `None` without a position. The heading is
    /// the course over ground, the speed is the ground speed.
    pub fn state(&self, now: Time) -> Option<UavState> {
        let PositionSample { at, position, course, speed_m_s, vertical, .. } = self.position?;
        let turn_rate_rad_s = self.turn_rate_rad_s().unwrap_or(0.0);
        let sampled = UavState { position, heading: course, speed_m_s, turn_rate_rad_s, vertical: Some(vertical) };
        Some(sampled.extrapolated((now - at).s().clamp(-BACKWARD_MAX.s(), EXTRAPOLATION_MAX.s())))
    }

    /// Time of the older one of the last position and the last attitude.
    pub fn telemetry_at(&self) -> Option<Time> {
        Some(self.position?.at.min(self.roll?.0))
    }

    /// True if the last heartbeat reported GUIDED.
    pub fn is_guided(&self) -> bool {
        self.heartbeat.is_some_and(|heartbeat| heartbeat.mode == GUIDED)
    }

    /// True if altitude and airspeed are those of flight, and the autopilot does not report otherwise.
    pub fn is_airborne(&self) -> bool {
        let is_on_ground = matches!(
            self.landed_state,
            Some(
                MavLandedState::MAV_LANDED_STATE_ON_GROUND
                    | MavLandedState::MAV_LANDED_STATE_TAKEOFF
                    | MavLandedState::MAV_LANDED_STATE_LANDING
            )
        );
        let is_high = self.position.is_some_and(|at| at.vertical.altitude_m >= AIRBORNE_ALTITUDE_MIN_M);
        let is_fast = self.airspeed.zip(self.parameters.limits().ok()).is_some_and(|((airspeed_m_s, _), limits)| {
            airspeed_m_s >= AIRBORNE_AIRSPEED_SHARE * limits.airspeed_min_m_s
        });
        is_high && is_fast && !is_on_ground
    }
}
