"""Long chains on floats: how much forward of inverse, and inverse of forward, lose."""

from __future__ import annotations

import random

import numpy as np
import pytest

from symdyn import systems
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.numbers import NumericTree
from symdyn.formulation.trees.articulated import Articulated
from symdyn.formulation.trees.inertial_forces import inertial_forces
from symdyn.formulation.trees.tree import Tree
from tests.formulation.recursive.trees import check, random_vector


def lean(tree: Tree, tau: np.ndarray) -> np.ndarray:
    """Accelerations by the articulated bodies that generated code is made from."""
    g = tree.algebra.constants(tree.model.gravity)
    wrenches, _ = inertial_forces(tree, tree.b, -g)
    return Articulated(tree, dict.fromkeys(range(len(tree.w)), "")).solve(tau, wrenches)


@pytest.mark.parametrize(("n", "accelerations"), [(5, 2e-11), (10, 2e-11), (20, 2e-11), (30, 2e-11), (100, 1e-8)])
def test_spatial_chain(n: int, accelerations: float) -> None:
    """Norm-wise errors; the mass matrix of 100 links has a condition of 1e6 and more."""
    chain = NumericTree(systems.get("spatial_chain", n=n).check())
    rng = random.Random(n)
    for seed in range(2 if n > 50 else 5):
        q, u = [rng.uniform(-3, 3) for _ in range(n)], [rng.uniform(-1, 1) for _ in range(n)]
        tree = chain.at(q, u).tree
        w_dot = random_vector(n, seed)
        tau = inverse_dynamics(tree, w_dot).tau
        for found in (forward_dynamics(tree, tau).u_dot, lean(tree, tau)):
            check(found, w_dot, accelerations)
            check(inverse_dynamics(tree, found).tau, tau, 1e-13)
