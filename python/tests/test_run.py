"""Runs: the same bytes as the command, tables without a copy, errors."""

import concurrent.futures
import gc
import html
import json
import pickle
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd  # type: ignore[import-untyped]
import polars as pl
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import pytest

import standoff

TABLES = ["uavs", "truth", "tracks", "groups", "detections", "in_view", "events"]


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("arguments", "keywords"),
    [
        (["paper/table-2-pair", "--seed", "7"], {"scenario": "paper/table-2-pair", "seed": 7}),
        ([], {}),
        (
            ["traffic/city", "--uavs", "3", "--set", "guidance.lead_s=0.5", "--set", "duration_s=60", "--metrics", "all"],
            {"scenario": "traffic/city", "uavs": 3, "set": {"guidance": {"lead_s": 0.5}, "duration_s": 60.0}, "metrics": "all"},
        ),
    ],
)
def test_a_run_writes_the_same_bytes_as_the_command(
    command: Path, tmp_path: Path, arguments: list[str], keywords: dict[str, object]
) -> None:
    theirs, ours = tmp_path / "theirs", tmp_path / "ours"
    done = subprocess.run(
        [command, "run", *arguments, "--json", "--out", theirs], check=True, capture_output=True, text=True
    )
    run = standoff.run(**keywords, out=ours)  # type: ignore[arg-type]
    assert files(ours) == files(theirs)
    assert run.summary == json.loads(done.stdout)
    assert standoff.Run(ours, metrics=str(keywords.get("metrics", "standard"))).metrics == run.metrics


def test_the_baseline_equals_that_of_the_command(command: Path) -> None:
    arguments = [str(command), "baseline", "traffic/convoy", "--uavs", "3", "--json"]
    printed = subprocess.run(arguments, check=True, capture_output=True, text=True).stdout
    assert standoff.baseline("traffic/convoy", uavs=3) == json.loads(printed)


def test_tables_convert_to_arrow_libraries() -> None:
    run = standoff.run("tour/04-two-groups")
    for name in TABLES:
        whole = pq.read_table(run.dir / f"{name}.parquet")
        table = run.table(name)
        assert pa.table(table).equals(whole.cast(pa.table(table).schema))
        assert pl.DataFrame(table).shape == whole.shape
        assert list(pd.DataFrame.from_arrow(table).columns) == whole.column_names
    uavs = run.uavs
    counted = duckdb.sql("select count(*) from uavs")
    assert counted is not None and counted.fetchall() == [(len(uavs),)]
    assert np.array_equal(uavs.to_numpy("x_m"), pq.read_table(run.dir / "uavs.parquet")["x_m"].to_numpy())
    with pytest.raises(KeyError, match="no table \"uav\"; tables: uavs, truth"):
        run.table("uav")


def test_tables_convert_to_data_frames() -> None:
    run = standoff.run("tour/04-two-groups")
    uavs = run.uavs
    assert len(uavs) == len(uavs["x_m"]) and "x_m" in uavs and "x" not in uavs
    assert uavs["x_m"].dtype == np.float64 and np.array_equal(uavs["x_m"], uavs.to_numpy("x_m"))
    for table in [*(run.table(name) for name in TABLES), run.targets, run.metrics_table]:
        frame, constructed = table.to_pandas(), pd.DataFrame(table)
        assert list(frame.columns) == list(constructed.columns) == table.columns and len(frame) == len(table)
        for name in table.columns:
            # Rows do not have the type of a column without values.
            if frame[name].notna().any():
                pd.testing.assert_series_equal(frame[name], constructed[name], check_dtype=frame[name].dtype != np.int32)
        assert table.to_polars().equals(pl.DataFrame(table)) and table.to_polars().columns == table.columns
        assert table._repr_html_().count("<tr>") == 1 + min(len(table), 20)
    with pytest.raises(KeyError, match='no column "x_n"; did you mean "x_m"\\?; columns: time_us, time_s, uav'):
        uavs["x_n"]


def test_ids_of_tracks_and_groups_survive_pandas(tmp_path: Path) -> None:
    """pandas reads integers with nulls as doubles."""
    run = standoff.run("tour/10-unlabelled-detections", set={"duration_s": 20}, out=tmp_path / "run")
    events, tracks, groups = (
        (table.to_pandas(), pd.read_parquet(run.dir / f"{name}.parquet"))
        for name, table in [("events", run.events), ("tracks", run.tracks), ("groups", run.groups)]
    )
    for of_events, of_tracks, of_groups in zip(events, tracks, groups, strict=True):
        assert of_events.track_uid.isna().any() and of_events.track_uid.notna().sum() > 7
        assert set(of_events.track_uid.dropna()) <= set(of_tracks.track_uid)
        assert set(of_events.group_id.dropna()) <= set(of_groups.group_uid)


def test_pandas_and_polars_are_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    uavs = standoff.run("tour/01-one-uav").uavs
    for name in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ModuleNotFoundError, match=f"to_{name} needs {name}: pip install {name}"):
            getattr(uavs, f"to_{name}")()


def crossing() -> pd.DataFrame:
    """Two vehicles that drive over the equator and the antimeridian."""
    times = pd.date_range("2026-03-01T13:00:00+01:00", periods=7, freq="5s")
    return pd.concat(
        pd.DataFrame({"time": times, "vehicle": name, "lat": north + 1e-4 * n, "lon": (359.9998 + 1e-4 * n) % 360 - 180})
        for name, north, n in [("a", -2e-4, np.arange(7)), ("b", 2e-3, np.arange(7))]
    )


def test_rows_over_traffic_with_places_and_dates_have_both(tmp_path: Path) -> None:
    run = standoff.run(traffic=crossing(), uavs=2, out=tmp_path / "run")
    assert run.truth["time_utc"][0] == np.datetime64("2026-03-01T12:00:00")
    truth = run.truth.to_pandas()
    assert truth.time_utc.equals(pd.read_parquet(run.dir / "truth.parquet").time_utc)
    assert truth.time_utc.iloc[-1] == pd.Timestamp("2026-03-01T12:00:30Z")
    assert pa.table(run.truth).schema.equals(pq.read_schema(run.dir / "truth.parquet"), check_metadata=False)
    for name in TABLES:
        table = run.table(name)
        assert "time_utc" in table and ("latitude_deg" in table) == ("x_m" in table), name
    # The positions of the traffic, which are those of the truth.
    given = crossing()[lambda rows: rows.vehicle == "a"]
    known = truth[(truth.target == 0) & (truth.time_us % 5_000_000 == 0)]
    np.testing.assert_allclose(known.latitude_deg, given.lat, atol=1e-9)
    np.testing.assert_allclose((known.longitude_deg + 360) % 360, (given.lon + 360) % 360, atol=1e-9)
    assert "time_utc" not in standoff.run("tour/01-one-uav", set={"duration_s": 5}).truth


def test_rows_with_a_place_make_a_geodataframe(monkeypatch: pytest.MonkeyPatch) -> None:
    run = standoff.run(traffic=crossing(), uavs=2, set={"duration_s": 10})
    for frame, table in [(run.to_geodataframe(), run.tracks), (run.to_geodataframe("uavs"), run.uavs)]:
        assert frame.crs == "EPSG:4326" and list(frame.columns) == [*table.columns, "geometry"]
        np.testing.assert_array_equal(frame.geometry.x, table["longitude_deg"])
        np.testing.assert_array_equal(frame.geometry.y, table["latitude_deg"])
    with pytest.raises(standoff.InputError, match="the rows have no latitude_deg and longitude_deg: only runs over"):
        run.to_geodataframe("events")
    with pytest.raises(standoff.InputError, match="only runs over traffic in degrees, and flights"):
        standoff.run("tour/01-one-uav", set={"duration_s": 5}).to_geodataframe()
    monkeypatch.setitem(sys.modules, "geopandas", None)
    with pytest.raises(ModuleNotFoundError, match="to_geodataframe needs geopandas: pip install geopandas"):
        run.to_geodataframe()


def test_data_frames_are_traffic(tmp_path: Path) -> None:
    pandas = crossing()
    texts = pandas.assign(time=pandas.time.map(pd.Timestamp.isoformat))
    frames = [pandas, texts, pl.from_pandas(pandas), pl.from_pandas(texts), pa.Table.from_pandas(pandas)]
    scenarios = [standoff.Scenario("traffic/convoy", traffic=frame, uavs=2) for frame in frames]
    again = pickle.loads(pickle.dumps(scenarios[0]))
    changed = scenarios[0].changed(set={"traffic.gap_s": 20.0})
    runs = [standoff.run(scenario, set={"duration_s": 10, "traffic.gap_s": 20.0}) for scenario in [*scenarios, again]]
    runs.append(standoff.run(changed, set={"duration_s": 10}))
    for run in runs[1:]:
        assert files(run.dir) == files(runs[0].dir)
    texts.to_csv(tmp_path / "traffic.csv")
    theirs = standoff.run(traffic=tmp_path / "traffic.csv", uavs=2, set={"duration_s": 10, "traffic.gap_s": 20.0})
    assert files(theirs.dir) == files(runs[0].dir)
    with pytest.warns(UserWarning, match='skipped 1 sample without a position or time: "b"'):
        standoff.run(traffic=pandas.assign(lat=[*pandas.lat[:-1], None], lon=[*pandas.lon[:-1], None]), set={"duration_s": 5})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lat": ["here"] * 14}, 'traffic, row 0: vehicle "a": lat = "here" is not a number'),
        ({"lon": [11.3] * 13 + [1e3]}, 'traffic, row 13: vehicle "b": lon = "1000.0" is out of range'),
        ({"vehicle": None}, "traffic, row 0: vehicle = "),
        ({"time": 0.0, "lat": [44.0, 45.0] * 7}, 'traffic: vehicle "a": 7 samples at one time'),
    ],
)
def test_an_error_in_a_data_frame_names_its_row_and_column(change: dict[str, object], message: str) -> None:
    with pytest.raises(standoff.ScenarioError, match=message):
        standoff.run(traffic=crossing().assign(**change))


def test_targets_and_metrics_are_tables() -> None:
    run = standoff.run("tour/04-two-groups")
    targets = run.targets.to_pandas()
    assert len(targets) == len(run.summary["per_target"]) == 5
    assert targets["custody_fraction"].tolist() == [one["custody_fraction"] for one in run.summary["per_target"]]
    metrics = run.metrics_table.to_pandas().set_index("metric")
    assert metrics.loc["position_error_m", "unit"] == "m" and metrics.loc["custody_fraction", "unit"] == "1"
    assert metrics.loc["position_error_m", "value"] == run.metrics["position_error_m"]
    assert metrics.index.tolist() == list(run.metrics)


def test_a_map_is_added_to_a_run_and_to_its_report(tmp_path: Path) -> None:
    road = {"type": "LineString", "coordinates": [[0.0, 0.0], [0.001, 0.001]]}
    (tmp_path / "road.geojson").write_text(json.dumps({"type": "Feature", "properties": {"highway": "primary"}, "geometry": road}))
    rows = [f"{t},a,{0.0001 * t:.6f},{0.0001 * t:.6f}" for t in range(31)]
    (tmp_path / "cars.csv").write_text("\n".join(["t,id,lat,lon", *rows]))
    scenario = standoff.Scenario("traffic/convoy", traffic=tmp_path / "cars.csv", set={"duration_s": 20, "transient_s": 5})
    without = standoff.run(scenario, out=tmp_path / "without")
    run = standoff.run(scenario, map=tmp_path / "road.geojson", out=tmp_path / "with")
    assert 'data-part="map"' in (run.dir / "report.html").read_text()
    assert 'data-part="map"' not in (without.dir / "report.html").read_text()
    again = standoff.Run(without.dir, map=[tmp_path / "road.geojson"])
    assert (again.dir / "report.html").read_text() == (run.dir / "report.html").read_text()


def test_several_threads_can_read_a_table() -> None:
    table = standoff.run("traffic/city", set={"duration_s": 60.0}).tracks
    names = [name for name in table.columns if table.to_numpy(name).dtype == np.float64]
    alone = {name: table.to_numpy(name) for name in names}
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        for name, read in pool.map(lambda name: (name, table.to_numpy(name)), names * 20):
            assert np.array_equal(read, alone[name], equal_nan=True)


def test_a_temporary_run_is_deleted_after_its_last_reference() -> None:
    run = standoff.run("tour/01-one-uav")
    folder, table = run.dir, run.uavs
    del run
    gc.collect()
    # A table keeps its file.
    assert folder.exists() and table.to_numpy("uav").sum() == 0
    del table
    gc.collect()
    assert not folder.exists() and not folder.parent.exists()


def test_a_notebook_displays_the_page() -> None:
    run = standoff.run("tour/01-one-uav")
    shown = run._repr_html_()
    assert shown is not None and shown.startswith("<iframe") and "<title>standoff" in html.unescape(shown)
    assert "position error" in str(run) and "tour/01-one-uav, seed 1" in repr(run)


def test_scenarios_convert_to_and_from_dicts_and_toml() -> None:
    scenario = standoff.Scenario("improved/figure-9", set={"uavs": {"count": 3}, "guidance.law": "oh-2015"})
    assert scenario.to_dict()["uavs"]["count"] == 3
    # A round trip through TOML, dicts or pickle gives the same scenario.
    for again in (
        standoff.Scenario.from_toml(scenario.toml, name=scenario.name),
        standoff.Scenario.from_dict(scenario.to_dict(), name=scenario.name),
        pickle.loads(pickle.dumps(scenario)),
    ):
        assert again.toml == scenario.toml and again.resolved(5) == scenario.resolved(5)
    faster = scenario.changed(set={"uavs.speed_m_s": np.float64(45.0), "uavs.count": np.int32(5)})
    assert faster.to_dict()["uavs"]["speed_m_s"] == 45.0 and faster.to_dict()["uavs"]["count"] == 5
    assert tomllib.loads(faster.resolved(1)) != tomllib.loads(scenario.resolved(1))
    assert "paper/figure-9" in standoff.scenarios()


@pytest.mark.parametrize(
    ("keywords", "error", "message"),
    [
        ({"scenario": "tour/01-one-uavs"}, standoff.ScenarioError, "did you mean `tour/01-one-uav`"),
        ({"scenario": 5}, standoff.ScenarioError, "scenario: must be a built-in name, a path or a Scenario, not int"),
        ({"scenario": {"uavs": {}}}, standoff.ScenarioError, "Scenario, not dict: Scenario.from_dict makes a Scenario of a dict"),
        ({"set": ["guidance.lead_s=1"]}, TypeError, "must be a dict with str keys, not list\nwhile processing 'set'"),
        ({"metrics": 5}, TypeError, "must be names, as a str or a list of str, not int\nwhile processing 'metrics'"),
        ({"map": 5}, TypeError, "must be a path, or a list of paths, not int\nwhile processing 'map'"),
        ({"traffic": 5}, TypeError, "must be a path, or a data frame of pandas, polars or pyarrow, not int"),
        ({"set": {"guidance.lead_ss": 1}}, standoff.ScenarioError, "did you mean `lead_s`"),
        ({"set": {"uavs.count": None}}, standoff.ScenarioError, "uavs.count: a value must be a number"),
        ({"set": {"uavs.speed_m_s": float("nan")}}, standoff.ScenarioError, "uavs.speed_m_s"),
        ({"traffic": "nowhere.fcd.xml"}, standoff.ScenarioError, "nowhere.fcd.xml"),
        ({"seed": -1}, standoff.InputError, "seed = -1: must be at least 0"),
        ({"seed": 2**63}, standoff.InputError, "seed = 9223372036854775808: must be at most 9223372036854775807"),
        ({"uavs": -1}, standoff.InputError, "uavs = -1: must be at least 0"),
        ({"uavs": 10**50}, standoff.InputError, "uavs = .*: must be at most"),
        ({"metrics": "standart"}, standoff.InputError, "standart"),
        ({"map": "nowhere.net.xml"}, standoff.InputError, "nowhere.net.xml"),
        ({"map": ["nowhere.net.xml"]}, standoff.InputError, "nowhere.net.xml"),
        ({"law": 5}, TypeError, "law: must be a class"),
        ({"law": standoff.Law, "law_limit_s": 0.0}, standoff.InputError, "law_limit_s = 0.0: must be a time"),
    ],
)
def test_wrong_arguments_are_errors(keywords: dict[str, object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        standoff.run(**keywords)  # type: ignore[arg-type]


def test_an_error_marks_its_place_in_the_source_text() -> None:
    toml = standoff.Scenario("tour/01-one-uav").toml.replace("duration_s = ", "duration_s = -")
    with pytest.raises(standoff.ScenarioError, match=r"--> mine:\d+:\d+\n") as raised:
        standoff.Scenario.from_toml(toml, name="mine").resolved(1)
    assert "\n  | ^^^" in str(raised.value) or " ^" in str(raised.value)


def test_a_folder_with_other_files_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    with pytest.raises(standoff.InputError, match="letter.txt"):
        standoff.run("tour/01-one-uav", out=tmp_path)
    assert (tmp_path / "letter.txt").read_text() == "mine"


def test_a_damaged_record_is_refused(tmp_path: Path) -> None:
    run = standoff.run("tour/01-one-uav", out=tmp_path / "run")
    (run.dir / "uavs.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(standoff.InputError, match="uavs.parquet"):
        run.uavs.to_numpy("x_m")


LONG = "standoff.run('tour/04-two-groups', set={'duration_s': 20000.0}, out=sys.argv[1])"


def test_ctrl_c_stops_a_run_and_keeps_the_partial_record(tmp_path: Path) -> None:
    code = f"import standoff, sys\nprint('ready', flush=True)\n{LONG}"
    out = tmp_path / "run"
    with subprocess.Popen(
        [sys.executable, "-c", code, out], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        deadline = time.monotonic() + 20
        while not (tmp_path / "run.partial").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        _, stderr = process.communicate(timeout=20)
        took_s = time.monotonic() - began
    assert "KeyboardInterrupt" in stderr and took_s < 3.0, stderr
    assert not out.exists()
    if (tmp_path / "run.partial").exists():
        assert "unfinished" in stderr


def test_runs_release_the_gil() -> None:
    """Two runs on two threads, while this thread counts."""
    with concurrent.futures.ThreadPoolExecutor() as pool:
        runs = [pool.submit(standoff.run, "traffic/city", seed=seed) for seed in (1, 2)]
        counted = 0
        while not all(run.done() for run in runs):
            counted += 1
        alone = [standoff.run("traffic/city", seed=seed).metrics for seed in (1, 2)]
    assert counted > 1000 and [run.result().metrics for run in runs] == alone


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_forked_and_spawned_processes_give_the_same_metrics(method: str) -> None:
    import multiprocessing

    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        theirs = list(pool.map(_metrics, [1, 2], timeout=60))
    assert theirs == [_metrics(1), _metrics(2)]


def _metrics(seed: int) -> dict[str, float | None]:
    metrics: dict[str, float | None] = dict(standoff.run("tour/01-one-uav", seed=seed).metrics)
    return metrics


def test_a_sub_interpreter_is_refused_or_works() -> None:
    code = """
import _xxsubinterpreters as interpreters
import standoff
other = interpreters.create()
try:
    interpreters.run_string(other, "import standoff; print('flies', standoff.run('tour/01-one-uav').metrics['handoffs'])")
except interpreters.RunFailedError as error:
    print("refused:", error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "refused:" in done.stdout and "ImportError" in done.stdout or "flies 0" in done.stdout, done


def test_import_brings_nothing_but_numpy() -> None:
    """Optional modules, which are slow to import, are imported only when they are used."""
    code = "import numpy, sys; before = set(sys.modules); import standoff; print(*sorted(set(sys.modules) - before))"
    modules = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert {name.split(".")[0] for name in modules} == {"standoff"}, modules
