#!/usr/bin/env python3
"""Flies the command `standoff fly` in real time behind doubles of an ArduPlane autopilot whose aircraft are those of
JSBSim, an independent model of flight, and checks orbit errors, distances, latency and processor load.

Usage: scripts/check_jsbsim.py [--seconds S] [--only NAME ...]    flies all flights at the same time

The program is $STANDOFF. Exits with 1 if a limit is exceeded.
"""

import argparse
import fcntl
import json
import math
import multiprocessing
import os
import random
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parent / "jsbsim"))
from aircraft import LOOP_S, Aircraft  # noqa: E402
from autopilot import GUIDED, Autopilot, Plane  # noqa: E402
from sumo_road import Road  # noqa: E402

ORIGIN = (47.4, 8.5)
SEA_LEVEL_M = 400
FIELD_OF_VIEW_RAD, SENSING_RANGE_M = math.radians(70), 1200
# The pilot selects GUIDED at this time, and targets are cued until the second one, s.
GUIDED_AT_S, CUED_UNTIL_S = 5, 20
# The programs are interrupted this long before the end of the flights, s.
END_S = 3
# Minimum distance of UAVs at the same altitude: the default of `separation`.
DISTANCE_MIN_M = 50
LATENCY_P99_MAX_MS = 5
# Limit on a machine whose load average exceeds the number of its cores.
BUSY_P99_MAX_MS = 20
PROCESSOR_SHARE_MAX = 0.03


class Flight(NamedTuple):
    """A flight of one or more aircraft over targets: the team's scenario, and the limits."""

    name: str
    kind: str
    count: int
    altitude_m: float
    radius_m: float
    wind_m_s: tuple
    # Position at the start and velocity, metres north and east; None: the cars of SUMO, which the program reads itself.
    targets: tuple | None
    # Standard deviations of range and bearing, m and rad.
    noise: tuple
    rms_max_m: float
    scenario: str


# The turn rate lag is that of the aircraft with their autopilot; its product with the heading gain is at most 0.35.
SMALL = """
[uavs]
count = {count}
speed_m_s = 22
speed_change_max_m_s = 6
speed_lag_s = 3
turn_rate_lag_s = 0.8
turn_rate_max_rad_s = 0.4
[filter]
acceleration_sd_m_s2 = 0.5
[guidance]
heading_gain_1_s = 0.4
[groups]
altitude_lowest_m = 150
[orbit]
radius_min_m = 150
[[targets.start]]
vx_m_s = 6
"""
# The agent predicts bank and power. The bank angle is at most ROLL_LIMIT_DEG less 5, as docs/user/fly.md recommends.
BANKING = SMALL.replace("[filter]", """dynamics = "bank"
[uavs.bank]
bank_max_deg = 50
[filter]""")
CESSNA = """
[uavs]
speed_m_s = 50
speed_change_max_m_s = 10
speed_lag_s = 5
turn_rate_lag_s = 0.8
turn_rate_max_rad_s = 0.2
[filter]
acceleration_sd_m_s2 = 0.5
[guidance]
heading_gain_1_s = 0.4
[groups]
altitude_lowest_m = 250
[orbit]
radius_min_m = 600
[[targets.start]]
vx_m_s = 10
"""
EAST_M_S = (0, 5)
NONE, NOISE = (0, 0), (3.0, math.radians(1))
SLOW, FAST, TWO = (((0, 0), (0, 6)),), (((0, 0), (0, 10)),), (((15, 0), (0, 6)), ((-15, 0), (0, 6)))
FLIGHTS = [
    Flight("small", "small-uav", 1, 150, 150, EAST_M_S, SLOW, NONE, 12, SMALL.format(count=1)),
    Flight("small, noise", "small-uav", 1, 150, 150, EAST_M_S, SLOW, NOISE, 12, SMALL.format(count=1)),
    Flight("small, banking", "small-uav", 1, 150, 150, EAST_M_S, SLOW, NONE, 12, BANKING.format(count=1)),
    Flight("c172x", "c172x", 1, 250, 600, EAST_M_S, FAST, NONE, 5, CESSNA),
    Flight("SUMO", "small-uav", 2, 150, 150, EAST_M_S, None, NONE, 12, SMALL.format(count=2)),
    Flight("pair, noise", "small-uav", 2, 150, 150, EAST_M_S, TWO, NOISE, 12, SMALL.format(count=2)),
]


def isolate():
    """Restarts this script in a network of its own, because SUMO listens on all addresses of a machine. Returns False if
    the system does not permit it."""
    unshare = ["unshare", "--net", "--map-root-user"]
    if os.environ.get("CHECK_JSBSIM_ISOLATED"):
        # The loopback interface of a new network is down: SIOCSIFFLAGS with IFF_UP and IFF_RUNNING.
        with socket.socket() as each:
            fcntl.ioctl(each, 0x8914, struct.pack("16sH14x", b"lo", 0x41))
        return True
    if not shutil.which("unshare") or subprocess.run([*unshare, "true"], stderr=subprocess.DEVNULL).returncode:
        return False
    os.environ["CHECK_JSBSIM_ISOLATED"] = "1"
    os.execvp("unshare", [*unshare, sys.executable, *sys.argv])


def free_addresses(count):
    """Addresses on the loopback interface that are free now."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    addresses = [each.getsockname() for each in sockets]
    for each in sockets:
        each.close()
    return addresses


def free_port():
    """A TCP port on the loopback interface that is free now."""
    with socket.socket() as each:
        each.bind(("127.0.0.1", 0))
        return each.getsockname()[1]


def wait_for_port(port):
    """Waits until a server listens on a TCP port, without connecting to it: SUMO counts connections as clients."""
    until = time.monotonic() + 20
    while f":{port:04X} 00000000:0000 0A" not in Path("/proc/net/tcp").read_text():
        if time.monotonic() > until:
            raise SystemExit("error: SUMO does not listen")
        time.sleep(0.05)


class Feed:
    """Sensor of one aircraft: sends scans and cues."""

    def __init__(self, address, plane, noise, seed):
        self.socket, self.address, self.plane = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), address, plane
        self.noise, self.random = noise, random.Random(seed)

    def send(self, line):
        self.socket.sendto(json.dumps(line).encode(), self.address)

    def scan(self, own, targets):
        """Sends the detections of targets, by label, with the sensor pointed at their mean."""
        bearings = {label: math.atan2(east - own[1], north - own[0]) for label, ((north, east), _) in targets.items()}
        sines, cosines = sum(map(math.sin, bearings.values())), sum(map(math.cos, bearings.values()))
        boresight = math.atan2(sines, cosines)
        detections = []
        for label, ((north, east), _) in targets.items():
            range_m = math.hypot(north - own[0], east - own[1])
            off = abs(math.remainder(bearings[label] - boresight, math.tau))
            if off <= FIELD_OF_VIEW_RAD / 2 and 1 < range_m <= SENSING_RANGE_M:
                range_m = max(range_m + self.random.gauss(0, self.noise[0]), 1)
                bearing = bearings[label] + self.random.gauss(0, self.noise[1])
                detections.append({"label": label, "range_m": range_m, "bearing_deg": math.degrees(bearing) % 360})
        self.send({"scan": {"boresight_deg": math.degrees(boresight), "detections": detections}})

    def cue(self, targets):
        for label, ((north, east), (north_m_s, east_m_s)) in targets.items():
            latitude, longitude = self.plane.degrees(north, east)
            self.send({"cue": {
                "label": label, "latitude_deg": latitude, "longitude_deg": longitude,
                "course_deg": math.degrees(math.atan2(east_m_s, north_m_s)),
                "speed_m_s": math.hypot(north_m_s, east_m_s), "position_sd_m": 20, "velocity_sd_m_s": 2}})


def targets_at(flight, time_s):
    """Position and velocity of each target by label."""
    return {label: ((at[0] + v[0] * time_s, at[1] + v[1] * time_s), v) for label, (at, v) in enumerate(flight.targets)}


def fly_aircraft(flight, number, link, feed_address, road, begun_at, seconds, pipe):
    """Flies one aircraft; sends what was seen through the pipe."""
    if road:
        road.follow(number, seconds)
    plane = Plane(*ORIGIN)
    start = plane.degrees(-300 - 200 * number, -400 + 900 * number)
    aircraft = Aircraft(flight.kind, *start, SEA_LEVEL_M, flight.altitude_m, 45 - 90 * number, flight.wind_m_s)
    autopilot = Autopilot(aircraft, plane, link, number + 1)
    feed = Feed(feed_address, plane, flight.noise, 1000 + number)
    rows = []
    while (time_s := autopilot.time_s()) < seconds:
        if autopilot.loops == round(GUIDED_AT_S / LOOP_S):
            autopilot.mode = GUIDED
        autopilot.advance()
        targets = road.targets() if road else targets_at(flight, time_s)
        own = autopilot.position()
        if autopilot.loops % 10 == 0 and not road:
            feed.scan(own, targets)
        if autopilot.loops % 50 == 1 and time_s < CUED_UNTIL_S and not road:
            feed.cue(targets)
        if autopilot.loops % 5 == 0 and targets:
            centre = [sum(at[axis] for at, _ in targets.values()) / len(targets) for axis in (0, 1)]
            error_m = math.hypot(own[0] - centre[0], own[1] - centre[1]) - flight.radius_m
            rows.append((time_s, *own, aircraft.altitude_m, aircraft.airspeed_m_s, math.degrees(aircraft.roll_rad),
                         error_m, aircraft.airspeed_target_m_s, aircraft.altitude_target_m))
        due_at = begun_at + autopilot.time_s()
        while (left_s := due_at - time.monotonic()) > 0:
            if select.select([autopilot.socket], [], [], left_s)[0]:
                autopilot.receive()
    pipe.send((rows, autopilot.latencies_s, autopilot.violations, autopilot.roll_targets))


def processor_s(process):
    """Processor time of a running process, s."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start(flight, folder, begun_at, seconds):
    """Starts programs and aircraft of a flight."""
    scenario = folder / f"{flight.name.replace(', ', '-')}.toml"
    scenario.write_text(flight.scenario)
    addresses = free_addresses(3 * flight.count)
    links, feeds, radios = (addresses[n::3] for n in range(3))
    road = None if flight.targets else Road(folder, free_port(), flight.count)
    started = []
    for number in range(flight.count):
        at = [f"127.0.0.1:{each[number][1]}" for each in (links, feeds, radios)]
        arguments = ["--link", f"udpin:{at[0]}", "--feed", at[1], "--listen", at[2],
                     "--origin", f"{ORIGIN[0]},{ORIGIN[1]}", "--uav", str(number), "--system-id", str(number + 1),
                     "--altitude", "60,390"]
        if road:
            arguments += ["--sumo", f"127.0.0.1:{road.port}"]
            wait_for_port(road.port)
        for other in range(flight.count):
            if other != number:
                arguments += ["--teammate", f"{other}=127.0.0.1:{radios[other][1]}"]
        log = folder / f"{scenario.stem}-{number}.log"
        program = subprocess.Popen([os.environ["STANDOFF"], "fly", str(scenario), *arguments],
                                   stdout=subprocess.DEVNULL, stderr=log.open("w"))
        ours, theirs = multiprocessing.Pipe()
        aircraft = multiprocessing.Process(
            target=fly_aircraft, args=(flight, number, links[number], feeds[number], road, begun_at, seconds, theirs))
        aircraft.start()
        started.append((program, aircraft, ours, log))
    return started, road


def statistics(values):
    """Mean, root mean square and largest magnitude."""
    return (sum(values) / len(values), math.sqrt(sum(v * v for v in values) / len(values)), max(map(abs, values)))


def check_distance(flight, tracks):
    """Prints the smallest distance of two aircraft, and returns what is wrong with it. `tracks` has the states of both
    at the same times, from the time at which both command."""
    distances_m = [math.hypot(a[1] - b[1], a[2] - b[2]) for a, b in zip(*tracks)]
    heights_m = [abs(a[3] - b[3]) for a, b in zip(*tracks)]
    print(f"{flight.name}: smallest horizontal distance {min(distances_m):.0f} m, vertical {min(heights_m):.0f} m")
    return [f"{flight.name}: distance below {DISTANCE_MIN_M} m"] if min(distances_m) < DISTANCE_MIN_M else []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=180)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--keep", type=Path, help="folder for logs and states")
    arguments = parser.parse_args()
    flights = [flight for flight in FLIGHTS if not arguments.only or flight.name in arguments.only]
    if not isolate():
        print("without a network of its own, SUMO would accept connections from other machines: its flight is left out")
        flights = [flight for flight in flights if flight.targets]
    multiprocessing.set_start_method("fork")
    failures = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(exist_ok=True, parents=True)
        begun_at = time.monotonic() + 4
        # Aircraft whose loops begin together would wait for each other.
        later_s = LOOP_S / len(flights)
        started = [(flight, *start(flight, folder, begun_at + index * later_s, arguments.seconds))
                   for index, flight in enumerate(flights)]
        half_s = arguments.seconds / 2
        time.sleep(max(begun_at + half_s - time.monotonic(), 0))
        programs = [program for _, each, _ in started for program, *_ in each]
        used_s = {program.pid: processor_s(program) for program in programs}
        time.sleep(half_s - END_S)
        # Waiting for a processor core is not the program's latency.
        is_busy = os.getloadavg()[0] > os.cpu_count()
        p99_max_ms = BUSY_P99_MAX_MS if is_busy else LATENCY_P99_MAX_MS
        print(f"load average {os.getloadavg()[0]:.1f}: the 99th percentile of the latency may be {p99_max_ms} ms")
        share = {program.pid: (processor_s(program) - used_s[program.pid]) / (half_s - END_S) for program in programs}
        for program in programs:
            program.send_signal(signal.SIGINT)
        for flight, each, road in started:
            tracks = []
            for number, (program, aircraft, pipe, log) in enumerate(each):
                rows, latencies_s, violations, roll_targets = pipe.recv()
                aircraft.join()
                program.wait()
                if arguments.keep:
                    (folder / f"{log.stem}.json").write_text(json.dumps(rows))
                commanded = [row for row in rows if CUED_UNTIL_S <= row[0] < arguments.seconds - END_S]
                tracks.append(commanded)
                settled = [row for row in commanded if row[0] >= half_s]
                mean_m, rms_m, max_m = statistics([row[6] for row in settled])
                low_m, high_m = (f(row[3] for row in settled) for f in (min, max))
                latencies_s.sort()
                p99_ms = 1e3 * latencies_s[int(0.99 * (len(latencies_s) - 1))] if latencies_s else math.inf
                median_ms = 1e3 * latencies_s[len(latencies_s) // 2] if latencies_s else math.inf
                # When the user ends it, the program requests a circle and stops commanding.
                lines = [line for line in log.read_text().splitlines() if "the user has ended the program" not in line]
                print(f"{flight.name}, UAV {number}: orbit {flight.radius_m} m, error mean {mean_m:+.1f}, "
                      f"rms {rms_m:.1f}, max {max_m:.1f} m; altitude {low_m:.0f} to {high_m:.0f} m; "
                      f"{roll_targets} roll targets, latency median {median_ms:.1f}, p99 {p99_ms:.1f} ms; "
                      f"{100 * share[program.pid]:.1f} % of a core")
                print(f"    {lines[-1] if lines else 'no status line'}")
                checks = [
                    (rms_m <= flight.rms_max_m, f"rms orbit error above {flight.rms_max_m} m"),
                    (median_ms <= LATENCY_P99_MAX_MS, f"median latency above {LATENCY_P99_MAX_MS} ms"),
                    (p99_ms <= p99_max_ms, f"99th percentile above {p99_max_ms} ms"),
                    (bool(lines) and lines[-1].startswith("engaged; "), "not engaged at the end"),
                    (share[program.pid] <= PROCESSOR_SHARE_MAX, "processor load"),
                    (not violations, f"violations: {violations[:3]}"),
                    (program.returncode == 0, f"exit status {program.returncode}"),
                ]
                failures += [f"{flight.name}, UAV {number}: {what}" for is_met, what in checks if not is_met]
            if road:
                road.process.terminate()
                road.process.wait()
            if len(tracks) == 2:
                failures += check_distance(flight, tracks)
    for failure in failures:
        print(f"error: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
