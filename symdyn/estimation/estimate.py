"""Values with a covariance, and combinations of unknowns as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import qr
from scipy.stats import norm
from scipy.stats import t as student

from symdyn.errors import ArgumentError
from symdyn.real_numbers import number_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Shares of unknowns in a combination, relative to the largest, that are left out: sensitivities are no more exact.
_SHARE = 1e-3


class Estimate:
    """Common part of estimates: the module, values (label -> value), covariance (n, n) in this order, degrees of freedom
    (residuals less unknowns), and known_noise, whether the noise of the data was given."""

    module: Module
    values: Mapping[str, float]
    covariance: np.ndarray
    degrees: int
    known_noise: bool

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of every value; NaN where the data do not determine it."""
        return dict(zip(self.values, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the values, (n, n)."""
        sizes = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(sizes, sizes)

    def confidence(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Interval of every value in which it lies with this probability, as far as what was measured is linear in it there.

        Raises ArgumentError for a level that is no probability between 0 and 1, both excluded.
        """
        owner, wanted = self.module.name, "the level of confidence must be a number between 0 and 1"
        level = number_of(level, owner, wanted)
        if not 0 < level < 1:
            raise ArgumentError(f"{owner}: {wanted}, found {shown(level)}; pass a probability, such as 0.95")
        half = 0.5 + level / 2
        factor = float(norm.ppf(half) if self.known_noise or self.degrees < 1 else student.ppf(half, self.degrees))
        deviations = self.deviations
        return {name: (value - factor * deviations[name], value + factor * deviations[name])
                for name, value in self.values.items()}


def echelon(directions: np.ndarray) -> np.ndarray:
    """Other directions that span the same, each with an entry of its own, which is 1: fewer of their entries differ from zero."""
    if not len(directions):
        return directions
    pivots = qr(directions, mode="r", pivoting=True)[1][:len(directions)]
    return np.linalg.solve(directions[:, pivots], directions)


def combination(vector: np.ndarray, labels: Sequence[str]) -> str:
    """A direction in unknowns relative to their scale, as text: the largest share is 1, those below a thousandth are left out."""
    vector = vector / vector[np.argmax(np.abs(vector))]
    shares = [(share, name) for share, name in zip(vector, labels, strict=True) if abs(share) > _SHARE]
    return " ".join(f"{'-' if share < 0 else '+' if k else ''}{' ' if k else ''}{abs(share):.3g} {name}"
                    for k, (share, name) in enumerate(shares))
