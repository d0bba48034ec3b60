"""Double of an ArduPlane autopilot: MAVLink 2 over UDP, around an aircraft of JSBSim.

- It obeys commands in GUIDED only, and refuses ground speeds and airspeeds outside its limits.
- A roll target without successor is released after 3 s; then the aircraft circles about its guided point.
- Airspeeds in messages and commands are calibrated, as in ArduPlane.
"""

import math
import os
import socket
import struct
import time

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink  # noqa: E402

from aircraft import GRAVITY_M_S2, LOOP_S, clamp, wrap

LOITER, GUIDED = 12, 15
RELEASE_S = 3.0
COMPANION = 191
# Option of Linux with which the kernel adds the time of arrival to a datagram; Python does not name it.
SO_TIMESTAMPNS = 35


class Plane:
    """Metres north and east of an origin, from the radii of the WGS84 ellipsoid there; exact to 1 m within 5 km."""

    def __init__(self, latitude_deg, longitude_deg):
        self.origin = (latitude_deg, longitude_deg)
        sin, cos = math.sin(math.radians(latitude_deg)), math.cos(math.radians(latitude_deg))
        squared, root = 0.00669437999014, math.sqrt(1 - 0.00669437999014 * sin * sin)
        self.north_m_deg = math.radians(6378137.0 * (1 - squared) / root**3)
        self.east_m_deg = math.radians(6378137.0 / root * cos)

    def metres(self, latitude_deg, longitude_deg):
        return ((latitude_deg - self.origin[0]) * self.north_m_deg, (longitude_deg - self.origin[1]) * self.east_m_deg)

    def degrees(self, north_m, east_m):
        return (self.origin[0] + north_m / self.north_m_deg, self.origin[1] + east_m / self.east_m_deg)


# Attitude, velocities and positions of the EKF are good, as ArduPlane reports it in flight.
EKF_FLAGS = 831


class Autopilot:
    """An autopilot with its aircraft. `link` is the address on which the program listens."""

    def __init__(self, aircraft, plane, link, system_id):
        self.aircraft, self.plane, self.link, self.system_id = aircraft, plane, link, system_id
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.mavlink = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self.receiver = mavlink.MAVLink(None)
        self.receiver.robust_parsing = True
        self.loops = 0
        self.mode = LOITER
        self.roll_target = None
        self.guided_point = self.position()
        kind = aircraft.kind
        self.parameters = {
            "ROLL_LIMIT_DEG": 55, "AIRSPEED_MIN": kind.airspeed_min_m_s, "AIRSPEED_MAX": kind.airspeed_max_m_s,
            "WP_LOITER_RAD": kind.loiter_radius_m, "FS_GCS_ENABL": 1, "FS_LONG_ACTN": 1, "FS_LONG_TIMEOUT": 5,
            "FENCE_ENABLE": 1, "FENCE_ACTION": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 400,
        }
        # Commands that arrived in another mode than GUIDED, and messages that would arm or change the mode.
        self.violations = []
        # Times from sending the first unanswered position to the arrival of the next roll target at the socket, s.
        self.latencies_s = []
        self.position_sent_at = None
        self.roll_targets = 0

    def time_s(self):
        return self.loops * LOOP_S

    def position(self):
        """Metres north and east of the origin."""
        return self.plane.metres(self.aircraft.latitude_deg, self.aircraft.longitude_deg)

    def send(self, message):
        self.socket.sendto(message.pack(self.mavlink), self.link)
        self.mavlink.seq = (self.mavlink.seq + 1) % 256

    def advance(self):
        """Flies for the period of the loops, and sends the telemetry that is due."""
        if self.roll_target and self.time_s() - self.roll_target[0] > RELEASE_S:
            self.roll_target = None
        if self.mode == GUIDED and self.roll_target:
            roll_rad = self.roll_target[1]
        else:
            roll_rad = self.circling_roll_rad()
        limit_rad = math.radians(self.parameters["ROLL_LIMIT_DEG"])
        self.aircraft.roll_target_rad = clamp(roll_rad, -limit_rad, limit_rad)
        self.aircraft.advance()
        self.loops += 1
        self.telemetry()

    def circling_roll_rad(self):
        """Roll towards a clockwise circle about the guided point."""
        north_m, east_m = self.position()
        to_point = (self.guided_point[0] - north_m, self.guided_point[1] - east_m)
        aircraft, radius_m = self.aircraft, self.parameters["WP_LOITER_RAD"]
        share = clamp(math.hypot(*to_point) / radius_m, 0, 2)
        desired = math.atan2(to_point[1], to_point[0]) - math.pi / 4 * (2 - share)
        course = math.atan2(aircraft.east_m_s, aircraft.north_m_s)
        speed_m_s = math.hypot(aircraft.north_m_s, aircraft.east_m_s)
        ahead_rad_s = speed_m_s / radius_m if share < 2 else 0
        return clamp(math.atan(speed_m_s * (0.3 * wrap(desired - course) + ahead_rad_s) / GRAVITY_M_S2), -0.6, 0.6)

    def telemetry(self):
        aircraft, boot_ms = self.aircraft, 60_000 + round(self.time_s() * 1e3)
        if self.loops % 50 == 0:
            base_mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            self.send(mavlink.MAVLink_heartbeat_message(
                mavlink.MAV_TYPE_FIXED_WING, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, base_mode, self.mode,
                mavlink.MAV_STATE_ACTIVE, 3))
        speed_m_s = math.hypot(aircraft.north_m_s, aircraft.east_m_s)
        if self.loops % 5 == 0:
            heading_deg = round(math.degrees(aircraft.yaw_rad)) % 360
            self.send(mavlink.MAVLink_vfr_hud_message(
                aircraft.airspeed_m_s, speed_m_s, heading_deg, 50, aircraft.sea_level_m + aircraft.altitude_m,
                aircraft.climb_rate_m_s))
        if self.loops % 25 == 0:
            self.send(mavlink.MAVLink_extended_sys_state_message(0, mavlink.MAV_LANDED_STATE_IN_AIR))
            self.send(mavlink.MAVLink_gps_raw_int_message(
                boot_ms * 1000, mavlink.GPS_FIX_TYPE_3D_FIX, 0, 0, 0, 65535, 65535, 65535, 65535, 255))
            self.send(mavlink.MAVLink_ekf_status_report_message(EKF_FLAGS, 0, 0, 0, 0, 0))
        if self.loops % 5 in (0, 3):
            self.send(mavlink.MAVLink_attitude_message(
                boot_ms, aircraft.roll_rad, aircraft.pitch_rad, wrap(aircraft.yaw_rad), *aircraft.rates_rad_s))
        if self.loops % 5 == 0:
            point = (round(aircraft.latitude_deg * 1e7), round(aircraft.longitude_deg * 1e7))
            # An unanswered position keeps its time, so that late answers count as late.
            if self.position_sent_at is None:
                self.position_sent_at = time.clock_gettime(time.CLOCK_REALTIME)
            self.send(mavlink.MAVLink_global_position_int_message(
                boot_ms, *point, round((aircraft.sea_level_m + aircraft.altitude_m) * 1e3),
                round(aircraft.altitude_m * 1e3), round(aircraft.north_m_s * 100), round(aircraft.east_m_s * 100),
                round(-aircraft.climb_rate_m_s * 100), 65535))

    def receive(self):
        """Receives a datagram, obeys its messages, and answers."""
        datagram, ancillary, *_ = self.socket.recvmsg(2048, socket.CMSG_SPACE(16))
        # The time of arrival, however long this process has then been busy: seconds and nanoseconds.
        (_, _, arrival), = ancillary
        seconds, nanoseconds = struct.unpack("qq", arrival)
        arrived_at = seconds + 1e-9 * nanoseconds
        for message in self.receiver.parse_buffer(bytearray(datagram)) or []:
            kind = message.get_type()
            sender = (message.get_srcSystem(), message.get_srcComponent())
            if sender != (self.system_id, COMPANION):
                self.violations.append(f"{kind} from {sender}")
            elif kind == "SET_ATTITUDE_TARGET":
                self.set_roll(message, arrived_at)
            elif kind == "COMMAND_INT":
                self.answer(message.command, self.command(message))
            elif kind == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
                self.answer(message.command, mavlink.MAV_RESULT_ACCEPTED)
            elif kind == "PARAM_REQUEST_READ":
                value = self.parameters.get(message.param_id)
                if value is not None:
                    self.send(mavlink.MAVLink_param_value_message(
                        message.param_id.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32, 1000, 65535))
            elif kind != "HEARTBEAT":
                self.violations.append(f"unexpected {message}")

    def answer(self, command, result):
        self.send(mavlink.MAVLink_command_ack_message(command, result))

    def set_roll(self, message, arrived_at):
        if message.type_mask != 0xC6:
            self.violations.append(f"type mask {message.type_mask}")
        elif self.mode != GUIDED:
            self.violations.append(f"roll target in mode {self.mode}")
        else:
            self.roll_target = (self.time_s(), 2 * math.atan2(message.q[1], message.q[0]))
            self.roll_targets += 1
            if self.position_sent_at is not None:
                self.latencies_s.append(arrived_at - self.position_sent_at)
                self.position_sent_at = None

    def command(self, message):
        """Obeys a command, and returns the result to answer with."""
        aircraft = self.aircraft
        if self.mode != GUIDED:
            self.violations.append(f"command {message.command} in mode {self.mode}")
            return mavlink.MAV_RESULT_FAILED
        if message.command == mavlink.MAV_CMD_GUIDED_CHANGE_SPEED:
            if message.param1 != 0:
                return mavlink.MAV_RESULT_DENIED
            if not aircraft.kind.airspeed_min_m_s <= message.param2 <= aircraft.kind.airspeed_max_m_s:
                return mavlink.MAV_RESULT_FAILED
            aircraft.airspeed_target_m_s = message.param2
        elif message.command == mavlink.MAV_CMD_GUIDED_CHANGE_ALTITUDE:
            aircraft.altitude_target_m = message.z
        elif message.command == mavlink.MAV_CMD_DO_REPOSITION:
            self.guided_point = self.plane.metres(message.x * 1e-7, message.y * 1e-7)
        else:
            self.violations.append(f"command {message.command}")
            return mavlink.MAV_RESULT_UNSUPPORTED
        return mavlink.MAV_RESULT_ACCEPTED
