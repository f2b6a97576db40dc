"""Long chains and large trees: derived, generated, compiled, and right."""

from __future__ import annotations

import numpy as np
import pytest

import symdyn as sd
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.numbers import NumericTree
from symdyn.lab.random_tree import random_tree
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture(scope="module")
def chain() -> sd.System:
    return sd.systems.get("spatial_chain", n=100)


@needs_c
def test_a_chain_of_100_links(chain: sd.System) -> None:
    """Compiled accelerations against the recursion of the lecture's page on plain floats; bound: the condition of M_tilde."""
    module = chain.compile(backend="c")
    rng = np.random.default_rng(5)
    q, u = rng.uniform(-1, 1, 100), rng.uniform(-1, 1, 100)
    numbers = NumericTree(chain.check()).at(q, u)
    plain = forward_dynamics(numbers.tree, numbers.applied.joint, numbers.applied.wrenches).u_dot
    ours = module.rhs(0.0, np.concatenate([q, u]))[100:]
    assert np.linalg.norm(ours - plain.astype(float)) <= 1e-8 * np.linalg.norm(ours)
    tau = inverse_dynamics(numbers.tree, ours).tau.astype(float)
    largest = np.abs(inverse_dynamics(numbers.tree, np.zeros(100)).tau.astype(float)).max()
    assert np.abs(tau).max() <= 1e-11 * largest  # no drives: what holds the motion is zero, against weights and inertia


@pytest.mark.sweep
def test_a_random_tree_of_120_bodies_is_derived_and_written() -> None:
    equations = random_tree(120).recursive()
    text = next(iter(emit(equations, "c", ("rhs",), standalone=False, integrator=False).files.values()))
    assert equations.tape("rhs").operations < 400 * 120 and text.count("_part_") > 30


@needs_c
def test_a_random_tree_compiled() -> None:
    """In parts, against the recursion of the lecture's page on plain floats."""
    system = random_tree(25)
    module = system.recursive().compile(backend="c")
    n_q, n_u = (len(module.metadata.names(group)) for group in ("q", "u"))
    rng = np.random.default_rng(6)
    q, u = rng.uniform(-0.8, 0.8, n_q), rng.uniform(-1, 1, n_u)
    numbers = NumericTree(system.check()).at(q, u)
    plain = forward_dynamics(numbers.tree, numbers.applied.joint, numbers.applied.wrenches).u_dot.astype(float)
    assert np.linalg.norm(module.rhs(0.0, np.concatenate([q, u]))[n_q:] - plain) <= 1e-10 * np.linalg.norm(plain)


def test_the_choice_leaves_the_mass_matrix_of_a_long_chain_alone(chain: sd.System) -> None:
    equations = chain.equations()
    assert [c.formulation for c in equations.candidates] == ["recursive"] and equations.formulation == "recursive"
