"""tau = Y pi: the regressor against inverse dynamics, for every system of the catalogue and every joint."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.tape.node import PARAMETER
from tests import helpers
from tests.formulation.general import chain
from tests.formulation.test_identities import SEEDS, Draw

CATALOGUE = [*[(name, {}) for name in sd.systems.names(constrained=False)], ("puma560", {"general": True}),
             ("puma560", {"motors": True}), ("puma560", {"convention": "modified", "general": True}),
             ("prismatic_chain", {"n": 4})]
# Loads are no part of Y pi: inputs, friction, springs and dampers are switched off.
SILENT = ("F", "tau", "B", "Tp", "Tn", "K", "C")


def agree(eq: Equations, seed: int, **given: Any) -> None:
    """Y pi against inverse dynamics at a random state with random accelerations."""
    accelerations = helpers.numbers([f"{u.name}_dot" for u in eq.symbols.speeds], seed + 50, -1, 1)
    values = helpers.state(eq, seed, **accelerations, **given)
    Y, pi, tau = helpers.quantities(eq, values, "regressor", "inertial_parameters", "inverse_dynamics", digits=40)
    assert Y.shape == (len(eq.symbols.speeds), len(pi))
    assert helpers.close(Y @ pi, tau)


@pytest.mark.every_value
@pytest.mark.parametrize("frames", ["body", "parallel"])
@pytest.mark.parametrize(("name", "options"), CATALOGUE)
def test_catalogue(name: str, options: dict[str, Any], frames: str) -> None:
    s = sd.systems.get(name, **options)
    eq = s.embedding(frames)
    silent = [a.name for a in (*eq.symbols.inputs, *eq.symbols.parameters) if a.name.rstrip("0123456789") in SILENT]
    agree(eq, 1, **dict.fromkeys(silent, 0))
    assert eq.quantity("inertial_parameters").shape == (10 * len(s.bodies),)


@pytest.mark.parametrize("seed", SEEDS)
def test_trees_with_given_motion_and_coupled_speeds(seed: int) -> None:
    agree(Draw(seed, loads=False).s.embedding(), seed)


@pytest.mark.parametrize("joints", ["Rz He Cy", "Fr Un", "Fr+ Sp+", "Pl Sp", "Rw Pw Rw"])
def test_joints(joints: str) -> None:
    agree(chain(joints, (1, -2, 3)).embedding(), 2)


def test_recursive_form_has_the_same() -> None:
    eq = chain("Rz Rx Py").recursive()
    agree(eq, 3)
    assert (len(eq.base_parameters()), eq.quantity("regressor").shape) == (len(chain("Rz Rx Py").embedding().base_parameters()),
                                                                          (3, 30))


def test_pendulum_by_hand() -> None:
    q, h, g = sd.coordinates("q"), sd.parameters("h_x h_y"), sd.parameters("g")
    s = sd.System("hanging", gravity=[0, -g])
    m, I = sd.parameters("m I")
    body = s.add_body("bob", mass=m, inertia=I, com=[h[0] / m, h[1] / m])
    s.add_joint(sd.Revolute("pivot", s.ground, body, q))
    eq = s.embedding()
    values = helpers.state(eq, 4, q_dot_dot=3)
    Y, pi = helpers.quantities(eq, values, "regressor", "inertial_parameters")
    n = {k: float(v) for k, v in values.items()}
    wanted = np.zeros(10)
    wanted[[1, 2, 9]] = n["g"] * np.cos(n["q"]), -n["g"] * np.sin(n["q"]), 3
    assert np.allclose(Y.astype(float), [wanted], atol=1e-15)
    x, y = n["h_x"], n["h_y"]
    assert np.allclose(pi.astype(float), [n["m"], x, y, 0, y * y / n["m"], -x * y / n["m"], 0, x * x / n["m"], 0,
                                          n["I"] + (x * x + y * y) / n["m"]])


def test_depends_on_lengths_and_gravity_alone() -> None:
    eq = sd.systems.get("puma560", general=True).embedding()
    used = {leaf.args[1] for leaf in eq.tape("regressor").inputs if leaf.mask == PARAMETER}
    assert used == {"g", "a2", "a3", "d3", "d4"}


def test_parameters_without_effect_have_structural_zeros() -> None:
    eq = sd.systems.get("spatial_chain", n=3).embedding()
    Y = eq.quantity("regressor")
    felt = [bool(Y[:, k].any()) for k in range(30)]
    assert felt[:10] == [False] * 9 + [True]  # the first body turns about a vertical axis
    assert all(felt[11:20]) and not Y[2, :20].any()  # a joint does not feel the bodies before it


def test_bodies_held_to_the_ground_have_no_part() -> None:
    s = sd.systems.get("pendulum")
    wall = s.add_body("wall", mass=sd.parameters("m_w"), com=[1, 2])
    s.add_joint(sd.Fixed("weld", s.ground, wall))
    eq = s.embedding()
    agree(eq, 5)
    assert not eq.quantity("regressor")[:, 10:].any() and eq.quantity("inertial_parameters")[10] is eq.leaves[sp.Symbol("m_w")]


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_compiled(backend: str) -> None:
    from symdyn.runtime.building.compiler import find_compiler

    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    module = sd.systems.get("three_link_arm").embedding().compile(backend=backend)
    rng = np.random.default_rng(1)
    x, ud = rng.uniform(-1, 1, (20, 6)), rng.uniform(-1, 1, (20, 3))
    Y = module.evaluate("regressor", 0.0, x, None, ud=ud).reshape(20, 3, 30)
    pi = module.evaluate("inertial_parameters", 0.0, x[0])
    tau = module.evaluate("inverse_dynamics", 0.0, x, None, ud=ud)
    assert np.allclose(Y @ pi, tau, rtol=1e-13, atol=1e-13)
