#!/usr/bin/env python3
"""Parses the events that `standoff fly --cot` sends with takproto, an independent implementation of Cursor-on-Target, and
checks their fields.

Usage: sent_cot | scripts/check_cot.py    where sent_cot is the example of standoff-fly
"""

import math
import sys
from datetime import datetime, timezone

import takproto

TIME_MS = datetime(2026, 1, 1, tzinfo=timezone.utc).timestamp() * 1000 + 250
UNKNOWN = 9999999.0


def parsed(line):
    """Converts an event to the binary encoding of TAK and back."""
    return takproto.parse_proto(takproto.xml2proto(line)).cotEvent


def check(event, uid, kind, how, callsign, error_m, course_deg, speed_m_s):
    assert (event.uid, event.type, event.how) == (uid, kind, how), event
    assert (event.sendTime, event.startTime, event.staleTime) == (TIME_MS, TIME_MS, TIME_MS + 10_000), event
    assert abs(event.lat - 47.4) < 0.01 and abs(event.lon - 8.5) < 0.01, event
    assert (event.hae, event.ce, event.le) == (UNKNOWN, error_m, UNKNOWN), event
    assert event.detail.contact.callsign == callsign, event
    track = event.detail.track
    assert math.isclose(track.course, course_deg, abs_tol=0.01) and track.speed == speed_m_s, event


def main():
    events = [parsed(line) for line in sys.stdin]
    assert len(events) == 3, len(events)
    uav, target, track = events
    check(uav, "standoff-uav-1", "a-f-A-M-F-Q", "m-g", "UAV 1", UNKNOWN, 90 - math.degrees(0.5), 23.5)
    check(target, "standoff-target-7", "a-u-G", "m-f", "target 7", 5, 90, 6.7)
    check(track, "standoff-track-0000000000000abc", "a-u-G", "m-f", "track 2", 5, 90, 6.7)
    # 200 m north of the origin, 100 m east of it.
    assert math.isclose((target.lat - 47.4) * 111_200, 200, abs_tol=1), target.lat
    assert math.isclose((uav.lon - 8.5) * 111_320 * math.cos(math.radians(47.4)), 100, abs_tol=1), uav.lon
    print(f"takproto parses {len(events)} events")


if __name__ == "__main__":
    sys.exit(main())
