"""Bounds by interval arithmetic hold the values and their derivatives along a line, and are tight where the line is short."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intervals import BIG, Interval, Jet, encloses, enclosures
from symdyn.tape.node import COORDINATE, PARAMETER, SPEED
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

ENDS = ("value_lo", "value_hi", "slope_lo", "slope_hi", "bend_lo", "bend_hi")


def call(op: str) -> Any:
    return lambda r, x, y, p: r.apply(op, x)


# Expressions in x, y and a parameter, all between -2 and 2 but where they are mapped elsewhere.
VALUES = {
    "sum": lambda r, x, y, p: x + y - p * x + 2, "product": lambda r, x, y, p: x * y * p, "square": lambda r, x, y, p: x * x,
    "fourth": lambda r, x, y, p: x**4, "quotient": lambda r, x, y, p: y / x, "reciprocal": lambda r, x, y, p: 3 / (x * x + 1),
    "power": lambda r, x, y, p: r.pow(x * x + 1, y), "root": lambda r, x, y, p: r.apply("sqrt", x + 1),
    "logarithm": lambda r, x, y, p: r.apply("log", x + 1), "acosh": lambda r, x, y, p: r.apply("acosh", x + 2),
    "atan2": lambda r, x, y, p: r.apply("atan2", y, x), "min": lambda r, x, y, p: r.apply("min", x, y * y),
    "max": lambda r, x, y, p: r.apply("max", x * y, p),
    "piecewise": lambda r, x, y, p: r.apply("select", r.apply("and", r.apply("gt", x, -1), r.apply("le", x, y)), x * y, p),
    "either": lambda r, x, y, p: r.apply("select", r.apply("or", r.apply("ge", x, 1), r.apply("not", r.apply("lt", y, 0))),
                                         x, y),
    "equal": lambda r, x, y, p: r.apply("select", r.apply("eq", r.apply("floor", x), 1), 1, 0),
    "unequal": lambda r, x, y, p: r.apply("select", r.apply("ne", r.apply("floor", x), 1), x, 0),
    "pulse": lambda r, x, y, p: r.apply("exp", -((x - p) * 20) ** 2) - Fraction(1, 2),
    "sine_of_much": lambda r, x, y, p: r.apply("sin", 9 * x + y), "pi": lambda r, x, y, p: r.apply("pi") * x,
    **{op: call(op) for op in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "atanh", "exp",
                               "abs", "sign", "floor", "ceil", "erf", "neg")},
}


def bounds(value: Any) -> tuple[Tape, Tape]:
    """The tape of a value and its derivatives along x + a s + b s^2/2, and that of its bounds."""
    r = Recorder()
    x, y = r.leaf("x", COORDINATE), r.leaf("y", SPEED)
    p = r.leaf("p", PARAMETER)
    entry = value(r, x, y, p)
    rates = {node: r.leaf(f"{name}_rate", SPEED) for node, name in ((x, "x"), (y, "y"))}
    bends = {rates[node]: r.leaf(f"{name}_bend", SPEED) for node, name in ((x, "x"), (y, "y"))}
    first = forward(r, [entry], rates)[0]
    second = forward(r, [first], {**rates, **bends})[0]
    jets = {node: Jet(*[Interval(*[r.leaf(f"{name}_{end}", COORDINATE) for end in ENDS[k:k + 2]]) for k in (0, 2, 4)])
            for node, name in ((x, "x"), (y, "y"))}
    found = enclosures(r, [entry], jets)[0]
    return Tape.of(r, all=np.array([entry, first, second], dtype=object)), Tape.of(r, all=np.array(found, dtype=object))


@pytest.mark.every_value
@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("width", [1.0, 1e-1, 1e-3])
def test_bounds_hold_at_every_point_of_a_line(name: str, width: float) -> None:
    """Against derivatives of the expression at 41 points of 60 lines."""
    exact, enclosing = bounds(VALUES[name])
    rng = np.random.default_rng(7)
    n, s = 60, np.linspace(-1, 1, 41)
    given, along = {"p": rng.uniform(-2, 2, n)}, {}
    for leaf in ("x", "y"):
        at, slope, bend = rng.uniform(-2, 2, n), width * rng.uniform(-1, 1, n), width**2 * rng.uniform(-1, 1, n)
        line = at + np.outer(s, slope) + np.outer(s**2 / 2, bend)
        rate = slope + np.outer(s, bend)
        along |= {leaf: line, f"{leaf}_rate": rate, f"{leaf}_bend": np.tile(bend, (len(s), 1))}
        for end, values in zip(ENDS, (line.min(0), line.max(0), rate.min(0), rate.max(0), bend, bend), strict=True):
            given[f"{leaf}_{end}"] = values
    found = evaluate_rows(enclosing, {k: v for k, v in given.items() if k in {i.args[1] for i in enclosing.inputs}}, n)["all"]
    for k in range(len(s)):
        values = {**{key: v[k] for key, v in along.items()}, "p": given["p"]}
        there = evaluate_rows(exact, {key: v for key, v in values.items() if key in {i.args[1] for i in exact.inputs}}, n)["all"]
        known = np.isfinite(there).all(axis=1)
        slack = 1e-12 * (1 + np.abs(there))
        assert known.any()
        assert ((found[..., 0] - slack <= there) & (there <= found[..., 1] + slack))[known].all()


@pytest.mark.parametrize("name", [n for n in VALUES if n not in ("min", "max", "piecewise", "either", "equal", "unequal", "abs",
                                                                  "sign", "floor", "ceil")])
def test_bounds_of_a_point_are_its_values(name: str) -> None:
    """A line without length has no room for anything else."""
    exact, enclosing = bounds(VALUES[name])
    n = 50
    rng = np.random.default_rng(3)
    values = {key: rng.uniform(-2, 2, n) for key in ("x", "y", "p", "x_rate", "y_rate", "x_bend", "y_bend")}
    given = {"p": values["p"]}
    for leaf in ("x", "y"):
        for end, of in zip(ENDS, (leaf, leaf, f"{leaf}_rate", f"{leaf}_rate", f"{leaf}_bend", f"{leaf}_bend"), strict=True):
            given[f"{leaf}_{end}"] = values[of]
    there = evaluate_rows(exact, {i.args[1]: values[i.args[1]] for i in exact.inputs}, n)["all"]
    found = evaluate_rows(enclosing, {i.args[1]: given[i.args[1]] for i in enclosing.inputs}, n)["all"]
    known = np.isfinite(there).all(axis=1) & (np.abs(found) < float(BIG)).all(axis=(1, 2))
    if name == "atan2":  # left of the cut it is not known on which side
        known &= np.abs(there[:, 0]) < 1.5
    size = 1 + np.abs(there[known]).max(axis=1)[:, None]
    assert known.sum() >= 0.2 * n
    assert (np.abs(found[known] - there[known][..., None]).max(axis=2) <= 1e-9 * size).all()


def test_algorithms_and_long_values_are_not_enclosed() -> None:
    r = Recorder()
    x = r.leaf("x", COORDINATE)
    long = x
    for _ in range(500):
        long = r.apply("sin", long) + x
    assert encloses(r, r.apply("sin", x))
    assert encloses(r, 3)
    assert not encloses(r, long)
    assert not encloses(r, 1 / r.guard(x * x, x, "must be positive"))
    assert not encloses(r, 1 / r.positive(x * x + 1, "a pivot"))


@pytest.mark.parametrize("name", ["sum", "product", "quotient", "power", "sine_of_much", "pulse", "erf", "sin"])
def test_bounds_with_rounding_hold_exact_values(name: str) -> None:
    """Bounds of points, which have no width else, in doubles, and values at 40 digits."""
    r = Recorder()
    x, y, p = r.leaf("x", COORDINATE), r.leaf("y", SPEED), r.leaf("p", PARAMETER)
    entry = VALUES[name](r, x, y, p)
    points = {leaf: Jet(Interval(leaf, leaf), Interval(0, 0), Interval(0, 0)) for leaf in (x, y)}
    exact = Tape.of(r, value=np.array([entry], dtype=object))
    ends = Tape.of(r, ends=np.array(enclosures(r, [entry], points, rounded=True)[0].value, dtype=object))
    rng = np.random.default_rng(0)
    for row in rng.uniform(0.1, 1.9, (50, 3)):
        at = dict(zip(("x", "y", "p"), row.tolist(), strict=True))
        value = evaluate(exact, {leaf.args[1]: at[leaf.args[1]] for leaf in exact.inputs}, 40)["value"][0]
        low, high = evaluate_rows(ends, {leaf.args[1]: at[leaf.args[1]] for leaf in ends.inputs}, 1)["ends"][0]
        assert low <= value <= high
        assert high - low < 1e-12
