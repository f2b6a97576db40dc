"""How accelerations of constrained motion are computed: by statements where the mass matrix allows it, else by the numeric
algorithm, which also takes over where constraints come to depend on each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from symdyn.formulation.augmented_equations import AugmentedEquations
from symdyn.formulation.constrained import Constrained
from symdyn.formulation.dependent_rows import Ranks
from symdyn.formulation.equations import Equations
from symdyn.formulation.rank import first_dependent
from symdyn.tape.node import is_zero

Q = TypeVar("Q", bound=Constrained)


def choose(derivation: Callable[[bool, tuple[int, ...] | None], Q], result: Callable[[Q, Equations | None], AugmentedEquations],
           search: Callable[[Equations], Ranks | None]) -> AugmentedEquations:
    """The equations with the cheapest accelerations that hold at every state.

    derivation   (kernel, independent) -> quantities, all on one tape; see Constrained
    result       (quantities, the same for states where these fail) -> equations
    search       finds which rows depend on the others; None: unknown
    """
    quantities = derivation(True, None)
    whole = result(quantities, None)
    if singular(quantities):
        note = "mass matrix alone is singular: accelerations come from the numeric algorithm for the whole system"
        return replace(whole, notes=(*whole.notes, note))
    rows = quantities.rows
    found = search(whole) if rows else None
    if found is None or found.rank == len(rows):
        return result(derivation(False, None), whole)
    direct = result(derivation(False, found.independent), whole)
    left = [r.name for k, r in enumerate(rows) if k not in found.independent]
    note = (f"constraints {', '.join(left)}: they depend on the others at every state tried; accelerations come without them, "
            f"multipliers of least norm with them (rank {found.rank} of {len(rows)})")
    return replace(direct, notes=(*direct.notes, note))


def singular(quantities: Constrained) -> bool:
    """Whether M_tilde is singular at every state."""
    M = quantities.recall("M_tilde")
    return any(is_zero(M[k, k]) for k in range(len(M))) or first_dependent(quantities.algebra.recorder, M) is not None
