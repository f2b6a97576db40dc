"""Constraints that nothing can fulfil, or that hold nothing, found in numbers at random states: for what holds at every state."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import ModelWarning
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.equations import Equations
from symdyn.formulation.probes.definite import definite_along
from symdyn.tape.floats import evaluate_entries

STATES = 12
# Sets of numbers for parameters that a contradiction must outlast.
TRIALS = 16
TOLERANCE = 1e-9
# The square of the smallest singular value of unit rows from which on none of them depends on the others.
INDEPENDENT = 1e-9
# Entries of orthonormal combinations of unit rows that are more than rounding.
TAKES_PART = 1e-6
# Part of the largest inertia up to which there is nothing but rounding.
NO_MASS = 1e-13


@dataclass(frozen=True)
class _Draw:
    """At random states: C (s, n_c), C_r (s, n_c, n_u), C_t (s, n_c), M (s, n_u, n_u)."""

    C: np.ndarray
    C_r: Sampled
    C_t: np.ndarray
    M: Sampled


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
    sizes = np.max([d.C_r.largest_of_rows().max(axis=0) for d in draws], axis=0)
    empty = [k for k in range(len(names)) if sizes[k] <= TOLERANCE]
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
    result = evaluate_entries(equations.tape("C", "C_r", "C_t", "M_tilde"), values, STATES)
    defined = np.all([np.isfinite(entries.values).all(axis=1) for entries in result.values()], axis=0)
    if defined.sum() <= STATES // 2:
        return None
    C, C_t = (result[name].dense()[defined] for name in ("C", "C_t"))
    C_r, M = (Sampled.of_entries(result[name])[defined] for name in ("C_r", "M_tilde"))
    return _Draw(C, C_r, C_t, M)


def _conflicts(draw: _Draw, kept: Sequence[int], holonomic: Sequence[bool]) -> list[_Conflict]:
    """Rows that are the same combination of others at all states, but for a constant that is not zero."""
    order = sorted(kept, key=lambda k: not holonomic[k])
    result = []
    for k, used in _combinations(draw.C_r.of_rows(order)):
        k, used = order[k], [(order[j], f) for j, f in used]
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


def _combinations(A: Sampled) -> Iterator[tuple[int, list[tuple[int, float]]]]:
    """Rows that are the same combination at all states of rows before them that are none, each with these and their factors."""
    if not A.m:
        return
    if A.sparse:
        whole = A.together()
        gradients = whole.matrices[0]
        for k, near in _dependent(whole):
            some = gradients[[k, *near]]
            gradient, *others = some[:, np.unique(some.indices)].toarray()
            if (factors := _factors(gradient, others)) is not None:
                yield k, [(near[j], f) for j, f in factors]
        return
    flat = A.dense().transpose(1, 0, 2).reshape(A.m, -1)
    directions = flat / np.linalg.norm(flat, axis=1)[:, None]
    if np.linalg.eigvalsh(directions @ directions.T)[0] > INDEPENDENT:  # no row depends on the others
        return
    independent = [0]
    for k in range(1, A.m):
        found = _factors(flat[k], [flat[j] for j in independent])
        if found is None:
            independent.append(k)
        else:
            yield k, [(independent[j], f) for j, f in found]


def _factors(gradient: np.ndarray, others: Sequence[np.ndarray]) -> list[tuple[int, float]] | None:
    """The others whose combination the gradient is, with their factors; None if it is none."""
    A = np.array([g / np.linalg.norm(g) for g in others]).T
    factors = np.linalg.lstsq(A, gradient, rcond=1e-12)[0]
    if np.linalg.norm(A @ factors - gradient) > TOLERANCE * np.linalg.norm(gradient):
        return None
    return [(j, f / np.linalg.norm(others[j])) for j, f in enumerate(factors) if abs(f) > TOLERANCE * np.linalg.norm(gradient)]


def _dependent(A: Sampled) -> list[tuple[int, list[int]]]:
    """By sparse factors, rows of a matrix (1, m, n) that depend on the rows before them, each with those of these that take part
    and depend on none: the combinations that vanish, brought from the last row on to an echelon form."""
    sizes = np.sqrt(np.bincount(A.rows, weights=A.values[0]**2, minlength=A.m))
    factors = A.scaled(1 / sizes[None], np.ones((1, A.n))).triangular()
    count = int((~factors.kept).sum())
    if not count:
        return []
    left = np.linalg.qr(factors.combinations(count)[0])[0]
    pivots: dict[int, int] = {}  # rows by combination
    for k in range(A.m - 1, -1, -1):
        free = [c for c in range(count) if c not in pivots]
        if not free:
            break
        c = max(free, key=lambda c: abs(left[k, c]))
        if abs(left[k, c]) > TAKES_PART:
            pivots[c] = k
            left[:, c] /= left[k, c]
            others = [d for d in range(count) if d != c]
            left[:, others] -= np.outer(left[:, c], left[k, others])
    return [(k, [int(j) for j in np.flatnonzero(np.abs(left[:, c]) > TAKES_PART) if j != k])
            for c, k in sorted(pivots.items(), key=lambda item: item[1])]


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
    diagonal = np.zeros((len(draw.M), draw.M.n))
    on = draw.M.rows == draw.M.columns
    diagonal[:, draw.M.rows[on]] = np.abs(draw.M.values[:, on])
    for k, inertia in enumerate(diagonal):
        # A lamp on a ship is no motion without mass: speeds count in units in which their inertia is 1.
        largest = max(inertia.max(), 1e-300)
        unit = np.sqrt(np.where(inertia > NO_MASS * largest, inertia, largest))[None]
        M, C_r = draw.M[[k]].scaled(1 / unit, unit), draw.C_r[[k]].scaled(np.ones((1, draw.C_r.m)), unit)
        if definite_along(M.matrices[0], C_r.matrices[0], TOLERANCE):  # every motion that is left has mass
            return None
        Vt = np.linalg.svd(C_r.dense()[0])[2]
        sizes = C_r.singular_values()[0]
        free = Vt[int((sizes > TOLERANCE * sizes.max(initial=0.0)).sum()):].T
        if not free.shape[1]:
            return None
        values, vectors = np.linalg.eigh(free.T @ (M.matrices[0] @ free))
        null = np.abs(values) <= NO_MASS
        if not null.any():
            return None
        entries = np.abs(free @ vectors[:, null]).max(axis=1)
        indices = {int(j) for j in np.flatnonzero(entries > 1e-6)}
        common = indices if common is None else common | indices
    return common
