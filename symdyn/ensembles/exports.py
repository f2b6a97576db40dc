"""Results of an ensemble in the formats that other programs read, written some rows at a time: memory does not grow with them.

    ensemble.parquet    a table with a row for each member: what was sampled, outcomes, whether it failed
    ensemble.zarr       a folder of arrays, each in pieces, as xarray reads them
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import uuid
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.ensembles.archive import pieces
from symdyn.errors import ArgumentError, MissingExtra
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.ensembles.result import Ensemble

# Bytes of a group of rows of a table, and of a piece of an array.
GROUP = 2**24


@dataclass(frozen=True)
class Export:
    """A format: its file in the folder of an ensemble, the package and the extra that write it, and the function."""

    file: str
    package: str
    extra: str
    write: Callable[[Ensemble, Path], None]


def demand_formats(formats: Any, owner: str) -> tuple[str, ...]:
    """Names of formats. Raises ArgumentError for others, MissingExtra where a package is missing: before motions are computed."""
    names = [formats] if isinstance(formats, str) else list(formats) if isinstance(formats, (list, tuple)) else [formats]
    unknown = [shown(name) for name in names if not isinstance(name, str) or name not in EXPORTS]
    if unknown:
        raise ArgumentError(f"{owner}: formats: there is no {', '.join(unknown)}; there are {', '.join(EXPORTS)}, and "
                            "ensemble.npz is written always")
    for name in names:
        _package(EXPORTS[name])
    return tuple(dict.fromkeys(names))


def write_parquet(ensemble: Ensemble, path: Path) -> None:
    """Write a table. Outcomes that are arrays are lists of one length; their shapes, the output times and units stand in the
    metadata. Raises MissingExtra without pyarrow, ArgumentError where a column would have two meanings."""
    _package(EXPORTS["parquet"])
    import pyarrow as pa
    import pyarrow.parquet as pq

    names = [*ensemble.names, *ensemble.labels, "failed"]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ArgumentError(f"{ensemble.path}: {', '.join(twice)}: sampled, and the label of an outcome too, but a table has one "
                            "column of a name; give the outcome another label")
    fields = [*(pa.field(name, pa.float64()) for name in ensemble.names),
              *(pa.field(label, _type(pa, ensemble.shapes[label])) for label in ensemble.labels), pa.field("failed", pa.bool_())]
    about = {"system": ensemble.name, "shapes": ensemble.shapes, "t": ensemble.t.tolist(), "units": ensemble.units}
    schema = pa.schema(fields, metadata={"symdyn": json.dumps(about)})
    rows = _rows(ensemble)

    def fill(scratch: Path) -> None:
        with pq.ParquetWriter(scratch, schema) as writer:
            for samples, outcomes, failed in _groups(ensemble, rows):
                columns = [*(pa.array(samples[:, k]) for k in range(samples.shape[1])), *map(_column(pa), outcomes),
                           pa.array(failed)]
                writer.write_table(pa.Table.from_arrays(columns, schema=schema), row_group_size=rows)

    _whole(path, fill)


def write_zarr(ensemble: Ensemble, path: Path) -> None:
    """Write a folder of arrays, with the names of their axes. Raises MissingExtra without zarr."""
    _package(EXPORTS["zarr"])
    import zarr

    rows = _rows(ensemble)
    shapes: dict[str, tuple[int, ...]] = {"samples": (len(ensemble.names),), **ensemble.shapes, "failed": ()}

    def fill(scratch: Path) -> None:
        group = zarr.open_group(scratch, mode="w")
        group.attrs.update({"system": ensemble.name, "names": list(ensemble.names), "units": ensemble.units,
                            "outcomes": list(ensemble.labels)})
        group.create_array("t", data=ensemble.t, dimension_names=["t"])
        for label, shape in shapes.items():
            array = group.create_array(label, shape=(ensemble.count, *shape), chunks=(min(rows, ensemble.count), *shape),
                                       dtype="bool" if label == "failed" else "float64",
                                       dimension_names=["member", *_axes(ensemble, label, shape)])
            for k, piece in enumerate(pieces(ensemble.file, label, rows)):
                array[k * rows:k * rows + len(piece)] = piece

    _whole(path, fill)


EXPORTS = {"parquet": Export("ensemble.parquet", "pyarrow", "parquet", write_parquet),
           "zarr": Export("ensemble.zarr", "zarr", "zarr", write_zarr)}


def missing(folder: Path, formats: Iterable[str]) -> list[str]:
    """Formats that are not written yet in the folder of an ensemble."""
    return [name for name in formats if not (folder / EXPORTS[name].file).exists()]


def _package(export: Export) -> None:
    try:
        __import__(export.package)
    except ImportError:
        raise MissingExtra(f"{export.file} needs the package {export.package}: pip install 'symdyn[{export.extra}]'") from None


def _rows(ensemble: Ensemble) -> int:
    """Rows of a group."""
    row = 8 * (len(ensemble.names) + sum(int(np.prod(shape)) for shape in ensemble.shapes.values())) + 1
    return max(1, GROUP // row)


def _groups(ensemble: Ensemble, rows: int) -> Iterator[tuple[np.ndarray, list[np.ndarray], np.ndarray]]:
    """Samples, outcomes and failures, so many rows at a time."""
    read = [pieces(ensemble.file, name, rows) for name in ("samples", *ensemble.labels, "failed")]
    for samples, *outcomes, failed in zip(*read, strict=True):
        yield samples, outcomes, failed


def _type(pa: Any, shape: tuple[int, ...]) -> Any:
    return pa.list_(pa.float64(), int(np.prod(shape))) if shape else pa.float64()


def _column(pa: Any) -> Callable[[np.ndarray], Any]:
    def column(values: np.ndarray) -> Any:
        flat = pa.array(values.reshape(-1))
        return flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, int(np.prod(values.shape[1:])))

    return column


def _axes(ensemble: Ensemble, label: str, shape: tuple[int, ...]) -> list[str]:
    if label == "samples":
        return ["name"]
    return [("t" if label in ensemble.traces and k == 0 else f"{label} {k}") for k in range(len(shape))]


def _whole(path: Path, fill: Callable[[Path], None]) -> None:
    """Write a file or folder under another name, and move it to its own when it is whole."""
    scratch = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        fill(scratch)
        if path.is_dir():
            shutil.rmtree(path)
        os.replace(scratch, path)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        with contextlib.suppress(OSError):
            scratch.unlink(missing_ok=True)
        raise
