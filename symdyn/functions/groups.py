"""Functions that are emitted together: into a file, or into one compiled library of a module."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from symdyn.backend.methods import method_of, needs_of
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import CORRECTIONS
from symdyn.errors import ArgumentError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.formulation.names import BOUNDS, RANGES
from symdyn.functions.packed import band
from symdyn.functions.sensitivities import adjoints_of, functions_of
from symdyn.functions.table import BATCH, CONSISTENCY, FUNCTIONS, STANDARD, STATICS
from symdyn.functions.tapes import has_function
from symdyn.shown import shown

# Functions that constraints add to the standard ones; with the corrections the integrator keeps a motion on its manifold.
OF_CONSTRAINTS = ("C", "C_r", "F_d", "lam", *CORRECTIONS)
# Functions that time stepping with contacts takes, compiled together.
OF_CONTACTS = ("contact_gaps", "contact_directions", "contact_spheres")
_OF_EVENTS = ("events", "event_resets", "reset_directions", BOUNDS, RANGES)


def written(equations: Equations, functions: Sequence[str] | None, method: str | None,
            baumgarte: bool = False) -> tuple[str, ...]:
    """The functions that go into a file: those named, or the standard ones; with what the method of an integrator needs.

    baumgarte   whether the right-hand side is stabilized by Baumgarte's method

    Raises SymdynError for what is no list of names, ArgumentError for functions that the equations do not have.
    """
    if functions is None:
        standard = (*STANDARD, *(OF_CONSTRAINTS if equations.constraints else ()))
        names = tuple(n for n in standard if has_function(equations, n))
    elif isinstance(functions, (list, tuple)) and functions and all(isinstance(n, str) for n in functions):
        names = tuple(functions)
    else:
        raise SymdynError(f"{equations.name}: functions is {shown(functions)}; pass a list of names such as "
                          "['rhs', 'mass_matrix']")
    if method is not None and "rhs" in names:
        names = tuple(dict.fromkeys((*names, *needs_of(method_of(method), band(equations, method, baumgarte) is not None))))
    unknown = [n for n in names if not has_function(equations, n)]
    if unknown:
        there = [n for n in FUNCTIONS if has_function(equations, n)]
        near = [n for name in unknown for n in difflib.get_close_matches(name, there, 2)]
        raise ArgumentError(f"{equations.name} has no function {', '.join(n[:80] for n in unknown)}; "
                            + (f"did you mean {' or '.join(near)}? There are " if near else "it has ") + ", ".join(there))
    return names


def of_right_side(equations: Equations, right_side: RightSide) -> tuple[str, ...]:
    """The functions in the library of a right-hand side and its integrator."""
    if not right_side.integrated:
        return ("rhs",)
    names = ["rhs", *(CORRECTIONS if equations.constraints else ())]
    if right_side == RightSide():  # evaluated in or after every simulation
        names += [n for n in ("validity_checks", "switches") if has_function(equations, n)]
    if right_side.adjoint is not None:
        return (*names, *adjoints_of(equations))
    if right_side.sensitivities:
        names += functions_of(equations)
    return (*names, *(n for n in _OF_EVENTS if right_side.looks and has_function(equations, n)))


def with_function(equations: Equations, name: str) -> tuple[str, ...]:
    """The functions in the library that is made when a function is first called."""
    if name == BATCH:
        return ("rhs", *(CORRECTIONS if equations.constraints else ()))
    if name in OF_CONTACTS:
        return tuple(n for n in OF_CONTACTS if has_function(equations, n))
    if name in STATICS:
        return (*STATICS, "mass_matrix", "N", *(("C_r", "C_scale") if equations.constraints else ()))
    return CONSISTENCY if equations.constraints and name in CONSISTENCY else (name,)
