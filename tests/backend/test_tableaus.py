"""Coefficients of Runge-Kutta pairs: the order conditions of every rooted tree, in exact arithmetic on the stored numbers."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from symdyn.backend.methods import METHODS, Method, method_of
from symdyn.errors import SymdynError

PAIRS = [m for m in METHODS.values() if m.tableau is not None]
# Residual of a condition with the coefficients stored as doubles.
ROUNDING = 3e-14


@functools.cache
def trees(n: int) -> tuple[Any, ...]:
    """Rooted trees with n nodes, each as the tuple of its branches."""
    found = set()

    def grow(rest: int, largest: int, branches: tuple[Any, ...]) -> None:
        if rest == 0:
            found.add(tuple(sorted(branches, key=repr)))
        for k in range(1, min(rest, largest) + 1):
            for tree in trees(k):
                grow(rest - k, k, (*branches, tree))

    grow(n - 1, n - 1, ())
    return tuple(found)


def size(tree: Any) -> int:
    return 1 + sum(map(size, tree))


def density(tree: Any) -> int:
    product = size(tree)
    for branch in tree:
        product *= density(branch)
    return product


@functools.cache
def weights(name: str, tree: Any) -> list[Fraction]:
    """Weights of every slope k[j], that of dense output and of the end included."""
    t = METHODS[name].tableau
    rows = [{**t.a, t.n_stages: t.b}.get(j, {}) for j in range(t.n_slopes)]
    product = [Fraction(1)] * t.n_slopes
    for branch in tree:
        inner = weights(name, branch)
        product = [p * sum((Fraction(v) * inner[k] for k, v in row.items()), Fraction(0)) for p, row in zip(product, rows)]
    return product


def residual(method: Method, row: Mapping[int, Any], order: int, value: Fraction = Fraction(1)) -> float:
    """The largest left of the conditions of an order, at a part of the step."""
    return max(abs(float(sum(Fraction(v) * w[k] for k, v in row.items()) - value**order / density(tree)))
               for tree in trees(order) for w in [weights(method.name, tree)])


def dense(method: Method, theta: Fraction) -> dict[int, Fraction]:
    """Weights of the slopes in (x(theta) - x) / h."""
    t, rest, sums = method.tableau, 1 - theta, {}
    b = {k: Fraction(t.b.get(k, 0)) for k in range(t.n_slopes)}
    for k in b:
        at_start, at_end = Fraction(k == 0), Fraction(k == t.n_stages)
        nested = Fraction(0)
        for j, row in reversed(list(enumerate(t.d))):
            nested = (rest if j % 2 == 0 else theta) * (Fraction(row.get(k, 0)) + nested)
        nested = theta * (2 * b[k] - at_start - at_end + nested)
        sums[k] = theta * (b[k] + rest * (at_start - b[k] + nested))
    return sums


def test_there_are_as_many_trees_as_known() -> None:
    assert [len(trees(n)) for n in range(1, 8)] == [1, 1, 2, 4, 9, 20, 48]


@pytest.mark.parametrize("method", PAIRS, ids=lambda m: m.name)
def test_nodes_are_sums_of_rows(method: Method) -> None:
    t = method.tableau
    for j, row in t.a.items():
        assert sum(row.values()) == pytest.approx(t.c.get(j, 1.0), abs=ROUNDING)


@pytest.mark.parametrize(("name", "order", "estimate", "between"), [("bs54", 5, 4, 4), ("dop853", 7, 5, 6)])
def test_order_conditions(name: str, order: int, estimate: int, between: int) -> None:
    """Conditions of the solution, of the embedded solution, of the dense output; order 8 is shown by the measured order."""
    method = METHODS[name]
    t = method.tableau
    third = {k: -v for k, v in (t.second or {}).items()}  # b + second is the difference to it
    for n in range(1, order + 1):
        assert residual(method, t.b, n) < ROUNDING
        if n <= estimate:
            assert residual(method, t.e, n, Fraction(0)) < ROUNDING
        if n <= 3 and third:
            assert residual(method, third, n) < ROUNDING
        if n <= between:
            assert residual(method, dense(method, Fraction(3, 7)), n, Fraction(3, 7)) < 10 * ROUNDING
    assert residual(method, t.e, estimate + 1, Fraction(0)) > 1e-5
    assert residual(method, dense(method, Fraction(3, 7)), between + 2, Fraction(3, 7)) > 1e-7


def test_the_dense_output_of_the_loose_pair_is_the_best_of_its_kind() -> None:
    """No other weights of order 4 without further stages leave less of order 5, in the sum of squares; two are free."""
    method = METHODS["bs54"]
    t = method.tableau
    rows = np.array([[float(w) for w in weights(method.name, tree)] for n in range(1, 5) for tree in trees(n)])
    free = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, tol=1e-9):]
    assert len(free) == 2

    nodes, share = np.polynomial.legendre.leggauss(8)

    def left(extra: np.ndarray) -> float:
        total = 0.0
        for theta, weight in zip((nodes + 1) / 2, share):
            row = dense(method, Fraction(theta))
            values = [float(row[k]) + (theta * (1 - theta))**2 * extra[k] for k in range(t.n_slopes)]
            for tree in trees(5):
                w = [float(e) for e in weights(method.name, tree)]
                total += weight * (np.dot(values, w) - theta**5 / density(tree))**2
        return total

    least = left(np.zeros(t.n_slopes))
    for direction in free:
        assert left(0.05 * direction) > least < left(-0.05 * direction)
        assert left(0.05 * direction) == pytest.approx(left(-0.05 * direction), rel=1e-6)


def test_unknown_method() -> None:
    with pytest.raises(SymdynError, match="there is no compiled method 'euler'; there are dop853, bs54"):
        method_of("euler")
