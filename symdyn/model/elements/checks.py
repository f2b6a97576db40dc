"""Checks that several load elements share."""

from __future__ import annotations

from typing import Any

import sympy as sp

from symdyn.model.faults import Faults


def six(faults: Faults, value: Any, what: str) -> tuple[sp.Expr, ...]:
    """Six expressions, along x, y, z and about them."""
    taken = faults.expressions(value, what)
    if len(taken) != 6:
        faults.append(f"{what} has {len(taken)} components; pass 6: three along x, y, z, three about them")
        return (sp.S.Zero,) * 6
    return taken


def positive(faults: Faults, value: Any, what: str, unit: str) -> sp.Expr:
    """An expression; a number must be above zero."""
    taken = faults.expression(value, what)
    if not taken.free_symbols and not taken > 0 and not any(fault.startswith(what) for fault in faults):
        faults.append(f"{what} is {float(taken):g}; pass a number above 0 {unit}".rstrip())
    return taken


def not_negative(faults: Faults, value: Any, what: str, unit: str = "") -> sp.Expr:
    """An expression; a number must not be below zero."""
    taken = faults.expression(value, what)
    if not taken.free_symbols and taken < 0:
        faults.append(f"{what} is {float(taken):g}; pass a number that is not below 0 {unit}".rstrip())
    return taken
