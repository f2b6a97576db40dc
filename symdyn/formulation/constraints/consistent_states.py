"""States that fulfil the constraints, found in doubles on the tape, many at once, without generating code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.equations import Equations
from symdyn.tape.floats import evaluate_entries
from symdyn.turning import turns

ITERATIONS = 60
# Residuals as lengths, relative to the mechanism's, below this are zero.
FULFILLED = 1e-12
# Singular values below this part of the largest are left out of a step.
CUT = 1e-10


@dataclass(frozen=True)
class AtStates:
    """C (s, n_c), C_scale (s, n_c), length (s,), C_r (s, n_c, n_u), N (s, n_q, n_u) at s states."""

    C: np.ndarray
    C_scale: np.ndarray
    length: np.ndarray
    C_r: Sampled
    N: Sampled

    def __getitem__(self, states: np.ndarray) -> AtStates:
        return AtStates(*[getattr(self, f.name)[states] for f in fields(self)])


class ConstraintStates:
    """The constraints of equations in numbers: parameters by symbol, all other symbols but the coordinates zero, at a time t."""

    def __init__(self, equations: Equations, numbers: Mapping[Any, float], t: float = 0.0) -> None:
        symbols = equations.symbols
        self.tape = equations.tape("C", "C_r", "C_scale", "N", "length")
        self.names = [q.name for q in symbols.coordinates]
        self.values: dict[str, Any] = {p.name: float(numbers[p]) for p in symbols.parameters} | {"t": t}
        self.values |= {s.name: 0.0 for s in (*symbols.speeds, *symbols.states, *symbols.inputs)}
        self.holonomic = np.array(equations.holonomic, dtype=bool)
        self.units = [[self.names.index(q.name) for q in group] for group in equations.unit_groups]
        self.angular = np.array([turns(symbols.units.get(u)) for u in symbols.speeds], dtype=bool)

    def at(self, q: np.ndarray) -> AtStates:
        """Quantities at coordinates (s, n_q)."""
        entries = evaluate_entries(self.tape, {**self.values, **dict(zip(self.names, q.T, strict=True))}, len(q))
        C, scale, length = (entries[name].dense() for name in ("C", "C_scale", "length"))
        return AtStates(C, scale, length, Sampled.of_entries(entries["C_r"]), Sampled.of_entries(entries["N"]))

    def nearest(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From coordinates (s, n_q) the consistent ones nearby by Gauss-Newton, and the largest residual left, relative, (s,).

        Where there are none: those of least residual; inf where constraints are not defined.
        """
        best, least = q.copy(), np.full(len(q), np.inf)
        now, running = q.copy(), np.arange(len(q))
        for k in range(ITERATIONS + 1):
            result = self.at(now[running])
            residual = self.residual(result)
            size = np.abs(residual).max(axis=1, initial=0.0)
            defined = np.isfinite(size) & np.isfinite(result.C_r.values).all(axis=1)
            better = defined & (size < least[running])
            best[running[better]], least[running[better]] = now[running[better]], size[better]
            on = defined & (size >= FULFILLED)
            if k == ITERATIONS or not on.any():
                break
            running = running[on]
            now[running] += self._step(result[on], residual[on])
            self._normalise(now)
        return best, least

    def residual(self, result: AtStates) -> np.ndarray:
        """C C_scale / length, (s, n_c)."""
        return result.C * result.C_scale / result.length[:, None]

    def velocities(self, length: Any) -> np.ndarray:
        """Factors that make velocities (m/s) of the speeds, (n_u,)."""
        return np.where(self.angular, length, 1.0)

    def moved(self, result: AtStates, y: np.ndarray) -> np.ndarray:
        """Changes of the coordinates (s, n_q) for directions y (s, n_u) of the speeds as parts of the length."""
        length = result.length[:, None]
        return result.N.times(y * length / np.where(self.angular[None, :], length, 1.0))

    def scaled(self, result: AtStates) -> Sampled:
        """C_r, lengths by lengths."""
        return result.C_r.scaled(result.C_scale, np.where(self.angular[None, :], result.length[:, None], 1.0))

    def _step(self, result: AtStates, residual: np.ndarray) -> np.ndarray:
        y = -self.scaled(result).without_rows(~self.holonomic).least_change(residual, CUT)
        largest = np.abs(y).max(axis=1, initial=0.0)[:, None]
        return self.moved(result, y / np.maximum(largest, 1.0))  # at most about a radian at once

    def _normalise(self, q: np.ndarray) -> None:
        for indices in self.units:
            size = np.linalg.norm(q[:, indices], axis=1, keepdims=True)
            q[:, indices] /= np.where(size > 0, size, 1.0)
