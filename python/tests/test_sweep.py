"""Sweeps: the same table as the command, points as batches, errors, resumption."""

import gc
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import standoff
from standoff import InputError

COMMAND = os.environ.get("STANDOFF") or shutil.which("standoff")


def pair() -> standoff.Scenario:
    """The paper's pair, for 20 s only."""
    return standoff.Scenario("paper/table-2-pair", set={"duration_s": 20, "transient_s": 5})


@pytest.mark.skipif(COMMAND is None, reason="the command is neither in $STANDOFF nor in the path")
def test_a_sweep_equals_that_of_the_command(tmp_path: Path) -> None:
    arguments = ["sweep", "paper/table-2-pair", "--set", "duration_s=20", "--set", "transient_s=5", "--runs", "3"]
    vary = ["--vary", "sensor.range_sd_m=5..20", "--vary", "guidance.law=oh-2015,standoff", "--points", "4"]
    out = ["--points-seed", "9", "--seed", "5", "--out", str(tmp_path / "theirs"), "--json"]
    grid = [*arguments, "--vary", "guidance.law=oh-2015,standoff", "--out", str(tmp_path / "grid")]
    subprocess.run([str(COMMAND), *grid], check=True, capture_output=True)
    listed = standoff.sweep(pair(), vary={"guidance.law": ["oh-2015", "standoff"]}, runs=3, out=tmp_path / "listed")
    assert (listed.dir / "sweep.json").read_bytes() == (tmp_path / "grid/sweep.json").read_bytes()
    printed = subprocess.run([str(COMMAND), *arguments, *vary, *out], check=True, capture_output=True, text=True).stdout
    axes = {"sensor.range_sd_m": "5..20", "guidance.law": "oh-2015,standoff"}
    ours = standoff.sweep(pair(), vary=axes, points=4, points_seed=9, runs=3, seed=5, out=tmp_path / "ours")
    assert ours.to_dict() == json.loads(printed)
    for name in ("sweep.json", "sweep.parquet", "report.html", "points/3/runs.parquet"):
        assert (tmp_path / "ours" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes(), name
    assert standoff.Sweep(tmp_path / "theirs").to_dict() == ours.to_dict()


def test_the_table_has_a_row_per_point_with_mean_and_interval() -> None:
    axes = {"sensor.range_sd_m": np.linspace(5.0, 20.0, 2), "guidance.law": ["oh-2015", "standoff"]}
    progress: list[tuple[int, int]] = []
    swept = standoff.sweep(
        pair(), vary=axes, runs=3, metrics="position_error_m", progress=lambda *now: progress.append(now)
    )
    assert progress[-1] == (12, 12) and progress == sorted(progress)
    frame = swept.table.to_pandas()
    assert len(swept) == len(frame) == 4 and frame["point"].tolist() == [0, 1, 2, 3]
    assert frame["sensor.range_sd_m"].tolist() == [5.0, 5.0, 20.0, 20.0]
    assert frame["guidance.law"].tolist() == ["oh-2015", "standoff"] * 2
    statistics = swept.batch(2).metrics["position_error_m"]
    row = frame.iloc[2]
    assert row["position_error_m"] == statistics["mean"] and row["position_error_m_n"] == 3
    assert [row["position_error_m_ci95_low"], row["position_error_m_ci95_high"]] == statistics["ci95"]
    assert frame["position_error_m"].iloc[2] > frame["position_error_m"].iloc[0]
    assert "position error, m\n" in str(swept) and "4 points" in repr(swept)
    page = swept._repr_html_()
    assert page is not None and page.startswith("<iframe")
    with pytest.raises(IndexError, match="point = 4: must be from 0 to 3"):
        swept.batch(4)


def test_a_point_keeps_a_temporary_sweep() -> None:
    swept = standoff.sweep(pair(), vary={"uavs.count": [2, 3]}, runs=2)
    folder, batch = swept.dir, swept.batch(1)
    del swept
    gc.collect()
    assert len(batch.runs) == 2
    del batch
    gc.collect()
    assert not folder.exists()


def test_an_interrupted_sweep_resumes(tmp_path: Path) -> None:
    axes = {"uavs.count": [2, 3, 4]}
    whole = standoff.sweep(pair(), vary=axes, runs=200, out=tmp_path / "whole")
    counts: list[int] = []

    def stop(done: int, of: int) -> None:
        counts.append(done)
        if done > 250:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        standoff.sweep(pair(), vary=axes, runs=200, threads=1, out=tmp_path / "out", progress=stop)
    reached = counts[-1]
    counts.clear()
    resumed = standoff.sweep(
        pair(), vary=axes, runs=200, out=tmp_path / "out", progress=lambda done, of: counts.append(done)
    )
    assert reached <= 600 and (not counts or counts[-1] == 600)
    assert (resumed.dir / "sweep.parquet").read_bytes() == (whole.dir / "sweep.parquet").read_bytes()


def test_a_damaged_sweep_is_an_error(tmp_path: Path) -> None:
    swept = standoff.sweep(pair(), vary={"uavs.count": [2, 3]}, runs=2, metrics="anees", out=tmp_path / "s")
    definition = json.loads((swept.dir / "sweep.json").read_text())
    changes: list[tuple[dict[str, Any], str]] = [
        ({"metrics": ["anees", "nis"]}, "points/0: its runs or metrics are not those of the sweep"),
        ({"runs": 0}, "its runs or metrics are not those of the sweep"),
        ({"points": [["2"], ["3", "4"]]}, "sweep.json is damaged: its points do not match its keys"),
        ({"points": 5}, "sweep.json is damaged: invalid type"),
        ({"format": 9}, "sweep.json has format 9"),
    ]
    for change, message in changes:
        (swept.dir / "sweep.json").write_text(json.dumps({**definition, **change}))
        with pytest.raises(InputError, match=message):
            standoff.Sweep(swept.dir)
    (swept.dir / "sweep.json").write_text(json.dumps(definition))
    (swept.dir / "points/1/runs.parquet").unlink()
    with pytest.raises(InputError, match="points/1: contains no results"):
        standoff.Sweep(swept.dir)
    with pytest.raises(InputError, match="contains no results of standoff sweep"):
        standoff.Sweep(tmp_path)


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        ({"vary": {}}, InputError, "0 keys to vary"),
        ({"vary": {"uavs.count": 3}}, InputError, "vary: uavs.count: must be a list of values, .* not int"),
        ({"vary": {"uavs": {"count": [2]}}}, InputError, "vary: uavs: must be a list of values, .* not dict"),
        ({"vary": {"uavs.count": []}}, InputError, "vary: uavs.count: a value is missing"),
        ({"vary": {"uavs.count": [2, None]}}, InputError, "vary: uavs.count: a value must be a number"),
        ({"vary": {"uavs.count": "2..4"}}, InputError, "needs a number of values"),
        ({"vary": {"uavs.cuont": [2]}}, standoff.ScenarioError, "did you mean `count`"),
        ({"vary": ["uavs.count=2"]}, TypeError, "must be a dict with str keys, not list\nwhile processing 'vary'"),
        ({"vary": {"uavs.count": [2]}, "points": 1}, InputError, "points = 1: must be at least 2"),
        ({"vary": {"uavs.count": [2]}, "runs": 0}, InputError, "runs = 0: must be at least 1"),
    ],
)
def test_wrong_arguments_are_errors(wrong: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        standoff.sweep(pair(), **{"runs": 2, **wrong})
