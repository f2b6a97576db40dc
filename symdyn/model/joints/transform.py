"""A rigid motion given by expressions, and its exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np
import sympy as sp

from symdyn.model.joints.samples import TRIES, Samples
from symdyn.model.symbols import symbols_of


class Transform:
    """R (3, 3), child to parent components, and d (3, 1), m, parent axes, of coordinates q and parameters.

    Derivatives are SymPy's of the single entries; products of theirs that are constant are found as such by their values
    (see Samples), since nothing is simplified.
    Raises UnsupportedExpression for what has no counterpart in generated code.
    """

    def __init__(self, coordinates: Sequence[sp.Symbol], rotation: sp.ImmutableMatrix, position: sp.ImmutableMatrix) -> None:
        self.q = tuple(coordinates)
        self.R, self.d = rotation, position
        self.samples = Samples([*rotation, *position], self.q)

    @cached_property
    def S(self) -> sp.ImmutableMatrix:
        """Motion subspace (6, n): angular part vee(R^T dR/dq_k), linear part R^T dd/dq_k, child axes."""
        columns = []
        for q in self.q:
            dR, dd = (self._derivative(part, q) for part in (self.R, self.d))
            omega = [self.R[:, i].dot(dR[:, j]) for i, j in ((2, 1), (0, 2), (1, 0))]
            columns.append([self.samples.folded(e) for e in (*omega, *self._in_child_axes(dd))])
        return sp.ImmutableMatrix(columns).T

    @cached_property
    def c(self) -> dict[tuple[int, int], sp.ImmutableMatrix]:
        """(j, k), j <= k -> what q_j_dot q_k_dot is multiplied by in the velocity product, (6, 1), where it is not zero."""
        result = {}
        for j, k in combinations_with_replacement(range(len(self.q)), 2):
            pairs = {(j, k), (k, j)}
            angular = sum((self._derivative(self.S[:3, a], self.q[b]) for a, b in pairs), sp.zeros(3, 1))
            dd = self._derivative(self._derivative(self.d, self.q[j]), self.q[k]) * len(pairs)
            column = sp.ImmutableMatrix([self.samples.folded(e) for e in (*angular, *self._in_child_axes(dd))])
            if not column.is_zero_matrix:
                result[j, k] = column
        return result

    # -- what may be wrong with it

    def faults(self) -> list[str]:
        """Its faults, in words; nothing if it is a rigid motion that every coordinate has a part in."""
        if not self.samples.points:
            return [f"its transform has no real value at {TRIES} random places (coordinates in [-10, 10], parameters in "
                    "[0.5, 1.5]); check where roots, logarithms and divisions leave their domain, or shift the coordinates"]
        for values, point in zip(self.samples.values(self.R), self.samples.points, strict=True):
            R = np.array(values, dtype=float).reshape(3, 3)
            residual = max(np.abs(R @ R.T - np.eye(3)).max(), abs(np.linalg.det(R) - 1))
            if residual > 1e-9:
                where = ", ".join(f"{name} = {value:.4g}" for name, value in point.items())
                return [f"its rotation is none at {where}: R R^T differs from the identity, or its determinant from 1, by "
                        f"{residual:.2g}; pass a matrix that is a rotation at every value of its symbols"]
        for product in self.c.values():
            self.samples.values(product)  # raises what would else be found only when the equations are derived
        columns = [np.array(v, dtype=float).reshape(6, -1) for v in self.samples.values(self.S) if v is not None]
        return self._idle(columns) or self._dependent(columns) if columns else []

    @property
    def in_plane(self) -> bool:
        """Whether it keeps the child in the x-y plane."""
        out = [self.R[2, 2] - 1, self.R[0, 2], self.R[1, 2], self.R[2, 0], self.R[2, 1], self.d[2]]
        return all(v is None or max(map(abs, v)) < 1e-9 for v in self.samples.values(out))

    @property
    def identity_at_zero(self) -> bool:
        """Whether R = 1 and d = 0 where every coordinate is zero."""
        at_zero = [part.xreplace(dict.fromkeys(self.q, sp.S.Zero)) for part in (self.R, self.d)]
        return bool(at_zero[0] == sp.eye(3) and at_zero[1] == sp.zeros(3, 1))

    def _idle(self, columns: list[np.ndarray]) -> list[str]:
        idle = [str(q) for k, q in enumerate(self.q) if all(np.abs(S[:, k]).max() < 1e-12 for S in columns)]
        fault = f"{', '.join(idle)} moves nothing; let the rotation or the position depend on it, or leave it out"
        return [fault] if idle else []

    def _dependent(self, columns: list[np.ndarray]) -> list[str]:
        shares = []
        for S in columns:
            # Columns differ in their units; only their directions count.
            length = np.linalg.norm(S, axis=0)
            _, values, directions = np.linalg.svd(S / np.where(length > 0, length, 1))
            shares.append(np.abs(directions[-1]))
            if values[-1] > 1e-9:
                return []
        names = [str(q) for q, share in zip(self.q, np.max(shares, axis=0), strict=True) if share > 1e-6]
        return [f"{', '.join(names)} do not move the child independently of each other, at any position; leave one of them out"]

    # -- derivatives

    def _derivative(self, matrix: sp.MatrixBase, by: sp.Symbol) -> sp.ImmutableMatrix:
        # SymPy differentiates Abs, Max and sign as functions of complex numbers unless it is declared that there are none.
        real = {s: sp.Symbol(s.name, real=True) for s in symbols_of(matrix) if not s.is_real}
        result = matrix.xreplace(real).diff(real.get(by, by))
        result = result.replace(sp.DiracDelta, lambda *_: sp.S.Zero)
        return sp.ImmutableMatrix(result.xreplace({new: old for old, new in real.items()}))

    def _in_child_axes(self, column: sp.MatrixBase) -> list[sp.Expr]:
        return [self.R[:, i].dot(column) for i in range(3)]
