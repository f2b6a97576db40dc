"""The chain rule over Newton's dots, and its faults."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
import sympy as sp
from sympy.physics.vector import dynamicsymbols

import symdyn as sd
from symdyn.frames import numbers

q, r = sd.coordinates("q r")
m = sd.parameters("m")


def test_chain_rule():
    assert sd.rate(m * q**2 + sd.t * r.dot) == 2 * m * q * q.dot + r.dot + sd.t * r.ddot
    assert sd.rate(sd.rate(sp.sin(q))) == -sp.sin(q) * q.dot**2 + sp.cos(q) * q.ddot
    assert sd.rate(m) == 0


def test_shapes_are_kept():
    assert sd.rate(sp.Matrix([[q, m], [1, sd.t]])) == sp.Matrix([[q.dot, 0], [0, 1]])
    assert sd.rate([q, q.dot]) == sp.Matrix([q.dot, q.ddot])
    assert sd.rate([[q, r]]) == sp.Matrix([[q.dot, r.dot]])
    assert sd.rate(np.array([q, 2.0], dtype=object)) == sp.Matrix([q.dot, 0])


def test_dynamicsymbols_are_coordinates():
    x = dynamicsymbols("q")
    assert sd.rate(x**2 + x.diff()) == 2 * q * q.dot + q.ddot


def test_speeds_have_rates():
    u = sd.speeds("u")
    assert sd.rate(u * q) == u.dot * q + u * q.dot


def test_against_numeric_differentiation():
    e = sp.exp(-q) * sp.sin(r * sd.t) / (1 + q.dot**2)
    motion = {q: sp.cos(2 * sd.t), r: sd.t**3}
    explicit = e.xreplace({q.dot: motion[q].diff(sd.t), **motion})
    expected = mpmath.diff(lambda t: explicit.evalf(40, subs={sd.t: t}), mpmath.mpf("0.7"))
    assert numbers(sd.rate(e), motion, 0.7) == pytest.approx(float(expected), rel=1e-9)


@pytest.mark.parametrize(("value", "message"), [
    (q.ddot, "the rate of q_ddot is asked for, a third derivative"),
    (sd.inputs("F") * q, "the rate of the input F is asked for, which is not known"),
    (sp.Symbol("t", real=True), "a symbol t with assumptions, which is not the time; use sd.t"),
    ("q**2", "the text 'q\\*\\*2'; text is never evaluated"),
    (float("nan"), "the expression to differentiate is nan"),
    ([q, "q"], "entry 2 of the matrix to differentiate is the text 'q'"),
    ([[q], [q, q]], r"have the lengths \[1, 2\]"),
    (object(), "type object"),
])
def test_faults(value, message):
    with pytest.raises(sd.ModelError, match=message):
        sd.rate(value)
