"""Values with a covariance, and combinations of unknowns as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

# Shares of unknowns in a combination that are written.
_SHARE = 0.05


class Estimate:
    """What estimates have in common: values (label -> value), covariance (n, n) in this order, degrees of freedom (residuals less
    unknowns), and known_noise, whether the noise of the data was given."""

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
        """Interval of every value in which it lies with this probability, as far as what was measured is linear in it there."""
        half = 0.5 + level / 2
        factor = float(norm.ppf(half) if self.known_noise or self.degrees < 1 else student.ppf(half, self.degrees))
        deviations = self.deviations
        return {name: (value - factor * deviations[name], value + factor * deviations[name])
                for name, value in self.values.items()}


def combination(vector: np.ndarray, labels: Sequence[str]) -> str:
    """A direction in unknowns relative to their scale, as text: the largest share is 1."""
    vector = vector / vector[np.argmax(np.abs(vector))]
    shares = [(share, name) for share, name in zip(vector, labels, strict=True) if abs(share) > _SHARE]
    return " ".join(f"{'-' if share < 0 else '+' if k else ''}{' ' if k else ''}{abs(share):.3g} {name}"
                    for k, (share, name) in enumerate(shares))
