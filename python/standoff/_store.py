"""Where a batch is kept that many machines fly: a folder of any file system that fsspec opens."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import fsspec  # type: ignore[import-untyped]

from standoff.errors import StandoffError


@dataclass(frozen=True)
class Store:
    """A folder, by its URL; ``options`` is what fsspec needs to open it."""

    url: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(url: str | os.PathLike[str], options: Mapping[str, Any] | None) -> Store:
        """The store as every machine finds it: a folder's path does not depend on where anybody is."""
        text = os.fspath(url)
        if "://" not in text and "::" not in text:
            text = os.path.abspath(text)
        return Store(text, dict(options or {}))

    @cached_property
    def _opened(self) -> tuple[Any, str]:
        file_system, root = fsspec.core.url_to_fs(self.url, **self.options)
        return file_system, root.rstrip("/")

    def _looked_at_anew(self) -> tuple[Any, str]:
        """What is remembered of a store would hide what other machines have put there since."""
        file_system, root = self._opened
        file_system.invalidate_cache()
        return file_system, root

    @cached_property
    def folder(self) -> Path | None:
        """The folder, if it is one of this machine's file system."""
        with self._told("open"):
            file_system, root = self._opened
            return Path(root) if isinstance(file_system, fsspec.get_filesystem_class("file")) else None

    def names(self, under: str = "") -> list[str]:
        """Names of all files, or of those in a folder of it; with the folders they are in."""
        with self._told("list"):
            file_system, root = self._looked_at_anew()
            top = _within(root, under)
            if not file_system.exists(top):
                return []
            return sorted(str(path)[len(root) + 1 :] for path in file_system.find(top))

    def read(self, name: str) -> bytes | None:
        """What a file holds; None if it is not there."""
        with self._told(f"read {name}"):
            file_system, root = self._looked_at_anew()
            try:
                return bytes(file_system.cat_file(_within(root, name)))
            except FileNotFoundError:
                return None

    def write(self, name: str, data: bytes) -> None:
        """Puts a file there, whole or not at all."""
        with self._told(f"write {name}"):
            file_system, root = self._opened
            if self.folder is not None:
                with _replacing(self.folder / name) as partial:
                    partial.write_bytes(data)
            else:
                file_system.pipe_file(_within(root, name), data)

    def put(self, file: Path, name: str) -> None:
        """Puts a file of this machine there, whole or not at all."""
        with self._told(f"write {name}"):
            file_system, root = self._opened
            if self.folder is not None:
                with _replacing(self.folder / name) as partial:
                    shutil.copyfile(file, partial)
            else:
                file_system.put_file(str(file), _within(root, name))

    def get(self, names: Sequence[str], files: Sequence[Path]) -> None:
        """Fetches files, many at a time."""
        with self._told("read"):
            file_system, root = self._opened
            for file in files:
                file.parent.mkdir(parents=True, exist_ok=True)
            if names:
                file_system.get([_within(root, name) for name in names], [str(file) for file in files])

    def remove(self, name: str) -> None:
        """Removes a file, or a folder with all in it; if it is there."""
        with self._told(f"remove {name}"):
            file_system, root = self._opened
            try:
                file_system.rm(_within(root, name), recursive=True)
            except FileNotFoundError:
                pass

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        """Stores fail in as many ways as there are: all are told as what was tried, and where."""
        try:
            yield
        except StandoffError:
            raise
        except Exception as error:
            raise StandoffError(f"{self.url}: cannot {what}: {type(error).__name__}: {error}") from error


def _within(root: str, name: str) -> str:
    return f"{root}/{name}" if name else root


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A file beside its place, which takes that place when it is on the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # Of two that write the same, each has its own.
    partial = path.with_name(f"{path.name}.{os.urandom(4).hex()}.partial")
    try:
        yield partial
        with open(partial, "rb+") as written:
            os.fsync(written.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
