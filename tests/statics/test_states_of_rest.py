"""States of rest and of the mechanism, rounding, held coordinates, and the words that name them: minimal cases."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, EquilibriumNotUnique, NoEquilibrium
from tests.helpers import swept
from tests.mechanisms import four_bar_linkage
from tests.runtime.test_modes import richardson

PRINTED_OR_RAISED = (ArgumentError, EquilibriumNotUnique, NoEquilibrium)


def printed(call: Any) -> str:
    """Output of a call, or the message of its error."""
    try:
        return repr(call())
    except PRINTED_OR_RAISED as error:
        return str(error)


def slider(force: Any, mass: Any = 1, name: str = "slider", **defaults: float) -> Any:
    """A mass on a rail with coordinate q under a force."""
    s = sd.System(name, planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=mass), sd.coordinates("q"), axis=[1, 0]))
    s.add_joint_force("rail", force)
    s.defaults = {sd.parameters(n, positive=True): v for n, v in defaults.items()}
    return s.embedding().compile(backend="numpy")


Q = sd.coordinates("q")


@functools.cache
def pendulum() -> Any:
    """theta from the downward vertical, a torsion damper d."""
    theta = sd.coordinates("theta")
    g, l, d = sd.parameters("g l d", positive=True)
    s = sd.System("swing", gravity=[0, -g])
    bob = s.add_body("bob", mass=2, com=[0, -l])
    s.add_joint_force(s.add_joint(sd.Revolute("pivot", s.ground, bob, theta)), -d * theta.dot)
    s.defaults = {g: 9.81, l: 1.5, d: 0.0}
    return s.embedding().compile(backend="numpy")


# -- states that are no states of the mechanism


@functools.cache
def linkage() -> Any:
    return four_bar_linkage().augmented().compile(backend="numpy")


def test_a_linkage_that_is_open_is_not_linearized() -> None:
    """Its ends are 0.125 m apart; the message names what closes it, and then it works."""
    module = linkage()
    assert np.isclose(np.abs(module.evaluate("C", 0.0, [1, -0.5, -2, 0, 0, 0])).max(), 0.125, atol=5e-4)
    for at in (None, {"q1": 1.0}, [1, -0.5, -2, 0, 0, 0]):
        with pytest.raises(ArgumentError, match=r"linkage: .*module\.consistent"):
            module.linearize(at)
    q, u = module.consistent(keep=["q1"])
    assert module.linearize((q, u)).A.shape == (2, 2)


def test_fixing_a_coordinate_of_a_linkage_elsewhere_does_not_open_it() -> None:
    module = linkage()
    q, u = module.consistent(keep=["q1"])
    opened = module.evaluate("C", 0.0, [q[0] + 0.75, *q[1:], *u])
    assert np.linalg.norm(opened) > 0.5
    with pytest.raises(ArgumentError, match=r"module\.consistent"):
        module.linearize((q, u), fixed={"q1": q[0] + 0.75})
    assert module.linearize((q, u), fixed={"q1": q[0]}).A.shape == (0, 0)


def test_speeds_that_a_linkage_cannot_have_are_not_linearized() -> None:
    module = linkage()
    q, _ = module.consistent(keep=["q1"])
    with pytest.raises(ArgumentError, match=r"module\.consistent"):
        module.linearize((q, np.array([1.0, 0.0, 0.0])))
    q, u = module.consistent(q=dict(zip(("q1", "q2", "q3"), q, strict=True)), u={"q1_dot": 1.0}, keep=["q1", "q1_dot"])
    lin = module.linearize((q, u))
    assert np.isfinite(lin.A).all()
    with pytest.raises(ArgumentError, match="rest"):  # it moves, and not steadily
        lin.modes()


@pytest.mark.parametrize("coordinate", ["q1", *swept(["q2"]), "q3"])
def test_a_moving_linkage_has_the_derivative_of_its_flow(coordinate: str) -> None:
    """By differences of neighbouring consistent motions, in any of its angles."""
    module = linkage()
    q, u = module.consistent(u={"q1_dot": 2.0}, keep=["q1", "q1_dot"])
    k = int(coordinate[1]) - 1
    lin = module.linearize((q, u), coordinates=[coordinate])

    def field(place: float, speed: float) -> np.ndarray:
        near = module.consistent(q={**dict(zip(("q1", "q2", "q3"), q, strict=True)), coordinate: place},
                                 u={**dict(zip(("q1_dot", "q2_dot", "q3_dot"), u, strict=True)), f"{coordinate}_dot": speed},
                                 keep=[coordinate, f"{coordinate}_dot"])
        return module.rhs(0.0, np.concatenate(near))[[k, 3 + k]]

    A = np.column_stack([richardson(lambda v: field(v, u[k]), q[k], 1e-3), richardson(lambda v: field(q[k], v), u[k], 1e-3)])
    assert lin.coordinates == (coordinate,) and np.allclose(lin.A, A, rtol=1e-7, atol=1e-7) and np.abs(A).max() > 3


# -- states that are no states of rest


@functools.cache
def sprung_arm() -> Any:
    """An arm in the horizontal plane, a torsion spring at its hinge, a mass that slides along it on a spring about r = 1."""
    theta, r = sd.coordinates("theta r")
    s = sd.System("sprung_arm", planar=True)
    arm, mass = s.add_body("arm", inertia=0.5), s.add_body("mass", mass=2)
    s.add_joint_force(s.add_joint(sd.Revolute("hinge", s.ground, arm, theta)), -30 * theta)
    s.add_joint_force(s.add_joint(sd.Prismatic("slot", arm, mass, r, axis=[1, 0])), -80 * (r - 1))
    s.initial = {r: 1}
    return s.embedding().compile(backend="numpy")


def test_the_end_of_a_motion_is_a_start_without_its_speeds() -> None:
    """The springs are slack at theta = 0 and r = 1, not where weight and speed balance."""
    module = sprung_arm()
    sol = module.simulate((0, 1.3), q={"theta": 0.4}, u={"theta_dot": 1.5, "r_dot": 0.2}, rtol=1e-9)
    assert np.abs(sol.u[-1]).min() > 0.05
    rest = module.equilibrium(start=sol.x[-1])
    assert np.allclose(rest.q, [0, 1], atol=1e-12) and not rest.u.any() and rest.verdict == "neutral"
    assert np.allclose(module.equilibrium(start=dict(zip(module.metadata.x, sol.x[-1], strict=True))).q, [0, 1], atol=1e-12)


def test_a_pendulum_that_swings_through_is_not_at_rest() -> None:
    rest = pendulum().equilibrium(start=np.array([0.0, -2.2]))
    assert not rest.u.any() and abs(rest["theta"]) < 1e-12 and rest["theta_dot"] == 0.0
    steady = pendulum().linearize([0.0, -2.2])
    assert np.isclose(steady.A[1, 0], -9.81 / 1.5, rtol=1e-12)  # the equations along the motion are what they are
    with pytest.raises(ArgumentError, match="rest"):
        steady.modes()


# -- the same defaults everywhere


@functools.cache
def pushed() -> Any:
    """k q = F z with an input F that is 2 initially and an actuator z_dot = z - z^3, 1 initially."""
    q, z = sd.coordinates("q z")
    k, d = sd.parameters("k d", positive=True)
    F = sd.inputs("F")
    s = sd.System("pushed", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", F * z - k * q - d * q.dot)
    s.add_state(z, 3 * (z - z**3))
    s.add_output("push", F * z)
    s.add_output("speed", [q.dot, F * q])
    s.defaults = {k: 8.0, d: 1.0}
    s.initial = {q: 0.1, q.dot: 0.3, z: 1.0, F: 2.0}
    return s.embedding().compile(backend="numpy")


def test_initial_inputs_count_in_every_function() -> None:
    module = pushed()
    x = np.array([0.1, 0.3, 1.0])
    assert np.allclose(module.rhs(0.0, x), module.rhs(0.0, x, inputs=[2.0])) and np.isclose(module.rhs(0.0, x)[1], 0.9)
    assert module.outputs(0.0, x)["push"] == 2.0
    assert module.simulate((0, 0.1)).inputs[0] == 2.0
    rest = module.equilibrium()
    assert np.isclose(rest["q"], 2 / 8, rtol=1e-13) and rest["F"] == 2.0
    lin = module.linearize()
    assert lin.inputs[0] == 2.0 and np.isclose(lin.ud[0], 0.9, rtol=1e-13)
    assert np.allclose(module.jacobian(0.0, x).x, module.jacobian(0.0, x, inputs=[2.0]).x)
    assert np.isclose(module.linearize(rest.x).C_out[2, 0], 2.0)
    assert np.allclose(module.equilibrium(inputs={"F": 4.0}).q, [0.5], rtol=1e-13)


def test_initial_states_and_speeds_count_in_every_function() -> None:
    """Where the state is left out all of it is the initial one; with q and u given extra states are."""
    module = pushed()
    assert np.array_equal(module.linearize().x, [0.1, 0.3, 1.0]) and np.array_equal(module.simulate((0, 0.1)).x[0], [0.1, 0.3, 1])
    assert np.array_equal(module.linearize(([0.2], [0.0])).x, [0.2, 0.0, 1.0])
    assert np.array_equal(module.linearize({"q": 0.2}).x, [0.2, 0.3, 1.0])
    assert np.array_equal(module.simulate((0, 0.1), q=[0.2], u=[0.0]).x[0], [0.2, 0.0, 1.0])
    assert np.array_equal(module.simulate((0, 0.1), q={"q": 0.2}).x[0], [0.2, 0.3, 1.0])


@pytest.mark.parametrize("start", [None, [0.4], {"q": 0.4}, {"q": 0.4, "z": 0.7}])
def test_extra_states_begin_at_their_initial_values(start: Any) -> None:
    """z = 0 is a state of rest, too, but an unstable one that is far from the initial 1."""
    rest = pushed().equilibrium(start=start)
    assert np.isclose(rest["z"], 1.0, rtol=1e-13) and np.isclose(rest["q"], 0.25, rtol=1e-13) and rest.verdict == "stable"
    assert pushed().equilibrium(start={"z": 0.0}).verdict == "unstable"


def test_a_state_without_its_inputs_is_not_the_equilibrium() -> None:
    """`linearize(rest.x)` takes the initial inputs, not those that were solved for, and is then no state of rest."""
    trimmed = pushed().equilibrium(unknown_params=["F"], fixed={"q": 0.5})
    assert np.isclose(trimmed["F"], 4.0, rtol=1e-13)
    bare = pushed().linearize(trimmed.x)
    assert np.isclose(bare.ud[0], -2.0, rtol=1e-12)
    with pytest.raises(ArgumentError, match="rest"):
        bare.modes()
    assert np.allclose(pushed().linearize(trimmed.x, inputs=trimmed.inputs).A, pushed().linearize(trimmed, hold=()).A, rtol=1e-14)


# -- rounding taken for structure


FOLDED = {"theta": math.pi / 2, "phi": -math.pi, "theta_dot": 0.0, "phi_dot": 0.0}


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_slider_crank_that_is_folded_is_a_singular_configuration(scale: float) -> None:
    """From its own initial values the search ends where one rod lies on the other: C_r is 5e-16, its rank 0.

    Two motions lead away from there. Every output names it, and no frequency that depends on the masses.
    """
    module = systems.slider_crank().augmented().compile(backend="numpy")
    params = {"m": scale}
    assert module.rank([FOLDED["theta"], FOLDED["phi"]]) == 0
    for call in (lambda: module.equilibrium(params=params), lambda: module.linearize(FOLDED, params=params).modes(),
                 lambda: module.stability(FOLDED, params=params)):
        text = printed(call)
        assert "singular configuration" in text and "0.46479" not in text
    regular = module.linearize(dict.fromkeys(FOLDED, 0.0), params={**params, "g": 0.0})
    assert regular.A.shape == (2, 2)


def test_a_flat_parallelogram_is_a_singular_configuration() -> None:
    """Its loop has the rank 1 of 2 there: it does not have two modes, one freedom has two ways on."""
    module = systems.n_four_bar(1).augmented().compile(backend="numpy")
    still = dict.fromkeys(module.metadata.u, 0.0)
    flat = {"theta0": math.pi / 2, "theta1": math.pi / 2, "phi1": -math.pi / 2, **still}
    assert module.rank(list(flat.values())[:3]) == 1 and module.rank([0.3, 0.3, -0.3]) == 2
    assert "singular configuration" in printed(lambda: module.linearize(flat, params={"g": 0.0}).modes())
    assert "singular configuration" in printed(lambda: module.stability(flat, params={"g": 0.0}))
    hanging = module.linearize({"theta0": math.pi, "theta1": math.pi, "phi1": -math.pi, **still})
    # Two uprights about their ends and a bar that moves along: theta_ddot (2/3 + 1) l = -(1 + 1) g theta.
    (mode,) = hanging.modes()
    assert np.isclose(mode.omega**2, 2 * 9.81 / (2 / 3 + 1), rtol=1e-9) and hanging.verdict == "neutral"


def test_a_slow_growth_next_to_a_strong_damper_is_no_zero() -> None:
    """m q_ddot + d q_dot - k q = 0: lambda = 2 k / (d + sqrt(d^2 + 4 k m)), 9e-3 per s next to -1e6."""
    m, k, d = sd.parameters("m k d", positive=True)
    module = slider(k * Q - d * Q.dot, m, "capsizing", m=1.0, k=9e3, d=1e6)
    rest = module.equilibrium()
    growth = 2 * 9e3 / (1e6 + math.sqrt(1e12 + 4 * 9e3))
    assert rest.verdict == "unstable" and rest.stable is False
    assert np.isclose(max(rest.eigenvalues.real), growth, rtol=1e-9) and np.isclose(growth, 9e-3, rtol=1e-6)
    assert sorted(m.kind for m in module.linearize(rest).modes()) == ["real", "unstable"]
    held_back = slider(-k * Q - d * Q.dot, m, "creeping", m=1.0, k=9e3, d=1e6)
    assert held_back.equilibrium().verdict == "stable"


def test_damping_of_a_light_mass_next_to_a_heavy_one_counts() -> None:
    """1e-6 kg on 1e-4 N/m next to 1e6 kg on 1e10 N/m: lambda = 5e-3 +- 10 i, from a damper of -1e-8 N s/m."""
    heavy, light = sd.coordinates("heavy light")
    d = sd.parameters("d")
    s = sd.System("unlike", planar=True)
    s.add_joint(sd.Prismatic("first", s.ground, s.add_body("block", mass=1e6), heavy, axis=[1, 0]))
    s.add_joint(sd.Prismatic("second", s.ground, s.add_body("crumb", mass=1e-6), light, axis=[1, 0]))
    s.add_joint_force("first", -1e10 * heavy)
    s.add_joint_force("second", -1e-4 * light - d * light.dot)
    s.defaults = {d: -1e-8}
    module = s.embedding().compile(backend="numpy")
    for value, verdict in ((-1e-8, "unstable"), (0.0, "neutral"), (1e-8, "neutral")):
        lin = module.linearize(module.equilibrium(params={"d": value}))
        assert lin.verdict == verdict
        roots = np.roots([1e-6, value, 1e-4])
        assert np.abs(lin.modes()["light"].eigenvalue - roots[roots.imag > 0][0]) < 1e-9 * 10
        assert np.isclose(lin.modes()["light"].damping, value / (2 * 1e-6 * 10), rtol=1e-9, atol=1e-15)
        assert np.isclose(lin.modes()["heavy"].omega, 100, rtol=1e-12) and abs(lin.modes()["heavy"].damping) < 1e-15


@functools.cache
def ziegler(rod: float) -> Any:
    """Ziegler's double pendulum, 2 m and m on two rods of 1 m with springs k, a force P along the second; and a stiff rod."""
    a, b, q = sd.coordinates("a b q")
    P = sd.parameters("P", positive=True)
    s = sd.System("ziegler", planar=True)
    first, second = s.add_body("first", mass=2, com=[1, 0]), s.add_body("second", mass=1, com=[1, 0])
    s.add_joint_force(s.add_joint(sd.Revolute("foot", s.ground, first, a)), -a)
    s.add_joint_force(s.add_joint(sd.Revolute("knee", first, second, b, parent_point=[1, 0])), -b)
    s.add_force(second, [-P, 0], point=[1, 0], frame=second)
    if rod:
        s.add_joint(sd.Prismatic("along", s.ground, s.add_body("rod", mass=1), q, axis=[1, 0]))
        s.add_joint_force("along", -rod * q)
    s.defaults = {P: 3.0}
    return s.embedding().compile(backend="numpy")


FLUTTER = 3.5 - math.sqrt(2)


@pytest.mark.every_value
@pytest.mark.parametrize("rod", [0.0, 1e6, 1e12])
@pytest.mark.parametrize("P", [1.0, 2.05, 2.12, 3.0, 4.8, 5.0])
def test_zieglers_column_flutters_whatever_stands_next_to_it(rod: float, P: float) -> None:
    """2 lambda^4 + (7 - 2 P) lambda^2 + 1 = 0: flutter above 7/2 - sqrt 2 = 2.086, divergence above 7/2 + sqrt 2 = 4.914.

    Source: Ziegler, Die Stabilitaetskriterien der Elastomechanik, Ingenieur-Archiv 20, 1952.
    """
    module = ziegler(rod)
    rest = module.equilibrium(params={"P": P})
    squares = np.roots([2, 7 - 2 * P, 1]).astype(complex)
    expected = np.array([*np.sqrt(squares), *-np.sqrt(squares)])
    for value in expected:
        assert np.abs(rest.eigenvalues - value).min() < 1e-9 * abs(value)
    assert rest.verdict == ("neutral" if P < FLUTTER else "unstable")


def test_a_stiffness_that_is_a_difference_of_equal_numbers_decides_nothing() -> None:
    """0.1 + 0.2 - 0.3 is 6e-17: whether it returns, drifts or runs away is rounding."""
    a, b, c = sd.parameters("a b c", positive=True)
    for sign in (1, -1):
        module = slider(sign * (a + b - c) * Q, 1, "balanced", a=0.1, b=0.2, c=0.3)
        assert module.linearize({"q": 0.0}).verdict in ("not decided", "drifts")
    # A number that is given and not a difference counts, however small it is.
    k, m = sd.parameters("k m", positive=True)
    assert slider(-k * Q, m, "soft", k=1e-17, m=1.0).linearize({"q": 0.0}).verdict == "neutral"
    assert slider(k * Q, m, "falling", k=1e-17, m=1.0).linearize({"q": 0.0}).verdict == "unstable"


# -- derivatives


def test_a_defective_double_eigenvalue_has_no_derivative() -> None:
    """q_ddot + 2 q_dot + q = 0, damped just critically: lambda = -1 twice, with a single eigenvector."""
    m, k, d = sd.parameters("m k d", positive=True)
    module = slider(-k * Q - d * Q.dot, m, "critical", m=1.0, k=1.0, d=2.0)
    lin = module.linearize(module.equilibrium())
    assert lin.verdict == "stable"
    for parameter in ("k", "d", "m"):
        with pytest.raises(ArgumentError, match="double"):
            lin.derivative(0, parameter)
    clear = module.linearize(module.equilibrium(params={"d": 2.1}))
    root = math.sqrt(2.1**2 / 4 - 1)
    slow, = [m for m in range(2) if clear.modes()[m].eigenvalue.real > -1]
    assert np.isclose(clear.derivative(slow, "k").eigenvalue.real, -0.5 / root, rtol=1e-9)


# -- what is held


def jig(held: bool) -> Any:
    """A rail, a turret and two links with drives: four coordinates, or three where the turret is welded at 0.4 rad."""
    x, q1, q2, q3 = sd.coordinates("x q1 q2 q3")
    F, tau = sd.inputs("F tau")
    s = sd.System("jig" if held else "welded", gravity=[0, -9.81, 0])
    cart = s.add_body("cart", mass=3)
    turret = s.add_body("turret", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.1, 0.2, 0.1])
    first = s.add_body("first", mass=1.5, inertia=[0.05, 0.2, 0.2], com=[0.4, 0, 0.1])
    second = s.add_body("second", mass=0.7, inertia=[0.02, 0.05, 0.05], com=[0.3, 0.1, 0])
    s.add_joint_force(s.add_joint(sd.Prismatic("rail", s.ground, cart, x, axis=[1, 0, 0])), F - 20 * x - x.dot)
    turn = s.add_joint(sd.Revolute("turn", cart, turret, q1 if held else sp.Rational(2, 5), axis=[0, 1, 0]))
    if held:
        s.add_joint_force(turn, -5 * q1 + tau)
    s.add_joint_force(s.add_joint(sd.Revolute("elbow", turret, first, q2, axis=[0, 0, 1], parent_point=[0, 0.5, 0])),
                      tau - 8 * q2 - 0.5 * q2.dot)
    s.add_joint_force(s.add_joint(sd.Revolute("wrist", first, second, q3, axis=[1, 0, 0], parent_point=[0.8, 0, 0])),
                      -3 * q3 - sp.sin(F))
    s.add_output("tip", sd.acceleration(second, (0.6, 0.1, 0)))
    s.add_output("elbow", sd.acceleration(first, (0, 0, 0)))
    s.add_output("seen", [sp.sin(q2) * x.dot, F * q3])
    return s.embedding().compile(backend="numpy")


@functools.cache
def jigs() -> tuple[Any, Any]:
    return jig(True), jig(False)


@pytest.mark.parametrize("seed", range(4))
def test_acceleration_outputs_feel_what_is_held(seed: int) -> None:
    """A, B, C_out, D with the turret held are differences of rates and outputs of the machine whose turret is welded."""
    whole, welded = jigs()
    stream = np.random.default_rng(seed)
    q, u = stream.uniform(-0.8, 0.8, 3), stream.uniform(-1, 1, 3) * (seed > 0)
    inputs = stream.uniform(-1, 1, 2)
    lin = whole.linearize(([q[0], 0.4, *q[1:]], [u[0], 0.0, *u[1:]]), inputs=inputs, hold=["q1"])
    assert lin.coordinates == ("x", "q2", "q3") and lin.held == ("q1",) and lin.A.shape == (6, 6)
    x = np.concatenate([q, u])

    def both(at: np.ndarray) -> np.ndarray:
        return np.concatenate([welded.rhs(0.0, at[:6], inputs=at[6:]), welded.evaluate("outputs", 0.0, at[:6], inputs=at[6:])])

    at, h = np.concatenate([x, inputs]), 2e-3
    slopes = np.column_stack([richardson(lambda v, e=e: both(at + v * e), 0.0, h) for e in np.eye(8)])
    assert lin.outputs == tuple([f"tip[{k}]" for k in range(3)] + [f"elbow[{k}]" for k in range(3)] + ["seen[0]", "seen[1]"])
    for found, expected in ((lin.A, slopes[:6, :6]), (lin.B, slopes[:6, 6:]), (lin.C_out, slopes[6:, :6]),
                            (lin.D, slopes[6:, 6:])):
        assert np.abs(found - expected).max() <= 1e-8 * max(1.0, np.abs(expected).max())


def test_what_is_held_is_named_everywhere() -> None:
    whole, _ = jigs()
    rest = whole.equilibrium(fixed={"q1": 0.4})
    assert rest.held == ("q1",) and "q1" in repr(rest) and "held" in repr(rest)
    lin = whole.linearize(rest)
    assert lin.held == ("q1",) and "held" in repr(lin) and "held" in repr(lin.modes()) and "q1" in repr(lin.modes())
    assert "held" in repr(whole.stability(rest))
    free = whole.linearize(rest, hold=())
    assert free.held == () and free.A.shape == (8, 8) and "held" not in repr(free)
    with pytest.raises(ArgumentError, match="q9"):
        whole.linearize(rest, hold=["q9"])


def test_releasing_a_coordinate_that_bore_a_load_leaves_no_state_of_rest() -> None:
    """The turret was held against its spring: with hold=() it turns, and there are no modes to speak of."""
    whole, _ = jigs()
    free = whole.linearize(whole.equilibrium(fixed={"q1": 0.4}), hold=())
    assert np.abs(free.ud).max() > 0.1 and np.isfinite(free.A).all()
    with pytest.raises(ArgumentError, match="rest"):
        free.modes()


@functools.cache
def quadrotor() -> Any:
    """A rigid body with four thrusts T that follow their inputs u with the time constant 0.05 s; arms of 0.2 m along x and y."""
    q = sd.coordinates("x y z psi theta phi")
    T, u = sd.coordinates("T1:5"), sd.inputs("u1:5")
    m, g, tau = sd.parameters("m g tau", positive=True)
    s = sd.System("quadrotor", gravity=[0, 0, -g])
    body = s.add_body("body", mass=m, inertia=[0.01, 0.012, 0.02])
    s.add_joint(sd.Free("free", s.ground, body, q))
    for thrust, wanted in zip(T, u, strict=True):
        s.add_state(thrust, (wanted - thrust) / tau)
    s.add_force(body, [0, 0, sum(T)], frame=body)
    s.add_torque(body, [0.2 * (T[1] - T[3]), 0.2 * (T[2] - T[0]), 0.015 * (T[0] - T[1] + T[2] - T[3])], frame=body)
    s.defaults = {m: 1.2, g: 9.81, tau: 0.05}
    s.initial = dict.fromkeys(T, 3.0)
    return s.embedding().compile(backend="numpy")


def hovering() -> tuple[np.ndarray, np.ndarray]:
    """A (16, 16) and B (16, 4) by hand, in the order x y z psi theta phi, their rates, T1 ... T4."""
    A, B = np.zeros((16, 16)), np.zeros((16, 4))
    A[:6, 6:12] = np.eye(6)
    A[6, 4], A[7, 5] = 9.81, -9.81
    A[8, 12:] = 1 / 1.2
    A[9, 12:] = np.array([1, -1, 1, -1]) * 0.015 / 0.02
    A[10, 12:] = np.array([-1, 0, 1, 0]) * 0.2 / 0.012
    A[11, 12:] = np.array([0, 1, 0, -1]) * 0.2 / 0.01
    A[12:, 12:], B[12:] = -20 * np.eye(4), 20 * np.eye(4)
    return A, B


def test_a_trimmed_quadrotor_has_all_of_its_states() -> None:
    """Place and heading are conditions of the trim, which the thrusts meet: nothing holds them when it flies."""
    module = quadrotor()
    rest = module.equilibrium(unknown_params=["u1", "u2", "u3", "u4"], fixed={"x": 0, "y": 0, "z": 2, "psi": 0})
    assert np.allclose(rest.inputs, 1.2 * 9.81 / 4, rtol=1e-12) and np.allclose(rest.z, rest.inputs, rtol=1e-12)
    A, B = hovering()
    for lin in (module.linearize(rest, hold=()), module.linearize(rest)):
        assert lin.A.shape == (16, 16) and lin.states == tuple(module.metadata.x) and lin.held == ()
        assert np.allclose(lin.A, A, rtol=1e-9, atol=1e-9) and np.allclose(lin.B, B, rtol=1e-12)
        assert lin.verdict == "drifts"
    # A^4 (A + 20) = 0: four zeros in a row from a tilt to the place, and the actuators.
    assert np.abs(np.linalg.matrix_power(A, 4) @ (A + 20 * np.eye(16))).max() < 1e-9
    held = module.linearize(rest, hold=["x", "y", "z", "psi"])
    assert held.A.shape == (8, 8) and held.held == ("x", "y", "z", "psi")


def test_a_quadrotor_that_is_held_in_place_names_what_holds_it() -> None:
    """With its inputs given, place and attitude are kept and not conditions: the actuators are left, and 16 states without."""
    module = quadrotor()
    names = ("x", "y", "z", "psi", "theta", "phi")
    rest = module.equilibrium(fixed=dict(zip(names, (0, 0, 2, 0, 0, 0), strict=True)), inputs=[1.2 * 9.81 / 4] * 4)
    kept = module.linearize(rest)
    assert kept.A.shape == (4, 4) and kept.held == names and "held" in repr(kept) and rest.verdict == "stable"
    free = module.linearize(rest, hold=())
    assert free.held == () and np.allclose(free.A, hovering()[0], rtol=1e-9, atol=1e-9) and free.verdict == "drifts"


def test_a_hovering_quadrotor_drifts() -> None:
    rest = quadrotor().equilibrium(unknown_params=["u1", "u2", "u3", "u4"], fixed={"x": 0, "y": 0, "z": 2, "psi": 0})
    assert rest.verdict == "drifts" and rest.stable is not True and "drifts" in repr(rest)
    assert quadrotor().stability(rest).verdict == "drifts"


# -- constraints that move


@functools.cache
def slot() -> Any:
    """A unit mass in a slot that turns at w about the origin, on a spring k to it; position, speed, acceleration as outputs."""
    x, y = sd.coordinates("x y")
    w, k = sd.parameters("w k", positive=True)
    s = sd.System("slot", planar=True)
    mid, mass = s.add_body("mid"), s.add_body("mass", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, mid, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("across", mid, mass, y, axis=[0, 1]))
    s.add_force(mass, [-k * x, -k * y])
    s.add_constraint(y * sp.cos(w * sd.t) - x * sp.sin(w * sd.t), name="slot")
    s.add_output("seen", [x, y, x.dot, y.dot])
    s.add_output("felt", sd.acceleration(mass, (0, 0)))
    s.defaults = {w: 1.7, k: 5.0}
    return s.augmented().compile(backend="numpy")


@pytest.mark.every_value
@pytest.mark.parametrize("r", [0.0, 0.8])
@pytest.mark.parametrize("rate", [0.0, -0.6])
@pytest.mark.parametrize("t", [0.0, 0.3, 0.7])
def test_a_mass_in_a_turning_slot(t: float, r: float, rate: float) -> None:
    """r_ddot = (w^2 - k) r, seen in x = r cos w t: exactly right at u = 0, too. Linear, so that A does not depend on the state.

    x_ddot = -k x - 2 w^2 tan^2 x - 2 w tan x_dot with tan of w t; y = x tan, differentiated.
    """
    w, k = 1.7, 5.0
    c, s = math.cos(w * t), math.sin(w * t)
    at = {"x": r * c, "y": r * s, "x_dot": rate * c - r * w * s, "y_dot": rate * s + r * w * c}
    lin = slot().linearize(at, t=t, coordinates=["x"])
    tan, sec2 = s / c, 1 / c**2
    row = np.array([-k - 2 * w**2 * tan**2, -2 * w * tan])
    assert lin.states == ("x", "x_dot") and np.allclose(lin.A, [[0, 1], row], rtol=1e-9, atol=1e-9)
    y_ddot = np.array([2 * w**2 * sec2 * tan, 2 * w * sec2]) + tan * row
    expected = [[1, 0], [tan, 0], [0, 1], [w * sec2, tan], row, y_ddot]
    assert np.allclose(lin.C_out[:6], expected, rtol=1e-9, atol=1e-9)
    assert lin.outputs[:4] == ("seen[0]", "seen[1]", "seen[2]", "seen[3]") and lin.outputs[4:6] == ("felt[0]", "felt[1]")


def test_a_state_next_to_a_turning_slot_is_none() -> None:
    """At r = 0.8 it moves with the slot: a mass that stands still there is off the constraint's rate."""
    for at, t in (({"x": 0.8}, 0.0), ({"x": 0.8, "y_dot": 1.7 * 0.8}, 0.3), ({"y": 0.8}, 0.0)):
        with pytest.raises(ArgumentError, match=r"module\.consistent"):
            slot().linearize(at, t=t)


@pytest.mark.parametrize(("k", "verdict"), [(5.0, "neutral"), (1.0, "unstable")])
def test_stability_in_a_turning_slot_is_over_its_period(k: float, verdict: str) -> None:
    """exp(+- sqrt(w^2 - k) T) after a turn; x is no coordinate where the slot stands across it, which an error may name."""
    with pytest.raises(ArgumentError, match="stability"):
        slot().linearize({}, t=0.2, params={"k": k}).modes()
    period = 2 * math.pi / 1.7
    try:
        found = slot().stability({}, params={"k": k}, period=period)
    except ArgumentError as error:
        assert "independent coordinates" in str(error)
        return
    root = np.sqrt(complex(1.7**2 - k))
    expected = np.exp(np.array([root, -root]) * period)
    for value in expected:
        assert np.abs(np.asarray(found.multipliers) - value).min() < 1e-9 * max(1.0, abs(value))
    assert found.verdict == verdict and len(found.multipliers) == 2


# -- words


def test_the_five_words_of_a_pendulum_and_of_a_body() -> None:
    hanging = pendulum().equilibrium(start={"theta": 0.1})
    assert hanging.verdict == "neutral" and "neutral" in repr(hanging) and "stable" not in repr(hanging).replace("unstable", "")
    assert pendulum().equilibrium(start={"theta": 0.1}, params={"d": 0.2}).verdict == "stable"
    assert pendulum().equilibrium(start={"theta": 3.0}).verdict == "unstable"
    assert [pendulum().equilibrium(start={"theta": at}, params={"d": 0.2}).stable for at in (0.1, 3.0)] == [True, False]


@pytest.mark.parametrize("attitude", ["angles", "parameters"])
def test_a_free_body_drifts(attitude: str) -> None:
    """All twelve eigenvalues are zero, in six chains of two."""
    s = sd.System("adrift")
    body = s.add_body("body", mass=2, inertia=[1, 2, 3])
    q = "x y z e0 e1 e2 e3" if attitude == "parameters" else "x y z psi theta phi"
    s.add_joint(sd.Free("free", s.ground, body, sd.coordinates(q),
                        sd.EulerParameters() if attitude == "parameters" else sd.EulerAngles("ZYX")))
    lin = s.embedding().compile(backend="numpy").linearize()
    assert lin.A.shape == (12, 12) and not (lin.A @ lin.A).any() and np.linalg.matrix_rank(lin.A) == 6
    assert lin.verdict == "drifts" and all(m.kind == "zero" for m in lin.modes())


def test_a_damped_free_mass_is_neutral() -> None:
    """Its position does not come back and does not run away: one zero, no chain."""
    d = sd.parameters("d", positive=True)
    lin = slider(-d * Q.dot, 1, "sliding", d=2.0).linearize({"q": 0.3})
    assert lin.verdict == "neutral" and sorted(lin.eigenvalues.real) == pytest.approx([-2, 0])


def test_two_like_oscillators_that_drive_each_other_drift() -> None:
    """a_ddot + 9 a = 0 and b_ddot + 9 b = a: a Jordan block of +-3 i, whose real parts rounding may hide."""
    a, b = sd.coordinates("a b")
    c = sd.parameters("c")
    s = sd.System("resonance", planar=True)
    for q, force in ((a, -9 * a), (b, -9 * b + c * a)):
        s.add_joint(sd.Prismatic(f"rail_{q}", s.ground, s.add_body(f"mass_{q}", mass=1), q, axis=[1, 0]))
        s.add_joint_force(f"rail_{q}", force)
    s.defaults = {c: 1.0}
    module = s.embedding().compile(backend="numpy")
    assert module.linearize({}, params={"c": 1.0}).verdict in ("drifts", "not decided")
    assert module.linearize({}, params={"c": 0.0}).verdict == "neutral"


def test_overdamped_modes_print_their_time_constants() -> None:
    """lambda^2 + 10 lambda + 16 = 0: 0.5 s and 0.125 s, no frequency."""
    d = sd.parameters("d", positive=True)
    module = slider(-16 * Q - d * Q.dot, 1, "overdamped", d=10.0)
    modes = module.linearize(module.equilibrium()).modes()
    table = repr(modes)
    assert sorted(m.eigenvalue.real for m in modes) == pytest.approx([-8, -2], rel=1e-12)
    assert "time constant" in table and "0.5" in table and "0.125" in table
    assert f"{2 / (2 * math.pi):.3g}" not in table and f"{8 / (2 * math.pi):.3g}" not in table
    swinging = module.linearize(module.equilibrium(params={"d": 1.0})).modes()
    assert "f [Hz]" in repr(swinging)


# -- a governor with a loop


@functools.cache
def governor() -> Any:
    """Watt's governor: two massless arms l with balls m on a shaft, two rods l from the balls to a sleeve M: loops.

    beta1, beta2 are the angles of the arms from the downward vertical, s the height of the sleeve.
    """
    phi, s_, b1, b2 = sd.coordinates("phi s beta1 beta2")
    m, M, l, g = sd.parameters("m M l g", positive=True)
    s = sd.System("watt", gravity=[0, 0, -g])
    shaft, sleeve = s.add_body("shaft", mass=1, inertia=[1, 1, 1]), s.add_body("sleeve", mass=M)
    s.add_joint(sd.Revolute("foot", s.ground, shaft, phi))
    s.add_joint(sd.Prismatic("guide", shaft, sleeve, s_, axis=[0, 0, 1]))
    for k, (q, side) in enumerate(((b1, 1), (b2, -1)), 1):
        arm = s.add_body(f"arm{k}", mass=m, com=[0, 0, -l])
        s.add_joint(sd.Revolute(f"hinge{k}", shaft, arm, q, axis=[0, -side, 0]))
        s.close_loop(sd.Rod(f"rod{k}", sleeve, arm, l, child_point=[0, 0, -l]))
    s.defaults = {m: 1.5, M: 4.0, l: 0.3, g: 9.81}
    s.initial = {b1: 0.8, b2: 0.8, s_: -0.6 * math.cos(0.8)}
    return s.augmented().compile(backend="numpy")


def watt(W: float, m: Any = 1.5, M: Any = 4.0, l: Any = 0.3, g: Any = 9.81) -> tuple[Any, Any]:
    """cos beta = (m + M) g / (m l W^2), and the square of its frequency with the speed held: m W^2 s^2 / (m + 2 M s^2).

    From T = m l^2 (beta_dot^2 + W^2 sin^2 beta) + 2 M l^2 sin^2 beta beta_dot^2 and V = -2 (m + M) g l cos beta.
    Source: Pontryagin, Ordinary Differential Equations, section 27, without its friction.
    """
    cos = (m + M) * g / (m * l * W**2)
    sin2 = 1 - cos**2
    return cos, m * W**2 * sin2 / (m + 2 * M * sin2)


@pytest.mark.parametrize("W", [12.0, -15.0, *swept([15.0, 30.0])])
def test_a_governor_with_loops_in_steady_rotation(W: float) -> None:
    """Everything can be asked of it and printed."""
    cos, squared = watt(W)
    module = governor()
    beta = math.acos(cos) * 0.95
    start = {"beta1": beta, "beta2": beta, "s": -0.6 * math.cos(beta)}
    e = module.equilibrium(fixed={"phi_dot": W}, start=start)
    assert np.isclose(math.cos(e["beta1"]), cos, rtol=1e-12) and np.isclose(e["beta2"], e["beta1"], rtol=1e-12)
    assert e.verdict == "neutral" and e.stable is not False and "phi_dot" in e.held and "held" in repr(e)
    lin = module.linearize(e)
    (mode,) = [m for m in lin.modes() if m.kind != "zero"]
    assert np.isclose(mode.omega**2, squared, rtol=1e-9) and mode.kind == "oscillation"
    for text in (repr(lin), repr(lin.modes()), repr(mode), str(e), repr(module.stability(e))):
        assert text
    M = sp.Symbol("M", positive=True)
    slope = float(sp.diff(sp.sqrt(watt(W, M=M)[1]), M).subs(M, 4.0))
    index = [m.kind for m in lin.modes()].index("oscillation")
    found = lin.derivative(index, "M")
    assert np.isclose(found.frequency * 2 * math.pi, slope, rtol=1e-9)


def test_the_catalogues_governor_with_rods_prints_in_steady_rotation() -> None:
    module = systems.flyball_governor("rods").augmented().compile(backend="numpy")
    q, _ = module.consistent(keep=["beta1", "beta2"])
    e = module.equilibrium(fixed={"phi_dot": 2 * math.pi}, start=dict(zip(module.metadata.q, q, strict=True)))
    lin = module.linearize(e)
    assert repr(e) and repr(lin) and repr(lin.modes()) and e.verdict in ("neutral", "unstable")
    assert isinstance(e.stable, bool) or e.stable is None
    at = e.params[module.metadata.parameters.index("m_b")]

    def eigenvalue(value: float) -> complex:
        near = module.equilibrium(fixed={"phi_dot": 2 * math.pi}, start=e, params={"m_b": value})
        return module.linearize(near).modes()[len(lin.modes()) - 1].eigenvalue

    expected = richardson(eigenvalue, at, 1e-3 * at)
    assert abs(lin.derivative(len(lin.modes()) - 1, "m_b").eigenvalue - expected) < 1e-7 * abs(expected)


def test_linear_matrices_of_a_state_in_motion_are_there_without_modes() -> None:
    """Along a motion A is the derivative of the flow; modes and verdicts of it raise, with the reason."""
    module = sprung_arm()
    lin = module.linearize(([0.3, 1.2], [0.5, -0.2]))
    assert np.allclose(lin.A, module.jacobian(0.0, [0.3, 1.2, 0.5, -0.2]).x, rtol=1e-12, atol=1e-12)
    for ask in (lambda: lin.eigenvalues, lin.modes, lambda: lin.verdict, lambda: lin.derivative(0, "k")):
        with pytest.raises(ArgumentError):
            ask()
    assert scipy.linalg.norm(lin.A) > 0
