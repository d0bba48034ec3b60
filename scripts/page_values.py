#!/usr/bin/env python3
"""Compute from a record the values that its page must show.

Usage: page_values.py <record folder> > values.json

Writes {"times_s": [...], "names": [...], "events": [...]} and, by table ("run", "uavs", "groups", "targets", and
"intruders" if the record has any), id and column, one value for every time step; null for missing values. Columns have
the names and units of the record. Columns that the record does not contain are recomputed with check_equations.py, as
docs/user/metrics.md defines them. If the record has tentative tracks, "detections", "tentative" and "truth" have the list of
rows of each time step. With per-UAV team states, "agents" has the team state of each agent at every time step, and
"agent_events" the number of events that each agent publishes, and of those that are no part of a team state. Needs
requirements.txt.
"""

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from check_equations import POSITION, Record, direction, equation_15, equations_5_6, in_view, inverse, jacobian
from check_equations import looking, looks_by_target, stacked, true_centre, turn_limit, wrap

TARGETS = ["status", "membership", "group", "receiving_group"]


def main(arguments):
    if len(arguments) != 1:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    record = Record(Path(arguments[0]))
    times, bounds = record.times, bounds_by_time(record)
    page = {
        "times_s": [time / 1e6 for time in times],
        "names": [row.name for row in sorted(record.rows("targets"), key=lambda row: row.target)],
        "events": [vars(event) for time in sorted(record.events) for event in record.events[time]],
        "run": columns(times, lambda time: {0: run_values(record, time)}),
        "uavs": columns(times, lambda time: {uav: uav_values(record, time, row) for uav, row in record.uavs[time].items()}),
        "groups": columns(times, lambda time: {
            group: group_values(record, time, row, bounds) for group, row in record.groups[time].items()}),
        "targets": columns(times, lambda time: target_values(record, time)),
    }
    if (record.folder / "intruders.parquet").exists():
        intruders = record.by_time("intruders", "intruder")
        page["intruders"] = columns(times, lambda time: {
            intruder: recorded(row) for intruder, row in intruders[time].items()})
    if (record.folder / "tentative.parquet").exists():
        page |= {table: lists(record, table) for table in ("detections", "tentative", "truth")}
    if (record.folder / "agents.parquet").exists():
        page |= {"agents": [agents(record, time) for time in times], "agent_events": agent_events(record)}
    json.dump(page, sys.stdout, default=lambda number: number.item(), allow_nan=False)
    return 0


def lists(record, table):
    """Returns the rows of a table at every time step, in the order of the record."""
    found = {time: [] for time in record.times}
    for row in record.rows(table):
        found[row.time_us].append({name: None if value != value else value for name, value in vars(row).items()})
    return list(found.values())


def columns(times, rows):
    """Returns {id: {column: values over time}} from a function that returns {id: {column: value}} at a time."""
    found = {}
    for index, time in enumerate(times):
        for key, row in rows(time).items():
            for column, value in row.items():
                found.setdefault(key, {}).setdefault(column, [None] * len(times))[index] = value
    return found


def recorded(row):
    """Returns the columns of the record in a row."""
    return {name: value for name, value in vars(row).items() if not isinstance(value, np.ndarray)}


def agent_events(record):
    """Returns the number of events of each agent, and of those that are no part of a team state."""
    own, first = Counter(), {}
    for row in record.rows("agents"):
        first[row.time_us] = min(row.agent, first.get(row.time_us, row.agent))
    outside = sum(map(len, record.events.values()))
    for row in record.rows("agent_events"):
        own[row.agent] += 1
        outside -= row.agent == first[row.time_us]
    return {agent: count + outside for agent, count in own.items()}


def agents(record, time):
    """Returns {agent: its team state at a time}, for agents whose computer is on."""
    if not hasattr(record, "agents"):
        tables = {"all": ("agents",), "team": ("agent_teammates", "uav"), "tracks": ("agent_tracks", "target"), "groups": ("agent_groups", "group")}
        record.agents = {name: record.by_time(table, "agent", *key) for name, (table, *key) in tables.items()}
    found = {}
    for agent in record.agents["all"][time]:
        own = {name: {ids[1]: row for ids, row in record.agents[name][time].items() if ids[0] == agent}
               for name in ["team", "tracks", "groups"]}
        team = {uav: {"status": row.status, "group": row.group, "group_id": None if row.group_id is None else str(int(row.group_id)),
                      "age_s": None if row.last_report_us is None else (time - row.last_report_us) / 1e6} for uav, row in own["team"].items()}
        truth = record.truth[time]
        tracks = {target: {"group": row.group, "position_error_m": error(row, truth[target]) if target in truth else None}
                  for target, row in own["tracks"].items()}
        found[agent] = {"team": team, "tracks": tracks, "groups": {group: {"members": row.members} for group, row in own["groups"].items()}}
    return found


def error(row, truth):
    return np.hypot(row.x_m - truth.x_m, row.y_m - truth.y_m)


def uav_values(record, time, row):
    values = recorded(row) | {"off_boresight_rad": None, "standoff_error_m": None}
    if row.group is None:
        return values
    truth = record.truth[time]
    assigned_members = [truth[target].position for target in record.assigned_members(time, row.group) if target in truth]
    if assigned_members and row.boresight_rad is not None:
        values["off_boresight_rad"] = max(abs(wrap(direction(at - row.position) - row.boresight_rad)) for at in assigned_members)
    members = true_members(record, time, row.group)
    if members:
        centre = true_centre(record.scenario, members)
        spread = max(np.hypot(*(member - centre)) for member in members)
        velocity = np.mean([truth[target].velocity for target in record.members(time, row.group) if target in truth], axis=0)
        radius = equation_15(record.scenario, spread, 0.0, 0.0, turn_limit(record.scenario["uavs"], velocity))[1]
        values["standoff_error_m"] = np.hypot(*(row.position - centre)) - radius
    return values


def group_values(record, time, row, bounds):
    values = recorded(row)
    uavs = [uav for uav in record.uavs[time].values() if uav.group == row.group]
    phase, desired = phase_difference(record, [uav.phase_rad for uav in uavs])
    errors, variances = [], []
    for target in record.assigned_members(time, row.group):
        if target in record.truth[time]:
            error = record.tracks[time][target].position - record.truth[time][target].position
            errors.append(error @ error)
            variances.append(bounds[time].get(target, np.nan))
    bound = np.sqrt(np.mean(variances)) if variances else np.nan
    return values | {
        "phase_rad": phase,
        "desired_phase_rad": desired,
        "position_error_m": np.sqrt(np.mean(errors)) if errors else None,
        "position_crlb_m": None if np.isnan(bound) else bound,
        "scan_sd_m": scan_sd(record, true_members(record, time, row.group), uavs),
    }


def true_members(record, time, group):
    truth = record.truth[time]
    return [truth[target].position for target in record.members(time, group) if target in truth]


def phase_difference(record, phases):
    """Returns the phase difference on one orbit with the largest error, and the desired one."""
    if len(phases) < 2 or None in phases:
        return None, None
    if len(phases) == 2:
        return abs(wrap(phases[1] - phases[0])), np.radians(record.scenario["guidance"]["desired_phase_deg"])
    phases, desired = np.sort(phases), 2.0 * np.pi / len(phases)
    return max(np.diff(phases, append=phases[0] + 2.0 * np.pi), key=lambda gap: abs(gap - desired)), desired


def scan_sd(record, members, uavs):
    """Returns the geometric mean of the semi-axes of the error ellipse of a target at the true centre, after one scan by
    each UAV."""
    sensor = record.scenario["sensor"]
    if not members or not uavs or 0.0 in [sensor["range_sd_m"], sensor["bearing_sd_deg"]]:
        return None
    r = np.diag([sensor["range_sd_m"] ** 2, np.radians(sensor["bearing_sd_deg"]) ** 2])
    looks = [jacobian(uav.position, true_centre(record.scenario, members))[:, POSITION] for uav in uavs]
    return np.linalg.det(sum(h.T @ inverse(r) @ h for h in looks)) ** -0.25


def bounds_by_time(record):
    """Returns the position variance at the Cramer-Rao bound by time and target; see check_equations.bound_metrics."""
    model, sensor, cue = record.scenario.get("targets"), record.scenario["sensor"], record.scenario["cue"]
    if model is None or model.get("manoeuvre") or 0.0 in [sensor["range_sd_m"], sensor["bearing_sd_deg"]]:
        return dict.fromkeys(record.times, {})
    f, q = equations_5_6(model, record.period)
    sds = [cue["position_sd_m"], cue["velocity_sd_m_s"], model["acceleration_sd_m_s2"]] * 2
    covariances, found = {}, {}
    for time in record.times:
        looks = looks_by_target(record, time)
        for target, truth in record.truth[time].items():
            p = f @ covariances[target] @ f.T + q if target in covariances else np.diag(np.square(sds))
            h, r, _ = stacked(looks[target], truth.position, sensor)
            covariances[target] = p - p @ h.T @ inverse(h @ p @ h.T + r) @ h @ p
        found[time] = {target: np.trace(p[np.ix_(POSITION, POSITION)]) for target, p in covariances.items()}
    return found


def views(record):
    """Returns {time: {existing target: (UAVs that have it in view, time steps since one had)}}. The first time step of a target
    does not count."""
    if not hasattr(record, "seen"):
        steps, record.seen, sensor = {}, {}, record.scenario["sensor"]
        for time in record.times:
            pointed, found = looking(record, time), {}
            for target, there in record.truth[time].items():
                seen_by = [uav.uav for uav in pointed if in_view(sensor, uav, there)]
                steps[target] = 0 if seen_by or target not in steps else steps[target] + 1
                found[target] = seen_by, steps[target]
            record.seen[time] = found
    return record.seen


def target_values(record, time):
    truth, tracks = record.truth[time], record.tracks[time]
    after_cue = any(record.truth[before] for before in record.times if before < time)
    detections = Counter(target for _, target in record.detections[time])
    found = {}
    for target in truth.keys() | tracks.keys():
        there, track = truth.get(target), tracks.get(target)
        values = {name: getattr(track, name, None) for name in TARGETS}
        both = there is not None and track is not None
        seen_by, steps = views(record)[time].get(target, (None, None))
        found[target] = values | {
            "exists": there is not None,
            **place(there, "true_x_m", "true_y_m"),
            **place(track, "x_m", "y_m"),
            "detections": detections[target],
            "in_view": bool(seen_by) if there is not None and after_cue else None,
            "seen_by": seen_by if after_cue else None,
            "out_of_view_s": None if steps is None else steps * record.period,
            "error_m": np.hypot(*(track.position - there.position)) if both else None,
        }
    return found


def place(row, x_m, y_m):
    """Returns the position of a row under these names."""
    return dict(zip((x_m, y_m), row.position)) if row is not None else {x_m: None, y_m: None}


def run_values(record, time):
    """Returns the number of existing targets, of those with a track, in custody and in view, and their position error."""
    there = [row for row in target_values(record, time).values() if row["exists"]]
    tracked = [row for row in there if row["error_m"] is not None]
    is_after_cue = any(record.truth[before] for before in record.times if before < time)
    return {
        "targets": len(there),
        "tracked": len(tracked),
        "in_custody": sum(row["in_view"] and row["group"] is not None for row in tracked) if is_after_cue else None,
        "in_view": sum(bool(row["in_view"]) for row in there) if is_after_cue else None,
        "position_error_m": np.sqrt(np.mean([row["error_m"] ** 2 for row in tracked])) if tracked else None,
    }


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
