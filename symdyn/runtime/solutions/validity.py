"""What loads want to be looked at: whether the values of a motion or of an equilibrium leave what the loads are meant for."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import SimulationWarning

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

WATCHES = "watches"


@dataclass(frozen=True)
class Watched:
    """A value that was looked at: least and most that are meant, low and high found; message: what it means outside."""

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
        """What it means, with the worst number; "" inside."""
        worst = self.low if self.low < self.least else self.high
        return self.meaning.replace("{value}", f"{worst:.4g}") if self.outside else ""


def watched(module: Module, values: Any, t: np.ndarray | None = None) -> list[Watched]:
    """Of the function `watches` at one state or at rows of states; t: their times, (n_t,), without which sums are left out."""
    about = module.metadata.watches
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
        result.append(Watched(one.label, one.least, one.most, float(column.min()), float(column.max()), one.message))
    return result


def warn(module: Module, values: Any, when: str, level: int, t: np.ndarray | None = None) -> None:
    """Give a SimulationWarning for every value that is not as it is meant; t: see `watched`."""
    for value in watched(module, values, t):
        if value.outside:
            warnings.warn(f"{module.name}: {when}: {value.message}", SimulationWarning, stacklevel=level + 1)
