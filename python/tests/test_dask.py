"""Batches on Dask: results are byte-identical to those of one machine, whatever is killed and wherever the store is."""

import os
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cloudpickle  # type: ignore[import-untyped]
import dask
import pytest
from distributed import Client, LocalCluster

import standoff
import standoff.dask
from standoff import InputError, StandoffError
from standoff._shard import PLAN, Plan, ShardTask, first_run_crc32, fly_shard
from standoff._store import Store
from standoff.dask import WorkerError, monte_carlo

RUNS = 300
BOUND_S = 45
"""Time limit of each test, s; longer than any of them takes."""


@pytest.fixture(autouse=True)
def bounded() -> Iterator[None]:
    def late(number: int, frame: object) -> None:
        raise TimeoutError(f"not done after {BOUND_S} s")

    signal.signal(signal.SIGALRM, late)
    signal.alarm(BOUND_S)
    yield
    signal.alarm(0)


@pytest.fixture(scope="module", autouse=True)
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Puts the files of killed Dask processes into pytest's temporary folder."""
    folder = str(tmp_path_factory.mktemp("scratch"))
    with pytest.MonkeyPatch.context() as patch, dask.config.set(temporary_directory=folder):
        patch.setenv("DASK_TEMPORARY_DIRECTORY", folder)
        yield


def pair() -> standoff.Scenario:
    """The paper's pair, for 20 s only."""
    return standoff.Scenario("paper/table-2-pair", set={"duration_s": 20, "transient_s": 5})


def slow() -> standoff.Scenario:
    """A scenario whose runs take about 50 ms, so that there is time to kill something."""
    return standoff.Scenario("improved/figure-9")


SLOW_RUNS = 48


def files(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@contextmanager
def cluster(workers: int) -> Iterator[Client]:
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as started:
        with Client(started) as client:
            yield client


@pytest.fixture(scope="module")
def three(scratch: None) -> Iterator[Client]:
    with cluster(3) as client:
        yield client


@pytest.fixture(scope="module")
def one_machine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return files(standoff.monte_carlo(pair(), runs=RUNS, out=tmp_path_factory.mktemp("one") / "machine").dir)


@pytest.fixture(scope="module")
def slow_on_one_machine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return files(standoff.monte_carlo(slow(), runs=SLOW_RUNS, out=tmp_path_factory.mktemp("slow") / "machine").dir)


def pids(client: Client) -> dict[str, int]:
    found: dict[str, int] = client.run(os.getpid)
    return found


def wait_until(is_so: Callable[[], object], what: str) -> None:
    until = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < until, f"timeout while waiting until {what}"
        time.sleep(0.02)


def kept(store: Path) -> dict[str, int]:
    """Names and modification times of the complete shards in a store."""
    return {path.parent.name: path.stat().st_mtime_ns for path in store.glob("parts/*-of-*/monte-carlo.json")}


def test_any_number_of_workers_and_shards_gives_the_bytes_of_one_machine(
    three: Client, one_machine: dict[str, bytes], tmp_path: Path
) -> None:
    done: list[tuple[int, int]] = []
    batch = monte_carlo(
        three, pair(), runs=RUNS, shards=7, out=tmp_path / "three", progress=lambda *now: done.append(now)
    )
    assert batch.dir == tmp_path / "three" and files(batch.dir) == one_machine
    assert done[0] == (0, RUNS) and done[-1] == (RUNS, RUNS) and len(done) == 8 and done == sorted(done)
    with cluster(1) as one:
        assert files(monte_carlo(one, pair(), runs=RUNS, out=tmp_path / "one").dir) == one_machine
    # The batch is complete already: nothing is run.
    monte_carlo(three, pair(), runs=RUNS, out=tmp_path / "three", progress=lambda *now: done.clear())
    assert done


@pytest.mark.parametrize("store", ["folder", "memory"])
def test_a_sweep_gives_the_table_of_one_machine(three: Client, tmp_path: Path, store: str) -> None:
    vary = {"sensor.range_sd_m": [5, 20], "uavs.count": "2..3"}
    ours = standoff.sweep(pair(), vary=vary, points=3, runs=4, out=tmp_path / "ours")
    done: list[tuple[int, int]] = []
    if store == "folder":
        theirs = standoff.dask.sweep(
            three, pair(), vary=vary, points=3, runs=4, out=tmp_path / "theirs", progress=lambda *now: done.append(now)
        )
        assert done[-1] == (12, 12) and files(theirs.dir) == files(ours.dir)
        done.clear()
        again = standoff.dask.sweep(three, pair(), vary=vary, points=3, runs=4, out=tmp_path / "theirs")
        assert files(again.dir) == files(ours.dir) and not done
        with pytest.raises(InputError, match="contains another sweep: the number of runs of a point is 4, not 5"):
            standoff.dask.sweep(three, pair(), vary=vary, points=3, runs=5, out=tmp_path / "theirs")
        with pytest.raises(InputError, match="contains points/0/monte-carlo.json, but no batch"):
            monte_carlo(three, pair(), runs=3, out=tmp_path / "theirs")
        return
    with LocalCluster(n_workers=1, processes=False, dashboard_address="127.0.0.1:0") as started, Client(started) as client:
        theirs = standoff.dask.sweep(client, pair(), vary=vary, points=3, runs=4, out="memory://swept")
        assert files(theirs.dir) == files(ours.dir)
        assert "sweep.parquet" in Store.of("memory://swept", None).names()


def test_code_of_the_docs_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[2] / "docs" / "user" / "many-machines.md").read_text()
    code = "\n".join(block.split("```")[0] for block in page.split("```python\n")[1:3])
    monkeypatch.chdir(tmp_path)
    variables: dict[str, Any] = {}
    try:
        exec(
            code.replace("runs=400", "runs=40").replace("runs=100", "runs=4").replace("workers=2", "workers=2, dashboard_address='127.0.0.1:0'"),
            variables,
        )
        assert variables["batch"].dir == tmp_path / "batch"
        assert len(variables["swept"]) == 2
    finally:
        variables["client"].close()
        variables["cluster"].close()


def test_killing_a_worker_does_not_change_the_results(
    three: Client, slow_on_one_machine: dict[str, bytes], tmp_path: Path
) -> None:
    before = pids(three)
    killed: list[int] = []

    def kill(done: int, of: int) -> None:
        if 0 < done < of and not killed:
            for busy in [address for address, keys in three.processing().items() if keys][:1]:
                killed.append(before[busy])
                os.kill(before[busy], signal.SIGKILL)

    batch = monte_carlo(three, slow(), runs=SLOW_RUNS, shards=12, out=tmp_path / "out", progress=kill)
    assert files(batch.dir) == slow_on_one_machine
    three.wait_for_workers(3, timeout=20)
    assert killed and killed[0] not in pids(three).values()


def test_a_shard_whose_workers_always_die_is_an_error(three: Client, tmp_path: Path) -> None:
    stop = threading.Event()

    def kill_all() -> None:
        while not stop.wait(0.05):
            for pid in busy_workers():
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)

    def busy_workers() -> list[int]:
        with suppress(Exception):
            return [pid for address, pid in pids(three).items() if three.processing().get(address)]
        return []

    killer = threading.Thread(target=kill_all)
    killer.start()
    try:
        with pytest.raises(
            StandoffError, match=r"shard 0/1 failed 1 times; .*KilledWorker.*0 of 1 shards are complete"
        ):
            monte_carlo(three, slow(), runs=1000, shards=1, retries=0, out=tmp_path / "out")
    finally:
        stop.set()
        killer.join()
    three.wait_for_workers(3, timeout=20)


def test_a_partly_uploaded_shard_is_run_again(
    three: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    monte_carlo_of_half(three, out)
    plan_crc32 = zlib.crc32((out / PLAN).read_bytes())
    order = asdict(ShardTask(standoff.__version__, str(out), {}, plan_crc32, shard=1, shards=3, threads=1))
    put, remaining = Store.put, [2]

    def fail_after(store: Store, file: Path, name: str) -> None:
        if not remaining[0]:
            raise StandoffError("the worker dies here")
        remaining[0] -= 1
        put(store, file, name)

    monkeypatch.setattr(Store, "put", fail_after)
    with pytest.raises(StandoffError, match="dies here"):
        fly_shard(order)
    assert sorted(files(out)) == ["parts/1-of-3/runs.parquet", "parts/1-of-3/summary.json", "parts/batch.json"]
    monkeypatch.undo()
    done: list[int] = []
    batch = monte_carlo(three, pair(), runs=9, out=out, progress=lambda now, of: done.append(now))
    assert done[0] == 0 and files(batch.dir) == files(standoff.monte_carlo(pair(), runs=9).dir)


CLIENT = """
import sys, standoff, standoff.dask, distributed
with distributed.Client(sys.argv[1]) as client:
    standoff.dask.monte_carlo(client, "improved/figure-9", runs=int(sys.argv[2]), shards=12, out=sys.argv[3])
"""


def test_a_batch_resumes_after_its_client_was_killed(
    three: Client, slow_on_one_machine: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    address = three.scheduler_info()["address"]
    client = subprocess.Popen([sys.executable, "-c", CLIENT, str(address), str(SLOW_RUNS), str(out)])
    try:
        wait_until(lambda: len(kept(out)) >= 2, "two shards are complete")
    finally:
        client.kill()
        client.wait()
    # Its tasks are cancelled with it.
    wait_until(lambda: not any(three.processing().values()), "its tasks are cancelled")
    before = kept(out)
    assert 2 <= len(before) < 12
    # One shard without a manifest, as if its worker had died during the upload, and one with a truncated file.
    names = sorted(before)
    (out / "parts" / names[0] / "monte-carlo.json").unlink()
    runs = out / "parts" / names[1] / "runs.parquet"
    runs.write_bytes(runs.read_bytes()[:-100])
    batch = monte_carlo(three, slow(), runs=SLOW_RUNS, out=out)
    assert files(batch.dir) == slow_on_one_machine


@contextmanager
def processes_of_dask(folder: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """Starts a scheduler and two workers as separate processes; returns the scheduler and its address file."""
    with ExitStack() as cleanup:

        def start(*arguments: str) -> subprocess.Popen[bytes]:
            command = [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]]
            with open(folder / f"{arguments[0]}.log", "ab") as log:
                process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder)
            cleanup.callback(process.wait)
            cleanup.callback(process.kill)
            return process

        found = folder / "scheduler.json"
        found.unlink(missing_ok=True)
        # No dashboard, because its port may be in use.
        scheduler = start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(found)
        )
        wait_until(found.exists, "the scheduler has written its address")
        for _ in range(2):
            start(
                "worker", "--scheduler-file", str(found), "--nthreads", "1", "--no-nanny", "--no-dashboard",
                "--host", "127.0.0.1", "--local-directory", str(folder), "--death-timeout", "60",
            )  # fmt: skip
        yield scheduler, str(found)


def test_a_batch_resumes_after_its_scheduler_was_killed(
    slow_on_one_machine: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with processes_of_dask(tmp_path) as (scheduler, found):
        with Client(scheduler_file=found, timeout=60) as client:
            client.wait_for_workers(2, timeout=60)

            def kill(done: int, of: int) -> None:
                if done > 0:
                    scheduler.kill()

            with pytest.raises(StandoffError, match="of 12 shards are complete in .*: repeat the call to resume"):
                monte_carlo(client, slow(), runs=SLOW_RUNS, shards=12, out=out, progress=kill)
            client.close(timeout=1)
    before = kept(out)
    assert 1 <= len(before) < 12
    again: dict[str, int] = {}

    def look(done: int, of: int) -> None:
        again.update(kept(out))

    with processes_of_dask(tmp_path) as (scheduler, found):
        with Client(scheduler_file=found, timeout=60) as client:
            batch = monte_carlo(client, slow(), runs=SLOW_RUNS, out=out, progress=look)
    assert files(batch.dir) == slow_on_one_machine
    assert len(again) == 12 and before.items() <= again.items(), "a complete shard was run again"


def test_an_interrupt_cancels_running_tasks(three: Client, tmp_path: Path) -> None:
    def interrupt() -> None:
        wait_until(lambda: any(three.processing().values()), "shards run")
        time.sleep(0.3)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        monte_carlo(three, slow(), runs=100_000, shards=3, out=tmp_path / "out")
    began = time.monotonic()
    # Otherwise a shard of half an hour would block its worker.
    assert three.submit(sum, [1, 2], pure=False).result(timeout=10) == 3
    executing = "lambda dask_worker: len(dask_worker.state.executing)"
    wait_until(lambda: not any(three.run(eval(executing)).values()), "no shard runs")
    assert time.monotonic() - began < 10


def test_a_worker_of_another_version_is_refused(three: Client, tmp_path: Path) -> None:
    def become(version: str) -> None:
        import standoff

        standoff.__version__ = version  # type: ignore[misc]

    odd = next(iter(pids(three)))
    three.run(become, "0.0.9", workers=[odd])
    try:
        with pytest.raises(WorkerError) as error:
            monte_carlo(three, pair(), runs=RUNS, shards=30, out=tmp_path / "out")
    finally:
        three.run(become, standoff.__version__, workers=[odd])
    message = (
        f"worker {odd} has standoff 0.0.9, the client {standoff.__version__}: install the same version on all of them"
    )
    assert str(error.value).startswith(message)


def test_tasks_can_be_unpickled_without_standoff() -> None:
    """The scheduler, and workers with any version, unpickle a task before its version check can run."""
    task = cloudpickle.dumps(standoff.dask._task())
    code = f"import pickle, sys; sys.modules['standoff'] = None; pickle.loads({task!r})"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_a_worker_of_another_build_is_refused(three: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standoff.dask, "first_run_crc32", lambda *arguments: 1)
    with pytest.raises(WorkerError, match="gets another result for the first run than the client"):
        monte_carlo(three, pair(), runs=RUNS, out=tmp_path / "out")
    monkeypatch.undo()
    with pytest.raises(InputError, match="its shards are from another build"):
        monte_carlo(three, pair(), runs=RUNS, out=tmp_path / "out")


def test_workers_get_the_traffic_file(three: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cars.csv").write_text("t,id,x,y\n" + "".join(f"{t},a,{9 * t},0\n{t},b,0,{7 * t}\n" for t in range(40)))
    scenario = standoff.Scenario("traffic/convoy", traffic="cars.csv")
    one = standoff.monte_carlo(scenario, runs=20)
    batch = monte_carlo(three, scenario, runs=20, shards=4, out="out")
    assert batch.dir == tmp_path / "out" and files(batch.dir) == files(one.dir)


def test_workers_get_several_traffic_files_under_their_names(three: Client, tmp_path: Path) -> None:
    # Both files have a vehicle "a", which is named after its file.
    cars = [tmp_path / name for name in ("a [1].csv", "b.csv")]
    for nth, file in enumerate(cars):
        file.write_text("t,id,x,y\n" + "".join(f"{t},a,{9 * t},{50 * nth}\n" for t in range(40)))
    scenario = standoff.Scenario("traffic/convoy", set={"traffic.file": [str(file) for file in cars]})
    assert scenario.traffic_files == cars
    one = standoff.monte_carlo(scenario, runs=20)
    batch = monte_carlo(three, scenario, runs=20, shards=4, out=tmp_path / "out")
    assert files(batch.dir) == files(one.dir)
    vary = {"uavs.count": [1, 2]}
    local = standoff.sweep(scenario, vary=vary, runs=2, out=tmp_path / "local")
    distributed = standoff.dask.sweep(three, scenario, vary=vary, runs=2, out=tmp_path / "distributed")
    assert (distributed.dir / "sweep.parquet").read_bytes() == (local.dir / "sweep.parquet").read_bytes()


def test_the_lowest_seed_that_cannot_be_run_is_reported(three: Client, tmp_path: Path) -> None:
    uniform = {"uniform": {"min": 300.0, "max": 750.0}}
    scenario = pair().changed(set={"orbit.radius_min_m": uniform})
    with pytest.raises(InputError) as local_error:
        standoff.monte_carlo(scenario, runs=20, seed=5)
    with pytest.raises(InputError) as dask_error:
        monte_carlo(three, scenario, runs=20, seed=5, shards=20, out=tmp_path / "out")
    on_one_machine, on_dask = str(local_error.value), str(dask_error.value)
    seed = on_one_machine.split(":")[0]
    assert seed.startswith("seed ") and on_dask.startswith(f"{seed}: ")
    assert "orbit.radius_max_m = 700: must be at least" in on_one_machine
    assert "orbit.radius_max_m = 700: must be at least" in on_dask


@contextmanager
def s3() -> Iterator[dict[str, Any]]:
    """Starts a local S3 server with a bucket; returns the options for accessing it."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    try:
        host, port = server.get_host_and_port()
        options = {"key": "a", "secret": "b", "client_kwargs": {"endpoint_url": f"http://{host}:{port}"}}
        import s3fs  # type: ignore[import-untyped]

        s3fs.S3FileSystem(**options).mkdir("batches")
        yield options
    finally:
        server.stop()


def test_a_store_on_s3_holds_the_same_bytes(three: Client, one_machine: dict[str, bytes]) -> None:
    import s3fs

    with s3() as options:
        arguments: dict[str, Any] = {"runs": RUNS, "out": "s3://batches/of/mine", "storage_options": options}

        def stop(done: int, of: int) -> None:
            if done > 0:
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            monte_carlo(three, pair(), shards=5, progress=stop, **arguments)
        done: list[int] = []
        batch = monte_carlo(three, pair(), progress=lambda now, of: done.append(now), **arguments)
        assert 0 < done[0] < RUNS and done[-1] == RUNS
        store = s3fs.S3FileSystem(use_listings_cache=False, **options)
        stored = {path.removeprefix("batches/of/mine/"): store.cat_file(path) for path in store.find("batches/of/mine")}
        assert stored == one_machine == files(batch.dir)
        again = monte_carlo(three, pair(), progress=lambda now, of: done.clear(), **arguments)
        assert done and files(again.dir) == one_machine and again.dir != batch.dir
        with pytest.raises(InputError, match=r"s3://batches/of/mine contains another batch: the first seed is 1, not 2"):
            monte_carlo(three, pair(), seed=2, **arguments)


def test_a_store_that_workers_cannot_access_is_an_error(three: Client) -> None:
    with pytest.raises(WorkerError, match="does not find this batch's parts/batch.json in memory://out: out must be"):
        monte_carlo(three, pair(), runs=9, out="memory://out")


def test_a_batch_that_another_call_starts_in_the_same_store_is_refused(
    three: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plan of the other batch appears while this call measures its first run, or after it has written its own."""
    other = Plan.of_json(plan_of(three, tmp_path / "other", seed=2))

    def late(*arguments: Any) -> int:
        Store.of(tmp_path / "out", None).write(PLAN, other.to_json())
        return first_run_crc32(*arguments)

    monkeypatch.setattr(standoff.dask, "first_run_crc32", late)
    with pytest.raises(InputError, match="out contains another batch: the first seed is 2, not 1; use another folder"):
        monte_carlo(three, pair(), runs=9, out=tmp_path / "out")
    assert Plan.of_json((tmp_path / "out" / PLAN).read_bytes()) == other
    monkeypatch.undo()
    write = Store.write

    def overwritten(store: Store, name: str, data: bytes) -> None:
        write(store, name, data)
        write(store, name, other.to_json())

    monkeypatch.setattr(Store, "write", overwritten)
    with pytest.raises(WorkerError, match="finds the parts/batch.json of another batch in .*: another call writes to"):
        monte_carlo(three, pair(), runs=9, out=tmp_path / "late")


def plan_of(client: Client, folder: Path, seed: int) -> bytes:
    """The plan of a batch; its call is interrupted when it has written the plan."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(standoff.dask._BatchRun, "run", lambda self: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            monte_carlo(client, pair(), runs=9, seed=seed, out=folder)
    return (folder / PLAN).read_bytes()


def test_wrong_input_is_an_error(three: Client, tmp_path: Path) -> None:
    def refused(message: str, **wrong: Any) -> None:
        arguments: dict[str, Any] = {"runs": 9, "out": tmp_path / "out", **wrong}
        with pytest.raises(InputError) as error:
            monte_carlo(arguments.pop("client", three), arguments.pop("scenario", pair()), **arguments)
        assert message in str(error.value)

    refused("client: must be a distributed.Client", client="tcp://127.0.0.1:8786")
    refused("runs = 0: must be at least 1", runs=0)
    refused("shards = 0: must be at least 1", shards=0)
    refused("shards = 10: must be at most 9", shards=10)
    refused("threads = 0: must be at least 1", threads=0)
    refused("retries = -1: must be at least 0", retries=-1)
    refused("no such metric", metrics="anes")
    refused("no such scenario", scenario="papers/table-2-pair")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "letter.txt").write_text("Dear Sir or Madam")
    refused("contains letter.txt, but no batch", out=tmp_path / "taken")
    with pytest.raises(StandoffError, match="gopher://hole: cannot .*gopher"):
        monte_carlo(three, pair(), runs=9, out="gopher://hole")
    monte_carlo_of_half(three, tmp_path / "half")
    refused("contains this batch in 3 shards, not 4", out=tmp_path / "half", shards=4)
    refused("the number of runs is 9, not 8", out=tmp_path / "half", runs=8)
    plan = tmp_path / "half" / "parts" / "batch.json"
    for damaged in (plan.read_bytes()[:-9], plan.read_bytes().replace(b'"shards": 3', b'"shards": -3'), b"[]"):
        plan.write_bytes(damaged)
        refused("half: parts/batch.json is damaged", out=tmp_path / "half")
    (tmp_path / "half" / "monte-carlo.json").write_text("{")
    refused("half: batch JSON: EOF", out=tmp_path / "half")


def monte_carlo_of_half(client: Client, out: Path) -> None:
    def stop(done: int, of: int) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        monte_carlo(client, pair(), runs=9, shards=3, out=out, progress=stop)


def test_default_shards_take_about_a_minute_and_keep_all_workers_busy() -> None:
    shards = standoff.dask._shards
    assert shards(10_000_000, 0.0025, 16) == 417
    assert shards(10_000_000, 0.0025, 1000) == 4000
    assert shards(1000, 0.0025, 16) == 3, "at least a second each"
    assert shards(5, 100.0, 2) == 5 and shards(1, 1e-6, 1) == 1
    assert shards(100_000_000, 1.0, 10) == 10_000
