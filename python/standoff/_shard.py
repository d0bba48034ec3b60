"""Runs one shard of a batch on a Dask worker and writes it to the store."""

from __future__ import annotations

import json
import tempfile
import threading
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import standoff
from standoff._standoff import _fly_described
from standoff.errors import StandoffError
from standoff._store import Store

PARTS = "parts"
"""Folder of the store that holds the shards until they are merged."""
PLAN = f"{PARTS}/batch.json"
TRAFFIC = f"{PARTS}/traffic"
"""Folder of the traffic files, which are numbered from 0."""
RUNS = "runs.parquet"
MANIFEST = "monte-carlo.json"
"""Definition of a shard with the checksum of its runs. It is written last, so a shard without it is incomplete."""


class WorkerError(StandoffError):
    """A worker cannot be used: it has another version of standoff, or cannot access the store."""


@dataclass(frozen=True)
class Plan:
    """Definition of the batch and its number of shards; saved in the store for the workers and for resuming."""

    described: str
    shards: int
    traffic: list[str]
    """Names of the traffic files; they determine names of vehicles that occur in several files."""
    first_crc32: int
    """Checksum of the batch's first run on the client; the build of every worker must reproduce it."""

    def to_json(self) -> bytes:
        return json.dumps(self.__dict__, indent=2).encode() + b"\n"

    @staticmethod
    def of_json(text: bytes) -> Plan:
        """Parses the output of :meth:`to_json`; raises ValueError or TypeError if it is invalid."""
        plan = Plan(**json.loads(text))
        kinds = [type(value) for value in plan.__dict__.values()]
        if kinds != [str, int, list, int] or plan.shards < 1 or any(name != Path(name).name for name in plan.traffic):
            raise ValueError("not a plan")
        return plan

    def first_run(self) -> str:
        """The shard that consists of the first run only, as ``I/N``."""
        return f"0/{json.loads(self.described)['runs']}"


def folder_of(shard: int, shards: int) -> str:
    return f"{PARTS}/{shard}-of-{shards}"


def traffic_name(index: int) -> str:
    return f"{TRAFFIC}/{index}"


def first_run_crc32(plan: Plan, traffic: Sequence[Path], folder: Path) -> int:
    _fly_described(plan.described, traffic, plan.first_run(), 1, folder, None)
    return zlib.crc32((folder / RUNS).read_bytes())


@dataclass(frozen=True)
class ShardTask:
    """A worker's task: plain values only, so that workers with any version of standoff can read it."""

    version: str
    url: str
    options: dict[str, Any]
    plan_crc32: int
    shard: int
    shards: int
    threads: int


_checked: set[int] = set()
"""Checksums of the plans whose first run this process has reproduced."""
_checking = threading.Lock()


def fly_shard(order: dict[str, Any]) -> str:
    """Runs a shard and writes it to the store. Returns the shard's folder there."""
    worker = _Worker()
    if order["version"] != standoff.__version__:
        raise WorkerError(
            f"worker {worker.name} has standoff {standoff.__version__}, the client {order['version']}: "
            "install the same version on all of them"
        )
    task = ShardTask(**order)
    store = Store(task.url, task.options)
    text = _read_plan(store)
    if text is None:
        raise WorkerError(
            f"worker {worker.name} does not find this batch's {PLAN} in {store.url}: out must be a store that every "
            "worker can access under that name, and that no other call uses"
        )
    if zlib.crc32(text) != task.plan_crc32:
        raise WorkerError(
            f"worker {worker.name} finds the {PLAN} of another batch in {store.url}: another call writes to this store; "
            "use another folder"
        )
    plan = Plan.of_json(text)
    with tempfile.TemporaryDirectory(prefix="standoff-", dir=worker.folder, ignore_cleanup_errors=True) as temporary:
        home = Path(temporary)
        traffic = [home / "traffic" / str(index) / name for index, name in enumerate(plan.traffic)]
        store.get([traffic_name(index) for index in range(len(traffic))], traffic)
        with _checking:
            if task.plan_crc32 not in _checked:
                _check_build(plan, traffic, home / "first", worker)
                _checked.add(task.plan_crc32)
        part = home / "part"
        shard = f"{task.shard}/{task.shards}"
        _fly_described(plan.described, traffic, shard, task.threads, part, worker.stop_if_cancelled)
        folder = folder_of(task.shard, task.shards)
        files = sorted(file.name for file in part.iterdir())
        for name in sorted(files, key=lambda name: name == MANIFEST):
            store.put(part / name, f"{folder}/{name}")
    return folder


def _read_plan(store: Store) -> bytes | None:
    """Reads the plan, with retries, because shared file systems may show a new file with a delay."""
    for _ in range(4):
        text = store.read(PLAN)
        if text is not None:
            return text
        time.sleep(0.5)
    return None


def _check_build(plan: Plan, traffic: Sequence[Path], folder: Path, worker: _Worker) -> None:
    if first_run_crc32(plan, traffic, folder) != plan.first_crc32:
        raise WorkerError(
            f"worker {worker.name} gets another result for the first run than the client: its standoff "
            f"{standoff.__version__} is another build; install the same build on all of them"
        )


class _Worker:
    """The Dask worker that runs this code, and its task."""

    def __init__(self) -> None:
        self.name, self.folder = "of this process", None
        self._is_active: Callable[[], bool] = lambda: True
        try:
            from distributed import get_worker

            worker = get_worker()
        except ValueError:
            return
        self.name, self.folder = worker.address, worker.local_directory
        task = worker.get_current_task()

        def is_active() -> bool:
            state = worker.state.tasks.get(task)
            return state is not None and state.state != "cancelled"

        self._is_active = is_active

    def stop_if_cancelled(self, done: int, of: int) -> None:
        """Stops a cancelled shard; Dask itself does not stop a running task."""
        if not self._is_active():
            raise WorkerError(f"worker {self.name}: the shard was cancelled after {done} of {of} runs")
