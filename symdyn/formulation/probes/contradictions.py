"""Constraints that nothing can fulfil, or that hold nothing, found in numbers at random states: for what holds at every state."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import ModelWarning
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.equations import Equations
from symdyn.formulation.probes.definite import smallest_eigenvalue
from symdyn.tape.floats import evaluate_rows

STATES = 12
# Sets of numbers for parameters that a contradiction must outlast.
TRIALS = 16
TOLERANCE = 1e-9
# The square of the smallest singular value of unit rows from which on none of them depends on the others.
INDEPENDENT = 1e-9
# Part of the largest inertia up to which there is nothing but rounding.
NO_MASS = 1e-13


@dataclass(frozen=True)
class _Draw:
    """At random states: C (s, n_c), C_r (s, n_c, n_u), C_t (s, n_c), M (s, n_u, n_u)."""

    C: np.ndarray
    C_r: np.ndarray
    C_t: np.ndarray
    M: np.ndarray


@dataclass(frozen=True)
class _Conflict:
    """Row k and the rows it is a combination of demand defect = 0; of positions, or of speeds."""

    k: int
    others: tuple[int, ...]
    defect: float
    of: str


def contradictions(equations: Equations) -> list[str]:
    """Faults of the constraints at every state, in sentences.

    Parameters take their defaults, else random numbers; what shows with some of these numbers only is not reported. Warns
    (ModelWarning) of constraints that contradict each other unless parameters without defaults have certain numbers.
    """
    symbols = equations.symbols
    numbers = {p.name: float(v) for p, v in symbols.defaults.items()}
    free = [p.name for p in symbols.parameters if p.name not in numbers]
    draws = [d for seed in range(2 if free else 1) if (d := _draw(equations, numbers | _some(free, seed))) is not None]
    if not draws:
        return []
    names = equations.constraints
    faults = []
    empty = [k for k in range(len(names)) if all(np.abs(d.C_r[:, k]).max() <= TOLERANCE for d in draws)]
    faults += [f"{names[k]} holds nothing: its derivatives by all coordinates and speeds vanish at every state; remove it, or "
               "correct it" for k in empty]
    kept = [k for k in range(len(names)) if k not in empty]
    first, *others = [_conflicts(d, kept, equations.holonomic) for d in draws]
    for conflict in first:
        listed = ", ".join(names[j] for j in conflict.others)
        if all(any(_same(conflict, c) for c in result) for result in others):
            faults.append(f"{names[conflict.k]} contradicts {listed}: together they demand {conflict.defect:.6g} = 0 of the "
                          f"{conflict.of}{'' if free or not symbols.parameters else ' with the numbers in defaults'}; remove or "
                          "correct one of them")
        elif all(any(_alike(conflict, c) for c in result) for result in others):
            matter = _parameters_in(equations, conflict, numbers, free, kept)
            given = ", ".join(p.name for p in matter)
            if _always(equations, conflict, numbers, free, matter, kept):
                faults.append(f"{names[conflict.k]} contradicts {listed}: what they demand of the {conflict.of} together differs "
                              f"for all positive numbers of {given}; remove or correct one of them")
            else:
                warnings.warn(f"{equations.name}: {names[conflict.k]} and {listed} contradict each other unless parameters make "
                              f"the difference in what they demand of the {conflict.of} = 0; it depends on {given}: give "
                              "numbers in defaults, or remove one of the constraints", ModelWarning, stacklevel=5)
    loose = [_loose(d) for d in draws]
    if all(entries is not None for entries in loose):
        result = sorted(set.intersection(*[entries for entries in loose if entries is not None]))
        if result:
            faults.append(f"{', '.join(symbols.speeds[j].name for j in result)}: neither mass nor a constraint holds "
                          f"{'this speed' if len(result) == 1 else 'a motion of these speeds'}; give it mass, a constraint, or "
                          "leave out the coordinate")
    return faults


def _some(free: Sequence[str], seed: int) -> dict[str, float]:
    stream = np.random.default_rng(11 + seed)
    return {name: stream.uniform(0.5, 1.5) for name in free}


def _draw(equations: Equations, numbers: Mapping[str, float]) -> _Draw | None:
    """The same states for all numbers of the parameters; None where hardly any state is defined."""
    symbols = equations.symbols
    stream = np.random.default_rng(7)
    values: dict[str, Any] = {"t": 0.37, **numbers}
    for group in (symbols.coordinates, symbols.speeds, symbols.states):
        values |= {s.name: stream.uniform(0.5, 1.5, STATES) for s in group}
    values |= {s.name: stream.uniform(0.5, 1.5) for s in symbols.inputs}  # motions are given, as time is
    result = evaluate_rows(equations.tape("C", "C_r", "C_t", "M_tilde"), values, STATES)
    arrays = [result[name] for name in ("C", "C_r", "C_t", "M_tilde")]
    defined = np.all([np.isfinite(a.reshape(STATES, -1)).all(axis=1) for a in arrays], axis=0)
    return _Draw(*[a[defined] for a in arrays]) if defined.sum() > STATES // 2 else None


def _conflicts(draw: _Draw, kept: Sequence[int], holonomic: Sequence[bool]) -> list[_Conflict]:
    """Rows that are the same combination of others at all states, but for a constant that is not zero."""
    order = sorted(kept, key=lambda k: not holonomic[k])
    if order and _independent(draw.C_r[:, order]):
        return []
    gradients = {k: draw.C_r[:, k].ravel() for k in order}
    if order:
        directions = np.array([g / np.linalg.norm(g) for g in gradients.values()])
        if np.linalg.eigvalsh(directions @ directions.T)[0] > INDEPENDENT:  # no row depends on the others
            return []
    independent: list[int] = []
    result = []
    for k in order:
        gradient = gradients[k]
        if not independent:
            independent.append(k)
            continue
        A = np.array([gradients[j] / np.linalg.norm(gradients[j]) for j in independent]).T
        factors = np.linalg.lstsq(A, gradient, rcond=1e-12)[0]
        if np.linalg.norm(A @ factors - gradient) > TOLERANCE * np.linalg.norm(gradient):
            independent.append(k)
            continue
        used = [(j, f / np.linalg.norm(gradients[j])) for j, f in zip(independent, factors, strict=True)
                if abs(f) > TOLERANCE * np.linalg.norm(gradient)]
        others = tuple(j for j, _ in used)
        tests = [(draw.C_t, "speeds")]
        if all(holonomic[j] for j in (k, *others)):
            tests.insert(0, (draw.C, "positions"))
        for values, of in tests:
            defect = values[:, k] - sum(f * values[:, j] for j, f in used)
            size = max(np.abs(f * values[:, j]).max() for j, f in [(k, 1.0), *used])
            if np.abs(defect).min() > TOLERANCE * size and np.ptp(defect) <= TOLERANCE * size:
                result.append(_Conflict(k, others, float(defect[0]), of))
                break
    return result


def _independent(C_r: np.ndarray) -> bool:
    """Whether many rows (s, m, n) with few entries are found independent by sparse factors at the first state."""
    first = Sampled.of(C_r[:1])
    if not first.sparse:
        return False
    sizes = np.sqrt((C_r * C_r).sum(axis=(0, 2)))[None]  # as parts of the rows at all states
    return bool(first.scaled(1 / sizes, np.ones((1, first.n))).smallest()[0]**2 > INDEPENDENT)


def _alike(a: _Conflict, b: _Conflict) -> bool:
    """Whether two conflicts are between the same rows."""
    return (a.k, a.others, a.of) == (b.k, b.others, b.of)


def _defect(equations: Equations, conflict: _Conflict, numbers: Mapping[str, float], kept: Sequence[int]) -> float:
    """Defect of the same rows with other numbers of the parameters; 0 where they do not contradict each other."""
    draw = _draw(equations, numbers)
    result = _conflicts(draw, kept, equations.holonomic) if draw is not None else []
    return next((c.defect for c in result if _alike(conflict, c)), 0.0)


def _parameters_in(equations: Equations, conflict: _Conflict, numbers: Mapping[str, float], free: Sequence[str],
                   kept: Sequence[int]) -> list[Any]:
    """Parameters without numbers that change the defect."""
    usual = _some(free, 0)
    changed = {name: _defect(equations, conflict, {**numbers, **usual, name: 1.7 * usual[name]}, kept) for name in free}
    return [p for p in equations.symbols.parameters if p.name in changed
            and abs(changed[p.name] - conflict.defect) > TOLERANCE * abs(conflict.defect)]


def _always(equations: Equations, conflict: _Conflict, numbers: Mapping[str, float], free: Sequence[str],
            matter: Sequence[Any], kept: Sequence[int]) -> bool:
    """Whether the defect has one sign for all numbers that the parameters can have, as far as these are positive."""
    if not all(p.is_positive for p in matter):
        return False
    stream = np.random.default_rng(13)
    trials = [dict.fromkeys(free, 1.0)]
    trials += [{name: float(10 ** stream.uniform(-2, 2)) for name in free} for _ in range(TRIALS)]
    return all(_defect(equations, conflict, {**numbers, **trial}, kept) * conflict.defect > 0 for trial in trials)


def _same(a: _Conflict, b: _Conflict) -> bool:
    return _alike(a, b) and abs(a.defect - b.defect) <= TOLERANCE * abs(a.defect)


def _loose(draw: _Draw) -> set[int] | None:
    """Speeds that take part in a motion without mass that the constraints leave at every state; None if there is none."""
    common: set[int] | None = None
    for M, C_r in zip(draw.M, draw.C_r, strict=True):
        # A lamp on a ship is no motion without mass: speeds count in units in which their inertia is 1.
        inertia = np.abs(np.diag(M))
        largest = max(inertia.max(), 1e-300)
        unit = np.sqrt(np.where(inertia > NO_MASS * largest, inertia, largest))
        M = M / np.outer(unit, unit)
        if smallest_eigenvalue(M) > TOLERANCE:  # every motion has mass
            return None
        Vt = np.linalg.svd(C_r / unit)[2]
        sizes = np.linalg.svd(C_r / unit, compute_uv=False)
        free = Vt[int((sizes > TOLERANCE * sizes.max(initial=0.0)).sum()):].T
        if not free.shape[1]:
            return None
        values, vectors = np.linalg.eigh(free.T @ M @ free)
        null = np.abs(values) <= NO_MASS
        if not null.any():
            return None
        entries = np.abs(free @ vectors[:, null]).max(axis=1)
        indices = {int(j) for j in np.flatnonzero(entries > 1e-6)}
        common = indices if common is None else common | indices
    return common
