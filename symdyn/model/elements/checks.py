"""Checks that several load elements share."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.faults import Faults
from symdyn.model.symbols import symbols_of

# An eigenvalue below this part of the largest one is a rounding error of published numbers.
ROUNDING = 1e-6


def six(faults: Faults, value: Any, what: str) -> tuple[sp.Expr, ...]:
    """Six expressions, along x, y, z and about them."""
    taken = faults.expressions(value, what)
    if len(taken) != 6:
        faults.append(f"{what} has {len(taken)} components; pass 6: three along x, y, z, three about them")
        return (sp.S.Zero,) * 6
    return taken


def positive(faults: Faults, value: Any, what: str, unit: str = "") -> sp.Expr:
    """An expression; a number must be above zero."""
    taken = faults.expression(value, what)
    if not symbols_of(taken) and not taken > 0 and not any(fault.startswith(what) for fault in faults):
        faults.append(f"{what} is {float(taken):g}; pass a number above 0 {unit}".rstrip())
    return taken


def not_negative(faults: Faults, value: Any, what: str, unit: str = "") -> sp.Expr:
    """An expression; a number must not be below zero."""
    taken = faults.expression(value, what)
    if not symbols_of(taken) and taken < 0:
        faults.append(f"{what} is {float(taken):g}; pass a number that is not below 0 {unit}".rstrip())
    return taken


def least_eigenvalue(matrix: sp.MatrixBase) -> float:
    """Least eigenvalue of a symmetric matrix of numbers; zero where it is negative by rounding alone, and for one with
    symbols."""
    if symbols_of(matrix):
        return 0.0
    values = np.array(matrix.tolist(), dtype=float)
    size = np.sqrt(np.abs(np.diag(values)))
    size[size == 0] = 1.0  # entries of translation and rotation have other units: they are judged relative to the diagonal
    scaled = np.linalg.eigvalsh(values / np.outer(size, size))
    return float(np.linalg.eigvalsh(values)[0]) if scaled[0] < -ROUNDING * np.abs(scaled).max() else 0.0
