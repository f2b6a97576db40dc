"""Parts that a scene does not need and therefore does not get, in sentences: read off the tape, not kept apart from it."""

from __future__ import annotations

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.tape.node import INPUT, PARAMETER, TIME, Node
from symdyn.tape.tape import Tape

# Beginning of the note on accelerations where the factors of the mass matrix are used.
BY_FACTORS = "accelerations by Schur complement"


def skipped(equations: Equations) -> list[str]:
    """One sentence for each thing that was left out of the right-hand side, and why."""
    notes = list(equations.notes)
    tape = equations.tape("rhs")
    kinds = 0
    for leaf in tape.inputs:
        kinds |= leaf.mask
    if not kinds & TIME:
        notes.append("time: nothing depends on t, so no function takes it")
    if not kinds & INPUT:
        notes.append("inputs: there are none")
    if equations.events:
        notes.append("events: files that stand alone do not look for them, simulations do")
    if equations.contacts:
        notes.append("rigid contacts: files that stand alone leave them in the mode that their parameters say, simulations "
                     "change it")
    if equations.constraints:
        notes += _constraints(equations, tape)
    if equations.formulation != "recursive":
        notes += _mass_matrix(equations)
    if not any(isinstance(e, Node) for e in equations.quantity("k_tilde")):
        notes.append("k_tilde: zero by structure")
    if tape.prologue:
        notes.append(f"{sum(tape.count_prologue().values())} operations on parameters only: hoisted into the prologue, "
                     "run once a simulation")
    return notes


def _constraints(equations: Equations, tape: Tape) -> list[str]:
    """Parts of constraints that the right-hand side does without."""
    notes = []
    steps = set(tape.steps)
    lam = [e for e in equations.quantity("lam") if isinstance(e, Node)]
    if lam and not any(e in steps for e in lam):
        notes.append("multipliers: accelerations do without them; they are computed where lam or reactions are asked for")
    if not any(isinstance(e, Node) for e in equations.quantity("C_t")):
        notes.append("C_t: zero by structure, the constraints do not move by themselves" if not any(equations.quantity("C_t"))
                     else "C_t: constant")
    if all(not isinstance(e, Node) or not e.mask & ~PARAMETER for e in equations.quantity("C_r").ravel()):
        notes.append("C_r: constant, and what depends on it alone is computed in the prologue")
    if not any(isinstance(e, Node) or e for e in equations.quantity("F_d")):
        notes.append("F_d: zero by structure")
    return notes


def _mass_matrix(equations: Equations) -> list[str]:
    """Savings by its structure. With constraints it need not be factorized, and they couple what it does not."""
    M = equations.quantity("M_tilde")
    n = len(M)
    notes = []
    entries = [M[i, j] for i in range(n) for j in range(i + 1)]
    constant = all(not isinstance(e, Node) or not e.mask & ~PARAMETER for e in entries)
    factorized = not equations.constraints or any(note.startswith(BY_FACTORS) for note in equations.notes)
    if n and constant:
        notes.append("factorization: the mass matrix is constant and is factorized once, in the prologue" if factorized else
                     "mass matrix: constant")
    zero = sum(1 for e in entries if not isinstance(e, Node) and e == 0)
    if zero:
        notes.append(f"{zero} of the {len(entries)} entries of the mass matrix (symmetric ones once): zero by structure"
                     f"{', and so left out of its factors' * factorized}")
    parts = _components(M)
    if len(parts) > 1 and not equations.constraints:
        groups = "; ".join(", ".join(str(k + 1) for k in part) for part in parts[:6])
        notes.append(f"coupling: speeds {groups}{'; ...' if len(parts) > 6 else ''} do not act on each other through the "
                     "mass matrix and are solved for separately")
    return notes


def _components(M: np.ndarray) -> list[list[int]]:
    """Sets of speeds that the mass matrix couples."""
    left = list(range(len(M)))
    parts = []
    while left:
        part = [left.pop(0)]
        for k in part:
            for j in list(left):
                if isinstance(M[k, j], Node) or M[k, j] != 0:
                    left.remove(j)
                    part.append(j)
        parts.append(sorted(part))
    return parts
