"""Resets that constraints carry on, on the way back: what was reset and all that follows from it, and their derivatives.

The nearest speeds in the metric of the mass matrix are differentiated at the impulses that make them, see
symdyn.formulation.sensitivities; the same in C: templates/c/runtime/resets.h.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.integrating.stabilization import ProjectionFailed, Projector, not_smooth
from symdyn.runtime.integrating.way_back import Way
from symdyn.thresholds import FREE, GAP, GAP_OF_ALL, OFF

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


@dataclass(frozen=True)
class CarriedOn:
    """A reset: the time, the state that it asks for, and that on the constraints, (n_x,); the entries that it holds."""

    projector: Projector
    t: float
    wanted: np.ndarray
    after: np.ndarray
    indices: tuple[int, ...]

    @classmethod
    def of(cls, module: Module, t: float, wanted: np.ndarray, p: np.ndarray, indices: Sequence[int]) -> CarriedOn:
        """The reset to a state on the constraints. Raises EvaluationError where they do not allow it."""
        projector = Projector(module, p)
        try:
            after = projector.keeping(t, wanted, indices)
        except ProjectionFailed as error:
            raise EvaluationError(f"{module.name}: at t = {t:.9g} s {error}") from None
        return cls(projector, t, wanted, after, tuple(k for k in sorted(indices) if k < projector.n_q + projector.n_u))

    def carried(self, way: Way, along: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Derivatives of the state after it: along, (n_x, n_x + 1 + n_carried), those of what it asks for by the state before,
        the time, and what is carried; slope: of the state after it. Raises EvaluationError where there are none.
        """
        module, n_q, n_x, n_others = way.module, self.projector.n_q, len(self.after), len(way.carried)
        middle = n_q + self.projector.n_u
        later, others = np.zeros(along.shape[1]), np.zeros((n_others, along.shape[1]))
        later[n_x] = 1.0
        others[:, n_x + 1:] = np.eye(n_others)
        directions, rows = self._directions(module)
        result = along.copy()
        # Coordinates at a given time, which is what the projection takes.
        onto = np.array([way.weights("corrected_weights", self.t, self.after, row) for row in np.eye(n_x)[:n_q]])
        fixed = along - np.outer(slope, later)
        result[:n_q] = onto[:, :n_x] @ fixed + onto[:, n_x:] @ others + np.outer(slope[:n_q], later)
        held = [k for k in self.indices if k < n_q]
        self._demand_ends(module, onto[:, :n_q], directions[[rows[k] for k in held]], held)
        result[:middle] += self._closing(directions, rows, held, (along - result)[held])
        # Speeds at given impulses.
        held = [k for k in self.indices if k >= n_q]
        jump, impulses = self._impulses(directions, rows, held)
        for k, column in enumerate(np.vstack([result[:n_q], along[n_q:]]).T):
            given = [name in way.carried for name in (*module.metadata.inputs, *module.metadata.parameters)]
            by = [others[way.carried.index(name), k] if there else 0.0 for name, there in
                  zip((*module.metadata.inputs, *module.metadata.parameters), given, strict=True)]
            ud = np.concatenate([jump, impulses, [later[k]], column, by])
            inputs = way.request.inputs.rows(np.array([self.t]), self.after[None, :])[0]
            result[n_q:middle, k] = module.evaluate("carried_variation", self.t, self.after, way.request.p, inputs, ud)
        result[:middle] += self._closing(directions, rows, held, (along - result)[held])
        self._demand_held(module, along, result)
        return result

    def _directions(self, module: Module) -> tuple[np.ndarray, dict[int, int]]:
        """The function reset_directions at the state, and the row of each entry."""
        middle = self.projector.n_q + self.projector.n_u
        known = sorted({k for event in module.metadata.events for k in event.reset if k < middle})
        return self.projector.directions(self.t, self.after), {k: row for row, k in enumerate(known)}

    def _impulses(self, directions: np.ndarray, rows: dict[int, int], held: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Jumps of the speeds, and what was needed along the entries that are held, of all rows."""
        n_q, middle = self.projector.n_q, self.projector.n_q + self.projector.n_u
        free = self.after.copy()
        free[n_q:middle] = self.wanted[n_q:middle]
        free = self.projector(self.t, free)
        impulses = np.zeros(len(directions))
        if held:
            own = [rows[k] for k in held]
            impulses[own] = self.projector.impulses(directions[own], held, (self.after - free)[held])
        return (self.after - self.wanted)[n_q:middle], impulses

    def _closing(self, directions: np.ndarray, rows: dict[int, int], held: Sequence[int], gaps: np.ndarray) -> np.ndarray:
        """The changes of [q; u] that close gaps, (n_q + n_u, n)."""
        if not held:
            return np.zeros((directions.shape[1], gaps.shape[1]))
        own = directions[[rows[k] for k in held]]
        result: np.ndarray = own.T @ self.projector.impulses(own, held, gaps)
        return result

    def _demand_ends(self, module: Module, onto: np.ndarray, directions: np.ndarray, held: Sequence[int]) -> None:
        """Raises EvaluationError where coordinates off the constraints come back on a way of their own: what is held leaves
        others free."""
        n_q, sizes = self.projector.n_q, self.projector.lengths
        off = np.abs((self.after - self.wanted)[:n_q] * sizes).max(initial=0.0)
        if off <= OFF * max(self.projector.length, np.abs(self.after[:n_q] * sizes).max(initial=0.0)):
            return
        left = onto / sizes
        if held:
            left = left - directions[:, :n_q].T @ self.projector.impulses(directions, held, left[held])
        if np.abs((left.T * sizes).T).max(initial=0.0) > FREE:
            raise EvaluationError(f"{module.name}: at t = {self.t:.9g} s {not_smooth('')}")

    def _demand_held(self, module: Module, along: np.ndarray, result: np.ndarray) -> None:
        """Raises EvaluationError where what is held does not change as the reset does."""
        n_q, middle = self.projector.n_q, self.projector.n_q + self.projector.n_u
        sizes = np.maximum(np.abs(along), np.abs(result))[:middle]
        for k in self.indices:
            size = sizes[:n_q] if k < n_q else sizes[n_q:]
            if (np.abs(along[k] - result[k]) > np.maximum(GAP * size.max(axis=0), GAP_OF_ALL * sizes.max())).any():
                raise EvaluationError(f"{module.name}: at t = {self.t:.9g} s {not_smooth(module.metadata.x[k])}")
