"""Nets of rods between particles: many loops and many freedoms, compared with the equations solved with many digits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import ArgumentError, EvaluationError, ModelError, ModelWarning
from symdyn.formulation.constraints import saddle
from symdyn.formulation.constraints.null_space import least_operations
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.lab import nets
from symdyn.lab.nets import by_hand, moving, net
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept


def test_elimination_of_many_freedoms_is_not_derived() -> None:
    equations = net(6, 7).augmented()
    how = next(note for note in equations.notes if note.startswith("accelerations by"))
    assert "by Schur complement" in how and " at least; the numeric" in how


def test_the_least_of_operations_is_that_of_the_reduced_mass_matrix() -> None:
    """Operations for n speeds: a row between each two, so that one is free and n - 1 squares are added; no rows and a full
    matrix, with factors of n (n^2 - 1) / 6 products; one row over all, which ties the n - 1 others to each other, by one product
    each."""
    n = 6
    chain, diagonal = Sampled.of((np.eye(n - 1, n) + np.eye(n - 1, n, 1))[None]), Sampled.of(np.eye(n)[None])
    assert least_operations(chain, diagonal, [(k, k) for k in range(n - 1)]) == 2 * (n - 1) - 1
    assert least_operations(Sampled.of(np.zeros((1, 0, n))), Sampled.of(np.ones((1, n, n))), []) == n * (n**2 - 1) // 6
    factors = (n - 1) * ((n - 1)**2 - 1) // 6
    assert least_operations(Sampled.of(np.ones((1, 1, n))), diagonal, [(0, 0)]) == factors + n * (n - 1) // 2


def test_without_the_numeric_algorithm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mechanisms that are too large for it have the same accelerations, and raise where a pivot vanishes."""
    usual = net(3, 3).augmented().compile(backend="numpy")
    monkeypatch.setattr(saddle, "MOST_ON_STACK", 8 * 2000)
    equations = net(3, 3).augmented()
    assert usual.jacobian_indices() is None and equations.singular_fallback is None
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
    """Accelerations at a state in motion are those of equations by hand with 60 digits; the energy of a swing stays."""
    module = net(4, 4).augmented().compile()
    n = module.metadata.sizes.u
    q, u = moving(module)
    x, exact = np.concatenate([q, u]), by_hand(4, 4, module.metadata.q, q, u)
    assert np.abs(module.rhs(0, x)[n:] - exact).max() <= 1e-12 * np.abs(exact).max()
    sol = module.simulate((0, 1), q, u, rtol=1e-9)
    assert sol.success and sol.energy_error() <= 1e-8 and np.abs(sol.constraint_violation).max() <= 1e-12


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
@pytest.mark.parametrize("side", [3, *swept([5])])
def test_rows_of_states_have_the_bits_of_single_states(side: int) -> None:
    """Statements of like shape, of which one adds and its neighbour subtracts a product: compilers that compute them side by
    side may round them once, in the code of one state only."""
    module = net(side, side).augmented().compile()
    q, u = moving(module)
    x = np.concatenate([q, u]) + 1e-3 * np.random.default_rng(0).normal(size=(64, 2 * len(q)))
    assert np.array_equal(module.rhs_batch(0.0, x), [module.rhs(0.0, state) for state in x])
    velocities = [module.consistent(u=np.random.default_rng(k).normal(size=len(u)))[1] for k in range(8)]
    many = module.simulate_batch(q, velocities, t=(0, 0.02), rtol=1e-9)
    alone = [module.simulate((0, 0.02), q, v, rtol=1e-9) for v in velocities]
    assert np.array_equal(many.x[:, -1], [sol.x[-1] for sol in alone])


@pytest.mark.sweep
@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_measurement(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    assert main(["bench", "nets", "--sizes", "4", "--json", str(tmp_path / "found.json")]) == 0
    assert capsys.readouterr().out.splitlines()[0] == nets.HEADING and (tmp_path / "found.json").exists()


def test_sizes_of_nets() -> None:
    with pytest.raises(ArgumentError, match=r"3 or more; found 2 10$"):
        nets.run((2, 10))
