#!/usr/bin/env python3
"""Recompute the targets of tracks and the metrics of the association from a record, in plain NumPy and SciPy.

Usage: check_association.py <record folder>

Definitions as in docs/user/metrics.md. If tracks have no identity (`track_uid` is not null), their targets are recomputed, too.
Prints one line per quantity. Exits with 1 and a message if one differs. Needs the packages in requirements.txt, and a run
with `--metrics all`.
"""

import json
import sys
import tomllib
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pandas
from scipy.optimize import linear_sum_assignment

PAIR_CUTOFF_M = 30.0
FIRST_TRACK = 2**30


def main(arguments):
    if len(arguments) != 1:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    if (folder / "agents.parquet").exists():
        print(f"{folder}: several agents, whose metrics are averaged: not checked")
        return 0
    tables = {name: by_time(folder / f"{name}.parquet") for name in ["uavs", "truth", "tracks", "detections"]}
    scenario = tomllib.loads((folder / "scenario.toml").read_text(encoding="utf-8"))
    metrics = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["metrics"]
    wrong = [name for name, holds in check(tables, scenario, metrics) if not holds]
    if wrong:
        print(f"{folder}: differ: {', '.join(wrong)}", file=sys.stderr)
    return int(bool(wrong))


def by_time(path):
    table = pandas.read_parquet(path, engine="pyarrow", dtype_backend="pyarrow")
    return {time: rows for time, rows in table.groupby("time_us")}


def check(tables, scenario, metrics):
    """Yields the name of each quantity, and whether it agrees."""
    sensor, cutoff = scenario["sensor"], scenario["gospa_cutoff_m"]
    squared, localisation, missed, false, detected = [], [], [], [], []
    last, swaps, lives, of_targets, before = {}, 0, defaultdict(list), defaultdict(Counter), {}
    wrong_targets = compared = 0
    for time, uavs in tables["uavs"].items():
        truth, tracks = (tables[name].get(time) for name in ["truth", "tracks"])
        ids, at = positions(truth, "target")
        keys, estimates = positions(tracks, "target")
        numbers = [] if tracks is None else tracks["track"].tolist()
        cued = [] if tracks is None else (tracks["status"] == "cued").tolist()
        looking = uavs.dropna(subset=["boresight_rad"])
        if len(looking):
            views = [in_view(uav, at, sensor) for uav in looking.itertuples()]
            estimated_views = [in_view(uav, estimates, sensor) for uav in looking.itertuples()]
            ours, theirs = at[np.any(views, axis=0)], estimates[np.any(estimated_views, axis=0)]
            distances = [d for _, _, d in assigned(ours, theirs, cutoff)]
            localisation.append(sum(d * d for d in distances))
            missed.append(len(ours) - len(distances))
            false.append(len(theirs) - len(distances))
            squared.append(localisation[-1] + 0.5 * cutoff**2 * (missed[-1] + false[-1]))
            rows = tables["detections"].get(time)
            found = set() if rows is None else set(zip(rows["uav"], rows["target"]))
            for uav, view in zip(looking.itertuples(), views):
                detected += [(uav.uav, target) in found for target, seen in zip(ids, view) if seen]
        for number, target, is_cued in zip(numbers, keys, cued):
            exists = target in ids
            lives[number].append(exists)
            if exists:
                if not is_cued:
                    swaps += last.get(number, target) != target
                    last[number] = target
                of_targets[target][number] += 1
        if tracks is not None and tracks["track_uid"].notna().any():
            uids = tracks["track_uid"].tolist()
            now = paired(before, ids, at, uids, estimates)
            expected = [now.get(uid, number) for uid, number in zip(uids, numbers)]
            # The target of a cue is not known.
            before = {uid: now[uid] for uid, is_cued in zip(uids, cued) if uid in now and not is_cued}
            wrong_targets += sum(ours != theirs for ours, theirs in zip(expected, keys))
            compared += len(keys)
    print(f"targets of tracks: {wrong_targets} of {compared} differ")
    yield "targets of tracks", wrong_targets == 0
    false_tracks = sum(np.mean(life) < 0.1 for life in lives.values())
    main_steps = sum(max(tracks.values()) for tracks in of_targets.values())
    expected = {
        "gospa_m": np.sqrt(np.mean(squared)),
        "gospa_localisation_m": np.sqrt(np.mean(localisation)),
        "gospa_missed": np.mean(missed),
        "gospa_false": np.mean(false),
        "track_swaps": swaps,
        "false_tracks": false_tracks,
        "track_purity": main_steps / sum(sum(tracks.values()) for tracks in of_targets.values()),
        "detected_fraction": np.mean(detected),
    }
    for name, value in expected.items():
        difference = abs(value - metrics[name]) / max(1.0, abs(value))
        print(f"{name}: {metrics[name]:.6g}, difference {difference:.1e}")
        yield name, difference < 1e-9


def positions(rows, key):
    """Returns the keys of rows and their positions."""
    if rows is None:
        return [], np.zeros((0, 2))
    return rows[key].tolist(), rows[["x_m", "y_m"]].to_numpy(dtype=float)


def in_view(uav, at, sensor):
    """Returns which positions are in view of a UAV."""
    x, y = at[:, 0] - uav.x_m, at[:, 1] - uav.y_m
    off = (np.arctan2(y, x) - uav.boresight_rad + np.pi) % (2 * np.pi) - np.pi
    return (np.hypot(x, y) <= sensor["sensing_range_m"]) & (np.abs(off) <= np.radians(sensor["field_of_view_deg"]) / 2)


def assigned(one, other, cutoff):
    """Returns the pairs nearer than the cut-off with the smallest sum of squared distances, and their distances."""
    distances = np.hypot(one[:, None, 0] - other[None, :, 0], one[:, None, 1] - other[None, :, 1])
    rows, columns = linear_sum_assignment(np.minimum(distances, cutoff) ** 2)
    return [(i, j, distances[i, j]) for i, j in zip(rows, columns) if distances[i, j] < cutoff]


def paired(before, ids, at, uids, estimates):
    """Returns the target of each track: the previous one if it is still near, otherwise by assignment."""
    now = {}
    for uid, estimate in zip(uids, estimates):
        target = before.get(uid)
        if target in ids and np.hypot(*(at[ids.index(target)] - estimate)) < PAIR_CUTOFF_M:
            now[uid] = target
    targets = [i for i, target in enumerate(ids) if target not in now.values()]
    tracks = [j for j, uid in enumerate(uids) if uid not in now]
    for i, j, _ in assigned(at[targets], estimates[tracks], PAIR_CUTOFF_M):
        now[uids[tracks[j]]] = ids[targets[i]]
    return now


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
