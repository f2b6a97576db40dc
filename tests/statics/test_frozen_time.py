"""Steady and periodic motions whose linear equations change along them, against closed forms in the fixed frame.

Eigenvalues of a matrix that is frozen at one instant decide nothing here. The compared numbers are exponents and multipliers over
a period, with the frequency in the fixed frame.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from scipy.special import mathieu_a, mathieu_b

import symdyn as sd
from symdyn.errors import ArgumentError, NoEquilibrium
from tests.helpers import swept

# -- what the tests share


def upper(values: Any, level: float = 1e-6) -> np.ndarray:
    """Eigenvalues with positive imaginary part of each pair, by frequency."""
    kept = np.asarray(values)[np.asarray(values).imag > level]
    return kept[np.argsort(kept.imag)]


def assert_alike(found: Any, expected: Any, relative: float = 1e-9) -> None:
    """Two sets of complex numbers are the same, up to a part of the largest."""
    left, expected = list(np.atleast_1d(found).astype(complex)), np.atleast_1d(expected).astype(complex)
    assert len(left) == len(expected)
    size = np.abs(expected).max(initial=1e-300)
    for value in expected:
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left.pop(nearest) - value) <= relative * size


def second_order(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Eigenvalues of M x_ddot + C x_dot + K x = 0."""
    n = len(M)
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
    return scipy.linalg.eig(whole, scipy.linalg.block_diag(np.eye(n), M))[0]


# -- a rigid rotor on two springs

MASS, ACROSS, ALONG = 10.0, 0.25, 0.4
BEARINGS = ((-0.2, 4500.0), (0.3, 2000.0))  # place on the axis, m; stiffness, N/m


@functools.cache
def free_rotor(attitude: str) -> Any:
    """A body on sd.Free as it comes; its axis is z, or for "angles", whose last turn is about x, x."""
    s = sd.System(f"rotor_{attitude}")
    along = 0 if attitude == "rates" else 2
    inertia = [ACROSS] * 3
    inertia[along] = ALONG
    body = s.add_body("rotor", mass=MASS, inertia=inertia)
    if attitude == "parameters":
        s.add_joint(sd.Free("free", s.ground, body, sd.coordinates("x y z e0 e1 e2 e3"), sd.EulerParameters()))
    else:
        orientation = {"angles": sd.EulerAngles("ZYX", "body"), "rates": None, "first": None}[attitude]
        s.add_joint(sd.Free("free", s.ground, body, sd.coordinates("x y z psi theta phi"), orientation))
    for place, stiffness in BEARINGS:
        at = [0, 0, 0]
        at[along] = place
        s.add_spring_damper(s.ground, body, point_a=at, point_b=at, stiffness=stiffness)
    return s.embedding().compile()


SPEED = {"parameters": "omega_z_free", "angles": "omega_z_free", "rates": "phi_dot", "first": "psi_dot"}


def isotropic(W: float) -> np.ndarray:
    """Frequencies of whirl, rad/s, from one complex equation each for position and tilt of the axis, by the roots of

        (alpha - w^2) (gamma - w^2 + p w) - delta = 0,  p = W ALONG / ACROSS
    w > 0 goes round with positive turning, w < 0 against it; and the axial sqrt(alpha).
    """
    alpha = sum(k for _, k in BEARINGS) / MASS
    gamma = sum(k * a**2 for a, k in BEARINGS) / ACROSS
    delta = sum(k * a for a, k in BEARINGS)**2 / (MASS * ACROSS)
    p = W * ALONG / ACROSS
    return np.array([*np.roots([1, -p, -(alpha + gamma), alpha * p, alpha * gamma - delta]).real, math.sqrt(alpha)])


def test_the_closed_form_of_the_rotor_gives_the_known_frequencies() -> None:
    """2.003, 4.023, 4.123, 17.382 Hz at 60 rad/s, not 4.010, 4.026, 7.855, 11.658 as in axes of both kinds; axial 4.058."""
    assert np.allclose(np.sort(np.abs(isotropic(60.0))) / (2 * np.pi), [2.003, 4.023, 4.058, 4.123, 17.382], atol=5e-4)


@pytest.mark.every_value
@pytest.mark.parametrize("W", [60.0, -60.0, *swept([7.0])])
@pytest.mark.parametrize("attitude", ["parameters", "angles", *swept(["rates"]), "first"])
def test_a_rotor_on_a_free_joint_has_the_frequencies_of_the_fixed_frame(attitude: str, W: float) -> None:
    """Its coordinates do not matter; nothing is damped, so that it is neutral."""
    found = free_rotor(attitude).stability(fixed={SPEED[attitude]: W})
    assert_alike(upper(found.exponents).imag, np.abs(isotropic(W)))
    assert np.abs(np.real(found.exponents)).max() < 1e-7 and found.verdict == "neutral"
    assert "fixed frame" in repr(found)


@pytest.mark.parametrize("attitude", [*swept(["parameters", "angles", "rates"]), "first"])
def test_the_campbell_diagram_of_a_free_rotor_is_of_the_fixed_frame(attitude: str) -> None:
    """At positive and negative speeds; with frame="rotating", position and tilt are seen from the turning axes, at |w - W|."""
    speeds = np.array([-60.0, -7.0, 7.0, 60.0])
    diagram = free_rotor(attitude).campbell(SPEED[attitude], speeds)
    for W, modes in zip(speeds, diagram.modes, strict=True):
        assert_alike([m.omega for m in modes if m.kind != "zero"], np.abs(isotropic(W)))
        assert all(m.kind in ("oscillation", "zero") for m in modes)
    turned = free_rotor(attitude).campbell(SPEED[attitude], [60.0], frame="rotating")
    *whirls, axial = isotropic(60.0)
    assert_alike([m.omega for m in turned.modes[0] if m.kind != "zero"], [*np.abs(np.array(whirls) - 60.0), axial])


def test_forward_and_backward_keep_their_meaning_at_negative_speeds() -> None:
    """At -60 rad/s the same mode has the same frequency: what goes round with the rotor still does."""
    diagram = free_rotor("parameters").campbell("omega_z_free", [60.0])
    back = free_rotor("parameters").campbell("omega_z_free", [-60.0])
    there = {n: f for n, f in zip(diagram.names, diagram.frequencies[0], strict=True) if f > 0.1}
    assert there == pytest.approx({n: f for n, f in zip(back.names, back.frequencies[0], strict=True) if f > 0.1}, rel=1e-9)
    fastest = max(there, key=lambda n: there[n])
    assert "forward" in fastest and np.isclose(there[fastest], 17.382, atol=5e-4)
    slowest = min(there, key=lambda n: there[n])
    assert "backward" in slowest and np.isclose(there[slowest], 2.003, atol=5e-4)


def test_the_axis_of_a_campbell_diagram_names_its_frame() -> None:
    pytest.importorskip("matplotlib")
    module = free_rotor("angles")
    for frame in ("fixed", "rotating"):
        axes = module.campbell("omega_z_free", [10.0, 20.0], frame=frame).plot().axes[0]
        assert frame in axes.get_ylabel()
    with pytest.raises(ArgumentError, match="frame"):
        module.campbell("omega_z_free", [10.0], frame="body")


def test_the_simulation_of_a_free_rotor_has_these_frequencies() -> None:
    """Two seconds of its position, from a disturbance of 1e-6, are a sum of the five oscillations and of nothing else."""
    module = free_rotor("parameters")
    t = np.linspace(0, 2, 801)
    sol = module.simulate(t, q=[1e-6, 2e-6, 1e-6, 1, 0, 0, 0], u=[1e-5, 0, 0, 3e-5, -2e-5, 60], rtol=1e-12, atol=1e-17)
    basis = np.hstack([f(np.outer(t, np.abs(isotropic(60.0)))) for f in (np.cos, np.sin)])
    for k in range(3):
        left = sol.q[:, k] - basis @ np.linalg.lstsq(basis, sol.q[:, k], rcond=None)[0]
        assert np.abs(left).max() < 1e-6 * np.abs(sol.q[:, k]).max()


# -- bearings that differ in x and y, external damping

DAMPED = {"k_x": (4500.0, 2000.0), "k_y": (3000.0, 2600.0), "c": (30.0, 20.0)}


@functools.cache
def damped_rotor(attitude: str) -> Any:
    """The same rotor on springs along x and y of the n-frame, with dampers to the ground."""
    s = sd.System(f"damped_rotor_{attitude}")
    body = s.add_body("rotor", mass=MASS, inertia=[ACROSS, ACROSS, ALONG])
    k_x, k_y, c = (sd.parameters(" ".join(f"{n}{i}" for i in (1, 2))) for n in ("k_x", "k_y", "c"))
    W = sd.speeds("w_x w_y w_z")
    x, y, z = sd.coordinates("x y z")
    speeds = [x.dot, y.dot, z.dot, *W]
    if attitude == "parameters":
        p = sd.coordinates("e0 e1 e2 e3")
        R = sd.rotation.from_parameters(p)
        s.add_joint(sd.Free("free", s.ground, body, [x, y, z, *p], sd.EulerParameters(), speeds=speeds))
    else:
        a = sd.coordinates("psi theta phi")
        R = sd.rotation.from_euler("ZYX", a)
        s.add_joint(sd.Free("free", s.ground, body, [x, y, z, *a], sd.EulerAngles("ZYX", "body"), speeds=speeds))
    R = sp.Matrix(R)
    for i, (place, _) in enumerate(BEARINGS):
        r = sp.Matrix([x, y, z]) + place * R[:, 2]
        v = sp.Matrix([x.dot, y.dot, z.dot]) + place * (R[:, 0] * W[1] - R[:, 1] * W[0])
        s.add_force(body, [-k_x[i] * r[0] - c[i] * v[0], -k_y[i] * r[1] - c[i] * v[1], -4000 * z - 40 * z.dot],
                    point=[0, 0, place])
        s.defaults |= {k_x[i]: DAMPED["k_x"][i], k_y[i]: DAMPED["k_y"][i], c[i]: DAMPED["c"][i]}
    return s.embedding().compile()


def anisotropic(W: float, damped: bool = True) -> np.ndarray:
    """Eigenvalues in the fixed frame: x, y, and turning a, b about x and y, with the moments of a gyroscope ALONG W.

    The bearing at s moves by x + s b and y - s a; ACROSS a_ddot + ALONG W b_dot and ACROSS b_ddot - ALONG W a_dot.
    """
    M = np.diag([MASS, MASS, ACROSS, ACROSS])
    C, K = np.zeros((4, 4)), np.zeros((4, 4))
    for i, (s, _) in enumerate(BEARINGS):
        along_x, along_y = np.array([1, 0, 0, s]), np.array([0, 1, -s, 0])
        K += DAMPED["k_x"][i] * np.outer(along_x, along_x) + DAMPED["k_y"][i] * np.outer(along_y, along_y)
        C += damped * DAMPED["c"][i] * (np.outer(along_x, along_x) + np.outer(along_y, along_y))
    C[2, 3] += ALONG * W
    C[3, 2] -= ALONG * W
    axial = np.roots([MASS, 80.0, 8000.0])
    return np.array([*second_order(M, C, K), *axial])


@pytest.mark.every_value
@pytest.mark.parametrize("W", [25.0, -60.0, *swept([60.0])])
@pytest.mark.parametrize("attitude", ["parameters", "angles"])
def test_a_damped_rotor_on_unlike_bearings_decays(attitude: str, W: float) -> None:
    """Floquet exponents in turning axes are the eigenvalues in the fixed frame, and no attitude makes it unstable."""
    found = damped_rotor(attitude).stability(fixed={"w_z": W})
    expected = anisotropic(W)
    assert expected.real.max() < -0.5
    assert_alike(upper(found.exponents), upper(expected))
    assert found.verdict in ("stable", "neutral") and np.real(found.exponents).max() < 1e-8


@functools.cache
def turned_place() -> Any:
    """A mass with its position in turning axes, on springs fixed in the n-frame, k_x along x and k_y along y."""
    phi, a, b = sd.coordinates("phi a b")
    m, k_x, k_y = sd.parameters("m k_x k_y", positive=True)
    s = sd.System("turned_place", planar=True)
    wheel, mid, mass = s.add_body("wheel", inertia=1), s.add_body("mid"), s.add_body("mass", mass=m)
    s.add_joint(sd.Revolute("spin", s.ground, wheel, phi))
    s.add_joint(sd.Prismatic("first", wheel, mid, a, axis=[1, 0]))
    s.add_joint(sd.Prismatic("second", mid, mass, b, axis=[0, 1]))
    s.add_force(mass, [-k_x * (a * sp.cos(phi) - b * sp.sin(phi)), -k_y * (a * sp.sin(phi) + b * sp.cos(phi))])
    s.defaults = {m: 2.0, k_x: 50.0, k_y: 338.0}
    return s.embedding().compile()


@pytest.mark.parametrize("W", [4.0, *swept([9.0, 30.0]), -9.0])
def test_turning_axes_change_nothing_for_a_mass_on_fixed_springs(W: float) -> None:
    """5 and 13 rad/s at every speed of the axes, and no instability where the frozen stiffness is negative."""
    found = turned_place().stability(fixed={"phi_dot": W})
    assert_alike(upper(found.exponents).imag, [5.0, 13.0])
    assert found.verdict == "neutral"


# -- a shaft that is not round


@functools.cache
def shaft(axes: str, turning: str) -> Any:
    """A unit mass on a shaft with the stiffness 100 and 144 N/m along two turning axes.

    axes      "fixed": its position is x, y of the n-frame; "turning": a, b along the axes of the stiffness
    turning   "held": phi is a coordinate whose speed is held; "prescribed": it is W t
    """
    phi = sd.coordinates("phi")
    W = sd.parameters("W", positive=True)
    a, b = sd.coordinates("a b") if axes == "turning" else sd.coordinates("x y")
    s = sd.System(f"shaft_{axes}_{turning}", planar=True)
    angle = phi if turning == "held" else W * sd.t
    parent = s.ground
    if turning == "held" or axes == "turning":
        wheel = s.add_body("wheel", inertia=1)
        s.add_joint(sd.Revolute("spin", s.ground, wheel, angle))
        parent = wheel if axes == "turning" else s.ground
    mid, disc = s.add_body("mid"), s.add_body("disc", mass=1)
    s.add_joint(sd.Prismatic("first", parent, mid, a, axis=[1, 0]))
    s.add_joint(sd.Prismatic("second", mid, disc, b, axis=[0, 1]))
    if axes == "turning":
        s.add_joint_force("first", -100 * a)
        s.add_joint_force("second", -144 * b)
    else:
        c, n = sp.cos(angle), sp.sin(angle)
        along, across = -100 * (c * a + n * b), -144 * (c * b - n * a)
        s.add_force(disc, [c * along - n * across, n * along + c * across])
    s.defaults = {W: 11.0} if turning == "prescribed" else {}
    return s.embedding().compile()


def asked(module: Any, W: float) -> Any:
    """Stability at W: of a speed that is held, or of a prescribed rotation."""
    if "phi" in module.metadata.q:
        return module.stability(fixed={"phi_dot": W})
    return module.stability(params={"W": W}, period=2 * math.pi / W)


def unround(W: float) -> np.ndarray:
    """In turning axes lambda^4 + (244 + 2 W^2) lambda^2 + (100 - W^2) (144 - W^2) = 0."""
    squares = np.roots([1, 244 + 2 * W**2, (100 - W**2) * (144 - W**2)])
    roots = np.sqrt(squares.astype(complex))
    return np.array([*roots, *-roots])


SHAFTS = swept([("fixed", "held"), ("fixed", "prescribed"), ("turning", "held"), ("turning", "prescribed")],
               ("fixed", "held"), ("turning", "prescribed"))


@pytest.mark.every_value
@pytest.mark.parametrize(("axes", "turning"), SHAFTS)
@pytest.mark.parametrize("W", [3.0, 11.0, *swept([9.5, 10.5, 11.9, 12.5, 40.0])])
def test_a_shaft_that_is_not_round_is_unstable_between_its_two_critical_speeds(axes: str, turning: str, W: float) -> None:
    """10 and 12 rad/s; the rate of growth and every multiplier over a turn are those of the turning axes."""
    found = asked(shaft(axes, turning), W)
    expected = unround(W)
    assert found.verdict == ("unstable" if 10 < W < 12 else "neutral")
    assert abs(np.real(found.exponents).max() - expected.real.max()) < 1e-9 * W
    turn = 2 * math.pi / W
    left = list(np.exp(np.asarray(found.exponents) * turn))
    for value in np.exp(expected * turn):
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left.pop(nearest) - value) < 1e-9 * max(1.0, abs(value))


@pytest.mark.parametrize(("axes", "turning"), SHAFTS)
def test_the_critical_speeds_of_a_shaft_are_met_to_a_millionth(axes: str, turning: str) -> None:
    """Within 1e-6 rad/s of them its verdicts differ."""
    for edge, inside in ((10.0, 1), (12.0, -1)):
        assert asked(shaft(axes, turning), edge + inside * 1e-6).verdict == "unstable"
        assert asked(shaft(axes, turning), edge - inside * 1e-6).verdict == "neutral"


def test_a_frozen_matrix_of_a_shaft_has_no_eigenvalues() -> None:
    """In fixed axes its linear equations hold along the motion, but are not constant; the message names the call that helps."""
    module = shaft("fixed", "held")
    lin = module.linearize({"phi_dot": 11.0}, hold=["phi_dot"])
    assert np.isfinite(lin.A).all() and "phi_dot" in lin.held
    for ask in (lambda: lin.eigenvalues, lin.modes, lambda: lin.verdict):
        with pytest.raises(ArgumentError, match="stability"):
            ask()
    driven = shaft("fixed", "prescribed").linearize(t=0.3)
    assert np.allclose(np.sort(np.linalg.eigvals(-driven.A[2:, :2])), [100, 144], rtol=1e-12)
    with pytest.raises(ArgumentError, match="stability"):
        driven.modes()


def test_no_equilibrium_of_a_shaft_is_called_stable() -> None:
    for axes in ("fixed", "turning"):
        found = shaft(axes, "held").equilibrium(fixed={"phi_dot": 11.0})
        assert found.verdict == "unstable" and found.stable is False and "phi_dot" in found.held


def test_the_simulation_of_a_shaft_that_is_not_round_grows_as_its_exponent_says() -> None:
    """In 26 s from 1e-10 m by more than 1e10; over the last turn by exp(lambda T)."""
    module = shaft("fixed", "prescribed")
    turn, rate = 2 * math.pi / 11.0, unround(11.0).real.max()
    sol = module.simulate(np.array([0.0, 45 * turn, 46 * turn]), q={"x": 1e-10}, rtol=1e-12, atol=1e-22)
    assert np.linalg.norm(sol.q[-1]) > 1e10 * 1e-10
    assert np.isclose(np.linalg.norm(sol.q[-1]) / np.linalg.norm(sol.q[-2]), math.exp(rate * turn), rtol=1e-9)
    assert abs(np.real(asked(module, 11.0).exponents).max() - rate) < 1e-9


# -- a pendulum whose pivot shakes


@functools.cache
def shaken() -> Any:
    """theta from the downward vertical, the pivot at H cos(2 t) upward, a torsion damper d."""
    theta = sd.coordinates("theta")
    g, H, d = sd.parameters("g H d")
    s = sd.System("shaken", gravity=[0, -g])
    s.move_ground([0, H * sp.cos(2 * sd.t)])
    bob = s.add_body("bob", mass=1, com=[0, -1])
    hinge = s.add_joint(sd.Revolute("hinge", s.ground, bob, theta))
    s.add_joint_force(hinge, -d * theta.dot)
    s.defaults = {g: 9.81, H: 0.1, d: 0.0}
    return s.embedding().compile()


def mathieu(a: float, q: float, d: float = 0.0) -> Any:
    """theta_ddot + d theta_dot + (g - 4 H cos 2 t) theta = 0 is Mathieu's equation with a = g and 2 q = 4 H."""
    return shaken().stability(params={"g": a, "H": q / 2, "d": d}, period=math.pi)


# Each edge of the chart with the side, +1 above it, on which the motion is bounded.
EDGES = [(mathieu_a, 0, 1), (mathieu_b, 1, -1), (mathieu_a, 1, 1), (mathieu_b, 2, -1), (mathieu_a, 2, 1), (mathieu_b, 3, -1)]


@pytest.mark.parametrize(("edge", "order", "bounded", "q"), swept(
    [(*edge, q) for edge in EDGES for q in (0.3, 1.0, 2.5) if edge[1] < 3 or q > 1],
    *[(*edge, q) for edge, q in zip(EDGES[:2], (1.0, 2.5), strict=True)]))
def test_the_edges_of_mathieus_chart_to_a_millionth(edge: Any, order: int, bounded: int, q: float) -> None:
    """Characteristic values a_n(q), b_n(q); the upright pendulum, a < 0, is held up between a_0 and b_1. Source: DLMF 28.2."""
    a = float(edge(order, q))
    at = mathieu(a, q)
    assert abs(np.real(np.sum(at.multipliers)) - 2 * (-1)**order) < 1e-9  # a double multiplier of 1 or -1
    assert mathieu(a + bounded * 1e-6, q).verdict == "neutral"
    assert mathieu(a - bounded * 1e-6, q).verdict == "unstable"


def test_the_upright_pendulum_is_held_up_by_shaking() -> None:
    """a = -0.3 lies between a_0(q) and b_1(q) at q = 1, above both at q = 1.3, below both at q = 0.5."""
    assert float(mathieu_a(0, 1.0)) < -0.3 < float(mathieu_b(1, 1.0))
    assert [mathieu(-0.3, q).verdict for q in (0.5, 1.0, 1.3)] == ["unstable", "neutral", "unstable"]


@pytest.mark.parametrize(("a", "q"), [(3.0, 0.7), (1.0, 0.4), *swept([(-0.3, 1.0)])])
def test_damping_of_a_shaken_pendulum_is_in_the_product_of_its_multipliers(a: float, q: float) -> None:
    """exp(-d T). Source: Liouville's formula. Where Mathieu's equation is bounded, damping makes it stable."""
    d = 0.05
    found = mathieu(a, q, d)
    assert np.isclose(np.prod(found.multipliers), math.exp(-d * math.pi), rtol=1e-9)
    # theta = exp(-d t / 2) y with a - d^2 / 4 in Mathieu's equation.
    inner = mathieu(a - d**2 / 4, q)
    assert_alike(found.multipliers, np.exp(-d * math.pi / 2) * inner.multipliers)
    assert found.verdict == {(3.0, 0.7): "stable", (1.0, 0.4): "unstable", (-0.3, 1.0): "stable"}[a, q]


def test_a_motion_that_time_enters_needs_a_period() -> None:
    with pytest.raises(ArgumentError, match="period"):
        shaken().stability()
    with pytest.raises(ArgumentError, match="stability"):
        shaken().linearize(t=0.2).modes()
    # Not a period of the shaking: the forces are not what they were.
    with pytest.raises((ArgumentError, NoEquilibrium), match="period"):
        shaken().stability(period=2.0)


# -- ground resonance

HUB = {"M": 10.0, "J": 1.0, "m": 1.5, "e": 0.3, "r": 1.2, "k_h": 900.0, "k_b": 4.0}


@functools.cache
def helicopter(n: int) -> Any:
    """A hub on springs along x and y, its rotor about z, n blades on lag hinges with springs, gravity along -g of y."""
    x, y, psi = sd.coordinates("x y psi")
    lag = sd.coordinates(f"b1:{n + 1}")
    M, J, m, e, r, k_h, k_b, d, g = sd.parameters("M J m e r k_h k_b d g")
    s = sd.System(f"helicopter_{n}", gravity=[0, -g])
    frame, hub, wheel = s.add_body("frame"), s.add_body("hub", mass=M), s.add_body("wheel", inertia=J)
    for joint, q in ((sd.Prismatic("sway", s.ground, frame, x, axis=[1, 0]), x),
                     (sd.Prismatic("lift", frame, hub, y, axis=[0, 1]), y)):
        s.add_joint_force(s.add_joint(joint), -k_h * q - d * q.dot)
    s.add_joint(sd.Revolute("spin", hub, wheel, psi))
    for k, q in enumerate(lag):
        at = 2 * sp.pi * k / n
        c, z = sp.cos(at), sp.sin(at)
        blade = s.add_body(f"blade{k + 1}", mass=m, com=[r, 0])
        hinge = s.add_joint(sd.Revolute(f"lag{k + 1}", wheel, blade, q, parent_point=[c * e, z * e],
                                        parent_rotation=[[c, -z, 0], [z, c, 0], [0, 0, 1]]))
        s.add_joint_force(hinge, -k_b * q)
    s.defaults = {M: HUB["M"], J: HUB["J"], m: HUB["m"], e: HUB["e"], r: HUB["r"], k_h: HUB["k_h"], k_b: HUB["k_b"], d: 0, g: 0}
    return s.embedding().compile()


def coleman(n: int, W: float) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of hub and cyclic lag in the fixed frame, and those of the n - 2 lag motions that do not move the hub.

    Blade k: I b_ddot + kappa b + S (y_ddot cos psi_k - x_ddot sin psi_k) = 0, S = m r, I = m r^2, kappa = k_b + W^2 S e; hub:
    its total mass times x_ddot + k_h x = S d^2/dt^2 sum b_k sin psi_k, and likewise y with - cos.
    Source: Coleman and Feingold, NACA report 1351, 1958; derived by hand for this mechanism.
    """
    p = HUB
    S, I, total, half = p["m"] * p["r"], p["m"] * p["r"]**2, p["M"] + n * p["m"], n / 2
    kappa = p["k_b"] + W**2 * S * p["e"]
    M = np.diag([total, total, half * I, half * I])
    M[0, 3] = M[3, 0] = -half * S
    M[1, 2] = M[2, 1] = half * S
    C = np.zeros((4, 4))
    C[2, 3], C[3, 2] = 2 * half * I * W, -2 * half * I * W
    K = np.diag([p["k_h"], p["k_h"], half * (kappa - I * W**2), half * (kappa - I * W**2)])
    own = 1j * math.sqrt(kappa / I)
    return second_order(M, C, K), np.array([own, -own] * (n - 2))


RESONANT, QUIET = (11.5, 13.0), (2.0, 7.0, 9.5)


@pytest.mark.every_value
@pytest.mark.parametrize("W", [RESONANT[0], QUIET[0], -13.0, *swept([RESONANT[1], *QUIET[1:], -7.0])])
@pytest.mark.parametrize("n", [3, 4])
def test_ground_resonance_without_naming_the_blades(n: int, W: float) -> None:
    """Growth, frequencies and multipliers are those of Coleman's equations; the hub's coordinates define the fixed frame."""
    found = helicopter(n).stability(fixed={"psi_dot": W})
    coupled, alone = coleman(n, W)
    assert (coupled.real.max() > 0.1) == (abs(W) in RESONANT)
    assert found.verdict == ("unstable" if abs(W) in RESONANT else "neutral")
    assert abs(np.real(found.exponents).max() - coupled.real.max()) < 1e-8
    turn = 2 * math.pi / abs(W)
    left = list(np.exp(np.asarray(found.exponents) * turn))
    for value in np.exp(np.array([*coupled, *alone]) * turn):
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left.pop(nearest) - value) < 1e-8 * max(1.0, abs(value))
    for value in upper(coupled):
        assert np.abs(np.asarray(found.exponents) - value).min() < 1e-8 * abs(value)


@pytest.mark.parametrize("order", [("b1", "b2", "b3", "b4"), ("b1", "b3", "b2", "b4"),
                                   pytest.param(("b2", "b1", "b3", "b4"), marks=pytest.mark.sweep)])
def test_blades_in_another_order_are_not_believed(order: tuple[str, ...]) -> None:
    """Multi-blade coordinates of blades that do not follow each other make nothing constant: the same verdict, or an error."""
    expected = upper(coleman(4, 12.0)[0])
    try:
        (modes,) = helicopter(4).campbell("psi_dot", [12.0], blades=[order]).modes
    except ArgumentError as error:
        assert order != ("b1", "b2", "b3", "b4") and "blades" in str(error)
    else:
        for value in expected:
            assert np.abs(modes.eigenvalues - value).min() < 1e-8 * abs(value)
        assert any(m.kind == "unstable" for m in modes)


@pytest.mark.parametrize("n", [3, *swept([4])])
def test_campbell_diagram_of_a_helicopter_at_negative_speeds(n: int) -> None:
    """A mode keeps its name and its frequency where the rotor turns the other way round."""
    blades = [tuple(f"b{k + 1}" for k in range(n))]
    ahead, back = (helicopter(n).campbell("psi_dot", [W], blades=blades) for W in (3.0, -3.0))
    assert dict(zip(ahead.names, ahead.frequencies[0], strict=True)) == pytest.approx(
        dict(zip(back.names, back.frequencies[0], strict=True)), rel=1e-9)


# -- weight in the plane of a rotor


@functools.cache
def flexible_shaft() -> Any:
    """A disc on a round shaft, position a, b in turning axes, internal damping d, its weight along -y of the n-frame."""
    phi, a, b = sd.coordinates("phi a b")
    k, d, g = sd.parameters("k d g")
    s = sd.System("flexible_shaft", gravity=[0, -g])
    wheel, mid, disc = s.add_body("wheel", inertia=1), s.add_body("mid"), s.add_body("disc", mass=2)
    s.add_joint(sd.Revolute("spin", s.ground, wheel, phi))
    s.add_joint_force(s.add_joint(sd.Prismatic("first", wheel, mid, a, axis=[1, 0])), -k * a - d * a.dot)
    s.add_joint_force(s.add_joint(sd.Prismatic("second", mid, disc, b, axis=[0, 1])), -k * b - d * b.dot)
    s.defaults = {k: 200.0, d: 0.0, g: 9.81}
    return s.embedding().compile()


def sagging(W: float, d: float) -> complex:
    """In the fixed frame Z = x + i y rests where k Z + d (Z_dot - i W Z) = -i m g."""
    return -2j * 9.81 / (200 - 1j * W * d)


def whirling(W: float, d: float) -> np.ndarray:
    """m Z_ddot + d (Z_dot - i W Z) + k Z = 0 and its conjugate: internal damping makes it unstable above W = sqrt(k / m)."""
    roots = np.roots([2, d, 200 - 1j * W * d])
    return np.array([*roots, *roots.conj()])


@pytest.mark.parametrize(("W", "d"), [
    (4.0, 0.0), (-25.0, 3.0), *swept([(4.0, 3.0), (10.1, 3.0), (9.9, 3.0), (25.0, 3.0), (-6.0, 3.0)])])
def test_weight_in_the_plane_of_a_rotor_makes_a_periodic_motion(W: float, d: float) -> None:
    """There is no equilibrium in turning axes, and the message names the call; the motion there goes round once a turn."""
    module = flexible_shaft()
    with pytest.raises(NoEquilibrium, match="stability"):
        module.equilibrium(fixed={"phi_dot": W}, params={"d": d})
    found = module.stability(fixed={"phi_dot": W}, params={"d": d})
    assert found.kind == "periodic motion" and np.isclose(found.period, 2 * math.pi / abs(W), rtol=1e-12)
    t, x = found.motion
    order = [module.metadata.x.index(n) for n in ("phi", "a", "b")]
    place = (x[:, order[1]] + 1j * x[:, order[2]]) * np.exp(1j * x[:, order[0]])
    assert len(t) > 8 and np.abs(place - sagging(W, d)).max() < 1e-9 * abs(sagging(W, d))
    expected = whirling(W, d)
    assert_alike(upper(found.exponents), upper(expected))
    assert_alike(found.multipliers, np.exp(np.asarray(found.exponents) * found.period))
    growth = expected.real.max()
    assert found.verdict == ("neutral" if not d else "unstable" if growth > 0 else "stable")
    assert not d or (growth > 0) == (abs(W) > 10)


def test_without_weight_the_rotor_is_at_rest_in_turning_axes() -> None:
    """The same exponents, from a steady motion: in turning axes lambda - i W."""
    module = flexible_shaft()
    rest = module.equilibrium(fixed={"phi_dot": 25.0}, params={"d": 3.0, "g": 0.0})
    assert rest.verdict == "unstable" and np.abs(rest.q[1:]).max() < 1e-12
    turned = module.linearize(rest).eigenvalues
    roots = np.roots([2, 3, 200 - 75j]) - 25j
    values = np.array([*roots, *roots.conj()])
    for value in values:
        assert np.abs(turned - value).min() < 1e-9 * abs(value)
    found = module.stability(fixed={"phi_dot": 25.0}, params={"d": 3.0, "g": 0.0})
    assert found.kind == "steady motion" and found.verdict == "unstable"


@pytest.mark.parametrize("W", [3.0, *swept([12.0])])
def test_a_blade_that_swings_under_its_weight_comes_back_after_a_turn(W: float) -> None:
    """A heavy blade on a lag hinge; what is found is a motion of the simulation, and its multipliers those of its neighbours."""
    b = sd.coordinates("b")
    s = sd.System("blade", gravity=[0, -9.81])
    wheel, blade = s.add_body("wheel", inertia=1), s.add_body("blade", mass=1.5, com=[1.2, 0])
    s.add_joint(sd.Revolute("spin", s.ground, wheel, W * sd.t))
    s.add_joint_force(s.add_joint(sd.Revolute("lag", wheel, blade, b, parent_point=[0.3, 0])), -90 * b - 2 * b.dot)
    module = s.embedding().compile()
    found = module.stability(period=2 * math.pi / W)
    t, x = found.motion
    assert found.kind == "periodic motion" and np.ptp(x[:, 0]) > 1e-2
    assert np.isclose(t[-1] - t[0], found.period, rtol=1e-12) and np.abs(x[-1] - x[0]).max() < 1e-9
    h, start = 1e-5, x[0]
    columns = []
    for k in range(2):
        step = h * np.eye(2)[k]
        ends = [module.simulate((t[0], t[0] + found.period), (start + f * step)[:1], (start + f * step)[1:],
                                rtol=1e-12, atol=1e-14).x[-1] for f in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * h))
    assert_alike(found.multipliers, np.linalg.eigvals(np.array(columns).T), 1e-7)
    assert np.isclose(np.real(np.prod(found.multipliers)), math.exp(-2 / (1.5 * 1.44) * found.period), rtol=1e-8)
    assert found.verdict == "stable"
