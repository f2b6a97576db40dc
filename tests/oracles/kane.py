"""Kane's method for the mechanisms of the catalogue, by sympy.physics.mechanics.

Written from the description of each mechanism with reference frames, points and bodies, without any of symdyn's model.
Every function returns `accelerations(q, u, params) -> (n,)`: the derivatives of the speeds u = q_dot, worked out with
30 digits and rounded once. `params` has a number for every parameter and input, by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np
import sympy as sp
from sympy.physics import mechanics as me

Accelerations = Callable[[Sequence[float], Sequence[float], Mapping[str, float]], np.ndarray]

DIGITS = 30


@dataclass
class Scene:
    """An inertial frame with a fixed origin, coordinates q with speeds u, and what Kane's equations are formed from."""

    n: int
    q: list[Any] = field(init=False)
    u: list[Any] = field(init=False)
    bodies: list[Any] = field(default_factory=list)
    loads: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.N = me.ReferenceFrame("N")
        self.O = me.Point("O")
        self.O.set_vel(self.N, 0)
        self.q = [me.dynamicsymbols(f"q{i + 1}") for i in range(self.n)]
        self.u = [me.dynamicsymbols(f"u{i + 1}") for i in range(self.n)]

    def turned(self, parent: Any, name: str, i: int, axis: Any) -> Any:
        """A frame turned by q_i about an axis of the parent."""
        frame = parent.orientnew(name, "Axis", [self.q[i], axis])
        frame.set_ang_vel(parent, self.u[i] * axis)
        return frame

    def fixed_on(self, point: Any, frame: Any, name: str, offset: Any) -> Any:
        """A point at an offset that is constant in a frame, on a body that the given point belongs to."""
        new = point.locatenew(name, offset)
        new.v2pt_theory(point, self.N, frame)
        return new

    def weigh(self, body: Any, com: Any, force: Any) -> None:
        """Add a body and its weight."""
        self.bodies.append(body)
        self.loads.append((com, force))

    def accelerations(self, names: Sequence[str]) -> Accelerations:
        """Form Kane's equations; the named symbols come from `params`, in this order."""
        rates = [u - q.diff() for q, u in zip(self.q, self.u, strict=True)]
        kane = me.KanesMethod(self.N, q_ind=self.q, u_ind=self.u, kd_eqs=rates)
        kane.kanes_equations(self.bodies, self.loads)
        arguments = [*self.q, *self.u, *sp.symbols(names)]
        evaluate = sp.lambdify(arguments, [kane.mass_matrix, kane.forcing], modules="mpmath", cse=True)

        def accelerations(q: Sequence[float], u: Sequence[float], params: Mapping[str, float]) -> np.ndarray:
            with mpmath.workdps(DIGITS):
                values = [mpmath.mpf(float(v)) for v in (*q, *u, *(params[name] for name in names))]
                mass, forcing = evaluate(*values)
                return np.array([float(a) for a in mpmath.lu_solve(mass, forcing)])

        return accelerations


def _dyadic(frame: Any, xx: Any, yy: Any, zz: Any, xy: Any = 0, yz: Any = 0, xz: Any = 0) -> Any:
    return me.inertia(frame, xx, yy, zz, xy, yz, xz)


def kane_pendulum() -> Accelerations:
    """Point mass on a rod, angle from the downward vertical."""
    s = Scene(1)
    m, l, g = sp.symbols("m l g")
    A = s.turned(s.N, "A", 0, s.N.z)
    P = s.fixed_on(s.O, A, "P", -l * A.y)
    s.weigh(me.Particle("bob", P, m), P, -m * g * s.N.y)
    return s.accelerations(["m", "l", "g"])


def kane_n_link_pendulum(n: int) -> Accelerations:
    """Rods hinged one to the next, relative angles, zero along x, gravity along -y."""
    s = Scene(n)
    g = sp.Symbol("g")
    names = ["g"]
    frame, hinge = s.N, s.O
    for i in range(n):
        own = [f"m{i + 1}", f"I{i + 1}", f"lc{i + 1}"] + [f"l{i + 1}"] * (i < n - 1)
        m, inertia, lc, *l = sp.symbols(own)
        names += own
        frame = s.turned(frame, f"A{i + 1}", i, s.N.z)
        G = s.fixed_on(hinge, frame, f"G{i + 1}", lc * frame.x)
        s.weigh(me.RigidBody(f"rod{i + 1}", G, frame, m, (_dyadic(frame, 0, 0, inertia), G)), G, -m * g * s.N.y)
        if l:
            hinge = s.fixed_on(hinge, frame, f"O{i + 2}", l[0] * frame.x)
    return s.accelerations(names)


def kane_double_pendulum() -> Accelerations:
    """Two rods."""
    return kane_n_link_pendulum(2)


def kane_cart_pole() -> Accelerations:
    """Cart along x with a pole, angle from the upward vertical; F pushes the cart along x."""
    s = Scene(2)
    names = ["g", "m_c", "m_p", "I_p", "l", "F"]
    g, m_c, m_p, I_p, l, F = sp.symbols(names)
    C = s.O.locatenew("C", s.q[0] * s.N.x)
    C.set_vel(s.N, s.u[0] * s.N.x)
    A = s.turned(s.N, "A", 1, s.N.z)
    G = s.fixed_on(C, A, "G", l * A.y)
    s.weigh(me.Particle("cart", C, m_c), C, F * s.N.x - m_c * g * s.N.y)
    s.weigh(me.RigidBody("pole", G, A, m_p, (_dyadic(A, 0, 0, I_p), G)), G, -m_p * g * s.N.y)
    return s.accelerations(names)


def kane_vehicle_on_track() -> Accelerations:
    """Particle on a fixed track that falls towards +x at the angle theta."""
    s = Scene(1)
    names = ["m", "g", "theta"]
    m, g, theta = sp.symbols(names)
    direction = sp.cos(theta) * s.N.x - sp.sin(theta) * s.N.y
    P = s.O.locatenew("P", s.q[0] * direction)
    P.set_vel(s.N, s.u[0] * direction)
    s.weigh(me.Particle("vehicle", P, m), P, -m * g * s.N.y)
    return s.accelerations(names)


def kane_vehicle_on_rotating_track(track_inertia: bool = True) -> Accelerations:
    """Particle on a track hinged at its centre of mass; r = -q1 (cos q2, sin q2), massless: r = q1 (cos q2, -sin q2)."""
    s = Scene(2)
    (q1, q2), (u1, u2) = s.q, s.u
    names = ["g", "m_v", "m_t", "I_t"] if track_inertia else ["g", "m"]
    g, m, *track = sp.symbols(names)
    if track_inertia:
        x, y = -q1 * sp.cos(q2), -q1 * sp.sin(q2)
    else:
        x, y = q1 * sp.cos(q2), -q1 * sp.sin(q2)
    rates = {q1.diff(): u1, q2.diff(): u2}
    P = s.O.locatenew("P", x * s.N.x + y * s.N.y)
    P.set_vel(s.N, x.diff(me.dynamicsymbols._t).subs(rates) * s.N.x + y.diff(me.dynamicsymbols._t).subs(rates) * s.N.y)
    s.weigh(me.Particle("vehicle", P, m), P, -m * g * s.N.y)
    if track_inertia:
        m_t, I_t = track
        A = s.turned(s.N, "A", 1, s.N.z)
        s.weigh(me.RigidBody("track", s.O, A, m_t, (_dyadic(A, 0, 0, I_t), s.O)), s.O, -m_t * g * s.N.y)
    return s.accelerations(names)


def kane_prismatic_chain(n: int = 2) -> Accelerations:
    """Bodies on a line, F_i from body i - 1 on body i."""
    s = Scene(n)
    names = [f"{letter}{i + 1}" for i in range(n) for letter in ("m", "l", "F")]
    G, ahead = s.O, 0
    for i in range(n):
        m, l, F = sp.symbols([f"m{i + 1}", f"l{i + 1}", f"F{i + 1}"])
        before = G
        G = before.locatenew(f"G{i + 1}", (s.q[i] + l - ahead) * s.N.x)
        G.set_vel(s.N, before.vel(s.N) + s.u[i] * s.N.x)
        s.weigh(me.Particle(f"body{i + 1}", G, m), G, F * s.N.x)
        if i:
            s.loads.append((before, -F * s.N.x))
        ahead = l
    return s.accelerations(names)


def kane_spatial_chain(n: int) -> Accelerations:
    """Bodies with revolute joints about z, y, x in turn, the next joint at (l, 0, 0); gravity along -z."""
    s = Scene(n)
    g = sp.Symbol("g")
    names = ["g"]
    frame, joint = s.N, s.O
    for k in range(1, n + 1):
        own = [f"m{k}", *(f"c{k}_{a}" for a in "xyz"), *(f"I{k}_{p}" for p in ("xx", "yy", "zz", "xy", "yz", "xz"))]
        names += own
        m, x, y, z, *inertia = sp.symbols(own)
        frame = s.turned(frame, f"A{k}", k - 1, (frame.z, frame.y, frame.x)[(k - 1) % 3])
        G = s.fixed_on(joint, frame, f"G{k}", x * frame.x + y * frame.y + z * frame.z)
        s.weigh(me.RigidBody(f"body{k}", G, frame, m, (_dyadic(frame, *inertia), G)), G, -m * g * s.N.z)
        if k < n:
            names.append(f"l{k}")
            joint = s.fixed_on(joint, frame, f"O{k + 1}", sp.Symbol(f"l{k}") * frame.x)
    return s.accelerations(names)


def kane_flyball_governor() -> Accelerations:
    """Shaft about z, slider on it, two arms with balls, a spring and damper from the slider to the middle of each arm."""
    s = Scene(4)
    names = ["g", "m", "l", "I_a", "I_t", "m_b", "m_s", "I_s", "a", "h", "l0", "K", "C"]
    g, m, l, I_a, I_t, m_b, m_s, I_s, a, h, l0, K, C = sp.symbols(names)
    A = s.turned(s.N, "A", 0, s.N.z)
    shaft = s.fixed_on(s.O, A, "G", l / 2 * A.z)
    s.weigh(me.RigidBody("shaft", shaft, A, m, (_dyadic(A, I_t, I_t, I_a), shaft)), shaft, -m * g * s.N.z)
    P = s.O.locatenew("P", s.q[1] * A.z)
    P.set_vel(s.N, s.u[1] * A.z)
    s.weigh(me.RigidBody("slider", P, A, m_s, (_dyadic(A, I_s, I_s, I_s), P)), P, -m_s * g * s.N.z)
    for k, side in enumerate((1, -1)):
        B = s.turned(A, f"B{k}", 2 + k, side * A.y)
        hinge = s.fixed_on(s.O, A, f"H{k}", side * a * A.x + h * A.z)
        middle = s.fixed_on(hinge, B, f"M{k}", side * l / 2 * B.x)
        ball = s.fixed_on(hinge, B, f"E{k}", side * l * B.x)
        foot = s.fixed_on(P, A, f"Q{k}", side * a * A.x)
        s.weigh(me.RigidBody(f"arm{k}", middle, B, m, (_dyadic(B, I_a, I_t, I_t), middle)), middle, -m * g * s.N.z)
        s.weigh(me.Particle(f"ball{k}", ball, m_b), ball, -m_b * g * s.N.z)
        reach = middle.pos_from(hinge) + hinge.pos_from(s.O) - s.q[1] * A.z - side * a * A.x
        length = sp.sqrt(reach.dot(reach))
        rate = reach.dot(middle.vel(s.N) - foot.vel(s.N)) / length
        pull = (K * (length - l0) + C * rate) / length * reach
        s.loads += [(middle, -pull), (foot, pull)]
    return s.accelerations(names)


def kane_two_link_arm() -> Accelerations:
    """Two links in the vertical plane, torques tau1 from the ground and tau2 between the links."""
    s = Scene(2)
    names = ["g", "m1", "I1", "lc1", "l1", "m2", "I2", "lc2", "tau1", "tau2"]
    g, m1, I1, lc1, l1, m2, I2, lc2, tau1, tau2 = sp.symbols(names)
    A = s.turned(s.N, "A", 0, s.N.z)
    B = s.turned(A, "B", 1, A.z)
    G1 = s.fixed_on(s.O, A, "G1", lc1 * A.x)
    O2 = s.fixed_on(s.O, A, "O2", l1 * A.x)
    G2 = s.fixed_on(O2, B, "G2", lc2 * B.x)
    s.weigh(me.RigidBody("link1", G1, A, m1, (_dyadic(A, 0, 0, I1), G1)), G1, -m1 * g * s.N.y)
    s.weigh(me.RigidBody("link2", G2, B, m2, (_dyadic(B, 0, 0, I2), G2)), G2, -m2 * g * s.N.y)
    s.loads += [(A, (tau1 - tau2) * s.N.z), (B, tau2 * s.N.z)]
    return s.accelerations(names)


def kane_three_link_arm() -> Accelerations:
    """Three links along their x axes, joints about z, y, x; gravity along -z; torques between neighbours."""
    s = Scene(3)
    g = sp.Symbol("g")
    names = ["g"]
    frame, joint = s.N, s.O
    for k in (1, 2, 3):
        own = [f"m{k}", f"I{k}_xx", f"I{k}_yy", f"I{k}_zz", f"lc{k}", f"tau{k}"] + [f"l{k}"] * (k < 3)
        names += own
        m, xx, yy, zz, lc, tau, *l = sp.symbols(own)
        before, axis = frame, (frame.z, frame.y, frame.x)[k - 1]
        frame = s.turned(before, f"A{k}", k - 1, axis)
        G = s.fixed_on(joint, frame, f"G{k}", lc * frame.x)
        s.weigh(me.RigidBody(f"link{k}", G, frame, m, (_dyadic(frame, xx, yy, zz), G)), G, -m * g * s.N.z)
        s.loads += [(frame, tau * axis)] + [(before, -tau * axis)] * (k > 1)
        if l:
            joint = s.fixed_on(joint, frame, f"O{k + 1}", l[0] * frame.x)
    return s.accelerations(names)


# Rows (quarter turns of the twist, name of the length along x, name of the offset along z).
PUMA560 = {
    "standard": ((1, "", ""), (0, "a2", ""), (-1, "a3", "d3"), (1, "", "d4"), (-1, "", ""), (0, "", "")),
    "modified": ((0, "", ""), (-1, "", "d2"), (0, "a2", "d3"), (1, "a3", "d4"), (-1, "", ""), (1, "", "")),
}


def kane_puma560(convention: str, given: Sequence[str], links: int = 6) -> Accelerations:
    """The PUMA 560 by its Denavit-Hartenberg rows, gravity along -z.

    given   names of the parameters that are not zero; the others are left out of the derivation
    links   how many links there are, from the base on
    """
    s = Scene(links)

    def value(name: str) -> Any:
        return sp.Symbol(name) if name in given else sp.S.Zero

    frame, origin = s.N, s.O
    for k, (quarters, a_name, d_name) in enumerate(PUMA560[convention][:links], start=1):
        a, d, twist = value(a_name), value(d_name), quarters * sp.pi / 2
        parent = frame
        if convention == "standard":  # turn about z, go d along z and a along the new x, twist about the new x
            turned = s.turned(parent, f"B{k}", k - 1, parent.z)
            frame = turned.orientnew(f"A{k}", "Axis", [twist, turned.x])
            frame.set_ang_vel(turned, 0)
            origin = s.fixed_on(origin, turned, f"O{k}", d * turned.z + a * turned.x)
        else:  # go a along x, twist about x, turn about the new z, go d along it
            twisted = parent.orientnew(f"B{k}", "Axis", [twist, parent.x])
            twisted.set_ang_vel(parent, 0)
            frame = s.turned(twisted, f"A{k}", k - 1, twisted.z)
            origin = s.fixed_on(origin, parent, f"O{k}", a * parent.x + d * twisted.z)
        m, x, y, z = (value(f"{name.format(k)}") for name in ("m{}", "c{}_x", "c{}_y", "c{}_z"))
        G = s.fixed_on(origin, frame, f"G{k}", x * frame.x + y * frame.y + z * frame.z)
        inertia = [value(f"I{k}_{pair}") for pair in ("xx", "yy", "zz", "xy", "yz", "xz")]
        s.weigh(me.RigidBody(f"link{k}", G, frame, m, (_dyadic(frame, *inertia), G)), G, -m * value("g") * s.N.z)
    return s.accelerations(list(given))
