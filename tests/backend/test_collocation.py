"""Coefficients of the implicit collocation method: what makes its order, and what takes its equations apart."""

from __future__ import annotations

import numpy as np
import pytest

from symdyn.backend.methods.radau import COLLOCATION as METHOD

c = np.array(METHOD.nodes)
A = np.linalg.inv(METHOD.inverse)
s = len(c)


def test_nodes_are_those_of_radau() -> None:
    """Zeros of P_s - P_(s-1) on (0, 1]."""
    legendre = np.polynomial.Legendre.basis(s, [0, 1]) - np.polynomial.Legendre.basis(s - 1, [0, 1])
    np.testing.assert_allclose(c, np.sort(legendre.roots().real), rtol=0, atol=1e-14)


@pytest.mark.parametrize("k", range(1, 2 * s))
def test_quadrature_of_order_9(k: int) -> None:
    assert A[-1] @ c**(k - 1) == pytest.approx(1 / k, abs=1e-14)


@pytest.mark.parametrize("k", range(1, s + 1))
def test_stages_integrate_polynomials(k: int) -> None:
    """With the quadrature these conditions, C(s), make the order 2 s - 1; D(s - 1) follows from both."""
    np.testing.assert_allclose(A @ c**(k - 1), c**k / k, rtol=0, atol=1e-14)


def test_equations_fall_apart() -> None:
    """part A^-1 join is block diagonal, join part = 1; the imaginary part of the real root's unknown has no part."""
    join, part = np.array(METHOD.join), np.array(METHOD.part)
    np.testing.assert_allclose(join @ part, np.eye(s), rtol=0, atol=1e-14)
    blocks = np.zeros((s + 1, s + 1))
    for k, (alpha, beta) in enumerate(METHOD.roots):
        blocks[2 * k:2 * k + 2, 2 * k:2 * k + 2] = [[alpha, -beta], [beta, alpha]]
    blocks[1] = blocks[:, 1] = 0
    np.testing.assert_allclose(part @ METHOD.inverse @ join, blocks, rtol=0, atol=1e-12)
    assert METHOD.roots[0][1] == 0 and not part[1].any() and not join[:, 1].any()


@pytest.mark.parametrize("k", range(1, s + 1))
def test_estimate_vanishes_for_polynomials(k: int) -> None:
    """For y = t^k; the stages are then right."""
    assert (k == 1) + METHOD.estimate @ c**k == pytest.approx(0, abs=1e-13)


def test_tail_makes_the_polynomial_right_for_one_power_more() -> None:
    """y = t^(s+1), h = 1: what the polynomial through the stages lacks is the tail times the estimate, gamma^-1 (f_0 + d z)."""
    z = A @ ((s + 1) * c**s)
    estimate = METHOD.estimate @ z / METHOD.roots[0][0]
    theta = np.linspace(0, 1, 11)
    through = np.polynomial.Polynomial.fit(np.append(0, c), np.append(0, z), s)(theta)
    tail = np.polynomial.Polynomial(METHOD.tail)(theta)
    np.testing.assert_allclose(through + tail * estimate, theta**(s + 1), rtol=0, atol=1e-13)
    assert np.abs(theta**(s + 1) - through).max() > 1e-3
