"""Random states to check identities at; with constraints, states that fulfil them to all digits."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from symdyn.arguments import some
from symdyn.errors import SymdynError
from symdyn.formulation.constraints.consistent_states import ConstraintStates
from symdyn.formulation.equations import Equations
from symdyn.shown import name_of
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.evaluate import evaluate
from symdyn.tape.intrinsics import RANK
from symdyn.tape.tape import Tape
from symdyn.verification.sample import Sample

# Distances from the initial state at which coordinates are drawn; farther where no consistent state is near.
SPREADS = (0.3, 1.0, 2.0)
# Newton steps that take 12 digits to all.
STEPS = 5


def samples(equations: Equations, states: int, digits: int, params: Mapping[Any, float] | None, seed: int) -> list[Sample]:
    """Samples at random states. Raises SymdynError where too few states are defined, or consistent."""
    stream = random.Random(seed)
    symbols = equations.symbols
    given = {name_of(k): float(v) for k, v in symbols.defaults.items()}
    given |= some(params, [p.name for p in symbols.parameters], "parameters", equations.name)
    numbers = all(p.name in given for p in symbols.parameters)
    parameters = {p.name: given.get(p.name, stream.uniform(0.5, 1.5)) for p in symbols.parameters}
    manifold = _Manifold.of(equations, parameters) if equations.constraints else None
    result: list[Sample] = []
    for attempt in range(40 * states):
        if len(result) == states:
            return result
        values = {"t": stream.uniform(0, 1), **parameters}
        for group in (symbols.coordinates, symbols.speeds, symbols.states, symbols.inputs):
            # Elastic coordinates stay as small together as one of them may be: beyond, a kinetic energy to second order is none.
            values.update({s.name: symbols.reach.get(s, 1) / (len(symbols.reach) if s in symbols.reach else 1)
                           * stream.uniform(-1, 1) for s in group})
        values.update({f"{u.name}_dot": 0.0 for u in symbols.speeds})
        independent: tuple[int, ...] = ()
        if manifold is None:
            _on_unit_sphere(equations, values)
        else:
            reached = manifold.reach(values, SPREADS[attempt % len(SPREADS)], digits)
            if reached is None:
                continue
            independent = reached
        sample = Sample(equations, values, digits, numbers, independent)
        if _defined(sample):
            result.append(sample)
    if manifold is not None:
        raise SymdynError(f"{equations.name}: {len(result)} of {40 * states} searches near the initial state ended at a "
                          "consistent state where the right-hand side is defined; give an initial state near one, and numbers "
                          "to all parameters (defaults, or params) that the mechanism can be assembled with")
    raise SymdynError(f"{equations.name}: the right-hand side is defined at {len(result)} of {40 * states} random states only "
                      "(coordinates and speeds in [-1, 1]); check where its loads leave their domain, such as log, sqrt or a "
                      "division, and whether these parameters leave a joint without mass and inertia")


@dataclass(frozen=True)
class _Manifold:
    """The constraints, and their derivatives by differentiation of the tape alone, which owe nothing to the rows' formulas.

    newton   C (n_c,), its derivative by unit speeds J, C_scale, N, length, of which those of velocity constraints are zero
    speeds   C_dot (n_c,) and its derivative by the speeds
    """

    equations: Equations
    doubles: ConstraintStates
    newton: Tape
    speeds: Tape

    @classmethod
    def of(cls, equations: Equations, parameters: Mapping[str, float]) -> _Manifold:
        recorder, leaves, symbols = equations.recorder, equations.leaves, equations.symbols
        C, N = equations.quantity("C"), equations.quantity("N")
        by_q = np.array([forward(recorder, C.tolist(), {leaves[q]: 1}) for q in symbols.coordinates], dtype=object).T
        newton = Tape.of(recorder, C=C, C_r=by_q.reshape(len(C), len(N)) @ N, C_scale=equations.quantity("C_scale"), N=N,
                         length=equations.quantity("length"))
        C_dot = equations.quantity("C_dot")
        by_u = jacobian(recorder, C_dot.tolist(), [leaves[u] for u in symbols.speeds], "forward")
        doubles = ConstraintStates(equations, {p: parameters[p.name] for p in symbols.parameters})
        doubles.tape = newton
        return cls(equations, doubles, newton, Tape.of(recorder, C_dot=C_dot, C_r=by_u))

    def reach(self, values: dict[str, Any], spread: float, digits: int) -> tuple[int, ...] | None:
        """Move coordinates and speeds onto the constraints; returns rows that imply the others, None if it did not work."""
        symbols = self.equations.symbols
        names = [q.name for q in symbols.coordinates]
        start = np.array([[float(symbols.initial.get(q, 0.0)) + spread * values[q.name] for q in symbols.coordinates]])
        self.doubles.values.update({name: values[name] for name in ("t", *[s.name for s in symbols.inputs])})
        q, residual = self.doubles.nearest(start)
        if not residual[0] < 1e-11:
            return None
        values.update(zip(names, map(float, q[0]), strict=True))
        with mpmath.workdps(digits + 10):
            _on_unit_sphere(self.equations, values)
            rows = self._positions(values, names, digits + 10)
            return None if rows is None else self._velocities(values, digits + 10)

    def _positions(self, values: dict[str, Any], names: list[str], digits: int) -> list[int] | None:
        holonomic = np.flatnonzero(self.equations.holonomic)
        if not len(holonomic):
            return []
        result = evaluate(self.newton, values, digits)
        rows = [int(holonomic[k]) for k in _independent(result["C_r"][holonomic])]
        for _ in range(STEPS):
            dq = result["N"] @ _least(result["C_r"][rows], -result["C"][rows])
            values.update({name: mpmath.mpf(values[name]) + d for name, d in zip(names, dq, strict=True)})
            _on_unit_sphere(self.equations, values)
            result = evaluate(self.newton, values, digits)
        left = max(abs(c * s) for c, s in zip(result["C"], result["C_scale"], strict=True))
        return rows if left < result["length"].item() * mpmath.mpf(10) ** (8 - digits) else None

    def _velocities(self, values: dict[str, Any], digits: int) -> tuple[int, ...]:
        names = [u.name for u in self.equations.symbols.speeds]
        result = evaluate(self.speeds, values, digits)
        rows = _independent(result["C_r"])
        for _ in range(2):  # twice for the last digits
            du = _least(result["C_r"][rows], -result["C_dot"][rows])
            values.update({name: mpmath.mpf(values[name]) + d for name, d in zip(names, du, strict=True)})
            result = evaluate(self.speeds, values, digits)
        return tuple(rows)


def _least(J: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The smallest y with J y = right, for independent rows."""
    if not len(J):
        return np.zeros(J.shape[1], dtype=object)
    z = mpmath.lu_solve(mpmath.matrix((J @ J.T).tolist()), mpmath.matrix(list(right)))
    return J.T @ np.array(list(z), dtype=object)  # type: ignore[no-any-return]


def _independent(J: np.ndarray) -> list[int]:
    """Rows that imply the others."""
    from scipy.linalg import qr

    A = J.astype(float)
    size = np.linalg.norm(A, axis=1, keepdims=True)
    A = A / np.where(size > 0, size, 1.0)
    rank = int((np.linalg.svd(A, compute_uv=False) > RANK).sum())
    return sorted(int(k) for k in qr(A.T, pivoting=True, mode="r")[1][:rank])


def _defined(sample: Sample) -> bool:
    """Whether the right-hand side is a finite real number at the state."""
    try:
        return all(np.isfinite(float(v)) for v in sample["rhs"].ravel())
    except (TypeError, ValueError, ArithmeticError):
        return False


def _on_unit_sphere(equations: Equations, values: dict[str, Any]) -> None:
    """Euler parameters have unit norm, to all digits."""
    for group in equations.unit_groups:
        parts = [mpmath.mpf(values[q.name]) for q in group]
        with mpmath.workdps(60):
            length = mpmath.sqrt(sum(p * p for p in parts))
            values.update({q.name: p / length for q, p in zip(group, parts, strict=True)})
