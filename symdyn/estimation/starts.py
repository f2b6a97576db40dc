"""Starts of experiments on the constraints: a set of coordinates and speeds is kept, the constraints determine the others.

The kept coordinates are chosen once, so that the start is an implicit function of the unknowns with an exact derivative: with
C(q, p, t) = 0 and the columns of C_q parted into those of kept and of dependent coordinates,
C_q,dep dq_dep = -(C_q,kept dq_kept + C_p dp), and the same of C_dot(q, u, p, t) = 0 for the speeds. Euler parameters add a row
for their norm each. Source: Wehage and Haug, J. Mech. Des. 104 (1982) 247-255 (partitioning of coordinates).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.consistent import closest
from symdyn.runtime.constraints import as_velocities, derivatives, length
from symdyn.turning import is_angle

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Least singular values of the dependent columns, relative to the largest: coordinates are kept so that the first holds; the
# second holds at least.
_WELL, _AT_ALL = 0.05, 1e-8
# A step of Newton's method is the last one when it is smaller than this part of the mechanism's length.
_SOLVED = 1e-13
_ITERATIONS = 12
# Along the way from the first start a step is halved where the correction is larger than this part of the length; steps shorter
# than the second part of the way end it.
_NEAR, _SHORTEST = 0.1, 1e-3


def moves(module: Module, t: float, x: np.ndarray, p: np.ndarray, parameters: Sequence[str], states: Sequence[str]) -> bool:
    """Whether a change of parameters, or of initial values of states, moves consistent starts off the constraints."""
    metadata = module.metadata
    if any(state in metadata.q or state in metadata.u for state in states):
        return bool(metadata.constraints or metadata.unit_groups)
    if not metadata.constraints or not parameters:
        return False
    places = [metadata.parameters.index(name) for name in parameters]
    return any(derivatives(module, of, t, x, p)[1][:, places].any() for of in ("C", "C_dot"))


class Start:
    """The start of one experiment as a function of parameters and fitted initial values.

    module   whose motions are those of the experiment; t: time of the start, s
    x, p     the start as it is given and the parameters with it, (n_x,) and (n_p,): the branch is that of the nearest start
    fitted   states whose initial values are unknowns
    Raises ArgumentError where more initial values are fitted than the constraints leave free, or no consistent start is near.
    """

    def __init__(self, module: Module, t: float, x: np.ndarray, p: np.ndarray, fitted: Sequence[str]) -> None:
        self._module, self._t, self._p = module, t, p
        metadata = module.metadata
        self._n_q, self._n_u = metadata.sizes.q, metadata.sizes.u
        self._n_c = len(metadata.constraints)
        self._holonomic = np.array(metadata.holonomic or [True] * self._n_c, dtype=bool)
        self._units = [[metadata.q.index(name) for name in group] for group in metadata.unit_groups]
        size = length(module, p) if self._n_c else 1.0
        angles = np.array([is_angle(metadata.units.get(q)) for q in metadata.q], dtype=bool)
        self._lengths = np.where(angles, size, 1.0)
        self._size = size
        self._kept_q = self._kept(self._rows_q(x, p)[1] / self._lengths, list(metadata.q), fitted, "coordinates")
        self._dependent_q = np.setdiff1d(np.arange(self._n_q), self._kept_q)
        rows = self._rows_u(x, p)[1]
        self._kept_u = self._kept(rows / as_velocities(module, p) if self._n_c else rows, list(metadata.u), fitted, "speeds")
        self._dependent_u = np.setdiff1d(np.arange(self._n_u), self._kept_u)
        if self._n_c:
            x = closest(module, t, x, p, [*(metadata.q[k] for k in self._kept_q), *(metadata.u[k] for k in self._kept_u)])
        self._x = self._with_speeds(self._solved(x, p), p)

    @property
    def first(self) -> np.ndarray:
        """The consistent start at the guess, (n_x,)."""
        return self._x

    def at(self, values: Mapping[str, float], p: np.ndarray) -> np.ndarray:
        """The start (n_x,) with initial values by state and parameters (n_p,); raises EvaluationError where there is none.

        The way from the first start leads along a straight line of what is given, so that the branch is the same.
        """
        target = self._x.copy()
        for name, value in values.items():
            target[self._module.metadata.x.index(name)] = value
        given = [*self._kept_q, *range(self._n_q, len(target))]
        change, parameters = (target - self._x)[given], p - self._p
        x, done, step = self._x.copy(), 0.0, 1.0
        while done < 1.0:
            step = min(step, 1.0 - done)
            # Both ends exactly, so that the way back to the first start leads to it.
            there = p if done + step == 1.0 else self._p + (done + step) * parameters
            begun = x.copy()
            begun[given] = target[given] if done + step == 1.0 else self._x[given] + (done + step) * change
            begun[self._dependent_q] += self._predicted(x, begun, there)
            try:
                result = self._solved(begun, there)
                far = np.abs((result - begun)[:self._n_q] * self._lengths).max(initial=0.0) > _NEAR * self._size
            except EvaluationError:
                far = True
            if far:
                step /= 2
                if step < _SHORTEST:
                    raise EvaluationError(f"{self._module.name}: no start fulfils the constraints with {self._shown(values, p)}: "
                                          "on the way there from the guess the mechanism does not close")
                continue
            x, done = result, done + step
        return self._with_speeds(x, p)

    def derivative(self, x: np.ndarray, p: np.ndarray, by: str) -> np.ndarray:
        """Derivative of the start by a parameter, or by the initial value of a state, (n_x,)."""
        metadata = self._module.metadata
        result = np.zeros(len(x))
        of_parameters = np.zeros(len(p))
        if by in metadata.parameters:
            of_parameters[metadata.parameters.index(by)] = 1.0
        else:
            result[metadata.x.index(by)] = 1.0
        _, C_q, C_p = self._rows_q(x, p)
        result[self._dependent_q] = self._dependents(C_q, self._dependent_q, C_q @ result[:self._n_q] + C_p @ of_parameters)
        _, C_u, C_dot_x, C_dot_p = self._rows_u(x, p)
        left = C_dot_x @ result + C_dot_p @ of_parameters
        result[self._n_q + self._dependent_u] = self._dependents(C_u, self._dependent_u, left)
        return result

    def _predicted(self, x: np.ndarray, moved: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The change of the dependent coordinates to first order."""
        C, C_q, _ = self._rows_q(x, p)  # C at the new parameters is C_p dp and what is behind it
        return self._dependents(C_q, self._dependent_q, C + C_q @ (moved - x)[:self._n_q])

    def _solved(self, x: np.ndarray, p: np.ndarray) -> np.ndarray:
        """The dependent coordinates by Newton's method; raises EvaluationError where it does not converge."""
        x, last = x.copy(), np.inf
        for _ in range(_ITERATIONS):
            C, C_q, _ = self._rows_q(x, p)
            change = self._dependents(C_q, self._dependent_q, C)
            x[self._dependent_q] += change
            size = float(np.abs(change * self._lengths[self._dependent_q]).max(initial=0.0))
            # Rounding of what is large may keep steps from getting smaller than what is requested.
            if size <= _SOLVED * self._size or (size <= 1e-9 * self._size and size >= 0.5 * last):
                return x
            last = size
        raise EvaluationError("not converged")

    def _with_speeds(self, x: np.ndarray, p: np.ndarray) -> np.ndarray:
        x = x.copy()
        C_dot, C_u, *_ = self._rows_u(x, p)
        x[self._n_q + self._dependent_u] += self._dependents(C_u, self._dependent_u, C_dot)
        return x

    def _rows_q(self, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """C, C_q and C_p of holonomic constraints and norms, all lengths: (n,), (n, n_q), (n, n_p)."""
        C, C_q, C_p = np.zeros(0), np.zeros((0, self._n_q)), np.zeros((0, len(p)))
        if self._n_c:
            scale = self._module.evaluate("C_scale", self._t, x, p)[self._holonomic]
            by_x, by_p = derivatives(self._module, "C", self._t, x, p)
            C = self._module.evaluate("C", self._t, x, p)[self._holonomic] * scale
            C_q, C_p = by_x[self._holonomic, :self._n_q] * scale[:, None], by_p[self._holonomic] * scale[:, None]
        for group in self._units:
            row = np.zeros(self._n_q)
            row[group] = self._size * x[group]
            C = np.append(C, 0.5 * self._size * (x[group] @ x[group] - 1))
            C_q, C_p = np.vstack([C_q, row]), np.vstack([C_p, np.zeros(len(p))])
        return C, C_q, C_p

    def _rows_u(self, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """C_dot and its derivatives by speeds, state and parameters, velocities: (n_c,), (n_c, n_u), (n_c, n_x), (n_c, n_p)."""
        if not self._n_c:
            return np.zeros(0), np.zeros((0, self._n_u)), np.zeros((0, len(x))), np.zeros((0, len(p)))
        scale = self._module.evaluate("C_scale", self._t, x, p)
        by_x, by_p = derivatives(self._module, "C_dot", self._t, x, p)
        rows = by_x * scale[:, None]
        return (self._module.evaluate("C_dot", self._t, x, p) * scale, rows[:, self._n_q:self._n_q + self._n_u], rows,
                by_p * scale[:, None])

    @staticmethod
    def _dependents(rows: np.ndarray, dependent: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Changes of the dependent ones that take away what is left; rows may depend on each other."""
        if not len(dependent):
            return np.zeros(0)
        result: np.ndarray = np.linalg.lstsq(rows[:, dependent], -left, rcond=_AT_ALL)[0]
        return result

    def _kept(self, rows: np.ndarray, names: Sequence[str], fitted: Sequence[str], what: str) -> np.ndarray:
        """Places of what is kept, such that the columns of the others have the rank of all: what is fitted, then in order."""
        values = np.linalg.svd(rows, compute_uv=False)
        rank = int((values > _AT_ALL * values[0]).sum()) if values.size and values[0] > 0 else 0
        if rank == 0:
            return np.arange(len(names))
        mine = [k for k, name in enumerate(names) if name in fitted]
        kept: list[int] = []
        for at_least, candidates in ((_AT_ALL, mine), (_WELL, range(len(names))), (_AT_ALL, range(len(names)))):
            for k in candidates:
                rest = [j for j in range(len(names)) if j not in kept and j != k]
                if k not in kept and len(rest) >= rank and \
                        np.linalg.svd(rows[:, rest], compute_uv=False)[rank - 1] > at_least * values[0]:
                    kept.append(k)
        over = [names[k] for k in mine if k not in kept]
        if over:
            free = ", ".join(names[k] for k in mine if k in kept)
            raise ArgumentError(
                f"{self._module.name}: initial has {', '.join(names[k] for k in mine)}, but constraints, or the norm of Euler "
                f"parameters, let {len(names) - rank} of the {len(names)} {what} be chosen"
                + (f", and {free} determine {', '.join(over)}" if free else "") + f"; leave out {', '.join(over)}")
        return np.array(sorted(kept), dtype=int)

    def _shown(self, values: Mapping[str, float], p: np.ndarray) -> str:
        names = self._module.metadata.parameters
        changed = [(name, now) for name, now, then in zip(names, p, self._p, strict=True) if now != then]
        return ", ".join([f"{name} = {value:.6g}" for name, value in changed]
                         + [f"{name}(0) = {value:.6g}" for name, value in values.items()])
