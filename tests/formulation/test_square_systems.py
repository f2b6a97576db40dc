"""Square systems on a tape: blocks by determinants, larger ones by the numeric algorithm, in numbers and derivatives."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import symdyn as sd


def coupled(n: int) -> tuple[object, list[sp.Expr], list[sp.Expr], sp.Matrix]:
    """Kinematic equations K(q) q_dot = u whose rows all hold each other."""
    q, u = list(dynamicsymbols(f"q1:{n + 1}")), list(dynamicsymbols(f"u1:{n + 1}"))
    K = sp.Matrix(n, n, lambda i, j: 3 + sp.sin(q[i]) if i == j else sp.cos(q[j]) / (2 + i + j))
    equations = sd.from_sympy((q, u, sp.eye(n), [-a for a in q]), "coupled",
                              kinematics=list(K * sp.Matrix(q).diff(dynamicsymbols._t) - sp.Matrix(u)))
    return equations, q, u, K


@pytest.mark.every_value
@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_rates_solve_the_kinematic_equations(n: int, backend: str) -> None:
    equations, q, _, K = coupled(n)
    stream = np.random.default_rng(n)
    x = stream.uniform(0.2, 0.9, 2 * n)
    matrix = np.array(K.subs(dict(zip(q, x[:n], strict=True))), dtype=float)
    module = equations.compile(backend)
    assert module.rhs(0.0, x)[:n] == pytest.approx(np.linalg.solve(matrix, x[n:]), rel=1e-12)
    exact = module.jacobian(0.0, x).x
    steps = [1e-6 * np.eye(2 * n)[k] for k in range(2 * n)]
    differences = np.array([(module.rhs(0.0, x + h) - module.rhs(0.0, x - h)) / 2e-6 for h in steps]).T
    assert np.abs(exact - differences).max() < 1e-8


def test_blocks_are_solved_one_after_the_other() -> None:
    q, u = dynamicsymbols("q1:6"), dynamicsymbols("u1:6")
    rates = [a.diff() for a in q]
    kinematics = [rates[1] - u[0], rates[0] + sp.cos(q[1]) * rates[1] - u[1], rates[2] + rates[3] - u[2] - rates[0],
                  rates[2] - sp.sin(q[0]) * rates[3] - u[3], rates[4] * (2 + sp.cos(q[4])) - rates[3] - u[4]]
    equations = sd.from_sympy((q, u, sp.eye(5), [0] * 5), "blocks", kinematics=kinematics)
    x = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 1.0, 2.0, 3.0, 4.0, 5.0])
    at = dict(zip([*q, *u], x, strict=True))
    K, right = sp.linear_eq_to_matrix(kinematics, rates)
    expected = np.linalg.solve(*(np.array(e.subs(at), dtype=float) for e in (K, right))).ravel()
    assert equations.compile(backend="numpy").rhs(0.0, x)[:5] == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_where_they_are_singular_the_reason_is_reported(n: int) -> None:
    q, u = list(dynamicsymbols(f"q1:{n + 1}")), list(dynamicsymbols(f"u1:{n + 1}"))
    K = sp.Matrix(n, n, lambda i, j: sp.sin(q[0]) * (1 + i + j) + (sp.sin(q[0]) if i == j else 0))
    equations = sd.from_sympy((q, u, sp.eye(n), [0] * n), "singular",
                              kinematics=list(K * sp.Matrix(q).diff(dynamicsymbols._t) - sp.Matrix(u)))
    with pytest.raises(sd.EvaluationError, match="do not determine the derivatives of the coordinates here"):
        equations.compile(backend="numpy").rhs(0.0, [0.0] * n + [1.0] * n)
