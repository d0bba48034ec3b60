"""One shard of a batch, flown by a Dask worker into the store."""

from __future__ import annotations

import json
import tempfile
import threading
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import standoff
from standoff._standoff import _fly_described
from standoff.errors import StandoffError
from standoff._store import Store

PARTS = "parts"
"""Folder of the store in which shards lie until they are merged."""
PLAN = f"{PARTS}/batch.json"
TRAFFIC = f"{PARTS}/traffic"
RUNS = "runs.parquet"
MANIFEST = "monte-carlo.json"
"""What a shard was flown from, with the checksum of its runs: put there last, so what has none is no shard."""


class WorkerError(StandoffError):
    """A worker that cannot take part: it has another standoff, or does not reach the store."""


@dataclass(frozen=True)
class Plan:
    """What is flown, in how many shards; kept in the store, for all that take part and for whoever goes on."""

    described: str
    shards: int
    has_traffic: bool
    """The traffic file is in the store, too."""
    first_crc32: int
    """Checksum of the batch's first run as the client flies it: every build that takes part must fly the same."""

    def to_json(self) -> bytes:
        return json.dumps(self.__dict__, indent=2).encode() + b"\n"

    @staticmethod
    def of_json(text: bytes) -> Plan:
        """What :meth:`to_json` told; a ValueError or TypeError if it is none."""
        plan = Plan(**json.loads(text))
        kinds = [type(value) for value in plan.__dict__.values()]
        if kinds != [str, int, bool, int] or plan.shards < 1:
            raise ValueError("not a plan")
        return plan

    def first_run(self) -> str:
        """The shard that is the first run alone."""
        return f"0/{json.loads(self.described)['runs']}"


def folder_of(shard: int, shards: int) -> str:
    return f"{PARTS}/{shard}-of-{shards}"


def first_run_crc32(plan: Plan, traffic: Path | None, folder: Path) -> int:
    _fly_described(plan.described, traffic, plan.first_run(), 1, folder, None)
    return zlib.crc32((folder / RUNS).read_bytes())


@dataclass(frozen=True)
class Order:
    """What a worker is asked for: plain values, that whatever version it has can read."""

    version: str
    url: str
    options: dict[str, Any]
    plan_crc32: int
    shard: int
    shards: int
    threads: int


_checked: set[int] = set()
"""Plans whose first run this process has flown as the client did."""
_checking = threading.Lock()


def fly_shard(order: dict[str, Any]) -> str:
    """Flies a shard and puts it into the store. Gives the shard's folder there."""
    worker = _Worker()
    if order["version"] != standoff.__version__:
        raise WorkerError(
            f"worker {worker.name} has standoff {standoff.__version__}, the client {order['version']}: "
            "install the same version on all of them"
        )
    asked = Order(**order)
    store = Store(asked.url, asked.options)
    text = _read_plan(store)
    if text is None or zlib.crc32(text) != asked.plan_crc32:
        raise WorkerError(
            f"worker {worker.name} does not find this batch's {PLAN} in {store.url}: "
            "out must be a store that every worker reaches by that name"
        )
    plan = Plan.of_json(text)
    with tempfile.TemporaryDirectory(prefix="standoff-", dir=worker.folder, ignore_cleanup_errors=True) as temporary:
        home = Path(temporary)
        traffic = None
        if plan.has_traffic:
            traffic = home / "traffic"
            store.get([TRAFFIC], [traffic])
        with _checking:
            if asked.plan_crc32 not in _checked:
                _check_build(plan, traffic, home / "first", worker)
                _checked.add(asked.plan_crc32)
        part = home / "part"
        shard = f"{asked.shard}/{asked.shards}"
        _fly_described(plan.described, traffic, shard, asked.threads, part, worker.go_on)
        folder = folder_of(asked.shard, asked.shards)
        files = sorted(file.name for file in part.iterdir())
        for name in sorted(files, key=lambda name: name == MANIFEST):
            store.put(part / name, f"{folder}/{name}")
    return folder


def _read_plan(store: Store) -> bytes | None:
    """The plan. File systems that machines share may show a new file a little later."""
    for _ in range(4):
        text = store.read(PLAN)
        if text is not None:
            return text
        time.sleep(0.5)
    return None


def _check_build(plan: Plan, traffic: Path | None, folder: Path, worker: _Worker) -> None:
    if first_run_crc32(plan, traffic, folder) != plan.first_crc32:
        raise WorkerError(
            f"worker {worker.name} flies the first run otherwise than the client: its standoff "
            f"{standoff.__version__} is another build; install the same on all of them"
        )


class _Worker:
    """The Dask worker that this is, and its task."""

    def __init__(self) -> None:
        self.name, self.folder = "of this process", None
        self._is_wanted: Callable[[], bool] = lambda: True
        try:
            from distributed import get_worker

            worker = get_worker()
        except ValueError:
            return
        self.name, self.folder = worker.address, worker.local_directory
        task = worker.get_current_task()

        def is_wanted() -> bool:
            state = worker.state.tasks.get(task)
            return state is not None and state.state != "cancelled"

        self._is_wanted = is_wanted

    def go_on(self, done: int, of: int) -> None:
        """Stops a flight that nobody waits for any more: Dask itself lets a task that is under way come to its end."""
        if not self._is_wanted():
            raise WorkerError(f"worker {self.name}: the shard was cancelled after {done} of {of} runs")
