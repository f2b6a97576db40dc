"""The linear equations against closed forms, against the derivative of x_dot, against SymPy's linearizer; every message."""

from __future__ import annotations

import functools
import importlib.util
import re
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError
from symdyn.functions.table import DERIVATIVES, STATICS
from symdyn.pipeline import emit, write_source
from tests.mechanisms import kitchen_sink


@functools.cache
def chain() -> Any:
    """Two masses between walls on springs and dampers, pushed at the second; its position and its acceleration are outputs."""
    q1, q2 = sd.coordinates("q1 q2")
    m, k, d = sd.parameters("m k d", positive=True)
    F = sd.inputs("F")
    s = sd.System("chain")
    first, second = s.add_body("first", mass=m), s.add_body("second", mass=2 * m)
    a = s.add_joint(sd.Prismatic("a", s.ground, first, q1, axis=[1, 0, 0]))
    b = s.add_joint(sd.Prismatic("b", first, second, q2, axis=[1, 0, 0]))
    s.add_joint_force(a, -k * q1 - d * q1.dot)
    s.add_joint_force(b, -3 * k * q2 - 2 * d * q2.dot)
    s.add_force(second, [F, 0, 0])
    s.add_output("place", q1 + q2)
    s.add_output("pushed", [F, q2.dot])
    s.defaults = {m: 2.0, k: 50.0, d: 0.3}
    return s.embedding().compile(backend="numpy")


@functools.cache
def absolute() -> Any:
    return systems.pendulum_absolute().augmented().compile(backend="numpy")


@functools.cache
def top() -> Any:
    """A free rigid body in Euler parameters, on springs to nothing: it turns freely."""
    s = sd.System("top")
    body = s.add_body("body", mass=1, inertia=[1, 2, 3])
    s.add_joint(sd.Free("free", s.ground, body, sd.coordinates("x y z p0 p1 p2 p3"), orientation=sd.EulerParameters()))
    return s.embedding().compile(backend="numpy")


def test_chain_has_the_matrices_of_the_textbook() -> None:
    lin = chain().linearize(chain().equilibrium())
    assert np.allclose(lin.M, [[6, 4], [4, 4]]) and np.allclose(lin.K, np.diag([50, 150]))
    assert np.allclose(lin.C, np.diag([0.3, 0.6]))
    assert np.allclose(lin.F_in, [[1], [1]]) and not lin.G.any() and lin.coordinates == ("q1", "q2")
    inverse = np.linalg.inv(lin.M)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ lin.K, -inverse @ lin.C]])
    assert np.allclose(lin.A, A, rtol=1e-14) and np.allclose(lin.B, np.vstack([np.zeros((2, 1)), inverse @ lin.F_in]))
    assert lin.outputs == ("place", "pushed[0]", "pushed[1]") and lin.states == ("q1", "q2", "q1_dot", "q2_dot")
    assert np.array_equal(lin.C_out, [[1, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1]]) and np.array_equal(lin.D, [[0], [1], [0]])
    assert lin.state_space.A is lin.A and "chain" in repr(lin)


def test_fixed_coordinates_are_left_out() -> None:
    lin = chain().linearize(fixed={"q1": 0.2})
    assert lin.coordinates == ("q2",) and np.allclose([lin.M, lin.C, lin.K], [[[4]], [[0.6]], [[150]]])
    assert np.allclose(chain().linearize(free=["q2"], at={"q1": 0.2}).A, lin.A)


@pytest.mark.parametrize("seed", range(3))
def test_along_a_motion_it_is_the_derivative_of_the_right_hand_side(seed: int) -> None:
    """With extra states, inputs, a ground that shakes: another derivation, through the factorized mass matrix."""
    module = kitchen()
    stream = np.random.default_rng(seed)
    x, inputs, t = stream.uniform(-0.4, 0.4, module.metadata.sizes.x), stream.uniform(-1, 1, 2), 0.37
    lin = module.linearize(x, t=t, inputs=inputs)
    jacobian = module.jacobian(t, x, inputs=inputs, wrt=("x", "inputs"))
    for found, expected in ((lin.A, jacobian.x), (lin.B, jacobian.inputs)):
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()
    assert np.allclose(lin.ud, module.rhs(t, x, inputs=inputs)[3:6], rtol=1e-12)
    step = 1e-6 * np.eye(len(x))
    slopes = [(module.evaluate("outputs", t, x + h, inputs=inputs) - module.evaluate("outputs", t, x - h, inputs=inputs)) / 2e-6
              for h in step]
    assert np.allclose(lin.C_out, np.array(slopes).T, rtol=1e-6, atol=1e-6) and lin.D.shape == (len(lin.outputs), 2)


@functools.cache
def kitchen() -> Any:
    return kitchen_sink().embedding().compile(backend="numpy")


def test_pendulum_in_absolute_coordinates_is_the_pendulum() -> None:
    """Constraint forces give the stiffness: in x, m g / l; in y there is none, so that it cannot be independent."""
    lin = absolute().linearize(absolute().equilibrium(start={"x": 0.1, "y": -1.1}))
    defaults = dict(zip(absolute().metadata.parameters, absolute().metadata.defaults, strict=True))
    assert lin.coordinates == ("x",) and np.allclose(lin.Z, [[1], [0]], atol=1e-14)
    assert np.isclose(lin.K.item() / lin.M.item(), defaults["g"] / defaults["l"], rtol=1e-13)
    with pytest.raises(ArgumentError, match="pendulum_absolute: the other velocities do not follow from y_dot here"):
        absolute().linearize(absolute().equilibrium(start={"x": 0.1, "y": -1.1}), coordinates=["y"])
    with pytest.raises(ArgumentError, match="there are 1 independent velocities here, but 2 are named: x_dot, y_dot"):
        absolute().linearize(absolute().equilibrium(start={"x": 0.1, "y": -1.1}), coordinates=["x", "y"])


def test_constrained_pendulum_as_sympy_linearizes_it() -> None:
    """Lagrange's equations with a multiplier, x the dependent coordinate, at an inclined equilibrium under a side force."""
    x, y = sd.coordinates("x y")
    eq = sd.augmented(coordinates=[x, y], mass=[2, 2], force=[5 - 0.3 * x.dot, -20 - 0.3 * y.dot], constraints=[x**2 + y**2 - 9],
                      name="inclined")
    module = eq.compile(backend="numpy")
    e = module.equilibrium(start={"x": 1.0, "y": -2.8})
    lin = module.linearize(e, coordinates=["y"])
    p, q = dynamicsymbols("p q")
    N = sp.physics.vector.ReferenceFrame("N")
    origin = sp.physics.vector.Point("O")
    at = origin.locatenew("P", p * N.x + q * N.y)
    at.set_vel(N, p.diff() * N.x + q.diff() * N.y)
    forces = [(at, (5 - sp.Rational(3, 10) * p.diff()) * N.x + (-20 - sp.Rational(3, 10) * q.diff()) * N.y)]
    method = LagrangesMethod(p.diff()**2 + q.diff()**2, [p, q], forcelist=forces, frame=N, hol_coneqs=[p**2 + q**2 - 9])
    method.form_lagranges_equations()
    numbers = {p: e["x"], q: e["y"], p.diff(): 0, q.diff(): 0, p.diff(dynamicsymbols._t, 2): 0, q.diff(dynamicsymbols._t, 2): 0}
    multiplier = 5 / (2 * e["x"])
    A, _, _ = method.linearize(q_ind=[q], qd_ind=[q.diff()], q_dep=[p], qd_dep=[p.diff()], A_and_B=True,
                               op_point={**numbers, method.lam_vec[0]: sp.solve(method.eom[0].subs(numbers),
                                                                                method.lam_vec[0])[0]})
    assert np.isclose(abs(e.lam[0]), multiplier, rtol=1e-12)
    assert np.allclose(lin.A, np.array(A.subs(numbers), dtype=float), rtol=1e-11, atol=1e-12)


def test_four_bar_at_rest_by_the_derivative_of_its_right_hand_side() -> None:
    """The derivative of x_dot, which solves for accelerations and multipliers, seen along the manifold."""
    module = systems.four_bar().augmented().compile(backend="numpy")
    lin = module.linearize(module.equilibrium())
    T = scipy.linalg.block_diag(lin.Z, lin.Z)
    assert np.allclose(module.evaluate("C_r", 0.0, lin.x) @ lin.Z, 0, atol=1e-14)
    k = lin.module.metadata.q.index(lin.coordinates[0])
    A = (module.jacobian(0.0, lin.x, wrt=("x",)).x @ T)[[k, 3 + k]]
    assert np.allclose(lin.A, A, rtol=1e-11, atol=1e-11)


def test_along_a_motion_under_constraints() -> None:
    """Neighbouring consistent motions, by differences."""
    module = systems.four_bar().augmented().compile(backend="numpy")
    q, u = module.consistent(q={"q1": 0.9}, u={"q1_dot": 2.0}, keep=["q1", "q1_dot"])
    lin = module.linearize((q, u), coordinates=["q1"])

    def field(position: float, speed: float) -> np.ndarray:
        near = module.consistent(q={**dict(zip(["q1", "q2", "q3"], q, strict=True)), "q1": position}, u={"q1_dot": speed},
                                 keep=["q1", "q1_dot"])
        return module.rhs(0.0, np.concatenate(near))[[0, 3]]

    h = 1e-4
    A = np.column_stack([(field(q[0] + h, u[0]) - field(q[0] - h, u[0])) / (2 * h),
                         (field(q[0], u[0] + h) - field(q[0], u[0] - h)) / (2 * h)])
    assert np.allclose(lin.A, A, rtol=1e-6, atol=1e-6) and np.abs(A).max() > 5
    assert np.allclose(module.evaluate("C_r", 0.0, lin.x) @ lin.ud, module.evaluate("F_d", 0.0, lin.x), atol=1e-11)
    held = module.linearize((q, u), free=["q1", "q3"])  # with q2 held nothing moves, and its name is listed
    assert held.A.shape == (0, 0) and held.held == ("q2",) and "held: q2" in repr(held)


@pytest.mark.parametrize(("axis", "squared"), [(0, -1 / 3), (1, 1 / 3), (2, -1.0)])
def test_steady_turning_about_principal_axes(axis: int, squared: float) -> None:
    """Euler's equations: lambda^2 = -Omega^2 (C - A)(C - B) / (A B); the attitude itself goes round with +-i Omega."""
    omega = 1.7
    u = np.zeros(6)
    u[3 + axis] = omega
    lin = top().linearize((np.array([0, 0, 0, 0.8, 0.6, 0, 0]), u))
    nutation = np.sqrt(complex(squared)) * omega
    expected = np.array([nutation, -nutation, 1j * omega, -1j * omega, *np.zeros(8)])
    found = np.array(lin.eigenvalues)
    for value in expected[:4]:
        assert np.abs(found - value).min() < 1e-7
    assert np.sum(np.abs(found) < 1e-6) == 8 and lin.G.any()


def test_at_a_time_of_a_solution() -> None:
    solution = chain().simulate((0, 1), q={"q1": 0.1}, u={"q2_dot": 1.0}, params={"k": 70.0}, inputs={"F": 2.0})
    lin = chain().linearize(solution, t=0.5)
    assert np.isclose(lin.K[0, 0], 70) and abs(lin.t - 0.5) < 0.1 and lin.inputs[0] == 2.0 and lin.ud.any()
    with pytest.raises(ArgumentError, match="t = 3 s is not in the solution, from 0 to 1 s"):
        chain().linearize(solution, t=3)
    with pytest.raises(ArgumentError, match="at a solution pass the time t alone"):
        chain().linearize(solution)


def test_equilibrium_brings_its_own() -> None:
    e = chain().equilibrium()
    with pytest.raises(ArgumentError, match="chain: params, free given with an equilibrium, which has its own"):
        chain().linearize(e, params={"k": 1}, free=["q1"])
    with pytest.raises(ArgumentError, match="the equilibrium is of chain, another module"):
        top().linearize(e)


@pytest.mark.parametrize(("at", "message"), [
    ([1.0], "at has the shape (1,), needed are 4 numbers: q1, q2, q1_dot, q2_dot"),
    ({"q9": 1}, "there is no 'q9'"),
    (([0.0], [0.0, 0.0]), "q has the shape (1,)"),
])
def test_bad_states(at: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        chain().linearize(at)


def test_both_backends_and_the_parts_by_themselves(compiled: Any) -> None:
    """The same numbers from C; stiffness and damping are functions of their own."""
    c, numpy = compiled("double_pendulum", "c"), compiled("double_pendulum", "numpy")
    x = np.array([0.3, -0.4, 1.0, 0.5])
    one, other = c.linearize(x), numpy.linearize(x)
    assert np.allclose(one.A, other.A, rtol=1e-13) and np.allclose(one.K, other.K, rtol=1e-13)
    ud = one.ud
    assert np.allclose(numpy.evaluate("stiffness", 0.0, x, ud=ud), one.K, rtol=1e-12)
    assert np.allclose(numpy.evaluate("damping", 0.0, x, ud=ud), one.C, rtol=1e-12)
    name = c.metadata.parameters[1]
    assert np.isclose(c.linearize(c.equilibrium()).derivative(0, name).eigenvalue,
                      numpy.linearize(numpy.equilibrium()).derivative(0, name).eigenvalue, rtol=1e-12)


def test_written_functions_keep_their_reference_vectors(tmp_path: Any) -> None:
    """Vectors of the balance and all its derivatives, against the tape at 30 digits; names of directions are no identifiers."""
    x, theta = sd.coordinates("x theta")
    k = sd.parameters("k", positive=True)
    s = sd.System("written_crab", gravity=[0, -9.81, 0])
    crab, load = s.add_body("crab", mass=2), s.add_body("load", mass=1, com=[0, -0.5, 0])
    slide = s.add_joint(sd.Prismatic("slide", s.ground, crab, x, axis=[1, 0, 0]))
    s.add_joint(sd.Revolute("hinge", crab, load, theta, axis=[0, 0, 1]))
    s.add_joint_force(slide, -k * x**3)
    s.add_constraint(x - sp.sin(theta), "cam")
    s.add_output("place", x**2)
    s.defaults, s.initial = {k: 40.0}, {x: sp.sin(0.4), theta: 0.4}
    equations = s.augmented()
    for number, functions in enumerate(([*STATICS, *DERIVATIVES], ["variation"], ["second_variation"])):
        source = emit(equations, "numpy", functions)
        write_source(source, tmp_path / str(number))
        spec = importlib.util.spec_from_file_location(f"written_{number}", tmp_path / str(number) / "written_crab.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert module.selftest() == 0


def test_numbers_bound_in_the_code_are_no_parameters() -> None:
    module = systems.double_pendulum().embedding().compile(backend="numpy", specialize={"g": 9.81})
    whole = systems.double_pendulum().embedding().compile(backend="numpy")
    found = [m.linearize(m.equilibrium(start={"q1": -1.4})).derivative(1, "m2").eigenvalue for m in (module, whole)]
    assert np.isclose(*found, rtol=1e-12)
    with pytest.raises(ArgumentError, match="parameter: there is no 'g'"):
        module.linearize().derivative(0, "g")
