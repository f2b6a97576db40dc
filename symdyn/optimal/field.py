"""What is integrated along a motion: the rates of the state and of the cost, times the duration, at many points at once.

A point has the arguments y = [x; inputs; free parameters; duration]. Functions of symdyn's compiled code are called once for all
points; their derivatives are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symdyn.errors import EvaluationError

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


class Rows(Protocol):
    """A function of n arguments with m values, at N points at once.

    slopes, curvature   where derivatives (m, n) and second derivatives (n, n) may differ from zero
    """

    slopes: np.ndarray
    curvature: np.ndarray

    def values(self, at: np.ndarray) -> np.ndarray:
        """(N, m) at rows of arguments (N, n)."""

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        """(N, m, n)."""

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives (N, n, n) of the sums of values with weights (N, m)."""


@dataclass(frozen=True)
class Arguments:
    """Where the parts of the arguments y stand, n of them; free: indices of the free parameters among all of them."""

    n_x: int
    n_in: int
    free: tuple[int, ...]

    @property
    def x(self) -> slice:
        return slice(0, self.n_x)

    @property
    def inputs(self) -> slice:
        return slice(self.n_x, self.n_x + self.n_in)

    @property
    def params(self) -> slice:
        return slice(self.n_x + self.n_in, self.n_x + self.n_in + len(self.free))

    @property
    def duration(self) -> int:
        return self.n_x + self.n_in + len(self.free)

    @property
    def n(self) -> int:
        return self.duration + 1


class Dynamics:
    """x_dot of a module by [x; inputs; free parameters], in one compiled call for all points.

    p     (n_p,) values of all parameters
    calls   how many compiled calls were made
    """

    def __init__(self, module: Module, arguments: Arguments, p: np.ndarray) -> None:
        self.module, self.of, self.p = module, arguments, p.copy()
        self.n = arguments.duration
        self.calls = 0
        wrt = ("x", *(("inputs",) if arguments.n_in else ()), *(("params",) if arguments.free else ()))
        self._first = {by: f"jacobian_{by}" for by in wrt}
        self._second = f"hessian_{'_'.join(wrt)}"
        n_p = len(p)
        kept = [*range(arguments.n_x + arguments.n_in), *(arguments.n_x + arguments.n_in + k for k in arguments.free)]
        self._kept = np.array(kept, dtype=int)
        blocks = [structure_of(module, name, (arguments.n_x, size)) for name, size in
                  zip(self._first.values(), (arguments.n_x, arguments.n_in, n_p) if arguments.n_in else (arguments.n_x, n_p),
                      strict=False)]
        self.slopes = np.hstack(blocks)[:, self._kept]
        n_all = arguments.n_x + arguments.n_in * ("inputs" in wrt) + n_p * ("params" in wrt)
        self.curvature = structure_of(module, self._second, (n_all, n_all))[np.ix_(self._kept, self._kept)]
        self.curvature |= self.curvature.T

    def values(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(N, n_x) at times (N,) and arguments (N, n)."""
        return self._call("rhs", t, at, (self.of.n_x,))

    def jacobian(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(N, n_x, n)."""
        sizes = {"x": self.of.n_x, "inputs": self.of.n_in, "params": len(self.p)}
        found = [self._call(name, t, at, (self.of.n_x, sizes[by])) for by, name in self._first.items()]
        return np.concatenate(found, axis=2)[:, :, self._kept]

    def hessian(self, t: np.ndarray, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(N, n, n), of the sums with weights (N, n_x)."""
        sizes = {"x": self.of.n_x, "inputs": self.of.n_in, "params": len(self.p)}
        n = sum(sizes[by] for by in self._first)
        given = np.hstack([np.zeros((len(at), self.module.metadata.sizes.u)), weights])
        found = self._call(self._second, t, at, (n, n), given)
        return found[:, self._kept[:, None], self._kept]

    def _call(self, name: str, t: np.ndarray, at: np.ndarray, shape: tuple[int, ...], given: Any = ()) -> np.ndarray:
        """A compiled function at all points; NaN at all of them where it cannot be evaluated at one: such a step is not taken."""
        self.calls += 1
        free = list(self.of.free)
        if free and not np.array_equal(self.p[free], at[0, self.of.params]):
            self.p = self.p.copy()
            self.p[free] = at[0, self.of.params]
        if not np.isfinite(at).all():
            return np.full((len(at), *shape), np.nan)
        try:
            return self.module.evaluate(name, t, at[:, self.of.x], self.p, at[:, self.of.inputs], given)
        except EvaluationError:
            return np.full((len(at), *shape), np.nan)


class Field:
    """[x_dot; integrand of the cost] times the duration, as Rows, at points whose times are t0 + share * duration.

    shares   (N,) of the points
    """

    def __init__(self, dynamics: Dynamics, integrand: Rows, t0: float, shares: np.ndarray) -> None:
        self.dynamics, self.integrand, self.t0, self.shares = dynamics, integrand, t0, shares
        n_x, n = dynamics.of.n_x, dynamics.of.n
        self.slopes, self.curvature = np.zeros((n_x + 1, n), dtype=bool), np.zeros((n, n), dtype=bool)
        self.slopes[:n_x, :-1], self.slopes[n_x, :-1] = dynamics.slopes, integrand.slopes[0, :-1]
        self.slopes[:, -1] = True
        self.curvature[:-1, :-1] = dynamics.curvature | integrand.curvature[:-1, :-1]
        self.curvature[-1, :-1] = self.curvature[:-1, -1] = self.slopes[:, :-1].any(axis=0) | integrand.curvature[:-1, -1]
        self.curvature[-1, -1] = bool(integrand.slopes[0, -1])

    def at_shares(self, shares: np.ndarray) -> Field:
        """The same at other points."""
        found = object.__new__(Field)
        found.__dict__ = {**self.__dict__, "shares": shares}
        return found

    def _parts(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Durations (N,), times (N,), arguments of the integrand (N, n)."""
        T = at[:, -1]
        t = self.t0 + self.shares * T
        return T, t, np.column_stack([at[:, :-1], t])

    def values(self, at: np.ndarray) -> np.ndarray:
        T, t, of_cost = self._parts(at)
        return T[:, None] * np.hstack([self.dynamics.values(t, at), self.integrand.values(of_cost)])

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        T, t, of_cost = self._parts(at)
        rates = np.hstack([self.dynamics.values(t, at), self.integrand.values(of_cost)])
        cost = self.integrand.jacobian(of_cost)
        found = np.zeros((len(at), *self.slopes.shape))
        found[:, :-1, :-1] = T[:, None, None] * self.dynamics.jacobian(t, at)
        found[:, -1:, :-1] = T[:, None, None] * cost[:, :, :-1]
        found[:, :, -1] = rates
        found[:, -1, -1] += T * self.shares * cost[:, 0, -1]
        return found

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        T, t, of_cost = self._parts(at)
        of_x, of_integrand = weights[:, :-1], weights[:, -1:]
        cost, second = self.integrand.jacobian(of_cost)[:, 0], self.integrand.hessian(of_cost, of_integrand)
        found = np.zeros((len(at), *self.curvature.shape))
        found[:, :-1, :-1] = T[:, None, None] * (self.dynamics.hessian(t, at, of_x) + second[:, :-1, :-1])
        cross = np.einsum("ni,nij->nj", of_x, self.dynamics.jacobian(t, at)) + of_integrand * cost[:, :-1]
        cross += (T * self.shares)[:, None] * second[:, :-1, -1]
        found[:, -1, :-1] = found[:, :-1, -1] = cross
        found[:, -1, -1] = self.shares * (2 * of_integrand[:, 0] * cost[:, -1] + T * self.shares * second[:, -1, -1])
        return found


def structure_of(module: Module, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Where derivatives may differ from zero; everywhere where the module does not know."""
    found = module.structure(name)
    return np.ones(shape, dtype=bool) if found is None else found
