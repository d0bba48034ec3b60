"""The library's components compared with NumPy and with their own results row by row, and their errors."""

from __future__ import annotations

import doctest
import pickle
import signal
import threading
import time
import tomllib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import standoff
from standoff import InputError, components

Floats = npt.NDArray[np.float64]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def wrapped(angle_rad: Floats) -> Floats:
    return np.asarray(-((-angle_rad + np.pi) % (2 * np.pi) - np.pi))


# Filter.


def singer(alpha: float, sigma: float, dt_s: float) -> tuple[Floats, Floats]:
    """F and Q of one axis (5, 6): Q by quadrature of 2 alpha sigma^2 g g'."""

    def third(t: Floats) -> Floats:
        e = np.exp(-alpha * t)
        return np.array([(e + alpha * t - 1) / alpha**2, (1 - e) / alpha, e])

    f = np.eye(3)
    f[0, 1] = dt_s
    f[:, 2] = third(np.array(dt_s))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    g = third(0.5 * dt_s * (nodes + 1))
    return f, 2 * alpha * sigma**2 * np.einsum("ik,jk,k->ij", g, g, 0.5 * dt_s * weights)


def kalman_step(
    x: Floats, p: Floats, uav: Floats, z: Floats, range_sd_m: float, bearing_sd_rad: float
) -> tuple[Floats, Floats]:
    """The textbook update of an extended Kalman filter with all measurements stacked."""
    rel = x[[0, 3]] - uav
    r = np.hypot(rel[:, 0], rel[:, 1])
    expected = np.stack([r, np.arctan2(rel[:, 1], rel[:, 0])], axis=1)
    h = np.zeros((len(uav), 2, 6))
    h[:, 0, [0, 3]] = rel / r[:, None]
    h[:, 1, [0, 3]] = np.stack([-rel[:, 1], rel[:, 0]], axis=1) / r[:, None] ** 2
    nu = z - expected
    nu[:, 1] = wrapped(nu[:, 1])
    stacked = h.reshape(-1, 6)
    noise = np.diag(np.tile([range_sd_m**2, bearing_sd_rad**2], len(uav)))
    gain = p @ stacked.T @ np.linalg.inv(stacked @ p @ stacked.T + noise)
    return x + gain @ nu.reshape(-1), (np.eye(6) - gain @ stacked) @ p


def some_filter(rng: np.random.Generator, n: int, parameters: components.Parameters | None = None) -> components.Filter:
    position_m, velocity_m_s = rng.uniform(-300, 300, (n, 2)), rng.uniform(-15, 15, (n, 2))
    sd_m = rng.uniform(5, 50, n)
    return components.Filter.of_cues(
        position_m, velocity_m_s, position_sd_m=sd_m, velocity_sd_m_s=3.0, parameters=parameters
    )


def test_the_filter_equals_an_extended_kalman_filter(rng: np.random.Generator) -> None:
    """Eq. (8-11) over six steps of five targets and three UAVs, with missing measurements and bearings across pi."""
    parameters = components.Parameters(
        correlation_rate_1_s=0.3, acceleration_sd_m_s2=0.7, range_sd_m=8.0, bearing_sd_rad=0.04
    )
    n, m = 5, 3
    filter_ = some_filter(rng, n, parameters)
    x, p = filter_.state, filter_.covariance
    f3, q3 = singer(0.3, 0.7, 0.5)
    f, q = np.kron(np.eye(2), f3), np.kron(np.eye(2), q3)
    truth = x[:, [0, 3]].copy()
    for _ in range(6):
        truth += rng.normal(0, 4, (n, 2))
        uav = rng.uniform(300, 700, (n, m, 2))
        dx, dy = np.moveaxis(truth[:, None] - uav, -1, 0)
        range_m, bearing_rad = np.hypot(dx, dy) + rng.normal(0, 8, (n, m)), np.arctan2(dy, dx) + rng.normal(0, 0.04, (n, m))
        mask = rng.random((n, m)) < 0.7
        filter_.predict(0.5)
        updated = filter_.update(uav, np.where(mask, range_m, np.nan), bearing_rad, mask=mask)
        assert np.array_equal(updated, mask.any(axis=1))
        for i in range(n):
            x[i], p[i] = f @ x[i], f @ p[i] @ f.T + q
            seen = mask[i]
            if seen.any():
                z = np.stack([range_m[i, seen], bearing_rad[i, seen]], axis=1)
                x[i], p[i] = kalman_step(x[i], p[i], uav[i, seen], z, 8.0, 0.04)
        np.testing.assert_allclose(filter_.state, x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(filter_.covariance, p, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(filter_.information_matrix, np.linalg.inv(p), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        filter_.information_vector, np.einsum("nij,nj->ni", np.linalg.inv(p), x), rtol=1e-6, atol=1e-6
    )
    widest = np.sqrt(np.linalg.eigvalsh(p[:, [[0], [3]], [[0, 3]]])[:, -1])
    np.testing.assert_allclose(filter_.position_sd_max_m, widest, rtol=1e-9)
    assert np.array_equal(filter_.position_m, filter_.state[:, [0, 3]])
    assert np.array_equal(filter_.velocity_m_s, filter_.state[:, [1, 4]])


def test_a_filter_starts_from_a_cue_or_from_a_measurement() -> None:
    cued = components.Filter.of_cues([[1, 2]], [[3, 4]], position_sd_m=20, velocity_sd_m_s=[2])
    assert cued.state.tolist() == [[1, 3, 0, 2, 4, 0]]
    np.testing.assert_allclose(np.diag(cued.covariance[0]), [400, 4, 0.2**2] * 2, rtol=1e-12)
    # From 400 m north: the standard deviation is 10 m along the range and 400 m times 3 degrees across it.
    seen = components.Filter.from_measurements([0, 400], [400], [-np.pi / 2])
    np.testing.assert_allclose(seen.position_m, [[0, 0]], atol=1e-9)
    across_m = 400 * np.radians(3)
    expected = [across_m**2, 100, 0.04, 100, 100, 0.04]
    np.testing.assert_allclose(np.diag(seen.covariance[0]), expected, rtol=1e-9)
    # A second UAV in the east measures the other axis accurately.
    both = components.Filter.from_measurements([[0, 400], [400, 0]], [[400, 400]], [[-np.pi / 2, np.pi]])
    variance_m2 = 1 / (1 / 100 + 1 / across_m**2)
    np.testing.assert_allclose(both.covariance[0][[0, 3], [0, 3]], [variance_m2, variance_m2], rtol=1e-9)
    np.testing.assert_allclose(both.position_m, [[0, 0]], atol=1e-9)


def test_a_batch_of_filters_equals_single_filters(rng: np.random.Generator) -> None:
    n, m = 40, 3
    together = some_filter(rng, n)
    alone = [components.Filter(together.state[[i]], together.covariance[[i]]) for i in range(n)]
    for _ in range(4):
        uav = rng.uniform(-600, 600, (m, 2))
        range_m, bearing_rad = rng.uniform(100, 900, (n, m)), rng.uniform(-9, 9, (n, m))
        mask = rng.random((n, m)) < 0.8
        together.predict(0.25)
        together.update(uav, range_m, bearing_rad, mask=mask)
        for i, one in enumerate(alone):
            one.predict(0.25)
            one.update(uav, range_m[[i]], bearing_rad[[i]], mask=mask[[i]])
    assert np.array_equal(together.state, np.concatenate([one.state for one in alone]))
    assert np.array_equal(together.covariance, np.concatenate([one.covariance for one in alone]))


def test_update_accepts_shorter_shapes_for_a_single_uav(rng: np.random.Generator) -> None:
    start = some_filter(rng, 6)
    uav, range_m, bearing_rad = np.array([500.0, 40.0]), rng.uniform(100, 900, 6), rng.uniform(-3, 3, 6)
    arguments = [
        (uav, range_m, bearing_rad),
        (np.tile(uav, (6, 1)), range_m, bearing_rad),
        (uav, range_m[:, None], bearing_rad[:, None]),
        (np.tile(uav, (6, 1, 1)), range_m[:, None], bearing_rad[:, None]),
    ]
    states = []
    for shapes in arguments:
        filter_ = start.copy()
        assert filter_.update(*shapes).all()
        states.append(filter_.state)
    assert all(np.array_equal(state, states[0]) for state in states)
    assert not np.array_equal(start.state, states[0])


def test_filters_can_be_copied_pickled_and_rebuilt_from_their_state(rng: np.random.Generator) -> None:
    filter_ = some_filter(rng, 3, components.Parameters(range_sd_m=2.0))
    filter_.predict(0.5)
    filter_.update([900, 900], [1200, 1200, 1200], [-2.3, -2.4, -2.5])
    state = filter_.state
    state[:] = 0
    assert filter_.state.any()
    for again in (
        filter_.copy(),
        pickle.loads(pickle.dumps(filter_)),
        components.Filter(filter_.state, filter_.covariance, parameters=components.Parameters(range_sd_m=2.0)),
    ):
        again.predict(1.0)
        again.update([900, 900], [1100, 1100, 1100], [-2.3, -2.4, -2.5])
        expected = filter_.copy()
        expected.predict(1.0)
        expected.update([900, 900], [1100, 1100, 1100], [-2.3, -2.4, -2.5])
        assert np.array_equal(again.state, expected.state)
        assert np.array_equal(again.covariance, expected.covariance)
    assert len(filter_) == 3 and repr(filter_) == "Filter of 3 targets"


def test_a_filter_is_unchanged_after_invalid_arguments(rng: np.random.Generator) -> None:
    filter_ = some_filter(rng, 3)
    before = filter_.state
    mask = np.array([True, False, True])
    bad: list[tuple[Callable[[], Any], str]] = [
        (lambda: filter_.update([0, 0], [1, 2], [0, 0]), r"to the shape \(2,\): expected \(n,\).*n = 3 targets"),
        (lambda: filter_.update([0, 0], [1, np.nan, 2], [0, 0, 0]), r"range_m\[1\] = NaN: must be above 0"),
        (lambda: filter_.update([0, 0], [1, 1, -2], [0, 0, 0], mask=mask), r"range_m\[2\] = -2: must be above 0"),
        (lambda: filter_.update([0, np.inf], [1, 2, 3], [0, 0, 0]), r"uav_position_m\[1\] = inf: must be at least"),
        (lambda: filter_.update([0, 0], [1, 2, 3], [0, 0, 0], mask=[1, 1, 0]), "mask is of type int64: expected True and False"),
        (lambda: filter_.predict(-1.0), "dt_s = -1: must be at least 0 and at most 3600"),
        (lambda: filter_.predict(np.nan), "dt_s = NaN"),
    ]
    for call, message in bad:
        with pytest.raises(InputError, match=message):
            call()
    assert np.array_equal(filter_.state, before)
    # Masked values are ignored.
    assert filter_.update([0, 0], [100, np.nan, 90], [0, np.inf, 0], mask=mask).tolist() == [True, False, True]


def test_invalid_initial_states_are_errors() -> None:
    eye = np.eye(6)
    lopsided, negative = eye.copy(), eye.copy()
    lopsided[0, 3], negative[2, 2] = 0.5, -1
    bad: list[tuple[Callable[[], Any], str]] = [
        (lambda: components.Filter(np.zeros(6), eye), r"state has the shape \(6,\): expected \(n, 6\)"),
        (lambda: components.Filter(np.zeros((2, 6)), np.zeros((3, 6, 6))), r"covariance.*\(3, 6, 6\): expected \(2, 6, 6\)"),
        (lambda: components.Filter(np.zeros((1, 6)), np.zeros((6, 5))), r"\(6, 5\): expected \(..., 6, 6\)"),
        (lambda: components.Filter(np.zeros((2, 6)), [eye, lopsided]), "target 1: 0.5 at .0, 3., 0 at .3, 0.*symmetric"),
        (lambda: components.Filter(np.zeros((2, 6)), [eye, negative]), "target 1: must be positive definite"),
        (lambda: components.Filter(np.zeros((1, 6)), np.zeros((6, 6))), "target 0: must be positive definite"),
        (
            lambda: components.Filter.of_cues([[0, 0]], [[0, 0]], position_sd_m=0, velocity_sd_m_s=1),
            "position_sd_m = 0: must be at least",
        ),
        (
            lambda: components.Filter.of_cues([[0, 0]], [[0, 0]], position_sd_m=np.ones((2, 1)), velocity_sd_m_s=1),
            r"one leading axis, of n targets: the arguments broadcast to \(2, 1\)",
        ),
        (
            lambda: components.Filter.from_measurements([0, 0], [5, 5], [0, 0], mask=[True, False]),
            "target 1 has no measurement",
        ),
    ]
    for call, message in bad:
        with pytest.raises(InputError, match=message):
            call()
    assert len(components.Filter(np.zeros((0, 6)), eye)) == 0


def test_an_overflow_of_one_target_leaves_all_targets_unchanged() -> None:
    filter_ = components.Filter([[0] * 6, [0] * 6], [np.eye(6), np.eye(6) * 1e307])
    before = filter_.covariance
    with pytest.raises(InputError, match="target 1 has become too uncertain"):
        filter_.predict(3600)
    assert np.array_equal(filter_.covariance, before)


def test_a_measurement_that_makes_the_covariance_invalid_is_ignored(rng: np.random.Generator) -> None:
    """Covariances of rank one except for rounding: after the update they may not be positive definite."""
    filters, refused = [], 0
    for _ in range(300):
        along = rng.normal(size=6) * [1e4, 1e2, 1e1, 1e4, 1e2, 1e1]
        covariance = np.outer(along, along) + 3e-16 * np.diag(along**2)
        try:
            filters.append(components.Filter(np.zeros((1, 6)), covariance))
        except InputError as error:
            assert "must be positive definite" in str(error)
    for filter_ in filters:
        before = filter_.covariance
        if not filter_.update([500, 0], [490], [np.pi])[0]:
            refused += 1
            assert not filter_.state.any() and np.array_equal(filter_.covariance, before)
        assert np.isfinite(filter_.state).all()
    assert 0 < refused < len(filters)


def test_threads_can_share_a_filter(rng: np.random.Generator) -> None:
    filter_ = some_filter(rng, 500)
    alone = filter_.copy()
    for _ in range(80):
        alone.predict(0.1)

    def work() -> None:
        for _ in range(10):
            filter_.predict(0.1)
            assert np.isfinite(filter_.state).all()

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=30)
    assert np.array_equal(filter_.state, alone.state)


# Guidance.


def flown(
    uav: Floats, centre: Floats, r_d: float, centre_velocity: Floats, v: float, k_l: float
) -> tuple[float, float]:
    """Desired heading over ground and speed relative to the centre: (13), (20), (28), (29) by NumPy's own roots."""
    d = uav - centre
    r = np.hypot(*d)
    radial, tangential = (r_d**2 - r**2) / k_l, 2 * r * r_d
    along = (radial * d + tangential * np.array([-d[1], d[0]])) / r
    along /= np.hypot(*along)
    roots = np.roots([1.0, 2 * along @ centre_velocity, centre_velocity @ centre_velocity - v**2])
    alpha_s = float(np.max(roots.real))
    ground_track = centre_velocity + alpha_s * along
    assert np.hypot(*ground_track) == pytest.approx(v)
    return float(np.arctan2(ground_track[1], ground_track[0])), alpha_s


def test_the_turn_rate_is_feedback_plus_the_derivative_of_the_desired_heading(rng: np.random.Generator) -> None:
    """Eq. (23), (24), (25), (28), (29): the feedforward from central differences along the motion, one lag ahead."""
    n, v, k_l, k_omega, lag, h = 25, 40.0, 0.3, 1.7, 0.3, 1e-3
    uav, centre = rng.uniform(-800, 800, (n, 2)), rng.uniform(-99, 99, (n, 2))
    centre_velocity = rng.uniform(-14, 14, (n, 2))
    r_d, rate, heading = rng.uniform(250, 700, n), rng.uniform(-4, 4, n), rng.uniform(-9, 9, n)
    got = components.steer(
        uav, heading, centre, distance_m=r_d, rate_m_s=rate, centre_velocity_m_s=centre_velocity,
        parameters=components.Parameters(radial_gain=k_l, heading_gain_1_s=k_omega, turn_rate_lag_s=lag),
    )  # fmt: skip
    for i in range(n):
        psi_d, _ = flown(uav[i], centre[i], r_d[i], centre_velocity[i], v, k_l)
        assert got.desired_heading_rad[i] == pytest.approx(psi_d, abs=1e-9)
        motion = v * np.array([np.cos(heading[i]), np.sin(heading[i])])

        def flown_at(t: float) -> tuple[float, float]:
            positions = uav[i] + motion * t, centre[i] + centre_velocity[i] * t
            return flown(*positions, r_d[i] + rate[i] * t, centre_velocity[i], v, k_l)

        psi_later, relative = flown_at(lag)

        def heading_at(t: float) -> float:
            """At the speed relative to the centre of one lag ahead."""
            psi, alpha_s = flown_at(t)
            along = (v * np.array([np.cos(psi), np.sin(psi)]) - centre_velocity[i]) / alpha_s
            track = centre_velocity[i] + relative * along
            return float(np.arctan2(track[1], track[0]))

        difference = float(wrapped(np.array(heading_at(lag + h) - heading_at(lag - h)))) / (2 * h)
        assert got.feedforward_rad_s[i] == pytest.approx(difference, abs=2e-6, rel=2e-5)
        error = float(wrapped(np.array(heading[i] - psi_later)))
        assert got.turn_rate_rad_s[i] == pytest.approx(difference - k_omega * error, abs=5e-6, rel=2e-5)
        d, velocity = uav[i] - centre[i], v * np.array([np.cos(psi_d), np.sin(psi_d)])
        r, closing = np.hypot(*d), float(d @ (velocity - centre_velocity[i]) / np.hypot(*d))
        threshold = (r * closing - r_d[i] * rate[i]) * np.sign(r_d[i] - r)
        assert got.convergence_threshold_m2_s[i] == pytest.approx(threshold, rel=1e-9, abs=1e-6)
        assert got.centre_distance_m[i] == pytest.approx(r)
        assert got.phase_rad[i] == pytest.approx(np.arctan2(d[1], d[0]))
    assert not got.centre_too_fast.any()


def test_feedforward_as_published_and_exact() -> None:
    """Eq. (25): 0.432 rad/s inside the orbit, where the published form gives 0.048."""
    rates = {}
    for feedforward in ("paper", "static-centre"):
        parameters = components.Parameters.paper()
        parameters = components.Parameters(parameters, feedforward=feedforward, radial_gain=1.0)
        rates[feedforward] = float(components.steer([100, 0], 0, [0, 0], distance_m=300, parameters=parameters).feedforward_rad_s)
    r, r_d, v = 100, 300, 40
    square = (r**2 + r_d**2) ** 2
    assert rates["static-centre"] == pytest.approx(4 * v * r_d**3 / square) == pytest.approx(0.432)
    assert rates["paper"] == pytest.approx(4 * v * r_d * r**2 / square) == pytest.approx(0.048)


def test_optional_arguments_of_steer() -> None:
    """(22) changes only the field; the current turn rate and the actual speed matter with this project's law."""
    paper = components.Parameters.paper()
    plain = components.steer([500, 0], 1, [0, 0], distance_m=400, rate_m_s=2, parameters=paper)
    led = components.steer([500, 0], 1, [0, 0], distance_m=400, rate_m_s=2, steered_radius_m=406)
    other = components.steer([500, 0], 1, [0, 0], distance_m=406, rate_m_s=2)
    assert led.desired_heading_rad == other.desired_heading_rad != plain.desired_heading_rad
    turning = components.steer([500, 0], 1, [0, 0], distance_m=400, rate_m_s=2, turn_rate_rad_s=0.2, parameters=paper)
    assert turning.turn_rate_rad_s == plain.turn_rate_rad_s
    from_straight, from_turn = [
        components.steer([500, 0], 1, [0, 0], distance_m=400, turn_rate_rad_s=rate).turn_rate_rad_s for rate in (0, 0.2)
    ]
    assert from_turn < from_straight
    actual = components.Parameters(turn_rate_lag_s=1e-3)
    rates = [
        float(
            components.steer([500, 0], 1, [0, 0], distance_m=400, uav_speed_m_s=speed, parameters=actual).feedforward_rad_s
        )
        for speed in (0.0, 20.0, 40.0)
    ]
    assert rates[0] == 0 and rates[2] == pytest.approx(2 * rates[1], rel=1e-2) != 0
    chased = components.steer([500, 0], 1, [0, 0], distance_m=400, centre_velocity_m_s=[-60, 0])
    assert bool(chased.centre_too_fast) and np.isfinite(chased.turn_rate_rad_s)


def test_the_standoff_distance_and_its_lead() -> None:
    """Eq. (15): with Table I, 2 (d_max + d_m), clamped to 250 m to 700 m; (22): k_rd = 3 s ahead."""
    got = components.standoff_distance([10, 150, 400], spread_rate_m_s=2, margin_m=[0, 10, 0])
    np.testing.assert_allclose(got.unclamped_m, [20, 320, 800])
    np.testing.assert_allclose(got.distance_m, [250, 320, 700])
    np.testing.assert_allclose(got.rate_m_s, [0, 4, 0])
    wide = components.Parameters(field_of_view_rad=np.pi / 2, field_of_view_margin_rad=0.0, radius_min_m=1.0)
    assert components.standoff_distance(100, parameters=wide).distance_m == pytest.approx(100 * np.sqrt(2))
    distance_m, rate_m_s = components.steered_radius([400, 260, 690], [-5, -5, 5], parameters=components.Parameters.paper())
    assert (distance_m.tolist(), rate_m_s.tolist()) == ([385, 250, 700], [-5, 0, 0])
    assert components.steered_radius(400, 2, speed_m_s=20)[0] == 400 + 2 * 0.2 * 400 / 20


# Parameters.


def test_parameters_are_the_recommended_ones_or_those_of_a_scenario() -> None:
    recommended = components.Parameters()
    assert (recommended.radial_gain, recommended.heading_gain_1_s, recommended.lead_s, recommended.speed_m_s) == (0.2, 1.0, 3.0, 40.0)
    assert (recommended.radius_min_m, recommended.radius_max_m, recommended.range_sd_m) == (250.0, 700.0, 10.0)
    assert np.degrees([recommended.field_of_view_rad, recommended.bearing_sd_rad]) == pytest.approx([70, 3])
    paper = components.Parameters.paper()
    assert (paper.heading_gain_1_s, paper.assignment_switching_cost, paper.speed_m_s) == (2.0, 0.5, 40.0)
    scenario = standoff.Scenario("improved/figure-9", set={"guidance.radial_gain": 0.37})
    of, toml = components.Parameters(scenario), tomllib.loads(scenario.resolved(1))
    # Every key of these tables is an attribute.
    for table in ["guidance", "orbit", "groups", "filter"]:
        for name, value in toml[table].items():
            if name.endswith("_deg"):
                assert np.degrees(getattr(of, name.replace("_deg", "_rad"))) == pytest.approx(value), name
            else:
                assert getattr(of, name) == value and name in dir(of), name
    assert of.speed_m_s == toml["uavs"]["speed_m_s"]
    assert of.radial_gain == 0.37 and of.law == "standoff"
    assert np.degrees(of.field_of_view_rad) == pytest.approx(toml["sensor"]["field_of_view_deg"])
    changed = components.Parameters(of, radial_gain=1)
    assert changed != of and components.Parameters(changed, radial_gain=0.37) == of
    assert pickle.loads(pickle.dumps(of)) == of
    assert eval(repr(of), {"Parameters": components.Parameters}) == of
    assert repr(components.Parameters(radial_gain=0.5, dwell_max_s=9)) == "Parameters(dwell_max_s=9.0, radial_gain=0.5)"
    assert components.Parameters("improved/figure-9", radial_gain=0.37) == of


def test_errors_about_parameters_state_the_range() -> None:
    bad: list[tuple[dict[str, Any], str]] = [
        ({"radial_gain": 5}, "^radial_gain = 5: must be at least 0.001 and at most 1$"),
        ({"range_sd_m": np.nan}, "range_sd_m = NaN"),
        ({"radius_min_m": 800}, "radius_max_m = 700: must be at least 800"),
        ({"speed_m_s": 0}, "^speed_m_s = 0"),
        ({"orbit_direction": "left"}, "orbit_direction = 'left': must be one of \"anticlockwise\", \"clockwise\""),
        ({"law": "oh"}, "law = 'oh': must be one of \"standoff\", \"oh-2015\""),
    ]
    for named, message in bad:
        with pytest.raises(InputError, match=message):
            components.Parameters(**named)
    with pytest.raises(standoff.ScenarioError, match="no-such-scenario"):
        components.Parameters("no-such-scenario")
    with pytest.raises(TypeError):
        components.Parameters(radial_gian=1.0)
    with pytest.raises(TypeError, match="radial_gain: must be real number"):
        components.Parameters(radial_gain="large")
    with pytest.raises(AttributeError, match="'Parameters' object has no attribute 'radial_gian'"):
        components.Parameters().radial_gian
    # Limits that no component uses are only checked if they are given.
    assert components.Parameters(speed_m_s=10.0).speed_m_s == 10.0
    with pytest.raises(InputError, match="speed_change_max_m_s = 15: must be at least 0 and below 10"):
        components.Parameters(speed_m_s=10.0, speed_change_max_m_s=15)


# All components.


def test_the_doctest_passes() -> None:
    assert doctest.testmod(components).attempted == 5
    assert doctest.testmod(components).failed == 0


def test_all_lists_every_public_name() -> None:
    assert all(hasattr(components, name) for name in components.__all__)
    assert {name for name in vars(components) if not name.startswith("_")} == set(components.__all__)


def everything(rng: np.random.Generator, lead: tuple[int, ...]) -> dict[str, tuple[Callable[..., Any], list[Any]]]:
    """Every function with arguments that have leading axes; each returns a list of arrays."""

    def uniform(low: float, high: float, *row: int) -> Floats:
        return rng.uniform(low, high, (*lead, *row))

    def steered(uav: Floats, heading: Floats, centre: Floats, distance: Floats, moving: Floats) -> list[Any]:
        got = components.steer(uav, heading, centre, distance_m=distance, centre_velocity_m_s=moving)
        return [
            got.turn_rate_rad_s, got.desired_heading_rad, got.feedforward_rad_s, got.centre_distance_m, got.phase_rad,
            got.convergence_threshold_m2_s, got.centre_too_fast,
        ]  # fmt: skip

    def stood_off(spread: Floats, rate: Floats, margin: Floats) -> list[Any]:
        got = components.standoff_distance(spread, spread_rate_m_s=rate, margin_m=margin)
        return [got.distance_m, got.rate_m_s, got.unclamped_m]

    uav, centre, distance = uniform(-900, 900, 2), uniform(-99, 99, 2), uniform(250, 700)
    return {
        "steer": (steered, [uav, uniform(-9, 9), centre, distance, uniform(-60, 60, 2)]),
        "standoff_distance": (stood_off, [uniform(0, 500), uniform(-9, 9), uniform(0, 50)]),
        "steered_radius": (lambda a, b: list(components.steered_radius(a, b)), [distance, uniform(-9, 9)]),
    }


def equal(one: list[Any], other: list[Any]) -> bool:
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other))


NAMES = list(everything(np.random.default_rng(0), (1,)))


@pytest.mark.parametrize("name", NAMES)
def test_batched_results_equal_single_rows(name: str, rng: np.random.Generator) -> None:
    function, arguments = everything(rng, (3, 11))[name]
    together = function(*arguments)
    assert all(array.shape[:2] == (3, 11) for array in together)
    for index in np.ndindex(3, 11):
        alone = function(*(argument[index] for argument in arguments))
        assert equal(alone, [array[index] for array in together])


@pytest.mark.parametrize("name", NAMES)
def test_any_strides_types_and_lists_are_accepted(name: str, rng: np.random.Generator) -> None:
    function, arguments = everything(rng, (4,))[name]
    expected = function(*arguments)

    def strided(argument: npt.NDArray[Any]) -> npt.NDArray[Any]:
        wide = np.zeros((*(2 * n for n in argument.shape),), dtype=argument.dtype)
        view = wide[tuple(slice(None, None, 2) for _ in argument.shape)]
        view[:] = argument
        return view

    conversions: list[Callable[[npt.NDArray[Any]], Any]] = [
        strided,
        np.asfortranarray,
        lambda argument: argument[::-1].copy()[::-1],
        lambda argument: argument.astype(argument.dtype.newbyteorder(">")),
        lambda argument: argument.tolist(),
    ]
    for convert in conversions:
        assert equal(function(*map(convert, arguments)), expected)
    whole = [np.round(argument) for argument in arguments]
    integers = [argument.astype(np.int32) for argument in whole]
    assert equal(function(*integers), function(*whole))


@pytest.mark.parametrize("name", NAMES)
def test_empty_arrays_give_empty_results(name: str, rng: np.random.Generator) -> None:
    function, arguments = everything(rng, (0,))[name]
    assert all(array.shape[0] == 0 for array in function(*arguments))


@pytest.mark.parametrize("name", NAMES)
def test_leading_axes_broadcast(name: str, rng: np.random.Generator) -> None:
    function, arguments = everything(rng, (3, 4))[name]
    first = [argument[:, :1] if i % 2 else argument[0] for i, argument in enumerate(arguments)]
    lead = (3, 4) if len(arguments) > 1 else (4,)
    full = [np.broadcast_to(a, (*lead, *a.shape[len(lead) if i % 2 or lead == (4,) and i else 1 :])) for i, a in
            enumerate(first)]  # fmt: skip
    assert equal(function(*first), function(*full))


@pytest.mark.parametrize("name", NAMES)
def test_errors_name_the_invalid_array(name: str, rng: np.random.Generator) -> None:
    function, arguments = everything(rng, (5,))[name]
    for i, argument in enumerate(arguments):

        def with_bad(bad: Any, i: int = i) -> list[Any]:
            return [*arguments[:i], bad, *arguments[i + 1 :]]

        bad: list[tuple[Any, str]] = [
            ("far", "is of type <U3: expected (real numbers|integers)"),
            (object(), "is of type object: expected (real numbers|integers)"),
            (argument + 1j, "is of type complex128: expected (real numbers|integers)"),
            ([[1, 2], [3]], "is not an array of (real numbers|integers): .*inhomogeneous"),
            (np.ma.masked_array(argument), "is a masked array: pass its data"),
            (argument.astype("datetime64[s]"), "is of type datetime64.s.: expected (real numbers|integers)"),
        ]
        if argument.dtype == np.float64:
            for value in (np.nan, np.inf, -np.inf):
                broken = argument.copy()
                broken[3] = value
                bad.append((broken, r"\[3(, 0)*\] = (NaN|-?inf): must be "))
        else:
            bad.append((argument.astype(float), "is of type float64: expected integers"))
        if argument.ndim > 1:
            bad.append((argument[..., :1].repeat(3, axis=-1), r"(has the shape|the last axis must be)"))
            bad.append((7.0 if argument.dtype == np.float64 else 7, r"(has the shape \(\): |the last axis must be)"))
        if len(arguments) > 1:
            bad.append((argument[:3], r"has the leading axes \([35],.*must be equal, or 1"))
        for array, message in bad:
            with pytest.raises(InputError, match=r"^[a-z_]+.*" + message):
                function(*with_bad(array))


@pytest.mark.parametrize("name", NAMES)
def test_extreme_values_give_finite_results_or_errors(name: str, rng: np.random.Generator) -> None:
    extremes = np.array([0.0, -0.0, 1e-300, 1e-9, 1.0, -1.0, 250.0, 1e6, -1e6, 1e9, -1e9, 2e9, 1e300])
    function, arguments = everything(rng, (1,))[name]
    accepted = 0
    for _ in range(400):
        some = [
            rng.choice(extremes[: rng.integers(4, 14)], size=argument.shape) if argument.dtype == np.float64 else argument
            for argument in arguments
        ]
        try:
            results = function(*some)
        except InputError:
            continue
        accepted += 1
        assert all(np.isfinite(result).all() for result in results), some
    assert accepted > 5


def test_too_many_rows_are_an_error() -> None:
    with pytest.raises(InputError, match="too many rows: at most 10000000"):
        components.standoff_distance(np.zeros((10_000, 1)), margin_m=np.zeros(10_000))


@pytest.fixture
def alarm() -> Iterator[None]:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("alarm")
def test_ctrl_c_stops_a_computation_that_does_not_block_other_threads(rng: np.random.Generator) -> None:
    uav_position_m = rng.uniform(-900, 900, (9_000_000, 2))
    counted, done = [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.perf_counter()
    signal.setitimer(signal.ITIMER_REAL, 0.4)
    try:
        with pytest.raises(KeyboardInterrupt):
            components.steer(uav_position_m, 0.0, [0, 0], distance_m=300)
    finally:
        done.set()
        thread.join()
    assert time.perf_counter() - start < 5.0
    assert counted[0] > 20
