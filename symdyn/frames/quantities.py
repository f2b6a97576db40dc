"""Masses, inertias and vectors of a rigid body taken over, numbers or expressions, with all faults reported at once."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, ModelWarning
from symdyn.frames.checks import FrameFaults
from symdyn.model.joints.base import numeric
from symdyn.model.symbols import symbols_of

# Part of the largest entry of an inertia that counts as rounding.
ROUNDING = 1e-9


class Quantities:
    """Takes the arguments of one function over, and knows whether all of them are plain numbers."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.faults = FrameFaults(where)
        self.plain = True

    def scalar(self, what: str, value: Any, least: float | None = None, unit: str = "") -> sp.Expr:
        """A scalar; a number not below `least`."""
        self._note(value)
        result = self.faults.expression(value, f"{self.where}: {what}")
        if least is not None and result.is_number and result < least:
            self.faults.append(f"{self.where}: {what} is {result} {unit}; pass {least} or more")
        return result

    def mass(self, value: Any) -> sp.Expr:
        """A mass, kg."""
        return self.scalar("mass", value, least=0, unit="kg")

    def vector(self, what: str, value: Any, size: int = 3) -> sp.Matrix:
        """A column of components."""
        self._note(value)
        entries = self.faults.expressions(value, f"{self.where}: {what}")
        if len(entries) != size:
            self.faults.append(f"{self.where}: {what} has {len(entries)} components; pass {size}")
            return sp.zeros(size, 1)
        return sp.Matrix(entries)

    def inertia(self, what: str, value: Any) -> sp.Matrix:
        """A symmetric 3 x 3 matrix, or its diagonal; in numbers that of a possible body."""
        self._note(value)
        before = len(self.faults)
        result = sp.Matrix(self.faults.matrix(value, f"{self.where}: {what}"))
        if len(self.faults) == before:
            self.check_inertia(what, result)
        return result

    def rotation(self, value: Any) -> sp.Matrix:
        """A rotation matrix."""
        self._note(value)
        return sp.Matrix(self.faults.rotation(value))

    def particles(self, masses: Any, positions: Any) -> list[tuple[sp.Expr, sp.Matrix]]:
        """Pairs of mass and position."""
        m, r = _rows(masses), _rows(positions)
        if not m or r is None or len(m) != len(r):
            result = ["no list" if x is None else f"{len(x)} entries" for x in (m, r)]
            self.faults.append(f"{self.where}: masses: {result[0]}, positions: {result[1]}; pass lists of one length, a position "
                               "of three components for each mass")
            return []
        return [(self.scalar(f"mass {k + 1}", mass, least=0, unit="kg"), self.vector(f"position {k + 1}", position))
                for k, (mass, position) in enumerate(zip(m, r, strict=True))]

    def check_inertia(self, what: str, I: sp.MatrixBase) -> None:
        """Adds a fault for an inertia that is not symmetric or has a negative moment; warns where no body has its moments."""
        scale = max(abs(numeric(e)) for e in I)
        for i, j in ((1, 0), (2, 0), (2, 1)):
            difference = I[i, j] - I[j, i]
            if difference != 0 and abs(numeric(difference)) > ROUNDING * scale:
                self.faults.append(f"{self.where}: {what} is not symmetric: I[{j + 1}, {i + 1}] = {I[j, i]}, "
                                   f"I[{i + 1}, {j + 1}] = {I[i, j]}; pass a symmetric matrix")
                return
        if any(symbols_of(e) for e in I):
            return
        moments = np.linalg.eigvalsh(np.array(I.tolist(), dtype=float))
        result = f"{self.where}: {what} has the principal moments {', '.join(f'{m:.6g}' for m in moments)} kg m^2"
        if moments[0] < -ROUNDING * scale:
            self.faults.append(f"{result}, one is negative; no body has them")
        elif moments[0] + moments[1] < moments[2] * (1 - ROUNDING):
            warnings.warn(f"{result}, the largest is more than the other two together; no body in space has them",
                          ModelWarning, stacklevel=4)

    def demand_none(self) -> None:
        """Raise ArgumentError with all faults, or NotARotation if that alone is wrong."""
        if self.faults:
            raise ArgumentError("; ".join([*self.faults, *self.faults.tilts]))
        self.faults.demand_none()

    def given_back(self, result: Any) -> Any:
        """NumPy for plain numbers, SymPy otherwise."""
        if not self.plain:
            return result
        if not isinstance(result, sp.MatrixBase):
            return float(result)
        array = np.array(result.tolist(), dtype=float)
        return array.ravel() if result.cols == 1 else array

    def _note(self, value: Any) -> None:
        self.plain = self.plain and not _has_sympy(value)


def _has_sympy(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype == object and _has_sympy(value.ravel().tolist())
    if isinstance(value, (list, tuple)):
        return any(map(_has_sympy, value))
    return isinstance(value, (sp.Basic, sp.MatrixBase))


def _rows(value: Any) -> list[Any] | None:
    if isinstance(value, sp.MatrixBase):
        rows: list[Any] = value.tolist()
        return [row[0] for row in rows] if value.cols == 1 else rows
    value = value.tolist() if hasattr(value, "tolist") else value
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else None
