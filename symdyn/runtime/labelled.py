"""Arrays whose entries have names: numbers of named inputs, matrices with named rows and columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError


class Labelled(np.ndarray):
    """An array that is also indexed by name or symbol and prints as a table.

    names   for each axis the names of its entries; units: of the entries of a vector, or of the axes of a matrix, by name

    Results of arithmetic and of slices are plain arrays.
    """

    names: tuple[tuple[str, ...], ...]
    units: Mapping[str, str]

    def __new__(cls, values: Any, *names: Sequence[str], units: Mapping[str, str] | None = None) -> Labelled:
        array = np.array(values, dtype=float)
        expected = tuple(len(n) for n in names)
        if array.shape != expected:
            raise ArgumentError(f"an array of the shape {array.shape} cannot have names of {expected} entries")
        result = array.view(cls)
        result.names, result.units = tuple(tuple(n) for n in names), dict(units or {})
        return result

    def __array_finalize__(self, origin: Any) -> None:
        self.names, self.units = (), {}

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        plain = np.asarray(array)
        return plain[()] if return_scalar else plain

    def __getitem__(self, key: Any) -> Any:
        keys = key if isinstance(key, tuple) else (key,)
        return np.asarray(self)[tuple(self._index(axis, k) for axis, k in enumerate(keys))]

    def _index(self, axis: int, key: Any) -> Any:
        name = key if isinstance(key, str) else getattr(key, "name", None)
        if not isinstance(name, str):
            return key
        known = self.names[axis] if axis < len(self.names) else ()
        if name not in known:
            raise ArgumentError(f"there is no {name!r}; there are {', '.join(known) or 'none'}")
        return known.index(name)

    def to_dict(self) -> dict[str, float | list[float]]:
        """Entries of a vector, or rows of a matrix, by name."""
        return dict(zip(self.names[0] if self.names else (), np.asarray(self).tolist(), strict=True))

    def __reduce__(self) -> Any:
        return _rebuilt, (np.asarray(self), self.names, self.units)

    def __repr__(self) -> str:
        values = np.asarray(self)
        if not self.names:
            return repr(values)
        first = [f"{n} [{self.units[n]}]" if self.units.get(n) else n for n in self.names[0]]
        width = max(map(len, first), default=0)
        if values.ndim == 1:
            return "\n".join(f"{label:<{width}}  {value:>14.8g}" for label, value in zip(first, values + 0.0, strict=True))
        second = [f"{n} [{self.units[n]}]" if self.units.get(n) else n for n in self.names[1]]
        widths = [max(11, len(label)) for label in second]
        lines = [" " * width + "".join(f"  {label:>{w}}" for label, w in zip(second, widths, strict=True))]
        lines += [f"{label:<{width}}" + "".join(f"  {value:>{w}.5g}" for value, w in zip(row, widths, strict=True))
                  for label, row in zip(first, values + 0.0, strict=True)]
        return "\n".join(lines)

    __str__ = __repr__


def _rebuilt(values: np.ndarray, names: tuple[tuple[str, ...], ...], units: Mapping[str, str]) -> Labelled:
    return Labelled(values, *names, units=units)
