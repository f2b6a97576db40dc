"""Results of an ensemble on the disk as they come, and how a run that was stopped goes on.

    manifest.json     what was asked; a run goes on only if it is the same
    chunks/K.npz      outcomes of a chunk, each file whole or not there
    ensemble.npz      all of it in order, at the end; then the chunks go
    failures.jsonl    a line for each member that failed
    claims/, workers/ what workers do that share the folder, and what they have done, until the end
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, TypedDict

import numpy as np

from symdyn.ensembles.archive import Entry, reading, write_archive
from symdyn.ensembles.chunk import Done
from symdyn.errors import ArgumentError
from symdyn.runtime.building.stored import write_whole

RESULT, FAILURES, MANIFEST = "ensemble.npz", "failures.jsonl", "manifest.json"
CHUNKS, CLAIMS, WORKERS = "chunks", "claims", "workers"


class Store:
    """The folder of one ensemble.

    columns   label -> shape of the outcome of one member
    size      samples in a chunk
    """

    def __init__(self, folder: Path, count: int, size: int, columns: Mapping[str, tuple[int, ...]]) -> None:
        self.folder, self.count, self.size, self.columns = folder, count, size, dict(columns)
        self.chunks = folder / CHUNKS
        self.n_chunks = -(-count // size)

    def begin(self, shared: bool = False) -> set[int]:
        """Make the folder; which chunks are there already. Where it is shared, what others are writing stays, and chunks are
        checked when they are put together."""
        self.chunks.mkdir(parents=True, exist_ok=True)
        if shared:
            return self.there()
        for left in self.chunks.glob(".*.tmp"):
            left.unlink(missing_ok=True)
        return {k for k in self.there() if self._is_whole(k)}

    def there(self) -> set[int]:
        """Chunks with files, by their names alone; all of them once they were put together, and may be gone."""
        result: set[int] = set()
        with contextlib.suppress(FileNotFoundError):
            result = {int(stem) for entry in os.scandir(self.chunks)
                      if (stem := entry.name.removesuffix(".npz")).isdigit() and entry.name != stem}
        return set(range(self.n_chunks)) if self.complete() else {k for k in result if k < self.n_chunks}

    def drop_damaged(self) -> bool:
        """Remove chunks that the disk has damaged; whether there were any."""
        damaged = [k for k in self.there() if not self._is_whole(k)]
        for k in damaged:
            self._path(k).unlink(missing_ok=True)
        return bool(damaged)

    def complete(self) -> bool:
        """Whether the chunks were put together."""
        return (self.folder / RESULT).is_file()

    def clear(self) -> None:
        """Remove what is of no use once the result is there."""
        for name in (CHUNKS, CLAIMS, WORKERS):
            shutil.rmtree(self.folder / name, ignore_errors=True)

    def put(self, done: Done) -> None:
        """Keep a chunk. Raises OSError as the disk does."""
        failures = np.frombuffer(json.dumps(done.failures).encode(), dtype=np.uint8)
        columns = [Entry.of(label, column) for label, column in done.columns.items()]
        write_archive(self._path(done.index), [*columns, Entry.of("(failures)", failures)])

    def samples_in(self, chunk: int) -> int:
        return min(self.size, self.count - chunk * self.size)

    def finish(self, about: Mapping[str, Any], times: np.ndarray, block: Callable[[int, int], np.ndarray]) -> None:
        """Put the chunks together, a chunk at a time, whatever their number.

        block   samples first to stop - 1
        """
        names = about["names"]

        def column(label: str) -> Iterator[np.ndarray]:
            for k in range(self.n_chunks):
                with reading(self._path(k)) as archive:
                    yield archive[label]

        def samples() -> Iterator[np.ndarray]:
            for first in range(0, self.count, self.size):
                yield block(first, min(first + self.size, self.count))

        def failed() -> Iterator[np.ndarray]:
            for k in range(self.n_chunks):
                mask = np.zeros(self.samples_in(k), dtype=bool)
                mask[[index for index, _ in self._failures(k)]] = True
                yield mask

        n_failed = 0

        def tell(file: IO[bytes]) -> None:
            nonlocal n_failed
            for k in range(self.n_chunks):
                failures = self._failures(k)
                n_failed += len(failures)
                values = block(k * self.size, k * self.size + self.samples_in(k)) if failures else np.zeros((0, 0))
                for index, message in failures:
                    given = {n: v if np.isfinite(v) else str(v) for n, v in zip(names, values[index].tolist(), strict=True)}
                    line = {"index": k * self.size + index, "values": given, "message": message}
                    file.write(json.dumps(line).encode() + b"\n")

        write_whole(self.folder / FAILURES, tell)
        about = {**about, "n_failed": n_failed}
        write_archive(self.folder / RESULT, [
            Entry("samples", (self.count, len(names)), np.dtype(float), samples()),
            *(Entry(label, (self.count, *shape), np.dtype(float), column(label)) for label, shape in self.columns.items()),
            Entry("failed", (self.count,), np.dtype(bool), failed()), Entry.of("t", times),
            Entry.of("about", json.dumps(about, sort_keys=True))])

    def _failures(self, chunk: int) -> list[tuple[int, str]]:
        with reading(self._path(chunk)) as archive:
            return [(int(k), str(m)) for k, m in json.loads(archive["(failures)"].tobytes())]

    def _path(self, chunk: int) -> Path:
        return self.chunks / f"{chunk:08d}.npz"

    def _is_whole(self, chunk: int) -> bool:
        """A file that the disk has damaged is computed again."""
        path = self._path(chunk)
        if not path.is_file():
            return False
        try:
            with zipfile.ZipFile(path) as archive:
                return archive.testzip() is None
        except (OSError, zipfile.BadZipFile):
            return False


def check_folder(folder: Path, resume: bool) -> dict[str, Any] | None:
    """The manifest in a folder; None if no run began there. Raises ArgumentError unless that is as it was requested."""
    path = folder / MANIFEST
    if not path.is_file():
        if folder.is_dir() and any(not p.name.startswith(".") for p in folder.iterdir()):  # what a kill left is hidden
            raise ArgumentError(f"{folder} is not empty, and holds no ensemble; name another folder")
        return None
    if not resume:
        raise ArgumentError(f"{folder} holds an ensemble already; pass resume=True (--resume) to go on with it, or name another "
                            "folder")
    try:
        result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{path} cannot be read: {error}; name another folder") from None
    return result


def check_same(folder: Path, result: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Raises ArgumentError with all that an ensemble in a folder has otherwise than it is asked for."""
    plain = json.loads(json.dumps(asked))
    differ = [f"{key}: {_short(result.get(key))} there, {_short(plain.get(key))} now" for key in sorted({*result, *plain})
              if result.get(key) != plain.get(key)]
    if differ:
        raise ArgumentError(f"{folder} holds another ensemble; name another folder, or ask for the same:\n  "
                            + "\n  ".join(differ))


def write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    """Write what was asked."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(manifest, indent=1, sort_keys=True)
    write_whole(folder / MANIFEST, lambda file: file.write(text.encode()))


class Failure(TypedDict):
    """A member that failed: its number, its values by name, the message."""

    index: int
    values: dict[str, float]
    message: str


def read_failures(folder: Path, most: int | None = None) -> list[Failure]:
    """Members that failed: index, values, message."""
    result: list[Failure] = []
    with (folder / FAILURES).open(encoding="utf-8") as file:
        for line in file:
            if most is not None and len(result) >= most:
                break
            result.append(json.loads(line))
    return result


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 120 else text[:100] + " ..."
