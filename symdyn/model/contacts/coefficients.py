"""Coefficients of dry friction and restitution: how they are given, the numbers that they have, and what these cannot be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from symdyn.model.faults import Faults
from symdyn.shown import shown


def coefficients(faults: Faults, where: str, friction: Any, restitution: Any) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Static and kinetic friction and restitution as expressions; friction: one coefficient, or a pair."""
    given = list(friction) if isinstance(friction, Sequence) and not isinstance(friction, str) else [friction] * 2
    if len(given) != 2:
        faults.append(f"{where}: friction is {shown(friction)}; pass a coefficient, or a pair (static, kinetic)")
        given = [0, 0]
    static, kinetic = (faults.expression(mu, f"{where}: friction") for mu in given)
    return static, kinetic, faults.expression(restitution, f"{where}: restitution")


def value_of(value: Any, defaults: Mapping[sp.Basic | str, float]) -> float | None:
    """The number that an expression has with the defaults of parameters; None where some have none."""
    by_name = {getattr(key, "name", key): number for key, number in defaults.items()}
    expression = Faults().expression(value, "a number")
    try:
        return float(expression.xreplace({s: sp.Float(by_name[s.name]) for s in expression.free_symbols if s.name in by_name}))
    except (TypeError, ValueError):
        return None


def range_faults(where: str, numbers: Mapping[str, float]) -> list[str]:
    """Coefficients and lengths that are negative, and a restitution above one; numbers: by name, of those that are known."""
    result = [f"{where}: {what} is {value:g}; pass a number that is not negative" for what, value in numbers.items() if value < 0]
    if numbers.get("restitution", 0) > 1:
        result.append(f"{where}: restitution is {numbers['restitution']:g}, which would gain energy in every impact; "
                      "pass a number from 0 to 1")
    return result


def above(where: str, kinetic: float, static: float) -> str:
    """The fault of kinetic friction that is above static friction."""
    return (f"{where}: kinetic friction {kinetic:g} is above static friction {static:g}; pass (static, kinetic) with static not "
            "below kinetic")
