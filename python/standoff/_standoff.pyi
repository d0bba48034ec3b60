"""
Cooperative standoff tracking: runs, batches, custom laws, and components of the library on NumPy arrays.
"""

from _typeshed import Incomplete, SupportsGetItem, SupportsLenAndGetItem
from collections.abc import Sequence
from numpy.typing import ArrayLike
from os import PathLike
from pathlib import Path
from standoff._frames import DataFrame
from typing import Any, Final, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "AssignmentProblem", "Batch", "Command", "Comparison", "Cue", "EnvStep", "Filter", "Intruder", "MissionInfo", "Observation", "Report", "Run", "Scenario", "StandoffDistance", "Steering", "Sweep", "Table", "TeamState", "Tracks", "Worlds", "Zone", "_described", "_difference", "_fly_described", "_sweep_complete", "_sweep_difference", "_sweep_plan", "baseline", "compare", "merge", "monte_carlo", "observation_features", "run", "scenarios", "standoff_distance", "steer", "sweep"]

__version__: Final[str]

@final
class AssignmentProblem:
    """
    Input of an assignment law: U UAVs and G groups, each in ascending order of their ids.
    """
    @property
    def current_group(self, /) -> Incomplete:
        """
        Id of the group to which each UAV is currently assigned, shape ``(U,)``; -1: none.
        """
    @property
    def group(self, /) -> Incomplete:
        """
        Ids of the groups, shape ``(G,)``. The numbers only identify the groups.
        """
    @property
    def members(self, /) -> list[Incomplete]:
        """
        For each group the positions of its targets, shape ``(n, 2)``: x_m, y_m.
        """
    @property
    def position(self, /) -> Incomplete:
        """
        Positions of the UAVs, shape ``(U, 2)``: x_m, y_m.
        """
    @property
    def time_s(self, /) -> float:
        """
        Time since the start of the mission, s.
        """
    @property
    def uav(self, /) -> Incomplete:
        """
        Ids of the UAVs that can be assigned, shape ``(U,)``.
        """

@final
class Batch:
    """
    A complete Monte Carlo batch, read from its folder.

    :param dir: folder written by ``standoff monte-carlo``, :func:`monte_carlo` or :func:`merge`.
    :raises InputError: if the folder holds no complete batch, or a file was changed after it was written.
    """
    def __new__(cls, /, dir: str | PathLike[str]) -> Batch: ...
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str:
        """
        HTML for notebooks: the report page of the batch or, if it is missing, a table of the statistics.
        """
    @property
    def dir(self, /) -> Path:
        """
        Folder of the batch: ``runs.parquet``, ``summary.json``, ``monte-carlo.json``, ``report.html``.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        Statistics of each metric over the runs: ``n``, ``mean``, ``ci95``, ``sd``, ``p5``, ``p50``, ``p95``, ``max``.
        """
    @property
    def metrics_table(self, /) -> Table:
        """
        The statistics as a table, one row per metric, with ``metric``, ``label``, ``unit``, ``n``, ``mean``, ``ci95_low``,
        ``ci95_high`` and the others of :attr:`metrics`. Fractions are 0 to 1, and have, like all numbers without a unit,
        the unit 1.
        """
    @property
    def runs(self, /) -> Table:
        """
        ``runs.parquet``: one row per run, in seed order, with ``run``, ``seed`` and one column per metric.
        """
    @property
    def summary(self, /) -> dict[str, Any]:
        """
        ``summary.json`` as a dict: the scenario, seeds and number of runs, and the statistics of every metric.
        """

@final
class Command:
    """
    Command of a law to a UAV for one time step. Values beyond the UAV's limits are clipped.

    :param speed_m_s: speed, m/s.
    :param turn_rate_rad_s: turn rate, rad/s, positive anticlockwise.
    :param pointing_target: point at which the sensor is pointed: (x_m, y_m), or (x_m, y_m, vx_m_s, vy_m_s) for a moving
        point. None: the pointing of the built-in controller, if it runs alongside the law; otherwise the sensor is not
        pointed.
    :param altitude_m: altitude above the x-y plane, m. None: the altitude of the built-in controller, if it runs
        alongside the law.
    :param group: group to which the UAV is assigned, for the metrics; if the law sees the team state, one of its
        groups.
    :raises InputError: if a value is not finite, or the altitude is beyond 100 km.
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
    Paired comparison of B with A, run by run with the same seeds. The numbers are bit for bit those of ``standoff
    compare``.

    docs/user/monte-carlo.md explains each number.
    """
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str:
        """
        The text that ``standoff compare`` prints.
        """
    def _repr_html_(self, /) -> str:
        """
        HTML for notebooks: the verdict, and a table with means, differences, intervals and verdicts of all metrics that
        have a value.
        """
    @property
    def a(self, /) -> str:
        """
        Description of A.
        """
    @property
    def b(self, /) -> str:
        """
        Description of B.
        """
    @property
    def json(self, /) -> str:
        """
        Output of ``standoff compare --json``.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        Results of each metric: ``mean_a``, ``mean_b``, ``difference`` (B - A), ``ci95``, ``differs``, ...
        """
    @property
    def metrics_table(self, /) -> Table:
        """
        The differences as a table, one row per metric, with ``metric``, ``label``, ``unit``, ``n``, ``mean_a``, ``mean_b``,
        ``difference`` (B - A), its interval ``ci95_low`` to ``ci95_high``, ``b_smaller``, ``interest`` and the ``verdict``:
        "A better", "B better", "differs", "same" or "unclear". Fractions are 0 to 1, and have, like all numbers without a
        unit, the unit 1.
        """
    @property
    def runs(self, /) -> int:
        """
        Number of runs of A and of B each.
        """
    @property
    def seed(self, /) -> int:
        """
        First seed.
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        Returns the output of ``standoff compare --json`` as a dict.
        """

@final
class Cue:
    """
    Cue: the position and velocity of a new target, sent by a cue source such as a search aircraft.
    """
    @property
    def position_sd_m(self, /) -> float:
        """
        Standard deviation of the position per axis, m.
        """
    @property
    def priority(self, /) -> float | None:
        """
        New priority of the target; ``None``: unchanged.
        """
    @property
    def target(self, /) -> int | None:
        """
        Identity of the target; ``None`` if the source does not know it.
        """
    @property
    def velocity_sd_m_s(self, /) -> float:
        """
        Standard deviation of the velocity per axis, m/s.
        """
    @property
    def vx_m_s(self, /) -> float:
        """
        Velocity east, m/s.
        """
    @property
    def vy_m_s(self, /) -> float:
        """
        Velocity north, m/s.
        """
    @property
    def x_m(self, /) -> float:
        """
        Position east, m.
        """
    @property
    def y_m(self, /) -> float:
        """
        Position north, m.
        """

@final
class EnvStep:
    """
    Current time step of all worlds: the observations for the next decision and the results of the last step.
    """
    @property
    def duration_s(self, /) -> Incomplete:
        """
        Time of the last time step of the mission, s, shape (worlds,).
        """
    @property
    def ended(self, /) -> EnvStep | None:
        """
        With ``"SameStep"``: the last time step of the missions that ended in the last step; entries of the other worlds
        equal those of this object. ``None`` if no mission ended.
        """
    @property
    def has_ended(self, /) -> Incomplete:
        """
        With ``"SameStep"``: True for worlds whose mission ended in the last step, shape (worlds,).
        """
    @property
    def has_orbit(self, /) -> Incomplete:
        """
        True if the group of at least one UAV has a true orbit, shape (worlds,).
        """
    @property
    def in_custody(self, /) -> Incomplete:
        """
        Fraction of the existing targets in custody: in a group and truly in some UAV's view, shape (worlds,).
        """
    @property
    def mean_on_orbit(self, /) -> Incomplete:
        """
        Mean of `on_orbit` over the UAVs, shape (worlds,).
        """
    @property
    def observations(self, /) -> Incomplete:
        """
        Observation of each UAV, from the team state, shape (worlds, UAVs, features); :func:`observation_features`
        describes the features.
        """
    @property
    def on_orbit(self, /) -> Incomplete:
        """
        Closeness of each UAV to its group's true orbit, 0 to 1 (1: on the orbit), shape (worlds, UAVs).
        """
    @property
    def rewards(self, /) -> Incomplete:
        """
        Team reward of the last step, 0 to 1, shape (worlds,); 0 if the mission has just started.
        """
    @property
    def seeds(self, /) -> Incomplete:
        """
        Seed of the mission, shape (worlds,); ``standoff.run(scenario, seed=...)`` simulates the same world.
        """
    @property
    def standoff_error_m(self, /) -> Incomplete:
        """
        Mean distance of the UAVs from their groups' true orbits, m, shape (worlds,); 0 if `has_orbit` is False.
        """
    @property
    def targets(self, /) -> Incomplete:
        """
        Number of existing targets, shape (worlds,).
        """
    @property
    def terminated(self, /) -> Incomplete:
        """
        True if targets exist but none has a live track any more, shape (worlds,).
        """
    @property
    def time_s(self, /) -> Incomplete:
        """
        Time since the start of the mission, s, shape (worlds,).
        """
    @property
    def truncated(self, /) -> Incomplete:
        """
        True if the mission has reached the scenario's duration, shape (worlds,).
        """
    @property
    def uav_rewards(self, /) -> Incomplete:
        """
        Reward of each UAV for the last step, 0 to 1, shape (worlds, UAVs).
        """

@final
class Filter:
    """
    Extended information filters (8-11), one for each of n targets. One update fuses the measurements of all UAVs.

    The state of a target is ``[x, vx, ax, y, vy, ay]``: position (m), velocity (m/s), acceleration (m/s2), first east
    and then north. States and covariances can be copied to another filter without rounding: ``Filter(f.state[mask],
    f.covariance[mask])`` keeps a subset of the targets.

    :param state: means, shape (n, 6), or (6,) for all targets, between -1e9 and 1e9.
    :param covariance: covariances P, shape (n, 6, 6), or (6, 6) for all targets; positive definite. Only the upper
        triangle is used.
    :param mission: mission whose accuracy of the sensor and motion of the targets apply; by default the recommended
        parameters.
    :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
    """
    def __new__(cls, /, state: ArrayLike, covariance: ArrayLike, *, mission: MissionInfo | None = None) -> Filter: ...
    @property
    def covariance(self, /) -> Incomplete:
        """
        Covariances P, shape (n, 6, 6), in the units of the states; a copy.
        """
    @property
    def position_m(self, /) -> Incomplete:
        """
        Positions, shape (n, 2), east and north, m; a copy.
        """
    def predict(self, /, dt_s: SupportsFloat | SupportsIndex) -> None:
        """
        Predicts all estimates over a time step (8, 9).

        :param dt_s: length of the time step, 0 to 3,600 s; rounded to the nearest microsecond.
        :raises InputError: if the time is out of range, or an estimate would overflow floating-point numbers; the
            filter then stays unchanged.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        Means, shape (n, 6): ``[x, vx, ax, y, vy, ay]`` in m, m/s, m/s2; a copy.
        """
    def update(self, /, uav_position_m: ArrayLike, range_m: ArrayLike, bearing_rad: ArrayLike) -> Incomplete:
        """
        Updates the estimates with the measurements of m UAVs at this time (10, 11), linearised about the predicted
        positions. Bearing innovations are wrapped.

        :param uav_position_m: shape (m, 2), or (2,) for one UAV, east and north, m, between -1e9 and 1e9.
        :param range_m: shape (n, m), or (n,) for one UAV, m, above 0 and at most 1e9; NaN: no measurement. A measurement
            taken less than 1 m from the predicted position carries no information.
        :param bearing_rad: same shape, rad anticlockwise from east; NaN: no measurement.
        :returns: shape (n,): True if the estimate was updated. False if there was no measurement or the result would
            overflow floating-point numbers; the estimate then stays unchanged.
        :raises InputError: if an argument has the wrong shape or type or a value is out of range; the filter then stays
            unchanged.
        """

@final
class Intruder:
    """
    Traffic report of an aircraft outside the team: its position and motion.
    """
    @property
    def altitude_m(self, /) -> float | None:
        """
        Altitude above the x-y plane, m; None if the aircraft does not report it.
        """
    @property
    def climb_rate_m_s(self, /) -> float | None:
        """
        Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
        """
    @property
    def intruder(self, /) -> int:
        """
        Index of the intruder in the scenario, from 0.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        State of the aircraft, shape ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
        """
    @property
    def time_s(self, /) -> float:
        """
        Time of validity, s since the start of the mission; with communication delay, earlier than the current time.
        """

@final
class MissionInfo:
    """
    Information about a scenario that the team may use: UAV limits, sensor, orbits and zones.
    """
    @property
    def bearing_sd_rad(self, /) -> float:
        """
        Standard deviation of measured bearings, rad.
        """
    @property
    def duration_s(self, /) -> float:
        """
        Duration of the mission, s.
        """
    @property
    def field_of_view_rad(self, /) -> float:
        """
        Field of view of the sensors, full angle, rad.
        """
    @property
    def period_s(self, /) -> float:
        """
        Length of a time step, s.
        """
    @property
    def radius_max_m(self, /) -> float:
        """
        Largest orbit radius, m.
        """
    @property
    def radius_min_m(self, /) -> float:
        """
        Smallest orbit radius, m.
        """
    @property
    def range_sd_m(self, /) -> float:
        """
        Standard deviation of measured ranges, m.
        """
    @property
    def sensing_range_m(self, /) -> float:
        """
        Sensing range, m.
        """
    @property
    def speed_change_max_m_s(self, /) -> float:
        """
        Maximum difference of a commanded speed from the nominal speed, m/s.
        """
    @property
    def speed_m_s(self, /) -> float:
        """
        Nominal speed, m/s.
        """
    @property
    def turn_rate_max_rad_s(self, /) -> float:
        """
        Maximum turn rate, rad/s.
        """
    @property
    def uav(self, /) -> int | None:
        """
        UAV for which the law decides; None: all UAVs.
        """
    @property
    def uavs(self, /) -> int:
        """
        Number of UAVs; their ids start at 0.
        """
    @property
    def zones(self, /) -> list[Zone]:
        """
        Keep-out and keep-in zones of the scenario.
        """

@final
class Observation:
    """
    Inputs of a UAV's agent at one time step: its own state and sensor scan, the received messages and, for laws with
    ``sees = "team-state"``, the team state.
    """
    @property
    def altitude_m(self, /) -> float | None:
        """
        Altitude above the x-y plane, m; None if the scenario has no altitudes.
        """
    @property
    def builtin_command(self, /) -> Command | None:
        """
        Command of the built-in controller for the UAV; None if it does not run alongside the law.
        """
    @property
    def climb_rate_m_s(self, /) -> float | None:
        """
        Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
        """
    @property
    def cues(self, /) -> list[Cue]:
        """
        Cues for targets that have just appeared.
        """
    @property
    def heading_rad(self, /) -> float:
        """
        Heading, rad.
        """
    @property
    def intruders(self, /) -> list[Intruder]:
        """
        Traffic reports of aircraft outside the team, in ascending order of ``intruder``; aircraft whose transponder is
        off are missing.
        """
    @property
    def reports(self, /) -> list[Report]:
        """
        Reports of the teammates about this time step, in ascending order of UAV.
        """
    @property
    def scan(self, /) -> Report | None:
        """
        Own report with the measurements of the own sensor; None during an outage of the UAV.
        """
    @property
    def speed_m_s(self, /) -> float:
        """
        Speed, m/s.
        """
    @property
    def team_state(self, /) -> TeamState | None:
        """
        Team state, for laws with ``sees = "team-state"``; otherwise None.
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
        Id of the UAV.
        """
    @property
    def x_m(self, /) -> float:
        """
        Own position east, m.
        """
    @property
    def y_m(self, /) -> float:
        """
        Own position north, m.
        """

@final
class Report:
    """
    Report of a UAV about one time step: its state and the measurements of its sensor.
    """
    @property
    def altitude_m(self, /) -> float | None:
        """
        Altitude above the x-y plane, m; None if the scenario has no altitudes.
        """
    @property
    def bearing_rad(self, /) -> Incomplete:
        """
        Measured bearings from the UAV to the targets, shape ``(n,)``, rad.
        """
    @property
    def boresight_rad(self, /) -> float | None:
        """
        Direction in which the sensor pointed, rad; None if it was not pointed.
        """
    @property
    def climb_rate_m_s(self, /) -> float | None:
        """
        Climb rate, m/s, positive upward; None if ``altitude_m`` is None.
        """
    @property
    def range_m(self, /) -> Incomplete:
        """
        Measured ranges from the UAV to the targets, shape ``(n,)``, m.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        State of the UAV, shape ``(5,)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
        """
    @property
    def target(self, /) -> Incomplete:
        """
        Measured targets in ascending order, shape ``(n,)``.
        """
    @property
    def uav(self, /) -> int:
        """
        UAV that sent the report.
        """

@final
class Run:
    """
    A recorded run, read from its folder: its tables and its results.

    ``run.uavs``, ``run.truth``, ``run.tracks``, ``run.groups``, ``run.detections``, ``run.in_view`` and ``run.events``
    are its tables (docs/user/record.md describes their columns); ``run.targets`` has the scores of each target. A notebook
    shows the report page of the run; ``print`` shows the same table as the command line.

    :param dir: folder written by ``standoff run`` or :func:`run`; the summary and the figures in it are recomputed.
    :param metrics: names of metrics and of sets, as for :func:`run`.
    :param map: background map that replaces the one in the record: a SUMO net (.net.xml) or GeoJSON, plain or .gz, or a
        list of them.
    :raises InputError: if the folder holds no record, or the record is damaged.
    """
    def __new__(cls, /, dir: str | PathLike[str], *, metrics: str | Sequence[str] = ..., map: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None) -> Run: ...
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    def _repr_html_(self, /) -> str | None:
        """
        HTML for notebooks: the report page that replays the run.
        """
    @property
    def detections(self, /) -> Table:
        """
        Detections of the sensors.
        """
    @property
    def dir(self, /) -> Path:
        """
        Folder of the run.
        """
    @property
    def events(self, /) -> Table:
        """
        Events of the run.
        """
    @property
    def groups(self, /) -> Table:
        """
        Groups and their orbits at each time step.
        """
    @property
    def in_view(self, /) -> Table:
        """
        Targets in the view of each UAV.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        Metrics of the run: a float for each name, or None if the metric is not defined for this run.
        """
    @property
    def metrics_table(self, /) -> Table:
        """
        Metrics as a table, one row per metric, with ``metric``, ``label``, ``unit`` and ``value``. Fractions are 0 to 1,
        and have, like all numbers without a unit, the unit 1.
        """
    @property
    def scenario_toml(self, /) -> str:
        """
        Scenario of the run as TOML, with all random values drawn and all defaults.
        """
    @property
    def summary(self, /) -> dict[str, Any]:
        """
        ``summary.json`` as a dict: scenario, metrics, events, and results of each target.
        """
    def table(self, /, name: str) -> Table:
        """
        Opens a table of the record.

        :param name: ``uavs``, ``truth``, ``tracks``, ``groups``, ``detections``, ``in_view`` or ``events``; in runs
            with intruders also ``intruders``; in runs with tentative tracks also ``tentative``; in runs with one
            agent per UAV also ``agents``, ``agent_tracks``, ``agent_groups``, ``agent_events`` or ``agent_teammates``.
        :raises KeyError: if no table has this name.
        """
    @property
    def targets(self, /) -> Table:
        """
        Scores of each target, one row per target: custody, longest time out of view, position error, ANEES.
        """
    def to_geodataframe(self, /, table: str = "tracks") -> Any:
        """
        Makes a ``geopandas.GeoDataFrame`` of a table: its rows with their places as points (EPSG:4326); needs GeoPandas.

        :param table: name of the table, as for :meth:`table`.
        :raises InputError: if the rows have no latitude and longitude: only runs over traffic in degrees, and flights,
            are at a place on the Earth.
        """
    @property
    def tracks(self, /) -> Table:
        """
        Tracks: the team's estimate of each target at each time step.
        """
    @property
    def truth(self, /) -> Table:
        """
        True state of each target at each time step.
        """
    @property
    def uavs(self, /) -> Table:
        """
        State of each UAV at each time step.
        """

@final
class Scenario:
    """
    A scenario: a built-in one, a scenario file, or TOML text, with changes.

    Random values are not drawn yet, so one object serves all seeds. Values out of range are reported when the scenario
    is run or :meth:`resolved` with a seed. docs/user/scenarios.md lists the keys.

    :param scenario: name of a built-in scenario, or path of a scenario file (str or os.PathLike).
    :param traffic: traffic with the targets: a file (SUMO floating-car data, CSV tracks or GPX, plain or .gz), or a data
        frame of pandas, polars or pyarrow with the columns of CSV tracks (docs/user/your-own-traffic.md).
    :param uavs: number of UAVs, started on an orbit about the first targets.
    :param set: values to change, by dotted key: ``{"guidance.lead_s": 1.5}``; nested dicts are tables.
    :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
    """
    def __new__(cls, /, scenario: Any, *, traffic: str | PathLike[str] | DataFrame | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> Scenario: ...
    def __reduce__(self, /) -> "tuple[object, tuple[object, ...]]": ...
    def __repr__(self, /) -> str: ...
    @staticmethod
    def _restored(name: str, toml: str | None, folder: str | PathLike[str] | None, set: SupportsGetItem[int, str], traffic: SupportsGetItem[int, str | PathLike[str]], uavs: SupportsIndex | None, csv: bytes | None) -> Scenario:
        """
        Restores a pickled scenario.
        """
    def _saved_traffic(self, /, folder: str | PathLike[str]) -> list[Path]:
        """
        Returns the traffic files; writes that of a data frame to a folder first.
        """
    def changed(self, /, *, traffic: str | PathLike[str] | DataFrame | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> Scenario:
        """
        Returns a copy with further changes; parameters as for the class.
        """
    @staticmethod
    def from_dict(scenario: dict[str, Any], *, name: str = "scenario") -> Scenario:
        """
        Makes a scenario from nested dicts, as returned by :meth:`to_dict` or by ``tomllib`` for a scenario file.

        :param scenario: tables as dicts, arrays as lists.
        :param name: name of the scenario.
        :raises ScenarioError: if the scenario is invalid; the message shows the line as TOML and marks the position.
        """
    @staticmethod
    def from_toml(toml: str, *, name: str = "scenario") -> Scenario:
        """
        Makes a scenario from TOML text.

        :param toml: text in the format of a scenario file.
        :param name: name of the scenario.
        :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
        """
    @property
    def name(self, /) -> str:
        """
        Name of the scenario.
        """
    def resolved(self, /, seed: SupportsIndex) -> str:
        """
        Returns the scenario as TOML with all random values drawn and all defaults. Running it gives the same results.

        :param seed: seed of all random values, 0 to 2**63 - 1.
        :raises ScenarioError: if a value is out of range.
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        Returns :attr:`toml` as nested dicts.
        """
    @property
    def toml(self, /) -> str:
        """
        The scenario as TOML with its changes and all defaults, before random values are drawn.
        """
    @property
    def traffic_files(self, /) -> list[Path]:
        """
        Traffic files of the scenario; empty if it uses none, a built-in one or a data frame.
        """

@final
class StandoffDistance:
    """
    Standoff distances and their rates.
    """
    @property
    def distance_m(self, /) -> Incomplete:
        """
        Standoff distance r_d of (15), limited to its bounds, shape (n,) or (), m.
        """
    @property
    def rate_m_s(self, /) -> Incomplete:
        """
        Rate of r_d, shape (n,) or (), m/s; 0 at a bound.
        """
    @property
    def unclamped_m(self, /) -> Incomplete:
        """
        Standoff distance of (15) before the bounds are applied, shape (n,) or (), m.
        """

@final
class Steering:
    """
    Output of the turn-rate law.
    """
    @property
    def centre_too_fast(self, /) -> Incomplete:
        """
        True if the centre is too fast for the field (29), shape (n,) or (); the heading is then the best possible one.
        """
    @property
    def desired_heading_rad(self, /) -> Incomplete:
        """
        Desired heading psi_d over ground (23, 28), shape (n,) or (), rad anticlockwise from east.
        """
    @property
    def feedforward_rad_s(self, /) -> Incomplete:
        """
        Derivative of the desired heading, the feedforward part of the turn rate (25), shape (n,) or (), rad/s.
        """
    @property
    def turn_rate_rad_s(self, /) -> Incomplete:
        """
        Commanded turn rate u_omega before limits (24), shape (n,) or (), rad/s, positive to the left.
        """

@final
class Sweep:
    """
    A complete sweep, read from its folder: a Monte Carlo batch at each point of a grid or a Latin hypercube.

    :attr:`table` has the results, ``print`` shows the means with their intervals, and a notebook shows the page.

    :param dir: folder written by ``standoff sweep`` or :func:`sweep`.
    :raises InputError: if the folder holds no complete sweep, or a file was changed after it was written.
    """
    def __len__(self, /) -> int:
        """
        Number of points.
        """
    def __new__(cls, /, dir: str | PathLike[str]) -> Sweep: ...
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str:
        """
        The text that ``standoff sweep`` prints, for all metrics.
        """
    def _repr_html_(self, /) -> str | None:
        """
        HTML for notebooks: the page with the plot and the table.
        """
    def batch(self, /, point: SupportsIndex) -> Batch:
        """
        Opens the batch of a point.

        :param point: index of the point, from 0.
        :raises IndexError: if there is no such point.
        """
    @property
    def dir(self, /) -> Path:
        """
        Folder of the sweep: ``sweep.json``, ``sweep.parquet``, ``report.html``, and the batches in ``points``.
        """
    @property
    def table(self, /) -> Table:
        """
        ``sweep.parquet``: one row per point, with ``point``, a column per key, and for every metric its mean, the ends of
        the mean's 95 % confidence interval (``..._ci95_low``, ``..._ci95_high``), standard deviation (``..._sd``) and
        number of runs with a value (``..._n``).
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        Returns the output of ``standoff sweep --json`` as a dict.
        """

@final
class Table:
    """
    A result table.

    ``table["x_m"]`` is a column as a NumPy array, :attr:`columns` lists the columns, and ``len(table)`` is the number of
    rows. :meth:`to_pandas` and :meth:`to_polars` make data frames. A table of a file is read on demand.

    It supports the Arrow C data interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``,
    ``pandas.DataFrame.from_arrow(table)`` and DuckDB's ``select * from table`` read it without a copy.
    """
    def __arrow_c_schema__(self, /) -> Any:
        """
        Exports names and types of the columns as a schema of the Arrow C data interface.
        """
    def __arrow_c_stream__(self, /, requested_schema: Any | None = None) -> Any:
        """
        Exports the table as a stream of the Arrow C data interface.
        """
    def __contains__(self, column: str, /) -> bool: ...
    def __getitem__(self, column: str, /) -> Any:
        """
        Returns one column, as :meth:`to_numpy`.
        """
    def __iter__(self, /) -> Any:
        """
        Iterates over the rows, as tuples that know the names of the columns: ``pandas.DataFrame(table)`` uses them.
        :meth:`to_pandas` is faster.
        """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    def _head(self, /, rows: SupportsIndex) -> Table:
        """
        Returns the first rows, at most those of a record batch, as a table in memory.
        """
    def _repr_html_(self, /) -> str:
        """
        HTML for notebooks: the first rows.
        """
    @property
    def columns(self, /) -> list[str]:
        """
        Names of the columns, in order; the suffix of a name is the unit.
        """
    def to_numpy(self, /, column: str) -> Any:
        """
        Reads one column as a NumPy array, shape ``(len(table),)``.

        Numeric columns with missing values become float64 with NaN. Text columns, and boolean columns with missing
        values, become object arrays with None. Times in UTC become datetime64[us].

        :param column: name of the column; its suffix is the unit.
        :returns: a new array of float64, int64, int32, bool, datetime64 or object.
        :raises KeyError: if no column has this name.
        """
    def to_pandas(self, /) -> Any:
        """
        Makes a ``pandas.DataFrame``; needs pandas 2 or newer, not pyarrow.

        Numeric columns with missing values become float64 with NaN.

        :returns: a new data frame with the columns of the table.
        """
    def to_polars(self, /) -> Any:
        """
        Makes a ``polars.DataFrame`` without a copy; needs polars.
        """

@final
class TeamState:
    """
    Team state: T tracked targets that are not lost, G groups and U UAVs, each in ascending order of their ids.
    """
    @property
    def centre(self, /) -> Incomplete:
        """
        Centres of the orbits and their velocities, shape ``(G, 4)``: x_m, y_m, vx_m_s, vy_m_s.
        """
    @property
    def covariance(self, /) -> Incomplete:
        """
        Covariances of ``state``, shape ``(T, 6, 6)``.
        """
    @property
    def group(self, /) -> Incomplete:
        """
        Ids of the groups, shape ``(G,)``.
        """
    @property
    def spread_m(self, /) -> Incomplete:
        """
        Distances from the centre to the furthest member, shape ``(G,)``, m.
        """
    @property
    def standoff_distance_m(self, /) -> Incomplete:
        """
        Standoff distances r_d (15), shape ``(G,)``, m.
        """
    @property
    def state(self, /) -> Incomplete:
        """
        Estimated states, shape ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
        """
    @property
    def target(self, /) -> Incomplete:
        """
        Sensor-reported identities of the targets, shape ``(T,)``.
        """
    @property
    def target_group(self, /) -> Incomplete:
        """
        Group responsible for each target, shape ``(T,)``; -1: none.
        """
    @property
    def uav(self, /) -> Incomplete:
        """
        UAVs that have reported within the teammate timeout, shape ``(U,)``.
        """
    @property
    def uav_group(self, /) -> Incomplete:
        """
        Group to which each UAV is assigned, shape ``(U,)``; -1: none.
        """
    @property
    def uav_state(self, /) -> Incomplete:
        """
        States of the UAVs, shape ``(U, 5)``: x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s.
        """
    @property
    def uav_vertical(self, /) -> Incomplete | None:
        """
        Vertical states of the UAVs, shape ``(U, 2)``: altitude_m, climb_rate_m_s; NaN if a UAV does not report them.
        None if the scenario has no altitudes.
        """
    @property
    def updated(self, /) -> Incomplete:
        """
        True if the track was updated with a measurement at this time step, shape ``(T,)``.
        """

@final
class Tracks:
    """
    Target estimates of a custom law. The optional method ``tracks`` of a law returns them, so that they are scored.

    :param target: shape ``(T,)``, sensor-reported identities of the targets, without duplicates.
    :param state: shape ``(T, 6)``: x, vx, ax, y, vy, ay in m, m/s, m/s2.
    :param covariance: shape ``(T, 6, 6)``, covariance of ``state``; only the upper triangle is used.
    :raises InputError: if an array has the wrong shape or type, a value is not finite, or a target is out of range.
    """
    def __new__(cls, /, target: ArrayLike, state: ArrayLike, covariance: ArrayLike) -> Tracks: ...

@final
class Worlds:
    """
    Independent missions of one scenario (worlds), stepped together and flown by a policy.

    The simulator does the tracking, grouping, assignment and sensor pointing with the built-in algorithms; the policy
    commands only the turn rate and the speed of the UAVs. Each world runs one mission after another: the first with the
    seed given to :meth:`reset`, the n-th after it with a seed that depends only on the first seed and on n. A world
    depends only on scenario, seed and actions, not on the other worlds or the number of threads.

    :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`. All seeds must give
        the same number of UAVs.
    :param count: number of worlds, 1 to 100,000.
    :param autoreset: when the next mission of a world starts after its mission has ended: ``"NextStep"``,
        ``"SameStep"`` or ``"Disabled"``.
    :param threads: number of threads, 1 to 1,024; more than 1 pays off from a few hundred UAVs on.
    :raises ScenarioError: if the scenario is invalid.
    :raises InputError: if another argument is out of range.
    """
    def __new__(cls, /, scenario: Any, *, count: SupportsIndex = 1, autoreset: str = "NextStep", threads: SupportsIndex = 1) -> Worlds: ...
    def close(self, /) -> None:
        """
        Frees all worlds. Closing again has no effect; all other methods then raise :class:`InputError`.
        """
    @property
    def count(self, /) -> int:
        """
        Number of worlds.
        """
    def image(self, /, world: SupportsIndex = 0) -> Incomplete:
        """
        Draws the map of a world at this time step.

        :param world: index of the world.
        :returns: red, green and blue, shape (600, 600, 3), uint8; north is up.
        :raises InputError: if the world does not exist or was not reset.
        """
    def law_actions(self, /) -> Incomplete:
        """
        Returns the actions that the built-in guidance law would choose at this time step, as a baseline for the policy
        in the same worlds and with the same rewards.

        :returns: actions for :meth:`step`, shape (worlds, UAVs, 2), float64.
        :raises InputError: if a world was not reset.
        """
    def reset(self, /, seeds: SupportsGetItem[int, SupportsIndex | None], *, mask: SupportsGetItem[int, bool] | None = None) -> EnvStep:
        """
        Starts missions.

        :param seeds: for each world the seed of its first mission, 0 to 2**63 - 1, or ``None`` to start its next
            mission.
        :param mask: for each world whether to reset it; None: reset all.
        :returns: the first time step of the missions that start, and the current one of the others.
        :raises InputError: if the number of seeds is wrong, a world without an earlier seed gets ``None``, or a world
            would be left without a mission.
        :raises ScenarioError: if the scenario cannot be run with one of the seeds. All worlds then stay unchanged.
        """
    def step(self, /, actions: Any) -> EnvStep:
        """
        Advances all worlds by one time step.

        :param actions: for each world and UAV the turn rate, positive anticlockwise, in units of
            ``turn_rate_max_rad_s``, and the speed difference from the nominal speed, in units of
            ``speed_change_max_m_s``; shape (worlds, UAVs, 2), float32 or float64. Values outside -1 to 1 are clipped.
        :returns: the new time step.
        :raises InputError: if the actions have the wrong shape or type or a value is not finite, or if a world was not
            reset or, with ``"Disabled"``, its mission is over. All worlds then stay unchanged.
        :raises ScenarioError: if the next mission of a world cannot be run; that world must be reset. The other worlds
            have advanced.
        """
    @property
    def uavs(self, /) -> int:
        """
        Number of UAVs in each world.
        """

@final
class Zone:
    """
    A keep-out or keep-in zone: a polygon that UAVs must not enter, or must not leave, between two altitudes.
    """
    @property
    def altitude_max_m(self, /) -> float | None:
        """
        Ceiling, m above the plane; None: no upper limit.
        """
    @property
    def altitude_min_m(self, /) -> float | None:
        """
        Floor, m above the plane; None: no lower limit.
        """
    @property
    def kind(self, /) -> str:
        """
        ``"keep-out"`` or ``"keep-in"``.
        """
    @property
    def name(self, /) -> str:
        """
        Name of the zone; may be empty.
        """
    @property
    def part_of(self, /) -> int | None:
        """
        Index in ``MissionInfo.zones`` of the zone that this polygon extends; None: a separate zone.
        """
    @property
    def vertices(self, /) -> Incomplete:
        """
        Vertices in order, shape ``(n, 2)``: x_m, y_m. An edge joins the last one to the first.
        """

def _described(scenario: Any, runs: SupportsIndex, seed: SupportsIndex, metrics: str | Sequence[str]) -> str:
    """
    Description of a batch as JSON, for other processes and machines. It fully determines every part of the batch.
    """

def _difference(ours: str, theirs: str, shard: str | None) -> str | None:
    """
    Compares two batch descriptions made by :func:`_described`. Returns the first difference of ``theirs`` from ``ours``
    as text, or None if they are equal.

    :param shard: compare with this part of ``ours`` instead of the whole batch, for example ``"0/4"``.
    :raises InputError: if one text is not a batch description, or was made by another version of standoff.
    """

def _fly_described(described: str, traffic: SupportsGetItem[int, str | PathLike[str]], shard: str | None, threads: SupportsIndex | None, out: str | PathLike[str], progress: Any | None) -> None:
    """
    Runs a batch described by :func:`_described`, or one part of it, and writes it to a folder without a report page.

    :param traffic: traffic files to read instead of the scenario's; they must have the same names and contents.
        Empty: those of the scenario.
    """

def _sweep_complete(dir: str | PathLike[str]) -> None:
    """
    Writes the table and the page of a sweep, all of whose batches are complete.
    """

def _sweep_difference(ours: str, theirs: str) -> str | None:
    """
    Compares two definitions of sweeps. Returns the first difference of ``theirs`` from ``ours`` as text, or None.
    """

def _sweep_plan(scenario: Any, vary: dict[str, Any], points: SupportsIndex | None, points_seed: SupportsIndex, runs: SupportsIndex, seed: SupportsIndex, metrics: str | Sequence[str]) -> tuple[str, list[str], list[Scenario]]:
    """
    Definition of a sweep as JSON, the folder of each point's batch, and the scenario of each point.
    """

def baseline(scenario: Any | None = None, *, seed: SupportsIndex = ..., traffic: str | PathLike[str] | DataFrame | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None) -> dict[str, Any]:
    """
    Computes the coverage baseline of a scenario: the coverage of greedily placed sensor footprints with perfect
    knowledge of the target positions. The numbers are those of ``standoff baseline``.

    :param scenario: as for :func:`run`, like the other parameters.
    :returns: ``{"scenario", "seed", "duration_s", "uavs", "targets", "baseline": {"disc_radius_m", "half_of_uavs",
        "all_uavs"}}``.
    :raises ScenarioError: if the scenario is invalid.
    """

def compare(a: Any, b: Any | None = None, *, runs: SupportsIndex = ..., seed: SupportsIndex = ..., metrics: str | Sequence[str] = ..., threads: SupportsIndex | None = None, law_a: Any | None = None, law_b: Any | None = None, law_limit_s: SupportsFloat | SupportsIndex = 10.0) -> Comparison:
    """
    Compares two scenarios run with the same seeds, or two complete batches over their common seeds and metrics.

    :param a: a scenario (built-in name, path, or :class:`Scenario`) or a batch (:class:`Batch` or its folder).
    :param b: the scenario or batch to compare with ``a``. None: the scenario of ``a``.
    :param runs: number of runs of each scenario, 200 by default; ignored for batches.
    :param seed: seed of the first run, 1 by default; the following runs use the following seeds. Ignored for batches.
    :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
        comma-separated str, or a list.
    :param threads: number of threads; None: one per core. The results do not depend on it.
    :param law_a: custom law that controls the UAVs in ``a``, as for :func:`run`. With custom laws, runs are sequential.
    :param law_b: custom law that controls the UAVs in ``b``.
    :param law_limit_s: time limit for each call of a custom law, s, above 0.
    :returns: the comparison, bit for bit equal to the one of ``standoff compare``.
    :raises InputError: if there is nothing to compare, or a seed cannot be run. Exceptions of a custom law are passed
        on.
    """

def merge(dirs: SupportsGetItem[int, str | PathLike[str]], *, out: str | PathLike[str] | None = None) -> Batch:
    """
    Merges the shards of a batch. Writes byte for byte the same files as the batch run in one piece.

    :param dirs: folders of all shards, in any order.
    :param out: folder for the merged batch. None: a temporary folder, deleted together with the batch object.
    :returns: the complete batch.
    :raises InputError: if a shard is missing, incomplete, damaged, duplicated or part of another batch.
    """

def monte_carlo(scenario: Any, *, runs: SupportsIndex, seed: SupportsIndex = ..., metrics: str | Sequence[str] = ..., threads: SupportsIndex | None = None, shard: str | None = None, out: str | PathLike[str] | None = None, progress: Any | None = None) -> Batch:
    """
    Runs a scenario many times with consecutive seeds. Writes byte for byte the same files as ``standoff monte-carlo``.

    Run k, counted from 0, uses ``seed + k``. If the batch is interrupted (Ctrl-C, a full disk, a killed process), the
    same call with the same ``out`` resumes it. docs/user/monte-carlo.md describes the files and the statistics.

    :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`.
    :param runs: number of runs, 1 to 100,000,000.
    :param seed: seed of the first run, at least 0; 1 by default.
    :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
        comma-separated str, or a list.
    :param threads: number of threads; None: one per core. The results do not depend on it.
    :param shard: run only part I of N, counted from 0, for example ``"0/4"``; :func:`merge` combines the parts.
    :param out: folder for the results. None: a temporary folder, deleted together with the batch object.
    :param progress: called as ``progress(done, of)`` with numbers of runs, several times per second and at the end. An
        exception that it raises stops the batch.
    :returns: the complete batch.
    :raises InputError: if the scenario or an argument is invalid, a seed cannot be run, or ``out`` holds other files.
    :raises StandoffError: if a run fails, for example because the disk is full; completed runs stay in ``out``.
    """

def observation_features() -> list[tuple[str, float, float, str]]:
    """
    Returns the features of a UAV's observation in order: name, lowest value, highest value and description.

    Distances, speeds and angles are scaled by the scenario's limits, as the description states. Values are clipped to
    the bounds.
    """

def run(scenario: Any | None = None, *, seed: SupportsIndex = ..., traffic: str | PathLike[str] | DataFrame | None = None, uavs: SupportsIndex | None = None, set: dict[str, Any] | None = None, metrics: str | Sequence[str] = ..., out: str | PathLike[str] | None = None, map: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None, law: Any | None = None, law_limit_s: SupportsFloat | SupportsIndex = 10.0, baseline: bool = False) -> Run:
    """
    Runs a scenario and records it. Writes byte for byte the same files as ``standoff run``, with the same results.

    :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`. None:
        ``improved/figure-9`` or, with ``traffic``, ``traffic/convoy``, as on the command line.
    :param seed: seed of all random values, 0 to 2**63 - 1; 1 by default.
    :param traffic: traffic file or data frame with the targets, as for :class:`Scenario`.
    :param uavs: number of UAVs, started on an orbit about the first targets.
    :param set: values of the scenario to change, by dotted key.
    :param metrics: names of metrics (docs/user/metrics.md) and of the sets ``standard``, ``limits``, ``association``,
        ``table-2``, ``all``: a comma-separated str, or a list.
    :param out: folder for the results. None: a temporary folder, deleted together with the run object.
    :param map: background map: a SUMO net (.net.xml) or GeoJSON, plain or .gz, or a list of them. None: the map of the
        scenario.
    :param law: custom law that replaces the built-in controller: a subclass of :class:`Law`, or a callable that takes a
        :class:`MissionInfo` and returns an object with a method ``decide``.
    :param law_limit_s: time limit for each call of a custom law, s, above 0.
    :param baseline: also compute the coverage baseline: the coverage of greedily placed sensor footprints with perfect
        knowledge of the target positions.
    :returns: the run.
    :raises ScenarioError: if the scenario is invalid; the message shows the line and marks the position.
    :raises InputError: if another argument is invalid, or ``out`` holds other files.
    :raises StandoffError: if the run fails, for example because the disk is full or a custom law does not answer.
        Exceptions of a custom law are passed on. A note in the exception states which part of the run was saved.
    """

def scenarios() -> list[str]:
    """
    Returns the names of the built-in scenarios, in a suggested reading order.
    """

def standoff_distance(spread_m: ArrayLike, *, spread_rate_m_s: ArrayLike | None = None, margin_m: ArrayLike | None = None, mission: MissionInfo | None = None) -> StandoffDistance:
    """
    Computes the standoff distance at which the furthest member of a group lies inside the field of view (15).

    :param spread_m: shape (n,) or (), distance d_max from the centre to the furthest member, m, between 0 and 1e9.
    :param spread_rate_m_s: shape (n,) or (), rate of change of d_max, m/s, between -1e6 and 1e6; 0 by default.
    :param margin_m: shape (n,) or (), margin d_m, m, between 0 and 1e9; 0 by default.
    :param mission: mission whose field of view and bounds of the radius apply; by default the recommended parameters.
    :returns: the distances with and without bounds, and their rates.
    :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
    """

def steer(uav_state: ArrayLike, centre: ArrayLike, distance_m: ArrayLike, *, rate_m_s: ArrayLike | None = None, speed_m_s: ArrayLike | None = None, mission: MissionInfo | None = None) -> Steering:
    """
    Steers UAVs onto orbits: computes the vector field about a moving centre and the turn rate of the Lyapunov law
    (23-25, 28, 29).

    :param uav_state: shape (n, 5) or (5,): x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s, between -1e9 and 1e9.
    :param centre: shape (n, 4) or (4,), estimated centre of the orbit: x_m, y_m, vx_m_s, vy_m_s, between -1e9 and 1e9.
    :param distance_m: shape (n,) or (), radius of the orbit, m, between 1e-3 and 1e9.
    :param rate_m_s: shape (n,) or (), rate of that radius, m/s, between -1e6 and 1e6; 0 by default.
    :param speed_m_s: shape (n,) or (), commanded ground speed, m/s, between 1e-3 and 1e6; that of the mission by default.
    :param mission: mission whose law, gains, direction of orbits and aircraft apply; by default the recommended
        parameters.
    :returns: the turn rate and its intermediate values.
    :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
    """

def sweep(scenario: Any, *, vary: dict[str, Any], runs: SupportsIndex, points: SupportsIndex | None = None, points_seed: SupportsIndex = ..., seed: SupportsIndex = ..., metrics: str | Sequence[str] = ..., threads: SupportsIndex | None = None, out: str | PathLike[str] | None = None, progress: Any | None = None) -> Sweep:
    """
    Runs a scenario many times at each point of a grid, or at random points of a Latin hypercube. Writes byte for byte the
    same table as ``standoff sweep``.

    All points use the same seeds. If the sweep is interrupted, the same call with the same ``out`` resumes it.
    docs/user/sweep.md describes the files.

    :param scenario: name of a built-in scenario, path of a scenario file, or a :class:`Scenario`.
    :param vary: the keys to vary and their values: a list (``{"guidance.lead_s": [0, 1, 2]}``, also a NumPy array) or, as
        str, ``"FROM..TO:COUNT"`` for evenly spaced values or ``"FROM..TO"`` for a range, which needs ``points``.
    :param runs: number of runs of each point, 1 to 100,000,000.
    :param points: number of points of a Latin hypercube, 2 to 10,000. None: a grid of all combinations.
    :param points_seed: seed of the Latin hypercube, at least 0; 1 by default.
    :param seed: seed of the first run of every point, at least 0; 1 by default.
    :param metrics: names of metrics and of the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a
        comma-separated str, or a list.
    :param threads: number of threads; None: one per core. The results do not depend on it.
    :param out: folder for the results. None: a temporary folder, deleted together with the sweep object.
    :param progress: called as ``progress(done, of)`` with numbers of runs, several times per second and at the end. An
        exception that it raises stops the sweep.
    :returns: the complete sweep.
    :raises ScenarioError: if the scenario of a point is invalid.
    :raises InputError: if another argument is invalid, a seed cannot be run, or ``out`` holds other files.
    :raises StandoffError: if a run fails, for example because the disk is full; completed runs stay in ``out``.
    """
