"""Proves equations of motion sound without a reference: identities that must hold at any state, at 30 digits.

A check is a function of a Sample that returns its residual, or None where it does not apply; a new formulation joins by
naming its quantities alike, a new check by one line in CHECKS.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath
import numpy as np

from symdyn.errors import EvaluationError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.model.symbols import time
from symdyn.runtime.arguments import some
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.tape import Tape


@dataclass(frozen=True)
class Check:
    """One identity: its largest residual over all states, relative to the size of its terms, and what is allowed."""

    name: str
    residual: float | None
    tolerance: float
    remark: str = ""

    @property
    def passed(self) -> bool | None:
        """None where the check does not apply."""
        return None if self.residual is None else bool(self.residual <= self.tolerance)


@dataclass(frozen=True)
class Verification:
    """All checks of one set of equations; prints as a table."""

    name: str
    states: int
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        return all(check.passed is not False for check in self.checks)

    def __str__(self) -> str:
        lines = [f"{self.name}: verified at {self.states} random states"]
        for c in self.checks:
            verdict = {True: "ok", False: "FAIL", None: "-"}[c.passed]
            figure = "" if c.residual is None else f"{c.residual:9.1e}  (allowed {c.tolerance:.0e})"
            lines.append(f"  {verdict:5}{c.name:62}{figure}{'  ' + c.remark if c.remark else ''}".rstrip())
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


class Sample:
    """A random state with the values of quantities there, at high precision."""

    def __init__(self, equations: Equations, values: Mapping[str, Any], digits: int, numbers: bool) -> None:
        self.equations = equations
        self.values = dict(values)
        self.digits = digits
        self.numbers = numbers
        self.n_u = len(equations.symbols.speeds)

    def has(self, *names: str) -> bool:
        return all(n in self.equations.quantities for n in names)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.at({})[name]

    def at(self, changes: Mapping[str, Any]) -> _Values:
        """Quantities at the state with some values changed."""
        return _Values(self, {**self.values, **changes})

    @cached_property
    def u(self) -> np.ndarray:
        return np.array([mpmath.mpf(self.values[s.name]) for s in self.equations.symbols.speeds], dtype=object)

    @cached_property
    def with_accelerations(self) -> _Values:
        names = [f"{s.name}_dot" for s in self.equations.symbols.speeds]
        return self.at(dict(zip(names, self["accelerations"], strict=True)))


class _Values:
    def __init__(self, sample: Sample, values: Mapping[str, Any]) -> None:
        self.sample = sample
        self.values = values

    def __getitem__(self, name: str) -> np.ndarray:
        return evaluate(self.sample.equations.tape(name), self.values, self.sample.digits)[name]


# -- the checks


def symmetric(s: Sample) -> float | None:
    if not s.has("M_tilde"):
        return None
    M = s["M_tilde"]
    return _relative(M - M.T, M)


def positive_definite(s: Sample) -> float | None:
    """Zero if it is; else how far the smallest eigenvalue is below zero, relative to the largest, but at least 1e-20."""
    if not s.numbers or not s.has("M_tilde"):
        return None
    values = mpmath.eigsy(mpmath.matrix(s["M_tilde"].tolist()), eigvals_only=True)
    smallest, largest = min(values), max(values)
    if largest <= 0:
        return 1.0
    return 0.0 if smallest > 1e-20 * largest else max(1e-20, float(-smallest / largest))


def equations_hold(s: Sample) -> float | None:
    if not s.has("M_tilde", "k_tilde", "F_tilde"):
        return None
    inertial = s["M_tilde"] @ s["accelerations"]
    k, F = s["k_tilde"], s["F_tilde"]
    return _relative(inertial + k - F, np.concatenate([inertial, k, F]))


def inverse_of_forward(s: Sample) -> float | None:
    return _relative(s.with_accelerations["inverse_dynamics"], np.concatenate([s["F_tilde"], s["k_tilde"]]))


def energy_balance(s: Sample) -> float | None:
    if not s.has("energy", "power"):
        return None
    eq = s.equations
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True))
    seeds.update(zip([eq.leaves[u] for u in eq.symbols.speeds], eq.quantity("accelerations"), strict=True))
    seeds[eq.leaves[time]] = 1
    rates = forward(eq.recorder, eq.quantity("energy").ravel().tolist(), seeds)
    tape = Tape.of(eq.recorder, rates=rates, power=eq.quantity("power"))
    found = evaluate(tape, s.values, s.digits)
    power = found["power"].ravel()[0]
    return _relative(np.array([sum(found["rates"]) - power]), np.array([*found["rates"], power, *s["energy"]]))


def kinetic_energy_quadratic(s: Sample) -> float | None:
    """T(u) + T(-u) - 2 T(0) = u^T M_tilde u"""
    quantity = "energy" if s.has("energy") else "kinetic_energy"
    if not s.has(quantity, "M_tilde"):
        return None
    names = [u.name for u in s.equations.symbols.speeds]
    T = [s.at({n: sign * s.values[n] for n in names})[quantity].ravel()[0] for sign in (1, -1, 0)]
    wanted = s.u @ s["M_tilde"] @ s.u
    return _relative(np.array([T[0] + T[1] - 2 * T[2] - wanted]), np.array([wanted]))


def jacobian_of_positions(s: Sample) -> float | None:
    """J u against central differences of positions and rotations along the motion, less what moves without u."""
    at_rest = {u.name: 0 for u in s.equations.symbols.speeds}
    wanted = s["J"] @ s.u if s.has("J", "rates") else None
    if wanted is None or not (s.has("r") or s.has("positions", "frames")):
        return None
    if s.has("r"):
        found = _difference(s, "r", {}) - _difference(s, "r", at_rest)
        return _relative(found - wanted, wanted)
    v = _difference(s, "positions", {}) - _difference(s, "positions", at_rest)
    omega = _angular(s, {}) - _angular(s, at_rest)
    rows = np.concatenate([v, omega], axis=1)
    found = (rows[:, [0, 1, 5]] if s.equations.planar else rows).ravel()
    return _relative(found - wanted, wanted)


def coriolis_times_speeds(s: Sample) -> float | None:
    if not s.has("coriolis", "k_tilde"):
        return None
    found = s["coriolis"] @ s.u
    return _relative(found - s["k_tilde"], found)


def coriolis_is_skew_with_mass_rate(s: Sample) -> float | None:
    """M_tilde_dot - 2 C, whose symmetric part must vanish, by the derivative of the tape along the motion."""
    if not s.has("coriolis", "M_tilde", "rates"):
        return None
    eq = s.equations
    M = eq.quantity("M_tilde")
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True))
    rate = np.array(forward(eq.recorder, M.ravel().tolist(), seeds), dtype=object).reshape(M.shape)
    found = evaluate(Tape.of(eq.recorder, rate=rate, C=eq.quantity("coriolis")), s.values, s.digits)
    return _relative(found["rate"] - found["C"] - found["C"].T, found["C"])


def _angular(s: Sample, changes: Mapping[str, Any]) -> np.ndarray:
    """Angular velocity of every body, n-frame, from the difference of its rotation: R_dot R^T = [omega x]."""
    R = s.at(changes)["frames"][:, 3:].reshape(-1, 3, 3)
    R_dot = _difference(s, "frames", changes)[:, 3:].reshape(-1, 3, 3)
    skew = [a @ b.T for a, b in zip(R_dot, R, strict=True)]
    return np.array([[w[2, 1], w[0, 2], w[1, 0]] for w in skew], dtype=object).reshape(-1, 3)


def _difference(s: Sample, quantity: str, values: Mapping[str, Any]) -> np.ndarray:
    """Central difference of a quantity by time along the motion with some values changed."""
    step = mpmath.mpf(10) ** (-s.digits // 3)
    rates = s.at(values)["rates"]
    ends = []
    for sign in (1, -1):
        moved = {q.name: mpmath.mpf(s.values[q.name]) + sign * step * rate
                 for q, rate in zip(s.equations.symbols.coordinates, rates, strict=True)}
        ends.append(s.at({**values, **moved, "t": mpmath.mpf(s.values["t"]) + sign * step})[quantity])
    return (ends[0] - ends[1]) / (2 * step)


def backend_agrees(backend: str) -> Callable[[Sample], float | None]:
    """The right-hand side of a compiled module against the tape at high precision, over the condition of M_tilde."""
    def check(s: Sample) -> float | None:
        eq = s.equations
        module = eq.compile(backend=backend)
        x = [s.values[n.name] for g in (eq.symbols.coordinates, eq.symbols.speeds, eq.symbols.states) for n in g]
        try:
            found = module.rhs(s.values["t"], x, [s.values[p.name] for p in eq.symbols.parameters],
                               [s.values[i.name] for i in eq.symbols.inputs])
        except EvaluationError:
            return float("inf") if s.numbers else None  # arbitrary parameters need not make a definite mass matrix
        M = s["M_tilde"].astype(float)
        condition = np.linalg.cond(M) if len(M) else 1.0
        exact = s["rhs"]
        return _relative(found - exact, exact) / max(1.0, condition)  # type: ignore[operator]
    return check


CHECKS: tuple[tuple[str, Callable[[Sample], float | None], float], ...] = (
    ("M_tilde is symmetric", symmetric, 1e-25),
    ("M_tilde is positive definite", positive_definite, 0.0),
    ("M_tilde u_dot + k_tilde = F_tilde", equations_hold, 1e-20),
    ("inverse dynamics of the accelerations gives zero", inverse_of_forward, 1e-20),
    ("rate of energy equals power of the loads", energy_balance, 1e-20),
    ("kinetic energy is quadratic in u with M_tilde", kinetic_energy_quadratic, 1e-20),
    ("J u is the rate of the positions and rotations", jacobian_of_positions, 1e-15),
    ("Coriolis matrix times u is k_tilde", coriolis_times_speeds, 1e-20),
    ("rate of M_tilde less twice the Coriolis matrix is skew", coriolis_is_skew_with_mass_rate, 1e-20),
)


def verify(equations: Equations, states: int = 5, digits: int = 30, params: Mapping[Any, float] | None = None,
           seed: int = 1) -> Verification:
    """Check equations at random states: coordinates, speeds, states, inputs in [-1, 1], t in [0, 1].

    params   numbers for parameters (by symbol or name); others take their default, else a number in [0.5, 1.5]; then
             the mass matrix need not be positive definite and is not tested for it
    Returns a Verification; its `passed` is False if a check failed.
    """
    from symdyn.runtime.compiler import find_compiler

    samples = _samples(equations, states, digits, params, seed)
    checks = [*CHECKS, ("NumPy module agrees with the tape, over the condition", backend_agrees("numpy"), 1e-13)]
    if find_compiler() is not None:
        checks.append(("C module agrees with the tape, over the condition", backend_agrees("c"), 1e-13))
    results = []
    for name, check, tolerance in checks:
        with mpmath.workdps(digits + 5):
            residuals = [check(s) for s in samples]
        known = [r for r in residuals if r is not None]
        remark = "" if known else ("parameters without numbers" if check is positive_definite else "does not apply")
        results.append(Check(name, max(known) if known else None, tolerance, remark))
    return Verification(f"{equations.name} ({equations.formulation})", states, tuple(results))


def _samples(equations: Equations, states: int, digits: int, params: Mapping[Any, float] | None, seed: int) -> list[Sample]:
    stream = random.Random(seed)
    symbols = equations.symbols
    given = {str(getattr(k, "name", k)): float(v) for k, v in symbols.defaults.items()}
    given |= some(params, [p.name for p in symbols.parameters], "parameters", equations.name)
    numbers = all(p.name in given for p in symbols.parameters)
    parameters = {p.name: given.get(p.name, stream.uniform(0.5, 1.5)) for p in symbols.parameters}
    samples: list[Sample] = []
    for _ in range(40 * states):
        if len(samples) == states:
            return samples
        values = {"t": stream.uniform(0, 1), **parameters}
        for group in (symbols.coordinates, symbols.speeds, symbols.states, symbols.inputs):
            values.update({s.name: stream.uniform(-1, 1) for s in group})
        values.update({f"{u.name}_dot": 0.0 for u in symbols.speeds})
        _on_unit_sphere(equations, values)
        sample = Sample(equations, values, digits, numbers)
        if _defined(sample):
            samples.append(sample)
    raise SymdynError(f"{equations.name}: the right-hand side is defined at {len(samples)} of {40 * states} random states only "
                      "(coordinates and speeds in [-1, 1]); check where its loads leave their domain, such as log, sqrt or a "
                      "division, and whether these parameters leave a joint without mass and inertia")


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


def _relative(difference: np.ndarray, terms: np.ndarray) -> float:
    """Largest entry of the difference over the largest of its terms."""
    size = max((abs(float(v)) for v in np.ravel(terms)), default=0.0)
    error = max((abs(float(v)) for v in np.ravel(difference)), default=0.0)
    return error / size if size > 0 else error
