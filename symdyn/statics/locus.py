"""Root locus: the eigenvalues of the linear equations over a parameter, each followed from value to value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import name_of, shown
from symdyn.statics.campbell import follow
from symdyn.statics.modes import Modes, dominant
from symdyn.statics.selection import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import PathName
    from symdyn.runtime.module import Module
    from symdyn.statics.linearize import Linearization


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Eigenvalues over a parameter; prints as a table.

    parameter     name; unit; values (n,)
    eigenvalues   (n, n_modes) complex, 1/s, of a pair the one with positive imaginary part; NaN where a mode is not there: a pair
                  of eigenvalues has become real, or two real ones a pair
    names         of the modes, by the coordinates with most kinetic energy over all values
    linear        the linear equations at every value

    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> locus = module.root_locus("l", [1.0, 4.0], at={"q1": 0.0})
    >>> locus.parameter, locus.values
    ('l', array([1., 4.]))
    >>> locus
    pendulum: eigenvalues over l, 1/s
               l [m]                      q1
                   1           0 +- 3.13209i
                   4           0 +- 1.56605i
    """

    title: str
    parameter: str
    unit: str
    values: np.ndarray
    eigenvalues: np.ndarray
    names: tuple[str, ...]
    linear: tuple[Linearization, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        """Eigenvalues of a mode by its name, (n,). Raises ArgumentError for an unknown one."""
        if name not in self.names:
            raise ArgumentError(f"{self.title}: there is no mode {shown(name)}; there are {', '.join(self.names)}")
        return np.asarray(self.eigenvalues[:, self.names.index(name)])

    @property
    def growth(self) -> np.ndarray:
        """The largest real part at every value, (n,), 1/s: positive where a disturbance grows.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> np.round(module.root_locus("l", [1.0, 4.0], at={"q1": np.pi}).growth, 6)
        array([3.132092, 1.566046])
        """
        return np.array([np.nanmax(row.real, initial=-np.inf) for row in self.eigenvalues])

    def plot(self, path: PathName | None = None, damping: bool = True) -> Figure:
        """The eigenvalues in the complex plane, coloured by the parameter, as a figure; saved to a path.

        damping   with rays of equal damping ratio. Needs matplotlib.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> figure = module.root_locus("l", [1.0, 4.0], at={"q1": 0.0}).plot()
        >>> len(figure.axes)
        2
        """
        from symdyn.pictures.locus import plot

        return plot(self, path, damping)

    def __repr__(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        width = [max(22, len(n)) for n in self.names]
        lines = [f"{self.title}: eigenvalues over {self.parameter}, 1/s",
                 f"{self.parameter + unit:>16}  " + "  ".join(f"{n:>{w}}" for n, w in zip(self.names, width, strict=True))]
        for value, row in zip(self.values, self.eigenvalues, strict=True):
            numbers = ["" if np.isnan(v) else f"{v.real:.6g}" if v.imag == 0 else f"{v.real:.6g} +- {v.imag:.6g}i" for v in row]
            lines.append(f"{value:>16.6g}  " + "  ".join(f"{n:>{w}}" for n, w in zip(numbers, width, strict=True)))
        return "\n".join(lines)


def root_locus(module: Module, parameter: Any, values: Any, at: Any = None, params: Any = None, **options: Any) -> RootLocus:
    """See Module.root_locus."""
    owner, metadata = module.name, module.metadata
    (name,) = _one(parameter, metadata.parameters, owner)
    numbers = np.array(real_of(values, owner, f"values must be numbers of {name}"), ndmin=1)
    if numbers.ndim != 1 or not len(numbers) or not np.isfinite(numbers).all():
        raise ArgumentError(f"{owner}: values must be numbers of {name}, found {shown(values)}")
    others = _named(params, metadata.parameters, owner)
    if name in others:
        raise ArgumentError(f"{owner}: {name} is in params, too; leave it out there")
    if at is not None and options.get("start") is not None:
        raise ArgumentError(f"{owner}: both at and start are given; at is a state that stays, start a guess of a state of rest")
    linear: list[Linearization] = []
    start = options.pop("start", None)
    for value in numbers:
        both = {**others, name: float(value)}
        if at is not None:
            linear.append(module.linearize(at, both, **options))
            continue
        result = module.equilibrium(start=start, params=both, **options)
        linear.append(module.linearize(result))
        start = result.x
    sets: list[Modes] = [each.modes() for each in linear]
    tracks = follow(sets, [each.inertia for each in linear], numbers)
    eigenvalues = np.full((len(numbers), len(tracks)), complex(np.nan, np.nan))
    names = []
    for j, track in enumerate(tracks):
        for k, mode in track.items():
            eigenvalues[k, j] = mode.eigenvalue
        shares = np.sum([mode.shares for mode in track.values()], axis=0)
        first = next(iter(track.values()))
        names.append(dominant(shares, first.coordinates) if shares.any() else first.name)
    marked = tuple(n if names.count(n) == 1 else f"{n} ({names[:k + 1].count(n)})" for k, n in enumerate(names))
    return RootLocus(owner, name, metadata.units.get(name, ""), numbers, eigenvalues, marked, tuple(linear))


def _one(parameter: Any, known: Any, owner: str) -> list[str]:
    named = listed(parameter, known, "parameter", owner)
    if len(named) != 1:
        raise ArgumentError(f"{owner}: parameter must be one name or symbol, found {shown(parameter)}")
    return list(named)


def _named(params: Any, known: Any, owner: str) -> dict[str, Any]:
    """Other parameters by name."""
    if params is None:
        return {}
    if isinstance(params, Mapping):
        return {name_of(key): value for key, value in params.items()}
    return dict(zip(known, np.asarray(real_of(params, owner, "params must be numbers")).ravel().tolist(), strict=False))
