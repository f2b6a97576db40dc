"""Chains of particles and bodies: pendulums on a cart, a mass with spring and damper, a chaotic and a conical pendulum."""

from __future__ import annotations

import sympy as sp
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Lagrangian,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

from symdyn.lab.sympy_models.example import Derived


def pendulum_on_cart(n: int) -> Derived:
    """n point masses on massless rods on a cart that a force drives; angles against the horizontal."""
    q, u = dynamicsymbols(f"q0:{n + 1}"), dynamicsymbols(f"u0:{n + 1}")
    force, g = dynamicsymbols("F"), sp.Symbol("g")
    m, l = sp.symbols(f"m0:{n + 1}"), sp.symbols(f"l0:{n}")
    N, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(N, 0)
    at = origin.locatenew("P0", q[0] * N.x)
    at.set_vel(N, u[0] * N.x)
    particles, loads = [Particle("cart", at, m[0])], [(at, force * N.x - m[0] * g * N.y)]
    for k in range(n):
        frame = N.orientnew(f"B{k}", "Axis", [q[k + 1], N.z])
        frame.set_ang_vel(N, u[k + 1] * N.z)
        tip = at.locatenew(f"P{k + 1}", l[k] * frame.x)
        tip.v2pt_theory(at, N, frame)
        particles.append(Particle(f"bob{k + 1}", tip, m[k + 1]))
        loads.append((tip, -m[k + 1] * g * N.y))
        at = tip
    kane = KanesMethod(N, q, u, [a.diff() - b for a, b in zip(q, u, strict=True)])
    kane.kanes_equations(particles, loads)
    return Derived(kane)


def mass_spring_damper() -> Derived:
    """A mass between a spring and a damper, with a force, by Lagrange's method."""
    x, force = dynamicsymbols("x F")
    m, c, k, g = sp.symbols("m c k g")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, x.diff() * N.x)
    block = Particle("block", P, m)
    block.potential_energy = k * x**2 / 2 - m * g * x
    lagrange = LagrangesMethod(Lagrangian(N, block), [x], [(P, (force - c * x.diff()) * N.x)], frame=N)
    lagrange.form_lagranges_equations()
    return Derived(lagrange)


def chaos_pendulum() -> Derived:
    """A rod that swings in a plane, and a plate that turns freely about the rod."""
    theta, phi, omega, alpha = dynamicsymbols("theta phi omega alpha")
    m_r, m_p, l_r, l_p, g = sp.symbols("m_r m_p l_r l_p g")
    I_r, I_x, I_y, I_z = sp.symbols("I_r I_x I_y I_z")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [theta, N.y])
    B = A.orientnew("B", "Axis", [phi, A.z])
    A.set_ang_vel(N, omega * N.y)
    B.set_ang_vel(A, alpha * A.z)
    origin = Point("O")
    origin.set_vel(N, 0)
    rod_center, plate_center = origin.locatenew("R", l_r * A.z), origin.locatenew("Q", l_p * A.z)
    for point in (rod_center, plate_center):
        point.v2pt_theory(origin, N, A)
    rod = RigidBody("rod", rod_center, A, m_r, (inertia(A, I_r, I_r, 0), rod_center))
    plate = RigidBody("plate", plate_center, B, m_p, (inertia(B, I_x, I_y, I_z), plate_center))
    kane = KanesMethod(N, [theta, phi], [omega, alpha], [theta.diff() - omega, phi.diff() - alpha])
    kane.kanes_equations([rod, plate], [(rod_center, m_r * g * N.z), (plate_center, m_p * g * N.z)])
    return Derived(kane)


def conical_pendulum(n: int = 3, published: bool = False) -> Derived:
    """n bars that swing in space, each with two space-fixed angles against the one before, about z, then x; y points up.

    published   True: with the angular velocities of PyDy's example, alpha_dot N.z + beta_dot N.x for every bar, which contradict
                the orientations, in place of those that follow from these
    """
    q, u = dynamicsymbols(f"alpha1:{n + 1}") + dynamicsymbols(f"beta1:{n + 1}"), dynamicsymbols(f"u1:{2 * n + 1}")
    m, l, I, g = *[sp.symbols(f"{name}1:{n + 1}") for name in "mlI"], sp.Symbol("g")
    N, at = ReferenceFrame("N"), Point("O")
    at.set_vel(N, 0)
    bodies, loads, before = [], [], N
    for k in range(n):
        alpha, beta, alpha_dot, beta_dot = q[k], q[n + k], u[k], u[n + k]
        frame = ReferenceFrame(f"B{k + 1}")
        frame.orient(before, "Space", [alpha, beta, 0], "ZXY")
        if published:
            frame.set_ang_vel(N, alpha_dot * N.z + beta_dot * N.x)
        else:
            turned = sp.cos(beta) * before.z - sp.sin(beta) * before.y
            frame.set_ang_vel(before, beta_dot * before.x + alpha_dot * turned)
        center, tip = at.locatenew(f"G{k + 1}", -l[k] / 2 * frame.y), at.locatenew(f"P{k + 1}", -l[k] * frame.y)
        center.v2pt_theory(at, N, frame)
        tip.v2pt_theory(at, N, frame)
        bodies.append(RigidBody(f"bar{k + 1}", center, frame, m[k], (inertia(frame, I[k], 0, I[k]), center)))
        loads.append((center, -m[k] * g * N.y))
        at, before = tip, frame
    kane = KanesMethod(N, q, u, [a.diff() - b for a, b in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    return Derived(kane)
