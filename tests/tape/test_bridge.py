"""SymPy expressions on the tape and back: the same numbers at 30 digits as SymPy's own evaluation."""

from __future__ import annotations

import itertools
import random
from fractions import Fraction
from typing import Any

import mpmath
import pytest
import sympy as sp

from symdyn.errors import UnsupportedExpression
from symdyn.tape import Node, Recorder, Tape
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import COORDINATE
from symdyn.tape.sympy_bridge import expand, number, record_expression
from tests import helpers
from tests.helpers import swept

x, y, z = SYMBOLS = sp.symbols("x y z", real=True)
half = sp.Rational(1, 2)

EXPRESSIONS = {
    "sum": x + 2 * y - z / 3 + 5, "product": 3 * x * y / z, "powers": x**5 * y**-3 + z**-2, "float": 0.1 * x + 2.5e-7,
    "roots": sp.sqrt(x) * y ** sp.Rational(5, 2) / sp.sqrt(z + 1), "cube root": sp.cbrt(x + 3) + x ** sp.Rational(-1, 3),
    "symbolic power": (1 + x) ** y + 2**z + x**-z, "exp": sp.exp(x * y) + sp.exp(-z),
    "e": sp.E * x + sp.E, "pi": sp.pi * x + sp.pi**2, "log": sp.log(x + 2) * sp.log(5), "log10": sp.log(x + 2, 10),
    "sin": sp.sin(x - y), "cos": sp.cos(2 * x), "tan": sp.tan(x / 2), "sec": sp.sec(x),
    "csc": sp.csc(x + 1), "cot": sp.cot(y + 1),
    "asin": sp.asin(x / 4), "acos": sp.acos(-y / 4), "atan": sp.atan(3 * z), "atan2": sp.atan2(y - 1, x - 1) + sp.atan2(-1, x),
    "sinh": sp.sinh(x), "cosh": sp.cosh(y), "tanh": sp.tanh(z), "sech": sp.sech(x),
    "csch": sp.csch(y + 1), "coth": sp.coth(z + 1),
    "asinh": sp.asinh(x), "acosh": sp.acosh(2 + y), "atanh": sp.atanh(z / 3), "erf": sp.erf(x - y),
    "abs": sp.Abs(x - y) + sp.Abs(sp.sin(z)), "sign": sp.sign(x - 1) * y,
    "floor": sp.floor(3 * x - 2), "ceiling": sp.ceiling(y * 3),
    "min": sp.Min(x, y, z, 1), "max": sp.Max(x, y - z, half), "heaviside": sp.Heaviside(x - y) * z + sp.Heaviside(y, 0),
    "piecewise": sp.Piecewise((x**2, x < half), (sp.sin(y), sp.And(y > half, z <= 1)), (z, True)),
    "nested": sp.Piecewise((sp.Piecewise((1, y > z), (x, True)), x >= half), (sp.Max(y, z), True)),
    "logic": sp.Piecewise((1, sp.Or(sp.And(x > y, y > z), sp.Not(sp.Eq(x, z)))), (2, True)),
    "unequal": sp.Piecewise((x, sp.Ne(x, y)), (0, True)), "unevaluated": sp.UnevaluatedExpr(x + y) * 2,
    "deep": sp.sqrt(sp.sin(x * sp.exp(-y)) ** 2 + sp.cos(z) ** 4) / (1 + sp.atan2(x, y) ** 2),
}


def _record(expression: Any) -> tuple[Recorder, dict[str, Node], Any]:
    recorder = Recorder()
    leaves = {s: recorder.leaf(s.name, COORDINATE) for s in SYMBOLS}
    return recorder, {s.name: leaf for s, leaf in leaves.items()}, record_expression(recorder, expression, leaves)


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_evaluates_as_sympy_does(name: str) -> None:
    expression = EXPRESSIONS[name]
    recorder, leaves, value = _record(expression)
    tape = Tape.of(recorder, e=value)
    back = expand(tape.outputs["e"], {leaf: s for s, leaf in zip(SYMBOLS, leaves.values(), strict=True)})
    for seed in range(3):
        point = helpers.numbers("xyz", seed, 0.1, 1.9)
        found = helpers.at(tape, point)["e"][()]
        assert helpers.close(found, helpers.in_sympy(_exact(expression), point))
        assert helpers.close(found, helpers.in_sympy(_exact(sp.sympify(back)), point), 1e-14)


@pytest.mark.parametrize("name", ["sign", "floor", "ceiling", "min", "max", "heaviside", "piecewise", "nested", "logic",
                                  "unequal"])
def test_values_at_jumps_and_edges_are_those_of_sympy(name: str) -> None:
    recorder, _, value = _record(EXPRESSIONS[name])
    tape = Tape.of(recorder, e=value)
    for place in itertools.product((Fraction(0), Fraction(1, 2), Fraction(1)), repeat=3):
        point = dict(zip("xyz", place, strict=True))
        assert helpers.close(helpers.at(tape, point)["e"][()], helpers.in_sympy(EXPRESSIONS[name], point)), place


def _exact(expression: sp.Expr) -> sp.Expr:
    """Floats as the binary numbers they are."""
    return expression.xreplace({f: sp.Rational(*float(f).as_integer_ratio()) for f in expression.atoms(sp.Float)})


_UNARY = [sp.sin, sp.cos, sp.tanh, sp.atan, sp.asinh, sp.erf, sp.Abs, sp.sign, lambda a: sp.exp(-(a**2)),
          lambda a: 1 / (2 + a**2), lambda a: sp.sqrt(1 + a**2), lambda a: sp.log(3 + sp.sin(a)), lambda a: -a, lambda a: a**3]
_BINARY = [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, sp.Min, sp.Max, lambda a, b: a / (2 + sp.cos(b)),
           lambda a, b: sp.atan2(a, 2 + b**2), lambda a, b: (2 + sp.sin(a)) ** sp.cos(b),
           lambda a, b: sp.Piecewise((a, a < b), (b**2, sp.And(a > 1, b > 0)), (a * b, True))]


def _random(rng: random.Random, depth: int) -> sp.Expr:
    if depth == 0:
        return rng.choice([*SYMBOLS, sp.Rational(rng.randint(-9, 9), rng.randint(1, 7))])
    if rng.random() < 0.4:
        return rng.choice(_UNARY)(_random(rng, depth - 1))
    return rng.choice(_BINARY)(_random(rng, depth - 1), _random(rng, rng.randrange(depth)))


@pytest.mark.parametrize("seed", swept(range(25), *range(10)))
def test_random_expressions_there_and_back(seed: int) -> None:
    expression = _random(random.Random(seed), 4)
    recorder, leaves, value = _record(expression)
    tape = Tape.of(recorder, e=value)
    back = expand(tape.outputs["e"], {leaf: s for s, leaf in zip(SYMBOLS, leaves.values(), strict=True)})
    again = Tape.of(recorder, e=record_expression(recorder, back, dict(zip(SYMBOLS, leaves.values(), strict=True))))
    point = helpers.numbers("xyz", seed, -1.5, 1.5)
    found = helpers.at(tape, point)["e"]
    assert helpers.close(found[()], helpers.in_sympy(expression, point))
    assert helpers.close(found, helpers.at(again, point)["e"])


def test_common_parts_are_recorded_once() -> None:
    recorder, leaves, _ = _record(x)
    memory: dict = {}
    take = lambda e: record_expression(recorder, e, dict(zip(SYMBOLS, leaves.values(), strict=True)), memory)
    assert take(sp.sin(x * y) + 1) is take(sp.sin(x * y) + 1)
    assert take(x - y).op == "sub" and take(y - x) is -take(x - y)
    assert take(sp.Integer(3)) == 3 and take(2) == 2 and take(0.5) == Fraction(1, 2)


@pytest.mark.parametrize("expression", [sp.gamma(x), sp.I * x, sp.Symbol("unknown"), sp.Integral(sp.sin(x), x),
                                        sp.Function("f")(x), sp.oo, sp.zeta(x), sp.LambertW(x), sp.besselj(0, x)])
def test_what_has_no_counterpart_is_named(expression: sp.Expr) -> None:
    with pytest.raises(UnsupportedExpression) as caught:
        _record(1 + expression if expression is not sp.oo else expression)
    message = str(caught.value)
    assert "has no counterpart in generated code" in message and "use elementary functions" in message
    assert any(str(part) in message for part in sp.preorder_traversal(expression))


def test_piecewise_without_default_is_rejected() -> None:
    with pytest.raises(UnsupportedExpression, match=r"not defined everywhere; end the Piecewise with \(value, True\)"):
        _record(sp.Piecewise((x, x > 0), (y, y > 0)))


def test_division_by_zero_is_rejected() -> None:
    recorder = Recorder()
    with pytest.raises(ZeroDivisionError):
        record_expression(recorder, 1 / x, {x: 0})


def test_expand_gives_the_shape_of_the_output() -> None:
    recorder, leaves, value = _record(x * y)
    symbols = dict(zip(leaves.values(), SYMBOLS, strict=True))
    tape = Tape.of(recorder, scalar=value, vector=[value, 1], matrix=[[value, 0], [leaves["z"], 2]])
    assert expand(tape.outputs["scalar"], symbols) == x * y
    assert expand(tape.outputs["vector"], symbols) == sp.Matrix([x * y, 1])
    assert expand(tape.outputs["matrix"], symbols) == sp.Matrix([[x * y, 0], [z, 2]])
    named = sp.Symbol("p")
    assert expand(tape.outputs["vector"], symbols, {value: named}) == sp.Matrix([named, 1])


def test_numbers_print_as_people_write_them() -> None:
    assert number(Fraction(1, 3)) == sp.Rational(1, 3) and number(2) == 2 and number(True) is sp.true
    assert number(Fraction(0.1)) == sp.Float("0.1") and number(0.5) == half


@pytest.mark.parametrize(("expression", "point"), [
    (sp.acot(x), "0.7"), (sp.asec(x), "1.7"), (sp.acsc(x), "-1.7"), (sp.acoth(x), "2.5"), (sp.asech(x), "0.4"),
    (sp.acsch(x), "-0.4"), (sp.Mod(x, 2), "-3.7"), (sp.sinc(x), "0.3"), (sp.sinc(x), "0"), (sp.frac(x), "-1.2"),
    (sp.erfc(x), "0.3"),
])
def test_functions_written_by_others(expression: sp.Expr, point: str) -> None:
    recorder = Recorder()
    tape = Tape.of(recorder, y=record_expression(recorder, expression, {x: recorder.leaf("x", COORDINATE)}))
    found = evaluate(tape, {"x": mpmath.mpf(point)}, 30)["y"].item()
    wanted = expression.subs(x, sp.Float(point, 40)).evalf(30)
    assert abs(sp.Float(str(found), 35) - wanted) < 1e-15
