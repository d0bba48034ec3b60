"""Recomputing a flight with `standoff.components` gives bit-identical results."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import standoff
from standoff import components

Floats = NDArray[np.float64]
STATE = ["x_m", "vx_m_s", "ax_m_s2", "y_m", "vy_m_s", "ay_m_s2"]
LETTERS = ["x", "vx", "ax", "y", "vy", "ay"]


def stacked(table: standoff.Table, *columns: str) -> Floats:
    return np.stack([table.to_numpy(column) for column in columns], axis=-1).astype(float)


def mission_of(scenario: standoff.Scenario) -> standoff.MissionInfo:
    """Returns what a law knows of a mission."""
    missions: list[standoff.MissionInfo] = []

    class Watching(standoff.Law):
        def __init__(self, mission: standoff.MissionInfo) -> None:
            super().__init__(mission)
            missions.append(mission)

        def decide(self, observation: standoff.Observation) -> None:
            return None

    standoff.run(scenario, seed=3, law=Watching)
    return missions[0]


# Without lead, or at a bound, the steered radius is the standoff distance.
PAPER = standoff.Scenario("paper/table-2-pair", set={"guidance.lead_s": 0.0})
BOUND = standoff.Scenario("tour/01-one-uav", set={"orbit.radius_min_m": 400.0, "orbit.radius_max_m": 400.0})


@pytest.mark.filterwarnings("ignore:the controller of this run reports no")
@pytest.mark.parametrize("scenario", [PAPER, BOUND], ids=["oh-2015", "standoff"])
def test_recomputed_orbits_and_headings_are_bit_identical(scenario: standoff.Scenario) -> None:
    run, mission = standoff.run(scenario, seed=3), mission_of(scenario)
    uavs, groups = run.uavs, run.groups
    # All UAVs are assigned to the only group at every time step.
    column: Any = {name: uavs.to_numpy(name).astype(float) for name in uavs.columns if name != "uav"}
    each = len(uavs) // len(groups)
    group = {name: np.repeat(groups.to_numpy(name).astype(float), each) for name in groups.columns}
    assert np.array_equal(column["time_s"], group["time_s"]) and len(column["time_s"]) > 200
    distance = components.standoff_distance(group["spread_m"], margin_m=group["margin_m"], mission=mission)
    assert np.array_equal(distance.distance_m, group["standoff_distance_m"])
    assert np.array_equal(distance.unclamped_m, group["standoff_unclamped_m"])
    steering = components.steer(
        stacked(uavs, "x_m", "y_m", "heading_rad", "speed_m_s", "turn_rate_rad_s"),
        np.stack([group[name] for name in ("x_m", "y_m", "vx_m_s", "vy_m_s")], axis=-1),
        distance.distance_m,
        rate_m_s=group["standoff_rate_m_s"],
        speed_m_s=column["speed_command_m_s"],
        mission=mission,
    )
    for name in ("desired_heading_rad", "feedforward_rad_s"):
        assert np.array_equal(getattr(steering, name), column[name]), name
    limit_rad_s = mission.turn_rate_max_rad_s
    clipped = np.clip(steering.turn_rate_rad_s, -limit_rad_s, limit_rad_s)
    assert np.array_equal(clipped, column["turn_rate_command_rad_s"])


@pytest.mark.filterwarnings("ignore:the controller of this run reports no")
def test_recomputed_tracks_are_bit_identical() -> None:
    run, mission = standoff.run(PAPER, seed=3), mission_of(PAPER)
    tracks, uavs, detections = run.tracks, run.uavs, run.detections
    states = stacked(tracks, *STATE)
    covariances = np.zeros((len(states), 6, 6))
    for row, one in enumerate(LETTERS):
        for column, other in enumerate(LETTERS[row:], row):
            covariances[:, row, column] = covariances[:, column, row] = tracks.to_numpy(f"cov_{one}_{other}")
    times_us, targets = tracks.to_numpy("time_us"), tracks.to_numpy("target")
    positions_m, uav_times_us = stacked(uavs, "x_m", "y_m"), uavs.to_numpy("time_us")
    detected_us = detections.to_numpy("time_us")
    detecting_uav, detected_target = detections.to_numpy("uav"), detections.to_numpy("target")
    tracked = np.unique(targets)
    steps_us = np.unique(times_us)
    for before_us, now_us in zip(steps_us[:-1], steps_us[1:], strict=True):
        before, now = times_us == before_us, times_us == now_us
        estimate = components.Filter(states[before], covariances[before], mission=mission)
        estimate.predict((now_us - before_us) / 1e6)
        measured = np.full((2, len(tracked), 2), np.nan)
        at = np.flatnonzero(detected_us == now_us)
        index = np.searchsorted(tracked, detected_target[at])
        measured[0, index, detecting_uav[at]] = detections.to_numpy("range_m")[at]
        measured[1, index, detecting_uav[at]] = detections.to_numpy("bearing_rad")[at]
        estimate.update(positions_m[uav_times_us == now_us], *measured)
        assert np.array_equal(estimate.state, states[now])
        assert np.array_equal(estimate.covariance, covariances[now])
