"""The compiled implicit method: closed forms over 12 decades of stiffness, order, output between steps, faults."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.solutions.tables import facts
from tests.runtime.constrained import module as constrained


@pytest.fixture(scope="module")
def mass() -> Any:
    """A mass that a spring k and a damper c hold to the point sin t, pushed by F + b q^3; next to it z' = 1 - sqrt z, resting.

    With b = F = 0 the distance q - sin t is that of a free oscillator: k and c do not show in q = sin t.
    """
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    q, z = sd.coordinates("q"), sd.coordinates("z")
    k, c, b = sd.parameters("k c b")
    F = sd.inputs("F")
    system = sd.System("held_mass", planar=True)
    body = system.add_body("body", mass=1)
    slider = system.add_joint(sd.Prismatic("slider", system.ground, body, q, axis=[1, 0]))
    system.add_joint_force(slider, -k * (q - sp.sin(sd.t)) - c * (q.dot - sp.cos(sd.t)) - sp.sin(sd.t) + F + b * q**3)
    system.add_state(z, 1 - sp.sqrt(z))
    system.defaults = {k: 0, c: 0, b: 0}
    system.initial = {q.dot: 1, z: 1, F: 0}
    return system.embedding().compile(backend="c")


def radau(module: Any, *args: Any, method: str = "radau", **options: Any) -> Any:
    solution = module.simulate(*args, method=method, **options)
    assert solution.success and solution.method == method
    return solution


# -- closed forms


@pytest.mark.parametrize("exponent", range(0, 13, 2))
def test_on_the_slow_motion_stiffness_is_not_felt(exponent: int, mass: Any) -> None:
    """q = sin t whatever k is: no more steps, no larger errors."""
    found = radau(mass, (0, 10), params={"k": 10.0**exponent, "c": 2 * 10.0**(exponent / 2)}, rtol=1e-8)
    assert found.n_steps + found.n_rejected < 55
    assert np.abs(found["q"] - np.sin(found.t)).max() < 5e-8 and np.abs(found.u[:, 0] - np.cos(found.t)).max() < 3e-6


@pytest.mark.parametrize("exponent", range(0, 13, 2))
def test_transients_are_followed_and_left(exponent: int, mass: Any) -> None:
    """Critically damped from a distance of 0.1, at the point's speed: 0.1 (1 + w t) exp(-w t) with w = sqrt k."""
    w = 10.0**(exponent / 2)
    found = radau(mass, (0, 10), {"q": 0.1}, params={"k": w**2, "c": 2 * w}, rtol=1e-8, atol=1e-8)
    distance = 0.1 * (1 + w * found.t) * np.exp(-w * found.t)
    assert np.abs(found["q"] - np.sin(found.t) - distance).max() < 1e-7
    assert found.n_steps + found.n_rejected < 130


def test_three_stages_pay_at_loose_tolerances_only(mass: Any) -> None:
    """Nonlinear and stiff, at two tolerances: evaluations, and errors against a tight run."""
    start = {"q": {"q": 1.0}, "params": {"k": 1e5, "c": 2e3, "b": -1e4}}
    exact = radau(mass, (0, 1), **start, rtol=1e-13)
    for rtol, bounds in ((1e-2, (0.0, 0.8)), (1e-8, (2.0, 4.0))):
        five, three = (radau(mass, (0, 1), **start, rtol=rtol, method=method) for method in ("radau", "radau5"))
        assert bounds[0] < three.nfev / five.nfev < bounds[1]
        assert np.abs(three.x[-1] - exact.x[-1]).max() < rtol


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_fast_vibration_of_small_amplitude_is_left_out(damping: float, mass: Any) -> None:
    """Within the tolerance: an explicit method would take w / 2 steps a second."""
    w = 1e5
    found = radau(mass, (0, 1), {"q": 1e-9}, params={"k": w**2, "c": 2 * damping * w}, rtol=1e-4, atol=[1e-4, 1e-2, 1])
    assert found.n_steps < 20 and np.abs(found["q"] - np.sin(found.t)).max() < 1e-6


@pytest.mark.parametrize(("method", "at_ends", "between", "steps"), [("radau", 9, 6, (1.0, 0.5, 0.25)),
                                                                         ("radau5", 5, 4, (0.25, 0.125, 0.0625))])
def test_order_at_the_ends_of_steps_and_between(method: str, at_ends: int, between: int, steps: tuple[float, ...],
                                                mass: Any) -> None:
    """Equal steps on a linear oscillator, which Newton's iteration solves at once."""
    ends, middle = [], []
    for h in steps:
        found = radau(mass, np.linspace(0, 4, 32 * round(1 / h) + 1), {"q": 0.2}, params={"k": 4}, rtol=0.1, atol=1e3,
                      first_step=h, max_step=h, method=method)
        assert found.n_steps == 4 / h and found.nfev < 16 * found.n_steps + 16
        error = np.abs(found["q"] - np.sin(found.t) - 0.2 * np.cos(2 * found.t))
        ends.append(error[-1])
        middle.append(error.max())
    for errors, order in ((ends, at_ends), (middle, between)):
        assert order - 0.3 < np.log2(errors[0] / errors[-1]) / 2 < order + 1.2


@pytest.fixture(scope="module")
def slow() -> Any:
    """z' = -lam (z - cos t), lam = 1e5, from its slow motion: steps that end on it may be as long as they like."""
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    q, z = sd.coordinates("q"), sd.coordinates("z")
    system = sd.System("slow_motion", planar=True)
    system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("body", mass=1), q, axis=[1, 0]))
    system.add_state(z, -100000 * (z - sp.cos(sd.t)))
    return system.embedding().compile(backend="c")


def slow_exact(t: np.ndarray) -> np.ndarray:
    return (1e10 * np.cos(t) + 1e5 * np.sin(t) + np.exp(-1e5 * t)) / (1e10 + 1)


@pytest.mark.parametrize(("method", "most_steps"), [("radau", (10, 20, 50, 120)), ("radau5", (15, 60, 270, 1300)),
                                                    ("Radau", (15, 60, 270))])
def test_tolerance_holds_between_long_stiff_steps(method: str, most_steps: tuple[int, ...], slow: Any) -> None:
    """The collocation polynomial is off by up to a million tolerances there, while the ends of steps are exact."""
    times = np.sort(np.random.default_rng(1).uniform(0, 10, 1000))
    for rtol, most in zip((1e-3, 1e-6, 1e-9, 1e-12), most_steps, strict=False):
        found = radau(slow, np.array([0, *times, 10]), z=[1], rtol=rtol, method=method)
        assert np.abs(found["z"] - slow_exact(found.t)).max() < 5 * rtol
        assert found.n_steps <= most


def test_infinite_slopes(mass: Any) -> None:
    """z' = 1 - sqrt z from 0, where the Jacobian is infinite: t = -2 (sqrt z + log(1 - sqrt z))."""
    found = radau(mass, (0, 3), z=[0], rtol=1e-9)
    root = np.sqrt(found["z"])
    np.testing.assert_allclose(-2 * (root + np.log1p(-root)), found.t, rtol=0, atol=1e-7)


# -- against other methods


def test_against_other_methods(mass: Any) -> None:
    """Nonlinear and stiff: SciPy's Radau, and the explicit method, which takes many more evaluations."""
    start = {"q": {"q": 1.0}, "params": {"k": 1e5, "c": 2e3, "b": -1e4}}
    times = np.linspace(0, 1, 20)
    tight, scipy = mass.simulate(times, **start, rtol=1e-12), mass.simulate(times, **start, rtol=1e-8, method="Radau")
    found = radau(mass, times, **start, rtol=1e-8)
    np.testing.assert_allclose(found.x, tight.x, rtol=0, atol=5e-7)
    np.testing.assert_allclose(scipy.x, tight.x, rtol=0, atol=2e-7)
    assert found.nfev < 0.5 * scipy.nfev and found.n_steps < 0.2 * mass.simulate(times, **start, rtol=1e-8).n_steps
    assert 0 < found.njev < found.n_steps and found.nlu >= 3 * found.n_steps and scipy.njev > 0 and scipy.nlu > 0
    assert ("Jacobians", f"{found.njev}, and {found.nlu} factorizations") in facts(found)


def test_smooth_motion_at_all_tolerances(compiled: Callable[..., Any]) -> None:
    """Without stiffness, at steps and between them, forward and back."""
    double = compiled("double_pendulum", "c")
    times = np.linspace(0, 2, 401)
    exact = double.simulate(times, rtol=1e-14).x
    errors = []
    for rtol in (1e-5, 1e-7, 1e-9, 1e-11):
        found = radau(double, times, rtol=rtol)
        errors.append(np.abs(found.x - exact).max())
        assert errors[-1] < 30 * rtol
    assert errors[0] / errors[-1] > 1e5
    back = radau(double, times[::-1], q=found.q[-1], u=found.u[-1], rtol=1e-11)
    np.testing.assert_allclose(back.x[::-1], exact, rtol=0, atol=1e-8)
    at_steps = radau(double, (0, 2), rtol=1e-11, steps=True)
    assert len(at_steps.t) == at_steps.n_steps + 1 == found.n_steps + 1
    np.testing.assert_allclose(at_steps.x[-1], exact[-1], rtol=0, atol=1e-8)
    assert radau(double, (0, 1), rtol=1e-3, first_step=0.025, max_step=0.025).n_steps == 40
    assert radau(double, (0, 1), q=[0, 0], u=[0, 0], rtol=1e-9, atol=0).n_steps > 0


@pytest.mark.parametrize(("c", "end", "rtol", "stiff"), [
    (1e3, 10, 1e-4, True), (1e3, 10, 1e-8, True), (1e2, 10, 1e-4, True), (10, 1, 1e-4, False), (10, 1, 1e-8, False),
    (0, 1, 1e-8, False)])
def test_auto_sees_through_a_vibration_that_dies_out(c: float, end: float, rtol: float, stiff: bool, mass: Any) -> None:
    """1e4 rad/s from 1.2 m, which takes 0.02 to 0.2 s or more than there is: then q = sin t, and explicit steps stay short."""
    found = mass.simulate(np.array([0.0, end]), {"q": 1.2}, params={"k": 1e8, "c": c}, rtol=rtol, method="auto")
    assert found.success and (found.method == "radau") == stiff
    if stiff:
        assert "the motion is stiff: after t = " in found.why
        assert "(a vibration with eigenvalues up to 1e+04 1/s dies out within 0." in found.why
        assert "; then stability limits explicit steps to 0.0005 s)" in found.why
        assert found.n_steps < 5000 and found["q"][-1] == pytest.approx(np.sin(end), abs=100 * rtol)


# -- inputs, work, constraints


def test_inputs(mass: Any) -> None:
    """A table with a jump in its slope, and a function of time and state that the Jacobian does not know of."""
    stiff = {"k": 1e6, "c": 2e3}
    table = (np.array([0, 1, 1.5, 3]), np.array([[0.0], [0.0], [500.0], [500.0]]))
    found = radau(mass, (0, 3), params=stiff, inputs=table, rtol=1e-8)
    late = found.t > 1.6
    np.testing.assert_allclose(found["q"][late], np.sin(found.t[late]) + 5e-4, rtol=0, atol=1e-8)
    held = radau(mass, (0, 3), {"q": 0.1}, params={"k": 3}, inputs=lambda t, x: [-6 * (x[0] - np.sin(t))], rtol=1e-9)
    np.testing.assert_allclose(held["q"], np.sin(held.t) + 0.1 * np.cos(3 * held.t), rtol=0, atol=1e-7)


@pytest.mark.parametrize(("given", "most"), [({"k": 1}, 2), ({"k": 25, "c": 1}, 2), ({"k": 1e6, "c": 2e3}, 10)])
def test_kinks_of_tables_are_seen_as_by_the_explicit_method(given: dict[str, float], most: float, mass: Any) -> None:
    """F is linear between random rows: errors against steps that end at each of them. In stiff motion what is left of a kink for
    some milliseconds is less exact."""
    errors: dict[str, list[float]] = {"dop853": [], "radau": []}
    for seed in range(2, 4):
        rng = np.random.default_rng(seed)
        rows = np.sort(np.append(rng.uniform(0, 10, 13), [0, 10])), rng.normal(size=(15, 1))
        times = np.union1d(rows[0], rows[0][:-1] + 0.7 * np.diff(rows[0]))
        x = [np.array([0.0, 1.0, 1.0])]
        for pair in itertools.pairwise(times):
            x.append(mass.simulate(np.array(pair), x[-1][:1], x[-1][1:2], given, z=[1], inputs=rows, rtol=1e-13).x[-1])
        for method, rtol in itertools.product(errors, (1e-4, 1e-6, 1e-8)):
            found = mass.simulate(times, params=given, inputs=rows, rtol=rtol, method=method)
            errors[method].append(np.abs(found.x - x).max() / rtol)
    assert max(errors["radau"]) < most * max(errors["dop853"])


def test_work(mass: Any) -> None:
    """One state more, which nothing depends on: the change of kinetic energy."""
    found = radau(mass, (0, 3), {"q": 0.3}, params={"k": 1e4, "c": 2e2}, rtol=1e-9, work=True)
    np.testing.assert_allclose(found.work, (found.u[:, 0]**2 - 1) / 2, rtol=0, atol=1e-6)


@pytest.mark.parametrize("stabilization", ["projection", ("baumgarte", 5.0), ("baumgarte", 1e3)])
def test_constraints(stabilization: Any) -> None:
    bar = constrained("four_bar")
    times = np.linspace(0, 1, 30)
    wanted = bar.simulate(times, rtol=1e-11)
    found = radau(bar, times, rtol=1e-9, stabilization=stabilization)
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=2e-6)
    assert np.abs(found.constraint_violation).max() < (1e-12 if stabilization == "projection" else 1e-7)


def test_euler_parameters_stay_of_length_1() -> None:
    """A free body about its intermediate axis, whose Jacobian holds along changes that keep the length."""
    times = np.linspace(0, 5, 40)
    start = {"q": {"p0": 1.0}, "u": [0, 0, 0, 0.01, 2.0, 0.01]}
    found, wanted = (constrained("top").simulate(times, **start, rtol=rtol, method=method)
                     for rtol, method in ((1e-9, "radau"), (1e-12, "dop853")))
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.q[:, 3:], axis=1), 1, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("name", "field"), [("four_bar", RightSide(baumgarte=True, method="radau")),
                                             ("held_mass", RightSide(work=True, method="radau"))])
def test_jacobian_of_what_is_integrated(name: str, field: RightSide, mass: Any) -> None:
    """Against differences of the same right-hand side, off the constraints; it is square, with the work, too."""
    module = mass if name == "held_mass" else constrained(name)
    p = np.append(module.parameters({"b": 2.0} if name == "held_mass" else None), [30.0] * field.baumgarte)
    evaluators = [module.library(field).evaluator(f) for f in ("rhs", "jacobian_x")]
    for evaluator in evaluators:
        evaluator.set_params(p)
    n = module.library(field).metadata.sizes.x
    x = np.random.default_rng(3).uniform(0.5, 1.0, n)
    inputs = np.array([0.7] * module.metadata.sizes.inputs)
    columns = []
    for k in range(n):
        h = np.zeros(n)
        h[k] = 1e-5
        columns.append((evaluators[0].one(0.3, x + h, inputs).copy() - evaluators[0].one(0.3, x - h, inputs)) / 2e-5)
    exact = evaluators[1].one(0.3, x, inputs)
    assert exact.shape == (n, n)
    np.testing.assert_allclose(exact, np.array(columns).T, rtol=0, atol=1e-7 * np.abs(exact).max())


# -- what stops it


def test_faults_are_reported_as_by_the_other_methods(mass: Any) -> None:
    with pytest.warns(SimulationWarning, match=r"stopped at t = 0\.5.*F is nan at t = 0\.5"):
        done = mass.simulate((0, 1), inputs=lambda t, x: [np.nan if t > 0.5 else 0.0], method="radau")
    assert not done.success and 0.49 < done.t[-1] <= 0.5
    with pytest.warns(SimulationWarning, match=r"stopped at t = 1\.0.*(step became too small|is not finite)"):
        mass.simulate((0, 2), {"q": 2**0.5}, {"q_dot": 2**0.5}, {"b": 1.0}, method="radau")
    with pytest.warns(SimulationWarning, match="3 steps were done, as asked"):
        assert mass.simulate((0, 2), {"q": 0.5}, params={"k": 9}, max_steps=3, method="radau").n_steps == 3
    with pytest.raises(ArgumentError, match=r"compiled integrator 'radau' needs the C backend.*Use method='Radau' of SciPy"):
        constrained("top", "numpy").simulate(method="radau")


# -- many states


def chain(n: int) -> sd.System:
    """Masses on springs and dampers in a row, each in a coordinate of its own: a banded Jacobian."""
    q = sd.coordinates(f"q1:{n + 1}")
    k, c = sd.parameters("k c")
    system = sd.System("chain", planar=True)
    for i in range(n):
        body = system.add_body(f"body{i}", mass=1)
        slider = system.add_joint(sd.Prismatic(f"slider{i}", system.ground, body, q[i], axis=[1, 0]))
        force: Any = -k * q[i]**3
        for other in q[max(0, i - 1):i + 2]:
            force += k * (other - q[i]) + c * (other.dot - q[i].dot)
        system.add_joint_force(slider, force)
    system.defaults = {k: 1e4, c: 40}
    return system


def test_jacobians_of_many_zeros() -> None:
    """They are set to zero at once in C, and are the same as in Python; 30 states are integrated with them."""
    equations = chain(15).embedding()
    text = next(iter(emit(equations, "c", ["jacobian_x"], standalone=False).files.values()))
    assert "for (int i = 0; i < 900; i++) out[i] = 0.0;" in text and text.count("\n    out[") < 150
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    c, numpy = (equations.compile(backend=backend) for backend in ("c", "numpy"))
    x = np.random.default_rng(5).normal(size=(3, 30))
    np.testing.assert_allclose(*(m.evaluate("jacobian_x", 0.0, x) for m in (c, numpy)), rtol=1e-13)
    bent = {"q": np.sin(np.arange(15) / 4)}
    found, explicit = radau(c, (0, 2), **bent, rtol=1e-8), c.simulate((0, 2), **bent, rtol=1e-10)
    np.testing.assert_allclose(found.x, explicit.x, rtol=0, atol=1e-5)
