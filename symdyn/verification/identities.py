"""Identities that equations of motion fulfil at any state. A check returns its residual, or None where it does not apply."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import numpy as np

from symdyn.errors import EvaluationError
from symdyn.formulation.algebra import given_by_time
from symdyn.tape.differentiate import forward
from symdyn.tape.tape import Tape
from symdyn.verification.sample import Sample, difference, relative


def symmetric(s: Sample) -> float | None:
    if not s.has("M_tilde"):
        return None
    M = s["M_tilde"]
    return relative(M - M.T, M)


def positive_definite(s: Sample) -> float | None:
    """Zero if it is, along the motions that constraints leave; else how far the smallest eigenvalue is below zero, relative to
    the largest, but at least 1e-20."""
    if not s.numbers or not s.has("M_tilde"):
        return None
    M = s["M_tilde"]
    if s.equations.constraints:
        Z = left_free(s)
        M = Z.T @ M @ Z
    if not len(M):
        return None
    values = mpmath.eigsy(mpmath.matrix(M.tolist()), eigvals_only=True)
    smallest, largest = min(values), max(values)
    if largest <= 0:
        return 1.0
    return 0.0 if smallest > 1e-20 * largest else max(1e-20, float(-smallest / largest))


def equations_hold(s: Sample) -> float | None:
    """M_tilde u_dot + k_tilde = F_tilde - C_r^T lam"""
    if not s.has("M_tilde", "k_tilde", "F_tilde"):
        return None
    inertial, forced = s["M_tilde"] @ s["accelerations"], s.constraint_force()
    k, F = s["k_tilde"], s["F_tilde"]
    return relative(inertial + k - F - forced, np.concatenate([inertial, k, F, forced]))


def inverse_of_forward(s: Sample) -> float | None:
    """inverse_dynamics(u_dot) = -C_r^T lam; at other accelerations M_tilde u_dot + k_tilde - F_tilde, if there are these."""
    forced = s.constraint_force()
    size = np.concatenate([s["F_tilde"], s["k_tilde"], forced])
    residual = relative(s.with_accelerations["inverse_dynamics"] - forced, size)
    if not s.has("M_tilde", "k_tilde", "F_tilde"):
        return residual
    given = np.array([mpmath.sin(3 * k + 1) for k in range(s.n_u)], dtype=object)
    names = [f"{u.name}_dot" for u in s.equations.symbols.speeds]
    result = s.at(dict(zip(names, given, strict=True)))["inverse_dynamics"]
    inertial = s["M_tilde"] @ given
    other = relative(result - (inertial + s["k_tilde"] - s["F_tilde"]), np.concatenate([inertial, s["k_tilde"], s["F_tilde"]]))
    return max(residual, other)


def pages_of_links(s: Sample) -> float | None:
    """Inverse dynamics at given accelerations, and accelerations, by the recursions that pages of links show, in spatial vectors,
    against those that code is made from."""
    if not s.has("page_inverse_dynamics"):
        return None
    given = s.at({f"{u.name}_dot": mpmath.sin(3 * k + 1) for k, u in enumerate(s.equations.symbols.speeds)})
    wanted = given["inverse_dynamics"]
    residual = relative(given["page_inverse_dynamics"] - wanted, np.concatenate([wanted, s["F_tilde"], s["k_tilde"]]))
    if not s.has("page_accelerations"):
        return residual
    return max(residual, relative(s["page_accelerations"] - s["accelerations"], s["accelerations"]))


def energy_balance(s: Sample) -> float | None:
    if not s.has("energy", "power"):
        return None
    eq = s.equations
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True))
    seeds.update(zip([eq.leaves[u] for u in eq.symbols.speeds], eq.quantity("accelerations"), strict=True))
    seeds.update(given_by_time(eq.leaves))
    rates = forward(eq.recorder, eq.quantity("energy").ravel().tolist(), seeds)
    tape = Tape.of(eq.recorder, rates=rates, power=eq.quantity("power"))
    result = s.evaluate(tape)
    power = result["power"].ravel()[0]
    return relative(np.array([sum(result["rates"]) - power]), np.array([*result["rates"], power, *s["energy"]]))


def kinetic_energy_quadratic(s: Sample) -> float | None:
    """T(u) + T(-u) - 2 T(0) = u^T M_tilde u"""
    quantity = "energy" if s.has("energy") else "kinetic_energy"
    if not s.has(quantity, "M_tilde"):
        return None
    names = [u.name for u in s.equations.symbols.speeds]
    T = [s.at({n: sign * s.values[n] for n in names})[quantity].ravel()[0] for sign in (1, -1, 0)]
    wanted = s.u @ s["M_tilde"] @ s.u
    return relative(np.array([T[0] + T[1] - 2 * T[2] - wanted]), np.array([wanted]))


def jacobian_of_positions(s: Sample) -> float | None:
    """J u against central differences of positions and rotations along the motion, less what moves without u."""
    at_rest = {u.name: 0 for u in s.equations.symbols.speeds}
    wanted = s["J"] @ s.u if s.has("J", "rates") else None
    if wanted is None or not (s.has("r") or s.has("positions", "frames")):
        return None
    if s.has("r"):
        result = difference(s, "r", {}) - difference(s, "r", at_rest)
        return relative(result - wanted, wanted)
    v = difference(s, "positions", {}) - difference(s, "positions", at_rest)
    omega = angular_velocities(s, {}) - angular_velocities(s, at_rest)
    rows = np.concatenate([v, omega], axis=1)
    result = (rows[:, [0, 1, 5]] if s.equations.planar else rows).ravel()
    return relative(result - wanted, wanted)


def coriolis_times_speeds(s: Sample) -> float | None:
    if not s.has("coriolis", "k_tilde"):
        return None
    result = s["coriolis"] @ s.u
    return relative(result - s["k_tilde"], result)


def coriolis_is_skew_with_mass_rate(s: Sample) -> float | None:
    """M_tilde_dot - 2 C, whose symmetric part must vanish, by the derivative of the tape along the motion."""
    if not s.has("coriolis", "M_tilde", "rates"):
        return None
    eq = s.equations
    M = eq.quantity("M_tilde")
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True))
    rate = np.array(forward(eq.recorder, M.ravel().tolist(), seeds), dtype=object).reshape(M.shape)
    result = s.evaluate(Tape.of(eq.recorder, rate=rate, C=eq.quantity("coriolis")))
    return relative(result["rate"] - result["C"] - result["C"].T, result["C"])


def angular_velocities(s: Sample, changes: Mapping[str, Any]) -> np.ndarray:
    """Angular velocity of every body, n-frame, from the difference of its rotation: R_dot R^T = [omega x]."""
    R = s.at(changes)["frames"][:, 3:].reshape(-1, 3, 3)
    R_dot = difference(s, "frames", changes)[:, 3:].reshape(-1, 3, 3)
    skew = [a @ b.T for a, b in zip(R_dot, R, strict=True)]
    return np.array([[w[2, 1], w[0, 2], w[1, 0]] for w in skew], dtype=object).reshape(-1, 3)


def backend_agrees(backend: str) -> Callable[[Sample], float | None]:
    """Error of a compiled module against the tape at high precision, over the condition of M_tilde or the whole system."""
    def check(s: Sample) -> float | None:
        eq = s.equations
        module = eq.compile(backend=backend)
        x = [float(s.values[n.name]) for g in (eq.symbols.coordinates, eq.symbols.speeds, eq.symbols.states) for n in g]
        p, inputs = ([float(s.values[n.name]) for n in g] for g in (eq.symbols.parameters, eq.symbols.inputs))
        matrix = _whole(s)[0].astype(float) if eq.constraints else s["M_tilde"].astype(float)
        condition = max(1.0, np.linalg.cond(equilibrated(matrix))) if len(matrix) else 1.0
        try:
            result = module.evaluate("rhs", float(s.values["t"]), x, p, inputs)
            lam = module.evaluate("lam", float(s.values["t"]), x, p, inputs) if eq.constraints else np.zeros(0)
        except EvaluationError:
            return float("inf") if s.numbers else None  # arbitrary parameters need not make a definite mass matrix
        residual = relative(result - s["rhs"], s["rhs"])
        if len(lam):
            terms = s["C_r"].T * lam  # where rows depend on each other only the sums are unique
            size = np.concatenate([terms.ravel(), s["F_tilde"], s["k_tilde"]])
            residual = max(residual, relative(terms.sum(axis=1) + s.constraint_force(), size))
        return residual / condition  # type: ignore[no-any-return]
    return check


def equilibrated(matrix: np.ndarray) -> np.ndarray:
    """A symmetric matrix with rows and columns scaled, so that units do not count."""
    if len(matrix) and (np.diagonal(matrix) > 0).all():
        return matrix
    for _ in range(10):
        size = np.sqrt(np.abs(matrix).max(axis=1))
        size = np.where(size > 0, size, 1.0)
        matrix = matrix / size[:, None] / size[None, :]
    return matrix


# -- with constraints


def left_free(s: Sample) -> np.ndarray:
    """Columns: motions that the constraints leave, (n_u, n)."""
    C_r = s["C_r"][s.independent]
    n_c, n_u = C_r.shape
    from scipy.linalg import qr

    order = [int(k) for k in qr(C_r.astype(float), pivoting=True, mode="r")[1]] if n_c else list(range(n_u))
    dependent, free = order[:n_c], order[n_c:]
    Z = np.zeros((n_u, len(free)), dtype=object)
    for index, k in enumerate(free):
        Z[k, index] = mpmath.mpf(1)
    if n_c and free:
        Z[dependent] = -solved(C_r[:, dependent], C_r[:, free])
    return Z


def solved(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A^-1 B at high precision; B (n, m)."""
    columns = [list(mpmath.lu_solve(mpmath.matrix(A.tolist()), mpmath.matrix(list(B[:, k])))) for k in range(B.shape[1])]
    return np.array(columns, dtype=object).T.reshape(B.shape)


def constraints_hold(s: Sample) -> float | None:
    """C_r u_dot = F_d"""
    terms = s["C_r"] * s["accelerations"]
    return relative(terms.sum(axis=1) - s["F_d"], np.concatenate([terms.ravel(), s["F_d"]]))


def constraint_rates(s: Sample) -> float | None:
    """C_dot = C_r u + C_t, at speeds that do not fulfil the constraints."""
    here = s.at(_other_speeds(s))
    u = np.array([here.values[v.name] for v in s.equations.symbols.speeds], dtype=object)
    terms = here["C_r"] * u
    return relative(here["C_dot"] - terms.sum(axis=1) - here["C_t"], terms)


def constraint_rates_are_derivatives(s: Sample) -> float | None:
    """C_dot of position constraints against central differences of C, at speeds that do not fulfil the constraints."""
    rows = np.array(s.equations.holonomic, dtype=bool)
    if not rows.any():
        return None
    changes = _other_speeds(s)
    wanted = s.at(changes)["C_dot"][rows]
    return relative(difference(s, "C", changes)[rows] - wanted, wanted)


def constraints_stay(s: Sample) -> float | None:
    """C_ddot = 0: central differences of C_dot along the motion, against its terms."""
    return relative(difference(s, "C_dot", {}, accelerating=True), s["C_r"] * s["accelerations"])


def whole_system(s: Sample) -> float | None:
    """Accelerations and constraint forces against those of the whole system [[M, C_r^T], [C_r, 0]], solved with pivoting, of
    the statements and of the numeric algorithm."""
    matrix, right = _whole(s)
    result = solved(matrix, right[:, None])[:, 0]
    ud = result[:s.n_u]
    forced = -(s["C_r"][s.independent].T @ result[s.n_u:]) if s.independent else np.zeros(s.n_u, dtype=object)
    residuals = []
    ways = [s] if s.equations.singular_fallback is None else [s, s.of(s.equations.singular_fallback)]
    for way in ways:
        residuals += [relative(way["accelerations"] - ud, ud),
                      relative(-(way["C_r"].T @ way["lam"]) - forced, np.concatenate([forced, s["F_tilde"], s["k_tilde"]]))]
    return max(residuals)


def _whole(s: Sample) -> tuple[np.ndarray, np.ndarray]:
    """The matrix and the right side, with independent rows only."""
    M, C_r = s["M_tilde"], s["C_r"][s.independent]
    n_c = len(C_r)
    matrix = np.block([[M, C_r.T], [C_r, np.zeros((n_c, n_c), dtype=object)]])
    return matrix, np.concatenate([s["F_tilde"] - s["k_tilde"], s["F_d"][s.independent]])


def _other_speeds(s: Sample) -> dict[str, Any]:
    """Speeds that are not those of the sample, as large as these."""
    size = max([abs(v) for v in s.u], default=mpmath.mpf(0)) or mpmath.mpf(1)
    return {u.name: size * mpmath.sin(3 * k + 1) for k, u in enumerate(s.equations.symbols.speeds)}
