//! State of the vehicle from its MAVLink messages.
//!
//! Only messages of the autopilot of one system id count. Numbers outside the physical range, repeated samples and
//! samples that are older than the last one change nothing.

use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{
    ADSB_VEHICLE_DATA, ATTITUDE_DATA, AdsbAltitudeType, AdsbFlags, COMMAND_ACK_DATA, EkfStatusFlags,
    GLOBAL_POSITION_INT_DATA, GpsFixType, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavLandedState, MavMessage,
    MavModeFlag, MavResult, MavState, VFR_HUD_DATA,
};
use standoff::atmosphere::density_ratio;
use standoff::math;
use standoff::{AirVelocity, Angle, Duration, Position, Time, TrafficReport, UavState, Velocity, Vertical};
use standoff_io::geodesy::LocalPlane;

use crate::authority::TELEMETRY_STALE;
use crate::boot_clock::BootClock;
use crate::codec::COMPANION_COMPONENT_ID;
use crate::command::{AUTOPILOT_COMPONENT_ID, GUIDED};
use crate::directions::Directions;
use crate::fence::Fence;
use crate::parameters::Parameters;

/// Component id of an ADS-B receiver (MAV_COMP_ID_ADSB).
const ADSB_COMPONENT_ID: u8 = 156;

/// Lowest altitude above home at which the aircraft counts as airborne, m.
const AIRBORNE_ALTITUDE_MIN_M: f64 = 20.0;

/// Share of the minimum airspeed above which the aircraft counts as airborne.
const AIRBORNE_AIRSPEED_SHARE: f64 = 0.75;

/// Ground speed below which the course is too inaccurate for a turn rate, m/s.
const COURSE_SPEED_MIN_M_S: f64 = 3.0;

/// Maximum age of the airspeed and of the heading from which the wind is estimated.
const AIR_AGE_MAX: Duration = Duration::from_us(1_000_000);

/// Altitudes above sea level for which the density of the air is computed, m: the troposphere.
const AIR_ALTITUDES_M: [f64; 2] = [-500.0, 11_000.0];

/// Longest time over which a state is extrapolated backward, to a time step that has begun before its sample.
const BACKWARD_MAX: Duration = Duration::from_us(300_000);

/// Number of traffic reports kept between two time steps; further ones are dropped.
const TRAFFIC_MAX: usize = 200;

/// Flags of the EKF without which its position is not used.
const EKF_GOOD: EkfStatusFlags =
    EkfStatusFlags::EKF_ATTITUDE.union(EkfStatusFlags::EKF_VELOCITY_HORIZ).union(EkfStatusFlags::EKF_POS_HORIZ_ABS);

/// Flags of the EKF with which its position is not used.
const EKF_BAD: EkfStatusFlags = EkfStatusFlags::EKF_CONST_POS_MODE
    .union(EkfStatusFlags::EKF_UNINITIALIZED)
    .union(EkfStatusFlags::EKF_GPS_GLITCHING);

/// Commands whose answers count.
const ANSWERED: [MavCmd; 4] = [
    MavCmd::MAV_CMD_DO_REPOSITION,
    MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED,
    MavCmd::MAV_CMD_GUIDED_CHANGE_ALTITUDE,
    MavCmd::MAV_CMD_GUIDED_CHANGE_HEADING,
];

/// Contents of a heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heartbeat {
    /// Time of arrival.
    pub at: Time,
    /// True if the motor can run.
    pub is_armed: bool,
    /// Mode, in ArduPlane's numbering.
    pub mode: u32,
    /// True if the autopilot reports a failsafe, a warning of the battery, or that it is going down.
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
    /// Time from the sample to its arrival.
    pub delay: Duration,
}

/// State of one vehicle.
#[derive(Debug, Clone)]
pub struct Vehicle {
    system_id: u8,
    plane: LocalPlane,
    clock: BootClock,
    /// Last heartbeat.
    pub heartbeat: Option<Heartbeat>,
    /// True if the last heartbeat was not one of ArduPilot, so that it does not count.
    is_other_autopilot: bool,
    /// Last position.
    pub position: Option<PositionSample>,
    /// Last roll, rad, positive to the right, and its time.
    pub roll: Option<(Time, f64)>,
    /// Time of arrival of the last airspeed, and its value, m/s. It is calibrated, as in the commands: that of the same
    /// pressure at sea level.
    pub airspeed: Option<(Time, f64)>,
    landed_state: Option<MavLandedState>,
    /// Time of arrival and value of the last GPS fix.
    gps: Option<(Time, GpsFixType)>,
    /// Time of arrival and value of the last flags of the EKF.
    ekf: Option<(Time, EkfStatusFlags)>,
    courses: Directions,
    headings: Directions,
    /// Parameters read.
    pub parameters: Parameters,
    /// Fence read.
    pub fence: Fence,
    /// Last answer to each kind of command: true if it was accepted.
    answers: [Option<bool>; ANSWERED.len()],
    /// True if an answer has arrived since the last call of [`Self::take_answered`].
    is_answered: bool,
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
            is_other_autopilot: false,
            position: None,
            roll: None,
            airspeed: None,
            landed_state: None,
            gps: None,
            ekf: None,
            courses: Directions::default(),
            headings: Directions::default(),
            parameters: Parameters::default(),
            fence: Fence::default(),
            answers: [None; ANSWERED.len()],
            is_answered: false,
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
            MavMessage::VFR_HUD(VFR_HUD_DATA { airspeed, .. }) => {
                let airspeed_m_s = f64::from(*airspeed);
                if (0.0..=300.0).contains(&airspeed_m_s) {
                    self.airspeed = Some((now, airspeed_m_s));
                }
            }
            MavMessage::EXTENDED_SYS_STATE(state) => self.landed_state = Some(state.landed_state),
            MavMessage::PARAM_VALUE(value) => {
                self.parameters.store(value.param_id.to_str().unwrap_or_default(), value.param_value.into());
            }
            MavMessage::HOME_POSITION(home) => {
                let [latitude_deg, longitude_deg] = [home.latitude, home.longitude].map(|e7| f64::from(e7) * 1e-7);
                if let Ok(home) = self.plane.position(latitude_deg, longitude_deg) {
                    self.fence.hear_home(home);
                }
            }
            MavMessage::MISSION_COUNT(count) => self.fence.hear_count(count),
            MavMessage::MISSION_ITEM_INT(item) => self.fence.hear_item(item),
            MavMessage::GPS_RAW_INT(gps) => self.gps = Some((now, gps.fix_type)),
            MavMessage::EKF_STATUS_REPORT(report) => self.ekf = Some((now, report.flags)),
            MavMessage::COMMAND_ACK(answer) => self.hear_answer(answer),
            _ => {}
        }
        true
    }

    fn hear_heartbeat(&mut self, now: Time, heartbeat: &HEARTBEAT_DATA) {
        // Modes and parameters of other autopilots have other meanings.
        self.is_other_autopilot = heartbeat.autopilot != MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA;
        if self.is_other_autopilot {
            return;
        }
        let is_failsafe = matches!(
            heartbeat.system_status,
            MavState::MAV_STATE_CRITICAL
                | MavState::MAV_STATE_EMERGENCY
                | MavState::MAV_STATE_POWEROFF
                | MavState::MAV_STATE_FLIGHT_TERMINATION
        );
        let is_armed = heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
        self.heartbeat = Some(Heartbeat { at: now, is_armed, mode: heartbeat.custom_mode, is_failsafe });
        // A clock that has stopped for a while, or a delay that has grown, does not keep the pilot from GUIDED.
        if heartbeat.custom_mode != GUIDED {
            self.clock.forget_offset();
        }
    }

    fn hear_answer(&mut self, answer: &COMMAND_ACK_DATA) {
        // Autopilots that do not address their answers send zeros.
        let to = [answer.target_system, answer.target_component];
        let is_own = to == [0, 0] || to == [self.system_id, COMPANION_COMPONENT_ID];
        let index = ANSWERED.iter().position(|command| *command == answer.command);
        if let Some(index) = index.filter(|_| is_own && answer.result != MavResult::MAV_RESULT_IN_PROGRESS) {
            self.answers[index] = Some(answer.result == MavResult::MAV_RESULT_ACCEPTED);
            self.is_answered = true;
        }
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
            delay: now - at,
        });
        if speed_m_s < COURSE_SPEED_MIN_M_S {
            self.courses.clear();
        } else {
            self.courses.push(at, course);
        }
    }

    fn hear_attitude(&mut self, now: Time, attitude: &ATTITUDE_DATA) {
        let roll_rad = f64::from(attitude.roll);
        if roll_rad.abs() <= math::PI
            && let Some(at) = self.clock.sample_at(attitude.time_boot_ms, now, self.roll.map(|(at, _)| at))
        {
            self.roll = Some((at, roll_rad));
            let yaw_rad = f64::from(attitude.yaw);
            if yaw_rad.abs() <= 2.0 * math::PI {
                self.headings.push(at, Angle::from_deg(90.0) - Angle::from_rad(yaw_rad));
            }
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

    /// Answer to the last command of a kind, if it has arrived since [`Self::forget_answers`]: true if it was accepted.
    pub fn answer(&self, command: MavCmd) -> Option<bool> {
        self.answers[ANSWERED.iter().position(|answered| *answered == command)?]
    }

    /// Forgets all answers; call it before a command is sent whose answer counts.
    pub fn forget_answers(&mut self) {
        self.answers = [None; ANSWERED.len()];
    }

    /// True if a command was answered since the last call.
    pub fn take_answered(&mut self) -> bool {
        core::mem::take(&mut self.is_answered)
    }

    /// What is wrong with the position of the autopilot, or not known; `None` if GPS fix and EKF are good.
    pub fn navigation_error(&self) -> Option<String> {
        let Some((_, fix)) = self.gps else { return Some("GPS_RAW_INT: not received from the autopilot".to_owned()) };
        let Some((_, flags)) = self.ekf else {
            return Some("EKF_STATUS_REPORT: not received from the autopilot".to_owned());
        };
        if (fix as u32) < GpsFixType::GPS_FIX_TYPE_3D_FIX as u32 {
            return Some(format!("GPS_RAW_INT: fix type {} instead of 3 or more", fix as u32));
        }
        let is_good = flags.contains(EKF_GOOD) && !flags.intersects(EKF_BAD);
        (!is_good).then(|| format!("EKF_STATUS_REPORT: flags {} without a good position", flags.bits()))
    }

    /// Time of the older one of the last reports about GPS fix and EKF; `None` if one is missing or bad.
    pub fn navigation_at(&self) -> Option<Time> {
        let ((gps_at, _), (ekf_at, _)) = self.gps.zip(self.ekf).filter(|_| self.navigation_error().is_none())?;
        Some(gps_at.min(ekf_at))
    }

    /// Age that the last position had when it arrived; `None` without a position.
    pub fn telemetry_delay(&self) -> Option<Duration> {
        self.position.map(|position| position.delay)
    }

    /// True if the last heartbeat was not one of ArduPilot.
    pub fn is_other_autopilot(&self) -> bool {
        self.is_other_autopilot
    }

    /// True if time stamps of two autopilots with this system id have arrived in turns.
    pub fn is_doubled(&self) -> bool {
        self.clock.is_doubled()
    }

    /// Turn rate of the course over ground, rad/s, positive to the left; `None` without samples over the window.
    pub fn turn_rate_rad_s(&self) -> Option<f64> {
        self.courses.rate_rad_s()
    }

    /// Turn rate of the heading, rad/s, positive to the left; `None` without samples over the window.
    pub fn heading_rate_rad_s(&self) -> Option<f64> {
        self.headings.rate_rad_s()
    }

    /// Velocity relative to the air at `now`, with the heading extrapolated; `None` if airspeed, heading or altitude are
    /// unknown or older than 1 s.
    pub fn air_velocity(&self, now: Time) -> Option<AirVelocity> {
        let is_fresh = |at: Time| (-BACKWARD_MAX.us()..=AIR_AGE_MAX.us()).contains(&(now - at).us());
        let (_, airspeed_m_s) = self.airspeed.filter(|(at, _)| is_fresh(*at))?;
        let (at, heading) = self.headings.last().filter(|(at, _)| is_fresh(*at))?;
        let turned_rad = self.heading_rate_rad_s().unwrap_or(0.0) * (now - at).s();
        let airspeed_m_s = airspeed_m_s * self.true_per_calibrated_airspeed()?;
        Some(AirVelocity { heading: heading + Angle::from_rad(turned_rad), airspeed_m_s })
    }

    /// True airspeed per calibrated airspeed, from the density of the standard atmosphere at the altitude; `None`
    /// without a position.
    pub fn true_per_calibrated_airspeed(&self) -> Option<f64> {
        let position = self.position?;
        let [lowest_m, highest_m] = AIR_ALTITUDES_M;
        let altitude_m = (position.home_altitude_m + position.vertical.altitude_m).clamp(lowest_m, highest_m);
        Some(1.0 / density_ratio(altitude_m).sqrt())
    }

    /// State at `now`, extrapolated by at most 3 s, backward by at most 0.3 s; `None` without a position. The heading is
    /// the course over ground, the speed is the ground speed.
    pub fn state(&self, now: Time) -> Option<UavState> {
        let PositionSample { at, position, course, speed_m_s, vertical, .. } = self.position?;
        let turn_rate_rad_s = self.turn_rate_rad_s().unwrap_or(0.0);
        let sampled = UavState { position, heading: course, speed_m_s, turn_rate_rad_s, vertical: Some(vertical) };
        Some(sampled.extrapolated((now - at).s().clamp(-BACKWARD_MAX.s(), TELEMETRY_STALE.s())))
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
        let is_fast = self.airspeed.zip(self.parameters.limits().ok()).is_some_and(|((_, airspeed_m_s), limits)| {
            airspeed_m_s >= AIRBORNE_AIRSPEED_SHARE * limits.airspeed_min_m_s
        });
        is_high && is_fast && !is_on_ground
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Time = Time::from_us(1_000_000_000);

    /// Vehicle at an altitude above sea level, which flies east at an airspeed of 20 m/s and turns left at 0.2 rad/s.
    fn vehicle(sea_level_m: i32) -> Vehicle {
        let mut vehicle = Vehicle::new(1, LocalPlane::about(47.4, 8.5).unwrap());
        let header = MavHeader { system_id: 1, component_id: 1, sequence: 0 };
        let mut receive = |at_ms: i64, message: MavMessage| {
            assert!(vehicle.receive(NOW + Duration::from_us(1000 * (at_ms - 400)), &header, &message));
        };
        for at_ms in (0..=400).step_by(50) {
            let (time_boot_ms, yaw) = (1000 + at_ms as u32, 1.6 - 0.2e-3 * (at_ms - 400) as f32);
            receive(at_ms, MavMessage::ATTITUDE(ATTITUDE_DATA { time_boot_ms, yaw, ..ATTITUDE_DATA::default() }));
        }
        let position = GLOBAL_POSITION_INT_DATA {
            time_boot_ms: 1400,
            lat: 474_000_000,
            lon: 85_000_000,
            alt: sea_level_m * 1000,
            relative_alt: 150_000,
            ..GLOBAL_POSITION_INT_DATA::default()
        };
        receive(400, MavMessage::GLOBAL_POSITION_INT(position));
        receive(400, MavMessage::VFR_HUD(VFR_HUD_DATA { airspeed: 20.0, ..VFR_HUD_DATA::default() }));
        vehicle
    }

    /// ArduPlane addresses its answers; other autopilots send zeros. Answers to a ground station on the same link, and
    /// to other commands, change nothing.
    #[test]
    fn each_answer_belongs_to_its_command_and_its_sender() {
        let (circle, speed) = (MavCmd::MAV_CMD_DO_REPOSITION, MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED);
        let mut vehicle = vehicle(500);
        let mut answer = |command, to: [u8; 2], result| {
            let [target_system, target_component] = to;
            let none = COMMAND_ACK_DATA::default();
            let answer = COMMAND_ACK_DATA { command, result, target_system, target_component, ..none };
            let header = MavHeader { system_id: 1, component_id: 1, sequence: 0 };
            assert!(vehicle.receive(NOW, &header, &MavMessage::COMMAND_ACK(answer)));
            (vehicle.answer(circle), vehicle.answer(speed), vehicle.take_answered())
        };
        let (accepted, denied) = (MavResult::MAV_RESULT_ACCEPTED, MavResult::MAV_RESULT_DENIED);
        assert_eq!(answer(circle, [255, 190], denied), (None, None, false));
        assert_eq!(answer(circle, [1, 191], accepted), (Some(true), None, true));
        assert_eq!(answer(speed, [0, 0], denied), (Some(true), Some(false), true));
        let interval = MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL;
        assert_eq!(answer(interval, [1, 191], denied), (Some(true), Some(false), false));
        assert_eq!(answer(speed, [1, 191], MavResult::MAV_RESULT_IN_PROGRESS), (Some(true), Some(false), false));
        vehicle.forget_answers();
        assert_eq!((vehicle.answer(circle), vehicle.answer(speed)), (None, None));
    }

    /// Densities of the standard atmosphere per that at sea level: 1, 0.9075 and 0.6012 (ISO 2533).
    #[test]
    fn the_true_airspeed_follows_from_the_density_at_the_altitude() {
        for (sea_level_m, density) in [(0, 1.0f64), (1000, 0.9075), (5000, 0.6012)] {
            let air = vehicle(sea_level_m).air_velocity(NOW).unwrap();
            let expected_m_s = 20.0 / density.sqrt();
            assert!((air.airspeed_m_s - expected_m_s).abs() < 0.01, "{sea_level_m} m: {} m/s", air.airspeed_m_s);
        }
    }

    #[test]
    fn the_heading_is_extrapolated_and_an_old_airspeed_is_not_used() {
        let vehicle = vehicle(500);
        assert!((vehicle.heading_rate_rad_s().unwrap() - 0.2).abs() < 1e-3);
        for after_s in [-0.2, 0.0, 0.5, 1.0] {
            let air = vehicle.air_velocity(NOW + Duration::from_s(after_s)).unwrap();
            let expected = Angle::from_rad(0.5 * math::PI - 1.6 + 0.2 * after_s);
            assert!((air.heading - expected).rad().abs() < 2e-3, "{after_s} s: {:?}", air.heading);
        }
        assert_eq!(vehicle.air_velocity(NOW + Duration::from_s(1.1)), None);
    }
}
