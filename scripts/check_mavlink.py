#!/usr/bin/env python3
"""Decodes the frames that `standoff fly` sends with pymavlink, an independent implementation, and checks their fields and
signatures.

Usage: sent_frames | scripts/check_mavlink.py    where sent_frames is the example of standoff-fly
"""

import math
import os
import sys

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink  # noqa: E402

KEY = bytes([0x2A] * 32)


def decoded(frames, key):
    """Returns the messages of frames; with a key, only those with a valid signature."""
    link = mavlink.MAVLink(None)
    if key:
        link.signing.secret_key = key
        link.signing.allow_unsigned_callback = None
        link.signing.timestamp = 0
    return [link.parse_char(bytearray(frame)) for frame in frames]


def check(messages):
    heartbeat, roll, airspeed, altitude, circle, interval, parameter, course, fence, item, received = messages
    for sequence, message in enumerate(messages):
        sender = (message.get_srcSystem(), message.get_srcComponent(), message.get_seq())
        assert sender == (1, 191, sequence), (message, sender)
    assert (heartbeat.type, heartbeat.autopilot) == (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID)
    assert (roll.get_type(), roll.type_mask, roll.target_system) == ("SET_ATTITUDE_TARGET", 0xC6, 1)
    assert all(abs(a - b) < 1e-6 for a, b in zip(roll.q, [math.cos(0.25), math.sin(0.25), 0, 0])), roll.q
    assert (airspeed.command, airspeed.param1, airspeed.param2, airspeed.param3) == (43000, 0, 23.5, 0)
    assert (altitude.command, altitude.frame, altitude.z, altitude.param3) == (43001, 6, 150, 0)
    assert (circle.command, circle.x, circle.y, circle.z) == (192, 474000000, 85000000, 120)
    assert (circle.param2, circle.param3, circle.param4) == (0, 80, 1)
    assert (interval.get_type(), interval.command) == ("COMMAND_LONG", 511)
    assert (interval.param1, interval.param2) == (33, 100000)
    assert (course.command, course.param1, course.param3) == (43002, 0, 15)
    assert abs(course.param2 - (360 - math.degrees(1))) < 1e-4, course
    assert [message.get_type() for message in (fence, item, received)] == \
        ["MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_ACK"]
    assert all(message.mission_type == mavlink.MAV_MISSION_TYPE_FENCE for message in (fence, item, received))
    assert (item.seq, received.type) == (4, mavlink.MAV_MISSION_ACCEPTED)
    assert (parameter.param_id, parameter.param_index) == ("ROLL_LIMIT_DEG", -1)


def main():
    frames = [bytes.fromhex(line) for line in sys.stdin]
    assert len(frames) == 22, len(frames)
    unsigned, signed = frames[:11], frames[11:]
    check(decoded(unsigned, None))
    check(decoded(signed, KEY))
    assert all(message.get_signed() for message in decoded(signed, KEY))
    # The check can fail: another key, a changed byte.
    try:
        wrong = decoded(signed[:1], bytes(32))
        assert wrong[0].get_type() == "BAD_DATA", wrong
    except mavlink.MAVError:
        pass
    print(f"pymavlink decodes {len(frames)} frames of 11 kinds, 11 of them signed")


if __name__ == "__main__":
    sys.exit(main())
