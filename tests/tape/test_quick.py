"""Numbers of many digits by FLINT are those of mpmath."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from flint import ctx as context

from symdyn import systems
from symdyn.functions.tapes import function_tape
from symdyn.tape.evaluate import evaluate
from symdyn.tape.intrinsics import SMOOTHED, Saddle
from symdyn.tape.node import COORDINATE
from symdyn.tape.quick import evaluate_quickly
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

X, Y = 0.375, 0.7
ONE = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "atanh", "exp", "log", "abs", "sign",
       "floor", "ceil", "erf")
TWO = ("atan2", "pow", "min", "max")
TRUTHS = ("lt", "le", "gt", "ge", "eq", "ne")


def plain(value: Any) -> Any:
    """A number of mpmath's from the exact binary number that FLINT has."""
    mantissa, exponent = value.man_exp()
    return mpmath.ldexp(int(mantissa), int(exponent))


def compare(tape: Tape, values: dict[str, float], digits: int = 40) -> None:
    before = context.dps
    found, wanted = evaluate_quickly(tape, values, digits), evaluate(tape, values, digits)
    assert context.dps == before and found.keys() == wanted.keys()
    with mpmath.workdps(digits + 10):
        for name, array in wanted.items():
            assert found[name].shape == array.shape
            for a, b in zip(found[name].ravel(), array.ravel(), strict=True):
                assert abs(plain(a) - b) <= abs(b) * mpmath.mpf(10) ** (3 - digits), name


def test_operations() -> None:
    r = Recorder()
    x, y = (r.leaf(name, COORDINATE) for name in "xy")
    either = {op: r.apply("select", r.apply(op, x, y), x, 1) for op in TRUTHS}
    logic = r.apply("or", r.apply("and", r.apply("lt", x, y), r.apply("gt", x, y)), r.apply("not", r.apply("eq", x, y)))
    tape = Tape.of(r, **{op: r.apply(op, a) for op in ONE for a in [-x if op in ("abs", "sign") else x]},
                   **{op: r.apply(op, x, y) for op in TWO}, acosh=r.apply("acosh", 1 + x), pi=r.pi() * x, **either,
                   logic=r.apply("select", logic, y, x), guard=r.guard(x, y, "small"), third=(x / 3 - y) * x - 2 * y,
                   array=np.array([[x, 0.1], [1, -y]], dtype=object))
    compare(tape, {"x": X, "y": Y})
    compare(tape, {"x": X, "y": Y}, digits=60)


@pytest.mark.parametrize("name", ["spatial_chain", "andrews_squeezer"])
def test_mechanisms(name: str) -> None:
    equations = systems.get(name).equations()
    tape = function_tape(equations, "M_tilde" if name == "spatial_chain" else "C")
    compare(tape, {leaf.args[1]: 0.5 + 0.01 * k for k, leaf in enumerate(tape.inputs)})


def test_numeric_algorithms() -> None:
    r = Recorder()
    values = [SMOOTHED, 2.0, 0.5, 3.0, 1.0, -1.0, 1.0, 1.0, 1.0, 0.3, 0.2, 0.1]
    leaves = [r.leaf(f"v{k}", COORDINATE) for k in range(len(values))]
    tape = Tape.of(r, solve=np.array(r.call(Saddle((2, 1), "no solution"), leaves), dtype=object))
    compare(tape, {f"v{k}": v for k, v in enumerate(values)})


def test_what_is_no_real_number() -> None:
    r = Recorder()
    x, y = (r.leaf(name, COORDINATE) for name in "xy")
    tape = Tape.of(r, values=np.array([r.sqrt(x), r.apply("log", x), x / y, r.apply("acos", 2 - x), r.guard(y, x, "small"),
                                       r.apply("exp", r.sqrt(x)), r.apply("atanh", r.sqrt(x))], dtype=object))
    assert all(math.isnan(float(v)) for v in evaluate_quickly(tape, {"x": -1.0, "y": 0.0}, 40)["values"])
