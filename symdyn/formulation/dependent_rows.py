"""Which rows of the constraints depend on the others, found in numbers at consistent states near the initial one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.tape import Tape

# Singular values of the scaled Jacobian below this part of the largest count as zero.
RANK_TOLERANCE = 1e-8
ITERATIONS = 60
SPREAD = 0.3


@dataclass(frozen=True)
class Ranks:
    """rank: the largest found, of the scaled C_r; independent: rows that have it; states: how many it was tried at."""

    rank: int
    independent: tuple[int, ...]
    states: int


def ranks(equations: Equations, states: int = 4, seed: int = 1) -> Ranks | None:
    """The rank of the constraints at consistent states near the initial one; None where parameters have no numbers, or no
    consistent state is found."""
    symbols = equations.symbols
    if any(p not in symbols.defaults for p in symbols.parameters):
        return None
    tape = equations.tape("C", "C_r", "C_scale", "N", "length")
    values = {p.name: float(symbols.defaults[p]) for p in symbols.parameters} | {"t": 0.0}
    values |= {s.name: 0.0 for s in (*symbols.speeds, *symbols.states, *symbols.inputs)}
    names = [q.name for q in symbols.coordinates]
    start = np.array([float(symbols.initial.get(q, 0.0)) for q in symbols.coordinates])
    stream = np.random.default_rng(seed)
    best: tuple[int, float, np.ndarray] | None = None
    found = 0
    for trial in range(4 * states):
        if found == states:
            break
        q = start + (SPREAD * stream.uniform(-1, 1, len(start)) if trial else 0.0)
        scaled = _consistent(tape, values, names, q)
        if scaled is None:
            if trial == 0:
                return None
            continue
        found += 1
        sizes = np.linalg.svd(scaled, compute_uv=False)
        rank = int((sizes > RANK_TOLERANCE * max(sizes[0], 1e-300)).sum()) if len(sizes) else 0
        least = float(sizes[rank - 1] / sizes[0]) if rank else 0.0
        if best is None or (rank, least) > best[:2]:
            best = rank, least, scaled
    assert best is not None
    rank, _, scaled = best
    if rank == len(scaled):
        return Ranks(rank, tuple(range(rank)), found)
    from scipy.linalg import qr

    order = qr(scaled.T, pivoting=True, mode="r")[1]
    return Ranks(rank, tuple(sorted(int(k) for k in order[:rank])), found)


def _consistent(tape: Tape, values: Mapping[str, Any], names: list[str], q: np.ndarray) -> np.ndarray | None:
    """The scaled Jacobian at the consistent state nearest to q by Gauss-Newton; None if there is none near."""
    for _ in range(ITERATIONS):
        at = {**values, **dict(zip(names, q, strict=True))}
        found = {name: array[0] for name, array in evaluate_rows(tape, at, 1).items()}
        residual = found["C"] * found["C_scale"]
        if not np.isfinite(residual).all() or not np.isfinite(found["C_r"]).all():
            return None
        scaled = found["C_r"] * found["C_scale"][:, None]
        if np.abs(residual).max(initial=0.0) < 1e-12 * found["length"]:
            return scaled  # type: ignore[no-any-return]
        q = q + found["N"] @ np.linalg.lstsq(scaled, -residual, rcond=1e-10)[0]
    return None
