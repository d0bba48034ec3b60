"""
Cooperative standoff tracking: runs, batches, laws of your own, and the library's pieces on arrays.
"""

from _typeshed import Incomplete, SupportsGetItem, SupportsLenAndGetItem
from numpy import bool_, float64, int64
from numpy.typing import ArrayLike, NDArray
from os import PathLike
from pathlib import Path
from typing import Any, Final, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "Batch", "MissionInfo", "Choice", "Command", "Comparison", "Cue", "Filter", "Instant", "Observation", "Parameters", "TeamState", "Report", "Run", "Scenario", "StandoffDistance", "Steering", "Table", "Tracks", "Worlds", "Zone", "_described", "_difference", "_fly_described", "assignment", "optimal_phase_rad", "clustering", "compare", "group_count", "information_1_m2", "led_distance", "measure", "merge", "monte_carlo", "observation_features", "pair_information_1_m4", "run", "scenarios", "enclosing_circle", "standoff_distance", "steer", "vector_field", "wrapped_angle_rad", "baseline"]

__version__: Final[str]

@final
class Batch:
    """
    A complete batch of runs, in its folder.

    :param dir: the folder of a complete batch, of ``standoff monte-carlo``, :func:`monte_carlo` or :func:`merge`.
    :raises InputError: there is none, or it was changed since it was written.
    """
    def __new__(cls, /, dir: str | PathLike[str]) -> Batch: ...
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str:
        """
        As a notebook shows it: its page, or else its statistics.
        """
    @property
    def dir(self, /) -> Path:
        """
        The folder: ``runs.parquet``, ``summary.json``, ``monte-carlo.json``, ``report.html``.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        For every metric its statistics over the runs: ``n``, ``mean``, ``ci95``, ``sd``, ``p5``, ``p50``, ``p95``, ``max``.
        """
    @property
    def runs(self, /) -> Table:
        """
        ``runs.parquet``: a row per run, in order, with ``run``, ``seed`` and a column per metric.
        """
    @property
    def summary(self, /) -> dict[str, Any]:
        """
        ``summary.json`` as a dict: what was flown, and the statistics of every metric.
        """

@final
class MissionInfo:
    """
    What a team may know of a scenario before it flies.
    """
    @property
    def bearing_sd_rad(self, /) -> float:
        """
        Standard deviation of bearings, rad.
        """
    @property
    def duration_s(self, /) -> float:
        """
        Duration of the mission, s.
        """
    @property
    def field_of_view_rad(self, /) -> float:
        """
        Sensors' field of view, whole angle, rad.
        """
    @property
    def period_s(self, /) -> float:
        """
        Time between two instants, s.
        """
    @property
    def radius_max_m(self, /) -> float:
        """
        Largest orbit, m.
        """
    @property
    def radius_min_m(self, /) -> float:
        """
        Smallest orbit, m.
        """
    @property
    def range_sd_m(self, /) -> float:
        """
        Standard deviation of ranges, m.
        """
    @property
    def sensing_range_m(self, /) -> float:
        """
        How far sensors see, m.
        """
    @property
    def speed_change_max_m_s(self, /) -> float:
        """
        Most that a commanded speed may differ from it, m/s.
        """
    @property
    def speed_m_s(self, /) -> float:
        """
        Nominal speed, m/s.
        """
    @property
    def turn_rate_max_rad_s(self, /) -> float:
        """
        Most that a UAV turns, rad/s.
        """
    @property
    def uav(self, /) -> int | None:
        """
        Which UAV the law decides for; None: for all.
        """
    @property
    def uavs(self, /) -> int:
        """
        Number of UAVs, which are numbered from 0.
        """
    @property
    def zones(self, /) -> list[Zone]:
        """
        The zones that UAVs keep out of, and in, as the scenario has them.
        """

@final
class Choice:
    """
    What a law that assigns chooses from: U UAVs and G groups, each by ascending number.
    """
    @property
    def group(self, /) -> Incomplete:
        """
        ``(G,)``: the groups' ids, which tell them apart and nothing else.
        """
    @property
    def members(self, /) -> list[Incomplete]:
        """
        For each group where its targets are, ``(n, 2)``: x_m, y_m.
        """
    @property
    def position(self, /) -> Incomplete:
        """
        ``(U, 2)``: where they are: x_m, y_m.
        """
    @property
    def serves(self, /) -> Incomplete:
        """
        ``(U,)``: the group that each serves until now, by its id; -1: none.
        """
    @property
    def time_s(self, /) -> float:
        """
        Time since the start of the mission, s.
        """
    @property
    def uav(self, /) -> Incomplete:
        """
        ``(U,)``: the UAVs that can be assigned.
        """

@final
class Command:
    """
    What a law wants of a UAV until the next instant. What is beyond the limits is flown at the limit.

    :param speed_m_s: speed, m/s.
    :param turn_rate_rad_s: turn rate, rad/s, anticlockwise positive.
    :param pointing_target: where to point the sensor: (x_m, y_m), or (x_m, y_m, vx_m_s, vy_m_s) for a point that moves. None: where
        the product would, if it flies beside the law; else nowhere.
    :param altitude_m: altitude above the plane, m.
    :param group: the group that the UAV serves, for the scores: one of the picture's, where the law sees it.
    :raises InputError: a number that is not finite, or an altitude beyond 100 km.
    """
    def __new__(cls, /, speed_m_s: SupportsFloat | SupportsIndex, turn_rate_rad_s: SupportsFloat | SupportsIndex, *, pointing_target: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, altitude_m: SupportsFloat | SupportsIndex | None = None, group: SupportsIndex | None = None) -> Command: ...
    def __repr__(self, /) -> str: ...
    @property
    def altitude_m(self, /) -> float | None: ...
    @property
    def group(self, /) -> int | None: ...
    @property
    def pointing_target(self, /) -> list[float] | None: ...
    @property
    def speed_m_s(self, /) -> float: ...
    @property
    def turn_rate_rad_s(self, /) -> float: ...

@final
class Comparison:
    """
    B compared with A, run by run on the same draws: the numbers of ``standoff compare``, to the bit.

    docs/monte-carlo.md says what each number is.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str:
        """
        As a notebook shows it: a row per metric; * where the difference is of interest.
        """
    @property
    def a(self, /) -> str:
        """
        What A is.
        """
    @property
    def b(self, /) -> str:
        """
        What B is.
        """
    @property
    def json(self, /) -> str:
        """
        What ``standoff compare --json`` prints.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        For every metric its numbers: ``mean_a``, ``mean_b``, ``difference`` (B - A), ``ci95``, ``differs``, ...
        """
    @property
    def runs(self, /) -> int:
        """
        Number of runs of each.
        """
    @property
    def seed(self, /) -> int:
        """
        The first seed.
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        All of it as a dict: what ``standoff compare --json`` prints.
        """

@final
class Cue:
    """
    A target that a search aircraft hands over when it appears.
    """
    @property
    def position_sd_m(self, /) -> float:
        """
        Standard deviation of the position per axis, m.
        """
    @property
    def target(self, /) -> int:
        """
        Which target.
        """
    @property
    def velocity_sd_m_s(self, /) -> float:
        """
        Standard deviation of the velocity per axis, m/s.
        """
    @property
    def vx_m_s(self, /) -> float:
        """
        Its velocity east, m/s.
        """
    @property
    def vy_m_s(self, /) -> float:
        """
        Its velocity north, m/s.
        """
    @property
    def x_m(self, /) -> float:
        """
        Where it is east, m.
        """
    @property
    def y_m(self, /) -> float:
        """
        Where it is north, m.
        """

@final
class Filter:
    """
    Extended information filters (8-11), one for each of n targets: what all UAVs measure of one instant adds up.

    The state of a target is ``[x, vx, ax, y, vy, ay]``: position (m), velocity (m/s), acceleration (m/s2), east and then
    north. :meth:`of_cues` and :meth:`from_measurements` start from less. States and covariances start another filter as
    they are, to the bit: ``Filter(one.state[kept], one.covariance[kept])`` keeps some of the targets.

    :param state: means, shape (n, 6).
    :param covariance: covariances P, shape (n, 6, 6), or (6, 6) for all: symmetric and positive definite.
    :param parameters: correlation_rate_1_s, acceleration_sd_m_s2, range_sd_m, bearing_sd_rad, initial_velocity_sd_m_s; the
        paper's Table I if left out.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """
    def __getnewargs_ex__(self, /) -> "tuple[tuple[object, object], dict[str, object]]": ...
    def __len__(self, /) -> int: ...
    def __new__(cls, /, state: ArrayLike, covariance: ArrayLike, *, parameters: Parameters | None = None) -> Filter: ...
    def __repr__(self, /) -> str: ...
    def copy(self, /) -> Filter:
        """
        Another one with the same estimates.
        """
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        Covariances P, shape (n, 6, 6), in the units of the states; a copy.
        """
    @property
    def information_matrix(self, /) -> NDArray[float64]:
        """
        Information matrices Y = P^-1, shape (n, 6, 6).

        :raises InputError: a covariance so near to singular that it has no inverse in these numbers.
        """
    @property
    def information_vector(self, /) -> NDArray[float64]:
        """
        Information vectors y = Y x, shape (n, 6).

        :raises InputError: a covariance so near to singular that it has no inverse in these numbers.
        """
    @staticmethod
    def of_cues(position_m: ArrayLike, velocity_m_s: ArrayLike, *, position_sd_m: ArrayLike, velocity_sd_m_s: ArrayLike, parameters: Parameters | None = None) -> Filter:
        """
        Starts from targets handed over: where they are, how they move, and how sure that is.

        :param position_m: shape (n, 2), east and north, m.
        :param velocity_m_s: shape (n, 2), east and north, m/s.
        :param position_sd_m: shape (n,) or (), standard deviation of the position per axis, m.
        :param velocity_sd_m_s: shape (n,) or (), standard deviation of the velocity per axis, m/s.
        :param parameters: as of the class.
        :raises InputError: an argument of another shape or type, or a number out of range.
        """
    @staticmethod
    def from_measurements(uav_position_m: ArrayLike, range_m: ArrayLike, bearing_rad: ArrayLike, *, mask: ArrayLike | None = None, parameters: Parameters | None = None) -> Filter:
        """
        Starts from the first measurements of one instant, at rest but for initial_velocity_sd_m_s.

        :param uav_position_m: shape (..., 2), where it was measured from, east and north, m.
        :param range_m: shape (n,), or (n, m) for m measurements of each target, m.
        :param bearing_rad: the same shape, rad anticlockwise from east.
        :param mask: the same shape: False where there is no measurement; each target has at least one.
        :param parameters: as of the class.
        :raises InputError: an argument of another shape or type, or a number out of range.
        """
    @property
    def position_m(self, /) -> NDArray[float64]:
        """
        Positions, shape (n, 2), east and north, m; a copy.
        """
    @property
    def position_sd_max_m(self, /) -> NDArray[float64]:
        """
        Standard deviations of the positions in their least known direction, shape (n,), m.
        """
    def predict(self, /, dt_s: SupportsFloat | SupportsIndex) -> None:
        """
        Carries all estimates over a time step (8, 9).

        :param dt_s: how long, 0 to 3,600, s; to the nearest microsecond.
        :raises InputError: a time out of range, or one over which an estimate would grow beyond what numbers hold;
            nothing is changed then.
        """
    @property
    def state(self, /) -> NDArray[float64]:
        """
        Means, shape (n, 6): ``[x, vx, ax, y, vy, ay]``, m, m/s, m/s2; a copy.
        """
    def update(self, /, uav_position_m: ArrayLike, range_m: ArrayLike, bearing_rad: ArrayLike, *, mask: ArrayLike | None = None) -> NDArray[bool_]:
        """
        Adds what was measured at this instant (10, 11), linearised about the predicted positions; bearings wrap.

        :param uav_position_m: shape (..., 2), where it was measured from, east and north, m: (2,) for one UAV, (m, 2)
            for m UAVs that measure every target.
        :param range_m: shape (n,), or (n, m) for m measurements of each target, m; within 1 m of the predicted position
            one tells nothing.
        :param bearing_rad: the same shape, rad anticlockwise from east.
        :param mask: the same shape: False where there is no measurement; what stands there is not looked at.
        :returns: shape (n,): whose estimate has taken something in. Not where nothing was measured, nor where numbers
            would not hold the result; there the estimate is as it was.
        :raises InputError: an argument of another shape or type, or a number out of range; nothing is changed then.
        """
    @property
    def velocity_m_s(self, /) -> NDArray[float64]:
        """
        Velocities, shape (n, 2), east and north, m/s; a copy.
        """

@final
class Instant:
    """
    An instant of every world: what is to be decided now, and what the last step has come to.
    """
    @property
    def duration_s(self, /) -> Incomplete:
        """
        When the mission is over, s, (worlds,).
        """
    @property
    def ended(self, /) -> Instant | None:
        """
        With ``"SameStep"``, where a mission ended in the last step: how; elsewhere as this instant. ``None``: none ended.
        """
    @property
    def has_ended(self, /) -> Incomplete:
        """
        Where that was, (worlds,).
        """
    @property
    def has_orbit(self, /) -> Incomplete:
        """
        Some UAV's group has a true orbit, (worlds,).
        """
    @property
    def mean_on_orbit(self, /) -> Incomplete:
        """
        Mean of `on_orbit` over the UAVs, (worlds,).
        """
    @property
    def observations(self, /) -> Incomplete:
        """
        What each UAV's team believes; (worlds, UAVs, features), as :func:`observation_features` tells.
        """
    @property
    def on_orbit(self, /) -> Incomplete:
        """
        How near each UAV is to its group's true orbit, 0 to 1, (worlds, UAVs).
        """
    @property
    def rewards(self, /) -> Incomplete:
        """
        The team's reward of the last step, 0 to 1, (worlds,); 0 where a mission has just begun.
        """
    @property
    def seeds(self, /) -> Incomplete:
        """
        The seed of the mission: ``standoff.run(scenario, seed=...)`` flies the same world, (worlds,).
        """
    @property
    def standoff_error_m(self, /) -> Incomplete:
        """
        Mean distance of the UAVs from their groups' true orbits, m, (worlds,); 0 where `has_orbit` is false.
        """
    @property
    def targets(self, /) -> Incomplete:
        """
        Targets that exist, (worlds,).
        """
    @property
    def terminated(self, /) -> Incomplete:
        """
        No target that exists is known any more, (worlds,).
        """
    @property
    def time_s(self, /) -> Incomplete:
        """
        Time since the start of the mission, s, (worlds,).
        """
    @property
    def truncated(self, /) -> Incomplete:
        """
        The scenario's duration is over, (worlds,).
        """
    @property
    def uav_rewards(self, /) -> Incomplete:
        """
        Each UAV's reward of the last step, 0 to 1, (worlds, UAVs).
        """
    @property
    def watched(self, /) -> Incomplete:
        """
        Share of the existing targets that are in a group and in some UAV's view, by the truth, (worlds,).
        """

@final
class Observation:
    """
    What the agent of a UAV has at an instant: its own state, its own scan, what was said to it; and, where a law asks for
    it, the team's picture.
    """
    @property
    def altitude_m(self, /) -> float | None:
        """
        Altitude above the plane, m; None: altitudes are not flown.
        """
    @property
    def climb_rate_m_s(self, /) -> float | None:
        """
        Rate of climb, m/s, positive upward; None as ``altitude_m``.
        """
    @property
    def cues(self, /) -> list[Cue]:
        """
        Targets that have just appeared.
        """
    @property
    def heading_rad(self, /) -> float:
        """
        Heading, rad.
        """
    @property
    def picture(self, /) -> TeamState | None:
        """
        The team's picture, for laws with ``sees = "picture"``.
        """
    @property
    def product(self, /) -> Command | None:
        """
        What the product would have the UAV do, where it flies beside the law.
        """
    @property
    def reports(self, /) -> list[Report]:
        """
        What teammates say of this instant, by ascending UAV.
        """
    @property
    def scan(self, /) -> Report | None:
        """
        Its own scan; None: it is out, and its sensor is, too.
        """
    @property
    def speed_m_s(self, /) -> float:
        """
        Speed, m/s.
        """
    @property
    def time_s(self, /) -> float:
        """
        Time since the start of the mission, s.
        """
    @property
    def turn_rate_rad_s(self, /) -> float:
        """
        Turn rate, rad/s.
        """
    @property
    def uav(self, /) -> int:
        """
        Which UAV.
        """
    @property
    def x_m(self, /) -> float:
        """
        East, m.
        """
    @property
    def y_m(self, /) -> float:
        """
        North, m.
        """

@final
class Parameters:
    """
    The numbers of filter, sensor, orbits, guidance and assignment; checked once, here. Immutable.

    ``Parameters()`` is the paper's Table I, ``Parameters("improved/figure-9")`` a scenario's, and
    ``Parameters(those, radial_gain=1.0)`` those with a change. Names are the keys of scenario files, in radians.

    :param of: where what is not given comes from: other parameters, a :class:`standoff.Scenario`, a built-in scenario's
        name or the path of a scenario file; Table I if left out.
    :param seed: of a scenario that draws parameters, the seed; 1 if left out.
    :param correlation_rate_1_s: filter: correlation rate alpha of the targets' acceleration (5, 6), 1/s.
    :param acceleration_sd_m_s2: filter: standard deviation of their acceleration per axis, m/s2.
    :param range_sd_m: filter: standard deviation of a range, sigma_r, m.
    :param bearing_sd_rad: filter: standard deviation of a bearing, sigma_theta, rad.
    :param initial_velocity_sd_m_s: filter: standard deviation per axis of the velocity where only a measurement is known, m/s.
    :param field_of_view_rad: sensor and orbit: field of view alpha_f, rad.
    :param field_of_view_margin_rad: orbit: margin eps_m taken off the field of view (15), rad.
    :param radius_min_m: orbit: smallest standoff distance flown, r_d,min, m.
    :param radius_max_m: orbit: largest standoff distance flown, r_d,max, m.
    :param speed_m_s: a UAV's nominal speed v_d over ground, m/s.
    :param sense: guidance: which way round, ``"anticlockwise"`` or ``"clockwise"``, seen from above.
    :param radial_gain: guidance: k_l of active measure 1 (20), above 0, at most 1; 1 switches it off.
    :param lead: guidance: how far ahead active measure 2 (22) steers: ``"constant"`` (``lead_s``), ``"scheduled"`` or
        ``"predicted"`` (the field's own lag k_l r_d / v).
    :param lead_s: guidance: k_rd, s; given alone, it makes ``lead`` constant. 0 where that is not constant.
    :param speed_reference: guidance: what speeds are relative to, ``"ground"`` or ``"centre"``.
    :param heading_gain_1_s: guidance: k_omega (24), 1/s.
    :param turn_rate_gain: guidance: gain on the turn rate's distance from the feedforward; 0, as in the paper: none.
    :param feedforward: guidance: which derivative of the desired heading is fed forward (25): ``"flown"``, ``"actual"``,
        ``"exact"`` or ``"printed"``.
    :param objective: assignment: ``"log-det"``, or ``"printed"`` (32).
    :param assignment_switching_cost: assignment: what staying counts for a UAV, in ln det per target.
    :raises InputError: a number outside its range, named with the range.
    :raises ScenarioError: a scenario that cannot be used.
    """
    def __eq__(self, value: object, /) -> bool: ...
    def __getnewargs_ex__(self, /) -> "tuple[tuple[()], dict[str, float | str]]": ...
    def __ne__(self, value: object, /) -> bool: ...
    def __new__(cls, /, of: Parameters | Scenario | str | PathLike[str] | None = None, *, seed: SupportsIndex = ..., correlation_rate_1_s: SupportsFloat | SupportsIndex | None = None, acceleration_sd_m_s2: SupportsFloat | SupportsIndex | None = None, range_sd_m: SupportsFloat | SupportsIndex | None = None, bearing_sd_rad: SupportsFloat | SupportsIndex | None = None, initial_velocity_sd_m_s: SupportsFloat | SupportsIndex | None = None, field_of_view_rad: SupportsFloat | SupportsIndex | None = None, field_of_view_margin_rad: SupportsFloat | SupportsIndex | None = None, radius_min_m: SupportsFloat | SupportsIndex | None = None, radius_max_m: SupportsFloat | SupportsIndex | None = None, speed_m_s: SupportsFloat | SupportsIndex | None = None, sense: str | None = None, radial_gain: SupportsFloat | SupportsIndex | None = None, lead: str | None = None, lead_s: SupportsFloat | SupportsIndex | None = None, speed_reference: str | None = None, heading_gain_1_s: SupportsFloat | SupportsIndex | None = None, turn_rate_gain: SupportsFloat | SupportsIndex | None = None, feedforward: str | None = None, objective: str | None = None, assignment_switching_cost: SupportsFloat | SupportsIndex | None = None) -> Parameters: ...
    def __repr__(self, /) -> str: ...
    @property
    def acceleration_sd_m_s2(self, /) -> float: ...
    @property
    def assignment_switching_cost(self, /) -> float: ...
    @property
    def bearing_sd_rad(self, /) -> float: ...
    @property
    def correlation_rate_1_s(self, /) -> float: ...
    @property
    def feedforward(self, /) -> str: ...
    @property
    def field_of_view_margin_rad(self, /) -> float: ...
    @property
    def field_of_view_rad(self, /) -> float: ...
    @property
    def heading_gain_1_s(self, /) -> float: ...
    @property
    def lead(self, /) -> str: ...
    @property
    def lead_s(self, /) -> float: ...
    @property
    def objective(self, /) -> str: ...
    @property
    def radial_gain(self, /) -> float: ...
    @property
    def radius_max_m(self, /) -> float: ...
    @property
    def radius_min_m(self, /) -> float: ...
    @property
    def range_sd_m(self, /) -> float: ...
    @property
    def sense(self, /) -> str: ...
    @property
    def speed_m_s(self, /) -> float: ...
    @property
    def speed_reference(self, /) -> str: ...
    @property
    def initial_velocity_sd_m_s(self, /) -> float: ...
    def to_dict(self, /) -> "dict[str, float | str]":
        """
        All of them by name.
        """
    @property
    def turn_rate_gain(self, /) -> float: ...

@final
class TeamState:
    """
    The team's picture: targets that are known and not lost, and the groups they are in. T targets, G groups, U UAVs, each
    by ascending number.
    """
    @property
    def centre(self, /) -> Incomplete:
        """
        ``(G, 4)``: centre of the orbit and how it moves: x_m, y_m, vx_m_s, vy_m_s.
        """
    @property
    def covariance(self, /) -> Incomplete:
        """
        ``(T, 6, 6)``: covariance of ``state``.
        """
    @property
    def group(self, /) -> Incomplete:
        """
        ``(G,)``: the groups.
        """
    @property
    def held(self, /) -> Incomplete:
        """
        ``(T,)``: it was measured at this instant.
        """
    @property
    def spread_m(self, /) -> Incomplete:
        """
        ``(G,)``: from the centre to the furthest member, m.
        """
    @property
    def standoff_distance_m(self, /) -> Incomplete:
        """
        ``(G,)``: standoff distance r_d (15), m.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
        """
    @property
    def target(self, /) -> Incomplete:
        """
        ``(T,)``: what sensors call the targets.
        """
    @property
    def target_group(self, /) -> Incomplete:
        """
        ``(T,)``: the group whose duty it is; -1: none.
        """
    @property
    def uav(self, /) -> Incomplete:
        """
        ``(U,)``: UAVs heard of late.
        """
    @property
    def uav_group(self, /) -> Incomplete:
        """
        ``(U,)``: the group that each serves; -1: none.
        """
    @property
    def uav_state(self, /) -> Incomplete:
        """
        ``(U, 5)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
        """
    @property
    def uav_vertical(self, /) -> Incomplete | None:
        """
        ``(U, 2)``: altitude_m, climb_rate_m_s; None: altitudes are not flown. NaN: a UAV does not tell its own.
        """

@final
class Report:
    """
    What a teammate says of an instant: where it was, and what its sensor measured.
    """
    @property
    def altitude_m(self, /) -> float | None:
        """
        Its altitude above the plane, m; None: altitudes are not flown.
        """
    @property
    def bearing_rad(self, /) -> Incomplete:
        """
        ``(n,)``: in which direction from it, rad.
        """
    @property
    def boresight_rad(self, /) -> float | None:
        """
        Where its sensor pointed, rad; None: nowhere.
        """
    @property
    def climb_rate_m_s(self, /) -> float | None:
        """
        Its rate of climb, m/s, positive upward; None as ``altitude_m``.
        """
    @property
    def range_m(self, /) -> Incomplete:
        """
        ``(n,)``: how far they were from it, m.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
        """
    @property
    def target(self, /) -> Incomplete:
        """
        ``(n,)``: which targets it measured, ascending.
        """
    @property
    def uav(self, /) -> int:
        """
        Who says it.
        """

@final
class Run:
    """
    A run in its folder: its record, and what it came to.

    ``run.uavs``, ``run.truth``, ``run.tracks``, ``run.groups``, ``run.detections``, ``run.views`` and ``run.events`` are its
    tables (docs/record.md tells their columns). In a notebook it shows itself as the page; ``print`` gives the command's
    table.

    :param dir: the folder of a run, of ``standoff run`` or :func:`run`; its summary and figures are made anew.
    :param metrics: names of metrics and sets of them, as of :func:`run`.
    :raises InputError: there is no record, or it is damaged.
    """
    def __new__(cls, /, dir: str | PathLike[str], *, metrics: str | SupportsGetItem[int, str] = ...) -> Run: ...
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    def _repr_html_(self, /) -> str | None:
        """
        As a notebook shows it: the page that replays it.
        """
    @property
    def detections(self, /) -> Table:
        """
        What the sensors said.
        """
    @property
    def dir(self, /) -> Path:
        """
        The folder of the run.
        """
    @property
    def events(self, /) -> Table:
        """
        What happened.
        """
    @property
    def groups(self, /) -> Table:
        """
        Each group and the orbit about it.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        What the run came to: a float by the name of each metric, None where there was nothing to measure.
        """
    @property
    def scenario_toml(self, /) -> str:
        """
        The scenario that was flown, every value drawn and spelt out, TOML.
        """
    @property
    def summary(self, /) -> dict[str, Any]:
        """
        ``summary.json`` as a dict: what was flown, metrics, events, how each target fared.
        """
    def table(self, /, name: str) -> Table:
        """
        A table of the record.

        :param name: ``uavs``, ``truth``, ``tracks``, ``groups``, ``detections``, ``in_view`` or ``events``; where several minds
            flew, ``agents``, ``agent_tracks``, ``agent_groups``, ``agent_events`` or ``agent_teammates``, too.
        :raises KeyError: there is no table of that name.
        """
    @property
    def tracks(self, /) -> Table:
        """
        Each track: what the team believed of a target.
        """
    @property
    def truth(self, /) -> Table:
        """
        Each target as it really was.
        """
    @property
    def uavs(self, /) -> Table:
        """
        Each UAV at each instant.
        """
    @property
    def views(self, /) -> Table:
        """
        Which targets were in whose view.
        """

@final
class Scenario:
    """
    What is flown: a built-in scenario, a scenario file, or TOML; with changes.

    Before anything is drawn: one scenario for every seed. What is out of range is told when a seed is drawn, flown or
    :meth:`resolved`. docs/scenarios.md lists the keys.

    :param scenario: a built-in scenario's name, or the path of a scenario file (str or os.PathLike).
    :param traffic: fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
    :param uavs: number of UAVs, started on an orbit about the first targets.
    :param set: values to change, by dotted key: ``{"guidance.lead_s": 1.5}``; nested dicts are tables.
    :raises ScenarioError: what is wrong, drawn under what was typed.
    """
    def __new__(cls, /, scenario: Any, *, traffic: str | PathLike[str] | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> Scenario: ...
    def __reduce__(self, /) -> "tuple[object, tuple[object, ...]]": ...
    def __repr__(self, /) -> str: ...
    @staticmethod
    def _restored(name: str, toml: str | None, folder: str | PathLike[str] | None, set: SupportsGetItem[int, str], traffic: str | PathLike[str] | None, uavs: SupportsIndex | None) -> Scenario:
        """
        What was pickled.
        """
    def changed(self, /, *, traffic: str | PathLike[str] | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> Scenario:
        """
        The same with more changes; parameters as of the class.
        """
    @staticmethod
    def from_dict(scenario: dict[str, Any], *, name: str = "scenario") -> Scenario:
        """
        A scenario of nested dicts, as :meth:`to_dict` gives them and as ``tomllib`` reads scenario files.

        :param scenario: tables as dicts, arrays as lists.
        :param name: what it is called.
        :raises ScenarioError: what is wrong, drawn under it as TOML.
        """
    @staticmethod
    def from_toml(toml: str, *, name: str = "scenario") -> Scenario:
        """
        A scenario typed as TOML.

        :param toml: the text, as of a scenario file.
        :param name: what it is called.
        :raises ScenarioError: what is wrong, drawn under what was typed.
        """
    @property
    def name(self, /) -> str:
        """
        What it is called.
        """
    def resolved(self, /, seed: SupportsIndex) -> str:
        """
        The scenario of a seed as TOML with every value drawn and spelt out; loading it gives the same run.

        :param seed: seed of everything random, 0 to 2**63 - 1.
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        :attr:`toml` as nested dicts.
        """
    @property
    def toml(self, /) -> str:
        """
        The scenario as TOML with its changes and all defaults spelt out, before anything is drawn.
        """
    @property
    def traffic_file(self, /) -> Path | None:
        """
        The traffic file, if it is flown over one that is not built in.
        """

@final
class StandoffDistance:
    """
    Standoff distances and their rates.
    """
    @property
    def distance_m(self, /) -> NDArray[float64]:
        """
        (15) within its bounds, r_d, shape (...), m.
        """
    @property
    def rate_m_s(self, /) -> NDArray[float64]:
        """
        Rate of r_d, shape (...), m/s; 0 on a bound.
        """
    @property
    def unclamped_m(self, /) -> NDArray[float64]:
        """
        (15) before the bounds, shape (...), m.
        """

@final
class Steering:
    """
    What the law wants of UAVs, and what it looked at.
    """
    @property
    def centre_distance_m(self, /) -> NDArray[float64]:
        """
        Distance r from the centre, shape (...), m.
        """
    @property
    def centre_too_fast(self, /) -> NDArray[bool_]:
        """
        Where the centre is too fast for the field (29), shape (...); the heading is then the best there is.
        """
    @property
    def convergence_threshold_m2_s(self, /) -> NDArray[float64]:
        """
        Threshold xi_th of Lemma 3.1, shape (...), m2/s: while it is not negative, the UAV converges.
        """
    @property
    def desired_heading_rad(self, /) -> NDArray[float64]:
        """
        Desired heading psi_d over ground (23, 28), shape (...), rad anticlockwise from east.
        """
    @property
    def feedforward_rad_s(self, /) -> NDArray[float64]:
        """
        Its derivative, the feedforward part of the turn rate (25), shape (...), rad/s.
        """
    @property
    def phase_rad(self, /) -> NDArray[float64]:
        """
        Direction from the centre to the UAV, shape (...), rad anticlockwise from east.
        """
    @property
    def turn_rate_rad_s(self, /) -> NDArray[float64]:
        """
        Wanted turn rate u_omega before limits (24), shape (...), rad/s, positive to the left.
        """

@final
class Table:
    """
    A table of results in a Parquet file, read when it is asked for.

    It speaks Arrow's C data interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``,
    ``pandas.DataFrame.from_arrow(table)`` and DuckDB's ``select * from table`` take it over without a copy.
    """
    def __arrow_c_schema__(self, /) -> Any:
        """
        Names and types of the columns as a schema of Arrow's C data interface.
        """
    def __arrow_c_stream__(self, /, requested_schema: Any | None = None) -> Any:
        """
        The table as a stream of Arrow's C data interface.
        """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    @property
    def column_names(self, /) -> list[str]:
        """
        Names of the columns, in their order.
        """
    @property
    def num_rows(self, /) -> int:
        """
        Number of rows.
        """
    def to_numpy(self, /, column: str) -> Any:
        """
        One column as a NumPy array, shape ``(num_rows,)``.

        Numbers where some are missing are float64 with NaN there; text, and truths where some are missing, are
        objects with None.

        :param column: its name; the unit stands behind it.
        :returns: a new array of float64, int64, int32, bool or object.
        :raises KeyError: there is no such column.
        """

@final
class Tracks:
    """
    What a law of your own believes of targets: what its method ``tracks`` gives, where it has one, so that its estimates
    are scored.

    :param target: ``(T,)``: what sensors call the targets, each once.
    :param state: ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
    :param covariance: ``(T, 6, 6)``: covariance of ``state``, of which its upper triangle counts.
    :raises InputError: arrays of other shapes or types, a number that is not finite, a target that is none.
    """
    def __new__(cls, /, target: ArrayLike, state: ArrayLike, covariance: ArrayLike) -> Tracks: ...

@final
class Worlds:
    """
    Missions of one scenario side by side, flown by a policy.

    The mission is the simulator's own: tracking, groups, assignment and where sensors point are the product's; only turn
    rate and speed of the UAVs are the policy's. World i flies one mission after the other: the first with the seed that
    it was reset with, the n-th after that with a seed that depends on that and on n alone. What a world does is a function
    of scenario, seed and actions, whatever there is beside it, on however many threads.

    :param scenario: a built-in name, a path, or a :class:`Scenario`. All seeds must have the same number of UAVs.
    :param count: number of worlds, 1 to 100,000.
    :param autoreset: ``"NextStep"``, ``"SameStep"`` or ``"Disabled"``: what happens to a world whose mission is over.
    :param threads: fly the worlds on so many threads; more than 1 pays from some hundred UAVs on.
    :raises ScenarioError: the scenario cannot be used.
    :raises InputError: another argument is out of range.
    """
    def __new__(cls, /, scenario: Any, *, count: SupportsIndex = 1, autoreset: str = "NextStep", threads: SupportsIndex = 1) -> Worlds: ...
    def close(self, /) -> None:
        """
        Frees all worlds. To close again does nothing; anything else is an error from then on.
        """
    @property
    def count(self, /) -> int:
        """
        Number of worlds.
        """
    def law_actions(self, /) -> Incomplete:
        """
        The action that the product's own law would choose at this instant: to compare with, in the same worlds and by the
        same rewards.

        :returns: (worlds, UAVs, 2), float64, as :meth:`step` takes it.
        :raises InputError: a world was not reset.
        """
    def reset(self, /, seeds: SupportsGetItem[int, SupportsIndex | None], *, mask: SupportsGetItem[int, bool] | None = None) -> Instant:
        """
        Begins missions.

        :param seeds: for each world the seed of its first mission, 0 to 2**63 - 1; or ``None``: its next mission.
        :param mask: for each world whether it is reset at all; without it, all are.
        :returns: the first instant of the missions that begin, and the present one of the others.
        :raises InputError: not a seed for each world; ``None`` for one that has had none; a world is left without mission.
        :raises ScenarioError: what is drawn for a seed cannot be flown. Then no world has changed.
        """
    def step(self, /, actions: Any) -> Instant:
        """
        Flies all worlds until the next instant.

        :param actions: for each world and UAV a turn rate, positive anticlockwise, in ``turn_rate_max_rad_s``, and a
            speed less the nominal one, in ``speed_change_max_m_s``; (worlds, UAVs, 2), float32 or float64. What is beyond
            -1 to 1 is flown at the limit.
        :returns: the instant after that.
        :raises InputError: actions of another shape or type, or a number that is not finite; a world that was not reset
            or, without autoreset, whose mission is over. Then no world has changed.
        :raises ScenarioError: the next mission of a world cannot be flown: it has to be reset. The others have gone on.
        """
    @property
    def uavs(self, /) -> int:
        """
        Number of UAVs of each.
        """

@final
class Zone:
    """
    A polygon that UAVs keep out of, or in.
    """
    @property
    def kind(self, /) -> str:
        """
        ``"keep-out"`` or ``"keep-in"``.
        """
    @property
    def name(self, /) -> str:
        """
        What people call it; may be empty.
        """
    @property
    def points(self, /) -> Incomplete:
        """
        ``(n, 2)``: its corners in order, x_m, y_m; the last is joined to the first.
        """

def _described(scenario: Any, runs: SupportsIndex, seed: SupportsIndex, metrics: str | SupportsGetItem[int, str]) -> str:
    """
    What is flown, as text for other processes and machines: every part of a batch is a function of it.
    """

def _difference(ours: str, theirs: str, shard: str | None) -> str | None:
    """
    In what the batch ``theirs`` differs from ``ours``, in words; None if it does not. Both as :func:`_described` tells
    them, ``ours`` whole or one of its parts.

    :raises InputError: one is no batch, or one of another version of standoff.
    """

def _fly_described(described: str, traffic: str | PathLike[str] | None, shard: str | None, threads: SupportsIndex | None, out: str | PathLike[str], progress: Any | None) -> None:
    """
    Flies what :func:`_described` tells, or one part of it, into a folder; without a page.

    :param traffic: stands in for the scenario's traffic file; it must hold the same.
    """

def assignment(uav_position_m: ArrayLike, target_position_m: ArrayLike, group: ArrayLike, *, serves: ArrayLike | None = None, parameters: Parameters | None = None) -> NDArray[int64]:
    """
    Which UAV serves which group: every one of them one group, so that they tell most about the targets (32, 33, restated:
    docs/ledger.md).

    Exact up to 12 UAVs, beyond a search of bounded length, alike in every run. With fewer UAVs than groups those with the
    most targets are served.

    :param uav_position_m: shape (..., u, 2), east and north, m.
    :param target_position_m: shape (..., t, 2), east and north, m.
    :param group: shape (..., t), the group of each target, any number from 0; -1: none.
    :param serves: shape (..., u), the group that each UAV serves until now, or -1: staying counts assignment_switching_cost.
    :param parameters: range_sd_m, bearing_sd_rad, objective, assignment_switching_cost; the paper's Table I if left out.
    :returns: shape (..., u), the group of each UAV; -1 where there is no group.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def optimal_phase_rad(range_m: ArrayLike, *, parameters: Parameters | None = None) -> NDArray[float64]:
    """
    A separation at which two UAVs at these ranges tell most about a target: pi/2 with both nearer or both further than
    sigma_r / sigma_theta, 0 (or, alike, pi) with one on either side; pi/2 also where separation does not matter.

    :param range_m: shape (..., 2), of both to the target, m.
    :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
    :returns: shape (...), angle at the target between their lines of sight, rad.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def clustering(position_m: ArrayLike, *, count: SupportsIndex, before: ArrayLike | None = None, margin_m: SupportsFloat | SupportsIndex = 0.0, mask: ArrayLike | None = None) -> NDArray[int64]:
    """
    K-means: points near one another form a cluster, and none is empty (30, Algorithm 1).

    :param position_m: shape (..., k, 2), k points of each row, east and north, m.
    :param count: how many clusters to each row; fewer where there are fewer points.
    :param before: shape (..., k), labels to go on from, 0 to count - 1, each at least once; from nothing if left out.
    :param margin_m: with ``before``: a point changes its cluster only if that brings it nearer to its centroid by more
        than this, m; the paper has none.
    :param mask: shape (..., k): False where there is no point; what stands there is not looked at.
    :returns: labels, shape (..., k), 0 to count - 1; -1 where there is no point.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def compare(a: Any, b: Any | None = None, *, runs: SupportsIndex = ..., seed: SupportsIndex = ..., metrics: str | SupportsGetItem[int, str] = ..., threads: SupportsIndex | None = None, law_a: Any | None = None, law_b: Any | None = None, law_limit_s: SupportsFloat | SupportsIndex = 10.0) -> Comparison:
    """
    Compares two scenarios, flown on the same draws, or two complete batches over the seeds and metrics both have.

    :param a: a scenario (a built-in name, a path, a :class:`Scenario`), or a batch (a :class:`Batch`, its folder).
    :param b: the same, for what is compared with it. None: the scenario of ``a``.
    :param runs: number of runs of each scenario, 200 if left out; batches are flown already.
    :param seed: seed of the first run, 1 if left out; the next has the next.
    :param metrics: names of metrics and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
        between, or a list.
    :param threads: number of threads, one per core if None. The numbers are the same with any number.
    :param law_a: a law of your own that flies ``a``, as of :func:`run`; runs are then flown one after the other.
    :param law_b: the same for ``b``.
    :param law_limit_s: how long a law may take to answer, s, above 0.
    :returns: the numbers of ``standoff compare``, to the bit.
    :raises InputError: there is nothing to compare, or a seed cannot be flown. What a law raises comes as it is.
    """

def group_count(uavs: SupportsIndex, targets: SupportsIndex) -> int:
    """
    Number of groups for so many UAVs and targets: half the UAVs, halves rounded up, never more than the targets
    (the K of Algorithm 1).

    :param uavs: how many UAVs.
    :param targets: how many targets.
    :returns: how many groups.
    :raises InputError: a number below 0.
    """

def information_1_m2(uav_position_m: ArrayLike, target_position_m: ArrayLike, *, parameters: Parameters | None = None) -> NDArray[float64]:
    """
    What one measurement tells about a target's position: Fisher information H' R^-1 H (31). Zero within 1 m.

    :param uav_position_m: shape (..., 2), east and north, m.
    :param target_position_m: shape (..., 2), east and north, m.
    :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
    :returns: shape (..., 2, 2), 1/m2. What several UAVs tell of a target adds up.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def led_distance(distance_m: ArrayLike, rate_m_s: ArrayLike, *, speed_m_s: ArrayLike | None = None, parameters: Parameters | None = None) -> tuple[NDArray[float64], NDArray[float64]]:
    """
    The radius steered for while the standoff distance changes: active measure 2 (22), within the bounds.

    :param distance_m: shape (...), standoff distance r_d, m.
    :param rate_m_s: shape (...), its rate, m/s.
    :param speed_m_s: shape (...), speed relative to the centre, of which the lead may depend; the parameters' own if left
        out, m/s.
    :param parameters: lead, lead_s, radial_gain, radius_min_m, radius_max_m; the paper's Table I if left out.
    :returns: radius, shape (...), m, and its rate, shape (...), m/s; 0 on a bound.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def measure(uav_position_m: ArrayLike, target_position_m: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
    """
    Range and bearing from UAVs to targets, without noise (7).

    :param uav_position_m: shape (..., 2), east and north, m.
    :param target_position_m: shape (..., 2), east and north, m.
    :returns: range, shape (...), m, and bearing, shape (...), rad anticlockwise from east, in (-pi, pi].
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def merge(dirs: SupportsGetItem[int, str | PathLike[str]], *, out: str | PathLike[str] | None = None) -> Batch:
    """
    Puts the shards of a batch together: the same files, to the byte, as of the batch in one piece.

    :param dirs: the folders of all shards, in any order.
    :param out: folder for the whole batch. None: a temporary one, which goes with the batch.
    :returns: the complete batch.
    :raises InputError: a shard is missing, incomplete, damaged, there twice or of another batch.
    """

def monte_carlo(scenario: Any, *, runs: SupportsIndex, seed: SupportsIndex = ..., metrics: str | SupportsGetItem[int, str] = ..., threads: SupportsIndex | None = None, shard: str | None = None, out: str | PathLike[str] | None = None, progress: Any | None = None) -> Batch:
    """
    Flies a scenario many times; the same files, to the byte, as ``standoff monte-carlo``.

    Run k, from 0, has ``seed + k``. Whatever stops it (Ctrl-C, a full disk, the end of the process), the same call with
    the same ``out`` goes on where it was. docs/monte-carlo.md tells of files and statistics.

    :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`Scenario`.
    :param runs: number of runs, 1 to 100,000,000.
    :param seed: seed of the first run, from 0; 1 if left out.
    :param metrics: names of metrics and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
        between, or a list.
    :param threads: number of threads, one per core if None. The results are the same with any number.
    :param shard: fly only part I of N, from 0: ``"0/4"``; :func:`merge` puts the parts together.
    :param out: folder for the results. None: a temporary one, which goes with the batch.
    :param progress: called as ``progress(done, of)``, runs, some times a second and at the end. What it raises stops the batch.
    :returns: the complete batch.
    :raises InputError: the scenario or an argument is wrong, a seed cannot be flown, or ``out`` holds something else.
    :raises StandoffError: something failed while running; runs that are complete are kept in ``out``.
    """

def observation_features() -> list[tuple[str, float, float, str]]:
    """
    The numbers of a UAV's observation, in their order: name, lowest and highest value, and what it is.

    Distances, speeds and angles are in units of the scenario's own limits, as each says; what is beyond a bound is at it.
    """

def pair_information_1_m4(range_m: ArrayLike, desired_phase_rad: ArrayLike, *, parameters: Parameters | None = None) -> NDArray[float64]:
    """
    Determinant of what two UAVs tell together about a target's position (36).

    :param range_m: shape (..., 2), of both to the target, m; one within 1 m tells nothing.
    :param desired_phase_rad: shape (...), angle gamma at the target between their lines of sight, rad.
    :param parameters: of the sensor: range_sd_m, bearing_sd_rad; the paper's Table I if left out.
    :returns: shape (...), 1/m4.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def run(scenario: Any | None = None, *, seed: SupportsIndex = ..., traffic: str | PathLike[str] | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None, metrics: str | SupportsGetItem[int, str] = ..., out: str | PathLike[str] | None = None, maps: SupportsGetItem[int, str | PathLike[str]] = ..., law: Any | None = None, law_limit_s: SupportsFloat | SupportsIndex = 10.0, baseline: bool = False) -> Run:
    """
    Flies a scenario into a record: the same files, to the byte, as ``standoff run``, and the same numbers.

    :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`Scenario`. None: what the command
        flies: ``improved/figure-9``, or over traffic ``traffic/convoy``.
    :param seed: seed of everything random, 0 to 2**63 - 1; 1 if left out.
    :param traffic: fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
    :param uavs: number of UAVs, started on an orbit about the first targets.
    :param set: values of the scenario to change, by dotted key.
    :param metrics: names of docs/metrics.md and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
        between, or a list.
    :param out: folder for the results. None: a temporary one, which goes with the run.
    :param maps: SUMO nets or GeoJSON to show under the vehicles.
    :param law: a law of your own that flies in the place of the product: a class like :class:`Law`, or whatever is called
        with a :class:`MissionInfo` and gives an object that decides.
    :param law_limit_s: how long a law may take to answer, s, above 0.
    :param baseline: tell beside it what greedy discs that know where every target is would watch.
    :returns: the run.
    :raises ScenarioError: the scenario cannot be used; what is wrong is drawn under what was typed.
    :raises InputError: another argument is wrong, or ``out`` holds something else.
    :raises StandoffError: something failed while running: the disk, a law that never answers. What a law raises comes as it
        is. A note says what is kept of the run.
    """

def scenarios() -> list[str]:
    """
    Names of the built-in scenarios, in the order in which a newcomer may read them.
    """

def enclosing_circle(position_m: ArrayLike, *, mask: ArrayLike | None = None) -> tuple[NDArray[float64], NDArray[float64]]:
    """
    The smallest circle about points.

    :param position_m: shape (..., k, 2), k points of each row, east and north, m.
    :param mask: shape (..., k): False where there is no point; what stands there is not looked at.
    :returns: centre, shape (..., 2), m, and radius, shape (...), m.
    :raises InputError: an argument of another shape or type, a number out of range, or a row without points.
    """

def standoff_distance(spread_m: ArrayLike, *, spread_rate_m_s: ArrayLike | None = None, margin_m: ArrayLike | None = None, parameters: Parameters | None = None) -> StandoffDistance:
    """
    The standoff distance at which a group's furthest member lies inside the field of view (15).

    :param spread_m: shape (...), d_max, how far the furthest member is from the centre, m.
    :param spread_rate_m_s: shape (...), how fast that grows, m/s.
    :param margin_m: shape (...), d_m, m.
    :param parameters: field_of_view_rad, field_of_view_margin_rad, radius_min_m, radius_max_m; the paper's Table I if
        left out.
    :returns: distances, within bounds and not, and their rates.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def steer(uav_position_m: ArrayLike, heading_rad: ArrayLike, centre_m: ArrayLike, *, distance_m: ArrayLike, rate_m_s: ArrayLike | None = None, steered_radius_m: ArrayLike | None = None, steered_rate_m_s: ArrayLike | None = None, centre_velocity_m_s: ArrayLike | None = None, speed_m_s: ArrayLike | None = None, uav_speed_m_s: ArrayLike | None = None, turn_rate_rad_s: ArrayLike | None = None, parameters: Parameters | None = None) -> Steering:
    """
    Steers UAVs onto orbits: the vector field about a centre that moves, and the turn rate of the Lyapunov law (23-25,
    28, 29).

    :param uav_position_m: shape (..., 2), east and north, m.
    :param heading_rad: shape (...), where the nose points, rad anticlockwise from east.
    :param centre_m: shape (..., 2), estimated centre of the orbit, east and north, m.
    :param distance_m: shape (...), standoff distance r_d, m.
    :param rate_m_s: shape (...), its rate, m/s.
    :param steered_radius_m: shape (...), radius steered for (22), of :func:`led_distance`, m; distance_m if left out.
    :param steered_rate_m_s: shape (...), its rate, m/s; rate_m_s if left out.
    :param centre_velocity_m_s: shape (..., 2), velocity of the centre, east and north, m/s.
    :param speed_m_s: shape (...), the speed over ground that is commanded, m/s; the parameters' own if left out.
    :param uav_speed_m_s: shape (...), the speed flown now, m/s, which only the feedforward ``"actual"`` looks at;
        speed_m_s if left out.
    :param turn_rate_rad_s: shape (...), the turn rate flown now, rad/s, which only a turn_rate_gain above 0 looks at.
    :param parameters: sense, radial_gain, speed_reference, heading_gain_1_s, turn_rate_gain, feedforward, speed_m_s; the
        paper's Table I if left out.
    :returns: the turn rate, and what it is made of.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def vector_field(uav_position_m: ArrayLike, centre_m: ArrayLike, *, distance_m: ArrayLike, speed_m_s: ArrayLike | None = None, parameters: Parameters | None = None) -> NDArray[float64]:
    """
    The Lyapunov vector field onto a circle about a centre at rest (13), with the direction of (20) where k_l is below 1.

    :param uav_position_m: shape (..., 2), east and north, m.
    :param centre_m: shape (..., 2), east and north, m.
    :param distance_m: shape (...), radius r_d of the circle, m.
    :param speed_m_s: shape (...), length of the field, m/s; the parameters' own if left out.
    :param parameters: sense, radial_gain, speed_m_s; the paper's Table I if left out.
    :returns: desired velocity relative to the centre, shape (..., 2), east and north, m/s; at the very centre it points
        east.
    :raises InputError: an argument of another shape or type, or a number out of range.
    """

def wrapped_angle_rad(angle_rad: ArrayLike) -> NDArray[float64]:
    """
    Angles brought into (-pi, pi].

    :param angle_rad: shape (...), rad.
    :returns: the same angles in (-pi, pi], shape (...), rad.
    :raises InputError: an argument of another shape or type, or a number that is none.
    """

def baseline(scenario: Any | None = None, *, seed: SupportsIndex = ..., traffic: str | PathLike[str] | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> dict[str, Any]:
    """
    What greedy discs that know where every target is would watch: the numbers of ``standoff baseline``.

    :param scenario: as of :func:`run`, as are the other parameters.
    :returns: ``{"scenario", "seed", "duration_s", "uavs", "targets", "yardstick": {"disc_radius_m", "half", "all"}}``.
    :raises ScenarioError: the scenario cannot be used.
    """
