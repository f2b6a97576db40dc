"""The distributed properties of a beam, linear between the stations of their table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import PPoly

from symdyn.real_numbers import NotReal, real
from symdyn.shown import shown

_LARGEST = 1e30


@dataclass(frozen=True, eq=False)
class Table:
    """x (k,) stations, m; mass (k,), kg/m; EI (k, 2), N m^2, about the principal axes; twist (k,), rad, of these axes."""

    x: np.ndarray
    mass: np.ndarray
    EI: np.ndarray
    twist: np.ndarray

    @property
    def length(self) -> float:
        """L, m."""
        return float(self.x[-1])

    def mass_at(self, x: np.ndarray) -> np.ndarray:
        """kg/m."""
        return np.interp(x, self.x, self.mass)

    def EI_at(self, x: np.ndarray) -> np.ndarray:
        """(points, 2), N m^2."""
        return np.stack([np.interp(x, self.x, column) for column in self.EI.T], axis=-1)

    def twist_at(self, x: np.ndarray) -> np.ndarray:
        """rad."""
        return np.interp(x, self.x, self.twist)

    def outboard(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """int_x^L dm, kg, and int_x^L X dm, kg m: mass and first moment of what lies beyond x."""
        start, slope = self.x[:-1], np.diff(self.mass) / np.diff(self.x)
        mass = PPoly(np.stack([slope, self.mass[:-1]]), self.x).antiderivative()
        moment = PPoly(np.stack([slope, self.mass[:-1] + slope * start, self.mass[:-1] * start]), self.x).antiderivative()
        return mass(self.length) - mass(x), moment(self.length) - moment(x)


def numbers(value: Any, what: str, faults: list[str], size: int | None = None) -> np.ndarray | None:
    """A row of finite numbers, of the size that is requested; None, and a fault, where it is not one.

    One number stands for a row where the size is given.
    """
    try:
        if value is None:
            raise TypeError
        row = np.array(real(value))
        row = np.full(size, row) if size is not None and row.ndim == 0 else row
    except (TypeError, NotReal) as error:
        faults.append(f"{what} is {_short(value)}; pass a list of numbers" + (f": {error}" if str(error) else ""))
        return None
    if row.ndim != 1 or not row.size:
        faults.append(f"{what} has the shape {row.shape}; pass a list of numbers")
        return None
    bad = np.flatnonzero(~(np.abs(row) < _LARGEST))
    if bad.size:
        k = int(bad[0])
        faults.append(f"{what} has {row[k]:g} at place {k + 1} of {row.size}; all values must be finite, below {_LARGEST:g}")
        return None
    if size is not None and row.size != size:
        faults.append(f"{what} has {row.size} values for {size} stations; pass one value for each station")
        return None
    return row


def rising(row: np.ndarray, what: str, end: float | None, faults: list[str]) -> bool:
    """Whether stations begin at 0, rise, and end where they have to; else a fault is added."""
    before = len(faults)
    if row.size < 2:
        faults.append(f"{what} has {row.size} value; pass two stations or more")
    if row[0] != 0:
        faults.append(f"{what} begins at {row[0]:g}; it must begin at 0, the clamp")
    down = np.flatnonzero(np.diff(row) <= 0)
    if down.size:
        k = down[0]
        faults.append(f"{what} does not increase: {row[k]:g} at place {k + 1} is followed by {row[k + 1]:g}")
    elif end is not None and abs(row[-1] - end) > 1e-9 * end:
        faults.append(f"{what} ends at {row[-1]:g}; it must end at {end:g}, the tip")
    return len(faults) == before


def table(stations: Any, mass_per_length: Any, stiffness: Any, twist: Any, length: Any, faults: list[str]) -> Table | None:
    """The table of a beam; None, and faults, where its numbers cannot be those of one."""
    before = len(faults)
    scale = _scale(length, faults)
    x = numbers(stations, "stations", faults)
    if x is not None:
        rising(x, "stations", None if length is None else 1.0, faults)
    size = None if x is None else x.size
    mass = _not_negative(mass_per_length, "mass_per_length", "kg/m", faults, size)
    several = isinstance(stiffness, (tuple, list)) or getattr(stiffness, "ndim", 0) > 1
    two = several and len(stiffness) == 2 and (isinstance(stiffness[0], (tuple, list)) or getattr(stiffness[0], "ndim", 0) == 1)
    pair = tuple(stiffness) if two else (stiffness, stiffness)
    names = ("stiffness",) if pair[0] is pair[1] else ("stiffness of direction 1", "stiffness of direction 2")
    EI = [_not_negative(row, what, "N m^2", faults, size) for row, what in zip(pair, names, strict=False)]
    turn = np.zeros(size or 0) if twist is None else numbers(twist, "twist", faults, size)
    for what, row in zip(("mass_per_length", *names), (mass, *EI), strict=False):
        if row is not None and x is not None:
            _not_missing(row, x, what, faults)
    if len(faults) > before or x is None or mass is None or turn is None or any(row is None for row in EI):
        return None
    rows: Sequence[Any] = EI if len(EI) == 2 else EI * 2
    return Table(x * scale, mass, np.stack(rows, axis=-1), turn)


def _scale(length: Any, faults: list[str]) -> float:
    """The factor from stations to metres."""
    if length is None:
        return 1.0
    try:
        scale = float(length)
    except (TypeError, ValueError):
        scale = float("nan")
    if not 1 / _LARGEST < scale < _LARGEST:
        faults.append(f"length is {_short(length)}; pass a positive number, m")
        return 1.0
    return scale


def _not_negative(value: Any, what: str, unit: str, faults: list[str], size: int | None) -> np.ndarray | None:
    row = numbers(value, what, faults, size)
    if row is not None and (row < 0).any():
        k = int(np.flatnonzero(row < 0)[0])
        faults.append(f"{what} is {row[k]:g} {unit} at place {k + 1} of {row.size}; it must not be negative")
        return None
    if row is not None and row.any():
        least = row[row > 0].min()
        if least < 1 / _LARGEST:
            faults.append(f"{what} is {least:g} {unit}; use units in which it is above {1 / _LARGEST:g}, or zero")
            return None
    return row


def _not_missing(row: np.ndarray, x: np.ndarray, what: str, faults: list[str]) -> None:
    """A fault for a stretch of the beam that has no mass or no stiffness."""
    none = np.flatnonzero((row[:-1] == 0) & (row[1:] == 0))
    if none.size:
        k = int(none[0])
        faults.append(f"{what} is zero from the station {x[k]:g} to the station {x[k + 1]:g}; a beam has some everywhere")


def _short(value: Any) -> str:
    return shown(value, 60)
