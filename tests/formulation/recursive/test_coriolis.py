"""The Coriolis matrix: C u = k_tilde, M_dot - 2 C skew-symmetric, for plain, quasi- and coupled speeds."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from symdyn.errors import SymdynError
from symdyn.formulation.textbook.bias import bias, gravity_load
from symdyn.formulation.textbook.composite_bodies import composite_bodies
from symdyn.formulation.textbook.coriolis import coriolis
from symdyn.formulation.textbook.energy import energy
from tests import helpers
from tests.formulation.recursive.trees import at, by_time, check, few_of, numeric, state

CASES = [*[(seed, {}) for seed in range(14)], *[(seed, {"gears": True}) for seed in range(1, 14, 3)]]


@pytest.mark.parametrize(("seed", "options"), few_of(CASES))
def test_coriolis_matrix(seed: int, options: dict[str, bool]) -> None:
    tree = numeric(seed, **options)
    where = state(tree, seed, 60)
    here = tree.at(**where, digits=60).tree
    u = np.array([mpmath.mpf(v) for v in where["u"].values()], dtype=object)
    C, k = coriolis(here).C, bias(here).k_tilde
    M_dot = by_time(tree, where, 0 * u, lambda later: composite_bodies(later).M)
    with mpmath.workdps(60):
        assert helpers.close(C @ u, k)
        skew = M_dot - 2 * C
        assert helpers.close(skew, -skew.T)


@pytest.mark.parametrize(("seed", "options"), few_of(CASES[::3]))
def test_in_floats(seed: int, options: dict[str, bool]) -> None:
    here = at(numeric(seed, **options), seed).tree
    u = np.array(list(state(numeric(seed, **options), seed)["u"].values()))
    check(coriolis(here).C @ u, bias(here).k_tilde, 1e-12)


def test_matrix_of_two_links() -> None:
    """The textbook's: h = m2 l1 lc2 sin q2, C = [[-h q2_dot, -h (q1_dot + q2_dot)], [h q1_dot, 0]]."""
    from symdyn import systems
    from symdyn.formulation.textbook.numbers import NumericTree

    model = systems.get("two_link_arm").check()
    (a, b), p = (0.7, -1.3), {s.name: v for s, v in model.defaults.items()}
    C = coriolis(NumericTree(model).at(q=[0.4, 0.9], u=[a, b]).tree).C
    h = p["m2"] * p["l1"] * p["lc2"] * np.sin(0.9)
    assert np.allclose(C.astype(float), [[-h * b, -h * (a + b)], [h * a, 0]], rtol=0, atol=1e-15)


def test_given_motions_have_none() -> None:
    here = at(numeric(2, driven=True), 2).tree
    with pytest.raises(SymdynError, match="joints ground_motion, given_1, given_2 follow given functions of time; use k_tilde"):
        coriolis(here)


@pytest.mark.parametrize(("seed", "options"), few_of(CASES[::2]))
def test_gravity_load_is_the_derivative_of_the_potential_energy(seed: int, options: dict[str, bool]) -> None:
    """dV/dt = load . u for any u: the load is dV/dq where the speeds are the coordinates' derivatives."""
    tree = numeric(seed, **options)
    where = state(tree, seed, 60)
    load = gravity_load(tree.at(**where, digits=60).tree).load
    with mpmath.workdps(60):
        u = np.array([mpmath.mpf(v) for v in where["u"].values()], dtype=object)
        assert helpers.close(by_time(tree, where, 0 * u, lambda later: energy(later).potential), load @ u)


@pytest.mark.parametrize("seed", [1, 6])
def test_gravity_load_entry_by_entry(seed: int) -> None:
    tree = numeric(seed)
    where = state(tree, seed, 60)
    load = gravity_load(tree.at(**where, digits=60).tree).load
    for entry, name in zip(load, where["u"], strict=True):
        along = {**where, "u": {**dict.fromkeys(where["u"], 0), name: 1}}
        assert helpers.close(by_time(tree, along, 0 * load, lambda later: energy(later).potential), entry)
