"""What rounding errors are measured by: values at 30 digits, condition numbers."""

from __future__ import annotations

from collections.abc import Sequence

import mpmath
import numpy as np

from symdyn.bench.precise import Lost, program
from symdyn.pipeline import function_tape
from symdyn.stress.subject import Subject
from symdyn.verification.identities import _equilibrated

DIGITS = 32
# Singular values of the scaled Jacobian below this part of the usual belong to constraints that depend on others but for
# rounding errors.
DEPENDENT = 1e-12


def exact(subject: Subject, name: str, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, ud: np.ndarray,
          params: np.ndarray | None = None) -> list[list[mpmath.mpf] | None]:
    """A function at rows of states with 32 digits, all numbers taken as the binary ones they are; None where it is undefined."""
    context = mpmath.mp.clone()
    context.dps = DIGITS
    symbols = subject.symbols
    free = ["t", *[s.name for group in (symbols.coordinates, symbols.speeds, symbols.states, symbols.inputs) for s in group],
            *[f"{s.name}_dot" for s in symbols.speeds]]
    values = subject.params if params is None else params
    fixed = {s.name: v for s, v in zip(symbols.parameters, values.tolist(), strict=True)}
    rows = [[context.mpf(float(v)) for v in row] for row in np.column_stack([t, x, inputs, ud])]
    programs = [program(function_tape(subject.equations, name), context, fixed, free)]
    found: list[list[mpmath.mpf] | None] = []
    for row in rows:
        try:
            found.append(programs[0](row))
        except (Lost, ValueError, TypeError, ZeroDivisionError):
            found.append(_otherwise(subject, name, context, fixed, free, programs, row))
    return found


def _otherwise(subject: Subject, name: str, context: object, fixed: dict[str, float], free: Sequence[str], programs: list,
               row: list) -> list[mpmath.mpf] | None:
    """By the equations for states where what the usual ones divide by vanishes."""
    if subject.equations.otherwise is None:
        return None
    if len(programs) == 1:
        programs.append(program(subject.equations.otherwise.tape(name), context, fixed, free)
                        if name in subject.equations.otherwise.quantities else None)
    try:
        return None if programs[1] is None else programs[1](row)
    except (Lost, ValueError, TypeError, ZeroDivisionError):
        return None


def conditions(subject: Subject, t: np.ndarray, x: np.ndarray, params: np.ndarray | None = None,
               scaled: bool = True) -> np.ndarray:
    """Condition of the mass matrix, or of the mass matrix bordered by the constraints, with rows and columns scaled or in plain
    numbers, (n,); of constraints that depend on others without those."""
    if not subject.has("mass_matrix"):
        return np.ones(len(x))
    n = len(subject.symbols.speeds)
    M = subject.evaluate("mass_matrix", t, x, params).reshape(-1, n, n)
    if not subject.constrained:
        return np.array([_condition(m, -1, scaled) for m in M])
    C = subject.evaluate("C_r", t, x, params).reshape(len(M), -1, n)
    whole = np.zeros((len(M), n + C.shape[1], n + C.shape[1]))
    whole[:, :n, :n], whole[:, n:, :n], whole[:, :n, n:] = M, C, C.transpose(0, 2, 1)
    J = C * subject.evaluate("C_scale", t, x, params)[:, :, None]
    sizes = np.array([np.linalg.svd(j, compute_uv=False) if np.isfinite(j).all() else np.zeros(min(j.shape)) for j in J])
    # Relative to the usual: a row whose gradient nearly vanishes costs digits, one that depends on others does not count.
    sizes = np.pad(sizes / max(float(np.median(sizes[:, 0])), 1e-300), ((0, 0), (0, C.shape[1] - sizes.shape[1])))
    found = []
    for w, values in zip(whole, sizes, strict=True):
        kept = values[values > DEPENDENT]
        found.append(_condition(w, len(values) - len(kept), scaled) * max(1.0, 1 / kept[-1] if len(kept) else np.inf))
    return np.array(found)


def _condition(matrix: np.ndarray, without: int, scaled: bool) -> float:
    """Of a mass matrix, or with constraints without so many singular values."""
    if not np.isfinite(matrix).all():
        return float("nan")
    if not len(matrix):
        return 1.0
    if not scaled:
        pass
    elif without >= 0:
        matrix = _equilibrated(matrix)
    else:
        size = np.sqrt(np.abs(np.diagonal(matrix)))
        size = np.where(size > 0, size, 1.0)
        matrix = matrix / size[:, None] / size[None, :]
    values = np.linalg.svd(matrix, compute_uv=False)
    last = values[len(values) - 1 - max(without, 0)]
    return float(values[0] / last) if last > 0 else float("inf")


def terms(subject: Subject, name: str, t: np.ndarray, x: np.ndarray, inputs: np.ndarray,
          params: np.ndarray | None = None) -> np.ndarray:
    """How large the terms are that make up a function whose value may vanish for every parameter, (n,): rounding errors are in
    proportion to them. Zero for the others."""
    def values(of: str) -> np.ndarray:
        return np.abs(subject.evaluate(of, t, x, params, inputs))  # type: ignore[no-any-return]

    def size(of: str) -> np.ndarray:
        return values(of).max(axis=1, initial=0.0)  # type: ignore[no-any-return]

    if name == "C":  # closed loops: sums of lengths
        return np.nan_to_num(size("length") / values("C_scale").max(axis=1))
    n_q, n_u = len(subject.symbols.coordinates), len(subject.symbols.speeds)
    speed = np.abs(x[:, n_q:n_q + n_u]).max(axis=1, initial=0.0)
    if name == "position_correction":  # of residuals as lengths, and what they are divided by
        return np.nan_to_num(size("length")) * (1 + 1 / np.fmax(size("C_r"), 1e-300))
    if name == "velocity_correction":
        return np.nan_to_num(size("length")) * speed * (1 + 1 / np.fmax(size("C_r"), 1e-300)) + speed
    if name in ("C_dot", "F_d"):
        return np.nan_to_num(size("C_r")) * speed ** (2 if name == "F_d" else 1)
    if name == "rhs" and subject.has("mass_matrix"):  # accelerations that each force would cause alone
        diagonal = np.diagonal(values("mass_matrix").reshape(-1, n_u, n_u), axis1=1, axis2=2)
        forces = sum((values(of) for of in ("F_tilde", "k_tilde") if subject.has(of)), np.zeros((len(x), n_u)))
        if subject.constrained:
            C = values("C_r").reshape(len(x), -1, n_u)
            forces = forces + (C.transpose(0, 2, 1) * values("lam")[:, None, :]).sum(axis=2)
        alone = np.where(diagonal > 0, forces / np.where(diagonal > 0, diagonal, 1.0), 0.0)
        return np.nan_to_num(alone.max(axis=1, initial=0.0))
    if name == "k_tilde" and subject.has("mass_matrix"):
        return np.nan_to_num(size("mass_matrix")) * speed**2
    if name == "lam":  # what balances loads and inertial forces
        found = sum((size(of) for of in ("F_tilde", "k_tilde") if subject.has(of)), np.zeros(len(x)))
        return np.nan_to_num(found / np.fmax(size("C_r"), 1e-300))
    if name == "outputs" and subject.has("positions"):  # often differences of places
        return np.nan_to_num(size("positions"))
    if name == "reactions":  # sums of weights, inertial forces, loads
        found = sum((size(of) for of in ("F_tilde", "k_tilde") if subject.has(of)), np.zeros(len(x)))
        if subject.constrained:
            found = found + size("lam") * size("C_r")
        return np.nan_to_num(found) + np.zeros(len(x))
    return np.zeros(len(x))
