//! Messages to the autopilot. Each is one of a few kinds; none arms the aircraft or changes its mode.

use mavlink::dialects::ardupilotmega::{
    AttitudeTargetTypemask, COMMAND_INT_DATA, COMMAND_LONG_DATA, HEARTBEAT_DATA, MISSION_ACK_DATA,
    MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA, MavAutopilot, MavCmd, MavFrame, MavMessage, MavMissionResult,
    MavMissionType, MavModeFlag, MavState, MavType, PARAM_REQUEST_READ_DATA, SET_ATTITUDE_TARGET_DATA,
};
use standoff::math;

/// Component id of the autopilot (MAV_COMP_ID_AUTOPILOT1).
pub const AUTOPILOT_COMPONENT_ID: u8 = 1;

/// Custom mode GUIDED of ArduPlane.
pub const GUIDED: u32 = 15;

/// Type mask of a roll target: ignore pitch rate, yaw rate, throttle and attitude. With the attitude ignored and the
/// roll rate not ignored, ArduPlane takes the roll from the quaternion and keeps altitude and speed.
const ROLL_ONLY: u8 = 0xC6;

/// Messages requested from the autopilot: id and period, us.
pub const INTERVALS: [(u32, u32); 9] = [
    (30, 50_000),     // ATTITUDE
    (33, 100_000),    // GLOBAL_POSITION_INT
    (74, 100_000),    // VFR_HUD
    (24, 500_000),    // GPS_RAW_INT
    (193, 500_000),   // EKF_STATUS_REPORT
    (245, 500_000),   // EXTENDED_SYS_STATE
    (168, 500_000),   // WIND
    (242, 5_000_000), // HOME_POSITION
    (246, 500_000),   // ADSB_VEHICLE
];

/// Heartbeat of the companion computer.
pub fn heartbeat() -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: MavModeFlag::empty(),
        system_status: MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
    })
}

/// Target of the roll, rad, positive to the right; everything else stays with the autopilot, which drops the target 3 s
/// after the last one.
pub fn roll(system_id: u8, roll_rad: f64) -> MavMessage {
    let (sin, cos) = math::sin_cos(0.5 * roll_rad);
    MavMessage::SET_ATTITUDE_TARGET(SET_ATTITUDE_TARGET_DATA {
        q: [cos as f32, sin as f32, 0.0, 0.0],
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        type_mask: AttitudeTargetTypemask::from_bits_retain(ROLL_ONLY),
        ..SET_ATTITUDE_TARGET_DATA::default()
    })
}

/// Roll of a target made by [`roll`], rad.
pub fn roll_of(target: &SET_ATTITUDE_TARGET_DATA) -> f64 {
    let [cos, sin, _, _] = target.q.map(f64::from);
    2.0 * math::atan2(sin, cos)
}

/// Command of a course over ground, rad clockwise from north, which the autopilot keeps until the next command.
/// `acceleration_max_m_s2` limits the roll.
pub fn course(system_id: u8, course_rad: f64, acceleration_max_m_s2: f64) -> MavMessage {
    // ArduPlane denies courses outside [0, 360); rounding may give 360.
    let course_deg = course_rad.to_degrees().rem_euclid(360.0) as f32;
    let course_deg = if course_deg < 360.0 { course_deg } else { 0.0 };
    let params = [0.0, course_deg, acceleration_max_m_s2 as f32, 0.0];
    int(system_id, MavCmd::MAV_CMD_GUIDED_CHANGE_HEADING, params, [0, 0], 0.0)
}

/// Command of an airspeed, m/s. The autopilot accepts it only in GUIDED.
pub fn airspeed(system_id: u8, airspeed_m_s: f64) -> MavMessage {
    // Type of speed 0: airspeed. ArduPlane denies ground speed. No acceleration limit.
    int(system_id, MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED, [0.0, airspeed_m_s as f32, 0.0, 0.0], [0, 0], 0.0)
}

/// Command of an altitude above home, m. The autopilot accepts it only in GUIDED.
pub fn altitude(system_id: u8, altitude_m: f64) -> MavMessage {
    // Without a rate: with one of 5 m/s, ArduPlane climbs at 0.4 m/s (measured).
    int(system_id, MavCmd::MAV_CMD_GUIDED_CHANGE_ALTITUDE, [0.0; 4], [0, 0], altitude_m)
}

/// Request to circle about a point: latitude and longitude, 1e-7 degrees, altitude above home and radius, m. Without the
/// flag in parameter 2 that changes the mode, ArduPlane accepts it only in GUIDED.
pub fn circle(system_id: u8, point_e7: [i32; 2], altitude_m: f64, radius_m: f64, is_left: bool) -> MavMessage {
    let direction = if is_left { 1.0 } else { 0.0 };
    int(system_id, MavCmd::MAV_CMD_DO_REPOSITION, [-1.0, 0.0, radius_m as f32, direction], point_e7, altitude_m)
}

#[expect(deprecated, reason = "ArduPlane was measured with this frame, and its newer name needs a newer version")]
fn int(system_id: u8, command: MavCmd, params: [f32; 4], [x, y]: [i32; 2], z: f64) -> MavMessage {
    let [param1, param2, param3, param4] = params;
    MavMessage::COMMAND_INT(COMMAND_INT_DATA {
        param1,
        param2,
        param3,
        param4,
        x,
        y,
        z: z as f32,
        command,
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        current: 0,
        autocontinue: 0,
    })
}

/// Request to send a message periodically.
pub fn message_interval(system_id: u8, message_id: u32, period_us: u32) -> MavMessage {
    MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        param1: message_id as f32,
        param2: period_us as f32,
        command: MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL,
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        ..COMMAND_LONG_DATA::default()
    })
}

/// Request to send a parameter, by name.
pub fn read_parameter(system_id: u8, name: &str) -> MavMessage {
    let mut param_id = [0; 16];
    let length = name.len().min(16);
    param_id[..length].copy_from_slice(&name.as_bytes()[..length]);
    MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
        param_index: -1,
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        param_id: param_id.into(),
    })
}

/// Request of the number of items of the fence.
pub fn request_fence(system_id: u8) -> MavMessage {
    MavMessage::MISSION_REQUEST_LIST(MISSION_REQUEST_LIST_DATA {
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
    })
}

/// Request of an item of the fence, by index.
pub fn request_fence_item(system_id: u8, index: u16) -> MavMessage {
    MavMessage::MISSION_REQUEST_INT(MISSION_REQUEST_INT_DATA {
        seq: index,
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
    })
}

/// Answer after the last item of the fence.
pub fn fence_received(system_id: u8) -> MavMessage {
    MavMessage::MISSION_ACK(MISSION_ACK_DATA {
        target_system: system_id,
        target_component: AUTOPILOT_COMPONENT_ID,
        mavtype: MavMissionResult::MAV_MISSION_ACCEPTED,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
        ..MISSION_ACK_DATA::default()
    })
}
