"""Batches on many machines: shards as Dask tasks, kept in a store, merged to the bytes of one machine.

Needs ``pip install 'standoff[dask]'``. docs/many-machines.md tells how to use it.
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
from typing import Any

try:
    from distributed import Client, Future

    from standoff._shard import (
        MANIFEST,
        PARTS,
        PLAN,
        RUNS,
        TRAFFIC,
        Order,
        Plan,
        WorkerError,
        first_run_crc32,
        folder_of,
    )
    from standoff._store import Store
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"standoff.dask: {error}; pip install 'standoff[dask]'", name=error.name) from error

import standoff
from standoff._standoff import Batch, Scenario, _described, _difference, _fly_described, merge
from standoff.errors import InputError, StandoffError

__all__ = ["WorkerError", "monte_carlo"]

SHARD_S = 60.0
"""How long a shard flies, unless asked for otherwise, s: what a worker that dies loses."""
SHARD_MIN_S = 1.0
"""A shard that is shorter costs more to hand out than it is worth, s."""
SHARDS_MAX = 10_000
"""More tasks at a time make Dask's scheduler slow."""
GLANCE_S = 0.2
"""How often is looked whether the scheduler is still there, s."""


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
    """Flies a scenario many times on a Dask cluster: the same files, to the byte, as ``standoff monte-carlo``.

    Shards are tasks; each is put into the store ``out`` when it is complete. Whatever ends the batch (a worker, the
    scheduler or this client killed, Ctrl-C), the same call goes on from what is kept there.

    :param client: a client of the cluster. Workers need the same version of standoff as this process.
    :param scenario: a built-in scenario's name, the path of a scenario file, or a :class:`standoff.Scenario`. Its
        traffic file goes into the store, from where the workers fetch it.
    :param runs: number of runs, 1 to 100,000,000.
    :param out: the store, a folder or a URL that fsspec opens (``s3://bucket/batch``), which every worker reaches by
        that name. It must be empty, or hold this batch.
    :param seed: seed of the first run; the next has the next.
    :param metrics: names of metrics and the sets ``standard``, ``limits``, ``table-2``, ``all``: a str with commas
        between, or a list.
    :param shards: number of shards. None: so many that each flies for about a minute on one thread, or as few as keep
        all workers busy. A batch that goes on has as many as it had.
    :param threads: threads of one shard. 1 fits workers with a thread per core; a worker flies as many shards at a
        time as it has threads (``nthreads``).
    :param retries: how often a shard is flown again whose worker died, or that failed for another reason than its
        input.
    :param storage_options: what fsspec needs to open ``out``, here and on the workers.
    :param progress: called as ``progress(done, of)``, runs, whenever a shard is complete.
    :returns: the complete batch: in ``out`` if that is a folder of this machine, else in a temporary one, which goes
        with it.
    :raises InputError: the scenario or an argument is wrong, a seed cannot be flown, or ``out`` holds something else.
    :raises WorkerError: a worker has another version of standoff, or does not reach the store.
    :raises StandoffError: something failed on the way; shards that are complete are kept in ``out``.
    """
    if not isinstance(client, Client) or client.asynchronous:
        raise InputError("client: must be a distributed.Client that is not asynchronous")
    for name, value, least in [("shards", shards, 1), ("threads", threads, 1), ("retries", retries, 0)]:
        if value is not None and value < least:
            raise InputError(f"{name} = {value}: must be at least {least}")
    scenario = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
    described = _described(scenario, runs, seed, metrics)
    store = Store.of(out, storage_options)
    there = _complete(store, described)
    if there is None:
        plan = _plan(client, store, scenario, described, runs, shards)
        there = _Flight(client, store, scenario, plan, threads=threads, retries=retries, progress=progress).fly()
    store.remove(PARTS)
    return there


def _complete(store: Store, described: str) -> Batch | None:
    """The batch, if it is complete in the store."""
    manifest = store.read(MANIFEST)
    if manifest is None:
        return None
    _must_be_this(store, described, manifest.decode(errors="replace"))
    if store.folder is not None:
        return Batch(store.folder)
    folder = Path(tempfile.mkdtemp(prefix="standoff-"))
    try:
        names = [name for name in store.names() if "/" not in name]
        store.get(names, [folder / name for name in names])
        batch = Batch(folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(batch, shutil.rmtree, folder, ignore_errors=True)
    return batch


def _must_be_this(store: Store, described: str, there: str) -> None:
    try:
        difference = _difference(described, there, None)
    except InputError as error:
        raise InputError(f"{store.url}: {error}; name another folder, or remove that one") from None
    if difference is not None:
        raise InputError(f"{store.url} holds another batch: {difference}; name another folder, or remove that one")


def _plan(client: Client, store: Store, scenario: Scenario, described: str, runs: int, shards: int | None) -> Plan:
    """The plan in the store, or a new one."""
    kept = store.read(PLAN)
    if kept is not None:
        try:
            plan = Plan.of_json(kept)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"{store.url}: {PLAN} is damaged ({error}); name another folder, or remove that one"
            ) from None
        _must_be_this(store, described, plan.described)
        if shards not in (None, plan.shards):
            raise InputError(
                f"{store.url} holds this batch in {plan.shards} shards, not {shards}: leave shards out to go on with "
                "it, or name another folder"
            )
    else:
        # What a client that was killed has left of its traffic is no harm.
        others = [name for name in store.names() if name != TRAFFIC]
        if others:
            raise InputError(f"{store.url} holds {others[0]}, no batch; name another folder, or an empty one")
        if shards is not None and shards > runs:
            raise InputError(f"shards = {shards}: must be at most {runs}, a run for each")
        plan = Plan(described, shards or 1, False, 0)
    traffic = scenario.traffic_file
    with tempfile.TemporaryDirectory(prefix="standoff-") as home:
        began = time.perf_counter()
        first_crc32 = first_run_crc32(plan, traffic, Path(home, "first"))
        run_s = time.perf_counter() - began
        if kept is not None:
            if first_crc32 != plan.first_crc32:
                raise InputError(
                    f"{store.url}: the first run comes out otherwise: the shards there are another build's; complete "
                    "them with that build, or name another folder"
                )
            return plan
        if shards is None:
            # What is asked once for every batch weighs less on several runs.
            several = min(runs, math.ceil(0.2 / run_s))
            if several > 1:
                began = time.perf_counter()
                _fly_described(described, traffic, f"0/{runs // several}", 1, Path(home, "several"), None)
                run_s = (time.perf_counter() - began) / several
            shards = _shards(runs, run_s, sum(client.nthreads().values()))
    if traffic is not None:
        store.put(traffic, TRAFFIC)
    plan = Plan(described, shards, traffic is not None, first_crc32)
    store.write(PLAN, plan.to_json())
    return plan


def _shards(runs: int, run_s: float, threads: int) -> int:
    """How many shards such runs are worth on so many threads."""
    of_s = run_s * runs
    shards = max(of_s / SHARD_S, min(4 * threads, of_s / SHARD_MIN_S))
    return max(1, min(math.ceil(shards), runs, SHARDS_MAX))


def _task() -> Callable[[dict[str, Any]], str]:
    """What Dask hands to workers.

    It is within a function so that Dask sends its code, not its name: a scheduler or a worker that has no standoff, or
    one without this module, would end when it looked for the name, and be asked again.
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


class _Flight:
    """The shards of a plan, on their way."""

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
        self.done = self._kept()

    def fly(self) -> Batch:
        """Flies what is missing in the store, and merges all of it."""
        self._tell()
        while True:
            self._fly(shard for shard in range(self.plan.shards) if shard not in self.done)
            with tempfile.TemporaryDirectory(prefix="standoff-") as home:
                folders = self._fetched(Path(home))
                damaged = [shard for shard, folder in folders.items() if not self._is_whole(shard, folder)]
                if not damaged:
                    return self._merged(list(folders.values()))
            for shard in damaged:
                self._failed(shard, "what is in the store is damaged")
                self.store.remove(folder_of(shard, self.plan.shards))
                self.done.discard(shard)

    def _kept(self) -> set[int]:
        """Shards that are in the store: their manifest is what comes last."""
        names = set(self.store.names(PARTS))
        folders = {shard: folder_of(shard, self.plan.shards) for shard in range(self.plan.shards)}
        return {shard for shard, folder in folders.items() if {f"{folder}/{MANIFEST}", f"{folder}/{RUNS}"} <= names}

    def _fly(self, missing: Iterable[int]) -> None:
        """Has the cluster fly these shards."""
        ended: queue.SimpleQueue[Future[str]] = queue.SimpleQueue()
        flying: dict[object, tuple[int, Future[str]]] = {}
        refused: dict[int, InputError] = {}
        batch = uuid.uuid4().hex[:8]
        version, plan_crc32 = standoff.__version__, zlib.crc32(self.plan.to_json())

        def launch(shards: Iterable[int]) -> None:
            order = Order(
                version, self.store.url, dict(self.store.options), plan_crc32, 0, self.plan.shards, self.threads
            )
            orders = [asdict(replace(order, shard=shard)) for shard in shards]
            if not orders:
                return
            # Dask's dashboard calls a group of tasks what stands before the first "-".
            start = self.scenario.name.replace("-", "_")
            keys = [f"{start}-{o['shard']}-of-{o['shards']}-{batch}-{self.tries[o['shard']]}" for o in orders]
            try:
                futures = self.client.map(_task(), orders, key=keys, pure=False)
            except Exception as error:
                raise StandoffError(f"the scheduler takes no tasks: {error}; {self._told()}") from error
            for asked, future in zip(orders, futures, strict=True):
                flying[future.key] = (asked["shard"], future)
                future.add_done_callback(ended.put)

        def cancel(of: Callable[[int], bool]) -> None:
            futures = [future for shard, future in flying.values() if of(shard)]
            if futures and self.client.status == "running":
                with contextlib.suppress(Exception):
                    self.client.cancel(futures, force=True)

        try:
            launch(missing)
            while flying:
                try:
                    future = ended.get(timeout=GLANCE_S)
                except queue.Empty:
                    if self.client.status in ("closing", "closed"):
                        raise StandoffError(f"the client was closed; {self._told()}") from None
                    continue
                if future.key not in flying:
                    continue
                shard, _ = flying.pop(future.key)
                if future.status == "finished":
                    self.done.add(shard)
                    self._tell()
                    continue
                if future.cancelled():
                    if refused and shard > min(refused):
                        continue
                    raise StandoffError(f"the scheduler is gone, or has dropped the shards; {self._told()}")
                error = future.exception()
                if isinstance(error, (WorkerError, ImportError)):
                    raise WorkerError(f"{error}; {self._told()}") from error
                if isinstance(error, InputError):
                    # As on one machine: of seeds that cannot be flown the lowest is told.
                    refused[shard] = error
                    cancel(lambda other, first=min(refused): other > first)  # type: ignore[misc]
                    continue
                self._failed(shard, f"{type(error).__name__}: {error}")
                launch([shard])
        except BaseException:
            cancel(lambda _: True)
            raise
        if refused:
            raise self._as_typed(refused[min(refused)])

    def _as_typed(self, error: InputError) -> InputError:
        """The same of what was typed here: workers have it spelt out, on other lines."""
        seed = re.match(r"seed (\d+): ", str(error))
        if seed is not None:
            try:
                self.scenario.resolved(int(seed[1]))
            except InputError as typed:
                return InputError(f"{seed[0]}{typed}\n{self._kept_told()}")
        return InputError(f"{error}\n{self._kept_told()}")

    def _failed(self, shard: int, why: str) -> None:
        """Counts what a shard has cost; gives it up when that is too much."""
        self.tries[shard] += 1
        if self.tries[shard] > self.retries:
            times = f"{self.tries[shard]} times; the last time: {why}"
            raise StandoffError(f"shard {shard}/{self.plan.shards} failed {times}; {self._told()}")

    def _fetched(self, home: Path) -> dict[int, Path]:
        """The folders of all shards on this machine."""
        names = {shard: folder_of(shard, self.plan.shards) for shard in range(self.plan.shards)}
        if self.store.folder is not None:
            return {shard: self.store.folder / name for shard, name in names.items()}
        files = [f"{name}/{file}" for name in names.values() for file in (RUNS, MANIFEST)]
        self.store.get(files, [home / file for file in files])
        return {shard: home / name for shard, name in names.items()}

    def _is_whole(self, shard: int, folder: Path) -> bool:
        try:
            Batch(folder)
            manifest = (folder / MANIFEST).read_text()
            return _difference(self.plan.described, manifest, f"{shard}/{self.plan.shards}") is None
        except (InputError, OSError, ValueError):
            return False

    def _merged(self, folders: list[Path]) -> Batch:
        """The whole batch in the store, its manifest last."""
        batch = merge(folders)
        files = sorted(file.name for file in batch.dir.iterdir())
        for name in sorted(files, key=lambda name: name == MANIFEST):
            self.store.put(batch.dir / name, name)
        return batch if self.store.folder is None else Batch(self.store.folder)

    def _tell(self) -> None:
        if self.progress is not None:
            shards = self.plan.shards
            done = sum((shard + 1) * self.runs // shards - shard * self.runs // shards for shard in self.done)
            self.progress(done, self.runs)

    def _kept_told(self) -> str:
        return f"{len(self.done)} of {self.plan.shards} shards are complete in {self.store.url}"

    def _told(self) -> str:
        return f"{self._kept_told()}: the same call goes on from there"
