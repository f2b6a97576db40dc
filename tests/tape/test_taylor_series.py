"""Taylor coefficients by recurrences against numerical differentiation and closed forms at high precision."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import numpy as np
import pytest

from symdyn.errors import UnsupportedExpression
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import COORDINATE, INPUT, PARAMETER, TIME
from symdyn.tape.recorder import Recorder
from symdyn.tape.taylor import Series, not_smooth, series

DIGITS = 60


def coefficients(made: Series, state: list[str], at: Mapping[str, Any], order: int) -> np.ndarray:
    """Coefficients 0 to `order` of the state, (order + 1, n_x)."""
    n = made.n_x
    with mpmath.workdps(DIGITS):
        first = evaluate(made.start, at, DIGITS)["series_start"]
        x = [np.array([mpmath.mpf(at[name]) for name in state]), first[:n]]
        left, right = [None], [None]
        for k in range(1, order):
            sums = [sum((left[j][s] * right[k - j][s] for j in range(1, k)), mpmath.mpf(0)) for s in range(made.n_s)]
            groups = {"t": [k], "inputs": [mpmath.mpf(1) / k, int(k == 1)], "q": x[k], "ud": k * x[k], "u": sums, "z": first[n:]}
            values = {name: groups[g][index] for name, (g, index) in made.leaves.items() if index < len(groups[g])}
            got = evaluate(made.next, {**values, **at}, DIGITS)["series_next"]
            rates, a, b = (got[i:j] for i, j in zip(made.borders, made.borders[1:]))
            left.append(a)
            right.append(b)
            x.append(rates / (k + 1))
        return np.array(x)


def third(op: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The function of a third of its argument, recorded and exact."""
    return lambda r, a, p: r.apply(op, a / 3), lambda a, t, p: getattr(mpmath, op)(a / 3)


FUNCTIONS: dict[str, tuple[Callable[[Any, Any, Any], Any], Callable[[Any, Any, Any], Any]]] = {
    "add": (lambda r, a, p: a + p * r.sin(a), lambda a, t, p: a + p * mpmath.sin(a)),
    "sub": (lambda r, a, p: p - a * a, lambda a, t, p: p - a * a),
    "mul": (lambda r, a, p: (a + 1) * r.cos(p * a) * (3 * a), lambda a, t, p: (a + 1) * mpmath.cos(p * a) * 3 * a),
    "multiples": (lambda r, a, p: 1 - p * (2 - 3 * (p * r.sin(a))), lambda a, t, p: 1 - p * (2 - 3 * p * mpmath.sin(a))),
    "square": (lambda r, a, p: (p - 2 * a) * (p - 2 * a), lambda a, t, p: (p - 2 * a) ** 2),
    "div": (lambda r, a, p: r.sin(a) / (p + a), lambda a, t, p: mpmath.sin(a) / (p + a)),
    "reciprocal": (lambda r, a, p: (2 / (1 + a * a)) * r.sin(a), lambda a, t, p: 2 / (1 + a * a) * mpmath.sin(a)),
    "constant divisor": (lambda r, a, p: r.sin(a) / p, lambda a, t, p: mpmath.sin(a) / p),
    "sqrt": (lambda r, a, p: r.sqrt(1 + a * a), lambda a, t, p: mpmath.sqrt(1 + a * a)),
    "pow": (lambda r, a, p: r.pow(a, p), lambda a, t, p: a**p),
    "moving exponent": (lambda r, a, p: r.pow(p, r.sin(a)) + r.pow(a, a), lambda a, t, p: p ** mpmath.sin(a) + a**a),
    "integer powers": (lambda r, a, p: r.pow(a, 7) + r.pow(a, -3), lambda a, t, p: a**7 + a**-3),
    "sin": (lambda r, a, p: r.sin(a), lambda a, t, p: mpmath.sin(a)),
    "cos": (lambda r, a, p: r.cos(2 * a - 1), lambda a, t, p: mpmath.cos(2 * a - 1)),
    "atan2": (lambda r, a, p: r.apply("atan2", r.sin(a), a * a), lambda a, t, p: mpmath.atan2(mpmath.sin(a), a * a)),
    "acosh": (lambda r, a, p: r.apply("acosh", 2 + a), lambda a, t, p: mpmath.acosh(2 + a)),
    "guard": (lambda r, a, p: r.guard(a * a, a, "a must be positive"), lambda a, t, p: a * a),
    "time": (lambda r, a, p: r.sin(r.leaf("t", TIME)) * a * r.leaf("t", TIME), lambda a, t, p: mpmath.sin(t) * a * t),
    **{op: third(op) for op in ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "atanh", "exp", "log", "erf")},
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_operation(name: str) -> None:
    """s' = 1, y' = f(s): the coefficients of y are those of f, by differences at high precision."""
    record, exact = FUNCTIONS[name]
    r = Recorder()
    s, p = r.leaf("s", COORDINATE), r.leaf("p", PARAMETER)
    r.leaf("y", COORDINATE)
    at = {"s": 0.75, "y": 0.0, "p": 1.7, "t": 0.5}
    found = coefficients(series(r, [1, record(r, s, p)], ["s", "y"]), ["s", "y"], at, 10)
    with mpmath.workdps(DIGITS):
        wanted = mpmath.taylor(lambda h: exact(at["s"] + h, at["t"] + h, mpmath.mpf(at["p"])), 0, 9)
        for k, value in enumerate(wanted):
            assert abs(found[k + 1, 1] * (k + 1) - value) < mpmath.mpf(10) ** -20 * (1 + abs(value))


def test_solutions_in_closed_form() -> None:
    """y' = y^2, y(0) = 1: 1/(1 - t). x'' = -x: cosine. z' = z/(2 z^2): sqrt(1 + t)."""
    r = Recorder()
    y, x, u, z = (r.leaf(name, COORDINATE) for name in "yxuz")
    names = ["y", "x", "u", "z"]
    found = coefficients(series(r, [y * y, u, -x, 1 / (2 * z)], names), names, dict.fromkeys("yxz", 1) | {"u": 0}, 12)
    with mpmath.workdps(DIGITS):
        for k, row in enumerate(found):
            cosine = 0 if k % 2 else (-1) ** (k // 2) / mpmath.factorial(k)
            for value, wanted in zip(row[[0, 1, 3]], (1, cosine, mpmath.binomial(mpmath.mpf(1) / 2, k)), strict=True):
                assert abs(value - wanted) < mpmath.mpf(10) ** -(DIGITS - 8)


def test_what_costs_no_sum() -> None:
    """Parameters, inputs and shared factors: only products of what moves are sums, and equal ones are one."""
    r = Recorder()
    x, y = r.leaf("x", COORDINATE), r.leaf("y", COORDINATE)
    p, f = r.leaf("p", PARAMETER), r.leaf("f", INPUT)
    made = series(r, [p * x / (p + f) + f * r.sin(p) - y, f / p + x], ["x", "y"])
    assert made.n_s == 0
    made = series(r, [(p + 2 * x) * (f - 3 * y), x * y / p], ["x", "y"])
    assert made.n_s == 1
    found = coefficients(made, ["x", "y"], {"x": 0.5, "y": 0.25, "p": 2.0, "f": 1.5}, 3)
    # x' = 3 * 0.75; x'' = 2 x' 0.75 - 3 * 3 y', y' = x y / 2
    assert found[2, 0] * 2 == pytest.approx(2 * 2.25 * 0.75 - 9 * 0.0625)
    assert series(r, [(1 / (1 + x * x)) * y, r.sin(x)], ["x", "y"]).n_s == 4  # x^2, quotient, sine, cosine


def test_multiples_of_multiples_are_one_product() -> None:
    """Constants are multiplied once, not in every order: what varies waits for one product only."""
    r = Recorder()
    x, p, f = r.leaf("x", COORDINATE), r.leaf("p", PARAMETER), r.leaf("f", INPUT)
    once, often = (series(r, [field], ["x"]).next for field in (p * r.sin(x), p * (3 * (1 - p * (f * r.sin(x))))))
    assert often.count() == once.count()


@pytest.mark.parametrize(("op", "why"), [("abs", "switches (abs)"), ("floor", "switches (floor)"), ("sign", "switches (sign)"),
                                         ("max", "switches (max)"), ("select", "switches (lt) and switches (select)")])
def test_what_has_no_series(op: str, why: str) -> None:
    r = Recorder()
    x, p = r.leaf("x", COORDINATE), r.leaf("p", PARAMETER)
    arguments = {"max": (x, p), "select": (r.apply("lt", x, p), x, p)}
    entry = 1 + r.apply(op, *arguments.get(op, (x,)))
    assert why in not_smooth([x, entry])
    with pytest.raises(UnsupportedExpression, match="there is no Taylor series: the right-hand side switches"):
        series(r, [entry], ["x"])
    still = r.apply("max", p, 2)  # of parameters only
    assert not_smooth([x * still]) == "" and series(r, [x * still], ["x"]).n_s == 0
