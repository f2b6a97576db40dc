"""Results of an ensemble."""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symdyn.counting import counted
from symdyn.ensembles.archive import reading
from symdyn.ensembles.store import RESULT, Failure, read_failures
from symdyn.errors import ArgumentError
from symdyn.pages import table, titled
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import Key, PathName


class Ensemble:
    """Outcomes of all members, in the order of the samples; arrays are read from the file when they are requested.

    path       the folder;  file: its ensemble.npz
    names      what was sampled, of which `varied` is not the same in all;  labels: outcomes, `traces` those over the times t;
               shapes: of one member's outcomes; sensitivities: what derivatives among them are by, in this order
    count      number of members;  n_failed: how many of them have no outcome
    n_resumed  how many had been computed before;  seconds: wall time of the others;  doubts: what was warned of in those of
               them whose derivatives are outcomes, "" without

    >>> import tempfile
    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
    >>> found.count, found.labels
    (2, ('end q1',))
    """

    def __init__(self, path: Path, n_resumed: int = 0, seconds: float = 0.0, doubts: str = "") -> None:
        self.path, self.file = path, path / RESULT
        self.n_resumed, self.seconds, self.doubts = n_resumed, seconds, doubts
        with reading(self.file) as archive:
            about = json.loads(str(archive["about"]))
            self.t: np.ndarray = archive["t"]
        self.n_failed: int = about["n_failed"]
        self.name: str = about["system"]
        self.names: tuple[str, ...] = tuple(about["names"])
        self.varied: tuple[str, ...] = tuple(about["varied"])
        self.labels: tuple[str, ...] = tuple(about["outcomes"])
        self.traces: tuple[str, ...] = tuple(about["traces"])
        self.shapes: dict[str, tuple[int, ...]] = {n: tuple(s) for n, s in about["shapes"].items()}
        self.sensitivities: tuple[str, ...] = tuple(about.get("sensitivities", ()))
        self.units: dict[str, str] = about["units"]
        self.count: int = about["count"]

    def __getitem__(self, name: Key) -> np.ndarray:
        """An outcome, or values of what was sampled, (count, ...); not a number where a member failed.

        Raises ArgumentError for an unknown name.
        """
        name = name_of(name)
        if name in self.labels:
            with reading(self.file) as archive:
                return archive[name]  # type: ignore[no-any-return]
        if name in self.names:
            return self.samples[:, self.names.index(name)]
        near = difflib.get_close_matches(name, [*self.labels, *self.names], 3)
        raise ArgumentError(f"{self.path} has no {shown(name)}; " + (f"did you mean {' or '.join(near)}?" if near else
                            f"it has {', '.join([*self.labels, *self.names])}"))

    @property
    def samples(self) -> np.ndarray:
        """The sampled values, (count, n_names).

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
        >>> found.samples
        array([[0.5],
               [1. ]])
        """
        with reading(self.file) as archive:
            return archive["samples"]  # type: ignore[no-any-return]

    @property
    def failed(self) -> np.ndarray:
        """Mask of the members that failed, (count,) of bool.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
        >>> found.failed
        array([False, False])
        """
        with reading(self.file) as archive:
            return archive["failed"]  # type: ignore[no-any-return]

    def failures(self, most: int | None = None) -> list[Failure]:
        """Members that failed, each with index, values and message; the first few, or all.

        >>> import tempfile, warnings
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> with warnings.catch_warnings():
        ...     warnings.simplefilter("ignore")
        ...     found = sd.ensemble(module, {"l": [0.0, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
        ...
        >>> [(failure["index"], failure["values"]) for failure in found.failures()]
        [(0, {'l': 0.0})]
        """
        return read_failures(self.path, most)

    def plot(self, path: PathName | None = None, scatter: Sequence[tuple[str, str]] | None = None) -> Figure:
        """Quantiles of every trace over time, and pairs of (sampled, outcome) as points; returns the matplotlib figure, and saves
        it if a path is given. Raises MissingExtra without matplotlib, ArgumentError for unknown names.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["trace q1"], path=tempfile.mkdtemp())
        >>> len(found.plot().axes)
        1
        """
        from symdyn.ensembles.picture import draw

        return draw(self, path, scatter)

    def to_parquet(self, path: PathName | None = None) -> Path:
        """Write a Parquet table with a row for each member: what was sampled, outcomes, `failed`; outcomes that are arrays are
        lists. The rows are read and written in groups, so that memory does not grow with their number. Returns the path of the
        file, by default ensemble.parquet next to ensemble.npz. Raises MissingExtra without pyarrow.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
        >>> found.to_parquet().name
        'ensemble.parquet'
        """
        from symdyn.ensembles.exports import EXPORTS, write_parquet

        path = Path(path) if path is not None else self.path / EXPORTS["parquet"].file
        write_parquet(self, path)
        return path

    def to_zarr(self, path: PathName | None = None) -> Path:
        """Write a Zarr folder of arrays, as `xarray.open_zarr(path, consolidated=False)` reads it: samples, every outcome,
        failed, over the axes member and t. Rows are read and written in pieces. Returns the path, by default ensemble.zarr next
        to ensemble.npz; a folder that is there is replaced. Raises MissingExtra without zarr.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["trace q1"], path=tempfile.mkdtemp())
        >>> found.to_zarr().name
        'ensemble.zarr'
        """
        from symdyn.ensembles.exports import EXPORTS, write_zarr

        path = Path(path) if path is not None else self.path / EXPORTS["zarr"].file
        write_zarr(self, path)
        return path

    def __repr__(self) -> str:
        failed = f", {self.n_failed} failed" if self.n_failed else ""
        return f"<Ensemble of {self.name}: {counted(self.count, 'member')}{failed}, {', '.join(self.labels)} in {self.file}>"

    def _repr_html_(self) -> str:
        """Mean, deviation and extremes of the outcomes that are numbers, as a notebook shows them."""
        good = ~self.failed
        rows = [(label, *(f"{v:.6g}" for v in (values.mean(), values.std(), values.min(), values.max())))
                for label in self.labels if not self.shapes[label] and len(values := self[label][good])]
        return titled(self, table(("outcome", "mean", "deviation", "least", "most"), rows))
