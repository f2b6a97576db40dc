"""Simplification for printing keeps the value, keeps the angles of the description, and keeps to its time."""

import time

import pytest
import sympy as sp

import symdyn as sd
from symdyn.model.symbols import symbols_of
from symdyn.report.simplify import simplified

a, b, c = sp.symbols("a b c")
q1, q2 = sd.coordinates("q1 q2")


@pytest.mark.parametrize(("given", "wanted"), [
    (sp.sin(q1) ** 2 * a + sp.cos(q1) ** 2 * a, a),
    (sp.cos(q1) * sp.cos(q2) - sp.sin(q1) * sp.sin(q2), sp.cos(q1 + q2)),
    (a * sp.sin(q1) * sp.cos(q1), a * sp.sin(q1) * sp.cos(q1)),
    ((a + b) ** 2 - a**2 - 2 * a * b, b**2),
    ((a**2 - 1) / (a - 1) * sp.cos(q1), (a + 1) * sp.cos(q1)),
    ((a**2 * sp.sin(q1 + q2) + a * b * sp.sin(q1 + q2)) / (a + b), a * sp.sin(q1 + q2)),
    ((1 - sp.cos(q1) ** 2) / sp.sin(q1), sp.sin(q1)),
])
def test_known_forms(given, wanted):
    assert simplified(given, 10) == wanted


@pytest.mark.parametrize("name", ["three_link_arm", "cart_pole"])
def test_value_is_kept(name):
    eq = sd.systems.get(name).embedding()
    for quantity in ("M_tilde", "k_tilde", "F_tilde"):
        plain, short = eq.explicit(quantity, simplify=False), eq.explicit(quantity)
        symbols = sorted(symbols_of(plain) | symbols_of(short), key=str)
        point = {s: sp.Rational(3 + 7 * k, 11) for k, s in enumerate(symbols)}
        difference = (plain - short).xreplace(point).evalf(30)
        assert max(abs(e) for e in difference) < 1e-22
        assert sp.count_ops(short) <= sp.count_ops(plain)


def test_time_limit():
    eq = sd.systems.get("spatial_chain", n=4).embedding()
    plain = eq.explicit("k_tilde", simplify=False)
    begun = time.monotonic()
    simplified(plain, 0.0)
    assert time.monotonic() - begun < 5
