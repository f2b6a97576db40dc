"""Joints, constraints and the ground follow inputs: against the same motion written as an expression in t, in all forms."""

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, UnivariateSpline, make_interp_spline

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError
from symdyn.formulation.equations import Equations
from symdyn.runtime.inputs.following import take_motion

z = sd.motions("z")
q, q2 = sd.coordinates("q q2")
m, length, g = sd.parameters("m length g")
OMEGA = 2.0
AS_TIME = sp.sin(OMEGA * sd.t) / 5


def as_function(t: float) -> tuple[float, float, float]:
    return np.sin(OMEGA * t) / 5, OMEGA * np.cos(OMEGA * t) / 5, -OMEGA**2 * np.sin(OMEGA * t) / 5


def as_inputs(t: float) -> dict[str, float]:
    return dict(zip(("z", "z_dot", "z_ddot"), as_function(t), strict=True))


def hung(motion: sp.Expr, kind: str) -> sd.System:
    """A pendulum of two links on something that follows a motion."""
    system = sd.System("hung", gravity=[0, 0, -g])
    cart = system.add_body("cart", mass=2, inertia=sp.diag(0.1, 0.2, 0.3))
    first = system.add_body("first", mass=m, inertia=sp.diag(0.02, 0.03, 0.01), com=[0, 0, -length / 2])
    second = system.add_body("second", mass=m, inertia=sp.diag(0.02, 0.03, 0.01), com=[0.1, 0, -length / 2])
    joints = {"Prismatic": lambda: sd.Prismatic("base", "ground", cart, motion, axis=[1, 0, 0]),
              "Revolute": lambda: sd.Revolute("base", "ground", cart, motion, axis=[0, 0.6, 0.8]),
              "Helical": lambda: sd.Helical("base", "ground", cart, motion, axis=[0, 0, 1], pitch=0.3),
              "Universal": lambda: sd.Universal("base", "ground", cart, [motion, q2]),
              "dependent": lambda: sd.Prismatic("base", "ground", cart, motion**2 + q / 3, axis=[1, 0, 0])}
    system.add_joint(joints[kind]())
    system.add_joint(sd.Revolute("pin", cart, first, q, axis=[0, 1, 0]))
    system.add_joint(sd.Revolute("knee", first, second, 2 * motion, axis=[1, 0, 0], parent_point=[0, 0, -length]))
    system.add_joint_force("pin", -0.3 * q.dot + 0.1 * motion)
    system.defaults = {m: 1.5, length: 0.7, g: 9.81}
    return system


def moved_ground(motion: sp.Expr) -> sd.System:
    system = hung(sp.Integer(0), "Prismatic")
    system.move_ground([motion, 0, motion**2], [0, motion / 2, 0])
    return system


def states(equations: Equations, count: int = 4) -> np.ndarray:
    n = len(equations.symbols.coordinates) + len(equations.symbols.speeds)
    return np.random.default_rng(1).uniform(-0.9, 0.9, (count, n))


@pytest.mark.every_value
@pytest.mark.parametrize("kind", ["Prismatic", "Revolute", "Helical", "Universal", "dependent"])
@pytest.mark.parametrize("form", ["embedding", "recursive", "augmented"])
def test_accelerations_are_those_of_the_same_motion_in_t(kind: str, form: str) -> None:
    given, timed = (getattr(hung(motion, kind), form)() for motion in (z, AS_TIME))
    first, second = given.compile("numpy"), timed.compile("numpy")
    assert list(first.metadata.inputs) == ["z", "z_dot", "z_ddot"]
    for t, x in zip((0.0, 0.4, 1.7, 3.1), states(given), strict=True):
        np.testing.assert_allclose(first.rhs(t, x, inputs=as_inputs(t)), second.rhs(t, x), rtol=1e-12, atol=1e-12)


@pytest.mark.every_value
@pytest.mark.parametrize("make", [lambda motion: hung(motion, "Revolute"), moved_ground])
@pytest.mark.parametrize("absolute", [False, True])
def test_verify_holds(make, absolute: bool) -> None:
    system = make(z)
    equations = system.augmented(coordinates="absolute") if absolute else system.embedding()
    result = equations.verify(states=1)
    assert result.passed, str(result)


def test_the_ground_follows_a_motion() -> None:
    given, timed = moved_ground(z).embedding().compile("numpy"), moved_ground(AS_TIME).embedding().compile("numpy")
    for t, x in zip((0.0, 0.4, 1.7, 3.1), states(moved_ground(z).embedding()), strict=True):
        np.testing.assert_allclose(given.rhs(t, x, inputs=as_inputs(t)), timed.rhs(t, x), rtol=1e-12)


TIMES = np.linspace(0, 4, 1601)
SPLINES = {
    "function": (as_function, 1e-10),
    "smooth": (sd.Smooth(as_function), 1e-10),
    "cubic": (CubicSpline(TIMES, np.sin(OMEGA * TIMES) / 5), 1e-6),
    "table": ((TIMES, np.sin(OMEGA * TIMES) / 5), 1e-6),
    "Table": (sd.Table(TIMES, np.sin(OMEGA * TIMES) / 5), 1e-6),
    "quintic": (make_interp_spline(TIMES[::8], np.sin(OMEGA * TIMES[::8]) / 5, k=5), 1e-7),
    "other": (UnivariateSpline(TIMES[::8], np.sin(OMEGA * TIMES[::8]) / 5, s=0, k=5), 1e-7),
    "periodic": (CubicSpline(np.linspace(0, np.pi, 2001), np.r_[np.sin(2 * np.linspace(0, np.pi, 2001))[:-1], 0] / 5,
                             bc_type="periodic"), 1e-6)}


@pytest.fixture(scope="module")
def cart() -> tuple:
    return hung(z, "Prismatic").embedding().compile(), hung(AS_TIME, "Prismatic").embedding().compile()


@pytest.mark.parametrize("name", SPLINES)
def test_simulation_follows_what_is_given(cart: tuple, name: str) -> None:
    given, (spline, allowed) = cart[0], SPLINES[name]
    t = np.linspace(0, 4, 41)
    found = given.simulate(t, [0.3], [1.1], inputs={z: spline}, rtol=1e-11)
    wanted = cart[1].simulate(t, [0.3], [1.1], rtol=1e-12)
    assert np.abs(found.x - wanted.x).max() < allowed
    # The second derivative of an interpolating spline is off by the knots' distance squared; at its ends by more.
    assert np.abs(found.inputs[2:-2, 2] - as_function(t)[2][2:-2]).max() < 100 * allowed


@pytest.mark.parametrize("method", ["dop853", "radau", "bs54", "RK45", "gauss"])
def test_methods_follow_a_motion(cart: tuple, method: str) -> None:
    t = np.linspace(0, 2, 11)
    found = cart[0].simulate(t, [0.3], [1.1], inputs={"z": SPLINES["smooth"][0]}, rtol=1e-9, method=method)
    wanted = cart[1].simulate(t, [0.3], [1.1], rtol=1e-12)
    assert np.abs(found.x - wanted.x).max() < 1e-6


def test_a_number_holds_a_motion_and_the_work_of_the_drive_is_in_the_balance(cart: tuple) -> None:
    module = cart[0]
    held = module.simulate((0, 1), [0.3], [0.0], inputs={z: 0.2})
    assert np.array_equal(held.inputs, np.tile([0.2, 0, 0], (len(held.t), 1)))
    moved = module.simulate((0, 3), [0.3], [1.1], inputs={z: as_function}, rtol=1e-11, work=True)
    assert np.abs(moved.energy_error()) < 1e-8


def test_a_batch_of_motions(cart: tuple) -> None:
    many = cart[0].simulate_batch(q=np.array([[0.1], [0.3]]), u=[[1.1]], t=np.linspace(0, 2, 5), inputs={z: as_function})
    one = cart[0].simulate(np.linspace(0, 2, 5), [0.3], [1.1], inputs={z: as_function})
    assert np.array_equal(many.x[1], one.x)


# -- in loops and constraints


def driven_four_bar(crank: sp.Expr) -> sd.System:
    """A four-bar linkage with a crank that follows a motion, and a pendulum at its coupler."""
    a, b, c = sd.coordinates("a b c")
    system = sd.System("driven", gravity=[0, 0, -g])
    names = ("crank", "coupler", "rocker", "bob")
    lengths = dict(zip(names, (0.2, 0.5, 0.4, 0.3), strict=True))
    bodies = {n: system.add_body(n, mass=m, inertia=sp.diag(0.01, 0.02, 0.03), com=[lengths[n] / 2, 0, 0]) for n in names}
    system.add_joint(sd.Revolute("A", "ground", bodies["crank"], crank, axis=[0, 1, 0]))
    system.add_joint(sd.Revolute("B", bodies["crank"], bodies["coupler"], a, axis=[0, 1, 0],
                                 parent_point=[lengths["crank"], 0, 0]))
    system.add_joint(sd.Revolute("D", "ground", bodies["rocker"], b, axis=[0, 1, 0], parent_point=[0.5, 0, 0]))
    system.add_joint(sd.Revolute("E", bodies["coupler"], bodies["bob"], c, axis=[0, 1, 0], parent_point=[0.2, 0, 0]))
    system.close_loop(sd.Revolute("C", bodies["coupler"], bodies["rocker"], axis=[0, 1, 0],
                                  parent_point=[lengths["coupler"], 0, 0], child_point=[lengths["rocker"], 0, 0]))
    system.defaults = {m: 1.5, g: 9.81}
    system.initial = {a: -0.9, b: -1.3, c: 1.0}
    return system


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_crank_that_follows_an_input_drives_a_loop(backend: str) -> None:
    given, timed = (driven_four_bar(crank).augmented().compile(backend) for crank in (z, AS_TIME))
    if backend == "c" and given.backend != "c":
        pytest.skip(given.fallback)
    t = np.linspace(0, 2 if backend == "c" else 0.3, 11)
    q0, u0 = given.consistent(inputs={z: as_function})
    there = timed.consistent()
    np.testing.assert_allclose(np.r_[q0, u0], np.concatenate(there), atol=1e-13)
    np.testing.assert_allclose(np.r_[q0, u0], np.concatenate(given.consistent(inputs=as_inputs(0.0))), atol=1e-15)
    found = given.simulate(t, q0, u0, inputs={z: as_function}, rtol=1e-10)
    wanted = timed.simulate(t, *there, rtol=1e-10)
    assert np.abs(found.x - wanted.x).max() < 1e-8
    for name, reaction in wanted.reactions.items():
        assert np.abs(found.reactions[name] - reaction).max() < 1e-6
    at = 1.0 if backend == "c" else 0.3
    inputs = as_inputs(at)
    assert given.rank(found.x[-1, :3], t=at, inputs=inputs) == 2


def test_a_constraint_follows_a_motion() -> None:
    """A mass on a string that is drawn in: m (r phi'' + 2 r' phi') = -m g sin(phi)."""
    x, y = sd.coordinates("x y")
    system = sd.System("drawn", gravity=[0, -g, 0])
    bob = system.add_body("bob", mass=m, inertia=sp.diag(0.01, 0.01, 0.01))
    system.add_joint(sd.Planar("free", "ground", bob, [x, y, q]))
    system.add_constraint(sp.sqrt(x**2 + y**2) - z)
    system.defaults = {m: 1.5, g: 9.81}
    module = system.augmented().compile()
    r = lambda t: (1 - 0.2 * t, -0.2, 0.0)
    phi0, rate0 = 0.4, 0.5
    start = {"x": np.sin(phi0), "y": -np.cos(phi0)}
    velocity = {"x_dot": -0.2 * np.sin(phi0) + np.cos(phi0) * rate0, "y_dot": 0.2 * np.cos(phi0) + np.sin(phi0) * rate0}
    found = module.simulate((0, 2), start, velocity, inputs={z: r}, rtol=1e-11)
    wanted = solve_ivp(lambda t, s: [s[1], (-9.81 * np.sin(s[0]) + 0.4 * s[1]) / (1 - 0.2 * t)], (0, 2), [phi0, rate0],
                       rtol=1e-12, atol=1e-12).y[0, -1]
    assert np.arctan2(found.x[-1, 0], -found.x[-1, 1]) == pytest.approx(wanted, abs=1e-8)
    assert np.hypot(*found.x[-1, :2]) == pytest.approx(0.6, abs=1e-12)


# -- linear analysis, actuation, printed forms


def test_linear_equations_have_the_motion_as_inputs_and_need_it_at_rest(cart: tuple) -> None:
    module = cart[0]
    rest = module.equilibrium(inputs={z: 0.1})
    linear = module.linearize(rest)
    assert linear.B.shape == (2, 3)
    h = 1e-6
    sides = [module.rhs(0.0, rest.x, inputs=np.array([0.1, 0, sign * h])) for sign in (1, -1)]
    np.testing.assert_allclose(linear.B[:, 2], (sides[0] - sides[1]) / (2 * h), atol=1e-8)
    with pytest.raises(ArgumentError, match=r"z_dot = 0\.5 among the inputs"):
        module.equilibrium(inputs={"z": 0.1, "z_dot": 0.5})
    moving = module.linearize((rest.q, rest.u), inputs={"z": 0.1, "z_dot": 0.5})
    with pytest.raises(ArgumentError, match=r"z_dot is 0\.5: how the motion goes on"):
        _ = moving.verdict


def test_actuation_leaves_motions_as_they_are() -> None:
    force = sd.inputs("F")
    system = hung(z, "Prismatic")
    system.add_joint_force("pin", force)
    module = system.embedding().compile("numpy")
    t = 0.7
    found = module.actuation(t, [0.2], [0.3], [0.4], inputs=as_inputs(t))
    rates = module.rhs(t, np.array([0.2, 0.3]), inputs={**as_inputs(t), "F": found["F"]})
    assert rates[1] == pytest.approx(0.4, abs=1e-12)
    assert "z" not in found.found


def test_derivatives_by_time() -> None:
    assert sp.sin(z).diff(sd.t, 2) == z.ddot * sp.cos(z) - z.dot**2 * sp.sin(z)
    assert sd.rate(z * q) == z * q.dot + z.dot * q
    with pytest.raises(ModelError, match="the rate of z_ddot is asked for"):
        sd.rate(z.ddot)
    assert sp.latex(z.ddot) == r"\ddot{z}"


def test_equations_by_hand_take_motions() -> None:
    """A pendulum on a cart that follows z, by its position map."""
    equations = sd.embedding([q], [z + length * sp.sin(q), -length * sp.cos(q)], [m, m], [0, -m * g])
    found = equations.explicit("accelerations")[0]
    assert (found - (-g * sp.sin(q) - z.ddot * sp.cos(q)) / length).equals(0)


# -- messages


@pytest.mark.parametrize(("given", "message"), [
    (lambda t: (np.sin(t), 2 * np.cos(t), -np.sin(t)), "returns the rate .* but its value changes by"),
    (lambda t: (np.sin(t), np.cos(t), np.sin(t)), "returns the acceleration .* but its rate changes by"),
    (lambda t: np.sin(t), "needed are three numbers: value, rate and acceleration"),
    (lambda t, x: (0, 0, 0), "is a function of more than t"),
    (lambda t: (np.sin(t), np.cos(t), -np.sin(t) if t < 3.7 else 0.0), "returns the acceleration 0 at t = "),
    (lambda t: (t, 1, 0) if t < 1.03 else (1.03, 0, 0), "has a rate that jumps by -1 at t = 1.03 s"),
    (lambda t: (np.sin(t) + 5 * (t > 3.9), np.cos(t), -np.sin(t)), "has a value that jumps by 5 at t = 3.9 s"),
    (lambda t: (1j, 0, 0), "needed are three numbers: value, rate and acceleration: .*complex"),
    (make_interp_spline([0, 1, 4], [0, 1, 0], k=1), "has a rate that jumps by -1.33333 at t = 1 s"),
    (CubicSpline([0, 1, 2], [0, 1, 0]), "holds from t = 0 s to 2 s, and the run goes from 0 s to 4 s"),
    (sd.Table([0, 1, 2], [0, 1, 0]), "holds from t = 0 s to 2 s"),
    (([0.0], [1.0]), "give one value for each of two or more times"),
    (CubicSpline([0, 4], [[0, 1], [1, 2]]), "pass one of a single real, finite value"),
    (sd.Sampled(lambda t, x: 0.0, 0.1), "given by a sampled controller, whose values jump"),
    ("z", "not a number")])
def test_what_is_no_motion(cart: tuple, given, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        cart[0].simulate((0, 4), [0.3], [1.1], inputs={z: given})


@pytest.mark.parametrize(("inputs", "message"), [
    ({"z": as_function, "z_dot": 1.0}, "z_dot given apart from the motion"),
    ({"z": 0.1, "z_dot": 1.0}, "z_dot given apart from the motion"),
    ([0.1, 1.0, 0.0], "z_dot is not zero, but the motion itself does not change"),
    (lambda t, x: (0, 0, 0), "give inputs by name"),
    ((TIMES, np.zeros((len(TIMES), 3))), "give inputs by name")])
def test_inputs_that_contradict_a_motion(cart: tuple, inputs, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        cart[0].simulate((0, 4), [0.3], [1.1], inputs=inputs)


def test_what_a_function_raises_ends_the_motion(cart: tuple) -> None:
    def broken(t: float) -> tuple[float, float, float]:
        return {}["road"], 0.0, 0.0

    message = r"the motion z \(broken\) raised KeyError: 'road', in line \d+ of test_motions.py"
    with pytest.warns(sd.SimulationWarning, match=message):
        sol = cart[0].simulate((0, 1), [0.3], [1.1], inputs={z: broken})
    assert not sol.success and isinstance(sol.cause, KeyError)
    with pytest.warns(sd.SimulationWarning, match="the motion z has the value nan at t = "):
        sol = cart[0].simulate((0, 1), [0.3], [1.1], inputs={z: lambda t: (t if t < 0.5 else np.nan, 1.0, 0.0)})
    assert not sol.success and 0 < sol.t[-1] < 0.6


@pytest.mark.parametrize("motion", [
    lambda t: (np.sin(500 * t), 500 * np.cos(500 * t), -250000 * np.sin(500 * t)),
    lambda t: (t**2 / 2, t, 1) if t < 1.03 else (1.03**2 / 2 + 1.03 * (t - 1.03), 1.03, 0),
    lambda t: (0, 0, 0) if t < 0.5 else ((t - 0.5)**3, 3 * (t - 0.5)**2, 6 * (t - 0.5)),
    lambda t: (1e6 + np.sin(t), np.cos(t), -np.sin(t)), lambda t: (1e-9 * np.sin(t), 1e-9 * np.cos(t), -1e-9 * np.sin(t))])
def test_motions_that_are_right_pass(motion) -> None:
    for span in ((0.0, 2.0), (0.0, 400.0), (3.0, 0.0)):
        assert take_motion(motion, "z", 0, "cart", span, False).name == "z"


def test_a_regulator_drives_other_inputs_than_motions() -> None:
    force, x = sd.inputs("F"), sd.coordinates("x")
    system = sd.System("quarter", gravity=[0, 0])
    body = system.add_body("body", 1)
    system.add_joint(sd.Prismatic("slide", "ground", body, x, axis=[1, 0]))
    system.add_joint_force("slide", force - 10 * (x - z) - 0.5 * (x.dot - z.dot))
    module = system.compile(backend="numpy")
    linear = module.linearize(module.equilibrium())
    regulator = linear.lqr({x: 1}, {force: 1})
    assert regulator.driven == ("F",) and regulator.K.shape == (1, 2)
    sol = module.simulate((0, 0.3), inputs={force: regulator[force], z: as_function}, rtol=1e-6)
    held = module.simulate((0, 0.3), inputs={force: sd.Sampled(regulator["F"], 1e-3), z: as_function}, rtol=1e-6)
    assert np.abs(sol.x[-1] - held.x[-1]).max() < 1e-3 and np.ptp(sol.inputs[:, 0]) > 0
    with pytest.raises(ArgumentError, match="R has weights of z, which belong to a motion"):
        linear.lqr({x: 1}, {force: 1, z: 1})
    with pytest.raises(ArgumentError, match="R has no weights, so there is nothing to drive; give weights of inputs: F"):
        linear.lqr({x: 1}, {})
    with pytest.raises(ArgumentError, match="the regulator does not drive 'z'; it drives F"):
        regulator[z]


def test_what_may_not_follow_rates_of_motions() -> None:
    system = hung(z.dot, "Prismatic")
    with pytest.raises(ModelError, match="its coordinate z_dot uses z_dot; a dependent coordinate may use coordinates, motions"):
        system.embedding()
    system = hung(z, "Prismatic")
    system.add_constraint(q - z.dot, name="c")
    with pytest.raises(ModelError, match="c uses z_dot; a constraint may use coordinates, motions, t and parameters"):
        system.augmented()
    system = hung(z, "Prismatic")
    system.add_constraint(q.dot - z.ddot, name="c")
    with pytest.raises(ModelError, match="c uses z_ddot"):
        system.augmented()
    system = hung(z, "Prismatic")
    system.initial = {z.dot: 1.0}
    with pytest.raises(ModelError, match="initial"):
        system.embedding()
    system = sd.System("still")
    system.add_joint(sd.Prismatic("base", "ground", system.add_body("b", mass=1, inertia=sp.eye(3)), z, axis=[1, 0, 0]))
    with pytest.raises(ModelError, match="so nothing can move"):
        system.embedding()


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_batch_takes_no_rates_apart_from_the_motion(backend: str) -> None:
    module = hung(z, "Prismatic").embedding().compile(backend)
    with pytest.raises(ArgumentError, match="z_ddot is not zero, but the motion itself does not change"):
        module.simulate_batch({"q": [0.4, 0.5]}, t=(0, 1), inputs={z.ddot: 5.0})


def test_numbers_belong_where_one_time_is_looked_at() -> None:
    m = hung(z, "Prismatic").embedding().compile("numpy")
    match = (r"inputs: z is .*, over time; functions, splines and tables are for simulate, simulate_batch and consistent. Here "
             r"pass its number at this time, and those of its rate and acceleration, inputs=\{z: 0.1, z.dot: 0.2, z.ddot: 0\}")
    of_ensembles = (r"an ensemble takes numbers as inputs, found \{z: .*; write what goes over time as an expression in sd.t, "
                    r"with parameters that samples may change, or run module.simulate_batch, which takes functions, splines and")
    times = np.linspace(0, 1, 6)
    for course in (CubicSpline(times, times**2), (times, times**2), sd.Table(times, times**2), lambda t: (t, 1.0, 0.0)):
        given = {z: course}
        for call in (lambda given: m.rhs(0, [0, 0], inputs=given), lambda given: m.rhs_batch(0, [[0, 0]] * 2, inputs=given),
                     lambda given: m.mass_matrix(0, [0.0, 0.0], inputs=given), lambda given: m.linearize(inputs=given),
                     lambda given: m.equilibrium(inputs=given), lambda given: m.actuation(0, [0], [0], [0], inputs=given)):
            with pytest.raises(ArgumentError, match=match):
                call(given)
        with pytest.raises(ArgumentError, match=of_ensembles):
            sd.ensemble(m, {"q": [0.1, 0.2]}, t=(0, 1), inputs=given)


@pytest.mark.parametrize("start", [{"q": {z: 1.0}}, {"u": {z.dot: 1.0}}, {"q": {"z": 1.0, "q": 0.1}}])
def test_a_motion_has_no_start_of_its_own(start: dict[str, Any]) -> None:
    module = hung(z, "Prismatic").embedding().compile("numpy")
    match = (r"initial [qu] has the motion z, which follows an input; pass it there, inputs=\{z: ...\}: a function of t, a "
             "spline, a table or a number")
    with pytest.raises(ArgumentError, match=match):
        module.simulate((0, 1), **start)
