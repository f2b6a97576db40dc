"""Nets of rods between particles: many loops and many freedoms, compared with the equations solved with many digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError, ModelError, ModelWarning
from symdyn.formulation.constraints import saddle
from symdyn.formulation.constraints.null_space import least_operations
from symdyn.runtime.building.compiler import find_compiler


def net(rows: int, columns: int) -> sd.System:
    """Particles that rods join to their neighbours; all hang from the two outer ones of the first row, which stand still."""
    mass, gravity, length = sd.parameters("m g l")
    system = sd.System(f"net_{rows}_{columns}", gravity=[0, 0, -gravity])
    knots: dict[tuple[int, int], Any] = {}
    depth = np.sqrt(1 - 0.9**2)
    for i, j in np.ndindex(rows, columns):
        at = [0.9 * j, depth * (j % 2), -1.0 * i]
        if i == 0 and j in (0, columns - 1):
            knots[i, j] = system.ground, at
            continue
        parent = system.ground
        for letter, axis, value in zip("xyz", np.eye(3, dtype=int).tolist(), at, strict=True):
            q, = sd.coordinates(f"{letter}{i}_{j},")
            child = system.add_body(f"{letter}_of_{i}_{j}", mass=mass if letter == "z" else 0)
            system.add_joint(sd.Prismatic(f"slide_{letter}{i}_{j}", parent, child, q, axis=axis))
            system.initial[q] = value
            parent = child
        knots[i, j] = parent, [0, 0, 0]
    for i, j in knots:
        for other in ((i, j + 1), (i + 1, j)):
            if other in knots and not (knots[i, j][0] is knots[other][0] is system.ground):
                (a, at), (b, there) = knots[i, j], knots[other]
                system.close_loop(sd.Rod(f"rod_{i}_{j}_{other[0]}_{other[1]}", a, b, length, parent_point=at, child_point=there))
    system.defaults = {mass: 0.1, gravity: 9.81, length: 1.0}
    return system


def test_elimination_of_many_freedoms_is_not_derived() -> None:
    equations = net(6, 7).augmented()
    how = next(note for note in equations.notes if note.startswith("accelerations by"))
    assert "by Schur complement" in how and " at least; the numeric" in how


def test_the_least_of_operations_is_that_of_the_reduced_mass_matrix() -> None:
    """Of n speeds: a row between each two, so that one is free and n - 1 squares are added; no rows and a full matrix, with
    factors of n (n^2 - 1) / 6 products; one row over all, which ties the n - 1 others to each other, by one product each."""
    n = 6
    chain = np.eye(n - 1, n, dtype=bool) | np.eye(n - 1, n, 1, dtype=bool)
    assert least_operations(chain, np.eye(n, dtype=bool), [(k, k) for k in range(n - 1)]) == 2 * (n - 1) - 1
    assert least_operations(np.zeros((0, n), dtype=bool), np.ones((n, n), dtype=bool), []) == n * (n**2 - 1) // 6
    factors = (n - 1) * ((n - 1)**2 - 1) // 6
    assert least_operations(np.ones((1, n), dtype=bool), np.eye(n, dtype=bool), [(0, 0)]) == factors + n * (n - 1) // 2


def test_without_the_numeric_algorithm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mechanisms that are too large for it have the same accelerations, and raise where a pivot vanishes."""
    usual = net(3, 3).augmented().compile(backend="numpy")
    monkeypatch.setattr(saddle, "MOST_ON_STACK", 8 * 2000)
    equations = net(3, 3).augmented()
    assert usual.places_of_jacobian() is None and equations.otherwise is None
    assert equations.notes[-1] == ("where a pivot vanishes evaluations raise: the numeric algorithm for 21 speeds and 12 "
                                   "constraints would take 0.0 MB of the stack, of 0.0 MB that it may take")
    module = equations.compile(backend="numpy")
    q, u = module.consistent(u=np.random.default_rng(1).normal(size=21))
    x = np.concatenate([q, u])
    assert np.abs(module.rhs(0, x) - usual.rhs(0, x)).max() <= 1e-12 * np.abs(usual.rhs(0, x)).max()
    x[:3] = x[6:9]  # the knots (0, 1) and (1, 1) at one point, so that the rod between them holds nothing
    assert module.metadata.q[0:9:6] == ("x0_1", "x1_1")
    with pytest.raises(EvaluationError, match=r"net_3_3: rhs cannot be evaluated: constraint rod_0_1_1_1 holds nothing here"):
        module.rhs(0, x)


def test_what_has_no_way_without_the_numeric_algorithm_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saddle, "MOST_ON_STACK", 0)
    x, y = sd.coordinates("x y")
    with pytest.warns(ModelWarning, match="no state was found"), pytest.raises(
            ModelError, match=r"the mass matrix alone is singular, .* for 2 speeds and 1 constraints would take .* give"):
        sd.augmented(coordinates=[x, y], mass=sp.diag(1, 0), force=[0, 0], constraints=[x**2 + y**2 + 1])
    with pytest.raises(ModelError, match=r"multipliers of least norm are requested, .* leave out constraints that follow"):
        sd.systems.bricard().augmented().quantity("lam")


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_accelerations_and_energy() -> None:
    """Accelerations at a state in motion are those of the whole matrix with 40 digits; the energy of a swing stays."""
    module = net(4, 4).augmented().compile()
    n = module.metadata.sizes.u
    begin = np.random.default_rng(2).normal(size=n)
    q, u = module.consistent(u=begin)
    x = np.concatenate([q, u])
    C_r, F_d = np.reshape(module.evaluate("C_r", 0, x), (-1, n)), module.evaluate("F_d", 0, x)
    with mpmath.workdps(40):
        m, rows = mpmath.mpf(0.1), mpmath.matrix(C_r.tolist())
        weight = mpmath.matrix([-9.81 if name.startswith("z") else 0 for name in module.metadata.q])
        # With M = m: u_dot = g - C_r^T lam / m, C_r u_dot = F_d.
        lam = mpmath.lu_solve(rows * rows.T / m, rows * weight - mpmath.matrix(F_d.tolist()))
        exact = np.array([float(e) for e in weight - rows.T * lam / m])
    assert np.abs(module.rhs(0, x)[n:] - exact).max() <= 1e-12 * np.abs(exact).max()
    sol = module.simulate((0, 1), q, u, rtol=1e-9)
    assert sol.success and sol.energy_error() <= 1e-8 and np.abs(sol.constraint_violation).max() <= 1e-12
