"""Fits of closed loops: starts stay on the constraints for every value that is tried, and so do their derivatives."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.estimation.experiment import taken
from symdyn.estimation.fit import _problem
from symdyn.estimation.starts import Start
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
T = np.linspace(0, 2, 81)


@cache
def by_angle() -> Any:
    theta = sd.coordinates("theta")
    m, l, g = sd.parameters("m l g", positive=True)
    system = sd.System("by_angle", gravity=[0, -g])
    bob = system.add_body("bob", mass=m, com=[l, 0])
    system.add_joint(sd.Revolute("hinge", system.ground, bob, theta))
    system.add_output("tip", sd.position(bob, [l, 0]))
    system.defaults, system.initial = {m: 1.0, l: 1.0, g: 9.81}, {theta: -0.6}
    return system.embedding().compile()


@cache
def by_rod() -> Any:
    """The same pendulum as a point that a rod holds: a constraint with l, coordinates x and y."""
    x, y = sd.coordinates("x y")
    m, l, g = sd.parameters("m l g", positive=True)
    system = sd.System("by_rod", gravity=[0, -g])
    carriage, bob = system.add_body("carriage"), system.add_body("bob", mass=m)
    system.add_joint(sd.Prismatic("across", system.ground, carriage, x, axis=[1, 0]))
    system.add_joint(sd.Prismatic("upwards", carriage, bob, y, axis=[0, 1]))
    system.add_constraint(x**2 + y**2 - l**2, name="rod")
    system.add_output("tip", sd.position(bob, [0, 0]))
    system.defaults = {m: 1.0, l: 1.0, g: 9.81}
    system.initial = {x: np.cos(-0.6), y: np.sin(-0.6)}
    return system.augmented().compile()


@cache
def four_bar() -> tuple[Any, np.ndarray, np.ndarray]:
    module = sd.systems.get("four_bar").augmented().compile()
    return module, *module.consistent({"q1": 0.5}, {"q1_dot": 3.0}, keep=["q1", "q1_dot"])


def test_a_rod_is_fitted_as_a_length_without_a_constraint_is() -> None:
    truth = by_angle().simulate(T, params={"l": 1.2})
    noisy = truth.outputs["tip"] + 0.01 * np.random.default_rng(3).normal(size=(len(T), 2))
    plain = sd.fit(by_angle(), sd.Experiment(T, {"tip": noisy}), ["l"], ["theta"])
    held = sd.fit(by_rod(), sd.Experiment(T, {"tip": noisy}), ["l"], ["x"])
    assert held.success and held.values["l"] == pytest.approx(plain.values["l"], rel=1e-8)
    assert held.values["x(0)"] == pytest.approx(plain.values["l"] * np.cos(plain.values["theta(0)"]), rel=1e-7)
    assert held.deviations["l"] == pytest.approx(plain.deviations["l"], rel=1e-5)
    assert held.noise == pytest.approx(plain.noise, rel=1e-7)


def test_a_parameter_of_the_constraints_without_unknown_starts() -> None:
    """x stays at what it is in the experiment, y follows."""
    q, u = by_rod().consistent({"x": 0.8}, {"x_dot": 0.5}, params={"l": 1.2}, keep=["x", "x_dot"])
    truth = by_rod().simulate(T, q=q, u=u, params={"l": 1.2})
    experiment = sd.Experiment(T, {"y": truth["y"]}, q={"x": 0.8, "y": -0.6}, u={"x_dot": 0.5, "y_dot": 2 / 3})
    found = sd.fit(by_rod(), experiment, ["l"])
    assert found.values["l"] == pytest.approx(1.2, rel=1e-7)
    np.testing.assert_allclose(found.motions[0].x[0], truth.x[0], rtol=1e-7, atol=1e-9)


def test_derivatives_of_residuals_and_values_of_a_closed_loop() -> None:
    module, q, u = four_bar()
    truth = module.simulate(T, q=q, u=u)
    experiment = sd.Experiment(T, {"q1": truth["q1"], "q3": truth["q3"]}, q=q, u=u)
    problem = _problem(module, taken(module, [experiment]), ["l2", "lc3"], ["q1", "q1_dot"], None, None, None, None, 1e-11,
                       "dop853")
    at, step = 1.01 * np.array([unknown.guess for unknown in problem.unknowns]), 1e-5
    sides = [[problem.residuals(at + sign * step * e) for sign in (1, -1)] for e in np.eye(4)]
    differences = np.stack([(a - b) / (2 * step) for a, b in sides], axis=-1)
    np.testing.assert_allclose(problem.jacobian(at), differences, rtol=0, atol=2e-8 * np.abs(differences).max())
    found = sd.fit(module, experiment, ["l2"], ["q1", "q1_dot"], start={"l2": 1.05 * 2.0})
    assert found.values == pytest.approx({"l2": 2.0, "q1(0)": 0.5, "q1_dot(0)": 3.0}, rel=1e-7)


def test_starts_of_rolling_and_of_euler_parameters() -> None:
    """Derivatives by what is fitted, against differences: constraints of speeds, and unit vectors."""
    sleigh = sd.systems.get("sleigh").augmented().compile()
    ball = sd.System("ball")
    body = ball.add_body("body", mass=1, inertia=[1, 2, 3])
    p = sd.coordinates("p_0:4")
    ball.add_joint(sd.Spherical("joint", ball.ground, body, orientation=sd.EulerParameters(), coordinates=list(p)))
    spinning = ball.embedding().compile()
    for module, fitted, x in ((sleigh, ["theta", "theta_dot"], {"theta": 0.4, "theta_dot": 0.7, "x_dot": 0.3}),
                              (spinning, ["p_1", "p_2"], {"p_0": 0.8, "p_1": 0.6})):
        names = list(module.metadata.x)
        given = np.array([x.get(name, 0.0) for name in names])
        start = Start(module, 0.0, given, module.parameters(None), fitted)
        for by in fitted:
            sides = [start.at({by: start.first[names.index(by)] + sign * 1e-5}, module.parameters(None)) for sign in (1, -1)]
            np.testing.assert_allclose(start.derivative(start.first, module.parameters(None), by), (sides[0] - sides[1]) / 2e-5,
                                       atol=1e-9, err_msg=f"{module.name} {by}")
    assert np.linalg.norm(start.at({"p_1": 0.5, "p_2": 0.3}, module.parameters(None))[:4]) == pytest.approx(1, abs=1e-14)


def test_a_loop_that_cannot_close_is_a_step_not_taken() -> None:
    module, q, u = four_bar()
    start = Start(module, 0.0, np.concatenate([q, u]), module.parameters(None), ["q1"])
    with pytest.raises(sd.errors.EvaluationError, match=r"no start fulfils the constraints with l2 = 20: on the way there "
                                                        r"from the guess the mechanism does not close"):
        start.at({}, module.parameters({"l2": 20.0}))


def test_more_initial_values_than_the_constraints_leave_free_are_rejected() -> None:
    module, q, u = four_bar()
    experiment = sd.Experiment(T, {"q1": np.zeros(len(T))}, q=q, u=u)
    with pytest.raises(ArgumentError, match=r"initial has q1, q2, but constraints, or the norm of Euler parameters, let 1 of the "
                                            r"3 coordinates be chosen, and q1 determine q2; leave out q2"):
        sd.fit(module, experiment, ["l2"], ["q1", "q2"])


def test_sensitivities_with_derivatives_of_the_start() -> None:
    """A start that depends on a parameter: dx(0)/dl as it is given, against differences of the whole."""
    def motion(l: float, **asked: Any) -> Any:
        return by_rod().simulate(T, q={"x": l * np.cos(-0.6), "y": l * np.sin(-0.6)}, params={"l": l}, rtol=1e-11, **asked)

    found = motion(1.0, sensitivities={"l": [np.cos(-0.6), np.sin(-0.6), 0, 0]}).sensitivity["l"]
    differences = (motion(1 + 1e-5).x - motion(1 - 1e-5).x) / 2e-5
    np.testing.assert_allclose(found, differences, atol=1e-8 * np.abs(differences).max())
    gradient = by_rod().gradient(sd.Loss(end=sp.Symbol("y")), {"l": [np.cos(-0.6), np.sin(-0.6), 0, 0]}, (0, 2),
                                 q={"x": np.cos(-0.6), "y": np.sin(-0.6)}, rtol=1e-11)
    assert gradient["l"] == pytest.approx(found[-1, 1], rel=1e-8)


@pytest.mark.parametrize("value, text", [([1.0, 0.0], "pass 4 finite numbers, those of x, y, x_dot, y_dot"),
                                         ([np.nan] * 4, "pass 4 finite numbers"),
                                         ("steep", "the derivative of the start by l must be numbers")])
def test_derivatives_of_the_start_that_do_not_fit(value: Any, text: str) -> None:
    with pytest.raises(ArgumentError, match=text):
        by_rod().simulate(T, sensitivities={"l": value})
