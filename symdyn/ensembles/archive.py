"""Files of arrays whose bytes depend on the numbers alone, written in one step: whoever sees the name sees a whole file."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from symdyn.runtime.building.stored import write_whole

EPOCH = (1980, 1, 1, 0, 0, 0)
# Bytes that are read at a time.
PIECE = 2**22


class Entry(NamedTuple):
    """One array of an archive, in pieces along its first axis."""

    name: str
    shape: tuple[int, ...]
    dtype: Any
    pieces: Iterable[np.ndarray]

    @classmethod
    def of(cls, name: str, array: Any) -> Entry:
        array = np.asarray(array)
        return cls(name, array.shape, array.dtype, [array])


def write_archive(path: Path, entries: Iterable[Entry]) -> None:
    """Write an .npz file. Raises OSError as the disk does; then nothing is left of it."""
    def fill(file: IO[bytes]) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            for name, shape, dtype, pieces in entries:
                # A fixed date, system and mode: the same numbers are the same bytes.
                info = zipfile.ZipInfo(f"{name}.npy", EPOCH)
                info.create_system, info.external_attr = 3, 0o644 << 16
                with archive.open(info, "w", force_zip64=True) as member:
                    header = {"descr": np.lib.format.dtype_to_descr(np.dtype(dtype)), "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(member, header)  # type: ignore[arg-type]
                    for piece in pieces:
                        member.write(np.ascontiguousarray(piece, dtype=dtype).tobytes())

    write_whole(path, fill)


@contextlib.contextmanager
def reading(path: Path) -> Iterator[Any]:
    """The arrays of an archive, each read when it is requested."""
    with np.load(path, allow_pickle=False) as archive:
        yield archive


def pieces(path: Path, name: str, rows: int) -> Iterator[np.ndarray]:
    """An array of an archive, so many rows at a time, without holding all of it."""
    with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as member:
        np.lib.format.read_magic(member)  # type: ignore[arg-type]
        shape, _, dtype = np.lib.format.read_array_header_1_0(member)  # type: ignore[arg-type]
        row = int(np.prod(shape[1:])) * dtype.itemsize
        for first in range(0, shape[0], rows):
            n = min(rows, shape[0] - first)
            yield np.frombuffer(member.read(n * row), dtype).reshape(n, *shape[1:])


def thinned(path: Path, name: str, step: int) -> np.ndarray:
    """Every `step`-th row of an array, without holding all of it."""
    with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as member:
        np.lib.format.read_magic(member)  # type: ignore[arg-type]
        shape, _, dtype = np.lib.format.read_array_header_1_0(member)  # type: ignore[arg-type]
    row = int(np.prod(shape[1:])) * dtype.itemsize
    at_once = step * max(1, PIECE // (step * max(1, row)))
    kept = [np.zeros((0, *shape[1:]), dtype), *(piece[::step].copy() for piece in pieces(path, name, at_once))]
    return np.concatenate(kept)
