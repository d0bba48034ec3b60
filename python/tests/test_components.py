"""Arguments of the library's components and their errors. test_flown.py compares their results with those of flights."""

from __future__ import annotations

import doctest
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from standoff import InputError, components

CENTRE = [0.0, 0.0, 3.0, -2.0]


def some_filter(n: int = 3) -> components.Filter:
    state = np.random.default_rng(7).uniform(-300, 300, (n, 6)) * [1, 0.03, 0, 1, 0.03, 0]
    return components.Filter(state, np.diag([400, 9, 0.04] * 2))


def test_the_doctest_passes() -> None:
    assert doctest.testmod(components) == (0, 6)


def test_several_items_equal_single_items() -> None:
    rng = np.random.default_rng(7)
    state = rng.uniform([-900, -900, -9, 30, -0.3], [900, 900, 9, 50, 0.3], (20, 5))
    radius_m, rate_m_s, speed_m_s = rng.uniform(250, 700, 20), rng.uniform(-9, 9, 20), rng.uniform(30, 50, 20)
    together = components.steer(state, CENTRE, radius_m, rate_m_s=rate_m_s, speed_m_s=speed_m_s)
    distances = components.standoff_distance(radius_m - 250, spread_rate_m_s=rate_m_s, margin_m=30)
    filters = some_filter(20)
    single = [components.Filter(*both) for both in zip(filters.state, filters.covariance, strict=True)]
    assert filters.update([800, 0], radius_m, rate_m_s).all()
    for i in range(20):
        alone = components.steer(state[i], CENTRE, radius_m[i], rate_m_s=rate_m_s[i], speed_m_s=speed_m_s[i])
        for name in ("turn_rate_rad_s", "desired_heading_rad", "feedforward_rad_s", "centre_too_fast"):
            assert getattr(together, name)[i] == getattr(alone, name) and getattr(alone, name).shape == ()
        distance = components.standoff_distance(radius_m[i] - 250, spread_rate_m_s=rate_m_s[i], margin_m=30)
        for name in ("distance_m", "rate_m_s", "unclamped_m"):
            assert getattr(distances, name)[i] == getattr(distance, name)
        single[i].update([800, 0], radius_m[[i]], rate_m_s[[i]])
        assert np.array_equal(single[i].state[0], filters.state[i])


def test_a_measurement_that_is_missing_changes_nothing() -> None:
    fused, apart, nan = some_filter(2), some_filter(2), np.nan
    assert fused.update([[500, 40], [0, 900]], [[400, nan], [nan, nan]], [[3.0, 3.0], [3.0, nan]]).tolist() == [True, False]
    assert apart.update([500, 40], [400, 1], [3, nan]).tolist() == [True, False]
    assert np.array_equal(fused.state, apart.state) and np.array_equal(fused.covariance, apart.covariance)
    assert np.array_equal(fused.position_m, fused.state[:, [0, 3]])


def test_a_measurement_that_makes_the_covariance_invalid_is_ignored() -> None:
    """Covariances of rank one except for rounding: after the update they may not be positive definite."""
    rng, refused = np.random.default_rng(7), 0
    for _ in range(300):
        along = rng.normal(size=6) * [1e4, 1e2, 1e1, 1e4, 1e2, 1e1]
        try:
            filter_ = components.Filter(np.zeros(6), np.outer(along, along) + 3e-16 * np.diag(along**2))
        except InputError:
            continue
        before = filter_.covariance
        if not filter_.update([500, 0], [490], [np.pi])[0]:
            refused += 1
            assert not filter_.state.any() and np.array_equal(filter_.covariance, before)
        assert np.isfinite(filter_.state).all()
    assert refused > 0


def test_a_centre_faster_than_the_uav_gives_a_finite_turn_rate() -> None:
    chased = components.steer([500, 0, 1, 40, 0], [0, 0, -60, 0], 400)
    assert bool(chased.centre_too_fast) and np.isfinite(chased.turn_rate_rad_s)


def test_any_strides_types_and_lists_are_accepted() -> None:
    spread_m = np.array([10.0, 150.0, 400.0])
    for given in ([10, 150, 400], spread_m.astype(">i4"), spread_m.astype("f4"), np.repeat(spread_m, 2)[::2]):
        np.testing.assert_allclose(components.standoff_distance(given).distance_m, [250, 300, 700])
    columns = np.asfortranarray([[380, 60, 1.5, 40, 0], [80, -240, 0, 40, 0]])
    turned = components.steer(columns, CENTRE, 300).turn_rate_rad_s
    assert np.array_equal(turned, components.steer(columns.tolist(), CENTRE, 300).turn_rate_rad_s)
    assert components.standoff_distance([]).distance_m.shape == (0,)


SPREAD = components.standoff_distance
EYE = np.eye(6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SPREAD("far"), "^spread_m is of type <U3: must be real numbers$"),
        (lambda: SPREAD([1 + 1j]), "^spread_m is of type complex128: must be real numbers$"),
        (lambda: SPREAD([[1, 2], [3]]), "^spread_m is not an array of real numbers: .*inhomogeneous"),
        (lambda: SPREAD(np.ma.masked_array([1.0])), "^spread_m is a masked array: must be an ordinary array$"),
        (lambda: SPREAD([[1]]), r"^spread_m has the shape \(1, 1\): must be \(n,\), or \(\) for all n$"),
        (lambda: SPREAD([3, -1]), r"^spread_m\[1\] = -1: must be at least 0 and at most 1000000000$"),
        (lambda: SPREAD([1, 2], margin_m=[1, 2, 3]), "^margin_m has 3 rows, but spread_m has 2: must be equal$"),
        (lambda: components.steer([0, 0, 0, 40], CENTRE, 300), r"\(4,\): must be \(n, 5\), or \(5,\) for all n$"),
        (lambda: components.steer([[0, 0, 0, np.inf, 0]], CENTRE, 300), r"^uav_state\[0, 3\] = inf: must be at least"),
        (lambda: components.steer([0, 0, 0, 40, 0], CENTRE, 0), "^distance_m = 0: must be at least 0.001"),
        (lambda: components.Filter(np.zeros((2, 6)), [EYE, -EYE]), "^covariance of target 1: must be positive definite$"),
        (lambda: components.Filter(np.zeros((2, 6)), np.zeros((3, 6, 6))), "^covariance has 3 rows, but state has 2"),
    ],
)
def test_an_error_names_the_argument_and_what_is_allowed(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()


def test_a_filter_is_unchanged_after_an_error() -> None:
    filter_ = some_filter()
    before = filter_.state
    bad: list[tuple[Callable[[], Any], str]] = [
        (lambda: filter_.update([0, 0], [1, 2], [0, 0]), r"range_m.*\(2,\): must be \(3,\), for the targets of one UAV"),
        (lambda: filter_.update([[0, 0]] * 2, [1, 2, 3], 0), r"must be \(3, 2\), for targets and UAVs"),
        (lambda: filter_.update([0, 0], [1, -2, 2], [0, 0, 0]), r"range_m\[1\] = -2: must be above 0.*, or NaN if there"),
        (lambda: filter_.update([0, 0], [1, 2, 2], [0, 0, np.inf]), r"bearing_rad\[2\] = inf: must be a finite number"),
        (lambda: filter_.predict(-1.0), "dt_s = -1: must be at least 0 and at most 3600"),
    ]
    for call, message in bad:
        with pytest.raises(InputError, match=message):
            call()
    assert np.array_equal(filter_.state, before)
    huge = components.Filter(np.zeros((2, 6)), [EYE, EYE * 1e307])
    with pytest.raises(InputError, match="target 1 has become too uncertain"):
        huge.predict(3600)
    assert np.array_equal(huge.covariance[0], EYE)
