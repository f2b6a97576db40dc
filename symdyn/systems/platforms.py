"""A platform on six legs."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.model import shapes
from symdyn.model.joints import Free, Prismatic, Spherical, Universal
from symdyn.model.orientation import EulerAngles
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]
# Degrees about the vertical of the joints on the base and on the platform, leg by leg.
BASE, PLATFORM = (-15, 15, 105, 135, 225, 255), (-45, 45, 75, 165, 195, 285)


def stewart_platform() -> System:
    """A Stewart platform: six legs, each a universal, a prismatic and a spherical joint (UPS), carry a platform.

    The n-frame has z upward and its origin in the middle of the base. x, y, z (m) is the middle of the platform's joints, a, b, c
    (rad) are its angles XYZ. Leg i has a cylinder on a universal joint on the base, at the distance r_b from the origin and at
    -15, 15, 105, 135, 225, 255 degrees about z, turned by alpha_i about x, then by beta_i about y (rad): at 0 it stands upright;
    and a rod that slides in it along its z axis, si (m) from joint to joint. The rod ends in a ball joint on the platform, at r_p
    from its middle and at -45, 45, 75, 165, 195, 285 degrees. The loops are cut at these: 24 coordinates, 18 constraints, six
    degrees of freedom. It starts 1.2 m above the base, level, rising at 0.1 m/s; the initial forces hold it there at rest.

    Inputs: F1 ... F6 (N), the forces along the legs, positive where they push the platform.
    Parameters: g (m/s^2, along -z); r_b, r_p (m); of the platform m_p (kg) and I_px, I_pz at its centre of mass (kg m^2), which
    is h_p above its joints (m); of every cylinder m_c, its centre of mass l_c from the lower joint, of every rod m_r, l_r from
    the upper joint, and Ic_t, Ic_a, Ir_t, Ir_a across the leg and along it.
    Source of the form: Stewart, A platform with six degrees of freedom, Proc. Inst. Mech. Eng. 180, 1965; Merlet, Parallel
    Robots, 2006 (6-UPS).
    """
    x, y, z, a, b, c = coordinates("x y z a b c")
    g, r_b, r_p = parameters("g r_b r_p")
    m_p, I_px, I_pz, h_p, m_c, l_c, Ic_t, Ic_a, m_r, l_r, Ir_t, Ir_a = parameters(
        "m_p I_px I_pz h_p m_c l_c Ic_t Ic_a m_r l_r Ir_t Ir_a")
    alphas, betas, lengths = coordinates("alpha1:7"), coordinates("beta1:7"), coordinates("s1:7")
    forces = inputs("F1:7")
    system = System("stewart_platform", gravity=[0, 0, -g])
    platform = system.add_body("platform", mass=m_p, inertia=[I_px, I_px, I_pz], com=[0, 0, h_p])
    system.add_joint(Free("motion", system.ground, platform, [x, y, z, a, b, c], EulerAngles("XYZ")))
    numbers = {g: 9.81, r_b: 1.0, r_p: 0.6, m_p: 40.0, I_px: 4.0, I_pz: 7.0, h_p: 0.05, m_c: 4.0, l_c: 0.35, Ic_t: 0.16,
               Ic_a: 0.004, m_r: 2.5, l_r: 0.4, Ir_t: 0.12, Ir_a: 0.001}
    height, rise = 1.2, 0.1
    system.initial = {z: height, z.dot: rise}
    for i, (alpha, beta, s, F) in enumerate(zip(alphas, betas, lengths, forces, strict=True)):
        cylinder = system.add_body(f"cylinder{i + 1}", mass=m_c, inertia=[Ic_t, Ic_t, Ic_a], com=[0, 0, l_c])
        rod = system.add_body(f"rod{i + 1}", mass=m_r, inertia=[Ir_t, Ir_t, Ir_a], com=[0, 0, -l_r])
        foot, tip = (_around(radius, angle) for radius, angle in ((r_b, BASE[i]), (r_p, PLATFORM[i])))
        system.add_joint(Universal(f"foot{i + 1}", system.ground, cylinder, [alpha, beta], axes=(X, Y), parent_point=foot))
        leg = system.add_joint(Prismatic(f"leg{i + 1}", cylinder, rod, s, axis=Z))
        system.add_joint_force(leg, F)
        system.close_loop(Spherical(f"tip{i + 1}", platform, rod, parent_point=tip))
        system.draw(cylinder, shapes.Cylinder([0, 0, 0], [0, 0, 2 * l_c], 0.04, 0.04), color="#4a6a8a")
        system.draw(rod, shapes.Cylinder([0, 0, 0], [0, 0, -2 * l_r], 0.02, 0.02), color="0.7")
        dx, dy = (float((end - begin).xreplace(numbers)) for begin, end in zip(foot[:2], tip[:2], strict=True))
        length = math.hypot(dx, dy, height)
        upright = math.hypot(dy, height) / length  # cos beta
        rate = rise * height / length
        system.initial |= {alpha: math.atan2(-dy, height), beta: math.atan2(dx, math.hypot(dy, height)), s: length,
                           alpha.dot: dy * rise / (dy**2 + height**2), beta.dot: -dx * rate / (length**2 * upright), s.dot: rate}
        # Moments about the foot give the force across the leg, the balance of the platform that along it.
        sine, cosine = math.hypot(dx, dy) / length, height / length
        weight = {k: numbers[mass] * 9.81 for k, mass in (("p", m_p), ("c", m_c), ("r", m_r))}
        across = sine * (weight["c"] * numbers[l_c] + weight["r"] * (length - numbers[l_r])) / length
        system.initial |= {F: (weight["p"] / 6 + across * sine) / cosine + weight["r"] * cosine}
    rim = [_around(r_p, angle) for angle in sorted(PLATFORM)]
    system.draw(platform, shapes.Line([*rim, rim[0]], 4.0), color="#7a4b8a")
    system.defaults = numbers
    system.units = dict.fromkeys((r_b, r_p, h_p, l_c, l_r), "m")
    system.duration = 1.0
    return system


def _around(radius: sp.Symbol, degrees: int) -> list[sp.Expr]:
    """A point at a distance from the origin in the plane z = 0."""
    angle = math.radians(degrees)
    return [math.cos(angle) * radius, math.sin(angle) * radius, sp.Integer(0)]
