"""Equations of motion with helical and custom joints and with quasi-velocities, against the same mechanism built otherwise."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics as me

import symdyn as sd
from symdyn.errors import EvaluationError, SimulationWarning
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.model.orientation import SEQUENCES
from symdyn.model.symbols import symbols_of
from tests import helpers
from tests.helpers import swept

third, fifth = sp.Rational(1, 3), sp.Rational(1, 5)
SKEW = sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
SLANTED = [third, 2 * third, 2 * third]
PLACE: dict[str, Any] = {"parent_point": [third, 1, 0], "child_point": [0, fifth, -third], "parent_rotation": SKEW,
                         "child_rotation": SKEW.T}
a, b, c, x, y, z = sd.coordinates("a b c x y z")
e = sd.coordinates("e0:4")
h, l = sd.parameters("h l")
Rx, Ry, Rz = sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3
QUANTITIES = ("M_tilde", "k_tilde", "F_tilde", "J", "Jdot", "Jd_qd", "energy", "power", "accelerations", "rates")


@functools.cache
def mechanism(joint: Callable[..., Any], *extra: sp.Symbol, tip: bool = True,
              derive: Callable[[sd.System], Any] = sd.System.embedding) -> Any:
    """A body on the joint, on a base that slides and turns, and a body hinged to it; with forces."""
    g, F = sd.parameters("g"), sd.inputs("F")
    s = sd.System("mechanism", gravity=[third * g, 0, -g])
    base = s.add_body("base", mass=2, inertia=[1, 2, 2.5], com=[0, third, 1])
    box = s.add_body("box", mass=3, inertia=[[2, fifth, 0], [fifth, 3, -fifth], [0, -fifth, 4]], com=[third, -fifth, fifth])
    s.add_joint(sd.Cylindrical("drive", s.ground, base, sd.coordinates("p s"), axis=SLANTED, child_point=[fifth, 0, 1]))
    s.add_joint(joint("joint", base, box, **PLACE))
    if tip:
        end = s.add_body("end", mass=1, inertia=[1, 1, 1.5], com=[0, fifth, 1])
        s.add_joint(sd.Revolute("hinge", box, end, sd.coordinates("w"), axis=[0, 0.6, 0.8], parent_point=[1, 0, third]))
    s.add_force(box, [F, 1, 2], point=[fifth, 0, 0])
    s.add_torque(box, [1, F, 0], reaction=base)
    s.add_spring_damper(base, box, [1, 0, 2], [0, 1, 0], stiffness=5, damping=2, length=third)
    s.add_coordinate(*extra)
    return derive(s)


def same(one: EmbeddedEquations, other: EmbeddedEquations, seed: int = 1, names: tuple[str, ...] = QUANTITIES) -> None:
    values = helpers.state(one, seed)
    assert one.symbols.speeds == other.symbols.speeds and one.symbols.coordinates == other.symbols.coordinates
    for name, found, wanted in zip(names, *(helpers.quantities(s, values, *names) for s in (one, other)), strict=True):
        assert helpers.close(found, wanted), name


# name -> (custom joint, the joint that it rebuilds), both from (name, parent, child, place)
REBUILT: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    "revolute": (lambda *n, **p: sd.Custom(*n, [a], Rz(a), **p), lambda *n, **p: sd.Revolute(*n, a, **p)),
    "prismatic": (lambda *n, **p: sd.Custom(*n, [x], None, [x, 0, 0], **p), lambda *n, **p: sd.Prismatic(*n, x, **p)),
    "helical": (lambda *n, **p: sd.Custom(*n, [a], Rz(a), [0, 0, h * a], **p),
                lambda *n, **p: sd.Helical(*n, a, pitch=h, **p)),
    "cylindrical": (lambda *n, **p: sd.Custom(*n, [a, x], Rz(a), [0, 0, x], **p),
                    lambda *n, **p: sd.Cylindrical(*n, [a, x], **p)),
    "planar": (lambda *n, **p: sd.Custom(*n, [x, y, a], Rz(a), [x, y, 0], **p), lambda *n, **p: sd.Planar(*n, [x, y, a], **p)),
    "universal": (lambda *n, **p: sd.Custom(*n, [a, b], Rx(a) * Ry(b), **p), lambda *n, **p: sd.Universal(*n, [a, b], **p)),
    "spherical": (lambda *n, **p: sd.Custom(*n, [a, b, c], Rz(a) * Ry(b) * Rx(c), **p),
                  lambda *n, **p: sd.Spherical(*n, [a, b, c], **p)),
    "free": (lambda *n, **p: sd.Custom(*n, [x, y, z, a, b, c], Rx(a) * Rz(b) * Rx(c), [x, y, z], **p),
             lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("XZX"), **p)),
    "revolute, turned and shifted at zero": (
        lambda *n, **p: sd.Custom(*n, [a], Rx(third) * Rz(a + fifth), [third, l, 0], **p),
        lambda *n, parent_point, parent_rotation, child_rotation, **p: sd.Revolute(
            *n, a, parent_point=sp.Matrix(parent_point) + parent_rotation * sp.Matrix([third, l, 0]),
            parent_rotation=parent_rotation * Rx(third), child_rotation=child_rotation * Rz(fifth).T, **p)),
    "revolute, half as fast": (lambda *n, **p: sd.Custom(*n, [a], Ry(a / 2), **p),
                               lambda *n, **p: sd.Revolute(*n, sp.UnevaluatedExpr(a) / 2, axis=[0, 1, 0], **p)),
}


@pytest.mark.parametrize("name", swept([n for n in REBUILT if n != "revolute, half as fast"], "helical", "planar", "spherical",
                                       "free", "revolute, turned and shifted at zero"))
def test_custom_joints_that_rebuild_others(name: str) -> None:
    same(*(mechanism(joint) for joint in REBUILT[name]))


@pytest.mark.parametrize(("custom", "other", "extra"), [
    (REBUILT["revolute, half as fast"][0], REBUILT["revolute, half as fast"][1], a),
    (lambda *n, **p: sd.Custom(*n, [x], Rz(sp.atan(2 * l * x)), [x, l * x**2, 0], **p),
     lambda *n, **p: sd.Free(*n, [sp.UnevaluatedExpr(x), l * x**2, 0, sp.atan(2 * l * x), 0, 0], **p), x),
    (lambda *n, **p: sd.Helical(*n, a, pitch=h, axis=SLANTED, **p),
     lambda *n, **p: sd.Cylindrical(*n, [sp.UnevaluatedExpr(a), h * a], axis=SLANTED, **p), a),
], ids=["half as fast", "parabola", "helical"])
def test_joints_that_follow_a_coordinate(custom: Any, other: Any, extra: sp.Symbol) -> None:
    same(mechanism(custom, tip=False), mechanism(other, extra, tip=False))


# -- quasi-velocities: the same motion, described by other speeds

QUASI: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    **{f"spherical {s}": (lambda *n, s=s, **p: sd.Spherical(*n, [a, b, c], sd.EulerAngles(s, "body"), **p),
                          lambda *n, s=s, **p: sd.Spherical(*n, [a, b, c], sd.EulerAngles(s), **p)) for s in SEQUENCES},
    "free": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], velocity="body", **p),
             lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], **p)),
    "free with rates": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("YXZ"), velocity="body", **p),
                        lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("YXZ"), **p)),
    "free in the parent's axes": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("XYX", "body"), **p),
                                  lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("XYX"), **p)),
    "free with parameters": (lambda *n, **p: sd.Free(*n, [x, y, z, *e], sd.EulerParameters(), velocity="body", **p),
                             lambda *n, **p: sd.Free(*n, [x, y, z, *e], sd.EulerParameters(), **p)),
}


@pytest.mark.parametrize("name", swept(QUASI, *[*QUASI][:12:6], *[*QUASI][12:]))
def test_accelerations_do_not_depend_on_the_speeds(name: str) -> None:
    quasi, plain = (mechanism(joint) for joint in QUASI[name])
    values = helpers.state(quasi, 2)
    (rates,) = helpers.quantities(quasi, values, "rates", digits=60)
    places = {q: k for k, q in enumerate(quasi.symbols.coordinates)}
    own = {q.dot.name: rates[k] for q, k in places.items()}
    mapped = {**{f"{u.name}_dot": 0 for u in plain.symbols.speeds}, **values, **own}
    found = {}
    for equations, state in ((quasi, values), (plain, mapped)):
        J, bias, ud, *rest = helpers.quantities(equations, state, "J", "Jd_qd", "accelerations", "energy", "power", "rates")
        with mpmath.workdps(40):
            found[equations] = [J @ ud + bias, *rest]
    for one, other in zip(*found.values(), strict=True):
        assert helpers.close(one, other)


@pytest.mark.parametrize("name", [*swept(["spherical ZYX"]), "spherical XYX", *swept(["free"]), "free with parameters"])
def test_identities(name: str) -> None:
    result = mechanism(QUASI[name][0]).verify(states=2)
    assert result.passed, str(result)


@pytest.mark.parametrize("joint", [*swept([REBUILT["helical"][0]]), REBUILT["helical"][1], *swept([REBUILT["free"][0]]),
                                   REBUILT["revolute, turned and shifted at zero"][0]])
def test_identities_of_helical_and_custom(joint: Callable[..., Any]) -> None:
    result = mechanism(joint).verify(states=2)
    assert result.passed, str(result)


@pytest.mark.parametrize("joint", [REBUILT["helical"][1], REBUILT["revolute, turned and shifted at zero"][0], *swept([
    REBUILT["revolute"][0], REBUILT["universal"][0], QUASI["spherical ZYX"][0]]), QUASI["free"][0]])
def test_formulations_agree(joint: Callable[..., Any]) -> None:
    embedded = mechanism(joint)
    names = ("accelerations", "rates", "energy", "inverse_dynamics")
    for derive in (lambda s: s.embedding(frames="parallel"), lambda s: s.recursive(), lambda s: s.recursive(frames="parallel")):
        same(mechanism(joint, derive=derive), embedded, 4, names)


def test_mass_matrix_of_a_free_body_is_constant() -> None:
    s = sd.System("body", gravity=[0, 0, -1])
    box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[0, 0, fifth])
    s.add_joint(sd.Free("float", s.ground, box, velocity="body"))
    M = s.embedding().M_tilde
    assert M.is_symmetric() and not symbols_of(M) and M[:3, :3] == 3 * sp.eye(3) and M[5, 5] == 4
    assert M[:3, 3:] == 3 * fifth * sp.Matrix([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])


def test_forces_along_the_speeds_are_in_child_axes() -> None:
    def body(driven: bool) -> EmbeddedEquations:
        s = sd.System("body", gravity=[0, 0, -1])
        box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[0, 0, fifth])
        s.add_joint(sd.Free("float", s.ground, box, [x, y, z, a, b, c], velocity="body"))
        if driven:
            s.add_joint_force("float", [1, 2, 3, 4, 5, 6])
        else:
            s.add_force(box, [1, 2, 3], point=[0, 0, 0], frame=box)
            s.add_torque(box, [4, 5, 6], frame=box)
        return s.embedding()

    same(body(True), body(False))


# -- Kane's method


def kane(N: Any, q: list, u: list, rates: list, bodies: list, loads: list) -> Callable[..., tuple[Any, Any]]:
    """(u_dot, q_dot) for numbers of q, u, with 40 digits."""
    method = me.KanesMethod(N, q_ind=q, u_ind=u, kd_eqs=rates)
    method.kanes_equations(bodies, loads)
    kinematic = method.kindiffdict()
    evaluate = sp.lambdify([*q, *u], [method.mass_matrix, method.forcing, [kinematic[s.diff()] for s in q]], modules="mpmath",
                           cse=True)

    def solve(numbers: list) -> tuple[Any, Any]:
        with mpmath.workdps(40):
            M, forcing, q_dot = evaluate(*map(helpers.number, numbers))
            return np.array(list(mpmath.lu_solve(M, forcing)), dtype=object), np.array(q_dot, dtype=object)

    return solve


def agrees(system: sd.System, solve: Callable[..., tuple[Any, Any]]) -> None:
    equations = system.embedding()
    values = helpers.state(equations, 5)
    ud, q_dot = helpers.quantities(equations, values, "accelerations", "rates")
    wanted = solve([values[s.name] for s in (*equations.symbols.coordinates, *equations.symbols.speeds)])
    assert helpers.close(ud, wanted[0]) and helpers.close(q_dot, wanted[1])


def rigid(name: str, G: Any, frame: Any, mass: Any, moments: tuple) -> Any:
    return me.RigidBody(name, G, frame, mass, (me.inertia(frame, *moments), G))


@pytest.mark.parametrize("sequence", ["ZYX", *swept(["XYX"])])
def test_free_body_by_kane(sequence: str) -> None:
    s = sd.System("body", gravity=[0, 0, -9])
    box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[third, 0, fifth])
    s.add_joint(sd.Free("float", s.ground, box, [x, y, z, a, b, c], sd.EulerAngles(sequence, "body"), velocity="body"))
    s.add_force(box, [1, 2, 0], point=[0, 1, 0])
    q, u = list(me.dynamicsymbols("x y z a b c")), list(me.dynamicsymbols("v1:4 w1:4"))
    N, O = me.ReferenceFrame("N"), me.Point("O")
    B = N.orientnew("B", "Body", q[3:], sequence)
    omega = u[3] * B.x + u[4] * B.y + u[5] * B.z
    rates = [(B.ang_vel_in(N) - omega).dot(axis) for axis in B]
    B.set_ang_vel(N, omega)
    O.set_vel(N, 0)
    P = O.locatenew("P", q[0] * N.x + q[1] * N.y + q[2] * N.z)
    v = u[0] * B.x + u[1] * B.y + u[2] * B.z
    P.set_vel(N, v)
    rates += [q[k].diff() - v.dot(axis) for k, axis in enumerate(N)]
    G, A = P.locatenew("G", third * B.x + fifth * B.z), P.locatenew("A", B.y)
    for point in (G, A):
        point.v2pt_theory(P, N, B)
    agrees(s, kane(N, q, u, rates, [rigid("box", G, B, 3, (2, 3, 4))], [(G, -27 * N.z), (A, N.x + 2 * N.y)]))


@pytest.mark.sweep
def test_screw_by_kane() -> None:
    pitch = fifth
    s = sd.System("screw", gravity=[0, -2, -9])
    nut, arm = s.add_body("nut", mass=2, inertia=[1, 2, 2.5], com=[third, 0, 1]), s.add_body("arm", mass=1, com=[1, 0, fifth])
    s.add_joint(sd.Helical("screw", s.ground, nut, a, axis=SLANTED, pitch=pitch))
    s.add_joint(sd.Revolute("hinge", nut, arm, b, axis=[0, 1, 0], parent_point=[0, third, 0]))
    q, u = list(me.dynamicsymbols("a b")), list(me.dynamicsymbols("u1 u2"))
    N, O = me.ReferenceFrame("N"), me.Point("O")
    axis = third * N.x + 2 * third * (N.y + N.z)
    A = N.orientnew("A", "Axis", [q[0], axis])
    A.set_ang_vel(N, u[0] * axis)
    B = A.orientnew("B", "Axis", [q[1], A.y])
    B.set_ang_vel(A, u[1] * A.y)
    O.set_vel(N, 0)
    P = O.locatenew("P", pitch * q[0] * axis)
    P.set_vel(N, pitch * u[0] * axis)
    G, H = P.locatenew("G", third * A.x + A.z), P.locatenew("H", third * A.y)
    for point in (G, H):
        point.v2pt_theory(P, N, A)
    bob = H.locatenew("bob", B.x + fifth * B.z)
    bob.v2pt_theory(H, N, B)
    agrees(s, kane(N, q, u, [one.diff() - other for one, other in zip(q, u, strict=True)],
                   [rigid("nut", G, A, 2, (1, 2, sp.Rational(5, 2))), me.Particle("arm", bob, 1)],
                   [(G, 2 * (-2 * N.y - 9 * N.z)), (bob, -2 * N.y - 9 * N.z)]))


def test_custom_by_kane() -> None:
    """A carriage along a helix that widens, turned about z as it goes and tilted by a second coordinate; a bob hinged to it."""
    s = sd.System("ride", gravity=[0, 0, -9])
    cart, arm = s.add_body("cart", mass=2, inertia=[1, 2, 2.5], com=[third, 0, 1]), s.add_body("arm", mass=1, com=[1, 0, fifth])
    path = [(1 + a**2 / 4) * sp.cos(a), sp.sin(a), sp.exp(a / 3)]
    s.add_joint(sd.Custom("ride", s.ground, cart, [a, b], Rz(2 * a) * Rx(a * b), path))
    s.add_joint(sd.Revolute("hinge", cart, arm, c, axis=[0, 1, 0], parent_point=[0, third, 0]))
    q, u = list(me.dynamicsymbols("a b c")), list(me.dynamicsymbols("u1:4"))
    N, O = me.ReferenceFrame("N"), me.Point("O")
    A = N.orientnew("A", "Body", [2 * q[0], q[0] * q[1], 0], "ZXZ")
    speeds = {one.diff(): other for one, other in zip(q, u, strict=True)}
    A.set_ang_vel(N, A.ang_vel_in(N).express(A).subs(speeds))
    B = A.orientnew("B", "Axis", [q[2], A.y])
    B.set_ang_vel(A, u[2] * A.y)
    O.set_vel(N, 0)
    at = [e.subs({a: q[0]}) for e in path]
    P = O.locatenew("P", at[0] * N.x + at[1] * N.y + at[2] * N.z)
    P.set_vel(N, sum((e.diff(q[0]) * u[0] * axis for e, axis in zip(at, N, strict=True)), me.Vector(0)))
    G, H = P.locatenew("G", third * A.x + A.z), P.locatenew("H", third * A.y)
    for point in (G, H):
        point.v2pt_theory(P, N, A)
    bob = H.locatenew("bob", B.x + fifth * B.z)
    bob.v2pt_theory(H, N, B)
    agrees(s, kane(N, q, u, [one.diff() - other for one, other in zip(q, u, strict=True)],
                   [rigid("cart", G, A, 2, (1, 2, sp.Rational(5, 2))), me.Particle("arm", bob, 1)],
                   [(G, -18 * N.z), (bob, -9 * N.z)]))


# -- motions


ORIENTATIONS = {"ZYX": (sd.EulerAngles("ZYX", "body"), [x, y, z, a, b, c], {}),
                "XZX": (sd.EulerAngles("XZX", "body"), [x, y, z, a, b, c], {b: 1.0}),
                "parameters": (sd.EulerParameters(), [x, y, z, *e], {})}


@pytest.mark.parametrize("name", ORIENTATIONS)
def test_free_fall_with_spin(name: str) -> None:
    """A symmetric top in free fall: omega turns in body axes at (I_3 - I_1) / I_1 omega_3, the centre of mass on a parabola."""
    orientation, coordinates, initial = ORIENTATIONS[name]
    s = sd.System("top", gravity=[0, 0, -9.81])
    body = s.add_body("body", mass=2, inertia=[2, 2, 3])
    s.add_joint(sd.Free("float", s.ground, body, coordinates, orientation, velocity="body"))
    s.add_output("centre", sd.position(body))
    s.add_output("speed", sd.velocity(body))
    solution = s.embedding().compile().simulate((0, 2), q=initial, u=[1, 2, 3, 0.3, 0, 1.2], rtol=1e-11)
    t, u = solution.t, solution.u
    assert solution.success
    turned = 0.5 * 1.2 * t
    np.testing.assert_allclose(u[:, 3:], np.column_stack([0.3 * np.cos(turned), 0.3 * np.sin(turned), 0 * t + 1.2]), atol=1e-9)
    v = np.column_stack([np.ones_like(t), 2 * np.ones_like(t), 3 - 9.81 * t])
    start = solution.outputs["speed"][0]
    np.testing.assert_allclose(solution.outputs["speed"], start + v - v[0], atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(u[:, :3], axis=1), np.linalg.norm(solution.outputs["speed"], axis=1), atol=1e-8)
    fallen = np.outer(t, start) - np.outer(t**2, [0, 0, 9.81 / 2])
    np.testing.assert_allclose(solution.outputs["centre"], fallen, atol=1e-8)
    assert solution.energy_error() < 1e-9


MOVED = {"helical": lambda *n: sd.Helical(*n, a, pitch=0.1), "body": lambda *n: sd.Free(*n, velocity="body"),
         "custom": lambda *n: sd.Custom(*n, [a], Rz(sp.sin(a)), [sp.cos(a), sp.sin(a), sp.sin(2 * a) / 4], units=["rad"]),
         "angles": lambda *n: sd.Spherical(*n, orientation=sd.EulerAngles("ZXY", "body"))}


@pytest.mark.parametrize("name", MOVED)
def test_energy_along_a_motion(name: str) -> None:
    s = sd.System("ride", gravity=[1, 0, -9.81])
    body, arm = s.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.3, 0, 0.1]), s.add_body("arm", mass=1, com=[1, 0, 0])
    s.add_joint(MOVED[name]("ride", s.ground, body))
    s.add_joint(sd.Revolute("hinge", body, arm, w := sd.coordinates("w"), axis=[0, 1, 0]))
    s.add_joint_force("hinge", -w.dot)
    s.add_torque(body, [0, 1, sp.sin(sd.t)], frame=body)
    solution = s.embedding().compile().simulate((0, 3), u=[0.5] * len(s.check().speeds), rtol=1e-11, work=True)
    assert solution.success and abs(solution.work[-1]) > 0.01
    assert solution.energy_error() < 1e-8


# -- gimbal lock


def ball(sequence: str, kind: type = sd.Spherical, **options: Any) -> EmbeddedEquations:
    s = sd.System("ball", gravity=[0, 0, -9.81])
    body = s.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    s.add_joint(kind("socket", s.ground, body, orientation=sd.EulerAngles(sequence, "body"), **options))
    return s.embedding()


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize(("sequence", "middle"), [("ZYX", np.pi / 2), ("ZYX", -np.pi / 2), ("XZY", 1.5 * np.pi), ("XYX", 0.0),
                                                  ("ZXZ", np.pi)])
def test_gimbal_lock_is_named(backend: str, sequence: str, middle: float) -> None:
    try:
        module = ball(sequence).compile(backend=backend)
    except sd.CompilerNotFound:
        pytest.skip("no C compiler here")
    text = f"the {sequence} angles of joint socket are at gimbal lock, where no rates of theirs give its angular velocity"
    with pytest.raises(EvaluationError, match=text):
        module.rhs(0.0, [0.1, middle, 0.2, 0, 0, 1])
    with pytest.warns(SimulationWarning, match=f"stopped at t = 0: .*{text}"):
        module.simulate((0, 1), q=[0.1, middle, 0.2], u=[0, 0, 1])
    assert np.isfinite(module.rhs(0.0, [0.1, middle + 1e-4, 0.2, 0, 0, 1])).all()
    assert np.isfinite(module.k_tilde([0.1, middle, 0.2], [0, 0, 1])).all()  # what has no rates in it is not concerned


def test_rates_print_without_the_check() -> None:
    rates = ball("ZYX", sd.Free, velocity="body").explicit("rates")
    assert not rates.has(sp.Piecewise) and rates.has(sp.cos)


def test_jacobian_with_angular_velocities() -> None:
    module = ball("ZXY", sd.Free, velocity="body").compile(backend="numpy")
    x_0 = np.linspace(0.1, 0.9, 12)
    steps = 1e-6 * np.eye(12)
    difference = np.array([(module.rhs(0.0, x_0 + h) - module.rhs(0.0, x_0 - h)) / 2e-6 for h in steps]).T
    np.testing.assert_allclose(module.jacobian(0.0, x_0)[0], difference, atol=1e-7)


# -- in the plane


def test_custom_joint_in_the_plane() -> None:
    """A bead on a parabola: (1 + 4 l^2 x^2) x_ddot + 4 l^2 x x_dot^2 + 2 g l x = 0."""
    g, m = sd.parameters("g m")
    s = sd.System("bead", gravity=[0, -g])
    bead = s.add_body("bead", mass=m)
    s.add_joint(sd.Custom("wire", s.ground, bead, [x], position=[x, l * x**2], units=["m"]))
    equations = s.embedding()
    assert sp.expand(equations.M_tilde[0] - m * (1 + 4 * l**2 * x**2)) == 0
    assert sp.expand(equations.k_tilde[0] - 4 * m * l**2 * x * x.dot**2) == 0
    assert sp.expand(equations.F_tilde[0] + 2 * m * g * l * x) == 0
    assert s.check().units[x] == "m" and s.check().units[x.dot] == "m/s"
