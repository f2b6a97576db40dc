"""Where motions begin: on the constraints; and whether anything moves at all."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from symdyn.bench.work.record import Reference
from symdyn.bench.work.system_under_test import Formulation, SystemUnderTest
from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.runtime.consistent import check_start

STILL = ("the motion stands still: it ends where it begins, so that errors, energy and least times mean nothing; set "
         "system.initial to a state that moves")
# A motion that nowhere goes farther than this stands still, relative to the largest entry of its start, or to 1 m, rad, m/s or
# rad/s where that is smaller.
_NEAR = 1e-12
# Entries that changed by more than this are reported.
_CHANGED = 1e-12
# Said of formulations with an orientation other than the first one's.
ELSEWHERE = ("the initial state violates the constraints, and the nearest one that does not is another motion in these "
             "coordinates; set system.initial to a state that fulfils them")


def on_constraints(tested: SystemUnderTest, first: Formulation) -> tuple[SystemUnderTest, str]:
    """The mechanism with a start that fulfils its constraints, the nearest one, and a sentence on what that changed; itself and
    no sentence where it does already.

    first   formulation whose coordinates the start is moved in: others begin at the same poses and velocities
    Raises ArgumentError where no such start is found.
    """
    module, x = first.module, first.x0
    try:
        check_start(module, 0.0, x, module.default_parameters)
        return tested, ""
    except ArgumentError:
        pass
    n_q, n_u = module.metadata.sizes.q, module.metadata.sizes.u
    result = np.concatenate(module.consistent(x[:n_q], x[n_q:n_q + n_u]))
    symbols = first.equations.symbols
    start = dict(zip((*symbols.coordinates, *symbols.speeds), map(float, result), strict=True))
    changed = [f"{symbol.name} from {before:.6g} to {after:.6g}" for (symbol, after), before in zip(
        start.items(), map(float, x), strict=False) if abs(after - before) > _CHANGED * max(1.0, abs(before))]
    note = f"the initial state violates the constraints; the motion begins at the nearest one that does not: {', '.join(changed)}"
    if tested.given is not None:
        return replace(tested, given=_beginning(tested.given, start)), note
    kind, system = next(iter(tested.variants.items()))
    moved = copy.copy(system)
    moved.initial = _with(system, start)
    return replace(tested, variants={kind: moved}), note


def _with(system: System, start: Mapping[sp.Symbol, float]) -> dict[Any, float]:
    """The system's start, whose keys may be names, with these numbers in their places."""
    names = {symbol.name for symbol in start}
    return {**{key: value for key, value in system.initial.items() if str(getattr(key, "name", key)) not in names}, **start}


def _beginning(equations: Equations, start: Mapping[sp.Symbol, float]) -> Equations:
    """The same equations with another start."""
    again = equations.again
    return replace(equations, symbols=replace(equations.symbols, initial={**equations.symbols.initial, **start}),
                   again=None if again is None else lambda: _beginning(again(), start))


def stands_still(reference: Reference, first: Formulation) -> bool:
    """Whether the state never leaves the start, at none of the reference's times."""
    away = np.abs(np.array(reference.x, dtype=float) - first.x0).max(initial=0.0)
    return bool(away <= _NEAR * max(1.0, float(np.abs(first.x0).max(initial=0.0))))
