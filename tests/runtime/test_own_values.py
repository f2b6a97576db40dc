"""Results keep the values that they were computed with, whatever becomes of the arrays and mappings that were passed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import symdyn as sd

X = np.array([0.3, -0.8, 1.5, 0.4])


def energy(module: Any, params: Any) -> float:
    return float(module.energy(X[:2], X[2:], params).sum())


def test_one_array_of_parameters_for_several_runs(double: Any) -> None:
    p, factors = double.parameters(), (1.0, 2.0, 3.0)
    base, place = p.copy(), double.metadata.parameters.index("g")
    runs, bounds = [], []
    for factor in factors:
        p[place] = factor * base[place]
        runs.append(double.simulate(np.linspace(0, 0.1, 3), X[:2], X[2:], p))
        bounds.append(double.bind(p))
    for factor, run, bound in zip(factors, runs, bounds, strict=True):
        wanted = {"g": factor * base[place]}
        assert run.energy[0] == pytest.approx(energy(double, wanted), rel=1e-14)
        assert run.params[place] == wanted["g"]
        np.testing.assert_array_equal(bound.rhs(0.0, X), double.rhs(0.0, X, wanted))
        np.testing.assert_array_equal(bound.jacobian_x(0.0, X), double.jacobian(0.0, X, wanted, wrt=("x",)).x)


def test_output_times_tolerances_and_starts_may_be_used_again(double: Any) -> None:
    t, x = np.linspace(0.0, 0.1, 5), X.copy()
    run = double.simulate(t, x[:2], x[2:])
    batch = double.simulate_batch(x[:2], x[2:], t=t)
    t *= 100
    x *= 0
    np.testing.assert_array_equal(run.t, np.linspace(0.0, 0.1, 5))
    np.testing.assert_array_equal(batch.t, np.linspace(0.0, 0.1, 5))
    np.testing.assert_array_equal(run.x[0], X)


def test_inputs_may_be_used_again(compiled: Callable[..., Any], backend: str) -> None:
    module = compiled("kitchen_sink", backend)
    t = np.linspace(0, 0.2, 5)
    constant, times, values = np.array([0.3, 0.2]), np.array([0.0, 0.2]), np.array([[0.0, 1.0], [2.0, 3.0]])
    column, single = np.array([0.0, 2.0]), np.array(0.3)
    given: list[Any] = [constant, (times, values), {"F": (times, column), "tau": 0.1}, {"F": single, "tau": 0.0}]
    runs = [module.simulate(t, inputs=each) for each in given]
    before = [run.inputs.copy() for run in runs]
    again = [module.simulate(t, inputs=each) for each in given]
    for array in (constant, times, values, column, single):
        array[...] = -7.0
    for run, inputs in zip(again, before, strict=True):
        np.testing.assert_array_equal(run.inputs, inputs)
        np.testing.assert_allclose(run.outputs["smooth"], runs[again.index(run)].outputs["smooth"], rtol=0, atol=0)


def test_a_function_of_a_loop_variable_gives_the_inputs_of_its_own_run(compiled: Callable[..., Any], backend: str) -> None:
    module = compiled("kitchen_sink", backend)
    runs = []
    for force in (1.0, 2.0, 3.0):
        runs.append(module.simulate(np.linspace(0, 0.1, 3), inputs={"F": lambda t, x: force}))  # noqa: B023
    assert [float(run["F"][1]) for run in runs] == [1.0, 2.0, 3.0]


def test_default_parameters_cannot_be_changed(double: Any) -> None:
    place = double.metadata.parameters.index("g")
    with pytest.raises(ValueError, match="read-only"):
        double.default_parameters[place] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        double.bind().params[place] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        double.simulate((0, 0.01)).params[place] = 1.0
    own = double.parameters()
    own[place] = 1.0
    np.testing.assert_array_equal(double.parameters(), double.metadata.defaults)


def test_parameters_changed_in_place_count_in_every_form(double: Any) -> None:
    names = double.metadata.parameters
    g = np.array(9.81)

    class Dial:
        """A number that may be changed."""

        value = 9.81

        def __float__(self) -> float:
            return self.value

    dial = Dial()
    array = double.parameters().astype(object)
    array[names.index("g")] = dial
    ordered = [g if name == "g" else value for name, value in zip(names, double.parameters(), strict=True)]
    forms: list[Any] = [{"g": g}, ordered, {"g": dial}, array]
    for form in forms:
        double.rhs(0.0, X, form)
        g[...], dial.value = 1.6, 1.6
        np.testing.assert_array_equal(double.rhs(0.0, X, form), double.rhs(0.0, X, {"g": 1.6}))
        np.testing.assert_array_equal(double.energy(X[:2], X[2:], form), double.energy(X[:2], X[2:], {"g": 1.6}))
        g[...], dial.value = 9.81, 9.81
    one = sd.systems.pendulum().compile(backend="numpy")
    only = np.array(one.parameters())
    one.rhs(0.0, [0.1, 0.2], only)
    only *= 2
    np.testing.assert_array_equal(one.rhs(0.0, [0.1, 0.2], only), one.rhs(0.0, [0.1, 0.2], only.copy()))


def test_equilibria_and_linear_equations_keep_their_values(double: Any) -> None:
    p, start, inputs = double.parameters(), np.array([-1.5, 0.1]), np.zeros(0)
    rest = double.equilibrium(start=start, params=p, inputs=inputs)
    x = np.array([-np.pi / 2, 0.0, 0.0, 0.0])
    linear = double.linearize(x, params=p)
    place = double.metadata.parameters.index("g")
    p[place] *= -1.0
    x[:] = 1.0
    assert rest.verdict == linear.verdict == "neutral"
    with pytest.raises(ValueError, match="read-only"):
        rest.params[place] = 0.0


def test_a_state_with_euler_parameters_is_not_normalised_in_the_callers_array() -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=1, inertia=[1, 2, 3])
    system.add_joint(sd.Spherical("ball", parent=system.ground, child=body, orientation=sd.EulerParameters(),
                                  child_point=[0, 0, -0.1]))
    module = system.compile(backend="numpy")
    x = np.array([1.0 + 3e-7, 0, 0, 0, 0, 0, 1.0])
    module.linearize(x)
    assert x[0] == 1.0 + 3e-7


def test_values_of_a_campbell_diagram_are_its_own() -> None:
    y, a = sd.coordinates("y a")
    system = sd.System("rotor")
    nacelle, rotor = (system.add_body(name, mass=2, inertia=[1, 1, 1]) for name in ("nacelle", "rotor"))
    system.add_joint(sd.Prismatic("tower", parent=system.ground, child=nacelle, axis=[0, 1, 0], coordinate=y))
    system.add_joint(sd.Revolute("shaft", parent=nacelle, child=rotor, axis=[0, 0, 1], coordinate=a))
    system.add_force(nacelle, [0, -400 * y, 0])
    speeds = np.array([1.0, 2.0])
    found = system.compile(backend="numpy").campbell(a.dot, speeds)
    speeds *= 10
    np.testing.assert_array_equal(found.values, [1.0, 2.0])
