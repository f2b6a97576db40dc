"""Ways to compute accelerations of constrained motion: by statements, in the way that takes the fewest operations, and by the
numeric algorithm where these lose their digits, or where no statements would do."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from symdyn.errors import ModelError, ModelWarning
from symdyn.formulation.constraints.motion import Constrained
from symdyn.formulation.constraints.null_space import elimination_order, least_operations
from symdyn.formulation.constraints.saddle import no_room
from symdyn.formulation.equations import Equations
from symdyn.formulation.printed.augmented import AugmentedEquations
from symdyn.formulation.probes.definite import definite_along
from symdyn.formulation.probes.dependent_rows import Ranks
from symdyn.formulation.probes.rank import first_dependent
from symdyn.spatial.vectors import vector
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intrinsics import MASSLESS
from symdyn.tape.node import is_zero
from symdyn.tape.tape import Tape

Q = TypeVar("Q", bound=Constrained)
Rows = tuple[int, ...]
Pivots = tuple[tuple[int, int], ...]
# Orders of elimination that are compared, each the best at one state.
CANDIDATES = 8
# Elimination is not derived where the least that it takes is so many times what another way takes.
MARGIN = 2
# Where a way fails at more of the states tried, it is counted with what the numeric algorithm takes there; walks come to folded
# positions, where ways fail, more often than motions do.
RARELY = 0.1
# Numbers that are kept at once where a way is tried at many states.
AT_ONCE = 5_000_000


def choose(derivation: Callable[[bool, Rows | None, Pivots | None], Q],
           result: Callable[[Q, Equations | None], AugmentedEquations],
           search: Callable[[Equations], Ranks | None]) -> AugmentedEquations:
    """The equations with the cheapest accelerations that hold at every state; where the numeric algorithm is too large, at those
    where no pivot vanishes, which raise there.

    derivation   (intrinsic, independent, pivots) -> quantities, all on one tape; see Constrained
    result       (quantities, the same for states where these fail) -> equations
    search       finds which rows depend on the others; None: unknown
    Raises ModelError for a singular mass matrix where neither statements nor the numeric algorithm solve.
    """
    quantities = derivation(True, None, None)
    whole = result(quantities, None)
    rows = quantities.rows
    if not rows:
        return result(derivation(False, None, None), None)
    found = search(whole)
    remarks = _remarks(whole, quantities, found)
    independent = found.independent if found is not None and found.rank < len(rows) else None
    ways: dict[str, Q] = {}
    if not singular(quantities):
        ways["Schur complement of the mass matrix"] = derivation(False, independent, None)
    counts = {name: operations(way) for name, way in ways.items()}
    pivots, least = _pivots(found, min(counts.values(), default=None))
    others: list[str] = []
    if least:
        others.append(f"elimination of dependent speeds, {least} at least")
    if pivots is not None:
        dependent = ", ".join(str(quantities.speeds[column]) for _, column in pivots)
        name = f"elimination of the dependent speeds {dependent}"
        ways[name] = derivation(False, independent, pivots)
        counts[name] = operations(ways[name])
    notes = list(remarks)
    if independent is not None and found is not None:
        left = [r.name for k, r in enumerate(rows) if k not in independent]
        notes.append(f"constraints {', '.join(left)}: they depend on the others at every state tried; accelerations come without "
                     f"them, multipliers of least norm with them (rank {found.rank} of {len(rows)})")
    too_large = no_room(len(quantities.speeds), len(rows))
    if not ways and too_large:
        raise ModelError(["the mass matrix alone is singular, no order of elimination of dependent speeds is known, and "
                          f"{too_large}; give every body mass and inertia, and every parameter a number in defaults"], whole.name)
    if not ways:
        notes.append("mass matrix alone is singular: accelerations come from the numeric algorithm for the whole system")
        return replace(whole, notes=(*whole.notes, *notes))
    numeric = 0 if too_large else operations(quantities)
    failing = {name: _failing(way, found) for name, way in ways.items()}

    def cost(name: str) -> tuple[float, float]:
        """Part of the states at which a way fails and raises, then its operations."""
        part = failing[name] if failing[name] > RARELY else 0.0
        return (part if too_large else 0.0), counts[name] + part * numeric

    best = min(counts, key=cost)
    others = [f"{name}, {count}{_fails(failing[name])}" for name, count in counts.items() if name != best] + others
    if not too_large:
        others.append(f"the numeric algorithm, which takes over where a pivot vanishes, {numeric}")
    aside = f" ({'; '.join(others)})" if others else ""
    notes.append(f"accelerations by {best}: {counts[best]} operations{_fails(failing[best])}{aside}")
    if too_large:
        notes.append(f"where a pivot vanishes evaluations raise: {too_large}")
    chosen = result(ways[best], None if too_large else whole)
    return replace(chosen, notes=(*chosen.notes, *notes))


def _remarks(equations: Equations, quantities: Constrained, result: Ranks | None) -> list[str]:
    """Notes about the states and motions that the constraints allow; warns where there seem to be none."""
    symbols = equations.symbols
    used = {leaf.args[1] for leaf in equations.tape("C", "C_r", "C_t").inputs}
    lacking = [p.name for p in symbols.parameters if p not in symbols.defaults and p.name in used]
    if result is None:
        if not lacking:
            given = getattr(quantities, "prescribed", ())
            drives = f"; the motion of {', '.join(given)} in the loops is prescribed and may leave none" if given else ""
            warnings.warn(f"{equations.name}: no state was found that fulfils the constraints "
                          f"{', '.join(equations.constraints)}{drives}; check the numbers in defaults, or give a state near one "
                          f"in initial{', or a coordinate to one of these joints' if given else ''}", ModelWarning, stacklevel=5)
            return []
        return [f"constraints: whether they depend on each other is unknown, because {', '.join(lacking)} "
                f"{'has no number' if len(lacking) == 1 else 'have no numbers'} in defaults"]
    if result.vanishing:
        rows = ", ".join(equations.constraints[k] for k in result.vanishing)
        warnings.warn(f"{equations.name}: all derivatives of {rows} vanish at every consistent state found, so that it holds "
                      "nothing there; pass a constraint that changes its sign where it is fulfilled, for a square its root",
                      ModelWarning, stacklevel=5)
    if result.rank < len(symbols.speeds):
        return []
    if not lacking and all(is_zero(e) for e in quantities.C_t()):  # with random numbers it may be theirs
        warnings.warn(f"{equations.name}: the constraints leave no motion: their rank is {result.rank}, as many as there are "
                      "speeds; remove one, unless it is the forces at rest that you are after", ModelWarning, stacklevel=5)
    return ["motion: the constraints determine every speed, so that the forces do not change the motion"]


def operations(quantities: Constrained) -> int:
    """Operations of one evaluation of the accelerations."""
    return Tape.of(quantities.algebra.recorder, accelerations=quantities.accelerations()).operations


def _failing(way: Constrained, found: Ranks | None) -> float:
    """The part of the states tried at which a pivot of this way is too small, so that the numeric algorithm takes over."""
    if found is None:
        return 0.0
    recorder = way.algebra.recorder
    steps = Tape.of(recorder, accelerations=way.accelerations()).steps
    others = Tape.of(recorder, M_tilde=way.recall("M_tilde"), C_r=way.C_r(), bias=way.recall("bias"),
                     remaining=vector(*way.remaining())).steps
    checked = (recorder.checks.keys() & set(steps)) - set(others)
    margins = [node.args[1] if node.op == "guard" else node for node in steps if node in checked]
    if not margins:
        return 0.0
    tape, failing = Tape.of(recorder, margins=vector(*margins)), 0
    at_once = max(1, AT_ONCE // len(tape.steps))
    for first in range(0, len(found.samples), at_once):
        part = slice(first, min(first + at_once, len(found.samples)))
        values = {name: value[part] if np.ndim(value) else value for name, value in found.values.items()}
        failing += int((~(evaluate_rows(tape, values, part.stop - first)["margins"] > 0).all(axis=1)).sum())
    return failing / len(found.samples)


def _fails(part: float) -> str:
    """Words on a way that fails at so many of the states tried, where it counts."""
    return f", fails at {100 * part:.0f} % of the states tried" if part > RARELY else ""


def singular(quantities: Constrained) -> bool:
    """Whether M_tilde is singular at every state."""
    M = quantities.recall("M_tilde")
    return any(is_zero(M[k, k]) for k in range(len(M))) or first_dependent(quantities.algebra.recorder, M) is not None


def _pivots(result: Ranks | None, fewest: int | None) -> tuple[Pivots | None, int]:
    """Dependent speeds and their order, where the sample state allows it; none, and how many operations it takes at least,
    where these are many more than the fewest of other ways."""
    if result is None or not result.independent:
        return None, 0
    kept = list(result.independent)
    if not _holds(result, kept):
        return None, 0
    samples = result.samples.of_rows(kept)
    orders = {tuple(order) for k in range(0, len(samples), max(1, len(samples) // CANDIDATES))
              if (order := elimination_order(samples[[k]])) is not None}
    if not orders:
        return None, 0
    least = min(least_operations(samples, result.mass, order) for order in sorted(orders))
    if fewest is not None and least > MARGIN * fewest:
        return None, least
    whole = samples.smallest()

    def usual(order: tuple[tuple[int, int], ...]) -> float:
        """Distance of the dependent speeds from losing their rows, at most of the states."""
        part = samples.of_columns([column for _, column in order]).smallest()
        return float(np.quantile(part / whole, 0.1))

    best = max(sorted(orders), key=usual)
    return tuple((kept[row], column) for row, column in best), 0


def _holds(result: Ranks, kept: list[int]) -> bool:
    """Whether there is mass in every direction that the constraints leave; there is where every direction has mass."""
    M, C_r = result.mass.matrices[0], result.samples[[0]].of_rows(kept)
    least = MASSLESS * max(abs(M).max(), 1e-300)
    if definite_along(M, C_r.matrices[0], least):
        return True
    free = np.linalg.svd(C_r.dense()[0])[2][len(kept):].T
    return not free.shape[1] or bool(np.linalg.eigvalsh(free.T @ (M @ free))[0] > least)
