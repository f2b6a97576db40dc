"""References for rounding errors: values at 32 digits, condition numbers, the sizes of what is added up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np

from symdyn.formulation.names import outputs_in
from symdyn.functions.tapes import function_tape, tape_as_derived
from symdyn.precision.program import Lost, program
from symdyn.stress.system_under_test import EPS, SystemUnderTest
from symdyn.tape.intrinsics import DAMPED, ROUNDS, SMOOTHED
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape, unsigned
from symdyn.verification.identities import equilibrated

DIGITS = 32
# Singular values of the scaled Jacobian below this part of the usual belong to constraints that depend on others but for
# rounding errors.
DEPENDENT = 1e-12
CORRECTIONS = ("position_correction", "velocity_correction")
FORCES = ("k_tilde", "F_tilde", "inverse_dynamics")
# Functions that may depend on accelerations and multipliers; whether it does is seen on its tape.
MAY_DEPEND = ("outputs", "reactions", "cut_loads", "power")


def exact(tested: SystemUnderTest, name: str, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, ud: np.ndarray,
          params: np.ndarray | None = None) -> list[list[mpmath.mpf] | None]:
    """A function at rows of states with 32 digits, all numbers taken as the binary ones they are; None where it is undefined."""
    context = _precise()
    fixed, free = _fixed(tested, params), free_leaves(tested)
    rows = [[context.mpf(float(v)) for v in row] for row in np.column_stack([t, x, inputs, ud])]
    programs = [program(function_tape(tested.equations, name), context, fixed, free)]
    result: list[list[mpmath.mpf] | None] = []
    for row in rows:
        try:
            result.append(programs[0](row))
        except (Lost, ValueError, TypeError, ZeroDivisionError):
            result.append(_in_fallback(tested, name, context, fixed, free, programs, row))
    return result


def exactly_as_written(tested: SystemUnderTest, tape: Tape, rows: np.ndarray,
                       params: np.ndarray | None = None) -> list[list[mpmath.mpf] | None]:
    """A tape with 32 digits at rows of its free leaves, (n, n_free); None where it is undefined."""
    context = _precise()
    run = program(tape, context, _fixed(tested, params), free_leaves(tested))
    result: list[list[mpmath.mpf] | None] = []
    for row in rows:
        try:
            result.append(run([context.mpf(float(v)) for v in row]))
        except (Lost, ValueError, TypeError, ZeroDivisionError):
            result.append(None)
    return result


def halves(rows: Sequence[list[mpmath.mpf] | None], size: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers with 32 digits as sums of two doubles, each (n, size); NaN in rows that are None."""
    hi, lo = np.full((len(rows), size), np.nan), np.zeros((len(rows), size))
    for k, row in enumerate(rows):
        if row is not None:
            hi[k] = [float(v) for v in row]
            lo[k] = [float(v - h) for v, h in zip(row, hi[k].tolist(), strict=True)]
    return hi, lo


def free_leaves(tested: SystemUnderTest) -> list[str]:
    """Names of time, coordinates, speeds, states, inputs and given accelerations."""
    symbols = tested.symbols
    return ["t", *[s.name for group in (symbols.coordinates, symbols.speeds, symbols.states, symbols.inputs) for s in group],
            *[f"{s.name}_dot" for s in symbols.speeds]]


def leaves(tested: SystemUnderTest, rows: np.ndarray, params: np.ndarray | None = None) -> dict[str, Any]:
    """Every leaf of a tape by name, from rows of the free ones: arrays (n,), and numbers for parameters."""
    return {**_fixed(tested, params), **dict(zip(free_leaves(tested), rows.T, strict=True))}


def _precise() -> Any:
    context = mpmath.mp.clone()
    context.dps = DIGITS
    return context


def _fixed(tested: SystemUnderTest, params: np.ndarray | None) -> dict[str, float]:
    values = tested.params if params is None else params
    return {s.name: v for s, v in zip(tested.symbols.parameters, values.tolist(), strict=True)}


def _in_fallback(tested: SystemUnderTest, name: str, context: Any, fixed: dict[str, float], free: Sequence[str], programs: list,
                 row: list) -> list[mpmath.mpf] | None:
    """By the equations for states where what the usual ones divide by vanishes."""
    if tested.equations.singular_fallback is None:
        return None
    if len(programs) == 1:
        programs.append(program(tested.equations.singular_fallback.tape(name), context, fixed, free)
                        if name in tested.equations.singular_fallback.quantities else None)
    try:
        return None if programs[1] is None else programs[1](row)
    except (Lost, ValueError, TypeError, ZeroDivisionError):
        return None


# -- what is solved for


def solved(tested: SystemUnderTest, name: str) -> bool:
    """Whether a function's values come from solving for accelerations, multipliers or corrections."""
    if name in ("rhs", "lam", *CORRECTIONS):
        return True
    if name not in MAY_DEPEND:
        return False
    n_q, n_u = len(tested.symbols.coordinates), len(tested.symbols.speeds)
    result = list(tested.equations.quantity("rhs").ravel())[n_q:n_q + n_u]
    if tested.has("lam"):
        result += list(tested.equations.quantity("lam").ravel())
    unknown = {unsigned(e) for e in result if isinstance(unsigned(e), Node) and unsigned(e).op != "leaf"}
    return not unknown.isdisjoint(tape_as_derived(tested.equations, name).steps)


def conditions(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray, params: np.ndarray | None = None, scaled: bool = True,
               gradients: bool = True) -> np.ndarray:
    """Condition of the mass matrix, or of the mass matrix bordered by the constraints, with rows and columns scaled or in plain
    numbers, (n,); of constraints that depend on others without those.

    gradients   count small gradients of constraints, too, which scaling takes away: they make multipliers large
    """
    if not tested.has("mass_matrix"):
        return np.ones(len(x))
    n = len(tested.symbols.speeds)
    M = tested.evaluate("mass_matrix", t, x, params).reshape(-1, n, n)
    if not tested.constrained:
        return np.array([_condition(_by_diagonal(m) if scaled else m) for m in M])
    C = tested.evaluate("C_r", t, x, params).reshape(len(M), -1, n)
    whole = np.zeros((len(M), n + C.shape[1], n + C.shape[1]))
    whole[:, :n, :n], whole[:, n:, :n], whole[:, :n, n:] = M, C, C.transpose(0, 2, 1)
    values = _singular_values(tested, t, x, params)
    result = np.array([_condition(equilibrated(w) if scaled else w, int((v <= DEPENDENT).sum()))
                       for w, v in zip(whole, values, strict=True)])
    if not gradients:
        return result
    return result * [max(1.0, 1 / v[v > DEPENDENT][-1]) if (v > DEPENDENT).any() else np.inf for v in values]


def _singular_values(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray, params: np.ndarray | None) -> np.ndarray:
    """Singular values of the constraints' Jacobian with rows as lengths, over the usual largest, (n, m)."""
    n = len(tested.symbols.speeds)
    J = tested.evaluate("C_r", t, x, params).reshape(len(x), -1, n)
    J = J * tested.evaluate("C_scale", t, x, params)[:, :, None]
    sizes = np.array([np.linalg.svd(j, compute_uv=False) if np.isfinite(j).all() else np.zeros(min(j.shape)) for j in J])
    # Relative to the usual: a row whose gradient nearly vanishes costs digits, one that depends on others does not count.
    return np.pad(sizes / max(float(np.median(sizes[:, 0])), 1e-300), ((0, 0), (0, J.shape[1] - sizes.shape[1])))


def redundant(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray) -> bool:
    """Whether some constraints depend on others at states on them, (n, n_x)."""
    return bool((_singular_values(tested, t, x, None) <= DEPENDENT).any())


def smoothed(tested: SystemUnderTest, name: str, t: np.ndarray, x: np.ndarray, params: np.ndarray | None = None) -> np.ndarray:
    """Whether states are at positions of lost rank, or so near that the smoothing there is larger than rounding errors, (n,).

    Regularized with e and iterated, a singular value s keeps the part (1 + s^2 / e^2)^-ROUNDS of its error; see
    symdyn.tape.intrinsics.
    """
    if not tested.constrained or not solved(tested, name):
        return np.zeros(len(x), dtype=bool)
    below = (DAMPED if name in CORRECTIONS else SMOOTHED) * EPS ** (-0.5 / ROUNDS)
    values = _singular_values(tested, t, x, params)
    rank = (values > DEPENDENT).sum(axis=1)
    return np.any((values > DEPENDENT) & (values < below), axis=1) | (rank < rank.max())  # type: ignore[no-any-return]


def _by_diagonal(matrix: np.ndarray) -> np.ndarray:
    """A mass matrix with ones on its diagonal."""
    size = np.sqrt(np.abs(np.diagonal(matrix)))
    size = np.where(size > 0, size, 1.0)
    return matrix / size[:, None] / size[None, :]


def _condition(matrix: np.ndarray, without: int = 0) -> float:
    """Condition of a matrix without so many of its smallest singular values."""
    if not np.isfinite(matrix).all():
        return float("nan")
    if not len(matrix):
        return 1.0
    values = np.linalg.svd(matrix, compute_uv=False)
    last = values[len(values) - 1 - without]
    return float(values[0] / last) if last > 0 else float("inf")


# -- sizes


def together(tested: SystemUnderTest, name: str, size: int) -> np.ndarray:
    """Groups of entries of a function that are computed and compared together, (size,) of numbers from 0: those of one unit, one
    output, origins and rotations apart; the whole function where its entries have no units of their own."""
    metadata = tested.module.metadata
    units = [metadata.units.get(x, x) for x in metadata.x]
    n_q, n_u = len(tested.symbols.coordinates), len(tested.symbols.speeds)
    of_speeds = units[n_q:n_q + n_u]
    labels: list = [0] * size
    if name == "rhs":
        labels = [*units[:n_q], *["accelerations"] * n_u, *[f"state {unit}" for unit in units[n_q + n_u:]]]
    elif name == "mass_matrix":
        labels = [(a, b) for a in of_speeds for b in of_speeds]
    elif name == "outputs":
        labels = [k for k, q in enumerate(outputs_in(tested.equations.quantities))
                  for _ in tested.equations.quantity(q).ravel()]
    elif name == "frames":
        labels = [k % 12 < 3 for k in range(size)]
    elif name in ("reactions", "cut_loads"):
        labels = [k % 6 < 3 for k in range(size)]
    known = {label: k for k, label in enumerate(dict.fromkeys(labels))}
    return np.array([known[label] for label in labels], dtype=int)


def weights(tested: SystemUnderTest, name: str, t: np.ndarray, x: np.ndarray, size: int,
            params: np.ndarray | None = None) -> np.ndarray:
    """Factors that make a function's entries comparable, (n, size): constraints as lengths, multipliers as forces, accelerations
    and forces by the roots of their inertias, with which the mass matrix is scaled."""
    n_q, n_u = len(tested.symbols.coordinates), len(tested.symbols.speeds)
    if tested.has("mass_matrix") and (name == "rhs" or (name in FORCES and size == n_u)):
        inertias = np.abs(np.diagonal(tested.evaluate("mass_matrix", t, x, params).reshape(-1, n_u, n_u), axis1=1, axis2=2))
        roots = np.where((inertias > 0) & np.isfinite(inertias), np.sqrt(inertias), 1.0)
        if name in FORCES:
            return 1 / roots  # type: ignore[no-any-return]
        factors = np.ones((len(x), size))
        factors[:, n_q:n_q + n_u] = roots
        return factors
    if name not in ("C", "C_dot", "F_d", "lam"):
        return np.ones((len(x), size))
    scale = np.abs(tested.evaluate("C_scale", t, x, params))
    scale = np.where((scale > 0) & np.isfinite(scale), scale, 1.0)
    return 1 / scale if name == "lam" else scale


def largest(values: np.ndarray, labels: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """For every entry the largest of those that are compared with it, in its own scale, (n, size)."""
    result = np.zeros(values.shape)
    scaled = np.nan_to_num(np.abs(values) * factors, nan=0.0, posinf=0.0)
    for label in np.unique(labels):
        result[:, labels == label] = scaled[:, labels == label].max(axis=1, keepdims=True)
    return result / factors


def terms(tested: SystemUnderTest, name: str, t: np.ndarray, x: np.ndarray, inputs: np.ndarray,
          params: np.ndarray | None = None) -> np.ndarray:
    """Sizes of the terms of entries whose sum may vanish for every parameter, (n, 1) or (n, size): rounding
    errors are in proportion to them. Zero for the others."""
    def values(of: str) -> np.ndarray:
        return np.nan_to_num(np.abs(tested.evaluate(of, t, x, params, inputs)), nan=0.0, posinf=0.0)

    def size(of: str) -> np.ndarray:
        return values(of).max(axis=1, initial=0.0)  # type: ignore[no-any-return]

    n_q, n_u = len(tested.symbols.coordinates), len(tested.symbols.speeds)
    speed = np.abs(x[:, n_q:n_q + n_u]).max(axis=1, initial=0.0)
    none = np.zeros((len(x), 1))
    loads = sum((size(of) for of in ("F_tilde", "k_tilde") if tested.has(of)), np.zeros(len(x)))
    if name == "C":  # closed loops: sums of lengths
        return (size("length") / np.fmax(values("C_scale").max(axis=1), 1e-300))[:, None]
    if name == "position_correction":  # of residuals as lengths, and what they are divided by
        return (size("length") * (1 + 1 / np.fmax(size("C_r"), 1e-300)))[:, None]
    if name == "velocity_correction":
        return (size("length") * speed * (1 + 1 / np.fmax(size("C_r"), 1e-300)) + speed)[:, None]
    if name in ("C_dot", "F_d"):
        return (size("C_r") * speed ** (2 if name == "F_d" else 1))[:, None]
    if name == "rhs" and tested.has("mass_matrix"):
        return _alone(tested, values, n_q, n_u)
    if name == "k_tilde" and tested.has("mass_matrix"):
        return (size("mass_matrix") * speed**2)[:, None]
    if name == "lam":  # what balances loads and inertial forces, also those of accelerations that constraints ask for
        gradient = np.fmax(size("C_r"), 1e-300)
        return ((loads + size("mass_matrix") * size("F_d") / gradient) / gradient)[:, None]
    if name == "outputs" and tested.has("positions"):  # often differences of places
        return size("positions")[:, None]
    if name in ("reactions", "cut_loads"):  # sums of weights, inertial forces, loads
        result = loads + (size("lam") * size("C_r") if tested.constrained else 0.0)
        if tested.has("mass_matrix"):
            result = result + size("mass_matrix") * speed**2
            diagonal = np.diagonal(values("mass_matrix").reshape(-1, n_u, n_u), axis1=1, axis2=2)
            result = result + (diagonal * values("rhs")[:, n_q:n_q + n_u]).max(axis=1, initial=0.0)
        return result[:, None]
    return none


def _alone(tested: SystemUnderTest, values: Callable[[str], np.ndarray], n_q: int, n_u: int) -> np.ndarray:
    """Accelerations that each force would cause alone, (n, n_x)."""
    diagonal = np.diagonal(values("mass_matrix").reshape(-1, n_u, n_u), axis1=1, axis2=2)
    forces = sum((values(of) for of in ("F_tilde", "k_tilde") if tested.has(of)), np.zeros(diagonal.shape))
    if tested.constrained:
        C = values("C_r").reshape(len(forces), -1, n_u)
        forces = forces + (C.transpose(0, 2, 1) * values("lam")[:, None, :]).sum(axis=2)
    result = np.zeros((len(forces), len(tested.module.metadata.x)))
    result[:, n_q:n_q + n_u] = np.where(diagonal > 0, forces / np.where(diagonal > 0, diagonal, 1.0), 0.0)
    return result
