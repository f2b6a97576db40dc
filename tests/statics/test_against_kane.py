"""Mechanisms of SymPy's own tests, at rest and along motions: A and B against `KanesMethod.linearize`, states mapped by hand."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from sympy.physics import mechanics as me
from sympy.physics.mechanics import models

import symdyn as sd
from tests.helpers import swept
from tests.runtime.test_modes import richardson

T = me.dynamicsymbols._t


class Peer:
    """KanesMethod with its linear equations in numbers.

    q, u    coordinates and speeds, the independent ones first; inputs: specified quantities by name
    """

    def __init__(self, kane: Any) -> None:
        self.kane = kane
        self.q, self.u = list(kane.q), list(kane.u)
        self.linearizer = kane.to_linearizer()
        self.inputs = [str(r.func) for r in self.linearizer.r]

    def linearize(self, q: Sequence[float], u: Sequence[float], params: Mapping[str, float],
                  inputs: Mapping[str, float] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """A and B of [independent q, independent u] at a motion, with the accelerations that it has there."""
        at = {**dict(zip(self.q, q, strict=True)), **dict(zip(self.u, u, strict=True)),
              **{sp.Symbol(n): v for n, v in params.items()}, **{me.dynamicsymbols(n): v for n, v in (inputs or {}).items()}}
        rates = {k: v.subs(at) for k, v in self.kane.kindiffdict().items()}
        mass, forcing = (np.array(me.msubs(m, rates, at), dtype=float) for m in (self.kane.mass_matrix, self.kane.forcing))
        accelerations = np.linalg.solve(mass, forcing).ravel()
        point = {**at, **rates, **{v.diff(T): a for v, a in zip(self.u, accelerations, strict=True)}}
        M, A, B = self.linearizer.linearize(op_point=point)
        M, A = np.array(M, dtype=float), np.array(A, dtype=float)
        B = np.array(B, dtype=float).reshape(len(M), len(self.inputs))
        P = np.array(self.linearizer.perm_mat, dtype=float).T
        return P @ np.linalg.solve(M, A), P @ np.linalg.solve(M, B)


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0.0) <= 1e-9 * max(1.0, np.abs(expected).max(initial=0.0))


# -- a pendulum in x and y


@functools.cache
def nonminimal() -> tuple[Any, Peer]:
    """A point mass at q1 along the weight and q2 across, on a rod L. Source: test_linearize_pendulum_kane_nonminimal."""
    q1, q2 = sd.coordinates("q1 q2")
    L, m = sd.parameters("L m", positive=True)
    s = sd.System("nonminimal", gravity=[9.8, 0])
    mid, bob = s.add_body("mid"), s.add_body("bob", mass=m)
    s.add_joint(sd.Prismatic("first", s.ground, mid, q1, axis=[1, 0]))
    s.add_joint(sd.Prismatic("second", mid, bob, q2, axis=[0, 1]))
    s.add_constraint(sp.sqrt(q1**2 + q2**2) - L, name="rod")
    s.defaults = {L: 1.3, m: 0.7}

    p, v = me.dynamicsymbols("q1:3"), me.dynamicsymbols("u1:3")
    length, mass = sp.symbols("L m")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", p[0] * N.x + p[1] * N.y)
    P.set_vel(N, v[0] * N.x + v[1] * N.y)
    rod = sp.sqrt(p[0]**2 + p[1]**2)
    kane = me.KanesMethod(N, q_ind=[p[1]], u_ind=[v[1]], q_dependent=[p[0]], u_dependent=[v[0]],
                          kd_eqs=[a.diff(T) - b for a, b in zip(p, v, strict=True)], configuration_constraints=[rod - length],
                          velocity_constraints=[(p[0] * v[0] + p[1] * v[1]) / rod])
    kane.kanes_equations([me.Particle("bob", P, mass)], [(P, mass * sp.Rational(98, 10) * N.x)])
    return s.augmented().compile(), Peer(kane)


@pytest.mark.parametrize(("angle", "rate"), [(0.0, 0.0), *swept([(0.4, 0.0), (0.4, 1.7), (-1.1, -0.6)]), (2.5, 3.0)])
def test_pendulum_in_two_coordinates(angle: float, rate: float) -> None:
    """At rest -9.8 / L, as SymPy's test has it; inclined and swinging what the manifold's curvature makes of it."""
    module, peer = nonminimal()
    L, c, s = 1.3, np.cos(angle), np.sin(angle)
    q, u = L * np.array([c, s]), L * rate * np.array([-s, c])
    lin = module.linearize((q, u), coordinates=["q2"])
    A, _ = peer.linearize(q[::-1], u[::-1], {"L": L, "m": 0.7})
    assert lin.states == ("q2", "q2_dot")
    assert_same(lin.A, A)
    if not angle and not rate:
        assert_same(lin.A, np.array([[0, 1], [-9.8 / L, 0]]))


# -- a rolling disc


@functools.cache
def disc() -> tuple[Any, Peer]:
    """Yaw q1, lean q2, spin q3, centre at q4, q5, q6, z down. Source: test_linearize_rolling_disc_kane."""
    q = sd.coordinates("q1:7")
    m, r, g = sd.parameters("m r g", positive=True)
    yaw, lean, spin = q[:3]
    s = sd.System("disc", gravity=[0, 0, g])
    body = s.add_body("disc", mass=m, inertia=[m * r**2 / 4, m * r**2 / 2, m * r**2 / 4])
    s.add_joint(sd.Free("free", s.ground, body, [*q[3:], *q[:3]], sd.EulerAngles("ZXY")))
    A, B = sp.rot_ccw_axis3(yaw), sp.rot_ccw_axis3(yaw) * sp.rot_ccw_axis1(lean)
    turning = yaw.dot * sp.Matrix([0, 0, 1]) + lean.dot * A[:, 0] + spin.dot * B[:, 1]
    slip = sp.Matrix([e.dot for e in q[3:]]) + turning.cross(r * B[:, 2])
    s.add_constraint(q[5] + r * sp.cos(lean), name="contact")
    s.add_constraint(slip[0], name="along x")
    s.add_constraint(slip[1], name="along y")
    s.defaults = {m: 1.4, r: 0.7, g: 9.81}

    p, u = me.dynamicsymbols("q1:7"), me.dynamicsymbols("u1:7")
    mass, radius, weight = sp.symbols("m r g")
    N, NO = me.ReferenceFrame("N"), me.Point("NO")
    NO.set_vel(N, 0)
    FA = N.orientnew("A", "Axis", [p[0], N.z])
    FB = FA.orientnew("B", "Axis", [p[1], FA.x])
    FC = FB.orientnew("C", "Axis", [p[2], FB.y])
    CO = NO.locatenew("CO", p[3] * N.x + p[4] * N.y + p[5] * N.z)
    by_rates, carrier, moving = FC.ang_vel_in(N), FB.ang_vel_in(N), CO.pos_from(NO).dt(N)
    FC.set_ang_vel(N, u[0] * FB.x + u[1] * FB.y + u[2] * FB.z)
    CO.set_vel(N, u[3] * FC.x + u[4] * FC.y + u[5] * FC.z)
    P = CO.locatenew("P", radius * FB.z)
    P.v2pt_theory(CO, N, FC)
    kinematic = sp.Matrix([me.dot(by_rates - FC.ang_vel_in(N), e) for e in FB]
                          + [me.dot(moving - CO.vel(N), e) for e in N])
    qdots = sp.solve(kinematic, [e.diff(T) for e in p])
    FB.set_ang_vel(N, carrier.subs(qdots))
    FC.set_ang_acc(N, FC.ang_vel_in(N).dt(FB) + me.cross(FB.ang_vel_in(N), FC.ang_vel_in(N)))
    kane = me.KanesMethod(N, p[:5], u[:3], kd_eqs=kinematic, q_dependent=[p[5]], u_dependent=u[3:],
                          configuration_constraints=sp.Matrix([p[5] - me.dot(CO.pos_from(P), N.z)]),
                          velocity_constraints=sp.Matrix([me.dot(P.vel(N), e) for e in FC]))
    inertia = me.inertia(FC, mass * radius**2 / 4, mass * radius**2 / 2, mass * radius**2 / 4)
    kane.kanes_equations([me.RigidBody("disc", CO, FC, mass, (inertia, CO))], [(CO, mass * weight * FA.z)])
    return s.augmented().compile(), Peer(kane)


def turned(axis: int, angle: float) -> np.ndarray:
    return np.array((sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)[axis](angle), dtype=float)


@pytest.mark.parametrize(("angles", "rates"), [
    ((0.0, 0.0, 0.0), (0.0, 0.0, 0.5)), *swept([((0.8, 0.0, -0.4), (0.0, 0.0, 3.0)), ((0.8, 0.0, 0.0), (0.0, 0.0, 0.0))]),
    ((0.3, 0.25, 1.1), (0.6, -0.5, 2.0)), ((-2.0, -0.7, 0.2), (1.5, 0.3, -1.0)),
])
def test_rolling_disc(angles: tuple[float, ...], rates: tuple[float, ...]) -> None:
    """SymPy's speeds are u1 = q2_dot, u2 = q1_dot sin q2 + q3_dot, u3 = q1_dot cos q2; at any motion the change S of speeds is
    a change of the state, A_w = (S A_x + S_dot) S^-1. At the upright state the published matrix of SymPy's test comes out."""
    module, peer = disc()
    m, r, g = 1.4, 0.7, 9.81
    (q1, q2, q3), (d1, d2, d3) = angles, rates
    A, B, C = (turned(2, q1), turned(2, q1) @ turned(0, q2), turned(2, q1) @ turned(0, q2) @ turned(1, q3))
    centre = np.array([0.4, -0.2, -r * np.cos(q2)])
    omega = d1 * np.array([0, 0, 1.0]) + d2 * A[:, 0] + d3 * B[:, 1]
    velocity = -np.cross(omega, r * B[:, 2])
    names = [*(f"q{k}" for k in range(1, 7)), *(f"q{k}_dot" for k in range(1, 7))]
    at = dict(zip(names, [*angles, *centre, *rates, *velocity], strict=True))
    wanted = ("q1", "q2", "q3", "q4", "q5", "q1_dot", "q2_dot", "q3_dot")
    x = np.array([at[n] for n in module.metadata.x])
    lin = module.linearize(x)
    rows = [module.metadata.x.index(n) for n in wanted]

    def own(h: float) -> np.ndarray:
        """The wanted changes of those that are independent here, (8, 8), at a time h later in the motion."""
        later = solve_ivp(lambda _, y: module.rhs(0.0, y), (0, h), x, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        near = module.linearize(later)
        assert near.states == lin.states
        return near.tangent()[rows]

    E, E_dot = lin.tangent()[rows], richardson(own, 0.0, 5e-4) if any(rates) else 0.0
    A_x = (E @ lin.A + E_dot) @ np.linalg.inv(E)

    # Kane's state: w' = S x', w'_dot = (S A_x + S_dot) x'.
    yaw = float(lin.ud[module.metadata.u.index("q1_dot")])
    s, c = np.sin(q2), np.cos(q2)
    S, S_dot = np.eye(8), np.zeros((8, 8))
    S[5:] = [[0, 0, 0, 0, 0, 0, 1, 0], [0, c * d1, 0, 0, 0, s, 0, 1], [0, -s * d1, 0, 0, 0, c, 0, 0]]
    S_dot[6, [1, 5]] = -s * d2 * d1 + c * yaw, c * d2
    S_dot[7, [1, 5]] = -c * d2 * d1 - s * yaw, -s * d2
    found = (S @ A_x + S_dot) @ np.linalg.inv(S)
    u = [*(B.T @ omega), *(C.T @ velocity)]
    expected, _ = peer.linearize([*angles, *centre], u, {"m": m, "r": r, "g": g})
    assert_same(found, expected)
    if not q2 and not d1 and not d2:  # upright, straight on
        by_hand = np.zeros((8, 8))
        by_hand[0, 7] = by_hand[1, 5] = by_hand[2, 6] = 1
        by_hand[3, [0, 5, 6]] = r * np.sin(q1) * d3, -r * np.sin(q1), -r * np.cos(q1)
        by_hand[4, [0, 5, 6]] = -r * np.cos(q1) * d3, r * np.cos(q1), -r * np.sin(q1)
        by_hand[5, [1, 7]], by_hand[7, 5] = (0.8 * g / r, 1.2 * d3), -2 * d3
        assert_same(found, by_hand)


# -- pendulums on a cart


@functools.cache
def cart(n: int) -> Any:
    """n links on a cart, angles from the vertical, a force on the cart and torques in the joints."""
    q = sd.coordinates(f"q0:{n + 1}")
    m, l = sd.parameters(f"m0:{n + 1}"), sd.parameters(f"l0:{n}")
    g = sd.parameters("g")
    torques, F = sd.inputs(f"T1:{n + 1}"), sd.inputs("F")
    s = sd.System(f"cart_{n}", gravity=[0, -g])
    parent = s.add_body("cart", mass=m[0])
    s.add_joint(sd.Prismatic("rail", s.ground, parent, q[0], axis=[1, 0]))
    s.add_joint_force("rail", F)
    for k in range(n):
        link = s.add_body(f"link{k + 1}", mass=m[k + 1], com=[0, l[k]])
        angle = q[k + 1] - q[k] if k else q[1]
        if k:
            s.add_coordinate(q[k + 1])
        s.add_joint(sd.Revolute(f"hinge{k + 1}", parent, link, angle, parent_point=[0, l[k - 1]] if k else [0, 0]))
        s.add_torque(link, torques[k], reaction=parent if k else None)
        parent = link
    s.defaults = {**dict(zip(m, (2.0, 0.7, 0.4, 0.3), strict=False)), **dict(zip(l, (0.6, 0.5, 0.35), strict=False)), g: 9.81}
    return s.embedding().compile()


@functools.cache
def peer_of_cart(n: int) -> Peer:
    """Source: sympy.physics.mechanics.models.n_link_pendulum_on_cart, as test_models and test_system use it."""
    return Peer(models.n_link_pendulum_on_cart(n, True, True))


@pytest.mark.parametrize("moving", [*swept([0]), 1])
@pytest.mark.parametrize("n", [*swept([1]), 2, *swept([3])])
def test_links_on_a_cart(n: int, moving: int) -> None:
    """Any state, any inputs; upright and hanging states are its special cases."""
    module, peer = cart(n), peer_of_cart(n)
    stream = np.random.default_rng(n)
    for q in (np.zeros(n + 1), stream.uniform(-1, 1, n + 1), np.array([0.3, *[np.pi] * n])):
        u = moving * stream.uniform(-2, 2, n + 1)
        given = dict(zip(module.metadata.inputs, stream.uniform(-3, 3, n + 1), strict=True))
        lin = module.linearize((q, u), inputs=given)
        params = dict(zip(module.metadata.parameters, module.metadata.defaults, strict=True))
        A, B = peer.linearize(q, u, params, given)
        assert lin.states == tuple(module.metadata.x)
        assert_same(lin.A, A)
        assert_same(lin.B[:, [module.metadata.inputs.index(name) for name in peer.inputs]], B)


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
def test_a_pendulum_whose_cart_is_held_is_the_minimal_pendulum(angle: float) -> None:
    """(0, 1; g cos q1 / L, 0), q1 from the upward vertical. Source: test_linearize_pendulum_kane_minimal."""
    module = cart(1)
    lin = module.linearize(([0.2, angle], [0.0, 0.0]), hold=["q0"])
    assert lin.held == ("q0",) and lin.states == ("q1", "q1_dot")
    assert_same(lin.A, np.array([[0, 1], [9.81 * np.cos(angle) / 0.6, 0]]))


# -- masses in a row


@functools.cache
def masses() -> tuple[Any, Peer]:
    """Three masses that hang one from the other. Source: models.multi_mass_spring_damper(3, True, True), in test_models."""
    x, f = sd.coordinates("x0:3"), sd.inputs("f0:3")
    m, k, c = sd.parameters("m0:3"), sd.parameters("k0:3"), sd.parameters("c0:3")
    g = sd.parameters("g")
    s = sd.System("masses", gravity=[g, 0])
    parent = s.ground
    for i in range(3):
        body = s.add_body(f"mass{i}", mass=m[i])
        s.add_joint_force(s.add_joint(sd.Prismatic(f"way{i}", parent, body, x[i], axis=[1, 0])), -k[i] * x[i] - c[i] * x[i].dot)
        s.add_force(body, [f[i], 0])
        parent = body
    s.defaults = {**dict(zip(m, (1.0, 2.0, 0.5), strict=True)), **dict(zip(k, (90.0, 40.0, 70.0), strict=True)),
                  **dict(zip(c, (0.4, 0.0, 1.3), strict=True)), g: 9.81}
    return s.embedding().compile(), Peer(models.multi_mass_spring_damper(3, True, True))


def test_masses_in_a_row() -> None:
    """Where they hang; linear, so that the state does not matter."""
    module, peer = masses()
    rest = module.equilibrium()
    lin = module.linearize(rest)
    params = dict(zip(module.metadata.parameters, module.metadata.defaults, strict=True))
    A, B = peer.linearize(rest.q, rest.u, params, {f"f{i}": 0.0 for i in range(3)})
    assert_same(lin.A, A)
    assert_same(lin.B[:, [module.metadata.inputs.index(name) for name in peer.inputs]], B)
    assert lin.verdict == "stable"
    assert_same(np.sort_complex(lin.eigenvalues), np.sort_complex(np.linalg.eigvals(A)))


# -- a four-bar linkage


BARS = {"l1": 0.13, "l2": 0.24, "l3": 0.21, "l4": 0.34, "rho": 997.0}


@functools.cache
def four_bar() -> tuple[Any, Peer]:
    """Three bars of density rho on the first, which stands still. Source: test_four_bar_linkage_with_manual_constraints."""
    q = sd.coordinates("q1:4")
    *l, rho = sd.parameters("l1 l2 l3 l4 rho", positive=True)
    tau = sd.inputs("tau")
    s = sd.System("four_bar", planar=True)
    parent, at = s.ground, [l[0] / 2, 0]
    for k, length in enumerate(l[1:]):
        bar = s.add_body(f"link{k + 2}", mass=rho * length, inertia=rho * length**3 / 12, com=[length / 2, 0])
        s.add_joint(sd.Revolute(f"J{k + 1}", parent, bar, q[k], parent_point=at))
        parent, at = bar, [length, 0]
    s.add_joint_force("J1", tau)
    s.close_loop(sd.Revolute("J4", s.ground, parent, parent_point=[-l[0] / 2, 0], child_point=at))
    s.defaults = {e: BARS[str(e)] for e in (*l, rho)}

    p, u, drive = me.dynamicsymbols("q1:4"), me.dynamicsymbols("u1:4"), me.dynamicsymbols("tau")
    *length, density = sp.symbols("l1 l2 l3 l4 rho")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    frame, end = N, O.locatenew("J1", length[0] / 2 * N.x)
    end.set_vel(N, 0)
    bodies, turning = [], 0
    for k, l_k in enumerate(length[1:]):
        frame = frame.orientnew(f"B{k}", "Axis", [p[k], N.z])
        turning += u[k]
        frame.set_ang_vel(N, turning * N.z)
        G, after = end.locatenew(f"G{k}", l_k / 2 * frame.x), end.locatenew(f"E{k}", l_k * frame.x)
        for point in (G, after):
            point.v2pt_theory(end, N, frame)
        bodies.append(me.RigidBody(f"link{k + 2}", G, frame, density * l_k,
                                   (me.inertia(frame, 0, 0, density * l_k**3 / 12), G)))
        end = after
    gap = end.pos_from(O) + length[0] / 2 * N.x
    closed = [gap.dot(e) for e in (N.x, N.y)]
    rates = [e.diff(T) - v for e, v in zip(p, u, strict=True)]
    by_speeds = {e.diff(T): v for e, v in zip(p, u, strict=True)}
    kane = me.KanesMethod(N, q_ind=[p[0]], u_ind=[u[0]], q_dependent=p[1:], u_dependent=u[1:], kd_eqs=rates,
                          configuration_constraints=closed, velocity_constraints=[e.diff(T).subs(by_speeds) for e in closed])
    kane.kanes_equations(bodies, [(bodies[0].frame, drive * N.z)])
    return s.augmented().compile(), Peer(kane)


@pytest.mark.sweep
@pytest.mark.parametrize("factor", [0.0, 1.0, -25.0])
def test_four_bar_linkage(factor: float) -> None:
    """At the angles and speeds of SymPy's test, at rest, and faster; driven at its crank."""
    module, peer = four_bar()
    q, u = module.consistent(q={"q1": 2.1, "q2": 0.6655470375077588, "q3": 2.527408138024188}, u={"q1_dot": 0.2 * factor},
                             keep=["q1", "q1_dot"])
    assert np.allclose(u, factor * np.array([0.2, -0.17963733938852067, 0.1309060540601612]), atol=1e-12)
    lin = module.linearize((q, u), inputs={"tau": 0.3}, coordinates=["q1"])
    A, B = peer.linearize(q, u, BARS, {"tau": 0.3})
    assert lin.states == ("q1", "q1_dot")
    assert_same(lin.A, A)
    assert_same(lin.B, B)
