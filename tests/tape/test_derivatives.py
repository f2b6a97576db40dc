"""Derivatives: forward, reverse and SymPy's own agree at random points, for every operation and for compositions."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from symdyn.tape import Node, Recorder, Tape
from symdyn.tape.differentiate import forward, jacobian, reverse
from symdyn.tape.node import COORDINATE
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.sympy_bridge import record_expression
from tests import helpers
from tests.helpers import swept

x, y = sp.symbols("x y", real=True)
third = sp.Rational(1, 3)

# Every operation of the table, its arguments inside its domain for x, y in (0.2, 1.2).
OF_OPERATION: dict[str, sp.Expr] = {
    "add": x + y, "sub": x - y, "mul": x * y, "div": x / y, "neg": -x * y, "sqrt": sp.sqrt(x + y), "pow": (1 + x) ** y,
    "sin": sp.sin(x * y), "cos": sp.cos(x - y), "tan": sp.tan(x), "asin": sp.asin(x * y / 2), "acos": sp.acos(x / 2),
    "atan": sp.atan(x / y), "atan2": sp.atan2(x - 1, y - third), "sinh": sp.sinh(x), "cosh": sp.cosh(x * y),
    "tanh": sp.tanh(x + y),
    "asinh": sp.asinh(x), "acosh": sp.acosh(2 + x * y), "atanh": sp.atanh(x * y / 3), "exp": sp.exp(x * y),
    "log": sp.log(x + y), "abs": sp.Abs(x - y), "sign": sp.sign(x - y) * x, "floor": sp.floor(4 * x) * y,
    "ceil": sp.ceiling(4 * x) * y, "erf": sp.erf(x - y), "min": sp.Min(x, y**2), "max": sp.Max(x, y**2),
    **{name: sp.Piecewise((x**2 * y, condition), (sp.sin(x + y), True)) for name, condition in {
        "lt": x < y, "le": x <= y, "gt": x > y, "ge": x >= y, "eq": sp.Eq(x, y), "ne": sp.Ne(x, y),
        "and": sp.And(x > y, x > third), "or": sp.Or(x > y, x > third), "not": sp.Not(sp.Eq(x, y)),
        "select": x > third}.items()},
    "pi": sp.pi * x * y,
}


def _record(expression: Any) -> tuple[Recorder, list[Node], Any]:
    recorder = Recorder()
    leaves = [recorder.leaf(s.name, COORDINATE) for s in (x, y)]
    return recorder, leaves, record_expression(recorder, expression, dict(zip((x, y), leaves, strict=True)))


def _check(expression: sp.Expr, seed: int) -> None:
    recorder, leaves, value = _record(expression)
    ways = Tape.of(recorder, forward=jacobian(recorder, [value], leaves, "forward"),
                   reverse=jacobian(recorder, [value], leaves, "reverse"))
    point = helpers.numbers("xy", seed)
    found = helpers.at(ways, point, 40)
    assert helpers.close(found["forward"], found["reverse"])
    wanted = [helpers.in_sympy(_derivative(expression, s), point) for s in (x, y)]
    assert helpers.close(found["forward"][0], wanted)


def _derivative(expression: sp.Expr, by: sp.Symbol) -> sp.Expr:
    """SymPy's derivative, steps (floor, ceiling) being constant between their jumps."""
    steps = {e: sp.Dummy() for e in expression.atoms(sp.floor, sp.ceiling)}
    return sp.diff(expression.xreplace(steps), by).xreplace({d: e for e, d in steps.items()})


def test_every_operation_has_an_example() -> None:
    assert set(OF_OPERATION) == set(OPERATIONS) - {"call", "item", "guard"}
    for op, expression in OF_OPERATION.items():
        recorder, _, value = _record(expression)
        assert op in {n.op for n in Tape.of(recorder, e=value).steps} | {"not", "neg", "sub", "add"}


@pytest.mark.parametrize("op", OF_OPERATION)
@pytest.mark.parametrize("seed", swept(range(2), 0))
def test_operation(op: str, seed: int) -> None:
    _check(OF_OPERATION[op], seed)


_PARTS: list[Callable[..., sp.Expr]] = [
    lambda a, b: a * sp.sin(b), lambda a, b: a / (2 + b**2), lambda a, b: sp.sqrt(1 + a**2 + b**2),
    lambda a, b: sp.atan2(a, 3 + b**2), lambda a, b: sp.erf(a) + sp.asinh(b),
    lambda a, b: (2 + sp.cos(a)) ** sp.sin(b), lambda a, b: sp.exp(-(a**2)) - b, lambda a, b: sp.log(2 + a**2) * sp.tanh(b),
    lambda a, b: sp.Piecewise((a * b, a > b), (a - b**3, True)), lambda a, b: sp.Abs(a - b / 7) * b]


def _compose(rng: random.Random, depth: int) -> sp.Expr:
    if depth == 0:
        return rng.choice([x, y, x + y, x - 2 * y])
    return rng.choice(_PARTS)(_compose(rng, depth - 1), _compose(rng, rng.randrange(depth)))


@pytest.mark.parametrize("seed", swept(range(20), *range(8)))
def test_random_composition(seed: int) -> None:
    _check(_compose(random.Random(seed), 3), seed)


def test_second_derivatives_are_symmetric() -> None:
    expression = sp.sin(x * y) * sp.exp(x / (1 + y**2)) + sp.sqrt(x + y**3)
    recorder, leaves, value = _record(expression)
    hessian = jacobian(recorder, jacobian(recorder, [value], leaves)[0].tolist(), leaves, "reverse")
    point = helpers.numbers("xy", 5)
    found = helpers.at(Tape.of(recorder, H=hessian), point)["H"]
    assert helpers.close(found, found.T)
    assert helpers.close(found[0, 1], helpers.in_sympy(sp.diff(expression, x, y), point))


def test_along_seeds() -> None:
    recorder, (a, b), value = _record(sp.sin(x) * y + x**3)
    along = forward(recorder, [value, a, 7], {a: b, b: 2})
    by_hand = recorder.cos(a) * b * b + 2 * recorder.sin(a) + 3 * a * a * b
    found = helpers.at(Tape.of(recorder, d=along[0] - by_hand), helpers.numbers("xy", 1))["d"]
    assert helpers.close(found[()], mpmath.mpf(0)) and along[1] is b and along[2] == 0


def test_derivative_by_an_inner_node() -> None:
    recorder, (a, b), _ = _record(x)
    inner = a * b
    value = recorder.sin(inner) + inner * a
    assert forward(recorder, [value], {inner: 1})[0] is recorder.cos(inner) + a
    assert reverse(recorder, value, [inner])[0] is recorder.cos(inner) + a


def test_zeros_of_structure_stay_zeros() -> None:
    recorder, leaves, value = _record(sp.sin(x) + 3)
    for mode in ("forward", "reverse", "auto"):
        matrix = jacobian(recorder, [value, 5, leaves[1] * 2], leaves, mode)
        assert matrix.shape == (3, 2) and matrix[0, 1] == 0 and list(matrix[1]) == [0, 0] and list(matrix[2]) == [0, 2]
    assert not isinstance(matrix[0, 1], Node)


def test_unknown_mode() -> None:
    recorder, leaves, value = _record(x)
    with pytest.raises(ValueError, match="mode 'sideways' asked for; there are 'forward', 'reverse' and 'auto'"):
        jacobian(recorder, [value], leaves, "sideways")


def test_one_gradient_costs_a_few_evaluations() -> None:
    recorder = Recorder()
    leaves = [recorder.leaf(f"x{k}", COORDINATE) for k in range(30)]
    value: Any = 1
    for leaf in leaves:
        value = value * recorder.sin(leaf)
    tape = Tape.of(recorder, e=value)
    gradient = Tape.of(recorder, g=np.array(reverse(recorder, value, leaves), dtype=object))
    assert gradient.operations <= 5 * tape.operations
