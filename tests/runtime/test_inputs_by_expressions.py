"""Inputs that are expressions of the time, compared with the same expressions in the description."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError

F, = sd.inputs("F,")
z, = sd.motions("z,")
q, = sd.coordinates("q,")
PUSH = sp.exp(-sd.t) * sp.sin(3 * sd.t) + sp.besselj(0, sd.t)
JUMPS = sp.Piecewise((2, sd.t < 0.7), (-1, True))
WAY = sp.sin(2 * sd.t) / 5


def pushed(force: sp.Expr) -> sd.System:
    system = sd.System("pushed")
    body = system.add_body("body", mass=2)
    joint = system.add_joint(sd.Prismatic("slide", "ground", body, q, axis=[1, 0, 0]))
    system.add_joint_force(joint, force - 3 * q - 0.2 * q.dot)
    return system


def carried(way: sp.Expr) -> sd.System:
    system = sd.System("carried", gravity=[0, 0, -9.81])
    cart, rod = system.add_body("cart", mass=1), system.add_body("rod", mass=1, com=[0, 0, -0.5])
    system.add_joint(sd.Prismatic("slide", "ground", cart, way, axis=[1, 0, 0]))
    system.add_joint(sd.Revolute("pin", cart, rod, q, axis=[0, 1, 0]))
    return system


@pytest.fixture(scope="module")
def module() -> sd.Module:
    return pushed(F).compile(backend="numpy")


def test_a_force_is_that_of_the_description(module: sd.Module) -> None:
    force = sp.exp(-sd.t) * sp.sin(3 * sd.t) - sp.sqrt(1 + sd.t)
    wanted = pushed(force).compile(backend="numpy")
    for given in ({F: force}, force):
        found = module.simulate((0, 3), [0.1], [0.0], inputs=given, rtol=1e-11)
        np.testing.assert_allclose(found.x, wanted.simulate((0, 3), [0.1], [0.0], rtol=1e-11).x, rtol=0, atol=1e-11)
    assert module.simulate((0, 3), [0.1], [0.0], inputs={F: sp.Integer(2)}).inputs[5, 0] == 2.0


def test_special_functions_are_those_of_scipy(module: sd.Module) -> None:
    from scipy.special import j0

    found = module.simulate((0, 3), [0.1], [0.0], inputs={F: PUSH})
    np.testing.assert_allclose(found.inputs[:, 0], np.exp(-found.t) * np.sin(3 * found.t) + j0(found.t), rtol=0, atol=1e-15)


@pytest.mark.native
def test_smooth_expressions_suit_the_method_that_needs_smooth_inputs() -> None:
    module, smooth = pushed(F).compile(backend="c"), sp.cos(sd.t)
    found = module.simulate((0, 2), [0.1], [0.0], inputs={F: smooth}, method="gauss", rtol=1e-10)
    wanted = module.simulate((0, 2), [0.1], [0.0], inputs={F: smooth}, rtol=1e-12)
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=1e-8)
    with pytest.raises(ArgumentError, match="may jump or have kinks, which constant steps go across"):
        module.simulate((0, 2), [0.1], [0.0], inputs={F: JUMPS}, method="gauss")


def test_a_jump_is_met_as_that_of_a_function(module: sd.Module) -> None:
    found = module.simulate((0, 2), [0.1], [0.0], inputs={F: JUMPS}, rtol=1e-9)
    same = module.simulate((0, 2), [0.1], [0.0], inputs={F: lambda t, x: 2.0 if t < 0.7 else -1.0}, rtol=1e-9)
    np.testing.assert_array_equal(found.x, same.x)


def test_batches_run_motion_by_motion(module: sd.Module) -> None:
    runs = module.simulate_batch([[0.1], [0.2]], t=(0, 1), inputs={F: PUSH})
    for k, start in enumerate((0.1, 0.2)):
        np.testing.assert_array_equal(runs.x[k, -1], module.simulate((0, 1), [start], [0.0], inputs={F: PUSH}).x[-1])


def test_a_motion_has_the_rates_of_its_expression() -> None:
    given = carried(z).compile(backend="numpy").simulate((0, 2), [0.3], [0.1], inputs={z: WAY}, rtol=1e-11)
    wanted = carried(WAY).compile(backend="numpy").simulate((0, 2), [0.3], [0.1], rtol=1e-11)
    np.testing.assert_allclose(given.x, wanted.x, rtol=0, atol=1e-10)
    np.testing.assert_allclose(given.inputs[:, 2], -4 * np.sin(2 * given.t) / 5, rtol=0, atol=1e-15)


def test_expressions_that_do_not_fit_are_rejected(module: sd.Module) -> None:
    a = sp.Symbol("a")
    with pytest.raises(ArgumentError, match=r"pushed: inputs: F is a\*t; an expression of an input has the time symdyn\.t "
                                            "alone, found a in it: put numbers in their place, write the expression into the"):
        module.simulate((0, 1), [0.1], [0.0], inputs={F: a * sd.t})
    carriage = carried(z).compile(backend="numpy")
    with pytest.raises(ArgumentError, match=r"carried: inputs: z is Abs\(t\), which may jump or have kinks; a motion needs"):
        carriage.simulate((0, 1), [0.3], [0.0], inputs={z: sp.Abs(sd.t)})
    with pytest.warns(sd.SimulationWarning, match="the input F is nan at t = 0"):
        module.simulate((0, 1), [0.1], [0.0], inputs={F: sp.log(sd.t - 3)})
