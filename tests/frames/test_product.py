"""Products of matrices of expressions."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.frames.product import times
from symdyn.model.symbols import symbols_of

x, y, z = sp.symbols("x y z")


def test_products_are_those_of_sympy_as_they_stand():
    R, S = sd.rotation.about("Z", x), sd.rotation.about("X", y)
    v = sp.Matrix([x, 0, x + y])
    assert times(R, S, v) == sp.ImmutableMatrix(R) * S * v
    assert times(v.T, v) == v.T * v and times(v, v.T).shape == (3, 3)


def test_sizes_must_fit():
    with pytest.raises(ValueError, match="zip"):
        times(sp.eye(2), sp.eye(3))


@pytest.mark.parametrize("expression", [
    x * sp.sin(y) + z**2, sp.Integral(x * y, (x, 0, z)), sp.Sum(x * y, (x, 0, z)), sp.Piecewise((x, y < z), (0, True)),
    sp.Lambda(x, x + y), sp.Matrix([[x, 1], [sp.sqrt(y), 0]]), sp.Integer(3),
    sp.Subs(sp.Derivative(sp.Function("f")(x), x), x, y)], ids=str)
def test_symbols_are_the_free_ones(expression):
    assert symbols_of(expression) == expression.free_symbols


def test_time_is_a_symbol_only_where_it_stands():
    q = sd.coordinates("q")
    assert symbols_of(sp.sin(q) * q.dot) == {q, q.dot} and symbols_of(q * sd.t) == {q, sd.t}
    assert symbols_of(sp.Matrix([q, 1])) == {q}
