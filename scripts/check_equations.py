#!/usr/bin/env python3
"""Recompute a record from the paper's equations, in plain NumPy, and compare number by number.

Usage: check_equations.py <record folder>

This is an independent implementation of H. Oh, S. Kim, H.-S. Shin, A. Tsourdos, "Coordinated Standoff Tracking of Moving
Target Groups Using Multiple UAVs", 2015. A number in parentheses is an equation of that paper, interpreted as in
docs/developer/ledger.md; notation as in docs/developer/notation.md, metrics as in docs/user/metrics.md. It reads only the record.

Prints one line per quantity: the largest difference over all time steps, the tolerance, and the number of compared
values. A difference is relative to the recorded value, or absolute if that is below 1 (tracks: relative to the standard
deviation if that is larger; covariances: relative to the product of the two standard deviations). Exits with 1 and a
message if a tolerance is exceeded. Needs requirements.txt.

Not checked: group membership, assignment of UAVs and track deletion (all taken as recorded), association (see
check_association.py), the first estimate of each track (it comes from a cue, which the record does not contain), the
random draws of the scenario, and UAVs without a group (including those that search for a lost target).
"""

import json
import sys
import tomllib
from collections import defaultdict
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag, expm

AXES = ["x", "vx", "ax", "y", "vy", "ay"]
POSITION, VELOCITY = [0, 3], [1, 4]
DIRECTION = {"anticlockwise": 1.0, "clockwise": -1.0}
ROUNDING = 1e-10  # the same algebra in another order
DIFFERENCES = 1e-7  # for numeric derivatives, which are least accurate if a centre becomes too fast to follow
LONG_FILTER_TOLERANCE = 1e-7  # for filters that run for a whole record: rounding accumulates if measurements are rare
INTEGRATED_TOLERANCE = 1e-4  # for filters with measurements that are integrated over five standard deviations
FLOWN_TOLERANCE = 2e-3  # for distances along flown paths, in metres
NODES = np.polynomial.legendre.leggauss(120)
# Metrics that check_association.py checks.
ASSOCIATION = {
    "gospa_m", "gospa_localisation_m", "gospa_missed", "gospa_false", "track_swaps", "false_tracks", "track_purity",
    "detected_fraction",
}
STATISTICS = 5.0  # allowed deviation of a variance over a whole run, in standard deviations


def main(arguments, usage, checks):
    """Runs the checks on a record; returns the exit status."""
    if len(arguments) != 1:
        print(usage.strip(), file=sys.stderr)
        return 2
    try:
        record, compare = Record(Path(arguments[0])), Comparison()
        for check in checks:
            check(record, compare)
    except Exception as error:  # a row or a column is missing or cannot be read
        print(f"{arguments[0]}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return compare.report(record.folder)


class Record:
    """A record's tables as {time: {id: row}}; missing tables and values are None."""

    def __init__(self, folder):
        self.folder = folder
        self.scenario = tomllib.loads((folder / "scenario.toml").read_text(encoding="utf-8"))
        self.metrics = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["metrics"]
        self.period = self.scenario["period_s"]
        self.walls = walls_of(self.scenario)
        self.uavs = self.by_time("uavs", "uav")
        self.truth = self.by_time("truth", "target") if (folder / "truth.parquet").exists() else None
        self.tracks = self.by_time("tracks", "target")
        self.groups = self.by_time("groups", "group")
        self.detections = self.by_time("detections", "uav", "target")
        self.views = self.by_time("in_view", "uav", "target") if (folder / "in_view.parquet").exists() else None
        self.events = defaultdict(list)
        for event in self.rows("events"):
            self.events[event.time_us].append(event)
        self.times = sorted(self.uavs)
        self.filter_acceleration_sd_m_s2 = self.scenario["filter"]["acceleration_sd_m_s2"]
        # Targets are numbered from 1 in scenarios, from 0 in records.
        manoeuvres = self.scenario.get("targets", {}).get("manoeuvre", [])
        self.manoeuvring = {int(manoeuvre["target"]) for manoeuvre in manoeuvres}

    def rows(self, table):
        for values in pandas.read_parquet(self.folder / f"{table}.parquet").to_dict("records"):
            yield SimpleNamespace(**{name: None if pandas.isna(value) else value for name, value in values.items()})

    def by_time(self, table, *key):
        steps = defaultdict(dict)
        for row in self.rows(table):
            if table in ["uavs", "truth", "tracks", "groups"]:
                row.position = np.array([row.x_m, row.y_m])
            if table in ["truth", "tracks", "groups"]:
                row.velocity = np.array([row.vx_m_s, row.vy_m_s])
            if table in ["truth", "tracks"]:
                row.state = np.array([row.x_m, row.vx_m_s, row.ax_m_s2, row.y_m, row.vy_m_s, row.ay_m_s2], float)
            if table == "tracks":
                row.p = np.zeros((6, 6))
                for i, a in enumerate(AXES):
                    for j, b in list(enumerate(AXES))[i:]:
                        row.p[i, j] = row.p[j, i] = getattr(row, f"cov_{a}_{b}")
                row.p_position = row.p[np.ix_(POSITION, POSITION)]
            ids = tuple(getattr(row, name) for name in key)
            steps[row.time_us][ids if key[1:] else ids[0]] = row
        return steps

    def members(self, time, group):
        """Returns the tracks of a group's members by target, including those in dwell from and to the group."""
        return {target: row for target, row in self.tracks[time].items() if group in (row.group, row.receiving_group)}

    def assigned_members(self, time, group):
        """Returns the members that a group must keep in view; a target in dwell is one of the old group."""
        return [target for target, row in self.tracks[time].items() if row.group == group]


class Comparison:
    """Collects the largest difference of each quantity."""

    def __init__(self):
        self.lines = {}

    def __call__(self, what, recorded, computed, scale=None, tolerance=ROUNDING):
        """Compares numbers; None is equal only to None."""
        if recorded is None or computed is None:
            off = np.array(0.0 if recorded is computed else np.inf)
        else:
            recorded = np.asarray(recorded, float)
            off = np.abs(computed - recorded) / (np.maximum(np.abs(recorded), 1.0) if scale is None else scale)
        largest, _, count = self.lines.get(what, (0.0, tolerance, 0))
        self.lines[what] = (np.maximum(largest, np.max(off, initial=0.0)), tolerance, count + off.size)

    def angle(self, what, recorded, computed, tolerance=ROUNDING):
        """Compares angles modulo 2 pi."""
        known = recorded is not None and computed is not None
        self(what, recorded, recorded + wrap(computed - recorded) if known else computed, tolerance=tolerance)

    def report(self, folder):
        wrong = [what for what, (largest, tolerance, _) in self.lines.items() if not largest <= tolerance]
        for what, (largest, tolerance, count) in self.lines.items():
            verdict = "  WRONG" if what in wrong else ""
            print(f"{what:50} {largest:8.1e}  (tolerance {tolerance:.1e}, {count} numbers){verdict}")
        if wrong:
            print(f"{folder}: differs from the equations: {'; '.join(wrong)}", file=sys.stderr)
        return 1 if wrong else 0


def wrap(angle):
    """Wraps an angle to (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def direction(vector):
    return np.arctan2(vector[1], vector[0])


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def equation_1(states, commands, uavs):
    """Returns rates of position, heading, speed and turn rate, with first-order lags; one column per UAV and time step."""
    _, _, heading, speed, turn_rate = states
    return np.array([speed * np.cos(heading), speed * np.sin(heading), turn_rate,
                     (commands[0] - speed) / uavs["speed_lag_s"], (commands[1] - turn_rate) / uavs["turn_rate_lag_s"]])


def check_kinematics(record, compare):
    uavs, period, times = record.scenario["uavs"], record.period, record.times
    compare("time steps are one period apart", np.diff(times) / 1e6, period)
    pairs = [(record.uavs[a][uav], row) for a, b in zip(times, times[1:]) for uav, row in record.uavs[b].items()]
    names = ["x_m", "y_m", "heading_rad", "speed_m_s", "turn_rate_rad_s"]
    before, after = (np.array([[getattr(pair[i], name) for pair in pairs] for name in names]) for i in [0, 1])
    commands = np.array([[a.speed_command_m_s, a.turn_rate_command_rad_s] for a, _ in pairs]).T
    if uavs["integrator"] == "euler":
        which, computed = "(4) Euler step", before + period * equation_1(before, commands, uavs)
    else:
        solution = solve_ivp(lambda _, flat: equation_1(flat.reshape(5, -1), commands, uavs).ravel(), (0.0, period),
                             before.ravel(), method="DOP853", rtol=1e-13, atol=1e-12)
        which, computed = "(1) kinematics", solution.y[:, -1].reshape(5, -1)
    compare(f"{which}: position", after[:2], computed[:2])
    compare.angle(f"{which}: heading", after[2], computed[2])
    compare(f"{which}: speed and turn rate", after[3:], computed[3:])
    check_climbs(record, [pair for pair in pairs if pair[0].altitude_m is not None], compare)
    over = np.abs(commands.T - [uavs["speed_m_s"], 0.0]) - [uavs["speed_change_max_m_s"], uavs["turn_rate_max_rad_s"]]
    compare("(2, 3) commands within their limits", 0.0, np.maximum(over, 0.0).max())


def climb_of(scenario):
    """Returns the climb parameters of the scenario, or the defaults of docs/user/separation.md; None if UAVs do not climb."""
    default = {"rate_max_m_s": 3.0, "lag_s": 1.0, "altitude_min_m": 50.0, "altitude_max_m": 3000.0}
    climbs = scenario.get("separation") or scenario.get("world", {}).get("building_outlines_cm")
    return scenario["uavs"].get("climb", default if climbs else None)


def check_climbs(record, pairs, compare):
    """Checks altitudes: the climb rate has a first-order lag, like the turn rate in (1). The commanded climb rate approaches
    the commanded altitude over four lags and two periods, so that it does not overshoot."""
    climb, period = climb_of(record.scenario), record.period
    flown = sum(row.altitude_m is not None for rows in record.uavs.values() for row in rows.values())
    compare("altitudes flown", flown, sum(map(len, record.uavs.values())) if climb else 0)
    if not pairs:
        return
    level = lambda row: (row.altitude_m, row.climb_rate_m_s)
    before, after = (np.array([level(pair[i]) for pair in pairs]).T for i in [0, 1])
    way = np.array([0.0 if row.commanded_altitude_m is None else
                    np.clip(row.commanded_altitude_m, climb["altitude_min_m"], climb["altitude_max_m"]) - row.altitude_m
                    for row, _ in pairs])
    fastest, lag = climb["rate_max_m_s"], climb["lag_s"]
    commanded = np.clip(way / (4 * lag + 2 * period), -fastest, fastest)
    rates = np.array([[0.0, 1.0, 0.0], [0.0, -1.0 / lag, 1.0 / lag], [0.0, 0.0, 0.0]])
    computed = expm(rates * period) @ np.array([*before, commanded])
    compare("climbing: altitude flown", after[0], computed[0])
    compare("climbing: rate of climb", after[1], computed[1])
    ends = np.maximum(np.abs(way), np.abs(before[1]) * lag)
    past = np.sign(way) * (after[0] - before[0]) - ends
    compare("climbing: overshoot of an altitude", 0.0, np.maximum(past, 0.0).max(), tolerance=1e-6)
    compare("climbing: faster than the limit", 0.0, np.maximum(np.abs(after[1]) - fastest, 0.0).max())
    groups = record.scenario["groups"]
    for row in record.uavs[record.times[0]].values():
        # At the altitude in the scenario; otherwise at the UAV's altitude by number, or at the lowest.
        steps = row.uav if groups["altitude_policy"] == "per-uav" or "radio" in record.scenario and groups["altitude_policy"] != "common" else 0
        first = np.clip(groups["altitude_lowest_m"] + steps * groups["altitude_step_m"],
                        climb["altitude_min_m"], climb["altitude_max_m"])
        start = record.scenario["uavs"]["start"][row.uav].get("altitude_m", first)
        compare("climbing: at the first time step", [row.climb_rate_m_s, row.altitude_m], [0.0, start])


def equations_5_6(model, period):
    """Returns F and Q of both axes, by van Loan's matrix exponential."""
    alpha, sd = model["correlation_rate_1_s"], model["acceleration_sd_m_s2"]
    a = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -alpha]])
    noise = np.diag([0.0, 0.0, 2.0 * alpha * sd**2])
    power = expm(np.block([[-a, noise], [np.zeros((3, 3)), a.T]]) * period)
    f = power[3:, 3:].T
    return block_diag(f, f), block_diag(f @ power[:3, 3:], f @ power[:3, 3:])


def filter_model(model, period):
    """Returns F and Q of a filter; its acceleration noise is never zero, but at least 1e-6 m/s2."""
    return equations_5_6(model | {"acceleration_sd_m_s2": max(model["acceleration_sd_m_s2"], 1e-6)}, period)


def check_target_model(record, compare):
    model, period = record.scenario["filter"], record.period
    alpha = model["correlation_rate_1_s"]
    decay = np.exp(-alpha * period)
    published = [[1.0, period, (decay + alpha * period - 1.0) / alpha**2], [0.0, 1.0, (1.0 - decay) / alpha],
                 [0.0, 0.0, decay]]
    f, q = equations_5_6(model, period)
    compare("(6) published F compared with the matrix exponential", published, f[:3, :3])
    half_f, half_q = equations_5_6(model, period / 2)
    compare("(5) Q of two half steps compared with a whole one", half_f @ half_q @ half_f.T + half_q, q)
    if "targets" not in record.scenario or not record.truth:
        return
    # Random targets move by the same equations with separate parameters.
    f, q = equations_5_6(record.scenario["targets"], period)
    model = record.scenario["targets"]
    free = {time: {target: row.state - manoeuvred(model, target, time / 1e6) for target, row in rows.items()}
            for time, rows in record.truth.items()}
    noise = np.array([state - f @ free[a][target] for a, b in zip(record.times, record.times[1:])
                      for target, state in free[b].items() if target in free[a]])
    if not q.any():
        compare("(5) targets without noise", noise, 0.0)
    elif len(noise):
        mean_square = np.mean(np.einsum("ti,ij,tj->t", noise, inverse(q), noise)) / 6
        compare("(5) variance of the targets' noise (statistics)", 1.0, mean_square,
                tolerance=STATISTICS * np.sqrt(2.0 / noise.size))


def manoeuvred(model, target, now_s):
    """Returns the change of a target's state by its manoeuvres, which are accelerations for a limited time."""
    added = np.zeros((2, 3))
    for manoeuvre in model.get("manoeuvre", []):
        if manoeuvre["target"] == target:
            since, until = now_s - manoeuvre["from_s"], now_s - manoeuvre["until_s"]
            ramps = [max(since, 0.0) ** 2 / 2 - max(until, 0.0) ** 2 / 2, max(since, 0.0) - max(until, 0.0),
                     float(since >= 0.0 > until)]
            added += np.outer([manoeuvre["ax_m_s2"], manoeuvre["ay_m_s2"]], ramps)
    return added.ravel()


def equation_7(uav, target):
    """Returns range and azimuth from a UAV to a target."""
    return np.array([np.hypot(*(target - uav)), direction(target - uav)])


def in_view(sensor, uav, target):
    """Returns true if a target is within half the field of view of the boresight and within sensing range."""
    distance, azimuth = equation_7(uav.position, target.position)
    off = abs(wrap(azimuth - uav.boresight_rad))
    return off <= np.radians(sensor["field_of_view_deg"]) / 2 and distance <= sensor["sensing_range_m"]


def walls_of(scenario):
    """Returns the walls of the buildings, each with both ends (m) and height (m)."""
    walls, world = [], scenario.get("world", {})
    for outline in world.get("building_outlines_cm", []):
        height, _, rings = outline.rpartition(":")
        height_m = int(height) / 100 if height else world["building_height_m"]
        for ring in rings.split(";"):
            corners = [[int(number) / 100 for number in corner.split(",")] for corner in ring.split()]
            walls += [(*a, *b, height_m) for a, b in zip(corners, corners[1:] + corners[:1])]
    return np.array(walls).reshape(-1, 5)


def is_hidden(walls, uav, target):
    """Returns true if a wall hides a target outside of all buildings: the line of sight crosses it below its height."""
    a, b, height_m = walls[:, :2] - target.position, walls[:, 2:4] - target.position, walls[:, 4]
    line = uav.position - target.position
    cross = lambda p, q: p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        part, along = cross(a, b - a) / cross(line, b - a), cross(a, line) / cross(line, b - a)
        crossed = (0 < part) & (part < 1) & (0 <= along) & (along <= 1)
    return bool(np.any(crossed & (part * uav.altitude_m < height_m))) if len(walls) else False


def largest_fit(rows, bearings, away, widest):
    """Returns the largest set of targets that fits into a field of view, and the direction of its middle. Of equally large
    sets the one with the largest uncertainty wins, of equal ones the nearest."""
    fitting = {right: {target: row for target, row in rows.items()
                       if (bearings[target] - bearings[right]) % (2 * np.pi) <= widest} for right in rows}
    if not rows or widest >= np.pi:
        return {}, 0.0
    most = max(map(len, fitting.values()))
    fitting = {right: fit for right, fit in fitting.items() if len(fit) == most}
    variances = {right: sum(np.linalg.eigvalsh(row.p_position)[-1] for row in fit.values())
                 for right, fit in fitting.items()}
    equal = [right for right in fitting if variances[right] >= max(variances.values()) * (1 - 1e-9)]
    right = min(equal, key=lambda right: sum(away[target] ** 2 for target in fitting[right]))
    return fitting[right], bearings[right] + widest / 2


def angular_midpoint(record, time, uav, centre):
    """Returns the point at which `orbit.pointing = "angular-midpoint"` points the sensor one period later: the angular midpoint of the
    group's members, or of those that the group must keep in view, or of as many of these as fit, extrapolated with its
    present velocity. None if no midpoint exists; the sensor then points at the centre."""
    members, assigned_members = record.members(time, uav.group), record.assigned_members(time, uav.group)
    own = {target: row for target, row in members.items() if target in assigned_members}
    widest = np.radians(record.scenario["sensor"]["field_of_view_deg"])
    bearings = {target: direction(row.position - uav.position) for target, row in members.items()}
    away = {target: np.hypot(*(row.position - uav.position)) for target, row in members.items()}
    centred = direction(centre.position - uav.position)
    for rows, towards in [(members, centred), (own, centred), largest_fit(own, bearings, away, widest)]:
        off = {target: wrap(bearings[target] - towards) for target in rows}
        if not off or max(map(abs, off.values())) >= np.pi / 2 or max(off.values()) - min(off.values()) > widest:
            continue
        right, left = rows[min(off, key=off.get)], rows[max(off, key=off.get)]
        own_velocity = uav.speed_m_s * unit(uav.heading_rad)

        def divided(t):
            """Returns the point on the opposite side that the bisector divides in the ratio of the adjacent sides."""
            a, b = (row.position + t * row.velocity for row in [left, right])
            to_a, to_b = (np.hypot(*(at - uav.position - t * own_velocity)) for at in [a, b])
            return (to_b * a + to_a * b) / (to_a + to_b)

        h = 1e-2  # the derivative by central differences of fourth order
        rate = (8 * (divided(h) - divided(-h)) - (divided(2 * h) - divided(-2 * h))) / (12 * h)
        return divided(0.0) + record.period * rate
    return None


def check_measurements(record, compare):
    if not record.truth:
        return
    sensor, residuals = record.scenario["sensor"], []
    for before, time in zip([None, *record.times], record.times):
        truth, expected = record.truth[time], set()
        for uav, row in record.uavs[time].items():
            if row.boresight_rad is not None:
                expected |= {(uav, target) for target in truth
                             if in_view(sensor, row, truth[target]) and not is_hidden(record.walls, row, truth[target])}
            centre = record.groups[before].get(record.uavs[before][uav].group) if before is not None else None
            if centre is not None:
                ahead, what, tolerance = centre.position + centre.velocity * record.period, "", ROUNDING
                middle = None
                if record.scenario["orbit"]["pointing"] == "angular-midpoint":
                    middle = angular_midpoint(record, before, record.uavs[before][uav], centre)
                if middle is not None:
                    ahead, what, tolerance = middle, ", angular midpoint", DIFFERENCES
                compare.angle(f"section II: boresight{what}", row.boresight_rad, direction(ahead - row.position), tolerance)
        # Noise can make a very short range negative, which gives no measurement: near targets may be missed.
        missed = {(uav, target) for uav, target in expected - set(record.detections[time])
                  if equation_7(record.uavs[time][uav].position, truth[target].position)[0] > 6 * sensor["range_sd_m"]}
        others = set(record.detections[time]) - expected
        compare("(7) missed or unexpected detections", 0, len(missed | others))
        for uav, target in set(record.detections[time]) & expected:
            measured = record.detections[time][uav, target]
            distance, azimuth = equation_7(record.uavs[time][uav].position, truth[target].position)
            residuals.append([measured.range_m - distance, wrap(measured.bearing_rad - azimuth)])
        if record.views is not None:
            check_views(record, time, expected, compare)
    sds = [sensor["range_sd_m"], np.radians(sensor["bearing_sd_deg"])]
    for name, sd, values in zip(["range", "azimuth"], sds, np.array(residuals).reshape(-1, 2).T):
        if sd == 0.0:
            compare(f"(7) {name} without noise", values, 0.0)
        elif len(values):
            compare(f"(7) variance of the {name}'s noise (statistics)", 1.0, np.mean((values / sd) ** 2),
                    tolerance=STATISTICS * np.sqrt(2.0 / len(values)))


def check_views(record, time, expected, compare):
    """Checks the derived columns: targets in view, and distances of estimates from the truth."""
    compare("in_view: targets in view", 0, len(set(record.views[time]) ^ expected))
    for uav, target in expected:
        row, view = record.uavs[time][uav], record.views[time][uav, target]
        distance, azimuth = equation_7(row.position, record.truth[time][target].position)
        compare("in_view: range", view.range_m, distance)
        compare.angle("in_view: angle off boresight", view.off_boresight_rad, wrap(azimuth - row.boresight_rad))
    for target, track in record.tracks[time].items():
        there = record.truth[time].get(target)
        off = None if there is None else np.hypot(*(track.position - there.position))
        compare("tracks: position error", track.position_error_m, off)


def inverse(p):
    """Inverts a covariance or information matrix. It is scaled first, because its entries span many orders of magnitude."""
    sds = np.sqrt(np.diag(p))
    return np.linalg.inv(p / np.outer(sds, sds)) / np.outer(sds, sds)


def equations_8_9(y, information, f, q):
    """Predicts information vector and matrix."""
    p = inverse(information)
    predicted = inverse(f @ p @ f.T + q)
    return predicted @ f @ p @ y, predicted


def equations_10_11(y, information, looks, sensor):
    """Updates with all measurements of one target at one time step: (UAV's position, range and azimuth)."""
    p = inverse(information)
    x = p @ y
    r_inverse = np.diag([sensor["range_sd_m"] ** -2, np.radians(sensor["bearing_sd_deg"]) ** -2])
    near = [is_nonlinear(uav, x[POSITION], p, sensor) for uav, _ in looks]
    for (uav, z), is_integrated in zip(looks, near):
        if is_integrated:
            continue
        h = jacobian(uav, x[POSITION])
        if h is None:
            continue
        y = y + h.T @ r_inverse @ (innovation(uav, z, x[POSITION]) + h @ x)
        information = information + h.T @ r_inverse @ h
    for (uav, z), is_integrated in zip(looks, near):
        if is_integrated:
            y, information = integrated(y, information, uav, z, sensor)
    return y, information


def is_nonlinear(uav, predicted, p, sensor):
    """Returns whether a measurement is integrated instead of linearised (docs/user/sensing.md)."""
    if sensor["near_range_m"] == 0.0:
        return False
    distance = equation_7(uav, predicted)[0]
    fraction = 1e-3 if distance < sensor["near_range_m"] else 2.0 * sensor["linear_sd_fraction_max"] ** 2
    return fraction > 0.0 and np.trace(p[np.ix_(POSITION, POSITION)]) > fraction * distance**2


def integrated(y, information, uav, z, sensor):
    """Updates with one measurement: moments of prior times likelihood, summed over a grid of ranges and azimuths. If the
    prior is wide, all ranges are equally likely; otherwise positive ranges are reported with their probability."""
    p = inverse(information)
    x = p @ y
    prior = p[np.ix_(POSITION, POSITION)]
    range_sd, azimuth_sd = sensor["range_sd_m"], np.radians(sensor["bearing_sd_deg"])
    offsets = np.linspace(-1.0, 1.0, 401) * min(8.0 * azimuth_sd, np.pi)
    nodes, weights = NODES
    distance, reach = equation_7(uav, x[POSITION])[0], 9.0 * np.sqrt(np.linalg.eigvalsh(prior)[1])
    nearest, farthest = max(z[0] - 9.0 * range_sd, distance - reach, 0.0), min(z[0] + 9.0 * range_sd, distance + reach)
    ranges = nearest + 0.5 * (farthest - nearest) * (nodes + 1.0)
    directions = np.stack([np.cos(z[1] + offsets), np.sin(z[1] + offsets)], axis=-1)
    places = uav + ranges[:, None, None] * directions
    away = places - x[POSITION]
    exponent = -0.5 * (np.einsum("...i,ij,...j", away, np.linalg.inv(prior), away)
                       + ((ranges - z[0]) / range_sd)[:, None] ** 2 + (offsets / azimuth_sd) ** 2)
    sds = ranges / range_sd
    if np.trace(prior) <= 0.25 * distance**2:
        weights = weights * ranges * (1.0 + np.exp(-(1.54 + 0.145 * sds) * sds))
    mass = weights[:, None] * np.exp(exponent - exponent.max())
    mass /= mass.sum()
    mean = np.einsum("rt,rti->i", mass, places)
    spread = np.einsum("rt,rti,rtj->ij", mass, places - mean, places - mean)
    gain = p[:, POSITION] @ np.linalg.inv(prior)
    p = p + gain @ (spread - prior) @ gain.T
    information = inverse(p)
    return information @ (x + gain @ (mean - x[POSITION])), information


def jacobian(uav, target):
    """Returns H, the derivative of (7) by the target's state; None at ranges below 1 m, where it diverges (docs/developer/ledger.md)."""
    (dx, dy), distance = target - uav, equation_7(uav, target)[0]
    if distance < 1.0:
        return None
    h = np.zeros((2, 6))
    h[:, POSITION] = [[dx / distance, dy / distance], [-dy / distance**2, dx / distance**2]]
    return h


def innovation(uav, z, predicted):
    distance, azimuth = equation_7(uav, predicted)
    return np.array([z[0] - distance, wrap(z[1] - azimuth)])


def stacked(looks, target, sensor):
    """Returns stacked H, R and innovations of all measurements of a target, given its predicted position."""
    used = [(uav, z) for uav, z in looks if jacobian(uav, target) is not None]
    h = np.vstack([np.zeros((0, 6)), *[jacobian(uav, target) for uav, _ in used]])
    r = np.diag([sensor["range_sd_m"] ** 2, np.radians(sensor["bearing_sd_deg"]) ** 2] * len(used))
    return h, r.reshape(len(h), len(h)), np.ravel([innovation(uav, z, target) for uav, z in used])


def looks_by_target(record, time):
    """Returns the measurements of each target: (UAV's position, range and azimuth)."""
    looks = defaultdict(list)
    for (uav, target), z in record.detections[time].items():
        looks[target].append((record.uavs[time][uav].position, (z.range_m, z.bearing_rad)))
    return looks


def check_tracks(record, compare):
    """Runs the filters from each track's first estimate, without resetting them to the record."""
    model, filters = record.scenario["filter"], {}
    f, q = filter_model(model, record.period)
    for time in record.times:
        previous, filters, seen = filters, {}, looks_by_target(record, time)
        for target, row in record.tracks[time].items():
            if target not in previous:
                filters[target] = inverse(row.p) @ row.state, inverse(row.p)
                continue
            looks = seen[target]
            y, information = equations_10_11(*equations_8_9(*previous[target], f, q), looks, model)
            filters[target] = y, information
            sds = np.sqrt(np.diag(row.p))
            scale = np.maximum(np.abs(row.state), np.maximum(sds, 1.0))
            tolerance = INTEGRATED_TOLERANCE if model["near_range_m"] > 0.0 else LONG_FILTER_TOLERANCE
            compare("(8, 10) state of a track", row.state, inverse(information) @ y, scale, tolerance)
            compare("(9, 11) covariance of a track", row.p, inverse(information), np.outer(sds, sds), tolerance)
            compare("track status updated if and only if measured", row.status == "updated", bool(looks))


def section_2c(centre, p, f, q, z, r):
    """Kalman filter of the centre, covariance form: returns the new centre, its P, and the innovation's distance (16)."""
    centre, p = f @ centre, f @ p @ f.T + q
    innovation, p_position = z - centre[POSITION], p[np.ix_(POSITION, POSITION)]
    gain = p[:, POSITION] @ np.linalg.inv(p_position + r)
    margin = innovation @ np.linalg.inv(p_position) @ innovation
    return centre + gain @ innovation, p - gain @ p[POSITION, :], margin


def shift(record, before, time, group, f):
    """Returns the jump of the desired centre that only the change of members causes."""
    old, new = record.members(before, group), record.members(time, group)
    if set(old) == set(new):
        return np.zeros(6)
    # An old member without a live track is at its predicted position.
    tracks, old_now = record.tracks[time], {}
    for target, row in old.items():
        state = tracks[target].state if target in tracks else f @ row.state
        old_now[target] = SimpleNamespace(state=state, position=state[POSITION])
    return desired_state(record.scenario, new) - desired_state(record.scenario, old_now)


def margin_in_metres(sds, toward, furthest, members):
    """Returns `sds` standard deviations of the furthest member's position relative to the mean, along the line to it."""
    # In that difference the furthest member has the weight 1 - 1/n, every other member -1/n.
    weights = {target: float(target == furthest) - 1 / len(members) for target in members}
    relative = sum(weights[target] ** 2 * row.p_position for target, row in members.items())
    return sds * np.sqrt(toward @ relative @ toward)


def turn_limit(uavs, centre_velocity):
    """Returns the smallest radius that UAVs can turn around a moving centre; infinite if it is as fast as they can fly."""
    centre_speed, fastest = np.hypot(*centre_velocity), uavs["speed_m_s"] + uavs["speed_change_max_m_s"]
    v = min(max(uavs["speed_m_s"], speed_floor(centre_velocity)), fastest)
    return (v + centre_speed) ** 2 / (v * uavs["turn_rate_max_rad_s"]) if centre_speed < v else np.inf


def turn_limit_after(before, limit, dt):
    """Returns the turn limit of a moving orbit, which follows that at the members' velocity with a time constant of 5 s."""
    return before + dt / (5.0 + dt) * (limit - before) if np.isfinite(before) and np.isfinite(limit) else limit


def bounds_with(scenario, limit):
    """Returns the keys of the orbit, with a minimum radius of at least the turn limit."""
    orbit = scenario["orbit"]
    if not orbit["radius_above_turn_limit"]:
        return orbit
    return {**orbit, "radius_min_m": min(max(orbit["radius_min_m"], limit), orbit["radius_max_m"])}


def equation_15(scenario, spread, spread_rate, margin, limit):
    """Returns the standoff distance unclamped and clamped to the bounds with a turn limit, and its rate."""
    orbit = bounds_with(scenario, limit)
    half_view = np.radians(scenario["sensor"]["field_of_view_deg"] - orbit["field_of_view_margin_deg"]) / 2
    sine = np.sin(min(half_view, np.pi / 2))
    unclamped = (spread + margin) / sine
    clamped = np.clip(unclamped, orbit["radius_min_m"], orbit["radius_max_m"])
    return unclamped, clamped, spread_rate / sine if clamped == unclamped else 0.0


def enclosing_circle(positions):
    """Returns the centre and the support points of the minimum enclosing circle, by trying all pairs and triples."""
    circles = [(positions[0], [0])] if len(positions) == 1 else []
    circles += [((positions[i] + positions[j]) / 2, [i, j]) for i, j in combinations(range(len(positions)), 2)]
    for rim in combinations(range(len(positions)), 3):
        a, b, c = positions[list(rim)]
        # The centre has the same distance from a, b and c.
        sides = 2 * np.array([b - a, c - a])
        if abs(np.linalg.det(sides)) > 1e-9:
            circles.append((np.linalg.solve(sides, [b @ b - a @ a, c @ c - a @ a]), list(rim)))
    return min(circles, key=lambda circle: max(np.hypot(*(positions - circle[0]).T)))


def is_by_circle(scenario):
    return scenario["orbit"]["centre"] == "enclosing-circle"


def true_centre(scenario, positions):
    """Returns the centre of an orbit around these positions: of the minimum enclosing circle, or the mean."""
    positions = np.array(positions)
    return enclosing_circle(positions)[0] if is_by_circle(scenario) else np.mean(positions, axis=0)


def desired_state(scenario, members):
    """Returns the desired state of the centre of the members' orbit: their mean state, with the circle's centre as position
    if the scenario uses it."""
    state = np.mean([row.state for row in members.values()], axis=0)
    state[POSITION] = true_centre(scenario, [row.position for row in members.values()])
    return state


def circle_spread(positions, velocities):
    """Returns the radius of the minimum enclosing circle and its rate, from the outward speeds of its support points."""
    centre, rim = enclosing_circle(positions)
    radius = max(np.hypot(*(positions - centre).T))
    if len(rim) == 1:
        return 0.0, 0.0
    outward = np.array([unit(direction(positions[i] - centre)) for i in rim])
    speeds = np.einsum("ij,ij->i", outward, velocities[rim])
    # Unknowns: the velocity of the centre (two support points leave its tangential part open) and the rate of the radius.
    return radius, np.linalg.lstsq(np.column_stack([outward, np.ones(len(rim))]), speeds, rcond=1e-12)[0][2]


def last_furthest(distances):
    """Returns the furthest target, of equally far ones the last. Both targets of a pair have the same distance from its
    middle, except for rounding."""
    return [target for target, distance in distances.items() if distance**2 >= max(distances.values()) ** 2 * (1 - 1e-9)][-1]


def follow(x, v, desired, desired_v, orbit, dt):
    """Moves an orbit's centre or radius (not in the paper): critically damped, with limited acceleration."""
    t, a = max(orbit["time_constant_s"], dt), orbit["acceleration_max_m_s2"]
    x = x + v * dt
    away = np.linalg.norm(desired - x)
    approach = away / (2 * t) if away <= 4 * a * t**2 else np.sqrt(2 * a * (away - 2 * a * t**2))
    along = (desired - x) / away if away > 0 else 0 * x
    change = (desired_v + along * min(approach, orbit["closing_speed_max_m_s"]) - v) * dt / (t / 2 + dt)
    change *= min(1, a * dt / np.linalg.norm(change)) if np.any(change) else 1
    return x + change * dt / 2, v + change


def follow_radius(radius, rate, desired, orbit, dt):
    """Moves a radius: like `follow` with a desired rate of zero, within its bounds and with a limited rate."""
    moved, rate = (value[0] for value in follow(*(np.array([value]) for value in (radius, rate, desired, 0.0)), orbit, dt))
    bounded, fastest = np.clip(moved, orbit["radius_min_m"], orbit["radius_max_m"]), orbit["closing_speed_max_m_s"]
    if bounded == moved:
        return bounded, np.clip(rate, -fastest, fastest)
    # The lower bound may have risen above the radius.
    return bounded, np.clip((bounded - radius) / dt, 0.0, fastest) if bounded == orbit["radius_min_m"] else 0.0


def orbit_about(scenario, positions, velocities, margin=0.0, before=None, dt=None):
    """Returns the centre, its velocity, r_d, its rate and turn limit: instantaneous, or `dt` after the moving orbit `before`."""
    positions, velocities, orbit = np.array(positions), np.array(velocities), scenario["orbit"]
    centre, velocity = true_centre(scenario, positions), np.mean(velocities, axis=0)
    moves = before is not None and orbit["time_constant_s"] > 0
    if moves:
        centre, velocity = follow(before[0], before[1], centre, velocity, orbit, dt)
    spreads = np.hypot(*(positions - centre).T)
    # The last one of equally far targets.
    furthest = len(spreads) - 1 - np.argmax(spreads[::-1])
    rate = (positions[furthest] - centre) @ (velocities[furthest] - velocity) / max(spreads[furthest], 1e-300)
    limit = turn_limit(scenario["uavs"], np.mean(velocities, axis=0))
    limit = turn_limit_after(before[4], limit, dt) if moves else limit
    _, radius, rate = equation_15(scenario, spreads[furthest], rate, margin, limit)
    if moves:
        radius, rate = follow_radius(*before[2:4], radius, bounds_with(scenario, limit), dt)
    return centre, velocity, radius, rate, limit


def true_orbits(record):
    """Returns by time and group: the true orbit with its motion, and the instantaneous one."""
    found = {}
    for before, time in zip([None, *record.times], record.times):
        found[time] = {}
        for group in record.groups[time]:
            truth = [record.truth[time][t] for t in record.members(time, group) if t in record.truth[time]]
            if truth:
                states = [row.position for row in truth], [row.velocity for row in truth]
                was = found[before].get(group, [None])[0] if before is not None else None
                flown = orbit_about(record.scenario, *states, before=was, dt=record.period)
                found[time][group] = flown, orbit_about(record.scenario, *states)
    return found


def equation_27(uavs, centre_velocity, rate):
    """Returns the smallest radius, the larger of (27) as published and of the limit for a moving centre; None if the centre
    is as fast as the UAVs."""
    centre_speed, turn_rate = np.hypot(*centre_velocity), uavs["turn_rate_max_rad_s"]
    fastest = uavs["speed_m_s"] + uavs["speed_change_max_m_s"]
    v = min(max(uavs["speed_m_s"], speed_floor(centre_velocity)), fastest)
    return max((v - rate) / turn_rate, (v + centre_speed) ** 2 / (v * turn_rate)) if centre_speed < v else None


def required_radius(scenario, members, desired, furthest_row, margin):
    """Returns the radius that the members require around the desired centre, independent of the present orbit."""
    spread = np.hypot(*(furthest_row.position - desired[POSITION]))
    if is_by_circle(scenario):
        positions = np.array([track.position for track in members.values()])
        spread = max(np.hypot(*(positions - enclosing_circle(positions)[0]).T))
    return equation_15(scenario, spread, 0.0, margin, 0.0)[0]


def check_groups(record, compare):
    """Runs the filters of the centres, and moving orbits, on the recorded tracks, without resetting them to the record."""
    scenario, centres, flown = record.scenario, {}, {}
    orbit = scenario["orbit"]
    f, q = filter_model(scenario["filter"], record.period)
    for before, time in zip([None, *record.times], record.times):
        previous, centres, flown_before, flown = centres, {}, flown, {}
        for group, row in record.groups[time].items():
            members = record.members(time, group)
            moves = group in previous and orbit["time_constant_s"] > 0
            compare("number of members", row.members, len(members))
            mean = desired_state(scenario, members)
            mean_p = sum(track.p for track in members.values()) / len(members) ** 2
            if group in previous:
                centre, p = previous[group]
                if orbit["centre_jump"] == "shift-state":
                    centre = centre + shift(record, before, time, group, f)
                centre, p, margin = section_2c(centre, p, f, q, mean[POSITION], mean_p[np.ix_(POSITION, POSITION)])
            if group not in previous or orbit["centre"] != "filtered":
                centre, p, margin = mean, mean_p, margin if group in previous else 0.0
            if moves:
                # The centre follows its desired state; it equals this state only when the group is created.
                at, velocity, old_radius, old_rate, old_limit = flown_before[group]
                at, velocity = follow(at, velocity, centre[POSITION], centre[VELOCITY], orbit, record.period)
                centre = np.zeros(6)
                centre[POSITION], centre[VELOCITY] = at, velocity
            centres[group] = centre, p
            compare("section II.C: group centre", row.position, centre[POSITION], tolerance=LONG_FILTER_TOLERANCE)
            compare("section II.C: velocity of the centre", row.velocity, centre[VELOCITY], tolerance=LONG_FILTER_TOLERANCE)

            distances = {target: np.hypot(*(track.position - centre[POSITION])) for target, track in members.items()}
            furthest = last_furthest(distances)
            spread, furthest_row = distances[furthest], members[furthest]
            toward = unit(direction(furthest_row.position - centre[POSITION])) if spread > 0 else np.zeros(2)
            spread_rate = toward @ (furthest_row.velocity - centre[VELOCITY])
            if is_by_circle(scenario) and not moves:
                spread, spread_rate = circle_spread(*(np.array([getattr(track, name) for track in members.values()])
                                                      for name in ["position", "velocity"]))
            if orbit["margin"] != "mahalanobis":
                margin = margin_in_metres(orbit["margin_sds"], toward, furthest, members)
            limit = turn_limit(scenario["uavs"], mean[VELOCITY])
            if moves:
                limit = turn_limit_after(old_limit, limit, record.period)
            unclamped, clamped, rate = equation_15(scenario, spread, spread_rate, margin, limit)
            if moves:
                clamped, rate = follow_radius(old_radius, old_rate, clamped, bounds_with(scenario, limit), record.period)
            flown[group] = centre[POSITION], centre[VELOCITY], clamped, rate, limit
            compare("(15) spread d_max", row.spread_m, spread, tolerance=LONG_FILTER_TOLERANCE)
            compare(f"(16) margin d_m, {orbit['margin']}", row.margin_m, margin, tolerance=LONG_FILTER_TOLERANCE)
            compare("(15) standoff distance, unclamped", row.standoff_unclamped_m, unclamped, tolerance=LONG_FILTER_TOLERANCE)
            compare("(15) standoff distance r_d", row.standoff_distance_m, clamped, tolerance=LONG_FILTER_TOLERANCE)
            compare("(15) rate of r_d", row.standoff_rate_m_s, rate, tolerance=LONG_FILTER_TOLERANCE)
            if orbit["radius_above_turn_limit"]:
                limit = limit if np.isfinite(limit) else None
            else:
                limit = equation_27(scenario["uavs"], row.velocity, row.standoff_rate_m_s)
            compare("(27) and moving centre: smallest radius", row.turn_limit_m, limit)
            required = required_radius(scenario, members, mean, furthest_row, margin) if moves else unclamped
            required = max(required, orbit["radius_min_m"], np.inf if limit is None else limit)
            allowed = min(orbit["radius_max_m"], scenario["sensor"]["sensing_range_m"] - spread)
            compare("an orbit satisfies all constraints", row.feasible, required <= allowed)


def equation_22(record):
    """Returns the steered radius and its rate of each group at each time: r_d with the lead, or its prediction."""
    scenario, steered, moving_before = record.scenario, {}, set()
    guidance, orbit, speed = scenario["guidance"], scenario["orbit"], scenario["uavs"]["speed_m_s"]
    for time in record.times:
        steered[time] = {}
        for group, row in record.groups[time].items():
            radius, rate = row.standoff_distance_m, row.standoff_rate_m_s
            limit = np.inf if row.turn_limit_m is None else row.turn_limit_m
            bounds = bounds_with(scenario, limit)
            if guidance["law"] == "standoff":
                lag, moves = guidance["radial_gain"] * radius / speed, orbit["time_constant_s"] > 0 and group in moving_before
                if is_by_circle(scenario) and not moves:
                    members = record.members(time, group).values()
                    spread, spread_rate = circle_spread(np.array([track.position for track in members]),
                                                        np.array([track.velocity for track in members]))
                else:
                    # The target that is furthest from the flown centre.
                    relative = [(track.position - row.position, track.velocity - row.velocity)
                                for track in record.members(time, group).values()]
                    away, moving = max(relative, key=lambda pair: np.hypot(*pair[0]))
                    spread, spread_rate = np.hypot(*away), unit(direction(away)) @ moving if np.any(away) else 0.0
                spread = max(spread + lag * spread_rate, 0.0)
                _, expected, expected_rate = equation_15(scenario, spread, spread_rate, row.margin_m, limit)
                if moves:
                    # A moving orbit has not yet reached the predicted radius.
                    expected, expected_rate = follow_radius(radius, rate, expected, bounds, lag)
                radius, rate = expected, expected_rate
            else:
                led = radius + guidance["lead_s"] * rate
                radius = np.clip(led, bounds["radius_min_m"], bounds["radius_max_m"])
                rate = rate if radius == led else 0.0
            steered[time][group] = radius, rate
        moving_before = set(record.groups[time])
    return steered


def equations_13_20(scenario, uav_rel_centre, virtual):
    """Returns the direction of the flown field toward the steered radius, a unit vector."""
    guidance = scenario["guidance"]
    r, outward = np.hypot(*uav_rel_centre), unit(direction(uav_rel_centre))
    along = DIRECTION[guidance["orbit_direction"]] * np.array([-outward[1], outward[0]])
    field = -(r**2 - virtual**2) / guidance["radial_gain"] * outward + 2 * r * virtual * along
    return field / np.hypot(*field)


def equations_28_29(field, centre_velocity, speed):
    """Returns the velocity over ground, and true if the centre is too fast for the field."""
    # |alpha field + centre velocity| = speed, for a field of unit length; the larger root.
    b = field @ centre_velocity
    discriminant = b**2 - centre_velocity @ centre_velocity + speed**2
    if discriminant >= 0.0 and np.sqrt(discriminant) >= b:
        return centre_velocity + (np.sqrt(discriminant) - b) * field, False
    # No positive root: the best direction is toward the point of the ray that is nearest to the reachable velocities.
    best = centre_velocity + max(-b, 0.0) * field
    return speed * best / np.hypot(*best), True


def equation_25(guidance, r, radius, rate, speed):
    """Returns the feedforward as published, or exact: the derivative of the field's heading along the field (13)."""
    cubed = radius * r**2 if guidance["feedforward"] == "paper" else radius**3
    turn_rate = 4 * speed * cubed / (r**2 + radius**2) ** 2 - 2 * r * rate / (r**2 + radius**2)
    return DIRECTION[guidance["orbit_direction"]] * turn_rate


def one_lag_ahead(scenario, uav, uav_rel_centre, centre_velocity, steered):
    """Returns heading, position relative to the centre and steered radius one turn rate lag later, at constant rates."""
    lag, turn = scenario["uavs"]["turn_rate_lag_s"], uav.turn_rate_rad_s
    heading = uav.heading_rad + turn * lag
    if abs(turn * lag) < 1e-9:
        path = lag * uav.speed_m_s * unit(uav.heading_rad)
    else:
        path = uav.speed_m_s / turn * np.array([np.sin(heading) - np.sin(uav.heading_rad),
                                                np.cos(uav.heading_rad) - np.cos(heading)])
    return heading, uav_rel_centre + path - lag * centre_velocity, (steered[0] + lag * steered[1], steered[1])


def flown_feedforward(scenario, uav_velocity, uav_rel_centre, centre_velocity, steered, speed):
    """Returns the derivative of the desired heading, by central differences of fourth order, for a UAV at this velocity, at
    constant speed relative to the centre."""
    radius, rate = steered
    field_now = equations_13_20(scenario, uav_rel_centre, radius)
    over_ground_now, too_fast = equations_28_29(field_now, centre_velocity, speed)
    relative_speed = np.hypot(*(over_ground_now - centre_velocity))

    def ground_track(t):
        field = equations_13_20(scenario, uav_rel_centre + t * flown, radius + t * rate)
        if not too_fast:
            return centre_velocity + relative_speed * field
        return equations_28_29(field, centre_velocity, speed)[0]

    def change(t):
        return wrap(direction(ground_track(t)) - direction(ground_track(-t)))

    flown, h = uav_velocity - centre_velocity, 1e-4
    return (8 * change(h) - change(2 * h)) / (12 * h)


def equation_35(guidance, phases, own, radius, speed, gap_min):
    """Returns the speed that keeps a pair at theta_d, three UAVs evenly spaced, or the doubled phases of more; before
    limits. `gap_min` is the smallest phase difference of neighbours among four or more."""
    sign = DIRECTION[guidance["orbit_direction"]]

    def neighbours(factor):
        """Returns the phase differences to the nearest UAV ahead and behind, in [0, 2 pi]; of two at the same phase the
        lower id is behind."""
        ahead = {uav: sign * factor * (phase - phases[own]) % (2 * np.pi) for uav, phase in phases.items() if uav != own}
        ahead = [2 * np.pi if gap == 0.0 and uav < own else gap for uav, gap in ahead.items()]
        return len(ahead), min(ahead, default=0.0), 2 * np.pi - max(ahead, default=0.0)

    others, nearest, behind = neighbours(1)
    if not others:
        return speed
    if others == 1:
        desired = np.radians(guidance["desired_phase_deg"])
        lag = nearest - desired if nearest <= np.pi else desired - behind
    elif others == 2 or gap_min - behind > nearest - gap_min:
        lag = (nearest - behind) / 2  # half-way between its neighbours
    else:
        _, ahead_2, behind_2 = neighbours(2)
        lag = np.clip((ahead_2 - behind_2) / 4, gap_min - behind, nearest - gap_min)
    return speed + guidance["phase_gain_1_s"] * lag * radius


def smallest_gap(record, radius):
    """Returns the smallest phase difference of neighbours among four or more UAVs on an orbit (addition to (35))."""
    least = record.scenario.get("separation") or {"horizontal_min_m": 0.0}
    return 2 * np.arcsin(min((least["horizontal_min_m"] + 20.0) / (2 * radius), 1.0))


def in_transit(uav, group):
    """Returns true if a UAV is on its way to a group: it then neither adjusts its phase nor counts for the others (addition
    to (35))."""
    return np.hypot(*(uav.position - group.position)) > 2 * group.standoff_distance_m


def speed_floor(centre_velocity):
    """Returns the minimum speed, 10 % above that of the centre, so that no UAV falls behind (addition to (35))."""
    return 1.1 * np.hypot(*centre_velocity)


def lemma_3_1(r, radial_speed, radius, rate):
    """Returns the threshold xi_th, with (17): as long as it is not negative, the UAV converges to the orbit."""
    return (r * radial_speed - radius * rate) * np.sign(radius - r)


def check_guidance(record, compare):
    scenario = record.scenario
    guidance, uavs = scenario["guidance"], scenario["uavs"]
    turn_rate_max, change_max = uavs["turn_rate_max_rad_s"], uavs["speed_change_max_m_s"]
    steered_for = equation_22(record)
    for time in record.times:
        assigned = {uav: row for uav, row in record.uavs[time].items() if row.group is not None}
        for uav, row in assigned.items():
            group = record.groups[time][row.group]
            relative, radius, rate = row.position - group.position, group.standoff_distance_m, group.standoff_rate_m_s
            r, phase = equation_7(group.position, row.position)
            compare("(12) distance r from the centre", row.centre_distance_m, r)
            compare.angle("(35) phase", row.phase_rad, phase)

            phases = {mate: direction(other.position - group.position) for mate, other in assigned.items()
                      if other.group == row.group and not in_transit(other, group)}
            phases = phases if uav in phases else {uav: phase}
            desired_speed = equation_35(guidance, phases, uav, radius, uavs["speed_m_s"], smallest_gap(record, radius))
            desired_speed = max(desired_speed, speed_floor(group.velocity))
            steered = steered_for[time][row.group]
            field = equations_13_20(scenario, relative, steered[0])
            if guidance["law"] == "standoff":
                desired_speed = np.hypot(*(group.velocity + desired_speed * field))
            speed = np.clip(desired_speed, uavs["speed_m_s"] - change_max, uavs["speed_m_s"] + change_max)
            changed = row.avoided_uav is not None or row.limiting_zone is not None
            if not changed:
                compare("(35, 2) speed command", row.speed_command_m_s, speed)
            if row.limiting_zone is None:
                compare("(2) speed limited", row.speed_limited, speed != desired_speed)

            ground_track, too_fast = equations_28_29(field, group.velocity, speed)
            desired = direction(ground_track)
            compare("(22) steered radius", row.steered_radius_m, steered[0])
            compare.angle("(13, 20, 23, 28, 29) desired heading", row.desired_heading_rad, desired)
            compare("(29) centre too fast", row.centre_too_fast, too_fast)

            heading_error = wrap(row.heading_rad - desired)
            if guidance["law"] == "standoff":
                tolerance = DIFFERENCES
                heading, later, ramp = one_lag_ahead(scenario, row, relative, group.velocity, steered)
                field_later = equations_13_20(scenario, later, ramp[0])
                heading_error = wrap(heading - direction(equations_28_29(field_later, group.velocity, speed)[0]))
                velocity = row.speed_m_s * unit(heading)
                feedforward = flown_feedforward(scenario, velocity, later, group.velocity, ramp, speed)
            else:
                tolerance = ROUNDING
                feedforward = equation_25(guidance, r, radius, rate, speed)
            form = guidance["law"] if guidance["law"] == "standoff" else guidance["feedforward"]
            what = f"(25) feedforward, {form}"
            compare(what, row.feedforward_rad_s, feedforward, tolerance=tolerance)
            turn_rate = -guidance["heading_gain_1_s"] * heading_error + feedforward
            limited = np.clip(turn_rate, -turn_rate_max, turn_rate_max)
            if changed:
                # For a changed command, the flag refers to the flown turn rate.
                compare("(3) turn rate limited, of a changed command", row.turn_rate_limited,
                        abs(row.turn_rate_command_rad_s) >= turn_rate_max)
            else:
                compare("(24, 3) turn rate command", row.turn_rate_command_rad_s, limited, tolerance=tolerance)
                compare("(3) turn rate limited", row.turn_rate_limited, turn_rate != limited)
            if changed and row.limiting_zone is None:
                # The candidates are 17 turn rates and 7 speeds, and the command of the law.
                turns = np.append(np.linspace(-turn_rate_max, turn_rate_max, 17), limited)
                speeds = np.append(uavs["speed_m_s"] + np.linspace(-change_max, change_max, 7), speed)
                compare("separation: command is not one of the candidates", 0.0,
                        [np.abs(turns - row.turn_rate_command_rad_s).min(), np.abs(speeds - row.speed_command_m_s).min()],
                        tolerance=tolerance)
            # The radial speed is the flown one, relative to the centre.
            threshold = lemma_3_1(r, (ground_track - group.velocity) @ unit(phase), radius, rate)
            compare("Lemma 3.1: threshold", row.convergence_threshold_m2_s, threshold)


AHEAD_S = 8.0  # prediction horizon of the collision avoidance
SPARE_M = 16.0  # buffer added to the minimum distance, with the clearance at which a manoeuvre ends
ONE_AVOIDANCE_S = 5.0  # after a longer pause, a new avoidance starts


def check_avoidance(record, compare):
    """Checks that each avoidance has a cause and exactly one event."""
    scenario, last = record.scenario, {}
    has_no_latency = "radio" not in scenario
    avoidances = sum(row.avoided_uav is not None for rows in record.uavs.values() for row in rows.values())
    compare("separation: avoidance that is not enabled", 0, 0 if scenario.get("separation") else avoidances)
    compare("zones: limiting zone that does not exist", 0, sum(
        not 0 <= row.limiting_zone < len(scenario.get("geofence", []))
        for rows in record.uavs.values() for row in rows.values() if row.limiting_zone is not None))
    for time, uavs in record.uavs.items():
        began = []
        for row in uavs.values():
            compare("separation: avoided UAV and predicted distance", row.avoided_uav is None, row.predicted_distance_m is None)
            if row.avoided_uav is None:
                continue
            compare("separation: avoided UAV that does not exist", 0, row.avoided_uav not in uavs or row.avoided_uav == row.uav)
            since = last.get(row.uav)
            if since is None or since[0] != row.avoided_uav or time - since[1] > ONE_AVOIDANCE_S * 1e6:
                began.append((f"{row.uav} {row.avoided_uav:.0f}", row.predicted_distance_m))
            last[row.uav] = row.avoided_uav, time
            if not has_no_latency or row.avoided_uav not in uavs:
                continue
            least, other = minima(record), uavs[row.avoided_uav]
            required = least["horizontal_min_m"] + SPARE_M
            compare("separation: predicted above required distance, m", 0.0, max(row.predicted_distance_m - required, 0.0))
            distance = np.hypot(*(row.position - other.position))
            compare("separation: predicted above present distance, m", 0.0, max(row.predicted_distance_m - distance, 0.0),
                    tolerance=1e-6)
            # Range of altitudes within the horizon: the avoiding UAV is on its way to its commanded altitude.
            own = [row.altitude_m, row.commanded_altitude_m or row.altitude_m]
            reach = 2.0 * abs(row.climb_rate_m_s) + AHEAD_S * abs(other.climb_rate_m_s)
            between = max(min(own) - other.altitude_m, other.altitude_m - max(own)) - reach
            compare("separation: avoided despite vertical distance, m", 0.0, max(between - least["vertical_min_m"], 0.0))
        events = [(event.uavs, event.distance_m) for event in record.events[time] if event.kind == "avoidance"]
        compare("separation: missing or unexpected events", 0, len(set(events) ^ set(began)))


def check_metrics(record, compare):
    """Checks every metric in the summary by its definition in docs/user/metrics.md."""
    if not record.truth:
        return
    samples, unseen, gaps, gap, orbits, on_orbit = defaultdict(list), [], {}, 0, true_orbits(record), {}
    paths = flown_paths(record)
    for before, time in zip([None, *record.times], record.times):
        track_samples(record, time, samples)
        orbit_samples(record, time, orbits, samples, compare)
        transit_samples(record, time, orbits, samples, on_orbit)
        separation_samples(record, paths, before, time, samples)
        line_of_sight_samples(record, time, samples)
        if gaps:
            unseen.append(view_samples(record, time, samples))
        # A target counts from the time step after its cue.
        for target in record.truth[time]:
            if target in gaps:
                in_view, is_grouped = is_seen(record, time, target), is_member(record, time, target)
                samples["in_view_fraction"].append(in_view)
                samples["custody_fraction"].append(in_view and is_grouped)
                gaps[target] = 0 if in_view else gaps[target] + 1
                gap = max(gap, gaps[target])
            else:
                gaps[target] = 0
    smallest = [name for name in samples if name.startswith("separation_min")]
    metrics = {name: (min if name in smallest else np.mean)(values) for name, values in samples.items() if values}
    metrics["off_boresight_max_deg"] = max(samples["off_boresight_mean_deg"], default=None)
    metrics["longest_out_of_view_s"] = gap * record.period if samples["in_view_fraction"] else None
    kinds = [event.kind for events in record.events.values() for event in events]
    metrics["removals"], metrics["handoffs"] = kinds.count("removed"), kinds.count("handoff-completed")
    streak, longest = {}, 0
    for targets in unseen:
        streak = {target: streak.get(target, 0) + 1 for target in targets}
        longest = max([longest, *streak.values()])
    metrics["member_longest_out_of_view_s"] = longest * record.period
    metrics |= bound_metrics(record) | innovation_metrics(record) | prediction_error_metrics(record)
    metrics |= control_effort_metrics(record) | custody_metrics(record) | separation_metrics(record) | zone_metrics(record)
    for name in sorted(set(record.metrics) - ASSOCIATION):
        tolerance, scale = (FLOWN_TOLERANCE, 1.0) if name in smallest else (ROUNDING, None)
        compare(f"metric {name}", record.metrics[name], metrics.get(name), scale, tolerance)


def control_effort_metrics(record):
    """Returns the metrics of control effort, from the time steps at which a UAV's sensor was pointed."""
    flown = defaultdict(list)
    for time in record.times:
        for row in looking(record, time):
            flown[row.uav].append(row)
    changes = lambda values: sum(one != other for one, other in zip(values, values[1:]))
    turns = [[np.sign(row.turn_rate_rad_s) for row in rows if abs(row.turn_rate_rad_s) > 0.02] for rows in flown.values()]
    groups = [[row.group for row in rows if row.group is not None] for rows in flown.values()]
    minutes = sum(map(len, flown.values())) * record.period / 60.0
    in_group = sum(map(len, groups)) * record.period / 60.0
    return {
        "speed_saturated_fraction": np.mean([row.speed_limited for rows in flown.values() for row in rows]) if flown else None,
        "turn_reversals_per_min": sum(map(changes, turns)) / minutes if flown else None,
        "reassignments_per_uav_min": sum(map(changes, groups)) / in_group if in_group else None,
    }


def minima(record):
    """Returns the minimum distances of UAVs, whether they are enforced or not."""
    return record.scenario.get("separation") or {"horizontal_min_m": 50.0, "vertical_min_m": 30.0}


def height_apart(one, other):
    """Returns the vertical distance of two UAVs: by flown altitudes, or by commanded ones; 0 if they are unknown."""
    for altitudes in [(one.altitude_m, other.altitude_m), (one.commanded_altitude_m, other.commanded_altitude_m)]:
        if None not in altitudes:
            return abs(altitudes[0] - altitudes[1])
    return 0.0


def flown_paths(record):
    """Returns for each time step but the first the path of each UAV from the step before: positions and altitudes at
    equal times. (1) is integrated from the recorded state and command by Simpson's rule."""
    uavs, period, parts = record.scenario["uavs"], record.period, 100
    t = np.linspace(0.0, period, 2 * parts + 1)
    speed_left, turn_left = np.exp(-t / uavs["speed_lag_s"]), np.exp(-t / uavs["turn_rate_lag_s"])
    share = np.linspace(0.0, 1.0, parts + 1)
    paths = {}
    for before, time in zip(record.times, record.times[1:]):
        paths[time] = {}
        for uav, row in record.uavs[time].items():
            start = record.uavs[before][uav]
            if uavs["integrator"] == "euler":
                places = start.position + share[:, None] * (row.position - start.position)
            else:
                turn, command = start.turn_rate_rad_s, start.turn_rate_command_rad_s
                heading = start.heading_rad + command * t + (turn - command) * uavs["turn_rate_lag_s"] * (1.0 - turn_left)
                speed = start.speed_command_m_s + (start.speed_m_s - start.speed_command_m_s) * speed_left
                rates = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
                steps = period / parts / 6.0 * (rates[:-2:2] + 4.0 * rates[1::2] + rates[2::2])
                places = start.position + np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
            altitudes = None
            if None not in (start.altitude_m, row.altitude_m):
                low, rise = start.altitude_m, row.altitude_m - start.altitude_m
                first, last = (period * at.climb_rate_m_s for at in [start, row])
                altitudes = low + share * first + share**2 * (3.0 * rise - 2.0 * first - last) + share**3 * (first + last - 2.0 * rise)
            paths[time][uav] = places, altitudes
    return paths


def least_distances(record, paths, before, time, one, other):
    """Returns the smallest distance of two UAVs along their paths, and that below the minimum vertical distance."""
    vertical_m = minima(record)["vertical_min_m"]
    (places, altitudes), (others, other_altitudes) = paths[time][one], paths[time][other]
    apart = places - others
    along = np.diff(apart, axis=0)
    shares = np.clip(-np.sum(apart[:-1] * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
    distances = np.hypot(*(apart[:-1] + shares[:, None] * along).T)
    if altitudes is None or other_altitudes is None:
        is_level = np.full(len(distances), height_apart(record.uavs[before][one], record.uavs[before][other]) < vertical_m)
    else:
        near = np.abs(altitudes - other_altitudes) < vertical_m
        is_level = near[:-1] & near[1:]
    return distances.min(), distances[is_level].min(initial=np.inf)


def separation_metrics(record):
    """Returns the number of times at which two UAVs come closer than both minima, and the total time of avoidance."""
    least = minima(record)
    near, times, avoiding, pairs, paths = set(), 0, 0, False, flown_paths(record)
    for before, time in zip([None, *record.times], record.times):
        uavs = list(record.uavs[time].values())
        avoiding += sum(row.avoided_uav is not None or row.avoided_intruder is not None for row in uavs)
        now, met = set(), set()
        for one, other in combinations(uavs, 2):
            pairs = True
            if before is not None:
                _, level = least_distances(record, paths, before, time, one.uav, other.uav)
                if level < least["horizontal_min_m"]:
                    met.add((one.uav, other.uav))
            distance = np.hypot(*(one.position - other.position))
            if distance < least["horizontal_min_m"] and height_apart(one, other) < least["vertical_min_m"]:
                now.add((one.uav, other.uav))
        times, near = times + len((now | met) - near), now
    return {"separation_violations": times, "avoidance_time_s": avoiding * record.period} if pairs else {}


class Outline:
    """A zone, evaluated by angles and straight lines."""

    def __init__(self, zone):
        self.corners, self.is_keep_out = np.array(zone["vertices"], float), zone["kind"] == "keep-out"
        self.floor, self.ceiling = zone.get("altitude_min_m", -np.inf), zone.get("altitude_max_m", np.inf)

    def binds(self, low, high):
        """Returns true if the zone binds a UAV that flies between two altitudes."""
        return not self.is_keep_out or (low <= self.ceiling and high >= self.floor)

    def forbids_at(self, at, altitude):
        """Returns true if the zone forbids a position at an altitude."""
        is_in_band = self.floor <= altitude <= self.ceiling
        return self.forbids(at) and is_in_band if self.is_keep_out else self.forbids(at) or not is_in_band

    def forbids(self, at):
        """Returns true if the zone forbids a position. The outline winds around positions inside it."""
        towards = np.arctan2(*(self.corners - at).T[::-1])
        around = np.sum(wrap(np.diff(towards, append=towards[0])))
        return (abs(around) > np.pi) == self.is_keep_out

    def crossed(self, start, end):
        """Returns true if a segment and a side of the outline intersect."""
        sides = np.roll(self.corners, -1, axis=0) - self.corners
        for corner, side in zip(self.corners, sides):
            system = np.column_stack([end - start, -side])
            if abs(np.linalg.det(system)) > 1e-12:
                shares = np.linalg.solve(system, corner - start)
                if np.all((0.0 <= shares) & (shares <= 1.0)):
                    return True
        return False


def altitude_of(row):
    """Returns the simulated altitude, or else the commanded one. Scenarios with floors and ceilings have one of them."""
    altitudes = [altitude for altitude in [row.altitude_m, row.commanded_altitude_m] if altitude is not None]
    return altitudes[0] if altitudes else 0.0


def zone_metrics(record):
    """Returns the number of zone violations, including those on the paths between time steps, and the fraction of time steps at which a
    zone changes the command."""
    outlines = [Outline(zone) for zone in record.scenario.get("geofence", [])]
    if not outlines:
        return {}
    rows = [row for uavs in record.uavs.values() for row in uavs.values()]
    places, times, paths = defaultdict(list), 0, flown_paths(record)
    for row in rows:
        places[row.uav].append((row.position, altitude_of(row)))
    for uav, flown in places.items():
        arcs = [paths[time][uav][0][::10] for time in record.times[1:]]
        for outline in outlines:
            forbidden = [outline.forbids_at(*at) for at in flown]
            crossed = [any(outline.crossed(a, b) for a, b in zip(arc, arc[1:])) and outline.binds(*sorted([low, high]))
                       for arc, (_, low), (_, high) in zip(arcs, flown, flown[1:])]
            times += forbidden[0] + sum(not was and (now or met) for was, now, met in
                                        zip(forbidden, forbidden[1:], crossed))
    return {"zone_violations": times, "geofence_detour_fraction": np.mean([row.limiting_zone is not None for row in rows])}


def custody_metrics(record):
    """Returns the metrics of custody losses. A loss is the number of time steps until custody is regained, or None."""
    courses, losses = defaultdict(str), []
    for time in record.times:
        for target in record.truth[time]:
            seen, member = is_seen(record, time, target), is_member(record, time, target)
            courses[target] += "w" if seen and member else "k" if seen or member else "l"
    for course in courses.values():
        # The time step of the cue does not count. A span lasts from custody to the next custody, or to the end.
        spans = course[1:].split("w")[1:]
        for last, span in zip([False] * (len(spans) - 1) + [True], spans):
            if "l" in span:
                losses.append(None if last else len(span) - span.index("l"))
    found = [steps for steps in losses if steps is not None]
    return {
        "reacquired_fraction": len(found) / len(losses) if losses else None,
        "reacquisition_time_s": np.mean(found) * record.period if found else None,
    }


def bound_metrics(record):
    """Returns the posterior Cramer-Rao bound of group members (the covariance of a Kalman filter that linearises at the true
    positions) and their squared errors."""
    scenario = record.scenario
    model, sensor, cue = scenario.get("targets"), scenario["sensor"], scenario["cue"]
    if model is None or model.get("manoeuvre") or 0.0 in [sensor["range_sd_m"], sensor["bearing_sd_deg"]]:
        return {}
    f, q = equations_5_6(model, record.period)
    sds = [cue["position_sd_m"], cue["velocity_sd_m_s"], model["acceleration_sd_m_s2"]] * 2
    bounds, samples = {}, defaultdict(list)
    for time in record.times:
        looks = looks_by_target(record, time)
        for target, truth in record.truth[time].items():
            p = f @ bounds[target] @ f.T + q if target in bounds else np.diag(np.square(sds))
            h, r, _ = stacked(looks[target], truth.position, sensor)
            p = p - p @ h.T @ inverse(h @ p @ h.T + r) @ h @ p
            bounds[target] = p
            track = record.tracks[time].get(target)
            if track is not None and track.group is not None:
                samples["position_squared_error_m2"].append(np.sum((track.position - truth.position) ** 2))
                samples["velocity_squared_error_m2_s2"].append(np.sum((track.velocity - truth.velocity) ** 2))
                samples["position_crlb_m2"].append(np.trace(p[np.ix_(POSITION, POSITION)]))
                samples["velocity_crlb_m2_s2"].append(np.trace(p[np.ix_(VELOCITY, VELOCITY)]))
    means = {name: np.mean(values) for name, values in samples.items()}
    for what, unit in [("position", "m2"), ("velocity", "m2_s2")] if means else []:
        means[f"{what}_crlb_ratio"] = np.sqrt(means[f"{what}_squared_error_{unit}"] / means[f"{what}_crlb_{unit}"])
    return means


def innovation_metrics(record):
    """Returns the normalised innovation squared of the recorded tracks, with all measurements of a target at a time step
    stacked."""
    model = record.scenario["filter"]
    f, q = equations_5_6(model, record.period)
    squares, numbers = 0.0, 0
    for before, time in zip(record.times, record.times[1:]):
        for target, looks in looks_by_target(record, time).items():
            row = record.tracks[before].get(target)
            if row is not None:
                h, r, nu = stacked(looks, (f @ row.state)[POSITION], model)
                squares += nu @ inverse(h @ (f @ row.p @ f.T + q) @ h.T + r) @ nu
                numbers += len(nu)
    return {"nis": squares / numbers} if numbers else {}


def prediction_error_metrics(record):
    """Returns the one-step prediction errors of the orbits, in terms of e = r - r_d."""
    scenario, samples = record.scenario, defaultdict(list)
    f, _ = equations_5_6(scenario["filter"], record.period)

    def off(uav, orbit):
        return np.hypot(*(uav.position - orbit[0])) - orbit[2]

    orbits, moves = true_orbits(record), scenario["orbit"]["time_constant_s"] > 0
    for before, time in zip(record.times, record.times[1:]):
        for group, row in record.groups[time].items() if time / 1e6 >= scenario["transient_s"] else []:
            old, members = record.groups[before].get(group), record.members(time, group)
            states = [f @ track.state for track in record.members(before, group).values()]
            if old is None or set(record.members(before, group)) != set(members) or group not in orbits[time]:
                continue
            predicted = [state[POSITION] for state in states], [state[VELOCITY] for state in states]
            was = orbits[before].get(group, [None])[0]
            true = orbit_about(scenario, *predicted, before=was, dt=record.period)
            limit = np.inf if old.turn_limit_m is None else old.turn_limit_m
            own = old.position, old.velocity, old.standoff_distance_m, old.standoff_rate_m_s, limit
            if moves:
                own = orbit_about(scenario, *predicted, margin=row.margin_m, before=own, dt=record.period)
            else:
                centre = old.position + old.velocity * record.period
                spread = max(np.hypot(*(position - centre)) for position in predicted[0])
                own = centre, None, equation_15(scenario, spread, 0.0, row.margin_m, turn_limit(scenario["uavs"], np.mean(predicted[1], axis=0)))[1]
            for uav in record.uavs[time].values():
                if uav.group == group:
                    true_off = off(uav, orbits[time][group][0]) - off(uav, true)
                    own_off = off(uav, (row.position, None, row.standoff_distance_m)) - off(uav, own)
                    samples["orbit_prediction_error_m_settled"].append(abs(true_off))
                    samples["own_orbit_prediction_error_m_settled"].append(abs(own_off))
    return {name: np.mean(values) for name, values in samples.items()}


def track_samples(record, time, samples):
    for target, truth in record.truth[time].items():
        track = record.tracks[time].get(target)
        covered = track is not None and track.group is not None
        samples["ungrouped_fraction"].append(not covered)
        if track is not None:
            samples["position_error_all_m"].append(np.hypot(*(track.position - truth.position)))
        if covered:
            samples["position_error_m"].append(np.hypot(*(track.position - truth.position)))
            uav_count = sum(uav.group == track.group for uav in looking(record, time))
            if uav_count > 0:
                samples[f"position_error_{'single_uav' if uav_count == 1 else 'multi_uav'}_m"].append(samples["position_error_m"][-1])
            samples["velocity_error_m_s"].append(np.hypot(*(track.velocity - truth.velocity)))
            known = np.flatnonzero(np.isfinite(truth.state))
            if record.filter_acceleration_sd_m_s2 < 1e-6:
                # States that the filter takes as known are not random.
                known = np.sort(POSITION + VELOCITY)
            error = (track.state - truth.state)[known]
            anees = error @ inverse(track.p[np.ix_(known, known)]) @ error / len(known)
            samples["anees"].append(anees)
            if record.manoeuvring:
                samples["anees_manoeuvring" if target in record.manoeuvring else "anees_nonmanoeuvring"].append(anees)


def orbit_samples(record, time, orbits, samples, compare):
    scenario, groups = record.scenario, record.groups[time]
    settled = ["", "_settled"] if time / 1e6 >= scenario["transient_s"] else [""]
    for row in record.uavs[time].values():
        if row.boresight_rad is None:
            continue
        samples["infeasible_fraction"].append(row.group is not None and not groups[row.group].feasible)
        for ending in settled:
            samples["turn_rate_saturated_fraction" + ending].append(row.turn_rate_limited)
    for group, orbit in groups.items():
        uavs = [row.position for row in record.uavs[time].values() if row.group == group]
        flown, instantaneous = orbits[time].get(group, (None, None))

        def off(position, orbit):
            return np.hypot(*(position - orbit[0])) - orbit[2] if orbit else None

        for row in record.uavs[time].values():
            if record.views is not None and row.group == group:
                compare("uavs: standoff error", row.standoff_error_m, off(row.position, flown))
        for uav in uavs:
            own = abs(np.hypot(*(uav - orbit.position)) - orbit.standoff_distance_m)
            samples["standoff_distance_m"].append(orbit.standoff_distance_m)
            for suffix in settled:
                samples[f"standoff_error_own_estimate_m{suffix}"].append(own)
                samples[f"standoff_error_m{suffix}"] += [abs(off(uav, flown))] if flown else []
            if flown and len(settled) > 1:
                samples["standoff_error_unfiltered_m_settled"].append(abs(off(uav, instantaneous)))
        if flown and len(uavs) > 1:
            turn = 180.0 if len(uavs) > 3 else 360.0  # of more than three, only the doubled phases matter
            phases = np.sort([np.degrees(direction(uav - flown[0])) % turn for uav in uavs])
            gaps, desired = np.diff(phases, append=phases[0] + turn), turn / len(uavs)
            if len(uavs) == 2:
                gaps, desired = [min(gaps)], scenario["guidance"]["desired_phase_deg"]
            samples["phase_error_deg"].append(np.mean([abs(gap - desired) for gap in gaps]))


def transit_samples(record, time, orbits, samples, on_orbit):
    """Adds the errors of the UAVs on their orbit, which `on_orbit` keeps: the group whose orbit a UAV has reached."""
    for uav, row in record.uavs[time].items():
        if row.group is None or row.group not in orbits[time]:
            continue
        centre, _, radius, *_ = orbits[time][row.group][0]
        error = abs(np.hypot(*(row.position - centre)) - radius)
        if error <= 0.05 * radius:
            on_orbit[uav] = row.group
        elif on_orbit.get(uav) != row.group:
            on_orbit.pop(uav, None)
        samples["transit_fraction"].append(uav not in on_orbit)
        samples["standoff_error_on_orbit_m"] += [error] if uav in on_orbit else []


def separation_samples(record, paths, before, time, samples):
    """Adds the distances of all pairs of UAVs along their paths, of those that may be at one altitude, and of those of
    one group."""
    vertical_m = minima(record)["vertical_min_m"]
    for one, other in combinations(record.uavs[time], 2):
        rows = [record.uavs[at][uav] for at in [before, time] if at is not None for uav in [one, other]]
        distance = np.hypot(*(rows[-2].position - rows[-1].position))
        found = [(distance, distance if height_apart(*rows[-2:]) < vertical_m else np.inf, rows[-2:])]
        if before is not None:
            found.append((*least_distances(record, paths, before, time, one, other), rows[:2]))
        for distance, level, pair in found:
            samples["separation_min_m"].append(distance)
            if level < np.inf:
                samples["separation_min_same_altitude_m"].append(level)
            if pair[0].group is not None and pair[0].group == pair[1].group:
                samples["separation_min_same_group_m"].append(distance)


def line_of_sight_samples(record, time, samples):
    truth = record.truth[time]
    for row in looking(record, time):
        assigned_members = record.assigned_members(time, row.group) if row.group is not None else []
        azimuths = [direction(truth[target].position - row.position) for target in assigned_members if target in truth]
        if azimuths:
            samples["off_boresight_mean_deg"].append(np.degrees(max(abs(wrap(np.array(azimuths) - row.boresight_rad)))))


def view_samples(record, time, samples):
    """Returns the group members that no UAV has in view."""
    assigned_members = [target for target in record.truth[time] if is_member(record, time, target)]
    out = [target for target in assigned_members if not is_seen(record, time, target)]
    samples["member_out_of_view_fraction"] += [target in out for target in assigned_members]
    return out


def looking(record, time):
    """Returns the UAVs that point their sensors."""
    return [row for row in record.uavs[time].values() if row.boresight_rad is not None]


def is_seen(record, time, target):
    """Returns true if an existing target is in some UAV's view."""
    there = record.truth[time][target]
    return any(in_view(record.scenario["sensor"], row, there) and not is_hidden(record.walls, row, there)
               for row in looking(record, time))


def is_member(record, time, target):
    track = record.tracks[time].get(target)
    return track is not None and track.group is not None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], __doc__, [
        check_kinematics, check_target_model, check_tracks, check_groups, check_guidance, check_measurements,
        check_avoidance, check_metrics]))
