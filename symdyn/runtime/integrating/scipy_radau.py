"""SciPy's Radau with steps, and a polynomial within them, that keep the tolerance between the ends of steps, too.

Stages of stiff motion, and so the ends of steps, are on its slow part however long a step is. The collocation polynomial
between them is not, and SciPy's estimate of errors does not see it: errors there were up to 1e7 times the tolerance. Here the
defect of the polynomial at one more place, divided by the matrix of the estimate as Newton's method does, gives what it lacks
there. This is added to the polynomial, and steps for which it is large are done again, shorter. The compiled method does so, too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import DenseOutput, Radau
from scipy.integrate._ivp.radau import MU_REAL, C

from symdyn.runtime.integrating.taken_back import take_back

# Where c (c - c_1) (c - c_2) (c - 1), what stiff motion of degree 4 has beyond the polynomial, is largest in the step.
EXTRA = 0.8611601583007704
# Size of the gap that is accepted, in tolerances: the polynomial with it is an order better.
ACCEPTED = 2.0
# A gap that falls off more slowly than the square of the step is rounding.
ROUNDING_ORDER, ORDER = 2, 4
SAFETY, SHORTEST = 0.85, 0.2


class WithinTolerance(DenseOutput):
    """The collocation polynomial and the gap, (n,), between it and the motion at the extra place."""

    def __init__(self, polynomial: Any, gap: np.ndarray) -> None:
        super().__init__(polynomial.t_old, polynomial.t)
        self.polynomial, self.gap = polynomial, gap

    def _call_impl(self, t: Any) -> np.ndarray:
        part = (np.asarray(t) - self.t_old) / (self.t - self.t_old)
        weight = part / EXTRA
        for c in C:
            weight = weight * (part - c) / (EXTRA - c)
        return np.asarray(self.polynomial(t) + (self.gap * weight if np.ndim(t) == 0 else self.gap[:, None] * weight))


class RadauWithin(Radau):
    """As its base, with `dense_output` within the tolerance."""

    def _step_impl(self) -> tuple[bool, str | None]:
        tried: tuple[float, float] | None = None  # length and size of the gap of the step that was given up
        while True:
            before = self.__dict__.copy()
            success, message = super()._step_impl()
            if not success:
                return success, message
            h = self.t - before["t"]
            self.gap = self._gap(h)
            scale = self.atol + self.rtol * np.maximum(np.abs(self.y), np.abs(self.y_old))
            size = float(np.linalg.norm(self.gap / scale)) / len(scale)**0.5 / ACCEPTED
            if not size > 1.0 or (tried is not None and size > tried[1] * (h / tried[0])**ROUNDING_ORDER):
                return success, message
            tried = (h, size)
            take_back(self, before, abs(h) * max(SHORTEST, SAFETY * size**(-1 / ORDER)))

    def _gap(self, h: float) -> np.ndarray:
        """Defect at the extra place over (gamma/h - J)."""
        polynomial = self.sol
        powers = np.arange(1, polynomial.Q.shape[1] + 1)
        slope = polynomial.Q @ (powers * EXTRA**(powers - 1.0)) / h
        t = self.t_old + EXTRA * h
        defect = self.fun(t, polynomial(t)) - slope
        return np.asarray(self.solve_lu(self.lu(MU_REAL / h * self.I - self.J), defect))

    def _dense_output_impl(self) -> WithinTolerance:
        return WithinTolerance(self.sol, self.gap)
