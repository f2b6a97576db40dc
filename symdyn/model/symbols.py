"""Symbols of a model: coordinates with Newton's dots, parameters, inputs, time.

All are SymPy symbols, so that expressions print and differentiate as anywhere else in SymPy.
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.errors import ModelError

time = sp.Symbol("t")


def _dotted(latex: str, accent: str) -> str:
    head, cut, tail = latex.partition("_")
    return rf"{accent}{{{head}}}{cut}{tail}"


def _of_derivative(symbol: sp.Symbol) -> dict[str, bool]:
    """Assumptions of a derivative: of a positive quantity it is real, no more."""
    return {"real": True} if symbol.is_real else {}


class Moving(sp.Symbol):
    """A symbol that is printed after parameters in a product: m l q_dot^2, not q_dot^2 l m."""

    __slots__ = ()
    _rank = 0

    @classmethod
    def class_key(cls) -> tuple[int, int, str]:
        """Where SymPy sorts it: after plain symbols, in the order of `_rank`."""
        return 2, 0, f"Symbol{cls._rank}"


class Coordinate(Moving):
    """A generalized coordinate; `.dot` and `.ddot` are its derivatives by time, symbols too."""

    __slots__ = ()

    @property
    def dot(self) -> Rate:
        return Rate(f"{self.name}_dot", **_of_derivative(self))

    @property
    def ddot(self) -> Acceleration:
        return Acceleration(f"{self.name}_ddot", **_of_derivative(self))


class Rate(Moving):
    """The first derivative of a coordinate by time."""

    __slots__ = ()
    _rank = 3

    @property
    def dot(self) -> Acceleration:
        return Acceleration(f"{self.name.removesuffix('_dot')}_ddot", **_of_derivative(self))

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_dot"))), r"\dot")


class Acceleration(Moving):
    """The second derivative of a coordinate by time."""

    __slots__ = ()
    _rank = 4

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_ddot"))), r"\ddot")


class Speed(Coordinate):
    """A generalized speed with a name of its own; `.dot` is its derivative by time."""

    __slots__ = ()
    _rank = 1


class Input(Moving):
    """A value given from outside while the motion runs: a number, an array over time, or a function."""

    __slots__ = ()
    _rank = 2


def _make(kind: type, names: str, assumptions: dict) -> Any:
    if not isinstance(names, str) or not names.strip():
        raise ModelError([f"names of symbols are {names!r}; pass text such as 'q1 q2' or 'm1:4'"])
    return sp.symbols(names, cls=kind, **assumptions)


def coordinates(names: str, **assumptions: Any) -> Any:
    """Generalized coordinates from names as for sympy.symbols: `q1, q2 = coordinates("q1 q2")`."""
    return _make(Coordinate, names, assumptions)


def speeds(names: str, **assumptions: Any) -> Any:
    """Generalized speeds with names of their own, to be passed to joints as `speed=` or `speeds=`."""
    return _make(Speed, names, assumptions)


def parameters(names: str, **assumptions: Any) -> Any:
    """Parameters: plain SymPy symbols that get numbers when the motion is computed; declared by use."""
    return _make(sp.Symbol, names, assumptions)


def inputs(names: str, **assumptions: Any) -> Any:
    """Free inputs: forces, torques or anything else that is given at run time."""
    return _make(Input, names, assumptions)


def as_expression(value: Any, what: str) -> sp.Expr:
    """Take a number or SymPy expression over; dynamicsymbols and their derivatives become coordinates and rates.

    what   where it stands, for the message
    Raises ModelError for text (never evaluated), for NaN and infinity, and for anything that is no expression.
    """
    if isinstance(value, str):
        raise ModelError([f"{what} is the text {value!r}; text is never evaluated: "
                          "pass a number or an expression of SymPy symbols"])
    if hasattr(value, "item") and not isinstance(value, sp.Basic):
        value = value.item()
    if not isinstance(value, sp.Basic):
        if not isinstance(value, (int, float)) and not hasattr(value, "_sympy_") and not hasattr(value, "numerator"):
            raise ModelError([f"{what} is {value!r} of type {type(value).__name__}; "
                              "pass a number or an expression of SymPy symbols"])
        value = sp.sympify(value, strict=True)
    if value.has(sp.nan, sp.oo, -sp.oo, sp.zoo):
        raise ModelError([f"{what} is {value}; pass a finite number or expression"])
    if not isinstance(value, sp.Expr) or value.is_Matrix:
        raise ModelError([f"{what} is {value} of type {type(value).__name__}; pass a scalar expression"])
    if value.has(sp.I):
        raise ModelError([f"{what} is {value}, a complex number; pass a real number or expression"])
    taken = take_over(value)
    unknown = sorted(map(str, taken.atoms(AppliedUndef, sp.Derivative, sp.Integral)))
    if unknown:
        raise ModelError([f"{what} uses {', '.join(unknown)}, which has no value; write it out, "
                          "use a coordinate and its .dot, an input, or a function of your own, sd.External"])
    return taken


def take_over(expression: sp.Basic) -> Any:
    """Replace functions of t and their derivatives (SymPy's dynamicsymbols) by coordinates and rates."""
    if not expression.has(AppliedUndef, sp.Derivative):
        return expression
    replacements: dict[sp.Basic, sp.Basic] = {}
    for derivative in expression.atoms(sp.Derivative):
        base, count = derivative.expr, derivative.derivative_count
        if isinstance(base, AppliedUndef) and derivative.variables == (time,) * count and count <= 2:
            symbol = as_coordinate(base)
            replacements[derivative] = symbol.dot if count == 1 else symbol.ddot
    result = expression.xreplace(replacements)
    return result.xreplace({f: as_coordinate(f) for f in result.atoms(AppliedUndef) if f.args == (time,)})


def as_coordinate(value: Any) -> Any:
    """A coordinate as it is; a dynamicsymbol q(t) or a plain symbol under the same name."""
    if isinstance(value, AppliedUndef) and value.args == (time,):
        return Coordinate(value.func.__name__)
    if type(value) is sp.Symbol and value != time:
        return Coordinate(value.name, **value._assumptions_orig)
    return value
