"""Storage shared by all machines of a batch: a folder on any file system that fsspec can open."""

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
    """A folder, given by its URL; ``options`` are fsspec's options for opening it."""

    url: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(url: str | os.PathLike[str], options: Mapping[str, Any] | None) -> Store:
        """The store for a URL or a path. Paths are made absolute, so that every machine finds the same folder."""
        text = os.fspath(url)
        if "://" not in text and "::" not in text:
            text = os.path.abspath(text)
        return Store(text, dict(options or {}))

    @cached_property
    def _opened(self) -> tuple[Any, str]:
        file_system, root = fsspec.core.url_to_fs(self.url, **self.options)
        return file_system, root.rstrip("/")

    def _refreshed(self) -> tuple[Any, str]:
        """Drops fsspec's directory cache, which would hide files that other machines have written since."""
        file_system, root = self._opened
        file_system.invalidate_cache()
        return file_system, root

    @cached_property
    def folder(self) -> Path | None:
        """The folder, if it is on a local file system, otherwise None."""
        with self._errors("open"):
            file_system, root = self._opened
            return Path(root) if isinstance(file_system, fsspec.get_filesystem_class("file")) else None

    def names(self, under: str = "") -> list[str]:
        """Paths of all files, or of those under a folder, relative to the store."""
        with self._errors("list"):
            file_system, root = self._refreshed()
            top = _within(root, under)
            if not file_system.exists(top):
                return []
            return sorted(str(path)[len(root) + 1 :] for path in file_system.find(top))

    def read(self, name: str) -> bytes | None:
        """Contents of a file; None if it does not exist."""
        with self._errors(f"read {name}"):
            file_system, root = self._refreshed()
            try:
                return bytes(file_system.cat_file(_within(root, name)))
            except FileNotFoundError:
                return None

    def write(self, name: str, data: bytes) -> None:
        """Writes a file atomically."""
        with self._errors(f"write {name}"):
            file_system, root = self._opened
            if self.folder is not None:
                with _replacing(self.folder / name) as partial:
                    partial.write_bytes(data)
            else:
                file_system.pipe_file(_within(root, name), data)

    def put(self, file: Path, name: str) -> None:
        """Copies a local file to the store atomically."""
        with self._errors(f"write {name}"):
            file_system, root = self._opened
            if self.folder is not None:
                with _replacing(self.folder / name) as partial:
                    shutil.copyfile(file, partial)
            else:
                file_system.put_file(str(file), _within(root, name))

    def get(self, names: Sequence[str], files: Sequence[Path]) -> None:
        """Fetches several files concurrently."""
        with self._errors("read"):
            file_system, root = self._opened
            for file in files:
                file.parent.mkdir(parents=True, exist_ok=True)
            if names:
                file_system.get([_within(root, name) for name in names], [str(file) for file in files])

    def remove(self, name: str) -> None:
        """Removes a file, or a folder with its contents, if it exists."""
        with self._errors(f"remove {name}"):
            file_system, root = self._opened
            try:
                file_system.rm(_within(root, name), recursive=True)
            except FileNotFoundError:
                pass

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        """Converts any exception of a file system to a StandoffError that names the operation and the store."""
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
    """A temporary file next to ``path``, which replaces ``path`` when it has been written to disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # A random name, so that two concurrent writers do not share the temporary file.
    partial = path.with_name(f"{path.name}.{os.urandom(4).hex()}.partial")
    try:
        yield partial
        with open(partial, "rb+") as written:
            os.fsync(written.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
