"""Constraints of closed loops along a motion: kept at the ends of the intervals, for positions and for velocities.

The rates of the state keep the constraints by themselves, along with the defects they would be too many equations. So the defects
at the end of each interval have as many corrections more, along the normals of the constraints, as there are constraints there:
they are of the size of the error of the mesh. An independent set of dependent constraints is kept.
Source: Posa, Kuindersma and Tedrake, Optimization and stabilization of trajectories for constrained dynamical systems, ICRA 2016.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from symdyn.errors import EvaluationError, SymdynError
from symdyn.formulation.names import Curvature, derivative_of
from symdyn.optimal.field import Arguments, Groups
from symdyn.tape.intrinsics import RANK

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# States of a guess that are moved onto the constraints.
MOVED = 21


class Loops:
    """[C; C_dot] of independent constraints at points of a motion, as Rows of [x; free parameters; t].

    p     (n_p,) values of all parameters; rows: of [C; C_dot], that are kept
    timed   whether they depend on t, and the duration is free
    """

    def __init__(self, module: Module, of: Arguments, p: np.ndarray, rows: np.ndarray, timed: bool = False) -> None:
        self.module, self.of, self.p, self.rows = module, of, p.copy(), rows
        self.n_c, n = len(module.metadata.constraints), of.n_x + len(of.free) + 1
        self._by = Groups(of, len(p), ("x", "params", *(("t",) if timed else ())), n)
        there = self._by.columns(np.ones((1, self._by.whole), dtype=bool))[0]
        self.slopes, self.curvature = np.tile(there, (len(rows), 1)), np.outer(there, there)

    def values(self, at: np.ndarray) -> np.ndarray:
        return np.hstack([self._call(name, at, (self.n_c,)) for name in ("C", "C_dot")])[:, self.rows]

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        sizes = self._by.sizes.items()
        result = [np.concatenate([self._call(derivative_of(name, by), at, (self.n_c, size)) for by, size in sizes], axis=2)
                  for name in ("C", "C_dot")]
        return self._by.columns(np.concatenate(result, axis=1)[:, self.rows])

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        whole = np.zeros((len(at), 2 * self.n_c))
        whole[:, self.rows] = weights
        given = np.hstack([np.zeros((len(at), self.module.metadata.sizes.u)), whole])
        second = self._call(Curvature("constraints", tuple(self._by.sizes)).name, at, (self._by.whole, self._by.whole), given)
        result = np.zeros((len(at), self._by.n, self._by.n))
        result[:, *self._by.corner] = second[:, self._by.kept[:, None], self._by.kept]
        return result

    def _call(self, name: str, at: np.ndarray, shape: tuple[int, ...], given: Any = ()) -> np.ndarray:
        n_x = self.of.n_x
        if self.of.free:
            self.p = self.p.copy()
            self.p[list(self.of.free)] = at[0, n_x:-1]
        try:
            return self.module.evaluate(name, at[:, -1], at[:, :n_x], self.p, (), given)
        except EvaluationError:
            return np.full((len(at), *shape), np.nan)


class UnitLengths:
    """Squares of what has unit length together, such as Euler parameters, less 1, as Rows of x.

    groups   indices in x
    """

    def __init__(self, n_x: int, groups: Sequence[Sequence[int]]) -> None:
        self.groups = [list(group) for group in groups]
        self.slopes, self.curvature = np.zeros((len(groups), n_x), dtype=bool), np.zeros((n_x, n_x), dtype=bool)
        for k, group in enumerate(self.groups):
            self.slopes[k, group] = True
            self.curvature[group, group] = True

    def values(self, at: np.ndarray) -> np.ndarray:
        return np.column_stack([(at[:, group] ** 2).sum(axis=1) - 1 for group in self.groups])

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        return np.where(self.slopes, 2 * at[:, None, :], 0.0)

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        result = np.zeros((len(at), *self.curvature.shape))
        for k, group in enumerate(self.groups):
            result[:, group, group] = 2 * weights[:, k, None]
        return result


def unit_groups(module: Module) -> list[list[int]]:
    """Indices in x of what has unit length together."""
    return [[module.metadata.q.index(name) for name in group] for group in module.metadata.unit_groups]


def independent_rows(module: Module, t: float, x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Indices of the rows of [C; C_dot] imply the others at a state: velocity constraints have no row among those of C."""
    n_c = len(module.metadata.constraints)
    if not n_c:
        return np.zeros(0, dtype=int)
    C_r = module.evaluate("C_r", t, x, p) * module.evaluate("C_scale", t, x, p)[:, None]
    holonomic = np.array(module.metadata.holonomic or [True] * n_c, dtype=bool)
    return np.array([*_independent(C_r, np.flatnonzero(holonomic)), *(n_c + k for k in _independent(C_r, np.arange(n_c)))],
                    dtype=int)


def _independent(C_r: np.ndarray, among: np.ndarray) -> list[int]:
    if not len(among):
        return []
    _, R, order = scipy.linalg.qr(C_r[among].T, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    return sorted(int(among[k]) for k in order[:len(sizes)][sizes > RANK * sizes[0]])


def on_constraints(module: Module, t: np.ndarray, X: np.ndarray, p: np.ndarray, leading: Sequence[str]) -> np.ndarray:
    """Guesses X (N, n_x) at times, moved onto the constraints one after the other: leading coordinates stay as far as they can,
    the others go on from the state before; speeds are those of this course. A state without a solution nearby stays as it is.
    Straight between every few of them."""
    if len(t) > MOVED:
        some = np.linspace(t[0], t[-1], MOVED)
        moved = on_constraints(module, some, np.column_stack([np.interp(some, t, x) for x in X.T]), p, leading)
        return np.column_stack([np.interp(t, some, x) for x in moved.T])
    metadata, sizes = module.metadata, module.metadata.sizes
    result, q = X.copy(), X[0, :sizes.q]
    led = np.array([name in leading for name in metadata.q], dtype=bool)
    for k in range(len(X)):
        guess = np.where(led, X[k, :sizes.q], q)
        for keep in ([name for name in leading if name in metadata.q], []):
            try:
                q = module.consistent(guess, np.zeros(sizes.u), p, float(t[k]), keep)[0]
                break
            except SymdynError:
                continue
        result[k, :sizes.q] = q
    rates = np.gradient(result[:, :sizes.q], t, axis=0)
    N, C_r, C_t = (module.evaluate(name, t, result, p) for name in ("N", "C_r", "C_t"))
    for k in range(len(X)):
        rows, right = np.vstack([N[k], C_r[k]]), np.concatenate([rates[k], -C_t[k]])
        result[k, sizes.q:sizes.q + sizes.u] = np.linalg.lstsq(rows, right, rcond=None)[0]
    return result


def normals(module: Module, t: np.ndarray, x: np.ndarray, p: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Directions (N, n_x, n) along which the state is corrected: orthonormal ones for the rows, of positions and of velocities,
    then those of what has unit length."""
    sizes, n_c, groups = module.metadata.sizes, len(module.metadata.constraints), unit_groups(module)
    result = np.zeros((len(x), sizes.x, len(rows) + len(groups)))
    for j, group in enumerate(groups):
        result[:, group, len(rows) + j] = x[:, group] / np.linalg.norm(x[:, group], axis=1)[:, None]
    if not len(rows):
        return result
    C_r, N = module.evaluate("C_r", t, x, p), module.evaluate("N", t, x, p)
    of_positions, of_speeds = rows[rows < n_c], rows[rows >= n_c] - n_c
    for k in range(len(x)):
        result[k, :sizes.q, :len(of_positions)] = np.linalg.qr(N[k] @ C_r[k, of_positions].T)[0]
        result[k, sizes.q:sizes.q + sizes.u, len(of_positions):len(rows)] = np.linalg.qr(C_r[k, of_speeds].T)[0]
    return result
