"""Batches on one machine: the same files and numbers as the command, tables, Ctrl-C."""

import gc
import json
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import pytest

import standoff
from standoff import InputError

FILES = ("runs.parquet", "summary.json", "monte-carlo.json")
COMMAND = os.environ.get("STANDOFF") or shutil.which("standoff")


def pair(**set: object) -> standoff.Scenario:
    """The paper's pair, for 20 s only."""
    return standoff.Scenario("paper/table-2-pair", set={"duration_s": 20, "transient_s": 5, **set})


def files(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


@pytest.mark.skipif(COMMAND is None, reason="the command is neither in $STANDOFF nor in the path")
def test_files_and_numbers_equal_those_of_the_command(tmp_path: Path) -> None:
    def command(*arguments: str) -> str:
        done = subprocess.run([str(COMMAND), *arguments], cwd=tmp_path, capture_output=True, text=True, check=True)
        return done.stdout

    shorter = ("--set", "duration_s=20", "--set", "transient_s=5")
    printed = command("monte-carlo", "paper/table-2-pair", *shorter, "--runs", "12", "--json", "--out", "command")
    batch = standoff.monte_carlo(pair(), runs=12, out=tmp_path / "python")
    for name in FILES:
        assert (tmp_path / "command" / name).read_bytes() == (batch.dir / name).read_bytes(), name
    assert batch.summary == json.loads(printed)
    compared = standoff.compare(pair(), pair().changed(set={"guidance.lead_s": 0}), runs=9, seed=4)
    change = ("--set-b", "guidance.lead_s=0", "--runs", "9", "--seed", "4")
    assert compared.json == command("compare", "paper/table-2-pair", *shorter, *change, "--json")
    folders = standoff.compare(tmp_path / "command", batch)
    assert folders.json == command("compare", "command", str(batch.dir), "--json").replace(
        '"a": "command"', f'"a": "{tmp_path / "command"}"'
    )


def test_threads_and_shards_do_not_change_the_files(tmp_path: Path) -> None:
    whole = standoff.monte_carlo(pair(), runs=40, seed=3, threads=1, out=tmp_path / "whole")
    many = standoff.monte_carlo(pair(), runs=40, seed=3, threads=3, out=tmp_path / "many")
    parts = [
        standoff.monte_carlo(pair(), runs=40, seed=3, shard=f"{index}/3", out=tmp_path / str(index)).dir
        for index in range(3)
    ]
    merged = standoff.merge(parts[::-1], out=tmp_path / "merged")
    assert files(whole.dir) == files(many.dir) == files(merged.dir)

    def stop(done: int, of: int) -> None:
        raise ZeroDivisionError(f"{done} of {of}")

    with pytest.raises(ZeroDivisionError, match=" of 1000000"):
        standoff.monte_carlo(pair(), runs=1_000_000, progress=stop, out=tmp_path / "stopped")
    assert list(files(tmp_path / "stopped")) == ["monte-carlo.journal"]
    with pytest.raises(InputError, match="the first seed is 1, not 3"):
        standoff.monte_carlo(pair(), runs=40, seed=3, out=tmp_path / "stopped")


def test_an_interrupted_batch_resumes(tmp_path: Path) -> None:
    whole = standoff.monte_carlo(pair(), runs=4000, out=tmp_path / "whole")
    first: list[int] = []

    def stop(done: int, of: int) -> None:
        first.append(done)
        if done > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        standoff.monte_carlo(pair(), runs=4000, threads=1, out=tmp_path / "out", progress=stop)
    completed = first[-1]
    first.clear()
    standoff.monte_carlo(
        pair(), runs=4000, threads=1, out=tmp_path / "out", progress=lambda done, of: first.append(done)
    )
    assert 0 < completed <= first[0] and first[-1] == 4000
    assert files(whole.dir) == files(tmp_path / "out")


@pytest.mark.parametrize(
    "work",
    [
        lambda: standoff.monte_carlo("improved/figure-9", runs=1_000_000),
        lambda: standoff.compare("improved/figure-9", "paper/figure-9", runs=1_000_000),
    ],
)
def test_ctrl_c_stops_immediately(work: Callable[[], object]) -> None:
    sent = [0.0]

    def interrupt() -> None:
        time.sleep(0.4)
        sent[0] = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        work()
    assert time.perf_counter() - sent[0] < 0.6


def test_other_threads_run_during_a_batch() -> None:
    counted, stop = [0], threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    began = time.perf_counter()
    standoff.monte_carlo(pair(), runs=1500, threads=1)
    took_s = time.perf_counter() - began
    stop.set()
    counter.join()
    assert counted[0] > 100 * took_s


def test_a_temporary_batch_is_deleted_after_its_last_reference() -> None:
    batch = standoff.monte_carlo(pair(), runs=3)
    folder, runs = batch.dir, batch.runs
    del batch
    gc.collect()
    assert folder.is_dir() and len(runs.to_numpy("seed")) == 3
    del runs
    gc.collect()
    assert not folder.exists()


def test_the_table_of_runs_converts_to_arrow_and_numpy(tmp_path: Path) -> None:
    scenario = pair(duration_s=8)
    batch = standoff.monte_carlo(
        scenario, runs=5, seed=11, metrics=["anees", "handoffs", "reacquisition_time_s"], out=tmp_path / "b"
    )
    runs = batch.runs
    assert (
        runs.columns == ["run", "seed", "reacquisition_time_s", "anees", "handoffs"] and len(runs) == 5
    )
    stored = pq.read_table(batch.dir / "runs.parquet")
    assert pa.table(runs).equals(stored) and pa.schema(runs).equals(stored.schema)
    assert runs.to_numpy("seed").dtype == np.int64 and runs.to_numpy("seed").tolist() == [11, 12, 13, 14, 15]
    assert runs.to_numpy("anees").tolist() == stored["anees"].to_pylist()
    assert np.isnan(runs.to_numpy("reacquisition_time_s")).all() and stored["reacquisition_time_s"].null_count == 5
    assert batch.metrics["anees"]["mean"] == pytest.approx(np.mean(runs.to_numpy("anees")), rel=1e-12)
    table = batch.metrics_table.to_pandas().set_index("metric")
    statistics = batch.metrics["anees"]
    assert [table.loc["anees", name] for name in ("mean", "ci95_low", "ci95_high")] == [statistics["mean"], *statistics["ci95"]]
    assert table.loc["anees", "unit"] == "1" and table.loc["anees", "n"] == 5
    with pytest.raises(KeyError, match='no column "anes"; did you mean "anees"\\?; columns: run, seed'):
        runs.to_numpy("anes")
    assert "<td>anees</td><td>5</td>" in batch._repr_html_() or "srcdoc" in batch._repr_html_()


def test_a_damaged_batch_is_an_error(tmp_path: Path) -> None:
    batch = standoff.monte_carlo(pair(), runs=3, out=tmp_path / "b")
    path, runs = batch.dir / "runs.parquet", batch.runs
    valid = path.read_bytes()
    # Damage the part that the open table will read.
    path.write_bytes(valid[:4] + bytes(byte ^ 0x55 for byte in valid[4:900]) + valid[900:])
    with pytest.raises(InputError, match="changed since it was written"):
        standoff.Batch(batch.dir)
    with pytest.raises(InputError, match="damaged"):
        runs.to_numpy("seed")
    with pytest.raises(pa.ArrowInvalid):
        pa.table(runs)
    path.write_bytes(valid[:100])
    with pytest.raises(InputError, match="damaged"):
        _ = batch.runs


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"runs": 0}, "runs = 0: must be at least 1"),
        ({"runs": 3, "seed": -1}, "seed = -1: must be at least 0"),
        ({"runs": 3, "threads": 0}, "threads = 0: must be at least 1"),
        ({"runs": 3, "shard": "3/3"}, "shard: must be I/N"),
        ({"runs": 3, "shard": "3/4"}, "shard 3/4 of 3 runs"),
        ({"runs": 3, "metrics": "anes"}, 'metrics: "anes": no such metric'),
        ({"runs": 3, "metrics": []}, "metrics: "),
        ({"runs": 10**9}, "1000000000 runs are too many"),
    ],
)
def test_wrong_arguments_are_errors(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as error:
        standoff.monte_carlo(pair(), **wrong)  # type: ignore[arg-type]
    assert message in str(error.value)


def test_a_comparison_has_the_numbers_of_its_batches(tmp_path: Path) -> None:
    compared = standoff.compare(pair(), pair(), runs=4, seed=9, metrics="anees,handoffs")
    assert (compared.a, compared.runs, compared.seed) == ("paper/table-2-pair", 4, 9)
    assert list(compared.metrics) == ["anees", "handoffs"] and compared.to_dict() == json.loads(compared.json)
    assert repr(compared) == 'Comparison(a="paper/table-2-pair", b="paper/table-2-pair", runs=4)'
    shown = compared._repr_html_()
    assert "verdict: neither A nor B is better" in shown and "4 runs of each" in shown
    assert "<td>anees</td><td>1</td>" in shown and "<td>0 to 0</td><td>same</td>" in shown
    assert str(compared).startswith("verdict: ") and "B - A" in str(compared)
    table = compared.metrics_table.to_pandas().set_index("metric")
    assert table.loc["anees", "verdict"] == "same" and table.loc["anees", "ci95_low"] == 0.0
    batch = standoff.monte_carlo(pair(), runs=4, seed=9, metrics="anees")
    assert compared.metrics["anees"]["mean_a"] == batch.metrics["anees"]["mean"]


def test_comparing_a_scenario_with_a_batch_is_an_error(tmp_path: Path) -> None:
    batch = standoff.monte_carlo(pair(), runs=2, out=tmp_path / "b")
    with pytest.raises(InputError, match="give two scenarios, or two batches"):
        standoff.compare(batch, "paper/table-2-pair")
    with pytest.raises(InputError, match="contains no results"):
        standoff.compare(tmp_path, batch)


def test_scenario_warnings_become_python_warnings(tmp_path: Path) -> None:
    cars = tmp_path / "cars.csv"
    cars.write_text("t,id,x,y\n0,a,0,0\n30,a,9,0\n")
    scenario = standoff.Scenario("improved/figure-9", traffic=cars)
    assert scenario.traffic_files == [cars] and pair().traffic_files == []
    assert standoff.Scenario("traffic/convoy").traffic_files == [], "it is built in"
    with pytest.warns(UserWarning, match="the traffic ends after 30 s"):
        standoff.monte_carlo(scenario, runs=1)
