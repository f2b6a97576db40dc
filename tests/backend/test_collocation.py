"""Coefficients of the implicit collocation methods: what makes their order, and what takes their equations apart."""

from __future__ import annotations

import numpy as np
import pytest

from symdyn.backend.methods.radau import FIVE_STAGES, THREE_STAGES, Collocation


@pytest.fixture(params=[THREE_STAGES, FIVE_STAGES], ids=["3", "5"])
def method(request: pytest.FixtureRequest) -> Collocation:
    return request.param  # type: ignore[no-any-return]


def test_nodes_are_those_of_radau(method: Collocation) -> None:
    """Zeros of P_s - P_(s-1) on (0, 1]."""
    c = np.array(method.nodes)
    s = len(c)
    legendre = np.polynomial.Legendre.basis(s, [0, 1]) - np.polynomial.Legendre.basis(s - 1, [0, 1])
    np.testing.assert_allclose(c, np.sort(legendre.roots().real), rtol=0, atol=1e-14)


def test_quadrature_of_order_two_s_less_one(method: Collocation) -> None:
    c, A = np.array(method.nodes), np.linalg.inv(method.inverse)
    s = len(c)
    for k in range(1, 2 * s):
        assert A[-1] @ c**(k - 1) == pytest.approx(1 / k, abs=1e-14)


def test_stages_integrate_polynomials(method: Collocation) -> None:
    """With the quadrature these conditions, C(s), make the order 2 s - 1; D(s - 1) follows from both."""
    c, A = np.array(method.nodes), np.linalg.inv(method.inverse)
    s = len(c)
    for k in range(1, s + 1):
        np.testing.assert_allclose(A @ c**(k - 1), c**k / k, rtol=0, atol=1e-14)


def test_equations_fall_apart(method: Collocation) -> None:
    """part A^-1 join is block diagonal, join part = 1; the imaginary part of the real root's unknown has no part."""
    s = len(method.nodes)
    join, part = np.array(method.join), np.array(method.part)
    np.testing.assert_allclose(join @ part, np.eye(s), rtol=0, atol=1e-14)
    blocks = np.zeros((s + 1, s + 1))
    for k, (alpha, beta) in enumerate(method.roots):
        blocks[2 * k:2 * k + 2, 2 * k:2 * k + 2] = [[alpha, -beta], [beta, alpha]]
    blocks[1] = blocks[:, 1] = 0
    np.testing.assert_allclose(part @ method.inverse @ join, blocks, rtol=0, atol=1e-12)
    assert method.roots[0][1] == 0 and not part[1].any() and not join[:, 1].any()


def test_estimate_vanishes_for_polynomials(method: Collocation) -> None:
    """For y = t^k; the stages are then right."""
    c = np.array(method.nodes)
    s = len(c)
    for k in range(1, s + 1):
        assert (k == 1) + method.estimate @ c**k == pytest.approx(0, abs=1e-13)


def test_tail_makes_the_polynomial_right_for_one_power_more(method: Collocation) -> None:
    """y = t^(s+1), h = 1: what the polynomial through the stages lacks is the tail times the estimate, gamma^-1 (f_0 + d z)."""
    c, A = np.array(method.nodes), np.linalg.inv(method.inverse)
    s = len(c)
    z = A @ ((s + 1) * c**s)
    estimate = method.estimate @ z / method.roots[0][0]
    theta = np.linspace(0, 1, 11)
    through = np.polynomial.Polynomial.fit(np.append(0, c), np.append(0, z), s)(theta)
    tail = np.polynomial.Polynomial(method.tail)(theta)
    np.testing.assert_allclose(through + tail * estimate, theta**(s + 1), rtol=0, atol=1e-13)
    assert np.abs(theta**(s + 1) - through).max() > 1e-3


def test_extra_place_is_where_the_polynomial_is_farthest_from_stiff_motion(method: Collocation) -> None:
    """Stiff motion t^(s+1) goes through start and stages: what the polynomial lacks is largest at the extra place."""
    through = np.array([0.0, *method.nodes])
    lacking = np.poly1d(through, r=True)
    theta = np.linspace(0, 1, 2001)
    assert abs(lacking(method.extra)) >= np.abs(lacking(theta)).max() * (1 - 1e-12)
    assert method.gap_factor * lacking(method.extra) == pytest.approx(1, abs=1e-13)


def test_slope_at_the_extra_place(method: Collocation) -> None:
    """Slope of polynomials of degree s that begin at 0, and of the tail."""
    c, s = np.array(method.nodes), len(method.nodes)
    for k in range(1, s + 1):
        assert method.extra_slope[:s] @ c**k == pytest.approx(k * method.extra**(k - 1), abs=1e-12)
    assert method.extra_slope[s] == pytest.approx(np.polynomial.Polynomial(method.tail).deriv()(method.extra), abs=1e-12)


def test_start_off_the_slow_motion_is_taken_from_the_gap(method: Collocation) -> None:
    """x' = -lam x from 1 with infinite h lam: stages are 0, the estimate is -1, the gap is what the polynomial has there."""
    at_start = np.prod([(c - method.extra) / c for c in method.nodes])
    tail = np.polynomial.Polynomial(method.tail)(method.extra)
    estimate = -1.0
    gap = -(at_start + tail * estimate)
    assert gap + method.tail_off * estimate == pytest.approx(0, abs=1e-13)
