"""Derivatives behind optimal motions: expressions and rates against 60 digits, programs against differences; quadratures."""

from __future__ import annotations

import functools
from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.sparse
import sympy as sp

import symdyn as sd
from symdyn.optimal.discretized import Discretized, Motion
from symdyn.optimal.expressions import Expressions
from symdyn.optimal.field import Arguments, Dynamics, Field
from symdyn.optimal.loops import Loops
from symdyn.optimal.problem import problem_of
from symdyn.optimal.program import Program
from symdyn.optimal.transcription import hermite_simpson, radau, radau_points, shooting
from symdyn.tape.evaluate import evaluate

DIGITS, STEP = 60, mpmath.mpf(10) ** -15


def _differences(f: Any, at: list[Any], n: int) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivatives of a number by central differences in 60 digits, exact to some 25."""
    unit = lambda k: [STEP if j == k else mpmath.mpf(0) for j in range(n)]
    shifted = lambda *steps: f([a + sum(s) for a, *s in zip(at, *steps)])
    minus = lambda step: [-s for s in step]
    with mpmath.workdps(DIGITS):
        first = [(shifted(unit(k)) - shifted(minus(unit(k)))) / (2 * STEP) for k in range(n)]
        second = [[(shifted(unit(j), unit(k)) - shifted(unit(j), minus(unit(k))) - shifted(minus(unit(j)), unit(k))
                    + shifted(minus(unit(j)), minus(unit(k)))) / (4 * STEP**2) for k in range(n)] for j in range(n)]
    return np.array(first, dtype=float), np.array(second, dtype=float)


def test_expressions_against_60_digits() -> None:
    a, b, c, k = sp.symbols("a b c k")
    given = [sp.sin(a * b) + k * sp.exp(c) / a, sp.sqrt(a**2 + b**2) * c**3, c + 2 * b]
    made = Expressions(given, ["a", "b", "c"], {"k": 0.3})
    at, weights = np.array([[0.7, -1.2, 0.4], [1.1, 0.3, -2.0]]), np.array([[0.3, -1.0, 2.0], [1.5, 0.2, -0.4]])
    J, H = made.jacobian(at), made.hessian(at, weights)
    for row in range(2):
        total = np.zeros((3, 3))
        for i, e in enumerate(given):
            f = sp.lambdify((a, b, c), e.subs(k, sp.Float(0.3, DIGITS)), "mpmath")
            first, second = _differences(lambda y, f=f: f(*y), [mpmath.mpf(v) for v in at[row]], 3)
            assert np.abs(J[row, i] - first).max() < 1e-14 * np.abs(first).max()
            total += weights[row, i] * second
        assert np.abs(H[row] - total).max() < 1e-14 * np.abs(total).max()
    assert not made.slopes[2, 0] and made.slopes[2, 1] and made.curvature.all()


def test_rates_and_cost_times_the_duration_against_60_digits() -> None:
    system = sd.systems.cart_pole()
    equations = system.embedding()
    module, tape = equations.compile(backend="c"), equations.tape("rhs")
    parameters = list(module.metadata.parameters)
    free = [parameters.index("m_p"), parameters.index("l")]
    of = Arguments(4, 1, tuple(free))
    F, q2, t, length = sp.symbols("F q2 t l")
    names = [*module.metadata.x, "F", "m_p", "l", "t"]
    integrand = Expressions([F**2 * sp.cos(q2) + length * t**2], names, {})
    p = module.parameters()
    shares = np.array([0.25, 0.8])
    field = Field(Dynamics(module, of, p), integrand, 0.5, shares)
    y = np.array([[0.1, 2.0, -0.4, 1.3, 3.0, 0.25, 0.6, 1.7]] * 2) + np.array([[0.0], [0.1]]) * [1, 1, 1, 1, 1, 0, 0, 0]
    weights = np.random.default_rng(0).normal(size=(2, 5))
    J, H = field.jacobian(y), field.hessian(y, weights)
    values = field.values(y)
    for row in range(2):
        def exact(at: list[Any], i: int, row: int = row) -> Any:
            time = mpmath.mpf(0.5) + mpmath.mpf(shares[row]) * at[7]
            if i == 4:
                return at[7] * (at[4] ** 2 * mpmath.cos(at[1]) + at[6] * time**2)
            named = {**dict(zip(parameters, map(float, p), strict=True)), **dict(zip(names, at[:7], strict=False))}
            return at[7] * evaluate(tape, named, DIGITS)["rhs"][i]

        at, total = [mpmath.mpf(float(v)) for v in y[row]], np.zeros((8, 8))
        for i in range(5):
            first, second = _differences(functools.partial(exact, i=i), at, 8)
            assert np.abs(J[row, i] - first).max() < 1e-13 * max(np.abs(first).max(), 1)
            assert abs(values[row, i] - float(exact(at, i))) < 1e-13 * max(abs(values[row, i]), 1)
            assert (np.abs(first[~field.slopes[i]]) < 1e-25).all()
            total += weights[row, i] * second
        assert np.abs(H[row] - total).max() < 1e-13 * np.abs(total).max()
        assert (np.abs(total[~field.curvature]) < 1e-25).all()


def _derivatives_agree(program: Program, z: np.ndarray) -> None:
    """Directional derivatives by differences, extrapolated twice."""
    rng = np.random.default_rng(3)
    direction, weights = rng.normal(size=program.n), rng.normal(size=program.m)
    pattern = (program.jacobian_rows, program.jacobian_columns)
    jacobian = lambda at: scipy.sparse.csc_matrix((program.jacobian(at), pattern), (program.m, program.n))
    lagrangian = lambda at: 0.7 * program.gradient(at) + jacobian(at).T @ weights

    def along(f: Any) -> Any:
        d = lambda h: (f(z + h * direction) - f(z - h * direction)) / (2 * h)
        return (64 * d(2.5e-4) - 20 * d(5e-4) + d(1e-3)) / 45

    for exact, found in ((jacobian(z) @ direction, along(program.g)), (program.gradient(z) @ direction, along(program.f))):
        assert np.abs(exact - found).max() < 1e-9 * (1 + np.abs(found).max())
    upper = scipy.sparse.csc_matrix((program.hessian(z, 0.7, weights), (program.hessian_rows, program.hessian_columns)),
                                    (program.n, program.n))
    assert (program.hessian_rows <= program.hessian_columns).all()
    whole = upper + scipy.sparse.triu(upper, 1).T
    found = along(lagrangian)
    assert np.abs(whole @ direction - found).max() < 1e-8 * (1 + np.abs(found).max())


@functools.cache
def module_of(loops: bool) -> Any:
    """A cart with a pole, or a linkage with a torque at its crank."""
    if not loops:
        return sd.systems.cart_pole().compile(backend="c")
    system = sd.systems.four_bar()
    system.add_joint_force("hinge1", sd.inputs("tau"))
    return system.compile(backend="c")


@pytest.mark.every_value
@pytest.mark.parametrize("mesh", [hermite_simpson, functools.partial(radau, degree=3), functools.partial(shooting, hold=False),
                                  functools.partial(shooting, hold=True)], ids=["hermite-simpson", "radau", "shooting", "held"])
@pytest.mark.parametrize("loops", [False, True])
def test_programs_against_differences(mesh: Any, loops: bool) -> None:
    module = module_of(loops)
    parameter, force = ("l2", "tau") if loops else ("l", "F")
    a, b, u = sp.Symbol(module.metadata.x[0]), sp.Symbol(module.metadata.x[1]), sp.Symbol(force)
    problem = problem_of(module, sd.Loss(integral=u**2 + a**2 * sd.t, end=sd.t * b**2), (1.0, 3.0), "free", None, None,
                         {force: (-50, 60)}, [u * a <= 3 + sp.Symbol(parameter)], [sp.Eq(sp.Symbol(f"{a}(0)"), sp.sin(b))],
                         {parameter: (0.1, 5)}, None, None, 0.3)
    made = mesh(np.array([0.0, 0.2, 0.5, 1.0]))
    rng = np.random.default_rng(1)
    X = np.array([module.metadata.initial.get(n, 0.2) for n in module.metadata.x]) + 0.1 * rng.normal(
        size=(len(made.nodes), len(module.metadata.x)))
    on = Discretized(problem, made, 2, Motion(X, rng.normal(size=(len(made.samples), 1)), problem.p, 1.7))
    z = on.z + 0.05 * rng.normal(size=len(on.z))
    _derivatives_agree(on.program, z)
    elastic = Discretized(problem, made, 2, on.guess, elastic=True).program
    _derivatives_agree(elastic, np.append(z, np.ones(elastic.n - len(z))))


@functools.cache
def timed_point() -> Any:
    """A point on a parabola that moves, pushed by a force and by one that depends on the time."""
    x, y, phi = sd.coordinates("x y phi")
    F, a = sd.inputs("F"), sd.parameters("a")
    system = sd.System("timed", gravity=[0, -9.81])
    body = system.add_body("body", mass=1, inertia=1)
    system.add_joint(sd.Planar("plane", system.ground, body, [x, y, phi]))
    system.add_force(body, [F + a * sd.t**2, sp.sin(sd.t), 0])
    system.add_constraint(y - x**2 - a * sp.sin(2 * sd.t), name="parabola")
    system.add_output("late", x * sp.cos(sd.t) + a * sd.t)
    system.defaults, system.initial = {a: 0.3}, {x: 0.2, y: 0.04}
    return system.compile(backend="c")


@pytest.mark.parametrize("mesh", [hermite_simpson, functools.partial(radau, degree=3), functools.partial(shooting, hold=False)],
                         ids=["hermite-simpson", "radau", "shooting"])
def test_programs_of_equations_that_depend_on_the_time(mesh: Any) -> None:
    """With a free duration, by which rates, outputs and constraints are differentiated, too."""
    module = timed_point()
    late, x, F = sp.symbols("late x F")
    problem = problem_of(module, sd.Loss(integral=F**2 * late, end=late**2), (1.0, 3.0), "free", None, None, None,
                         [late * F <= 3], [sp.Eq(sp.Symbol("x(0)") * late, x)], {"a": (0.1, 1)}, None, None, 0.3)
    assert problem.timed == {"rhs", "outputs", "C"}
    made = mesh(np.array([0.0, 0.2, 0.5, 1.0]))
    rng = np.random.default_rng(1)
    X, U = 0.3 * rng.normal(size=(len(made.nodes), 6)), rng.normal(size=(len(made.samples), 1))
    on = Discretized(problem, made, 2, Motion(X, U, problem.p, 1.7))
    _derivatives_agree(on.program, on.z + 0.05 * rng.normal(size=len(on.z)))


@pytest.mark.parametrize("mesh", [hermite_simpson, functools.partial(shooting, hold=False)], ids=["collocation", "shooting"])
def test_programs_with_outputs_against_differences(mesh: Any) -> None:
    module = sd.systems.two_link_arm().compile(backend="c")
    x, y, q1, tau, l2 = sp.symbols("tip[0] tip[1] q1 tau1 l2")
    cost, conditions = sd.Loss(integral=y**2 * tau + x * sd.t, end=sp.sin(x * l2) * sd.t), [x * y <= q1, tau * x <= 3]
    problem = problem_of(module, cost, (1.0, 3.0), "free", None, None, None, conditions, [sp.Eq(sp.Symbol("q1(0)") * x, y**2)],
                         {"l2": (0.1, 5)}, None, None, 0.3)
    made = mesh(np.array([0.0, 0.2, 0.5, 1.0]))
    rng = np.random.default_rng(1)
    guess = Motion(0.3 * rng.normal(size=(len(made.nodes), 4)), rng.normal(size=(len(made.samples), 2)), problem.p, 1.1)
    on = Discretized(problem, made, 8, guess)
    _derivatives_agree(on.program, on.z)


def test_constraints_of_loops_against_differences() -> None:
    module = sd.systems.four_bar().compile(backend="c")
    x = np.array([[0.5, 0.13, -2.4, 0.3, -0.2, 0.9, 0.0], [1.0, -0.5, -2.1, 1.0, 0.4, -0.7, 0.0]])  # and the time
    loops = Loops(module, Arguments(6, 0, ()), module.parameters(), np.arange(4))
    w, d, h = np.array([[0.3, -1.0, 0.7, 2.0], [1.0, 0.4, -0.5, 0.1]]), np.random.default_rng(0).normal(size=(2, 7)), 1e-4
    gradient = lambda at: np.einsum("ni,nij->nj", w, loops.jacobian(at))
    found = (8 * (gradient(x + h * d) - gradient(x - h * d)) - (gradient(x + 2 * h * d) - gradient(x - 2 * h * d))) / (12 * h)
    assert np.abs(np.einsum("nij,nj->ni", loops.hessian(x, w), d) - found).max() < 1e-10


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_points_of_radau(d: int) -> None:
    c, weights = radau_points(d)
    assert c[-1] == 1 and abs(weights.sum() - 1) < 1e-15
    for power in range(2 * d - 1):
        assert abs(weights @ c**power - 1 / (power + 1)) < 1e-15
    if d == 2:
        assert np.abs(c - [1 / 3, 1]).max() < 1e-16
    mesh = radau(np.array([0.0, 0.4, 1.0]), d)
    # A polynomial of degree d fulfils its own differential equation without a defect, and its integral is exact.
    x = mesh.nodes[:, None] ** d
    assert np.abs(mesh.E @ x - mesh.W @ (d * mesh.shares[:, None] ** (d - 1))).max() < 1e-14
    assert abs(mesh.b @ mesh.shares ** (2 * d - 2) - 1 / (2 * d - 1)) < 1e-14
