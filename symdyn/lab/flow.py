"""The derivative of the flow on the manifold of the constraints, by differences of x_dot alone.

Coordinates of the manifold are those that a linearization names: displacements eta, speeds zeta and extra states z. To a change
of one of them belongs a curve of states x(h) on the constraints: the independent velocities v move the coordinates along N v, or
the independent speed or extra state changes; all that is dependent follows by Newton's method on C = 0 and C_dot = 0. Along this
curve x' = dx/dh, and the same derivative of x_dot(t, x(h)) is d(x')/dt, since the flow takes states on the manifold to such
states. Rows of zeta and z are entries of it. A displacement is the velocity v = N^+ q' with q' = N v; its rate follows from

    d(q')/dt = N_dot v + N v_dot,    v_dot = N^+ (d(q')/dt - N_dot v),

N_dot being the derivative of N along the motion. With rates of coordinates as speeds this is the entry of d(q')/dt.

Derivatives are central differences with steps halved again and again, extrapolated (Romberg); the change by the last
extrapolation is their uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.lab.manifold import onto, ranks

# Largest steps, of which the better result counts, and how many of each; a step moves coordinates and speeds by so much (SI).
STEPS, HALVINGS = (1.2e-2, 2.5e-3), 4
# States that are evaluated at once.
ROWS = 400


class Matrices(NamedTuple):
    """Matrices of x'_dot = A x' + B in', y' = C x' + D in'."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of the manifold: numbers of independent displacements and speeds among the speeds, and of the free extra
    states."""

    displacements: tuple[int, ...]
    speeds: tuple[int, ...]
    states: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of these coordinates."""
        return len(self.displacements) + len(self.speeds) + len(self.states)

    @classmethod
    def named(cls, metadata: ModuleMetadata, displacements: Sequence[str], others: Sequence[str]) -> Coordinates:
        """From the names that a linearization has for displacements, and for speeds and extra states.

        A displacement has the name of the coordinate whose rate is a speed, else along_ and the name of the speed along which it
        is. Raises ValueError for other names.
        """
        speeds, states = list(metadata.u), list(metadata.z)
        labels = [u.removesuffix("_dot") if u.removesuffix("_dot") in metadata.q else f"along_{u}" for u in speeds]
        free = [n for n in others if n in states]
        moving = others[:len(others) - len(free)]
        return cls(tuple(labels.index(n) for n in displacements), tuple(speeds.index(n) for n in moving),
                   tuple(states.index(n) for n in free))


class Flow:
    """The motion of a module near a state on its constraints.

    params (n_p,), inputs (n_in,); the state x (n_x,) must lie on the constraints to rounding
    """

    def __init__(self, module: Any, t: float, x: np.ndarray, params: np.ndarray, inputs: np.ndarray,
                 coordinates: Coordinates) -> None:
        self.module, self.t, self.x, self.p, self.inputs, self.coordinates = module, t, x, params, inputs, coordinates
        sizes = module.metadata.sizes
        self.n_q, self.n_u, self.n_x = sizes.q, sizes.u, sizes.x
        self._dependent = [k for k in range(self.n_u) if k not in coordinates.displacements]
        self._dependent_speeds = [k for k in range(self.n_u) if k not in coordinates.speeds]
        self._inverse = np.linalg.pinv(self._evaluate("N", x))

    def freedoms(self) -> tuple[int, int]:
        """Numbers of displacements and speeds that are independent here."""
        if not self.module.metadata.constraints:
            return self.n_u, self.n_u
        positions, speeds, _ = ranks(self.module, self.t, self.x, self.p)
        return self.n_u - positions, self.n_u - speeds

    # -- the matrices

    def matrices(self) -> tuple[Matrices, float]:
        """A, B, C, D, and how uncertain they are, relative to the largest entry of each (at least 1)."""
        def along(h: np.ndarray) -> np.ndarray:
            x = self.states(h)
            return np.hstack([x, self._rates(x), self._outputs(x)])

        result, first = self._differences(along, self.coordinates.size)
        x_h, rates_h, y_h = np.split(result, [self.n_x, 2 * self.n_x], axis=1)
        A = self.reduced(x_h, rates_h)

        def driven(h: np.ndarray) -> np.ndarray:
            inputs = self.inputs + h
            return np.hstack([self._rates(self.x[None], inputs), self._outputs(self.x[None], inputs)])

        by_inputs, second = self._differences(driven, len(self.inputs))
        rates_in, y_in = np.split(by_inputs, [self.n_x], axis=1)
        B = self.reduced(np.zeros_like(rates_in), rates_in)
        return Matrices(A, B, y_h.T, y_in.T), max(first, second)

    def reduced(self, x_h: np.ndarray, rates_h: np.ndarray) -> np.ndarray:
        """Rates of eta, zeta and z for changes of x and x_dot, rows (m, n_x) each; columns (size, m)."""
        q_h, rates_q = x_h[:, :self.n_q], rates_h[:, :self.n_q]
        v = q_h @ self._inverse.T
        v_dot = (rates_q - v @ self._turning().T) @ self._inverse.T
        c = self.coordinates
        z = [self.n_q + self.n_u + k for k in c.states]
        return np.hstack([v_dot[:, list(c.displacements)], rates_h[:, [self.n_q + k for k in c.speeds]], rates_h[:, z]]).T

    def values(self, x: np.ndarray, x_h: np.ndarray) -> np.ndarray:
        """eta, zeta and z of changes x_h (m, n_x) of a state x, columns (size, m)."""
        c = self.coordinates
        v = x_h[:, :self.n_q] @ np.linalg.pinv(self._evaluate("N", x)).T
        z = [self.n_q + self.n_u + k for k in c.states]
        return np.hstack([v[:, list(c.displacements)], x_h[:, [self.n_q + k for k in c.speeds]], x_h[:, z]]).T

    def states(self, h: np.ndarray) -> np.ndarray:
        """States on the constraints for changes h (n, size) of eta, zeta and z, (n, n_x)."""
        c = self.coordinates
        n_d, n_s = len(c.displacements), len(c.speeds)
        x = np.tile(self.x, (len(h), 1))
        N = self._evaluate("N", self.x)
        x[:, :self.n_q] += h[:, :n_d] @ N[:, list(c.displacements)].T
        x[:, [self.n_q + k for k in c.speeds]] += h[:, n_d:n_d + n_s]
        x[:, [self.n_q + self.n_u + k for k in c.states]] += h[:, n_d + n_s:]
        return onto(self.module, self.t, x, self.p, self._dependent, self._dependent_speeds, self.x)

    # -- differences

    def _differences(self, function: Callable[[np.ndarray], np.ndarray], n: int) -> tuple[np.ndarray, float]:
        """Derivatives (n, ...) of function(h (m, n)) -> (m, ...) by each of n numbers, at zero, and their uncertainty."""
        results = [romberg(function, n, step) for step in STEPS]
        size = max(1.0, float(np.abs(results[0][0]).max(initial=0.0)))
        best = np.where(results[0][1] <= results[1][1], results[0][0], results[1][0])
        uncertainty = np.minimum(results[0][1], results[1][1])
        return best, float(uncertainty.max(initial=0.0)) / size

    def _turning(self) -> np.ndarray:
        """N_dot, the derivative of N along the motion, (n_q, n_u)."""
        rates = self._rates(self.x[None])[0]
        slow = 1 / (1 + np.abs(rates[:self.n_q]).max(initial=0.0))

        def along(h: np.ndarray) -> np.ndarray:
            times = self.t + slow * h[:, 0]
            x = self.x + slow * h * rates
            N: np.ndarray = self.module.evaluate("N", times, x, self.p)
            return N.reshape(len(h), -1)

        result, _ = self._differences(along, 1)
        return result[0].reshape(self.n_q, self.n_u) / slow

    # -- the module

    def _evaluate(self, name: str, x: np.ndarray) -> np.ndarray:
        result: np.ndarray = self.module.evaluate(name, self.t, x, self.p)
        return result

    def _rates(self, x: np.ndarray, inputs: np.ndarray | None = None) -> np.ndarray:
        return self._rows("rhs", x, self.inputs if inputs is None else inputs)

    def _outputs(self, x: np.ndarray, inputs: np.ndarray | None = None) -> np.ndarray:
        inputs = self.inputs if inputs is None else inputs
        if not self.module.metadata.outputs:
            return np.zeros((max(len(x), len(np.atleast_2d(inputs))), 0))
        return self._rows("outputs", x, inputs)

    def _rows(self, name: str, x: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        result: np.ndarray = self.module.evaluate(name, self.t, x, self.p, inputs)
        return result.reshape(-1, result.shape[-1])


def romberg(function: Callable[[np.ndarray], np.ndarray], n: int, step: float, halvings: int = HALVINGS
            ) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (n, m) of function(h (rows, n)) -> (rows, m) at zero, and the change of each by the last extrapolation."""
    sizes = step / 2.0 ** np.arange(halvings)
    h = np.vstack([sign * size * np.eye(n) for size in sizes for sign in (1, -1)]) if n else np.zeros((0, 0))
    if not n:
        width = function(np.zeros((1, 0))).shape[1]
        return np.zeros((0, width)), np.zeros((0, width))
    values = np.vstack([function(part) for part in np.array_split(h, max(1, len(h) // ROWS))])
    values = values.reshape(halvings, 2, n, -1)
    table = [(up - down) / (2 * size) for (up, down), size in zip(values, sizes, strict=True)]
    change = np.abs(table[-1] - table[-2])
    for order in range(1, halvings):
        table = [later + (later - earlier) / (4**order - 1) for earlier, later in pairwise(table)]
        if len(table) > 1:
            change = np.abs(table[-1] - table[-2])
    return table[0], change
