"""Between SymPy and the tape: take expressions over, and expand a tape back into explicit SymPy matrices."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import sympy as sp
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from symdyn.errors import UnsupportedExpression
from symdyn.tape.external import Result, UserFunction
from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, reachable
from symdyn.tape.walk import Arithmetic, walk

_FUNCTIONS: dict[type, str] = {getattr(sp, row.sympy): op for op, row in OPERATIONS.items()
                               if op not in ("add", "sub", "mul", "div", "neg", "pow", "sqrt", "pi", "select",
                                             "min", "max", "and", "or", "call", "item", "guard")}
_FOLDED = {sp.Min: "min", sp.Max: "max", sp.And: "and", sp.Or: "or"}
# Elementary functions in terms of others that generated code has.
_REWRITTEN: dict[type, Callable[..., sp.Expr]] = {
    sp.acot: lambda x: sp.atan(1 / x), sp.asec: lambda x: sp.acos(1 / x), sp.acsc: lambda x: sp.asin(1 / x),
    sp.acoth: lambda x: sp.atanh(1 / x), sp.asech: lambda x: sp.acosh(1 / x), sp.acsch: lambda x: sp.asinh(1 / x),
    sp.Mod: lambda a, b: a - b * sp.floor(a / b), sp.sinc: lambda x: sp.Piecewise((sp.sin(x) / x, sp.Ne(x, 0)), (1, True)),
    sp.frac: lambda x: x - sp.floor(x), sp.erfc: lambda x: 1 - sp.erf(x),
}
# The module of SymPy with curves of muscles and tendons, written out in the order of operations that keeps their digits.
_CURVES = "sympy.physics.biomechanics.curve"
_RECIPROCAL = {sp.sec: "cos", sp.csc: "sin", sp.cot: "tan", sp.sech: "cosh", sp.csch: "sinh", sp.coth: "tanh"}


def record_expression(recorder: Recorder, expression: Any, leaves: Mapping[sp.Basic, Any],
                      memory: dict[sp.Basic, Any] | None = None) -> Any:
    """Record a SymPy expression.

    leaves   what each free symbol stands for: a node or a number
    memory   results already recorded, shared between calls
    Raises UnsupportedExpression naming the part that has no counterpart on the tape.
    """
    memory = {} if memory is None else memory

    def take(e: sp.Basic) -> Any:
        known = memory.get(e)
        if known is None:
            known = memory[e] = convert(e)
        return known

    def fold(op: str, args: tuple) -> Any:
        result = take(args[0])
        for a in args[1:]:
            result = recorder.apply(op, result, take(a))
        return result

    def convert(e: sp.Basic) -> Any:
        if e in leaves:
            return leaves[e]
        if isinstance(e, (sp.Integer, sp.Rational)):
            return Fraction(int(e.p), int(e.q)) if e.q != 1 else int(e.p)
        if isinstance(e, sp.Float):
            return Fraction(float(e))
        if isinstance(e, sp.Add):
            total: Any = 0
            for a in e.args:
                total = recorder.add(total, take(a))
            return total
        if isinstance(e, sp.Mul):
            over, under = [], []
            for a in e.args:
                if isinstance(a, sp.Pow) and a.exp.is_Number and a.exp.is_negative:
                    under.append(recorder.pow(take(a.base), take(-a.exp)))
                else:
                    over.append(take(a))
            product: Any = 1
            for factor in over:
                product = recorder.mul(product, factor)
            for factor in under:
                product = recorder.div(product, factor)
            return product
        if isinstance(e, sp.Pow):
            if e.base is sp.S.Exp1:
                return recorder.apply("exp", take(e.exp))
            return recorder.pow(take(e.base), take(e.exp))
        if isinstance(e, Result):
            return recorder.call(e.intrinsic, [take(a) for a in e.args])[e.index]
        if isinstance(e, sp.Piecewise):
            return piecewise(e)
        if isinstance(e, sp.UnevaluatedExpr):
            return take(e.args[0])
        if e is sp.S.Pi:
            return recorder.pi()
        if e is sp.S.Exp1:
            return recorder.apply("exp", 1)
        if isinstance(e, (BooleanTrue, BooleanFalse)):
            return bool(e)
        if isinstance(e, sp.ITE):
            condition, yes, no = map(take, e.args)
            return recorder.apply("or", recorder.apply("and", condition, yes),
                                  recorder.apply("and", recorder.apply("not", condition), no))
        for kind, op in _FOLDED.items():
            if isinstance(e, kind):
                return fold(op, e.args)
        for kind, op in _RECIPROCAL.items():
            if isinstance(e, kind):
                return recorder.div(1, recorder.apply(op, take(e.args[0])))
        if isinstance(e, sp.Heaviside):
            x = take(e.args[0])
            half = take(e.args[1]) if len(e.args) > 1 else Fraction(1, 2)
            return recorder.apply("select", recorder.apply("gt", x, 0), 1,
                                  recorder.apply("select", recorder.apply("eq", x, 0), half, 0))
        if type(e).__module__ == _CURVES:
            return take(e.doit(deep=False, evaluate=False))
        rewritten = _REWRITTEN.get(type(e))
        if rewritten is not None:
            return take(rewritten(*e.args))
        operation = _FUNCTIONS.get(type(e))
        if operation is None:
            raise UnsupportedExpression(
                f"{e} ({type(e).__name__}) has no counterpart in generated code; "
                "use elementary functions, Piecewise, Min, Max, Abs, sign, atan2, floor or Heaviside")
        return recorder.apply(operation, *[take(a) for a in e.args])

    def piecewise(e: sp.Piecewise) -> Any:
        if e.args[-1].cond is not sp.S.true:
            raise UnsupportedExpression(
                f"{e} is not defined everywhere; end the Piecewise with (value, True)")
        result = take(e.args[-1].expr)
        for value, condition in reversed(e.args[:-1]):
            result = recorder.apply("select", take(condition), take(value), result)
        return result

    return take(sp.sympify(expression) if isinstance(expression, (int, float)) else expression)


def expand(output: Output, symbols: Mapping[Node, sp.Expr], named: Mapping[Node, sp.Expr] | None = None) -> Any:
    """The output as explicit SymPy: a scalar expression, or a matrix (column for a vector).

    symbols   leaf -> the user's symbol; leaves without one, such as the directions of derivatives, keep their names
    named     nodes to leave as they are, under these symbols
    """
    done = walk(reachable(output.entries), _Explicit(symbols), named or {})
    entries = [done.of(e) for e in output.entries]
    if output.shape == ():
        return entries[0]
    rows, columns = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, columns, entries)


class _Explicit(Arithmetic):
    """Expressions of SymPy."""

    def __init__(self, symbols: Mapping[Node, sp.Expr]) -> None:
        self.symbols = symbols

    def leaf(self, node: Node) -> Any:
        return self.symbols[node] if node in self.symbols else sp.Symbol(node.args[1])

    def number(self, value: Any) -> Any:
        return number(value)

    def step(self, node: Node, args: list[Any]) -> Any:
        return args[0] if node.op == "guard" else applied(node.op, args)

    def call(self, node: Node, args: list[Any]) -> Any:
        intrinsic = node.args[0]
        if isinstance(intrinsic, UserFunction):
            return intrinsic.applied(args)
        if not intrinsic.letters:
            raise UnsupportedExpression("it is computed by a numeric algorithm, without an explicit form; print the matrix and "
                                        "the right side instead")
        return [sp.Function(letter)(*args) for letter in intrinsic.letters]


# Powers of two that floats reach, above and below one, and some less.
_EXPONENT = 1000


def number(value: Any) -> Any:
    """Short fractions as fractions, long ones as the decimal number they stand for."""
    if isinstance(value, bool):
        return sp.true if value else sp.false
    value = Fraction(value)
    if printed_as_decimal(value):
        return sp.Float(repr(float(value)))
    return sp.Rational(value.numerator, value.denominator)


def printed_as_decimal(value: Fraction) -> bool:
    """Whether a number stands on the tape for a decimal one, and is printed as such: one in the range of floats."""
    below = value.denominator
    return (below > 1000 and (below > 10**6 or below & (below - 1) == 0)
            and abs(value.numerator.bit_length() - below.bit_length()) < _EXPONENT)


def applied(op: str, a: list) -> Any:
    """An operation of the tape with these arguments in SymPy."""
    arithmetic = {"add": lambda: a[0] + a[1], "sub": lambda: a[0] - a[1], "mul": lambda: a[0] * a[1],
                  "div": lambda: a[0] / a[1], "neg": lambda: -a[0], "pow": lambda: a[0] ** a[1],
                  "pi": lambda: sp.pi, "select": lambda: sp.Piecewise((a[1], a[0]), (a[2], True))}
    return arithmetic[op]() if op in arithmetic else getattr(sp, OPERATIONS[op].sympy)(*a)
