"""Laws written in Python: their observations, how their commands are flown, and their errors."""

import functools
import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import standoff
from standoff import AssignmentProblem, Command, Law, MissionInfo, Observation, Tracks, components

SCENARIO = "tour/04-two-groups"
INTRUDERS = standoff.Scenario(
    SCENARIO,
    set={
        "separation": {},
        "groups.altitude_policy": "common",
        "intruders": [
            {"pursued_uav": 1, "bearing_deg": 20},
            {"x_m": 0, "y_m": 5000, "transponder_off": [{"from_s": 20, "until_s": 30}]},
        ],
    },
)
STUBBORN = """while True:
            try: time.sleep(0.01)
            except Exception: continue"""


class Nothing(Law):
    """Leaves everything to the built-in law."""

    sees = "team-state"

    def decide(self, observation: Observation) -> None:
        return None


class NothingForAll(Nothing):
    decides_for = "team"

    def decide(self, observations: list[Observation]) -> list[None]:  # type: ignore[override]
        return [None] * len(observations)


class NothingToAssign(Law):
    replaces = "assignment"

    def decide(self, problem: AssignmentProblem) -> None:
        return None


class NothingToGuide(Law):
    replaces = "guidance"

    def decide(self, observation: Observation) -> None:
        return None


@pytest.mark.parametrize("law", [Nothing, NothingForAll, NothingToAssign, NothingToGuide])
@pytest.mark.parametrize("scenario", [SCENARIO, "tour/06-a-uav-drops-out", "tour/09-separation", INTRUDERS])
def test_a_law_that_returns_none_gives_the_built_in_flight(law: type[Law], scenario: str | standoff.Scenario) -> None:
    ours, theirs = standoff.run(scenario), standoff.run(scenario, law=law)
    assert theirs.metrics == ours.metrics
    for name in ("uavs", "tracks", "groups", "events"):
        assert (theirs.dir / f"{name}.parquet").read_bytes() == (ours.dir / f"{name}.parquet").read_bytes()


class Follower(Law):
    """Each UAV flies towards the nearest vehicle that it saw, as in crates/standoff-sim/examples/follower.rs."""

    def __init__(self, mission: MissionInfo) -> None:
        super().__init__(mission)
        self.goal: tuple[float, float] | None = None

    def decide(self, own: Observation) -> Command:
        if own.scan is not None and len(own.scan.range_m) > 0:
            nearest = int(np.argmin(own.scan.range_m))
            range_m, bearing_rad = own.scan.range_m[nearest], own.scan.bearing_rad[nearest]
            self.goal = (own.x_m + range_m * math.cos(bearing_rad), own.y_m + range_m * math.sin(bearing_rad))
        if self.goal is None and own.cues:
            self.goal = (own.cues[0].x_m, own.cues[0].y_m)
        if self.goal is None:
            return Command(own.speed_m_s, 0.0)
        off_rad = math.atan2(self.goal[1] - own.y_m, self.goal[0] - own.x_m) - own.heading_rad
        turn_rate_rad_s = (off_rad + math.pi) % (2 * math.pi) - math.pi
        return Command(40.0, turn_rate_rad_s, pointing_target=self.goal)


def test_a_law_that_replaces_everything_is_scored_by_what_is_in_view() -> None:
    run = standoff.run(SCENARIO, law=Follower)
    # docs/user/controllers.md: the same controller in Rust has 75 % of the targets in view, and no group metrics.
    assert abs(run.metrics["in_view_fraction"] - 0.75) < 0.005
    assert run.metrics["custody_fraction"] is None and run.metrics["position_error_m"] is None


class Listener(Law):
    """Stores its observations."""

    seen: list[Observation] = []

    def decide(self, observation: Observation) -> Command:
        self.seen.append(observation)
        return Command(40.0, 0.1, pointing_target=(0.0, 0.0))


def test_an_agent_sees_its_own_state_its_scan_and_reports() -> None:
    Listener.seen.clear()
    run = standoff.run("tour/02-two-uavs", law=Listener)
    seen = [one for one in Listener.seen if one.uav == 1]
    assert len(Listener.seen) == 2 * len(seen) == len(run.uavs)
    is_second = run.uavs.to_numpy("uav") == 1
    assert np.array_equal([one.x_m for one in seen], run.uavs.to_numpy("x_m")[is_second])
    measured = [range_m for one in seen if one.scan for range_m in one.scan.range_m]
    assert np.array_equal(measured, run.detections.to_numpy("range_m")[run.detections.to_numpy("uav") == 1])
    first = [one for one in Listener.seen if one.uav == 0]
    for own, teammate in zip(first, seen, strict=True):
        (report,) = teammate.reports
        assert report.uav == 0 and own.scan is not None
        assert np.array_equal(report.state, own.scan.state) and np.array_equal(report.range_m, own.scan.range_m)
    assert len(seen[0].cues) == len(set(run.truth.to_numpy("target"))) and seen[0].team_state is None and seen[1].cues == []


class Watcher(Law):
    sees, decides_for, replaces = "team-state", "team", "guidance"
    seen: list[Any] = []

    def decide(self, observations: list[Observation]) -> list[None]:
        self.seen.append(observations[0].team_state)
        return [None] * len(observations)


def test_the_team_state_equals_the_recorded_tracks_and_groups() -> None:
    Watcher.seen.clear()
    run = standoff.run(SCENARIO, law=Watcher)
    tracks, groups = run.tracks, run.groups
    assert np.array_equal(np.concatenate([one.target for one in Watcher.seen]), tracks.to_numpy("target"))
    states = np.concatenate([one.state for one in Watcher.seen])
    assert np.array_equal(states[:, 0], tracks.to_numpy("x_m")) and np.array_equal(states[:, 4], tracks.to_numpy("vy_m_s"))
    covariances = np.concatenate([one.covariance for one in Watcher.seen])
    assert np.array_equal(covariances, covariances.transpose(0, 2, 1))
    assert np.array_equal(covariances[:, 0, 3], tracks.to_numpy("cov_x_y"))
    assert np.array_equal(np.concatenate([one.group for one in Watcher.seen]), groups.to_numpy("group"))
    centres = np.concatenate([one.centre for one in Watcher.seen])
    assert np.array_equal(centres[:, 1], groups.to_numpy("y_m"))
    assert np.array_equal(
        np.concatenate([one.standoff_distance_m for one in Watcher.seen]), groups.to_numpy("standoff_distance_m")
    )


class Level(Law):
    """Stores altitudes: its own, those that teammates report, and those of the team state."""

    sees, replaces = "team-state", "guidance"
    missions: list[MissionInfo] = []
    levels: list[tuple[float, int, float | None, float | None]] = []

    def decide(self, observation: Observation) -> None:
        Level.missions.append(self.mission)
        rows = [(observation.uav, observation.altitude_m, observation.climb_rate_m_s)]
        rows += [(report.uav, report.altitude_m, report.climb_rate_m_s) for report in observation.reports]
        Level.levels += [(observation.time_s, *row) for row in rows]
        team_state = observation.team_state
        assert team_state is not None
        if observation.altitude_m is None:
            assert team_state.uav_vertical is None
        else:
            vertical = team_state.uav_vertical
            assert vertical is not None
            assert vertical[team_state.uav == observation.uav].tolist() == [[row for row in rows[0][1:]]]


def test_a_law_sees_altitudes_and_zones() -> None:
    Level.levels, Level.missions = [], []
    run = standoff.run(standoff.Scenario("tour/09-separation", set={"groups.altitude_policy": "per-group"}), law=Level)
    names = ["time_s", "uav", "altitude_m", "climb_rate_m_s"]
    flown = set(zip(*(run.uavs.to_numpy(name).tolist() for name in names), strict=True))
    assert set(Level.levels) == flown and len({altitude_m for _, _, altitude_m, _ in flown}) > 10
    (zone,) = Level.missions[0].zones
    assert (zone.name, zone.kind) == ("field", "keep-out")
    assert zone.vertices.tolist() == [[650.0, -100.0], [900.0, -350.0], [1150.0, -100.0]]
    assert (zone.altitude_min_m, zone.altitude_max_m) == (None, None)
    low = {"vertices": zone.vertices.tolist(), "altitude_max_m": 120.0}
    further = low | {"vertices": [[2000, 0], [2100, 0], [2000, 100]], "part_of": 0}
    standoff.run(standoff.Scenario("tour/09-separation", set={"geofence": [low, further]}), law=Level)
    zones = Level.missions[-1].zones
    assert [(zone.altitude_min_m, zone.altitude_max_m) for zone in zones] == [(None, 120.0)] * 2
    assert [zone.part_of for zone in zones] == [None, 0]
    # If altitude is not flown and the scenario has no zones, altitudes are None and the list of zones is empty.
    Level.levels = []
    standoff.run(SCENARIO, law=Level)
    assert {row[2:] for row in Level.levels} == {(None, None)} and Level.missions[-1].zones == []


class Lookout(Law):
    """Stores the reports of intruders."""

    reports: list[tuple[Any, ...]] = []

    def decide(self, observation: Observation) -> Command:
        for intruder in observation.intruders:
            x_m, y_m, heading_rad, speed_m_s, _ = intruder.state
            row = (intruder.intruder, x_m, y_m, heading_rad, speed_m_s, intruder.altitude_m, True)
            self.reports.append((observation.uav, observation.time_s, intruder.time_s, *row))
        return Command(40.0, 0.1)


def test_laws_receive_reports_of_intruders_unless_these_are_silent() -> None:
    Lookout.reports = []
    run = standoff.run(INTRUDERS, law=Lookout)
    names = ["time_s", "intruder", "x_m", "y_m", "heading_rad", "speed_m_s", "altitude_m", "transponder_on"]
    rows = zip(*(run.table("intruders").to_numpy(name).tolist() for name in names), strict=True)
    reported = [row for row in rows if row[-1]]
    silent_s = {row[0] for row in reported if row[1] == 0} - {row[0] for row in reported if row[1] == 1}
    assert min(silent_s) == 20.0 and max(silent_s) == 29.5
    assert sorted(Lookout.reports) == sorted((uav, row[0], *row) for row in reported for uav in range(4))


class Slow(Law):
    """Flies the built-in turn rate at a changed speed."""

    replaces, sees = "guidance", "team-state"

    def __init__(self, mission: MissionInfo, change_m_s: float) -> None:
        super().__init__(mission)
        self.change_m_s = change_m_s

    def decide(self, observation: Observation) -> tuple[float, float]:
        assert observation.builtin_command is not None
        return self.mission.speed_m_s + self.change_m_s, observation.builtin_command.turn_rate_rad_s


def test_a_guidance_law_replaces_only_the_guidance() -> None:
    ours, slow = standoff.run(SCENARIO), standoff.run(SCENARIO, law=functools.partial(Slow, change_m_s=-100.0))
    limits = standoff.Scenario(SCENARIO).to_dict()["uavs"]
    slowest_m_s = limits["speed_m_s"] - limits["speed_change_max_m_s"]
    assert set(slow.uavs.to_numpy("speed_command_m_s")) == {slowest_m_s}
    assert slow.metrics["custody_fraction"] is not None and slow.metrics != ours.metrics
    # A command exactly at the limit counts as saturated, too.
    change_m_s = slowest_m_s - limits["speed_m_s"]
    clipped = standoff.run(SCENARIO, law=functools.partial(Slow, change_m_s=change_m_s))
    assert clipped.metrics == slow.metrics and slow.metrics["speed_saturated_fraction"] == 1.0


class Swapped(Law):
    """Assigns the first half of the UAVs to the second group, and the others to the first."""

    replaces = "assignment"

    def decide(self, problem: AssignmentProblem) -> dict[int, int] | None:
        if len(problem.group) < 2:
            return None
        half = len(problem.uav) // 2
        return {int(uav): int(problem.group[int(index < half)]) for index, uav in enumerate(problem.uav)}


def test_an_assignment_law_replaces_only_the_assignment() -> None:
    run = standoff.run(SCENARIO, law=Swapped)
    at_end = run.uavs.to_numpy("time_s") == run.uavs.to_numpy("time_s").max()
    groups = run.uavs.to_numpy("group")[at_end]
    assert groups[0] == groups[1] > groups[2] == groups[3]
    assert standoff.run(SCENARIO).uavs.to_numpy("group")[at_end].tolist() != groups.tolist()


def test_laws_are_compared_with_the_same_random_draws() -> None:
    compared = standoff.compare(SCENARIO, law_b=NothingForAll, runs=4)
    assert compared.b.endswith(" by NothingForAll")
    assert all(numbers["equal"] in (1.0, None) for numbers in compared.metrics.values())
    follower = standoff.compare(SCENARIO, law_b=Follower, runs=4)
    assert follower.metrics["in_view_fraction"]["better"] == "a"
    # The side without a law has the numbers of an ordinary batch.
    alone = standoff.monte_carlo(SCENARIO, runs=4)
    assert follower.metrics["in_view_fraction"]["mean_a"] == alone.metrics["in_view_fraction"]["mean"]


class Late(Law):
    def decide(self, observation: Observation) -> None:
        if observation.time_s > 2.0:
            raise RuntimeError("it has failed")
        return None


def test_an_exception_of_a_law_is_passed_on_and_the_partial_record_kept(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="it has failed") as raised:
        standoff.run(SCENARIO, law=Late, out=tmp_path / "run")
    assert "the run up to 2.5 s is saved" in raised.value.__notes__[0]
    partial = standoff.Run(tmp_path / "run.partial")
    assert partial.summary["unfinished_after_s"] == 2.5


def answering(answer: Any) -> Callable[[MissionInfo], Law]:
    class Answering(Law):
        def decide(self, observation: Observation) -> Any:
            return answer

    return Answering


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        ("straight on", ValueError, "returned 'straight on'; must return a Command"),
        ((40.0, float("nan")), ValueError, "turn_rate_rad_s = NaN: must be a finite number"),
        ((None, 0.0), ValueError, "float"),
        ([40.0], ValueError, "a Command"),
        (np.zeros((3, 1)), ValueError, "returned"),
    ],
)
def test_invalid_return_values_are_errors_that_name_the_law(
    answer: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=f"Answering.*{message}"):
        standoff.run(SCENARIO, law=answering(answer))


@pytest.mark.parametrize(
    ("invalid", "message"),
    [
        ({"speed_m_s": math.inf}, "speed_m_s = inf: must be a finite number"),
        ({"pointing_target": (math.nan, 0.0)}, "pointing_target = NaN"),
        ({"altitude_m": -1e300}, "altitude_m = -1.*must be at least -100000"),
        ({"group": -1}, "group = -1: must be at least 0"),
        ({"group": 2**70}, "group = .*: must be at most 2147483647"),
    ],
)
def test_commands_outside_their_range_are_errors(invalid: dict[str, Any], message: str) -> None:
    with pytest.raises(standoff.InputError, match=message):
        Command(**{"speed_m_s": 40.0, "turn_rate_rad_s": 0.0, **invalid})


@pytest.mark.parametrize("answer", [(40.0, 0.1), [40.0, 0.1], np.array([40.0, 0.1]), (np.float32(40.0), 0.1)])
def test_two_numbers_are_a_command(answer: Any) -> None:
    run = standoff.run("tour/01-one-uav", law=answering(answer))
    assert set(run.uavs.to_numpy("speed_command_m_s")) == {40.0}


class FewCommands(NothingForAll):
    def decide(self, observations: list[Observation]) -> list[None]:  # type: ignore[override]
        return [None]


class Endless(NothingForAll):
    def decide(self, observations: list[Observation]) -> Any:  # type: ignore[override]
        while True:
            yield None


class Failing(NothingForAll):
    def decide(self, observations: list[Observation]) -> Any:  # type: ignore[override]
        yield 1 / 0


class Nowhere(Law):
    replaces = "assignment"

    def decide(self, problem: AssignmentProblem) -> dict[int, int]:
        return {0: 999}


class Stranger(Law):
    sees = "team-state"

    def decide(self, observation: Observation) -> Command:
        return Command(40.0, 0.0, group=999)


class Listed(Law):
    replaces = "assignment"

    def decide(self, problem: AssignmentProblem) -> list[int]:
        return [0, 1]


class Misspelt(Law):
    sees = "everything"  # type: ignore[assignment]

    def decide(self, observation: Observation) -> None:
        return None


class Mute:
    def __init__(self, mission: MissionInfo) -> None:
        pass


@pytest.mark.parametrize(
    ("law", "error", "message"),
    [
        (FewCommands, ValueError, "returned 1 commands for 4 UAVs"),
        (Endless, ValueError, "returned more than 4 commands for 4 UAVs"),
        (Failing, ZeroDivisionError, "division by zero"),
        (Nowhere, ValueError, "group 999 is not one of"),
        (Stranger, ValueError, "group 999 is not one of"),
        (Listed, TypeError, "a dict from UAVs to groups"),
        (Misspelt, ValueError, "sees = everything: must be one of own, team-state"),
        (Mute, TypeError, "has no method decide"),
        (Law, NotImplementedError, "^$"),
    ],
)
def test_invalid_laws_are_errors(law: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        standoff.run(SCENARIO, law=law)


class Busy(Law):
    def decide(self, observation: Observation) -> None:
        while True:
            pass


class Asleep(Law):
    def decide(self, observation: Observation) -> None:
        time.sleep(30.0)


class Stubborn(Law):
    def decide(self, observation: Observation) -> None:
        while True:
            try:
                time.sleep(0.01)
            except Exception:
                continue


class Unborn(Law):
    def __init__(self, mission: MissionInfo) -> None:
        while True:
            pass


class SlowNumber:
    def __float__(self) -> float:
        time.sleep(30.0)
        return 40.0


class SlowToRead(Law):
    def decide(self, observation: Observation) -> Any:
        return SlowNumber(), 0.0


@pytest.mark.parametrize("law", [Busy, Asleep, Stubborn, Unborn, SlowToRead])
@pytest.mark.parametrize("fly", [standoff.run, functools.partial(standoff.compare, runs=2)])
def test_a_law_that_exceeds_its_time_limit_is_an_error(law: type[Law], fly: Any) -> None:
    began = time.monotonic()
    arguments = {"law_b": law} if isinstance(fly, functools.partial) else {"law": law}
    with pytest.raises(standoff.StandoffError, match="has not answered within 0.2 s"):
        fly(SCENARIO, law_limit_s=0.2, **arguments)
    assert time.monotonic() - began < 5.0
    # Later runs are not affected.
    assert standoff.run("tour/01-one-uav", law=Nothing).metrics == standoff.run("tour/01-one-uav").metrics


class Estimating(Law):
    """Circles, and filters its own measurements."""

    def __init__(self, mission: MissionInfo) -> None:
        super().__init__(mission)
        self.filter: components.Filter | None = None

    def decide(self, own: Observation) -> Command:
        if own.cues:
            cue = own.cues[0]
            variance = np.square([cue.position_sd_m, cue.velocity_sd_m_s, 0.2] * 2)
            state = [cue.x_m, cue.vx_m_s, 0.0, cue.y_m, cue.vy_m_s, 0.0]
            self.filter = components.Filter(state, np.diag(variance), mission=self.mission)
        elif self.filter is not None:
            self.filter.predict(self.mission.period_s)
            if own.scan is not None and len(own.scan.range_m) > 0:
                self.filter.update([own.x_m, own.y_m], own.scan.range_m, own.scan.bearing_rad)
        x_m, y_m = (0.0, 0.0) if self.filter is None else self.filter.position_m[0]
        off_rad = math.atan2(y_m - own.y_m, x_m - own.x_m) - own.heading_rad - math.pi / 2
        return Command(40.0, 0.2 + 0.5 * math.sin(off_rad), pointing_target=(x_m, y_m), group=0)

    def tracks(self) -> Tracks:
        if self.filter is None:
            return Tracks([], np.zeros((0, 6)), np.zeros((0, 6, 6)))
        return Tracks([0], self.filter.state, self.filter.covariance)


def test_estimates_of_a_law_are_scored() -> None:
    run = standoff.run("tour/01-one-uav", law=Estimating, metrics="all")
    error_m = run.metrics["position_error_all_m"]
    assert error_m is not None and 0.0 < error_m < 30.0
    assert run.metrics["anees"] is None and run.metrics["nis"] is not None
    truth = np.stack([run.truth.to_numpy("x_m"), run.truth.to_numpy("y_m")])
    tracks = np.stack([run.tracks.to_numpy("x_m"), run.tracks.to_numpy("y_m")])
    assert abs(np.hypot(*(tracks - truth)).mean() - error_m) < 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0], np.zeros((1, 5)), np.zeros((1, 6, 6))), r"state has the shape \(1, 5\)"),
        (([0], np.full((1, 6), np.nan), np.zeros((1, 6, 6))), r"state\[0, 0\] = NaN"),
        (([-3], np.zeros((1, 6)), np.zeros((1, 6, 6))), r"target\[0\] = -3: must be at least 0 and at most 4294967295"),
        (([0.5], np.zeros((1, 6)), np.zeros((1, 6, 6))), "target = 0.5: must be a whole number"),
        (([0, 1, 2], np.zeros((2, 6)), np.zeros((2, 6, 6))), "state has 2 rows, but target has 3"),
    ],
)
def test_invalid_tracks_are_errors(arguments: Any, message: str) -> None:
    with pytest.raises(standoff.InputError, match=message):
        Tracks(*arguments)


@pytest.mark.parametrize(("law", "times"), [(NothingForAll, 1), (NothingToAssign, 1), (Nothing, 4)])
def test_a_run_creates_one_law_per_uav_or_team(law: type[Law], times: int) -> None:
    made: list[int | None] = []

    class Made(law):  # type: ignore[misc, valid-type]
        def __init__(self, mission: MissionInfo) -> None:
            super().__init__(mission)
            made.append(mission.uav)

    standoff.run(SCENARIO, law=Made)
    assert made == ([None] if times == 1 else [0, 1, 2, 3])


def test_an_exception_in_a_comparison_names_seed_and_side() -> None:
    with pytest.raises(RuntimeError, match="it has failed") as raised:
        standoff.compare(SCENARIO, law_b=Late, runs=2, seed=7)
    assert raised.value.__notes__ == ["seed 7, law_b"]


class Changing(Law):
    sees = "team-state"

    def decide(self, observation: Observation) -> None:
        assert observation.team_state is not None
        observation.team_state.state[:] = 0.0


def test_a_shared_team_state_is_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        standoff.run(SCENARIO, law=Changing)


def test_all_of_a_law_runs_on_one_thread() -> None:
    threads = set()

    class Threaded(Nothing):
        def __init__(self, mission: MissionInfo) -> None:
            super().__init__(mission)
            threads.add(threading.current_thread())

        def decide(self, observation: Observation) -> None:
            threads.add(threading.current_thread())

    standoff.run(SCENARIO, law=Threaded)
    (thread,) = threads
    assert thread is not threading.main_thread()
    thread.join(timeout=5.0)
    assert not thread.is_alive()


@pytest.mark.parametrize("decide", ["return None", "time.sleep(60.0)", STUBBORN])
def test_the_interpreter_exits_normally_after_a_law(decide: str) -> None:
    """Also if an abandoned law is still running; other threads are joined as usual."""
    code = f"""
import standoff

class L(standoff.Law):
    def decide(self, observation):
        import time
        {decide}

try:
    standoff.run("tour/01-one-uav", law=L, law_limit_s=0.3)
except standoff.StandoffError as error:
    print(error)

import threading, time
assert threading.current_thread() is threading.main_thread()
threading.Thread(target=lambda: (time.sleep(0.3), print("saved"))).start()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=20)
    assert done.returncode == 0 and done.stdout.endswith("saved\n"), done
    assert ("has not answered" in done.stdout) == (decide != "return None")
