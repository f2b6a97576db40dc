"""Symbols of a model: coordinates with Newton's dots, parameters, inputs, time.

All are SymPy symbols, so that expressions print and differentiate as anywhere else in SymPy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from inspect import getattr_static
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.errors import ModelError
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Scalar

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


class Timed(Moving):
    """A symbol that stands for a function of time: SymPy's derivatives by `symdyn.t` are total ones.

    q.diff(t) and q.diff() are q.dot, sin(q).diff(t) is cos(q)*q.dot and q.diff(t, 2) is q.ddot; what has no symbol, such as the
    derivative of an input, stays an unevaluated Derivative, which no model takes. To that end t is one of the free symbols, as
    it is one of those of SymPy's q(t). Derivatives by t and by a rate do not commute: take them one after the other, as in
    T.diff(q.dot).diff(t).
    """

    __slots__ = ()

    @property
    def free_symbols(self) -> set[sp.Basic]:
        return {self, time}

    def diff(self, *symbols: Any, **assumptions: bool) -> Any:
        """The derivative as of any expression; without symbols, that by time."""
        return super().diff(*(symbols or (time,)), **assumptions)

    def _eval_derivative(self, s: Any) -> Any:
        return getattr(self, "dot", None) if s == time else super()._eval_derivative(s)

    def _eval_derivative_n_times(self, s: Any, n: Any) -> Any:
        # An atom is taken for constant in SymPy's own rule; that of compound expressions derives n times.
        return sp.Basic._eval_derivative_n_times(self, s, n) if s == time else super()._eval_derivative_n_times(s, n)


class Coordinate(Timed):
    """A generalized coordinate; `.dot` and `.ddot` are its derivatives by time, symbols too."""

    __slots__ = ()

    @property
    def dot(self) -> Rate:
        return Rate(f"{self.name}_dot", **_of_derivative(self))

    @property
    def ddot(self) -> Acceleration:
        return Acceleration(f"{self.name}_ddot", **_of_derivative(self))


class Rate(Timed):
    """The first derivative of a coordinate by time."""

    __slots__ = ()
    _rank = 3

    @property
    def dot(self) -> Acceleration:
        return Acceleration(f"{self.name.removesuffix('_dot')}_ddot", **_of_derivative(self))

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_dot"))), r"\dot")


class Acceleration(Timed):
    """The second derivative of a coordinate by time."""

    __slots__ = ()
    _rank = 4

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_ddot"))), r"\ddot")


class Speed(Coordinate):
    """A generalized speed with a name of its own; `.dot` is its derivative by time."""

    __slots__ = ()
    _rank = 1


class Input(Timed):
    """A value given from outside while the motion runs: a number, an array over time, or a function."""

    __slots__ = ()
    _rank = 2


class GivenMotion(Input):
    """A coordinate that follows an input; `.dot` and `.ddot` are its rate and acceleration, which are given with it."""

    __slots__ = ()

    @property
    def dot(self) -> GivenRate:
        return GivenRate(f"{self.name}_dot", **_of_derivative(self))

    @property
    def ddot(self) -> GivenAcceleration:
        return GivenAcceleration(f"{self.name}_ddot", **_of_derivative(self))


class GivenRate(Input):
    """The rate of a motion that is given as an input."""

    __slots__ = ()
    _rank = 3

    @property
    def dot(self) -> GivenAcceleration:
        return GivenAcceleration(f"{self.name.removesuffix('_dot')}_ddot", **_of_derivative(self))

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_dot"))), r"\dot")


class GivenAcceleration(Input):
    """The acceleration of a motion that is given as an input."""

    __slots__ = ()
    _rank = 4

    def _latex(self, printer: Any) -> str:
        return _dotted(printer.doprint(sp.Symbol(self.name.removesuffix("_ddot"))), r"\ddot")


def with_rates(inputs: Iterable[Input]) -> tuple[Input, ...]:
    """Inputs in their order, each motion among them together with its rate and acceleration, whichever of them is used."""
    result: dict[Input, None] = {}
    for symbol in inputs:
        if isinstance(symbol, (GivenRate, GivenAcceleration)):
            name = symbol.name.removesuffix("_dot" if isinstance(symbol, GivenRate) else "_ddot")
            symbol = GivenMotion(name, **symbol._assumptions_orig)
        result.update(dict.fromkeys([symbol, symbol.dot, symbol.ddot] if isinstance(symbol, GivenMotion) else [symbol]))
    return tuple(result)


if TYPE_CHECKING:
    One = TypeVar("One", bound=sp.Symbol, covariant=True)

    class _Several(Generic[One]):
        """The text of names decides whether there is one symbol or a tuple of them; no type can read it, so that both uses are
        allowed: `x = sd.coordinates("x")` and `x, y = sd.coordinates("x y")`."""

        def __iter__(self) -> Iterator[One]: ...
        def __len__(self) -> int: ...
        @overload
        def __getitem__(self, index: int) -> One: ...
        @overload
        def __getitem__(self, index: slice) -> tuple[One, ...]: ...
        def __getitem__(self, index: int | slice) -> One | tuple[One, ...]: ...

    class Coordinates(Coordinate, _Several[Coordinate]):
        """A coordinate or several."""

    class Speeds(Speed, _Several[Speed]):
        """A speed or several."""

    class Parameters(sp.Symbol, _Several[sp.Symbol]):
        """A parameter or several."""

    class Inputs(Input, _Several[Input]):
        """A input or several."""

    class GivenMotions(GivenMotion, _Several[GivenMotion]):
        """A given motion or several."""


def _make(kind: type, names: str, assumptions: dict) -> Any:
    if not isinstance(names, str) or not names.strip() or not names.isprintable():
        raise ModelError([f"names of symbols are {shown(names)}; pass text such as 'q1 q2' or 'm1:4'"])
    made = sp.symbols(names, cls=kind, **assumptions)
    if time in (made if isinstance(made, (tuple, list)) else (made,)):
        raise ModelError([f"the symbols {shown(names)} were requested, and t is the time, symdyn.t; give what t stands for here "
                          "another name"])
    return made


def coordinates(names: str, **assumptions: bool) -> Coordinates:
    """Generalized coordinates from names as for sympy.symbols: `q1, q2 = coordinates("q1 q2")`.

    >>> x, theta = sd.coordinates("x theta")
    >>> theta.dot, theta.ddot
    (theta_dot, theta_ddot)
    """
    return _make(Coordinate, names, assumptions)


def speeds(names: str, **assumptions: bool) -> Speeds:
    """Generalized speeds with names of their own, to be passed to joints as `speed=` or `speeds=`.

    >>> sd.speeds("w1:3")
    (w1, w2)
    """
    return _make(Speed, names, assumptions)


def parameters(names: str, **assumptions: bool) -> Parameters:
    """Parameters: plain SymPy symbols that get numbers when the motion is computed; declared by use.

    >>> m, l = sd.parameters("m l")
    >>> m * l**2
    l**2*m
    """
    return _make(sp.Symbol, names, assumptions)


def inputs(names: str, **assumptions: bool) -> Inputs:
    """Free inputs: forces, torques or anything else that is given at run time.

    >>> F = sd.inputs("F")
    >>> F * sp.cos(sd.t)
    F*cos(t)
    """
    return _make(Input, names, assumptions)


def motions(names: str, **assumptions: bool) -> GivenMotions:
    """Coordinates that follow inputs: value, rate and acceleration are given at run time, and no equation is solved for them.

    names   as for sympy.symbols: `z = sd.motions("z")`
    They stand where an expression in t may stand: as `coordinate=` of a joint, in constraints, in the motion of the ground, in
    loads and outputs; `z.dot` and `z.ddot` are the rate and the acceleration. `module.simulate(inputs={z: ...})` takes a
    function of t that returns the three, a spline of SciPy, a table, or a number.
    Raises ModelError for what is no name.

    >>> import symdyn as sd
    >>> z = sd.motions("z")
    >>> (z**2).diff(sd.t)
    2*z*z_dot
    """
    return _make(GivenMotion, names, assumptions)


def flat(matrix: sp.MatrixBase) -> Sequence[Any]:
    """The entries of a matrix, row by row; an immutable one holds them, and SymPy makes those of others from its own numbers."""
    return matrix.args[2].args if isinstance(matrix, sp.ImmutableMatrix) else matrix.flat()


def symbols_of(expression: Any) -> set[Any]:
    """The free symbols of an expression or matrix; t only where it stands there itself (see Timed)."""
    if isinstance(expression, (sp.Symbol, sp.Number)):
        return {expression} if isinstance(expression, sp.Symbol) else set()
    entries = flat(expression) if isinstance(expression, sp.MatrixBase) else [expression]
    if all(isinstance(e, sp.Expr) for e in entries):
        parts = parts_of(*entries)
        if all(_free_of_its_own(kind) for kind in {type(part) for part in parts}):  # type: ignore[arg-type]
            return {part for part in parts if isinstance(part, sp.Symbol)}
    free: set[Any] = expression.free_symbols
    return free - {time} if time in free and not expression.has(time) else free


def described(symbol: sp.Symbol) -> str:
    """Kind of a symbol with its assumptions, which distinguish symbols of one name in messages."""
    kinds = {Coordinate: "a coordinate", Speed: "a speed", Input: "an input", GivenMotion: "a motion",
             GivenRate: "the rate of a motion", GivenAcceleration: "the acceleration of a motion",
             Rate: "the derivative of a coordinate or speed", Acceleration: "a second derivative"}
    assumptions = ", ".join(f"{name}={value}" for name, value in symbol._assumptions_orig.items())
    return f"{kinds.get(type(symbol), 'a parameter')} {f'with {assumptions}' if assumptions else 'without assumptions'}"


def partial_rate(value: Scalar) -> sp.Expr:
    """The partial derivative by t of an expression or matrix: coordinates, their derivatives, speeds and inputs are constant.

    It is `symdyn.rate` for a mechanism at rest, such as the C_t of a constraint; `value.diff(symdyn.t)` is the total
    derivative. Raises ModelError for what is neither expression nor matrix.

    >>> q = sd.coordinates("q")
    >>> sd.partial_rate(sd.t * sp.sin(q))
    sin(q)
    """
    if not isinstance(value, (sp.Expr, sp.MatrixBase)):
        raise ModelError([f"partial_rate was given {value!r} of type {type(value).__name__}; pass an expression or a matrix"])
    held = {symbol: sp.Dummy(symbol.name) for symbol in value.atoms(Timed)}
    return value.xreplace(held).diff(time).xreplace({dummy: symbol for symbol, dummy in held.items()})


def as_expression(value: Any, what: str) -> sp.Expr:
    """Take a number or SymPy expression over; dynamicsymbols and their derivatives become coordinates and rates.

    what   where it stands, for the message
    Raises ModelError for text (never evaluated), for NaN and infinity, and for anything that is no expression.
    """
    if isinstance(value, str):
        raise ModelError([f"{what} is the text {shown(value)}; text is never evaluated: "
                          "pass a number or an expression of SymPy symbols"])
    if isinstance(value, np.ma.MaskedArray):
        raise ModelError([f"{what} is masked; pass a real number or an expression of SymPy symbols"])
    if isinstance(value, (np.ndarray, np.generic)):
        if value.size != 1:
            raise ModelError([f"{what} is {shown(value)}; pass a number or an expression of SymPy symbols"])
        return as_expression(value.item(), what) if isinstance(value.item(), str) else _taken(value.item(), what)
    return _taken(value, what)


def _taken(value: Any, what: str) -> sp.Expr:
    """A number or expression; see `as_expression`."""
    if isinstance(value, sp.Symbol):
        return value
    if type(value) is int and abs(value) < 2**53:
        return sp.Integer(value)
    if not isinstance(value, sp.Basic):
        if not isinstance(value, (int, float)) and not hasattr(value, "_sympy_") and not hasattr(value, "numerator"):
            raise ModelError([f"{what} is {shown(value)} of type {type(value).__name__}; "
                              "pass a number or an expression of SymPy symbols"])
        try:
            value = sp.sympify(value, strict=True)
        except sp.SympifyError:
            value = None
    if not isinstance(value, sp.Basic):
        raise ModelError([f"{what} is {shown(value)}; pass a number or an expression of SymPy symbols"])
    parts = parts_of(value)
    if not parts.isdisjoint((sp.nan, sp.oo, -sp.oo, sp.zoo)):
        raise ModelError([f"{what} is {value}; pass a finite number or expression"])
    beyond = [n for n in parts if isinstance(n, sp.Number) and not _is_double(n)]
    if beyond:
        raise ModelError([f"{what} holds {shown(int(beyond[0]))}, which is beyond the range of double precision, 1.8e308; pass "
                          "smaller numbers, in other units if need be"])
    if not isinstance(value, sp.Expr) or value.is_Matrix:
        raise ModelError([f"{what} is {value} of type {type(value).__name__}; pass a scalar expression"])
    if sp.I in parts:
        raise ModelError([f"{what} is {value}, a complex number; pass a real number or expression"])
    if not any(isinstance(part, (AppliedUndef, sp.Derivative, sp.Integral)) for part in parts):
        return value
    taken = take_over(value)
    unknown = sorted(map(str, taken.atoms(AppliedUndef, sp.Derivative, sp.Integral)))
    if unknown:
        raise ModelError([f"{what} uses {', '.join(unknown)}, which has no value; write it out, "
                          "use a coordinate and its .dot, an input, or a function of your own, sd.External"])
    return taken


def parts_of(*expressions: sp.Basic) -> set[sp.Basic]:
    """The expressions and all that they are made of, each once."""
    result: set[sp.Basic] = set()
    left = list(expressions)
    while left:
        part = left.pop()
        if part not in result:
            result.add(part)
            left.extend(part.args)
    return result


@cache
def _free_of_its_own(kind: Any) -> bool:
    """Whether the free symbols of an expression of this kind are those of its parts; not of sums and integrals."""
    return issubclass(kind, sp.Symbol) or getattr_static(kind, "free_symbols", None) is sp.Basic.__dict__["free_symbols"]


def _is_double(value: sp.Number) -> bool:
    """Whether a number of SymPy is within the range of double precision."""
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def finite(value: Any) -> float | None:
    """A finite real number, also of SymPy and NumPy, as a double; None for anything else, such as True, and beyond the range of
    doubles."""
    if hasattr(value, "item") and getattr(value, "ndim", 1) == 0 and not isinstance(value, sp.Basic):
        value = None if np.ma.is_masked(value) else value.item()
    if isinstance(value, bool):  # which Python counts among whole numbers
        return None
    if not isinstance(value, (int, float)) and not (isinstance(value, sp.Expr) and value.is_number):
        return None
    try:
        result = float(value)
    except (OverflowError, TypeError, ValueError):
        return None
    return result if math.isfinite(result) else None


def take_over(expression: sp.Basic) -> Any:
    """Replace functions of t and their derivatives (SymPy's dynamicsymbols) by coordinates and rates.

    Derivatives by t that were left unevaluated, such as sympy.Derivative(q, t), are evaluated.
    """
    if not expression.has(AppliedUndef, sp.Derivative):
        return expression
    replacements: dict[sp.Basic, sp.Basic] = {}
    for derivative in expression.atoms(sp.Derivative):
        base, count = derivative.expr, derivative.derivative_count
        if isinstance(base, AppliedUndef) and derivative.variables == (time,) * count and count <= 2:
            symbol = as_coordinate(base)
            replacements[derivative] = symbol.dot if count == 1 else symbol.ddot
    result = expression.xreplace(replacements)
    result = result.xreplace({f: as_coordinate(f) for f in result.atoms(AppliedUndef) if f.args == (time,)})
    unevaluated = [d for d in result.atoms(sp.Derivative) if set(d.variables) == {time} and not d.has(AppliedUndef)]
    return result.xreplace({derivative: derivative.doit() for derivative in unevaluated})


def as_coordinate(value: Any) -> Any:
    """A coordinate as it is; a dynamicsymbol q(t) or a plain symbol under the same name, with the same assumptions."""
    if isinstance(value, AppliedUndef) and value.args == (time,):
        return Coordinate(value.func.__name__, **value.func._kwargs)
    if type(value) is sp.Symbol and value != time:
        return Coordinate(value.name, **value._assumptions_orig)
    return value
