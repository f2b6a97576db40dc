"""Expressions that hold outputs of a module, with exact derivatives: those of the outputs come from compiled code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.formulation.names import Curvature, derivative_of
from symdyn.optimal.expressions import Expressions
from symdyn.optimal.field import Arguments, Groups, structure_of
from symdyn.runtime.losses import output_names

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


class WithOutputs:
    """Expressions of arguments and outputs as a function of the arguments alone, as Rows.

    expressions   of the arguments and then the outputs, all of them
    first         where [x; inputs; free parameters; t] begin among the arguments; p (n_p,): values of all parameters
    timed         whether outputs depend on t, and the duration is free
    """

    def __init__(self, expressions: Expressions, module: Module, of: Arguments, p: np.ndarray, first: int,
                 timed: bool = False) -> None:
        self.expressions, self.module, self.of, self.p, self.first = expressions, module, of, p.copy(), first
        self.n_y = len(output_names(module))
        self.n = len(expressions.names) - self.n_y
        self._by = Groups(of, len(p), ("x", "inputs", "params", *(("t",) if timed else ())))
        self._at = slice(first, first + of.n)
        self.m, self.slopes = expressions.m, expressions.slopes[:, :self.n].copy()
        self.curvature = expressions.curvature[:self.n, :self.n].copy()
        of_outputs = np.zeros((self.n_y, self.n), dtype=bool)
        parts = [structure_of(module, derivative_of("outputs", by), (self.n_y, size)) for by, size in self._by.sizes.items()]
        of_outputs[:, self._at] = self._by.columns(np.hstack(parts))
        self.slopes |= expressions.slopes[:, self.n:] @ of_outputs
        used = of_outputs[expressions.slopes[:, self.n:].any(axis=0)].any(axis=0)
        mixed = used | expressions.curvature[:self.n, self.n:].any(axis=1)
        self.curvature |= np.outer(mixed, used) | np.outer(used, mixed)

    def values(self, at: np.ndarray) -> np.ndarray:
        return self.expressions.values(self._whole(at))

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        result = self.expressions.jacobian(self._whole(at))
        return result[:, :, :self.n] + result[:, :, self.n:] @ self._slopes(at)

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        whole, Y = self._whole(at), self._slopes(at)
        H = self.expressions.hessian(whole, weights)
        on_outputs = np.einsum("ni,nij->nj", weights, self.expressions.jacobian(whole)[:, :, self.n:])
        cross = H[:, :self.n, self.n:] @ Y
        result = H[:, :self.n, :self.n] + cross + cross.transpose(0, 2, 1) + Y.transpose(0, 2, 1) @ H[:, self.n:, self.n:] @ Y
        given = np.hstack([np.zeros((len(at), self.module.metadata.sizes.u)), on_outputs])
        second = self._call(Curvature("outputs", tuple(self._by.sizes)).name, at, (self._by.whole, self._by.whole), given)
        result[:, self._at, self._at][:, *self._by.corner] += second[:, self._by.kept[:, None], self._by.kept]
        return np.asarray(result)

    def _whole(self, at: np.ndarray) -> np.ndarray:
        return np.hstack([at, self._call("outputs", at, (self.n_y,))])

    def _slopes(self, at: np.ndarray) -> np.ndarray:
        """Derivatives of the outputs by the arguments, (N, n_y, n); by the time where it is not prescribed."""
        result = np.zeros((len(at), self.n_y, self.n))
        parts = [self._call(derivative_of("outputs", by), at, (self.n_y, size)) for by, size in self._by.sizes.items()]
        result[:, :, self._at] = self._by.columns(np.concatenate(parts, axis=2))
        return result

    def _call(self, name: str, at: np.ndarray, shape: tuple[int, ...], given: Any = ()) -> np.ndarray:
        n_x, n_in, free = self.of.n_x, self.of.n_in, list(self.of.free)
        mine = at[:, self.first:]
        if free:
            self.p = self.p.copy()
            self.p[free] = mine[0, n_x + n_in:n_x + n_in + len(free)]
        try:
            result = self.module.evaluate(name, mine[:, -1], mine[:, :n_x], self.p, mine[:, n_x:n_x + n_in], given)
        except EvaluationError:
            return np.full((len(at), *shape), np.nan)
        return np.asarray(result).reshape(len(at), *shape)
