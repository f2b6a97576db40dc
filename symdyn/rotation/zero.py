"""Whether an expression is zero: decided by its values, not by its form."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

# Bound that leaves 15 of 40 digits to cancellation.
_NOTHING, _DIGITS = sp.Float("1e-25"), 40
# Rounding of a SymPy Float of double precision.
_ROUNDING = sp.Float("1e-14")


def vanishes(expression: Any) -> bool:
    """Whether an expression is zero for all values of its symbols: to 25 digits at two points, to 14 with Floats."""
    expression = sp.sympify(expression, strict=True)
    rounded = expression.has(sp.Float)
    if expression.is_number and not rounded and expression.is_zero is not None:
        return bool(expression.is_zero)
    small = _ROUNDING if rounded else _NOTHING
    sizes = [abs(value_at(expression, point)) for point in (0, 1)]
    return all(size.is_Number and size.is_finite and size < small for size in sizes)


def all_zero(components: Any) -> bool:
    """Whether all components of a vector are zero; of Floats, which may be small, exactly."""
    return all(bool(c.is_zero) if c.is_Float else vanishes(c) for c in components)


def value_at(expression: Any, point: int = 0) -> Any:
    """The value to 40 digits where symbols, functions and derivatives have made-up values between 0.2 and 1.2."""
    for kind in (sp.Derivative, AppliedUndef, sp.Symbol):
        atoms = sorted(expression.atoms(kind), key=sp.default_sort_key)
        expression = expression.xreplace({atom: _made_up(atom, k + 11 * point) for k, atom in enumerate(atoms)})
    return expression.evalf(_DIGITS)


def _made_up(atom: Any, number: int) -> Any:
    value = sp.Rational(200 + (number * 618 + 377) % 1000, 1000)
    return -value if atom.is_negative else value
