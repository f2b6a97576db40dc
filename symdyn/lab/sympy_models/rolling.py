"""Rolling mechanisms: the Carvallo-Whipple bicycle, a disc, a rattleback, and the snakeboard."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.physics.mechanics import KanesMethod, Point, ReferenceFrame, RigidBody, dynamicsymbols, inertia

from symdyn.lab.sympy_models.example import Derived


def bicycle() -> Derived:
    """The Carvallo-Whipple bicycle: rear wheel, rear frame with rider, fork with handlebar, front wheel; z points down.

    Yaw, roll, pitch of the rear frame, steer angle; the rear wheel rolls by the choice of speeds, the front wheel by constraints.
    """
    yaw, roll, pitch, steer = dynamicsymbols("yaw roll pitch steer")
    u1, u2, u3, u4, u5, u6 = dynamicsymbols("u1:7")
    w, c, tilt, g, r_R, r_F = sp.symbols("w c lambda_ g r_R r_F")
    x_B, z_B, x_H, z_H = sp.symbols("x_B z_B x_H z_H")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [yaw, N.z])
    B = A.orientnew("B", "Axis", [roll, A.x])
    C = B.orientnew("C", "Axis", [pitch, B.y])
    axis = sp.sin(tilt) * C.x + sp.cos(tilt) * C.z
    H = C.orientnew("H", "Axis", [steer, axis])
    R, F = ReferenceFrame("R"), ReferenceFrame("F")
    for frame, before, spin in ((A, N, u1 * N.z), (B, A, u2 * A.x), (C, B, u3 * B.y), (H, C, u5 * axis), (R, C, u4 * C.y),
                                (F, H, u6 * H.y)):
        frame.set_ang_vel(before, spin)
    contact = Point("P")
    contact.set_vel(N, 0)
    rear = contact.locatenew("R_o", -r_R * B.z)
    rear.set_vel(N, R.ang_vel_in(N).cross(-r_R * B.z).express(B))
    body = rear.locatenew("B_o", x_B * C.x + (z_B + r_R) * C.z)
    head = rear.locatenew("S", (w + c) * C.x + r_R * C.z)
    fork = head.locatenew("H_o", (x_H - w - c) * H.x + z_H * H.z)
    front = head.locatenew("F_o", -c * H.x - r_F * H.z)
    for point, of, frame in ((body, rear, C), (head, rear, C), (fork, head, H), (front, head, H)):
        point.v2pt_theory(of, N, frame)
    down = (A.z - H.y.dot(A.z) * H.y).normalize()
    touching = front.locatenew("Q", r_F * down)
    slip = front.vel(N) + F.ang_vel_in(N).cross(r_F * down)

    def rigid(name: str, center: Any, frame: Any, axes: Any, letter: str, wheel: bool) -> Any:
        xx, yy, zz, xz = sp.symbols(" ".join(f"I_{letter}{e}" for e in ("xx", "yy", "zz", "xz")))
        moments = inertia(axes, xx, yy, xx) if wheel else inertia(axes, xx, yy, zz, 0, 0, xz)
        return RigidBody(name, center, frame, sp.Symbol(f"m_{letter}"), (moments, center))

    bodies = [rigid("rear_wheel", rear, R, C, "R", True), rigid("frame", body, C, C, "B", False),
              rigid("fork", fork, H, H, "H", False), rigid("front_wheel", front, F, H, "F", True)]
    kinematics = [yaw.diff() - u1, roll.diff() - u2, pitch.diff() - u3, steer.diff() - u5]
    kane = KanesMethod(N, [yaw, roll, steer], [u2, u4, u5], kinematics,
                       q_dependent=[pitch], configuration_constraints=[touching.pos_from(contact).dot(A.z)],
                       u_dependent=[u1, u3, u6], velocity_constraints=[slip.dot(e) for e in (A.x, A.y, A.z)])
    kane.kanes_equations(bodies, [(b.masscenter, b.mass * g * N.z) for b in bodies])
    return Derived(kane)


def rolling_disc() -> Derived:
    """A thin disc that rolls without slip; yaw, lean, spin, and its angular velocity in leaning axes as speeds."""
    q1, q2, q3, u1, u2, u3 = dynamicsymbols("q1 q2 q3 u1 u2 u3")
    r, m, g = sp.symbols("r m g")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q1, N.z])
    L = Y.orientnew("L", "Axis", [q2, Y.x])
    R = L.orientnew("R", "Axis", [q3, L.y])
    turning = R.ang_vel_in(N)
    kinematics = [turning.dot(e) - u for e, u in zip((L.x, L.y, L.z), (u1, u2, u3), strict=True)]
    spin = u1 * L.x + u2 * L.y + u3 * L.z
    R.set_ang_vel(N, spin)
    contact = Point("C")
    contact.set_vel(N, 0)
    center = contact.locatenew("D", r * L.z)
    center.set_vel(N, spin.cross(r * L.z))
    center.set_acc(N, center.vel(N).dt(L) + (u1 * L.x + u3 * L.z + (u3 * sp.tan(q2)) * L.y).cross(center.vel(N)))
    disc = RigidBody("disc", center, R, m, (inertia(L, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4), center))
    kane = KanesMethod(N, [q1, q2, q3], [u1, u2, u3], kinematics)
    kane.kanes_equations([disc], [(center, -m * g * Y.z)])
    return Derived(kane)


def rattleback() -> Derived:
    """A half ellipsoid that rolls without slip, with its principal axes of inertia turned against those of its surface."""
    yaw, roll, pitch, x, y, w1, w2, w3 = dynamicsymbols("yaw roll pitch x y w1 w2 w3")
    a, b, c, h, m, g, I_x, I_y, I_z, I_xy, drag = sp.symbols("a b c h m g I_x I_y I_z I_xy sigma")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [yaw, N.z])
    L = Y.orientnew("L", "Axis", [roll, Y.x])
    R = L.orientnew("R", "Axis", [pitch, L.y])
    turning = R.ang_vel_in(N)
    kinematics = [turning.dot(e) - w for e, w in zip((R.x, R.y, R.z), (w1, w2, w3), strict=True)]
    spin = w1 * R.x + w2 * R.y + w3 * R.z
    R.set_ang_vel(N, spin)
    mu = [N.z.dot(e) for e in (R.x, R.y, R.z)]
    size = sp.sqrt(sum((s * e)**2 for s, e in zip((a, b, c), mu, strict=True)))
    below = sum((-s**2 * e / size * axis for s, e, axis in zip((a, b, c), mu, (R.x, R.y, R.z), strict=True)), 0 * R.x)
    center = Point("G")
    from_contact = -below - h * R.z  # the centre of mass, h below the centre of the ellipsoid
    center.set_vel(N, spin.cross(from_contact))
    velocity = spin.cross(-below)  # of the ellipsoid's centre
    kinematics += [x.diff() - velocity.dot(N.x), y.diff() - velocity.dot(N.y)]
    stone = RigidBody("stone", center, R, m, (inertia(R, I_x, I_y, I_z, I_xy), center))
    kane = KanesMethod(N, [yaw, roll, pitch, x, y], [w1, w2, w3], kinematics)
    kane.kanes_equations([stone], [(center, -m * g * N.z), (R, -drag * spin)])
    return Derived(kane)


def snakeboard() -> Derived:
    """A board on two pairs of wheels that are steered, with a rotor; wheels do not slip sideways.

    Torques drive the rotor and both steering axles.
    """
    x, y, theta, psi, front, back = dynamicsymbols("x y theta psi phi_f phi_b")
    v_x, v_y, w, w_r, w_f, w_b = u = dynamicsymbols("v_x v_y w w_r w_f w_b")
    T_r, T_f, T_b = dynamicsymbols("T_r T_f T_b")
    m, l, J, J_r, J_w = sp.symbols("m l J J_r J_w")
    N = ReferenceFrame("N")
    B = N.orientnew("B", "Axis", [theta, N.z])
    frames = {name: B.orientnew(name, "Axis", [angle, B.z]) for name, angle in (("D", psi), ("F", front), ("K", back))}
    B.set_ang_vel(N, w * N.z)
    for frame, rate in zip(frames.values(), (w_r, w_f, w_b), strict=True):
        frame.set_ang_vel(B, rate * B.z)
    origin = Point("O")
    origin.set_vel(N, 0)
    center = origin.locatenew("G", x * N.x + y * N.y)
    center.set_vel(N, v_x * N.x + v_y * N.y)
    axles = [center.locatenew("P_f", l * B.x), center.locatenew("P_b", -l * B.x)]
    for axle in axles:
        axle.v2pt_theory(center, N, B)
    slips = [axle.vel(N).dot(frames[name].y) for axle, name in zip(axles, "FK", strict=True)]

    def rigid(name: str, at: Any, frame: Any, mass: Any, moment: Any) -> Any:
        return RigidBody(name, at, frame, mass, (inertia(frame, 0, 0, moment), at))

    bodies = [rigid("board", center, B, m, J), rigid("rotor", center, frames["D"], 0, J_r),
              rigid("front", axles[0], frames["F"], 0, J_w), rigid("back", axles[1], frames["K"], 0, J_w)]
    loads = [(frames[name], torque * N.z) for name, torque in zip("DFK", (T_r, T_f, T_b), strict=True)]
    loads.append((B, -(T_r + T_f + T_b) * N.z))
    q = [x, y, theta, psi, front, back]
    kane = KanesMethod(N, q, [w, w_r, w_f, w_b], [a.diff() - b for a, b in zip(q, u, strict=True)], u_dependent=[v_x, v_y],
                       velocity_constraints=slips)
    kane.kanes_equations(bodies, loads)
    return Derived(kane)
