"""Watt's flyball governor."""

from __future__ import annotations

import math

from symdyn.errors import ModelError
from symdyn.model.closures import Rod
from symdyn.model.joints import Fixed, Prismatic, Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System


def flyball_governor(links: str = "springs") -> System:
    """A flyball governor: two arms with balls on a turning shaft, tied to a slider on it.

    The n-frame has its origin at the foot of the shaft, z upward along it. The coordinate phi (rad) turns the shaft about z,
    s (m) is the height of the slider, beta1 and beta2 (rad) are the angles of the arms below the horizontal: arm 1 is hinged
    at (a, 0, h) of the shaft and points along (cos beta1, 0, -sin beta1), arm 2 at (-a, 0, h) and points along
    (-cos beta2, 0, -sin beta2). Between the middle of each arm and the point (a, 0, 0), or (-a, 0, 0), of the slider there is

    links
        "springs"   a stiff spring with a damper (K, C, l0): the published system, a tree without loops
        "rods"      a massless rod of length l0: two loops

    It starts with the arms 30 degrees below the horizontal, turning at 2 pi rad/s.

    Parameters: g (m/s^2, along -z); of shaft and arms alike m mass (kg), l length (m), I_a inertia about the axis and I_t across
    it, at the middle (kg m^2); m_b mass of a ball, at the end of an arm, m_s of the slider (kg), I_s inertia of the
    slider about z (kg m^2), a, h (m), l0 (m), and with springs K (N/m) and C (N s/m). Shaft and arms are 1 m long with a square
    section of 0.01 m, the slider is a cube of 0.1 m, both of 3000 kg/m^3.
    Source: problem A05, stiff flyball governor, IFToMM library of computational benchmark problems.
    """
    if links not in ("springs", "rods"):
        raise ModelError([f"flyball_governor was asked for links {links!r}; pass 'springs' or 'rods'"])
    beta = coordinates("beta1:3")
    s, phi = coordinates("s phi")
    g, m, length, I_a, I_t, m_b, m_s, I_s, a, h, l0, K, C = parameters("g m l I_a I_t m_b m_s I_s a h l0 K C")
    system = System("flyball_governor" if links == "springs" else "flyball_governor_rods", gravity=[0, 0, -g])
    shaft = system.add_body("shaft", mass=m, inertia=[I_t, I_t, I_a], com=[0, 0, length / 2])
    slider = system.add_body("slider", mass=m_s, inertia=[I_s, I_s, I_s])
    system.add_joint(Revolute("foot", system.ground, shaft, phi))
    system.add_joint(Prismatic("guide", shaft, slider, s, axis=[0, 0, 1]))
    for i, side in enumerate((1, -1)):
        arm = system.add_body(f"arm{i + 1}", mass=m, inertia=[I_a, I_t, I_t], com=[side * length / 2, 0, 0])
        ball = system.add_body(f"ball{i + 1}", mass=m_b)
        system.add_joint(Revolute(f"hinge{i + 1}", shaft, arm, beta[i], axis=[0, side, 0], parent_point=[side * a, 0, h]))
        system.add_joint(Fixed(f"end{i + 1}", arm, ball, parent_point=[side * length, 0, 0]))
        ends = [side * a, 0, 0], [side * length / 2, 0, 0]
        if links == "springs":
            system.add_spring_damper(slider, arm, *ends, stiffness=K, damping=C, length=l0, name=f"link{i + 1}")
        else:
            system.close_loop(Rod(f"link{i + 1}", slider, arm, l0, parent_point=ends[0], child_point=ends[1]))
    system.defaults = {g: 9.81, m: 0.3, length: 1.0, I_a: 0.3 * 2e-4 / 12, I_t: 0.3 * (1 + 1e-4) / 12, m_b: 5.0, m_s: 3.0,
                       I_s: 3.0 * 0.01 / 6, a: 0.05, h: 1.0, l0: 0.5}
    if links == "springs":
        system.defaults |= {K: 8e5, C: 4e4}
    system.initial = {**dict.fromkeys(beta, math.pi / 6), s: 0.5, phi.dot: 2 * math.pi}
    system.duration = 10.0
    return system
