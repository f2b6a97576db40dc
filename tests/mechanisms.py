"""Mechanisms that only tests need."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd


def kitchen_sink() -> sd.System:
    """Everything that generated code can hold, on a ground that shakes.

    Two sliders one on the other (their mass matrix is constant), a link that swings as a given function of time with a
    pendulum on it, two extra states, two inputs, every function of the tape, outputs of every kind.
    """
    q1, q2, q3 = sd.coordinates("q1:4")
    z1, z2 = sd.coordinates("z1 z2")
    m1, m2, m3, I3, l, g, k, d, e = sd.parameters("m1 m2 m3 I3 l g k d e", positive=True)
    F, tau = sd.inputs("F tau")
    t = sd.t
    s = sd.System("kitchen_sink", gravity=[0, -g, 0])
    s.move_ground([sp.sin(3 * t) / 10, 0, t**2 / 5])
    first, second = s.add_body("first", mass=m1), s.add_body("second", mass=m2)
    arm = s.add_body("arm", mass=1, inertia=[0.01, 0.02, 0.02], com=[l / 2, 0, 0])
    bob = s.add_body("bob", mass=m3, inertia=[I3, I3, I3 / 2], com=[0, -l, 0.1])
    slider = s.add_joint(sd.Prismatic("slider", s.ground, first, q1, axis=[1, 0, 0]))
    s.add_joint(sd.Prismatic("upper", first, second, q2, axis=[sp.Rational(3, 5), sp.Rational(4, 5), 0]))
    s.add_joint(sd.Revolute("driven", s.ground, arm, sp.sin(t) / 2, axis=[0, 1, 0]))
    hinge = s.add_joint(sd.Revolute("hinge", arm, bob, q3, axis=[0, 0, 1], parent_point=[l, 0, 0]))
    u1, u2, u3 = q1.dot, q2.dot, q3.dot
    smooth = (sp.sinh(q1) + sp.cosh(q2) + sp.tanh(u1) + sp.asinh(q1) + sp.acosh(2 + q2**2) + sp.atanh(sp.sin(q3) / 2)
              + sp.asin(sp.cos(q3) / 2) + sp.acos(q1 / 9) + sp.atan(u2) + sp.tan(q3 / 4) + sp.exp(-(q1**2))
              + sp.log(1 + q2**2) + sp.sqrt(1 + u3**2) + sp.erf(u1) + sp.atan2(q1, 2 + q2) + sp.Abs(q1 / 3 + 2) ** e
              + sp.sec(q3 / 5) + (1 + q1**2) ** sp.Rational(-3, 2) + sp.cot(1 + q3 / 9) + sp.pi * sp.E)
    rough = (sp.Min(q1, q2, u1) + sp.Max(q2, F) + sp.Abs(u2) + sp.sign(u3) + sp.floor(3 * q1) + sp.ceiling(2 * q2)
             + sp.Heaviside(q3 - sp.Rational(1, 10)) + sp.Piecewise(
                 (q1**2, sp.And(q1 > 0, u1 <= 1)), (sp.sin(u1), sp.Or(q2 < 0, sp.Not(sp.Eq(q3, 1)))), (-q3, True)))
    s.add_joint_force(slider, -d * sp.Piecewise((u1, sp.Abs(u1) < 1), (sp.sign(u1), True)) + F + z1, name="drive")
    s.add_joint_force(hinge, tau * sp.cos(t) - z2 * sp.sign(u3), name="motor")
    s.add_force(second, [smooth / 10, rough / 10, 0], point=[0.1, 0, 0])
    s.add_torque(bob, [0, 0, -d * u3 * sp.Abs(u3)], frame=bob, reaction=arm)
    s.add_spring_damper(first, bob, point_a=[0, l, 0], point_b=[0, -l, 0], stiffness=k, damping=d, length=l / 3)
    s.add_state(z1, (F - z1) / l)
    s.add_state(z2, u3 - z2**3 + sp.sin(t) + sp.Min(z1, 0.5))
    s.add_output("tip", sd.position(bob, [0, -2 * l, 0]))
    s.add_output("tip_velocity", sd.velocity(bob, [0, -2 * l, 0]))
    s.add_output("smooth", smooth)
    s.add_output("pair", [rough, z1 * z2 + F])
    s.defaults = {m1: 1.5, m2: 0.7, m3: 0.9, I3: 0.05, l: 0.6, g: 9.81, k: 20.0, d: 0.3, e: 1.7}
    s.initial = {q1: 0.1, q3: 0.4, u3: 0.5, z1: 0.2, F: 0.3}
    s.duration = 2.0
    return s


def planar_or_spatial(planar: bool) -> sd.System:
    """A double pendulum on a cart with a damper and a motor, described in the plane or in space."""
    q1, q2, q3 = sd.coordinates("q1:4")
    m, I, l, g, d = sd.parameters("m I l g d")
    tau = sd.inputs("tau")

    def vector(x: Any, y: Any) -> list[Any]:
        return [x, y] if planar else [x, y, 0]

    s = sd.System("flat", gravity=vector(0, -g))
    inertia = I if planar else [0, 0, I]
    cart = s.add_body("cart", mass=2 * m)
    upper = s.add_body("upper", mass=m, inertia=inertia, com=vector(l / 2, 0))
    lower = s.add_body("lower", mass=m, inertia=inertia, com=vector(l / 2, 0))
    s.add_joint(sd.Prismatic("rail", s.ground, cart, q1, axis=vector(1, 0)))
    hinge = s.add_joint(sd.Revolute("hinge", cart, upper, q2))
    s.add_joint(sd.Revolute("elbow", upper, lower, q3, parent_point=vector(l, 0)))
    s.add_joint_force(hinge, tau)
    s.add_force(lower, vector(-d * q1.dot, 0), point=vector(l, 0))
    s.defaults = {m: 1.0, I: 0.1, l: 0.5, g: 9.81, d: 0.2}
    return s


def pendulums(*numbers: int) -> sd.System:
    """Double pendulums side by side that do not touch each other."""
    name = "side_by_side_" + "_".join(map(str, numbers))
    g = sd.parameters("g")
    s = sd.System(name, gravity=[0, -g])
    s.defaults = {g: 9.81}
    for n in numbers:
        parent: Any = s.ground
        for part in "ab":
            q = sd.coordinates(f"q{part}{n}")
            m, l = sd.parameters(f"m{part}{n} l{part}{n}")
            body = s.add_body(f"body_{part}{n}", mass=m, com=[0, -l])
            point = [0, 0] if part == "a" else [0, -sd.parameters(f"la{n}")]
            s.add_joint(sd.Revolute(f"hinge_{part}{n}", parent, body, q, parent_point=point))
            s.defaults |= {m: 1.0 + n / 10, l: 1.0}
            parent = body
    return s


def arm_of_points() -> sd.System:
    """Two massless rods with a mass at the tip only, no gravity: stretched out (q2 = 0), M_tilde has rank 1."""
    q1, q2 = sd.coordinates("q1 q2")
    m, l = sd.parameters("m l")
    s = sd.System("arm_of_points", planar=True)
    upper, lower = s.add_body("upper"), s.add_body("lower", mass=m, com=[l, 0])
    s.add_joint(sd.Revolute("shoulder", s.ground, upper, q1))
    s.add_joint(sd.Revolute("elbow", upper, lower, q2, parent_point=[l, 0]))
    s.defaults = {m: 1.0, l: 1.0}
    s.initial = {q1: -0.5, q2: 1.0}
    return s


def driven_oscillator() -> sd.System:
    """A mass on a spring and damper with two inputs and a filter state: linear, so that much is known in closed form."""
    q, z = sd.coordinates("q z")
    m, k, d = sd.parameters("m k d")
    F, G = sd.inputs("F G")
    s = sd.System("driven_oscillator", planar=True)
    mass = s.add_body("mass", mass=m)
    rail = s.add_joint(sd.Prismatic("rail", s.ground, mass, q, axis=[1, 0]))
    s.add_joint_force(rail, F + 2 * G - k * q - d * q.dot)
    s.add_state(z, F - z)
    s.add_output("force", k * q)
    s.defaults = {m: 2.0, k: 3.0, d: 0.1}
    s.initial = {q: 1.0, z: 0.5, G: 0.25}
    s.duration = 5.0
    return s


def awkward_names() -> sd.System:
    """Symbols with names that mean something in C, Python or JavaScript, or in the generated code itself."""
    q1, q2 = sp.symbols("x double", cls=type(sd.coordinates("q")))
    mass, inertia, length, other, rhs, sign, theta = (
        sp.Symbol(n) for n in ("lambda", "out", "sin_x", "awkward_names_rhs", "rhs", "symdyn_sign", "θ rod"))
    s = sd.System("awkward_names", gravity=[0, -sp.Symbol("c")])
    a = s.add_body("{a}", mass=mass, inertia=inertia, com=[length, 0])
    b = s.add_body("b'", mass=other, inertia=rhs, com=[sign, 0])
    s.add_joint(sd.Revolute("int", s.ground, a, q1))
    s.add_joint(sd.Revolute("%d", a, b, q2, parent_point=[theta, 0]))
    s.add_joint_force("int", sp.sign(q1) * sp.Symbol("function") - sp.sin(q1) * sp.Symbol("M_tilde_1_1"), name="# 100 %s")
    s.defaults = {p: 0.7 + k / 10 for k, p in enumerate((mass, inertia, length, other, rhs, sign, theta))}
    return s


def split_by_fixed_joint(split: bool) -> sd.System:
    """A pendulum whose body is one, or two parts held together by a fixed joint at the body's origin."""
    q1, q2 = sd.coordinates("q1 q2")
    g, m, I, l, n, b = sd.parameters("g m I l n b")
    s = sd.System("split", gravity=[0, -g])
    first = s.add_body("first", mass=m, inertia=I, com=[l, 0])
    s.add_joint(sd.Revolute("hinge", s.ground, first, q1))
    second = s.add_body("second", mass=n, com=[b, 0])
    s.add_joint(sd.Revolute("elbow", first, second, q2, parent_point=[l, 0]))
    if split:
        s.add_joint(sd.Fixed("weld", second, s.add_body("third", mass=n, com=[2 * b, 0])))
    return s


def four_bar_linkage() -> sd.System:
    """The four-bar linkage of the README: 0.125 m open at its initial angles."""
    q1, q2, q3 = sd.coordinates("q1:4")
    g, m, l1, l2, l3, d = sd.parameters("g m l1 l2 l3 d", positive=True)
    s = sd.System("linkage", gravity=[0, -g])
    parent, at = s.ground, [0, 0]
    for hinge, q, l in zip("ABC", (q1, q2, q3), (l1, l2, l3), strict=True):
        bar = s.add_body(f"bar {hinge}", mass=m, inertia=m * l**2 / 12, com=[l / 2, 0])
        s.add_joint(sd.Revolute(hinge, parent, bar, q, parent_point=at))
        parent, at = bar, [l, 0]
    s.close_loop(sd.Revolute("D", s.ground, bar, parent_point=[d, 0], child_point=at))
    s.defaults = {g: 9.81, m: 1, l1: 0.8, l2: 1.8, l3: 1.6, d: 2}
    s.initial = {q1: 1, "q2": -0.5, q3: -2}
    return s


def strange() -> sd.System:
    """All operations, symbols whose names differ in capitals alone or are words of a language."""
    q, Q = sd.coordinates("q Q")
    m, M, e, block, fn, end = sd.parameters("m M e block fn end")
    F = sd.inputs("F")
    system = sd.System("strange", gravity=[0, -9.81])
    a = system.add_body("a", mass=m, inertia=1)
    b = system.add_body("b", mass=M, inertia=1, com=[0.3, 0])
    system.add_joint(sd.Prismatic("slide", system.ground, a, q, axis=[1, 0]))
    system.add_joint(sd.Revolute("turn", a, b, Q))
    x = q / 4
    unary = [sp.tan(x), sp.asin(x), sp.acos(x), sp.atan(x), sp.sinh(x), sp.cosh(x), sp.tanh(x), sp.asinh(x), sp.acosh(x + 3),
             sp.atanh(x), sp.exp(x), sp.log(x + 3), sp.Abs(x), sp.sign(x), sp.floor(7 * x), sp.ceiling(7 * x), sp.erf(x),
             sp.Min(x, Q), sp.Max(x, Q), sp.atan2(x, Q), (x + 3) ** sp.Rational(7, 3), sp.sqrt(x + 3), sp.Heaviside(x)]
    several = sp.Piecewise((e, (x < Q) & (Q > 0)), (block, sp.Or(sp.Eq(x, Q), x >= Q)), (fn, sp.Ne(x, 1) & (x >= 0)), (end, True))
    system.add_output("values", [*unary, several, F * sp.cos(sd.t)])
    system.add_force(a, [F, 0])
    return system.set_defaults({m: 1.0, M: 2.0, e: 0.5, block: 1.5, fn: 2.5, end: 3.5})
