"""Integrands along a motion: the rates of the state and of the cost, times the duration, at many points at once.

A point has the arguments y = [x; inputs; free parameters; duration]. Functions of symdyn's compiled code are called once for all
points; their derivatives are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.formulation.names import HESSIAN, Weighted, derivative_of

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


class Groups:
    """Derivatives of a module's functions by groups of arguments, as those by [x; inputs; free parameters; t].

    sizes   by group that is there: its entries; whole: of all
    kept    which of them are arguments; corner: indices of these in a matrix (n, n)
    """

    def __init__(self, of: Arguments, n_p: int, groups: Sequence[str], n: int | None = None) -> None:
        every = {"x": of.n_x, "inputs": of.n_in, "params": n_p if of.free else 0, "t": 1}
        self.sizes = {by: every[by] for by in groups if every[by]}
        self.whole, self.n = sum(self.sizes.values()), of.n if n is None else n
        before = sum(self.sizes.get(by, 0) for by in ("x", "inputs"))
        last = (self.whole - 1,) if "t" in self.sizes else ()
        self.kept = np.array([*range(before), *(before + k for k in of.free), *last], dtype=int)
        self._at = np.array([*range(before + len(of.free)), *((self.n - 1,) if last else ())], dtype=int)
        self.corner = (self._at[:, None], self._at)

    def columns(self, result: np.ndarray) -> np.ndarray:
        """Derivatives by the arguments, (..., n), among derivatives (..., whole)."""
        made = np.zeros((*result.shape[:-1], self.n), dtype=result.dtype)
        made[..., self._at] = result[..., self.kept]
        return made


class Dynamics:
    """x_dot of a module by [x; inputs; free parameters; t], in one compiled call for all points.

    p     (n_p,) values of all parameters; timed: whether x_dot depends on t, and the duration is free
    calls   how many compiled calls were made
    """

    def __init__(self, module: Module, arguments: Arguments, p: np.ndarray, timed: bool = False) -> None:
        self.module, self.of, self.p = module, arguments, p.copy()
        self.calls = 0
        self._by = Groups(arguments, len(p), ("x", "inputs", "params", *(("t",) if timed else ())))
        self._first = {by: derivative_of("rhs", by) for by in self._by.sizes}
        self._second = Weighted(HESSIAN, tuple(self._by.sizes)).name
        n, whole = arguments.n, self._by.whole
        blocks = [structure_of(module, name, (arguments.n_x, self._by.sizes[by])) for by, name in self._first.items()]
        self.slopes = self._by.columns(np.hstack(blocks))
        self.curvature = np.zeros((n, n), dtype=bool)
        self.curvature[self._by.corner] = structure_of(module, self._second, (whole, whole))[np.ix_(self._by.kept, self._by.kept)]
        self.curvature |= self.curvature.T

    def values(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(N, n_x) at times (N,) and arguments (N, n)."""
        return self._call("rhs", t, at, (self.of.n_x,))

    def jacobian(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(N, n_x, n)."""
        result = [self._call(name, t, at, (self.of.n_x, self._by.sizes[by])) for by, name in self._first.items()]
        return self._by.columns(np.concatenate(result, axis=2))

    def hessian(self, t: np.ndarray, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(N, n, n), of the sums with weights (N, n_x)."""
        given = np.hstack([np.zeros((len(at), self.module.metadata.sizes.u)), weights])
        whole = self._call(self._second, t, at, (self._by.whole, self._by.whole), given)
        result = np.zeros((len(at), self.of.n, self.of.n))
        result[:, *self._by.corner] = whole[:, self._by.kept[:, None], self._by.kept]
        return result

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
        slopes, curvature = np.vstack([dynamics.slopes, integrand.slopes]), dynamics.curvature | integrand.curvature
        self.slopes[:, :-1], self.slopes[:, -1] = slopes[:, :-1], True
        self.curvature[:-1, :-1] = curvature[:-1, :-1]
        self.curvature[-1, :-1] = self.curvature[:-1, -1] = slopes[:, :-1].any(axis=0) | curvature[:-1, -1]
        self.curvature[-1, -1] = bool(slopes[:, -1].any())

    def at_shares(self, shares: np.ndarray) -> Field:
        """The same at other points."""
        result = object.__new__(Field)
        result.__dict__ = {**self.__dict__, "shares": shares}
        return result

    def _times(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Durations (N,), times (N,), arguments with the time in place of the duration (N, n)."""
        T = at[:, -1]
        t = self.t0 + self.shares * T
        return T, t, np.column_stack([at[:, :-1], t])

    def _values(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        return np.hstack([self.dynamics.values(t, at), self.integrand.values(at)])

    def _slopes(self, t: np.ndarray, at: np.ndarray) -> np.ndarray:
        return np.concatenate([self.dynamics.jacobian(t, at), self.integrand.jacobian(at)], axis=1)

    def values(self, at: np.ndarray) -> np.ndarray:
        T, t, timed = self._times(at)
        return T[:, None] * self._values(t, timed)

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        T, t, timed = self._times(at)
        result = T[:, None, None] * self._slopes(t, timed)
        result[:, :, -1] = self._values(t, timed) + self.shares[:, None] * result[:, :, -1]
        return result

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        T, t, timed = self._times(at)
        slopes = np.einsum("ni,nij->nj", weights, self._slopes(t, timed))
        result = T[:, None, None] * (self.dynamics.hessian(t, timed, weights[:, :-1])
                                     + self.integrand.hessian(timed, weights[:, -1:]))
        result[:, -1, :-1] = result[:, :-1, -1] = slopes[:, :-1] + self.shares[:, None] * result[:, :-1, -1]
        result[:, -1, -1] = self.shares * (2 * slopes[:, -1] + self.shares * result[:, -1, -1])
        return result


def structure_of(module: Module, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Where derivatives may differ from zero; everywhere where the module does not know."""
    result = module.structure(name)
    return np.ones(shape, dtype=bool) if result is None else result
