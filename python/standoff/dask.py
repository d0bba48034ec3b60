"""Batches on many machines: shards run as Dask tasks, are saved in a store, and are merged to byte-identical results.

Needs ``pip install 'standoff[dask]'``. docs/user/many-machines.md describes the use.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import re
import shutil
import tempfile
import time
import uuid
import weakref
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, TypeVar

try:
    from distributed import Client, Future

    from standoff._shard import (
        MANIFEST,
        PARTS,
        PLAN,
        RUNS,
        TRAFFIC,
        ShardTask,
        Plan,
        WorkerError,
        first_run_crc32,
        folder_of,
        traffic_name,
    )
    from standoff._store import Store
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"standoff.dask: {error}; pip install 'standoff[dask]'", name=error.name) from error

import standoff
from standoff._standoff import (
    Batch,
    Scenario,
    Sweep,
    _described,
    _difference,
    _fly_described,
    _sweep_complete,
    _sweep_difference,
    _sweep_plan,
    merge,
)
from standoff.errors import InputError, StandoffError

__all__ = ["WorkerError", "monte_carlo", "sweep"]

SHARD_S = 60.0
"""Default duration of a shard, s; the maximum work that is lost when a worker dies."""
SHARD_MIN_S = 1.0
"""Minimum duration of a shard, s; for shorter ones the overhead of a task dominates."""
SHARDS_MAX = 10_000
"""Maximum default number of shards; more tasks at a time make Dask's scheduler slow."""
CONNECTION_CHECK_S = 0.2
"""Interval of checks that the scheduler is still connected, s."""
SWEEP = "sweep.json"
"""Definition of a sweep."""

Results = TypeVar("Results", Batch, Sweep)


def monte_carlo(
    client: Client,
    scenario: str | os.PathLike[str] | Scenario,
    *,
    runs: int,
    out: str | os.PathLike[str],
    seed: int = 1,
    metrics: str | list[str] = "standard",
    shards: int | None = None,
    threads: int = 1,
    retries: int = 3,
    storage_options: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Batch:
    """Runs a scenario many times on a Dask cluster; the files are byte-identical to those of ``standoff monte-carlo``.

    Each shard is a task and is written to the store ``out`` when it is complete. After any interruption (a worker, the
    scheduler or this client killed, Ctrl-C), repeat the call to resume from the completed shards.

    :param client: a client of the cluster. Workers need the same version of standoff as this process.
    :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`standoff.Scenario`. Its
        traffic files are copied to the store, from where the workers fetch them.
    :param runs: number of runs, 1 to 100,000,000.
    :param out: the store, a folder or a URL that fsspec can open (``s3://bucket/batch``), which every worker can access
        under that name. It must be empty, or contain this batch.
    :param seed: seed of the first run; each further run adds 1.
    :param metrics: names of metrics and the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``: a comma-separated str,
        or a list.
    :param shards: number of shards. None: each shard takes about a minute on one thread, or less if that keeps all
        workers busy. A resumed batch keeps its number of shards.
    :param threads: threads per shard. 1 suits workers with one thread per core; a worker runs as many shards
        concurrently as it has threads (``nthreads``).
    :param retries: how often a shard is retried after a worker died or after a failure not caused by its input.
    :param storage_options: fsspec's options for opening ``out``, here and on the workers.
    :param progress: called as ``progress(done, of)``, in runs, whenever a shard is complete.
    :returns: the complete batch: in ``out`` if that is a local folder, otherwise in a temporary folder that is deleted
        with the object.
    :raises InputError: the scenario or an argument is wrong, a seed cannot be run, or ``out`` contains something else.
    :raises WorkerError: a worker has another version of standoff, or cannot access the store.
    :raises StandoffError: another failure; completed shards remain in ``out``.
    """
    if not isinstance(client, Client) or client.asynchronous:
        raise InputError("client: must be a distributed.Client that is not asynchronous")
    for name, value, least in [("shards", shards, 1), ("threads", threads, 1), ("retries", retries, 0)]:
        if value is not None and value < least:
            raise InputError(f"{name} = {value}: must be at least {least}")
    scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
    described = _described(scenario, runs, seed, metrics)
    store = Store.of(out, storage_options)
    batch = _complete(store, described)
    if batch is None:
        plan = _plan(client, store, scenario, described, runs, shards)
        batch = _BatchRun(client, store, scenario, plan, threads=threads, retries=retries, progress=progress).run()
    store.remove(PARTS)
    return batch


def sweep(
    client: Client,
    scenario: str | os.PathLike[str] | Scenario,
    *,
    vary: Mapping[str, Any],
    runs: int,
    out: str | os.PathLike[str],
    points: int | None = None,
    points_seed: int = 1,
    seed: int = 1,
    metrics: str | list[str] = "standard",
    threads: int = 1,
    retries: int = 3,
    storage_options: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """Runs a sweep on a Dask cluster, one point after the other; the table is byte-identical to that of
    :func:`standoff.sweep`.

    The batch of each point is distributed by :func:`monte_carlo`. After any interruption, repeat the call to resume.

    :param client: a client of the cluster, as for :func:`monte_carlo`, like the other parameters not described here.
    :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`standoff.Scenario`.
    :param vary: the keys to vary and their values, as for :func:`standoff.sweep`.
    :param runs: number of runs of each point.
    :param out: the store. It must be empty, or contain this sweep.
    :param points: number of points of a Latin hypercube. None: a grid of all combinations.
    :param points_seed: seed of the Latin hypercube.
    :param seed: seed of the first run of every point.
    :param metrics: names of metrics and the sets ``standard``, ``limits``, ``association``, ``table-2``, ``all``.
    :param threads: threads per shard.
    :param retries: how often a shard is retried.
    :param storage_options: fsspec's options for opening ``out``.
    :param progress: called as ``progress(done, of)``, in runs of all points, whenever a shard is complete.
    :returns: the complete sweep: in ``out`` if that is a local folder, otherwise in a temporary folder that is deleted
        with the object.
    :raises InputError: the scenario or an argument is wrong, a seed cannot be run, or ``out`` contains something else.
    :raises WorkerError: a worker has another version of standoff, or cannot access the store.
    :raises StandoffError: another failure; completed points and shards remain in ``out``.
    """
    definition, names, scenarios = _sweep_plan(scenario, dict(vary), points, points_seed, runs, seed, metrics)
    store = Store.of(out, storage_options)
    saved = store.read(SWEEP)
    if saved is not None:
        difference = _sweep_difference(definition, saved.decode(errors="replace"))
        if difference is not None:
            raise InputError(
                f"{store.url} contains another sweep: {difference}; use another folder, or remove this one"
            )
    else:
        others = store.names()
        if others:
            raise InputError(f"{store.url} contains {others[0]}, but no sweep; use another folder, or an empty one")
        store.write(SWEEP, definition.encode())

    def of_point(index: int) -> Callable[[int, int], object] | None:
        report = progress
        if report is None:
            return None
        return lambda done, of: report(index * runs + done, len(names) * runs)

    batches = []
    for index, (name, of_scenario) in enumerate(zip(names, scenarios, strict=True)):
        batches.append(
            monte_carlo(
                client,
                of_scenario,
                runs=runs,
                out=f"{store.url}/{name}",
                seed=seed,
                metrics=metrics,
                threads=threads,
                retries=retries,
                storage_options=storage_options,
                progress=of_point(index),
            )
        )
        # As on one machine: a page of almost 2 MB per point would be larger than the results.
        store.remove(f"{name}/report.html")
    if store.folder is not None:
        _sweep_complete(store.folder)
        return Sweep(store.folder)

    def completed(folder: Path) -> Sweep:
        (folder / SWEEP).write_text(definition)
        for name, batch in zip(names, batches, strict=True):
            shutil.copytree(batch.dir, folder / name, ignore=shutil.ignore_patterns("report.html"))
        _sweep_complete(folder)
        for file in (file for file in folder.iterdir() if file.is_file()):
            store.put(file, file.name)
        return Sweep(folder)

    return _in_temporary_folder(completed)


def _in_temporary_folder(fill: Callable[[Path], Results]) -> Results:
    """Returns the results that ``fill`` creates in a temporary folder, which is deleted together with them."""
    folder = Path(tempfile.mkdtemp(prefix="standoff-"))
    try:
        results = fill(folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(results, shutil.rmtree, folder, ignore_errors=True)
    return results


def _complete(store: Store, described: str) -> Batch | None:
    """Returns the batch if it is complete in the store, otherwise None."""
    manifest = store.read(MANIFEST)
    if manifest is None:
        return None
    _check_same_batch(store, described, manifest.decode(errors="replace"))
    if store.folder is not None:
        return Batch(store.folder)

    def downloaded(folder: Path) -> Batch:
        names = [name for name in store.names() if "/" not in name]
        store.get(names, [folder / name for name in names])
        return Batch(folder)

    return _in_temporary_folder(downloaded)


def _check_same_batch(store: Store, described: str, existing: str) -> None:
    try:
        difference = _difference(described, existing, None)
    except InputError as error:
        raise InputError(f"{store.url}: {error}; use another folder, or remove this one") from None
    if difference is not None:
        raise InputError(f"{store.url} contains another batch: {difference}; use another folder, or remove this one")


def _plan(client: Client, store: Store, scenario: Scenario, described: str, runs: int, shards: int | None) -> Plan:
    """Reads the plan from the store, or creates it."""
    saved = _saved_plan(store, described)
    if saved is not None:
        plan = saved
        if shards not in (None, plan.shards):
            raise InputError(
                f"{store.url} contains this batch in {plan.shards} shards, not {shards}: omit shards to resume it, or "
                "use another folder"
            )
    else:
        # A client that was killed may have left its traffic files; they will be overwritten.
        others = [name for name in store.names() if not name.startswith(f"{TRAFFIC}/")]
        if others:
            raise InputError(f"{store.url} contains {others[0]}, but no batch; use another folder, or an empty one")
        if shards is not None and shards > runs:
            raise InputError(f"shards = {shards}: must be at most {runs}, one run per shard")
        plan = Plan(described, shards or 1, [], 0)
    with tempfile.TemporaryDirectory(prefix="standoff-") as home:
        traffic = scenario._saved_traffic(home)
        began = time.perf_counter()
        first_crc32 = first_run_crc32(plan, traffic, Path(home, "first"))
        run_s = time.perf_counter() - began
        if shards is None and saved is None:
            # Measure several runs, because the first measurement includes the setup cost of a batch.
            several = min(runs, math.ceil(0.2 / run_s))
            if several > 1:
                began = time.perf_counter()
                _fly_described(described, traffic, f"0/{runs // several}", 1, Path(home, "several"), None)
                run_s = (time.perf_counter() - began) / several
            plan = replace(plan, shards=_shards(runs, run_s, sum(client.nthreads().values())))
        # Another call may have started a batch here in the meantime, or completed it.
        saved = saved or _saved_plan(store, described)
        if saved is not None:
            if first_crc32 != saved.first_crc32:
                raise InputError(
                    f"{store.url}: the first run has another result: its shards are from another build; complete them "
                    "with that build, or use another folder"
                )
            return saved
        completed = store.read(MANIFEST)
        if completed is not None:
            _check_same_batch(store, described, completed.decode(errors="replace"))
        for index, file in enumerate(traffic):
            store.put(file, traffic_name(index))
        plan = replace(plan, traffic=[file.name for file in traffic], first_crc32=first_crc32)
        store.write(PLAN, plan.to_json())
    return plan


def _saved_plan(store: Store, described: str) -> Plan | None:
    """Reads the plan from the store; it must be of this batch."""
    saved = store.read(PLAN)
    if saved is None:
        return None
    try:
        plan = Plan.of_json(saved)
    except (TypeError, ValueError) as error:
        raise InputError(f"{store.url}: {PLAN} is damaged ({error}); use another folder, or remove this one") from None
    _check_same_batch(store, described, plan.described)
    return plan


def _shards(runs: int, run_s: float, threads: int) -> int:
    """Default number of shards for runs that take ``run_s`` each, on workers with ``threads`` threads in total."""
    total_s = run_s * runs
    shards = max(total_s / SHARD_S, min(4 * threads, total_s / SHARD_MIN_S))
    return max(1, min(math.ceil(shards), runs, SHARDS_MAX))


def _task() -> Callable[[dict[str, Any]], str]:
    """Returns the function that Dask runs on workers.

    It is a local function so that Dask sends its code, not its name: a scheduler or worker without standoff, or without
    this module, would crash when it looked up the name, and Dask would retry.
    """

    def fly(order: dict[str, Any]) -> str:
        try:
            from standoff._shard import fly_shard
        except ImportError as error:
            from distributed import get_worker

            try:
                from standoff import __version__

                has = f"standoff {__version__}"
            except ImportError:
                has = "no standoff"
            raise ImportError(
                f"worker {get_worker().address} has {has} ({error}), the client {order['version']}: "
                "install the same version, as standoff[dask], on all of them"
            ) from None
        return fly_shard(order)

    return fly


class _BatchRun:
    """Runs the shards of a plan and merges them."""

    def __init__(
        self,
        client: Client,
        store: Store,
        scenario: Scenario,
        plan: Plan,
        *,
        threads: int,
        retries: int,
        progress: Callable[[int, int], object] | None,
    ) -> None:
        self.client, self.store, self.scenario, self.plan = client, store, scenario, plan
        self.runs: int = json.loads(plan.described)["runs"]
        self.threads, self.retries, self.progress = threads, retries, progress
        self.tries: Counter[int] = Counter()
        self.done = self._completed()

    def run(self) -> Batch:
        """Runs the shards that are missing in the store, and merges all shards."""
        self._report_progress()
        while True:
            self._run_shards(shard for shard in range(self.plan.shards) if shard not in self.done)
            with tempfile.TemporaryDirectory(prefix="standoff-") as home:
                folders = self._fetched(Path(home))
                damaged = [shard for shard, folder in folders.items() if not self._is_valid(shard, folder)]
                if not damaged:
                    return self._merged(list(folders.values()))
            for shard in damaged:
                self._failed(shard, "its files in the store are damaged")
                self.store.remove(folder_of(shard, self.plan.shards))
                self.done.discard(shard)

    def _completed(self) -> set[int]:
        """Shards that are complete in the store; the manifest of a shard is written last."""
        names = set(self.store.names(PARTS))
        folders = {shard: folder_of(shard, self.plan.shards) for shard in range(self.plan.shards)}
        return {shard for shard, folder in folders.items() if {f"{folder}/{MANIFEST}", f"{folder}/{RUNS}"} <= names}

    def _run_shards(self, missing: Iterable[int]) -> None:
        """Runs shards on the cluster."""
        ended: queue.SimpleQueue[Future[str]] = queue.SimpleQueue()
        running: dict[object, tuple[int, Future[str]]] = {}
        refused: dict[int, InputError] = {}
        batch = uuid.uuid4().hex[:8]
        version, plan_crc32 = standoff.__version__, zlib.crc32(self.plan.to_json())

        def launch(shards: Iterable[int]) -> None:
            order = ShardTask(
                version, self.store.url, dict(self.store.options), plan_crc32, 0, self.plan.shards, self.threads
            )
            orders = [asdict(replace(order, shard=shard)) for shard in shards]
            if not orders:
                return
            # Dask's dashboard names a group of tasks by the part of their keys before the first "-".
            start = self.scenario.name.replace("-", "_")
            keys = [f"{start}-{o['shard']}-of-{o['shards']}-{batch}-{self.tries[o['shard']]}" for o in orders]
            try:
                futures = self.client.map(_task(), orders, key=keys, pure=False)
            except Exception as error:
                raise StandoffError(f"the scheduler accepts no tasks: {error}; {self._how_to_resume()}") from error
            for order_of_shard, future in zip(orders, futures, strict=True):
                running[future.key] = (order_of_shard["shard"], future)
                future.add_done_callback(ended.put)

        def cancel(selects: Callable[[int], bool]) -> None:
            futures = [future for shard, future in running.values() if selects(shard)]
            if futures and self.client.status == "running":
                with contextlib.suppress(Exception):
                    self.client.cancel(futures, force=True)

        try:
            launch(missing)
            while running:
                try:
                    future = ended.get(timeout=CONNECTION_CHECK_S)
                except queue.Empty:
                    if self.client.status in ("closing", "closed"):
                        raise StandoffError(f"the client was closed; {self._how_to_resume()}") from None
                    continue
                if future.key not in running:
                    continue
                shard, _ = running.pop(future.key)
                if future.status == "finished":
                    self.done.add(shard)
                    self._report_progress()
                    continue
                if future.cancelled():
                    if refused and shard > min(refused):
                        continue
                    raise StandoffError(f"the scheduler is gone, or has dropped the shards; {self._how_to_resume()}")
                error = future.exception()
                if isinstance(error, (WorkerError, ImportError)):
                    raise WorkerError(f"{error}; {self._how_to_resume()}") from error
                if isinstance(error, InputError):
                    # As on one machine, report the lowest seed that cannot be run.
                    refused[shard] = error
                    cancel(lambda other, first=min(refused): other > first)  # type: ignore[misc]
                    continue
                self._failed(shard, f"{type(error).__name__}: {error}")
                launch([shard])
        except BaseException:
            cancel(lambda _: True)
            raise
        if refused:
            raise self._in_source_text(refused[min(refused)])

    def _in_source_text(self, error: InputError) -> InputError:
        """Repeats an error with the client's source text, because workers have an expanded scenario with other lines."""
        seed = re.match(r"seed (\d+): ", str(error))
        if seed is not None:
            try:
                self.scenario.resolved(int(seed[1]))
            except InputError as repeated:
                return InputError(f"{seed[0]}{repeated}\n{self._completed_text()}")
        return InputError(f"{error}\n{self._completed_text()}")

    def _failed(self, shard: int, why: str) -> None:
        """Counts a shard's failures; raises an error after the last retry."""
        self.tries[shard] += 1
        if self.tries[shard] > self.retries:
            times = f"{self.tries[shard]} times; the last time: {why}"
            raise StandoffError(f"shard {shard}/{self.plan.shards} failed {times}; {self._how_to_resume()}")

    def _fetched(self, home: Path) -> dict[int, Path]:
        """Returns the local folders of all shards; fetches them if the store is remote."""
        names = {shard: folder_of(shard, self.plan.shards) for shard in range(self.plan.shards)}
        if self.store.folder is not None:
            return {shard: self.store.folder / name for shard, name in names.items()}
        files = [f"{name}/{file}" for name in names.values() for file in (RUNS, MANIFEST)]
        self.store.get(files, [home / file for file in files])
        return {shard: home / name for shard, name in names.items()}

    def _is_valid(self, shard: int, folder: Path) -> bool:
        try:
            Batch(folder)
            manifest = (folder / MANIFEST).read_text()
            return _difference(self.plan.described, manifest, f"{shard}/{self.plan.shards}") is None
        except (InputError, OSError, ValueError):
            return False

    def _merged(self, folders: list[Path]) -> Batch:
        """Merges the shards and writes the batch to the store, its manifest last."""
        batch = merge(folders)
        files = sorted(file.name for file in batch.dir.iterdir())
        for name in sorted(files, key=lambda name: name == MANIFEST):
            self.store.put(batch.dir / name, name)
        return batch if self.store.folder is None else Batch(self.store.folder)

    def _report_progress(self) -> None:
        if self.progress is not None:
            shards = self.plan.shards
            done = sum((shard + 1) * self.runs // shards - shard * self.runs // shards for shard in self.done)
            self.progress(done, self.runs)

    def _completed_text(self) -> str:
        return f"{len(self.done)} of {self.plan.shards} shards are complete in {self.store.url}"

    def _how_to_resume(self) -> str:
        return f"{self._completed_text()}: repeat the call to resume"
