"""Recomputing a flight with `standoff.components` gives bit-identical results."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import standoff
from standoff import components

Floats = NDArray[np.float64]
STATE = ["x_m", "vx_m_s", "ax_m_s2", "y_m", "vy_m_s", "ay_m_s2"]
LETTERS = ["x", "vx", "ax", "y", "vy", "ay"]


def stacked(table: standoff.Table, *columns: str) -> Floats:
    return np.stack([table.to_numpy(column) for column in columns], axis=-1).astype(float)


def parameters(run: standoff.Run) -> components.Parameters:
    return components.Parameters(run.dir / "scenario.toml")


def test_recomputed_orbits_and_headings_are_bit_identical() -> None:
    run = standoff.run("paper/table-2-pair", seed=3)
    uavs, groups, of = run.uavs, run.groups, parameters(run)
    # Both UAVs are assigned to the only group at every time step.
    column: Any = {name: uavs.to_numpy(name).astype(float) for name in uavs.columns if name != "uav"}
    twice = {name: np.repeat(groups.to_numpy(name).astype(float), 2) for name in groups.columns}
    assert np.array_equal(column["time_s"], twice["time_s"]) and len(column["time_s"]) > 300
    distance = components.standoff_distance(twice["spread_m"], margin_m=twice["margin_m"], parameters=of)
    assert np.array_equal(distance.distance_m, twice["standoff_distance_m"])
    assert np.array_equal(distance.unclamped_m, twice["standoff_unclamped_m"])
    led_m, led_rate_m_s = components.steered_radius(
        twice["standoff_distance_m"], twice["standoff_rate_m_s"], parameters=of
    )
    assert np.array_equal(led_m, column["steered_radius_m"])
    steering = components.steer(
        stacked(uavs, "x_m", "y_m"),
        column["heading_rad"],
        np.stack([twice["x_m"], twice["y_m"]], axis=-1),
        distance_m=twice["standoff_distance_m"],
        rate_m_s=twice["standoff_rate_m_s"],
        steered_radius_m=led_m,
        steered_rate_m_s=led_rate_m_s,
        centre_velocity_m_s=np.stack([twice["vx_m_s"], twice["vy_m_s"]], axis=-1),
        speed_m_s=column["speed_command_m_s"],
        uav_speed_m_s=column["speed_m_s"],
        turn_rate_rad_s=column["turn_rate_rad_s"],
        parameters=of,
    )
    for name in ("desired_heading_rad", "feedforward_rad_s", "centre_distance_m", "phase_rad"):
        assert np.array_equal(getattr(steering, name), column[name]), name
    limit_rad_s = standoff.Scenario("paper/table-2-pair").to_dict()["uavs"]["turn_rate_max_rad_s"]
    clipped = np.clip(steering.turn_rate_rad_s, -limit_rad_s, limit_rad_s)
    assert np.array_equal(clipped, column["turn_rate_command_rad_s"])


def test_recomputed_tracks_are_bit_identical() -> None:
    run = standoff.run("paper/table-2-pair", seed=3)
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
        estimate = components.Filter(states[before], covariances[before], parameters=parameters(run))
        estimate.predict((now_us - before_us) / 1e6)
        measured = np.full((2, len(tracked), 2), np.nan)
        at = np.flatnonzero(detected_us == now_us)
        index = np.searchsorted(tracked, detected_target[at])
        measured[0, index, detecting_uav[at]] = detections.to_numpy("range_m")[at]
        measured[1, index, detecting_uav[at]] = detections.to_numpy("bearing_rad")[at]
        estimate.update(positions_m[uav_times_us == now_us], *measured, mask=~np.isnan(measured[0]))
        assert np.array_equal(estimate.state, states[now])
        assert np.array_equal(estimate.covariance, covariances[now])
