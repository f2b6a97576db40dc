"""Modes against closed forms and SciPy on matrices made by hand; derivatives of eigenvalues against formulas and differences."""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError
from tests.helpers import swept


def row(n: int, damper: Any = 0) -> sd.System:
    """n equal masses between two walls on equal springs, their places from the wall; dampers to the ground."""
    q = sd.coordinates(f"q1:{n + 1}")
    m, k, d = sd.parameters("m k d", positive=True)
    s = sd.System("row")
    for i, x in enumerate(q):
        mass = s.add_body(f"mass{i}", mass=m)
        joint = s.add_joint(sd.Prismatic(f"slide{i}", s.ground, mass, x, axis=[1, 0, 0]))
        left, right = (q[i - 1] if i else 0), (q[i + 1] if i < n - 1 else 0)
        s.add_joint_force(joint, k * (left - 2 * x + right) - damper * d * x.dot)
    s.defaults = {m: 2.0, k: 300.0} | ({d: 3.0} if damper else {})
    return s


@functools.cache
def chain() -> Any:
    return row(5).embedding().compile(backend="numpy")


@functools.cache
def loaded() -> Any:
    """A pendulum from the horizontal under its weight, a torsion spring and a damper: at rest where k theta = m g l cos theta."""
    theta = sd.coordinates("theta")
    m, l, g, k, d = sd.parameters("m l g k d", positive=True)
    s = sd.System("loaded", gravity=[0, -g, 0])
    bar = s.add_body("bar", mass=m, com=[l, 0, 0])
    hinge = s.add_joint(sd.Revolute("hinge", s.ground, bar, theta, axis=[0, 0, 1]))
    s.add_joint_force(hinge, -k * theta - d * theta.dot)
    s.defaults = {m: 1.5, l: 0.8, g: 9.81, k: 6.0, d: 0.4}
    return s.embedding().compile(backend="numpy")


@functools.cache
def frame() -> Any:
    """A disc on a shaft that is driven at a given speed, in the turning frame: Coriolis forces, external and internal damping."""
    x, y = sd.coordinates("x y")
    m, k, W, d = sd.parameters("m k W d", positive=True)
    s = sd.System("frame")
    disc = s.add_body("disc", mass=m)
    shaft = s.add_body("shaft", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Revolute("turn", s.ground, shaft, W * sd.t, axis=[0, 0, 1]))
    mid = s.add_body("mid", mass=0)
    a = s.add_joint(sd.Prismatic("x", shaft, mid, x, axis=[1, 0, 0]))
    b = s.add_joint(sd.Prismatic("y", mid, disc, y, axis=[0, 1, 0]))
    s.add_joint_force(a, -k * x - d * x.dot)
    s.add_joint_force(b, -2 * k * y - d * y.dot)
    s.defaults = {m: 2.0, k: 100.0, W: 4.0, d: 0.9}
    return s.embedding().compile(backend="numpy")


def test_row_of_masses() -> None:
    """omega_j = 2 sqrt(k / m) sin(j pi / (2 n + 2)), shapes sin(i j pi / (n + 1)); orthogonal, undamped to the last bit."""
    modes = chain().linearize(chain().equilibrium()).modes()
    j = np.arange(1, 6)
    omega = 2 * np.sqrt(150) * np.sin(j * np.pi / 12)
    assert np.allclose([m.omega for m in modes], omega, rtol=1e-13) and len(modes) == 5
    assert np.allclose(modes.frequencies, omega / (2 * np.pi)) and np.allclose([m.period for m in modes], 2 * np.pi / omega)
    assert all(m.damping == 0.0 and m.kind == "oscillation" and m.eigenvalue.real == 0.0 for m in modes)
    for k, mode in enumerate(modes, 1):
        shape = np.sin(j * k * np.pi / 6)
        assert np.allclose(mode.shape / mode.shape[1 if abs(shape[1]) > 0.1 else 0],
                           shape / shape[1 if abs(shape[1]) > 0.1 else 0], atol=1e-12)
        assert np.isclose(mode.shares.sum(), 1) and np.isclose(np.abs(mode.shape).max(), 1)
    assert modes[0].name == "q3, q2, q4 (1)" and modes["q3, q2, q4 (1)"] is modes[0] and modes["q1, q3, q5"] is modes[2]
    assert "f [Hz]" in repr(modes) and len(repr(modes).splitlines()) == 9
    assert "neutral" in repr(modes) and "q3, q2, q4" in repr(modes[0])


def test_double_pendulum_of_points() -> None:
    """omega^2 = (2 -+ sqrt 2) g / l; inverted the same numbers are rates of growth and decay."""
    module = systems.double_pendulum().embedding().compile(backend="numpy")
    points = {"m1": 1.0, "m2": 1.0, "l1": 1.0, "lc1": 1.0, "lc2": 1.0, "I1": 0.0, "I2": 0.0, "g": 9.81}
    down = module.linearize(module.equilibrium(start={"q1": -1.5}, params=points)).modes()
    assert np.allclose([m.omega**2 for m in down], 9.81 * (2 + np.array([-1, 1]) * np.sqrt(2)), rtol=1e-12)
    up = module.linearize(module.equilibrium(start={"q1": 1.5}, params=points)).modes()
    assert [m.kind for m in up] == ["unstable", "real"] * 2 and np.isclose(up[0].eigenvalue.real, down[0].omega, rtol=1e-12)
    assert up[0].period == np.inf and up[0].damping == -1


def test_damping_ratio_and_what_creeps() -> None:
    """One mass, d / (2 sqrt(k m)); above 1 two real eigenvalues."""
    module = row(1, damper=1).embedding().compile(backend="numpy")
    light, = module.linearize().modes()
    assert np.isclose(light.damping, 3 / (2 * np.sqrt(600 * 2)), rtol=1e-13) and np.isclose(light.omega, np.sqrt(300), rtol=1e-13)
    assert np.isclose(light.damped_frequency, np.sqrt(300 * (1 - light.damping**2)) / (2 * np.pi), rtol=1e-13)
    heavy = module.linearize(params={"d": 100.0}).modes()
    assert [m.kind for m in heavy] == ["real", "real"] and np.allclose(sorted(m.eigenvalue.real for m in heavy),
                                                                         np.sort(np.roots([2, 100, 600])))


def test_gyroscopic_and_damped_against_scipy() -> None:
    """Matrices by hand: m (x_ddot - 2 W y_dot - W^2 x) + d x_dot + k x = 0 and likewise for y."""
    lin = frame().linearize(frame().equilibrium())
    M, G = 2 * np.eye(2), 2 * 2 * 4.0 * np.array([[0, -1], [1, 0]])
    C, K = G + 0.9 * np.eye(2), np.diag([100.0, 200.0]) - 2 * 16 * np.eye(2)
    assert np.allclose(lin.M, M) and np.allclose(lin.C, C) and np.allclose(lin.K, K)
    values = scipy.linalg.eig(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]), scipy.linalg.block_diag(np.eye(2), M))[0]
    assert np.allclose(np.sort_complex(lin.eigenvalues), np.sort_complex(values), rtol=1e-12)
    assert all(0 < m.damping < 0.1 and m.kind == "oscillation" for m in lin.modes())
    for mode in lin.modes():
        residual = (mode.eigenvalue**2 * M + mode.eigenvalue * C + K) @ mode.shape
        assert np.abs(residual).max() < 1e-11 * 200


def test_zero_mode_is_reported_once() -> None:
    """Two masses on one spring with nothing to hold them."""
    q1, q2 = sd.coordinates("q1 q2")
    s = sd.System("adrift")
    a, b = s.add_body("a", mass=1), s.add_body("b", mass=1)
    s.add_joint(sd.Prismatic("first", s.ground, a, q1, axis=[1, 0, 0]))
    spring = s.add_joint(sd.Prismatic("second", a, b, q2, axis=[1, 0, 0]))
    s.add_joint_force(spring, -8 * q2)
    zero, moving = s.embedding().compile(backend="numpy").linearize().modes()
    assert zero.kind == "zero" and zero.eigenvalue == 0 and zero.damping == 0.0 and np.allclose(np.abs(zero.shape), [1, 0])
    assert np.isclose(moving.omega, 4, rtol=1e-14)


def test_names_compare_metres_and_radians_by_energy() -> None:
    """A heavy slider with a light pendulum: whatever the amplitudes in rad, the slider's mode is named by the slider."""
    x, theta = sd.coordinates("x theta")
    s = sd.System("crab", gravity=[0, -9.81, 0])
    crab, load = s.add_body("crab", mass=1000), s.add_body("load", mass=1, com=[0, -0.01, 0])
    slide = s.add_joint(sd.Prismatic("slide", s.ground, crab, x, axis=[1, 0, 0]))
    s.add_joint(sd.Revolute("hinge", crab, load, theta, axis=[0, 0, 1]))
    s.add_joint_force(slide, -4000 * x)
    assert [m.name for m in s.embedding().compile(backend="numpy").linearize().modes()] == ["x", "theta"]


def test_extra_states_have_modes_of_their_own() -> None:
    q, z = sd.coordinates("q z")
    s = sd.System("filtered")
    body = s.add_body("body", mass=1)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[1, 0, 0]))
    s.add_joint_force(slide, -100 * q)
    s.add_state(z, -3 * z)
    lin = s.embedding().compile(backend="numpy").linearize()
    assert lin.states == ("q", "q_dot", "z") and [(m.name, m.kind) for m in lin.modes()] == [("z", "real"), ("q", "oscillation")]
    assert np.isclose(lin.modes()["z"].eigenvalue, -3)


# -- derivatives


def test_derivatives_with_the_shift_of_the_equilibrium() -> None:
    """k theta = m g l cos theta and omega^2 = (k - m g l sin theta) / (m l^2), differentiated by hand (by SymPy)."""
    e = loaded().equilibrium()
    lin = loaded().linearize(e)
    m, l, g, k, d, theta = sp.symbols("m l g k d theta")
    balance = k * theta + m * g * l * sp.cos(theta)
    stiffness, inertia = k - m * g * l * sp.sin(theta), m * l**2
    value = (-d + sp.sqrt(d**2 - 4 * stiffness * inertia)) / (2 * inertia)
    numbers = {m: 1.5, l: 0.8, g: 9.81, k: 6.0, d: 0.4, theta: e["theta"]}
    assert abs(complex(value.subs(numbers)) - lin.modes()[0].eigenvalue) < 1e-12
    for p in (m, l, g, k, d):
        exact = complex((value.diff(p) - value.diff(theta) * balance.diff(p) / balance.diff(theta)).subs(numbers))
        found = lin.derivative(0, p.name)
        size, eigenvalue = lin.modes()[0].omega, lin.modes()[0].eigenvalue
        assert abs(found.eigenvalue - exact) <= 1e-12 * max(abs(exact), 1)
        assert np.isclose(found.frequency, (eigenvalue.conjugate() * exact).real / size / (2 * np.pi), rtol=1e-11, atol=1e-13)
        assert np.isclose(found.damped_frequency, exact.imag / (2 * np.pi), rtol=1e-11, atol=1e-13)
    fixed_state = loaded().linearize(e.x)
    assert abs(fixed_state.derivative(0, "g").eigenvalue - complex(value.diff(g).subs(numbers))) < 1e-12


def richardson(function: Any, at: float, h: float) -> Any:
    """A derivative by differences of fourth order."""
    return (8 * (function(at + h) - function(at - h)) - function(at + 2 * h) + function(at - 2 * h)) / (12 * h)


@pytest.mark.parametrize("name", ["four_bar", *swept(["spatial_slider_crank"])])
def test_derivatives_under_constraints(name: str) -> None:
    """Lengths move the equilibrium, the null space and the multipliers."""
    module = getattr(systems, name)().augmented().compile(backend="numpy")
    e = module.equilibrium()
    lin = module.linearize(e)
    defaults = dict(zip(module.metadata.parameters, module.metadata.defaults, strict=True))
    checked = 0
    for parameter in list(defaults)[:5]:
        def eigenvalue(value: float, parameter: str = parameter) -> complex:
            near = module.equilibrium(params={**defaults, parameter: value}, start=e)
            return module.linearize(near).modes()[0].eigenvalue

        expected = richardson(eigenvalue, defaults[parameter], 1e-3 * (abs(defaults[parameter]) or 1))
        found = lin.derivative(0, parameter).eigenvalue
        assert abs(found - expected) <= 2e-8 * max(abs(expected), abs(lin.modes()[0].eigenvalue / (defaults[parameter] or 1)))
        checked += abs(expected) > 1e-3
    assert checked >= 3


def test_derivatives_of_damped_gyroscopic_modes_with_a_parameter_that_is_solved_for() -> None:
    """The lever's ballast follows, and moves the frequency with it; damping by differences of the ratio."""
    lin = frame().linearize(frame().equilibrium())
    for parameter, at in (("W", 4.0), ("d", 0.9), ("k", 100.0), ("m", 2.0)):
        for index in (0, 1):
            def mode(value: float, parameter: str = parameter, index: int = index) -> np.ndarray:
                m = frame().linearize(frame().equilibrium(params={parameter: value})).modes()[index]
                return np.array([m.eigenvalue, m.frequency, m.damped_frequency, m.damping])

            found = lin.derivative(index, parameter)
            expected = richardson(mode, at, 1e-3 * at)
            assert np.allclose([found.eigenvalue, found.frequency, found.damped_frequency, found.damping], expected,
                               rtol=1e-8, atol=1e-9)
    counterweight = loaded().equilibrium(free=["m"], fixed={"theta": -0.7})
    lin = loaded().linearize(counterweight, hold=["theta"])  # its condition is fulfilled without a force, and it is free else
    assert lin.eigenvalues.shape == (0,) and loaded().linearize(counterweight).eigenvalues.shape == (2,)
    with pytest.raises(ArgumentError, match="mode 0 requested; there are 0"):
        lin.derivative(0, "k")


def test_extra_states_take_part_in_derivatives() -> None:
    q, z = sd.coordinates("q z")
    T, k, m, g = sd.parameters("T k m g", positive=True)
    s = sd.System("lagging", gravity=[0, -g])
    body = s.add_body("body", mass=m)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[0, 1]))
    s.add_joint_force(slide, -k * z - k * z**3 - 8 * q.dot)
    s.add_state(z, (sp.sin(q) - z) / T)
    s.defaults = {T: 0.1, k: 50.0, m: 1.2, g: 9.81}
    module = s.embedding().compile(backend="numpy")
    e = module.equilibrium()
    for parameter, at in (("T", 0.1), ("k", 50.0), ("m", 1.2), ("g", 9.81)):
        def values(value: float, parameter: str = parameter) -> np.ndarray:
            return module.linearize(module.equilibrium(params={parameter: value}, start=e)).modes().eigenvalues

        expected = richardson(values, at, 1e-3 * at)
        lin = module.linearize(e)
        found = [lin.derivative(k, parameter).eigenvalue for k in range(len(lin.modes()))]
        assert np.allclose(found, expected, rtol=1e-8, atol=1e-8)


def test_double_eigenvalues_have_no_derivative() -> None:
    x, y = sd.coordinates("x y")
    k = sd.parameters("k", positive=True)
    s = sd.System("round")
    a, b = s.add_body("a", mass=1), s.add_body("b", mass=1)
    for body, q in ((a, x), (b, y)):
        joint = s.add_joint(sd.Prismatic(f"of_{q}", s.ground, body, q, axis=[1, 0, 0]))
        s.add_joint_force(joint, -k * q)
    s.defaults = {k: 9.0}
    with pytest.raises(ArgumentError, match=r"round: mode . has a double eigenvalue, 0\+3j 1/s, to rounding"):
        s.embedding().compile(backend="numpy").linearize().derivative(0, "k")


@pytest.mark.parametrize(("mode", "parameter", "message"), [
    (9, "k", "mode 9 requested; there are 5, numbered from 0"),
    ("q9", "k", "0 modes are named 'q9'; there are 0: q3, q2, q4 (1); 1: "),
    (0, "w", "parameter: there is no 'w'; there are m, k"),
    (0, None, "parameter must be one name or symbol, found None"),
    (None, ["m", "k"], "parameter must be one name or symbol, found ['m', 'k']"),
    (None, "k", "0 modes are named 'None'"),
])
def test_bad_arguments(mode: Any, parameter: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        chain().linearize().derivative(mode, parameter)


def test_no_derivatives_along_a_motion() -> None:
    with pytest.raises(ArgumentError, match="loaded: derivatives of eigenvalues hold at a state of rest or of steady motion"):
        loaded().linearize({"theta": 0.5}).derivative(0, "k")
