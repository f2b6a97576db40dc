"""One walk over a tape with many arithmetics: all give the same numbers."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from symdyn.exact.walk import Exact
from symdyn.formulation.textbook.doubles import Doubles
from symdyn.model.elements.cube import Cube
from symdyn.precision.program import program
from symdyn.tape import Node, Output, Recorder, Tape
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intervals import ZERO, Interval, Jet, enclosures
from symdyn.tape.node import COORDINATE
from symdyn.tape.passes import Again
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.walk import Arithmetic, walk
from tests.helpers import swept

LEAVES = ("x", "y", "z")
SMOOTH = ("sqrt", "sin", "cos", "tan", "asin", "atan", "sinh", "cosh", "tanh", "asinh", "exp", "log", "abs", "sign", "floor",
          "erf")


def drawn(seed: int) -> Tape:
    """Random steps on three leaves between 1/4 and 3/4, whose values stay there."""
    stream, r = random.Random(seed), Recorder()
    values: list[Any] = [r.leaf(name, COORDINATE) for name in LEAVES]
    for _ in range(60):
        a, b = stream.choice(values), stream.choice(values)
        kind = stream.randrange(5)
        if kind == 0:
            made = r.apply(stream.choice(SMOOTH), a)
        elif kind == 1:
            made = stream.choice((r.add, r.sub, r.mul, r.div, r.pow))(a, b)
        elif kind == 2:
            made = r.apply(stream.choice(("atan2", "min", "max")), a, b)
        elif kind == 3:
            made = r.apply("select", r.apply(stream.choice(("lt", "ge")), a, Fraction(1, 2)), b, r.neg(a))
        else:
            made = r.mul(r.add(a, Fraction(3, 7)), stream.randint(1, 3))
        # Back between 1/4 and 3/4.
        values.append(r.add(Fraction(1, 2), r.mul(Fraction(1, 4), r.apply("tanh", made))))
    return Tape.of(r, out=np.array(values[-10:], dtype=object))


def at(seed: int) -> dict[str, float]:
    stream = random.Random(seed)
    return {name: stream.uniform(0.25, 0.75) for name in LEAVES}


@pytest.mark.parametrize("seed", swept(range(12), *range(8)))
def test_arithmetics_give_the_same(seed: int) -> None:
    tape, values = drawn(seed), at(seed)
    entries = tape.outputs["out"].entries
    exact = evaluate(tape, values, 40)["out"]
    wanted = np.array([float(v) for v in exact])
    context = mpmath.mp.clone()
    context.dps = 40
    assert program(tape, context, {}, LEAVES)([context.mpf(values[name]) for name in LEAVES]) == exact.tolist()
    nodes = [e for e in entries if isinstance(e, Node)]
    rows = evaluate_rows(tape, {name: np.array([value] * 2) for name, value in values.items()}, 2)["out"]
    again = walk(tape.steps, Again(recorder := Recorder()))
    copied = Tape.of(recorder, out=np.array([again.of(e) for e in entries], dtype=object))
    for found in (Doubles(nodes).at(values), rows[0], rows[1], evaluate_rows(copied, values, 1)["out"][0]):
        np.testing.assert_allclose(np.array(found, dtype=float), wanted, rtol=1e-9)
    leaves = {leaf: Jet(Interval(leaf, leaf), ZERO, ZERO) for leaf in tape.inputs}
    held = [e for jet in enclosures(tape.recorder, nodes, leaves, rounded=True) for e in jet.value]
    ends = evaluate_rows(Tape.of(tape.recorder, held=np.array(held, dtype=object)), values, 1)["held"].reshape(-1, 2)
    assert (ends[:, 0] <= wanted + 1e-12).all() and (wanted - 1e-12 <= ends[:, 1]).all()


def test_expressions_and_polynomials() -> None:
    r = Recorder()
    x, y, z = (r.leaf(name, COORDINATE) for name in LEAVES)
    entries = [r.mul(r.add(r.sin(x), y), r.div(r.cos(x), r.add(1, r.mul(y, y)))), r.sub(r.mul(x, z), r.sqrt(r.add(y, 2)))]
    tape, values = Tape.of(r, out=np.array(entries, dtype=object)), at(1)
    symbols = {leaf: sp.Symbol(leaf.args[1]) for leaf in tape.inputs}
    wanted = [float(v) for v in evaluate(tape, values, 30)["out"]]
    found = expand(Output.of("out", np.array(entries, dtype=object)), symbols).subs(values)
    assert [float(v) for v in found] == pytest.approx(wanted, rel=1e-14)
    twice = Exact([*entries, r.mul(r.add(r.sin(x), y), r.cos(x))])
    assert len(twice.values) == 3 and len(twice.ring.sub(twice.values[0], twice.values[0]).num) == 0


class Depth(Arithmetic):
    """Number of operations that wait for each other."""

    def leaf(self, node: Node) -> int:
        return 0

    def number(self, value: Any) -> int:
        return 0

    def step(self, node: Node, args: list[int]) -> int:
        return 1 + max(args)

    def call(self, node: Node, args: list[int]) -> int:
        return 100 + max(args)

    def item(self, node: Node, results: int) -> int:
        return results


def test_known_values_calls_and_results() -> None:
    r = Recorder()
    x = r.leaf("x", COORDINATE)
    y = r.sin(r.sin(x))
    results = r.call(Cube((0,), "flat"), [x, y, 1, 2])
    tape = Tape.of(r, out=np.array([*results, 3], dtype=object))
    found = walk(tape.steps, Depth())
    assert [found.of(e) for e in tape.outputs["out"].entries] == [102, 102, 102, 102, 0]
    assert walk(tape.steps, Depth(), {y: 7})[results[1]] == 107
    with pytest.raises(NotImplementedError):
        walk(tape.steps, Arithmetic())
