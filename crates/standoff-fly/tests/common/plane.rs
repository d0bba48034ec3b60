//! Double of an ArduPlane vehicle that behaves as measured in ArduPlane's simulator, in simulated time.
//!
//! - It moves as the [identified aircraft](super::identified_aircraft), which turns at 0.74 of the coordinated rate.
//! - A roll target without successor is released after 3.06 s; then the aircraft flies to its guided point.
//! - It keeps the last course command without end, and rolls by 50 degrees per rad of its error.
//! - It sends its fence by the mission protocol.
//! - It obeys commands in GUIDED only; it refuses ground speeds, and airspeeds outside its limits.
//! - With a signing key, it drops frames without valid signature. Its time stamps advance by one with each frame, and with
//!   the newest one that it receives.

use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{
    ATTITUDE_DATA, COMMAND_ACK_DATA, COMMAND_INT_DATA, EKF_STATUS_REPORT_DATA, EkfStatusFlags,
    GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA, GpsFixType, HEARTBEAT_DATA, HOME_POSITION_DATA, MISSION_COUNT_DATA,
    MISSION_ITEM_INT_DATA, MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA, MavAutopilot, MavCmd, MavMessage,
    MavModeFlag, MavParamType, MavResult, MavState, MavType, PARAM_VALUE_DATA, VFR_HUD_DATA,
};
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;
use standoff::{Angle, Position};
use standoff_fly::codec::{Codec, SigningKey, clock_stamp, encode_as};
use standoff_io::geodesy::LocalPlane;

use super::identified_aircraft::{self, Airframe, IdentifiedAircraft};

pub(crate) const GUIDED: u32 = 15;
pub(crate) const LOITER: u32 = 12;
pub(crate) const RTL: u32 = 11;

/// Time after which a roll target is released, s.
const RELEASE_S: f64 = 3.06;
/// Roll per error of the course, rad/rad: GUIDED_P of 5000 hundredths of a degree per rad.
const COURSE_GAIN: f64 = 50.0 * math::PI / 180.0;
/// Rate of climb, m/s: 100 m in 27 s.
const CLIMB_RATE_M_S: f64 = 3.7;
/// Altitude of home above sea level, m: that of the site where the aircraft was identified.
const HOME_ALTITUDE_M: f64 = 584.0;
/// Steps of the aircraft in a step of the double, and the duration of one, s.
const STEPS: u32 = 2;
pub(crate) const STEP_S: f64 = STEPS as f64 * identified_aircraft::STEP_S;

/// Velocity of the target, m/s east.
pub(crate) const TARGET_SPEED_M_S: f64 = 6.7;

/// Line of the feed with a cue for the target.
pub(crate) fn cue_line(plane: &LocalPlane, target: Position) -> String {
    let [latitude_deg, longitude_deg] = plane.degrees_at(target).unwrap();
    let place = format!(r#""latitude_deg": {latitude_deg}, "longitude_deg": {longitude_deg}"#);
    let motion = format!(r#""course_deg": 90, "speed_m_s": {TARGET_SPEED_M_S}"#);
    format!(r#"{{"cue": {{"label": 0, {place}, {motion}, "position_sd_m": 20, "velocity_sd_m_s": 2}}}}"#)
}

pub(crate) struct Plane {
    plane: LocalPlane,
    codec: Codec,
    signing: Option<SigningKey>,
    /// Time stamp of the last signed frame.
    pub(crate) stamp: u64,
    sequence: u8,
    steps: u64,
    pub(crate) mode: u32,
    pub(crate) is_armed: bool,
    pub(crate) autopilot: MavAutopilot,
    pub(crate) system_status: MavState,
    pub(crate) aircraft: IdentifiedAircraft,
    pub(crate) altitude_m: f64,
    pub(crate) commanded_altitude_m: f64,
    roll_target: Option<(f64, f64)>,
    /// Commanded course, and largest roll, rad.
    course_target: Option<(Angle, f64)>,
    pub(crate) guided_point: Position,
    pub(crate) loiter_radius_m: f64,
    /// Times and radii of accepted requests of a circle, s and m.
    pub(crate) circles: Vec<(f64, f64)>,
    /// Time of the last roll target that arrived, s.
    pub(crate) roll_target_at_s: Option<f64>,
    /// Number of commands that arrived in another mode than GUIDED, and of messages that would arm or change the mode.
    pub(crate) violations: Vec<String>,
    /// Number of accepted course commands.
    pub(crate) course_commands: usize,
    /// Number of received messages of any kind.
    pub(crate) received: usize,
    pub(crate) parameters: Vec<(&'static str, f32)>,
    /// Items of the fence: command, first parameter, and position.
    pub(crate) fence: Vec<(MavCmd, f32, Position)>,
    pub(crate) home: Position,
    pub(crate) is_mute: bool,
    pub(crate) refuses_speed: bool,
    /// Messages to the vehicle are lost.
    pub(crate) is_deaf: bool,
    /// Roll targets are ignored.
    pub(crate) ignores_rolls: bool,
    pub(crate) gps_fix: GpsFixType,
    pub(crate) ekf_flags: u16,
    /// Airspeed that is shown instead of the true one, m/s.
    pub(crate) shown_airspeed_m_s: Option<f32>,
    /// Names of requested parameters.
    pub(crate) requested: Vec<String>,
}

impl Plane {
    pub(crate) fn new(plane: LocalPlane, key: Option<&SigningKey>) -> Self {
        Self {
            plane,
            codec: Codec::new(1, key),
            signing: key.map(|key| SigningKey { link_id: 0, ..key.clone() }),
            stamp: clock_stamp(),
            sequence: 0,
            steps: 0,
            mode: GUIDED,
            is_armed: true,
            autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            system_status: MavState::MAV_STATE_ACTIVE,
            aircraft: IdentifiedAircraft::new(
                Airframe::STOCK,
                Position::from_m(-400.0, -300.0),
                Angle::from_deg(45.0),
                22.0,
            ),
            altitude_m: 150.0,
            commanded_altitude_m: 150.0,
            roll_target: None,
            course_target: None,
            guided_point: Position::default(),
            loiter_radius_m: 80.0,
            circles: Vec::new(),
            roll_target_at_s: None,
            violations: Vec::new(),
            course_commands: 0,
            received: 0,
            parameters: vec![
                ("ROLL_LIMIT_DEG", 65.0),
                ("AIRSPEED_MIN", 10.0),
                ("AIRSPEED_MAX", 30.0),
                ("WP_LOITER_RAD", 80.0),
                ("FS_GCS_ENABL", 1.0),
                ("FS_LONG_ACTN", 1.0),
                ("FS_LONG_TIMEOUT", 5.0),
                ("FENCE_ENABLE", 1.0),
                ("FENCE_ACTION", 1.0),
                ("FENCE_TYPE", 1.0),
                ("FENCE_ALT_MAX", 200.0),
                ("GUIDED_P", 5000.0),
            ],
            fence: Vec::new(),
            home: Position::default(),
            is_mute: false,
            refuses_speed: false,
            is_deaf: false,
            ignores_rolls: false,
            gps_fix: GpsFixType::GPS_FIX_TYPE_3D_FIX,
            ekf_flags: 831,
            shown_airspeed_m_s: None,
            requested: Vec::new(),
        }
    }

    /// Sets a parameter of the autopilot.
    pub(crate) fn set(&mut self, name: &'static str, value: f32) {
        self.parameters.retain(|(known, _)| *known != name);
        self.parameters.push((name, value));
    }

    /// Simulated time since the start, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.steps as f64 * STEP_S
    }

    fn send(&mut self, message: &MavMessage, to: &mut Vec<Vec<u8>>) {
        let header = MavHeader { system_id: 1, component_id: 1, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        let received = self.codec.time_stamps().values().copied().max().unwrap_or(0);
        self.stamp = self.stamp.max(received) + 1;
        to.push(encode_as(header, message, self.signing.as_ref().map(|key| (key, self.stamp))));
    }

    /// Processes a datagram and returns the answers.
    pub(crate) fn receive(&mut self, datagram: &[u8]) -> Vec<Vec<u8>> {
        if self.is_deaf {
            return Vec::new();
        }
        let mut messages = Vec::new();
        self.codec.decode_datagram(datagram, |header, message| messages.push((header, message)));
        let mut answers = Vec::new();
        for (header, message) in messages {
            assert_eq!((header.system_id, header.component_id), (1, 191));
            self.received += 1;
            self.obey(&message, &mut answers);
        }
        answers
    }

    fn obey(&mut self, message: &MavMessage, answers: &mut Vec<Vec<u8>>) {
        if is_command(message) && (self.mode != GUIDED || !self.is_armed) {
            self.violations.push(format!("{:.2} s, mode {}: {message:?}", self.time_s(), self.mode));
        }
        match message {
            MavMessage::HEARTBEAT(_) => {}
            MavMessage::SET_ATTITUDE_TARGET(target) => {
                assert_eq!(target.type_mask.bits(), 0xC6);
                if self.mode == GUIDED && !self.ignores_rolls {
                    let [w, x, _, _] = target.q.map(f64::from);
                    self.roll_target = Some((self.time_s(), 2.0 * math::atan2(x, w)));
                    self.roll_target_at_s = Some(self.time_s());
                }
            }
            MavMessage::COMMAND_INT(command) => {
                let result = self.command(command);
                let answer = COMMAND_ACK_DATA { command: command.command, result, ..COMMAND_ACK_DATA::default() };
                self.send(&MavMessage::COMMAND_ACK(answer), answers);
            }
            MavMessage::COMMAND_LONG(command) if command.command == MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => {
                let result = MavResult::MAV_RESULT_ACCEPTED;
                let answer = COMMAND_ACK_DATA { command: command.command, result, ..COMMAND_ACK_DATA::default() };
                self.send(&MavMessage::COMMAND_ACK(answer), answers);
            }
            MavMessage::PARAM_REQUEST_READ(request) => {
                let name = request.param_id.to_str().unwrap();
                self.requested.push(name.to_owned());
                if let Some((_, value)) = self.parameters.iter().find(|(known, _)| *known == name) {
                    let answer = PARAM_VALUE_DATA {
                        param_value: *value,
                        param_count: 1000,
                        param_index: u16::MAX,
                        param_id: request.param_id,
                        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
                    };
                    self.send(&MavMessage::PARAM_VALUE(answer), answers);
                }
            }
            MavMessage::MISSION_REQUEST_LIST(MISSION_REQUEST_LIST_DATA { mission_type, .. }) => {
                let count = self.fence.len() as u16;
                let answer = MISSION_COUNT_DATA { count, mission_type: *mission_type, ..MISSION_COUNT_DATA::default() };
                self.send(&MavMessage::MISSION_COUNT(answer), answers);
            }
            MavMessage::MISSION_REQUEST_INT(MISSION_REQUEST_INT_DATA { seq, mission_type, .. }) => {
                let (command, param1, at) = self.fence[usize::from(*seq)];
                let [x, y] = self.plane.degrees_at(at).unwrap().map(|deg| (deg * 1e7).round() as i32);
                let (seq, mission_type) = (*seq, *mission_type);
                let none = MISSION_ITEM_INT_DATA::default();
                let answer = MISSION_ITEM_INT_DATA { seq, command, param1, x, y, mission_type, ..none };
                self.send(&MavMessage::MISSION_ITEM_INT(answer), answers);
            }
            MavMessage::MISSION_ACK(_) => {}
            other => self.violations.push(format!("unexpected {other:?}")),
        }
    }

    fn command(&mut self, command: &COMMAND_INT_DATA) -> MavResult {
        if self.mode != GUIDED {
            return MavResult::MAV_RESULT_FAILED;
        }
        match command.command {
            MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED => {
                let speed_m_s = f64::from(command.param2);
                if command.param1 != 0.0 {
                    return MavResult::MAV_RESULT_DENIED;
                }
                if self.refuses_speed || !(10.0..=30.0).contains(&speed_m_s) {
                    return MavResult::MAV_RESULT_FAILED;
                }
                self.aircraft.airspeed_command_m_s = speed_m_s;
            }
            MavCmd::MAV_CMD_GUIDED_CHANGE_HEADING => {
                let course_deg = f64::from(command.param2);
                if command.param1 != 0.0 || !(0.0..360.0).contains(&course_deg) {
                    return MavResult::MAV_RESULT_DENIED;
                }
                let roll_max_rad = math::atan2(f64::from(command.param3), GRAVITY_M_S2);
                self.course_target = Some((Angle::from_deg(90.0 - course_deg), roll_max_rad));
                self.course_commands += 1;
            }
            MavCmd::MAV_CMD_GUIDED_CHANGE_ALTITUDE => {
                assert_eq!(command.param3, 0.0, "with a rate, the aircraft climbs too slowly");
                self.commanded_altitude_m = f64::from(command.z);
            }
            MavCmd::MAV_CMD_DO_REPOSITION => {
                assert_eq!(command.param2, 0.0, "the flag would change the mode");
                let [latitude_deg, longitude_deg] = [command.x, command.y].map(|e7| f64::from(e7) * 1e-7);
                self.guided_point = self.plane.position(latitude_deg, longitude_deg).unwrap();
                self.loiter_radius_m = f64::from(command.param3);
                self.course_target = None;
                self.circles.push((self.time_s(), self.loiter_radius_m));
            }
            _ => return MavResult::MAV_RESULT_UNSUPPORTED,
        }
        MavResult::MAV_RESULT_ACCEPTED
    }

    /// Roll, rad, that the autopilot flies without a roll target: towards the guided point, then around it.
    fn own_roll_rad(&self) -> f64 {
        if let Some((course, roll_max_rad)) = self.course_target {
            let error = self.aircraft.velocity().direction() - course;
            return (COURSE_GAIN * error.rad()).clamp(-roll_max_rad, roll_max_rad);
        }
        let to_point = self.guided_point - self.aircraft.position;
        let radial = (to_point.length_m() / self.loiter_radius_m).clamp(0.0, 2.0);
        let desired = to_point.direction() + Angle::from_rad((2.0 - radial) * 0.25 * math::PI);
        (self.aircraft.velocity().direction() - desired).rad().clamp(-0.7, 0.7)
    }

    /// Simulates a step and returns the datagrams that the autopilot sends.
    pub(crate) fn advance(&mut self) -> Vec<Vec<u8>> {
        let time_s = self.time_s();
        if self.roll_target.is_some_and(|(at_s, _)| time_s - at_s > RELEASE_S) || self.mode != GUIDED {
            self.roll_target = None;
        }
        if self.mode != GUIDED {
            self.course_target = None;
        }
        let roll_limit_rad = 65f64.to_radians();
        let target_rad = self.roll_target.map_or_else(|| self.own_roll_rad(), |(_, roll_rad)| roll_rad);
        self.aircraft.roll_command_rad = target_rad.clamp(-roll_limit_rad, roll_limit_rad);
        for _ in 0..STEPS {
            self.aircraft.advance();
        }
        let climb_max_m = CLIMB_RATE_M_S * STEP_S;
        self.altitude_m += (self.commanded_altitude_m - self.altitude_m).clamp(-climb_max_m, climb_max_m);
        self.steps += 1;
        if self.is_mute { Vec::new() } else { self.telemetry() }
    }

    fn telemetry(&mut self) -> Vec<Vec<u8>> {
        let mut sent = Vec::new();
        let time_boot_ms = 60_000 + (self.steps as f64 * STEP_S * 1e3).round() as u32;
        let is_due = |period_steps: u64| self.steps.is_multiple_of(period_steps);
        let [heartbeat, attitude, position, hud, home] = [is_due(50), is_due(3), is_due(5), is_due(5), is_due(250)];
        if is_due(25) {
            let gps = GPS_RAW_INT_DATA { fix_type: self.gps_fix, ..GPS_RAW_INT_DATA::default() };
            self.send(&MavMessage::GPS_RAW_INT(gps), &mut sent);
            let flags = EkfStatusFlags::from_bits_retain(self.ekf_flags);
            let ekf = EKF_STATUS_REPORT_DATA { flags, ..EKF_STATUS_REPORT_DATA::default() };
            self.send(&MavMessage::EKF_STATUS_REPORT(ekf), &mut sent);
        }
        if heartbeat {
            let base_mode = if self.is_armed { MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED } else { MavModeFlag::empty() };
            let heartbeat = HEARTBEAT_DATA {
                custom_mode: self.mode,
                mavtype: MavType::MAV_TYPE_FIXED_WING,
                autopilot: self.autopilot,
                base_mode: base_mode | MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
                system_status: self.system_status,
                mavlink_version: 3,
            };
            self.send(&MavMessage::HEARTBEAT(heartbeat), &mut sent);
        }
        if home {
            let [latitude, longitude] = self.plane.degrees_at(self.home).unwrap().map(|deg| (deg * 1e7).round() as i32);
            let home = HOME_POSITION_DATA { latitude, longitude, ..HOME_POSITION_DATA::default() };
            self.send(&MavMessage::HOME_POSITION(home), &mut sent);
        }
        if attitude {
            let yaw = (Angle::from_deg(90.0) - self.aircraft.heading()).rad() as f32;
            let roll = self.aircraft.roll_rad as f32;
            let attitude = ATTITUDE_DATA { time_boot_ms, roll, yaw, ..ATTITUDE_DATA::default() };
            self.send(&MavMessage::ATTITUDE(attitude), &mut sent);
        }
        let velocity = self.aircraft.velocity();
        if position {
            let [lat, lon] =
                self.plane.degrees_at(self.aircraft.position).unwrap().map(|deg| (deg * 1e7).round() as i32);
            let position = GLOBAL_POSITION_INT_DATA {
                time_boot_ms,
                lat,
                lon,
                alt: ((self.altitude_m + HOME_ALTITUDE_M) * 1e3) as i32,
                relative_alt: (self.altitude_m * 1e3) as i32,
                vx: (velocity.y_m_s() * 1e2).round() as i16,
                vy: (velocity.x_m_s() * 1e2).round() as i16,
                vz: 0,
                hdg: u16::MAX,
            };
            self.send(&MavMessage::GLOBAL_POSITION_INT(position), &mut sent);
        }
        if hud {
            let groundspeed = velocity.speed_m_s() as f32;
            let airspeed = self.shown_airspeed_m_s.unwrap_or(self.aircraft.airspeed_m_s as f32);
            let hud = VFR_HUD_DATA { airspeed, groundspeed, ..VFR_HUD_DATA::default() };
            self.send(&MavMessage::VFR_HUD(hud), &mut sent);
        }
        sent
    }
}

/// True for a message that commands the aircraft, unlike heartbeats and requests of data.
fn is_command(message: &MavMessage) -> bool {
    match message {
        MavMessage::HEARTBEAT(_)
        | MavMessage::PARAM_REQUEST_READ(_)
        | MavMessage::MISSION_REQUEST_LIST(_)
        | MavMessage::MISSION_REQUEST_INT(_)
        | MavMessage::MISSION_ACK(_) => false,
        MavMessage::COMMAND_LONG(long) => long.command != MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL,
        _ => true,
    }
}
