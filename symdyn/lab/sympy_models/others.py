"""A four-bar linkage, a free-flying robot, and an arm that muscles move."""

from __future__ import annotations

import sympy as sp
from sympy.physics.biomechanics import FirstOrderActivationDeGroote2016, MusculotendonDeGroote2016
from sympy.physics.mechanics import (
    KanesMethod,
    LinearPathway,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

from symdyn.lab.sympy_models.example import Derived


def four_bar() -> Derived:
    """Three uniform bars between two fixed pivots, absolute angles; two of them depend on the first."""
    q1, q2, q3, u1, u2, u3, torque = dynamicsymbols("q1 q2 q3 u1 u2 u3 T")
    l = sp.symbols("l_a l_b l_c")
    ground, rho, g = sp.symbols("l_n rho g")
    N, at = ReferenceFrame("N"), Point("O")
    at.set_vel(N, 0)
    start, bodies, loads = at, [], []
    for k, (q, u, length) in enumerate(zip((q1, q2, q3), (u1, u2, u3), l, strict=True)):
        frame = N.orientnew(f"B{k + 1}", "Axis", [q, N.z])
        frame.set_ang_vel(N, u * N.z)
        center, tip = at.locatenew(f"G{k + 1}", length / 2 * frame.x), at.locatenew(f"P{k + 1}", length * frame.x)
        center.v2pt_theory(at, N, frame)
        tip.v2pt_theory(at, N, frame)
        m = rho * length
        bodies.append(RigidBody(f"bar{k + 1}", center, frame, m, (inertia(frame, 0, 0, m * length**2 / 12), center)))
        loads.append((center, -m * g * N.y))
        at = tip
    loads.append((bodies[0].frame, torque * N.z))
    loop = at.pos_from(start) - ground * N.x
    closed = [loop.dot(N.x), loop.dot(N.y)]
    qd = {q.diff(): u for q, u in ((q1, u1), (q2, u2), (q3, u3))}
    t = dynamicsymbols._t
    kane = KanesMethod(N, [q1], [u1], [a - b for a, b in qd.items()], q_dependent=[q2, q3], configuration_constraints=closed,
                       u_dependent=[u2, u3], velocity_constraints=[e.diff(t).xreplace(qd) for e in closed])
    kane.kanes_equations(bodies, loads)
    return Derived(kane)


def astrobee() -> Derived:
    """A free-flying cube with forces and torques in its axes; position, body-fixed angles XYZ, velocities in its axes as "
    "speeds."""
    p, angles = dynamicsymbols("x y z"), dynamicsymbols("phi theta psi")
    v, w = dynamicsymbols("v_x v_y v_z"), dynamicsymbols("w_x w_y w_z")
    forces, torques = dynamicsymbols("F_x F_y F_z"), dynamicsymbols("T_x T_y T_z")
    m, I = sp.Symbol("m"), sp.symbols("I_x I_y I_z")
    N, B = ReferenceFrame("N"), ReferenceFrame("B")
    B.orient_body_fixed(N, angles, "xyz")
    turning = B.ang_vel_in(N).to_matrix(B)
    axes = (B.x, B.y, B.z)
    origin = Point("O")
    origin.set_vel(N, 0)
    center = origin.locatenew("G", sum((e * a for e, a in zip(p, (N.x, N.y, N.z), strict=True)), 0 * N.x))
    moving = center.vel(N).to_matrix(B)
    center.set_vel(N, sum((e * a for e, a in zip(v, axes, strict=True)), 0 * N.x))
    B.set_ang_vel(N, sum((e * a for e, a in zip(w, axes, strict=True)), 0 * N.x))
    cube = RigidBody("cube", center, B, m, (inertia(B, *I), center))
    kinematics = [*[a - b for a, b in zip(moving, v, strict=True)], *[a - b for a, b in zip(turning, w, strict=True)]]
    kane = KanesMethod(N, [*p, *angles], [*v, *w], kinematics)
    kane.kanes_equations([cube], [(center, sum((e * a for e, a in zip(forces, axes, strict=True)), 0 * N.x)),
                                  (B, sum((e * a for e, a in zip(torques, axes, strict=True)), 0 * N.x))])
    return Derived(kane)


def muscle_driven_arm() -> Derived:
    """A forearm that hangs from the elbow, bent by a muscle with activation and a rigid tendon (De Groote et al. 2016)."""
    q, u = dynamicsymbols("q u")
    m, l, I, g, d, h = sp.symbols("m l I g d h")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q, N.z])
    A.set_ang_vel(N, u * N.z)
    elbow = Point("E")
    elbow.set_vel(N, 0)
    center, insertion = elbow.locatenew("G", -l / 2 * A.y), elbow.locatenew("J", -d * A.y)
    shoulder = elbow.locatenew("S", h * N.y)
    shoulder.set_vel(N, 0)
    for point in (center, insertion):
        point.v2pt_theory(elbow, N, A)
    muscle = MusculotendonDeGroote2016.with_defaults("biceps", LinearPathway(shoulder, insertion),
                                                     FirstOrderActivationDeGroote2016.with_defaults("biceps"))
    arm = RigidBody("forearm", center, A, m, (inertia(A, 0, 0, I), center))
    kane = KanesMethod(N, [q], [u], [q.diff() - u])
    kane.kanes_equations([arm], [(center, -m * g * N.y), *muscle.to_loads()])
    rates = {q.diff(): u}
    return Derived(kane, {z: rate.xreplace(rates) for z, rate in zip(muscle.x, muscle.rhs(), strict=True)})
