"""Validity checks: whether values of a motion or of an equilibrium leave the ranges in which loads are valid."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import SimulationWarning

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

VALIDITY_CHECKS = "validity_checks"


@dataclass(frozen=True)
class ValidityCheck:
    """A value with its range of validity, least to most, and its range in the result, low to high; meaning: of values outside."""

    label: str
    least: float
    most: float
    low: float
    high: float
    meaning: str

    @property
    def outside(self) -> bool:
        return self.low < self.least or self.high > self.most

    @property
    def message(self) -> str:
        """The meaning with the worst number; "" inside."""
        worst = self.low if self.low < self.least else self.high
        return self.meaning.replace("{value}", f"{worst:.4g}") if self.outside else ""


def checked(module: Module, values: Any, t: np.ndarray | None = None) -> list[ValidityCheck]:
    """The checks of values of the function `validity_checks` at one state or at rows of states.

    t   times of the states, (n_t,), without which sums are left out
    """
    about = module.metadata.validity_checks
    rows = np.asarray(values, dtype=float).reshape(-1, len(about))
    there = np.isfinite(rows).all(axis=1)
    if not there.any():
        return []
    result = []
    for one, column in zip(about, rows[there].T, strict=True):
        if one.summed:
            if t is None:
                continue
            column = np.array([np.trapezoid(column, t[there])])
        result.append(ValidityCheck(one.label, one.least, one.most, float(column.min()), float(column.max()), one.message))
    return result


def warn(module: Module, values: Any, when: str, level: int, t: np.ndarray | None = None) -> None:
    """Give a SimulationWarning for every value outside its range of validity; t: see `checked`."""
    for value in checked(module, values, t):
        if value.outside:
            warnings.warn(f"{module.name}: {when}: {value.message}", SimulationWarning, stacklevel=level + 1)
